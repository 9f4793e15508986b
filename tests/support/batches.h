/* Statistics that hold for every integrator: a render is repeated with seeds of its own, and noise is what the
 * repeats scatter by. (Pixels of one render are not independent where light paths are shared: a splat is spread over
 * neighbours, a photon is merged into many pixels, and the layers' Variance does not see that.) */
#ifndef CA_TEST_BATCHES_H
#define CA_TEST_BATCHES_H

#include "caustica.h"

typedef struct batch_settings {
    const char *integrator; /* as ca_render_settings' */
    const char *sampler;    /* NULL: independent */
    uint32_t samples;       /* of each batch */
    uint32_t batches;       /* at least 2 */
    uint64_t seed;          /* batches have the seeds seed, seed + 1, ... */
    uint32_t block_side;    /* divides the picture's sides */
    uint32_t threads;       /* 0: one per processor; small pictures are faster with one */
    uint32_t width, height; /* 0: the scene's */
    uint32_t crop[4];       /* x0, y0, x1, y1; all 0: the whole picture */
} batch_settings;

/* One pixel for each block: R G B the mean over all batches; Variance.* of *one* batch' block mean; Samples.Y the
 * batches. So ca_compare with blocks of one pixel tests block means with the noise they really have. Fails the test
 * on errors and on samples that are not finite. */
ca_image_layers *render_batches(const ca_scene *scene, const batch_settings *settings);

/* A number with its noise. */
typedef struct measured {
    double mean, error; /* standard error of the mean */
    double degrees;     /* degrees of freedom of `error` */
} measured;

/* Mean over the whole picture, green. The settings' block_side is not looked at. */
measured measure_mean(const ca_scene *scene, const batch_settings *settings);

/* The batches' own means, and what they say together. Two integrators with the same seeds share their light paths, so
 * that the differences batch by batch have less noise than the means. */
void batch_means(const ca_scene *scene, const batch_settings *settings, double *means);
measured measured_of(const double *values, uint32_t count);

/* Two-sided p-value that the true mean is `expected`; `tolerance` is added for what is known to differ (rounding). */
double p_value_of(measured value, double expected, double tolerance);

/* The smallest relative bias of the whole picture that ca_compare's test of the two block pictures would show with 80
 * % probability where a picture counts as different below the p-value `alpha`. INFINITY for a black reference. */
double detectable_block_bias(const ca_image_layers *image, const ca_image_layers *reference, double alpha);

/* Copies the text, with the radius where it has "%g". */
void integrator_text(const char *text, double radius, char *integrator, size_t size);

/* A name's own seed, so that two integrators never share their random numbers. */
uint64_t seed_of(const char *name);

#endif
