#include "render/auto_record.h"

#include "base/memory.h"
#include "film/binned_sum.h"
#include "noise/ray_map.h"

#include <assert.h>
#include <errno.h>
#include <math.h>
#include <string.h>

void ca_auto_record_destroy(ca_auto_record *record)
{
    for (uint32_t g = 0; g < record->count; g++) ca_free(record->groups[g].map);
    record->count = 0;
}

ca_status ca_auto_record_add(ca_auto_record *record, const ca_auto_group *group, const uint32_t *map, size_t pixels,
                             ca_error *error)
{
    assert(record->count < sizeof record->groups / sizeof record->groups[0]);
    ca_auto_group *added = &record->groups[record->count];
    *added = *group;
    added->map = map ? ca_alloc(pixels, sizeof *added->map) : NULL;
    if (map && !added->map) return ca_fail_memory(error, "the record of the numbers of rays");
    if (map) memcpy(added->map, map, pixels * sizeof *map);
    record->count++;
    return CA_OK;
}

uint32_t ca_auto_record_iterations(const ca_auto_record *record)
{
    uint32_t iterations = 0;
    for (uint32_t g = 0; g < record->count; g++) iterations += record->groups[g].iterations;
    return iterations;
}

/* ---- Files ----------------------------------------------------------------------------------------------------- */

static bool is_camera_number(uint32_t number) { return number >= 1 && number <= CA_RAY_MAP_MOST_CAMERA_PATHS; }

static bool is_map(const uint32_t *map, size_t pixels)
{
    for (size_t p = 0; p < pixels; p++)
        if (!is_camera_number(map[p])) return false;
    return true;
}

static bool is_group(const ca_auto_group *group, const ca_auto_group *before, size_t pixels)
{
    const bool run = group->kind == CA_AUTO_GROUP_RUN;
    if (group->kind > CA_AUTO_GROUP_RUN || (before && group->kind < before->kind)) return false;
    if (!before && group->kind != CA_AUTO_GROUP_RAMP) return false;
    if (before && group->kind == CA_AUTO_GROUP_ORDINARY && before->kind == CA_AUTO_GROUP_ORDINARY) return false;
    if (group->light_paths < CA_PILOT_LEAST_LIGHT_PATHS || group->light_paths > CA_RAY_MAP_MOST_LIGHT_PATHS)
        return false;
    if (group->kind == CA_AUTO_GROUP_RAMP && group->iterations != CA_PILOT_HALVES) return false;
    if (group->kind == CA_AUTO_GROUP_ORDINARY && group->iterations > CA_BINNED_SUM_MOST_VALUES) return false;
    if (group->map ? !is_map(group->map, pixels) : !is_camera_number(group->camera_paths)) return false;
    return isfinite(group->share) && (run ? group->share >= 0.0 : group->share == 0.0);
}

static void exchange_map(ca_auto_group *group, size_t pixels, ca_part_exchange *x)
{
    if (x->stream) group->map = ca_alloc_zeroed(pixels, sizeof *group->map);
    if (!group->map) {
        errno = ENOMEM;
        x->good = false;
        return;
    }
    ca_part_exchange_array(x, group->map, pixels, (ca_part_layout){.integers = 1});
}

static void exchange_group(ca_auto_group *group, size_t pixels, ca_part_exchange *x)
{
    uint32_t kind = (uint32_t)group->kind;
    ca_part_exchange_u32(x, &kind);
    group->kind = kind <= CA_AUTO_GROUP_RUN ? (ca_auto_group_kind)kind : CA_AUTO_GROUP_RUN;
    if (kind > CA_AUTO_GROUP_RUN) x->good = false;
    ca_part_exchange_bool(x, &group->measures);
    ca_part_exchange_u32(x, &group->light_paths);
    ca_part_exchange_u32(x, &group->camera_paths);
    ca_part_exchange_u32(x, &group->iterations);
    ca_part_exchange_double(x, &group->share);
    if (x->good && group->camera_paths == 0) exchange_map(group, pixels, x);
}

void ca_auto_record_exchange(ca_auto_record *record, size_t pixels, ca_part_exchange *x)
{
    uint32_t count = record->count;
    ca_part_exchange_u32(x, &count);
    for (int h = 0; h < CA_PILOT_HALVES; h++) {
        ca_part_exchange_double(x, &record->weights[h]);
        if (!(record->weights[h] >= 0.0 && record->weights[h] <= 1.0)) x->good = false;
    }
    if (count > CA_AUTO_MOST_GROUPS) x->good = false;
    for (uint32_t g = 0; g < count && x->good; g++) {
        ca_auto_group *group = &record->groups[g];
        if (x->stream) *group = (ca_auto_group){.map = NULL};
        record->count = g + 1;
        exchange_group(group, pixels, x);
        if (x->good && !is_group(group, g > 0 ? group - 1 : NULL, pixels)) x->good = false;
    }
}
