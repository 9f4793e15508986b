/* Statistics of rough surfaces: Beckmann and GGX distributions of microfacet normals, their Smith masking, and
 * sampling of normals.
 *
 * Directions are local (z = mean normal). m is a microfacet normal, m.z > 0; v is the viewing direction, and stands
 * for itself and for -v: a surface is as rough from below. Masking is separable, G = G1(wi) G1(wo); whether the facet
 * turns the same side to v as the mean surface does (v.m v.z > 0) is for the caller to check.
 *
 *     D(m)        area density of normals, sr^-1:  integral of D(m) m.z over the upper hemisphere = 1
 *     G1(v)       share of facets facing v that v can see; here divided by |v.z|, since that quotient stays finite at
 *                 grazing angles and it is the one that reflection needs: f = F D g(wi) g(wo) / 4
 *     D_v(m)      density of *visible* normals = D(m) |v.m| G1(v)/|v.z|
 *
 * The model is that of Mitsuba 3 (include/mitsuba/render/microfacet.h, which names the papers), except that G1 of
 * Beckmann is exact where Mitsuba has a rational fit (error up to 0.35 %), so that D_v is normalised. */
#ifndef CA_MATERIAL_MICROFACET_H
#define CA_MATERIAL_MICROFACET_H

#include "material/bxdf.h"
#include "math/numeric.h"
#include "math/vec.h"

#define CA_MICROFACET_MIN_ALPHA 1e-4f

/* Clamps the roughness from below at CA_MICROFACET_MIN_ALPHA: less is a mirror to single precision. */
static inline ca_microfacet ca_microfacet_make(ca_microfacet_kind kind, float alpha_x, float alpha_y,
                                               bool sample_visible)
{
    return (ca_microfacet){.kind = kind,
                           .alpha_x = ca_max(alpha_x, CA_MICROFACET_MIN_ALPHA),
                           .alpha_y = ca_max(alpha_y, CA_MICROFACET_MIN_ALPHA),
                           .sample_visible = sample_visible};
}

/* D(m); 0 for m.z <= 0. */
float ca_microfacet_density(const ca_microfacet *facets, ca_vec3 m);

/* G1(v) / |v.z|, finite for all v (at most 2 / alpha). */
float ca_microfacet_masking_over_cos(const ca_microfacet *facets, ca_vec3 v);

/* A normal, for v.z > 0, with density D_v(m) (facets->sample_visible) or D(m) m.z. */
ca_vec3 ca_microfacet_sample(const ca_microfacet *facets, ca_vec3 v, ca_vec2 u);

/* The density of the above per solid angle of m, given D(m), G1(v)/|v.z| and |v.m|. */
static inline float ca_microfacet_pdf(const ca_microfacet *facets, float density, float masking_over_cos,
                                      float abs_cos_vm, float cos_m)
{
    return density * (facets->sample_visible ? masking_over_cos * abs_cos_vm : cos_m);
}

#endif
