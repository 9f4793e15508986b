#include "support/photon_search.h"

#include "math/numeric.h"
#include "support/photon_cloud.h"

#include <stdlib.h>
#include <string.h>

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

static uint32_t found[MAX_PHOTONS], found_plain[MAX_PHOTONS];
static uint8_t met[MAX_PHOTONS];

uint32_t photon_search(const ca_photon_grid *grid, ca_vec3 position, uint32_t *vertices, uint64_t *tested)
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

uint32_t check_query(const ca_photon_grid *grid, const ca_photon *photons, uint32_t photon_count, float radius,
                     ca_vec3 position)
{
    uint64_t tested;
    const uint32_t count = photon_search(grid, position, found, &tested);
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

uint32_t check_queries(const ca_photon_grid *grid, const ca_photon *photons, uint32_t count, float radius,
                       uint32_t queries, ca_test_random *random)
{
    uint32_t met_sum = 0;
    for (uint32_t i = 0; i < queries; i++) {
        ca_vec3 p = photons[ca_test_random_u32(random) % count].position;
        float *axis = i % 3 == 0 ? &p.x : i % 3 == 1 ? &p.y : &p.z;
        switch (i % 5) {
        case 0: break;
        case 1: *axis += radius; break;
        case 2: *axis = ca_next_down(*axis - radius); break;
        case 3: p = ca_madd(p, radius, random_point_of(random, 1.0f)); break;
        default: p = ca_madd(p, ca_test_random_float(random) * 100.0f * radius, random_point_of(random, 1.0f)); break;
        }
        if (ca_is_finite3(p)) met_sum += check_query(grid, photons, count, radius, p);
    }
    return met_sum;
}

static int by_vertex(const void *a, const void *b)
{
    const uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

uint32_t check_query_within(const ca_photon_grid *grid, const ca_photon *photons, uint32_t photon_count, float radius,
                            ca_vec3 position)
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
