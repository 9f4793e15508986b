/* The film against computations in two passes over all samples: means, variances, standard deviations, the summary;
 * the gate; windows of a crop; failures of memory. */
#include "base/memory.h"
#include "film/film.h"
#include "support/named_layer.h"
#include "support/test_random.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

enum {
    FULL_WIDTH = 11,
    FULL_HEIGHT = 9,
    X0 = 2,
    Y0 = 3,
    WIDTH = 6,
    HEIGHT = 4,
    PIXELS = WIDTH * HEIGHT,
    SAMPLES = 50
};
static const uint32_t crop[4] = {X0, Y0, X0 + WIDTH, Y0 + HEIGHT};
static ca_test_random random_source;

static float between(float low, float high) { return low + (high - low) * ca_test_random_float(&random_source); }

static ca_film create(void)
{
    ca_film film;
    assert_int_equal(ca_film_create(&film, FULL_WIDTH, FULL_HEIGHT, crop, NULL), CA_OK);
    return film;
}

static ca_image_layers *develop(const ca_film *film)
{
    ca_image_layers *layers;
    assert_int_equal(ca_film_develop(film, 2, &layers, NULL), CA_OK);
    return layers;
}

static void expect(const ca_image_layers *layers, const char *name, uint32_t pixel, double value)
{
    const double got = (double)layer_at(layers, name, pixel);
    if (!(fabs(got - value) <= 1e-6 * fabs(value)))
        fail_msg("%s of pixel %u is %.9g, not %.9g", name, pixel, got, value);
}

static ca_film_sample grey(float radiance, float splat)
{
    return (ca_film_sample){.radiance = ca_rgb_grey(radiance), .filter_weight = 1.0f, .splat = ca_rgb_grey(splat)};
}

/* ---- Sums ------------------------------------------------------------------------------------------------------ */

static ca_film_sample random_sample(void)
{
    return (ca_film_sample){.radiance = {between(0, 1), between(0, 2), between(3, 4)},
                            .filter_weight = between(-0.2f, 1.2f),
                            .splat = {between(-0.1f, 1), between(0, 3), between(0, 0.1f)},
                            .albedo = {between(0, 1), between(0, 1), between(0, 1)},
                            .normal = {between(-1, 1), between(-1, 1), between(-1, 1)},
                            .position = {between(-9, 9), between(-9, 9), between(-9, 9)}};
}

typedef struct moments {
    double mean, variance;
} moments;

/* In two passes: the mean, then the squares of what differs from it. */
static moments moments_of(const double *values, uint32_t count)
{
    moments m = {0};
    for (uint32_t i = 0; i < count; i++) m.mean += values[i] / count;
    for (uint32_t i = 0; i < count; i++) m.variance += (values[i] - m.mean) * (values[i] - m.mean) / (count - 1.0);
    return m;
}

/* Of the sample's part of the pixel: R, G, B, luminance. */
static void value_of(const ca_film_sample *sample, double value[4])
{
    const double weight = (double)sample->filter_weight;
    value[0] = (double)sample->radiance.r * weight + (double)sample->splat.r;
    value[1] = (double)sample->radiance.g * weight + (double)sample->splat.g;
    value[2] = (double)sample->radiance.b * weight + (double)sample->splat.b;
    value[3] = 0.2126 * value[0] + 0.7152 * value[1] + 0.0722 * value[2];
}

/* Adds random samples to a pixel, and says what their moments are. */
static void add_random(ca_film *film, uint32_t pixel, uint32_t count, moments result[4])
{
    static double values[4][SAMPLES];
    for (uint32_t i = 0; i < count; i++) {
        const ca_film_sample sample = random_sample();
        assert_true(ca_film_add(film, pixel % WIDTH, pixel / WIDTH, &sample));
        double value[4];
        value_of(&sample, value);
        for (int c = 0; c < 4; c++) values[c][i] = value[c];
    }
    for (int c = 0; c < 4; c++) result[c] = moments_of(values[c], count);
}

static void test_moments(void **state)
{
    (void)state;
    static const char *const colours[] = {"R", "G", "B"};
    ca_film film = create();
    moments expected[PIXELS][4];
    for (uint32_t i = 0; i < PIXELS; i++) add_random(&film, i, SAMPLES - i, expected[i]);
    ca_image_layers *layers = develop(&film);
    for (uint32_t i = 0; i < PIXELS; i++) {
        for (int c = 0; c < 3; c++) {
            char name[32];
            const moments m = expected[i][c];
            expect(layers, colours[c], i, m.mean);
            snprintf(name, sizeof name, "Variance.%s", colours[c]);
            expect(layers, name, i, m.variance);
            snprintf(name, sizeof name, "RelativeVariance.%s", colours[c]);
            expect(layers, name, i, m.variance / (m.mean * m.mean));
        }
        expect(layers, "StandardDeviation.Y", i, sqrt(expected[i][3].variance));
        expect(layers, "Samples.Y", i, SAMPLES - i);
    }
    ca_layers_destroy(layers);
    ca_film_destroy(&film);
}

static void test_summary(void **state)
{
    (void)state;
    ca_film film = create();
    double mean = 0.0, deviation = 0.0, variance_of_means = 0.0;
    for (uint32_t i = 0; i < PIXELS; i++) {
        moments m[4];
        add_random(&film, i, SAMPLES - i, m);
        mean += m[3].mean / PIXELS;
        deviation += sqrt(m[3].variance) / PIXELS;
        variance_of_means += m[3].variance / (SAMPLES - i) / PIXELS;
    }
    const ca_film_summary summary = ca_film_summarise(&film);
    assert_true(fabs(summary.mean_luminance - mean) < 1e-6 * mean);
    assert_true(fabs(summary.mean_standard_deviation - deviation) < 1e-6 * deviation);
    assert_true(fabs(summary.noise - sqrt(variance_of_means) / mean) < 1e-6 * summary.noise);

    /* The summary's deviation is the mean of the layer. */
    ca_image_layers *layers = develop(&film);
    double sum = 0.0;
    for (uint32_t i = 0; i < PIXELS; i++) sum += (double)layer_at(layers, "StandardDeviation.Y", i);
    assert_true(fabs(sum / PIXELS - deviation) < 1e-6 * deviation);
    ca_layers_destroy(layers);
    ca_film_destroy(&film);
}

/* By hand: 1, 2, 3, 6 has the mean 3 and the squared differences 4, 1, 0, 9. */
static void test_by_hand(void **state)
{
    (void)state;
    ca_film film = create();
    const ca_film_sample samples[] = {grey(1, 0), grey(0, 2), grey(4, -1), grey(5, 1)};
    for (int i = 0; i < 4; i++) assert_true(ca_film_add(&film, 1, 1, &samples[i]));
    ca_image_layers *layers = develop(&film);
    expect(layers, "G", WIDTH + 1, 3.0);
    expect(layers, "Variance.G", WIDTH + 1, 14.0 / 3.0);
    expect(layers, "RelativeVariance.B", WIDTH + 1, 14.0 / 27.0);
    expect(layers, "StandardDeviation.Y", WIDTH + 1, sqrt(14.0 / 3.0));
    expect(layers, "Samples.Y", WIDTH + 1, 4.0);
    expect(layers, "Samples.Y", WIDTH, 0.0);
    expect(layers, "RelativeVariance.B", WIDTH, 0.0);
    ca_layers_destroy(layers);
    ca_film_destroy(&film);
}

/* Samples that do not differ have no noise: what rounding leaves is far below a picture's precision. */
static void test_no_noise(void **state)
{
    (void)state;
    ca_film film = create();
    for (uint32_t i = 0; i < PIXELS; i++) {
        ca_film_sample sample = random_sample();
        for (int k = 0; k < 1000; k++) assert_true(ca_film_add(&film, i % WIDTH, i / WIDTH, &sample));
    }
    ca_image_layers *layers = develop(&film);
    for (uint32_t i = 0; i < PIXELS; i++) {
        assert_true(layer_at(layers, "StandardDeviation.Y", i) < 1e-6f);
        assert_true(layer_at(layers, "Variance.R", i) < 1e-12f);
    }
    assert_true(ca_film_summarise(&film).noise < 1e-6);
    ca_layers_destroy(layers);
    ca_film_destroy(&film);
}

/* Under two samples nothing is known of noise. */
static void test_one_sample(void **state)
{
    (void)state;
    ca_film film = create();
    assert_true(isnan(ca_film_summarise(&film).noise));
    const ca_film_sample sample = grey(2, 1);
    for (uint32_t i = 0; i < PIXELS; i++) assert_true(ca_film_add(&film, i % WIDTH, i / WIDTH, &sample));
    const ca_film_summary summary = ca_film_summarise(&film);
    assert_true(isnan(summary.noise));
    assert_true(isnan(summary.mean_standard_deviation));
    assert_true(fabs(summary.mean_luminance - 3.0) < 1e-6);
    ca_film_destroy(&film);
}

static void test_primary_hits(void **state)
{
    (void)state;
    ca_film film = create();
    double sum[9] = {0};
    for (int i = 0; i < SAMPLES; i++) {
        const ca_film_sample s = random_sample();
        const float parts[9] = {s.albedo.r, s.albedo.g, s.albedo.b, s.normal.x, s.normal.y,
                                s.normal.z, s.position.x, s.position.y, s.position.z};
        for (int k = 0; k < 9; k++) sum[k] += (double)parts[k] / SAMPLES;
        assert_true(ca_film_add(&film, 3, 2, &s));
    }
    static const char *const names[9] = {"Albedo.R", "Albedo.G", "Albedo.B", "N.X", "N.Y",
                                         "N.Z",      "P.X",      "P.Y",      "P.Z"};
    ca_image_layers *layers = develop(&film);
    for (int k = 0; k < 9; k++) assert_true(fabs((double)layer_at(layers, names[k], 2 * WIDTH + 3) - sum[k]) < 1e-5);
    ca_layers_destroy(layers);
    ca_film_destroy(&film);
}

/* ---- The gate -------------------------------------------------------------------------------------------------- */

/* A defect counts as a sample of zero, and nothing of it gets in. */
static void test_gate(void **state)
{
    (void)state;
    const float defects[] = {NAN, INFINITY, -INFINITY, -1e-6f};
    ca_film film = create();
    uint32_t refused = 0;
    for (int channel = 0; channel < 3; channel++)
        for (int d = 0; d < 4; d++)
            for (int in_splat = 0; in_splat < 2; in_splat++) {
                ca_film_sample sample = random_sample();
                ca_rgb *colour = in_splat ? &sample.splat : &sample.radiance;
                *(channel == 0 ? &colour->r : channel == 1 ? &colour->g : &colour->b) = defects[d];
                if (in_splat && isfinite(defects[d])) continue;
                assert_false(ca_film_add(&film, 0, 0, &sample));
                refused++;
            }
    ca_image_layers *layers = develop(&film);
    for (size_t i = 0; i < layers->channel_count; i++)
        expect(layers, layers->channels[i].name, 0,
               strcmp(layers->channels[i].name, "Samples.Y") == 0 ? refused : 0.0);
    ca_layers_destroy(layers);

    /* The mean is over all of them, and the variance as well: of `refused` zeros and one that is not. */
    const ca_film_sample good = grey(1, 0);
    assert_true(ca_film_add(&film, 0, 0, &good));
    layers = develop(&film);
    expect(layers, "R", 0, 1.0 / (refused + 1.0));
    expect(layers, "Variance.R", 0, 1.0 / (refused + 1.0));
    ca_layers_destroy(layers);
    ca_film_destroy(&film);
}

/* What is no defect: a filter's negative lobes, in the weight as in a splat. */
static void test_negative_lobes(void **state)
{
    (void)state;
    ca_film film = create();
    ca_film_sample sample = grey(2, -0.5f);
    sample.filter_weight = -1.0f;
    assert_true(ca_film_add(&film, 5, 3, &sample));
    ca_image_layers *layers = develop(&film);
    expect(layers, "B", PIXELS - 1, -2.5);
    ca_layers_destroy(layers);
    ca_film_destroy(&film);
}

/* ---- The rest -------------------------------------------------------------------------------------------------- */

static void test_windows(void **state)
{
    (void)state;
    ca_film film = create();
    ca_image_layers *layers = develop(&film);
    assert_int_equal(layers->width, WIDTH);
    assert_int_equal(layers->height, HEIGHT);
    assert_int_equal(layers->full_width, FULL_WIDTH);
    assert_int_equal(layers->full_height, FULL_HEIGHT);
    assert_int_equal(layers->x0, X0);
    assert_int_equal(layers->y0, Y0);
    assert_int_equal(layers->channel_count, 32);
    ca_layers_destroy(layers);
    ca_film_destroy(&film);
}

static void test_allocation_failures(void **state)
{
    (void)state;
    ca_film film;
    ca_error error = {0};
    ca_memory_fail_after(0);
    assert_int_equal(ca_film_create(&film, FULL_WIDTH, FULL_HEIGHT, crop, &error), CA_ERROR_MEMORY);
    assert_non_null(strstr(error.message, "film"));
    ca_memory_fail_after(-1);
    film = create();
    long failures = 0;
    for (ca_status status = CA_ERROR_MEMORY; status != CA_OK; failures++) {
        ca_image_layers *layers = NULL;
        ca_memory_fail_after(failures);
        status = ca_film_develop(&film, 2, &layers, &error);
        ca_memory_fail_after(-1);
        if (status == CA_OK) ca_layers_destroy(layers);
        else assert_null(layers);
    }
    assert_true(failures > 28); /* one for each layer at least */
    ca_film_destroy(&film);
}

int main(void)
{
    random_source = ca_test_random_seed(8);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_moments),
        cmocka_unit_test(test_summary),
        cmocka_unit_test(test_by_hand),
        cmocka_unit_test(test_no_noise),
        cmocka_unit_test(test_one_sample),
        cmocka_unit_test(test_primary_hits),
        cmocka_unit_test(test_gate),
        cmocka_unit_test(test_negative_lobes),
        cmocka_unit_test(test_windows),
        cmocka_unit_test(test_allocation_failures),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
