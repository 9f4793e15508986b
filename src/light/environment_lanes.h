/* An environment eight directions at a time: to the bit what ca_light_sample_direct and ca_light_eval_hit say. */
#ifndef CA_LIGHT_ENVIRONMENT_LANES_H
#define CA_LIGHT_ENVIRONMENT_LANES_H

#include "light/light.h"
#include "math/lanes.h"

typedef struct ca_environment8 {
    ca_v8 to_light, radiance;
    ca_f8 pdf_direct; /* per solid angle; 0: no light from there, by next event */
} ca_environment8;

/* Next event with (u, v), in [0, 1) in all lanes. */
ca_environment8 ca_light_environment_direct8(const ca_light *light, ca_f8 u, ca_f8 v);
/* Of unit directions to the light. */
ca_environment8 ca_light_environment_hit8(const ca_light *light, ca_v8 to_light);

#endif
