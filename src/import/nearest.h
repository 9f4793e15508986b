/* The known name that is closest to a wrong one, for error messages: always one, however far, for a scene's author is
 * helped by any name of the right kind. */
#ifndef CA_IMPORT_NEAREST_H
#define CA_IMPORT_NEAREST_H

#include <stddef.h>

/* By ca_edit_distance (text.h), of long names by that of their beginnings; the first of equals, NULL of none. NULL
 * entries are skipped. */
const char *ca_import_nearest(const char *wrong, const char *const *known, size_t count);

#endif
