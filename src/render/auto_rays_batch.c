/* Iterations with the numbers in use. */
#include "base/clock.h"
#include "base/memory.h"
#include "render/auto_rays_state.h"

/* Of a render that is kept an iteration's pairs count from its end on: a checkpoint is written after one that failed,
 * too. */
static ca_status hold_pairs(const ca_auto_rays *a, ca_auto_batch *batch, ca_error *error)
{
    if (!ca_auto_is_kept(a)) return CA_OK;
    bool held = (batch->gathered.made = ca_alloc_zeroed(ca_auto_pixels(a), sizeof(ca_pair_moments))) != NULL;
    for (uint32_t i = 0; i < batch->gathered.other_count; i++)
        held = (batch->held[i] = ca_alloc_zeroed(ca_auto_pixels(a), sizeof(ca_pair_moments))) != NULL && held;
    return held ? CA_OK : ca_fail_memory(error, "the noise components");
}

static void release_pairs(ca_auto_batch *batch)
{
    ca_free(batch->gathered.made);
    for (int i = 0; i < CA_AUTO_MOST_OTHERS; i++) ca_free(batch->held[i]);
}

/* The pairs of other numbers are added to films of the caller, who may have several with one batch. */
static void lend_held(const ca_auto_batch *batch, ca_pair_film *pairs)
{
    for (uint32_t i = 0; pairs && i < pairs->other_count; i++) pairs->others[i].made = batch->held[i];
}

static void take_back_held(ca_pair_film *pairs)
{
    for (uint32_t i = 0; pairs && i < pairs->other_count; i++) pairs->others[i].made = NULL;
}

static ca_status set_numbers(ca_auto_rays *a, ca_error *error)
{
    CA_TRY(ca_render_plan_set_light_paths(a->plan, a->numbers.light_paths, error));
    return ca_auto_connects(a) ? ca_render_plan_set_camera_paths(a->plan, a->numbers.most, error) : CA_OK;
}

ca_status ca_auto_batch_begin(ca_auto_rays *a, ca_auto_batch *batch, ca_film *film, const ca_pair_film *pairs,
                              uint32_t done, ca_error *error)
{
    ca_render_plan *plan = a->plan;
    *batch = (ca_auto_batch){
        .counts = {.camera_paths = a->numbers.camera_paths, .first = a->next.camera_path, .most = a->numbers.most},
        .gathered = {.x0 = film->x0,
                     .y0 = film->y0,
                     .width = film->width,
                     .height = film->height},
        .passes = done};
    if (pairs) batch->gathered = *pairs;
    batch->gathered.light_paths = a->numbers.light_paths;
    CA_TRY(hold_pairs(a, batch, error));
    CA_TRY(set_numbers(a, error));
    plan->input.first_light_path = a->next.light_path;
    plan->input.pairs = pairs || !ca_auto_connects(a) ? &batch->gathered : NULL;
    CA_TRY(plan->type->create(&plan->input, &batch->integrator, error));
    return ca_pass_runner_create(&batch->runner, plan, batch->integrator, film, &batch->counts, error);
}

static void gather_into(ca_auto_batch *batch, const ca_pair_film *pairs)
{
    batch->runner.gathers_pairs = pairs != NULL;
    batch->gathered.idle = !pairs;
    if (!pairs) return;
    batch->gathered.means = pairs->means;
    batch->gathered.connected_means = pairs->connected_means;
    batch->gathered.others = pairs->others;
}

/* What is made once belongs to no iteration's time. */
static ca_status prepare(const ca_auto_rays *a, ca_auto_batch *batch, ca_error *error)
{
    const ca_integrator_type *type = a->plan->type;
    ca_workers *workers = &batch->runner.workers;
    if (batch->prepared || !type->prepare) return CA_OK;
    batch->prepared = true;
    return type->prepare(batch->integrator, &workers->parallel, workers->list, error);
}

ca_status ca_auto_batch_run(ca_auto_rays *a, ca_auto_batch *batch, ca_film *film, ca_pair_film *pairs,
                            ca_ray_times *times, double *seconds, ca_error *error)
{
    CA_TRY(prepare(a, batch, error));
    const double start = ca_clock_seconds();
    batch->runner.film = film;
    batch->runner.times = times;
    gather_into(batch, pairs);
    lend_held(batch, pairs);
    const ca_status status = ca_pass_run(&batch->runner, batch->passes, error);
    take_back_held(pairs);
    if (status != CA_OK) return status;
    if (batch->gathered.incomplete) return ca_fail_memory(error, "the pairs of light and camera paths");
    batch->passes++;
    a->iterations++;
    a->next.largest += a->numbers.most;
    const double now = ca_clock_seconds();
    *seconds = now - start;
    a->progress.seconds = now - a->start;
    a->progress.camera_paths += a->numbers.mean;
    return CA_OK;
}

void ca_auto_batch_drop(ca_auto_rays *a, ca_auto_batch *batch)
{
    a->iterations -= batch->passes;
    a->progress.camera_paths -= batch->passes * a->numbers.mean;
    batch->passes = 0;
    ca_workers *workers = &batch->runner.workers;
    for (uint32_t i = 0; i < workers->parallel.workers; i++) {
        workers->list[i].counters = (ca_counters){0};
        workers->film_rejects[i] = 0;
    }
}

void ca_auto_batch_end(ca_auto_rays *a, ca_auto_batch *batch)
{
    for (size_t p = 0; p < ca_auto_pixels(a); p++)
        a->next.camera_path[p] += batch->passes * a->numbers.camera_paths[p];
    a->next.light_path += (uint64_t)batch->passes * a->numbers.light_paths;
    if (batch->runner.workers.list) ca_workers_count(&batch->runner.workers, &a->counts);
    ca_pass_runner_destroy(&batch->runner);
    if (batch->integrator) a->plan->type->destroy(batch->integrator);
    release_pairs(batch);
    a->plan->input.pairs = NULL;
    *batch = (ca_auto_batch){0};
}
