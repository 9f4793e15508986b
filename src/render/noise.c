#include "render/noise.h"

#include "base/memory.h"
#include "noise/layers.h"

#include <stdio.h>
#include <string.h>

/* A render plan for measuring; not copied, for the plan points into it. */
typedef struct noise_plan {
    ca_render_plan plan;
    ca_render_settings settings; /* the caller's, completed */
    const ca_render_settings *given;
    uint32_t light_paths;
    bool ended; /* by the caller's callback */
} noise_plan;

/* ---- Settings ----------------------------------------------------------------------------------------------------- */

static bool is_measurable(const char *integrator)
{
    return integrator && (strcmp(integrator, "bdpm") == 0 || strcmp(integrator, "ppm") == 0);
}

/* Of "name:parameter=value,..."; a name that no integrator has is left to the plan, which names them all. */
static ca_status check_integrator(const char *text, ca_error *error)
{
    char name[64];
    const ca_integrator_type *type;
    snprintf(name, sizeof name, "%.*s", text ? (int)strcspn(text, ":") : 0, text ? text : "");
    if (is_measurable(name) || ca_integrator_find(name, NULL, &type, NULL) != CA_OK) return CA_OK;
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                   "noise components are those of photon mapping: the integrator must be bdpm or ppm, not %s", name);
}

static ca_status check_settings(const ca_render_settings *s, uint32_t iterations, ca_error *error)
{
    if (iterations < 2)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "noise is measured in at least 2 iterations, not in %u", iterations);
    if (s->samples_per_pixel > 0 || s->seconds != 0.0 || s->noise_percent != 0.0)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "noise is measured in a number of iterations: samples per pixel, time or a noise target cannot end it");
    if (s->strategies_directory || s->has_blocks || s->part_path)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "noise is measured without blocks, part files and images of the strategies");
    if (s->sampler && strcmp(s->sampler, "independent") != 0)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "the law of noise holds for independent paths: the sampler must be \"independent\", not \"%.100s\"",
                       s->sampler);
    return CA_OK;
}

static bool report_progress(const ca_render_progress *progress, void *user)
{
    noise_plan *p = user;
    const ca_render_settings *given = p->given;
    if (given->progress && !given->progress(progress, given->progress_user)) p->ended = true;
    return !p->ended || progress->passes_done < 2;
}

static ca_status plan_counts(noise_plan *p, uint32_t iterations, ca_error *error)
{
    ca_render_plan *plan = &p->plan;
    const double light_paths = ca_integrator_value(plan->type, &plan->input, "light_paths", 0.0);
    const double pixels = (double)plan->camera.width * (double)plan->camera.height; /* 0 light paths: one per pixel */
    p->light_paths = (uint32_t)(light_paths > 0.0 ? light_paths : pixels);
    if (p->light_paths < 2)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "the noise components are estimated from two halves of the light paths: at least 2 are needed, not %u",
                       p->light_paths);
    const uint32_t most = UINT32_MAX / plan->camera_paths; /* camera paths are numbered in 32 bits */
    if (iterations > most)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "%u iterations of %u camera paths are over the limit of %u",
                       iterations, plan->camera_paths, most);
    plan->pass_limit = iterations;
    return CA_OK;
}

/* The pairs' sums take their part of the memory that is allowed. */
static ca_status plan_memory(ca_render_plan *plan, ca_error *error)
{
    const double sums = (double)(plan->crop[2] - plan->crop[0]) * (double)(plan->crop[3] - plan->crop[1]) *
                        (double)sizeof(ca_pair_pixel);
    if (plan->input.memory_bytes <= 0.0) return CA_OK;
    if (sums >= plan->input.memory_bytes)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "the film and the sums of pairs need %.1f MiB, more than the %.1f MiB allowed",
                       plan->settings->memory_mib + (sums - plan->input.memory_bytes) / 0x1p20, plan->settings->memory_mib);
    plan->input.memory_bytes -= sums;
    return CA_OK;
}

static ca_status make_plan(noise_plan *p, const ca_scene *scene, const ca_render_settings *given, uint32_t iterations,
                           ca_error *error)
{
    CA_TRY(check_settings(given, iterations, error));
    *p = (noise_plan){.settings = *given, .given = given};
    p->settings.sampler = "independent";
    p->settings.samples_per_pixel = 1; /* until the iterations are known to be countable */
    p->settings.progress = report_progress;
    p->settings.progress_user = p;
    if (!given->integrator && !is_measurable(scene->desc.integrator.name)) p->settings.integrator = "bdpm";
    CA_TRY(check_integrator(given->integrator, error));
    CA_TRY(ca_render_plan_make(&p->plan, scene, &p->settings, error));
    const ca_parameter one_radius = {.name = "alpha", .kind = CA_PARAMETER_NUMBER, .number = 0.0};
    const char *colon = given->integrator ? strchr(given->integrator, ':') : NULL;
    if (!given->has_alpha && !ca_render_overrides_mention(colon ? colon + 1 : NULL, "alpha"))
        CA_TRY(ca_integrator_set(p->plan.type, &one_radius, &p->plan.input, error));
    CA_TRY(plan_counts(p, iterations, error));
    return plan_memory(&p->plan, error);
}

ca_status ca_noise_check(const ca_scene *scene, const ca_render_settings *settings, uint32_t iterations, uint32_t picture[4],
                         ca_error *error)
{
    noise_plan p;
    CA_TRY(make_plan(&p, scene, settings, iterations, error));
    memcpy(picture, p.plan.crop, sizeof p.plan.crop);
    return CA_OK;
}

ca_status ca_noise_check_region(const uint32_t r[4], const uint32_t picture[4], ca_error *error)
{
    if (r[0] < r[2] && r[1] < r[3] && r[0] >= picture[0] && r[1] >= picture[1] && r[2] <= picture[2] && r[3] <= picture[3])
        return CA_OK;
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "the region %u,%u,%u,%u is empty or leaves the picture %u,%u,%u,%u", r[0],
                   r[1], r[2], r[3], picture[0], picture[1], picture[2], picture[3]);
}

/* ---- Measuring ---------------------------------------------------------------------------------------------------- */

static ca_status measure(noise_plan *p, ca_pair_film *film, ca_image_layers **image, ca_render_statistics *statistics,
                         ca_error *error)
{
    CA_TRY(ca_pair_film_create(film, p->plan.crop, p->light_paths, p->plan.camera_paths, error));
    p->plan.input.pairs = film;
    CA_TRY(ca_render_plan_run(&p->plan, image, statistics, error));
    if (film->incomplete) return ca_fail_memory(error, "the pairs of light and camera paths");
    return ca_noise_add_layers(film, *image, error);
}

ca_status ca_noise_measure(const ca_scene *scene, const ca_render_settings *settings, uint32_t iterations,
                           ca_noise **noise, ca_image_layers **image, ca_render_statistics *statistics, ca_error *error)
{
    ca_render_settings defaults;
    ca_image_layers *made = NULL;
    noise_plan p;
    *noise = NULL;
    if (image) *image = NULL;
    ca_render_settings_init(&defaults);
    CA_TRY(make_plan(&p, scene, settings ? settings : &defaults, iterations, error));
    *noise = ca_alloc_zeroed(1, sizeof **noise);
    ca_status status = *noise ? CA_OK : ca_fail_memory(error, "the noise");
    if (status == CA_OK) status = measure(&p, &(*noise)->film, &made, statistics, error);
    if (status == CA_OK && image) {
        *image = made;
        return CA_OK;
    }
    ca_layers_destroy(made);
    if (status == CA_OK) return CA_OK;
    ca_noise_release(*noise);
    *noise = NULL;
    return status;
}

ca_status ca_noise_average(const ca_noise *noise, const uint32_t *region, uint32_t light_paths, uint32_t camera_paths,
                           ca_noise_summary *summary, ca_error *error)
{
    const ca_pair_film *film = &noise->film;
    const uint32_t picture[4] = {film->x0, film->y0, film->x0 + film->width, film->y0 + film->height};
    if (!region) region = picture;
    CA_TRY(ca_noise_check_region(region, picture, error));
    if (light_paths < 1 || camera_paths < 1)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "noise is predicted for at least one light path and one camera path");
    if (film->camera_paths == 1 && camera_paths > 1)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "one camera path per pixel and iteration does not tell the noise of more: measure with at least 2");
    *summary = ca_noise_summarise(film, region, light_paths, camera_paths);
    return CA_OK;
}

void ca_noise_release(ca_noise *noise)
{
    if (!noise) return;
    ca_pair_film_destroy(&noise->film);
    ca_free(noise);
}
