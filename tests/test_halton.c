/* Halton samplers: the textbook's numbers exactly; every path of a pixel falls into it, and none is left out;
 * elementary intervals keep their points, scrambled or not; discrepancies are small. */
#include "support/halton_numbers.h"
#include "support/test_random.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static uint64_t random_u64(ca_test_random *random)
{
    const uint64_t high = ca_test_random_u32(random);
    return high << 32 | ca_test_random_u32(random);
}

/* ---- The textbook's sequence ----------------------------------------------------------------------------------- */

static void test_primes(void **state)
{
    (void)state;
    assert_int_equal(sizeof halton_primes / sizeof halton_primes[0], CA_PRIME_COUNT);
    uint32_t found = 0;
    for (uint32_t n = 2; found < CA_PRIME_COUNT; n++) {
        bool prime = true;
        for (uint32_t d = 2; d * d <= n; d++) prime = prime && n % d != 0;
        if (prime) assert_int_equal(halton_primes[found++], n);
    }
}

/* 2^24 times the radical inverse to the first digits whose power of the base is 2^24 or more, rounded up. */
static uint32_t exact_inverse(uint32_t base, uint64_t number)
{
    uint64_t numerator = 0, denominator = 1;
    while (denominator < 1u << 24) {
        numerator = numerator * base + number % base;
        denominator *= base;
        number /= base;
    }
    const uint64_t up = ((numerator << 24) + denominator - 1) / denominator;
    return up < 0xffffff ? (uint32_t)up : 0xffffff;
}

static void test_plain_is_exact(void **state)
{
    (void)state;
    const ca_sampler sampler = sampler_of(CA_SAMPLER_HALTON_PLAIN, 5, 640, 480);
    ca_test_random random = ca_test_random_seed(1);
    for (uint32_t row = 0; row < CA_PRIME_COUNT; row++)
        for (uint32_t i = 0; i < 3000; i++) {
            uint64_t number = i; /* small ones, all lengths, and the largest */
            if (i >= 1000) number = random_u64(&random) >> (i % 64);
            if (i >= 2900) number = UINT64_MAX - (i - 2900);
            const float u = light_number(&sampler, number, halton_dimension(row));
            if (u != (float)exact_inverse(halton_primes[row], number) * 0x1p-24f)
                fail_msg("base %u, number %llu: %.9g", halton_primes[row], (unsigned long long)number, (double)u);
        }
}

/* ---- Pixels ---------------------------------------------------------------------------------------------------- */

/* The pixel that a number's first digits name. */
static uint64_t pixel_of_number(uint64_t number, uint32_t width, uint32_t height)
{
    uint64_t x = 0, y = 0, rest = number;
    for (uint32_t side = 1; side < width; side *= 2, rest /= 2) x = x * 2 + rest % 2;
    rest = number;
    for (uint32_t side = 1; side < height; side *= 3, rest /= 3) y = y * 3 + rest % 3;
    return x < width && y < height ? y * width + x : UINT64_MAX;
}

static uint64_t stride_of(uint32_t width, uint32_t height)
{
    uint64_t columns = 1, rows = 1;
    while (columns < width) columns *= 2;
    while (rows < height) rows *= 3;
    return columns * rows;
}

static void check_pixel(const ca_sampler *sampler, uint64_t pixel, uint64_t index)
{
    const uint32_t width = sampler->width, height = sampler->height;
    const uint64_t stride = stride_of(width, height);
    const ca_stream first = ca_stream_start(sampler, pixel, 0), stream = ca_stream_start(sampler, pixel, index);
    if (first.index >= stride || stream.index != first.index + index * stride ||
        pixel_of_number(stream.index, width, height) != pixel)
        fail_msg("film %u x %u, pixel %llu, path %llu: number %llu", width, height, (unsigned long long)pixel,
                 (unsigned long long)index, (unsigned long long)stream.index);
    if (sampler->kind != CA_SAMPLER_HALTON_PLAIN) return;
    /* The rest of the digits is the place; all other dimensions are those of the light path of this number. */
    uint64_t behind[2] = {stream.index, stream.index};
    for (uint32_t side = 1; side < width; side *= 2) behind[0] /= 2;
    for (uint32_t side = 1; side < height; side *= 3) behind[1] /= 3;
    assert_true(ca_sample_1d(&stream, 0) == (float)exact_inverse(2, behind[0]) * 0x1p-24f);
    assert_true(ca_sample_1d(&stream, 1) == (float)exact_inverse(3, behind[1]) * 0x1p-24f);
    for (uint32_t dimension = 2; dimension < 300; dimension += 7)
        assert_true(ca_sample_1d(&stream, dimension) == light_number(sampler, stream.index, dimension));
}

static void test_paths_fall_into_their_pixels(void **state)
{
    (void)state;
    static const uint32_t films[][2] = {{1, 1},       {1, 7},         {7, 1},        {5, 3},
                                        {64, 81},     {65, 82},       {16, 243},     {1920, 1080},
                                        {3840, 2160}, {65536, 65536}, {65537, 59050}};
    ca_test_random random = ca_test_random_seed(2);
    for (uint32_t f = 0; f < sizeof films / sizeof films[0]; f++)
        for (int plain = 0; plain < 2; plain++) {
            const ca_sampler sampler =
                sampler_of(plain ? CA_SAMPLER_HALTON_PLAIN : CA_SAMPLER_HALTON, 9, films[f][0], films[f][1]);
            const uint64_t pixels = (uint64_t)films[f][0] * films[f][1];
            for (uint32_t i = 0; i < 4000; i++) {
                const uint64_t pixel = pixels <= 4000 ? i % pixels : random_u64(&random) % pixels;
                /* Not more paths than have numbers below 2^64 on the largest film. */
                check_pixel(&sampler, pixel, i < 100 ? i : ca_test_random_u32(&random) >> (3 + i % 28));
            }
            check_pixel(&sampler, pixels - 1, 1);
        }
}

/* Every number whose pixel is on the film is met exactly once. */
static void test_enumeration_is_complete(void **state)
{
    (void)state;
    static const uint32_t films[][2] = {{1, 1}, {5, 3}, {8, 9}, {64, 81}, {33, 28}};
    enum { ROUNDS = 3 };
    for (uint32_t f = 0; f < sizeof films / sizeof films[0]; f++) {
        const ca_sampler sampler = sampler_of(CA_SAMPLER_HALTON, 0, films[f][0], films[f][1]);
        const uint64_t stride = stride_of(films[f][0], films[f][1]);
        uint8_t *met = calloc(ROUNDS * stride, 1);
        for (uint64_t pixel = 0; pixel < (uint64_t)films[f][0] * films[f][1]; pixel++)
            for (uint64_t index = 0; index < ROUNDS; index++) {
                const ca_stream stream = ca_stream_start(&sampler, pixel, index);
                assert_true(stream.index < ROUNDS * stride);
                met[stream.index]++;
            }
        for (uint64_t number = 0; number < ROUNDS * stride; number++)
            assert_int_equal(met[number], pixel_of_number(number, films[f][0], films[f][1]) != UINT64_MAX);
        free(met);
    }
}

/* ---- Elementary intervals -------------------------------------------------------------------------------------- */

static int compare_floats(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* One number in each of `count` equal intervals? Rounding up may carry one over its interval's end. */
static bool one_in_each(float *u, uint32_t count)
{
    qsort(u, count, sizeof *u, compare_floats);
    for (uint32_t i = 0; i < count; i++)
        if ((double)u[i] < (double)i / count || (double)u[i] >= (i + 1.0) / count + 0x1p-24) return false;
    return true;
}

static void test_intervals_stay_balanced(void **state)
{
    (void)state;
    enum { MOST = 30000 };
    float *u = malloc(MOST * sizeof *u);
    ca_test_random random = ca_test_random_seed(3);
    for (uint64_t seed = 0; seed < 6; seed++) {
        const ca_sampler sampler = sampler_of(CA_SAMPLER_HALTON, seed, 1, 1);
        for (uint32_t row = 0; row < CA_PRIME_COUNT; row += row < 40 ? 1 : 9)
            for (uint64_t count = halton_primes[row]; count <= (seed == 0 ? MOST : 3000);
                 count *= halton_primes[row]) {
                /* Any consecutive numbers, the last of 64 bits among them, show all digits once. */
                const uint64_t last = UINT64_MAX - count;
                const uint64_t start = seed == 0 ? 0 : seed == 1 ? last : (random_u64(&random) >> 8 * seed) % last;
                for (uint32_t i = 0; i < count; i++)
                    u[i] = light_number(&sampler, start + i, halton_dimension(row));
                if (!one_in_each(u, (uint32_t)count))
                    fail_msg("seed %u, base %u: %u numbers from %llu", (unsigned)seed, halton_primes[row],
                             (unsigned)count, (unsigned long long)start);
            }
    }
    free(u);
}

/* 2^4 3^3 consecutive paths have one in each box of 1/2^4 by 1/3^3; pixels too, within themselves. */
static void test_boxes_stay_balanced(void **state)
{
    (void)state;
    enum { COLUMNS = 16, ROWS = 27, COUNT = COLUMNS * ROWS };
    static const number_function numbers[] = {light_number, pixel_17};
    static const ca_sampler_kind kinds[] = {CA_SAMPLER_HALTON, CA_SAMPLER_HALTON_PLAIN};
    for (uint32_t k = 0; k < 4; k++)
        for (uint64_t start = 0; start < 3 * COUNT; start += 131) {
            const ca_sampler sampler = sampler_of(kinds[k / 2], 4, 36, 10);
            float y[COLUMNS][ROWS];
            uint32_t filled[COLUMNS] = {0};
            for (uint64_t i = 0; i < COUNT; i++) {
                const uint32_t column = (uint32_t)(numbers[k % 2](&sampler, start + i, 0) * (float)COLUMNS);
                assert_true(filled[column] < ROWS);
                y[column][filled[column]++] = numbers[k % 2](&sampler, start + i, 1);
            }
            for (uint32_t column = 0; column < COLUMNS; column++) assert_true(one_in_each(y[column], ROWS));
        }
}

/* Past the table, and for dimensions without a use: 2^m paths of a light or pixel stream fill 2^m intervals. */
static void test_repeated_bases_stay_balanced(void **state)
{
    (void)state;
    static const uint32_t dimensions[] = {5, 6, 7, 15, 23, 294, 295, 296, 400, 401, 4000000000u};
    static const number_function numbers[] = {light_number, pixel_17};
    const ca_sampler sampler = sampler_of(CA_SAMPLER_HALTON, 4, 36, 10);
    for (uint32_t d = 0; d < sizeof dimensions / sizeof dimensions[0]; d++)
        for (uint32_t k = 0; k < 2; k++)
            for (uint32_t m = 0; m <= 10; m += 2)
                for (uint64_t block = 0; block < 3; block++) {
                    float u[1 << 10];
                    for (uint32_t i = 0; i < 1u << m; i++)
                        u[i] = numbers[k](&sampler, (block << m) + i, dimensions[d]);
                    assert_true(one_in_each(u, 1u << m));
                }
}

/* ---- Range ----------------------------------------------------------------------------------------------------- */

static void test_range(void **state)
{
    (void)state;
    ca_test_random random = ca_test_random_seed(8);
    for (int plain = 0; plain < 2; plain++) {
        const ca_sampler sampler = sampler_of(plain ? CA_SAMPLER_HALTON_PLAIN : CA_SAMPLER_HALTON, 1, 1920, 1080);
        for (uint32_t i = 0; i < 100000; i++) {
            /* All digits at their largest are the number next to 1: -1 modulo powers of the base. */
            const uint64_t index = i % 4 == 0 ? UINT64_MAX - i / 4 : random_u64(&random) >> (i % 64);
            const uint64_t sequence = i % 2 ? CA_SEQUENCE_LIGHT : index % (1920 * 1080);
            const ca_stream stream = ca_stream_start(&sampler, sequence, index);
            const uint32_t dimension = i % 320 & ~1u;
            const ca_vec2 pair = ca_sample_2d(&stream, dimension);
            assert_true(pair.x == ca_sample_1d(&stream, dimension) && pair.y == ca_sample_1d(&stream, dimension + 1));
            assert_true(pair.x >= 0.0f && pair.x < 1.0f && pair.x * 0x1p24f == floorf(pair.x * 0x1p24f));
            assert_true(pair.y >= 0.0f && pair.y < 1.0f && pair.y * 0x1p24f == floorf(pair.y * 0x1p24f));
        }
        for (uint32_t row = 1; row < CA_PRIME_COUNT; row++) {
            uint64_t power = 1;
            while (power < 1u << 24) power *= halton_primes[row];
            const float u = light_number(&sampler, power - 1, halton_dimension(row));
            assert_true(u < 1.0f && (!plain || u == 0xffffff * 0x1p-24f));
        }
    }
}

/* ---- Star discrepancy ------------------------------------------------------------------------------------------ */

/* The largest difference between the share of points in a box at the origin and its area, over all boxes: those with
 * corners at points' coordinates, once with what lies on their edges and once without. */
static double star_discrepancy(const float (*points)[2], uint32_t count)
{
    double worst = 0.0;
    for (uint32_t i = 0; i <= count; i++)
        for (uint32_t j = 0; j <= count; j++) {
            const double x = i < count ? (double)points[i][0] : 1.0, y = j < count ? (double)points[j][1] : 1.0;
            uint32_t open = 0, closed = 0;
            for (uint32_t k = 0; k < count; k++) {
                open += (double)points[k][0] < x && (double)points[k][1] < y;
                closed += (double)points[k][0] <= x && (double)points[k][1] <= y;
            }
            worst = fmax(worst, fmax(x * y - (double)open / count, (double)closed / count - x * y));
        }
    return worst;
}

static double discrepancy_of(ca_sampler_kind kind, uint32_t dimension, uint32_t count)
{
    float points[256][2];
    const ca_sampler sampler = sampler_of(kind, 3, 1, 1);
    for (uint32_t i = 0; i < count; i++) {
        points[i][0] = light_number(&sampler, i, dimension);
        points[i][1] = light_number(&sampler, i, dimension + 1);
    }
    return star_discrepancy((const float(*)[2])points, count);
}

static void test_star_discrepancy(void **state)
{
    (void)state;
    /* (0, 0) alone: a box as small as one likes holds all. With (1/2, 1/3) the full box [0, 1/2] x [0, 1/3] has area
     * 1/6. */
    assert_true(fabs(discrepancy_of(CA_SAMPLER_HALTON_PLAIN, 0, 1) - 1.0) < 1e-6);
    assert_true(fabs(discrepancy_of(CA_SAMPLER_HALTON_PLAIN, 0, 2) - 5.0 / 6.0) < 1e-6);
    for (uint32_t n = 32; n <= 256; n *= 2) {
        const double plain = discrepancy_of(CA_SAMPLER_HALTON_PLAIN, 0, n);
        const double scrambled = discrepancy_of(CA_SAMPLER_HALTON, 0, n);
        const double random = discrepancy_of(CA_SAMPLER_INDEPENDENT, 0, n);
        /* Halton's bound: product over the bases of ((b - 1) / (2 log b) log n + (b + 1) / 2), and the dimensions. */
        const double bound = (2.0 + (log(n) / (2.0 * log(2.0)) + 1.5) * (log(n) / log(3.0) + 2.0)) / n;
        printf("           star discrepancy of %u points: plain %.4f, scrambled %.4f, independent %.4f\n", n, plain,
               scrambled, random);
        assert_true(plain < bound && scrambled < bound);
        assert_true(plain < 0.7 * random && scrambled < 0.7 * random);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_primes),
        cmocka_unit_test(test_plain_is_exact),
        cmocka_unit_test(test_paths_fall_into_their_pixels),
        cmocka_unit_test(test_enumeration_is_complete),
        cmocka_unit_test(test_intervals_stay_balanced),
        cmocka_unit_test(test_boxes_stay_balanced),
        cmocka_unit_test(test_repeated_bases_stay_balanced),
        cmocka_unit_test(test_range),
        cmocka_unit_test(test_star_discrepancy),
    };
    return cmocka_run_group_tests_name("halton", tests, NULL, NULL);
}
