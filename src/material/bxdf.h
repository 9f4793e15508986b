/* Elementary BSDFs in the local shading frame (z = shading normal), textures already evaluated.
 *
 * Directions point away from the surface. wi is the direction the path came from (towards its previous vertex), wo
 * the one it goes to; both may lie on either side. `from` says at which end of the transport the path began:
 * CA_FROM_CAMERA carries importance against the light and scatters *radiance* (refraction scales it by the square of
 * the relative index), CA_FROM_LIGHT carries flux and does not scale.
 *
 *     f          value without cosine, sr^-1, of the smooth (non-Dirac) part only
 *     pdf        density of wo given wi, per solid angle, Dirac part left out
 *     pdf_reverse  density of wi given wo, as a path coming the other way would sample it
 *
 * Contracts, tested for every model: sample, eval and the pdfs agree; f(wi,wo) of reflection is symmetric,
 * f(wi,wo)/eta_i^2 of transmission too; a light-carrying and a camera-carrying walk are adjoint:
 * f(wi, wo, CA_FROM_CAMERA) = f(wo, wi, CA_FROM_LIGHT). All functions are pure. */
#ifndef CA_MATERIAL_BXDF_H
#define CA_MATERIAL_BXDF_H

#include "math/measure.h"
#include "math/rgb.h"

#include <stdint.h>

typedef enum ca_from { CA_FROM_CAMERA, CA_FROM_LIGHT } ca_from;

/* The models: MODEL(KIND, name) has the kind CA_BXDF_KIND, its parameters in as.name, and the functions ca_name_...
 * (bxdf_models.h). */
#define CA_BXDF_MODELS(MODEL)                                                                                        \
    MODEL(DIFFUSE, diffuse)                                                                                          \
    MODEL(DIELECTRIC, dielectric)                                                                                    \
    MODEL(THIN_DIELECTRIC, thin_dielectric)                                                                          \
    MODEL(ROUGH_DIELECTRIC, rough_dielectric)                                                                        \
    MODEL(CONDUCTOR, conductor)                                                                                      \
    MODEL(ROUGH_CONDUCTOR, rough_conductor)                                                                          \
    MODEL(PLASTIC, plastic)                                                                                          \
    MODEL(ROUGH_PLASTIC, rough_plastic)                                                                              \
    MODEL(PRINCIPLED, principled)                                                                                    \
    MODEL(ROUGH_DIFFUSE, rough_diffuse)                                                                              \
    MODEL(PHONG, phong)                                                                                              \
    MODEL(DIFFUSE_TRANSMITTER, diffuse_transmitter)                                                                  \
    MODEL(WARD, ward)                                                                                                \
    MODEL(PRINCIPLED_THIN, principled_thin)

#define CA_BXDF_ENUMERATOR(KIND, name) CA_BXDF_##KIND,
typedef enum ca_bxdf_kind { CA_BXDF_MODELS(CA_BXDF_ENUMERATOR) CA_BXDF_KIND_COUNT } ca_bxdf_kind;

/* What happened at a sampled vertex, and what a BSDF is capable of. */
enum {
    CA_SCATTER_REFLECTION = 1 << 0,
    CA_SCATTER_TRANSMISSION = 1 << 1,
    CA_SCATTER_DIRAC = 1 << 2,  /* the direction has a discrete probability */
    CA_SCATTER_SMOOTH = 1 << 3, /* the direction has a density */
    CA_SCATTER_NULL = 1 << 4,   /* straight on, as if nothing were there (always Dirac too) */
};

typedef enum ca_microfacet_kind { CA_MICROFACET_BECKMANN, CA_MICROFACET_GGX } ca_microfacet_kind;

/* How a Ward lobe is normalised (ward.c). */
typedef enum ca_ward_variant { CA_WARD_BALANCED, CA_WARD_DUER, CA_WARD_1992 } ca_ward_variant;

typedef struct ca_microfacet {
    ca_microfacet_kind kind;
    float alpha_x, alpha_y; /* along s and t of the frame; at least 1e-4 */
    bool sample_visible;    /* visible normals (the default) or all of them */
} ca_microfacet;

/* Tabulated transmittance through a rough dielectric boundary: rough_transmittance.h. */
struct ca_rough_transmittance;

typedef struct ca_bxdf {
    ca_bxdf_kind kind;
    union {
        struct {
            ca_rgb reflectance;
        } diffuse;
        struct {
            ca_rgb reflectance;
            float sigma; /* standard deviation of the facets' angles */
        } rough_diffuse;
        struct {
            ca_rgb diffuse, specular;
            float exponent;
            float specular_weight; /* share of samples for the lobe */
        } phong;
        struct {
            ca_rgb transmittance;
        } diffuse_transmitter;
        struct {
            ca_rgb diffuse, specular;
            float alpha_x, alpha_y;
            float specular_weight;
            ca_ward_variant variant;
        } ward;
        struct {
            float eta; /* interior over exterior index of refraction (the interior is at z < 0) */
            ca_rgb reflectance, transmittance; /* factors on the Fresnel terms, 1 in nature */
        } dielectric, thin_dielectric; /* thin: two parallel boundaries, no refraction */
        struct {
            float eta;
            ca_rgb reflectance, transmittance;
            ca_microfacet facets;
        } rough_dielectric;
        struct {
            ca_rgb eta, k; /* complex index relative to the outside */
            ca_rgb reflectance;
        } conductor;
        struct {
            ca_rgb eta, k;
            ca_rgb reflectance;
            ca_microfacet facets;
        } rough_conductor;
        struct {
            ca_rgb diffuse, specular;
            float eta;
            float internal_transmittance; /* share of diffuse light from inside that gets out */
            float specular_weight;      /* share of samples, before Fresnel, for the specular lobe */
            bool nonlinear;             /* colour shifts by internal scattering */
        } plastic;
        struct {
            ca_rgb diffuse, specular;
            float eta;
            float internal_transmittance;
            float specular_weight;
            bool nonlinear;
            ca_microfacet facets;
            const struct ca_rough_transmittance *transmittance; /* borrowed from the material */
        } rough_plastic;
        struct {
            ca_rgb base_color;
            float roughness, anisotropic, metallic, spec_trans, eta, spec_tint, sheen, sheen_tint, flatness,
                clearcoat, clearcoat_gloss;
            float diffuse_rate, specular_rate, clearcoat_rate; /* sampling rates, as Mitsuba 3 has them */
        } principled;
        struct {
            ca_rgb base_color;
            float roughness, anisotropic, spec_trans, eta, spec_tint, sheen, sheen_tint, flatness;
            float diff_trans; /* share of the base that comes out on the other side, in [0, 1] */
        } principled_thin;
    } as;
} ca_bxdf;

typedef struct ca_bxdf_value {
    ca_rgb f;
    ca_pdf_solid_angle pdf, pdf_reverse;
} ca_bxdf_value;

typedef struct ca_bxdf_sample {
    ca_vec3 wo_local;
    ca_rgb weight;                       /* f |cos wo| / pdf; of a Dirac event its value over its probability */
    ca_pdf_solid_angle pdf, pdf_reverse; /* of a Dirac event: discrete probabilities */
    uint32_t scatter;                    /* CA_SCATTER_... of this event */
    float eta; /* index of the side of wo over that of wi: 1 but for refraction; for Russian roulette */
} ca_bxdf_sample;

/* CA_SCATTER_... bits of everything this BSDF can do. */
uint32_t ca_bxdf_scatter(const ca_bxdf *bxdf);

/* The smooth part; zeros where there is none. */
ca_bxdf_value ca_bxdf_eval(const ca_bxdf *bxdf, ca_vec3 wi_local, ca_vec3 wo_local, ca_from from);

/* false: absorbed. u_lobe chooses among lobes, u the direction; all in [0, 1). */
bool ca_bxdf_sample_direction(const ca_bxdf *bxdf, ca_vec3 wi_local, float u_lobe, ca_vec2 u, ca_from from,
                              ca_bxdf_sample *sample);

/* Reflectance for first-hit layers (Albedo.*): an estimate of the hemispherical reflectance and transmittance. */
ca_rgb ca_bxdf_albedo(const ca_bxdf *bxdf, ca_vec3 wi_local);

/* What Mitsuba's layer `albedo` shows: of models with a diffuse base its colour, whatever lies on it and from either
 * side; of others the reflectance of a diffuse surface that is as bright under light along the normal. */
ca_rgb ca_bxdf_diffuse_reflectance(const ca_bxdf *bxdf, ca_vec3 wi_local);

#endif
