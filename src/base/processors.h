/* How many processors this process may use: of those there are, those that its affinity allows (taskset, cpusets),
 * and no more than the quotas of its control groups are worth (containers, batch systems): versions 1 and 2, the
 * group's own and those of all above it. */
#ifndef CA_BASE_PROCESSORS_H
#define CA_BASE_PROCESSORS_H

#include <stdint.h>

/* At least 1: the default for numbers of threads. */
uint32_t ca_processors(void);

/* Processors that the quotas are worth, rounded up; UINT32_MAX: there is none. `groups` names the process' groups as
 * /proc/self/cgroup does, `root` is where their folders are (/sys/fs/cgroup). */
uint32_t ca_processors_of_quota(const char *groups, const char *root);

#endif
