#include "render/rays_once.h"

#include "base/clock.h"
#include "base/memory.h"
#include "base/stop.h"
#include "render/part_settings.h"
#include "render/rank_work.h"
#include "sampling/sampler.h"

#include <math.h>
#include <string.h>

#define CHOICE_SEED UINT64_C(0x6c62272e07bb0142)
#define SHORTEST_SECONDS 1e-3 /* 0 would be no limit */

/* ---- How much there is to render ------------------------------------------------------------------------------- */

static uint32_t rank_count(const ca_render_plan *plan)
{
    return plan->settings->ranks ? plan->settings->ranks->count : 1;
}

/* Of a rank; where samples end the render. */
static double samples_of_rank(const ca_render_plan *plan)
{
    const uint32_t given = plan->settings->samples_per_pixel;
    return (double)(given ? given : plan->scene->desc.samples_per_pixel) / rank_count(plan);
}

/* That the pilot is at most half of. */
static double least_samples(const ca_render_plan *plan)
{
    if (ca_integrator_has(plan->type, CA_ABILITY_ONE_CAMERA_PATH)) return 2.0 * ca_pilot_least_samples(1);
    return 2.0 * ca_pilot_least_samples(ca_max_u32(plan->camera_paths, CA_PILOT_LEAST_CAMERA_PATHS));
}

static bool has_samples(const ca_render_plan *plan)
{
    return plan->open_ended || samples_of_rank(plan) >= least_samples(plan);
}

ca_status ca_rays_after_method(ca_render_plan *plan, ca_error *error)
{
    if (!ca_render_plan_chooses_rays(plan)) return CA_OK;
    if (!plan->ended && ca_integrator_has(plan->type, CA_RAYS_ABILITIES) && has_samples(plan))
        return ca_render_plan_keep_radius(plan, error);
    plan->rays = CA_RAYS_OF_SETTINGS;
    return ca_render_plan_memory(plan, error);
}

static ca_status check_samples(const ca_render_plan *plan, ca_error *error)
{
    if (has_samples(plan)) return CA_OK;
    const double count = rank_count(plan), least = least_samples(plan);
    return ca_fail(
        error, CA_ERROR_ARGUMENT, NULL,
        "%.0f samples per pixel are too few for rays \"auto\" by %.0f ranks: a pilot has %.0f and may be at "
        "most half of a rank's part, so at least %.0f are needed",
        samples_of_rank(plan) * count, count, 0.5 * least, least * count);
}

/* ---- Choosing -------------------------------------------------------------------------------------------------- */

typedef struct choosing {
    ca_render_plan *whole;
    double callers; /* seconds that the caller took, who is no part of the render */
} choosing;

/* The caller is told of the render that the numbers are for. */
static bool tell(const ca_render_progress *progress, void *user)
{
    choosing *c = user;
    ca_render_plan *whole = c->whole;
    whole->ended = !ca_render_tell_choosing(whole, whole->method.seconds + progress->seconds, &c->callers);
    return !whole->ended;
}

static ca_render_settings settings_of(choosing *c)
{
    const ca_render_plan *whole = c->whole;
    ca_render_settings s = *whole->settings;
    s.ranks = NULL;
    s.checkpoint_path = s.part_path = NULL;
    s.resume = s.checkpoint_if_long = false;
    s.seed = ca_pcg_permute(whole->seed ^ CHOICE_SEED);
    s.has_seed = true;
    if (s.seconds > 0.0) s.seconds = fmax(s.seconds - whole->method.seconds, SHORTEST_SECONDS);
    if (!whole->open_ended) s.samples_per_pixel = (uint32_t)samples_of_rank(whole);
    s.progress = tell;
    s.progress_user = c;
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

static ca_status choose(choosing *c, ca_auto_chosen *chosen, ca_error *error)
{
    const ca_render_settings settings = settings_of(c);
    ca_render_plan plan;
    CA_TRY(ca_render_plan_make(&plan, c->whole->scene, &settings, error));
    CA_TRY(use_integrator(c->whole, &plan, error));
    return ca_auto_rays_choose(&plan, chosen, error);
}

static void forget(ca_auto_chosen *chosen)
{
    ca_free(chosen->camera_paths);
    *chosen = (ca_auto_chosen){0};
}

/* Without numbers there is no render to go on with, but the pass that is made with those of the settings. */
static ca_status end_choice(ca_render_plan *whole, ca_auto_chosen *chosen, ca_status status, ca_error *error)
{
    const bool stopped = ca_stop_asked(whole->settings->stop);
    if (ca_stop_asked(whole->settings->discard)) return ca_stop_check(whole->settings->discard, error);
    if (stopped && status == CA_ERROR_INTERRUPTED) status = CA_OK;
    if (stopped) forget(chosen);
    if (status == CA_OK && chosen->light_paths == 0) whole->ended = true;
    return status;
}

ca_status ca_rays_once_choose(ca_render_plan *whole, ca_rays_once *once, ca_error *error)
{
    const double start = ca_clock_seconds();
    choosing c = {.whole = whole};
    *once = (ca_rays_once){0};
    CA_TRY(check_samples(whole, error));
    const ca_status status = choose(&c, &once->chosen, error);
    once->seconds = ca_clock_seconds() - start - c.callers;
    return end_choice(whole, &once->chosen, status, error);
}

void ca_rays_once_destroy(ca_rays_once *once) { forget(&once->chosen); }

/* ---- Numbers that are known ------------------------------------------------------------------------------------ */

static ca_status create_map(size_t pixels, ca_rays_once *once, ca_error *error)
{
    once->chosen.camera_paths = ca_alloc(pixels, sizeof *once->chosen.camera_paths);
    return once->chosen.camera_paths ? CA_OK : ca_fail_memory(error, "the numbers of rays");
}

ca_status ca_rays_once_of(const ca_pass_part *part, size_t pixels, ca_rays_once *once, ca_error *error)
{
    *once = (ca_rays_once){0};
    if (part->light_paths == 0) return CA_OK;
    CA_TRY(create_map(pixels, once, error));
    once->chosen.light_paths = part->light_paths;
    memcpy(once->chosen.camera_paths, part->camera_paths, pixels * sizeof *once->chosen.camera_paths);
    return CA_OK;
}

static void share_map(const ca_ranks *ranks, size_t pixels, uint32_t *map)
{
    const size_t most = CA_RANK_BATCH / sizeof *map;
    for (size_t at = 0; at < pixels; at += most)
        ca_ranks_share(ranks, map + at, sizeof *map * (pixels - at < most ? pixels - at : most));
}

ca_status ca_rays_once_share(const ca_ranks *ranks, size_t pixels, ca_rays_once *once, ca_error *error)
{
    ca_auto_chosen *chosen = &once->chosen;
    ca_ranks_share(ranks, &chosen->light_paths, sizeof chosen->light_paths);
    if (chosen->light_paths == 0) return CA_OK;
    const ca_status created = ranks->rank > 0 ? create_map(pixels, once, error) : CA_OK;
    CA_TRY(ca_ranks_agree(ranks, created, error));
    share_map(ranks, pixels, chosen->camera_paths);
    return CA_OK;
}
