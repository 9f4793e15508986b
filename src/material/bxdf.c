/* Which model does what: the closed set of elementary BSDFs. */
#include "material/bxdf.h"

#include "material/bxdf_models.h"

#include <assert.h>

uint32_t ca_bxdf_scatter(const ca_bxdf *bxdf)
{
    switch (bxdf->kind) {
    case CA_BXDF_DIFFUSE:
    case CA_BXDF_ROUGH_CONDUCTOR:
    case CA_BXDF_ROUGH_PLASTIC: return CA_SCATTER_REFLECTION | CA_SCATTER_SMOOTH;
    case CA_BXDF_DIELECTRIC:
    case CA_BXDF_THIN_DIELECTRIC: return CA_SCATTER_REFLECTION | CA_SCATTER_TRANSMISSION | CA_SCATTER_DIRAC;
    case CA_BXDF_ROUGH_DIELECTRIC: return ca_rough_dielectric_scatter(bxdf);
    case CA_BXDF_CONDUCTOR: return CA_SCATTER_REFLECTION | CA_SCATTER_DIRAC;
    case CA_BXDF_PLASTIC: return CA_SCATTER_REFLECTION | CA_SCATTER_DIRAC | CA_SCATTER_SMOOTH;
    case CA_BXDF_PRINCIPLED: return ca_principled_scatter(bxdf);
    }
    assert(!"unknown kind of BSDF");
    return 0;
}

ca_bxdf_value ca_bxdf_eval(const ca_bxdf *bxdf, ca_vec3 wi_local, ca_vec3 wo_local, ca_from from)
{
    switch (bxdf->kind) {
    case CA_BXDF_DIFFUSE: return ca_diffuse_eval(bxdf, wi_local, wo_local);
    case CA_BXDF_DIELECTRIC:
    case CA_BXDF_THIN_DIELECTRIC:
    case CA_BXDF_CONDUCTOR: return ca_bxdf_value_zero();
    case CA_BXDF_ROUGH_DIELECTRIC: return ca_rough_dielectric_eval(bxdf, wi_local, wo_local, from);
    case CA_BXDF_ROUGH_CONDUCTOR: return ca_rough_conductor_eval(bxdf, wi_local, wo_local);
    case CA_BXDF_PLASTIC: return ca_plastic_eval(bxdf, wi_local, wo_local);
    case CA_BXDF_ROUGH_PLASTIC: return ca_rough_plastic_eval(bxdf, wi_local, wo_local);
    case CA_BXDF_PRINCIPLED: return ca_principled_eval(bxdf, wi_local, wo_local, from);
    }
    assert(!"unknown kind of BSDF");
    return ca_bxdf_value_zero();
}

bool ca_bxdf_sample_direction(const ca_bxdf *bxdf, ca_vec3 wi_local, float u_lobe, ca_vec2 u, ca_from from,
                              ca_bxdf_sample *sample)
{
    switch (bxdf->kind) {
    case CA_BXDF_DIFFUSE: return ca_diffuse_sample(bxdf, wi_local, u, sample);
    case CA_BXDF_DIELECTRIC: return ca_dielectric_sample(bxdf, wi_local, u_lobe, from, sample);
    case CA_BXDF_THIN_DIELECTRIC: return ca_thin_dielectric_sample(bxdf, wi_local, u_lobe, sample);
    case CA_BXDF_ROUGH_DIELECTRIC: return ca_rough_dielectric_sample(bxdf, wi_local, u_lobe, u, from, sample);
    case CA_BXDF_CONDUCTOR: return ca_conductor_sample(bxdf, wi_local, sample);
    case CA_BXDF_ROUGH_CONDUCTOR: return ca_rough_conductor_sample(bxdf, wi_local, u, sample);
    case CA_BXDF_PLASTIC: return ca_plastic_sample(bxdf, wi_local, u_lobe, u, sample);
    case CA_BXDF_ROUGH_PLASTIC: return ca_rough_plastic_sample(bxdf, wi_local, u_lobe, u, sample);
    case CA_BXDF_PRINCIPLED: return ca_principled_sample(bxdf, wi_local, u_lobe, u, from, sample);
    }
    assert(!"unknown kind of BSDF");
    return false;
}

ca_rgb ca_bxdf_albedo(const ca_bxdf *bxdf, ca_vec3 wi_local)
{
    switch (bxdf->kind) {
    case CA_BXDF_DIFFUSE: return wi_local.z > 0.0f ? bxdf->as.diffuse.reflectance : ca_rgb_grey(0.0f);
    case CA_BXDF_DIELECTRIC: return ca_dielectric_albedo(bxdf, wi_local);
    case CA_BXDF_THIN_DIELECTRIC: return ca_thin_dielectric_albedo(bxdf, wi_local);
    case CA_BXDF_ROUGH_DIELECTRIC: return ca_rough_dielectric_albedo(bxdf, wi_local);
    case CA_BXDF_CONDUCTOR: return ca_conductor_albedo(bxdf, wi_local);
    case CA_BXDF_ROUGH_CONDUCTOR: return ca_rough_conductor_albedo(bxdf, wi_local);
    case CA_BXDF_PLASTIC: return ca_plastic_albedo(bxdf, wi_local);
    case CA_BXDF_ROUGH_PLASTIC: return ca_rough_plastic_albedo(bxdf, wi_local);
    case CA_BXDF_PRINCIPLED: return ca_principled_albedo(bxdf, wi_local);
    }
    assert(!"unknown kind of BSDF");
    return ca_rgb_grey(0.0f);
}
