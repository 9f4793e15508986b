#include "render/method_trial.h"

#include "base/clock.h"
#include "base/memory.h"
#include "base/stop.h"
#include "photon/radius.h"
#include "sampling/owen.h"

#include <math.h>
#include <string.h>

/* Set apart from the render's. */
#define TRIAL_SEED UINT64_C(0x747269616c)

/* Light paths of an iteration are at most so many, and fewer as long as the radius stays below this part of the
 * scene's: a larger one reaches around corners. */
#define MOST_LIGHT_PATHS 0x1p15
#define MOST_OF_SCENE 0.02

/* Camera paths that are traced together; values that a trial must have met to know how often they come. */
enum { GROUP = 256, MET = 8 };

/* What is expected of a render of which nothing is known: its time, s, and the camera paths of a thread a second. */
#define USUAL_RENDER_SECONDS 25.0
#define USUAL_CAMERA_PATHS_PER_SECOND 4e5

/* Of the pilot of the radius, for each second of a processor that the render is expected to take: three such pilots
 * take a thirtieth of it. */
#define EFFORT_OF_SECOND 1000.0

/* Of an iteration, s, by a clock that may be coarse. */
#define SHORTEST 1e-9

/* ---- Parameters ------------------------------------------------------------------------------------------------ */

static double pixels_of_film(const ca_render_plan *plan)
{
    return (double)plan->camera.width * (double)plan->camera.height;
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

static ca_merging merging_of(const ca_integrator_type *type)
{
    if (type->rules->connect) return CA_MERGING_AND_CONNECTING;
    return type == &ca_integrator_ppm ? CA_MERGING_PPM : CA_MERGING_BDPM;
}

static ca_status set_radius(const ca_method *method, const ca_render_plan *plan, const ca_method_radii *radii,
                            ca_integrator_input *chosen, ca_error *error)
{
    if (!radii || !ca_method_merges(method) || ca_render_plan_is_set(plan, "radius")) return CA_OK;
    const double radius = radii->of[merging_of(method->type)].radius;
    return ca_integrator_set_number(method->type, "radius", radius, chosen, error);
}

bool ca_method_may_be_guided(const ca_render_plan *plan)
{
    return !ca_render_plan_is_set(plan, "guide") &&
           ca_emission_can_be_guided(plan->scene->lights, plan->scene->light_count);
}

static ca_status set_guide(const ca_method *method, const ca_render_plan *plan, ca_integrator_input *chosen,
                           ca_error *error)
{
    const ca_parameter guided = {.name = "guide", .kind = CA_PARAMETER_BOOLEAN, .number = 1.0};
    const bool has_guide = ca_integrator_has_parameter(method->type, guided.name);
    if (!has_guide || method->unguided || !ca_method_may_be_guided(plan)) return CA_OK;
    return ca_integrator_set(method->type, &guided, chosen, error);
}

ca_status ca_method_configure(const ca_method *method, const ca_render_plan *plan, const ca_method_radii *radii,
                              ca_integrator_input *chosen, ca_error *error)
{
    const ca_integrator_desc nothing_set = {.name = NULL};
    const ca_parameter no_splats = {.name = "strategies", .kind = CA_PARAMETER_TEXT, .text = "no-splat"};
    *chosen = plan->input;
    CA_TRY(ca_integrator_configure(method->type, &nothing_set, false, NULL, chosen, error));
    copy_shared(method, plan, chosen);
    if (ca_render_plan_chooses_rays(plan) &&
        ca_integrator_has_parameter(method->type, "alpha")) /* as the render will be */
        CA_TRY(ca_integrator_set_number(method->type, "alpha", 0.0, chosen, error));
    if (method->no_splats) CA_TRY(ca_integrator_set(method->type, &no_splats, chosen, error));
    CA_TRY(set_guide(method, plan, chosen, error));
    CA_TRY(set_radius(method, plan, radii, chosen, error));
    if (method->light_paths_log4 == 0) return CA_OK;
    return ca_integrator_set_number(method->type, "light_paths", ca_method_light_paths(method, plan), chosen, error);
}

ca_status ca_method_find_radius(const ca_render_plan *plan, ca_merging merging, ca_method_radius *found,
                                ca_error *error)
{
    static const ca_integrator_type *const types[CA_MERGINGS] = {
        [CA_MERGING_PPM] = &ca_integrator_ppm,
        [CA_MERGING_BDPM] = &ca_integrator_bdpm,
        [CA_MERGING_AND_CONNECTING] = &ca_integrator_ovcm,
    };
    const ca_method method = {.type = types[merging]};
    ca_integrator_input input;
    float radius;
    CA_TRY(ca_method_configure(&method, plan, NULL, &input, error));
    const double effort = EFFORT_OF_SECOND * ca_method_expected_seconds(plan);
    CA_TRY(ca_radius_pilot(method.type, &input, effort, &radius, &found->blur, error));
    const double given = ca_integrator_value(method.type, &input, "radius", 0.0);
    const bool by_pixels = ca_integrator_value(method.type, &input, "radius_pixels", 0.0) > 0.0;
    if (given == 0.0 && !by_pixels)
        CA_TRY(ca_integrator_set_number(method.type, "radius", (double)radius, &input, error));
    CA_TRY(ca_integrator_resolve(method.type, &input, error));
    found->radius = ca_integrator_value(method.type, &input, "radius", 0.0);
    return CA_OK;
}

double ca_method_whole_seconds(const ca_render_plan *plan)
{
    const double given = plan->settings->seconds;
    return given > 0.0 ? given : plan->open_ended ? USUAL_RENDER_SECONDS : (double)INFINITY;
}

double ca_method_passes(const ca_render_plan *plan, double seconds)
{
    const double passes = plan->open_ended ? (double)INFINITY : plan->pass_limit - plan->first_pass;
    const double in_time = ca_method_whole_seconds(plan) * ca_render_plan_threads(plan) / fmax(seconds, SHORTEST);
    return fmin(passes, fmax(1.0, ceil(in_time)));
}

/* Before it is known: of one iteration. */
static double expected_seconds(const ca_render_plan *plan)
{
    return ca_render_plan_pixels(plan) * plan->camera_paths / USUAL_CAMERA_PATHS_PER_SECOND;
}

static double expected_passes(const ca_render_plan *plan) { return ca_method_passes(plan, expected_seconds(plan)); }

double ca_method_expected_seconds(const ca_render_plan *plan)
{
    return expected_passes(plan) * expected_seconds(plan);
}

/* ---- The trial's picture --------------------------------------------------------------------------------------- */

static uint32_t scaled(uint32_t size, double factor) { return (uint32_t)fmax(1.0, round(size * factor)); }

ca_trial_cells ca_trial_cells_of(const ca_render_plan *plan)
{
    const double most = fmin(CA_TRIAL_CELLS, (double)CA_TRIAL_CELLS * GROUP / plan->camera_paths);
    const double factor = fmin(1.0, sqrt(most / ca_render_plan_pixels(plan)));
    return (ca_trial_cells){.width = scaled(plan->crop[2] - plan->crop[0], factor),
                            .height = scaled(plan->crop[3] - plan->crop[1], factor)};
}

size_t ca_trial_cell_at(const ca_trial_cells *cells, const ca_render_plan *plan, uint32_t x, uint32_t y)
{
    const uint32_t *crop = plan->crop;
    const uint32_t column = (uint32_t)((uint64_t)(x - crop[0]) * cells->width / (crop[2] - crop[0]));
    const uint32_t row = (uint32_t)((uint64_t)(y - crop[1]) * cells->height / (crop[3] - crop[1]));
    return (size_t)row * cells->width + column;
}

/* Pixels of the render along the side of one of the trial. */
static double pixel_side(const ca_method *method, const ca_render_plan *plan, double radius)
{
    const double most = fmax(1.0, sqrt(ca_render_plan_pixels(plan) / CA_TRIAL_CELLS));
    if (!ca_method_has_light_paths(method)) return most;
    const double least = fmax(1.0, sqrt(ca_method_light_paths(method, plan) / MOST_LIGHT_PATHS));
    const double within = radius > 0.0 ? MOST_OF_SCENE * (double)plan->scene->radius / radius : (double)INFINITY;
    return fmax(least, fmin(most, within));
}

/* The first pixel at or before `at`, or after it. */
static uint32_t scaled_edge(uint32_t at, uint32_t from, uint32_t to, bool after)
{
    const uint64_t edge = (uint64_t)at * to + (after ? from - 1 : 0);
    return (uint32_t)(edge / from);
}

static void set_picture(ca_render_settings *settings, const ca_render_plan *plan, double side)
{
    const uint32_t width = plan->camera.width, height = plan->camera.height;
    settings->width = scaled(width, 1.0 / side);
    settings->height = scaled(height, 1.0 / side);
    settings->has_crop = true;
    settings->crop[0] = scaled_edge(plan->crop[0], width, settings->width, false);
    settings->crop[1] = scaled_edge(plan->crop[1], height, settings->height, false);
    settings->crop[2] = scaled_edge(plan->crop[2], width, settings->width, true);
    settings->crop[3] = scaled_edge(plan->crop[3], height, settings->height, true);
}

/* The mean radius over the render's passes; 0: nothing is merged. */
static double mean_radius(ca_method_trial *trial, const ca_render_plan *plan, const ca_integrator_input *render)
{
    const ca_integrator_type *type = trial->method.type;
    if (!ca_method_merges(&trial->method)) return 0.0;
    trial->radius = ca_integrator_value(type, render, "radius", 0.0);
    trial->alpha = ca_integrator_value(type, render, "alpha", 0.0);
    return trial->radius * sqrt(ca_progressive_mean_area(trial->alpha, expected_passes(plan)));
}

/* Fewer light paths and a larger radius. The trial's plan is told the radius, too, or else it looks for one. */
static ca_status set_merges(ca_method_trial *trial, const ca_render_plan *plan, double radius,
                            ca_integrator_input *render, ca_error *error)
{
    const ca_integrator_type *type = trial->method.type;
    if (!ca_method_has_light_paths(&trial->method)) return CA_OK;
    const double light_paths = fmax(1.0, round(ca_method_light_paths(&trial->method, plan) / trial->area));
    CA_TRY(ca_integrator_set_number(type, "light_paths", light_paths, render, error));
    if (!(radius > 0.0)) return CA_OK;
    trial->settings.radius = radius * sqrt(trial->area);
    CA_TRY(ca_integrator_set_number(type, "radius", trial->settings.radius, render, error));
    return ca_integrator_set_number(type, "alpha", 0.0, render, error);
}

static ca_status make_plan(ca_method_trial *trial, const ca_render_plan *plan, const ca_method_radii *radii,
                           ca_error *error)
{
    const ca_integrator_type *type = trial->method.type;
    ca_integrator_input render;
    trial->settings = (ca_render_settings){.integrator = type->name,
                                           .sampler = "independent",
                                           .seed = ca_pcg_permute(plan->seed ^ TRIAL_SEED),
                                           .has_seed = true,
                                           .threads = 1,
                                           .samples_per_pixel = 1,
                                           .stop = plan->input.stop};
    CA_TRY(ca_method_configure(&trial->method, plan, radii, &render, error));
    const double radius = mean_radius(trial, plan, &render);
    set_picture(&trial->settings, plan, pixel_side(&trial->method, plan, radius));
    trial->area = pixels_of_film(plan) / ((double)trial->settings.width * trial->settings.height);
    CA_TRY(set_merges(trial, plan, radius, &render, error));
    CA_TRY(ca_render_plan_make(&trial->plan, plan->scene, &trial->settings, error));
    memcpy(trial->plan.input.values, render.values, sizeof render.values);
    trial->plan.filter.sampled_part = (float)(1.0 / sqrt(trial->area));
    trial->plan.camera_paths = plan->camera_paths;
    return CA_OK;
}

/* ---- Its iterations -------------------------------------------------------------------------------------------- */

ca_status ca_method_trial_create(ca_method_trial *trial, const ca_render_plan *plan, const ca_method *method,
                                 const ca_method_radii *radii, const ca_emission_guide *guide, ca_error *error)
{
    *trial = (ca_method_trial){.method = *method, .cells = ca_trial_cells_of(plan)};
    CA_TRY(make_plan(trial, plan, radii, error));
    trial->crop_pixels = ca_render_plan_pixels(plan);
    const bool guided = ca_integrator_value(method->type, &trial->plan.input, "guide", 0.0) != 0.0;
    if (guided) CA_TRY(ca_integrator_set_guide(method->type, guide, &trial->plan.input, error));
    trial->plan.input.tells_shown = true;
    trial->shown = ca_alloc_zeroed(ca_trial_cell_count(&trial->cells), sizeof *trial->shown);
    if (!trial->shown) return ca_fail_memory(error, "the trials");
    ca_status status = method->type->create(&trial->plan.input, &trial->integrator, error);
    if (status == CA_OK) status = ca_workers_create(&trial->workers, 1, error);
    trial->workers.parallel.stop = plan->input.stop;
    if (status != CA_OK) ca_method_trial_destroy(trial);
    return status;
}

void ca_method_trial_destroy(ca_method_trial *trial)
{
    if (trial->integrator) trial->method.type->destroy(trial->integrator);
    ca_workers_destroy(&trial->workers);
    ca_free(trial->samples);
    ca_free(trial->shown);
    *trial = (ca_method_trial){.integrator = NULL};
}

/* How many parts there are before this one with the same middle; *alike: with it and behind it, too. */
static uint32_t rank_of_part(uint32_t part, uint32_t parts, uint32_t size, uint32_t *alike)
{
    const uint32_t middle = ca_middle_of_part(part, parts, size);
    uint32_t first = part, end = part + 1;
    while (first > 0 && ca_middle_of_part(first - 1, parts, size) == middle) first--;
    while (end < parts && ca_middle_of_part(end, parts, size) == middle) end++;
    *alike = end - first;
    return part - first;
}

/* Of cells that have one pixel each has camera paths of its own: which of how many passes over the pixel. */
static uint32_t pass_of(const ca_method_trial *trial, uint32_t cell)
{
    const uint32_t *crop = trial->plan.crop;
    uint32_t columns, rows;
    const uint32_t column =
        rank_of_part(cell % trial->cells.width, trial->cells.width, crop[2] - crop[0], &columns);
    const uint32_t row = rank_of_part(cell / trial->cells.width, trial->cells.height, crop[3] - crop[1], &rows);
    return trial->iterations * columns * rows + row * columns + column;
}

/* The pixel in the middle of a cell. */
static void place(const ca_method_trial *trial, uint32_t cell, uint32_t *x, uint32_t *y)
{
    const uint32_t *crop = trial->plan.crop, column = cell % trial->cells.width, row = cell / trial->cells.width;
    *x = crop[0] + ca_middle_of_part(column, trial->cells.width, crop[2] - crop[0]);
    *y = crop[1] + ca_middle_of_part(row, trial->cells.height, crop[3] - crop[1]);
}

/* What camera paths have found of a cell. */
typedef struct cell_light {
    double found, shown;
} cell_light;

static void add_paths(cell_light *light, const ca_camera_path *paths, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) {
        const ca_film_sample *sample = paths[i].sample;
        const double weight = (double)sample->filter_weight, shown = (double)paths[i].shown;
        light->found += weight * ((double)ca_luminance(sample->radiance) - shown);
        light->shown += weight * shown;
    }
}

/* A sample of a pixel: the mean of its camera paths, and splats. What is no radiance is left out, as by the film. */
static void add_sample(ca_method_trial *trial, uint32_t cell, const cell_light *light)
{
    const ca_integrator_type *type = trial->method.type;
    double sum = light->found / trial->plan.camera_paths;
    const double shown = light->shown / trial->plan.camera_paths;
    if (type->splat) {
        uint32_t x, y;
        place(trial, cell, &x, &y);
        sum += (double)ca_luminance(type->splat(trial->integrator, x, y));
    }
    const size_t cells = ca_trial_cell_count(&trial->cells);
    trial->samples[trial->iterations * cells + cell] = isfinite(sum) ? (float)sum : 0.0f;
    if (isfinite(shown)) trial->shown[cell] += shown;
}

/* Of each of `count` cells from the first, `each` camera paths from number `begin` on; GROUP paths at most. */
static void trace_group(const ca_method_trial *trial, uint32_t first, uint32_t count, uint32_t begin, uint32_t each,
                        cell_light *light)
{
    ca_film_sample samples[GROUP] = {0};
    ca_camera_path paths[GROUP];
    for (uint32_t i = 0; i < count * each; i++) {
        const uint32_t cell = first + i / each, number = begin + i % each;
        paths[i] = (ca_camera_path){.index = pass_of(trial, cell) * trial->plan.camera_paths + number,
                                    .sample = &samples[i]};
        place(trial, cell, &paths[i].x, &paths[i].y);
    }
    trial->method.type->camera_paths(trial->integrator, paths, count * each, 0, trial->workers.list);
    for (uint32_t i = 0; i < count; i++) add_paths(&light[i], &paths[(size_t)i * each], each);
}

static void trace_cells(ca_method_trial *trial, uint32_t first, uint32_t count)
{
    const uint32_t of_pixel = trial->plan.camera_paths;
    cell_light light[GROUP] = {{0.0, 0.0}};
    for (uint32_t begin = 0; begin < of_pixel; begin += GROUP)
        trace_group(trial, first, count, begin, ca_min_u32(of_pixel - begin, GROUP), light);
    for (uint32_t i = 0; i < count; i++) add_sample(trial, first + i, &light[i]);
}

static void keep_least(double *least, double seconds, uint32_t iteration)
{
    if (iteration == 1 || (iteration > 1 && seconds < *least)) *least = seconds;
}

ca_status ca_method_trial_run(ca_method_trial *trial, ca_error *error)
{
    const ca_integrator_type *type = trial->method.type;
    const uint32_t cells = (uint32_t)ca_trial_cell_count(&trial->cells);
    const uint32_t step = GROUP / ca_min_u32(trial->plan.camera_paths, GROUP);
    float *samples =
        ca_array_grow(trial->samples, &trial->capacity, (size_t)(trial->iterations + 1) * cells, sizeof *samples);
    if (!samples) return ca_fail_memory(error, "the trials");
    trial->samples = samples;
    const double start = ca_clock_thread_seconds();
    if (type->begin_round)
        CA_TRY(type->begin_round(trial->integrator, trial->iterations, 0, &trial->workers.parallel,
                                 trial->workers.list, error));
    const double traced = ca_clock_thread_seconds();
    for (uint32_t first = 0; first < cells; first += step) {
        CA_TRY(ca_stop_check(trial->plan.input.stop, error));
        trace_cells(trial, first, ca_min_u32(step, cells - first));
    }
    keep_least(&trial->light_seconds, traced - start, trial->iterations);
    keep_least(&trial->camera_seconds, ca_clock_thread_seconds() - traced, trial->iterations);
    trial->iterations++;
    return CA_OK;
}

/* ---- What they tell -------------------------------------------------------------------------------------------- */

double ca_method_trial_seconds(const ca_method_trial *trial)
{
    const double of_crop = trial->crop_pixels / (double)ca_trial_cell_count(&trial->cells);
    return trial->light_seconds * trial->area + trial->camera_seconds * of_crop;
}

double ca_method_trial_sum(const ca_method_trial *trial, size_t cell)
{
    const size_t cells = ca_trial_cell_count(&trial->cells);
    double sum = 0.0;
    for (uint32_t i = 0; i < trial->iterations; i++) sum += (double)trial->samples[i * cells + cell];
    return sum;
}

double ca_method_trial_squares(const ca_method_trial *trial, size_t cell)
{
    const size_t cells = ca_trial_cell_count(&trial->cells);
    double sum = 0.0;
    for (uint32_t i = 0; i < trial->iterations; i++) {
        const double value = (double)trial->samples[i * cells + cell];
        sum += value * value;
    }
    return sum;
}

double ca_method_trial_shown(const ca_method_trial *trial, size_t cell) { return trial->shown[cell]; }

double ca_method_trial_variance(const ca_method_trial *trial, const double *weights, double dot_square)
{
    const size_t cells = ca_trial_cell_count(&trial->cells);
    double total = 0.0;
    const double n = trial->iterations;
    for (size_t c = 0; c < cells && n > 1.0; c++) {
        const double most = sqrt(dot_square / weights[c]);
        double sum = 0.0, squares = 0.0;
        for (uint32_t i = 0; i < trial->iterations; i++) {
            const double value = fmin((double)trial->samples[i * cells + c], most);
            sum += value, squares += value * value;
        }
        total += weights[c] * (squares - sum * sum / n) / (n - 1.0);
    }
    return total / (double)cells;
}

double ca_method_trial_dot_square(const ca_method_trial *trial, const double *weights)
{
    const size_t cells = ca_trial_cell_count(&trial->cells);
    double largest[MET] = {0.0}; /* the least of them first */
    for (size_t i = 0; i < trial->iterations * cells; i++) {
        const double value = (double)trial->samples[i];
        double square = weights[i % cells] * value * value;
        for (int k = 0; k < MET && square > largest[k]; k++) {
            if (k > 0) largest[k - 1] = largest[k];
            largest[k] = square;
        }
    }
    return largest[0];
}

static double cells_traced(const ca_method_trial *trial)
{
    return (double)ca_trial_cell_count(&trial->cells) * trial->iterations;
}

double ca_method_trial_photons(const ca_method_trial *trial)
{
    return (double)trial->workers.list[0].counters.merges / cells_traced(trial);
}

double ca_method_trial_most_photons(const ca_method_trial *trial)
{
    return ((double)trial->workers.list[0].counters.merges + 1.0) / cells_traced(trial);
}

double ca_method_trial_blur(const ca_method_trial *trial, const ca_method_radii *radii, double passes)
{
    if (!ca_method_merges(&trial->method)) return 0.0;
    const ca_merging merging = merging_of(trial->method.type);
    const double own = ca_radius_mean_blur(&radii->of[merging].blur, trial->radius, trial->alpha, passes);
    if (merging != CA_MERGING_AND_CONNECTING) return own;
    return fmin(own, ca_radius_mean_blur(&radii->of[CA_MERGING_BDPM].blur, trial->radius, trial->alpha, passes));
}
