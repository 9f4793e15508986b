#include "metrics/significance.h"

#include <math.h>

static const double sqrt_half = 0.70710678118654752440;

double ca_normal_cdf(double z) { return 0.5 * erfc(-z * sqrt_half); }

double ca_normal_two_sided_quantile(double alpha)
{
    double low = 0.0, high = 40.0; /* erfc underflows below this */
    for (int i = 0; i < 80; i++) {
        const double middle = 0.5 * (low + high);
        if (erfc(middle * sqrt_half) > alpha)
            low = middle;
        else
            high = middle;
    }
    return 0.5 * (low + high);
}

/* Continued fraction of the incomplete beta function, evaluated from the front (Lentz's method). Converges fast for
 * x < (a + 1) / (a + b + 2). */
static double beta_fraction(double a, double b, double x)
{
    const double tiny = 1e-300;
    double c = 1.0, d = 1.0 - (a + b) * x / (a + 1.0);
    d = 1.0 / (fabs(d) < tiny ? tiny : d);
    double value = d;
    for (int m = 1; m <= 400; m++) {
        const double even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        const double odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        double step = 1.0;
        for (int half = 0; half < 2; half++) {
            const double term = half == 0 ? even : odd;
            d = 1.0 + term * d;
            c = 1.0 + term / c;
            d = 1.0 / (fabs(d) < tiny ? tiny : d);
            if (fabs(c) < tiny) c = tiny;
            step = c * d;
            value *= step;
        }
        if (fabs(step - 1.0) < 1e-14) break;
    }
    return value;
}

/* Regularised incomplete beta function I_x(a, b). */
static double incomplete_beta(double a, double b, double x)
{
    if (x <= 0.0) return 0.0;
    if (x >= 1.0) return 1.0;
    const double front = exp(lgamma(a + b) - lgamma(a) - lgamma(b) + a * log(x) + b * log1p(-x));
    if (x < (a + 1.0) / (a + b + 2.0)) return front * beta_fraction(a, b, x) / a;
    return 1.0 - front * beta_fraction(b, a, 1.0 - x) / b;
}

double ca_student_two_sided_p(double t, double degrees)
{
    /* Beyond this many degrees the two agree to better than the fraction converges. */
    if (degrees > 1e5) return erfc(fabs(t) * sqrt_half);
    return incomplete_beta(0.5 * degrees, 0.5, degrees / (degrees + t * t));
}

double ca_sidak_alpha(double alpha, uint64_t count)
{
    return -expm1(log1p(-alpha) / (double)(count ? count : 1));
}

double ca_sidak_p(double p_smallest, uint64_t count)
{
    if (p_smallest >= 1.0) return 1.0;
    return -expm1((double)(count ? count : 1) * log1p(-p_smallest));
}
