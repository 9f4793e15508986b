/* TGA: grey, true colour or palette, plain or run-length encoded. The file has no mark of its own, so its header is
 * checked field by field. Source: Truevision, "TGA File Format Specification" version 2.0 (1991). */
#include "image/format.h"

#include <string.h>

enum { HEADER_BYTES = 18 };

typedef struct tga_input {
    const char *path;
    const ca_bytes *bytes;
    size_t position;
    uint32_t width, height;
    uint32_t pixel_bytes, pixel_bits; /* of a stored pixel */
    bool palette, grey, packed;
    uint32_t palette_first, palette_count, palette_bits;
    const unsigned char *palette_data;
    uint32_t alpha_bits;
    bool right_to_left, top_down;
    uint32_t channels; /* of the result */
} tga_input;

static uint32_t word(const unsigned char *p) { return (uint32_t)p[0] | (uint32_t)p[1] << 8; }

static ca_status fail_header(const tga_input *input, const char *what, ca_error *error)
{
    return ca_fail(error, CA_ERROR_FORMAT, NULL, "%s: not a TGA image that is read: %s", input->path, what);
}

static ca_status check_header(tga_input *input, const unsigned char *h, ca_error *error)
{
    const unsigned kind = h[2] & 7;
    if (h[1] > 1 || (h[2] & ~(8u | 3u)) || kind == 0)
        return fail_header(input, "expected image type 1, 2, 3, 9, 10 or 11", error);
    input->palette = kind == 1;
    input->grey = kind == 3;
    input->packed = h[2] & 8;
    input->palette_first = word(h + 3);
    input->palette_count = h[1] ? word(h + 5) : 0;
    input->palette_bits = h[7];
    input->width = word(h + 12);
    input->height = word(h + 14);
    input->pixel_bits = h[16];
    input->pixel_bytes = (input->pixel_bits + 7) / 8;
    input->alpha_bits = h[17] & 15;
    input->right_to_left = h[17] & 16;
    input->top_down = h[17] & 32;
    if (h[17] & 0xc0) return fail_header(input, "expected lines that are not interleaved", error);
    if (input->palette && (h[1] != 1 || input->pixel_bits != 8))
        return fail_header(input, "expected a palette of 8 bit indices", error);
    if (input->grey && input->pixel_bits != 8) return fail_header(input, "expected 8 bit grey", error);
    const uint32_t colour_bits = input->palette ? input->palette_bits : input->pixel_bits;
    if (!input->grey && colour_bits != 15 && colour_bits != 16 && colour_bits != 24 && colour_bits != 32)
        return fail_header(input, "expected colours of 15, 16, 24 or 32 bits", error);
    /* 32 bits whose header declares no alpha carry a byte without meaning. */
    input->channels = input->grey ? 1 : colour_bits == 32 && input->alpha_bits > 0 ? 4 : 3;
    return ca_image_check_size(input->path, input->width, input->height, input->bytes->size, error);
}

static ca_status read_header(tga_input *input, ca_error *error)
{
    const unsigned char *data = input->bytes->data;
    if (input->bytes->size < HEADER_BYTES)
        return ca_image_fail_truncated(input->path, "TGA", input->bytes->size, error);
    CA_TRY(check_header(input, data, error));
    const size_t palette_start = HEADER_BYTES + (size_t)data[0];
    const size_t palette_bytes = (size_t)input->palette_count * ((input->palette_bits + 7) / 8);
    input->position = palette_start + palette_bytes;
    if (input->position > input->bytes->size)
        return ca_image_fail_truncated(input->path, "TGA", input->bytes->size, error);
    input->palette_data = data + palette_start;
    return CA_OK;
}

/* A colour of 15 to 32 bits, blue first. */
static void decode_colour(const unsigned char *p, uint32_t bits, const float table[256], float *result,
                          uint32_t channels)
{
    if (bits <= 16) {
        const uint32_t v = word(p);
        for (uint32_t c = 0; c < 3; ++c) {
            const uint32_t five = v >> (10 - 5 * c) & 31;
            result[c] = table[(five * 255 + 15) / 31];
        }
        return;
    }
    for (uint32_t c = 0; c < 3; ++c) result[c] = table[p[2 - c]];
    if (channels == 4) result[3] = (float)p[3] / 255.0f;
}

/* false where a palette index is out of range. */
static bool decode_pixel(const tga_input *input, const unsigned char *p, const float table[256], float *result)
{
    if (input->grey) {
        result[0] = table[p[0]];
        return true;
    }
    if (!input->palette) {
        decode_colour(p, input->pixel_bits, table, result, input->channels);
        return true;
    }
    const uint32_t index = p[0] - input->palette_first;
    if (p[0] < input->palette_first || index >= input->palette_count) return false;
    const size_t entry_bytes = (input->palette_bits + 7) / 8;
    decode_colour(input->palette_data + index * entry_bytes, input->palette_bits, table, result, input->channels);
    return true;
}

static float *pixel_at(const tga_input *input, const ca_image *image, size_t i)
{
    const size_t x = i % input->width, y = i / input->width;
    const size_t column = input->right_to_left ? input->width - 1 - x : x;
    const size_t row = input->top_down ? y : input->height - 1 - y;
    return image->data + (row * input->width + column) * input->channels;
}

static ca_status read_pixels(tga_input *input, const float table[256], const ca_image *image, ca_error *error)
{
    const size_t count = (size_t)input->width * input->height, bytes = input->pixel_bytes;
    for (size_t i = 0; i < count;) {
        size_t run = 1;
        bool repeats = false;
        if (input->packed) { /* a packet: the run's length, and whether one pixel stands for all of it */
            if (input->position == input->bytes->size)
                return ca_image_fail_truncated(input->path, "TGA", input->bytes->size, error);
            const unsigned char packet = input->bytes->data[input->position++];
            run = (packet & 127) + 1u;
            repeats = packet & 128;
            if (run > count - i) return fail_header(input, "a run goes beyond the last pixel", error);
        }
        for (size_t k = 0; k < run; ++k, ++i) {
            if (input->bytes->size - input->position < bytes)
                return ca_image_fail_truncated(input->path, "TGA", input->bytes->size, error);
            if (!decode_pixel(input, input->bytes->data + input->position, table, pixel_at(input, image, i)))
                return fail_header(input, "a pixel's index is outside of the palette", error);
            if (!repeats || k + 1 == run) input->position += bytes;
        }
    }
    return CA_OK;
}

ca_status ca_tga_read(const char *path, const ca_bytes *bytes, ca_image_encoding encoding, ca_image *image,
                      ca_error *error)
{
    *image = (ca_image){0};
    tga_input input = {.path = path, .bytes = bytes};
    CA_TRY(read_header(&input, error));
    CA_TRY(ca_image_create(image, input.width, input.height, input.channels, error));
    float table[256];
    ca_srgb_table(encoding, table);
    const ca_status status = read_pixels(&input, table, image, error);
    if (status != CA_OK) ca_image_destroy(image);
    return status;
}
