/* SIGINT and SIGTERM while rendering: the first asks to finish the pass and write the image, a second one ends the
 * process at once. */
#ifndef CA_CLI_SIGNALS_H
#define CA_CLI_SIGNALS_H

#include <stdbool.h>

/* `quiet`: without the line that says what will happen now. Not to be called twice without a release. */
void ca_signals_catch(bool quiet);
/* Has one arrived since? */
bool ca_signals_arrived(void);
/* Back to what was before. */
void ca_signals_release(void);

#endif
