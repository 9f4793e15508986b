/* The photon grid against a linear search: the same photons, each once, wherever they lie and however large the
 * radius is. What does not depend on how it was built: test_photon_grid_build.c. */
#include "math/numeric.h"
#include "photon/photon_grid.h"
#include "support/photon_cloud.h"
#include "support/photon_search.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

static ca_photon photons[MAX_PHOTONS];
static uint32_t found[MAX_PHOTONS];
static ca_test_random random_source;

static float uniform(void) { return ca_test_random_float(&random_source); }
static float between(float low, float high) { return low + (high - low) * uniform(); }
static uint32_t below(uint32_t limit) { return ca_test_random_u32(&random_source) % limit; }

static void check_cloud(uint32_t count, float radius, uint32_t queries)
{
    ca_photon_grid *grid = create_grid();
    build_grid(grid, photons, count, radius, 2);
    const uint32_t met_sum = check_queries(grid, photons, count, radius, queries, &random_source);
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
        check_query(grid, photons, 1000, radius, (ca_vec3){p[0], p[1], p[2]});
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
    assert_int_equal(photon_search(grid, (ca_vec3){1.005f, 2, 3}, found, &tested), 30000);
    assert_int_equal(tested, 30000);
    for (uint32_t i = 0; i < 30000; i++) assert_int_equal(found[i], i);
    assert_int_equal(photon_search(grid, (ca_vec3){1.02f, 2, 3}, found, &tested), 0);
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
        assert_int_equal(photon_search(grid, (ca_vec3){p[0], p[1], p[2]}, found, &tested), 0);
    }
    ca_photon_grid_destroy(grid);
}

/* ---- A radius of the query's own ------------------------------------------------------------------------------- */

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
        if (ca_is_finite3(p)) met_sum += check_query_within(grid, photons, count, own, p);
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
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
