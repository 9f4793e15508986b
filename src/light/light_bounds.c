#include "light/light_bounds.h"

#include "geometry/triangle.h"
#include "light/light_kinds.h"
#include "math/numeric.h"

/* ---- Of one light ---------------------------------------------------------------------------------------------- */

/* A point that shines all around. */
static ca_light_bounds point_bounds(ca_vec3 position, float intensity)
{
    return (ca_light_bounds){.low = position,
                             .high = position,
                             .axis = {0.0f, 0.0f, 1.0f},
                             .normal_angle = CA_PI,
                             .emission_angle = 0.5f * CA_PI,
                             .intensity = intensity};
}

/* A point that shines into a cone of half angle `angle` around `axis`. Half of that counts as normals: the weight
 * then falls to cos(angle / 2) at the rim. */
static ca_light_bounds cone_bounds(ca_vec3 position, ca_vec3 axis, float angle, float power)
{
    const float solid_angle = 4.0f * CA_PI * ca_sqr(sinf(0.5f * angle));
    return (ca_light_bounds){.low = position,
                             .high = position,
                             .axis = axis,
                             .normal_angle = 0.5f * angle,
                             .emission_angle = 0.5f * angle,
                             .intensity = power / solid_angle};
}

/* The side a triangle shines to: +1 or -1 times its normal by the winding, 0 where corners disagree (the shading
 * normal decides, see triangle.h). */
static float triangle_side(const ca_mesh *mesh, uint32_t triangle, ca_vec3 normal)
{
    if (!mesh->normals) return 1.0f;
    uint32_t against = 0;
    for (uint32_t k = 0; k < 3; k++)
        against += ca_dot(ca_load3(mesh->normals, mesh->indices[3 * (size_t)triangle + k]), normal) < 0.0f;
    return against == 0 ? 1.0f : against == 3 ? -1.0f : 0.0f;
}

static ca_vec3 triangle_normal(const ca_mesh *mesh, uint32_t triangle, float *side)
{
    const ca_triangle t = ca_triangle_load(mesh, triangle);
    const ca_vec3 n = ca_cross(ca_sub(t.p[1], t.p[0]), ca_sub(t.p[2], t.p[0]));
    *side = triangle_side(mesh, triangle, n);
    return ca_mul(n, *side);
}

/* Axis: the mean normal; angle: of the normal farthest from it. Triangles without area do not shine. */
static void mesh_normals(const ca_mesh *mesh, ca_vec3 *axis, float *angle)
{
    float side;
    ca_vec3 sum = {0};
    for (uint32_t i = 0; i < mesh->triangle_count; i++) sum = ca_add(sum, triangle_normal(mesh, i, &side));
    *angle = CA_PI;
    if (!(ca_length(sum) > 0.0f)) return;
    *axis = ca_normalize(sum);
    float least = 1.0f;
    for (uint32_t i = 0; i < mesh->triangle_count; i++) {
        const ca_vec3 n = triangle_normal(mesh, i, &side);
        if (side == 0.0f) return;
        const float length = ca_length(n);
        if (length > 0.0f) least = ca_min(least, ca_dot(n, *axis) / length);
    }
    *angle = acosf(ca_clamp(least, -1.0f, 1.0f));
}

/* Flat ones have power / pi ahead, a sphere a quarter of it all around. */
static ca_light_bounds area_bounds(const ca_light *light)
{
    const ca_shape *shape = light->as.area.shape;
    ca_light_bounds bounds = {.axis = {0.0f, 0.0f, 1.0f}, .normal_angle = CA_PI, .emission_angle = 0.5f * CA_PI};
    ca_shape_bounds(shape, &bounds.low, &bounds.high);
    switch (shape->kind) {
    case CA_SHAPE_MESH: mesh_normals(shape->as.mesh.mesh, &bounds.axis, &bounds.normal_angle); break;
    case CA_SHAPE_DISK: {
        ca_surface surface;
        ca_shape_sample_area(shape, (ca_vec2){0.5f, 0.5f}, &surface);
        bounds.axis = surface.ng;
        bounds.normal_angle = 0.0f;
        break;
    }
    case CA_SHAPE_SPHERE:
    case CA_SHAPE_CYLINDER:
    case CA_SHAPE_CURVE:
    case CA_SHAPE_SDF_GRID:
    case CA_SHAPE_KIND_COUNT: break;
    }
    const float flatness = 0.25f + 0.75f * ca_max(cosf(bounds.normal_angle), 0.0f);
    bounds.intensity = flatness * light->power * CA_INV_PI;
    return bounds;
}

static ca_light_bounds projector_bounds(const ca_light *light)
{
    const float x = light->as.projector.tan_half_x, y = light->as.projector.tan_half_y;
    const ca_vec3 axis = ca_light_to_world(&light->as.projector.map, (ca_vec3){0.0f, 0.0f, 1.0f});
    return cone_bounds(light->as.projector.position, axis, atanf(sqrtf(x * x + y * y)), light->power);
}

bool ca_light_bounds_of(const ca_light *light, ca_light_bounds *bounds)
{
    switch (light->kind) {
    case CA_LIGHT_AREA: *bounds = area_bounds(light); return true;
    case CA_LIGHT_POINT:
        *bounds = point_bounds(light->as.point.position, light->power * CA_INV_FOUR_PI);
        return true;
    case CA_LIGHT_SPOT:
        *bounds = cone_bounds(light->as.spot.position,
                              ca_light_to_world(&light->as.spot.map, (ca_vec3){0.0f, 0.0f, 1.0f}),
                              light->as.spot.cutoff, light->power);
        return true;
    case CA_LIGHT_PROJECTOR: *bounds = projector_bounds(light); return true;
    case CA_LIGHT_BEAM:
    case CA_LIGHT_DIRECTIONAL:
    case CA_LIGHT_CONSTANT:
    case CA_LIGHT_ENVMAP:
    case CA_LIGHT_KIND_COUNT: break;
    }
    return false;
}

/* ---- Of several ------------------------------------------------------------------------------------------------ */

/* Turns `axis` towards `other` by an angle. */
static ca_vec3 turned(ca_vec3 axis, ca_vec3 other, float angle)
{
    const ca_vec3 across = ca_madd(other, -ca_dot(other, axis), axis);
    const float length = ca_length(across);
    if (!(length > 1e-6f)) return axis;
    return ca_normalize(ca_madd(ca_mul(axis, cosf(angle)), sinf(angle) / length, across));
}

static void union_of_normals(const ca_light_bounds *a, const ca_light_bounds *b, ca_light_bounds *both)
{
    const ca_light_bounds *wide = a->normal_angle >= b->normal_angle ? a : b, *narrow = wide == a ? b : a;
    const float between = acosf(ca_clamp(ca_dot(wide->axis, narrow->axis), -1.0f, 1.0f));
    both->axis = wide->axis;
    both->normal_angle = wide->normal_angle;
    if (ca_min(between + narrow->normal_angle, CA_PI) <= wide->normal_angle) return;
    both->normal_angle = 0.5f * (wide->normal_angle + between + narrow->normal_angle);
    /* Opposite axes have no plane to turn in. */
    if (both->normal_angle >= CA_PI || between > 3.14f)
        both->normal_angle = CA_PI;
    else
        both->axis = turned(wide->axis, narrow->axis, both->normal_angle - wide->normal_angle);
}

ca_light_bounds ca_light_bounds_union(const ca_light_bounds *a, const ca_light_bounds *b)
{
    ca_light_bounds both = {.low = ca_min_vec3(a->low, b->low),
                            .high = ca_max_vec3(a->high, b->high),
                            .emission_angle = ca_max(a->emission_angle, b->emission_angle),
                            .intensity = a->intensity + b->intensity};
    union_of_normals(a, b, &both);
    return both;
}

double ca_light_bounds_cost(const ca_light_bounds *bounds)
{
    const ca_vec3 d = ca_sub(bounds->high, bounds->low);
    const double x = (double)d.x, y = (double)d.y, z = (double)d.z;
    /* Lights in a row have no surface, but a length. */
    const double surface = x * y + y * z + z * x + 1e-3 * (x * x + y * y + z * z);
    const double o = (double)bounds->normal_angle, w = fmin(o + (double)bounds->emission_angle, CA_PI_D);
    const double directions = 2.0 * CA_PI_D * (1.0 - cos(o)) +
                              0.5 * CA_PI_D * (2.0 * w * sin(o) - cos(o - 2.0 * w) - 2.0 * o * sin(o) + cos(o));
    return (double)bounds->intensity * surface * directions;
}
