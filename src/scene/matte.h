/* Which shapes and lights are so regular that the integrators treat eight of them at a time.
 *
 * A matte shape is a mesh without vertex normals, of the world, whose material is diffuse with one reflectance (alone
 * or twosided): its surface point and BSDF follow from the hit and a few numbers. A patterned shape is one that would
 * be matte but for textures: only the reflectance has to be looked up. An even light is a mesh without
 * vertex normals that emits one radiance. All other shapes and lights go through the scalar interfaces (accel.h,
 * bsdf.h, light.h), which give the same bits for the regular ones too: tests hold the two against each other. */
#ifndef CA_SCENE_MATTE_H
#define CA_SCENE_MATTE_H

#include "light/light.h"
#include "material/material.h"

typedef struct ca_matte_shape {
    bool is_matte;
    bool is_patterned;
    bool back_is_front; /* twosided: seen from the back, the frame is mirrored */
    bool passes;        /* of any shape: light gets through it, refracted or scattered or as if nothing were there */
    float extent;       /* as the shape's; likewise: */
    uint32_t light;
    ca_rgb reflectance[2]; /* seen from the front, from the back; a one-sided material has the same twice */
    ca_texture_id pattern[2]; /* patterned only: whose colour it is instead, or CA_NONE */
} ca_matte_shape;

/* -1 where the frame is mirrored for a path that arrives with this cosine to the normal, else 1. */
static inline float ca_matte_side(const ca_matte_shape *shape, float cos_in)
{
    return shape->back_is_front && cos_in < 0.0f ? -1.0f : 1.0f;
}

/* All that next event reads of a light whose points are chosen by area, in one cache line: of many lights each is
 * chosen seldom. */
typedef struct ca_even_light {
    _Alignas(64) ca_rgb radiance;
    float pdf_area; /* 1 / area */
    bool is_even;
    bool is_plain; /* the corners tell all: those of a plain rectangle (geometry/rectangle.h) */
    ca_vec3 corner, end_x, end_y;
    float large_distance2; /* from the rectangle's centre: sampled by area beyond; -1: by area everywhere */
} ca_even_light;

/* false where the light is sampled by area for sure, as ca_rectangle_may_look_large begins. */
static inline bool ca_even_light_is_near(const ca_even_light *light, ca_vec3 reference)
{
    const ca_vec3 center = ca_mul(ca_add(light->end_x, light->end_y), 0.5f);
    return !(ca_length2(ca_sub(reference, center)) > light->large_distance2);
}

/* ca_light_sample_direct, to the bit, mostly without reading more than `even`, which is `light`'s. */
bool ca_even_light_sample_direct(const ca_even_light *even, const ca_light *light, ca_vec3 reference, ca_vec2 u,
                                 ca_light_direct *direct);

/* One for each shape; NULL when out of memory. To be freed with ca_free. `world_count`: shapes behind are in
 * groups. */
ca_matte_shape *ca_matte_shapes_create(const ca_shape *shapes, uint32_t count, uint32_t world_count,
                                       const ca_material *materials, const ca_texture *textures);
/* One for each light, likewise. */
ca_even_light *ca_even_lights_create(const ca_light *lights, uint32_t count, const ca_texture *textures);

#endif
