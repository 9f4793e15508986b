/* zsobol: what a pixel has alone, and what squares of pixels have together: nets, and noise that cancels. */
#include "support/chi_square.h"
#include "support/nets.h"
#include "support/sampler_numbers.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

enum { SIDE = 16, BOX_COUNT = SIDE * SIDE };

/* Along the seeds, a number and its neighbour in pixel, index or dimension are uniform and independent: zsobol. */
static void test_uniform_over_seeds(void **state)
{
    (void)state;
    enum { COUNT = 60000 };
    static const uint32_t dimension_steps[] = {1, 2, 3, 8, 64};
    const double level = ca_sidak_level(0.01, 20);
    for (uint32_t k = 0; k < 5; k++)
        for (uint32_t index = 0; index < 4; index++) {
            double observed[BOX_COUNT] = {0}, expected[BOX_COUNT];
            for (uint32_t n = 0; n < COUNT; n++) {
                const ca_sampler sampler = sampler_of(CA_SAMPLER_ZSOBOL, n, 321, 123);
                const ca_stream stream = ca_stream_start(&sampler, 5 + 321 * index, index);
                const uint32_t x = (uint32_t)(ca_sample_1d(&stream, 6) * SIDE);
                const uint32_t y = (uint32_t)(ca_sample_1d(&stream, 6 + dimension_steps[k]) * SIDE);
                observed[x * SIDE + y] += 1.0;
            }
            for (uint32_t i = 0; i < BOX_COUNT; i++) expected[i] = (double)COUNT / BOX_COUNT;
            const double p = ca_chi_square_counts(observed, expected, BOX_COUNT, NULL, NULL);
            if (p < level) fail_msg("index %u, dimension + %u: p = %g", index, dimension_steps[k], p);
        }
}

/* Numbers of different pairs, of 64 x 64 pixels or of 4096 paths of a pixel, fill boxes not less evenly than chance
 * does: no order of samples or pixels serves two pairs. The chi-square statistic over its expectation, the mean over
 * seeds. */
static void test_pairs_are_padded(void **state)
{
    (void)state;
    enum { PIXELS_SIDE = 64, COUNT = PIXELS_SIDE * PIXELS_SIDE, SEEDS = 40 };
    double mean[2] = {0};
    for (uint64_t seed = 0; seed < SEEDS; seed++) {
        const ca_sampler sampler = sampler_of(CA_SAMPLER_ZSOBOL, seed, PIXELS_SIDE, PIXELS_SIDE);
        for (int over_paths = 0; over_paths < 2; over_paths++) {
            double observed[BOX_COUNT] = {0}, expected[BOX_COUNT], statistic;
            for (uint32_t n = 0; n < COUNT; n++) {
                const ca_stream stream = ca_stream_start(&sampler, over_paths ? seed : n, over_paths ? n : 0);
                const uint32_t x = (uint32_t)(ca_sample_1d(&stream, 8) * SIDE);
                const uint32_t y = (uint32_t)(ca_sample_1d(&stream, 10) * SIDE);
                observed[x * SIDE + y] += 1.0;
            }
            for (uint32_t i = 0; i < BOX_COUNT; i++) expected[i] = (double)COUNT / BOX_COUNT;
            (void)ca_chi_square_counts(observed, expected, BOX_COUNT, &statistic, NULL);
            mean[over_paths] += statistic / (BOX_COUNT - 1) / SEEDS;
        }
    }
    printf("           zsobol, two pairs: chi-square over its expectation %.2f over pixels, %.2f over paths\n",
           mean[0], mean[1]);
    assert_true(mean[0] < 1.5 && mean[1] < 1.5);
}

/* t of the points that a square of 2^j pixels a side has with 2^e samples each, the seed-th such run, in one pair. */
static uint32_t square_quality(uint64_t seed, uint32_t dimension, uint32_t j, uint32_t e)
{
    enum { WIDTH = 600 };
    static float x[1 << CA_NET_MOST_BITS], y[1 << CA_NET_MOST_BITS];
    const ca_sampler sampler = sampler_of(CA_SAMPLER_ZSOBOL, seed, WIDTH, 512);
    const uint32_t side = 1u << j;
    const uint64_t corner = (uint64_t)side * (j < 8 ? WIDTH * (seed % 3) + 1 : WIDTH * (seed % 2));
    uint32_t count = 0;
    for (uint32_t pixel = 0; pixel < side * side; pixel++)
        for (uint32_t i = 0; i < 1u << e; i++) {
            const uint64_t sequence = corner + pixel / side * WIDTH + pixel % side;
            const ca_stream stream = ca_stream_start(&sampler, sequence, (seed << e) + i);
            const ca_vec2 u = ca_sample_2d(&stream, dimension);
            x[count] = u.x, y[count++] = u.y;
        }
    return ca_net_quality(x, y, 2 * j + e);
}

/* Each square of pixels has a perfect net, whatever power of two the samples are. */
static void test_squares(void **state)
{
    (void)state;
    for (uint32_t seed = 0; seed < 4; seed++)
        for (uint32_t j = 1; j <= 8; j++)
            for (uint32_t e = 0; 2 * j + e <= CA_NET_MOST_BITS; e += 1 + e / 4) {
                const uint32_t t = square_quality(seed, 2 * (seed + 5 * j), j, e);
                if (t > 0) fail_msg("%u samples in squares of 2^%u: t = %u", 1u << e, j, t);
            }
}

/* What the pixels estimate: smooth, and an edge. Both have mean 0. */
static double integrand(uint32_t which, ca_vec2 u)
{
    const double x = (double)u.x, y = (double)u.y;
    return which == 0 ? 2.4674011002723395 * sin(3.141592653589793 * x) * sin(3.141592653589793 * y) - 1.0
                      : (x * x + y * y < 0.6366197723675814 ? 0.5 : -0.5);
}

typedef struct noise_variance {
    double pixel, square; /* of single pixels' errors, of means over 4 x 4 pixels */
} noise_variance;

static noise_variance measure_noise(ca_sampler_kind kind, uint32_t which, uint32_t samples)
{
    enum { SIZE = 32, SEEDS = 96, SQUARE = 4 };
    noise_variance sum = {0};
    for (uint64_t seed = 0; seed < SEEDS; seed++) {
        const ca_sampler sampler = sampler_of(kind, seed, SIZE, SIZE);
        static double means[(SIZE / SQUARE) * (SIZE / SQUARE)];
        memset(means, 0, sizeof means);
        for (uint32_t pixel = 0; pixel < SIZE * SIZE; pixel++) {
            double error = 0.0;
            for (uint32_t i = 0; i < samples; i++) {
                const ca_stream stream = ca_stream_start(&sampler, pixel, i);
                error += integrand(which, ca_sample_2d(&stream, 8)) / samples;
            }
            sum.pixel += error * error / (SIZE * SIZE * SEEDS);
            means[pixel / (SIZE * SQUARE) * (SIZE / SQUARE) + pixel % SIZE / SQUARE] += error / (SQUARE * SQUARE);
        }
        for (uint32_t i = 0; i < (SIZE / SQUARE) * (SIZE / SQUARE); i++)
            sum.square += means[i] * means[i] / ((SIZE / SQUARE) * (SIZE / SQUARE) * SEEDS);
    }
    return sum;
}

static void test_blue_noise(void **state)
{
    (void)state;
    static const double least[2][3] = {{6.0, 15.0, 40.0}, {4.0, 4.0, 3.0}};
    for (uint32_t which = 0; which < 2; which++)
        for (uint32_t k = 0; k < 3; k++) {
            const uint32_t samples = 1u << (2 * k);
            const noise_variance apart = measure_noise(CA_SAMPLER_SOBOL, which, samples);
            const noise_variance spread = measure_noise(CA_SAMPLER_ZSOBOL, which, samples);
            const double gain = apart.square / spread.square;
            printf("           zsobol, %s, %2u samples: variance of 4 x 4 pixels / %.1f, of a pixel / %.2f\n",
                   which == 0 ? "smooth" : "edge", samples, gain, apart.pixel / spread.pixel);
            assert_true(gain > least[which][k]);
            assert_true(spread.pixel < 1.5 * apart.pixel);
        }
}

static void test_light_is_sobol(void **state)
{
    (void)state;
    const ca_sampler sobol = sampler_of(CA_SAMPLER_SOBOL, 8, 99, 77),
                     zsobol = sampler_of(CA_SAMPLER_ZSOBOL, 8, 99, 77);
    for (uint64_t index = 0; index < 100; index++)
        for (uint32_t d = 0; d < 40; d++)
            assert_true(number_of(&sobol, CA_SEQUENCE_LIGHT, index << (index % 40), d) ==
                        number_of(&zsobol, CA_SEQUENCE_LIGHT, index << (index % 40), d));
}

/* A number depends on its address alone: values written down once. */
static void test_known_values(void **state)
{
    (void)state;
    const ca_sampler zsobol = sampler_of(CA_SAMPLER_ZSOBOL, 1, 1000, 1000);
    assert_true(number_of(&zsobol, 12345, 67, 13) == 0x1.9e7bdp-1f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_uniform_over_seeds),
        cmocka_unit_test(test_pairs_are_padded),
        cmocka_unit_test(test_squares),
        cmocka_unit_test(test_blue_noise),
        cmocka_unit_test(test_light_is_sobol),
        cmocka_unit_test(test_known_values),
    };
    return cmocka_run_group_tests_name("zsobol", tests, NULL, NULL);
}
