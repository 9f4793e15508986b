#include "render/cost_fit.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

enum { HUBER_STEPS = 6, TUKEY_STEPS = 10 };

/* Samples further off than this many standard deviations weigh less; in Tukey's weights, nothing. Both keep 95 % of
 * the efficiency of least squares where the scatter is normal. */
#define HUBER_LIMIT 1.345
#define TUKEY_LIMIT 4.685

/* A single sample shows no scatter: the samples count together with one of a relative scatter of a tenth. */
#define SCATTER_GUESS 0.1
#define SCATTER_GUESS_COUNT 1.0

/* Weighted sums of squares and products: of relative units u / y and of u / y with 1. */
typedef struct normal_equations {
    double a00, a01, a11, b0, b1;
} normal_equations;

typedef struct fit_state {
    const ca_cost_sample *samples;
    size_t count;
    double prior[2], prior_weight[2]; /* of each cost */
    double cost[2];
    double scatter; /* relative standard deviation of a sample */
    double effective_count;
    normal_equations sums;
} fit_state;

static double seconds_of(const ca_cost_sample *sample, const double cost[2])
{
    return sample->units[0] * cost[0] + sample->units[1] * cost[1];
}

/* 0 where the costs say that the sample took no time. */
static double deviation(const ca_cost_sample *sample, const double cost[2])
{
    const double expected = seconds_of(sample, cost);
    return expected > 0.0 ? sample->seconds / expected - 1.0 : 0.0;
}

static int by_size(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* From the median deviation, which half of the samples may spoil. */
static double robust_scatter(const fit_state *f, double *scratch)
{
    for (size_t i = 0; i < f->count; i++) scratch[i] = fabs(deviation(&f->samples[i], f->cost));
    qsort(scratch, f->count, sizeof *scratch, by_size);
    const double of_normal = 1.4826 * scratch[f->count / 2], n = (double)f->count;
    return sqrt((of_normal * of_normal * n + SCATTER_GUESS * SCATTER_GUESS * SCATTER_GUESS_COUNT) /
                (n + SCATTER_GUESS_COUNT));
}

static double weight_of(double deviations, bool tukey)
{
    const double size = fabs(deviations);
    if (!tukey) return size <= HUBER_LIMIT ? 1.0 : HUBER_LIMIT / size;
    const double inside = 1.0 - (size / TUKEY_LIMIT) * (size / TUKEY_LIMIT);
    return size < TUKEY_LIMIT ? inside * inside : 0.0;
}

/* Sums with the weights that the costs so far give. */
static void sum_up(fit_state *f, bool tukey)
{
    f->sums = (normal_equations){0};
    f->effective_count = 0.0;
    for (size_t i = 0; i < f->count; i++) {
        const ca_cost_sample *s = &f->samples[i];
        const double expected = seconds_of(s, f->cost);
        if (!(expected > 0.0)) continue;
        const double weight = weight_of(deviation(s, f->cost) / f->scatter, tukey);
        const double u0 = s->units[0] / expected, u1 = s->units[1] / expected, y = s->seconds / expected;
        f->sums.a00 += weight * u0 * u0;
        f->sums.a01 += weight * u0 * u1;
        f->sums.a11 += weight * u1 * u1;
        f->sums.b0 += weight * u0 * y;
        f->sums.b1 += weight * u1 * y;
        f->effective_count += weight;
    }
    /* The prior as two more samples, of one kind of work each. */
    const double variance = f->scatter * f->scatter;
    f->sums.a00 += variance * f->prior_weight[0];
    f->sums.b0 += variance * f->prior_weight[0] * f->prior[0];
    f->sums.a11 += variance * f->prior_weight[1];
    f->sums.b1 += variance * f->prior_weight[1] * f->prior[1];
}

/* The smallest sum of squares with costs of at least 0: inside, or on the border of the one that would be
 * negative. */
static void solve(const normal_equations *n, double cost[2])
{
    const double determinant = n->a00 * n->a11 - n->a01 * n->a01;
    cost[0] = (n->b0 * n->a11 - n->b1 * n->a01) / determinant;
    cost[1] = (n->b1 * n->a00 - n->b0 * n->a01) / determinant;
    if (cost[1] < 0.0) {
        cost[0] = n->b0 / n->a00;
        cost[1] = 0.0;
    } else if (cost[0] < 0.0) {
        cost[0] = 0.0;
        cost[1] = n->b1 / n->a11;
    }
}

static void refine(fit_state *f, double *scratch, bool tukey)
{
    double cost[2];
    f->scatter = robust_scatter(f, scratch);
    sum_up(f, tukey);
    solve(&f->sums, cost);
    if (!isfinite(cost[0]) || !isfinite(cost[1]) || !(cost[0] + cost[1] > 0.0)) return;
    f->cost[0] = cost[0];
    f->cost[1] = cost[1];
}

/* One kind of work only: its time over its number, the other unknown. */
static ca_cost_fit without(int missing, ca_cost_fit fit)
{
    fit.cost[missing] = fit.error[missing] = (double)NAN;
    return fit;
}

ca_cost_fit ca_fit_costs(const ca_cost_sample *samples, size_t count, ca_cost_guess guess, double *scratch)
{
    const double unknown = (double)NAN;
    double units[2] = {0.0, 0.0}, seconds = 0.0;
    for (size_t i = 0; i < count; i++) {
        for (int k = 0; k < 2; k++) units[k] += samples[i].units[k];
        seconds += samples[i].seconds;
    }
    if (!(seconds > 0.0) || !(units[0] > 0.0)) return (ca_cost_fit){{unknown, unknown}, {unknown, unknown}};
    /* The cost of the first kind if the prior is right: the starting value, and the scale of the prior. */
    const double start = seconds / (units[0] + guess.ratio * units[1]), unsure = guess.deviation * start;
    fit_state f = {.samples = samples,
                   .count = count,
                   .prior = {start, guess.ratio * start},
                   .prior_weight = {1.0 / (start * start), 1.0 / (unsure * unsure)},
                   .cost = {start, guess.ratio * start}};
    for (int i = 0; i < HUBER_STEPS; i++) refine(&f, scratch, false);
    for (int i = 0; i < TUKEY_STEPS; i++) refine(&f, scratch, true);
    const normal_equations *n = &f.sums;
    const double determinant = n->a00 * n->a11 - n->a01 * n->a01;
    const ca_cost_fit fit = {
        .cost = {f.cost[0], f.cost[1]},
        .error = {f.scatter * sqrt(n->a11 / determinant), f.scatter * sqrt(n->a00 / determinant)}};
    return units[1] > 0.0 ? fit : without(1, fit);
}
