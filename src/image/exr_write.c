#define _POSIX_C_SOURCE 200809L
/* OpenEXR output: one part of scan lines, ZIP compression (lossless, 16 lines a chunk), through the C core. */
#include "image/format.h"

#include "base/loading.h"

#include <errno.h>
#include <openexr.h>
#include <stdio.h>
#include <string.h>

/* What the library's callbacks see. */
typedef struct exr_output {
    FILE *stream;
    uint64_t position; /* of the stream */
    int write_errno;
} exr_output;

typedef exr_result_t (*exr_step)(exr_encode_pipeline_t *encoder);

static int64_t write_bytes(exr_const_context_t context, void *user, const void *buffer, uint64_t size,
                           uint64_t offset, exr_stream_error_func_ptr_t fail)
{
    exr_output *output = user;
    errno = 0;
    const bool placed = output->position == offset || fseeko(output->stream, (off_t)offset, SEEK_SET) == 0;
    if (!placed || fwrite(buffer, 1, (size_t)size, output->stream) != size) {
        output->write_errno = errno ? errno : EIO;
        fail(context, EXR_ERR_WRITE_IO, "cannot write");
        return -1;
    }
    output->position = offset + size;
    return (int64_t)size;
}

static exr_result_t add_attributes(exr_context_t context, int part, const ca_image_layers *layers)
{
    for (size_t i = 0; i < layers->attribute_count; ++i) {
        const ca_attribute *attribute = &layers->attributes[i];
        const exr_result_t result =
            attribute->text ? exr_attr_set_string(context, part, attribute->name, attribute->text)
                            : exr_attr_set_double(context, part, attribute->name, attribute->number);
        if (result != EXR_ERR_SUCCESS) return result;
    }
    return EXR_ERR_SUCCESS;
}

static exr_result_t add_channels(exr_context_t context, int part, const ca_image_layers *layers)
{
    for (size_t i = 0; i < layers->channel_count; ++i) {
        const ca_channel *channel = &layers->channels[i];
        const exr_result_t result =
            exr_add_channel(context, part, channel->name, channel->half ? EXR_PIXEL_HALF : EXR_PIXEL_FLOAT,
                            EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1);
        if (result != EXR_ERR_SUCCESS) return result;
    }
    return EXR_ERR_SUCCESS;
}

/* Names may be longer than the 31 bytes of old readers. */
static bool has_long_name(const ca_image_layers *layers)
{
    for (size_t i = 0; i < layers->channel_count; ++i)
        if (strlen(layers->channels[i].name) > 31) return true;
    for (size_t i = 0; i < layers->attribute_count; ++i)
        if (strlen(layers->attributes[i].name) > 31) return true;
    return false;
}

static exr_result_t write_header(exr_context_t context, int *part, const ca_image_layers *layers)
{
    const exr_attr_box2i_t display = {
        .max = {.x = (int32_t)layers->full_width - 1, .y = (int32_t)layers->full_height - 1}};
    const exr_attr_box2i_t data = {
        .min = {.x = layers->x0, .y = layers->y0},
        .max = {.x = layers->x0 + (int32_t)layers->width - 1, .y = layers->y0 + (int32_t)layers->height - 1}};
    const exr_attr_v2f_t center = {.x = 0.0f, .y = 0.0f};
    exr_result_t result = exr_set_longname_support(context, has_long_name(layers));
    if (result == EXR_ERR_SUCCESS) result = exr_add_part(context, NULL, EXR_STORAGE_SCANLINE, part);
    if (result == EXR_ERR_SUCCESS)
        result = exr_initialize_required_attr(context, *part, &display, &data, 1.0f, &center, 1.0f,
                                              EXR_LINEORDER_INCREASING_Y, EXR_COMPRESSION_ZIP);
    if (result == EXR_ERR_SUCCESS) result = add_channels(context, *part, layers);
    if (result == EXR_ERR_SUCCESS) result = add_attributes(context, *part, layers);
    if (result == EXR_ERR_SUCCESS) result = exr_write_header(context);
    return result;
}

/* The library keeps the channels sorted by name: each is matched by name, at the first line of the chunk. */
static void point_at_lines(exr_encode_pipeline_t *encoder, const ca_image_layers *layers, size_t first_line)
{
    for (int c = 0; c < encoder->channel_count; ++c) {
        exr_coding_channel_info_t *channel = &encoder->channels[c];
        const float *plane = ca_layers_find(layers, channel->channel_name);
        channel->user_bytes_per_element = sizeof(float);
        channel->user_data_type = EXR_PIXEL_FLOAT;
        channel->user_pixel_stride = sizeof(float);
        channel->user_line_stride = (int32_t)(layers->width * sizeof(float));
        channel->encode_from_ptr = (const uint8_t *)(plane + first_line * layers->width);
    }
}

/* The library's own step, which is the encoder's user data. A chunk as long as its pixels is read as the pixels
 * themselves, but the library leaves compressed bytes there that come to that length (OpenEXR issue 2306). */
static exr_result_t compress(exr_encode_pipeline_t *encoder)
{
    const exr_step *step = encoder->encoding_user_data;
    const exr_result_t result = (*step)(encoder);
    if (result == EXR_ERR_SUCCESS && encoder->compressed_bytes == encoder->packed_bytes)
        memcpy(encoder->compressed_buffer, encoder->packed_buffer, encoder->packed_bytes);
    return result;
}

static exr_result_t choose_steps(exr_context_t context, int part, exr_encode_pipeline_t *encoder, exr_step *step)
{
    const exr_result_t result = exr_encoding_choose_default_routines(context, part, encoder);
    *step = encoder->compress_fn;
    encoder->encoding_user_data = step;
    if (*step) encoder->compress_fn = compress;
    return result;
}

static exr_result_t write_chunks(exr_context_t context, int part, const ca_image_layers *layers)
{
    int32_t lines = 0;
    exr_result_t result = exr_get_scanlines_per_chunk(context, part, &lines);
    exr_encode_pipeline_t encoder = EXR_ENCODE_PIPELINE_INITIALIZER;
    exr_step step = NULL;
    bool started = false;
    for (size_t line = 0; result == EXR_ERR_SUCCESS && line < layers->height; line += (size_t)lines) {
        exr_chunk_info_t chunk = {0};
        result = ca_loading_check(NULL) == CA_OK ? EXR_ERR_SUCCESS : EXR_ERR_UNKNOWN;
        if (result != EXR_ERR_SUCCESS) break;
        result = exr_write_scanline_chunk_info(context, part, layers->y0 + (int)line, &chunk);
        if (result != EXR_ERR_SUCCESS) break;
        result = started ? exr_encoding_update(context, part, &chunk, &encoder)
                         : exr_encoding_initialize(context, part, &chunk, &encoder);
        if (result != EXR_ERR_SUCCESS) break;
        point_at_lines(&encoder, layers, line);
        if (!started) result = choose_steps(context, part, &encoder, &step);
        started = true;
        if (result == EXR_ERR_SUCCESS) result = exr_encoding_run(context, part, &encoder);
    }
    exr_encoding_destroy(context, &encoder);
    return result;
}

static ca_status fail_write(const exr_output *output, exr_result_t result, const char *path, ca_error *error)
{
    CA_TRY(ca_loading_check(error));
    if (output->write_errno)
        return ca_fail(error, CA_ERROR_FILE, NULL, "%s: cannot write: %s", path, strerror(output->write_errno));
    if (result == EXR_ERR_OUT_OF_MEMORY) return ca_fail_memory(error, path);
    return ca_fail(error, CA_ERROR_FILE, NULL, "%s: cannot write as EXR: %s", path,
                   ca_exr_message()[0] ? ca_exr_message() : exr_get_default_error_message(result));
}

ca_status ca_exr_write(const ca_image_layers *layers, FILE *stream, const char *path, ca_error *error)
{
    exr_output output = {.stream = stream};
    exr_context_initializer_t settings = EXR_DEFAULT_CONTEXT_INITIALIZER;
    ca_exr_message_clear();
    settings.error_handler_fn = ca_exr_keep_message;
    settings.user_data = &output;
    settings.write_fn = write_bytes;
    settings.alloc_fn = ca_exr_allocate;
    settings.free_fn = ca_free;
    exr_context_t context = NULL;
    int part = 0;
    exr_result_t result = exr_start_write(&context, path, EXR_WRITE_FILE_DIRECTLY, &settings);
    if (result == EXR_ERR_SUCCESS) result = write_header(context, &part, layers);
    if (result == EXR_ERR_SUCCESS) result = write_chunks(context, part, layers);
    if (context) {
        const exr_result_t finished = exr_finish(&context);
        if (result == EXR_ERR_SUCCESS) result = finished;
    }
    return result == EXR_ERR_SUCCESS ? CA_OK : fail_write(&output, result, path, error);
}
