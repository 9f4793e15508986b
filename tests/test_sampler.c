/* Samplers: names; what holds for every kind; independent numbers look random along every axis of their address;
 * Sobol' points are nets in every group of dimensions, independent between groups and pixels, and integrate smooth
 * functions faster than chance. */
#include "sampling/sampler.h"
#include "support/chi_square.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

typedef struct address {
    uint64_t seed, sequence, index;
    uint32_t dimension;
} address;

static float number(ca_sampler_kind kind, address at)
{
    const ca_sampler sampler = {.kind = kind, .seed = at.seed};
    const ca_stream stream = ca_stream_start(&sampler, at.sequence, at.index);
    return ca_sample_1d(&stream, at.dimension);
}

/* Walks through addresses: step n is n times one axis. */
enum { AXIS_SEED, AXIS_SEQUENCE, AXIS_INDEX, AXIS_DIMENSION, AXIS_COUNT };
static const char *const axis_names[AXIS_COUNT] = {"seed", "sequence", "index", "dimension"};

static address along(address start, int axis, uint64_t n)
{
    switch (axis) {
    case AXIS_SEED: start.seed += n; break;
    case AXIS_SEQUENCE: start.sequence += n; break;
    case AXIS_INDEX: start.index += n; break;
    default: start.dimension += (uint32_t)n; break;
    }
    return start;
}

static const address starts[] = {{0, 0, 0, 0},
                                 {1, 1920 * 540 + 960, 63, 9},
                                 {0xdeadbeefcafef00du, 1u << 31, 1u << 20, 800},
                                 {7, CA_SEQUENCE_LIGHT, (UINT64_C(1) << 32) - 1000, 13}};
enum { START_COUNT = sizeof starts / sizeof starts[0] };

/* ---- Independent ----------------------------------------------------------------------------------------------- */

/* Counts of (value at n, value at n + lag, value at n + 2 lag) in boxes. */
static double boxes_p_value(address start, int axis, uint64_t lag, uint32_t sides, uint32_t dimensions,
                            uint32_t count)
{
    const uint32_t boxes = dimensions == 1 ? sides : dimensions == 2 ? sides * sides : sides * sides * sides;
    double *observed = calloc(boxes, sizeof *observed), *expected = calloc(boxes, sizeof *expected);
    for (uint32_t n = 0; n < count; n++) {
        uint32_t box = 0;
        for (uint32_t k = 0; k < dimensions; k++) {
            const float u =
                number(CA_SAMPLER_INDEPENDENT, along(start, axis, (uint64_t)n * (lag + 1) * dimensions + k * lag));
            box = box * sides + (uint32_t)(u * (float)sides);
        }
        observed[box] += 1.0;
    }
    for (uint32_t i = 0; i < boxes; i++) expected[i] = (double)count / boxes;
    const double p = ca_chi_square_counts(observed, expected, boxes, NULL, NULL);
    free(observed);
    free(expected);
    return p;
}

static void test_independent_uniform(void **state)
{
    (void)state;
    static const struct {
        uint32_t dimensions, sides;
        uint64_t lag;
    } cases[] = {{1, 1024, 1}, {2, 32, 1},    {2, 32, 2}, {2, 32, 8},
                 {2, 32, 64},  {2, 32, 1920}, {3, 10, 1}, {3, 10, 8}};
    const uint32_t case_count = sizeof cases / sizeof cases[0];
    const double level = ca_sidak_level(0.01, case_count * AXIS_COUNT * START_COUNT);
    for (uint32_t c = 0; c < case_count; c++)
        for (int axis = 0; axis < AXIS_COUNT; axis++)
            for (uint32_t s = 0; s < START_COUNT; s++) {
                const double p =
                    boxes_p_value(starts[s], axis, cases[c].lag, cases[c].sides, cases[c].dimensions, 300000);
                if (p < level)
                    fail_msg("%u dimensions, lag %u along %s from start %u: p = %g", cases[c].dimensions,
                             (unsigned)cases[c].lag, axis_names[axis], s, p);
            }
}

/* Neighbours along one axis against the same along another: lattices of pixels and sample numbers. */
static void test_independent_two_axes(void **state)
{
    (void)state;
    enum { SIDE = 400, BINS = 1024 };
    const double level = ca_sidak_level(0.01, AXIS_COUNT * AXIS_COUNT);
    for (int a = 0; a < AXIS_COUNT; a++)
        for (int b = 0; b < AXIS_COUNT; b++) {
            double observed[BINS] = {0}, expected[BINS];
            for (uint32_t i = 0; i < SIDE; i++)
                for (uint32_t j = 0; j < SIDE; j++) {
                    const address at =
                        along(along(starts[0], a, a == b ? 2 * SIDE * i : 2 * i), b, a == b ? 2 * j : j);
                    const uint32_t u = (uint32_t)(number(CA_SAMPLER_INDEPENDENT, at) * 32.0f);
                    const uint32_t v = (uint32_t)(number(CA_SAMPLER_INDEPENDENT, along(at, a, 1)) * 32.0f);
                    observed[u * 32 + v] += 1.0;
                }
            for (uint32_t i = 0; i < BINS; i++) expected[i] = (double)SIDE * SIDE / BINS;
            const double p = ca_chi_square_counts(observed, expected, BINS, NULL, NULL);
            if (p < level) fail_msg("%s by %s: p = %g", axis_names[a], axis_names[b], p);
        }
}

static void test_independent_correlations_and_bits(void **state)
{
    (void)state;
    enum { COUNT = 1 << 17 };
    static const uint32_t lags[] = {1, 2, 3, 4, 8, 16, 64, 1024};
    float *u = malloc(COUNT * sizeof *u);
    for (int axis = 0; axis < AXIS_COUNT; axis++)
        for (uint32_t s = 0; s < START_COUNT; s++) {
            for (uint32_t n = 0; n < COUNT; n++) u[n] = number(CA_SAMPLER_INDEPENDENT, along(starts[s], axis, n));
            for (uint32_t k = 0; k < sizeof lags / sizeof lags[0]; k++) {
                double sum = 0.0;
                for (uint32_t n = 0; n + lags[k] < COUNT; n++)
                    sum += ((double)u[n] - 0.5) * ((double)u[n + lags[k]] - 0.5);
                const double z = 12.0 * sum / sqrt(COUNT - lags[k]);
                if (fabs(z) > 5.0)
                    fail_msg("lag %u along %s: correlation of %.1f sigma", lags[k], axis_names[axis], z);
            }
            for (uint32_t bit = 0; bit < 24; bit++) {
                uint32_t ones = 0;
                for (uint32_t n = 0; n < COUNT; n++) ones += ((uint32_t)(u[n] * 0x1p24f) >> bit) & 1u;
                const double z = (ones - 0.5 * COUNT) / sqrt(0.25 * COUNT);
                if (fabs(z) > 5.0) fail_msg("bit %u along %s: %.1f sigma", bit, axis_names[axis], z);
            }
        }
    free(u);
}

/* ---- Sobol' ---------------------------------------------------------------------------------------------------- */

/* Smallest t for which 2^m points, from index `first` on, have 2^t points in each box of 2^-k by 2^(t-m+k). */
static uint32_t net_quality(uint64_t sequence, uint32_t first, uint32_t m, uint32_t dim_x, uint32_t dim_y)
{
    uint16_t count[1 << 10];
    for (uint32_t t = 0; t <= m; t++) {
        bool even = true;
        for (uint32_t k = 0; k <= m - t && even; k++) {
            memset(count, 0, sizeof count);
            for (uint32_t i = 0; i < 1u << m; i++) {
                const address at = {.sequence = sequence, .index = first + i};
                address at_x = at, at_y = at;
                at_x.dimension = dim_x;
                at_y.dimension = dim_y;
                const uint32_t x = (uint32_t)(number(CA_SAMPLER_SOBOL, at_x) * (float)(1u << k));
                const uint32_t y = (uint32_t)(number(CA_SAMPLER_SOBOL, at_y) * (float)(1u << (m - t - k)));
                count[(x << (m - t - k)) + y]++;
            }
            for (uint32_t box = 0; box < 1u << (m - t); box++) even = even && count[box] == 1u << t;
        }
        if (even) return t;
    }
    return m;
}

static void test_sobol_nets(void **state)
{
    (void)state;
    /* t of each pair of a group's dimensions: polynomials of degrees 0 (van der Corput), 1, 2, 3 bound it by the sum
     * of degrees less one each; these are the values that Joe and Kuo's numbers reach. */
    static const struct {
        uint32_t x, y, t;
    } pairs[] = {{0, 1, 0}, {2, 3, 2}, {0, 2, 1}, {0, 3, 2}, {1, 2, 1}, {1, 3, 2}};
    for (uint32_t group = 0; group < 40; group += 13)
        for (uint64_t sequence = 0; sequence < 3; sequence++)
            for (uint32_t pair = 0; pair < 6; pair++)
                for (uint32_t m = 0; m <= 10; m += 2)
                    for (uint32_t block = 0; block < 2; block++)
                        assert_in_range(net_quality(sequence * 1000003u, block << m, m, 4 * group + pairs[pair].x,
                                                    4 * group + pairs[pair].y),
                                        0, pairs[pair].t);
}

static void test_sobol_one_dimension(void **state)
{
    (void)state;
    for (uint32_t dimension = 0; dimension < 64; dimension += 3)
        for (uint32_t m = 0; m <= 10; m++) {
            uint8_t hit[1 << 10] = {0};
            for (uint32_t i = 0; i < 1u << m; i++) {
                const address at = {.seed = 7, .sequence = 99, .index = i, .dimension = dimension};
                const uint32_t bin = (uint32_t)(number(CA_SAMPLER_SOBOL, at) * (float)(1u << m));
                assert_int_equal(hit[bin]++, 0);
            }
        }
}

/* Any single number, over pixels, is uniform; the same number of two groups, two pixels or two seeds is
 * independent. */
static void test_sobol_independence(void **state)
{
    (void)state;
    enum { BINS = 256, COUNT = 60000 };
    static const int axes[] = {AXIS_SEED, AXIS_SEQUENCE, AXIS_DIMENSION};
    static const uint64_t steps[] = {1, 1, 4};
    for (int k = 0; k < 3; k++)
        for (uint32_t dimension = 0; dimension < 4; dimension++) {
            double observed[BINS] = {0}, expected[BINS];
            for (uint32_t n = 0; n < COUNT; n++) {
                address at = {.seed = 5, .sequence = 2 * n, .index = n & 15, .dimension = dimension};
                if (axes[k] == AXIS_SEED) at = (address){.seed = 2 * n, .index = n & 15, .dimension = dimension};
                const float u = number(CA_SAMPLER_SOBOL, at);
                const float v = number(CA_SAMPLER_SOBOL, along(at, axes[k], steps[k]));
                observed[(uint32_t)(u * 16.0f) * 16 + (uint32_t)(v * 16.0f)] += 1.0;
            }
            for (uint32_t i = 0; i < BINS; i++) expected[i] = (double)COUNT / BINS;
            const double p = ca_chi_square_counts(observed, expected, BINS, NULL, NULL);
            if (p < ca_sidak_level(0.01, 12))
                fail_msg("dimension %u along %s: p = %g", dimension, axis_names[axes[k]], p);
        }
}

/* Root mean square error over pixels of a product of one-dimensional functions of mean 1. */
static double integration_error(ca_sampler_kind kind, const uint32_t *dimensions, uint32_t dimension_count,
                                uint32_t n)
{
    enum { PIXELS = 200 };
    double squares = 0.0;
    for (uint32_t pixel = 0; pixel < PIXELS; pixel++) {
        double sum = 0.0;
        for (uint32_t i = 0; i < n; i++) {
            double product = 1.0;
            for (uint32_t d = 0; d < dimension_count; d++) {
                const address at = {.seed = 3, .sequence = pixel, .index = i, .dimension = dimensions[d]};
                product *= 1.5707963267948966 * sin(3.141592653589793 * (double)number(kind, at));
            }
            sum += product;
        }
        squares += (sum / n - 1.0) * (sum / n - 1.0);
    }
    return sqrt(squares / PIXELS);
}

static void test_integration_error(void **state)
{
    (void)state;
    static const uint32_t film[] = {0, 1}, group[] = {8, 9, 10, 11}, across_groups[] = {2, 5};
    const double mc_64 = integration_error(CA_SAMPLER_INDEPENDENT, film, 2, 64);
    const double mc_1024 = integration_error(CA_SAMPLER_INDEPENDENT, film, 2, 1024);
    assert_true(mc_64 / mc_1024 > 3.2 && mc_64 / mc_1024 < 5.0);

    const double film_64 = integration_error(CA_SAMPLER_SOBOL, film, 2, 64);
    const double film_1024 = integration_error(CA_SAMPLER_SOBOL, film, 2, 1024);
    const double group_64 = integration_error(CA_SAMPLER_SOBOL, group, 4, 64);
    const double group_1024 = integration_error(CA_SAMPLER_SOBOL, group, 4, 1024);
    const double pad_1024 = integration_error(CA_SAMPLER_SOBOL, across_groups, 2, 1024);
    printf("           error from 64 to 1024 points: independent / %.1f, Sobol' 2-D / %.1f, 4-D / %.1f\n",
           mc_64 / mc_1024, film_64 / film_1024, group_64 / group_1024);
    assert_true(film_64 / film_1024 > 30.0); /* n^-1.5 gives 64 */
    assert_true(group_64 / group_1024 > 8.0);
    assert_true(film_1024 < 0.05 * mc_1024);
    assert_true(pad_1024 < mc_1024);
}

/* ---- All kinds
 *
 * ------------------------------------------------------------------------------------------------------ */

static void test_pairs_and_range(void **state)
{
    (void)state;
    enum { WIDTH = 37, HEIGHT = 53 };
    for (int kind = 0; kind < CA_SAMPLER_KIND_COUNT; kind++) {
        ca_sampler sampler = {.kind = (ca_sampler_kind)kind, .seed = 11};
        ca_sampler_prepare(&sampler, WIDTH, HEIGHT);
        assert_true(sampler.width == WIDTH && sampler.height == HEIGHT);
        for (uint64_t i = 0; i < 3000; i++) {
            const uint64_t sequence = i % 3 == 0 ? CA_SEQUENCE_LIGHT : i * 7 % (WIDTH * HEIGHT);
            const ca_stream stream = ca_stream_start(&sampler, sequence, i * 1299709u << (i % 20));
            const uint32_t further = i % 2 ? 300 : 0;
            for (uint32_t dimension = 0; dimension < 32; dimension += 2) {
                const ca_vec2 pair = ca_sample_2d(&stream, dimension + further);
                assert_true(pair.x >= 0.0f && pair.x < 1.0f && pair.y >= 0.0f && pair.y < 1.0f);
                assert_true(pair.x * 0x1p24f == floorf(pair.x * 0x1p24f));
                assert_true(pair.y * 0x1p24f == floorf(pair.y * 0x1p24f));
                assert_true(pair.x == ca_sample_1d(&stream, dimension + further));
                assert_true(pair.y == ca_sample_1d(&stream, dimension + further + 1));
            }
        }
    }
}

/* A path's numbers do not change with what was asked for before, nor with where the sampler lies in memory. */
static void test_addresses_suffice(void **state)
{
    (void)state;
    for (int kind = 0; kind < CA_SAMPLER_KIND_COUNT; kind++) {
        ca_sampler sampler = {.kind = (ca_sampler_kind)kind, .seed = 5};
        ca_sampler_prepare(&sampler, 31, 17);
        const ca_sampler copy = sampler;
        for (uint64_t index = 100; index-- > 0;) {
            const ca_stream a = ca_stream_start(&sampler, index, index * index);
            const ca_stream other = ca_stream_start(&sampler, CA_SEQUENCE_LIGHT, index);
            ca_sample_1d(&other, (uint32_t)index);
            const ca_stream b = ca_stream_start(&copy, index, index * index);
            for (uint32_t dimension = 400; dimension-- > 0; dimension -= dimension < 7 ? dimension : 7)
                assert_true(ca_sample_1d(&a, dimension) == ca_sample_1d(&b, dimension));
        }
    }
}

/* No index comes again after 2^32 paths: light paths of all kinds. */
static void test_indices_of_64_bits(void **state)
{
    (void)state;
    for (int kind = 0; kind < CA_SAMPLER_KIND_COUNT; kind++) {
        ca_sampler sampler = {.kind = (ca_sampler_kind)kind, .seed = 5};
        ca_sampler_prepare(&sampler, 31, 17);
        uint32_t same = 0;
        for (uint64_t index = 1; index <= 100; index++) {
            const ca_stream low = ca_stream_start(&sampler, CA_SEQUENCE_LIGHT, index);
            const ca_stream high = ca_stream_start(&sampler, CA_SEQUENCE_LIGHT, index + (UINT64_C(1) << 32));
            bool all = true;
            for (uint32_t dimension = 0; dimension < 40; dimension++)
                all = all && ca_sample_1d(&low, dimension) == ca_sample_1d(&high, dimension);
            same += all;
        }
        if (same > 0) fail_msg("%s: %u paths come again", ca_sampler_name((ca_sampler_kind)kind), same);
    }
}

/* A number depends on its address alone: values written down once. A change of any is a change of every picture. */
static void test_known_values(void **state)
{
    (void)state;
    static const address at = {.seed = 1, .sequence = 12345, .index = 67, .dimension = 13};
    assert_true(number(CA_SAMPLER_INDEPENDENT, at) == 0x1.486898p-3f);
    assert_true(number(CA_SAMPLER_SOBOL, at) == 0x1.c3358p-6f);
}

static void test_names(void **state)
{
    (void)state;
    static const char *const names[CA_SAMPLER_KIND_COUNT] = {
        [CA_SAMPLER_INDEPENDENT] = "independent",
        [CA_SAMPLER_HALTON] = "halton",
        [CA_SAMPLER_HALTON_PLAIN] = "halton-plain",
        [CA_SAMPLER_SOBOL] = "sobol",
        [CA_SAMPLER_SOBOL_PLAIN] = "sobol-plain",
        [CA_SAMPLER_SOBOL_IMAGE] = "sobol-image",
        [CA_SAMPLER_SOBOL_TILES] = "sobol-tiles",
        [CA_SAMPLER_SOBOL_TILES_PLAIN] = "sobol-tiles-plain",
        [CA_SAMPLER_ZSOBOL] = "zsobol",
        [CA_SAMPLER_LATTICE] = "lattice",
        [CA_SAMPLER_LATTICE_PLAIN] = "lattice-plain",
        [CA_SAMPLER_LATTICE_IMAGE] = "lattice-image",
        [CA_SAMPLER_LATTICE_TILES] = "lattice-tiles",
        [CA_SAMPLER_LATTICE_TILES_PLAIN] = "lattice-tiles-plain",
    };
    char all[256] = "";
    for (int i = 0; i < CA_SAMPLER_KIND_COUNT; i++) {
        ca_sampler_kind kind;
        assert_string_equal(ca_sampler_name((ca_sampler_kind)i), names[i]);
        assert_true(ca_sampler_find(names[i], &kind));
        assert_int_equal(kind, i);
        if (i > 0) strcat(all, ", ");
        strcat(all, names[i]);
    }
    assert_string_equal(ca_sampler_names(), all);
    assert_null(ca_sampler_name(CA_SAMPLER_KIND_COUNT));
    ca_sampler_kind kind = CA_SAMPLER_LATTICE;
    static const char *const unknown[] = {"", "Halton", "halto", "halton-", "sobol ", "random"};
    for (size_t i = 0; i < sizeof unknown / sizeof unknown[0]; i++) assert_false(ca_sampler_find(unknown[i], &kind));
    assert_int_equal(kind, CA_SAMPLER_LATTICE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_independent_uniform),
        cmocka_unit_test(test_independent_two_axes),
        cmocka_unit_test(test_independent_correlations_and_bits),
        cmocka_unit_test(test_sobol_nets),
        cmocka_unit_test(test_sobol_one_dimension),
        cmocka_unit_test(test_sobol_independence),
        cmocka_unit_test(test_integration_error),
        cmocka_unit_test(test_pairs_and_range),
        cmocka_unit_test(test_addresses_suffice),
        cmocka_unit_test(test_indices_of_64_bits),
        cmocka_unit_test(test_known_values),
        cmocka_unit_test(test_names),
    };
    return cmocka_run_group_tests_name("sampler", tests, NULL, NULL);
}
