/* Integrator `auto`: which method, with how many light paths, makes the least error of a render in its time.
 *
 * The light pilot (light_pilot.h) tells which methods lose light; those are out. The others are tried on a small
 * picture (method_trial.h), a few iterations first, and those that may be the best go on with twice as many; where
 * numbers of light paths are free, four times as many and a quarter are tried, too (method_choice.h). What a trial is
 * too short to see, the pilot tells of (method_light.h). Trials take about CA_METHOD_SHARE of the render's time, but
 * no less than the first round of them takes; pilots before them about as much.
 *
 * The choice reads the clock. The render that follows does not depend on it otherwise: it has the bits of one with
 * the chosen method and its radius named, and its picture says which these are (attribute caustica.integrator). */
#ifndef CA_RENDER_AUTO_METHOD_H
#define CA_RENDER_AUTO_METHOD_H

#include "render/render.h"

#define CA_METHOD_SHARE 0.03

static inline bool ca_render_plan_chooses(const ca_render_plan *plan)
{
    return ca_integrator_has(plan->type, CA_ABILITY_CHOOSES);
}

/* Chooses the method of a plan that ca_render_plan_chooses, and puts it to use: plan->type and its parameters, and
 * plan->method. Where the settings have a file of rays, the method is the one that the file's picture was made with,
 * and CA_ERROR_ARGUMENT says that another is asked for.
 * Asks the progress callback; where that ends the render, the best method so far is used for one pass. Errors:
 * CA_ERROR_MEMORY, those of ca_layers_read, and CA_ERROR_FORMAT for a file that names no method. */
ca_status ca_auto_method_choose(ca_render_plan *plan, ca_error *error);

/* Puts a method to use without any choice: the one that finds all light there is, where it takes the settings. For
 * checks of these. */
ca_status ca_auto_method_use_any(ca_render_plan *plan, ca_error *error);

#endif
