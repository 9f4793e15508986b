/* From estimates and times to numbers of rays. */
#include "base/memory.h"
#include "noise/components.h"
#include "render/auto_rays_state.h"

#include <math.h>
#include <string.h>

enum { LIMIT_STEPS = 40 };
enum { MOST_LIGHT_PATHS = 1 << 22, MOST_LIGHT_PATHS_EVER = 1 << 30, MOST_CAMERA_PATHS = 4096 };

static bool one_camera_path(const ca_auto_rays *a) { return strcmp(a->plan->type->name, "ppm") == 0; }

/* ---- What is known --------------------------------------------------------------------------------------------- */

/* With one camera path F is not known, nor needed: its factor is 0. */
static ca_auto_known known_of(const ca_auto_rays *a, const ca_pair_film *pairs, size_t p, double light_paths,
                              double camera_paths)
{
    const ca_pair_pixel *pixel = &pairs->pixels[p];
    const ca_noise_components c = ca_noise_components_of(pixel);
    const double n = (double)pixel->iterations;
    return (ca_auto_known){.value = pixel->sums[CA_PAIR_VALUE] / n,
                           .pair = c.pair.value,
                           .camera = c.camera.value,
                           .light = one_camera_path(a) ? c.luminance2.value : c.light.value,
                           .luminance2 = c.luminance2.value,
                           .weight = n * light_paths * camera_paths};
}

void ca_auto_know(ca_auto_rays *a, const ca_pair_film *pairs)
{
    const ca_auto_group *g = &a->groups[CA_AUTO_ORDINARY];
    for (size_t p = 0; p < (size_t)pairs->width * pairs->height; p++)
        a->known[p] = known_of(a, pairs, p, g->light_paths, g->camera_paths);
}

static double mixed(double x, double y, double share) { return x + share * (y - x); }

void ca_auto_know_more(ca_auto_rays *a, const ca_pair_film *pairs)
{
    if (pairs->pixels[0].iterations < 2) return;
    for (size_t p = 0; p < (size_t)pairs->width * pairs->height; p++) {
        if (a->numbers[p] == 1 && !one_camera_path(a)) continue;
        ca_auto_known *all = &a->known[p];
        const ca_auto_known more = known_of(a, pairs, p, a->light_paths, a->numbers[p]);
        const double weight = all->weight + more.weight, share = more.weight / weight;
        *all = (ca_auto_known){.value = mixed(all->value, more.value, share),
                               .pair = mixed(all->pair, more.pair, share),
                               .camera = mixed(all->camera, more.camera, share),
                               .light = mixed(all->light, more.light, share),
                               .luminance2 = mixed(all->luminance2, more.luminance2, share),
                               .weight = weight};
    }
}

/* ---- The image of estimates ------------------------------------------------------------------------------------ */

/* Means over the halves that may be used. */
static void set_times(const ca_auto_rays *a, unsigned halves, const ca_ray_costs *costs, uint32_t x, uint32_t y,
                      ca_ray_pixel *to)
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

static ca_ray_costs fill_image(const ca_auto_rays *a, unsigned halves, ca_ray_pixel *pixels, ca_ray_image *image)
{
    static const double shortest = 1e-10;
    const uint32_t width = a->phase.width, height = a->phase.height;
    ca_ray_costs costs[CA_AUTO_HALVES];
    for (unsigned h = 0; h < CA_AUTO_HALVES; h++)
        if (halves >> h & 1u) costs[h] = ca_ray_times_costs(a->halves[h].times);
    for (uint32_t y = 0; y < height; y++)
        for (uint32_t x = 0; x < width; x++) {
            const ca_auto_known *known = &a->known[(size_t)y * width + x];
            ca_ray_pixel *pixel = &pixels[(size_t)y * width + x];
            *pixel = (ca_ray_pixel){
                .pair = known->pair, .camera = known->camera, .light = known->light, .luminance2 = known->luminance2};
            set_times(a, halves, costs, x, y, pixel);
            pixel->camera_time = at_least(pixel->camera_time, shortest);
            pixel->merge_time = at_least(pixel->merge_time, 0.0);
        }
    const ca_ray_costs mean = mean_costs(costs, halves);
    *image = (ca_ray_image){.width = width,
                            .height = height,
                            .pixels = pixels,
                            .fixed_time = at_least(mean.iteration, 0.0),
                            .light_time = at_least(mean.light_path, shortest)};
    return mean;
}

/* The law's terms for an iteration (noise/components.h). */
typedef struct noise_terms {
    double camera, light, pair;
} noise_terms;

static noise_terms terms_of(const ca_auto_known *known, double light_paths, double camera_paths)
{
    const double mean2 = known->luminance2;
    return (noise_terms){.camera = (1.0 - 1.0 / light_paths) * (known->camera - mean2) / camera_paths,
                         .light = (1.0 - 1.0 / camera_paths) * (known->light - mean2) / light_paths,
                         .pair = (known->pair - mean2) / (light_paths * camera_paths)};
}

ca_status ca_auto_add_terms(const ca_auto_rays *a, ca_image_layers *image, ca_error *error)
{
    float *camera, *light, *pair;
    if (!(a->known[0].weight > 0.0)) return CA_OK;
    CA_TRY(ca_layers_add(image, "Noise.Camera", &camera, error));
    CA_TRY(ca_layers_add(image, "Noise.Light", &light, error));
    CA_TRY(ca_layers_add(image, "Noise.Pair", &pair, error));
    for (size_t p = 0; p < (size_t)a->phase.width * a->phase.height; p++) {
        const noise_terms terms = terms_of(&a->known[p], a->light_paths, a->numbers[p]);
        camera[p] = (float)terms.camera;
        light[p] = (float)terms.light;
        pair[p] = (float)terms.pair;
    }
    return CA_OK;
}

/* Without smoothing and without regard to signs: the sum over pixels has no bias. */
static double relative_variance(const ca_auto_rays *a, const ca_ray_numbers *numbers)
{
    const size_t count = (size_t)a->phase.width * a->phase.height;
    double variance = 0.0, luminance = 0.0;
    for (size_t p = 0; p < count; p++) {
        const noise_terms terms = terms_of(&a->known[p], numbers->best.light_paths, numbers->camera_paths[p]);
        variance += terms.camera + terms.light + terms.pair;
        luminance += a->known[p].value;
    }
    return luminance > 0.0 ? variance * (double)count / (luminance * luminance) : (double)NAN;
}

/* ---- Choosing -------------------------------------------------------------------------------------------------- */

/* How many iterations with these numbers there would be until the end. A half's choice must not look at the noise of
 * both. */
static double iterations_left(const ca_auto_rays *a, const ca_auto_choice *choice, bool of_all)
{
    const ca_ray_choice *best = &choice->numbers.best;
    const double one = best->time * a->speed, work_left = ca_auto_work_end(a) - ca_auto_work(a);
    if (!ca_auto_by_samples(a) && isfinite(work_left)) return work_left / one;
    /* Where nobody said how long it may take, an iteration is to be no longer than all before it: estimates that see
     * no noise of camera paths, right or wrong, would ask for light paths without end. */
    double left = one > a->seconds ? 0.0 : (double)INFINITY;
    if (ca_auto_by_samples(a)) return fmin(left, work_left / best->camera_paths);
    const double target = 0.01 * a->looks.target, noise = 0.01 * a->looks.noise;
    if (of_all && target > 0.0 && noise > target && choice->relative_variance > 0.0)
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
        settings->max_light_paths =
            light_paths / 2 > settings->min_light_paths ? light_paths / 2 : settings->min_light_paths;
    if (!memory && most > 1) settings->max_camera_paths = most / 2;
    return true;
}

/* Of numbers that are as good for all that is known, those with the fewest light paths: costs are a secant's, while
 * photons in ever slower memory cost ever more; and the image comes in more iterations. */
static ca_status prefer_fewer(const ca_ray_image *image, ca_ray_settings *settings, ca_ray_numbers *numbers,
                              ca_error *error)
{
    static const double as_good = 1.03;
    const double limit = as_good * numbers->best.variance * numbers->best.time;
    for (;;) {
        ca_ray_numbers fewer;
        settings->max_light_paths = (uint32_t)(numbers->best.light_paths / 2.0);
        if (settings->max_light_paths < settings->min_light_paths) return CA_OK;
        CA_TRY(ca_ray_numbers_choose(&fewer, image, settings, error));
        const bool good = fewer.best.variance * fewer.best.time <= limit;
        if (good) {
            ca_ray_numbers_destroy(numbers);
            *numbers = fewer;
        } else {
            ca_ray_numbers_destroy(&fewer);
            return CA_OK;
        }
    }
}

static ca_status choose_within_limits(ca_auto_rays *a, const ca_ray_image *image, bool of_all, uint32_t iterations,
                                      ca_ray_settings *settings, ca_auto_choice *choice, ca_error *error)
{
    const size_t count = (size_t)image->width * image->height;
    for (int step = 0; step < LIMIT_STEPS; step++) {
        bool fits = true;
        ca_ray_numbers_destroy(&choice->numbers);
        CA_TRY(ca_ray_numbers_choose(&choice->numbers, image, settings, error));
        choice->relative_variance = relative_variance(a, &choice->numbers);
        const bool too_long = iterations_left(a, choice, of_all) < iterations;
        if (!too_long) CA_TRY(ca_render_plan_fits(a->plan, (uint32_t)choice->numbers.best.light_paths, &fits, error));
        if (!too_long && fits) break;
        if (!lower_limits(settings, &choice->numbers, count, !too_long)) break;
    }
    CA_TRY(prefer_fewer(image, settings, &choice->numbers, error));
    choice->relative_variance = relative_variance(a, &choice->numbers);
    return CA_OK;
}

/* By the costs. */
static double iteration_time(const ca_ray_image *image, uint32_t light_paths, const uint32_t *numbers,
                             uint32_t uniform)
{
    double time = image->fixed_time + light_paths * image->light_time;
    for (size_t p = 0; p < (size_t)image->width * image->height; p++)
        time += (numbers ? numbers[p] : uniform) *
                (image->pixels[p].camera_time + light_paths * image->pixels[p].merge_time);
    return time;
}

/* What an iteration took by the clock, over what its paths cost: how parallel it ran, and what else it did. Of the
 * last phase that knows, else of the pilot. */
static double speed_of(const ca_auto_rays *a, const ca_ray_image *image, unsigned halves)
{
    const ca_auto_group *pilot = &a->groups[CA_AUTO_ORDINARY];
    double seconds = 0.0, count = 0.0;
    if (a->plain_seconds > 0.0) return a->plain_seconds / iteration_time(image, a->light_paths, a->numbers, 0);
    for (unsigned h = 0; h < CA_AUTO_HALVES; h++) {
        if (!(halves >> h & 1u)) continue;
        seconds += a->halves[h].plain_seconds;
        count += a->halves[h].plain_count;
    }
    return seconds / (count * iteration_time(image, pilot->light_paths, NULL, pilot->camera_paths));
}

static uint32_t most_light_paths(const ca_auto_rays *a, uint32_t reach)
{
    const uint32_t most = a->plan->input.memory_bytes > 0.0 ? MOST_LIGHT_PATHS_EVER : MOST_LIGHT_PATHS;
    return a->timed_light_paths < most / reach ? a->timed_light_paths * reach : most;
}

ca_status ca_auto_choose(ca_auto_rays *a, const ca_auto_question *question, ca_auto_choice *choice, ca_error *error)
{
    const ca_auto_group *pilot = &a->groups[CA_AUTO_ORDINARY];
    const unsigned halves = question->halves;
    const bool of_all = halves == 3u || a->render_iterations > 0;
    ca_ray_settings settings = {.objective = a->plan->objective,
                                .smoothing = question->smoothing,
                                .min_light_paths = 2,
                                .max_light_paths = most_light_paths(a, question->reach),
                                .max_camera_paths = one_camera_path(a) ? 1 : MOST_CAMERA_PATHS,
                                .given_light_paths = pilot->light_paths,
                                .given_camera_paths = pilot->camera_paths};
    ca_ray_pixel *pixels = ca_alloc((size_t)a->phase.width * a->phase.height, sizeof *pixels);
    ca_ray_image image;
    *choice = (ca_auto_choice){0};
    if (!pixels) return ca_fail_memory(error, "the numbers of rays");
    a->costs = fill_image(a, halves, pixels, &image);
    a->speed = speed_of(a, &image, halves);
    const ca_status status = choose_within_limits(a, &image, of_all, question->iterations, &settings, choice, error);
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
