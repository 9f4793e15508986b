/* Compiling a description: shapes in world space, materials and lights prepared, the acceleration structure built. */
#include "scene/scene.h"

#include "base/hash.h"
#include "base/loading.h"
#include "base/memory.h"
#include "base/processors.h"
#include "geometry/curve.h"
#include "geometry/sdf_grid.h"
#include "geometry/ray_reach.h"
#include "math/numeric.h"

#include <stdlib.h>
#include <string.h>

/* ---- Shapes ---------------------------------------------------------------------------------------------------- */

static double column_length(const ca_matrix *m, int column)
{
    return sqrt(m->m[0][column] * m->m[0][column] + m->m[1][column] * m->m[1][column] +
                m->m[2][column] * m->m[2][column]);
}

/* Largest deviation of M^T M from a multiple of the identity over the columns [0, 3), relative. */
static bool is_similarity(const ca_matrix *m)
{
    const double scale = column_length(m, 0);
    for (int a = 0; a < 3; a++)
        for (int b = 0; b < 3; b++) {
            double dot = 0.0;
            for (int row = 0; row < 3; row++) dot += m->m[row][a] * m->m[row][b];
            if (!(fabs(dot - (a == b ? scale * scale : 0.0)) <= 1e-4 * scale * scale)) return false;
        }
    return true;
}

static ca_status fail_map(const ca_shape_desc *desc, const char *kind, ca_error *error)
{
    return ca_fail(error, CA_ERROR_SCENE, &desc->where,
                   "a %s can be moved, rotated and scaled uniformly, but its to_world does more", kind);
}

static ca_status set_map(ca_affine *map, const ca_shape_desc *desc, const ca_matrix *to_world, ca_error *error)
{
    if (ca_affine_from_matrix(to_world, map)) return CA_OK;
    return ca_fail(error, CA_ERROR_SCENE, &desc->where,
                   "this shape's to_world is singular, not affine or not finite");
}

static ca_status compile_sphere(ca_shape *shape, const ca_shape_desc *desc, ca_error *error)
{
    if (!is_similarity(&desc->to_world)) return fail_map(desc, "sphere", error);
    const double radius = (double)desc->as.sphere.radius;
    const double *center = desc->as.sphere.center;
    const ca_matrix move = ca_matrix_translate(center[0], center[1], center[2]);
    const ca_matrix scale = ca_matrix_scale(radius, radius, radius);
    const ca_matrix placed = ca_matrix_multiply(&desc->to_world, &move);
    const ca_matrix map = ca_matrix_multiply(&placed, &scale);
    CA_TRY(set_map(&shape->as.sphere.map, desc, &map, error));
    shape->as.sphere.center = (ca_vec3){(float)map.m[0][3], (float)map.m[1][3], (float)map.m[2][3]};
    shape->as.sphere.radius = (float)column_length(&map, 0);
    shape->area = 4.0f * CA_PI * shape->as.sphere.radius * shape->as.sphere.radius;
    return CA_OK;
}

static ca_status compile_cylinder(ca_shape *shape, const ca_shape_desc *desc, ca_error *error)
{
    const double *p0 = desc->as.cylinder.p0, *p1 = desc->as.cylinder.p1;
    const ca_matrix frame = ca_cylinder_frame(p0, p1, (double)desc->as.cylinder.radius);
    const ca_matrix map = ca_matrix_multiply(&desc->to_world, &frame);
    if (p0[0] == p1[0] && p0[1] == p1[1] && p0[2] == p1[2])
        return ca_fail(error, CA_ERROR_SCENE, &desc->where, "this cylinder's ends p0 and p1 are the same point");
    if (!ca_is_round_cylinder(&map))
        return ca_fail(error, CA_ERROR_SCENE, &desc->where, "a cylinder's to_world must leave its ends circles");
    CA_TRY(set_map(&shape->as.cylinder.map, desc, &map, error));
    shape->as.cylinder.radius = (float)column_length(&map, 0);
    shape->as.cylinder.length = (float)column_length(&map, 2);
    shape->area = CA_TWO_PI * shape->as.cylinder.radius * shape->as.cylinder.length;
    return CA_OK;
}

static ca_status compile_disk(ca_shape *shape, const ca_shape_desc *desc, ca_error *error)
{
    const ca_affine *map = &shape->as.disk.map;
    CA_TRY(set_map(&shape->as.disk.map, desc, &desc->to_world, error));
    const ca_vec3 s_axis = ca_map_vector(map->to, (ca_vec3){1, 0, 0});
    const ca_vec3 t_axis = ca_map_vector(map->to, (ca_vec3){0, 1, 0});
    shape->area = CA_PI * ca_length(ca_cross(s_axis, t_axis));
    /* The outside follows +z, and not the turning sense of x and y, which a mirror reverses. */
    if (ca_matrix_determinant3(&desc->to_world) < 0.0) shape->flip_normals = !shape->flip_normals;
    return CA_OK;
}

/* The CDF over triangles that area lights are sampled by: to the nearest step, as a step for each of a million tiny
 * ones would take light from the large ones. */
static ca_status triangle_distribution(ca_shape *shape, ca_error *error)
{
    const ca_mesh *mesh = shape->as.mesh.mesh;
    float *areas = ca_alloc(mesh->triangle_count, sizeof *areas);
    if (!areas) return ca_fail_memory(error, "an area light");
    for (uint32_t i = 0; i < mesh->triangle_count; i++) areas[i] = (float)ca_mesh_triangle_area(mesh, i);
    const ca_status status =
        ca_distribution_1d_create_nearest(&shape->as.mesh.triangles, areas, mesh->triangle_count, error);
    ca_free(areas);
    return status;
}

/* Moves a mesh to its place, once and for all versions of the scene that share it. */
static ca_status place_mesh(ca_mesh *mesh, const ca_shape_desc *desc, ca_error *error)
{
    ca_affine map;
    CA_TRY(set_map(&map, desc, &desc->to_world, error));
    ca_mesh_transform(mesh, &map);
    if (desc->flip_normals) ca_mesh_flip_normals(mesh);
    ca_loading_tell(0.3); /* thirds of the time, about */
    CA_TRY(ca_loading_check(error));
    CA_TRY(ca_mesh_validate(mesh, desc->where.file, error));
    if (ca_mesh_normals_are_flat(mesh)) ca_mesh_drop_normals(mesh); /* those of the faces serve as well */
    ca_loading_tell(0.7);
    CA_TRY(ca_loading_check(error));
    ca_mesh_measure(mesh);
    CA_TRY(ca_loading_check(error));
    mesh->placed = true; /* the bounds are read from now on */
    return CA_OK;
}

static ca_status compile_mesh(ca_shape *shape, const ca_shape_desc *desc, ca_mesh *mesh, ca_error *error)
{
    if (!mesh->placed) CA_TRY(place_mesh(mesh, desc, error));
    shape->as.mesh.mesh = mesh;
    const ca_vec3 farthest_corner = ca_max_vec3(ca_abs3(mesh->low), ca_abs3(mesh->high));
    shape->as.mesh.extent = ca_max(farthest_corner.x, ca_max(farthest_corner.y, farthest_corner.z));
    shape->area = (float)mesh->area;
    if (desc->light == CA_NONE) return CA_OK;
    shape->as.mesh.rectangle = ca_rectangle_from_mesh(mesh);
    return triangle_distribution(shape, error);
}

static ca_status compile_curve(ca_shape *shape, const ca_shape_desc *desc, ca_curve *curve, ca_error *error)
{
    ca_affine map;
    if (desc->light != CA_NONE) return ca_fail(error, CA_ERROR_SCENE, &desc->where, "curves cannot emit light");
    CA_TRY(set_map(&map, desc, &desc->to_world, error));
    if (!curve->placed && !ca_curve_place(curve, &map))
        return ca_fail(error, CA_ERROR_SCENE, &desc->where, "a point of these curves is too far away");
    shape->as.curve.curve = curve;
    return CA_OK;
}

static ca_status compile_sdf_grid(ca_shape *shape, const ca_shape_desc *desc, ca_sdf_grid *grid, ca_error *error)
{
    ca_affine map;
    if (desc->light != CA_NONE)
        return ca_fail(error, CA_ERROR_SCENE, &desc->where, "a grid of distances cannot emit light");
    CA_TRY(set_map(&map, desc, &desc->to_world, error));
    if (!grid->placed && !ca_sdf_grid_place(grid, &desc->to_world))
        return ca_fail(error, CA_ERROR_SCENE, &desc->where, "this grid of distances is too far away");
    shape->as.sdf.grid = grid;
    return CA_OK;
}

/* Do layers show coordinates and tangents of surfaces? */
static bool shows_tangents(const ca_scene_desc *desc)
{
    for (size_t i = 0; i < desc->integrator.aovs.count; i++) {
        const ca_aov_kind kind = desc->integrator.aovs.items[i].kind;
        if (kind == CA_AOV_UV || kind == CA_AOV_DP_DU || kind == CA_AOV_DP_DV) return true;
    }
    return false;
}

static ca_status compile_shape(ca_scene *scene, ca_shape *shape, const ca_shape_desc *desc, ca_error *error)
{
    *shape = (ca_shape){.kind = desc->kind, .light = desc->light, .material = desc->material};
    if (desc->group != CA_NONE && desc->light != CA_NONE)
        return ca_fail(error, CA_ERROR_SCENE, &desc->where, "a shape inside a shapegroup cannot emit light");
    shape->needs_tangents =
        ca_material_needs_tangents(scene->materials, shape->material) || shows_tangents(&scene->desc);
    /* A map that mirrors turns a sphere inside out, as in Mitsuba 3; a cylinder stays as it is. */
    const bool turns = desc->kind == CA_SHAPE_SPHERE && ca_matrix_determinant3(&desc->to_world) < 0.0;
    shape->flip_normals = desc->kind != CA_SHAPE_MESH && desc->flip_normals != turns;
    ca_status status = CA_OK;
    switch (desc->kind) {
    case CA_SHAPE_MESH:
        status = compile_mesh(shape, desc, &scene->desc.meshes.items[desc->as.mesh.index], error);
        break;
    case CA_SHAPE_SPHERE: status = compile_sphere(shape, desc, error); break;
    case CA_SHAPE_DISK: status = compile_disk(shape, desc, error); break;
    case CA_SHAPE_CYLINDER: status = compile_cylinder(shape, desc, error); break;
    case CA_SHAPE_CURVE:
        status = compile_curve(shape, desc, scene->desc.curves.items[desc->as.curve.index], error);
        break;
    case CA_SHAPE_SDF_GRID:
        status = compile_sdf_grid(shape, desc, scene->desc.grids.items[desc->as.sdf.index], error);
        break;
    case CA_SHAPE_KIND_COUNT: break;
    }
    if (status == CA_OK && desc->light != CA_NONE && !(shape->area > 0.0f))
        return ca_fail(error, CA_ERROR_SCENE, &desc->where, "a shape without area cannot emit light");
    return status;
}

/* Shapes of the world come first, then those of each group together; `group_first` tells where each group starts and,
 * in one entry more, where the last one ends. */
static ca_status compile_shapes(ca_scene *scene, uint32_t *group_first, uint32_t *world_count, ca_error *error)
{
    const ca_scene_desc *desc = &scene->desc;
    const uint32_t count = (uint32_t)desc->shapes.count, groups = (uint32_t)desc->groups.count;
    scene->shapes = ca_alloc_zeroed(count, sizeof *scene->shapes);
    if (!scene->shapes) return ca_fail_memory(error, "shapes");
    uint32_t next = 0;
    for (uint32_t pass = 0; pass <= groups; pass++) {
        const uint32_t group = pass == 0 ? CA_NONE : pass - 1;
        if (pass > 0) group_first[group] = next;
        for (uint32_t i = 0; i < count; i++) {
            if (desc->shapes.items[i].group != group) continue;
            ca_loading_step("placing", next, count);
            CA_TRY(ca_loading_check(error));
            scene->shape_count = next + 1; /* so that a failure releases this one */
            CA_TRY(compile_shape(scene, &scene->shapes[next], &desc->shapes.items[i], error));
            next++;
        }
        if (pass == 0) *world_count = next;
    }
    group_first[groups] = next;
    return CA_OK;
}

/* Only textures ask for uv, and on a quadric it costs two angles. */
static void skip_uv(ca_scene *scene)
{
    for (size_t i = 0; i < scene->desc.textures.count; i++)
        if (ca_texture_reads_uv(&scene->desc.textures.items[i])) return;
    for (uint32_t i = 0; i < scene->shape_count; i++)
        scene->shapes[i].skips_uv = scene->shapes[i].kind != CA_SHAPE_MESH && !scene->shapes[i].needs_tangents;
}

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

static void compute_bounds(ca_scene *scene, uint32_t world_count)
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

static ca_status check_reach(const ca_scene *scene, ca_error *error)
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

/* ---- Materials, textures, lights, camera ----------------------------------------------------------------------- */

static void link_textures(ca_scene *scene)
{
    for (size_t i = 0; i < scene->desc.textures.count; i++) {
        ca_texture *texture = &scene->desc.textures.items[i];
        if (texture->kind == CA_TEXTURE_BITMAP)
            texture->as.bitmap.image = &scene->desc.images.items[texture->as.bitmap.image_index];
    }
}

/* Gives a diffuse material of that grey to the shapes without any, those that shine or those that do not. */
static ca_status add_default_material(ca_scene_desc *desc, bool shining, float grey, ca_error *error)
{
    bool needed = false;
    for (size_t i = 0; i < desc->shapes.count; i++)
        needed |= desc->shapes.items[i].material == CA_NONE && (desc->shapes.items[i].light != CA_NONE) == shining;
    if (!needed) return CA_OK;
    const ca_texture_id constant = ca_scene_desc_add_constant(desc, ca_rgb_grey(grey));
    if (constant == CA_NONE || !CA_TABLE_ADD(&desc->materials)) return ca_fail_memory(error, "materials");
    const uint32_t id = (uint32_t)desc->materials.count - 1;
    desc->materials.items[id].material = (ca_material){.kind = CA_MATERIAL_DIFFUSE, .as.diffuse = {constant}};
    for (size_t i = 0; i < desc->shapes.count; i++) {
        ca_shape_desc *shape = &desc->shapes.items[i];
        if (shape->material == CA_NONE && (shape->light != CA_NONE) == shining) shape->material = id;
    }
    return CA_OK;
}

/* Mitsuba's defaults. */
static ca_status add_default_materials(ca_scene_desc *desc, ca_error *error)
{
    CA_TRY(add_default_material(desc, false, 0.5f, error));
    return add_default_material(desc, true, 0.0f, error);
}

static ca_status compile_materials(ca_scene *scene, ca_error *error)
{
    CA_TRY(add_default_materials(&scene->desc, error));
    const uint32_t count = (uint32_t)scene->desc.materials.count;
    scene->materials = ca_alloc_zeroed(count, sizeof *scene->materials);
    if (!scene->materials) return ca_fail_memory(error, "materials");
    for (uint32_t i = 0; i < count; i++) scene->materials[i] = scene->desc.materials.items[i].material;
    for (uint32_t i = 0; i < count; i++) {
        scene->material_count = i + 1;
        CA_TRY(ca_material_prepare(&scene->materials[i], scene->desc.textures.items, error));
        if (ca_material_leaf_count(scene->materials, i) > CA_BSDF_MAX_LOBES)
            return ca_fail(error, CA_ERROR_SCENE, &scene->desc.materials.items[i].where,
                           "this material is a tree of more than %d leaves, too deep, or holds itself",
                           CA_BSDF_MAX_LOBES);
    }
    return CA_OK;
}

static ca_status light_map(ca_affine *map, const ca_matrix *to_world, const ca_light_desc *desc, ca_error *error)
{
    if (ca_affine_from_matrix(to_world, map)) return CA_OK;
    return ca_fail(error, CA_ERROR_SCENE, &desc->where, "this emitter's to_world is singular or not affine");
}

static ca_vec3 origin_of(const ca_affine *map) { return (ca_vec3){map->to[0][3], map->to[1][3], map->to[2][3]}; }

static ca_vec3 vec3_from_doubles(const double v[3]) { return (ca_vec3){(float)v[0], (float)v[1], (float)v[2]}; }

static ca_status compile_spot(ca_light *light, const ca_light_desc *desc, ca_error *error)
{
    CA_TRY(light_map(&light->as.spot.map, &desc->as.spot.to_world, desc, error));
    light->as.spot.position = origin_of(&light->as.spot.map);
    light->as.spot.intensity = desc->as.spot.intensity;
    light->as.spot.texture = desc->as.spot.texture;
    light->as.spot.falloff = desc->as.spot.falloff;
    light->as.spot.cutoff = (float)(desc->as.spot.cutoff_degrees * (CA_PI_D / 180.0));
    light->as.spot.beam = (float)(desc->as.spot.beam_degrees * (CA_PI_D / 180.0));
    return CA_OK;
}

static ca_status compile_directional(ca_light *light, const ca_light_desc *desc, ca_error *error)
{
    const ca_vec3 direction = vec3_from_doubles(desc->as.directional.direction);
    const float length = ca_length(direction);
    if (!(length > 0.0f) || !isfinite(length))
        return ca_fail(error, CA_ERROR_SCENE, &desc->where, "this directional light has no direction");
    light->as.directional.direction = ca_mul(direction, 1.0f / length);
    light->as.directional.irradiance = desc->as.directional.irradiance;
    return CA_OK;
}

static ca_status compile_projector(ca_light *light, const ca_light_desc *desc, ca_error *error)
{
    CA_TRY(light_map(&light->as.projector.map, &desc->as.projector.to_world, desc, error));
    light->as.projector.position = origin_of(&light->as.projector.map);
    light->as.projector.picture = desc->as.projector.picture;
    light->as.projector.scale = desc->as.projector.scale;
    light->as.projector.tan_half_x = (float)desc->as.projector.tan_half_x;
    light->as.projector.tan_half_y = (float)desc->as.projector.tan_half_y;
    return CA_OK;
}

static ca_status light_from_desc(ca_scene *scene, ca_light *light, const ca_light_desc *desc, ca_error *error)
{
    *light = (ca_light){.kind = desc->kind, .textures = scene->desc.textures.items};
    switch (desc->kind) {
    case CA_LIGHT_AREA: light->as.area.radiance = desc->as.area.radiance; break;
    case CA_LIGHT_BEAM: light->as.beam.exitance = desc->as.beam.exitance; break;
    case CA_LIGHT_POINT:
        light->as.point.position = vec3_from_doubles(desc->as.point.position);
        light->as.point.intensity = desc->as.point.intensity;
        break;
    case CA_LIGHT_SPOT: return compile_spot(light, desc, error);
    case CA_LIGHT_DIRECTIONAL: return compile_directional(light, desc, error);
    case CA_LIGHT_PROJECTOR: return compile_projector(light, desc, error);
    case CA_LIGHT_CONSTANT: light->as.constant.radiance = desc->as.constant.radiance; break;
    case CA_LIGHT_ENVMAP:
        light->as.envmap.image = &scene->desc.images.items[desc->as.envmap.image];
        light->as.envmap.scale = desc->as.envmap.scale;
        return light_map(&light->as.envmap.map, &desc->as.envmap.to_world, desc, error);
    case CA_LIGHT_KIND_COUNT: break;
    }
    return CA_OK;
}

static void link_area_lights(ca_scene *scene)
{
    for (uint32_t i = 0; i < scene->shape_count; i++) {
        const uint32_t light = scene->shapes[i].light;
        if (light == CA_NONE) continue;
        ca_light *l = &scene->lights[light];
        *(l->kind == CA_LIGHT_BEAM ? &l->as.beam.shape : &l->as.area.shape) = &scene->shapes[i];
    }
}

static ca_status note_environment(ca_scene *scene, uint32_t light, ca_error *error)
{
    const ca_light_kind kind = scene->lights[light].kind;
    if (kind != CA_LIGHT_CONSTANT && kind != CA_LIGHT_ENVMAP) return CA_OK;
    if (scene->environment != CA_NONE)
        return ca_fail(error, CA_ERROR_SCENE, &scene->desc.lights.items[light].where,
                       "a scene can have one environment (constant or envmap), and this is a second");
    scene->environment = light;
    return CA_OK;
}

static ca_status compile_lights(ca_scene *scene, ca_error *error)
{
    const uint32_t count = (uint32_t)scene->desc.lights.count;
    scene->lights = ca_alloc_zeroed(count, sizeof *scene->lights);
    if (!scene->lights) return ca_fail_memory(error, "lights");
    for (uint32_t i = 0; i < count; i++)
        CA_TRY(light_from_desc(scene, &scene->lights[i], &scene->desc.lights.items[i], error));
    link_area_lights(scene);
    for (uint32_t i = 0; i < count; i++) {
        CA_TRY(note_environment(scene, i, error));
        scene->light_count = i + 1;
        CA_TRY(ca_light_prepare(&scene->lights[i], scene->center, scene->radius, error));
        if (!isfinite(scene->lights[i].power))
            return ca_fail(error, CA_ERROR_SCENE, &scene->desc.lights.items[i].where,
                           "the power of this light is not a finite number");
    }
    return ca_light_choice_create(&scene->light_choice, scene->lights, count, error);
}

static ca_status compile_instances(ca_scene *scene, const uint32_t *group_first, ca_error *error)
{
    const uint32_t count = (uint32_t)scene->desc.instances.count;
    scene->instances = ca_alloc_zeroed(count, sizeof *scene->instances);
    scene->instance_ids = ca_alloc_zeroed(count, sizeof *scene->instance_ids);
    if (!scene->instances || !scene->instance_ids) return ca_fail_memory(error, "instances");
    for (uint32_t i = 0; i < count; i++) {
        const ca_instance_desc *desc = &scene->desc.instances.items[i];
        const uint32_t first = group_first[desc->group], end = group_first[desc->group + 1];
        if (first == end) continue; /* an empty group */
        ca_accel_instance *instance = &scene->instances[scene->instance_count];
        *instance = (ca_accel_instance){.first_shape = first, .shape_count = end - first};
        if (!ca_affine_from_matrix(&desc->to_world, &instance->map))
            return ca_fail(error, CA_ERROR_SCENE, &desc->where, "this instance's to_world is singular or not affine");
        scene->instance_ids[scene->instance_count++] = desc->id;
    }
    return CA_OK;
}

static ca_status find_regular(ca_scene *scene, uint32_t world_count, ca_error *error)
{
    const ca_texture *textures = scene->desc.textures.items;
    scene->mattes =
        ca_matte_shapes_create(scene->shapes, scene->shape_count, world_count, scene->materials, textures);
    scene->even_lights = ca_even_lights_create(scene->lights, scene->light_count, textures);
    return scene->mattes && scene->even_lights ? CA_OK : ca_fail_memory(error, "the scene");
}

static ca_status compile(ca_scene *scene, const ca_scene *previous, uint32_t *group_first, const int *stop,
                         ca_error *error)
{
    uint32_t world_count = 0;
    scene->environment = CA_NONE;
    link_textures(scene);
    CA_TRY(compile_materials(scene, error));
    CA_TRY(compile_shapes(scene, group_first, &world_count, error));
    skip_uv(scene);
    CA_TRY(compile_instances(scene, group_first, error));
    compute_bounds(scene, world_count);
    CA_TRY(check_reach(scene, error));
    CA_TRY(compile_lights(scene, error));
    CA_TRY(find_regular(scene, world_count, error));
    return ca_accel_create_after(previous ? previous->accel : NULL, scene->shapes, scene->shape_count, world_count,
                                 scene->instances, scene->instance_count, ca_processors(), stop, &scene->accel,
                                 error);
}

ca_camera ca_scene_camera(const ca_scene *scene, uint32_t width, uint32_t height)
{
    const ca_camera_desc *desc = &scene->desc.camera;
    ca_camera camera = desc->camera;
    camera.width = width;
    camera.height = height;
    if (desc->place == CA_PLACE_OUTSIDE) ca_camera_move_out(&camera, scene->center, scene->radius);
    if (desc->place == CA_PLACE_ALL) ca_camera_cover(&camera, scene->center, scene->radius);
    if (ca_camera_has_field_of_view(&camera))
        ca_camera_set_tan_half_x(&camera,
                                 (float)ca_camera_tan_half_x(desc->fov_degrees, desc->fov_axis, width, height));
    ca_camera_prepare(&camera);
    return camera;
}

ca_status ca_scene_compile(ca_scene_desc *desc, ca_scene **scene, ca_error *error)
{
    return ca_scene_compile_after(desc, NULL, NULL, scene, error);
}

ca_status ca_scene_compile_after(ca_scene_desc *desc, const ca_scene *previous, const int *stop, ca_scene **scene,
                                 ca_error *error)
{
    *scene = NULL;
    ca_scene *compiled = ca_alloc_zeroed(1, sizeof *compiled);
    uint32_t *group_first = ca_alloc_zeroed(desc->groups.count + 1, sizeof *group_first);
    if (!compiled || !group_first) {
        ca_free(compiled);
        ca_free(group_first);
        ca_scene_desc_destroy(desc);
        return ca_fail_memory(error, "the scene");
    }
    atomic_init(&compiled->references, 1);
    compiled->desc = *desc;
    memset(desc, 0, sizeof *desc);
    const ca_status status = compile(compiled, previous, group_first, stop, error);
    ca_free(group_first);
    if (status != CA_OK) {
        ca_scene_destroy(compiled);
        return status;
    }
    *scene = compiled;
    return CA_OK;
}

/* ---- Views ----------------------------------------------------------------------------------------------------- */

/* The first thing in a description that a view cannot have of its own; NULL: there is none. */
static const ca_location *find_more(const ca_scene_desc *desc)
{
    if (desc->shapes.count > 0) return &desc->shapes.items[0].where;
    if (desc->lights.count > 0) return &desc->lights.items[0].where;
    if (desc->materials.count > 0) return &desc->materials.items[0].where;
    if (desc->groups.count > 0) return &desc->groups.items[0].where;
    return desc->instances.count > 0 ? &desc->instances.items[0].where : NULL;
}

/* The tables of `whole`, with what a view may say. */
static ca_scene_desc seen_with(const ca_scene_desc *whole, const ca_scene_desc *own)
{
    ca_scene_desc desc = *whole;
    desc.strings = own->strings;
    desc.path = own->path;
    desc.notes = own->notes;
    desc.content_hash = ca_hash_add(whole->content_hash, own->content_hash);
    desc.camera = own->camera;
    desc.film = own->film;
    desc.sampler = own->sampler;
    desc.names_sampler = own->names_sampler;
    desc.samples_per_pixel = own->samples_per_pixel;
    if (own->integrator.name) desc.integrator = own->integrator;
    return desc;
}

ca_status ca_scene_view_create(ca_scene *scene, ca_scene_desc *desc, ca_scene **view, ca_error *error)
{
    const ca_location *more = find_more(desc);
    ca_scene *created = more ? NULL : ca_alloc_zeroed(1, sizeof *created);
    if (!created) {
        const ca_status status = more ? ca_fail(error, CA_ERROR_SCENE, more,
                                                "a view of a scene has a sensor and an integrator, and nothing else")
                                      : ca_fail_memory(error, "the view");
        ca_scene_desc_destroy(desc);
        return status;
    }
    memcpy(created, scene, sizeof *created);
    atomic_init(&created->references, 1);
    created->base = scene;
    created->desc = seen_with(&scene->desc, desc);
    created->own = *desc;
    *desc = (ca_scene_desc){0};
    atomic_fetch_add(&scene->references, 1);
    const ca_status status = check_reach(created, error);
    if (status == CA_OK)
        *view = created;
    else
        ca_scene_destroy(created);
    return status;
}

/* ---- The end --------------------------------------------------------------------------------------------------- */

static void destroy_whole(ca_scene *scene)
{
    ca_accel_destroy(scene->accel);
    ca_light_choice_destroy(&scene->light_choice);
    for (uint32_t i = 0; i < scene->light_count; i++) ca_light_release(&scene->lights[i]);
    for (uint32_t i = 0; i < scene->shape_count; i++)
        if (scene->shapes[i].kind == CA_SHAPE_MESH) ca_distribution_1d_destroy(&scene->shapes[i].as.mesh.triangles);
    for (uint32_t i = 0; i < scene->material_count; i++) ca_material_release(&scene->materials[i]);
    ca_free(scene->mattes);
    ca_free(scene->even_lights);
    ca_free(scene->lights);
    ca_free(scene->shapes);
    ca_free(scene->materials);
    ca_free(scene->instances);
    ca_free(scene->instance_ids);
    ca_scene_desc_destroy(&scene->desc);
    ca_free(scene);
}

void ca_scene_destroy(ca_scene *scene)
{
    while (scene && atomic_fetch_sub(&scene->references, 1) == 1) {
        ca_scene *base = scene->base;
        if (!base) {
            destroy_whole(scene);
            return;
        }
        ca_scene_desc_destroy(&scene->own);
        ca_free(scene);
        scene = base;
    }
}
