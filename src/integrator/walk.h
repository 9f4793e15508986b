/* Steps that every walk of a camera path takes, whatever the algorithm does at its vertices. Internal to this
 * folder. */
#ifndef CA_INTEGRATOR_WALK_H
#define CA_INTEGRATOR_WALK_H

#include "film/film.h"
#include "math/numeric.h"
#include "sampling/filter.h"
#include "scene/scene.h"

/* The first ray of a camera path through pixel (x, y) of the full film; *filter_weight as in sampling/filter.h. */
static inline ca_camera_ray ca_walk_camera_ray(const ca_camera *camera, const ca_filter *filter,
                                               const ca_stream *stream, uint32_t x, uint32_t y, float *filter_weight)
{
    const ca_vec2 offset = ca_filter_sample(filter, ca_sample_2d(stream, CA_DIM_FILM), filter_weight);
    const ca_vec2 film_position = {(float)x + 0.5f + offset.x, (float)y + 0.5f + offset.y};
    const ca_vec2 lens =
        camera->kind == CA_CAMERA_THIN_LENS ? ca_sample_2d(stream, CA_DIM_LENS) : (ca_vec2){0.5f, 0.5f};
    return ca_camera_sample_ray(camera, film_position, lens);
}

/* What the film's first-hit layers show. */
static inline void ca_walk_record_primary_hit(const ca_surface *surface, const ca_bsdf *bsdf, ca_vec3 wi,
                                              ca_film_sample *sample)
{
    sample->albedo = ca_bsdf_albedo(bsdf, wi);
    sample->normal = surface->ns;
    sample->position = surface->position;
}

/* Who asks for light at a surface where the path came from wi: what lies behind one that only reflects cannot
 * help. */
static inline ca_light_receiver ca_walk_receiver(const ca_surface *surface, const ca_bsdf *bsdf, ca_vec3 wi)
{
    ca_light_receiver receiver = {.position = surface->position};
    if (!(bsdf->scatter & CA_SCATTER_TRANSMISSION))
        receiver.normal = ca_dot(surface->ng, wi) < 0.0f ? ca_neg(surface->ng) : surface->ng;
    return receiver;
}

/* Next event: is the way from the surface to the chosen point of the light free? */
static inline bool ca_walk_light_is_visible(const ca_accel *accel, const ca_surface *surface,
                                            const ca_light_direct *direct)
{
    if (isfinite(direct->distance))
        return ca_accel_visible(accel, surface->position, surface->position_error, surface->ng, direct->position,
                                direct->position_error, direct->ng);
    const ca_vec3 origin =
        ca_offset_origin(surface->position, surface->position_error, surface->ng, direct->to_light);
    return !ca_accel_occluded(accel, origin, direct->to_light, 0.0f, INFINITY);
}

/* Russian roulette after `depth` edges: from rr_depth on a path survives with min(0.95, largest throughput * eta2),
 * where eta2 gives back what refraction took from the throughput. false: the walk ends; else *throughput is
 * scaled. */
static inline bool ca_walk_survives(uint32_t depth, uint32_t rr_depth, float eta2, float u, ca_rgb *throughput)
{
    const float largest = ca_rgb_max(*throughput);
    if (!(largest > 0.0f)) return false;
    if (depth < rr_depth) return true;
    const float survival = ca_min(0.95f, largest * eta2);
    if (u >= survival) return false;
    *throughput = ca_rgb_scale(*throughput, 1.0f / survival);
    return true;
}

#endif
