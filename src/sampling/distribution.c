#include "sampling/distribution.h"

#include "base/memory.h"
#include "math/numeric.h"

#include <assert.h>

/* Cumulative sums are multiples of 2^-24, as the sampler's numbers are: a bin then is drawn exactly as often as its
 * probability says. */
static const double steps = 0x1p24;

static double sum_of(const float *weights, uint32_t count)
{
    double sum = 0.0;
    for (uint32_t i = 0; i < count; i++) {
        assert(weights[i] >= 0.0f && isfinite(weights[i]));
        sum += (double)weights[i];
    }
    return sum;
}

/* A bin of positive weight gets at least one step, so that nothing that may be drawn by another technique has a
 * density of 0 here: upwards from the left, then downwards from the right where that ran past 1. More positive bins
 * than steps cannot all have one. */
static void separate(float *cumulative, const float *weights, uint32_t count)
{
    uint32_t positive = 0;
    for (uint32_t i = 0; i < count; i++) positive += weights[i] > 0.0f;
    if ((double)positive > steps) return;
    for (uint32_t i = 0; i < count; i++) {
        const float least = cumulative[i] + (weights[i] > 0.0f ? 0x1p-24f : 0.0f);
        if (cumulative[i + 1] < least) cumulative[i + 1] = least;
    }
    float most = 1.0f;
    for (uint32_t i = count; i > 0; i--) {
        if (cumulative[i] > most) cumulative[i] = most;
        most = cumulative[i] - (weights[i - 1] > 0.0f ? 0x1p-24f : 0.0f);
    }
}

static void fill_cumulative(ca_distribution_1d *distribution, const float *weights, bool separated)
{
    const uint32_t count = distribution->count;
    double partial = 0.0;
    distribution->cumulative[0] = 0.0f;
    for (uint32_t i = 0; i < count; i++) {
        partial += (double)weights[i];
        const double end = distribution->sum > 0.0 ? partial / distribution->sum : (i + 1.0) / count;
        distribution->cumulative[i + 1] = (float)(rint(end * steps) / steps);
    }
    distribution->cumulative[count] = 1.0f;
    if (separated && distribution->sum > 0.0) separate(distribution->cumulative, weights, count);
}

static void fill_guide(ca_distribution_1d *distribution)
{
    const uint32_t count = distribution->count;
    uint32_t bin = 0;
    for (uint32_t i = 0; i < count; i++) {
        const double start = (double)i / count;
        while ((double)distribution->cumulative[bin + 1] <= start) bin++;
        distribution->guide[i] = bin;
    }
}

/* What the tables are to hold, from weights. */
static void fill(ca_distribution_1d *distribution, const float *weights, bool separated)
{
    distribution->sum = sum_of(weights, distribution->count);
    fill_cumulative(distribution, weights, separated);
    fill_guide(distribution);
}

static ca_status create(ca_distribution_1d *distribution, const float *weights, uint32_t count, bool separated,
                        ca_error *error)
{
    assert(count > 0);
    *distribution = (ca_distribution_1d){.count = count};
    distribution->cumulative = ca_alloc((size_t)count + 1, sizeof *distribution->cumulative);
    distribution->guide = ca_alloc(count, sizeof *distribution->guide);
    if (!distribution->cumulative || !distribution->guide) {
        ca_distribution_1d_destroy(distribution);
        return ca_fail_memory(error, "a sampling table");
    }
    fill(distribution, weights, separated);
    return CA_OK;
}

ca_status ca_distribution_1d_create(ca_distribution_1d *distribution, const float *weights, uint32_t count,
                                    ca_error *error)
{
    return create(distribution, weights, count, true, error);
}

ca_status ca_distribution_1d_create_nearest(ca_distribution_1d *distribution, const float *weights, uint32_t count,
                                            ca_error *error)
{
    return create(distribution, weights, count, false, error);
}

void ca_distribution_1d_destroy(ca_distribution_1d *distribution)
{
    ca_free(distribution->cumulative);
    ca_free(distribution->guide);
    *distribution = (ca_distribution_1d){0};
}

uint32_t ca_distribution_1d_sample(const ca_distribution_1d *distribution, float u, float *probability,
                                   float *remapped)
{
    assert(u >= 0.0f && u < 1.0f);
    const float *cumulative = distribution->cumulative;
    /* The product may round up to the next entry of the guide: then the bin is looked for downwards. */
    const uint32_t slot = ca_min_u32((uint32_t)(u * (float)distribution->count), distribution->count - 1);
    uint32_t bin = distribution->guide[slot];
    while (cumulative[bin] > u) bin--;
    while (cumulative[bin + 1] <= u) bin++;

    *probability = cumulative[bin + 1] - cumulative[bin];
    if (remapped) *remapped = ca_min((u - cumulative[bin]) / *probability, CA_ONE_MINUS_EPSILON);
    return bin;
}

float ca_distribution_1d_probability(const ca_distribution_1d *distribution, uint32_t bin)
{
    assert(bin < distribution->count);
    return distribution->cumulative[bin + 1] - distribution->cumulative[bin];
}

/* ---- Two dimensions -------------------------------------------------------------------------------------------- */

/* A row may sum up to more than a float holds only if its weights are that large: the mean always fits. */
static void fill_columns(ca_distribution_2d *distribution, const float *weights, float *row_means)
{
    const size_t width = distribution->width;
    for (uint32_t y = 0; y < distribution->height; y++) {
        ca_distribution_1d *column = &distribution->columns[y];
        *column = (ca_distribution_1d){.count = distribution->width,
                                       .cumulative = distribution->cumulative + y * (width + 1),
                                       .guide = distribution->guide + y * width};
        fill(column, weights + y * width, true);
        row_means[y] = (float)(column->sum / distribution->width);
    }
}

ca_status ca_distribution_2d_create(ca_distribution_2d *distribution, const float *weights, uint32_t width,
                                    uint32_t height, ca_error *error)
{
    assert(width > 0 && height > 0);
    *distribution = (ca_distribution_2d){.width = width, .height = height};
    distribution->columns = ca_alloc(height, sizeof *distribution->columns);
    distribution->cumulative = ca_alloc(height * ((size_t)width + 1), sizeof *distribution->cumulative);
    distribution->guide = ca_alloc(height * (size_t)width, sizeof *distribution->guide);
    float *row_means = ca_alloc(height, sizeof *row_means);
    ca_status status = CA_OK;
    if (!distribution->columns || !distribution->cumulative || !distribution->guide || !row_means) {
        status = ca_fail_memory(error, "a sampling table");
    } else {
        fill_columns(distribution, weights, row_means);
        status = ca_distribution_1d_create(&distribution->rows, row_means, height, error);
    }
    ca_free(row_means);
    if (status != CA_OK) ca_distribution_2d_destroy(distribution);
    return status;
}

void ca_distribution_2d_destroy(ca_distribution_2d *distribution)
{
    ca_free(distribution->columns);
    ca_free(distribution->cumulative);
    ca_free(distribution->guide);
    ca_distribution_1d_destroy(&distribution->rows);
    *distribution = (ca_distribution_2d){0};
}

/* Position of a bin's inner coordinate among `count` bins, kept below the next bin. */
static float bin_position(uint32_t bin, float inside, uint32_t count)
{
    const float position = ((float)bin + inside) / (float)count;
    return ca_min(position, CA_ONE_MINUS_EPSILON);
}

ca_bin_2d ca_distribution_2d_sample_bin(const ca_distribution_2d *distribution, ca_vec2 u)
{
    float row_probability, column_probability;
    ca_bin_2d bin;
    bin.row = ca_distribution_1d_sample(&distribution->rows, u.y, &row_probability, &bin.inside.y);
    bin.column =
        ca_distribution_1d_sample(&distribution->columns[bin.row], u.x, &column_probability, &bin.inside.x);
    bin.probability = row_probability * column_probability;
    return bin;
}

float ca_distribution_2d_bin_probability(const ca_distribution_2d *distribution, uint32_t column, uint32_t row)
{
    return ca_distribution_1d_probability(&distribution->rows, row) *
           ca_distribution_1d_probability(&distribution->columns[row], column);
}

ca_vec2 ca_distribution_2d_sample(const ca_distribution_2d *distribution, ca_vec2 u, float *density)
{
    const ca_bin_2d bin = ca_distribution_2d_sample_bin(distribution, u);
    *density = bin.probability * ((float)distribution->height * (float)distribution->width);
    return (ca_vec2){bin_position(bin.column, bin.inside.x, distribution->width),
                     bin_position(bin.row, bin.inside.y, distribution->height)};
}

static uint32_t bin_of(float position, uint32_t count)
{
    const float scaled = position * (float)count;
    return scaled > 0.0f ? ca_min_u32((uint32_t)scaled, count - 1) : 0;
}

float ca_distribution_2d_density(const ca_distribution_2d *distribution, ca_vec2 point)
{
    const uint32_t row = bin_of(point.y, distribution->height), column = bin_of(point.x, distribution->width);
    return ca_distribution_2d_bin_probability(distribution, column, row) *
           ((float)distribution->height * (float)distribution->width);
}
