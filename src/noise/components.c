#include "noise/components.h"

#include <assert.h>
#include <math.h>

/* An estimate that is linear in the means of the iterations' quantities and in L^2. */
typedef struct combination {
    double means[CA_PAIR_QUANTITIES]; /* factors; what has the factor 0 may be unknown */
    double luminance2;
} combination;

static double mean_of(const ca_pair_pixel *pixel, int quantity)
{
    return pixel->sums[quantity] / (double)pixel->iterations;
}

/* Mean of l_j l_k over pairs of different iterations. */
static double luminance2_of(const ca_pair_pixel *pixel)
{
    const double n = (double)pixel->iterations, sum = pixel->sums[CA_PAIR_VALUE];
    const double squares = pixel->products[ca_pair_product(CA_PAIR_VALUE, CA_PAIR_VALUE)];
    return (sum * sum - squares) / (n * (n - 1.0));
}

/* Unbiased covariance of two quantities of one iteration. */
static double covariance(const ca_pair_pixel *pixel, int a, int b)
{
    const double n = (double)pixel->iterations;
    return (pixel->products[ca_pair_product(a, b)] - pixel->sums[a] * pixel->sums[b] / n) / (n - 1.0);
}

/* Of a sum of squares that rounding may have made slightly negative; what is unknown stays so. */
static double root(double variance) { return variance < 0.0 ? 0.0 : sqrt(variance); }

/* The delta method: to first order an iteration moves the estimate by `influence` times its quantities over the number of
 * iterations, and it moves L^2 by 2 L l. */
static ca_noise_value estimate(const ca_pair_pixel *pixel, const combination *c)
{
    double value = c->luminance2 * luminance2_of(pixel), influence[CA_PAIR_QUANTITIES], variance = 0.0;
    for (int q = 0; q < CA_PAIR_QUANTITIES; q++) {
        influence[q] = c->means[q];
        if (c->means[q] != 0.0) value += c->means[q] * mean_of(pixel, q);
    }
    influence[CA_PAIR_VALUE] += c->luminance2 * 2.0 * mean_of(pixel, CA_PAIR_VALUE);
    for (int a = 0; a < CA_PAIR_QUANTITIES; a++)
        for (int b = 0; b < CA_PAIR_QUANTITIES; b++)
            if (influence[a] != 0.0 && influence[b] != 0.0) variance += influence[a] * influence[b] * covariance(pixel, a, b);
    return (ca_noise_value){value, root(variance / (double)pixel->iterations)};
}

ca_noise_components ca_noise_components_of(const ca_pair_pixel *pixel)
{
    assert(pixel->iterations >= 2);
    return (ca_noise_components){
        .luminance = estimate(pixel, &(combination){.means[CA_PAIR_VALUE] = 1.0}),
        .luminance2 = estimate(pixel, &(combination){.luminance2 = 1.0}),
        .pair = estimate(pixel, &(combination){.means[CA_PAIR_PAIR] = 1.0}),
        .camera = estimate(pixel, &(combination){.means[CA_PAIR_CAMERA] = 1.0}),
        .light = estimate(pixel, &(combination){.means[CA_PAIR_LIGHT] = 1.0}),
    };
}

/* The unbiased sample variance s^2 of the value. The variance of s^2 is (m4 - s^4 (n - 3) / (n - 1)) / n with the fourth central
 * moment m4, which is made of raw moments here: of values whose scatter is below 1e-3 of their mean it begins to lose digits. */
static ca_noise_value sample_variance(const ca_pair_pixel *pixel)
{
    const double n = (double)pixel->iterations, mean = mean_of(pixel, CA_PAIR_VALUE), mean2 = mean * mean;
    const double squares = pixel->products[ca_pair_product(CA_PAIR_VALUE, CA_PAIR_VALUE)];
    const double s2 = covariance(pixel, CA_PAIR_VALUE, CA_PAIR_VALUE);
    const double m4 = (pixel->fourths - 4.0 * mean * pixel->cubes + 6.0 * mean2 * squares) / n - 3.0 * mean2 * mean2;
    return (ca_noise_value){s2, root((m4 - s2 * s2 * (n - 3.0) / (n - 1.0)) / n)};
}

/* A term of (6): its factor times a component without L^2. */
static combination term(int quantity, double factor)
{
    combination c = {.luminance2 = -factor};
    c.means[quantity] = factor;
    return c;
}

static combination sum_of(const combination *a, const combination *b)
{
    combination sum = {.luminance2 = a->luminance2 + b->luminance2};
    for (int q = 0; q < CA_PAIR_QUANTITIES; q++) sum.means[q] = a->means[q] + b->means[q];
    return sum;
}

ca_noise_terms ca_noise_terms_of(const ca_pair_pixel *pixel, double light_paths, double camera_paths)
{
    assert(pixel->iterations >= 2 && light_paths >= 1.0 && camera_paths >= 1.0);
    const combination pair = term(CA_PAIR_PAIR, 1.0 / (light_paths * camera_paths));
    const combination camera = term(CA_PAIR_CAMERA, (1.0 - 1.0 / light_paths) / camera_paths);
    const combination light = term(CA_PAIR_LIGHT, (1.0 - 1.0 / camera_paths) / light_paths);
    const combination two = sum_of(&pair, &camera), all = sum_of(&two, &light);
    return (ca_noise_terms){
        .pair = estimate(pixel, &pair),
        .camera = estimate(pixel, &camera),
        .light = estimate(pixel, &light),
        .predicted = estimate(pixel, &all),
        .measured = sample_variance(pixel),
    };
}

/* ---- Averages ------------------------------------------------------------------------------------------------------ */

/* Adds one pixel's variance to the sums of variances, of their roots, and of pixels below zero. */
static void add_variance(double variance, double *sum, double *root_sum, uint64_t *negative)
{
    *sum += variance;
    *root_sum += root(variance);
    if (variance < 0.0) ++*negative;
}

static void add_pixel(ca_noise_summary *s, const ca_pair_pixel *pixel, double light_paths, double camera_paths)
{
    const ca_noise_terms t = ca_noise_terms_of(pixel, light_paths, camera_paths);
    s->pixels++;
    s->luminance += mean_of(pixel, CA_PAIR_VALUE);
    add_variance(t.predicted.value, &s->predicted, &s->predicted_rms, &s->negative_predicted);
    add_variance(t.measured.value, &s->measured, &s->measured_rms, &s->negative_measured);
    add_variance(t.camera.value, &s->camera, &s->camera_rms, &s->negative_camera);
    add_variance(t.light.value, &s->light, &s->light_rms, &s->negative_light);
    add_variance(t.pair.value, &s->pair, &s->pair_rms, &s->negative_pair);
}

ca_noise_summary ca_noise_summarise(const ca_pair_film *film, const uint32_t rect[4], double light_paths,
                                    double camera_paths)
{
    assert(rect[0] >= film->x0 && rect[1] >= film->y0 && rect[0] < rect[2] && rect[1] < rect[3]);
    assert(rect[2] - film->x0 <= film->width && rect[3] - film->y0 <= film->height);
    ca_noise_summary s = {0};
    for (uint32_t y = rect[1]; y < rect[3]; y++)
        for (uint32_t x = rect[0]; x < rect[2]; x++)
            add_pixel(&s, &film->pixels[(size_t)(y - film->y0) * film->width + (x - film->x0)], light_paths, camera_paths);
    double *const sums[] = {&s.luminance,    &s.predicted, &s.predicted_rms, &s.measured, &s.measured_rms, &s.camera,
                            &s.camera_rms,   &s.light,     &s.light_rms,     &s.pair,     &s.pair_rms};
    for (size_t i = 0; i < sizeof sums / sizeof sums[0]; i++) *sums[i] /= (double)s.pixels;
    return s;
}
