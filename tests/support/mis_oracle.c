#include "support/mis_oracle.h"

#include <math.h>

static const double pi = 3.14159265358979323846;

/* ---- Reuse ----------------------------------------------------------------------------------------------------- */

static double limited(const ca_reuse_rules *rules, const ca_full_path *path, uint32_t m)
{
    const double found = (double)rules->merge_area * (double)path->photon_density[m];
    return (double)rules->light_paths / fmax(1.0, found);
}

static double mean_limited(const ca_reuse_rules *rules, const ca_full_path *path)
{
    double sum = 0.0, count = 0.0;
    for (uint32_t m = 1; m + 1 < path->n; m++) {
        if (path->dirac[m]) continue;
        sum += limited(rules, path, m);
        count += 1.0;
    }
    return sum / count;
}

static double event(const ca_reuse_rules *rules, float pdf)
{
    return 1.0 / ((double)rules->epsilon + sqrt((double)pdf));
}

static double tilt(const ca_reuse_rules *rules, float cos_out, float cos_in)
{
    return rules->projected ? (double)cos_out / (double)cos_in : 1.0;
}

/* The area of the camera's footprint at x[m], from its start. */
static double camera_footprint(const ca_reuse_rules *rules, const ca_full_path *p, uint32_t m)
{
    double area = (double)p->camera_area;
    double root_omega = p->camera_parallel ? 0.0 : event(rules, p->pdf_to_light[0]);
    for (uint32_t i = 1;; i++) {
        area = pow(sqrt(area) + (double)p->distance[i - 1] * root_omega, 2.0);
        if (i == m) return area;
        area *= tilt(rules, p->cos_to_light[i], p->cos_to_camera[i]);
        root_omega += p->dirac[i] ? 0.0 : event(rules, p->pdf_to_light[i]);
    }
}

static double light_footprint(const ca_reuse_rules *rules, const ca_full_path *p, uint32_t m)
{
    double area = (double)p->light_area;
    double root_omega = p->light_parallel ? 0.0 : event(rules, p->pdf_to_camera[p->n - 1]);
    for (uint32_t i = p->n - 2;; i--) {
        area = pow(sqrt(area) + (double)p->distance[i] * root_omega, 2.0);
        if (i == m) return area;
        area *= tilt(rules, p->cos_to_camera[i], p->cos_to_light[i]);
        root_omega += p->dirac[i] ? 0.0 : event(rules, p->pdf_to_camera[i]);
    }
}

/* 8c with A[X] = A_X / 1 and A[Y] = A_Y / p_0 (7). */
static double footprint(const ca_reuse_rules *rules, const ca_full_path *path, uint32_t m)
{
    const double x = camera_footprint(rules, path, m);
    const double y = light_footprint(rules, path, m) / (double)path->light_choice;
    const double power = pow(x / y, 2.0 + (double)rules->c);
    return (power + 1.0) / (power + 1.0 / (double)rules->light_paths);
}

static double alike_area(const ca_full_path *path)
{
    const double radius = tan(pi / 180.0) * (double)path->distance[0];
    return pi * radius * radius;
}

/* The chance of coming near x[i] for a walk that has come to `from`. */
static double alike(const ca_full_path *path, uint32_t from, float pdf)
{
    return path->dirac[from] ? 1.0 : fmin(1.0, (double)pdf * alike_area(path));
}

static double correlation(const ca_reuse_rules *rules, const ca_full_path *path, uint32_t m)
{
    if (m == 1) return (double)rules->light_paths;
    const bool area_light = path->light_area > 0.0f && !path->light_infinite;
    const float end = path->pdf_light[path->n - 1];
    double c = 1.0, l = area_light ? fmin(1.0, (double)end * alike_area(path)) : (double)path->light_choice;
    for (uint32_t i = 1; i <= m; i++) c *= alike(path, i - 1, path->pdf_camera[i]);
    for (uint32_t i = path->n - 2; i >= m; i--) l *= alike(path, i + 1, path->pdf_light[i]);
    return (double)rules->light_paths * (c + l > 0.0 ? c / (c * (1.0 - l) + l) : 1.0);
}

void ca_oracle_reuse(const ca_reuse_rules *rules, const ca_full_path *path, double *reuse)
{
    for (uint32_t m = 0; m < path->n; m++) {
        reuse[m] = 0.0;
        if (!ca_full_path_is_smooth(path, m)) continue;
        const double all = (double)rules->light_paths;
        switch (rules->kind) {
        case CA_REUSE_FULL: reuse[m] = all; break;
        case CA_REUSE_DENSITY: reuse[m] = limited(rules, path, m); break;
        case CA_REUSE_NORMALISED: reuse[m] = limited(rules, path, m) * all / mean_limited(rules, path); break;
        case CA_REUSE_FOOTPRINT: reuse[m] = footprint(rules, path, m); break;
        case CA_REUSE_CORRELATION: reuse[m] = correlation(rules, path, m); break;
        case CA_REUSE_KIND_COUNT: reuse[m] = (double)NAN; break;
        }
    }
}

/* ---- Techniques ------------------------------------------------------------------------------------------------ */

double ca_oracle_density(const ca_full_path *path, uint32_t k)
{
    double product = 1.0;
    for (uint32_t i = 0; i < path->n; i++) product *= (double)(i < k ? path->pdf_camera[i] : path->pdf_light[i]);
    return product;
}

static uint32_t smooth_up_to(const ca_full_path *path, uint32_t m)
{
    uint32_t count = 0;
    for (uint32_t i = 1; i <= m; i++) count += ca_full_path_is_smooth(path, i);
    return count;
}

static bool may_hit(const ca_mis_rules *rules, const ca_full_path *path)
{
    switch (rules->hit) {
    case CA_HIT_ALWAYS: return true;
    case CA_HIT_DIRECT: return path->n == 2;
    case CA_HIT_UNMERGEABLE: return smooth_up_to(path, path->n - 1) == 0;
    }
    return false;
}

static bool may_merge(const ca_mis_rules *rules, const ca_full_path *path, uint32_t m)
{
    if (!ca_full_path_is_smooth(path, m)) return false;
    const uint32_t ordinal = smooth_up_to(path, m), all = smooth_up_to(path, path->n - 1);
    switch (rules->merge) {
    case CA_MERGE_NONE: return false;
    case CA_MERGE_ALL: return ordinal <= rules->merge_limit;
    case CA_MERGE_LAST: return ordinal == (all < rules->merge_limit ? all : rules->merge_limit);
    }
    return false;
}

static double split_value(const ca_mis_rules *rules, const ca_full_path *path, uint32_t k)
{
    const uint32_t n = path->n;
    if (k == 0) return 0.0; /* nothing runs into the lens */
    if (k == n) return may_hit(rules, path) ? ca_oracle_density(path, k) : 0.0;
    if (n == 2) return 0.0;
    const bool left = ca_full_path_is_smooth(path, k - 1), right = ca_full_path_is_smooth(path, k);
    if (k == n - 1)
        return rules->next_event && left ? ca_oracle_density(path, k) * (double)path->next_event_ratio : 0.0;
    const double splats = (double)rules->splat_count * (double)path->splat_scale;
    if (k == 1) return rules->splat && right ? ca_oracle_density(path, k) * splats : 0.0;
    return rules->connect && left && right ? ca_oracle_density(path, k) : 0.0;
}

static uint32_t at_most_5(uint32_t vertices) { return vertices > 5 ? 5 : vertices; }

/* Of k camera vertices. */
static double split_factor(const ca_mis_rules *rules, const ca_full_path *path, uint32_t k)
{
    const ca_technique_factors *f = &path->factors;
    const uint32_t light = path->n - k;
    if (!rules->factors || k < 2) return 1.0;
    if (light == 0) return (double)f->hits[at_most_5(k)][path->light_class];
    if (light == 1) return (double)f->next_events[at_most_5(k)][path->light_class];
    return (double)f->connections[at_most_5(k)][at_most_5(light)];
}

static double merge_factor(const ca_mis_rules *rules, const ca_full_path *path, uint32_t m)
{
    return rules->factors ? (double)path->factors.merges[at_most_5(m + 1)][at_most_5(path->n - m - 1)] : 1.0;
}

void ca_oracle_techniques(const ca_mis_rules *rules, const ca_full_path *path, double *splits, double *merges)
{
    double reuse[CA_FULL_PATH_MAX];
    ca_oracle_reuse(&rules->reuse, path, reuse);
    for (uint32_t k = 0; k <= path->n; k++)
        splits[k] = split_value(rules, path, k) * split_factor(rules, path, k);
    for (uint32_t m = 0; m < path->n; m++) {
        merges[m] = 0.0;
        if (!may_merge(rules, path, m)) continue;
        const double both = ca_oracle_density(path, m + 1) * (double)path->pdf_light[m];
        merges[m] = both * (double)rules->merge_area * reuse[m] * merge_factor(rules, path, m);
    }
}

double ca_oracle_weight(const ca_mis_rules *rules, uint32_t n, const double *splits, const double *merges,
                        double value)
{
    const double beta = rules->power ? 2.0 : 1.0;
    double sum = 0.0;
    for (uint32_t k = 0; k <= n; k++) sum += pow(splits[k], beta);
    for (uint32_t m = 0; m < n; m++) sum += pow(merges[m], beta);
    return pow(value, beta) / sum;
}
