/* What looking at a render may cost it: at most a share of the processor time that the process has used.
 *
 * The account counts two things: the processor time of the thread that serves, and for each picture taken the time of the
 * rendering thread times the number of rendering threads, which wait meanwhile. Whoever wants to spend asks first; what a picture
 * will cost is told from the last one. A small advance, counted once, is there from the beginning, so that a page opens at once.
 *
 * Threads: the caller's lock. */
#ifndef CA_LIVE_BUDGET_H
#define CA_LIVE_BUDGET_H

#include <stdbool.h>

#define CA_LIVE_SHARE 0.03           /* of the process's processor time */
#define CA_LIVE_ADVANCE_SECONDS 0.05 /* of a processor, beside it */

typedef struct ca_live_budget {
    double start;        /* processor time of the process when the account was opened */
    double spent;        /* of a processor, in seconds */
    double picture_cost; /* of the last picture; 0: there was none */
} ca_live_budget;

ca_live_budget ca_live_budget_open(void);

/* Is there enough left to spend `more`? `process_seconds`: processor time of the process by now. */
bool ca_live_budget_allows(const ca_live_budget *budget, double process_seconds, double more);

/* Processor time of the process, in seconds. */
double ca_live_process_seconds(void);

#endif
