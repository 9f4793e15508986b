/* Texture coordinates (s, t) that follow from a point q of the texture's own space, as pbrt has them (pbrt-v4,
 * src/pbrt/textures.h):
 *
 *     planar       (q_x, q_y)
 *     cylindrical  ((pi + phi) / 2 pi, q_z), phi the angle around z, in (-pi, pi]
 *     spherical    (theta / pi, phi / 2 pi), theta the angle from z, phi in [0, 2 pi)
 *
 * Pure functions. */
#ifndef CA_MATERIAL_TEXTURE_MAPPING_H
#define CA_MATERIAL_TEXTURE_MAPPING_H

#include "math/vec.h"

typedef enum ca_texture_mapping {
    CA_MAPPING_PLANAR,
    CA_MAPPING_CYLINDRICAL,
    CA_MAPPING_SPHERICAL
} ca_texture_mapping;

ca_vec2 ca_texture_mapping_at(ca_texture_mapping mapping, ca_vec3 q);
/* How fast (s, t) changes where q moves by d. On the z axis, where phi has no slope, by none of phi or theta. */
ca_vec2 ca_texture_mapping_slope(ca_texture_mapping mapping, ca_vec3 q, ca_vec3 d);

#endif
