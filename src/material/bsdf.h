/* The BSDF at a point: a weighted set of elementary BSDFs and a part that lets light straight through, in world
 * directions, with respect to the *geometric* normal.
 *
 *     f̄(w_eye, w_light) = f(w_eye, w_light) |w_light . ns| / |w_light . ng|        (0 where the sides of ns and ng
 * differ)
 *
 * so that the transport equation holds with the geometric cosine everywhere; the factor does for paths from the
 * camera nothing else than use the shading cosine, and for paths from the light it is the adjoint correction (Veach
 * 1997, section 5.3). Every leaf may have its own shading normal (bump and normal maps). Directions point away from
 * the surface, wi towards the path's previous vertex, wo towards the next; `from` as in bxdf.h.
 *
 * A bump or normal map adds two rules (decision 024), both of the two ends, not of wi and wo:
 *     - a perturbed normal n that faces away from the eye, (w_eye . n) (w_eye . ns) < 0, leans the other way:
 *       2 (n . ns) ns - n. A path from the light does not know the eye before it has a direction, so it chooses one
 *       of the two normals at random and is absorbed where the eye demands the other: the choice is in its density.
 *     - f is multiplied by G(w_light), Smith's shadowing for GGX with a roughness made of the angle between n and ns
 *       (Conty Estevez, Lecocq, Stein 2019, "A Microfacet-Based Shadowing Function to Solve the Bump Terminator
 *       Problem", Ray Tracing Gems, chapter 12).
 *
 * A leaf is chosen with the probability of its weight, whatever the direction, so that the reverse pdf is exactly
 * what a walk from the other end would use. Which side of a twosided material is seen follows from ng, not from a
 * shading normal: both ends of a path then agree on it.
 *
 * Directions within 1e-6 of the plane of ng or of a leaf's shading normal count as in it and get zeros: there the
 * rounding of the dot product decides the side. */
#ifndef CA_MATERIAL_BSDF_H
#define CA_MATERIAL_BSDF_H

#include "material/coat.h"
#include "material/material.h"

/* A direction whose cosine with a normal is smaller has no certain side. */
#define CA_GRAZING_COS 1e-6f

/* More leaves are refused when a scene is compiled. */
enum { CA_BSDF_MAX_LOBES = 8 };

typedef struct ca_bsdf_lobe {
    ca_frame frame;
    float weight; /* product of blend weights and mask opacities */
    bool flipped; /* seen from the back of a twosided material: local z is mirrored */
    bool turns;   /* frame.n leans the other way where it faces away from the eye */
    float shadow; /* squared roughness of G; 0: there is no shadowing */
    ca_vec3 ns;   /* what frame.n was perturbed from; set if it turns or shadows */
    bool coated;  /* bxdf lies under the coat */
    ca_bxdf bxdf;
    ca_coat coat;
} ca_bsdf_lobe;

typedef struct ca_bsdf {
    ca_vec3 ng;
    float null_weight; /* share of light that goes straight on */
    uint32_t lobe_count;
    uint32_t scatter; /* CA_SCATTER_... bits of the whole */
    ca_bsdf_lobe lobes[CA_BSDF_MAX_LOBES];
} ca_bsdf;

typedef struct ca_bsdf_value {
    ca_rgb f; /* f̄ above: multiply by the geometric cosine */
    ca_pdf_solid_angle pdf, pdf_reverse;
} ca_bsdf_value;

typedef struct ca_bsdf_sample {
    ca_vec3 wo_world;
    ca_rgb weight; /* f̄ |wo . ng| / pdf; of a Dirac event its value over its probability */
    ca_pdf_solid_angle pdf, pdf_reverse;
    uint32_t scatter;
    float eta;
} ca_bsdf_sample;

/* Evaluates the material at a surface point seen from wi (which decides the side of a twosided material). */
void ca_bsdf_init(ca_bsdf *bsdf, const ca_material *materials, const ca_texture *textures, const ca_surface *surface,
                  ca_vec3 wi_world);

/* Smooth parts only; the pdfs are those of ca_bsdf_sample_direction (with the choice of the lobe in them). */
ca_bsdf_value ca_bsdf_eval(const ca_bsdf *bsdf, ca_vec3 wi_world, ca_vec3 wo_world, ca_from from);

/* false: absorbed, or a direction through which no light goes. */
bool ca_bsdf_sample_direction(const ca_bsdf *bsdf, ca_vec3 wi_world, float u_lobe, ca_vec2 u, ca_from from,
                              ca_bsdf_sample *sample);

ca_rgb ca_bsdf_albedo(const ca_bsdf *bsdf, ca_vec3 wi_world);

/* The layer `albedo` of Mitsuba's aov: ca_bxdf_diffuse_reflectance of the opaque part, however small that is. */
ca_rgb ca_bsdf_diffuse_reflectance(const ca_bsdf *bsdf, ca_vec3 wi_world);

#endif
