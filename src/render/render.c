/* Rendering a plan: by passes, by blocks, or by auto's films; and what all three share. */
#include "render/render.h"

#include "base/clock.h"
#include "base/memory.h"
#include "base/stop.h"
#include "film/confidence.h"
#include "film/interval_layers.h"
#include "image/layers.h"
#include "render/aov_layers.h"
#include "render/auto_file.h"
#include "render/auto_method.h"
#include "render/auto_rays.h"
#include "render/blocks.h"
#include "render/kept_method.h"
#include "render/part_settings.h"
#include "render/public_structs.h"
#include "render/ranks.h"
#include "render/rays_once.h"
#include "render/record.h"
#include "render/render_passes.h"
#include "render/replicates.h"

#include <math.h>
#include <sys/resource.h>

/* ---- What all renders share ------------------------------------------------------------------------------------ */

bool ca_render_tell(const ca_render_plan *plan, const ca_render_progress *progress, double *start)
{
    const ca_render_settings *settings = plan->settings;
    if (!settings->progress) return true;
    const double before = ca_clock_seconds();
    const bool goes_on = settings->progress(progress, settings->progress_user);
    *start += ca_clock_seconds() - before;
    return goes_on;
}

bool ca_render_tell_choosing(const ca_render_plan *plan, double seconds, double *start)
{
    const ca_method_statistics *method = &plan->method;
    const ca_render_progress progress = {.passes_total = plan->open_ended ? 0 : plan->pass_limit,
                                         .seconds = seconds,
                                         .seconds_total = plan->settings->seconds,
                                         .noise_percent = -1.0,
                                         .noise_target = plan->settings->noise_percent,
                                         .method = method->reason[0] ? method->reason : NULL,
                                         .method_warning = plan->method_warning[0] ? plan->method_warning : NULL};
    return ca_render_tell(plan, &progress, start);
}

ca_status ca_render_check_snapshot(const ca_render_progress *progress, ca_image_layers **image, ca_error *error)
{
    if (image) *image = NULL;
    if (progress && progress->render && image) return CA_OK;
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "a snapshot needs the progress it belongs to and a place for it");
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

/* ---- Which kind of render -------------------------------------------------------------------------------------- */

/* What a checkpoint or a record tells is not decided again. */
static ca_status choose_for_rays(ca_render_plan *plan, ca_error *error)
{
    bool used = false;
    if (plan->rays == CA_RAYS_OF_RECORD) return ca_auto_file_use_method(plan, plan->settings->rays, error);
    CA_TRY(ca_kept_method_recall(plan, &used, error));
    if (used) return CA_OK;
    CA_TRY(ca_auto_method_choose(plan, error));
    return ca_rays_after_method(plan, error);
}

static ca_status choose_and_render(ca_render_plan *plan, ca_image_layers **image, ca_render_statistics *statistics,
                                   ca_error *error)
{
    CA_TRY(choose_for_rays(plan, error));
    if (!ca_render_plan_joins(plan)) return ca_render_passes(plan, image, statistics, error);
    CA_TRY(ca_render_plan_keep_radius(plan, error));
    return ca_auto_rays_render(plan, NULL, image, statistics, error);
}

/* As it was decided, or, of what several ranks have begun, with the numbers that they had chosen. */
static ca_status render_auto_rays(ca_render_plan *plan, ca_image_layers **image, ca_render_statistics *statistics,
                                  ca_error *error)
{
    bool used;
    if (plan->rays == CA_RAYS_AUTO) CA_TRY(ca_kept_method_recall(plan, &used, error));
    if (ca_render_plan_joins(plan)) return ca_auto_rays_render(plan, NULL, image, statistics, error);
    return ca_render_passes(plan, image, statistics, error);
}

static ca_status run_plan(ca_render_plan *plan, ca_image_layers **image, ca_render_statistics *statistics,
                          ca_error *error)
{
    if (ca_render_plan_by_blocks(plan)) return ca_render_blocks(plan, image, statistics, error);
    if (ca_render_plan_joins(plan) && ca_render_plan_chooses(plan))
        return choose_and_render(plan, image, statistics, error);
    if (ca_render_plan_joins(plan)) return render_auto_rays(plan, image, statistics, error);
    return ca_render_passes(plan, image, statistics, error);
}

/* For the image and for what is written beside it, row by row. */
static ca_status keep_memory_back(ca_render_plan *plan, ca_error *error)
{
    enum { ROW_BYTES = 1024 /* a pixel, of files of sums */, SMALL_THINGS = 1 << 18 };
    if (ca_ranks_helps(plan->settings->ranks)) return CA_OK; /* another one makes the image */
    const bool blocks = ca_render_plan_by_blocks(plan), joins = ca_render_plan_joins(plan);
    const bool bars = joins || (blocks ? plan->block_film.error_bars : ca_replicates_passes(plan) > 0);
    const size_t arrays = bars && (blocks || joins) ? CA_CONFIDENCE_ARRAY_BYTES : 0;
    const size_t width = plan->crop[2] - plan->crop[0], height = plan->crop[3] - plan->crop[1];
    const size_t pixel = ca_film_develop_bytes(bars) + arrays + (joins ? CA_AUTO_IMAGE_PIXEL_BYTES : 0) +
                         ca_aov_layers_bytes(plan->scene);
    const size_t bytes = width * height * pixel;
    return ca_reserve_create(&plan->reserve, bytes + width * ROW_BYTES + SMALL_THINGS, "the image",
                             plan->settings->ranks ? NULL : plan->input.stop, error);
}

/* What ranks tell each other, and when, follows from the integrator and from where numbers of rays come from; and
 * rank 0 may soon spend minutes choosing. So all settings, and the scene, are compared first. `status`: how this rank
 * fared so far. */
static ca_status begin_ranks(const ca_ranks *ranks, const char *settings, ca_status status, ca_error *error)
{
    if (!ranks) return status;
    CA_TRY(ca_ranks_agree(ranks, status, error));
    return ca_part_settings_agree(ranks, settings, error);
}

/* What camera rays meet, of whatever image there is. Who does not wait for that gets the image without; who wants
 * none any more, none. */
static ca_status add_layers(const ca_render_plan *plan, ca_image_layers **image, ca_status status,
                            ca_render_statistics *statistics, ca_error *error)
{
    ca_error reason;
    statistics->lacks_layers = false;
    if (!*image) return status;
    const ca_status added = ca_aov_layers_add(plan, statistics->samples_per_pixel, *image, &reason);
    statistics->lacks_layers = added != CA_OK;
    if (added != CA_ERROR_INTERRUPTED) return ca_fail_also(error, status, added, &reason);
    if (!ca_stop_asked(plan->settings->discard)) return status;
    ca_layers_destroy(*image);
    *image = NULL;
    return ca_stop_check(plan->settings->discard, error);
}

ca_status ca_render_plan_run(ca_render_plan *plan, ca_image_layers **image, ca_render_statistics *statistics,
                             ca_error *error)
{
    ca_render_statistics own_statistics;
    if (!statistics) statistics = &own_statistics;
    *image = NULL;
    ca_status status = keep_memory_back(plan, error);
    const bool chooses = ca_render_plan_chooses(plan);
    char *text = NULL;
    if (status == CA_OK && (chooses || plan->settings->ranks)) status = ca_pass_settings_make(plan, 0, &text, error);
    status = begin_ranks(plan->settings->ranks, text, status, error);
    if (chooses)
        plan->asked = text;
    else
        ca_free(text);
    if (status == CA_OK) status = run_plan(plan, image, statistics, error);
    statistics->ranks = plan->settings->ranks ? plan->settings->ranks->count : 1;
    status = add_layers(plan, image, status, statistics, error);
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
    ca_render_plan plan;
    CA_TRY(ca_render_plan_make(&plan, scene, settings, error));
    if (ca_render_plan_chooses(&plan)) CA_TRY(ca_auto_method_use_any(&plan, error));
    return ca_render_passes_check(&plan, error);
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
