#include "cli/json_document.h"

#include "base/file.h"
#include "base/hash.h"
#include "base/memory.h"
#include "base/text.h"
#include "cli/json_values.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { FILE_LIMIT = 64 << 20, FIELD_LIMIT = 32 };

struct ca_json {
    const char *path; /* borrowed */
    ca_bytes text;
    json_t *root;
};

ca_status ca_json_read(const char *path, const char *what, ca_json **document, ca_error *error)
{
    ca_json_begin();
    ca_json *made = *document = ca_alloc_zeroed(1, sizeof *made);
    if (!made) return ca_fail_memory(error, path);
    made->path = path;
    ca_status status = ca_file_read(path, what, FILE_LIMIT, &made->text, error);
    json_error_t reason;
    if (status == CA_OK) {
        made->root = json_loadb((const char *)made->text.data, made->text.size, JSON_REJECT_DUPLICATES, &reason);
        const ca_location where = {path, made->root || reason.line < 0 ? 0 : (uint32_t)reason.line,
                                   made->root || reason.column < 0 ? 0 : (uint32_t)reason.column};
        if (!made->root && json_error_code(&reason) == json_error_out_of_memory)
            status = ca_fail_memory(error, path);
        else if (!made->root)
            status = ca_fail(error, CA_ERROR_FORMAT, &where, "this is not JSON: %s", reason.text);
    }
    if (status == CA_OK) return CA_OK;
    ca_json_destroy(made);
    *document = NULL;
    return status;
}

void ca_json_destroy(ca_json *document)
{
    if (!document) return;
    json_decref(document->root);
    ca_bytes_destroy(&document->text);
    ca_free(document);
}

const ca_json_value *ca_json_root(const ca_json *document) { return document->root; }

uint64_t ca_json_hash(const ca_json *document)
{
    return ca_hash_bytes(CA_HASH_START, document->text.data, document->text.size);
}

/* ---- Places: the text is walked beside the values that came from it -------------------------------------------- */

/* What is looked for: a member or element of `parent`, or `parent` itself. jansson shares one value among all that
 * are true, false or null, so that these have no place of their own. */
typedef struct place {
    const json_t *parent;
    const char *key; /* NULL: element `index`, or parent itself where that is SIZE_MAX */
    size_t index;
    bool of_key;     /* where the key stands, not its value */
    const char *at;  /* in the text; moves on */
} place;

static void skip_space(place *p) { p->at += strspn(p->at, " \t\r\n"); }

static void skip_string(place *p)
{
    for (p->at++; *p->at != '"'; p->at++)
        if (*p->at == '\\') p->at++;
    p->at++;
}

/* jansson's iterators want an object that may change, and change nothing. */
static json_t *for_iterator(const json_t *object) { return (json_t *)(uintptr_t)object; }

static bool walk(place *p, const json_t *value);

static bool walk_object(place *p, const json_t *object)
{
    const char *key;
    json_t *value;
    json_object_foreach(for_iterator(object), key, value) {
        const bool wanted = object == p->parent && p->key && strcmp(key, p->key) == 0;
        p->at++; /* { or , */
        skip_space(p);
        if (wanted && p->of_key) return true;
        skip_string(p);
        skip_space(p);
        p->at++; /* : */
        skip_space(p);
        if (wanted || walk(p, value)) return true;
        skip_space(p);
    }
    return false;
}

static bool walk_array(place *p, const json_t *array)
{
    for (size_t i = 0; i < json_array_size(array); i++) {
        p->at++; /* [ or , */
        skip_space(p);
        if ((array == p->parent && !p->key && i == p->index) || walk(p, json_array_get(array, i))) return true;
        skip_space(p);
    }
    return false;
}

/* Moves behind the value; true: the place is found. */
static bool walk(place *p, const json_t *value)
{
    skip_space(p);
    if (value == p->parent && !p->key && p->index == SIZE_MAX) return true;
    if (json_is_string(value)) {
        skip_string(p);
    } else if (json_is_object(value) || json_is_array(value)) {
        if (json_is_object(value) ? walk_object(p, value) : walk_array(p, value)) return true;
        p->at += strcspn(p->at, "]}"); /* of an empty one there is space before the end */
        p->at++;
    } else {
        p->at += strcspn(p->at, ",]} \t\r\n");
    }
    return false;
}

static ca_location locate(const ca_json *document, place p)
{
    ca_location where = {document->path, 1, 1};
    p.at = (const char *)document->text.data;
    const char *start = p.at;
    walk(&p, document->root);
    for (const char *c = start; c < p.at; c++) {
        if (*c == '\n') {
            where.line++;
            where.column = 1;
        } else if (((unsigned char)*c & 0xc0) != 0x80) {
            where.column++;
        }
    }
    return where;
}

ca_status ca_json_fail(const ca_json *document, const ca_json_value *object, const char *key, ca_error *error,
                       const char *format, ...)
{
    const char *present = key && json_object_get(object, key) ? key : NULL;
    const ca_location where = locate(document, (place){.parent = object, .key = present, .index = SIZE_MAX});
    char text[512];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    return ca_fail(error, CA_ERROR_FORMAT, &where, "%s", text);
}

/* ---- Members --------------------------------------------------------------------------------------------------- */

static bool in_range(const ca_json_field *field, double value) { return value >= field->low && value <= field->high; }

/* Stores the value; false where it is of another kind or out of range. */
static bool store(const ca_json_field *field, const json_t *value, void *target)
{
    const double number = json_is_number(value) ? json_number_value(value) : (double)NAN;
    switch (field->kind) {
    case CA_JSON_TEXT:
    case CA_JSON_ANY_TEXT:
        *(const char **)target = json_string_value(value);
        if (!json_is_string(value) || strlen(json_string_value(value)) != json_string_length(value)) return false;
        return field->kind == CA_JSON_ANY_TEXT || json_string_length(value) > 0;
    case CA_JSON_NUMBER:
        *(double *)target = number;
        return in_range(field, number);
    case CA_JSON_COUNT:
        if (!json_is_integer(value) || !in_range(field, number)) return false;
        *(uint32_t *)target = (uint32_t)json_integer_value(value);
        return true;
    case CA_JSON_FLAG: *(bool *)target = json_is_true(value); return json_is_boolean(value);
    case CA_JSON_OBJECT: *(const json_t **)target = value; return json_is_object(value);
    case CA_JSON_LIST: *(const json_t **)target = value; return json_is_array(value);
    case CA_JSON_ANY: *(const json_t **)target = value; return true;
    }
    return false;
}

static ca_status fail_kind(const ca_json *document, const json_t *object, const ca_json_field *field, ca_error *error)
{
    char expected[96];
    static const char *const kinds[] = {
        [CA_JSON_TEXT] = "a text in quotes that is not empty", [CA_JSON_ANY_TEXT] = "a text in quotes",
        [CA_JSON_FLAG] = "true or false", [CA_JSON_OBJECT] = "an object { ... }", [CA_JSON_LIST] = "a list [ ... ]"};
    if (field->kind == CA_JSON_NUMBER || field->kind == CA_JSON_COUNT)
        snprintf(expected, sizeof expected, "a %s from %.10g to %.10g",
                 field->kind == CA_JSON_COUNT ? "whole number" : "number", field->low, field->high);
    else
        snprintf(expected, sizeof expected, "%s", kinds[field->kind]);
    return ca_json_fail(document, object, field->key, error, "\"%s\": expected %s", field->key, expected);
}

static ca_status fail_unknown(const ca_json *document, const json_t *object, const char *key, const char *what,
                              const ca_json_field *fields, size_t count, ca_error *error)
{
    const char *names[FIELD_LIMIT] = {NULL};
    for (size_t i = 0; i < count && i < FIELD_LIMIT; i++) names[i] = fields[i].key;
    const char *nearest = ca_nearest_name(key, names, count < FIELD_LIMIT ? count : FIELD_LIMIT);
    const ca_location where = locate(document, (place){.parent = object, .key = key, .of_key = true});
    if (nearest)
        return ca_fail(error, CA_ERROR_FORMAT, &where, "%s has no \"%.100s\"; did you mean \"%s\"?", what, key,
                       nearest);
    char list[512] = "";
    for (size_t i = 0; i < count; i++) {
        const size_t used = strlen(list);
        snprintf(list + used, sizeof list - used, "%s%s", i ? ", " : "", fields[i].key);
    }
    return ca_fail(error, CA_ERROR_FORMAT, &where, "%s has no \"%.100s\"; it has %s", what, key, list);
}

ca_status ca_json_fill(const ca_json *document, const ca_json_value *object, const char *what,
                       const ca_json_field *fields, size_t count, void *record, ca_error *error)
{
    if (!json_is_object(object))
        return ca_json_fail(document, object, NULL, error, "expected %s: an object { ... }", what);
    const char *key;
    json_t *value;
    json_object_foreach(for_iterator(object), key, value) {
        size_t i = 0;
        while (i < count && strcmp(fields[i].key, key) != 0) i++;
        if (i == count) return fail_unknown(document, object, key, what, fields, count, error);
        if (!store(&fields[i], value, (char *)record + fields[i].offset))
            return fail_kind(document, object, &fields[i], error);
    }
    for (size_t i = 0; i < count; i++)
        if (fields[i].needed && !json_object_get(object, fields[i].key))
            return ca_json_fail(document, object, NULL, error, "%s needs \"%s\"", what, fields[i].key);
    return CA_OK;
}

size_t ca_json_size(const ca_json_value *list)
{
    return json_is_array(list) ? json_array_size(list) : json_object_size(list);
}

ca_status ca_json_object_at(const ca_json *document, const ca_json_value *list, size_t index, const char *what,
                            const ca_json_value **object, ca_error *error)
{
    *object = json_array_get(list, index);
    if (json_is_object(*object)) return CA_OK;
    const ca_location where = locate(document, (place){.parent = list, .index = index});
    return ca_fail(error, CA_ERROR_FORMAT, &where, "expected %s: an object { ... }", what);
}

ca_status ca_json_text_member(const ca_json *document, const ca_json_value *object, size_t index, const char **key,
                              const char **text, ca_error *error)
{
    void *member = json_object_iter(for_iterator(object));
    while (index-- > 0) member = json_object_iter_next(for_iterator(object), member);
    *key = json_object_iter_key(member);
    *text = json_string_value(json_object_iter_value(member));
    if (*text) return CA_OK;
    return ca_json_fail(document, object, *key, error, "\"%.100s\": expected a text in quotes", *key);
}
