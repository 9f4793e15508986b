#define _POSIX_C_SOURCE 200809L
#include "support/scene_text.h"

#include "base/memory.h"

#include "image/layers.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

ca_scene *scene_from_text(const char *xml)
{
    char path[] = "/tmp/caustica-scene-XXXXXX";
    const int descriptor = mkstemp(path);
    assert_true(descriptor >= 0);
    FILE *file = fdopen(descriptor, "w");
    assert_non_null(file);
    fputs(xml, file);
    assert_int_equal(fclose(file), 0);
    ca_scene *scene = NULL;
    ca_error error;
    const ca_status status = ca_scene_load(path, NULL, 0, &scene, &error);
    unlink(path);
    if (status != CA_OK) fail_msg("%s", error.message);
    return scene;
}

ca_scene *bundled_scene_with(const char *name, const ca_define *define)
{
    char path[512];
    ca_scene *scene = NULL;
    ca_error error;
    snprintf(path, sizeof path, CA_SOURCE_DIR "/scenes/%s.xml", name);
    if (ca_scene_load(path, define, define ? 1 : 0, &scene, &error) != CA_OK) fail_msg("%s", error.message);
    return scene;
}

ca_scene *bundled_scene(const char *name) { return bundled_scene_with(name, NULL); }

ca_image_layers *render_scene(const ca_scene *scene, const ca_render_settings *settings)
{
    ca_image_layers *image = NULL;
    ca_render_statistics statistics = {.size = sizeof statistics};
    ca_error error;
    const ca_status status = ca_render(scene, settings, &image, &statistics, &error);
    if (status != CA_OK) fail_msg("%s", error.message);
    assert_int_equal(statistics.non_finite, 0);
    return image;
}

void channel_mean(const ca_image_layers *image, const char *channel, double *mean, double *standard_error)
{
    char variance_name[64];
    snprintf(variance_name, sizeof variance_name, "Variance.%s", channel);
    const float *value = ca_image_channel(image, channel), *variance = ca_image_channel(image, variance_name),
                *samples = ca_image_channel(image, "Samples.Y");
    assert_true(value && variance && samples);
    uint32_t width, height;
    ca_image_size(image, &width, &height);
    const size_t count = (size_t)width * height;
    double sum = 0.0, sum_variance = 0.0;
    for (size_t i = 0; i < count; i++) {
        sum += (double)value[i];
        sum_variance += (double)variance[i] / (double)samples[i];
    }
    *mean = sum / (double)count;
    *standard_error = sqrt(sum_variance) / (double)count;
}

uint64_t image_hash(const ca_image_layers *image)
{
    uint64_t hash = 14695981039346656037u; /* FNV-1a */
    for (size_t c = 0; c < image->channel_count; c++) {
        const unsigned char *bytes = (const unsigned char *)image->channels[c].data;
        const size_t size = (size_t)image->width * image->height * sizeof(float);
        for (size_t i = 0; i < size; i++) hash = (hash ^ bytes[i]) * 1099511628211u;
    }
    return hash;
}

uint64_t rendered_hash(const ca_scene *scene, const ca_render_settings *settings)
{
    ca_image_layers *image = render_scene(scene, settings);
    const uint64_t hash = image_hash(image);
    ca_image_release(image);
    return hash;
}

const char *reference_scenes(void)
{
    const char *folder = getenv("CAUSTICA_SCENES");
    if (!folder) folder = CA_SOURCE_DIR "/../shared/scenes";
    if (access(folder, R_OK) == 0) return folder;
    print_message("SKIPPED, reference scenes are missing: set CAUSTICA_SCENES to their folder (looked in %s)\n",
                  folder);
    return NULL;
}

const char *attribute_text(const ca_image_layers *image, const char *name)
{
    const ca_attribute *attribute = ca_layers_attribute(image, name);
    if (!attribute || !attribute->text) fail_msg("no attribute %s", name);
    return attribute->text;
}

long render_without_memory(const ca_scene *scene, const ca_render_settings *settings)
{
    bool done = false;
    long count = 0;
    for (; !done; count += 1 + count / 6) {
        ca_image_layers *image = NULL;
        ca_memory_fail_after(count);
        const ca_status status = ca_render(scene, settings, &image, NULL, NULL);
        done = status == CA_OK;
        if (!done) {
            assert_int_equal(status, CA_ERROR_MEMORY);
            assert_null(image);
        }
        ca_memory_fail_after(-1);
        ca_image_release(image);
    }
    return count;
}

double picture_difference(const ca_image_layers *a, const ca_image_layers *b)
{
    static const char *const channels[] = {"R", "G", "B"};
    uint32_t width, height, other_width, other_height;
    double largest = 0.0, sum = 0.0;
    ca_image_size(a, &width, &height);
    ca_image_size(b, &other_width, &other_height);
    assert_int_equal(width, other_width);
    assert_int_equal(height, other_height);
    for (int c = 0; c < 3; c++) {
        const float *x = ca_image_channel(a, channels[c]), *y = ca_image_channel(b, channels[c]);
        for (size_t i = 0; i < (size_t)width * height; i++) {
            largest = fmax(largest, fabs((double)x[i] - (double)y[i]));
            sum += (double)y[i];
        }
    }
    assert_true(sum > 0.0);
    return largest / (sum / (3.0 * width * height));
}
