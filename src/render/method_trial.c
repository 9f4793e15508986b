#include "render/method_trial.h"

#include "base/clock.h"
#include "photon/radius.h"
#include "sampling/owen.h"

#include <math.h>
#include <string.h>

/* Set apart from the render's. */
#define TRIAL_SEED UINT64_C(0x747269616c)

/* Of a trial's whole film: light paths are made for all of it, of which the rendered part may be little. */
#define MOST_PIXELS 0x1p16

/* ---- Parameters ------------------------------------------------------------------------------------------------ */

static double pixels_of_film(const ca_render_plan *plan)
{
    return (double)plan->camera.width * (double)plan->camera.height;
}

static double pixels_of_crop(const ca_render_plan *plan)
{
    return (double)(plan->crop[2] - plan->crop[0]) * (double)(plan->crop[3] - plan->crop[1]);
}

static ca_status set_number(const ca_integrator_type *type, const char *name, double value,
                            ca_integrator_input *input, ca_error *error)
{
    const ca_parameter parameter = {.name = name, .kind = CA_PARAMETER_NUMBER, .number = value};
    return ca_integrator_set(type, &parameter, input, error);
}

double ca_method_light_paths(const ca_method *method, const ca_render_plan *plan)
{
    const double given = ca_integrator_value(plan->type, &plan->input, "light_paths", 0.0);
    if (given > 0.0) return given;
    return fmax(1.0, round(pixels_of_film(plan) * pow(4.0, method->light_paths_log4)));
}

/* What the user did not set stays as the method's own default says. */
static void copy_shared(const ca_method *method, const ca_render_plan *plan, ca_integrator_input *chosen)
{
    const ca_parameter_spec *from = plan->type->parameters, *to = method->type->parameters;
    for (int i = 0; from[i].name; i++)
        for (int j = 0; to[j].name; j++)
            if (strcmp(from[i].name, to[j].name) == 0 && ca_render_plan_is_set(plan, from[i].name))
                chosen->values[j] = plan->input.values[i];
}

ca_status ca_method_configure(const ca_method *method, const ca_render_plan *plan, ca_integrator_input *chosen,
                              ca_error *error)
{
    const ca_integrator_desc nothing_set = {.name = NULL};
    const ca_parameter no_splats = {.name = "strategies", .kind = CA_PARAMETER_TEXT, .text = "no-splat"};
    *chosen = plan->input;
    CA_TRY(ca_integrator_configure(method->type, &nothing_set, false, NULL, chosen, error));
    copy_shared(method, plan, chosen);
    if (method->no_splats) CA_TRY(ca_integrator_set(method->type, &no_splats, chosen, error));
    if (method->light_paths_log4 == 0) return CA_OK;
    return set_number(method->type, "light_paths", ca_method_light_paths(method, plan), chosen, error);
}

/* ---- The trial's picture --------------------------------------------------------------------------------------- */

static uint32_t scaled(uint32_t size, double factor) { return (uint32_t)fmax(1.0, round(size * factor)); }

/* The first pixel at or before `at`, or after it. */
static uint32_t scaled_edge(uint32_t at, uint32_t from, uint32_t to, bool after)
{
    const uint64_t edge = (uint64_t)at * to + (after ? from - 1 : 0);
    return (uint32_t)(edge / from);
}

static void set_picture(ca_render_settings *settings, const ca_render_plan *plan)
{
    const double by_crop = sqrt(CA_TRIAL_PIXELS / pixels_of_crop(plan)),
                 by_film = sqrt(MOST_PIXELS / pixels_of_film(plan));
    const double factor = fmin(1.0, fmin(by_crop, by_film));
    const uint32_t width = plan->camera.width, height = plan->camera.height;
    settings->width = scaled(width, factor);
    settings->height = scaled(height, factor);
    settings->has_crop = true;
    settings->crop[0] = scaled_edge(plan->crop[0], width, settings->width, false);
    settings->crop[1] = scaled_edge(plan->crop[1], height, settings->height, false);
    settings->crop[2] = scaled_edge(plan->crop[2], width, settings->width, true);
    settings->crop[3] = scaled_edge(plan->crop[3], height, settings->height, true);
}

size_t ca_method_trial_pixel(const ca_method_trial *trial, const ca_render_plan *plan, uint32_t x, uint32_t y)
{
    const ca_film *film = &trial->film;
    const uint32_t *crop = plan->crop;
    const uint32_t column = (uint32_t)((uint64_t)(x - crop[0]) * film->width / (crop[2] - crop[0]));
    const uint32_t row = (uint32_t)((uint64_t)(y - crop[1]) * film->height / (crop[3] - crop[1]));
    return (size_t)row * film->width + column;
}

/* Fewer light paths and a larger radius. */
static ca_status set_merges(ca_method_trial *trial, const ca_render_plan *plan, const ca_integrator_input *render,
                            ca_error *error)
{
    const ca_integrator_type *type = trial->method.type;
    const double area = pixels_of_film(plan) / pixels_of_film(&trial->plan);
    const double light_paths = fmax(1.0, round(ca_method_light_paths(&trial->method, plan) / area));
    ca_integrator_input *input = &trial->plan.input;
    ca_mis_rules counts;
    if (!ca_method_has_light_paths(&trial->method)) return CA_OK;
    CA_TRY(set_number(type, "light_paths", light_paths, input, error));
    if (!ca_method_merges(&trial->method) || !ca_integrator_counts(type, render, &counts)) return CA_OK;
    const double alpha = ca_integrator_value(type, render, "alpha", 0.0);
    const double shrunk = ca_progressive_mean_area(alpha, ca_render_plan_expected_passes(plan));
    const double radius = sqrt((double)counts.merge_area / (double)CA_PI * area * shrunk);
    CA_TRY(set_number(type, "radius", radius, input, error));
    return set_number(type, "alpha", 0.0, input, error);
}

static ca_status make_plan(ca_method_trial *trial, const ca_render_plan *plan, ca_error *error)
{
    const ca_integrator_type *type = trial->method.type;
    ca_integrator_input render;
    trial->settings = (ca_render_settings){.integrator = type->name,
                                           .sampler = "independent",
                                           .seed = ca_pcg_permute(plan->seed ^ TRIAL_SEED),
                                           .has_seed = true,
                                           .threads = 1,
                                           .samples_per_pixel = 1};
    set_picture(&trial->settings, plan);
    CA_TRY(ca_render_plan_make(&trial->plan, plan->scene, &trial->settings, error));
    CA_TRY(ca_method_configure(&trial->method, plan, &render, error));
    memcpy(trial->plan.input.values, render.values, sizeof render.values);
    trial->plan.filter.sampled_part = (float)sqrt(pixels_of_film(&trial->plan) / pixels_of_film(plan));
    trial->plan.camera_paths = plan->camera_paths;
    return set_merges(trial, plan, &render, error);
}

/* ---- Its iterations -------------------------------------------------------------------------------------------- */

ca_status ca_method_trial_create(ca_method_trial *trial, const ca_render_plan *plan, const ca_method *method,
                                 ca_error *error)
{
    *trial = (ca_method_trial){.method = *method};
    CA_TRY(make_plan(trial, plan, error));
    const ca_render_plan *own = &trial->plan;
    CA_TRY(ca_film_create(&trial->film, own->camera.width, own->camera.height, own->crop, error));
    ca_status status = method->type->create(&own->input, &trial->integrator, error);
    if (status == CA_OK)
        status = ca_pass_runner_create(&trial->runner, own, trial->integrator, &trial->film, NULL, error);
    if (status != CA_OK) ca_method_trial_destroy(trial);
    return status;
}

void ca_method_trial_destroy(ca_method_trial *trial)
{
    if (trial->runner.plan) ca_pass_runner_destroy(&trial->runner);
    if (trial->integrator) trial->method.type->destroy(trial->integrator);
    ca_film_destroy(&trial->film);
    *trial = (ca_method_trial){.integrator = NULL};
}

ca_status ca_method_trial_run(ca_method_trial *trial, ca_error *error)
{
    const double start = ca_clock_thread_seconds();
    CA_TRY(ca_pass_run(&trial->runner, trial->iterations, error));
    const double seconds = ca_clock_thread_seconds() - start;
    if (trial->iterations == 1 || (trial->iterations > 1 && seconds < trial->seconds)) trial->seconds = seconds;
    trial->iterations++;
    return CA_OK;
}

/* ---- What they tell -------------------------------------------------------------------------------------------- */

void ca_method_trial_add_sums(const ca_method_trial *trial, double *sums)
{
    const size_t pixels = (size_t)trial->film.width * trial->film.height;
    for (size_t p = 0; p < pixels; p++) sums[p] += ca_film_luminance(trial->film.pixels[p].sum);
}

double ca_method_trial_variance(const ca_method_trial *trial, const double *weights)
{
    const size_t pixels = (size_t)trial->film.width * trial->film.height;
    const double n = trial->iterations;
    double sum = 0.0;
    for (size_t p = 0; p < pixels; p++) {
        const ca_film_pixel *pixel = &trial->film.pixels[p];
        const double luminance = ca_film_luminance(pixel->sum);
        sum += weights[p] * (pixel->sum_squares_luminance - luminance * luminance / n) / (n - 1.0);
    }
    return sum / (double)pixels;
}
