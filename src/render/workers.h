/* The threads of a render: what each has of its own, and a loop over the tiles of the film.
 *
 * Square tiles are handed out as workers come free. State: about 200 bytes a worker. */
#ifndef CA_RENDER_WORKERS_H
#define CA_RENDER_WORKERS_H

#include "integrator/integrator.h"

typedef struct ca_workers {
    ca_parallel parallel;
    ca_worker *list;        /* one a thread, aligned, within: */
    void *memory;           /* owned */
    uint64_t *film_rejects; /* owned, one a thread: what only the film's gate caught */
} ca_workers;

ca_status ca_workers_create(ca_workers *workers, uint32_t threads, ca_error *error);
void ca_workers_destroy(ca_workers *workers);

/* What the workers have counted at some time, so that they can go back to it. */
typedef struct ca_kept_counts {
    ca_counters *counters; /* owned; one a worker, likewise: */
    uint64_t *film_rejects;
} ca_kept_counts;

ca_status ca_kept_counts_create(ca_kept_counts *kept, const ca_workers *workers, ca_error *error);
void ca_kept_counts_destroy(ca_kept_counts *kept);
void ca_workers_keep_counts(const ca_workers *workers, ca_kept_counts *kept);
void ca_workers_restore_counts(ca_workers *workers, const ca_kept_counts *kept);

/* Adds what all have counted. */
void ca_workers_count(const ca_workers *workers, ca_render_statistics *statistics);

/* Adds what all have counted of light paths. */
uint64_t ca_workers_light_paths(const ca_workers *workers);

enum { CA_TILE_SIDE = 32 };

/* A part of the film, half open; CA_TILE_SIDE pixels wide and high, or less at its right and lower border. */
typedef struct ca_tile {
    uint32_t x0, y0, x1, y1;
} ca_tile;

/* Runs task(user, tile, worker) once for each tile of width x height pixels. Errors: as ca_parallel_for. */
typedef void (*ca_tile_task)(void *user, const ca_tile *tile, uint32_t worker);
ca_status ca_for_each_tile(const ca_parallel *parallel, uint32_t width, uint32_t height, ca_tile_task task,
                           void *user, ca_error *error);

#endif
