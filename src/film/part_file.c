#include "film/part_file.h"

#include "base/hash.h"
#include "base/memory.h"
#include "film/part_stream.h"
#include "image/image.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

/* What follows the magic, 8 bytes each. */
enum {
    FIELD_FORMAT,
    FIELD_FILE_BYTES,
    FIELD_SETTINGS_BYTES, /* without the zeros that fill it up; likewise: */
    FIELD_SCENE_PATH_BYTES,
    FIELD_FULL_WIDTH,
    FIELD_FULL_HEIGHT,
    FIELD_CROP,
    FIELD_EXTRAS = FIELD_CROP + 4, /* what the film has beside the image */
    FIELD_EXTENT, /* bits of a double */
    FIELD_BLOCKS,
    FIELD_SECONDS = FIELD_BLOCKS + 2, /* bits of a double; likewise: */
    FIELD_SAMPLES_PER_PIXEL,
    FIELD_NEXT_SAMPLES,
    FIELD_NEXT_BLOCKS, /* a whole number; likewise: */
    FIELD_THREADS,
    FIELD_COUNTS,
    FIELD_COUNT = FIELD_COUNTS + CA_PART_COUNTS,
};

enum { EXTRA_GRADIENTS = 1, EXTRA_ERROR_BARS = 2, ALL_EXTRAS = 3 };
enum { HEADER_BYTES = 8 + 8 * FIELD_COUNT };
enum { HASH_BYTES = CA_PART_HASH_BYTES, MAX_TEXT_BYTES = CA_PART_TEXT_BYTES };

static const size_t max_file_bytes = (size_t)1 << 40;

/* Every number that goes in is checked to be small before: no overflow. */
static uint64_t file_bytes(const ca_block_film_desc *film, uint64_t settings_bytes, uint64_t scene_path_bytes)
{
    return HEADER_BYTES + ca_part_padded(settings_bytes) + ca_part_padded(scene_path_bytes) +
           (uint64_t)(film->crop[3] - film->crop[1]) * ca_block_film_row_bytes(film) + HASH_BYTES;
}

bool ca_part_is_path(const char *path) { return strcasecmp(ca_path_extension(path), ".part") == 0; }

void ca_part_destroy(ca_part *part)
{
    ca_free(part->settings);
    ca_free(part->scene_path);
    ca_block_film_destroy(part->film);
    *part = (ca_part){0};
}

/* ---- Writing --------------------------------------------------------------------------------------------------- */

static void fill_header(const ca_part *part, unsigned char header[HEADER_BYTES])
{
    const ca_block_film_desc *film = ca_block_film_described(part->film);
    const uint64_t settings_bytes = strlen(part->settings), scene_path_bytes = strlen(part->scene_path);
    uint64_t fields[FIELD_COUNT] = {
        [FIELD_FORMAT] = CA_BLOCK_PART_FORMAT,
        [FIELD_FILE_BYTES] = file_bytes(film, settings_bytes, scene_path_bytes),
        [FIELD_SETTINGS_BYTES] = settings_bytes,
        [FIELD_SCENE_PATH_BYTES] = scene_path_bytes,
        [FIELD_FULL_WIDTH] = film->full_width,
        [FIELD_FULL_HEIGHT] = film->full_height,
        [FIELD_EXTRAS] = (film->gradients ? EXTRA_GRADIENTS : 0) | (film->error_bars ? EXTRA_ERROR_BARS : 0),
        [FIELD_EXTENT] = ca_double_bits((double)film->extent),
        [FIELD_BLOCKS] = part->blocks[0],
        [FIELD_BLOCKS + 1] = part->blocks[1],
        [FIELD_SECONDS] = ca_double_bits(part->seconds),
        [FIELD_SAMPLES_PER_PIXEL] = ca_double_bits(part->samples_per_pixel),
        [FIELD_NEXT_SAMPLES] = ca_double_bits(part->next_samples),
        [FIELD_NEXT_BLOCKS] = part->next_blocks,
        [FIELD_THREADS] = part->threads,
    };
    for (int i = 0; i < 4; i++) fields[FIELD_CROP + i] = film->crop[i];
    for (int i = 0; i < CA_PART_COUNTS; i++) fields[FIELD_COUNTS + i] = part->counts[i];
    memcpy(header, ca_part_magic, sizeof ca_part_magic);
    for (size_t i = 0; i < FIELD_COUNT; i++) ca_put_u64(header + 8 + 8 * i, fields[i]);
}

static void put_part(ca_part_writer *writer, const ca_part *part, unsigned char *row)
{
    unsigned char header[HEADER_BYTES];
    const ca_block_film_desc *film = ca_block_film_described(part->film);
    fill_header(part, header);
    ca_part_put(writer, header, sizeof header);
    ca_part_put_text(writer, part->settings);
    ca_part_put_text(writer, part->scene_path);
    const size_t row_bytes = ca_block_film_row_bytes(film);
    for (uint32_t y = 0; y < film->crop[3] - film->crop[1] && writer->good; y++) {
        ca_block_film_write_row(part->film, y, row);
        ca_part_put(writer, row, row_bytes);
    }
    ca_part_put_hash(writer);
}

ca_status ca_part_write(const ca_part *part, const char *path, ca_error *error)
{
    if (strlen(part->settings) > MAX_TEXT_BYTES || strlen(part->scene_path) > MAX_TEXT_BYTES)
        return ca_fail(error, CA_ERROR_UNSUPPORTED, NULL,
                       "%s: the scene's path or the settings are over the limit of %d bytes", path, MAX_TEXT_BYTES);
    unsigned char *row = ca_alloc(ca_block_film_row_bytes(ca_block_film_described(part->film)), 1);
    if (!row) return ca_fail_memory(error, path);
    ca_file_writer file;
    ca_status status = ca_file_create(&file, path, error);
    if (status == CA_OK) {
        ca_part_writer writer = ca_part_writer_start(file.stream);
        put_part(&writer, part, row);
        status = ca_file_commit_durably(&file, error); /* a write that failed fails there */
    }
    ca_free(row);
    return status;
}

/* ---- Reading --------------------------------------------------------------------------------------------------- */

typedef struct part_reader {
    const char *path;
    const ca_bytes *bytes;
    uint64_t fields[FIELD_COUNT];
    ca_block_film_desc film;
} part_reader;

static ca_status fail_damaged(const part_reader *reader, ca_error *error)
{
    return ca_fail(error, CA_ERROR_FORMAT, NULL, "%s: this part file is damaged", reader->path);
}

static ca_status read_fields(part_reader *reader, ca_error *error)
{
    const ca_bytes *bytes = reader->bytes;
    const size_t start = bytes->size < sizeof ca_part_magic ? bytes->size : sizeof ca_part_magic;
    if (start == 0 || memcmp(bytes->data, ca_part_magic, start) != 0)
        return ca_fail(error, CA_ERROR_FORMAT, NULL, "%s: not a part file", reader->path);
    if (bytes->size < HEADER_BYTES + HASH_BYTES)
        return ca_fail(error, CA_ERROR_FORMAT, NULL, "%s: this part file is cut off after %zu bytes", reader->path,
                       bytes->size);
    for (size_t i = 0; i < FIELD_COUNT; i++) reader->fields[i] = ca_get_u64(bytes->data + 8 + 8 * i);
    if (reader->fields[FIELD_FORMAT] != CA_BLOCK_PART_FORMAT)
        return ca_part_fail_format(reader->path, reader->fields[FIELD_FORMAT], CA_BLOCK_PART_FORMAT, error);
    if (reader->fields[FIELD_FILE_BYTES] > bytes->size)
        return ca_fail(error, CA_ERROR_FORMAT, NULL, "%s: this part file is cut off: it has %zu of %llu bytes",
                       reader->path, bytes->size, (unsigned long long)reader->fields[FIELD_FILE_BYTES]);
    return CA_OK;
}

static bool is_amount(uint64_t bits)
{
    const double value = ca_bits_double(bits);
    return isfinite(value) && value >= 0.0;
}

static bool read_film_desc(part_reader *reader)
{
    const uint64_t *f = reader->fields, *c = f + FIELD_CROP, width = f[FIELD_FULL_WIDTH],
                   height = f[FIELD_FULL_HEIGHT];
    const double extent = ca_bits_double(f[FIELD_EXTENT]);
    if (width > CA_IMAGE_MAX_SIDE || height > CA_IMAGE_MAX_SIDE || f[FIELD_EXTRAS] > ALL_EXTRAS) return false;
    if (c[0] >= c[2] || c[1] >= c[3] || c[2] > width || c[3] > height) return false;
    if (!(extent >= 0x1p-149 && extent <= 0x1p127)) return false;
    reader->film = (ca_block_film_desc){.full_width = (uint32_t)width,
                                        .full_height = (uint32_t)height,
                                        .crop = {(uint32_t)c[0], (uint32_t)c[1], (uint32_t)c[2], (uint32_t)c[3]},
                                        .gradients = f[FIELD_EXTRAS] & EXTRA_GRADIENTS,
                                        .error_bars = f[FIELD_EXTRAS] & EXTRA_ERROR_BARS,
                                        .extent = (float)extent};
    return true;
}

/* Bounds of every field, and that the size follows from them. */
static bool check_fields(part_reader *reader)
{
    const uint64_t *f = reader->fields;
    if (f[FIELD_SETTINGS_BYTES] > MAX_TEXT_BYTES || f[FIELD_SCENE_PATH_BYTES] > MAX_TEXT_BYTES) return false;
    if (f[FIELD_BLOCKS] >= f[FIELD_BLOCKS + 1] || f[FIELD_THREADS] > UINT32_MAX) return false;
    if (!is_amount(f[FIELD_SECONDS]) || !is_amount(f[FIELD_SAMPLES_PER_PIXEL]) || !is_amount(f[FIELD_NEXT_SAMPLES]))
        return false;
    if (!read_film_desc(reader)) return false;
    return reader->bytes->size == f[FIELD_FILE_BYTES] &&
           reader->bytes->size == file_bytes(&reader->film, f[FIELD_SETTINGS_BYTES], f[FIELD_SCENE_PATH_BYTES]);
}

static bool check_hash(const part_reader *reader)
{
    const size_t size = reader->bytes->size - HASH_BYTES;
    return ca_hash_bytes(CA_HASH_START, reader->bytes->data, size) == ca_get_u64(reader->bytes->data + size);
}

/* A text of `size` bytes at *offset, which moves behind it. */
static ca_status read_text(const part_reader *reader, size_t size, size_t *offset, char **text, ca_error *error)
{
    const unsigned char *data = reader->bytes->data + *offset;
    if (memchr(data, 0, size)) return fail_damaged(reader, error);
    *text = ca_alloc(size + 1, 1);
    if (!*text) return ca_fail_memory(error, reader->path);
    memcpy(*text, data, size);
    (*text)[size] = '\0';
    *offset += (size_t)ca_part_padded(size);
    return CA_OK;
}

/* All but the film, whose rows begin at *offset then. */
static ca_status read_body(const part_reader *reader, ca_part *part, size_t *offset, ca_error *error)
{
    const uint64_t *f = reader->fields;
    *offset = HEADER_BYTES;
    CA_TRY(read_text(reader, (size_t)f[FIELD_SETTINGS_BYTES], offset, &part->settings, error));
    CA_TRY(read_text(reader, (size_t)f[FIELD_SCENE_PATH_BYTES], offset, &part->scene_path, error));
    for (int i = 0; i < 2; i++) part->blocks[i] = f[FIELD_BLOCKS + i];
    for (int i = 0; i < CA_PART_COUNTS; i++) part->counts[i] = f[FIELD_COUNTS + i];
    part->seconds = ca_bits_double(f[FIELD_SECONDS]);
    part->samples_per_pixel = ca_bits_double(f[FIELD_SAMPLES_PER_PIXEL]);
    part->next_samples = ca_bits_double(f[FIELD_NEXT_SAMPLES]);
    part->next_blocks = f[FIELD_NEXT_BLOCKS];
    part->threads = (uint32_t)f[FIELD_THREADS];
    return CA_OK;
}

static ca_status decode(part_reader *reader, ca_part *part, size_t *offset, ca_error *error)
{
    *part = (ca_part){0};
    CA_TRY(read_fields(reader, error));
    if (!check_fields(reader) || !check_hash(reader)) return fail_damaged(reader, error);
    return read_body(reader, part, offset, error);
}

ca_status ca_part_decode(const char *path, const ca_bytes *bytes, ca_part *part, ca_error *error)
{
    part_reader reader = {.path = path, .bytes = bytes};
    size_t offset = 0;
    ca_status status = decode(&reader, part, &offset, error);
    if (status == CA_OK) status = ca_block_film_create(&part->film, &reader.film, error);
    const size_t row_bytes = ca_block_film_row_bytes(&reader.film);
    for (uint32_t y = 0; status == CA_OK && y < reader.film.crop[3] - reader.film.crop[1]; y++)
        ca_block_film_read_row(part->film, y, bytes->data + offset + y * row_bytes);
    if (status != CA_OK) ca_part_destroy(part);
    return status;
}

ca_status ca_part_read(const char *path, ca_part *part, ca_error *error)
{
    *part = (ca_part){0};
    ca_bytes bytes;
    CA_TRY(ca_file_read(path, "part file", max_file_bytes, &bytes, error));
    const ca_status status = ca_part_decode(path, &bytes, part, error);
    ca_bytes_destroy(&bytes);
    return status;
}

/* ---- Adding ---------------------------------------------------------------------------------------------------- */

ca_status ca_part_file_open(ca_part_file *file, const char *path, ca_error *error)
{
    *file = (ca_part_file){0};
    part_reader reader = {.path = path, .bytes = &file->bytes};
    CA_TRY(ca_file_read(path, "part file", max_file_bytes, &file->bytes, error));
    const ca_status status = decode(&reader, &file->part, &file->rows, error);
    file->film = reader.film;
    if (status != CA_OK) ca_part_file_close(file);
    return status;
}

void ca_part_file_add(const ca_part_file *file, ca_block_film *film)
{
    const size_t row_bytes = ca_block_film_row_bytes(&file->film);
    for (uint32_t y = 0; y < file->film.crop[3] - file->film.crop[1]; y++)
        ca_block_film_add_row(film, y, file->bytes.data + file->rows + y * row_bytes);
}

void ca_part_file_close(ca_part_file *file)
{
    ca_bytes_destroy(&file->bytes);
    ca_part_destroy(&file->part);
}
