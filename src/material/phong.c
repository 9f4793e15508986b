/* The modified Phong model (Lafortune and Willems 1994, "Using the Modified Phong Reflectance Model for Physically
 * Based Rendering"), black from below: f = diffuse / pi + specular (n + 2) / (2 pi) cos^n a, where a is the angle
 * between wo and the mirror direction of wi. The share of the lobe below the horizon is lost. */
#include "material/bxdf_models.h"
#include "math/frame.h"
#include "math/numeric.h"
#include "sampling/warp.h"

/* cos^n a over 2 pi, 0 where a is over 90 degrees; symmetric in the two directions. */
static float mirror_lobe(float exponent, ca_vec3 wi, ca_vec3 wo)
{
    const float cosine = ca_at_most_one(wi.z * wo.z - wi.x * wo.x - wi.y * wo.y);
    return cosine > 0.0f ? powf(cosine, exponent) * (0.5f * CA_INV_PI) : 0.0f;
}

uint32_t ca_phong_scatter(const ca_bxdf *bxdf)
{
    (void)bxdf;
    return CA_SCATTER_REFLECTION | CA_SCATTER_SMOOTH;
}

ca_bxdf_value ca_phong_eval(CA_BXDF_EVAL_ARGUMENTS)
{
    (void)from;
    if (!(wi_local.z > 0.0f) || !(wo_local.z > 0.0f)) return ca_bxdf_value_zero();
    const float n = bxdf->as.phong.exponent, lobe = mirror_lobe(n, wi_local, wo_local);
    const float lobe_pdf = bxdf->as.phong.specular_weight * (n + 1.0f) * lobe;
    const float diffuse = (1.0f - bxdf->as.phong.specular_weight) * CA_INV_PI;
    return (ca_bxdf_value){.f = ca_rgb_madd(ca_rgb_scale(bxdf->as.phong.diffuse, CA_INV_PI), (n + 2.0f) * lobe,
                                            bxdf->as.phong.specular),
                           .pdf = {lobe_pdf + diffuse * wo_local.z},
                           .pdf_reverse = {lobe_pdf + diffuse * wi_local.z}};
}

/* Around the mirror direction, with a density of (n + 1) / (2 pi) cos^n a. */
static ca_vec3 sample_mirror_lobe(const ca_bxdf *bxdf, ca_vec3 wi, ca_vec2 u)
{
    const float cosine = powf(1.0f - u.x, 1.0f / (bxdf->as.phong.exponent + 1.0f));
    const float sine = sqrtf(ca_max(0.0f, 1.0f - cosine * cosine)), azimuth = CA_TWO_PI * u.y;
    const ca_frame frame = ca_frame_from_normal((ca_vec3){-wi.x, -wi.y, wi.z});
    return ca_to_world(&frame, (ca_vec3){sine * cosf(azimuth), sine * sinf(azimuth), cosine});
}

bool ca_phong_sample(CA_BXDF_SAMPLE_ARGUMENTS)
{
    if (!(wi_local.z > 0.0f)) return false;
    const bool specular = u_lobe < bxdf->as.phong.specular_weight;
    const ca_vec3 wo = specular ? sample_mirror_lobe(bxdf, wi_local, u) : ca_warp_cosine_hemisphere(u);
    const ca_bxdf_value value = ca_phong_eval(bxdf, wi_local, wo, from);
    return ca_bxdf_reflect(&value, wo, sample);
}

/* At normal incidence; elsewhere less of the lobe lies above. */
ca_rgb ca_phong_albedo(const ca_bxdf *bxdf, ca_vec3 wi_local)
{
    if (!(wi_local.z > 0.0f)) return ca_rgb_grey(0.0f);
    return ca_rgb_add(bxdf->as.phong.diffuse, bxdf->as.phong.specular);
}
