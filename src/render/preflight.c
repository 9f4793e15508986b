/* What can be said of a render before it is made (ca_preflight_make). */
#include "render/preflight.h"

#include "photon/radius.h"
#include "render/light_pilot.h"
#include "render/public_structs.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Shares of the light that are worth a warning: if it is missing; and if it is there, but all in dots. */
#define MUCH_TO_LOSE 0.02
#define MUCH_IN_DOTS 0.1

/* The integrator that finds the light which others lose. */
static const ca_integrator_type *const finder = &ca_integrator_auto;

static CA_PRINTF(2, 3) void warn(ca_preflight *preflight, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(preflight->warnings[preflight->warning_count++], CA_PREFLIGHT_WARNING_SIZE, format, arguments);
    va_end(arguments);
}

/* How long a render is expected to be. */
typedef struct render_length {
    double iterations;
    double photons; /* that a pixel merges in these, in the mean, at least; 0: not known */
    const char *name; /* "the whole render" */
} render_length;

/* ---- Light that is lost ---------------------------------------------------------------------------------------- */

/* One that merges finds all there is: what it has too few samples of are photons. */
static void judge_lost_light(ca_preflight *preflight, const ca_render_plan *plan, bool merges, ca_light_pilot *pilot)
{
    const ca_batch_ratio lost = ca_lost_light(pilot->samples[0], pilot->count);
    preflight->lost_light = lost.value;
    preflight->lost_light_low = lost.low;
    preflight->lost_light_high = lost.high;
    if (merges || !(lost.low > MUCH_TO_LOSE)) return;
    warn(preflight,
         "\"%s\" will find none or too little of about %.0f %% of the light, such as light through glass seen "
         "through glass; -i %s finds it",
         plan->type->name, 100.0 * lost.value, finder->name);
}

/* ---- Merges ---------------------------------------------------------------------------------------------------- */

/* Where of so many events none happened, their expected number is below this (95 %). */
#define NONE_SEEN 3.0

/* Photons that a pixel merges over the whole render for each that a merge of the pilot found. */
static double photons_per_photon(const ca_render_plan *plan, const ca_mis_rules *counts, double iterations,
                                 const ca_light_pilot *pilot)
{
    return plan->camera_paths * iterations * (double)counts->reuse.light_paths * (double)counts->merge_area /
           (pilot->light_paths * pilot->merge_area);
}

/* So many times the pilot's photons those of the render are, since its light paths are guided and the pilot's are
 * not. */
static double gain_of_guide(const ca_light_pilot *pilot, double scale, double photons)
{
    const double unguided = scale * (double)pilot->counters.merges / (double)pilot->counters.camera_paths;
    return photons > unguided ? photons / unguided : 1.0;
}

static void judge_merges(ca_preflight *preflight, const ca_render_plan *plan, const ca_mis_rules *counts,
                         const render_length *length, const ca_light_pilot *pilot)
{
    if (counts->merge == CA_MERGE_NONE) return;
    double scale = photons_per_photon(plan, counts, length->iterations, pilot);
    scale *= gain_of_guide(pilot, scale, length->photons);
    const ca_batch_ratio light = ca_batch_ratio_of(pilot->merged, pilot->light, CA_LIGHT_BATCHES);
    const ca_batch_ratio photons = ca_batch_ratio_of(pilot->merged_photons, pilot->merged, CA_LIGHT_BATCHES);
    if (isnan(light.value)) return; /* the pilot found no light */
    preflight->merged_light = fmin(light.value, 1.0);
    preflight->merged_light_low = fmax(light.low, 0.0);
    preflight->merged_light_high = fmin(light.high, 1.0);
    preflight->merged_photons = scale * photons.value;
    preflight->merged_photons_low = scale * fmax(photons.low, 0.0);
    preflight->merged_photons_high = scale * fmax(photons.high, NONE_SEEN / (double)pilot->merges);
    if (!(light.low > MUCH_IN_DOTS) || !(preflight->merged_photons_high < 1.0)) return;
    warn(preflight,
         "about %.0f %% of the light will be dots: it comes from merges, with fewer than %.2g photons a pixel in "
         "%s; a larger merge radius (--radius) or more light paths (--light-paths) smooth it",
         100.0 * preflight->merged_light, preflight->merged_photons_high, length->name);
}

static void warn_of_radius(ca_preflight *preflight, double scene_radius)
{
    warn(preflight,
         "a merge radius of %.4g reaches beyond the whole scene, which lies in a sphere of radius %.4g: light is "
         "blurred over all of it, and lost at its edges",
         preflight->radius, scene_radius);
}

/* ---- The call -------------------------------------------------------------------------------------------------- */

static ca_status judge_light(ca_preflight *preflight, const ca_render_plan *plan, const render_length *length,
                             ca_error *error)
{
    ca_mis_rules counts;
    if (!ca_integrator_counts(plan->type, &plan->input, &counts)) return CA_OK;
    const double to_lose = ca_light_pilot_passes(plan, length->iterations);
    const double alpha = ca_integrator_value(plan->type, &plan->input, "alpha", 0.0);
    counts.merge_area *= (float)ca_progressive_mean_area(alpha, length->iterations);
    ca_light_pilot pilot;
    const ca_light_question question = {.counts = &counts, .methods = 1, .iterations = to_lose};
    CA_TRY(ca_light_pilot_run(&pilot, plan, &question, error));
    preflight->camera_paths = pilot.counters.camera_paths;
    preflight->light_paths = pilot.counters.light_paths;
    preflight->rays = pilot.counters.rays;
    preflight->shadow_rays = pilot.counters.shadow_rays;
    judge_lost_light(preflight, plan, counts.merge != CA_MERGE_NONE, &pilot);
    /* Numbers that will be chosen the plan does not know: what is lost hardly depends on them, but dots do. */
    if (plan->rays == CA_RAYS_OF_SETTINGS) judge_merges(preflight, plan, &counts, length, &pilot);
    ca_light_pilot_destroy(&pilot);
    return CA_OK;
}

ca_status ca_preflight_make(const ca_scene *scene, const ca_render_settings *settings, ca_preflight *preflight,
                            ca_error *error)
{
    const double unknown = (double)NAN;
    ca_render_settings taken;
    ca_render_plan plan;
    CA_TRY(ca_settings_take(settings, &taken, error));
    *preflight = (ca_preflight){.lost_light = unknown,
                                .lost_light_low = unknown,
                                .lost_light_high = unknown,
                                .merged_light = unknown,
                                .merged_light_low = unknown,
                                .merged_light_high = unknown,
                                .merged_photons = unknown,
                                .merged_photons_low = unknown,
                                .merged_photons_high = unknown};
    CA_TRY(ca_render_plan_make(&plan, scene, &taken, error));
    preflight->radius = ca_integrator_value(plan.type, &plan.input, "radius", 0.0);
    preflight->no_light = scene->light_count == 0;
    if (preflight->radius > 2.0 * (double)scene->radius) warn_of_radius(preflight, (double)scene->radius);
    char name[48] = "the whole render"; /* of which who renders a part knows the passes up to its own */
    if (taken.has_passes) snprintf(name, sizeof name, "passes 0 to %u", plan.pass_limit - 1);
    const double iterations = plan.first_pass + ca_render_plan_expected_passes(&plan);
    const render_length length = {.iterations = iterations, .name = name};
    if (!preflight->no_light) return judge_light(preflight, &plan, &length, error);
    warn(preflight, "the scene has no light: the picture will be black");
    return CA_OK;
}

ca_status ca_preflight_chosen(const ca_render_plan *plan, double iterations, double photons, char *warning,
                              ca_error *error)
{
    ca_preflight preflight = {.warning_count = 0};
    const render_length length = {
        .iterations = iterations, .photons = photons, .name = "the whole render"};
    CA_TRY(judge_light(&preflight, plan, &length, error));
    if (preflight.warning_count > 0) memcpy(warning, preflight.warnings[0], sizeof preflight.warnings[0]);
    return CA_OK;
}
