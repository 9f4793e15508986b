/* Surfaces that glow: the radiance of a texture, the same in all directions of the side of ng. */
#include "light/light_kinds.h"
#include "math/numeric.h"
#include "sampling/warp.h"

static ca_rgb radiance_at(const ca_light *light, const ca_surface *surface)
{
    if (light->as.area.radiance == CA_NONE) return ca_rgb_grey(1.0f);
    return ca_texture_eval(light->textures, light->as.area.radiance, surface);
}

static float luminance_at(const ca_light *light, ca_vec2 u)
{
    ca_surface surface;
    ca_shape_sample_area(light->as.area.shape, u, &surface);
    return ca_light_weight(radiance_at(light, &surface));
}

void ca_light_area_prepare(ca_light *light)
{
    light->power = CA_PI * light->as.area.shape->area *
                   ca_light_texture_mean(light, light->as.area.radiance, luminance_at);
}

/* By solid angle: the density of the point, per area of the light, over 1 / area. */
static float solid_angle_ratio(const ca_shape *shape, ca_pdf_solid_angle pdf, float cos_light, float distance2)
{
    return ca_pdf_to_area(pdf, cos_light, distance2).v * shape->area;
}

/* One root and one division for distance, direction and density together. */
bool ca_light_direct_to_surface(const ca_surface *point, ca_pdf_area pdf_position, ca_vec3 reference,
                                ca_light_direct *direct)
{
    const ca_vec3 segment = ca_sub(point->position, reference);
    const float distance2 = ca_length2(segment);
    const float distance = sqrtf(distance2), inverse = 1.0f / distance;
    const float cos_light = -ca_dot(segment, point->ng) * inverse;
    if (!(cos_light > 0.0f && distance2 > 0.0f)) return false;
    direct->to_light = ca_mul(segment, inverse);
    direct->distance = distance;
    direct->position = point->position;
    direct->position_error = point->position_error;
    direct->ng = point->ng;
    direct->pdf_position = pdf_position;
    direct->pdf_direct = ca_pdf_to_solid_angle(pdf_position, cos_light, distance2);
    direct->pdf_direction = ca_warp_cosine_hemisphere_pdf(cos_light);
    direct->cos_light = cos_light;
    direct->next_event_ratio = 1.0f;
    return direct->pdf_direct.v > 0.0f;
}

bool ca_light_area_direct(const ca_light *light, ca_vec3 reference, ca_vec2 u, ca_light_direct *direct)
{
    const ca_shape *shape = light->as.area.shape;
    ca_surface surface;
    ca_pdf_solid_angle pdf_seen;
    ca_shape_sample_seen(shape, reference, u, &surface, &pdf_seen);
    if (!ca_light_direct_to_surface(&surface, (ca_pdf_area){1.0f / shape->area}, reference, direct)) return false;
    direct->radiance = radiance_at(light, &surface);
    if (!(pdf_seen.v > 0.0f)) return true;
    direct->pdf_direct = pdf_seen;
    const float distance2 = ca_length2(ca_sub(surface.position, reference));
    direct->next_event_ratio = solid_angle_ratio(shape, pdf_seen, direct->cos_light, distance2);
    return true;
}

void ca_light_area_start(const ca_light *light, ca_vec2 u_position, ca_light_emission *emission)
{
    ca_surface surface;
    const ca_pdf_area pdf_position = ca_shape_sample_area(light->as.area.shape, u_position, &surface);
    *emission = (ca_light_emission){.origin = surface.position,
                                    .origin_error = surface.position_error,
                                    .ng = surface.ng,
                                    .radiance = radiance_at(light, &surface), /* in all directions */
                                    .pdf_position = pdf_position};
}

static void set_direction(ca_vec3 direction, float cos_light, ca_light_emission *emission)
{
    emission->direction = direction;
    emission->pdf_direction = ca_warp_cosine_hemisphere_pdf(cos_light);
    emission->cos_light = cos_light;
}

bool ca_light_area_towards(ca_vec3 direction, ca_light_emission *emission)
{
    const float cos_light = ca_dot(direction, emission->ng);
    if (!(cos_light > 0.0f)) return false;
    set_direction(direction, cos_light, emission);
    return true;
}

bool ca_light_area_emission(const ca_light *light, ca_vec2 u_position, ca_vec2 u_direction,
                            ca_light_emission *emission)
{
    ca_light_area_start(light, u_position, emission);
    const ca_vec3 local = ca_warp_cosine_hemisphere(u_direction);
    const ca_frame frame = ca_frame_from_normal(emission->ng);
    set_direction(ca_to_world(&frame, local), local.z, emission);
    return true;
}

ca_light_hit ca_light_area_hit(const ca_light *light, ca_vec3 reference, const ca_surface *surface, ca_vec3 direction)
{
    const ca_shape *shape = light->as.area.shape;
    const float cos_light = ca_dot(surface->ng, direction);
    if (!(cos_light > 0.0f)) return (ca_light_hit){0};
    const ca_pdf_area pdf_position = {1.0f / shape->area};
    const ca_pdf_solid_angle pdf_seen = ca_shape_pdf_seen(shape, reference);
    const float distance2 = ca_length2(ca_sub(surface->position, reference));
    const bool by_solid_angle = pdf_seen.v > 0.0f;
    return (ca_light_hit){
        .radiance = radiance_at(light, surface),
        .pdf_direct = by_solid_angle ? pdf_seen : ca_pdf_to_solid_angle(pdf_position, cos_light, distance2),
        .pdf_position = pdf_position,
        .pdf_direction = ca_warp_cosine_hemisphere_pdf(cos_light),
        .next_event_ratio = by_solid_angle ? solid_angle_ratio(shape, pdf_seen, cos_light, distance2) : 1.0f};
}

float ca_light_area_next_event_ratio(const ca_light *light, ca_vec3 reference, ca_vec3 position, ca_vec3 ng)
{
    const ca_shape *shape = light->as.area.shape;
    const ca_pdf_solid_angle pdf_seen = ca_shape_pdf_seen(shape, reference);
    if (!(pdf_seen.v > 0.0f)) return 1.0f;
    const ca_vec3 segment = ca_sub(position, reference);
    const float distance2 = ca_length2(segment);
    return distance2 > 0.0f
               ? solid_angle_ratio(shape, pdf_seen, ca_abs_dot(segment, ng) / sqrtf(distance2), distance2)
               : 1.0f;
}

ca_rgb ca_light_area_radiance(const ca_light *light, const ca_surface *surface, ca_vec3 direction)
{
    return ca_dot(surface->ng, direction) > 0.0f ? radiance_at(light, surface) : (ca_rgb){0};
}
