/* Eight lanes of what material/bsdf.c, sampling/warp.c and geometry/surface.c do for one diffuse point: the same
 * operations in the same order. Internal to this folder. */
#ifndef CA_INTEGRATOR_BATCH_LANES_H
#define CA_INTEGRATOR_BATCH_LANES_H

#include "math/numeric.h"
#include "sampling/warp_lanes.h"

/* ca_warp_cosine_hemisphere. */
static inline ca_v8 ca_cosine_hemisphere8(ca_f8 u, ca_f8 v)
{
    const ca_f8 quarters = 4.0f * v;
    const ca_m8 quadrant = __builtin_convertvector(quarters + 0.5f, ca_m8);
    ca_f8 s, c;
    ca_sincos_quarter8((quarters - __builtin_convertvector(quadrant, ca_f8)) * (0.5f * CA_PI), &s, &c);
    const ca_f8 r = ca_sqrt8(u);
    const ca_m8 odd = (quadrant & 1) != 0, second = (quadrant & 2) != 0;
    const ca_f8 x = ca_select8(odd, -s, c), y = ca_select8(odd, c, s);
    const ca_f8 sign = ca_select8(second, -r, r);
    return (ca_v8){sign * x, sign * y, ca_sqrt8(1.0f - u)};
}

/* ca_to_world of ca_frame_from_normal(n). */
static inline ca_v8 ca_to_world8(ca_v8 n, ca_v8 local)
{
    const ca_f8 sign = ca_copysign8(ca_f8_all(1.0f), n.z);
    const ca_f8 a = -1.0f / (sign + n.z);
    const ca_f8 b = n.x * n.y * a;
    const ca_v8 s = {1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x};
    const ca_v8 t = {b, sign + n.y * n.y * a, -n.y};
    return ca_madd_v8(ca_madd_v8(ca_mul_v8(s, local.x), local.y, t), local.z, n);
}

/* ca_offset_origin with one error bound for all coordinates. */
static inline ca_v8 ca_offset_origin8(ca_v8 position, ca_f8 error, ca_v8 ng, ca_v8 direction)
{
    const ca_v8 reach = ca_madd_v8((ca_v8){error, error, error}, ca_f8_all(CA_GAMMA(2)), ca_abs_v8(position));
    const ca_f8 distance = ca_dot_v8(ca_abs_v8(ng), reach);
    return ca_madd_v8(position, ca_copysign8(distance, ca_dot_v8(ng, direction)), ng);
}

#endif
