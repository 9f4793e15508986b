/* Loops over independent tasks on several threads. What a task does may depend on its number only, never on the
 * worker that happens to run it: then no result depends on the number of threads. A worker's number selects scratch
 * memory and counters. Cost: about a microsecond a task; give a task some tens of them.
 *
 * Threads are made when they are first needed, and sleep between loops until the process ends. Loops of several
 * callers at a time share them: a loop begins with as many as the others leave of the largest number that one of them
 * may have, in any case with its caller. A loop within a task of another one is allowed, and shares, too. After a
 * fork the child makes its own. */
#ifndef CA_BASE_PARALLEL_H
#define CA_BASE_PARALLEL_H

#include "base/status.h"

/* Processor time of loops, in seconds: of what all threads did in them, and what of it and of waiting for the others
 * was the calling thread's. */
typedef struct ca_parallel_seconds {
    double tasks, calling_thread;
} ca_parallel_seconds;

typedef struct ca_parallel {
    uint32_t workers;             /* at most so many, at least 1 */
    ca_parallel_seconds *seconds; /* loops add theirs; NULL: not measured */
    const int *stop;              /* base/stop.h; NULL: loops are finished */
    /* Called by worker 0 before each of its tasks, for what cannot wait until the loops are over; NULL: nothing is. A
     * loop within a task of another worker calls it in that one's thread. */
    void (*between)(void *user);
    void *between_user;
} ca_parallel;

typedef void (*ca_parallel_task)(void *user, uint32_t task, uint32_t worker);

/* Runs task(user, i, worker) once for each i in [0, count), as workers come free; returns when all are done. Worker 0
 * is the calling thread. CA_ERROR_INTERRUPTED: it was asked to stop, and tasks may be missing or incomplete.
 * CA_ERROR_THREADS: the system gives no more threads; no task has run. */
__attribute__((warn_unused_result)) ca_status ca_parallel_for(const ca_parallel *parallel, uint32_t count,
                                                              ca_parallel_task task, void *user, ca_error *error);

/* The same for what must not fail: by the calling thread alone where the system gives no more threads. Tasks are
 * missing once nobody wants the calling thread's work any more (base/loading.h), which is to be asked behind it. */
void ca_parallel_surely(uint32_t workers, uint32_t count, ca_parallel_task task, void *user);

/* Loops over the elements of long arrays: [0, count) in ranges of one size, the last of which may be shorter. Their
 * size depends on the count only; there are at most CA_RANGES of them, so that each can have a result of its own. */
enum { CA_RANGES = 256, CA_RANGE_LEAST = 1 << 14 /* elements; sizes are multiples of 64 */ };

typedef struct ca_range {
    size_t begin, end;
    uint32_t number;
} ca_range;

typedef void (*ca_range_task)(void *user, ca_range range);

/* On all processors, by ca_parallel_surely; where there is one range, it is the calling thread's in any case. Returns
 * the number of ranges. */
uint32_t ca_parallel_ranges(size_t count, ca_range_task task, void *user);

#endif
