/* Scenes that benches make themselves. */
#ifndef CA_BENCH_BENCH_SCENES_H
#define CA_BENCH_BENCH_SCENES_H

#include "scene/scene.h"

/* A closed diffuse room with a bumpy floor of 1,000,000 triangles and an area light: half of the rays meet nothing
 * but the room's few walls. */
ca_status bench_scene_terrain(ca_scene **scene, ca_error *error);

/* The same room filled with 256 bumpy balls of 4,096 triangles each, a little over a million: geometry everywhere, as
 * in a furnished room or a forest, where most rays have many boxes to pass. */
ca_status bench_scene_balls(ca_scene **scene, ca_error *error);

#endif
