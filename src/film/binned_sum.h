/* Binned sums: sums of doubles, and of their squares and cubes, whose bits do not depend on the order or the grouping
 * in which values are added.
 *
 * Bins lie at fixed exponents, 24 apart. A sum has three of them, one below the other, and each counts whole
 * multiples of its unit. A term is split: rounded to a multiple of the highest unit, what is left to one of the next,
 * and so on; what the last one leaves is dropped. Which bins a sum has follows from the largest value alone: the
 * *scale* s of values up to 2^(4 s - 152) is the smallest one that holds them, and their p-th powers have the highest
 * bin b = ceil(p s / 6), of unit 2^(24 b - 152 p - 23): so no term is larger than 2^23 units, and terms of values of
 * smaller scales that have a lower bin round to 0 in this one. Where a larger value comes the bins move down: what
 * was the highest one is what all values so far would have had as the one below. So the state is a function of the
 * set of values, and sums of sums are, too. (The idea is that of reproducible summation, with integers.)
 *
 * Each term is kept to 2^-47 of the largest one. Floats of one size are summed without any error, and so are their
 * squares. The largest value is 2^128; all bins hold CA_BINNED_SUM_MOST_VALUES terms. Values must be finite.
 *
 * A bin is a number of 48 bits, 2^16 high + low, in two arrays, so that eight sums are added to at a time. All zero
 * is the sum of nothing. */
#ifndef CA_FILM_BINNED_SUM_H
#define CA_FILM_BINNED_SUM_H

#include "base/little_endian.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

enum {
    CA_BINNED_BINS = 3,
    CA_BINNED_STEP = 24, /* of the exponents of bins */
    CA_BINNED_SCALES = 71,
    CA_BINNED_MOST_UNITS = 1 << 23, /* of one term */
    CA_BINNED_SUM_MOST_VALUES = (1 << 24) - 1,
};

/* Which bin is the highest one of the p-th powers of values of this scale. */
static inline int ca_binned_highest(int power, uint8_t scale) { return (power * scale + 5) / 6; }

/* The smallest scale, not below this one, that holds the value. */
uint8_t ca_binned_scale_of(uint8_t scale, double value);

/* Of a sum of p-th powers, one of `count` that lie together: its highest bin is high[0] and low[0], the next one
 * high[count] and low[count], and so on. Moves the bins down, from one scale to a larger one. */
void ca_binned_move(int32_t *high, uint16_t *low, size_t count, int power, uint8_t from, uint8_t to);

/* The values of four sums that lie next to each other, of `count`: a function of their state. */
void ca_binned_values4(const int32_t *high, const uint16_t *low, size_t count, int power, const uint8_t scale[4],
                       double values[4]);

/* Adds so many bins to others of the same units, which may have CA_BINNED_SUM_MOST_VALUES terms together. */
void ca_binned_add(int32_t *high, uint16_t *low, const int32_t *more_high, const uint16_t *more_low, size_t bins);

/* ---- Adding, in the loop over pixels --------------------------------------------------------------------------- */

typedef double ca_binned_d4 __attribute__((vector_size(32), may_alias));
typedef uint64_t ca_binned_u4 __attribute__((vector_size(32), may_alias));
typedef float ca_binned_f8 __attribute__((vector_size(32), may_alias));
typedef int64_t ca_binned_l4 __attribute__((vector_size(32)));
typedef int32_t ca_binned_i8 __attribute__((vector_size(32), may_alias));
typedef int32_t ca_binned_i4 __attribute__((vector_size(16)));
typedef uint16_t ca_binned_h16 __attribute__((vector_size(32)));
typedef uint16_t ca_binned_h8 __attribute__((vector_size(16)));
typedef uint16_t ca_binned_h4 __attribute__((vector_size(8)));
typedef uint8_t ca_binned_b4 __attribute__((vector_size(4)));

/* The bits of a power of two. */
#define CA_BINNED_EXPONENT(exponent) ((uint64_t)((exponent) + 1023) << 52)

static inline ca_binned_i4 ca_binned_scales(const uint8_t scale[4])
{
    ca_binned_b4 scales;
    memcpy(&scales, scale, sizeof scales);
    return __builtin_convertvector(scales, ca_binned_i4);
}

/* Numbers in the places of the exponents of doubles. */
static inline ca_binned_u4 ca_binned_exponents(ca_binned_i4 exponents)
{
    const ca_binned_l4 wide = __builtin_convertvector(exponents, ca_binned_l4);
    return (ca_binned_u4)wide << 52;
}

/* Is one of the values over the largest one of its scale? */
static inline bool ca_binned_is_over(ca_binned_d4 value, ca_binned_i4 scales)
{
    const ca_binned_u4 limit = ca_binned_exponents(4 * scales + (1023 - 152));
    const ca_binned_u4 size = (ca_binned_u4)value & ~(UINT64_C(1) << 63);
    const ca_binned_u4 over = (ca_binned_u4)((ca_binned_d4)size > (ca_binned_d4)limit);
    return (over[0] | over[1] | over[2] | over[3]) != 0;
}

/* The bits of 1.5 * 2^52 units of the highest bins of p-th powers: next to that a double has the units as its last
 * places. (171 x >> 10 is x / 6 for all x <= 3 * 70 + 5.) */
static inline ca_binned_u4 ca_binned_units(ca_binned_i4 scales, int power)
{
    const ca_binned_i4 bin = (scales * (171 * power) + 171 * 5) >> 10;
    return ca_binned_exponents(bin * CA_BINNED_STEP + (1023 + 52 - 23 - 152 * power)) | UINT64_C(1) << 51;
}

/* The lower halves of the bits of each: in pairs first, as floats, which machines do in one step. */
static inline ca_binned_i8 ca_binned_last_places(ca_binned_d4 first, ca_binned_d4 second)
{
    enum { HALF = __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__ ? 0 : 1 };
    const ca_binned_f8 pairs =
        __builtin_shufflevector((ca_binned_f8)first, (ca_binned_f8)second, 0 + HALF, 2 + HALF, 8 + HALF, 10 + HALF,
                                4 + HALF, 6 + HALF, 12 + HALF, 14 + HALF);
    const ca_binned_u4 quads = __builtin_shufflevector((ca_binned_u4)pairs, (ca_binned_u4)pairs, 0, 2, 1, 3);
    return (ca_binned_i8)quads;
}

/* Four or eight bins. */
static inline ca_binned_i8 ca_binned_load8(const uint16_t *low)
{
    ca_binned_h8 l;
    memcpy(&l, low, sizeof l);
    return __builtin_convertvector(l, ca_binned_i8);
}

static inline ca_binned_i4 ca_binned_load4(const uint16_t *low)
{
    ca_binned_h4 l;
    memcpy(&l, low, sizeof l);
    return __builtin_convertvector(l, ca_binned_i4);
}

/* What was added to the lower halves carries into the upper ones. */
static inline void ca_binned_store8(int32_t *high, uint16_t *low, ca_binned_i8 h, ca_binned_i8 sum)
{
    const ca_binned_h8 l = __builtin_convertvector(sum, ca_binned_h8);
    h += sum >> 16;
    memcpy(high, &h, sizeof h);
    memcpy(low, &l, sizeof l);
}

static inline void ca_binned_store4(int32_t *high, uint16_t *low, ca_binned_i4 h, ca_binned_i4 sum)
{
    const ca_binned_h4 l = __builtin_convertvector(sum, ca_binned_h4);
    h += sum >> 16;
    memcpy(high, &h, sizeof h);
    memcpy(low, &l, sizeof l);
}

/* Terms that are split, and the units of the bin that is next. */
typedef struct ca_binned_terms {
    ca_binned_d4 rest;
    ca_binned_u4 units;
} ca_binned_terms;

/* How many units there are in the rest, as the last places of what is returned. */
static inline ca_binned_d4 ca_binned_take(ca_binned_terms *terms)
{
    const ca_binned_d4 sum = terms->rest + (ca_binned_d4)terms->units;
    terms->rest -= sum - (ca_binned_d4)terms->units;
    terms->units -= (uint64_t)CA_BINNED_STEP << 52;
    return sum;
}

/* Adds to eight of `count` sums whose first bins these are, and to the four from `at` on. None of the terms is over.
 * Where both add to a sum the first of its terms is 0. */
static inline void ca_binned_add12(int32_t *high, uint16_t *low, size_t count, ca_binned_terms first,
                                   ca_binned_terms second, size_t at, ca_binned_terms third)
{
    for (size_t bin = 0; bin < CA_BINNED_BINS; bin++, high += count, low += count) {
        ca_binned_i8 h;
        ca_binned_i4 g;
        const ca_binned_i8 l = ca_binned_load8(low);
        const ca_binned_i4 k = ca_binned_load4(low + at);
        memcpy(&h, high, sizeof h);
        memcpy(&g, high + at, sizeof g);
        const ca_binned_d4 x = ca_binned_take(&first), y = ca_binned_take(&second), z = ca_binned_take(&third);
        const ca_binned_i8 places = ca_binned_last_places(z, z);
        ca_binned_store8(high, low, h, l + ca_binned_last_places(x, y));
        ca_binned_store4(high + at, low + at, g, k + __builtin_shufflevector(places, places, 0, 1, 2, 3));
    }
}

/* To four. */
static inline void ca_binned_add4(int32_t *high, uint16_t *low, size_t count, ca_binned_terms terms)
{
    for (size_t bin = 0; bin < CA_BINNED_BINS; bin++, high += count, low += count) {
        const ca_binned_d4 x = ca_binned_take(&terms);
        const ca_binned_i8 places = ca_binned_last_places(x, x);
        ca_binned_i4 h;
        memcpy(&h, high, sizeof h);
        ca_binned_store4(high, low, h, ca_binned_load4(low) + __builtin_shufflevector(places, places, 0, 1, 2, 3));
    }
}

#endif
