/* A rough diffuse surface: V-shaped grooves of Lambertian facets, black from below (Oren and Nayar 1994,
 * "Generalization of Lambert's Reflectance Model"; the simplified form with A and B, without light between facets).
 *
 *     f = rho / pi (A + B max(0, cos(phi_i - phi_o)) sin a tan b),    a, b the greater and the smaller angle
 *     A = 1 - s^2 / (2 (s^2 + 0.33)),    B = 0.45 s^2 / (s^2 + 0.09),    s the standard deviation of facets' angles
 *
 * Directions are sampled by their cosine: f is nearly constant. */
#include "material/bxdf_models.h"
#include "math/numeric.h"
#include "sampling/warp.h"

/* A + B ...; both directions lie above. sin a tan b cos(phi_i - phi_o) is the product of the horizontal parts over
 * the greater cosine. It grows without bound where both are grazing: there it ends at 1e6. */
static float groove_factor(const ca_bxdf *bxdf, ca_vec3 wi, ca_vec3 wo)
{
    const float s2 = ca_sqr(bxdf->as.rough_diffuse.sigma);
    const float along = wi.x * wo.x + wi.y * wo.y;
    const float a = 1.0f - 0.5f * s2 / (s2 + 0.33f), b = 0.45f * s2 / (s2 + 0.09f);
    return a + b * ca_max(0.0f, along) / ca_max(ca_max(wi.z, wo.z), 1e-6f);
}

uint32_t ca_rough_diffuse_scatter(const ca_bxdf *bxdf)
{
    (void)bxdf;
    return CA_SCATTER_REFLECTION | CA_SCATTER_SMOOTH;
}

ca_bxdf_value ca_rough_diffuse_eval(CA_BXDF_EVAL_ARGUMENTS)
{
    (void)from;
    if (!(wi_local.z > 0.0f) || !(wo_local.z > 0.0f)) return ca_bxdf_value_zero();
    const float factor = CA_INV_PI * groove_factor(bxdf, wi_local, wo_local);
    return (ca_bxdf_value){.f = ca_rgb_scale(bxdf->as.rough_diffuse.reflectance, factor),
                           .pdf = {wo_local.z * CA_INV_PI},
                           .pdf_reverse = {wi_local.z * CA_INV_PI}};
}

bool ca_rough_diffuse_sample(CA_BXDF_SAMPLE_ARGUMENTS)
{
    (void)u_lobe, (void)from;
    if (!(wi_local.z > 0.0f)) return false;
    const ca_vec3 wo = ca_warp_cosine_hemisphere(u);
    if (!(wo.z > 0.0f)) return false;
    const float factor = groove_factor(bxdf, wi_local, wo);
    *sample = (ca_bxdf_sample){.wo_local = wo,
                               .weight = ca_rgb_scale(bxdf->as.rough_diffuse.reflectance, factor),
                               .pdf = {wo.z * CA_INV_PI},
                               .pdf_reverse = {wi_local.z * CA_INV_PI},
                               .scatter = CA_SCATTER_REFLECTION | CA_SCATTER_SMOOTH,
                               .eta = 1.0f};
    return true;
}

/* That of a smooth one: roughness moves light, and takes at most a few percent of it. */
ca_rgb ca_rough_diffuse_albedo(const ca_bxdf *bxdf, ca_vec3 wi_local)
{
    return wi_local.z > 0.0f ? bxdf->as.rough_diffuse.reflectance : ca_rgb_grey(0.0f);
}
