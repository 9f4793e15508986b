/* Box-downsampling of a reference, for comparing it with a smaller picture. */
#include "metrics/compare.h"

#include <string.h>

/* Sum over the pixels of one channel that become pixel (x, y), of value or, with `divisor`, of value / divisor. */
static double box_sum(const ca_image_layers *layers, const float *channel, const float *divisor, uint32_t factor,
                      uint32_t x, uint32_t y)
{
    double sum = 0.0;
    for (uint32_t j = 0; j < factor; j++)
        for (uint32_t i = 0; i < factor; i++) {
            const size_t at = ((size_t)y * factor + j) * layers->width + (size_t)x * factor + i;
            sum += divisor ? (double)channel[at] / (double)divisor[at] : (double)channel[at];
        }
    return sum;
}

static bool was_half(const ca_image_layers *layers, const char *name)
{
    for (size_t i = 0; i < layers->channel_count; i++)
        if (strcmp(layers->channels[i].name, name) == 0) return layers->channels[i].half;
    return false;
}

/* Adds a channel to the result, each pixel `scale` times the sum over its box. */
static ca_status add_summed(const ca_image_layers *from, const char *name, uint32_t factor, double scale,
                            ca_image_layers *to, ca_error *error)
{
    const float *source = ca_layers_find(from, name);
    if (!source) return CA_OK;
    float *target = NULL;
    CA_TRY(ca_layers_add(to, name, &target, error));
    to->channels[to->channel_count - 1].half = was_half(from, name); /* a comparison allows for its rounding */
    for (uint32_t y = 0; y < to->height; y++)
        for (uint32_t x = 0; x < to->width; x++)
            target[(size_t)y * to->width + x] = (float)(scale * box_sum(from, source, NULL, factor, x, y));
    return CA_OK;
}

/* A pixel's mean has the variance V / N; the mean of k of them sum(V / N) / k^2, and it has all their samples. A
 * pixel without samples makes it not a number, which a comparison reports as an unknown variance. */
static ca_status add_variance(const ca_image_layers *from, const char *name, uint32_t factor, ca_image_layers *to,
                              ca_error *error)
{
    const float *source = ca_layers_find(from, name), *samples = ca_layers_find(from, "Samples.Y");
    if (!source || !samples) return CA_OK;
    const float *all_samples = ca_layers_find(to, "Samples.Y");
    float *target = NULL;
    CA_TRY(ca_layers_add(to, name, &target, error));
    const double pixels = (double)factor * (double)factor;
    for (uint32_t y = 0; y < to->height; y++)
        for (uint32_t x = 0; x < to->width; x++) {
            const size_t at = (size_t)y * to->width + x;
            const double of_mean = box_sum(from, source, samples, factor, x, y) / (pixels * pixels);
            target[at] = (float)(of_mean * (double)all_samples[at]);
        }
    return CA_OK;
}

static ca_status fill(const ca_image_layers *from, uint32_t factor, ca_image_layers *to, ca_error *error)
{
    static const char *const colors[] = {"R", "G", "B"};
    static const char *const variances[] = {"Variance.R", "Variance.G", "Variance.B"};
    const double mean = 1.0 / ((double)factor * (double)factor);
    for (size_t c = 0; c < 3; c++) CA_TRY(add_summed(from, colors[c], factor, mean, to, error));
    CA_TRY(add_summed(from, "Samples.Y", factor, 1.0, to, error));
    for (size_t c = 0; c < 3; c++) CA_TRY(add_variance(from, variances[c], factor, to, error));
    to->full_width = from->full_width / factor;
    to->full_height = from->full_height / factor;
    to->x0 = from->x0 / (int32_t)factor;
    to->y0 = from->y0 / (int32_t)factor;
    return CA_OK;
}

ca_status ca_compare_downsample(const ca_image_layers *layers, uint32_t factor, ca_image_layers **result,
                                ca_error *error)
{
    *result = NULL;
    if (factor == 0 || factor > (uint32_t)INT32_MAX || layers->width % factor || layers->height % factor)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "%u x %u pixels cannot be averaged by %u x %u", layers->width,
                       layers->height, factor, factor);
    const int32_t step = (int32_t)factor;
    if (layers->x0 % step || layers->y0 % step || layers->full_width % factor || layers->full_height % factor)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "%u x %u pixels from (%d, %d) of a film of %u x %u cannot be averaged by %u x %u: they would "
                       "lie between the pixels of the smaller film",
                       layers->width, layers->height, layers->x0, layers->y0, layers->full_width,
                       layers->full_height, factor, factor);
    ca_image_layers *small = NULL;
    CA_TRY(ca_layers_create(&small, layers->width / factor, layers->height / factor, error));
    const ca_status status = fill(layers, factor, small, error);
    if (status == CA_OK)
        *result = small;
    else
        ca_layers_destroy(small);
    return status;
}
