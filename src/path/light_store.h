/* The light paths of a pass, and their vertices.
 *
 * Paths are numbered; a path's vertices lie next to each other, v[0] on the light first. Vertices live in slabs which
 * the workers fill one path after the other, so a vertex' number says where it is, not when it was made: whatever
 * must not depend on threads goes through the paths in order (ca_light_path). Slabs are kept from pass to pass.
 * Densities lie apart from the rest, so that those of a path are an array for weighting.
 *
 * Paths come in chunks. Each chunk has slabs of its own, so that a vertex' number tells its path's chunk.
 *
 * State: 8 bytes a path, 120 a vertex. Threads: ca_light_store_path_begin/end/fail of different workers at once;
 * everything else only between. */
#ifndef CA_PATH_LIGHT_STORE_H
#define CA_PATH_LIGHT_STORE_H

#include "base/parallel.h"
#include "base/status.h"
#include "geometry/surface_point.h"
#include "math/rgb.h"
#include "path/path_vertex.h"

#include <stddef.h>

/* A vertex of a light path but for its densities; v[0] has only its point, whose shape is the light's number in the
 * scene. What merges read comes first. */
typedef struct ca_light_vertex {
    ca_vec3 wi;          /* unit, towards the previous vertex */
    ca_rgb throughput;   /* flux that arrives, W, before scattering here */
    uint32_t first;      /* number of its path's v[0] */
    uint32_t index : 13; /* its own number in the path */
    uint32_t capable : 1; /* its surface can scatter smoothly, so it is a photon and may be connected */
    uint32_t path : 18;  /* number of its path in the chunk */
    ca_surface_point point;
} ca_light_vertex;

_Static_assert(sizeof(ca_light_vertex) + sizeof(ca_path_vertex) == 120, "light_store.h promises 120 bytes a vertex");

typedef struct ca_light_path {
    uint32_t first; /* vertex number of v[0] */
    uint32_t count; /* vertices; 0: nothing was emitted, or it met nothing */
} ca_light_path;

/* Light paths of a chunk. */
enum { CA_CHUNK_PATHS = 1 << 18 };

/* A slab is a little under the 2 MiB of a huge page. */
enum { CA_LIGHT_SLAB_BITS = 14, CA_LIGHT_SLAB = 1 << CA_LIGHT_SLAB_BITS };

typedef struct ca_light_slab {
    ca_path_vertex densities[CA_LIGHT_SLAB];
    ca_light_vertex vertices[CA_LIGHT_SLAB];
} ca_light_slab;

typedef struct ca_light_cursor {
    uint32_t slab, used; /* where the worker writes next */
    uint8_t apart[120];  /* workers write into no common cache line */
} ca_light_cursor;

typedef struct ca_light_store {
    ca_light_path *paths; /* owned */
    uint32_t path_count;
    ca_light_slab **slabs; /* owned, slab_capacity of them, NULL where not needed yet */
    uint32_t *slab_chunks; /* owned; each slab's chunk */
    uint32_t slab_capacity;
    uint32_t chunk;           /* that is being filled */
    uint32_t slab_used;       /* atomic: handed out in this pass */
    uint32_t slab_peak;       /* in any pass before */
    ca_light_cursor *cursors; /* owned, one a worker */
    uint32_t worker_count;
    bool failed;              /* atomic: out of memory, or of slabs */
} ca_light_store;

ca_status ca_light_store_create(ca_light_store *store, uint32_t path_count, uint32_t workers, ca_error *error);
void ca_light_store_destroy(ca_light_store *store);

/* Forgets all paths and keeps the memory; what comes next is of chunk 0. */
void ca_light_store_clear(ca_light_store *store);
/* What comes next is of that chunk: paths from chunk * CA_CHUNK_PATHS on. */
void ca_light_store_begin_chunk(ca_light_store *store, uint32_t chunk);

/* Room for CA_PATH_MAX_VERTICES more vertices of one path next to each other, their number, densities and the rest;
 * false after a failure, which ca_light_store_check reports. */
bool ca_light_store_path_begin(ca_light_store *store, uint32_t worker, uint32_t *first, ca_path_vertex **densities,
                               ca_light_vertex **vertices);
/* `count` of them were filled. */
void ca_light_store_path_end(ca_light_store *store, uint32_t worker, uint32_t count);
/* Whoever traces the paths ran out of memory beside: from any worker. */
void ca_light_store_fail(ca_light_store *store);
ca_status ca_light_store_check(const ca_light_store *store, ca_error *error);

static inline const ca_light_vertex *ca_light_vertex_at(const ca_light_store *store, uint32_t number)
{
    return &store->slabs[number >> CA_LIGHT_SLAB_BITS]->vertices[number & (CA_LIGHT_SLAB - 1)];
}

/* Asks the memory for what merges read of a vertex. */
static inline void ca_light_vertex_prefetch(const ca_light_store *store, uint32_t number)
{
    const char *vertex = (const char *)ca_light_vertex_at(store, number);
    __builtin_prefetch(vertex);
    __builtin_prefetch(vertex + offsetof(ca_light_vertex, point.position) - 1);
}

static inline const ca_path_vertex *ca_light_density_at(const ca_light_store *store, uint32_t number)
{
    return &store->slabs[number >> CA_LIGHT_SLAB_BITS]->densities[number & (CA_LIGHT_SLAB - 1)];
}

static inline uint32_t ca_light_chunk_of(const ca_light_store *store, uint32_t number)
{
    return store->slab_chunks[number >> CA_LIGHT_SLAB_BITS];
}

/* Bytes held. */
size_t ca_light_store_bytes(const ca_light_store *store);

#endif
