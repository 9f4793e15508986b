/* Points of a mesh's triangles: position with its error bound, texture coordinates, normals, tangents. Shared by hits
 * (surface.c) and by points that are sampled (shape_sampling.c), so that both describe the same surface. In the
 * mesh's own space; barycentric coordinates are those of corners 1 and 2. Pure functions, inline for the hot path. */
#ifndef CA_GEOMETRY_TRIANGLE_H
#define CA_GEOMETRY_TRIANGLE_H

#include "geometry/shape.h"
#include "math/numeric.h"

typedef struct ca_triangle {
    ca_vec3 p[3];
    uint32_t index[3];
} ca_triangle;

static inline ca_vec3 ca_load3(const float *values, uint32_t index)
{
    const float *p = values + 3 * (size_t)index;
    return (ca_vec3){p[0], p[1], p[2]};
}

static inline ca_vec2 ca_load2(const float *values, uint32_t index)
{
    const float *p = values + 2 * (size_t)index;
    return (ca_vec2){p[0], p[1]};
}

static inline ca_triangle ca_triangle_load(const ca_mesh *mesh, uint32_t primitive)
{
    ca_triangle t;
    const uint32_t *index = mesh->indices + 3 * (size_t)primitive;
    for (int k = 0; k < 3; k++) {
        t.index[k] = index[k];
        t.p[k] = ca_load3(mesh->positions, index[k]);
    }
    return t;
}

/* dpdu and dpdv from the triangle's corners and their texture coordinates; without usable ones, along the edges that
 * the barycentric coordinates follow. */
static inline void ca_triangle_tangents(const ca_mesh *mesh, const ca_triangle *t, ca_surface *surface)
{
    const ca_vec3 e1 = ca_sub(t->p[1], t->p[0]), e2 = ca_sub(t->p[2], t->p[0]);
    surface->dpdu = e1;
    surface->dpdv = e2;
    if (!mesh->uvs) return;
    const ca_vec2 uv0 = ca_load2(mesh->uvs, t->index[0]), uv1 = ca_load2(mesh->uvs, t->index[1]),
                  uv2 = ca_load2(mesh->uvs, t->index[2]);
    const float du1 = uv1.x - uv0.x, dv1 = uv1.y - uv0.y, du2 = uv2.x - uv0.x, dv2 = uv2.y - uv0.y;
    const float determinant = du1 * dv2 - dv1 * du2;
    if (determinant == 0.0f) return;
    const float inverse = 1.0f / determinant;
    surface->dpdu = ca_mul(ca_sub(ca_mul(e1, dv2), ca_mul(e2, dv1)), inverse);
    surface->dpdv = ca_mul(ca_sub(ca_mul(e2, du1), ca_mul(e1, du2)), inverse);
}

/* The point of a triangle at barycentric coordinates b, and a bound on how far rounding may have moved it off the
 * plane: seven operations on the products, and the plane that the intersection itself computes with rounded edges,
 * which errs as much again. The bound is the same on every axis: where all corners have the coordinate 0 the position
 * is exact, but the other axes' rounding still enters the intersection's t, which may be 0 either way. */
static inline void ca_triangle_position(const ca_triangle *t, ca_vec2 b, ca_surface *surface)
{
    surface->position = ca_madd(ca_madd(ca_mul(t->p[0], 1.0f - b.x - b.y), b.x, t->p[1]), b.y, t->p[2]);
    const ca_vec3 extent = ca_max_vec3(ca_abs3(t->p[0]), ca_max_vec3(ca_abs3(t->p[1]), ca_abs3(t->p[2])));
    const float bound = 2.0f * CA_GAMMA(7) * ca_max3(extent);
    surface->position_error = (ca_vec3){bound, bound, bound};
}

/* The point (s, t) in [0, 1]^2 of a plain rectangle (rectangle.h) with these corners, which are weighted like a
 * triangle's. */
static inline void ca_plain_rectangle_position(ca_vec3 corner, ca_vec3 end_x, ca_vec3 end_y, ca_vec2 st,
                                               ca_surface *surface)
{
    const ca_triangle corners = {.p = {corner, end_x, end_y}};
    ca_triangle_position(&corners, st, surface);
    surface->position_error = ca_mul(surface->position_error, CA_RECTANGLE_ERROR);
}

/* A ray from not too far away gives the point without a look at the triangle's corners, which in a large mesh are
 * three cache misses. The bound: t comes from a plane through a corner, with about a dozen roundings of numbers no
 * larger than the corner's, the origin's and the segment's coordinates together. `extent`: the mesh's. false where
 * the ray is so long that the corners give a better bound. */
static inline bool ca_ray_position(float extent, ca_vec3 origin, ca_vec3 direction, float t, ca_vec3 *position,
                                   ca_vec3 *error)
{
    const ca_vec3 segment = ca_mul(direction, t);
    const float reach = ca_max3(ca_abs3(segment)) + ca_max3(ca_abs3(origin));
    if (reach > 4.0f * extent) return false;
    const float bound = CA_GAMMA(12) * (reach + extent);
    *position = ca_add(origin, segment);
    *error = (ca_vec3){bound, bound, bound};
    return true;
}

/* Interpolated texture coordinates and shading normal. */
static inline void ca_triangle_attributes(const ca_mesh *mesh, uint32_t primitive, ca_vec2 b, ca_surface *surface)
{
    const uint32_t *index = mesh->indices + 3 * (size_t)primitive;
    const float b1 = b.x, b2 = b.y, b0 = 1.0f - b1 - b2;
    if (mesh->uvs) {
        const ca_vec2 uv0 = ca_load2(mesh->uvs, index[0]), uv1 = ca_load2(mesh->uvs, index[1]),
                      uv2 = ca_load2(mesh->uvs, index[2]);
        surface->uv = (ca_vec2){b0 * uv0.x + b1 * uv1.x + b2 * uv2.x, b0 * uv0.y + b1 * uv1.y + b2 * uv2.y};
    }
    if (!mesh->normals) return;
    const ca_vec3 n = ca_madd(
        ca_madd(ca_mul(ca_load3(mesh->normals, index[0]), b0), b1, ca_load3(mesh->normals, index[1])), b2,
        ca_load3(mesh->normals, index[2]));
    const float length2 = ca_length2(n);
    if (length2 > 0.0f) surface->ns = ca_mul(n, 1.0f / sqrtf(length2));
    if (ca_dot(surface->ns, surface->ng) < 0.0f) surface->ng = ca_neg(surface->ng);
}

#endif
