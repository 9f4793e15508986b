/* What a render will lose, where the plan is there already; of settings: ca_preflight_make. */
#ifndef CA_RENDER_PREFLIGHT_H
#define CA_RENDER_PREFLIGHT_H

#include "render/render.h"

/* Of a method that `auto` has put to use, in so many iterations: is its light dots? `photons`: that a pixel merges in
 * these, in the mean over the picture, by a trial of the method. `warning`, of CA_PREFLIGHT_WARNING_SIZE, is set
 * where there is something to say. Takes a light pilot's time (light_pilot.h). Errors: CA_ERROR_MEMORY. */
ca_status ca_preflight_chosen(const ca_render_plan *plan, double iterations, double photons, char *warning,
                              ca_error *error);

#endif
