/* The standard deviation of one iteration's pixel, averaged over pixels (the sigma-bar of Jendersie 2019), with its
 * error; and whether an estimator's mean is right where it is compared.
 *
 * An estimator's iterations are kept as batches: for each batch and pixel the mean of the luminance and of its
 * square. Figures are functions of how often each batch counts; the bootstrap draws those counts, so that whatever
 * pixels of an iteration share (light paths) is in the error. Estimators that were given the same random numbers are
 * drawn together: a ratio of two then has the error of their difference. */
#ifndef CA_BENCH_DEVIATION_H
#define CA_BENCH_DEVIATION_H

#include <stdbool.h>
#include <stdint.h>

enum { BATCHES = 20, BOOTSTRAP = 400, BLOCK_SIDE = 8 };

typedef struct batches {
    uint32_t width, height;
    uint32_t iterations; /* of one batch */
    double *mean;        /* owned, [pixel][BATCHES] */
    double *mean_square; /* likewise */
} batches;

/* false: out of memory. */
bool batches_create(batches *b, uint32_t width, uint32_t height, uint32_t iterations);
void batches_destroy(batches *b);

/* Standard deviation of one iteration for every pixel, with Bessel's correction. */
void batches_deviation(const batches *b, double *deviation);
void batches_mean(const batches *b, double *mean);

/* How often each batch counts in each bootstrap sample: one table for all estimators. Row 0 is the sample itself. */
typedef struct bootstrap_table {
    uint32_t count[1 + BOOTSTRAP][BATCHES];
} bootstrap_table;
void bootstrap_draw(bootstrap_table *table, uint64_t seed);

/* The mean over the pixels of `mask` of their standard deviation, [0] of the sample itself and [i] of bootstrap
 * sample i. */
void mean_deviation(const batches *b, const bool *mask, const bootstrap_table *table, double values[1 + BOOTSTRAP]);

/* A figure and half of its 95 % interval, from the standard error over bootstrap samples. */
typedef struct figure {
    double value, half_width;
} figure;
figure figure_of(const double values[1 + BOOTSTRAP]);
figure figure_of_ratio(const double numerator[1 + BOOTSTRAP], const double denominator[1 + BOOTSTRAP]);

/* Where an estimator counts. A single pixel's mean is too noisy to be held against a tolerance, so blocks of 8 x 8
 * pixels are: a block is out where its mean differs from the reference's by more than the tolerance and two standard
 * errors of that difference, which comes from the batches' own differences; and where these two standard errors are
 * more than `known`. Both are fractions of the reference. Pixels of such blocks are cleared in `counts`. `reference`
 * is laid out as batches.mean, from the same random numbers. `left_out`: pixels not to look at. Returns the median
 * over blocks of two standard errors: how sharp the test was. */
double find_consistent_pixels(const batches *b, const double *reference, const bool *left_out, double tolerance,
                              double known, bool *counts);

#endif
