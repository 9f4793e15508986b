#define _POSIX_C_SOURCE 200809L
#include "live/budget.h"

#include <time.h>

double ca_live_process_seconds(void)
{
    struct timespec time;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

ca_live_budget ca_live_budget_open(void) { return (ca_live_budget){.start = ca_live_process_seconds()}; }

bool ca_live_budget_allows(const ca_live_budget *budget, double process_seconds, double more)
{
    return budget->spent + more <= CA_LIVE_ADVANCE_SECONDS + CA_LIVE_SHARE * (process_seconds - budget->start);
}
