#include "import/substitution.h"

#include "base/text.h"

#include <string.h>

static bool is_name_char(char c)
{
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
}

static size_t name_length(const char *text)
{
    size_t length = 0;
    while (is_name_char(text[length])) length++;
    return length;
}

static ca_definition *find(ca_definitions *definitions, const char *name, size_t length)
{
    for (size_t i = 0; i < definitions->count; i++) {
        ca_definition *item = &definitions->items[i];
        if (strncmp(item->name, name, length) == 0 && item->name[length] == '\0') return item;
    }
    return NULL;
}

/* The nearest of the defined names; `but` is skipped (NULL: none). */
static const char *nearest(const ca_definitions *definitions, const char *name, const ca_definition *but)
{
    const char *names[CA_DOCUMENT_MAX_DEFAULTS];
    for (size_t i = 0; i < definitions->count; i++)
        names[i] = &definitions->items[i] == but || !definitions->items[i].known ? NULL : definitions->items[i].name;
    return ca_nearest_name_however_far(name, names, definitions->count);
}

ca_status ca_definitions_start(ca_definitions *definitions, const ca_define *defines, size_t count, ca_error *error)
{
    definitions->count = 0;
    for (size_t i = 0; i < count; i++) {
        const size_t length = name_length(defines[i].name);
        if (length == 0 || defines[i].name[length] != '\0')
            return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                           "-D %s=%s: a name has letters, digits and underscores only", defines[i].name,
                           defines[i].value);
        ca_definition *item = find(definitions, defines[i].name, length);
        if (!item) {
            if (definitions->count == CA_DOCUMENT_MAX_DEFAULTS)
                return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "more than %d definitions", CA_DOCUMENT_MAX_DEFAULTS);
            item = &definitions->items[definitions->count++];
        }
        *item = (ca_definition){.name = defines[i].name, .value = defines[i].value};
    }
    return CA_OK;
}

ca_status ca_definitions_add_default(ca_definitions *definitions, const ca_xml_node *node, ca_error *error)
{
    const char *name = ca_xml_attribute_value(node, "name");
    const size_t length = name_length(name);
    if (length == 0 || name[length] != '\0')
        return ca_fail(error, CA_ERROR_SCENE, &node->where,
                       "\"%s\" is no name for a default: it has letters, digits and underscores only", name);
    ca_definition *item = find(definitions, name, length);
    if (item) {
        item->known = true; /* the first default counts, and the command line before any */
        return CA_OK;
    }
    if (definitions->count == CA_DOCUMENT_MAX_DEFAULTS)
        return ca_fail(error, CA_ERROR_SCENE, &node->where, "more than %d defaults", CA_DOCUMENT_MAX_DEFAULTS);
    definitions->items[definitions->count++] =
        (ca_definition){.name = name, .value = ca_xml_attribute_value(node, "value"), .known = true};
    return CA_OK;
}

ca_status ca_definitions_check_known(const ca_definitions *definitions, ca_error *error)
{
    for (size_t i = 0; i < definitions->count; i++) {
        const ca_definition *item = &definitions->items[i];
        if (item->known) continue;
        const char *other = nearest(definitions, item->name, item);
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "-D %s=%s: the scene has no default of that name%s%s",
                       item->name, item->value, other ? "; the nearest is " : "", other ? other : "");
    }
    return CA_OK;
}

typedef struct text_buffer {
    char *text;
    size_t length, capacity;
} text_buffer;

static bool append(text_buffer *buffer, const char *text, size_t length)
{
    if (length > CA_DOCUMENT_MAX_VALUE - buffer->length) return false;
    char *grown = ca_array_grow(buffer->text, &buffer->capacity, buffer->length + length + 1, 1);
    if (!grown) return false;
    buffer->text = grown;
    memcpy(buffer->text + buffer->length, text, length);
    buffer->length += length;
    buffer->text[buffer->length] = '\0';
    return true;
}

static ca_status fail_append(const text_buffer *buffer, size_t more, const ca_xml_node *node, ca_error *error)
{
    if (more > CA_DOCUMENT_MAX_VALUE - buffer->length)
        return ca_fail(error, CA_ERROR_SCENE, &node->where, "a value of more than %d bytes", CA_DOCUMENT_MAX_VALUE);
    return ca_fail_memory(error, "a parameter's value");
}

static ca_status append_value(ca_definitions *definitions, text_buffer *buffer, const char *name, size_t length,
                              const ca_xml_node *node, ca_error *error)
{
    ca_definition *item = length > 0 ? find(definitions, name, length) : NULL;
    if (!item) {
        char wrong[64];
        const size_t shown = length < sizeof wrong - 1 ? length : sizeof wrong - 1;
        memcpy(wrong, name, shown);
        wrong[shown] = '\0';
        const char *other = nearest(definitions, wrong, NULL);
        return ca_fail(error, CA_ERROR_SCENE, &node->where, "$%s is not defined%s%s", wrong,
                       other ? "; the nearest known name is $" : " (write \\$ for a plain $)", other ? other : "");
    }
    item->known = true;
    const size_t value_length = strlen(item->value);
    return append(buffer, item->value, value_length) ? CA_OK : fail_append(buffer, value_length, node, error);
}

static ca_status expand(ca_definitions *definitions, text_buffer *buffer, const char *text, const ca_xml_node *node,
                        ca_error *error)
{
    while (*text) {
        const bool escaped = text[0] == '\\' && text[1] == '$';
        if (*text == '$') {
            const size_t length = name_length(text + 1);
            CA_TRY(append_value(definitions, buffer, text + 1, length, node, error));
            text += 1 + length;
            continue;
        }
        size_t plain = escaped ? 1 : strcspn(text + 1, "\\$") + 1;
        if (escaped) text++;
        if (!append(buffer, text, plain)) return fail_append(buffer, plain, node, error);
        text += plain;
    }
    return CA_OK;
}

ca_status ca_definitions_substitute(ca_definitions *definitions, ca_xml_node *node, ca_arena *arena, ca_error *error)
{
    for (uint32_t i = 0; i < node->attribute_count; i++) {
        if (!strchr(node->attributes[i].value, '$')) continue;
        text_buffer buffer = {0};
        ca_status status = expand(definitions, &buffer, node->attributes[i].value, node, error);
        if (status == CA_OK) {
            node->attributes[i].value = ca_arena_strdup(arena, buffer.text ? buffer.text : "");
            if (!node->attributes[i].value) status = ca_fail_memory(error, "a parameter's value");
        }
        ca_free(buffer.text);
        if (status != CA_OK) return status;
    }
    return CA_OK;
}
