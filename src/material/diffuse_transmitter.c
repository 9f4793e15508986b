/* Paper, a leaf: what falls on one side leaves the other by Lambert's law, f = transmittance / pi; nothing is
 * reflected. The same from both sides. */
#include "material/bxdf_models.h"
#include "sampling/warp.h"

uint32_t ca_diffuse_transmitter_scatter(const ca_bxdf *bxdf)
{
    (void)bxdf;
    return CA_SCATTER_TRANSMISSION | CA_SCATTER_SMOOTH;
}

ca_bxdf_value ca_diffuse_transmitter_eval(CA_BXDF_EVAL_ARGUMENTS)
{
    (void)from;
    if (wi_local.z == 0.0f || wo_local.z == 0.0f || ca_same_side(wi_local, wo_local)) return ca_bxdf_value_zero();
    return (ca_bxdf_value){.f = ca_rgb_scale(bxdf->as.diffuse_transmitter.transmittance, CA_INV_PI),
                           .pdf = {fabsf(wo_local.z) * CA_INV_PI},
                           .pdf_reverse = {fabsf(wi_local.z) * CA_INV_PI}};
}

bool ca_diffuse_transmitter_sample(CA_BXDF_SAMPLE_ARGUMENTS)
{
    (void)u_lobe, (void)from;
    if (wi_local.z == 0.0f) return false;
    ca_vec3 wo = ca_warp_cosine_hemisphere(u);
    if (!(wo.z > 0.0f)) return false;
    if (wi_local.z > 0.0f) wo.z = -wo.z;
    *sample = (ca_bxdf_sample){.wo_local = wo,
                               .weight = bxdf->as.diffuse_transmitter.transmittance,
                               .pdf = {fabsf(wo.z) * CA_INV_PI},
                               .pdf_reverse = {fabsf(wi_local.z) * CA_INV_PI},
                               .scatter = CA_SCATTER_TRANSMISSION | CA_SCATTER_SMOOTH,
                               .eta = 1.0f};
    return true;
}

ca_rgb ca_diffuse_transmitter_albedo(const ca_bxdf *bxdf, ca_vec3 wi_local)
{
    (void)wi_local;
    return bxdf->as.diffuse_transmitter.transmittance;
}
