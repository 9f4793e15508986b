#include "film/film.h"

#include "base/memory.h"
#include "film/interval_layers.h"

#include <math.h>
#include <string.h>

_Static_assert(sizeof(ca_film_pixel) == 128 && sizeof(ca_film_groups) == 56,
               "film.h promises so many bytes per pixel");

ca_status ca_film_create(ca_film *film, uint32_t full_width, uint32_t full_height, const uint32_t crop[4],
                         ca_error *error)
{
    *film = (ca_film){.x0 = crop[0],
                      .y0 = crop[1],
                      .width = crop[2] - crop[0],
                      .height = crop[3] - crop[1],
                      .full_width = full_width,
                      .full_height = full_height,
                      .replicate_samples = 1};
    film->pixels = ca_alloc_zeroed((size_t)film->width * film->height, sizeof *film->pixels);
    return film->pixels ? CA_OK : ca_fail_memory(error, "the film");
}

void ca_film_destroy(ca_film *film)
{
    ca_free(film->pixels);
    ca_free(film->groups);
    *film = (ca_film){0};
}

void ca_film_clear(ca_film *film)
{
    memset(film->pixels, 0, (size_t)film->width * film->height * sizeof *film->pixels);
}

ca_status ca_film_set_replicates(ca_film *film, uint32_t samples, ca_error *error)
{
    ca_free(film->groups);
    film->groups = NULL;
    film->replicate_samples = samples;
    if (samples <= 1) return CA_OK;
    film->groups = ca_alloc_zeroed((size_t)film->width * film->height, sizeof *film->groups);
    return film->groups ? CA_OK : ca_fail_memory(error, "the film");
}

double ca_film_pixel_bytes(uint32_t replicate_samples)
{
    return (double)(sizeof(ca_film_pixel) + (replicate_samples > 1 ? sizeof(ca_film_groups) : 0));
}

static void add3(float sum[3], float a, float b, float c)
{
    sum[0] += a;
    sum[1] += b;
    sum[2] += c;
}

/* The group that just became complete. */
static void close_group(ca_film_pixel *pixel, ca_film_groups *groups, uint32_t samples)
{
    double value[4];
    for (int c = 0; c < 3; c++) {
        value[c] = (pixel->sum[c] - groups->sum[c]) / samples;
        groups->sum[c] = pixel->sum[c];
    }
    value[3] = ca_film_luminance(value);
    for (int c = 0; c < 4; c++) {
        groups->sum_squares[c] += value[c] * value[c];
        pixel->sum_cubes[c] += value[c] * value[c] * value[c];
    }
}

static bool add_sample(ca_film *film, ca_film_pixel *pixel, const ca_film_sample *sample)
{
    const ca_rgb r = sample->radiance;
    if (!(ca_rgb_is_finite(r) && r.r >= 0.0f && r.g >= 0.0f && r.b >= 0.0f && ca_rgb_is_finite(sample->splat)))
        return false;
    const ca_rgb value = ca_rgb_add(ca_rgb_scale(r, sample->filter_weight), sample->splat);
    const double rgb[3] = {(double)value.r, (double)value.g, (double)value.b};
    const double luminance = ca_film_luminance(rgb);
    for (int c = 0; c < 3; c++) {
        pixel->sum[c] += rgb[c];
        pixel->sum_squares[c] += rgb[c] * rgb[c];
    }
    pixel->sum_squares_luminance += luminance * luminance;
    if (film->replicate_samples == 1) {
        for (int c = 0; c < 3; c++) pixel->sum_cubes[c] += rgb[c] * rgb[c] * rgb[c];
        pixel->sum_cubes[3] += luminance * luminance * luminance;
    }
    add3(pixel->albedo, sample->albedo.r, sample->albedo.g, sample->albedo.b);
    add3(pixel->normal, sample->normal.x, sample->normal.y, sample->normal.z);
    add3(pixel->position, sample->position.x, sample->position.y, sample->position.z);
    return true;
}

bool ca_film_add(ca_film *film, uint32_t x, uint32_t y, const ca_film_sample *sample)
{
    const size_t i = (size_t)y * film->width + x;
    ca_film_pixel *pixel = &film->pixels[i];
    pixel->samples++;
    const bool good = add_sample(film, pixel, sample);
    if (film->groups && pixel->samples % film->replicate_samples == 0)
        close_group(pixel, &film->groups[i], film->replicate_samples);
    return good;
}

/* Unbiased sample variance from sums; 0 under two samples. */
static double variance(double sum, double sum_squares, double n)
{
    return n < 2.0 ? 0.0 : fmax(0.0, (sum_squares - sum * sum / n) / (n - 1.0));
}

static double luminance_sum(const ca_film_pixel *pixel) { return ca_film_luminance(pixel->sum); }

static ca_film_pixel pixel_of_film(const void *user, size_t i)
{
    const ca_film *film = user;
    return film->pixels[i];
}

ca_film_summary ca_film_summarise_source(const ca_film *film, const ca_film_source *source)
{
    const size_t count = (size_t)film->width * film->height;
    double mean = 0.0, deviation = 0.0, variance_of_means = 0.0;
    bool known = count > 0;
    for (size_t i = 0; i < count; i++) {
        const ca_film_pixel pixel = source->pixel(source->user, i);
        const double n = pixel.samples;
        if (n < 2.0) known = false;
        if (n < 1.0) continue;
        const double v = variance(luminance_sum(&pixel), pixel.sum_squares_luminance, n);
        mean += luminance_sum(&pixel) / n;
        deviation += sqrt(v);
        variance_of_means += v / n;
    }
    ca_film_summary summary = {.mean_luminance = mean / (double)count,
                               .mean_standard_deviation = deviation / (double)count,
                               .noise = (double)NAN};
    if (known && mean > 0.0) summary.noise = sqrt(variance_of_means / (double)count) / summary.mean_luminance;
    return summary;
}

ca_film_summary ca_film_summarise(const ca_film *film)
{
    return ca_film_summarise_source(film, &(ca_film_source){pixel_of_film, film});
}

/* Development: one table says which channel holds what, in the order in which they are added. */
typedef enum film_quantity {
    MEAN,
    VARIANCE,
    RELATIVE_VARIANCE,
    ALBEDO,
    NORMAL,
    POSITION,
    STANDARD_DEVIATION, /* of the luminance */
    SAMPLES,
} film_quantity;

static const struct film_layer {
    const char *name;
    film_quantity quantity;
    int component;
} film_layers[] = {
    {"R", MEAN, 0},
    {"G", MEAN, 1},
    {"B", MEAN, 2},
    {"Albedo.R", ALBEDO, 0},
    {"Albedo.G", ALBEDO, 1},
    {"Albedo.B", ALBEDO, 2},
    {"N.X", NORMAL, 0},
    {"N.Y", NORMAL, 1},
    {"N.Z", NORMAL, 2},
    {"P.X", POSITION, 0},
    {"P.Y", POSITION, 1},
    {"P.Z", POSITION, 2},
    {"Variance.R", VARIANCE, 0},
    {"Variance.G", VARIANCE, 1},
    {"Variance.B", VARIANCE, 2},
    {"RelativeVariance.R", RELATIVE_VARIANCE, 0},
    {"RelativeVariance.G", RELATIVE_VARIANCE, 1},
    {"RelativeVariance.B", RELATIVE_VARIANCE, 2},
    {"StandardDeviation.Y", STANDARD_DEVIATION, 0},
    {"Samples.Y", SAMPLES, 0},
};

static double pixel_quantity(const ca_film_pixel *pixel, film_quantity quantity, int c)
{
    const double n = pixel->samples;
    if (n == 0.0) return 0.0;
    const double mean = pixel->sum[c] / n;
    const double v = variance(pixel->sum[c], pixel->sum_squares[c], n);
    switch (quantity) {
    case MEAN: return mean;
    case VARIANCE: return v;
    case RELATIVE_VARIANCE: return mean != 0.0 ? v / (mean * mean) : 0.0;
    case ALBEDO: return (double)pixel->albedo[c] / n;
    case NORMAL: return (double)pixel->normal[c] / n;
    case POSITION: return (double)pixel->position[c] / n;
    case STANDARD_DEVIATION: return sqrt(variance(luminance_sum(pixel), pixel->sum_squares_luminance, n));
    case SAMPLES: return n;
    }
    return 0.0;
}

static ca_status develop_layer(const ca_film *film, const ca_film_source *source, const struct film_layer *layer,
                               ca_image_layers *layers, ca_error *error)
{
    float *data;
    CA_TRY(ca_layers_add(layers, layer->name, &data, error));
    const size_t count = (size_t)film->width * film->height;
    for (size_t i = 0; i < count; i++) {
        const ca_film_pixel pixel = source->pixel(source->user, i);
        data[i] = (float)pixel_quantity(&pixel, layer->quantity, layer->component);
    }
    return CA_OK;
}

/* ---- Error bars ------------------------------------------------------------------------------------------------ */

/* Of channel c: R, G, B, Y. */
static ca_moments replicate_moments(const ca_film *film, size_t i, int c)
{
    const ca_film_pixel *pixel = &film->pixels[i];
    const uint32_t samples = film->replicate_samples, replicates = pixel->samples / samples;
    const double cubes = pixel->sum_cubes[c];
    if (!film->groups) {
        const double squares = c < 3 ? pixel->sum_squares[c] : pixel->sum_squares_luminance;
        return ca_moments_of(c < 3 ? pixel->sum[c] : luminance_sum(pixel), squares, cubes, replicates);
    }
    const ca_film_groups *groups = &film->groups[i];
    const double sum = c < 3 ? groups->sum[c] : ca_film_luminance(groups->sum);
    return ca_moments_of(sum / samples, groups->sum_squares[c], cubes, replicates);
}

static void fill_intervals(const ca_moments *moments, const ca_verdict *verdicts, size_t count,
                           const ca_interval_layers *intervals)
{
    uint32_t replicates = 0;
    double quantile = 0.0;
    for (size_t i = 0; i < count; i++) {
        if (verdicts[i].kind != CA_INTERVAL_MARKED && moments[i].replicates != replicates) {
            replicates = moments[i].replicates;
            quantile = ca_student_two_sided_quantile(0.05, replicates - 1.0);
        }
        ca_interval_layers_set(intervals, i, &moments[i], &verdicts[i], quantile);
    }
}

/* `moments` and `verdicts`: room for every pixel. */
static ca_status develop_confidence(const ca_film *film, ca_moments *moments, ca_verdict *verdicts,
                                    ca_image_layers *layers, ca_error *error)
{
    const size_t count = (size_t)film->width * film->height;
    for (int c = 0; c < 4; c++) {
        ca_interval_layers intervals;
        CA_TRY(ca_interval_layers_add(&intervals, layers, "RGBY"[c], error));
        for (size_t i = 0; i < count; i++) moments[i] = replicate_moments(film, i, c);
        CA_TRY(ca_confidence_judge(moments, film->width, film->height, verdicts, error));
        fill_intervals(moments, verdicts, count, &intervals);
    }
    return CA_OK;
}

static ca_status add_confidence(const ca_film *film, ca_image_layers *layers, ca_error *error)
{
    if (film->replicate_samples == 0) return CA_OK;
    const size_t count = (size_t)film->width * film->height;
    ca_moments *moments = ca_alloc(count, sizeof *moments);
    ca_verdict *verdicts = ca_alloc(count, sizeof *verdicts);
    const ca_status status = moments && verdicts ? develop_confidence(film, moments, verdicts, layers, error)
                                                 : ca_fail_memory(error, "the error bars");
    ca_free(moments);
    ca_free(verdicts);
    return status;
}

/* ---- All of it ------------------------------------------------------------------------------------------------- */

ca_status ca_film_develop_source(const ca_film *film, const ca_film_source *source, ca_image_layers **layers,
                                 ca_error *error)
{
    CA_TRY(ca_layers_create(layers, film->width, film->height, error));
    (*layers)->full_width = film->full_width;
    (*layers)->full_height = film->full_height;
    (*layers)->x0 = (int32_t)film->x0;
    (*layers)->y0 = (int32_t)film->y0;
    ca_status status = CA_OK;
    for (size_t i = 0; i < sizeof film_layers / sizeof film_layers[0] && status == CA_OK; i++)
        status = develop_layer(film, source, &film_layers[i], *layers, error);
    if (status != CA_OK) {
        ca_layers_destroy(*layers);
        *layers = NULL;
    }
    return status;
}

ca_status ca_film_develop(const ca_film *film, ca_image_layers **layers, ca_error *error)
{
    CA_TRY(ca_film_develop_source(film, &(ca_film_source){pixel_of_film, film}, layers, error));
    const ca_status status = add_confidence(film, *layers, error);
    if (status != CA_OK) {
        ca_layers_destroy(*layers);
        *layers = NULL;
    }
    return status;
}
