#include "noise/layers.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

/* The last one of connections only, where there are any. */
enum { VALUES = 6, CHANNELS = 3 };
static const char *const layer_names[VALUES][2] = {
    {"Noise.Camera", "Noise.Camera.StdErr"},       {"Noise.Light", "Noise.Light.StdErr"},
    {"Noise.Pair", "Noise.Pair.StdErr"},           {"Noise.Predicted", "Noise.Predicted.StdErr"},
    {"Noise.Measured", "Noise.Measured.StdErr"}, {"Noise.Connect", "Noise.Connect.StdErr"},
};

size_t ca_noise_layers_bytes(const ca_pair_film *film, bool connects)
{
    return (size_t)(connects ? VALUES : VALUES - 1) * 2 * sizeof(float) * film->width * film->height;
}

ca_status ca_noise_add_layers(const ca_pair_film *film, ca_image_layers *image, ca_error *error)
{
    float *data[VALUES][2];
    assert(image->width == film->width && image->height == film->height);
    const int count = film->connections ? VALUES : VALUES - 1;
    for (int v = 0; v < count; v++)
        for (int i = 0; i < 2; i++) CA_TRY(ca_layers_add(image, layer_names[v][i], &data[v][i], error));
    for (size_t p = 0; p < (size_t)film->width * film->height; p++) {
        const ca_noise_terms t = ca_noise_terms_at(film, p, film->light_paths, film->camera_paths);
        const ca_noise_value values[VALUES] = {t.camera, t.light, t.pair, t.predicted, t.measured, t.connect};
        for (int v = 0; v < count; v++) {
            data[v][0][p] = (float)values[v].value;
            data[v][1][p] = (float)values[v].error;
        }
    }
    return CA_OK;
}

/* ---- The picture ----------------------------------------------------------------------------------------------- */

static int by_size(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* The smallest value that at least 99 of 100 do not exceed. */
static ca_status percentile_99(float *const channels[CHANNELS], size_t count, double *value, ca_error *error)
{
    float *largest = ca_alloc(count, sizeof *largest);
    if (!largest) return ca_fail_memory(error, "the picture of the noise");
    for (size_t p = 0; p < count; p++) largest[p] = fmaxf(channels[0][p], fmaxf(channels[1][p], channels[2][p]));
    qsort(largest, count, sizeof *largest, by_size);
    *value = (double)largest[(count * 99 + 99) / 100 - 1];
    ca_free(largest);
    return CA_OK;
}

static ca_status fill_picture(const ca_image_layers *image, ca_image_layers *picture, double *scale, ca_error *error)
{
    static const char *const names[CHANNELS] = {"R", "G", "B"}, *const terms[CHANNELS] = {
                                                                    "Noise.Pair", "Noise.Camera", "Noise.Light"};
    const size_t count = (size_t)image->width * image->height;
    float *channels[CHANNELS];
    for (int c = 0; c < CHANNELS; c++) {
        const float *variances = ca_layers_find(image, terms[c]);
        assert(variances);
        CA_TRY(ca_layers_add(picture, names[c], &channels[c], error));
        for (size_t p = 0; p < count; p++) channels[c][p] = sqrtf(fmaxf(0.0f, variances[p]));
    }
    CA_TRY(percentile_99(channels, count, scale, error));
    if (*scale == 0.0) *scale = 1.0;
    for (int c = 0; c < CHANNELS; c++)
        for (size_t p = 0; p < count; p++) channels[c][p] = (float)((double)channels[c][p] / *scale);
    return CA_OK;
}

ca_status ca_noise_picture(const ca_image_layers *image, ca_image_layers **picture, double *scale, ca_error *error)
{
    CA_TRY(ca_layers_create(picture, image->width, image->height, error));
    const ca_status status = fill_picture(image, *picture, scale, error);
    if (status == CA_OK) return CA_OK;
    ca_layers_destroy(*picture);
    *picture = NULL;
    return status;
}
