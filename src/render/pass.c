#include "render/pass.h"

#include "base/clock.h"
#include "base/memory.h"

_Static_assert(sizeof(ca_film_sample) == 64, "pass.h promises 64 bytes a camera path");

typedef struct pass_task {
    ca_pass_runner *runner;
    uint32_t pass, round;
    uint64_t light_paths; /* of the round; where times are measured */
} pass_task;

/* ---- Pixels ---------------------------------------------------------------------------------------------------- */

static bool is_radiance(ca_rgb a) { return ca_rgb_is_finite(a) && a.r >= 0.0f && a.g >= 0.0f && a.b >= 0.0f; }

/* The mean of a pixel's camera paths, each judged here as the film judges a single one. Negative lobes of the filter
 * may make the mean negative, as they may a splat: so it takes the place of one, behind the filter. */
static ca_film_sample mean_of_camera_paths(const ca_film_sample *samples, uint32_t count, uint64_t *rejects)
{
    ca_film_sample mean = {.filter_weight = 1.0f};
    for (uint32_t i = 0; i < count; i++) {
        const ca_film_sample *sample = &samples[i];
        if (is_radiance(sample->radiance))
            mean.splat = ca_rgb_madd(mean.splat, sample->filter_weight, sample->radiance);
        else
            ++*rejects;
        mean.albedo = ca_rgb_add(mean.albedo, sample->albedo);
        mean.normal = ca_add(mean.normal, sample->normal);
        mean.position = ca_add(mean.position, sample->position);
    }
    const float scale = 1.0f / (float)count;
    mean.splat = ca_rgb_scale(mean.splat, scale);
    mean.albedo = ca_rgb_scale(mean.albedo, scale);
    mean.normal = ca_mul(mean.normal, scale);
    mean.position = ca_mul(mean.position, scale);
    return mean;
}

static void finish_pixel(ca_pass_runner *runner, uint32_t x, uint32_t y, const ca_film_sample *samples,
                         uint32_t count, uint64_t *rejects)
{
    const ca_render_plan *plan = runner->plan;
    ca_film_sample sample = count == 1 ? samples[0] : mean_of_camera_paths(samples, count, rejects);
    if (plan->type->splat)
        sample.splat = ca_rgb_add(
            sample.splat, plan->type->splat(runner->integrator, plan->crop[0] + x, plan->crop[1] + y));
    if (!ca_film_add(runner->film, x, y, &sample)) ++*rejects;
}

static uint32_t most_camera_paths(const ca_pass_runner *runner)
{
    return runner->counts ? runner->counts->most : runner->plan->camera_paths;
}

/* Where the samples of a pixel's camera paths are kept; in a pass of one round, where one pixel is finished before
 * the next one begins, in the worker's own row. */
static ca_film_sample *samples_of(const ca_pass_runner *runner, uint32_t x, uint32_t y, uint32_t worker)
{
    const size_t row = runner->rounds > 1 ? (size_t)y * runner->film->width + x : worker;
    return &runner->samples[row * most_camera_paths(runner)];
}

/* How many camera paths a pixel has in a pass, and the number of the first one. */
static uint32_t camera_paths_of(const ca_pass_runner *runner, uint32_t x, uint32_t y, uint32_t pass, uint32_t *first)
{
    const ca_pass_counts *counts = runner->counts;
    const size_t pixel = (size_t)y * runner->film->width + x;
    const uint32_t count = counts ? counts->camera_paths[pixel] : runner->plan->camera_paths;
    *first = pass * count + (counts ? counts->first[pixel] : 0);
    return count;
}

/* Gives back how many camera paths that were. */
static uint32_t run_pixel(const pass_task *task, uint32_t x, uint32_t y, uint32_t worker)
{
    ca_pass_runner *runner = task->runner;
    const ca_integrator_type *type = runner->plan->type;
    ca_worker *own = &runner->workers.list[worker];
    const uint32_t film_x = runner->plan->crop[0] + x, film_y = runner->plan->crop[1] + y;
    uint32_t first;
    const uint32_t count = camera_paths_of(runner, x, y, task->pass, &first);
    ca_film_sample *samples = samples_of(runner, x, y, worker);
    if (runner->gathers_pairs) type->begin_pixel(runner->integrator, own);
    for (uint32_t b = 0; b < count; b++) {
        if (task->round == 0) samples[b] = (ca_film_sample){0};
        type->camera_path(runner->integrator, film_x, film_y, first + b, task->round, &samples[b], own);
    }
    if (runner->gathers_pairs) type->end_pixel(runner->integrator, film_x, film_y, own);
    if (task->round + 1 == runner->rounds)
        finish_pixel(runner, x, y, samples, count, &runner->workers.film_rejects[worker]);
    return count;
}

/* ---- Tiles, and what they take --------------------------------------------------------------------------------- */

typedef struct camera_work {
    uint64_t segments, candidates;
} camera_work;

static camera_work work_of(const ca_worker *worker)
{
    const ca_counters *counters = &worker->counters;
    return (camera_work){counters->rays + counters->shadow_rays, counters->merges};
}

static camera_work between(camera_work before, camera_work now)
{
    return (camera_work){now.segments - before.segments, now.candidates - before.candidates};
}

/* Worker 0 is the thread that runs the pass. What it does when asked is no part of a tile. */
static bool is_ended(ca_pass_runner *runner, uint32_t worker)
{
    if (!runner->goes_on) return false;
    if (worker == 0) {
        if (!runner->goes_on(runner->goes_on_user)) runner->ended = true;
        runner->clocks[0].runs = false;
    }
    return runner->ended;
}

static void run_tile(void *user, const ca_tile *tile, uint32_t worker)
{
    const pass_task *task = user;
    if (is_ended(task->runner, worker)) return;
    for (uint32_t y = tile->y0; y < tile->y1; y++)
        for (uint32_t x = tile->x0; x < tile->x1; x++) run_pixel(task, x, y, worker);
}

/* What two tiles have between them, some hundredths of a percent, counts for the second one. */
static double seconds_of_tile(ca_tile_clock *clock, double start)
{
    clock->seconds = ca_clock_thread_seconds();
    clock->runs = true;
    return clock->seconds - start;
}

static void time_tile(void *user, const ca_tile *tile, uint32_t worker)
{
    const pass_task *task = user;
    ca_pass_runner *runner = task->runner;
    if (is_ended(runner, worker)) return;
    const ca_worker *own = &runner->workers.list[worker];
    ca_tile_clock *clock = &runner->clocks[worker];
    const double start = clock->runs ? clock->seconds : ca_clock_thread_seconds();
    const camera_work at_start = work_of(own);
    camera_work before = at_start;
    for (uint32_t y = tile->y0; y < tile->y1; y++)
        for (uint32_t x = tile->x0; x < tile->x1; x++) {
            const uint32_t count = run_pixel(task, x, y, worker);
            const camera_work now = work_of(own), work = between(before, now);
            ca_ray_times_pixel(runner->times, x, y, task->light_paths, count, work.segments, work.candidates);
            before = now;
        }
    const camera_work work = between(at_start, before);
    ca_ray_times_tile(runner->times, worker, runner->gathers_pairs, work.segments, work.candidates,
                      seconds_of_tile(clock, start));
}

/* ---- Rounds ---------------------------------------------------------------------------------------------------- */

/* What it takes: what threads do in loops, and one thread between them, but not waiting for each other. */
static ca_status run_light(pass_task *task, ca_error *error)
{
    ca_pass_runner *runner = task->runner;
    const ca_integrator_type *type = runner->plan->type;
    ca_parallel_seconds loops = {0};
    ca_parallel parallel = runner->workers.parallel;
    if (runner->times) parallel.seconds = &loops;
    const double start = runner->times ? ca_clock_thread_seconds() : 0.0;
    const uint64_t before = ca_workers_light_paths(&runner->workers);
    CA_TRY(type->begin_round(runner->integrator, task->pass, task->round, &parallel, runner->workers.list, error));
    task->light_paths = ca_workers_light_paths(&runner->workers) - before;
    if (!runner->times) return CA_OK;
    const double between_loops = ca_clock_thread_seconds() - start - loops.calling_thread;
    ca_ray_times_light(runner->times, task->light_paths, between_loops + loops.tasks);
    return CA_OK;
}

ca_status ca_pass_run(ca_pass_runner *runner, uint32_t pass, ca_error *error)
{
    for (uint32_t round = 0; round < runner->rounds && !runner->ended; round++) {
        for (uint32_t w = 0; w < runner->workers.parallel.workers; w++) runner->clocks[w].runs = false;
        pass_task task = {.runner = runner, .pass = pass, .round = round};
        if (runner->plan->type->begin_round) CA_TRY(run_light(&task, error));
        ca_for_each_tile(&runner->workers.parallel, runner->film->width, runner->film->height,
                         runner->times ? time_tile : run_tile, &task);
    }
    return CA_OK;
}

/* ---- Memory ---------------------------------------------------------------------------------------------------- */

double ca_pass_buffer_bytes(const ca_render_plan *plan)
{
    return (double)(plan->crop[2] - plan->crop[0]) * (double)(plan->crop[3] - plan->crop[1]) *
           (double)plan->camera_paths * (double)sizeof(ca_film_sample);
}

ca_status ca_pass_runner_create(ca_pass_runner *runner, const ca_render_plan *plan, void *integrator, ca_film *film,
                                const ca_pass_counts *counts, ca_error *error)
{
    *runner = (ca_pass_runner){.plan = plan,
                               .integrator = integrator,
                               .film = film,
                               .counts = counts,
                               .gathers_pairs = plan->input.pairs != NULL,
                               .rounds = plan->type->rounds ? plan->type->rounds(integrator) : 1};
    const size_t rows = runner->rounds > 1 ? (size_t)film->width * film->height : plan->threads;
    ca_status status = ca_workers_create(&runner->workers, plan->threads, error);
    if (status == CA_OK) {
        runner->samples = ca_alloc_zeroed(rows, most_camera_paths(runner) * sizeof *runner->samples);
        runner->clocks = ca_alloc_zeroed(plan->threads, sizeof *runner->clocks);
        if (!runner->samples || !runner->clocks) status = ca_fail_memory(error, "the render");
    }
    if (status != CA_OK) ca_pass_runner_destroy(runner);
    return status;
}

void ca_pass_runner_destroy(ca_pass_runner *runner)
{
    ca_free(runner->samples);
    ca_free(runner->clocks);
    ca_workers_destroy(&runner->workers);
    *runner = (ca_pass_runner){0};
}
