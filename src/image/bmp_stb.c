/* BMP through stb_image, of which nothing else is compiled. It takes missing bytes for zeros: whether all pixels are
 * there is looked up in the header first. */
#include "image/format.h"

#include <string.h>

#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_ONLY_BMP
#define STBI_NO_STDIO
#define STBI_NO_LINEAR
#define STBI_NO_HDR
#define STBI_MAX_DIMENSIONS                  CA_IMAGE_MAX_SIDE
#define STBI_MALLOC(bytes)                   ca_alloc((bytes), 1)
#define STBI_FREE(memory)                    ca_free(memory)
#define STBI_REALLOC_SIZED(memory, old, new) NULL /* other formats' */
#pragma GCC diagnostic ignored "-Wunused-function" /* the other formats', to the end of the file */
#include <stb_image.h>

enum { FILE_HEADER = 14, OLD_HEADER = 12, MIN_BYTES = FILE_HEADER + OLD_HEADER };

bool ca_bmp_is(const ca_bytes *bytes)
{
    return bytes->size >= MIN_BYTES && bytes->data[0] == 'B' && bytes->data[1] == 'M';
}

static uint64_t number_at(const ca_bytes *bytes, size_t position, size_t size)
{
    uint64_t value = 0;
    for (size_t i = 0; i < size && position + i < bytes->size; ++i)
        value |= (uint64_t)bytes->data[position + i] << (8 * i);
    return value;
}

/* Where the last row ends: rows are padded to four bytes. */
static uint64_t end_of_pixels(const ca_bytes *bytes, uint64_t width, uint64_t height)
{
    const bool old = number_at(bytes, FILE_HEADER, 4) == OLD_HEADER;
    const uint64_t bits = number_at(bytes, old ? 24 : 28, 2);
    return number_at(bytes, 10, 4) + (width * bits + 31) / 32 * 4 * height;
}

static ca_status fail_library(const char *path, ca_error *error)
{
    if (strcmp(stbi_failure_reason(), "outofmem") == 0) return ca_fail_memory(error, path);
    return ca_fail(error, CA_ERROR_FORMAT, NULL, "%s: not a BMP image that is read: %s", path, stbi_failure_reason());
}

static ca_status check(const char *path, const ca_bytes *bytes, ca_error *error)
{
    int width, height, channels;
    if (bytes->size > INT32_MAX)
        return ca_fail(error, CA_ERROR_FORMAT, NULL, "%s: a BMP file of more than 2 GiB", path);
    if (!stbi_info_from_memory(bytes->data, (int)bytes->size, &width, &height, &channels))
        return fail_library(path, error);
    const uint64_t columns = (uint64_t)width, rows = height < 0 ? 0 - (uint64_t)height : (uint64_t)height;
    CA_TRY(ca_image_check_size(path, columns, rows, bytes->size, error));
    if (end_of_pixels(bytes, columns, rows) > bytes->size)
        return ca_image_fail_truncated(path, "BMP", bytes->size, error);
    return CA_OK;
}

static ca_status convert(const unsigned char *samples, int width, int height, int channels,
                         ca_image_encoding encoding, ca_image *image, ca_error *error)
{
    CA_TRY(ca_image_create(image, (uint32_t)width, (uint32_t)height, (uint32_t)channels, error));
    float table[256];
    ca_srgb_table(encoding, table);
    const size_t count = (size_t)width * (size_t)height * (size_t)channels;
    for (size_t i = 0; i < count; ++i)
        image->data[i] = channels == 4 && i % 4 == 3 ? (float)samples[i] / 255.0f : table[samples[i]];
    return CA_OK;
}

ca_status ca_bmp_read(const char *path, const ca_bytes *bytes, ca_image_encoding encoding, ca_image *image,
                      ca_error *error)
{
    *image = (ca_image){0};
    CA_TRY(check(path, bytes, error));
    int width, height, channels;
    unsigned char *samples =
        stbi_load_from_memory(bytes->data, (int)bytes->size, &width, &height, &channels, 0);
    if (!samples) return fail_library(path, error);
    const ca_status status = convert(samples, width, height, channels, encoding, image, error);
    ca_free(samples);
    return status;
}
