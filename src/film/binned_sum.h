/* Binned sums: sums of doubles whose bits do not depend on the order or the grouping in which values are added.
 *
 * Bins lie at fixed exponents: bin b counts multiples of the unit 2^(40 b - 440). A sum has two or three of them,
 * one after the other: `high` of bin b, `middle` of bin b - 1, and `low` of bin b - 2 where there is one. A value
 * is split: rounded to a multiple of the highest unit, what is left to one of the next, and so on; what the last
 * one leaves is dropped. Which bins a sum has follows from its largest value alone: b is the smallest bin with
 * |value| <= 2^39 units, so that values of lower bins round to 0 there. Where a larger value comes the bins move
 * down by one: what was `high` is what all values so far would have had as `middle`. So the state is a function of
 * the set of values, and sums of sums are, too. (The idea is that of reproducible summation, with integers.)
 *
 * Each value is kept to 2^-40 of the largest one with two bins, to 2^-80 with three. The largest value is 2^399;
 * all bins hold CA_BINNED_SUM_MOST_VALUES values. Values must be finite.
 *
 * A set of sums lies in arrays, so that four of them are added to at a time: the first `with_low` of `count` sums
 * have three bins. All zero is the sum of nothing. */
#ifndef CA_FILM_BINNED_SUM_H
#define CA_FILM_BINNED_SUM_H

#include "base/little_endian.h"

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

enum { CA_BINNED_SUM_MOST_VALUES = (1 << 24) - 1, CA_BINNED_SUM_BINS = 21 };

typedef struct ca_binned_sums {
    int64_t *high, *middle; /* [count] */
    int64_t *low;           /* [with_low] */
    uint8_t *bin;           /* [count] */
    int count, with_low;
} ca_binned_sums;

/* Adds other sums of the same form, which may have values up to CA_BINNED_SUM_MOST_VALUES together. */
void ca_binned_sums_add_sums(const ca_binned_sums *sums, const ca_binned_sums *other);

/* The value of a sum: a function of its state. */
double ca_binned_value(uint8_t bin, int64_t high, int64_t middle, int64_t low);

/* Makes room for value[i] in the i-th sum, where ca_binned_over says so of any. */
void ca_binned_sums_raise(const ca_binned_sums *sums, const double *value);

/* ---- Adding, in the loop over pixels --------------------------------------------------------------------------- */

typedef double ca_binned_d4 __attribute__((vector_size(32), may_alias));
typedef uint64_t ca_binned_u4 __attribute__((vector_size(32), may_alias));
typedef uint8_t ca_binned_b4 __attribute__((vector_size(4)));

/* The bits of a power of two, and how much more those of the next bin are. */
#define CA_BINNED_EXPONENT(exponent) ((uint64_t)((exponent) + 1023) << 52)
#define CA_BINNED_STEP (UINT64_C(40) << 52)

/* Of bins bin[0..3]: what the exponents of their units are raised by. */
static inline ca_binned_u4 ca_binned_raised(const uint8_t *bin)
{
    ca_binned_b4 bins;
    memcpy(&bins, bin, sizeof bins);
    return __builtin_convertvector(bins, ca_binned_u4) * CA_BINNED_STEP;
}

/* A mask of those values that are over the largest one of their bins, 2^39 units. */
static inline ca_binned_u4 ca_binned_over(ca_binned_d4 value, ca_binned_u4 raised)
{
    const ca_binned_u4 limit = raised + CA_BINNED_EXPONENT(-401), size = (ca_binned_u4)value & ~(UINT64_C(1) << 63);
    return (ca_binned_u4)((ca_binned_d4)size > (ca_binned_d4)limit);
}

static inline bool ca_binned_is_any(ca_binned_u4 mask) { return (mask[0] | mask[1] | mask[2] | mask[3]) != 0; }

/* How many units of 2^exponent, raised, there are in *value, which keeps the rest: next to 1.5 * 2^52 units a double
 * has the units as its last places. */
static inline ca_binned_u4 ca_binned_take(ca_binned_d4 *value, ca_binned_u4 raised, int exponent)
{
    const ca_binned_u4 bits = raised + (CA_BINNED_EXPONENT(exponent + 52) | UINT64_C(1) << 51);
    const ca_binned_d4 sum = *value + (ca_binned_d4)bits;
    *value -= sum - (ca_binned_d4)bits;
    return (ca_binned_u4)sum - bits;
}

static inline ca_binned_u4 ca_binned_load(const int64_t *from)
{
    ca_binned_u4 v;
    memcpy(&v, from, sizeof v);
    return v;
}
static inline void ca_binned_store(int64_t *to, ca_binned_u4 v) { memcpy(to, &v, sizeof v); }

/* Adds to high[0..3] and so on; `low` may be NULL. Nothing is over. */
static inline void ca_binned_add4(int64_t *high, int64_t *middle, int64_t *low, ca_binned_d4 value,
                                  ca_binned_u4 raised)
{
    ca_binned_store(high, ca_binned_load(high) + ca_binned_take(&value, raised, -440));
    ca_binned_store(middle, ca_binned_load(middle) + ca_binned_take(&value, raised, -480));
    if (low) ca_binned_store(low, ca_binned_load(low) + ca_binned_take(&value, raised, -520));
}

#endif
