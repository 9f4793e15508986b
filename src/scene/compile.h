/* The steps of compiling a description that have files of their own; scene.c calls them in order. Each reads
 * scene->desc and what the steps before it have made. */
#ifndef CA_SCENE_COMPILE_H
#define CA_SCENE_COMPILE_H

#include "scene/scene.h"

/* compile_shapes.c: shapes of the world come first, then those of each group together; `group_first` tells where each
 * group starts and, in one entry more, where the last one ends. Errors: CA_ERROR_SCENE, CA_ERROR_MEMORY,
 * CA_ERROR_INTERRUPTED. */
ca_status ca_scene_compile_shapes(ca_scene *scene, uint32_t *group_first, uint32_t *world_count, ca_error *error);
/* After that. Only textures ask for uv, and on a quadric it costs two angles. */
void ca_scene_skip_uv(ca_scene *scene);

/* bounds.c: the box and the sphere around shapes and instances. */
void ca_scene_compute_bounds(ca_scene *scene, uint32_t world_count);
/* CA_ERROR_SCENE where the scene, a light, the camera or an instance is farther away, or smaller, than rays in single
 * precision allow (ray_reach.h). */
ca_status ca_scene_check_reach(const ca_scene *scene, ca_error *error);

/* compile_lights.c: once bounds and shapes are known, which area lights then point to. */
ca_status ca_scene_compile_lights(ca_scene *scene, ca_error *error);

#endif
