/* Progressive photon mapping over all pairs of camera paths and light paths (Keller, Grünschloß, Droske, "Quasi-Monte
 * Carlo Progressive Photon Mapping"). Internal to this folder.
 *
 * Camera paths (the paper's query paths) are numbered: path q is the (q / P)-th of pixel q % P among the P pixels of
 * the crop, so a run of P has one of every pixel; light paths are those of one sequence. Both numbers are cut into
 * blocks, and every block of camera paths meets every block of light paths, in an order that keeps one of the two
 * from step to step (block_order.h).
 *
 *     step                          file                 kept while
 *     light paths of column j       light_chunk.c        j stays
 *     camera paths of row i         camera_records.c     i stays
 *     merges of every pair          qmcppm_gather.c
 *     blocks that stay in memory    kept_blocks.c
 *
 * A camera path's record holds what needs no light path (emitters that it saw, next event) and the vertices at which
 * photons are looked up. Joined by shadow rays instead of merges (section 6), camera paths are not kept but traced
 * for each block: what they take is little beside joining each with all light paths of the block.
 *
 * Blocks stay in memory, as many as there is room for (keep_blocks; 1 GiB, or what the limit of memory leaves): the
 * first ones that come, of either side, since the order of blocks goes back and forth over all of them. Which ones
 * are traced again changes the time alone. With filled blocks none does: they take the memory.
 *
 * Error bars (error_bars=true): while a pixel's camera paths gather, what each pair contributes is summed for the
 * pixel's noise (pair_covariances.h), which reads what the image gets and changes nothing of it. The law of all pairs
 * asks for independent paths, so the sampler must be independent; for halves of either side in every block, so a
 * block has two camera paths of a pixel or more; and for blocks of equal size. It is one for a single radius. Where
 * the radius shrinks from column to column, light paths of different columns are still independent, and so are a
 * column's pairs: only the camera's term asks for products of different columns, Cov(g_j, g_k), in whose place their
 * mean square is used. It is no smaller, so that on a whole rectangle of blocks the variance, and with it the
 * interval, is too large rather than too small: that of the expectation at these radii.
 *
 * State: 88 bytes a camera path, 80 a vertex where photons are looked up, 40 a vertex where merges are weighted, 84 a
 * vertex of the batch that a worker traces; of light paths as light_store.h and photon_grid.h say. Threads: blocks
 * are prepared in parallel and pixels gathered at once; all of it in orders that do not depend on threads. */
#ifndef CA_INTEGRATOR_QMCPPM_H
#define CA_INTEGRATOR_QMCPPM_H

#include "film/pair_covariances.h"
#include "integrator/bidirectional.h"
#include "integrator/block_order.h"
#include "photon/kernel.h"

/* Which paths the image shows: those without any Dirac event, those with one, or all. */
typedef enum ca_transport { CA_TRANSPORT_ALL, CA_TRANSPORT_SMOOTH, CA_TRANSPORT_DIRAC } ca_transport;

/* A vertex of a camera path at which photons are looked up. */
typedef struct ca_gather_vertex {
    ca_surface_point point;
    ca_vec3 wi;          /* unit, towards the previous vertex */
    ca_rgb throughput;   /* of the camera path up to here */
    float radius0;       /* initial radius, m */
    uint16_t vertex;     /* its number on the path */
    uint16_t dirac;      /* 1: there was a Dirac event before */
} ca_gather_vertex;

_Static_assert(sizeof(ca_gather_vertex) == 80, "qmcppm.h promises 80 bytes");

typedef struct ca_camera_record {
    ca_rgb own_light;    /* found without light paths */
    ca_film_sample sample; /* first-hit layers and the filter's weight */
    uint32_t first, count; /* vertices in its task's array, */
    uint32_t densities;    /* and where its densities begin, v[0] first */
} ca_camera_record;

_Static_assert(sizeof(ca_camera_record) == 88, "qmcppm.h promises 88 bytes");

/* What the camera paths of one task of a block have. */
typedef struct ca_camera_task {
    ca_gather_vertex *vertices; /* owned */
    size_t vertex_count, vertex_capacity;
    ca_path_vertex *densities;  /* owned; empty where nothing is weighted */
    size_t density_count, density_capacity;
    bool failed;                /* out of memory */
} ca_camera_task;

/* Camera paths of one task, which are traced as one batch. */
enum { CA_CAMERA_TASK = 256 };
_Static_assert((int)CA_CAMERA_TASK <= (int)CA_WALKS, "a task is a batch");

/* A worker's room for the vertices of the batch under way, in the order in which the paths come to them. */
typedef struct ca_kept_vertex {
    ca_gather_vertex vertex;
    uint32_t next; /* number of the same path's next one, or CA_NONE */
} ca_kept_vertex;

typedef struct ca_kept_vertices {
    ca_kept_vertex *items; /* owned */
    size_t capacity;
} ca_kept_vertices;

/* One block's camera paths, [first, first + count). */
typedef struct ca_camera_records {
    uint64_t first;
    uint64_t count;
    ca_camera_record *records; /* owned */
    size_t record_capacity;
    ca_camera_task *tasks;     /* owned */
    size_t task_capacity, task_count; /* task_count: of those ever used */
} ca_camera_records;

/* The starts of blocks along one side, as far as they are known: block k is [starts[k], starts[k + 1]). */
typedef struct ca_block_starts {
    uint64_t *starts; /* owned */
    size_t known, capacity;
} ca_block_starts;

/* A block of one side that is not in use; the other side's fields are empty. */
typedef struct ca_kept_block {
    uint64_t number;      /* UINT64_MAX: nothing is in it */
    bool stays;           /* else it is the one that may be overwritten */
    ca_light_store store; /* owned, as all of this; empty while the block is in use */
    ca_photon_grid *grid;
    uint64_t photons, bytes; /* as ca_bidirectional has them */
    uint32_t paths, chunks;
    ca_camera_records camera;
} ca_kept_block;

typedef struct ca_kept_side {
    ca_kept_block *slots; /* owned */
    size_t count, capacity;
    size_t now; /* the slot of the block in use */
} ca_kept_side;

typedef struct ca_kept_blocks {
    ca_kept_side light, camera;
    double bytes;   /* of those that stay */
    double largest; /* of a block, so far */
} ca_kept_blocks;

typedef struct ca_qmcppm {
    ca_bidirectional *engine; /* owned: rules, light paths, photon grids */
    ca_integrator_input input;
    ca_block_order order;
    ca_kernel kernel;
    ca_transport transport;
    bool gradients;
    bool connect;        /* joined by shadow rays instead of merges */
    bool direct_photons; /* direct light from photons, else by next event */
    bool weighted;       /* merges at several vertices of a camera path share its light */
    bool filled;         /* blocks as large as the memory holds, else of equal size */
    bool keeps;                                  /* blocks stay in memory */
    uint64_t pixels;     /* of the crop, P */
    uint64_t camera_block, light_block; /* m_b and n_b of equal blocks */
    double reference;    /* N_ref: light paths for which the radius is radius0 */
    uint64_t total_light; /* n fixed in advance; 0: progressive */
    ca_pair_covariances *pairs; /* owned, one a worker: for error bars; NULL: not wanted */
    ca_kept_vertices *kept;     /* owned, one a worker */
    double side_bytes;   /* memory of filled blocks, of either side */
    ca_block_starts camera_starts, light_starts; /* of filled blocks */

    uint32_t radius_photons;  /* local radii from the distance of that many photons of the pilot; 0: one radius */
    ca_photon_grid *pilot;
    float pilot_scale;        /* from a distance in the pilot to a radius for N_ref light paths */

    bool ready;               /* what follows is there */
    ca_block_pair now;
    ca_camera_records camera;
    ca_block_pair visits;     /* how many blocks before had the same */
    uint64_t light_count;     /* light paths of the block */
    float shrink;             /* radius over radius0 */
    ca_kept_blocks kept_blocks;
} ca_qmcppm;

/* Does the image show paths with a Dirac event, or without? */
static inline bool ca_qmcppm_shows(const ca_qmcppm *q, bool dirac)
{
    return q->transport == CA_TRANSPORT_ALL || dirac == (q->transport == CA_TRANSPORT_DIRAC);
}

/* Local radii are bounded by this factor below and above the global one. */
#define CA_LOCAL_RADIUS_RANGE 4.0f

/* ---- camera_records.c ------------------------------------------------------------------------------------------ */

/* Traces camera paths [first, first + count) into records. */
ca_status ca_camera_records_trace(ca_qmcppm *q, uint64_t first, uint64_t count, const ca_parallel *parallel,
                                  ca_worker *workers, ca_error *error);
/* The same for as many as `bytes` hold: a multiple of a fixed step, one step at least; *count of them. */
ca_status ca_camera_records_fill(ca_qmcppm *q, uint64_t first, double bytes, uint64_t *count,
                                 const ca_parallel *parallel, ca_worker *workers, ca_error *error);
/* What the records and their tasks hold in memory. */
double ca_camera_records_bytes(const ca_camera_records *records);
/* What they hold in memory, with room that is not used. */
double ca_camera_records_held(const ca_camera_records *records);
void ca_camera_records_destroy(ca_camera_records *records);

/* ---- kept_blocks.c --------------------------------------------------------------------------------------------- */

/* Puts a block's light paths into the engine, or its camera paths into q->camera; *found: they were kept, else what
 * is there is to be overwritten. What was there stays, if there is room for it. */
ca_status ca_kept_light_change(ca_qmcppm *q, uint64_t block, bool *found, ca_error *error);
ca_status ca_kept_camera_change(ca_qmcppm *q, uint64_t block, bool *found, ca_error *error);
/* Both sides' blocks in use are whole: they are this pair's. */
void ca_kept_blocks_done(ca_qmcppm *q, const ca_block_pair *pair);
ca_status ca_kept_blocks_create(ca_qmcppm *q, ca_error *error);
/* But for what is in use. */
void ca_kept_blocks_destroy(ca_qmcppm *q);

/* ---- qmcppm_gather.c ------------------------------------------------------------------------------------------- */

/* What the block has for pixels, integrator.h. */
void ca_qmcppm_block_pixels(const void *state, uint32_t x, uint32_t y, uint32_t count, ca_block_sample *samples,
                            ca_worker *worker);

#endif
