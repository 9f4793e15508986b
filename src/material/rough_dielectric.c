/* A rough boundary between two clear media: facets that reflect and refract. With n the index of wo's side over wi's
 * (1 for reflection), the facet that takes wi to wo has the normal m ~ wi + n wo, and
 *
 *     reflection     f = F D G / (4 |cos_i cos_o|),                 |dm/dwo| = 1 / (4 |wo.m|)
 *     transmission   f = (1 - F) D G |wi.m wo.m| n^2 / (|cos_i cos_o| |wi + n wo|^2) [/ n^2 for radiance],
 *                                                                   |dm/dwo| = n^2 |wo.m| / |wi + n wo|^2
 *
 * (Walter et al. 2007, as in Mitsuba 3, src/bsdfs/roughdielectric.cpp.) The reverse density has the same F, D and m,
 * and for the Jacobian |wi.m| / |wi + n wo|^2.
 *
 * Where the two indices are equal, facets do nothing: light goes straight on, a Dirac event. */
#include "material/bxdf_models.h"
#include "material/fresnel.h"
#include "material/microfacet.h"

/* Nearer to 1 the sum wi + n wo has too few digits left to give the normal. */
static bool is_index_matched(const ca_bxdf *bxdf) { return fabsf(bxdf->as.rough_dielectric.eta - 1.0f) < 1e-4f; }

uint32_t ca_rough_dielectric_scatter(const ca_bxdf *bxdf)
{
    return is_index_matched(bxdf) ? CA_SCATTER_TRANSMISSION | CA_SCATTER_DIRAC
                                  : CA_SCATTER_REFLECTION | CA_SCATTER_TRANSMISSION | CA_SCATTER_SMOOTH;
}

/* One event at a facet, as evaluation and sampling see it. */
typedef struct facet_event {
    ca_vec3 m;
    float cos_i, cos_o;         /* |wi.m|, |wo.m| */
    float fresnel;              /* reflectance, of reflections */
    float eta;                  /* wo's side over wi's: 1 for reflection */
    float density;              /* D(m) */
    float masking_i, masking_o; /* over the cosines */
} facet_event;

static void weigh_facet(const ca_microfacet *facets, ca_vec3 wi, ca_vec3 wo, facet_event *event)
{
    event->density = ca_microfacet_density(facets, event->m);
    event->masking_i = ca_microfacet_masking_over_cos(facets, wi);
    event->masking_o = ca_microfacet_masking_over_cos(facets, wo);
}

/* wi and wo on the same side. */
static ca_bxdf_value reflected_value(const ca_bxdf *bxdf, const facet_event *e)
{
    const ca_microfacet *facets = &bxdf->as.rough_dielectric.facets;
    const float scale = e->fresnel * 0.25f / e->cos_i;
    return (ca_bxdf_value){
        .f = ca_rgb_scale(bxdf->as.rough_dielectric.reflectance,
                          0.25f * e->fresnel * e->density * e->masking_i * e->masking_o),
        .pdf = {scale * ca_microfacet_pdf(facets, e->density, e->masking_i, e->cos_i, e->m.z)},
        .pdf_reverse = {scale * ca_microfacet_pdf(facets, e->density, e->masking_o, e->cos_i, e->m.z)}};
}

/* wi and wo on opposite sides: |wi + n wo| = |n |wo.m| - |wi.m||. */
static ca_bxdf_value transmitted_value(const ca_bxdf *bxdf, const facet_event *e, ca_from from)
{
    const ca_microfacet *facets = &bxdf->as.rough_dielectric.facets;
    const float length = e->eta * e->cos_o - e->cos_i, eta2 = e->eta * e->eta;
    const float share = ca_fresnel_transmittance(e->cos_i, e->cos_o, e->eta) / (length * length);
    const float f = share * e->density * e->masking_i * e->masking_o * e->cos_i * e->cos_o;
    return (ca_bxdf_value){
        .f = ca_rgb_scale(bxdf->as.rough_dielectric.transmittance, from == CA_FROM_CAMERA ? f : f * eta2),
        .pdf = {share * eta2 * e->cos_o * ca_microfacet_pdf(facets, e->density, e->masking_i, e->cos_i, e->m.z)},
        .pdf_reverse = {share * e->cos_i * ca_microfacet_pdf(facets, e->density, e->masking_o, e->cos_o, e->m.z)}};
}

/* The facet that takes wi to wo, turned to z > 0; false if there is none that both see from the right side. */
static bool find_facet(float eta_inside, ca_vec3 wi, ca_vec3 wo, facet_event *event)
{
    const bool reflects = ca_same_side(wi, wo);
    const float eta = ca_eta_seen_from(eta_inside, wi.z);
    event->eta = reflects ? 1.0f : eta;
    if (!ca_half_vector(wi, ca_mul(wo, event->eta), &event->m)) return false;
    const float side = copysignf(1.0f, wi.z);
    event->cos_i = ca_at_most_one(side * ca_dot(wi, event->m));
    event->cos_o = ca_at_most_one((reflects ? side : -side) * ca_dot(wo, event->m));
    if (!(event->cos_i > CA_MIN_FACET_COS) || !(event->cos_o > CA_MIN_FACET_COS)) return false;
    float cos_far;
    if (reflects) event->fresnel = ca_fresnel_dielectric(event->cos_i, eta, &cos_far);
    return true;
}

ca_bxdf_value ca_rough_dielectric_eval(const ca_bxdf *bxdf, ca_vec3 wi_local, ca_vec3 wo_local, ca_from from)
{
    facet_event event;
    if (wi_local.z == 0.0f || wo_local.z == 0.0f || is_index_matched(bxdf) ||
        !find_facet(bxdf->as.rough_dielectric.eta, wi_local, wo_local, &event))
        return ca_bxdf_value_zero();
    weigh_facet(&bxdf->as.rough_dielectric.facets, wi_local, wo_local, &event);
    return ca_same_side(wi_local, wo_local) ? reflected_value(bxdf, &event) : transmitted_value(bxdf, &event, from);
}

static ca_bxdf_sample straight_event(const ca_bxdf *bxdf, ca_vec3 wi)
{
    return (ca_bxdf_sample){.wo_local = ca_neg(wi),
                            .weight = bxdf->as.rough_dielectric.transmittance,
                            .pdf = {1.0f},
                            .pdf_reverse = {1.0f},
                            .scatter = CA_SCATTER_TRANSMISSION | CA_SCATTER_DIRAC,
                            .eta = 1.0f};
}

/* Chooses a facet by how visible it is, and reflection or refraction by its Fresnel reflectance. */
static bool choose_event(const ca_bxdf *bxdf, ca_vec3 wi, float u_lobe, ca_vec2 u, facet_event *event, ca_vec3 *wo)
{
    const float side = copysignf(1.0f, wi.z), eta = ca_eta_seen_from(bxdf->as.rough_dielectric.eta, wi.z);
    event->m = ca_microfacet_sample(&bxdf->as.rough_dielectric.facets, ca_mul(wi, side), u);
    event->cos_i = ca_at_most_one(side * ca_dot(wi, event->m));
    if (!(event->cos_i > CA_MIN_FACET_COS)) return false;
    float cos_far;
    event->fresnel = ca_fresnel_dielectric(event->cos_i, eta, &cos_far);
    if (u_lobe < event->fresnel) {
        event->eta = 1.0f;
        event->cos_o = event->cos_i;
        *wo = ca_reflect_about(wi, event->m, side * event->cos_i);
        return wo->z * side > 0.0f;
    }
    event->eta = eta;
    event->cos_o = cos_far;
    *wo = ca_madd(ca_mul(wi, -1.0f / eta), side * (event->cos_i / eta - cos_far), event->m);
    return cos_far > CA_MIN_FACET_COS && wo->z * side < 0.0f;
}

/* What the choices leave of the value is G1(wo), times the rest of the masking where all normals are sampled. */
bool ca_rough_dielectric_sample(CA_BXDF_SAMPLE_ARGUMENTS)
{
    if (wi_local.z == 0.0f) return false;
    if (is_index_matched(bxdf)) {
        *sample = straight_event(bxdf, wi_local);
        return true;
    }
    const ca_microfacet *facets = &bxdf->as.rough_dielectric.facets;
    facet_event e;
    ca_vec3 wo;
    if (!choose_event(bxdf, wi_local, u_lobe, u, &e, &wo)) return false;
    const bool reflects = ca_same_side(wi_local, wo);
    weigh_facet(facets, wi_local, wo, &e);
    const ca_bxdf_value value = reflects ? reflected_value(bxdf, &e) : transmitted_value(bxdf, &e, from);
    if (!(value.pdf.v > 0.0f)) return false;

    float weight = e.masking_o * fabsf(wo.z);
    if (!facets->sample_visible) weight *= e.masking_i * e.cos_i / e.m.z;
    if (from == CA_FROM_CAMERA) weight /= e.eta * e.eta;
    const ca_rgb factor = reflects ? bxdf->as.rough_dielectric.reflectance : bxdf->as.rough_dielectric.transmittance;
    *sample =
        (ca_bxdf_sample){.wo_local = wo,
                         .weight = ca_rgb_scale(factor, weight),
                         .pdf = value.pdf,
                         .pdf_reverse = value.pdf_reverse,
                         .scatter = (reflects ? CA_SCATTER_REFLECTION : CA_SCATTER_TRANSMISSION) | CA_SCATTER_SMOOTH,
                         .eta = e.eta};
    return true;
}

/* That of the smooth boundary. */
ca_rgb ca_rough_dielectric_albedo(const ca_bxdf *bxdf, ca_vec3 wi_local)
{
    float cos_far;
    const float eta = ca_eta_seen_from(bxdf->as.rough_dielectric.eta, wi_local.z);
    const float reflected = ca_fresnel_dielectric(fabsf(wi_local.z), eta, &cos_far);
    return ca_rgb_lerp(bxdf->as.rough_dielectric.transmittance, bxdf->as.rough_dielectric.reflectance, reflected);
}
