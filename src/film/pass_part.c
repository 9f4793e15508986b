#include "film/pass_part.h"

#include "base/file.h"
#include "base/little_endian.h"
#include "base/memory.h"
#include "film/part_exchange.h"
#include "image/image.h"

#include <errno.h>
#include <math.h>
#include <string.h>

/* What follows the number of the format, 8 bytes each. */
enum {
    FIELD_FILE_BYTES,
    FIELD_SETTINGS_BYTES, /* without the zeros that fill it up; likewise: */
    FIELD_RECORD_BYTES,
    FIELD_SCENE_PATH_BYTES,
    FIELD_RANGES,
    FIELD_FULL_WIDTH,
    FIELD_FULL_HEIGHT,
    FIELD_CROP,
    FIELD_REPLICATE_SAMPLES = FIELD_CROP + 4,
    FIELD_EXTENT, /* bits of a double; likewise: */
    FIELD_SECONDS,
    FIELD_LOOK_TARGET,
    FIELD_LOOK_NEXT,
    FIELD_LOOK_NOISE,
    FIELD_THREADS, /* a whole number; likewise: */
    FIELD_LIGHT_PATHS,
    FIELD_COUNTS,
    FIELD_COUNT = FIELD_COUNTS + CA_PART_COUNTS,
};

enum { HEADER_BYTES = CA_PART_MAGIC_BYTES + 8 + 8 * FIELD_COUNT };

void ca_pass_part_destroy(ca_pass_part *part)
{
    ca_free(part->settings);
    ca_free(part->record);
    ca_free(part->scene_path);
    ca_free(part->ranges);
    ca_free(part->camera_paths);
    *part = (ca_pass_part){0};
}

uint64_t ca_pass_part_passes(const ca_pass_part *part)
{
    uint64_t passes = 0;
    for (size_t i = 0; i < part->range_count; i++) passes += part->ranges[i].end - part->ranges[i].begin;
    return passes;
}

/* ---- Films ----------------------------------------------------------------------------------------------------- */

ca_pass_film_desc ca_pass_film_described(const ca_film *film)
{
    return (ca_pass_film_desc){
        .full_width = film->full_width,
        .full_height = film->full_height,
        .crop = {film->x0, film->y0, film->x0 + film->width, film->y0 + film->height},
        .replicate_samples = film->replicate_samples,
        .extent = film->extent,
    };
}

bool ca_pass_film_desc_equal(const ca_pass_film_desc *a, const ca_pass_film_desc *b)
{
    return a->full_width == b->full_width && a->full_height == b->full_height &&
           memcmp(a->crop, b->crop, sizeof a->crop) == 0 && a->replicate_samples == b->replicate_samples &&
           a->extent == b->extent;
}

ca_status ca_pass_film_create(ca_film *film, const ca_pass_film_desc *desc, ca_error *error)
{
    ca_status status = ca_film_create(film, desc->full_width, desc->full_height, desc->crop, error);
    if (status == CA_OK) status = ca_film_add_up_in_parts(film, desc->extent, error);
    if (status == CA_OK) status = ca_film_set_replicates(film, desc->replicate_samples, error);
    if (status != CA_OK) ca_film_destroy(film);
    return status;
}

static uint64_t row_bytes(const ca_pass_film_desc *film)
{
    return ca_film_row_bytes_of(film->crop[2] - film->crop[0], film->replicate_samples);
}

static size_t film_pixels(const ca_pass_film_desc *film)
{
    return (size_t)(film->crop[2] - film->crop[0]) * (film->crop[3] - film->crop[1]);
}

static const ca_part_layout numbers_layout = {.integers = 1};

static uint64_t numbers_bytes(uint64_t light_paths, const ca_pass_film_desc *film)
{
    return light_paths > 0 ? ca_part_array_bytes(film_pixels(film), numbers_layout) : 0;
}

/* Every number that goes in is checked to be small before: no overflow. */
static uint64_t file_bytes(const uint64_t fields[FIELD_COUNT], const ca_pass_film_desc *film)
{
    return HEADER_BYTES + 16 * fields[FIELD_RANGES] + ca_part_padded(fields[FIELD_SETTINGS_BYTES]) +
           ca_part_padded(fields[FIELD_RECORD_BYTES]) + ca_part_padded(fields[FIELD_SCENE_PATH_BYTES]) +
           numbers_bytes(fields[FIELD_LIGHT_PATHS], film) +
           (film->crop[3] - film->crop[1]) * row_bytes(film) + CA_PART_HASH_BYTES;
}

/* ---- Writing --------------------------------------------------------------------------------------------------- */

static void fill_fields(const ca_pass_part *part, const ca_pass_film_desc *film, uint64_t fields[FIELD_COUNT])
{
    fields[FIELD_SETTINGS_BYTES] = strlen(part->settings);
    fields[FIELD_RECORD_BYTES] = strlen(part->record);
    fields[FIELD_SCENE_PATH_BYTES] = strlen(part->scene_path);
    fields[FIELD_RANGES] = part->range_count;
    fields[FIELD_FULL_WIDTH] = film->full_width;
    fields[FIELD_FULL_HEIGHT] = film->full_height;
    for (int i = 0; i < 4; i++) fields[FIELD_CROP + i] = film->crop[i];
    fields[FIELD_REPLICATE_SAMPLES] = film->replicate_samples;
    fields[FIELD_EXTENT] = ca_double_bits((double)film->extent);
    fields[FIELD_SECONDS] = ca_double_bits(part->seconds);
    fields[FIELD_LOOK_TARGET] = ca_double_bits(part->looks.target);
    fields[FIELD_LOOK_NEXT] = ca_double_bits(part->looks.next);
    fields[FIELD_LOOK_NOISE] = ca_double_bits(part->looks.noise);
    fields[FIELD_THREADS] = part->threads;
    fields[FIELD_LIGHT_PATHS] = part->light_paths;
    for (int i = 0; i < CA_PART_COUNTS; i++) fields[FIELD_COUNTS + i] = part->counts[i];
    fields[FIELD_FILE_BYTES] = file_bytes(fields, film);
}

static void put_numbers(ca_part_writer *writer, const ca_pass_part *part, size_t pixels)
{
    ca_part_exchange x = ca_part_exchange_write(writer);
    ca_part_exchange_array(&x, part->camera_paths, pixels, numbers_layout);
}

static void put_part(ca_part_writer *writer, const ca_pass_part *part, const ca_film *film, unsigned char *row)
{
    const ca_pass_film_desc desc = ca_pass_film_described(film);
    uint64_t fields[FIELD_COUNT];
    fill_fields(part, &desc, fields);
    ca_part_put(writer, ca_part_magic, sizeof ca_part_magic);
    ca_part_put_u64(writer, CA_PASS_PART_FORMAT);
    for (int i = 0; i < FIELD_COUNT; i++) ca_part_put_u64(writer, fields[i]);
    for (size_t i = 0; i < part->range_count; i++) {
        ca_part_put_u64(writer, part->ranges[i].begin);
        ca_part_put_u64(writer, part->ranges[i].end);
    }
    ca_part_put_text(writer, part->settings);
    ca_part_put_text(writer, part->record);
    ca_part_put_text(writer, part->scene_path);
    if (part->light_paths > 0) put_numbers(writer, part, film_pixels(&desc));
    for (uint32_t y = 0; y < film->height && writer->good; y++) {
        ca_film_write_row(film, y, row);
        ca_part_put(writer, row, ca_film_row_bytes(film));
    }
    ca_part_put_hash(writer);
}

ca_status ca_pass_part_write(const ca_pass_part *part, const ca_film *film, const char *path, ca_error *error)
{
    if (strlen(part->settings) > CA_PART_TEXT_BYTES || strlen(part->record) > CA_PART_TEXT_BYTES ||
        strlen(part->scene_path) > CA_PART_TEXT_BYTES)
        return ca_fail(error, CA_ERROR_UNSUPPORTED, NULL,
                       "%s: the scene's path or the settings are over the limit of %d bytes", path,
                       CA_PART_TEXT_BYTES);
    if (part->range_count > CA_PASS_PART_RANGES)
        return ca_fail(error, CA_ERROR_UNSUPPORTED, NULL, "%s: passes in more than %d pieces", path,
                       CA_PASS_PART_RANGES);
    unsigned char *row = ca_alloc(ca_film_row_bytes(film), 1);
    if (!row) return ca_fail_memory(error, path);
    ca_file_writer file;
    ca_status status = ca_file_create(&file, path, error);
    if (status == CA_OK) {
        ca_part_writer writer = ca_part_writer_start(file.stream);
        put_part(&writer, part, film, row);
        status = ca_file_commit_durably(&file, error); /* a write that failed fails there */
    }
    ca_free(row);
    return status;
}

/* ---- Reading --------------------------------------------------------------------------------------------------- */

static ca_status fail_damaged(const ca_pass_reader *reader, ca_error *error)
{
    const int reason = ca_part_failure(reader->stream);
    if (reason == ENOMEM) return ca_fail_memory(error, reader->path);
    if (reason) return ca_fail(error, CA_ERROR_FILE, NULL, "%s: cannot read: %s", reader->path, strerror(reason));
    return ca_fail(error, CA_ERROR_FORMAT, NULL, "%s: this part file is damaged", reader->path);
}

static bool is_amount(uint64_t bits)
{
    const double value = ca_bits_double(bits);
    return isfinite(value) && value >= 0.0;
}

static bool read_film_desc(const uint64_t *f, ca_pass_film_desc *film)
{
    const uint64_t *c = f + FIELD_CROP, width = f[FIELD_FULL_WIDTH], height = f[FIELD_FULL_HEIGHT];
    const double extent = ca_bits_double(f[FIELD_EXTENT]);
    int exponent;
    if (width > CA_IMAGE_MAX_SIDE || height > CA_IMAGE_MAX_SIDE) return false;
    if (c[0] >= c[2] || c[1] >= c[3] || c[2] > width || c[3] > height) return false;
    if (!(extent >= 0x1p-149 && extent <= 0x1p127) || frexp(extent, &exponent) != 0.5) return false;
    if (f[FIELD_REPLICATE_SAMPLES] > CA_BINNED_SUM_MOST_VALUES) return false;
    *film = (ca_pass_film_desc){.full_width = (uint32_t)width,
                                .full_height = (uint32_t)height,
                                .crop = {(uint32_t)c[0], (uint32_t)c[1], (uint32_t)c[2], (uint32_t)c[3]},
                                .replicate_samples = (uint32_t)f[FIELD_REPLICATE_SAMPLES],
                                .extent = (float)extent};
    return true;
}

/* Bounds of every field. */
static bool check_fields(const uint64_t *f, ca_pass_film_desc *film)
{
    if (f[FIELD_SETTINGS_BYTES] > CA_PART_TEXT_BYTES || f[FIELD_RECORD_BYTES] > CA_PART_TEXT_BYTES ||
        f[FIELD_SCENE_PATH_BYTES] > CA_PART_TEXT_BYTES || f[FIELD_RANGES] > CA_PASS_PART_RANGES)
        return false;
    const bool amounts = is_amount(f[FIELD_SECONDS]) && is_amount(f[FIELD_LOOK_TARGET]) &&
                         is_amount(f[FIELD_LOOK_NEXT]) && isfinite(ca_bits_double(f[FIELD_LOOK_NOISE]));
    return f[FIELD_RANGES] > 0 && f[FIELD_THREADS] <= UINT32_MAX && f[FIELD_LIGHT_PATHS] <= UINT32_MAX && amounts &&
           read_film_desc(f, film);
}

static ca_status read_ranges(ca_pass_reader *reader, size_t count, ca_error *error)
{
    ca_pass_part *part = &reader->part;
    uint64_t before = 0;
    part->ranges = ca_alloc(count, sizeof *part->ranges);
    if (!part->ranges) return ca_fail_memory(error, reader->path);
    for (size_t i = 0; i < count; i++) {
        ca_pass_range *range = &part->ranges[i];
        const bool read =
            ca_part_get_u64(reader->stream, &range->begin) && ca_part_get_u64(reader->stream, &range->end);
        const bool in_order = i == 0 || range->begin > before;
        if (!read || !in_order || range->begin >= range->end || range->end > CA_BINNED_SUM_MOST_VALUES)
            return fail_damaged(reader, error);
        before = range->end;
    }
    part->range_count = count;
    return CA_OK;
}

static ca_status read_texts(ca_pass_reader *reader, const uint64_t *f, ca_error *error)
{
    ca_pass_part *part = &reader->part;
    part->settings = ca_part_get_text(reader->stream, f[FIELD_SETTINGS_BYTES]);
    part->record = ca_part_get_text(reader->stream, f[FIELD_RECORD_BYTES]);
    part->scene_path = ca_part_get_text(reader->stream, f[FIELD_SCENE_PATH_BYTES]);
    return part->settings && part->record && part->scene_path ? CA_OK : fail_damaged(reader, error);
}

static ca_status read_numbers(ca_pass_reader *reader, uint32_t light_paths, ca_error *error)
{
    ca_pass_part *part = &reader->part;
    const size_t pixels = film_pixels(&reader->film);
    ca_part_exchange x = ca_part_exchange_read(reader->stream);
    part->camera_paths = ca_alloc(pixels, sizeof *part->camera_paths);
    if (!part->camera_paths) return ca_fail_memory(error, reader->path);
    ca_part_exchange_array(&x, part->camera_paths, pixels, numbers_layout);
    for (size_t p = 0; p < pixels && x.good; p++) x.good = part->camera_paths[p] > 0;
    part->light_paths = light_paths;
    return x.good ? CA_OK : fail_damaged(reader, error);
}

static ca_status read_body(ca_pass_reader *reader, const uint64_t *f, ca_error *error)
{
    ca_pass_part *part = &reader->part;
    CA_TRY(read_ranges(reader, (size_t)f[FIELD_RANGES], error));
    CA_TRY(read_texts(reader, f, error));
    for (int i = 0; i < CA_PART_COUNTS; i++) part->counts[i] = f[FIELD_COUNTS + i];
    part->seconds = ca_bits_double(f[FIELD_SECONDS]);
    part->looks = (ca_pass_looks){ca_bits_double(f[FIELD_LOOK_TARGET]), ca_bits_double(f[FIELD_LOOK_NEXT]),
                                  ca_bits_double(f[FIELD_LOOK_NOISE])};
    part->threads = (uint32_t)f[FIELD_THREADS];
    return f[FIELD_LIGHT_PATHS] > 0 ? read_numbers(reader, (uint32_t)f[FIELD_LIGHT_PATHS], error) : CA_OK;
}

static ca_status read_header(ca_pass_reader *reader, uint64_t size, ca_error *error)
{
    uint64_t f[FIELD_COUNT];
    bool read = true;
    for (int i = 0; i < FIELD_COUNT; i++) read = read && ca_part_get_u64(reader->stream, &f[i]);
    if (!read && ca_part_failure(reader->stream)) return fail_damaged(reader, error);
    if (!read || f[FIELD_FILE_BYTES] > size)
        return ca_fail(error, CA_ERROR_FORMAT, NULL, "%s: this part file is cut off after %llu bytes", reader->path,
                       (unsigned long long)size);
    if (!check_fields(f, &reader->film) || size != f[FIELD_FILE_BYTES] || size != file_bytes(f, &reader->film) ||
        !ca_part_check_hash(reader->stream, size))
        return fail_damaged(reader, error);
    return read_body(reader, f, error);
}

static ca_status fail_format(const char *path, uint64_t format, ca_error *error)
{
    if (format == CA_JOINED_PART_FORMAT)
        return ca_fail(error, CA_ERROR_FORMAT, NULL,
                       "%s: the checkpoint of a render with rays \"auto\", which has no passes that add up: only "
                       "such a render by one process goes on from it",
                       path);
    return ca_part_fail_format(path, format, CA_PASS_PART_FORMAT, error);
}

ca_status ca_pass_reader_open(ca_pass_reader *reader, const char *path, ca_error *error)
{
    uint64_t size, format;
    *reader = (ca_pass_reader){.path = path};
    errno = 0;
    CA_TRY(ca_part_open(path, &reader->stream, &size, &format, error));
    const ca_status status =
        format == CA_PASS_PART_FORMAT ? read_header(reader, size, error) : fail_format(path, format, error);
    if (status != CA_OK) ca_pass_reader_close(reader);
    return status;
}

void ca_pass_reader_close(ca_pass_reader *reader)
{
    if (reader->stream) fclose(reader->stream);
    ca_pass_part_destroy(&reader->part);
    *reader = (ca_pass_reader){0};
}

ca_status ca_pass_reader_add(ca_pass_reader *reader, ca_film *film, bool first, ca_error *error)
{
    const size_t bytes = ca_film_row_bytes(film);
    const uint32_t samples = (uint32_t)ca_pass_part_passes(&reader->part);
    unsigned char *row = ca_alloc(bytes, 1);
    if (!row) return ca_fail_memory(error, reader->path);
    errno = 0;
    bool good = true;
    for (uint32_t y = 0; y < film->height && good; y++)
        good = ca_part_get(reader->stream, row, bytes) && ca_film_add_row(film, y, row, samples, first);
    ca_free(row);
    return good ? CA_OK : fail_damaged(reader, error);
}
