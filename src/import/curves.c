/* Curves as text: four numbers a line, the position of a control point and its radius; one blank line or more ends a
 * curve. */
#include "base/file.h"
#include "base/hash.h"
#include "base/memory.h"
#include "import/import.h"
#include "import/text_scan.h"

#include <math.h>
#include <string.h>

static const size_t max_file_bytes = (size_t)1 << 34;

typedef struct curve_reader {
    ca_text_scan scan;
    ca_curve_degree degree;
    float *values; /* four a point */
    size_t value_count, value_capacity;
    uint32_t *segments;
    size_t segment_count, segment_capacity;
    size_t first; /* point of the curve that is being read */
} curve_reader;

static ca_status read_point(curve_reader *reader, ca_error *error)
{
    static const char *const names[4] = {"x", "y", "z", "the radius"};
    ca_text_scan *scan = &reader->scan;
    float *values = ca_array_grow(reader->values, &reader->value_capacity, reader->value_count + 4, sizeof *values);
    if (!values) return ca_fail_memory(error, "curves");
    reader->values = values;
    for (int k = 0; k < 4; k++) {
        double value;
        ca_scan_skip_blanks(scan);
        const ca_location where = ca_scan_place(scan, scan->cursor);
        CA_TRY(ca_scan_number(scan, names[k], &value, error));
        if (k == 3 && value < 0.0 && reader->degree == CA_CURVE_LINEAR)
            return ca_fail(error, CA_ERROR_FORMAT, &where, "a radius cannot be negative");
        values[reader->value_count++] = (float)value;
    }
    if (ca_scan_line_ends(scan)) return CA_OK;
    const ca_location where = ca_scan_place(scan, scan->cursor);
    return ca_fail(error, CA_ERROR_FORMAT, &where, "expected the end of the line behind four numbers");
}

/* Is the radius negative where a B-spline's segment begins that has its first control point there, or where it ends?
 * A control point's may be: a tip needs that. */
static bool is_turned(const float *values, size_t point)
{
    const float *r = values + 4 * point + 3;
    const float begin = r[0] + 4.0f * r[4] + r[8], end = r[4] + 4.0f * r[8] + r[12];
    const float rounding = -1e-5f * (fabsf(r[0]) + fabsf(r[4]) + fabsf(r[8]) + fabsf(r[12]));
    return begin < rounding || end < rounding;
}

/* The segments of the points since `first`. */
static ca_status end_curve(curve_reader *reader, ca_error *error)
{
    const size_t end = reader->value_count / 4, points = end - reader->first, degree = (size_t)reader->degree;
    if (points == 0) return CA_OK;
    if (points <= degree) {
        const ca_location where = ca_scan_place(&reader->scan, reader->scan.cursor);
        return ca_fail(error, CA_ERROR_FORMAT, &where, "this curve ends after %zu control points, but needs %zu",
                       points, degree + 1);
    }
    for (size_t i = reader->first; reader->degree == CA_CURVE_CUBIC && i + degree < end; i++)
        if (is_turned(reader->values, i)) {
            const ca_location where = ca_scan_place(&reader->scan, reader->scan.cursor);
            return ca_fail(error, CA_ERROR_FORMAT, &where,
                           "the radius of this curve is negative around its control point %zu",
                           i - reader->first + 2);
        }
    const size_t count = reader->segment_count + points - degree;
    uint32_t *segments = ca_array_grow(reader->segments, &reader->segment_capacity, count, sizeof *segments);
    if (!segments) return ca_fail_memory(error, "curves");
    reader->segments = segments;
    while (reader->segment_count < count) segments[reader->segment_count++] = (uint32_t)reader->first++;
    reader->first = end;
    return CA_OK;
}

static ca_status read_lines(curve_reader *reader, ca_error *error)
{
    if (reader->scan.cursor < reader->scan.end) do {
            if (ca_scan_line_ends(&reader->scan))
                CA_TRY(end_curve(reader, error));
            else
                CA_TRY(read_point(reader, error));
        } while (ca_scan_next_line(&reader->scan));
    CA_TRY(end_curve(reader, error));
    if (reader->segment_count == 0)
        return ca_fail(error, CA_ERROR_FORMAT, &(ca_location){.file = reader->scan.where.file},
                       "the file has no curves");
    return CA_OK;
}

ca_status ca_import_curves(const char *path, ca_curve_degree degree, ca_curve **curve, ca_error *error)
{
    *curve = NULL;
    ca_bytes bytes;
    CA_TRY(ca_file_read(path, "curves", max_file_bytes, &bytes, error));
    curve_reader reader = {.scan = ca_scan_begin(path, (const char *)bytes.data, bytes.size), .degree = degree};
    ca_status status = read_lines(&reader, error);
    if (status == CA_OK) status = ca_curve_create(degree, reader.value_count / 4, reader.segment_count, curve, error);
    if (status == CA_OK) {
        memcpy((*curve)->points, reader.values, reader.value_count * sizeof *reader.values);
        memcpy((*curve)->segments, reader.segments, reader.segment_count * sizeof *reader.segments);
        (*curve)->content_hash = ca_hash_bytes(CA_HASH_START, bytes.data, bytes.size);
    }
    ca_free(reader.values);
    ca_free(reader.segments);
    ca_bytes_destroy(&bytes);
    return status;
}
