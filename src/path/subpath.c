#include "path/subpath.h"

ca_flight ca_light_end(const ca_light *light, float choice, ca_pdf_area pdf_position,
                       ca_pdf_solid_angle pdf_direction, float cos_light, const ca_reuse_rules *rules,
                       ca_path_vertex *vertex)
{
    const bool infinite = ca_light_is_infinite(light), point = ca_light_has_dirac_position(light);
    const bool one_direction = ca_light_has_dirac_direction(light), parallel = infinite || one_direction;
    const float sqrt_area = point ? 0.0f : sqrtf(1.0f / pdf_position.v);
    const float spread = one_direction ? 0.0f : ca_footprint_spread(rules->epsilon, pdf_direction);
    /* Of parallel light the vertex is the direction (whose density is 1 where there is one only). */
    *vertex = (ca_path_vertex){.pdf_forward = {choice * (parallel ? pdf_direction.v : pdf_position.v)},
                               .next_event_ratio = 1.0f,
                               .light_choice = choice,
                               .at_infinity = parallel,
                               .sqrt_area = sqrt_area,
                               .cos_ratio = 1.0f};
    return (ca_flight){.pdf = parallel ? pdf_position.v : pdf_direction.v,
                       .parallel = parallel,
                       .reversible = !point && !one_direction,
                       .from_infinity = infinite,
                       .cos_out = cos_light,
                       .sqrt_area = sqrt_area,
                       .sqrt_omega = spread};
}

ca_flight ca_camera_end(const ca_camera *camera, ca_pdf_area pdf_position, ca_pdf_solid_angle pdf_direction,
                        const ca_reuse_rules *rules, ca_path_vertex *vertex)
{
    const bool parallel = ca_camera_has_dirac_direction(camera), point = ca_camera_has_dirac_position(camera);
    const float sqrt_area = point ? 0.0f : sqrtf(1.0f / pdf_position.v);
    *vertex = (ca_path_vertex){.pdf_forward = {parallel ? 1.0f : pdf_position.v},
                               .sqrt_area = sqrt_area,
                               .cos_ratio = 1.0f,
                               .splat_scale = 1.0f};
    return (ca_flight){.pdf = parallel ? pdf_position.v : pdf_direction.v,
                       .parallel = parallel,
                       .reversible = false, /* no technique lets light paths run into the lens */
                       .cos_out = 1.0f,
                       .sqrt_area = sqrt_area,
                       .sqrt_omega = parallel ? 0.0f : ca_footprint_spread(rules->epsilon, pdf_direction)};
}
