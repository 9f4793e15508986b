/* The angle of a point in the plane, without libm: the same bits on every machine, and no call.
 *
 * atan of a in [0, 1] is a times a polynomial of degree 9 in a^2, fitted for the least relative error (2.4e-9); the
 * rest is symmetry. The relative error is below 3e-7 (tests/test_math.c). */
#ifndef CA_MATH_ARC_TANGENT_H
#define CA_MATH_ARC_TANGENT_H

#include "math/numeric.h"

static inline float ca_atan_unit(float a)
{
    const float s = a * a, s2 = s * s, s4 = s2 * s2;
    const float p01 = 1.0f + s * -0.333332837f, p23 = 0.199982658f + s * -0.142619327f;
    const float p45 = 0.109420307f + s * -0.0837731510f, p67 = 0.0575520955f + s * -0.0308045894f;
    const float p89 = 0.0107269399f + s * -0.00175392919f;
    return a * ((p01 + s2 * p23) + s4 * ((p45 + s2 * p67) + s4 * p89));
}

/* As atan2f for finite arguments, of which both may be 0. */
static inline float ca_atan2(float y, float x)
{
    const float along = fabsf(x), across = fabsf(y);
    const float large = ca_max(along, across), small = ca_min(along, across);
    const float octant = ca_atan_unit(large > 0.0f ? small / large : 0.0f);
    const float quadrant = across > along ? 0.5f * CA_PI - octant : octant;
    return copysignf(signbit(x) ? CA_PI - quadrant : quadrant, y);
}

/* The angle of (x, y) in turns, [0, 1). */
static inline float ca_turn(float x, float y)
{
    const float u = ca_atan2(y, x) * CA_INV_TWO_PI;
    return u < 0.0f ? ca_min(u + 1.0f, CA_ONE_MINUS_EPSILON) : u;
}

#endif
