#include "metrics/image_metrics.h"

#include "base/loading.h"
#include "metrics/picture_pair.h"

enum { IMAGE, REFERENCE, PICTURES };

/* The two pictures as planes of our own. */
typedef float *picture_planes[PICTURES][3];

typedef struct measurement {
    ca_picture_pair pair;
    const ca_metric_settings *settings;
    ca_parallel parallel;
    size_t pixels;
    picture_planes finite; /* linear; what is not finite replaced */
    picture_planes signal; /* of a display: for SSIM */
    ca_image_layers *layers;
} measurement;

ca_metric_settings ca_metric_defaults(void)
{
    return (ca_metric_settings){
        .tone = CA_TONE_SRGB,
        .ssim = CA_SSIM_DEFAULTS,
        .flip_ldr = true,
        .flip_hdr = true,
        .pixels_per_degree = CA_FLIP_PIXELS_PER_DEGREE,
        .flip_tone = CA_TONE_ACES,
        .flip_exposures = {.start = (double)NAN, .stop = (double)NAN},
        .threads = 1,
    };
}

/* ---- Planes ---------------------------------------------------------------------------------------------------- */

static ca_status allocate_planes(picture_planes planes, size_t pixels, ca_error *error)
{
    bool complete = true;
    for (int p = 0; p < PICTURES; p++)
        for (int c = 0; c < 3; c++) {
            planes[p][c] = ca_alloc(pixels, sizeof(float));
            complete = complete && planes[p][c];
        }
    return complete ? CA_OK : ca_fail_memory(error, "comparing images");
}

static void free_planes(picture_planes planes)
{
    for (int p = 0; p < PICTURES; p++)
        for (int c = 0; c < 3; c++) {
            ca_free(planes[p][c]);
            planes[p][c] = NULL;
        }
}

static bool is_finite_pixel(const float *const color[3], size_t at)
{
    return isfinite(color[0][at]) && isfinite(color[1][at]) && isfinite(color[2][at]);
}

static void make_finite(measurement *m)
{
    const float *const *pictures[PICTURES] = {m->pair.image, m->pair.reference};
    for (size_t at = 0; at < m->pixels; at++) {
        const bool known[PICTURES] = {is_finite_pixel(pictures[IMAGE], at), is_finite_pixel(pictures[REFERENCE], at)};
        for (int p = 0; p < PICTURES; p++)
            for (int c = 0; c < 3; c++)
                m->finite[p][c][at] = known[p] ? pictures[p][c][at] : known[!p] ? pictures[!p][c][at] : 0.0f;
    }
}

/* One row of both pictures as a display's signal. */
static void make_signal_row(void *user, uint32_t y, uint32_t worker)
{
    (void)worker;
    const measurement *m = user;
    const double scale = exp2(m->settings->exposure);
    const size_t start = (size_t)y * m->pair.width;
    for (int p = 0; p < PICTURES; p++)
        for (size_t at = start; at < start + m->pair.width; at++) {
            float *const *color = m->finite[p];
            const ca_rgb signal =
                ca_tone_signal(m->settings->tone, scale, (ca_rgb){color[0][at], color[1][at], color[2][at]});
            m->signal[p][0][at] = signal.r;
            m->signal[p][1][at] = signal.g;
            m->signal[p][2][at] = signal.b;
        }
}

/* ---- Averages -------------------------------------------------------------------------------------------------- */

static bool is_inside(uint32_t i, uint32_t count, uint32_t margin)
{
    return i >= margin && count > margin && i < count - margin;
}

/* Over the pixels that count and are at least `margin` away from the picture's border; NAN where there is none. */
static double average(const measurement *m, const float *map, uint32_t margin)
{
    const ca_pixel_rect *roi = &m->pair.roi;
    double sum = 0.0;
    uint64_t count = 0;
    for (uint32_t y = roi->y0; y < roi->y1; y++)
        for (uint32_t x = roi->x0; x < roi->x1; x++) {
            const size_t at = (size_t)y * m->pair.width + x;
            if (!is_inside(x, m->pair.width, margin) || !is_inside(y, m->pair.height, margin)) continue;
            if (ca_picture_pair_is_masked(&m->pair, x, y) || !ca_picture_pair_is_finite(&m->pair, at)) continue;
            sum += (double)map[at];
            count++;
        }
    return count > 0 ? sum / (double)count : (double)NAN;
}

static bool any_pixel_counts(const measurement *m)
{
    const ca_pixel_rect *roi = &m->pair.roi;
    for (uint32_t y = roi->y0; y < roi->y1; y++)
        for (uint32_t x = roi->x0; x < roi->x1; x++)
            if (!ca_picture_pair_is_masked(&m->pair, x, y) &&
                ca_picture_pair_is_finite(&m->pair, (size_t)y * m->pair.width + x))
                return true;
    return false;
}

/* ---- SSIM and FLIP --------------------------------------------------------------------------------------------- */

static ca_status measure_ssim(measurement *m, ca_image_metrics *metrics, ca_error *error)
{
    float *map = NULL;
    CA_TRY(ca_layers_add(m->layers, "SSIM", &map, error));
    CA_TRY(allocate_planes(m->signal, m->pixels, error));
    CA_TRY(ca_parallel_for(&m->parallel, m->pair.height, make_signal_row, m, error));
    ca_ssim_pictures pictures = {.width = m->pair.width, .height = m->pair.height};
    for (int c = 0; c < 3; c++) {
        pictures.a[c] = m->signal[IMAGE][c];
        pictures.b[c] = m->signal[REFERENCE][c];
    }
    CA_TRY(ca_ssim_map(&pictures, &m->settings->ssim, &m->parallel, map, error));
    metrics->ssim = average(m, map, m->settings->ssim.window / 2);
    free_planes(m->signal);
    return CA_OK;
}

static ca_status measure_flip_ldr(measurement *m, ca_flip *flip, const ca_flip_pictures *pictures,
                                  ca_image_metrics *metrics, ca_error *error)
{
    float *map = NULL;
    CA_TRY(ca_layers_add(m->layers, "FLIP.LDR", &map, error));
    CA_TRY(ca_flip_ldr(flip, pictures, m->settings->tone, m->settings->exposure, map, error));
    metrics->flip_ldr = average(m, map, 0);
    return CA_OK;
}

static ca_status measure_flip_hdr(measurement *m, ca_flip *flip, const ca_flip_pictures *pictures,
                                  ca_image_metrics *metrics, ca_error *error)
{
    ca_flip_exposures exposures = m->settings->flip_exposures;
    bool known = false;
    CA_TRY(
        ca_flip_choose_exposures(pictures->reference, m->pixels, m->settings->flip_tone, &exposures, &known, error));
    if (!known) return CA_OK;
    float *map = NULL, *exposure_map = NULL;
    CA_TRY(ca_layers_add(m->layers, "FLIP.HDR", &map, error));
    CA_TRY(ca_layers_add(m->layers, "FLIP.Exposure", &exposure_map, error));
    CA_TRY(ca_flip_hdr(flip, pictures, m->settings->flip_tone, &exposures, map, exposure_map, error));
    metrics->flip_hdr = average(m, map, 0);
    metrics->exposures = exposures;
    return CA_OK;
}

static ca_status measure_flip(measurement *m, ca_image_metrics *metrics, ca_error *error)
{
    const ca_metric_settings *s = m->settings;
    if (!s->flip_ldr && !s->flip_hdr) return CA_OK;
    ca_flip_pictures pictures;
    for (int c = 0; c < 3; c++) {
        pictures.image[c] = m->finite[IMAGE][c];
        pictures.reference[c] = m->finite[REFERENCE][c];
    }
    ca_flip *flip = NULL;
    CA_TRY(ca_flip_create(m->pair.width, m->pair.height, s->pixels_per_degree, &m->parallel, &flip, error));
    ca_status status = s->flip_ldr ? measure_flip_ldr(m, flip, &pictures, metrics, error) : CA_OK;
    if (status == CA_OK && s->flip_hdr) status = measure_flip_hdr(m, flip, &pictures, metrics, error);
    ca_flip_destroy(flip);
    return status;
}

/* ---- Maps ------------------------------------------------------------------------------------------------------ */

enum { ERROR_RMSE, ERROR_MAE, ERROR_RELMSE, ERROR_SMAPE, ERROR_MAPS };

static void set_errors(const measurement *m, size_t at, float *const errors[ERROR_MAPS], float *const difference[3])
{
    double squares = 0.0, absolute = 0.0, relative = 0.0, symmetric = 0.0;
    for (int c = 0; c < 3; c++) {
        const double a = (double)m->pair.image[c][at], b = (double)m->pair.reference[c][at];
        squares += (a - b) * (a - b);
        absolute += fabs(a - b);
        relative += ca_relative_square(a, b);
        symmetric += ca_symmetric_error(a, b);
        difference[c][at] = (float)(a - b);
    }
    errors[ERROR_RMSE][at] = (float)sqrt(squares / 3.0);
    errors[ERROR_MAE][at] = (float)(absolute / 3.0);
    errors[ERROR_RELMSE][at] = (float)(relative / 3.0);
    errors[ERROR_SMAPE][at] = (float)(symmetric / 3.0);
}

static ca_status add_error_maps(measurement *m, ca_error *error)
{
    static const char *const error_names[ERROR_MAPS] = {"Error.RMSE", "Error.MAE", "Error.relMSE", "Error.SMAPE"};
    static const char *const difference_names[3] = {"Difference.R", "Difference.G", "Difference.B"};
    float *errors[ERROR_MAPS], *difference[3];
    for (int i = 0; i < ERROR_MAPS; i++) CA_TRY(ca_layers_add(m->layers, error_names[i], &errors[i], error));
    for (int c = 0; c < 3; c++) CA_TRY(ca_layers_add(m->layers, difference_names[c], &difference[c], error));
    for (size_t at = 0; at < m->pixels; at++) set_errors(m, at, errors, difference);
    for (size_t i = 0; i < m->layers->channel_count; i++)
        for (size_t at = 0; at < m->pixels; at++)
            if (!ca_picture_pair_is_finite(&m->pair, at)) m->layers->channels[i].data[at] = NAN;
    return CA_OK;
}

/* The maps lie in the film where the image does. */
static ca_status create_layers(measurement *m, const ca_image_layers *image, ca_error *error)
{
    CA_TRY(ca_layers_create(&m->layers, image->width, image->height, error));
    m->layers->full_width = image->full_width;
    m->layers->full_height = image->full_height;
    m->layers->x0 = image->x0;
    m->layers->y0 = image->y0;
    return CA_OK;
}

ca_status ca_measure_image(const ca_image_layers *image, const ca_image_layers *reference,
                           const ca_compare_settings *region, const ca_metric_settings *settings,
                           ca_image_metrics *metrics, ca_image_layers **maps, ca_error *error)
{
    *metrics = (ca_image_metrics){.ssim = (double)NAN, .flip_ldr = (double)NAN, .flip_hdr = (double)NAN};
    if (maps) *maps = NULL;
    measurement m = {.settings = settings,
                     .parallel = {.workers = settings->threads, .stop = ca_loading_wanted_until()}};
    CA_TRY(ca_picture_pair_open(image, reference, region, &m.pair, error));
    if (!any_pixel_counts(&m))
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "nothing is left to compare: all pixels are masked or not finite");
    m.pixels = (size_t)m.pair.width * m.pair.height;
    ca_status status = create_layers(&m, image, error);
    if (status == CA_OK) status = allocate_planes(m.finite, m.pixels, error);
    if (status == CA_OK) {
        make_finite(&m);
        status = measure_ssim(&m, metrics, error);
    }
    if (status == CA_OK) status = measure_flip(&m, metrics, error);
    if (status == CA_OK && maps) status = add_error_maps(&m, error);
    free_planes(m.finite);
    free_planes(m.signal);
    if (status == CA_OK && maps) {
        *maps = m.layers;
        return CA_OK;
    }
    ca_layers_destroy(m.layers);
    return status;
}
