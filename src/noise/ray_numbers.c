#include "noise/ray_numbers.h"

#include "base/memory.h"
#include "noise/ray_search.h"

#include <math.h>
#include <string.h>

enum { LARGEST_BOX = 2, DECILE_STEPS = 80 };

/* Weights closer than this to the largest minimum are not worth more steps. */
#define DECILE_GAP 0.002

typedef struct chooser {
    const ca_ray_image *image;
    const ca_ray_settings *settings;
    ca_ray_search search; /* over all pixels */
    double *luminance2;   /* owned; smoothed */
    double *plane;        /* owned; for smoothing, then weights */
    double *variances;    /* owned; V_p, ... */
    double *ranked;       /* owned; ... and again, to find the worst of */
    uint32_t *map;        /* N_B(p) */
} chooser;

_Static_assert(sizeof(ca_ray_term) + 4 * sizeof(double) + sizeof(uint32_t) == CA_RAY_CHOICE_PIXEL_BYTES,
               "ray_numbers.h tells what a choice allocates for each pixel");

/* ---- Checks ---------------------------------------------------------------------------------------------------- */

static ca_status check_limits(const ca_ray_search *search, ca_error *error)
{
    if (search->min_light_paths <= search->max_light_paths) return CA_OK;
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "at least %.0f and at most %.0f light paths cannot be chosen",
                   search->min_light_paths, search->max_light_paths);
}

static ca_status check_image(const ca_ray_image *image, ca_error *error)
{
    if (image->width == 0 || image->height == 0)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "ray numbers need at least one pixel");
    if (!(image->light_time > 0.0 && isfinite(image->light_time)) ||
        !(image->fixed_time >= 0.0 && isfinite(image->fixed_time)))
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "an iteration's time of %g s and a light path's of %g s: expected at least 0 and more than 0",
                       image->fixed_time, image->light_time);
    for (size_t i = 0; i < (size_t)image->width * image->height; i++) {
        const ca_ray_pixel *p = &image->pixels[i];
        const unsigned x = (unsigned)(i % image->width), y = (unsigned)(i / image->width);
        if (!isfinite(p->pair) || !isfinite(p->camera) || !isfinite(p->light) || !isfinite(p->luminance2))
            return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "the noise components of pixel (%u, %u) are not finite", x,
                           y);
        if (!(p->camera_time > 0.0 && isfinite(p->camera_time)) || !(p->merge_time >= 0.0 && isfinite(p->merge_time)))
            return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                           "times of %g s and %g s at pixel (%u, %u): expected more than 0 and at least 0",
                           p->camera_time, p->merge_time, x, y);
    }
    return CA_OK;
}

/* ---- Smoothing ------------------------------------------------------------------------------------------------- */

typedef struct smoothing {
    uint32_t width, height; /* of a plane */
    uint32_t radius;        /* pixels to each side; 0: none */
} smoothing;

/* The average over a box of `radius` pixels to each side, cut at the border. */
static double box_average(const smoothing *s, const double *plane, uint32_t x, uint32_t y, uint32_t radius)
{
    const uint32_t x0 = x > radius ? x - radius : 0, y0 = y > radius ? y - radius : 0;
    const uint32_t x1 = radius < s->width - x ? x + radius + 1 : s->width;
    const uint32_t y1 = radius < s->height - y ? y + radius + 1 : s->height;
    double sum = 0.0;
    for (uint32_t row = y0; row < y1; row++)
        for (uint32_t column = x0; column < x1; column++) sum += plane[(size_t)row * s->width + column];
    return sum / ((double)(x1 - x0) * (y1 - y0));
}

/* The first positive average from `radius` on. */
static double positive_average(const smoothing *s, const double *plane, uint32_t x, uint32_t y)
{
    for (uint32_t radius = 0; radius <= LARGEST_BOX; radius++) {
        const double average = box_average(s, plane, x, y, radius);
        if (average > 0.0) return average;
    }
    return 0.0;
}

/* As ray_numbers.h says; `given` is read and, as `result`, written. */
static void smooth(const smoothing *s, double *given, double *result)
{
    const size_t count = (size_t)s->width * s->height;
    double sum = 0.0, positive_sum = 0.0;
    for (size_t i = 0; i < count; i++) sum += given[i];
    if (s->radius > 0) {
        for (size_t i = 0; i < count; i++)
            result[i] = box_average(s, given, (uint32_t)(i % s->width), (uint32_t)(i / s->width), s->radius);
        for (size_t i = 0; i < count; i++) given[i] = result[i];
    }
    bool changed = s->radius > 0;
    for (size_t i = 0; i < count; i++) {
        result[i] = positive_average(s, given, (uint32_t)(i % s->width), (uint32_t)(i / s->width));
        changed = changed || result[i] != given[i];
        positive_sum += result[i];
    }
    if (!changed || !(positive_sum > 0.0)) return;
    const double scale = sum > 0.0 ? sum / positive_sum : 0.0;
    for (size_t i = 0; i < count; i++) result[i] *= scale;
}

static void smooth_estimates(chooser *c)
{
    const ca_ray_pixel *pixels = c->image->pixels;
    ca_ray_term *terms = c->search.terms;
    const size_t count = c->search.count;
    const smoothing s = {c->image->width, c->image->height, c->settings->smoothing};
    double *given = c->plane, *result = c->luminance2;
    for (size_t i = 0; i < count; i++)
        given[i] = pixels[i].pair - pixels[i].camera - pixels[i].light + pixels[i].luminance2;
    smooth(&s, given, result);
    for (size_t i = 0; i < count; i++)
        terms[i].interaction = result[i], given[i] = pixels[i].camera - pixels[i].luminance2;
    smooth(&s, given, result);
    for (size_t i = 0; i < count; i++) terms[i].camera = result[i], given[i] = pixels[i].light - pixels[i].luminance2;
    smooth(&s, given, result);
    for (size_t i = 0; i < count; i++) terms[i].light = result[i], given[i] = pixels[i].luminance2;
    smooth(&s, given, result);
}

/* ---- Objectives ------------------------------------------------------------------------------------------------ */

static double mean_of(const double *values, size_t count)
{
    double mean = 0.0;
    for (size_t i = 0; i < count; i++) mean += values[i] / (double)count;
    return mean;
}

static double weight_of(double luminance2, double mean, size_t count, ca_ray_objective objective)
{
    const bool relative = objective == CA_RAYS_RELATIVE && mean > 0.0;
    return 1.0 / (double)count / (relative ? luminance2 + CA_RAYS_RELATIVE_DELTA * mean : 1.0);
}

void ca_ray_weights(uint32_t width, uint32_t height, uint32_t radius, ca_ray_objective objective,
                    double *luminance2, double *weights)
{
    const size_t count = (size_t)width * height;
    smooth(&(smoothing){width, height, radius}, luminance2, weights);
    const double mean = mean_of(weights, count);
    for (size_t i = 0; i < count; i++) weights[i] = weight_of(weights[i], mean, count, objective);
}

static void set_weights(chooser *c)
{
    const size_t count = c->search.count;
    const double mean = mean_of(c->luminance2, count);
    for (size_t i = 0; i < count; i++)
        c->search.terms[i].weight = weight_of(c->luminance2[i], mean, count, c->settings->objective);
}

static double variance_of(const ca_ray_term *term, double light_paths, double camera_paths)
{
    return (term->interaction / light_paths + term->camera) / camera_paths + term->light / light_paths;
}

/* The rank-th largest of values, which change places. */
static double select_largest(double *values, size_t count, size_t rank)
{
    size_t low = 0, high = count - 1;
    while (low < high) {
        const double pivot = values[low + (high - low) / 2];
        size_t i = low, j = high;
        for (;; i++, j--) { /* [low, i) is not below the pivot, (j, high] not above it */
            while (values[i] > pivot) i++;
            while (values[j] < pivot) j--;
            if (i >= j) break;
            const double value = values[i];
            values[i] = values[j];
            values[j] = value;
        }
        if (rank <= j)
            high = j;
        else
            low = j + 1;
    }
    return values[low];
}

static size_t worst_count(const chooser *c) { return (c->search.count + 9) / 10; }

/* The mean of the worst tenth of c->variances; *limit: the smallest of them. */
static double worst_mean(const chooser *c, double *limit)
{
    const size_t count = c->search.count, worst = worst_count(c);
    for (size_t i = 0; i < count; i++) c->ranked[i] = c->variances[i];
    *limit = select_largest(c->ranked, count, worst - 1);
    double sum = 0.0;
    size_t above = 0;
    for (size_t i = 0; i < count; i++) {
        if (!(c->variances[i] > *limit)) continue;
        sum += c->variances[i];
        above++;
    }
    return (sum + (double)(worst - above) * *limit) / (double)worst;
}

/* From c->variances. */
static double objective_value(const chooser *c)
{
    double sum = 0.0;
    if (c->settings->objective == CA_RAYS_WORST_DECILE) return worst_mean(c, &sum);
    for (size_t i = 0; i < c->search.count; i++) sum += c->search.terms[i].weight * c->variances[i];
    return sum;
}

/* ---- One N_B for all pixels ------------------------------------------------------------------------------------ */

static void make_uniform(const chooser *c, ca_ray_search *uniform, ca_ray_term *sum)
{
    *sum = (ca_ray_term){.weight = 1.0};
    for (size_t i = 0; i < c->search.count; i++) {
        const ca_ray_term *term = &c->search.terms[i];
        sum->interaction += term->weight * term->interaction;
        sum->camera += term->weight * term->camera;
        sum->light += term->weight * term->light;
        sum->camera_time += term->camera_time;
        sum->merge_time += term->merge_time;
    }
    *uniform = c->search;
    uniform->terms = sum;
    uniform->count = 1;
}

/* ---- Weights of the worst decile ------------------------------------------------------------------------------- */

static void set_relaxed_variances(const chooser *c, const ca_ray_search *search, const ca_ray_point *point)
{
    ca_ray_search_set(search, point->map_light_paths);
    for (size_t i = 0; i < c->search.count; i++) {
        const ca_ray_term *term = &search->terms[search->count > 1 ? i : 0];
        c->variances[i] =
            variance_of(&c->search.terms[i], point->light_paths, ca_ray_real_paths(search, term, point->kappa));
    }
}

/* One of Frank and Wolfe's steps: towards all weight on the worst tenth. Pixels at its limit share what is left of
 * it. */
static void step_weights(const chooser *c, double limit, double step)
{
    const size_t worst = worst_count(c);
    size_t above = 0, at = 0;
    for (size_t i = 0; i < c->search.count; i++) {
        above += c->variances[i] > limit;
        at += c->variances[i] == limit;
    }
    const double share = (double)(worst - above) / (double)at;
    for (size_t i = 0; i < c->search.count; i++) {
        const double v = c->variances[i], target = (v > limit ? 1.0 : v == limit ? share : 0.0) / (double)worst;
        c->search.terms[i].weight += step * (target - c->search.terms[i].weight);
    }
}

static ca_ray_point relax(const chooser *c, bool uniform, double low, double high)
{
    ca_ray_search one;
    ca_ray_term sum;
    const ca_ray_search *search = &c->search;
    if (uniform) {
        make_uniform(c, &one, &sum);
        search = &one;
    }
    const ca_ray_point point = ca_ray_search_relaxed(search, low, high);
    if (c->settings->objective == CA_RAYS_WORST_DECILE) set_relaxed_variances(c, search, &point);
    return point;
}

/* The minimum for weights w is a concave function of them, and its largest value the minimum for the worst decile.
 * Numbers that are the best for some weights are judged by their own worst decile. */
static ca_ray_point relax_worst_decile(chooser *c, bool uniform)
{
    const ca_ray_search *s = &c->search;
    ca_ray_point best = {.variance = HUGE_VAL, .time = 1.0};
    double low = s->min_light_paths, high = s->max_light_paths, bound = 0.0;
    for (int k = 0; k < DECILE_STEPS; k++) {
        ca_ray_point point = relax(c, uniform, low, high);
        bound = fmax(bound, ca_ray_cost(&point));
        double limit;
        point.variance = worst_mean(c, &limit);
        if (ca_ray_cost(&point) < ca_ray_cost(&best)) {
            best = point;
            for (size_t i = 0; i < s->count; i++) c->plane[i] = s->terms[i].weight;
        }
        if (ca_ray_cost(&best) <= bound * (1.0 + DECILE_GAP)) break;
        step_weights(c, limit, 2.0 / (k + 3.0));
        /* The weights of one step move the minimum little: the next search is near it. */
        low = fmax(point.light_paths / 4.0, s->min_light_paths);
        high = fmin(point.light_paths * 4.0, s->max_light_paths);
    }
    for (size_t i = 0; i < s->count; i++) s->terms[i].weight = c->plane[i];
    return best;
}

/* ---- Choices --------------------------------------------------------------------------------------------------- */

/* N_B of all pixels, or of a map. */
static ca_ray_choice judge(const chooser *c, double light_paths, const uint32_t *map, double camera_paths)
{
    ca_ray_choice choice = {.light_paths = light_paths,
                            .time = c->image->fixed_time + light_paths * c->image->light_time};
    for (size_t i = 0; i < c->search.count; i++) {
        const ca_ray_term *term = &c->search.terms[i];
        const double n = map ? map[i] : camera_paths;
        c->variances[i] = variance_of(term, light_paths, n);
        choice.time += n * (term->camera_time + light_paths * term->merge_time);
        choice.camera_paths += n / (double)c->search.count;
    }
    choice.variance = objective_value(c);
    return choice;
}

static ca_ray_point relaxed_optimum(chooser *c, bool uniform)
{
    set_weights(c);
    if (c->settings->objective == CA_RAYS_WORST_DECILE) return relax_worst_decile(c, uniform);
    return relax(c, uniform, c->search.min_light_paths, c->search.max_light_paths);
}

static ca_ray_choice judge_point(const chooser *c, const ca_ray_search *search, const ca_ray_point *point)
{
    ca_ray_search_set(search, point->map_light_paths);
    if (search != &c->search)
        return judge(c, point->light_paths, NULL, ca_ray_integer_paths(search, search->terms, point->kappa));
    for (size_t i = 0; i < search->count; i++)
        c->map[i] = ca_ray_integer_paths(search, &search->terms[i], point->kappa);
    return judge(c, point->light_paths, c->map, 0.0);
}

/* The best integers for the weights need not be the best for the worst decile: numbers around them are tried, too. */
static ca_ray_point look_around(const chooser *c, const ca_ray_search *search, const ca_ray_point *point)
{
    static const double light_factors[] = {0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.4, 1.7};
    static const double kappa_factors[] = {0.6, 0.7, 0.8, 0.87, 0.94, 1.0, 1.06, 1.13, 1.25, 1.4, 1.7};
    enum { LIGHT = 9, KAPPA = 11 };
    ca_ray_point best = *point;
    ca_ray_choice choice = judge_point(c, search, point);
    double cost = choice.variance * choice.time;
    for (int i = 0; i < LIGHT * KAPPA; i++) {
        ca_ray_point trial = {.kappa = point->kappa * kappa_factors[i % KAPPA]};
        trial.light_paths = fmin(fmax(round(point->light_paths * light_factors[i / KAPPA]), search->min_light_paths),
                                 search->max_light_paths);
        trial.map_light_paths = trial.light_paths;
        choice = judge_point(c, search, &trial);
        if (!(choice.variance * choice.time < cost)) continue;
        cost = choice.variance * choice.time;
        best = trial;
    }
    return best;
}

/* The best integers; c->map is theirs where N_B is not one for all. */
static ca_ray_choice choose_integers(const chooser *c, const ca_ray_search *search, const ca_ray_point *relaxed)
{
    ca_ray_point point = ca_ray_search_integers(search, relaxed);
    if (c->settings->objective == CA_RAYS_WORST_DECILE) point = look_around(c, search, &point);
    return judge_point(c, search, &point);
}

static void choose_map(chooser *c, ca_ray_numbers *numbers)
{
    const ca_ray_point relaxed = relaxed_optimum(c, false);
    ca_ray_search_set(&c->search, relaxed.map_light_paths);
    numbers->relaxed = (ca_ray_choice){
        .light_paths = relaxed.light_paths, .variance = relaxed.variance, .time = relaxed.time};
    for (size_t i = 0; i < c->search.count; i++)
        numbers->relaxed.camera_paths +=
            ca_ray_real_paths(&c->search, &c->search.terms[i], relaxed.kappa) / (double)c->search.count;
    numbers->best = choose_integers(c, &c->search, &relaxed);
}

static void choose_uniform(chooser *c, ca_ray_numbers *numbers)
{
    ca_ray_search one;
    ca_ray_term sum;
    const ca_ray_point relaxed = relaxed_optimum(c, true);
    make_uniform(c, &one, &sum);
    numbers->uniform = choose_integers(c, &one, &relaxed);
}

static double gain(const ca_ray_choice *other, const ca_ray_choice *best)
{
    const double cost = best->variance * best->time;
    return cost > 0.0 ? other->variance * other->time / cost : 1.0;
}

static void choose(chooser *c, ca_ray_numbers *numbers)
{
    const ca_ray_settings *s = c->settings;
    for (size_t i = 0; i < c->search.count; i++) {
        c->search.terms[i].camera_time = c->image->pixels[i].camera_time;
        c->search.terms[i].merge_time = c->image->pixels[i].merge_time;
    }
    smooth_estimates(c);
    choose_uniform(c, numbers);
    choose_map(c, numbers);
    numbers->gain_over_uniform = gain(&numbers->uniform, &numbers->best);
    numbers->gain_over_given = (double)NAN;
    if (s->given_light_paths == 0 || s->given_camera_paths == 0) return;
    numbers->given = judge(c, s->given_light_paths, NULL, s->given_camera_paths);
    numbers->gain_over_given = gain(&numbers->given, &numbers->best);
}

/* ---- Names ----------------------------------------------------------------------------------------------------- */

static const char *const objective_names[] = {
    [CA_RAYS_MEAN] = "mean", [CA_RAYS_RELATIVE] = "relative", [CA_RAYS_WORST_DECILE] = "worst-decile"};
enum { OBJECTIVES = sizeof objective_names / sizeof objective_names[0] };

const char *ca_ray_objective_name(size_t i) { return i < OBJECTIVES ? objective_names[i] : NULL; }

ca_status ca_ray_objective_find(const char *name, ca_ray_objective *objective, ca_error *error)
{
    *objective = CA_RAYS_MEAN;
    if (!name) return CA_OK;
    for (size_t i = 0; i < OBJECTIVES; i++) {
        if (strcmp(name, objective_names[i]) != 0) continue;
        *objective = (ca_ray_objective)i;
        return CA_OK;
    }
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                   "the objective \"%.100s\" is not known; there are mean, relative, worst-decile", name);
}

/* ---- Interface ------------------------------------------------------------------------------------------------- */

static void release(chooser *c)
{
    ca_free(c->search.terms);
    ca_free(c->luminance2);
    ca_free(c->plane);
    ca_free(c->variances);
    ca_free(c->ranked);
}

static bool allocate(chooser *c, ca_ray_numbers *numbers)
{
    const size_t count = c->search.count;
    c->search.terms = ca_alloc_zeroed(count, sizeof *c->search.terms);
    c->luminance2 = ca_alloc(count, sizeof *c->luminance2);
    c->plane = ca_alloc(count, sizeof *c->plane);
    c->variances = ca_alloc(count, sizeof *c->variances);
    c->ranked = ca_alloc(count, sizeof *c->ranked);
    c->map = numbers->camera_paths = ca_alloc(count, sizeof *numbers->camera_paths);
    return c->search.terms && c->luminance2 && c->plane && c->variances && c->ranked && numbers->camera_paths;
}

ca_status ca_ray_numbers_choose(ca_ray_numbers *numbers, const ca_ray_image *image, const ca_ray_settings *settings,
                                ca_error *error)
{
    *numbers = (ca_ray_numbers){0};
    chooser c = {.image = image,
                 .settings = settings,
                 .search = {.count = (size_t)image->width * image->height,
                            .fixed_time = image->fixed_time,
                            .light_time = image->light_time,
                            .min_light_paths = settings->min_light_paths ? settings->min_light_paths : 1,
                            .max_light_paths = settings->max_light_paths ? settings->max_light_paths
                                                                         : CA_RAY_MOST_LIGHT_PATHS,
                            .max_camera_paths = settings->max_camera_paths ? settings->max_camera_paths
                                                                           : CA_RAY_MOST_CAMERA_PATHS}};
    CA_TRY(check_limits(&c.search, error));
    CA_TRY(check_image(image, error));
    const bool enough = allocate(&c, numbers);
    if (enough) choose(&c, numbers);
    release(&c);
    if (enough) return CA_OK;
    ca_ray_numbers_destroy(numbers);
    return ca_fail_memory(error, "the choice of ray numbers");
}

ca_status ca_ray_numbers_use_uniform(ca_ray_numbers *numbers, const ca_ray_choice *uniform, size_t pixels,
                                     ca_error *error)
{
    if (!numbers->camera_paths) numbers->camera_paths = ca_alloc(pixels, sizeof *numbers->camera_paths);
    if (!numbers->camera_paths) return ca_fail_memory(error, "the numbers of rays");
    for (size_t p = 0; p < pixels; p++) numbers->camera_paths[p] = (uint32_t)round(uniform->camera_paths);
    numbers->best = *uniform;
    return CA_OK;
}

void ca_ray_numbers_destroy(ca_ray_numbers *numbers)
{
    ca_free(numbers->camera_paths);
    *numbers = (ca_ray_numbers){0};
}
