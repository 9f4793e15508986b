/* How far rays may begin from the origin, and how long their directions may be, so that Embree can trace them: it
 * ends the process on a ray with a component over 1.844e18, also on one that it has mapped into an instance. It
 * inverts an instance's map in single precision: what that makes of a ray is bounded here, with all rounding,
 * underflow and cancellation. */
#ifndef CA_GEOMETRY_RAY_REACH_H
#define CA_GEOMETRY_RAY_REACH_H

#include "math/transform.h"

/* Largest lengths, of the origin as a vector and of the direction. */
typedef struct ca_ray_reach {
    float origin, direction;
} ca_ray_reach;

/* Without instances. */
#define CA_RAY_REACH ((ca_ray_reach){1e18f, 1e18f})

/* The reach of rays that may be mapped into an instance, at most *reach: which becomes it. false, and no change,
 * where single precision does not tell the map from a singular one, or its numbers overflow. */
bool ca_ray_reach_limit(ca_ray_reach *reach, const ca_affine *map);

#endif
