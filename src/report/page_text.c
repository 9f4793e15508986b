#include "report/page_text.h"

#include <math.h>
#include <string.h>

size_t ca_page_sequence(const char *text)
{
    const unsigned char *b = (const unsigned char *)text;
    if (b[0] < 0x80) return 1;
    if (b[0] < 0xc2 || b[0] > 0xf4) return 0;
    /* What would be longer than it has to be, a surrogate, or beyond the last character shows in the second byte. */
    const unsigned char low = b[0] == 0xe0 ? 0xa0 : b[0] == 0xf0 ? 0x90 : 0x80;
    const unsigned char high = b[0] == 0xed ? 0x9f : b[0] == 0xf4 ? 0x8f : 0xbf;
    if (b[1] < low || b[1] > high) return 0;
    const size_t length = b[0] < 0xe0 ? 2 : b[0] < 0xf0 ? 3 : 4;
    for (size_t i = 2; i < length; i++)
        if ((b[i] & 0xc0) != 0x80) return 0;
    return length;
}

/* The sequence that is no ASCII, or what stands for a wrong byte; how many bytes that was. */
static size_t put_sequence(FILE *stream, const char *text, const char *replacement)
{
    const size_t length = ca_page_sequence(text);
    if (length == 0) {
        fputs(replacement, stream);
        return 1;
    }
    return fwrite(text, 1, length, stream) == length ? length
                                                     : strlen(text); /* a stream with an error gets no more */
}

void ca_page_put_html(FILE *stream, const char *text)
{
    while (*text) switch (*text) {
        case '<': fputs("&lt;", stream); text++; break;
        case '>': fputs("&gt;", stream); text++; break;
        case '&': fputs("&amp;", stream); text++; break;
        case '"': fputs("&quot;", stream); text++; break;
        case '\'': fputs("&#39;", stream); text++; break;
        default: text += put_sequence(stream, text, "\xef\xbf\xbd");
        }
}

void ca_page_put_json(FILE *stream, const char *text)
{
    fputc('"', stream);
    while (*text) {
        const unsigned char c = (unsigned char)*text;
        if (c < 0x20 || c == 0x7f || strchr("<>&\"\\", c))
            fprintf(stream, "\\u%04x", (unsigned)(unsigned char)*text++);
        else
            text += put_sequence(stream, text, "\\ufffd");
    }
    fputc('"', stream);
}

void ca_page_put_number(FILE *stream, double value)
{
    if (!isfinite(value)) {
        fputs("null", stream);
        return;
    }
    char text[40];
    snprintf(text, sizeof text, "%.17g", value);
    for (char *c = text; *c; c++)
        if (*c == ',') *c = '.'; /* the decimal sign of some locales */
    fputs(text, stream);
}
