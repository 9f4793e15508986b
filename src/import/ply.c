/* PLY meshes: ascii and both binary forms, packed by gzip or not.
 *
 * vertex: x y z; nx ny nz; u v, s t or texture_u texture_v; r g b (a) or red green blue (alpha) as "vertex_color".
 * face: vertex_indices or vertex_index; the list texcoord, u and v of each corner; colours as "face_color". Further
 * numbers become attributes named as Mitsuba 3 does (src/shapes/ply.cpp): neighbours NAME_x NAME_y NAME_z (w),
 * NAME_0.., NAME_1.. are one attribute vertex_NAME, and NAME_r NAME_g NAME_b (a) one vertex_NAME_color; a number
 * alone is vertex_NAME. Integer colours count from 0 to the largest of their type and are sRGB encoded, as there;
 * other integers stay what they are. Elements of other names are skipped. */
#include "import/ply.h"

#include "base/hash.h"
#include "base/loading.h"
#include "image/image.h"
#include "import/import.h"
#include "import/inflate.h"

#include <stdio.h>
#include <string.h>

static const size_t max_file_bytes = (size_t)1 << 34;

typedef struct ply_reader {
    ca_text_scan scan; /* for binary files only the cursor counts behind the header */
    const char *data;  /* start of the file */
    ca_ply_header header;
    ca_mesh *mesh;
    uint32_t *indices;
    size_t index_count, index_capacity;
    ca_mesh faces;          /* the attributes of whole faces, before polygons become triangles; no geometry */
    uint32_t *corner_counts; /* of each face, where there are attributes of faces or texcoord lists */
    float *face_uvs;         /* of texcoord lists: of all corners, face by face */
    size_t face_uv_count, face_uv_capacity; /* numbers */
} ply_reader;

/* A place in the data, for messages: line and column, or byte, element and row. */
static ca_status fail_data(const ply_reader *reader, const ca_ply_element *element, uint64_t row,
                           const char *expected, ca_error *error)
{
    if (reader->header.format == CA_PLY_ASCII) {
        const ca_location where = ca_scan_place(&reader->scan, reader->scan.cursor);
        return ca_fail(error, CA_ERROR_FORMAT, &where, "expected %s (%s %llu)", expected, element->name,
                       (unsigned long long)row);
    }
    const ca_location where = {.file = reader->scan.where.file};
    return ca_fail(error, CA_ERROR_FORMAT, &where, "expected %s at byte %zu (%s %llu)", expected,
                   (size_t)(reader->scan.cursor - reader->data), element->name, (unsigned long long)row);
}

/* ---- numbers --------------------------------------------------------------------------------------------------- */

static double binary_number(const unsigned char *p, ca_ply_type type, bool big_endian)
{
    const size_t size = ca_ply_type_size(type);
    uint64_t bits = 0;
    for (size_t i = 0; i < size; ++i) bits |= (uint64_t)p[big_endian ? size - 1 - i : i] << (8 * i);
    float single;
    double value;
    const uint32_t low = (uint32_t)bits;
    switch (type) {
    case CA_PLY_INT8: return (double)(int8_t)bits;
    case CA_PLY_INT16: return (double)(int16_t)bits;
    case CA_PLY_INT32: return (double)(int32_t)bits;
    case CA_PLY_UINT8:
    case CA_PLY_UINT16:
    case CA_PLY_UINT32: return (double)bits;
    case CA_PLY_FLOAT32: memcpy(&single, &low, sizeof single); return (double)single;
    case CA_PLY_FLOAT64: memcpy(&value, &bits, sizeof value); return value;
    }
    return 0.0;
}

static ca_status next_number(ply_reader *reader, const ca_ply_element *element, uint64_t row, const char *name,
                             ca_ply_type type, double *value, ca_error *error)
{
    ca_text_scan *scan = &reader->scan;
    if (reader->header.format == CA_PLY_ASCII) {
        ca_scan_skip_space(scan);
        return ca_scan_number(scan, name, value, error);
    }
    const size_t size = ca_ply_type_size(type);
    if ((size_t)(scan->end - scan->cursor) < size) return fail_data(reader, element, row, "more data", error);
    *value = binary_number((const unsigned char *)scan->cursor, type, reader->header.format == CA_PLY_BIG_ENDIAN);
    scan->cursor += size;
    return CA_OK;
}

/* The length of a list, at most what the rest of the file can hold. */
static ca_status next_length(ply_reader *reader, const ca_ply_element *element, uint64_t row,
                             const ca_ply_property *property, size_t *length, ca_error *error)
{
    double value;
    CA_TRY(next_number(reader, element, row, property->name, property->count_type, &value, error));
    const size_t left = (size_t)(reader->scan.end - reader->scan.cursor);
    const size_t item = reader->header.format == CA_PLY_ASCII ? 1 : ca_ply_type_size(property->type);
    /* The range first: outside of it, and for what is not a number, the conversion would be undefined. */
    if (!(value >= 0.0 && value <= (double)(left / item)) || value != (double)(size_t)value)
        return fail_data(reader, element, row, "the length of a list that fits in the file", error);
    *length = (size_t)value;
    return CA_OK;
}

static ca_status skip_list(ply_reader *reader, const ca_ply_element *element, uint64_t row,
                           const ca_ply_property *property, ca_error *error)
{
    size_t length;
    double value;
    CA_TRY(next_length(reader, element, row, property, &length, error));
    for (size_t i = 0; i < length; ++i)
        CA_TRY(next_number(reader, element, row, property->name, property->type, &value, error));
    return CA_OK;
}

static ca_status read_scalar(ply_reader *reader, const ca_ply_element *element, uint64_t row,
                             const ca_ply_property *property, ca_error *error)
{
    double value;
    CA_TRY(next_number(reader, element, row, property->name, property->type, &value, error));
    if (!property->target) return CA_OK;
    const float scaled = (float)value * property->scale;
    property->target[row * property->stride] = property->decode_srgb ? ca_srgb_to_linear(scaled) : scaled;
    return CA_OK;
}

/* Every row takes at least this many bytes, so a count in the header is no reason to take more memory than the file
 * can fill. In ascii, the last number of the file has no separator behind it. */
static ca_status check_count(const ply_reader *reader, const ca_ply_element *element, ca_error *error)
{
    uint64_t row_bytes = 0;
    for (size_t i = 0; i < element->property_count; ++i) {
        const ca_ply_property *property = &element->properties[i];
        const ca_ply_type first = property->is_list ? property->count_type : property->type;
        row_bytes += reader->header.format == CA_PLY_ASCII ? 2 : ca_ply_type_size(first);
    }
    const uint64_t left = (uint64_t)(reader->scan.end - reader->scan.cursor) + 1;
    if (element->count == 0 || (row_bytes > 0 && element->count <= left / row_bytes)) return CA_OK;
    return ca_fail(error, CA_ERROR_FORMAT, &element->where, "%llu times \"%s\" do not fit in the file",
                   (unsigned long long)element->count, element->name);
}

/* ---- what the properties mean ---------------------------------------------------------------------------------- */

static bool is_integer(const ca_ply_property *property) { return property->type < CA_PLY_FLOAT32; }

/* Binds all of names[0, count) to consecutive floats of each row, or none of them. */
static bool bind_all(const ca_ply_element *element, const char *const *names, uint32_t count, float *target)
{
    for (uint32_t i = 0; i < count; ++i) {
        const ca_ply_property *property = ca_ply_find_property(element, names[i]);
        if (!property || property->is_list) return false;
    }
    for (uint32_t i = 0; target && i < count; ++i) {
        ca_ply_property *property = ca_ply_find_property(element, names[i]);
        property->target = target + i;
        property->stride = count;
    }
    return true;
}

static void normalize_color(ca_ply_property *property, bool alpha)
{
    static const float largest[] = {127.0f, 255.0f, 32767.0f, 65535.0f, 2147483647.0f, 4294967295.0f};
    if (!is_integer(property)) return;
    property->scale = 1.0f / largest[property->type];
    property->decode_srgb = !alpha;
}

static ca_status add_attribute(ca_mesh *mesh, const char *name, uint32_t components, bool per_face,
                               const ca_location *where, float **values, ca_error *error)
{
    if (ca_mesh_find_attribute(mesh, name))
        return ca_fail(error, CA_ERROR_FORMAT, where, "two groups of properties make the attribute \"%s\"", name);
    return ca_mesh_add_attribute(mesh, name, components, per_face, values, error);
}

static ca_status bind_colors(const ca_ply_element *element, ca_mesh *mesh, bool per_face, ca_error *error)
{
    static const char *const sets[2][4] = {{"r", "g", "b", "a"}, {"red", "green", "blue", "alpha"}};
    for (int i = 0; i < 2; ++i) {
        if (!bind_all(element, sets[i], 3, NULL)) continue;
        const uint32_t components = bind_all(element, sets[i], 4, NULL) ? 4 : 3;
        float *values;
        CA_TRY(add_attribute(mesh, per_face ? "face_color" : "vertex_color", components, per_face, &element->where,
                             &values, error));
        bind_all(element, sets[i], components, values);
        for (uint32_t c = 0; c < components; ++c)
            normalize_color(ca_ply_find_property(element, sets[i][c]), c == 3);
        return CA_OK;
    }
    return CA_OK;
}

/* Splits "NAME_x" into the length of NAME and the column of x in the endings of Mitsuba's groups; false for
 * others. */
static bool split_name(const char *name, uint32_t level, size_t *prefix, int *column)
{
    static const char endings[4][5] = {"xr01", "yg12", "zb23", "wa34"};
    const char *underscore = strrchr(name, '_');
    if (!underscore || underscore == name || strlen(underscore) != 2) return false;
    const char *found = strchr(endings[level], underscore[1]);
    if (!found) return false;
    *prefix = (size_t)(underscore - name);
    *column = (int)(found - endings[level]);
    return true;
}

/* How many of the properties from `first` on are one attribute: 1 to 4. */
static uint32_t group_length(const ca_ply_element *element, size_t first, size_t *prefix, int *column)
{
    const char *name = element->properties[first].name;
    if (!split_name(name, 0, prefix, column)) return 1;
    uint32_t length = 1;
    for (; length < 4 && first + length < element->property_count; ++length) {
        const ca_ply_property *next = &element->properties[first + length];
        size_t next_prefix = 0;
        const char *ending = strrchr(next->name, '_');
        int next_column = -1;
        if (next->is_list || next->target || !ending || !split_name(next->name, length, &next_prefix, &next_column))
            break;
        if (next_prefix != *prefix || next_column != *column || memcmp(next->name, name, *prefix) != 0) break;
    }
    return length;
}

static ca_status bind_others(const ca_ply_element *element, ca_mesh *mesh, bool per_face, ca_error *error)
{
    enum { COLOR_COLUMN = 1 };
    for (size_t i = 0; i < element->property_count;) {
        ca_ply_property *property = &element->properties[i];
        if (property->target || property->is_list) {
            ++i;
            continue;
        }
        size_t prefix = strlen(property->name);
        int column = -1;
        const uint32_t components = group_length(element, i, &prefix, &column);
        char name[256]; /* names of properties have at most 200 characters */
        snprintf(name, sizeof name, "%s_%.*s%s", per_face ? "face" : "vertex", (int)prefix, property->name,
                 column == COLOR_COLUMN ? "_color" : "");
        float *values;
        CA_TRY(add_attribute(mesh, name, components, per_face, &property->where, &values, error));
        for (uint32_t c = 0; c < components; ++c) {
            property[c].target = values + c;
            property[c].stride = components;
            if (column == COLOR_COLUMN && components >= 3) normalize_color(&property[c], c == 3);
        }
        i += components;
    }
    return CA_OK;
}

/* ---- elements -------------------------------------------------------------------------------------------------- */

/* All but two, which may be NULL. */
static ca_status refuse_lists(const ca_ply_element *element, const ca_ply_property *but,
                              const ca_ply_property *but_also, ca_error *error)
{
    for (size_t i = 0; i < element->property_count; ++i) {
        const ca_ply_property *property = &element->properties[i];
        if (property->is_list && property != but && property != but_also)
            return ca_fail(error, CA_ERROR_UNSUPPORTED, &property->where, "lists \"%s\" of \"%s\" are not read",
                           property->name, element->name);
    }
    return CA_OK;
}

static ca_status bind_vertices(ply_reader *reader, const ca_ply_element *element, ca_error *error)
{
    static const char *const position[] = {"x", "y", "z"}, *const normal[] = {"nx", "ny", "nz"};
    static const char *const uv_names[3][2] = {{"u", "v"}, {"texture_u", "texture_v"}, {"s", "t"}};
    if (!bind_all(element, position, 3, NULL))
        return ca_fail(error, CA_ERROR_FORMAT, &element->where, "expected properties x, y and z of \"vertex\"");
    const bool normals = bind_all(element, normal, 3, NULL);
    int uv = 0;
    while (uv < 3 && !bind_all(element, uv_names[uv], 2, NULL)) uv++;
    CA_TRY(ca_mesh_create(reader->mesh, element->count, 0, normals, uv < 3, error));
    bind_all(element, position, 3, reader->mesh->positions);
    if (normals) bind_all(element, normal, 3, reader->mesh->normals);
    if (uv < 3) bind_all(element, uv_names[uv], 2, reader->mesh->uvs);
    CA_TRY(bind_colors(element, reader->mesh, false, error));
    return bind_others(element, reader->mesh, false, error);
}

/* Now and then, how far that is; and whether it is still wanted. */
static ca_status tell_place(const ply_reader *reader, uint64_t row, ca_error *error)
{
    if (row % 65536 != 0) return CA_OK;
    ca_loading_tell((double)(reader->scan.cursor - reader->data) / (double)(reader->scan.end - reader->data));
    return ca_loading_check(error);
}

static ca_status read_vertices(ply_reader *reader, const ca_ply_element *element, ca_error *error)
{
    CA_TRY(refuse_lists(element, NULL, NULL, error));
    CA_TRY(bind_vertices(reader, element, error));
    for (uint64_t row = 0; row < element->count; ++row) {
        CA_TRY(tell_place(reader, row, error));
        for (size_t i = 0; i < element->property_count; ++i)
            CA_TRY(read_scalar(reader, element, row, &element->properties[i], error));
    }
    return CA_OK;
}

/* A polygon as a fan around its first corner. */
static ca_status read_polygon(ply_reader *reader, const ca_ply_element *element, uint64_t row,
                              const ca_ply_property *property, ca_error *error)
{
    size_t length;
    CA_TRY(next_length(reader, element, row, property, &length, error));
    if (length < 3) return fail_data(reader, element, row, "a face of at least three corners", error);
    uint32_t *indices = ca_array_grow(reader->indices, &reader->index_capacity,
                                      reader->index_count + 3 * (length - 2), sizeof *indices);
    if (!indices) return ca_fail_memory(error, reader->scan.where.file);
    reader->indices = indices;
    uint32_t first = 0, last = 0;
    for (size_t i = 0; i < length; ++i) {
        double value;
        CA_TRY(next_number(reader, element, row, property->name, property->type, &value, error));
        if (!(value >= 0.0 && value <= (double)UINT32_MAX) || value != (double)(uint32_t)value)
            return fail_data(reader, element, row, "the index of a vertex", error);
        const uint32_t vertex = (uint32_t)value;
        if (i >= 2) {
            uint32_t *corners = reader->indices + reader->index_count;
            corners[0] = first;
            corners[1] = last;
            corners[2] = vertex;
            reader->index_count += 3;
        }
        if (i == 0) first = vertex;
        last = vertex;
    }
    if (reader->corner_counts) reader->corner_counts[row] = (uint32_t)length;
    return CA_OK;
}

/* u and v of each corner of the face. */
static ca_status read_texcoords(ply_reader *reader, const ca_ply_element *element, uint64_t row,
                                const ca_ply_property *property, ca_error *error)
{
    size_t length;
    CA_TRY(next_length(reader, element, row, property, &length, error));
    float *uvs =
        ca_array_grow(reader->face_uvs, &reader->face_uv_capacity, reader->face_uv_count + length, sizeof *uvs);
    if (!uvs) return ca_fail_memory(error, reader->scan.where.file);
    reader->face_uvs = uvs;
    for (size_t i = 0; i < length; ++i) {
        double value;
        CA_TRY(next_number(reader, element, row, property->name, property->type, &value, error));
        uvs[reader->face_uv_count++] = (float)value;
    }
    return CA_OK;
}

/* Both lists of a face may come first: their lengths are compared behind them. */
static ca_status check_texcoords(const ply_reader *reader, const ca_ply_element *element, uint64_t row,
                                 size_t count_before, ca_error *error)
{
    if (reader->face_uv_count - count_before == 2 * (size_t)reader->corner_counts[row]) return CA_OK;
    return fail_data(reader, element, row, "two numbers in \"texcoord\" for each corner of the face", error);
}

static ca_status read_face(ply_reader *reader, const ca_ply_element *element, uint64_t row,
                           const ca_ply_property *list, const ca_ply_property *texcoords, ca_error *error)
{
    const size_t uvs_before = reader->face_uv_count;
    for (size_t i = 0; i < element->property_count; ++i) {
        const ca_ply_property *property = &element->properties[i];
        if (property == list)
            CA_TRY(read_polygon(reader, element, row, property, error));
        else if (property == texcoords)
            CA_TRY(read_texcoords(reader, element, row, property, error));
        else
            CA_TRY(read_scalar(reader, element, row, property, error));
    }
    return texcoords ? check_texcoords(reader, element, row, uvs_before, error) : CA_OK;
}

static ca_status read_faces(ply_reader *reader, const ca_ply_element *element, ca_error *error)
{
    const ca_ply_property *list = ca_ply_find_property(element, "vertex_indices");
    if (!list) list = ca_ply_find_property(element, "vertex_index");
    if (!list || !list->is_list)
        return ca_fail(error, CA_ERROR_FORMAT, &element->where, "expected a list vertex_indices of \"face\"");
    const ca_ply_property *texcoords = ca_ply_find_property(element, "texcoord");
    CA_TRY(refuse_lists(element, list, texcoords, error));
    if (texcoords && !texcoords->is_list) texcoords = NULL;
    if (element->count > UINT32_MAX / 4)
        return ca_fail(error, CA_ERROR_UNSUPPORTED, &element->where, "too many faces");
    reader->faces.triangle_count = (uint32_t)element->count;
    CA_TRY(bind_colors(element, &reader->faces, true, error));
    CA_TRY(bind_others(element, &reader->faces, true, error));
    if (reader->faces.attribute_count > 0 || texcoords) {
        reader->corner_counts = ca_alloc(element->count, sizeof *reader->corner_counts);
        if (!reader->corner_counts) return ca_fail_memory(error, reader->scan.where.file);
    }
    for (uint64_t row = 0; row < element->count; ++row) {
        CA_TRY(tell_place(reader, row, error));
        CA_TRY(read_face(reader, element, row, list, texcoords, error));
    }
    return CA_OK;
}

static ca_status skip_element(ply_reader *reader, const ca_ply_element *element, ca_error *error)
{
    for (uint64_t row = 0; row < element->count; ++row) {
        CA_TRY(tell_place(reader, row, error));
        for (size_t i = 0; i < element->property_count; ++i) {
            const ca_ply_property *property = &element->properties[i];
            CA_TRY(property->is_list ? skip_list(reader, element, row, property, error)
                                     : read_scalar(reader, element, row, property, error));
        }
    }
    return CA_OK;
}

/* Each triangle of a polygon gets the polygon's values. */
static ca_status spread_face_attributes(const ply_reader *reader, ca_error *error)
{
    for (uint32_t a = 0; a < reader->faces.attribute_count; ++a) {
        const ca_mesh_attribute *source = &reader->faces.attributes[a];
        const size_t bytes = source->components * sizeof(float);
        float *target;
        CA_TRY(ca_mesh_add_attribute(reader->mesh, source->name, source->components, true, &target, error));
        for (size_t face = 0; face < reader->faces.triangle_count; ++face)
            for (uint32_t k = 2; k < reader->corner_counts[face]; ++k, target += source->components)
                memcpy(target, source->values + face * source->components, bytes);
    }
    return CA_OK;
}

/* The coordinates of each triangle's corners, from those of the polygons' fans. */
static ca_status spread_texcoords(const ply_reader *reader, ca_error *error)
{
    float *uvs = ca_alloc((size_t)reader->mesh->triangle_count, 6 * sizeof *uvs), *target = uvs;
    if (!uvs) return ca_fail_memory(error, reader->scan.where.file);
    const float *face = reader->face_uvs;
    for (size_t f = 0; f < reader->faces.triangle_count; ++f) {
        for (uint32_t k = 2; k < reader->corner_counts[f]; ++k, target += 6) {
            memcpy(target, face, 2 * sizeof *face);
            memcpy(target + 2, face + 2 * (size_t)(k - 1), 4 * sizeof *face);
        }
        face += 2 * (size_t)reader->corner_counts[f];
    }
    const ca_status status = ca_mesh_set_corner_uvs(reader->mesh, uvs, error);
    ca_free(uvs);
    return status == CA_OK ? ca_mesh_validate(reader->mesh, reader->scan.where.file, error) : status;
}

static ca_status finish(ply_reader *reader, ca_error *error)
{
    ca_mesh *mesh = reader->mesh;
    const size_t triangles = reader->index_count / 3;
    if (triangles > (size_t)1 << 30)
        return ca_fail(error, CA_ERROR_UNSUPPORTED, &reader->scan.where, "too many faces");
    if (triangles > 0) {
        ca_free(mesh->indices);
        mesh->indices = reader->indices;
        reader->indices = NULL;
    }
    mesh->triangle_count = (uint32_t)triangles;
    CA_TRY(spread_face_attributes(reader, error));
    CA_TRY(ca_mesh_validate(mesh, reader->scan.where.file, error));
    if (reader->face_uv_count > 0) {
        if (!mesh->normals) CA_TRY(ca_mesh_compute_normals(mesh, 0, error)); /* smooth across seams of the texture */
        CA_TRY(spread_texcoords(reader, error));
    }
    ca_mesh_normalize_normals(mesh);
    return CA_OK;
}

static ca_status read_file(ply_reader *reader, ca_error *error)
{
    CA_TRY(ca_ply_read_header(&reader->scan, &reader->header, error));
    for (size_t i = 0; i < reader->header.element_count; ++i) {
        const ca_ply_element *element = &reader->header.elements[i];
        CA_TRY(check_count(reader, element, error));
        if (strcmp(element->name, "vertex") == 0)
            CA_TRY(read_vertices(reader, element, error));
        else if (strcmp(element->name, "face") == 0)
            CA_TRY(read_faces(reader, element, error));
        else
            CA_TRY(skip_element(reader, element, error));
    }
    ca_scan_skip_space(&reader->scan);
    if (reader->scan.cursor != reader->scan.end) {
        const ca_location where = {.file = reader->scan.where.file};
        return ca_fail(error, CA_ERROR_FORMAT, &where,
                       "expected the end of the file at byte %zu: the header counts less",
                       (size_t)(reader->scan.cursor - reader->data));
    }
    return finish(reader, error);
}

ca_status ca_import_ply(const char *path, ca_mesh *mesh, ca_error *error)
{
    *mesh = (ca_mesh){0};
    ca_bytes bytes;
    CA_TRY(ca_read_inflated(path, "mesh", max_file_bytes, &bytes, error));
    const char *data = (const char *)bytes.data;
    ply_reader reader = {.scan = ca_scan_begin(path, data, bytes.size), .data = data, .mesh = mesh};
    const ca_status status = read_file(&reader, error);
    if (status == CA_OK)
        mesh->content_hash = ca_hash_bytes(CA_HASH_START, bytes.data, bytes.size);
    else
        ca_mesh_destroy(mesh);
    ca_mesh_destroy(&reader.faces);
    ca_free(reader.corner_counts);
    ca_free(reader.face_uvs);
    ca_free(reader.indices);
    ca_ply_header_destroy(&reader.header);
    ca_bytes_destroy(&bytes);
    return status;
}
