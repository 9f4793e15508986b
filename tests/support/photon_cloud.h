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

/* Photons in an array, in pieces of any sizes; *at: how many of a piece are read. */
typedef struct photon_pieces {
    const ca_photon *photons;
    const uint32_t *starts; /* of each piece, and the end of the last */
} photon_pieces;

static inline uint32_t read_piece(const void *user, uint32_t run, uint64_t *at, ca_photon *photons)
{
    const photon_pieces *pieces = user;
    const uint32_t begin = pieces->starts[run] + (uint32_t)*at, left = pieces->starts[run + 1] - begin;
    const uint32_t count = left < CA_PHOTON_BATCH ? left : CA_PHOTON_BATCH;
    for (uint32_t i = 0; i < count; i++) photons[i] = pieces->photons[begin + i];
    *at += count;
    return count;
}

static inline ca_photon_bounds bounds_of(const ca_photon *photons, uint32_t count)
{
    ca_photon_bounds bounds = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
    for (uint32_t i = 0; i < count; i++) {
        bounds.low = ca_min_vec3(bounds.low, photons[i].position);
        bounds.high = ca_max_vec3(bounds.high, photons[i].position);
    }
    return bounds;
}

static inline ca_status build_pieces(ca_photon_grid *grid, const photon_pieces *pieces, uint32_t piece_count,
                                     const ca_photon_bounds *bounds, float radius, uint32_t workers)
{
    const ca_photon_source source = {pieces, piece_count, pieces->starts[piece_count], read_piece};
    const ca_parallel parallel = {.workers = workers};
    return ca_photon_grid_build(grid, &source, bounds, radius, &parallel, NULL);
}

enum { CLOUD_PIECES = 7 };

/* As a few runs, within the photons' own bounds. */
static inline ca_status try_build_grid(ca_photon_grid *grid, const ca_photon *photons, uint32_t count, float radius,
                                       uint32_t workers)
{
    uint32_t starts[CLOUD_PIECES + 1];
    for (uint32_t i = 0; i <= CLOUD_PIECES; i++) starts[i] = (uint32_t)((uint64_t)count * i / CLOUD_PIECES);
    const ca_photon_bounds bounds = bounds_of(photons, count);
    return build_pieces(grid, &(photon_pieces){photons, starts}, CLOUD_PIECES, &bounds, radius, workers);
}

/* A photon's vertex is its number. */
static inline void build_grid(ca_photon_grid *grid, ca_photon *photons, uint32_t count, float radius,
                              uint32_t workers)
{
    for (uint32_t i = 0; i < count; i++) photons[i].vertex = i;
    assert_int_equal(try_build_grid(grid, photons, count, radius, workers), CA_OK);
    assert_int_equal(ca_photon_grid_count(grid), count);
}

#endif
