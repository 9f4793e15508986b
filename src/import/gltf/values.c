#include "import/gltf/reader.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- Failures and places --------------------------------------------------------------------------------------- */

static ca_location place_of(const ca_gltf *g, const ca_gltf_value *value)
{
    return (ca_location){.file = g->importer->document.path,
                         .line = value ? value->line : 0,
                         .column = value ? value->column : 0};
}

void ca_gltf_fail(ca_gltf *g, const ca_gltf_value *value, const char *format, ...)
{
    char message[600], path[300];
    const ca_location where = place_of(g, value);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(message, sizeof message, format, arguments);
    va_end(arguments);
    ca_gltf_path(value, path, sizeof path);
    ca_import_fail(g->importer, &where, "%s%s%s", path, path[0] ? ": " : "", message);
}

void ca_gltf_note(ca_gltf *g, const ca_gltf_value *value, const char *format, ...)
{
    char message[600];
    const ca_location where = place_of(g, value);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(message, sizeof message, format, arguments);
    va_end(arguments);
    ca_import_note(g->importer, &where, "%s", message);
}

void ca_gltf_at(ca_gltf *g, const ca_gltf_value *value) { g->tree.where = place_of(g, value); }

void *ca_gltf_alloc(ca_gltf *g, size_t count, size_t size)
{
    void *memory = ca_arena_alloc(&g->importer->document.arena, count, size);
    if (!memory) ca_import_fail_memory(g->importer, "the scene");
    return memory;
}

const char *ca_gltf_format(ca_gltf *g, const char *format, ...)
{
    char text[256];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    const char *kept = ca_arena_strdup(&g->importer->document.arena, text);
    if (!kept) ca_import_fail_memory(g->importer, "the scene");
    return kept ? kept : "";
}

/* ---- Members --------------------------------------------------------------------------------------------------- */

static const char *const kind_names[] = {"null", "a boolean", "a number", "a text", "an array", "an object"};

const ca_gltf_value *ca_gltf_member(ca_gltf *g, const ca_gltf_value *object, const char *key)
{
    const ca_gltf_value *found = NULL;
    if (!object) return NULL;
    if (object->kind != CA_GLTF_OBJECT) {
        ca_gltf_fail(g, object, "must be an object, not %s", kind_names[object->kind]);
        return NULL;
    }
    if (object->count > CA_GLTF_MAX_MEMBERS) {
        ca_gltf_fail(g, object, "has more than %d members", CA_GLTF_MAX_MEMBERS);
        return NULL;
    }
    for (const ca_gltf_value *member = object->first; member; member = member->next) {
        if (strcmp(member->key, key) != 0) continue;
        if (found) ca_gltf_fail(g, member, "this key is given twice");
        found = member;
    }
    return found;
}

static const ca_gltf_value *member_of_kind(ca_gltf *g, const ca_gltf_value *object, const char *key,
                                           ca_gltf_kind kind)
{
    const ca_gltf_value *value = ca_gltf_member(g, object, key);
    if (!value || value->kind == kind) return value;
    ca_gltf_fail(g, value, "must be %s, not %s", kind_names[kind], kind_names[value->kind]);
    return NULL;
}

const ca_gltf_value *ca_gltf_object(ca_gltf *g, const ca_gltf_value *object, const char *key)
{
    return member_of_kind(g, object, key, CA_GLTF_OBJECT);
}

const ca_gltf_value *ca_gltf_array(ca_gltf *g, const ca_gltf_value *object, const char *key)
{
    return member_of_kind(g, object, key, CA_GLTF_ARRAY);
}

const ca_gltf_value *ca_gltf_extension(ca_gltf *g, const ca_gltf_value *object, const char *name)
{
    return ca_gltf_object(g, ca_gltf_object(g, object, "extensions"), name);
}

double ca_gltf_number(ca_gltf *g, const ca_gltf_value *object, const char *key, double fallback, double low,
                      double high)
{
    const ca_gltf_value *value = member_of_kind(g, object, key, CA_GLTF_NUMBER);
    if (!value) return fallback;
    if (value->number >= low && value->number <= high) return value->number;
    ca_gltf_fail(g, value, "is %g, and must lie in [%g, %g]", value->number, low, high);
    return fallback;
}

bool ca_gltf_boolean(ca_gltf *g, const ca_gltf_value *object, const char *key, bool fallback)
{
    const ca_gltf_value *value = member_of_kind(g, object, key, CA_GLTF_BOOLEAN);
    return value ? value->number != 0.0 : fallback;
}

const char *ca_gltf_text(ca_gltf *g, const ca_gltf_value *object, const char *key, const char *fallback)
{
    const ca_gltf_value *value = member_of_kind(g, object, key, CA_GLTF_TEXT);
    return value ? value->text : fallback;
}

static bool is_count(const ca_gltf_value *value)
{
    return value->number >= 0.0 && value->number <= 0x1p53 && value->number == floor(value->number);
}

uint64_t ca_gltf_count(ca_gltf *g, const ca_gltf_value *object, const char *key, uint64_t fallback)
{
    const ca_gltf_value *value = member_of_kind(g, object, key, CA_GLTF_NUMBER);
    if (!value) return fallback;
    if (is_count(value)) return (uint64_t)value->number;
    ca_gltf_fail(g, value, "is %g, and must be a whole number", value->number);
    return fallback;
}

bool ca_gltf_numbers(ca_gltf *g, const ca_gltf_value *object, const char *key, double *numbers, uint32_t count)
{
    const ca_gltf_value *value = ca_gltf_array(g, object, key);
    if (!value) return false;
    bool good = value->count == count;
    for (uint32_t i = 0; i < count && good; i++) good = value->items[i]->kind == CA_GLTF_NUMBER;
    if (!good) ca_gltf_fail(g, value, "must be %u numbers", count);
    for (uint32_t i = 0; i < count && good; i++) numbers[i] = value->items[i]->number;
    return good;
}

const ca_gltf_value *ca_gltf_table_of(ca_gltf *g, const char *name)
{
    for (size_t i = 0; i < g->table_count; i++)
        if (strcmp(g->tables[i].name, name) == 0) return g->tables[i].array;
    const ca_gltf_value *array = ca_gltf_array(g, g->root, name);
    if (g->table_count < CA_GLTF_MAX_TABLES) g->tables[g->table_count++] = (ca_gltf_table){name, array};
    return array;
}

uint32_t ca_gltf_table_size(ca_gltf *g, const char *table)
{
    const ca_gltf_value *array = ca_gltf_table_of(g, table);
    return array ? array->count : 0;
}

const ca_gltf_value *ca_gltf_reference(ca_gltf *g, const ca_gltf_value *object, const char *key, const char *table)
{
    const ca_gltf_value *value = member_of_kind(g, object, key, CA_GLTF_NUMBER);
    if (!value) return NULL;
    const ca_gltf_value *array = ca_gltf_table_of(g, table);
    if (!is_count(value) || !array || value->number >= array->count) {
        ca_gltf_fail(g, value, "is %.15g, and %s has %u elements", value->number, table, array ? array->count : 0);
        return NULL;
    }
    const ca_gltf_value *found = array->items[(uint32_t)value->number];
    if (found->kind == CA_GLTF_OBJECT) return found;
    ca_gltf_fail(g, found, "must be an object, not %s", kind_names[found->kind]);
    return NULL;
}
