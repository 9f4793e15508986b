/* A rough coat of a clear medium on a diffuse base: plastic.c with the mirror replaced by facets and the passages
 * through the boundary by their tabulated shares T (rough_transmittance.h).
 *
 *     f = specular F D G / (4 cos_i cos_o)  +  T_i T_o diffuse / (pi eta^2 (1 - rho diffuse))
 *
 * Black from below. (Mitsuba 3, src/bsdfs/roughplastic.cpp.) */
#include "material/bxdf_models.h"
#include "material/coat.h"
#include "material/fresnel.h"
#include "material/microfacet.h"
#include "material/rough_transmittance.h"
#include "sampling/warp.h"

static float transmittance_at(const ca_bxdf *bxdf, float cosine)
{
    return ca_rough_transmittance_eval(bxdf->as.rough_plastic.transmittance, cosine);
}

/* Probability of sampling the facets, by what they reflect and the material's weights. */
static float facet_probability(const ca_bxdf *bxdf, float transmitted)
{
    const float facets = (1.0f - transmitted) * bxdf->as.rough_plastic.specular_weight;
    const float base = transmitted * (1.0f - bxdf->as.rough_plastic.specular_weight);
    return facets + base > 0.0f ? facets / (facets + base) : 1.0f;
}

static ca_rgb base_reflectance(const ca_bxdf *bxdf)
{
    const ca_rgb d = bxdf->as.rough_plastic.diffuse;
    const float out = bxdf->as.rough_plastic.internal_transmittance;
    const float inv_eta2 = 1.0f / ca_sqr(bxdf->as.rough_plastic.eta);
    if (!bxdf->as.rough_plastic.nonlinear) return ca_rgb_scale(d, inv_eta2 / out);
    return (ca_rgb){d.r * inv_eta2 / (1.0f - d.r + out * d.r), d.g * inv_eta2 / (1.0f - d.g + out * d.g),
                    d.b * inv_eta2 / (1.0f - d.b + out * d.b)};
}

uint32_t ca_rough_plastic_scatter(const ca_bxdf *bxdf)
{
    (void)bxdf;
    return CA_SCATTER_REFLECTION | CA_SCATTER_SMOOTH;
}

ca_bxdf_value ca_rough_plastic_eval(CA_BXDF_EVAL_ARGUMENTS)
{
    (void)from;
    if (!(wi_local.z > 0.0f) || !(wo_local.z > 0.0f)) return ca_bxdf_value_zero();
    const float t_i = transmittance_at(bxdf, wi_local.z), t_o = transmittance_at(bxdf, wo_local.z);
    const float probability_i = facet_probability(bxdf, t_i), probability_o = facet_probability(bxdf, t_o);
    ca_bxdf_value value = {.f = ca_rgb_scale(base_reflectance(bxdf), CA_INV_PI * t_i * t_o),
                           .pdf = {(1.0f - probability_i) * wo_local.z * CA_INV_PI},
                           .pdf_reverse = {(1.0f - probability_o) * wi_local.z * CA_INV_PI}};
    ca_coat_add_facets(&bxdf->as.rough_plastic.facets, bxdf->as.rough_plastic.eta, bxdf->as.rough_plastic.specular,
                       wi_local, wo_local, probability_i, probability_o, &value);
    return value;
}

bool ca_rough_plastic_sample(CA_BXDF_SAMPLE_ARGUMENTS)
{
    if (!(wi_local.z > 0.0f)) return false;
    ca_vec3 wo;
    if (u_lobe < facet_probability(bxdf, transmittance_at(bxdf, wi_local.z))) {
        const ca_vec3 m = ca_microfacet_sample(&bxdf->as.rough_plastic.facets, wi_local, u);
        wo = ca_reflect_about(wi_local, m, ca_dot(wi_local, m));
    } else {
        wo = ca_warp_cosine_hemisphere(u);
    }
    const ca_bxdf_value value = ca_rough_plastic_eval(bxdf, wi_local, wo, from);
    return ca_bxdf_reflect(&value, wo, sample);
}

/* What is not transmitted counts as reflected by the facets. */
ca_rgb ca_rough_plastic_albedo(const ca_bxdf *bxdf, ca_vec3 wi_local)
{
    if (!(wi_local.z > 0.0f)) return ca_rgb_grey(0.0f);
    const float t_i = transmittance_at(bxdf, wi_local.z);
    const float out = ca_sqr(bxdf->as.rough_plastic.eta) * bxdf->as.rough_plastic.internal_transmittance;
    return ca_rgb_madd(ca_rgb_scale(bxdf->as.rough_plastic.specular, 1.0f - t_i), t_i * out, base_reflectance(bxdf));
}
