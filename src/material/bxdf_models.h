/* The models behind bxdf.h: four functions each, with the contracts written there. Only bxdf.c calls them. */
#ifndef CA_MATERIAL_BXDF_MODELS_H
#define CA_MATERIAL_BXDF_MODELS_H

#include "material/bxdf.h"

#define CA_BXDF_EVAL_ARGUMENTS const ca_bxdf *bxdf, ca_vec3 wi_local, ca_vec3 wo_local, ca_from from
#define CA_BXDF_SAMPLE_ARGUMENTS                                                                                     \
    const ca_bxdf *bxdf, ca_vec3 wi_local, float u_lobe, ca_vec2 u, ca_from from, ca_bxdf_sample *sample

#define CA_BXDF_DECLARE(KIND, name)                                                                                  \
    uint32_t ca_##name##_scatter(const ca_bxdf *bxdf);                                                               \
    ca_bxdf_value ca_##name##_eval(CA_BXDF_EVAL_ARGUMENTS); /* zero without a smooth part */                         \
    bool ca_##name##_sample(CA_BXDF_SAMPLE_ARGUMENTS);                                                               \
    ca_rgb ca_##name##_albedo(const ca_bxdf *bxdf, ca_vec3 wi_local);

CA_BXDF_MODELS(CA_BXDF_DECLARE)

static inline ca_bxdf_value ca_bxdf_value_zero(void) { return (ca_bxdf_value){.f = {0.0f, 0.0f, 0.0f}}; }

/* Facets seen at a smaller cosine are edge-on: nothing of them is visible, and quotients by it might overflow. */
#define CA_MIN_FACET_COS 1e-12f

/* A cosine that rounding may have carried beyond 1. (fminf would be a call: it has rules for NaN.) */
static inline float ca_at_most_one(float cosine) { return cosine < 1.0f ? cosine : 1.0f; }

/* Index of the other side over that of the side w lies on. */
static inline float ca_eta_seen_from(float eta, float cos_w) { return cos_w > 0.0f ? eta : 1.0f / eta; }

/* Do two directions off the horizon lie on the same side? (The product of their cosines may underflow.) */
static inline bool ca_same_side(ca_vec3 wi, ca_vec3 wo) { return (wi.z > 0.0f) == (wo.z > 0.0f); }

/* Reflection of w about m, given w.m. */
static inline ca_vec3 ca_reflect_about(ca_vec3 w, ca_vec3 m, float cos_wm)
{
    return ca_madd(ca_neg(w), 2.0f * cos_wm, m);
}

/* Half vector of two directions, turned to z > 0; false where they are opposite, or both so near to the horizon that
 * their sum has no direction. */
static inline bool ca_half_vector(ca_vec3 wi, ca_vec3 wo, ca_vec3 *m)
{
    const ca_vec3 sum = ca_add(wi, wo);
    const float length2 = ca_length2(sum);
    if (!(length2 > 1e-30f)) return false;
    *m = ca_mul(sum, copysignf(1.0f / sqrtf(length2), sum.z));
    return m->z > 0.0f;
}

/* A reflection whose direction was chosen among several lobes: weight and densities are those of all of them. false:
 * absorbed. */
static inline bool ca_bxdf_reflect(const ca_bxdf_value *value, ca_vec3 wo_local, ca_bxdf_sample *sample)
{
    if (!(value->pdf.v > 0.0f)) return false;
    *sample = (ca_bxdf_sample){.wo_local = wo_local,
                               .weight = ca_rgb_scale(value->f, wo_local.z / value->pdf.v),
                               .pdf = value->pdf,
                               .pdf_reverse = value->pdf_reverse,
                               .scatter = CA_SCATTER_REFLECTION | CA_SCATTER_SMOOTH,
                               .eta = 1.0f};
    return true;
}

#endif
