/* Error bars of joined films: one part alone has those of its film, the third cumulant and the degrees of freedom are
 * those of the weighted sum, and of parts with different distributions the intervals hold as often as they say. */
#include "base/memory.h"
#include "film/confidence.h"
#include "film/joined_film.h"
#include "support/expect_near.h"
#include "support/test_random.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

enum { SIDE = 64, PIXELS = SIDE * SIDE };

static ca_test_random random_source;

/* The mean of so many exponentials. */
static double draw(int count)
{
    double product = 1.0;
    for (int k = 0; k < count; k++) product *= ca_test_random_open(&random_source);
    return -log(product) / count;
}

static ca_film film_of(int samples, int exponentials)
{
    ca_film film;
    const uint32_t crop[4] = {0, 0, SIDE, SIDE};
    assert_int_equal(ca_film_create(&film, SIDE, SIDE, crop, NULL), CA_OK);
    for (uint32_t i = 0; i < PIXELS; i++)
        for (int k = 0; k < samples; k++) {
            const float value = exponentials > 0 ? (float)draw(exponentials) : 0.7f;
            const ca_film_sample sample = {.filter_weight = 1.0f, .splat = {value, 2.0f * value, 0.5f * value}};
            assert_true(ca_film_add(&film, i % SIDE, i / SIDE, &sample));
        }
    return film;
}

static ca_joined_film joined_like(const ca_film *film)
{
    ca_joined_film joined;
    assert_int_equal(ca_joined_film_create(&joined, film, NULL), CA_OK);
    return joined;
}

static ca_image_layers *confidence_of(const ca_joined_film *joined)
{
    ca_image_layers *layers;
    assert_int_equal(ca_layers_create(&layers, SIDE, SIDE, NULL), CA_OK);
    assert_int_equal(ca_joined_film_add_confidence(joined, 2, layers, NULL), CA_OK);
    assert_int_equal(layers->channel_count, 12);
    return layers;
}

static void test_one_part(void **state)
{
    (void)state;
    ca_film film = film_of(20, 1);
    ca_joined_film joined = joined_like(&film);
    ca_image_layers *developed;
    ca_joined_film_add(&joined, &film, 2.0);
    ca_joined_film_scale(&joined, 0.5);
    assert_int_equal(ca_film_develop(&film, 2, &developed, NULL), CA_OK);
    ca_image_layers *layers = confidence_of(&joined);
    int marked = 0, widened = 0;
    for (size_t c = 0; c < layers->channel_count; c++)
        for (uint32_t i = 0; i < PIXELS; i++) {
            const float expected = ca_layers_find(developed, layers->channels[c].name)[i],
                        got = layers->channels[c].data[i];
            assert_true(isinf(expected) == isinf(got));
            if (isinf(expected)) marked++;
            else expect_near((double)got, (double)expected, 1e-5);
            if (strncmp(layers->channels[c].name, "ConfidenceWidened", 17) == 0) widened += got == 1.0f;
        }
    assert_int_equal(marked, 0);
    assert_true(widened > 0 && widened < 2 * PIXELS);
    ca_layers_destroy(layers);
    ca_layers_destroy(developed);
    ca_joined_film_destroy(&joined);
    ca_film_destroy(&film);
}

/* Without scatter there is nothing to be uncertain of, if there are samples enough to say so. */
static void test_constant_parts(void **state)
{
    (void)state;
    for (int few = 0; few < 2; few++) {
        ca_film a = film_of(3, 0), b = film_of(few ? 4 : 5, 0);
        ca_joined_film joined = joined_like(&a);
        ca_joined_film_add(&joined, &a, 0.25);
        ca_joined_film_add(&joined, &b, 0.75);
        ca_image_layers *layers = confidence_of(&joined);
        const double low = (double)ca_layers_find(layers, "ConfidenceLow.R")[9],
                     high = (double)ca_layers_find(layers, "ConfidenceHigh.R")[9];
        if (few) assert_true(isinf(low) && isinf(high));
        else assert_true(low <= (double)0.7f && high >= (double)0.7f && high - low < 1e-5);
        ca_layers_destroy(layers);
        ca_joined_film_destroy(&joined);
        ca_film_destroy(&a);
        ca_film_destroy(&b);
    }
}

/* As a render with a pilot in two halves, of few and noisy samples, and two phases. Averages over pixels:
 * exponentials have the variance 1 and the third moment 2, means of four 1/4 and 2/16. */
static void test_parts(void **state)
{
    (void)state;
    ca_film a = film_of(4, 1), b = film_of(4, 1), first = film_of(30, 1), second = film_of(60, 4);
    ca_joined_film joined = joined_like(&a);
    ca_joined_film_add(&joined, &first, 0.5);
    ca_joined_film_add(&joined, &second, 1.5);
    ca_joined_film_scale(&joined, 0.45);
    ca_joined_film_add_two(&joined, &a, 0.06, &b, 0.04);
    double variance = 0.0, third = 0.0, others = 0.0, held = 0.0;
    for (uint32_t i = 0; i < PIXELS; i++) {
        variance += joined.pixels[i].variance[0] / PIXELS;
        third += joined.pixels[i].third[1] / 8.0 / PIXELS; /* twice as bright */
    }
    expect_near(variance, pow(0.225, 2) / 30 + pow(0.675, 2) / 240 + (pow(0.06, 2) + pow(0.04, 2)) / 4, 0.02);
    expect_near(third, 2 * (pow(0.225, 3) / 900 + pow(0.675, 3) / 57600 + (pow(0.06, 3) + pow(0.04, 3)) / 16), 0.15);
    ca_image_layers *layers = confidence_of(&joined);
    const float *low = ca_layers_find(layers, "ConfidenceLow.B"), *high = ca_layers_find(layers, "ConfidenceHigh.B"),
                *widened = ca_layers_find(layers, "ConfidenceWidened.B");
    for (uint32_t i = 0; i < PIXELS; i++) {
        if (isinf(low[i]) || widened[i] == 1.0f) others++;
        else held += (double)low[i] <= 0.5 && (double)high[i] >= 0.5;
    }
    held /= PIXELS - others;
    printf("    %.2f %% held, %.1f %% widened or marked\n", 100.0 * held, 100.0 * others / PIXELS);
    assert_true(held > 0.94 && held < 0.96); /* the fraction itself scatters by 0.34 % */
    assert_true(others < 0.02 * PIXELS);
    ca_layers_destroy(layers);
    ca_joined_film_destroy(&joined);
    ca_film_destroy(&a), ca_film_destroy(&b), ca_film_destroy(&first), ca_film_destroy(&second);
}

/* Where a part of few samples has most of the variance, few degrees of freedom are left: Student's t has to be
 * theirs, and with fewer than eight samples have, the pixel is marked. */
static void test_degrees_of_freedom(void **state)
{
    (void)state;
    for (int few = 0; few < 2; few++) {
        ca_film a = film_of(few ? 5 : 12, 40), b = film_of(400, 40);
        ca_joined_film joined = joined_like(&a);
        ca_joined_film_add(&joined, &a, 0.5);
        ca_joined_film_add(&joined, &b, 0.5);
        ca_image_layers *layers = confidence_of(&joined);
        const float *low = ca_layers_find(layers, "ConfidenceLow.Y"),
                    *high = ca_layers_find(layers, "ConfidenceHigh.Y");
        const double expectation = 0.2126 + 2.0 * 0.7152 + 0.5 * 0.0722;
        double held = 0.0, marked = 0.0;
        for (uint32_t i = 0; i < PIXELS; i++) {
            if (isinf(low[i])) marked++;
            else held += (double)low[i] <= expectation && (double)high[i] >= expectation;
        }
        if (few) assert_true(marked > 0.9 * PIXELS);
        else
            assert_true(marked < 0.02 * PIXELS && held > 0.94 * (PIXELS - marked) && held < 0.96 * (PIXELS - marked));
        ca_layers_destroy(layers);
        ca_joined_film_destroy(&joined);
        ca_film_destroy(&a);
        ca_film_destroy(&b);
    }
}

/* As a film it has the means, and the variances of the value as those of its samples over their number. */
static void test_as_a_film(void **state)
{
    (void)state;
    enum { SAMPLES = 9 };
    ca_film film = film_of(12, 2);
    ca_joined_film joined = joined_like(&film);
    ca_image_layers *image;
    ca_joined_film_add(&joined, &film, 1.0);
    assert_int_equal(ca_joined_film_develop(&joined, SAMPLES, &film, 2, &image, NULL), CA_OK);
    for (uint32_t i = 0; i < PIXELS; i++) {
        const ca_joined_pixel *pixel = &joined.pixels[i];
        expect_near((double)ca_layers_find(image, "B")[i], pixel->mean[2], 1e-6);
        expect_near((double)ca_layers_find(image, "Variance.B")[i], SAMPLES * pixel->variance[2], 1e-6);
        expect_near((double)ca_layers_find(image, "StandardDeviation.Y")[i],
                    sqrt(SAMPLES * pixel->luminance_variance), 1e-6);
        assert_true(ca_layers_find(image, "Samples.Y")[i] == (float)SAMPLES);
    }
    ca_layers_destroy(image);
    ca_joined_film_destroy(&joined);
    ca_film_destroy(&film);
}

static void test_memory(void **state)
{
    (void)state;
    ca_film film = film_of(2, 1);
    ca_joined_film joined = joined_like(&film);
    ca_image_layers *layers;
    ca_error error = {""};
    assert_int_equal(ca_layers_create(&layers, SIDE, SIDE, NULL), CA_OK);
    for (int k = 0; k < 4; k++) {
        ca_memory_fail_after(k);
        assert_int_equal(ca_joined_film_add_confidence(&joined, 2, layers, &error), CA_ERROR_MEMORY);
        ca_memory_fail_after(-1);
        assert_non_null(strstr(error.message, "memory"));
    }
    ca_layers_destroy(layers);
    ca_joined_film_destroy(&joined);
    ca_film_destroy(&film);
}

int main(void)
{
    random_source = ca_test_random_seed(23);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_one_part), cmocka_unit_test(test_constant_parts),
        cmocka_unit_test(test_parts),    cmocka_unit_test(test_degrees_of_freedom),
        cmocka_unit_test(test_as_a_film), cmocka_unit_test(test_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
