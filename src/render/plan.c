/* From a scene and settings to a plan: what the settings leave open, the scene says. */
#include "render/render.h"

#include "base/text.h"

#include <math.h>
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

/* settings->integrator is "name" or "name:parameter=value,...". */
static ca_status plan_integrator(ca_render_plan *plan, ca_error *error)
{
    const ca_integrator_desc *desc = &plan->scene->desc.integrator;
    const char *chosen = plan->settings->integrator;
    const char *overrides = chosen ? strchr(chosen, ':') : NULL;
    char name[64];
    if (chosen) {
        const size_t length = overrides ? (size_t)(overrides - chosen) : strlen(chosen);
        if (length >= sizeof name) return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "no integrator is called \"%s\"", chosen);
        memcpy(name, chosen, length);
        name[length] = '\0';
        CA_TRY(ca_integrator_find(name, NULL, &plan->type, error));
    } else {
        CA_TRY(ca_integrator_find(desc->name ? desc->name : "path", &desc->where, &plan->type, error));
    }
    CA_TRY(ca_integrator_configure(plan->type, desc, chosen != NULL, overrides ? overrides + 1 : NULL, &plan->input,
                                   error));
    if (!plan->settings->has_max_depth) return CA_OK;
    const ca_parameter max_depth = {
        .name = "max_depth", .kind = CA_PARAMETER_NUMBER, .number = plan->settings->max_depth};
    return ca_integrator_set(plan->type, &max_depth, &plan->input, error);
}

static ca_status plan_stopping(ca_render_plan *plan, ca_error *error)
{
    const ca_render_settings *settings = plan->settings;
    if (settings->seconds < 0.0 || !isfinite(settings->seconds))
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "the rendering time must be a positive number of seconds");
    if (settings->noise_percent < 0.0 || !isfinite(settings->noise_percent))
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "the noise target must be a positive number of percent");
    plan->pass_limit = settings->samples_per_pixel;
    if (plan->pass_limit == 0)
        plan->pass_limit = settings->seconds > 0.0 || settings->noise_percent > 0.0
                               ? UINT32_MAX
                               : plan->scene->desc.samples_per_pixel;
    return CA_OK;
}

static ca_status check_memory(const ca_render_plan *plan, ca_error *error)
{
    const double mib = (double)(plan->crop[2] - plan->crop[0]) * (plan->crop[3] - plan->crop[1]) *
                       (double)sizeof(ca_film_pixel) / (1024.0 * 1024.0);
    if (plan->settings->memory_mib <= 0.0 || mib <= plan->settings->memory_mib) return CA_OK;
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "the film alone needs %.1f MiB, more than the %.1f MiB allowed", mib,
                   plan->settings->memory_mib);
}

ca_status ca_render_plan_make(ca_render_plan *plan, const ca_scene *scene, const ca_render_settings *settings,
                              ca_error *error)
{
    *plan = (ca_render_plan){.scene = scene, .settings = settings};
    uint32_t width, height;
    CA_TRY(plan_film(plan, &width, &height, error));
    CA_TRY(plan_sampler(plan, error));
    CA_TRY(plan_integrator(plan, error));
    CA_TRY(plan_stopping(plan, error));
    CA_TRY(check_memory(plan, error));
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
    return CA_OK;
}
