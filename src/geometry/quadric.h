/* Spheres, disks and cylinders, exact: intersection in double precision, so that the nearest hit of a ray that starts
 * a rounding error off such a surface is decided correctly at any scale; surface points are put back onto the shape
 * and rounded once.
 *
 * All take the ray in the shape's own space (the world, or a shape group's). `direction` may have any length; t is in
 * units of it. Pure functions. */
#ifndef CA_GEOMETRY_QUADRIC_H
#define CA_GEOMETRY_QUADRIC_H

#include "geometry/shape.h"
#include "math/lanes.h"

/* Nearest t in (t_min, t_max), or false. */
bool ca_quadric_intersect(const ca_shape *shape, ca_vec3 origin, ca_vec3 direction, float t_min, float t_max,
                          float *t);
/* The same for eight rays: t, or t_max where there is none. */
ca_f8 ca_quadric_intersect8(const ca_shape *shape, ca_v8 origin, ca_v8 direction, ca_f8 t_min, ca_f8 t_max);

/* The surface point nearest to `position` (which is on the shape but for rounding): fills position, position_error,
 * ng, ns, uv but where the shape skips it, and dpdu, dpdv where it needs tangents. */
void ca_quadric_surface(const ca_shape *shape, ca_vec3 position, ca_surface *surface);

#endif
