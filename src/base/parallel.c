#define _POSIX_C_SOURCE 200809L
#include "base/parallel.h"

#include "base/clock.h"

#include <omp.h>
#include <unistd.h>

uint32_t ca_parallel_default_workers(void)
{
    const long count = sysconf(_SC_NPROCESSORS_ONLN);
    return count > 0 ? (uint32_t)count : 1;
}

/* The threads' clocks are read before they wait for each other. */
static void run_timed(const ca_parallel *parallel, uint32_t count, ca_parallel_task task, void *user)
{
    const double calling_start = ca_clock_thread_seconds();
    double tasks = 0.0;
#pragma omp parallel num_threads((int)parallel->workers) reduction(+ : tasks)
    {
        const double start = ca_clock_thread_seconds();
#pragma omp for schedule(dynamic, 1) nowait
        for (uint32_t i = 0; i < count; i++) task(user, i, (uint32_t)omp_get_thread_num());
        tasks += ca_clock_thread_seconds() - start;
    }
    parallel->seconds->tasks += tasks;
    parallel->seconds->calling_thread += ca_clock_thread_seconds() - calling_start;
}

void ca_parallel_for(const ca_parallel *parallel, uint32_t count, ca_parallel_task task, void *user)
{
    if (parallel->seconds) {
        run_timed(parallel, count, task, user);
        return;
    }
#pragma omp parallel for schedule(dynamic, 1) num_threads((int)parallel->workers)
    for (uint32_t i = 0; i < count; i++) task(user, i, (uint32_t)omp_get_thread_num());
}
