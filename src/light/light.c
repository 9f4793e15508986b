#include "light/light.h"

#include "light/light_kinds.h"
#include "math/numeric.h"
#include "sampling/warp.h"

ca_status ca_light_prepare(ca_light *light, ca_vec3 scene_center, float scene_radius, ca_error *error)
{
    light->scene_center = scene_center;
    /* A scene without extent still has a disk to emit from. */
    light->scene_radius = scene_radius > 0.0f ? scene_radius : 1.0f;
    switch (light->kind) {
    case CA_LIGHT_AREA: ca_light_area_prepare(light); break;
    case CA_LIGHT_BEAM: ca_light_beam_prepare(light); break;
    case CA_LIGHT_POINT: ca_light_point_prepare(light); break;
    case CA_LIGHT_SPOT: ca_light_spot_prepare(light); break;
    case CA_LIGHT_DIRECTIONAL: ca_light_directional_prepare(light); break;
    case CA_LIGHT_PROJECTOR: CA_TRY(ca_light_projector_prepare(light, error)); break;
    case CA_LIGHT_CONSTANT:
    case CA_LIGHT_ENVMAP: CA_TRY(ca_light_environment_prepare(light, error)); break;
    case CA_LIGHT_KIND_COUNT: break;
    }
    return CA_OK;
}

void ca_light_release(ca_light *light)
{
    switch (light->kind) {
    case CA_LIGHT_PROJECTOR: ca_distribution_2d_destroy(&light->as.projector.pixels); break;
    case CA_LIGHT_ENVMAP: ca_distribution_2d_destroy(&light->as.envmap.cells); break;
    case CA_LIGHT_AREA:
    case CA_LIGHT_BEAM:
    case CA_LIGHT_POINT:
    case CA_LIGHT_SPOT:
    case CA_LIGHT_DIRECTIONAL:
    case CA_LIGHT_CONSTANT:
    case CA_LIGHT_KIND_COUNT: break;
    }
}

bool ca_light_is_infinite(const ca_light *light)
{
    switch (light->kind) {
    case CA_LIGHT_DIRECTIONAL:
    case CA_LIGHT_CONSTANT:
    case CA_LIGHT_ENVMAP: return true;
    case CA_LIGHT_AREA:
    case CA_LIGHT_BEAM:
    case CA_LIGHT_POINT:
    case CA_LIGHT_SPOT:
    case CA_LIGHT_PROJECTOR:
    case CA_LIGHT_KIND_COUNT: break;
    }
    return false;
}

bool ca_light_has_dirac_position(const ca_light *light)
{
    switch (light->kind) {
    case CA_LIGHT_POINT:
    case CA_LIGHT_SPOT:
    case CA_LIGHT_PROJECTOR: return true;
    case CA_LIGHT_AREA:
    case CA_LIGHT_BEAM:
    case CA_LIGHT_DIRECTIONAL:
    case CA_LIGHT_CONSTANT:
    case CA_LIGHT_ENVMAP:
    case CA_LIGHT_KIND_COUNT: break;
    }
    return false;
}

bool ca_light_has_dirac_direction(const ca_light *light)
{
    return light->kind == CA_LIGHT_DIRECTIONAL || light->kind == CA_LIGHT_BEAM;
}

bool ca_light_falls_off(const ca_light *light)
{
    return !ca_light_is_infinite(light) && light->kind != CA_LIGHT_BEAM;
}

bool ca_light_sample_direct(const ca_light *light, ca_vec3 reference, ca_vec2 u, ca_light_direct *direct)
{
    switch (light->kind) {
    case CA_LIGHT_AREA: return ca_light_area_direct(light, reference, u, direct);
    case CA_LIGHT_BEAM: return ca_light_beam_direct(light, reference, direct);
    case CA_LIGHT_POINT: return ca_light_point_direct(light, reference, direct);
    case CA_LIGHT_SPOT: return ca_light_spot_direct(light, reference, direct);
    case CA_LIGHT_DIRECTIONAL: return ca_light_directional_direct(light, reference, direct);
    case CA_LIGHT_PROJECTOR: return ca_light_projector_direct(light, reference, direct);
    case CA_LIGHT_CONSTANT:
    case CA_LIGHT_ENVMAP: return ca_light_environment_direct(light, reference, u, direct);
    case CA_LIGHT_KIND_COUNT: break;
    }
    return false;
}

bool ca_light_sample_emission(const ca_light *light, ca_vec2 u_position, ca_vec2 u_direction,
                              ca_light_emission *emission)
{
    switch (light->kind) {
    case CA_LIGHT_AREA: return ca_light_area_emission(light, u_position, u_direction, emission);
    case CA_LIGHT_BEAM: return ca_light_beam_emission(light, u_position, emission);
    case CA_LIGHT_POINT: return ca_light_point_emission(light, u_direction, emission);
    case CA_LIGHT_SPOT: return ca_light_spot_emission(light, u_direction, emission);
    case CA_LIGHT_DIRECTIONAL: return ca_light_directional_emission(light, u_position, emission);
    case CA_LIGHT_PROJECTOR: return ca_light_projector_emission(light, u_position, emission);
    case CA_LIGHT_CONSTANT:
    case CA_LIGHT_ENVMAP: return ca_light_environment_emission(light, u_position, u_direction, emission);
    case CA_LIGHT_KIND_COUNT: break;
    }
    return false;
}

bool ca_light_can_be_aimed(const ca_light *light)
{
    return light->kind == CA_LIGHT_AREA || light->kind == CA_LIGHT_POINT || light->kind == CA_LIGHT_SPOT;
}

static ca_vec3 dirac_position(const ca_light *light)
{
    return light->kind == CA_LIGHT_POINT ? light->as.point.position : light->as.spot.position;
}

void ca_light_start_emission(const ca_light *light, ca_vec2 u_position, ca_light_emission *emission)
{
    if (light->kind == CA_LIGHT_AREA)
        ca_light_area_start(light, u_position, emission);
    else
        *emission = (ca_light_emission){.origin = dirac_position(light), .pdf_position = {1.0f}};
}

bool ca_light_emission_towards(const ca_light *light, ca_vec3 direction, ca_light_emission *emission)
{
    switch (light->kind) {
    case CA_LIGHT_AREA: return ca_light_area_towards(direction, emission);
    case CA_LIGHT_POINT: return ca_light_point_towards(light, direction, emission);
    case CA_LIGHT_SPOT: return ca_light_spot_towards(light, direction, emission);
    case CA_LIGHT_BEAM:
    case CA_LIGHT_DIRECTIONAL:
    case CA_LIGHT_PROJECTOR:
    case CA_LIGHT_CONSTANT:
    case CA_LIGHT_ENVMAP:
    case CA_LIGHT_KIND_COUNT: break;
    }
    return false;
}

ca_light_hit ca_light_eval_hit(const ca_light *light, ca_vec3 reference, const ca_surface *surface, ca_vec3 direction)
{
    switch (light->kind) {
    case CA_LIGHT_AREA: return ca_light_area_hit(light, reference, surface, direction);
    case CA_LIGHT_CONSTANT:
    case CA_LIGHT_ENVMAP: return ca_light_environment_hit(light, direction);
    case CA_LIGHT_BEAM:
    case CA_LIGHT_POINT:
    case CA_LIGHT_SPOT:
    case CA_LIGHT_DIRECTIONAL:
    case CA_LIGHT_PROJECTOR: /* no path meets a Dirac light by chance */
    case CA_LIGHT_KIND_COUNT: break;
    }
    return (ca_light_hit){0};
}

bool ca_light_has_next_event(const ca_light *light) { return light->kind != CA_LIGHT_BEAM || light->as.beam.is_flat; }

float ca_light_next_event_ratio(const ca_light *light, ca_vec3 reference, ca_vec3 position, ca_vec3 ng)
{
    switch (light->kind) {
    case CA_LIGHT_AREA: return ca_light_area_next_event_ratio(light, reference, position, ng);
    case CA_LIGHT_BEAM: return ca_light_beam_next_event_ratio(light);
    case CA_LIGHT_POINT:
    case CA_LIGHT_SPOT:
    case CA_LIGHT_DIRECTIONAL:
    case CA_LIGHT_PROJECTOR:
    case CA_LIGHT_CONSTANT:
    case CA_LIGHT_ENVMAP:
    case CA_LIGHT_KIND_COUNT: break;
    }
    return 1.0f;
}

ca_rgb ca_light_radiance(const ca_light *light, const ca_surface *surface, ca_vec3 direction)
{
    switch (light->kind) {
    case CA_LIGHT_AREA: return ca_light_area_radiance(light, surface, direction);
    case CA_LIGHT_CONSTANT:
    case CA_LIGHT_ENVMAP: return ca_light_environment_radiance(light, direction);
    case CA_LIGHT_BEAM:
    case CA_LIGHT_POINT:
    case CA_LIGHT_SPOT:
    case CA_LIGHT_DIRECTIONAL:
    case CA_LIGHT_PROJECTOR:
    case CA_LIGHT_KIND_COUNT: break;
    }
    return (ca_rgb){0};
}

/* ---- Shared by the kinds --------------------------------------------------------------------------------------- */

bool ca_light_direct_from_point(ca_vec3 position, ca_vec3 reference, ca_light_direct *direct)
{
    const ca_vec3 segment = ca_sub(position, reference);
    const float distance = ca_length(segment);
    if (!(distance > 0.0f)) return false;
    *direct = (ca_light_direct){.to_light = ca_mul(segment, 1.0f / distance),
                                .distance = distance,
                                .position = position,
                                .pdf_direct = {1.0f},
                                .pdf_position = {1.0f},
                                .cos_light = 1.0f,
                                .next_event_ratio = 1.0f};
    return true;
}

ca_vec3 ca_light_disk_point(const ca_light *light, ca_vec3 direction, ca_vec2 u)
{
    const ca_frame frame = ca_frame_from_normal(direction);
    const ca_vec2 disk = ca_warp_disk(u);
    const ca_vec3 offset = ca_to_world(&frame, (ca_vec3){disk.x, disk.y, -1.0f});
    return ca_madd(light->scene_center, light->scene_radius, offset);
}

ca_pdf_area ca_light_disk_pdf(const ca_light *light)
{
    return (ca_pdf_area){CA_INV_PI / ca_sqr(light->scene_radius)};
}

ca_vec3 ca_light_far_point(const ca_light *light, ca_vec3 reference, ca_vec3 to_light)
{
    const float reach = 2.0f * (light->scene_radius + ca_length(ca_sub(reference, light->scene_center)));
    return ca_madd(reference, reach, to_light);
}

ca_rgb ca_light_texture_at(const ca_light *light, ca_texture_id texture, ca_vec2 uv)
{
    if (texture == CA_NONE) return (ca_rgb){1.0f, 1.0f, 1.0f};
    const ca_surface surface = {.uv = uv, .shape = CA_NONE, .primitive = CA_NONE, .instance = CA_NONE};
    return ca_texture_eval(light->textures, texture, &surface);
}

double ca_light_square_mean(const ca_light *light, float (*value)(const ca_light *light, ca_vec2 u), uint32_t side)
{
    double sum = 0.0;
    for (uint32_t y = 0; y < side; y++)
        for (uint32_t x = 0; x < side; x++)
            sum += (double)value(light, (ca_vec2){((float)x + 0.5f) / (float)side, ((float)y + 0.5f) / (float)side});
    return sum / ((double)side * side);
}

float ca_light_texture_mean(const ca_light *light, ca_texture_id texture,
                            float (*luminance)(const ca_light *light, ca_vec2 u))
{
    if (texture == CA_NONE) return 1.0f;
    if (light->textures[texture].kind == CA_TEXTURE_CONSTANT)
        return (float)ca_light_square_mean(light, luminance, 1);
    return fmaxf((float)ca_light_square_mean(light, luminance, 64), 0.01f * ca_texture_max(light->textures, texture));
}
