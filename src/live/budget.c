#define _POSIX_C_SOURCE 200809L
#include "live/budget.h"

#include <math.h>
#include <time.h>

double ca_live_process_seconds(void)
{
    struct timespec time;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

ca_live_budget ca_live_budget_open(uint32_t threads)
{
    return (ca_live_budget){.share = CA_LIVE_SHARE,
                            .advance = CA_LIVE_ADVANCE,
                            .start = ca_live_process_seconds(),
                            .picture_time = -1.0,
                            .most_debt = CA_LIVE_SHARE * CA_LIVE_DEBT_SECONDS * threads};
}

static double allowance(const ca_live_budget *budget, double process_seconds)
{
    return budget->advance + budget->share * (process_seconds - budget->start);
}

void ca_live_budget_end(ca_live_budget *budget, double process_seconds, double picture_bytes)
{
    const double allowed = allowance(budget, process_seconds);
    if (budget->spent > allowed) budget->spent = allowed;
    budget->share = CA_LIVE_WHOLE_SHARE;
    budget->advance = CA_LIVE_WHOLE_ADVANCE + CA_LIVE_SECONDS_PER_BYTE * picture_bytes;
}

bool ca_live_budget_allows(const ca_live_budget *budget, double process_seconds, double more)
{
    return budget->spent + more <= allowance(budget, process_seconds);
}

/* Would the next one be too late? */
static bool is_late(const ca_live_budget *budget, double since, double step)
{
    return since + step + budget->picture_seconds >= CA_LIVE_MOST_SECONDS && since >= budget->picture_seconds;
}

bool ca_live_budget_allows_picture(const ca_live_budget *budget, double process_seconds, double now, double step)
{
    if (budget->picture_time < 0.0) return true;
    const double since = now - budget->picture_time;
    if (since < CA_LIVE_LEAST_SECONDS) return false;
    return is_late(budget, since, step) || ca_live_budget_allows(budget, process_seconds, budget->picture_cost);
}

void ca_live_budget_note_picture(ca_live_budget *budget, double begin, double now)
{
    budget->picture_time = now;
    budget->picture_seconds = now - begin;
}

void ca_live_budget_charge_picture(ca_live_budget *budget, double process_seconds, double cost, double pixels)
{
    const double sending = CA_LIVE_SECONDS_PER_BYTE * CA_LIVE_SENT_CHANNELS * sizeof(float) * pixels;
    if (cost <= budget->most_debt || ca_live_budget_allows(budget, process_seconds, cost))
        budget->spent += cost;
    else
        budget->spent = fmin(budget->spent, allowance(budget, process_seconds) - sending);
    budget->picture_cost = cost;
}
