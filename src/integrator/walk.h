/* Walks: paths under way, from the camera or from a light, and the steps they share: intersect, arrive, scatter. The
 * integrators take many walks through one step at a time. Internal to this folder. */
#ifndef CA_INTEGRATOR_WALK_H
#define CA_INTEGRATOR_WALK_H

#include "film/film.h"
#include "geometry/ray_batch.h"
#include "math/numeric.h"
#include "path/subpath.h"
#include "path/vertex.h"
#include "sampling/filter.h"
#include "scene/scene.h"

/* A path at its last vertex. The stages read and write it; who joins it with others looks at the last vertex. */
typedef struct ca_walk {
    ca_from from;
    bool uniform;              /* directions are uniform over the hemisphere, as paper.c has it */
    uint32_t vertex;           /* number of the last vertex, = segments so far */
    ca_stream stream;
    ca_vec3 origin, direction; /* of the next segment */
    float t_min, t_max;
    ca_flight flight;
    ca_rgb throughput;         /* from a light: flux, W */
    float start; /* the roulette looks at the throughput over this: from a light the flux that was emitted */
    float eta2;                /* from the camera: what refraction took from the throughput */
    ca_light_receiver receiver; /* from the camera: the vertex that the segment leaves, as it asked for light */
    ca_path_vertex *densities; /* borrowed: v[0] first */
    double tail;               /* of their weights, up to the last vertex (path/mis.h) */
    ca_vertex last;            /* v[vertex], where it lies on a surface */
} ca_walk;

/* Rays of walks, or questions for visibility, and the answers. */
typedef struct ca_walk_rays {
    ca_ray_batch rays;
    ca_hit_batch hits;
    uint8_t occluded[CA_RAY_BATCH];
} ca_walk_rays;

static inline void ca_walk_rays_set(ca_walk_rays *rays, uint32_t i, ca_vec3 origin, ca_vec3 direction, float t_min,
                                    float t_max)
{
    ca_column3_set(&rays->rays.origin, i, origin);
    ca_column3_set(&rays->rays.direction, i, direction);
    rays->rays.t_min[i] = t_min;
    rays->rays.t_max[i] = t_max;
}

/* A hit on the walk's segment becomes its last vertex: place and densities (photon_density: 0), not yet a BSDF.
 * false where the ray runs along the surface, which has no measure. */
bool ca_walk_arrive(ca_walk *walk, const ca_scene *scene, const ca_hit *hit);

/* Russian roulette: from CA_ROULETTE_DEPTH segments on (`rr_depth`) a path survives with
 * min(CA_ROULETTE_MOST, CA_ROULETTE_GAIN * largest throughput * eta2). Unlimited paths end because of
 * CA_ROULETTE_MOST.
 *
 * A path that survives a low probability carries 1 / CA_ROULETTE_GAIN of what it began with. With a gain of 1 that is
 * all of it, and light that is seldom found is far noisier, unless the roulette begins late and lets paths live that
 * carry little. Variance times rays is lower with 3 and 2 than with 5 and 1, as in Mitsuba 3 (docs/decisions/016). */
#define CA_ROULETTE_DEPTH 3
#define CA_ROULETTE_GAIN 2.0f
#define CA_ROULETTE_MOST 0.95f

/* Samples the events at the last vertices and the next segments, and plays roulette from rr_depth segments on.
 * goes_on[i]: else walk i ends. */
void ca_walks_scatter(ca_walk *const *walks, uint32_t count, const ca_reuse_rules *rules, uint32_t rr_depth,
                      bool *goes_on);

/* The first ray of a camera path through pixel (x, y) of the full film at an offset from its centre. */
static inline ca_camera_ray ca_walk_camera_ray(const ca_camera *camera, const ca_stream *stream, uint32_t x,
                                               uint32_t y, ca_vec2 offset)
{
    const ca_vec2 film_position = {(float)x + 0.5f + offset.x, (float)y + 0.5f + offset.y};
    const ca_vec2 lens = ca_camera_has_lens(camera) ? ca_sample_2d(stream, CA_DIM_LENS) : (ca_vec2){0.5f, 0.5f};
    return ca_camera_sample_ray(camera, film_position, lens);
}

/* Next event: the ray that asks whether the way from a point to the chosen point of the light is free. */
typedef struct ca_next_event_ray {
    ca_vec3 origin, direction;
    float t_max;
} ca_next_event_ray;

static inline ca_next_event_ray ca_walk_next_event_ray(ca_vec3 position, ca_vec3 position_error, ca_vec3 ng,
                                                       const ca_light_direct *direct)
{
    if (isfinite(direct->distance)) {
        const ca_segment segment = ca_segment_between(position, position_error, ng, direct->position,
                                                      direct->position_error, direct->ng);
        return (ca_next_event_ray){segment.origin, segment.direction, ca_visible_t_max};
    }
    return (ca_next_event_ray){ca_offset_origin(position, position_error, ng, direct->to_light), direct->to_light,
                               INFINITY};
}

#endif
