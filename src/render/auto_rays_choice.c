/* From estimates and times to numbers of rays. */
#include "base/memory.h"
#include "render/auto_rays_state.h"

#include <string.h>

enum { LEAST_LIGHT_PATHS = 2, LIMIT_STEPS = 40 };
static const double as_good = 1.03;           /* variance x time over the best */
static const double shortest_seconds = 1e-10; /* what takes no measurable time still needs a time above 0 */

/* ---- The image of estimates ------------------------------------------------------------------------------------ */

static void fill_pixels(const ca_auto_rays *a, const ca_ray_times *times, const ca_ray_costs *costs,
                        ca_ray_pixel *pixels)
{
    for (uint32_t y = 0; y < a->frame.height; y++)
        for (uint32_t x = 0; x < a->frame.width; x++) {
            const size_t p = (size_t)y * a->frame.width + x;
            double camera_time, merge_time;
            ca_ray_times_of_pixel(times, costs, x, y, &camera_time, &merge_time);
            pixels[p] = a->known ? ca_auto_known_estimates(&a->known[p]) : (ca_ray_pixel){0};
            pixels[p].camera_time = fmax(camera_time, shortest_seconds);
            pixels[p].merge_time = fmax(merge_time, 0.0);
        }
}

static ca_ray_image image_of(const ca_auto_rays *a, const ca_ray_costs *costs, const ca_ray_pixel *pixels)
{
    return (ca_ray_image){.width = a->frame.width,
                          .height = a->frame.height,
                          .pixels = pixels,
                          .fixed_time = fmax(costs->iteration, 0.0),
                          .light_time = fmax(costs->light_path, shortest_seconds)};
}

/* An iteration with these numbers by the costs: seconds of one processor. */
static double iteration_time(const ca_ray_image *image, const ca_auto_numbers *numbers)
{
    double time = image->fixed_time + numbers->light_paths * image->light_time;
    for (size_t p = 0; p < (size_t)image->width * image->height; p++)
        time += numbers->camera_paths[p] *
                (image->pixels[p].camera_time + numbers->light_paths * image->pixels[p].merge_time);
    return time;
}

/* ---- Choosing -------------------------------------------------------------------------------------------------- */

/* What all steps of a choice share. */
typedef struct chooser {
    ca_auto_rays *a;
    const ca_auto_basis *basis;
    ca_ray_image image;
    ca_connected_node nodes[CA_AUTO_MOST_NODES]; /* where paths connect ... */
    ca_connected_image connected;                /* ... instead of the pixels' estimates */
    ca_ray_settings settings; /* their limits are lowered from step to step */
    double speed; /* seconds of the clock for one of the processors' by the costs: threads, and what else it did */
} chooser;

/* Points into the chooser, which is not copied from here on. */
static void sum_pixels(chooser *c)
{
    const ca_ray_image *image = &c->image;
    c->connected = (ca_connected_image){.nodes = c->nodes,
                                        .node_count = ca_auto_nodes_list(&c->a->nodes, true, c->nodes),
                                        .fixed_time = image->fixed_time,
                                        .light_time = image->light_time};
    for (size_t p = 0; p < (size_t)image->width * image->height; p++) {
        c->connected.camera_time += image->pixels[p].camera_time;
        c->connected.merge_time += image->pixels[p].merge_time;
    }
}

/* Without noise that is known, the given numbers as far as the limits allow. */
static ca_status choose_given(const chooser *c, ca_ray_numbers *numbers, ca_error *error)
{
    const ca_ray_settings *s = &c->settings;
    const double light_paths = fmin(s->given_light_paths, s->max_light_paths);
    const double camera_paths = fmin(fmin(s->given_camera_paths, s->max_camera_paths), light_paths);
    numbers->given = ca_connected_expect(&c->connected, s->given_light_paths, s->given_camera_paths);
    numbers->gain_over_given = numbers->gain_over_uniform = 1.0;
    const ca_ray_choice choice = ca_connected_expect(&c->connected, light_paths, camera_paths);
    return ca_ray_numbers_use_uniform(numbers, &choice, ca_auto_pixels(c->a), error);
}

static ca_status choose_numbers(const chooser *c, ca_ray_numbers *numbers, ca_error *error)
{
    if (!ca_auto_connects(c->a)) {
        CA_TRY(ca_ray_numbers_choose(numbers, &c->image, &c->settings, error));
        if (numbers->given.variance > 0.0) return CA_OK;
        ca_ray_numbers_destroy(numbers);
        return choose_given(c, numbers, error);
    }
    *numbers = (ca_ray_numbers){0};
    if (c->connected.node_count > 0)
        CA_TRY(ca_connected_numbers(&c->connected, &c->settings, ca_auto_pixels(c->a), numbers, error));
    return numbers->camera_paths ? CA_OK : choose_given(c, numbers, error);
}

static double relative_variance(const ca_auto_rays *a, const ca_ray_numbers *numbers)
{
    const ca_ray_choice *best = &numbers->best;
    if (ca_auto_connects(a)) return ca_auto_nodes_relative_variance(&a->nodes, best->light_paths, best->camera_paths);
    return ca_auto_known_relative_variance(a->known, ca_auto_pixels(a), best->light_paths, numbers->camera_paths);
}

static ca_auto_candidate candidate_of(const chooser *c, const ca_ray_numbers *numbers)
{
    const ca_ray_choice *best = &numbers->best;
    return (ca_auto_candidate){
        .light_paths = best->light_paths,
        .camera_paths = best->camera_paths,
        .cost = best->variance * best->time,
        .relative_variance = relative_variance(c->a, numbers),
        .seconds = best->time * c->speed,
    };
}

static uint32_t largest(const uint32_t *numbers, size_t count)
{
    uint32_t most = 1;
    for (size_t p = 0; p < count; p++)
        if (numbers[p] > most) most = numbers[p];
    return most;
}

/* Halves the limits that the numbers have reached; false where they are as small as can be. */
static bool lower_limits(chooser *c, const ca_ray_numbers *numbers, bool light_paths_only)
{
    ca_ray_settings *s = &c->settings;
    const uint32_t light_paths = (uint32_t)numbers->best.light_paths;
    const uint32_t most = largest(numbers->camera_paths, ca_auto_pixels(c->a));
    const bool more_light = light_paths > s->min_light_paths, more_camera = !light_paths_only && most > 1;
    if (more_light) s->max_light_paths = light_paths / 2 > s->min_light_paths ? light_paths / 2 : s->min_light_paths;
    if (more_camera) s->max_camera_paths = most / 2;
    return more_light || more_camera;
}

/* The best numbers whose iterations are short enough and whose light paths fit the memory. */
static ca_status choose_within_limits(chooser *c, uint32_t iterations, ca_ray_numbers *numbers, ca_error *error)
{
    for (int step = 0; step < LIMIT_STEPS; step++) {
        bool fits = true;
        ca_ray_numbers_destroy(numbers);
        CA_TRY(choose_numbers(c, numbers, error));
        const ca_auto_candidate candidate = candidate_of(c, numbers);
        const bool too_long =
            ca_auto_iterations_left(&c->a->goal, &c->basis->progress, &candidate) < (double)iterations;
        if (!too_long) CA_TRY(ca_render_plan_fits(c->a->plan, (uint32_t)candidate.light_paths, &fits, error));
        if ((!too_long && fits) || !lower_limits(c, numbers, !too_long)) break;
    }
    return CA_OK;
}

/* Of numbers that are nearly as good by all estimates, those with the fewest light paths: costs are a secant's, while
 * photons in ever slower memory cost ever more; and the image comes in more iterations. */
static ca_status prefer_fewer_light_paths(chooser *c, ca_ray_numbers *numbers, ca_error *error)
{
    const double limit = as_good * numbers->best.variance * numbers->best.time;
    for (;;) {
        ca_ray_numbers fewer;
        c->settings.max_light_paths = (uint32_t)(numbers->best.light_paths / 2.0);
        if (c->settings.max_light_paths < c->settings.min_light_paths) return CA_OK;
        CA_TRY(choose_numbers(c, &fewer, error));
        if (!(fewer.best.variance * fewer.best.time <= limit && limit > 0.0)) {
            ca_ray_numbers_destroy(&fewer);
            return CA_OK;
        }
        ca_ray_numbers_destroy(numbers);
        *numbers = fewer;
    }
}

/* Numbers that are predicted to be worse than the pilot's are not kept. */
static ca_status keep_given(const chooser *c, const ca_auto_limits *limits, ca_ray_numbers *numbers, ca_error *error)
{
    const ca_auto_candidate given = {.relative_variance = (double)NAN,
                                     .camera_paths = numbers->given.camera_paths,
                                     .seconds = numbers->given.time * c->speed};
    const double left = ca_auto_iterations_left(&c->a->goal, &c->basis->progress, &given);
    if (!ca_auto_keeps_pilots_numbers(limits, numbers->gain_over_given, left)) return CA_OK;
    numbers->gain_over_given = 1.0;
    return ca_ray_numbers_use_uniform(numbers, &numbers->given, ca_auto_pixels(c->a), error);
}

/* Weights with other numbers of camera paths than were measured with are not known: no more than so many times as
 * many. */
static uint32_t most_camera_paths(const ca_auto_rays *a, uint32_t reach)
{
    if (ca_auto_one_camera_path(a)) return 1;
    if (!ca_auto_connects(a)) return CA_RAY_MOST_CAMERA_PATHS;
    return (uint32_t)fmin((double)reach * a->numbers.most, CA_CONNECTED_MOST_CAMERA_PATHS);
}

static ca_ray_settings settings_of(const ca_auto_rays *a, const ca_auto_limits *limits)
{
    const ca_pilot_numbers pilot = a->ordinary.numbers;
    return (ca_ray_settings){.objective = a->plan->objective,
                             .smoothing = CA_AUTO_SMOOTHING,
                             .min_light_paths = LEAST_LIGHT_PATHS,
                             .max_light_paths = ca_auto_most_light_paths(limits, a->plan->input.memory_bytes > 0.0),
                             .max_camera_paths = most_camera_paths(a, limits->reach),
                             .given_light_paths = pilot.light_paths,
                             .given_camera_paths = pilot.camera_paths};
}

ca_status ca_auto_choose(ca_auto_rays *a, const ca_auto_basis *basis, const ca_auto_limits *limits,
                         ca_auto_choice *choice, ca_error *error)
{
    ca_ray_pixel *pixels = ca_alloc(ca_auto_pixels(a), sizeof *pixels);
    *choice = (ca_auto_choice){.costs = ca_ray_times_costs(basis->times)};
    if (!pixels) return ca_fail_memory(error, "the numbers of rays");
    fill_pixels(a, basis->times, &choice->costs, pixels);
    chooser c = {
        .a = a, .basis = basis, .image = image_of(a, &choice->costs, pixels), .settings = settings_of(a, limits)};
    c.speed = basis->plain_seconds / iteration_time(&c.image, &a->numbers);
    sum_pixels(&c);
    ca_status status = choose_within_limits(&c, limits->iterations, &choice->numbers, error);
    if (status == CA_OK) status = prefer_fewer_light_paths(&c, &choice->numbers, error);
    if (status == CA_OK) status = keep_given(&c, limits, &choice->numbers, error);
    if (status == CA_OK) choice->candidate = candidate_of(&c, &choice->numbers);
    ca_free(pixels);
    if (status != CA_OK) ca_auto_choice_destroy(choice);
    return status;
}

void ca_auto_choice_destroy(ca_auto_choice *choice) { ca_ray_numbers_destroy(&choice->numbers); }

/* ---- Numbers in use -------------------------------------------------------------------------------------------- */

void ca_auto_use_uniform(ca_auto_rays *a, ca_pilot_numbers numbers)
{
    for (size_t p = 0; p < ca_auto_pixels(a); p++) a->numbers.camera_paths[p] = numbers.camera_paths;
    a->numbers.light_paths = numbers.light_paths;
    a->numbers.most = numbers.camera_paths;
    a->numbers.mean = numbers.camera_paths;
}

void ca_auto_use_map(ca_auto_rays *a, uint32_t light_paths, const uint32_t *camera_paths)
{
    const size_t count = ca_auto_pixels(a);
    double sum = 0.0;
    memcpy(a->numbers.camera_paths, camera_paths, count * sizeof *camera_paths);
    for (size_t p = 0; p < count; p++) sum += camera_paths[p];
    a->numbers.light_paths = light_paths;
    a->numbers.most = largest(camera_paths, count);
    a->numbers.mean = sum / (double)count;
}

void ca_auto_use_group(ca_auto_rays *a, const ca_auto_group *group)
{
    if (group->map)
        ca_auto_use_map(a, group->light_paths, group->map);
    else
        ca_auto_use_uniform(a, (ca_pilot_numbers){group->light_paths, group->camera_paths});
}

void ca_auto_use(ca_auto_rays *a, const ca_auto_choice *choice)
{
    ca_auto_use_map(a, (uint32_t)choice->numbers.best.light_paths, choice->numbers.camera_paths);
    a->predicted_gain = choice->numbers.gain_over_given;
}
