/* A render by passes from its settings to its image; pass_loop.c makes the passes. */
#include "render/render_passes.h"

#include "base/hash.h"
#include "base/loading.h"
#include "render/auto_method.h"
#include "render/part_counts.h"
#include "render/part_settings.h"
#include "render/public_structs.h"
#include "render/render_passes_state.h"
#include "render/replicates.h"
#include "report/technique_page.h"

#include <string.h>
#include <unistd.h>

/* ---- Statistics and image -------------------------------------------------------------------------------------- */

static ca_rays_statistics rays_statistics(const ca_pass_render *r)
{
    const ca_rays_statistics *chosen = &r->once.chosen.told; /* nothing where they are of a file or a checkpoint */
    return chosen->light_paths > 0 ? *chosen : ca_ray_file_statistics(&r->rays);
}

static void fill_statistics(const ca_pass_render *r, ca_render_statistics *statistics)
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
        .numbers_of_rays = rays_statistics(r),
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

static ca_status develop(const ca_pass_render *r, const ca_render_statistics *statistics, ca_image_layers **image,
                         ca_error *error)
{
    CA_TRY(ca_film_develop(&r->film, r->plan->threads, image, error));
    ca_status status = ca_render_attach_record(r->plan, statistics, *image, error);
    if (status == CA_OK && r->rays.light_paths > 0)
        status = ca_ray_file_add_layers(&r->rays, (uint32_t)statistics->iterations, *image, error);
    if (status != CA_OK) {
        ca_layers_destroy(*image);
        *image = NULL;
    }
    return status;
}

ca_status ca_render_passes_snapshot(const ca_render_progress *progress, ca_image_layers **image,
                               ca_render_statistics *statistics, ca_error *error)
{
    ca_render_statistics told;
    CA_TRY(ca_render_check_snapshot(progress, image, error));
    CA_TRY(ca_statistics_take(statistics, &told, error));
    const ca_pass_render *r = progress->render;
    fill_statistics(r, &told);
    ca_statistics_give(&told, statistics);
    return develop(r, &told, image, error);
}

static ca_status write_strategies(const ca_pass_render *r, const ca_technique_images *strategies, ca_error *error)
{
    const char *folder = r->plan->settings->strategies_directory;
    ca_error reason;
    const ca_status images = ca_technique_images_write(strategies, r->passes, folder, error);
    if (images == CA_ERROR_MEMORY || access(folder, F_OK) != 0) return images; /* pictures or folder are missing */
    return ca_fail_also(error, images, ca_technique_page_write(strategies, r->passes, folder, &reason), &reason);
}

/* All that is written beside the image. */
static ca_status write_files(ca_pass_render *r, ca_error *error)
{
    const ca_technique_images *strategies = r->plan->input.technique_images;
    ca_error reason;
    const ca_status images = strategies ? write_strategies(r, strategies, error) : CA_OK;
    const ca_status sums = ca_checkpoint_write_part(&r->kept.checkpoint, r->plan->settings, r->interrupted,
                                                    ca_pass_loop_write, r, &reason);
    return ca_fail_also(error, images, sums, &reason);
}

/* What goes with the passes of an image, whatever failed before. */
static ca_status finish_passes(ca_pass_render *r, ca_status status, ca_render_statistics *statistics, ca_error *error)
{
    ca_error reason;
    CA_TRY(ca_loading_check(error));
    fill_statistics(r, statistics);
    const ca_status written = write_files(r, &reason);
    return ca_fail_also(error, status, written, &reason);
}

static ca_status make_image(ca_pass_render *r, ca_status status, ca_image_layers **image,
                            ca_render_statistics *statistics, ca_error *error)
{
    const bool has_passes = r->passes > 0;
    if (has_passes) status = finish_passes(r, status, statistics, error);
    ca_pass_runner_destroy(&r->runner);
    ca_rank_work_destroy(&r->work);
    if (!has_passes || status == CA_ERROR_INTERRUPTED) return status;
    /* The image is made whatever failed before. */
    ca_error reason;
    const ca_status developed = develop(r, statistics, image, &reason);
    return ca_fail_also(error, status, developed, &reason);
}

static ca_status render_film(ca_pass_render *r, ca_image_layers **image, ca_render_statistics *statistics,
                             ca_error *error)
{
    ca_status status = ca_pass_loop_run(r, error);
    const int *before = ca_loading_until(r->plan->settings->discard);
    status = make_image(r, status, image, statistics, error);
    ca_loading_until(before);
    return status;
}

/* ---- All that comes first -------------------------------------------------------------------------------------- */

/* Passes of several rounds need a buffer, which is then taken from what light paths may have. */
static ca_status create_integrator(ca_pass_render *r, ca_error *error)
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

/* Numbers of rays for all passes, from a file or chosen. */
static ca_status prepare_rays(ca_pass_render *r, ca_error *error)
{
    ca_auto_chosen *chosen = &r->once.chosen;
    if (r->plan->rays == CA_RAYS_OF_FILE) return ca_ray_file_read(&r->rays, r->plan, error);
    if (chosen->light_paths == 0) return CA_OK;
    uint32_t *camera_paths = chosen->camera_paths;
    chosen->camera_paths = NULL;
    return ca_ray_file_take(&r->rays, chosen->light_paths, camera_paths, r->plan, error);
}

/* Of these numbers. */
static uint64_t hash_of_rays(const ca_pass_render *r)
{
    if (r->rays.light_paths == 0) return 0;
    const size_t bytes = (size_t)ca_render_plan_pixels(r->plan) * sizeof *r->rays.camera_paths;
    return ca_hash_bytes(ca_hash_add(CA_HASH_START, r->rays.light_paths), r->rays.camera_paths, bytes);
}

static ca_status create_film(ca_pass_render *r, ca_error *error)
{
    const ca_render_plan *plan = r->plan;
    CA_TRY(ca_film_create(&r->film, plan->camera.width, plan->camera.height, plan->crop, error));
    CA_TRY(ca_film_add_up_in_parts(&r->film, ca_render_plan_extent(plan), error));
    CA_TRY(ca_film_set_replicates(&r->film, ca_replicates_passes(plan), error));
    return ca_kept_restore(&r->kept, plan, &r->film, error);
}

/* ca_pass_runner.may_add */
static bool may_add(void *user) { return ca_rank_work_may_add(user); }

static ca_status create_work(ca_pass_render *r, ca_error *error)
{
    r->rank_film = (ca_rank_film){.film = &r->film, .workers = &r->runner.workers};
    const ca_rank_sums sums = ca_rank_sums_of(&r->rank_film);
    CA_TRY(ca_rank_work_create(&r->work, r->ranks, &sums, r->plan->first_pass, r->kept.resumed, error));
    r->work.limit = r->plan->ended ? r->plan->first_pass + 1 : r->plan->pass_limit;
    r->work.end_wanted = r->plan->settings->stop;
    r->work.make = ca_pass_loop_make_range;
    r->work.make_user = r;
    r->runner.workers.parallel.between = ca_rank_work_between;
    r->runner.workers.parallel.between_user = &r->work;
    r->runner.may_add = may_add;
    r->runner.may_add_user = &r->work;
    return CA_OK;
}

/* All that can fail before the first pass. Ranks end when rank 0 says so. */
static ca_status prepare(ca_pass_render *r, ca_error *error)
{
    ca_render_plan *plan = r->plan;
    if (r->ranks) plan->input.stop = &r->work.stop;
    CA_TRY(prepare_rays(r, error));
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
static ca_status agree_on_settings(ca_pass_render *r, ca_status status, ca_error *error)
{
    if (!r->ranks) return status;
    CA_TRY(ca_ranks_agree(r->ranks, status, error));
    return ca_part_settings_agree(r->ranks, r->kept.settings, error);
}

static ca_status run_render(ca_pass_render *r, ca_image_layers **image, ca_render_statistics *statistics,
                            ca_error *error)
{
    ca_status status = agree_on_settings(r, prepare(r, error), error);
    if (status == CA_OK && ca_ranks_helps(r->ranks))
        ca_rank_work_help(&r->work, ca_pass_loop_together(r));
    else if (status == CA_OK)
        status = render_film(r, image, statistics, error);
    ca_pass_runner_destroy(&r->runner);
    ca_rank_work_destroy(&r->work);
    if (r->integrator) r->plan->type->destroy(r->integrator);
    return status;
}

/* A choice that a checkpoint tells is not made again. */
static ca_status choose_method(ca_pass_render *r, ca_error *error)
{
    bool used = false;
    CA_TRY(ca_kept_use_method(&r->kept, r->plan, &used, error));
    if (used) return CA_OK;
    CA_TRY(ca_auto_method_choose(r->plan, error));
    return ca_rays_after_method(r->plan, error);
}

/* Rank 0 opens what is gone on from, and chooses the method. */
static ca_status begin_method(ca_pass_render *r, ca_error *error)
{
    const bool chooses = ca_render_plan_chooses(r->plan);
    ca_status status = ca_kept_start(&r->kept, r->plan, error);
    if (status == CA_OK && chooses && !ca_ranks_helps(r->ranks)) status = choose_method(r, error);
    status = ca_ranks_agree(r->ranks, status, error);
    if (status != CA_OK || !chooses || !r->ranks) return status;
    return ca_ranks_agree(r->ranks, ca_pass_settings_share(r->ranks, r->plan, error), error);
}

/* A part of the one pass of a render that was ended while it chose. */
static ca_status check_numbers(const ca_pass_reader *reader, ca_error *error)
{
    char rays[32];
    ca_part_settings_find(reader->part.settings, "rays", rays, sizeof rays);
    if (reader->part.light_paths > 0 || strcmp(rays, "chosen") != 0) return CA_OK;
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                   "%s has no numbers of rays, since its render was ended while they were chosen: nothing can go on "
                   "from it",
                   reader->path);
}

/* A checkpoint of another film, or with the numbers of the settings, is refused when all settings are compared. */
static ca_status choose_numbers(ca_pass_render *r, ca_error *error)
{
    const ca_pass_reader *reader = &r->kept.reader;
    if (!r->kept.checkpoint.resumes) return ca_rays_once_choose(r->plan, &r->once, error);
    CA_TRY(check_numbers(reader, error));
    if (memcmp(reader->film.crop, r->plan->crop, sizeof r->plan->crop) != 0) return CA_OK;
    return ca_rays_once_of(&reader->part, (size_t)ca_render_plan_pixels(r->plan), &r->once, error);
}

/* The method, then numbers of rays. */
static ca_status begin(ca_pass_render *r, ca_error *error)
{
    CA_TRY(begin_method(r, error));
    if (r->plan->rays != CA_RAYS_AUTO_ONCE) return CA_OK;
    ca_status status = ca_ranks_helps(r->ranks) ? CA_OK : choose_numbers(r, error);
    status = ca_ranks_agree(r->ranks, status, error);
    if (status != CA_OK || !r->ranks) return status;
    return ca_rays_once_share(r->ranks, (size_t)ca_render_plan_pixels(r->plan), &r->once, error);
}

ca_status ca_render_passes(ca_render_plan *plan, ca_image_layers **image, ca_render_statistics *statistics,
                               ca_error *error)
{
    ca_pass_render r = {.plan = plan, .ranks = plan->settings->ranks};
    ca_status status = begin(&r, error);
    if (status == CA_OK) status = run_render(&r, image, statistics, error);
    ca_technique_images_destroy(plan->input.technique_images);
    plan->input.technique_images = NULL;
    ca_film_destroy(&r.film);
    plan->input.camera_paths = NULL;
    ca_ray_file_destroy(&r.rays);
    ca_rays_once_destroy(&r.once);
    ca_kept_destroy(&r.kept);
    return status;
}

ca_status ca_render_passes_check(ca_render_plan *plan, ca_error *error)
{
    ca_pass_render r = {.plan = plan};
    CA_TRY(create_integrator(&r, error));
    plan->type->destroy(r.integrator);
    return CA_OK;
}
