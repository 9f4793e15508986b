/* A smooth coat of a clear medium on a diffuse base. Light that gets through the coat scatters below, is partly
 * reflected back down by the inside of the boundary, and so on until it gets out:
 *
 *     f = specular Dirac mirror F(cos_i)  +  (1 - F_i) (1 - F_o) diffuse / (pi eta^2 (1 - rho diffuse))
 *
 * rho is the diffuse reflectance of the boundary from inside, kept as 1 - rho, which falls with the square of the
 * index; with nonlinear = false the denominator has rho alone, which keeps the base's colour. Black from below.
 * (Mitsuba 3, src/bsdfs/plastic.cpp.) */
#include "material/bxdf_models.h"
#include "material/fresnel.h"
#include "sampling/warp.h"

static float reflectance_at(const ca_bxdf *bxdf, float cosine)
{
    float cos_inside;
    return ca_fresnel_dielectric(cosine, bxdf->as.plastic.eta, &cos_inside);
}

/* Probability of the mirror, by its Fresnel reflectance and the material's weights. */
static float mirror_probability(const ca_bxdf *bxdf, float reflected)
{
    const float mirror = reflected * bxdf->as.plastic.specular_weight;
    const float base = (1.0f - reflected) * (1.0f - bxdf->as.plastic.specular_weight);
    return mirror + base > 0.0f ? mirror / (mirror + base) : 1.0f;
}

/* Of the base, with all that happens under the coat, but without the two passages through it. */
static ca_rgb base_reflectance(const ca_bxdf *bxdf)
{
    const ca_rgb d = bxdf->as.plastic.diffuse;
    const float out = bxdf->as.plastic.internal_transmittance;
    const float inv_eta2 = 1.0f / ca_sqr(bxdf->as.plastic.eta);
    if (!bxdf->as.plastic.nonlinear) return ca_rgb_scale(d, inv_eta2 / out);
    return (ca_rgb){d.r * inv_eta2 / (1.0f - d.r + out * d.r), d.g * inv_eta2 / (1.0f - d.g + out * d.g),
                    d.b * inv_eta2 / (1.0f - d.b + out * d.b)};
}

uint32_t ca_plastic_scatter(const ca_bxdf *bxdf)
{
    (void)bxdf;
    return CA_SCATTER_REFLECTION | CA_SCATTER_DIRAC | CA_SCATTER_SMOOTH;
}

ca_bxdf_value ca_plastic_eval(CA_BXDF_EVAL_ARGUMENTS)
{
    (void)from;
    if (!(wi_local.z > 0.0f) || !(wo_local.z > 0.0f)) return ca_bxdf_value_zero();
    const float f_i = reflectance_at(bxdf, wi_local.z), f_o = reflectance_at(bxdf, wo_local.z);
    const float passage = CA_INV_PI * (1.0f - f_i) * (1.0f - f_o);
    return (ca_bxdf_value){.f = ca_rgb_scale(base_reflectance(bxdf), passage),
                           .pdf = {(1.0f - mirror_probability(bxdf, f_i)) * wo_local.z * CA_INV_PI},
                           .pdf_reverse = {(1.0f - mirror_probability(bxdf, f_o)) * wi_local.z * CA_INV_PI}};
}

bool ca_plastic_sample(CA_BXDF_SAMPLE_ARGUMENTS)
{
    (void)from;
    if (!(wi_local.z > 0.0f)) return false;
    const float f_i = reflectance_at(bxdf, wi_local.z), mirror = mirror_probability(bxdf, f_i);
    if (u_lobe < mirror) {
        *sample = (ca_bxdf_sample){.wo_local = ca_reflect_local(wi_local),
                                   .weight = ca_rgb_scale(bxdf->as.plastic.specular, f_i / mirror),
                                   .pdf = {mirror},
                                   .pdf_reverse = {mirror},
                                   .scatter = CA_SCATTER_REFLECTION | CA_SCATTER_DIRAC,
                                   .eta = 1.0f};
        return true;
    }
    const ca_vec3 wo = ca_warp_cosine_hemisphere(u);
    const float base = 1.0f - mirror;
    if (!(wo.z > 0.0f) || !(base > 0.0f)) return false;
    const float f_o = reflectance_at(bxdf, wo.z);
    *sample = (ca_bxdf_sample){.wo_local = wo,
                               .weight = ca_rgb_scale(base_reflectance(bxdf), (1.0f - f_i) * (1.0f - f_o) / base),
                               .pdf = {base * wo.z * CA_INV_PI},
                               .pdf_reverse = {(1.0f - mirror_probability(bxdf, f_o)) * wi_local.z * CA_INV_PI},
                               .scatter = CA_SCATTER_REFLECTION | CA_SCATTER_SMOOTH,
                               .eta = 1.0f};
    return true;
}

/* Exact: the share of diffuse light from inside that gets out is eta^2 (1 - rho) times that of 1 - F outside. */
ca_rgb ca_plastic_albedo(const ca_bxdf *bxdf, ca_vec3 wi_local)
{
    if (!(wi_local.z > 0.0f)) return ca_rgb_grey(0.0f);
    const float f_i = reflectance_at(bxdf, wi_local.z);
    const float out = ca_sqr(bxdf->as.plastic.eta) * bxdf->as.plastic.internal_transmittance;
    return ca_rgb_madd(ca_rgb_scale(bxdf->as.plastic.specular, f_i), (1.0f - f_i) * out, base_reflectance(bxdf));
}
