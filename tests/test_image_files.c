/* Readers of images: the values of hand-made files of every format, and every way a file can be wrong. */
#include "image/image.h"
#include "image/layers.h"
#include "support/sample_files.h"
#include "support/sample_folder.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* Reads the bytes under that name and lets go of them. */
static ca_image read_sample(const char *name, sample_bytes bytes, ca_image_encoding encoding, uint32_t channels)
{
    ca_image image;
    ca_error error = {{0}};
    sample_write(path_to(name), bytes.data, bytes.size);
    sample_free(&bytes);
    if (ca_image_read(path_to(name), encoding, &image, &error) != CA_OK) fail_msg("%s", error.message);
    assert_int_equal(image.width, SAMPLE_WIDTH);
    assert_int_equal(image.height, SAMPLE_HEIGHT);
    assert_int_equal(image.channels, channels);
    return image;
}

/* What a pixel ought to be, from its place and channel (3: alpha). */
typedef double expected_value(unsigned x, unsigned y, unsigned c);

static void check_values(ca_image image, expected_value *expected, double tolerance)
{
    const bool has_alpha = image.channels == 2 || image.channels == 4;
    const float *value = image.data;
    for (unsigned y = 0; y < image.height; ++y)
        for (unsigned x = 0; x < image.width; ++x)
            for (unsigned c = 0; c < image.channels; ++c, ++value) {
                const double wanted = expected(x, y, has_alpha && c + 1 == image.channels ? 3 : c);
                if (!(fabs((double)*value - wanted) <= tolerance))
                    fail_msg("channel %u of pixel %u, %u is %.9g, not %.9g", c, x, y, (double)*value, wanted);
            }
    ca_image_destroy(&image);
}

static double coded(unsigned x, unsigned y, unsigned c) { return sample_code(x, y, c) / 255.0; }

/* IEC 61966-2-1 once more, in double. */
static double decoded(double value) { return value <= 0.04045 ? value / 12.92 : pow((value + 0.055) / 1.055, 2.4); }

static double coded_srgb(unsigned x, unsigned y, unsigned c)
{
    return c == 3 ? coded(x, y, c) : decoded(coded(x, y, c));
}

/* ---- values ---------------------------------------------------------------------------------------------------- */

static void png_values(void **unused)
{
    (void)unused;
    for (unsigned depth = 8; depth <= 16; depth += 8)
        for (unsigned channels = 1; channels <= 4; ++channels)
            for (int interlaced = 0; interlaced < 2; ++interlaced) {
                sample_bytes png = sample_png(depth, channels, interlaced);
                check_values(read_sample("a.png", png, CA_ENCODING_SRGB, channels), coded_srgb, 1e-6);
                png = sample_png(depth, channels, interlaced);
                check_values(read_sample("a.png", png, CA_ENCODING_RAW, channels), coded, 1e-7);
            }
}

static double palette_colour(unsigned x, unsigned y, unsigned c)
{
    const unsigned i = (x + y) % 16;
    const unsigned entry[4] = {16 * i, 255 - 16 * i, 7 * i, i ? 255 : 0};
    return entry[c] / 255.0;
}

static void png_palette(void **unused)
{
    (void)unused;
    check_values(read_sample("a.png", sample_png_palette(), CA_ENCODING_RAW, 4), palette_colour, 1e-7);
}

static double jpeg_colour(unsigned x, unsigned y, unsigned c) { return (40 + 10 * x + 8 * y + 20 * c) / 255.0; }

static void jpeg_values(void **unused)
{
    (void)unused;
    for (int progressive = 0; progressive < 2; ++progressive) {
        check_values(read_sample("a.jpg", sample_jpeg(false, progressive), CA_ENCODING_RAW, 3), jpeg_colour,
                     4 / 255.0);
        check_values(read_sample("a.jpg", sample_jpeg(true, progressive), CA_ENCODING_RAW, 1), jpeg_colour,
                     4 / 255.0);
    }
}

/* libwebp keeps the colours of pixels without alpha 0 only. */
static double webp_colour(unsigned x, unsigned y, unsigned c) { return coded(x, y, 3) == 0.0 ? 0.0 : coded(x, y, c); }

static double webp_srgb(unsigned x, unsigned y, unsigned c)
{
    return c == 3 ? webp_colour(x, y, c) : decoded(webp_colour(x, y, c));
}

static void webp_values(void **unused)
{
    (void)unused;
    check_values(read_sample("a.webp", sample_webp(false, false), CA_ENCODING_RAW, 3), coded, 1e-7);
    check_values(read_sample("a.any", sample_webp(false, false), CA_ENCODING_SRGB, 3), coded_srgb, 1e-6);
    check_values(read_sample("a.webp", sample_webp(true, false), CA_ENCODING_RAW, 4), webp_colour, 1e-7);
    check_values(read_sample("a.webp", sample_webp(true, false), CA_ENCODING_SRGB, 4), webp_srgb, 1e-6);
    check_values(read_sample("a.webp", sample_webp(false, true), CA_ENCODING_RAW, 3), jpeg_colour, 8 / 255.0);
}

static double coded_grey(unsigned x, unsigned y, unsigned c) { return coded(x, y, 0 * c); }
static double packed_colour(unsigned x, unsigned y, unsigned c) { return coded(x == 1 ? 0 : x, y, c); }
static double first_row(unsigned x, unsigned y, unsigned c) { return coded(x, 0 * y, c); }
static double first_row_packed(unsigned x, unsigned y, unsigned c) { return packed_colour(x, 0 * y, c); }

static void tga_values(void **unused)
{
    (void)unused;
    for (int top_down = 0; top_down < 2; ++top_down)
        for (int packed = 0; packed < 2; ++packed) {
            expected_value *expected = packed ? packed_colour : coded;
            check_values(read_sample("a.tga", sample_tga(2, 24, packed, top_down), CA_ENCODING_RAW, 3), expected,
                         1e-7);
            check_values(read_sample("a.TGA", sample_tga(2, 32, packed, top_down), CA_ENCODING_RAW, 4), expected,
                         1e-7);
            check_values(read_sample("a.tga", sample_tga(3, 8, packed, top_down), CA_ENCODING_RAW, 1), expected,
                         1e-7);
            check_values(read_sample("a.tga", sample_tga(1, 8, packed, top_down), CA_ENCODING_RAW, 3),
                         packed ? first_row_packed : first_row, 1e-7);
        }
    check_values(read_sample("a.tga", sample_tga(2, 24, false, true), CA_ENCODING_SRGB, 3), coded_srgb, 1e-6);
}

/* Bottom up by default, top down with a negative height; a byte a pixel has a palette of the codes themselves. */
static void bmp_values(void **unused)
{
    (void)unused;
    for (int top_down = 0; top_down < 2; ++top_down) {
        check_values(read_sample("a.bmp", sample_bmp(24, top_down), CA_ENCODING_RAW, 3), coded, 1e-7);
        check_values(read_sample("a.any", sample_bmp(32, top_down), CA_ENCODING_RAW, 4), coded, 1e-7);
        check_values(read_sample("a.bmp", sample_bmp(8, top_down), CA_ENCODING_RAW, 3), coded_grey, 1e-7);
    }
    check_values(read_sample("a.bmp", sample_bmp(24, false), CA_ENCODING_SRGB, 3), coded_srgb, 1e-6);
}

static void pnm_values(void **unused)
{
    (void)unused;
    for (unsigned channels = 1; channels <= 3; channels += 2)
        for (int text = 0; text < 2; ++text) {
            check_values(read_sample("a.ppm", sample_pnm(channels, 255, text), CA_ENCODING_RAW, channels), coded,
                         1e-7);
            check_values(read_sample("a", sample_pnm(channels, 51000, text), CA_ENCODING_RAW, channels), coded, 1e-5);
            check_values(read_sample("a", sample_pnm(channels, 255, text), CA_ENCODING_SRGB, channels), coded_srgb,
                         1e-6);
        }
}

static double hdr_colour(unsigned x, unsigned y, unsigned c)
{
    return ldexp(sample_code(x, y, c), (int)(x % 3) - 8);
}

static void hdr_values(void **unused)
{
    (void)unused;
    check_values(read_sample("a.hdr", sample_hdr(false), CA_ENCODING_SRGB, 3), hdr_colour, 0.0);
    check_values(read_sample("a.hdr", sample_hdr(true), CA_ENCODING_SRGB, 3), hdr_colour, 0.0);
}

static double pfm_colour(unsigned x, unsigned y, unsigned c) { return 2.0 * sample_code(x, y, c) / 64.0; }

static void pfm_values(void **unused)
{
    (void)unused;
    for (int big_endian = 0; big_endian < 2; ++big_endian) {
        check_values(read_sample("a.pfm", sample_pfm(true, big_endian), CA_ENCODING_SRGB, 3), pfm_colour, 0.0);
        check_values(read_sample("a.pfm", sample_pfm(false, big_endian), CA_ENCODING_SRGB, 1), pfm_colour, 0.0);
    }
}

static double exr_colour(unsigned x, unsigned y, unsigned c) { return sample_code(x, y, c) / 64.0; }

static void exr_values(void **unused)
{
    (void)unused;
    enum { COMPRESSIONS = 8, B44 = 6 }; /* up to B44A; from B44 on, blocks of halves share their exponents */
    for (int compression = 0; compression < COMPRESSIONS; ++compression)
        for (int tiles = 0; tiles < 3; ++tiles) {
            const double tolerance = compression >= B44 ? 0.25 : 0.0;
            if (tiles == 2 && compression >= B44) continue; /* the library cannot write its blocks at the edge */
            check_values(read_sample("a.exr", sample_exr(compression, tiles, false), CA_ENCODING_SRGB, 4), exr_colour,
                         tolerance);
            check_values(read_sample("a.exr", sample_exr(compression, tiles, true), CA_ENCODING_SRGB, 1), exr_colour,
                         0.0);
        }
}

/* The extension of all formats but TGA is only a name. */
static void formats_are_told_apart_by_content(void **unused)
{
    (void)unused;
    check_values(read_sample("a.exr", sample_png(8, 3, false), CA_ENCODING_RAW, 3), coded, 1e-7);
    check_values(read_sample("a.png", sample_pfm(true, false), CA_ENCODING_RAW, 3), pfm_colour, 0.0);
    check_values(read_sample("a.tga", sample_hdr(true), CA_ENCODING_RAW, 3), hdr_colour, 0.0);
}

static void layers_of_every_format(void **unused)
{
    (void)unused;
    sample_bytes bytes = sample_png(8, 2, false);
    sample_write(path_to("l.png"), bytes.data, bytes.size);
    sample_free(&bytes);
    ca_image_layers *layers;
    ca_error error = {{0}};
    if (ca_layers_read(path_to("l.png"), &layers, &error) != CA_OK) fail_msg("%s", error.message);
    const float *blue = ca_layers_find(layers, "B"), *alpha = ca_layers_find(layers, "A");
    assert_true(blue && alpha && layers->channel_count == 4);
    assert_float_equal(blue[SAMPLE_WIDTH + 2], (float)coded_srgb(2, 1, 0), 1e-6f); /* grey in all three */
    assert_float_equal(alpha[SAMPLE_WIDTH + 2], (float)coded(2, 1, 3), 1e-6f);
    ca_layers_destroy(layers);

    bytes = sample_exr(3, true, true);
    sample_write(path_to("l.exr"), bytes.data, bytes.size);
    sample_free(&bytes);
    if (ca_layers_read(path_to("l.exr"), &layers, &error) != CA_OK) fail_msg("%s", error.message);
    const float *grey = ca_layers_find(layers, "Y");
    assert_true(grey && layers->channel_count == 1 && !layers->channels[0].half);
    assert_float_equal(grey[2 * SAMPLE_WIDTH + 8], (float)exr_colour(8, 2, 0), 0.0f);
    bool commented = false;
    for (size_t i = 0; i < layers->attribute_count; ++i)
        commented |= strcmp(layers->attributes[i].name, "comments") == 0 &&
                     strcmp(layers->attributes[i].text, "made by a test") == 0;
    assert_true(commented);
    ca_layers_destroy(layers);
}

/* ---- what is refused ------------------------------------------------------------------------------------------- */

static void assert_refused(const char *name, const void *data, size_t size, const char *part)
{
    ca_image image;
    ca_error error = {{0}};
    sample_write(path_to(name), data, size);
    assert_int_not_equal(ca_image_read(path_to(name), CA_ENCODING_SRGB, &image, &error), CA_OK);
    assert_null(image.data);
    if (strncmp(error.message, path_to(name), strlen(path_to(name))) != 0 || !strstr(error.message, part))
        fail_msg("\"%s\" does not say \"%s\"", error.message, part);
    ca_image_layers *layers;
    assert_int_not_equal(ca_layers_read(path_to(name), &layers, &error), CA_OK);
    assert_null(layers);
}

static void assert_refused_text(const char *name, const char *text, const char *part)
{
    assert_refused(name, text, strlen(text), part);
}

static void refused_with_a_reason(void **unused)
{
    (void)unused;
    assert_refused_text("e.png", "", "not an image of a known format");
    assert_refused_text("e.png", "GIF89a",
                        "not an image of a known format (PNG, JPEG, EXR, HDR, TGA, BMP, PNM, PFM, WebP)");
    assert_refused_text("e.pfm", "PF\n2 2.5\n-1\n", "expected a PFM header");
    assert_refused_text("e.pfm", "PF\n2 2\n0\n", "expected a PFM header");
    assert_refused_text("e.pfm", "PF\n0 2\n-1\n", "the image has no pixels");
    assert_refused_text("e.ppm", "P6\n2 2\n0\n", "expected a PNM header");
    assert_refused_text("e.ppm", "P5\n2 2\n65536\n", "expected a PNM header");
    assert_refused_text("e.ppm", "P6 # colours\n2 2 255\n0123456789", "ends too early");
    assert_refused_text("e.ppm", "P2 2 2 10 1 2 3", "ends too early");
    assert_refused_text("e.ppm", "P2 2 2 10 1 2 3 11", "over its largest value, 10");
    assert_refused_text("e.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\nabcd", "only 32-bit_rle_rgbe");
    assert_refused_text("e.hdr", "#?RADIANCE\n\n+X 1 +Y 1\nabcd", "expected the HDR resolution");
    assert_refused_text("e.hdr", "#?RADIANCE\n\n-Y 1 +X 1\n\1\1\1\1", "line 0"); /* nothing before to repeat */
    assert_refused_text("e.hdr", "#?RADIANCE\n\n-Y 1 +X 8\n\2\2\1\1", "line 0");
    sample_bytes tga = sample_tga(1, 8, false, true);
    tga.data[tga.size - 1] = SAMPLE_WIDTH; /* one past the palette */
    assert_refused("e.tga", tga.data, tga.size, "outside of the palette");
    sample_bytes bmp = sample_bmp(24, false);
    assert_refused("e.bmp", bmp.data, bmp.size - 1, "the BMP file ends too early");
    bmp.data[30] = 1; /* packed in runs */
    assert_refused("e.bmp", bmp.data, bmp.size, "not a BMP image that is read");
    sample_free(&bmp);
    sample_bytes webp = sample_webp(false, false);
    assert_refused("e.webp", webp.data, webp.size - 3, "damaged or truncated WebP file");
    sample_free(&webp);
    static const char moving[] = "RIFF\x16\0\0\0WEBPVP8X\x0a\0\0\0\2\0\0\0\7\0\0\7\0\0";
    assert_refused("e.webp", moving, sizeof moving - 1, "moving WebP pictures are not read");
    tga.data[2] = 4;
    assert_refused("e.tga", tga.data, tga.size, "expected image type");
    sample_free(&tga);
    ca_image image;
    ca_error error;
    assert_int_equal(ca_image_read("/nowhere/a.png", CA_ENCODING_SRGB, &image, &error), CA_ERROR_FILE);
    assert_string_equal(error.message, "/nowhere/a.png: cannot open this image: No such file or directory");
}

static size_t find(const sample_bytes *bytes, const char *what, size_t length)
{
    for (size_t i = 0; i + length <= bytes->size; ++i)
        if (memcmp(bytes->data + i, what, length) == 0) return i;
    fail_msg("the sample has no such header");
    return 0;
}

/* Counts that no such small file can hold, and sides over the limit, are refused before memory is asked for. */
static void huge_headers_are_refused(void **unused)
{
    (void)unused;
    assert_refused_text("h.pfm", "PF\n60000 4000\n-1.0\n1234", "cannot come from");
    assert_refused_text("h.pfm", "PF\n70000 1\n-1.0\n1234", "over the limit");
    assert_refused_text("h.pfm", "PF\n1e300 1e300\n-1.0\n1234", "over the limit");
    assert_refused_text("h.ppm", "P6 60000 4000 255 1234", "cannot come from");
    assert_refused_text("h.ppm", "P6 70000 1 255 1234", "over the limit");
    sample_bytes bmp = sample_bmp(24, false);
    memcpy(bmp.data + 18, (unsigned char[8]){0, 0x40, 0, 0, 0, 0x40, 0, 0}, 8);
    assert_refused("h.bmp", bmp.data, bmp.size, "cannot come from");
    sample_free(&bmp);
    assert_refused_text("h.hdr", "#?RADIANCE\n\n-Y 99999999999999999999 +X 1\n1234", "over the limit");
    assert_refused_text("h.hdr", "#?RADIANCE\n\n-Y 65536 +X 4096\n1234", "cannot come from");
    sample_bytes bytes = sample_tga(2, 24, true, true);
    memset(bytes.data + 12, 0xff, 4);
    assert_refused("h.tga", bytes.data, bytes.size, "over the limit");
    sample_free(&bytes);

    bytes = sample_png(8, 3, false);
    sample_bytes png = {0}, header = {0};
    sample_big_endian(&header, 16384, 4);
    sample_big_endian(&header, 16384, 4);
    sample_append(&header, bytes.data + 24, 5);
    sample_append(&png, bytes.data, 8);
    sample_png_chunk(&png, "IHDR", header.data, header.size);
    sample_append(&png, bytes.data + 33, bytes.size - 33);
    assert_refused("h.png", png.data, png.size, "cannot come from");
    sample_free(&bytes);
    sample_free(&header);
    sample_free(&png);

    bytes = sample_jpeg(false, false);
    memcpy(bytes.data + find(&bytes, "\xff\xc0", 2) + 5, "\x40\x00\x40\x00", 4); /* behind length and precision */
    assert_refused("h.jpg", bytes.data, bytes.size, "cannot come from");
    sample_free(&bytes);

    bytes = sample_flat_webp(1024); /* which may come from so few */
    ca_image image;
    sample_write(path_to("flat.webp"), bytes.data, bytes.size);
    sample_free(&bytes);
    assert_int_equal(ca_image_read(path_to("flat.webp"), CA_ENCODING_RAW, &image, NULL), CA_OK);
    assert_true(image.width == 1024 && image.height == 1024);
    ca_image_destroy(&image);

    static const char wide[] = "RIFF\x16\0\0\0WEBPVP8X\x0a\0\0\0\0\0\0\0\xff\x3f\0\xff\x3f\0";
    assert_refused("h.webp", wide, sizeof wide - 1, "cannot come from");

    for (int tiled = 0; tiled < 2; ++tiled) {
        bytes = sample_exr(3, tiled, false);
        const size_t window = find(&bytes, "dataWindow\0box2i", 16) + 17 + 4;
        memcpy(bytes.data + window + 8, "\xff\x3f\0\0\xff\x3f\0\0", 8); /* xMax, yMax = 16383 */
        assert_refused("h.exr", bytes.data, bytes.size, "");
        memcpy(bytes.data + window + 8, "\xff\xff\xff\x7f\xff\xff\xff\x7f", 8);
        assert_refused("h.exr", bytes.data, bytes.size, "");
        sample_free(&bytes);
    }
}

/* Cut at every byte: refused, with a message that names the file. */
static void truncated_files_are_refused(void **unused)
{
    (void)unused;
    sample_file *files;
    const size_t count = sample_files_make(&files);
    for (size_t i = 0; i < count; ++i) {
        if (files[i].is_mesh) continue;
        for (size_t size = 0; size < files[i].bytes.size; ++size) {
            ca_error error = {{0}};
            const char *path = path_to(files[i].name);
            sample_write(path, files[i].bytes.data, size);
            if (sample_read(path, false, &error) == CA_OK)
                fail_msg("%s was read from %zu of %zu bytes", files[i].name, size, files[i].bytes.size);
            assert_non_null(strstr(error.message, path));
        }
    }
    sample_files_free(files, count);
}

static void every_allocation_may_fail(void **unused)
{
    (void)unused;
    check_sample_allocations(false, 5);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(png_values),
        cmocka_unit_test(png_palette),
        cmocka_unit_test(jpeg_values),
        cmocka_unit_test(webp_values),
        cmocka_unit_test(tga_values),
        cmocka_unit_test(bmp_values),
        cmocka_unit_test(pnm_values),
        cmocka_unit_test(hdr_values),
        cmocka_unit_test(pfm_values),
        cmocka_unit_test(exr_values),
        cmocka_unit_test(formats_are_told_apart_by_content),
        cmocka_unit_test(layers_of_every_format),
        cmocka_unit_test(refused_with_a_reason),
        cmocka_unit_test(huge_headers_are_refused),
        cmocka_unit_test(truncated_files_are_refused),
        cmocka_unit_test(every_allocation_may_fail),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
