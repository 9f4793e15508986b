/* Building: a stable sort by bucket in two steps, so that every write stays within a cache. First into partitions,
 * which are stretches of buckets, chunk of photons by chunk; then within each partition by counting. Chunks and
 * partitions depend on the number of photons only, and each step keeps the order of equals: so the result is the same
 * for any threads. */
#include "base/memory.h"
#include "math/numeric.h"
#include "photon/photon_cells.h"

#include <assert.h>
#include <string.h>

enum {
    MIN_BUCKET_BITS = 4,
    PARTITION_BUCKET_BITS = 12, /* buckets of a partition: with their photons about 150 KB */
    MAX_PARTITION_BITS = 10,    /* more streams of writes than this are slow */
    MIN_CHUNK = 8192,           /* photons */
    MAX_CHUNKS = 256,
    CACHE_LINE = 64
};

typedef struct photon_build {
    ca_photon_grid *grid;
    const ca_photon_run *runs;
    uint32_t run_count;
    uint32_t chunk_size, chunk_count;
    uint32_t partition_count, partition_shift; /* bucket >> shift is its partition */
    struct photon_bounds {
        ca_vec3 low, high;
    } bounds[MAX_CHUNKS];
} photon_build;

ca_status ca_photon_grid_create(ca_photon_grid **grid, ca_error *error)
{
    *grid = ca_alloc_zeroed(1, sizeof **grid);
    return *grid ? CA_OK : ca_fail_memory(error, "the photons");
}

void ca_photon_grid_destroy(ca_photon_grid *grid)
{
    if (!grid) return;
    ca_free(grid->starts);
    ca_free(grid->block_memory);
    ca_free(grid->partitioned);
    ca_free(grid->cursors);
    ca_free(grid->run_starts);
    ca_free(grid);
}

uint32_t ca_photon_grid_vertex(const ca_photon_grid *grid, uint32_t place)
{
    return grid->blocks[place / CA_PHOTON_LANES].vertex[place % CA_PHOTON_LANES];
}

ca_vec3 ca_photon_grid_position(const ca_photon_grid *grid, uint32_t place)
{
    const ca_photon_block *block = &grid->blocks[place / CA_PHOTON_LANES];
    const uint32_t lane = place % CA_PHOTON_LANES;
    return (ca_vec3){block->x[lane], block->y[lane], block->z[lane]};
}

void ca_photon_grid_answer_place(ca_photon_grid *grid, uint32_t place)
{
    grid->blocks[place / CA_PHOTON_LANES].vertex[place % CA_PHOTON_LANES] = place;
}

uint64_t ca_photon_grid_count(const ca_photon_grid *grid) { return grid->count; }

size_t ca_photon_grid_bytes(const ca_photon_grid *grid)
{
    return sizeof *grid + grid->start_capacity * sizeof *grid->starts + grid->block_capacity * sizeof *grid->blocks +
           grid->partitioned_capacity * sizeof *grid->partitioned + grid->cursor_capacity * sizeof *grid->cursors +
           grid->run_capacity * sizeof *grid->run_starts;
}

/* ---- Memory ---------------------------------------------------------------------------------------------------- */

/* Room for `needed` elements whose old values are of no use. */
static bool make_room(void **memory, size_t *capacity, size_t needed, size_t size)
{
    if (needed <= *capacity) return true;
    ca_free(*memory);
    *capacity = 0;
    needed += needed / 8; /* passes differ a little in their number of photons */
    *memory = ca_alloc_large(needed, size);
    if (!*memory) return false;
    *capacity = needed;
    return true;
}

static bool make_all_room(ca_photon_grid *grid, const photon_build *build, uint32_t count)
{
    const size_t buckets = (size_t)grid->lattice.bucket_mask + 1;
    const size_t blocks = count / CA_PHOTON_LANES + 2; /* one may begin within, one is for alignment */
    void *starts = grid->starts, *partitioned = grid->partitioned, *cursors = grid->cursors;
    const bool fits = make_room(&starts, &grid->start_capacity, buckets + 1, sizeof *grid->starts) &&
                      make_room(&grid->block_memory, &grid->block_capacity, blocks, sizeof *grid->blocks) &&
                      make_room(&partitioned, &grid->partitioned_capacity, count, sizeof *grid->partitioned) &&
                      make_room(&cursors, &grid->cursor_capacity, (size_t)build->chunk_count * build->partition_count,
                                sizeof *grid->cursors);
    grid->starts = starts;
    grid->partitioned = partitioned;
    grid->cursors = cursors;
    if (fits) {
        const uintptr_t memory = (uintptr_t)grid->block_memory;
        grid->blocks = (ca_photon_block *)((memory + CACHE_LINE - 1) / CACHE_LINE * CACHE_LINE);
    }
    return fits;
}

/* Numbers the photons through all runs. */
static ca_status number_runs(photon_build *build, uint32_t *count, ca_error *error)
{
    *count = 0;
    ca_photon_grid *grid = build->grid;
    void *run_starts = grid->run_starts;
    const bool fits = make_room(&run_starts, &grid->run_capacity, build->run_count, sizeof *grid->run_starts);
    grid->run_starts = run_starts;
    if (!fits) return ca_fail_memory(error, "the photons");
    uint64_t sum = 0;
    for (uint32_t i = 0; i < build->run_count; i++) {
        grid->run_starts[i] = (uint32_t)sum;
        sum += build->runs[i].count;
        if (sum > UINT32_MAX - 2 * CA_PHOTON_LANES)
            return ca_fail(error, CA_ERROR_UNSUPPORTED, NULL,
                           "a pass has 2^32 photons or more; trace fewer light paths per pass");
    }
    *count = (uint32_t)sum;
    return CA_OK;
}

/* ---- Walking through runs -------------------------------------------------------------------------------------- */

/* The photons of a chunk as pieces of runs. */
typedef struct chunk_walk {
    const photon_build *build;
    uint32_t run, next, end; /* photon numbers */
} chunk_walk;

static chunk_walk walk_chunk(const photon_build *build, uint32_t chunk)
{
    const uint32_t first = chunk * build->chunk_size;
    const uint32_t left = build->grid->count - first;
    uint32_t low = 0, high = build->run_count; /* the last run that starts at or before `first` */
    while (high - low > 1) {
        const uint32_t middle = low + (high - low) / 2;
        if (build->grid->run_starts[middle] <= first)
            low = middle;
        else
            high = middle;
    }
    return (chunk_walk){build, low, first, first + ca_min_u32(left, build->chunk_size)};
}

/* false at the end. */
static bool next_piece(chunk_walk *walk, ca_photon_run *piece)
{
    const photon_build *build = walk->build;
    while (walk->next < walk->end) {
        const ca_photon_run *run = &build->runs[walk->run];
        const uint32_t skipped = walk->next - build->grid->run_starts[walk->run++];
        if (skipped == run->count) continue; /* an empty run, or one that ends where the chunk begins */
        piece->photons = run->photons + skipped;
        piece->count = ca_min_u32(run->count - skipped, walk->end - walk->next);
        walk->next += piece->count;
        return true;
    }
    return false;
}

/* ---- The steps ------------------------------------------------------------------------------------------------- */

static void bound_chunk(void *user, uint32_t chunk, uint32_t worker)
{
    (void)worker;
    photon_build *build = user;
    struct photon_bounds bounds = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
    chunk_walk walk = walk_chunk(build, chunk);
    for (ca_photon_run piece; next_piece(&walk, &piece);)
        for (uint32_t i = 0; i < piece.count; i++) {
            assert(ca_is_finite3(piece.photons[i].position));
            bounds.low = ca_min_vec3(bounds.low, piece.photons[i].position);
            bounds.high = ca_max_vec3(bounds.high, piece.photons[i].position);
        }
    build->bounds[chunk] = bounds;
}

static void count_chunk(void *user, uint32_t chunk, uint32_t worker)
{
    (void)worker;
    const photon_build *build = user;
    const ca_photon_lattice lattice = build->grid->lattice;
    uint32_t *counts = build->grid->cursors + (size_t)chunk * build->partition_count;
    memset(counts, 0, build->partition_count * sizeof *counts);
    chunk_walk walk = walk_chunk(build, chunk);
    for (ca_photon_run piece; next_piece(&walk, &piece);)
        for (uint32_t i = 0; i < piece.count; i++)
            counts[ca_photon_bucket(&lattice, piece.photons[i].position) >> build->partition_shift]++;
}

static void partition_chunk(void *user, uint32_t chunk, uint32_t worker)
{
    (void)worker;
    const photon_build *build = user;
    const ca_photon_lattice lattice = build->grid->lattice;
    ca_photon *partitioned = build->grid->partitioned;
    uint32_t *cursors = build->grid->cursors + (size_t)chunk * build->partition_count;
    chunk_walk walk = walk_chunk(build, chunk);
    for (ca_photon_run piece; next_piece(&walk, &piece);)
        for (uint32_t i = 0; i < piece.count; i++) {
            const uint32_t bucket = ca_photon_bucket(&lattice, piece.photons[i].position);
            partitioned[cursors[bucket >> build->partition_shift]++] = piece.photons[i];
        }
}

/* From counts to places: partition by partition, within one chunk by chunk. */
static void place_chunks(const photon_build *build)
{
    uint32_t place = 0;
    for (uint32_t p = 0; p < build->partition_count; p++)
        for (uint32_t c = 0; c < build->chunk_count; c++) {
            uint32_t *cursor = &build->grid->cursors[(size_t)c * build->partition_count + p];
            const uint32_t count = *cursor;
            *cursor = place;
            place += count;
        }
}

/* The last chunk's cursors stand at the partitions' ends. */
static uint32_t partition_end(const photon_build *build, uint32_t partition)
{
    return build->grid->cursors[(size_t)(build->chunk_count - 1) * build->partition_count + partition];
}

static void sort_partition(void *user, uint32_t partition, uint32_t worker)
{
    (void)worker;
    const photon_build *build = user;
    ca_photon_grid *grid = build->grid;
    const ca_photon_lattice lattice = grid->lattice;
    const ca_photon *photons = grid->partitioned;
    uint32_t *starts = grid->starts;
    const uint32_t begin = partition ? partition_end(build, partition - 1) : 0, end = partition_end(build, partition);
    const uint32_t first_bucket = partition << build->partition_shift;
    const uint32_t bucket_count = UINT32_C(1) << build->partition_shift;
    memset(starts + first_bucket, 0, bucket_count * sizeof *starts);
    for (uint32_t i = begin; i < end; i++) starts[ca_photon_bucket(&lattice, photons[i].position)]++;
    uint32_t place = begin;
    for (uint32_t b = first_bucket; b < first_bucket + bucket_count; b++) starts[b] = place += starts[b];
    /* Each bucket's end moves down to its start as it fills, so the last photon comes first. */
    for (uint32_t i = end; i-- > begin;) {
        const uint32_t to = --starts[ca_photon_bucket(&lattice, photons[i].position)];
        ca_photon_block *block = &grid->blocks[to / CA_PHOTON_LANES];
        block->x[to % CA_PHOTON_LANES] = photons[i].position.x;
        block->y[to % CA_PHOTON_LANES] = photons[i].position.y;
        block->z[to % CA_PHOTON_LANES] = photons[i].position.z;
        block->vertex[to % CA_PHOTON_LANES] = photons[i].vertex;
    }
}

/* ---- All together ---------------------------------------------------------------------------------------------- */

static void set_cells(ca_photon_lattice *lattice, const struct photon_bounds *bounds, float radius)
{
    const ca_vec3 low = bounds->low, high = bounds->high;
    lattice->low[0] = (double)low.x, lattice->low[1] = (double)low.y, lattice->low[2] = (double)low.z;
    lattice->high[0] = (double)high.x, lattice->high[1] = (double)high.y, lattice->high[2] = (double)high.z;
    lattice->reach = ca_photon_reach(radius);
    /* Cells no finer than 2^-30 of the bounds, so that their numbers fit, and so much wider than two reaches that the
     * rounding of these numbers cannot make the difference. */
    double cell = 2.0 * lattice->reach * (1.0 + 0x1p-16);
    for (int axis = 0; axis < 3; axis++) cell = fmax(cell, 0x1p-30 * (lattice->high[axis] - lattice->low[axis]));
    lattice->cells_per_meter = 1.0 / cell;
}

static void find_bounds(photon_build *build, const ca_parallel *parallel)
{
    ca_parallel_for(parallel, build->chunk_count, bound_chunk, build);
    for (uint32_t c = 1; c < build->chunk_count; c++) {
        build->bounds[0].low = ca_min_vec3(build->bounds[0].low, build->bounds[c].low);
        build->bounds[0].high = ca_max_vec3(build->bounds[0].high, build->bounds[c].high);
    }
}

/* How the work is divided, by the number of photons alone. */
static void divide(photon_build *build, uint32_t count)
{
    uint32_t bits = MIN_BUCKET_BITS;
    while (bits < 31 && UINT32_C(1) << bits < count) bits++;
    build->grid->lattice.bucket_mask = (UINT32_C(1) << bits) - 1;
    uint32_t partition_bits = bits > PARTITION_BUCKET_BITS ? bits - PARTITION_BUCKET_BITS : 0;
    if (partition_bits > MAX_PARTITION_BITS) partition_bits = MAX_PARTITION_BITS;
    build->partition_count = UINT32_C(1) << partition_bits;
    build->partition_shift = bits - partition_bits;
    build->chunk_size = ca_max_u32(MIN_CHUNK, (count + MAX_CHUNKS - 1) / MAX_CHUNKS);
    build->chunk_count = (count + build->chunk_size - 1) / build->chunk_size;
}

ca_status ca_photon_grid_build(ca_photon_grid *grid, const ca_photon_run *runs, uint32_t run_count, float radius,
                               const ca_parallel *parallel, ca_error *error)
{
    assert(radius > 0.0f);
    photon_build build = {.grid = grid, .runs = runs, .run_count = run_count};
    grid->count = 0; /* until all is well */
    grid->radius = radius;
    grid->radius2 = radius * radius;
    uint32_t count;
    CA_TRY(number_runs(&build, &count, error));
    if (count == 0) return CA_OK;
    divide(&build, count);
    if (!make_all_room(grid, &build, count)) return ca_fail_memory(error, "the photons");
    grid->count = count;
    find_bounds(&build, parallel);
    set_cells(&grid->lattice, &build.bounds[0], radius);
    ca_parallel_for(parallel, build.chunk_count, count_chunk, &build);
    place_chunks(&build);
    ca_parallel_for(parallel, build.chunk_count, partition_chunk, &build);
    ca_parallel_for(parallel, build.partition_count, sort_partition, &build);
    grid->starts[(size_t)grid->lattice.bucket_mask + 1] = count;
    return CA_OK;
}
