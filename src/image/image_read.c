/* Reading a picture: tells the formats apart by their first bytes. */
#include "image/format.h"

#include "base/hash.h"
#include "base/loading.h"

#include <math.h>
#include <strings.h>

ca_status ca_image_check_size(const char *path, uint64_t width, uint64_t height, size_t file_bytes, ca_error *error)
{
    const ca_location where = {.file = path};
    if (width == 0 || height == 0) return ca_fail(error, CA_ERROR_FORMAT, &where, "the image has no pixels");
    if (width > CA_IMAGE_MAX_SIDE || height > CA_IMAGE_MAX_SIDE || width * height > CA_IMAGE_MAX_PIXELS)
        return ca_fail(error, CA_ERROR_FORMAT, &where,
                       "an image of %llu x %llu pixels is over the limit of %d on a side and %zu pixels in all",
                       (unsigned long long)width, (unsigned long long)height, CA_IMAGE_MAX_SIDE, CA_IMAGE_MAX_PIXELS);
    enum { MAX_PIXELS_PER_BYTE = 1032 * 8 };
    if (width * height / MAX_PIXELS_PER_BYTE > file_bytes)
        return ca_fail(error, CA_ERROR_FORMAT, &where, "an image of %llu x %llu pixels cannot come from %zu bytes",
                       (unsigned long long)width, (unsigned long long)height, file_bytes);
    return CA_OK;
}

ca_status ca_image_fail_truncated(const char *path, const char *format, size_t file_bytes, ca_error *error)
{
    return ca_fail(error, CA_ERROR_FORMAT, NULL, "%s: the %s file ends too early, after %zu bytes", path, format,
                   file_bytes);
}

void ca_srgb_table(ca_image_encoding encoding, float decode[256])
{
    for (int i = 0; i < 256; ++i) {
        const float value = (float)i / 255.0f;
        decode[i] = encoding == CA_ENCODING_SRGB ? ca_srgb_to_linear(value) : value;
    }
}

ca_status ca_image_decode(const char *path, const ca_bytes *bytes, ca_image_encoding encoding, ca_image *image,
                          ca_error *error)
{
    *image = (ca_image){0};
    if (ca_png_is(bytes)) return ca_png_read(path, bytes, encoding, image, error);
    if (ca_jpeg_is(bytes)) return ca_jpeg_read(path, bytes, encoding, image, error);
    if (ca_exr_is(bytes)) return ca_exr_read_image(path, bytes, image, error);
    if (ca_hdr_is(bytes)) return ca_hdr_read(path, bytes, image, error);
    if (ca_pfm_is(bytes)) return ca_pfm_read(path, bytes, image, error);
    if (ca_pnm_is(bytes)) return ca_pnm_read(path, bytes, encoding, image, error);
    if (ca_bmp_is(bytes)) return ca_bmp_read(path, bytes, encoding, image, error);
    if (ca_webp_is(bytes)) return ca_webp_read(path, bytes, encoding, image, error);
    if (strcasecmp(ca_path_extension(path), ".tga") == 0) return ca_tga_read(path, bytes, encoding, image, error);
    return ca_fail(error, CA_ERROR_FORMAT, NULL,
                   "%s: not an image of a known format (PNG, JPEG, EXR, HDR, TGA, BMP, PNM, PFM, WebP)", path);
}

ca_status ca_image_read(const char *path, ca_image_encoding encoding, ca_image *image, ca_error *error)
{
    *image = (ca_image){0};
    ca_bytes bytes;
    CA_TRY(ca_file_read(path, "image", CA_IMAGE_MAX_FILE_BYTES, &bytes, error));
    ca_status status = ca_image_decode(path, &bytes, encoding, image, error);
    if (status == CA_OK) status = ca_loading_check(error);
    if (status == CA_OK) image->content_hash = ca_hash_bytes(CA_HASH_START, bytes.data, bytes.size);
    ca_bytes_destroy(&bytes);
    if (status != CA_OK) ca_image_destroy(image);
    return status;
}
