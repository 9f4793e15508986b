/* Shapes that are meshes as their author wrote them: triangles, patches, height fields, PLY files, subdivision. */
#include "import/pbrt/shapes.h"

#include "import/reuse.h"

#include <string.h>

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
    if (!ca_pbrt_shines(p) || !(p->state.light.power > 0.0)) return 1.0;
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
    ca_xml_node *shape = ca_pbrt_add_shape(p, "mesh", &p->state.ctm, flips, area);
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

void ca_pbrt_put_mesh_flipped(ca_pbrt *p, ca_mesh *mesh, bool flips)
{
    ca_mesh back = {0};
    ca_error reason;
    follow_normals(mesh);
    const bool two = ca_pbrt_is_two_sided(p);
    const double depth = CA_PBRT_THICKNESS * extent_of(mesh) * (flips ? -1.0 : 1.0);
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

static void put_mesh(ca_pbrt *p, ca_mesh *mesh)
{
    ca_pbrt_put_mesh_flipped(p, mesh, is_flipped(p, mesh->normals != NULL));
}

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

void ca_pbrt_read_triangles(ca_pbrt *p)
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
void ca_pbrt_read_patches(ca_pbrt *p)
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

void ca_pbrt_read_subdivision(ca_pbrt *p)
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
void ca_pbrt_read_heights(ca_pbrt *p)
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
void ca_pbrt_read_ply(ca_pbrt *p)
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
    const uint64_t file = ca_pbrt_shines(p) ? 0 : ca_reuse_file(path);
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
