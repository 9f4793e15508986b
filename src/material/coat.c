#include "material/coat.h"

#include "material/bxdf_models.h"
#include "material/fresnel.h"
#include "material/microfacet.h"
#include "material/rough_transmittance.h"

/* One of the two directions above the boundary, and what becomes of it below. */
typedef struct passage {
    ca_vec3 inside;    /* the direction below */
    float transmitted; /* share that passes the boundary */
    ca_rgb left;       /* of that what absorption leaves on the way through */
    float compression; /* solid angle below over that above: cos / (eta^2 cos') */
    float mirror;      /* probability of sampling the boundary's reflection */
} passage;

/* false: no light passes the boundary at this angle. */
static bool enter(const ca_coat *coat, ca_vec3 w, passage *p)
{
    float cos_inside;
    const float reflected = ca_fresnel_dielectric(ca_at_most_one(w.z), coat->eta, &cos_inside);
    if (!(cos_inside > CA_MIN_FACET_COS)) return false;
    p->transmitted =
        coat->transmittance ? ca_rough_transmittance_eval(coat->transmittance, w.z) : 1.0f - reflected;
    p->inside = (ca_vec3){w.x / coat->eta, w.y / coat->eta, cos_inside};
    const float way = 1.0f / cos_inside;
    p->left = (ca_rgb){expf(-coat->absorption.r * way), expf(-coat->absorption.g * way),
                       expf(-coat->absorption.b * way)};
    p->compression = w.z / (coat->eta * coat->eta * cos_inside);
    const float mirror = (1.0f - p->transmitted) * coat->specular_weight;
    const float base = p->transmitted * (1.0f - coat->specular_weight);
    p->mirror = mirror + base > 0.0f ? mirror / (mirror + base) : 1.0f;
    return true;
}

/* The way out of a direction below; false: total reflection, which is lost. */
static bool leave(const ca_coat *coat, ca_vec3 inside, ca_vec3 *w)
{
    float cos_outside;
    if (!(inside.z > 0.0f)) return false;
    ca_fresnel_dielectric(ca_at_most_one(inside.z), 1.0f / coat->eta, &cos_outside);
    *w = (ca_vec3){inside.x * coat->eta, inside.y * coat->eta, cos_outside};
    return cos_outside > CA_MIN_FACET_COS;
}

static ca_rgb passed(const passage *in, const passage *out)
{
    return ca_rgb_scale(ca_rgb_mul(in->left, out->left), in->transmitted * out->transmitted);
}

void ca_coat_add_facets(const ca_microfacet *facets, float eta, ca_rgb specular, ca_vec3 wi, ca_vec3 wo,
                        float probability_i, float probability_o, ca_bxdf_value *value)
{
    ca_vec3 m;
    if (!ca_half_vector(wi, wo, &m)) return;
    const float cos_facet = ca_at_most_one(ca_dot(wi, m));
    if (!(cos_facet > CA_MIN_FACET_COS)) return;
    float cos_inside;
    const float fresnel = ca_fresnel_dielectric(cos_facet, eta, &cos_inside);
    const float density = ca_microfacet_density(facets, m), jacobian = 0.25f / cos_facet;
    const float masking_i = ca_microfacet_masking_over_cos(facets, wi);
    const float masking_o = ca_microfacet_masking_over_cos(facets, wo);
    value->f = ca_rgb_madd(value->f, 0.25f * fresnel * density * masking_i * masking_o, specular);
    value->pdf.v += probability_i * jacobian * ca_microfacet_pdf(facets, density, masking_i, cos_facet, m.z);
    value->pdf_reverse.v += probability_o * jacobian * ca_microfacet_pdf(facets, density, masking_o, cos_facet, m.z);
}

uint32_t ca_coat_scatter(const ca_coat *coat, const ca_bxdf *base)
{
    const uint32_t boundary = coat->transmittance ? CA_SCATTER_SMOOTH : CA_SCATTER_DIRAC;
    return ca_bxdf_scatter(base) | CA_SCATTER_REFLECTION | boundary;
}

ca_bxdf_value ca_coat_eval(const ca_coat *coat, const ca_bxdf *base, ca_vec3 wi_local, ca_vec3 wo_local,
                           ca_from from)
{
    passage in, out;
    ca_bxdf_value value = ca_bxdf_value_zero();
    if (!(wi_local.z > 0.0f) || !(wo_local.z > 0.0f)) return value;
    const bool enters = enter(coat, wi_local, &in), leaves = enter(coat, wo_local, &out);
    if (enters && leaves) {
        value = ca_bxdf_eval(base, in.inside, out.inside, from);
        const ca_rgb both = ca_rgb_scale(passed(&in, &out), 1.0f / (coat->eta * coat->eta));
        value.f = ca_rgb_mul(value.f, both);
        value.pdf.v *= (1.0f - in.mirror) * out.compression;
        value.pdf_reverse.v *= (1.0f - out.mirror) * in.compression;
    }
    if (coat->transmittance)
        ca_coat_add_facets(&coat->facets, coat->eta, coat->specular, wi_local, wo_local, enters ? in.mirror : 1.0f,
                           leaves ? out.mirror : 1.0f, &value);
    return value;
}

/* The boundary's own reflection; `mirror` is its probability. */
static bool sample_boundary(const ca_coat *coat, const ca_bxdf *base, ca_vec3 wi, float mirror, ca_vec2 u,
                            ca_from from, ca_bxdf_sample *sample)
{
    if (coat->transmittance) {
        const ca_vec3 m = ca_microfacet_sample(&coat->facets, wi, u);
        const ca_vec3 wo = ca_reflect_about(wi, m, ca_dot(wi, m));
        if (!(wo.z > 0.0f)) return false;
        const ca_bxdf_value value = ca_coat_eval(coat, base, wi, wo, from);
        return ca_bxdf_reflect(&value, wo, sample);
    }
    float cos_inside;
    const float reflected = ca_fresnel_dielectric(ca_at_most_one(wi.z), coat->eta, &cos_inside);
    *sample = (ca_bxdf_sample){.wo_local = ca_reflect_local(wi),
                               .weight = ca_rgb_scale(coat->specular, reflected / mirror),
                               .pdf = {mirror},
                               .pdf_reverse = {mirror},
                               .scatter = CA_SCATTER_REFLECTION | CA_SCATTER_DIRAC,
                               .eta = 1.0f};
    return true;
}

/* Whatever the base sampled below the coat, seen from above. Under a smooth coat, and of Dirac events, nothing else
 * gives the direction, and no density is divided by. */
static bool sample_base(const ca_coat *coat, const ca_bxdf *base, ca_vec3 wi, const passage *in, float u_lobe,
                        ca_vec2 u, ca_from from, ca_bxdf_sample *sample)
{
    passage out;
    ca_vec3 wo;
    if (!ca_bxdf_sample_direction(base, in->inside, u_lobe, u, from, sample)) return false;
    if (!leave(coat, sample->wo_local, &wo) || !enter(coat, wo, &out)) return false;
    const bool dirac = sample->scatter & CA_SCATTER_DIRAC;
    if (coat->transmittance && !dirac) {
        const ca_bxdf_value value = ca_coat_eval(coat, base, wi, wo, from);
        return ca_bxdf_reflect(&value, wo, sample);
    }
    sample->wo_local = wo;
    sample->weight = ca_rgb_scale(ca_rgb_mul(sample->weight, passed(in, &out)), 1.0f / (1.0f - in->mirror));
    sample->pdf.v *= (1.0f - in->mirror) * (dirac ? 1.0f : out.compression);
    sample->pdf_reverse.v *= (1.0f - out.mirror) * (dirac ? 1.0f : in->compression);
    return true;
}

bool ca_coat_sample(const ca_coat *coat, const ca_bxdf *base, ca_vec3 wi_local, float u_lobe, ca_vec2 u, ca_from from,
                    ca_bxdf_sample *sample)
{
    passage in = {.mirror = 1.0f};
    if (!(wi_local.z > 0.0f)) return false;
    const float mirror = enter(coat, wi_local, &in) ? in.mirror : 1.0f; /* else total reflection */
    if (u_lobe < mirror) return sample_boundary(coat, base, wi_local, mirror, u, from, sample);
    const float u_base = ca_min((u_lobe - mirror) / (1.0f - mirror), CA_ONE_MINUS_EPSILON);
    return sample_base(coat, base, wi_local, &in, u_base, u, from, sample);
}

/* The base seen under the same angle both ways; of diffuse light from inside the boundary lets out the square of the
 * index less. */
ca_rgb ca_coat_albedo(const ca_coat *coat, const ca_bxdf *base, ca_vec3 wi_local)
{
    passage in;
    if (!(wi_local.z > 0.0f)) return ca_rgb_grey(0.0f);
    if (!enter(coat, wi_local, &in)) return coat->specular;
    const bool spreads = ca_bxdf_scatter(base) & CA_SCATTER_SMOOTH;
    const float out = spreads ? ca_min(1.0f, 1.0f / (coat->eta * coat->eta)) : 1.0f;
    const ca_rgb below = ca_rgb_mul(ca_bxdf_albedo(base, in.inside), ca_rgb_scale(passed(&in, &in), out));
    return ca_rgb_madd(below, 1.0f - in.transmitted, coat->specular);
}
