/* The pilot: iterations of two halves in turns, with numbers that settings and the clock decide on alone. */
#include "noise/ray_map.h"
#include "render/auto_rays_state.h"

#include <math.h>
#include <string.h>

enum {
    LEAST_ITERATIONS = 6,    /* of ordinary ones: of each half one without and two with pairs */
    USUAL_ITERATIONS = 16,   /* as many as long ones as a pilot has time for */
    PLAIN_EVERY = 4,         /* of a half's iterations the first, fifth ... gather no pairs and are timed */
    LEAST_LIGHT_PATHS = 2,   /* two halves of them are needed for pairs */
    MOST_CAMERA_PATHS = 16,
    /* A step of the ramp, and the one from it to the ordinary iterations: */
    LIGHT_STEP = 4,
    CAMERA_STEP = 2, /* its root */
};
static const double share_of_seconds = 0.06, share_of_samples = 0.125;
static const double seconds_to_a_target = 2.0; /* of a pilot where only the noise was said */
/* An iteration over the one before it on the ramp, with eight times the merges. And what gathering pairs adds to
 * that. */
static const double cost_of_step = LIGHT_STEP * CAMERA_STEP, cost_of_pairs = 1.4;

/* ---- The plan -------------------------------------------------------------------------------------------------- */

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
        return ca_fail(
            error, CA_ERROR_ARGUMENT, NULL,
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
                       "a pilot estimates from two halves of the light paths: it needs at least %d, not %.0f",
                       LEAST_LIGHT_PATHS, number);
    *light_paths = (uint32_t)number;
    return CA_OK;
}

/* Numbers that the image's own map can hold. */
ca_status ca_auto_pilot_plan(ca_auto_rays *a, ca_error *error)
{
    enum { RAMP_ITERATIONS = 2 };
    const ca_render_plan *plan = a->plan;
    ca_auto_group *ramp = &a->groups[CA_AUTO_RAMP], *ordinary = &a->groups[CA_AUTO_ORDINARY];
    a->given = ca_integrator_value(plan->type, &plan->input, "light_paths", 0.0) > 0.0 || plan->camera_paths > 1;
    CA_TRY(plan_camera_paths(a, &ordinary->camera_paths, error));
    CA_TRY(plan_light_paths(a, &ordinary->light_paths, error));
    ramp->camera_paths = 1;
    ramp->light_paths = ordinary->light_paths / LIGHT_STEP;
    if (ramp->light_paths < LEAST_LIGHT_PATHS) ramp->light_paths = LEAST_LIGHT_PATHS;
    if (!ca_auto_by_samples(a)) return CA_OK;
    const double least = RAMP_ITERATIONS * ramp->camera_paths + LEAST_ITERATIONS * ordinary->camera_paths;
    if (ca_auto_work_end(a) >= 2.0 * least) return CA_OK;
    return ca_fail(
        error, CA_ERROR_ARGUMENT, NULL,
        "%.0f samples per pixel are too few for rays \"auto\": its pilot has %.0f, so at least %.0f are needed",
        ca_auto_work_end(a), least, 2.0 * least);
}

/* ---- Its numbers from the clock -------------------------------------------------------------------------------- */

static double pilot_seconds(const ca_auto_rays *a)
{
    return a->plan->settings->seconds > 0.0 ? share_of_seconds * a->plan->settings->seconds : seconds_to_a_target;
}

/* How many times longer than `seconds` an iteration may take, for the rest of the pilot to have `iterations` of
 * them. */
static double room_for(const ca_auto_rays *a, uint32_t iterations, double seconds)
{
    return (pilot_seconds(a) - a->seconds) / (iterations * cost_of_pairs * fmax(seconds, 1e-9));
}

/* Numbers of another size, which differ by `step` in camera paths and by its square in light paths, within what the
 * image's own map can hold. */
static void resize(const ca_auto_rays *a, ca_auto_group *g, double step)
{
    const double light_paths = fmin(g->light_paths * step * step, CA_RAY_MAP_MOST_LIGHT_PATHS);
    const double least = is_ppm(a) || g == &a->groups[CA_AUTO_RAMP] ? 1.0 : 2.0,
                 most = is_ppm(a) ? 1.0 : MOST_CAMERA_PATHS;
    g->light_paths = light_paths > LEAST_LIGHT_PATHS ? (uint32_t)light_paths : LEAST_LIGHT_PATHS;
    g->camera_paths = (uint32_t)fmin(fmax(g->camera_paths * step + 0.5, least), most);
}

/* The memory that is allowed may not hold what there is time for. */
static ca_status scale_to_memory(ca_auto_rays *a, ca_auto_group *g, uint32_t least, ca_error *error)
{
    bool fits = true;
    while (g->light_paths > least) {
        CA_TRY(ca_render_plan_fits(a->plan, g->light_paths, &fits, error));
        if (fits) break;
        g->light_paths = g->light_paths / 2 > least ? g->light_paths / 2 : least;
    }
    return CA_OK;
}

/* The ordinary iterations after a ramp whose last one took `seconds`: a step further, or more where there is time for
 * the usual number of them, less where there would not be for the least. The larger they are the more a pilot tells
 * in its time: of pairs as many more, and what paths cost when there are many. */
static ca_status plan_ordinary(ca_auto_rays *a, double seconds, ca_error *error)
{
    ca_auto_group *ordinary = &a->groups[CA_AUTO_ORDINARY];
    const uint32_t planned = ordinary->light_paths;
    const double usual = cbrt(room_for(a, USUAL_ITERATIONS, seconds)),
                 most = cbrt(room_for(a, LEAST_ITERATIONS, seconds));
    const double step = a->groups[CA_AUTO_RAMP].iterations == CA_AUTO_HALVES ? CAMERA_STEP : 1.0;
    ordinary->light_paths = a->groups[CA_AUTO_RAMP].light_paths;
    ordinary->camera_paths = a->groups[CA_AUTO_RAMP].camera_paths;
    resize(a, ordinary, fmax(fmin(fmax(usual, step), most), 0.5));
    return scale_to_memory(a, ordinary, planned < ordinary->light_paths ? planned : ordinary->light_paths, error);
}

/* ---- Iterations ------------------------------------------------------------------------------------------------ */

/* A noise target may be reached on the way: looked at when the ordinary iterations have doubled. */
static bool is_quiet_enough(ca_auto_rays *a)
{
    const uint32_t done = a->groups[CA_AUTO_ORDINARY].iterations, doublings = done / LEAST_ITERATIONS;
    if (a->looks.target <= 0.0 || done % LEAST_ITERATIONS != 0 || (doublings & (doublings - 1)) != 0) return false;
    const double ratio = ca_auto_noise(a) / a->looks.target;
    if (ratio >= 0.0) a->looks.seconds_predicted = a->seconds * ratio * ratio; /* at most: with the pilot's numbers */
    return ca_noise_looks_reached(&a->looks);
}

static bool pilot_is_long_enough(ca_auto_rays *a)
{
    if (a->groups[CA_AUTO_ORDINARY].iterations < LEAST_ITERATIONS) return false;
    if (is_quiet_enough(a)) return true;
    if (ca_auto_by_samples(a)) return a->camera_paths >= share_of_samples * ca_auto_work_end(a);
    return a->seconds >= pilot_seconds(a);
}

static ca_status run_iteration(ca_auto_rays *a, ca_auto_batch *batch, int group, double *seconds, ca_error *error)
{
    ca_auto_group *g = &a->groups[group];
    ca_auto_half *half = &a->halves[g->iterations % CA_AUTO_HALVES];
    const bool plain = group == CA_AUTO_RAMP || g->iterations / CA_AUTO_HALVES % PLAIN_EVERY == 0;
    CA_TRY(ca_auto_batch_run(a, batch, &half->films[group], plain ? NULL : &half->pairs, plain ? half->times : NULL,
                             seconds, error));
    g->iterations++;
    g->variances += 1.0 / sqrt((double)g->light_paths * g->camera_paths);
    if (plain && group == CA_AUTO_ORDINARY) {
        half->plain_seconds += *seconds;
        half->plain_count++;
    }
    ca_auto_report(a);
    return CA_OK;
}

/* Iterations with the group's numbers: two, or ordinary ones to the pilot's end. Both halves have the same whenever
 * that is. *seconds: of the last one; those before it have warmed up memory and caches. */
static ca_status run_group(ca_auto_rays *a, int group, double *seconds, ca_error *error)
{
    ca_auto_batch batch;
    const ca_auto_group *g = &a->groups[group];
    ca_auto_set_uniform(a, g->light_paths, g->camera_paths);
    ca_status status = ca_auto_batch_begin(a, &batch, error);
    while (status == CA_OK) {
        status = run_iteration(a, &batch, group, seconds, error);
        if (g->iterations % CA_AUTO_HALVES != 0) continue;
        if (a->interrupted || group == CA_AUTO_RAMP || pilot_is_long_enough(a)) break;
    }
    ca_auto_batch_end(a, &batch);
    return status;
}

/* Step by step to numbers that are worth their time, where nobody gave numbers and the clock decides. */
static ca_status run_ramp(ca_auto_rays *a, double *seconds, ca_error *error)
{
    ca_auto_group *ramp = &a->groups[CA_AUTO_RAMP];
    CA_TRY(run_group(a, CA_AUTO_RAMP, seconds, error));
    while (!a->interrupted && room_for(a, USUAL_ITERATIONS, *seconds) > cost_of_step) {
        const ca_auto_group before = *ramp;
        resize(a, ramp, CAMERA_STEP);
        CA_TRY(scale_to_memory(a, ramp, before.light_paths, error));
        if (ramp->light_paths == before.light_paths) return CA_OK;
        CA_TRY(run_group(a, CA_AUTO_RAMP, seconds, error));
    }
    return CA_OK;
}

ca_status ca_auto_pilot_run(ca_auto_rays *a, ca_error *error)
{
    double seconds;
    if (a->given || ca_auto_by_samples(a)) {
        CA_TRY(run_group(a, CA_AUTO_RAMP, &seconds, error));
    } else {
        CA_TRY(run_ramp(a, &seconds, error));
        CA_TRY(plan_ordinary(a, seconds, error));
    }
    a->timed_light_paths = a->groups[CA_AUTO_ORDINARY].light_paths;
    return a->interrupted ? CA_OK : run_group(a, CA_AUTO_ORDINARY, &seconds, error);
}
