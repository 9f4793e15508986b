#include "render/part_counts.h"

#include <string.h>

/* The place of each count in a part file. */
enum { LIGHT_PATHS, CAMERA_PATHS, RAYS, SHADOW_RAYS, PHOTONS, PHOTONS_TESTED, MERGES, NON_FINITE };
_Static_assert((int)NON_FINITE + (int)CA_NON_FINITE_SOURCES <= (int)CA_PART_COUNTS,
               "a part file has room for all counts");

void ca_part_counts_of(const ca_render_statistics *s, uint64_t counts[CA_PART_COUNTS])
{
    memset(counts, 0, CA_PART_COUNTS * sizeof *counts);
    counts[LIGHT_PATHS] = s->light_paths;
    counts[CAMERA_PATHS] = s->camera_paths;
    counts[RAYS] = s->rays;
    counts[SHADOW_RAYS] = s->shadow_rays;
    counts[PHOTONS] = s->photons;
    counts[PHOTONS_TESTED] = s->photons_tested;
    counts[MERGES] = s->merges;
    memcpy(counts + NON_FINITE, s->non_finite_from, sizeof s->non_finite_from);
}

void ca_part_counts_keep(const ca_workers *workers, uint64_t counts[CA_PART_COUNTS])
{
    ca_render_statistics s = {0};
    ca_workers_count(workers, &s);
    ca_part_counts_of(&s, counts);
}

void ca_part_counts_fill(const uint64_t counts[CA_PART_COUNTS], ca_render_statistics *s)
{
    s->light_paths += counts[LIGHT_PATHS];
    s->camera_paths += counts[CAMERA_PATHS];
    s->rays += counts[RAYS];
    s->shadow_rays += counts[SHADOW_RAYS];
    s->photons += counts[PHOTONS];
    s->photons_tested += counts[PHOTONS_TESTED];
    s->merges += counts[MERGES];
    for (int i = 0; i < CA_NON_FINITE_SOURCES; i++) {
        s->non_finite_from[i] += counts[NON_FINITE + i];
        s->non_finite += counts[NON_FINITE + i];
    }
}
