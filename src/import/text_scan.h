/* Words and numbers of a text in memory, with the place of each for messages. The same in every locale. */
#ifndef CA_IMPORT_TEXT_SCAN_H
#define CA_IMPORT_TEXT_SCAN_H

#include "base/status.h"

#include <stddef.h>

typedef struct ca_text_scan {
    const char *cursor, *end; /* borrowed; *end is readable and zero */
    const char *line_start;
    ca_location where; /* file and line of the cursor; the column is set by ca_scan_place */
} ca_text_scan;

/* Behind the byte order mark of the text, if it has one. */
ca_text_scan ca_scan_begin(const char *file, const char *text, size_t size);

/* Skips white space within the line, and a backslash that continues it on the next. */
void ca_scan_skip_blanks(ca_text_scan *scan);
/* Skips white space and ends of lines. */
void ca_scan_skip_space(ca_text_scan *scan);
/* To the start of the next line; false at the end of the text. */
bool ca_scan_next_line(ca_text_scan *scan);
/* Is nothing but blanks left of the line? Skips them. */
bool ca_scan_line_ends(ca_text_scan *scan);

/* The next word of this line; its length, 0 at the end of the line. */
size_t ca_scan_word(ca_text_scan *scan, const char **word);
/* The number at the cursor, which must be a word of its own and finite as a float; `what` names it in the error. */
ca_status ca_scan_number(ca_text_scan *scan, const char *what, double *value, ca_error *error);

/* The place of `at`, a character of the current line. */
ca_location ca_scan_place(const ca_text_scan *scan, const char *at);

#endif
