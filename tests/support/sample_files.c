#define _DEFAULT_SOURCE
#include "support/sample_files.h"

#include "image/image.h"
#include "image/layers.h"
#include "import/import.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

void sample_append(sample_bytes *bytes, const void *data, size_t size)
{
    if (bytes->size + size > bytes->capacity) {
        bytes->capacity = 2 * (bytes->size + size) + 256;
        bytes->data = realloc(bytes->data, bytes->capacity);
        if (!bytes->data) abort();
    }
    if (size) memcpy(bytes->data + bytes->size, data, size);
    bytes->size += size;
}

static void little_endian(sample_bytes *bytes, uint64_t value, size_t size)
{
    for (size_t i = 0; i < size; ++i) sample_u8(bytes, (unsigned)(value >> (8 * i)) & 255);
}

void sample_text(sample_bytes *bytes, const char *text) { sample_append(bytes, text, strlen(text)); }
void sample_u8(sample_bytes *bytes, unsigned value)
{
    sample_append(bytes, &(unsigned char){(unsigned char)value}, 1);
}
void sample_u16(sample_bytes *bytes, unsigned value) { little_endian(bytes, value, 2); }
void sample_u32(sample_bytes *bytes, uint32_t value) { little_endian(bytes, value, 4); }
void sample_u64(sample_bytes *bytes, uint64_t value) { little_endian(bytes, value, 8); }

void sample_f32(sample_bytes *bytes, float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    sample_u32(bytes, bits);
}

void sample_f64(sample_bytes *bytes, double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    sample_u64(bytes, bits);
}

void sample_big_endian(sample_bytes *bytes, uint64_t value, size_t size)
{
    for (size_t i = size; i-- > 0;) sample_u8(bytes, (unsigned)(value >> (8 * i)) & 255);
}

void sample_free(sample_bytes *bytes)
{
    free(bytes->data);
    *bytes = (sample_bytes){0};
}

/* RFC 1950 and 1951: a header, stored blocks of at most 65535 bytes, the Adler-32 checksum. */
void sample_zlib(sample_bytes *bytes, const sample_bytes *content)
{
    sample_u8(bytes, 0x78);
    sample_u8(bytes, 0x01);
    uint32_t a = 1, b = 0;
    for (size_t i = 0; i < content->size; ++i) {
        a = (a + content->data[i]) % 65521;
        b = (b + a) % 65521;
    }
    size_t done = 0;
    do {
        const size_t left = content->size - done, piece = left < 65535 ? left : 65535;
        sample_u8(bytes, piece == left);
        sample_u16(bytes, (unsigned)piece);
        sample_u16(bytes, (unsigned)piece ^ 0xffff);
        sample_append(bytes, content->data + done, piece);
        done += piece;
    } while (done < content->size);
    sample_big_endian(bytes, b << 16 | a, 4);
}

/* ---- images ---------------------------------------------------------------------------------------------------- */

unsigned sample_code(unsigned x, unsigned y, unsigned c)
{
    return c == 3 ? 255 - 20 * y : (17 * x + 40 * y + 60 * c + 3) % 256;
}

static uint32_t checksum(const unsigned char *data, size_t size)
{
    uint32_t crc = ~0u;
    for (size_t i = 0; i < size; ++i) {
        crc ^= data[i];
        for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ (crc & 1 ? 0xedb88320u : 0);
    }
    return ~crc;
}

void sample_png_chunk(sample_bytes *png, const char *type, const void *data, size_t size)
{
    sample_big_endian(png, size, 4);
    const size_t start = png->size;
    sample_append(png, type, 4);
    sample_append(png, data, size);
    sample_big_endian(png, checksum(png->data + start, size + 4), 4);
}

static void png_start(sample_bytes *png, unsigned depth, unsigned colour_type, bool interlaced)
{
    sample_append(png, "\x89PNG\r\n\x1a\n", 8);
    sample_bytes header = {0};
    sample_big_endian(&header, SAMPLE_WIDTH, 4);
    sample_big_endian(&header, SAMPLE_HEIGHT, 4);
    sample_u8(&header, depth);
    sample_u8(&header, colour_type);
    sample_u8(&header, 0);
    sample_u8(&header, 0);
    sample_u8(&header, interlaced);
    sample_png_chunk(png, "IHDR", header.data, header.size);
    sample_free(&header);
}

static void png_finish(sample_bytes *png, sample_bytes *rows)
{
    sample_bytes packed = {0};
    sample_zlib(&packed, rows);
    sample_png_chunk(png, "IDAT", packed.data, packed.size);
    sample_png_chunk(png, "IEND", NULL, 0);
    sample_free(&packed);
    sample_free(rows);
}

/* The pixels from (x0, y0) on in steps, each row with filter 0 in front. */
static void png_pass(sample_bytes *rows, unsigned depth, unsigned channels, const unsigned pass[4])
{
    if (pass[0] >= SAMPLE_WIDTH) return;
    const bool has_alpha = channels == 2 || channels == 4;
    for (unsigned y = pass[1]; y < SAMPLE_HEIGHT; y += pass[3]) {
        sample_u8(rows, 0);
        for (unsigned x = pass[0]; x < SAMPLE_WIDTH; x += pass[2])
            for (unsigned c = 0; c < channels; ++c) {
                const unsigned code = sample_code(x, y, has_alpha && c + 1 == channels ? 3 : c);
                sample_big_endian(rows, depth == 16 ? 257 * code : code, depth / 8);
            }
    }
}

sample_bytes sample_png(unsigned depth, unsigned channels, bool interlaced)
{
    static const unsigned colour_types[5] = {0, 0, 4, 2, 6};
    static const unsigned adam7[7][4] = {{0, 0, 8, 8}, {4, 0, 8, 8}, {0, 4, 4, 8}, {2, 0, 4, 4},
                                         {0, 2, 2, 4}, {1, 0, 2, 2}, {0, 1, 1, 2}};
    static const unsigned all[4] = {0, 0, 1, 1};
    sample_bytes png = {0}, rows = {0};
    png_start(&png, depth, colour_types[channels], interlaced);
    if (interlaced)
        for (int pass = 0; pass < 7; ++pass) png_pass(&rows, depth, channels, adam7[pass]);
    else
        png_pass(&rows, depth, channels, all);
    png_finish(&png, &rows);
    return png;
}

sample_bytes sample_png_palette(void)
{
    sample_bytes png = {0}, rows = {0}, palette = {0};
    png_start(&png, 4, 3, false);
    for (unsigned i = 0; i < 16; ++i) {
        sample_u8(&palette, 16 * i);
        sample_u8(&palette, 255 - 16 * i);
        sample_u8(&palette, 7 * i);
    }
    sample_png_chunk(&png, "PLTE", palette.data, palette.size);
    sample_png_chunk(&png, "tRNS", "\0", 1);
    for (unsigned y = 0; y < SAMPLE_HEIGHT; ++y) {
        sample_u8(&rows, 0);
        for (unsigned x = 0; x < SAMPLE_WIDTH; x += 2)
            sample_u8(&rows, (x + y) % 16 << 4 | (x + 1 < SAMPLE_WIDTH ? (x + 1 + y) % 16 : 0));
    }
    png_finish(&png, &rows);
    sample_free(&palette);
    return png;
}

/* One TGA pixel, blue first; a palette's entry i is the pixel (i, 0). */
static void tga_pixel(sample_bytes *tga, unsigned kind, unsigned bits, unsigned x, unsigned y)
{
    if (kind == 1) {
        sample_u8(tga, x);
    } else if (kind == 3) {
        sample_u8(tga, sample_code(x, y, 0));
    } else {
        for (unsigned c = 3; c-- > 0;) sample_u8(tga, sample_code(x, y, c));
        if (bits == 32) sample_u8(tga, sample_code(x, y, 3));
    }
}

sample_bytes sample_tga(unsigned kind, unsigned bits, bool packed, bool top_down)
{
    sample_bytes tga = {0};
    sample_u8(&tga, 3); /* bytes of the identification */
    sample_u8(&tga, kind == 1);
    sample_u8(&tga, packed ? kind + 8 : kind);
    sample_u16(&tga, 0);
    sample_u16(&tga, kind == 1 ? SAMPLE_WIDTH : 0);
    sample_u8(&tga, kind == 1 ? 24 : 0);
    sample_u32(&tga, 0);
    sample_u16(&tga, SAMPLE_WIDTH);
    sample_u16(&tga, SAMPLE_HEIGHT);
    sample_u8(&tga, bits);
    sample_u8(&tga, (top_down ? 32u : 0u) | (bits == 32 ? 8u : 0u));
    sample_text(&tga, "abc");
    for (unsigned i = 0; kind == 1 && i < SAMPLE_WIDTH; ++i) tga_pixel(&tga, 2, 24, i, 0);
    for (unsigned row = 0; row < SAMPLE_HEIGHT; ++row) {
        const unsigned y = top_down ? row : SAMPLE_HEIGHT - 1 - row;
        if (packed) { /* two equal pixels (the second overwrites column 1 in the expected image), then the rest as
                         they are */
            sample_u8(&tga, 128 + 1);
            tga_pixel(&tga, kind, bits, 0, y);
            sample_u8(&tga, SAMPLE_WIDTH - 2 - 1);
        }
        for (unsigned x = packed ? 2 : 0; x < SAMPLE_WIDTH; ++x) tga_pixel(&tga, kind, bits, x, y);
    }
    return tga;
}

sample_bytes sample_bmp(unsigned bits, bool top_down)
{
    sample_bytes bmp = {0};
    const uint32_t start = 54 + (bits == 8 ? 1024 : 0), row = (SAMPLE_WIDTH * bits + 31) / 32 * 4;
    sample_text(&bmp, "BM");
    sample_u32(&bmp, start + row * SAMPLE_HEIGHT);
    sample_u32(&bmp, 0);
    sample_u32(&bmp, start);
    sample_u32(&bmp, 40);
    sample_u32(&bmp, SAMPLE_WIDTH);
    sample_u32(&bmp, top_down ? 0u - SAMPLE_HEIGHT : SAMPLE_HEIGHT);
    sample_u16(&bmp, 1);
    sample_u16(&bmp, bits);
    for (int i = 0; i < 6; ++i) sample_u32(&bmp, 0);
    for (unsigned i = 0; bits == 8 && i < 256; ++i) sample_u32(&bmp, i | i << 8 | i << 16);
    for (unsigned line = 0; line < SAMPLE_HEIGHT; ++line) {
        const unsigned y = top_down ? line : SAMPLE_HEIGHT - 1 - line;
        const size_t end = bmp.size + row;
        for (unsigned x = 0; x < SAMPLE_WIDTH; ++x)
            for (unsigned c = 0; c < bits / 8; ++c)
                sample_u8(&bmp, sample_code(x, y, bits == 8 ? 0 : c == 3 ? 3 : 2 - c));
        while (bmp.size < end) sample_u8(&bmp, 0);
    }
    return bmp;
}

sample_bytes sample_pnm(unsigned channels, unsigned largest, bool text)
{
    sample_bytes pnm = {0};
    char words[80];
    snprintf(words, sizeof words, "P%d # made by a test\n%d %d\n# and its largest value\n%u\n",
             (text ? 2 : 5) + (channels == 3), SAMPLE_WIDTH, SAMPLE_HEIGHT, largest);
    sample_text(&pnm, words);
    for (unsigned y = 0; y < SAMPLE_HEIGHT; ++y)
        for (unsigned i = 0; i < SAMPLE_WIDTH * channels; ++i) {
            const unsigned value = sample_code(i / channels, y, i % channels) * largest / 255;
            snprintf(words, sizeof words, "%u ", value);
            if (text)
                sample_text(&pnm, words);
            else
                sample_big_endian(&pnm, value, largest > 255 ? 2 : 1);
        }
    return pnm;
}

sample_bytes sample_hdr(bool packed)
{
    sample_bytes hdr = {0};
    char line[64];
    sample_text(&hdr, "#?RADIANCE\n# made by a test\nFORMAT=32-bit_rle_rgbe\n\n");
    snprintf(line, sizeof line, "-Y %d +X %d\n", SAMPLE_HEIGHT, SAMPLE_WIDTH);
    sample_text(&hdr, line);
    for (unsigned y = 0; y < SAMPLE_HEIGHT; ++y) {
        if (!packed) {
            for (unsigned x = 0; x < SAMPLE_WIDTH; ++x)
                for (unsigned c = 0; c < 4; ++c) sample_u8(&hdr, c == 3 ? 128 + x % 3 : sample_code(x, y, c));
            continue;
        }
        sample_u8(&hdr, 2);
        sample_u8(&hdr, 2);
        sample_big_endian(&hdr, SAMPLE_WIDTH, 2);
        for (unsigned c = 0; c < 4; ++c) { /* one run of a single value, then the others as they are */
            sample_u8(&hdr, 128 + 1);
            for (unsigned x = 0; x < SAMPLE_WIDTH; ++x) {
                if (x == 1) sample_u8(&hdr, SAMPLE_WIDTH - 1);
                sample_u8(&hdr, c == 3 ? 128 + x % 3 : sample_code(x, y, c));
            }
        }
    }
    return hdr;
}

sample_bytes sample_pfm(bool colour, bool big_endian)
{
    sample_bytes pfm = {0};
    char header[64];
    snprintf(header, sizeof header, "%s\n%d %d\n%s\n", colour ? "PF" : "Pf", SAMPLE_WIDTH, SAMPLE_HEIGHT,
             big_endian ? "2.0" : "-2.0");
    sample_text(&pfm, header);
    for (unsigned y = SAMPLE_HEIGHT; y-- > 0;)
        for (unsigned x = 0; x < SAMPLE_WIDTH; ++x)
            for (unsigned c = 0; c < (colour ? 3u : 1u); ++c) {
                const float value = (float)sample_code(x, y, c) / 64.0f;
                uint32_t bits;
                memcpy(&bits, &value, sizeof bits);
                if (big_endian)
                    sample_big_endian(&pfm, bits, 4);
                else
                    sample_u32(&pfm, bits);
            }
    return pfm;
}

/* ---- meshes ---------------------------------------------------------------------------------------------------- */

static const float vertices[5][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {2, 0.5f, 0}};

sample_bytes sample_obj(void)
{
    sample_bytes obj = {0};
    sample_text(&obj, "# a square and a triangle\r\nmtllib none.mtl\no thing\n"
                      "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 1.0 1.0e0 0 0 0 1\nv 0 +1 0 1 1 1\nv 2 .5 0 0.25 0.5 0.75\n"
                      "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
                      "vn 0 0 2\n"
                      "g square\nusemtl none\ns off\n"
                      "f 1/1/1 2/2/1 3/3/1 4/4/1\n"
                      "f -4/2/-1 -1/3/-1 \\\n -3/3/-1 # the triangle\n"
                      "l 1 2\n");
    return obj;
}

static void ply_number(sample_bytes *ply, sample_ply_format format, const char *type, double value)
{
    char text[64];
    sample_bytes number = {0};
    if (format == SAMPLE_PLY_ASCII) {
        snprintf(text, sizeof text, "%.9g\n", value);
        sample_text(ply, text);
        return;
    }
    if (strcmp(type, "float") == 0)
        sample_f32(&number, (float)value);
    else if (strcmp(type, "double") == 0)
        sample_f64(&number, value);
    else
        little_endian(&number, (uint64_t)(int64_t)value,
                      strcmp(type, "uchar") == 0   ? 1
                      : strcmp(type, "short") == 0 ? 2
                                                   : 4);
    for (size_t i = 0; i < number.size; ++i)
        sample_u8(ply, number.data[format == SAMPLE_PLY_BIG_ENDIAN ? number.size - 1 - i : i]);
    sample_free(&number);
}

sample_bytes sample_ply(sample_ply_format format)
{
    static const char *const names[] = {"ascii", "binary_little_endian", "binary_big_endian"};
    static const unsigned faces[2][5] = {{4, 0, 1, 2, 3}, {3, 1, 4, 2, 0}};
    sample_bytes ply = {0};
    char header[1024];
    snprintf(header, sizeof header,
             "ply\nformat %s 1.0\ncomment made by a test\nelement vertex 5\nproperty double y\nproperty uchar red\n"
             "property uchar green\nproperty uchar blue\nproperty float x\nproperty float z\nproperty float s\n"
             "property float t\nproperty float heat_x\nproperty float heat_y\nproperty float heat_z\n"
             "property short mark\nproperty float nx\nproperty float ny\nproperty float nz\nelement extra 2\n"
             "property list uchar int numbers\nproperty float one\nelement face 2\nproperty float weight\n"
             "property list uchar int vertex_indices\nend_header\n",
             names[format]);
    sample_text(&ply, header);
    for (unsigned v = 0; v < 5; ++v) {
        ply_number(&ply, format, "double", (double)vertices[v][1]);
        for (unsigned c = 0; c < 3; ++c) ply_number(&ply, format, "uchar", 50.0 * v + 10.0 * c);
        ply_number(&ply, format, "float", (double)vertices[v][0]);
        ply_number(&ply, format, "float", (double)vertices[v][2]);
        ply_number(&ply, format, "float", 0.25 * v);
        ply_number(&ply, format, "float", 1.0 - 0.25 * v);
        for (unsigned c = 0; c < 3; ++c) ply_number(&ply, format, "float", v + 0.5 * c);
        ply_number(&ply, format, "short", -100.0 * v);
        for (unsigned c = 0; c < 3; ++c) ply_number(&ply, format, "float", c == 2 ? 3.0 : 0.0);
    }
    for (unsigned i = 0; i < 2; ++i) {
        ply_number(&ply, format, "uchar", i + 1.0);
        for (unsigned k = 0; k <= i; ++k) ply_number(&ply, format, "int", -7.0);
        ply_number(&ply, format, "float", 1.0);
    }
    for (unsigned f = 0; f < 2; ++f) {
        ply_number(&ply, format, "float", 10.0 + f);
        ply_number(&ply, format, "uchar", faces[f][0]);
        for (unsigned k = 1; k <= faces[f][0]; ++k) ply_number(&ply, format, "int", faces[f][k]);
    }
    return ply;
}

/* A square and a triangle on its side 1 2, with coordinates of the corners: those of vertex 2 differ. */
sample_bytes sample_ply_corners(sample_ply_format format)
{
    static const char *const names[] = {"ascii", "binary_little_endian", "binary_big_endian"};
    static const unsigned faces[2][5] = {{4, 0, 1, 2, 3}, {3, 1, 4, 2, 0}};
    static const double uvs[2][8] = {{0, 0, 1, 0, 1, 1, 0, 1}, {1, 0, 0.5, 0.25, 0.75, 0.125}};
    sample_bytes ply = {0};
    char header[512];
    snprintf(header, sizeof header,
             "ply\nformat %s 1.0\nelement face 2\nproperty list uchar float texcoord\n"
             "property list uchar int vertex_indices\nelement vertex 5\nproperty float x\nproperty float y\n"
             "property float z\nproperty float heat\nend_header\n",
             names[format]);
    sample_text(&ply, header);
    for (unsigned f = 0; f < 2; ++f) {
        ply_number(&ply, format, "uchar", 2.0 * faces[f][0]);
        for (unsigned k = 0; k < 2 * faces[f][0]; ++k) ply_number(&ply, format, "float", uvs[f][k]);
        ply_number(&ply, format, "uchar", faces[f][0]);
        for (unsigned k = 1; k <= faces[f][0]; ++k) ply_number(&ply, format, "int", faces[f][k]);
    }
    for (unsigned v = 0; v < 5; ++v) {
        for (unsigned c = 0; c < 3; ++c) ply_number(&ply, format, "float", (double)vertices[v][c]);
        ply_number(&ply, format, "float", v + 1.0);
    }
    return ply;
}

static void serialized_float(sample_bytes *bytes, bool doubles, double value)
{
    if (doubles)
        sample_f64(bytes, value);
    else
        sample_f32(bytes, (float)value);
}

static void serialized_mesh(sample_bytes *file, unsigned version, bool doubles, double size)
{
    static const uint32_t triangles[9] = {0, 1, 2, 0, 2, 3, 1, 4, 2};
    sample_bytes content = {0};
    sample_u32(&content, 0x0001 | 0x0002 | 0x0008 | (doubles ? 0x2000 : 0x1000));
    if (version == 4) sample_append(&content, "mesh", 5);
    sample_u64(&content, 5);
    sample_u64(&content, 3);
    for (unsigned v = 0; v < 5; ++v)
        for (unsigned i = 0; i < 3; ++i) serialized_float(&content, doubles, size * (double)vertices[v][i]);
    for (unsigned v = 0; v < 5; ++v)
        for (unsigned i = 0; i < 3; ++i) serialized_float(&content, doubles, i == 2 ? 1.0 : 0.0);
    for (unsigned v = 0; v < 5; ++v)
        for (unsigned i = 0; i < 2; ++i) serialized_float(&content, doubles, 0.125 * v + 0.5 * i);
    for (unsigned v = 0; v < 5; ++v)
        for (unsigned i = 0; i < 3; ++i) serialized_float(&content, doubles, 0.1 * v + 0.01 * i);
    for (unsigned i = 0; i < 9; ++i) sample_u32(&content, triangles[i]);
    sample_u16(file, 0x041c);
    sample_u16(file, version);
    sample_zlib(file, &content);
    sample_free(&content);
}

sample_bytes sample_serialized(unsigned version, bool doubles)
{
    sample_bytes file = {0};
    serialized_mesh(&file, version, doubles, 1.0);
    const size_t second = file.size;
    serialized_mesh(&file, version, doubles, 2.0);
    little_endian(&file, 0, version == 4 ? 8 : 4);
    little_endian(&file, second, version == 4 ? 8 : 4);
    sample_u32(&file, 2);
    return file;
}

/* ---- all of them ----------------------------------------------------------------------------------------------- */

typedef struct file_list {
    sample_file *files;
    size_t count;
} file_list;

static void add(file_list *list, const char *name, bool is_mesh, sample_bytes bytes)
{
    list->files = realloc(list->files, (list->count + 1) * sizeof *list->files);
    if (!list->files) abort();
    sample_file *file = &list->files[list->count++];
    *file = (sample_file){.is_mesh = is_mesh, .bytes = bytes};
    snprintf(file->name, sizeof file->name, "%s", name);
}

size_t sample_files_make(sample_file **files)
{
    enum { EXR_COMPRESSIONS = 8 }; /* the C core of 3.1 has no DWA */
    file_list list = {0};
    add(&list, "mesh.obj", true, sample_obj());
    add(&list, "ascii.ply", true, sample_ply(SAMPLE_PLY_ASCII));
    add(&list, "little.ply", true, sample_ply(SAMPLE_PLY_LITTLE_ENDIAN));
    add(&list, "big.ply", true, sample_ply(SAMPLE_PLY_BIG_ENDIAN));
    add(&list, "corners.ply", true, sample_ply_corners(SAMPLE_PLY_LITTLE_ENDIAN));
    add(&list, "three.serialized", true, sample_serialized(3, false));
    add(&list, "four.serialized", true, sample_serialized(4, true));
    add(&list, "rgb8.png", false, sample_png(8, 3, false));
    add(&list, "grey-alpha16.png", false, sample_png(16, 2, false));
    add(&list, "interlaced.png", false, sample_png(8, 4, true));
    add(&list, "palette.png", false, sample_png_palette());
    add(&list, "colour.jpg", false, sample_jpeg(false, false));
    add(&list, "grey.jpg", false, sample_jpeg(true, false));
    add(&list, "progressive.jpg", false, sample_jpeg(false, true));
    add(&list, "colour.webp", false, sample_webp(false, false));
    add(&list, "alpha.webp", false, sample_webp(true, false));
    add(&list, "lossy.webp", false, sample_webp(false, true));
    add(&list, "colour.tga", false, sample_tga(2, 24, false, false));
    add(&list, "alpha-packed.tga", false, sample_tga(2, 32, true, true));
    add(&list, "palette-packed.tga", false, sample_tga(1, 8, true, false));
    add(&list, "grey.tga", false, sample_tga(3, 8, false, true));
    add(&list, "colour.bmp", false, sample_bmp(24, false));
    add(&list, "palette.bmp", false, sample_bmp(8, true));
    add(&list, "colour.ppm", false, sample_pnm(3, 255, false));
    add(&list, "deep.pgm", false, sample_pnm(1, 1000, false));
    add(&list, "flat.hdr", false, sample_hdr(false));
    add(&list, "packed.hdr", false, sample_hdr(true));
    add(&list, "little.pfm", false, sample_pfm(true, false));
    add(&list, "big.pfm", false, sample_pfm(false, true));
    for (int compression = 0; compression < EXR_COMPRESSIONS; ++compression) {
        char name[64];
        snprintf(name, sizeof name, "lines%d.exr", compression);
        add(&list, name, false, sample_exr(compression, false, false));
        snprintf(name, sizeof name, "tiles%d.exr", compression);
        add(&list, name, false, sample_exr(compression, true, compression % 2));
    }
    *files = list.files;
    return list.count;
}

void sample_files_free(sample_file *files, size_t count)
{
    for (size_t i = 0; i < count; ++i) sample_free(&files[i].bytes);
    free(files);
}

void sample_folder_make(char folder[64])
{
    snprintf(folder, 64, "/tmp/caustica-test-XXXXXX");
    if (!mkdtemp(folder)) abort();
}

void sample_folder_remove(const char *folder)
{
    DIR *listing = opendir(folder);
    if (!listing) return;
    for (struct dirent *entry; (entry = readdir(listing)) != NULL;) {
        char path[512];
        snprintf(path, sizeof path, "%s/%s", folder, entry->d_name);
        if (strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0) unlink(path);
    }
    closedir(listing);
    rmdir(folder);
}

void sample_write(const char *path, const void *data, size_t size)
{
    unlink(path); /* a new file: some file systems wait for the disk when an old one is overwritten */
    FILE *stream = fopen(path, "wb");
    if (!stream || (size && fwrite(data, 1, size, stream) != size) || fclose(stream) != 0) abort();
}

static ca_status read_mesh(const char *path, ca_error *error)
{
    ca_mesh mesh;
    const char *extension = strrchr(path, '.');
    ca_status status, second;
    if (strcmp(extension, ".obj") == 0) {
        status = ca_import_obj(path, &mesh, error);
    } else if (strcmp(extension, ".ply") == 0) {
        status = ca_import_ply(path, &mesh, error);
    } else {
        status = ca_import_serialized(path, 0, &mesh, error);
        ca_mesh_destroy(&mesh);
        second = ca_import_serialized(path, 1, &mesh, error);
        if (status == CA_OK) status = second;
    }
    ca_mesh_destroy(&mesh);
    return status;
}

ca_status sample_read(const char *path, bool is_mesh, ca_error *error)
{
    if (is_mesh) return read_mesh(path, error);
    ca_image image;
    ca_image_layers *layers;
    const ca_status status = ca_image_read(path, CA_ENCODING_SRGB, &image, error);
    ca_image_destroy(&image);
    const ca_status second = ca_layers_read(path, &layers, error);
    ca_layers_destroy(layers);
    return status == CA_OK ? second : status;
}
