#include "import/text_scan.h"

#include "base/text.h"
#include "import/number.h"

#include <math.h>
#include <string.h>

ca_text_scan ca_scan_begin(const char *file, const char *text, size_t size)
{
    const char *start = text + ca_byte_order_mark(text, size);
    return (ca_text_scan){
        .cursor = start, .end = text + size, .line_start = start, .where = {.file = file, .line = 1, .column = 1}};
}

static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }

static void start_line(ca_text_scan *scan, const char *start)
{
    scan->cursor = scan->line_start = start;
    scan->where.line++;
}

void ca_scan_skip_blanks(ca_text_scan *scan)
{
    for (;;) {
        while (scan->cursor < scan->end && is_blank(*scan->cursor)) scan->cursor++;
        if (scan->cursor == scan->end || *scan->cursor != '\\') return;
        const char *after = scan->cursor + 1; /* in bounds: *end is readable */
        if (*after == '\r') after++;
        if (after >= scan->end || *after != '\n') return;
        start_line(scan, after + 1);
    }
}

void ca_scan_skip_space(ca_text_scan *scan)
{
    while (scan->cursor < scan->end && (is_blank(*scan->cursor) || *scan->cursor == '\n')) {
        if (*scan->cursor == '\n')
            start_line(scan, scan->cursor + 1);
        else
            scan->cursor++;
    }
}

bool ca_scan_next_line(ca_text_scan *scan)
{
    const char *end = memchr(scan->cursor, '\n', (size_t)(scan->end - scan->cursor));
    if (!end) {
        scan->cursor = scan->end;
        return false;
    }
    start_line(scan, end + 1);
    return scan->cursor < scan->end;
}

bool ca_scan_line_ends(ca_text_scan *scan)
{
    ca_scan_skip_blanks(scan);
    return scan->cursor == scan->end || *scan->cursor == '\n';
}

static size_t word_length(const char *word, const char *end)
{
    const char *after = word;
    while (after < end && !is_blank(*after) && *after != '\n') after++;
    return (size_t)(after - word);
}

size_t ca_scan_word(ca_text_scan *scan, const char **word)
{
    ca_scan_skip_blanks(scan);
    *word = scan->cursor;
    const size_t length = word_length(scan->cursor, scan->end);
    scan->cursor += length;
    return length;
}

/* Most numbers in meshes have few digits: a 64 bit integer and one exact power of ten give the correctly rounded
 * double (Clinger 1990, "How to Read Floating Point Numbers Accurately": both operands are exact). The rest goes the
 * long way. */
static bool parse_short_number(const char *text, size_t length, double *value)
{
    static const double powers[] = {1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11};
    enum { MAX_LENGTH = 17 }; /* at most 15 digits: below 2^53 */
    if (length == 0 || length > MAX_LENGTH) return false;
    const bool negative = *text == '-';
    uint64_t digits = 0;
    unsigned digit_count = 0, fraction = 0;
    bool point = false;
    for (size_t i = negative ? 1 : 0; i < length; ++i) {
        if (text[i] == '.' && !point) {
            point = true;
        } else if (text[i] >= '0' && text[i] <= '9') {
            digits = 10 * digits + (uint64_t)(text[i] - '0');
            digit_count++;
            fraction += point;
        } else {
            return false;
        }
    }
    if (digit_count == 0 || digit_count > 15 || fraction >= sizeof powers / sizeof *powers) return false;
    const double magnitude = (double)digits / powers[fraction];
    *value = negative ? -magnitude : magnitude;
    return true;
}

ca_status ca_scan_number(ca_text_scan *scan, const char *what, double *value, ca_error *error)
{
    const char *word = scan->cursor;
    const size_t length = word_length(word, scan->end);
    /* Up to half a step above FLT_MAX a value still rounds to it. */
    if (!parse_short_number(word, length, value) && (!ca_parse_number(word, length, value) || isinf((float)*value))) {
        const ca_location where = ca_scan_place(scan, word);
        const int shown = length < 32 ? (int)length : 32;
        return ca_fail(error, CA_ERROR_FORMAT, &where, "expected a number for %s, not \"%.*s\"", what, shown, word);
    }
    scan->cursor += length;
    return CA_OK;
}

ca_location ca_scan_place(const ca_text_scan *scan, const char *at)
{
    ca_location where = scan->where;
    where.column = (uint32_t)(at - scan->line_start) + 1;
    return where;
}
