/* How far a scene reaches, and whether rays do. */
#include "scene/compile.h"

#include "geometry/ray_reach.h"
#include "math/numeric.h"

/* ---- Bounds ---------------------------------------------------------------------------------------------------- */

static void grow(ca_scene *scene, ca_vec3 p)
{
    scene->low = ca_min_vec3(scene->low, p);
    scene->high = ca_max_vec3(scene->high, p);
}

static void group_bounds(const ca_scene *scene, const ca_accel_instance *instance, ca_vec3 *low, ca_vec3 *high)
{
    *low = (ca_vec3){INFINITY, INFINITY, INFINITY};
    *high = ca_neg(*low);
    for (uint32_t i = 0; i < instance->shape_count; i++) {
        ca_vec3 shape_low, shape_high;
        ca_shape_bounds(&scene->shapes[instance->first_shape + i], &shape_low, &shape_high);
        *low = ca_min_vec3(*low, shape_low);
        *high = ca_max_vec3(*high, shape_high);
    }
}

void ca_scene_compute_bounds(ca_scene *scene, uint32_t world_count)
{
    scene->low = (ca_vec3){INFINITY, INFINITY, INFINITY};
    scene->high = ca_neg(scene->low);
    for (uint32_t i = 0; i < world_count; i++) {
        ca_vec3 low, high;
        ca_shape_bounds(&scene->shapes[i], &low, &high);
        grow(scene, low);
        grow(scene, high);
    }
    for (uint32_t i = 0; i < scene->instance_count; i++) {
        const ca_accel_instance *instance = &scene->instances[i];
        if (instance->shape_count == 0) continue;
        ca_vec3 low, high;
        group_bounds(scene, instance, &low, &high);
        for (int corner = 0; corner < 8; corner++) {
            const ca_vec3 p = {corner & 1 ? high.x : low.x, corner & 2 ? high.y : low.y, corner & 4 ? high.z : low.z};
            grow(scene, ca_map_point(instance->map.to, p));
        }
    }
    if (!(scene->low.x <= scene->high.x)) scene->low = scene->high = (ca_vec3){0}; /* no shapes at all */
    scene->center = ca_mul(ca_add(scene->low, scene->high), 0.5f);
    const float radius = 0.5f * ca_length(ca_sub(scene->high, scene->low));
    scene->radius = radius > 0.0f ? radius * (1.0f + CA_GAMMA(64)) : 1.0f;
}

/* ---- Reach ----------------------------------------------------------------------------------------------------- */

static float farthest(ca_vec3 p, ca_vec3 other) { return ca_length(ca_max_vec3(ca_abs3(p), ca_abs3(other))); }

/* Rays begin in the lens (realistic.h), or where they are produced to its planes. */
static float realistic_extent(const ca_realistic *camera)
{
    double aperture = camera->film_diagonal;
    for (uint32_t i = 0; i < camera->lens.count; i++) aperture = fmax(aperture, camera->lens.surfaces[i].aperture);
    return (float)(camera->scale * (ca_lens_length(&camera->lens) + camera->film_distance + 2.0 * aperture));
}

/* How far from the origin its rays may begin. */
static float extent_of_camera(const ca_camera *camera)
{
    const float (*m)[4] = camera->map.to;
    float extent = 0.0f;
    for (int c = 0; c < 4; c++) extent += ca_length((ca_vec3){m[0][c], m[1][c], m[2][c]});
    if (camera->kind == CA_CAMERA_THIN_LENS) extent += camera->as.thin_lens.lens_radius;
    if (camera->kind == CA_CAMERA_REALISTIC) extent += realistic_extent(&camera->as.realistic);
    return extent;
}

/* From the origin; 0: the light is nowhere in particular, or on shapes. */
static double distance_of(const ca_light_desc *light)
{
    const double *p = light->as.point.position;
    const ca_matrix *m = light->kind == CA_LIGHT_SPOT        ? &light->as.spot.to_world
                         : light->kind == CA_LIGHT_PROJECTOR ? &light->as.projector.to_world
                                                             : NULL;
    if (light->kind == CA_LIGHT_POINT) return hypot(hypot(p[0], p[1]), p[2]);
    return m ? hypot(hypot(m->m[0][3], m->m[1][3]), m->m[2][3]) : 0.0;
}

/* No ray begins farther away: shapes and what lies around them (rays from lights at infinity begin there), the
 * camera, lights at a point. */
static float extent_of(const ca_scene *scene)
{
    const ca_camera *camera = &scene->desc.camera.camera;
    const ca_camera *cameras = camera->kind == CA_CAMERA_PANELS ? camera->as.panels.cameras : camera;
    float extent = farthest(scene->low, scene->high) + 4.0f * scene->radius;
    for (uint32_t i = 0; i < ca_camera_count(camera); i++) extent = ca_max(extent, extent_of_camera(&cameras[i]));
    for (size_t i = 0; i < scene->desc.lights.count; i++)
        extent = ca_max(extent, (float)distance_of(&scene->desc.lights.items[i]));
    return extent;
}

/* Is what rays may be (ray_reach.h) enough for this scene? The next event goes from one end of it to the other. */
static bool reaches(const ca_ray_reach *reach, float extent)
{
    return 2.0f * extent < reach->origin && 4.0f * extent < reach->direction;
}

ca_status ca_scene_check_reach(const ca_scene *scene, ca_error *error)
{
    const ca_ray_reach alone = CA_RAY_REACH;
    for (size_t i = 0; i < scene->desc.lights.count; i++) {
        const double distance = distance_of(&scene->desc.lights.items[i]);
        if (!reaches(&alone, (float)fmin(distance, (double)FLT_MAX)))
            return ca_fail(error, CA_ERROR_SCENE, &scene->desc.lights.items[i].where,
                           "this light is %.3g from the origin; rays can be traced up to 2.5e17", distance);
    }
    const float extent = extent_of(scene);
    if (!reaches(&alone, extent))
        return ca_fail(error, CA_ERROR_SCENE, NULL,
                       "%s: the scene reaches %.3g from the origin; rays can be traced up to 2.5e17",
                       scene->desc.path ? scene->desc.path : "scene", (double)extent);
    for (size_t i = 0; i < scene->desc.instances.count; i++) {
        const ca_instance_desc *desc = &scene->desc.instances.items[i];
        ca_ray_reach reach = CA_RAY_REACH;
        ca_affine map;
        if (!ca_affine_from_matrix(&desc->to_world, &map) || !ca_ray_reach_limit(&reach, &map))
            return ca_fail(error, CA_ERROR_SCENE, &desc->where,
                           "this instance's to_world is too close to a singular one, or too small or too large, for "
                           "single precision");
        if (!reaches(&reach, extent))
            return ca_fail(error, CA_ERROR_SCENE, &desc->where,
                           "this instance is scaled down too far for a scene that reaches %.3g from the origin",
                           (double)extent);
    }
    return CA_OK;
}
