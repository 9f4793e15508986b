/* The known name that is closest to a wrong one, for error messages. */
#ifndef CA_IMPORT_NEAREST_H
#define CA_IMPORT_NEAREST_H

#include <stddef.h>

/* By edit distance (insertions, deletions, replacements, case ignored); the first of equals, NULL of none. NULL entries
 * are skipped. */
const char *ca_nearest_name(const char *wrong, const char *const *known, size_t count);

#endif
