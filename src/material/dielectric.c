/* Smooth boundaries between two clear media, and thin sheets that are two of them back to back. All events are Dirac;
 * reflection or transmission is chosen by the Fresnel reflectance, which is the same for both directions of travel,
 * so the reverse probability is the forward one. */
#include "material/bxdf_models.h"
#include "material/fresnel.h"

static ca_bxdf_sample mirror_event(ca_vec3 wi, ca_rgb weight, float probability)
{
    return (ca_bxdf_sample){.wo_local = ca_reflect_local(wi),
                            .weight = weight,
                            .pdf = {probability},
                            .pdf_reverse = {probability},
                            .scatter = CA_SCATTER_REFLECTION | CA_SCATTER_DIRAC,
                            .eta = 1.0f};
}

uint32_t ca_dielectric_scatter(const ca_bxdf *bxdf)
{
    (void)bxdf;
    return CA_SCATTER_REFLECTION | CA_SCATTER_TRANSMISSION | CA_SCATTER_DIRAC;
}

ca_bxdf_value ca_dielectric_eval(CA_BXDF_EVAL_ARGUMENTS)
{
    (void)bxdf, (void)wi_local, (void)wo_local, (void)from;
    return ca_bxdf_value_zero();
}

bool ca_dielectric_sample(CA_BXDF_SAMPLE_ARGUMENTS)
{
    (void)u;
    if (wi_local.z == 0.0f) return false;
    const float eta = ca_eta_seen_from(bxdf->as.dielectric.eta, wi_local.z);
    float cos_far;
    const float reflected = ca_fresnel_dielectric(fabsf(wi_local.z), eta, &cos_far);
    if (u_lobe < reflected) {
        *sample = mirror_event(wi_local, bxdf->as.dielectric.reflectance, reflected);
        return true;
    }
    /* Just short of total reflection the refracted ray can round into the surface: no light to speak of. */
    if (!(cos_far > 0.0f)) return false;

    const float inv_eta = 1.0f / eta;
    /* Radiance, which a camera path carries light of, is compressed into a smaller solid angle; flux is not. */
    const float scale = from == CA_FROM_CAMERA ? inv_eta * inv_eta : 1.0f;
    *sample =
        (ca_bxdf_sample){.wo_local = {-wi_local.x * inv_eta, -wi_local.y * inv_eta, copysignf(cos_far, -wi_local.z)},
                         .weight = ca_rgb_scale(bxdf->as.dielectric.transmittance, scale),
                         .pdf = {1.0f - reflected},
                         .pdf_reverse = {1.0f - reflected},
                         .scatter = CA_SCATTER_TRANSMISSION | CA_SCATTER_DIRAC,
                         .eta = eta};
    return true;
}

ca_rgb ca_dielectric_albedo(const ca_bxdf *bxdf, ca_vec3 wi_local)
{
    float cos_far;
    const float eta = ca_eta_seen_from(bxdf->as.dielectric.eta, wi_local.z);
    const float reflected = ca_fresnel_dielectric(fabsf(wi_local.z), eta, &cos_far);
    return ca_rgb_lerp(bxdf->as.dielectric.transmittance, bxdf->as.dielectric.reflectance, reflected);
}

/* Both boundaries with all reflections between them: R + T^2 R + T^2 R^3 + ... = 2 R / (1 + R), T = 1 - R. */
static float sheet_reflectance(const ca_bxdf *bxdf, float abs_cos)
{
    float cos_inside;
    const float once = ca_fresnel_dielectric(abs_cos, bxdf->as.thin_dielectric.eta, &cos_inside);
    return 2.0f * once / (1.0f + once);
}

uint32_t ca_thin_dielectric_scatter(const ca_bxdf *bxdf)
{
    (void)bxdf;
    return CA_SCATTER_REFLECTION | CA_SCATTER_TRANSMISSION | CA_SCATTER_DIRAC;
}

ca_bxdf_value ca_thin_dielectric_eval(CA_BXDF_EVAL_ARGUMENTS)
{
    (void)bxdf, (void)wi_local, (void)wo_local, (void)from;
    return ca_bxdf_value_zero();
}

bool ca_thin_dielectric_sample(CA_BXDF_SAMPLE_ARGUMENTS)
{
    (void)u, (void)from;
    if (wi_local.z == 0.0f) return false;
    const float reflected = sheet_reflectance(bxdf, fabsf(wi_local.z));
    if (u_lobe < reflected) {
        *sample = mirror_event(wi_local, bxdf->as.thin_dielectric.reflectance, reflected);
        return true;
    }
    if (!(reflected < 1.0f)) return false;
    *sample = (ca_bxdf_sample){.wo_local = ca_neg(wi_local),
                               .weight = bxdf->as.thin_dielectric.transmittance,
                               .pdf = {1.0f - reflected},
                               .pdf_reverse = {1.0f - reflected},
                               .scatter = CA_SCATTER_TRANSMISSION | CA_SCATTER_DIRAC,
                               .eta = 1.0f};
    return true;
}

ca_rgb ca_thin_dielectric_albedo(const ca_bxdf *bxdf, ca_vec3 wi_local)
{
    const float reflected = sheet_reflectance(bxdf, fabsf(wi_local.z));
    return ca_rgb_lerp(bxdf->as.thin_dielectric.transmittance, bxdf->as.thin_dielectric.reflectance, reflected);
}
