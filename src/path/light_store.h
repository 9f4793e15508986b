/* The light paths of a pass, in memory.
 *
 * Paths are numbered; each lies in a block of its own (light_record.h). Blocks lie in slabs, which the workers fill
 * one path after the other, so the number of a block or of a record in it says where it is, not when it was made:
 * whatever must not depend on threads goes through the paths in order (ca_light_path). The memory of slabs is kept
 * from pass to pass.
 *
 * Paths come in chunks. Each chunk has slabs of its own, so that a record's number tells its path's chunk.
 *
 * State: 8 bytes a path, and those of light_record.h, 120 a vertex at most; of slabs that are not full a little more,
 * for each worker and chunk half a slab. Numbers count words: they reach 16 GiB. Threads: ca_light_store_add and
 * ca_light_store_fail of different workers at once; everything else only between. */
#ifndef CA_PATH_LIGHT_STORE_H
#define CA_PATH_LIGHT_STORE_H

#include "base/parallel.h"
#include "base/status.h"
#include "path/light_record.h"

#include <stddef.h>

typedef struct ca_light_path {
    uint32_t first; /* number of its block, and of its first record */
    uint16_t count; /* vertices that are kept; 0: none of them has a record */
    uint16_t records;
} ca_light_path;

_Static_assert(sizeof(ca_light_path) == 8, "light_store.h promises 8 bytes a path");

/* Light paths of a chunk. */
enum { CA_CHUNK_PATHS = 1 << 18 };

/* Words of a slab, and slabs of the huge page of 2 MiB in which they lie. */
enum {
    CA_LIGHT_SLAB_BITS = 16,
    CA_LIGHT_SLAB = 1 << CA_LIGHT_SLAB_BITS,
    CA_LIGHT_PAGE_BITS = 19,
    CA_LIGHT_PAGE = 1 << CA_LIGHT_PAGE_BITS
};

/* What numbers reach, but for slabs that are not full. */
#define CA_LIGHT_STORE_MOST_BYTES 0x1.ep33

typedef struct ca_light_cursor {
    uint32_t slab, used; /* where the worker writes next */
    uint8_t apart[120];  /* workers write into no common cache line */
} ca_light_cursor;

typedef struct ca_light_store {
    ca_light_layout layout;
    ca_light_path *paths; /* owned */
    uint32_t path_count;
    float **pages;         /* owned, atomic; page_capacity of them, NULL where not needed yet */
    uint32_t *slab_chunks; /* owned; each slab's chunk */
    uint32_t page_capacity, slab_capacity;
    uint32_t chunk;           /* that is being filled */
    uint32_t slab_used;       /* atomic: handed out in this pass */
    uint32_t slab_peak;       /* in any pass before */
    ca_light_cursor *cursors; /* owned, one a worker */
    uint32_t worker_count;
    bool failed;              /* atomic: out of memory, or of slabs */
} ca_light_store;

ca_status ca_light_store_create(ca_light_store *store, const ca_light_layout *layout, uint32_t path_count,
                                uint32_t workers, ca_error *error);
void ca_light_store_destroy(ca_light_store *store);

/* Forgets the paths of chunk 0, which comes next, and keeps the memory. The paths of the other chunks no longer hold:
 * each chunk begins before anyone reads it. (Forgetting all at once would take 0.2 s for 50 million paths.) */
void ca_light_store_clear(ca_light_store *store);
/* What comes next is of that chunk: paths from chunk * CA_CHUNK_PATHS on, which are forgotten. */
void ca_light_store_begin_chunk(ca_light_store *store, uint32_t chunk);

/* Keeps a path of so many vertices as the path-th of those in memory; *bytes: of its block, 0 where there is nothing
 * to keep of it. false after a failure, which ca_light_store_check reports. */
bool ca_light_store_add(ca_light_store *store, uint32_t worker, uint32_t path, const ca_path_vertex *densities,
                        const ca_light_vertex *vertices, uint32_t count, size_t *bytes);
/* Whoever traces the paths ran out of memory beside: from any worker. */
void ca_light_store_fail(ca_light_store *store);
ca_status ca_light_store_check(const ca_light_store *store, ca_error *error);

/* Where a number points to. */
static inline const float *ca_light_words_at(const ca_light_store *store, uint32_t number)
{
    return store->pages[number >> CA_LIGHT_PAGE_BITS] + (number & (CA_LIGHT_PAGE - 1));
}

static inline const ca_light_record *ca_light_record_at(const ca_light_store *store, uint32_t number)
{
    return (const ca_light_record *)(const void *)ca_light_words_at(store, number);
}

/* The number of a path's record. */
static inline uint32_t ca_light_record_number(const ca_light_store *store, const ca_light_path *path, uint32_t rank)
{
    return path->first + rank * store->layout.record_words;
}

/* Asks the memory for a record. */
static inline void ca_light_record_prefetch(const ca_light_store *store, uint32_t number)
{
    const char *record = (const char *)ca_light_words_at(store, number);
    __builtin_prefetch(record);
    __builtin_prefetch(record + sizeof(ca_light_record) - 1);
}

/* And for the densities of its path up to the record's vertex. Inlined before the compiler can find that the call has
 * no effect and leave it out. */
static inline __attribute__((always_inline)) void ca_light_densities_prefetch(const ca_light_store *store,
                                                                              const ca_light_record *record)
{
    const char *end = (const char *)ca_light_record_start(&store->layout, record);
    const size_t bytes = sizeof(float) * ca_light_words_before(&store->layout, record->index + 1u);
    __builtin_prefetch(end - 1);
    for (const char *at = end - bytes; at < end; at += 64) __builtin_prefetch(at);
}

static inline uint32_t ca_light_chunk_of(const ca_light_store *store, uint32_t number)
{
    return store->slab_chunks[number >> CA_LIGHT_SLAB_BITS];
}

/* Bytes held. */
size_t ca_light_store_bytes(const ca_light_store *store);

#endif
