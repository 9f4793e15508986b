/* The density of photons against counts that are known: photons are laid into numbered cells. */
#include "base/memory.h"
#include "math/numeric.h"
#include "photon/photon_density.h"
#include "support/photon_cloud.h"

#include <float.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

enum { MAX_PHOTONS = 40000, SIDE = 12, CELLS = SIDE * SIDE * SIDE };
static ca_photon photons[MAX_PHOTONS];
static ca_test_random random_source;

static float uniform(void) { return ca_test_random_float(&random_source); }
static float between(float low, float high) { return low + (high - low) * uniform(); }

/* Of the first `count` photons. */
static ca_photon_density *create_density(uint32_t count, float radius)
{
    ca_photon_grid *grid = create_grid();
    build_grid(grid, photons, count, radius, 1);
    ca_photon_density *density;
    ca_error error;
    assert_int_equal(ca_photon_density_create(&density, grid, &error), CA_OK);
    ca_photon_grid_destroy(grid);
    return density;
}

static float density_at(const ca_photon_density *density, float x, float y, float z)
{
    float found;
    ca_photon_density_at(density, &(ca_vec3){x, y, z}, 1, &found);
    return found;
}

static void test_plane(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < MAX_PHOTONS; i++)
        photons[i].position = (ca_vec3){2.0f * uniform(), 2.0f * uniform(), 0.5f};
    ca_photon_density *density = create_density(MAX_PHOTONS, 0.1f);
    double sum = 0.0;
    for (int i = 0; i < 1000; i++) {
        const float found = density_at(density, between(0.13f, 1.9f), between(0.13f, 1.9f), 0.5f);
        assert_true(found > 7500.0f && found < 12500.0f); /* 10000 photons per m^2, 400 a cell */
        sum += (double)found;
    }
    assert_true(fabs(sum / 1000.0 - 10000.0) < 200.0);
    assert_true(density_at(density, 1, 1, 0.8f) == 0.0f);
    assert_true(density_at(density, 1, 1, 0.4f) == 0.0f);
    assert_true(density_at(density, 5, 1, 0.5f) == 0.0f);
    ca_photon_density_destroy(density);
}

/* Points of a floor, or of a ceiling, are in the same cells as its photons, on whichever side of them rounding has
 * put them. */
static void test_rounded_plane(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < MAX_PHOTONS; i++)
        photons[i].position = (ca_vec3){2.0f * uniform(), i % 2 ? 0.0f : 3.0f, 2.0f * uniform()};
    ca_photon_density *density = create_density(MAX_PHOTONS, 0.1f);
    for (int i = 0; i < 1000; i++) {
        const float x = between(0.0f, 2.0f), z = between(0.0f, 2.0f), off = i % 4 < 2 ? -1e-6f : 1e-6f;
        const float y = i % 2 ? 0.0f : 3.0f;
        assert_true(density_at(density, x, y, z) > 0.0f);
        assert_true(density_at(density, x, y + off, z) == density_at(density, x, y, z));
    }
    ca_photon_density_destroy(density);
}

/* Cells of sides 1 begin at a part of a side before the lowest photon: it lies in none of these. */
static const ca_vec3 first_cell = {1.0f - 0.382f, 1.0f - 0.438f, 1.0f - 0.471f};

/* The middle of a cell, or a place near it. */
static ca_vec3 inside_cell(uint32_t cell, float range)
{
    const uint32_t x = cell % SIDE, y = cell / SIDE % SIDE, z = cell / (SIDE * SIDE);
    const ca_vec3 middle = {(float)x + 0.5f + between(-range, range), (float)y + 0.5f + between(-range, range),
                            (float)z + 0.5f + between(-range, range)};
    return ca_add(first_cell, middle);
}

/* Every cell has its own count, whatever else lies in the table; all at once find the same as one by one. */
static void test_counts_of_cells(void **state)
{
    (void)state;
    static uint32_t counts[CELLS];
    static ca_vec3 positions[CELLS];
    static float found[CELLS];
    uint32_t count = 0;
    photons[count++].position = (ca_vec3){0, 0, 0}; /* the bounds begin here */
    for (uint32_t cell = 0; cell < CELLS; cell++)
        for (uint32_t k = cell % 3 == 0 ? 0 : cell % 31; k > 0; k--) {
            photons[count++].position = inside_cell(cell, 0.49f);
            counts[cell]++;
        }
    ca_photon_density *density = create_density(count, 0.5f);
    for (uint32_t cell = 0; cell < CELLS; cell++) positions[cell] = inside_cell(cell, 0.49f);
    for (uint32_t size = CELLS; size > 0; size = size * 2 / 3) {
        memset(found, 0xff, sizeof found);
        ca_photon_density_at(density, positions, size, found);
        for (uint32_t cell = 0; cell < size; cell++) assert_true(found[cell] == (float)counts[cell]);
        if (size < CELLS) assert_true(isnan(found[size]));
    }
    ca_photon_density_destroy(density);
}

/* Cells that begin their search at the same place do not share their density. */
static void test_is_of_one_cell(void **state)
{
    (void)state;
    photons[0].position = (ca_vec3){0, 0, 0};
    photons[1].position = (ca_vec3){1, 1, 1};
    ca_photon_density *density = create_density(2, 0.005f);
    for (uint32_t i = 0; i < 1000; i++) {
        float p[3] = {0.001f, 0.001f, 0.001f};
        assert_true(density_at(density, p[0], p[1], p[2]) > 9999.0f);
        p[i % 3] = between(0.02f, 1.0f);
        assert_true(density_at(density, p[0], p[1], p[2]) == 0.0f);
    }
    ca_photon_density_destroy(density);
}

static void test_nowhere(void **state)
{
    (void)state;
    ca_photon_density *density = create_density(0, 1.0f);
    assert_true(density_at(density, 0, 0, 0) == 0.0f);
    ca_photon_density_destroy(density);
    for (uint32_t i = 0; i < 1000; i++) photons[i].position = random_point_of(&random_source, 1.0f);
    density = create_density(1000, 0.1f);
    const float odd[] = {NAN, INFINITY, -INFINITY, FLT_MAX, -FLT_MAX};
    for (int k = 0; k < 15; k++) {
        float p[3] = {0, 0, 0};
        p[k % 3] = odd[k / 3];
        assert_true(density_at(density, p[0], p[1], p[2]) == 0.0f);
    }
    ca_photon_density_destroy(density);
    ca_photon_density_destroy(NULL);
}

static void test_allocation_failures(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < 1000; i++) photons[i].position = random_point_of(&random_source, 1.0f);
    ca_photon_grid *grid = create_grid();
    build_grid(grid, photons, 1000, 0.01f, 1);
    ca_photon_density *density;
    ca_error error;
    long failures = 0;
    for (ca_status status = CA_ERROR_MEMORY; status != CA_OK; failures++) {
        ca_memory_fail_after(failures);
        status = ca_photon_density_create(&density, grid, &error);
        ca_memory_fail_after(-1);
        if (status == CA_OK) break;
        assert_int_equal(status, CA_ERROR_MEMORY);
        assert_null(density);
    }
    assert_int_equal(failures, 1 + 6); /* 64 places to begin with, 2048 at the end */
    ca_photon_density_destroy(density);
    ca_photon_grid_destroy(grid);
}

int main(void)
{
    random_source = ca_test_random_seed(1);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_plane),
        cmocka_unit_test(test_rounded_plane),
        cmocka_unit_test(test_counts_of_cells),
        cmocka_unit_test(test_is_of_one_cell),
        cmocka_unit_test(test_nowhere),
        cmocka_unit_test(test_allocation_failures),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
