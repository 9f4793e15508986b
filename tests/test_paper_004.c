/* The scenes of paper 004 (Keller, Grünschloß, Droske, "Quasi-Monte Carlo Progressive Photon Mapping"): passes of two
 * deterministic sequences that never pair what carries light, or pair what is the same; all pairs are right in both.
 * And the parts of figure 2. */
#include "support/scene_text.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>

#include <cmocka.h>

static ca_scene *load_from(const char *folder, const char *name)
{
    char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return bundled_scene(path);
}

static ca_scene *load(const char *name) { return load_from("paper-004", name); }

static ca_render_settings settings_of(const char *integrator, const char *sampler, uint32_t samples)
{
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.integrator = integrator;
    settings.sampler = sampler;
    settings.samples_per_pixel = samples;
    settings.threads = 1;
    return settings;
}

static ca_render_statistics statistics_of(const ca_scene *scene, const ca_render_settings *settings)
{
    ca_image_layers *image;
    ca_render_statistics statistics = {.size = sizeof statistics};
    ca_error error;
    if (ca_render(scene, settings, &image, &statistics, &error) != CA_OK) fail_msg("%s", error.message);
    ca_image_release(image);
    assert_int_equal(statistics.non_finite, 0);
    return statistics;
}

static double mean_of(const ca_scene *scene, const char *integrator, const char *sampler, uint32_t samples)
{
    const ca_render_settings settings = settings_of(integrator, sampler, samples);
    return statistics_of(scene, &settings).mean_luminance;
}

/* ---- Figure 3 -------------------------------------------------------------------------------------------------- */

static void test_interleaved_passes_are_black(void **state)
{
    (void)state;
    ca_scene *scene = load("interleaved");
    assert_true(mean_of(scene, "ppm", "halton-plain", 1000) == 0.0);
    assert_true(mean_of(scene, "ppm", "sobol-plain", 1000) == 0.0);
    assert_true(fabs(mean_of(scene, "ppm", "independent", 4000) / 0.6 - 1.0) <
                0.6); /* it is the sequences, not the scene */
    ca_scene_release(scene);
}

static void test_interleaved_pairs_are_right(void **state)
{
    (void)state;
    static const char *const samplers[] = {"halton-plain", "sobol-plain",   "lattice-plain", "halton",     "sobol",
                                           "sobol-image",  "lattice-image", "lattice",       "independent"};
    enum { SAMPLERS = sizeof samplers / sizeof samplers[0] };
    ca_scene *scene = load("interleaved");
    for (size_t i = 0; i < SAMPLERS; i++) {
        const double mean = mean_of(scene, "qmcppm:light_paths=512,camera_paths=512", samplers[i], 2048);
        print_message("    all pairs of 2048 paths, %-14s %.4f of 0.6\n", samplers[i], mean);
        assert_true(fabs(mean / 0.6 - 1.0) < (i == SAMPLERS - 1 ? 0.08 : 0.02));
    }
    ca_scene_release(scene);
}

/* ---- Section 5 ------------------------------------------------------------------------------------------------- */

/* With a radius far smaller than a pixel the only photon near a query point is its own, and that is always there. */
static void test_camera_paths_are_light_paths(void **state)
{
    (void)state;
    ca_scene *scene = load("camera-is-light");
    ca_render_settings settings = settings_of("ppm:radius=1e-5,alpha=0", "halton-plain", 3);
    const ca_render_statistics own = statistics_of(scene, &settings);
    assert_int_equal(own.camera_paths, 3 * 128 * 81);
    assert_int_equal(own.light_paths, own.camera_paths);
    assert_int_equal(own.merges, own.camera_paths);
    settings.sampler = "independent";
    assert_true(statistics_of(scene, &settings).merges < own.merges / 100);
    ca_scene_release(scene);
}

static void test_camera_is_light(void **state)
{
    (void)state;
    ca_scene *scene = load("camera-is-light");
    double means[3][2];
    static const char *const integrators[3] = {"ppm:radius_pixels=1,alpha=0.5", "ppm:radius_pixels=1,alpha=0.5",
                                               "qmcppm:total_camera_paths=2,radius_pixels=1"};
    static const char *const samplers[3] = {"halton-plain", "independent", "halton-plain"};
    for (int i = 0; i < 3; i++)
        for (int late = 0; late < 2; late++) {
            ca_render_settings settings = settings_of(integrators[i], samplers[i], late ? 24 : 4);
            settings.has_crop = true; /* away from the border */
            settings.crop[0] = 48, settings.crop[1] = 24, settings.crop[2] = 80, settings.crop[3] = 56;
            means[i][late] = statistics_of(scene, &settings).mean_luminance / 0.8;
            print_message("    %-30s %-14s %2d passes or blocks: %.3f of the truth\n", integrators[i], samplers[i],
                          late ? 24 : 4, means[i][late]);
        }
    assert_true(means[0][1] > 1.25 && means[0][1] > means[0][0] + 0.2); /* too bright, and the more the longer */
    assert_true(fabs(means[1][1] - 1.0) < 0.02);
    assert_true(fabs(means[2][1] - 1.0) < 0.02);
    ca_scene_release(scene);
}

/* ---- Figure 2 -------------------------------------------------------------------------------------------------- */

static void test_smooth_and_dirac_are_all(void **state)
{
    (void)state;
    enum { WIDTH = 32, HEIGHT = 24 };
    static const char *const kinds[3] = {"qmcppm", "qmcppm:transport=smooth", "qmcppm:transport=dirac"};
    static const char *const channels[3] = {"R", "G", "B"};
    ca_scene *scene = load("mirror-room");
    ca_image_layers *images[3];
    double sums[3] = {0};
    for (int k = 0; k < 3; k++) {
        ca_render_settings settings = settings_of(kinds[k], NULL, 3);
        settings.width = WIDTH;
        settings.height = HEIGHT;
        images[k] = render_scene(scene, &settings);
    }
    for (size_t p = 0; p < WIDTH * HEIGHT; p++)
        for (int c = 0; c < 3; c++) {
            double value[3];
            for (int k = 0; k < 3; k++) sums[k] += value[k] = (double)ca_image_channel(images[k], channels[c])[p];
            assert_true(fabs(value[1] + value[2] - value[0]) <= 1e-5 * value[0]);
        }
    assert_true(sums[1] > 0.3 * sums[0] && sums[2] > 0.1 * sums[0]);
    for (int k = 0; k < 3; k++) ca_image_release(images[k]);
    ca_scene_release(scene);
}

/* All light of the slab has gone through glass before it falls on the floor; there is nothing but paint in the
 * Cornell box. */
static void test_what_is_dirac(void **state)
{
    (void)state;
    static const char *const scenes[2] = {"glass-slab", "cornell-box"};
    static const char *const kinds[2] = {"qmcppm:transport=smooth", "qmcppm:transport=dirac"};
    for (int s = 0; s < 2; s++) {
        ca_scene *scene = load_from(scenes[s], scenes[s]);
        for (int k = 0; k < 2; k++) {
            ca_render_settings settings = settings_of(kinds[k], "halton", 2);
            settings.width = settings.height = 32;
            const double mean = statistics_of(scene, &settings).mean_luminance;
            if (s == k)
                assert_true(mean == 0.0);
            else
                assert_true(mean > 0.0);
        }
        ca_scene_release(scene);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_interleaved_passes_are_black), cmocka_unit_test(test_interleaved_pairs_are_right),
        cmocka_unit_test(test_camera_paths_are_light_paths), cmocka_unit_test(test_camera_is_light),
        cmocka_unit_test(test_smooth_and_dirac_are_all),     cmocka_unit_test(test_what_is_dirac),
    };
    return cmocka_run_group_tests_name("paper_004", tests, NULL, NULL);
}
