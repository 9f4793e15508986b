/* What the stages of `path` share. Internal to path*.c. */
#ifndef CA_INTEGRATOR_PATH_H
#define CA_INTEGRATOR_PATH_H

#include "geometry/triangle.h"
#include "integrator/batch.h"
#include "integrator/walk.h"

typedef struct path_state {
    ca_integrator_input input;
    const ca_scene *scene;
    uint32_t max_depth, rr_depth;
    bool hide_emitters, power_heuristic, next_event;
    ca_technique_images *images; /* NULL: not wanted */
    ca_batch *batches;           /* owned; one a worker */
    ca_surface_point (*points)[3]; /* owned; [workers * CA_BATCH]: the last vertices, where somebody observes */
} path_state;

/* Of what counts in weights: its square is a float. Of two that are both beyond, each counts by a half. */
static const float path_largest_density = 1e18f;

/* Weight of a technique with density a against another with density b for the same path. */
static inline float path_mis_weight(const path_state *state, float a, float b)
{
    a = ca_min(a, path_largest_density), b = ca_min(b, path_largest_density);
    if (state->power_heuristic) a *= a, b *= b;
    return a > 0.0f ? a / (a + b) : 0.0f;
}

/* Eight of it. */
static inline ca_f8 path_mis_weight8(const path_state *state, ca_f8 a, ca_f8 b)
{
    a = ca_min8(a, ca_f8_all(path_largest_density)), b = ca_min8(b, ca_f8_all(path_largest_density));
    if (state->power_heuristic) a *= a, b *= b;
    return ca_select8(a > 0.0f, a / (a + b), ca_f8_all(0.0f));
}

/* Adds what a technique found with a full path of s camera vertices, already times its weight; a value that is not
 * finite or is negative is a defect of the technique: counted and dropped. */
void path_contribute(const path_state *state, ca_batch *batch, uint32_t slot, ca_technique technique, uint32_t s,
                     ca_rgb contribution, float weight, ca_counters *counters);

/* Shows a weight and the last three vertices of the path to the observer; `light` NULL: a hit, the last vertex lies
 * on the light. */
void path_observe(const path_state *state, const ca_batch *batch, uint32_t slot, const ca_light_vertex *light,
                  float weight);

/* Next event at the vertices. */
void path_add_next_event(const path_state *state, ca_batch *batch, ca_worker *worker);

#endif
