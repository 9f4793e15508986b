#include "integrator/radius_pilot.h"

#include <math.h>

/* Cells along the side of small and of large blocks, whose camera paths may find the same photons. */
enum { BLOCK = 4, LARGE_BLOCK = 13 };

/* The error is that of metrics/compare.h: relative to the square of light, plus this. */
#define LEAST_SQUARE 0.01

/* Standard errors that photons within half a radius are off by at most where light is even. */
#define EVEN 2.0

/* ---- A pixel's light ------------------------------------------------------------------------------------------- */

/* Of photons within the largest radius that is not at odds with half of it: what lies near something bright must not
 * pass for bright, nor what has few photons by chance for dark. */
static double lens_light(const ca_radius_probe *p, const ca_light_sums *sums)
{
    uint32_t k = ca_min_u32(CA_LENS_LEVELS, p->level_count) - 1;
    for (; k > 0; k--) {
        const double all = (double)sums->found[k] / p->lighting, inner = (double)sums->found[k - 1] / p->lighting;
        const double error = sqrt(3.0 / 16.0 * all + 0.25); /* of a quarter of all; and one photon by half */
        if (fabs(inner - 0.25 * all) <= EVEN * error) break;
    }
    return (double)sums->lens[k] / p->lighting;
}

/* What a pixel's squares count for: they are of `merging` camera paths. */
static void find_relatives(ca_radius_probe *p)
{
    const uint32_t cells = p->columns * p->rows;
    for (uint32_t cell = 0; cell < cells; cell++) {
        const double light = lens_light(p, &p->lights[cell]) + p->lights[cell].asked / p->lighting;
        p->relative[cell] = 1.0 / ((light * light + LEAST_SQUARE) * cells * p->merging);
    }
}

/* ---- Variance -------------------------------------------------------------------------------------------------- */

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
    const double n = p->lighting, merging = p->merging;
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

/* Of all that is shown, but for what photons that are merged with bring; a camera path's counts as of the light paths
 * that it has. */
static double shown_variance(const ca_radius_probe *p, uint32_t k)
{
    double sum = 0.0;
    for (uint32_t cell = 0; cell < p->columns * p->rows; cell++) {
        const shown_noise noise = noise_of(p, cell);
        const double share = left(&p->sums[0][cell], &p->sums[1][cell], k);
        sum += p->relative[cell] * (share * share * noise.taken + noise.staying);
    }
    return fmax(sum, 0.0) * p->merging * (double)p->engine->rules.splat_count;
}

static double variance_at_level(const ca_radius_probe *p, uint32_t k)
{
    double sum = p->engine->rules.next_event ? shown_variance(p, k) : 0.0;
    for (uint32_t cell = 0; cell < p->columns * p->rows; cell++) {
        const float *a = p->sums[0][cell].square, *b = p->sums[1][cell].square;
        sum += 0.5 * ((double)a[k] + (double)b[k]) * p->relative[cell];
    }
    return sum;
}

/* ---- Blur ------------------------------------------------------------------------------------------------------ */

/* Of a block: the change; and a number as noisy as that, whose mean is none, as both sets have the same one. */
typedef struct block_sums {
    double change, noise;
} block_sums;

static block_sums sum_block(const ca_radius_probe *p, uint32_t k, uint32_t left, uint32_t top, uint32_t side)
{
    block_sums sums = {0};
    for (uint32_t y = top; y < ca_min_u32(top + side, p->rows); y++)
        for (uint32_t x = left; x < ca_min_u32(left + side, p->columns); x++) {
            const uint32_t cell = y * p->columns + x;
            const double a = (double)p->sums[0][cell].change[k], b = (double)p->sums[1][cell].change[k];
            sums.change += a * b * p->relative[cell] / p->merging;
            sums.noise += 0.5 * (a * a - b * b) * p->relative[cell] / p->merging;
        }
    return sums;
}

/* Over all blocks: their sums, and the roots of the sums of their squares. */
typedef struct film_sums {
    double change, change_root, noise_root;
} film_sums;

static film_sums sum_film(const ca_radius_probe *p, uint32_t k, uint32_t side)
{
    double change = 0.0, changes = 0.0, noises = 0.0;
    for (uint32_t y = 0; y < p->rows; y += side)
        for (uint32_t x = 0; x < p->columns; x += side) {
            const block_sums sums = sum_block(p, k, x, y, side);
            change += sums.change;
            changes += sums.change * sums.change;
            noises += sums.noise * sums.noise;
        }
    return (film_sums){.change = change, .change_root = sqrt(changes), .noise_root = sqrt(noises)};
}

/* A photon may be found from many cells, so that the noise of these is common. Small blocks tell the error of that
 * within them and of what their cells happen to lie on, large ones that of photons that many of these find. */
bool ca_radius_make_curve(ca_radius_probe *p, ca_radius_curve *curve)
{
    *curve = (ca_radius_curve){.count = p->level_count, .merging_alone = p->merging_alone};
    find_relatives(p);
    for (uint32_t k = 0; k < p->level_count; k++) {
        const film_sums small = sum_film(p, k, BLOCK), large = sum_film(p, k, LARGE_BLOCK);
        curve->radius[k] = (double)p->levels[k].radius;
        curve->variance[k] = variance_at_level(p, k);
        curve->change[k] = small.change;
        curve->change_error[k] = fmax(small.change_root, large.noise_root);
    }
    return curve->variance[0] > 0.0;
}
