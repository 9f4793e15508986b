#include "film/halved_film.h"

#include "base/memory.h"

#include <assert.h>

_Static_assert(CA_HALVED_FILM_PIXEL_BYTES == 172, "halved_film.h promises 172 bytes a pixel");

ca_status ca_halved_film_create(ca_halved_film *halved, const ca_film *like, ca_error *error)
{
    *halved = (ca_halved_film){0};
    ca_status status = ca_joined_film_create(&halved->mean, like, error);
    if (status == CA_OK) halved->difference = ca_alloc_zeroed(halved->mean.count, sizeof *halved->difference);
    if (status == CA_OK && !halved->difference) status = ca_fail_memory(error, "the pilot's film");
    if (status != CA_OK) ca_halved_film_destroy(halved);
    return status;
}

void ca_halved_film_destroy(ca_halved_film *halved)
{
    ca_joined_film_destroy(&halved->mean);
    ca_free(halved->difference);
    *halved = (ca_halved_film){0};
}

void ca_halved_film_add(ca_halved_film *halved, const ca_film *a, const ca_film *b, double share)
{
    ca_joined_film_add_two(&halved->mean, a, 0.5 * share, b, 0.5 * share);
    for (size_t i = 0; i < halved->mean.count; i++) {
        const ca_film_pixel *p = &a->pixels[i], *q = &b->pixels[i];
        for (int c = 0; c < 3; c++)
            halved->difference[i][c] += (float)(0.5 * share * (p->sum[c] / p->samples - q->sum[c] / q->samples));
    }
}

void ca_halved_film_scale(ca_halved_film *halved, double factor)
{
    ca_joined_film_scale(&halved->mean, factor);
    for (size_t i = 0; i < halved->mean.count; i++)
        for (int c = 0; c < 3; c++) halved->difference[i][c] *= (float)factor;
}

double ca_halved_film_mean(const ca_halved_film *halved, size_t pixel, int half, int c)
{
    const double difference = (double)halved->difference[pixel][c];
    return halved->mean.pixels[pixel].mean[c] + (half == 0 ? difference : -difference);
}

static double joined_mean(const ca_halved_film *halved, size_t pixel, int c, double weight_a, double weight_b)
{
    return weight_a * ca_halved_film_mean(halved, pixel, 0, c) + weight_b * ca_halved_film_mean(halved, pixel, 1, c);
}

/* What the moments of (A + B) / 2 are multiplied by. */
typedef struct moment_factors {
    double variance, third, scatter;
} moment_factors;

static moment_factors factors_of(double a, double b)
{
    const double variance = 2.0 * (a * a + b * b);
    return (moment_factors){
        .variance = variance, .third = 4.0 * (a * a * a + b * b * b), .scatter = variance * variance};
}

static void join_moments(ca_joined_pixel *to, const ca_joined_pixel *from, const moment_factors *factors)
{
    for (int c = 0; c < 3; c++) to->variance[c] += factors->variance * from->variance[c];
    to->luminance_variance += factors->variance * from->luminance_variance;
    for (int c = 0; c < 4; c++) {
        to->third[c] += factors->third * from->third[c];
        to->scatter[c] += factors->scatter * from->scatter[c];
    }
}

ca_joined_sums ca_halved_film_sums(const ca_halved_film *halved, double weight_a, double weight_b)
{
    ca_joined_sums sums = {0};
    for (size_t i = 0; i < halved->mean.count; i++) {
        double mean[3];
        for (int c = 0; c < 3; c++) mean[c] = joined_mean(halved, i, c, weight_a, weight_b);
        sums.luminance += ca_film_luminance(mean);
        sums.variance += halved->mean.pixels[i].luminance_variance;
    }
    sums.variance *= factors_of(weight_a, weight_b).variance;
    return sums;
}

void ca_halved_film_join(const ca_halved_film *halved, double weight_a, double weight_b, ca_joined_film *joined)
{
    const moment_factors factors = factors_of(weight_a, weight_b);
    const double sum = weight_a + weight_b;
    assert(joined->count == halved->mean.count);
    for (size_t i = 0; i < joined->count; i++) {
        const ca_joined_pixel *from = &halved->mean.pixels[i];
        ca_joined_pixel *to = &joined->pixels[i];
        for (int c = 0; c < 3; c++) {
            to->mean[c] += joined_mean(halved, i, c, weight_a, weight_b);
            to->albedo[c] += (float)(sum * (double)from->albedo[c]);
            to->normal[c] += (float)(sum * (double)from->normal[c]);
            to->position[c] += (float)(sum * (double)from->position[c]);
        }
        join_moments(to, from, &factors);
        to->samples += from->samples;
    }
}
