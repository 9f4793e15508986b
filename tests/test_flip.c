/* FLIP against numbers of an independent implementation, closed forms, and the choice of exposures; tone curves. */
#include "support/metric_pictures.h"
#include "support/named_layer.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

static const ca_parallel one_thread = {.workers = 1};

/* ---- Recorded numbers ------------------------------------------------------------------------------------------ */

static void assert_exposures(const ca_flip_exposures *e, const ca_flip_exposures *expected)
{
    assert_near("the first exposure", e->start, expected->start, 1e-6);
    assert_near("the last exposure", e->stop, expected->stop, 1e-6);
    assert_int_equal(e->count, expected->count);
}

static void test_recorded_pairs(void **state)
{
    (void)state;
    const ca_metric_settings settings = ca_metric_defaults();
    for (int kind = 0; kind < PAIR_KINDS; kind++) {
        const recorded_pair *recorded = &recorded_pairs[kind];
        ca_image_layers *image, *reference, *maps;
        make_pair((pair_kind)kind, &image, &reference);
        const ca_image_metrics metrics = measure_pair(image, reference, &settings, &maps);
        assert_near(recorded->name, metrics.flip_ldr, recorded->flip_ldr, 2e-6);
        assert_near(recorded->name, metrics.flip_hdr, recorded->flip_hdr, 2e-6);
        assert_exposures(&metrics.exposures, &recorded->exposures);
        for (int i = 0; i < SPOTS; i++) {
            const size_t at = pair_spots[i][1] * PAIR_WIDTH + pair_spots[i][0];
            assert_near("FLIP.LDR", (double)named_layer(maps, "FLIP.LDR")[at], recorded->flip_ldr_at[i], 2e-5);
            assert_near("FLIP.HDR", (double)named_layer(maps, "FLIP.HDR")[at], recorded->flip_hdr_at[i], 2e-5);
        }
        ca_layers_destroy(maps);
        ca_layers_destroy(image);
        ca_layers_destroy(reference);
    }
}

static void test_recorded_distances(void **state)
{
    (void)state;
    ca_image_layers *image, *reference;
    make_pair(PAIR_BRIGHT, &image, &reference);
    ca_metric_settings settings = ca_metric_defaults();
    settings.flip_hdr = false;
    settings.pixels_per_degree = 20.0;
    assert_near("from far", measure_pair(image, reference, &settings, NULL).flip_ldr, 0.25637067, 2e-6);
    settings.pixels_per_degree = 120.0;
    assert_near("from near", measure_pair(image, reference, &settings, NULL).flip_ldr, 0.10925413, 2e-6);
    settings.pixels_per_degree = CA_FLIP_PIXELS_PER_DEGREE;
    settings.exposure = 1.0;
    assert_near("brighter", measure_pair(image, reference, &settings, NULL).flip_ldr, 0.13511136, 2e-6);
    ca_layers_destroy(image);
    ca_layers_destroy(reference);
}

static void test_recorded_tone_curves(void **state)
{
    (void)state;
    ca_image_layers *image, *reference;
    make_pair(PAIR_BRIGHT, &image, &reference);
    ca_metric_settings settings = ca_metric_defaults();
    settings.flip_ldr = false;
    settings.flip_tone = CA_TONE_HABLE;
    ca_image_metrics metrics = measure_pair(image, reference, &settings, NULL);
    assert_near("hable", metrics.flip_hdr, 0.13725179, 2e-6);
    assert_exposures(&metrics.exposures, &(ca_flip_exposures){-2.2537603, 3.1036673, 6});
    settings.flip_tone = CA_TONE_REINHARD;
    metrics = measure_pair(image, reference, &settings, NULL);
    assert_near("reinhard", metrics.flip_hdr, 0.18360879, 2e-6);
    assert_exposures(&metrics.exposures, &(ca_flip_exposures){-1.3963848, 3.9610426, 6});
    settings.flip_tone = CA_TONE_ACES;
    settings.flip_exposures = (ca_flip_exposures){-3.0, 1.0, 3};
    assert_near("three exposures", measure_pair(image, reference, &settings, NULL).flip_hdr, 0.14079414, 2e-6);
    ca_layers_destroy(image);
    ca_layers_destroy(reference);
}

/* ---- Closed forms ---------------------------------------------------------------------------------------------- */

static double ldr_of_constants(const float image_rgb[3], const float reference_rgb[3])
{
    ca_image_layers *image = metric_picture(9, 7), *reference = metric_picture(9, 7), *maps;
    fill_metric_picture(image, image_rgb[0], image_rgb[1], image_rgb[2]);
    fill_metric_picture(reference, reference_rgb[0], reference_rgb[1], reference_rgb[2]);
    ca_metric_settings settings = ca_metric_defaults();
    settings.flip_hdr = false;
    const double flip = measure_pair(image, reference, &settings, &maps).flip_ldr;
    for (int i = 0; i < 63; i++) assert_near("the map", (double)named_layer(maps, "FLIP.LDR")[i], flip, 1e-6);
    ca_layers_destroy(maps);
    ca_layers_destroy(image);
    ca_layers_destroy(reference);
    return flip;
}

static void test_constant_pictures(void **state)
{
    (void)state;
    static const float black[] = {0, 0, 0}, white[] = {1, 1, 1}, green[] = {0, 1, 0}, blue[] = {0, 0, 1};
    static const float grey[] = {0.18f, 0.18f, 0.18f};
    assert_true(ldr_of_constants(grey, grey) == 0.0);
    assert_near("the largest difference", ldr_of_constants(green, blue), 1.0, 1e-6);
    assert_near("and back", ldr_of_constants(blue, green), 1.0, 1e-6);
    /* Lightness alone: 100 for white; 0.7, 0.4 and 0.95 are the paper's constants, 41.2760 the largest difference of
     * colours to the power 0.7, as the authors' program has it. */
    const double bend = 0.4 * 41.2760;
    const double expected = 0.95 + (pow(100.0, 0.7) - bend) / (41.2760 - bend) * 0.05;
    assert_near("black and white", ldr_of_constants(black, white), expected, 1e-4);
    const double lightness = 116.0 * cbrt(0.18) - 16.0;
    assert_near("black and grey", ldr_of_constants(black, grey), pow(lightness, 0.7) * 0.95 / bend, 1e-4);
    /* Brighter than a display shows: no difference. */
    static const float bright[] = {7.0f, 2.0f, 1.5f};
    assert_true(ldr_of_constants(bright, white) == 0.0);
}

static void test_either_may_be_the_reference(void **state)
{
    (void)state;
    ca_image_layers *image, *reference;
    make_pair(PAIR_SHIFT, &image, &reference);
    ca_metric_settings settings = ca_metric_defaults();
    settings.flip_hdr = false;
    assert_near("FLIP", measure_pair(reference, image, &settings, NULL).flip_ldr, recorded_pairs[PAIR_SHIFT].flip_ldr,
                2e-6);
    ca_layers_destroy(image);
    ca_layers_destroy(reference);
}

/* HDR is the largest of what LDR gives at each exposure, and says which one that was. */
static void test_hdr_is_the_largest_ldr(void **state)
{
    (void)state;
    enum { EXPOSURES = 4 };
    ca_image_layers *image, *reference, *hdr, *ldr[EXPOSURES];
    make_pair(PAIR_BRIGHT, &image, &reference);
    ca_metric_settings settings = ca_metric_defaults();
    settings.flip_exposures = (ca_flip_exposures){-2.0, 2.5, EXPOSURES};
    settings.tone = settings.flip_tone = CA_TONE_HABLE;
    measure_pair(image, reference, &settings, &hdr);
    settings.flip_hdr = false;
    for (int e = 0; e < EXPOSURES; e++) {
        settings.exposure = -2.0 + 1.5 * e;
        measure_pair(image, reference, &settings, &ldr[e]);
    }
    for (int i = 0; i < PAIR_PIXELS; i++) {
        int largest = 0;
        for (int e = 1; e < EXPOSURES; e++)
            if (named_layer(ldr[e], "FLIP.LDR")[i] > named_layer(ldr[largest], "FLIP.LDR")[i]) largest = e;
        assert_true(named_layer(hdr, "FLIP.HDR")[i] == named_layer(ldr[largest], "FLIP.LDR")[i]);
        assert_true(named_layer(hdr, "FLIP.Exposure")[i] == (float)(-2.0 + 1.5 * largest));
    }
    for (int e = 0; e < EXPOSURES; e++) ca_layers_destroy(ldr[e]);
    ca_layers_destroy(hdr);
    ca_layers_destroy(image);
    ca_layers_destroy(reference);
}

/* ---- Exposures ------------------------------------------------------------------------------------------------- */

enum { GREYS = 5 };
static const double unknown = (double)NAN;

static ca_status choose(const float values[GREYS], ca_tone_curve tone, ca_flip_exposures *exposures, bool *known,
                        ca_error *error)
{
    const float *const planes[3] = {values, values, values};
    return ca_flip_choose_exposures(planes, GREYS, tone, exposures, known, error);
}

static void test_choice_of_exposures(void **state)
{
    (void)state;
    static const float greys[GREYS] = {0.25f, 64.0f, 1.0f, 0.0f, 3.0f};
    ca_flip_exposures e = {unknown, unknown, 0};
    bool known;
    assert_int_equal(choose(greys, CA_TONE_SRGB, &e, &known, NULL), CA_OK);
    assert_true(known);
    assert_exposures(&e, &(ca_flip_exposures){log2(0.85 / 64.0), log2(0.85), 6});
    /* What is given stays. */
    e = (ca_flip_exposures){-1.0, unknown, 0};
    assert_int_equal(choose(greys, CA_TONE_SRGB, &e, &known, NULL), CA_OK);
    assert_exposures(&e, &(ca_flip_exposures){-1.0, log2(0.85), 2});
    e = (ca_flip_exposures){unknown, 9.0, 4};
    assert_int_equal(choose(greys, CA_TONE_SRGB, &e, &known, NULL), CA_OK);
    assert_exposures(&e, &(ca_flip_exposures){log2(0.85 / 64.0), 9.0, 4});
    /* Nothing to see by. */
    static const float dark[GREYS] = {0.0f, 5.0f, 0.0f, 0.0f, 1.0f};
    e = (ca_flip_exposures){unknown, unknown, 0};
    assert_int_equal(choose(dark, CA_TONE_ACES, &e, &known, NULL), CA_OK);
    assert_false(known);
    e = (ca_flip_exposures){-2.0, 3.0, 0};
    assert_int_equal(choose(dark, CA_TONE_ACES, &e, &known, NULL), CA_OK);
    assert_true(known && e.count == 5);
    ca_error error = {""};
    e = (ca_flip_exposures){4.0, unknown, 0};
    assert_int_equal(choose(greys, CA_TONE_SRGB, &e, &known, &error), CA_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, "start at 4 stops, after their stop at -0.2345"));
}

/* One exposure is that exposure, not a division by zero. */
static void test_a_single_exposure(void **state)
{
    (void)state;
    ca_image_layers *image, *reference;
    make_pair(PAIR_BRIGHT, &image, &reference);
    ca_metric_settings settings = ca_metric_defaults();
    settings.flip_exposures = (ca_flip_exposures){-1.0, 3.0, 1};
    settings.tone = CA_TONE_ACES;
    settings.exposure = -1.0;
    const ca_image_metrics metrics = measure_pair(image, reference, &settings, NULL);
    assert_true(metrics.flip_hdr == metrics.flip_ldr);
    ca_layers_destroy(image);
    ca_layers_destroy(reference);
}

static void test_pixels_per_degree_are_refused(void **state)
{
    (void)state;
    static const double wrong[] = {0.0, -67.0, 0.9, 10001.0, (double)NAN, (double)INFINITY};
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        ca_flip *flip;
        assert_int_equal(ca_flip_create(4, 4, wrong[i], &one_thread, &flip, NULL), CA_ERROR_ARGUMENT);
        assert_null(flip);
    }
}

/* ---- Tone curves ----------------------------------------------------------------------------------------------- */

static void test_tone_curves(void **state)
{
    (void)state;
    for (int t = 0; t < CA_TONE_CURVE_COUNT; t++) {
        const ca_tone_curve tone = (ca_tone_curve)t;
        ca_tone_curve found;
        assert_int_equal(ca_tone_find(ca_tone_name(tone), &found, NULL), CA_OK);
        assert_int_equal(found, tone);
        /* The inverse, scaled. */
        const double x = ca_tone_inverse(tone, 0.85);
        const ca_rgb shown = ca_tone_map(tone, 4.0, ca_rgb_grey((float)(x / 4.0)));
        assert_near(ca_tone_name(tone), (double)shown.r, 0.85, 1e-6);
        assert_near(ca_tone_name(tone), (double)shown.b, 0.85, 1e-6);
        if (tone == CA_TONE_LINEAR) continue;
        /* The signal of a display, of anything. */
        const ca_rgb all = ca_tone_signal(tone, 1.0, (ca_rgb){-1.0f, 3e38f, 0.0f});
        assert_true(all.r == 0.0f && all.b == 0.0f && all.g > 0.99f && all.g <= 1.0f);
        const ca_rgb all_huge = ca_tone_map(tone, 1e30, ca_rgb_grey(3e38f));
        assert_true(all_huge.r > 0.99f && all_huge.r <= 1.0f);
    }
    const ca_rgb encoded = ca_tone_signal(CA_TONE_SRGB, 2.0, ca_rgb_grey(0.107f));
    assert_near("sRGB", (double)encoded.g, 1.055 * pow(0.214, 1 / 2.4) - 0.055, 1e-6);
    const ca_rgb linear = ca_tone_signal(CA_TONE_LINEAR, 0.5, (ca_rgb){-3.0f, 8.0f, 1.0f});
    assert_true(linear.r == -1.5f && linear.g == 4.0f && linear.b == 0.5f);
    ca_tone_curve found;
    ca_error error = {""};
    assert_int_equal(ca_tone_find("filmic", &found, &error), CA_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, "\"filmic\" is not a tone curve: srgb, aces"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_recorded_pairs),        cmocka_unit_test(test_recorded_distances),
        cmocka_unit_test(test_recorded_tone_curves),  cmocka_unit_test(test_constant_pictures),
        cmocka_unit_test(test_either_may_be_the_reference), cmocka_unit_test(test_hdr_is_the_largest_ldr),
        cmocka_unit_test(test_choice_of_exposures),   cmocka_unit_test(test_a_single_exposure),
        cmocka_unit_test(test_pixels_per_degree_are_refused), cmocka_unit_test(test_tone_curves),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
