/* From a scene and settings to a plan: what the settings leave open, the scene says. */
#include "render/render.h"

#include "base/text.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static uint32_t scale_edge(uint32_t edge, uint32_t from, uint32_t to)
{
    return (uint32_t)(((uint64_t)edge * to + from / 2) / from);
}

static ca_status plan_film(ca_render_plan *plan, uint32_t *width, uint32_t *height, ca_error *error)
{
    const ca_film_desc *film = &plan->scene->desc.film;
    const ca_render_settings *settings = plan->settings;
    *width = settings->width ? settings->width : film->width;
    *height = settings->height ? settings->height : film->height;
    if (*width > CA_IMAGE_MAX_SIDE || *height > CA_IMAGE_MAX_SIDE)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "a film of %u x %u pixels is over the limit of %d a side", *width,
                       *height, CA_IMAGE_MAX_SIDE);
    if (settings->has_crop) {
        memcpy(plan->crop, settings->crop, sizeof plan->crop);
    } else {
        plan->crop[0] = scale_edge(film->crop_x, film->width, *width);
        plan->crop[1] = scale_edge(film->crop_y, film->height, *height);
        plan->crop[2] = scale_edge(film->crop_x + film->crop_width, film->width, *width);
        plan->crop[3] = scale_edge(film->crop_y + film->crop_height, film->height, *height);
    }
    const uint32_t *c = plan->crop;
    if (c[0] >= c[2] || c[1] >= c[3] || c[2] > *width || c[3] > *height)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "the crop %u,%u,%u,%u is empty or leaves the film of %u x %u pixels", c[0], c[1], c[2], c[3],
                       *width, *height);
    return CA_OK;
}

static ca_status plan_sampler(ca_render_plan *plan, ca_error *error)
{
    plan->sampler = plan->scene->desc.sampler;
    if (plan->settings->has_seed) plan->sampler.seed = plan->settings->seed;
    const char *wanted = plan->settings->sampler;
    if (!wanted) return CA_OK;
    for (int kind = 0; ca_sampler_name((ca_sampler_kind)kind); kind++)
        if (strcmp(wanted, ca_sampler_name((ca_sampler_kind)kind)) == 0) {
            plan->sampler.kind = (ca_sampler_kind)kind;
            return CA_OK;
        }
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "unknown sampler \"%s\" (there are: independent, sobol)", wanted);
}

/* ---- The integrator and its parameters -------------------------------------------------------------------------- */

/* Does "a=1,b=2" set `name`? */
static bool overrides_mention(const char *overrides, const char *name)
{
    const size_t length = strlen(name);
    for (const char *c = overrides; c; c = strchr(c, ',') ? strchr(c, ',') + 1 : NULL)
        if (strncmp(c, name, length) == 0 && c[length] == '=') return true;
    return false;
}

/* A setting of its own for a parameter: wins over the scene, must not contradict what stands beside the name. */
typedef struct own_setting {
    const char *name, *what; /* "integrator "path" has no <what>" */
    bool given;
    double value;
} own_setting;

static ca_status apply_setting(ca_render_plan *plan, const own_setting *setting, const char *overrides, ca_error *error)
{
    if (!setting->given) return CA_OK;
    const double before = ca_integrator_value(plan->type, &plan->input, setting->name, (double)NAN);
    if (isnan(before))
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "integrator \"%s\" has no %s", plan->type->name, setting->what);
    if (overrides_mention(overrides, setting->name) && before != setting->value)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "\"%s\" is %.9g among the integrator's own parameters but %.9g as a setting", setting->name, before,
                       setting->value);
    const ca_parameter parameter = {.name = setting->name, .kind = CA_PARAMETER_NUMBER, .number = setting->value};
    return ca_integrator_set(plan->type, &parameter, &plan->input, error);
}

static ca_status apply_own_settings(ca_render_plan *plan, const char *overrides, ca_error *error)
{
    const ca_render_settings *s = plan->settings;
    const own_setting own[] = {
        {"max_depth", "limit on the length of paths", s->has_max_depth, s->max_depth},
        {"radius", "merge radius", s->radius != 0.0, s->radius},
        {"alpha", "merge radius to shrink", s->has_alpha, s->alpha},
        {"light_paths", "light paths", s->light_paths != 0, s->light_paths},
        {"camera_paths", "number of camera paths to choose: each pass makes one per pixel", s->camera_paths != 0,
         s->camera_paths},
    };
    for (size_t i = 0; i < sizeof own / sizeof own[0]; i++) CA_TRY(apply_setting(plan, &own[i], overrides, error));
    return CA_OK;
}

/* settings->integrator is "name" or "name:parameter=value,...". */
static ca_status plan_integrator(ca_render_plan *plan, ca_error *error)
{
    const ca_integrator_desc *desc = &plan->scene->desc.integrator;
    const char *chosen = plan->settings->integrator;
    const char *overrides = chosen ? strchr(chosen, ':') : NULL;
    char name[64];
    if (chosen) {
        const size_t length = overrides ? (size_t)(overrides - chosen) : strlen(chosen);
        if (length >= sizeof name)
            return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "no integrator is called \"%s\"", chosen);
        memcpy(name, chosen, length);
        name[length] = '\0';
        CA_TRY(ca_integrator_find(name, NULL, &plan->type, error));
    } else {
        CA_TRY(ca_integrator_find(desc->name ? desc->name : "path", &desc->where, &plan->type, error));
    }
    if (overrides) overrides++;
    CA_TRY(ca_integrator_configure(plan->type, desc, chosen != NULL, overrides, &plan->input, error));
    CA_TRY(apply_own_settings(plan, overrides, error));
    plan->camera_paths = (uint32_t)ca_integrator_value(plan->type, &plan->input, "camera_paths", 1.0);
    return CA_OK;
}

/* Technique images are one a technique, so there must be an end to their number. */
static ca_status check_strategies(const ca_render_plan *plan, ca_error *error)
{
    if (!plan->settings->strategies_directory) return CA_OK;
    const double max_depth = ca_integrator_value(plan->type, &plan->input, "max_depth", -1.0);
    if (max_depth >= 0.0 && max_depth <= CA_TECHNIQUE_MAX_VERTICES - 1) return CA_OK;
    char now[32] = "it is not limited";
    if (max_depth >= 0.0) snprintf(now, sizeof now, "it is %.0f", max_depth);
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                   "images of the strategies need a max_depth of at most %d, since there is one for each length (%s)",
                   CA_TECHNIQUE_MAX_VERTICES - 1, now);
}

/* ---- When to stop, and memory ----------------------------------------------------------------------------------- */

static ca_status check_targets(const ca_render_settings *settings, ca_error *error)
{
    if (settings->seconds < 0.0 || !isfinite(settings->seconds))
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "the rendering time must be a positive number of seconds");
    if (settings->noise_percent < 0.0 || !isfinite(settings->noise_percent))
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "the noise target must be a positive number of percent");
    return CA_OK;
}

/* Samples per pixel are camera paths; of `light`, whose camera paths only see emitters, they are light paths. */
static double samples_per_pass(const ca_render_plan *plan, uint32_t width, uint32_t height)
{
    if (strcmp(plan->type->name, "light") != 0) return plan->camera_paths;
    const double light_paths = ca_integrator_value(plan->type, &plan->input, "light_paths", 0.0);
    return light_paths > 0.0 ? light_paths / ((double)width * (double)height) : 1.0; /* 0: one per pixel */
}

static ca_status plan_stopping(ca_render_plan *plan, uint32_t width, uint32_t height, ca_error *error)
{
    const ca_render_settings *settings = plan->settings;
    CA_TRY(check_targets(settings, error));
    plan->samples_per_pass = samples_per_pass(plan, width, height);
    plan->pass_limit = UINT32_MAX / plan->camera_paths; /* camera paths are numbered in 32 bits */
    plan->open_ended = settings->samples_per_pixel == 0 && (settings->seconds > 0.0 || settings->noise_percent > 0.0);
    if (plan->open_ended) return CA_OK;
    const uint32_t samples =
        settings->samples_per_pixel ? settings->samples_per_pixel : plan->scene->desc.samples_per_pixel;
    const double passes = ceil(samples / plan->samples_per_pass);
    if (passes > plan->pass_limit)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "%u samples per pixel would take %.0f passes, over the limit of %u", samples, passes,
                       plan->pass_limit);
    plan->pass_limit = (uint32_t)passes;
    return CA_OK;
}

/* What the film leaves is for light paths. */
static ca_status plan_memory(ca_render_plan *plan, ca_error *error)
{
    const double allowed = plan->settings->memory_mib * 0x1p20;
    const double film = (double)(plan->crop[2] - plan->crop[0]) * (plan->crop[3] - plan->crop[1]) *
                        (double)sizeof(ca_film_pixel);
    if (allowed <= 0.0) return CA_OK;
    if (film > allowed)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "the film alone needs %.1f MiB, more than the %.1f MiB allowed",
                       film / 0x1p20, plan->settings->memory_mib);
    plan->input.memory_bytes = fmax(1.0, allowed - film); /* 0 would lift the limit */
    return CA_OK;
}

ca_status ca_render_plan_make(ca_render_plan *plan, const ca_scene *scene, const ca_render_settings *settings,
                              ca_error *error)
{
    *plan = (ca_render_plan){.scene = scene, .settings = settings};
    uint32_t width, height;
    CA_TRY(plan_film(plan, &width, &height, error));
    CA_TRY(plan_sampler(plan, error));
    CA_TRY(plan_integrator(plan, error));
    CA_TRY(check_strategies(plan, error));
    CA_TRY(plan_stopping(plan, width, height, error));
    CA_TRY(plan_memory(plan, error));
    const long processors = sysconf(_SC_NPROCESSORS_ONLN);
    plan->threads = settings->threads ? settings->threads : processors > 0 ? (uint32_t)processors : 1;
    if (plan->threads > 1024)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "%u threads are over the limit of 1024", plan->threads);
    plan->camera = ca_scene_camera(scene, width, height);
    plan->filter = scene->desc.film.filter;
    ca_filter_prepare(&plan->filter);
    plan->input.scene = scene;
    plan->input.camera = &plan->camera;
    plan->input.sampler = &plan->sampler;
    plan->input.filter = &plan->filter;
    plan->input.workers = plan->threads;
    memcpy(plan->input.crop, plan->crop, sizeof plan->input.crop);
    return CA_OK;
}
