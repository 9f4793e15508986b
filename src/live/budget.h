/* What watching a render may cost: at most a share of the processor time that the process has used.
 *
 * The account counts two things: the processor time of the thread that serves, and for each picture taken the time of
 * the rendering thread times the number of rendering threads, which wait meanwhile. Before anything is spent, the
 * budget is asked. What a picture will cost is estimated from the last one: the first one is taken whatever it costs,
 * and paid off before the second. A small advance, granted once, is there from the beginning, so that a page opens at
 * once. A part of the share is kept for the end, when viewers fetch the last picture, together with the cost of
 * sending it once; earlier debts do not count then.
 *
 * Threads: the caller's lock. */
#ifndef CA_LIVE_BUDGET_H
#define CA_LIVE_BUDGET_H

#include <stdbool.h>

/* Shares of the process's processor time; advances beside them, in seconds of a processor. Of 30 s and more, shares
 * and advances come to 3 % at most. */
#define CA_LIVE_SHARE 0.02 /* while it renders */
#define CA_LIVE_ADVANCE 0.05
#define CA_LIVE_WHOLE_SHARE 0.025 /* with the end */
#define CA_LIVE_WHOLE_ADVANCE 0.1
#define CA_LIVE_SECONDS_PER_BYTE 2e-9 /* of the last picture */

typedef struct ca_live_budget {
    double share, advance;
    double start;        /* processor time of the process when the account was opened */
    double spent;        /* of a processor, in seconds */
    double picture_cost; /* of the last picture; 0: there was none */
} ca_live_budget;

ca_live_budget ca_live_budget_open(void);

/* The render is over: what was kept for it may be spent. `picture_bytes`: of the last picture. */
void ca_live_budget_end(ca_live_budget *budget, double process_seconds, double picture_bytes);

/* Is there enough left to spend `more`? `process_seconds`: processor time of the process by now. */
bool ca_live_budget_allows(const ca_live_budget *budget, double process_seconds, double more);

/* Processor time of the process, in seconds. */
double ca_live_process_seconds(void);

#endif
