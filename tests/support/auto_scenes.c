#include "support/auto_scenes.h"

#define SUN                                                                                                          \
    "<emitter type='directional'><vector name='direction' value='0.2,-1,0.1'/><rgb name='irradiance' "               \
    "value='1'/></emitter>"
/* A sheet of water over the floor. */
#define WATER                                                                                                        \
    "<shape type='rectangle'><transform name='to_world'><scale value='9'/><rotate x='1' angle='-90'/><translate "    \
    "y='1'/></transform><bsdf type='dielectric'/></shape>"

ca_scene *wall_scene(void)
{
    return scene_from_text("<scene version='3.0.0'>" FROM_ABOVE("24") FLOOR LAMP "</scene>");
}

ca_scene *water_scene(void)
{
    return scene_from_text("<scene version='3.0.0'>" FROM_ABOVE("24") FLOOR WATER SUN "</scene>");
}

ca_render_settings auto_settings(const char *integrator, uint32_t samples)
{
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.integrator = integrator;
    settings.samples_per_pixel = samples;
    settings.threads = 2;
    return settings;
}
