/* Layers to and from files: chooses the format, and makes writing all or nothing. */
#include "base/file.h"
#include "image/format.h"

#include <math.h>
#include <string.h>
#include <strings.h>

typedef enum output_format { OUTPUT_EXR, OUTPUT_PNG, OUTPUT_PFM, OUTPUT_FORMATS } output_format;

static const char *const output_extensions[OUTPUT_FORMATS] = {".exr", ".png", ".pfm"};

static output_format format_of(const char *path)
{
    const char *extension = ca_path_extension(path);
    int format = 0;
    while (format < OUTPUT_FORMATS && strcasecmp(extension, output_extensions[format]) != 0) format++;
    return (output_format)format;
}

ca_status ca_layers_check_path(const char *path, ca_error *error)
{
    if (format_of(path) < OUTPUT_FORMATS) return CA_OK;
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                   "%s: an image is written as .exr, .png or .pfm, and the file name must end in one of them", path);
}

static ca_status write_stream(const ca_image_layers *layers, output_format format, float exposure, FILE *stream,
                              const char *path, ca_error *error)
{
    if (format == OUTPUT_EXR) return ca_exr_write(layers, stream, path, error);
    const float *rgb[3] = {ca_layers_find(layers, "R"), ca_layers_find(layers, "G"), ca_layers_find(layers, "B")};
    if (!rgb[0] || !rgb[1] || !rgb[2])
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "%s: the image has no channels R, G and B; only .exr can hold it", path);
    if (format == OUTPUT_PNG)
        return ca_png_write(rgb, layers->width, layers->height, exposure, stream, path, error);
    return ca_pfm_write(rgb, layers->width, layers->height, stream, path, error);
}

ca_status ca_layers_write(const ca_image_layers *layers, const char *path, float exposure, ca_error *error)
{
    CA_TRY(ca_layers_check_path(path, error));
    ca_file_writer writer;
    CA_TRY(ca_file_create(&writer, path, error));
    const ca_status status = write_stream(layers, format_of(path), exposure, writer.stream, path, error);
    if (status == CA_OK) return ca_file_commit_durably(&writer, error);
    ca_file_abandon(&writer);
    return status;
}

/* A picture without layers: its colours as R, G and B, and A where it has alpha. */
static ca_status layers_from_image(const ca_image *image, ca_image_layers **layers, ca_error *error)
{
    static const char *const names[4] = {"R", "G", "B", "A"};
    CA_TRY(ca_layers_create(layers, image->width, image->height, error));
    const bool has_alpha = image->channels == 2 || image->channels == 4;
    const size_t pixels = (size_t)image->width * image->height;
    for (uint32_t c = 0; c < (has_alpha ? 4u : 3u); ++c) {
        float *plane;
        const ca_status status = ca_layers_add(*layers, names[c], &plane, error);
        if (status != CA_OK) {
            ca_layers_destroy(*layers);
            *layers = NULL;
            return status;
        }
        const uint32_t source = c == 3 ? image->channels - 1 : image->channels >= 3 ? c : 0;
        for (size_t i = 0; i < pixels; ++i) plane[i] = image->data[i * image->channels + source];
    }
    return CA_OK;
}

ca_status ca_layers_read(const char *path, ca_image_layers **layers, ca_error *error)
{
    *layers = NULL;
    ca_bytes bytes;
    CA_TRY(ca_file_read(path, "image", CA_IMAGE_MAX_FILE_BYTES, &bytes, error));
    ca_status status;
    if (ca_exr_is(&bytes)) {
        status = ca_exr_read_layers(path, &bytes, layers, error);
    } else {
        ca_image image;
        status = ca_image_decode(path, &bytes, CA_ENCODING_SRGB, &image, error);
        if (status == CA_OK) status = layers_from_image(&image, layers, error);
        ca_image_destroy(&image);
    }
    ca_bytes_destroy(&bytes);
    return status;
}
