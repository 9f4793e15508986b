/* Exact statistics of answers that are yes or no. All functions are pure; cost grows with the number of answers. */
#ifndef CA_METRICS_BINOMIAL_H
#define CA_METRICS_BINOMIAL_H

#include <stdint.h>

/* P(X >= count) of a binomial X: how many of `total` independent tries succeed, each with probability p. */
double ca_binomial_tail(uint32_t count, uint32_t total, double p);

/* The interval of Clopper and Pearson: the probabilities p under which neither `count` or more nor `count` or fewer
 * of `total` is rarer than alpha / 2. It covers the true one with at least 1 - alpha. Of a total of 0 it is all of
 * [0, 1]. */
void ca_clopper_pearson(uint32_t count, uint32_t total, double alpha, double *low, double *high);

/* The sign test, for pairs of which `more` differ to one side and `less` to the other (McNemar's test in its exact
 * form: those that do not differ say nothing): the probability of so many more, or, two-sided, of so large a
 * difference, by chance. */
double ca_sign_test_more(uint32_t more, uint32_t less);
double ca_sign_test_two_sided(uint32_t more, uint32_t less);

#endif
