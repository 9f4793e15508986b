/* Constants, clamps and rounding bounds for single precision. */
#ifndef CA_MATH_NUMERIC_H
#define CA_MATH_NUMERIC_H

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

#define CA_PI 3.14159265358979323846f
#define CA_TWO_PI 6.28318530717958647693f
#define CA_INV_PI 0.31830988618379067154f
#define CA_INV_TWO_PI 0.15915494309189533577f
#define CA_INV_FOUR_PI 0.07957747154594766788f
#define CA_PI_D 3.14159265358979323846

/* The largest float below 1: samples lie in [0, CA_ONE_MINUS_EPSILON]. */
#define CA_ONE_MINUS_EPSILON 0x1.fffffep-1f

/* Bound on the relative error of n rounded operations in a row: n u / (1 - n u) with u = 2^-24 (Higham, "Accuracy
 * and Stability of Numerical Algorithms", lemma 3.1). */
#define CA_GAMMA(n) ((float)(n) * 0x1p-24f / (1.0f - (float)(n) * 0x1p-24f))

/* As fminf and fmaxf for numbers, one instruction each; with a NaN the answer is b. */
static inline float ca_min(float a, float b) { return a < b ? a : b; }
static inline float ca_max(float a, float b) { return a > b ? a : b; }

static inline float ca_sqr(float x) { return x * x; }
static inline float ca_clamp(float x, float low, float high) { return x < low ? low : x > high ? high : x; }
static inline float ca_lerp(float a, float b, float t) { return (1.0f - t) * a + t * b; }
/* sqrt of a number that rounding may have made slightly negative. */
static inline float ca_sqrt0(float x) { return sqrtf(x > 0.0f ? x : 0.0f); }
static inline uint32_t ca_min_u32(uint32_t a, uint32_t b) { return a < b ? a : b; }
static inline uint32_t ca_max_u32(uint32_t a, uint32_t b) { return a > b ? a : b; }

/* The place in the middle of a part, of `parts` equal ones of `size` places. */
static inline uint32_t ca_middle_of_part(uint32_t part, uint32_t parts, uint32_t size)
{
    return (uint32_t)((2 * (uint64_t)part + 1) * size / (2 * (uint64_t)parts));
}

static inline uint32_t ca_float_bits(float x)
{
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}
static inline float ca_bits_float(uint32_t bits)
{
    float x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

/* The neighbouring float above / below a finite x. */
static inline float ca_next_up(float x)
{
    if (x == 0.0f) return 0x1p-149f;
    const uint32_t bits = ca_float_bits(x);
    return ca_bits_float(x > 0.0f ? bits + 1 : bits - 1);
}
static inline float ca_next_down(float x) { return -ca_next_up(-x); }

#endif
