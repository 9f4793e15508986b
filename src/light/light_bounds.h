/* Where a light is and which way it shines, as bounds: what the tree over all lights (light_tree.h) is made of. */
#ifndef CA_LIGHT_LIGHT_BOUNDS_H
#define CA_LIGHT_LIGHT_BOUNDS_H

#include "light/light.h"

/* Of one light or of several. All of it shines from inside of the box, into directions that are within
 * `emission_angle` of one that is within `normal_angle` of the axis. */
typedef struct ca_light_bounds {
    ca_vec3 low, high;
    ca_vec3 axis; /* unit */
    float normal_angle, emission_angle; /* radians, at most pi and pi / 2 */
    float intensity; /* W/sr, luminance: about the largest over all directions; of several the sum */
} ca_light_bounds;

/* false: the light is at infinity. It must be prepared. */
bool ca_light_bounds_of(const ca_light *light, ca_light_bounds *bounds);

ca_light_bounds ca_light_bounds_union(const ca_light_bounds *a, const ca_light_bounds *b);

/* How badly the bounds represent what is in them: intensity, times surface of the box, times the measure of
 * directions (the orientation heuristic of Conty Estevez and Kulla 2018, "Importance Sampling of Many Lights with
 * Adaptive Tree Splitting"). */
double ca_light_bounds_cost(const ca_light_bounds *bounds);

#endif
