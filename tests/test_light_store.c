/* The light store: paths of many workers at once come back whole, memory is kept, and running out of it is
 * reported. */
#include "base/memory.h"
#include "path/light_store.h"
#include "support/test_random.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

enum { PATHS = 20000 };

typedef struct filling {
    ca_light_store *store;
    uint32_t pass;
} filling;

/* Mostly short, now and then as long as can be; none at all for every seventh. */
static uint32_t length_of(uint32_t path, uint32_t pass)
{
    ca_test_random random = ca_test_random_seed(((uint64_t)pass << 32) + path);
    const uint32_t draw = ca_test_random_u32(&random) % 1000;
    if (path % 7 == 0) return 0;
    return draw == 0 ? CA_PATH_MAX_VERTICES : 1 + draw % 20;
}

static void fill_path(void *user, uint32_t path, uint32_t worker)
{
    const filling *f = user;
    ca_path_vertex *densities;
    ca_light_vertex *vertices;
    uint32_t first;
    if (!ca_light_store_path_begin(f->store, worker, &first, &densities, &vertices)) return;
    const uint32_t count = length_of(path, f->pass);
    for (uint32_t i = 0; i < count; i++) {
        vertices[i] = (ca_light_vertex){
            .point.shape = path, .first = first, .index = i & 0x1fff, .throughput = {.r = (float)f->pass}};
        densities[i] = (ca_path_vertex){.distance = (float)path, .to_previous = (float)i};
    }
    f->store->paths[path] = (ca_light_path){.first = first, .count = count};
    ca_light_store_path_end(f->store, worker, count);
}

static void fill(ca_light_store *store, uint32_t paths, uint32_t pass, uint32_t workers)
{
    filling f = {store, pass};
    const ca_parallel parallel = {.workers = workers};
    ca_parallel_for(&parallel, paths, fill_path, &f);
}

static void check(const ca_light_store *store, uint32_t paths, uint32_t pass)
{
    assert_int_equal(ca_light_store_check(store, NULL), CA_OK);
    for (uint32_t p = 0; p < paths; p++) {
        const ca_light_path *path = &store->paths[p];
        assert_int_equal(path->count, length_of(p, pass));
        for (uint32_t i = 0; i < path->count; i++) {
            const ca_light_vertex *vertex = ca_light_vertex_at(store, path->first + i);
            const ca_path_vertex *density = ca_light_density_at(store, path->first + i);
            assert_true(vertex->point.shape == p && vertex->first == path->first && vertex->index == i &&
                        vertex->throughput.r == (float)pass);
            assert_true(density->distance == (float)p && density->to_previous == (float)i);
            /* a path's densities are one array */
            assert_ptr_equal(density, ca_light_density_at(store, path->first) + i);
        }
    }
}

static void test_paths_come_back(void **state)
{
    (void)state;
    for (uint32_t workers = 1; workers <= 8; workers *= 2) {
        ca_light_store store;
        assert_int_equal(ca_light_store_create(&store, PATHS, workers, NULL), CA_OK);
        const size_t empty = ca_light_store_bytes(&store);
        for (uint32_t pass = 0; pass < 3; pass++) {
            ca_light_store_clear(&store);
            for (uint32_t p = 0; p < PATHS; p++) assert_int_equal(store.paths[p].count, 0);
            fill(&store, PATHS, pass, workers);
            check(&store, PATHS, pass);
        }
        assert_true(ca_light_store_bytes(&store) > empty + (size_t)PATHS * 120);
        ca_light_store_destroy(&store);
    }
}

static void test_memory_is_kept(void **state)
{
    (void)state;
    ca_light_store store;
    assert_int_equal(ca_light_store_create(&store, PATHS, 1, NULL), CA_OK);
    fill(&store, PATHS, 0, 1);
    const size_t bytes = ca_light_store_bytes(&store);
    ca_memory_fail_after(0); /* no allocation from here on */
    for (uint32_t pass = 0; pass < 3; pass++) {
        ca_light_store_clear(&store);
        fill(&store, pass == 1 ? 10 : PATHS, 0, 1);
        check(&store, pass == 1 ? 10 : PATHS, 0);
        assert_int_equal(ca_light_store_bytes(&store), bytes);
    }
    ca_memory_fail_after(-1);
    ca_light_store_destroy(&store);
}

/* A vertex' number tells its chunk, whatever worker made it; the next pass may divide the slabs otherwise. */
static void test_chunks(void **state)
{
    (void)state;
    enum { CHUNKS = 4, WORKERS = 3 };
    ca_light_store store;
    assert_int_equal(ca_light_store_create(&store, CHUNKS * PATHS, WORKERS, NULL), CA_OK);
    ca_test_random random = ca_test_random_seed(5);
    for (uint32_t pass = 0; pass < 2; pass++) {
        ca_light_store_clear(&store);
        for (uint32_t c = 0; c < CHUNKS; c++) {
            ca_light_store_begin_chunk(&store, c);
            filling f = {&store, pass};
            for (uint32_t p = 0; p < 1 + 1000 * (pass + c % 2); p++)
                fill_path(&f, c * PATHS + p, ca_test_random_u32(&random) % WORKERS);
        }
        for (uint32_t p = 0; p < CHUNKS * PATHS; p++)
            for (uint32_t i = 0; i < store.paths[p].count; i++)
                assert_int_equal(ca_light_chunk_of(&store, store.paths[p].first + i), p / PATHS);
    }
    ca_light_store_destroy(&store);
}

/* As many of the longest paths as were promised fit, by any worker, and no path reaches into its neighbour. */
static void test_longest_paths(void **state)
{
    (void)state;
    enum { LONG_PATHS = 103, WORKERS = 3 };
    ca_light_store store;
    assert_int_equal(ca_light_store_create(&store, LONG_PATHS, WORKERS, NULL), CA_OK);
    for (uint32_t p = 0; p < LONG_PATHS; p++) {
        ca_path_vertex *densities;
        ca_light_vertex *vertices;
        const uint32_t worker = p < 10 ? p % WORKERS : 1;
        assert_true(ca_light_store_path_begin(&store, worker, &store.paths[p].first, &densities, &vertices));
        for (uint32_t i = 0; i < CA_PATH_MAX_VERTICES; i++) vertices[i].point.shape = p;
        ca_light_store_path_end(&store, worker, CA_PATH_MAX_VERTICES);
    }
    for (uint32_t p = 0; p < LONG_PATHS; p++)
        for (uint32_t i = 0; i < CA_PATH_MAX_VERTICES; i++)
            assert_int_equal(ca_light_vertex_at(&store, store.paths[p].first + i)->point.shape, p);
    ca_light_store_destroy(&store);
}

static void test_out_of_slabs(void **state)
{
    (void)state;
    ca_light_store store;
    ca_error error;
    assert_int_equal(ca_light_store_create(&store, 4, 1, NULL), CA_OK);
    ca_path_vertex *densities;
    ca_light_vertex *vertices;
    uint32_t first, begun = 0;
    while (begun < 1000 && ca_light_store_path_begin(&store, 0, &first, &densities, &vertices)) {
        ca_light_store_path_end(&store, 0, CA_PATH_MAX_VERTICES);
        begun++;
    }
    assert_in_range(begun, 4, 100);
    assert_int_equal(ca_light_store_check(&store, &error), CA_ERROR_MEMORY);
    assert_false(ca_light_store_path_begin(&store, 0, &first, &densities, &vertices));
    ca_light_store_clear(&store);
    fill(&store, 4, 1, 1);
    check(&store, 4, 1);
    ca_light_store_destroy(&store);
}

static void test_allocation_failures(void **state)
{
    (void)state;
    ca_light_store store;
    ca_error error;
    for (long n = 0; n < 4; n++) {
        ca_memory_fail_after(n);
        assert_int_equal(ca_light_store_create(&store, 100, 2, &error), CA_ERROR_MEMORY);
        ca_memory_fail_after(-1);
        ca_light_store_destroy(&store); /* allowed after a failure */
    }
    for (long n = 0; n < 6; n++) {
        assert_int_equal(ca_light_store_create(&store, PATHS, 3, NULL), CA_OK);
        ca_memory_fail_after(n);
        fill(&store, PATHS, 2, 3);
        ca_memory_fail_after(-1);
        assert_int_equal(ca_light_store_check(&store, &error), CA_ERROR_MEMORY);
        if (n % 2) { /* the next pass finds memory again */
            ca_light_store_clear(&store);
            fill(&store, PATHS, 3, 3);
            check(&store, PATHS, 3);
        }
        ca_light_store_destroy(&store);
    }
}

static void test_failure_from_outside(void **state)
{
    (void)state;
    ca_light_store store;
    assert_int_equal(ca_light_store_create(&store, 10, 1, NULL), CA_OK);
    ca_light_store_fail(&store);
    assert_int_equal(ca_light_store_check(&store, NULL), CA_ERROR_MEMORY);
    ca_light_store_clear(&store);
    assert_int_equal(ca_light_store_check(&store, NULL), CA_OK);
    ca_light_store_destroy(&store);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_paths_come_back),     cmocka_unit_test(test_memory_is_kept),
        cmocka_unit_test(test_chunks),              cmocka_unit_test(test_longest_paths),
        cmocka_unit_test(test_out_of_slabs),        cmocka_unit_test(test_allocation_failures),
        cmocka_unit_test(test_failure_from_outside),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
