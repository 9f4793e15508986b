/* Sobol' samplers: the table against published points and the plain recurrence, nets by counting points in boxes,
 * discrepancy, the paths of each pixel, what is past the table's ends, and rates of convergence. */
#include "sampling/sobol_table.h"
#include "support/chi_square.h"
#include "support/nets.h"
#include "support/sampler_numbers.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* ---- Boxes ----------------------------------------------------------------------------------------------------- */

/* Where points are taken from. */
typedef struct point_source {
    const ca_sampler *sampler;
    uint64_t sequence, first;
    uint32_t dimension_x, dimension_y;
} point_source;

static void draw(const point_source *source, uint32_t count, float *x, float *y)
{
    for (uint32_t i = 0; i < count; i++) {
        const ca_stream stream = ca_stream_start(source->sampler, source->sequence, source->first + i);
        x[i] = ca_sample_1d(&stream, source->dimension_x);
        y[i] = ca_sample_1d(&stream, source->dimension_y);
    }
}

static uint32_t source_t(const point_source *source, uint32_t m)
{
    static float x[1 << 12], y[1 << 12];
    draw(source, 1u << m, x, y);
    return ca_net_quality(x, y, m);
}

/* ---- sobol-plain: the table ------------------------------------------------------------------------------------ */

/* The first points after the origin in eight dimensions of new-joe-kuo-6, in the usual Gray code order, as printed by
 * the tests of public implementations that use these numbers. */
static void test_published_points(void **state)
{
    (void)state;
    static const float published[7][8] = {
        {0.5f, 0.5f, 0.5f, 0.5f, 0.5f, 0.5f, 0.5f, 0.5f},
        {0.75f, 0.25f, 0.25f, 0.25f, 0.75f, 0.75f, 0.25f, 0.75f},
        {0.25f, 0.75f, 0.75f, 0.75f, 0.25f, 0.25f, 0.75f, 0.25f},
        {0.375f, 0.375f, 0.625f, 0.875f, 0.375f, 0.125f, 0.375f, 0.875f},
        {0.875f, 0.875f, 0.125f, 0.375f, 0.875f, 0.625f, 0.875f, 0.375f},
        {0.625f, 0.125f, 0.875f, 0.625f, 0.625f, 0.875f, 0.125f, 0.125f},
        {0.125f, 0.625f, 0.375f, 0.125f, 0.125f, 0.375f, 0.625f, 0.625f},
    };
    const ca_sampler sampler = sampler_of(CA_SAMPLER_SOBOL_PLAIN, 0, 640, 480);
    for (uint32_t dimension = 0; dimension < 8; dimension++) {
        assert_true(number_of(&sampler, CA_SEQUENCE_LIGHT, 0, dimension) == 0.0f);
        for (uint32_t i = 1; i < 8; i++)
            assert_true(number_of(&sampler, CA_SEQUENCE_LIGHT, i ^ i >> 1, dimension) == published[i - 1][dimension]);
    }
}

/* Some rows again, and the textbook's recurrence on integers m_j < 2^j. */
typedef struct published_row {
    uint32_t d, degree, a, m[11];
} published_row;

static const published_row rows[] = {
    {2, 1, 0, {1}},
    {3, 2, 1, {1, 3}},
    {4, 3, 1, {1, 3, 1}},
    {5, 3, 2, {1, 1, 1}},
    {13, 5, 14, {1, 3, 5, 5, 31}},
    {19, 6, 25, {1, 1, 5, 5, 19, 61}},
    {37, 7, 62, {1, 3, 3, 5, 3, 55, 33}},
    {38, 8, 14, {1, 3, 1, 15, 31, 13, 49, 245}},
    {101, 9, 253, {1, 3, 3, 7, 29, 37, 33, 123, 147}},
    {161, 10, 508, {1, 1, 1, 7, 7, 3, 15, 99, 409, 719}},
    {256, 11, 560, {1, 1, 1, 5, 19, 3, 53, 133, 97, 863, 983}},
};

static uint64_t next_m(const published_row *row, const uint64_t *m, uint32_t j)
{
    uint64_t sum = m[j - row->degree] ^ m[j - row->degree] << row->degree;
    for (uint32_t k = 1; k < row->degree; k++)
        if (row->a >> (row->degree - 1 - k) & 1) sum ^= m[j - k] << k;
    return sum;
}

static void test_recurrence(void **state)
{
    (void)state;
    const ca_sampler sampler = sampler_of(CA_SAMPLER_SOBOL_PLAIN, 0, 640, 480);
    for (uint32_t r = 0; r < sizeof rows / sizeof rows[0]; r++) {
        uint64_t m[CA_SOBOL_INDEX_BITS]; /* m[j] is m_(j+1) */
        for (uint32_t j = 0; j < CA_SOBOL_INDEX_BITS; j++) {
            m[j] = j < rows[r].degree ? rows[r].m[j] : next_m(&rows[r], m, j);
            const double exact = floor(ldexp((double)m[j], 23 - (int)j));
            const double u = (double)number_of(&sampler, CA_SEQUENCE_LIGHT, UINT64_C(1) << j, rows[r].d - 1);
            if (ldexp(u, 24) != exact) fail_msg("d = %u, bit %u: %.0f, not %.0f", rows[r].d, j, ldexp(u, 24), exact);
        }
    }
}

/* Every dimension alone is a (0, 1)-sequence, also past the table, and after 2^33 paths. */
static void test_plain_one_dimension(void **state)
{
    (void)state;
    enum { M = 10 };
    const ca_sampler sampler = sampler_of(CA_SAMPLER_SOBOL_PLAIN, 0, 640, 480);
    for (uint32_t dimension = 0; dimension < 3 * CA_SOBOL_DIMENSION_COUNT; dimension++)
        for (int far = 0; far < 2; far++) {
            uint8_t hit[1 << M] = {0};
            const uint64_t first = far ? (UINT64_C(1) << 33) + (7u << M) : 0;
            for (uint32_t i = 0; i < 1u << M; i++) {
                const float u = number_of(&sampler, CA_SEQUENCE_LIGHT, first + i, dimension);
                const uint32_t bin = (uint32_t)(u * (float)(1 << M));
                if (hit[bin]++) fail_msg("dimension %u from %llu: bin %u", dimension, (unsigned long long)first, bin);
            }
        }
}

static uint32_t degree_less_one(uint32_t dimension)
{
    const uint32_t local = dimension % CA_SOBOL_DIMENSION_COUNT;
    return local == 0 ? 0 : 10 - ca_sobol_rows[local].zeros;
}

/* t of a pair is at most the sum of both polynomials' degrees less one each (the first dimension counts 0). */
static void test_plain_nets(void **state)
{
    (void)state;
    const ca_sampler sampler = sampler_of(CA_SAMPLER_SOBOL_PLAIN, 0, 640, 480);
    point_source source = {.sampler = &sampler, .sequence = CA_SEQUENCE_LIGHT, .dimension_y = 1};
    for (uint32_t m = 0; m <= 12; m++)
        for (uint32_t block = 0; block < 3; block++) {
            source.first = (uint64_t)block * 5 << (block == 2 ? 36 : m);
            assert_int_equal(source_t(&source, m), 0);
        }
    static const uint32_t firsts[] = {0, 1, 2, 3, 4, 8, 14, 30, 40, 256, 264, 520};
    for (uint32_t f = 0; f < sizeof firsts / sizeof firsts[0]; f++)
        for (uint32_t step = 1; step < 6; step++)
            for (uint32_t far = 0; far < 2; far++) {
                const uint32_t x = firsts[f], y = x + step;
                source = (point_source){&sampler, CA_SEQUENCE_LIGHT, far ? UINT64_C(3) << 41 : 0, x, y};
                const uint32_t t = source_t(&source, 10), bound = degree_less_one(x) + degree_less_one(y);
                if (t > bound) fail_msg("dimensions %u and %u: t = %u above %u", x, y, t, bound);
            }
}

/* ---- sobol-plain: the paths of a pixel ------------------------------------------------------------------------- */

/* A coordinate of the first two dimensions in 64 bits, bit by bit. */
static uint64_t exact_coordinate(uint64_t number_of_path, uint32_t dimension)
{
    uint64_t u = 0, direction = UINT64_C(1) << 63;
    for (uint32_t bit = 0; bit < 64; bit++) {
        if (number_of_path >> bit & 1) u ^= direction;
        direction = dimension == 0 ? direction >> 1 : direction ^ direction >> 1;
    }
    return u;
}

/* The path lies in its pixel, in the index-th run, and its film numbers are what remains there. */
static void check_pixel_path(const ca_sampler *sampler, uint32_t x, uint32_t y, uint64_t index)
{
    const uint32_t bits = sampler->pixels.sobol.bits;
    const ca_stream stream = ca_stream_start(sampler, (uint64_t)y * sampler->width + x, index);
    const uint32_t pixel[2] = {x, y};
    if (stream.index >> (2 * bits) != index)
        fail_msg("(%u, %u) of %ux%u, path %llu: number %llu", x, y, sampler->width, sampler->height,
                 (unsigned long long)index, (unsigned long long)stream.index);
    for (uint32_t d = 0; d < 2; d++) {
        const uint64_t u = exact_coordinate(stream.index, d);
        if ((bits == 0 ? 0 : u >> (64 - bits)) != pixel[d])
            fail_msg("(%u, %u) of %ux%u: coordinate %u of its path %llu is elsewhere", x, y, sampler->width,
                     sampler->height, d, (unsigned long long)index);
        const float rest = (float)((u << bits) >> 40) * 0x1p-24f;
        assert_true(ca_sample_1d(&stream, d) == rest);
    }
    /* All other numbers are those of the whole image's sequence. */
    const ca_stream whole = ca_stream_start(sampler, CA_SEQUENCE_LIGHT, stream.index);
    for (uint32_t d = 2; d < 12; d += 3) assert_true(ca_sample_1d(&stream, d) == ca_sample_1d(&whole, d));
    assert_true(ca_sample_1d(&stream, 300) == ca_sample_1d(&whole, 300));
}

static void test_pixels(void **state)
{
    (void)state;
    static const uint32_t sizes[][2] = {{1, 1},       {2, 1},    {1, 2},   {3, 5},      {16, 16},  {17, 16},
                                        {1920, 1080}, {5000, 3}, {1, 333}, {100000, 1}, {641, 479}};
    static const uint64_t far[] = {0, 1, 2, 1000, (1u << 20) + 12345, (UINT64_C(1) << 29) + 1};
    for (uint32_t s = 0; s < sizeof sizes / sizeof sizes[0]; s++) {
        const uint32_t width = sizes[s][0], height = sizes[s][1];
        const ca_sampler sampler = sampler_of(CA_SAMPLER_SOBOL_PLAIN, 3, width, height);
        const uint32_t step = (uint64_t)width * height > 10000 ? 97 : 1;
        for (uint64_t pixel = 0; pixel < (uint64_t)width * height; pixel += step)
            for (uint32_t k = 0; k < sizeof far / sizeof far[0]; k++)
                check_pixel_path(&sampler, (uint32_t)(pixel % width), (uint32_t)(pixel / width), far[k]);
    }
}

/* Each number of the first runs whose point is in the film belongs to one path of one pixel. */
static void test_pixels_cover_the_sequence(void **state)
{
    (void)state;
    enum { RUNS = 5 };
    static const uint32_t sizes[][2] = {{1, 1}, {3, 5}, {9, 30}, {64, 64}, {100, 37}};
    for (uint32_t s = 0; s < sizeof sizes / sizeof sizes[0]; s++) {
        const uint32_t width = sizes[s][0], height = sizes[s][1];
        const ca_sampler sampler = sampler_of(CA_SAMPLER_SOBOL_PLAIN, 0, width, height);
        const uint32_t bits = sampler.pixels.sobol.bits, count = (uint32_t)RUNS << (2 * bits);
        uint8_t *owners = calloc(count, 1);
        for (uint32_t pixel = 0; pixel < width * height; pixel++)
            for (uint64_t k = 0; k < RUNS; k++) owners[ca_stream_start(&sampler, pixel, k).index]++;
        for (uint32_t n = 0; n < count; n++) {
            const uint32_t x = (uint32_t)(number_of(&sampler, CA_SEQUENCE_LIGHT, n, 0) * (float)(1u << bits));
            const uint32_t y = (uint32_t)(number_of(&sampler, CA_SEQUENCE_LIGHT, n, 1) * (float)(1u << bits));
            assert_int_equal(owners[n], x < width && y < height ? 1 : 0);
        }
        free(owners);
    }
}

/* Numbers past 2^53, or past 2^64, are other points, and still nets. */
static void test_plain_beyond_the_end(void **state)
{
    (void)state;
    const ca_sampler sampler = sampler_of(CA_SAMPLER_SOBOL_PLAIN, 0, 1920, 1080);
    uint32_t same = 0;
    for (uint32_t d = 2; d < 300; d++)
        same += number_of(&sampler, CA_SEQUENCE_LIGHT, 77, d) ==
                number_of(&sampler, CA_SEQUENCE_LIGHT, (UINT64_C(3) << 60) + 77, d);
    for (uint32_t d = 0; d < 300; d++)
        same += number_of(&sampler, 123456, 77, d) == number_of(&sampler, 123456, (UINT64_C(5) << 50) + 77, d);
    assert_true(same < 3);
    for (uint32_t d = 0; d < 20; d += 2) {
        const point_source source = {&sampler, 123456, UINT64_C(5) << 50, d, d + 1};
        const point_source start = {&sampler, 123456, 0, d, d + 1};
        assert_int_equal(source_t(&source, 8), source_t(&start, 8));
    }
}

/* ---- sobol-image and sobol-tiles ------------------------------------------------------------------------------- */

/* Light paths are scrambled, dimension by dimension: nets as good as the plain sequence's. */
static void test_image_nets(void **state)
{
    (void)state;
    static const ca_sampler_kind kinds[] = {CA_SAMPLER_SOBOL_IMAGE, CA_SAMPLER_SOBOL_TILES};
    const ca_sampler plain = sampler_of(CA_SAMPLER_SOBOL_PLAIN, 0, 640, 480);
    for (int k = 0; k < 2; k++) {
        const ca_sampler sampler = sampler_of(kinds[k], 5, 640, 480);
        for (uint32_t d = 0; d < 300; d += d < 24 ? 2 : 46) {
            const point_source scrambled = {&sampler, CA_SEQUENCE_LIGHT, 3 << 10, d, d + 1};
            const point_source expected = {&plain, CA_SEQUENCE_LIGHT, 3 << 10, d, d + 1};
            assert_int_equal(source_t(&scrambled, 10), source_t(&expected, 10));
        }
    }
}

/* The pixels' paths of a run are the plain ones' numbers, so that all dimensions but the film's are one net over the
 * image or tile; a pixel's own film points are a net, too. */
static void check_runs(ca_sampler_kind kind, ca_sampler_kind plain_kind, uint32_t width, uint32_t height)
{
    const ca_sampler sampler = sampler_of(kind, 9, width, height), plain = sampler_of(plain_kind, 1, width, height);
    const uint32_t side = 1u << sampler.pixels.sobol.bits;
    static float x[1 << 12], y[1 << 12];
    for (uint32_t p = 0; p < width * height; p += 13)
        for (uint64_t i = 0; i < 3; i++)
            assert_true(ca_stream_start(&sampler, p, i).index == ca_stream_start(&plain, p, i).index);
    uint32_t count = 0;
    for (uint32_t p = 0; p < width * height && count < 1u << 12; p++) { /* of the first square */
        if (p % width >= side || p / width >= side) continue;
        const ca_stream stream = ca_stream_start(&sampler, p, 1);
        x[count] = ca_sample_1d(&stream, 2), y[count] = ca_sample_1d(&stream, 3);
        count++;
    }
    assert_int_equal(count, side * side);
    const point_source expected = {&plain, CA_SEQUENCE_LIGHT, side * side, 2, 3};
    assert_int_equal(ca_net_quality(x, y, 2 * sampler.pixels.sobol.bits),
                     source_t(&expected, 2 * sampler.pixels.sobol.bits));
    const point_source film = {&sampler, 7 * width + 5, 0, 0, 1};
    assert_int_equal(source_t(&film, 10), 0);
}

static void test_image_runs(void **state)
{
    (void)state;
    check_runs(CA_SAMPLER_SOBOL_IMAGE, CA_SAMPLER_SOBOL_PLAIN, 64, 64);
    check_runs(CA_SAMPLER_SOBOL_TILES, CA_SAMPLER_SOBOL_TILES_PLAIN, 100, 37);
    const ca_sampler tiles = sampler_of(CA_SAMPLER_SOBOL_TILES_PLAIN, 1, 100, 37);
    assert_int_equal(tiles.pixels.sobol.bits, 4);
    assert_int_equal(sampler_of(CA_SAMPLER_SOBOL_TILES, 1, 5, 3).pixels.sobol.bits, 3);
}

/* Tiles, seeds, and the two sides have scramblings of their own; plain ones none. */
static void test_image_scramblings(void **state)
{
    (void)state;
    enum { WIDTH = 64, IN_TILE = 5 * WIDTH + 3, NEXT_TILE = IN_TILE + 16 };
    uint32_t same[5] = {0};
    const ca_sampler tiles = sampler_of(CA_SAMPLER_SOBOL_TILES, 1, WIDTH, 64),
                     seeded = sampler_of(CA_SAMPLER_SOBOL_TILES, 2, WIDTH, 64),
                     plain = sampler_of(CA_SAMPLER_SOBOL_TILES_PLAIN, 1, WIDTH, 64),
                     image = sampler_of(CA_SAMPLER_SOBOL_IMAGE, 1, WIDTH, 64);
    for (uint32_t d = 0; d < 40; d++) {
        const float here = number_of(&tiles, IN_TILE, 3, d);
        const uint64_t path = ca_stream_start(&image, IN_TILE, 3).index;
        same[0] += here == number_of(&tiles, NEXT_TILE, 3, d);
        same[1] += here == number_of(&seeded, IN_TILE, 3, d);
        same[2] += number_of(&image, IN_TILE, 3, d) == number_of(&image, CA_SEQUENCE_LIGHT, path, d);
        same[3] += number_of(&plain, IN_TILE, 3, d) == number_of(&plain, NEXT_TILE, 3, d);
        same[4] += d < 2 && number_of(&image, 0, 0, d) == number_of(&image, 1, 0, d);
    }
    for (int i = 0; i < 3; i++) assert_true(same[i] < 3);
    assert_int_equal(same[3], 40);
    assert_int_equal(same[4], 0);
}

/* Each pixel scrambles its own places: the first digit behind the pixel's is flipped in half of them. */
static void test_image_places(void **state)
{
    (void)state;
    enum { SIDE_PIXELS = 64, PIXELS = SIDE_PIXELS * SIDE_PIXELS };
    const ca_sampler image = sampler_of(CA_SAMPLER_SOBOL_IMAGE, 7, SIDE_PIXELS, SIDE_PIXELS),
                     plain = sampler_of(CA_SAMPLER_SOBOL_PLAIN, 7, SIDE_PIXELS, SIDE_PIXELS);
    for (uint32_t d = 0; d < 2; d++) {
        uint32_t flipped = 0;
        for (uint32_t p = 0; p < PIXELS; p++)
            flipped += (number_of(&image, p, 5, d) < 0.5f) != (number_of(&plain, p, 5, d) < 0.5f);
        assert_in_range(flipped, PIXELS / 2 - 160, PIXELS / 2 + 160); /* five standard deviations */
    }
}

/* ---- Chi-square ------------------------------------------------------------------------------------------------ */

enum { SIDE = 16, BOX_COUNT = SIDE * SIDE };

/* p-value of pairs counted in boxes; *ratio is the statistic over its degrees of freedom. `stride` parts the
 * paths. */
static double pair_p_value(const ca_sampler *sampler, uint64_t stride, uint32_t x, uint32_t y, double *ratio)
{
    enum { COUNT = 40000 };
    double observed[BOX_COUNT] = {0}, expected[BOX_COUNT], statistic;
    for (uint64_t n = 0; n < COUNT; n++) {
        const uint32_t column = (uint32_t)(number_of(sampler, CA_SEQUENCE_LIGHT, n * stride, x) * SIDE);
        const uint32_t row = (uint32_t)(number_of(sampler, CA_SEQUENCE_LIGHT, n * stride, y) * SIDE);
        observed[column * SIDE + row] += 1.0;
    }
    for (uint32_t i = 0; i < BOX_COUNT; i++) expected[i] = (double)COUNT / BOX_COUNT;
    const double p = ca_chi_square_counts(observed, expected, BOX_COUNT, &statistic, NULL);
    *ratio = statistic / (BOX_COUNT - 1);
    return p;
}

/* A dimension past the table against the same one, or a near one, in the table or another repeat. Each run of 2^32
 * paths has an order of its own: over the runs, pairs are as random numbers. Within a run they are structured, and
 * fill the boxes more evenly than chance, or less: on average not worse. */
static void test_uniform_past_the_table(void **state)
{
    (void)state;
    static const uint32_t steps[] = {255, 256, 257, 512, 2560};
    const ca_sampler sampler = sampler_of(CA_SAMPLER_SOBOL_PLAIN, 0, 640, 480);
    enum { STEP_COUNT = 5, START_COUNT = 32 };
    const double level = ca_sidak_level(0.01, STEP_COUNT * START_COUNT);
    double mean = 0.0;
    for (uint32_t s = 0; s < START_COUNT; s++)
        for (uint32_t k = 0; k < STEP_COUNT; k++) {
            const uint32_t x = 1 + 8 * s, y = x + steps[k];
            double ratio;
            const double p = pair_p_value(&sampler, UINT64_C(1) << 32, x, y, &ratio);
            if (p < level) fail_msg("dimensions %u and %u over the runs: p = %g", x, y, p);
            (void)pair_p_value(&sampler, 1, x, y, &ratio);
            mean += ratio / (STEP_COUNT * START_COUNT);
        }
    printf("           chi-square over its expectation past the table, in a run: %.2f\n", mean);
    assert_true(mean < 1.25);
}

/* ---- Discrepancy ----------------------------------------------------------------------------------------------- */

/* Star discrepancy of points in the unit square, times their number: boxes with corners on the points' coordinates,
 * open and closed. */
static double star_discrepancy(const float *x, const float *y, uint32_t count)
{
    double worst = 0.0;
    for (uint32_t i = 0; i <= count; i++)
        for (uint32_t j = 0; j <= count; j++) {
            const float right = i < count ? x[i] : 1.0f, top = j < count ? y[j] : 1.0f;
            uint32_t inside = 0, closed = 0;
            for (uint32_t k = 0; k < count; k++) {
                inside += x[k] < right && y[k] < top;
                closed += x[k] <= right && y[k] <= top;
            }
            const double area = (double)right * (double)top * count;
            worst = fmax(worst, fmax(area - inside, closed - area));
        }
    return worst;
}

/* Niederreiter's bound for digital (0, m, 2)-nets in base 2: N D* <= m / 2 + 3 / 2 (quoted by Larcher and
 * Pillichshammer 2003, "Sums of distances to the nearest integer and the discrepancy of digital nets", equation
 * 1). */
static void test_star_discrepancy(void **state)
{
    (void)state;
    static float x[256], y[256];
    const ca_sampler plain = sampler_of(CA_SAMPLER_SOBOL_PLAIN, 0, 640, 480);
    const ca_sampler chance = sampler_of(CA_SAMPLER_INDEPENDENT, 1, 640, 480);
    for (uint32_t m = 0; m <= 8; m++) {
        draw(&(point_source){&plain, CA_SEQUENCE_LIGHT, 0, 0, 1}, 1u << m, x, y);
        assert_true(star_discrepancy(x, y, 1u << m) <= m / 2.0 + 1.5);
    }
    draw(&(point_source){&plain, CA_SEQUENCE_LIGHT, 0, 0, 1}, 256, x, y);
    const double film = star_discrepancy(x, y, 256);
    draw(&(point_source){&chance, 0, 0, 0, 1}, 256, x, y);
    const double independent = star_discrepancy(x, y, 256);
    double worst = 0.0;
    for (uint32_t d = 2; d < 24; d += 2) {
        draw(&(point_source){&plain, CA_SEQUENCE_LIGHT, 0, d, d + 1}, 256, x, y);
        worst = fmax(worst, star_discrepancy(x, y, 256));
    }
    printf("           256 D*: dimensions 0 and 1 %.3f, worst pair to 23 %.3f, independent %.3f\n", film, worst,
           independent);
    assert_true(independent > 3.0 * film);
    assert_true(worst < independent);
}

/* ---- Scrambled nets -------------------------------------------------------------------------------------------- */

static void test_scrambled_nets(void **state)
{
    (void)state;
    for (uint64_t seed = 0; seed < 3; seed++) {
        const ca_sampler sobol = sampler_of(CA_SAMPLER_SOBOL, seed, 300, 200);
        const ca_sampler zsobol = sampler_of(CA_SAMPLER_ZSOBOL, seed, 300, 200);
        for (uint64_t pixel = 7; pixel < 60000; pixel += 7919)
            for (uint32_t m = 0; m <= 8; m++) {
                const uint64_t first = (pixel & 3) << m | (pixel & 1 ? UINT64_C(9) << 32 : 0);
                assert_int_equal(source_t(&(point_source){&sobol, pixel, first, 16, 17}, m), 0);
                assert_int_equal(source_t(&(point_source){&zsobol, pixel, first, 0, 1}, m), 0);
                assert_int_equal(source_t(&(point_source){&zsobol, pixel, first, 86, 87}, m), 0);
            }
    }
}

/* After 2^32 paths of one sequence others follow, not the same again. */
static void test_no_repeats(void **state)
{
    (void)state;
    static const ca_sampler_kind kinds[] = {CA_SAMPLER_SOBOL, CA_SAMPLER_ZSOBOL, CA_SAMPLER_SOBOL_PLAIN,
                                            CA_SAMPLER_SOBOL_IMAGE};
    for (uint32_t k = 0; k < 4; k++) {
        const ca_sampler sampler = sampler_of(kinds[k], 4, 300, 200);
        for (uint32_t bit = 24; bit < 64; bit++) {
            uint32_t same = 0;
            for (uint32_t d = 4; d < 24; d++)
                same += number_of(&sampler, 999, 5, d) == number_of(&sampler, 999, 5 + (UINT64_C(1) << bit), d);
            if (same > 2) fail_msg("%s: path 5 again after 2^%u", ca_sampler_name(kinds[k]), bit);
        }
    }
}

/* ---- Rates ----------------------------------------------------------------------------------------------------- */

/* Root mean square error over runs of `count` paths each, of a smooth product with mean 1. */
static double smooth_error(const ca_sampler *sampler, uint64_t sequence_step, uint32_t dimension_count,
                           uint32_t count)
{
    enum { RUNS = 60 };
    double squares = 0.0;
    for (uint32_t run = 0; run < RUNS; run++) {
        double sum = 0.0;
        for (uint32_t i = 0; i < count; i++) {
            /* Different sequences, or one at different places, not at multiples of powers of two. */
            const ca_stream stream = sequence_step != 0
                                         ? ca_stream_start(sampler, run * sequence_step, i)
                                         : ca_stream_start(sampler, CA_SEQUENCE_LIGHT, (uint64_t)run * 99991 + i);
            double product = 1.0;
            for (uint32_t d = 0; d < dimension_count; d++) {
                const double u = (double)ca_sample_1d(&stream, d);
                product *= 1.0 + 0.5 * (3.0 * u * u - 1.0);
            }
            sum += product;
        }
        squares += (sum / count - 1.0) * (sum / count - 1.0) / RUNS;
    }
    return sqrt(squares);
}

/* Exponent of the error by least squares over 2^first to 2^last paths. */
static double fitted_exponent(const ca_sampler *sampler, uint64_t sequence_step, uint32_t dimension_count,
                              uint32_t first, uint32_t last)
{
    double n = 0.0, sx = 0.0, sy = 0.0, sxx = 0.0, sxy = 0.0;
    for (uint32_t m = first; m <= last; m++) {
        const double error = log2(smooth_error(sampler, sequence_step, dimension_count, 1u << m));
        n += 1.0, sx += m, sy += error, sxx += (double)m * m, sxy += m * error;
    }
    return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

static void test_rates(void **state)
{
    (void)state;
    const ca_sampler independent = sampler_of(CA_SAMPLER_INDEPENDENT, 2, 200, 200);
    const ca_sampler sobol = sampler_of(CA_SAMPLER_SOBOL, 2, 200, 200);
    const ca_sampler zsobol = sampler_of(CA_SAMPLER_ZSOBOL, 2, 200, 200);
    const ca_sampler plain = sampler_of(CA_SAMPLER_SOBOL_PLAIN, 2, 200, 200);
    const double chance = fitted_exponent(&independent, 41, 2, 4, 11);
    const double apart = fitted_exponent(&sobol, 41, 2, 4, 11), four = fitted_exponent(&sobol, 41, 4, 6, 12);
    const double spread = fitted_exponent(&zsobol, 41, 2, 4, 11);
    const double one = fitted_exponent(&plain, 0, 2, 4, 11);
    printf("           error of a smooth integral ~ n^: independent %.2f, sobol %.2f (4-D %.2f), zsobol %.2f, "
           "sobol-plain %.2f\n",
           chance, apart, four, spread, one);
    assert_true(chance > -0.6 && chance < -0.4);
    assert_true(apart < -1.3);
    assert_true(four < -1.1);
    assert_true(spread < -1.3);
    assert_true(one < -0.85 && one > -1.2);
}

/* A number depends on its address alone: values written down once. */
static void test_known_values(void **state)
{
    (void)state;
    const ca_sampler sobol = sampler_of(CA_SAMPLER_SOBOL, 1, 1000, 1000);
    const ca_sampler plain = sampler_of(CA_SAMPLER_SOBOL_PLAIN, 1, 1000, 1000);
    assert_true(number_of(&sobol, 12345, 67, 13) == 0x1.c3358p-6f);
    assert_true(number_of(&plain, 12345, 67, 13) == 0x1.af9198p-1f);
    assert_true(number_of(&plain, 12345, 67, 613) == 0x1.25b1a8p-3f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_published_points),
        cmocka_unit_test(test_recurrence),
        cmocka_unit_test(test_plain_one_dimension),
        cmocka_unit_test(test_plain_nets),
        cmocka_unit_test(test_pixels),
        cmocka_unit_test(test_pixels_cover_the_sequence),
        cmocka_unit_test(test_plain_beyond_the_end),
        cmocka_unit_test(test_image_nets),
        cmocka_unit_test(test_image_runs),
        cmocka_unit_test(test_image_scramblings),
        cmocka_unit_test(test_image_places),
        cmocka_unit_test(test_uniform_past_the_table),
        cmocka_unit_test(test_star_discrepancy),
        cmocka_unit_test(test_scrambled_nets),
        cmocka_unit_test(test_no_repeats),
        cmocka_unit_test(test_rates),
        cmocka_unit_test(test_known_values),
    };
    return cmocka_run_group_tests_name("sobol", tests, NULL, NULL);
}
