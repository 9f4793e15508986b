/* What watching a render may cost: a share of the processor time that the process has used, and a picture in 5
 * seconds whatever that costs.
 *
 * The account counts processor time that was used: by the thread that serves, and for each picture by the thread that
 * makes it. (The render's other threads wait meanwhile, and use none.) Before anything is spent, the budget is asked.
 * What a picture will cost is estimated from the last one. Two kinds of pictures are taken whatever they cost: the
 * first one, and one that, begun later, would be ready more than CA_LIVE_MOST_SECONDS after the last; but rendering
 * has half of the time. Answers wait for debts, and a picture is of use
 * once it has been sent: one that CA_LIVE_DEBT_SECONDS of rendering would not pay for is not charged, and sending
 * CA_LIVE_SENT_CHANNELS of it is paid for with it. A small advance, granted once, is there from the beginning, so
 * that a page opens at once. A part of the share is kept for the end, when viewers fetch the last picture, together
 * with the cost of sending it once; earlier debts do not count then.
 *
 * Threads: the caller's lock. */
#ifndef CA_LIVE_BUDGET_H
#define CA_LIVE_BUDGET_H

#include <stdbool.h>
#include <stdint.h>

/* Shares of the process's processor time; advances beside them, in seconds of a processor. Of 30 s and more, shares
 * and advances come to 3 % at most. */
#define CA_LIVE_SHARE 0.02 /* while it renders */
#define CA_LIVE_ADVANCE 0.05
#define CA_LIVE_WHOLE_SHARE 0.025 /* with the end */
#define CA_LIVE_WHOLE_ADVANCE 0.1
#define CA_LIVE_SECONDS_PER_BYTE 2e-9 /* of the last picture */
/* By the clock, after one picture: the next never begins earlier, and one that is wanted is ready by then. */
#define CA_LIVE_LEAST_SECONDS 0.25
#define CA_LIVE_MOST_SECONDS 5.0
#define CA_LIVE_DEBT_SECONDS 4.0
#define CA_LIVE_SENT_CHANNELS 6

typedef struct ca_live_budget {
    double share, advance;
    double start;        /* processor time of the process when the account was opened */
    double spent;        /* of a processor, in seconds */
    double picture_cost; /* of the last picture; 0: there was none */
    double picture_time; /* by the clock, when the last one was ready; negative: there was none */
    double picture_seconds; /* by the clock, that it took */
    double most_debt;    /* for a picture */
} ca_live_budget;

/* `threads`: of the render. */
ca_live_budget ca_live_budget_open(uint32_t threads);

/* The render is over: what was kept for it may be spent. `picture_bytes`: of the last picture. */
void ca_live_budget_end(ca_live_budget *budget, double process_seconds, double picture_bytes);

/* Is there enough left to spend `more`? `process_seconds`: processor time of the process by now. */
bool ca_live_budget_allows(const ca_live_budget *budget, double process_seconds, double more);

/* May a picture be taken now? `now`: by the clock; in `step` seconds, about, one may be taken again. */
bool ca_live_budget_allows_picture(const ca_live_budget *budget, double process_seconds, double now, double step);

/* A picture that was begun at `begin` is ready now, by the clock. */
void ca_live_budget_note_picture(ca_live_budget *budget, double begin, double now);
/* Charges it, of so many pixels, unless it is beyond the budget. */
void ca_live_budget_charge_picture(ca_live_budget *budget, double process_seconds, double cost, double pixels);

/* Processor time of the process, in seconds. */
double ca_live_process_seconds(void);

#endif
