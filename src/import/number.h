/* Numbers in text, read the same in every locale and with nothing left over. */
#ifndef CA_IMPORT_NUMBER_H
#define CA_IMPORT_NUMBER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* The whole of text[0, length) as a finite decimal number ("-1.5e3"; no "inf", "nan" or hexadecimal). */
bool ca_parse_number(const char *text, size_t length, double *value);
/* The whole of text[0, length) as a decimal integer. */
bool ca_parse_integer(const char *text, size_t length, int64_t *value);

/* The next run of characters that are neither white space nor a comma, from *cursor on; its length, 0 at the end.
 * *cursor then stands behind it. */
size_t ca_next_token(const char **cursor, const char **token);

#endif
