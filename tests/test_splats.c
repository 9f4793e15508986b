/* Splats against a sum over all pixels and records in double precision, for every filter, on and around borders; the
 * same bits for any number of threads and lists; energy; failures of memory; and the same splats for pairs. */
#include "base/memory.h"
#include "film/pair_splats.h"
#include "film/splats.h"
#include "support/test_random.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

enum { KINDS = 6, LISTS = 7, FULL = 80 };
static ca_test_random random_source;

static float between(float low, float high) { return low + (high - low) * ca_test_random_float(&random_source); }

static ca_filter prepared(int kind, float stretch)
{
    ca_filter filter = ca_filter_default((ca_filter_kind)kind);
    filter.radius *= stretch;
    filter.stddev *= stretch;
    filter.lobes *= stretch;
    ca_filter_prepare(&filter);
    return filter;
}

static void append(ca_splat_list *list, float x, float y)
{
    const ca_splat splat = {.film = {x, y},
                            .value = {between(0, 1), between(0, 10), between(0, 1000)},
                            .weight = between(0.01f, 1.0f),
                            .light_vertices = 2};
    assert_true(ca_splat_list_add(list, &splat));
}

/* A coordinate as they come, or on a pixel's border or centre, or next to one. */
static float coordinate(void)
{
    const float x = between(-6.0f, FULL + 6.0f);
    switch (ca_test_random_u32(&random_source) % 8) {
    case 0: return floorf(x);
    case 1: return floorf(x) + 0.5f;
    case 2: return nextafterf(floorf(x), INFINITY);
    case 3: return nextafterf(floorf(x), -INFINITY);
    default: return x;
    }
}

static void make_lists(ca_splat_list lists[LISTS], uint32_t count)
{
    memset(lists, 0, LISTS * sizeof *lists);
    for (uint32_t i = 0; i < count; i++) {
        const float x = coordinate(), y = coordinate();
        append(&lists[i % 5 == 0 ? 2 : i * LISTS / count], x, y); /* of different lengths */
    }
}

static void destroy_lists(ca_splat_list *lists, int count)
{
    for (int i = 0; i < count; i++) ca_splat_list_destroy(&lists[i]);
}

static void add(ca_splat_buffer *buffer, const ca_splat_list *lists, uint32_t count, const ca_filter *filter,
                float scale, uint32_t workers)
{
    const ca_parallel parallel = {.workers = workers};
    assert_int_equal(ca_splat_buffer_add(buffer, lists, count, filter, scale, NULL, &parallel, NULL), CA_OK);
}

static ca_splat_buffer create(const uint32_t crop[4])
{
    ca_splat_buffer buffer;
    assert_int_equal(ca_splat_buffer_create(&buffer, crop, NULL), CA_OK);
    return buffer;
}

static void assert_black(const ca_splat_buffer *buffer)
{
    for (size_t i = 0; i < (size_t)buffer->width * buffer->height * 3; i++) assert_true(buffer->sums[i] == 0.0);
}

/* ---- Sums ------------------------------------------------------------------------------------------------------ */

/* The filter along an axis, splat minus pixel centre in [-radius, radius). A box is constant up to its edges. */
static double along(const ca_filter *filter, double distance)
{
    const double radius = (double)filter->radius;
    if (!(distance >= -radius && distance < radius)) return 0.0;
    if (filter->kind == CA_RFILTER_BOX) return 1.0 / (2.0 * radius);
    return (double)ca_filter_eval(filter, (float)distance);
}

typedef struct oracle_sum {
    double value[3], magnitude; /* magnitude: of the absolute values, which rounding is measured by */
} oracle_sum;

static oracle_sum oracle(const ca_splat_list *lists, const ca_filter *filter, double scale, uint32_t x, uint32_t y)
{
    oracle_sum sum = {0};
    for (int l = 0; l < LISTS; l++)
        for (size_t i = 0; i < lists[l].count; i++) {
            const ca_splat *splat = &lists[l].items[i];
            const double f = scale * along(filter, (double)splat->film.x - (x + 0.5)) *
                             along(filter, (double)splat->film.y - (y + 0.5));
            sum.value[0] += f * (double)splat->value.r;
            sum.value[1] += f * (double)splat->value.g;
            sum.value[2] += f * (double)splat->value.b;
            sum.magnitude += fabs(f) * (double)(splat->value.r + splat->value.g + splat->value.b);
        }
    return sum;
}

static void compare(const ca_splat_buffer *buffer, const ca_splat_list *lists, const ca_filter *filter, double scale)
{
    for (uint32_t y = buffer->y0; y < buffer->y0 + buffer->height; y++)
        for (uint32_t x = buffer->x0; x < buffer->x0 + buffer->width; x++) {
            const ca_rgb got = ca_splat_buffer_at(buffer, x, y);
            const oracle_sum sum = oracle(lists, filter, scale, x, y);
            const double off = fabs((double)got.r - sum.value[0]) + fabs((double)got.g - sum.value[1]) +
                               fabs((double)got.b - sum.value[2]);
            if (!(off <= 2e-6 * sum.magnitude))
                fail_msg("%s: pixel (%u, %u) is (%g, %g, %g), not (%g, %g, %g)", ca_filter_name(filter->kind), x, y,
                         (double)got.r, (double)got.g, (double)got.b, sum.value[0], sum.value[1], sum.value[2]);
        }
}

static void test_sums(void **state)
{
    (void)state;
    static const struct {
        uint32_t crop[4];
        float stretch; /* of the filter: the widest covers the film */
    } cases[] = {
        {{0, 0, FULL, FULL}, 1.0f},      {{7, 31, 50, 36}, 1.7f},   {{FULL - 1, 3, FULL, 52}, 1.0f},
        {{11, 0, 12, 1}, 1.0f},          {{1, 13, FULL, 18}, 40.0f},
    };
    for (int kind = 0; kind < KINDS; kind++)
        for (size_t c = 0; c < sizeof cases / sizeof cases[0]; c++) {
            const ca_filter filter = prepared(kind, cases[c].stretch);
            ca_splat_list lists[LISTS];
            make_lists(lists, 800);
            ca_splat_buffer buffer = create(cases[c].crop);
            add(&buffer, lists, LISTS, &filter, 0.125f, 2);
            compare(&buffer, lists, &filter, 0.125);
            ca_splat_buffer_destroy(&buffer);
            destroy_lists(lists, LISTS);
        }
}

/* Additions add up, also where nothing is to be added; clearing forgets them. */
static void test_several_additions(void **state)
{
    (void)state;
    const ca_filter filter = prepared(CA_RFILTER_GAUSSIAN, 1.0f);
    ca_splat_list lists[LISTS], empty[3] = {{0}};
    make_lists(lists, 300);
    ca_splat_buffer buffer = create((uint32_t[4]){0, 0, FULL, FULL});
    add(&buffer, NULL, 0, &filter, 1.0f, 2);
    for (int round = 0; round < 2; round++) {
        add(&buffer, empty, 3, &filter, 1.0f, 2);
        add(&buffer, lists, 3, &filter, 0.5f, 2);
        add(&buffer, lists + 3, LISTS - 3, &filter, 0.5f, 2);
        compare(&buffer, lists, &filter, 0.5);
        ca_splat_buffer_clear(&buffer);
    }
    assert_black(&buffer);
    ca_splat_buffer_destroy(&buffer);
    destroy_lists(lists, LISTS);
}

/* A box hits the pixel that holds the splat, and if it is three pixels wide its neighbours, with a ninth each: never
 * more, never fewer. Borders belong to the right and below. */
static void check_box(ca_splat_buffer *buffer, float x, uint32_t holder, uint32_t reach)
{
    const ca_filter filter = prepared(CA_RFILTER_BOX, (float)(2 * reach + 1));
    const uint32_t row = buffer->y0;
    ca_splat_list list = {0};
    append(&list, x, (float)row);
    append(&list, x, (float)(row + 1 + reach)); /* just below the buffer */
    add(buffer, &list, 1, &filter, 1.0f, 1);
    for (uint32_t p = holder < 4 ? 0 : holder - 4; p < holder + 4 && p < buffer->width; p++) {
        const float expected = p + reach >= holder && p <= holder + reach ? list.items[0].value.r : 0.0f;
        const float area = (float)((2 * reach + 1) * (2 * reach + 1));
        const float got = ca_splat_buffer_at(buffer, p, row).r;
        if (!(fabsf(got * area - expected) <= 1e-6f))
            fail_msg("a splat at %.9g gives pixel %u %g, not %g", (double)x, p, (double)got,
                     (double)(expected / area));
        memset(&buffer->sums[3 * p], 0, 3 * sizeof *buffer->sums);
    }
    ca_splat_list_destroy(&list);
}

static void test_box(void **state)
{
    (void)state;
    const uint32_t size = 4096, row = 5;
    ca_splat_buffer buffer = create((uint32_t[4]){0, row, size, row + 1});
    for (uint32_t x = 0; x < size; x++) {
        const float left = (float)x, centre = left + 0.5f, right = left + 1.0f;
        const float inside[] = {left, nextafterf(left, right), nextafterf(centre, left), centre,
                                nextafterf(right, left)};
        for (size_t i = 0; i < sizeof inside / sizeof inside[0]; i++)
            for (uint32_t reach = 0; reach <= 1; reach++) check_box(&buffer, inside[i], x, reach);
    }
    ca_splat_buffer_destroy(&buffer);
}

/* A grid of splats over more than the film makes it flat, and as bright as one pixel's share of them. */
static void test_energy(void **state)
{
    (void)state;
    enum { PER_PIXEL = 16, SIZE = 20, MARGIN = 4 };
    for (int kind = 0; kind < KINDS; kind++) {
        const ca_filter filter = prepared(kind, 1.0f);
        ca_splat_list list = {0};
        for (int j = -MARGIN * PER_PIXEL; j < (SIZE + MARGIN) * PER_PIXEL; j++)
            for (int i = -MARGIN * PER_PIXEL; i < (SIZE + MARGIN) * PER_PIXEL; i++) {
                const ca_splat splat = {.film = {((float)i + 0.5f) / PER_PIXEL, ((float)j + 0.5f) / PER_PIXEL},
                                        .value = {1, 2, 3},
                                        .weight = 1};
                assert_true(ca_splat_list_add(&list, &splat));
            }
        ca_splat_buffer buffer = create((uint32_t[4]){0, 0, SIZE, SIZE});
        add(&buffer, &list, 1, &filter, 1.0f / (PER_PIXEL * PER_PIXEL), 2);
        for (uint32_t i = 0; i < SIZE * SIZE; i++) {
            const ca_rgb got = ca_splat_buffer_at(&buffer, i % SIZE, i / SIZE);
            assert_true(fabsf(got.r - 1.0f) < 2e-3f);
            assert_true(fabsf(got.b - 3.0f) < 6e-3f);
        }
        ca_splat_buffer_destroy(&buffer);
        ca_splat_list_destroy(&list);
    }
}

/* Millions of equal splats on the only pixel of a film, as a distant lamp gives a measuring sensor: a sum in single
 * precision is 3 % too small, and would stay where it is from 2^24 of them on. */
static void test_millions_on_a_pixel(void **state)
{
    (void)state;
    enum { EQUAL = 1 << 20, ROUNDS = 3 };
    const ca_filter filter = prepared(CA_RFILTER_BOX, 1.0f);
    const ca_splat splat = {.film = {0.5f, 0.5f}, .value = {0.3f, 1.7f, 0.9f}, .weight = 1};
    ca_splat_list list = {0};
    for (int i = 0; i < EQUAL; i++) assert_true(ca_splat_list_add(&list, &splat));
    ca_splat_buffer buffer = create((uint32_t[4]){0, 0, 1, 1});
    for (int round = 0; round < ROUNDS; round++) add(&buffer, &list, 1, &filter, 1.0f / (ROUNDS * EQUAL), 1);
    const ca_rgb got = ca_splat_buffer_at(&buffer, 0, 0);
    if (!(fabsf(got.r - 0.3f) < 1e-6f && fabsf(got.g - 1.7f) < 1e-6f && fabsf(got.b - 0.9f) < 1e-6f))
        fail_msg("the pixel is (%.8g, %.8g, %.8g), not (0.3, 1.7, 0.9)", (double)got.r, (double)got.g,
                 (double)got.b);
    ca_splat_buffer_destroy(&buffer);
    ca_splat_list_destroy(&list);
}

/* ---- The same bits --------------------------------------------------------------------------------------------- */

static void test_same_bits(void **state)
{
    (void)state;
    static const uint32_t worker_counts[] = {1, 2, 3, 8};
    for (int kind = 0; kind < KINDS; kind++) {
        const ca_filter filter = prepared(kind, 1.0f);
        ca_splat_list lists[LISTS], whole = {0};
        make_lists(lists, 20000);
        for (int l = 0; l < LISTS; l++)
            for (size_t i = 0; i < lists[l].count; i++) assert_true(ca_splat_list_add(&whole, &lists[l].items[i]));
        ca_splat_buffer one = create((uint32_t[4]){0, 0, FULL, FULL});
        add(&one, &whole, 1, &filter, 0.3f, 1);
        for (int w = 0; w < 4; w++) {
            ca_splat_buffer many = create((uint32_t[4]){0, 0, FULL, FULL});
            add(&many, lists, LISTS, &filter, 0.3f, worker_counts[w]);
            assert_memory_equal(one.sums, many.sums, (size_t)FULL * FULL * 3 * sizeof *one.sums);
            ca_splat_buffer_destroy(&many);
        }
        ca_splat_buffer_destroy(&one);
        ca_splat_list_destroy(&whole);
        destroy_lists(lists, LISTS);
    }
}

/* A crop is a piece of the whole, to the bit. */
static void test_crop_is_a_piece(void **state)
{
    (void)state;
    static const uint32_t crop[4] = {13, 9, 44, 58};
    for (int kind = 0; kind < KINDS; kind++) {
        const ca_filter filter = prepared(kind, 1.3f);
        ca_splat_list lists[LISTS];
        make_lists(lists, 5000);
        ca_splat_buffer whole = create((uint32_t[4]){0, 0, FULL, FULL}), piece = create(crop);
        add(&whole, lists, LISTS, &filter, 1.0f, 2);
        add(&piece, lists, LISTS, &filter, 1.0f, 2);
        for (uint32_t y = crop[1]; y < crop[3]; y++)
            for (uint32_t x = crop[0]; x < crop[2]; x++) {
                const ca_rgb a = ca_splat_buffer_at(&whole, x, y), b = ca_splat_buffer_at(&piece, x, y);
                assert_memory_equal(&a, &b, sizeof a);
            }
        ca_splat_buffer_destroy(&whole);
        ca_splat_buffer_destroy(&piece);
        destroy_lists(lists, LISTS);
    }
}

/* ---- Failures -------------------------------------------------------------------------------------------------- */

static void test_allocation_failures(void **state)
{
    (void)state;
    const uint32_t crop[4] = {0, 0, FULL, FULL};
    ca_splat_buffer buffer;
    ca_error error = {0};
    ca_memory_fail_after(0);
    assert_int_equal(ca_splat_buffer_create(&buffer, crop, &error), CA_ERROR_MEMORY);
    assert_non_null(strstr(error.message, "splats"));

    const ca_splat splat = {.film = {3, 4}, .value = {1, 1, 1}, .weight = 1};
    ca_splat_list list = {0};
    ca_memory_fail_after(0);
    assert_false(ca_splat_list_add(&list, &splat));
    assert_int_equal(list.count, 0);
    ca_memory_fail_after(-1);

    const ca_filter filter = prepared(CA_RFILTER_TENT, 1.0f);
    const ca_parallel parallel = {.workers = 2};
    ca_splat_list lists[LISTS];
    make_lists(lists, 500);
    uint32_t failures = 0;
    for (;; failures++) {
        buffer = create(crop);
        ca_memory_fail_after((long)failures);
        const ca_status status = ca_splat_buffer_add(&buffer, lists, LISTS, &filter, 1.0f, NULL, &parallel, &error);
        ca_memory_fail_after(-1);
        if (status == CA_OK) break;
        assert_int_equal(status, CA_ERROR_MEMORY);
        assert_black(&buffer);
        add(&buffer, lists, LISTS, &filter, 1.0f, 2); /* as if nothing had been */
        compare(&buffer, lists, &filter, 1.0);
        ca_splat_buffer_destroy(&buffer);
    }
    assert_true(failures >= 2);
    ca_splat_buffer_destroy(&buffer);
    destroy_lists(lists, LISTS);
}

/* ---- Pairs ----------------------------------------------------------------------------------------------------- */

/* What splats bring the pairs of a pixel is what they bring the image: its luminance, over the light paths. */
static void check_pairs(const ca_filter *filter, const ca_splat_list *lists)
{
    enum { LIGHT_PATHS = 50 };
    static const uint32_t crop[4] = {20, 30, 45, 50};
    ca_pair_splats splats;
    ca_pair_sums *sums;
    assert_int_equal(ca_pair_splats_create(&splats, crop, filter, NULL), CA_OK);
    assert_int_equal(ca_pair_splats_add(&splats, lists, LISTS, 3, NULL), CA_OK);
    assert_int_equal(ca_pair_splats_sort(&splats, NULL), CA_OK);
    assert_int_equal(ca_pair_sums_create(&sums, NULL), CA_OK);
    for (uint32_t y = crop[1]; y < crop[3]; y++)
        for (uint32_t x = crop[0]; x < crop[2]; x++) {
            const oracle_sum sum = oracle(lists, filter, 1.0, x, y);
            const double expected = 0.2126 * sum.value[0] + 0.7152 * sum.value[1] + 0.0722 * sum.value[2];
            ca_pair_sums_begin(sums, LIGHT_PATHS);
            ca_pair_sums_next_path(sums);
            ca_pair_splats_gather(&splats, x, y, sums);
            const double got = LIGHT_PATHS * ca_pair_sums_finish(sums).value;
            if (!(fabs(got - expected) <= 1e-6 * sum.magnitude)) fail_msg("%g instead of %g", got, expected);
        }
    ca_pair_sums_destroy(sums);
    ca_pair_splats_destroy(&splats);
}

static void test_pairs(void **state)
{
    (void)state;
    ca_splat_list lists[LISTS];
    make_lists(lists, 20000);
    for (int l = 0; l < LISTS; l++)
        for (size_t i = 0; i < lists[l].count; i++) lists[l].items[i].light_path = i % 40 & 0x3ffff;
    for (int kind = 0; kind < KINDS; kind++)
        for (int stretch = 0; stretch < 3; stretch++) {
            const ca_filter filter = prepared(kind, 1.0f + 0.4f * (float)stretch);
            check_pairs(&filter, lists);
        }
    destroy_lists(lists, LISTS);
}

int main(void)
{
    random_source = ca_test_random_seed(31);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sums),
        cmocka_unit_test(test_several_additions),
        cmocka_unit_test(test_box),
        cmocka_unit_test(test_energy),
        cmocka_unit_test(test_millions_on_a_pixel),
        cmocka_unit_test(test_same_bits),
        cmocka_unit_test(test_crop_is_a_piece),
        cmocka_unit_test(test_allocation_failures),
        cmocka_unit_test(test_pairs),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
