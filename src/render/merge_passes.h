/* Adding up part files of passes (ca_merge_parts): one after the other, row by row. In memory is one film, however
 * many they are. */
#ifndef CA_RENDER_MERGE_PASSES_H
#define CA_RENDER_MERGE_PASSES_H

#include "caustica.h"
#include "film/pass_part.h"

/* As ca_merge_parts. */
ca_status ca_merge_passes(const char *const *paths, size_t count, const char *part_path, ca_image_layers **image,
                          ca_render_statistics *statistics, ca_error *error);

/* The passes that such files have together: in order, those that follow each other as one range. *ranges is the
 * caller's (ca_free). Each file is read to its end, since its hash is checked. Errors: as ca_merge_passes. */
ca_status ca_merge_ranges(const char *const *paths, size_t count, ca_pass_range **ranges, size_t *range_count,
                          ca_error *error);

#endif
