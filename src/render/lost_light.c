#include "render/lost_light.h"

#include "film/confidence.h"

#include <math.h>
#include <stdlib.h>

ca_batch_ratio ca_batch_ratio_of(const double *parts, const double *wholes, uint32_t batches)
{
    double part = 0.0, whole = 0.0, squares = 0.0;
    for (uint32_t b = 0; b < batches; b++) part += parts[b], whole += wholes[b];
    if (!(whole > 0.0)) return (ca_batch_ratio){(double)NAN, (double)NAN, (double)NAN};
    const double value = part / whole;
    for (uint32_t b = 0; b < batches; b++) {
        const double residual = parts[b] - value * wholes[b];
        squares += residual * residual;
    }
    const double error = sqrt(squares * batches / (batches - 1.0)) / whole;
    const double reach = ca_student_two_sided_quantile(0.05, batches - 1.0) * error;
    return (ca_batch_ratio){value, value - reach, value + reach};
}

static int order(double a, double b) { return (a > b) - (a < b); }

/* First those where a sample of the render brings most. Equal ones by all they are. */
static int compare(const void *left, const void *right)
{
    const ca_light_sample *a = left, *b = right;
    const int by_rarity = order(a->expected / a->light, b->expected / b->light);
    if (by_rarity != 0) return by_rarity;
    const int by_light = order(a->light, b->light);
    if (by_light != 0) return by_light;
    const int by_batch = order(a->batch, b->batch), by_row = order(a->y, b->y);
    return by_batch != 0 ? by_batch : by_row != 0 ? by_row : order(a->x, b->x);
}

ca_batch_ratio ca_lost_light(ca_light_sample *samples, size_t count)
{
    double lost[CA_LIGHT_BATCHES] = {0.0}, all[CA_LIGHT_BATCHES] = {0.0}, expected = 0.0;
    if (count > 0) qsort(samples, count, sizeof *samples, compare);
    for (size_t i = 0; i < count; i++) {
        const ca_light_sample *s = &samples[i];
        all[s->batch] += s->light;
        expected += s->expected;
        if (expected < 1.0) lost[s->batch] += s->light;
    }
    ca_batch_ratio share = ca_batch_ratio_of(lost, all, CA_LIGHT_BATCHES);
    if (isnan(share.value)) return share;
    share.low = fmax(share.low, 0.0);
    share.high = fmin(share.high, 1.0);
    return share;
}
