/* Files that may be packed by gzip. */
#ifndef CA_IMPORT_INFLATE_H
#define CA_IMPORT_INFLATE_H

#include "base/file.h"

/* Reads a whole file as ca_file_read does, unpacked where it begins as gzip's files do; `limit` counts the bytes
 * packed and unpacked. */
ca_status ca_read_inflated(const char *path, const char *what, size_t limit, ca_bytes *bytes, ca_error *error);

#endif
