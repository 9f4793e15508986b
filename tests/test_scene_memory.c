#define _DEFAULT_SOURCE
/* Scenes from memory are those from files, to the bit; views share what they do not change; pictures of the caller's
 * own. */
#include "base/memory.h"
#include "support/scene_text.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <stdlib.h>
#include <unistd.h>

#include <cmocka.h>

#define SENSOR(x)                                                                                                  \
    "<sensor type='perspective'><float name='fov' value='40'/><transform name='to_world'>"                         \
    "<lookat origin='" x ", 1, -4' target='0, 0, 0' up='0, 1, 0'/></transform>"                                    \
    "<film type='hdrfilm'><integer name='width' value='24'/><integer name='height' value='16'/></film></sensor>"
#define LIGHT "<emitter type='point'><point name='position' value='1, 2, -3'/></emitter>"
#define PATH "<integrator type='path'><integer name='max_depth' value='3'/></integrator>"
#define MESH "<shape type='mesh'><string name='data' value='square'/>"
#define END "</shape></scene>"
#define START "<scene version='3.0.0'>" SENSOR("1") LIGHT PATH

static const float positions[] = {-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0};
static const float normals[] = {0, 0, -1, 0, 0, -3, 0.5f, 0, -1, 0, 0, -1};
static const float uvs[] = {0, 0, 1, 0, 1, 1, 0, 1};
static const uint32_t indices[] = {0, 2, 1, 0, 3, 2};
static const float pixels[] = {0.1f, 0.9f, 0.5f, 0.2f, 0.7f, 0.3f};

static const ca_mesh_data square = {.name = "square",
                                    .vertex_count = 4,
                                    .triangle_count = 2,
                                    .positions = positions,
                                    .normals = normals,
                                    .uvs = uvs,
                                    .indices = indices};
static const ca_bitmap_data picture = {.name = "picture", .width = 3, .height = 2, .channels = 1, .pixels = pixels};

static ca_scene_source source_of(const char *text, const ca_mesh_data *mesh, const ca_bitmap_data *bitmap)
{
    return (ca_scene_source){.text = text,
                             .size = strlen(text),
                             .path = "scene",
                             .meshes = mesh,
                             .mesh_count = mesh ? 1 : 0,
                             .bitmaps = bitmap,
                             .bitmap_count = bitmap ? 1 : 0};
}

static ca_scene *parse(const char *text, const ca_mesh_data *mesh, const ca_bitmap_data *bitmap)
{
    const ca_scene_source source = source_of(text, mesh, bitmap);
    ca_scene *scene;
    ca_error error = {""};
    if (ca_scene_parse(&source, &scene, &error) != CA_OK) fail_msg("%s", error.message);
    return scene;
}

static void assert_refused(const char *text, const ca_mesh_data *mesh, const ca_bitmap_data *bitmap,
                           ca_status expected, const char *words)
{
    const ca_scene_source source = source_of(text, mesh, bitmap);
    ca_scene *scene;
    ca_error error = {""};
    assert_int_equal(ca_scene_parse(&source, &scene, &error), expected);
    assert_null(scene);
    if (!strstr(error.message, words)) fail_msg("\"%s\" instead of \"%s\"", error.message, words);
}

static uint64_t picture_of(ca_scene *scene)
{
    const ca_render_settings settings = {.samples_per_pixel = 4, .threads = 1};
    const uint64_t hash = rendered_hash(scene, &settings);
    ca_scene_release(scene);
    return hash;
}

/* ---- Arrays ---------------------------------------------------------------------------------------------------- */

static void write_text(const char *path, const char *text)
{
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    assert_true(fputs(text, file) >= 0);
    assert_int_equal(fclose(file), 0);
}

/* The same mesh as a PLY file, with and without normals. */
static uint64_t picture_with_file(bool with_normals, const char *inside)
{
    char path[] = "/tmp/caustica-memory-XXXXXX", text[4096], ply[2048];
    const int file = mkstemp(path);
    assert_true(file >= 0);
    close(file);
    size_t used = (size_t)snprintf(ply, sizeof ply,
                                   "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
                                   "property float z\n%sproperty float u\nproperty float v\nelement face 2\n"
                                   "property list uchar int vertex_indices\nend_header\n",
                                   with_normals ? "property float nx\nproperty float ny\nproperty float nz\n" : "");
    for (size_t v = 0; v < 4; v++) {
        const float *p = &positions[3 * v], *n = &normals[3 * v], *uv = &uvs[2 * v];
        used +=
            (size_t)snprintf(ply + used, sizeof ply - used, "%g %g %g ", (double)p[0], (double)p[1], (double)p[2]);
        if (with_normals)
            used += (size_t)snprintf(ply + used, sizeof ply - used, "%.9g %.9g %.9g ", (double)n[0], (double)n[1],
                                     (double)n[2]);
        used += (size_t)snprintf(ply + used, sizeof ply - used, "%g %g\n", (double)uv[0], (double)uv[1]);
    }
    snprintf(ply + used, sizeof ply - used, "3 0 2 1\n3 0 3 2\n");
    write_text(path, ply);
    snprintf(text, sizeof text, START "<shape type='ply'><string name='filename' value='%s'/>%s" END, path, inside);
    const uint64_t hash = picture_of(parse(text, NULL, NULL));
    unlink(path);
    return hash;
}

static uint64_t picture_with_arrays(const char *inside)
{
    char text[2048];
    snprintf(text, sizeof text, START MESH "%s" END, inside);
    return picture_of(parse(text, &square, NULL));
}

static void test_mesh(void **state)
{
    (void)state;
    static const char flat[] = "<boolean name='face_normals' value='true'/>";
    ca_mesh_data without_normals = square;
    without_normals.normals = NULL;
    const uint64_t smooth = picture_of(parse(START MESH END, &square, NULL));
    assert_true(smooth == picture_with_file(true, ""));
    assert_true(picture_of(parse(START MESH END, &without_normals, NULL)) == picture_with_file(false, ""));
    static const char squares[] =
        "<bsdf type='diffuse'><texture name='reflectance' type='checkerboard'><transform name='to_uv'>"
        "<scale value='3'/></transform></texture></bsdf>";
    assert_true(picture_with_arrays(flat) == picture_with_file(true, flat));
    assert_true(picture_with_arrays(squares) == picture_with_file(true, squares));
    assert_true(smooth != picture_with_file(true, flat));
}

#define TEXTURED(bitmap)                                                                                           \
    MESH "<bsdf type='diffuse'><texture name='reflectance' type='bitmap'>" bitmap "</texture></bsdf>" END

static void test_bitmap(void **state)
{
    (void)state;
    char path[] = "/tmp/caustica-memory-XXXXXX.pfm", text[4096];
    const int file = mkstemps(path, 4);
    assert_true(file >= 0);
    close(file);
    ca_image_layers *image;
    assert_int_equal(ca_image_make(3, 2, &image, NULL), CA_OK);
    for (int c = 0; c < 3; c++)
        assert_int_equal(ca_image_add(image, (const char *[]){"R", "G", "B"}[c], pixels, NULL), CA_OK);
    assert_int_equal(ca_image_save(image, path, 0.0f, NULL), CA_OK);
    ca_image_release(image);
    snprintf(text, sizeof text, START TEXTURED("<string name='filename' value='%s'/>"), path);
    const uint64_t from_file = picture_of(parse(text, &square, NULL));
    const char *in_memory = START TEXTURED("<string name='data' value='picture'/>");
    assert_true(picture_of(parse(in_memory, &square, &picture)) == from_file);
    const char *sky = START MESH
        "</shape><emitter type='envmap'><string name='data' value='picture'/></emitter></scene>";
    assert_true(picture_of(parse(sky, &square, &picture)) != from_file);

    /* An array that is called as the file is another picture. */
    static const float dark[6] = {0};
    ca_bitmap_data same_name = picture;
    same_name.name = path;
    same_name.pixels = dark;
    const char *lit = START "<texture id='dark' type='bitmap'><string name='data' value='%s'/></texture>" TEXTURED(
        "<string name='filename' value='%s'/>");
    snprintf(text, sizeof text, lit, path, path);
    assert_true(picture_of(parse(text, &square, &same_name)) == from_file);
    unlink(path);
}

static void test_wrong_arrays(void **state)
{
    (void)state;
    static const float not_finite[] = {-1, -1, 0, 1, NAN, 0, 1, 1, 0, -1, 1, 0};
    static const uint32_t too_large[] = {0, 2, 1, 0, 4, 2};
    ca_mesh_data mesh = square;
    assert_refused(START MESH END, NULL, NULL, CA_ERROR_SCENE, "scene:1:");
    assert_refused(START MESH END, NULL, NULL, CA_ERROR_SCENE, "there is no mesh \"square\": none is given");
    mesh.name = "squares";
    assert_refused(START MESH END, &mesh, NULL, CA_ERROR_SCENE, "the nearest name is \"squares\"");
    mesh = square, mesh.positions = not_finite;
    assert_refused(START MESH END, &mesh, NULL, CA_ERROR_FORMAT, "square: the position of vertex 1");
    mesh = square, mesh.indices = too_large;
    assert_refused(START MESH END, &mesh, NULL, CA_ERROR_FORMAT, "square: triangle 1 uses vertex 4");
    mesh = square, mesh.indices = NULL;
    assert_refused(START MESH END, &mesh, NULL, CA_ERROR_ARGUMENT, "has no indices");
    mesh = square, mesh.triangle_count = 0;
    assert_refused(START MESH END, &mesh, NULL, CA_ERROR_FORMAT, "no faces");
    mesh = square, mesh.vertex_count = SIZE_MAX / 2;
    assert_refused(START MESH END, &mesh, NULL, CA_ERROR_UNSUPPORTED, "limit");
    assert_refused(START "<shape type='mesh'/></scene>", &square, NULL, CA_ERROR_SCENE, "must name a mesh");

    ca_bitmap_data bitmap = picture;
    const char *textured = START TEXTURED("<string name='data' value='picture'/>");
    assert_refused(textured, &square, NULL, CA_ERROR_SCENE, "there is no bitmap \"picture\"");
    bitmap.channels = 5;
    assert_refused(textured, &square, &bitmap, CA_ERROR_ARGUMENT, "5 channels");
    bitmap = picture, bitmap.width = 0;
    assert_refused(textured, &square, &bitmap, CA_ERROR_ARGUMENT, "0 x 2 pixels");
    bitmap = picture, bitmap.pixels = not_finite;
    assert_refused(textured, &square, &bitmap, CA_ERROR_ARGUMENT, "not finite, number 4");
    assert_refused(START TEXTURED("<string name='data' value='picture'/><string name='filename' value='a.png'/>"),
                   &square, &picture, CA_ERROR_SCENE, "excludes data");
}

/* A scene is another one with other numbers in its arrays. */
static uint64_t hash_of_numbers(const ca_mesh_data *mesh, const ca_bitmap_data *bitmap)
{
    return picture_of(parse(START TEXTURED("<string name='data' value='picture'/>"), mesh, bitmap));
}

static void test_numbers_count(void **state)
{
    (void)state;
    float moved[12], brighter[6];
    memcpy(moved, positions, sizeof moved);
    memcpy(brighter, pixels, sizeof brighter);
    moved[0] -= 0.5f;
    brighter[3] += 0.5f;
    ca_mesh_data mesh = square;
    ca_bitmap_data bitmap = picture;
    const uint64_t before = hash_of_numbers(&square, &picture);
    mesh.positions = moved;
    assert_true(hash_of_numbers(&mesh, &picture) != before);
    bitmap.pixels = brighter;
    assert_true(hash_of_numbers(&square, &bitmap) != before);
    assert_true(hash_of_numbers(&square, &picture) == before);
}

static void test_out_of_memory(void **state)
{
    (void)state;
    const char *text = START TEXTURED("<string name='data' value='picture'/>");
    const ca_scene_source source = source_of(text, &square, &picture);
    long failures = 0;
    for (ca_status status = CA_ERROR_MEMORY; status != CA_OK; failures++) {
        ca_scene *scene = NULL;
        ca_memory_fail_after(failures);
        status = ca_scene_parse(&source, &scene, NULL);
        ca_memory_fail_after(-1);
        assert_true(status == CA_OK || status == CA_ERROR_MEMORY);
        ca_scene_release(scene);
    }
    assert_true(failures > 20);
}

/* ---- Views ----------------------------------------------------------------------------------------------------- */

static ca_scene *view_of(ca_scene *scene, const char *text)
{
    const ca_scene_source source = source_of(text, NULL, NULL);
    ca_scene *view;
    ca_error error = {""};
    if (ca_scene_view(scene, &source, &view, &error) != CA_OK) fail_msg("%s", error.message);
    return view;
}

static void assert_view_refused(ca_scene *scene, const char *text, const char *words)
{
    const ca_scene_source source = source_of(text, NULL, NULL);
    ca_scene *view;
    ca_error error = {""};
    assert_int_equal(ca_scene_view(scene, &source, &view, &error), CA_ERROR_SCENE);
    assert_null(view);
    if (!strstr(error.message, words)) fail_msg("\"%s\" instead of \"%s\"", error.message, words);
}

#define ELSEWHERE "<scene version='3.0.0'>" SENSOR("-2") LIGHT
#define BDPT "<integrator type='bdpt'><integer name='max_depth' value='4'/></integrator>"

/* A view is what a scene with that sensor would be; whole, view and view of the view end in any order. */
static void test_views(void **state)
{
    (void)state;
    const uint64_t before = picture_of(parse(START MESH END, &square, NULL));
    const uint64_t elsewhere = picture_of(parse(ELSEWHERE PATH MESH END, &square, NULL));
    const uint64_t other_method = picture_of(parse(ELSEWHERE BDPT MESH END, &square, NULL));
    assert_true(before != elsewhere && elsewhere != other_method);

    ca_scene *scene = parse(START MESH END, &square, NULL);
    ca_scene *view = view_of(scene, "<scene version='3.0.0'>" SENSOR("-2") "</scene>");
    ca_scene *second = view_of(view, "<scene version='3.0.0'>" SENSOR("-2") BDPT "</scene>");
    ca_scene *third = view_of(second, "<scene version='3.0.0'>" SENSOR("1") "</scene>");
    ca_scene *fourth = view_of(third, "<scene version='3.0.0'>" SENSOR("-2") "</scene>");
    ca_scene_release(third);
    assert_true(picture_of(scene) == before);
    assert_true(picture_of(second) == other_method);
    assert_true(picture_of(view) == elsewhere);
    assert_true(picture_of(fourth) == other_method); /* the method is that of `second`, which is gone */
}

static void test_wrong_views(void **state)
{
    (void)state;
    ca_scene *scene = parse(START MESH END, &square, NULL);
    static const char nothing_else[] = "a sensor and an integrator, and nothing else";
    assert_view_refused(scene, ELSEWHERE "</scene>", nothing_else);
    assert_view_refused(scene, "<scene version='3.0.0'>" SENSOR("1") "<shape type='sphere'/></scene>", nothing_else);
    assert_view_refused(scene, "<scene version='3.0.0'>" SENSOR("1") "<bsdf type='diffuse'/></scene>", nothing_else);
    assert_view_refused(scene, "<scene version='3.0.0'/>", "no <sensor>");
    assert_view_refused(scene, "<scene version='3.0.0'>" SENSOR("1e19") "</scene>", "the scene reaches 1e+19");
    assert_view_refused(scene, "<scene version='3.0.0'><sensor type='perspectiv'/></scene>", "\"perspective\"");
    ca_scene_release(scene);
}

static void test_view_out_of_memory(void **state)
{
    (void)state;
    ca_scene *scene = parse(START MESH END, &square, NULL);
    const ca_scene_source source = source_of("<scene version='3.0.0'>" SENSOR("-2") BDPT "</scene>", NULL, NULL);
    long failures = 0;
    for (ca_status status = CA_ERROR_MEMORY; status != CA_OK; failures++) {
        ca_scene *view = NULL;
        ca_memory_fail_after(failures);
        status = ca_scene_view(scene, &source, &view, NULL);
        ca_memory_fail_after(-1);
        assert_true(status == CA_OK || status == CA_ERROR_MEMORY);
        ca_scene_release(view);
    }
    assert_true(failures > 5);
    ca_scene_release(scene);
}

/* ---- Rays ------------------------------------------------------------------------------------------------------ */

static ca_ray ray_from(float x, float y, float z, float dz)
{
    return (ca_ray){.origin = {x, y, z}, .direction = {0.0f, 0.0f, dz}, .t_max = 100.0f};
}

/* A square at z = 0, a sphere of radius 1 around z = 5, and an instance of another one around z = 9. */
#define SOLIDS                                                                                                     \
    "<shape type='shapegroup' id='group'><shape type='sphere' id='inner'/></shape>" MESH "</shape>"                \
    "<shape type='sphere' id='ball'><point name='center' x='0' y='0' z='5'/></shape>"                          \
    "<shape type='shapegroup' id='none'/><shape type='instance' id='nothing'><ref id='none'/></shape>"            \
    "<shape type='instance' id='far'><ref id='group'/><transform name='to_world'><translate z='9'/></transform>"  \
    "</shape></scene>"

static void test_rays(void **state)
{
    (void)state;
    ca_scene *scene = parse(START SOLIDS, &square, NULL);
    const ca_ray rays[] = {
        ray_from(0.5f, 0.25f, -4.0f, 2.0f), ray_from(0.0f, 0.0f, 7.0f, -1.0f), ray_from(0.0f, 0.0f, 20.0f, -1.0f),
        ray_from(3.0f, 0.0f, -4.0f, 1.0f),  ray_from(NAN, 0.0f, 0.0f, 1.0f),   ray_from(0.5f, 0.25f, -4.0f, 0.0f),
    };
    enum { COUNT = sizeof rays / sizeof *rays };
    ca_ray_hit hits[COUNT];
    bool occluded[COUNT];
    ca_scene_intersect(scene, rays, COUNT, hits);
    ca_scene_occluded(scene, rays, COUNT, occluded);
    for (int i = 0; i < COUNT; i++) assert_true(occluded[i] == (i < 3) && isfinite(hits[i].t) == (i < 3));

    assert_true(fabsf(hits[0].t - 2.0f) < 1e-6f && fabsf(hits[0].uv[0] - 0.75f) < 1e-6f);
    assert_true(fabsf(hits[0].position[0] - 0.5f) < 1e-6f && fabsf(hits[0].uv[1] - 0.625f) < 1e-6f);
    assert_true(fabsf(hits[0].normal[2] + 1.0f) < 1e-6f && hits[0].shading_normal[2] > -1.0f);
    assert_int_equal(hits[0].primitive, 0);
    assert_null(ca_scene_shape_id(scene, hits[0].shape));
    assert_true(fabsf(hits[1].t - 1.0f) < 1e-6f && fabsf(hits[1].normal[2] - 1.0f) < 1e-6f);
    assert_string_equal(ca_scene_shape_id(scene, hits[1].shape), "ball");
    assert_int_equal(hits[1].instance, UINT32_MAX);
    assert_true(fabsf(hits[2].t - 10.0f) < 1e-5f && fabsf(hits[2].position[2] - 10.0f) < 1e-5f);
    assert_string_equal(ca_scene_shape_id(scene, hits[2].shape), "inner");
    assert_int_equal(hits[2].instance, 0);
    assert_int_equal(hits[3].shape, UINT32_MAX);
    assert_null(ca_scene_shape_id(scene, 99));
    assert_string_equal(ca_scene_instance_id(scene, 0), "far");
    assert_null(ca_scene_instance_id(scene, 1));
    assert_null(ca_scene_instance_id(scene, UINT32_MAX));
    ca_scene_release(scene);
}

/* ---- Pictures -------------------------------------------------------------------------------------------------- */

enum { SIDE = 16 };

static ca_image_layers *grey(float value)
{
    float values[SIDE * SIDE];
    for (int i = 0; i < SIDE * SIDE; i++) values[i] = value;
    ca_image_layers *image;
    assert_int_equal(ca_image_make(SIDE, SIDE, &image, NULL), CA_OK);
    for (int c = 0; c < 3; c++)
        assert_int_equal(ca_image_add(image, (const char *[]){"R", "G", "B"}[c], values, NULL), CA_OK);
    return image;
}

static void test_pictures(void **state)
{
    (void)state;
    char path[] = "/tmp/caustica-memory-XXXXXX.exr";
    const int file = mkstemps(path, 4);
    assert_true(file >= 0);
    close(file);
    ca_error error;
    ca_image_layers *image = grey(0.5f), *loaded;
    assert_int_equal(ca_image_channel_count(image), 3);
    assert_string_equal(ca_image_channel_name(image, 1), "G");
    assert_null(ca_image_channel_name(image, 3));
    assert_int_equal(ca_image_add(image, "G", pixels, &error), CA_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, "\"G\" already"));
    assert_int_equal(ca_image_add(image, "", pixels, &error), CA_ERROR_ARGUMENT);
    assert_int_equal(ca_image_save(image, path, 0.0f, NULL), CA_OK);
    assert_int_equal(ca_image_load(path, &loaded, NULL), CA_OK);
    assert_true(image_hash(image) == image_hash(loaded));
    ca_image_release(loaded);
    unlink(path);
    assert_int_equal(ca_image_load(path, &loaded, &error), CA_ERROR_FILE);
    assert_null(loaded);
    assert_int_equal(ca_image_make(0, 1, &loaded, &error), CA_ERROR_ARGUMENT);
    assert_int_equal(ca_image_make(1u << 30, 1u << 30, &loaded, &error), CA_ERROR_ARGUMENT);
    ca_image_release(image);
}

static void test_attributes(void **state)
{
    (void)state;
    ca_scene *scene = parse(START MESH END, &square, NULL);
    const ca_render_settings settings = {.samples_per_pixel = 4, .threads = 1};
    ca_image_layers *image = render_scene(scene, &settings);
    const char *name, *text;
    double number;
    bool found = false;
    size_t i = 0;
    for (; ca_image_attribute(image, i, &name, &text, &number); i++)
        found = found || (strcmp(name, "caustica.integrator") == 0 && strncmp(text, "path", 4) == 0);
    assert_true(found && i > 3);
    ca_image_release(image);
    ca_scene_release(scene);
}

static void test_difference(void **state)
{
    (void)state;
    ca_image_layers *half = grey(0.5f), *more = grey(0.75f), *small;
    ca_image_difference d;
    assert_int_equal(ca_image_compare(more, half, &d, NULL), CA_OK);
    assert_true(fabs(d.rmse - 0.25) < 1e-9);
    assert_true(fabs(d.mae - 0.25) < 1e-9);
    assert_true(fabs(d.relmse - 0.0625 / 0.26) < 1e-9);
    assert_true(fabs(d.smape - 0.25 / 1.26) < 1e-9);
    assert_int_equal(d.pixels, SIDE * SIDE);
    assert_true(d.ssim > 0.5 && d.ssim < 1.0 && d.flip_ldr > 0.01 && d.flip_hdr > 0.01);
    assert_true(fabs(d.mean_luminance - 0.75) < 1e-6);
    assert_int_equal(d.blocks, 0); /* neither carries its variance */
    assert_true(isnan(d.p_value));
    assert_int_equal(ca_image_compare(half, half, &d, NULL), CA_OK);
    assert_true(d.rmse == 0.0 && d.ssim == 1.0 && d.flip_ldr == 0.0);
    static const uint32_t corner[4] = {0, 1, 5, 3}, outside[4] = {0, 0, SIDE + 1, 1}, empty[4] = {2, 2, 2, 3};
    assert_int_equal(ca_image_compare_within(more, half, corner, NULL, &d, NULL), CA_OK);
    assert_true(d.pixels == 10 && fabs(d.rmse - 0.25) < 1e-9);
    assert_int_equal(ca_image_compare_within(more, half, outside, NULL, &d, NULL), CA_ERROR_ARGUMENT);
    assert_int_equal(ca_image_compare_within(more, half, empty, NULL, &d, NULL), CA_ERROR_ARGUMENT);
    assert_int_equal(ca_image_make(2, 2, &small, NULL), CA_OK);
    assert_int_equal(ca_image_compare(small, half, &d, NULL), CA_ERROR_ARGUMENT);
    ca_image_release(half);
    ca_image_release(more);
    ca_image_release(small);
}

/* Noise is what tells them apart. */
static void test_noisy_difference(void **state)
{
    (void)state;
    ca_scene *scene = parse(START MESH END, &square, NULL);
    ca_render_settings settings = {.samples_per_pixel = 16, .threads = 1};
    ca_image_layers *first = render_scene(scene, &settings);
    settings.seed = 1, settings.has_seed = true;
    ca_image_layers *second = render_scene(scene, &settings);
    ca_image_difference d;
    assert_int_equal(ca_image_compare(first, second, &d, NULL), CA_OK);
    assert_true(d.blocks > 0 && d.blocks_rejected < d.blocks && d.p_value > 0.001);
    assert_true(d.rmse > 0.0 && d.detectable_bias > 0.0);
    ca_image_release(first);
    ca_image_release(second);
    ca_scene_release(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_mesh),          cmocka_unit_test(test_bitmap),
        cmocka_unit_test(test_wrong_arrays),  cmocka_unit_test(test_numbers_count),
        cmocka_unit_test(test_out_of_memory), cmocka_unit_test(test_views),
        cmocka_unit_test(test_wrong_views),   cmocka_unit_test(test_view_out_of_memory),
        cmocka_unit_test(test_rays),
        cmocka_unit_test(test_pictures),      cmocka_unit_test(test_attributes),
        cmocka_unit_test(test_difference),    cmocka_unit_test(test_noisy_difference),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
