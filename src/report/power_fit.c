#include "report/power_fit.h"

#include "film/confidence.h"

#include <math.h>
#include <stdbool.h>

static bool counts(double x, double y) { return x > 0.0 && y > 0.0 && isfinite(x) && isfinite(y); }

/* Root of the mean square of what the law leaves, over degrees of freedom. */
static double scatter(const ca_power_fit *fit, const double *x, const double *y, size_t count)
{
    double residual = 0.0;
    for (size_t i = 0; i < count; i++) {
        if (!counts(x[i], y[i])) continue;
        const double off = log(y[i]) - fit->offset - fit->exponent * log(x[i]);
        residual += off * off;
    }
    return sqrt(residual / ((double)fit->points - 2.0));
}

ca_power_fit ca_power_fit_of(const double *x, const double *y, size_t count)
{
    ca_power_fit fit = {
        .exponent = (double)NAN, .offset = (double)NAN, .error = (double)NAN, .half_width = (double)NAN};
    double mean_x = 0.0, mean_y = 0.0, xx = 0.0, xy = 0.0;
    for (size_t i = 0; i < count; i++)
        if (counts(x[i], y[i])) fit.points++, mean_x += log(x[i]), mean_y += log(y[i]);
    mean_x /= (double)fit.points, mean_y /= (double)fit.points;
    for (size_t i = 0; i < count; i++)
        if (counts(x[i], y[i])) {
            xx += (log(x[i]) - mean_x) * (log(x[i]) - mean_x);
            xy += (log(x[i]) - mean_x) * (log(y[i]) - mean_y);
        }
    /* What equal x leave here is rounding of their logarithms. */
    if (fit.points < 2 || !(xx > 1e-20 * (1.0 + mean_x * mean_x) * (double)fit.points)) return fit;
    fit.exponent = xy / xx;
    fit.offset = mean_y - fit.exponent * mean_x;
    if (fit.points < 3) return fit;
    fit.error = scatter(&fit, x, y, count) / sqrt(xx);
    fit.half_width = fit.error * ca_student_two_sided_quantile(0.05, (double)fit.points - 2.0);
    return fit;
}
