/* OpenEXR input through the C core: the first part, scan lines or tiles, of which the largest level, every
 * compression the core has.
 *
 * The file is read from memory, so a truncated one is noticed by the offset alone. Sizes are checked before pixels
 * are allocated, and each chunk's place is checked again before the decoder is given pointers into them. */
#include "base/loading.h"
#include "image/format.h"

#include <assert.h>
#include <openexr.h>
#include <stdio.h>
#include <string.h>

static _Thread_local char first_message[512];
static _Thread_local bool memory_ran_out;

void *ca_exr_allocate(size_t bytes)
{
    void *memory = ca_alloc(bytes, 1);
    if (!memory) memory_ran_out = true;
    return memory;
}

void ca_exr_message_clear(void)
{
    first_message[0] = '\0';
    memory_ran_out = false;
}

const char *ca_exr_message(void) { return first_message; }

void ca_exr_keep_message(exr_const_context_t context, exr_result_t code, const char *message)
{
    (void)context;
    (void)code;
    if (!first_message[0]) snprintf(first_message, sizeof first_message, "%s", message);
}

bool ca_exr_is(const ca_bytes *bytes)
{
    static const unsigned char magic[4] = {0x76, 0x2f, 0x31, 0x01};
    return bytes->size >= sizeof magic && memcmp(bytes->data, magic, sizeof magic) == 0;
}

/* An open file and what its header says of the first part. */
typedef struct exr_input {
    const char *path;
    const ca_bytes *bytes;
    exr_context_t context;
    const exr_attr_chlist_t *channels;
    exr_attr_box2i_t data, display;
    uint32_t width, height; /* of the data window */
    bool tiled;
} exr_input;

/* Where a channel's pixels go: pixel (x, y) of the data window at data[y * width + x]. */
typedef struct exr_target {
    float *data;
} exr_target;

static int64_t read_bytes(exr_const_context_t context, void *user, void *buffer, uint64_t size, uint64_t offset,
                          exr_stream_error_func_ptr_t fail)
{
    const ca_bytes *bytes = ((const exr_input *)user)->bytes;
    if (offset > bytes->size) {
        fail(context, EXR_ERR_READ_IO, "the file ends before byte %llu", (unsigned long long)offset);
        return -1;
    }
    const uint64_t left = bytes->size - offset;
    const uint64_t count = size < left ? size : left;
    memcpy(buffer, bytes->data + offset, (size_t)count);
    return (int64_t)count;
}

static int64_t count_bytes(exr_const_context_t context, void *user)
{
    (void)context;
    return (int64_t)((const exr_input *)user)->bytes->size;
}

static ca_status fail_library(const exr_input *input, exr_result_t result, ca_error *error)
{
    if (memory_ran_out || result == EXR_ERR_OUT_OF_MEMORY) return ca_fail_memory(error, input->path);
    return ca_fail(error, CA_ERROR_FORMAT, NULL, "%s: damaged or truncated EXR file: %s", input->path,
                   ca_exr_message()[0] ? ca_exr_message() : exr_get_default_error_message(result));
}

static ca_status check_storage(exr_input *input, ca_error *error)
{
    exr_storage_t storage;
    exr_result_t result = exr_get_storage(input->context, 0, &storage);
    if (result != EXR_ERR_SUCCESS) return fail_library(input, result, error);
    if (storage != EXR_STORAGE_SCANLINE && storage != EXR_STORAGE_TILED)
        return ca_fail(error, CA_ERROR_UNSUPPORTED, NULL,
                       "%s: deep EXR files are not read; save it as a flat image", input->path);
    input->tiled = storage == EXR_STORAGE_TILED;
    return CA_OK;
}

static ca_status read_header(exr_input *input, ca_error *error)
{
    CA_TRY(check_storage(input, error));
    exr_result_t result = exr_get_channels(input->context, 0, &input->channels);
    if (result == EXR_ERR_SUCCESS) result = exr_get_data_window(input->context, 0, &input->data);
    if (result == EXR_ERR_SUCCESS) result = exr_get_display_window(input->context, 0, &input->display);
    if (result != EXR_ERR_SUCCESS) return fail_library(input, result, error);
    const int64_t width = (int64_t)input->data.max.x - input->data.min.x + 1;
    const int64_t height = (int64_t)input->data.max.y - input->data.min.y + 1;
    CA_TRY(ca_image_check_size(input->path, width > 0 ? (uint64_t)width : 0, height > 0 ? (uint64_t)height : 0,
                               input->bytes->size, error));
    input->width = (uint32_t)width;
    input->height = (uint32_t)height;
    if (input->channels->num_channels < 1)
        return ca_fail(error, CA_ERROR_FORMAT, NULL, "%s: the EXR file has no channels", input->path);
    for (int c = 0; c < input->channels->num_channels; ++c) {
        const exr_attr_chlist_entry_t *channel = &input->channels->entries[c];
        if (channel->x_sampling != 1 || channel->y_sampling != 1)
            return ca_fail(error, CA_ERROR_UNSUPPORTED, NULL,
                           "%s: the EXR channel \"%s\" has fewer pixels than the image; expected the same for all",
                           input->path, channel->name.str);
    }
    return CA_OK;
}

static ca_status open_input(exr_input *input, const char *path, const ca_bytes *bytes, ca_error *error)
{
    *input = (exr_input){.path = path, .bytes = bytes};
    exr_context_initializer_t settings = EXR_DEFAULT_CONTEXT_INITIALIZER;
    ca_exr_message_clear();
    settings.error_handler_fn = ca_exr_keep_message;
    settings.user_data = input;
    settings.read_fn = read_bytes;
    settings.size_fn = count_bytes;
    settings.alloc_fn = ca_exr_allocate;
    settings.free_fn = ca_free;
    settings.max_image_width = settings.max_image_height = CA_IMAGE_MAX_SIDE;
    settings.max_tile_width = settings.max_tile_height = CA_IMAGE_MAX_SIDE;
    settings.flags = EXR_CONTEXT_FLAG_DISABLE_CHUNK_RECONSTRUCTION;
    const exr_result_t result = exr_start_read(&input->context, path, &settings);
    if (result != EXR_ERR_SUCCESS) {
        input->context = NULL;
        return fail_library(input, result, error);
    }
    /* The core goes on without an attribute that found no memory. */
    if (memory_ran_out) return ca_fail_memory(error, path);
    return read_header(input, error);
}

static void close_input(exr_input *input)
{
    if (input->context) exr_finish(&input->context);
}

/* One chunk, a block of lines or a tile, with its upper left corner at (x, y) of the data window. */
static exr_result_t decode_chunk(const exr_input *input, const exr_chunk_info_t *chunk, uint32_t x, uint32_t y,
                                 const exr_target *targets, exr_decode_pipeline_t *decoder)
{
    const bool started = decoder->channels != NULL;
    if (ca_loading_check(NULL) != CA_OK) return EXR_ERR_UNKNOWN;
    exr_result_t result = started ? exr_decoding_update(input->context, 0, chunk, decoder)
                                  : exr_decoding_initialize(input->context, 0, chunk, decoder);
    if (result != EXR_ERR_SUCCESS) return result;
    if (chunk->width < 0 || chunk->height < 0 || x + (uint64_t)chunk->width > input->width ||
        y + (uint64_t)chunk->height > input->height || decoder->channel_count != input->channels->num_channels)
        return EXR_ERR_CORRUPT_CHUNK;
    for (int c = 0; c < decoder->channel_count; ++c) {
        exr_coding_channel_info_t *channel = &decoder->channels[c];
        channel->user_bytes_per_element = sizeof(float);
        channel->user_data_type = EXR_PIXEL_FLOAT;
        channel->user_pixel_stride = (int32_t)sizeof(float);
        channel->user_line_stride = (int32_t)(input->width * sizeof(float));
        channel->decode_to_ptr = (uint8_t *)(targets[c].data + (size_t)y * input->width + x);
    }
    if (!started) result = exr_decoding_choose_default_routines(input->context, 0, decoder);
    return result == EXR_ERR_SUCCESS ? exr_decoding_run(input->context, 0, decoder) : result;
}

static exr_result_t decode_lines(const exr_input *input, const exr_target *targets, exr_decode_pipeline_t *decoder)
{
    int32_t lines = 0;
    exr_result_t result = exr_get_scanlines_per_chunk(input->context, 0, &lines);
    if (result == EXR_ERR_SUCCESS && lines < 1) result = EXR_ERR_CORRUPT_CHUNK;
    for (uint32_t y = 0; result == EXR_ERR_SUCCESS && y < input->height; y += (uint32_t)lines) {
        exr_chunk_info_t chunk;
        result = exr_read_scanline_chunk_info(input->context, 0, input->data.min.y + (int)y, &chunk);
        if (result == EXR_ERR_SUCCESS) result = decode_chunk(input, &chunk, 0, y, targets, decoder);
    }
    return result;
}

static exr_result_t decode_tiles(const exr_input *input, const exr_target *targets, exr_decode_pipeline_t *decoder)
{
    int32_t tile_width = 0, tile_height = 0;
    exr_result_t result = exr_get_tile_sizes(input->context, 0, 0, 0, &tile_width, &tile_height);
    if (result == EXR_ERR_SUCCESS && (tile_width < 1 || tile_height < 1)) result = EXR_ERR_CORRUPT_CHUNK;
    for (uint32_t y = 0, row = 0; result == EXR_ERR_SUCCESS && y < input->height; y += (uint32_t)tile_height, ++row)
        for (uint32_t x = 0, column = 0; result == EXR_ERR_SUCCESS && x < input->width;
             x += (uint32_t)tile_width, ++column) {
            exr_chunk_info_t chunk;
            result = exr_read_tile_chunk_info(input->context, 0, (int)column, (int)row, 0, 0, &chunk);
            if (result == EXR_ERR_SUCCESS) result = decode_chunk(input, &chunk, x, y, targets, decoder);
        }
    return result;
}

/* targets[c] belongs to the c-th channel of the header. */
static ca_status decode_pixels(const exr_input *input, const exr_target *targets, ca_error *error)
{
    exr_decode_pipeline_t decoder = EXR_DECODE_PIPELINE_INITIALIZER;
    const exr_result_t result =
        input->tiled ? decode_tiles(input, targets, &decoder) : decode_lines(input, targets, &decoder);
    exr_decoding_destroy(input->context, &decoder);
    CA_TRY(ca_loading_check(error));
    return result == EXR_ERR_SUCCESS ? CA_OK : fail_library(input, result, error);
}

/* ---- a picture ------------------------------------------------------------------------------------------------- */

static int find_channel(const exr_input *input, const char *name)
{
    for (int c = 0; c < input->channels->num_channels; ++c)
        if (strcmp(input->channels->entries[c].name.str, name) == 0) return c;
    return -1;
}

/* Channel order[c] of the file becomes channel c of the image. By way of planes: told to interleave four channels of
 * halves itself, the library (3.1.5) gives them in the reverse order. All channels that are not read share one more
 * plane, for where all are halves, it writes even those without a place. */
static ca_status read_interleaved(const exr_input *input, const int *order, ca_image *image, ca_error *error)
{
    const size_t pixels = (size_t)input->width * input->height;
    const int channel_count = input->channels->num_channels;
    float *planes = ca_alloc(pixels * (image->channels + 1), sizeof *planes);
    exr_target *targets = ca_alloc((size_t)channel_count, sizeof *targets);
    ca_status status = planes && targets ? CA_OK : ca_fail_memory(error, input->path);
    for (int c = 0; status == CA_OK && c < channel_count; ++c) targets[c].data = planes + image->channels * pixels;
    for (uint32_t c = 0; status == CA_OK && c < image->channels; ++c) targets[order[c]].data = planes + c * pixels;
    if (status == CA_OK) status = decode_pixels(input, targets, error);
    for (uint32_t c = 0; status == CA_OK && c < image->channels; ++c)
        for (size_t i = 0; i < pixels; ++i) image->data[i * image->channels + c] = planes[c * pixels + i];
    ca_free(targets);
    ca_free(planes);
    return status;
}

static ca_status read_image(const exr_input *input, ca_image *image, ca_error *error)
{
    const int red = find_channel(input, "R"), green = find_channel(input, "G"), blue = find_channel(input, "B");
    const int grey = find_channel(input, "Y"), alpha = find_channel(input, "A");
    const bool coloured = red >= 0 && green >= 0 && blue >= 0;
    if (!coloured && grey < 0)
        return ca_fail(error, CA_ERROR_FORMAT, NULL, "%s: the EXR file has neither channels R, G, B nor a channel Y",
                       input->path);
    const uint32_t channels = (coloured ? 3u : 1u) + (alpha >= 0 ? 1u : 0u);
    const int order[4] = {coloured ? red : grey, coloured ? green : alpha, blue, alpha};
    CA_TRY(ca_image_create(image, input->width, input->height, channels, error));
    const ca_status status = read_interleaved(input, order, image, error);
    if (status != CA_OK) ca_image_destroy(image);
    return status;
}

ca_status ca_exr_read_image(const char *path, const ca_bytes *bytes, ca_image *image, ca_error *error)
{
    *image = (ca_image){0};
    exr_input input;
    ca_status status = open_input(&input, path, bytes, error);
    if (status == CA_OK) status = read_image(&input, image, error);
    close_input(&input);
    return status;
}

/* ---- layers ---------------------------------------------------------------------------------------------------- */

/* Text and numbers; the header's own, which every file has, are not repeated. */
static ca_status read_attribute(ca_image_layers *layers, const exr_attribute_t *attribute, ca_error *error)
{
    static const char *const own[] = {
        "name", "type", "version", "chunkCount", "pixelAspectRatio", "screenWindowWidth"};
    for (size_t i = 0; i < sizeof own / sizeof *own; ++i)
        if (strcmp(attribute->name, own[i]) == 0) return CA_OK;
    switch (attribute->type) {
    case EXR_ATTR_STRING: return ca_layers_set_text(layers, attribute->name, attribute->string->str, error);
    case EXR_ATTR_DOUBLE: return ca_layers_set_number(layers, attribute->name, attribute->d, error);
    case EXR_ATTR_FLOAT: return ca_layers_set_number(layers, attribute->name, (double)attribute->f, error);
    case EXR_ATTR_INT: return ca_layers_set_number(layers, attribute->name, (double)attribute->i, error);
    default: return CA_OK;
    }
}

static ca_status read_attributes(const exr_input *input, ca_image_layers *layers, ca_error *error)
{
    int32_t count = 0;
    exr_result_t result = exr_get_attribute_count(input->context, 0, &count);
    if (result != EXR_ERR_SUCCESS) return fail_library(input, result, error);
    for (int32_t i = 0; i < count; ++i) {
        const exr_attribute_t *attribute = NULL;
        result = exr_get_attribute_by_index(input->context, 0, EXR_ATTR_LIST_FILE_ORDER, i, &attribute);
        if (result != EXR_ERR_SUCCESS) return fail_library(input, result, error);
        CA_TRY(read_attribute(layers, attribute, error));
    }
    return CA_OK;
}

/* Memory for all channels together is held to what ca_image_check_size allows for four. */
static ca_status add_channels(const exr_input *input, ca_image_layers *layers, exr_target *targets, ca_error *error)
{
    enum { MAX_CHANNELS = 1024 };
    const int count = input->channels->num_channels;
    if (count > MAX_CHANNELS || (uint64_t)count * input->width * input->height > 4 * (uint64_t)CA_IMAGE_MAX_PIXELS)
        return ca_fail(error, CA_ERROR_FORMAT, NULL, "%s: %d channels of %u x %u pixels are over the limit",
                       input->path, count, input->width, input->height);
    for (int c = 0; c < count; ++c) {
        const exr_attr_chlist_entry_t *channel = &input->channels->entries[c];
        if (ca_layers_find(layers, channel->name.str))
            return ca_fail(error, CA_ERROR_FORMAT, NULL, "%s: the EXR file has two channels \"%s\"", input->path,
                           channel->name.str);
        CA_TRY(ca_layers_add(layers, channel->name.str, &targets[c].data, error));
        layers->channels[c].half = channel->pixel_type == EXR_PIXEL_HALF;
    }
    return CA_OK;
}

static ca_status read_layers(const exr_input *input, ca_image_layers *layers, ca_error *error)
{
    const int64_t full_width = (int64_t)input->display.max.x - input->display.min.x + 1;
    const int64_t full_height = (int64_t)input->display.max.y - input->display.min.y + 1;
    const int64_t x0 = (int64_t)input->data.min.x - input->display.min.x;
    const int64_t y0 = (int64_t)input->data.min.y - input->display.min.y;
    if (full_width < 1 || full_height < 1 || full_width > INT32_MAX || full_height > INT32_MAX || x0 != (int32_t)x0 ||
        y0 != (int32_t)y0)
        return ca_fail(error, CA_ERROR_FORMAT, NULL, "%s: the EXR file's display window is empty or too far off",
                       input->path);
    layers->full_width = (uint32_t)full_width;
    layers->full_height = (uint32_t)full_height;
    layers->x0 = (int32_t)x0;
    layers->y0 = (int32_t)y0;
    exr_target *targets = ca_alloc_zeroed((size_t)input->channels->num_channels, sizeof *targets);
    if (!targets) return ca_fail_memory(error, input->path);
    ca_status status = add_channels(input, layers, targets, error);
    if (status == CA_OK) status = decode_pixels(input, targets, error);
    ca_free(targets);
    return status == CA_OK ? read_attributes(input, layers, error) : status;
}

ca_status ca_exr_read_layers(const char *path, const ca_bytes *bytes, ca_image_layers **layers, ca_error *error)
{
    *layers = NULL;
    exr_input input;
    ca_status status = open_input(&input, path, bytes, error);
    if (status == CA_OK) status = ca_layers_create(layers, input.width, input.height, error);
    if (status == CA_OK) status = read_layers(&input, *layers, error);
    close_input(&input);
    if (status == CA_OK) return CA_OK;
    ca_layers_destroy(*layers);
    *layers = NULL;
    return status;
}
