/* Binned sums: sums of doubles whose bits do not depend on the order or the grouping in which values are added.
 *
 * Bins lie at fixed exponents: bin b counts multiples of the unit 2^(40 b - 440). A sum has two or three of them, one
 * after the other: `high` of bin b, `middle` of bin b - 1, and `low` of bin b - 2 where there is one. A value is split:
 * rounded to a multiple of the highest unit, what is left to one of the next, and so on; what the last one leaves is
 * dropped. Which bins a sum has follows from its largest value alone: b is the smallest bin with |value| <= 2^39
 * units, so that values of lower bins round to 0 there. Where a larger value comes the bins move down by one: what
 * was `high` is what all values so far would have had as `middle`. So the state is a function of the set of values,
 * and sums of sums are, too. (The idea is that of reproducible summation, with integers.)
 *
 * Each value is kept to 2^-40 of the largest one with two bins, to 2^-80 with three. The largest value is 2^399; all
 * bins hold CA_BINNED_SUM_MOST_VALUES values. Values must be finite.
 *
 * A set of sums lies in arrays, so that the compiler can take several at a time: the first `with_low` of `count`
 * sums have three bins. All zero is the sum of nothing. */
#ifndef CA_FILM_BINNED_SUM_H
#define CA_FILM_BINNED_SUM_H

#include "base/little_endian.h"

#include <math.h>
#include <stdint.h>

enum { CA_BINNED_SUM_MOST_VALUES = (1 << 24) - 1, CA_BINNED_SUM_BINS = 21 };

typedef struct ca_binned_sums {
    int64_t *high, *middle; /* [count] */
    int64_t *low;           /* [with_low] */
    uint8_t *bin;           /* [count] */
    int count, with_low;
} ca_binned_sums;

/* Adds value[i] to the i-th sum. */
static inline void ca_binned_sums_add(const ca_binned_sums *sums, const double *value);

/* Adds other sums of the same form, which may have values up to CA_BINNED_SUM_MOST_VALUES together. */
void ca_binned_sums_add_sums(const ca_binned_sums *sums, const ca_binned_sums *other);

/* The i-th sum: a function of its state. */
double ca_binned_sums_value(const ca_binned_sums *sums, int i);

/* Makes room for a larger value. */
void ca_binned_sums_raise(const ca_binned_sums *sums, const double *value);

/* ---- Adding, in the loop over pixels --------------------------------------------------------------------------- */

/* Powers of two by their exponents: a bin is 40 of them. */
#define CA_BINNED_SUM_EXPONENT(exponent, bin) ((uint64_t)((exponent) + 1023 + 40 * (int)(bin)) << 52)

/* The largest value of a bin, 2^39 of its units. */
static inline double ca_binned_sum_limit(uint8_t bin)
{
    return ca_bits_double(CA_BINNED_SUM_EXPONENT(-401, bin));
}

/* How many units of 2^(40 bin + exponent) there are in *value, which keeps the rest: next to 1.5 * 2^52 units a double
 * has the units as its last places. */
static inline int64_t ca_binned_sum_take(double *value, uint8_t bin, int exponent)
{
    const uint64_t bits = CA_BINNED_SUM_EXPONENT(exponent + 52, bin) | (UINT64_C(1) << 51);
    const double large = ca_bits_double(bits), sum = *value + large;
    *value -= sum - large;
    return (int64_t)(ca_double_bits(sum) - bits);
}

static inline void ca_binned_sums_add(const ca_binned_sums *sums, const double *value)
{
    int64_t *restrict high = sums->high, *restrict middle = sums->middle, *restrict low = sums->low;
    const uint8_t *restrict bin = sums->bin;
    int over = 0;
    for (int i = 0; i < sums->count; i++) over |= fabs(value[i]) > ca_binned_sum_limit(bin[i]);
    if (over) ca_binned_sums_raise(sums, value);
    for (int i = 0; i < sums->with_low; i++) {
        double rest = value[i];
        high[i] += ca_binned_sum_take(&rest, bin[i], -440);
        middle[i] += ca_binned_sum_take(&rest, bin[i], -480);
        low[i] += ca_binned_sum_take(&rest, bin[i], -520);
    }
    for (int i = sums->with_low; i < sums->count; i++) {
        double rest = value[i];
        high[i] += ca_binned_sum_take(&rest, bin[i], -440);
        middle[i] += ca_binned_sum_take(&rest, bin[i], -480);
    }
}

#endif
