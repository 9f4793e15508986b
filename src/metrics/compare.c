#include "metrics/compare.h"

#include "base/loading.h"
#include "metrics/picture_pair.h"
#include "metrics/significance.h"
#include "math/rgb.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { DEFAULT_BLOCK_SIDE = 16 };

/* One of the two pictures: borrowed channels. */
typedef struct picture {
    const float *color[3];
    const float *variance[3], *samples; /* NULL where the picture does not know its noise */
    double rounding[3];                 /* relative error of a stored value */
    bool has_variance;
} picture;

typedef struct comparison_job {
    ca_picture_pair pair;
    picture image, reference;
    uint32_t side; /* of a block */
} comparison_job;

static const char *const color_names[3] = {"R", "G", "B"};
static const char *const variance_names[3] = {"Variance.R", "Variance.G", "Variance.B"};

/* ---- Looking at the pictures ----------------------------------------------------------------------------------- */

static double stored_rounding(const ca_image_layers *layers, const char *name)
{
    for (size_t i = 0; i < layers->channel_count; i++)
        if (strcmp(layers->channels[i].name, name) == 0 && layers->channels[i].half) return 0x1p-11;
    return 0x1p-22; /* half a unit in the last place, and as much again for the sums before */
}

static double largest_rounding(const picture *p)
{
    return fmax(p->rounding[0], fmax(p->rounding[1], p->rounding[2]));
}

static void open_picture(const ca_image_layers *layers, const float *const color[3], picture *out)
{
    out->samples = ca_layers_find(layers, "Samples.Y");
    out->has_variance = out->samples != NULL;
    for (int c = 0; c < 3; c++) {
        out->color[c] = color[c];
        out->rounding[c] = stored_rounding(layers, color_names[c]);
        out->variance[c] = ca_layers_find(layers, variance_names[c]);
        out->has_variance = out->has_variance && out->variance[c];
    }
}

static ca_rgb pixel_of(const picture *p, size_t at)
{
    return (ca_rgb){p->color[0][at], p->color[1][at], p->color[2][at]};
}

/* ---- Metrics --------------------------------------------------------------------------------------------------- */

static void measure(const comparison_job *job, ca_comparison *result)
{
    double squares = 0.0, relative = 0.0, absolute = 0.0, symmetric = 0.0, luminance = 0.0, reference_luminance = 0.0;
    for (uint32_t y = job->pair.roi.y0; y < job->pair.roi.y1 && ca_loading_check(NULL) == CA_OK; y++)
        for (uint32_t x = job->pair.roi.x0; x < job->pair.roi.x1; x++) {
            const size_t at = (size_t)y * job->pair.width + x;
            if (ca_picture_pair_is_masked(&job->pair, x, y)) {
                result->masked++;
                continue;
            }
            if (!ca_picture_pair_is_finite(&job->pair, at)) {
                result->non_finite++;
                continue;
            }
            result->pixels++;
            for (int c = 0; c < 3; c++) {
                const double b = (double)job->reference.color[c][at];
                const double a = (double)job->image.color[c][at];
                squares += (a - b) * (a - b);
                absolute += fabs(a - b);
                relative += ca_relative_square(a, b);
                symmetric += ca_symmetric_error(a, b);
            }
            luminance += (double)ca_luminance(pixel_of(&job->image, at));
            reference_luminance += (double)ca_luminance(pixel_of(&job->reference, at));
        }
    const double pixels = (double)result->pixels, values = 3.0 * pixels;
    result->rmse = sqrt(squares / values);
    result->relmse = relative / values;
    result->mae = absolute / values;
    result->smape = symmetric / values;
    result->mean_luminance = luminance / pixels;
    result->reference_mean_luminance = reference_luminance / pixels;
}

/* ---- Blocks ---------------------------------------------------------------------------------------------------- */

/* Sums over a block for one picture and channel, later means. Variances are those of the block's mean. */
typedef struct block_channel {
    double mean;
    double variance;
    double satterthwaite; /* sum of v_i^2 / (n_i - 1) over the terms v_i of the variance */
} block_channel;

typedef struct block {
    block_channel image[3], reference[3];
    uint32_t pixels;
    bool known_variance;
} block;

static double block_luminance(const block_channel channels[3])
{
    return 0.2126 * channels[0].mean + 0.7152 * channels[1].mean + 0.0722 * channels[2].mean;
}

/* false where the variance of this pixel is not known. */
static bool add_pixel(const picture *from, size_t at, block_channel channels[3])
{
    bool known = true;
    const double samples = from->has_variance ? (double)from->samples[at] : 0.0;
    for (int c = 0; c < 3; c++) {
        channels[c].mean += (double)from->color[c][at];
        if (!from->has_variance) continue;
        const double term = (double)from->variance[c][at] / samples;
        if (!(samples >= 2.0) || !(term >= 0.0) || isinf(term)) {
            known = false;
            continue;
        }
        channels[c].variance += term;
        channels[c].satterthwaite += term * term / (samples - 1.0);
    }
    return known;
}

static void divide_by_pixels(block_channel channels[3], uint32_t pixels)
{
    const double n = (double)pixels;
    for (int c = 0; c < 3; c++) {
        channels[c].mean /= n;
        channels[c].variance /= n * n;
        channels[c].satterthwaite /= n * n * n * n;
    }
}

static block gather_block(const comparison_job *job, uint32_t x0, uint32_t y0)
{
    block b = {.known_variance = job->image.has_variance};
    for (uint32_t y = y0; y < job->pair.roi.y1 && y - y0 < job->side; y++)
        for (uint32_t x = x0; x < job->pair.roi.x1 && x - x0 < job->side; x++) {
            const size_t at = (size_t)y * job->pair.width + x;
            if (ca_picture_pair_is_masked(&job->pair, x, y) || !ca_picture_pair_is_finite(&job->pair, at)) continue;
            b.pixels++;
            if (!add_pixel(&job->image, at, b.image)) b.known_variance = false;
            if (!add_pixel(&job->reference, at, b.reference)) b.known_variance = false;
        }
    divide_by_pixels(b.image, b.pixels ? b.pixels : 1);
    divide_by_pixels(b.reference, b.pixels ? b.pixels : 1);
    return b;
}

/* Two-sided p-value that the means of both pictures are equal. Rounding of the stored values is no difference. */
static double block_channel_p(const comparison_job *job, const block *b, int c)
{
    const block_channel *image = &b->image[c], *reference = &b->reference[c];
    const double rounding =
        job->image.rounding[c] * fabs(image->mean) + job->reference.rounding[c] * fabs(reference->mean);
    const double difference = fmax(fabs(image->mean - reference->mean) - rounding, 0.0);
    if (difference == 0.0) return 1.0;
    const double variance = image->variance + reference->variance;
    if (variance == 0.0) return 0.0;
    const double degrees = variance * variance / (image->satterthwaite + reference->satterthwaite);
    return ca_student_two_sided_p(difference / sqrt(variance), degrees);
}

static double relative_difference(double a, double b)
{
    if (a == b) return 0.0;
    return b != 0.0 ? fabs(a - b) / fabs(b) : (double)INFINITY;
}

static int compare_doubles(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(double *values, size_t count)
{
    if (count == 0) return (double)NAN;
    qsort(values, count, sizeof *values, compare_doubles);
    return count % 2 ? values[count / 2] : 0.5 * (values[count / 2 - 1] + values[count / 2]);
}

/* What the test keeps of a tested block: for the count of rejections and for the power afterwards. */
typedef struct block_record {
    double p[3];
    double signal[3]; /* mean of the reference over the standard error of the difference; 0 without noise or light */
    double noise;     /* standard error of the difference, root of the sum of squares over the channels */
} block_record;

static block_record record_block(const comparison_job *job, const block *b)
{
    block_record record = {0};
    double squares = 0.0;
    for (int c = 0; c < 3; c++) {
        const double variance = b->image[c].variance + b->reference[c].variance;
        record.p[c] = block_channel_p(job, b, c);
        record.signal[c] = variance > 0.0 ? fabs(b->reference[c].mean) / sqrt(variance) : 0.0;
        squares += variance;
    }
    record.noise = sqrt(squares);
    return record;
}

/* Probability that no channel of the block rejects when the image is (1 + bias) times the reference there. */
static double probability_of_missing(const block_record *record, double threshold, double bias)
{
    double miss = 1.0;
    for (int c = 0; c < 3; c++) {
        const double shift = bias * record->signal[c];
        miss *= ca_normal_cdf(threshold - shift) - ca_normal_cdf(-threshold - shift);
    }
    return miss;
}

/* The smallest relative bias of this block alone that it shows with the probability CA_COMPARE_POWER. */
static double block_detectable_bias(const block_record *record, double threshold)
{
    const double strongest = fmax(record->signal[0], fmax(record->signal[1], record->signal[2]));
    if (!(strongest > 0.0)) return (double)INFINITY;
    double low = 0.0, high = (threshold + 2.0) / strongest; /* one channel alone: power 97.7 % */
    for (int i = 0; i < 40; i++) {
        const double middle = 0.5 * (low + high);
        if (1.0 - probability_of_missing(record, threshold, middle) < CA_COMPARE_POWER)
            low = middle;
        else
            high = middle;
    }
    return high;
}

static double mean_noise(const block_record *records, uint32_t count)
{
    double sum = 0.0;
    uint32_t noisy = 0;
    for (uint32_t i = 0; i < count; i++) {
        sum += records[i].noise;
        noisy += records[i].noise > 0.0;
    }
    return noisy ? sum / noisy : 0.0;
}

/* A sky without noise shows the smallest bias, and has none: such blocks do not count. `biases`: room for a value of
 * each block. */
static void judge_power(const block_record *records, uint32_t count, double threshold, double *biases,
                        ca_block_test *test)
{
    const double least = CA_COMPARE_LEAST_NOISE * mean_noise(records, count);
    for (uint32_t i = 0; i < count; i++)
        if (records[i].noise > 0.0 && records[i].noise >= least)
            biases[test->blocks_with_noise++] = block_detectable_bias(&records[i], threshold);
    test->detectable_bias = median(biases, test->blocks_with_noise);
}

static void judge(const block_record *records, uint32_t count, double *biases, ca_block_test *test)
{
    if (count == 0) return;
    const uint64_t tests = 3 * (uint64_t)count;
    const double alpha = ca_sidak_alpha(CA_COMPARE_ALPHA, tests);
    double smallest = 1.0;
    test->done = true;
    test->blocks = count;
    for (uint32_t i = 0; i < count; i++) {
        const double p = fmin(records[i].p[0], fmin(records[i].p[1], records[i].p[2]));
        if (p < alpha) test->rejected++;
        smallest = fmin(smallest, p);
    }
    test->p_value = ca_sidak_p(smallest, tests);
    judge_power(records, count, ca_normal_two_sided_quantile(alpha), biases, test);
}

static uint32_t blocks_along(uint32_t pixels, uint32_t side) { return pixels / side + (pixels % side != 0); }

/* `records`, `differences`: room for all blocks. */
static void compare_blocks(const comparison_job *job, block_record *records, double *differences,
                           ca_comparison *result)
{
    const ca_pixel_rect *roi = &job->pair.roi;
    const uint64_t block_width = roi->x1 - roi->x0 < job->side ? roi->x1 - roi->x0 : job->side;
    const uint64_t block_height = roi->y1 - roi->y0 < job->side ? roi->y1 - roi->y0 : job->side;
    uint32_t tested = 0;
    const uint32_t rows = blocks_along(roi->y1 - roi->y0, job->side);
    for (uint32_t row = 0; row < rows && ca_loading_check(NULL) == CA_OK; row++)
        for (uint32_t column = 0; column < blocks_along(roi->x1 - roi->x0, job->side); column++) {
            const block b = gather_block(job, roi->x0 + column * job->side, roi->y0 + row * job->side);
            /* Too little of it is left for its mean to say something. */
            if (b.pixels == 0 || 4 * (uint64_t)b.pixels < block_width * block_height) {
                result->blocks_left_out++;
                continue;
            }
            differences[result->blocks++] =
                relative_difference(block_luminance(b.image), block_luminance(b.reference));
            if (b.known_variance)
                records[tested++] = record_block(job, &b);
            else if (job->image.has_variance)
                result->test.blocks_untested++;
        }
    result->median_block_difference = median(differences, result->blocks);
    result->test.reference_exact = !job->reference.has_variance;
    judge(records, tested, differences, &result->test);
    result->test.detectable_bias += largest_rounding(&job->image) + largest_rounding(&job->reference);
}

ca_status ca_compare(const ca_image_layers *image, const ca_image_layers *reference,
                     const ca_compare_settings *settings, ca_comparison *comparison, ca_error *error)
{
    *comparison = (ca_comparison){0};
    comparison_job job = {.side = settings->block_side ? settings->block_side : DEFAULT_BLOCK_SIDE};
    CA_TRY(ca_picture_pair_open(image, reference, settings, &job.pair, error));
    open_picture(image, job.pair.image, &job.image);
    open_picture(reference, job.pair.reference, &job.reference);
    measure(&job, comparison);
    CA_TRY(ca_loading_check(error));
    if (comparison->pixels == 0)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "nothing is left to compare: all pixels are masked or not finite");

    const size_t blocks = (size_t)blocks_along(job.pair.roi.x1 - job.pair.roi.x0, job.side) *
                          blocks_along(job.pair.roi.y1 - job.pair.roi.y0, job.side);
    block_record *records = ca_alloc(blocks, sizeof *records);
    double *differences = ca_alloc(blocks, sizeof *differences);
    if (records && differences) compare_blocks(&job, records, differences, comparison);
    const ca_status status = records && differences ? CA_OK : ca_fail_memory(error, "comparing images");
    ca_free(records);
    ca_free(differences);
    CA_TRY(status);
    return ca_loading_check(error);
}
