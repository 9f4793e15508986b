/* From estimates and times to numbers of rays. */
#include "base/memory.h"
#include "noise/components.h"
#include "render/auto_rays_state.h"

#include <math.h>
#include <string.h>

/* An iteration may take an eighth of what is left of the render: shorter ones are little worse, and a few long ones would neither
 * tell their noise nor end when they should. */
enum { LEAST_ITERATIONS = 8, LIMIT_STEPS = 40 };
enum { MOST_LIGHT_PATHS = 1 << 22, MOST_LIGHT_PATHS_EVER = 1 << 30, MOST_CAMERA_PATHS = 4096 };

static bool one_camera_path(const ca_auto_rays *a) { return strcmp(a->plan->type->name, "ppm") == 0; }

/* ---- The image of estimates ------------------------------------------------------------------------------------------ */

/* With one camera path F is not known, nor needed: its factor is 0. */
static void set_components(const ca_auto_rays *a, const ca_pair_pixel *pixel, ca_ray_pixel *to)
{
    const ca_noise_components c = ca_noise_components_of(pixel);
    to->pair = c.pair.value;
    to->camera = c.camera.value;
    to->luminance2 = c.luminance2.value;
    to->light = one_camera_path(a) ? to->luminance2 : c.light.value;
}

/* Means over the halves that may be used. */
static void set_times(const ca_auto_rays *a, unsigned halves, const ca_ray_costs *costs, uint32_t x, uint32_t y, ca_ray_pixel *to)
{
    double camera_time, merge_time;
    to->camera_time = to->merge_time = 0.0;
    const double share = halves == 3u ? 0.5 : 1.0;
    for (unsigned h = 0; h < CA_AUTO_HALVES; h++) {
        if (!(halves >> h & 1u)) continue;
        ca_ray_times_of_pixel(a->halves[h].times, &costs[h], x, y, &camera_time, &merge_time);
        to->camera_time += share * camera_time;
        to->merge_time += share * merge_time;
    }
}

/* What cannot be measured because it takes no time to speak of still needs a time above 0. */
static double at_least(double seconds, double least) { return seconds > least ? seconds : least; }

static ca_ray_costs mean_costs(const ca_ray_costs *costs, unsigned halves)
{
    if (halves != 3u) return costs[halves - 1];
    ca_ray_costs mean = costs[0];
    mean.iteration = 0.5 * (costs[0].iteration + costs[1].iteration);
    mean.light_path = 0.5 * (costs[0].light_path + costs[1].light_path);
    mean.camera_path = 0.5 * (costs[0].camera_path + costs[1].camera_path);
    mean.candidate = 0.5 * (costs[0].candidate + costs[1].candidate);
    return mean;
}

static ca_ray_costs fill_image(const ca_auto_rays *a, const ca_pair_film *pairs, unsigned halves, ca_ray_pixel *pixels,
                               ca_ray_image *image)
{
    static const double shortest = 1e-10;
    ca_ray_costs costs[CA_AUTO_HALVES];
    for (unsigned h = 0; h < CA_AUTO_HALVES; h++)
        if (halves >> h & 1u) costs[h] = ca_ray_times_costs(a->halves[h].times);
    for (uint32_t y = 0; y < pairs->height; y++)
        for (uint32_t x = 0; x < pairs->width; x++) {
            ca_ray_pixel *pixel = &pixels[(size_t)y * pairs->width + x];
            set_components(a, &pairs->pixels[(size_t)y * pairs->width + x], pixel);
            set_times(a, halves, costs, x, y, pixel);
            pixel->camera_time = at_least(pixel->camera_time, shortest);
            pixel->merge_time = at_least(pixel->merge_time, 0.0);
        }
    const ca_ray_costs mean = mean_costs(costs, halves);
    *image = (ca_ray_image){.width = pairs->width,
                            .height = pairs->height,
                            .pixels = pixels,
                            .fixed_time = at_least(mean.iteration, 0.0),
                            .light_time = at_least(mean.light_path, shortest)};
    return mean;
}

/* Without smoothing and without regard to signs: the sum over pixels has no bias. */
static double relative_variance(const ca_ray_image *image, const ca_pair_film *pairs, const ca_ray_numbers *numbers)
{
    const size_t count = (size_t)image->width * image->height;
    const double light_paths = numbers->best.light_paths;
    double variance = 0.0, luminance = 0.0;
    for (size_t p = 0; p < count; p++) {
        const ca_ray_pixel *q = &image->pixels[p];
        const double camera_paths = numbers->camera_paths[p], mean2 = q->luminance2;
        variance += (q->pair - mean2) / (light_paths * camera_paths) +
                    (1.0 - 1.0 / light_paths) * (q->camera - mean2) / camera_paths +
                    (1.0 - 1.0 / camera_paths) * (q->light - mean2) / light_paths;
        luminance += pairs->pixels[p].sums[CA_PAIR_VALUE] / (double)pairs->pixels[p].iterations;
    }
    return luminance > 0.0 ? variance * (double)count / (luminance * luminance) : (double)NAN;
}

/* ---- Choosing -------------------------------------------------------------------------------------------------------- */

/* How many iterations with these numbers there would be until the end. A half's choice must not look at the noise of both. */
static double iterations_left(const ca_auto_rays *a, const ca_auto_choice *choice, unsigned halves)
{
    const ca_ray_choice *best = &choice->numbers.best;
    const double one = best->time * a->speed, work_left = ca_auto_work_end(a) - ca_auto_work(a);
    if (!ca_auto_by_samples(a) && isfinite(work_left)) return work_left / one;
    /* Where nobody said how long it may take, an iteration is to be no longer than all before it: estimates that see no noise of
     * camera paths, right or wrong, would ask for light paths without end. */
    double left = one > a->seconds ? 0.0 : (double)INFINITY;
    if (ca_auto_by_samples(a)) return fmin(left, work_left / best->camera_paths);
    const double target = 0.01 * a->looks.target, noise = 0.01 * a->looks.noise;
    if (halves == 3u && target > 0.0 && noise > target && choice->relative_variance > 0.0)
        left = fmin(left, (1.0 / (target * target) - 1.0 / (noise * noise)) * choice->relative_variance);
    return left;
}

static uint32_t largest(const uint32_t *numbers, size_t count)
{
    uint32_t most = 1;
    for (size_t p = 0; p < count; p++)
        if (numbers[p] > most) most = numbers[p];
    return most;
}

/* Halves the limits that the numbers have reached; false where they are as small as can be. */
static bool lower_limits(ca_ray_settings *settings, const ca_ray_numbers *numbers, size_t count, bool memory)
{
    const uint32_t light_paths = (uint32_t)numbers->best.light_paths, most = largest(numbers->camera_paths, count);
    if (light_paths <= settings->min_light_paths && (memory || most == 1)) return false;
    if (light_paths > settings->min_light_paths)
        settings->max_light_paths = light_paths / 2 > settings->min_light_paths ? light_paths / 2 : settings->min_light_paths;
    if (!memory && most > 1) settings->max_camera_paths = most / 2;
    return true;
}

static ca_status choose_within_limits(ca_auto_rays *a, const ca_ray_image *image, const ca_pair_film *pairs, unsigned halves,
                                      ca_ray_settings *settings, ca_auto_choice *choice, ca_error *error)
{
    const size_t count = (size_t)image->width * image->height;
    for (int step = 0; step < LIMIT_STEPS; step++) {
        bool fits = true;
        ca_ray_numbers_destroy(&choice->numbers);
        CA_TRY(ca_ray_numbers_choose(&choice->numbers, image, settings, error));
        choice->relative_variance = relative_variance(image, pairs, &choice->numbers);
        const bool too_long = iterations_left(a, choice, halves) < LEAST_ITERATIONS;
        if (!too_long) CA_TRY(ca_auto_fits(a, (uint32_t)choice->numbers.best.light_paths, &fits, error));
        if (!too_long && fits) break;
        if (!lower_limits(settings, &choice->numbers, count, !too_long)) break;
    }
    return CA_OK;
}

/* What an ordinary iteration of the pilot took by the clock, over what its paths cost: how parallel it ran, and what else it did. */
static double speed_of_pilot(const ca_auto_rays *a, const ca_ray_image *image, unsigned halves)
{
    const ca_auto_group *pilot = &a->groups[CA_AUTO_ORDINARY];
    double seconds = 0.0, count = 0.0, costs = image->fixed_time + pilot->light_paths * image->light_time;
    for (unsigned h = 0; h < CA_AUTO_HALVES; h++) {
        if (!(halves >> h & 1u)) continue;
        seconds += a->halves[h].plain_seconds;
        count += a->halves[h].plain_count;
    }
    for (size_t p = 0; p < (size_t)image->width * image->height; p++)
        costs += pilot->camera_paths * (image->pixels[p].camera_time + pilot->light_paths * image->pixels[p].merge_time);
    return seconds / (count * costs);
}

ca_status ca_auto_choose(ca_auto_rays *a, const ca_pair_film *pairs, unsigned halves, uint32_t smoothing, ca_auto_choice *choice,
                         ca_error *error)
{
    const ca_auto_group *pilot = &a->groups[CA_AUTO_ORDINARY];
    const bool limited = a->plan->input.memory_bytes > 0.0;
    ca_ray_settings settings = {.objective = a->plan->objective,
                                .smoothing = smoothing,
                                .min_light_paths = 2,
                                .max_light_paths = limited ? MOST_LIGHT_PATHS_EVER : MOST_LIGHT_PATHS,
                                .max_camera_paths = one_camera_path(a) ? 1 : MOST_CAMERA_PATHS,
                                .given_light_paths = pilot->light_paths,
                                .given_camera_paths = pilot->camera_paths};
    ca_ray_pixel *pixels = ca_alloc((size_t)pairs->width * pairs->height, sizeof *pixels);
    ca_ray_image image;
    *choice = (ca_auto_choice){0};
    if (!pixels) return ca_fail_memory(error, "the numbers of rays");
    a->costs = fill_image(a, pairs, halves, pixels, &image);
    if (a->render_iterations == 0) a->speed = speed_of_pilot(a, &image, halves);
    const ca_status status = choose_within_limits(a, &image, pairs, halves, &settings, choice, error);
    ca_free(pixels);
    if (status != CA_OK) ca_ray_numbers_destroy(&choice->numbers);
    return status;
}

void ca_auto_use(ca_auto_rays *a, ca_auto_choice *choice)
{
    const size_t count = (size_t)a->phase.width * a->phase.height;
    ca_ray_numbers *numbers = &choice->numbers;
    memcpy(a->numbers, numbers->camera_paths, count * sizeof *a->numbers);
    a->light_paths = (uint32_t)numbers->best.light_paths;
    a->mean_numbers = 0.0;
    for (size_t p = 0; p < count; p++) a->mean_numbers += a->numbers[p];
    a->mean_numbers /= (double)count;
    a->most = largest(a->numbers, count);
    a->predicted_gain = numbers->gain_over_given;
    ca_ray_numbers_destroy(numbers);
}
