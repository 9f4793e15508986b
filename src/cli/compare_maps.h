/* The map files of `caustica compare --maps FILE.exr`: FILE.exr itself for one image; for several, one file each:
 * FILE-NAME.exr with the image's name without folder and extension, or FILE-1-NAME.exr, FILE-2-NAME.exr, ... where
 * two images have the same name. */
#ifndef CA_CLI_COMPARE_MAPS_H
#define CA_CLI_COMPARE_MAPS_H

#include "cli/options.h"
#include "cli/places.h"
#include "cli/stats_json.h"

/* Can this file be written, and is it none of those that are read or written? Errors: CA_ERROR_ARGUMENT, which names
 * the option; CA_ERROR_FILE. */
ca_status ca_compare_check_output(const char *option, const char *path, ca_places *places, ca_error *error);

/* (*names)[i] is the file for image i; the caller's to destroy, also on failure. All places are checked: errors are
 * CA_ERROR_ARGUMENT (no .exr; a file that is also compared), CA_ERROR_FILE, CA_ERROR_MEMORY. */
ca_status ca_compare_map_names(const char *pattern, const ca_text_list *images, ca_places *places, char ***names,
                               ca_error *error);
void ca_compare_map_names_destroy(char **names, size_t count);

/* Adds to the maps what they are maps of, and writes them. */
ca_status ca_compare_write_maps(const char *path, const char *reference, const ca_compared_image *image,
                                const ca_metric_settings *settings, ca_image_layers *maps, ca_error *error);

#endif
