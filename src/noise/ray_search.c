#include "noise/ray_search.h"

#include <math.h>

enum { MANY_TERMS = 4096 };

static double clamp(double value, double low, double high) { return value < low ? low : value > high ? high : value; }

void ca_ray_search_set(const ca_ray_search *search, double light_paths)
{
    for (size_t i = 0; i < search->count; i++) {
        ca_ray_term *term = &search->terms[i];
        term->a = term->weight * (term->interaction / light_paths + term->camera);
        term->tau = term->camera_time + light_paths * term->merge_time;
        term->root = sqrt(term->a / term->tau);
    }
}

double ca_ray_real_paths(const ca_ray_search *search, const ca_ray_term *term, double kappa)
{
    return clamp(kappa * term->root, 1.0, search->max_camera_paths);
}

/* a / n + tau n / kappa^2 falls from n to n + 1 where n (n + 1) < (kappa root)^2. */
uint32_t ca_ray_integer_paths(const ca_ray_search *search, const ca_ray_term *term, double kappa)
{
    const double real = kappa * term->root;
    if (!(real < search->max_camera_paths)) return (uint32_t)search->max_camera_paths;
    return (uint32_t)clamp(ceil(0.5 * (sqrt(1.0 + 4.0 * real * real) - 1.0)), 1.0, search->max_camera_paths);
}

/* ---- Real numbers, N_F fixed ----------------------------------------------------------------------------------- */

/* What does not depend on the terms' N_B, and how far their roots reach. */
typedef struct fixed_parts {
    double variance, time; /* b, T_0 */
    double root_min, root_max; /* of those above 0; root_max = 0: none is */
} fixed_parts;

static fixed_parts fixed_parts_of(const ca_ray_search *search, double light_paths)
{
    fixed_parts parts = {.time = search->fixed_time + light_paths * search->light_time, .root_min = HUGE_VAL};
    for (size_t i = 0; i < search->count; i++) {
        const ca_ray_term *term = &search->terms[i];
        parts.variance += term->weight * term->light;
        if (!(term->root > 0.0)) continue;
        parts.root_min = fmin(parts.root_min, term->root);
        parts.root_max = fmax(parts.root_max, term->root);
    }
    parts.variance /= light_paths;
    return parts;
}

/* Sums over terms whose N_B is cut, and of sqrt(a tau) over the others. */
typedef struct cut_sums {
    double variance, time, between;
} cut_sums;

static cut_sums cut_at(const ca_ray_search *search, double kappa)
{
    cut_sums sums = {0};
    for (size_t i = 0; i < search->count; i++) {
        const ca_ray_term *term = &search->terms[i];
        const double real = kappa * term->root, cut = clamp(real, 1.0, search->max_camera_paths);
        if (real == cut) {
            sums.between += term->root * term->tau;
        } else {
            sums.variance += term->a / cut;
            sums.time += term->tau * cut;
        }
    }
    return sums;
}

static double best_kappa(const ca_ray_search *search, const fixed_parts *parts)
{
    if (!(parts->root_max > 0.0)) return 1.0;
    double low = 1.0 / parts->root_max, high = fmax(search->max_camera_paths / parts->root_min, low);
    double kappa = clamp(sqrt(parts->time / parts->variance), low, high);
    for (int i = 0; i < 100 && high > low * (1.0 + 1e-7); i++) {
        const cut_sums sums = cut_at(search, kappa);
        const double variance = parts->variance + sums.variance, time = parts->time + sums.time;
        double next = sqrt(time / variance);
        if (fabs(next - kappa) <= 1e-7 * kappa) break;
        if (next > kappa)
            low = kappa;
        else
            high = kappa;
        if (!(next > low && next < high)) next = sqrt(low * high);
        kappa = next;
    }
    return kappa;
}

static ca_ray_point relaxed_at(const ca_ray_search *search, double light_paths)
{
    ca_ray_search_set(search, light_paths);
    const fixed_parts parts = fixed_parts_of(search, light_paths);
    const double kappa = best_kappa(search, &parts);
    const cut_sums sums = cut_at(search, kappa);
    return (ca_ray_point){.light_paths = light_paths,
                          .map_light_paths = light_paths,
                          .kappa = kappa,
                          .variance = parts.variance + sums.variance + sums.between / kappa,
                          .time = parts.time + sums.time + sums.between * kappa};
}

/* ---- Over N_F -------------------------------------------------------------------------------------------------- */

ca_ray_point ca_ray_search_relaxed(const ca_ray_search *search, double low, double high)
{
    const double golden = 0.61803398874989485;
    double from = log(low), to = log(high);
    double x1 = to - golden * (to - from), x2 = from + golden * (to - from);
    ca_ray_point p1 = relaxed_at(search, exp(x1)), p2 = relaxed_at(search, exp(x2));
    /* The cost is flat at its minimum: 1 % beside it, 0.01 % is lost at most. */
    while (to - from > 0.01) {
        if (ca_ray_cost(&p1) <= ca_ray_cost(&p2)) {
            to = x2;
            x2 = x1;
            p2 = p1;
            x1 = to - golden * (to - from);
            p1 = relaxed_at(search, exp(x1));
        } else {
            from = x1;
            x1 = x2;
            p1 = p2;
            x2 = from + golden * (to - from);
            p2 = relaxed_at(search, exp(x2));
        }
    }
    return ca_ray_cost(&p1) <= ca_ray_cost(&p2) ? p1 : p2;
}

/* ---- Integers -------------------------------------------------------------------------------------------------- */

/* With the terms' integers the variance is per_light / N_F + rest, the time fixed + N_F each. */
typedef struct map_sums {
    double per_light, rest, fixed, each;
} map_sums;

static map_sums sums_of_map(const ca_ray_search *search, double kappa)
{
    map_sums sums = {.fixed = search->fixed_time, .each = search->light_time};
    for (size_t i = 0; i < search->count; i++) {
        const ca_ray_term *term = &search->terms[i];
        const double n = ca_ray_integer_paths(search, term, kappa);
        sums.per_light += term->weight * (term->interaction / n + term->light);
        sums.rest += term->weight * term->camera / n;
        sums.fixed += n * term->camera_time;
        sums.each += n * term->merge_time;
    }
    return sums;
}

static double cost_with(const map_sums *sums, double light_paths)
{
    return (sums->per_light / light_paths + sums->rest) * (sums->fixed + light_paths * sums->each);
}

/* The best integer N_F for a map. */
static double best_light_paths(const ca_ray_search *search, const map_sums *sums)
{
    if (!(sums->per_light > 0.0)) return search->min_light_paths;
    const double real =
        sqrt(sums->per_light * sums->fixed / (sums->rest * sums->each)); /* infinite where rest is 0 */
    const double below = clamp(floor(real), search->min_light_paths, search->max_light_paths);
    const double above = clamp(ceil(real), search->min_light_paths, search->max_light_paths);
    return cost_with(sums, below) <= cost_with(sums, above) ? below : above;
}

/* A map for kappa, N_F for the map, kappa^2 = time / variance for both, and so on: no step makes the cost larger,
 * since the map minimises V + T / kappa^2, and where that is not more than before neither is the product. */
static ca_ray_point descend(const ca_ray_search *search, double light_paths, double kappa)
{
    ca_ray_point best = {.variance = HUGE_VAL, .time = 1.0};
    for (int i = 0; i < 100; i++) {
        ca_ray_search_set(search, light_paths);
        const map_sums sums = sums_of_map(search, kappa);
        ca_ray_point point = {.map_light_paths = light_paths, .kappa = kappa};
        point.light_paths = best_light_paths(search, &sums);
        point.variance = sums.per_light / point.light_paths + sums.rest;
        point.time = sums.fixed + point.light_paths * sums.each;
        if (!(ca_ray_cost(&point) < ca_ray_cost(&best) * (1.0 - 1e-6))) break;
        best = point;
        light_paths = point.light_paths;
        kappa = sqrt(point.time / point.variance);
        if (!isfinite(kappa)) break; /* nothing is noisy */
    }
    return best;
}

ca_ray_point ca_ray_search_integers(const ca_ray_search *search, const ca_ray_point *relaxed)
{
    static const double light_factors[] = {1.0, 0.5, 0.7, 0.85, 1.2, 1.4, 2.0}, kappa_factors[] = {1.0, 0.75, 1.35};
    ca_ray_point best = descend(search, relaxed->light_paths, relaxed->kappa);
    if (search->count > MANY_TERMS) return best; /* what rounding does to them averages out */
    for (int i = 0; i < 7; i++)
        for (int j = i == 0; j < 3; j++) {
            const double light_paths =
                clamp(relaxed->light_paths * light_factors[i], search->min_light_paths, search->max_light_paths);
            const ca_ray_point point = descend(search, light_paths, relaxed->kappa * kappa_factors[j]);
            if (ca_ray_cost(&point) < ca_ray_cost(&best)) best = point;
        }
    return best;
}
