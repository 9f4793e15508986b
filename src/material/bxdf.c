/* Which model does what: the closed set of elementary BSDFs. */
#include "material/bxdf.h"

#include "material/bxdf_models.h"

#include <assert.h>

uint32_t ca_bxdf_scatter(const ca_bxdf *bxdf)
{
    switch (bxdf->kind) {
#define SCATTER(KIND, name)                                                                                          \
    case CA_BXDF_##KIND: return ca_##name##_scatter(bxdf);
        CA_BXDF_MODELS(SCATTER)
    case CA_BXDF_KIND_COUNT: break;
    }
    assert(false && "unknown kind of BSDF");
    return 0;
}

ca_bxdf_value ca_bxdf_eval(const ca_bxdf *bxdf, ca_vec3 wi_local, ca_vec3 wo_local, ca_from from)
{
    switch (bxdf->kind) {
#define EVAL(KIND, name)                                                                                             \
    case CA_BXDF_##KIND: return ca_##name##_eval(bxdf, wi_local, wo_local, from);
        CA_BXDF_MODELS(EVAL)
    case CA_BXDF_KIND_COUNT: break;
    }
    assert(false && "unknown kind of BSDF");
    return ca_bxdf_value_zero();
}

bool ca_bxdf_sample_direction(const ca_bxdf *bxdf, ca_vec3 wi_local, float u_lobe, ca_vec2 u, ca_from from,
                              ca_bxdf_sample *sample)
{
    switch (bxdf->kind) {
#define SAMPLE(KIND, name)                                                                                           \
    case CA_BXDF_##KIND: return ca_##name##_sample(bxdf, wi_local, u_lobe, u, from, sample);
        CA_BXDF_MODELS(SAMPLE)
    case CA_BXDF_KIND_COUNT: break;
    }
    assert(false && "unknown kind of BSDF");
    return false;
}

ca_rgb ca_bxdf_albedo(const ca_bxdf *bxdf, ca_vec3 wi_local)
{
    switch (bxdf->kind) {
#define ALBEDO(KIND, name)                                                                                           \
    case CA_BXDF_##KIND: return ca_##name##_albedo(bxdf, wi_local);
        CA_BXDF_MODELS(ALBEDO)
    case CA_BXDF_KIND_COUNT: break;
    }
    assert(false && "unknown kind of BSDF");
    return ca_rgb_grey(0.0f);
}

ca_rgb ca_bxdf_diffuse_reflectance(const ca_bxdf *bxdf, ca_vec3 wi_local)
{
    switch (bxdf->kind) {
    case CA_BXDF_DIFFUSE: return bxdf->as.diffuse.reflectance;
    case CA_BXDF_ROUGH_DIFFUSE: return bxdf->as.rough_diffuse.reflectance;
    case CA_BXDF_PLASTIC: return bxdf->as.plastic.diffuse;
    case CA_BXDF_ROUGH_PLASTIC: return bxdf->as.rough_plastic.diffuse;
    case CA_BXDF_PHONG: return bxdf->as.phong.diffuse;
    case CA_BXDF_WARD: return bxdf->as.ward.diffuse;
    case CA_BXDF_PRINCIPLED: return bxdf->as.principled.base_color;
    case CA_BXDF_PRINCIPLED_THIN: return bxdf->as.principled_thin.base_color;
    case CA_BXDF_DIELECTRIC:
    case CA_BXDF_THIN_DIELECTRIC:
    case CA_BXDF_ROUGH_DIELECTRIC:
    case CA_BXDF_CONDUCTOR:
    case CA_BXDF_ROUGH_CONDUCTOR:
    case CA_BXDF_DIFFUSE_TRANSMITTER:
    case CA_BXDF_KIND_COUNT: break;
    }
    return ca_rgb_scale(ca_bxdf_eval(bxdf, wi_local, (ca_vec3){0.0f, 0.0f, 1.0f}, CA_FROM_CAMERA).f, CA_PI);
}
