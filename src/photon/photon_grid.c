/* Building: a stable sort by bucket in two steps, so that every write stays within a cache. First into partitions,
 * which are stretches of buckets, task by task; then within each partition by counting, from a copy of it back into
 * its place. What tasks and partitions are depends on the number of runs and photons only, and each step keeps the
 * order of equals: so the result is the same for any threads, and for any division into runs. */
#include "base/memory.h"
#include "math/numeric.h"
#include "photon/photon_cells.h"

#include <assert.h>
#include <string.h>

enum {
    MIN_BUCKET_BITS = 4,
    PARTITION_BUCKET_BITS = 12, /* buckets of a partition: with their photons about 150 KB */
    MAX_PARTITION_BITS = 10,    /* more streams of writes than this are slow */
    MAX_TASKS = 256,
    CACHE_LINE = 64
};

typedef struct photon_build {
    ca_photon_grid *grid;
    const ca_photon_source *source;
    uint32_t task_runs, task_count;
    uint32_t partition_count, partition_shift; /* bucket >> shift is its partition */
    bool failed;                               /* atomic: out of memory */
} photon_build;

ca_status ca_photon_grid_create(ca_photon_grid **grid, ca_error *error)
{
    *grid = ca_alloc_zeroed(1, sizeof **grid);
    return *grid ? CA_OK : ca_fail_memory(error, "the photons");
}

void ca_photon_grid_destroy(ca_photon_grid *grid)
{
    if (!grid) return;
    for (size_t i = 0; i < grid->scratch_capacity; i++) ca_free(grid->scratch[i].photons);
    ca_free(grid->scratch);
    ca_free(grid->starts);
    ca_free(grid->block_memory);
    ca_free(grid->straddling);
    ca_free(grid->cursors);
    ca_free(grid);
}

uint64_t ca_photon_grid_count(const ca_photon_grid *grid) { return grid->count; }

/* Buckets are a power of two, as many as photons or a little more. */
static uint32_t bucket_bits(uint64_t count)
{
    uint32_t bits = MIN_BUCKET_BITS;
    while (bits < 31 && UINT64_C(1) << bits < count) bits++;
    return bits;
}

double ca_photon_bytes(uint64_t count)
{
    return (double)count * sizeof(ca_photon) + ldexp(sizeof(uint32_t), (int)bucket_bits(count));
}

size_t ca_photon_grid_bytes(const ca_photon_grid *grid)
{
    size_t scratch = grid->scratch_capacity * sizeof *grid->scratch;
    for (size_t i = 0; i < grid->scratch_capacity; i++)
        scratch += grid->scratch[i].capacity * sizeof *grid->scratch[i].photons;
    return sizeof *grid + grid->start_capacity * sizeof *grid->starts + grid->block_capacity * sizeof *grid->blocks +
           grid->straddling_capacity * sizeof *grid->straddling + grid->cursor_capacity * sizeof *grid->cursors +
           scratch;
}

/* ---- Memory ---------------------------------------------------------------------------------------------------- */

/* Room for `needed` elements whose old values are of no use. */
static bool make_room(void **memory, size_t *capacity, size_t needed, size_t size)
{
    if (needed <= *capacity) return true;
    ca_free(*memory);
    *memory = NULL;
    *capacity = 0;
    needed += needed / 16; /* passes differ a little in their number of photons */
    *memory = ca_alloc_large(needed, size);
    if (!*memory) return false;
    *capacity = needed;
    return true;
}

static bool make_partition_room(ca_photon_scratch *scratch, size_t needed)
{
    void *photons = scratch->photons;
    const bool fits = make_room(&photons, &scratch->capacity, needed, sizeof *scratch->photons);
    scratch->photons = photons;
    return fits;
}

/* Each worker that meets a partition has room for twice what partitions hold on average; it makes more where photons
 * are crowded. */
static bool make_scratch(ca_photon_grid *grid, const photon_build *build, uint32_t workers)
{
    if (workers > grid->scratch_capacity) {
        ca_photon_scratch *scratch = ca_alloc_zeroed(workers, sizeof *scratch);
        if (!scratch) return false;
        for (size_t i = 0; i < grid->scratch_capacity; i++) scratch[i] = grid->scratch[i];
        ca_free(grid->scratch);
        grid->scratch = scratch;
        grid->scratch_capacity = workers;
    }
    bool fits = true;
    for (uint32_t i = 0; i < workers && i < build->partition_count; i++)
        fits &= make_partition_room(&grid->scratch[i], (size_t)2 << build->partition_shift);
    return fits;
}

static bool make_all_room(ca_photon_grid *grid, const photon_build *build, uint32_t count, uint32_t workers)
{
    const size_t buckets = (size_t)grid->lattice.bucket_mask + 1;
    const size_t blocks = count / CA_PHOTON_LANES + 2; /* one may begin within, one is for alignment */
    void *starts = grid->starts, *straddling = grid->straddling, *cursors = grid->cursors;
    const bool fits = make_room(&starts, &grid->start_capacity, buckets + 1, sizeof *grid->starts) &&
                      make_room(&grid->block_memory, &grid->block_capacity, blocks, sizeof *grid->blocks) &&
                      make_room(&straddling, &grid->straddling_capacity, build->partition_count,
                                sizeof *grid->straddling) &&
                      make_room(&cursors, &grid->cursor_capacity, (size_t)build->task_count * build->partition_count,
                                sizeof *grid->cursors);
    grid->starts = starts;
    grid->straddling = straddling;
    grid->cursors = cursors;
    if (!fits || !make_scratch(grid, build, workers)) return false;
    const uintptr_t memory = (uintptr_t)grid->block_memory;
    grid->blocks = (ca_photon_block *)((memory + CACHE_LINE - 1) / CACHE_LINE * CACHE_LINE);
    return true;
}

/* ---- Into partitions ------------------------------------------------------------------------------------------- */

/* A task's runs. */
typedef struct task_walk {
    const ca_photon_source *source;
    uint32_t run, end;
    uint64_t at;
} task_walk;

static task_walk walk_task(const photon_build *build, uint32_t task)
{
    const uint32_t first = task * build->task_runs;
    const uint32_t left = build->source->run_count - first;
    return (task_walk){build->source, first, first + ca_min_u32(left, build->task_runs), 0};
}

/* 0 at the end. */
static uint32_t next_batch(task_walk *walk, ca_photon *photons)
{
    for (; walk->run < walk->end; walk->run++, walk->at = 0) {
        const uint32_t count = walk->source->read(walk->source->user, walk->run, &walk->at, photons);
        if (count > 0) return count;
    }
    return 0;
}

static void count_task(void *user, uint32_t task, uint32_t worker)
{
    (void)worker;
    const photon_build *build = user;
    const ca_photon_lattice lattice = build->grid->lattice;
    uint32_t *counts = build->grid->cursors + (size_t)task * build->partition_count;
    memset(counts, 0, build->partition_count * sizeof *counts);
    ca_photon photons[CA_PHOTON_BATCH];
    task_walk walk = walk_task(build, task);
    for (uint32_t count; (count = next_batch(&walk, photons)) > 0;)
        for (uint32_t i = 0; i < count; i++) {
            assert(ca_is_finite3(photons[i].position));
            counts[ca_photon_bucket(&lattice, photons[i].position) >> build->partition_shift]++;
        }
}

/* Until partitions are sorted, their photons stand one after the other where the blocks will be. */
static ca_photon *partitioned(const ca_photon_grid *grid) { return (ca_photon *)(void *)grid->blocks; }

static void partition_task(void *user, uint32_t task, uint32_t worker)
{
    (void)worker;
    const photon_build *build = user;
    const ca_photon_lattice lattice = build->grid->lattice;
    ca_photon *to = partitioned(build->grid), photons[CA_PHOTON_BATCH];
    uint32_t *cursors = build->grid->cursors + (size_t)task * build->partition_count;
    task_walk walk = walk_task(build, task);
    for (uint32_t count; (count = next_batch(&walk, photons)) > 0;)
        for (uint32_t i = 0; i < count; i++) {
            const uint32_t bucket = ca_photon_bucket(&lattice, photons[i].position);
            to[cursors[bucket >> build->partition_shift]++] = photons[i];
        }
}

/* From counts to places: partition by partition, within one task by task. */
static uint32_t place_tasks(const photon_build *build)
{
    uint32_t place = 0;
    for (uint32_t p = 0; p < build->partition_count; p++)
        for (uint32_t t = 0; t < build->task_count; t++) {
            uint32_t *cursor = &build->grid->cursors[(size_t)t * build->partition_count + p];
            const uint32_t count = *cursor;
            *cursor = place;
            place += count;
        }
    return place;
}

/* ---- Within partitions ----------------------------------------------------------------------------------------- */

/* The last task's cursors stand at the partitions' ends. */
static uint32_t partition_end(const photon_build *build, uint32_t partition)
{
    return build->grid->cursors[(size_t)(build->task_count - 1) * build->partition_count + partition];
}

/* The blocks in which partitions end belong to several, which are sorted in any order: they are kept. */
static void keep_straddling(const photon_build *build)
{
    const ca_photon_grid *grid = build->grid;
    for (uint32_t p = 0; p < build->partition_count; p++)
        grid->straddling[p] = grid->blocks[partition_end(build, p) / CA_PHOTON_LANES];
}

/* Photons [begin, end), which lie in the block in which partition p ends. */
static void copy_kept(const ca_photon_grid *grid, uint32_t p, uint32_t begin, uint32_t end, ca_photon *to)
{
    const ca_photon *kept = (const ca_photon *)(const void *)&grid->straddling[p];
    memcpy(to, kept + begin % CA_PHOTON_LANES, (end - begin) * sizeof *to);
}

/* A partition's photons as they were before any was sorted. */
static void copy_partition(const photon_build *build, uint32_t partition, uint32_t begin, uint32_t end, ca_photon *to)
{
    const ca_photon_grid *grid = build->grid;
    const uint32_t first = begin % CA_PHOTON_LANES == 0 || partition == 0
                               ? begin
                               : ca_min_u32(end, begin - begin % CA_PHOTON_LANES + CA_PHOTON_LANES);
    const uint32_t last = ca_max_u32(first, end - end % CA_PHOTON_LANES);
    if (begin < first) copy_kept(grid, partition - 1, begin, first, to);
    if (first < last) memcpy(to + (first - begin), partitioned(grid) + first, (last - first) * sizeof *to);
    if (last < end) copy_kept(grid, partition, last, end, to + (last - begin));
}

static void sort_photons(ca_photon_grid *grid, const ca_photon *photons, uint32_t count, uint32_t place,
                         uint32_t first_bucket, uint32_t bucket_count)
{
    const ca_photon_lattice lattice = grid->lattice;
    uint32_t *starts = grid->starts;
    memset(starts + first_bucket, 0, bucket_count * sizeof *starts);
    for (uint32_t i = 0; i < count; i++) starts[ca_photon_bucket(&lattice, photons[i].position)]++;
    for (uint32_t b = first_bucket; b < first_bucket + bucket_count; b++) starts[b] = place += starts[b];
    /* Each bucket's end moves down to its start as it fills, so the last photon comes first. */
    for (uint32_t i = count; i-- > 0;) {
        const uint32_t to = --starts[ca_photon_bucket(&lattice, photons[i].position)];
        ca_photon_block *block = &grid->blocks[to / CA_PHOTON_LANES];
        block->x[to % CA_PHOTON_LANES] = photons[i].position.x;
        block->y[to % CA_PHOTON_LANES] = photons[i].position.y;
        block->z[to % CA_PHOTON_LANES] = photons[i].position.z;
        block->vertex[to % CA_PHOTON_LANES] = photons[i].vertex;
    }
}

static void sort_partition(void *user, uint32_t partition, uint32_t worker)
{
    photon_build *build = user;
    ca_photon_grid *grid = build->grid;
    const uint32_t begin = partition ? partition_end(build, partition - 1) : 0, end = partition_end(build, partition);
    ca_photon_scratch *scratch = &grid->scratch[worker];
    if (!make_partition_room(scratch, end - begin)) {
        __atomic_store_n(&build->failed, true, __ATOMIC_RELAXED);
        return;
    }
    copy_partition(build, partition, begin, end, scratch->photons);
    sort_photons(grid, scratch->photons, end - begin, begin, partition << build->partition_shift,
                 UINT32_C(1) << build->partition_shift);
}

/* ---- All together ---------------------------------------------------------------------------------------------- */

static void set_cells(ca_photon_lattice *lattice, const ca_photon_bounds *bounds, float radius)
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

/* How the work is divided, by the number of photons and runs alone. */
static void divide(photon_build *build, uint32_t count)
{
    const uint32_t bits = bucket_bits(count);
    build->grid->lattice.bucket_mask = (UINT32_C(1) << bits) - 1;
    uint32_t partition_bits = bits > PARTITION_BUCKET_BITS ? bits - PARTITION_BUCKET_BITS : 0;
    if (partition_bits > MAX_PARTITION_BITS) partition_bits = MAX_PARTITION_BITS;
    build->partition_count = UINT32_C(1) << partition_bits;
    build->partition_shift = bits - partition_bits;
    build->task_runs = (build->source->run_count - 1) / MAX_TASKS + 1;
    build->task_count = (build->source->run_count - 1) / build->task_runs + 1;
}

static ca_status sort(photon_build *build, uint32_t count, const ca_parallel *parallel, ca_error *error)
{
    ca_photon_grid *grid = build->grid;
    CA_TRY(ca_parallel_for(parallel, build->task_count, count_task, build, error));
    const uint32_t placed = place_tasks(build);
    assert(placed == count);
    (void)placed;
    CA_TRY(ca_parallel_for(parallel, build->task_count, partition_task, build, error));
    keep_straddling(build);
    CA_TRY(ca_parallel_for(parallel, build->partition_count, sort_partition, build, error));
    if (build->failed) return ca_fail_memory(error, "the photons");
    grid->starts[(size_t)grid->lattice.bucket_mask + 1] = count;
    grid->count = count;
    return CA_OK;
}

ca_status ca_photon_grid_build(ca_photon_grid *grid, const ca_photon_source *source, const ca_photon_bounds *bounds,
                               float radius, const ca_parallel *parallel, ca_error *error)
{
    assert(radius > 0.0f);
    photon_build build = {.grid = grid, .source = source};
    grid->count = 0; /* until all is well */
    grid->radius = radius;
    grid->radius2 = radius * radius;
    if (source->count > UINT32_MAX - 2 * CA_PHOTON_LANES)
        return ca_fail(error, CA_ERROR_UNSUPPORTED, NULL,
                       "a pass has 2^32 photons or more; trace fewer light paths per pass");
    const uint32_t count = (uint32_t)source->count;
    if (count == 0) return CA_OK;
    divide(&build, count);
    if (!make_all_room(grid, &build, count, parallel->workers)) return ca_fail_memory(error, "the photons");
    set_cells(&grid->lattice, bounds, radius);
    return sort(&build, count, parallel, error);
}
