/* `caustica render --rays` from outside: numbers that are chosen, numbers of a file, what is printed, what is
 * refused. */
#include "image/layers.h"
#include "noise/ray_map.h"
#include "support/named_layer.h"
#include "support/program_room.h"
#include "support/scene_text.h"

#include <math.h>
#include <stdlib.h>

/* Its sampler and its shrinking radius are not what rays "auto" wants. */
static const char *const room_text = ROOM_TEXT(
    "  <integrator type=\"bdpm\"><integer name=\"max_depth\" value=\"4\"/><float name=\"radius\" value=\"0.5\"/>"
    "<float name=\"alpha\" value=\"0.5\"/></integrator>\n",
    "sobol", "12", "40");

enum { LIGHT_PATHS = 7 };

static uint32_t camera_paths_at(int pixel) { return 1 + (uint32_t)pixel % 5; }

/* map.exr: numbers of the test's own. */
static void write_map(void **state)
{
    uint32_t numbers[PIXELS];
    char path[256];
    ca_image_layers *image;
    for (int p = 0; p < PIXELS; p++) numbers[p] = camera_paths_at(p);
    assert_int_equal(ca_layers_create(&image, WIDTH, HEIGHT, NULL), CA_OK);
    assert_int_equal(ca_ray_map_add(image, LIGHT_PATHS, numbers, NULL), CA_OK);
    snprintf(path, sizeof path, "%s/map.exr", folder_of(state));
    assert_int_equal(ca_image_save(image, path, 0.0f, NULL), CA_OK);
    ca_image_release(image);
}

static int set_up_room(void **state)
{
    const int status = set_up(state);
    if (status != 0) return status;
    write_text(folder_of(state), "room.xml", room_text);
    write_map(state);
    return 0;
}

/* ---- Numbers that are chosen ----------------------------------------------------------------------------------- */

/* The map, the counts and the numbers of --stats say the same. */
static void assert_chosen(const ca_image_layers *image, const json_t *root)
{
    const json_t *rays = json_object_get(root, "numbers_of_rays");
    const float *map = named_layer(image, "Rays.Numbers"), *made = named_layer(image, "Rays.Camera");
    double mean = 0.0, paths = 0.0;
    for (int p = 0; p < PIXELS; p++) {
        assert_true(map[p] >= 1.0f && map[p] == floorf(map[p]));
        mean += (double)map[p] / PIXELS;
        paths += (double)made[p];
    }
    assert_true(fabs(json_number(rays, "camera_paths") - mean) < 1e-6 * mean);
    assert_true(json_number(root, "camera_paths") == paths);
    assert_true(fabs(json_number(root, "samples_per_pixel") - paths / PIXELS) < 1e-6 && paths >= 64.0 * PIXELS);
    assert_true(atof(attribute_text(image, CA_RAY_MAP_LIGHT_PATHS)) == json_number(rays, "light_paths"));
    assert_true(json_number(rays, "phases") >= 1.0 && json_number(rays, "pilot_seconds") > 0.0);
    /* Of so few one kind of path may seem to cost nothing. */
    assert_true(json_number(rays, "light_path_seconds") >= 0.0 && json_number(rays, "predicted_gain") > 0.0);
}

static void test_auto(void **state)
{
    static const char *const objectives[] = {"mean", "relative", "worst-decile"};
    for (int i = 0; i < 3; i++) {
        ca_program_result r;
        RUN(&r, "render", "room.xml", "--rays=auto", "--objective", objectives[i], "--spp=64", "--light-paths=60",
            "-o", "a.exr", "--stats=a.json");
        assert_exit(&r, 0);
        assert_string_equal(r.errors, "");
        assert_says(r.output, " per pixel in an iteration in the end; pilot ");
        const bool is_one = strstr(r.output, " and 1 camera path") != NULL;
        assert_says(r.output, is_one ? " and 1 camera path per" : " camera paths per");
        assert_says(r.output, ", predicted gain over its numbers ");
        assert_says(r.output, "\na light path takes ");
        assert_says(r.output, " us, a merge candidate ");
        assert_says(r.output, "\nwrote a.exr\nwrote a.json\n");
        ca_image_layers *image = read_image(state, "a.exr");
        json_t *root = load_json(folder_of(state), "a.json");
        assert_chosen(image, root);
        assert_int_equal(strncmp(attribute_text(image, "caustica.rays"), "auto: ", 6), 0);
        assert_string_equal(attribute_text(image, "caustica.sampler"), "independent");
        json_decref(root);
        ca_image_release(image);
    }
}

/* Of ppm the light paths alone. What it wrote is understood. */
static void test_auto_and_again(void **state)
{
    ca_program_result r;
    RUN(&r, "render", "room.xml", "-ippm", "--rays", "auto", "--spp=32", "--light-paths=60", "--quiet", "-o",
        "a.exr");
    assert_exit(&r, 0);
    assert_string_equal(r.output, "");
    assert_string_equal(r.errors, "");
    ca_image_layers *image = read_image(state, "a.exr");
    for (int p = 0; p < PIXELS; p++) assert_true(named_layer(image, "Rays.Numbers")[p] == 1.0f);
    char says[64];
    snprintf(says, sizeof says, "\n%s light paths and 1 camera path per pixel in an iteration\n",
             attribute_text(image, CA_RAY_MAP_LIGHT_PATHS));
    ca_image_release(image);
    RUN(&r, "render", "room.xml", "-ippm", "--rays", "a.exr", "--spp=1", "-o", "b.exr");
    assert_exit(&r, 0);
    assert_says(r.output, says);
    assert_null(strstr(r.output, "pilot"));
    assert_null(strstr(r.output, "a light path takes"));
}

/* ---- Numbers of a file ----------------------------------------------------------------------------------------- */

static void test_file(void **state)
{
    static const char *const threads[] = {"--threads=1", "--threads=3"}, *const files[] = {"1.exr", "3.exr"};
    ca_image_layers *images[2];
    double sum = 0.0;
    for (int p = 0; p < PIXELS; p++) sum += camera_paths_at(p);
    for (int i = 0; i < 2; i++) {
        ca_program_result r;
        RUN(&r, "render", "room.xml", "--rays=map.exr", threads[i], "-o", files[i], "--stats=a.json");
        assert_exit(&r, 0);
        assert_string_equal(r.errors, "");
        assert_says(r.output, "\n7 light paths and 2.979 camera paths per pixel in an iteration\n");
        images[i] = read_image(state, files[i]);
        json_t *root = load_json(folder_of(state), "a.json");
        const double iterations = ceil(12.0 / (sum / PIXELS)); /* the scene's samples per pixel */
        assert_true(json_number(root, "iterations") == iterations);
        assert_true(json_number(root, "camera_paths") == iterations * sum);
        assert_true(json_number(root, "light_paths") == iterations * LIGHT_PATHS);
        assert_true(json_number(json_object_get(root, "numbers_of_rays"), "phases") == 0.0);
        assert_true(json_is_null(json_object_get(json_object_get(root, "numbers_of_rays"), "predicted_gain")));
        for (int p = 0; p < PIXELS; p++)
            assert_true((double)named_layer(images[i], "Rays.Camera")[p] == iterations * camera_paths_at(p) &&
                        (double)named_layer(images[i], "Rays.Numbers")[p] == camera_paths_at(p));
        json_decref(root);
    }
    assert_string_equal(attribute_text(images[0], "caustica.sampler"),
                        "sobol"); /* the scene's: nothing is chosen by a law here */
    assert_int_equal(images[0]->channel_count, images[1]->channel_count);
    for (size_t c = 0; c < images[0]->channel_count; c++)
        assert_memory_equal(images[0]->channels[c].data, images[1]->channels[c].data, PIXELS * sizeof(float));
    ca_image_release(images[0]);
    ca_image_release(images[1]);
}

/* ---- What is refused ------------------------------------------------------------------------------------------- */

static const struct refusal {
    int exit_status;
    const char *words[5], *says;
} refusals[] = {
    {2, {"--rays"}, "--rays"},
    {1, {"--rays=none.exr"}, "none.exr: cannot open this image"},
    {1, {"--rays=Auto"}, "Auto: cannot open"},
    {1, {"--rays=room.xml"}, "room.xml: not an image of a known format"},
    {1, {"--rays=plain.exr"}, "plain.exr: there is no layer \"Rays.Numbers\""},
    {1, {"--rays=cut.exr"}, "cut.exr"},
    {2,
     {"--rays=map.exr", "--resolution=24x16"},
     "map.exr: its numbers of rays are for the part 0,0,12,8 of a film of 12 x 8 pixels"},
    {2, {"--rays=map.exr", "--crop=1,0,12,8"}, "not for 1,0,12,8 of 12 x 8"},
    {2, {"--rays=map.exr", "--light-paths=9"}, "cannot be set as well"},
    {2, {"--rays=map.exr", "--camera-paths=9"}, "cannot be set as well"},
    {2, {"--rays=map.exr", "-ibdpm:light_paths=9"}, "cannot be set as well"},
    {2, {"--rays=map.exr", "-ibdpm:radius=1,camera_paths=9"}, "cannot be set as well"},
    {2, {"--rays=map.exr", "--objective=mean"}, "with rays \"auto\" only"},
    {2, {"--rays=map.exr", "--replicates=2"}, "not with rays"},
    {2, {"--objective=relative"}, "with rays \"auto\" only"},
    {2,
     {"--rays=auto", "--spp=64", "--objective=best"},
     "the objective \"best\" is not known; there are mean, relative, worst-decile"},
    {2, {"--rays=auto", "--spp=64", "-ipath"}, "vavcm and auto, not for path"},
    {2, {"--rays=auto"}, "12 samples per pixel are too few for rays \"auto\""},
    {2, {"--rays=auto", "--spp=64", "--alpha=0.5"}, "alpha must be 0"},
    {2, {"--rays=auto", "--spp=64", "--sampler=sobol"}, "must be \"independent\", not \"sobol\""},
    {2, {"--rays=auto", "--spp=64", "--replicates=2"}, "not with rays"},
    {2, {"--rays=auto", "--time=1", "--camera-paths=65537"}, "at most 65536 camera paths per pixel, not 65537"},
    {2, {"--rays=auto", "--spp=64", "--memory=0.05"}, "estimates of rays \"auto\" need "},
};

static void test_refusals(void **state)
{
    ca_program_result r;
    RUN(&r, "render", "room.xml", "-o", "plain.exr", "--spp=1", "--quiet");
    assert_exit(&r, 0);
    write_text(folder_of(state), "cut.exr", "\x76\x2f\x31\x01");
    for (size_t i = 0; i < sizeof refusals / sizeof refusals[0]; i++) {
        const struct refusal *c = &refusals[i];
        RUN(&r, "render", "room.xml", "-o", "a.exr", c->words[0], c->words[1], c->words[2], c->words[3]);
        assert_exit(&r, c->exit_status);
        assert_says(r.errors, c->says);
        assert_string_equal(r.output, "");
        assert_false(exists(folder_of(state), "a.exr"));
    }
}

#define ROOM_TEST(function) cmocka_unit_test_setup_teardown(function, set_up_room, tear_down)

int main(void)
{
    const struct CMUnitTest tests[] = {
        ROOM_TEST(test_auto),
        ROOM_TEST(test_auto_and_again),
        ROOM_TEST(test_file),
        ROOM_TEST(test_refusals),
    };
    return run_program_tests("the program: numbers of rays", tests, sizeof tests / sizeof tests[0]);
}
