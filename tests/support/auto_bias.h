/* Is the mean of many small renders with rays "auto" that of the reference? And would a bias be seen: the same parts,
 * joined with weights per pixel from the samples that they multiply, must fail the same test. */
#ifndef CA_TEST_AUTO_BIAS_H
#define CA_TEST_AUTO_BIAS_H

#include "caustica.h"

enum { AUTO_BIAS_SIDE = 12, AUTO_BIAS_BLOCK = 4, AUTO_BIAS_REGIONS = 10 }; /* the image, then its 3 x 3 blocks */

typedef struct auto_bias_means {
    double mean[AUTO_BIAS_REGIONS], error[AUTO_BIAS_REGIONS];
} auto_bias_means;

/* The scene: photons that are few for the size of a pixel, half in shadow, so that luminance is skewed. */
ca_scene *auto_bias_scene(void);

/* Means over renders of so many camera paths a pixel with seeds from `seed` on: as they were joined, and joined the
 * naive way. Answers how many trials and phases they had on average. */
double auto_bias_render(const ca_scene *scene, uint32_t renders, uint32_t samples, uint64_t seed,
                        auto_bias_means *joined, auto_bias_means *naive);
/* One render of bdpm without choices, of so many passes. */
void auto_bias_reference(const ca_scene *scene, uint32_t passes, auto_bias_means *reference);

/* The largest deviation of a region in standard errors, over the limit that all regions together pass with the
 * probability of two standard errors (Sidak): above 1 fails. Prints it, with the smallest bias that would have
 * failed. */
double auto_bias_test(const char *what, const auto_bias_means *means, const auto_bias_means *reference);

#endif
