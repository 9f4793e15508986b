/* What a picture will lack, said before it is made. */
#ifndef CA_CLI_LOOK_AHEAD_H
#define CA_CLI_LOOK_AHEAD_H

#include "caustica.h"

/* Prints the warnings of ca_preflight_make, each behind the name of what is to be rendered (NULL: without). *radius
 * (may be NULL): the merge radius that the render would find again. Errors: as ca_preflight_make. */
ca_status ca_look_ahead(const ca_scene *scene, const ca_render_settings *settings, const char *name, double *radius,
                        ca_error *error);

#endif
