/* Surfaces that shine along their (shading) normals only: collimated light, such as a laser's. A texture gives the
 * exitance, W m^-2. What a flat one lights is a prism, and next event looks back along its axis; a curved one is only
 * found by light paths. */
#include "light/light_kinds.h"
#include "math/numeric.h"

static ca_rgb exitance_at(const ca_light *light, const ca_surface *surface)
{
    if (light->as.beam.exitance == CA_NONE) return ca_rgb_grey(1.0f);
    return ca_texture_eval(light->textures, light->as.beam.exitance, surface);
}

static float luminance_at(const ca_light *light, ca_vec2 u)
{
    ca_surface surface;
    ca_shape_sample_area(light->as.beam.shape, u, &surface);
    return ca_light_weight(exitance_at(light, &surface));
}

void ca_light_beam_prepare(ca_light *light)
{
    light->as.beam.is_flat = ca_shape_is_flat(light->as.beam.shape);
    light->power =
        light->as.beam.shape->area * ca_light_texture_mean(light, light->as.beam.exitance, luminance_at);
}

bool ca_light_beam_direct(const ca_light *light, ca_vec3 reference, ca_light_direct *direct)
{
    ca_surface surface;
    if (!light->as.beam.is_flat || !ca_shape_foot(light->as.beam.shape, reference, &surface)) return false;
    const float distance = ca_dot(ca_sub(reference, surface.position), surface.ng);
    if (!(distance > 0.0f)) return false;
    *direct = (ca_light_direct){.to_light = ca_neg(surface.ng),
                                .distance = distance,
                                .position = surface.position,
                                .position_error = surface.position_error,
                                .ng = surface.ng,
                                .radiance = exitance_at(light, &surface),
                                .pdf_direct = {1.0f},
                                .pdf_position = {1.0f / light->as.beam.shape->area},
                                .pdf_direction = {1.0f},
                                .cos_light = 1.0f,
                                .next_event_ratio = 1.0f};
    return true;
}

bool ca_light_beam_emission(const ca_light *light, ca_vec2 u_position, ca_light_emission *emission)
{
    ca_surface surface;
    const ca_pdf_area pdf_position = ca_shape_sample_area(light->as.beam.shape, u_position, &surface);
    *emission = (ca_light_emission){.origin = surface.position,
                                    .origin_error = surface.position_error,
                                    .ng = surface.ng,
                                    .direction = surface.ns,
                                    .radiance = exitance_at(light, &surface),
                                    .pdf_position = pdf_position,
                                    .pdf_direction = {1.0f},
                                    .cos_light = 1.0f};
    return true;
}

float ca_light_beam_next_event_ratio(const ca_light *light) { return light->as.beam.is_flat ? 1.0f : 0.0f; }
