#include "noise/components.h"

#include <assert.h>
#include <math.h>

/* What the iterations measured at a pixel: all, or means alone, from which no errors can be told. */
typedef struct pixel_sums {
    const ca_pair_pixel *pixel;
    const ca_pair_connections *connections; /* NULL: there are none */
    const ca_pair_means *means;             /* instead of `pixel`, but for its number of iterations; likewise: */
    const ca_pair_connected_means *connected_means;
} pixel_sums;

static bool connects(const pixel_sums *s) { return s->connections || s->connected_means; }

/* An estimate that is linear in the means of the iterations' quantities, and in L^2, L L_D and L_D^2; L_D is what
 * connections bring. */
typedef struct combination {
    double means[CA_PAIR_ALL_QUANTITIES]; /* factors; what has the factor 0 may be unknown */
    double luminance2, cross, connected2;
} combination;

static double sum_over_iterations(const pixel_sums *s, int quantity)
{
    if (quantity < CA_PAIR_QUANTITIES) return s->means ? s->means->sums[quantity] : s->pixel->sums[quantity];
    const int connected = quantity - CA_PAIR_QUANTITIES;
    return s->means ? s->connected_means->sums[connected] : s->connections->sums[connected];
}

/* Means have those of the value and of what connections bring. */
static double product_over_iterations(const pixel_sums *s, int a, int b)
{
    if (s->means)
        return a == CA_PAIR_CONNECTED   ? s->connected_means->squares
               : b == CA_PAIR_CONNECTED ? s->connected_means->cross
                                        : s->means->squares;
    return a < CA_PAIR_QUANTITIES && b < CA_PAIR_QUANTITIES
               ? s->pixel->products[ca_pair_product(a, b)]
               : s->connections->products[ca_pair_connected_product(a, b)];
}

static double mean_of(const pixel_sums *s, int quantity)
{
    return sum_over_iterations(s, quantity) / (double)s->pixel->iterations;
}

/* Mean of a_j b_k over pairs of different iterations. */
static double product_of_means(const pixel_sums *s, int a, int b)
{
    const double n = (double)s->pixel->iterations;
    return (sum_over_iterations(s, a) * sum_over_iterations(s, b) - product_over_iterations(s, a, b)) /
           (n * (n - 1.0));
}

/* Unbiased covariance of two quantities of one iteration. */
static double covariance(const pixel_sums *s, int a, int b)
{
    const double n = (double)s->pixel->iterations;
    return (product_over_iterations(s, a, b) - sum_over_iterations(s, a) * sum_over_iterations(s, b) / n) / (n - 1.0);
}

/* Of a sum of squares that rounding may have made slightly negative; what is unknown stays so. */
static double root(double variance) { return variance < 0.0 ? 0.0 : sqrt(variance); }

/* The delta method: to first order an iteration moves the estimate by `influence` times its quantities over the
 * number of iterations, and it moves L^2 by 2 L l. */
static double error_of(const pixel_sums *s, const combination *c)
{
    const int count = connects(s) ? CA_PAIR_ALL_QUANTITIES : CA_PAIR_QUANTITIES;
    double variance = 0.0, influence[CA_PAIR_ALL_QUANTITIES];
    for (int q = 0; q < count; q++) influence[q] = c->means[q];
    influence[CA_PAIR_VALUE] += c->luminance2 * 2.0 * mean_of(s, CA_PAIR_VALUE);
    if (connects(s)) {
        influence[CA_PAIR_VALUE] += c->cross * mean_of(s, CA_PAIR_CONNECTED);
        influence[CA_PAIR_CONNECTED] +=
            c->cross * mean_of(s, CA_PAIR_VALUE) + c->connected2 * 2.0 * mean_of(s, CA_PAIR_CONNECTED);
    }
    for (int a = 0; a < count; a++)
        for (int b = 0; b < count; b++)
            if (influence[a] != 0.0 && influence[b] != 0.0)
                variance += influence[a] * influence[b] * covariance(s, a, b);
    return root(variance / (double)s->pixel->iterations);
}

static ca_noise_value estimate(const pixel_sums *s, const combination *c)
{
    const int count = connects(s) ? CA_PAIR_ALL_QUANTITIES : CA_PAIR_QUANTITIES;
    double value = c->luminance2 * product_of_means(s, CA_PAIR_VALUE, CA_PAIR_VALUE);
    for (int q = 0; q < count; q++)
        if (c->means[q] != 0.0) value += c->means[q] * mean_of(s, q);
    if (connects(s)) {
        value += c->cross * product_of_means(s, CA_PAIR_VALUE, CA_PAIR_CONNECTED);
        value += c->connected2 * product_of_means(s, CA_PAIR_CONNECTED, CA_PAIR_CONNECTED);
    }
    return (ca_noise_value){value, s->means ? (double)NAN : error_of(s, c)};
}

ca_noise_excess ca_noise_excess_of(const ca_pair_means *means, uint32_t iterations)
{
    const double n = iterations, sum = means->sums[CA_PAIR_VALUE];
    assert(iterations >= 2);
    const double luminance2 = (sum * sum - means->squares) / (n * (n - 1.0)); /* products of different iterations */
    return (ca_noise_excess){.luminance = sum / n,
                             .luminance2 = luminance2,
                             .pair = means->sums[CA_PAIR_PAIR] / n - luminance2,
                             .camera = means->sums[CA_PAIR_CAMERA] / n - luminance2,
                             .light = means->sums[CA_PAIR_LIGHT] / n - luminance2};
}

ca_noise_components ca_noise_components_of(const ca_pair_pixel *pixel)
{
    assert(pixel->iterations >= 2);
    const pixel_sums sums = {.pixel = pixel};
    return (ca_noise_components){
        .luminance = estimate(&sums, &(combination){.means[CA_PAIR_VALUE] = 1.0}),
        .luminance2 = estimate(&sums, &(combination){.luminance2 = 1.0}),
        .pair = estimate(&sums, &(combination){.means[CA_PAIR_PAIR] = 1.0}),
        .camera = estimate(&sums, &(combination){.means[CA_PAIR_CAMERA] = 1.0}),
        .light = estimate(&sums, &(combination){.means[CA_PAIR_LIGHT] = 1.0}),
    };
}

/* The unbiased sample variance s^2 of the value. The variance of s^2 is (m4 - s^4 (n - 3) / (n - 1)) / n with the
 * fourth central moment m4, which is made of raw moments here: of values whose scatter is below 1e-3 of their mean it
 * begins to lose digits. */
static ca_noise_value sample_variance(const pixel_sums *s)
{
    const double n = (double)s->pixel->iterations, mean = mean_of(s, CA_PAIR_VALUE), mean2 = mean * mean;
    const double squares = product_over_iterations(s, CA_PAIR_VALUE, CA_PAIR_VALUE);
    const double s2 = covariance(s, CA_PAIR_VALUE, CA_PAIR_VALUE);
    const double m4 =
        (s->pixel->fourths - 4.0 * mean * s->pixel->cubes + 6.0 * mean2 * squares) / n - 3.0 * mean2 * mean2;
    return (ca_noise_value){s2, root((m4 - s2 * s2 * (n - 3.0) / (n - 1.0)) / n)};
}

/* ---- Terms ----------------------------------------------------------------------------------------------------- */

ca_noise_factors ca_noise_factors_of(double light_paths, double camera_paths)
{
    return (ca_noise_factors){.pair = 1.0 / (light_paths * camera_paths),
                              .camera = (1.0 - 1.0 / light_paths) / camera_paths,
                              .light = (1.0 - 1.0 / camera_paths) / light_paths};
}

/* A term of (6): its factor times a component without L^2, which is (L - L_D)^2 where L has connections in it. */
static combination term(int quantity, double factor)
{
    combination c = {.luminance2 = -factor, .cross = 2.0 * factor, .connected2 = -factor};
    c.means[quantity] = factor;
    return c;
}

/* The same of products of C and D, of which (L - L_D) L_D is taken. */
static combination connected_term(int quantity, double factor)
{
    combination c = {.cross = -factor, .connected2 = factor};
    c.means[quantity] = factor;
    return c;
}

static combination sum_of(const combination *a, const combination *b)
{
    combination sum = {.luminance2 = a->luminance2 + b->luminance2,
                       .cross = a->cross + b->cross,
                       .connected2 = a->connected2 + b->connected2};
    for (int q = 0; q < CA_PAIR_ALL_QUANTITIES; q++) sum.means[q] = a->means[q] + b->means[q];
    return sum;
}

/* (C1) of docs/papers/000.md without the variance of C; each light path is connected once at most. */
static combination connections_term(double light_paths, double camera_paths)
{
    const ca_noise_factors factors = ca_noise_factors_of(light_paths, camera_paths);
    const combination pair = connected_term(CA_PAIR_CONNECTED_PAIR, 2.0 * factors.pair);
    const combination camera = connected_term(CA_PAIR_CONNECTED_CAMERA, 2.0 * factors.camera);
    const combination light = connected_term(CA_PAIR_CONNECTED_LIGHT, 2.0 * factors.light);
    combination own = {.connected2 = -1.0 / camera_paths};
    own.means[CA_PAIR_CONNECTED_SQUARE] = 1.0 / camera_paths;
    const combination two = sum_of(&pair, &camera), three = sum_of(&two, &light);
    return sum_of(&three, &own);
}

static ca_noise_terms terms_of(const pixel_sums *s, double light_paths, double camera_paths)
{
    assert(s->pixel->iterations >= 2 && light_paths >= 1.0 && camera_paths >= 1.0);
    const ca_noise_factors factors = ca_noise_factors_of(light_paths, camera_paths);
    const combination pair = term(CA_PAIR_PAIR, factors.pair);
    const combination camera = term(CA_PAIR_CAMERA, factors.camera);
    const combination light = term(CA_PAIR_LIGHT, factors.light);
    const combination connect = connections_term(light_paths, camera_paths);
    const combination two = sum_of(&pair, &camera), three = sum_of(&two, &light), all = sum_of(&three, &connect);
    const ca_noise_value unknown = {(double)NAN, (double)NAN};
    const bool connected_once = camera_paths <= light_paths;
    return (ca_noise_terms){
        .pair = estimate(s, &pair),
        .camera = estimate(s, &camera),
        .light = estimate(s, &light),
        .predicted = !connects(s) ? estimate(s, &three) : connected_once ? estimate(s, &all) : unknown,
        .measured = sample_variance(&(pixel_sums){.pixel = s->pixel}),
        .connect = !connects(s) ? (ca_noise_value){0} : connected_once ? estimate(s, &connect) : unknown,
    };
}

/* `of`: one of the film's others; NULL: by the film's own weights. */
static pixel_sums sums_at(const ca_pair_film *film, const ca_pair_film *of, size_t pixel)
{
    return (pixel_sums){.pixel = &film->pixels[pixel],
                        .connections = !of && film->connections ? &film->connections[pixel] : NULL,
                        .means = of ? &of->means[pixel] : NULL,
                        .connected_means = of && of->connected_means ? &of->connected_means[pixel] : NULL};
}

static double value_of(const pixel_sums *s, combination c) { return estimate(s, &c).value; }

static ca_noise_coefficients coefficients_of(const pixel_sums *s)
{
    ca_noise_coefficients c = {.pair = value_of(s, term(CA_PAIR_PAIR, 1.0)),
                               .camera = value_of(s, term(CA_PAIR_CAMERA, 1.0)),
                               .light = value_of(s, term(CA_PAIR_LIGHT, 1.0))};
    if (!connects(s)) return c;
    combination own = {.connected2 = -1.0};
    own.means[CA_PAIR_CONNECTED_SQUARE] = 1.0;
    c.connected = value_of(s, own);
    c.connected_pair = value_of(s, connected_term(CA_PAIR_CONNECTED_PAIR, 1.0));
    c.connected_camera = value_of(s, connected_term(CA_PAIR_CONNECTED_CAMERA, 1.0));
    c.connected_light = value_of(s, connected_term(CA_PAIR_CONNECTED_LIGHT, 1.0));
    return c;
}

ca_noise_coefficients ca_noise_coefficients_at(const ca_pair_film *film, const ca_pair_film *other, size_t pixel)
{
    const pixel_sums s = sums_at(film, other, pixel);
    return coefficients_of(&s);
}

ca_noise_coefficients ca_noise_coefficients_of(const ca_pair_film *film, uint32_t iterations, size_t pixel)
{
    assert(iterations >= 2 && film->means);
    const ca_pair_pixel count = {.iterations = iterations};
    return coefficients_of(&(pixel_sums){
        .pixel = &count,
        .means = &film->means[pixel],
        .connected_means = film->connected_means ? &film->connected_means[pixel] : NULL,
    });
}

void ca_noise_coefficients_add(ca_noise_coefficients *sum, const ca_noise_coefficients *c, double weight)
{
    sum->pair += weight * c->pair;
    sum->camera += weight * c->camera;
    sum->light += weight * c->light;
    sum->connected += weight * c->connected;
    sum->connected_pair += weight * c->connected_pair;
    sum->connected_camera += weight * c->connected_camera;
    sum->connected_light += weight * c->connected_light;
}

void ca_noise_coefficients_mix(ca_noise_coefficients *sum, const ca_noise_coefficients *c, double share)
{
    const ca_noise_coefficients before = *sum;
    *sum = (ca_noise_coefficients){0};
    ca_noise_coefficients_add(sum, &before, 1.0 - share);
    ca_noise_coefficients_add(sum, c, share);
}

double ca_noise_variance(const ca_noise_coefficients *c, double light_paths, double camera_paths)
{
    const ca_noise_factors factors = ca_noise_factors_of(light_paths, camera_paths);
    return factors.pair * (c->pair + 2.0 * c->connected_pair) +
           factors.camera * (c->camera + 2.0 * c->connected_camera) +
           factors.light * (c->light + 2.0 * c->connected_light) + c->connected / camera_paths;
}

ca_noise_terms ca_noise_terms_of(const ca_pair_pixel *pixel, double light_paths, double camera_paths)
{
    return terms_of(&(pixel_sums){.pixel = pixel}, light_paths, camera_paths);
}

ca_noise_terms ca_noise_terms_at(const ca_pair_film *film, size_t pixel, double light_paths, double camera_paths)
{
    const pixel_sums sums = sums_at(film, NULL, pixel);
    return terms_of(&sums, light_paths, camera_paths);
}

ca_noise_terms ca_noise_terms_of_other(const ca_pair_film *film, uint32_t other, size_t pixel)
{
    const ca_pair_film *of = &film->others[other];
    const pixel_sums sums = sums_at(film, of, pixel);
    return terms_of(&sums, of->light_paths, of->camera_paths);
}

/* ---- Averages -------------------------------------------------------------------------------------------------- */

/* Adds one pixel's variance to the sums of variances, of their roots, and of pixels below zero. */
static void add_variance(double variance, double *sum, double *root_sum, uint64_t *negative)
{
    *sum += variance;
    *root_sum += root(variance);
    if (variance < 0.0) ++*negative;
}

static void add_pixel(ca_noise_summary *s, double luminance, const ca_noise_terms *t)
{
    s->pixels++;
    s->luminance += luminance;
    add_variance(t->predicted.value, &s->predicted, &s->predicted_rms, &s->negative_predicted);
    add_variance(t->measured.value, &s->measured, &s->measured_rms, &s->negative_measured);
    add_variance(t->camera.value, &s->camera, &s->camera_rms, &s->negative_camera);
    add_variance(t->light.value, &s->light, &s->light_rms, &s->negative_light);
    add_variance(t->pair.value, &s->pair, &s->pair_rms, &s->negative_pair);
    add_variance(t->connect.value, &s->connect, &s->connect_rms, &s->negative_connect);
}

static void divide(ca_noise_summary *s)
{
    double *const sums[] = {&s->luminance,  &s->predicted, &s->predicted_rms, &s->measured, &s->measured_rms,
                            &s->camera,     &s->camera_rms, &s->light,        &s->light_rms, &s->pair,
                            &s->pair_rms,   &s->connect,   &s->connect_rms};
    for (size_t i = 0; i < sizeof sums / sizeof sums[0]; i++) *sums[i] /= (double)s->pixels;
}

/* `other` NULL: of the film's own weights. */
static ca_noise_summary summarise(const ca_pair_film *film, const uint32_t rect[4], const uint32_t *other,
                                  double light_paths, double camera_paths)
{
    assert(rect[0] >= film->x0 && rect[1] >= film->y0 && rect[0] < rect[2] && rect[1] < rect[3]);
    assert(rect[2] - film->x0 <= film->width && rect[3] - film->y0 <= film->height);
    ca_noise_summary s = {0};
    for (uint32_t y = rect[1]; y < rect[3]; y++)
        for (uint32_t x = rect[0]; x < rect[2]; x++) {
            const size_t pixel = (size_t)(y - film->y0) * film->width + (x - film->x0);
            const ca_noise_terms terms = other ? ca_noise_terms_of_other(film, *other, pixel)
                                               : ca_noise_terms_at(film, pixel, light_paths, camera_paths);
            add_pixel(&s, mean_of(&(pixel_sums){.pixel = &film->pixels[pixel]}, CA_PAIR_VALUE), &terms);
        }
    divide(&s);
    return s;
}

ca_noise_summary ca_noise_summarise(const ca_pair_film *film, const uint32_t rect[4], double light_paths,
                                    double camera_paths)
{
    return summarise(film, rect, NULL, light_paths, camera_paths);
}

ca_noise_summary ca_noise_summarise_other(const ca_pair_film *film, const uint32_t rect[4], uint32_t other)
{
    return summarise(film, rect, &other, 0.0, 0.0);
}
