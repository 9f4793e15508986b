/* Scenes that benches make themselves. */
#ifndef CA_BENCH_BENCH_SCENES_H
#define CA_BENCH_BENCH_SCENES_H

#include "scene/scene.h"

/* A closed diffuse room with a bumpy floor of 1,000,000 triangles and an area light; rays are incoherent after the first
 * bounce. Integrator path, depth 8, 256 x 256 pixels. */
ca_status bench_scene_million(ca_scene **scene, ca_error *error);

#endif
