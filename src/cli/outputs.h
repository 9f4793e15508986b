/* Where images go: checked before the work starts, so that hours of rendering are not lost to a typing error. */
#ifndef CA_CLI_OUTPUTS_H
#define CA_CLI_OUTPUTS_H

#include "base/status.h"

/* Can a file of this name be written here? Creates and removes a file beside it. Errors: CA_ERROR_FILE. */
ca_status ca_output_check_place(const char *path, ca_error *error);

/* The same for a folder that exists or will be made. */
ca_status ca_output_check_folder(const char *path, ca_error *error);

/* "NAME.extension" in the current folder, NAME being the scene file's without folder and extension. The caller frees
 * it with ca_free; NULL when out of memory. */
char *ca_output_default(const char *scene_path, const char *extension);

#endif
