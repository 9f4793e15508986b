#include "image/image.h"

#include "base/memory.h"

#include <assert.h>
#include <math.h>

ca_status ca_image_create(ca_image *image, uint32_t width, uint32_t height, uint32_t channels, ca_error *error)
{
    assert(channels >= 1 && channels <= 4);
    *image = (ca_image){.width = width, .height = height, .channels = channels};
    const size_t pixels = (size_t)width * height;
    if (pixels > CA_IMAGE_MAX_PIXELS) {
        *image = (ca_image){0};
        return ca_fail(error, CA_ERROR_UNSUPPORTED, NULL,
                       "an image of %u x %u pixels is over the limit of %zu pixels", width, height,
                       CA_IMAGE_MAX_PIXELS);
    }
    image->data = ca_alloc_zeroed(pixels, channels * sizeof *image->data);
    image->owners = ca_alloc(1, sizeof *image->owners);
    if (image->owners) atomic_init(image->owners, 1);
    if (image->data && image->owners) return CA_OK;
    ca_image_destroy(image);
    return ca_fail_memory(error, "image");
}

void ca_image_destroy(ca_image *image)
{
    if (!image->owners || atomic_fetch_sub(image->owners, 1) == 1) {
        ca_free(image->data);
        ca_free(image->owners);
    }
    *image = (ca_image){0};
}

ca_image ca_image_share(const ca_image *image)
{
    assert(image->owners);
    atomic_fetch_add(image->owners, 1);
    return *image;
}

/* IEC 61966-2-1: a short straight piece, then a power. */
float ca_srgb_to_linear(float encoded)
{
    return encoded <= 0.04045f ? encoded / 12.92f : powf((encoded + 0.055f) / 1.055f, 2.4f);
}

float ca_linear_to_srgb(float linear)
{
    return linear <= 0.0031308f ? 12.92f * linear : 1.055f * powf(linear, 1.0f / 2.4f) - 0.055f;
}
