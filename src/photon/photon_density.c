/* A hash table, probed one place after the other: at most half full, so that most cells are where they are looked for
 * first. */
#include "photon/photon_density.h"

#include "base/memory.h"
#include "math/numeric.h"
#include "photon/photon_cells.h"

#include <string.h>

enum { FIRST_PLACES = 64, BATCH = 16 };

typedef struct counted_cell {
    uint32_t mark;  /* of the cell */
    uint32_t count; /* 0: nobody's place */
} counted_cell;

struct ca_photon_density {
    ca_photon_lattice lattice;
    float area;           /* of a cell's side, m^2 */
    counted_cell *places; /* owned; a power of two of them; NULL: there are no photons */
    uint32_t mask;
};

/* ---- Counting -------------------------------------------------------------------------------------------------- */

/* Where a cell is looked for, and its mark. The mixing is the finaliser of MurmurHash3, which its author put into the
 * public domain. */
static inline uint64_t hash_of(const uint32_t *cell)
{
    uint64_t h = cell[0] * UINT64_C(0x9e3779b97f4a7c15) + cell[1] * UINT64_C(0xc2b2ae3d27d4eb4f) +
                 cell[2] * UINT64_C(0x165667b19e3779f9);
    h = (h ^ h >> 33) * UINT64_C(0xff51afd7ed558ccd);
    h = (h ^ h >> 33) * UINT64_C(0xc4ceb9fe1a85ec53);
    return h ^ h >> 33;
}

static inline uint32_t mark_of(uint64_t hash) { return (uint32_t)(hash >> 32); }

static inline counted_cell *first_place(const ca_photon_density *table, uint64_t hash)
{
    return &table->places[(uint32_t)hash & table->mask];
}

/* The cell's place, or the empty one that it would get. */
static inline counted_cell *find(const ca_photon_density *table, uint64_t hash)
{
    counted_cell *place = first_place(table, hash);
    const counted_cell *last = table->places + table->mask;
    while (place->count != 0 && place->mark != mark_of(hash)) place = place < last ? place + 1 : table->places;
    return place;
}

static uint64_t hash_of_photon(const ca_photon_lattice *lattice, const ca_photon_grid *grid, uint32_t photon)
{
    const ca_photon_block *block = &grid->blocks[photon / CA_PHOTON_LANES];
    const uint32_t lane = photon % CA_PHOTON_LANES;
    const uint32_t cell[3] = {ca_photon_cell(lattice, 0, (double)block->x[lane]),
                              ca_photon_cell(lattice, 1, (double)block->y[lane]),
                              ca_photon_cell(lattice, 2, (double)block->z[lane])};
    return hash_of(cell);
}

/* false: they have no room. */
static bool count_photons(ca_photon_density *table, const ca_photon_grid *grid)
{
    uint32_t used = 0;
    for (uint32_t i = 0; i < grid->count; i++) {
        const uint64_t hash = hash_of_photon(&table->lattice, grid, i);
        counted_cell *place = find(table, hash);
        used += place->count == 0;
        if (used > table->mask / 2) return false;
        place->mark = mark_of(hash);
        place->count++;
    }
    return true;
}

/* In ever larger tables, until one has room; false when out of memory. */
static bool count_in_room(ca_photon_density *table, const ca_photon_grid *grid)
{
    for (uint32_t places = FIRST_PLACES;; places *= 2) {
        ca_free(table->places);
        table->places = ca_alloc_zeroed(places, sizeof *table->places);
        table->mask = places - 1;
        if (!table->places) return false;
        if (count_photons(table, grid)) return true;
    }
}

/* The grid's cells begin at its lowest photon, on a floor, say: by rounding some points of the floor lie below it.
 * Cells that begin at other parts of their side cut no surface that is flat along an axis. */
static ca_photon_lattice shifted(const ca_photon_lattice *grid)
{
    static const double parts[3] = {0.382, 0.438, 0.471};
    ca_photon_lattice lattice = *grid;
    for (int axis = 0; axis < 3; axis++) {
        lattice.low[axis] -= parts[axis] / lattice.cells_per_meter;
        lattice.high[axis] += 1.0 / lattice.cells_per_meter;
    }
    return lattice;
}

/* Two radii, but for rounding; of a radius that is tiny beside the bounds the cells are wider. */
static float side_of_cells(const ca_photon_lattice *lattice, float radius)
{
    const double side = 1.0 / lattice->cells_per_meter, least = 2.0 * (double)radius;
    return (float)(side > 1.001 * least ? side : least);
}

ca_status ca_photon_density_create(ca_photon_density **density, const ca_photon_grid *grid, ca_error *error)
{
    ca_photon_density *table = *density = ca_alloc_zeroed(1, sizeof *table);
    if (!table) return ca_fail_memory(error, "the density of photons");
    if (grid->count == 0) return CA_OK;
    table->lattice = shifted(&grid->lattice);
    table->area = ca_sqr(side_of_cells(&table->lattice, grid->radius));
    if (!count_in_room(table, grid)) {
        ca_photon_density_destroy(table);
        *density = NULL;
        return ca_fail_memory(error, "the density of photons");
    }
    return CA_OK;
}

void ca_photon_density_destroy(ca_photon_density *density)
{
    if (!density) return;
    ca_free(density->places);
    ca_free(density);
}

/* ---- Lookup ---------------------------------------------------------------------------------------------------- */

/* false: no cell is there. */
static inline bool cell_at(const ca_photon_lattice *lattice, ca_vec3 position, uint32_t *cell)
{
    const double at[3] = {(double)position.x, (double)position.y, (double)position.z};
    bool inside = true;
    for (int axis = 0; axis < 3; axis++) {
        /* Beyond the last photon's cell there are none; below `low` truncation would not be floor. */
        cell[axis] = ca_photon_cell(lattice, axis, at[axis]);
        const double cells = (at[axis] - lattice->low[axis]) * lattice->cells_per_meter;
        inside &= at[axis] >= lattice->low[axis] && !(cells >= (double)cell[axis] + 1.0);
    }
    return inside;
}

/* Of at most BATCH positions; first all places are asked for, then they are read. */
static void look_up(const ca_photon_density *density, const ca_vec3 *positions, uint32_t count, float *densities)
{
    uint64_t hashes[BATCH];
    bool inside[BATCH];
    for (uint32_t i = 0; i < count; i++) {
        uint32_t cell[3];
        inside[i] = cell_at(&density->lattice, positions[i], cell);
        hashes[i] = hash_of(cell);
        __builtin_prefetch(first_place(density, hashes[i]));
    }
    for (uint32_t i = 0; i < count; i++)
        densities[i] = inside[i] ? (float)find(density, hashes[i])->count / density->area : 0.0f;
}

void ca_photon_density_at(const ca_photon_density *density, const ca_vec3 *positions, uint32_t count,
                          float *densities)
{
    for (uint32_t i = 0; i < count; i += BATCH) {
        const uint32_t size = ca_min_u32(BATCH, count - i);
        if (density->places) look_up(density, positions + i, size, densities + i);
        else memset(densities + i, 0, size * sizeof *densities);
    }
}
