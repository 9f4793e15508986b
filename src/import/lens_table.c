#include "import/lens_table.h"

#include "base/text.h"
#include "import/lens_glass.h"
#include "import/text_scan.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

typedef enum column { RADIUS, THICKNESS, INDEX, DIAMETER, GLASS, ABBE, SURFACE, COLUMNS } column;

static const char *const column_names[COLUMNS] = {"radius", "thickness", "index",  "diameter",
                                                  "glass",  "abbe",      "surface"};

/* An entry of the table; length 0: there is none. */
typedef struct entry {
    const char *text;
    size_t length;
    ca_location where;
} entry;

typedef struct lens_reader {
    ca_text_scan scan;
    const ca_location *element; /* to blame; NULL: the entry */
    column columns[COLUMNS];    /* of the table, from left to right */
    uint32_t column_count;
    entry row[COLUMNS]; /* by column */
    entry first;        /* of the row */
    ca_lens_table *table;
    ca_error *error;
} lens_reader;

/* ---- Entries --------------------------------------------------------------------------------------------------- */

static ca_status fail_at(const lens_reader *reader, const entry *e, const char *expected)
{
    const int shown = e->length < 32 ? (int)e->length : 32;
    return ca_fail(reader->error, CA_ERROR_FORMAT, reader->element ? reader->element : &e->where,
                   "surface %u of the lens: %s, not \"%.*s\"", reader->table->lens.count + 1, expected, shown,
                   e->text);
}

static bool is_word(const entry *e, const char *word)
{
    return strlen(word) == e->length && memcmp(e->text, word, e->length) == 0;
}

static bool is_separator(char c) { return c == ' ' || c == '\t' || c == '\r' || c == ','; }

/* The next entry of the row; false at its end. */
static bool next_entry(ca_text_scan *scan, entry *e)
{
    while (scan->cursor < scan->end && is_separator(*scan->cursor)) scan->cursor++;
    const char *start = scan->cursor;
    while (scan->cursor < scan->end && !is_separator(*scan->cursor) && !strchr(";#\n", *scan->cursor)) scan->cursor++;
    *e = (entry){.text = start, .length = (size_t)(scan->cursor - start), .where = ca_scan_place(scan, start)};
    return e->length > 0;
}

/* To the start of the next row; false at the end of the text. */
static bool next_row(ca_text_scan *scan)
{
    if (scan->cursor < scan->end && *scan->cursor == ';') {
        scan->cursor++;
        return true;
    }
    return ca_scan_next_line(scan);
}

/* ---- Header ---------------------------------------------------------------------------------------------------- */

static ca_status add_column(lens_reader *reader, const entry *e)
{
    for (uint32_t c = 0; c < COLUMNS; c++) {
        if (!is_word(e, column_names[c])) continue;
        for (uint32_t i = 0; i < reader->column_count; i++)
            if (reader->columns[i] == (column)c) return fail_at(reader, e, "each column has a name of its own");
        reader->columns[reader->column_count++] = (column)c;
        return CA_OK;
    }
    return fail_at(reader, e, "a column is radius, thickness, index, diameter, glass, abbe or surface");
}

static bool has_column(const lens_reader *reader, column c)
{
    for (uint32_t i = 0; i < reader->column_count; i++)
        if (reader->columns[i] == c) return true;
    return false;
}

static ca_status read_header(lens_reader *reader, entry first)
{
    entry e = first;
    do CA_TRY(add_column(reader, &e));
    while (next_entry(&reader->scan, &e));
    if (has_column(reader, RADIUS) && has_column(reader, THICKNESS) && has_column(reader, DIAMETER)) return CA_OK;
    return fail_at(reader, &first, "a header names radius, thickness and diameter");
}

static bool begins_number(const entry *e)
{
    return strchr("+-.0123456789", *e->text) != NULL || is_word(e, "inf") || is_word(e, "stop");
}

/* ---- Surfaces -------------------------------------------------------------------------------------------------- */

static ca_status read_row(lens_reader *reader, entry e)
{
    uint32_t count = 0;
    memset(reader->row, 0, sizeof reader->row);
    reader->first = e;
    do {
        if (count == reader->column_count) return fail_at(reader, &e, "expected the end of the row");
        if (!is_word(&e, "-")) reader->row[reader->columns[count]] = e;
        count++;
    } while (next_entry(&reader->scan, &e));
    return CA_OK;
}

/* A number in [low, high]. */
static ca_status read_number(const lens_reader *reader, column c, double low, double high, const char *expected,
                             double *value)
{
    const entry *e = &reader->row[c];
    if (e->length == 0) return fail_at(reader, &reader->first, expected);
    if (ca_parse_number(e->text, e->length, value) && *value >= low && *value <= high) return CA_OK;
    return fail_at(reader, e, expected);
}

static ca_status read_radius(const lens_reader *reader, ca_lens_surface *surface, bool *is_stop)
{
    const entry *e = &reader->row[RADIUS];
    surface->radius = 0.0;
    *is_stop = is_word(e, "stop");
    if (*is_stop || is_word(e, "inf")) return CA_OK;
    CA_TRY(read_number(reader, RADIUS, -1e7, 1e7, "expected a radius in mm, \"inf\" or \"stop\"", &surface->radius));
    *is_stop = surface->radius == 0.0;
    return CA_OK;
}

/* 517642, 517-642 or 517/642: nd = 1.517, Abbe number 64.2. */
static bool parse_glass(const entry *e, double *index)
{
    char digits[7] = {0};
    size_t count = 0;
    for (size_t i = 0; i < e->length; i++) {
        if (i == 3 && e->length == 7 && strchr("-/.", e->text[i])) continue;
        if (count == 6) return false;
        digits[count++] = e->text[i];
    }
    uint64_t code;
    if (count != 6 || !ca_parse_digits(digits, 6, 999999, &code)) return false;
    *index = 1.0 + (double)(code / 1000) / 1000.0;
    return true;
}

static ca_status read_glass(const lens_reader *reader, const entry *e, double *index)
{
    const ca_lens_glass *glass = ca_lens_glass_find(e->text, e->length);
    char expected[128];
    if (parse_glass(e, index)) return CA_OK;
    if (glass) {
        *index = glass->index;
        return CA_OK;
    }
    snprintf(expected, sizeof expected, "expected a glass such as 517642 or N-BK7 (the nearest is \"%s\")",
             ca_lens_glass_nearest(e->text, e->length));
    return fail_at(reader, e, expected);
}

/* Behind a surface; before: in front of it. */
static ca_status read_index(const lens_reader *reader, double before, bool is_stop, ca_lens_surface *surface)
{
    const entry *index = &reader->row[INDEX], *glass = &reader->row[GLASS];
    surface->index = is_stop ? before : 1.0;
    if (glass->length > 0) {
        if (index->length > 0) return fail_at(reader, glass, "expected either an index or a glass");
        CA_TRY(read_glass(reader, glass, &surface->index));
    } else if (index->length > 0 && !is_word(index, "air")) {
        double value;
        CA_TRY(read_number(reader, INDEX, 0.0, 5.0, "expected an index of refraction", &value));
        if (value != 0.0) surface->index = value; /* pbrt's stops have 0 */
        if (surface->index < 1.0) return fail_at(reader, index, "expected an index of refraction");
    }
    if (is_stop && surface->index != before)
        return fail_at(reader, &reader->row[RADIUS], "a stop does not refract (a plane's radius is \"inf\")");
    return CA_OK;
}

/* Only the last surface, in front of the film, may have none; then it is -1 until the table ends. */
static ca_status read_thickness(const lens_reader *reader, ca_lens_surface *surface)
{
    if (reader->table->lens.count > 0 && surface[-1].thickness < 0.0)
        return fail_at(reader, &reader->first, "the one before it needs a thickness");
    surface->thickness = -1.0;
    if (reader->row[THICKNESS].length == 0) return CA_OK;
    return read_number(reader, THICKNESS, 0.0, 1e5, "expected a thickness in mm", &surface->thickness);
}

static ca_status read_surface(lens_reader *reader)
{
    ca_lens *lens = &reader->table->lens;
    if (lens->count == CA_LENS_MAX_SURFACES) return fail_at(reader, &reader->first, "expected at most 64 surfaces");
    ca_lens_surface *surface = &lens->surfaces[lens->count];
    bool is_stop;
    double diameter, abbe;
    CA_TRY(read_radius(reader, surface, &is_stop));
    CA_TRY(read_thickness(reader, surface));
    CA_TRY(read_number(reader, DIAMETER, 1e-6, 1e5, "expected the aperture's diameter in mm", &diameter));
    CA_TRY(read_index(reader, lens->count > 0 ? lens->surfaces[lens->count - 1].index : 1.0, is_stop, surface));
    if (reader->row[ABBE].length > 0) CA_TRY(read_number(reader, ABBE, 1.0, 200.0, "expected an Abbe number", &abbe));
    surface->aperture = 0.5 * diameter;
    if (surface->radius != 0.0 && surface->aperture > fabs(surface->radius))
        return fail_at(reader, &reader->row[DIAMETER], "expected a diameter of at most twice the radius");
    if (is_stop) {
        reader->table->stop = lens->count;
        reader->table->stop_count++;
    }
    lens->count++;
    return CA_OK;
}

ca_status ca_import_lens(const char *file, const char *text, size_t size, const ca_location *where,
                         ca_lens_table *table, ca_error *error)
{
    lens_reader reader = {.scan = ca_scan_begin(file, text, size), .element = where, .table = table, .error = error};
    static const column without_header[] = {RADIUS, THICKNESS, INDEX, DIAMETER};
    *table = (ca_lens_table){0};
    do {
        entry e;
        if (!next_entry(&reader.scan, &e)) {
            if (*reader.scan.cursor == '#') reader.scan.cursor += strcspn(reader.scan.cursor, "\n");
            continue;
        }
        if (reader.column_count == 0 && !begins_number(&e)) {
            CA_TRY(read_header(&reader, e));
            continue;
        }
        if (reader.column_count == 0) {
            memcpy(reader.columns, without_header, sizeof without_header);
            reader.column_count = sizeof without_header / sizeof *without_header;
        }
        CA_TRY(read_row(&reader, e));
        CA_TRY(read_surface(&reader));
    } while (next_row(&reader.scan));
    const ca_location end = where ? *where : ca_scan_place(&reader.scan, reader.scan.cursor);
    if (table->lens.count == 0) return ca_fail(error, CA_ERROR_FORMAT, &end, "the lens has no surfaces");
    ca_lens_surface *last = &table->lens.surfaces[table->lens.count - 1];
    last->thickness = fmax(last->thickness, 0.0);
    if (last->index != 1.0)
        return ca_fail(error, CA_ERROR_FORMAT, &end, "behind the last surface of the lens there must be air");
    return CA_OK;
}
