/* A colour: three linear Rec. 709 components. Radiance in W sr^-1 m^-2 or a factor without unit; names say which. */
#ifndef CA_MATH_RGB_H
#define CA_MATH_RGB_H

#include "math/numeric.h"

#include <math.h>
#include <stdbool.h>

typedef struct ca_rgb {
    float r, g, b;
} ca_rgb;

static inline ca_rgb ca_rgb_make(float r, float g, float b) { return (ca_rgb){r, g, b}; }
static inline ca_rgb ca_rgb_grey(float v) { return (ca_rgb){v, v, v}; }
static inline ca_rgb ca_rgb_add(ca_rgb a, ca_rgb b) { return (ca_rgb){a.r + b.r, a.g + b.g, a.b + b.b}; }
static inline ca_rgb ca_rgb_sub(ca_rgb a, ca_rgb b) { return (ca_rgb){a.r - b.r, a.g - b.g, a.b - b.b}; }
static inline ca_rgb ca_rgb_mul(ca_rgb a, ca_rgb b) { return (ca_rgb){a.r * b.r, a.g * b.g, a.b * b.b}; }
static inline ca_rgb ca_rgb_div(ca_rgb a, ca_rgb b) { return (ca_rgb){a.r / b.r, a.g / b.g, a.b / b.b}; }
static inline ca_rgb ca_rgb_scale(ca_rgb a, float s) { return (ca_rgb){a.r * s, a.g * s, a.b * s}; }
/* a + s b */
static inline ca_rgb ca_rgb_madd(ca_rgb a, float s, ca_rgb b)
{
    return (ca_rgb){a.r + s * b.r, a.g + s * b.g, a.b + s * b.b};
}
static inline ca_rgb ca_rgb_lerp(ca_rgb a, ca_rgb b, float t)
{
    return ca_rgb_add(ca_rgb_scale(a, 1.0f - t), ca_rgb_scale(b, t));
}
static inline float ca_rgb_max(ca_rgb a) { return ca_max(a.r, ca_max(a.g, a.b)); }
static inline float ca_rgb_average(ca_rgb a) { return (a.r + a.g + a.b) * (1.0f / 3.0f); }
static inline bool ca_rgb_is_black(ca_rgb a) { return a.r == 0.0f && a.g == 0.0f && a.b == 0.0f; }
static inline bool ca_rgb_is_finite(ca_rgb a) { return isfinite(a.r) && isfinite(a.g) && isfinite(a.b); }
/* Luminance of linear Rec. 709 (ITU-R BT.709, item 3.2). */
static inline float ca_luminance(ca_rgb a) { return 0.2126f * a.r + 0.7152f * a.g + 0.0722f * a.b; }

#endif
