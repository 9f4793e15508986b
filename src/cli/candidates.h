/* What a shell may complete behind render's -i. */
#ifndef CA_CLI_CANDIDATES_H
#define CA_CLI_CANDIDATES_H

#include <stdio.h>

/* A line for each integrator, "path", and for each value of its parameters: "path:heuristic=balance",
 * "path:hide_emitters=true"; of numbers "path:max_depth=". */
void ca_candidates_print(FILE *stream);

#endif
