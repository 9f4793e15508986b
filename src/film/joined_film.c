#include "film/joined_film.h"

#include "base/loading.h"
#include "base/memory.h"
#include "film/interval_layers.h"
#include "film/pair_interval.h"

#include <assert.h>
#include <math.h>
#include <string.h>

_Static_assert(sizeof(ca_joined_pixel) == 160, "joined_film.h promises 160 bytes per pixel");

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

void ca_joined_film_copy(ca_joined_film *joined, const ca_joined_film *from)
{
    assert(joined->count == from->count);
    memcpy(joined->pixels, from->pixels, joined->count * sizeof *joined->pixels);
}

/* ---- Adding ---------------------------------------------------------------------------------------------------- */

static double channel_sum(const ca_film_pixel *part, int c)
{
    return c < 3 ? part->sum[c] : ca_film_luminance(part->sum);
}

static double channel_squares(const ca_film_pixel *part, int c)
{
    return c < 3 ? part->sum_squares[c] : part->sum_squares_luminance;
}

static double *channel_variance(ca_joined_pixel *pixel, int c)
{
    return c < 3 ? &pixel->variance[c] : &pixel->luminance_variance;
}

/* Channel c of samples with these moments, whose weighted mean has `variance` times their variance and `third` times
 * their third moment. */
static void add_moments(ca_joined_pixel *to, int c, const ca_moments *m, double variance, double third)
{
    const double added = variance * m->variance;
    *channel_variance(to, c) += added;
    to->third[c] += third * m->third;
    to->scatter[c] += added * added / (m->replicates - 1.0);
}

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
    to->samples += part->samples;
    add_features(to, part, weight);
}

void ca_joined_film_add(ca_joined_film *joined, const ca_film *part, double weight)
{
    assert(part->replicate_samples == 1);
    for (size_t i = 0; i < joined->count; i++) {
        const ca_film_pixel *p = &part->pixels[i];
        const double scale = weight / p->samples;
        assert(p->samples >= 2);
        add_means(&joined->pixels[i], p, weight);
        for (int c = 0; c < 4; c++) {
            const ca_moments m = ca_moments_of(channel_sum(p, c), channel_squares(p, c), p->sum_cubes[c], p->samples);
            add_moments(&joined->pixels[i], c, &m, weight * scale, weight * scale * scale);
        }
    }
}

void ca_joined_film_add_two(ca_joined_film *joined, const ca_film *a, double weight_a, const ca_film *b,
                            double weight_b)
{
    assert(a->replicate_samples == 1 && b->replicate_samples == 1);
    for (size_t i = 0; i < joined->count; i++) {
        const ca_film_pixel *p = &a->pixels[i], *q = &b->pixels[i];
        const double scale_a = weight_a / p->samples, scale_b = weight_b / q->samples;
        assert(p->samples >= 1 && q->samples >= 1);
        add_means(&joined->pixels[i], p, weight_a);
        add_means(&joined->pixels[i], q, weight_b);
        for (int c = 0; c < 4; c++) {
            const ca_moments m =
                ca_moments_of(channel_sum(p, c) + channel_sum(q, c), channel_squares(p, c) + channel_squares(q, c),
                              p->sum_cubes[c] + q->sum_cubes[c], p->samples + q->samples);
            add_moments(&joined->pixels[i], c, &m, weight_a * scale_a + weight_b * scale_b,
                        weight_a * scale_a * scale_a + weight_b * scale_b * scale_b);
        }
    }
}

void ca_joined_film_scale(ca_joined_film *joined, double factor)
{
    for (size_t i = 0; i < joined->count; i++) {
        ca_joined_pixel *pixel = &joined->pixels[i];
        for (int c = 0; c < 3; c++) {
            pixel->mean[c] *= factor;
            pixel->albedo[c] *= (float)factor;
            pixel->normal[c] *= (float)factor;
            pixel->position[c] *= (float)factor;
        }
        for (int c = 0; c < 4; c++) {
            *channel_variance(pixel, c) *= factor * factor;
            pixel->third[c] *= factor * factor * factor;
            pixel->scatter[c] *= factor * factor * (factor * factor);
        }
    }
}

/* ---- As a film ------------------------------------------------------------------------------------------------- */

typedef struct film_of_joined {
    const ca_joined_film *joined;
    uint32_t samples;
} film_of_joined;

/* The sum of squares from which n samples of this sum have the sample variance n * variance. */
static double squares_of(double sum, double variance, double n) { return n * variance * (n - 1.0) + sum * sum / n; }

static ca_film_pixel pixel_of_joined(const void *user, size_t i)
{
    const film_of_joined *f = user;
    const ca_joined_pixel *from = &f->joined->pixels[i];
    const double n = f->samples;
    ca_film_pixel to = {.samples = f->samples};
    for (int c = 0; c < 3; c++) {
        to.sum[c] = n * from->mean[c];
        to.sum_squares[c] = squares_of(to.sum[c], from->variance[c], n);
        to.albedo[c] = (float)(n * (double)from->albedo[c]);
        to.normal[c] = (float)(n * (double)from->normal[c]);
        to.position[c] = (float)(n * (double)from->position[c]);
    }
    to.sum_squares_luminance = squares_of(ca_film_luminance(to.sum), from->luminance_variance, n);
    return to;
}

ca_film_summary ca_joined_film_summarise(const ca_joined_film *joined, uint32_t samples, const ca_film *like)
{
    const film_of_joined user = {joined, samples};
    assert(samples >= 2 && joined->count == (size_t)like->width * like->height);
    return ca_film_summarise_source(like, &(ca_film_source){pixel_of_joined, &user});
}

ca_status ca_joined_film_develop(const ca_joined_film *joined, uint32_t samples, const ca_film *like,
                                 uint32_t threads, ca_image_layers **layers, ca_error *error)
{
    const film_of_joined user = {joined, samples};
    assert(samples >= 2 && joined->count == (size_t)like->width * like->height);
    CA_TRY(ca_film_develop_source(like, &(ca_film_source){pixel_of_joined, &user}, threads, layers, error));
    const ca_status status = ca_joined_film_add_confidence(joined, threads, *layers, error);
    if (status == CA_OK) return CA_OK;
    ca_layers_destroy(*layers);
    *layers = NULL;
    return status;
}

/* ---- Sums over the image --------------------------------------------------------------------------------------- */

static void add_to_sums(ca_joined_sums *sums, double luminance, double variance)
{
    sums->luminance += luminance;
    sums->variance += variance;
}

ca_joined_sums ca_joined_sums_of(const ca_joined_film *joined)
{
    ca_joined_sums sums = {0};
    for (size_t i = 0; i < joined->count; i++)
        add_to_sums(&sums, ca_film_luminance(joined->pixels[i].mean), joined->pixels[i].luminance_variance);
    return sums;
}

ca_joined_sums ca_joined_sums_of_film(const ca_film *film)
{
    ca_joined_sums sums = {0};
    for (size_t i = 0; i < (size_t)film->width * film->height; i++) {
        const ca_film_pixel *p = &film->pixels[i];
        const ca_moments m = ca_moments_of(channel_sum(p, 3), channel_squares(p, 3), p->sum_cubes[3], p->samples);
        add_to_sums(&sums, m.mean, m.variance / p->samples);
    }
    return sums;
}

ca_joined_sums ca_joined_sums_of_two(const ca_film *a, const ca_film *b)
{
    ca_joined_sums sums = {0};
    for (size_t i = 0; i < (size_t)a->width * a->height; i++) {
        const ca_film_pixel *p = &a->pixels[i], *q = &b->pixels[i];
        const ca_moments m = ca_moments_of(channel_sum(p, 3) + channel_sum(q, 3),
                                           channel_squares(p, 3) + channel_squares(q, 3),
                                           p->sum_cubes[3] + q->sum_cubes[3], p->samples + q->samples);
        add_to_sums(&sums, 0.5 * (channel_sum(p, 3) / p->samples + channel_sum(q, 3) / q->samples),
                    0.25 * m.variance * (1.0 / p->samples + 1.0 / q->samples));
    }
    return sums;
}

/* ---- Error bars ------------------------------------------------------------------------------------------------ */

/* As if the value were the mean of CA_CONFIDENCE_MIN_REPLICATES replicates: any number will do that is enough, and
 * the same for all pixels, since marks compare them. None where there are too few degrees of freedom. */
static ca_moments value_moments(const ca_joined_pixel *pixel, int c, double *degrees)
{
    const double n = CA_CONFIDENCE_MIN_REPLICATES, variance = c < 3 ? pixel->variance[c] : pixel->luminance_variance;
    *degrees = variance > 0.0 ? variance * variance / pixel->scatter[c] : pixel->samples - 1.0;
    return (ca_moments){.mean = c < 3 ? pixel->mean[c] : ca_film_luminance(pixel->mean),
                        .variance = n * variance,
                        .third = n * n * pixel->third[c],
                        .replicates = *degrees > n - 1.001 ? CA_CONFIDENCE_MIN_REPLICATES : 0};
}

/* Channel c; `moments` and `verdicts`: room for every pixel. */
static ca_status add_intervals(const ca_joined_film *joined, int c, uint32_t threads, ca_moments *moments,
                               ca_verdict *verdicts, ca_image_layers *layers, ca_error *error)
{
    ca_interval_layers intervals;
    double degrees;
    CA_TRY(ca_interval_layers_add(&intervals, layers, "RGBY"[c], error));
    for (size_t i = 0; i < joined->count; i++) {
        if (i % 65536 == 0) CA_TRY(ca_loading_check(error));
        moments[i] = value_moments(&joined->pixels[i], c, &degrees);
    }
    CA_TRY(ca_confidence_judge(moments, layers->width, layers->height, threads, verdicts, error));
    for (size_t i = 0; i < joined->count; i++) {
        (void)value_moments(&joined->pixels[i], c, &degrees);
        ca_interval_layers_set(&intervals, i, &moments[i], &verdicts[i], ca_pair_student_quantile(degrees));
    }
    return CA_OK;
}

ca_status ca_joined_film_add_confidence(const ca_joined_film *joined, uint32_t threads, ca_image_layers *layers,
                                        ca_error *error)
{
    assert(joined->count == (size_t)layers->width * layers->height);
    ca_moments *moments = ca_alloc(joined->count, sizeof *moments);
    ca_verdict *verdicts = ca_alloc(joined->count, sizeof *verdicts);
    ca_status status = moments && verdicts ? CA_OK : ca_fail_memory(error, "the error bars");
    for (int c = 0; c < 4 && status == CA_OK; c++)
        status = add_intervals(joined, c, threads, moments, verdicts, layers, error);
    ca_free(moments);
    ca_free(verdicts);
    return status;
}
