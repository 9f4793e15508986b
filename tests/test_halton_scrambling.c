/* The scrambled Halton sampler: numbers are uniform and independent over seeds, between pixels, dimensions, light and
 * camera; pairs of points are distributed as Owen's scrambling does; errors of means fall fast. */
#include "support/chi_square.h"
#include "support/halton_numbers.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* ---- Randomness of the scrambling ------------------------------------------------------------------------------ */

/* p-value of `side` by `side` equally likely boxes. */
static double square_p_value(const uint32_t *counts, uint32_t side, double total)
{
    double observed[1024], expected[1024];
    for (uint32_t i = 0; i < side * side; i++) observed[i] = counts[i], expected[i] = total / (side * side);
    return ca_chi_square_counts(observed, expected, side * side, NULL, NULL);
}

typedef struct number_address {
    uint64_t sequence, index;
    uint32_t dimension;
} number_address;

static float number_at(uint64_t seed, number_address at)
{
    static ca_sampler sampler; /* prepared once: the film is always the same */
    if (sampler.width == 0) sampler = sampler_of(CA_SAMPLER_HALTON, 0, 100, 70);
    sampler.seed = seed;
    const ca_stream stream = ca_stream_start(&sampler, at.sequence, at.index);
    return ca_sample_1d(&stream, at.dimension);
}

/* Over seeds, both numbers of each of these pairs are uniform and know nothing of each other. */
static void test_numbers_are_independent(void **state)
{
    (void)state;
    enum { SEEDS = 40000, SIDE = 16 };
    const uint64_t light = CA_SEQUENCE_LIGHT;
    const number_address pairs[][2] = {
        {{light, 5, 0}, {light, 5, 1}},          /* dimensions */
        {{light, 123456789, 2}, {light, 123456789, 3}},
        {{light, 77, 8}, {light, 77, 16}},
        {{light, 77, 200}, {light, 77, 201}},
        {{light, 77, 293}, {light, 77, 294}},    /* about the end of the table */
        {{light, 77, 294}, {light, 77, 295}},
        {{light, 77, 5}, {light, 77, 7}},
        {{12, 1, 400}, {12, 1, 401}},
        {{0, 0, 2}, {light, 0, 2}},              /* the camera's path and the light's of the same number */
        {{0, 0, 9}, {light, 0, 9}},
        {{0, 0, 0}, {light, 0, 0}},
        {{0, 0, 400}, {light, 0, 400}},
        {{12, 3, 0}, {12, 3, 1}},                /* within the pixel */
        {{12, 3, 0}, {13, 3, 0}},                /* neighbours' places */
        {{12, 3, 1}, {13, 3, 1}},
        {{12, 3, 0}, {112, 3, 0}},
        {{12, 3, 1}, {112, 3, 1}},
        {{12, 3, 300}, {13, 3, 300}},
        {{0, 0, 0}, {0, 0, 2}},
    };
    const uint32_t pair_count = sizeof pairs / sizeof pairs[0];
    for (uint32_t p = 0; p < pair_count; p++) {
        uint32_t counts[SIDE * SIDE] = {0};
        for (uint64_t seed = 0; seed < SEEDS; seed++) {
            const uint32_t x = (uint32_t)(number_at(seed, pairs[p][0]) * (float)SIDE);
            const uint32_t y = (uint32_t)(number_at(seed, pairs[p][1]) * (float)SIDE);
            counts[x * SIDE + y]++;
        }
        const double p_value = square_p_value(counts, SIDE, SEEDS);
        if (p_value < ca_sidak_level(0.01, pair_count)) fail_msg("pair %u: p = %g", p, p_value);
    }
}

/* Over the paths of one stream, no dimension is a function of another, also where they share a base. Not a test of
 * independence: blocks of paths are spread evenly in each dimension, which makes most p-values large and a few
 * small. */
static void test_pairs_of_dimensions_fill_the_square(void **state)
{
    (void)state;
    enum { PATHS = 20000, SIDE = 16 };
    static const uint32_t pairs[][2] = {{0, 1},   {2, 3},   {8, 9},     {0, 5},    {5, 6},
                                        {15, 23}, {0, 294}, {294, 295}, {400, 401}};
    static const number_function numbers[] = {light_number, pixel_17};
    static const ca_sampler_kind kinds[] = {CA_SAMPLER_HALTON, CA_SAMPLER_HALTON_PLAIN};
    for (uint32_t p = 0; p < sizeof pairs / sizeof pairs[0]; p++)
        for (uint32_t k = 0; k < 4; k++) {
            const ca_sampler sampler = sampler_of(kinds[k / 2], 4, 36, 10);
            uint32_t counts[SIDE * SIDE] = {0};
            for (uint64_t index = 0; index < PATHS; index++) {
                const uint32_t x = (uint32_t)(numbers[k % 2](&sampler, index, pairs[p][0]) * (float)SIDE);
                const uint32_t y = (uint32_t)(numbers[k % 2](&sampler, index, pairs[p][1]) * (float)SIDE);
                counts[x * SIDE + y]++;
            }
            const double p_value = square_p_value(counts, SIDE, PATHS);
            if (p_value < 1e-15)
                fail_msg("dimensions %u and %u, %u: p = %g", pairs[p][0], pairs[p][1], k, p_value);
        }
}

/* Each number alone, over seeds, is uniform, whatever its dimension. */
static void test_every_dimension_is_uniform(void **state)
{
    (void)state;
    enum { SEEDS = 6000, SIDE = 10 };
    for (uint32_t dimension = 0; dimension < 320; dimension++) {
        uint32_t counts[SIDE * SIDE] = {0};
        for (uint64_t seed = 0; seed < SEEDS; seed++) {
            const number_address at = {seed % 2 ? CA_SEQUENCE_LIGHT : 77, seed % 5 * 1000, dimension};
            counts[(uint32_t)(number_at(seed, at) * (float)(SIDE * SIDE))]++;
        }
        const double p_value = square_p_value(counts, SIDE, SEEDS);
        if (p_value < ca_sidak_level(0.01, 320)) fail_msg("dimension %u: p = %g", dimension, p_value);
    }
}

/* The places in the pixels' squares, over pixels. */
static void test_places_in_pixels_are_uniform(void **state)
{
    (void)state;
    enum { SIDE = 24 };
    static const uint32_t films[][2] = {{64, 81}, {300, 200}};
    for (uint32_t f = 0; f < 2; f++)
        for (uint64_t index = 0; index < 4; index++) {
            const ca_sampler sampler = sampler_of(CA_SAMPLER_HALTON, 6, films[f][0], films[f][1]);
            const uint32_t pixels = films[f][0] * films[f][1];
            uint32_t counts[SIDE * SIDE] = {0};
            for (uint32_t pixel = 0; pixel < pixels; pixel++) {
                const ca_stream stream = ca_stream_start(&sampler, pixel, index);
                const ca_vec2 place = ca_sample_2d(&stream, CA_DIM_FILM);
                counts[(uint32_t)(place.x * (float)SIDE) * SIDE + (uint32_t)(place.y * (float)SIDE)]++;
            }
            const double p_value = square_p_value(counts, SIDE, pixels);
            if (p_value < ca_sidak_level(0.01, 8)) fail_msg("film %u, path %u: p = %g", f, (unsigned)index, p_value);
        }
}

/* Over seeds, the first `length` digits of two numbers are as under Owen's scrambling: equal as long as the numbers'
 * are, then any two different ones, then any two. */
static void test_pairs_are_as_owen_scrambles_them(void **state)
{
    (void)state;
    enum { SEEDS = 60000 };
    static const struct {
        uint32_t row, base;
        uint64_t a, b;
        uint32_t equal; /* first digits that are */
    } cases[] = {{1, 3, 0, 1, 0},  {1, 3, 1, 4, 1},  {1, 3, 5, 14, 2},  {2, 5, 0, 2, 0},   {2, 5, 3, 4, 0},
                 {2, 5, 7, 12, 1}, {3, 7, 1, 6, 0},  {3, 7, 0, 49, 2},  {4, 11, 0, 1, 0},  {4, 11, 3, 8, 0},
                 {4, 11, 3, 14, 1}, {6, 17, 1, 9, 0}, {7, 19, 0, 17, 0}, {0, 2, 0, 1, 0},  {0, 2, 1, 3, 1},
                 {8, 23, 0, 23, 1}};
    const uint32_t case_count = sizeof cases / sizeof cases[0];
    for (uint32_t c = 0; c < case_count; c++) {
        const uint32_t base = cases[c].base, dimension = halton_dimension(cases[c].row);
        static double apart[23 * 23], next[23 * 23], expect_apart[23 * 23], expect_next[23 * 23];
        memset(apart, 0, sizeof apart), memset(next, 0, sizeof next);
        double before = 1.0; /* the power that brings the first digit that differs before the point */
        for (uint32_t i = 0; i <= cases[c].equal; i++) before *= base;
        for (uint64_t seed = 0; seed < SEEDS; seed++) {
            const number_address a = {CA_SEQUENCE_LIGHT, cases[c].a, dimension};
            const number_address b = {CA_SEQUENCE_LIGHT, cases[c].b, dimension};
            const double x = before * (double)number_at(seed, a), y = before * (double)number_at(seed, b);
            if (floor(x / base) != floor(y / base)) fail_msg("case %u: digits before differ", c);
            apart[(uint32_t)fmod(x, base) * base + (uint32_t)fmod(y, base)] += 1.0;
            next[(uint32_t)fmod(x * base, base) * base + (uint32_t)fmod(y * base, base)] += 1.0;
        }
        for (uint32_t i = 0; i < base * base; i++) {
            const bool same = i / base == i % base;
            if (same && apart[i] != 0.0) fail_msg("case %u: %g numbers share a digit that differs", c, apart[i]);
            expect_apart[i] = same ? 0.0 : (double)SEEDS / (base * (base - 1));
            expect_next[i] = (double)SEEDS / (base * base);
        }
        const double level = ca_sidak_level(0.01, 2 * case_count);
        const double p_apart = ca_chi_square_counts(apart, expect_apart, base * base, NULL, NULL);
        const double p_next = ca_chi_square_counts(next, expect_next, base * base, NULL, NULL);
        if (p_apart < level || p_next < level)
            fail_msg("base %u, numbers %u and %u: p = %g, of the next digits %g", base, (unsigned)cases[c].a,
                     (unsigned)cases[c].b, p_apart, p_next);
    }
}

static void test_seeds(void **state)
{
    (void)state;
    ca_sampler one = sampler_of(CA_SAMPLER_HALTON, 1, 20, 10), two = sampler_of(CA_SAMPLER_HALTON, 2, 20, 10);
    for (uint32_t dimension = 0; dimension < 320; dimension++) {
        uint32_t same = 0;
        for (uint64_t index = 0; index < 100; index++) {
            same += light_number(&one, index, dimension) == light_number(&two, index, dimension);
            same += number_of(&one, 33, index, dimension) == number_of(&two, 33, index, dimension);
        }
        assert_in_range(same, 0, 2);
    }
    one.kind = two.kind = CA_SAMPLER_HALTON_PLAIN;
    for (uint32_t dimension = 0; dimension < 320; dimension++)
        assert_true(number_of(&one, 33, 12, dimension) == number_of(&two, 33, 12, dimension));
}

/* ---- Errors of means ------------------------------------------------------------------------------------------- */

/* Mean square error, over seeds, of the mean of a product of smooth functions of integral 1, one for each
 * dimension. */
static double mean_square_error(ca_sampler_kind kind, uint64_t sequence, const uint32_t *dimensions, uint32_t count,
                                uint32_t n)
{
    enum { SEEDS = 100 };
    double squares = 0.0;
    ca_sampler sampler = sampler_of(kind, 0, 100, 100);
    for (sampler.seed = 0; sampler.seed < SEEDS; sampler.seed++) {
        double sum = 0.0;
        for (uint32_t i = 0; i < n; i++) {
            const ca_stream stream = ca_stream_start(&sampler, sequence, i);
            double product = 1.0;
            for (uint32_t d = 0; d < count; d++) {
                const double u = (double)ca_sample_1d(&stream, dimensions[d]);
                product *= 0.5 + 1.5 * u * u;
            }
            sum += product;
        }
        squares += (sum / n - 1.0) * (sum / n - 1.0);
    }
    return squares / SEEDS;
}

/* The slope of log(error) over log(n), for n = factor^2, factor^3, ... up to 2000 or so. */
static double exponent(ca_sampler_kind kind, uint64_t sequence, const uint32_t *dimensions, uint32_t count,
                       uint32_t factor)
{
    double sx = 0.0, sy = 0.0, sxx = 0.0, sxy = 0.0, steps = 0.0;
    for (uint32_t n = factor < 6 ? 32 : factor * factor; n <= 2048; n *= factor, steps += 1.0) {
        const double x = log(n), y = 0.5 * log(mean_square_error(kind, sequence, dimensions, count, n));
        sx += x, sy += y, sxx += x * x, sxy += x * y;
    }
    return (steps * sxy - sx * sy) / (steps * sxx - sx * sx);
}

static void test_errors_fall_fast(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        uint64_t sequence;
        uint32_t dimensions[4], count, factor;
        double at_most;
    } cases[] = {
        /* Powers of 6 fill the boxes of bases 2 and 3. */
        {"light, position, n = 6^k", CA_SEQUENCE_LIGHT, {0, 1}, 2, 6, -1.05},
        {"light, position", CA_SEQUENCE_LIGHT, {0, 1}, 2, 2, -0.85},
        {"light, position and direction", CA_SEQUENCE_LIGHT, {0, 1, 2, 3}, 4, 2, -0.8},
        {"light, a vertex", CA_SEQUENCE_LIGHT, {8, 9, 12, 13}, 4, 2, -0.65},
        {"pixel, place, n = 6^k", 4321, {0, 1}, 2, 6, -1.05},
        {"pixel, place and lens", 4321, {0, 1, 2, 3}, 4, 2, -0.8},
        {"past the table", CA_SEQUENCE_LIGHT, {500}, 1, 2, -1.3},
    };
    for (uint32_t c = 0; c < sizeof cases / sizeof cases[0]; c++) {
        const double slope = exponent(CA_SAMPLER_HALTON, cases[c].sequence, cases[c].dimensions, cases[c].count,
                                      cases[c].factor);
        printf("           error of a smooth mean falls as n^%.2f (%s)\n", slope, cases[c].name);
        assert_true(slope < cases[c].at_most);
    }
    const double random = exponent(CA_SAMPLER_INDEPENDENT, CA_SEQUENCE_LIGHT, cases[2].dimensions, 4, 2);
    assert_true(random > -0.6 && random < -0.4);
}

/* b^k numbers are one in each of as many intervals and else independent: the variance of their mean is then that of
 * stratified sampling, 1 / (12 n^3). Two of b numbers are in two different intervals, equally likely. */
static void test_variances_are_owen_s(void **state)
{
    (void)state;
    enum { SEEDS = 20000 };
    static const uint32_t cases[][2] = {{0, 8},  {1, 9}, {1, 27}, {2, 25}, {3, 7},
                                        {5, 13}, {1, 2}, {3, 2},  {10, 2}, {3, 3}};
    for (uint32_t c = 0; c < sizeof cases / sizeof cases[0]; c++) {
        const double n = cases[c][1], base = halton_primes[cases[c][0]];
        double squares = 0.0;
        for (uint64_t seed = 0; seed < SEEDS; seed++) {
            double sum = 0.0;
            for (uint32_t i = 0; i < cases[c][1]; i++) {
                const number_address at = {CA_SEQUENCE_LIGHT, i, halton_dimension(cases[c][0])};
                sum += (double)number_at(seed, at);
            }
            squares += (sum / n - 0.5) * (sum / n - 0.5);
        }
        /* Strata without replacement: each number's is of variance (b^2 - 1) / (12 b^2), any two's covariance that
         * over
         * -(b - 1). */
        const double strata = (base * base - 1.0) / (12.0 * base * base);
        const double expected = n < base
                                    ? (strata * (1.0 - (n - 1.0) / (base - 1.0)) + 1.0 / (12.0 * base * base)) / n
                                    : 1.0 / (12.0 * n * n * n);
        const double ratio = squares / SEEDS / expected;
        if (fabs(ratio - 1.0) > 0.06) fail_msg("%g numbers in base %g: %.3f of Owen's variance", n, base, ratio);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_numbers_are_independent),
        cmocka_unit_test(test_pairs_of_dimensions_fill_the_square),
        cmocka_unit_test(test_every_dimension_is_uniform),
        cmocka_unit_test(test_places_in_pixels_are_uniform),
        cmocka_unit_test(test_pairs_are_as_owen_scrambles_them),
        cmocka_unit_test(test_seeds),
        cmocka_unit_test(test_errors_fall_fast),
        cmocka_unit_test(test_variances_are_owen_s),
    };
    return cmocka_run_group_tests_name("halton scrambling", tests, NULL, NULL);
}
