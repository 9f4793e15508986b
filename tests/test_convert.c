/* caustica convert: the written scene renders to the same bits, is written again as it is, and never overwrites what
 * it is read from. */
#define _XOPEN_SOURCE 700
#include "base/file.h"
#include "base/memory.h"
#include "import/import.h"
#include "render/render.h"
#include "support/program_test.h"

#include <dirent.h>
#include <ftw.h>
#include <math.h>
#include <stdlib.h>
#include <sys/stat.h>

/* ---- Scenes and their pictures --------------------------------------------------------------------------------- */

static void convert(const ca_scene_source *source, const char *to)
{
    ca_scene_desc desc;
    ca_error error = {""};
    if (ca_import_convert(source, to, &desc, &error) != CA_OK) fail_msg("%s: %s", source->path, error.message);
    ca_scene_desc_destroy(&desc);
}

static void convert_file(const char *from, const char *to)
{
    const ca_scene_source source = {.path = from};
    convert(&source, to);
}

/* One sample a pixel of a small picture, of the whole film. */
static ca_image_layers *render_source(const ca_scene_source *source)
{
    ca_scene *scene = NULL;
    ca_image_layers *image = NULL;
    ca_error error = {""};
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.integrator = "path:max_depth=4";
    settings.max_depth = 4;
    settings.has_max_depth = true;
    settings.sampler = "independent";
    settings.samples_per_pixel = 1;
    settings.width = 24;
    settings.height = 18;
    settings.has_crop = true;
    memcpy(settings.crop, (uint32_t[4]){0, 0, 24, 18}, sizeof settings.crop);
    settings.threads = 1;
    if (ca_scene_parse(source, &scene, &error) != CA_OK) fail_msg("%s: %s", source->path, error.message);
    if (ca_render(scene, &settings, &image, NULL, &error) != CA_OK) fail_msg("%s: %s", source->path, error.message);
    ca_scene_release(scene);
    return image;
}

static void compare_images(const ca_image_layers *a, const ca_image_layers *b, const char *path)
{
    static const char *const names[] = {"R", "G", "B", "Albedo.G", "N.X", "P.Z"};
    bool lit = false;
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        const float *x = ca_layers_find(a, names[i]), *y = ca_layers_find(b, names[i]);
        assert_true((x != NULL) == (y != NULL) && (x || i > 2));
        for (size_t k = 0; x && k < 24 * 18; k++) {
            lit |= x[k] != 0.0f;
            if (memcmp(&x[k], &y[k], sizeof *x) != 0)
                fail_msg("%s: pixel %zu of %s is %.9g, and %.9g when converted", path, k, names[i], (double)x[k],
                         (double)y[k]);
        }
    }
    if (!lit) fail_msg("%s: the picture is black", path);
}

static char *read_text(const char *path)
{
    ca_bytes bytes;
    ca_error error = {""};
    if (ca_file_read(path, "file", 1 << 28, &bytes, &error) != CA_OK) fail_msg("%s", error.message);
    return (char *)bytes.data;
}

/* Files of one name in two folders. */
static void compare_files(const char *a, const char *b, const char *name)
{
    char first[512], second[512];
    ca_bytes x, y;
    ca_error error = {""};
    snprintf(first, sizeof first, "%s/%s", a, name);
    snprintf(second, sizeof second, "%s/%s", b, name);
    assert_int_equal(ca_file_read(first, "file", 1 << 28, &x, &error), CA_OK);
    if (ca_file_read(second, "file", 1 << 28, &y, &error) != CA_OK) fail_msg("%s", error.message);
    if (x.size != y.size || memcmp(x.data, y.data, x.size) != 0) fail_msg("%s and %s differ", first, second);
    ca_bytes_destroy(&x);
    ca_bytes_destroy(&y);
}

static size_t compare_folders(const char *a, const char *b)
{
    size_t count = 0;
    DIR *folder = opendir(a);
    for (const struct dirent *entry; folder && (entry = readdir(folder)) != NULL;) {
        if (entry->d_name[0] == '.') continue;
        compare_files(a, b, entry->d_name);
        count++;
    }
    if (folder) closedir(folder);
    return count;
}

/* Converts, compares pictures, converts again, compares all files. */
static size_t check_source(void **state, const ca_scene_source *source)
{
    char once[256], twice[256], once_files[256], twice_files[256];
    snprintf(once, sizeof once, "%s/once/scene.xml", folder_of(state));
    snprintf(twice, sizeof twice, "%s/twice/scene.xml", folder_of(state));
    snprintf(once_files, sizeof once_files, "%s/once/scene-files", folder_of(state));
    snprintf(twice_files, sizeof twice_files, "%s/twice/scene-files", folder_of(state));
    char command[256];
    snprintf(command, sizeof command, "cd %s && rm -rf once twice && mkdir once twice", folder_of(state));
    assert_int_equal(system(command), 0);
    const ca_scene_source written = {.path = once};
    convert(source, once);
    ca_image_layers *before = render_source(source), *after = render_source(&written);
    compare_images(before, after, source->path);
    ca_image_release(before);
    ca_image_release(after);
    convert_file(once, twice);
    char folder[2][256];
    snprintf(folder[0], sizeof folder[0], "%s/once", folder_of(state));
    snprintf(folder[1], sizeof folder[1], "%s/twice", folder_of(state));
    compare_files(folder[0], folder[1], "scene.xml");
    const size_t count = compare_folders(once_files, twice_files);
    assert_int_equal(count, compare_folders(twice_files, once_files));
    return count;
}

/* ---- Bundled scenes -------------------------------------------------------------------------------------------- */

static char *scene_paths[256];
static size_t scene_count;

static int collect(const char *path, const struct stat *info, int kind, struct FTW *place)
{
    (void)info, (void)place;
    if (kind != FTW_F || strcmp(ca_path_extension(path), ".xml") != 0 || scene_count == 256) return 0;
    char *text = read_text(path);
    const bool whole = strstr(text, "<scene") && strstr(text, "sensor") &&
                       (strstr(text, "<shape") || strstr(text, "<include"));
    ca_free(text);
    if (whole) scene_paths[scene_count++] = strdup(path);
    return 0;
}

static int by_name(const void *a, const void *b) { return strcmp(*(char *const *)a, *(char *const *)b); }

static void test_bundled_scenes(void **state)
{
    size_t files = 0;
    assert_int_equal(nftw(CA_SOURCE_DIR "/scenes", collect, 8, FTW_PHYS), 0);
    assert_int_equal(nftw(CA_SOURCE_DIR "/tests/mitsuba", collect, 8, FTW_PHYS), 0);
    assert_in_range(scene_count, 50, 255);
    qsort(scene_paths, scene_count, sizeof *scene_paths, by_name);
    for (size_t i = 0; i < scene_count; i++) {
        const ca_scene_source source = {.path = scene_paths[i]};
        files += check_source(state, &source);
        free(scene_paths[i]);
    }
    assert_in_range(files, 20, 1000);
}

/* ---- All spellings, and arrays --------------------------------------------------------------------------------- */

static const char old_text[] =
    "<scene version=\"0.6.0\"><default name=\"grey\" value=\"0.4\"/>\n"
    "<sensor type=\"perspective\"><float name=\"fov\" value=\"50\"/>\n"
    "<transform name=\"toWorld\"><lookAt origin=\"0.5,0.5,3\" target=\"0.5,0.5,0\" up=\"0,1,0\"/></transform>\n"
    "<film type=\"ldrfilm\"><boolean name=\"banner\" value=\"false\"/><float name=\"gamma\" value=\"2.2\"/></film>\n"
    "<sampler type=\"ldsampler\"/></sensor>\n"
    "<integrator type=\"ppm\"><float name=\"alpha\" value=\"0.75\"/></integrator>\n"
    "<texture type=\"bitmap\" id=\"dots.map\"><string name=\"filename\" value=\"dots.pfm\"/>\n"
    "<float name=\"uscale\" value=\"3\"/><float name=\"vscale\" value=\"2\"/><float name=\"uoffset\" "
    "value=\"0.1\"/>\n"
    "<transform name=\"to_uv\"><rotate z=\"1\" angle=\"30\"/></transform><float name=\"gamma\" value=\"1\"/>\n"
    "<string name=\"filterType\" value=\"ewa\"/><float name=\"maxAnisotropy\" value=\"4\"/>\n"
    "<string name=\"wrapModeU\" value=\"mirror\"/><string name=\"wrapModeV\" value=\"mirror\"/></texture>\n"
    "<alias id=\"dots.map\" as=\"other\"/>\n"
    "<bsdf type=\"diffuse\" id=\"dotted\"><ref name=\"diffuseReflectance\" id=\"other\"/></bsdf>\n"
    "<bsdf type=\"roughconductorGGX\" id=\"metal\"><float name=\"alpha\" value=\"0.3\"/></bsdf>\n"
    "<bsdf type=\"diffuse\" id=\"sp\\$ots\"><texture type=\"bitmap\" name=\"reflectance\"><string name=\"data\" "
    "value=\"a \\$ &lt;b&gt;\"/></texture></bsdf>\n"
    "<shape type=\"obj\"><string name=\"filename\" value=\"corner.obj\"/><ref id=\"dotted\"/></shape>\n"
    "<shape type=\"obj\"><string name=\"filename\" value=\"corner.obj\"/><boolean name=\"faceNormals\" "
    "value=\"true\"/>\n"
    "<transform name=\"toWorld\"><translate x=\"0.7\"/></transform><ref id=\"metal\"/></shape>\n"
    "<shape type=\"mesh\" id=\"$grey\"><string name=\"data\" value=\"a\\$\"/>\n"
    "<boolean name=\"flip_tex_coords\" value=\"true\"/><transform name=\"toWorld\"><translate "
    "y=\"0.6\"/></transform>\n"
    "<ref id=\"sp\\$ots\"/></shape>\n"
    "<shape type=\"sphere\"><point name=\"center\" x=\"0.2\" y=\"0.2\" z=\"-1\"/><float name=\"radius\" "
    "value=\"0.6\"/>\n"
    "<bsdf type=\"diffuse\"><srgb name=\"reflectance\" value=\"0.3 $grey 0.9\"/></bsdf></shape>\n"
    "<shape type=\"disk\"><transform name=\"toWorld\"><scale value=\"9\"/><translate z=\"-2\"/></transform>\n"
    "<bsdf type=\"diffuse\"><spectrum name=\"reflectance\" value=\"0.1, 0.6, 0.3\"/></bsdf></shape>\n"
    "<emitter type=\"constant\"><spectrum name=\"radiance\" value=\"0.7\"/></emitter>\n"
    "<emitter type=\"point\"><spectrum name=\"intensity\" filename=\"lamp.spd\"/><point name=\"position\" x=\"1\" "
    "y=\"2\" z=\"3\"/></emitter>\n"
    "</scene>\n";

static void write_old_scene(const char *folder)
{
    static const float dots[2 * 2 * 3] = {1, 0, 0, 0, 1, 0, 0, 0, 1, 0.5f, 0.5f, 0.5f};
    char path[256];
    write_text(folder, "old.xml", old_text);
    write_text(folder, "corner.obj",
               "v 0 0 0 0.1 0.2 0.3\nv 1 0 0 1 1 1\nv 1 1 0 0 0 1\nv 0 1 0.3 1 0 0\nvt 0 0\nvt 1 0\nvt 0 0.75\n"
               "vt 0.3 0.3\nvn 0 0.3 1\nvn 0.1 0.2 1.1\nf 1/1/1 2/2/2 3/3/2\nf 1/1/2 3/3/1 4/4/1\n");
    write_text(folder, "lamp.spd", "400 1\n500 2\n700 4\n");
    snprintf(path, sizeof path, "%s/dots.pfm", folder);
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    fprintf(file, "PF\n2 2\n-1.0\n");
    fwrite(dots, sizeof *dots, 12, file);
    assert_int_equal(fclose(file), 0);
}

/* Normals of any length and pixels of any float. */
static const float corners[] = {0, 0, 0, 0.5f, 0, 0.1f, 0, 0.5f, 0, 0.6f, 0.6f, 0.2f};
static const float normals[] = {0, 0, 2, 0.3f, 0.4f, 1.7f, 0.1f, 0, 1, 1e-3f, 2e-3f, 1e-2f};
static const float uvs[] = {0, 0, 1, 0, 0, 1, 1, 0.3f};
static const uint32_t indices[] = {0, 1, 2, 2, 1, 3};
static const float pixels[] = {0.1f, 0.2f, 0.3f, 0.7f, 1.0f / 3.0f, 0.9f};
static const ca_mesh_data array_mesh = {.name = "a$", .vertex_count = 4, .triangle_count = 2, .positions = corners,
                                        .normals = normals, .uvs = uvs, .indices = indices};
static const ca_bitmap_data array_bitmap = {"a $ <b>", 3, 2, 1, pixels};

static ca_scene_source old_source(const char *path)
{
    return (ca_scene_source){.path = path, .meshes = &array_mesh, .mesh_count = 1, .bitmaps = &array_bitmap,
                             .bitmap_count = 1};
}

static void test_old_spellings_and_arrays(void **state)
{
    char path[256];
    write_old_scene(folder_of(state));
    snprintf(path, sizeof path, "%s/old.xml", folder_of(state));
    const ca_scene_source source = old_source(path);
    /* Two OBJ readings and the array; the bitmap's file and array; the spectrum. */
    assert_int_equal(check_source(state, &source), 6);
    snprintf(path, sizeof path, "%s/once/scene.xml", folder_of(state));
    char *text = read_text(path);
    static const char *const there[] = {
        "<float name=\"alpha\" value=\"0.25\"/>",
        "<scene version=\"3.0.0\">", "<film type=\"hdrfilm\"/>", "type=\"roughconductor\"",
        "<string name=\"distribution\" value=\"ggx\"/>", "<ref name=\"reflectance\" id=\"dots_map\"/>",
        "<string name=\"filename\" value=\"scene-files/corner.ply\"/>",
        "<string name=\"filename\" value=\"scene-files/corner-2.ply\"/>",
        "<string name=\"filename\" value=\"scene-files/dots.pfm\"/>", "scene-files/lamp.spd", "id=\"0_4\"",
        "<bsdf type=\"diffuse\" id=\"sp\\$ots\">", "<ref id=\"sp\\$ots\"/>",
        "<rgb name=\"reflectance\" value=\"0.1, 0.6, 0.3\"/>", "<spectrum name=\"radiance\" value=\"0.7\"/>",
        "<string name=\"wrap_mode\" value=\"mirror\"/>", "<boolean name=\"raw\" value=\"true\"/>"};
    for (size_t i = 0; i < sizeof there / sizeof *there; i++)
        if (!strstr(text, there[i])) fail_msg("%s is not in\n%s", there[i], text);
    static const char *const gone[] = {"srgb", "uscale", "gamma", "obj",      "mesh",
                                       "alias", "grey",  "ewa",   "flip_tex", "toW"};
    for (size_t i = 0; i < sizeof gone / sizeof *gone; i++)
        if (strstr(text, gone[i])) fail_msg("%s is still in\n%s", gone[i], text);
    ca_free(text);
}

/* Ids have no dots behind it, and those that would become the same stay apart. */
static void test_ids_with_dots(void **state)
{
    static const char *const ids[] = {"wall.red", "wall_red", "a.b_c", "a_b.c", "plain.001", "plain_0"};
    char path[256], text[4096];
    int used = snprintf(text, sizeof text, "<scene version=\"3.0.0\"><sensor type=\"perspective\"/>"
                                           "<emitter type=\"constant\"/>\n");
    for (int i = 0; i < 6; i++)
        used += snprintf(text + used, sizeof text - (size_t)used,
                         "<bsdf type=\"diffuse\" id=\"%s\"><rgb name=\"reflectance\" value=\"0.%d\"/></bsdf>\n"
                         "<shape type=\"sphere\"><point name=\"center\" x=\"%d\" y=\"0\" z=\"9\"/>"
                         "<ref id=\"%s\"/></shape>\n",
                         ids[i], i + 1, 3 * i, ids[i]);
    snprintf(text + used, sizeof text - (size_t)used, "</scene>\n");
    write_text(folder_of(state), "dots.xml", text);
    snprintf(path, sizeof path, "%s/dots.xml", folder_of(state));
    const ca_scene_source source = {.path = path};
    check_source(state, &source);
    snprintf(path, sizeof path, "%s/once/scene.xml", folder_of(state));
    char *written = read_text(path);
    static const char *const there[] = {"id=\"wall_red\"", "id=\"wall_red_", "id=\"a_b_c_", "id=\"plain_001\"",
                                        "id=\"plain_0\""};
    for (size_t i = 0; i < sizeof there / sizeof *there; i++)
        if (!strstr(written, there[i])) fail_msg("%s is not in\n%s", there[i], written);
    ca_free(written);
}

/* ---- Refusals -------------------------------------------------------------------------------------------------- */

/* Curves that a reader gathered become a file of text, tips included. */
static void test_gathered_curves(void **state)
{
    char path[256];
    snprintf(path, sizeof path, "%s/hair.pbrt", folder_of(state));
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fprintf(file, "LookAt 0 0.5 -3  0 0.5 0  0 1 0\nCamera \"perspective\" \"float fov\" 40\n"
                  "Film \"rgb\" \"integer xresolution\" 24 \"integer yresolution\" 18\n"
                  "Integrator \"path\"\nWorldBegin\nLightSource \"infinite\" \"rgb L\" [1 .8 .6]\n"
                  "Material \"diffuse\"\n");
    for (int i = 0; i < 40; i++)
        fprintf(file, "Shape \"curve\" \"point3 P\" [%g 0 0  %g .4 .1  %g .7 -.1  %g 1 .3] \"float width0\" .05 "
                      "\"float width1\" 0 \"string type\" \"cylinder\"\n",
                0.04 * i - 0.8, 0.05 * i - 1.0, 0.03 * i - 0.5, 0.07 * i - 1.3);
    assert_int_equal(fclose(file), 0);
    const ca_scene_source source = {.path = path};
    assert_int_equal(check_source(state, &source), 1);
}

static void expect_refusal(const char *from, const char *to, ca_status expected, const char *message)
{
    const ca_scene_source source = old_source(from);
    ca_scene_desc desc;
    ca_error error = {""};
    assert_int_equal(ca_import_convert(&source, to, &desc, &error), expected);
    if (!strstr(error.message, message)) fail_msg("\"%s\" does not tell \"%s\"", error.message, message);
    assert_int_equal(desc.shapes.count, 0);
}

static void test_inputs_are_never_overwritten(void **state)
{
    char from[256], to[256];
    write_old_scene(folder_of(state));
    snprintf(from, sizeof from, "%s/old.xml", folder_of(state));
    expect_refusal(from, from, CA_ERROR_ARGUMENT, "and the scene is read from it");
    snprintf(to, sizeof to, "%s/./link.xml", folder_of(state));
    assert_int_equal(symlink(from, to), 0);
    expect_refusal(from, to, CA_ERROR_ARGUMENT, "and the scene is read from it");
    char *text = read_text(from);
    assert_string_equal(text, old_text);
    ca_free(text);
    /* A scene that is made from the files of another one cannot take that one's name. */
    snprintf(to, sizeof to, "%s/new.xml", folder_of(state));
    const ca_scene_source source = old_source(from);
    convert(&source, to);
    snprintf(from, sizeof from, "%s/user.xml", folder_of(state));
    char *user = read_text(to);
    write_text(folder_of(state), "user.xml", user);
    ca_free(user);
    expect_refusal(from, to, CA_ERROR_ARGUMENT, "new-files/");
    snprintf(to, sizeof to, "%s/again.xml", folder_of(state));
    convert_file(from, to);
}

static void test_what_cannot_be_written(void **state)
{
    char from[256], to[256];
    write_old_scene(folder_of(state));
    snprintf(from, sizeof from, "%s/old.xml", folder_of(state));
    snprintf(to, sizeof to, "%s/out.pbrt", folder_of(state));
    expect_refusal(from, to, CA_ERROR_ARGUMENT, "must end in .xml");
    expect_refusal(from, ".xml", CA_ERROR_ARGUMENT, "must end in .xml");
    snprintf(to, sizeof to, "%s/nowhere/out.xml", folder_of(state));
    expect_refusal(from, to, CA_ERROR_FILE, "nowhere/out-files");
    assert_false(exists(folder_of(state), "nowhere"));
}

/* Whatever allocation fails, it is said, and nothing leaks. */
static void test_failing_allocations(void **state)
{
    char from[256], to[256];
    write_old_scene(folder_of(state));
    snprintf(from, sizeof from, "%s/old.xml", folder_of(state));
    snprintf(to, sizeof to, "%s/few.xml", folder_of(state));
    const ca_scene_source source = old_source(from);
    for (long count = 0;; count++) {
        ca_scene_desc desc;
        ca_error error = {""};
        ca_memory_fail_after(count);
        const ca_status status = ca_import_convert(&source, to, &desc, &error);
        ca_memory_fail_after(-1);
        if (status == CA_OK) {
            ca_scene_desc_destroy(&desc);
            assert_in_range(count, 150, 10000);
            break;
        }
        if (status != CA_ERROR_MEMORY) fail_msg("allocation %ld: %s", count, error.message);
    }
}

/* ---- The program ----------------------------------------------------------------------------------------------- */

static void test_the_program(void **state)
{
    ca_program_result r;
    write_text(folder_of(state), "ball.xml", scene_text);
    RUN(&r, "convert", "ball.xml", "-o", "copy.xml", "-D", "albedo=0.25");
    assert_exit(&r, 0);
    assert_string_equal(r.errors, "");
    assert_string_equal(r.output, "");
    char path[256];
    snprintf(path, sizeof path, "%s/copy.xml", folder_of(state));
    char *text = read_text(path);
    assert_non_null(strstr(text, "<rgb name=\"reflectance\" value=\"0.25\"/>"));
    ca_free(text);
    assert_false(exists(folder_of(state), "copy-files")); /* there is nothing for it */
    RUN(&r, "convert", "ball.xml", "-o", "ball.xml");
    assert_exit(&r, 2);
    RUN(&r, "convert", "ball.xml");
    assert_exit(&r, 2);
    assert_non_null(strstr(r.errors, "no output is named"));
    RUN(&r, "convert", "none.xml", "-o", "copy.xml");
    assert_exit(&r, 1);
    write_text(folder_of(state), "ours.xml",
               "<scene version=\"3.0.0\"><integrator type=\"ovcm\"/><sensor type=\"perspective\"/></scene>");
    RUN(&r, "convert", "ours.xml", "-o", "copy.xml");
    assert_exit(&r, 0);
    assert_non_null(strstr(r.errors, "ours.xml:1:24: Mitsuba 3 has no integrator \"ovcm\"; it is written as it is"));
    RUN(&r, "convert", "ours.xml", "-o", "copy.xml", "--quiet");
    assert_string_equal(r.errors, "");
    assert_int_equal(setenv("CAUSTICA_SCENE_MEMORY", "0.001", 1), 0);
    RUN(&r, "convert", "ours.xml", "-o", "copy.xml");
    assert_int_equal(unsetenv("CAUSTICA_SCENE_MEMORY"), 0);
    assert_exit(&r, 1);
    assert_says(r.errors, "more than the 0 MiB of memory that are allowed; CAUSTICA_SCENE_MEMORY");
    static const char *const wrong[][2] = {{"4G", "\"4G\" is not a number above 0"},
                                           {"abc", "\"abc\" is not a number above 0"},
                                           {"-5", "\"-5\" is not a number above 0"},
                                           {"", "\"\" is not a number above 0"},
                                           {"1e400", "\"1e400\" is too large"}};
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        assert_int_equal(setenv("CAUSTICA_SCENE_MEMORY", wrong[i][0], 1), 0);
        RUN(&r, "convert", "ours.xml", "-o", "copy.xml");
        assert_int_equal(unsetenv("CAUSTICA_SCENE_MEMORY"), 0);
        assert_wrong_usage(&r, "caustica: CAUSTICA_SCENE_MEMORY in the environment (MiB): ");
        assert_says(r.errors, wrong[i][1]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        PROGRAM_TEST(test_bundled_scenes),       PROGRAM_TEST(test_old_spellings_and_arrays),
        PROGRAM_TEST(test_ids_with_dots),
        PROGRAM_TEST(test_failing_allocations),  PROGRAM_TEST(test_inputs_are_never_overwritten),
        PROGRAM_TEST(test_what_cannot_be_written), PROGRAM_TEST(test_the_program),
        PROGRAM_TEST(test_gathered_curves),
    };
    return run_program_tests("convert", tests, sizeof tests / sizeof tests[0]);
}
