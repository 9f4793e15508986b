/* What paper 004 claims (Keller, Grünschloß, Droske, "Quasi-Monte Carlo Progressive Photon Mapping"), measured and
 * held against bounds: all pairs converge where passes do not, alpha trades noise for bias as section 3.1 says,
 * low-discrepancy sequences converge faster than random numbers. bench/paper_004.c measures the same in more detail,
 * for docs/papers/004.md. */
#include "support/scene_text.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { MAX_STEPS = 8, SEEDS = 8 };

static ca_image_layers *render(const ca_scene *scene, const char *integrator, const char *sampler, uint32_t samples,
                               uint64_t seed, const uint32_t *crop, uint32_t side)
{
    ca_render_settings settings;
    ca_image_layers *image = NULL;
    ca_error error;
    ca_render_settings_init(&settings);
    settings.integrator = integrator;
    settings.sampler = sampler;
    settings.samples_per_pixel = samples;
    settings.seed = seed;
    settings.has_seed = true;
    settings.width = settings.height = side;
    settings.threads = side ? 0 : 1;
    settings.has_crop = crop != NULL;
    if (crop) memcpy(settings.crop, crop, sizeof settings.crop);
    if (ca_render(scene, &settings, &image, NULL, &error) != CA_OK) fail_msg("%s", error.message);
    return image;
}

/* Slope of log y over log x. */
static double exponent(const double *x, const double *y, int count)
{
    double mean_x = 0.0, mean_y = 0.0, xx = 0.0, xy = 0.0;
    for (int i = 0; i < count; i++) mean_x += log(x[i]) / count, mean_y += log(y[i]) / count;
    for (int i = 0; i < count; i++) {
        xx += (log(x[i]) - mean_x) * (log(x[i]) - mean_x);
        xy += (log(x[i]) - mean_x) * (log(y[i]) - mean_y);
    }
    return xy / xx;
}

/* R.m.s. relative error of a grey picture's pixels. */
static double error_of(ca_image_layers *image, double truth)
{
    uint32_t width, height;
    ca_image_size(image, &width, &height);
    const float *value = ca_image_channel(image, "G");
    double sum = 0.0;
    for (uint32_t p = 0; p < width * height; p++)
        sum += ((double)value[p] / truth - 1.0) * ((double)value[p] / truth - 1.0);
    ca_image_release(image);
    return sqrt(sum / (width * height));
}

/* ---- All pairs ------------------------------------------------------------------------------------------------- */

static void test_interleaved_over_three_decades(void **state)
{
    (void)state;
    static const char *const samplers[] = {"halton-plain", "sobol-plain"};
    ca_scene *scene = bundled_scene("paper-004/interleaved");
    for (int s = 0; s < 2; s++) {
        double n[6], errors[6];
        for (int i = 0; i < 6; i++) {
            const unsigned paths = 16u << (2 * i), block = paths < 2048 ? paths : 2048;
            char integrator[64];
            snprintf(integrator, sizeof integrator, "qmcppm:light_paths=%u,camera_paths=%u", block, block);
            n[i] = paths;
            errors[i] = error_of(render(scene, integrator, samplers[s], paths, 0, NULL, 0), 0.6);
            assert_true(error_of(render(scene, "ppm", samplers[s], paths, 0, NULL, 0), 0.6) == 1.0); /* black */
        }
        print_message("    %s: error of all pairs %.2g to %.2g, exponent %.2f\n", samplers[s], errors[0], errors[5],
                      exponent(n, errors, 6));
        assert_true(exponent(n, errors, 6) < -0.7);
        assert_true(errors[5] < 0.003);
    }
    ca_scene_release(scene);
}

static void test_camera_is_light(void **state)
{
    (void)state;
    static const uint32_t crop[4] = {48, 24, 80, 56};
    ca_scene *scene = bundled_scene("paper-004/camera-is-light");
    double n[4], passes[4], pairs[4];
    for (int i = 0; i < 4; i++) {
        const uint32_t blocks = 4u << (2 * i);
        n[i] = blocks;
        passes[i] = error_of(render(scene, "ppm:radius_pixels=1,alpha=0.5", "halton-plain", blocks, 0, crop, 0), 0.8);
        pairs[i] = error_of(render(scene, "qmcppm:total_camera_paths=2,radius_pixels=1", "halton-plain", blocks, 0,
                                   crop, 0),
                            0.8);
        print_message("    %4u passes or blocks: pass by pass %.3f, all pairs %.4f\n", blocks, passes[i], pairs[i]);
    }
    assert_true(passes[3] > passes[2] && passes[2] > passes[1] && passes[3] > 1.0);
    assert_true(exponent(n, pairs, 4) < -0.35);
    assert_true(pairs[3] < 0.03);
    ca_scene_release(scene);
}

/* ---- Alpha ----------------------------------------------------------------------------------------------------- */

/* Over the seeds: standard deviation, r.m.s. over pixels, and the mean picture's relative difference from `truth`
 * under the lamp, where a disk always finds too little; both over the picture's mean. */
static void measure(const ca_scene *scene, const char *integrator, const char *sampler, uint32_t samples,
                    uint32_t side, double *deviation, double *deficit)
{
    uint32_t width = 0, height = 0;
    double *sum = NULL, *squares = NULL, *truth = NULL;
    for (uint64_t seed = 1; seed <= SEEDS; seed++) {
        ca_image_layers *image = render(scene, integrator, sampler, samples, seed, NULL, side);
        ca_image_size(image, &width, &height);
        if (!sum) {
            sum = calloc((size_t)3 * width * height, sizeof *sum);
            assert_non_null(sum);
            squares = sum + width * height;
            truth = squares + width * height;
        }
        const float *value = ca_image_channel(image, "G"), *x = ca_image_channel(image, "P.X"),
                    *z = ca_image_channel(image, "P.Z");
        for (uint32_t p = 0; p < width * height; p++) {
            sum[p] += (double)value[p];
            squares[p] += (double)value[p] * (double)value[p];
            const double s = pow((double)x[p] - 0.1, 2.0) + pow((double)z[p] + 0.05, 2.0);
            truth[p] = s < 0.2 * 0.2 ? 0.8 * 0.5 / 3.14159265358979323846 * pow(s + 0.25, -1.5) : 0.0;
        }
        ca_image_release(image);
    }
    double variance = 0.0, mean = 0.0, under_lamp = 0.0, expected = 0.0;
    const double pixels = (double)width * height;
    for (uint32_t p = 0; p < width * height; p++) {
        variance += (squares[p] - sum[p] * sum[p] / SEEDS) / (SEEDS - 1) / pixels;
        mean += sum[p] / SEEDS / pixels;
        under_lamp += truth[p] > 0.0 ? sum[p] / SEEDS : 0.0;
        expected += truth[p];
    }
    *deviation = sqrt(variance) / mean;
    *deficit = 1.0 - under_lamp / expected;
    free(sum);
}

static void test_alpha(void **state)
{
    (void)state;
    enum { STEPS = 5 };
    static const double alphas[3] = {0.0, 0.5, 1.0};
    ca_scene *scene = bundled_scene("paper-004/pointwise");
    for (int a = 0; a < 3; a++) {
        double n[STEPS], noise[STEPS], bias[STEPS], unused;
        for (int i = 0; i < STEPS; i++) {
            char integrator[128];
            snprintf(integrator, sizeof integrator, "qmcppm:alpha=%g,total_camera_paths=1,total_light_paths=%u",
                     alphas[a], 4096u << i);
            n[i] = 4096u << i;
            measure(scene, integrator, "independent", 1u << i, 32, &noise[i], &unused);
            measure(scene, integrator, "halton", 1u << i, 32, &unused, &bias[i]);
        }
        const double of_noise = exponent(n, noise, STEPS), of_bias = exponent(n, bias, STEPS);
        print_message(
            "    alpha = %g: noise %.4f to %.4f, exponent %.3f (%.3f); bias %.4f to %.4f, exponent %.2f (%.2f)\n",
            alphas[a], noise[0], noise[STEPS - 1], of_noise, -0.5 * (1.0 - alphas[a]), bias[0], bias[STEPS - 1],
            of_bias, -alphas[a]);
        assert_true(fabs(of_noise + 0.5 * (1.0 - alphas[a])) < 0.06);
        assert_true(fabs(of_bias + alphas[a]) < 0.15);
    }
    ca_scene_release(scene);
}

/* ---- Sequences ------------------------------------------------------------------------------------------------- */

static void test_sequences_beat_random_numbers(void **state)
{
    (void)state;
    enum { STEPS = 4 };
    static const char *const samplers[] = {"independent", "halton", "sobol", "lattice"};
    ca_scene *scene = bundled_scene("cornell-box/cornell-box");
    double n[STEPS], deviations[4][STEPS], unused;
    for (int s = 0; s < 4; s++) {
        for (int i = 0; i < STEPS; i++) {
            n[i] = 2u << i;
            measure(scene, "qmcppm:hide_emitters=true,radius=30,light_paths=4096", samplers[s], 2u << i, 32,
                    &deviations[s][i], &unused);
        }
        print_message("    %-12s standard deviation %.4f to %.4f, exponent %.2f, at the end %.2f of random's\n",
                      samplers[s], deviations[s][0], deviations[s][STEPS - 1], exponent(n, deviations[s], STEPS),
                      deviations[s][STEPS - 1] / deviations[0][STEPS - 1]);
    }
    for (int s = 1; s < 4; s++) {
        assert_true(deviations[s][STEPS - 1] < 0.8 * deviations[0][STEPS - 1]);
        assert_true(exponent(n, deviations[s], STEPS) < exponent(n, deviations[0], STEPS) - 0.05);
    }
    ca_scene_release(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_interleaved_over_three_decades),
        cmocka_unit_test(test_camera_is_light),
        cmocka_unit_test(test_alpha),
        cmocka_unit_test(test_sequences_beat_random_numbers),
    };
    return cmocka_run_group_tests_name("paper 004", tests, NULL, NULL);
}
