/* Tables: frequencies equal probabilities equal weights; inversion is monotone and remaps evenly; nothing that has a
 * weight has a density of 0; every failed allocation is reported and leaks nothing. */
#include "sampling/distribution.h"

#include "base/memory.h"
#include "math/numeric.h"
#include "support/chi_square.h"
#include "support/test_random.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>

#include <cmocka.h>

static ca_distribution_1d make(const float *weights, uint32_t count)
{
    ca_distribution_1d distribution;
    assert_int_equal(ca_distribution_1d_create(&distribution, weights, count, NULL), CA_OK);
    return distribution;
}

static void test_frequencies(void **state)
{
    (void)state;
    static const float weights[] = {0.0f, 3.0f, 1.0f, 0.0f, 0.0f, 5.0f, 0.01f, 7.0f, 0.0f};
    enum { COUNT = 9, DRAWS = 500000 };
    ca_distribution_1d d = make(weights, COUNT);
    assert_true(fabs(d.sum - 16.01) < 1e-6);
    double observed[COUNT] = {0}, expected[COUNT], inside[16] = {0}, even[16];
    ca_test_random random = ca_test_random_seed(1);
    for (int i = 0; i < DRAWS; i++) {
        float probability, remapped;
        const uint32_t bin = ca_distribution_1d_sample(&d, ca_test_random_float(&random), &probability, &remapped);
        assert_true(weights[bin] > 0.0f);
        assert_true(probability == ca_distribution_1d_probability(&d, bin));
        assert_true(remapped >= 0.0f && remapped < 1.0f);
        observed[bin] += 1.0;
        inside[(int)(remapped * 16.0f)] += 1.0;
    }
    for (int i = 0; i < COUNT; i++) {
        expected[i] = DRAWS * (double)weights[i] / d.sum;
        assert_true(fabs((double)ca_distribution_1d_probability(&d, (uint32_t)i) - (double)weights[i] / d.sum) <
                    1.3e-7);
    }
    for (int i = 0; i < 16; i++) even[i] = DRAWS / 16.0;
    assert_true(ca_chi_square_counts(observed, expected, COUNT, NULL, NULL) > 0.005);
    assert_true(ca_chi_square_counts(inside, even, 16, NULL, NULL) > 0.005);
    ca_distribution_1d_destroy(&d);
}

/* Every multiple of 2^-24 near the ends of bins falls into the bin that holds it, whatever the guide says. */
static void check_ends_of_bins(const ca_distribution_1d *d)
{
    for (uint32_t bin = 0; bin < d->count; bin++)
        for (int step = -1; step <= 1; step++) {
            const float u = ca_clamp(d->cumulative[bin] + (float)step * 0x1p-24f, 0.0f, CA_ONE_MINUS_EPSILON);
            float probability;
            const uint32_t found = ca_distribution_1d_sample(d, u, &probability, NULL);
            assert_true(d->cumulative[found] <= u && u < d->cumulative[found + 1]);
            assert_true(probability > 0.0f);
        }
}

static void test_inversion(void **state)
{
    (void)state;
    for (uint32_t count = 1; count < 3000; count = count * 2 + 1) {
        float weights[3000];
        ca_test_random random = ca_test_random_seed(count);
        for (uint32_t i = 0; i < count; i++)
            weights[i] = (i % 5 == 2) ? 0.0f : powf(ca_test_random_float(&random), 8.0f);
        weights[count / 2] = 1.0f;
        ca_distribution_1d d = make(weights, count);
        check_ends_of_bins(&d);
        ca_distribution_1d_destroy(&d);
    }
}

/* Equal bins end where the guide's slots do: there the slot of u is a matter of rounding. */
static void test_inversion_of_equal_bins(void **state)
{
    (void)state;
    enum { LARGEST = 99999 };
    float *weights = ca_alloc(LARGEST, sizeof *weights);
    for (uint32_t i = 0; i < LARGEST; i++) weights[i] = 0.3f;
    for (uint32_t count = 7; count <= LARGEST; count = count * 11 / 2) {
        ca_distribution_1d d = make(weights, count);
        check_ends_of_bins(&d);
        ca_distribution_1d_destroy(&d);
    }
    ca_free(weights);
}

static void test_small_weights_survive(void **state)
{
    (void)state;
    static const float weights[] = {1e-30f, 1.0f, 1e-12f, 1e20f, 0.0f, 1e-38f};
    ca_distribution_1d d = make(weights, 6);
    for (uint32_t i = 0; i < 6; i++)
        assert_true((ca_distribution_1d_probability(&d, i) > 0.0f) == (weights[i] > 0.0f));
    assert_true(d.cumulative[0] == 0.0f && d.cumulative[6] == 1.0f);
    ca_distribution_1d_destroy(&d);

    static const float nothing[] = {0.0f, 0.0f, 0.0f, 0.0f};
    d = make(nothing, 4);
    for (uint32_t i = 0; i < 4; i++) assert_true(ca_distribution_1d_probability(&d, i) == 0.25f);
    ca_distribution_1d_destroy(&d);
}

static void test_two_dimensions(void **state)
{
    (void)state;
    enum { WIDTH = 7, HEIGHT = 5, DRAWS = 500000 };
    float weights[WIDTH * HEIGHT];
    double sum = 0.0, observed[WIDTH * HEIGHT] = {0}, expected[WIDTH * HEIGHT];
    for (int i = 0; i < WIDTH * HEIGHT; i++) sum += (double)(weights[i] = (float)((i * 7) % 11));
    for (int x = 0; x < WIDTH; x++) {
        sum -= (double)weights[2 * WIDTH + x];
        weights[2 * WIDTH + x] = 0.0f;
    }
    ca_distribution_2d d;
    assert_int_equal(ca_distribution_2d_create(&d, weights, WIDTH, HEIGHT, NULL), CA_OK);
    ca_test_random random = ca_test_random_seed(4);
    for (int i = 0; i < DRAWS; i++) {
        float density;
        const ca_vec2 u = {ca_test_random_float(&random), ca_test_random_float(&random)};
        const ca_vec2 p = ca_distribution_2d_sample(&d, u, &density);
        assert_true(p.x >= 0.0f && p.x < 1.0f && p.y >= 0.0f && p.y < 1.0f);
        const uint32_t cell = (uint32_t)(p.y * HEIGHT) * WIDTH + (uint32_t)(p.x * WIDTH);
        assert_true(fabs((double)density * sum / ((double)weights[cell] * WIDTH * HEIGHT) - 1.0) < 1e-5);
        assert_true(density == ca_distribution_2d_density(&d, p));
        observed[cell] += 1.0;
    }
    for (int i = 0; i < WIDTH * HEIGHT; i++) expected[i] = DRAWS * (double)weights[i] / sum;
    assert_true(ca_chi_square_counts(observed, expected, WIDTH * HEIGHT, NULL, NULL) > 0.005);
    assert_true(ca_distribution_2d_density(&d, (ca_vec2){0.3f, 0.5f}) == 0.0f);
    ca_distribution_2d_destroy(&d);
}

static void test_allocation_failures(void **state)
{
    (void)state;
    static const float weights[6] = {1, 2, 3, 4, 5, 6};
    uint32_t failures = 0;
    for (long n = 0;; n++) {
        ca_distribution_2d d;
        ca_error error;
        ca_memory_fail_after(n);
        const ca_status status = ca_distribution_2d_create(&d, weights, 3, 2, &error);
        ca_memory_fail_after(-1);
        if (status == CA_OK) {
            ca_distribution_2d_destroy(&d);
            break;
        }
        assert_int_equal(status, CA_ERROR_MEMORY);
        failures++;
    }
    assert_int_equal(failures, 6); /* so many allocations */
}

/* Tiny bins beside a large one, as triangles of a lamp: together they are as likely as their weights say. */
static void test_nearest(void **state)
{
    (void)state;
    enum { TINY = 500000 };
    ca_distribution_1d distribution;
    float *weights = malloc((TINY + 1) * sizeof *weights);
    assert_non_null(weights);
    for (uint32_t i = 0; i <= TINY; i++) weights[i] = i == TINY / 2 ? 0.99f : 0.01f / TINY;
    assert_int_equal(ca_distribution_1d_create_nearest(&distribution, weights, TINY + 1, NULL), CA_OK);
    free(weights);
    assert_true(fabs((double)ca_distribution_1d_probability(&distribution, TINY / 2) - 0.99) < 1e-6);
    uint32_t tiny = 0;
    for (uint32_t k = 0; k < 100000; k++) {
        float probability;
        const uint32_t bin =
            ca_distribution_1d_sample(&distribution, ((float)k + 0.5f) / 100000.0f, &probability, NULL);
        assert_true(probability > 0.0f);
        tiny += bin != TINY / 2;
    }
    assert_true(tiny > 990 && tiny < 1010);
    ca_distribution_1d_destroy(&distribution);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_nearest),
        cmocka_unit_test(test_frequencies),
        cmocka_unit_test(test_inversion),
        cmocka_unit_test(test_inversion_of_equal_bins),
        cmocka_unit_test(test_small_weights_survive),
        cmocka_unit_test(test_two_dimensions),
        cmocka_unit_test(test_allocation_failures),
    };
    return cmocka_run_group_tests_name("distribution", tests, NULL, NULL);
}
