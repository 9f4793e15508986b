/* Signals while rendering. SIGINT, SIGTERM, SIGHUP (the terminal has gone), SIGXCPU (the limit of processor time) and
 * SIGUSR2 (the one that mpirun passes on) ask to finish the pass and write the image; a pass that goes on for longer
 * than a second then is given up, unless several ranks render. A second SIGINT or SIGTERM ends the process at once;
 * the others do not count there, since they come by themselves, again and before these. SIGUSR1 asks for the picture
 * so far.
 *
 * A signal that was ignored when the program started (nohup) stays so. */
#ifndef CA_CLI_SIGNALS_H
#define CA_CLI_SIGNALS_H

#include <stdbool.h>

/* `quiet`: without the line that says what will happen now. Not to be called twice without a release. */
void ca_signals_catch(bool quiet);
/* Has one arrived since that asks to end? */
bool ca_signals_arrived(void);
/* For ca_render_settings.stop: set a second after the first of them. */
const int *ca_signals_stop(void);
/* Back to what was before. */
void ca_signals_release(void);

/* SIGUSR1, in brackets of its own. */
void ca_signals_catch_save(void);
/* Has it arrived since the last call? */
bool ca_signals_take_save(void);
void ca_signals_release_save(void);

#endif
