/* Texts and numbers inside of a page or of another file in UTF-8. Any bytes are allowed: each that is no UTF-8
 * becomes the replacement character U+FFFD. */
#ifndef CA_REPORT_PAGE_TEXT_H
#define CA_REPORT_PAGE_TEXT_H

#include <stdio.h>

/* How many bytes the UTF-8 sequence has that the text begins with, 1 for a zero byte too; 0: there is none. */
size_t ca_page_sequence(const char *text);

/* As the content of an element or of an attribute in double quotes. */
void ca_page_put_html(FILE *stream, const char *text);

/* A JSON string with its quotes that is safe inside of a script element: every < is written as \u003c, so that no
 * text ends the element or opens a comment. */
void ca_page_put_json(FILE *stream, const char *text);

/* A JSON number to the bit, the same in every locale; null where it is not finite. */
void ca_page_put_number(FILE *stream, double value);

#endif
