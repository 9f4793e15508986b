/* Layers of what camera rays meet first, by the names that the scene gives them (Mitsuba's `aov`): depth, position,
 * texture coordinates, normals, tangents, numbers of triangles and shapes, albedo.
 *
 * They are means over the camera paths' own first rays, weighted by the filter as the picture is, of the first
 * CA_AOV_SAMPLES camera paths of a pixel at most; what is met nowhere counts as 0. Traced when the picture is ready,
 * so pictures on the way and those that are added up from parts have none. A function of scene, settings and seed,
 * never of threads. */
#ifndef CA_RENDER_AOV_LAYERS_H
#define CA_RENDER_AOV_LAYERS_H

#include "render/render.h"

enum { CA_AOV_SAMPLES = 64 };

/* Time that they have in any case, in seconds. */
#define CA_AOV_SECONDS 1.0

/* Bytes of a pixel that they take. */
size_t ca_aov_layers_bytes(const ca_scene *scene);

/* Adds the layers that the scene asks for to a picture of the plan with so many samples in a pixel; those whose
 * names are there already are left as they are. All of them or none. Errors: CA_ERROR_INTERRUPTED (the settings'
 * discard, or, CA_AOV_SECONDS after the call began or later, their stop), CA_ERROR_MEMORY, CA_ERROR_THREADS. */
ca_status ca_aov_layers_add(const ca_render_plan *plan, double samples, ca_image_layers *image, ca_error *error);

#endif
