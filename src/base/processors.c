#define _GNU_SOURCE /* sched_getaffinity */
#include "base/processors.h"

#include <math.h>
#include <sched.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* ---- Affinity -------------------------------------------------------------------------------------------------- */

/* 0: not known. */
static uint32_t count_allowed(void)
{
    enum { MOST = 1 << 16 };
    for (size_t size = 1024; size <= MOST; size *= 2) {
        cpu_set_t *set = CPU_ALLOC(size);
        if (!set) return 0;
        const size_t bytes = CPU_ALLOC_SIZE(size);
        CPU_ZERO_S(bytes, set);
        const bool known = sched_getaffinity(0, bytes, set) == 0; /* the kernel may know more than fit the set */
        const int count = known ? CPU_COUNT_S(bytes, set) : 0;
        CPU_FREE(set);
        if (count > 0) return (uint32_t)count;
    }
    return 0;
}

/* ---- Quotas ---------------------------------------------------------------------------------------------------- */

typedef char path_text[4096];

/* The numbers at the start of a file; how many, of two. "max" is no number. */
static int read_numbers(const char *path, double numbers[2])
{
    FILE *file = fopen(path, "re");
    if (!file) return 0;
    char line[128] = "";
    const bool read = fgets(line, sizeof line, file) != NULL;
    fclose(file);
    if (!read) return 0;
    int count = 0;
    for (char *at = line, *end; count < 2; at = end, count++) {
        numbers[count] = strtod(at, &end);
        if (end == at) break;
    }
    return count;
}

static bool join(path_text path, const char *folder, const char *name)
{
    const int length = snprintf(path, sizeof(path_text), "%s/%s", folder, name);
    return length > 0 && (size_t)length < sizeof(path_text);
}

/* Processors that a group's folder allows; INFINITY: any number. */
static double quota_of(const char *folder, bool unified)
{
    path_text path;
    double numbers[2] = {0.0, 0.0};
    if (unified) {
        if (!join(path, folder, "cpu.max") || read_numbers(path, numbers) != 2) return (double)INFINITY;
    } else {
        double period[2];
        if (!join(path, folder, "cpu.cfs_quota_us") || read_numbers(path, numbers) < 1) return (double)INFINITY;
        if (!join(path, folder, "cpu.cfs_period_us") || read_numbers(path, period) < 1) return (double)INFINITY;
        numbers[1] = period[0];
    }
    return numbers[0] > 0.0 && numbers[1] > 0.0 ? numbers[0] / numbers[1] : (double)INFINITY; /* -1: none */
}

/* The least of a group's and of all above it. Within a container a group's path may be that of the machine, which is
 * not there, or "/": what the container may use stands at the root then. */
static double least_quota(const char *root, const char *group, bool unified)
{
    path_text folder;
    double least = (double)INFINITY;
    const int length = snprintf(folder, sizeof folder, "%s%s", root, group);
    if (length <= 0 || (size_t)length >= sizeof folder) return least;
    for (char *end = folder + length;;) {
        *end = '\0';
        least = fmin(least, quota_of(folder, unified));
        while (end > folder + strlen(root) && *--end != '/') continue;
        if (*end == '\0') return least;
    }
}

static bool has_controller(const char *list, const char *name)
{
    const size_t length = strlen(name);
    for (const char *at = list; *at; at += strcspn(at, ",") + (at[strcspn(at, ",")] == ',')) {
        if (strcspn(at, ",") == length && strncmp(at, name, length) == 0) return true;
    }
    return false;
}

/* A line "number:controllers:group"; no controllers: version 2. */
static double quota_of_line(char *line, const char *root)
{
    char *controllers = strchr(line, ':'), *group = controllers ? strchr(controllers + 1, ':') : NULL;
    path_text mount;
    if (!group) return (double)INFINITY;
    *group++ = '\0';
    group[strcspn(group, "\n")] = '\0';
    if (*++controllers == '\0') return least_quota(root, group, true);
    if (!has_controller(controllers, "cpu") || !join(mount, root, controllers)) return (double)INFINITY;
    const double quota = least_quota(mount, group, false);
    return join(mount, root, "cpu") ? fmin(quota, least_quota(mount, group, false)) : quota;
}

uint32_t ca_processors_of_quota(const char *groups, const char *root)
{
    FILE *file = fopen(groups, "re");
    if (!file) return UINT32_MAX;
    path_text line;
    double least = (double)INFINITY;
    while (fgets(line, sizeof line, file)) least = fmin(least, quota_of_line(line, root));
    fclose(file);
    const double rounded = ceil(least - 1e-9);
    return rounded < (double)UINT32_MAX ? (uint32_t)fmax(1.0, rounded) : UINT32_MAX;
}

uint32_t ca_processors(void)
{
    uint32_t count = count_allowed();
    if (count == 0) {
        const long online = sysconf(_SC_NPROCESSORS_ONLN);
        count = online > 0 ? (uint32_t)online : 1;
    }
    const uint32_t quota = ca_processors_of_quota("/proc/self/cgroup", "/sys/fs/cgroup");
    return count < quota ? count : quota;
}
