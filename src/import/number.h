/* Lists of words and numbers in the text of an attribute; the numbers themselves are read by base/text.h. */
#ifndef CA_IMPORT_NUMBER_H
#define CA_IMPORT_NUMBER_H

#include "base/text.h"

/* The next run of characters that are neither white space nor a comma, from *cursor on; its length, 0 at the end.
 * *cursor then stands behind it. */
size_t ca_next_token(const char **cursor, const char **token);

#endif
