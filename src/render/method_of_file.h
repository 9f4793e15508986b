/* A method for `auto` that was chosen before: that of a picture, which the settings name as file of rays. */
#ifndef CA_RENDER_METHOD_OF_FILE_H
#define CA_RENDER_METHOD_OF_FILE_H

#include "render/render.h"

/* Puts it to use: plan->type and its parameters, plan->rays, plan->method, and a warning where it loses light.
 * Errors: those of ca_layers_read; CA_ERROR_FORMAT for a file that names no method; CA_ERROR_ARGUMENT where the
 * settings ask for another one. */
ca_status ca_method_of_file_use(ca_render_plan *plan, ca_error *error);

#endif
