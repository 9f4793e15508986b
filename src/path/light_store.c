#include "path/light_store.h"

#include "base/memory.h"
#include "math/numeric.h"

#include <assert.h>
#include <string.h>

_Static_assert((int)CA_PATH_MAX_VERTICES <= (int)CA_LIGHT_SLAB, "a path lies in one slab");

/* Slabs that `paths` of the greatest length can need: one is left when it has no room for another such path, and
 * every worker has one under way when a chunk ends. More than vertex numbers reach there never are. The table is of
 * this size from the start, for it may not move while workers read it; its untouched part costs address space
 * only. */
static uint32_t slabs_needed(uint32_t paths, uint32_t workers)
{
    const uint64_t paths_a_slab = CA_LIGHT_SLAB / (uint64_t)CA_PATH_MAX_VERTICES;
    const uint64_t chunks = ((uint64_t)paths + CA_CHUNK_PATHS - 1) / CA_CHUNK_PATHS;
    const uint64_t needed = paths / paths_a_slab + 1 + workers * chunks;
    const uint64_t numbered = UINT64_C(1) << (32 - CA_LIGHT_SLAB_BITS);
    return (uint32_t)(needed < numbered ? needed : numbered);
}

/* Slabs beyond these have never been handed out; of these, some may be missing after a failure. */
static uint32_t slabs_touched(const ca_light_store *store)
{
    const uint32_t used = ca_max_u32(store->slab_peak, store->slab_used);
    assert(used == 0 || store->slabs);
    return ca_min_u32(used, store->slab_capacity);
}

ca_status ca_light_store_create(ca_light_store *store, uint32_t path_count, uint32_t workers, ca_error *error)
{
    *store = (ca_light_store){
        .path_count = path_count, .worker_count = workers, .slab_capacity = slabs_needed(path_count, workers)};
    store->paths = ca_alloc_zeroed(path_count, sizeof *store->paths);
    store->slabs = ca_alloc_zeroed(store->slab_capacity, sizeof *store->slabs);
    store->slab_chunks = ca_alloc_zeroed(store->slab_capacity, sizeof *store->slab_chunks);
    store->cursors = ca_alloc_zeroed(workers, sizeof *store->cursors);
    if (!store->paths || !store->slabs || !store->slab_chunks || !store->cursors) {
        ca_light_store_destroy(store);
        return ca_fail_memory(error, "the light paths");
    }
    ca_light_store_clear(store);
    return CA_OK;
}

void ca_light_store_destroy(ca_light_store *store)
{
    for (uint32_t i = 0; i < slabs_touched(store); i++) ca_free(store->slabs[i]);
    ca_free(store->slabs);
    ca_free(store->slab_chunks);
    ca_free(store->paths);
    ca_free(store->cursors);
    *store = (ca_light_store){0};
}

void ca_light_store_clear(ca_light_store *store)
{
    memset(store->paths, 0, store->path_count * sizeof *store->paths);
    store->slab_peak = slabs_touched(store);
    store->slab_used = 0;
    store->failed = false;
    ca_light_store_begin_chunk(store, 0);
}

void ca_light_store_begin_chunk(ca_light_store *store, uint32_t chunk)
{
    store->chunk = chunk;
    /* as if the worker's slab were full */
    for (uint32_t i = 0; i < store->worker_count; i++) store->cursors[i].used = CA_LIGHT_SLAB;
}

void ca_light_store_fail(ca_light_store *store) { __atomic_store_n(&store->failed, true, __ATOMIC_RELAXED); }

/* Hands the worker a slab of its own, an old one where there is one. */
static bool next_slab(ca_light_store *store, ca_light_cursor *cursor)
{
    if (__atomic_load_n(&store->failed, __ATOMIC_RELAXED)) return false;
    const uint32_t slab = __atomic_fetch_add(&store->slab_used, 1, __ATOMIC_RELAXED);
    if (slab < store->slab_capacity && !store->slabs[slab])
        store->slabs[slab] = ca_alloc_large(1, sizeof *store->slabs[slab]);
    if (slab >= store->slab_capacity || !store->slabs[slab]) {
        ca_light_store_fail(store);
        return false;
    }
    store->slab_chunks[slab] = store->chunk;
    cursor->slab = slab;
    cursor->used = 0;
    return true;
}

bool ca_light_store_path_begin(ca_light_store *store, uint32_t worker, uint32_t *first, ca_path_vertex **densities,
                               ca_light_vertex **vertices)
{
    assert(worker < store->worker_count);
    ca_light_cursor *cursor = &store->cursors[worker];
    if (CA_LIGHT_SLAB - cursor->used < CA_PATH_MAX_VERTICES && !next_slab(store, cursor)) return false;
    ca_light_slab *slab = store->slabs[cursor->slab];
    *first = cursor->slab << CA_LIGHT_SLAB_BITS | cursor->used;
    *densities = slab->densities + cursor->used;
    *vertices = slab->vertices + cursor->used;
    return true;
}

void ca_light_store_path_end(ca_light_store *store, uint32_t worker, uint32_t count)
{
    assert(worker < store->worker_count && count <= CA_PATH_MAX_VERTICES);
    store->cursors[worker].used += count;
}

ca_status ca_light_store_check(const ca_light_store *store, ca_error *error)
{
    return __atomic_load_n(&store->failed, __ATOMIC_RELAXED) ? ca_fail_memory(error, "the light paths") : CA_OK;
}

size_t ca_light_store_bytes(const ca_light_store *store)
{
    size_t slabs = 0;
    for (uint32_t i = 0; i < slabs_touched(store); i++) slabs += store->slabs[i] != NULL;
    return store->path_count * sizeof *store->paths +
           store->slab_capacity * (sizeof *store->slabs + sizeof *store->slab_chunks) +
           store->worker_count * sizeof *store->cursors + slabs * sizeof(ca_light_slab);
}
