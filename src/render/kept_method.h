/* A method that integrator `auto` has chosen, in the files that keep a render: which settings it was chosen for, why
 * and how long that took, so that a render that goes on does not choose again. The method itself and its parameters
 * are in the file's settings (part_settings.h). */
#ifndef CA_RENDER_KEPT_METHOD_H
#define CA_RENDER_KEPT_METHOD_H

#include "render/render.h"

/* Lines for a file; "": nothing was chosen. The caller's to free; NULL: out of memory. */
char *ca_kept_method_make(const ca_render_plan *plan);

/* Puts the choice to use that such lines, and the settings beside them, tell. Errors: CA_ERROR_ARGUMENT where it was
 * made for other settings, CA_ERROR_FORMAT. */
ca_status ca_kept_method_use(const char *lines, const char *settings, const char *path, ca_render_plan *plan,
                             ca_error *error);

/* Of a render with rays "auto": the same from the checkpoint that it goes on from, of whichever kind; *used: there is
 * one. Where it has passes plan->rays says so: their numbers were chosen once, or the method has none to choose. With
 * an integrator that was named nothing else is put to use. */
ca_status ca_kept_method_recall(ca_render_plan *plan, bool *used, ca_error *error);

#endif
