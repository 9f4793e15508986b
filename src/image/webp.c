/* WebP through libwebp: one picture of 8 bit RGB, with or without alpha; no animations. */
#include "image/format.h"

#include <string.h>
#include <webp/decode.h>

bool ca_webp_is(const ca_bytes *bytes)
{
    return bytes->size >= 12 && memcmp(bytes->data, "RIFF", 4) == 0 && memcmp(bytes->data + 8, "WEBP", 4) == 0;
}

/* Pixels. */
enum { SMALL_PICTURE = 1 << 24 };

static ca_status fail_damaged(const char *path, ca_error *error)
{
    return ca_fail(error, CA_ERROR_FORMAT, NULL, "%s: damaged or truncated WebP file", path);
}

static ca_status check(const char *path, const ca_bytes *bytes, WebPBitstreamFeatures *features, ca_error *error)
{
    if (WebPGetFeatures(bytes->data, bytes->size, features) != VP8_STATUS_OK) return fail_damaged(path, error);
    if (features->has_animation)
        return ca_fail(error, CA_ERROR_UNSUPPORTED, NULL, "%s: moving WebP pictures are not read", path);
    /* Pixels of one colour take nearly no bytes: only where they take much memory must there be some. */
    const uint64_t width = (uint64_t)features->width, height = (uint64_t)features->height;
    const bool is_small = width * height <= SMALL_PICTURE;
    return ca_image_check_size(path, width, height, is_small ? SMALL_PICTURE : bytes->size, error);
}

static void convert(const unsigned char *samples, ca_image_encoding encoding, ca_image *image)
{
    const uint32_t channels = image->channels;
    float table[256];
    ca_srgb_table(encoding, table);
    const size_t count = (size_t)image->width * image->height * channels;
    for (size_t i = 0; i < count; i++)
        image->data[i] = channels == 4 && i % 4 == 3 ? (float)samples[i] / 255.0f : table[samples[i]];
}

ca_status ca_webp_read(const char *path, const ca_bytes *bytes, ca_image_encoding encoding, ca_image *image,
                       ca_error *error)
{
    *image = (ca_image){0};
    WebPBitstreamFeatures features;
    CA_TRY(check(path, bytes, &features, error));
    const uint32_t width = (uint32_t)features.width, height = (uint32_t)features.height;
    const uint32_t channels = features.has_alpha ? 4 : 3;
    const size_t row = (size_t)width * channels, size = row * height;
    unsigned char *samples = ca_alloc(size, 1);
    if (!samples) return ca_fail_memory(error, path);
    const bool decoded = (channels == 4 ? WebPDecodeRGBAInto : WebPDecodeRGBInto)(bytes->data, bytes->size, samples,
                                                                                  size, (int)row) != NULL;
    ca_status status = decoded ? ca_image_create(image, width, height, channels, error) : fail_damaged(path, error);
    if (status == CA_OK) convert(samples, encoding, image);
    ca_free(samples);
    return status;
}
