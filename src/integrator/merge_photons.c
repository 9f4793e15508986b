/* Photons for merging: sorted by place, and with them what a merge reads. */
#include "integrator/bidirectional.h"

#include "base/memory.h"

enum { TASK_PLACES = 8192, LOOK_AHEAD = 16 };

ca_status ca_light_blocks_sort(const ca_bidirectional *b, uint32_t paths, ca_photon_grid *grid, float radius,
                               const ca_parallel *parallel, ca_error *error)
{
    ca_photon_run runs[CA_CHUNK_PATHS / CA_BLOCK_PATHS];
    const uint32_t count = ca_light_block_count(paths);
    for (uint32_t i = 0; i < count; i++)
        runs[i] = (ca_photon_run){b->blocks[i].photons, (uint32_t)b->blocks[i].photon_count};
    return ca_photon_grid_build(grid, runs, count, radius, parallel, error);
}

static ca_merge_photon merge_photon(const ca_light_store *store, uint32_t number)
{
    const ca_light_vertex *v = ca_light_vertex_at(store, number);
    const ca_path_vertex *d = ca_light_density_at(store, number);
    return (ca_merge_photon){.wi = v->wi,
                             .throughput = v->throughput,
                             .ng = v->point.ng,
                             .pdf_forward = d->pdf_forward,
                             .to_previous = d->to_previous,
                             .distance = d->distance,
                             .sqrt_area = d->sqrt_area,
                             .sqrt_omega = d->sqrt_omega,
                             .first = v->first,
                             .index = v->index};
}

/* Numbers of light paths stand in their v[0], which lie all over the memory: only where they are wanted. */
static void fill_paths(const ca_light_chunk *chunk, uint32_t begin, uint32_t end)
{
    for (uint32_t place = begin; place < end; place++) {
        if (place + LOOK_AHEAD < end)
            __builtin_prefetch(&ca_light_vertex_at(&chunk->store, chunk->photons[place + LOOK_AHEAD].first)->first);
        chunk->photons[place].path =
            ca_light_vertex_at(&chunk->store, chunk->photons[place].first)->first & (CA_CHUNK_PATHS - 1);
    }
}

typedef struct fill_task {
    ca_light_chunk *chunk;
    bool with_paths;
} fill_task;

static void fill_places(void *user, uint32_t task, uint32_t worker)
{
    (void)worker;
    const fill_task *fill = user;
    ca_light_chunk *chunk = fill->chunk;
    const uint32_t count = (uint32_t)ca_photon_grid_count(chunk->grid);
    const uint32_t begin = task * TASK_PLACES, end = ca_min_u32(begin + TASK_PLACES, count);
    for (uint32_t place = begin; place < end; place++) {
        if (place + LOOK_AHEAD < end) {
            const uint32_t later = ca_photon_grid_vertex(chunk->grid, place + LOOK_AHEAD);
            const char *vertex = (const char *)ca_light_vertex_at(&chunk->store, later);
            __builtin_prefetch(vertex);
            __builtin_prefetch(vertex + sizeof(ca_light_vertex) - 1);
            __builtin_prefetch(ca_light_density_at(&chunk->store, later));
        }
        chunk->photons[place] = merge_photon(&chunk->store, ca_photon_grid_vertex(chunk->grid, place));
        ca_photon_grid_answer_place(chunk->grid, place);
    }
    if (fill->with_paths) fill_paths(chunk, begin, end);
}

/* Room for `needed` photons at the start of cache lines; their old values are of no use. */
static bool make_room(ca_light_chunk *chunk, size_t needed)
{
    if (needed <= chunk->photon_capacity) return true;
    ca_free(chunk->photons);
    chunk->photon_capacity = 0;
    needed += needed / 8; /* passes differ a little */
    chunk->photons = ca_alloc_large(needed, sizeof *chunk->photons);
    if (!chunk->photons) return false;
    chunk->photon_capacity = needed;
    return true;
}

ca_status ca_light_chunk_sort(const ca_bidirectional *b, ca_light_chunk *chunk, const ca_parallel *parallel,
                              ca_error *error)
{
    CA_TRY(ca_light_blocks_sort(b, chunk->count, chunk->grid, b->radius, parallel, error));
    const uint32_t count = (uint32_t)ca_photon_grid_count(chunk->grid);
    if (!make_room(chunk, count)) return ca_fail_memory(error, "the photons");
    fill_task fill = {chunk, b->input.pairs != NULL};
    ca_parallel_for(parallel, (count + TASK_PLACES - 1) / TASK_PLACES, fill_places, &fill);
    return CA_OK;
}
