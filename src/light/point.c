/* A point that shines equally in all directions. */
#include "light/light_kinds.h"
#include "math/numeric.h"
#include "sampling/warp.h"

void ca_light_point_prepare(ca_light *light)
{
    light->power = 4.0f * CA_PI * ca_light_weight(light->as.point.intensity);
}

bool ca_light_point_direct(const ca_light *light, ca_vec3 reference, ca_light_direct *direct)
{
    if (!ca_light_direct_from_point(light->as.point.position, reference, direct)) return false;
    direct->radiance = ca_rgb_scale(light->as.point.intensity, 1.0f / ca_sqr(direct->distance));
    direct->pdf_direction = (ca_pdf_solid_angle){CA_INV_FOUR_PI};
    return true;
}

bool ca_light_point_emission(const ca_light *light, ca_vec2 u_direction, ca_light_emission *emission)
{
    return ca_light_point_towards(light, ca_warp_sphere(u_direction), emission);
}

bool ca_light_point_towards(const ca_light *light, ca_vec3 direction, ca_light_emission *emission)
{
    *emission = (ca_light_emission){.origin = light->as.point.position,
                                    .direction = direction,
                                    .radiance = light->as.point.intensity,
                                    .pdf_position = {1.0f},
                                    .pdf_direction = {CA_INV_FOUR_PI},
                                    .cos_light = 1.0f};
    return true;
}
