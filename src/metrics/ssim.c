#include "metrics/ssim.h"

#include "base/memory.h"
#include "metrics/separable.h"

#include <math.h>

/* What a window is described by. */
enum { MEAN_A, MEAN_B, SQUARE_A, SQUARE_B, PRODUCT, MOMENTS };

typedef struct ssim_job {
    const ca_ssim_pictures *pictures;
    ca_kernel kernel;
    double c1, c2;
    double *scratch; /* one part for each worker */
    size_t scratch_size;
    float *map;
} ssim_job;

static double similarity(const ssim_job *job, const double moments[MOMENTS])
{
    const double a = moments[MEAN_A], b = moments[MEAN_B];
    const double variances = moments[SQUARE_A] - a * a + moments[SQUARE_B] - b * b;
    const double covariance = moments[PRODUCT] - a * b;
    return (2.0 * a * b + job->c1) * (2.0 * covariance + job->c2) /
           ((a * a + b * b + job->c1) * (variances + job->c2));
}

static void filter_moments(const ssim_job *job, int channel, uint32_t y, double *columns, double *rows)
{
    const uint32_t width = job->pictures->width;
    const float *a = job->pictures->a[channel], *b = job->pictures->b[channel];
    const float *const factors[MOMENTS][2] = {{a, NULL}, {b, NULL}, {a, a}, {b, b}, {a, b}};
    for (int m = 0; m < MOMENTS; m++) {
        const ca_filter_source source = {.plane = factors[m][0],
                                         .times = factors[m][1],
                                         .width = width,
                                         .height = job->pictures->height,
                                         .border = CA_BORDER_MIRROR};
        ca_filter_columns(&source, y, &job->kernel, job->kernel.radius, columns);
        ca_filter_row(columns, width, &job->kernel, rows + (size_t)m * width);
    }
}

static void map_row(void *user, uint32_t y, uint32_t worker)
{
    const ssim_job *job = user;
    const uint32_t width = job->pictures->width;
    double *rows = job->scratch + worker * job->scratch_size;
    double *sum = rows + (size_t)MOMENTS * width, *columns = sum + width;
    for (uint32_t x = 0; x < width; x++) sum[x] = 0.0;
    for (int c = 0; c < 3; c++) {
        filter_moments(job, c, y, columns, rows);
        for (uint32_t x = 0; x < width; x++) {
            double moments[MOMENTS];
            for (int m = 0; m < MOMENTS; m++) moments[m] = rows[(size_t)m * width + x];
            sum[x] += similarity(job, moments);
        }
    }
    for (uint32_t x = 0; x < width; x++) job->map[(size_t)y * width + x] = (float)(sum[x] / 3.0);
}

/* The Gaussian, of sum 1. */
static void fill_weights(double *weights, uint32_t radius, double sigma)
{
    double sum = 0.0;
    for (uint32_t i = 0; i <= 2 * radius; i++) {
        const double x = ((double)i - (double)radius) / sigma;
        weights[i] = exp(-0.5 * x * x);
        sum += weights[i];
    }
    for (uint32_t i = 0; i <= 2 * radius; i++) weights[i] /= sum;
}

ca_status ca_ssim_map(const ca_ssim_pictures *pictures, const ca_ssim_settings *settings, const ca_parallel *parallel,
                      float *map, ca_error *error)
{
    if (settings->window % 2 == 0)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "SSIM's window must have an odd side, not %u",
                       settings->window);
    const uint32_t radius = settings->window / 2;
    const double c1 = settings->k1 * settings->range, c2 = settings->k2 * settings->range;
    ssim_job job = {.pictures = pictures, .c1 = c1 * c1, .c2 = c2 * c2, .map = map};
    job.scratch_size = (size_t)(MOMENTS + 2) * pictures->width + 2 * (size_t)radius;
    double *weights = ca_alloc(settings->window, sizeof *weights);
    job.scratch = ca_alloc(job.scratch_size * parallel->workers, sizeof *job.scratch);
    ca_status status = weights && job.scratch ? CA_OK : ca_fail_memory(error, "SSIM");
    if (status == CA_OK) {
        fill_weights(weights, radius, settings->sigma);
        job.kernel = (ca_kernel){.radius = radius, .weights = weights};
        status = ca_parallel_for(parallel, pictures->height, map_row, &job, error);
    }
    ca_free(weights);
    ca_free(job.scratch);
    return status;
}
