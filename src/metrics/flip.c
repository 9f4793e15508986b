#include "metrics/flip.h"

#include "base/memory.h"
#include "metrics/flip_color.h"
#include "metrics/separable.h"

#include <math.h>
#include <stdlib.h>

/* Constants of the paper, in its notation: exponents of the colour and feature differences, where the colour
 * difference bends (p_c of the largest goes to p_t), width of the feature detectors in degrees. */
static const double q_c = 0.7, p_c = 0.4, p_t = 0.95, q_f = 0.5, w_degrees = 0.082;

/* What the shown values of the brightest and the median pixel are when HDR-FLIP starts and stops. */
static const double bright_shown = 0.85;

#define PI 3.14159265358979323846

enum { IMAGE, REFERENCE, PICTURES };
enum { Y, CX, CZ, COLORS };

/* Rows of a worker's memory, each `width` values. */
enum {
    COLOR_ROWS = PICTURES * COLORS,
    EDGE_ROW = COLOR_ROWS,
    POINT_ROW = EDGE_ROW + PICTURES,
    SPARE_ROW = POINT_ROW + PICTURES,
    ROWS = SPARE_ROW + 2
};

struct ca_flip {
    uint32_t width, height;
    const ca_parallel *parallel;
    double *weights;                                        /* of all kernels */
    ca_kernel contrast_y, contrast_cx, contrast_cz[2];      /* contrast_cz: two Gaussians, to be added */
    ca_kernel gauss, gauss_first, gauss_second;             /* the feature detector and its derivatives */
    double largest;                                         /* colour difference, to the power q_c: green to blue */
    float *planes[PICTURES][COLORS];                        /* Y Cx Cz */
    float *exposed_map;                                     /* HDR: of one exposure */
    double *scratch;                                        /* one part for each worker: ROWS rows and a padded one */
    size_t scratch_size;
};

/* What one LDR map is made from. */
typedef struct flip_job {
    ca_flip *flip;
    const ca_flip_pictures *pictures;
    ca_tone_curve tone;
    double scale;
    float *map;
} flip_job;

/* ---- Filters --------------------------------------------------------------------------------------------------- */

/* Samples sqrt(a sqrt(pi / b)) exp(-(pi x)^2 / b), x in degrees: applied along both axes, a Gaussian of the contrast
 * sensitivity. Returns their sum. */
static double sample_contrast(double *weights, uint32_t radius, double pixels_per_degree, double a, double b)
{
    double sum = 0.0;
    for (uint32_t i = 0; i <= 2 * radius; i++) {
        const double x = ((double)i - (double)radius) / pixels_per_degree;
        weights[i] = sqrt(a * sqrt(PI / b)) * exp(-PI * PI * x * x / b);
        sum += weights[i];
    }
    return sum;
}

static void divide(double *weights, uint32_t radius, double divisor)
{
    for (uint32_t i = 0; i <= 2 * radius; i++) weights[i] /= divisor;
}

/* `weights` has room for four kernels. Y and Cx have one Gaussian each; in Cz the two together come to a sum of 1. */
static void fill_contrast(ca_flip *flip, double *weights, uint32_t radius, double pixels_per_degree)
{
    const size_t length = 2 * (size_t)radius + 1;
    double *y = weights, *cx = y + length, *wide = cx + length, *narrow = wide + length;
    divide(y, radius, sample_contrast(y, radius, pixels_per_degree, 1.0, 0.0047));
    divide(cx, radius, sample_contrast(cx, radius, pixels_per_degree, 1.0, 0.0053));
    const double wide_sum = sample_contrast(wide, radius, pixels_per_degree, 34.1, 0.04);
    const double narrow_sum = sample_contrast(narrow, radius, pixels_per_degree, 13.5, 0.025);
    const double norm = sqrt(wide_sum * wide_sum + narrow_sum * narrow_sum);
    divide(wide, radius, norm);
    divide(narrow, radius, norm);
    flip->contrast_y = (ca_kernel){radius, y};
    flip->contrast_cx = (ca_kernel){radius, cx};
    flip->contrast_cz[0] = (ca_kernel){radius, wide};
    flip->contrast_cz[1] = (ca_kernel){radius, narrow};
}

/* Positive weights come to 1, negative ones to -1. */
static void balance(double *weights, uint32_t radius)
{
    double positive = 0.0, negative = 0.0;
    for (uint32_t i = 0; i <= 2 * radius; i++) *(weights[i] > 0.0 ? &positive : &negative) += fabs(weights[i]);
    for (uint32_t i = 0; i <= 2 * radius; i++) weights[i] /= weights[i] > 0.0 ? positive : negative;
}

/* `weights` has room for three kernels: a Gaussian, its first and its second derivative. */
static void fill_features(ca_flip *flip, double *weights, uint32_t radius, double sigma)
{
    const size_t length = 2 * (size_t)radius + 1;
    double *gauss = weights, *first = gauss + length, *second = first + length, sum = 0.0;
    for (uint32_t i = 0; i <= 2 * radius; i++) {
        const double x = (double)i - (double)radius;
        gauss[i] = exp(-0.5 * x * x / (sigma * sigma));
        first[i] = -x * gauss[i];
        second[i] = (x * x / (sigma * sigma) - 1.0) * gauss[i];
        sum += gauss[i];
    }
    divide(gauss, radius, sum);
    balance(first, radius);
    balance(second, radius);
    flip->gauss = (ca_kernel){radius, gauss};
    flip->gauss_first = (ca_kernel){radius, first};
    flip->gauss_second = (ca_kernel){radius, second};
}

/* ---- Memory ---------------------------------------------------------------------------------------------------- */

static bool allocate(ca_flip *flip, uint32_t contrast_radius, uint32_t feature_radius)
{
    const size_t pixels = (size_t)flip->width * flip->height;
    const uint32_t widest = contrast_radius > feature_radius ? contrast_radius : feature_radius;
    flip->scratch_size = (size_t)(ROWS + 1) * flip->width + 2 * (size_t)widest;
    flip->scratch = ca_alloc(flip->scratch_size * flip->parallel->workers, sizeof *flip->scratch);
    flip->weights =
        ca_alloc(4 * (2 * (size_t)contrast_radius + 1) + 3 * (2 * (size_t)feature_radius + 1), sizeof *flip->weights);
    flip->exposed_map = ca_alloc(pixels, sizeof(float));
    bool complete = flip->scratch && flip->weights && flip->exposed_map;
    for (int p = 0; p < PICTURES; p++)
        for (int c = 0; c < COLORS; c++) {
            flip->planes[p][c] = ca_alloc(pixels, sizeof(float));
            complete = complete && flip->planes[p][c];
        }
    return complete;
}

ca_status ca_flip_create(uint32_t width, uint32_t height, double pixels_per_degree, const ca_parallel *parallel,
                         ca_flip **flip, ca_error *error)
{
    *flip = NULL;
    if (!(pixels_per_degree >= CA_FLIP_MIN_PIXELS_PER_DEGREE && pixels_per_degree <= CA_FLIP_MAX_PIXELS_PER_DEGREE))
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "FLIP needs from %g to %g pixels per degree, not %g",
                       CA_FLIP_MIN_PIXELS_PER_DEGREE, CA_FLIP_MAX_PIXELS_PER_DEGREE, pixels_per_degree);
    /* Three standard deviations of the widest contrast filter, and of the feature detector. */
    const double sigma = 0.5 * w_degrees * pixels_per_degree;
    const uint32_t contrast_radius = (uint32_t)ceil(3.0 * sqrt(0.04 / (2.0 * PI * PI)) * pixels_per_degree);
    const uint32_t feature_radius = (uint32_t)ceil(3.0 * sigma);
    ca_flip *f = ca_alloc_zeroed(1, sizeof *f);
    if (!f) return ca_fail_memory(error, "FLIP");
    f->width = width;
    f->height = height;
    f->parallel = parallel;
    if (!allocate(f, contrast_radius, feature_radius)) {
        ca_flip_destroy(f);
        return ca_fail_memory(error, "FLIP");
    }
    fill_contrast(f, f->weights, contrast_radius, pixels_per_degree);
    fill_features(f, f->weights + 4 * (2 * (size_t)contrast_radius + 1), feature_radius, sigma);
    const ca_flip_color green = {{0.0, 1.0, 0.0}}, blue = {{0.0, 0.0, 1.0}};
    f->largest = pow(ca_flip_distance(ca_flip_hunt_lab(green), ca_flip_hunt_lab(blue)), q_c);
    *flip = f;
    return CA_OK;
}

void ca_flip_destroy(ca_flip *flip)
{
    if (!flip) return;
    for (int p = 0; p < PICTURES; p++)
        for (int c = 0; c < COLORS; c++) ca_free(flip->planes[p][c]);
    ca_free(flip->exposed_map);
    ca_free(flip->weights);
    ca_free(flip->scratch);
    ca_free(flip);
}

/* ---- LDR ------------------------------------------------------------------------------------------------------- */

static double clip(double v) { return fmin(fmax(v, 0.0), 1.0); }

/* One row of both pictures as Y Cx Cz of what the display shows. */
static void show_row(void *user, uint32_t y, uint32_t worker)
{
    (void)worker;
    const flip_job *job = user;
    for (int p = 0; p < PICTURES; p++) {
        const float *const *linear = p == IMAGE ? job->pictures->image : job->pictures->reference;
        const size_t start = (size_t)y * job->flip->width;
        for (size_t at = start; at < start + job->flip->width; at++) {
            const ca_rgb shown =
                ca_tone_map(job->tone, job->scale, (ca_rgb){linear[0][at], linear[1][at], linear[2][at]});
            const ca_flip_color color =
                ca_flip_ycxcz((ca_flip_color){{clip((double)shown.r), clip((double)shown.g), clip((double)shown.b)}});
            for (int c = 0; c < COLORS; c++) job->flip->planes[p][c][at] = (float)color.v[c];
        }
    }
}

static ca_filter_source source_of(const ca_flip *flip, int picture, int color)
{
    return (ca_filter_source){.plane = flip->planes[picture][color],
                              .width = flip->width,
                              .height = flip->height,
                              .border = CA_BORDER_REPEAT};
}

static void add_rows(const double *added, uint32_t width, double *sum)
{
    for (uint32_t x = 0; x < width; x++) sum[x] += added[x];
}

/* What the eye makes of the colours of one row: rows Y, Cx and Cz of `colors`. `columns` and `spare` are used up. */
static void filter_colors(const ca_flip *flip, int picture, uint32_t y, double *colors, double *spare,
                          double *columns)
{
    const ca_kernel *const kernels[COLORS] = {&flip->contrast_y, &flip->contrast_cx, &flip->contrast_cz[0]};
    for (int c = 0; c < COLORS; c++) {
        const ca_filter_source source = source_of(flip, picture, c);
        ca_filter_columns(&source, y, kernels[c], kernels[c]->radius, columns);
        ca_filter_row(columns, flip->width, kernels[c], colors + (size_t)c * flip->width);
    }
    const ca_filter_source source = source_of(flip, picture, CZ);
    ca_filter_columns(&source, y, &flip->contrast_cz[1], flip->contrast_cz[1].radius, columns);
    ca_filter_row(columns, flip->width, &flip->contrast_cz[1], spare);
    add_rows(spare, flip->width, colors + (size_t)CZ * flip->width);
}

/* How strong the edge (first derivatives) or the point (second ones) is at each pixel of a row, of Y in [0, 1]. The
 * weights of a derivative come to 0: the offset of Y does not matter. */
static void filter_features(const ca_flip *flip, int picture, uint32_t y, const ca_kernel *derivative,
                            double *strength, double *spare, double *columns)
{
    const ca_filter_source source = source_of(flip, picture, Y);
    double *along_x = spare, *along_y = spare + flip->width;
    ca_filter_columns(&source, y, &flip->gauss, flip->gauss.radius, columns);
    ca_filter_row(columns, flip->width, derivative, along_x);
    ca_filter_columns(&source, y, derivative, derivative->radius, columns);
    ca_filter_row(columns, flip->width, &flip->gauss, along_y);
    for (uint32_t x = 0; x < flip->width; x++)
        strength[x] = sqrt(along_x[x] * along_x[x] + along_y[x] * along_y[x]) / 116.0;
}

static ca_flip_color seen_color(const double *colors, uint32_t width, uint32_t x)
{
    ca_flip_color rgb =
        ca_flip_rgb_of_ycxcz((ca_flip_color){{colors[x], colors[width + (size_t)x], colors[2 * (size_t)width + x]}});
    for (int c = 0; c < COLORS; c++) rgb.v[c] = clip(rgb.v[c]);
    return ca_flip_hunt_lab(rgb);
}

static double color_difference(const ca_flip *flip, ca_flip_color image, ca_flip_color reference)
{
    const double difference = pow(ca_flip_distance(image, reference), q_c), bend = p_c * flip->largest;
    if (difference < bend) return difference * (p_t / bend);
    return p_t + (difference - bend) / (flip->largest - bend) * (1.0 - p_t);
}

static double feature_difference(const double *edges, const double *points, uint32_t width, uint32_t x)
{
    const double edge = fabs(edges[x] - edges[width + (size_t)x]),
                 point = fabs(points[x] - points[width + (size_t)x]);
    return pow(fmax(edge, point) / sqrt(2.0), q_f);
}

static void map_row(void *user, uint32_t y, uint32_t worker)
{
    const flip_job *job = user;
    const ca_flip *flip = job->flip;
    const uint32_t width = flip->width;
    double *rows = flip->scratch + worker * flip->scratch_size;
    double *colors[PICTURES] = {rows, rows + (size_t)COLORS * width};
    double *edges = rows + (size_t)EDGE_ROW * width, *points = rows + (size_t)POINT_ROW * width;
    double *spare = rows + (size_t)SPARE_ROW * width, *columns = rows + (size_t)ROWS * width;
    for (int p = 0; p < PICTURES; p++) {
        filter_colors(flip, p, y, colors[p], spare, columns);
        filter_features(flip, p, y, &flip->gauss_first, edges + (size_t)p * width, spare, columns);
        filter_features(flip, p, y, &flip->gauss_second, points + (size_t)p * width, spare, columns);
    }
    for (uint32_t x = 0; x < width; x++) {
        const double color =
            color_difference(flip, seen_color(colors[IMAGE], width, x), seen_color(colors[REFERENCE], width, x));
        job->map[(size_t)y * width + x] = (float)pow(color, 1.0 - feature_difference(edges, points, width, x));
    }
}

ca_status ca_flip_ldr(ca_flip *flip, const ca_flip_pictures *pictures, ca_tone_curve tone, double exposure,
                      float *map, ca_error *error)
{
    flip_job job = {.flip = flip, .pictures = pictures, .tone = tone, .scale = exp2(exposure), .map = map};
    CA_TRY(ca_parallel_for(flip->parallel, flip->height, show_row, &job, error));
    return ca_parallel_for(flip->parallel, flip->height, map_row, &job, error);
}

/* ---- HDR ------------------------------------------------------------------------------------------------------- */

/* Values up to a pivot from [*low, *high] come before the others; the part that may hold the element `at` is left. */
static void partition(float *values, size_t at, ptrdiff_t *low, ptrdiff_t *high)
{
    const float pivot = values[*low + (*high - *low) / 2];
    ptrdiff_t i = *low, j = *high;
    while (i <= j) {
        while (values[i] < pivot) i++;
        while (values[j] > pivot) j--;
        if (i > j) break;
        const float swapped = values[i];
        values[i++] = values[j];
        values[j--] = swapped;
    }
    if ((ptrdiff_t)at <= j)
        *high = j;
    else
        *low = (ptrdiff_t)at >= i ? i : *high; /* between the two all are the pivot */
}

/* The value that would be there in order, without putting all into it (Hoare's selection). */
static float value_in_order(float *values, size_t count, size_t at)
{
    ptrdiff_t low = 0, high = (ptrdiff_t)count - 1;
    while (low < high) partition(values, at, &low, &high);
    return values[at];
}

/* The largest luminance and the median (the upper of the two middle ones). */
static ca_status find_luminances(const float *const reference[3], size_t pixels, double *largest, double *median,
                                 ca_error *error)
{
    float *luminances = ca_alloc(pixels, sizeof *luminances);
    if (!luminances) return ca_fail_memory(error, "FLIP");
    *largest = -(double)INFINITY;
    for (size_t i = 0; i < pixels; i++) {
        luminances[i] = ca_luminance((ca_rgb){reference[0][i], reference[1][i], reference[2][i]});
        *largest = fmax(*largest, (double)luminances[i]);
    }
    *median = (double)value_in_order(luminances, pixels, pixels / 2);
    ca_free(luminances);
    return CA_OK;
}

ca_status ca_flip_choose_exposures(const float *const reference[3], size_t pixels, ca_tone_curve tone,
                                   ca_flip_exposures *exposures, bool *known, ca_error *error)
{
    *known = true;
    if (isnan(exposures->start) || isnan(exposures->stop)) {
        double largest = 0.0, median = 0.0;
        CA_TRY(find_luminances(reference, pixels, &largest, &median, error));
        const double bright = ca_tone_inverse(tone, bright_shown);
        if (isnan(exposures->start)) exposures->start = log2(bright / largest);
        if (isnan(exposures->stop)) exposures->stop = log2(bright / median);
        *known = isfinite(exposures->start) && isfinite(exposures->stop);
        if (!*known) return CA_OK;
    }
    if (exposures->start > exposures->stop)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "FLIP's exposures start at %.4g stops, after their stop at %.4g", exposures->start,
                       exposures->stop);
    if (exposures->count == 0) exposures->count = (uint32_t)fmax(2.0, ceil(exposures->stop - exposures->start));
    return CA_OK;
}

ca_status ca_flip_hdr(ca_flip *flip, const ca_flip_pictures *pictures, ca_tone_curve tone,
                      const ca_flip_exposures *exposures, float *map, float *exposure_map, ca_error *error)
{
    const size_t pixels = (size_t)flip->width * flip->height;
    for (uint32_t i = 0; i < exposures->count; i++) {
        const double part = exposures->count > 1 ? (double)i / (exposures->count - 1) : 0.0;
        const double exposure = exposures->start + part * (exposures->stop - exposures->start);
        CA_TRY(ca_flip_ldr(flip, pictures, tone, exposure, flip->exposed_map, error));
        for (size_t at = 0; at < pixels; at++)
            if (i == 0 || flip->exposed_map[at] > map[at]) {
                map[at] = flip->exposed_map[at];
                exposure_map[at] = (float)exposure;
            }
    }
    return CA_OK;
}
