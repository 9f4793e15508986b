#include "integrator/radius_pilot.h"

#include <math.h>

/* Cells of the lattice, whose camera paths may find the same photons. */
enum { BLOCK = 4 };

/* The error is that of metrics/compare.h: relative to the square of light, plus this. */
#define LEAST_SQUARE 0.01

/* Of photons the least of what the levels say, with one photon more than they found: what lies near something bright
 * must not pass for bright. */
static double pixel_light(const ca_radius_probe *p, uint32_t cell)
{
    const ca_light_sums *sums = &p->lights[cell];
    double least = (double)INFINITY;
    for (uint32_t k = 0; k < CA_LENS_LEVELS; k++)
        if (sums->found[k] > 0) least = fmin(least, (double)sums->lens[k] * (1.0 + 1.0 / sums->found[k]));
    return ((isfinite(least) ? least : 0.0) + (double)sums->asked) / (2.0 * p->lighting);
}

/* Of what a pixel shows, as a camera path that merges nothing finds it: the variance of direct light that merges can
 * take, and that which stays: what camera paths differ by in direct light, and lights that they see. Without bias. */
typedef struct shown_noise {
    double taken, staying;
} shown_noise;

static double variance_of(double sum, double squares, double n) { return (squares - sum * sum / n) / (n - 1.0); }

static shown_noise noise_of(const ca_radius_probe *p, uint32_t cell)
{
    const ca_path_sums *a = &p->sums[0][cell], *b = &p->sums[1][cell];
    const ca_light_sums *lights = &p->lights[cell];
    const double n = 2.0 * p->lighting, merging = p->merging;
    const double shown = variance_of(lights->shown, lights->shown_squares, n);
    const double direct = variance_of(lights->direct, lights->direct_squares, n);
    const double camera = 0.5 * ((double)a->pairs + (double)b->pairs) / merging -
                          (double)a->alone * (double)b->alone / (merging * merging);
    return (shown_noise){.taken = direct - camera, .staying = shown - direct + camera};
}

/* What of direct light merges leave to others. */
static double left(const ca_path_sums *a, const ca_path_sums *b, uint32_t k)
{
    const double direct = (double)a->direct[k] + (double)b->direct[k];
    return direct > 0.0 ? 1.0 - ((double)a->weighted[k] + (double)b->weighted[k]) / direct : 1.0;
}

/* What a pixel's squares count for: they are of `merging` camera paths. */
static double relative_of(const ca_radius_probe *p, uint32_t cell)
{
    const double light = pixel_light(p, cell), cells = (double)p->columns * p->rows;
    return 1.0 / ((light * light + LEAST_SQUARE) * cells * p->merging);
}

/* Of all that is shown, but for what photons that are merged with bring; a camera path's counts as of the light paths
 * that it has. */
static double shown_variance(const ca_radius_probe *p, uint32_t k)
{
    double sum = 0.0;
    for (uint32_t cell = 0; cell < p->columns * p->rows; cell++) {
        const shown_noise noise = noise_of(p, cell);
        const double share = left(&p->sums[0][cell], &p->sums[1][cell], k);
        sum += relative_of(p, cell) * (share * share * noise.taken + noise.staying);
    }
    return fmax(sum, 0.0) * p->merging * (double)p->engine->rules.splat_count;
}

static void add_cell(const ca_radius_probe *p, uint32_t cell, ca_radius_curve *curve, double *changes)
{
    const ca_path_sums *a = &p->sums[0][cell], *b = &p->sums[1][cell];
    const double relative = relative_of(p, cell);
    for (uint32_t k = 0; k < p->level_count; k++) {
        curve->variance[k] += 0.5 * ((double)a->square[k] + (double)b->square[k]) * relative;
        changes[k] += (double)a->change[k] * (double)b->change[k] * relative / p->merging;
    }
}

/* A photon may be found from many cells, so that the noise of these is common: blocks of them tell the error. */
static void add_block(const ca_radius_probe *p, uint32_t left, uint32_t top, ca_radius_curve *curve)
{
    double changes[CA_RADIUS_LEVELS] = {0.0};
    for (uint32_t y = top; y < ca_min_u32(top + BLOCK, p->rows); y++)
        for (uint32_t x = left; x < ca_min_u32(left + BLOCK, p->columns); x++)
            add_cell(p, y * p->columns + x, curve, changes);
    for (uint32_t k = 0; k < p->level_count; k++) {
        curve->change[k] += changes[k];
        curve->change_error[k] += changes[k] * changes[k];
    }
}

bool ca_radius_make_curve(const ca_radius_probe *p, ca_radius_curve *curve)
{
    *curve = (ca_radius_curve){.count = p->level_count, .merging_alone = p->merging_alone};
    for (uint32_t y = 0; y < p->rows; y += BLOCK)
        for (uint32_t x = 0; x < p->columns; x += BLOCK) add_block(p, x, y, curve);
    for (uint32_t k = 0; k < p->level_count; k++) {
        curve->radius[k] = (double)p->levels[k].radius;
        curve->change_error[k] = sqrt(curve->change_error[k]);
        if (p->engine->rules.next_event) curve->variance[k] += shown_variance(p, k);
    }
    return curve->variance[0] > 0.0;
}
