/* The pilot: iterations of two halves in turns, with numbers that settings and the clock decide on alone. */
#include "noise/ray_map.h"
#include "render/auto_rays_state.h"

#include <math.h>
#include <string.h>

enum {
    CHEAP_ITERATIONS = 2,    /* one of each half */
    LEAST_ITERATIONS = 6,    /* of ordinary ones: of each half one without and two with pairs */
    USUAL_ITERATIONS = 16,   /* what a pilot with time for more than the least aims at; all there are for a noise target */
    PLAIN_EVERY = 4,         /* of a half's iterations the first, fifth ... gather no pairs and are timed */
    CHEAP_LIGHT_DIVISOR = 4,
    LEAST_LIGHT_PATHS = 2,   /* two halves of them are needed for pairs */
    MOST_CAMERA_PATHS = 16,
};
static const double share_of_seconds = 0.06, share_of_samples = 0.125;
/* An ordinary iteration over a cheap one, with the same number of light paths a pixel as wanted: four times the light paths, twice the
 * camera paths, eight times the merges. And what gathering pairs adds to that. */
static const double cost_over_cheap = 8.0, cost_of_pairs = 1.4;

/* ---- The plan -------------------------------------------------------------------------------------------------------- */

static bool is_ppm(const ca_auto_rays *a) { return strcmp(a->plan->type->name, "ppm") == 0; }

/* One camera path a pixel is what nobody asked for, unless somebody did. */
static ca_status plan_camera_paths(const ca_auto_rays *a, uint32_t *camera_paths, ca_error *error)
{
    const ca_render_settings *settings = a->plan->settings;
    const char *overrides = settings->integrator ? strchr(settings->integrator, ':') : NULL;
    const bool asked =
        settings->camera_paths > 0 || ca_render_overrides_mention(overrides ? overrides + 1 : NULL, "camera_paths");
    *camera_paths = a->plan->camera_paths;
    if (is_ppm(a)) {
        if (*camera_paths == 1) return CA_OK;
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "with rays \"auto\" ppm has one camera path per pixel and chooses its light paths alone, not with %u",
                       *camera_paths);
    }
    if (*camera_paths > CA_RAY_MAP_MOST_CAMERA_PATHS)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "a pilot can have at most %d camera paths per pixel, not %u",
                       CA_RAY_MAP_MOST_CAMERA_PATHS, *camera_paths);
    if (*camera_paths >= 2) return CA_OK;
    if (asked)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "a pilot needs at least 2 camera paths per pixel to tell the noise of light paths, not 1");
    *camera_paths = 2;
    return CA_OK;
}

static ca_status plan_light_paths(const ca_auto_rays *a, uint32_t *light_paths, ca_error *error)
{
    const ca_render_plan *plan = a->plan;
    const double given = ca_integrator_value(plan->type, &plan->input, "light_paths", 0.0);
    const double pixels = (double)plan->camera.width * (double)plan->camera.height; /* 0 light paths: one per pixel */
    const double number = given > 0.0 ? given : fmin(fmax(pixels, LEAST_LIGHT_PATHS), CA_RAY_MAP_MOST_LIGHT_PATHS);
    if (number < LEAST_LIGHT_PATHS)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "a pilot estimates from two halves of the light paths: it needs at least %d, not %.0f", LEAST_LIGHT_PATHS, number);
    *light_paths = (uint32_t)number;
    return CA_OK;
}

/* Numbers that the image's own map can hold. */
ca_status ca_auto_pilot_plan(ca_auto_rays *a, ca_error *error)
{
    ca_auto_group *cheap = &a->groups[CA_AUTO_CHEAP], *ordinary = &a->groups[CA_AUTO_ORDINARY];
    CA_TRY(plan_camera_paths(a, &ordinary->camera_paths, error));
    CA_TRY(plan_light_paths(a, &ordinary->light_paths, error));
    cheap->camera_paths = 1;
    cheap->light_paths = ordinary->light_paths / CHEAP_LIGHT_DIVISOR;
    if (cheap->light_paths < LEAST_LIGHT_PATHS) cheap->light_paths = LEAST_LIGHT_PATHS;
    if (!ca_auto_by_samples(a)) return CA_OK;
    const double least = CHEAP_ITERATIONS * cheap->camera_paths + LEAST_ITERATIONS * ordinary->camera_paths;
    if (ca_auto_work_end(a) >= 2.0 * least) return CA_OK;
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                   "%.0f samples per pixel are too few for rays \"auto\": its pilot has %.0f, so at least %.0f are needed",
                   ca_auto_work_end(a), least, 2.0 * least);
}

/* ---- Its numbers from the clock ----------------------------------------------------------------------------------------- */

static double pilot_seconds(const ca_auto_rays *a) { return share_of_seconds * a->plan->settings->seconds; }

/* Numbers that nobody gave are made smaller where even the least pilot would take too long, and larger where there is time for many
 * iterations: products of halves' means are the less noisy the more paths are in a half. */
static void scale_to_time(ca_auto_rays *a, double cheap_seconds)
{
    const ca_render_plan *plan = a->plan;
    ca_auto_group *g = &a->groups[CA_AUTO_ORDINARY];
    const bool given = ca_integrator_value(plan->type, &plan->input, "light_paths", 0.0) > 0.0 || plan->camera_paths > 1;
    if (given || ca_auto_by_samples(a) || plan->settings->seconds <= 0.0) return;
    const double left = pilot_seconds(a) - a->seconds, one = cost_over_cheap * cost_of_pairs * cheap_seconds;
    const double fewer = fmax(1.0 / 16.0, left / (LEAST_ITERATIONS * one)), more = fmin(64.0, left / (USUAL_ITERATIONS * one));
    if (fewer < 1.0) {
        const double few = fewer * g->light_paths;
        g->light_paths = few > LEAST_LIGHT_PATHS ? (uint32_t)few : LEAST_LIGHT_PATHS;
    } else if (more > 1.0) {
        const double limited = fmin(sqrt(more), MOST_CAMERA_PATHS / 2);
        g->light_paths = (uint32_t)fmin(limited * g->light_paths, CA_RAY_MAP_MOST_LIGHT_PATHS);
        if (!is_ppm(a)) g->camera_paths = (uint32_t)(limited * g->camera_paths);
    }
}

/* The memory that is allowed may not hold what there is time for. */
static ca_status scale_to_memory(ca_auto_rays *a, uint32_t planned, ca_error *error)
{
    ca_auto_group *g = &a->groups[CA_AUTO_ORDINARY];
    bool fits = true;
    while (g->light_paths > planned) {
        CA_TRY(ca_auto_fits(a, g->light_paths, &fits, error));
        if (fits) break;
        g->light_paths = g->light_paths / 2 > planned ? g->light_paths / 2 : planned;
    }
    return CA_OK;
}

/* ---- Iterations ------------------------------------------------------------------------------------------------------- */

static bool pilot_is_long_enough(const ca_auto_rays *a)
{
    const uint32_t done = a->groups[CA_AUTO_ORDINARY].iterations;
    if (done < LEAST_ITERATIONS) return false;
    if (ca_auto_by_samples(a)) return a->camera_paths >= share_of_samples * ca_auto_work_end(a);
    if (a->plan->settings->seconds > 0.0) return a->seconds >= pilot_seconds(a);
    return done >= USUAL_ITERATIONS;
}

static ca_status run_iteration(ca_auto_rays *a, ca_auto_batch *batch, int group, double *seconds, ca_error *error)
{
    ca_auto_group *g = &a->groups[group];
    ca_auto_half *half = &a->halves[g->iterations % CA_AUTO_HALVES];
    const bool plain = group == CA_AUTO_CHEAP || g->iterations / CA_AUTO_HALVES % PLAIN_EVERY == 0;
    CA_TRY(ca_auto_batch_run(a, batch, &half->films[group], plain ? NULL : &half->pairs, plain ? half->times : NULL, seconds,
                             error));
    g->iterations++;
    if (plain && group == CA_AUTO_ORDINARY) {
        half->plain_seconds += *seconds;
        half->plain_count++;
    }
    ca_auto_report(a);
    return CA_OK;
}

/* Both halves have the same iterations whenever the pilot ends, and each pixel two of a group. */
static bool may_end(const ca_auto_rays *a, int group)
{
    return a->groups[group].iterations > 0 && a->groups[group].iterations % CA_AUTO_HALVES == 0;
}

static ca_status run_group(ca_auto_rays *a, int group, double *seconds, ca_error *error)
{
    ca_auto_batch batch;
    ca_auto_set_uniform(a, a->groups[group].light_paths, a->groups[group].camera_paths);
    ca_status status = ca_auto_batch_begin(a, &batch, error);
    while (status == CA_OK) {
        status = run_iteration(a, &batch, group, seconds, error);
        if (!may_end(a, group)) continue;
        if (a->interrupted || group == CA_AUTO_CHEAP || pilot_is_long_enough(a)) break;
    }
    ca_auto_batch_end(a, &batch);
    return status;
}

ca_status ca_auto_pilot_run(ca_auto_rays *a, ca_error *error)
{
    double seconds;
    const uint32_t planned = a->groups[CA_AUTO_ORDINARY].light_paths;
    CA_TRY(run_group(a, CA_AUTO_CHEAP, &seconds, error));
    if (a->interrupted) return CA_OK;
    scale_to_time(a, seconds); /* of the second one: the first has warmed up memory and caches */
    CA_TRY(scale_to_memory(a, planned, error));
    return run_group(a, CA_AUTO_ORDINARY, &seconds, error);
}
