/* Points of shapes for light sources: uniform by area, or seen from a point of the scene; and bounds. */
#include "geometry/curve.h"
#include "geometry/quadric.h"
#include "geometry/sdf_grid.h"
#include "geometry/triangle.h"
#include "math/numeric.h"
#include "sampling/warp.h"

/* ---- By area --------------------------------------------------------------------------------------------------- */

/* The point as ca_accel_surface would make it from a hit there. */
static void triangle_surface(const ca_mesh *mesh, uint32_t primitive, ca_vec2 barycentric, ca_surface *surface)
{
    const ca_triangle t = ca_triangle_load(mesh, primitive);
    ca_triangle_position(&t, barycentric, surface);
    surface->ng = ca_normalize_any(ca_cross(ca_sub(t.p[1], t.p[0]), ca_sub(t.p[2], t.p[0])));
    surface->ns = surface->ng;
    surface->barycentric = surface->uv = barycentric;
    surface->mesh = mesh;
    surface->primitive = primitive;
    ca_triangle_attributes(mesh, primitive, barycentric, surface);
}

/* Without choosing a triangle first. */
static void sample_plain_rectangle(const ca_shape *shape, ca_vec2 u, ca_surface *surface)
{
    const ca_rectangle *rectangle = &shape->as.mesh.rectangle;
    ca_vec2 barycentric;
    surface->mesh = shape->as.mesh.mesh;
    surface->primitive = ca_rectangle_triangle(rectangle, u, &barycentric);
    surface->barycentric = surface->uv = barycentric;
    surface->ng = surface->ns = rectangle->n;
    if (surface->mesh->uvs) ca_triangle_attributes(surface->mesh, surface->primitive, barycentric, surface);
    ca_plain_rectangle_position(rectangle->corner, rectangle->end_x, rectangle->end_y, u, surface);
}

static void sample_mesh(const ca_shape *shape, ca_vec2 u, ca_surface *surface)
{
    if (shape->as.mesh.rectangle.is_plain) {
        sample_plain_rectangle(shape, u, surface);
        return;
    }
    float probability;
    const uint32_t primitive = ca_distribution_1d_sample(&shape->as.mesh.triangles, u.x, &probability, &u.x);
    triangle_surface(shape->as.mesh.mesh, primitive, ca_warp_triangle(u), surface);
}

static ca_vec3 disk_point(const ca_affine *map, ca_vec2 u)
{
    const ca_vec2 d = ca_warp_disk(u);
    return ca_map_point(map->to, (ca_vec3){d.x, d.y, 0.0f});
}

static ca_vec3 cylinder_point(const ca_affine *map, ca_vec2 u)
{
    float s, c;
    ca_sincos(CA_TWO_PI * u.x, &s, &c);
    return ca_map_point(map->to, (ca_vec3){c, s, u.y});
}

static ca_surface blank_surface(const ca_shape *shape)
{
    return (ca_surface){.shape = CA_NONE, .instance = CA_NONE, .material = shape->material, .light = shape->light};
}

ca_pdf_area ca_shape_sample_area(const ca_shape *shape, ca_vec2 u, ca_surface *surface)
{
    *surface = blank_surface(shape);
    switch (shape->kind) {
    case CA_SHAPE_MESH: sample_mesh(shape, u, surface); break;
    case CA_SHAPE_SPHERE:
        ca_quadric_surface(shape, ca_madd(shape->as.sphere.center, shape->as.sphere.radius, ca_warp_sphere(u)),
                           surface);
        break;
    case CA_SHAPE_DISK: ca_quadric_surface(shape, disk_point(&shape->as.disk.map, u), surface); break;
    case CA_SHAPE_CYLINDER: ca_quadric_surface(shape, cylinder_point(&shape->as.cylinder.map, u), surface); break;
    case CA_SHAPE_CURVE: /* never a light */
    case CA_SHAPE_SDF_GRID:
    case CA_SHAPE_KIND_COUNT: break;
    }
    return (ca_pdf_area){1.0f / shape->area};
}

/* ---- Perpendiculars -------------------------------------------------------------------------------------------- */

static bool has_normals_of(const ca_mesh *mesh, ca_vec3 n)
{
    for (uint32_t i = 0; mesh->normals && i < 3 * mesh->triangle_count; i++) {
        const ca_vec3 normal = ca_load3(mesh->normals, mesh->indices[i]);
        if (!(fabsf(ca_dot(normal, n)) > (1.0f - 1e-6f) * ca_length(normal))) return false;
    }
    return true;
}

bool ca_shape_is_flat(const ca_shape *shape)
{
    if (shape->kind != CA_SHAPE_MESH) return shape->kind == CA_SHAPE_DISK;
    const ca_rectangle *rectangle = &shape->as.mesh.rectangle;
    return rectangle->exists && has_normals_of(shape->as.mesh.mesh, rectangle->n);
}

static bool disk_foot(const ca_shape *shape, ca_vec3 reference, ca_surface *surface)
{
    const ca_affine *map = &shape->as.disk.map;
    ca_quadric_surface(shape, ca_map_point(map->to, (ca_vec3){0}), surface);
    const float height = ca_dot(ca_sub(reference, surface->position), surface->ng);
    const ca_vec3 foot = ca_madd(reference, -height, surface->ng);
    const ca_vec3 local = ca_map_point(map->from, foot);
    ca_quadric_surface(shape, foot, surface);
    return local.x * local.x + local.y * local.y <= 1.0f;
}

static bool rectangle_foot(const ca_shape *shape, ca_vec3 reference, ca_surface *surface)
{
    const ca_rectangle *rectangle = &shape->as.mesh.rectangle;
    const ca_vec3 offset = ca_sub(reference, rectangle->corner);
    const ca_vec2 st = {ca_dot(offset, rectangle->x) / rectangle->width,
                        ca_dot(offset, rectangle->y) / rectangle->height};
    if (!(st.x >= 0.0f && st.x <= 1.0f && st.y >= 0.0f && st.y <= 1.0f)) return false;
    ca_vec2 barycentric;
    const uint32_t primitive = ca_rectangle_triangle(rectangle, st, &barycentric);
    triangle_surface(shape->as.mesh.mesh, primitive, barycentric, surface);
    return true;
}

bool ca_shape_foot(const ca_shape *shape, ca_vec3 reference, ca_surface *surface)
{
    *surface = blank_surface(shape);
    return shape->kind == CA_SHAPE_DISK ? disk_foot(shape, reference, surface)
                                        : rectangle_foot(shape, reference, surface);
}

/* ---- Seen from a point ----------------------------------------------------------------------------------------- */

/* Density per solid angle at the reference of a point chosen by area. */
static ca_pdf_solid_angle area_pdf_direct(const ca_shape *shape, ca_vec3 reference, ca_vec3 position, ca_vec3 ng)
{
    const ca_vec3 segment = ca_sub(position, reference);
    const float distance2 = ca_length2(segment);
    if (!(distance2 > 0.0f)) return (ca_pdf_solid_angle){0.0f};
    const float cos_far = ca_abs_dot(ng, segment) / sqrtf(distance2);
    return ca_pdf_to_solid_angle((ca_pdf_area){1.0f / shape->area}, cos_far, distance2);
}

/* The cone in which a sphere is seen. In double precision, where the difference of squared distances keeps enough
 * digits for references that nearly touch the sphere and for spheres that are tiny or far. */
typedef struct sphere_cone {
    ca_vec3 axis; /* unit, from the reference to the centre */
    float sin2_max, one_minus_cos_max;
} sphere_cone;

/* false: the reference is inside of the sphere, or on it but for the rounding of its coordinates (from a point of the
 * sphere's own inside, the cone would show the wrong side of it). */
static bool sphere_cone_from(const ca_shape *shape, ca_vec3 reference, sphere_cone *cone)
{
    const ca_vec3 center = shape->as.sphere.center;
    const float radius = shape->as.sphere.radius;
    const double x = (double)center.x - (double)reference.x, y = (double)center.y - (double)reference.y,
                 z = (double)center.z - (double)reference.z;
    const double distance2 = x * x + y * y + z * z, radius2 = (double)radius * (double)radius;
    const double rounding = (double)(CA_GAMMA(8) * (ca_max3(ca_abs3(center)) + radius));
    const double clear_radius = (double)radius + rounding;
    if (!(distance2 > clear_radius * clear_radius)) return false;
    const double inverse = 1.0 / sqrt(distance2);
    const double sin2 = radius2 / distance2, cos_max = sqrt((distance2 - radius2) / distance2);
    cone->axis = (ca_vec3){(float)(x * inverse), (float)(y * inverse), (float)(z * inverse)};
    cone->sin2_max = (float)sin2;
    cone->one_minus_cos_max = (float)(sin2 / (1.0 + cos_max));
    return true;
}

/* The point where a direction of the cone meets the sphere first, by its normal. theta is the angle at the reference,
 * i the angle of incidence; the law of sines gives sin i = sin theta / sin theta_max, and the angle at the centre is
 * i - theta. Nothing cancels, however small the sphere is. */
static ca_vec3 cone_normal(const sphere_cone *cone, ca_vec2 u)
{
    const ca_vec3 d = ca_warp_cone(u, cone->one_minus_cos_max);
    const float sin2 = d.x * d.x + d.y * d.y, sin_theta = sqrtf(sin2);
    if (!(sin_theta > 0.0f)) return ca_neg(cone->axis);
    const float sin2_incidence = fminf(sin2 / cone->sin2_max, 1.0f);
    const float sin_i = sqrtf(sin2_incidence), cos_i = sqrtf(1.0f - sin2_incidence);
    const float cos_centre = cos_i * d.z + sin_i * sin_theta;
    const float sin_centre = sin_i * d.z - cos_i * sin_theta;
    const ca_frame frame = ca_frame_from_normal(cone->axis);
    const float across = sin_centre / sin_theta;
    return ca_to_world(&frame, (ca_vec3){d.x * across, d.y * across, -cos_centre});
}

static ca_pdf_solid_angle sample_cone(const ca_shape *shape, const sphere_cone *cone, ca_vec2 u, ca_surface *surface)
{
    *surface = blank_surface(shape);
    const ca_vec3 normal = cone_normal(cone, u);
    ca_quadric_surface(shape, ca_madd(shape->as.sphere.center, shape->as.sphere.radius, normal), surface);
    /* The normal from the rounded position would be a coarse one for a tiny sphere far from the origin. */
    surface->ng = surface->ns = shape->flip_normals ? ca_neg(normal) : normal;
    return ca_warp_cone_pdf(cone->one_minus_cos_max);
}

static ca_pdf_solid_angle sample_rectangle(const ca_shape *shape, const ca_spherical_rectangle *seen, ca_vec2 u,
                                           ca_surface *surface)
{
    const ca_rectangle *rectangle = &shape->as.mesh.rectangle;
    const ca_vec2 st = ca_spherical_rectangle_sample(seen, u);
    *surface = blank_surface(shape);
    if (rectangle->is_plain) {
        sample_plain_rectangle(shape, st, surface);
    } else {
        ca_vec2 barycentric;
        const uint32_t primitive = ca_rectangle_triangle(rectangle, st, &barycentric);
        triangle_surface(shape->as.mesh.mesh, primitive, barycentric, surface);
    }
    return (ca_pdf_solid_angle){(float)(1.0 / seen->solid_angle)};
}

static bool rectangle_from(const ca_shape *shape, ca_vec3 reference, ca_spherical_rectangle *seen)
{
    const ca_rectangle *rectangle = &shape->as.mesh.rectangle;
    return rectangle->exists && ca_spherical_rectangle_from(rectangle, reference, seen);
}

void ca_shape_sample_seen(const ca_shape *shape, ca_vec3 reference, ca_vec2 u, ca_surface *surface,
                          ca_pdf_solid_angle *by_solid_angle)
{
    sphere_cone cone;
    ca_spherical_rectangle seen;
    if (shape->kind == CA_SHAPE_SPHERE && sphere_cone_from(shape, reference, &cone)) {
        *by_solid_angle = sample_cone(shape, &cone, u, surface);
    } else if (shape->kind == CA_SHAPE_MESH && rectangle_from(shape, reference, &seen)) {
        *by_solid_angle = sample_rectangle(shape, &seen, u, surface);
    } else {
        *by_solid_angle = (ca_pdf_solid_angle){0.0f};
        ca_shape_sample_area(shape, u, surface);
    }
}

ca_pdf_solid_angle ca_shape_pdf_seen(const ca_shape *shape, ca_vec3 reference)
{
    sphere_cone cone;
    ca_spherical_rectangle seen;
    if (shape->kind == CA_SHAPE_SPHERE && sphere_cone_from(shape, reference, &cone))
        return ca_warp_cone_pdf(cone.one_minus_cos_max);
    if (shape->kind == CA_SHAPE_MESH && rectangle_from(shape, reference, &seen))
        return (ca_pdf_solid_angle){(float)(1.0 / seen.solid_angle)};
    return (ca_pdf_solid_angle){0.0f};
}

ca_pdf_solid_angle ca_shape_sample_direct(const ca_shape *shape, ca_vec3 reference, ca_vec2 u, ca_surface *surface)
{
    ca_pdf_solid_angle pdf;
    ca_shape_sample_seen(shape, reference, u, surface, &pdf);
    return pdf.v > 0.0f ? pdf : area_pdf_direct(shape, reference, surface->position, surface->ng);
}

ca_pdf_solid_angle ca_shape_pdf_direct(const ca_shape *shape, ca_vec3 reference, ca_vec3 position, ca_vec3 ng)
{
    const ca_pdf_solid_angle pdf = ca_shape_pdf_seen(shape, reference);
    return pdf.v > 0.0f ? pdf : area_pdf_direct(shape, reference, position, ng);
}

/* ---- Bounds ---------------------------------------------------------------------------------------------------- */

static ca_vec3 column(const ca_affine *map, int i)
{
    return (ca_vec3){map->to[0][i], map->to[1][i], map->to[2][i]};
}

/* Half the size of the box around the circle (or ellipse) that the map makes of the unit circle in z = 0. */
static ca_vec3 circle_extent(const ca_affine *map)
{
    const ca_vec3 s = column(map, 0), t = column(map, 1);
    return (ca_vec3){sqrtf(s.x * s.x + t.x * t.x), sqrtf(s.y * s.y + t.y * t.y), sqrtf(s.z * s.z + t.z * t.z)};
}

static void mesh_bounds(const ca_mesh *mesh, ca_vec3 *low, ca_vec3 *high)
{
    if (mesh->placed)
        *low = mesh->low, *high = mesh->high;
    else
        ca_mesh_bounds(mesh, low, high);
}

/* Wider by the rounding of the few operations that made the box. */
static void widen(ca_vec3 *low, ca_vec3 *high)
{
    const ca_vec3 error = ca_mul(ca_max_vec3(ca_abs3(*low), ca_abs3(*high)), CA_GAMMA(8));
    *low = ca_sub(*low, error);
    *high = ca_add(*high, error);
}

void ca_shape_bounds(const ca_shape *shape, ca_vec3 *low, ca_vec3 *high)
{
    ca_vec3 center = {0}, top = {0}, extent = {0};
    switch (shape->kind) {
    case CA_SHAPE_MESH: mesh_bounds(shape->as.mesh.mesh, low, high); return;
    case CA_SHAPE_SPHERE:
        top = center = shape->as.sphere.center;
        extent = (ca_vec3){shape->as.sphere.radius, shape->as.sphere.radius, shape->as.sphere.radius};
        break;
    case CA_SHAPE_DISK:
        top = center = column(&shape->as.disk.map, 3);
        extent = circle_extent(&shape->as.disk.map);
        break;
    case CA_SHAPE_CYLINDER:
        center = column(&shape->as.cylinder.map, 3);
        top = ca_add(center, column(&shape->as.cylinder.map, 2));
        extent = circle_extent(&shape->as.cylinder.map);
        break;
    case CA_SHAPE_CURVE:
        *low = shape->as.curve.curve->low;
        *high = shape->as.curve.curve->high;
        widen(low, high);
        return;
    case CA_SHAPE_SDF_GRID:
        *low = shape->as.sdf.grid->low;
        *high = shape->as.sdf.grid->high;
        return;
    case CA_SHAPE_KIND_COUNT: break;
    }
    *low = ca_sub(ca_min_vec3(center, top), extent);
    *high = ca_add(ca_max_vec3(center, top), extent);
    widen(low, high);
}
