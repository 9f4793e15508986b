#include "material/microfacet.h"

#include "sampling/warp.h"

#include <assert.h>

#define INV_SQRT_PI 0.56418958354775628695f

float ca_microfacet_density(const ca_microfacet *facets, ca_vec3 m)
{
    assert(facets->alpha_x >= CA_MICROFACET_MIN_ALPHA && facets->alpha_y >= CA_MICROFACET_MIN_ALPHA);
    if (!(m.z > 0.0f)) return 0.0f;
    const float x = m.x / facets->alpha_x, y = m.y / facets->alpha_y, z2 = m.z * m.z;
    const float scale = CA_PI * facets->alpha_x * facets->alpha_y;
    if (facets->kind == CA_MICROFACET_GGX) return 1.0f / (scale * ca_sqr(x * x + y * y + z2));
    const float exponent = (x * x + y * y) / z2;
    /* Beyond e^-80 there is nothing left, and z2 may be too small to square. */
    return exponent < 80.0f ? expf(-exponent) / (scale * z2 * z2) : 0.0f;
}

/* With t = tan of v's angle after stretching: GGX G1 = 2 / (1 + sqrt(1 + t^2)); Beckmann, a = 1/t,
 * G1 = 2 / (1 + erf(a) + exp(-a^2) / (a sqrt(pi))). Both times 1/|v.z|, taken into the denominator. */
float ca_microfacet_masking_over_cos(const ca_microfacet *facets, ca_vec3 v)
{
    const float z = fabsf(v.z), r2 = ca_sqr(facets->alpha_x * v.x) + ca_sqr(facets->alpha_y * v.y);
    if (facets->kind == CA_MICROFACET_GGX) return 2.0f / (z + sqrtf(z * z + r2));
    const float r = sqrtf(r2);
    if (z >= 4.0f * r) return 1.0f / z;
    const float a = z / r;
    return 2.0f / (z * (1.0f + erff(a)) + r * INV_SQRT_PI * expf(-a * a));
}

/* ---- Sampling -------------------------------------------------------------------------------------------------- */

/* Inverse of erf on (-1, 1), relative error below 1e-6: polynomials in w = -log(1 - x^2) near zero and in sqrt(w) in
 * the tails (a form due to Giles 2010), their coefficients fitted for least relative error with x from 0 to the last
 * float below 1. */
static float inverse_erf(float x)
{
    const float w = -logf((1.0f - x) * (1.0f + x));
    if (w < 5.0f) {
        const float t = w - 2.5f;
        return x * (1.50140918f +
                    t * (0.246641421f +
                         t * (-0.00417625881f +
                              t * (-0.00125463149f +
                                   t * (0.000217336034f +
                                        t * (-4.09419707e-06f + t * (-3.18588389e-06f + t * 3.15633088e-07f)))))));
    }
    const float t = sqrtf(w) - 3.0f;
    return x * (2.83297824f +
                t * (1.00167811f + t * (0.00939582043f +
                                        t * (-0.00767445617f +
                                             t * (0.00596184883f + t * (-0.00353093719f + t * 0.000973378161f))))));
}

/* Slope along the view of a visible Beckmann facet with alpha = 1, seen under an angle of tangent `tangent`. In
 * b = erf(slope) the cumulative distribution is
 *     1 + b + tangent / sqrt(pi) exp(-slope^2),  from b = -1 to erf(1 / tangent), over its last value,
 * which is smooth and steep where the other parametrisations are not (Jakob 2014, cited by Mitsuba 3's microfacet.h):
 * Newton's method, kept inside a bracket, from the exact solution for grazing view. */
static float sample_beckmann_slope(float tangent, float u)
{
    const float cotangent = 1.0f / tangent;
    const float b_max = erff(cotangent), exp_factor = tangent * INV_SQRT_PI;
    const float target = u * (1.0f + b_max + exp_factor * expf(-cotangent * cotangent));
    const float tolerance = 5e-7f * (1.0f + target); /* what rounding leaves of the sum below */
    float low = -1.0f, high = b_max;
    float b = b_max - (1.0f + b_max) * erff(sqrtf(-logf(u)));
    for (int i = 0; i < 12; ++i) {
        if (!(b > low && b < high)) b = 0.5f * (low + high);
        const float slope = inverse_erf(b);
        const float excess = 1.0f + b + exp_factor * expf(-slope * slope) - target;
        if (fabsf(excess) <= tolerance) return slope;
        if (excess > 0.0f)
            high = b;
        else
            low = b;
        b -= excess / (1.0f - slope * tangent);
    }
    return inverse_erf(ca_clamp(b, -CA_ONE_MINUS_EPSILON, CA_ONE_MINUS_EPSILON));
}

/* Stretch the view so that alpha becomes 1, sample a slope in the frame of the view, turn and stretch back. */
static ca_vec3 sample_visible_beckmann(const ca_microfacet *facets, ca_vec3 v, ca_vec2 u)
{
    const float x = facets->alpha_x * v.x, y = facets->alpha_y * v.y, r = sqrtf(x * x + y * y);
    const float cos_phi = r > 0.0f ? x / r : 1.0f, sin_phi = r > 0.0f ? y / r : 0.0f;
    const float u_along = ca_clamp(u.x, 1e-6f, 1.0f - 1e-6f), u_across = ca_clamp(u.y, 1e-6f, 1.0f - 1e-6f);
    /* Below this tangent visible and all normals differ by less than single precision resolves. */
    const float tangent = ca_max(r / v.z, 1e-6f);
    const float along = sample_beckmann_slope(ca_min(tangent, 1e8f), u_along);
    const float across = inverse_erf(2.0f * u_across - 1.0f);
    return ca_normalize((ca_vec3){-facets->alpha_x * (cos_phi * along - sin_phi * across),
                                  -facets->alpha_y * (sin_phi * along + cos_phi * across), 1.0f});
}

/* After stretching, the facets are a hemisphere, and what a parallel beam along v sees of it reflects uniformly over
 * a cap of the sphere, z > -v.z: sample the cap and take the half vector (the construction of Dupuy and Benyoub 2023,
 * equivalent to projecting a disk). Its z is exactly (1 - u) (1 + v.z), which is positive. */
static ca_vec3 sample_visible_ggx(const ca_microfacet *facets, ca_vec3 v, ca_vec2 u)
{
    const ca_vec3 w = ca_normalize((ca_vec3){facets->alpha_x * v.x, facets->alpha_y * v.y, v.z});
    const float half_z = (1.0f - u.y) * (1.0f + w.z), cap_z = half_z - w.z;
    const float radius = ca_sqrt0((1.0f - cap_z) * (1.0f + cap_z));
    float sine, cosine;
    ca_sincos(CA_TWO_PI * u.x, &sine, &cosine);
    return ca_normalize(
        (ca_vec3){facets->alpha_x * (radius * cosine + w.x), facets->alpha_y * (radius * sine + w.y), half_z});
}

/* Both distributions depend on the slope over alpha only through its length: its azimuth is uniform. */
static ca_vec3 sample_all_normals(const ca_microfacet *facets, ca_vec2 u)
{
    const float rest = 1.0f - u.y; /* in (0, 1] */
    const float slope = facets->kind == CA_MICROFACET_GGX ? sqrtf(u.y / rest) : sqrtf(-logf(rest));
    float sine, cosine;
    ca_sincos(CA_TWO_PI * u.x, &sine, &cosine);
    return ca_normalize((ca_vec3){facets->alpha_x * slope * cosine, facets->alpha_y * slope * sine, 1.0f});
}

ca_vec3 ca_microfacet_sample(const ca_microfacet *facets, ca_vec3 v, ca_vec2 u)
{
    assert(facets->alpha_x >= CA_MICROFACET_MIN_ALPHA && facets->alpha_y >= CA_MICROFACET_MIN_ALPHA && v.z > 0.0f);
    if (!facets->sample_visible) return sample_all_normals(facets, u);
    if (facets->kind == CA_MICROFACET_GGX) return sample_visible_ggx(facets, v, u);
    return sample_visible_beckmann(facets, v, u);
}
