/* What a shell may complete behind render's -i, and behind options whose values are names. */
#ifndef CA_CLI_CANDIDATES_H
#define CA_CLI_CANDIDATES_H

#include <stdio.h>

/* A line for each integrator, "path", and for each value of its parameters: "path:heuristic=balance",
 * "path:hide_emitters=true"; of numbers "path:max_depth=". */
void ca_candidates_print(FILE *stream);
/* "tone srgb": a line for each value of options that have names, of whichever command. */
void ca_candidates_print_values(FILE *stream);

#endif
