#include "metrics/separable.h"

#include <string.h>

uint32_t ca_border_index(ca_border border, int64_t i, uint32_t count)
{
    if (border == CA_BORDER_REPEAT) return i < 0 ? 0 : i >= (int64_t)count ? count - 1 : (uint32_t)i;
    const int64_t period = 2 * (int64_t)count;
    const int64_t in_period = ((i % period) + period) % period;
    return (uint32_t)(in_period < (int64_t)count ? in_period : period - 1 - in_period);
}

static void add_row(const float *restrict row, double weight, uint32_t width, double *restrict sum)
{
    for (uint32_t x = 0; x < width; x++) sum[x] += weight * (double)row[x];
}

static void add_product_row(const float *row, const float *times, double weight, uint32_t width, double *restrict sum)
{
    for (uint32_t x = 0; x < width; x++) sum[x] += weight * ((double)row[x] * (double)times[x]);
}

void ca_filter_columns(const ca_filter_source *source, uint32_t y, const ca_kernel *kernel, uint32_t margin,
                       double *filtered)
{
    double *inside = filtered + margin;
    memset(inside, 0, source->width * sizeof *inside);
    for (uint32_t k = 0; k <= 2 * kernel->radius; k++) {
        const int64_t row = (int64_t)y + (int64_t)k - (int64_t)kernel->radius;
        const size_t start = (size_t)ca_border_index(source->border, row, source->height) * source->width;
        if (source->times)
            add_product_row(source->plane + start, source->times + start, kernel->weights[k], source->width, inside);
        else
            add_row(source->plane + start, kernel->weights[k], source->width, inside);
    }
    for (uint32_t i = 1; i <= margin; i++) {
        inside[-(ptrdiff_t)i] = inside[ca_border_index(source->border, -(int64_t)i, source->width)];
        inside[source->width - 1 + i] =
            inside[ca_border_index(source->border, (int64_t)source->width - 1 + (int64_t)i, source->width)];
    }
}

static void add_shifted(const double *restrict shifted, double weight, uint32_t width, double *restrict result)
{
    for (uint32_t x = 0; x < width; x++) result[x] += weight * shifted[x];
}

void ca_filter_row(const double *filtered, uint32_t width, const ca_kernel *kernel, double *result)
{
    memset(result, 0, width * sizeof *result);
    for (uint32_t k = 0; k <= 2 * kernel->radius; k++) add_shifted(filtered + k, kernel->weights[k], width, result);
}
