/* The statistics behind comparing two noisy means. All functions are pure and in double precision.
 *
 * `alpha` is the probability of a false alarm, p a two-sided p-value: the probability of a difference at least this
 * large where there is none. */
#ifndef CA_METRICS_SIGNIFICANCE_H
#define CA_METRICS_SIGNIFICANCE_H

#include <stdint.h>

/* P(Z <= z) of a standard normal Z. */
double ca_normal_cdf(double z);
/* The z >= 0 with P(|Z| > z) = alpha, for alpha in (0, 1]. */
double ca_normal_two_sided_quantile(double alpha);

/* P(|T| > |t|) of Student's t with `degrees` > 0 degrees of freedom (INFINITY: the normal distribution). */
double ca_student_two_sided_p(double t, double degrees);

/* Šidák: of `count` independent tests, each with p <= ca_sidak_alpha, one or more rejects with probability `alpha`;
 * and the p-value of the whole when `p_smallest` is the smallest of them. A count of 0 counts as 1. */
double ca_sidak_alpha(double alpha, uint64_t count);
double ca_sidak_p(double p_smallest, uint64_t count);

#endif
