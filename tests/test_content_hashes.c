/* A part and a checkpoint know what the files of their scene held: of every kind of file that is read, a byte that is
 * another one makes another scene, and adding up or going on is refused. */
#include "support/block_fixture.h"
#include "support/sample_files.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { MOST_FILES = 12, MOST_BYTES = 4096, CHANGES = 400, SLOW_CHANGES = 8 };

/* A scene and the files that it names; the first one is what is loaded. */
typedef struct scene_file {
    const char *name;
    const char *text;   /* NULL: from `sample` */
    const char *sample; /* NULL: from `make` */
    sample_bytes (*make)(void);
} scene_file;

typedef struct scene_case {
    const char *what;
    bool is_slow; /* a tenth of a second to load: fewer changes, and none of the scene itself, as others have */
    scene_file files[MOST_FILES];
} scene_case;

static sample_bytes ascii_ply(void) { return sample_ply(SAMPLE_PLY_ASCII); }
static sample_bytes little_ply(void) { return sample_ply(SAMPLE_PLY_LITTLE_ENDIAN); }
static sample_bytes big_ply(void) { return sample_ply(SAMPLE_PLY_BIG_ENDIAN); }
static sample_bytes serialized(void) { return sample_serialized(4, false); }
/* Neither has checksums: a file with another byte can be read. */
static sample_bytes picture(void) { return sample_tga(2, 24, false, true); }
static sample_bytes jpeg(void) { return sample_jpeg(false, false); }
static sample_bytes sky(void) { return sample_pfm(true, false); }

#define XML(camera, objects)                                                                                         \
    "<scene version='3.0.0'><integrator type='path'/><sensor type='" camera "<film type='hdrfilm'><integer "         \
    "name='width' value='3'/><integer name='height' value='2'/></film></sensor><emitter type='constant'/>" objects   \
    "</scene>"
#define PINHOLE "perspective'>"
#define LENS "realistic'><string name='filename' value='triplet.txt'/><float name='focus_distance' value='8'/>"
#define SHAPE(type, file) "<shape type='" type "'><string name='filename' value='" file "'/></shape>"

#define PBRT_FILM "Film \"rgb\" \"integer xresolution\" 3 \"integer yresolution\" 2 \"string filename\" \"a.exr\"\n"

static const scene_case cases[] = {
    {"ascii ply", false, {{"a.xml", .text = XML(PINHOLE, SHAPE("ply", "a.ply"))}, {"a.ply", .make = ascii_ply}}},
    {"ply", false, {{"b.xml", .text = XML(PINHOLE, SHAPE("ply", "b.ply"))}, {"b.ply", .make = little_ply}}},
    {"big-endian ply", false, {{"c.xml", .text = XML(PINHOLE, SHAPE("ply", "c.ply"))}, {"c.ply", .make = big_ply}}},
    {"obj", false, {{"d.xml", .text = XML(PINHOLE, SHAPE("obj", "d.obj"))}, {"d.obj", .make = sample_obj}}},
    {"serialized", false,
     {{"e.xml", .text = XML(PINHOLE, SHAPE("serialized", "e.serialized"))}, {"e.serialized", .make = serialized}}},
    {"lens", false,
     {{"f.xml", .text = XML(LENS, "<shape type='sphere'/>")}, {"triplet.txt", .sample = "lens/triplet"}}},
    {"spectrum", false,
     {{"g.xml", .text = XML(PINHOLE, "<shape type='sphere'><bsdf type='diffuse'><spectrum name='reflectance' "
                                     "filename='g.spd'/></bsdf></shape>")},
      {"g.spd", .text = "400 0.25\n500 0.5\n700 0.75\n"}}},
    {"volume", false,
     {{"h.xml", .text = XML(PINHOLE, SHAPE("sdfgrid", "h.vol"))}, {"h.vol", .sample = "volume/small.vol"}}},
    {"curves", false,
     {{"i.xml", .text = XML(PINHOLE, SHAPE("bsplinecurve", "i.txt"))},
      {"i.txt", .text = "0 0 0 0.25\n0 1 0 0.25\n1 2 0 0.25\n1 3 0 0.125\n"}}},
    {"pictures and an include", false,
     {{"j.xml", .text = XML(PINHOLE, "<include filename='part.xml'/><shape type='rectangle'><bsdf type='diffuse'>"
                                     "<texture name='reflectance' type='bitmap'><string name='filename' "
                                     "value='j.tga'/></texture></bsdf></shape>")},
      {"part.xml", .text = "<shape type='heightfield'><string name='filename' value='k.pfm'/>"
                           "<float name='scale' value='0.125'/></shape>"},
      {"j.tga", .make = picture},
      {"k.pfm", .make = sky}}},
    {"glTF", false, {{"glass.gltf", .sample = "gltf/glass.gltf"}, {"square.bin", .sample = "gltf/square.bin"}}},
    {"glTF's pictures", false,
     {{"materials.gltf", .sample = "gltf/materials.gltf"},
      {"square.bin", .sample = "gltf/square.bin"},
      {"map.png", .make = jpeg}}},
    {"glb", false, {{"glass.glb", .sample = "gltf/glass.glb"}}},
    {"pbrt", false,
     {{"m.pbrt", .text = "LookAt 0 1 -5  0 0.5 0  0 1 0\nCamera \"perspective\"\n" PBRT_FILM "WorldBegin\n"
                         "Include \"n.pbrt\"\nImport \"o.pbrt\"\n"
                         "LightSource \"infinite\" \"string filename\" \"square.pfm\"\n"},
      {"n.pbrt", .text = "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"wall.tga\"\n"
                         "Material \"diffuse\" \"texture reflectance\" \"t\"\nShape \"plymesh\" \"string filename\" "
                         "\"tent.ply\"\n"},
      {"o.pbrt", .text = "Material \"diffuse\" \"spectrum reflectance\" \"o.spd\"\n"
                         "Shape \"sphere\" \"float radius\" 1.125\n"},
      {"o.spd", .text = "400 0.25\n500 0.5\n700 0.75\n"},
      {"tent.ply", .sample = "pbrt/tent.ply"},
      {"wall.tga", .make = picture},
      {"square.pfm", .sample = "pbrt/square.pfm"}}},
    {"pbrt's pictures of lights", true,
     {{"l.pbrt", .text = "Camera \"perspective\" \"float fov\" 45.125\n" PBRT_FILM "WorldBegin\n"
                         "LightSource \"goniometric\" \"string filename\" \"diagram.pfm\"\n"
                         "LightSource \"projection\" \"string filename\" \"slide.tga\"\n"},
      {"slide.tga", .make = picture},
      {"diagram.pfm", .sample = "pbrt/square.pfm"}}},
    {"pbrt's lens", false,
     {{"q.pbrt", .text = "Camera \"realistic\" \"string lensfile\" \"lens.dat\" \"float aperturediameter\" 8 "
                         "\"float focusdistance\" 6\n" PBRT_FILM "WorldBegin\nLightSource \"infinite\"\n"},
      {"lens.dat", .sample = "lens/triplet"}}},
    {"pbrt's masks", false,
     {{"p.pbrt", .text = "LookAt 0 1 -5  0 0.5 0  0 1 0\nCamera \"perspective\"\n" PBRT_FILM "WorldBegin\n"
                         "LightSource \"infinite\" \"rgb L\" [1 1 1]\n"
                         "Texture \"m\" \"float\" \"imagemap\" \"string filename\" \"mask.tga\"\n"
                         "Material \"diffuse\" \"string normalmap\" \"bumps.tga\"\n"
                         "Shape \"plymesh\" \"string filename\" \"tent.ply\" \"texture alpha\" \"m\"\n"},
      {"mask.tga", .make = picture},
      {"bumps.tga", .make = picture},
      {"tent.ply", .sample = "pbrt/tent.ply"}}},
};
enum { CASES = sizeof cases / sizeof cases[0] };

/* ---- Files ----------------------------------------------------------------------------------------------------- */

static sample_bytes read_sample(const char *name)
{
    sample_bytes bytes = {0};
    unsigned char data[MOST_BYTES];
    char path[512];
    snprintf(path, sizeof path, "%s/tests/fuzz/%s", CA_SOURCE_DIR, name);
    FILE *file = fopen(path, "rb");
    if (!file) fail_msg("%s is not there", path);
    const size_t size = fread(data, 1, sizeof data, file);
    assert_true(size < sizeof data && fclose(file) == 0);
    sample_append(&bytes, data, size);
    return bytes;
}

static sample_bytes bytes_of(const scene_file *file)
{
    sample_bytes bytes = {0};
    if (file->sample) return read_sample(file->sample);
    if (file->make) return file->make();
    sample_text(&bytes, file->text);
    return bytes;
}

static void write_case(const scene_case *c)
{
    for (const scene_file *file = c->files; file->name; file++) {
        sample_bytes bytes = bytes_of(file);
        sample_write(ca_block_file(file->name), bytes.data, bytes.size);
        sample_free(&bytes);
    }
}

/* NULL where it cannot be read. */
static ca_scene *load(const scene_case *c, ca_error *error)
{
    ca_scene *scene;
    return ca_scene_load(ca_block_file(c->files[0].name), NULL, 0, &scene, error) == CA_OK ? scene : NULL;
}

static bool content_hash(const scene_case *c, uint64_t *hash, ca_error *error)
{
    ca_scene *scene = load(c, error);
    if (!scene) return false;
    *hash = scene->desc.content_hash;
    ca_scene_release(scene);
    return true;
}

/* ---- Bytes ------------------------------------------------------------------------------------------------ */

/* Another digit of a number, another pixel, another length of a chunk, all over the file: where the scene can still
 * be read its hash is another one. Gives back of how many bytes that was so. */
static int change_bytes(const scene_case *c, const scene_file *file, uint64_t hash)
{
    sample_bytes bytes = bytes_of(file);
    const size_t step = 1 + bytes.size / (c->is_slow ? SLOW_CHANGES : CHANGES);
    int readable = 0;
    for (size_t i = 0; i < bytes.size; i += step) {
        uint64_t changed;
        ca_error error;
        bytes.data[i] ^= 1;
        sample_write(ca_block_file(file->name), bytes.data, bytes.size);
        if (content_hash(c, &changed, &error)) {
            if (changed == hash) fail_msg("%s: byte %zu of %s makes no other scene", c->what, i, file->name);
            readable++;
        }
        bytes.data[i] ^= 1;
    }
    sample_write(ca_block_file(file->name), bytes.data, bytes.size);
    sample_free(&bytes);
    return readable;
}

static void test_bytes_count(void **state)
{
    (void)state;
    for (int i = 0; i < CASES; i++) {
        const scene_case *c = &cases[i];
        uint64_t hash = 0, again = 0;
        ca_error error = {""};
        write_case(c);
        if (!content_hash(c, &hash, &error)) fail_msg("%s: %s", c->what, error.message);
        for (const scene_file *file = c->files + c->is_slow; file->name; file++)
            if (change_bytes(c, file, hash) == 0) fail_msg("%s: nothing in %s can be changed", c->what, file->name);
        assert_true(content_hash(c, &again, &error) && again == hash);
    }
}

/* ---- What a change does ---------------------------------------------------------------------------------------- */

static ca_status render(const scene_case *c, const ca_render_settings *settings, ca_error *error)
{
    ca_image_layers *image = NULL;
    ca_scene *scene = load(c, error);
    if (!scene) fail_msg("%s: %s", c->what, error->message);
    const ca_status status = ca_render(scene, settings, &image, NULL, error);
    ca_image_release(image);
    ca_scene_release(scene);
    return status;
}

static ca_render_settings settings_for_tests(void)
{
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.integrator = "path:max_depth=2";
    settings.width = 3;
    settings.height = 2;
    settings.threads = 1;
    return settings;
}

static void render_part(const scene_case *c, uint64_t pass, const char *name)
{
    char path[256];
    ca_error error = {""};
    snprintf(path, sizeof path, "%s", ca_block_file(name));
    ca_render_settings settings = settings_for_tests();
    settings.has_passes = true;
    settings.passes[0] = pass;
    settings.passes[1] = pass + 1;
    settings.part_path = path;
    if (render(c, &settings, &error) != CA_OK) fail_msg("%s: %s", c->what, error.message);
}

static ca_status keep(const scene_case *c, uint32_t samples, ca_error *error)
{
    char path[256];
    ca_render_settings settings = settings_for_tests();
    snprintf(path, sizeof path, "%s", ca_block_file("kept.part"));
    settings.samples_per_pixel = samples;
    settings.checkpoint_path = path;
    settings.resume = true;
    return render(c, &settings, error);
}

/* Another byte, with which the scene can still be read; until the files are written anew. */
static void change_a_byte(const scene_case *c, const scene_file *file)
{
    sample_bytes bytes = bytes_of(file);
    for (size_t i = bytes.size; i-- > 0;) {
        uint64_t hash;
        ca_error error;
        bytes.data[i] ^= 1;
        sample_write(ca_block_file(file->name), bytes.data, bytes.size);
        bytes.data[i] ^= 1;
        if (content_hash(c, &hash, &error)) break;
        assert_true(i > 0);
    }
    sample_free(&bytes);
}

static void expect_refusals(const scene_case *c, const scene_file *file)
{
    ca_error error = {""};
    change_a_byte(c, file);
    render_part(c, 1, "second.part");
    const char *const parts[2] = {ca_block_file("first.part"), ca_block_file("second.part")};
    if (ca_merge_parts(parts, 2, NULL, NULL, NULL, &error) != CA_ERROR_ARGUMENT)
        fail_msg("%s: a part with another %s was added", c->what, file->name);
    assert_non_null(strstr(error.message, "first.part and "));
    assert_non_null(strstr(error.message, "second.part show different scenes: their files or definitions differ"));
    if (keep(c, 2, &error) != CA_ERROR_ARGUMENT)
        fail_msg("%s: a render with another %s went on", c->what, file->name);
    assert_non_null(strstr(error.message, "kept.part was made with another scene: its files or definitions have"));
    write_case(c);
}

static void test_parts_and_checkpoints_refuse(void **state)
{
    (void)state;
    for (int i = 0; i < CASES; i++) {
        const scene_case *c = &cases[i];
        ca_error error = {""};
        write_case(c);
        render_part(c, 0, "first.part");
        render_part(c, 1, "second.part");
        const char *const parts[2] = {ca_block_file("first.part"), ca_block_file("second.part")};
        if (ca_merge_parts(parts, 2, NULL, NULL, NULL, &error) != CA_OK) fail_msg("%s: %s", c->what, error.message);
        remove(ca_block_file("kept.part"));
        if (keep(c, 1, &error) != CA_OK) fail_msg("%s: %s", c->what, error.message);
        for (const scene_file *file = c->files; file->name; file++) expect_refusals(c, file);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_bytes_count),
        cmocka_unit_test(test_parts_and_checkpoints_refuse),
    };
    return cmocka_run_group_tests_name("contents of scenes", tests, ca_block_make_folder, ca_block_remove_folder);
}
