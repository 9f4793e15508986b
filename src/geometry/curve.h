/* Round curves: tubes around polylines or uniform cubic B-splines, whose radius is interpolated like their points.
 *
 * A segment starts at a control point and depends on it and on the next `degree` ones. Around a B-spline the tube is
 * swept by circles across it, open at both ends, and smooth where segments meet; around a polyline it is the hull of
 * spheres that move along each segment, so that corners and ends are round. Rays meet it from outside only.
 *
 * Layout: points[4 p] are x, y, z and the radius. Space: the world's once placed, or a group's. uv: u is the angle
 * around the curve in turns, from z x t towards z for the tangent t (as in Mitsuba 3); v the segment's number plus
 * the place in it, over the number of segments. Owners share a curve; Embree borrows its arrays. */
#ifndef CA_GEOMETRY_CURVE_H
#define CA_GEOMETRY_CURVE_H

#include "geometry/shape.h"

#include <stdatomic.h>
#include <stddef.h>

typedef enum ca_curve_degree { CA_CURVE_LINEAR = 1, CA_CURVE_CUBIC = 3 } ca_curve_degree;

struct ca_curve {
    atomic_uint owners;
    ca_curve_degree degree;
    uint32_t point_count, segment_count;
    float *points;      /* a radius may be negative where the tube's own is not */
    uint32_t *segments; /* the first point of each */
    uint64_t content_hash; /* of the file it was read from; 0: none */
    bool placed;
    ca_vec3 low, high; /* of a placed one */
};

/* Zeroed, with one owner. Errors: CA_ERROR_MEMORY, CA_ERROR_UNSUPPORTED beyond 2^30 points. */
ca_status ca_curve_create(ca_curve_degree degree, size_t point_count, size_t segment_count, ca_curve **curve,
                          ca_error *error);
ca_curve *ca_curve_share(const ca_curve *curve); /* one owner more */
void ca_curve_destroy(ca_curve *curve);          /* an owner less; NULL is allowed */

/* Moves the points, once; radii stay what they are, as in Mitsuba 3. False: a point is not finite then. */
bool ca_curve_place(ca_curve *curve, const ca_affine *map);
size_t ca_curve_bytes(const ca_curve *curve);
bool ca_curve_equal(const ca_curve *a, const ca_curve *b); /* to rays, to the bit */

/* The surface point nearest to `position`, which is on the segment but for rounding; `along` is its place in the
 * segment, [0, 1] (of cubic ones). Fills position, position_error, ng, ns and barycentric (`along`, 0), uv but where
 * the shape skips it, and dpdu, dpdv where it needs tangents. */
void ca_curve_surface(const ca_shape *shape, uint32_t segment, float along, ca_vec3 position, ca_surface *surface);

#endif
