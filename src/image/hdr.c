/* Radiance HDR (RGBE): a text header, then per pixel three mantissas and one exponent, as they are or run-length
 * encoded by line and component.
 *
 * EXPOSURE and COLORCORR lines are left unapplied, as in other renderers: values are what the file stores.
 * Source: G. Ward, "Real Pixels", Graphics Gems II (1991), for the encoding. */
#include "base/loading.h"
#include "image/format.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

bool ca_hdr_is(const ca_bytes *bytes)
{
    return bytes->size >= 7 && (memcmp(bytes->data, "#?RADIANCE", bytes->size < 10 ? bytes->size : 10) == 0 ||
                                memcmp(bytes->data, "#?RGBE", 6) == 0);
}

typedef struct hdr_input {
    const char *path;
    const ca_bytes *bytes;
    size_t position;
    uint32_t width, height;
    bool bottom_up;
} hdr_input;

/* The next line of the header without its end, cut to `size`; false at the end of the file. */
static bool next_line(hdr_input *input, char *line, size_t size)
{
    const unsigned char *start = input->bytes->data + input->position;
    const size_t left = input->bytes->size - input->position;
    const unsigned char *end = memchr(start, '\n', left);
    if (!end) return false;
    const size_t length = (size_t)(end - start) < size - 1 ? (size_t)(end - start) : size - 1;
    memcpy(line, start, length);
    line[length] = '\0';
    line[strcspn(line, "\r")] = '\0';
    input->position += (size_t)(end - start) + 1;
    return true;
}

static bool parse_size(const char **text, const char *axis, uint32_t *value)
{
    const size_t length = strlen(axis);
    if (strncmp(*text, axis, length) != 0) return false;
    *text += length;
    if (**text < '0' || **text > '9') return false;
    uint64_t number = 0;
    for (; **text >= '0' && **text <= '9'; ++*text)
        if (number <= CA_IMAGE_MAX_SIDE) number = 10 * number + (uint64_t)(**text - '0');
    *value = (uint32_t)number;
    return true;
}

static ca_status read_header(hdr_input *input, ca_error *error)
{
    const ca_location where = {.file = input->path};
    char line[256];
    do {
        if (!next_line(input, line, sizeof line))
            return ca_image_fail_truncated(input->path, "HDR", input->bytes->size, error);
        if (strncmp(line, "FORMAT=", 7) == 0 && strcmp(line, "FORMAT=32-bit_rle_rgbe") != 0)
            return ca_fail(error, CA_ERROR_UNSUPPORTED, &where, "HDR files of %s are not read, only 32-bit_rle_rgbe",
                           line);
    } while (line[0] != '\0');
    if (!next_line(input, line, sizeof line))
        return ca_image_fail_truncated(input->path, "HDR", input->bytes->size, error);
    const char *text = line;
    input->bottom_up = line[0] == '+';
    if (!parse_size(&text, input->bottom_up ? "+Y " : "-Y ", &input->height) ||
        !parse_size(&text, " +X ", &input->width))
        return ca_fail(error, CA_ERROR_UNSUPPORTED, &where,
                       "expected the HDR resolution as \"-Y height +X width\", not \"%s\"", line);
    return ca_image_check_size(input->path, input->width, input->height, input->bytes->size, error);
}

/* One component of a line: counts up to 128 are that many bytes, above they repeat the next byte count - 128
 * times. */
static bool read_runs(hdr_input *input, unsigned char *component)
{
    const unsigned char *data = input->bytes->data;
    for (uint32_t x = 0; x < input->width;) {
        if (input->position >= input->bytes->size) return false;
        const bool repeats = data[input->position] > 128;
        const uint32_t count = repeats ? data[input->position] - 128u : data[input->position];
        const size_t stored = repeats ? 1 : count;
        input->position++;
        if (count == 0 || count > input->width - x || stored > input->bytes->size - input->position) return false;
        for (uint32_t i = 0; i < count; ++i, ++x)
            component[4 * (size_t)x] = data[input->position + (repeats ? 0 : i)];
        input->position += stored;
    }
    return true;
}

/* One line of RGBE pixels. A line in runs starts with 2, 2 and its length; the older form, where a pixel of 1, 1, 1
 * repeats the one before, has no such mark. */
static bool read_line(hdr_input *input, unsigned char *line)
{
    const unsigned char *start = input->bytes->data + input->position;
    const size_t left = input->bytes->size - input->position;
    if (left >= 4 && input->width >= 8 && input->width < 32768 && start[0] == 2 && start[1] == 2 &&
        (uint32_t)(start[2] << 8 | start[3]) == input->width) {
        input->position += 4;
        for (int c = 0; c < 4; ++c)
            if (!read_runs(input, line + c)) return false;
        return true;
    }
    unsigned shift = 0; /* repetitions in a row count as digits in base 256 */
    for (size_t x = 0; x < input->width;) {
        if (input->bytes->size - input->position < 4) return false;
        const unsigned char *pixel = input->bytes->data + input->position;
        input->position += 4;
        if (pixel[0] == 1 && pixel[1] == 1 && pixel[2] == 1) {
            const size_t count = shift < 32 ? (size_t)pixel[3] << shift : SIZE_MAX;
            if (x == 0 || count > input->width - x) return false;
            for (size_t i = 0; i < count; ++i, ++x) memcpy(line + 4 * x, line + 4 * (x - 1), 4);
            shift += 8;
        } else {
            memcpy(line + 4 * x++, pixel, 4);
            shift = 0;
        }
    }
    return true;
}

/* Mantissas count in 1/256 of 2^(exponent - 128). */
static void decode_pixel(const unsigned char rgbe[4], float rgb[3])
{
    const float scale = rgbe[3] ? ldexpf(1.0f, rgbe[3] - (128 + 8)) : 0.0f;
    for (int c = 0; c < 3; ++c) rgb[c] = (float)rgbe[c] * scale;
}

ca_status ca_hdr_read(const char *path, const ca_bytes *bytes, ca_image *image, ca_error *error)
{
    *image = (ca_image){0};
    hdr_input input = {.path = path, .bytes = bytes};
    CA_TRY(read_header(&input, error));
    unsigned char *line = ca_alloc(input.width, 4);
    if (!line) return ca_fail_memory(error, path);
    ca_status status = ca_image_create(image, input.width, input.height, 3, error);
    for (uint32_t y = 0; status == CA_OK && y < input.height; ++y) {
        if (!read_line(&input, line)) {
            status =
                ca_fail(error, CA_ERROR_FORMAT, NULL,
                        "%s: the HDR file is damaged or ends too early: line %u, byte %zu", path, y, input.position);
            break;
        }
        float *row = image->data + (size_t)(input.bottom_up ? input.height - 1 - y : y) * input.width * 3;
        for (size_t x = 0; x < input.width; ++x) decode_pixel(line + 4 * x, row + 3 * x);
        status = ca_loading_check(error);
    }
    ca_free(line);
    if (status != CA_OK) ca_image_destroy(image);
    return status;
}
