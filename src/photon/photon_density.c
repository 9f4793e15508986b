/* A hash table of cells, probed one after the other: at most half full, so that most cells are where they are looked
 * for first. */
#include "photon/photon_density.h"

#include "base/memory.h"
#include "math/numeric.h"
#include "photon/photon_cells.h"

#include <string.h>

enum { FIRST_PLACES = 64, BATCH = 16 };

typedef struct counted_cell {
    uint32_t cell[3];
    uint32_t count; /* 0: nobody's place */
} counted_cell;

struct ca_photon_density {
    ca_photon_lattice lattice;
    float area;           /* of a cell's side, m^2 */
    counted_cell *places; /* owned; a power of two of them; NULL: there are no photons */
    uint32_t mask, used;
};

/* ---- Counting -------------------------------------------------------------------------------------------------- */

static inline bool is_of(const counted_cell *place, const uint32_t *cell)
{
    return place->cell[0] == cell[0] && place->cell[1] == cell[1] && place->cell[2] == cell[2];
}

/* Where the cell is looked for first. */
static inline counted_cell *first_place(const ca_photon_density *table, const uint32_t *cell)
{
    return &table->places[(ca_photon_row(cell[1], cell[2]) + cell[0]) & table->mask];
}

/* The cell's place, or the empty one that it would get. */
static inline counted_cell *find(const ca_photon_density *table, const uint32_t *cell)
{
    counted_cell *place = first_place(table, cell);
    const counted_cell *last = table->places + table->mask;
    while (place->count != 0 && !is_of(place, cell)) place = place < last ? place + 1 : table->places;
    return place;
}

static void add(ca_photon_density *table, const uint32_t *cell, uint32_t count)
{
    counted_cell *place = find(table, cell);
    if (place->count == 0) {
        *place = (counted_cell){.cell = {cell[0], cell[1], cell[2]}};
        table->used++;
    }
    place->count += count;
}

/* Room for twice as many; false when out of memory. */
static bool grow(ca_photon_density *table)
{
    const uint32_t before = table->places ? table->mask + 1 : 0, after = before ? 2 * before : FIRST_PLACES;
    counted_cell *old = table->places, *places = ca_alloc_zeroed(after, sizeof *places);
    if (!places) return false;
    table->places = places;
    table->mask = after - 1;
    table->used = 0;
    for (uint32_t i = 0; i < before; i++)
        if (old[i].count != 0) add(table, old[i].cell, old[i].count);
    ca_free(old);
    return true;
}

/* false when out of memory. */
static bool count_photons(ca_photon_density *table, const ca_photon_grid *grid)
{
    if (!grow(table)) return false;
    for (uint32_t i = 0; i < grid->count; i++) {
        const ca_photon_block *block = &grid->blocks[i / CA_PHOTON_LANES];
        const uint32_t lane = i % CA_PHOTON_LANES;
        const uint32_t cell[3] = {ca_photon_cell(&table->lattice, 0, (double)block->x[lane]),
                                  ca_photon_cell(&table->lattice, 1, (double)block->y[lane]),
                                  ca_photon_cell(&table->lattice, 2, (double)block->z[lane])};
        add(table, cell, 1);
        if (table->used > table->mask / 2 && !grow(table)) return false;
    }
    return true;
}

ca_status ca_photon_density_create(ca_photon_density **density, const ca_photon_grid *grid, ca_error *error)
{
    ca_photon_density *table = *density = ca_alloc_zeroed(1, sizeof *table);
    if (!table) return ca_fail_memory(error, "the density of photons");
    if (grid->count == 0) return CA_OK;
    table->lattice = grid->lattice;
    table->area = ca_sqr(2.0f * grid->radius);
    if (!count_photons(table, grid)) {
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
    uint32_t cells[BATCH][3];
    bool inside[BATCH];
    for (uint32_t i = 0; i < count; i++) {
        inside[i] = cell_at(&density->lattice, positions[i], cells[i]);
        __builtin_prefetch(first_place(density, cells[i]));
    }
    for (uint32_t i = 0; i < count; i++)
        densities[i] = inside[i] ? (float)find(density, cells[i])->count / density->area : 0.0f;
}

void ca_photon_density_at(const ca_photon_density *density, const ca_vec3 *positions, uint32_t count, float *densities)
{
    for (uint32_t i = 0; i < count; i += BATCH) {
        const uint32_t size = ca_min_u32(BATCH, count - i);
        if (density->places) look_up(density, positions + i, size, densities + i);
        else memset(densities + i, 0, size * sizeof *densities);
    }
}
