/* A point that shines into a cone around the z axis of its frame: full intensity up to the angle `beam`, then falling
 * to 0 at `cutoff`, linearly *in the angle* or by powers of the cosine; a texture lies across the cone, its square
 * [0, 1]^2 around the cone's circle at z = 1. As Mitsuba 3's spot.cpp, whose texture rows run along +y where ours run
 * against v. */
#include "light/light_kinds.h"
#include "math/numeric.h"
#include "sampling/warp.h"

static float one_minus_cos(float angle) { return 2.0f * ca_sqr(sinf(0.5f * angle)); }

static ca_rgb texture_towards(const ca_light *light, ca_vec3 local)
{
    if (light->as.spot.texture == CA_NONE || !(local.z > 0.0f)) return (ca_rgb){1.0f, 1.0f, 1.0f};
    const float scale = 0.5f / (local.z * tanf(light->as.spot.cutoff));
    const ca_vec2 uv = {0.5f + local.x * scale, 0.5f - local.y * scale};
    return ca_light_texture_at(light, light->as.spot.texture, uv);
}

/* Where the cosine of the angle is between those of cutoff (0) and beam (1). */
static float share_of_cosines(const ca_light *light, float angle)
{
    const float end = one_minus_cos(light->as.spot.cutoff), start = one_minus_cos(light->as.spot.beam);
    return (end - one_minus_cos(angle)) / (end - start);
}

/* 0 outside of the cone. The angle comes from an arc tangent: an arc cosine has no digits near the axis. */
static float falloff(const ca_light *light, ca_vec3 local)
{
    const float cutoff = light->as.spot.cutoff, beam = light->as.spot.beam;
    const float angle = atan2f(sqrtf(ca_sqr(local.x) + ca_sqr(local.y)), local.z);
    if (angle >= cutoff) return 0.0f;
    if (angle <= beam) return 1.0f;
    if (light->as.spot.falloff == CA_FALLOFF_LINEAR) return (cutoff - angle) / (cutoff - beam);
    const float t = share_of_cosines(light, angle);
    return light->as.spot.falloff == CA_FALLOFF_SMOOTH ? ca_sqr(t) * (3.0f - 2.0f * t) : ca_sqr(ca_sqr(t));
}

static ca_rgb intensity_towards(const ca_light *light, ca_vec3 local)
{
    const float fall = falloff(light, local);
    if (!(fall > 0.0f)) return (ca_rgb){0};
    return ca_rgb_scale(ca_rgb_mul(light->as.spot.intensity, texture_towards(light, local)), fall);
}

static ca_pdf_solid_angle direction_pdf(const ca_light *light)
{
    return ca_warp_cone_pdf(one_minus_cos(light->as.spot.cutoff));
}

static float intensity_of_sample(const ca_light *light, ca_vec2 u)
{
    return ca_light_weight(intensity_towards(light, ca_warp_cone(u, one_minus_cos(light->as.spot.cutoff))));
}

/* The integral of the falloff: over the cosine t^2 (3 - 2 t) has the mean 1/2, t^4 has 1/5; full cone and linear
 * slope in the angle, each times sin theta, make 2 pi (1 - (sin cutoff - sin beam) / (cutoff - beam)). */
static double falloff_integral(const ca_light *light)
{
    const double cutoff = (double)light->as.spot.cutoff, beam = (double)light->as.spot.beam;
    const double slope = cos(beam) - cos(cutoff);
    if (!(cutoff > beam)) return 2.0 * CA_PI_D * (1.0 - cos(cutoff));
    switch (light->as.spot.falloff) {
    case CA_FALLOFF_SMOOTH: return 2.0 * CA_PI_D * (1.0 - cos(beam) + slope / 2.0);
    case CA_FALLOFF_QUARTIC: return 2.0 * CA_PI_D * (1.0 - cos(beam) + slope / 5.0);
    case CA_FALLOFF_LINEAR:
    case CA_FALLOFF_COUNT: break;
    }
    return 2.0 * CA_PI_D * (1.0 - (sin(cutoff) - sin(beam)) / (cutoff - beam));
}

/* A texture has to be summed up. */
void ca_light_spot_prepare(ca_light *light)
{
    const double integral = 2.0 * CA_PI_D * (1.0 - cos((double)light->as.spot.cutoff));
    if (light->as.spot.texture != CA_NONE) {
        light->power = (float)(integral * ca_light_square_mean(light, intensity_of_sample, 64));
        const float largest = ca_texture_max(light->textures, light->as.spot.texture);
        const float brightest = ca_light_weight(light->as.spot.intensity) * largest * (float)integral;
        light->power = fmaxf(light->power, 0.01f * brightest); /* see area.c */
        return;
    }
    light->power = (float)falloff_integral(light) * ca_light_weight(light->as.spot.intensity);
}

bool ca_light_spot_direct(const ca_light *light, ca_vec3 reference, ca_light_direct *direct)
{
    if (!ca_light_direct_from_point(light->as.spot.position, reference, direct)) return false;
    const ca_vec3 local = ca_light_to_local(&light->as.spot.map, ca_neg(direct->to_light));
    const ca_rgb intensity = intensity_towards(light, local);
    if (ca_rgb_is_black(intensity)) return false;
    direct->radiance = ca_rgb_scale(intensity, 1.0f / ca_sqr(direct->distance));
    direct->pdf_direction = direction_pdf(light);
    return true;
}

/* `local`: the direction in the light's frame. */
static bool emit(const ca_light *light, ca_vec3 direction, ca_vec3 local, ca_light_emission *emission)
{
    const ca_rgb intensity = intensity_towards(light, local);
    if (ca_rgb_is_black(intensity)) return false;
    *emission = (ca_light_emission){.origin = light->as.spot.position,
                                    .direction = direction,
                                    .radiance = intensity,
                                    .pdf_position = {1.0f},
                                    .pdf_direction = direction_pdf(light),
                                    .cos_light = 1.0f};
    return true;
}

bool ca_light_spot_emission(const ca_light *light, ca_vec2 u_direction, ca_light_emission *emission)
{
    const ca_vec3 local = ca_warp_cone(u_direction, one_minus_cos(light->as.spot.cutoff));
    return emit(light, ca_light_to_world(&light->as.spot.map, local), local, emission);
}

bool ca_light_spot_towards(const ca_light *light, ca_vec3 direction, ca_light_emission *emission)
{
    return emit(light, direction, ca_light_to_local(&light->as.spot.map, direction), emission);
}
