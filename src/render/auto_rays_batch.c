#include "base/clock.h"
#include "render/auto_rays_state.h"

#include <math.h>

void ca_auto_set_uniform(ca_auto_rays *a, uint32_t light_paths, uint32_t camera_paths)
{
    const size_t count = (size_t)a->phase.width * a->phase.height;
    for (size_t p = 0; p < count; p++) a->numbers[p] = camera_paths;
    a->light_paths = light_paths;
    a->most = camera_paths;
    a->mean_numbers = camera_paths;
}

ca_status ca_auto_batch_begin(ca_auto_rays *a, ca_auto_batch *batch, ca_error *error)
{
    ca_render_plan *plan = a->plan;
    *batch = (ca_auto_batch){.counts = {.camera_paths = a->numbers, .first = a->first, .most = a->most}};
    CA_TRY(ca_render_plan_set_light_paths(plan, a->light_paths, error));
    plan->input.first_light_path = a->first_light_path;
    a->gathered = a->halves[0].pairs;
    a->gathered.light_paths = a->light_paths;
    plan->input.pairs = &a->gathered;
    CA_TRY(plan->type->create(&plan->input, &batch->integrator, error));
    return ca_pass_runner_create(&batch->runner, plan, batch->integrator, &a->phase, &batch->counts, error);
}

ca_status ca_auto_batch_run(ca_auto_rays *a, ca_auto_batch *batch, ca_film *film, ca_pair_film *pairs,
                            ca_ray_times *times, double *seconds, ca_error *error)
{
    const double start = ca_clock_seconds();
    batch->runner.film = film;
    batch->runner.times = times;
    batch->runner.gathers_pairs = pairs != NULL;
    if (pairs) a->gathered.pixels = pairs->pixels;
    CA_TRY(ca_pass_run(&batch->runner, batch->passes, error));
    if (a->gathered.incomplete) return ca_fail_memory(error, "the pairs of light and camera paths");
    batch->passes++;
    a->iterations++;
    a->camera_paths += a->mean_numbers;
    a->numbered += a->most;
    const double now = ca_clock_seconds();
    *seconds = now - start;
    a->seconds = now - a->start;
    return CA_OK;
}

void ca_auto_batch_end(ca_auto_rays *a, ca_auto_batch *batch)
{
    const size_t count = (size_t)a->phase.width * a->phase.height;
    for (size_t p = 0; p < count; p++) a->first[p] += batch->passes * a->numbers[p];
    a->first_light_path += (uint64_t)batch->passes * a->light_paths;
    if (batch->runner.workers.list) ca_workers_count(&batch->runner.workers, &a->counts);
    ca_pass_runner_destroy(&batch->runner);
    if (batch->integrator) a->plan->type->destroy(batch->integrator);
    a->plan->input.pairs = NULL;
    *batch = (ca_auto_batch){0};
}
