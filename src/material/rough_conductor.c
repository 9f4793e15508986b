/* A rough metal: mirrors for facets, f = F D G / (4 cos_i cos_o), black from below (microfacet.h). */
#include "material/bxdf_models.h"
#include "material/fresnel.h"
#include "material/microfacet.h"

/* What evaluation and sampling share, about one facet normal. */
typedef struct facet_terms {
    ca_rgb fresnel;             /* times the user's reflectance */
    float cos_facet;            /* wi.m = wo.m */
    float masking_i, masking_o; /* over the cosines */
    ca_pdf_solid_angle forward, reverse;
    float density;
} facet_terms;

static facet_terms terms_at(const ca_bxdf *bxdf, ca_vec3 wi, ca_vec3 wo, ca_vec3 m, float cos_facet)
{
    const ca_microfacet *facets = &bxdf->as.rough_conductor.facets;
    facet_terms t = {.cos_facet = cos_facet,
                     .masking_i = ca_microfacet_masking_over_cos(facets, wi),
                     .masking_o = ca_microfacet_masking_over_cos(facets, wo),
                     .density = ca_microfacet_density(facets, m)};
    t.fresnel =
        ca_rgb_mul(ca_fresnel_conductor_rgb(cos_facet, bxdf->as.rough_conductor.eta, bxdf->as.rough_conductor.k),
                   bxdf->as.rough_conductor.reflectance);
    const float jacobian = 0.25f / cos_facet; /* of m by wo */
    t.forward.v = ca_microfacet_pdf(facets, t.density, t.masking_i, cos_facet, m.z) * jacobian;
    t.reverse.v = ca_microfacet_pdf(facets, t.density, t.masking_o, cos_facet, m.z) * jacobian;
    return t;
}

uint32_t ca_rough_conductor_scatter(const ca_bxdf *bxdf)
{
    (void)bxdf;
    return CA_SCATTER_REFLECTION | CA_SCATTER_SMOOTH;
}

ca_bxdf_value ca_rough_conductor_eval(CA_BXDF_EVAL_ARGUMENTS)
{
    (void)from;
    ca_vec3 m;
    if (!(wi_local.z > 0.0f) || !(wo_local.z > 0.0f) || !ca_half_vector(wi_local, wo_local, &m))
        return ca_bxdf_value_zero();
    const float cos_facet = ca_at_most_one(ca_dot(wi_local, m));
    if (!(cos_facet > CA_MIN_FACET_COS)) return ca_bxdf_value_zero();
    const facet_terms t = terms_at(bxdf, wi_local, wo_local, m, cos_facet);
    return (ca_bxdf_value){.f = ca_rgb_scale(t.fresnel, 0.25f * t.density * t.masking_i * t.masking_o),
                           .pdf = t.forward,
                           .pdf_reverse = t.reverse};
}

/* The weight is F G1(wo) for visible normals: D, and with it all that is large, has cancelled. */
bool ca_rough_conductor_sample(CA_BXDF_SAMPLE_ARGUMENTS)
{
    (void)u_lobe, (void)from;
    if (!(wi_local.z > 0.0f)) return false;
    const ca_microfacet *facets = &bxdf->as.rough_conductor.facets;
    const ca_vec3 m = ca_microfacet_sample(facets, wi_local, u);
    const float cos_facet = ca_at_most_one(ca_dot(wi_local, m));
    if (!(cos_facet > CA_MIN_FACET_COS)) return false;
    const ca_vec3 wo = ca_reflect_about(wi_local, m, cos_facet);
    if (!(wo.z > 0.0f)) return false;

    const facet_terms t = terms_at(bxdf, wi_local, wo, m, cos_facet);
    if (!(t.forward.v > 0.0f)) return false;
    float weight = t.masking_o * wo.z;
    if (!facets->sample_visible) weight *= t.masking_i * cos_facet / m.z;
    *sample = (ca_bxdf_sample){.wo_local = wo,
                               .weight = ca_rgb_scale(t.fresnel, weight),
                               .pdf = t.forward,
                               .pdf_reverse = t.reverse,
                               .scatter = CA_SCATTER_REFLECTION | CA_SCATTER_SMOOTH,
                               .eta = 1.0f};
    return true;
}

/* That of the smooth metal; roughness loses a few percent more between facets. */
ca_rgb ca_rough_conductor_albedo(const ca_bxdf *bxdf, ca_vec3 wi_local)
{
    if (!(wi_local.z > 0.0f)) return ca_rgb_grey(0.0f);
    const ca_rgb fresnel = ca_fresnel_conductor_rgb(ca_at_most_one(wi_local.z), bxdf->as.rough_conductor.eta,
                                                    bxdf->as.rough_conductor.k);
    return ca_rgb_mul(fresnel, bxdf->as.rough_conductor.reflectance);
}
