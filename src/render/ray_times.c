#include "render/ray_times.h"

#include "base/hash.h"
#include "base/memory.h"
#include "render/cost_fit.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum { TILE_SAMPLES = 1024, LIGHT_SAMPLES = 256 };

/* Prior: a candidate costs a third of a segment, give or take as much. */
static const ca_cost_guess candidate_guess = {.ratio = 0.3, .deviation = 0.3};
/* Prior: an iteration without paths takes no time, or as long as some hundreds of light paths. */
static const ca_cost_guess iteration_guess = {.ratio = 0.0, .deviation = 300.0};

typedef struct pixel_work {
    double segments, candidates_per_light_path, camera_paths; /* sums */
} pixel_work;
_Static_assert(sizeof(pixel_work) == CA_RAY_TIMES_PIXEL_BYTES && CA_RAY_TIMES_PIXEL_BYTES == 24,
               "ray_times.h promises 24 bytes a pixel");

/* Up to `capacity` of all samples seen. */
typedef struct sample_list {
    ca_cost_sample *samples; /* borrowed */
    size_t capacity, count;
    uint64_t seen;
} sample_list;

enum { WITHOUT_PAIRS, WITH_PAIRS, KINDS };

/* In cache lines of its own. */
typedef struct worker_times {
    _Alignas(128) sample_list tiles[KINDS];
} worker_times;

struct ca_ray_times {
    uint32_t width, height, workers;
    pixel_work *pixels;     /* owned */
    worker_times *tiles;    /* one a worker, aligned, within: */
    void *tiles_memory;     /* owned */
    sample_list light;
    ca_cost_sample *memory; /* owned: of all lists, then `gathered` */
    ca_cost_sample *gathered; /* all workers' tiles of a kind */
    double *scratch;        /* owned */
};

/* ---- Memory ---------------------------------------------------------------------------------------------------- */

static sample_list empty_list(ca_cost_sample *samples, size_t capacity)
{
    return (sample_list){.samples = samples, .capacity = capacity};
}

/* All lists in the memory, empty. */
static void lay_out(ca_ray_times *t)
{
    ca_cost_sample *memory = t->memory;
    for (uint32_t w = 0; w < t->workers; w++)
        for (int kind = 0; kind < KINDS; kind++, memory += TILE_SAMPLES)
            t->tiles[w].tiles[kind] = empty_list(memory, TILE_SAMPLES);
    t->light = empty_list(memory, LIGHT_SAMPLES);
    t->gathered = memory + LIGHT_SAMPLES;
}

static void thin(sample_list *list, size_t most)
{
    const size_t count = list->count;
    if (count <= most) return;
    for (size_t i = 0; i < most; i++) list->samples[i] = list->samples[i * count / most];
    list->count = most;
    list->seen = most;
}

void ca_ray_times_thin(ca_ray_times *t, size_t most)
{
    for (uint32_t w = 0; w < t->workers; w++)
        for (int kind = 0; kind < KINDS; kind++) thin(&t->tiles[w].tiles[kind], most);
    thin(&t->light, most);
}

static void pool_lists(sample_list *list, const sample_list *other)
{
    const size_t half = list->capacity / 2;
    size_t kept = other->count;
    if (list->count + kept > list->capacity) {
        thin(list, half);
        kept = kept < half ? kept : half;
    }
    for (size_t i = 0; i < kept; i++) list->samples[list->count + i] = other->samples[i * other->count / kept];
    list->count += kept;
    list->seen = list->count;
    assert(list->count <= list->capacity);
}

void ca_ray_times_pool(ca_ray_times *t, const ca_ray_times *other)
{
    assert(t->width == other->width && t->height == other->height && t->workers == other->workers);
    for (uint32_t w = 0; w < t->workers; w++)
        for (int kind = 0; kind < KINDS; kind++) pool_lists(&t->tiles[w].tiles[kind], &other->tiles[w].tiles[kind]);
    pool_lists(&t->light, &other->light);
    for (size_t i = 0; i < (size_t)t->width * t->height; i++) {
        t->pixels[i].segments += other->pixels[i].segments;
        t->pixels[i].candidates_per_light_path += other->pixels[i].candidates_per_light_path;
        t->pixels[i].camera_paths += other->pixels[i].camera_paths;
    }
}

ca_status ca_ray_times_create(ca_ray_times **times, uint32_t width, uint32_t height, uint32_t workers,
                              ca_error *error)
{
    ca_ray_times *t = *times = ca_alloc_zeroed(1, sizeof *t);
    if (!t) return ca_fail_memory(error, "the times of paths");
    const size_t alignment = _Alignof(worker_times), count = (size_t)workers * TILE_SAMPLES;
    t->width = width;
    t->height = height;
    t->workers = workers;
    t->pixels = ca_alloc_zeroed((size_t)width * height, sizeof *t->pixels);
    /* One more than needed, so that there is room to begin at an aligned address. */
    t->tiles_memory = ca_alloc_zeroed((size_t)workers + 1, sizeof *t->tiles);
    t->memory = ca_alloc_zeroed(count * (KINDS + 1) + LIGHT_SAMPLES, sizeof *t->memory);
    t->scratch = ca_alloc_zeroed(count + LIGHT_SAMPLES, sizeof *t->scratch);
    if (!t->pixels || !t->tiles_memory || !t->memory || !t->scratch) {
        ca_ray_times_destroy(t);
        *times = NULL;
        return ca_fail_memory(error, "the times of paths");
    }
    t->tiles = (void *)((char *)t->tiles_memory + (alignment - (uintptr_t)t->tiles_memory % alignment) % alignment);
    lay_out(t);
    return CA_OK;
}

void ca_ray_times_destroy(ca_ray_times *t)
{
    if (!t) return;
    ca_free(t->pixels);
    ca_free(t->tiles_memory);
    ca_free(t->memory);
    ca_free(t->scratch);
    ca_free(t);
}

/* ---- Files ----------------------------------------------------------------------------------------------------- */

static const ca_part_layout sample_layout = {.doubles = 3}, work_layout = {.doubles = 3};
_Static_assert(sizeof(ca_cost_sample) == 3 * sizeof(double), "a sample is three doubles");
static const uint64_t most_seen = UINT64_C(1) << 48;

/* Into a list that is empty, when read. */
static void exchange_list(sample_list *list, ca_part_exchange *x)
{
    uint64_t count = list->count, seen = list->seen;
    ca_part_exchange_u64(x, &count);
    ca_part_exchange_u64(x, &seen);
    if (count > list->capacity || seen < count || seen > most_seen) x->good = false;
    if (!x->good) return;
    ca_part_exchange_array(x, list->samples, (size_t)count, sample_layout);
    list->count = (size_t)count;
    list->seen = seen;
}

/* A worker that is not there: its samples go to another one. */
static void read_other_list(ca_ray_times *t, sample_list *list, ca_part_exchange *x)
{
    sample_list other = empty_list(t->gathered, TILE_SAMPLES);
    exchange_list(&other, x);
    if (x->good) pool_lists(list, &other);
}

void ca_ray_times_exchange(ca_ray_times *t, ca_part_exchange *x)
{
    uint32_t workers = t->workers;
    ca_part_exchange_u32(x, &workers);
    for (uint32_t w = 0; w < workers && x->good; w++)
        for (int kind = 0; kind < KINDS; kind++) {
            if (w < t->workers)
                exchange_list(&t->tiles[w].tiles[kind], x);
            else
                read_other_list(t, &t->tiles[w % t->workers].tiles[kind], x);
        }
    exchange_list(&t->light, x);
    ca_part_exchange_array(x, t->pixels, (size_t)t->width * t->height, work_layout);
}

/* ---- Measuring ------------------------------------------------------------------------------------------------- */

/* Reservoir sampling: each of the n seen is kept with the same probability, so that those kept are a fair choice even
 * where kinds of samples alternate. */
static void add_sample(sample_list *list, const ca_cost_sample *sample)
{
    const uint64_t number = list->seen++;
    if (list->count < list->capacity) {
        list->samples[list->count++] = *sample;
        return;
    }
    const uint64_t place = (ca_hash_add(ca_hash_add(CA_HASH_START, number), number) >> 16) % list->seen;
    if (place < list->capacity) list->samples[place] = *sample;
}

void ca_ray_times_light(ca_ray_times *t, uint64_t light_paths, double seconds)
{
    if (light_paths == 0) return;
    add_sample(&t->light, &(ca_cost_sample){.units = {(double)light_paths, 1.0}, .seconds = seconds});
}

void ca_ray_times_pixel(ca_ray_times *t, uint32_t x, uint32_t y, uint64_t light_paths, uint32_t camera_paths,
                        uint64_t segments, uint64_t candidates)
{
    assert(x < t->width && y < t->height);
    pixel_work *work = &t->pixels[(size_t)y * t->width + x];
    work->segments += (double)segments;
    work->camera_paths += camera_paths;
    if (light_paths > 0) work->candidates_per_light_path += (double)candidates / (double)light_paths;
}

void ca_ray_times_tile(ca_ray_times *t, uint32_t worker, bool with_pairs, uint64_t segments, uint64_t candidates,
                       double seconds)
{
    assert(worker < t->workers);
    add_sample(&t->tiles[worker].tiles[with_pairs ? WITH_PAIRS : WITHOUT_PAIRS],
               &(ca_cost_sample){.units = {(double)segments, (double)candidates}, .seconds = seconds});
}

/* ---- Costs ----------------------------------------------------------------------------------------------------- */

static size_t gather(const ca_ray_times *t, int kind)
{
    size_t count = 0;
    for (uint32_t w = 0; w < t->workers; w++) {
        const sample_list *list = &t->tiles[w].tiles[kind];
        memcpy(&t->gathered[count], list->samples, list->count * sizeof *list->samples);
        count += list->count;
    }
    return count;
}

ca_ray_costs ca_ray_times_costs(const ca_ray_times *t)
{
    ca_ray_costs costs = {0};
    const ca_cost_fit light = ca_fit_costs(t->light.samples, t->light.count, iteration_guess, t->scratch);
    costs.light_path = light.cost[0];
    costs.light_path_error = light.error[0];
    costs.iteration = light.cost[1];
    costs.iteration_error = light.error[1];
    size_t count = gather(t, WITHOUT_PAIRS);
    if (count == 0) {
        count = gather(t, WITH_PAIRS);
        costs.with_pairs = count > 0;
    }
    const ca_cost_fit tiles = ca_fit_costs(t->gathered, count, candidate_guess, t->scratch);
    costs.segment = tiles.cost[0];
    costs.segment_error = tiles.error[0];
    costs.candidate = tiles.cost[1];
    costs.candidate_error = tiles.error[1];
    pixel_work sum = {0};
    for (size_t i = 0; i < (size_t)t->width * t->height; i++) {
        sum.segments += t->pixels[i].segments;
        sum.candidates_per_light_path += t->pixels[i].candidates_per_light_path;
        sum.camera_paths += t->pixels[i].camera_paths;
    }
    costs.segments_per_camera_path = sum.segments / sum.camera_paths;
    costs.candidates_per_pair = sum.candidates_per_light_path / sum.camera_paths;
    costs.camera_path = costs.segment * costs.segments_per_camera_path;
    costs.camera_path_error = costs.segment_error * costs.segments_per_camera_path;
    costs.merge = isnan(costs.candidate) ? 0.0 : costs.candidate * costs.candidates_per_pair;
    return costs;
}

void ca_ray_times_of_pixel(const ca_ray_times *t, const ca_ray_costs *costs, uint32_t x, uint32_t y,
                           double *camera_time, double *merge_time)
{
    assert(x < t->width && y < t->height);
    const pixel_work *work = &t->pixels[(size_t)y * t->width + x];
    const double candidate = isnan(costs->candidate) ? 0.0 : costs->candidate;
    const bool known = work->camera_paths > 0.0;
    *camera_time = costs->segment * (known ? work->segments / work->camera_paths : costs->segments_per_camera_path);
    *merge_time =
        candidate * (known ? work->candidates_per_light_path / work->camera_paths : costs->candidates_per_pair);
}
