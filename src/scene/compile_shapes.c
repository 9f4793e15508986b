/* Shapes, from the description's to those that rays meet: in world space, with areas and what lights sample. */
#include "scene/compile.h"

#include "base/loading.h"
#include "base/memory.h"
#include "geometry/curve.h"
#include "geometry/sdf_grid.h"
#include "math/numeric.h"

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

ca_status ca_scene_compile_shapes(ca_scene *scene, uint32_t *group_first, uint32_t *world_count, ca_error *error)
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

void ca_scene_skip_uv(ca_scene *scene)
{
    for (size_t i = 0; i < scene->desc.textures.count; i++)
        if (ca_texture_reads_uv(&scene->desc.textures.items[i])) return;
    for (uint32_t i = 0; i < scene->shape_count; i++)
        scene->shapes[i].skips_uv = scene->shapes[i].kind != CA_SHAPE_MESH && !scene->shapes[i].needs_tangents;
}
