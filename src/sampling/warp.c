#include "sampling/warp.h"

/* sin and cos for |x| <= pi/4 (and a little more) by their Taylor series. The first terms left out are x^11 / 11! and
 * x^12 / 12!, under 2e-9 of the value: what is left is the rounding of the sum. */
static inline void sincos_quarter(float x, float *sine, float *cosine)
{
    const float x2 = x * x;
    const float s = -1.0f / 6.0f + x2 * (1.0f / 120.0f + x2 * (-1.0f / 5040.0f + x2 * (1.0f / 362880.0f)));
    const float c = 1.0f / 24.0f + x2 * (-1.0f / 720.0f + x2 * (1.0f / 40320.0f + x2 * (-1.0f / 3628800.0f)));
    *sine = x + x * (x2 * s);
    *cosine = 1.0f - (0.5f * x2 - (x2 * x2) * c);
}

void ca_sincos(float angle, float *sine, float *cosine)
{
    /* pi/2 in three parts; the first two have their last bits clear, so that their products with a small number of
     * quarter turns are exact (Cody and Waite's reduction). */
    const float quarters = rintf(angle * (2.0f / CA_PI));
    float x = angle - quarters * 0x1.92p+0f;
    x -= quarters * 0x1.fb4p-12f;
    x -= quarters * 0x1.4442d2p-24f;

    float s, c;
    sincos_quarter(x, &s, &c);
    const int quadrant = (int)quarters & 3;
    const float swapped_sine = (quadrant & 1) ? c : s, swapped_cosine = (quadrant & 1) ? s : c;
    *sine = (quadrant & 2) ? -swapped_sine : swapped_sine;
    *cosine = ((quadrant + 1) & 2) ? -swapped_cosine : swapped_cosine;
}

ca_vec2 ca_warp_disk(ca_vec2 u)
{
    const float a = 2.0f * u.x - 1.0f, b = 2.0f * u.y - 1.0f;
    float s, c;
    if (fabsf(a) > fabsf(b)) {
        sincos_quarter(0.25f * CA_PI * (b / a), &s, &c);
        return (ca_vec2){a * c, a * s};
    }
    if (b == 0.0f) return (ca_vec2){0.0f, 0.0f};
    sincos_quarter(0.25f * CA_PI * (a / b), &s, &c);
    return (ca_vec2){b * s, b * c};
}

/* The radius is the root of one number and the angle the other, in quarter turns that need no reduction. Concentric
 * squares would keep squares squarer, at the price of a division and of a branch that cannot be predicted. z is never
 * 0: u.x is at most 1 - 2^-24. */
ca_vec3 ca_warp_cosine_hemisphere(ca_vec2 u)
{
    const float quarters = 4.0f * u.y;
    const int quadrant = (int)(quarters + 0.5f);
    float s, c;
    sincos_quarter((quarters - (float)quadrant) * (0.5f * CA_PI), &s, &c);
    const float r = sqrtf(u.x);
    const float x = (quadrant & 1) ? -s : c, y = (quadrant & 1) ? c : s;
    const float sign = (quadrant & 2) ? -r : r;
    return (ca_vec3){sign * x, sign * y, sqrtf(1.0f - u.x)};
}

/* A direction whose 1 - cos is given: the sine comes from it without cancellation, as near the pole as it may be. */
static inline ca_vec3 around_axis(float one_minus_cos, float turns)
{
    float s, c;
    ca_sincos(CA_TWO_PI * turns, &s, &c);
    const float sin_theta = ca_sqrt0(one_minus_cos * (2.0f - one_minus_cos));
    return (ca_vec3){sin_theta * c, sin_theta * s, 1.0f - one_minus_cos};
}

ca_vec3 ca_warp_sphere(ca_vec2 u) { return around_axis(2.0f * u.x, u.y); }

ca_vec3 ca_warp_cone(ca_vec2 u, float one_minus_cos_max) { return around_axis(u.x * one_minus_cos_max, u.y); }

ca_vec2 ca_warp_triangle(ca_vec2 u)
{
    const float root = sqrtf(u.x);
    return (ca_vec2){root * (1.0f - u.y), root * u.y};
}
