#include "import/ply.h"

#include "import/number.h"

#include <string.h>

size_t ca_ply_type_size(ca_ply_type type)
{
    static const size_t sizes[] = {1, 1, 2, 2, 4, 4, 4, 8};
    return sizes[type];
}

void ca_ply_header_destroy(ca_ply_header *header)
{
    for (size_t i = 0; i < header->element_count; ++i) ca_free(header->elements[i].properties);
    ca_free(header->elements);
    ca_arena_clear(&header->names);
    *header = (ca_ply_header){0};
}

ca_ply_property *ca_ply_find_property(const ca_ply_element *element, const char *name)
{
    for (size_t i = 0; i < element->property_count; ++i)
        if (strcmp(element->properties[i].name, name) == 0) return &element->properties[i];
    return NULL;
}

typedef struct word {
    const char *text;
    size_t length;
    ca_location where;
} word;

static word next_word(ca_text_scan *scan)
{
    word result;
    result.length = ca_scan_word(scan, &result.text);
    result.where = ca_scan_place(scan, result.text);
    return result;
}

static bool is_word(const word *w, const char *text)
{
    return strlen(text) == w->length && memcmp(text, w->text, w->length) == 0;
}

static ca_status fail_expected(const word *w, const char *expected, ca_error *error)
{
    return ca_fail(error, CA_ERROR_FORMAT, &w->where, "expected %s in the PLY header, not \"%.*s\"", expected,
                   (int)(w->length < 32 ? w->length : 32), w->text);
}

static bool parse_type(const word *w, ca_ply_type *type)
{
    static const struct {
        const char *name;
        ca_ply_type type;
    } types[] = {
        {"char", CA_PLY_INT8},       {"int8", CA_PLY_INT8},     {"uchar", CA_PLY_UINT8},   {"uint8", CA_PLY_UINT8},
        {"short", CA_PLY_INT16},     {"int16", CA_PLY_INT16},   {"ushort", CA_PLY_UINT16}, {"uint16", CA_PLY_UINT16},
        {"int", CA_PLY_INT32},       {"int32", CA_PLY_INT32},   {"uint", CA_PLY_UINT32},   {"uint32", CA_PLY_UINT32},
        {"float", CA_PLY_FLOAT32},   {"float32", CA_PLY_FLOAT32}, {"double", CA_PLY_FLOAT64},
        {"float64", CA_PLY_FLOAT64},
    };
    for (size_t i = 0; i < sizeof types / sizeof *types; ++i)
        if (is_word(w, types[i].name)) {
            *type = types[i].type;
            return true;
        }
    return false;
}

static ca_status read_type(ca_text_scan *scan, ca_ply_type *type, ca_error *error)
{
    const word w = next_word(scan);
    return parse_type(&w, type) ? CA_OK : fail_expected(&w, "a type (char to uint, float, double)", error);
}

static ca_status read_name(ca_text_scan *scan, ca_arena *names, const char **name, ca_error *error)
{
    enum { LONGEST_NAME = 200 };
    const word w = next_word(scan);
    if (w.length == 0 || w.length > LONGEST_NAME) return fail_expected(&w, "a name", error);
    char *copy = ca_arena_alloc(names, w.length + 1, 1);
    if (!copy) return ca_fail_memory(error, scan->where.file);
    memcpy(copy, w.text, w.length);
    *name = copy;
    return CA_OK;
}

static ca_status read_format(ca_text_scan *scan, ca_ply_format *format, ca_error *error)
{
    static const char *const names[] = {"ascii", "binary_little_endian", "binary_big_endian"};
    const word name = next_word(scan), version = next_word(scan);
    int i = 0;
    while (i < 3 && !is_word(&name, names[i])) i++;
    if (i == 3) return fail_expected(&name, "ascii, binary_little_endian or binary_big_endian", error);
    if (!is_word(&version, "1.0")) return fail_expected(&version, "version 1.0", error);
    *format = (ca_ply_format)i;
    return CA_OK;
}

static ca_status read_element(ca_text_scan *scan, const word *keyword, ca_ply_header *header, ca_error *error)
{
    ca_ply_element *elements =
        ca_array_grow(header->elements, &header->element_capacity, header->element_count + 1, sizeof *elements);
    if (!elements) return ca_fail_memory(error, scan->where.file);
    header->elements = elements;
    ca_ply_element element = {.where = keyword->where};
    CA_TRY(read_name(scan, &header->names, &element.name, error));
    for (size_t i = 0; i < header->element_count; ++i)
        if (strcmp(header->elements[i].name, element.name) == 0)
            return ca_fail(error, CA_ERROR_FORMAT, &keyword->where, "the element \"%s\" is there twice",
                           element.name);
    const word count = next_word(scan);
    int64_t value;
    if (!ca_parse_integer(count.text, count.length, &value) || value < 0)
        return fail_expected(&count, "a count", error);
    element.count = (uint64_t)value;
    header->elements[header->element_count++] = element;
    return CA_OK;
}

static ca_status read_property(ca_text_scan *scan, const word *keyword, ca_ply_header *header, ca_error *error)
{
    if (header->element_count == 0) return fail_expected(keyword, "an element before its properties", error);
    ca_ply_element *element = &header->elements[header->element_count - 1];
    ca_ply_property *properties = ca_array_grow(element->properties, &element->property_capacity,
                                                element->property_count + 1, sizeof *properties);
    if (!properties) return ca_fail_memory(error, scan->where.file);
    element->properties = properties;

    ca_ply_property property = {.where = keyword->where, .scale = 1.0f};
    const word type = next_word(scan);
    property.is_list = is_word(&type, "list");
    if (property.is_list) {
        CA_TRY(read_type(scan, &property.count_type, error));
        if (property.count_type >= CA_PLY_FLOAT32)
            return fail_expected(&type, "a list whose length is an integer", error);
        CA_TRY(read_type(scan, &property.type, error));
    } else if (!parse_type(&type, &property.type)) {
        return fail_expected(&type, "a type (char to uint, float, double) or list", error);
    }
    CA_TRY(read_name(scan, &header->names, &property.name, error));
    if (ca_ply_find_property(element, property.name))
        return ca_fail(error, CA_ERROR_FORMAT, &keyword->where, "the property \"%s\" of \"%s\" is there twice",
                       property.name, element->name);
    element->properties[element->property_count++] = property;
    return CA_OK;
}

ca_status ca_ply_read_header(ca_text_scan *scan, ca_ply_header *header, ca_error *error)
{
    *header = (ca_ply_header){0};
    word keyword = next_word(scan);
    if (!is_word(&keyword, "ply")) return fail_expected(&keyword, "\"ply\"", error);
    bool format_known = false;
    while (ca_scan_next_line(scan)) {
        keyword = next_word(scan);
        if (keyword.length == 0 || is_word(&keyword, "comment") || is_word(&keyword, "obj_info")) continue;
        if (is_word(&keyword, "end_header")) {
            if (!format_known) return fail_expected(&keyword, "a line \"format\"", error);
            if (!ca_scan_line_ends(scan))
                return fail_expected(&keyword, "a line of its own for \"end_header\"", error);
            ca_scan_next_line(scan);
            return CA_OK;
        }
        if (is_word(&keyword, "format")) {
            CA_TRY(read_format(scan, &header->format, error));
            format_known = true;
        } else if (is_word(&keyword, "element")) {
            CA_TRY(read_element(scan, &keyword, header, error));
        } else if (is_word(&keyword, "property")) {
            CA_TRY(read_property(scan, &keyword, header, error));
        } else {
            return fail_expected(&keyword, "format, comment, element, property or end_header", error);
        }
        if (!ca_scan_line_ends(scan)) {
            keyword = next_word(scan);
            return fail_expected(&keyword, "the end of the line", error);
        }
    }
    return ca_fail(error, CA_ERROR_FORMAT, &scan->where, "the PLY header has no line \"end_header\"");
}
