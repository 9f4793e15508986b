/* Pilots of light (render/light_pilot.h) of a render's own method. */
#ifndef CA_TEST_LIGHT_PILOTS_H
#define CA_TEST_LIGHT_PILOTS_H

#include "render/light_pilot.h"

/* Of a render with so many passes; fails the test on errors. To be destroyed. */
ca_light_pilot pilot_with_effort(const ca_scene *scene, const ca_render_settings *settings, uint32_t passes,
                                 uint32_t effort);

#endif
