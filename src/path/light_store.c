#include "path/light_store.h"

#include "base/memory.h"
#include "math/numeric.h"

#include <assert.h>
#include <string.h>

_Static_assert((int)CA_LIGHT_PATH_MOST < (int)CA_LIGHT_SLAB, "a path lies in one slab");

enum { SLABS_OF_PAGE = CA_LIGHT_PAGE / CA_LIGHT_SLAB };

/* Slabs that `paths` of the greatest length can need: one is left when it has no room for the next path, and every
 * worker has one under way when a chunk ends. More than numbers reach there never are. The tables are of this size
 * from the start, for they may not move while workers read them; their untouched part costs address space only. */
static uint32_t slabs_needed(uint32_t paths, uint32_t workers)
{
    const uint64_t chunks = ((uint64_t)paths + CA_CHUNK_PATHS - 1) / CA_CHUNK_PATHS;
    const uint64_t needed = (uint64_t)paths + 1 + workers * chunks;
    const uint64_t numbered = UINT64_C(1) << (32 - CA_LIGHT_SLAB_BITS);
    return (uint32_t)(needed < numbered ? needed : numbered);
}

static uint32_t pages_of(uint32_t slabs) { return (slabs + SLABS_OF_PAGE - 1) / SLABS_OF_PAGE; }

/* Pages beyond these have never been handed out; of these, some may be missing after a failure. */
static uint32_t pages_touched(const ca_light_store *store)
{
    const uint32_t used = ca_max_u32(store->slab_peak, store->slab_used);
    assert(used == 0 || store->pages);
    return pages_of(ca_min_u32(used, store->slab_capacity));
}

/* Each worker needs a new slab for its next path. */
static void fill_slabs(ca_light_store *store)
{
    for (uint32_t i = 0; i < store->worker_count; i++) store->cursors[i].used = CA_LIGHT_SLAB;
}

ca_status ca_light_store_create(ca_light_store *store, const ca_light_layout *layout, uint32_t path_count,
                                uint32_t workers, ca_error *error)
{
    *store = (ca_light_store){.layout = *layout,
                              .path_count = path_count,
                              .worker_count = workers,
                              .slab_capacity = slabs_needed(path_count, workers)};
    store->page_capacity = pages_of(store->slab_capacity);
    store->paths = ca_alloc_zeroed(path_count, sizeof *store->paths);
    store->pages = ca_alloc_zeroed(store->page_capacity, sizeof *store->pages);
    store->slab_chunks = ca_alloc_zeroed(store->slab_capacity, sizeof *store->slab_chunks);
    store->cursors = ca_alloc_zeroed(workers, sizeof *store->cursors);
    if (!store->paths || !store->pages || !store->slab_chunks || !store->cursors) {
        ca_light_store_destroy(store);
        return ca_fail_memory(error, "the light paths");
    }
    fill_slabs(store);
    return CA_OK;
}

void ca_light_store_destroy(ca_light_store *store)
{
    for (uint32_t i = 0; i < pages_touched(store); i++) ca_free(store->pages[i]);
    ca_free(store->pages);
    ca_free(store->slab_chunks);
    ca_free(store->paths);
    ca_free(store->cursors);
    *store = (ca_light_store){0};
}

void ca_light_store_clear(ca_light_store *store)
{
    store->slab_peak = ca_min_u32(ca_max_u32(store->slab_peak, store->slab_used), store->slab_capacity);
    store->slab_used = 0;
    store->failed = false;
    ca_light_store_begin_chunk(store, 0);
}

void ca_light_store_begin_chunk(ca_light_store *store, uint32_t chunk)
{
    const uint32_t first = ca_min_u32(chunk * (uint32_t)CA_CHUNK_PATHS, store->path_count);
    const uint32_t count = ca_min_u32(CA_CHUNK_PATHS, store->path_count - first);
    if (count > 0) memset(store->paths + first, 0, count * sizeof *store->paths);
    store->chunk = chunk;
    fill_slabs(store);
}

void ca_light_store_fail(ca_light_store *store) { __atomic_store_n(&store->failed, true, __ATOMIC_RELAXED); }

/* The page is there, an old one or one that this worker or another one gets now; false: out of memory. */
static bool make_page(ca_light_store *store, uint32_t page)
{
    float **place = &store->pages[page], *none = NULL;
    if (__atomic_load_n(place, __ATOMIC_ACQUIRE)) return true;
    float *made = ca_alloc_large(CA_LIGHT_PAGE, sizeof *made);
    if (!made) return false;
    if (!__atomic_compare_exchange_n(place, &none, made, false, __ATOMIC_ACQ_REL, __ATOMIC_ACQUIRE)) ca_free(made);
    return true;
}

/* Hands the worker a slab of its own. */
static bool next_slab(ca_light_store *store, ca_light_cursor *cursor)
{
    if (__atomic_load_n(&store->failed, __ATOMIC_RELAXED)) return false;
    const uint32_t slab = __atomic_fetch_add(&store->slab_used, 1, __ATOMIC_RELAXED);
    if (slab >= store->slab_capacity || !make_page(store, slab / SLABS_OF_PAGE)) {
        ca_light_store_fail(store);
        return false;
    }
    store->slab_chunks[slab] = store->chunk;
    cursor->slab = slab;
    cursor->used = 0;
    return true;
}

/* Room for so many words next to each other, and the number of the first one. The number behind them is of the same
 * slab, too. */
static bool take_words(ca_light_store *store, uint32_t worker, uint32_t words, uint32_t *number)
{
    assert(worker < store->worker_count && words < CA_LIGHT_SLAB);
    ca_light_cursor *cursor = &store->cursors[worker];
    if (CA_LIGHT_SLAB - cursor->used <= words && !next_slab(store, cursor)) return false;
    *number = cursor->slab << CA_LIGHT_SLAB_BITS | cursor->used;
    cursor->used += words;
    return true;
}

bool ca_light_store_add(ca_light_store *store, uint32_t worker, uint32_t path, const ca_path_vertex *densities,
                        const ca_light_vertex *vertices, uint32_t count, size_t *bytes)
{
    const ca_light_layout *layout = &store->layout;
    const ca_light_source source = ca_light_source_of(layout, densities, vertices, count, path % CA_CHUNK_PATHS);
    assert(count >= 1 && count <= CA_PATH_MAX_VERTICES && path < store->path_count);
    store->paths[path] = (ca_light_path){0};
    *bytes = 0;
    if (source.records == 0) return true;
    const uint32_t before = ca_light_words_before(layout, source.count);
    const uint32_t words = before + ca_light_words_behind(layout, source.records, source.places);
    uint32_t number;
    if (!take_words(store, worker, words, &number)) return false;
    number += before;
    float *const page = __atomic_load_n(&store->pages[number >> CA_LIGHT_PAGE_BITS], __ATOMIC_RELAXED);
    ca_light_pack(layout, &source, page + (number & (CA_LIGHT_PAGE - 1)));
    store->paths[path] =
        (ca_light_path){.first = number, .count = (uint16_t)source.count, .records = (uint16_t)source.records};
    *bytes = words * sizeof(float);
    return true;
}

ca_status ca_light_store_check(const ca_light_store *store, ca_error *error)
{
    return __atomic_load_n(&store->failed, __ATOMIC_RELAXED) ? ca_fail_memory(error, "the light paths") : CA_OK;
}

size_t ca_light_store_bytes(const ca_light_store *store)
{
    size_t pages = 0;
    for (uint32_t i = 0; i < pages_touched(store); i++) pages += store->pages[i] != NULL;
    return store->path_count * sizeof *store->paths + store->page_capacity * sizeof *store->pages +
           store->slab_capacity * sizeof *store->slab_chunks + store->worker_count * sizeof *store->cursors +
           pages * (size_t)CA_LIGHT_PAGE * sizeof(float);
}
