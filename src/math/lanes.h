/* Eight floats at a time: the compilers' vector types behind a few names, for loops over structures of arrays.
 *
 * Each operation does in each lane what its scalar twin of vec.h, numeric.h or frame.h does, in the same order and
 * with the same rounding, so that a path gets the same bits in any lane and from the scalar code. Arithmetic and
 * comparisons are the language's own (+ - * / < ...); a comparison gives a mask of all or no bits in each lane. Loops
 * go over whole groups of eight: arrays have room for them, and what lies behind the last element is computed and not
 * used. */
#ifndef CA_MATH_LANES_H
#define CA_MATH_LANES_H

#include "math/vec.h"

#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>
#ifdef __AVX__
#include <immintrin.h>
#endif

enum { CA_LANES = 8 };

typedef float ca_f8 __attribute__((vector_size(32), may_alias));
typedef int32_t ca_m8 __attribute__((vector_size(32), may_alias)); /* a mask, or integers */

/* Vectors of three, eight of them. */
typedef struct ca_v8 {
    ca_f8 x, y, z;
} ca_v8;

/* So many numbers round up to whole groups. */
static inline uint32_t ca_lanes_up(uint32_t count) { return (count + CA_LANES - 1) / CA_LANES * CA_LANES; }

/* Elements i to i + 7 of an array that is aligned to 32 bytes; i is a multiple of eight. */
static inline ca_f8 ca_load8(const float *array, uint32_t i) { return *(const ca_f8 *)(const void *)(array + i); }
static inline void ca_store8(float *array, uint32_t i, ca_f8 v) { *(ca_f8 *)(void *)(array + i) = v; }
/* Eight elements from or to anywhere. */
static inline ca_f8 ca_load8_anywhere(const float *from)
{
    ca_f8 v;
    memcpy(&v, from, sizeof v);
    return v;
}
static inline void ca_store8_anywhere(float *to, ca_f8 v) { memcpy(to, &v, sizeof v); }
static inline ca_m8 ca_load8_u32(const uint32_t *array, uint32_t i)
{
    return *(const ca_m8 *)(const void *)(array + i);
}
static inline void ca_store8_u32(uint32_t *array, uint32_t i, ca_m8 v) { *(ca_m8 *)(void *)(array + i) = v; }

static inline ca_f8 ca_f8_all(float v) { return (ca_f8){v, v, v, v, v, v, v, v}; }
static inline ca_m8 ca_m8_all(int32_t v) { return (ca_m8){v, v, v, v, v, v, v, v}; }

/* a where the mask is set, else b. */
static inline ca_f8 ca_select8(ca_m8 mask, ca_f8 a, ca_f8 b)
{
#ifdef __AVX__
    return (ca_f8)_mm256_blendv_ps((__m256)b, (__m256)a, (__m256)mask);
#else
    return (ca_f8)((mask & (ca_m8)a) | (~mask & (ca_m8)b));
#endif
}

static inline ca_m8 ca_select8_int(ca_m8 mask, ca_m8 a, ca_m8 b)
{
    return (ca_m8)ca_select8(mask, (ca_f8)a, (ca_f8)b);
}

static inline ca_f8 ca_sqrt8(ca_f8 v)
{
#ifdef __AVX__
    return (ca_f8)_mm256_sqrt_ps((__m256)v);
#else
    for (int i = 0; i < CA_LANES; i++) v[i] = sqrtf(v[i]);
    return v;
#endif
}

/* As floorf and rintf. */
static inline ca_f8 ca_floor8(ca_f8 v)
{
#ifdef __AVX__
    return (ca_f8)_mm256_floor_ps((__m256)v);
#else
    for (int i = 0; i < CA_LANES; i++) v[i] = floorf(v[i]);
    return v;
#endif
}
static inline ca_f8 ca_rint8(ca_f8 v)
{
#ifdef __AVX__
    return (ca_f8)_mm256_round_ps((__m256)v, _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC);
#else
    for (int i = 0; i < CA_LANES; i++) v[i] = rintf(v[i]);
    return v;
#endif
}

/* One bit for each lane of a mask. */
static inline uint32_t ca_mask_bits(ca_m8 mask)
{
#ifdef __AVX__
    return (uint32_t)_mm256_movemask_ps((__m256)mask);
#else
    uint32_t bits = 0;
    for (int i = 0; i < CA_LANES; i++) bits |= (uint32_t)(mask[i] < 0) << i;
    return bits;
#endif
}

/* Likewise for the first `count` lanes, of which there may be more than eight. */
static inline uint32_t ca_mask_bits_below(ca_m8 mask, uint32_t count)
{
    return ca_mask_bits(mask) & (count < CA_LANES ? (1u << count) - 1 : UINT32_MAX);
}

/* Places of the lanes that have a bit, in their order; behind them any others. */
static inline ca_m8 ca_places_of_bits(uint32_t bits)
{
#if defined __AVX2__ && defined __BMI2__
    const uint64_t bytes = _pdep_u64(bits, 0x0101010101010101u) * 0xff;
    const uint64_t places = _pext_u64(0x0706050403020100u, bytes);
    return (ca_m8)_mm256_cvtepu8_epi32(_mm_cvtsi64_si128((long long)places));
#else
    ca_m8 places = {0};
    for (int count = 0; bits; bits &= bits - 1) places[count++] = __builtin_ctz(bits);
    return places;
#endif
}

/* The lanes at eight places. */
static inline ca_f8 ca_permute8(ca_f8 v, ca_m8 places)
{
#ifdef __AVX2__
    return (ca_f8)_mm256_permutevar8x32_ps((__m256)v, (__m256i)places);
#else
    ca_f8 permuted;
    for (int i = 0; i < CA_LANES; i++) permuted[i] = v[places[i]];
    return permuted;
#endif
}
static inline ca_v8 ca_permute_v8(ca_v8 v, ca_m8 places)
{
    return (ca_v8){ca_permute8(v.x, places), ca_permute8(v.y, places), ca_permute8(v.z, places)};
}

/* Elements of an array at eight places. */
static inline ca_f8 ca_gather8(const float *array, ca_m8 places)
{
#ifdef __AVX2__
    return (ca_f8)_mm256_i32gather_ps(array, (__m256i)places, sizeof *array);
#else
    ca_f8 gathered;
    for (int i = 0; i < CA_LANES; i++) gathered[i] = array[places[i]];
    return gathered;
#endif
}
static inline ca_m8 ca_gather8_u32(const uint32_t *array, ca_m8 places)
{
#ifdef __AVX2__
    return (ca_m8)_mm256_i32gather_epi32((const int *)array, (__m256i)places, sizeof *array);
#else
    ca_m8 gathered;
    for (int i = 0; i < CA_LANES; i++) gathered[i] = (int32_t)array[places[i]];
    return gathered;
#endif
}

/* In each lane the sum up to it: of pairs, then of fours, then of all. */
static inline ca_f8 ca_sums8(ca_f8 v)
{
    const ca_f8 zero = {0.0f};
    v += __builtin_shufflevector(zero, v, 0, 8, 0, 10, 0, 12, 0, 14);
    v += __builtin_shufflevector(zero, v, 0, 1, 9, 9, 4, 5, 13, 13);
    v += __builtin_shufflevector(zero, v, 0, 1, 2, 3, 11, 11, 11, 11);
    return v;
}

static inline ca_f8 ca_abs8(ca_f8 v) { return (ca_f8)((ca_m8)v & ca_m8_all(INT32_MAX)); }
static inline ca_f8 ca_copysign8(ca_f8 v, ca_f8 sign)
{
    return (ca_f8)(((ca_m8)v & ca_m8_all(INT32_MAX)) | ((ca_m8)sign & ca_m8_all(INT32_MIN)));
}
/* As ca_min and ca_max: with a NaN, b. */
static inline ca_f8 ca_min8(ca_f8 a, ca_f8 b)
{
#ifdef __AVX__
    return (ca_f8)_mm256_min_ps((__m256)a, (__m256)b);
#else
    return ca_select8(a < b, a, b);
#endif
}
static inline ca_f8 ca_max8(ca_f8 a, ca_f8 b)
{
#ifdef __AVX__
    return (ca_f8)_mm256_max_ps((__m256)a, (__m256)b);
#else
    return ca_select8(a > b, a, b);
#endif
}
/* a b + c, rounded once. */
static inline ca_f8 ca_fma8(ca_f8 a, ca_f8 b, ca_f8 c)
{
#ifdef __FMA__
    return (ca_f8)_mm256_fmadd_ps((__m256)a, (__m256)b, (__m256)c);
#else
    for (int i = 0; i < CA_LANES; i++) c[i] = fmaf(a[i], b[i], c[i]);
    return c;
#endif
}

static inline ca_v8 ca_v8_all(ca_vec3 v) { return (ca_v8){ca_f8_all(v.x), ca_f8_all(v.y), ca_f8_all(v.z)}; }
static inline ca_v8 ca_select_v8(ca_m8 mask, ca_v8 a, ca_v8 b)
{
    return (ca_v8){ca_select8(mask, a.x, b.x), ca_select8(mask, a.y, b.y), ca_select8(mask, a.z, b.z)};
}
static inline ca_v8 ca_add_v8(ca_v8 a, ca_v8 b) { return (ca_v8){a.x + b.x, a.y + b.y, a.z + b.z}; }
static inline ca_v8 ca_sub_v8(ca_v8 a, ca_v8 b) { return (ca_v8){a.x - b.x, a.y - b.y, a.z - b.z}; }
static inline ca_v8 ca_mul_v8(ca_v8 a, ca_f8 s) { return (ca_v8){a.x * s, a.y * s, a.z * s}; }
static inline ca_v8 ca_neg_v8(ca_v8 a) { return (ca_v8){-a.x, -a.y, -a.z}; }
static inline ca_v8 ca_madd_v8(ca_v8 a, ca_f8 s, ca_v8 b)
{
    return (ca_v8){a.x + s * b.x, a.y + s * b.y, a.z + s * b.z};
}
static inline ca_f8 ca_dot_v8(ca_v8 a, ca_v8 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline ca_v8 ca_cross_v8(ca_v8 a, ca_v8 b)
{
    return (ca_v8){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
static inline ca_v8 ca_abs_v8(ca_v8 a) { return (ca_v8){ca_abs8(a.x), ca_abs8(a.y), ca_abs8(a.z)}; }
static inline ca_v8 ca_max_v8(ca_v8 a, ca_v8 b)
{
    return (ca_v8){ca_max8(a.x, b.x), ca_max8(a.y, b.y), ca_max8(a.z, b.z)};
}
static inline ca_f8 ca_max3_v8(ca_v8 a) { return ca_max8(a.x, ca_max8(a.y, a.z)); }
static inline ca_v8 ca_normalize_v8(ca_v8 a) { return ca_mul_v8(a, 1.0f / ca_sqrt8(ca_dot_v8(a, a))); }
/* As ca_normalize_any, to the bit, but that 0 becomes NAN. */
static inline ca_v8 ca_normalize_any_v8(ca_v8 a)
{
    const ca_f8 length2 = ca_dot_v8(a, a);
    const ca_f8 larger = ca_select8(length2 > FLT_MAX, ca_f8_all(0x1p-100f), ca_f8_all(1.0f));
    return ca_normalize_v8(ca_mul_v8(a, ca_select8(length2 < FLT_MIN, ca_f8_all(0x1p100f), larger)));
}

#endif
