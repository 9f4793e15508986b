#include "film/film.h"

#include "base/loading.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "film/film_bars.h"

#include <assert.h>
#include <math.h>
#include <stddef.h>
#include <string.h>

_Static_assert(sizeof(ca_film_sample) - offsetof(ca_film_sample, albedo) == CA_PASS_FEATURES * sizeof(float),
               "albedo, normal and position lie next to each other");
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
    ca_free(film->parts);
    ca_free(film->group_parts);
    *film = (ca_film){0};
}

void ca_film_clear(ca_film *film)
{
    const size_t count = (size_t)film->width * film->height;
    assert(!film->groups);
    if (film->pixels) memset(film->pixels, 0, count * sizeof *film->pixels);
    if (film->parts) memset(film->parts, 0, count * sizeof *film->parts);
    if (film->group_parts) memset(film->group_parts, 0, count * sizeof *film->group_parts);
}

ca_status ca_film_add_up_in_parts(ca_film *film, float extent, ca_error *error)
{
    assert(film->replicate_samples == 1 && extent > 0.0f);
    ca_free(film->pixels);
    film->pixels = NULL;
    film->extent = fmaxf(0x1p-100f, fminf(exp2f(ceilf(log2f(extent))), 0x1p127f));
    film->parts = ca_alloc_large_zeroed((size_t)film->width * film->height, sizeof *film->parts);
    return film->parts ? CA_OK : ca_fail_memory(error, "the film");
}

ca_status ca_film_set_replicates(ca_film *film, uint32_t samples, ca_error *error)
{
    const size_t count = (size_t)film->width * film->height;
    ca_free(film->groups);
    ca_free(film->group_parts);
    film->groups = NULL;
    film->group_parts = NULL;
    film->replicate_samples = samples;
    if (samples <= 1) return CA_OK;
    if (film->parts)
        film->group_parts = ca_alloc_zeroed(count, sizeof *film->group_parts);
    else
        film->groups = ca_alloc_zeroed(count, sizeof *film->groups);
    return film->groups || film->group_parts ? CA_OK : ca_fail_memory(error, "the film");
}

double ca_film_pixel_bytes(uint32_t replicate_samples)
{
    return sizeof(ca_pass_sums) + (replicate_samples > 1 ? sizeof(ca_group_sums) : 0);
}

/* ---- Adding ---------------------------------------------------------------------------------------------------- */

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

static void add_value(const ca_film *film, ca_film_pixel *pixel, const ca_film_sample *sample, const float rgb[3])
{
    double value[4] = {(double)rgb[0], (double)rgb[1], (double)rgb[2]};
    value[3] = ca_film_luminance(value);
    for (int c = 0; c < 3; c++) {
        pixel->sum[c] += value[c];
        pixel->sum_squares[c] += value[c] * value[c];
    }
    pixel->sum_squares_luminance += value[3] * value[3];
    if (film->replicate_samples == 1)
        for (int c = 0; c < 4; c++) pixel->sum_cubes[c] += value[c] * value[c] * value[c];
    add3(pixel->albedo, sample->albedo.r, sample->albedo.g, sample->albedo.b);
    add3(pixel->normal, sample->normal.x, sample->normal.y, sample->normal.z);
    add3(pixel->position, sample->position.x, sample->position.y, sample->position.z);
}

/* The gate; what passes it is in value[]: R, G, B. */
static bool value_of(const ca_film_sample *sample, float value[3])
{
    const ca_rgb r = sample->radiance;
    if (!(ca_rgb_is_finite(r) && r.r >= 0.0f && r.g >= 0.0f && r.b >= 0.0f && ca_rgb_is_finite(sample->splat)))
        return false;
    const ca_rgb sum = ca_rgb_add(ca_rgb_scale(r, sample->filter_weight), sample->splat);
    value[0] = sum.r;
    value[1] = sum.g;
    value[2] = sum.b;
    return ca_rgb_is_finite(sum);
}


static void end_sample(const ca_film *film, size_t i)
{
    const uint32_t each = film->replicate_samples, samples = ++film->pixels[i].samples;
    if (each > 1 && samples % each == 0) close_group(&film->pixels[i], &film->groups[i], each);
}

/* Units of the first-hit sums. */
static const double feature_unit = 0x1p-22;

bool ca_film_make_addend(const ca_film *film, const ca_film_sample *s, ca_pass_addend *addend)
{
    /* Where they are: collected in an array they would be waited for. */
    const float *features = (const float *)(const void *)((const char *)s + offsetof(ca_film_sample, albedo));
    const float unit = (float)(1.0 / feature_unit), scale[3] = {unit, unit, unit / film->extent};
    const bool good = value_of(s, addend->value);
    if (good)
        ca_pass_addend_set_features(addend, features, scale);
    else
        *addend = (ca_pass_addend){.value = {0.0f}};
    return good;
}

void ca_film_add_addends(ca_film *film, uint32_t x, uint32_t y, uint32_t count, const ca_pass_addend *addends)
{
    const uint32_t each = film->replicate_samples;
    const size_t first = (size_t)y * film->width + x;
    ca_pass_sums_add_row(&film->parts[first], addends, count, each == 1);
    for (uint32_t i = 0; film->group_parts && i < count; i++) {
        ca_pass_sums *sums = &film->parts[first + i];
        ca_group_sums *group = &film->group_parts[first + i];
        for (int c = 0; c < 3; c++) group->open[c] += (double)addends[i].value[c];
        if (sums->samples % each == 0) ca_pass_sums_close_group(sums, group, each);
    }
}

static bool add_to_parts(ca_film *film, uint32_t x, uint32_t y, const ca_film_sample *sample)
{
    ca_pass_addend addend;
    const bool good = ca_film_make_addend(film, sample, &addend);
    ca_film_add_addends(film, x, y, 1, &addend);
    return good;
}

bool ca_film_add(ca_film *film, uint32_t x, uint32_t y, const ca_film_sample *sample)
{
    if (film->parts) return add_to_parts(film, x, y, sample);
    const size_t i = (size_t)y * film->width + x;
    float value[3];
    const bool good = value_of(sample, value);
    if (good) add_value(film, &film->pixels[i], sample, value);
    end_sample(film, i);
    return good;
}

/* ---- Sums of parts --------------------------------------------------------------------------------------------- */

static ca_film_pixel pixel_of_parts(const ca_film *film, size_t i)
{
    const ca_pass_sums *from = &film->parts[i];
    ca_film_pixel to = {.samples = from->samples};
    double values[CA_PASS_SUMS];
    ca_pass_sums_values(from, film->group_parts ? &film->group_parts[i] : NULL, values);
    memcpy(to.sum, values + CA_PASS_VALUES, sizeof to.sum);
    memcpy(to.sum_squares, values + CA_PASS_SQUARES, sizeof to.sum_squares);
    to.sum_squares_luminance = values[CA_PASS_SQUARES + 3];
    memcpy(to.sum_cubes, values + CA_PASS_CUBES, sizeof to.sum_cubes);
    for (int c = 0; c < 3; c++) {
        to.albedo[c] = (float)(ca_pass_sums_feature(from, c) * feature_unit);
        to.normal[c] = (float)(ca_pass_sums_feature(from, 3 + c) * feature_unit);
        to.position[c] = (float)(ca_pass_sums_feature(from, 6 + c) * feature_unit * (double)film->extent);
    }
    return to;
}

ca_film_pixel ca_film_pixel_at(const ca_film *film, size_t i)
{
    return film->parts ? pixel_of_parts(film, i) : film->pixels[i];
}

size_t ca_film_row_bytes_of(uint32_t width, uint32_t replicate_samples)
{
    const size_t pixel = CA_PASS_SUMS_BYTES + (replicate_samples > 1 ? CA_GROUP_SUMS_BYTES : 0);
    return (width * pixel + 7) / 8 * 8;
}

size_t ca_film_row_bytes(const ca_film *film) { return ca_film_row_bytes_of(film->width, film->replicate_samples); }

/* Filled up with zeros. */
void ca_film_write_row(const ca_film *film, uint32_t row, unsigned char *bytes)
{
    const size_t first = (size_t)row * film->width;
    memset(bytes + ca_film_row_bytes(film) - 8, 0, 8);
    for (size_t i = first; i < first + film->width; i++) {
        ca_pass_sums_write(&film->parts[i], bytes);
        bytes += CA_PASS_SUMS_BYTES;
        if (!film->group_parts) continue;
        ca_group_sums_write(&film->group_parts[i], bytes);
        bytes += CA_GROUP_SUMS_BYTES;
    }
}

static bool is_open(const ca_group_sums *group)
{
    return group->open[0] != 0.0 || group->open[1] != 0.0 || group->open[2] != 0.0;
}

static bool read_group(const ca_film *film, uint32_t samples, const unsigned char *bytes, bool first,
                       ca_group_sums *group)
{
    if (!ca_group_sums_read(group, samples, bytes)) return false;
    return !is_open(group) || (first && samples % film->replicate_samples != 0);
}

bool ca_film_add_row(ca_film *film, uint32_t row, const unsigned char *bytes, uint32_t samples, bool first)
{
    const size_t begin = (size_t)row * film->width;
    for (size_t i = begin; i < begin + film->width; i++) {
        ca_group_sums *const group = film->group_parts ? &film->group_parts[i] : NULL, read;
        ca_pass_sums sums;
        if (!ca_pass_sums_read(&sums, bytes) || sums.samples != samples) return false;
        bytes += CA_PASS_SUMS_BYTES;
        if (group && !read_group(film, samples, bytes, first, &read)) return false;
        if (group) bytes += CA_GROUP_SUMS_BYTES;
        if (first) {
            film->parts[i] = sums;
            if (group) *group = read;
        } else {
            ca_pass_sums_add_sums(&film->parts[i], group, &sums, &read);
        }
    }
    return true;
}

/* ---- What is known of the image -------------------------------------------------------------------------------- */

/* Unbiased sample variance from sums; 0 under two samples, and where it may be nothing but the rounding of squares
 * (binned_sum.h). */
static double variance(double sum, double sum_squares, double n)
{
    const double difference = sum_squares - sum * sum / n;
    return n < 2.0 || difference < 0x1p-46 * sum_squares ? 0.0 : difference / (n - 1.0);
}

static double luminance_sum(const ca_film_pixel *pixel) { return ca_film_luminance(pixel->sum); }

static ca_film_pixel pixel_of_film(const void *user, size_t i) { return ca_film_pixel_at(user, i); }

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
                               .mean_standard_deviation = known ? deviation / (double)count : (double)NAN,
                               .noise = (double)NAN};
    if (known && mean > 0.0) summary.noise = sqrt(variance_of_means / (double)count) / summary.mean_luminance;
    return summary;
}

ca_film_summary ca_film_summarise(const ca_film *film)
{
    return ca_film_summarise_source(film, &(ca_film_source){pixel_of_film, film});
}

/* Development: one table says which layer holds what, in the order in which they are added. */
typedef enum film_quantity {
    MEAN, /* likewise of R, G, B: */
    ALBEDO = MEAN + 3,
    NORMAL = ALBEDO + 3,
    POSITION = NORMAL + 3,
    VARIANCE = POSITION + 3,
    RELATIVE_VARIANCE = VARIANCE + 3,
    STANDARD_DEVIATION = RELATIVE_VARIANCE + 3, /* of the luminance */
    SAMPLES,
    LAYERS
} film_quantity;

static const char *const layer_names[LAYERS] = {
    [MEAN] = "R", "G", "B",
    [ALBEDO] = "Albedo.R", "Albedo.G", "Albedo.B",
    [NORMAL] = "N.X", "N.Y", "N.Z",
    [POSITION] = "P.X", "P.Y", "P.Z",
    [VARIANCE] = "Variance.R", "Variance.G", "Variance.B",
    [RELATIVE_VARIANCE] = "RelativeVariance.R", "RelativeVariance.G", "RelativeVariance.B",
    [STANDARD_DEVIATION] = "StandardDeviation.Y",
    [SAMPLES] = "Samples.Y",
};

/* Of a pixel that has samples. */
static void find_quantities(const ca_film_pixel *pixel, double values[LAYERS])
{
    const double n = pixel->samples;
    for (int c = 0; c < 3; c++) {
        const double mean = pixel->sum[c] / n, v = variance(pixel->sum[c], pixel->sum_squares[c], n);
        values[MEAN + c] = mean;
        values[ALBEDO + c] = (double)pixel->albedo[c] / n;
        values[NORMAL + c] = (double)pixel->normal[c] / n;
        values[POSITION + c] = (double)pixel->position[c] / n;
        values[VARIANCE + c] = v;
        values[RELATIVE_VARIANCE + c] = mean != 0.0 ? v / (mean * mean) : 0.0;
    }
    values[STANDARD_DEVIATION] = sqrt(variance(luminance_sum(pixel), pixel->sum_squares_luminance, n));
    values[SAMPLES] = n;
}

typedef struct layer_work {
    const ca_film_source *source;
    float *data[LAYERS];
    size_t count; /* of pixels; likewise: */
} layer_work;

/* So many pixels are developed together. */
enum { PIXELS_OF_A_TASK = 4096 };

static uint32_t development_tasks(size_t count)
{
    return (uint32_t)((count + PIXELS_OF_A_TASK - 1) / PIXELS_OF_A_TASK);
}

static size_t end_of_task(uint32_t task, size_t count)
{
    const size_t end = ((size_t)task + 1) * PIXELS_OF_A_TASK;
    return end < count ? end : count;
}

static void develop_pixels(void *user, uint32_t task, uint32_t worker)
{
    (void)worker;
    const layer_work *work = user;
    const size_t end = end_of_task(task, work->count);
    for (size_t i = (size_t)task * PIXELS_OF_A_TASK; i < end; i++) {
        const ca_film_pixel pixel = work->source->pixel(work->source->user, i);
        double values[LAYERS] = {0.0};
        if (pixel.samples > 0) find_quantities(&pixel, values);
        for (int l = 0; l < LAYERS; l++) work->data[l][i] = (float)values[l];
    }
}

static ca_status develop_layers(const ca_film *film, const ca_film_source *source, uint32_t threads,
                                ca_image_layers *layers, ca_error *error)
{
    layer_work work = {.source = source, .count = (size_t)film->width * film->height};
    for (int l = 0; l < LAYERS; l++) CA_TRY(ca_layers_add(layers, layer_names[l], &work.data[l], error));
    ca_parallel_surely(threads, development_tasks(work.count), develop_pixels, &work);
    return ca_loading_check(error);
}

/* ---- All of it ------------------------------------------------------------------------------------------------- */

ca_status ca_film_develop_source(const ca_film *film, const ca_film_source *source, uint32_t threads,
                                 ca_image_layers **layers, ca_error *error)
{
    CA_TRY(ca_layers_create(layers, film->width, film->height, error));
    (*layers)->full_width = film->full_width;
    (*layers)->full_height = film->full_height;
    (*layers)->x0 = (int32_t)film->x0;
    (*layers)->y0 = (int32_t)film->y0;
    const ca_status status = develop_layers(film, source, threads, *layers, error);
    if (status != CA_OK) {
        ca_layers_destroy(*layers);
        *layers = NULL;
    }
    return status;
}

/* Other kinds of films have a few layers more. */
size_t ca_film_develop_bytes(bool error_bars)
{
    enum { OTHER_LAYERS = 8, INTERVAL_LAYERS = 12 };
    const size_t layers = LAYERS + OTHER_LAYERS;
    return (error_bars ? layers + INTERVAL_LAYERS : layers) * sizeof(float);
}

ca_status ca_film_develop(const ca_film *film, uint32_t threads, ca_image_layers **layers, ca_error *error)
{
    CA_TRY(ca_film_develop_source(film, &(ca_film_source){pixel_of_film, film}, threads, layers, error));
    const ca_status status = ca_film_bars_add(film, threads, *layers, error);
    if (status != CA_OK) {
        ca_layers_destroy(*layers);
        *layers = NULL;
    }
    return status;
}
