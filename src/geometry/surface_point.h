/* A point of a surface in few bytes, from which the whole ca_surface can be made again. World space. 48 bytes. */
#ifndef CA_GEOMETRY_SURFACE_POINT_H
#define CA_GEOMETRY_SURFACE_POINT_H

#include "geometry/accel.h"

typedef struct ca_surface_point {
    ca_vec3 ng;
    ca_vec3 position;
    float position_error; /* bound on every coordinate's error */
    ca_vec2 barycentric;
    uint32_t shape, primitive, instance;
} ca_surface_point;

static inline ca_surface_point ca_surface_point_of(const ca_surface *surface)
{
    return (ca_surface_point){
        .ng = surface->ng,
        .position = surface->position,
        .position_error = ca_max3(surface->position_error),
        .barycentric = surface->barycentric,
        .shape = surface->shape,
        .primitive = surface->primitive,
        .instance = surface->instance,
    };
}

/* The surface at the point: equal to the one it came from but for rounding, and for the error bound, which may be
 * larger. */
void ca_accel_surface_at(const ca_accel *accel, const ca_surface_point *point, ca_surface *surface);

#endif
