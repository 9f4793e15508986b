/* Small scenes of which each method is known to be right or wrong, and settings of `auto`. */
#ifndef CAUSTICA_TESTS_AUTO_SCENES_H
#define CAUSTICA_TESTS_AUTO_SCENES_H

#include "support/scene_text.h"

/* Parts of a scene's text: a film, a camera 4 above the floor, the floor. */
#define FILM(side)                                                                                                   \
    "<film type='hdrfilm'><integer name='width' value='" side "'/><integer name='height' value='" side               \
    "'/><rfilter type='box'/></film>"
#define FLOOR                                                                                                        \
    "<shape type='rectangle'><transform name='to_world'><scale value='3'/><rotate x='1' angle='-90'/></transform>"   \
    "</shape>"
#define FROM_ABOVE(side)                                                                                             \
    "<sensor type='perspective'><transform name='to_world'><lookat origin='0,4,0' target='0,0,0' up='0,0,1'/>"       \
    "</transform>" FILM(side) "</sensor>"
#define LAMP                                                                                                         \
    "<emitter type='point'><point name='position' value='1,1.5,0.5'/><rgb name='intensity' value='4'/></emitter>"

/* The floor under a lamp, 24 x 24 pixels: next event leaves one sample's noise. */
ca_scene *wall_scene(void);

/* The floor under water and a sun: only merges find its light. */
ca_scene *water_scene(void);

/* Two threads; all else as it is by itself. */
ca_render_settings auto_settings(const char *integrator, uint32_t samples);

#endif
