/* JPEG through libturbojpeg: grey or colour, 8 bit. */
#include "image/format.h"

#include <turbojpeg.h>

bool ca_jpeg_is(const ca_bytes *bytes)
{
    return bytes->size >= 3 && bytes->data[0] == 0xff && bytes->data[1] == 0xd8 && bytes->data[2] == 0xff;
}

static ca_status fail_library(tjhandle decoder, const char *path, ca_error *error)
{
    return ca_fail(error, CA_ERROR_FORMAT, NULL, "%s: damaged or truncated JPEG file: %s", path,
                   tjGetErrorStr2(decoder));
}

/* Even a warning of the library means missing or wrong pixels, and ends the reading. The number of progressive scans
 * is limited: each may cost a pass over the whole image for a few bytes of file. */
static ca_status decode(tjhandle decoder, const char *path, const ca_bytes *bytes, ca_image_encoding encoding,
                        ca_image *image, ca_error *error)
{
    int width = 0, height = 0, subsampling = 0, colour_space = 0;
    if (tjDecompressHeader3(decoder, bytes->data, bytes->size, &width, &height, &subsampling, &colour_space) != 0)
        return fail_library(decoder, path, error);
    if (colour_space == TJCS_CMYK || colour_space == TJCS_YCCK)
        return ca_fail(error, CA_ERROR_UNSUPPORTED, NULL, "%s: JPEG files in printing colours (CMYK) are not read",
                       path);
    CA_TRY(ca_image_check_size(path, width > 0 ? (uint64_t)width : 0, height > 0 ? (uint64_t)height : 0, bytes->size,
                               error));
    const bool grey = colour_space == TJCS_GRAY;
    const uint32_t channels = grey ? 1 : 3;
    const size_t count = (size_t)width * (size_t)height * channels;
    unsigned char *samples = ca_alloc(count, 1);
    if (!samples) return ca_fail_memory(error, path);
    ca_status status = CA_OK;
    if (tjDecompress2(decoder, bytes->data, bytes->size, samples, width, 0, height, grey ? TJPF_GRAY : TJPF_RGB,
                      TJFLAG_ACCURATEDCT | TJFLAG_STOPONWARNING | TJFLAG_LIMITSCANS) != 0)
        status = fail_library(decoder, path, error);
    if (status == CA_OK) status = ca_image_create(image, (uint32_t)width, (uint32_t)height, channels, error);
    if (status == CA_OK) {
        float table[256];
        ca_srgb_table(encoding, table);
        for (size_t i = 0; i < count; ++i) image->data[i] = table[samples[i]];
    }
    ca_free(samples);
    return status;
}

ca_status ca_jpeg_read(const char *path, const ca_bytes *bytes, ca_image_encoding encoding, ca_image *image,
                       ca_error *error)
{
    *image = (ca_image){0};
    tjhandle decoder = tjInitDecompress();
    if (!decoder) return ca_fail_memory(error, path);
    const ca_status status = decode(decoder, path, bytes, encoding, image, error);
    tjDestroy(decoder);
    return status;
}
