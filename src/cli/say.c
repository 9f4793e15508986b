#define _POSIX_C_SOURCE 200809L
#include "cli/say.h"

#include "base/memory.h"
#include "report/page_text.h"

#include <stdbool.h>
#include <string.h>
#include <unistd.h>

/* `length`: of the UTF-8 sequence, 0 where there is none. C1 is U+0080 to U+009F, two bytes each. */
static bool is_command(const unsigned char *bytes, size_t length)
{
    if (length == 0) return true;
    if (length == 1) return (bytes[0] < 0x20 && bytes[0] != '\t') || bytes[0] == 0x7f;
    return bytes[0] == 0xc2 && bytes[1] < 0xa0;
}

/* The next sequence of the text, of four bytes at most, as it is shown. Returns what is behind it. */
enum { MOST_BYTES = 4, MOST_SHOWN = 4 * MOST_BYTES };
static const char *show_next(const char *text, char shown[MOST_SHOWN + 1])
{
    const unsigned char *bytes = (const unsigned char *)text;
    const size_t length = ca_page_sequence(text), step = length < 1 ? 1 : length < MOST_BYTES ? length : MOST_BYTES;
    if (is_command(bytes, length)) {
        for (size_t i = 0; i < step; i++) snprintf(shown + 4 * i, 5, "\\x%02x", bytes[i]);
    } else {
        memcpy(shown, text, step);
        shown[step] = '\0';
    }
    return text + step;
}

static void put_shown(FILE *stream, const char *text)
{
    char shown[MOST_SHOWN + 1];
    while (*text) {
        text = show_next(text, shown);
        fputs(shown, stream);
    }
}

void ca_show_text(const char *text, char *shown, size_t size)
{
    char next[MOST_SHOWN + 1];
    size_t used = 0;
    for (shown[0] = '\0'; *text;) {
        text = show_next(text, next);
        const size_t length = strlen(next);
        if (used + length >= size) return;
        memcpy(shown + used, next, length + 1);
        used += length;
    }
}

/* The text without the newline that it ends with, and then that one. */
static void put_line(FILE *stream, char *text, bool has_newline)
{
    const size_t length = strlen(text);
    if (has_newline && length > 0 && text[length - 1] == '\n') text[length - 1] = '\0'; /* else it was cut short */
    put_shown(stream, text);
    if (has_newline) fputc('\n', stream);
}

static void say_to_terminal(FILE *stream, const char *format, va_list arguments)
{
    char first[1024];
    va_list again;
    va_copy(again, arguments);
    const int length = vsnprintf(first, sizeof first, format, arguments);
    const size_t size = length < 0 ? 0 : (size_t)length + 1, last = strlen(format);
    char *whole = size > sizeof first ? ca_alloc(size, 1) : NULL; /* too little memory: the beginning is said */
    if (whole) vsnprintf(whole, size, format, again);
    put_line(stream, whole ? whole : first, last > 0 && format[last - 1] == '\n');
    ca_free(whole);
    va_end(again);
}

void ca_say(FILE *stream, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    if (isatty(fileno(stream)))
        say_to_terminal(stream, format, arguments);
    else
        vfprintf(stream, format, arguments);
    va_end(arguments);
}
