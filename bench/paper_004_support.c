/* Renders and statistics of paper 004's figures. */
#include "bench_support.h"
#include "paper_004.h"

#include "report/power_fit.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- Renders --------------------------------------------------------------------------------------------------- */

static ca_render_settings settings_of(const paper_job *job)
{
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.integrator = job->integrator;
    settings.sampler = job->sampler;
    settings.samples_per_pixel = job->samples;
    settings.seconds = job->seconds;
    settings.seed = job->seed;
    settings.has_seed = true;
    settings.threads = job->threads ? job->threads : PAPER_THREADS;
    settings.width = job->width;
    settings.height = job->height;
    if (job->crop) {
        settings.has_crop = true;
        memcpy(settings.crop, job->crop, sizeof settings.crop);
    }
    return settings;
}

paper_picture paper_render(const paper_job *job)
{
    paper_picture picture = {0};
    const ca_render_settings settings = settings_of(job);
    ca_error error;
    if (ca_render(job->scene, &settings, &picture.layers, &picture.statistics, &error) != CA_OK)
        bench_die(job->integrator, &error);
    if (picture.statistics.non_finite > 0) {
        fprintf(stderr, "%s: samples that are not finite\n", job->integrator);
        exit(1);
    }
    ca_image_size(picture.layers, &picture.width, &picture.height);
    const float *r = ca_image_channel(picture.layers, "R"), *g = ca_image_channel(picture.layers, "G"),
                *b = ca_image_channel(picture.layers, "B");
    const size_t pixels = (size_t)picture.width * picture.height;
    picture.luminance = paper_need(calloc(pixels, sizeof *picture.luminance));
    for (size_t p = 0; p < pixels; p++)
        picture.luminance[p] = 0.2126 * (double)r[p] + 0.7152 * (double)g[p] + 0.0722 * (double)b[p];
    return picture;
}

void paper_release(paper_picture *picture)
{
    free(picture->luminance);
    ca_image_release(picture->layers);
    *picture = (paper_picture){0};
}

void paper_save(const paper_report *report, const paper_picture *picture, const char *name)
{
    char path[512];
    ca_error error;
    if (!report->pictures) return;
    snprintf(path, sizeof path, "%s/%s", report->pictures, name);
    if (ca_image_save(picture->layers, path, 0.0f, &error) != CA_OK) bench_die(path, &error);
}

/* ---- Repeats --------------------------------------------------------------------------------------------------- */

paper_repeats paper_repeats_start(size_t pixels)
{
    return (paper_repeats){.pixels = pixels,
                           .sum = paper_need(calloc(pixels, sizeof(double))),
                           .sum_of_squares = paper_need(calloc(pixels, sizeof(double)))};
}

void paper_repeats_add(paper_repeats *repeats, const double *luminance)
{
    repeats->count++;
    for (size_t p = 0; p < repeats->pixels; p++) {
        repeats->sum[p] += luminance[p];
        repeats->sum_of_squares[p] += luminance[p] * luminance[p];
    }
}

void paper_repeats_release(paper_repeats *repeats)
{
    free(repeats->sum);
    free(repeats->sum_of_squares);
    *repeats = (paper_repeats){0};
}

/* ---- References ------------------------------------------------------------------------------------------------ */

paper_reference paper_render_reference(const paper_job *first)
{
    paper_job job = *first;
    job.seed = 1001;
    paper_picture half = paper_render(&job);
    job.seed = 1002;
    paper_picture other = paper_render(&job);
    paper_reference r = {.luminance = half.luminance,
                         .width = half.width,
                         .height = half.height,
                         .pixels = (size_t)half.width * half.height};
    double square = 0.0;
    for (size_t p = 0; p < r.pixels; p++) {
        const double difference = 0.5 * (half.luminance[p] - other.luminance[p]);
        square += difference * difference / (double)r.pixels;
        half.luminance[p] = 0.5 * (half.luminance[p] + other.luminance[p]);
    }
    half.luminance = NULL; /* kept */
    r.noise = sqrt(square);
    paper_release(&half);
    paper_release(&other);
    return r;
}

double paper_reference_error(const paper_reference *truth, const double *luminance)
{
    double sum = 0.0;
    for (size_t p = 0; p < truth->pixels; p++) {
        const double difference = luminance[p] - truth->luminance[p];
        sum += difference * difference / (double)truth->pixels;
    }
    return sqrt(fmax(0.0, sum - truth->noise * truth->noise)) / paper_mean(truth->luminance, truth->pixels);
}

/* ---- Errors ---------------------------------------------------------------------------------------------------- */

static double signed_root(double square) { return square < 0.0 ? -sqrt(-square) : sqrt(square); }

/* Two standard errors of the estimated square, as a length: a mean of squares over so many pixels, of which some ten
 * are neighbours that share their photons. */
static double bias_floor(double variance, double pixels) { return sqrt(2.0 * variance * sqrt(2.0 * 10.0 / pixels)); }

paper_errors paper_repeats_errors(const paper_repeats *repeats, const double *truth, double noise)
{
    const double n = repeats->count, pixels = (double)repeats->pixels;
    double variance = 0.0, difference = 0.0;
    for (size_t p = 0; p < repeats->pixels; p++) {
        const double mean = repeats->sum[p] / n;
        const double v = fmax(0.0, (repeats->sum_of_squares[p] - n * mean * mean) / (n - 1.0));
        variance += v / pixels;
        if (!truth) continue;
        /* Less what the mean's own noise and the truth's put there. */
        difference += ((mean - truth[p]) * (mean - truth[p]) - v / n) / pixels;
    }
    difference -= noise * noise;
    const double unit = truth ? paper_mean(truth, repeats->pixels) : paper_mean(repeats->sum, repeats->pixels) / n;
    return (paper_errors){.rmse = sqrt(fmax(0.0, difference) + variance) / unit,
                          .bias = signed_root(difference) / unit,
                          .bias_floor = bias_floor(variance / n + noise * noise, pixels) / unit,
                          .deviation = sqrt(variance) / unit};
}

paper_fit paper_fit_power(const double *x, const double *y, int count)
{
    const ca_power_fit fit = ca_power_fit_of(x, y, (size_t)count);
    return (paper_fit){.exponent = fit.exponent, .offset = fit.offset, .error = fit.error};
}
