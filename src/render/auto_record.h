/* What was decided in a render with rays "auto", as far as the image depends on it: the groups of iterations in their
 * order, with their numbers of paths, and the weights that they are joined with. An image is a function of the scene,
 * the settings and this, so that a render can be repeated to the bit although measured times decided it
 * (ca_render_settings.rays "FILE.part"), on any threads.
 *
 * Light paths and camera paths are numbered on from group to group. The ramp and the ordinary iterations go in turns
 * to the halves A and B (auto_rays.h); a group of fewer than two iterations has no noise that is known, and is left
 * out. */
#ifndef CA_RENDER_AUTO_RECORD_H
#define CA_RENDER_AUTO_RECORD_H

#include "film/part_exchange.h"
#include "render/auto_pilot_plan.h"

typedef enum ca_auto_group_kind { CA_AUTO_GROUP_RAMP, CA_AUTO_GROUP_ORDINARY, CA_AUTO_GROUP_RUN } ca_auto_group_kind;

typedef struct ca_auto_group {
    ca_auto_group_kind kind;
    bool measures; /* of a run: it gathers pairs (ca_auto_role_of) */
    uint32_t light_paths;
    uint32_t camera_paths; /* of every pixel; 0: */
    uint32_t *map;         /* owned; of each pixel */
    uint32_t iterations;
    double share; /* of a run, in R */
} ca_auto_group;

/* A ramp quadruples its light paths 16 times at most; the ordinary iterations, three trials, a validation run and
 * three phases follow. A file has no more; there is room for as many behind them, whatever it says. */
enum { CA_AUTO_MOST_RUNS = 7, CA_AUTO_MOST_GROUPS = 16 + 1 + CA_AUTO_MOST_RUNS };

typedef struct ca_auto_record {
    ca_auto_group groups[2 * CA_AUTO_MOST_GROUPS];
    uint32_t count;
    double weights[CA_PILOT_HALVES]; /* w_A, w_B */
} ca_auto_record;

void ca_auto_record_destroy(ca_auto_record *record);

/* Appends a group without iterations. `map`: copied; NULL: group->camera_paths for all. */
ca_status ca_auto_record_add(ca_auto_record *record, const ca_auto_group *group, const uint32_t *map, size_t pixels,
                             ca_error *error);

/* The last group; NULL: there is none. */
static inline ca_auto_group *ca_auto_record_last(ca_auto_record *record)
{
    return record->count > 0 ? &record->groups[record->count - 1] : NULL;
}

/* Writes it, or reads it into an empty one. What is read is as it can be: kinds in their order, numbers within their
 * limits. */
void ca_auto_record_exchange(ca_auto_record *record, size_t pixels, ca_part_exchange *x);

/* All iterations. */
uint32_t ca_auto_record_iterations(const ca_auto_record *record);

#endif
