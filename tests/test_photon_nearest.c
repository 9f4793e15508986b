/* The photon grid's answers about single photons, against a linear search: the k-th nearest one. */
#include "math/numeric.h"
#include "photon/photon_grid.h"
#include "support/photon_cloud.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { MAX_PHOTONS = 5000 };
static ca_photon photons[MAX_PHOTONS];
static ca_test_random random_source;

static float uniform(void) { return ca_test_random_float(&random_source); }
static uint32_t below(uint32_t limit) { return ca_test_random_u32(&random_source) % limit; }

/* ---- The nearest photons --------------------------------------------------------------------------------------- */

static int by_size(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* Returns how many of all k had an answer. */
static uint32_t check_nearest(const ca_photon_grid *grid, uint32_t photon_count, float radius, ca_vec3 position)
{
    static float distance2[MAX_PHOTONS];
    uint32_t within = 0;
    for (uint32_t i = 0; i < photon_count; i++) {
        distance2[within] = ca_length2(ca_sub(photons[i].position, position));
        within += distance2[within] <= radius * radius;
    }
    qsort(distance2, within, sizeof *distance2, by_size);
    for (uint32_t k = 1; k <= CA_PHOTON_NEAREST_MAX; k++) {
        const float nearest = ca_photon_grid_nearest(grid, position, k);
        const float expected = k <= within ? sqrtf(distance2[k - 1]) : INFINITY;
        if (nearest != expected)
            fail_msg("photon %u of %u is %a away, not %a", k, within, (double)expected, (double)nearest);
    }
    return ca_min_u32(within, CA_PHOTON_NEAREST_MAX);
}

static void test_nearest(void **state)
{
    (void)state;
    ca_photon_grid *grid = create_grid();
    assert_true(isinf(ca_photon_grid_nearest(grid, (ca_vec3){0, 0, 0}, 1)));
    for (uint32_t i = 0; i < 3000; i++) photons[i].position = (ca_vec3){uniform(), uniform(), 0.1f * uniform()};
    for (uint32_t i = 0; i < 300; i++) photons[i].position = photons[300 + i / 10].position; /* equal distances */
    static const float radii[] = {0.01f, 0.05f, 0.3f};
    uint32_t answered[3] = {0, 0, 0};
    for (size_t r = 0; r < 3; r++) {
        build_grid(grid, photons, 3000, radii[r], 1);
        for (uint32_t i = 0; i < 200; i++) {
            const ca_vec3 p = i % 2 ? photons[below(300)].position
                                    : ca_add(random_point_of(&random_source, 0.6f), (ca_vec3){0.5f, 0.5f, 0});
            answered[r] += check_nearest(grid, 3000, radii[r], p);
        }
    }
    /* all, some and hardly any of the answers are numbers */
    assert_in_range(answered[0], 500, 3000);
    assert_in_range(answered[1], 1500, 9000);
    assert_in_range(answered[2], 9000, 12800);
    for (uint32_t i = 0; i < 70; i++) photons[i].position = (ca_vec3){1, 2, 3};
    build_grid(grid, photons, 70, 0.1f, 1);
    check_nearest(grid, 70, 0.1f, (ca_vec3){1, 2, 3.1f});
    check_nearest(grid, 70, 0.1f, (ca_vec3){1, 2.05f, 3});
    build_grid(grid, photons, 70, 0.5f, 1);
    assert_int_equal(check_nearest(grid, 70, 0.5f, (ca_vec3){1, 2.5f, 3}), CA_PHOTON_NEAREST_MAX); /* on the rim */
    ca_photon_grid_destroy(grid);
}

/* Of 16 buckets a query's cells share some; a photon counts once. */
static void test_nearest_of_few(void **state)
{
    (void)state;
    ca_photon_grid *grid = create_grid();
    for (uint32_t i = 0; i < 16; i++) photons[i].position = random_point_of(&random_source, 1.0f);
    build_grid(grid, photons, 16, 0.4f, 1);
    uint32_t answered = 0;
    for (uint32_t i = 0; i < 2000; i++)
        answered += check_nearest(grid, 16, 0.4f, random_point_of(&random_source, 1.0f));
    assert_in_range(answered, 500, 2000 * 16);
    ca_photon_grid_destroy(grid);
}

int main(void)
{
    random_source = ca_test_random_seed(1);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_nearest),
        cmocka_unit_test(test_nearest_of_few),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
