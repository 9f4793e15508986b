/* The lattice sampler: its first 2^m points and every later block of as many are one shifted lattice, in every
 * dimension and at every index; projections that are used together are good lattices; shifts are independent; smooth
 * periodic functions are integrated at the lattice's rate. */
#include "math/numeric.h"
#include "sampling/lattice_table.h"
#include "sampling/owen.h"
#include "sampling/sampler.h"
#include "support/chi_square.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static ca_stream start(uint64_t seed, uint64_t sequence, uint64_t index)
{
    static ca_sampler sampler;
    sampler = (ca_sampler){.kind = CA_SAMPLER_LATTICE, .seed = seed};
    return ca_stream_start(&sampler, sequence, index);
}

/* In units of 2^-24. */
static uint32_t number(uint64_t sequence, uint64_t index, uint32_t dimension)
{
    const ca_stream stream = start(1, sequence, index);
    return (uint32_t)(ca_sample_1d(&stream, dimension) * 0x1p24f);
}

/* (x_index - x_first) mod 1, in units of 2^-24: exact where the lattice has 2^24 points at most, for both are
 * truncated alike. */
static uint32_t step_from(uint64_t first, uint64_t index, uint32_t dimension)
{
    return (number(5, first + index, dimension) - number(5, first, dimension)) & 0xffffffu;
}

static uint32_t inverse_by_bits(uint32_t index, uint32_t m)
{
    uint32_t inverse = 0;
    for (uint32_t bit = 0; bit < m; bit++) inverse |= (index >> bit & 1) << (m - 1 - bit);
    return inverse;
}

/* ---- Structure ------------------------------------------------------------------------------------------------- */

/* The published vector's 250 numbers, by their sum and sum of squares, less 106383 and 247945, in any order. */
static void test_table(void **state)
{
    (void)state;
    uint64_t sum = 0, squares = 0;
    for (uint32_t d = 0; d < CA_LATTICE_DIMENSIONS; d++) {
        const uint64_t z = ca_lattice_published[d];
        assert_true(z % 2 == 1 && z < 1u << 19);
        for (uint32_t e = 0; e < d; e++) assert_true(ca_lattice_published[e] != z);
        sum += z;
        squares += z * z;
    }
    assert_int_equal(sum, 63550560 - 106383 - 247945);
    assert_int_equal(squares, 21986831364594u - 106383ull * 106383u - 247945ull * 247945u);
}

/* The first 2^m points are k z / 2^m in the order of the radical inverse, for every m: against integers. */
static void test_points(void **state)
{
    (void)state;
    for (uint32_t m = 0; m <= 20; m += 5)
        for (uint32_t d = 0; d < CA_LATTICE_DIMENSIONS; d++)
            for (uint32_t i = 0; i < 1u << m; i += 1 + (1u << m) / 37) {
                const uint64_t k = inverse_by_bits(i, m);
                const uint32_t expected = (uint32_t)(k * ca_lattice_published[d] % (1u << m)) << (24 - m);
                assert_int_equal(step_from(0, i, d), expected);
            }
}

/* From 2^20 points on the upper bits count. */
static void test_many_points(void **state)
{
    (void)state;
    for (uint32_t m = 24; m <= 60; m += 6)
        for (uint32_t d = 0; d < CA_LATTICE_DIMENSIONS; d += 5) {
            const uint64_t z = ca_lattice_published[d] + ((uint64_t)ca_lattice_upper[d] << 20);
            const uint32_t expected = (uint32_t)((z << (64 - m)) >> 40); /* 1 z / 2^m, rounded down */
            const uint32_t step = step_from(0, UINT64_C(1) << (m - 1), d);
            assert_true(step == expected || step == ((expected + 1) & 0xffffffu));
        }
}

/* Differences of points are points, with one and the same number in all dimensions of a run of 248, wherever the
 * aligned block of 2^m indices lies. */
static void check_block(uint64_t first, uint32_t m, uint32_t run)
{
    static uint32_t of_multiple[1 << 12]; /* which index is k z / 2^m */
    const uint32_t count = 1u << m, base = run * CA_LATTICE_DIMENSIONS;
    uint32_t inverse = ca_lattice_published[0];
    for (int i = 0; i < 5; i++) inverse *= 2 - ca_lattice_published[0] * inverse;
    memset(of_multiple, 0xff, sizeof of_multiple);
    for (uint32_t i = 0; i < count; i++) {
        const uint32_t step = step_from(first, i, base);
        assert_int_equal(step & ((1u << (24 - m)) - 1), 0);
        const uint32_t multiple = (step >> (24 - m)) * inverse % count;
        assert_int_equal(of_multiple[multiple], 0xffffffffu); /* each once */
        of_multiple[multiple] = i;
    }
    for (uint32_t k = 0; k < count; k++)
        for (uint32_t d = 1; d < CA_LATTICE_DIMENSIONS; d += 1 + d / 8)
            assert_int_equal(step_from(first, of_multiple[k], base + d),
                             (uint32_t)((uint64_t)k * ca_lattice_published[d] % count) << (24 - m));
}

static void test_blocks(void **state)
{
    (void)state;
    static const uint64_t firsts[] = {0, 3u << 12, UINT64_C(1) << 20, (UINT64_C(1) << 32) - (1 << 12),
                                      UINT64_C(0x9e3779b97f4a7) << 12};
    for (size_t i = 0; i < sizeof firsts / sizeof firsts[0]; i++)
        for (uint32_t run = 0; run < 3; run++)
            for (uint32_t m = 0; m <= 10; m += 5) check_block(firsts[i], m, run);
    check_block(firsts[4], 12, 1);
    check_block(UINT64_MAX - 4095, 12, 0);
    check_block(0, 6, UINT32_MAX / CA_LATTICE_DIMENSIONS - 1);
}

/* Runs of dimensions have orders of their own: the same index is another multiple in each. */
static void test_orders(void **state)
{
    (void)state;
    uint32_t equal = 0;
    for (uint32_t run = 1; run < 9; run++)
        for (uint32_t i = 0; i < 1024; i++)
            equal += step_from(0, i, 0) == step_from(0, i, run * CA_LATTICE_DIMENSIONS);
    assert_in_range(equal, 40, 140); /* 11 in each: of indices 2^k to 2^(k+1) about one */
}

/* ---- Quality of projections ------------------------------------------------------------------------------------ */

/* The length of the shortest h != 0 with h[0] a + h[1] b = 0 modulo 2^m (Lagrange's reduction of two vectors), over
 * that of the densest lattice: its inverse is the distance between the lines on which the points of the projection
 * lie. */
static double dual_length(uint64_t a, uint64_t b, uint32_t m)
{
    uint64_t inverse = a;
    for (int i = 0; i < 5; i++) inverse *= 2 - a * inverse;
    double u[2] = {ldexp(1.0, (int)m), 0.0}, v[2] = {-(double)(b * inverse & ((UINT64_C(1) << m) - 1)), 1.0};
    for (;;) {
        if (u[0] * u[0] + u[1] * u[1] < v[0] * v[0] + v[1] * v[1]) {
            const double swap[2] = {u[0], u[1]};
            memcpy(u, v, sizeof u);
            memcpy(v, swap, sizeof v);
        }
        const double v2 = v[0] * v[0] + v[1] * v[1], steps = rint((u[0] * v[0] + u[1] * v[1]) / v2);
        if (steps == 0.0) return sqrt(v2 * sqrt(0.75) / ldexp(1.0, (int)m));
        u[0] -= steps * v[0];
        u[1] -= steps * v[1];
    }
}

/* The smallest length among dimensions that share a group of `size`, for 2^from to 2^to points. */
static double worst(uint32_t size, uint32_t from, uint32_t to)
{
    double least = HUGE_VAL;
    for (uint32_t d = 0; d < CA_LATTICE_DIMENSIONS; d++)
        for (uint32_t e = d - d % size; e < d; e++)
            for (uint32_t m = from; m <= to; m++) {
                const uint64_t a = ca_lattice_published[d] | (uint64_t)ca_lattice_upper[d] << 20;
                const uint64_t b = ca_lattice_published[e] | (uint64_t)ca_lattice_upper[e] << 20;
                least = fmin(least, dual_length(a, b, m));
            }
    return least;
}

/* n times the root mean square error, over shifts, of the worst integrand of two dimensions whose derivative d^2/dx
 * dy has a square integral of one: sqrt(mean of B2(x) B2(y)). In the published order pairs have up to 64. */
static double pair_error(uint32_t d, uint32_t m)
{
    const uint32_t count = 1u << m;
    double sum = 0.0;
    for (uint32_t k = 0; k < count; k++) {
        const double x = (double)(k * ca_lattice_published[d] % count) / count;
        const double y = (double)(k * ca_lattice_published[d + 1] % count) / count;
        sum += (x * x - x + 1.0 / 6.0) * (y * y - y + 1.0 / 6.0);
    }
    return sqrt(sum * count);
}

static void test_pairs(void **state)
{
    (void)state;
    double largest = 0.0, largest_early = 0.0;
    for (uint32_t d = 0; d < CA_LATTICE_DIMENSIONS; d += 2)
        for (uint32_t m = 2; m <= 14; m++) {
            const double error = pair_error(d, m);
            largest = fmax(largest, error);
            if (d < 64) largest_early = fmax(largest_early, error);
        }
    printf("n times the error of pairs: %.2f at most, %.2f in the first 64 dimensions\n", largest, largest_early);
    assert_true(largest < 3.5 && largest_early < 3.5);
}

static void test_projections(void **state)
{
    (void)state;
    assert_true(fabs(dual_length(1, 5, 4) - sqrt(10.0 * sqrt(0.75) / 16.0)) < 1e-12); /* h = (1, 3) */
    printf("shortest dual vectors: pairs %.3f, fours %.3f, vertices %.3f to 2^20 points; %.3f, %.3f, %.3f to 2^48\n",
           worst(2, 2, 20), worst(4, 2, 20), worst(8, 2, 20), worst(2, 21, 48), worst(4, 21, 48), worst(8, 21, 48));
    assert_true(worst(2, 2, 20) > 0.2 && worst(2, 21, 48) > 0.3);
    assert_true(worst(4, 2, 20) > 0.11 && worst(4, 21, 48) > 0.16);
    assert_true(worst(8, 2, 20) > 0.08 && worst(8, 21, 48) > 0.13);
}

/* Millions of points beyond the 2^32th fill boxes of a pair evenly: a fine net of lines would leave some empty. */
static void test_far_points_fill(void **state)
{
    (void)state;
    enum { SIDES = 512, COUNT = 1 << 22 }; /* 16 a box */
    static uint16_t boxes[SIDES * SIDES];
    static const uint32_t dimensions[] = {0, 2, 8, 246, 496};
    for (size_t k = 0; k < sizeof dimensions / sizeof dimensions[0]; k++) {
        memset(boxes, 0, sizeof boxes);
        const uint64_t first = (UINT64_C(1) << 33) + 77;
        for (uint32_t i = 0; i < COUNT; i++) {
            const ca_stream stream = start(3, CA_SEQUENCE_LIGHT, first + i);
            const ca_vec2 p = ca_sample_2d(&stream, dimensions[k]);
            boxes[(uint32_t)(p.y * SIDES) * SIDES + (uint32_t)(p.x * SIDES)]++;
        }
        for (uint32_t i = 0; i < SIDES * SIDES; i++) assert_in_range(boxes[i], 6, 28);
    }
}

/* ---- Shifts ---------------------------------------------------------------------------------------------------- */

/* First points over pixels, over seeds and over dimensions, alone and next to each other, are uniform. */
static void test_shifts(void **state)
{
    (void)state;
    enum { SIDES = 32, COUNT = 60000, AXES = 4 };
    static double observed[SIDES * SIDES], expected[SIDES * SIDES];
    for (int axis = 0; axis < AXES; axis++) {
        memset(observed, 0, sizeof observed);
        for (int i = 0; i < SIDES * SIDES; i++) expected[i] = (double)COUNT / (SIDES * SIDES);
        uint32_t before = number(0, 0, 0);
        for (uint32_t i = 1; i <= COUNT; i++) {
            uint32_t now = 0;
            if (axis == 0) now = number(i, 0, 0);
            if (axis == 1) now = number(i / CA_LATTICE_DIMENSIONS, 0, i % CA_LATTICE_DIMENSIONS);
            const ca_stream stream = start(i, 9, 0);
            if (axis == 2) now = (uint32_t)(ca_sample_1d(&stream, 4) * 0x1p24f);
            if (axis == 3) now = number((uint64_t)i * 1920, 0, 3); /* down a column of pixels */
            observed[(now >> 19) * SIDES + (before >> 19)] += 1.0;
            before = now;
        }
        const double p = ca_chi_square_counts(observed, expected, SIDES * SIDES, NULL, NULL);
        if (p < ca_sidak_level(0.01, AXES)) fail_msg("shifts along axis %d: p = %g", axis, p);
    }
}

/* ---- Over the image or tiles ----------------------------------------------------------------------------------- */

static ca_sampler prepared(ca_sampler_kind kind, uint64_t seed, uint32_t width, uint32_t height)
{
    ca_sampler sampler = {.kind = kind, .seed = seed};
    ca_sampler_prepare(&sampler, width, height);
    return sampler;
}

/* The points k / s^2 of the lattice (1, s w + 1), by integers: each pixel's is in it, with all numbers of the whole
 * sequence in the other dimensions; run after run. */
static void check_image(uint32_t width, uint32_t height, uint32_t bits)
{
    const ca_sampler plain = prepared(CA_SAMPLER_LATTICE_PLAIN, 3, width, height);
    const uint64_t s = UINT64_C(1) << bits;
    const uint64_t w = (uint64_t)((double)s * 0.6180339887498949) | 1;
    assert_int_equal(plain.pixels.lattice.bits, bits);
    for (uint32_t p = 0; p < width * height; p += 1 + width * height / 997)
        for (uint64_t run = 0; run < 5; run += 2) {
            const ca_stream path = ca_stream_start(&plain, p, run);
            const uint64_t k = bits == 0 ? 0 : path.index >> (64 - 2 * bits);
            assert_int_equal(k >> bits, p % width);
            assert_int_equal(((k * (s * w + 1)) & (s * s - 1)) >> bits, p / width);
            const uint64_t number = run * s * s + (bits == 0 ? 0 : inverse_by_bits((uint32_t)k, 2 * bits));
            const ca_stream whole = ca_stream_start(&plain, CA_SEQUENCE_LIGHT, number);
            assert_true(whole.index == path.index);
            for (uint32_t d = 2; d < 600; d += 1 + d / 3)
                assert_true(ca_sample_1d(&path, d) == ca_sample_1d(&whole, d));
        }
}

static void test_image(void **state)
{
    (void)state;
    check_image(1, 1, 0);
    check_image(3, 5, 3);
    check_image(64, 64, 6);
    check_image(1920, 1080, 11);
}

/* Tiles have the same lattice, shifted apart unless it is plain; the place within a pixel moves from run to run, as a
 * lattice of its own. */
static void test_tiles(void **state)
{
    (void)state;
    enum { WIDTH = 100, HERE = 20 * WIDTH + 37, THERE = HERE + 16 };
    const ca_sampler plain = prepared(CA_SAMPLER_LATTICE_TILES_PLAIN, 3, WIDTH, 60);
    const ca_sampler tiles = prepared(CA_SAMPLER_LATTICE_TILES, 3, WIDTH, 60);
    assert_int_equal(tiles.pixels.lattice.bits, 4);
    uint32_t same = 0;
    for (uint32_t d = 0; d < 40; d++) {
        const ca_stream here = ca_stream_start(&plain, HERE, 1), there = ca_stream_start(&plain, THERE, 1);
        const ca_stream here_shifted = ca_stream_start(&tiles, HERE, 1),
                        there_shifted = ca_stream_start(&tiles, THERE, 1);
        assert_true(ca_sample_1d(&here, d) == ca_sample_1d(&there, d));
        same += ca_sample_1d(&here_shifted, d) == ca_sample_1d(&there_shifted, d);
    }
    assert_true(same < 2);
    static const ca_sampler_kind kinds[] = {CA_SAMPLER_LATTICE_TILES, CA_SAMPLER_LATTICE_IMAGE,
                                            CA_SAMPLER_LATTICE_TILES_PLAIN};
    for (int k = 0; k < 3; k++) {
        const ca_sampler sampler = prepared(kinds[k], 3, WIDTH, 60);
        uint32_t boxes[2][32] = {{0}};
        for (uint32_t i = 0; i < 32; i++) {
            const ca_stream path = ca_stream_start(&sampler, HERE, i);
            for (uint32_t d = 0; d < 2; d++) boxes[d][(uint32_t)(ca_sample_1d(&path, d) * 32.0f)]++;
        }
        for (uint32_t d = 0; d < 2; d++)
            for (uint32_t i = 0; i < 32; i++) assert_in_range(boxes[d][i], 0, 2);
    }
}

/* Light paths are shifted apart from camera paths, seeds from each other, and pixels' places too. */
static void test_image_shifts(void **state)
{
    (void)state;
    const ca_sampler one = prepared(CA_SAMPLER_LATTICE_IMAGE, 1, 64, 64),
                     two = prepared(CA_SAMPLER_LATTICE_IMAGE, 2, 64, 64);
    uint32_t same = 0;
    for (uint32_t d = 0; d < 40; d++) {
        const ca_stream a = ca_stream_start(&one, 77, 0), b = ca_stream_start(&two, 77, 0),
                        other = ca_stream_start(&one, 78, 0);
        const ca_stream light = ca_stream_start(&one, CA_SEQUENCE_LIGHT, ca_reverse_bits64(a.index));
        assert_true(light.index == a.index);
        same += ca_sample_1d(&a, d) == ca_sample_1d(&b, d);
        same += ca_sample_1d(&a, d) == ca_sample_1d(&light, d);
        if (d < 2) same += ca_sample_1d(&a, d) == ca_sample_1d(&other, d);
    }
    assert_true(same < 3);
}

/* ---- Integrals ------------------------------------------------------------------------------------------------- */

/* prod(1 + B2(x) / (j + 1)^2 * 6): periodic, its integral is one. */
static double periodic(const ca_stream *stream, uint32_t first, uint32_t count)
{
    double product = 1.0;
    for (uint32_t j = 0; j < count; j++) {
        const double x = (double)ca_sample_1d(stream, first + j) + 0x1p-25;
        product *= 1.0 + 6.0 * (x * x - x + 1.0 / 6.0) / ((j + 1) * (j + 1));
    }
    return product;
}

/* Fitted exponent of the root mean square error over shifts. */
static double exponent(uint32_t first, uint32_t count, double *last)
{
    enum { SHIFTS = 16, FROM = 6, TO = 14 };
    double sum_x = 0, sum_y = 0, sum_xx = 0, sum_xy = 0, squares[TO + 1] = {0};
    for (uint32_t shift = 0; shift < SHIFTS; shift++) {
        double sum = 0.0;
        for (uint32_t m = 0, i = 0; m <= TO; m++) {
            for (; i < 1u << m; i++) {
                const ca_stream stream = start(11, shift, i);
                sum += periodic(&stream, first, count);
            }
            squares[m] += pow(sum / (1u << m) - 1.0, 2.0) / SHIFTS;
        }
    }
    for (uint32_t m = FROM; m <= TO; m++) {
        const double x = m * log(2.0), y = 0.5 * log(squares[m]);
        sum_x += x, sum_y += y, sum_xx += x * x, sum_xy += x * y;
    }
    const double points = TO - FROM + 1;
    *last = sqrt(squares[TO]);
    return (points * sum_xy - sum_x * sum_y) / (points * sum_xx - sum_x * sum_x);
}

static void test_periodic_integrals(void **state)
{
    (void)state;
    static const uint32_t firsts[] = {0, 8, 240, 248, 244}, counts[] = {4, 8, 8, 8, 8};
    for (size_t k = 0; k < 5; k++) {
        double last;
        const double rate = exponent(firsts[k], counts[k], &last);
        printf("periodic, dimensions %u to %u: error n^%.2f, %.2g at 2^14\n", firsts[k], firsts[k] + counts[k] - 1,
               rate, last);
        /* across the border of two runs half the pairs are of independent lattices */
        assert_true(rate < (k < 4 ? -1.1 : -0.4));
        assert_true(last < (k < 4 ? 1e-5 : 1e-3));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_table),
        cmocka_unit_test(test_points),
        cmocka_unit_test(test_many_points),
        cmocka_unit_test(test_blocks),
        cmocka_unit_test(test_orders),
        cmocka_unit_test(test_projections),
        cmocka_unit_test(test_pairs),
        cmocka_unit_test(test_far_points_fill),
        cmocka_unit_test(test_shifts),
        cmocka_unit_test(test_image),
        cmocka_unit_test(test_tiles),
        cmocka_unit_test(test_image_shifts),
        cmocka_unit_test(test_periodic_integrals),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
