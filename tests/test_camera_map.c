/* Numbers of camera paths that differ from pixel to pixel, where weights contain them (ca_integrator_input,
 * camera_paths): the picture's mean is the same as with one number for all, with a filter that sums paths into pixels
 * which they do not enter the picture by; and the same bits come from any number of threads. Weights alone:
 * test_mis. */
#include "image/layers.h"
#include "integrator/bidirectional.h"
#include "noise/ray_map.h"
#include "support/batches.h"
#include "support/named_layer.h"
#include "support/scene_text.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <unistd.h>

#include <cmocka.h>

enum { WIDTH = 12, HEIGHT = 10, CROP = 1, LIGHT_PATHS = 90, FEW = 2, MANY = 12, BATCHES = 16, SAMPLES = 256 };

/* Splats bring a good part of the light. The filter reaches two pixels far. */
#define SCENE(walls, ball)                                                                                           \
    "<scene version='3.0.0'><sensor type='perspective'><float name='fov' value='70'/><transform name='to_world'>"    \
    "<lookat origin='0,0,0.95' target='0,-0.2,0' up='0,1,0'/></transform><film type='hdrfilm'>"                      \
    "<integer name='width' value='12'/><integer name='height' value='10'/><rfilter type='mitchell'/></film>"         \
    "</sensor><shape type='cube'>" walls "</shape>" ball "</scene>"

#define LAMP                                                                                                         \
    "<shape type='sphere'><float name='radius' value='0.3'/><point name='center' x='0.3' y='-0.5' z='-0.3'/>"        \
    "<bsdf type='dielectric'/></shape><shape type='rectangle'><transform name='to_world'><scale value='0.3'/>"       \
    "<rotate x='1' angle='100'/><translate x='-0.2' y='0.6' z='-0.3'/></transform><bsdf type='diffuse'/>"            \
    "<emitter type='area'><rgb name='radiance' value='3,3,2'/></emitter></shape>"

static const char room_text[] =
    SCENE("<bsdf type='twosided'><bsdf type='diffuse'><rgb name='reflectance' value='0.8,0.7,0.5'/></bsdf></bsdf>",
          LAMP);

/* In a closed box whose walls emit 1 and reflect a half, the radiance is 2 everywhere. */
static const char furnace_text[] = SCENE("<bsdf type='twosided'><bsdf type='diffuse'><rgb name='reflectance' "
                                         "value='0.5'/></bsdf></bsdf><emitter type='area'><rgb name='radiance' "
                                         "value='1'/></emitter><boolean name='flip_normals' value='true'/>",
                                         "");

static char map_path[64];

/* ---- Maps ------------------------------------------------------------------------------------------------------ */

static uint32_t width_of(bool cropped) { return cropped ? WIDTH - 2 * CROP : WIDTH; }
static uint32_t height_of(bool cropped) { return cropped ? HEIGHT - 2 * CROP : HEIGHT; }

/* Neighbours have few camera paths or many. */
static uint32_t paths_at(uint32_t pixel, uint32_t width)
{
    return (pixel % width + pixel / width) % 2 == 0 ? FEW : MANY;
}

static void write_map(bool cropped)
{
    uint32_t numbers[WIDTH * HEIGHT];
    const uint32_t width = width_of(cropped), height = height_of(cropped);
    ca_image_layers *image;
    for (uint32_t p = 0; p < width * height; p++) numbers[p] = paths_at(p, width);
    assert_int_equal(ca_layers_create(&image, width, height, NULL), CA_OK);
    image->full_width = WIDTH;
    image->full_height = HEIGHT;
    image->x0 = image->y0 = cropped ? CROP : 0;
    assert_int_equal(ca_ray_map_add(image, LIGHT_PATHS, numbers, NULL), CA_OK);
    assert_int_equal(ca_image_save(image, map_path, 0.0f, NULL), CA_OK);
    ca_image_release(image);
}

static int set_up(void **state)
{
    (void)state;
    snprintf(map_path, sizeof map_path, "/tmp/caustica-camera-map-%ld.exr", (long)getpid());
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    unlink(map_path);
    return 0;
}

/* ---- Renders --------------------------------------------------------------------------------------------------- */

static ca_render_settings settings_of(const char *integrator, bool cropped, bool map, uint64_t seed)
{
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.integrator = integrator;
    settings.sampler = "independent";
    settings.samples_per_pixel = SAMPLES;
    settings.threads = 1;
    settings.seed = seed;
    settings.has_seed = true;
    if (map)
        settings.rays = map_path;
    else
        settings.light_paths = LIGHT_PATHS, settings.camera_paths = (FEW + MANY) / 2;
    settings.has_crop = cropped;
    if (cropped) {
        settings.crop[0] = settings.crop[1] = CROP;
        settings.crop[2] = WIDTH - CROP;
        settings.crop[3] = HEIGHT - CROP;
    }
    return settings;
}

/* Mean of the green pixels that have few camera paths by the map, and of the others. */
static void means_of(const ca_scene *scene, const ca_render_settings *settings, bool cropped, double means[2])
{
    ca_image_layers *image;
    ca_error error;
    if (ca_render(scene, settings, &image, NULL, &error) != CA_OK) fail_msg("%s", error.message);
    const float *green = named_layer(image, "G");
    const uint32_t width = width_of(cropped), pixels = width * height_of(cropped);
    uint32_t counts[2] = {0};
    means[0] = means[1] = 0.0;
    for (uint32_t p = 0; p < pixels; p++) {
        const int kind = paths_at(p, width) == MANY;
        means[kind] += (double)green[p];
        counts[kind]++;
    }
    for (int kind = 0; kind < 2; kind++) means[kind] /= counts[kind];
    ca_image_release(image);
}

/* Of both kinds of pixels, over renders with seeds of their own. */
static void measure(const ca_scene *scene, const char *integrator, bool cropped, bool map, measured both[2])
{
    double means[2][BATCHES];
    for (int i = 0; i < BATCHES; i++) {
        const ca_render_settings settings =
            settings_of(integrator, cropped, map, seed_of(integrator) + (uint64_t)(2 * i + map));
        double pair[2];
        means_of(scene, &settings, cropped, pair);
        means[0][i] = pair[0];
        means[1][i] = pair[1];
    }
    for (int kind = 0; kind < 2; kind++) both[kind] = measured_of(means[kind], BATCHES);
}

/* ---- Means ----------------------------------------------------------------------------------------------------- */

#define DEPTH "max_depth=5,rr_depth=6"

/* A bias of 3 % would be found: four standard errors of a difference are less, and mostly 2 %. */
static void test_mean_is_that_of_one_number(void **state)
{
    (void)state;
    static const char *const integrators[] = {
        "bdpt:" DEPTH, "vcm:radius=0.03,alpha=0,merge_sums=true," DEPTH, "vavcm:radius=0.03,alpha=0," DEPTH};
    ca_scene *scene = scene_from_text(room_text);
    for (size_t i = 0; i < sizeof integrators / sizeof integrators[0]; i++) {
        const bool cropped = i % 2 == 1;
        measured map[2], one[2];
        write_map(cropped);
        measure(scene, integrators[i], cropped, true, map);
        measure(scene, integrators[i], cropped, false, one);
        for (int kind = 0; kind < 2; kind++) {
            const double error = hypot(map[kind].error, one[kind].error);
            const double off = (map[kind].mean - one[kind].mean) / error;
            print_message("    %.5s %s: %.4f and %.4f, %.2f standard errors of %.2f %%\n", integrators[i],
                          kind ? "many" : "few ", map[kind].mean, one[kind].mean, off,
                          100.0 * error / one[kind].mean);
            assert_true(error < 0.008 * one[kind].mean);
            assert_true(fabs(off) < 3.5);
        }
    }
    ca_scene_release(scene);
}

static void test_furnace(void **state)
{
    (void)state;
    static const char *const integrators[] = {"bdpt:max_depth=-1,rr_depth=3",
                                              "ovcm:radius=0.03,alpha=0,max_depth=-1"};
    ca_scene *scene = scene_from_text(furnace_text);
    for (int i = 0; i < 2; i++) {
        measured map[2];
        write_map(false);
        measure(scene, integrators[i], false, true, map);
        for (int kind = 0; kind < 2; kind++) {
            print_message("    %.4s: %.4f +- %.4f\n", integrators[i], map[kind].mean, map[kind].error);
            assert_true(map[kind].error < 0.008);
            assert_true(fabs(map[kind].mean - 2.0) < 3.5 * map[kind].error);
        }
    }
    ca_scene_release(scene);
}

/* ---- The numbers of the map ------------------------------------------------------------------------------------ */

/* At a place on the film; beyond the crop's border those of the nearest pixel. */
static void test_places(void **state)
{
    (void)state;
    static const uint32_t numbers[6] = {1, 2, 3, 4, 6, 12};
    const ca_bidirectional b = {.camera_paths = 12, .input = {.crop = {5, 3, 8, 5}, .camera_paths = numbers}};
    static const struct {
        float x, y;
        uint32_t number;
    } places[] = {{5.0f, 3.0f, 1},  {6.99f, 3.99f, 2}, {7.5f, 3.5f, 3}, {5.5f, 4.0f, 4}, {6.5f, 4.9f, 6},
                  {7.9f, 4.9f, 12}, {-2.0f, -1.0f, 1}, {9.5f, 3.2f, 3}, {3.0f, 6.5f, 4}, {8.0f, 5.0f, 12}};
    for (size_t i = 0; i < sizeof places / sizeof places[0]; i++) {
        const ca_vec2 film = {places[i].x, places[i].y};
        assert_true(ca_bidirectional_splat_scale(&b, film) == 12.0f / (float)places[i].number);
    }
    assert_int_equal(ca_bidirectional_camera_paths_of(&b, 6, 4), 6);
    const ca_bidirectional one = {.camera_paths = 12, .input = {.crop = {5, 3, 8, 5}}};
    assert_true(ca_bidirectional_splat_scale(&one, (ca_vec2){6.0f, 4.0f}) == 1.0f);
    assert_int_equal(ca_bidirectional_camera_paths_of(&one, 6, 4), 12);
}

/* ---- Threads --------------------------------------------------------------------------------------------------- */

static void test_threads_do_not_change_a_bit(void **state)
{
    (void)state;
    static const char *const integrators[] = {"bdpt", "ovcm:radius=0.1", "vavcm:radius=0.1"};
    ca_scene *scene = scene_from_text(room_text);
    for (size_t i = 0; i < sizeof integrators / sizeof integrators[0]; i++) {
        uint64_t hashes[2];
        write_map(i == 1);
        for (int k = 0; k < 2; k++) {
            ca_render_settings settings = settings_of(integrators[i], i == 1, true, 5);
            settings.threads = k == 0 ? 1 : 3;
            hashes[k] = rendered_hash(scene, &settings);
        }
        assert_true(hashes[0] == hashes[1]);
    }
    ca_scene_release(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_mean_is_that_of_one_number),
        cmocka_unit_test(test_furnace),
        cmocka_unit_test(test_places),
        cmocka_unit_test(test_threads_do_not_change_a_bit),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
