#include "render/method_weights.h"

#include "base/memory.h"

#include <math.h>

/* Cells on each side of one that count as around it. */
enum { AROUND = 2 };

static ca_status fail(ca_error *error) { return ca_fail_memory(error, "the trials"); }

ca_status ca_method_weights_create(ca_method_weights *weights, const ca_render_plan *plan, ca_error *error)
{
    *weights = (ca_method_weights){.plan = plan, .cells = ca_trial_cells_of(plan)};
    const size_t cells = ca_trial_cell_count(&weights->cells);
    weights->weights = ca_alloc_zeroed(cells, sizeof *weights->weights);
    weights->luminance = ca_alloc_zeroed(cells, sizeof *weights->luminance);
    if (weights->weights && weights->luminance) return CA_OK;
    ca_method_weights_destroy(weights);
    return fail(error);
}

void ca_method_weights_destroy(ca_method_weights *weights)
{
    ca_free(weights->weights);
    ca_free(weights->luminance);
    *weights = (ca_method_weights){.plan = NULL};
}

/* Over all iterations, of each cell: the light without what is shown, its squares, and what is shown. */
typedef struct light_sums {
    double *light, *squares, *shown;
    double iterations;
} light_sums;

static void add_up(const ca_method_trial *trials, uint32_t count, size_t cells, light_sums *sums)
{
    bool merges = false;
    for (uint32_t i = 0; i < count; i++) merges = merges || ca_method_merges(&trials[i].method);
    for (uint32_t i = 0; i < count; i++) {
        if (merges && !ca_method_merges(&trials[i].method)) continue;
        for (size_t c = 0; c < cells; c++) {
            sums->light[c] += ca_method_trial_sum(&trials[i], c);
            sums->squares[c] += ca_method_trial_squares(&trials[i], c);
            sums->shown[c] += ca_method_trial_shown(&trials[i], c);
        }
        sums->iterations += trials[i].iterations;
    }
}

/* The mean of (2 AROUND + 1)^2 cells, fewer at the border. */
static double around(const double *values, uint32_t width, uint32_t height, uint32_t x, uint32_t y)
{
    double sum = 0.0, count = 0.0;
    for (uint32_t v = y < AROUND ? 0 : y - AROUND; v <= y + AROUND && v < height; v++)
        for (uint32_t u = x < AROUND ? 0 : x - AROUND; u <= x + AROUND && u < width; u++)
            sum += values[(size_t)v * width + u], count++;
    return sum / count;
}

/* Of a cell, from its own mean and the one around it. Where chance has brought a cell one bright value it would seem
 * as bright as that, and not noisy for its light: its own mean counts as far as it is known, which is by its squared
 * relative error, 1 over the number of bright values. At an edge those around it are different, but less of them is
 * never right for a dark cell. */
static double luminance(double sum, double squares, double n, double nearby)
{
    const double mean = sum / n, square = mean * mean;
    const double error = n > 1.0 ? (squares / n - square) / (n - 1.0) : square;
    const double unknown = square > 0.0 ? fmin(1.0, error / square) : 0.0;
    return fmax(nearby, mean + unknown * (nearby - mean));
}

ca_status ca_method_weights_set(ca_method_weights *weights, const ca_method_trial *trials, uint32_t count,
                                ca_error *error)
{
    const uint32_t width = weights->cells.width, height = weights->cells.height;
    const size_t cells = ca_trial_cell_count(&weights->cells);
    double *all = ca_alloc_zeroed(3 * cells, sizeof *all);
    if (!all) return fail(error);
    light_sums sums = {.light = all, .squares = all + cells, .shown = all + 2 * cells};
    add_up(trials, count, cells, &sums);
    const double n = sums.iterations;
    for (uint32_t y = 0; y < height; y++)
        for (uint32_t x = 0; x < width; x++) {
            const size_t c = (size_t)y * width + x;
            const double other =
                luminance(sums.light[c], sums.squares[c], n, around(sums.light, width, height, x, y) / n);
            const double shown = fmax(sums.shown[c], around(sums.shown, width, height, x, y)) / n;
            const double here = other + shown;
            weights->luminance[c] = other;
            weights->weights[c] = 1.0 / (here * here + CA_METHOD_LEAST_SQUARE);
        }
    ca_free(all);
    return CA_OK;
}

double ca_method_weight_at(const void *weights, uint32_t x, uint32_t y)
{
    const ca_method_weights *w = weights;
    return w->weights[ca_trial_cell_at(&w->cells, w->plan, x, y)];
}

double ca_method_luminance_at(const void *weights, uint32_t x, uint32_t y)
{
    const ca_method_weights *w = weights;
    return w->luminance[ca_trial_cell_at(&w->cells, w->plan, x, y)];
}
