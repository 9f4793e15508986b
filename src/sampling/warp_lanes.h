/* Eight lanes of sampling/warp.c, the same operations in the same order. */
#ifndef CA_SAMPLING_WARP_LANES_H
#define CA_SAMPLING_WARP_LANES_H

#include "math/lanes.h"
#include "math/numeric.h"

/* ca_sincos_quarter. */
static inline void ca_sincos_quarter8(ca_f8 x, ca_f8 *sine, ca_f8 *cosine)
{
    const ca_f8 x2 = x * x;
    const ca_f8 s = -1.0f / 6.0f + x2 * (1.0f / 120.0f + x2 * (-1.0f / 5040.0f + x2 * (1.0f / 362880.0f)));
    const ca_f8 c = 1.0f / 24.0f + x2 * (-1.0f / 720.0f + x2 * (1.0f / 40320.0f + x2 * (-1.0f / 3628800.0f)));
    *sine = x + x * (x2 * s);
    *cosine = 1.0f - (0.5f * x2 - (x2 * x2) * c);
}

/* ca_sincos. */
static inline void ca_sincos8(ca_f8 angle, ca_f8 *sine, ca_f8 *cosine)
{
    const ca_f8 quarters = ca_rint8(angle * (2.0f / CA_PI));
    ca_f8 x = angle - quarters * 0x1.92p+0f;
    x -= quarters * 0x1.fb4p-12f;
    x -= quarters * 0x1.4442d2p-24f;
    ca_f8 s, c;
    ca_sincos_quarter8(x, &s, &c);
    const ca_m8 quadrant = __builtin_convertvector(quarters, ca_m8), odd = (quadrant & 1) != 0;
    const ca_f8 swapped_sine = ca_select8(odd, c, s), swapped_cosine = ca_select8(odd, s, c);
    *sine = ca_select8((quadrant & 2) != 0, -swapped_sine, swapped_sine);
    *cosine = ca_select8(((quadrant + 1) & 2) != 0, -swapped_cosine, swapped_cosine);
}

/* ca_warp_linear. */
static inline ca_f8 ca_linear8(ca_f8 u, ca_f8 low, ca_f8 high)
{
    const ca_f8 sum = low + high, a = low / sum, b = high / sum;
    const ca_f8 t = ca_min8(u / (a + ca_sqrt8(a * a * (1.0f - u) + b * b * u)), ca_f8_all(CA_ONE_MINUS_EPSILON));
    return ca_select8(sum > 0.0f, t, u);
}

/* ca_warp_disk. */
static inline void ca_disk8(ca_f8 u, ca_f8 v, ca_f8 *x, ca_f8 *y)
{
    const ca_f8 a = 2.0f * u - 1.0f, b = 2.0f * v - 1.0f, zero = ca_f8_all(0.0f);
    const ca_m8 along_x = ca_abs8(a) > ca_abs8(b);
    const ca_f8 large = ca_select8(along_x, a, b), small = ca_select8(along_x, b, a);
    ca_f8 s, c;
    ca_sincos_quarter8(0.25f * CA_PI * (small / large), &s, &c);
    const ca_m8 middle = ~along_x & (b == 0.0f);
    *x = ca_select8(middle, zero, large * ca_select8(along_x, c, s));
    *y = ca_select8(middle, zero, large * ca_select8(along_x, s, c));
}

/* ca_warp_sphere. */
static inline ca_v8 ca_sphere8(ca_f8 u, ca_f8 v)
{
    const ca_f8 one_minus_cos = 2.0f * u, square = one_minus_cos * (2.0f - one_minus_cos);
    ca_f8 s, c;
    ca_sincos8(CA_TWO_PI * v, &s, &c);
    const ca_f8 sin_theta = ca_sqrt8(ca_select8(square > 0.0f, square, ca_f8_all(0.0f)));
    return (ca_v8){sin_theta * c, sin_theta * s, 1.0f - one_minus_cos};
}

#endif
