/* Lambert's reflector: f = reflectance / pi on the upper side, black from below. */
#include "material/bxdf_models.h"
#include "sampling/warp.h"

uint32_t ca_diffuse_scatter(const ca_bxdf *bxdf)
{
    (void)bxdf;
    return CA_SCATTER_REFLECTION | CA_SCATTER_SMOOTH;
}

ca_bxdf_value ca_diffuse_eval(CA_BXDF_EVAL_ARGUMENTS)
{
    (void)from;
    if (!(wi_local.z > 0.0f) || !(wo_local.z > 0.0f)) return ca_bxdf_value_zero();
    return (ca_bxdf_value){.f = ca_rgb_scale(bxdf->as.diffuse.reflectance, CA_INV_PI),
                           .pdf = {wo_local.z * CA_INV_PI},
                           .pdf_reverse = {wi_local.z * CA_INV_PI}};
}

bool ca_diffuse_sample(CA_BXDF_SAMPLE_ARGUMENTS)
{
    (void)u_lobe, (void)from;
    if (!(wi_local.z > 0.0f)) return false;
    const ca_vec3 wo = ca_warp_cosine_hemisphere(u);
    if (!(wo.z > 0.0f)) return false;
    *sample = (ca_bxdf_sample){.wo_local = wo,
                               .weight = bxdf->as.diffuse.reflectance,
                               .pdf = {wo.z * CA_INV_PI},
                               .pdf_reverse = {wi_local.z * CA_INV_PI},
                               .scatter = CA_SCATTER_REFLECTION | CA_SCATTER_SMOOTH,
                               .eta = 1.0f};
    return true;
}

ca_rgb ca_diffuse_albedo(const ca_bxdf *bxdf, ca_vec3 wi_local)
{
    return wi_local.z > 0.0f ? bxdf->as.diffuse.reflectance : ca_rgb_grey(0.0f);
}
