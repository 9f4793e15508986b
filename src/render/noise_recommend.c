/* Which numbers of paths to render with (ca_noise_recommend): times are measured, then noise/ray_numbers.h
 * chooses. */
#include "base/clock.h"
#include "base/memory.h"
#include "noise/ray_map.h"
#include "render/noise.h"
#include "render/noise_plan.h"
#include "render/pass.h"
#include "render/public_structs.h"

#include <math.h>

/* No more than so many times the measured light paths are recommended: further away the smallest terms decide, which
 * are the least certain ones. */
enum { MOST_TIMES_MEASURED = 128 };
/* Passes of N_F / LIGHT_STEP and of N_F LIGHT_STEP are timed, with at most so many camera paths. */
enum { TIMED_PASSES = 3, LIGHT_STEP = 2, TIMED_CAMERA_PATHS = 4, TIMED_AGAIN_CAMERA_PATHS = 2, LEVELS = 3 };
/* Costs are measured again for numbers further away than this factor. */
static const double near_numbers = 2.0;
/* Timing may take this part of the time that measuring took, and two seconds in any case. */
static const double timing_share = 0.25, timing_seconds = 2.0;
/* The least time of a path: what is too short to be measured still takes some time. */
static const double shortest = CA_NOISE_SHORTEST_SECONDS;
/* How often the caller is asked while paths are timed. */
static const double asking_seconds = 0.03;
/* The most light paths that fit the memory are found to this factor. */
static const double fitting_step = 1.02;

/* Where memory is not limited. */
static uint32_t most_light_paths(const ca_pair_film *film)
{
    return film->light_paths < CA_RAY_MOST_LIGHT_PATHS_HELD / MOST_TIMES_MEASURED
               ? film->light_paths * MOST_TIMES_MEASURED
               : CA_RAY_MOST_LIGHT_PATHS_HELD;
}

/* F cannot be estimated from a single camera path; numbers with one do not need it. */
static void set_components(const ca_pair_film *film, size_t pixel, ca_ray_pixel *to)
{
    const ca_noise_components c = ca_noise_components_of(&film->pixels[pixel]);
    to->pair = c.pair.value;
    to->camera = c.camera.value;
    to->luminance2 = c.luminance2.value;
    to->light = film->camera_paths > 1 ? c.light.value : c.luminance2.value;
}

/* ---- Choosing -------------------------------------------------------------------------------------------------- */

static ca_status choose(const ca_noise *noise, const ca_ray_times *times, const ca_ray_costs *costs,
                        ca_ray_objective objective, uint32_t most, ca_ray_numbers *numbers, ca_error *error)
{
    const ca_pair_film *film = &noise->film;
    *numbers = (ca_ray_numbers){0};
    if (film->connections) return ca_noise_choose_connected(film, times, costs, objective, most, numbers, error);
    ca_ray_pixel *pixels = ca_alloc((size_t)film->width * film->height, sizeof *pixels);
    if (!pixels) return ca_fail_memory(error, "the numbers of paths");
    for (uint32_t y = 0; y < film->height; y++)
        for (uint32_t x = 0; x < film->width; x++) {
            const size_t p = (size_t)y * film->width + x;
            set_components(film, p, &pixels[p]);
            ca_ray_times_of_pixel(times, costs, x, y, &pixels[p].camera_time, &pixels[p].merge_time);
            pixels[p].camera_time = fmax(pixels[p].camera_time, shortest);
        }
    const ca_ray_image image = {.width = film->width,
                                .height = film->height,
                                .pixels = pixels,
                                .fixed_time = costs->iteration,
                                .light_time = fmax(costs->light_path, shortest)};
    const ca_ray_settings settings = {.objective = objective,
                                      .smoothing = CA_NOISE_SMOOTHING,
                                      .min_light_paths = 1,
                                      .max_light_paths = most,
                                      .max_camera_paths = noise->light_paths_only ? 1 : 0,
                                      .given_light_paths = film->light_paths,
                                      .given_camera_paths = film->camera_paths};
    const ca_status status = ca_ray_numbers_choose(numbers, &image, &settings, error);
    ca_free(pixels);
    return status;
}

ca_status ca_noise_choose(const ca_noise *noise, const ca_ray_times *times, const ca_ray_costs *costs,
                          ca_ray_objective objective, ca_ray_numbers *numbers, ca_error *error)
{
    return choose(noise, times, costs, objective, most_light_paths(&noise->film), numbers, error);
}

/* ---- Times ----------------------------------------------------------------------------------------------------- */

typedef struct timing {
    const ca_noise *noise;
    ca_noise_plan p;
    ca_ray_times *times; /* owned */
    ca_film film;        /* owned; its samples are thrown away */
    ca_ray_costs costs;  /* measured last ... */
    uint32_t light_paths; /* ... with about so many light paths */
    uint32_t most_light_paths; /* that may be timed and recommended */
    ca_ray_numbers numbers;    /* owned; chosen with these costs */
    double start, asked;       /* by the clock: of the timing; of the caller's last callback */
    uint32_t passes;           /* timed so far */
    bool interrupted;          /* by the caller */
} timing;

static bool goes_on(void *user)
{
    timing *t = user;
    const ca_render_settings *given = t->p.given;
    const double now = ca_clock_seconds();
    if (!given->progress || t->interrupted || now - t->asked < asking_seconds) return !t->interrupted;
    const ca_render_progress progress = {.passes_done = t->passes, .seconds = now - t->start, .noise_percent = -1.0};
    t->interrupted = !given->progress(&progress, given->progress_user);
    t->asked = now;
    return !t->interrupted;
}

/* Warm-up of memory and of a new integrator, not timed: all light paths, and one camera path of every pixel (all of
 * them where they are kept from round to round). */
static ca_status warm_up(timing *t, ca_pass_runner *runner, ca_error *error)
{
    const uint32_t camera_paths = t->p.plan.camera_paths;
    if (runner->rounds == 1) t->p.plan.camera_paths = 1;
    const ca_status status = ca_pass_run(runner, 0, error);
    t->p.plan.camera_paths = camera_paths;
    return status;
}

static ca_status run_passes(timing *t, void *integrator, ca_error *error)
{
    ca_pass_runner runner;
    CA_TRY(ca_pass_runner_create(&runner, &t->p.plan, integrator, &t->film, NULL, error));
    runner.goes_on = goes_on;
    runner.goes_on_user = t;
    ca_status status = warm_up(t, &runner, error);
    runner.times = t->times;
    for (uint32_t pass = 0; pass < TIMED_PASSES && status == CA_OK && goes_on(t); pass++, t->passes++)
        status = ca_pass_run(&runner, pass, error);
    ca_pass_runner_destroy(&runner);
    return status;
}

/* Where light paths come in several rounds, the samples between them are a part of the memory, as in a render. */
static ca_status create_integrator(const ca_render_plan *plan, void **integrator, ca_error *error)
{
    ca_integrator_input input = plan->input;
    CA_TRY(plan->type->create(&input, integrator, error));
    if (input.memory_bytes <= 0.0 || plan->type->rounds(*integrator) == 1) return CA_OK;
    plan->type->destroy(*integrator);
    input.memory_bytes = fmax(1.0, input.memory_bytes - ca_pass_buffer_bytes(plan));
    return plan->type->create(&input, integrator, error);
}

/* Passes without pairs. */
static ca_status time_passes(timing *t, uint32_t light_paths, uint32_t camera_paths, ca_error *error)
{
    ca_render_plan *plan = &t->p.plan;
    void *integrator = NULL;
    CA_TRY(ca_render_plan_set_light_paths(plan, light_paths, error));
    CA_TRY(ca_render_plan_set_camera_paths(plan, camera_paths, error));
    CA_TRY(create_integrator(plan, &integrator, error));
    const ca_status status = run_passes(t, integrator, error);
    plan->type->destroy(integrator);
    return status;
}

/* The most light paths that may be timed and recommended: at least as many as were measured, and more if they fit
 * the memory at once. */
static ca_status limit_light_paths(timing *t, ca_error *error)
{
    double low = t->noise->film.light_paths, high = fmax(low, most_light_paths(&t->noise->film));
    ca_render_plan *plan = &t->p.plan;
    bool yes;
    CA_TRY(ca_render_plan_fits(plan, (uint32_t)high, &yes, error));
    while (!yes && high > low * fitting_step && high > low + 1.0) {
        const double middle = floor(sqrt(low * high));
        bool middle_fits;
        CA_TRY(ca_render_plan_fits(plan, (uint32_t)middle, &middle_fits, error));
        *(middle_fits ? &low : &high) = middle;
    }
    t->most_light_paths = (uint32_t)(yes ? high : low);
    return CA_OK;
}

/* Measures costs with fewer and with more light paths than this number. The two tell a segment's cost from a
 * candidate's and an iteration's from a light path's. Costs that are not linear in N_F are taken along the secant. */
static ca_status time_level(timing *t, uint32_t light_paths, uint32_t camera_paths, ca_error *error)
{
    if (camera_paths > t->noise->film.camera_paths) camera_paths = t->noise->film.camera_paths;
    const uint32_t more =
        light_paths < t->most_light_paths / LIGHT_STEP ? light_paths * LIGHT_STEP : t->most_light_paths;
    ca_ray_times_thin(t->times, 0);
    CA_TRY(time_passes(t, light_paths > LIGHT_STEP ? light_paths / LIGHT_STEP : 1, camera_paths, error));
    if (goes_on(t)) CA_TRY(time_passes(t, more, camera_paths, error));
    t->costs = ca_ray_times_costs(t->times);
    t->light_paths = light_paths;
    return CA_OK;
}

static double iteration_seconds(const timing *t, double light_paths, double camera_paths)
{
    const ca_ray_costs *c = &t->costs;
    const double pixels = (double)t->film.width * t->film.height;
    return c->iteration + light_paths * c->light_path +
           pixels * camera_paths * (c->camera_path + light_paths * c->merge);
}

/* The largest number of light paths whose costs can be measured in the time that is left. */
static uint32_t affordable(const timing *t)
{
    const ca_pair_film *film = &t->noise->film;
    const double measured =
        iteration_seconds(t, film->light_paths, film->camera_paths) * (double)film->pixels[0].iterations;
    const double seconds = fmax(timing_share * measured, timing_seconds) / (TIMED_PASSES + 1);
    const double fixed = iteration_seconds(t, 0.0, 2.0 * TIMED_AGAIN_CAMERA_PATHS);
    const double each =
        (iteration_seconds(t, 1.0, TIMED_AGAIN_CAMERA_PATHS) - iteration_seconds(t, 0.0, TIMED_AGAIN_CAMERA_PATHS)) *
        (LIGHT_STEP + 1.0 / LIGHT_STEP);
    const double most = CA_RAY_MOST_LIGHT_PATHS_HELD / LIGHT_STEP;
    return (uint32_t)fmin(fmax((seconds - fixed) / each, film->light_paths), most);
}

/* Costs depend on the numbers and the numbers on the costs: both are improved in turns. There are no numbers if the
 * caller has interrupted. */
static ca_status time_and_choose(timing *t, ca_ray_objective objective, ca_error *error)
{
    if (!goes_on(t)) return CA_OK;
    CA_TRY(limit_light_paths(t, error));
    CA_TRY(time_level(t, t->noise->film.light_paths, TIMED_CAMERA_PATHS, error));
    for (int level = 1;; level++) {
        ca_ray_numbers_destroy(&t->numbers);
        if (!goes_on(t)) return CA_OK;
        CA_TRY(choose(t->noise, t->times, &t->costs, objective, t->most_light_paths, &t->numbers, error));
        if (t->numbers.best.light_paths == 0.0) return CA_OK; /* no noise was found */
        const double chosen = fmin(t->numbers.best.light_paths, affordable(t));
        const double factor = chosen / t->light_paths;
        if (level == LEVELS || (factor <= near_numbers && factor >= 1.0 / near_numbers)) return CA_OK;
        CA_TRY(time_level(t, (uint32_t)chosen, TIMED_AGAIN_CAMERA_PATHS, error));
    }
}

/* ---- The recommendation ---------------------------------------------------------------------------------------- */

static ca_noise_numbers numbers_of(const ca_ray_choice *choice)
{
    return (ca_noise_numbers){.light_paths = (uint32_t)choice->light_paths,
                              .camera_paths = choice->camera_paths,
                              .variance = choice->variance,
                              .seconds = choice->time};
}

/* All pixels have the same whole number: rounding removes the error of their mean. */
static ca_noise_numbers uniform_numbers_of(const ca_ray_choice *choice)
{
    ca_noise_numbers numbers = numbers_of(choice);
    numbers.camera_paths = round(numbers.camera_paths);
    return numbers;
}

static ca_noise_times times_of(const timing *t)
{
    const ca_ray_costs *c = &t->costs;
    return (ca_noise_times){.light_paths = t->light_paths,
                            .iteration = c->iteration,
                            .light_path = c->light_path,
                            .camera_path = c->camera_path,
                            .candidate = c->candidate,
                            .iteration_error = c->iteration_error,
                            .light_path_error = c->light_path_error,
                            .camera_path_error = c->camera_path_error,
                            .candidate_error = c->candidate_error,
                            .segments_per_camera_path = c->segments_per_camera_path,
                            .candidates_per_pair = c->candidates_per_pair};
}

/* Without any noise all numbers are equally good and none is recommended. */
static bool has_numbers(const timing *t)
{
    return !t->interrupted && t->numbers.camera_paths && t->numbers.given.variance > 0.0;
}

static void describe(const timing *t, ca_noise_recommendation *r)
{
    *r = (ca_noise_recommendation){.interrupted = t->interrupted};
    if (!has_numbers(t)) return;
    const ca_ray_numbers *n = &t->numbers;
    *r = (ca_noise_recommendation){.best = numbers_of(&n->best),
                                   .uniform = uniform_numbers_of(&n->uniform),
                                   .given = uniform_numbers_of(&n->given),
                                   .gain_over_given = n->gain_over_given,
                                   .gain_over_uniform = n->gain_over_uniform,
                                   .fewest_camera_paths = n->camera_paths[0],
                                   .most_camera_paths = n->camera_paths[0],
                                   .light_paths_only = t->noise->light_paths_only,
                                   .most_light_paths = t->most_light_paths,
                                   .times = times_of(t)};
    for (size_t p = 0; p < (size_t)t->film.width * t->film.height; p++) {
        if (n->camera_paths[p] < r->fewest_camera_paths) r->fewest_camera_paths = n->camera_paths[p];
        if (n->camera_paths[p] > r->most_camera_paths) r->most_camera_paths = n->camera_paths[p];
    }
}

static ca_status plan_timing(timing *t, const ca_scene *scene, const ca_render_settings *settings, ca_error *error)
{
    const ca_pair_film *film = &t->noise->film;
    CA_TRY(ca_noise_plan_make(&t->p, scene, settings, 2, error));
    const uint32_t *crop = t->p.plan.crop;
    if (crop[0] == film->x0 && crop[1] == film->y0 && crop[2] - crop[0] == film->width &&
        crop[3] - crop[1] == film->height && t->p.light_paths == film->light_paths &&
        t->p.plan.camera_paths == film->camera_paths)
        return CA_OK;
    return ca_fail(
        error, CA_ERROR_ARGUMENT, NULL,
        "paths are timed with the scene and the settings that the noise was measured with, not with others");
}

static ca_status prepare(timing *t, ca_error *error)
{
    const ca_render_plan *plan = &t->p.plan;
    CA_TRY(ca_film_create(&t->film, plan->camera.width, plan->camera.height, plan->crop, error));
    return ca_ray_times_create(&t->times, t->film.width, t->film.height, plan->threads, error);
}

ca_status ca_noise_recommend(const ca_noise *noise, const ca_scene *scene, const ca_render_settings *settings,
                             const char *objective, ca_image_layers *image, ca_noise_recommendation *recommendation,
                             ca_error *error)
{
    ca_render_settings taken;
    ca_ray_objective wanted;
    timing t = {.noise = noise, .start = ca_clock_seconds(), .asked = -(double)INFINITY};
    CA_TRY(ca_settings_take(settings, &taken, error));
    CA_TRY(ca_ray_objective_find(objective, &wanted, error));
    CA_TRY(ca_noise_check_connected(&noise->film, wanted, error));
    ca_status status = plan_timing(&t, scene, &taken, error);
    if (status == CA_OK) status = prepare(&t, error);
    if (status == CA_OK) status = time_and_choose(&t, wanted, error);
    if (status == CA_ERROR_INTERRUPTED) {
        t.interrupted = true;
        status = CA_OK;
    }
    if (status == CA_OK && image && has_numbers(&t))
        status = ca_ray_map_add(image, (uint32_t)t.numbers.best.light_paths, t.numbers.camera_paths, error);
    if (status == CA_OK) describe(&t, recommendation);
    ca_ray_numbers_destroy(&t.numbers);
    ca_ray_times_destroy(t.times);
    ca_film_destroy(&t.film);
    return status;
}
