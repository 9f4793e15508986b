#include "render/aov_layers.h"
#include "render/render.h"

#include "base/clock.h"
#include "base/hash.h"
#include "film/interval_layers.h"
#include "render/auto_method.h"
#include "render/auto_rays.h"
#include "render/blocks.h"
#include "render/kept_passes.h"
#include "render/noise_looks.h"
#include "render/part_counts.h"
#include "render/pass.h"
#include "render/ray_file.h"
#include "render/record.h"
#include "render/replicates.h"
#include "report/technique_page.h"

#include <math.h>
#include <string.h>
#include <sys/resource.h>

/* The noise is first estimated after this many passes, then as noise_looks.h says. */
enum { FIRST_NOISE_PASS = 8 };

typedef struct render {
    ca_render_plan *plan;
    void *integrator;
    ca_film film;
    ca_pass_runner runner;
    ca_ray_file rays; /* of plans with CA_RAYS_OF_FILE */
    ca_kept_passes kept;
    uint32_t passes; /* done, from plan->first_pass on */
    double start, seconds;
    ca_noise_looks looks;
    uint32_t look_passes; /* done at the last look */
    double look_seconds;  /* then */
    bool interrupted;
} render;

bool ca_render_tell(const ca_render_plan *plan, const ca_render_progress *progress, double *start)
{
    const ca_render_settings *settings = plan->settings;
    if (!settings->progress) return true;
    const double before = ca_clock_seconds();
    const bool goes_on = settings->progress(progress, settings->progress_user);
    *start += ca_clock_seconds() - before;
    return goes_on;
}

static void fill_statistics(const render *r, ca_render_statistics *statistics);
static ca_status develop(const render *r, const ca_render_statistics *statistics, ca_image_layers **image,
                         ca_error *error);

ca_status ca_render_check_snapshot(const ca_render_progress *progress, ca_image_layers **image, ca_error *error)
{
    if (image) *image = NULL;
    if (progress && progress->render && image) return CA_OK;
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "a snapshot needs the progress it belongs to and a place for it");
}

/* ca_render_progress.snapshot */
static ca_status take_snapshot(const ca_render_progress *progress, ca_image_layers **image,
                               ca_render_statistics *statistics, ca_error *error)
{
    ca_render_statistics own_statistics;
    CA_TRY(ca_render_check_snapshot(progress, image, error));
    const render *r = progress->render;
    if (!statistics) statistics = &own_statistics;
    fill_statistics(r, statistics);
    return develop(r, statistics, image, error);
}

static uint32_t passes_planned(const ca_render_plan *plan) { return plan->pass_limit - plan->first_pass; }

/* Tells the caller how far it is; false where the render should end. */
static bool report_progress(render *r)
{
    const ca_render_settings *settings = r->plan->settings;
    const ca_render_progress progress = {
        .passes_done = r->passes,
        .passes_total = r->plan->open_ended ? 0 : passes_planned(r->plan),
        .seconds = r->seconds,
        .seconds_total = settings->seconds,
        .seconds_predicted = r->looks.seconds_predicted,
        .noise_percent = r->looks.noise,
        .noise_target = settings->noise_percent,
        .noise_passes = r->look_passes,
        .noise_seconds = r->look_seconds,
        .method = r->plan->method.reason[0] ? r->plan->method.reason : NULL,
        .snapshot = r->plan->first_pass == 0 ? take_snapshot : NULL, /* an image needs all passes from 0 */
        .checkpoint_failure = ca_checkpoint_failure(&r->kept.checkpoint),
        .render = r,
    };
    return ca_render_tell(r->plan, &progress, &r->start);
}

static bool should_stop(const render *r)
{
    const ca_render_settings *settings = r->plan->settings;
    if (r->passes >= passes_planned(r->plan)) return true;
    if (settings->seconds > 0.0 && r->seconds >= settings->seconds) return true;
    return ca_noise_looks_reached(&r->looks);
}

static void look(render *r)
{
    ca_noise_looks_take(&r->looks, r->passes, 100.0 * ca_film_summarise(&r->film).noise, r->seconds,
                        r->seconds / r->passes);
    r->look_passes = r->passes;
    r->look_seconds = r->seconds;
}

/* ---- Checkpoints ----------------------------------------------------------------------------------------------- */

/* ca_checkpoint_writer */
static ca_status write_state(void *user, const char *path, ca_error *error)
{
    const render *r = user;
    const ca_kept_state state = {r->plan, &r->film, r->passes, &r->runner.workers, r->seconds, r->looks};
    return ca_kept_write(&r->kept, &state, path, error);
}

/* What the render is expected to take, s; INFINITY: nobody knows. */
static double whole_seconds(const render *r)
{
    const ca_render_plan *plan = r->plan;
    const double limit = plan->settings->seconds > 0.0 ? plan->settings->seconds : (double)INFINITY;
    if (r->looks.seconds_predicted > 0.0) return fmin(limit, r->looks.seconds_predicted);
    return plan->open_ended ? limit : fmin(limit, r->seconds / r->passes * passes_planned(plan));
}

static void keep(render *r)
{
    if (ca_checkpoint_is_due(&r->kept.checkpoint, r->plan->settings, whole_seconds(r)))
        ca_checkpoint_write(&r->kept.checkpoint, write_state, r);
}

static void keep_last(render *r, bool early)
{
    if (ca_checkpoint_is_wanted(&r->kept.checkpoint, r->plan->settings, early))
        ca_checkpoint_write(&r->kept.checkpoint, write_state, r);
}

/* The time that was taken before counts. With the target that it had, the noise is looked at where it would have
 * been; with another one now. */
static void resume(render *r)
{
    const ca_pass_looks *before = &r->kept.looks;
    r->passes = r->kept.resumed;
    r->start -= r->kept.seconds;
    r->seconds = r->kept.seconds;
    r->looks.noise = before->noise;
    r->looks.next = before->next;
    if (before->target != r->looks.target && r->looks.target > 0.0) look(r);
}

/* ---- The loop -------------------------------------------------------------------------------------------------- */

static ca_status run_pass(render *r, ca_error *error)
{
    CA_TRY(ca_pass_run(&r->runner, ca_replicates_begin_pass(r->plan, r->plan->first_pass + r->passes), error));
    r->passes++;
    r->seconds = ca_clock_seconds() - r->start;
    if (ca_noise_looks_due(&r->looks, r->passes)) look(r);
    return CA_OK;
}

static ca_status make_passes(render *r, ca_error *error)
{
    while (r->passes == 0 || !(r->interrupted || should_stop(r))) {
        CA_TRY(run_pass(r, error));
        keep(r);
        r->interrupted = !report_progress(r) || r->plan->ended;
    }
    return CA_OK;
}

/* The passes before one that was not made whole stay: they are the image, and are kept. */
static ca_status run_passes(render *r, ca_error *error)
{
    r->start = ca_clock_seconds();
    r->looks = ca_noise_looks_start(r->plan->settings->noise_percent, FIRST_NOISE_PASS);
    if (r->kept.resumed > 0)
        resume(r);
    else
        r->start -= r->plan->method.seconds;
    const ca_status status = make_passes(r, error);
    r->interrupted = r->interrupted || status == CA_ERROR_INTERRUPTED;
    if (r->passes > 0) keep_last(r, r->interrupted || status != CA_OK);
    return status == CA_ERROR_INTERRUPTED && r->passes > 0 ? CA_OK : status;
}

void ca_render_summarise(const ca_film_summary *summary, ca_render_statistics *statistics)
{
    struct rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    statistics->peak_memory_bytes = (uint64_t)usage.ru_maxrss * 1024;
    statistics->mean_luminance = summary->mean_luminance;
    statistics->mean_standard_deviation = summary->mean_standard_deviation;
    statistics->noise_percent = isnan(summary->noise) ? -1.0 : 100.0 * summary->noise;
}

static void fill_statistics(const render *r, ca_render_statistics *statistics)
{
    const ca_film_summary summary = ca_film_summarise(&r->film);
    *statistics = (ca_render_statistics){
        .seconds = r->seconds,
        .iterations = r->passes,
        .seed = r->plan->seed,
        .notes = r->plan->scene->desc.notes.items,
        .note_count = r->plan->scene->desc.notes.count,
        .samples_per_pixel = r->passes * r->plan->samples_per_pass,
        .interrupted = r->interrupted,
        .first_predicted_seconds = r->looks.first_predicted_seconds,
        .first_predicted_at = r->looks.first_predicted_at,
        .method = r->plan->method,
        .passes = {r->plan->first_pass, (uint64_t)r->plan->first_pass + r->passes},
        .passes_resumed = r->kept.resumed,
        .numbers_of_rays = {.light_paths = r->rays.light_paths,
                            .camera_paths = r->rays.mean,
                            .predicted_gain = (double)NAN,
                            .iteration_seconds = (double)NAN,
                            .light_path_seconds = (double)NAN,
                            .camera_path_seconds = (double)NAN,
                            .candidate_seconds = (double)NAN},
    };
    ca_render_summarise(&summary, statistics);
    ca_workers_count(&r->runner.workers, statistics);
    ca_part_counts_fill(r->kept.counts, statistics);
}

ca_status ca_render_attach_record(const ca_render_plan *plan, const ca_render_statistics *statistics,
                                  ca_image_layers *layers, ca_error *error)
{
    char integrator[1024], confidence[256];
    ca_integrator_describe(plan->type, &plan->input, integrator, sizeof integrator);
    ca_replicates_describe(plan, (uint32_t)statistics->iterations, confidence, sizeof confidence);
    const ca_render_record record = {
        .version = ca_version(),
        .scene = plan->scene->desc.path,
        .integrator = integrator,
        .sampler = ca_sampler_name(plan->sampler.kind),
        .filter = ca_filter_name(plan->filter.kind),
        .confidence = confidence,
        .seed = (double)plan->seed,
        .samples_per_pixel = statistics->samples_per_pixel,
        .seconds = statistics->seconds,
        .threads = plan->threads,
    };
    return ca_render_record_attach(&record, layers, error);
}

static ca_status develop(const render *r, const ca_render_statistics *statistics, ca_image_layers **image,
                         ca_error *error)
{
    CA_TRY(ca_film_develop(&r->film, image, error));
    ca_status status = ca_render_attach_record(r->plan, statistics, *image, error);
    if (status == CA_OK && r->rays.light_paths > 0)
        status = ca_ray_file_add_layers(&r->rays, r->passes, *image, error);
    if (status != CA_OK) {
        ca_layers_destroy(*image);
        *image = NULL;
    }
    return status;
}

static ca_status write_strategies(const render *r, const ca_technique_images *strategies, ca_error *error)
{
    const char *folder = r->plan->settings->strategies_directory;
    CA_TRY(ca_technique_images_write(strategies, r->passes, folder, error));
    return ca_technique_page_write(strategies, r->passes, folder, error);
}

/* All that is written beside the image. Of several failures the last one is told. */
static ca_status write_files(render *r, ca_error *error)
{
    const ca_technique_images *strategies = r->plan->input.technique_images;
    const char *part = r->plan->settings->part_path;
    ca_status written = r->kept.checkpoint.status;
    if (written != CA_OK && error) *error = r->kept.checkpoint.failure;
    const ca_status images = strategies ? write_strategies(r, strategies, error) : CA_OK;
    if (images != CA_OK) written = images;
    const ca_status sums = part ? write_state(r, part, error) : CA_OK;
    return sums != CA_OK ? sums : written;
}

static ca_status render_film(render *r, ca_image_layers **image, ca_render_statistics *statistics, ca_error *error)
{
    const ca_pass_counts *counts = r->rays.light_paths > 0 ? &r->rays.counts : NULL;
    CA_TRY(ca_pass_runner_create(&r->runner, r->plan, r->integrator, &r->film, counts, error));
    ca_status status = run_passes(r, error);
    const bool has_passes = r->passes > 0;
    if (has_passes) {
        fill_statistics(r, statistics);
        const ca_status written = write_files(r, status == CA_OK ? error : NULL);
        if (status == CA_OK) status = written;
    }
    ca_pass_runner_destroy(&r->runner);
    if (!has_passes) return status;
    /* The image is made whatever failed before; the first failure is the one that is told. */
    const ca_status developed = develop(r, statistics, image, status == CA_OK ? error : NULL);
    return status == CA_OK ? developed : status;
}

/* Passes of several rounds need a buffer, which is then taken from what light paths may have. */
static ca_status create_integrator(render *r, ca_error *error)
{
    ca_render_plan *plan = r->plan;
    CA_TRY(plan->type->create(&plan->input, &r->integrator, error));
    const bool limited = plan->input.memory_bytes > 0.0;
    if (!limited || !plan->type->rounds || plan->type->rounds(r->integrator) == 1) return CA_OK;
    plan->type->destroy(r->integrator);
    r->integrator = NULL;
    const double buffer = ca_pass_buffer_bytes(plan);
    if (buffer >= plan->input.memory_bytes)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "the film and the samples of a pass need %.1f MiB, more than the %.1f MiB allowed",
                       plan->settings->memory_mib + (buffer - plan->input.memory_bytes) / 0x1p20,
                       plan->settings->memory_mib);
    plan->input.memory_bytes -= buffer;
    return plan->type->create(&plan->input, &r->integrator, error);
}

/* Of the numbers of rays that come from a file. */
static uint64_t hash_of_rays(const render *r)
{
    if (r->rays.light_paths == 0) return 0;
    const size_t bytes = (size_t)ca_render_plan_pixels(r->plan) * sizeof *r->rays.camera_paths;
    return ca_hash_bytes(ca_hash_add(CA_HASH_START, r->rays.light_paths), r->rays.camera_paths, bytes);
}

static ca_status create_film(render *r, ca_error *error)
{
    const ca_render_plan *plan = r->plan;
    CA_TRY(ca_film_create(&r->film, plan->camera.width, plan->camera.height, plan->crop, error));
    CA_TRY(ca_film_add_up_in_parts(&r->film, ca_render_plan_extent(plan), error));
    CA_TRY(ca_film_set_replicates(&r->film, ca_replicates_passes(plan), error));
    return ca_kept_restore(&r->kept, plan, &r->film, error);
}

static ca_status run_render(render *r, ca_image_layers **image, ca_render_statistics *statistics, ca_error *error)
{
    ca_render_plan *plan = r->plan;
    if (plan->rays == CA_RAYS_OF_FILE) CA_TRY(ca_ray_file_read(&r->rays, plan, error));
    CA_TRY(ca_kept_check(&r->kept, plan, hash_of_rays(r), error));
    CA_TRY(create_film(r, error));
    if (plan->settings->strategies_directory)
        CA_TRY(ca_technique_images_create(&plan->input.technique_images, plan->crop, error));
    CA_TRY(create_integrator(r, error));
    const ca_status status = render_film(r, image, statistics, error);
    plan->type->destroy(r->integrator);
    return status;
}

/* A choice that a checkpoint tells is not made again. */
static ca_status choose_method(render *r, ca_error *error)
{
    bool used = false;
    CA_TRY(ca_kept_use_method(&r->kept, r->plan, &used, error));
    return used ? CA_OK : ca_auto_method_choose(r->plan, error);
}

static ca_status render_passes(ca_render_plan *plan, ca_image_layers **image, ca_render_statistics *statistics,
                               ca_error *error)
{
    render r = {.plan = plan};
    CA_TRY(ca_kept_start(&r.kept, plan, error));
    ca_status status = ca_render_plan_chooses(plan) ? choose_method(&r, error) : CA_OK;
    if (status == CA_OK) status = run_render(&r, image, statistics, error);
    ca_technique_images_destroy(plan->input.technique_images);
    plan->input.technique_images = NULL;
    ca_film_destroy(&r.film);
    ca_ray_file_destroy(&r.rays);
    ca_kept_destroy(&r.kept);
    return status;
}

static ca_status run_plan(ca_render_plan *plan, ca_image_layers **image, ca_render_statistics *statistics,
                          ca_error *error)
{
    if (ca_render_plan_by_blocks(plan)) return ca_render_blocks(plan, image, statistics, error);
    if (plan->rays == CA_RAYS_AUTO) return ca_auto_rays_render(plan, NULL, image, statistics, error);
    return render_passes(plan, image, statistics, error);
}

ca_status ca_render_plan_run(ca_render_plan *plan, ca_image_layers **image, ca_render_statistics *statistics,
                             ca_error *error)
{
    ca_render_statistics own_statistics;
    if (!statistics) statistics = &own_statistics;
    ca_status status = run_plan(plan, image, statistics, error);
    if (status == CA_OK && *image) status = ca_aov_layers_add(plan, statistics->samples_per_pixel, *image, error);
    if (status == CA_ERROR_INTERRUPTED)
        ca_fail(error, status, NULL, "ended before the first %s was complete: there is no image",
                ca_render_plan_by_blocks(plan) ? "block" : "pass");
    statistics->has_confidence =
        *image && ca_interval_layers_shares(*image, &statistics->confidence_marked, &statistics->confidence_widened);
    return status;
}

ca_status ca_render_check(const ca_scene *scene, const ca_render_settings *settings, ca_error *error)
{
    render r = {.integrator = NULL};
    ca_render_plan plan;
    CA_TRY(ca_render_plan_make(&plan, scene, settings, error));
    if (ca_render_plan_chooses(&plan)) CA_TRY(ca_auto_method_use_finder(&plan, error));
    r.plan = &plan;
    CA_TRY(create_integrator(&r, error));
    plan.type->destroy(r.integrator);
    return CA_OK;
}

ca_status ca_render(const ca_scene *scene, const ca_render_settings *settings, ca_image_layers **image,
                    ca_render_statistics *statistics, ca_error *error)
{
    if (image) *image = NULL;
    if (!scene || !image)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "a render needs a scene and a place for its image");
    ca_render_settings defaults;
    ca_render_settings_init(&defaults);
    ca_render_plan plan;
    CA_TRY(ca_render_plan_make(&plan, scene, settings ? settings : &defaults, error));
    return ca_render_plan_run(&plan, image, statistics, error);
}
