/* The merge radius of least error, from what a pilot has measured of a picture: how variance falls and how blur grows
 * with the radius.
 *
 * A picture's relative mean square error after n passes of N light paths each, whose radii r_i shrink (radius.h), is
 *
 *     (mean of sqrt(blur(r_i)))^2 + mean of variance(r_i) / (n N)
 *
 * blur: the square of what a merge of radius r changes, a r^p / (1 + (r / e)^p), which is fitted to the differences
 * that were measured between radii; p is 4 where light changes smoothly (blur r^2 / 8 times the Laplacian; Hachisuka,
 * Jarosz, Jensen 2010) and 1 at edges. Where light lies in thin lines, a radius wider than these cannot blur them
 * further: beyond e a larger radius changes little, though all is blurred. variance: of an estimate by a single light
 * path; it falls no faster than as 1 / r^2, and at least as 1 / r where merging alone finds light. What was measured
 * is brought to that: a few bright paths which some radii happen to find must not decide. */
#ifndef CA_PHOTON_RADIUS_CHOICE_H
#define CA_PHOTON_RADIUS_CHOICE_H

#include <stdbool.h>
#include <stdint.h>

enum { CA_RADIUS_LEVELS = 7, CA_RADIUS_PASSES = 64 /* the n that a default is made for */ };

/* Means over the picture, each relative to the square of a pixel's own light. */
typedef struct ca_radius_curve {
    uint32_t count;                      /* of radii; each is twice the one before; at least 1 */
    bool merging_alone;                  /* finds light */
    double radius[CA_RADIUS_LEVELS];     /* m */
    double variance[CA_RADIUS_LEVELS];   /* by one light path; > 0 at the first radius */
    double change[CA_RADIUS_LEVELS];     /* mean square of what changes from half the radius */
    double change_error[CA_RADIUS_LEVELS]; /* its standard error */
} ca_radius_curve;

/* What the curve says of blur. */
typedef struct ca_radius_blur {
    double factor, power, end; /* a >= 0; p in [1, 4]; e, INFINITY: none was seen */
} ca_radius_blur;
ca_radius_blur ca_radius_blur_of(const ca_radius_curve *curve);
double ca_radius_blur_at(const ca_radius_blur *blur, double radius);
/* The square of what a render of so many passes, whose radii shrink from `radius`, changes: within a tenth. */
double ca_radius_mean_blur(const ca_radius_blur *blur, double radius, double alpha, double passes);

/* The radius of the first pass, in [least, most]: the smallest one whose error is within a tolerance of the least.
 * A smaller one costs fewer merges. Where other techniques find the light, too, the error hardly depends on the
 * radius until blur shows, and blur that the pilot misses makes the largest radius the best by a few per cent: there
 * the tolerance is larger. `light_paths`: N. */
#define CA_RADIUS_TOLERANCE 1.01
#define CA_RADIUS_SHARED_TOLERANCE 1.05 /* not merging_alone */
double ca_radius_choose(const ca_radius_curve *measured, double alpha, double light_paths, double least, double most);

#endif
