/* Ray intersection by Embree, and without it for a few quadrics and flat pieces, behind this one file. Compiles
 * against Embree 3.13 and 4.
 *
 * The instruction set is pinned (AVX2) because hits differ in the last bit across instruction sets; across threads,
 * builds and call types they do not. Single-level instancing. Rays are checked here: one that is not finite is
 * counted as a miss in release builds and asserts in debug builds. Cost: 35 to 70 bytes a triangle on top of the
 * mesh. Threads: immutable after ca_accel_create. */
#ifndef CA_GEOMETRY_ACCEL_H
#define CA_GEOMETRY_ACCEL_H

#include "geometry/shape.h"
#include "math/numeric.h"

typedef struct ca_accel ca_accel;

typedef struct ca_accel_instance {
    uint32_t first_shape, shape_count; /* the group's shapes */
    ca_affine map;                     /* group -> world */
} ca_accel_instance;

/* What a ray met. 36 bytes. */
typedef struct ca_hit {
    float t;
    float u, v; /* barycentric of corners 1 and 2 (meshes); u: the place along a curve's segment */
    ca_vec3 ng; /* a triangle's normal, by the winding, in the shape's own space; of any length */
    uint32_t shape, primitive, instance; /* shape: index in the scene's shapes; CA_NONE: nothing was met */
} ca_hit;

/* Shapes [0, world_count) are the world's. Borrows the arrays. `threads` build it (0: all). `stop`: base/stop.h.
 * CA_ERROR_SCENE: an instance whose map has no reach (ray_reach.h). */
ca_status ca_accel_create(const ca_shape *shapes, uint32_t shape_count, uint32_t world_count,
                          const ca_accel_instance *instances, uint32_t instance_count, uint32_t threads,
                          const int *stop, ca_accel **accel, ca_error *error);
/* The same for the next version of a scene: what of `previous` (may be NULL) is the same, to the bit, is not built
 * again but shared; that is the world's meshes (and its quadrics, where they are more than a few) as a whole, each
 * group, and the instances as a whole. Either may be destroyed first. Threads: several may share one. */
ca_status ca_accel_create_after(const ca_accel *previous, const ca_shape *shapes, uint32_t shape_count,
                                uint32_t world_count, const ca_accel_instance *instances, uint32_t instance_count,
                                uint32_t threads, const int *stop, ca_accel **accel, ca_error *error);
void ca_accel_destroy(ca_accel *accel);

/* Nearest hit with t_min < t < t_max; t is in units of |direction|. */
bool ca_accel_intersect(const ca_accel *accel, ca_vec3 origin, ca_vec3 direction, float t_min, float t_max,
                        ca_hit *hit);
/* Is anything in between? */
bool ca_accel_occluded(const ca_accel *accel, ca_vec3 origin, ca_vec3 direction, float t_min, float t_max);

/* The surface at a hit of the ray. */
void ca_accel_surface(const ca_accel *accel, ca_vec3 origin, ca_vec3 direction, const ca_hit *hit,
                      ca_surface *surface);

/* The ray between two points, moved off their surfaces towards each other; a normal of zero means that the point lies
 * on no surface. t = 1 is the far end; beyond ca_visible_t_max the far end's own surface would be met: the point has
 * been moved by its own rounding error, what remains is the relative rounding of t inside the intersection (about a
 * dozen operations). */
static const float ca_visible_t_max = 1.0f - CA_GAMMA(16);

typedef struct ca_segment {
    ca_vec3 origin, direction;
} ca_segment;

static inline ca_segment ca_segment_between(ca_vec3 a, ca_vec3 a_error, ca_vec3 a_ng, ca_vec3 b, ca_vec3 b_error,
                                            ca_vec3 b_ng)
{
    const ca_vec3 a_to_b = ca_sub(b, a);
    const ca_vec3 origin = ca_offset_origin(a, a_error, a_ng, a_to_b);
    const ca_vec3 target = ca_offset_origin(b, b_error, b_ng, ca_neg(a_to_b));
    return (ca_segment){origin, ca_sub(target, origin)};
}

/* Is the segment between two points free? Both ends are moved off their surfaces, towards each other; a normal of
 * zero means that the point lies on no surface. */
bool ca_accel_visible(const ca_accel *accel, ca_vec3 a, ca_vec3 a_error, ca_vec3 a_ng, ca_vec3 b, ca_vec3 b_error,
                      ca_vec3 b_ng);

/* Whether structures made from now on keep quadrics and flat pieces out of Embree where they are few, as they do
 * unless this says otherwise, and rays that pass by all boxes: for tests and measurements, while no other thread
 * makes one. */
void ca_accel_keep_apart(bool keep);

/* Of Embree's structures, without the meshes; of all those that share some. */
size_t ca_accel_bytes(const ca_accel *accel);
/* How many structures were built for it, not shared. */
uint32_t ca_accel_builds(const ca_accel *accel);

/* Borrowed. */
const ca_shape *ca_accel_shape(const ca_accel *accel, uint32_t shape);
const ca_accel_instance *ca_accel_instance_at(const ca_accel *accel, uint32_t instance);

#endif
