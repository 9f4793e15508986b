/* PNG through libpng: every kind is read, 8 bit sRGB is written.
 *
 * libpng reports a failure by jumping back to the setjmp of the function that called it. Everything such a function
 * needs afterwards lives in a struct outside of it, so that no local variable is changed between setjmp and the
 * jump. */
#include "base/loading.h"
#include "image/format.h"

#include <errno.h>
#include <math.h>
#include <png.h>
#include <setjmp.h>
#include <stdio.h>
#include <string.h>

bool ca_png_is(const ca_bytes *bytes) { return bytes->size >= 8 && png_sig_cmp(bytes->data, 0, 8) == 0; }

static void ignore_warning(png_structp png, png_const_charp message)
{
    (void)png;
    (void)message;
}

/* The jump's destination and the message, at the head of both states below. */
static void keep_message(png_structp png, png_const_charp message)
{
    char *kept = png_get_error_ptr(png);
    snprintf(kept, 128, "%s", message);
    longjmp(png_jmpbuf(png), 1);
}

/* libpng reports a lack of memory like any other damage: the function that allocates for it notes the lack. */
static png_voidp allocate(png_structp png, png_alloc_size_t bytes)
{
    void *memory = ca_alloc(bytes, 1);
    if (!memory) *(bool *)png_get_mem_ptr(png) = true;
    return memory;
}

static void release(png_structp png, png_voidp memory)
{
    (void)png;
    ca_free(memory);
}

/* ---- reading --------------------------------------------------------------------------------------------------- */

typedef struct png_input {
    char message[128];
    const ca_bytes *bytes;
    size_t position;
    png_structp png;
    png_infop info;
    uint32_t width, height, channels, depth;
    unsigned char *samples; /* rows one after another, 8 or 16 (big endian) bits a sample */
    unsigned char **rows;
    ca_status status; /* of our own checks */
    bool out_of_memory;
} png_input;

static void read_bytes(png_structp png, png_bytep buffer, size_t size)
{
    png_input *input = png_get_io_ptr(png);
    if (ca_loading_check(NULL) != CA_OK) png_error(png, "not wanted any more");
    if (size > input->bytes->size - input->position) png_error(png, "the file ends too early");
    memcpy(buffer, input->bytes->data + input->position, size);
    input->position += size;
}

/* Palettes become colours, small greys become bytes, a transparent colour becomes alpha. */
static void expand_samples(png_input *input)
{
    png_set_expand(input->png);
    png_set_interlace_handling(input->png);
    png_read_update_info(input->png, input->info);
    input->channels = png_get_channels(input->png, input->info);
    input->depth = png_get_bit_depth(input->png, input->info);
}

static bool decode(png_input *input, const char *path, ca_error *error)
{
    if (setjmp(png_jmpbuf(input->png))) return false;
    png_set_read_fn(input->png, input, read_bytes);
    png_set_user_limits(input->png, CA_IMAGE_MAX_SIDE, CA_IMAGE_MAX_SIDE);
    png_set_chunk_cache_max(input->png, 256);
    png_read_info(input->png, input->info);
    input->width = png_get_image_width(input->png, input->info);
    input->height = png_get_image_height(input->png, input->info);
    input->status = ca_image_check_size(path, input->width, input->height, input->bytes->size, error);
    if (input->status != CA_OK) return true;
    expand_samples(input);
    const size_t row_bytes = png_get_rowbytes(input->png, input->info);
    input->samples = ca_alloc(input->height, row_bytes);
    input->rows = ca_alloc(input->height, sizeof *input->rows);
    if (!input->samples || !input->rows) {
        input->status = ca_fail_memory(error, path);
        return true;
    }
    for (size_t y = 0; y < input->height; ++y) input->rows[y] = input->samples + y * row_bytes;
    png_read_image(input->png, input->rows);
    png_read_end(input->png, NULL);
    return true;
}

static ca_status convert(const png_input *input, ca_image_encoding encoding, ca_image *image, ca_error *error)
{
    CA_TRY(ca_image_create(image, input->width, input->height, input->channels, error));
    float table[256];
    ca_srgb_table(encoding, table);
    const bool has_alpha = input->channels == 2 || input->channels == 4;
    const size_t count = (size_t)input->width * input->height * input->channels;
    for (size_t i = 0; i < count; ++i) {
        const bool alpha = has_alpha && i % input->channels == input->channels - 1;
        if (input->depth == 16) {
            const float value = (float)(256 * input->samples[2 * i] + input->samples[2 * i + 1]) / 65535.0f;
            image->data[i] = alpha || encoding == CA_ENCODING_RAW ? value : ca_srgb_to_linear(value);
        } else {
            image->data[i] = alpha ? (float)input->samples[i] / 255.0f : table[input->samples[i]];
        }
    }
    return CA_OK;
}

static ca_status fail_decoding(const png_input *input, const char *path, ca_error *error)
{
    CA_TRY(ca_loading_check(error));
    if (input->out_of_memory) return ca_fail_memory(error, path);
    return ca_fail(error, CA_ERROR_FORMAT, NULL, "%s: damaged or truncated PNG file: %s", path, input->message);
}

ca_status ca_png_read(const char *path, const ca_bytes *bytes, ca_image_encoding encoding, ca_image *image,
                      ca_error *error)
{
    *image = (ca_image){0};
    png_input input = {.bytes = bytes};
    input.png = png_create_read_struct_2(PNG_LIBPNG_VER_STRING, input.message, keep_message, ignore_warning,
                                         &input.out_of_memory, allocate, release);
    input.info = input.png ? png_create_info_struct(input.png) : NULL;
    if (!input.info)
        input.status = ca_fail_memory(error, path);
    else if (!decode(&input, path, error))
        input.status = fail_decoding(&input, path, error);
    png_destroy_read_struct(&input.png, &input.info, NULL);
    if (input.status == CA_OK) input.status = convert(&input, encoding, image, error);
    ca_free(input.rows);
    ca_free(input.samples);
    return input.status;
}

/* ---- writing --------------------------------------------------------------------------------------------------- */

typedef struct png_output {
    char message[128];
    FILE *stream;
    int write_errno;
    png_structp png;
    png_infop info;
    const float *const *rgb;
    uint32_t width, height;
    float scale; /* 2^exposure */
    unsigned char *row;
    bool out_of_memory;
} png_output;

static void write_bytes(png_structp png, png_bytep buffer, size_t size)
{
    png_output *output = png_get_io_ptr(png);
    if (fwrite(buffer, 1, size, output->stream) == size) return;
    output->write_errno = errno ? errno : EIO;
    png_error(png, "cannot write");
}

static void flush_nothing(png_structp png) { (void)png; }

/* Rounded to the nearest code; what is not a number is black. */
static unsigned char encode(float linear)
{
    if (!(linear > 0.0f)) return 0;
    return linear >= 1.0f ? 255 : (unsigned char)(ca_linear_to_srgb(linear) * 255.0f + 0.5f);
}

static bool encode_all(png_output *output)
{
    if (setjmp(png_jmpbuf(output->png))) return false;
    png_set_write_fn(output->png, output, write_bytes, flush_nothing);
    png_set_IHDR(output->png, output->info, output->width, output->height, 8, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_sRGB(output->png, output->info, PNG_sRGB_INTENT_PERCEPTUAL);
    png_write_info(output->png, output->info);
    for (size_t y = 0; y < output->height; ++y) {
        if (ca_loading_check(NULL) != CA_OK) return false;
        for (size_t x = 0; x < output->width; ++x)
            for (size_t c = 0; c < 3; ++c)
                output->row[3 * x + c] = encode(output->rgb[c][y * output->width + x] * output->scale);
        png_write_row(output->png, output->row);
    }
    png_write_end(output->png, NULL);
    return true;
}

static ca_status fail_write(const png_output *output, const char *path, ca_error *error)
{
    CA_TRY(ca_loading_check(error));
    if (output->out_of_memory) return ca_fail_memory(error, path);
    return ca_fail(error, CA_ERROR_FILE, NULL, "%s: cannot write as PNG: %s", path,
                   output->write_errno ? strerror(output->write_errno) : output->message);
}

ca_status ca_png_write(const float *const rgb[3], uint32_t width, uint32_t height, float exposure, FILE *stream,
                       const char *path, ca_error *error)
{
    png_output output = {.stream = stream, .rgb = rgb, .width = width, .height = height, .scale = exp2f(exposure)};
    ca_status status = CA_OK;
    output.row = ca_alloc(width, 3);
    output.png = png_create_write_struct_2(PNG_LIBPNG_VER_STRING, output.message, keep_message, ignore_warning,
                                           &output.out_of_memory, allocate, release);
    output.info = output.png ? png_create_info_struct(output.png) : NULL;
    if (!output.row || !output.info)
        status = ca_fail_memory(error, path);
    else if (!encode_all(&output))
        status = fail_write(&output, path, error);
    png_destroy_write_struct(&output.png, &output.info);
    ca_free(output.row);
    return status;
}
