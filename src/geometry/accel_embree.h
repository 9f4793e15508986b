/* What the files around Embree share. Internal to accel*.c. */
#ifndef CA_GEOMETRY_ACCEL_EMBREE_H
#define CA_GEOMETRY_ACCEL_EMBREE_H

#include "geometry/accel.h"
#include "geometry/accel_boxes.h"
#include "geometry/facets.h"

#include <stdatomic.h>

#if CA_EMBREE_MAJOR >= 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

/* Quadrics of the world that Embree does not know, where they are few: they are met eight rays at a time before
 * Embree is asked, always in the same order. */
enum { CA_QUADRICS_APART = 8 };

/* Embree, and the memory it takes for all that was built with it. */
typedef struct ca_accel_device {
    atomic_uint owners;
    RTCDevice device;
    size_t bytes;
} ca_accel_device;

/* A structure of Embree's, which the versions of a scene that have it own together. Never changes once built. */
typedef struct ca_accel_part {
    atomic_uint owners;
    ca_accel_device *device;
    RTCScene scene;
    ca_shape *shapes; /* [count] what Embree borrows: copies, with meshes of ... */
    ca_mesh *meshes;  /* [count] ... their own (empty for other shapes) */
    ca_curve **curves; /* [count] likewise; NULL for other shapes */
    ca_sdf_grid **grids;
    uint32_t count;
} ca_accel_part;

struct ca_accel {
    ca_accel_device *device;
    ca_accel_part *world;    /* geometries by the numbers of their shapes */
    ca_accel_part *top;      /* instances by their numbers */
    ca_accel_part **groups;  /* [shape_count], at the first shape of a group that is instanced; NULL elsewhere */
    RTCScene world_scene, top_scene; /* those of `world` and `top`; NULL: nothing is in it */
    const ca_shape *shapes;
    uint32_t shape_count, world_count;
    const ca_accel_instance *instances;
    uint32_t instance_count;
    uint32_t builds;             /* of these structures, so many were built for this one */
    ca_vec3 low, cells_per_meter; /* the scene's bounds in a few cells along each axis: rays are sorted by them */
    uint32_t apart[CA_QUADRICS_APART], apart_count; /* quadrics that Embree does not know */
    ca_facets facets;                               /* flat pieces that it does not know */
    float origin_length2, direction_length2; /* rays are valid below these: ray_reach.h */
    ca_accel_boxes world_boxes, top_boxes;   /* around what is in world_scene and top_scene */
    bool world_meshes; /* of the world Embree knows nothing else: accel_batch.c */
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

/* Asks Embree for the nearest hit of a valid ray before hit->t with the shapes of the world, or with instances; where
 * there is none, *hit stays. The scene must not be NULL. */
bool ca_accel_meet_world(const ca_accel *accel, ca_vec3 origin, ca_vec3 direction, float t_min, ca_hit *hit);
bool ca_accel_meet_instances(const ca_accel *accel, ca_vec3 origin, ca_vec3 direction, float t_min, ca_hit *hit);

#endif
