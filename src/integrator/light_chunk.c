/* Chunks of light paths: traced in parallel, splatted, and their photons sorted. */
#include "integrator/bidirectional.h"

/* Light paths are filled into the memory in steps of so many blocks. */
enum { FILL_BLOCKS = 16 };

typedef struct block_task {
    const ca_bidirectional *b;
    ca_light_chunk *chunk;
    ca_worker *workers;
    uint64_t first_number; /* of the chunk's paths */
    uint32_t first_block;
} block_task;

static void trace_block(void *user, uint32_t index, uint32_t worker)
{
    const block_task *task = user;
    const uint32_t number = task->first_block + index;
    ca_light_block *block = &task->b->blocks[number];
    block->photon_count = 0;
    block->splats.count = 0;
    const uint32_t begin = number * CA_BLOCK_PATHS, end = ca_min_u32(begin + CA_BLOCK_PATHS, task->chunk->count);
    for (uint32_t i = begin; i < end; i++)
        ca_light_walk(task->b, task->chunk, i, task->first_number + i, block, &task->workers[worker]);
}

/* Traces a chunk's light paths into its store and the blocks. */
static ca_status trace_chunk(ca_bidirectional *b, ca_light_chunk *chunk, uint64_t number, const ca_parallel *parallel,
                             ca_worker *workers, ca_error *error)
{
    ca_light_store_clear(&chunk->store);
    block_task task = {.b = b, .chunk = chunk, .workers = workers, .first_number = number};
    ca_parallel_for(parallel, ca_light_block_count(chunk->count), trace_block, &task);
    return ca_light_store_check(&chunk->store, error);
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
    return b->input.pairs ? ca_pair_splats_add(&b->pair_splats, lists, count, first, error) : CA_OK;
}

ca_status ca_light_chunk_prepare(ca_bidirectional *b, ca_light_chunk *chunk, uint64_t number, uint32_t count,
                                 const ca_parallel *parallel, ca_worker *workers, ca_error *error)
{
    chunk->count = count;
    CA_TRY(trace_chunk(b, chunk, number, parallel, workers, error));
    const uint32_t first = (b->first_chunk + (uint32_t)(chunk - b->chunks)) * (uint32_t)CA_CHUNK_PATHS;
    if (b->rules.splat) CA_TRY(add_splats(b, first, chunk->count, parallel, error));
    return ca_bidirectional_merges(b) ? ca_light_chunk_sort(b, chunk, parallel, error) : CA_OK;
}

/* What the light paths of some blocks take in memory: of what they are, not of where they lie, so that it is the same
 * for any number of threads. */
static double bytes_of_blocks(const ca_bidirectional *b, const ca_light_chunk *chunk, uint32_t first, uint32_t count)
{
    double vertices = 0.0, photons = 0.0;
    for (uint32_t i = first * CA_BLOCK_PATHS; i < (first + count) * CA_BLOCK_PATHS; i++)
        vertices += chunk->store.paths[i].count;
    for (uint32_t i = first; i < first + count; i++) photons += (double)b->blocks[i].photon_count;
    return ca_light_bytes((double)count * CA_BLOCK_PATHS, vertices, photons, 0.0);
}

ca_status ca_light_chunk_fill(ca_bidirectional *b, uint64_t number, double bytes, uint32_t *count,
                              const ca_parallel *parallel, ca_worker *workers, ca_error *error)
{
    ca_light_chunk *chunk = &b->chunks[0];
    block_task task = {.b = b, .chunk = chunk, .workers = workers, .first_number = number};
    double used = 0.0;
    ca_light_store_clear(&chunk->store);
    chunk->count = CA_CHUNK_PATHS;
    *count = 0;
    while (*count < CA_CHUNK_PATHS) {
        ca_parallel_for(parallel, FILL_BLOCKS, trace_block, &task);
        CA_TRY(ca_light_store_check(&chunk->store, error));
        used += bytes_of_blocks(b, chunk, task.first_block, FILL_BLOCKS);
        if (used > bytes && *count > 0) break;
        *count += FILL_BLOCKS * CA_BLOCK_PATHS;
        task.first_block += FILL_BLOCKS;
    }
    chunk->count = *count;
    return CA_OK;
}

/* The weights must not depend on what they weight (that would be a bias): so these light paths are no pass'. */
ca_status ca_light_pilot(ca_bidirectional *b, float radius, ca_photon_grid **grid, uint32_t *paths,
                         const ca_parallel *parallel, ca_worker *workers, ca_error *error)
{
    ca_light_chunk *chunk = &b->chunks[0];
    const bool splat = b->rules.splat;
    chunk->count = ca_min_u32(CA_CHUNK_PATHS, b->light_paths);
    b->rules.splat = false;
    ca_status status = trace_chunk(b, chunk, CA_PILOT_NUMBER, parallel, workers, error);
    b->rules.splat = splat;
    *grid = NULL;
    *paths = chunk->count;
    if (status == CA_OK) status = ca_photon_grid_create(grid, error);
    if (status == CA_OK) status = ca_light_blocks_sort(b, chunk->count, *grid, radius, parallel, error);
    if (status == CA_OK) return CA_OK;
    ca_photon_grid_destroy(*grid);
    *grid = NULL;
    return status;
}
