/* Small vectors in single precision. A ca_vec3 is a point or a direction; names say which, and in which frame
 * (`position_world`, `wi_local`). Directions are of unit length unless a name says otherwise. */
#ifndef CA_MATH_VEC_H
#define CA_MATH_VEC_H

#include "math/numeric.h"

#include <float.h>
#include <math.h>
#include <stdbool.h>

typedef struct ca_vec2 {
    float x, y;
} ca_vec2;

typedef struct ca_vec3 {
    float x, y, z;
} ca_vec3;

static inline ca_vec2 ca_vec2_make(float x, float y) { return (ca_vec2){x, y}; }
static inline ca_vec3 ca_vec3_make(float x, float y, float z) { return (ca_vec3){x, y, z}; }

static inline ca_vec3 ca_add(ca_vec3 a, ca_vec3 b) { return (ca_vec3){a.x + b.x, a.y + b.y, a.z + b.z}; }
static inline ca_vec3 ca_sub(ca_vec3 a, ca_vec3 b) { return (ca_vec3){a.x - b.x, a.y - b.y, a.z - b.z}; }
static inline ca_vec3 ca_mul(ca_vec3 a, float s) { return (ca_vec3){a.x * s, a.y * s, a.z * s}; }
static inline ca_vec3 ca_neg(ca_vec3 a) { return (ca_vec3){-a.x, -a.y, -a.z}; }
/* a + s b */
static inline ca_vec3 ca_madd(ca_vec3 a, float s, ca_vec3 b)
{
    return (ca_vec3){a.x + s * b.x, a.y + s * b.y, a.z + s * b.z};
}
static inline float ca_dot(ca_vec3 a, ca_vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline float ca_abs_dot(ca_vec3 a, ca_vec3 b) { return fabsf(ca_dot(a, b)); }
static inline ca_vec3 ca_cross(ca_vec3 a, ca_vec3 b)
{
    return (ca_vec3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
static inline float ca_length2(ca_vec3 a) { return ca_dot(a, a); }
static inline float ca_length(ca_vec3 a) { return sqrtf(ca_length2(a)); }
static inline ca_vec3 ca_normalize(ca_vec3 a) { return ca_mul(a, 1.0f / ca_length(a)); }
static inline ca_vec3 ca_abs3(ca_vec3 a) { return (ca_vec3){fabsf(a.x), fabsf(a.y), fabsf(a.z)}; }
static inline float ca_max3(ca_vec3 a) { return ca_max(a.x, ca_max(a.y, a.z)); }
/* Of a vector whose squared length may be too large or too small for a float: a cross product of the sides of a large
 * or small triangle. 0 stays 0. */
static inline ca_vec3 ca_normalize_any(ca_vec3 a)
{
    const float length2 = ca_dot(a, a);
    if (length2 >= FLT_MIN && length2 <= FLT_MAX) return ca_mul(a, 1.0f / sqrtf(length2));
    if (!(ca_max3(ca_abs3(a)) > 0.0f)) return a;
    return ca_normalize(ca_mul(a, length2 < FLT_MIN ? 0x1p100f : 0x1p-100f));
}
static inline ca_vec3 ca_min_vec3(ca_vec3 a, ca_vec3 b)
{
    return (ca_vec3){ca_min(a.x, b.x), ca_min(a.y, b.y), ca_min(a.z, b.z)};
}
static inline ca_vec3 ca_max_vec3(ca_vec3 a, ca_vec3 b)
{
    return (ca_vec3){ca_max(a.x, b.x), ca_max(a.y, b.y), ca_max(a.z, b.z)};
}
static inline bool ca_is_finite3(ca_vec3 a) { return isfinite(a.x) && isfinite(a.y) && isfinite(a.z); }

#endif
