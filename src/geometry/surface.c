/* From a hit to a surface point: position with its rounding error, normals, texture coordinates, tangents. */
#include "geometry/accel.h"
#include "geometry/quadric.h"
#include "math/numeric.h"

/* The farthest that the true surface can lie from `position` along the normal, and what rounding the sum will cost. No
 * branches: on which side a path goes on cannot be predicted. */
ca_vec3 ca_offset_origin(ca_vec3 position, ca_vec3 position_error, ca_vec3 ng, ca_vec3 direction)
{
    const ca_vec3 reach = ca_madd(position_error, CA_GAMMA(2), ca_abs3(position));
    const float distance = ca_dot(ca_abs3(ng), reach);
    return ca_madd(position, copysignf(distance, ca_dot(ng, direction)), ng);
}

typedef struct triangle {
    ca_vec3 p[3];
    uint32_t index[3];
} triangle;

static inline ca_vec3 load3(const float *values, uint32_t index)
{
    const float *p = values + 3 * (size_t)index;
    return (ca_vec3){p[0], p[1], p[2]};
}

static inline ca_vec2 load2(const float *values, uint32_t index)
{
    const float *p = values + 2 * (size_t)index;
    return (ca_vec2){p[0], p[1]};
}

static inline triangle load_triangle(const ca_mesh *mesh, uint32_t primitive)
{
    triangle t;
    const uint32_t *index = mesh->indices + 3 * (size_t)primitive;
    for (int k = 0; k < 3; k++) {
        t.index[k] = index[k];
        t.p[k] = load3(mesh->positions, index[k]);
    }
    return t;
}

/* dpdu and dpdv from the triangle's corners and their texture coordinates; without usable ones, along the edges that
 * the barycentric coordinates follow. */
static void triangle_tangents(const ca_mesh *mesh, const triangle *t, ca_surface *surface)
{
    const ca_vec3 e1 = ca_sub(t->p[1], t->p[0]), e2 = ca_sub(t->p[2], t->p[0]);
    surface->dpdu = e1;
    surface->dpdv = e2;
    if (!mesh->uvs) return;
    const ca_vec2 uv0 = load2(mesh->uvs, t->index[0]), uv1 = load2(mesh->uvs, t->index[1]),
                  uv2 = load2(mesh->uvs, t->index[2]);
    const float du1 = uv1.x - uv0.x, dv1 = uv1.y - uv0.y, du2 = uv2.x - uv0.x, dv2 = uv2.y - uv0.y;
    const float determinant = du1 * dv2 - dv1 * du2;
    if (determinant == 0.0f) return;
    const float inverse = 1.0f / determinant;
    surface->dpdu = ca_mul(ca_sub(ca_mul(e1, dv2), ca_mul(e2, dv1)), inverse);
    surface->dpdv = ca_mul(ca_sub(ca_mul(e2, du1), ca_mul(e1, du2)), inverse);
}

/* The point (b1, b2) of a triangle and a bound on how far rounding may have moved it off the plane: seven operations
 * on the products, and the plane that the intersection itself computes with rounded edges, which errs as much again. */
static void triangle_position(const triangle *t, float b0, float b1, float b2, ca_surface *surface)
{
    const ca_vec3 p0 = ca_mul(t->p[0], b0), p1 = ca_mul(t->p[1], b1), p2 = ca_mul(t->p[2], b2);
    surface->position = ca_add(ca_add(p0, p1), p2);
    const ca_vec3 extent = ca_max_vec3(ca_abs3(t->p[0]), ca_max_vec3(ca_abs3(t->p[1]), ca_abs3(t->p[2])));
    surface->position_error = ca_mul(extent, 2.0f * CA_GAMMA(7));
}

/* A ray from not too far away gives the point without a look at the triangle's corners, which in a large mesh are three
 * cache misses. The bound: t comes from a plane through a corner, with about a dozen roundings of numbers no larger than the
 * corner's, the origin's and the segment's coordinates together. false where the ray is so long that the corners give
 * a better bound. */
static inline bool ray_position(const ca_shape *shape, ca_vec3 origin, ca_vec3 direction, float t, ca_surface *surface)
{
    const ca_vec3 segment = ca_mul(direction, t);
    const float reach = ca_max3(ca_abs3(segment)) + ca_max3(ca_abs3(origin));
    if (reach > 4.0f * shape->extent) return false;
    const float bound = CA_GAMMA(12) * (reach + shape->extent);
    surface->position = ca_add(origin, segment);
    surface->position_error = (ca_vec3){bound, bound, bound};
    return true;
}

/* Interpolated texture coordinates and shading normal. */
static inline void mesh_attributes(const ca_mesh *mesh, const uint32_t index[3], float b0, float b1, float b2,
                                   ca_surface *surface)
{
    if (mesh->uvs) {
        const ca_vec2 uv0 = load2(mesh->uvs, index[0]), uv1 = load2(mesh->uvs, index[1]),
                      uv2 = load2(mesh->uvs, index[2]);
        surface->uv = (ca_vec2){b0 * uv0.x + b1 * uv1.x + b2 * uv2.x, b0 * uv0.y + b1 * uv1.y + b2 * uv2.y};
    }
    if (!mesh->normals) return;
    const ca_vec3 n = ca_madd(
        ca_madd(ca_mul(load3(mesh->normals, index[0]), b0), b1, load3(mesh->normals, index[1])), b2,
        load3(mesh->normals, index[2]));
    const float length2 = ca_length2(n);
    if (length2 > 0.0f) surface->ns = ca_mul(n, 1.0f / sqrtf(length2));
    if (ca_dot(surface->ns, surface->ng) < 0.0f) surface->ng = ca_neg(surface->ng);
}

/* `in_world`: the ray and the mesh are in the same space. */
static void mesh_surface(const ca_shape *shape, ca_vec3 origin, ca_vec3 direction, bool in_world, const ca_hit *hit,
                         ca_surface *surface)
{
    const ca_mesh *mesh = shape->mesh;
    const float b1 = hit->u, b2 = hit->v, b0 = 1.0f - b1 - b2;
    surface->ng = ca_normalize(hit->ng);
    surface->ns = surface->ng;
    surface->barycentric = (ca_vec2){b1, b2};
    surface->uv = surface->barycentric;
    surface->mesh = mesh;
    if (!in_world || !ray_position(shape, origin, direction, hit->t, surface)) {
        const triangle t = load_triangle(mesh, hit->primitive);
        triangle_position(&t, b0, b1, b2, surface);
    }
    if (mesh->uvs || mesh->normals)
        mesh_attributes(mesh, mesh->indices + 3 * (size_t)hit->primitive, b0, b1, b2, surface);
    if (!shape->needs_tangents) return;
    const triangle t = load_triangle(mesh, hit->primitive);
    triangle_tangents(mesh, &t, surface);
}

/* |M| p + |translation|: how large the terms are that a map adds up. */
static ca_vec3 map_magnitude(const float m[3][4], ca_vec3 p_abs)
{
    return (ca_vec3){fabsf(m[0][0]) * p_abs.x + fabsf(m[0][1]) * p_abs.y + fabsf(m[0][2]) * p_abs.z + fabsf(m[0][3]),
                     fabsf(m[1][0]) * p_abs.x + fabsf(m[1][1]) * p_abs.y + fabsf(m[1][2]) * p_abs.z + fabsf(m[1][3]),
                     fabsf(m[2][0]) * p_abs.x + fabsf(m[2][1]) * p_abs.y + fabsf(m[2][2]) * p_abs.z + fabsf(m[2][3])};
}

static ca_vec3 map_magnitude_vector(const float m[3][4], ca_vec3 v_abs)
{
    return ca_sub(map_magnitude(m, v_abs), (ca_vec3){fabsf(m[0][3]), fabsf(m[1][3]), fabsf(m[2][3])});
}

/* Takes a surface from a group's space to the world. Its error grows by the map's own rounding and by that of the
 * inverse map, through which Embree takes rays into the group. */
static void surface_to_world(const ca_affine *map, ca_surface *surface)
{
    const ca_vec3 local_abs = ca_abs3(surface->position);
    const ca_vec3 local_error = surface->position_error;
    surface->position = ca_map_point(map->to, surface->position);
    const ca_vec3 inverse_error = ca_mul(map_magnitude(map->from, ca_abs3(surface->position)), 2.0f * CA_GAMMA(4));
    surface->position_error = ca_add(map_magnitude_vector(map->to, ca_add(local_error, inverse_error)),
                                     ca_mul(map_magnitude(map->to, local_abs), CA_GAMMA(4)));
    surface->ng = ca_normalize(ca_map_normal(map->from, surface->ng));
    surface->ns = ca_normalize(ca_map_normal(map->from, surface->ns));
    surface->dpdu = ca_map_vector(map->to, surface->dpdu);
    surface->dpdv = ca_map_vector(map->to, surface->dpdv);
}

void ca_accel_surface(const ca_accel *accel, ca_vec3 origin, ca_vec3 direction, const ca_hit *hit, ca_surface *surface)
{
    const ca_shape *shape = ca_accel_shape(accel, hit->shape);
    surface->shape = hit->shape;
    surface->primitive = hit->primitive;
    surface->instance = hit->instance;
    surface->material = shape->material;
    surface->light = shape->light;
    const ca_affine *map = hit->instance == CA_NONE ? NULL : &ca_accel_instance_at(accel, hit->instance)->map;
    if (shape->kind == CA_SHAPE_MESH) {
        surface->dpdu = surface->dpdv = (ca_vec3){0};
        mesh_surface(shape, origin, direction, !map, hit, surface);
    } else {
        surface->mesh = NULL;
        surface->barycentric = (ca_vec2){0};
        ca_vec3 position = ca_madd(origin, hit->t, direction);
        if (map) position = ca_map_point(map->from, position);
        ca_quadric_surface(shape, position, surface);
    }
    if (map) surface_to_world(map, surface);
}
