#include "material/rough_transmittance.h"

#include "base/memory.h"
#include "material/bxdf_models.h"
#include "material/fresnel.h"
#include "material/microfacet.h"

/* Entry i belongs to cos = (i / (TABLE_SIZE - 1))^2: the function bends most at grazing angles. */
enum { TABLE_SIZE = 64, GRID_OUTSIDE = 32, GRID_INSIDE = 32, ANGLES_BELOW_CRITICAL = 16, ANGLES_ABOVE_CRITICAL = 24 };

/* Of the index: beyond it reciprocity tells what gets out. */
#define LARGE_INDEX 2.0f

struct ca_rough_transmittance {
    float transmittance[TABLE_SIZE];
    float from_inside;
};

/* Shares of light at an angle of cosine `cosine` that the boundary reflects and transmits in one event: the means of
 * F G1(wo) and (1 - F) G1(wo) over visible facets, by the midpoint rule on the unit square. */
static void boundary_shares(const ca_microfacet *facets, float cosine, float eta, uint32_t grid, float *reflected,
                            float *transmitted)
{
    const ca_vec3 v = {sqrtf((1.0f - cosine) * (1.0f + cosine)), 0.0f, cosine};
    double sum_reflected = 0.0, sum_transmitted = 0.0;
    for (uint32_t i = 0; i < grid * grid; ++i) {
        const ca_vec2 u = {((float)(i % grid) + 0.5f) / (float)grid, ((float)(i / grid) + 0.5f) / (float)grid};
        const ca_vec3 m = ca_microfacet_sample(facets, v, u);
        const float cos_i = ca_at_most_one(ca_dot(v, m));
        if (!(cos_i > CA_MIN_FACET_COS)) continue;
        float cos_far;
        const float fresnel = ca_fresnel_dielectric(cos_i, eta, &cos_far);
        const ca_vec3 mirrored = ca_reflect_about(v, m, cos_i);
        if (mirrored.z > 0.0f)
            sum_reflected += (double)(fresnel * mirrored.z * ca_microfacet_masking_over_cos(facets, mirrored));
        const ca_vec3 refracted = ca_madd(ca_mul(v, -1.0f / eta), cos_i / eta - cos_far, m);
        if (cos_far > 0.0f && refracted.z < 0.0f)
            sum_transmitted +=
                (double)((1.0f - fresnel) * -refracted.z * ca_microfacet_masking_over_cos(facets, refracted));
    }
    *reflected = (float)(sum_reflected / (grid * grid));
    *transmitted = (float)(sum_transmitted / (grid * grid));
}

/* 2 * integral of R(c) c dc = integral of R over x = c^2. A smooth boundary reflects all up to the critical x and
 * then falls like a root: midpoints in x up to there, in t with x = critical + (1 - critical) t^2 from there. */
static float diffuse_reflectance_inside(const ca_microfacet *facets, float eta)
{
    const float critical = eta > 1.0f ? 1.0f - 1.0f / (eta * eta) : 0.0f;
    float transmitted, reflected;
    double sum = 0.0;
    for (uint32_t i = 0; i < ANGLES_BELOW_CRITICAL && critical > 0.0f; ++i) {
        const float x = critical * ((float)i + 0.5f) / ANGLES_BELOW_CRITICAL;
        boundary_shares(facets, sqrtf(x), 1.0f / eta, GRID_INSIDE, &reflected, &transmitted);
        sum += (double)(reflected * critical / ANGLES_BELOW_CRITICAL);
    }
    for (uint32_t i = 0; i < ANGLES_ABOVE_CRITICAL; ++i) {
        const float t = ((float)i + 0.5f) / ANGLES_ABOVE_CRITICAL;
        const float x = critical + (1.0f - critical) * t * t;
        boundary_shares(facets, sqrtf(x), 1.0f / eta, GRID_INSIDE, &reflected, &transmitted);
        sum += (double)(reflected * (1.0f - critical) * 2.0f * t / ANGLES_ABOVE_CRITICAL);
    }
    return (float)sum;
}

/* 2 * integral of T(c) c dc; the table's entries lie at squares of equal steps. */
static float diffuse_from_outside(const ca_rough_transmittance *table)
{
    double sum = 0.0, weights = 0.0;
    for (uint32_t i = 0; i < TABLE_SIZE; ++i) {
        const double x = (double)i / (TABLE_SIZE - 1), weight = x * x * x * (i == TABLE_SIZE - 1 ? 0.5 : 1.0);
        sum += weight * (double)table->transmittance[i];
        weights += weight;
    }
    return (float)(sum / weights);
}

ca_rough_transmittance *ca_rough_transmittance_create(ca_microfacet_kind kind, float alpha, float eta)
{
    ca_rough_transmittance *table = ca_alloc(1, sizeof *table);
    if (!table) return NULL;
    const ca_microfacet facets = ca_microfacet_make(kind, alpha, alpha, true);
    for (uint32_t i = 0; i < TABLE_SIZE; ++i) {
        const float cosine = fmaxf(ca_sqr((float)i / (TABLE_SIZE - 1)), 1e-6f);
        float reflected;
        boundary_shares(&facets, cosine, eta, GRID_OUTSIDE, &reflected, &table->transmittance[i]);
    }
    table->from_inside = eta > LARGE_INDEX ? diffuse_from_outside(table) / (eta * eta)
                                           : 1.0f - diffuse_reflectance_inside(&facets, eta);
    return table;
}

void ca_rough_transmittance_destroy(ca_rough_transmittance *table) { ca_free(table); }

float ca_rough_transmittance_eval(const ca_rough_transmittance *table, float cos_out)
{
    const float x = sqrtf(ca_clamp(cos_out, 0.0f, 1.0f)) * (TABLE_SIZE - 1);
    const uint32_t i = ca_min_u32((uint32_t)x, TABLE_SIZE - 2);
    return ca_lerp(table->transmittance[i], table->transmittance[i + 1], x - (float)i);
}

float ca_rough_transmittance_from_inside(const ca_rough_transmittance *table) { return table->from_inside; }
