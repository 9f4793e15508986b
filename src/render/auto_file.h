/* The file of a render with rays "auto" (auto_file.c), for those who do not render with it yet. */
#ifndef CA_RENDER_AUTO_FILE_H
#define CA_RENDER_AUTO_FILE_H

#include "render/render.h"

/* Puts the method to use that integrator `auto` had chosen when the file was written (kept_method.h). */
ca_status ca_auto_file_use_method(ca_render_plan *plan, const char *path, ca_error *error);

#endif
