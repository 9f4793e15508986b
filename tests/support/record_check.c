#include "support/record_check.h"

#include "support/mis_oracle.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

/* ---- What is compared ------------------------------------------------------------------------------------------ */

/* The numbers of a path that are compared: the count * density of every technique as a share of all together, and the
 * weight of the one that found it. */
typedef struct technique_values {
    double splits[CA_FULL_PATH_MAX + 1], merges[CA_FULL_PATH_MAX], weight;
} technique_values;

static void make_shares(uint32_t n, technique_values *v)
{
    double sum = 0.0;
    for (uint32_t k = 0; k <= n; k++) sum += v->splits[k];
    for (uint32_t m = 0; m < n; m++) sum += v->merges[m];
    if (sum == 0.0) return;
    for (uint32_t k = 0; k <= n; k++) v->splits[k] /= sum;
    for (uint32_t m = 0; m < n; m++) v->merges[m] /= sum;
}

static technique_values values_of_engine(const ca_observed_path *observed)
{
    technique_values v;
    ca_mis_densities(observed->rules, observed->path, observed->technique, v.splits, v.merges);
    make_shares(observed->path->camera.count + observed->path->light.count, &v);
    return v;
}

static technique_values values_of_points(const ca_mis_rules *rules, const traced_path *path, ca_technique technique)
{
    technique_values v;
    ca_full_path full;
    traced_path_recompute(path, &full);
    ca_oracle_techniques(rules, &full, v.splits, v.merges);
    const double own = technique == CA_TECHNIQUE_MERGE ? v.merges[path->split - 1] : v.splits[path->split];
    v.weight = own > 0.0 ? ca_oracle_weight(rules, path->n, v.splits, v.merges, own) : 0.0;
    make_shares(path->n, &v);
    return v;
}

/* |log of the ratio|; 0 where both are nothing, INFINITY where one is. */
static double deviation(double got, double expected)
{
    const double least = 1e-30;
    if (got < least && expected < least) return 0.0;
    if (!(got >= least && expected >= least && got < 1e300 && expected < 1e300)) return (double)INFINITY;
    return fabs(log(got / expected));
}

/* Deviations of all numbers; the largest is the result. */
static double deviations(uint32_t n, const technique_values *got, const technique_values *expected,
                         technique_values *each)
{
    double largest = 0.0;
    for (uint32_t k = 0; k <= n; k++)
        largest = fmax(largest, each->splits[k] = deviation(got->splits[k], expected->splits[k]));
    for (uint32_t m = 0; m < n; m++)
        largest = fmax(largest, each->merges[m] = deviation(got->merges[m], expected->merges[m]));
    each->weight = fabs(got->weight - expected->weight);
    return fmax(largest, each->weight);
}

/* ---- Conditioning ---------------------------------------------------------------------------------------------- */

static void displace(traced_path *path, uint32_t i, int axis, double by)
{
    path->facing_camera[i] = dv_madd(path->facing_camera[i], by, dv_axis(axis));
    path->facing_light[i] = dv_madd(path->facing_light[i], by, dv_axis(axis));
}

static void add_values(uint32_t n, const technique_values *more, technique_values *sum)
{
    for (uint32_t k = 0; k <= n; k++) sum->splits[k] += more->splits[k];
    for (uint32_t m = 0; m < n; m++) sum->merges[m] += more->merges[m];
    sum->weight += more->weight;
}

/* How far each number moves, to first order, when every point is displaced along every axis, to and fro, by what the
 * engine's rounding may have displaced it. */
static technique_values conditioning(const ca_mis_rules *rules, const traced_path *path, ca_technique technique)
{
    const technique_values centre = values_of_points(rules, path, technique);
    technique_values sum = {.weight = 0.0};
    for (uint32_t i = 0; i < path->n; i++)
        for (int side = 0; side < 6; side++) {
            traced_path moved = *path;
            technique_values each;
            displace(&moved, i, side / 2, traced_path_uncertainty(path, i) * (side % 2 ? 0.5 : -0.5));
            const technique_values there = values_of_points(rules, &moved, technique);
            deviations(path->n, &there, &centre, &each);
            add_values(path->n, &each, &sum);
        }
    return sum;
}

/* The normals that directions are measured against are rounded as well. */
#define SLACK 2.0

static bool within(uint32_t n, const technique_values *each, const technique_values *bound)
{
    for (uint32_t k = 0; k <= n; k++)
        if (!(each->splits[k] <= CHECK_TOLERANCE + SLACK * bound->splits[k])) return false;
    for (uint32_t m = 0; m < n; m++)
        if (!(each->merges[m] <= CHECK_TOLERANCE + SLACK * bound->merges[m])) return false;
    return each->weight <= CHECK_TOLERANCE + SLACK * bound->weight;
}

/* ---- One path -------------------------------------------------------------------------------------------------- */

static void complain(record_check *c, const ca_observed_path *observed, const traced_path *path, const char *what)
{
    if (c->failures++ > 3) return;
    print_error("%s, %s, %s with s = %u, n = %u: %s\n", c->scene_name, c->integrator,
                ca_technique_name(observed->technique), path->split, path->n, what);
}

static void show_values(uint32_t n, const technique_values *got, const technique_values *expected,
                        const technique_values *bound)
{
    for (uint32_t k = 0; k <= n; k++)
        if (deviation(got->splits[k], expected->splits[k]) > CHECK_TOLERANCE)
            print_error("    split %u: %.9g, from the points %.9g +- %.2g\n", k, got->splits[k], expected->splits[k],
                        expected->splits[k] * bound->splits[k]);
    for (uint32_t m = 0; m < n; m++)
        if (deviation(got->merges[m], expected->merges[m]) > CHECK_TOLERANCE)
            print_error("    merge %u: %.9g, from the points %.9g +- %.2g\n", m, got->merges[m], expected->merges[m],
                        expected->merges[m] * bound->merges[m]);
    print_error("    weight %.9g, from the points %.9g +- %.2g\n", got->weight, expected->weight, bound->weight);
}

/* Kinds of events as the record has them; `path` weighs none but smooth ones. */
static bool kinds_agree(const ca_observed_path *observed, const traced_path *path)
{
    const ca_mis_path *record = observed->path;
    const uint32_t s = record->camera.count, t = record->light.count, n = s + t;
    if (!record->camera.vertices) return !path->dirac[1];
    const uint32_t known = observed->technique == CA_TECHNIQUE_MERGE ? t : t > 0 ? t - 1 : 0;
    for (uint32_t i = 1; i + 1 < s; i++)
        if (record->camera.vertices[i].connectable == path->dirac[i]) return false;
    for (uint32_t i = 1; i < known; i++)
        if (record->light.vertices[i].connectable == path->dirac[n - 1 - i]) return false;
    return true;
}

static bool tells_of_dirac(const traced_path *path, const technique_values *v)
{
    bool dirac = false;
    uint32_t techniques = 0;
    for (uint32_t i = 1; i + 1 < path->n; i++) dirac = dirac || path->dirac[i];
    for (uint32_t k = 0; k <= path->n; k++) techniques += v->splits[k] > 0.0;
    for (uint32_t m = 0; m < path->n; m++) techniques += v->merges[m] > 0.0;
    return dirac && techniques > 1;
}

static void compare(record_check *c, const ca_observed_path *observed, const traced_path *path)
{
    record_tally *t = c->tally;
    const ca_technique technique = observed->technique;
    const technique_values expected = values_of_points(observed->rules, path, technique);
    technique_values got = expected, each;
    if (!c->weight_alone) got = values_of_engine(observed);
    got.weight = (double)observed->weight;
    const double largest = deviations(path->n, &got, &expected, &each);
    t->checked[technique]++;
    t->dirac[technique] += tells_of_dirac(path, &expected);
    t->of_light[path->light->kind]++;
    t->of_camera[path->camera->kind]++;
    if (c->camera->kind == CA_CAMERA_PANELS) t->of_camera[CA_CAMERA_PANELS]++;
    if (largest <= CHECK_TOLERANCE) return;
    t->loose[technique]++;
    t->loosest[technique] = fmax(t->loosest[technique], largest);
    const technique_values bound = conditioning(observed->rules, path, technique);
    if (within(path->n, &each, &bound)) return;
    complain(c, observed, path, "the record disagrees with the points");
    if (c->failures <= 4) show_values(path->n, &got, &expected, &bound);
}

void check_record(record_check *c, const ca_observed_path *observed)
{
    traced_path path;
    const char *complaint = NULL;
    assert_true(traced_path_read(observed, c->scene, c->camera, c->guide, c->density, c->density_user, &path));
    path.by_differences = c->by_differences;
    path.uniform = c->uniform;
    if (!traced_path_find_events(&path, observed->technique, &complaint))
        complain(c, observed, &path, complaint);
    else if (!kinds_agree(observed, &path))
        complain(c, observed, &path, "an event is of another kind");
    else
        compare(c, observed, &path);
}
