#include "sampling/warp.h"

void ca_sincos(float angle, float *sine, float *cosine)
{
    /* pi/2 in three parts; the first two have their last bits clear, so that their products with a small number of
     * quarter turns are exact (Cody and Waite's reduction). */
    const float quarters = rintf(angle * (2.0f / CA_PI));
    float x = angle - quarters * 0x1.92p+0f;
    x -= quarters * 0x1.fb4p-12f;
    x -= quarters * 0x1.4442d2p-24f;

    float s, c;
    ca_sincos_quarter(x, &s, &c);
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
        ca_sincos_quarter(0.25f * CA_PI * (b / a), &s, &c);
        return (ca_vec2){a * c, a * s};
    }
    if (b == 0.0f) return (ca_vec2){0.0f, 0.0f};
    ca_sincos_quarter(0.25f * CA_PI * (a / b), &s, &c);
    return (ca_vec2){b * s, b * c};
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
