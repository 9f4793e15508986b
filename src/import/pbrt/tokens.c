#include "import/pbrt/tokens.h"

#include "base/loading.h"
#include "base/text.h"

#include <string.h>

ca_pbrt_scan ca_pbrt_scan_begin(const char *file, const char *text, size_t size, ca_arena *arena)
{
    const char *start = text + ca_byte_order_mark(text, size);
    return (ca_pbrt_scan){
        .cursor = start, .end = text + size, .line_start = start, .line = 1, .file = file, .arena = arena};
}

static bool is_space(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == '\f' || c == '\v'; }

static bool ends_word(char c) { return is_space(c) || c == '"' || c == '[' || c == ']' || c == '#'; }

static void skip_space(ca_pbrt_scan *scan)
{
    bool comment = false;
    for (; scan->cursor < scan->end; scan->cursor++) {
        const char c = *scan->cursor;
        if (c == '#') comment = true;
        if (!comment && !is_space(c)) return;
        if (c != '\n') continue;
        comment = false;
        scan->line++;
        scan->line_start = scan->cursor + 1;
    }
}

static ca_location place(const ca_pbrt_scan *scan)
{
    return (ca_location){
        .file = scan->file, .line = scan->line, .column = (uint32_t)(scan->cursor - scan->line_start) + 1};
}

/* NUL where there is none. */
static char unescape(char c)
{
    static const char from[] = "bfnrt\\'\"", to[] = "\b\f\n\r\t\\'\"";
    const char *found = c ? strchr(from, c) : NULL;
    return found ? to[found - from] : '\0';
}

/* The cursor stands behind the opening quote. */
static ca_status read_string(ca_pbrt_scan *scan, ca_pbrt_token *token, ca_error *error)
{
    const char *close = scan->cursor;
    while (close < scan->end && *close != '"' && *close != '\n') close += *close == '\\' ? 2 : 1;
    if (close >= scan->end || *close != '"')
        return ca_fail(error, CA_ERROR_FORMAT, &token->where, "this string has no end on its line");
    char *text = ca_arena_alloc(scan->arena, (size_t)(close - scan->cursor) + 1, 1);
    if (!text) return ca_fail_memory(error, scan->file);
    size_t length = 0;
    for (const char *c = scan->cursor; c < close; c++) {
        text[length] = *c == '\\' ? unescape(*++c) : *c;
        if (text[length++] == '\0')
            return ca_fail(error, CA_ERROR_FORMAT, &token->where, "this string has an unknown escape or a zero byte");
    }
    token->kind = CA_PBRT_STRING;
    token->text = text;
    token->length = length;
    scan->cursor = close + 1;
    return CA_OK;
}

static ca_status scan_token(ca_pbrt_scan *scan, ca_pbrt_token *token, ca_error *error)
{
    skip_space(scan);
    *token = (ca_pbrt_token){.kind = CA_PBRT_END, .text = scan->cursor, .where = place(scan)};
    if (scan->cursor == scan->end) return CA_OK;
    const char first = *scan->cursor;
    if (first == '[' || first == ']') {
        token->kind = first == '[' ? CA_PBRT_OPEN : CA_PBRT_CLOSE;
        token->length = 1;
        scan->cursor++;
        return CA_OK;
    }
    if (first == '"') {
        scan->cursor++;
        return read_string(scan, token, error);
    }
    while (scan->cursor < scan->end && !ends_word(*scan->cursor)) scan->cursor++;
    token->kind = CA_PBRT_WORD;
    token->length = (size_t)(scan->cursor - token->text);
    return CA_OK;
}

ca_status ca_pbrt_next(ca_pbrt_scan *scan, ca_pbrt_token *token, ca_error *error)
{
    CA_TRY(ca_loading_check(error));
    if (!scan->has_ahead) return scan_token(scan, token, error);
    *token = scan->ahead;
    scan->has_ahead = false;
    return CA_OK;
}

ca_status ca_pbrt_peek(ca_pbrt_scan *scan, ca_pbrt_token *token, ca_error *error)
{
    if (!scan->has_ahead) CA_TRY(scan_token(scan, &scan->ahead, error));
    scan->has_ahead = true;
    *token = scan->ahead;
    return CA_OK;
}

bool ca_pbrt_is_word(const ca_pbrt_token *token, const char *word)
{
    return token->kind == CA_PBRT_WORD && token->length == strlen(word) &&
           memcmp(token->text, word, token->length) == 0;
}

bool ca_pbrt_text_has_word(const char *text, size_t size, const char *word)
{
    const size_t length = strlen(word);
    const char *end = text + size;
    bool comment = false, string = false;
    for (const char *c = text; c < end; c++) {
        if (*c == '\n') comment = string = false;
        if (string && *c == '\\')
            c++;
        else if (*c == '"' && !comment)
            string = !string;
        else if (*c == '#' && !string)
            comment = true;
        else if (!comment && !string && *c == word[0] && (size_t)(end - c) >= length &&
                 memcmp(c, word, length) == 0 && (c == text || ends_word(c[-1])) &&
                 (c + length == end || ends_word(c[length])))
            return true;
    }
    return false;
}
