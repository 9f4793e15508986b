#include "film/pair_interval.h"

#include <math.h>

/* The variance of a sum of squares of so many random contributions, over its square, is 1 over their number if they
 * are all alike. Here it is this over their number, since they are not, and the largest are the rarest. */
static const double light_scatter = 2.0;

/* Variances of the value, with one of Var(g), Var(f), Var(h) each. */
typedef struct value_terms {
    double camera, light, pair;
} value_terms;

static value_terms terms_of(const ca_pair_design *d, const ca_pair_variances *v)
{
    const double squared = d->blocks * d->blocks;
    return (value_terms){.camera = v->camera * d->camera_squares / (d->camera_paths * squared),
                         .light = v->light * d->light_squares / (d->light_paths * squared),
                         .pair = v->pair / (d->camera_paths * d->light_paths * d->blocks)};
}

double ca_pair_value_variance(const ca_pair_design *design, const ca_pair_variances *v)
{
    const value_terms t = terms_of(design, v);
    return t.camera + t.light + t.pair;
}

/* How many of `count` independent paths, all alike and the others zero, would have the variance `v` around the mean
 * `value`. */
static double contributing(double count, double v, double value)
{
    return v > 0.0 ? count * (value * value) / (value * value + v) : count;
}

/* The expansion of Student's quantiles around the normal one, z, in powers of 1 / degrees; their coefficients follow
 * from matching the series of the two distributions, and test_pair_interval.c compares the result with the
 * distribution itself. */
double ca_pair_student_quantile(double degrees)
{
    const double z = 1.9599639845400545, z2 = z * z;
    const double terms[4] = {z * (z2 + 1.0) / 4.0, z * ((5.0 * z2 + 16.0) * z2 + 3.0) / 96.0,
                             z * (((3.0 * z2 + 19.0) * z2 + 17.0) * z2 - 15.0) / 384.0,
                             z * ((((79.0 * z2 + 776.0) * z2 + 1482.0) * z2 - 1920.0) * z2 - 945.0) / 92160.0};
    return z + (terms[0] + (terms[1] + (terms[2] + terms[3] / degrees) / degrees) / degrees) / degrees;
}

/* Twice the square of V over the variance of its estimate. The camera's covariance is one of sums g + e over halves
 * of the light paths of a block, where e is what h leaves: of 2 m columns times the variance that the pair's term has
 * in the value. */
static double degrees_of_freedom(const ca_pair_design *d, const value_terms *terms, double light_contributing)
{
    const double rows = d->blocks * d->blocks / d->camera_squares, columns = d->blocks * d->blocks / d->light_squares;
    const double camera = fmax(terms->camera, 0.0), light = fmax(terms->light, 0.0), pair = fmax(terms->pair, 0.0);
    const double of_camera = (2.0 * camera * camera + 4.0 * camera * pair + 4.0 * pair * pair * columns) /
                             (rows * (d->camera_paths - 1.0));
    const double of_light = light_scatter * light * light / light_contributing;
    const double sum = camera + light + pair;
    return 2.0 * sum * sum / (of_camera + of_light);
}

/* The third moment of a mean of rare contributions, all alike, that has this variance. */
static double third_of(double variance, double mean)
{
    return variance > 0.0 && mean > 0.0 ? variance * variance / mean : 0.0;
}

bool ca_pair_error(const ca_pair_design *design, const ca_pair_variances *v, double value, ca_moments *moments,
                   double *degrees)
{
    const value_terms terms = terms_of(design, v);
    const double variance = terms.camera + terms.light + terms.pair;
    const double squared = design->blocks * design->blocks;
    /* Any number of replicates will do, as long as it is enough; with n of them one has n times the variance of their
     * mean. */
    const double n = CA_CONFIDENCE_MIN_REPLICATES;
    *moments = (ca_moments){.mean = value, .replicates = CA_CONFIDENCE_MIN_REPLICATES, .uncertain = true};
    *degrees = CA_PAIR_MIN_DEGREES;
    if (!(variance > 0x1p-40 * value * value)) return false; /* a float resolves 2^-24 of the value */
    const double light = contributing(design->light_paths * squared / design->light_squares, v->light, v->merged);
    const double camera = contributing(design->camera_paths * squared / design->camera_squares, v->camera, value);
    moments->variance = n * variance;
    /* Not more skewed than by a single contribution. */
    moments->third = fmin(n * n * (third_of(terms.light, v->merged) + third_of(terms.camera, value)),
                          sqrt(n) * moments->variance * sqrt(moments->variance));
    const double found = degrees_of_freedom(design, &terms, light);
    *degrees = fmax(found, CA_PAIR_MIN_DEGREES);
    moments->uncertain = !(camera >= CA_PAIR_MIN_CAMERA && found >= CA_PAIR_MIN_DEGREES);
    return !moments->uncertain;
}
