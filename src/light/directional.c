/* Parallel light from infinity: the same irradiance everywhere on surfaces that face it. */
#include "light/light_kinds.h"
#include "math/numeric.h"

void ca_light_directional_prepare(ca_light *light)
{
    light->power = CA_PI * ca_sqr(light->scene_radius) * ca_light_weight(light->as.directional.irradiance);
}

bool ca_light_directional_direct(const ca_light *light, ca_vec3 reference, ca_light_direct *direct)
{
    const ca_vec3 to_light = ca_neg(light->as.directional.direction);
    *direct = (ca_light_direct){.to_light = to_light,
                                .distance = CA_INFINITE_DISTANCE,
                                .position = ca_light_far_point(light, reference, to_light),
                                .radiance = light->as.directional.irradiance,
                                .pdf_direct = {1.0f},
                                .pdf_position = ca_light_disk_pdf(light),
                                .pdf_direction = {1.0f},
                                .cos_light = 1.0f,
                                .next_event_ratio = 1.0f};
    return true;
}

bool ca_light_directional_emission(const ca_light *light, ca_vec2 u_position, ca_light_emission *emission)
{
    *emission = (ca_light_emission){.origin = ca_light_disk_point(light, light->as.directional.direction, u_position),
                                    .direction = light->as.directional.direction,
                                    .radiance = light->as.directional.irradiance,
                                    .pdf_position = ca_light_disk_pdf(light),
                                    .pdf_direction = {1.0f},
                                    .cos_light = 1.0f};
    return true;
}
