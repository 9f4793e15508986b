/* A render by passes: alone or with other ranks, kept in files, with numbers of rays from a file or from settings. */
#ifndef CA_RENDER_RENDER_PASSES_H
#define CA_RENDER_RENDER_PASSES_H

#include "render/render.h"

/* Renders the plan, of which the method is chosen first where it is `auto`'s. On helping ranks there is no image.
 * Errors: as ca_render's. */
ca_status ca_render_passes(ca_render_plan *plan, ca_image_layers **image, ca_render_statistics *statistics,
                           ca_error *error);

/* Makes the plan's integrator, and lets it go. */
ca_status ca_render_passes_check(ca_render_plan *plan, ca_error *error);

#endif
