/* All metrics as maps, and their averages over regions: what counts, what does not, and that threads change
 * nothing. */
#include "base/memory.h"
#include "support/metric_pictures.h"
#include "support/named_layer.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

static const char *const map_names[] = {"SSIM",         "FLIP.LDR",     "FLIP.HDR",     "FLIP.Exposure",
                                        "Error.RMSE",   "Error.MAE",    "Error.relMSE", "Error.SMAPE",
                                        "Difference.R", "Difference.G", "Difference.B"};
enum { MAPS = sizeof map_names / sizeof map_names[0] };

static ca_image_metrics measure(const ca_image_layers *image, const ca_image_layers *reference,
                                const ca_compare_settings *region, ca_image_layers **maps)
{
    const ca_metric_settings settings = ca_metric_defaults();
    ca_image_metrics metrics;
    ca_error error = {""};
    if (ca_measure_image(image, reference, region, &settings, &metrics, maps, &error) != CA_OK)
        fail_msg("%s", error.message);
    return metrics;
}

/* Mean of the map, or of its squares, over [x0, x1) x [y0, y1) without the pixel (5, 30). */
static double mean_of(const ca_image_layers *maps, const char *name, const uint32_t rect[4], bool squares)
{
    const float *map = named_layer(maps, name);
    double sum = 0.0, count = 0.0;
    for (uint32_t y = rect[1]; y < rect[3]; y++)
        for (uint32_t x = rect[0]; x < rect[2]; x++) {
            if (x == 5 && y == 30) continue;
            const double v = (double)map[y * PAIR_WIDTH + x];
            sum += squares ? v * v : v;
            count += 1.0;
        }
    return sum / count;
}

/* The numbers are the means of the maps, those of ca_compare too. */
static void assert_numbers(const ca_comparison *c, const ca_image_metrics *m, const ca_image_layers *maps,
                           const uint32_t rect[4], const uint32_t ssim_rect[4])
{
    assert_near("RMSE", c->rmse, sqrt(mean_of(maps, "Error.RMSE", rect, true)), 1e-6);
    assert_near("MAE", c->mae, mean_of(maps, "Error.MAE", rect, false), 1e-6);
    assert_near("relMSE", c->relmse, mean_of(maps, "Error.relMSE", rect, false), 1e-6);
    assert_near("SMAPE", c->smape, mean_of(maps, "Error.SMAPE", rect, false), 1e-6);
    assert_near("SSIM", m->ssim, mean_of(maps, "SSIM", ssim_rect, false), 1e-12);
    assert_near("FLIP LDR", m->flip_ldr, mean_of(maps, "FLIP.LDR", rect, false), 1e-12);
    assert_near("FLIP HDR", m->flip_hdr, mean_of(maps, "FLIP.HDR", rect, false), 1e-12);
}

static void test_numbers_are_means_of_maps(void **state)
{
    (void)state;
    ca_image_layers *image, *reference, *whole_maps, *maps;
    make_pair(PAIR_BRIGHT, &image, &reference);
    const ca_pixel_rect mask = {5, 30, 6, 31};
    ca_compare_settings region = {.masks = &mask, .mask_count = 1};
    ca_comparison comparison;
    ca_image_metrics metrics = measure(image, reference, &region, &whole_maps);
    assert_int_equal(ca_compare(image, reference, &region, &comparison, NULL), CA_OK);
    assert_int_equal(whole_maps->channel_count, MAPS);
    /* Half a window from the border nothing is mirrored. */
    assert_numbers(&comparison, &metrics, whole_maps, (uint32_t[]){0, 0, PAIR_WIDTH, PAIR_HEIGHT},
                   (uint32_t[]){5, 5, PAIR_WIDTH - 5, PAIR_HEIGHT - 5});

    /* To the lower border, and not to it. */
    static const uint32_t bottoms[2][2] = {{PAIR_HEIGHT, PAIR_HEIGHT - 5}, {PAIR_HEIGHT - 9, PAIR_HEIGHT - 9}};
    region.has_roi = true;
    for (int b = 0; b < 2; b++) {
        region.roi = (ca_pixel_rect){2, 9, 31, bottoms[b][0]};
        metrics = measure(image, reference, &region, &maps);
        assert_int_equal(ca_compare(image, reference, &region, &comparison, NULL), CA_OK);
        assert_numbers(&comparison, &metrics, maps, (uint32_t[]){2, 9, 31, bottoms[b][0]},
                       (uint32_t[]){5, 9, 31, bottoms[b][1]});
        /* The filters look beyond the region and under the mask: the maps are the same. */
        for (int i = 0; i < MAPS; i++)
            assert_memory_equal(named_layer(maps, map_names[i]), named_layer(whole_maps, map_names[i]),
                                sizeof(float) * PAIR_PIXELS);
        ca_layers_destroy(maps);
    }
    ca_layers_destroy(whole_maps);
    ca_layers_destroy(image);
    ca_layers_destroy(reference);
}

static void test_values_of_error_maps(void **state)
{
    (void)state;
    ca_image_layers *image = metric_picture(2, 1), *reference = metric_picture(2, 1), *maps;
    fill_metric_picture(image, 1.5f, -2.0f, 0.0f);
    fill_metric_picture(reference, 1.0f, 2.0f, 0.25f);
    image->x0 = reference->x0 = 3;
    image->full_width = reference->full_width = 7;
    const ca_compare_settings whole = {0};
    const ca_image_metrics metrics = measure(image, reference, &whole, &maps);
    assert_true(isnan(metrics.ssim)); /* no window fits */
    assert_near("RMSE", (double)named_layer(maps, "Error.RMSE")[1], sqrt((0.25 + 16.0 + 0.0625) / 3.0), 1e-6);
    assert_near("MAE", (double)named_layer(maps, "Error.MAE")[1], (0.5 + 4.0 + 0.25) / 3.0, 1e-6);
    assert_near("relMSE", (double)named_layer(maps, "Error.relMSE")[1],
                (0.25 / 1.01 + 16.0 / 4.01 + 0.0625 / 0.0725) / 3.0, 1e-6);
    assert_near("SMAPE", (double)named_layer(maps, "Error.SMAPE")[1], (0.5 / 2.51 + 4.0 / 4.01 + 0.25 / 0.26) / 3.0,
                1e-6);
    assert_true(named_layer(maps, "Difference.R")[1] == 0.5f && named_layer(maps, "Difference.G")[1] == -4.0f &&
                named_layer(maps, "Difference.B")[1] == -0.25f);
    assert_true(maps->x0 == 3 && maps->full_width == 7 && maps->width == 2 && maps->full_height == 1);
    ca_layers_destroy(maps);
    ca_layers_destroy(image);
    ca_layers_destroy(reference);
}

/* A pixel that is not finite in one of the pictures adds no difference to its neighbours: as if both had the other's
 * value. */
static void test_pixels_that_are_not_finite(void **state)
{
    (void)state;
    ca_image_layers *image, *reference, *maps, *expected;
    make_pair(PAIR_NOISE, &image, &reference);
    const size_t broken = 20 * PAIR_WIDTH + 11, unknown = 33 * PAIR_WIDTH + 50, both = 7 * PAIR_WIDTH + 40;
    for (int c = 0; c < 3; c++) {
        image->channels[c].data[broken] = reference->channels[c].data[broken];
        reference->channels[c].data[unknown] = image->channels[c].data[unknown];
        image->channels[c].data[both] = reference->channels[c].data[both] = 0.0f;
    }
    const ca_pixel_rect masks[] = {{11, 20, 12, 21}, {50, 33, 51, 34}, {40, 7, 41, 8}};
    const ca_compare_settings masked = {.masks = masks, .mask_count = 3}, whole = {0};
    const ca_image_metrics m = measure(image, reference, &masked, &expected);
    image->channels[0].data[broken] = NAN;
    reference->channels[2].data[unknown] = INFINITY;
    image->channels[1].data[both] = -INFINITY;
    reference->channels[1].data[both] = NAN;
    const ca_image_metrics n = measure(image, reference, &whole, &maps);
    assert_true(m.ssim == n.ssim && m.flip_ldr == n.flip_ldr && m.flip_hdr == n.flip_hdr);
    for (int i = 0; i < MAPS; i++)
        for (size_t at = 0; at < PAIR_PIXELS; at++) {
            const float value = named_layer(maps, map_names[i])[at];
            if (at == broken || at == unknown || at == both)
                assert_true(isnan(value));
            else
                assert_true(value == named_layer(expected, map_names[i])[at]);
        }
    ca_layers_destroy(maps);
    ca_layers_destroy(expected);
    ca_layers_destroy(image);
    ca_layers_destroy(reference);
}

static void test_what_is_not_computed(void **state)
{
    (void)state;
    ca_image_layers *image, *reference, *maps;
    make_pair(PAIR_NOISE, &image, &reference);
    ca_metric_settings settings = ca_metric_defaults();
    settings.flip_ldr = settings.flip_hdr = false;
    ca_image_metrics m = measure_pair(image, reference, &settings, &maps);
    assert_true(isfinite(m.ssim) && isnan(m.flip_ldr) && isnan(m.flip_hdr) && m.exposures.count == 0);
    assert_null(ca_layers_find(maps, "FLIP.LDR"));
    assert_null(ca_layers_find(maps, "FLIP.HDR"));
    ca_layers_destroy(maps);
    /* Half of the reference is black: no exposure shows its median. */
    settings = ca_metric_defaults();
    for (size_t c = 0; c < 3; c++) memset(reference->channels[c].data, 0, sizeof(float) * PAIR_PIXELS * 5 / 8);
    m = measure_pair(image, reference, &settings, &maps);
    assert_true(isfinite(m.flip_ldr) && isnan(m.flip_hdr) && m.exposures.count == 0);
    assert_null(ca_layers_find(maps, "FLIP.HDR"));
    ca_layers_destroy(maps);
    settings.flip_exposures = (ca_flip_exposures){-1.0, 1.0, 0};
    m = measure_pair(image, reference, &settings, NULL);
    assert_true(isfinite(m.flip_hdr) && m.exposures.count == 2);
    ca_layers_destroy(image);
    ca_layers_destroy(reference);
}

/* Large enough for the workers to be at work at the same time. */
static void test_threads_change_nothing(void **state)
{
    (void)state;
    enum { WIDTH = 500, HEIGHT = 400 };
    ca_image_layers *image = metric_picture(WIDTH, HEIGHT), *reference = metric_picture(WIDTH, HEIGHT), *one,
                    *several;
    for (size_t c = 0; c < 3; c++)
        for (uint32_t i = 0; i < WIDTH * HEIGHT; i++) {
            reference->channels[c].data[i] = (float)(i * (c + 3) % 251) / 200.0f;
            image->channels[c].data[i] = reference->channels[c].data[i] + (float)(i * 7 % 31) / 100.0f;
        }
    ca_metric_settings settings = ca_metric_defaults();
    const ca_image_metrics m = measure_pair(image, reference, &settings, &one);
    settings.threads = 5;
    const ca_image_metrics n = measure_pair(image, reference, &settings, &several);
    assert_true(m.ssim == n.ssim && m.flip_ldr == n.flip_ldr && m.flip_hdr == n.flip_hdr);
    for (int i = 0; i < MAPS; i++)
        assert_memory_equal(named_layer(one, map_names[i]), named_layer(several, map_names[i]),
                            sizeof(float) * WIDTH * HEIGHT);
    ca_layers_destroy(one);
    ca_layers_destroy(several);
    ca_layers_destroy(image);
    ca_layers_destroy(reference);
}

static void test_refusals(void **state)
{
    (void)state;
    ca_image_layers *image, *reference, *maps;
    ca_image_layers *const others[] = {metric_picture(3, 3), metric_picture(PAIR_WIDTH, 3),
                                       metric_picture(3, PAIR_HEIGHT)};
    static const char *const sizes[] = {"the reference 3 x 3", "the reference 64 x 3", "the reference 3 x 48"};
    make_pair(PAIR_NOISE, &image, &reference);
    ca_metric_settings settings = ca_metric_defaults();
    ca_image_metrics metrics;
    ca_error error = {""};
    const ca_compare_settings whole = {0};
    for (int i = 0; i < 3; i++) {
        assert_int_equal(ca_measure_image(image, others[i], &whole, &settings, &metrics, &maps, &error),
                         CA_ERROR_ARGUMENT);
        assert_non_null(strstr(error.message, sizes[i]));
        assert_null(maps);
        ca_layers_destroy(others[i]);
    }
    static const ca_pixel_rect regions[] = {
        {3, 4, 3, 9}, {3, 4, 9, 4}, {9, 4, 3, 9}, {0, 0, PAIR_WIDTH + 1, 9}, {0, 0, 9, PAIR_HEIGHT + 1}};
    for (size_t i = 0; i < sizeof regions / sizeof regions[0]; i++) {
        const ca_compare_settings wrong = {.has_roi = true, .roi = regions[i]};
        assert_int_equal(ca_measure_image(image, reference, &wrong, &settings, &metrics, &maps, &error),
                         CA_ERROR_ARGUMENT);
        assert_non_null(strstr(error.message, "is empty or reaches out of the 64 x 48 pixels"));
    }
    const ca_compare_settings nothing = {.masks = &(ca_pixel_rect){0, 0, 99, 99}, .mask_count = 1};
    assert_int_equal(ca_measure_image(image, reference, &nothing, &settings, &metrics, &maps, &error),
                     CA_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, "nothing is left"));
    settings.ssim.window = 4;
    assert_int_equal(ca_measure_image(image, reference, &whole, &settings, &metrics, &maps, &error),
                     CA_ERROR_ARGUMENT);
    settings = ca_metric_defaults();
    settings.flip_exposures.start = 50.0;
    assert_int_equal(ca_measure_image(image, reference, &whole, &settings, &metrics, &maps, &error),
                     CA_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, "start at 50 stops"));
    assert_null(maps);
    /* Of all pixels one is finite: that counts; then none. */
    settings = ca_metric_defaults();
    for (size_t i = 0; i < PAIR_PIXELS; i++) image->channels[1].data[i] = i == 29 * PAIR_WIDTH + 41 ? 0.5f : NAN;
    assert_int_equal(ca_measure_image(image, reference, &whole, &settings, &metrics, NULL, &error), CA_OK);
    assert_true(isfinite(metrics.flip_ldr));
    image->channels[1].data[29 * PAIR_WIDTH + 41] = NAN;
    assert_int_equal(ca_measure_image(image, reference, &whole, &settings, &metrics, &maps, &error),
                     CA_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, "nothing is left"));
    ca_layers_destroy(image);
    ca_layers_destroy(reference);
}

static void test_each_allocation_may_fail(void **state)
{
    (void)state;
    ca_image_layers *image = metric_picture(12, 12), *reference = metric_picture(12, 12), *maps = NULL;
    fill_metric_picture(image, 1.0f, 0.5f, 0.2f);
    fill_metric_picture(reference, 1.0f, 0.4f, 0.3f);
    const ca_metric_settings settings = ca_metric_defaults();
    const ca_compare_settings whole = {0};
    ca_image_metrics metrics;
    long n = 0;
    for (;; n++) {
        ca_memory_fail_after(n);
        const ca_status status = ca_measure_image(image, reference, &whole, &settings, &metrics, &maps, NULL);
        ca_memory_fail_after(-1);
        if (status == CA_OK) break;
        assert_int_equal(status, CA_ERROR_MEMORY);
        assert_null(maps);
    }
    assert_true(n > 30);
    ca_layers_destroy(maps);
    ca_layers_destroy(image);
    ca_layers_destroy(reference);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_numbers_are_means_of_maps),
        cmocka_unit_test(test_values_of_error_maps),
        cmocka_unit_test(test_pixels_that_are_not_finite),
        cmocka_unit_test(test_what_is_not_computed),
        cmocka_unit_test(test_threads_change_nothing),
        cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_each_allocation_may_fail),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
