/* Queries of a photon grid against a linear search, and against the same source without vector instructions. The
 * photons lie in an array, at most MAX_PHOTONS, and a photon's vertex is its number. Fails the test where they
 * differ. */
#ifndef CA_TEST_PHOTON_SEARCH_H
#define CA_TEST_PHOTON_SEARCH_H

#include "photon/photon_grid.h"
#include "support/test_random.h"

enum { MAX_PHOTONS = 40000 };

/* All vertices of a query in order: how many. *tested is the query's count. */
uint32_t photon_search(const ca_photon_grid *grid, ca_vec3 position, uint32_t *vertices, uint64_t *tested);

/* Both give back the number found; the second asks within a radius of its own, at most the grid's. */
uint32_t check_query(const ca_photon_grid *grid, const ca_photon *photons, uint32_t photon_count, float radius,
                     ca_vec3 position);
uint32_t check_query_within(const ca_photon_grid *grid, const ca_photon *photons, uint32_t photon_count,
                            float radius, ca_vec3 position);

/* Queries at photons, about a radius from them along an axis and elsewhere, and anywhere around; the sum of what they
 * find. */
uint32_t check_queries(const ca_photon_grid *grid, const ca_photon *photons, uint32_t count, float radius,
                       uint32_t queries, ca_test_random *random);

#endif
