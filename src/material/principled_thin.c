/* A thin sheet by Burley (2015, "Extending the Disney BRDF to a BSDF with Integrated Subsurface Scattering") as
 * Mitsuba 3 has it (plugin principledthin): both sides are the same, and light that goes through is not bent.
 *
 *     reflection    through GGX facets, by the Fresnel reflectance of one boundary, or its tinted form
 *     transmission  a reflection turned to the other side, through smoother facets, tinted by the base colour
 *     base          the principled model's, of which the share `diff_trans` comes out on the other side, Lambertian;
 *                   and sheen
 *
 * Specular parts have the share spec_trans, the others the rest. All is symmetric in wi and wo, which are turned to
 * the upper side first, with one exception that Mitsuba makes: no light is transmitted that would still lie on the
 * front of the facet that reflects it before it is turned over. That is a rule of the two ends, eye and light, not of
 * wi and wo: both walks agree on it. */
#include "material/burley.h"
#include "material/bxdf_models.h"
#include "sampling/warp.h"

/* Shares of the samples, for a direction of incidence; their sum is 1. */
typedef struct shares {
    float mirror, window;         /* specular: reflected, transmitted */
    float base, base_transmitted; /* diffuse */
} shares;

static float reflectance(const ca_bxdf *bxdf, float cosine)
{
    float cos_inside;
    return ca_fresnel_dielectric(cosine, bxdf->as.principled_thin.eta, &cos_inside);
}

/* The mirror by what a smooth sheet would reflect, but at least a tenth: a tint may reflect more. */
static shares shares_at(const ca_bxdf *bxdf, float abs_cos)
{
    const float specular = bxdf->as.principled_thin.spec_trans, through = bxdf->as.principled_thin.diff_trans;
    const float mirror = ca_clamp(reflectance(bxdf, ca_at_most_one(abs_cos)), 0.1f, 0.9f);
    return (shares){.mirror = specular * mirror,
                    .window = specular * (1.0f - mirror),
                    .base = (1.0f - specular) * (1.0f - through),
                    .base_transmitted = (1.0f - specular) * through};
}

/* Facets of the light that passes are smoother: it meets two boundaries that nearly cancel. */
static ca_microfacet facets_of(const ca_bxdf *bxdf, bool passes)
{
    const float scale = passes ? 0.65f * bxdf->as.principled_thin.eta - 0.35f : 1.0f;
    return ca_burley_facets(scale * bxdf->as.principled_thin.roughness, bxdf->as.principled_thin.anisotropic);
}

static ca_vec3 turned_up(ca_vec3 w) { return (ca_vec3){w.x, w.y, fabsf(w.z)}; }

/* Colour of the specular parts. */
static ca_rgb specular_color(const ca_bxdf *bxdf, bool passes, float cos_facet)
{
    const ca_rgb base_color = bxdf->as.principled_thin.base_color;
    const float tint = bxdf->as.principled_thin.spec_tint, plain = reflectance(bxdf, cos_facet);
    if (passes) return ca_rgb_scale(base_color, 1.0f - plain);
    if (!(tint > 0.0f)) return ca_rgb_grey(plain);
    const ca_rgb tinted = ca_burley_tinted(base_color, cos_facet, bxdf->as.principled_thin.eta);
    return ca_rgb_lerp(ca_rgb_grey(plain), tinted, tint);
}

/* Mitsuba's exception: is the light, below, on the facet's front seen from above? `light` is turned up. */
static bool is_cut_off(ca_vec3 light, ca_vec3 m)
{
    return light.x * m.x + light.y * m.y - light.z * m.z >= 0.0f;
}

/* Base and sheen. */
static ca_rgb base_value(const ca_bxdf *bxdf, bool passes, ca_vec3 wi, ca_vec3 wo, float cos_facet)
{
    const ca_rgb base_color = bxdf->as.principled_thin.base_color;
    const float base = 1.0f - bxdf->as.principled_thin.spec_trans, through = bxdf->as.principled_thin.diff_trans;
    if (passes) return ca_rgb_scale(base_color, base * through * CA_INV_PI);
    const float amount = ca_burley_diffuse(bxdf->as.principled_thin.roughness, bxdf->as.principled_thin.flatness,
                                           wi.z, wo.z, cos_facet);
    const ca_rgb f = ca_rgb_scale(base_color, base * (1.0f - through) * CA_INV_PI * amount);
    const float sheen = bxdf->as.principled_thin.sheen * base * (1.0f - through);
    if (!(sheen > 0.0f)) return f;
    return ca_rgb_madd(f, sheen, ca_burley_sheen(base_color, bxdf->as.principled_thin.sheen_tint, cos_facet));
}

/* Adds the specular part on one side to value and densities; `cut_off` leaves the value as it is. */
static void add_specular(const ca_bxdf *bxdf, bool passes, bool cut_off, ca_vec3 wi, ca_vec3 wo, ca_vec3 m,
                         ca_bxdf_value *value)
{
    const float specular = bxdf->as.principled_thin.spec_trans;
    if (!(specular > 0.0f)) return;
    const ca_microfacet facets = facets_of(bxdf, passes);
    const float common = 0.25f * ca_microfacet_density(&facets, m);
    const float masking_i = ca_microfacet_masking_over_cos(&facets, wi);
    const float masking_o = ca_microfacet_masking_over_cos(&facets, wo);
    const shares from_i = shares_at(bxdf, wi.z), from_o = shares_at(bxdf, wo.z);
    const ca_rgb color = specular_color(bxdf, passes, ca_at_most_one(ca_dot(wi, m)));
    if (!cut_off) value->f = ca_rgb_madd(value->f, specular * common * masking_i * masking_o, color);
    value->pdf.v += (passes ? from_i.window : from_i.mirror) * common * masking_i;
    value->pdf_reverse.v += (passes ? from_o.window : from_o.mirror) * common * masking_o;
}

uint32_t ca_principled_thin_scatter(const ca_bxdf *bxdf)
{
    (void)bxdf;
    return CA_SCATTER_REFLECTION | CA_SCATTER_TRANSMISSION | CA_SCATTER_SMOOTH;
}

ca_bxdf_value ca_principled_thin_eval(CA_BXDF_EVAL_ARGUMENTS)
{
    if (wi_local.z == 0.0f || wo_local.z == 0.0f) return ca_bxdf_value_zero();
    const bool passes = !ca_same_side(wi_local, wo_local);
    const ca_vec3 wi = turned_up(wi_local), wo = turned_up(wo_local);
    ca_vec3 m;
    if (!ca_half_vector(wi, wo, &m)) return ca_bxdf_value_zero();
    const float cos_facet = ca_at_most_one(ca_dot(wi, m));
    if (!(cos_facet > CA_MIN_FACET_COS)) return ca_bxdf_value_zero();
    const shares s = shares_at(bxdf, wi.z);
    const float diffuse = (passes ? s.base_transmitted : s.base) * CA_INV_PI;
    ca_bxdf_value value = {.f = base_value(bxdf, passes, wi, wo, cos_facet),
                           .pdf = {diffuse * wo.z},
                           .pdf_reverse = {diffuse * wi.z}};
    const bool cut_off = passes && is_cut_off(from == CA_FROM_CAMERA ? wo : wi, m);
    add_specular(bxdf, passes, cut_off, wi, wo, m, &value);
    return value;
}

/* A direction above, for wi above; *passes: it is to be turned below. */
static bool sample_above(const ca_bxdf *bxdf, ca_vec3 wi, float u_lobe, ca_vec2 u, bool *passes, ca_vec3 *wo)
{
    const shares s = shares_at(bxdf, wi.z);
    const float diffuse = s.base + s.base_transmitted;
    if (u_lobe < diffuse) {
        *passes = u_lobe < s.base_transmitted;
        *wo = ca_warp_cosine_hemisphere(u);
    } else {
        *passes = u_lobe - diffuse >= s.mirror;
        const ca_microfacet facets = facets_of(bxdf, *passes);
        const ca_vec3 m = ca_microfacet_sample(&facets, wi, u);
        *wo = ca_reflect_about(wi, m, ca_dot(wi, m));
    }
    return wo->z > 0.0f;
}

bool ca_principled_thin_sample(CA_BXDF_SAMPLE_ARGUMENTS)
{
    bool passes;
    ca_vec3 wo;
    if (wi_local.z == 0.0f) return false;
    if (!sample_above(bxdf, turned_up(wi_local), u_lobe, u, &passes, &wo)) return false;
    if (passes != (wi_local.z < 0.0f)) wo.z = -wo.z;
    const ca_bxdf_value value = ca_principled_thin_eval(bxdf, wi_local, wo, from);
    if (!(value.pdf.v > 0.0f)) return false;
    *sample =
        (ca_bxdf_sample){.wo_local = wo,
                         .weight = ca_rgb_scale(value.f, fabsf(wo.z) / value.pdf.v),
                         .pdf = value.pdf,
                         .pdf_reverse = value.pdf_reverse,
                         .scatter = (passes ? CA_SCATTER_TRANSMISSION : CA_SCATTER_REFLECTION) | CA_SCATTER_SMOOTH,
                         .eta = 1.0f};
    return true;
}

/* The base colour where light is scattered or passes, white where it is reflected. */
ca_rgb ca_principled_thin_albedo(const ca_bxdf *bxdf, ca_vec3 wi_local)
{
    const float mirror = reflectance(bxdf, ca_at_most_one(fabsf(wi_local.z)));
    return ca_rgb_lerp(bxdf->as.principled_thin.base_color, ca_rgb_grey(1.0f),
                       mirror * bxdf->as.principled_thin.spec_trans);
}
