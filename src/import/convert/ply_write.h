/* A mesh as a binary PLY file (little endian), of which ca_import_ply makes the same mesh to the bit. */
#ifndef CA_IMPORT_CONVERT_PLY_WRITE_H
#define CA_IMPORT_CONVERT_PLY_WRITE_H

#include "geometry/mesh.h"

/* Complete or not at all. CA_ERROR_UNSUPPORTED where the format has no name for an attribute. */
ca_status ca_ply_write(const ca_mesh *mesh, const char *path, ca_error *error);

#endif
