/* Orthonormal frames: local z is the normal n. */
#ifndef CA_MATH_FRAME_H
#define CA_MATH_FRAME_H

#include "math/vec.h"

typedef struct ca_frame {
    ca_vec3 s, t, n;
} ca_frame;

/* A right-handed frame around a unit vector, continuous but at n.z = 0 (Duff et al. 2017, "Building an
 * Orthonormal Basis, Revisited", listing 3). */
static inline ca_frame ca_frame_from_normal(ca_vec3 n)
{
    const float sign = copysignf(1.0f, n.z);
    const float a = -1.0f / (sign + n.z);
    const float b = n.x * n.y * a;
    return (ca_frame){.s = {1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x},
                      .t = {b, sign + n.y * n.y * a, -n.y},
                      .n = n};
}

/* A right-handed frame around n with s as near to `tangent` as can be; any frame around n if the tangent is zero or
 * parallel to n. */
static inline ca_frame ca_frame_from_tangent(ca_vec3 n, ca_vec3 tangent)
{
    const ca_vec3 s = ca_madd(tangent, -ca_dot(n, tangent), n);
    const float length2 = ca_length2(s);
    if (!(length2 > 1e-12f * ca_length2(tangent)) || !(length2 > 0.0f)) return ca_frame_from_normal(n);
    const ca_vec3 unit = ca_mul(s, 1.0f / sqrtf(length2));
    return (ca_frame){.s = unit, .t = ca_cross(n, unit), .n = n};
}

static inline ca_vec3 ca_to_local(const ca_frame *frame, ca_vec3 v_world)
{
    return (ca_vec3){ca_dot(frame->s, v_world), ca_dot(frame->t, v_world), ca_dot(frame->n, v_world)};
}

static inline ca_vec3 ca_to_world(const ca_frame *frame, ca_vec3 v_local)
{
    return ca_madd(ca_madd(ca_mul(frame->s, v_local.x), v_local.y, frame->t), v_local.z, frame->n);
}

#endif
