#include "report/page_text.h"

#include <math.h>
#include <string.h>

void ca_page_put_html(FILE *stream, const char *text)
{
    for (; *text; text++) switch (*text) {
        case '<': fputs("&lt;", stream); break;
        case '>': fputs("&gt;", stream); break;
        case '&': fputs("&amp;", stream); break;
        case '"': fputs("&quot;", stream); break;
        case '\'': fputs("&#39;", stream); break;
        default: fputc(*text, stream);
        }
}

void ca_page_put_json(FILE *stream, const char *text)
{
    fputc('"', stream);
    for (; *text; text++) {
        const unsigned char c = (unsigned char)*text;
        if (c < 0x20 || c == 0x7f || strchr("<>&\"\\", c))
            fprintf(stream, "\\u%04x", c);
        else
            fputc(c, stream);
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
