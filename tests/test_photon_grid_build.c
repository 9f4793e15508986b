/* Builds of the photon grid: the same order for any number of threads and any division into runs, few photons tested
 * in vain, whatever the bounds; and its memory. That queries find what they should:
 * test_photon_grid.c. */
#include "base/memory.h"
#include "math/numeric.h"
#include "photon/photon_grid.h"
#include "support/photon_cloud.h"
#include "support/photon_search.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static ca_photon photons[MAX_PHOTONS];
static uint32_t found[MAX_PHOTONS], found_alone[MAX_PHOTONS];
static ca_test_random random_source;

static float uniform(void) { return ca_test_random_float(&random_source); }
static float between(float low, float high) { return low + (high - low) * uniform(); }
static uint32_t below(uint32_t limit) { return ca_test_random_u32(&random_source) % limit; }

/* ---- Order ----------------------------------------------------------------------------------------------------- */

/* Every query's vertices one after the other. */
static uint32_t *dump(const ca_photon_grid *grid, uint32_t *size)
{
    uint32_t *all = NULL, capacity = 0, used = 0;
    ca_test_random positions = ca_test_random_seed(7);
    for (uint32_t i = 0; i < 2000; i++) {
        const ca_vec3 p = {ca_test_random_float(&positions), ca_test_random_float(&positions), 0.5f};
        uint64_t tested;
        const uint32_t count = photon_search(grid, p, found, &tested);
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
        const uint32_t size = dump_below(grid, own, found_alone, &exact_alone);
        assert_in_range(size, 100, MAX_PHOTONS);
        for (uint32_t others = 1; own + others <= MAX_PHOTONS; others = 2 * others + below(100)) {
            starts[2] = own + others;
            assert_int_equal(build_pieces(grid, &(photon_pieces){photons, starts}, 2, &bounds, radii[k], 2), CA_OK);
            assert_int_equal(dump_below(grid, own, found, &exact), size);
            assert_memory_equal(found, found_alone, size * sizeof *found);
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
        check_query(grid, photons, 16, 0.3f, p);
        check_query_within(grid, photons, 16, 0.15f, p);
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
        assert_true(check_queries(grid, photons, 2000, 0.1f, 300, &random_source) > 60);
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
        photon_search(grid, (ca_vec3){between(0.1f, 0.9f), between(0.1f, 0.9f), 0.5f}, found, &tested);
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
        if (fresh_status != CA_OK) assert_int_equal(photon_search(fresh, photons[0].position, found, &tested), 0);
        build_grid(fresh, photons, 20000, 0.1f, 1);
        check_query(fresh, photons, 20000, 0.1f, photons[0].position);
        ca_photon_grid_destroy(fresh);
        if (status == CA_OK && fresh_status == CA_OK) break;
        assert_true(status == CA_ERROR_MEMORY || fresh_status == CA_ERROR_MEMORY);
        if (status != CA_OK) assert_int_equal(photon_search(grid, photons[0].position, found, &tested), 0);
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
    check_queries(grid, photons, MAX_PHOTONS, 0.005f, 20, &random_source);
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
    random_source = ca_test_random_seed(3);
    const struct CMUnitTest tests[] = {
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
