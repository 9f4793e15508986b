#include "base/parallel.h"

#include <omp.h>

void ca_parallel_for(const ca_parallel *parallel, uint32_t count, ca_parallel_task task, void *user)
{
#pragma omp parallel for schedule(dynamic, 1) num_threads((int)parallel->workers)
    for (uint32_t i = 0; i < count; i++) task(user, i, (uint32_t)omp_get_thread_num());
}
