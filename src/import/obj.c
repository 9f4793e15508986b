/* Wavefront OBJ: v (with colours "v x y z r g b"), vt, vn and f; groups, objects, smoothing and material lines belong
 * to no mesh of ours and are skipped; free-form curves and surfaces are refused.
 *
 * One vertex of the mesh is one distinct (v, vt, vn) of the faces, in order of appearance. Where only some corners
 * have a vn, the others get the smooth normal that a file without any would get; corners without vt get uv (0, 0);
 * positions without a colour, where others have one, are white. */
#include "base/file.h"
#include "base/hash.h"
#include "base/loading.h"
#include "base/memory.h"
#include "import/import.h"
#include "import/text_scan.h"

#include <string.h>

static const size_t max_file_bytes = (size_t)1 << 34;

typedef struct float_list {
    float *values;
    size_t count, capacity; /* in floats */
} float_list;

typedef struct obj_corner {
    uint32_t v, vt, vn; /* from 0; CA_NONE: not given */
} obj_corner;

typedef struct obj_reader {
    ca_text_scan scan;
    const char *data; /* start of the file */
    float_list positions, colors, uvs, normals;
    obj_corner *corners; /* distinct, one for each vertex of the mesh */
    size_t corner_count, corner_capacity;
    uint32_t *indices;
    size_t index_count, index_capacity;
    uint32_t *table; /* hash of a corner -> its place in `corners`, or CA_NONE; the size is a power of two */
    size_t table_size;
    bool any_color, any_uv, any_normal;
} obj_reader;

static void destroy_reader(obj_reader *reader)
{
    ca_free(reader->positions.values);
    ca_free(reader->colors.values);
    ca_free(reader->uvs.values);
    ca_free(reader->normals.values);
    ca_free(reader->corners);
    ca_free(reader->indices);
    ca_free(reader->table);
}

static bool append(float_list *list, const float *values, size_t count)
{
    float *grown = ca_array_grow(list->values, &list->capacity, list->count + count, sizeof *grown);
    if (!grown) return false;
    list->values = grown;
    memcpy(list->values + list->count, values, count * sizeof *values);
    list->count += count;
    return true;
}

static ca_status fail_at(const obj_reader *reader, const char *at, const char *expected, ca_error *error)
{
    const ca_location where = ca_scan_place(&reader->scan, at);
    return ca_fail(error, CA_ERROR_FORMAT, &where, "expected %s", expected);
}

/* A comment ends a line too. */
static bool line_ends(obj_reader *reader) { return ca_scan_line_ends(&reader->scan) || *reader->scan.cursor == '#'; }

/* The numbers up to the end of the line: at least `least`, at most `most`. */
static ca_status read_numbers(obj_reader *reader, const char *what, size_t least, size_t most, float *values,
                              size_t *count, ca_error *error)
{
    *count = 0;
    while (!line_ends(reader)) {
        if (*count == most) return fail_at(reader, reader->scan.cursor, "the end of the line", error);
        double value;
        CA_TRY(ca_scan_number(&reader->scan, what, &value, error));
        values[(*count)++] = (float)value;
    }
    return *count < least ? fail_at(reader, reader->scan.cursor, what, error) : CA_OK;
}

/* x y z, perhaps with a weight (which only free-form surfaces use) or with r g b. */
static ca_status read_position(obj_reader *reader, ca_error *error)
{
    static const float white[3] = {1.0f, 1.0f, 1.0f};
    float values[7];
    size_t count;
    CA_TRY(read_numbers(reader, "a position of three numbers", 3, 7, values, &count, error));
    if (count == 5)
        return fail_at(reader, reader->scan.cursor, "a position, alone or with a colour of three numbers", error);
    const bool coloured = count >= 6;
    reader->any_color |= coloured;
    bool stored = true;
    while (stored && reader->any_color && reader->colors.count < reader->positions.count)
        stored = append(&reader->colors, white, 3);
    stored = stored && append(&reader->positions, values, 3);
    if (reader->any_color) stored = stored && append(&reader->colors, coloured ? values + count - 3 : white, 3);
    return stored ? CA_OK : ca_fail_memory(error, reader->scan.where.file);
}

static ca_status read_uv(obj_reader *reader, ca_error *error)
{
    float values[3] = {0};
    size_t count;
    CA_TRY(read_numbers(reader, "a texture coordinate of one to three numbers", 1, 3, values, &count, error));
    return append(&reader->uvs, values, 2) ? CA_OK : ca_fail_memory(error, reader->scan.where.file);
}

static ca_status read_normal(obj_reader *reader, ca_error *error)
{
    float values[3];
    size_t count;
    CA_TRY(read_numbers(reader, "a normal of three numbers", 3, 3, values, &count, error));
    return append(&reader->normals, values, 3) ? CA_OK : ca_fail_memory(error, reader->scan.where.file);
}

/* An index counts from 1, a negative one from the last element backwards; so far there are `count`. */
static ca_status read_index(obj_reader *reader, size_t count, const char *what, uint32_t *index, ca_error *error)
{
    ca_text_scan *scan = &reader->scan;
    const char *start = scan->cursor;
    const bool negative = *scan->cursor == '-';
    if (negative) scan->cursor++;
    if (*scan->cursor < '0' || *scan->cursor > '9') return fail_at(reader, start, "an index", error);
    uint64_t number = 0;
    for (; *scan->cursor >= '0' && *scan->cursor <= '9'; scan->cursor++)
        if (number <= UINT32_MAX) number = 10 * number + (uint64_t)(*scan->cursor - '0');
    if (number == 0 || number > count) {
        const ca_location where = ca_scan_place(scan, start);
        return ca_fail(error, CA_ERROR_FORMAT, &where, "there is no %s %.*s: %zu are defined up to here", what,
                       (int)(scan->cursor - start < 32 ? scan->cursor - start : 32), start, count);
    }
    *index = (uint32_t)(negative ? count - number : number - 1);
    return CA_OK;
}

/* v, v/vt, v//vn or v/vt/vn */
static ca_status read_corner(obj_reader *reader, obj_corner *corner, ca_error *error)
{
    const char **cursor = &reader->scan.cursor;
    *corner = (obj_corner){.vt = CA_NONE, .vn = CA_NONE};
    CA_TRY(read_index(reader, reader->positions.count / 3, "position", &corner->v, error));
    if (**cursor == '/') {
        ++*cursor;
        if (**cursor != '/')
            CA_TRY(read_index(reader, reader->uvs.count / 2, "texture coordinate", &corner->vt, error));
        if (**cursor == '/') {
            ++*cursor;
            CA_TRY(read_index(reader, reader->normals.count / 3, "normal", &corner->vn, error));
        }
    }
    reader->any_uv |= corner->vt != CA_NONE;
    reader->any_normal |= corner->vn != CA_NONE;
    const char *after = *cursor;
    const bool ended = ca_scan_line_ends(&reader->scan) || *cursor != after;
    return ended ? CA_OK : fail_at(reader, after, "a space or \"/\" behind an index", error);
}

static size_t hash_corner(const obj_corner *corner)
{
    uint64_t h = corner->v * UINT64_C(0x9e3779b97f4a7c15);
    h = (h ^ (h >> 32) ^ corner->vt) * UINT64_C(0xbf58476d1ce4e5b9);
    h = (h ^ (h >> 29) ^ corner->vn) * UINT64_C(0x94d049bb133111eb);
    return (size_t)(h ^ (h >> 32));
}

/* Where the corner is in the table, or the free place for it. */
static uint32_t *table_place(const obj_reader *reader, const obj_corner *corner)
{
    size_t place = hash_corner(corner) & (reader->table_size - 1);
    while (reader->table[place] != CA_NONE) {
        const obj_corner *other = &reader->corners[reader->table[place]];
        if (other->v == corner->v && other->vt == corner->vt && other->vn == corner->vn) break;
        place = (place + 1) & (reader->table_size - 1);
    }
    return &reader->table[place];
}

/* Keeps the table at most half full. */
static bool grow_table(obj_reader *reader)
{
    if (2 * (reader->corner_count + 1) <= reader->table_size) return true;
    const size_t size = reader->table_size ? 2 * reader->table_size : 1024;
    uint32_t *table = ca_alloc(size, sizeof *table);
    if (!table) return false;
    for (size_t i = 0; i < size; ++i) table[i] = CA_NONE;
    ca_free(reader->table);
    reader->table = table;
    reader->table_size = size;
    for (size_t i = 0; i < reader->corner_count; ++i) *table_place(reader, &reader->corners[i]) = (uint32_t)i;
    return true;
}

/* The mesh vertex of a corner. */
static bool vertex_of(obj_reader *reader, const obj_corner *corner, uint32_t *vertex)
{
    if (!grow_table(reader)) return false;
    uint32_t *place = table_place(reader, corner);
    if (*place == CA_NONE) {
        obj_corner *corners =
            ca_array_grow(reader->corners, &reader->corner_capacity, reader->corner_count + 1, sizeof *corners);
        if (!corners) return false;
        reader->corners = corners;
        if (reader->corner_count >= CA_NONE) return false;
        reader->corners[reader->corner_count] = *corner;
        *place = (uint32_t)reader->corner_count++;
    }
    *vertex = *place;
    return true;
}

static bool add_triangle(obj_reader *reader, uint32_t a, uint32_t b, uint32_t c)
{
    uint32_t *indices =
        ca_array_grow(reader->indices, &reader->index_capacity, reader->index_count + 3, sizeof *indices);
    if (!indices) return false;
    reader->indices = indices;
    uint32_t *corners = reader->indices + reader->index_count;
    corners[0] = a;
    corners[1] = b;
    corners[2] = c;
    reader->index_count += 3;
    return true;
}

static ca_status read_face(obj_reader *reader, ca_error *error)
{
    uint32_t first = 0, last = 0;
    size_t count = 0;
    for (; !line_ends(reader); ++count) {
        obj_corner corner;
        uint32_t vertex;
        CA_TRY(read_corner(reader, &corner, error));
        if (!vertex_of(reader, &corner, &vertex)) return ca_fail_memory(error, reader->scan.where.file);
        if (count >= 2 && !add_triangle(reader, first, last, vertex))
            return ca_fail_memory(error, reader->scan.where.file);
        if (count == 0) first = vertex;
        last = vertex;
    }
    return count < 3 ? fail_at(reader, reader->scan.cursor, "a face of at least three corners", error) : CA_OK;
}

/* Lines that say nothing about the triangles. */
static bool is_skipped(const char *word, size_t length)
{
    static const char *const skipped[] = {"g",     "o",       "s",        "mg",       "usemtl",     "mtllib",
                                          "l",     "p",       "usemap",   "maplib",   "lod",        "bevel",
                                          "ctech", "stech",   "c_interp", "d_interp", "shadow_obj", "trace_obj"};
    for (size_t i = 0; i < sizeof skipped / sizeof *skipped; ++i)
        if (strlen(skipped[i]) == length && memcmp(skipped[i], word, length) == 0) return true;
    return false;
}

static ca_status read_line(obj_reader *reader, ca_error *error)
{
    const char *word;
    const size_t length = ca_scan_word(&reader->scan, &word);
    if (length == 0 || word[0] == '#') return CA_OK;
    if (length == 1 && word[0] == 'v') return read_position(reader, error);
    if (length == 1 && word[0] == 'f') return read_face(reader, error);
    if (length == 2 && word[0] == 'v' && word[1] == 't') return read_uv(reader, error);
    if (length == 2 && word[0] == 'v' && word[1] == 'n') return read_normal(reader, error);
    if (is_skipped(word, length)) {
        while (!ca_scan_line_ends(&reader->scan))
            ca_scan_word(&reader->scan, &word); /* and the lines it goes on for */
        return CA_OK;
    }
    const ca_location where = ca_scan_place(&reader->scan, word);
    return ca_fail(error, CA_ERROR_FORMAT, &where, "\"%.*s\" is not an OBJ statement that is read (v, vt, vn, f)",
                   (int)(length < 32 ? length : 32), word);
}

static ca_status fill_mesh(const obj_reader *reader, ca_mesh *mesh, ca_error *error)
{
    memcpy(mesh->indices, reader->indices, reader->index_count * sizeof *mesh->indices);
    float *colors = NULL;
    if (reader->any_color) CA_TRY(ca_mesh_add_attribute(mesh, "vertex_color", 3, false, &colors, error));
    bool all_normals = true;
    for (size_t i = 0; i < reader->corner_count; ++i) {
        const obj_corner *corner = &reader->corners[i];
        const size_t v = 3 * (size_t)corner->v;
        memcpy(mesh->positions + 3 * i, reader->positions.values + v, 3 * sizeof(float));
        if (colors) memcpy(colors + 3 * i, reader->colors.values + v, 3 * sizeof(float));
        if (corner->vt != CA_NONE)
            memcpy(mesh->uvs + 2 * i, reader->uvs.values + 2 * (size_t)corner->vt, 2 * sizeof(float));
        all_normals &= corner->vn != CA_NONE;
    }
    if (!mesh->normals) return CA_OK;
    if (!all_normals) CA_TRY(ca_mesh_compute_normals(mesh, 0, error));
    for (size_t i = 0; i < reader->corner_count; ++i)
        if (reader->corners[i].vn != CA_NONE)
            memcpy(mesh->normals + 3 * i, reader->normals.values + 3 * (size_t)reader->corners[i].vn,
                   3 * sizeof(float));
    ca_mesh_normalize_normals(mesh);
    return CA_OK;
}

/* Now and then, how far that is; and whether it is still wanted. */
static ca_status tell_place(const obj_reader *reader, ca_error *error)
{
    if (reader->scan.where.line % 65536 != 1) return CA_OK;
    ca_loading_tell((double)(reader->scan.cursor - reader->data) / (double)(reader->scan.end - reader->data));
    return ca_loading_check(error);
}

static ca_status read_file(obj_reader *reader, ca_mesh *mesh, ca_error *error)
{
    if (reader->scan.cursor < reader->scan.end) do {
            CA_TRY(tell_place(reader, error));
            CA_TRY(read_line(reader, error));
        } while (ca_scan_next_line(&reader->scan));
    if (reader->index_count == 0)
        return ca_fail(error, CA_ERROR_FORMAT, &(ca_location){.file = reader->scan.where.file},
                       "the mesh has no faces");
    CA_TRY(ca_mesh_create(mesh, reader->corner_count, reader->index_count / 3, reader->any_normal, reader->any_uv,
                          error));
    CA_TRY(fill_mesh(reader, mesh, error));
    return ca_mesh_validate(mesh, reader->scan.where.file, error);
}

ca_status ca_import_obj(const char *path, ca_mesh *mesh, ca_error *error)
{
    *mesh = (ca_mesh){0};
    ca_bytes bytes;
    CA_TRY(ca_file_read(path, "mesh", max_file_bytes, &bytes, error));
    const char *data = (const char *)bytes.data;
    obj_reader reader = {.scan = ca_scan_begin(path, data, bytes.size), .data = data};
    const ca_status status = read_file(&reader, mesh, error);
    if (status == CA_OK)
        mesh->content_hash = ca_hash_bytes(CA_HASH_START, bytes.data, bytes.size);
    else
        ca_mesh_destroy(mesh);
    destroy_reader(&reader);
    ca_bytes_destroy(&bytes);
    return status;
}
