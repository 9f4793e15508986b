/* Chi-square tests: does a sampler of directions produce the density it claims?
 *
 * ca_chi_square_run draws directions and counts them in bins of nearly equal mass: rings around an axis, each cut in
 * azimuth, the edges from a pilot run, so that narrow peaks are resolved as well as wide lobes. The expected counts
 * are integrals of the density (per solid angle) over the bins by adaptive quadrature. Rejected samples are one more
 * bin, whose expectation is what the density lacks to an integral of 1: so the normalisation is tested too. Bins with
 * an expectation below 5 are pooled. Deterministic for a given seed.
 *
 *     static bool draw(const void *context, const float u[3], ca_vec3 *direction);   true: accepted
 *     static float density(const void *context, ca_vec3 direction);
 *     ...
 *     ca_chi_square_assert(&(ca_chi_square_test){.name = "cosine", .sample = draw, .pdf = density, .context = &what,
 *                                                .test_count = 12});
 *
 * For things that are not directions (points of a disk, pixels of a table) fill observed and expected counts yourself
 * and call ca_chi_square_counts. */
#ifndef CA_TEST_CHI_SQUARE_H
#define CA_TEST_CHI_SQUARE_H

#include "math/vec.h"

#include <stdbool.h>
#include <stdint.h>

typedef struct ca_chi_square_test {
    const char *name; /* printed on failure */
    bool (*sample)(const void *context, const float u[3], ca_vec3 *direction);
    float (*pdf)(const void *context, ca_vec3 direction); /* per solid angle, over the whole sphere */
    const void *context;
    uint32_t test_count; /* tests in the same program, for the Sidak correction; 0 counts as 1 */

    /* Zeros mean the defaults. */
    ca_vec3 axis;                   /* of the rings, of unit length; (0, 0, 1). Best near the peak of the density */
    uint32_t sample_count;          /* 100,000 */
    uint32_t ring_count, cut_count; /* 24 rings, 16 cuts each; at least 3 */
    uint64_t seed;
} ca_chi_square_test;

typedef struct ca_chi_square_result {
    double p_value, statistic;
    uint32_t degrees_of_freedom;
    double pdf_integral;  /* of the density over the sphere */
    double accepted_rate; /* share of the samples that were accepted */
    uint32_t bad_count;   /* pdf not finite or negative, or accepted directions that are not of unit length */
} ca_chi_square_result;

ca_chi_square_result ca_chi_square_run(const ca_chi_square_test *test);

/* Runs and fails the cmocka test, with the numbers printed, if the p-value is below the level for 1 % over all
 * test_count tests together, or if anything was bad. Gives back the result. */
ca_chi_square_result ca_chi_square_assert(const ca_chi_square_test *test);

/* p-value of observed against expected counts, bins with an expectation below 5 pooled; *degrees_of_freedom
 * (may be NULL) is the number of pooled bins less one. 1 where nothing can be compared. */
double ca_chi_square_counts(const double *observed, const double *expected, uint32_t count, double *statistic,
                            uint32_t *degrees_of_freedom);

/* Level of one test for which `test_count` independent tests are all passed with probability 1 - significance
 * (Sidak 1967). */
double ca_sidak_level(double significance, uint32_t test_count);

/* Q(a, x), the regularised upper incomplete gamma function; a > 0, x >= 0. Relative error about 1e-12. */
double ca_gamma_q(double a, double x);

#endif
