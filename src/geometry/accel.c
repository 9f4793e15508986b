#include "geometry/accel_embree.h"

#include "geometry/quadric.h"
#include "math/numeric.h"

#include <assert.h>
#include <stddef.h>

static inline struct RTCRay make_ray(ca_vec3 origin, ca_vec3 direction, float t_min, float t_max)
{
    return (struct RTCRay){.org_x = origin.x,
                           .org_y = origin.y,
                           .org_z = origin.z,
                           .tnear = t_min,
                           .dir_x = direction.x,
                           .dir_y = direction.y,
                           .dir_z = direction.z,
                           .tfar = t_max,
                           .mask = UINT32_MAX};
}

static inline void intersect1(RTCScene scene, struct RTCRayHit *rayhit)
{
#if CA_EMBREE_MAJOR >= 4
    rtcIntersect1(scene, rayhit, NULL);
#else
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene, &context, rayhit);
#endif
}

static inline void occluded1(RTCScene scene, struct RTCRay *ray)
{
#if CA_EMBREE_MAJOR >= 4
    rtcOccluded1(scene, ray, NULL);
#else
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded1(scene, &context, ray);
#endif
}

/* What the scene has in the ray's way before hit->t; the numbers are Embree's. */
static inline bool meet(RTCScene scene, ca_vec3 origin, ca_vec3 direction, float t_min, ca_hit *hit)
{
    struct RTCRayHit rayhit;
    rayhit.ray = make_ray(origin, direction, t_min, hit->t);
    rayhit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rayhit.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    intersect1(scene, &rayhit);
    if (rayhit.hit.geomID == RTC_INVALID_GEOMETRY_ID) return false;
    *hit = (ca_hit){.t = rayhit.ray.tfar,
                    .u = rayhit.hit.u,
                    .v = rayhit.hit.v,
                    .ng = {rayhit.hit.Ng_x, rayhit.hit.Ng_y, rayhit.hit.Ng_z},
                    .shape = rayhit.hit.geomID,
                    .primitive = rayhit.hit.primID,
                    .instance = rayhit.hit.instID[0]};
    return true;
}

bool ca_accel_meet_world(const ca_accel *accel, ca_vec3 origin, ca_vec3 direction, float t_min, ca_hit *hit)
{
    if (!meet(accel->world_scene, origin, direction, t_min, hit)) return false;
    hit->instance = CA_NONE;
    return true;
}

bool ca_accel_meet_instances(const ca_accel *accel, ca_vec3 origin, ca_vec3 direction, float t_min, ca_hit *hit)
{
    if (!meet(accel->top_scene, origin, direction, t_min, hit)) return false;
    hit->shape += accel->instances[hit->instance].first_shape;
    return true;
}

bool ca_accel_intersect(const ca_accel *accel, ca_vec3 origin, ca_vec3 direction, float t_min, float t_max,
                        ca_hit *hit)
{
    *hit = (ca_hit){.t = t_max, .shape = CA_NONE, .instance = CA_NONE};
    assert(ca_accel_ray_is_valid(accel, origin, direction, t_min, t_max) || t_max <= t_min);
    if (!ca_accel_ray_is_valid(accel, origin, direction, t_min, t_max)) return false;
    for (uint32_t i = 0; i < accel->apart_count; i++) {
        const ca_shape *quadric = &accel->shapes[accel->apart[i]];
        if (ca_quadric_intersect(quadric, origin, direction, t_min, hit->t, &hit->t)) hit->shape = accel->apart[i];
    }
    ca_facets_intersect(&accel->facets, origin, direction, t_min, hit);
    if (accel->world_scene) ca_accel_meet_world(accel, origin, direction, t_min, hit);
    if (accel->top_scene) ca_accel_meet_instances(accel, origin, direction, t_min, hit);
    return hit->shape != CA_NONE;
}

bool ca_accel_occluded(const ca_accel *accel, ca_vec3 origin, ca_vec3 direction, float t_min, float t_max)
{
    assert(ca_accel_ray_is_valid(accel, origin, direction, t_min, t_max) || t_max <= t_min);
    if (!ca_accel_ray_is_valid(accel, origin, direction, t_min, t_max)) return false;
    for (uint32_t i = 0; i < accel->apart_count; i++) {
        float t;
        if (ca_quadric_intersect(&accel->shapes[accel->apart[i]], origin, direction, t_min, t_max, &t)) return true;
    }
    if (ca_facets_occlude(&accel->facets, origin, direction, t_min, t_max)) return true;
    struct RTCRay ray = make_ray(origin, direction, t_min, t_max);
    if (accel->world_scene) occluded1(accel->world_scene, &ray);
    if (accel->top_scene && ray.tfar >= 0.0f) occluded1(accel->top_scene, &ray);
    return ray.tfar < 0.0f;
}

bool ca_accel_visible(const ca_accel *accel, ca_vec3 a, ca_vec3 a_error, ca_vec3 a_ng, ca_vec3 b, ca_vec3 b_error,
                      ca_vec3 b_ng)
{
    const ca_segment segment = ca_segment_between(a, a_error, a_ng, b, b_error, b_ng);
    return !ca_accel_occluded(accel, segment.origin, segment.direction, 0.0f, ca_visible_t_max);
}

const ca_shape *ca_accel_shape(const ca_accel *accel, uint32_t shape) { return &accel->shapes[shape]; }

const ca_accel_instance *ca_accel_instance_at(const ca_accel *accel, uint32_t instance)
{
    return &accel->instances[instance];
}
