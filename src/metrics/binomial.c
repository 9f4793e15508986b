#include "metrics/binomial.h"

#include <math.h>

static double log_probability(uint32_t count, uint32_t total, double p)
{
    const double k = count, n = total;
    return lgamma(n + 1.0) - lgamma(k + 1.0) - lgamma(n - k + 1.0) + k * log(p) + (n - k) * log1p(-p);
}

double ca_binomial_tail(uint32_t count, uint32_t total, double p)
{
    if (count == 0) return 1.0;
    if (count > total || p <= 0.0) return 0.0;
    if (p >= 1.0) return 1.0;
    double sum = 0.0;
    for (uint32_t k = total; k >= count; k--) sum += exp(log_probability(k, total, p)); /* the smaller ones first */
    return fmin(sum, 1.0);
}

/* The p with P(X >= count) = tail, for a count of at least 1; the tail grows with p. */
static double solve_tail(uint32_t count, uint32_t total, double tail)
{
    enum { STEPS = 60 };
    double low = 0.0, high = 1.0;
    for (int i = 0; i < STEPS; i++) {
        const double middle = 0.5 * (low + high);
        if (ca_binomial_tail(count, total, middle) < tail)
            low = middle;
        else
            high = middle;
    }
    return 0.5 * (low + high);
}

void ca_clopper_pearson(uint32_t count, uint32_t total, double alpha, double *low, double *high)
{
    *low = count > 0 ? solve_tail(count, total, 0.5 * alpha) : 0.0;
    /* `count` or fewer succeed where total - count or more fail. */
    *high = count < total ? 1.0 - solve_tail(total - count, total, 0.5 * alpha) : 1.0;
}

double ca_sign_test_more(uint32_t more, uint32_t less) { return ca_binomial_tail(more, more + less, 0.5); }

double ca_sign_test_two_sided(uint32_t more, uint32_t less)
{
    return fmin(2.0 * ca_sign_test_more(more > less ? more : less, more > less ? less : more), 1.0);
}
