/* PFM, the portable float map: "PF" (colour) or "Pf" (grey), width, height, scale, then rows of floats from the
 * bottom up. A negative scale means little endian; its size multiplies the values. */
#include "image/format.h"

#include "base/loading.h"
#include "base/text.h"

#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <string.h>

bool ca_pfm_is(const ca_bytes *bytes)
{
    return bytes->size >= 3 && bytes->data[0] == 'P' && (bytes->data[1] == 'F' || bytes->data[1] == 'f') &&
           isspace(bytes->data[2]);
}

/* The next word of the header as a number, and the one white space behind it. */
static bool next_number(const ca_bytes *bytes, size_t *position, double *value)
{
    char word[64];
    size_t length = 0, at = *position;
    while (at < bytes->size && isspace(bytes->data[at])) at++;
    while (at < bytes->size && !isspace(bytes->data[at]) && length + 1 < sizeof word)
        word[length++] = (char)bytes->data[at++];
    word[length] = '\0';
    if (at == bytes->size || !isspace(bytes->data[at])) return false;
    *position = at + 1;
    return ca_parse_double(word, value);
}

static float load_float(const unsigned char *p, bool little_endian)
{
    const uint32_t bits = little_endian
                              ? (uint32_t)p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24
                              : (uint32_t)p[3] | (uint32_t)p[2] << 8 | (uint32_t)p[1] << 16 | (uint32_t)p[0] << 24;
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

ca_status ca_pfm_read(const char *path, const ca_bytes *bytes, ca_image *image, ca_error *error)
{
    *image = (ca_image){0};
    const uint32_t channels = bytes->data[1] == 'F' ? 3 : 1;
    double width, height, scale;
    size_t position = 2;
    if (!next_number(bytes, &position, &width) || !next_number(bytes, &position, &height) ||
        !next_number(bytes, &position, &scale) || scale == 0.0 || width != floor(width) || height != floor(height))
        return ca_fail(error, CA_ERROR_FORMAT, NULL, "%s: expected a PFM header: \"%s\", width, height and scale",
                       path, channels == 3 ? "PF" : "Pf");
    const bool fits = width >= 0.0 && height >= 0.0 && width < 4e9 && height < 4e9;
    CA_TRY(ca_image_check_size(path, fits ? (uint64_t)width : UINT32_MAX, fits ? (uint64_t)height : UINT32_MAX,
                               bytes->size, error));
    const size_t row = (size_t)width * channels, rows = (size_t)height;
    if ((bytes->size - position) / sizeof(float) < row * rows)
        return ca_image_fail_truncated(path, "PFM", bytes->size, error);
    CA_TRY(ca_image_create(image, (uint32_t)width, (uint32_t)height, channels, error));
    const float factor = (float)fabs(scale);
    for (size_t y = 0; y < rows; ++y) {
        const unsigned char *source = bytes->data + position + (rows - 1 - y) * row * sizeof(float);
        for (size_t i = 0; i < row; ++i) image->data[y * row + i] = factor * load_float(source + 4 * i, scale < 0.0);
    }
    return CA_OK;
}

ca_status ca_pfm_write(const float *const rgb[3], uint32_t width, uint32_t height, FILE *stream, const char *path,
                       ca_error *error)
{
    float *row = ca_alloc(width, 3 * sizeof *row);
    if (!row) return ca_fail_memory(error, path);
    errno = 0;
    bool good = fprintf(stream, "PF\n%u %u\n-1.0\n", width, height) > 0; /* this machine's order: little endian */
    for (size_t y = height; good && y-- > 0;) {
        if (ca_loading_check(NULL) != CA_OK) break;
        for (size_t x = 0; x < width; ++x)
            for (size_t c = 0; c < 3; ++c) row[3 * x + c] = rgb[c][y * width + x];
        good = fwrite(row, 3 * sizeof *row, width, stream) == width;
    }
    const int reason = errno ? errno : EIO;
    ca_free(row);
    CA_TRY(ca_loading_check(error));
    return good ? CA_OK : ca_fail(error, CA_ERROR_FILE, NULL, "%s: cannot write: %s", path, strerror(reason));
}
