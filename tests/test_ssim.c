/* SSIM against numbers of an independent implementation, closed forms and its own definition without separable
 * filters. */
#include "support/metric_pictures.h"
#include "support/named_layer.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const ca_parallel one_thread = {.workers = 1};

static ca_metric_settings without_flip(void)
{
    ca_metric_settings settings = ca_metric_defaults();
    settings.flip_ldr = settings.flip_hdr = false;
    return settings;
}

/* ---- Recorded numbers ------------------------------------------------------------------------------------------ */

static void test_recorded_pairs(void **state)
{
    (void)state;
    const ca_metric_settings settings = without_flip();
    for (int kind = 0; kind < PAIR_KINDS; kind++) {
        const recorded_pair *recorded = &recorded_pairs[kind];
        ca_image_layers *image, *reference, *maps;
        make_pair((pair_kind)kind, &image, &reference);
        const ca_image_metrics metrics = measure_pair(image, reference, &settings, &maps);
        assert_near(recorded->name, metrics.ssim, recorded->ssim, 1e-6);
        const float *map = named_layer(maps, "SSIM");
        for (int i = 0; i < SPOTS; i++)
            assert_near("the map", (double)map[pair_spots[i][1] * PAIR_WIDTH + pair_spots[i][0]],
                        recorded->ssim_at[i], 2e-6);
        ca_layers_destroy(maps);
        ca_layers_destroy(image);
        ca_layers_destroy(reference);
    }
}

static void test_recorded_settings(void **state)
{
    (void)state;
    ca_image_layers *image, *reference;
    make_pair(PAIR_BRIGHT, &image, &reference);
    ca_metric_settings settings = without_flip();
    settings.ssim.window = 15;
    settings.ssim.sigma = 2.0;
    settings.ssim.range = 2.0;
    assert_near("a wide window", measure_pair(image, reference, &settings, NULL).ssim, 0.86413445, 1e-6);
    settings = without_flip();
    settings.ssim.window = 7;
    settings.ssim.sigma = 0.8;
    settings.exposure = -2.0;
    assert_near("a narrow window, darker", measure_pair(image, reference, &settings, NULL).ssim, 0.68530408, 1e-6);
    ca_layers_destroy(image);
    ca_layers_destroy(reference);
}

/* ---- Closed forms ---------------------------------------------------------------------------------------------- */

/* Without variance only the means are left. */
static void test_constant_pictures(void **state)
{
    (void)state;
    ca_image_layers *image = metric_picture(16, 12), *reference = metric_picture(16, 12);
    fill_metric_picture(image, 0.25f, 3.0f, 0.5f);
    fill_metric_picture(reference, 0.75f, 3.0f, 0.0f);
    ca_metric_settings settings = without_flip();
    settings.tone = CA_TONE_LINEAR;
    settings.ssim.range = 4.0;
    settings.ssim.k1 = 0.05;
    const double c1 = 0.2 * 0.2;
    const double expected =
        ((2 * 0.25 * 0.75 + c1) / (0.25 * 0.25 + 0.75 * 0.75 + c1) + 1.0 + c1 / (0.25 + c1)) / 3.0;
    assert_near("SSIM", measure_pair(image, reference, &settings, NULL).ssim, expected, 1e-7);
    ca_layers_destroy(image);
    ca_layers_destroy(reference);
}

static void test_equal_pictures(void **state)
{
    (void)state;
    ca_image_layers *image, *reference, *maps;
    make_pair(PAIR_BRIGHT, &image, &reference);
    const ca_metric_settings settings = without_flip();
    assert_true(measure_pair(image, image, &settings, &maps).ssim == 1.0);
    for (int i = 0; i < PAIR_PIXELS; i++) assert_true(named_layer(maps, "SSIM")[i] == 1.0f);
    ca_layers_destroy(maps);
    ca_layers_destroy(image);
    ca_layers_destroy(reference);
}

/* ---- The definition -------------------------------------------------------------------------------------------- */

/* A picture goes on as its mirror image. */
static uint32_t mirrored(int i, int count)
{
    while (i < 0 || i >= count) i = i < 0 ? -1 - i : 2 * count - 1 - i;
    return (uint32_t)i;
}

/* One window, weight by weight, with deviations from the means. */
static double slow_ssim(const float *a, const float *b, int width, int height, int x, int y,
                        const ca_ssim_settings *s)
{
    const int radius = (int)s->window / 2;
    double weight = 0.0, mean_a = 0.0, mean_b = 0.0, variance_a = 0.0, variance_b = 0.0, covariance = 0.0;
    for (int pass = 0; pass < 2; pass++)
        for (int v = -radius; v <= radius; v++)
            for (int u = -radius; u <= radius; u++) {
                const size_t at = (size_t)mirrored(y + v, height) * (size_t)width + mirrored(x + u, width);
                const double w = exp(-(u * u + v * v) / (2.0 * s->sigma * s->sigma));
                if (pass == 0) {
                    weight += w;
                    mean_a += w * (double)a[at];
                    mean_b += w * (double)b[at];
                } else {
                    const double da = (double)a[at] - mean_a / weight, db = (double)b[at] - mean_b / weight;
                    variance_a += w / weight * da * da;
                    variance_b += w / weight * db * db;
                    covariance += w / weight * da * db;
                }
            }
    mean_a /= weight;
    mean_b /= weight;
    const double c1 = pow(s->k1 * s->range, 2.0), c2 = pow(s->k2 * s->range, 2.0);
    return (2.0 * mean_a * mean_b + c1) * (2.0 * covariance + c2) /
           ((mean_a * mean_a + mean_b * mean_b + c1) * (variance_a + variance_b + c2));
}

/* Smaller than its window, so that mirrors are mirrored. */
static void test_definition_in_a_small_picture(void **state)
{
    (void)state;
    enum { W = 4, H = 3 };
    float planes[6][W * H], map[W * H];
    for (int p = 0; p < 6; p++)
        for (int i = 0; i < W * H; i++) planes[p][i] = (float)((i * 7 + p * 11 + i * i * p) % 13) / 13.0f;
    const ca_ssim_pictures pictures = {.a = {planes[0], planes[1], planes[2]},
                                       .b = {planes[3], planes[4], planes[5]},
                                       .width = W,
                                       .height = H};
    const ca_ssim_settings settings = {.window = 13, .sigma = 2.5, .range = 0.7, .k1 = 0.02, .k2 = 0.05};
    assert_int_equal(ca_ssim_map(&pictures, &settings, &one_thread, map, NULL), CA_OK);
    for (int y = 0; y < H; y++)
        for (int x = 0; x < W; x++) {
            double expected = 0.0;
            for (int c = 0; c < 3; c++) expected += slow_ssim(planes[c], planes[3 + c], W, H, x, y, &settings) / 3.0;
            assert_near("SSIM", (double)map[y * W + x], expected, 1e-6);
        }
}

static void test_even_window_is_refused(void **state)
{
    (void)state;
    ca_ssim_settings settings = CA_SSIM_DEFAULTS;
    settings.window = 10;
    const ca_ssim_pictures pictures = {.width = 1, .height = 1};
    float map;
    ca_error error = {""};
    assert_int_equal(ca_ssim_map(&pictures, &settings, &one_thread, &map, &error), CA_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, "odd side, not 10"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_recorded_pairs),       cmocka_unit_test(test_recorded_settings),
        cmocka_unit_test(test_constant_pictures),    cmocka_unit_test(test_equal_pictures),
        cmocka_unit_test(test_definition_in_a_small_picture), cmocka_unit_test(test_even_window_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
