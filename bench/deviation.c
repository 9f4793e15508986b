#include "deviation.h"

#include "base/parallel.h"
#include "base/processors.h"
#include "bench_support.h"
#include "sampling/sampler.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static size_t pixels_of(const batches *b) { return (size_t)b->width * b->height; }

bool batches_create(batches *b, uint32_t width, uint32_t height, uint32_t iterations)
{
    *b = (batches){.width = width, .height = height, .iterations = iterations};
    b->mean = calloc(BATCHES * pixels_of(b), sizeof *b->mean);
    b->mean_square = calloc(BATCHES * pixels_of(b), sizeof *b->mean_square);
    return b->mean && b->mean_square;
}

void batches_destroy(batches *b)
{
    free(b->mean);
    free(b->mean_square);
    *b = (batches){0};
}

/* Of one pixel, batch i counting count[i] times, BATCHES in all. */
static double pixel_deviation(const batches *b, size_t pixel, const uint32_t count[BATCHES])
{
    double mean = 0.0, square = 0.0;
    for (int i = 0; i < BATCHES; i++) {
        mean += count[i] * b->mean[pixel * BATCHES + (size_t)i];
        square += count[i] * b->mean_square[pixel * BATCHES + (size_t)i];
    }
    mean /= BATCHES;
    square /= BATCHES;
    const double n = (double)BATCHES * b->iterations;
    return sqrt(fmax(0.0, square - mean * mean) * n / (n - 1.0));
}

void batches_deviation(const batches *b, double *deviation)
{
    uint32_t once[BATCHES];
    for (int i = 0; i < BATCHES; i++) once[i] = 1;
    for (size_t p = 0; p < pixels_of(b); p++) deviation[p] = pixel_deviation(b, p, once);
}

void batches_mean(const batches *b, double *mean)
{
    for (size_t p = 0; p < pixels_of(b); p++) {
        mean[p] = 0.0;
        for (size_t i = 0; i < BATCHES; i++) mean[p] += b->mean[p * BATCHES + i] / BATCHES;
    }
}

void bootstrap_draw(bootstrap_table *table, uint64_t seed)
{
    memset(table, 0, sizeof *table);
    for (int i = 0; i < BATCHES; i++) table->count[0][i] = 1;
    for (uint32_t sample = 1; sample <= BOOTSTRAP; sample++)
        for (uint32_t i = 0; i < BATCHES; i++) {
            const uint64_t bits = ca_pcg_permute(ca_pcg_permute(seed + sample) + i);
            table->count[sample][(bits >> 32) * BATCHES >> 32]++;
        }
}

typedef struct deviation_job {
    const batches *b;
    const bool *mask;
    const bootstrap_table *table;
    double *values;
} deviation_job;

static void deviate(void *user, uint32_t sample, uint32_t worker)
{
    (void)worker;
    const deviation_job *job = user;
    double sum = 0.0;
    size_t count = 0;
    for (size_t p = 0; p < pixels_of(job->b); p++) {
        if (!job->mask[p]) continue;
        sum += pixel_deviation(job->b, p, job->table->count[sample]);
        count++;
    }
    job->values[sample] = count > 0 ? sum / (double)count : 0.0;
}

void mean_deviation(const batches *b, const bool *mask, const bootstrap_table *table, double values[1 + BOOTSTRAP])
{
    const ca_parallel parallel = {.workers = ca_processors()};
    deviation_job job = {b, mask, table, values};
    ca_error error;
    if (ca_parallel_for(&parallel, 1 + BOOTSTRAP, deviate, &job, &error) != CA_OK) bench_die("deviations", &error);
}

/* Percentiles of bootstrap samples would lie too low, for a resampled variance misses some of the rare bright
 * samples; their spread around their own mean is what is of use. Student's quantile for 19 degrees of freedom, and
 * the bootstrap's own factor for so few. */
figure figure_of(const double values[1 + BOOTSTRAP])
{
    double mean = 0.0, variance = 0.0;
    for (int i = 1; i <= BOOTSTRAP; i++) mean += values[i] / BOOTSTRAP;
    for (int i = 1; i <= BOOTSTRAP; i++) variance += (values[i] - mean) * (values[i] - mean) / (BOOTSTRAP - 1);
    return (figure){values[0], 2.093 * sqrt(variance * BATCHES / (BATCHES - 1))};
}

figure figure_of_ratio(const double numerator[1 + BOOTSTRAP], const double denominator[1 + BOOTSTRAP])
{
    double ratio[1 + BOOTSTRAP];
    for (int i = 0; i <= BOOTSTRAP; i++) ratio[i] = denominator[i] > 0.0 ? numerator[i] / denominator[i] : 0.0;
    return figure_of(ratio);
}

typedef struct block {
    uint32_t x, y;
} block;

/* Adds the block's values of each batch, without pixels left out. */
static void add_block(const batches *b, const double *values, double sign, const bool *left_out, block at,
                      double sums[BATCHES])
{
    for (uint32_t y = at.y; y < at.y + BLOCK_SIDE && y < b->height; y++)
        for (uint32_t x = at.x; x < at.x + BLOCK_SIDE && x < b->width; x++) {
            const size_t p = (size_t)y * b->width + x;
            if (left_out[p]) continue;
            for (size_t i = 0; i < BATCHES; i++) sums[i] += sign * values[p * BATCHES + i];
        }
}

/* Difference to the reference and two standard errors of it, both over the reference; zeros where that is black. */
static figure block_difference(const batches *b, const double *reference, const bool *left_out, block at)
{
    double right[BATCHES] = {0}, difference[BATCHES] = {0}, total = 0.0, mean = 0.0, variance = 0.0;
    add_block(b, reference, 1.0, left_out, at, right);
    add_block(b, reference, -1.0, left_out, at, difference);
    add_block(b, b->mean, 1.0, left_out, at, difference);
    for (int i = 0; i < BATCHES; i++) total += right[i] / BATCHES, mean += difference[i] / BATCHES;
    for (int i = 0; i < BATCHES; i++) variance += (difference[i] - mean) * (difference[i] - mean) / (BATCHES - 1);
    if (total <= 0.0) return (figure){0.0, 0.0};
    return (figure){mean / total, 2.0 * sqrt(variance / BATCHES) / total};
}

static void clear_block(const batches *b, block at, bool *counts)
{
    for (uint32_t y = at.y; y < at.y + BLOCK_SIDE && y < b->height; y++)
        for (uint32_t x = at.x; x < at.x + BLOCK_SIDE && x < b->width; x++) counts[(size_t)y * b->width + x] = false;
}

double find_consistent_pixels(const batches *b, const double *reference, const bool *left_out, double tolerance,
                              double known, bool *counts)
{
    const uint32_t columns = (b->width + BLOCK_SIDE - 1) / BLOCK_SIDE,
                   rows = (b->height + BLOCK_SIDE - 1) / BLOCK_SIDE;
    double *errors = malloc((size_t)columns * rows * sizeof *errors);
    if (!errors) return (double)NAN;
    int blocks = 0;
    for (size_t p = 0; p < pixels_of(b); p++) counts[p] = !left_out[p];
    for (uint32_t k = 0; k < columns * rows; k++) {
        const block at = {k % columns * BLOCK_SIDE, k / columns * BLOCK_SIDE};
        const figure difference = block_difference(b, reference, left_out, at);
        const bool differs = fabs(difference.value) > tolerance + difference.half_width;
        if (differs || difference.half_width > known) clear_block(b, at, counts);
        if (difference.half_width > 0.0) errors[blocks++] = difference.half_width;
    }
    const double sharpness = blocks > 0 ? bench_median(errors, blocks) : 0.0;
    free(errors);
    return sharpness;
}
