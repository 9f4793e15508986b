#include "film/joined_film.h"

#include "base/memory.h"

#include <assert.h>
#include <math.h>
#include <string.h>

_Static_assert(sizeof(ca_joined_pixel) == 96, "joined_film.h promises 96 bytes per pixel");

ca_status ca_joined_film_create(ca_joined_film *joined, const ca_film *like, ca_error *error)
{
    joined->count = (size_t)like->width * like->height;
    joined->pixels = ca_alloc_zeroed(joined->count, sizeof *joined->pixels);
    return joined->pixels ? CA_OK : ca_fail_memory(error, "the joined film");
}

void ca_joined_film_destroy(ca_joined_film *joined)
{
    ca_free(joined->pixels);
    *joined = (ca_joined_film){0};
}

void ca_joined_film_clear(ca_joined_film *joined) { memset(joined->pixels, 0, joined->count * sizeof *joined->pixels); }

void ca_joined_film_copy(ca_joined_film *joined, const ca_joined_film *from)
{
    assert(joined->count == from->count);
    memcpy(joined->pixels, from->pixels, joined->count * sizeof *joined->pixels);
}

/* ---- Adding -------------------------------------------------------------------------------------------------------- */

static double luminance_of(const double rgb[3]) { return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]; }

/* Squared deviations from the mean, summed; rounding may make the difference slightly negative. */
static double deviations(double sum, double sum_squares, double n) { return fmax(0.0, sum_squares - sum * sum / n); }

static void add_features(ca_joined_pixel *to, const ca_film_pixel *part, double weight)
{
    const double scale = weight / part->samples;
    for (int c = 0; c < 3; c++) {
        to->albedo[c] += (float)(scale * (double)part->albedo[c]);
        to->normal[c] += (float)(scale * (double)part->normal[c]);
        to->position[c] += (float)(scale * (double)part->position[c]);
    }
}

static void add_means(ca_joined_pixel *to, const ca_film_pixel *part, double weight)
{
    for (int c = 0; c < 3; c++) to->mean[c] += weight * part->sum[c] / part->samples;
    add_features(to, part, weight);
}

void ca_joined_film_add(ca_joined_film *joined, const ca_film *part, double weight)
{
    for (size_t i = 0; i < joined->count; i++) {
        const ca_film_pixel *p = &part->pixels[i];
        ca_joined_pixel *to = &joined->pixels[i];
        const double n = p->samples, scale = weight * weight / (n * (n - 1.0));
        assert(p->samples >= 2);
        add_means(to, p, weight);
        for (int c = 0; c < 3; c++) to->variance[c] += scale * deviations(p->sum[c], p->sum_squares[c], n);
        to->luminance_variance += scale * deviations(luminance_of(p->sum), p->sum_squares_luminance, n);
    }
}

void ca_joined_film_add_two(ca_joined_film *joined, const ca_film *a, double weight_a, const ca_film *b, double weight_b)
{
    for (size_t i = 0; i < joined->count; i++) {
        const ca_film_pixel *p = &a->pixels[i], *q = &b->pixels[i];
        ca_joined_pixel *to = &joined->pixels[i];
        const double n_a = p->samples, n_b = q->samples, n = n_a + n_b;
        assert(p->samples >= 1 && q->samples >= 1);
        const double scale = (weight_a * weight_a / n_a + weight_b * weight_b / n_b) / (n - 1.0);
        add_means(to, p, weight_a);
        add_means(to, q, weight_b);
        for (int c = 0; c < 3; c++)
            to->variance[c] += scale * deviations(p->sum[c] + q->sum[c], p->sum_squares[c] + q->sum_squares[c], n);
        to->luminance_variance += scale * deviations(luminance_of(p->sum) + luminance_of(q->sum),
                                                     p->sum_squares_luminance + q->sum_squares_luminance, n);
    }
}

void ca_joined_film_scale(ca_joined_film *joined, double factor)
{
    for (size_t i = 0; i < joined->count; i++) {
        ca_joined_pixel *pixel = &joined->pixels[i];
        for (int c = 0; c < 3; c++) {
            pixel->mean[c] *= factor;
            pixel->variance[c] *= factor * factor;
            pixel->albedo[c] *= (float)factor;
            pixel->normal[c] *= (float)factor;
            pixel->position[c] *= (float)factor;
        }
        pixel->luminance_variance *= factor * factor;
    }
}

/* ---- As a film ------------------------------------------------------------------------------------------------------ */

/* The sum of squares from which n samples of this sum have the sample variance n * variance. */
static double squares_of(double sum, double variance, double n) { return n * variance * (n - 1.0) + sum * sum / n; }

void ca_joined_film_to_film(const ca_joined_film *joined, uint32_t samples, ca_film *film)
{
    const double n = samples;
    assert(samples >= 2 && joined->count == (size_t)film->width * film->height);
    film->replicate_samples = 0; /* of what was joined no skewness is known, so there are no error bars */
    for (size_t i = 0; i < joined->count; i++) {
        const ca_joined_pixel *from = &joined->pixels[i];
        ca_film_pixel *to = &film->pixels[i];
        for (int c = 0; c < 3; c++) {
            to->sum[c] = n * from->mean[c];
            to->sum_squares[c] = squares_of(to->sum[c], from->variance[c], n);
            to->albedo[c] = (float)(n * (double)from->albedo[c]);
            to->normal[c] = (float)(n * (double)from->normal[c]);
            to->position[c] = (float)(n * (double)from->position[c]);
        }
        to->sum_squares_luminance = squares_of(luminance_of(to->sum), from->luminance_variance, n);
        to->samples = samples;
    }
}
