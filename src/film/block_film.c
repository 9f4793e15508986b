#include "film/block_film.h"

#include "base/little_endian.h"
#include "base/loading.h"
#include "base/memory.h"
#include "film/exact_sum.h"
#include "film/interval_layers.h"
#include "film/pair_interval.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* Fixed-point sums of a pixel's camera paths, in this order. */
enum { ALBEDO = 0, NORMAL = 3, POSITION = 6, PATH_SUMS = 9 };
enum { UNIT_EXPONENT = -28, HEADROOM = 16 };

typedef struct block_pixel {
    ca_exact_sum radiance[3];
    uint64_t pairs, paths;
    uint64_t path_sums[PATH_SUMS]; /* two's complement: unsigned numbers may go round */
} block_pixel;

typedef struct block_gradient {
    ca_exact_sum sums[3];
} block_gradient;

/* Sums over blocks. */
enum { CAMERA, LIGHT, PAIR, MERGED, COVARIANCES };
enum {
    BAR_BLOCKS,
    BAR_LOST,           /* of which a covariance or the sample itself was out of bounds */
    BAR_FIRST,          /* that were the first of all */
    BAR_CAMERA_SQUARES, /* of how many blocks each camera path has met: by so much a block makes them grow */
    BAR_LIGHT_SQUARES,
    BAR_COUNTS
};

/* The light's covariances are weighted by what their block adds to the squares: each block of light paths counts by
 * the square of how often it was met, as it does in the variance, even where radii differ. */
typedef struct block_bars {
    ca_exact_sum covariances[COVARIANCES];
    uint64_t counts[BAR_COUNTS];
} block_bars;

enum { PIXEL_BYTES = 208, GRADIENT_BYTES = 120, BARS_BYTES = 200 };
_Static_assert(sizeof(block_pixel) == PIXEL_BYTES && sizeof(block_gradient) == GRADIENT_BYTES &&
                   sizeof(block_bars) == BARS_BYTES,
               "block_film.h promises 208 bytes a pixel, 120 more with gradients, 200 with error bars");

struct ca_block_film {
    ca_block_film_desc desc;
    uint32_t width, height;    /* of the crop */
    double position_unit;      /* a power of two */
    block_pixel *pixels;       /* owned, width * height, row by row */
    block_gradient *gradients; /* owned, likewise; NULL: not wanted */
    block_bars *bars;          /* likewise */
};

/* ---- Life ------------------------------------------------------------------------------------------------------ */

ca_status ca_block_film_create(ca_block_film **film, const ca_block_film_desc *desc, ca_error *error)
{
    assert(desc->extent > 0.0f && desc->crop[0] < desc->crop[2] && desc->crop[1] < desc->crop[3]);
    *film = NULL;
    ca_block_film *made = ca_alloc_zeroed(1, sizeof *made);
    if (!made) return ca_fail_memory(error, "the film");
    made->desc = *desc;
    made->width = desc->crop[2] - desc->crop[0];
    made->height = desc->crop[3] - desc->crop[1];
    int exponent;
    const float fraction = frexpf(desc->extent, &exponent); /* in [0.5, 1) */
    if (fraction == 0.5f) exponent--;
    if (exponent > 127) exponent = 127; /* the largest power among floats; the headroom covers the rest */
    made->desc.extent = ldexpf(1.0f, exponent);
    made->position_unit = ldexp(1.0, exponent + UNIT_EXPONENT);
    const size_t count = (size_t)made->width * made->height;
    made->pixels = ca_alloc_zeroed(count, sizeof *made->pixels);
    if (desc->gradients) made->gradients = ca_alloc_zeroed(count, sizeof *made->gradients);
    if (desc->error_bars) made->bars = ca_alloc_zeroed(count, sizeof *made->bars);
    if (!made->pixels || (desc->gradients && !made->gradients) || (desc->error_bars && !made->bars)) {
        ca_block_film_destroy(made);
        return ca_fail_memory(error, "the film");
    }
    *film = made;
    return CA_OK;
}

void ca_block_film_destroy(ca_block_film *film)
{
    if (!film) return;
    ca_free(film->pixels);
    ca_free(film->gradients);
    ca_free(film->bars);
    ca_free(film);
}

const ca_block_film_desc *ca_block_film_described(const ca_block_film *film) { return &film->desc; }

bool ca_block_film_desc_equal(const ca_block_film_desc *a, const ca_block_film_desc *b)
{
    bool equal = a->full_width == b->full_width && a->full_height == b->full_height && a->gradients == b->gradients &&
                 a->error_bars == b->error_bars && a->extent == b->extent;
    for (int i = 0; i < 4; i++) equal = equal && a->crop[i] == b->crop[i];
    return equal;
}

static size_t pixel_bytes(const ca_block_film_desc *desc)
{
    return (size_t)PIXEL_BYTES + (desc->gradients ? GRADIENT_BYTES : 0) + (desc->error_bars ? BARS_BYTES : 0);
}

double ca_block_film_bytes(const ca_block_film_desc *desc)
{
    return (double)(desc->crop[2] - desc->crop[0]) * (double)(desc->crop[3] - desc->crop[1]) *
           (double)pixel_bytes(desc);
}

/* ---- Sums ------------------------------------------------------------------------------------------------------ */

static bool is_finite3(ca_vec3 a) { return isfinite(a.x) && isfinite(a.y) && isfinite(a.z); }

/* The sample's fixed-point sums; false where one is out of bounds or not a number. */
static bool quantise(const ca_block_film *film, const ca_block_sample *sample, uint64_t sums[PATH_SUMS])
{
    const float values[PATH_SUMS] = {sample->albedo.r,   sample->albedo.g,   sample->albedo.b,
                                     sample->normal.x,   sample->normal.y,   sample->normal.z,
                                     sample->position.x, sample->position.y, sample->position.z};
    const double unit = ldexp(1.0, UNIT_EXPONENT), limit = HEADROOM * (double)sample->paths / unit;
    const double scales[2] = {1.0 / unit, 1.0 / film->position_unit}; /* powers of two: nothing is rounded */
    for (int i = 0; i < PATH_SUMS; i++) {
        const double units = (double)values[i] * scales[i >= POSITION];
        if (!(fabs(units) <= limit)) return false;
        sums[i] = (uint64_t)llrint(units);
    }
    return true;
}

static void add_exactly(ca_exact_sum sums[3], float a, float b, float c)
{
    ca_exact_sum_add(&sums[0], a);
    ca_exact_sum_add(&sums[1], b);
    ca_exact_sum_add(&sums[2], c);
}

static void add_bars(block_bars *bars, const ca_block_sample *sample, bool in_bounds)
{
    const uint64_t grows_camera = 2 * sample->visits_camera + 1, grows_light = 2 * sample->visits_light + 1;
    const ca_pair_covariance *c = &sample->covariance;
    const float terms[COVARIANCES] = {[CAMERA] = (float)c->camera,
                                      [LIGHT] = (float)(c->light * (double)grows_light),
                                      [PAIR] = (float)c->pair,
                                      [MERGED] = (float)c->merged};
    bool kept = in_bounds;
    for (int i = 0; i < COVARIANCES; i++) kept = kept && isfinite(terms[i]);
    bars->counts[BAR_BLOCKS]++;
    bars->counts[BAR_LOST] += !kept;
    bars->counts[BAR_FIRST] += sample->visits_camera == 0 && sample->visits_light == 0;
    bars->counts[BAR_CAMERA_SQUARES] += grows_camera;
    bars->counts[BAR_LIGHT_SQUARES] += grows_light;
    for (int i = 0; i < COVARIANCES && kept; i++) ca_exact_sum_add(&bars->covariances[i], terms[i]);
}

bool ca_block_film_add(ca_block_film *film, uint32_t x, uint32_t y, const ca_block_sample *sample)
{
    const uint32_t *crop = film->desc.crop;
    assert(x >= crop[0] && y >= crop[1] && x < crop[2] && y < crop[3]);
    const size_t index = (size_t)(y - crop[1]) * film->width + (x - crop[0]);
    block_pixel *pixel = &film->pixels[index];
    pixel->pairs += sample->pairs;
    pixel->paths += sample->paths;
    uint64_t sums[PATH_SUMS];
    const ca_vec3 gradient = sample->irradiance_gradient;
    const bool in_bounds = ca_rgb_is_finite(sample->radiance) && (!film->gradients || is_finite3(gradient)) &&
                           quantise(film, sample, sums);
    if (film->bars) add_bars(&film->bars[index], sample, in_bounds);
    if (!in_bounds) return false;
    add_exactly(pixel->radiance, sample->radiance.r, sample->radiance.g, sample->radiance.b);
    if (film->gradients) add_exactly(film->gradients[index].sums, gradient.x, gradient.y, gradient.z);
    for (int i = 0; i < PATH_SUMS; i++) pixel->path_sums[i] += sums[i];
    return true;
}

static void add_three(ca_exact_sum sums[3], const ca_exact_sum others[3])
{
    for (int c = 0; c < 3; c++) ca_exact_sum_add_sum(&sums[c], &others[c]);
}

static void add_pixel(block_pixel *pixel, const block_pixel *other)
{
    add_three(pixel->radiance, other->radiance);
    pixel->pairs += other->pairs;
    pixel->paths += other->paths;
    for (int i = 0; i < PATH_SUMS; i++) pixel->path_sums[i] += other->path_sums[i];
}

static void add_bars_of(block_bars *bars, const block_bars *other)
{
    for (int i = 0; i < COVARIANCES; i++) ca_exact_sum_add_sum(&bars->covariances[i], &other->covariances[i]);
    for (int i = 0; i < BAR_COUNTS; i++) bars->counts[i] += other->counts[i];
}

/* To the i-th pixel; what the film does not have is not looked at. */
static void add_sums(ca_block_film *film, size_t i, const block_pixel *pixel, const block_gradient *gradient,
                     const block_bars *bars)
{
    add_pixel(&film->pixels[i], pixel);
    if (film->gradients) add_three(film->gradients[i].sums, gradient->sums);
    if (film->bars) add_bars_of(&film->bars[i], bars);
}

void ca_block_film_add_film(ca_block_film *film, const ca_block_film *other)
{
    assert(ca_block_film_desc_equal(&film->desc, &other->desc));
    const size_t count = (size_t)film->width * film->height;
    for (size_t i = 0; i < count; i++)
        add_sums(film, i, &other->pixels[i], film->gradients ? &other->gradients[i] : NULL,
                 film->bars ? &other->bars[i] : NULL);
}

void ca_block_film_clear(ca_block_film *film)
{
    const size_t count = (size_t)film->width * film->height;
    memset(film->pixels, 0, count * sizeof *film->pixels);
    if (film->gradients) memset(film->gradients, 0, count * sizeof *film->gradients);
    if (film->bars) memset(film->bars, 0, count * sizeof *film->bars);
}

/* ---- Development ----------------------------------------------------------------------------------------------- */

static double mean_over_pairs(const block_pixel *pixel, const ca_exact_sum *sum)
{
    return pixel->pairs ? ca_exact_sum_value(sum) / (double)pixel->pairs : 0.0;
}

static double pixel_luminance(const block_pixel *pixel)
{
    static const double weights[3] = {0.2126, 0.7152, 0.0722};
    double sum = 0.0;
    for (int c = 0; c < 3; c++) sum += weights[c] * mean_over_pairs(pixel, &pixel->radiance[c]);
    return sum;
}

double ca_block_film_mean_luminance(const ca_block_film *film)
{
    const size_t count = (size_t)film->width * film->height;
    double sum = 0.0;
    for (size_t i = 0; i < count; i++) sum += pixel_luminance(&film->pixels[i]);
    return sum / (double)count;
}

/* What the pixel's blocks tell together; false: nothing. */
static bool pixel_variances(const block_bars *bars, const block_pixel *pixel, ca_pair_design *design,
                            ca_pair_variances *v)
{
    assert(bars); /* of films that have them */
    const uint64_t *counts = bars->counts;
    if (counts[BAR_FIRST] != 1 || counts[BAR_LOST] > 0 || pixel->paths == 0) return false;
    const double blocks = (double)counts[BAR_BLOCKS];
    *design = (ca_pair_design){.camera_paths = (double)pixel->paths / blocks,
                               .light_paths = (double)pixel->pairs / (double)pixel->paths,
                               .blocks = blocks,
                               .camera_squares = (double)counts[BAR_CAMERA_SQUARES],
                               .light_squares = (double)counts[BAR_LIGHT_SQUARES]};
    *v = (ca_pair_variances){.camera = ca_exact_sum_value(&bars->covariances[CAMERA]) / blocks,
                             .light = ca_exact_sum_value(&bars->covariances[LIGHT]) / design->light_squares,
                             .pair = ca_exact_sum_value(&bars->covariances[PAIR]) / blocks,
                             .merged = ca_exact_sum_value(&bars->covariances[MERGED]) / blocks};
    return true;
}

static double value_variance(const block_bars *bars, const block_pixel *pixel)
{
    ca_pair_design design;
    ca_pair_variances v;
    return pixel_variances(bars, pixel, &design, &v) ? ca_pair_value_variance(&design, &v) : (double)NAN;
}

typedef enum block_quantity {
    RADIANCE,
    GRADIENT,
    PATH_MEAN,
    PATHS,
    PAIRS,
    VALUE_VARIANCE
} block_quantity;

/* Which channel holds what, in the order in which they are added. */
static const struct block_layer {
    const char *name;
    block_quantity quantity;
    int component;
} block_layers[] = {
    {"R", RADIANCE, 0},
    {"G", RADIANCE, 1},
    {"B", RADIANCE, 2},
    {"Albedo.R", PATH_MEAN, ALBEDO},
    {"Albedo.G", PATH_MEAN, ALBEDO + 1},
    {"Albedo.B", PATH_MEAN, ALBEDO + 2},
    {"N.X", PATH_MEAN, NORMAL},
    {"N.Y", PATH_MEAN, NORMAL + 1},
    {"N.Z", PATH_MEAN, NORMAL + 2},
    {"P.X", PATH_MEAN, POSITION},
    {"P.Y", PATH_MEAN, POSITION + 1},
    {"P.Z", PATH_MEAN, POSITION + 2},
    {"IrradianceGradient.X", GRADIENT, 0},
    {"IrradianceGradient.Y", GRADIENT, 1},
    {"IrradianceGradient.Z", GRADIENT, 2},
    {"Samples.Y", PATHS, 0},
    {"Pairs.Y", PAIRS, 0},
    {"ValueVariance.Y", VALUE_VARIANCE, 0},
};

static double mean_over_paths(const ca_block_film *film, const block_pixel *pixel, int sum)
{
    const double unit = sum < POSITION ? ldexp(1.0, UNIT_EXPONENT) : film->position_unit;
    return pixel->paths ? (double)(int64_t)pixel->path_sums[sum] * unit / (double)pixel->paths : 0.0;
}

static double pixel_quantity(const ca_block_film *film, size_t index, const struct block_layer *layer)
{
    const block_pixel *pixel = &film->pixels[index];
    switch (layer->quantity) {
    case RADIANCE: return mean_over_pairs(pixel, &pixel->radiance[layer->component]);
    case GRADIENT: return mean_over_pairs(pixel, &film->gradients[index].sums[layer->component]);
    case PATH_MEAN: return mean_over_paths(film, pixel, layer->component);
    case PATHS: return (double)pixel->paths;
    case PAIRS: return (double)pixel->pairs;
    case VALUE_VARIANCE: return value_variance(&film->bars[index], pixel);
    }
    return 0.0;
}

static ca_status develop_layers(const ca_block_film *film, ca_image_layers *layers, ca_error *error)
{
    const size_t count = (size_t)film->width * film->height;
    for (size_t l = 0; l < sizeof block_layers / sizeof block_layers[0]; l++) {
        if (block_layers[l].quantity == GRADIENT && !film->gradients) continue;
        if (block_layers[l].quantity == VALUE_VARIANCE && !film->bars) continue;
        float *data;
        CA_TRY(ca_layers_add(layers, block_layers[l].name, &data, error));
        for (size_t i = 0; i < count; i++) data[i] = (float)pixel_quantity(film, i, &block_layers[l]);
    }
    return CA_OK;
}

/* ---- Error bars ------------------------------------------------------------------------------------------------ */

/* Of every pixel, while they are developed. */
typedef struct bar_work {
    ca_moments *moments;
    double *degrees; /* of freedom; 0: the blocks tell nothing of the pixel */
    ca_verdict *verdicts;
} bar_work;

static ca_status find_errors(const ca_block_film *film, bar_work *work, ca_error *error)
{
    for (size_t i = 0; i < (size_t)film->width * film->height; i++) {
        if (i % 65536 == 0) CA_TRY(ca_loading_check(error));
        const double value = pixel_luminance(&film->pixels[i]);
        ca_pair_design design;
        ca_pair_variances v;
        work->degrees[i] = 0.0;
        work->moments[i] = (ca_moments){.mean = value};
        if (!pixel_variances(&film->bars[i], &film->pixels[i], &design, &v)) continue;
        (void)ca_pair_error(&design, &v, value, &work->moments[i], &work->degrees[i]);
    }
    return CA_OK;
}

static ca_status fill_bars(const ca_block_film *film, uint32_t threads, bar_work *work, ca_image_layers *layers,
                           ca_error *error)
{
    ca_interval_layers intervals;
    CA_TRY(ca_interval_layers_add(&intervals, layers, 'Y', error));
    CA_TRY(find_errors(film, work, error));
    CA_TRY(ca_confidence_judge(work->moments, film->width, film->height, threads, work->verdicts, error));
    for (size_t i = 0; i < (size_t)film->width * film->height; i++) {
        const bool known = work->degrees[i] > 0.0;
        if (!known) work->verdicts[i].kind = CA_INTERVAL_MARKED;
        ca_interval_layers_set(&intervals, i, &work->moments[i], &work->verdicts[i],
                               known ? ca_pair_student_quantile(work->degrees[i]) : 0.0);
    }
    return CA_OK;
}

static ca_status develop_bars(const ca_block_film *film, uint32_t threads, ca_image_layers *layers, ca_error *error)
{
    const size_t count = (size_t)film->width * film->height;
    bar_work work = {.moments = ca_alloc(count, sizeof *work.moments),
                     .degrees = ca_alloc(count, sizeof *work.degrees),
                     .verdicts = ca_alloc(count, sizeof *work.verdicts)};
    const bool room = work.moments && work.degrees && work.verdicts;
    const ca_status status =
        room ? fill_bars(film, threads, &work, layers, error) : ca_fail_memory(error, "the error bars");
    ca_free(work.moments);
    ca_free(work.degrees);
    ca_free(work.verdicts);
    return status;
}

ca_status ca_block_film_develop(const ca_block_film *film, uint32_t threads, ca_image_layers **layers,
                                ca_error *error)
{
    CA_TRY(ca_layers_create(layers, film->width, film->height, error));
    (*layers)->full_width = film->desc.full_width;
    (*layers)->full_height = film->desc.full_height;
    (*layers)->x0 = (int32_t)film->desc.crop[0];
    (*layers)->y0 = (int32_t)film->desc.crop[1];
    ca_status status = develop_layers(film, *layers, error);
    if (status == CA_OK && film->bars) status = develop_bars(film, threads, *layers, error);
    if (status == CA_OK) return CA_OK;
    ca_layers_destroy(*layers);
    *layers = NULL;
    return status;
}

/* ---- As bytes -------------------------------------------------------------------------------------------------- */

size_t ca_block_film_row_bytes(const ca_block_film_desc *desc)
{
    return (size_t)(desc->crop[2] - desc->crop[0]) * pixel_bytes(desc);
}

static unsigned char *write_sums(const ca_exact_sum *sums, int count, unsigned char *bytes)
{
    for (int i = 0; i < count; i++, bytes += CA_EXACT_SUM_BYTES) ca_exact_sum_write(&sums[i], bytes);
    return bytes;
}

static const unsigned char *read_sums(ca_exact_sum *sums, int count, const unsigned char *bytes)
{
    for (int i = 0; i < count; i++, bytes += CA_EXACT_SUM_BYTES) sums[i] = ca_exact_sum_read(bytes);
    return bytes;
}

void ca_block_film_write_row(const ca_block_film *film, uint32_t row, unsigned char *bytes)
{
    const size_t first = (size_t)row * film->width;
    for (size_t i = first; i < first + film->width; i++) {
        const block_pixel *pixel = &film->pixels[i];
        bytes = write_sums(pixel->radiance, 3, bytes);
        ca_put_u64(bytes, pixel->pairs);
        ca_put_u64(bytes + 8, pixel->paths);
        bytes += 16;
        for (int s = 0; s < PATH_SUMS; s++, bytes += 8) ca_put_u64(bytes, pixel->path_sums[s]);
        if (film->gradients) bytes = write_sums(film->gradients[i].sums, 3, bytes);
        if (!film->bars) continue;
        bytes = write_sums(film->bars[i].covariances, COVARIANCES, bytes);
        for (int c = 0; c < BAR_COUNTS; c++, bytes += 8) ca_put_u64(bytes, film->bars[i].counts[c]);
    }
}

/* What a pixel has, wherever it is kept; `gradient` and `bars` where the film has them. */
typedef struct pixel_sums {
    block_pixel pixel;
    block_gradient gradient;
    block_bars bars;
} pixel_sums;

static const unsigned char *read_pixel(const ca_block_film *film, pixel_sums *sums, const unsigned char *bytes)
{
    block_pixel *pixel = &sums->pixel;
    bytes = read_sums(pixel->radiance, 3, bytes);
    pixel->pairs = ca_get_u64(bytes);
    pixel->paths = ca_get_u64(bytes + 8);
    bytes += 16;
    for (int s = 0; s < PATH_SUMS; s++, bytes += 8) pixel->path_sums[s] = ca_get_u64(bytes);
    if (film->gradients) bytes = read_sums(sums->gradient.sums, 3, bytes);
    if (!film->bars) return bytes;
    bytes = read_sums(sums->bars.covariances, COVARIANCES, bytes);
    for (int c = 0; c < BAR_COUNTS; c++, bytes += 8) sums->bars.counts[c] = ca_get_u64(bytes);
    return bytes;
}

void ca_block_film_read_row(ca_block_film *film, uint32_t row, const unsigned char *bytes)
{
    const size_t first = (size_t)row * film->width;
    pixel_sums sums;
    for (size_t i = first; i < first + film->width; i++) {
        bytes = read_pixel(film, &sums, bytes);
        film->pixels[i] = sums.pixel;
        if (film->gradients) film->gradients[i] = sums.gradient;
        if (film->bars) film->bars[i] = sums.bars;
    }
}

void ca_block_film_add_row(ca_block_film *film, uint32_t row, const unsigned char *bytes)
{
    const size_t first = (size_t)row * film->width;
    pixel_sums sums;
    for (size_t i = first; i < first + film->width; i++) {
        bytes = read_pixel(film, &sums, bytes);
        add_sums(film, i, &sums.pixel, &sums.gradient, &sums.bars);
    }
}
