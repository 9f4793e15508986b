/* Maps from the unit square to shapes and directions, each beside its density. Every map preserves stratification.
 * u is in [0, 1)^2. Directions are local: z is the axis. */
#ifndef CA_SAMPLING_WARP_H
#define CA_SAMPLING_WARP_H

#include "math/measure.h"
#include "math/numeric.h"
#include "math/vec.h"

/* sin and cos of an angle of at most a few turns, without libm: the same bits on every machine. Largest error found
 * over 20 million angles in [-20, 20]: 7.8e-8 (1.3 x 2^-24). */
void ca_sincos(float angle, float *sine, float *cosine);

/* sin and cos for |x| <= pi/4 (and a little more) by their Taylor series. The first terms left out are x^11 / 11! and
 * x^12 / 12!, under 2e-9 of the value: what is left is the rounding of the sum. */
static inline void ca_sincos_quarter(float x, float *sine, float *cosine)
{
    const float x2 = x * x;
    const float s = -1.0f / 6.0f + x2 * (1.0f / 120.0f + x2 * (-1.0f / 5040.0f + x2 * (1.0f / 362880.0f)));
    const float c = 1.0f / 24.0f + x2 * (-1.0f / 720.0f + x2 * (1.0f / 40320.0f + x2 * (-1.0f / 3628800.0f)));
    *sine = x + x * (x2 * s);
    *cosine = 1.0f - (0.5f * x2 - (x2 * x2) * c);
}

/* In [0, 1), with a density that runs linearly from a share of `low` to one of `high`, both >= 0; uniform where both
 * are 0. By inverting its integral, a quadratic, in the form that has no cancellation. */
static inline float ca_warp_linear(float u, float low, float high)
{
    const float sum = low + high;
    if (!(sum > 0.0f)) return u;
    const float a = low / sum, b = high / sum;
    return ca_min(u / (a + sqrtf(a * a * (1.0f - u) + b * b * u)), CA_ONE_MINUS_EPSILON);
}

/* Unit disk, area-preserving, concentric squares to circles (Shirley and Chiu 1997). Density 1/pi. */
ca_vec2 ca_warp_disk(ca_vec2 u);

/* Upper hemisphere, density cos/pi per solid angle.
 *
 * The radius is the root of one number and the angle the other, in quarter turns that need no reduction. Concentric
 * squares would keep squares squarer, at the price of a division and of a branch that cannot be predicted. z is never
 * 0: u.x is at most 1 - 2^-24. */
static inline ca_vec3 ca_warp_cosine_hemisphere(ca_vec2 u)
{
    const float quarters = 4.0f * u.y;
    const int quadrant = (int)(quarters + 0.5f);
    float s, c;
    ca_sincos_quarter((quarters - (float)quadrant) * (0.5f * CA_PI), &s, &c);
    const float r = sqrtf(u.x);
    const float x = (quadrant & 1) ? -s : c, y = (quadrant & 1) ? c : s;
    const float sign = (quadrant & 2) ? -r : r;
    return (ca_vec3){sign * x, sign * y, sqrtf(1.0f - u.x)};
}
static inline ca_pdf_solid_angle ca_warp_cosine_hemisphere_pdf(float cos_theta)
{
    return (ca_pdf_solid_angle){cos_theta > 0.0f ? cos_theta * CA_INV_PI : 0.0f};
}

/* Unit sphere, density 1/(4 pi). */
ca_vec3 ca_warp_sphere(ca_vec2 u);

/* Cone around +z, all directions with 1 - cos <= one_minus_cos_max, uniform: density 1/(2 pi one_minus_cos_max). The
 * argument is 1 - cos and not cos because a small cone would lose all its digits. */
ca_vec3 ca_warp_cone(ca_vec2 u, float one_minus_cos_max);
static inline ca_pdf_solid_angle ca_warp_cone_pdf(float one_minus_cos_max)
{
    return (ca_pdf_solid_angle){CA_INV_TWO_PI / one_minus_cos_max};
}

/* Barycentric coordinates (b1, b2) uniform over a triangle. Density 1/area. */
ca_vec2 ca_warp_triangle(ca_vec2 u);

#endif
