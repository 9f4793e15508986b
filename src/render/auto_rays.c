#include "render/auto_rays.h"

#include "base/clock.h"
#include "base/memory.h"
#include "noise/ray_map.h"
#include "render/auto_rays_state.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- How far, and what is told --------------------------------------------------------------------------------- */

double ca_auto_work(const ca_auto_rays *a) { return ca_auto_by_samples(a) ? a->camera_paths : a->seconds; }

double ca_auto_work_end(const ca_auto_rays *a)
{
    const ca_render_plan *plan = a->plan;
    if (!ca_auto_by_samples(a)) return plan->settings->seconds > 0.0 ? plan->settings->seconds : (double)INFINITY;
    return plan->settings->samples_per_pixel ? plan->settings->samples_per_pixel
                                             : plan->scene->desc.samples_per_pixel;
}

bool ca_auto_is_over(const ca_auto_rays *a)
{
    const double seconds = a->plan->settings->seconds; /* beside a number of samples, too */
    return a->interrupted || (seconds > 0.0 && a->seconds >= seconds) || ca_noise_looks_reached(&a->looks) ||
           a->numbered + a->most > (double)UINT32_MAX;
}

static ca_status join_image(ca_auto_rays *a, bool at_work, ca_image_layers **image, ca_render_statistics *statistics,
                            ca_error *error);

/* ca_render_progress.snapshot */
static ca_status take_snapshot(const ca_render_progress *progress, ca_image_layers **image,
                               ca_render_statistics *statistics, ca_error *error)
{
    return join_image(progress->render, true, image, statistics, error);
}

void ca_auto_report(ca_auto_rays *a)
{
    const ca_render_settings *settings = a->plan->settings;
    if (a->interrupted) return;
    ca_render_progress progress = {
        .passes_done = a->iterations,
        .seconds = a->seconds,
        .seconds_total = settings->seconds,
        .seconds_predicted = a->looks.seconds_predicted,
        .noise_percent = a->looks.noise,
        .noise_target = settings->noise_percent,
        .render = a,
    };
    /* In the pilot and in a phase's first iteration variances are not known, and the image cannot be joined. */
    if (a->render_iterations > 0 && a->phase.pixels[0].samples >= 2) progress.snapshot = take_snapshot;
    if (ca_auto_by_samples(a)) {
        const double left = (ca_auto_work_end(a) - a->camera_paths) / a->mean_numbers;
        progress.passes_total = a->iterations + (left > 0.0 ? (uint32_t)ceil(left) : 0);
    }
    a->interrupted = !ca_render_tell(a->plan, &progress, &a->start);
}

/* ---- Joining --------------------------------------------------------------------------------------------------- */

/* By the geometric mean of how much the variance could differ, light paths and camera paths: neither samples nor
 * clocks are asked. The plain mean of n iterations has the n^2-th part of the sum of their variances. */
static double ramp_in_ordinary_iterations(const ca_auto_rays *a)
{
    const ca_auto_group *ramp = &a->groups[CA_AUTO_RAMP], *ordinary = &a->groups[CA_AUTO_ORDINARY];
    const double one = 1.0 / sqrt((double)ordinary->light_paths * ordinary->camera_paths);
    return ramp->iterations > 0 ? one * ramp->iterations * ramp->iterations / ramp->variances : 0.0;
}

double ca_auto_pilot_iterations(const ca_auto_rays *a)
{
    return ramp_in_ordinary_iterations(a) + a->groups[CA_AUTO_ORDINARY].iterations;
}

double ca_auto_group_share(const ca_auto_rays *a, int group)
{
    const double ramp = ramp_in_ordinary_iterations(a) / ca_auto_pilot_iterations(a);
    return group == CA_AUTO_RAMP ? ramp : 1.0 - ramp;
}

/* How long the render is with the numbers that this half would have chosen: those in use, and so the seconds of a
 * render to a number of samples, know the other half. */
static double render_seconds(const ca_auto_rays *a, const ca_auto_half *half)
{
    const double done = fmin(ca_auto_work(a), ca_auto_work_end(a)) - a->pilot_work;
    return fmax(done * (ca_auto_by_samples(a) ? half->seconds_per_sample : 1.0), 1e-9);
}

/* Of the render beside both halves of the pilot: precision grows with time and with efficiency, which is what this
 * half's estimates say. Its own samples are not multiplied by it. */
static double weight_of(const ca_auto_rays *a, const ca_auto_half *half)
{
    if (a->render_iterations == 0) return 0.0;
    const double pilot_seconds = ca_auto_pilot_iterations(a) * half->plain_seconds / half->plain_count;
    const double ratio = half->gain * render_seconds(a, half) / fmax(pilot_seconds, 1e-9);
    return ratio / (1.0 + ratio);
}

/* R with the phase at work, into `joined`. */
static void join_phases(const ca_auto_rays *a, ca_joined_film *joined)
{
    ca_joined_film_copy(joined, &a->render);
    if (a->phase_share > 0.0) ca_joined_film_add(joined, &a->phase, a->phase_share);
    ca_joined_film_scale(joined, 1.0 / (a->shares + a->phase_share));
}

void ca_auto_join(ca_auto_rays *a)
{
    const double weights[CA_AUTO_HALVES] = {weight_of(a, &a->halves[0]), weight_of(a, &a->halves[1])};
    ca_joined_film_clear(&a->joined);
    if (a->render_iterations > 0) {
        join_phases(a, &a->joined);
        ca_joined_film_scale(&a->joined, 0.5 * (weights[0] + weights[1]));
    }
    for (int g = 0; g < CA_AUTO_GROUPS; g++) {
        if (a->groups[g].iterations == 0) continue;
        const double share = 0.5 * ca_auto_group_share(a, g);
        ca_joined_film_add_two(&a->joined, &a->halves[0].films[g], share * (1.0 - weights[1]), &a->halves[1].films[g],
                               share * (1.0 - weights[0]));
    }
    ca_joined_film_to_film(&a->joined, a->iterations, &a->image);
}

double ca_auto_noise(ca_auto_rays *a)
{
    ca_auto_join(a);
    const double noise = 100.0 * ca_film_summarise(&a->image).noise;
    a->looks.noise = isnan(noise) ? -1.0 : noise;
    return noise;
}

static void show_parts(ca_auto_rays *a)
{
    ca_auto_parts parts = {.render_iterations = a->render_iterations};
    if (!a->observer) return;
    if (a->render_iterations > 0) {
        join_phases(a, &a->joined);
        parts.render = &a->joined;
    }
    for (int h = 0; h < CA_AUTO_HALVES; h++) {
        parts.weights[h] = weight_of(a, &a->halves[h]);
        for (int g = 0; g < CA_AUTO_GROUPS; g++) parts.pilot[h][g] = &a->halves[h].films[g];
    }
    for (int g = 0; g < CA_AUTO_GROUPS; g++) parts.group_shares[g] = ca_auto_group_share(a, g);
    a->observer->parts(&parts, a->observer->user);
}

/* ---- The image ------------------------------------------------------------------------------------------------- */

static void fill_statistics(const ca_auto_rays *a, ca_render_statistics *statistics)
{
    *statistics = a->counts;
    ca_render_summarise(&a->image, statistics);
    statistics->seconds = a->seconds;
    statistics->iterations = a->iterations;
    statistics->samples_per_pixel = a->camera_paths;
    statistics->interrupted = a->interrupted;
    statistics->first_predicted_seconds = a->looks.first_predicted_seconds;
    statistics->first_predicted_at = a->looks.first_predicted_at;
    statistics->numbers_of_rays = (ca_rays_statistics){
        .light_paths = a->light_paths,
        .camera_paths = a->mean_numbers,
        .phases = a->phases,
        .pilot_seconds = a->pilot_seconds,
        .predicted_gain = a->predicted_gain,
        .iteration_seconds = a->costs.iteration,
        .light_path_seconds = a->costs.light_path,
        .camera_path_seconds = a->costs.camera_path,
        .candidate_seconds = a->costs.candidate,
    };
}

/* Camera paths of a pixel so far. Those of a phase at work are not in first[] yet. */
static double camera_paths_of(const ca_auto_rays *a, size_t pixel, bool at_work)
{
    return a->first[pixel] + (at_work ? (double)a->phase.pixels[pixel].samples * a->numbers[pixel] : 0.0);
}

static ca_status add_layers(const ca_auto_rays *a, bool at_work, const ca_render_statistics *statistics,
                            ca_image_layers *image, ca_error *error)
{
    char text[160];
    float *camera;
    CA_TRY(ca_joined_film_add_confidence(&a->joined, image, error));
    CA_TRY(ca_layers_add(image, "Rays.Camera", &camera, error));
    for (size_t p = 0; p < (size_t)image->width * image->height; p++)
        camera[p] = (float)camera_paths_of(a, p, at_work);
    CA_TRY(ca_render_attach_record(a->plan, statistics, image, error));
    CA_TRY(ca_ray_map_add(image, a->light_paths, a->numbers, error));
    CA_TRY(ca_auto_add_terms(a, image, error));
    snprintf(text, sizeof text,
             "auto: %u light paths and %.4g camera paths per pixel in the end; pilot %.3g s of %.3g s",
             a->light_paths, a->mean_numbers, a->pilot_seconds, a->seconds);
    return ca_layers_set_text(image, "caustica.rays", text, error);
}

static ca_status join_image(ca_auto_rays *a, bool at_work, ca_image_layers **image, ca_render_statistics *statistics,
                            ca_error *error)
{
    ca_auto_join(a);
    fill_statistics(a, statistics);
    CA_TRY(ca_film_develop(&a->image, image, error));
    const ca_status status = add_layers(a, at_work, statistics, *image, error);
    if (status == CA_OK) return CA_OK;
    ca_layers_destroy(*image);
    *image = NULL;
    return status;
}

static ca_status make_image(ca_auto_rays *a, ca_image_layers **image, ca_render_statistics *statistics,
                            ca_error *error)
{
    show_parts(a);
    return join_image(a, false, image, statistics, error);
}

/* ---- Life ------------------------------------------------------------------------------------------------------ */

static ca_status create_half(ca_auto_half *half, const ca_render_plan *plan, ca_error *error)
{
    const uint32_t *crop = plan->crop;
    for (int g = 0; g < CA_AUTO_GROUPS; g++)
        CA_TRY(ca_film_create(&half->films[g], plan->camera.width, plan->camera.height, crop, error));
    CA_TRY(ca_pair_film_create(&half->pairs, crop, 0, 0, error));
    return ca_ray_times_create(&half->times, crop[2] - crop[0], crop[3] - crop[1], plan->threads, error);
}

static ca_status create(ca_auto_rays *a, ca_error *error)
{
    const ca_render_plan *plan = a->plan;
    for (int h = 0; h < CA_AUTO_HALVES; h++) CA_TRY(create_half(&a->halves[h], plan, error));
    CA_TRY(ca_film_create(&a->phase, plan->camera.width, plan->camera.height, plan->crop, error));
    CA_TRY(ca_film_create(&a->image, plan->camera.width, plan->camera.height, plan->crop, error));
    CA_TRY(
        ca_film_set_replicates(&a->image, 0, error)); /* a joined image has no samples that are distributed alike */
    CA_TRY(ca_joined_film_create(&a->render, &a->phase, error));
    CA_TRY(ca_joined_film_create(&a->joined, &a->phase, error));
    const size_t count = (size_t)a->phase.width * a->phase.height;
    a->numbers = ca_alloc_zeroed(count, sizeof *a->numbers);
    a->first = ca_alloc_zeroed(count, sizeof *a->first);
    a->known = ca_alloc_zeroed(count, sizeof *a->known);
    return a->numbers && a->first && a->known ? CA_OK : ca_fail_memory(error, "the numbers of rays");
}

static void destroy(ca_auto_rays *a)
{
    for (int h = 0; h < CA_AUTO_HALVES; h++) {
        for (int g = 0; g < CA_AUTO_GROUPS; g++) ca_film_destroy(&a->halves[h].films[g]);
        ca_pair_film_destroy(&a->halves[h].pairs);
        ca_ray_times_destroy(a->halves[h].times);
    }
    ca_film_destroy(&a->phase);
    ca_film_destroy(&a->image);
    ca_joined_film_destroy(&a->render);
    ca_joined_film_destroy(&a->joined);
    ca_free(a->numbers);
    ca_free(a->first);
    ca_free(a->known);
}

/* What it takes beside the one film that the plan has counted: films, pairs, joined films, times, numbers; and while
 * it chooses an estimate of each pixel and what the choice itself needs. */
static ca_status plan_memory(ca_render_plan *plan, ca_error *error)
{
    enum {
        BYTES_OF_CHOICE = 108,
        BYTES_OF_TIMES = 24,
        BYTES_OF_A_PIXEL = 5 * sizeof(ca_film_pixel) + 2 * sizeof(ca_pair_pixel) + 2 * sizeof(ca_joined_pixel) +
                           2 * BYTES_OF_TIMES + 2 * sizeof(uint32_t) + sizeof(ca_auto_known) + sizeof(ca_ray_pixel) +
                           BYTES_OF_CHOICE
    };
    _Static_assert(BYTES_OF_A_PIXEL == 1492, "auto_rays.h tells the bytes of a pixel");
    const double bytes = (double)BYTES_OF_A_PIXEL * (plan->crop[2] - plan->crop[0]) * (plan->crop[3] - plan->crop[1]);
    if (plan->input.memory_bytes <= 0.0) return CA_OK;
    if (bytes >= plan->input.memory_bytes)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "the films and estimates of rays \"auto\" need %.1f MiB, more than the %.1f MiB allowed",
                       plan->settings->memory_mib + (bytes - plan->input.memory_bytes) / 0x1p20,
                       plan->settings->memory_mib);
    plan->input.memory_bytes -= bytes;
    return CA_OK;
}

ca_status ca_auto_rays_render(ca_render_plan *plan, const ca_auto_observer *observer, ca_image_layers **image,
                              ca_render_statistics *statistics, ca_error *error)
{
    ca_auto_rays a = {.plan = plan,
                      .observer = observer,
                      .start = ca_clock_seconds(),
                      .predicted_gain = (double)NAN,
                      .share_of_work = 1.0,
                      .surprise = 1.0,
                      .looks = ca_noise_looks_start(plan->settings->noise_percent, 0.0)};
    a.costs = (ca_ray_costs){.iteration = (double)NAN,
                             .light_path = (double)NAN,
                             .camera_path = (double)NAN,
                             .candidate = (double)NAN};
    CA_TRY(plan_memory(plan, error));
    CA_TRY(ca_auto_pilot_plan(&a, error));
    ca_status status = create(&a, error);
    if (status == CA_OK) status = ca_auto_pilot_run(&a, error);
    a.pilot_seconds = a.seconds;
    a.pilot_work = ca_auto_work(&a);
    if (status == CA_OK) status = ca_auto_phases_run(&a, error);
    if (status == CA_OK) status = make_image(&a, image, statistics, error);
    destroy(&a);
    return status;
}
