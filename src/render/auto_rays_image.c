/* Joining the pilot's halves with R, the mean of all runs; the noise of that, and the image. */
#include "base/loading.h"
#include "base/memory.h"
#include "base/text.h"
#include "noise/ray_map.h"
#include "render/auto_rays_state.h"
#include "render/public_structs.h"

#include <stdio.h>

/* ---- Weights --------------------------------------------------------------------------------------------------- */

static double pilot_worth(const ca_auto_rays *a) { return ca_pilot_worth(&a->ramp, &a->ordinary); }

void ca_auto_weights(const ca_auto_rays *a, double weights[CA_PILOT_HALVES])
{
    if (ca_auto_repeats(a)) {
        for (int h = 0; h < CA_PILOT_HALVES; h++) weights[h] = a->render_iterations == 0 ? 0.0 : a->script.weights[h];
        return;
    }
    ca_auto_progress progress = a->progress;
    uint32_t iterations = a->render_iterations;
    if (a->work && a->work->iterations < 2) { /* which the image leaves out */
        progress.camera_paths -= a->work->iterations * a->numbers.mean;
        iterations -= a->work->iterations;
    }
    const double now = fmin(ca_auto_work(&a->goal, &progress), ca_auto_work_end(&a->goal));
    for (int h = 0; h < CA_PILOT_HALVES; h++)
        weights[h] = iterations == 0
                         ? 0.0
                         : ca_pilot_render_weight(&a->verdicts[h], &a->goal, now - a->pilot_work, pilot_worth(a));
}

double ca_auto_share_at_work(const ca_auto_rays *a, const ca_auto_run *run)
{
    if (ca_auto_repeats(a)) return ca_auto_script_group(a)->share;
    return ca_auto_run_share(run, ca_auto_work(&a->goal, &a->progress));
}

static double share_at_work(const ca_auto_rays *a)
{
    return a->work ? ca_auto_share_at_work(a, a->work->run) : 0.0;
}

/* ---- The noise so far ------------------------------------------------------------------------------------------ */

static double noise_of(ca_auto_rays *a, ca_joined_sums sums)
{
    const bool known = sums.luminance > 0.0;
    const double noise =
        known ? 100.0 * sqrt(sums.variance * (double)ca_auto_pixels(a)) / sums.luminance : (double)NAN;
    ca_noise_looks *looks = &a->progress.looks;
    looks->noise = known ? noise : -1.0;
    looks->given_up = !known && looks->target > 0.0 && a->progress.camera_paths >= looks->patience;
    a->look_iterations = a->iterations;
    a->look_seconds = a->progress.seconds;
    return noise;
}

double ca_auto_look(ca_auto_rays *a)
{
    double weights[CA_PILOT_HALVES];
    ca_auto_weights(a, weights);
    ca_joined_sums sums = ca_halved_film_sums(&a->pilot, 0.5 * (1.0 - weights[1]), 0.5 * (1.0 - weights[0]));
    const double share = share_at_work(a), factor = 0.5 * (weights[0] + weights[1]) / (a->shares + share);
    if (a->shares > 0.0) sums = ca_joined_sums_add(sums, ca_joined_sums_of(&a->render), factor);
    if (share > 0.0) sums = ca_joined_sums_add(sums, ca_joined_sums_of_film(&a->work->film), factor * share);
    return noise_of(a, sums);
}

double ca_auto_look_in_pilot(ca_auto_rays *a, const ca_film *films)
{
    const double ramp = ca_pilot_ramp_share(&a->ramp, &a->ordinary);
    const ca_joined_sums none = {0}, first = ca_joined_sums_add(none, ca_halved_film_sums(&a->pilot, 0.5, 0.5), ramp);
    return noise_of(a, ca_joined_sums_add(first, ca_joined_sums_of_two(&films[0], &films[1]), 1.0 - ramp));
}

/* ---- Joining --------------------------------------------------------------------------------------------------- */

/* From R, or nothing where there is none, to the image. */
static void join_pilot(const ca_auto_rays *a, ca_joined_film *image)
{
    double weights[CA_PILOT_HALVES];
    ca_auto_weights(a, weights);
    ca_joined_film_scale(image, 0.5 * (weights[0] + weights[1]));
    ca_halved_film_join(&a->pilot, 0.5 * (1.0 - weights[1]), 0.5 * (1.0 - weights[0]), image);
}

static void show_parts(const ca_auto_rays *a, const ca_joined_film *render)
{
    ca_auto_parts parts = {.pilot = &a->pilot, .render_iterations = a->render_iterations};
    if (!a->observer) return;
    if (a->render_iterations > 0) parts.render = render;
    ca_auto_weights(a, parts.weights);
    a->observer->parts(&parts, a->observer->user);
}

/* ---- The image ------------------------------------------------------------------------------------------------- */

void ca_auto_tell_numbers(const ca_auto_rays *a, ca_rays_statistics *told)
{
    *told = (ca_rays_statistics){
        .light_paths = a->numbers.light_paths,
        .camera_paths = a->numbers.mean,
        .phases = a->runs + (a->work != NULL),
        .pilot_seconds = a->pilot_seconds,
        .predicted_gain = a->predicted_gain,
        .iteration_seconds = a->costs.iteration,
        .light_path_seconds = a->costs.light_path,
        .camera_path_seconds = a->costs.camera_path,
        .candidate_seconds = a->costs.candidate,
    };
}

static void fill_statistics(const ca_auto_rays *a, const ca_joined_film *image, ca_render_statistics *statistics)
{
    const ca_film_summary summary = ca_joined_film_summarise(image, a->iterations, &a->frame);
    *statistics = a->counts;
    ca_render_summarise(&summary, statistics);
    statistics->seconds = a->progress.seconds;
    statistics->method = a->plan->method;
    statistics->iterations = a->iterations;
    statistics->seed = a->plan->seed;
    statistics->notes = a->plan->scene->desc.notes.items;
    statistics->note_count = a->plan->scene->desc.notes.count;
    statistics->samples_per_pixel = a->progress.camera_paths;
    statistics->interrupted = a->interrupted;
    statistics->passes_resumed = a->kept.iterations;
    statistics->keeps_checkpoint = a->kept.checkpoint.is_kept;
    statistics->first_predicted_seconds = a->progress.looks.first_predicted_seconds;
    statistics->first_predicted_at = a->progress.looks.first_predicted_at;
    ca_auto_tell_numbers(a, &statistics->numbers_of_rays);
}

/* Those of a run at work are not numbered yet. */
static double camera_paths_of(const ca_auto_rays *a, size_t pixel)
{
    const double at_work = a->work ? (double)a->work->iterations * a->numbers.camera_paths[pixel] : 0.0;
    return a->next.camera_path[pixel] + at_work;
}

static ca_status add_layers(const ca_auto_rays *a, const ca_render_statistics *statistics, ca_image_layers *image,
                            ca_error *error)
{
    char text[160];
    float *camera;
    CA_TRY(ca_layers_add(image, "Rays.Camera", &camera, error));
    for (size_t p = 0; p < ca_auto_pixels(a); p++) camera[p] = (float)camera_paths_of(a, p);
    CA_TRY(ca_render_attach_record(a->plan, statistics, image, error));
    CA_TRY(ca_ray_map_add(image, a->numbers.light_paths, a->numbers.camera_paths, error));
    CA_TRY(ca_auto_known_add_layers(a->known, a->numbers.light_paths, a->numbers.camera_paths, image, error));
    snprintf(text, sizeof text,
             "%s: %u %s and %.4g %s per pixel in the last iterations; pilot %.3g s of %.3g s",
             ca_auto_repeats(a) ? "repeated" : "auto", a->numbers.light_paths,
             ca_noun(a->numbers.light_paths, "light path", "light paths"), a->numbers.mean,
             ca_noun(a->numbers.mean, "camera path", "camera paths"), a->pilot_seconds, a->progress.seconds);
    return ca_layers_set_text(image, "caustica.rays", text, error);
}

static ca_status develop(const ca_auto_rays *a, const ca_joined_film *joined, ca_image_layers **image,
                         ca_render_statistics *statistics, ca_error *error)
{
    fill_statistics(a, joined, statistics);
    CA_TRY(ca_joined_film_develop(joined, a->iterations, &a->frame, a->plan->threads, image, error));
    const ca_status status = add_layers(a, statistics, *image, error);
    if (status == CA_OK) return CA_OK;
    ca_layers_destroy(*image);
    *image = NULL;
    return status;
}

ca_status ca_auto_snapshot(const ca_render_progress *progress, ca_image_layers **image,
                           ca_render_statistics *statistics, ca_error *error)
{
    ca_render_statistics told;
    CA_TRY(ca_render_check_snapshot(progress, image, error));
    CA_TRY(ca_statistics_take(statistics, &told, error));
    const ca_auto_rays *a = progress->render;
    ca_joined_film joined;
    const double share = share_at_work(a);
    CA_TRY(ca_joined_film_create(&joined, &a->frame, error));
    ca_joined_film_copy(&joined, &a->render);
    ca_joined_film_add(&joined, &a->work->film, share);
    ca_joined_film_scale(&joined, 1.0 / (a->shares + share));
    join_pilot(a, &joined);
    const ca_status status = develop(a, &joined, image, &told, error);
    ca_statistics_give(&told, statistics);
    ca_joined_film_destroy(&joined);
    return status;
}

/* R's film becomes the image's; of a render that ended in its pilot there is none yet. */
static ca_status take_render(ca_auto_rays *a, ca_joined_film *image, ca_error *error)
{
    if (a->render_iterations == 0) return ca_joined_film_create(image, &a->frame, error);
    *image = a->render;
    a->render = (ca_joined_film){0};
    ca_joined_film_scale(image, 1.0 / a->shares);
    return CA_OK;
}

ca_status ca_auto_finish(ca_auto_rays *a, ca_image_layers **image, ca_render_statistics *statistics, ca_error *error)
{
    ca_joined_film joined;
    ca_ray_times_destroy(a->times);
    a->times = NULL;
    CA_TRY(ca_stop_check(a->plan->settings->discard, error));
    CA_TRY(take_render(a, &joined, error));
    show_parts(a, &joined);
    join_pilot(a, &joined);
    ca_halved_film_destroy(&a->pilot);
    const int *before = ca_loading_until(a->plan->settings->discard);
    const ca_status status = develop(a, &joined, image, statistics, error);
    ca_loading_until(before);
    ca_joined_film_destroy(&joined);
    return status;
}
