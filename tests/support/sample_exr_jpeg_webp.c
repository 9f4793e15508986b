/* The samples that need a library to be made: JPEG, WebP, and every compression and layout of EXR. */
#include "support/sample_files.h"

#include <openexr.h>
#include <stdlib.h>
#include <string.h>
#include <turbojpeg.h>
#include <webp/encode.h>

sample_bytes sample_jpeg(bool grey, bool progressive)
{
    unsigned char pixels[SAMPLE_HEIGHT * SAMPLE_WIDTH * 3];
    const unsigned channels = grey ? 1 : 3;
    for (unsigned y = 0; y < SAMPLE_HEIGHT; ++y)
        for (unsigned x = 0; x < SAMPLE_WIDTH; ++x)
            for (unsigned c = 0; c < channels; ++c) /* smooth, so that little is lost */
                pixels[(y * SAMPLE_WIDTH + x) * channels + c] = (unsigned char)(40 + 10 * x + 8 * y + 20 * c);
    tjhandle encoder = tjInitCompress();
    unsigned char *data = NULL;
    unsigned long size = 0;
    const int flags = progressive ? TJFLAG_PROGRESSIVE : 0;
    if (!encoder || tjCompress2(encoder, pixels, SAMPLE_WIDTH, 0, SAMPLE_HEIGHT, grey ? TJPF_GRAY : TJPF_RGB, &data,
                                &size, grey ? TJSAMP_GRAY : TJSAMP_444, 98, flags) != 0)
        abort();
    sample_bytes jpeg = {0};
    sample_append(&jpeg, data, size);
    tjFree(data);
    tjDestroy(encoder);
    return jpeg;
}

sample_bytes sample_webp(bool alpha, bool lossy)
{
    unsigned char pixels[SAMPLE_HEIGHT * SAMPLE_WIDTH * 4];
    const unsigned channels = alpha ? 4 : 3;
    for (unsigned y = 0; y < SAMPLE_HEIGHT; ++y)
        for (unsigned x = 0; x < SAMPLE_WIDTH; ++x)
            for (unsigned c = 0; c < channels; ++c)
                pixels[(y * SAMPLE_WIDTH + x) * channels + c] =
                    lossy ? (unsigned char)(40 + 10 * x + 8 * y + 20 * c) : (unsigned char)sample_code(x, y, c);
    const int row = SAMPLE_WIDTH * (int)channels;
    uint8_t *data = NULL;
    size_t size = lossy   ? WebPEncodeRGB(pixels, SAMPLE_WIDTH, SAMPLE_HEIGHT, row, 100.0f, &data)
                  : alpha ? WebPEncodeLosslessRGBA(pixels, SAMPLE_WIDTH, SAMPLE_HEIGHT, row, &data)
                          : WebPEncodeLosslessRGB(pixels, SAMPLE_WIDTH, SAMPLE_HEIGHT, row, &data);
    sample_bytes webp = {0};
    sample_append(&webp, data, size);
    WebPFree(data);
    return webp;
}

sample_bytes sample_flat_webp(int side)
{
    sample_bytes pixels = {0}, webp = {0};
    uint8_t *data = NULL;
    for (int i = 0; i < side * side; i++) sample_append(&pixels, "\x80\x80\xff", 3);
    const size_t size = WebPEncodeLosslessRGB((const uint8_t *)pixels.data, side, side, 3 * side, &data);
    sample_append(&webp, data, size);
    WebPFree(data);
    sample_free(&pixels);
    return webp;
}

static void check(exr_result_t result)
{
    if (result != EXR_ERR_SUCCESS) abort();
}

static int64_t write_bytes(exr_const_context_t context, void *user, const void *buffer, uint64_t size,
                           uint64_t offset, exr_stream_error_func_ptr_t fail)
{
    (void)context;
    (void)fail;
    sample_bytes *file = user;
    static const unsigned char zeros[64];
    while (file->size < offset + size) {
        const size_t missing = (size_t)(offset + size) - file->size;
        sample_append(file, zeros, missing < sizeof zeros ? missing : sizeof zeros);
    }
    memcpy(file->data + offset, buffer, (size_t)size);
    return (int64_t)size;
}

/* The chunk at (x, y), `from` being the planes of the whole image. */
static void encode_chunk(exr_context_t file, const exr_chunk_info_t *chunk, const float *planes, unsigned x,
                         unsigned y)
{
    static const char order[] = "RGBA";
    exr_encode_pipeline_t encoder = EXR_ENCODE_PIPELINE_INITIALIZER;
    check(exr_encoding_initialize(file, 0, chunk, &encoder));
    for (int c = 0; c < encoder.channel_count; ++c) {
        const char *found = strchr(order, encoder.channels[c].channel_name[0]);
        const size_t plane = found ? (size_t)(found - order) : 0;
        encoder.channels[c].user_bytes_per_element = 4;
        encoder.channels[c].user_data_type = EXR_PIXEL_FLOAT;
        encoder.channels[c].user_pixel_stride = 4;
        encoder.channels[c].user_line_stride = SAMPLE_WIDTH * 4;
        encoder.channels[c].encode_from_ptr =
            (const uint8_t *)(planes + (plane * SAMPLE_HEIGHT + y) * SAMPLE_WIDTH + x);
    }
    check(exr_encoding_choose_default_routines(file, 0, &encoder));
    check(exr_encoding_run(file, 0, &encoder));
    check(exr_encoding_destroy(file, &encoder));
}

static void encode_all(exr_context_t file, bool tiled, int tile, const float *planes)
{
    int32_t lines = 0;
    exr_chunk_info_t chunk;
    if (!tiled) {
        check(exr_get_scanlines_per_chunk(file, 0, &lines));
        for (int y = 0; y < SAMPLE_HEIGHT; y += lines) {
            check(exr_write_scanline_chunk_info(file, 0, y, &chunk));
            encode_chunk(file, &chunk, planes, 0, (unsigned)y);
        }
        return;
    }
    for (int y = 0; y * tile < SAMPLE_HEIGHT; ++y)
        for (int x = 0; x * tile < SAMPLE_WIDTH; ++x) {
            check(exr_write_tile_chunk_info(file, 0, x, y, 0, 0, &chunk));
            encode_chunk(file, &chunk, planes, (unsigned)(x * tile), (unsigned)(y * tile));
        }
}

/* Levels of half the size, down to a pixel. */
static void encode_smaller(exr_context_t file, int tile)
{
    static const float black[4 * SAMPLE_HEIGHT * SAMPLE_WIDTH];
    for (int level = 1; SAMPLE_WIDTH >> level > 0; ++level) {
        const int width = SAMPLE_WIDTH >> level, height = SAMPLE_HEIGHT >> level ? SAMPLE_HEIGHT >> level : 1;
        for (int y = 0; y * tile < height; ++y)
            for (int x = 0; x * tile < width; ++x) {
                exr_chunk_info_t chunk;
                check(exr_write_tile_chunk_info(file, 0, x, y, level, level, &chunk));
                encode_chunk(file, &chunk, black, 0, 0);
            }
    }
}

sample_bytes sample_exr(int compression, int tiles, bool grey)
{
    const bool tiled = tiles > 0;
    float planes[4 * SAMPLE_HEIGHT * SAMPLE_WIDTH];
    for (unsigned c = 0; c < 4; ++c)
        for (unsigned y = 0; y < SAMPLE_HEIGHT; ++y)
            for (unsigned x = 0; x < SAMPLE_WIDTH; ++x)
                planes[(c * SAMPLE_HEIGHT + y) * SAMPLE_WIDTH + x] = (float)sample_code(x, y, c) / 64.0f;
    /* The library pads the 4 x 4 blocks of B44 in tiles at the edge to more bytes than it reads back: one tile for
     * all. */
    const int tile = compression >= EXR_COMPRESSION_B44 ? 16 : 4;
    sample_bytes bytes = {0};
    exr_context_initializer_t settings = EXR_DEFAULT_CONTEXT_INITIALIZER;
    settings.user_data = &bytes;
    settings.write_fn = write_bytes;
    exr_context_t file;
    int part;
    check(exr_start_write(&file, "sample.exr", EXR_WRITE_FILE_DIRECTLY, &settings));
    check(exr_add_part(file, NULL, tiled ? EXR_STORAGE_TILED : EXR_STORAGE_SCANLINE, &part));
    check(
        exr_initialize_required_attr_simple(file, part, SAMPLE_WIDTH, SAMPLE_HEIGHT, (exr_compression_t)compression));
    if (tiled)
        check(exr_set_tile_descriptor(file, part, (uint32_t)tile, (uint32_t)tile,
                                      tiles == 2 ? EXR_TILE_MIPMAP_LEVELS : EXR_TILE_ONE_LEVEL, EXR_TILE_ROUND_DOWN));
    static const char *const names[4] = {"R", "G", "B", "A"};
    for (int c = 0; c < (grey ? 1 : 4); ++c)
        check(exr_add_channel(file, part, grey ? "Y" : names[c], grey ? EXR_PIXEL_FLOAT : EXR_PIXEL_HALF,
                              EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1));
    check(exr_attr_set_string(file, part, "comments", "made by a test"));
    check(exr_write_header(file));
    encode_all(file, tiled, tile, planes);
    if (tiles == 2) encode_smaller(file, tile);
    check(exr_finish(&file));
    return bytes;
}
