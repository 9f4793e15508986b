/* Confidence intervals of a pixel rendered by blocks of pairs with random numbers: from what its blocks tell
 * (pair_covariances.h) to the variance of its value.
 *
 * Blocks share their paths, so their scatter is not the image's error; but what each tells has no bias, and so has
 * its mean over blocks, whatever they share. Let row i of camera paths have met R_i blocks of light paths, column j
 * of light paths C_j blocks of camera paths, K = sum R_i = sum C_j blocks in all. The pixel's value, the mean over
 * all pairs of these blocks, has the variance
 *
 *     V = sum R_i^2 / (m K^2) Var(g) + sum C_j^2 / (n K^2) Var(f) + 1 / (m n K) Var(h),
 *
 * for a whole rectangle law (6) with N_B = m rows and N_F = n columns, and the same law for every shape in which a
 * render may end. docs/papers/000.md, "All pairs".
 *
 * The interval is that of confidence.h, with this variance, Student's t, and a skewness: that of rare contributions,
 * all alike, with the light's part of the variance and the mean that light paths bring, and with the camera's part
 * and the value. The degrees of freedom are those of a chi-square variable with the scatter of the estimated V
 * (Satterthwaite's rule), for normal g and h; the light's part has twice the variance of the squares of as many
 * contributions. V is uncertain (confidence.h) where it is not positive, or too small for floats; where it has fewer
 * than CA_PAIR_MIN_DEGREES of freedom; and where fewer than CA_PAIR_MIN_CAMERA camera paths, counted as all alike and
 * the others zero, would have the camera's variance. Such a pixel, and one with several of them nearby, has a widened
 * interval. What no path has brought yet, no interval knows of.
 *
 * All functions are pure. */
#ifndef CA_FILM_PAIR_INTERVAL_H
#define CA_FILM_PAIR_INTERVAL_H

#include "film/confidence.h"

#include <stdbool.h>

#define CA_PAIR_MIN_DEGREES 6.0
#define CA_PAIR_MIN_CAMERA 4.0

typedef struct ca_pair_design {
    double camera_paths, light_paths;     /* of a block, of the pixel: m and n */
    double blocks;                        /* K */
    double camera_squares, light_squares; /* sums of R_i^2 and C_j^2 */
} ca_pair_design;

/* Var(g), Var(f) and Var(h), estimates for the whole; and the mean of what light paths bring. */
typedef struct ca_pair_variances {
    double camera, light, pair;
    double merged;
} ca_pair_variances;

/* Of the pixel's value; without bias where the three are. */
double ca_pair_value_variance(const ca_pair_design *design, const ca_pair_variances *v);

/* What confidence.h needs of the pixel, as if it were the mean of CA_CONFIDENCE_MIN_REPLICATES replicates; and
 * degrees of freedom, at least CA_PAIR_MIN_DEGREES. false: V is uncertain, and where it is not positive the moments
 * hold none. */
bool ca_pair_error(const ca_pair_design *design, const ca_pair_variances *v, double value, ca_moments *moments,
                   double *degrees);

/* The t that Student's |t| exceeds with a probability of 5 %, for 3 degrees of freedom or more: within 0.2 %. */
double ca_pair_student_quantile(double degrees);

#endif
