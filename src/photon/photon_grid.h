/* Photons by place: a counting sort into cells of two radii, so that a query looks at 2 x 2 x 2 of them.
 *
 * Cells are hashed into buckets, about as many as there are photons: photons lie on surfaces, which leave most of a
 * dense grid's cells empty. Cells that follow each other along x share a stretch of memory, so a query reads four
 * stretches. Photons of other cells in the same buckets fail the distance test like all that are too far.
 *
 * Order: a query finds photons cell by cell, within a cell in the order in which they were given. Cells depend on
 * the bounds and the radius only. So which other photons there are changes nothing of the order in which those of one
 * light path, or of one chunk of them, are found; nor do threads. Where two of a query's cells share a bucket
 * (seldom) each photon's own cell is asked for.
 *
 * Positions are finite. The bounds say where they are expected; those beyond share the cells of the border, which is
 * slow where they are many. The radius may be of any size. Cells are numbered in double precision from the bounds,
 * and the distance test is length2(photon - position) <= radius * radius in single precision.
 *
 * State: 16 bytes a photon, and 4 a bucket. Cost: 15 to 25 ns a photon to build, about 2 ns for each photon that a
 * query tests in a cached grid (bench/bench_photons.c). Threads: immutable between builds; the memory is kept from
 * build to build. A build that fails leaves the grid empty. */
#ifndef CA_PHOTON_PHOTON_GRID_H
#define CA_PHOTON_PHOTON_GRID_H

#include "base/parallel.h"
#include "base/status.h"
#include "math/vec.h"

#include <stdbool.h>

typedef struct ca_photon {
    ca_vec3 position;
    uint32_t vertex; /* whatever the caller needs to find it again */
} ca_photon;

_Static_assert(sizeof(ca_photon) == 16, "photon_grid.h promises 16 bytes a photon");

enum { CA_PHOTON_BATCH = 64 };

/* Photons, in order, run by run; a run is a part of the work that threads share. */
typedef struct ca_photon_source {
    const void *user;
    uint32_t run_count;
    uint64_t count; /* photons of all runs */
    /* The next up to CA_PHOTON_BATCH photons of a run, 0 at its end. *at is 0 at its start, and else the function's
     * own. Threads: called for different runs at once; every run is read twice and must be the same again. */
    uint32_t (*read)(const void *user, uint32_t run, uint64_t *at, ca_photon *photons);
} ca_photon_source;

typedef struct ca_photon_bounds {
    ca_vec3 low, high;
} ca_photon_bounds;

typedef struct ca_photon_grid ca_photon_grid;

ca_status ca_photon_grid_create(ca_photon_grid **grid, ca_error *error);
void ca_photon_grid_destroy(ca_photon_grid *grid); /* NULL is allowed */

/* Sorts the photons for queries of `radius` (> 0). */
ca_status ca_photon_grid_build(ca_photon_grid *grid, const ca_photon_source *source, const ca_photon_bounds *bounds,
                               float radius, const ca_parallel *parallel, ca_error *error);

/* A query is an iterator on the stack:
 *
 *     ca_photon_query query;
 *     ca_photon_query_start(&query, grid, position);
 *     while ((count = ca_photon_query_next(&query, vertices)) > 0) ...
 *
 * Finds every photon within the radius (distance <= radius) once. `query.tested`, from the start, counts those whose
 * distance is looked at in all. */
typedef struct ca_photon_query {
    const ca_photon_grid *grid;
    ca_vec3 position;
    float radius2;
    uint32_t begin[8], end[8]; /* ranges of photons; the current one begins where the next batch does */
    uint32_t range_count, range;
    bool exact;          /* only photons of the range's cell count */
    uint32_t cell[8][3]; /* where exact */
    uint64_t tested;
} ca_photon_query;

/* Asks the memory for what a query at this position will read first; for callers with something else to do
 * meanwhile. */
void ca_photon_grid_prefetch(const ca_photon_grid *grid, ca_vec3 position);
void ca_photon_query_start(ca_photon_query *query, const ca_photon_grid *grid, ca_vec3 position);
/* With a radius of its own, from zero to the grid's. */
void ca_photon_query_start_within(ca_photon_query *query, const ca_photon_grid *grid, ca_vec3 position, float radius);
/* Up to CA_PHOTON_BATCH vertices; 0 at the end. */
uint32_t ca_photon_query_next(ca_photon_query *query, uint32_t vertices[CA_PHOTON_BATCH]);

/* Distance from a position to its k-th nearest photon, 1 <= k <= CA_PHOTON_NEAREST_MAX, where at least k are within
 * the grid's radius; else INFINITY. The distance is then the square root of the k-th smallest length2(photon -
 * position). */
enum { CA_PHOTON_NEAREST_MAX = 64 };
float ca_photon_grid_nearest(const ca_photon_grid *grid, ca_vec3 position, uint32_t k);

/* What a grid of so many photons will hold: 16 bytes each, and 4 to 8 of buckets. */
double ca_photon_bytes(uint64_t count);
uint64_t ca_photon_grid_count(const ca_photon_grid *grid);
size_t ca_photon_grid_bytes(const ca_photon_grid *grid);

#endif
