/* A smooth metal: a mirror coloured by its Fresnel reflectance, black from below. */
#include "material/bxdf_models.h"
#include "material/fresnel.h"

ca_rgb ca_conductor_albedo(const ca_bxdf *bxdf, ca_vec3 wi_local)
{
    if (!(wi_local.z > 0.0f)) return ca_rgb_grey(0.0f);
    const ca_rgb fresnel =
        ca_fresnel_conductor_rgb(ca_at_most_one(wi_local.z), bxdf->as.conductor.eta, bxdf->as.conductor.k);
    return ca_rgb_mul(fresnel, bxdf->as.conductor.reflectance);
}

uint32_t ca_conductor_scatter(const ca_bxdf *bxdf)
{
    (void)bxdf;
    return CA_SCATTER_REFLECTION | CA_SCATTER_DIRAC;
}

ca_bxdf_value ca_conductor_eval(CA_BXDF_EVAL_ARGUMENTS)
{
    (void)bxdf, (void)wi_local, (void)wo_local, (void)from;
    return ca_bxdf_value_zero();
}

bool ca_conductor_sample(CA_BXDF_SAMPLE_ARGUMENTS)
{
    (void)u_lobe, (void)u, (void)from;
    if (!(wi_local.z > 0.0f)) return false;
    *sample = (ca_bxdf_sample){.wo_local = ca_reflect_local(wi_local),
                               .weight = ca_conductor_albedo(bxdf, wi_local),
                               .pdf = {1.0f},
                               .pdf_reverse = {1.0f},
                               .scatter = CA_SCATTER_REFLECTION | CA_SCATTER_DIRAC,
                               .eta = 1.0f};
    return true;
}
