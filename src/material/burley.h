/* What the principled BSDFs of Burley share, solid (principled.c) and thin (principled_thin.c): Schlick's weights,
 * the tint, the diffuse base and the sheen (Burley 2012, "Physically-Based Shading at Disney"; 2015, "Extending the
 * Disney BRDF to a BSDF with Integrated Subsurface Scattering"), as Mitsuba 3 has them.
 *
 * Cosines are those with the normal, at least 0; cos_facet is that of either direction with their half vector. */
#ifndef CA_MATERIAL_BURLEY_H
#define CA_MATERIAL_BURLEY_H

#include "material/fresnel.h"
#include "material/microfacet.h"
#include "math/numeric.h"

/* (1 - cosine)^5 */
static inline float ca_schlick_weight(float cosine)
{
    const float x = ca_clamp(1.0f - cosine, 0.0f, 1.0f), x2 = x * x;
    return x2 * x2 * x;
}

/* Weight of white in Schlick's approximation, from above: of the angle in the thinner medium. */
static inline float ca_schlick_weight_at(float cos_facet, float eta)
{
    if (eta > 1.0f) return ca_schlick_weight(cos_facet);
    float cos_inside;
    ca_fresnel_dielectric(cos_facet, eta, &cos_inside);
    return ca_schlick_weight(cos_inside);
}

/* The hue of the base colour at luminance 1. */
static inline ca_rgb ca_burley_tint(ca_rgb base_color)
{
    const float luminance = ca_luminance(base_color);
    return luminance > 0.0f ? ca_rgb_scale(base_color, 1.0f / luminance) : ca_rgb_grey(1.0f);
}

/* A boundary's reflectance by Schlick's approximation, tinted at normal incidence. */
static inline ca_rgb ca_burley_tinted(ca_rgb base_color, float cos_facet, float eta)
{
    const float r0 = ca_sqr((eta - 1.0f) / (eta + 1.0f));
    const ca_rgb normal = ca_rgb_scale(ca_burley_tint(base_color), r0);
    return ca_rgb_lerp(normal, ca_rgb_grey(1.0f), ca_schlick_weight_at(cos_facet, eta));
}

/* Facets of a roughness, isotropic or not. */
static inline ca_microfacet ca_burley_facets(float roughness, float anisotropic)
{
    const float roughness2 = roughness * roughness, aspect = sqrtf(1.0f - 0.9f * anisotropic);
    return ca_microfacet_make(CA_MICROFACET_GGX, ca_max(roughness2 / aspect, 0.001f),
                              ca_max(roughness2 * aspect, 0.001f), true);
}

/* pi f of the diffuse base over its colour: with retro-reflection, blended with a flat fake of subsurface scattering
 * by flatness. */
static inline float ca_burley_diffuse(float roughness, float flatness, float cos_i, float cos_o, float cos_facet)
{
    const float w_i = ca_schlick_weight(cos_i), w_o = ca_schlick_weight(cos_o);
    const float retro = 2.0f * roughness * cos_facet * cos_facet;
    const float amount =
        (1.0f - 0.5f * w_i) * (1.0f - 0.5f * w_o) + retro * (w_o + w_i + w_o * w_i * (retro - 1.0f));
    if (!(flatness > 0.0f)) return amount;
    const float fss = ca_lerp(1.0f, 0.5f * retro, w_o) * ca_lerp(1.0f, 0.5f * retro, w_i);
    const float sum = ca_max(cos_i + cos_o, 1e-6f); /* both at the horizon: the quotient has no limit */
    return ca_lerp(amount, 1.25f * (fss * (1.0f / sum - 0.5f) + 0.5f), flatness);
}

/* f of the sheen at full strength. */
static inline ca_rgb ca_burley_sheen(ca_rgb base_color, float sheen_tint, float cos_facet)
{
    const ca_rgb color = ca_rgb_lerp(ca_rgb_grey(1.0f), ca_burley_tint(base_color), sheen_tint);
    return ca_rgb_scale(color, ca_schlick_weight(cos_facet));
}

#endif
