/* The angle of a point in the plane, without libm: the same bits on every machine, and no call; and eight of it at a
 * time with the same bits.
 *
 * atan of a in [0, 1] is a times a polynomial of degree 9 in a^2, fitted for the least relative error (2.4e-9); the
 * rest is symmetry. The relative error is below 3e-7 (tests/test_math.c). */
#ifndef CA_MATH_ARC_TANGENT_H
#define CA_MATH_ARC_TANGENT_H

#include "math/lanes.h"
#include "math/numeric.h"

/* float or ca_f8. */
#define CA_ATAN_UNIT(type, a)                                                                                        \
    const type s = (a) * (a), s2 = s * s, s4 = s2 * s2;                                                              \
    const type p01 = 1.0f + s * -0.333332837f, p23 = 0.199982658f + s * -0.142619327f;                               \
    const type p45 = 0.109420307f + s * -0.0837731510f, p67 = 0.0575520955f + s * -0.0308045894f;                    \
    const type p89 = 0.0107269399f + s * -0.00175392919f;                                                            \
    return (a) * ((p01 + s2 * p23) + s4 * ((p45 + s2 * p67) + s4 * p89))

static inline float ca_atan_unit(float a) { CA_ATAN_UNIT(float, a); }
static inline ca_f8 ca_atan_unit8(ca_f8 a) { CA_ATAN_UNIT(ca_f8, a); }

/* As atan2f for finite arguments, of which both may be 0. */
static inline float ca_atan2(float y, float x)
{
    const float along = fabsf(x), across = fabsf(y);
    const float large = ca_max(along, across), small = ca_min(along, across);
    const float octant = ca_atan_unit(large > 0.0f ? small / large : 0.0f);
    const float quadrant = across > along ? 0.5f * CA_PI - octant : octant;
    return copysignf(signbit(x) ? CA_PI - quadrant : quadrant, y);
}

static inline ca_f8 ca_atan2_8(ca_f8 y, ca_f8 x)
{
    const ca_f8 zero = ca_f8_all(0.0f), along = ca_abs8(x), across = ca_abs8(y);
    const ca_f8 large = ca_max8(along, across), small = ca_min8(along, across);
    const ca_f8 octant = ca_atan_unit8(ca_select8(large > zero, small / large, zero));
    const ca_f8 quadrant = ca_select8(across > along, 0.5f * CA_PI - octant, octant);
    return ca_copysign8(ca_select8((ca_m8)x < 0, CA_PI - quadrant, quadrant), y);
}

/* The angle of (x, y) in turns, [0, 1). */
static inline float ca_turn(float x, float y)
{
    const float u = ca_atan2(y, x) * CA_INV_TWO_PI;
    return u < 0.0f ? ca_min(u + 1.0f, CA_ONE_MINUS_EPSILON) : u;
}

static inline ca_f8 ca_turn8(ca_f8 x, ca_f8 y)
{
    const ca_f8 u = ca_atan2_8(y, x) * CA_INV_TWO_PI;
    return ca_select8(u < 0.0f, ca_min8(u + 1.0f, ca_f8_all(CA_ONE_MINUS_EPSILON)), u);
}

#endif
