/* Chunks of light paths: traced in parallel, splatted, and their photons sorted. */
#include "integrator/bidirectional.h"

/* Light paths are filled into the memory in steps of so many blocks. */
enum { FILL_BLOCKS = 16 };

typedef struct block_task {
    ca_bidirectional *b;
    ca_worker *workers;
    uint64_t first_number; /* of the first path in memory */
    uint32_t first_block;  /* of this loop, among those in memory */
} block_task;

static void trace_block(void *user, uint32_t index, uint32_t worker)
{
    const block_task *task = user;
    ca_bidirectional *b = task->b;
    const uint32_t number = task->first_block + index;
    ca_light_block *block = &b->blocks[number % (CA_CHUNK_PATHS / CA_BLOCK_PATHS)];
    block->photons = 0;
    block->bytes = 0;
    block->splats.count = 0;
    const uint32_t begin = number * CA_BLOCK_PATHS, end = ca_min_u32(begin + CA_BLOCK_PATHS, b->paths_now);
    ca_light_walks(b, &b->store, begin, end - begin, task->first_number + begin, block, &task->workers[worker]);
}

/* Traces so many blocks of light paths into the store, and counts their photons and bytes. */
static ca_status trace_blocks(block_task *task, uint32_t count, const ca_parallel *parallel, ca_error *error)
{
    ca_bidirectional *b = task->b;
    CA_TRY(ca_parallel_for(parallel, count, trace_block, task, error));
    for (uint32_t i = 0; i < count; i++) {
        const ca_light_block *block = &b->blocks[(task->first_block + i) % (CA_CHUNK_PATHS / CA_BLOCK_PATHS)];
        b->photons_now += block->photons;
        b->bytes_now += block->bytes;
    }
    return ca_light_store_check(&b->store, error);
}

/* Empties the memory for so many light paths. */
static void clear(ca_bidirectional *b, uint32_t count)
{
    ca_light_store_clear(&b->store);
    b->photons_now = 0;
    b->bytes_now = 0;
    b->paths_now = count;
    b->chunks_now = (uint32_t)(((uint64_t)count + CA_CHUNK_PATHS - 1) / CA_CHUNK_PATHS);
}

/* Of light paths that are numbered from `first` on within the pass. */
static ca_status add_splats(ca_bidirectional *b, uint32_t first, uint32_t paths, const ca_parallel *parallel,
                            ca_error *error)
{
    ca_splat_list lists[CA_CHUNK_PATHS / CA_BLOCK_PATHS];
    const uint32_t count = ca_light_block_count(paths);
    for (uint32_t i = 0; i < count; i++) lists[i] = b->blocks[i].splats;
    CA_TRY(ca_splat_buffer_add(&b->splats, lists, count, b->input.filter, 1.0f / (float)b->light_paths,
                               b->input.technique_images, parallel, error));
    return ca_pairs_are_wanted(b) ? ca_pairs_add_splats(b, lists, count, first, error) : CA_OK;
}

ca_status ca_light_paths_prepare(ca_bidirectional *b, uint64_t number, uint32_t count, const ca_parallel *parallel,
                                 ca_worker *workers, ca_error *error)
{
    clear(b, count);
    for (uint32_t c = 0; c < b->chunks_now; c++) {
        const uint32_t first = c * (uint32_t)CA_CHUNK_PATHS, paths = ca_min_u32(CA_CHUNK_PATHS, count - first);
        block_task task = {b, workers, number, first / CA_BLOCK_PATHS};
        ca_light_store_begin_chunk(&b->store, c);
        CA_TRY(trace_blocks(&task, ca_light_block_count(paths), parallel, error));
        if (b->rules.splat)
            CA_TRY(add_splats(b, b->first_chunk * (uint32_t)CA_CHUNK_PATHS + first, paths, parallel, error));
    }
    return ca_bidirectional_merges(b) ? ca_light_photons_sort(b, b->grid, b->radius, parallel, error) : CA_OK;
}

/* What so many light paths take in memory that are there since there were these: of what they are, not of where they
 * lie, so that it is the same for any number of threads. */
static double bytes_since(const ca_bidirectional *b, uint32_t paths, uint64_t photons, uint64_t bytes)
{
    return ca_light_bytes(paths, (double)(b->bytes_now - bytes), (double)(b->photons_now - photons));
}

ca_status ca_light_chunk_fill(ca_bidirectional *b, uint64_t number, double bytes, uint32_t *count,
                              const ca_parallel *parallel, ca_worker *workers, ca_error *error)
{
    block_task task = {.b = b, .workers = workers, .first_number = number};
    double used = 0.0;
    clear(b, CA_CHUNK_PATHS);
    *count = 0;
    while (*count < CA_CHUNK_PATHS) {
        const uint64_t photons = b->photons_now, kept = b->bytes_now;
        CA_TRY(trace_blocks(&task, FILL_BLOCKS, parallel, error));
        used += bytes_since(b, FILL_BLOCKS * CA_BLOCK_PATHS, photons, kept);
        if (used > bytes && *count > 0) {
            b->photons_now = photons;
            b->bytes_now = kept;
            break;
        }
        *count += FILL_BLOCKS * CA_BLOCK_PATHS;
        task.first_block += FILL_BLOCKS;
    }
    b->paths_now = *count;
    return CA_OK;
}

/* The weights must not depend on what they weight (that would be a bias): so these light paths are no pass'. */
ca_status ca_light_pilot(ca_bidirectional *b, uint32_t paths, float radius, ca_photon_grid **grid,
                         const ca_parallel *parallel, ca_worker *workers, ca_error *error)
{
    const bool splat = b->rules.splat;
    block_task task = {.b = b, .workers = workers, .first_number = CA_PILOT_NUMBER};
    clear(b, paths);
    b->rules.splat = false;
    ca_status status = trace_blocks(&task, ca_light_block_count(b->paths_now), parallel, error);
    b->rules.splat = splat;
    *grid = NULL;
    if (status == CA_OK) status = ca_photon_grid_create(grid, error);
    if (status == CA_OK) status = ca_light_photons_sort(b, *grid, radius, parallel, error);
    if (status == CA_OK) return CA_OK;
    ca_photon_grid_destroy(*grid);
    *grid = NULL;
    return status;
}
