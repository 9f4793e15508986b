/* Words for people: the nearest known name to a misspelt one, and numbers read the same in every locale. */
#ifndef CA_BASE_TEXT_H
#define CA_BASE_TEXT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* ---- Names that are nearly right ------------------------------------------------------------------------------- */

/* Edits (insert, delete, replace, swap of neighbours) that turn a into b. Of longer words the first 63 characters
 * count. */
size_t ca_edit_distance(const char *a, const char *b);

/* Of a and b the name with fewer edits from the word; a of equals. NULL stands for no name. */
const char *ca_nearer_name(const char *word, const char *a, const char *b);

/* The candidate with the fewest edits, the first of equals; NULL where there is none. NULL candidates are skipped.
 * Always a name, however far: for an author whom any name of the right kind helps. */
const char *ca_nearest_name_however_far(const char *word, const char *const *candidates, size_t count);

/* The same, but NULL where its edits are more than a third of the word's length plus one. */
const char *ca_nearest_name(const char *word, const char *const *candidates, size_t count);

/* ---- Counts ---------------------------------------------------------------------------------------------------- */

/* The noun behind a count: "1 pass", "0 passes", "2 passes", "1.5 passes". What is one when printed with four digits
 * is one. */
const char *ca_noun(double count, const char *one, const char *many);

/* What stands before item `index` of a list of `count`: "", ", ", or before the last one `last` (" and "). */
const char *ca_list_separator(size_t index, size_t count, const char *last);

/* ---- Numbers: nothing left over, no spaces --------------------------------------------------------------------- */

/* The whole of text[0, length) as a finite decimal number ("-1.5e3"; no "inf", "nan" or hexadecimal), with a decimal
 * point whatever the locale. Of one that is too large for a double *value is infinite, and the answer is false. */
bool ca_parse_number(const char *text, size_t length, double *value);
/* The same, of a whole text. */
bool ca_parse_double(const char *text, double *value);
/* The whole of text[0, length) as decimal digits, without a sign, of a number not above `limit`. */
bool ca_parse_digits(const char *text, size_t length, uint64_t limit, uint64_t *value);
/* The whole of text[0, length) as a decimal integer, with or without a sign. */
bool ca_parse_integer(const char *text, size_t length, int64_t *value);
/* What a hexadecimal digit counts; -1: it is none. */
int ca_hex_digit(char digit);

/* ---- Files of text --------------------------------------------------------------------------------------------- */

/* How many bytes the byte order mark takes that a text in UTF-8 may begin with; 0: it has none. */
size_t ca_byte_order_mark(const char *text, size_t size);

#endif
