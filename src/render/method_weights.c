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

/* The mean of (2 AROUND + 1)^2 cells, fewer at the border. */
static double blurred(const double *values, uint32_t width, uint32_t height, uint32_t x, uint32_t y)
{
    double sum = 0.0, count = 0.0;
    for (uint32_t v = y < AROUND ? 0 : y - AROUND; v <= y + AROUND && v < height; v++)
        for (uint32_t u = x < AROUND ? 0 : x - AROUND; u <= x + AROUND && u < width; u++)
            sum += values[(size_t)v * width + u], count++;
    return sum / count;
}

/* Of the mean iteration. A cell's own value is noisy, and those around it are different at an edge. */
static void smooth(const ca_trial_cells *cells, double iterations, const double *sums, double *luminance)
{
    for (uint32_t y = 0; y < cells->height; y++)
        for (uint32_t x = 0; x < cells->width; x++) {
            const size_t cell = (size_t)y * cells->width + x;
            luminance[cell] = fmax(sums[cell], blurred(sums, cells->width, cells->height, x, y)) / iterations;
        }
}

/* The sums of the trials' cells: light without what is shown, and all. */
static double add_up(const ca_method_trial *trials, uint32_t count, size_t cells, double *other, double *all)
{
    bool merges = false;
    double iterations = 0.0;
    for (uint32_t i = 0; i < count; i++) merges = merges || ca_method_merges(&trials[i].method);
    for (uint32_t i = 0; i < count; i++) {
        if (merges && !ca_method_merges(&trials[i].method)) continue;
        for (size_t c = 0; c < cells; c++) {
            const double sum = ca_method_trial_sum(&trials[i], c);
            other[c] += sum;
            all[c] += sum + ca_method_trial_shown(&trials[i], c);
        }
        iterations += trials[i].iterations;
    }
    return iterations;
}

ca_status ca_method_weights_set(ca_method_weights *weights, const ca_method_trial *trials, uint32_t count,
                                ca_error *error)
{
    const size_t cells = ca_trial_cell_count(&weights->cells);
    double *sums = ca_alloc_zeroed(2 * cells, sizeof *sums), *all = sums + cells;
    if (!sums) return fail(error);
    const double iterations = add_up(trials, count, cells, sums, all);
    smooth(&weights->cells, iterations, sums, weights->luminance);
    smooth(&weights->cells, iterations, all, weights->weights);
    for (size_t c = 0; c < cells; c++)
        weights->weights[c] = 1.0 / (weights->weights[c] * weights->weights[c] + CA_METHOD_LEAST_SQUARE);
    ca_free(sums);
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
