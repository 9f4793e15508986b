/* What the files around Embree share. Internal to accel*.c. */
#ifndef CA_GEOMETRY_ACCEL_EMBREE_H
#define CA_GEOMETRY_ACCEL_EMBREE_H

#include "geometry/accel.h"

#if CA_EMBREE_MAJOR >= 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

/* Quadrics of the world that Embree does not know, where they are few: they are met eight rays at a time before
 * Embree is asked, always in the same order. */
enum { CA_QUADRICS_APART = 8 };

struct ca_accel {
    RTCDevice device;
    RTCScene scene;
    RTCScene *group_scenes; /* [shape_count], at a group's first shape; NULL elsewhere */
    const ca_shape *shapes;
    uint32_t shape_count, world_count;
    const ca_accel_instance *instances; /* Embree's geometry ids world_count, world_count + 1, ... */
    uint32_t instance_count;
    ca_vec3 low, cells_per_meter; /* the scene's bounds in a few cells along each axis: rays are sorted by them */
    uint32_t apart[CA_QUADRICS_APART], apart_count; /* their shapes */
    float origin_length2, direction_length2; /* rays are valid below these: ray_reach.h */
    bool only_meshes; /* Embree knows neither quadrics nor instances: accel_batch.c */
    size_t bytes;
    const int *stop; /* while it is built */
};

/* Embree's asserts abort the process on rays that are not finite or too large, before or after an instance's map:
 * such a ray meets nothing. A comparison with NaN is false, and squares overflow to infinity early enough. */
static inline bool ca_accel_ray_is_valid(const ca_accel *accel, ca_vec3 origin, ca_vec3 direction, float t_min,
                                         float t_max)
{
    return ca_length2(origin) < accel->origin_length2 && ca_length2(direction) < accel->direction_length2 &&
           t_min >= 0.0f && t_max > t_min;
}

/* Asks Embree alone, with a valid ray, for the nearest hit before hit->t; where there is none, *hit stays. */
bool ca_accel_meet_embree(const ca_accel *accel, ca_vec3 origin, ca_vec3 direction, float t_min, ca_hit *hit);

#endif
