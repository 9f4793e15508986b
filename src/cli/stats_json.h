/* The numbers of a command as a JSON file (--stats), complete or not at all. */
#ifndef CA_CLI_STATS_JSON_H
#define CA_CLI_STATS_JSON_H

#include "film/compare.h"

/* `non_finite` counts samples by technique; unknown numbers are null. */
ca_status ca_stats_write_render(const char *path, const ca_render_statistics *statistics, ca_error *error);

/* One picture that was compared with the reference. */
typedef struct ca_compared_image {
    const char *path;
    ca_comparison comparison;
} ca_compared_image;

ca_status ca_stats_write_compare(const char *path, const char *reference, const ca_compared_image *images,
                                 size_t count, ca_error *error);

#endif
