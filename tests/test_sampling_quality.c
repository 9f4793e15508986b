/* What every kind of sampler must do, in the dimensions that renderers use: numbers are uniform, alone and in pairs;
 * all but independent ones are spread more evenly than chance and integrate smooth functions at a better rate; images
 * may have any size, and pixels do not repeat each other. */
#include "sampling/sampler.h"
#include "support/chi_square.h"
#include "support/sampler_numbers.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* Light paths of the kinds over tiles are those of the kinds over the image. */
static bool has_other_light_paths(ca_sampler_kind kind) { return !ca_sampler_has_tiles(kind); }

/* One scrambled Sobol' sequence for many pixels: some pairs of its later dimensions are poorly spread over few
 * points, whose boxes fill together more than by chance, however they are scrambled. */
static bool has_poor_pairs(ca_sampler_kind kind)
{
    return kind == CA_SAMPLER_SOBOL_IMAGE || kind == CA_SAMPLER_SOBOL_TILES;
}

/* ---- Uniformity ------------------------------------------------------------------------------------------------ */

/* Pairs that are used together to five vertices deep, some across groups, and far beyond every table. */
static uint32_t list_pairs(uint32_t pairs[][2])
{
    static const uint32_t others[][2] = {{1, 2},   {2, 4},     {4, 8},       {8, 16},
                                         {11, 12}, {300, 301}, {1030, 1031}, {400002, 400003}};
    uint32_t count = 0;
    for (uint32_t d = 0; d < ca_vertex_dimension(5); d += 2, count++) pairs[count][0] = d, pairs[count][1] = d + 1;
    for (size_t i = 0; i < sizeof others / sizeof others[0]; i++, count++)
        memcpy(pairs[count], others[i], sizeof others[i]);
    return count;
}

enum { SIDES = 16, BINS = SIDES * SIDES, MAX_PAIRS = 64 };

/* Counts of the pair, and of each of its numbers alone, in equal boxes. */
typedef struct box_counts {
    double pair[BINS], first[BINS], second[BINS];
} box_counts;

static void count_path(box_counts *counts, const ca_stream *stream, const uint32_t pair[2])
{
    const float x = ca_sample_1d(stream, pair[0]), y = ca_sample_1d(stream, pair[1]);
    assert_true(x >= 0.0f && x < 1.0f && y >= 0.0f && y < 1.0f);
    assert_true(x * 0x1p24f == floorf(x * 0x1p24f));
    counts->first[(uint32_t)(x * BINS)] += 1.0;
    counts->second[(uint32_t)(y * BINS)] += 1.0;
    counts->pair[(uint32_t)(x * SIDES) * SIDES + (uint32_t)(y * SIDES)] += 1.0;
}

static double farthest(const double *counts, double per_bin)
{
    double farthest = 0.0;
    for (int i = 0; i < BINS; i++) farthest = fmax(farthest, fabs(counts[i] / per_bin - 1.0));
    return farthest;
}

/* One number of chi-square for the pair and for each of its numbers, over its degrees of freedom: about 1 by
 * chance. */
static double worst_statistic(const box_counts *counts, double per_bin, double *smallest_p)
{
    double expected[BINS], worst = 0.0;
    for (int i = 0; i < BINS; i++) expected[i] = per_bin;
    const double *tables[] = {counts->pair, counts->first, counts->second};
    *smallest_p = 1.0;
    for (int t = 0; t < 3; t++) {
        double statistic;
        uint32_t degrees;
        *smallest_p = fmin(*smallest_p, ca_chi_square_counts(tables[t], expected, BINS, &statistic, &degrees));
        worst = fmax(worst, statistic / degrees);
    }
    return worst;
}

/* By the test's level where numbers are independent. Elsewhere points of a pixel, or pixels, depend on each other, so
 * that boxes fill together; still the statistic stays near 1 or far below. Plain kinds are no random variables at
 * all: of a sequence that stops within a power of its base, or repeats a place in many pixels, each box may miss its
 * share by a little. */
static void check_counts(const box_counts *counts, double per_bin, double level, const char *what,
                         ca_sampler_kind kind, const uint32_t pair[2])
{
    double p;
    const double statistic = worst_statistic(counts, per_bin, &p);
    const double off = fmax(farthest(counts->pair, per_bin),
                            fmax(farthest(counts->first, per_bin), farthest(counts->second, per_bin)));
    const bool passes = kind == CA_SAMPLER_INDEPENDENT ? p >= level
                        : ca_sampler_is_plain(kind)    ? off <= (kind == CA_SAMPLER_SOBOL_PLAIN ? 0.2 : 0.5)
                        : has_poor_pairs(kind)         ? off <= 0.3
                                                       : statistic <= 1.8;
    if (!passes)
        fail_msg("%s, %s, dimensions %u and %u: p = %g, statistic %.2f, a box misses its share by %.2f",
                 ca_sampler_name(kind), what, pair[0], pair[1], p, statistic, off);
}

static void test_light_paths_are_uniform(void **state)
{
    (void)state;
    enum { PATHS = 1 << 16 };
    static box_counts counts;
    uint32_t pairs[MAX_PAIRS][2];
    const uint32_t pair_count = list_pairs(pairs);
    const double level = ca_sidak_level(0.01, 3 * pair_count * CA_SAMPLER_KIND_COUNT);
    for (ca_sampler_kind kind = 0; kind < CA_SAMPLER_KIND_COUNT; kind++) {
        const ca_sampler sampler = sampler_of(kind, 17, 64, 48);
        if (!has_other_light_paths(kind)) continue;
        for (uint32_t p = 0; p < pair_count; p++) {
            counts = (box_counts){0};
            for (uint32_t i = 0; i < PATHS; i++) {
                const ca_stream stream = ca_stream_start(&sampler, CA_SEQUENCE_LIGHT, i);
                count_path(&counts, &stream, pairs[p]);
            }
            check_counts(&counts, (double)PATHS / BINS, level, "light paths", kind, pairs[p]);
        }
    }
}

/* A few paths each of all pixels of an image, for many seeds (plain kinds: more paths): where pixels share one
 * sequence or orders, what two pairs do together hangs on few random choices. */
static void test_pixels_are_uniform(void **state)
{
    (void)state;
    enum { WIDTH = 32, HEIGHT = 24, PATHS = 2, SEEDS = 128, ALL = WIDTH * HEIGHT * PATHS * SEEDS };
    static box_counts counts;
    uint32_t pairs[MAX_PAIRS][2];
    const uint32_t pair_count = list_pairs(pairs);
    const double level = ca_sidak_level(0.01, 3 * pair_count * CA_SAMPLER_KIND_COUNT);
    for (ca_sampler_kind kind = 0; kind < CA_SAMPLER_KIND_COUNT; kind++)
        for (uint32_t p = 0; p < pair_count; p++) {
            counts = (box_counts){0};
            for (uint32_t seed = 0; seed < SEEDS; seed++) {
                const ca_sampler sampler = sampler_of(kind, 18 + seed, WIDTH, HEIGHT);
                for (uint32_t i = 0; i < WIDTH * HEIGHT * PATHS; i++) {
                    const uint64_t index = (ca_sampler_is_plain(kind) ? seed * PATHS : 0) + i % PATHS;
                    const ca_stream stream = ca_stream_start(&sampler, i / PATHS, index);
                    count_path(&counts, &stream, pairs[p]);
                }
            }
            check_counts(&counts, (double)ALL / BINS, level, "pixels", kind, pairs[p]);
        }
}

/* ---- Star discrepancy ------------------------------------------------------------------------------------------ */

static int by_x(const void *a, const void *b)
{
    const ca_vec2 *p = a, *q = b;
    return (p->x > q->x) - (p->x < q->x);
}

/* Of the boxes [0, x) x [0, y) and [0, x] x [0, y] the one whose share of points is farthest from its area. The worst
 * have their corners at coordinates of points or at 1: all of these are looked at, while the y of points to the left
 * of x stay sorted. */
static double star_discrepancy(ca_vec2 *points, uint32_t count)
{
    static float ys[2048];
    double worst = 0.0;
    qsort(points, count, sizeof *points, by_x);
    for (uint32_t n = 0; n <= count; n++) { /* n points are left of the open corner's x, which is the next point's */
        const double x = n < count ? (double)points[n].x : 1.0, n_x = n ? (double)points[n - 1].x : 0.0;
        for (uint32_t k = 0; k <= n; k++) {
            const double y = k < n ? (double)ys[k] : 1.0, closed_y = k ? (double)ys[k - 1] : 0.0;
            worst = fmax(worst, x * y - (double)k / count);
            worst = fmax(worst, (double)k / count - n_x * closed_y);
        }
        if (n == count) break;
        uint32_t at = n;
        for (; at > 0 && ys[at - 1] > points[n].y; at--) ys[at] = ys[at - 1];
        ys[at] = points[n].y;
    }
    return worst;
}

/* By counting, for all pairs of coordinates. */
static double slow_discrepancy(const ca_vec2 *points, uint32_t count)
{
    double worst = 0.0;
    for (uint32_t a = 0; a <= count; a++)
        for (uint32_t b = 0; b <= count; b++) {
            const float x = a < count ? points[a].x : 1.0f, y = b < count ? points[b].y : 1.0f;
            uint32_t open = 0, closed = 0;
            for (uint32_t i = 0; i < count; i++) {
                open += points[i].x < x && points[i].y < y;
                closed += points[i].x <= x && points[i].y <= y;
            }
            const double area = (double)x * (double)y;
            worst = fmax(worst, fmax(area - (double)open / count, (double)closed / count - area));
        }
    return worst;
}

static void test_discrepancy_itself(void **state)
{
    (void)state;
    ca_vec2 one = {0.5f, 0.5f};
    assert_true(star_discrepancy(&one, 1) == 0.75);
    for (uint32_t n = 1; n < 40; n++) {
        ca_vec2 points[40];
        for (ca_sampler_kind kind = 0; kind < CA_SAMPLER_KIND_COUNT; kind++) {
            const ca_sampler sampler = sampler_of(kind, n, 1, 1);
            for (uint32_t i = 0; i < n; i++) {
                const ca_stream stream = ca_stream_start(&sampler, CA_SEQUENCE_LIGHT, i);
                points[i] = ca_sample_2d(&stream, 2);
            }
            const double slow = slow_discrepancy(points, n);
            assert_true(fabs(star_discrepancy(points, n) - slow) < 1e-12);
        }
    }
}

typedef struct pair_use {
    const char *name;
    uint64_t sequence;
    uint32_t width, height, dimension;
    double net_bound; /* of n points of kinds sobol and zsobol, times n */
} pair_use;

/* Mean over eight randomisations, or of plain kinds over eight stretches of the sequence. */
static double mean_discrepancy(ca_sampler_kind kind, const pair_use *use, uint32_t count, double *largest)
{
    static ca_vec2 points[1024];
    double sum = 0.0;
    *largest = 0.0;
    for (uint32_t r = 0; r < 8; r++) {
        const ca_sampler sampler = sampler_of(kind, 100 + r, use->width, use->height);
        for (uint32_t i = 0; i < count; i++) {
            const ca_stream stream =
                ca_stream_start(&sampler, use->sequence, (ca_sampler_is_plain(kind) ? r * count : 0) + i);
            points[i] = ca_sample_2d(&stream, use->dimension);
        }
        const double discrepancy = star_discrepancy(points, count);
        *largest = fmax(*largest, discrepancy);
        sum += discrepancy / 8.0;
    }
    return sum;
}

/* A net of 2^m points in base 2 and two dimensions with t = 0 has n D* <= m / 2 + 3 / 2; with t, 2^t ((m - t) / 2 + 3
 * / 2). Random points have about 1.2 / sqrt(n). */
static void test_star_discrepancy(void **state)
{
    (void)state;
    static const pair_use uses[] = {
        {"film", 0, 1, 1, CA_DIM_FILM, 6.5},
        {"film, a pixel of many", 100 * 70 + 20, 100, 80, CA_DIM_FILM, 6.5},
        {"light position", CA_SEQUENCE_LIGHT, 100, 80, CA_DIM_LIGHT_POSITION, 6.5},
        {"light direction", CA_SEQUENCE_LIGHT, 100, 80, CA_DIM_LIGHT_DIRECTION, 12.0},
        {"direction at the second vertex", CA_SEQUENCE_LIGHT, 100, 80, CA_DIM_START_COUNT + CA_DIM_VERTEX_COUNT, 6.5},
    };
    for (size_t u = 0; u < sizeof uses / sizeof uses[0]; u++) {
        double largest;
        const double chance = mean_discrepancy(CA_SAMPLER_INDEPENDENT, &uses[u], 1024, &largest);
        assert_true(chance > 0.025 && chance < 0.055);
        printf("star discrepancy of 2^10 points, %s: %.4f by chance", uses[u].name, chance);
        for (ca_sampler_kind kind = CA_SAMPLER_INDEPENDENT + 1; kind < CA_SAMPLER_KIND_COUNT; kind++) {
            if (uses[u].sequence == CA_SEQUENCE_LIGHT && !has_other_light_paths(kind)) continue;
            const double mean = mean_discrepancy(kind, &uses[u], 1024, &largest);
            printf(", %.4f %s", mean, ca_sampler_name(kind));
            /* Halton points of the second vertex have bases 41 and 43, whose grid 1024 points fill by half:
             * scrambled, they are still better than chance; plain, they lie on diagonals. */
            const double share = u < 4 ? 0.25 : kind == CA_SAMPLER_HALTON_PLAIN ? 1.2 : 0.5;
            assert_true(mean < share * chance);
            if (kind == CA_SAMPLER_SOBOL || kind == CA_SAMPLER_ZSOBOL)
                assert_true(1024.0 * largest <= uses[u].net_bound);
        }
        printf("\n");
    }
}

/* ---- Integrals ------------------------------------------------------------------------------------------------- */

/* Not periodic; each has an integral of one. */
static double grow(const ca_stream *stream, uint32_t dimension)
{
    return exp((double)ca_sample_1d(stream, dimension) + 0x1p-25) / 1.718281828459045;
}
static double in_one(const ca_stream *stream, uint32_t d) { return grow(stream, d + 2); }
static double in_two(const ca_stream *stream, uint32_t d) { return grow(stream, d) * grow(stream, d + 1); }
static double in_pairs(const ca_stream *stream, uint32_t d)
{
    return 0.5 * (in_two(stream, d) + in_two(stream, d + 2));
}
static double in_four(const ca_stream *stream, uint32_t d) { return in_two(stream, d) * in_two(stream, d + 2); }

typedef double (*integrand)(const ca_stream *stream, uint32_t dimension);

enum { RUNS = 64, FROM = 6, TO = 13 };

/* Root mean square errors for 2^m paths, m = FROM ... TO, over randomisations (plain kinds: over stretches of the
 * sequence). */
static void measure_errors(ca_sampler_kind kind, integrand f, uint32_t dimension, double errors[TO + 1])
{
    double squares[TO + 1] = {0};
    for (uint32_t run = 0; run < RUNS; run++) {
        const ca_sampler sampler = sampler_of(kind, run + 1, 1, 1);
        double sum = 0.0;
        uint32_t i = 0;
        for (uint32_t m = 0; m <= TO; m++) {
            for (; i < 1u << m; i++) {
                const ca_stream stream =
                    ca_stream_start(&sampler, CA_SEQUENCE_LIGHT, (ca_sampler_is_plain(kind) ? run << TO : 0) + i);
                sum += f(&stream, dimension);
            }
            squares[m] += pow(sum / (1u << m) - 1.0, 2.0) / RUNS;
        }
    }
    for (uint32_t m = FROM; m <= TO; m++) errors[m] = sqrt(squares[m]);
}

/* Slope of the straight line through (log n, log error). */
static double fitted_exponent(const double errors[TO + 1])
{
    double x = 0, y = 0, xx = 0, xy = 0;
    const double count = TO - FROM + 1;
    for (uint32_t m = FROM; m <= TO; m++) {
        const double u = m * log(2.0), v = log(errors[m]);
        x += u, y += v, xx += u * u, xy += u * v;
    }
    return (count * xy - x * y) / (count * xx - x * x);
}

static void check_rate(ca_sampler_kind kind, const char *name, integrand f, uint32_t dimension, double slowest)
{
    double errors[TO + 1];
    measure_errors(kind, f, dimension, errors);
    const double rate = fitted_exponent(errors);
    printf("  %-12s %s from dimension %u: n^%.2f, %.1e at 2^%d\n", ca_sampler_name(kind), name, dimension, rate,
           errors[TO], TO);
    if (kind == CA_SAMPLER_INDEPENDENT)
        assert_true(fabs(rate + 0.5) < 0.05);
    else
        assert_true(rate <= slowest);
}

static void test_integrals(void **state)
{
    (void)state;
    static const uint32_t firsts[] = {0, CA_DIM_START_COUNT, CA_DIM_START_COUNT + CA_DIM_VERTEX_COUNT};
    for (ca_sampler_kind kind = 0; kind < CA_SAMPLER_KIND_COUNT; kind++)
        for (size_t k = 0; has_other_light_paths(kind) && k < sizeof firsts / sizeof firsts[0]; k++) {
            check_rate(kind, "one", in_one, firsts[k], -0.9);
            check_rate(kind, "two", in_two, firsts[k], -0.8);
            check_rate(kind, "two pairs", in_pairs, firsts[k], -0.8);
            /* zsobol's pairs are independent of each other, and what two pairs do together is left to chance */
            check_rate(kind, "four", in_four, firsts[k], kind == CA_SAMPLER_ZSOBOL ? -0.45 : -0.75);
        }
}

/* ---- Addresses and images -------------------------------------------------------------------------------------- */

/* More paths, other paths and other pixels in between change nothing, nor does another sampler of the same
 * settings. */
static void test_extension(void **state)
{
    (void)state;
    enum { PATHS = 300, DIMENSIONS = 40 };
    static float first[PATHS][DIMENSIONS];
    for (ca_sampler_kind kind = 0; kind < CA_SAMPLER_KIND_COUNT; kind++)
        for (uint64_t s = 0; s < 3; s++) {
            const uint64_t sequence = s == 2 ? CA_SEQUENCE_LIGHT : 13 + 100 * s;
            const ca_sampler sampler = sampler_of(kind, 3, 40, 30), again = sampler_of(kind, 3, 40, 30);
            for (uint32_t i = 0; i < PATHS; i++) {
                const ca_stream stream = ca_stream_start(&sampler, sequence, i);
                for (uint32_t d = 0; d < DIMENSIONS; d++) first[i][d] = ca_sample_1d(&stream, d);
            }
            for (uint32_t n = 0; n < 4 * PATHS; n++) { /* strewn, and beyond */
                const uint32_t i = n * 331 % (4 * PATHS);
                const ca_stream stream = ca_stream_start(&again, sequence, i);
                for (uint32_t d = DIMENSIONS; d > 0 && i < PATHS; d -= 2) {
                    const ca_vec2 pair = ca_sample_2d(&stream, d - 2);
                    assert_true(pair.x == first[i][d - 2] && pair.y == first[i][d - 1]);
                }
            }
        }
}

/* Within each pixel looked at, the film's pair is uniform, whatever the size of the image. */
static void check_image(ca_sampler_kind kind, uint32_t width, uint32_t height, double level)
{
    enum { PATHS = 4096, SIDE = 8 };
    const ca_sampler sampler = sampler_of(kind, 5, width, height);
    const uint64_t pixel_count = (uint64_t)width * height, step = pixel_count / 7 + 1;
    double expected[SIDE * SIDE];
    for (int i = 0; i < SIDE * SIDE; i++) expected[i] = (double)PATHS / (SIDE * SIDE);
    for (uint64_t pixel = 0; pixel < pixel_count; pixel += step) {
        double film[SIDE * SIDE] = {0}, lens[SIDE * SIDE] = {0};
        for (uint32_t i = 0; i < PATHS; i++) {
            const ca_stream stream = ca_stream_start(&sampler, pixel, i);
            const ca_vec2 p = ca_sample_2d(&stream, CA_DIM_FILM), q = ca_sample_2d(&stream, CA_DIM_LENS);
            film[(uint32_t)(p.y * SIDE) * SIDE + (uint32_t)(p.x * SIDE)] += 1.0;
            lens[(uint32_t)(q.y * SIDE) * SIDE + (uint32_t)(q.x * SIDE)] += 1.0;
        }
        const double p_film = ca_chi_square_counts(film, expected, SIDE * SIDE, NULL, NULL);
        const double p_lens = ca_chi_square_counts(lens, expected, SIDE * SIDE, NULL, NULL);
        if (p_film < level || p_lens < level)
            fail_msg("%s, pixel %llu of %u x %u: p = %g on the film, %g on the lens", ca_sampler_name(kind),
                     (unsigned long long)pixel, width, height, p_film, p_lens);
    }
}

/* Pixels beside, below and a power of two away from each other have other numbers, on the film and at a vertex. */
static void check_neighbours(ca_sampler_kind kind, uint32_t width, uint32_t height)
{
    enum { PATHS = 64 };
    const ca_sampler sampler = sampler_of(kind, 6, width, height);
    const uint64_t pixel_count = (uint64_t)width * height, steps[] = {1, width, 2, 64, 64 * (uint64_t)width};
    for (uint64_t pixel = 0; pixel < pixel_count; pixel += pixel_count / 50 + 1)
        for (size_t s = 0; s < sizeof steps / sizeof steps[0] && pixel + steps[s] < pixel_count; s++) {
            if (ca_sampler_has_tiles(kind) && ca_sampler_is_plain(kind) && steps[s] > 2)
                continue; /* the same place in another tile has the same numbers */
            uint32_t equal_film = 0, equal_vertex = 0;
            for (uint32_t i = 0; i < PATHS; i++) {
                const ca_stream here = ca_stream_start(&sampler, pixel, i);
                const ca_stream there = ca_stream_start(&sampler, pixel + steps[s], i);
                equal_film += ca_sample_1d(&here, CA_DIM_FILM) == ca_sample_1d(&there, CA_DIM_FILM) &&
                              ca_sample_1d(&here, CA_DIM_FILM + 1) == ca_sample_1d(&there, CA_DIM_FILM + 1);
                equal_vertex += ca_sample_1d(&here, CA_DIM_START_COUNT) == ca_sample_1d(&there, CA_DIM_START_COUNT);
            }
            assert_true(equal_vertex <= 1);
            /* the same place in two pixels may come often in one sequence over the image that nothing scrambles */
            if (!ca_sampler_is_plain(kind)) assert_true(equal_film <= 1);
        }
}

static void test_images_of_any_size(void **state)
{
    (void)state;
    static const uint32_t sizes[][2] = {{1, 1}, {7, 5}, {1000, 1}, {1, 1000}, {1920, 1080}};
    const double level = ca_sidak_level(0.01, 2 * 7 * 5 * CA_SAMPLER_KIND_COUNT);
    for (ca_sampler_kind kind = 0; kind < CA_SAMPLER_KIND_COUNT; kind++)
        for (size_t s = 0; s < sizeof sizes / sizeof sizes[0]; s++) {
            check_image(kind, sizes[s][0], sizes[s][1], level);
            check_neighbours(kind, sizes[s][0], sizes[s][1]);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_light_paths_are_uniform),
        cmocka_unit_test(test_pixels_are_uniform),
        cmocka_unit_test(test_discrepancy_itself),
        cmocka_unit_test(test_star_discrepancy),
        cmocka_unit_test(test_integrals),
        cmocka_unit_test(test_extension),
        cmocka_unit_test(test_images_of_any_size),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
