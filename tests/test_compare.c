/* Comparing pictures: metrics against closed forms, and a block test that rejects as often as it says. */
#include "metrics/compare.h"
#include "metrics/significance.h"
#include "support/named_layer.h"
#include "support/test_random.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static const char *const layer_names[7] = {"R", "G", "B", "Variance.R", "Variance.G", "Variance.B", "Samples.Y"};

static void assert_near(double value, double expected, double tolerance)
{
    if (!(fabs(value - expected) <= tolerance)) fail_msg("%.17g instead of %.17g", value, expected);
}

/* A black picture; with `variance` also the layers of its noise. */
static ca_image_layers *make_picture(uint32_t width, uint32_t height, bool variance)
{
    ca_image_layers *layers = NULL;
    assert_int_equal(ca_layers_create(&layers, width, height, NULL), CA_OK);
    for (int i = 0; i < (variance ? 7 : 3); i++) {
        float *data = NULL;
        assert_int_equal(ca_layers_add(layers, layer_names[i], &data, NULL), CA_OK);
    }
    return layers;
}

static void fill(ca_image_layers *layers, const char *name, float value)
{
    float *data = named_layer(layers, name);
    for (size_t i = 0; i < (size_t)layers->width * layers->height; i++) data[i] = value;
}

static void fill_colors(ca_image_layers *layers, float r, float g, float b)
{
    fill(layers, "R", r);
    fill(layers, "G", g);
    fill(layers, "B", b);
}

static ca_comparison compare(const ca_image_layers *image, const ca_image_layers *reference,
                             const ca_compare_settings *settings)
{
    ca_comparison comparison;
    ca_error error = {""};
    const ca_compare_settings none = {0};
    const ca_status status = ca_compare(image, reference, settings ? settings : &none, &comparison, &error);
    if (status != CA_OK) fail_msg("%s", error.message);
    return comparison;
}

static double standard_normal(ca_test_random *random)
{
    const double u = 1.0 - (double)ca_test_random_float(random), v = (double)ca_test_random_float(random);
    return sqrt(-2.0 * log(u)) * cos(6.28318530717958647692 * v);
}

/* What a renderer would have written: `samples` normal samples per pixel and channel around a mean that varies over
 * the picture, their mean and their sample variance. */
static void render_part(ca_image_layers *layers, ca_test_random *random, ca_pixel_rect part, uint32_t samples,
                        double scale, double sigma)
{
    float *count = named_layer(layers, "Samples.Y");
    for (int c = 0; c < 3; c++) {
        float *color = named_layer(layers, layer_names[c]), *variance = named_layer(layers, layer_names[3 + c]);
        for (uint32_t y = part.y0; y < part.y1; y++)
            for (uint32_t x = part.x0; x < part.x1; x++) {
                const size_t i = (size_t)y * layers->width + x;
                const double mean = scale * (1.0 + 0.5 * sin(0.1 * (double)i + c));
                double sum = 0.0, squares = 0.0;
                for (uint32_t s = 0; s < samples; s++) {
                    const double noise = sigma * standard_normal(random);
                    sum += noise;
                    squares += noise * noise;
                }
                count[i] = (float)samples;
                color[i] = (float)(mean + sum / samples);
                variance[i] = (float)((squares - sum * sum / samples) / (samples - 1));
            }
    }
}

static void render_noise(ca_image_layers *layers, ca_test_random *random, uint32_t samples, double scale,
                         double sigma)
{
    render_part(layers, random, (ca_pixel_rect){0, 0, layers->width, layers->height}, samples, scale, sigma);
}

/* ---- Metrics --------------------------------------------------------------------------------------------------- */

static void test_metrics_of_constant_pictures(void **state)
{
    (void)state;
    ca_image_layers *image = make_picture(20, 10, false), *reference = make_picture(20, 10, false);
    fill_colors(image, 1.5f, 2.0f, 0.0f);
    fill_colors(reference, 1.0f, 2.0f, 0.25f);
    const ca_comparison c = compare(image, reference, NULL);
    assert_near(c.rmse, sqrt((0.25 + 0.0625) / 3.0), 1e-12);
    assert_near(c.mae, 0.75 / 3.0, 1e-12);
    assert_near(c.relmse, (0.25 / 1.01 + 0.0625 / 0.0725) / 3.0, 1e-12);
    assert_near(c.smape, (0.5 / 2.51 + 0.25 / 0.26) / 3.0, 1e-12);
    assert_near(c.mean_luminance, 0.2126 * 1.5 + 0.7152 * 2.0, 1e-6);
    assert_near(c.reference_mean_luminance, 0.2126 + 0.7152 * 2.0 + 0.0722 * 0.25, 1e-6);
    const double expected = fabs(c.mean_luminance / c.reference_mean_luminance - 1.0);
    assert_near(c.median_block_difference, expected, 1e-6);
    assert_int_equal(c.pixels, 200);
    assert_int_equal(c.blocks, 2); /* 4 x 10 pixels are a quarter of a block */
    assert_int_equal(c.blocks_left_out, 0);
    assert_false(c.test.done);
    ca_layers_destroy(image);
    ca_layers_destroy(reference);
}

static void test_equal_pictures(void **state)
{
    (void)state;
    ca_image_layers *image = make_picture(32, 32, true);
    ca_test_random random = ca_test_random_seed(1);
    render_noise(image, &random, 4, 1.0, 0.1);
    const ca_comparison c = compare(image, image, NULL);
    assert_true(c.rmse == 0.0 && c.mae == 0.0 && c.relmse == 0.0 && c.smape == 0.0 &&
                c.median_block_difference == 0.0);
    assert_int_equal(c.test.rejected, 0);
    assert_true(c.test.done && c.test.p_value == 1.0);
    ca_layers_destroy(image);
}

static void test_region_and_masks(void **state)
{
    (void)state;
    ca_image_layers *image = make_picture(64, 64, false), *reference = make_picture(64, 64, false);
    fill_colors(image, 1.0f, 1.0f, 1.0f);
    fill_colors(reference, 1.0f, 1.0f, 1.0f);
    named_layer(image, "R")[5 * 64 + 5] = 100.0f;
    named_layer(image, "G")[40 * 64 + 20] = NAN;
    ca_compare_settings settings = {.masks = &(ca_pixel_rect){5, 5, 6, 6}, .mask_count = 1};
    ca_comparison c = compare(image, reference, &settings);
    assert_true(c.rmse == 0.0);
    assert_int_equal(c.masked, 1);
    assert_int_equal(c.non_finite, 1);
    assert_int_equal(c.pixels, 64 * 64 - 2);

    settings = (ca_compare_settings){.has_roi = true, .roi = {4, 5, 6, 9}};
    c = compare(image, reference, &settings);
    assert_near(c.mae, 99.0 / (3.0 * 8.0), 1e-12);
    assert_int_equal(c.pixels, 8);
    assert_int_equal(c.blocks, 1);
    assert_int_equal(c.blocks_left_out, 0);
    assert_int_equal(c.non_finite, 0);
    settings.roi = (ca_pixel_rect){16, 16, 48, 64};
    c = compare(image, reference, &settings);
    assert_int_equal(c.blocks, 6);
    assert_int_equal(c.blocks_left_out, 0);
    ca_layers_destroy(image);
    ca_layers_destroy(reference);
}

static void test_masked_blocks_are_left_out(void **state)
{
    (void)state;
    ca_image_layers *image = make_picture(32, 16, false), *reference = make_picture(32, 16, false);
    fill_colors(image, 1.1f, 1.1f, 1.1f);
    fill_colors(reference, 1.0f, 1.0f, 1.0f);
    /* 3 of the 16 rows of the first block stay: less than a quarter. */
    const ca_compare_settings settings = {.masks = &(ca_pixel_rect){0, 3, 16, 99}, .mask_count = 1};
    const ca_comparison c = compare(image, reference, &settings);
    assert_int_equal(c.blocks, 1);
    assert_int_equal(c.blocks_left_out, 1);
    ca_layers_destroy(image);
    ca_layers_destroy(reference);
}

static void assert_refused(const ca_image_layers *image, const ca_image_layers *reference,
                           const ca_compare_settings *settings, const char *words)
{
    ca_comparison comparison;
    ca_error error = {""};
    assert_int_equal(ca_compare(image, reference, settings, &comparison, &error), CA_ERROR_ARGUMENT);
    if (!strstr(error.message, words)) fail_msg("\"%s\" does not say \"%s\"", error.message, words);
}

static void test_refusals(void **state)
{
    (void)state;
    ca_image_layers *image = make_picture(8, 8, false), *other = make_picture(8, 9, false), *empty = NULL;
    assert_int_equal(ca_layers_create(&empty, 8, 8, NULL), CA_OK);
    const ca_compare_settings none = {0};
    const ca_compare_settings outside = {.has_roi = true, .roi = {0, 0, 9, 8}};
    const ca_compare_settings nothing = {.has_roi = true, .roi = {3, 3, 3, 8}};
    const ca_compare_settings all_masked = {.masks = &(ca_pixel_rect){0, 0, 8, 8}, .mask_count = 1};
    assert_refused(image, other, &none, "8 x 8");
    assert_refused(image, other, &none, "8 x 9");
    assert_refused(empty, image, &none, "the image has no channel R");
    assert_refused(image, empty, &none, "the reference has no channel R");
    assert_refused(image, image, &outside, "0,0,9,8");
    assert_refused(image, image, &nothing, "3,3,3,8");
    assert_refused(image, image, &all_masked, "nothing is left");
    ca_image_layers *moved = make_picture(8, 8, false);
    image->full_width = moved->full_width = 20;
    moved->x0 = 3;
    assert_refused(image, moved, &none, "different parts");
    /* The same pixels of films of two sizes; what tells no film, or only where its data ends, may be of either. */
    ca_comparison comparison;
    image->x0 = 3;
    moved->full_width = 24;
    assert_refused(image, moved, &none,
                   "8 x 8 pixels from (3, 0) of a film of 20 x 8, and from (3, 0) of one of 24 x 8");
    moved->full_width = 11;
    assert_int_equal(ca_compare(image, moved, &none, &comparison, NULL), CA_OK);
    moved->x0 = 4, moved->full_width = 12;
    assert_refused(image, moved, &none, "from (4, 0) of one of 12 x 8");
    moved->x0 = 0, moved->full_width = 8;
    assert_int_equal(ca_compare(image, moved, &none, &comparison, NULL), CA_OK);
    ca_layers_destroy(image);
    ca_layers_destroy(other);
    ca_layers_destroy(empty);
    ca_layers_destroy(moved);
}

/* ---- Statistics ------------------------------------------------------------------------------------------------ */

static void test_significance_functions(void **state)
{
    (void)state;
    /* Abramowitz and Stegun's tables of the normal and of Student's t distribution, and closed forms for 1 and 2
     * degrees of freedom. */
    assert_near(ca_normal_cdf(1.0), 0.841344746068543, 1e-14);
    assert_near(ca_normal_two_sided_quantile(0.05), 1.959963984540054, 1e-12);
    assert_near(ca_student_two_sided_p(1.0, 1.0), 0.5, 1e-13);
    assert_near(ca_student_two_sided_p(3.0, 2.0), 1.0 - 3.0 / sqrt(11.0), 1e-13);
    assert_near(ca_student_two_sided_p(2.228, 10.0), 0.05, 1e-4);
    assert_near(ca_student_two_sided_p(2.042, 30.0), 0.05, 1e-4);
    assert_near(ca_student_two_sided_p(-2.0, 1e5), ca_student_two_sided_p(2.0, (double)INFINITY), 1e-5);
    assert_near(ca_sidak_alpha(0.05, 1), 0.05, 1e-15);
    assert_near(ca_sidak_p(ca_sidak_alpha(0.05, 1000), 1000), 0.05, 1e-12);
}

/* Share of `pairs` pictures without any difference in which some block is rejected. */
static double false_alarm_rate(uint32_t pairs, uint32_t size, uint32_t block_side, uint32_t samples, uint64_t seed)
{
    ca_image_layers *a = make_picture(size, size, true), *b = make_picture(size, size, true);
    ca_test_random random = ca_test_random_seed(seed);
    const ca_compare_settings settings = {.block_side = block_side};
    uint32_t alarms = 0;
    for (uint32_t i = 0; i < pairs; i++) {
        render_noise(a, &random, samples, 1.0, 0.4);
        render_noise(b, &random, samples + 2, 1.0, 0.8);
        const ca_comparison c = compare(a, b, &settings);
        assert_true(c.test.done && !c.test.reference_exact);
        assert_true((c.test.rejected > 0) == (c.test.p_value < CA_COMPARE_ALPHA));
        alarms += c.test.rejected > 0;
    }
    ca_layers_destroy(a);
    ca_layers_destroy(b);
    return (double)alarms / pairs;
}

static void assert_five_percent(double rate, uint32_t pairs)
{
    const double deviation = sqrt(0.05 * 0.95 / pairs);
    print_message("rejected %.2f %% of %u pairs, expected 5.00 +- %.2f\n", 100.0 * rate, pairs, 100.0 * deviation);
    assert_true(fabs(rate - 0.05) < 3.0 * deviation);
}

static void test_false_alarm_rate(void **state)
{
    (void)state;
    assert_five_percent(false_alarm_rate(400, 32, 16, 8, 7), 400);
}

/* Few samples in few pixels: with the normal distribution instead of Student's this would be above 20 %. */
static void test_false_alarm_rate_of_small_blocks(void **state)
{
    (void)state;
    assert_five_percent(false_alarm_rate(400, 16, 2, 4, 11), 400);
}

static void test_injected_bias_is_found(void **state)
{
    (void)state;
    ca_image_layers *a = make_picture(64, 64, true), *b = make_picture(64, 64, true);
    ca_test_random random = ca_test_random_seed(3);
    uint32_t found = 0;
    double promised = 0.0;
    for (int i = 0; i < 40; i++) {
        render_noise(a, &random, 16, 1.02, 0.25);
        render_noise(b, &random, 16, 1.0, 0.25);
        const ca_comparison c = compare(a, b, NULL);
        found += c.test.rejected > 0;
        promised += c.test.detectable_bias / 40.0;
    }
    print_message("2 %% of bias found in %u of 40 pairs; said to detect %.2f %%\n", found, 100.0 * promised);
    assert_true(promised < 0.02);
    assert_true(found >= 32);
    ca_layers_destroy(a);
    ca_layers_destroy(b);
}

enum { PARTS = 8, BLOCK = 16, ROWS = 120, SEEDS = 300 };

/* A row of blocks: the first half of them a sky with next to no noise, then ever more noise. The block of number
 * `biased` is (1 + bias) times too bright; PARTS: none is. */
static void render_row(ca_image_layers *layers, ca_test_random *random, uint32_t biased, double bias)
{
    for (uint32_t i = 0; i < PARTS; i++) {
        const double sigma = i < PARTS / 2 ? 1e-3 : 0.2 * (1.0 + i - PARTS / 2);
        render_part(layers, random, (ca_pixel_rect){i * BLOCK, 0, (i + 1) * BLOCK, BLOCK}, 8,
                    i == biased ? 1.0 + bias : 1.0, sigma);
    }
}

static double share_found(uint32_t biased, double bias)
{
    ca_image_layers *a = make_picture(PARTS * BLOCK, BLOCK, true), *b = make_picture(PARTS * BLOCK, BLOCK, true);
    ca_test_random random = ca_test_random_seed(5 + biased);
    int found = 0;
    for (int i = 0; i < ROWS; i++) {
        render_row(a, &random, biased, bias);
        render_row(b, &random, PARTS, 0.0);
        found += compare(a, b, NULL).test.rejected > 0;
    }
    ca_layers_destroy(a);
    ca_layers_destroy(b);
    return (double)found / ROWS;
}

/* The promise itself: of the four blocks with noise (sigma 0.2 to 0.8) two show a bias of exactly the detectable size
 * in four of five pictures or more, and two more rarely. The sky, which would show a hundredth of it, has no say. */
static void test_detectable_bias_is_what_is_detected(void **state)
{
    (void)state;
    ca_image_layers *a = make_picture(PARTS * BLOCK, BLOCK, true), *b = make_picture(PARTS * BLOCK, BLOCK, true);
    ca_test_random random = ca_test_random_seed(5);
    render_row(a, &random, PARTS, 0.0);
    render_row(b, &random, PARTS, 0.0);
    const ca_block_test test = compare(a, b, NULL).test;
    assert_int_equal(test.blocks, PARTS);
    assert_int_equal(test.blocks_with_noise, PARTS / 2);
    const double bias = test.detectable_bias, tolerance = 3.0 * sqrt(0.8 * 0.2 / ROWS);
    double found[PARTS];
    for (uint32_t i = PARTS / 2; i < PARTS; i++) found[i] = share_found(i, bias);
    print_message("bias %.2f %% found in %.0f, %.0f, %.0f and %.0f %% of the pictures\n", 100.0 * bias,
                  100.0 * found[4], 100.0 * found[5], 100.0 * found[6], 100.0 * found[7]);
    assert_true(found[4] > 0.8 - tolerance && found[5] > 0.8 - tolerance);
    assert_true(found[6] < 0.8 + tolerance && found[7] < 0.8 + tolerance);
    ca_layers_destroy(a);
    ca_layers_destroy(b);
}

/* With one amount of noise everywhere every block is typical, and the probability of finding is the promised one. */
static void test_detectable_bias_of_one_block(void **state)
{
    (void)state;
    ca_image_layers *a = make_picture(32, 32, true), *b = make_picture(32, 32, true);
    ca_test_random random = ca_test_random_seed(5);
    render_noise(a, &random, 16, 1.0, 0.5);
    render_noise(b, &random, 16, 1.0, 0.5);
    const double bias = compare(a, b, NULL).test.detectable_bias;
    int found = 0;
    for (int i = 0; i < SEEDS; i++) {
        render_noise(a, &random, 16, 1.0, 0.5);
        render_noise(b, &random, 16, 1.0, 0.5);
        const uint32_t x = i % 2 ? BLOCK : 0, y = i / 2 % 2 ? BLOCK : 0;
        render_part(a, &random, (ca_pixel_rect){x, y, x + BLOCK, y + BLOCK}, 16, 1.0 + bias, 0.5);
        found += compare(a, b, NULL).test.rejected > 0;
    }
    print_message("bias %.2f %% of a block found in %.1f %% of %d pairs\n", 100.0 * bias, 100.0 * found / SEEDS,
                  SEEDS);
    assert_true(fabs((double)found / SEEDS - 0.8) < 3.0 * sqrt(0.8 * 0.2 / SEEDS));
    ca_layers_destroy(a);
    ca_layers_destroy(b);
}

/* Nothing can be said of pictures without noise, and none of dark blocks. */
static void test_detectable_bias_without_noise(void **state)
{
    (void)state;
    ca_image_layers *a = make_picture(32, 16, true), *b = make_picture(32, 16, true);
    fill_colors(a, 1.0f, 1.0f, 1.0f);
    fill_colors(b, 1.0f, 1.0f, 1.0f);
    fill(a, "Samples.Y", 4.0f);
    fill(b, "Samples.Y", 4.0f);
    ca_block_test test = compare(a, b, NULL).test;
    assert_true(test.done && test.blocks_with_noise == 0 && isnan(test.detectable_bias));
    fill(a, "Variance.R", 1.0f);
    fill_colors(b, 0.0f, 0.0f, 0.0f);
    test = compare(a, b, NULL).test;
    assert_true(test.blocks_with_noise == 2 && isinf(test.detectable_bias));
    ca_layers_destroy(a);
    ca_layers_destroy(b);
}

/* One pixel of few samples against an exact one: Student's distribution with two degrees has a closed form. Of two
 * pixels, variances v and V with n and N samples have (v + V)^2 / (v^2 / (n - 1) + V^2 / (N - 1)) degrees. */
static void test_degrees_of_freedom(void **state)
{
    (void)state;
    ca_image_layers *image = make_picture(1, 1, true), *exact = make_picture(1, 1, false);
    fill(image, "Samples.Y", 3.0f);
    for (int i = 3; i < 6; i++) fill(image, layer_names[i], 12.0f); /* of the mean: 4 */
    fill_colors(image, 105.0f, 100.0f, 100.0f);
    fill_colors(exact, 100.0f, 100.0f, 100.0f);
    const double t = 5.0 / 2.0, p = 1.0 - t / sqrt(2.0 + t * t);
    assert_near(compare(image, exact, NULL).test.p_value, 1.0 - pow(1.0 - p, 3.0), 1e-4);
    ca_layers_destroy(exact);
    exact = make_picture(1, 1, true);
    fill(exact, "Samples.Y", 5.0f);
    for (int i = 3; i < 6; i++) fill(exact, layer_names[i], 40.0f); /* of the mean: 8 */
    fill_colors(exact, 100.0f, 100.0f, 100.0f);
    const double degrees = 144.0 / (16.0 / 2.0 + 64.0 / 4.0);
    const double both = ca_student_two_sided_p(5.0 / sqrt(12.0), degrees);
    assert_near(compare(image, exact, NULL).test.p_value, 1.0 - pow(1.0 - both, 3.0), 1e-4);
    ca_layers_destroy(image);
    ca_layers_destroy(exact);
}

static void test_exact_reference_and_unknown_variance(void **state)
{
    (void)state;
    ca_image_layers *a = make_picture(32, 16, true), *b = make_picture(32, 16, false);
    ca_test_random random = ca_test_random_seed(9);
    render_noise(a, &random, 8, 1.0, 0.1);
    for (int c = 0; c < 3; c++)
        memcpy(named_layer(b, layer_names[c]), named_layer(a, layer_names[c]), sizeof(float) * 32 * 16);
    ca_comparison c = compare(a, b, NULL);
    assert_true(c.test.done && c.test.reference_exact);
    assert_int_equal(c.test.blocks, 2);
    named_layer(a, "Samples.Y")[3] = 1.0f;
    c = compare(a, b, NULL);
    assert_int_equal(c.test.blocks, 1);
    assert_int_equal(c.test.blocks_untested, 1);
    static const float unknown[] = {-1e-6f, INFINITY, NAN};
    float *variance = named_layer(a, "Variance.G");
    const float known = variance[20];
    for (int i = 0; i < 3; i++) {
        variance[20] = unknown[i];
        assert_int_equal(compare(a, b, NULL).test.blocks_untested, 2); /* of the other block */
    }
    variance[20] = known;
    c = compare(b, a, NULL); /* the image's own noise is not known */
    assert_false(c.test.done);

    /* Light seen directly has no variance: any real difference is one, rounding is none. */
    fill(a, "Samples.Y", 8.0f);
    for (int i = 3; i < 6; i++) fill(a, layer_names[i], 0.0f);
    fill_colors(a, 3.0f, 3.0f, 3.0f);
    fill_colors(b, nextafterf(3.0f, 4.0f), 3.0f, 3.0f);
    assert_int_equal(compare(a, b, NULL).test.rejected, 0);
    fill_colors(b, 3.001f, 3.0f, 3.0f);
    assert_int_equal(compare(a, b, NULL).test.rejected, 2);
    ca_layers_destroy(a);
    ca_layers_destroy(b);
}

/* ---- Downsampling ---------------------------------------------------------------------------------------------- */

static void test_downsampling_keeps_means_and_their_variance(void **state)
{
    (void)state;
    ca_image_layers *large = make_picture(6, 4, true), *small = NULL;
    for (size_t i = 0; i < 24; i++) {
        named_layer(large, "R")[i] = (float)i;
        named_layer(large, "Variance.R")[i] = (float)(i + 1);
        named_layer(large, "Samples.Y")[i] = i % 2 ? 2.0f : 4.0f;
    }
    assert_int_equal(ca_compare_downsample(large, 2, &small, NULL), CA_OK);
    assert_int_equal(small->width, 3);
    assert_int_equal(small->height, 2);
    /* The second pixel of the first row: 2, 3, 8, 9. */
    assert_near((double)ca_layers_find(small, "R")[1], 5.5, 1e-6);
    const double samples = (double)ca_layers_find(small, "Samples.Y")[1];
    assert_near(samples, 12.0, 1e-6);
    const double variance_of_mean = (double)ca_layers_find(small, "Variance.R")[1] / samples;
    assert_near(variance_of_mean, (3.0 / 4.0 + 4.0 / 2.0 + 9.0 / 4.0 + 10.0 / 2.0) / 16.0, 1e-6);
    ca_layers_destroy(small);

    /* The place in the film and the film shrink likewise, or there is no such place. */
    large->x0 = 2, large->y0 = -4, large->full_width = 10, large->full_height = 8;
    assert_int_equal(ca_compare_downsample(large, 2, &small, NULL), CA_OK);
    assert_true(small->x0 == 1 && small->y0 == -2 && small->full_width == 5 && small->full_height == 4);
    ca_layers_destroy(small);
    for (int i = 0; i < 4; i++) {
        const int odd = i + 1;
        large->x0 = 2 + (odd == 1), large->y0 = -4 - (odd == 2);
        large->full_width = 10 + (odd == 3), large->full_height = 8 + (odd == 4);
        assert_int_equal(ca_compare_downsample(large, 2, &small, NULL), CA_ERROR_ARGUMENT);
    }
    large->x0 = large->y0 = 0, large->full_width = 6, large->full_height = 4;

    assert_int_equal(ca_compare_downsample(large, 3, &small, NULL), CA_ERROR_ARGUMENT);
    assert_int_equal(ca_compare_downsample(large, 0, &small, NULL), CA_ERROR_ARGUMENT);
    ca_layers_destroy(large);
}

static void test_out_of_memory(void **state)
{
    (void)state;
    ca_image_layers *image = make_picture(32, 32, true), *small = NULL;
    ca_comparison comparison;
    const ca_compare_settings none = {0};
    for (int i = 0; i < 2; i++) {
        ca_memory_fail_after(i);
        const ca_status status = ca_compare(image, image, &none, &comparison, NULL);
        ca_memory_fail_after(-1);
        assert_int_equal(status, CA_ERROR_MEMORY);
    }
    ca_status status = CA_ERROR_MEMORY;
    int failures = 0;
    for (; status != CA_OK; failures++) {
        ca_memory_fail_after(failures);
        status = ca_compare_downsample(image, 2, &small, NULL);
        ca_memory_fail_after(-1);
        assert_true(status == CA_OK || (status == CA_ERROR_MEMORY && small == NULL));
    }
    assert_true(failures > 7);
    ca_layers_destroy(small);
    ca_layers_destroy(image);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_metrics_of_constant_pictures),
        cmocka_unit_test(test_equal_pictures),
        cmocka_unit_test(test_region_and_masks),
        cmocka_unit_test(test_masked_blocks_are_left_out),
        cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_significance_functions),
        cmocka_unit_test(test_false_alarm_rate),
        cmocka_unit_test(test_false_alarm_rate_of_small_blocks),
        cmocka_unit_test(test_injected_bias_is_found),
        cmocka_unit_test(test_detectable_bias_is_what_is_detected),
        cmocka_unit_test(test_detectable_bias_of_one_block),
        cmocka_unit_test(test_detectable_bias_without_noise),
        cmocka_unit_test(test_degrees_of_freedom),
        cmocka_unit_test(test_exact_reference_and_unknown_variance),
        cmocka_unit_test(test_downsampling_keeps_means_and_their_variance),
        cmocka_unit_test(test_out_of_memory),
    };
    return cmocka_run_group_tests_name("compare", tests, NULL, NULL);
}
