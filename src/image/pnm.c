/* PNM, the portable any map: "P5" (grey) or "P6" (colour), or "P2" and "P3" for the same in text; width, height, the
 * largest value; then rows from the top down, of one byte a sample, or of two, the higher first, where the largest
 * value is over 255. A # begins a comment in the header. */
#include "image/format.h"

#include <ctype.h>

bool ca_pnm_is(const ca_bytes *bytes)
{
    const unsigned char *data = bytes->data;
    if (bytes->size < 3 || data[0] != 'P' || !(isspace(data[2]) || data[2] == '#')) return false;
    return data[1] == '2' || data[1] == '3' || data[1] == '5' || data[1] == '6';
}

typedef struct pnm_input {
    const char *path;
    const ca_bytes *bytes;
    size_t position;
    bool text;
    uint32_t channels;
    uint64_t width, height, largest;
} pnm_input;

/* The next number in text, behind white space and comments; false where there is none, or one of more than nine
 * digits. */
static bool next_number(pnm_input *input, uint64_t *value)
{
    const unsigned char *data = input->bytes->data;
    const size_t size = input->bytes->size;
    size_t at = input->position, digits = 0;
    while (at < size && (isspace(data[at]) || data[at] == '#')) {
        if (data[at] == '#')
            while (at < size && data[at] != '\n') at++;
        else
            at++;
    }
    *value = 0;
    for (; at < size && isdigit(data[at]) && digits <= 9; digits++) *value = 10 * *value + (data[at++] - '0');
    input->position = at;
    return digits > 0 && digits <= 9;
}

static ca_status read_header(pnm_input *input, ca_error *error)
{
    const unsigned char kind = input->bytes->data[1];
    input->text = kind == '2' || kind == '3';
    input->channels = kind == '3' || kind == '6' ? 3 : 1;
    input->position = 2;
    if (!next_number(input, &input->width) || !next_number(input, &input->height) ||
        !next_number(input, &input->largest) || input->largest < 1 || input->largest > 65535)
        return ca_fail(error, CA_ERROR_FORMAT, NULL,
                       "%s: expected a PNM header: \"P%c\", width, height and the largest value, 1 to 65535",
                       input->path, kind);
    CA_TRY(ca_image_check_size(input->path, input->width, input->height, input->bytes->size, error));
    input->position++; /* the one white space behind the header */
    const size_t samples = (size_t)(input->width * input->height) * input->channels;
    const size_t left = input->position < input->bytes->size ? input->bytes->size - input->position : 0;
    if (!input->text && left / (input->largest > 255 ? 2 : 1) < samples)
        return ca_image_fail_truncated(input->path, "PNM", input->bytes->size, error);
    return CA_OK;
}

/* false at the end of the file. */
static bool next_sample(pnm_input *input, uint64_t *value)
{
    if (input->text) return next_number(input, value);
    const unsigned char *p = input->bytes->data + input->position;
    const size_t size = input->largest > 255 ? 2 : 1;
    *value = size == 2 ? 256u * p[0] + p[1] : p[0];
    input->position += size;
    return true;
}

static ca_status read_samples(pnm_input *input, ca_image_encoding encoding, const ca_image *image, ca_error *error)
{
    const size_t count = (size_t)image->width * image->height * image->channels;
    for (size_t i = 0; i < count; ++i) {
        uint64_t sample;
        if (!next_sample(input, &sample))
            return ca_image_fail_truncated(input->path, "PNM", input->bytes->size, error);
        if (sample > input->largest)
            return ca_fail(error, CA_ERROR_FORMAT, NULL, "%s: a sample of the PNM file is over its largest value, %u",
                           input->path, (unsigned)input->largest);
        const float value = (float)sample / (float)input->largest;
        image->data[i] = encoding == CA_ENCODING_SRGB ? ca_srgb_to_linear(value) : value;
    }
    return CA_OK;
}

ca_status ca_pnm_read(const char *path, const ca_bytes *bytes, ca_image_encoding encoding, ca_image *image,
                      ca_error *error)
{
    *image = (ca_image){0};
    pnm_input input = {.path = path, .bytes = bytes};
    CA_TRY(read_header(&input, error));
    CA_TRY(ca_image_create(image, (uint32_t)input.width, (uint32_t)input.height, input.channels, error));
    const ca_status status = read_samples(&input, encoding, image, error);
    if (status != CA_OK) ca_image_destroy(image);
    return status;
}
