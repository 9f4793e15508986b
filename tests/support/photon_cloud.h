/* Photon grids of photons in an array, and random places, for the tests of the grid. */
#ifndef CA_TEST_PHOTON_CLOUD_H
#define CA_TEST_PHOTON_CLOUD_H

#include "photon/photon_grid.h"
#include "support/test_random.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

/* In the cube from -half to half. */
static inline ca_vec3 random_point_of(ca_test_random *random, float half)
{
    const float x = ca_test_random_float(random), y = ca_test_random_float(random), z = ca_test_random_float(random);
    return ca_mul((ca_vec3){2.0f * x - 1.0f, 2.0f * y - 1.0f, 2.0f * z - 1.0f}, half);
}

static inline ca_photon_grid *create_grid(void)
{
    ca_photon_grid *grid;
    assert_int_equal(ca_photon_grid_create(&grid, NULL), CA_OK);
    return grid;
}

/* As one run; a photon's vertex is its number. */
static inline void build_grid(ca_photon_grid *grid, ca_photon *photons, uint32_t count, float radius,
                              uint32_t workers)
{
    for (uint32_t i = 0; i < count; i++) photons[i].vertex = i;
    const ca_photon_run run = {photons, count};
    const ca_parallel parallel = {.workers = workers};
    assert_int_equal(ca_photon_grid_build(grid, &run, 1, radius, &parallel, NULL), CA_OK);
    assert_int_equal(ca_photon_grid_count(grid), count);
}

#endif
