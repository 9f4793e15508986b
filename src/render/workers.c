#include "render/workers.h"

#include "base/memory.h"

enum { WORKER_ALIGNMENT = 128 };
_Static_assert(sizeof(ca_worker) % WORKER_ALIGNMENT == 0, "counters of different workers: never in one cache line");
_Static_assert(CA_TECHNIQUE_COUNT + 1 == CA_NON_FINITE_SOURCES, "caustica.h counts the techniques and the film");

ca_status ca_workers_create(ca_workers *workers, uint32_t threads, ca_error *error)
{
    *workers = (ca_workers){.parallel = {.workers = threads}};
    workers->film_rejects = ca_alloc_zeroed(threads, sizeof *workers->film_rejects);
    /* One more than needed, so that there is room to begin at an aligned address. */
    workers->memory = ca_alloc_zeroed((size_t)threads + 1, sizeof(ca_worker));
    if (!workers->film_rejects || !workers->memory) {
        ca_workers_destroy(workers);
        return ca_fail_memory(error, "the render");
    }
    const uintptr_t address = (uintptr_t)workers->memory;
    workers->list =
        (void *)((char *)workers->memory + (WORKER_ALIGNMENT - address % WORKER_ALIGNMENT) % WORKER_ALIGNMENT);
    for (uint32_t i = 0; i < threads; i++) workers->list[i].index = i;
    return CA_OK;
}

void ca_workers_destroy(ca_workers *workers)
{
    ca_free(workers->film_rejects);
    ca_free(workers->memory);
    *workers = (ca_workers){0};
}

/* ---- Counts ---------------------------------------------------------------------------------------------------- */

ca_status ca_kept_counts_create(ca_kept_counts *kept, const ca_workers *workers, ca_error *error)
{
    kept->counters = ca_alloc_zeroed(workers->parallel.workers, sizeof *kept->counters);
    kept->film_rejects = ca_alloc_zeroed(workers->parallel.workers, sizeof *kept->film_rejects);
    if (kept->counters && kept->film_rejects) return CA_OK;
    ca_kept_counts_destroy(kept);
    return ca_fail_memory(error, "the render");
}

void ca_kept_counts_destroy(ca_kept_counts *kept)
{
    ca_free(kept->counters);
    ca_free(kept->film_rejects);
    *kept = (ca_kept_counts){0};
}

void ca_workers_keep_counts(const ca_workers *workers, ca_kept_counts *kept)
{
    for (uint32_t i = 0; i < workers->parallel.workers; i++) {
        kept->counters[i] = workers->list[i].counters;
        kept->film_rejects[i] = workers->film_rejects[i];
    }
}

void ca_workers_restore_counts(ca_workers *workers, const ca_kept_counts *kept)
{
    for (uint32_t i = 0; i < workers->parallel.workers; i++) {
        workers->list[i].counters = kept->counters[i];
        workers->film_rejects[i] = kept->film_rejects[i];
    }
}

void ca_workers_count(const ca_workers *workers, ca_render_statistics *statistics)
{
    for (uint32_t i = 0; i < workers->parallel.workers; i++) {
        const ca_counters *counters = &workers->list[i].counters;
        statistics->light_paths += counters->light_paths;
        statistics->camera_paths += counters->camera_paths;
        statistics->rays += counters->rays;
        statistics->shadow_rays += counters->shadow_rays;
        statistics->photons += counters->photons;
        statistics->photons_tested += counters->photons_tested;
        statistics->merges += counters->merges;
        for (int t = 0; t < CA_TECHNIQUE_COUNT; t++) {
            statistics->non_finite_from[t] += counters->non_finite[t];
            statistics->non_finite += counters->non_finite[t];
        }
        statistics->non_finite_from[CA_TECHNIQUE_COUNT] += workers->film_rejects[i];
        statistics->non_finite += workers->film_rejects[i];
    }
}

uint64_t ca_workers_light_paths(const ca_workers *workers)
{
    uint64_t sum = 0;
    for (uint32_t i = 0; i < workers->parallel.workers; i++) sum += workers->list[i].counters.light_paths;
    return sum;
}

/* ---- Tiles ----------------------------------------------------------------------------------------------------- */

typedef struct tile_loop {
    ca_tile_task task;
    void *user;
    uint32_t width, height;
} tile_loop;

static uint32_t tiles_along(uint32_t side) { return (side + CA_TILE_SIDE - 1) / CA_TILE_SIDE; }
static uint32_t tile_end(uint32_t begin, uint32_t side)
{
    return side - begin < CA_TILE_SIDE ? side : begin + CA_TILE_SIDE;
}

static void run_tile(void *user, uint32_t number, uint32_t worker)
{
    const tile_loop *loop = user;
    const uint32_t columns = tiles_along(loop->width);
    ca_tile tile = {.x0 = number % columns * CA_TILE_SIDE, .y0 = number / columns * CA_TILE_SIDE};
    tile.x1 = tile_end(tile.x0, loop->width);
    tile.y1 = tile_end(tile.y0, loop->height);
    loop->task(loop->user, &tile, worker);
}

ca_status ca_for_each_tile(const ca_parallel *parallel, uint32_t width, uint32_t height, ca_tile_task task,
                           void *user, ca_error *error)
{
    tile_loop loop = {.task = task, .user = user, .width = width, .height = height};
    return ca_parallel_for(parallel, tiles_along(width) * tiles_along(height), run_tile, &loop, error);
}
