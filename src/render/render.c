#include "render/aov_layers.h"
#include "render/render.h"

#include "base/clock.h"
#include "base/hash.h"
#include "base/loading.h"
#include "base/memory.h"
#include "film/confidence.h"
#include "film/interval_layers.h"
#include "math/numeric.h"
#include "render/auto_file.h"
#include "render/auto_method.h"
#include "render/auto_rays.h"
#include "render/blocks.h"
#include "render/kept_method.h"
#include "render/kept_passes.h"
#include "render/noise_looks.h"
#include "render/part_counts.h"
#include "render/part_settings.h"
#include "render/pass.h"
#include "render/public_structs.h"
#include "render/rank_sums.h"
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
    const ca_ranks *ranks; /* borrowed; NULL: the render is this process's alone. Else likewise: */
    ca_rank_work work;
    ca_rank_film rank_film;
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
    ca_render_statistics told;
    CA_TRY(ca_render_check_snapshot(progress, image, error));
    CA_TRY(ca_statistics_take(statistics, &told, error));
    const render *r = progress->render;
    fill_statistics(r, &told);
    ca_statistics_give(&told, statistics);
    return develop(r, &told, image, error);
}

static void gather_for_progress(const ca_render_progress *progress);

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
        .gather = r->ranks ? gather_for_progress : NULL,
        .render = r,
    };
    return ca_render_tell(r->plan, &progress, &r->start);
}

static bool should_stop(const render *r)
{
    const ca_render_settings *settings = r->plan->settings;
    if (r->passes >= passes_planned(r->plan)) return true;
    if (settings->seconds > 0.0 && r->seconds >= settings->seconds) return true;
    return ca_noise_looks_over(&r->looks);
}

static void look(render *r)
{
    ca_noise_looks_take(&r->looks, r->passes, 100.0 * ca_film_summarise(&r->film).noise, r->seconds,
                        r->seconds / r->passes);
    r->look_passes = r->passes;
    r->look_seconds = r->seconds;
}

/* Without a target it is only shown: what there is on this rank tells of the rest. */
static void look_at_own(render *r)
{
    const double known = (double)r->work.in_sums / r->passes;
    const double noise = 100.0 * ca_film_summarise(&r->film).noise * sqrt(known);
    ca_noise_looks_take(&r->looks, r->passes, noise, r->seconds, r->seconds / r->passes);
    r->look_passes = r->passes;
    r->look_seconds = r->seconds;
}

/* ---- With other ranks ------------------------------------------------------------------------------------------ */

/* ca_rank_work.make */
static ca_status make_range(void *user, ca_work_range range, uint64_t *made, ca_error *error)
{
    render *r = user;
    ca_status status = CA_OK;
    for (*made = 0; *made < range.end - range.begin; ++*made) {
        const uint32_t pass = (uint32_t)(range.begin + *made);
        status = ca_pass_run(&r->runner, ca_replicates_begin_pass(r->plan, pass), error);
        if (status != CA_OK) break;
    }
    r->seconds = ca_clock_seconds() - r->start;
    return status;
}

/* The film then has all passes before the border of r->work: r->passes. */
static ca_status gather(render *r, ca_error *error)
{
    const ca_status status = ca_rank_work_gather(&r->work, error);
    r->passes = (uint32_t)r->work.in_sums;
    return status;
}

/* ca_render_progress.gather */
static void gather_for_progress(const ca_render_progress *progress)
{
    render *r = progress->render;
    (void)gather(r, NULL); /* what fails on this rank fails again with the next pass */
    ca_rank_work_go_on(&r->work, r->work.look);
}

/* ---- Checkpoints ----------------------------------------------------------------------------------------------- */

static ca_status write_film(const render *r, const char *path, ca_error *error)
{
    uint64_t others[CA_PART_COUNTS] = {0};
    if (r->ranks) ca_rank_work_count(&r->work, others);
    const ca_kept_state state = {r->plan, &r->film, r->passes,  &r->runner.workers,
                                 &r->rays, others,   r->seconds, r->looks};
    CA_TRY(ca_rank_work_check_whole(&r->work, path, "passes", error));
    return ca_kept_write(&r->kept, &state, path, error);
}

/* ca_checkpoint_writer. At the end all is gathered. */
static ca_status write_state(void *user, const char *path, ca_error *error)
{
    render *r = user;
    const bool gathers = ca_rank_work_is_open(&r->work);
    if (gathers) CA_TRY(gather(r, error));
    const ca_status status = write_film(r, path, error);
    if (gathers) ca_rank_work_go_on(&r->work, r->work.look);
    return status;
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
    ca_checkpoint_keep(&r->kept.checkpoint, r->plan->settings, whole_seconds(r), write_state, r);
}

/* The time that was taken before counts. With the target that it had, the noise is looked at where it would have
 * been; with another one now. */
static void resume(render *r)
{
    const ca_pass_looks *before = &r->kept.looks;
    r->passes = r->kept.resumed;
    r->start -= r->kept.seconds;
    r->seconds = r->kept.seconds;
    ca_noise_looks_recall(&r->looks, before->noise, before->next);
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

/* The pass at which the noise is looked at next, where that may end the render. */
static uint64_t next_look(const render *r)
{
    if (r->looks.target <= 0.0) return UINT64_MAX;
    const double next = fmax(ceil(r->looks.next), r->passes + 1.0);
    return r->plan->first_pass + (uint64_t)next;
}

static ca_status look_at_all(render *r, ca_error *error)
{
    CA_TRY(gather(r, error));
    look(r);
    if (!ca_noise_looks_over(&r->looks)) ca_rank_work_go_on(&r->work, next_look(r));
    return CA_OK;
}

/* A range, or a look; *over: there is nothing more to do. */
static ca_status make_some(render *r, bool *over, ca_error *error)
{
    ca_rank_work *work = &r->work;
    ca_work_range range;
    const double limit = r->plan->settings->seconds;
    work->deadline = limit > 0.0 ? r->start + limit : 0.0;
    if (ca_rank_work_take(work, &range)) {
        const ca_status status = ca_rank_work_make(work, range, error);
        r->passes = (uint32_t)work->made;
        if (status != CA_OK) return status;
        ca_rank_work_wait(work, false);
        if (r->looks.target <= 0.0 && ca_noise_looks_due(&r->looks, r->passes)) look_at_own(r);
        return CA_OK;
    }
    *over = work->next < work->look;
    if (*over) return CA_OK;
    CA_TRY(look_at_all(r, error));
    *over = ca_noise_looks_over(&r->looks);
    return CA_OK;
}

/* What a part and a rank have whole: the passes of a replicate. */
static uint32_t passes_together(const render *r) { return ca_max_u32(1, ca_replicates_passes(r->plan)); }

/* As make_passes, where other ranks make passes, too. What was begun of a replicate is finished here first. */
static ca_status lead_passes(render *r, ca_error *error)
{
    ca_rank_work *work = &r->work;
    bool over = ca_noise_looks_over(&r->looks);
    ca_status status = CA_OK;
    work->look = next_look(r);
    work->run = passes_together(r);
    ca_rank_work_wait(work, r->kept.resumed % work->run != 0);
    while (status == CA_OK && !over && !r->interrupted) {
        status = make_some(r, &over, error);
        if (status != CA_OK) break;
        keep(r);
        r->interrupted = !report_progress(r) || r->plan->ended || work->end_asked;
    }
    status = ca_rank_work_finish(work, status, error);
    r->passes = (uint32_t)work->in_sums;
    r->seconds = ca_clock_seconds() - r->start;
    ca_rank_work_end(work);
    return status;
}

static ca_noise_looks start_looks(const ca_render_plan *plan)
{
    const double pixels = ca_render_plan_pixels(plan);
    const double samples = ca_noise_looks_patience(pixels, plan->scene->light_count > 0);
    return ca_noise_looks_start(plan->settings->noise_percent, FIRST_NOISE_PASS,
                                fmax(FIRST_NOISE_PASS, samples / plan->samples_per_pass));
}

/* The passes before one that was not made whole stay: they are the image, and are kept. */
static ca_status run_passes(render *r, ca_error *error)
{
    r->start = ca_clock_seconds();
    r->looks = start_looks(r->plan);
    if (r->kept.resumed > 0)
        resume(r);
    else
        r->start -= r->plan->method.seconds;
    const ca_status status = r->ranks ? lead_passes(r, error) : make_passes(r, error);
    ca_reserve_open(r->plan->reserve);
    r->interrupted = r->interrupted || status == CA_ERROR_INTERRUPTED;
    const bool early = r->interrupted || status != CA_OK;
    if (r->passes > 0) ca_checkpoint_keep_last(&r->kept.checkpoint, r->plan->settings, early, write_state, r);
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
    const uint64_t passes = r->ranks ? r->work.in_sums : r->passes;
    *statistics = (ca_render_statistics){
        .seconds = r->seconds,
        .iterations = passes,
        .seed = r->plan->seed,
        .notes = r->plan->scene->desc.notes.items,
        .note_count = r->plan->scene->desc.notes.count,
        .samples_per_pixel = (double)passes * r->plan->samples_per_pass,
        .interrupted = r->interrupted,
        .first_predicted_seconds = r->looks.first_predicted_seconds,
        .first_predicted_at = r->looks.first_predicted_at,
        .method = r->plan->method,
        .passes = {r->plan->first_pass, r->plan->first_pass + passes},
        .passes_resumed = r->kept.resumed,
        .keeps_checkpoint = r->kept.checkpoint.is_kept,
        .numbers_of_rays = ca_ray_file_statistics(&r->rays),
    };
    ca_render_summarise(&summary, statistics);
    ca_workers_count(&r->runner.workers, statistics);
    ca_part_counts_fill(r->kept.counts, statistics);
    if (!r->ranks) return;
    uint64_t others[CA_PART_COUNTS] = {0};
    ca_rank_work_count(&r->work, others);
    ca_part_counts_fill(others, statistics);
    if (!ca_rank_work_is_whole(&r->work)) statistics->passes[0] = statistics->passes[1] = 0;
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
    CA_TRY(ca_film_develop(&r->film, r->plan->threads, image, error));
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
    const ca_status images = strategies ? write_strategies(r, strategies, error) : CA_OK;
    const ca_status sums = ca_checkpoint_write_part(&r->kept.checkpoint, r->plan->settings, r->interrupted,
                                                    write_state, r, error);
    return sums != CA_OK ? sums : images;
}

/* What goes with the passes of an image; of several failures the first is told. */
static ca_status finish_passes(render *r, ca_status status, ca_render_statistics *statistics, ca_error *error)
{
    CA_TRY(ca_loading_check(error));
    fill_statistics(r, statistics);
    const ca_status written = write_files(r, status == CA_OK ? error : NULL);
    return status == CA_OK ? written : status;
}

static ca_status make_image(render *r, ca_status status, ca_image_layers **image, ca_render_statistics *statistics,
                            ca_error *error)
{
    const bool has_passes = r->passes > 0;
    if (has_passes) status = finish_passes(r, status, statistics, error);
    ca_pass_runner_destroy(&r->runner);
    ca_rank_work_destroy(&r->work);
    if (!has_passes || status == CA_ERROR_INTERRUPTED) return status;
    /* The image is made whatever failed before; the first failure is the one that is told. */
    const ca_status developed = develop(r, statistics, image, status == CA_OK ? error : NULL);
    return status == CA_OK ? developed : status;
}

static ca_status render_film(render *r, ca_image_layers **image, ca_render_statistics *statistics, ca_error *error)
{
    ca_status status = run_passes(r, error);
    const int *before = ca_loading_until(r->plan->settings->discard);
    status = make_image(r, status, image, statistics, error);
    ca_loading_until(before);
    return status;
}

/* Passes of several rounds need a buffer, which is then taken from what light paths may have. */
static ca_status create_integrator(render *r, ca_error *error)
{
    ca_render_plan *plan = r->plan;
    CA_TRY(ca_integrator_create(plan->type, &plan->input, &r->integrator, error));
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
    return ca_integrator_create(plan->type, &plan->input, &r->integrator, error);
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

/* ca_pass_runner.may_add */
static bool may_add(void *user) { return ca_rank_work_may_add(user); }

static ca_status create_work(render *r, ca_error *error)
{
    r->rank_film = (ca_rank_film){.film = &r->film, .workers = &r->runner.workers};
    const ca_rank_sums sums = ca_rank_sums_of(&r->rank_film);
    CA_TRY(ca_rank_work_create(&r->work, r->ranks, &sums, r->plan->first_pass, r->kept.resumed, error));
    r->work.limit = r->plan->pass_limit;
    r->work.end_wanted = r->plan->settings->stop;
    r->work.make = make_range;
    r->work.make_user = r;
    r->runner.workers.parallel.between = ca_rank_work_between;
    r->runner.workers.parallel.between_user = &r->work;
    r->runner.may_add = may_add;
    r->runner.may_add_user = &r->work;
    return CA_OK;
}

/* All that can fail before the first pass. Ranks end when rank 0 says so. */
static ca_status prepare(render *r, ca_error *error)
{
    ca_render_plan *plan = r->plan;
    if (r->ranks) plan->input.stop = &r->work.stop;
    if (plan->rays == CA_RAYS_OF_FILE) CA_TRY(ca_ray_file_read(&r->rays, plan, error));
    const ca_pass_counts *counts = r->rays.light_paths > 0 ? &r->rays.counts : NULL;
    CA_TRY(ca_kept_check(&r->kept, plan, hash_of_rays(r), error));
    CA_TRY(create_film(r, error));
    if (plan->settings->strategies_directory)
        CA_TRY(ca_technique_images_create(&plan->input.technique_images, plan->crop, error));
    CA_TRY(create_integrator(r, error));
    CA_TRY(ca_pass_runner_create(&r->runner, plan, r->integrator, &r->film, counts, error));
    return r->ranks ? create_work(r, error) : CA_OK;
}

/* Ranks must be about the same picture. */
static ca_status agree_on_settings(render *r, ca_status status, ca_error *error)
{
    if (!r->ranks) return status;
    CA_TRY(ca_ranks_agree(r->ranks, status, error));
    return ca_part_settings_agree(r->ranks, r->kept.settings, error);
}

static ca_status run_render(render *r, ca_image_layers **image, ca_render_statistics *statistics, ca_error *error)
{
    ca_status status = agree_on_settings(r, prepare(r, error), error);
    if (status == CA_OK && ca_ranks_helps(r->ranks))
        ca_rank_work_help(&r->work, passes_together(r));
    else if (status == CA_OK)
        status = render_film(r, image, statistics, error);
    ca_pass_runner_destroy(&r->runner);
    ca_rank_work_destroy(&r->work);
    if (r->integrator) r->plan->type->destroy(r->integrator);
    return status;
}

/* A choice that a checkpoint tells is not made again. */
static ca_status choose_method(render *r, ca_error *error)
{
    bool used = false;
    CA_TRY(ca_kept_use_method(&r->kept, r->plan, &used, error));
    return used ? CA_OK : ca_auto_method_choose(r->plan, error);
}

/* Rank 0 opens what is gone on from, and chooses. */
static ca_status begin(render *r, ca_error *error)
{
    const bool chooses = ca_render_plan_chooses(r->plan);
    ca_status status = ca_kept_start(&r->kept, r->plan, error);
    if (status == CA_OK && chooses && !ca_ranks_helps(r->ranks)) status = choose_method(r, error);
    status = ca_ranks_agree(r->ranks, status, error);
    if (status != CA_OK || !chooses || !r->ranks) return status;
    return ca_ranks_agree(r->ranks, ca_pass_settings_share(r->ranks, r->plan, error), error);
}

static ca_status render_passes(ca_render_plan *plan, ca_image_layers **image, ca_render_statistics *statistics,
                               ca_error *error)
{
    render r = {.plan = plan, .ranks = plan->settings->ranks};
    ca_status status = begin(&r, error);
    if (status == CA_OK) status = run_render(&r, image, statistics, error);
    ca_technique_images_destroy(plan->input.technique_images);
    plan->input.technique_images = NULL;
    ca_film_destroy(&r.film);
    plan->input.camera_paths = NULL;
    ca_ray_file_destroy(&r.rays);
    ca_kept_destroy(&r.kept);
    return status;
}

/* Has the render samples enough for a pilot with the method's numbers? */
static bool has_room_for_pilot(const ca_render_plan *plan)
{
    const uint32_t given = plan->settings->samples_per_pixel;
    const uint32_t camera_paths = plan->camera_paths > 1 ? plan->camera_paths : CA_PILOT_LEAST_CAMERA_PATHS;
    const double samples = given ? given : plan->scene->desc.samples_per_pixel;
    return plan->open_ended || samples >= 2.0 * ca_pilot_least_samples(camera_paths);
}

/* A method without such numbers renders as it is; so does one whose choice the caller has ended, and a render that is
 * too short for another pilot. What a checkpoint or a record tells is not decided again. */
static ca_status choose_for_rays(ca_render_plan *plan, ca_error *error)
{
    bool used = false;
    if (plan->rays == CA_RAYS_OF_RECORD) return ca_auto_file_use_method(plan, plan->settings->rays, error);
    CA_TRY(ca_kept_method_recall(plan, &used, error));
    if (used) return CA_OK;
    CA_TRY(ca_auto_method_choose(plan, error));
    if (ca_integrator_has(plan->type, CA_RAYS_ABILITIES) && !plan->ended && has_room_for_pilot(plan)) return CA_OK;
    plan->rays = CA_RAYS_OF_SETTINGS;
    return ca_render_plan_memory(plan, error);
}

static ca_status choose_and_render(ca_render_plan *plan, ca_image_layers **image, ca_render_statistics *statistics,
                                   ca_error *error)
{
    CA_TRY(choose_for_rays(plan, error));
    if (!ca_render_plan_joins(plan)) return render_passes(plan, image, statistics, error);
    CA_TRY(ca_render_plan_keep_radius(plan, error));
    return ca_auto_rays_render(plan, NULL, image, statistics, error);
}

static ca_status run_plan(ca_render_plan *plan, ca_image_layers **image, ca_render_statistics *statistics,
                          ca_error *error)
{
    if (ca_render_plan_by_blocks(plan)) return ca_render_blocks(plan, image, statistics, error);
    if (ca_render_plan_joins(plan) && ca_render_plan_chooses(plan))
        return choose_and_render(plan, image, statistics, error);
    if (ca_render_plan_joins(plan)) return ca_auto_rays_render(plan, NULL, image, statistics, error);
    return render_passes(plan, image, statistics, error);
}

/* For the image and for what is written beside it, row by row. */
static ca_status keep_memory_back(ca_render_plan *plan, ca_error *error)
{
    enum { ROW_BYTES = 1024 /* a pixel, of files of sums */, SMALL_THINGS = 1 << 18 };
    const bool blocks = ca_render_plan_by_blocks(plan), joins = ca_render_plan_joins(plan);
    const bool bars = joins || (blocks ? plan->block_film.error_bars : ca_replicates_passes(plan) > 0);
    const size_t arrays = bars && (blocks || joins) ? CA_CONFIDENCE_ARRAY_BYTES : 0;
    const size_t width = plan->crop[2] - plan->crop[0], height = plan->crop[3] - plan->crop[1];
    const size_t pixel = ca_film_develop_bytes(bars) + arrays + (joins ? CA_AUTO_IMAGE_PIXEL_BYTES : 0);
    const size_t bytes = width * height * pixel;
    return ca_reserve_create(&plan->reserve, bytes + width * ROW_BYTES + SMALL_THINGS, "the image",
                             plan->settings->ranks ? NULL : plan->input.stop, error);
}

ca_status ca_render_plan_run(ca_render_plan *plan, ca_image_layers **image, ca_render_statistics *statistics,
                             ca_error *error)
{
    ca_render_statistics own_statistics;
    if (!statistics) statistics = &own_statistics;
    *image = NULL;
    ca_status status = keep_memory_back(plan, error);
    if (status == CA_OK && ca_render_plan_chooses(plan)) status = ca_pass_settings_make(plan, 0, &plan->asked, error);
    status = ca_ranks_agree(plan->settings->ranks, status, error);
    if (status == CA_OK) status = run_plan(plan, image, statistics, error);
    statistics->ranks = plan->settings->ranks ? plan->settings->ranks->count : 1;
    if (status == CA_OK && *image) status = ca_aov_layers_add(plan, statistics->samples_per_pixel, *image, error);
    ca_reserve_release(plan->reserve);
    ca_free(plan->asked);
    plan->reserve = NULL;
    plan->asked = NULL;
    if (status == CA_ERROR_INTERRUPTED && !ca_stop_asked(plan->settings->discard))
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
    ca_render_settings taken;
    ca_render_statistics made;
    ca_render_plan plan;
    ca_error own_error;
    if (!error) error = &own_error; /* other ranks may want to know */
    CA_TRY(ca_settings_take(settings, &taken, error));
    CA_TRY(ca_statistics_take(statistics, &made, error));
    CA_TRY(ca_ranks_agree(taken.ranks, ca_render_plan_make(&plan, scene, &taken, error), error));
    const ca_status status = ca_render_plan_run(&plan, image, &made, error);
    ca_statistics_give(&made, statistics);
    return status;
}
