/* Measuring noise through the library: layers and averages of the same sums, an early end, what is refused, the
 * picture, failures of memory. */
#include "base/memory.h"
#include "noise/layers.h"
#include "render/noise.h"
#include "support/scene_text.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#define FLOOR_AND(more)                                                                                              \
    "<scene version=\"3.0.0\">\n"                                                                                    \
    "  <integrator type=\"bdpm\"><integer name=\"max_depth\" value=\"3\"/><float name=\"alpha\" value=\"0.5\"/>\n"   \
    "    <integer name=\"light_paths\" value=\"40\"/><integer name=\"camera_paths\" value=\"3\"/></integrator>\n"    \
    "  <sensor type=\"perspective\"><float name=\"fov\" value=\"30\"/>\n"                                            \
    "    <transform name=\"to_world\"><lookat origin=\"0,3,3\" target=\"0,0,0\" up=\"0,1,0\"/></transform>\n"        \
    "    <film type=\"hdrfilm\"><integer name=\"width\" value=\"5\"/><integer name=\"height\" value=\"4\"/>"         \
    "<rfilter type=\"box\"/></film>\n"                                                                               \
    "  </sensor>\n"                                                                                                  \
    "  <shape type=\"rectangle\"><transform name=\"to_world\"><rotate x=\"1\" angle=\"-90\"/><scale "                \
    "value=\"2\"/></transform>"                                                                                      \
    "</shape>\n"                                                                                                     \
    "  <emitter type=\"point\"><point name=\"position\" value=\"0,2,0\"/><rgb name=\"intensity\" "                   \
    "value=\"9\"/></emitter>\n" more "</scene>\n"

static const char *const floor_text = FLOOR_AND("");
/* With a wall, so that light paths go on from where camera paths see them. */
static const char *const corner_text = FLOOR_AND("  <shape type=\"rectangle\"><transform name=\"to_world\"><scale "
                                                 "value=\"2\"/><translate z=\"-1\"/></transform></shape>\n");

enum { PIXELS = 20 };

static ca_render_settings settings_of(double radius)
{
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.radius = radius;
    settings.threads = 1;
    return settings;
}

static void test_measurement(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(floor_text);
    const ca_render_settings settings = settings_of(0.5);
    ca_noise *noise = NULL;
    ca_image_layers *image = NULL;
    ca_render_statistics statistics = {.size = sizeof statistics};
    ca_error error = {""};
    assert_int_equal(ca_noise_measure(scene, &settings, 30, &noise, &image, &statistics, &error), CA_OK);
    assert_true(statistics.iterations == 30 && statistics.light_paths == 30 * 40 && !statistics.interrupted);
    assert_true(noise->film.light_paths == 40 && noise->film.camera_paths == 3);
    ca_noise_summary all, part;
    assert_int_equal(ca_noise_average(noise, NULL, 40, 3, &all, &error), CA_OK);
    assert_int_equal(ca_noise_average(noise, (const uint32_t[]){1, 2, 2, 3}, 40, 3, &part, &error), CA_OK);
    assert_true(all.pixels == PIXELS && part.pixels == 1);
    assert_true(fabs(all.luminance - statistics.mean_luminance) < 1e-5 * all.luminance);
    assert_true(fabs(all.measured_rms - statistics.mean_standard_deviation) < 1e-4 * all.measured_rms);
    assert_true((float)part.pair == ca_image_channel(image, "Noise.Pair")[2 * 5 + 1]);
    assert_true(ca_image_channel(image, "R") && ca_image_channel(image, "Noise.Measured.StdErr"));
    /* The same again, without what is not wanted. */
    ca_noise *again = NULL;
    ca_noise_summary same;
    assert_int_equal(ca_noise_measure(scene, &settings, 30, &again, NULL, NULL, &error), CA_OK);
    assert_int_equal(ca_noise_average(again, NULL, 40, 3, &same, &error), CA_OK);
    assert_true(same.predicted == all.predicted && same.measured == all.measured);
    ca_noise_release(again);
    ca_noise_release(noise);
    ca_noise_release(NULL);
    ca_image_release(image);
    ca_scene_release(scene);
}

/* Paths that are connected have a fourth term, in the layers and averages; no numbers are recommended for them. */
static void test_connections(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(corner_text);
    static const char *const integrators[] = {"vcm:max_depth=4", "ovcm:max_depth=4", "bdpt:max_depth=4"};
    for (int i = 0; i < 3; i++) {
        ca_render_settings settings = settings_of(i < 2 ? 0.5 : 0.0);
        settings.integrator = integrators[i];
        ca_noise *noise = NULL;
        ca_image_layers *image = NULL;
        ca_error error = {""};
        ca_noise_summary all, part;
        ca_noise_recommendation recommendation;
        assert_int_equal(ca_noise_measure(scene, &settings, 30, &noise, &image, NULL, &error), CA_OK);
        assert_int_equal(ca_noise_average(noise, NULL, 40, 3, &all, &error), CA_OK);
        assert_int_equal(ca_noise_average(noise, (const uint32_t[]){1, 2, 2, 3}, 40, 3, &part, &error), CA_OK);
        assert_true((float)part.connect == ca_image_channel(image, "Noise.Connect")[2 * 5 + 1]);
        assert_true(ca_image_channel(image, "Noise.Connect.StdErr")[2 * 5 + 1] > 0.0f && all.connect != 0.0);
        assert_true(fabs(all.pair + all.camera + all.light + all.connect - all.predicted) <
                    1e-12 + 1e-9 * all.predicted);
        assert_int_equal(ca_noise_average(noise, NULL, 3, 4, &all, &error), CA_ERROR_ARGUMENT);
        assert_non_null(strstr(error.message, "not for 3, 4"));
        assert_int_equal(ca_noise_recommend(noise, scene, &settings, NULL, NULL, &recommendation, &error),
                         CA_ERROR_UNSUPPORTED);
        assert_non_null(strstr(error.message, "weights"));
        ca_noise_release(noise);
        ca_image_release(image);
    }
    ca_scene_release(scene);
}

/* ---- An early end ---------------------------------------------------------------------------------------------- */

/* Counts the calls, and asks for an end at one of them. */
typedef struct ending {
    uint32_t calls, end_at;
} ending;

static bool end_once(const ca_render_progress *progress, void *user)
{
    ending *e = user;
    assert_int_equal(progress->passes_done, ++e->calls);
    assert_int_equal(progress->passes_total, 50);
    return e->calls != e->end_at;
}

static void test_early_end(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(floor_text);
    for (uint32_t end_at = 1; end_at <= 5; end_at++) {
        ending e = {0, end_at};
        ca_render_settings settings = settings_of(0.5);
        settings.progress = end_once;
        settings.progress_user = &e;
        ca_noise *noise = NULL;
        ca_render_statistics statistics = {.size = sizeof statistics};
        assert_int_equal(ca_noise_measure(scene, &settings, 50, &noise, NULL, &statistics, NULL), CA_OK);
        const uint32_t made = end_at > 2 ? end_at : 2;
        assert_true(statistics.interrupted && statistics.iterations == made && e.calls == made);
        ca_noise_summary summary;
        assert_int_equal(ca_noise_average(noise, NULL, 40, 3, &summary, NULL), CA_OK);
        assert_true(noise->film.pixels[0].iterations == made && isfinite(summary.predicted) &&
                    summary.measured > 0.0);
        ca_noise_release(noise);
    }
    ca_scene_release(scene);
}

/* ---- What is refused ------------------------------------------------------------------------------------------- */

static void refuse(const ca_scene *scene, const ca_render_settings *settings, uint32_t iterations, const char *words)
{
    ca_noise *noise = NULL;
    ca_image_layers *image = NULL;
    ca_error error = {""};
    assert_int_equal(ca_noise_measure(scene, settings, iterations, &noise, &image, NULL, &error), CA_ERROR_ARGUMENT);
    assert_true(!noise && !image);
    if (!strstr(error.message, words)) fail_msg("\"%s\" is not said in \"%s\"", words, error.message);
}

#define REFUSE(field, value, words)                                                                                 \
    do {                                                                                                            \
        ca_render_settings wrong = settings_of(0.5);                                                                \
        wrong.field = value;                                                                                        \
        refuse(scene, &wrong, 4, words);                                                                            \
    } while (0)

static void test_refusals(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(floor_text);
    const ca_render_settings settings = settings_of(0.5);
    refuse(scene, &settings, 1, "in at least 2 iterations, not in 1");
    REFUSE(samples_per_pixel, 4, "cannot end it");
    REFUSE(seconds, 1.0, "cannot end it");
    REFUSE(noise_percent, 5.0, "cannot end it");
    REFUSE(rays, "auto", "the same numbers of paths for all pixels");
    REFUSE(rays, "x.exr", "the same numbers of paths for all pixels");
    REFUSE(rays_objective, "mean", "rays and their objective are for renders");
    REFUSE(replicates, 2, "replicates are for renders");
    REFUSE(has_blocks, true, "without blocks");
    REFUSE(part_path, "a.part", "without blocks");
    REFUSE(strategies_directory, "folder", "images of the strategies");
    REFUSE(sampler, "sobol", "the sampler must be \"independent\", not \"sobol\"");
    REFUSE(integrator, "path", "must be bdpt, ppm, bdpm, vcm, ovcm or vavcm, not path");
    REFUSE(light_paths, 1, "at least 2 are needed, not 1");
    REFUSE(memory_mib, 0.0076, "the film, the sums of pairs and what chooses numbers need");

    ca_noise *noise = NULL;
    ca_noise_summary summary;
    ca_error error = {""};
    ca_render_settings one = settings_of(0.5);
    one.camera_paths = 1;
    one.sampler = "independent";
    assert_int_equal(ca_noise_measure(scene, &one, 3, &noise, NULL, NULL, &error), CA_OK);
    assert_int_equal(ca_noise_average(noise, NULL, 7, 1, &summary, &error), CA_OK);
    assert_true(isfinite(summary.predicted));
    assert_int_equal(ca_noise_average(noise, NULL, 7, 2, &summary, &error), CA_ERROR_ARGUMENT);
    assert_int_equal(ca_noise_average(noise, NULL, 0, 1, &summary, &error), CA_ERROR_ARGUMENT);
    assert_int_equal(ca_noise_average(noise, NULL, 7, 0, &summary, &error), CA_ERROR_ARGUMENT);
    static const uint32_t regions[][4] = {{0, 0, 6, 4}, {0, 0, 5, 5}, {2, 2, 2, 3}, {3, 3, 4, 3}, {4, 0, 3, 2}};
    for (size_t i = 0; i < sizeof regions / sizeof regions[0]; i++)
        assert_int_equal(ca_noise_average(noise, regions[i], 7, 1, &summary, &error), CA_ERROR_ARGUMENT);
    ca_noise_release(noise);
    ca_scene_release(scene);
}

/* ---- The picture ----------------------------------------------------------------------------------------------- */

static ca_image_layers *layers_of(const float pair[200], const float camera[200], const float light[200])
{
    static const char *const names[] = {"Noise.Pair", "Noise.Camera", "Noise.Light"};
    const float *const values[] = {pair, camera, light};
    ca_image_layers *image;
    assert_int_equal(ca_layers_create(&image, 20, 10, NULL), CA_OK);
    for (int i = 0; i < 3; i++) {
        float *data;
        assert_int_equal(ca_layers_add(image, names[i], &data, NULL), CA_OK);
        memcpy(data, values[i], 200 * sizeof *data);
    }
    return image;
}

static void test_picture(void **state)
{
    (void)state;
    static float pair[200], camera[200], light[200];
    for (int i = 0; i < 200; i++) {
        pair[i] = -4.0f;
        camera[i] = 0.25f;
        light[i] = (float)(i + 1) * (float)(i + 1); /* roots 1 to 200 */
    }
    ca_image_layers *image = layers_of(pair, camera, light), *picture = NULL;
    double scale = 0.0;
    assert_int_equal(ca_noise_picture(image, &picture, &scale, NULL), CA_OK);
    assert_true(scale == 198.0); /* 99 of 100 are not above it */
    for (int i = 0; i < 200; i++) {
        assert_true(ca_image_channel(picture, "R")[i] == 0.0f);
        assert_true(fabs((double)ca_image_channel(picture, "G")[i] - 0.5 / 198.0) < 1e-9);
        assert_true(fabs((double)ca_image_channel(picture, "B")[i] - (i + 1) / 198.0) < 1e-6);
    }
    ca_layers_destroy(image);
    ca_layers_destroy(picture);
    memset(light, 0, sizeof light);
    image = layers_of(pair, light, light);
    assert_int_equal(ca_noise_picture(image, &picture, &scale, NULL), CA_OK);
    assert_true(scale == 1.0 && ca_image_channel(picture, "B")[7] == 0.0f);
    ca_layers_destroy(image);
    ca_layers_destroy(picture);
}

/* ---- Memory ---------------------------------------------------------------------------------------------------- */

static void test_memory_failures(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(floor_text);
    const ca_render_settings settings = settings_of(0.5);
    ca_status status = CA_ERROR_MEMORY;
    long count = 0;
    for (; status != CA_OK; count++) {
        ca_noise *noise = NULL;
        ca_image_layers *image = NULL, *picture = NULL;
        double scale;
        ca_memory_fail_after(count);
        status = ca_noise_measure(scene, &settings, 4, &noise, &image, NULL, NULL);
        if (status == CA_OK) status = ca_noise_picture(image, &picture, &scale, NULL);
        ca_memory_fail_after(-1);
        assert_true(status == CA_OK || status == CA_ERROR_MEMORY);
        assert_true((noise != NULL) == (image != NULL));
        ca_noise_summary summary;
        if (noise) assert_int_equal(ca_noise_average(noise, NULL, 30, 4, &summary, NULL), CA_OK);
        ca_noise_release(noise);
        ca_image_release(image);
        ca_image_release(picture);
        assert_true(count < 2000);
    }
    assert_true(count > 20);
    ca_scene_release(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_measurement), cmocka_unit_test(test_connections),
        cmocka_unit_test(test_early_end),   cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_picture),     cmocka_unit_test(test_memory_failures),
    };
    return cmocka_run_group_tests_name("measuring noise", tests, NULL, NULL);
}
