#define _POSIX_C_SOURCE 200809L
#include "live/budget.h"

#include <time.h>

double ca_live_process_seconds(void)
{
    struct timespec time;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

ca_live_budget ca_live_budget_open(void)
{
    return (ca_live_budget){.share = CA_LIVE_SHARE, .advance = CA_LIVE_ADVANCE, .start = ca_live_process_seconds()};
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
