/* The photon grid against a linear search: the same photons, each once, wherever they lie and however large the
 * radius is; the same order for any number of threads, any division into runs, and with or without vector
 * instructions. */
#include "base/memory.h"
#include "math/numeric.h"
#include "photon/photon_grid.h"
#include "support/photon_cloud.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* The same source again, without vector instructions. */
void plain_prefetch(const ca_photon_grid *grid, ca_vec3 position);
void plain_query_start(ca_photon_query *query, const ca_photon_grid *grid, ca_vec3 position);
void plain_query_start_within(ca_photon_query *query, const ca_photon_grid *grid, ca_vec3 position, float radius);
uint32_t plain_query_next(ca_photon_query *query, uint32_t vertices[CA_PHOTON_BATCH]);
#define CA_PHOTON_PLAIN
#define ca_photon_grid_prefetch plain_prefetch
#define ca_photon_query_start plain_query_start
#define ca_photon_query_start_within plain_query_start_within
#define ca_photon_query_next plain_query_next
#include "photon/photon_query.c"
#undef ca_photon_grid_prefetch
#undef ca_photon_query_start
#undef ca_photon_query_start_within
#undef ca_photon_query_next

enum { MAX_PHOTONS = 40000 };
static ca_photon photons[MAX_PHOTONS];
static uint32_t found[MAX_PHOTONS], found_plain[MAX_PHOTONS];
static uint8_t met[MAX_PHOTONS];
static ca_test_random random_source;

static float uniform(void) { return ca_test_random_float(&random_source); }
static float between(float low, float high) { return low + (high - low) * uniform(); }
static uint32_t below(uint32_t limit) { return ca_test_random_u32(&random_source) % limit; }

/* All vertices of a query in order; *tested is its count. */
static uint32_t collect(const ca_photon_grid *grid, ca_vec3 position, uint32_t *vertices, uint64_t *tested)
{
    ca_photon_query query;
    uint32_t batch[CA_PHOTON_BATCH], count, total = 0;
    ca_photon_query_start(&query, grid, position);
    while ((count = ca_photon_query_next(&query, batch)) > 0) {
        assert_in_range(count, 1, CA_PHOTON_BATCH);
        assert_true(total + count <= MAX_PHOTONS);
        memcpy(vertices + total, batch, count * sizeof *batch);
        total += count;
    }
    assert_true(query.tested >= total);
    *tested = query.tested;
    return total;
}

static uint32_t collect_plain(const ca_photon_grid *grid, ca_vec3 position, uint32_t *vertices)
{
    ca_photon_query query;
    uint32_t batch[CA_PHOTON_BATCH], count, total = 0;
    plain_query_start(&query, grid, position);
    while ((count = plain_query_next(&query, batch)) > 0) {
        memcpy(vertices + total, batch, count * sizeof *batch);
        total += count;
    }
    return total;
}

/* Returns the number found. */
static uint32_t check_query(const ca_photon_grid *grid, uint32_t photon_count, float radius, ca_vec3 position)
{
    uint64_t tested;
    const uint32_t count = collect(grid, position, found, &tested);
    assert_int_equal(collect_plain(grid, position, found_plain), count);
    assert_memory_equal(found, found_plain, count * sizeof *found);
    memset(met, 0, photon_count);
    for (uint32_t i = 0; i < count; i++) {
        assert_true(found[i] < photon_count);
        met[found[i]]++;
    }
    for (uint32_t i = 0; i < photon_count; i++) {
        const bool within = ca_length2(ca_sub(photons[i].position, position)) <= radius * radius;
        if (met[i] != within)
            fail_msg("photon %u at (%a, %a, %a) is met %u times, should be %d, from (%a, %a, %a), radius %a", i,
                     (double)photons[i].position.x, (double)photons[i].position.y, (double)photons[i].position.z,
                     met[i], within, (double)position.x, (double)position.y, (double)position.z, (double)radius);
    }
    return count;
}

/* Queries at photons, about a radius from them along an axis and elsewhere, and anywhere around. */
static uint32_t check_queries(const ca_photon_grid *grid, uint32_t count, float radius, uint32_t queries)
{
    uint32_t met_sum = 0;
    for (uint32_t i = 0; i < queries; i++) {
        ca_vec3 p = photons[below(count)].position;
        float *axis = i % 3 == 0 ? &p.x : i % 3 == 1 ? &p.y : &p.z;
        switch (i % 5) {
        case 0: break;
        case 1: *axis += radius; break;
        case 2: *axis = ca_next_down(*axis - radius); break;
        case 3: p = ca_madd(p, radius, random_point_of(&random_source, 1.0f)); break;
        default: p = ca_madd(p, uniform() * 100.0f * radius, random_point_of(&random_source, 1.0f)); break;
        }
        if (ca_is_finite3(p)) met_sum += check_query(grid, count, radius, p);
    }
    return met_sum;
}

static void check_cloud(uint32_t count, float radius, uint32_t queries)
{
    ca_photon_grid *grid = create_grid();
    build_grid(grid, photons, count, radius, 2);
    const uint32_t met_sum = check_queries(grid, count, radius, queries);
    assert_true(met_sum > queries / 5); /* those at photons find them at least */
    ca_photon_grid_destroy(grid);
}

/* ---- Where photons can lie ------------------------------------------------------------------------------------- */

static void test_uniform(void **state)
{
    (void)state;
    for (int k = 0; k < 6; k++) {
        const float half = powf(10.0f, (float)(3 * k - 8));
        const uint32_t count = 200 * (uint32_t)(k + 1);
        for (uint32_t i = 0; i < count; i++) photons[i].position = random_point_of(&random_source, half);
        check_cloud(count, 0.02f * half, 400);
        check_cloud(count, 0.3f * half, 400);
        check_cloud(count, 5.0f * half, 100);
    }
}

static void test_many(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < MAX_PHOTONS; i++) {
        photons[i].position = random_point_of(&random_source, 1.0f);
        photons[i].position.z = 0.3f * photons[i].position.x; /* a surface */
    }
    check_cloud(MAX_PHOTONS, 0.01f, 300);
    check_cloud(MAX_PHOTONS, 0.2f, 50);
    for (uint32_t i = 0; i < MAX_PHOTONS; i++) photons[i].position.y += 1e-3f * (float)i; /* the last lie farthest */
    check_cloud(MAX_PHOTONS, 0.1f, 300);
}

static void test_clusters(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < 5000; i++) {
        const float size = powf(10.0f, between(-6.0f, 1.0f));
        photons[i].position = ca_add((ca_vec3){3, -7, 2}, random_point_of(&random_source, size));
    }
    for (float radius = 1e-5f; radius < 20.0f; radius *= 10.0f) check_cloud(5000, radius, 150);
}

static void test_lines_and_planes(void **state)
{
    (void)state;
    for (int axis = 0; axis < 3; axis++)
        for (int plane = 0; plane < 2; plane++) {
            for (uint32_t i = 0; i < 3000; i++) {
                float p[3] = {0.25f, -1.5f, 0.0f};
                p[axis] = between(-1, 1);
                if (plane) p[(axis + 1) % 3] = between(-1, 1);
                photons[i].position = (ca_vec3){p[0], p[1], p[2]};
            }
            check_cloud(3000, plane ? 0.05f : 0.002f, 300);
        }
}

/* Coordinates that are multiples of the radius, and their neighbours. */
static void test_cell_borders(void **state)
{
    (void)state;
    static const float radii[] = {0.25f, 0.1f, 1.0f / 3.0f};
    for (int k = 0; k < 3; k++)
        for (int nudge = 0; nudge < 2; nudge++) {
            for (uint32_t i = 0; i < 3000; i++) {
                float p[3];
                for (int axis = 0; axis < 3; axis++) {
                    p[axis] = radii[k] * (float)((int)below(20) - 10);
                    if (nudge) p[axis] = below(2) ? ca_next_up(p[axis]) : ca_next_down(p[axis]);
                }
                photons[i].position = (ca_vec3){p[0], p[1], p[2]};
            }
            check_cloud(3000, radii[k], 500);
        }
}

/* Queries that reach from just below one border to just above the next: of a cell too narrow they would see three. */
static void test_between_borders(void **state)
{
    (void)state;
    const float radius = 0.01f;
    for (uint32_t i = 0; i < 1000; i++) photons[i].position = (ca_vec3){uniform(), uniform(), uniform()};
    photons[0].position = (ca_vec3){0, 0, 0};
    ca_photon_grid *grid = create_grid();
    build_grid(grid, photons, 1000, radius, 1);
    for (uint32_t i = 0; i < 20000; i++) {
        float p[3];
        for (int axis = 0; axis < 3; axis++)
            p[axis] = radius * (float)(2 * below(30) + 1) * (1.0f + between(-4e-5f, 4e-5f));
        check_query(grid, 1000, radius, (ca_vec3){p[0], p[1], p[2]});
    }
    ca_photon_grid_destroy(grid);
}

/* Up to where neighbouring coordinates are farther apart than the radius. */
static void test_far_from_the_origin(void **state)
{
    (void)state;
    for (float far = 1e2f; far < 2e9f; far *= 10.0f) {
        const ca_vec3 center = {far, -0.7f * far, 1.3f * far};
        for (uint32_t i = 0; i < 2000; i++)
            photons[i].position = ca_add(center, random_point_of(&random_source, 1.0f));
        check_cloud(2000, 0.1f, 200);
        photons[0].position = ca_neg(center);
        photons[1].position = (ca_vec3){0, 0, 0};
        check_cloud(2000, 0.1f, 200);
    }
}

static void test_extreme_sizes(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < 500; i++) photons[i].position = random_point_of(&random_source, 3.4e38f);
    for (uint32_t i = 0; i < 100; i++) photons[i].position = random_point_of(&random_source, 1e-22f);
    static const float radii[] = {FLT_MIN, 1e-30f, 1e-20f, 1e-3f, 1e10f, 1e18f, 2e19f, 1e30f, FLT_MAX};
    for (size_t k = 0; k < sizeof radii / sizeof radii[0]; k++) check_cloud(500, radii[k], 200);
    check_cloud(100, 1e-23f, 200);
    check_cloud(100, 3e-22f, 200);
}

static void test_few(void **state)
{
    (void)state;
    ca_photon_grid *grid = create_grid();
    ca_photon_query query;
    uint32_t vertices[CA_PHOTON_BATCH];
    ca_photon_query_start(&query, grid, (ca_vec3){0, 0, 0}); /* before any build */
    assert_int_equal(ca_photon_query_next(&query, vertices), 0);
    build_grid(grid, photons, 0, 1.0f, 2);
    ca_photon_query_start(&query, grid, (ca_vec3){0, 0, 0});
    assert_int_equal(ca_photon_query_next(&query, vertices), 0);
    ca_photon_grid_destroy(grid);
    for (uint32_t count = 1; count < 40; count++) {
        for (uint32_t i = 0; i < count; i++) photons[i].position = random_point_of(&random_source, 1.0f);
        check_cloud(count, 0.3f, 200);
    }
}

/* Far beyond one batch, and in the order in which they were given. */
static void test_duplicates(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < 30000; i++) photons[i].position = (ca_vec3){1, 2, 3};
    ca_photon_grid *grid = create_grid();
    build_grid(grid, photons, 30000, 0.01f, 2);
    uint64_t tested;
    assert_int_equal(collect(grid, (ca_vec3){1.005f, 2, 3}, found, &tested), 30000);
    assert_int_equal(tested, 30000);
    for (uint32_t i = 0; i < 30000; i++) assert_int_equal(found[i], i);
    assert_int_equal(collect(grid, (ca_vec3){1.02f, 2, 3}, found, &tested), 0);
    ca_photon_grid_destroy(grid);
}

static void test_queries_that_are_not_finite(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < 1000; i++) photons[i].position = random_point_of(&random_source, 1.0f);
    ca_photon_grid *grid = create_grid();
    build_grid(grid, photons, 1000, 0.1f, 1);
    const float odd[] = {NAN, INFINITY, -INFINITY, FLT_MAX, -FLT_MAX};
    for (int k = 0; k < 15; k++) {
        float p[3] = {0, 0, 0};
        p[k % 3] = odd[k / 3];
        uint64_t tested;
        assert_int_equal(collect(grid, (ca_vec3){p[0], p[1], p[2]}, found, &tested), 0);
    }
    ca_photon_grid_destroy(grid);
}

/* ---- A radius of the query's own ------------------------------------------------------------------------------- */

static int by_vertex(const void *a, const void *b)
{
    const uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

static uint32_t check_within(const ca_photon_grid *grid, uint32_t photon_count, float radius, ca_vec3 position)
{
    ca_photon_query query, plain;
    uint32_t batch[CA_PHOTON_BATCH], batch_plain[CA_PHOTON_BATCH], count, total = 0;
    ca_photon_query_start_within(&query, grid, position, radius);
    plain_query_start_within(&plain, grid, position, radius);
    while ((count = ca_photon_query_next(&query, batch)) > 0) {
        assert_int_equal(plain_query_next(&plain, batch_plain), count);
        assert_memory_equal(batch, batch_plain, count * sizeof *batch);
        memcpy(found + total, batch, count * sizeof *batch);
        total += count;
    }
    assert_int_equal(plain_query_next(&plain, batch_plain), 0);
    qsort(found, total, sizeof *found, by_vertex);
    uint32_t expected = 0;
    for (uint32_t i = 0; i < photon_count; i++) {
        if (!(ca_length2(ca_sub(photons[i].position, position)) <= radius * radius)) continue;
        assert_true(expected < total);
        assert_int_equal(found[expected++], i);
    }
    assert_int_equal(total, expected);
    return total;
}

static void check_radii(const ca_photon_grid *grid, uint32_t count, float radius, uint32_t queries)
{
    static const float shares[] = {1.0f, 0.999f, 0.5f, 0.1f, 1e-3f, 0.0f};
    uint32_t met_sum = 0;
    for (uint32_t i = 0; i < queries; i++) {
        const float own = radius * (i % 7 == 6 ? uniform() : shares[i % 7]);
        ca_vec3 p = photons[below(count)].position;
        float *axis = i % 3 == 0 ? &p.x : i % 3 == 1 ? &p.y : &p.z;
        switch (i % 4) {
        case 0: break;
        case 1: *axis += own; break;
        case 2: *axis = ca_next_down(*axis - own); break;
        default: p = ca_madd(p, radius, random_point_of(&random_source, 1.0f)); break;
        }
        if (ca_is_finite3(p)) met_sum += check_within(grid, count, own, p);
    }
    assert_true(met_sum > queries / 5);
}

static void test_own_radius(void **state)
{
    (void)state;
    ca_photon_grid *grid = create_grid();
    ca_photon_query query;
    uint32_t batch[CA_PHOTON_BATCH];
    ca_photon_query_start_within(&query, grid, (ca_vec3){0, 0, 0}, 1.0f); /* before any build */
    assert_int_equal(ca_photon_query_next(&query, batch), 0);
    for (uint32_t i = 0; i < 5000; i++) photons[i].position = (ca_vec3){uniform(), uniform(), 0.25f * uniform()};
    static const float radii[] = {1e-3f, 0.03f, 0.2f, 3.0f};
    for (size_t k = 0; k < sizeof radii / sizeof radii[0]; k++) {
        build_grid(grid, photons, 5000, radii[k], 1);
        check_radii(grid, 5000, radii[k], 700);
    }
    for (uint32_t i = 0; i < 1000; i++)
        photons[i].position = random_point_of(&random_source, 3.4e38f); /* squares overflow */
    build_grid(grid, photons, 1000, FLT_MAX, 1);
    check_radii(grid, 1000, FLT_MAX, 100);
    check_radii(grid, 1000, 1e18f, 100);
    for (uint32_t i = 0; i < 1000; i++)
        photons[i].position = random_point_of(&random_source, 1e-22f); /* and underflow */
    build_grid(grid, photons, 1000, 1e-3f, 1);
    check_radii(grid, 1000, 1e-22f, 100);
    ca_photon_grid_destroy(grid);
}

/* ---- Order ----------------------------------------------------------------------------------------------------- */

/* Every query's vertices one after the other. */
static uint32_t *dump(const ca_photon_grid *grid, uint32_t *size)
{
    uint32_t *all = NULL, capacity = 0, used = 0;
    ca_test_random positions = ca_test_random_seed(7);
    for (uint32_t i = 0; i < 2000; i++) {
        const ca_vec3 p = {ca_test_random_float(&positions), ca_test_random_float(&positions), 0.5f};
        uint64_t tested;
        const uint32_t count = collect(grid, p, found, &tested);
        if (used + count > capacity) {
            capacity = 2 * (used + count);
            all = realloc(all, capacity * sizeof *all);
        }
        memcpy(all + used, found, count * sizeof *all);
        used += count;
    }
    *size = used;
    return all;
}

static void test_order_is_that_of_the_runs(void **state)
{
    (void)state;
    static uint32_t starts[MAX_PHOTONS + 2];
    random_source = ca_test_random_seed(3);
    for (uint32_t i = 0; i < MAX_PHOTONS; i++) photons[i].position = (ca_vec3){uniform(), uniform(), 0.5f};
    ca_photon_grid *grid = create_grid();
    build_grid(grid, photons, MAX_PHOTONS, 0.05f, 1);
    uint32_t size;
    uint32_t *expected = dump(grid, &size);
    assert_true(size > 100000);
    static const uint32_t workers[] = {1, 2, 3, 8};
    for (uint32_t k = 0; k < 8; k++) {
        uint32_t run_count = 0;
        for (uint32_t first = 0; first < MAX_PHOTONS;) { /* short runs, some of them empty, or long ones */
            if (run_count == MAX_PHOTONS - 1) fail();
            starts[run_count++] = first;
            first += ca_min_u32(k % 2 ? below(4) : below(20000), MAX_PHOTONS - first);
        }
        starts[run_count] = starts[run_count + 1] = MAX_PHOTONS; /* the last one is empty */
        run_count++;
        const ca_photon_bounds bounds = bounds_of(photons, MAX_PHOTONS);
        const photon_pieces pieces = {photons, starts};
        assert_int_equal(build_pieces(grid, &pieces, run_count, &bounds, 0.05f, workers[k / 2]), CA_OK);
        uint32_t other_size;
        uint32_t *other = dump(grid, &other_size);
        assert_int_equal(other_size, size);
        assert_memory_equal(other, expected, size * sizeof *other);
        free(other);
    }
    free(expected);
    ca_photon_grid_destroy(grid);
}

/* Queries' vertices below `limit` one after the other, and how many of the queries asked for each photon's cell. */
static uint32_t dump_below(const ca_photon_grid *grid, uint32_t limit, uint32_t *vertices, uint32_t *exact)
{
    ca_test_random positions = ca_test_random_seed(8);
    uint32_t used = 0;
    for (uint32_t i = 0; i < 500; i++) {
        ca_photon_query query;
        uint32_t batch[CA_PHOTON_BATCH], count;
        ca_photon_query_start(&query, grid, random_point_of(&positions, 1.0f));
        *exact += query.exact;
        while ((count = ca_photon_query_next(&query, batch)) > 0)
            for (uint32_t k = 0; k < count; k++)
                if (batch[k] < limit) vertices[used++] = batch[k];
    }
    return used;
}

/* The first photons among others, fewer or more of them, here and there, so that they lie in other buckets. */
static void test_order_is_the_same_among_others(void **state)
{
    (void)state;
    static const uint32_t counts[] = {20, 300, 3000};
    static const float radii[] = {0.4f, 0.2f, 0.08f};
    for (uint32_t k = 0; k < 3; k++) {
        const ca_photon_bounds bounds = {{-1.0f, -1.0f, -1.0f}, {1.0f, 1.0f, 1.0f}};
        const uint32_t own = counts[k];
        uint32_t exact = 0, exact_alone = 0, starts[] = {0, own, own};
        for (uint32_t i = 0; i < MAX_PHOTONS; i++)
            photons[i] = (ca_photon){random_point_of(&random_source, i < own || i % 3 ? 1.0f : 0.3f), i};
        ca_photon_grid *grid = create_grid();
        assert_int_equal(build_pieces(grid, &(photon_pieces){photons, starts}, 2, &bounds, radii[k], 1), CA_OK);
        const uint32_t size = dump_below(grid, own, found_plain, &exact_alone);
        assert_in_range(size, 100, MAX_PHOTONS);
        for (uint32_t others = 1; own + others <= MAX_PHOTONS; others = 2 * others + below(100)) {
            starts[2] = own + others;
            assert_int_equal(build_pieces(grid, &(photon_pieces){photons, starts}, 2, &bounds, radii[k], 2), CA_OK);
            assert_int_equal(dump_below(grid, own, found, &exact), size);
            assert_memory_equal(found, found_plain, size * sizeof *found);
        }
        /* of few buckets a query's cells share some */
        if (k == 0) assert_in_range(exact_alone, 100, 500);
        if (k < 2) assert_true(exact > 0);
        ca_photon_grid_destroy(grid);
    }
}

/* All cells in 16 buckets: photons are found once, though their buckets are looked at for several cells. */
static void test_cells_that_share_buckets(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < 16; i++) photons[i].position = random_point_of(&random_source, 1.0f);
    ca_photon_grid *grid = create_grid();
    build_grid(grid, photons, 16, 0.3f, 1);
    uint32_t exact = 0;
    for (uint32_t i = 0; i < 5000; i++) {
        const ca_vec3 p = random_point_of(&random_source, 1.1f);
        ca_photon_query query;
        ca_photon_query_start(&query, grid, p);
        exact += query.exact;
        check_query(grid, 16, 0.3f, p);
        check_within(grid, 16, 0.15f, p);
    }
    assert_in_range(exact, 1000, 4999);
    ca_photon_grid_destroy(grid);
}

/* Bounds that are too small, too large, or elsewhere. */
static void test_bounds(void **state)
{
    (void)state;
    static const float halves[] = {0.0f, 1e-3f, 0.3f, 30.0f, 1e6f}, centers[] = {0.0f, 0.7f, -40.0f};
    uint32_t starts[] = {0, 2000};
    for (uint32_t i = 0; i < 2000; i++) photons[i] = (ca_photon){random_point_of(&random_source, 1.0f), i};
    ca_photon_grid *grid = create_grid();
    for (uint32_t k = 0; k < 15; k++) {
        const float half = halves[k / 3], center = centers[k % 3];
        const ca_photon_bounds bounds = {{center - half, -half, -half}, {center + half, half, half}};
        assert_int_equal(build_pieces(grid, &(photon_pieces){photons, starts}, 1, &bounds, 0.1f, 1), CA_OK);
        assert_true(check_queries(grid, 2000, 0.1f, 300) > 60);
    }
    ca_photon_grid_destroy(grid);
}

/* Buckets share few photons of different cells: a query looks at few beyond its eight cells. */
static void test_tests_are_few(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < MAX_PHOTONS; i++) photons[i].position = (ca_vec3){uniform(), uniform(), 0.5f};
    ca_photon_grid *grid = create_grid();
    build_grid(grid, photons, MAX_PHOTONS, 0.01f, 1);
    uint64_t tested_sum = 0;
    for (uint32_t i = 0; i < 4000; i++) {
        uint64_t tested;
        collect(grid, (ca_vec3){between(0.1f, 0.9f), between(0.1f, 0.9f), 0.5f}, found, &tested);
        tested_sum += tested;
    }
    /* four cells of the plane hold 64, and eight buckets up to one foreign photon each */
    assert_in_range(tested_sum / 4000, 60, 74);
    ca_photon_grid_destroy(grid);
}

/* ---- Memory ---------------------------------------------------------------------------------------------------- */

static void test_allocation_failures(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < 20000; i++) photons[i].position = random_point_of(&random_source, 1.0f);
    ca_photon_grid *grid;
    ca_error error;
    ca_memory_fail_after(0);
    assert_int_equal(ca_photon_grid_create(&grid, &error), CA_ERROR_MEMORY);
    ca_memory_fail_after(-1);
    grid = create_grid();
    long failures = 0;
    for (;; failures++) {
        build_grid(grid, photons, 1000, 0.1f, 1);
        ca_photon_grid *fresh = create_grid();
        ca_memory_fail_after(failures);
        const ca_status status = try_build_grid(grid, photons, 20000, 0.1f, 2);
        const ca_status fresh_status = try_build_grid(fresh, photons, 20000, 0.1f, 2);
        ca_memory_fail_after(-1);
        /* a grid that could not be built is empty, and can be built again */
        uint64_t tested;
        if (fresh_status != CA_OK) assert_int_equal(collect(fresh, photons[0].position, found, &tested), 0);
        build_grid(fresh, photons, 20000, 0.1f, 1);
        check_query(fresh, 20000, 0.1f, photons[0].position);
        ca_photon_grid_destroy(fresh);
        if (status == CA_OK && fresh_status == CA_OK) break;
        assert_true(status == CA_ERROR_MEMORY || fresh_status == CA_ERROR_MEMORY);
        if (status != CA_OK) assert_int_equal(collect(grid, photons[0].position, found, &tested), 0);
        ca_photon_grid_destroy(grid);
        grid = create_grid();
    }
    assert_in_range(failures, 8, 20);
    ca_photon_grid_destroy(grid);
}

static void test_memory_is_kept(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < MAX_PHOTONS; i++) photons[i].position = random_point_of(&random_source, 1.0f);
    ca_photon_grid *grid = create_grid();
    build_grid(grid, photons, MAX_PHOTONS, 0.01f, 2);
    const size_t bytes = ca_photon_grid_bytes(grid);
    assert_in_range(bytes, 24 * MAX_PHOTONS, 34 * MAX_PHOTONS);
    ca_memory_fail_after(0); /* no allocation from here on */
    for (uint32_t count = MAX_PHOTONS + 1; count > 0; count /= 2) build_grid(grid, photons, count - 1, 0.02f, 2);
    build_grid(grid, photons, MAX_PHOTONS, 0.005f, 2);
    ca_memory_fail_after(-1);
    assert_int_equal(ca_photon_grid_bytes(grid), bytes);
    check_queries(grid, MAX_PHOTONS, 0.005f, 20);
    ca_photon_grid_destroy(grid);
    ca_photon_grid_destroy(NULL);
}

static void test_too_many(void **state)
{
    (void)state;
    const ca_photon_source source = {.run_count = 2, .count = UINT32_MAX, .read = read_piece};
    const ca_photon_bounds bounds = {0};
    const ca_parallel parallel = {.workers = 1};
    ca_photon_grid *grid = create_grid();
    ca_error error;
    assert_int_equal(ca_photon_grid_build(grid, &source, &bounds, 1.0f, &parallel, &error), CA_ERROR_UNSUPPORTED);
    assert_int_equal(ca_photon_grid_count(grid), 0);
    ca_photon_grid_destroy(grid);
}

int main(void)
{
    random_source = ca_test_random_seed(1);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_uniform),
        cmocka_unit_test(test_many),
        cmocka_unit_test(test_clusters),
        cmocka_unit_test(test_lines_and_planes),
        cmocka_unit_test(test_cell_borders),
        cmocka_unit_test(test_between_borders),
        cmocka_unit_test(test_far_from_the_origin),
        cmocka_unit_test(test_extreme_sizes),
        cmocka_unit_test(test_few),
        cmocka_unit_test(test_duplicates),
        cmocka_unit_test(test_queries_that_are_not_finite),
        cmocka_unit_test(test_own_radius),
        cmocka_unit_test(test_order_is_that_of_the_runs),
        cmocka_unit_test(test_order_is_the_same_among_others),
        cmocka_unit_test(test_cells_that_share_buckets),
        cmocka_unit_test(test_bounds),
        cmocka_unit_test(test_tests_are_few),
        cmocka_unit_test(test_allocation_failures),
        cmocka_unit_test(test_memory_is_kept),
        cmocka_unit_test(test_too_many),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
