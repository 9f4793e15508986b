/* A wish that work ends soon: a number that whoever gave it may set to other than 0 at any time, from another thread
 * or a signal handler, by an atomic store; it then stays so. Those who work look at it between tasks and, where a
 * task may take long, within it. What was being made is then incomplete and no use; its memory is in order, and it is
 * destroyed as usual. Cost: reading a number that nobody writes. */
#ifndef CA_BASE_STOP_H
#define CA_BASE_STOP_H

#include "base/status.h"

#include <stdbool.h>

/* NULL: nobody can ask. */
static inline bool ca_stop_asked(const int *stop) { return stop && __atomic_load_n(stop, __ATOMIC_RELAXED) != 0; }

/* CA_ERROR_INTERRUPTED where it is asked for. */
static inline ca_status ca_stop_check(const int *stop, ca_error *error)
{
    return ca_stop_asked(stop) ? ca_fail(error, CA_ERROR_INTERRUPTED, NULL, "ended before it was done") : CA_OK;
}

#endif
