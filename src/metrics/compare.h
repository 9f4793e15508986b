/* How much two pictures differ, and whether noise explains it.
 *
 * Metrics, over the pixels of the region that are not masked (A the image, B the reference, per channel R G B):
 *     rmse    root of the mean of (A - B)^2
 *     mae     mean of |A - B|
 *     relmse  mean of (A - B)^2 / (B^2 + 0.01)
 *     smape   mean of |A - B| / (|A| + |B| + 0.01), in [0, 1)
 * (SSIM and FLIP, which look at neighbourhoods: image_metrics.h.)
 * A pixel that is not finite in one of the two is counted and left out.
 *
 * Block test: the region is cut into square blocks from its upper left corner. In each block and channel the
 * difference of the means is tested against zero (Welch's test; with many samples it is the Z-test). The variance of
 * a pixel's mean is Variance.C / Samples.Y, where Variance.C is the unbiased sample variance of one sample; pixels
 * are independent of each other. A reference without these layers counts as exact. Šidák's correction makes the
 * chance of one or more false rejections in the whole picture 5 % (less where the channels' noise is correlated, or
 * where stratified samples make Variance an overestimate). Means of few, heavy-tailed samples are not normal: below
 * some tens of samples per pixel a rejected block may be a firefly.
 *
 * Power: of each block with noise the smallest relative bias, of this block alone, that the test finds with 80 %
 * probability, means taken as normal and channels as independent. The median of these is told. A block that is much
 * less noisy than the others (a sky, a lamp) would show a much smaller bias, but light that is not estimated is not
 * biased either; such blocks are tested and do not count here.
 *
 * All functions are pure. */
#ifndef CA_METRICS_COMPARE_H
#define CA_METRICS_COMPARE_H

#include "image/layers.h"

#include <math.h>

/* Half open, in pixels of the pictures' data: (0, 0) is the first pixel that the file holds. */
typedef struct ca_pixel_rect {
    uint32_t x0, y0, x1, y1;
} ca_pixel_rect;

#define CA_COMPARE_ALPHA 0.05
#define CA_COMPARE_POWER 0.8
#define CA_COMPARE_LEAST_NOISE 0.1 /* of a block with noise, relative to the mean over the blocks */

typedef struct ca_compare_settings {
    bool has_roi;
    ca_pixel_rect roi; /* the region to look at; must lie inside of the picture */
    const ca_pixel_rect *masks; /* borrowed: parts to leave out, cut to the picture */
    size_t mask_count;
    uint32_t block_side; /* 0: 16 */
} ca_compare_settings;

typedef struct ca_block_test {
    bool done;                   /* false: the image has no variance layers, or no block could be tested */
    bool reference_exact;        /* the reference has no variance layers */
    uint32_t blocks, rejected;   /* blocks tested; those that differ in some channel */
    uint32_t blocks_untested;    /* a pixel with less than two samples makes its variance unknown */
    double p_value;              /* of the whole picture, Šidák-corrected */
    uint32_t blocks_with_noise;  /* standard error at least CA_COMPARE_LEAST_NOISE of the blocks' mean */
    double detectable_bias;      /* half of the blocks with noise show a relative bias of this size, each by itself,
                                    at 5 % significance for the whole picture with 80 % probability. INFINITY where
                                    the reference is black, NAN where no block has noise */
} ca_block_test;

typedef struct ca_comparison {
    double rmse, mae, relmse, smape;
    double mean_luminance, reference_mean_luminance;
    uint64_t pixels;            /* that were compared */
    uint64_t masked, non_finite; /* that were not */
    uint32_t blocks;            /* with at least a quarter of their pixels left */
    uint32_t blocks_left_out;
    double median_block_difference; /* median of |mean A - mean B| / mean B, luminance; NAN without blocks */
    ca_block_test test;
} ca_comparison;

/* What relmse and smape are means of. */
static inline double ca_relative_square(double a, double b) { return (a - b) * (a - b) / (b * b + 0.01); }
static inline double ca_symmetric_error(double a, double b) { return fabs(a - b) / (fabs(a) + fabs(b) + 0.01); }

/* Errors: CA_ERROR_ARGUMENT (different sizes or places, no R G B, an empty region, nothing left to compare),
 * CA_ERROR_MEMORY. */
ca_status ca_compare(const ca_image_layers *image, const ca_image_layers *reference,
                     const ca_compare_settings *settings, ca_comparison *comparison, ca_error *error);

/* The picture with each `factor` x `factor` pixels averaged into one: channels R G B, and Variance.* and Samples.Y
 * such that Variance / Samples stays the variance of a pixel's mean. Both sides, the film's sides and the place in
 * it must be multiples of `factor`. Errors: CA_ERROR_ARGUMENT, CA_ERROR_MEMORY. */
ca_status ca_compare_downsample(const ca_image_layers *layers, uint32_t factor, ca_image_layers **result,
                                ca_error *error);

#endif
