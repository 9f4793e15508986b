#include "import/gltf/json.h"

#include "base/text.h"

#include <stdio.h>
#include <string.h>

typedef struct json_reader {
    const char *cursor, *end, *line_start;
    const char *file;
    uint32_t line, values;
    bool has_places;
    ca_arena *arena;
    ca_error *error;
} json_reader;

static uint32_t column_of(const json_reader *r) { return (uint32_t)(r->cursor - r->line_start) + 1; }

static ca_status fail(const json_reader *r, const char *message)
{
    const ca_location where = {.file = r->file,
                               .line = r->has_places ? r->line : 0,
                               .column = r->has_places ? column_of(r) : 0};
    return ca_fail(r->error, CA_ERROR_FORMAT, &where, "this is not JSON: %s", message);
}

static void skip_space(json_reader *r)
{
    for (; r->cursor < r->end; r->cursor++) {
        const char c = *r->cursor;
        if (c != ' ' && c != '\t' && c != '\r' && c != '\n') return;
        if (c != '\n') continue;
        r->line++;
        r->line_start = r->cursor + 1;
    }
}

static bool is_next(const json_reader *r, char c) { return r->cursor < r->end && *r->cursor == c; }

/* ---- Strings --------------------------------------------------------------------------------------------------- */

static bool read_hex(json_reader *r, uint32_t *code)
{
    *code = 0;
    for (int i = 0; i < 4; i++, r->cursor++) {
        if (r->cursor == r->end) return false;
        const int digit = ca_hex_digit(*r->cursor);
        if (digit < 0) return false;
        *code = *code << 4 | (uint32_t)digit;
    }
    return true;
}

static size_t put_utf8(char *to, uint32_t code)
{
    if (code < 0x80) {
        to[0] = (char)code;
        return 1;
    }
    const size_t length = code < 0x800 ? 2 : code < 0x10000 ? 3 : 4;
    for (size_t i = length - 1; i > 0; i--, code >>= 6) to[i] = (char)(0x80 | (code & 0x3f));
    to[0] = (char)((0xf00u >> length & 0xff) | code);
    return length;
}

/* Behind "\u": one code, or two that are a surrogate pair. */
static bool read_unicode(json_reader *r, uint32_t *code)
{
    uint32_t low;
    if (!read_hex(r, code) || *code == 0) return false;
    if (*code < 0xd800 || *code > 0xdfff) return true;
    if (*code > 0xdbff || r->end - r->cursor < 2 || r->cursor[0] != '\\' || r->cursor[1] != 'u') return false;
    r->cursor += 2;
    if (!read_hex(r, &low) || low < 0xdc00 || low > 0xdfff) return false;
    *code = 0x10000 + ((*code - 0xd800) << 10) + (low - 0xdc00);
    return true;
}

/* The length of the UTF-8 sequence at the cursor; 0: it is none, or a control character. */
static size_t sequence_length(const json_reader *r)
{
    const unsigned char *c = (const unsigned char *)r->cursor;
    static const uint32_t least[5] = {0, 0x20, 0x80, 0x800, 0x10000};
    const size_t length = c[0] < 0x80 ? 1 : c[0] < 0xe0 ? 2 : c[0] < 0xf0 ? 3 : 4;
    if ((c[0] >= 0x80 && c[0] < 0xc2) || c[0] > 0xf4 || (size_t)(r->end - r->cursor) < length) return 0;
    uint32_t code = length == 1 ? c[0] : c[0] & (0x7fu >> length);
    for (size_t i = 1; i < length; i++) {
        if ((c[i] & 0xc0) != 0x80) return 0;
        code = code << 6 | (c[i] & 0x3f);
    }
    return code < least[length] || code > 0x10ffff || (code >= 0xd800 && code < 0xe000) ? 0 : length;
}

static ca_status read_escape(json_reader *r, char *to, size_t *length)
{
    static const char names[] = "\"\\/bfnrt", values[] = "\"\\/\b\f\n\r\t";
    const char *found = r->cursor < r->end && *r->cursor ? strchr(names, *r->cursor) : NULL;
    uint32_t code;
    if (found) {
        r->cursor++;
        to[(*length)++] = values[found - names];
        return CA_OK;
    }
    if (!is_next(r, 'u')) return fail(r, "an unknown escape in a string");
    r->cursor++;
    if (!read_unicode(r, &code)) return fail(r, "a wrong \\u in a string");
    *length += put_utf8(to + *length, code);
    return CA_OK;
}

/* No text is longer than what it is written as. */
static ca_status read_string(json_reader *r, const char **text)
{
    size_t length = 0;
    const char *quote = r->cursor + 1;
    while (quote < r->end && *quote != '"') quote += *quote == '\\' ? 2 : 1;
    if (quote >= r->end) return fail(r, "a string without end");
    char *made = ca_arena_alloc(r->arena, (size_t)(quote - r->cursor) + 4, 1);
    if (!made) return ca_fail_memory(r->error, r->file);
    for (r->cursor++; !is_next(r, '"');) {
        if (r->cursor >= r->end) return fail(r, "a string without end");
        if (*r->cursor == '\\') {
            r->cursor++;
            CA_TRY(read_escape(r, made, &length));
            continue;
        }
        const size_t bytes = sequence_length(r);
        if (bytes == 0) return fail(r, "a character that a string cannot have, or no UTF-8");
        memcpy(made + length, r->cursor, bytes);
        length += bytes;
        r->cursor += bytes;
    }
    r->cursor++;
    *text = made;
    return CA_OK;
}

/* ---- Values ---------------------------------------------------------------------------------------------------- */

static ca_status read_value(json_reader *r, ca_gltf_value *value, int depth);

static ca_status add_child(json_reader *r, ca_gltf_value *parent, ca_gltf_value **last, ca_gltf_value **child)
{
    if (++r->values > CA_GLTF_MAX_VALUES) return fail(r, "too many values");
    ca_gltf_value *made = *child = ca_arena_alloc(r->arena, 1, sizeof *made);
    if (!made) return ca_fail_memory(r->error, r->file);
    made->parent = parent;
    made->index = parent->count++;
    if (*last)
        (*last)->next = made;
    else
        parent->first = made;
    *last = made;
    return CA_OK;
}

static ca_status read_key(json_reader *r, ca_gltf_value *member)
{
    skip_space(r);
    if (!is_next(r, '"')) return fail(r, "expected a key in quotes");
    CA_TRY(read_string(r, &member->key));
    skip_space(r);
    if (!is_next(r, ':')) return fail(r, "expected a colon");
    r->cursor++;
    return CA_OK;
}

static ca_status index_items(json_reader *r, ca_gltf_value *array)
{
    array->items = ca_arena_alloc(r->arena, array->count, sizeof *array->items);
    if (!array->items) return ca_fail_memory(r->error, r->file);
    uint32_t i = 0;
    for (const ca_gltf_value *item = array->first; item; item = item->next) array->items[i++] = item;
    return CA_OK;
}

/* An object or an array. */
static ca_status read_children(json_reader *r, ca_gltf_value *value, int depth)
{
    const bool object = value->kind == CA_GLTF_OBJECT;
    const char end = object ? '}' : ']';
    ca_gltf_value *last = NULL, *child = NULL;
    if (depth == CA_GLTF_MAX_DEPTH) return fail(r, "values are nested too deep");
    r->cursor++;
    skip_space(r);
    for (bool more = !is_next(r, end); more;) {
        CA_TRY(add_child(r, value, &last, &child));
        if (!child) return CA_ERROR_MEMORY;
        if (object) CA_TRY(read_key(r, child));
        CA_TRY(read_value(r, child, depth + 1));
        skip_space(r);
        more = is_next(r, ',');
        if (!more && !is_next(r, end)) return fail(r, object ? "expected , or }" : "expected , or ]");
        if (more) r->cursor++;
    }
    r->cursor++;
    return object ? CA_OK : index_items(r, value);
}

/* JSON's numbers: no sign but -, no leading zero, digits on both sides of a point. */
static bool is_number(const char *text, size_t length)
{
    size_t i = length > 0 && text[0] == '-', digits = i;
    while (i < length && text[i] >= '0' && text[i] <= '9') i++;
    if (i == digits || (text[digits] == '0' && i > digits + 1)) return false;
    if (i < length && text[i] == '.') {
        digits = ++i;
        while (i < length && text[i] >= '0' && text[i] <= '9') i++;
        if (i == digits) return false;
    }
    if (i < length && (text[i] == 'e' || text[i] == 'E')) {
        i++;
        if (i < length && (text[i] == '+' || text[i] == '-')) i++;
        digits = i;
        while (i < length && text[i] >= '0' && text[i] <= '9') i++;
        if (i == digits) return false;
    }
    return i == length;
}

static ca_status read_word(json_reader *r, ca_gltf_value *value)
{
    size_t length = 0;
    while (r->cursor + length < r->end && !strchr(",]}: \t\r\n\"[{", r->cursor[length])) length++;
    const char *word = r->cursor;
    if (length == 4 && memcmp(word, "null", 4) == 0) {
        value->kind = CA_GLTF_NULL;
    } else if ((length == 4 && memcmp(word, "true", 4) == 0) || (length == 5 && memcmp(word, "false", 5) == 0)) {
        value->kind = CA_GLTF_BOOLEAN;
        value->number = length == 4;
    } else if (is_number(word, length) && ca_parse_number(word, length, &value->number)) {
        value->kind = CA_GLTF_NUMBER;
    } else {
        return fail(r, "expected a value");
    }
    r->cursor += length;
    return CA_OK;
}

static ca_status read_value(json_reader *r, ca_gltf_value *value, int depth)
{
    skip_space(r);
    value->line = r->has_places ? r->line : 0;
    value->column = r->has_places ? column_of(r) : 0;
    if (is_next(r, '"')) {
        value->kind = CA_GLTF_TEXT;
        return read_string(r, &value->text);
    }
    if (!is_next(r, '{') && !is_next(r, '[')) return read_word(r, value);
    value->kind = is_next(r, '{') ? CA_GLTF_OBJECT : CA_GLTF_ARRAY;
    return read_children(r, value, depth);
}

ca_status ca_gltf_parse(const char *text, size_t size, const char *file, bool has_places, ca_arena *arena,
                        const ca_gltf_value **root, ca_error *error)
{
    json_reader r = {.cursor = text, .end = text + size, .line_start = text, .file = file, .line = 1,
                     .has_places = has_places, .arena = arena, .error = error};
    ca_gltf_value *value = ca_arena_alloc(arena, 1, sizeof *value);
    *root = value;
    if (!value) return ca_fail_memory(error, file);
    CA_TRY(read_value(&r, value, 0));
    skip_space(&r);
    return r.cursor == r.end ? CA_OK : fail(&r, "something follows the value");
}

void ca_gltf_path(const ca_gltf_value *value, char *text, size_t size)
{
    const ca_gltf_value *chain[CA_GLTF_MAX_DEPTH + 2];
    size_t count = 0, used = 0;
    for (; value && value->parent && count < CA_GLTF_MAX_DEPTH; value = value->parent) chain[count++] = value;
    text[0] = '\0';
    while (count-- > 0 && used + 1 < size) {
        const ca_gltf_value *step = chain[count];
        const int length = step->key ? snprintf(text + used, size - used, "%s%.60s", used ? "." : "", step->key)
                                     : snprintf(text + used, size - used, "[%u]", step->index);
        used += (size_t)length;
    }
}
