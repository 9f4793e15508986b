#include "photon/radius_choice.h"

#include "math/numeric.h"
#include "photon/radius.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

/* Powers that are tried, and radii a factor of two. */
enum { POWERS = 13, STEPS = 8, MOST_STEPS = STEPS * 278 /* between any two radii that a float can have */ };

/* Steps between 1 / r and 1 / r^2. */
enum { FALLS = 4 };

#define LEAST_POWER 1.0
#define MOST_POWER 4.0

/* Where measurements are too noisy to tell, the power is about that of pictures with soft edges, give or take this
 * much, and blur has no end: what an end must make better in the sum of squared errors. Ends are looked for from this
 * level on. */
#define LIKELY_POWER 2.0
#define POWER_ERROR 2.0
#define UNLIKELY_END 1.0
enum { FIRST_END = 3, FORMS = POWERS * (CA_RADIUS_LEVELS + 1 - FIRST_END) };

/* Forms that are less likely are out of the question. */
#define LEAST_LIKELIHOOD 0.01

/* The curve is a model: measured differences that are nearly without noise are no closer to it than this part. */
#define MODEL_ERROR 0.3

/* The mean square of what changes between r / 2 and r over that of all that r changes: of a step edge
 * under a disk, where what the smaller radius blurs lies within what the larger one does, and (1 - 1/4)^2 where blur
 * grows as the square of the radius. Between them by the power; near an end as much less as blur grows less. */
#define EDGE_SHARE 0.2311
#define SMOOTH_SHARE 0.5625

/* Standard errors that no number is away from what it was measured as. */
#define FAR 8.0

/* Errors of the model are a part of the curve that is looked for: it is found in some steps. */
enum { FIT_STEPS = 4 };

static double share_of_change(double power)
{
    const double t = (power - LEAST_POWER) / (MOST_POWER - LEAST_POWER);
    return EDGE_SHARE * pow(SMOOTH_SHARE / EDGE_SHARE, t);
}

double ca_radius_blur_at(const ca_radius_blur *blur, double radius)
{
    return blur->factor * pow(radius, blur->power) / (1.0 + pow(radius / blur->end, blur->power));
}

/* Its root is the mean of roots in proportion to r^(p / 2): that of a radius at which it is just so large. */
double ca_radius_mean_blur(const ca_radius_blur *blur, double radius, double alpha, double passes)
{
    const double root = ca_progressive_mean_area(0.25 * alpha * blur->power, passes);
    return ca_radius_blur_at(blur, radius * pow(root, 2.0 / blur->power));
}

static double change_at(const ca_radius_blur *blur, double radius)
{
    const double growth = ca_radius_blur_at(blur, radius) - ca_radius_blur_at(blur, 0.5 * radius);
    return share_of_change(blur->power) * growth / (1.0 - exp2(-blur->power));
}

/* One over the variance of a measured change around `expected`. */
static double weight_of(const ca_radius_curve *curve, uint32_t k, double expected)
{
    const double model = MODEL_ERROR * expected;
    const double variance = curve->change_error[k] * curve->change_error[k] + model * model;
    return variance > 0.0 ? 1.0 / variance : 0.0;
}

/* The mean of a number that is not negative, whose measured value has this standard error. */
static double mean_of_positive(double value, double error)
{
    const double z = value / error;
    if (fabs(z) > FAR) return fmax(value, 0.0);
    return value + error * exp(-0.5 * z * z) * sqrt(2.0 / CA_PI_D) / erfc(-z * sqrt(0.5));
}

/* The factor for the blur's power and end, and how badly the best one fits the changes: the sum of squared errors.
 * The error of a picture is in proportion to the factor, so what it may be counts by its mean: blur that the pilot
 * does not see, but cannot deny, is not none. */
static double fit(const ca_radius_curve *curve, ca_radius_blur *blur)
{
    double shape[CA_RADIUS_LEVELS], scale = 0.0, mean = 0.0, misfit = 0.0;
    blur->factor = pow(curve->radius[curve->count - 1], -blur->power);
    for (uint32_t k = 0; k < curve->count; k++) shape[k] = change_at(blur, curve->radius[k]);
    for (int step = 0; step < FIT_STEPS; step++) {
        double products = 0.0, squares = 0.0;
        for (uint32_t k = 0; k < curve->count; k++) {
            const double weight = weight_of(curve, k, scale * shape[k]);
            products += weight * shape[k] * curve->change[k];
            squares += weight * shape[k] * shape[k];
        }
        scale = squares > 0.0 ? fmax(products / squares, 0.0) : 0.0;
        mean = squares > 0.0 ? mean_of_positive(products / squares, 1.0 / sqrt(squares)) : 0.0;
    }
    for (uint32_t k = 0; k < curve->count; k++) {
        const double error = curve->change[k] - scale * shape[k];
        misfit += weight_of(curve, k, scale * shape[k]) * error * error;
    }
    blur->factor *= mean;
    return misfit;
}

/* Forms that blur may have, and how likely each is by what was measured, over the likeliest. */
typedef struct blur_forms {
    ca_radius_blur of[FORMS];
    double likelihood[FORMS];
    uint32_t count;
} blur_forms;

/* How badly a form fits, and how unlikely it is before anything is measured. */
static double fit_form(const ca_radius_curve *curve, double power, double end, ca_radius_blur *blur)
{
    const double doubt = (power - LIKELY_POWER) / POWER_ERROR;
    *blur = (ca_radius_blur){.power = power, .end = end};
    return fit(curve, blur) + doubt * doubt + (isfinite(end) ? UNLIKELY_END : 0.0);
}

static void find_forms(const ca_radius_curve *curve, blur_forms *forms)
{
    double misfit[FORMS], least = (double)INFINITY;
    uint32_t n = 0;
    for (uint32_t last = curve->count; last == curve->count || last >= FIRST_END; last--)
        for (int i = 0; i < POWERS; i++, n++) {
            const double power = MOST_POWER - (MOST_POWER - LEAST_POWER) * i / (POWERS - 1);
            const double end = last < curve->count ? curve->radius[last] : (double)INFINITY;
            misfit[n] = fit_form(curve, power, end, &forms->of[n]);
            least = fmin(least, misfit[n]);
        }
    for (uint32_t i = 0; i < n; i++) forms->likelihood[i] = exp(-0.5 * (misfit[i] - least));
    forms->count = n;
}

ca_radius_blur ca_radius_blur_of(const ca_radius_curve *curve)
{
    blur_forms forms;
    find_forms(curve, &forms);
    uint32_t best = 0;
    for (uint32_t i = 1; i < forms.count; i++)
        if (forms.likelihood[i] > forms.likelihood[best]) best = i;
    return forms.of[best];
}

static int compare(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Of what was measured over 1 / r^fall: the median of the logarithms, and the sum of their distances from it. Levels
 * where no photon was found say nothing. */
static double distance_from_law(const ca_radius_curve *curve, double fall, double *level)
{
    double logarithms[CA_RADIUS_LEVELS], sum = 0.0;
    uint32_t count = 0;
    for (uint32_t k = 0; k < curve->count; k++)
        if (curve->variance[k] > 0.0) logarithms[count++] = log(curve->variance[k]) + fall * log(curve->radius[k]);
    qsort(logarithms, count, sizeof *logarithms, compare);
    *level = 0.5 * (logarithms[(count - 1) / 2] + logarithms[count / 2]);
    for (uint32_t k = 0; k < count; k++) sum += fabs(logarithms[k] - *level);
    return sum;
}

/* Where merging alone finds light, variance falls as 1 / r^2, but that dark pixels get the more light from bright
 * ones the larger the radius is: as 1 / r at least. */
static void take_law(ca_radius_curve *curve)
{
    double least = (double)INFINITY, best = 0.0, best_level = 0.0;
    for (int i = 0; i <= FALLS; i++) {
        const double fall = 1.0 + (double)i / FALLS;
        double level;
        const double distance = distance_from_law(curve, fall, &level);
        if (!(distance < least)) continue;
        least = distance;
        best = fall;
        best_level = level;
    }
    for (uint32_t k = 0; k < curve->count; k++) curve->variance[k] = exp(best_level - best * log(curve->radius[k]));
}

/* Where others find it, too: the largest variances of which none is above what was measured, that never grow with the
 * radius and fall no faster than as 1 / r^2. */
static void take_envelope(ca_radius_curve *curve)
{
    const ca_radius_curve measured = *curve;
    for (uint32_t k = 0; k < curve->count; k++)
        for (uint32_t i = 0; i < curve->count; i++) {
            const double ratio = fmax(curve->radius[i] / curve->radius[k], 1.0);
            if (measured.variance[i] > 0.0)
                curve->variance[k] = fmin(curve->variance[k], measured.variance[i] * ratio * ratio);
        }
}

/* A power law between two measured radii, and beyond the ends that of the nearest two. */
static double variance_at(const ca_radius_curve *curve, double radius)
{
    if (curve->count == 1) return curve->variance[0] * pow(radius / curve->radius[0], -2.0);
    const double place = log2(radius / curve->radius[0]);
    const double last = (double)curve->count - 2.0;
    const uint32_t k = (uint32_t)fmin(fmax(floor(place), 0.0), last);
    const double low = curve->variance[k], high = curve->variance[k + 1];
    if (!(low > 0.0 && high > 0.0)) return low * pow(radius / curve->radius[k], -2.0);
    const double slope = fmin(fmax(log2(high / low), -2.0), 0.0);
    return low * pow(radius / curve->radius[k], slope);
}

/* The root of the square of blur, in the mean over the passes. */
static double mean_root_of_blur(const ca_radius_blur *blur, double alpha, double radius)
{
    double sum = 0.0;
    for (int i = 1; i <= CA_RADIUS_PASSES; i++) sum += sqrt(ca_radius_blur_at(blur, radius * pow(i, -0.5 * alpha)));
    return sum / CA_RADIUS_PASSES;
}

/* Of the mean of the passes. */
static double variance_of_passes(const ca_radius_curve *curve, double alpha, double light_paths, double radius)
{
    double sum = 0.0;
    for (int i = 1; i <= CA_RADIUS_PASSES; i++) sum += variance_at(curve, radius * pow(i, -0.5 * alpha));
    return sum / CA_RADIUS_PASSES / (CA_RADIUS_PASSES * light_paths);
}

/* The error over all forms of blur, in the mean of logarithms: what counts is by how many times it is the least. */
static double mean_error(const ca_radius_curve *curve, const blur_forms *forms, double alpha, double light_paths,
                         double radius)
{
    const double variance = variance_of_passes(curve, alpha, light_paths, radius);
    double sum = 0.0, likelihoods = 0.0;
    for (uint32_t i = 0; i < forms->count; i++) {
        if (forms->likelihood[i] < LEAST_LIKELIHOOD) continue;
        const double root = mean_root_of_blur(&forms->of[i], alpha, radius);
        sum += forms->likelihood[i] * log(root * root + variance);
        likelihoods += forms->likelihood[i];
    }
    return exp(sum / likelihoods);
}

double ca_radius_choose(const ca_radius_curve *measured, double alpha, double light_paths, double least, double most)
{
    blur_forms forms;
    find_forms(measured, &forms);
    ca_radius_curve curve = *measured;
    (curve.merging_alone ? take_law : take_envelope)(&curve);
    const int steps = (int)ceil(STEPS * log2(most / least));
    const double tolerance = curve.merging_alone ? CA_RADIUS_TOLERANCE : CA_RADIUS_SHARED_TOLERANCE;
    double errors[MOST_STEPS + 1], smallest = (double)INFINITY;
    assert(steps <= MOST_STEPS);
    for (int i = 0; i <= steps; i++) {
        errors[i] = mean_error(&curve, &forms, alpha, light_paths, least * exp2((double)i / STEPS));
        smallest = fmin(smallest, errors[i]);
    }
    for (int i = 0; i < steps; i++)
        if (errors[i] <= tolerance * smallest) return least * exp2((double)i / STEPS);
    return most;
}
