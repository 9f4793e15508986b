/* Readers of OBJ, PLY and serialized meshes: values, every way a file can be wrong, and what a user is told. */
#define _POSIX_C_SOURCE 200809L
#include "image/image.h"
#include "import/import.h"
#include "support/sample_files.h"
#include "support/sample_folder.h"

#include <locale.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static ca_status import_bytes(const char *name, const void *data, size_t size, ca_mesh *mesh, ca_error *error)
{
    const char *path = path_to(name), *extension = strrchr(name, '.');
    sample_write(path, data, size);
    if (strcmp(extension, ".obj") == 0) return ca_import_obj(path, mesh, error);
    if (strcmp(extension, ".ply") == 0) return ca_import_ply(path, mesh, error);
    return ca_import_serialized(path, 0, mesh, error);
}

static void import_sample(const char *name, sample_bytes bytes, ca_mesh *mesh)
{
    ca_error error = {{0}};
    if (import_bytes(name, bytes.data, bytes.size, mesh, &error) != CA_OK) fail_msg("%s", error.message);
    sample_free(&bytes);
}

/* The text does not load, and the message is `expected` with the path in place of its first "%s". */
static void assert_refused(const char *name, const char *text, size_t size, const char *expected)
{
    ca_mesh mesh;
    ca_error error = {{0}};
    assert_int_not_equal(import_bytes(name, text, size, &mesh, &error), CA_OK);
    assert_null(mesh.positions);
    const char *path = path_to(name);
    if (strncmp(error.message, path, strlen(path)) != 0 || strcmp(error.message + strlen(path), expected) != 0)
        fail_msg("\"%s\" is not PATH\"%s\"", error.message, expected);
}

static void assert_refused_text(const char *name, const char *text, const char *expected)
{
    assert_refused(name, text, strlen(text), expected);
}

static void assert_floats(const float *values, const float *expected, size_t count, double tolerance)
{
    assert_non_null(values);
    for (size_t i = 0; i < count; ++i)
        if (!(fabs((double)values[i] - (double)expected[i]) <= tolerance))
            fail_msg("value %zu is %.9g, not %.9g", i, (double)values[i], (double)expected[i]);
}

static void assert_indices(const ca_mesh *mesh, const uint32_t *expected, size_t count)
{
    assert_int_equal(mesh->triangle_count, count / 3);
    for (size_t i = 0; i < count; ++i) assert_int_equal(mesh->indices[i], expected[i]);
}

static const float square_positions[15] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 2, 0.5f, 0};
static const float up[15] = {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1};

#define MARK "\xef\xbb\xbf"

/* ---- OBJ ------------------------------------------------------------------------------------------------------- */

static void obj_values(void **unused)
{
    (void)unused;
    static const uint32_t indices[9] = {0, 1, 2, 0, 2, 3, 1, 4, 2};
    static const float uvs[10] = {0, 0, 1, 0, 1, 1, 0, 1, 1, 1};
    static const float colors[15] = {1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1, 0.25f, 0.5f, 0.75f};
    ca_mesh mesh;
    import_sample("a.obj", sample_obj(), &mesh);
    assert_int_equal(mesh.vertex_count, 5);
    assert_indices(&mesh, indices, 9);
    assert_floats(mesh.positions, square_positions, 15, 0.0);
    assert_floats(mesh.normals, up, 15, 0.0); /* the file's are twice as long */
    assert_floats(mesh.uvs, uvs, 10, 0.0);
    const ca_mesh_attribute *color = ca_mesh_find_attribute(&mesh, "vertex_color");
    assert_non_null(color);
    assert_int_equal(color->components, 3);
    assert_floats(color->values, colors, 15, 0.0);
    ca_mesh_destroy(&mesh);
}

static void obj_splits_vertices_only_where_corners_differ(void **unused)
{
    (void)unused;
    static const char text[] = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt .5 .5\n"
                               "f 1/1 2/1 3/1\nf 1/1 3/1 4/1\nf 1/2 2/1 3\nf 4 3 2\n";
    static const uint32_t indices[12] = {0, 1, 2, 0, 2, 3, 4, 1, 5, 6, 5, 7};
    ca_mesh mesh;
    ca_error error;
    assert_int_equal(import_bytes("b.obj", text, sizeof text - 1, &mesh, &error), CA_OK);
    assert_indices(&mesh, indices, 12);
    assert_int_equal(mesh.vertex_count, 8);
    assert_null(mesh.normals);
    assert_int_equal(mesh.attribute_count, 0);
    assert_floats(mesh.uvs + 8, (const float[]){0.5f, 0.5f, 0, 0, 0, 0, 0, 0}, 8, 0.0);
    ca_mesh_destroy(&mesh);
}

/* Many more corners than the first hash table has places for, each used by two faces. */
static void obj_of_many_vertices(void **unused)
{
    (void)unused;
    enum { N = 60 };
    sample_bytes obj = {0};
    char line[128];
    for (int y = 0; y <= N; ++y)
        for (int x = 0; x <= N; ++x) {
            snprintf(line, sizeof line, "v %d %d 0\nvt %.3f %.3f\n", x, y, x / (double)N, y / (double)N);
            sample_text(&obj, line);
        }
    for (int y = 0; y < N; ++y)
        for (int x = 0; x < N; ++x) {
            const int a = y * (N + 1) + x + 1, b = a + 1, c = b + N + 1, d = a + N + 1;
            snprintf(line, sizeof line, "f %d/%d %d/%d %d/%d %d/%d\n", a, a, b, b, c, c, d, d);
            sample_text(&obj, line);
        }
    ca_mesh mesh;
    import_sample("many.obj", obj, &mesh);
    assert_int_equal(mesh.vertex_count, (N + 1) * (N + 1));
    assert_int_equal(mesh.triangle_count, 2 * N * N);
    double area = 0.0;
    for (uint32_t t = 0; t < mesh.triangle_count; ++t) area += ca_mesh_triangle_area(&mesh, t);
    assert_float_equal((float)area, (float)(N * N), 1e-3f);
    for (uint32_t v = 0; v < mesh.vertex_count; ++v)
        assert_float_equal(mesh.uvs[2 * v] * (float)N, mesh.positions[3 * v], 0.05f);
    ca_mesh_destroy(&mesh);
}

static void obj_fills_missing_normals_and_colours(void **unused)
{
    (void)unused;
    static const char text[] = "v 0 0 0\nv 1 0 0 0.5 0.25 0\nv 0 1 0\nv 0 0 1\nvn 0 1 0\n"
                               "f 1//1 2//1 3//1\nf 1 4 3\n";
    static const float colors[9] = {1, 1, 1, 0.5f, 0.25f, 0, 1, 1, 1};
    ca_mesh mesh;
    ca_error error;
    assert_int_equal(import_bytes("c.obj", text, sizeof text - 1, &mesh, &error), CA_OK);
    assert_floats(mesh.normals, (const float[]){0, 1, 0, 0, 1, 0, 0, 1, 0, -1, 0, 0, -1, 0, 0, -1, 0, 0}, 18, 1e-7);
    assert_floats(ca_mesh_find_attribute(&mesh, "vertex_color")->values, colors, 9, 0.0);
    ca_mesh_destroy(&mesh);
}

/* The byte order mark that a text may begin with is no part of it, nor of its first line's columns. */
static void a_byte_order_mark_is_skipped(void **unused)
{
    (void)unused;
    static const char obj[] = MARK "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    static const char ply[] = MARK "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                                   "property float z\nelement face 1\nproperty list uchar int vertex_indices\n"
                                   "end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    static const float positions[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    for (int i = 0; i < 2; i++) {
        ca_mesh mesh;
        ca_error error;
        const ca_status status = i == 0 ? import_bytes("mark.obj", obj, sizeof obj - 1, &mesh, &error)
                                        : import_bytes("mark.ply", ply, sizeof ply - 1, &mesh, &error);
        if (status != CA_OK) fail_msg("%s", error.message);
        assert_floats(mesh.positions, positions, 9, 0.0);
        ca_mesh_destroy(&mesh);
    }
    assert_refused_text("mark.obj", MARK "v 0 x 0\n",
                        ":1:5: expected a number for a position of three numbers, not \"x\"");
    assert_refused_text("mark.obj", "v 0 0 0\n" MARK "v 1 0 0\n",
                        ":2:1: \"" MARK "v\" is not an OBJ statement that is read (v, vt, vn, f)");
}

static void obj_errors_name_the_place(void **unused)
{
    (void)unused;
    assert_refused_text("d.obj", "v 0 0 0\nv 1 0\n", ":2:6: expected a position of three numbers");
    assert_refused_text("d.obj", "v 0 0 0x1\n",
                        ":1:7: expected a number for a position of three numbers, not \"0x1\"");
    assert_refused_text("d.obj", "v 0 0 1,5\n",
                        ":1:7: expected a number for a position of three numbers, not \"1,5\"");
    assert_refused_text("d.obj", "v 0 0 1e99\n",
                        ":1:7: expected a number for a position of three numbers, not \"1e99\"");
    assert_refused_text("d.obj", "v 0 0 -3.4028236e38\n", /* past half a step above FLT_MAX */
                        ":1:7: expected a number for a position of three numbers, not \"-3.4028236e38\"");
    assert_refused_text("d.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 4\n",
                        ":4:7: there is no position 4: 3 are defined up to here");
    assert_refused_text("d.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 -4\n",
                        ":4:7: there is no position -4: 3 are defined up to here");
    assert_refused_text("d.obj", "v 0 0 0\nf 0 1 1\n", ":2:3: there is no position 0: 1 are defined up to here");
    assert_refused_text("d.obj", "v 0 0 0\nv 1 0 0\nf 1 2\n", ":3:6: expected a face of at least three corners");
    assert_refused_text("d.obj", "v 0 0 0\nf 1/ 1 1\n", ":2:5: expected an index");
    assert_refused_text("d.obj", "v 0 0 0\nf 1x 1 1\n", ":2:4: expected a space or \"/\" behind an index");
    assert_refused_text("d.obj", "v 0 0 0\nf 1 \\\n 1 2\n", ":3:4: there is no position 2: 1 are defined up to here");
    assert_refused_text("d.obj", "v 0 0 0\ncurv 0 1 1\n",
                        ":2:1: \"curv\" is not an OBJ statement that is read (v, vt, vn, f)");
    assert_refused_text("d.obj", "v 0 0 0\n", ": the mesh has no faces");
    assert_refused_text("d.obj", "", ": the mesh has no faces");
    ca_mesh mesh;
    ca_error error;
    assert_int_equal(ca_import_obj("/nowhere/at/all.obj", &mesh, &error), CA_ERROR_FILE);
    assert_string_equal(error.message, "/nowhere/at/all.obj: cannot open this mesh: No such file or directory");
}

/* ---- PLY ------------------------------------------------------------------------------------------------------- */

/* Of a file that sample_ply made, of whatever format. */
static void check_ply(sample_bytes ply)
{
    static const uint32_t indices[9] = {0, 1, 2, 0, 2, 3, 1, 4, 2};
    static const float weights[3] = {10, 10, 11};
    ca_mesh mesh;
    import_sample("a.ply", ply, &mesh);
    assert_int_equal(mesh.vertex_count, 5);
    assert_indices(&mesh, indices, 9);
    assert_floats(mesh.positions, square_positions, 15, 0.0);
    assert_floats(mesh.normals, up, 15, 0.0);
    const ca_mesh_attribute *color = ca_mesh_find_attribute(&mesh, "vertex_color");
    const ca_mesh_attribute *heat = ca_mesh_find_attribute(&mesh, "vertex_heat");
    const ca_mesh_attribute *mark = ca_mesh_find_attribute(&mesh, "vertex_mark");
    const ca_mesh_attribute *weight = ca_mesh_find_attribute(&mesh, "face_weight");
    assert_true(color && heat && mark && weight && mesh.attribute_count == 4);
    assert_int_equal(color->components, 3);
    assert_int_equal(heat->components, 3);
    assert_int_equal(mark->components, 1);
    assert_true(weight->per_face && !heat->per_face);
    for (uint32_t v = 0; v < 5; ++v) {
        assert_float_equal(mesh.uvs[2 * v], 0.25f * (float)v, 0.0f);
        assert_float_equal(mesh.uvs[2 * v + 1], 1.0f - 0.25f * (float)v, 0.0f);
        assert_float_equal(mark->values[v], -100.0f * (float)v, 0.0f);
        for (uint32_t c = 0; c < 3; ++c) {
            assert_float_equal(heat->values[3 * v + c], (float)v + 0.5f * (float)c, 0.0f);
            assert_float_equal(color->values[3 * v + c],
                               ca_srgb_to_linear((50.0f * (float)v + 10.0f * (float)c) / 255.0f), 1e-6f);
        }
    }
    assert_floats(weight->values, weights, 3, 0.0); /* both triangles of the square have the square's */
    ca_mesh_destroy(&mesh);
}

static void ply_ascii(void **unused) { (void)unused; check_ply(sample_ply(SAMPLE_PLY_ASCII)); }
static void ply_little_endian(void **unused) { (void)unused; check_ply(sample_ply(SAMPLE_PLY_LITTLE_ENDIAN)); }
static void ply_big_endian(void **unused) { (void)unused; check_ply(sample_ply(SAMPLE_PLY_BIG_ENDIAN)); }

/* Faces before vertices; the one vertex whose corners differ is split, with its attribute. */
static void ply_corners(void **unused)
{
    (void)unused;
    static const uint32_t indices[9] = {0, 1, 2, 0, 2, 3, 1, 4, 5};
    static const float uvs[12] = {0, 0, 1, 0, 1, 1, 0, 1, 0.5f, 0.25f, 0.75f, 0.125f};
    static const float heats[6] = {1, 2, 3, 4, 5, 3};
    for (int format = 0; format < 3; ++format) {
        ca_mesh mesh;
        import_sample("a.ply", sample_ply_corners((sample_ply_format)format), &mesh);
        assert_int_equal(mesh.vertex_count, 6);
        assert_indices(&mesh, indices, 9);
        assert_floats(mesh.uvs, uvs, 12, 0.0);
        assert_floats(mesh.positions, square_positions, 15, 0.0);
        assert_floats(mesh.positions + 15, mesh.positions + 6, 3, 0.0);
        assert_floats(mesh.normals + 15, up, 3, 1e-6); /* smooth ones, made before the split */
        const ca_mesh_attribute *heat = ca_mesh_find_attribute(&mesh, "vertex_heat");
        assert_non_null(heat);
        assert_floats(heat->values, heats, 6, 0.0);
        ca_mesh_destroy(&mesh);
    }
    assert_refused_text("c.ply",
                        "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_indices\n"
                        "property list uchar float texcoord\nelement vertex 3\nproperty float x\nproperty float y\n"
                        "property float z\nend_header\n3 0 1 2 4 0 0 1 0\n0 0 0 1 0 0 0 1 0\n",
                        ":11:18: expected two numbers in \"texcoord\" for each corner of the face (face 0)");
}

#define PLY_HEADER(vertex, face)                                                                                    \
    "ply\nformat ascii 1.0\nelement vertex " vertex "\nproperty float x\nproperty float y\nproperty float z\n"       \
    "element face " face "\nproperty list uchar int vertex_index\nend_header\n"

static void ply_attribute_names(void **unused)
{
    (void)unused;
    static const char text[] =
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
        "property float a_r\nproperty float a_g\nproperty float a_b\nproperty float b_0\nproperty float b_1\n"
        "property float c_1\nproperty float d_x\nproperty float d_z\nproperty float lonely_thing\n"
        "property float r\nproperty float g\nproperty float b\nproperty float a\n"
        "element face 1\nproperty list uchar int vertex_index\nproperty uchar red\nproperty uchar green\n"
        "property uchar blue\nend_header\n"
        "0 0 0 1 2 3 4 5 6 7 8 9 .1 .2 .3 .4\n1 0 0 1 2 3 4 5 6 7 8 9 .1 .2 .3 .4\n"
        "0 1 0 1 2 3 4 5 6 7 8 9 .1 .2 .3 .4\n3 0 1 2 255 0 51\n";
    static const struct {
        const char *name;
        uint32_t components;
        float first;
    } expected[] = {{"vertex_color", 4, 0.1f}, {"vertex_a_color", 3, 1.0f}, {"vertex_b", 2, 4.0f},
                    {"vertex_c", 1, 6.0f},     {"vertex_d", 1, 7.0f},       {"vertex_d_z", 1, 8.0f},
                    {"vertex_lonely_thing", 1, 9.0f}, {"face_color", 3, 1.0f}};
    ca_mesh mesh;
    ca_error error = {{0}};
    if (import_bytes("names.ply", text, sizeof text - 1, &mesh, &error) != CA_OK) fail_msg("%s", error.message);
    assert_int_equal(mesh.attribute_count, 8);
    for (size_t i = 0; i < 8; ++i) {
        const ca_mesh_attribute *attribute = ca_mesh_find_attribute(&mesh, expected[i].name);
        if (!attribute) fail_msg("no attribute %s", expected[i].name);
        assert_int_equal(attribute->components, expected[i].components);
        assert_float_equal(attribute->values[0], expected[i].first, 1e-6f);
    }
    ca_mesh_destroy(&mesh);
}

static void ply_errors_name_the_place(void **unused)
{
    (void)unused;
    assert_refused_text("e.ply", "plx\n", ":1:1: expected \"ply\" in the PLY header, not \"plx\"");
    assert_refused_text("e.ply", "ply\nformat ascii 1.1\n",
                        ":2:14: expected version 1.0 in the PLY header, not \"1.1\"");
    assert_refused_text("e.ply", "ply\nproperty float x\n",
                        ":2:1: expected an element before its properties in the PLY header, not \"property\"");
    assert_refused_text("e.ply", "ply\nelement vertex -1\n", ":2:16: expected a count in the PLY header, not \"-1\"");
    assert_refused_text(
        "e.ply", "ply\nelement v 1\nproperty half x\n",
        ":3:10: expected a type (char to uint, float, double) or list in the PLY header, not \"half\"");
    assert_refused_text("e.ply", "ply\nelement v 1\nproperty float x\nproperty int x\n",
                        ":4:1: the property \"x\" of \"v\" is there twice");
    assert_refused_text("e.ply", "ply\nformat ascii 1.0\n", ":3:1: the PLY header has no line \"end_header\"");
    assert_refused_text("e.ply", PLY_HEADER("3", "1") "0.0 0.0 0.0 1.0 0.0 0.0 0.0 1.0\n",
                        ":11:1: expected a number for z, not \"\"");
    assert_refused_text("e.ply", PLY_HEADER("3", "1") "0 0 0\n1 0 0\n0 one 0\n3 0 1 2\n",
                        ":12:3: expected a number for y, not \"one\"");
    assert_refused_text("e.ply", PLY_HEADER("3", "1") "0 0 0\n1 0 0\n0 1 0\n2 0 1\n",
                        ":13:2: expected a face of at least three corners (face 0)");
    assert_refused_text("e.ply", PLY_HEADER("3", "1") "0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n",
                        ": triangle 0 uses vertex 3, but there are only 3");
    assert_refused_text("e.ply", PLY_HEADER("3", "1") "0 0 0\n1 0 0\n0 1 0\n3 0 1 -2\n",
                        ":13:9: expected the index of a vertex (face 0)");
    assert_refused_text("e.ply", PLY_HEADER("3", "1") "0 0 0\n1 0 0\n0 1 0\n3 0 1 2 7\n",
                        ": expected the end of the file at byte 178: the header counts less");
    assert_refused_text("e.ply", PLY_HEADER("3", "1") "0 0 0\n1 0 0\n0 1 0\n200 0 1 2\n",
                        ":13:4: expected the length of a list that fits in the file (face 0)");
    assert_refused_text("e.ply", PLY_HEADER("4000000000", "1") "0 0 0\n",
                        ":3:1: 4000000000 times \"vertex\" do not fit in the file");
    assert_refused_text("e.ply", PLY_HEADER("1", "99999999999999999") "0 0 0\n",
                        ":7:1: 99999999999999999 times \"face\" do not fit in the file");
    assert_refused_text("e.ply", PLY_HEADER("1", "99999999999999999999") "0 0 0\n",
                        ":7:14: expected a count in the PLY header, not \"99999999999999999999\"");
    static const char binary[] =
        "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\nproperty float y"
        "\nproperty float z\nelement face 1\nproperty list uchar int vertex_index\nend_header\n"
        "\0\0\0\0"
        "\0\0\0\0"
        "\0\0\0\0"
        "\3"
        "\0\0\0\0"
        "\0\0\0\0"
        "\0\0\0";
    assert_refused("e.ply", binary, sizeof binary - 1,
                   ": expected the length of a list that fits in the file at byte 180 (face 0)");
}

/* ---- serialized ------------------------------------------------------------------------------------------------ */

static void check_serialized(unsigned version, bool doubles)
{
    static const uint32_t indices[9] = {0, 1, 2, 0, 2, 3, 1, 4, 2};
    const sample_bytes file = sample_serialized(version, doubles);
    const char *path = path_to("a.serialized");
    sample_write(path, file.data, file.size);
    for (uint32_t shape = 0; shape < 2; ++shape) {
        ca_mesh mesh;
        ca_error error = {{0}};
        if (ca_import_serialized(path, shape, &mesh, &error) != CA_OK) fail_msg("%s", error.message);
        assert_indices(&mesh, indices, 9);
        for (size_t i = 0; i < 15; ++i)
            assert_float_equal(mesh.positions[i], (float)(shape + 1) * square_positions[i], 0.0f);
        assert_floats(mesh.normals, up, 15, 0.0);
        const ca_mesh_attribute *color = ca_mesh_find_attribute(&mesh, "vertex_color");
        assert_non_null(color);
        for (uint32_t v = 0; v < 5; ++v) {
            assert_float_equal(mesh.uvs[2 * v + 1], 0.125f * (float)v + 0.5f, 0.0f);
            assert_float_equal(color->values[3 * v + 2], 0.1f * (float)v + 0.02f, 1e-6f);
        }
        ca_mesh_destroy(&mesh);
    }
    ca_mesh mesh;
    ca_error error = {{0}};
    assert_int_equal(ca_import_serialized(path, 2, &mesh, &error), CA_ERROR_SCENE);
    assert_non_null(strstr(error.message, ": there is no mesh 2: the file has 2, counted from 0"));
    sample_bytes copy = file;
    sample_free(&copy);
}

static void serialized_3_float(void **unused) { (void)unused; check_serialized(3, false); }
static void serialized_3_double(void **unused) { (void)unused; check_serialized(3, true); }
static void serialized_4_float(void **unused) { (void)unused; check_serialized(4, false); }
static void serialized_4_double(void **unused) { (void)unused; check_serialized(4, true); }

static sample_bytes serialized_header(uint32_t flags, uint64_t vertex_count, uint64_t triangle_count, size_t extra)
{
    sample_bytes content = {0}, file = {0};
    sample_u32(&content, flags);
    sample_u8(&content, 0);
    sample_u64(&content, vertex_count);
    sample_u64(&content, triangle_count);
    for (size_t i = 0; i < extra; ++i) sample_u8(&content, 0);
    sample_u16(&file, 0x041c);
    sample_u16(&file, 4);
    sample_zlib(&file, &content);
    sample_free(&content);
    return file;
}

static void serialized_flags_and_errors(void **unused)
{
    (void)unused;
    enum { NORMALS = 1, FACE_NORMALS = 0x10, SINGLE = 0x1000, DOUBLE = 0x2000 };
    ca_mesh mesh;
    import_sample("f.serialized", serialized_header(SINGLE | NORMALS | FACE_NORMALS, 3, 1, 36 + 36 + 12), &mesh);
    assert_non_null(mesh.normals); /* the flag has no effect, as in Mitsuba 3: face_normals of the scene has */
    assert_int_equal(mesh.triangle_count, 1); /* without area, but kept */
    ca_mesh_destroy(&mesh);

    sample_bytes file = serialized_header(SINGLE, UINT64_C(1) << 40, 1, 0);
    assert_refused("f.serialized", (char *)file.data, file.size,
                   ": 1099511627776 vertices and 1 triangles do not fit in the file");
    sample_free(&file);
    file = serialized_header(SINGLE, 3, UINT64_MAX, 0);
    assert_refused("f.serialized", (char *)file.data, file.size,
                   ": 3 vertices and 18446744073709551615 triangles do not fit in the file");
    sample_free(&file);
    file = serialized_header(SINGLE | DOUBLE, 3, 1, 100);
    assert_refused("f.serialized", (char *)file.data, file.size, ": the mesh's flags 0x3000 ask for two precisions");
    sample_free(&file);
    file = serialized_header(SINGLE, 3, 1, 40);
    assert_refused("f.serialized", (char *)file.data, file.size,
                   ": the mesh is damaged or ends too early at its triangles");
    sample_free(&file);
    file = serialized_header(SINGLE, 3, 1, 36 + 12 + 1);
    assert_refused("f.serialized", (char *)file.data, file.size,
                   ": expected the end of the mesh after its triangles: its counts say less");
    sample_free(&file);
    file = serialized_header(SINGLE, 3, 1, 36 + 12);
    file.data[file.size - 1] ^= 1;
    assert_refused("f.serialized", (char *)file.data, file.size,
                   ": the mesh is damaged or ends too early at its checksum");
    sample_free(&file);
    assert_refused("f.serialized", "\x1c\x04\x05\x00", 4, ": expected version 3 or 4 of a serialized mesh, not 5");
    assert_refused("f.serialized", "\x1c\x05\x04\x00", 4,
                   ": expected the mark 0x041c of a serialized mesh at byte 0");
}

/* ---- all ------------------------------------------------------------------------------------------------------- */

/* Cut at every byte: refused with a message, or, where only the end of the text is missing, read. */
static void truncated_files_are_refused(void **unused)
{
    (void)unused;
    sample_file *files;
    const size_t count = sample_files_make(&files);
    for (size_t i = 0; i < count; ++i) {
        if (!files[i].is_mesh) continue;
        size_t read = 0;
        for (size_t size = 0; size < files[i].bytes.size; ++size) {
            ca_error error = {{0}};
            const char *path = path_to(files[i].name);
            sample_write(path, files[i].bytes.data, size);
            if (sample_read(path, true, &error) == CA_OK)
                read++;
            else
                assert_non_null(strstr(error.message, path));
        }
        if (strstr(files[i].name, ".obj")) continue; /* it is a mesh from its first whole face on */
        if (read > (strcmp(files[i].name, "ascii.ply") == 0)) fail_msg("%s was read %zu times", files[i].name, read);
    }
    sample_files_free(files, count);
}

static void every_allocation_may_fail(void **unused)
{
    (void)unused;
    check_sample_allocations(true, 6);
}

/* A locale that writes 1,5: one that is there, else one of our own; false: this system has none and makes none. */
static bool set_comma(void)
{
    static const char *const names[] = {"de_DE.UTF-8", "de_DE.utf8", "fr_FR.UTF-8", "de_DE"};
    static const char definition[] =
        "LC_NUMERIC\ndecimal_point \"<U002C>\"\nthousands_sep \"<U002E>\"\ngrouping 3;3\nEND LC_NUMERIC\n";
    char command[512];
    for (size_t i = 0; i < 4; ++i)
        if (setlocale(LC_ALL, names[i])) return true;
    sample_write(path_to("comma.txt"), definition, strlen(definition));
    snprintf(command, sizeof command, "localedef -c -i '%s' '%s/comma' >/dev/null 2>&1", path_to("comma.txt"),
             folder);
    if (system(command) < 0) return false; /* it complains of all that such a locale lacks */
    setenv("LOCPATH", folder, 1);
    const bool set = setlocale(LC_NUMERIC, "comma") != NULL;
    unsetenv("LOCPATH");
    snprintf(command, sizeof command, "rm -rf '%s/comma'", folder);
    return system(command) == 0 && set;
}

static void numbers_do_not_depend_on_the_locale(void **unused)
{
    (void)unused;
    sample_bytes ply = sample_ply(SAMPLE_PLY_ASCII); /* that would write commas, too */
    if (!set_comma()) {
        sample_free(&ply);
        skip();
    }
    assert_string_equal(localeconv()->decimal_point, ",");
    obj_values(NULL);
    check_ply(ply);
    /* One with so many digits that it goes another way. */
    static const char text[] =
        "v 0.12345678901234567890123 -2.50000000000000000000001e-1 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    ca_mesh mesh;
    ca_error error = {{0}};
    if (import_bytes("l.obj", text, sizeof text - 1, &mesh, &error) != CA_OK) fail_msg("%s", error.message);
    assert_true(mesh.positions[0] == 0.12345679f && mesh.positions[1] == -0.25f);
    ca_mesh_destroy(&mesh);
}

static int restore_locale(void **unused)
{
    (void)unused;
    return setlocale(LC_ALL, "C") ? 0 : -1;
}

/* Short, long, and awkward numbers, against strtof in the C locale. */
static void numbers_are_rounded_as_strtof_does(void **unused)
{
    (void)unused;
    static const char *const numbers[] = {"0",
                                          "-0",
                                          "1",
                                          ".5",
                                          "5.",
                                          "123456789012345",
                                          "0.12345678901",
                                          "0.123456789012",
                                          "1e10",
                                          "-1.5E-20",
                                          "+3",
                                          "1e-45",
                                          "3.4028235e38",
                                          "-3.40282356e38",
                                          "0.1",
                                          "16777217",
                                          "-0.000001",
                                          "9007199254740993",
                                          "3.14159265358979323846264338327950288",
                                          "1.1754943508e-38",
                                          "00001.5000"};
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; ++i) {
        char text[256];
        snprintf(text, sizeof text, "v %s 0 0\nf 1 1 1\n", numbers[i]);
        ca_mesh mesh;
        ca_error error = {{0}};
        if (import_bytes("n.obj", text, strlen(text), &mesh, &error) != CA_OK) fail_msg("%s", error.message);
        const float expected = strtof(numbers[i], NULL);
        if (memcmp(&mesh.positions[0], &expected, sizeof expected) != 0) fail_msg("%s", numbers[i]);
        ca_mesh_destroy(&mesh);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(obj_values),
        cmocka_unit_test(obj_splits_vertices_only_where_corners_differ),
        cmocka_unit_test(obj_of_many_vertices),
        cmocka_unit_test(obj_fills_missing_normals_and_colours),
        cmocka_unit_test(a_byte_order_mark_is_skipped),
        cmocka_unit_test(obj_errors_name_the_place),
        cmocka_unit_test(ply_ascii),
        cmocka_unit_test(ply_little_endian),
        cmocka_unit_test(ply_big_endian),
        cmocka_unit_test(ply_corners),
        cmocka_unit_test(ply_attribute_names),
        cmocka_unit_test(ply_errors_name_the_place),
        cmocka_unit_test(serialized_3_float),
        cmocka_unit_test(serialized_3_double),
        cmocka_unit_test(serialized_4_float),
        cmocka_unit_test(serialized_4_double),
        cmocka_unit_test(serialized_flags_and_errors),
        cmocka_unit_test(truncated_files_are_refused),
        cmocka_unit_test(every_allocation_may_fail),
        cmocka_unit_test_teardown(numbers_do_not_depend_on_the_locale, restore_locale),
        cmocka_unit_test(numbers_are_rounded_as_strtof_does),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
