/* The principled BSDF of Burley (2012, 2015) as Mitsuba 3 has it (src/bsdfs/principled.cpp and principledhelpers.h):
 *
 *     specular     anisotropic GGX reflection: dielectric, tinted dielectric or metal
 *     refraction   through the same facets, tinted by the root of the base colour, by the share
 *                  transmission = (1 - metallic) spec_trans
 *     base         Burley's diffuse with retro-reflection, blended with a flat fake of subsurface scattering by
 *                  flatness, by the share base = (1 - metallic) (1 - spec_trans); and sheen
 *     clearcoat    GTR1 reflection, a quarter as strong
 *
 * From below only specular and refraction are there, and without transmission nothing. Every part is symmetric in wi
 * and wo (refraction after division by the square of the index), so the density for the reverse direction is the same
 * expression with wi and wo exchanged.
 *
 * Deviations from Mitsuba: an index of exactly 1, at which it would switch metals off, counts as 1.001. */
#include "material/burley.h"
#include "material/bxdf_models.h"
#include "material/fresnel.h"
#include "material/microfacet.h"
#include "sampling/warp.h"

#define CLEARCOAT_STRENGTH      0.25f
#define CLEARCOAT_MASKING_ALPHA 0.25f
#define CLEARCOAT_R0            0.04f

/* The parameters as the lobes use them. */
typedef struct lobes {
    ca_microfacet facets;
    float eta;                /* interior over exterior */
    float transmission, base; /* shares of refraction and base */
    float clearcoat_alpha;
    /* Probabilities of sampling from above; what is left is `specular`, shared by reflection and refraction. */
    float sample_base, sample_clearcoat, sample_specular;
} lobes;

static lobes lobes_of(const ca_bxdf *bxdf)
{
    const float metallic = bxdf->as.principled.metallic, spec_trans = bxdf->as.principled.spec_trans;
    lobes l = {.eta = bxdf->as.principled.eta == 1.0f ? 1.001f : bxdf->as.principled.eta,
               .transmission = (1.0f - metallic) * spec_trans,
               .base = (1.0f - metallic) * (1.0f - spec_trans),
               .clearcoat_alpha = ca_lerp(0.1f, 0.001f, bxdf->as.principled.clearcoat_gloss)};
    l.facets = ca_burley_facets(bxdf->as.principled.roughness, bxdf->as.principled.anisotropic);
    const float specular = bxdf->as.principled.specular_rate;
    const float base = l.base * bxdf->as.principled.diffuse_rate;
    const float clearcoat = CLEARCOAT_STRENGTH * bxdf->as.principled.clearcoat * bxdf->as.principled.clearcoat_rate;
    const float total = specular + base + clearcoat;
    const float scale = total > 0.0f ? 1.0f / total : 0.0f;
    l.sample_base = base * scale;
    l.sample_clearcoat = clearcoat * scale;
    l.sample_specular = specular * scale;
    return l;
}

/* ---- Colours --------------------------------------------------------------------------------------------------- */

/* Reflectance of the specular lobe from above; `dielectric` is the exact one of the boundary. */
static ca_rgb specular_color(const ca_bxdf *bxdf, const lobes *l, float cos_facet, float dielectric)
{
    const float metallic = bxdf->as.principled.metallic, spec_tint = bxdf->as.principled.spec_tint;
    ca_rgb color = ca_rgb_grey((1.0f - metallic) * (1.0f - spec_tint) * dielectric);
    if (!(metallic > 0.0f) && !(spec_tint > 0.0f)) return color;
    const float white = ca_schlick_weight_at(cos_facet, l->eta);
    const ca_rgb base_color = bxdf->as.principled.base_color;
    color = ca_rgb_madd(color, metallic, ca_rgb_lerp(base_color, ca_rgb_grey(1.0f), white));
    if (spec_tint > 0.0f)
        color = ca_rgb_madd(color, (1.0f - metallic) * spec_tint, ca_burley_tinted(base_color, cos_facet, l->eta));
    return color;
}

/* f of base and sheen; cos_facet is wo.m of the half vector. */
static ca_rgb base_value(const ca_bxdf *bxdf, const lobes *l, float cos_i, float cos_o, float cos_facet)
{
    const ca_rgb base_color = bxdf->as.principled.base_color;
    const float amount = ca_burley_diffuse(bxdf->as.principled.roughness, bxdf->as.principled.flatness, cos_i, cos_o,
                                           cos_facet);
    const ca_rgb f = ca_rgb_scale(base_color, l->base * CA_INV_PI * amount);
    const float sheen = bxdf->as.principled.sheen * (1.0f - bxdf->as.principled.metallic);
    if (!(sheen > 0.0f)) return f;
    return ca_rgb_madd(f, sheen, ca_burley_sheen(base_color, bxdf->as.principled.sheen_tint, cos_facet));
}

/* ---- Clearcoat ------------------------------------------------------------------------------------------------- */

/* Density of GTR1 normals, normalised like D of microfacet.h. */
static float clearcoat_density(float alpha, float cos_m)
{
    const float a2 = alpha * alpha;
    return (a2 - 1.0f) / (CA_PI * logf(a2) * (1.0f + (a2 - 1.0f) * cos_m * cos_m));
}

static ca_vec3 sample_clearcoat_normal(float alpha, ca_vec2 u)
{
    const float a2 = alpha * alpha;
    const float sin2 = ca_clamp((expf((1.0f - u.y) * logf(a2)) - a2) / (1.0f - a2), 0.0f, 1.0f);
    const float sine = sqrtf(sin2), cosine = sqrtf(1.0f - sin2);
    float sin_phi, cos_phi;
    ca_sincos(CA_TWO_PI * u.x, &sin_phi, &cos_phi);
    return (ca_vec3){cos_phi * sine, sin_phi * sine, cosine};
}

/* f of the clearcoat but for its density. */
static float clearcoat_factor(const ca_bxdf *bxdf, const lobes *l, ca_vec3 wi, ca_vec3 wo, float cos_facet)
{
    const ca_microfacet masking = {CA_MICROFACET_GGX, CLEARCOAT_MASKING_ALPHA, CLEARCOAT_MASKING_ALPHA, true};
    const float fresnel = ca_lerp(CLEARCOAT_R0, 1.0f, ca_schlick_weight_at(cos_facet, l->eta));
    return CLEARCOAT_STRENGTH * bxdf->as.principled.clearcoat * fresnel *
           ca_microfacet_masking_over_cos(&masking, wi) * wi.z * ca_microfacet_masking_over_cos(&masking, wo) * wo.z;
}

/* ---- Evaluation ------------------------------------------------------------------------------------------------ */

/* Both above. */
static ca_bxdf_value eval_above(const ca_bxdf *bxdf, const lobes *l, ca_vec3 wi, ca_vec3 wo)
{
    ca_bxdf_value value = {.pdf = {l->sample_base * wo.z * CA_INV_PI},
                           .pdf_reverse = {l->sample_base * wi.z * CA_INV_PI}};
    ca_vec3 m;
    if (!ca_half_vector(wi, wo, &m)) return ca_bxdf_value_zero();
    const float cos_facet = ca_at_most_one(ca_dot(wo, m));
    if (!(cos_facet > CA_MIN_FACET_COS)) return ca_bxdf_value_zero();
    if (l->base > 0.0f) value.f = base_value(bxdf, l, wi.z, wo.z, cos_facet);

    float cos_inside;
    const float dielectric = ca_fresnel_dielectric(cos_facet, l->eta, &cos_inside);
    const float density = ca_microfacet_density(&l->facets, m), jacobian = 0.25f / cos_facet;
    const float masking_i = ca_microfacet_masking_over_cos(&l->facets, wi);
    const float masking_o = ca_microfacet_masking_over_cos(&l->facets, wo);
    value.f =
        ca_rgb_madd(value.f, 0.25f * density * masking_i * masking_o, specular_color(bxdf, l, cos_facet, dielectric));
    const float reflects = l->sample_specular * (1.0f - l->transmission * (1.0f - dielectric)) * 0.25f * density;
    value.pdf.v += reflects * masking_i;
    value.pdf_reverse.v += reflects * masking_o;

    if (bxdf->as.principled.clearcoat > 0.0f) {
        const float coat = clearcoat_density(l->clearcoat_alpha, m.z);
        value.f = ca_rgb_add(value.f, ca_rgb_grey(coat * clearcoat_factor(bxdf, l, wi, wo, cos_facet)));
        const float pdf = l->sample_clearcoat * coat * m.z * jacobian;
        value.pdf.v += pdf;
        value.pdf_reverse.v += pdf;
    }
    return value;
}

/* Both below: the inside of the boundary. */
static ca_bxdf_value eval_below(const lobes *l, ca_vec3 wi, ca_vec3 wo)
{
    ca_vec3 m;
    if (!ca_half_vector(wi, wo, &m)) return ca_bxdf_value_zero();
    const float cos_facet = ca_at_most_one(-ca_dot(wo, m));
    if (!(cos_facet > CA_MIN_FACET_COS)) return ca_bxdf_value_zero();
    float cos_outside;
    const float fresnel = ca_fresnel_dielectric(cos_facet, 1.0f / l->eta, &cos_outside);
    const float common = 0.25f * fresnel * ca_microfacet_density(&l->facets, m);
    const float masking_i = ca_microfacet_masking_over_cos(&l->facets, wi);
    const float masking_o = ca_microfacet_masking_over_cos(&l->facets, wo);
    return (ca_bxdf_value){.f = ca_rgb_grey(l->transmission * common * masking_i * masking_o),
                           .pdf = {common * masking_i},
                           .pdf_reverse = {common * masking_o}};
}

/* On opposite sides; formulas in rough_dielectric.c. */
static ca_bxdf_value eval_through(const ca_bxdf *bxdf, const lobes *l, ca_vec3 wi, ca_vec3 wo, ca_from from)
{
    const float eta = ca_eta_seen_from(l->eta, wi.z), side = copysignf(1.0f, wi.z);
    ca_vec3 m;
    if (!ca_half_vector(wi, ca_mul(wo, eta), &m)) return ca_bxdf_value_zero();
    const float cos_i = ca_at_most_one(side * ca_dot(wi, m)), cos_o = ca_at_most_one(-side * ca_dot(wo, m));
    if (!(cos_i > CA_MIN_FACET_COS) || !(cos_o > CA_MIN_FACET_COS)) return ca_bxdf_value_zero();
    const float length = eta * cos_o - cos_i, eta2 = eta * eta;
    const float density = ca_microfacet_density(&l->facets, m);
    const float masking_i = ca_microfacet_masking_over_cos(&l->facets, wi);
    const float masking_o = ca_microfacet_masking_over_cos(&l->facets, wo);
    const float passed = ca_fresnel_transmittance(cos_i, cos_o, eta);
    const float common = passed * density * cos_i * cos_o / (length * length);

    const float f = l->transmission * common * masking_i * masking_o * (from == CA_FROM_CAMERA ? 1.0f : eta2);
    const ca_rgb c = bxdf->as.principled.base_color;
    const float from_above = l->sample_specular * l->transmission; /* from below it is all there is */
    return (ca_bxdf_value){.f = {f * ca_sqrt0(c.r), f * ca_sqrt0(c.g), f * ca_sqrt0(c.b)},
                           .pdf = {common * eta2 * masking_i * (wi.z > 0.0f ? from_above : 1.0f)},
                           .pdf_reverse = {common * masking_o * (wo.z > 0.0f ? from_above : 1.0f)}};
}

static ca_bxdf_value eval_lobes(const ca_bxdf *bxdf, const lobes *l, ca_vec3 wi, ca_vec3 wo, ca_from from)
{
    if (wi.z > 0.0f && wo.z > 0.0f) return eval_above(bxdf, l, wi, wo);
    if (!(l->transmission > 0.0f) || wi.z == 0.0f || wo.z == 0.0f) return ca_bxdf_value_zero();
    return wi.z < 0.0f && wo.z < 0.0f ? eval_below(l, wi, wo) : eval_through(bxdf, l, wi, wo, from);
}

ca_bxdf_value ca_principled_eval(const ca_bxdf *bxdf, ca_vec3 wi_local, ca_vec3 wo_local, ca_from from)
{
    const lobes l = lobes_of(bxdf);
    return eval_lobes(bxdf, &l, wi_local, wo_local, from);
}

/* ---- Sampling -------------------------------------------------------------------------------------------------- */

/* A direction of the specular lobe; u_lobe, uniform, chooses reflection or refraction. */
static bool sample_specular_direction(const lobes *l, ca_vec3 wi, float u_lobe, ca_vec2 u, ca_vec3 *wo)
{
    const float side = copysignf(1.0f, wi.z), eta = ca_eta_seen_from(l->eta, wi.z);
    const ca_vec3 m = ca_microfacet_sample(&l->facets, ca_mul(wi, side), u);
    const float cos_i = ca_at_most_one(side * ca_dot(wi, m));
    if (!(cos_i > CA_MIN_FACET_COS)) return false;
    float cos_far;
    const float fresnel = ca_fresnel_dielectric(cos_i, eta, &cos_far);
    const float refracts = wi.z > 0.0f ? l->transmission * (1.0f - fresnel) : 1.0f - fresnel;
    if (u_lobe < refracts) {
        *wo = ca_madd(ca_mul(wi, -1.0f / eta), side * (cos_i / eta - cos_far), m);
        return wo->z * side < 0.0f;
    }
    *wo = ca_reflect_about(wi, m, side * cos_i);
    return wo->z * side > 0.0f;
}

static bool sample_lobe(const lobes *l, ca_vec3 wi, float u_lobe, ca_vec2 u, ca_vec3 *wo)
{
    if (wi.z < 0.0f) return sample_specular_direction(l, wi, u_lobe, u, wo);
    if (u_lobe < l->sample_base) {
        *wo = ca_warp_cosine_hemisphere(u);
        return true;
    }
    u_lobe -= l->sample_base;
    if (u_lobe < l->sample_clearcoat) {
        const ca_vec3 m = sample_clearcoat_normal(l->clearcoat_alpha, u);
        *wo = ca_reflect_about(wi, m, ca_dot(wi, m));
        return wo->z > 0.0f;
    }
    u_lobe -= l->sample_clearcoat;
    return sample_specular_direction(l, wi, u_lobe / l->sample_specular, u, wo);
}

bool ca_principled_sample(CA_BXDF_SAMPLE_ARGUMENTS)
{
    const lobes l = lobes_of(bxdf);
    if (wi_local.z == 0.0f || (wi_local.z < 0.0f && !(l.transmission > 0.0f))) return false;
    if (wi_local.z > 0.0f && l.sample_base + l.sample_clearcoat + l.sample_specular == 0.0f) return false;
    ca_vec3 wo;
    if (!sample_lobe(&l, wi_local, u_lobe, u, &wo)) return false;
    const ca_bxdf_value value = eval_lobes(bxdf, &l, wi_local, wo, from);
    if (!(value.pdf.v > 0.0f)) return false;
    const bool passes = !ca_same_side(wi_local, wo);
    *sample =
        (ca_bxdf_sample){.wo_local = wo,
                         .weight = ca_rgb_scale(value.f, fabsf(wo.z) / value.pdf.v),
                         .pdf = value.pdf,
                         .pdf_reverse = value.pdf_reverse,
                         .scatter = (passes ? CA_SCATTER_TRANSMISSION : CA_SCATTER_REFLECTION) | CA_SCATTER_SMOOTH,
                         .eta = passes ? ca_eta_seen_from(l.eta, wi_local.z) : 1.0f};
    return true;
}

uint32_t ca_principled_scatter(const ca_bxdf *bxdf)
{
    const bool transmits = (1.0f - bxdf->as.principled.metallic) * bxdf->as.principled.spec_trans > 0.0f;
    return CA_SCATTER_REFLECTION | CA_SCATTER_SMOOTH | (transmits ? CA_SCATTER_TRANSMISSION : 0);
}

/* The base colour where light is scattered or reflected by metal, its root where it passes. */
ca_rgb ca_principled_albedo(const ca_bxdf *bxdf, ca_vec3 wi_local)
{
    const lobes l = lobes_of(bxdf);
    const ca_rgb c = bxdf->as.principled.base_color;
    const ca_rgb root = {ca_sqrt0(c.r), ca_sqrt0(c.g), ca_sqrt0(c.b)};
    if (!(wi_local.z > 0.0f)) return ca_rgb_scale(root, l.transmission);
    return ca_rgb_madd(ca_rgb_scale(c, 1.0f - l.transmission), l.transmission, root);
}
