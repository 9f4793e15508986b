/* From a hit to a surface point: position with its rounding error, normals, texture coordinates, tangents. */
#include "geometry/accel.h"
#include "geometry/curve.h"
#include "geometry/quadric.h"
#include "geometry/sdf_grid.h"
#include "geometry/surface_point.h"
#include "geometry/triangle.h"
#include "math/numeric.h"

/* The farthest that the true surface can lie from `position` along the normal, and what rounding the sum will cost.
 * No branches: on which side a path goes on cannot be predicted. */
ca_vec3 ca_offset_origin(ca_vec3 position, ca_vec3 position_error, ca_vec3 ng, ca_vec3 direction)
{
    const ca_vec3 reach = ca_madd(position_error, CA_GAMMA(2), ca_abs3(position));
    const float distance = ca_dot(ca_abs3(ng), reach);
    return ca_madd(position, copysignf(distance, ca_dot(ng, direction)), ng);
}

/* `in_world`: the ray and the mesh are in the same space. */
static void mesh_surface(const ca_shape *shape, ca_vec3 origin, ca_vec3 direction, bool in_world, const ca_hit *hit,
                         ca_surface *surface)
{
    const ca_mesh *mesh = shape->as.mesh.mesh;
    surface->ng = ca_normalize_any(hit->ng);
    surface->ns = surface->ng;
    surface->barycentric = (ca_vec2){hit->u, hit->v};
    surface->uv = surface->barycentric;
    surface->mesh = mesh;
    if (!in_world || !ca_ray_position(shape->as.mesh.extent, origin, direction, hit->t,
                                       &surface->position, &surface->position_error)) {
        const ca_triangle t = ca_triangle_load(mesh, hit->primitive);
        ca_triangle_position(&t, surface->barycentric, surface);
    }
    if (mesh->uvs || mesh->normals)
        ca_triangle_attributes(mesh, hit->primitive, surface->barycentric, surface);
    if (!shape->needs_tangents) return;
    const ca_triangle t = ca_triangle_load(mesh, hit->primitive);
    ca_triangle_tangents(mesh, &t, surface);
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
    surface->ng = ca_normalize_any(ca_map_normal(map->from, surface->ng));
    surface->ns = ca_normalize_any(ca_map_normal(map->from, surface->ns));
    surface->dpdu = ca_map_vector(map->to, surface->dpdu);
    surface->dpdv = ca_map_vector(map->to, surface->dpdv);
}

/* `position` is in the shape's own space; `along`: of a curve's hit. */
static void smooth_surface(const ca_shape *shape, uint32_t primitive, float along, ca_vec3 position,
                           ca_surface *surface)
{
    surface->mesh = NULL;
    surface->barycentric = (ca_vec2){0};
    if (shape->kind == CA_SHAPE_CURVE)
        ca_curve_surface(shape, primitive, along, position, surface);
    else if (shape->kind == CA_SHAPE_SDF_GRID)
        ca_sdf_grid_surface(shape, primitive, position, surface);
    else
        ca_quadric_surface(shape, position, surface);
}

void ca_accel_surface(const ca_accel *accel, ca_vec3 origin, ca_vec3 direction, const ca_hit *hit,
                      ca_surface *surface)
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
        ca_vec3 position = ca_madd(origin, hit->t, direction);
        if (map) position = ca_map_point(map->from, position);
        smooth_surface(shape, hit->primitive, hit->u, position, surface);
    }
    if (map) surface_to_world(map, surface);
}

/* Shading normal, texture coordinates and tangents of a mesh at the point, in the mesh's own space. */
static void mesh_attributes_at(const ca_shape *shape, const ca_surface_point *point, ca_vec3 ng, ca_surface *surface)
{
    const ca_mesh *mesh = shape->as.mesh.mesh;
    surface->mesh = mesh;
    surface->ng = surface->ns = ng;
    surface->barycentric = point->barycentric;
    surface->uv = point->barycentric;
    surface->dpdu = surface->dpdv = (ca_vec3){0};
    if (mesh->uvs || mesh->normals) ca_triangle_attributes(mesh, point->primitive, point->barycentric, surface);
    if (!shape->needs_tangents) return;
    const ca_triangle t = ca_triangle_load(mesh, point->primitive);
    ca_triangle_tangents(mesh, &t, surface);
}

/* Position, its error and the geometric normal are the point's own, whatever is computed on the way to the others. */
void ca_accel_surface_at(const ca_accel *accel, const ca_surface_point *point, ca_surface *surface)
{
    const ca_shape *shape = ca_accel_shape(accel, point->shape);
    const ca_affine *map = point->instance == CA_NONE ? NULL : &ca_accel_instance_at(accel, point->instance)->map;
    const bool smooth = shape->kind == CA_SHAPE_MESH ? shape->as.mesh.mesh->normals != NULL
                                                     : shape->kind == CA_SHAPE_SDF_GRID;
    if (shape->kind == CA_SHAPE_MESH) {
        const ca_vec3 ng = map ? ca_normalize_any(ca_map_normal(map->to, point->ng)) : point->ng;
        mesh_attributes_at(shape, point, ng, surface);
    } else {
        smooth_surface(shape, point->primitive, point->barycentric.x,
                       map ? ca_map_point(map->from, point->position) : point->position, surface);
    }
    if (map) {
        surface->ns = ca_normalize_any(ca_map_normal(map->from, surface->ns));
        surface->dpdu = ca_map_vector(map->to, surface->dpdu);
        surface->dpdv = ca_map_vector(map->to, surface->dpdv);
    }
    surface->position = point->position;
    surface->position_error = (ca_vec3){point->position_error, point->position_error, point->position_error};
    surface->ng = point->ng;
    if (!smooth) surface->ns = point->ng;
    surface->shape = point->shape;
    surface->primitive = point->primitive;
    surface->instance = point->instance;
    surface->material = shape->material;
    surface->light = shape->light;
}
