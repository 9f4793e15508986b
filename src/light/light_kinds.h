/* The kinds of lights, one file each, behind the switches of light.c. Internal to this folder.
 *
 * Functions of a kind keep the contracts of light.h; `prepare` may assume that scene_center and scene_radius are set,
 * and fills in power and tables. */
#ifndef CA_LIGHT_LIGHT_KINDS_H
#define CA_LIGHT_LIGHT_KINDS_H

#include "light/light.h"

void ca_light_area_prepare(ca_light *light);
bool ca_light_area_direct(const ca_light *light, ca_vec3 reference, ca_vec2 u, ca_light_direct *direct);
bool ca_light_area_emission(const ca_light *light, ca_vec2 u_position, ca_vec2 u_direction,
                            ca_light_emission *emission);
void ca_light_area_start(const ca_light *light, ca_vec2 u_position, ca_light_emission *emission);
bool ca_light_area_towards(ca_vec3 direction, ca_light_emission *emission);
ca_light_hit ca_light_area_hit(const ca_light *light, ca_vec3 reference, const ca_surface *surface,
                               ca_vec3 direction);
ca_rgb ca_light_area_radiance(const ca_light *light, const ca_surface *surface, ca_vec3 direction);

float ca_light_area_next_event_ratio(const ca_light *light, ca_vec3 reference, ca_vec3 position, ca_vec3 ng);

void ca_light_beam_prepare(ca_light *light);
bool ca_light_beam_direct(const ca_light *light, ca_vec3 reference, ca_light_direct *direct);
bool ca_light_beam_emission(const ca_light *light, ca_vec2 u_position, ca_light_emission *emission);
float ca_light_beam_next_event_ratio(const ca_light *light);

void ca_light_point_prepare(ca_light *light);
bool ca_light_point_direct(const ca_light *light, ca_vec3 reference, ca_light_direct *direct);
bool ca_light_point_emission(const ca_light *light, ca_vec2 u_direction, ca_light_emission *emission);
bool ca_light_point_towards(const ca_light *light, ca_vec3 direction, ca_light_emission *emission);

void ca_light_spot_prepare(ca_light *light);
bool ca_light_spot_direct(const ca_light *light, ca_vec3 reference, ca_light_direct *direct);
bool ca_light_spot_emission(const ca_light *light, ca_vec2 u_direction, ca_light_emission *emission);
bool ca_light_spot_towards(const ca_light *light, ca_vec3 direction, ca_light_emission *emission);

ca_status ca_light_projector_prepare(ca_light *light, ca_error *error);
bool ca_light_projector_direct(const ca_light *light, ca_vec3 reference, ca_light_direct *direct);
bool ca_light_projector_emission(const ca_light *light, ca_vec2 u_position, ca_light_emission *emission);

void ca_light_directional_prepare(ca_light *light);
bool ca_light_directional_direct(const ca_light *light, ca_vec3 reference, ca_light_direct *direct);
bool ca_light_directional_emission(const ca_light *light, ca_vec2 u_position, ca_light_emission *emission);

/* Constant and envmap. */
ca_status ca_light_environment_prepare(ca_light *light, ca_error *error);
bool ca_light_environment_direct(const ca_light *light, ca_vec3 reference, ca_vec2 u, ca_light_direct *direct);
bool ca_light_environment_emission(const ca_light *light, ca_vec2 u_position, ca_vec2 u_direction,
                                   ca_light_emission *emission);
ca_light_hit ca_light_environment_hit(const ca_light *light, ca_vec3 direction);
ca_rgb ca_light_environment_radiance(const ca_light *light, ca_vec3 direction);

/* ---- Shared ---------------------------------------------------------------------------------------------------- */

/* Lights at one point: the direct sample without its radiance and pdf_direction. false: the reference is the
 * light. */
bool ca_light_direct_from_point(ca_vec3 position, ca_vec3 reference, ca_light_direct *direct);

/* Lights at infinity: rays that travel along `direction` start on a disk that covers the scene's bounding sphere, in
 * front of it. */
ca_vec3 ca_light_disk_point(const ca_light *light, ca_vec3 direction, ca_vec2 u);
ca_pdf_area ca_light_disk_pdf(const ca_light *light);
/* A point towards the light, out of the scene. */
ca_vec3 ca_light_far_point(const ca_light *light, ca_vec3 reference, ca_vec3 to_light);

/* A texture that a light throws, at coordinates that belong to no surface; white where there is none. */
ca_rgb ca_light_texture_at(const ca_light *light, ca_texture_id texture, ca_vec2 uv);

/* Mean of a function over the unit square, from the centres of side x side cells. */
double ca_light_square_mean(const ca_light *light, float (*value)(const ca_light *light, ca_vec2 u), uint32_t side);

/* Mean of a texture over a surface, 1 where there is none, by `luminance` at (u, v) in the unit square, which goes
 * uniformly to its area. A grid of points may miss a small bright spot, but a light that may shine must be chosen
 * sometimes: it counts as at least a hundredth of its brightest. */
float ca_light_texture_mean(const ca_light *light, ca_texture_id texture,
                            float (*luminance)(const ca_light *light, ca_vec2 u));

static inline ca_vec3 ca_light_to_local(const ca_affine *map, ca_vec3 direction)
{
    return ca_normalize(ca_map_vector(map->from, direction));
}

static inline ca_vec3 ca_light_to_world(const ca_affine *map, ca_vec3 direction_local)
{
    return ca_normalize(ca_map_vector(map->to, direction_local));
}

/* Luminance in which negative components (which some measured pictures have) count as much as positive ones: a weight
 * for sampling that is 0 only where the colour is black. */
static inline float ca_light_weight(ca_rgb c) { return ca_luminance((ca_rgb){fabsf(c.r), fabsf(c.g), fabsf(c.b)}); }

#endif
