/* Words for people: the nearest known name to a misspelt one, and numbers read the same in every locale. */
#ifndef CA_BASE_TEXT_H
#define CA_BASE_TEXT_H

#include <stdbool.h>
#include <stddef.h>

/* Edits (insert, delete, replace, swap of neighbours) that turn a into b. Words over 63 characters count as `SIZE_MAX`
 * apart. */
size_t ca_edit_distance(const char *a, const char *b);

/* The candidate with the fewest edits, if they are at most a third of the word's length plus one; else NULL. NULL
 * candidates are skipped. */
const char *ca_nearest_name(const char *word, const char *const *candidates, size_t count);

/* The whole of `text` (spaces around it allowed) as a number, with a decimal point whatever the locale; false where it is
 * none or not finite. */
bool ca_parse_double(const char *text, double *value);

#endif
