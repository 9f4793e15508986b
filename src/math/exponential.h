/* The exponential function without a call, and eight of it at a time with the same bits.
 *
 * x = n ln 2 + r with |r| <= ln 2 / 2: e^r by its Taylor polynomial of degree 7, which is off by less than 6e-9, and
 * 2^n by the exponent's bits. ln 2 is taken away in two parts, the first of which times n is exact: Cody and Waite's
 * reduction. The relative error on [-87, 88] is below 1.2e-7 (tests/test_lanes.c); arguments beyond are taken to that
 * interval's ends. */
#ifndef CA_MATH_EXPONENTIAL_H
#define CA_MATH_EXPONENTIAL_H

#include "math/lanes.h"
#include "math/numeric.h"

#define CA_LOG2_E 1.44269504088896341f
#define CA_LN_2_HIGH 0.693359375f
#define CA_LN_2_LOW (-2.12194440e-4f)
/* Adding it rounds to a whole number; taking it away again leaves that. */
#define CA_ROUND_TO_WHOLE 12582912.0f

static inline float ca_exp(float x)
{
    const float inside = ca_max(ca_min(x, 88.0f), -87.0f);
    const float n = (inside * CA_LOG2_E + CA_ROUND_TO_WHOLE) - CA_ROUND_TO_WHOLE;
    const float r = (inside - n * CA_LN_2_HIGH) - n * CA_LN_2_LOW;
    const float high = 1.0f / 24.0f + r * (1.0f / 120.0f + r * (1.0f / 720.0f + r * (1.0f / 5040.0f)));
    const float p = 1.0f + r * (1.0f + r * (0.5f + r * (1.0f / 6.0f + r * high)));
    return p * ca_bits_float((uint32_t)((int32_t)n + 127) << 23);
}

static inline ca_f8 ca_exp8(ca_f8 x)
{
    const ca_f8 inside = ca_max8(ca_min8(x, ca_f8_all(88.0f)), ca_f8_all(-87.0f));
    const ca_f8 n = (inside * CA_LOG2_E + CA_ROUND_TO_WHOLE) - CA_ROUND_TO_WHOLE;
    const ca_f8 r = (inside - n * CA_LN_2_HIGH) - n * CA_LN_2_LOW;
    const ca_f8 high = 1.0f / 24.0f + r * (1.0f / 120.0f + r * (1.0f / 720.0f + r * (1.0f / 5040.0f)));
    const ca_f8 p = 1.0f + r * (1.0f + r * (0.5f + r * (1.0f / 6.0f + r * high)));
    const ca_m8 power = (__builtin_convertvector(n, ca_m8) + 127) << 23;
    return p * (ca_f8)power;
}

#endif
