/* Adding up part files of passes (ca_merge_parts): one after the other, row by row. In memory is one film, however
 * many they are. */
#ifndef CA_RENDER_MERGE_PASSES_H
#define CA_RENDER_MERGE_PASSES_H

#include "caustica.h"

/* As ca_merge_parts. */
ca_status ca_merge_passes(const char *const *paths, size_t count, const char *part_path, ca_image_layers **image,
                          ca_render_statistics *statistics, ca_error *error);

#endif
