/* Rendering in parts from outside: one run against parts made with different numbers of threads and merged in any
 * order, to the bit; files that do not fit together, that are cut off, places that cannot be written. */
#define _POSIX_C_SOURCE 200809L
#include "image/layers.h"
#include "support/program_test.h"
#include "support/scene_text.h"

#include <math.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <sys/wait.h>

#define QMCPPM "-iqmcppm:max_depth=4,kernel=epanechnikov,gradients=true", "--sampler=halton", "--quiet"

/* A ball and a floor below a small light, part of which is looked at through the ball. */
static const char *const box_text =
    "<scene version=\"3.0.0\">\n"
    "  <default name=\"light\" value=\"30\"/>\n"
    "  <sensor type=\"perspective\">\n"
    "    <float name=\"fov\" value=\"40\"/>\n"
    "    <transform name=\"to_world\"><lookat origin=\"0,3,6\" target=\"0,0.5,0\" up=\"0,1,0\"/></transform>\n"
    "    <sampler type=\"independent\"><integer name=\"sample_count\" value=\"3\"/></sampler>\n"
    "    <film type=\"hdrfilm\"><integer name=\"width\" value=\"30\"/><integer name=\"height\" "
    "value=\"20\"/></film>\n"
    "  </sensor>\n"
    "  <shape type=\"rectangle\"><transform name=\"to_world\"><rotate x=\"1\" angle=\"-90\"/><scale "
    "value=\"3\"/></transform></shape>\n"
    "  <shape type=\"sphere\"><point name=\"center\" value=\"0,0.6,0\"/><float name=\"radius\" value=\"0.6\"/>"
    "<bsdf type=\"dielectric\"/></shape>\n"
    "  <shape type=\"sphere\"><point name=\"center\" value=\"1,3,0\"/><float name=\"radius\" value=\"0.2\"/>"
    "<bsdf type=\"diffuse\"/><emitter type=\"area\"><rgb name=\"radiance\" value=\"$light\"/></emitter></shape>\n"
    "</scene>\n";

static uint64_t hash_of(void **state, const char *name)
{
    ca_image_layers *image = read_image(state, name);
    const uint64_t hash = image_hash(image);
    ca_image_release(image);
    return hash;
}

static void render_box(void **state)
{
    ca_program_result r;
    write_text(folder_of(state), "box.xml", box_text);
    RUN(&r, "render", "box.xml", QMCPPM, "--threads=2", "-o", "one.exr", "-o", "one.part", "--stats=one.json");
    assert_exit(&r, 0);
    assert_string_equal(r.errors, "");
}

static void render_range(void **state, const char *range, const char *threads, const char *file)
{
    ca_program_result r;
    RUN(&r, "render", "box.xml", QMCPPM, "--threads", threads, "--blocks", range, "-o", file);
    assert_exit(&r, 0);
}

/* Three samples per pixel are a square of three by three blocks. */
static void test_parts_are_the_whole(void **state)
{
    ca_program_result r;
    render_box(state);
    const uint64_t hash = hash_of(state, "one.exr");
    ca_image_layers *image = read_image(state, "one.exr");
    assert_non_null(ca_layers_find(image, "IrradianceGradient.Z"));
    float brightest = 0.0f;
    for (size_t i = 0; i < 30 * 20; i++) brightest = fmaxf(brightest, ca_layers_find(image, "G")[i]);
    assert_true(brightest > 0.1f && ca_layers_find(image, "Pairs.Y")[0] == 9.0f * 30 * 20);
    ca_image_release(image);

    static const char *const threads[] = {"1", "3", "8"};
    for (int i = 0; i < 3; i++) {
        RUN(&r, "render", "box.xml", QMCPPM, "--threads", threads[i], "--blocks=0:9", "-o", "again.exr");
        assert_exit(&r, 0);
        assert_true(hash_of(state, "again.exr") == hash);
    }
    render_range(state, "0:4", "3", "a.part");
    render_range(state, "4:9", "1", "b.part");
    RUN(&r, "merge", "b.part", "a.part", "-o", "two.exr", "-o", "two.pfm", "-o", "two.part", "--stats", "two.json");
    assert_exit(&r, 0);
    assert_true(hash_of(state, "two.exr") == hash);
    assert_says(r.output, "2 parts, blocks 0:9, 3 samples per pixel");
    assert_says(r.output, "wrote two.exr\nwrote two.pfm\nwrote two.part\nwrote two.json\n");
    RUN(&r, "merge", "two.part", "-o", "three.exr", "--quiet");
    assert_exit(&r, 0);
    assert_string_equal(r.output, "");
    assert_true(hash_of(state, "three.exr") == hash);
    static const char *const ranges[] = {"0:1", "1:2", "2:6", "6:8", "8:9"}, *const files[] = {"0.part", "1.part",
                                                                                               "2.part", "3.part",
                                                                                               "4.part"};
    for (int i = 0; i < 5; i++) render_range(state, ranges[i], threads[i % 3], files[i]);
    RUN(&r, "merge", files[3], files[0], files[4], files[2], files[1], "-o", "five.exr");
    assert_exit(&r, 0);
    assert_true(hash_of(state, "five.exr") == hash);
}

static void test_statistics_and_attributes(void **state)
{
    ca_program_result r;
    render_box(state);
    json_t *stats = load_json(folder_of(state), "one.json");
    assert_int_equal((int)json_number(stats, "iterations"), 9);
    assert_int_equal((int)json_number(stats, "samples_per_pixel"), 3);
    assert_true(json_is_null(json_object_get(stats, "noise_percent")));
    assert_true(json_is_null(json_object_get(stats, "mean_standard_deviation")));
    const json_t *blocks = json_object_get(stats, "blocks");
    assert_int_equal(json_integer_value(json_array_get(blocks, 0)), 0);
    assert_int_equal(json_integer_value(json_array_get(blocks, 1)), 9);
    RUN(&r, "merge", "one.part", "-o", "merged.exr", "--stats", "merged.json");
    assert_exit(&r, 0);
    json_t *merged = load_json(folder_of(state), "merged.json");
    static const char *const keys[] = {"seconds",        "iterations", "samples_per_pixel", "light_paths",
                                       "camera_paths",   "rays",       "shadow_rays",       "photons",
                                       "photons_tested", "merges",     "mean_luminance"};
    for (size_t i = 0; i < sizeof keys / sizeof keys[0]; i++)
        assert_true(json_number(stats, keys[i]) == json_number(merged, keys[i]));
    json_decref(stats);
    json_decref(merged);
    ca_image_layers *a = read_image(state, "one.exr"), *b = read_image(state, "merged.exr");
    assert_int_equal(a->attribute_count, b->attribute_count);
    for (size_t i = 0; i < a->attribute_count; i++) {
        assert_string_equal(a->attributes[i].name, b->attributes[i].name);
        assert_true(a->attributes[i].number == b->attributes[i].number);
        if (a->attributes[i].text) assert_string_equal(a->attributes[i].text, b->attributes[i].text);
    }
    ca_image_release(a);
    ca_image_release(b);
    /* A render that is not by blocks has none. */
    RUN(&r, "render", "ball.xml", "-oball.pfm", "--stats=ball.json");
    assert_exit(&r, 0);
    stats = load_json(folder_of(state), "ball.json");
    assert_true(json_is_null(json_object_get(stats, "blocks")));
    json_decref(stats);
}

#define REFUSED(words, ...)                                                                                          \
    do {                                                                                                             \
        RUN(&r, "merge", __VA_ARGS__, "-o", "never.exr");                                                            \
        assert_exit(&r, 1);                                                                                          \
        assert_says(r.errors, words);                                                                                \
        assert_false(exists(folder_of(state), "never.exr"));                                                         \
    } while (0)

static void test_parts_that_do_not_fit(void **state)
{
    ca_program_result r;
    render_box(state);
    render_range(state, "0:4", "1", "a.part");
    render_range(state, "4:6", "1", "b.part");
    render_range(state, "8:9", "1", "c.part");
    REFUSED("a.part with the blocks 0:4 and one.part with 0:9 overlap", "one.part", "a.part");
    REFUSED("the blocks 6:8 between b.part and c.part are missing", "c.part", "a.part", "b.part");
    REFUSED("b.part begins at block 4", "b.part");
    REFUSED("cannot open", "a.part", "none.part");
    REFUSED("box.xml: not a part file", "a.part", "box.xml");
    /* Without the beginning there is no image, but a part. */
    RUN(&r, "merge", "b.part", "-o", "d.part");
    assert_exit(&r, 0);

    /* Other settings, another scene. */
    RUN(&r, "render", "box.xml", QMCPPM, "--blocks=4:6", "-oother.part", "--seed=5");
    assert_exit(&r, 0);
    REFUSED("a.part and other.part differ in their seed: \"seed 0\" and \"seed 5\"", "a.part", "other.part");
    RUN(&r, "render", "box.xml", QMCPPM, "--blocks=4:6", "-oother.part", "--radius=0.5");
    assert_exit(&r, 0);
    REFUSED("differ in their integrator", "a.part", "other.part");
    RUN(&r, "render", "box.xml", QMCPPM, "--blocks=4:6", "-oother.part", "--resolution=15x10");
    assert_exit(&r, 0);
    REFUSED("differ in their film: \"film 30x20\" and \"film 15x10\"", "a.part", "other.part");
    RUN(&r, "render", "box.xml", QMCPPM, "--blocks=4:6", "-oother.part", "-Dlight=29");
    assert_exit(&r, 0);
    REFUSED("a.part and other.part show different scenes", "a.part", "other.part");
    /* Where blocks are as large as the memory, that is a setting too. */
    static const char *const memories[] = {"8", "9"}, *const ranges[] = {"0:1", "1:3"},
                             *const files[] = {"8.part", "9.part"};
    for (int i = 0; i < 2; i++) {
        RUN(&r, "render", "box.xml", "-iqmcppm:blocks=filled", "--memory", memories[i], "--blocks", ranges[i], "-o",
            files[i]);
        assert_exit(&r, 0);
    }
    REFUSED("differ in their memory", "8.part", "9.part");
    /* The same scene in another place is the same. */
    char path[256];
    snprintf(path, sizeof path, "%s/elsewhere", folder_of(state));
    assert_int_equal(mkdir(path, 0700), 0);
    write_text(folder_of(state), "elsewhere/copy.xml", box_text);
    RUN(&r, "render", "elsewhere/copy.xml", QMCPPM, "--blocks=4:9", "-oother.part");
    assert_exit(&r, 0);
    RUN(&r, "merge", "other.part", "a.part", "-o", "good.exr");
    assert_exit(&r, 0);
    assert_true(hash_of(state, "good.exr") == hash_of(state, "one.exr"));
}

static void test_a_cut_part(void **state)
{
    ca_program_result r;
    render_box(state);
    char path[256];
    snprintf(path, sizeof path, "%s/one.part", folder_of(state));
    struct stat info;
    assert_int_equal(stat(path, &info), 0);
    for (off_t size = info.st_size; size > 0; size -= size / 7 + 1) {
        if (size == info.st_size) continue;
        assert_int_equal(truncate(path, size), 0);
        REFUSED("one.part: this part file is cut off", "one.part");
    }
}

static void test_places_that_cannot_be_written(void **state)
{
    const ca_program *program = *state;
    ca_program_result r;
    render_box(state);
    RUN(&r, "render", "box.xml", QMCPPM, "-o", "no/such/folder.part");
    assert_exit(&r, 1);
    assert_says(r.errors, "no/such/folder.part");
    RUN(&r, "merge", "one.part", "-o", "no/such/folder.part");
    assert_exit(&r, 1);
    /* A disk that is full for a part file. */
    static const char *const commands[] = {"render box.xml --quiet -i qmcppm --blocks 0:1", "merge one.part --quiet"};
    for (int i = 0; i < 2; i++) {
        char command[1024];
        snprintf(command, sizeof command,
                 "ulimit -f 8; cd '%s' && mkdir small && '%s' %s -o small/a.part 2> errors; s=$?; grep -q "
                 "small/a.part errors && "
                 "rmdir small && exit $s",
                 program->folder, program->path, commands[i]);
        const int status = system(command);
        assert_true(WIFEXITED(status));
        assert_int_equal(WEXITSTATUS(status), 1);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        PROGRAM_TEST(test_parts_are_the_whole),           PROGRAM_TEST(test_statistics_and_attributes),
        PROGRAM_TEST(test_parts_that_do_not_fit),         PROGRAM_TEST(test_a_cut_part),
        PROGRAM_TEST(test_places_that_cannot_be_written),
    };
    return run_program_tests("the program: parts of renders", tests, sizeof tests / sizeof tests[0]);
}
