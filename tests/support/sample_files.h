/* Small mesh and image files of every format that is read, made from scratch: what the tests of readers start from,
 * cut and damage. The byte-level formats are written by hand, JPEG, WebP and the kinds of EXR that we never write by
 * their libraries. Aborts where even the test machine's memory or disk fails. */
#ifndef CA_TESTS_SAMPLE_FILES_H
#define CA_TESTS_SAMPLE_FILES_H

#include "base/status.h"

#include <stddef.h>
#include <stdint.h>

typedef struct sample_bytes {
    unsigned char *data;
    size_t size, capacity;
} sample_bytes;

void sample_append(sample_bytes *bytes, const void *data, size_t size);
void sample_text(sample_bytes *bytes, const char *text);
void sample_u8(sample_bytes *bytes, unsigned value);
void sample_u16(sample_bytes *bytes, unsigned value); /* little endian, as the next ones */
void sample_u32(sample_bytes *bytes, uint32_t value);
void sample_u64(sample_bytes *bytes, uint64_t value);
void sample_f32(sample_bytes *bytes, float value);
void sample_f64(sample_bytes *bytes, double value);
void sample_big_endian(sample_bytes *bytes, uint64_t value, size_t size);
/* `content` as a zlib stream of stored blocks. */
void sample_zlib(sample_bytes *bytes, const sample_bytes *content);
void sample_free(sample_bytes *bytes);

/* ---- images: the pixels are a function of their place, the same for all formats -------------------------------- */

enum { SAMPLE_WIDTH = 9, SAMPLE_HEIGHT = 5 };
/* 8 bit code of channel c (0 to 2: colour, 3: alpha). */
unsigned sample_code(unsigned x, unsigned y, unsigned c);

/* One chunk, with length and checksum. */
void sample_png_chunk(sample_bytes *png, const char *type, const void *data, size_t size);
/* `depth` 8 or 16 (code * 257) with 1 to 4 channels; interlaced by Adam7 if asked. */
sample_bytes sample_png(unsigned depth, unsigned channels, bool interlaced);
/* 4 bit palette indices (x + y) % 16, of which entry i is (16 i, 255 - 16 i, 7 i); entry 0 has alpha 0. */
sample_bytes sample_png_palette(void);
sample_bytes sample_jpeg(bool grey, bool progressive);
/* Without loss; with one it is smooth, as the JPEG in colour. */
sample_bytes sample_webp(bool alpha, bool lossy);
/* One colour, without loss: a few bytes. */
sample_bytes sample_flat_webp(int side);
/* kind: 1 palette, 2 colour, 3 grey; bits of a pixel (24 or 32; 8 otherwise); run-length encoded; first row on
 * top. */
sample_bytes sample_tga(unsigned kind, unsigned bits, bool packed, bool top_down);
/* 8 (with a palette of the greys), 24 or 32 bits. */
sample_bytes sample_bmp(unsigned bits, bool top_down);
/* 1 or 3 channels; samples are codes of 255, scaled to the largest value. */
sample_bytes sample_pnm(unsigned channels, unsigned largest, bool text);
/* Run-length encoded or flat; mantissas are the codes, the exponent is 128 + x % 3. */
sample_bytes sample_hdr(bool packed);
sample_bytes sample_pfm(bool colour, bool big_endian);
/* compression: an exr_compression_t; channels R G B A as halves, or Y as float. Values are code / 64. */
/* tiles: 0 lines, 1 tiles, 2 tiles of several levels, of which all but the first are black. */
sample_bytes sample_exr(int compression, int tiles, bool grey);

/* ---- meshes: a unit square in z = 0 and a triangle beside it, 5 vertices, 3 triangles -------------------------- */

sample_bytes sample_obj(void);
typedef enum sample_ply_format {
    SAMPLE_PLY_ASCII,
    SAMPLE_PLY_LITTLE_ENDIAN,
    SAMPLE_PLY_BIG_ENDIAN
} sample_ply_format;
sample_bytes sample_ply(sample_ply_format format);
/* With faces first, and lists of texture coordinates. */
sample_bytes sample_ply_corners(sample_ply_format format);
/* Two meshes; the second is twice as large as the first. */
sample_bytes sample_serialized(unsigned version, bool doubles);

/* ---- all of them ----------------------------------------------------------------------------------------------- */

typedef struct sample_file {
    char name[64]; /* with the extension */
    bool is_mesh;
    sample_bytes bytes;
} sample_file;

size_t sample_files_make(sample_file **files);
void sample_files_free(sample_file *files, size_t count);

/* A folder of its own for the test's files, and its removal with all files in it. */
void sample_folder_make(char folder[64]);
void sample_folder_remove(const char *folder);
void sample_write(const char *path, const void *data, size_t size);

/* Reads the file with every reader for its extension and lets go of the result. */
ca_status sample_read(const char *path, bool is_mesh, ca_error *error);

#endif
