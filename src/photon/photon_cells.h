/* The inside of a photon grid, shared by its building (photon_grid.c) and its queries (photon_query.c).
 *
 * Cells count from the low corner of the bounds. Everything up to the cell's number is in double precision, where
 * each step is monotone in the coordinate, also that which takes what lies beyond the bounds to their border: a
 * photon within reach in exact numbers then lies in a cell from that of position - reach to that of position + reach,
 * and a cell is wide enough that these are neighbours at most. */
#ifndef CA_PHOTON_PHOTON_CELLS_H
#define CA_PHOTON_PHOTON_CELLS_H

#include "photon/photon_grid.h"

#include <math.h>
#include <stddef.h>

/* Eight photons, laid out for one vector instruction each. Photon i is lane i % 8 of block i / 8. */
enum { CA_PHOTON_LANES = 8 };

typedef struct ca_photon_block {
    float x[CA_PHOTON_LANES], y[CA_PHOTON_LANES], z[CA_PHOTON_LANES];
    uint32_t vertex[CA_PHOTON_LANES];
} ca_photon_block;

_Static_assert(sizeof(ca_photon_block) == 128, "a block is two cache lines");

/* Where the cells are. */
typedef struct ca_photon_lattice {
    double low[3], high[3]; /* the bounds */
    double cells_per_meter;
    double reach;         /* of the grid's radius */
    uint32_t bucket_mask; /* buckets are a power of two */
} ca_photon_lattice;

/* A worker's copy of the partition that it sorts. */
typedef struct ca_photon_scratch {
    ca_photon *photons; /* owned */
    size_t capacity;
} ca_photon_scratch;

struct ca_photon_grid {
    ca_photon_lattice lattice;
    float radius, radius2;
    uint32_t count;
    ca_photon_block *blocks; /* borrowed from block_memory, at the start of a cache line */
    uint32_t *starts;        /* owned; bucket b holds photons [starts[b], starts[b + 1]) */
    size_t start_capacity;
    void *block_memory; /* owned */
    size_t block_capacity;
    ca_photon_block *straddling; /* owned; at each partition's border, while they are sorted */
    size_t straddling_capacity;
    uint32_t *cursors; /* owned; photons of each task in each partition, then where they go */
    size_t cursor_capacity;
    ca_photon_scratch *scratch; /* owned; one a worker */
    size_t scratch_capacity;
};

/* No photon farther than this along an axis passes the distance test. The test is in single precision: the
 * difference, its square and the radius' are rounded once each, which the factor covers many times; the last term
 * covers squares that underflow. Where the radius' square overflows, everything is in reach. */
static inline double ca_photon_reach(float radius)
{
    return isinf(radius * radius) ? (double)INFINITY : (double)radius * (1.0 + 0x1p-20) + 0x1p-72;
}

/* Truncation is floor: coordinates are taken to the bounds, whose cells are below 2^31. What is no number is taken to
 * the low one. */
static inline uint32_t ca_photon_cell(const ca_photon_lattice *lattice, int axis, double coordinate)
{
    const double low = lattice->low[axis], high = lattice->high[axis];
    const double inside = coordinate > low ? (coordinate < high ? coordinate : high) : low;
    return (uint32_t)(int32_t)((inside - low) * lattice->cells_per_meter);
}

/* Cells that follow each other along x are neighbours in memory; rows of cells are strewn over the buckets. The
 * mixing is the finaliser of MurmurHash3, which its author put into the public domain. */
static inline uint32_t ca_photon_row(uint32_t cell_y, uint32_t cell_z)
{
    uint32_t h = cell_y * 0x9e3779b1u ^ cell_z * 0x85ebca77u;
    h = (h ^ h >> 16) * 0x85ebca6bu;
    h = (h ^ h >> 13) * 0xc2b2ae35u;
    return h ^ h >> 16;
}

static inline uint32_t ca_photon_bucket(const ca_photon_lattice *lattice, ca_vec3 position)
{
    const uint32_t row = ca_photon_row(ca_photon_cell(lattice, 1, (double)position.y),
                                       ca_photon_cell(lattice, 2, (double)position.z));
    return (row + ca_photon_cell(lattice, 0, (double)position.x)) & lattice->bucket_mask;
}

/* Which lanes of a block are of the cell of an exact query's current range. */
static inline uint32_t ca_photon_lanes_in_cell(const ca_photon_query *query, const ca_photon_block *block)
{
    const ca_photon_lattice *lattice = &query->grid->lattice;
    const uint32_t *cell = query->cell[query->range];
    uint32_t lanes = 0;
    for (uint32_t i = 0; i < CA_PHOTON_LANES; i++)
        lanes |= (uint32_t)(ca_photon_cell(lattice, 0, (double)block->x[i]) == cell[0] &&
                            ca_photon_cell(lattice, 1, (double)block->y[i]) == cell[1] &&
                            ca_photon_cell(lattice, 2, (double)block->z[i]) == cell[2])
                 << i;
    return lanes;
}

#endif
