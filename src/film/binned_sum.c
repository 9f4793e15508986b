#include "film/binned_sum.h"

#include <assert.h>
#include <math.h>

/* 2^exponent of bin 0, in another one. */
static double unit(uint8_t bin, int exponent)
{
    return ca_bits_double(CA_BINNED_EXPONENT(exponent) + bin * CA_BINNED_STEP);
}

static void move_down(const ca_binned_sums *sums, int i, uint8_t bin)
{
    assert(bin < CA_BINNED_SUM_BINS);
    for (; sums->bin[i] < bin; sums->bin[i]++) {
        if (i < sums->with_low) sums->low[i] = sums->middle[i];
        sums->middle[i] = sums->high[i];
        sums->high[i] = 0;
    }
}

void ca_binned_sums_raise(const ca_binned_sums *sums, const double *value)
{
    for (int i = 0; i < sums->count; i++) {
        uint8_t bin = sums->bin[i];
        assert(isfinite(value[i]));
        while (fabs(value[i]) > unit(bin, -401)) bin++;
        move_down(sums, i, bin);
    }
}

/* What `down` bins below its own sum i has in its place-th bin (0: high); 0 where there is none. */
static int64_t bin_below(const ca_binned_sums *sums, int i, int place)
{
    if (place == 0) return sums->high[i];
    if (place == 1) return sums->middle[i];
    return place == 2 && i < sums->with_low ? sums->low[i] : 0;
}

void ca_binned_sums_add_sums(const ca_binned_sums *sums, const ca_binned_sums *other)
{
    assert(sums->count == other->count && sums->with_low == other->with_low);
    for (int i = 0; i < sums->count; i++) {
        if (sums->bin[i] < other->bin[i]) move_down(sums, i, other->bin[i]);
        const int up = sums->bin[i] - other->bin[i]; /* by so many bins the other one's lie lower */
        if (up == 0) sums->high[i] += other->high[i];
        if (up <= 1) sums->middle[i] += bin_below(other, i, 1 - up);
        if (up <= 2 && i < sums->with_low) sums->low[i] += bin_below(other, i, 2 - up);
    }
}

double ca_binned_value(uint8_t bin, int64_t high, int64_t middle, int64_t low)
{
    return (double)high * unit(bin, -440) + ((double)middle * unit(bin, -480) + (double)low * unit(bin, -520));
}
