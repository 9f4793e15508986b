/* What the settings say of the goal and of the pilot. */
#include "base/text.h"
#include "noise/ray_map.h"
#include "render/auto_rays_state.h"

#include <string.h>

static bool camera_paths_are_given(const ca_render_plan *plan)
{
    const ca_render_settings *settings = plan->settings;
    return settings->camera_paths > 0 || ca_render_overrides_mention(settings->integrator, "camera_paths");
}

/* A pilot with one camera path is refused only where the user asked for one; else it has two. */
static ca_status read_camera_paths(const ca_render_plan *plan, uint32_t *camera_paths, ca_error *error)
{
    *camera_paths = plan->camera_paths;
    if (ca_integrator_has(plan->type, CA_ABILITY_ONE_CAMERA_PATH)) {
        if (*camera_paths == 1) return CA_OK;
        return ca_fail(
            error, CA_ERROR_ARGUMENT, NULL,
            "%s has one camera path per pixel, not %u: with rays \"auto\" only its light paths are chosen",
            plan->type->name, *camera_paths);
    }
    if (*camera_paths > CA_RAY_MAP_MOST_CAMERA_PATHS)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "a pilot can have at most %d camera paths per pixel, not %u",
                       CA_RAY_MAP_MOST_CAMERA_PATHS, *camera_paths);
    if (*camera_paths >= CA_PILOT_LEAST_CAMERA_PATHS) return CA_OK;
    if (camera_paths_are_given(plan))
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "a pilot needs at least %d camera paths per pixel to estimate the noise of light paths, not 1",
                       CA_PILOT_LEAST_CAMERA_PATHS);
    *camera_paths = CA_PILOT_LEAST_CAMERA_PATHS;
    return CA_OK;
}

/* 0 light paths: one per pixel of the full film. */
static ca_status read_light_paths(const ca_render_plan *plan, uint32_t *light_paths, ca_error *error)
{
    const double given = ca_integrator_value(plan->type, &plan->input, "light_paths", 0.0);
    const double pixels = (double)plan->camera.width * (double)plan->camera.height;
    const double number =
        given > 0.0 ? given : fmin(fmax(pixels, CA_PILOT_LEAST_LIGHT_PATHS), CA_RAY_MAP_MOST_LIGHT_PATHS);
    if (number < CA_PILOT_LEAST_LIGHT_PATHS)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "a pilot estimates from two halves of the light paths: it needs at least %d, not %.0f",
                       CA_PILOT_LEAST_LIGHT_PATHS, number);
    *light_paths = (uint32_t)number;
    return CA_OK;
}

static void read_goal(ca_auto_rays *a)
{
    const ca_render_settings *settings = a->plan->settings;
    if (a->plan->rays == CA_RAYS_OF_RECORD) return; /* that is the end */
    a->goal.choosing = a->plan->method.seconds;
    a->goal.seconds = settings->seconds; /* may be set beside a number of samples, too */
    if (a->plan->open_ended) return;
    a->goal.samples =
        settings->samples_per_pixel ? settings->samples_per_pixel : a->plan->scene->desc.samples_per_pixel;
}

ca_status ca_auto_read_settings(ca_auto_rays *a, ca_error *error)
{
    const ca_render_plan *plan = a->plan;
    read_goal(a);
    a->given = ca_integrator_value(plan->type, &plan->input, "light_paths", 0.0) > 0.0 || plan->camera_paths > 1;
    CA_TRY(read_camera_paths(plan, &a->pilot_settings.camera_paths, error));
    CA_TRY(read_light_paths(plan, &a->pilot_settings.light_paths, error));
    if (ca_auto_connects(a) && a->pilot_settings.light_paths < a->pilot_settings.camera_paths)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "each camera path of a pixel connects to a light path of its own: a pilot of %u camera paths "
                       "per pixel needs as many light paths, not %u",
                       a->pilot_settings.camera_paths, a->pilot_settings.light_paths);
    const double least = ca_pilot_least_samples(a->pilot_settings.camera_paths);
    if (a->goal.samples == 0.0 || a->goal.samples >= 2.0 * least) return CA_OK;
    return ca_fail(
        error, CA_ERROR_ARGUMENT, NULL,
        "%.0f %s per pixel %s too few for rays \"auto\": its pilot has %.0f, so at least %.0f are needed",
        a->goal.samples, ca_noun(a->goal.samples, "sample", "samples"), ca_noun(a->goal.samples, "is", "are"), least,
        2.0 * least);
}
