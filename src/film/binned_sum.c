#include "film/binned_sum.h"

#include <assert.h>
#include <math.h>

uint8_t ca_binned_scale_of(uint8_t scale, double value)
{
    int exponent;
    assert(isfinite(value));
    const double fraction = frexp(fabs(value), &exponent);
    if (fraction == 0.0) return scale;
    if (fraction == 0.5) exponent--; /* |value| <= 2^exponent */
    const int needed = exponent <= -152 ? 0 : (exponent + 152 + 3) / 4;
    assert(needed < CA_BINNED_SCALES);
    return needed > scale ? (uint8_t)needed : scale;
}

void ca_binned_move(int32_t *high, uint16_t *low, size_t count, int power, uint8_t from, uint8_t to)
{
    const int steps = ca_binned_highest(power, to) - ca_binned_highest(power, from);
    assert(steps >= 0);
    for (int bin = CA_BINNED_BINS - 1; bin >= 0 && steps > 0; bin--) {
        const size_t at = (size_t)bin * count, from_bin = (size_t)(bin - steps) * count;
        high[at] = bin < steps ? 0 : high[from_bin];
        low[at] = bin < steps ? 0 : low[from_bin];
    }
}

void ca_binned_add(int32_t *high, uint16_t *low, const int32_t *more_high, const uint16_t *more_low, size_t bins)
{
    for (size_t i = 0; i < bins; i++) {
        const int32_t sum = low[i] + more_low[i];
        high[i] += more_high[i] + (sum >> 16);
        low[i] = (uint16_t)sum;
    }
}

double ca_binned_value(const int32_t *high, const uint16_t *low, size_t count, int power, uint8_t scale)
{
    const int highest = CA_BINNED_STEP * ca_binned_highest(power, scale) - 152 * power - 23;
    double value = 0.0;
    for (int bin = CA_BINNED_BINS - 1; bin >= 0; bin--) {
        const size_t at = (size_t)bin * count;
        const double unit = ca_bits_double(CA_BINNED_EXPONENT(highest - CA_BINNED_STEP * bin));
        value += ((double)high[at] * 0x1p16 + low[at]) * unit;
    }
    return value;
}
