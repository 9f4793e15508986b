/* The pilot of variance-aware weights: a few iterations of a small engine of its own, over the whole film whatever
 * the crop is. Its random numbers are its own, and so its factors are a function of scene, settings and seed alone:
 * weights that depend on them leave the image's mean as it is. Camera paths are at most half of an iteration's, light
 * paths one iteration's, but for small films and few light paths; it has the density of photons from the render. What
 * it keeps is not counted by the limit of the render's memory: the tally, and MOST_LIGHT_PATHS light paths at most,
 * which is less than the smallest chunk of a pass of more light paths takes. */
#include "integrator/bidirectional.h"

#include "base/memory.h"

enum { ITERATIONS = 8, LEAST_LIGHT_PATHS = 1024, MOST_LIGHT_PATHS = 32768, PATHS_OF_TASK = 256 };

/* Set apart from the render's. */
#define PILOT_SEED UINT64_C(0x70696c6f74)

typedef struct pilot_task {
    const ca_bidirectional *pilot;
    ca_worker *workers;
    uint32_t iteration;
} pilot_task;

static void trace_cells(void *user, uint32_t index, uint32_t worker)
{
    const pilot_task *task = user;
    ca_technique_tally *tally = task->pilot->tally;
    ca_camera_path paths[PATHS_OF_TASK];
    ca_film_sample samples[PATHS_OF_TASK];
    const uint32_t first = index * PATHS_OF_TASK;
    const uint32_t count = ca_min_u32(PATHS_OF_TASK, ca_technique_tally_cells(tally) - first);
    for (uint32_t i = 0; i < count; i++) {
        samples[i] = (ca_film_sample){0};
        paths[i] = (ca_camera_path){.index = task->iteration, .sample = &samples[i]};
        ca_technique_tally_pixel(tally, first + i, &paths[i].x, &paths[i].y);
    }
    ca_bidirectional_camera_paths(task->pilot, paths, count, 0, &task->workers[worker]);
    for (uint32_t i = 0; i < count; i++) ca_technique_tally_end(tally, first + i);
}

static ca_status iterate(ca_bidirectional *pilot, const ca_parallel *parallel, ca_worker *workers, ca_error *error)
{
    pilot_task task = {pilot, workers, 0};
    const uint32_t cells = ca_technique_tally_cells(pilot->tally);
    for (; task.iteration < ITERATIONS; task.iteration++) {
        CA_TRY(ca_bidirectional_begin_round(pilot, task.iteration, 0, parallel, workers, error));
        CA_TRY(ca_parallel_for(parallel, (cells + PATHS_OF_TASK - 1) / PATHS_OF_TASK, trace_cells, &task, error));
    }
    return CA_OK;
}

uint32_t ca_factor_pilot_paths(uint32_t light_paths)
{
    const uint32_t share = ca_max_u32(light_paths / ITERATIONS, ca_min_u32(light_paths, LEAST_LIGHT_PATHS));
    return ca_min_u32(share, MOST_LIGHT_PATHS);
}

/* As many photons are found by a merge with fewer light paths and a larger radius. */
static void set_sizes(const ca_bidirectional *b, ca_bidirectional *pilot)
{
    pilot->alpha = 0.0f;
    pilot->radius0 = b->radius0 * sqrtf((float)b->light_paths / (float)pilot->light_paths);
}

static ca_status create_pilot(const ca_bidirectional *b, const ca_sampler *sampler, ca_bidirectional **pilot,
                              ca_error *error)
{
    ca_integrator_input input = b->input;
    ca_mis_rules rules = b->rules;
    input.sampler = sampler;
    input.crop[0] = input.crop[1] = 0;
    input.crop[2] = input.camera->width, input.crop[3] = input.camera->height;
    input.technique_images = NULL;
    input.camera_paths = NULL;
    input.observer = NULL;
    input.pairs = NULL;
    input.memory_bytes = 0.0;
    input.first_light_path = 0;
    rules.factors = rules.splat = false;
    const uint32_t light_paths = ca_factor_pilot_paths(b->light_paths);
    CA_TRY(ca_integrator_set_guide(&ca_integrator_vavcm, b->guide, &input, error));
    CA_TRY(ca_integrator_set_number(&ca_integrator_vavcm, "light_paths", (double)light_paths, &input, error));
    CA_TRY(ca_integrator_set_number(&ca_integrator_vavcm, "camera_paths", 1.0, &input, error));
    void *state;
    CA_TRY(ca_bidirectional_create(&ca_integrator_vavcm, &rules, &input, &state, error));
    *pilot = state;
    set_sizes(b, *pilot);
    return CA_OK;
}

/* Paths of the pilot are not the render's: its counters stay as they were. */
static ca_status run_pilot(ca_bidirectional *pilot, const ca_parallel *parallel, ca_worker *workers,
                           ca_factor_map **map, ca_error *error)
{
    const ca_camera *camera = pilot->input.camera;
    const uint32_t count = pilot->input.workers;
    ca_counters *kept = ca_alloc(count, sizeof *kept);
    if (!kept) return ca_fail_memory(error, "the pilot of techniques");
    for (uint32_t i = 0; i < count; i++) kept[i] = workers[i].counters;
    ca_status status = ca_technique_tally_create(&pilot->tally, camera->width, camera->height, error);
    if (status == CA_OK) status = iterate(pilot, parallel, workers, error);
    if (status == CA_OK) status = ca_factor_map_create(map, pilot->tally, ITERATIONS, error);
    ca_technique_tally_destroy(pilot->tally);
    for (uint32_t i = 0; i < count; i++) workers[i].counters = kept[i];
    ca_free(kept);
    return status;
}

ca_status ca_factor_pilot(const ca_bidirectional *b, const ca_parallel *parallel, ca_worker *workers,
                          ca_factor_map **map, ca_error *error)
{
    ca_sampler sampler = {.kind = CA_SAMPLER_INDEPENDENT,
                          .seed = ca_pcg_permute(b->input.sampler->seed ^ PILOT_SEED)};
    ca_sampler_prepare(&sampler, b->input.camera->width, b->input.camera->height);
    ca_bidirectional *pilot;
    CA_TRY(create_pilot(b, &sampler, &pilot, error));
    pilot->pilot = b->pilot; /* borrowed: of as many light paths, in cells of its radius */
    pilot->pilot_scale = 1.0f;
    const ca_status status = run_pilot(pilot, parallel, workers, map, error);
    pilot->pilot = NULL;
    ca_bidirectional_destroy(pilot);
    return status;
}
