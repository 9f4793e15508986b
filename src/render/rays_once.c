#include "render/rays_once.h"

#include "base/clock.h"
#include "base/memory.h"
#include "image/layers.h"
#include "noise/ray_map.h"
#include "render/auto_rays.h"
#include "render/checkpoint.h"
#include "render/part_settings.h"
#include "sampling/sampler.h"

#include <math.h>
#include <string.h>

#define SHARE 0.05 /* of what a rank renders */
#define MOST_SECONDS 120.0
#define CHOICE_SEED UINT64_C(0x6c62272e07bb0142)

/* ---- How much to choose by ------------------------------------------------------------------------------------- */

static double samples_wanted(const ca_render_plan *plan)
{
    const uint32_t given = plan->settings->samples_per_pixel;
    return given ? given : plan->scene->desc.samples_per_pixel;
}

/* Camera paths of a pixel that rays "auto" needs at least. */
static double least_samples(const ca_render_plan *plan)
{
    const uint32_t camera_paths = plan->camera_paths > 1 ? plan->camera_paths : CA_PILOT_LEAST_CAMERA_PATHS;
    return 2.0 * ca_pilot_least_samples(camera_paths);
}

bool ca_rays_once_has_room(const ca_render_plan *plan)
{
    return ca_integrator_has(plan->type, CA_RAYS_ABILITIES) &&
           (plan->open_ended || samples_wanted(plan) >= least_samples(plan));
}

/* ---- Choosing -------------------------------------------------------------------------------------------------- */

/* The small render tells of the large one. */
typedef struct small_render {
    ca_render_plan *whole;
    double start; /* by the clock, without the caller's time */
} small_render;

static bool tell(const ca_render_progress *progress, void *user)
{
    small_render *small = user;
    const ca_render_plan *whole = small->whole;
    const ca_method_statistics *method = &whole->method;
    const ca_render_progress told = {.passes_total = whole->open_ended ? 0 : whole->pass_limit,
                                     .seconds = method->seconds + progress->seconds,
                                     .seconds_total = whole->settings->seconds,
                                     .noise_percent = -1.0,
                                     .noise_target = whole->settings->noise_percent,
                                     .method = method->reason[0] ? method->reason : NULL,
                                     .method_warning = whole->method_warning[0] ? whole->method_warning : NULL};
    if (!ca_render_tell(whole, &told, &small->start)) small->whole->ended = true;
    return !whole->ended;
}

static ca_render_settings settings_of(small_render *small)
{
    const ca_render_plan *whole = small->whole;
    const double part = SHARE / (whole->settings->ranks ? whole->settings->ranks->count : 1);
    const double part_of_samples = ceil(part * samples_wanted(whole));
    ca_render_settings s = *whole->settings;
    s.ranks = NULL;
    s.checkpoint_path = s.part_path = NULL;
    s.resume = s.checkpoint_if_long = false;
    s.seed = ca_pcg_permute(whole->seed ^ CHOICE_SEED);
    s.has_seed = true;
    s.seconds = fmin(MOST_SECONDS, s.seconds > 0.0 ? SHARE * s.seconds : (double)INFINITY);
    if (!whole->open_ended)
        s.samples_per_pixel = (uint32_t)fmin(samples_wanted(whole), fmax(least_samples(whole), part_of_samples));
    s.noise_percent /= sqrt(part); /* 0: no target */
    s.progress = tell;
    s.progress_user = small;
    return s;
}

/* The whole render's integrator, with all of its parameters: `auto` has chosen it. */
static ca_status use_integrator(const ca_render_plan *whole, ca_render_plan *plan, ca_error *error)
{
    char *text;
    CA_TRY(ca_pass_settings_make(whole, 0, &text, error));
    const ca_status status = ca_pass_settings_use(text, "the settings", plan, error);
    ca_free(text);
    plan->camera_paths = whole->camera_paths;
    return status;
}

static ca_status take_numbers(const ca_render_plan *plan, const ca_image_layers *image, ca_rays_once *choice,
                              ca_error *error)
{
    const uint32_t *crop = plan->crop;
    const ca_ray_map_place place = {.full_width = plan->camera.width,
                                    .full_height = plan->camera.height,
                                    .crop = {crop[0], crop[1], crop[2], crop[3]}};
    return ca_ray_map_of(image, "the numbers of rays", &place, &choice->light_paths, &choice->camera_paths, error);
}

ca_status ca_rays_once_make(ca_render_plan *whole, ca_rays_once *choice, ca_error *error)
{
    small_render small = {.whole = whole, .start = ca_clock_seconds()};
    const ca_render_settings settings = settings_of(&small);
    ca_render_statistics statistics = {0};
    ca_image_layers *image = NULL;
    ca_render_plan plan;
    *choice = (ca_rays_once){0};
    CA_TRY(ca_render_plan_make(&plan, whole->scene, &settings, error));
    CA_TRY(use_integrator(whole, &plan, error));
    ca_status status = ca_auto_rays_render(&plan, NULL, &image, &statistics, error);
    if (status == CA_OK) status = take_numbers(whole, image, choice, error);
    ca_layers_destroy(image);
    choice->told = statistics.numbers_of_rays;
    choice->seconds = ca_clock_seconds() - small.start;
    return status;
}

void ca_rays_once_destroy(ca_rays_once *choice)
{
    ca_free(choice->camera_paths);
    *choice = (ca_rays_once){0};
}

/* ---- Numbers that are known ------------------------------------------------------------------------------------ */

static ca_status create_map(size_t pixels, ca_rays_once *choice, ca_error *error)
{
    choice->camera_paths = ca_alloc(pixels, sizeof *choice->camera_paths);
    return choice->camera_paths ? CA_OK : ca_fail_memory(error, "the numbers of rays");
}

ca_status ca_rays_once_of(const ca_pass_part *part, size_t pixels, ca_rays_once *choice, ca_error *error)
{
    *choice = (ca_rays_once){0};
    if (part->light_paths == 0) return CA_OK;
    CA_TRY(create_map(pixels, choice, error));
    choice->light_paths = part->light_paths;
    memcpy(choice->camera_paths, part->camera_paths, pixels * sizeof *choice->camera_paths);
    return CA_OK;
}

ca_status ca_rays_once_share(const ca_ranks *ranks, size_t pixels, ca_rays_once *choice, ca_error *error)
{
    ca_ranks_share(ranks, &choice->light_paths, sizeof choice->light_paths);
    if (choice->light_paths == 0) return CA_OK;
    const ca_status created = ranks->rank > 0 ? create_map(pixels, choice, error) : CA_OK;
    CA_TRY(ca_ranks_agree(ranks, created, error));
    ca_ranks_share(ranks, choice->camera_paths, pixels * sizeof *choice->camera_paths);
    return CA_OK;
}

/* ---- Going on -------------------------------------------------------------------------------------------------- */

static ca_status look_into(ca_render_plan *plan, const char *path, ca_error *error)
{
    FILE *stream;
    uint64_t size, format;
    ca_pass_reader reader;
    CA_TRY(ca_part_open(path, &stream, &size, &format, error));
    fclose(stream);
    if (format != CA_PASS_PART_FORMAT) return CA_OK;
    CA_TRY(ca_pass_reader_open(&reader, path, error));
    if (reader.part.light_paths > 0) plan->rays = CA_RAYS_AUTO_ONCE;
    ca_pass_reader_close(&reader);
    return CA_OK;
}

ca_status ca_rays_once_recall(ca_render_plan *plan, ca_error *error)
{
    ca_checkpoint checkpoint;
    CA_TRY(ca_checkpoint_start(&checkpoint, plan->settings, error));
    const ca_status status = checkpoint.resumes ? look_into(plan, checkpoint.path, error) : CA_OK;
    ca_checkpoint_end(&checkpoint);
    return status;
}
