/* The public calls of caustica.h that only pass things on. */
#include "base/loading.h"
#include "image/image.h"
#include "import/import.h"
#include "metrics/image_metrics.h"
#include "render/render.h"

#include <math.h>
#include <string.h>

#define CA_TEXT_(x) #x
#define CA_TEXT(x) CA_TEXT_(x)

const char *ca_version(void)
{
    return CA_TEXT(CA_VERSION_MAJOR) "." CA_TEXT(CA_VERSION_MINOR) "." CA_TEXT(CA_VERSION_PATCH);
}

ca_status ca_scene_parse(const ca_scene_source *source, ca_scene **scene, ca_error *error)
{
    *scene = NULL;
    ca_scene_desc desc;
    const int *before = ca_loading_until(source->stop);
    ca_status status = ca_import_scene_source(source, &desc, error);
    if (status == CA_OK) status = ca_scene_compile_after(&desc, source->previous, source->stop, scene, error);
    ca_loading_until(before);
    return status;
}

ca_status ca_scene_load(const char *path, const ca_define *defines, size_t define_count, ca_scene **scene,
                        ca_error *error)
{
    const ca_scene_source source = {.path = path, .defines = defines, .define_count = define_count};
    return ca_scene_parse(&source, scene, error);
}

ca_status ca_scene_view(ca_scene *scene, const ca_scene_source *source, ca_scene **view, ca_error *error)
{
    *view = NULL;
    ca_scene_desc desc;
    const int *before = ca_loading_until(source->stop);
    const ca_status status = ca_import_scene_source(source, &desc, error);
    ca_loading_until(before);
    return status == CA_OK ? ca_scene_view_create(scene, &desc, view, error) : status;
}

const char *ca_scene_note(const ca_scene *scene, size_t index)
{
    return index < scene->desc.notes.count ? scene->desc.notes.items[index] : NULL;
}

uint32_t ca_scene_builds(const ca_scene *scene) { return ca_accel_builds(scene->accel); }

void ca_scene_release(ca_scene *scene) { ca_scene_destroy(scene); }

/* `size` is what the program knows of the structure, which may be less. */
void ca_render_settings_init_sized(ca_render_settings *settings, size_t size)
{
    memset(settings, 0, size);
    settings->size = size;
}

void ca_render_statistics_init_sized(ca_render_statistics *statistics, size_t size)
{
    memset(statistics, 0, size);
    statistics->size = size;
}

void ca_image_size(const ca_image_layers *image, uint32_t *width, uint32_t *height)
{
    *width = image->width;
    *height = image->height;
}

const float *ca_image_channel(const ca_image_layers *image, const char *name) { return ca_layers_find(image, name); }

size_t ca_image_channel_count(const ca_image_layers *image) { return image->channel_count; }

const char *ca_image_channel_name(const ca_image_layers *image, size_t index)
{
    return index < image->channel_count ? image->channels[index].name : NULL;
}

bool ca_image_attribute(const ca_image_layers *image, size_t index, const char **name, const char **text,
                        double *number)
{
    if (index >= image->attribute_count) return false;
    const ca_attribute *attribute = &image->attributes[index];
    *name = attribute->name;
    *text = attribute->text;
    *number = attribute->number;
    return true;
}

ca_status ca_image_make(uint32_t width, uint32_t height, ca_image_layers **image, ca_error *error)
{
    *image = NULL;
    if (width == 0 || height == 0 || (size_t)width * height > CA_IMAGE_MAX_PIXELS)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "a picture has 1 to %zu pixels, not %u x %u",
                       CA_IMAGE_MAX_PIXELS, width, height);
    return ca_layers_create(image, width, height, error);
}

ca_status ca_image_add(ca_image_layers *image, const char *name, const float *values, ca_error *error)
{
    float *data;
    if (!name || !*name) return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "a channel needs a name");
    if (ca_layers_find(image, name))
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "there is a channel \"%s\" already", name);
    CA_TRY(ca_layers_add(image, name, &data, error));
    memcpy(data, values, (size_t)image->width * image->height * sizeof *data);
    return CA_OK;
}

ca_status ca_image_load_until(const char *path, const int *stop, ca_image_layers **image, ca_error *error)
{
    *image = NULL;
    const int *before = ca_loading_until(stop);
    const ca_status status = ca_layers_read(path, image, error);
    ca_loading_until(before);
    return status;
}

ca_status ca_image_load(const char *path, ca_image_layers **image, ca_error *error)
{
    return ca_image_load_until(path, NULL, image, error);
}

static ca_status compare(const ca_image_layers *image, const ca_image_layers *reference,
                         const ca_compare_settings *region, ca_image_difference *difference, ca_error *error)
{
    const ca_metric_settings settings = ca_metric_defaults();
    ca_comparison c;
    ca_image_metrics m;
    CA_TRY(ca_compare(image, reference, region, &c, error));
    CA_TRY(ca_measure_image(image, reference, region, &settings, &m, NULL, error));
    const double unknown = (double)NAN;
    *difference = (ca_image_difference){.rmse = c.rmse,
                                        .mae = c.mae,
                                        .relmse = c.relmse,
                                        .smape = c.smape,
                                        .ssim = m.ssim,
                                        .flip_ldr = m.flip_ldr,
                                        .flip_hdr = m.flip_hdr,
                                        .mean_luminance = c.mean_luminance,
                                        .reference_mean_luminance = c.reference_mean_luminance,
                                        .pixels = c.pixels,
                                        .non_finite = c.non_finite,
                                        .blocks = c.test.done ? c.test.blocks : 0,
                                        .blocks_rejected = c.test.done ? c.test.rejected : 0,
                                        .p_value = c.test.done ? c.test.p_value : unknown,
                                        .detectable_bias = c.test.done ? c.test.detectable_bias : unknown};
    return CA_OK;
}

ca_status ca_image_compare_within(const ca_image_layers *image, const ca_image_layers *reference,
                                  const uint32_t *region, const int *stop, ca_image_difference *difference,
                                  ca_error *error)
{
    ca_compare_settings settings = {.has_roi = region != NULL};
    if (region) settings.roi = (ca_pixel_rect){region[0], region[1], region[2], region[3]};
    const int *before = ca_loading_until(stop);
    const ca_status status = compare(image, reference, &settings, difference, error);
    ca_loading_until(before);
    return status;
}

ca_status ca_image_compare(const ca_image_layers *image, const ca_image_layers *reference,
                           ca_image_difference *difference, ca_error *error)
{
    return ca_image_compare_within(image, reference, NULL, NULL, difference, error);
}

ca_status ca_image_save_until(const ca_image_layers *image, const char *path, float exposure, const int *stop,
                              ca_error *error)
{
    const int *before = ca_loading_until(stop);
    const ca_status status = ca_layers_write(image, path, exposure, error);
    ca_loading_until(before);
    return status;
}

ca_status ca_image_save(const ca_image_layers *image, const char *path, float exposure, ca_error *error)
{
    return ca_image_save_until(image, path, exposure, NULL, error);
}

void ca_image_release(ca_image_layers *image) { ca_layers_destroy(image); }
