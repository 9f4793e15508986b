#include "render/pass.h"

#include "base/clock.h"
#include "base/memory.h"
#include "base/stop.h"
#include "math/numeric.h"

_Static_assert(sizeof(ca_film_sample) == 64, "pass.h promises 64 bytes a camera path");

typedef struct pass_task {
    ca_pass_runner *runner;
    uint32_t pass, round;
    uint64_t light_paths; /* of the round; where times are measured */
} pass_task;

/* ---- Pixels ---------------------------------------------------------------------------------------------------- */

static bool is_radiance(ca_rgb a) { return ca_rgb_is_finite(a) && a.r >= 0.0f && a.g >= 0.0f && a.b >= 0.0f; }

/* The mean of a pixel's camera paths, each checked here as the film checks a single one. Negative lobes of the filter
 * may make the mean negative, as they may a splat: so the mean is added like a splat, after the filter's weight. */
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

/* The first of the samples becomes the pixel's. */
static void finish_pixel(ca_pass_runner *runner, uint32_t x, uint32_t y, ca_film_sample *samples, uint32_t count,
                         uint64_t *rejects)
{
    const ca_render_plan *plan = runner->plan;
    const size_t i = (size_t)y * runner->film->width + x;
    if (count > 1) *samples = mean_of_camera_paths(samples, count, rejects);
    if (plan->type->splat)
        samples->splat = ca_rgb_add(
            samples->splat, plan->type->splat(runner->integrator, plan->crop[0] + x, plan->crop[1] + y));
    if (runner->made)
        runner->made[i] = *samples;
    else if (!ca_film_make_addend(runner->film, samples, &runner->addends[i]))
        ++*rejects;
}

static uint32_t most_camera_paths(const ca_pass_runner *runner)
{
    return runner->counts ? runner->counts->most : runner->plan->camera_paths;
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

/* ---- Groups of pixels ------------------------------------------------------------------------------------------ */

/* Whole pixels of a tile whose camera paths are traced together. */
struct ca_pixel_group {
    uint32_t path_count, pixel_count;
    ca_camera_path *paths; /* owned; [capacity] */
    ca_film_sample *samples; /* owned, likewise; of a pass of one round */
    struct pixel {
        uint32_t x, y, first_path, paths;
    } *pixels; /* owned; [capacity] */
};

static uint32_t group_capacity(const ca_pass_runner *runner)
{
    return ca_max_u32(CA_PASS_GROUP, most_camera_paths(runner));
}

/* Samples are kept from round to round in the runner's buffer, or in the group's own. */
static ca_film_sample *samples_of(const ca_pass_runner *runner, const ca_pixel_group *group, uint32_t x, uint32_t y)
{
    if (runner->rounds == 1) return &group->samples[group->path_count];
    return &runner->samples[((size_t)y * runner->film->width + x) * most_camera_paths(runner)];
}

static void add_pixel(const pass_task *task, ca_pixel_group *group, uint32_t x, uint32_t y)
{
    const ca_pass_runner *runner = task->runner;
    uint32_t first;
    const uint32_t count = camera_paths_of(runner, x, y, task->pass, &first);
    ca_film_sample *samples = samples_of(runner, group, x, y);
    group->pixels[group->pixel_count++] = (struct pixel){x, y, group->path_count, count};
    for (uint32_t b = 0; b < count; b++) {
        if (task->round == 0) samples[b] = (ca_film_sample){0};
        group->paths[group->path_count++] = (ca_camera_path){.x = runner->plan->crop[0] + x,
                                                             .y = runner->plan->crop[1] + y,
                                                             .index = first + b,
                                                             .sample = &samples[b]};
    }
}

static void finish_group_pixel(const pass_task *task, const ca_pixel_group *group, const struct pixel *pixel,
                               uint32_t worker)
{
    ca_pass_runner *runner = task->runner;
    const ca_camera_path *paths = &group->paths[pixel->first_path];
    if (runner->times) {
        uint64_t segments = 0, merges = 0;
        for (uint32_t i = 0; i < pixel->paths; i++) segments += paths[i].segments, merges += paths[i].merges;
        ca_ray_times_pixel(runner->times, pixel->x, pixel->y, task->light_paths, pixel->paths, segments, merges);
    }
    if (task->round + 1 == runner->rounds)
        finish_pixel(runner, pixel->x, pixel->y, paths->sample, pixel->paths, &runner->workers.film_rejects[worker]);
}

/* One that is asked to stop is left out, as the pass will be. */
static void run_group(const pass_task *task, ca_pixel_group *group, uint32_t worker)
{
    ca_pass_runner *runner = task->runner;
    const ca_integrator_type *type = runner->plan->type;
    ca_worker *own = &runner->workers.list[worker];
    if (ca_stop_asked(runner->plan->input.stop)) {
        group->path_count = group->pixel_count = 0;
        return;
    }
    if (runner->gathers_pairs) type->begin_pixel(runner->integrator, own);
    type->camera_paths(runner->integrator, group->paths, group->path_count, task->round, own);
    if (runner->gathers_pairs) type->end_pixel(runner->integrator, group->paths->x, group->paths->y, own);
    for (uint32_t i = 0; i < group->pixel_count; i++) finish_group_pixel(task, group, &group->pixels[i], worker);
    group->path_count = group->pixel_count = 0;
}

/* Pairs are gathered pixel by pixel. */
static bool is_full(const ca_pass_runner *runner, const ca_pixel_group *group)
{
    if (runner->gathers_pairs) return group->pixel_count > 0;
    return group->path_count + most_camera_paths(runner) > group_capacity(runner);
}

static void run_pixels(const pass_task *task, const ca_tile *tile, uint32_t worker)
{
    ca_pixel_group *group = &task->runner->groups[worker];
    for (uint32_t y = tile->y0; y < tile->y1; y++)
        for (uint32_t x = tile->x0; x < tile->x1; x++) {
            if (is_full(task->runner, group)) run_group(task, group, worker);
            add_pixel(task, group, x, y);
        }
    run_group(task, group, worker);
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

/* Worker 0 is the thread that runs the pass. The time of its callback does not count for a tile. */
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
    run_pixels(task, tile, worker);
}

/* The time between two tiles, some hundredths of a percent, counts for the second one. */
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
    const camera_work before = work_of(own);
    run_pixels(task, tile, worker);
    const camera_work after = work_of(own);
    ca_ray_times_tile(runner->times, worker, runner->gathers_pairs, after.segments - before.segments,
                      after.candidates - before.candidates, seconds_of_tile(clock, start));
}

/* ---- Rounds ---------------------------------------------------------------------------------------------------- */

/* The measured time is that of all threads in parallel loops and of one thread between the loops, without the time
 * that threads wait for each other. */
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

static ca_status run_rounds(ca_pass_runner *runner, uint32_t pass, ca_error *error)
{
    for (uint32_t round = 0; round < runner->rounds && !runner->ended; round++) {
        for (uint32_t w = 0; w < runner->workers.parallel.workers; w++) runner->clocks[w].runs = false;
        pass_task task = {.runner = runner, .pass = pass, .round = round};
        if (runner->plan->type->begin_round) CA_TRY(run_light(&task, error));
        CA_TRY(ca_for_each_tile(&runner->workers.parallel, runner->film->width, runner->film->height,
                                runner->times ? time_tile : run_tile, &task, error));
    }
    return CA_OK;
}

/* ---- All or nothing -------------------------------------------------------------------------------------------- */

static void add_tile(void *user, const ca_tile *tile, uint32_t worker)
{
    ca_pass_runner *runner = user;
    const ca_render_plan *plan = runner->plan;
    ca_pair_film *pairs = runner->gathers_pairs ? plan->input.pairs : NULL;
    for (uint32_t y = tile->y0; y < tile->y1; y++) {
        const size_t row = (size_t)y * runner->film->width;
        if (runner->addends)
            ca_film_add_addends(runner->film, tile->x0, y, tile->x1 - tile->x0, &runner->addends[row + tile->x0]);
        for (uint32_t x = tile->x0; x < tile->x1; x++) {
            if (runner->made && !ca_film_add(runner->film, x, y, &runner->made[row + x]))
                runner->workers.film_rejects[worker]++;
            if (pairs) ca_pair_film_commit(pairs, plan->crop[0] + x, plan->crop[1] + y);
        }
    }
}

/* Sums that nobody will read may stay incomplete. A checkpoint and other ranks read them even then. */
static const int *stop_of_commit(const ca_render_settings *settings)
{
    return settings->checkpoint_path || settings->ranks ? NULL : settings->discard;
}

/* What was made becomes a part of all sums. Of several megapixels the first time takes seconds where the system gives
 * memory slowly. */
static ca_status commit(ca_pass_runner *runner, ca_error *error)
{
    const ca_integrator_input *input = &runner->plan->input;
    ca_parallel parallel = runner->workers.parallel;
    parallel.stop = stop_of_commit(runner->plan->settings);
    parallel.between = NULL;
    CA_TRY(ca_for_each_tile(&parallel, runner->film->width, runner->film->height, add_tile, runner, error));
    if (input->technique_images) ca_technique_images_keep(input->technique_images);
    return CA_OK;
}

static void forget(ca_pass_runner *runner)
{
    ca_technique_images *images = runner->plan->input.technique_images;
    ca_workers_restore_counts(&runner->workers, &runner->kept);
    if (images) ca_technique_images_restore(images);
}

ca_status ca_pass_run(ca_pass_runner *runner, uint32_t pass, ca_error *error)
{
    ca_workers_keep_counts(&runner->workers, &runner->kept);
    ca_status status = run_rounds(runner, pass, error);
    if (status == CA_OK && runner->ended) return CA_OK;
    if (status == CA_OK && runner->may_add && !runner->may_add(runner->may_add_user))
        status = ca_fail(error, CA_ERROR_INTERRUPTED, NULL, "the pass is not wanted");
    if (status == CA_OK) status = commit(runner, error);
    if (status != CA_OK) forget(runner);
    return status;
}

/* ---- Memory ---------------------------------------------------------------------------------------------------- */

double ca_pass_buffer_bytes(const ca_render_plan *plan)
{
    return ca_render_plan_pixels(plan) * (double)plan->camera_paths * (double)sizeof(ca_film_sample);
}

static bool create_group(ca_pixel_group *group, uint32_t capacity, bool own_samples)
{
    group->paths = ca_alloc(capacity, sizeof *group->paths);
    group->pixels = ca_alloc(capacity, sizeof *group->pixels);
    group->samples = own_samples ? ca_alloc(capacity, sizeof *group->samples) : NULL;
    return group->paths && group->pixels && (group->samples || !own_samples);
}

static ca_status create_buffers(ca_pass_runner *runner, ca_error *error)
{
    const uint32_t threads = runner->plan->threads;
    const size_t pixels = (size_t)runner->film->width * runner->film->height;
    bool fits = true;
    runner->clocks = ca_alloc_zeroed(threads, sizeof *runner->clocks);
    if (runner->film->parts)
        runner->addends = ca_alloc_large_zeroed(pixels, sizeof *runner->addends);
    else
        runner->made = ca_alloc_large_zeroed(pixels, sizeof *runner->made);
    runner->groups = ca_alloc_zeroed(threads, sizeof *runner->groups);
    if (runner->rounds > 1) {
        runner->samples = ca_alloc_zeroed(pixels, most_camera_paths(runner) * sizeof *runner->samples);
        fits = runner->samples != NULL;
    }
    for (uint32_t i = 0; fits && runner->groups && i < threads; i++)
        fits = create_group(&runner->groups[i], group_capacity(runner), runner->rounds == 1);
    fits = fits && runner->clocks && runner->groups && (runner->made || runner->addends);
    return fits ? CA_OK : ca_fail_memory(error, "the render");
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
    ca_status status = ca_workers_create(&runner->workers, plan->threads, error);
    if (status == CA_OK) status = ca_kept_counts_create(&runner->kept, &runner->workers, error);
    if (status == CA_OK) status = create_buffers(runner, error);
    runner->workers.parallel.stop = plan->input.stop;
    if (status != CA_OK) ca_pass_runner_destroy(runner);
    return status;
}

void ca_pass_runner_destroy(ca_pass_runner *runner)
{
    for (uint32_t i = 0; runner->groups && i < runner->plan->threads; i++) {
        ca_free(runner->groups[i].paths);
        ca_free(runner->groups[i].pixels);
        ca_free(runner->groups[i].samples);
    }
    ca_free(runner->groups);
    ca_free(runner->samples);
    ca_free(runner->clocks);
    ca_free(runner->addends);
    ca_free(runner->made);
    ca_kept_counts_destroy(&runner->kept);
    ca_workers_destroy(&runner->workers);
    *runner = (ca_pass_runner){0};
}
