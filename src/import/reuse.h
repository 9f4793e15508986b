/* What the previous version of a scene has read already and the next one can share: meshes, placed, and images.
 *
 * Both are told by what they are made of: a number from the file's or the arrays' content and from all that is done
 * with it. Of a file the content is told by its path, its place on the disk, its size and its times of change to the
 * nanosecond, so that it is not read again to know that it is the same. */
#ifndef CA_IMPORT_REUSE_H
#define CA_IMPORT_REUSE_H

#include "import/importer.h"

/* 0: it cannot be told. */
uint64_t ca_reuse_file(const char *path);
/* Of positions, normals, uvs and indices; of a part of them once loading is not wanted any more, which is to be
 * asked. */
uint64_t ca_reuse_arrays(const ca_mesh_data *data);

/* A share of what the previous version made of the same; false where it has no such thing. `made_of` is not 0. The
 * same place in its table is asked first. */
bool ca_reuse_mesh(const ca_importer *importer, uint64_t made_of, ca_mesh *mesh);
bool ca_reuse_image(const ca_importer *importer, uint64_t made_of, ca_image *image);

#endif
