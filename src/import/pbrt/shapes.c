/* Shapes. What the scene language has no exact shape for becomes a mesh: parts of quadrics, and disks with a picture
 * on them, whose coordinates are pbrt's. */
#include "import/pbrt/reader.h"

#include "base/text.h"
#include "import/reuse.h"

#include <string.h>

static const double pi = 3.14159265358979323846;

/* ---- What all shapes have -------------------------------------------------------------------------------------- */

/* The scene's default, made once. */
static const char *default_material(ca_pbrt *p)
{
    static const double half[3] = {0.5, 0.5, 0.5};
    static const char id[] = "material";
    if (p->has_default_material) return id;
    p->has_default_material = true;
    ca_xml_node *sides = ca_tree_named_object(&p->tree, ca_tree_root(&p->tree), "bsdf", "twosided", NULL, id);
    ca_tree_rgb(&p->tree, ca_tree_object(&p->tree, sides, "bsdf", "diffuse"), "reflectance", half);
    return id;
}

/* alpha, a number or texture: what of the surface is there. */
static void put_material(ca_pbrt *p, ca_xml_node *shape)
{
    static const char *const without_effect[] = {"shadowalpha"};
    const char *id = p->state.material ? p->state.material : default_material(p);
    const ca_pbrt_value alpha = ca_pbrt_number_value(p, "alpha", 1.0);
    ca_pbrt_ignore(&p->params, without_effect, CA_COUNT(without_effect));
    if (ca_pbrt_is(&alpha, 1.0)) {
        ca_tree_ref(&p->tree, shape, NULL, id);
        return;
    }
    ca_xml_node *mask = ca_tree_object(&p->tree, shape, "bsdf", "mask");
    ca_pbrt_put_number(p, mask, "opacity", &alpha);
    ca_tree_ref(&p->tree, mask, NULL, id);
}

/* Version 4 has no lights on surfaces that are nothing. */
static bool shines(const ca_pbrt *p)
{
    return p->state.light.shines && !(p->version == 4 && p->state.is_interface);
}

static void put_light(ca_pbrt *p, ca_xml_node *shape, double area)
{
    const ca_pbrt_area_light *light = &p->state.light;
    double radiance[3];
    if (light->shines && !shines(p))
        ca_import_note(p->importer, &light->where,
                       "area lights on surfaces of \"interface\" do not shine, as in pbrt");
    if (!shines(p)) return;
    if (p->group) {
        ca_import_note(p->importer, &light->where, "area lights in objects do not shine, as in pbrt");
        return;
    }
    const double scale = light->power > 0.0 ? light->power / (pi * area * (light->two_sided ? 2.0 : 1.0)) : 1.0;
    for (int i = 0; i < 3; i++) radiance[i] = light->radiance[i] * scale;
    ca_xml_node *emitter = ca_tree_object(&p->tree, shape, "emitter", "area");
    if (!light->picture) {
        ca_tree_rgb(&p->tree, emitter, "radiance", radiance);
        return;
    }
    ca_xml_node *texture = ca_tree_named_object(&p->tree, emitter, "texture", "scale", "radiance", NULL);
    ca_tree_rgb(&p->tree, texture, "scale", radiance);
    ca_tree_ref(&p->tree, texture, NULL, light->picture);
}

/* A shape of the tree, in the world or in the object that is being defined. `area` is that of the shape in the world,
 * where a light's power depends on it. */
static ca_xml_node *add_shape(ca_pbrt *p, const char *type, const ca_matrix *to_world, bool flips, double area)
{
    ca_xml_node *parent = p->group ? p->group : ca_tree_root(&p->tree);
    ca_xml_node *shape = ca_tree_object(&p->tree, parent, "shape", type);
    p->group_has_shapes = true;
    ca_tree_transform(&p->tree, shape, "to_world", to_world);
    if (flips) ca_tree_boolean(&p->tree, shape, "flip_normals", true);
    put_material(p, shape);
    put_light(p, shape, area);
    return shape;
}

/* ---- Meshes ---------------------------------------------------------------------------------------------------- */

static void corner(const ca_mesh *mesh, const ca_matrix *map, uint32_t vertex, double world[3])
{
    const double at[3] = {(double)mesh->positions[3 * (size_t)vertex],
                          (double)mesh->positions[3 * (size_t)vertex + 1],
                          (double)mesh->positions[3 * (size_t)vertex + 2]};
    ca_matrix_point(map, at, world);
}

static double triangle_area(const ca_mesh *mesh, const ca_matrix *map, const uint32_t *corners)
{
    double a[3], b[3], c[3], u[3], v[3];
    corner(mesh, map, corners[0], a);
    corner(mesh, map, corners[1], b);
    corner(mesh, map, corners[2], c);
    for (int i = 0; i < 3; i++) u[i] = b[i] - a[i], v[i] = c[i] - a[i];
    const double x = u[1] * v[2] - u[2] * v[1], y = u[2] * v[0] - u[0] * v[2], z = u[0] * v[1] - u[1] * v[0];
    return 0.5 * sqrt(x * x + y * y + z * z);
}

/* pbrt's light on a mesh is one on each triangle, and so is its power. Of triangles of one area that is one
 * radiance; others are not lights of one radiance. */
static double area_of_one(ca_pbrt *p, const ca_mesh *mesh)
{
    double least = (double)INFINITY, most = 0.0;
    if (!shines(p) || !(p->state.light.power > 0.0)) return 1.0;
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        const double area = triangle_area(mesh, &p->state.ctm, mesh->indices + 3 * (size_t)t);
        least = fmin(least, area);
        most = fmax(most, area);
    }
    if (!(least > 0.0) || most > least * 1.001)
        ca_import_fail(p->importer, &p->params.where,
                       "the power of a light on a mesh is each triangle's: they must be of one area");
    return most;
}

static void subtract(const float *a, const float *b, double difference[3])
{
    for (int i = 0; i < 3; i++) difference[i] = (double)a[i] - (double)b[i];
}

/* Do the corners run clockwise around the sum of their normals? */
static bool is_reversed(const ca_mesh *mesh, const uint32_t *corners)
{
    const float *a = mesh->positions + 3 * (size_t)corners[0];
    double n[3] = {0.0, 0.0, 0.0}, u[3], v[3];
    for (size_t k = 0; k < 3; k++)
        for (size_t i = 0; i < 3; i++) n[i] += (double)mesh->normals[3 * (size_t)corners[k] + i];
    subtract(mesh->positions + 3 * (size_t)corners[1], a, u);
    subtract(mesh->positions + 3 * (size_t)corners[2], a, v);
    return n[0] * (u[1] * v[2] - u[2] * v[1]) + n[1] * (u[2] * v[0] - u[0] * v[2]) +
               n[2] * (u[0] * v[1] - u[1] * v[0]) <
           0.0;
}

/* The normals are the author's: triangles that run against them are turned round. */
static void follow_normals(ca_mesh *mesh)
{
    for (uint32_t t = 0; mesh->normals && t < mesh->triangle_count; t++) {
        uint32_t *corners = mesh->indices + 3 * (size_t)t;
        if (!is_reversed(mesh, corners)) continue;
        const uint32_t second = corners[1];
        corners[1] = corners[2];
        corners[2] = second;
    }
}

static void put_array(ca_pbrt *p, const ca_pbrt_mesh *array, bool flips, double area)
{
    ca_xml_node *shape = add_shape(p, "mesh", &p->state.ctm, flips, area);
    ca_tree_string(&p->tree, shape, "data", array->name);
    if (!array->has_normals) ca_tree_boolean(&p->tree, shape, "face_normals", true);
}

/* Takes the mesh over; its array is the last one that was put. */
static void put_side(ca_pbrt *p, ca_mesh *mesh, bool flips)
{
    const double area = area_of_one(p, mesh);
    p->last_array.has_normals = mesh->normals != NULL;
    if (ca_tree_take_mesh(&p->tree, mesh, &p->last_array.name)) put_array(p, &p->last_array, flips, area);
}

/* The largest side of what surrounds the mesh. */
static double extent_of(const ca_mesh *mesh)
{
    double extent = 0.0;
    for (size_t i = 0; i < 3; i++) {
        double low = (double)INFINITY, high = (double)-INFINITY;
        for (size_t v = 0; v < mesh->vertex_count; v++) {
            low = fmin(low, (double)mesh->positions[3 * v + i]);
            high = fmax(high, (double)mesh->positions[3 * v + i]);
        }
        extent = fmax(extent, high - low);
    }
    return extent;
}

/* A copy behind the mesh's back, `depth` away. */
static ca_status copy_behind(const ca_mesh *mesh, double depth, ca_mesh *back, ca_error *error)
{
    CA_TRY(ca_mesh_copy(mesh, 0, back, error));
    const ca_status status = mesh->normals ? CA_OK : ca_mesh_compute_normals(back, 0, error);
    for (size_t i = 0; status == CA_OK && i < 3 * (size_t)back->vertex_count; i++)
        back->positions[i] = (float)((double)back->positions[i] - depth * (double)back->normals[i]);
    if (status != CA_OK) ca_mesh_destroy(back);
    if (status == CA_OK && !mesh->normals) ca_mesh_drop_normals(back);
    return status;
}

/* Lights that shine on both sides are two surfaces, so far apart in parts of their size. */
static const double thickness = 2e-5;

static bool is_two_sided(ca_pbrt *p)
{
    if (!shines(p) || !p->state.light.two_sided || p->group) return false;
    ca_import_note(p->importer, &p->state.light.where,
                   "a light with two sides is two surfaces, 1/50000 of its size apart");
    return true;
}

/* Takes the mesh over. */
static void put_mesh_flipped(ca_pbrt *p, ca_mesh *mesh, bool flips)
{
    ca_mesh back = {0};
    ca_error reason;
    follow_normals(mesh);
    const bool two = is_two_sided(p);
    const double depth = thickness * extent_of(mesh) * (flips ? -1.0 : 1.0);
    const ca_status status = two ? copy_behind(mesh, depth, &back, &reason) : CA_OK;
    if (status != CA_OK) ca_import_fail_file(p->importer, &p->params.where, status, &reason);
    put_side(p, mesh, flips);
    if (two && status == CA_OK) put_side(p, &back, !flips);
}

/* Version 3 leaves normals that are given as they are. */
static bool is_flipped(const ca_pbrt *p, bool has_normals)
{
    return p->state.reverses && !(p->version == 3 && has_normals);
}

static void put_mesh(ca_pbrt *p, ca_mesh *mesh) { put_mesh_flipped(p, mesh, is_flipped(p, mesh->normals != NULL)); }

static void copy_floats(float *to, const double *from, size_t count)
{
    for (size_t i = 0; i < count; i++) to[i] = (float)from[i];
}

/* uv with v downwards, as in the tree. */
static void copy_uvs(ca_mesh *mesh, const double *uvs)
{
    for (size_t i = 0; i < mesh->vertex_count; i++) {
        mesh->uvs[2 * i] = (float)uvs[2 * i];
        mesh->uvs[2 * i + 1] = (float)(1.0 - uvs[2 * i + 1]);
    }
}

typedef struct mesh_arrays {
    const double *points, *normals, *uvs, *indices;
    size_t point_count, index_count; /* index_count: faces */
} mesh_arrays;

static const char *const other_names[] = {"S", "faceIndices", "discarddegenerateUVs"};

/* P, N, uv (or st) and indices in groups of so many. */
static mesh_arrays read_arrays(ca_pbrt *p, size_t corners)
{
    ca_pbrt_params *params = &p->params;
    mesh_arrays a = {0};
    size_t count;
    a.points = ca_pbrt_array(params, "P", CA_PBRT_POINT, 3, &a.point_count);
    a.normals = ca_pbrt_array(params, "N", CA_PBRT_POINT, 3, &count);
    if (a.normals && count != a.point_count) ca_pbrt_fail(params, "N", "must have one for each P");
    const char *uv = ca_pbrt_find(params, "st") ? "st" : "uv";
    a.uvs = ca_pbrt_array(params, uv, CA_PBRT_POINT2, 2, &count);
    if (a.uvs && count != a.point_count) ca_pbrt_fail(params, uv, "must have one for each P");
    a.indices = ca_pbrt_array(params, "indices", CA_PBRT_INTEGER, corners, &a.index_count);
    ca_pbrt_ignore(params, other_names, CA_COUNT(other_names));
    if (!a.points) ca_pbrt_fail(params, "P", "is missing");
    for (size_t i = 0; i < corners * a.index_count && ca_import_good(p->importer); i++)
        if (!(a.indices[i] >= 0.0 && a.indices[i] < (double)a.point_count))
            ca_pbrt_fail(params, "indices", "has one that is no point's");
    if (!a.indices && a.point_count != corners) ca_pbrt_fail(params, "indices", "is missing");
    return a;
}

/* With room for so many triangles of so many points; false after failing. */
static bool begin_mesh(ca_pbrt *p, const mesh_arrays *a, size_t triangles, ca_mesh *mesh)
{
    ca_error reason;
    if (!ca_import_good(p->importer)) return false;
    const ca_status status = ca_mesh_create(mesh, a->point_count, triangles, a->normals, a->uvs, &reason);
    if (status != CA_OK) {
        ca_import_fail_file(p->importer, &p->params.where, status, &reason);
        return false;
    }
    copy_floats(mesh->positions, a->points, 3 * a->point_count);
    if (a->normals) copy_floats(mesh->normals, a->normals, 3 * a->point_count);
    if (a->normals) ca_mesh_normalize_normals(mesh);
    if (a->uvs) copy_uvs(mesh, a->uvs);
    return true;
}

static void read_triangles(ca_pbrt *p)
{
    const mesh_arrays a = read_arrays(p, 3);
    ca_mesh mesh;
    const size_t count = a.indices ? a.index_count : 1;
    if (!begin_mesh(p, &a, count, &mesh)) return;
    for (size_t i = 0; i < 3 * count; i++) mesh.indices[i] = a.indices ? (uint32_t)a.indices[i] : (uint32_t)i;
    put_mesh(p, &mesh);
}

/* Is the fourth corner in the plane of the others, up to a thousandth of their distances? */
static bool is_flat(const double *points, const uint32_t corners[4])
{
    double d[3][3], normal[3], longest = 0.0;
    for (size_t k = 0; k < 3; k++)
        for (size_t i = 0; i < 3; i++)
            d[k][i] = points[3 * (size_t)corners[k + 1] + i] - points[3 * (size_t)corners[0] + i];
    for (int i = 0; i < 3; i++)
        normal[i] = d[0][(i + 1) % 3] * d[1][(i + 2) % 3] - d[0][(i + 2) % 3] * d[1][(i + 1) % 3];
    const double length = sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
    const double height = normal[0] * d[2][0] + normal[1] * d[2][1] + normal[2] * d[2][2];
    for (int k = 0; k < 3; k++) longest = fmax(longest, d[k][0] * d[k][0] + d[k][1] * d[k][1] + d[k][2] * d[k][2]);
    return fabs(height) <= 1e-3 * length * sqrt(longest);
}

/* Points 0, 1, 2, 3 of a patch are at (u, v) = (0, 0), (1, 0), (0, 1), (1, 1). */
static void read_patches(ca_pbrt *p)
{
    static const char *const emission[] = {"emissionfilename"};
    const mesh_arrays a = read_arrays(p, 4);
    ca_mesh mesh;
    bool bent = false;
    const size_t count = a.indices ? a.index_count : 1;
    if (ca_pbrt_find(&p->params, emission[0]))
        ca_pbrt_fail(&p->params, emission[0], "is not supported; AreaLightSource has filename");
    if (!begin_mesh(p, &a, 2 * count, &mesh)) return;
    for (size_t i = 0; i < count; i++) {
        uint32_t c[4], *out = mesh.indices + 6 * i;
        for (size_t k = 0; k < 4; k++) c[k] = a.indices ? (uint32_t)a.indices[4 * i + k] : (uint32_t)k;
        const uint32_t corners[6] = {c[0], c[1], c[3], c[0], c[3], c[2]};
        memcpy(out, corners, sizeof corners);
        bent = bent || !is_flat(a.points, c);
    }
    if (bent)
        ca_import_note(p->importer, &p->params.where, "bilinear patches that are not flat are two triangles each");
    put_mesh(p, &mesh);
}

/* ---- Height fields --------------------------------------------------------------------------------------------- */

static void fill_grid(const double *heights, size_t nu, size_t nv, double *points, double *uvs)
{
    for (size_t i = 0; i < nu * nv; i++) {
        uvs[2 * i] = points[3 * i] = (double)(i % nu) / (double)(nu - 1);
        uvs[2 * i + 1] = points[3 * i + 1] = (double)(i / nu) / (double)(nv - 1);
        points[3 * i + 2] = heights[i];
    }
}

/* Heights over a grid on the unit square. */
static void read_heights(ca_pbrt *p)
{
    ca_pbrt_params *params = &p->params;
    size_t count;
    const size_t nu = (size_t)ca_pbrt_integer_in(params, "nu", 0, 2, 1 << 24);
    const size_t nv = (size_t)ca_pbrt_integer_in(params, "nv", 0, 2, 1 << 24);
    const double *heights = ca_pbrt_array(params, "Pz", CA_PBRT_FLOAT, 1, &count);
    if (!heights || nu * nv != count) ca_pbrt_fail(params, "Pz", "must have nu times nv numbers");
    double *values = ca_import_good(p->importer) ? ca_alloc(5 * count, sizeof *values) : NULL;
    if (!values) {
        ca_import_fail_memory(p->importer, "a height field");
        return;
    }
    ca_mesh mesh;
    const mesh_arrays arrays = {.points = values, .uvs = values + 3 * count, .point_count = count};
    fill_grid(heights, nu, nv, values, values + 3 * count);
    const bool begun = begin_mesh(p, &arrays, 2 * (nu - 1) * (nv - 1), &mesh);
    ca_free(values);
    if (!begun) return;
    ca_import_grid_triangles(nu, nv, mesh.indices);
    put_mesh(p, &mesh);
}

/* ---- Files ----------------------------------------------------------------------------------------------------- */

static void flip_v(ca_mesh *mesh)
{
    for (size_t i = 0; mesh->uvs && i < mesh->vertex_count; i++) mesh->uvs[2 * i + 1] = 1.0f - mesh->uvs[2 * i + 1];
}

/* A file that was read already is seen once more. */
static bool put_known_file(ca_pbrt *p, uint64_t file)
{
    uint32_t index;
    if (!ca_key_table_find(&p->files, file, &index)) return false;
    const ca_pbrt_mesh *array = &p->arrays.items[index];
    put_array(p, array, is_flipped(p, array->has_normals), 1.0);
    return true;
}

static void note_file(ca_pbrt *p, uint64_t file)
{
    if (CA_TABLE_ADD(&p->arrays) && ca_key_table_add(&p->files, file, (uint32_t)(p->arrays.count - 1)))
        p->arrays.items[p->arrays.count - 1] = p->last_array;
    else
        ca_import_fail_memory(p->importer, "the scene's meshes");
}

/* Lights are made anew: they may be of two sides, and their power is by the areas of triangles. */
static void read_ply(ca_pbrt *p)
{
    static const char *const displacement[] = {"displacement", "displacement.edgelength", "edgelength"};
    const char *name = ca_pbrt_string(&p->params, "filename", NULL);
    ca_mesh mesh;
    ca_error reason;
    if (!name) ca_pbrt_fail(&p->params, "filename", "is missing");
    if (ca_pbrt_find(&p->params, displacement[0]))
        ca_pbrt_fail(&p->params, displacement[0], "of a mesh is not supported");
    ca_pbrt_ignore(&p->params, displacement + 1, 2);
    const char *path = ca_import_good(p->importer) ? ca_pbrt_file(p, name) : NULL;
    if (path) path = ca_document_add_file(&p->importer->document, path);
    if (!path) {
        ca_import_fail_memory(p->importer, "a file name");
        return;
    }
    const uint64_t file = shines(p) ? 0 : ca_reuse_file(path);
    if (put_known_file(p, file)) return;
    const ca_status status = ca_import_ply(path, &mesh, &reason);
    if (status != CA_OK) {
        ca_import_fail_file(p->importer, &p->params.where, status, &reason);
        return;
    }
    flip_v(&mesh);
    put_mesh(p, &mesh);
    if (file && ca_import_good(p->importer)) note_file(p, file);
}

static void read_subdivision(ca_pbrt *p)
{
    static const char *const without_effect[] = {"scheme"};
    const char *name = ca_pbrt_find(&p->params, "nlevels") ? "nlevels" : "levels";
    const uint32_t levels = (uint32_t)ca_pbrt_integer_in(&p->params, name, 3, 0, 10);
    ca_pbrt_ignore(&p->params, without_effect, CA_COUNT(without_effect));
    const mesh_arrays a = read_arrays(p, 3);
    ca_mesh mesh;
    if (!a.indices) ca_pbrt_fail(&p->params, "indices", "is missing");
    if (!ca_import_good(p->importer)) return;
    if (ca_pbrt_subdivide(p, a.points, a.point_count, a.indices, 3 * a.index_count, levels, &mesh))
        put_mesh(p, &mesh);
}

/* ---- Quadrics -------------------------------------------------------------------------------------------------- */

/* Parts of pbrt's quadrics as (u, v) -> position and outward normal. */
typedef struct quadric {
    double radius, inner, low, high, phi; /* angles in radians; low and high: of theta or z */
} quadric;

static void sphere_at(const void *of, double u, double v, double position[3], double normal[3])
{
    const quadric *q = of;
    const double phi = u * q->phi, theta = q->low + v * (q->high - q->low);
    const double n[3] = {sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)};
    for (int i = 0; i < 3; i++) normal[i] = n[i], position[i] = q->radius * n[i];
}

static void cylinder_at(const void *of, double u, double v, double position[3], double normal[3])
{
    const quadric *q = of;
    const double phi = u * q->phi, n[3] = {cos(phi), sin(phi), 0.0};
    for (int i = 0; i < 3; i++) normal[i] = n[i], position[i] = q->radius * n[i];
    position[2] = q->low + v * (q->high - q->low);
}

static void disk_at(const void *of, double u, double v, double position[3], double normal[3])
{
    const quadric *q = of;
    const double phi = u * q->phi, r = (1.0 - v) * q->radius + v * q->inner;
    position[0] = r * cos(phi), position[1] = r * sin(phi), position[2] = q->low;
    normal[0] = normal[1] = 0.0, normal[2] = 1.0;
}

/* Its tip is at v = 1. */
static void cone_at(const void *of, double u, double v, double position[3], double normal[3])
{
    const quadric *q = of;
    const double phi = u * q->phi, slant = hypot(q->radius, q->high);
    const double out[2] = {cos(phi), sin(phi)};
    for (int i = 0; i < 2; i++) position[i] = q->radius * (1.0 - v) * out[i], normal[i] = q->high / slant * out[i];
    position[2] = q->high * v, normal[2] = q->radius / slant;
}

/* x^2 + y^2 = radius^2 z / high, with z from `low` to `high`. */
static void paraboloid_at(const void *of, double u, double v, double position[3], double normal[3])
{
    const quadric *q = of;
    const double phi = u * q->phi, z = q->low + v * (q->high - q->low), r = q->radius * sqrt(z / q->high);
    const double down = 0.5 * q->radius * q->radius / q->high, length = hypot(r, down);
    const double out[2] = {cos(phi), sin(phi)};
    for (int i = 0; i < 2; i++) position[i] = r * out[i], normal[i] = r / length * out[i];
    position[2] = z, normal[2] = -down / length;
}

/* A segment from a to b that turns around the axis. */
typedef struct turned_segment {
    double a[3], b[3], phi;
} turned_segment;

static void hyperboloid_at(const void *of, double u, double v, double position[3], double normal[3])
{
    const turned_segment *t = of;
    const double c = cos(u * t->phi), s = sin(u * t->phi);
    double at[3], along[3];
    for (int i = 0; i < 3; i++) at[i] = (1.0 - v) * t->a[i] + v * t->b[i], along[i] = t->b[i] - t->a[i];
    position[0] = c * at[0] - s * at[1], position[1] = s * at[0] + c * at[1], position[2] = at[2];
    const double dv[2] = {c * along[0] - s * along[1], s * along[0] + c * along[1]};
    const double n[3] = {position[0] * along[2], position[1] * along[2], -position[1] * dv[1] - position[0] * dv[0]};
    const double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (int i = 0; i < 3; i++) normal[i] = length > 0.0 ? n[i] / length : i == 2;
}

static void put_surface(ca_pbrt *p, const ca_pbrt_surface *surface)
{
    ca_mesh mesh;
    if (!ca_import_good(p->importer)) return;
    ca_import_note(p->importer, &p->params.where,
                   "what the scene language has no exact shape for is a mesh of %u "
                   "triangles",
                   2 * surface->columns * surface->rows);
    if (ca_pbrt_make_surface(p, surface, &mesh)) put_mesh_flipped(p, &mesh, p->state.reverses);
}

static double read_phi(ca_pbrt *p)
{
    return ca_pbrt_number_in(&p->params, "phimax", 360.0, 0.0, 360.0) * (pi / 180.0);
}

/* The area's factor under the current transform, which must scale uniformly for a light's power to be known. */
static double area_scale(const ca_pbrt *p)
{
    const double determinant = fabs(ca_matrix_determinant3(&p->state.ctm));
    return pow(determinant, 2.0 / 3.0);
}

static void check_area(ca_pbrt *p)
{
    if (shines(p) && p->state.light.power > 0.0 && !ca_import_is_similarity(&p->state.ctm))
        ca_import_fail(p->importer, &p->params.where, "a light's power needs a shape that is not stretched");
}

static void read_sphere(ca_pbrt *p)
{
    const double radius = ca_pbrt_number_in(&p->params, "radius", 1.0, 1e-30, 1e30);
    const double zmin = ca_pbrt_number(&p->params, "zmin", -radius),
                 zmax = ca_pbrt_number(&p->params, "zmax", radius);
    const double phi = read_phi(p);
    if (phi < 2.0 * pi || fmin(zmin, zmax) > -radius || fmax(zmin, zmax) < radius) {
        const quadric part = {.radius = radius,
                              .low = acos(fmin(fmax(fmin(zmin, zmax) / radius, -1.0), 1.0)),
                              .high = acos(fmin(fmax(fmax(zmin, zmax) / radius, -1.0), 1.0)),
                              .phi = phi};
        const ca_pbrt_surface surface = {sphere_at, &part, 128, 64};
        put_surface(p, &surface);
        return;
    }
    check_area(p);
    const double area = 4.0 * pi * radius * radius * area_scale(p), inside = p->state.reverses ? 1.0 : -1.0;
    const int sides = is_two_sided(p) ? 2 : 1;
    for (int side = 0; side < sides; side++) {
        ca_xml_node *shape = add_shape(p, "sphere", &p->state.ctm, p->state.reverses != (side == 1), area);
        ca_tree_float(&p->tree, shape, "radius", radius * (1.0 + side * inside * thickness));
    }
}

/* v downwards is a cylinder that hangs from its upper end; a mirror does not turn its outside in. */
static void read_cylinder(ca_pbrt *p)
{
    const double radius = ca_pbrt_number_in(&p->params, "radius", 1.0, 1e-30, 1e30);
    const double z0 = ca_pbrt_number(&p->params, "zmin", -1.0), z1 = ca_pbrt_number(&p->params, "zmax", 1.0);
    const double zmin = fmin(z0, z1), zmax = fmax(z0, z1), phi = read_phi(p);
    if (!(zmax > zmin)) ca_pbrt_fail(&p->params, "zmax", "must differ from zmin");
    if (phi < 2.0 * pi) {
        const quadric part = {.radius = radius, .low = zmin, .high = zmax, .phi = phi};
        const ca_pbrt_surface surface = {cylinder_at, &part, 128, 1};
        put_surface(p, &surface);
        return;
    }
    check_area(p);
    const double area = 2.0 * pi * radius * (zmax - zmin) * area_scale(p), inside = p->state.reverses ? 1.0 : -1.0;
    const ca_matrix move = ca_matrix_translate(0.0, 0.0, zmax);
    const int sides = is_two_sided(p) ? 2 : 1;
    for (int side = 0; side < sides; side++) {
        const double across = radius * (1.0 + side * inside * thickness);
        const ca_matrix size = ca_matrix_scale(across, across, zmin - zmax);
        const ca_matrix frame = ca_matrix_multiply(&move, &size);
        const ca_matrix to_world = ca_matrix_multiply(&p->state.ctm, &frame);
        add_shape(p, "cylinder", &to_world, p->state.reverses != (side == 1), area);
    }
}

static void read_cone(ca_pbrt *p)
{
    const quadric cone = {.radius = ca_pbrt_number_in(&p->params, "radius", 1.0, 1e-30, 1e30),
                          .high = ca_pbrt_number_in(&p->params, "height", 1.0, 1e-30, 1e30),
                          .phi = read_phi(p)};
    const ca_pbrt_surface surface = {cone_at, &cone, 128, 1};
    put_surface(p, &surface);
}

static void read_paraboloid(ca_pbrt *p)
{
    const double z0 = ca_pbrt_number_in(&p->params, "zmin", 0.0, 0.0, 1e30),
                 z1 = ca_pbrt_number_in(&p->params, "zmax", 1.0, 0.0, 1e30);
    const quadric bowl = {.radius = ca_pbrt_number_in(&p->params, "radius", 1.0, 1e-30, 1e30),
                          .low = fmin(z0, z1),
                          .high = fmax(z0, z1),
                          .phi = read_phi(p)};
    if (!(bowl.high > bowl.low)) ca_pbrt_fail(&p->params, "zmax", "must differ from zmin");
    const ca_pbrt_surface surface = {paraboloid_at, &bowl, 128, 64};
    put_surface(p, &surface);
}

static void read_hyperboloid(ca_pbrt *p)
{
    turned_segment segment = {.a = {0.0, 0.0, 0.0}, .b = {1.0, 1.0, 1.0}};
    (void)ca_pbrt_point(&p->params, "p1", segment.a);
    (void)ca_pbrt_point(&p->params, "p2", segment.b);
    segment.phi = read_phi(p);
    const ca_pbrt_surface surface = {hyperboloid_at, &segment, 128, 64};
    put_surface(p, &surface);
}

/* Whole disks under a material without pictures are exact. */
static void read_disk(ca_pbrt *p)
{
    const double radius = ca_pbrt_number_in(&p->params, "radius", 1.0, 1e-30, 1e30);
    const double inner = ca_pbrt_number_in(&p->params, "innerradius", 0.0, 0.0, radius);
    const double height = ca_pbrt_number(&p->params, "height", 0.0), phi = read_phi(p);
    if (phi < 2.0 * pi || inner > 0.0 || p->has_pictures) {
        const quadric part = {.radius = radius, .inner = inner, .low = height, .phi = phi};
        const ca_pbrt_surface surface = {disk_at, &part, 128, p->has_pictures ? 32 : 1};
        put_surface(p, &surface);
        return;
    }
    check_area(p);
    const double area = pi * radius * radius * area_scale(p), behind = p->state.reverses ? 1.0 : -1.0;
    const ca_matrix size = ca_matrix_scale(radius, radius, 1.0);
    const int sides = is_two_sided(p) ? 2 : 1;
    for (int side = 0; side < sides; side++) {
        const ca_matrix move = ca_matrix_translate(0.0, 0.0, height + side * behind * thickness * radius);
        const ca_matrix frame = ca_matrix_multiply(&move, &size);
        const ca_matrix to_world = ca_matrix_multiply(&p->state.ctm, &frame);
        add_shape(p, "disk", &to_world, p->state.reverses != (side == 1), area);
    }
}

/* ---- Curves ---------------------------------------------------------------------------------------------------- */

/* Only a material without alpha may be another curve's, too. */
static void read_curve(ca_pbrt *p)
{
    const bool may_share = !ca_pbrt_find(&p->params, "alpha");
    const char *material = p->state.material ? p->state.material : default_material(p);
    if (shines(p) && !p->group)
        ca_import_fail(p->importer, &p->params.where, "curves cannot emit light");
    if (!may_share || !ca_pbrt_goes_on_with_curves(p, material)) {
        ca_pbrt_end_curves(p);
        ca_xml_node *parent = p->group ? p->group : ca_tree_root(&p->tree);
        ca_xml_node *shape = ca_tree_object(&p->tree, parent, "shape", "bsplinecurve");
        p->group_has_shapes = true;
        put_material(p, shape);
        ca_pbrt_begin_curves(p, shape, may_share ? material : NULL);
    }
    ca_pbrt_read_curve(p);
}

/* ---- The table ------------------------------------------------------------------------------------------------- */

typedef struct shape_kind {
    const char *name;
    void (*read)(ca_pbrt *p);
} shape_kind;

static const shape_kind kinds[] = {
    {"trianglemesh", read_triangles},
    {"plymesh", read_ply},
    {"bilinearmesh", read_patches},
    {"loopsubdiv", read_subdivision},
    {"sphere", read_sphere},
    {"cylinder", read_cylinder},
    {"disk", read_disk},
    {"cone", read_cone},
    {"paraboloid", read_paraboloid},
    {"hyperboloid", read_hyperboloid},
    {"heightfield", read_heights},
    {"curve", read_curve},
};

static const char *const unsupported[] = {"nurbs"};

void ca_pbrt_read_shape(ca_pbrt *p, const char *type)
{
    const char *nearest = NULL;
    for (size_t i = 0; i < CA_COUNT(kinds); i++) {
        if (strcmp(kinds[i].name, type) == 0) {
            kinds[i].read(p);
            return;
        }
        nearest = ca_nearer_name(type, nearest, kinds[i].name);
    }
    for (size_t i = 0; i < CA_COUNT(unsupported); i++)
        if (strcmp(unsupported[i], type) == 0)
            ca_import_fail(p->importer, &p->params.where, "shape \"%s\" is not supported", type);
    ca_import_fail(p->importer, &p->params.where, "\"%s\" is not a known shape; the nearest is \"%s\"", type,
                   nearest);
}
