#include "support/batches.h"

#include "metrics/compare.h"
#include "metrics/significance.h"
#include "image/layers.h"
#include "support/scene_text.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const char *const colors[3] = {"R", "G", "B"};
static const char *const variances[3] = {"Variance.R", "Variance.G", "Variance.B"};

static ca_image_layers *render_batch(const ca_scene *scene, const batch_settings *settings, uint32_t batch)
{
    ca_render_settings render;
    ca_render_settings_init(&render);
    render.integrator = settings->integrator;
    render.sampler = settings->sampler ? settings->sampler : "independent";
    render.samples_per_pixel = settings->samples;
    render.has_seed = true;
    render.seed = settings->seed + batch;
    render.threads = settings->threads;
    render.width = settings->width;
    render.height = settings->height;
    render.has_crop = settings->crop[2] > 0;
    memcpy(render.crop, settings->crop, sizeof render.crop);
    return render_scene(scene, &render);
}

static double mean_of_rect(const ca_image_layers *image, const char *channel, ca_pixel_rect rect)
{
    const float *values = ca_layers_find(image, channel);
    assert_non_null(values);
    double sum = 0.0;
    for (uint32_t y = rect.y0; y < rect.y1; y++)
        for (uint32_t x = rect.x0; x < rect.x1; x++) sum += (double)values[(size_t)y * image->width + x];
    return sum / ((double)(rect.x1 - rect.x0) * (double)(rect.y1 - rect.y0));
}

/* Mean and sum of squared deviations so far (Welford's update). */
typedef struct running {
    double mean, squares;
    uint32_t count;
} running;

static void running_add(running *r, double value)
{
    const double before = value - r->mean;
    r->count++;
    r->mean += before / r->count;
    r->squares += before * (value - r->mean);
}

static void add_blocks(const ca_image_layers *image, uint32_t side, running *blocks)
{
    assert_true(image->width % side == 0 && image->height % side == 0);
    for (uint32_t y = 0; y < image->height; y += side)
        for (uint32_t x = 0; x < image->width; x += side)
            for (int c = 0; c < 3; c++)
                running_add(blocks++, mean_of_rect(image, colors[c], (ca_pixel_rect){x, y, x + side, y + side}));
}

/* The channels of a picture, made from three `running` for each pixel. */
static ca_image_layers *blocks_to_layers(const running *blocks, uint32_t width, uint32_t height)
{
    ca_image_layers *layers = NULL;
    assert_int_equal(ca_layers_create(&layers, width, height, NULL), CA_OK);
    const size_t pixels = (size_t)width * height;
    float *samples;
    assert_int_equal(ca_layers_add(layers, "Samples.Y", &samples, NULL), CA_OK);
    for (size_t i = 0; i < pixels; i++) samples[i] = (float)blocks[3 * i].count;
    for (int c = 0; c < 3; c++) {
        float *value, *variance;
        assert_int_equal(ca_layers_add(layers, colors[c], &value, NULL), CA_OK);
        assert_int_equal(ca_layers_add(layers, variances[c], &variance, NULL), CA_OK);
        for (size_t i = 0; i < pixels; i++) {
            const running *r = &blocks[3 * i + (size_t)c];
            value[i] = (float)r->mean;
            variance[i] = (float)(r->squares / (r->count - 1));
        }
    }
    return layers;
}

ca_image_layers *render_batches(const ca_scene *scene, const batch_settings *settings)
{
    running *blocks = NULL;
    uint32_t width = 0, height = 0;
    for (uint32_t i = 0; i < settings->batches; i++) {
        ca_image_layers *image = render_batch(scene, settings, i);
        width = image->width / settings->block_side;
        height = image->height / settings->block_side;
        if (!blocks) blocks = calloc((size_t)width * height * 3, sizeof *blocks);
        assert_non_null(blocks);
        add_blocks(image, settings->block_side, blocks);
        ca_image_release(image);
    }
    ca_image_layers *layers = blocks_to_layers(blocks, width, height);
    free(blocks);
    return layers;
}

void batch_means(const ca_scene *scene, const batch_settings *settings, double *means)
{
    for (uint32_t i = 0; i < settings->batches; i++) {
        ca_image_layers *image = render_batch(scene, settings, i);
        means[i] = mean_of_rect(image, "G", (ca_pixel_rect){0, 0, image->width, image->height});
        ca_image_release(image);
    }
}

measured measured_of(const double *values, uint32_t count)
{
    running r = {0};
    for (uint32_t i = 0; i < count; i++) running_add(&r, values[i]);
    return (measured){.mean = r.mean, .error = sqrt(r.squares / (r.count - 1) / r.count), .degrees = r.count - 1};
}

measured measure_mean(const ca_scene *scene, const batch_settings *settings)
{
    double *means = calloc(settings->batches, sizeof *means);
    assert_non_null(means);
    batch_means(scene, settings, means);
    const measured value = measured_of(means, settings->batches);
    free(means);
    return value;
}

double p_value_of(measured value, double expected, double tolerance)
{
    const double difference = fmax(fabs(value.mean - expected) - tolerance, 0.0);
    if (difference == 0.0) return 1.0;
    return value.error > 0.0 ? ca_student_two_sided_p(difference / value.error, value.degrees) : 0.0;
}

/* ---- What a comparison of block pictures would see ------------------------------------------------------------- */

/* One block and channel: the reference's mean in standard errors of the difference, and how many of these make the
 * test reject. */
typedef struct power_term {
    double signal, threshold;
} power_term;

static double student_two_sided_quantile(double alpha, double degrees)
{
    double low = 0.0, high = 1e3;
    for (int i = 0; i < 60; i++) {
        const double middle = 0.5 * (low + high);
        if (ca_student_two_sided_p(middle, degrees) > alpha)
            low = middle;
        else
            high = middle;
    }
    return high;
}

static power_term term_of(const ca_image_layers *image, const ca_image_layers *reference, size_t pixel, int c,
                          double alpha)
{
    const double n = (double)ca_layers_find(image, "Samples.Y")[pixel];
    const double m = (double)ca_layers_find(reference, "Samples.Y")[pixel];
    const double a = (double)ca_layers_find(image, variances[c])[pixel] / n;
    const double b = (double)ca_layers_find(reference, variances[c])[pixel] / m;
    if (!(a + b > 0.0)) return (power_term){.threshold = (double)INFINITY}; /* says nothing */
    const double degrees = (a + b) * (a + b) / (a * a / (n - 1.0) + b * b / (m - 1.0)); /* Welch */
    return (power_term){.signal = fabs((double)ca_layers_find(reference, colors[c])[pixel]) / sqrt(a + b),
                        .threshold = student_two_sided_quantile(alpha, degrees)};
}

static double probability_of_missing(const power_term *terms, size_t count, double bias)
{
    double log_miss = 0.0;
    for (size_t i = 0; i < count; i++) {
        const double shift = bias * terms[i].signal, t = terms[i].threshold;
        log_miss += log(fmax(ca_normal_cdf(t - shift) - ca_normal_cdf(-t - shift), 1e-300));
    }
    return exp(log_miss);
}

double detectable_block_bias(const ca_image_layers *image, const ca_image_layers *reference, double alpha)
{
    const size_t pixels = (size_t)image->width * image->height, count = 3 * pixels;
    const double alpha_each = ca_sidak_alpha(alpha, count);
    power_term *terms = calloc(count, sizeof *terms);
    assert_non_null(terms);
    for (size_t i = 0; i < count; i++) terms[i] = term_of(image, reference, i / 3, (int)(i % 3), alpha_each);
    double high = 1e-6;
    while (high < 1e3 && probability_of_missing(terms, count, high) > 1.0 - CA_COMPARE_POWER) high *= 1.02;
    free(terms);
    return high < 1e3 ? high : (double)INFINITY;
}

void integrator_text(const char *text, double radius, char *integrator, size_t size)
{
    const char *mark = strstr(text, "%g");
    if (!mark)
        snprintf(integrator, size, "%s", text);
    else
        snprintf(integrator, size, "%.*s%g%s", (int)(mark - text), text, radius, mark + 2);
}

uint64_t seed_of(const char *name)
{
    uint64_t hash = 14695981039346656037u; /* FNV-1a */
    for (; *name; name++) hash = (hash ^ (unsigned char)*name) * 1099511628211u;
    return hash >> 24;
}
