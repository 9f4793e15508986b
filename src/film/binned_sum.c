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

/* In loops over the four, which compilers turn into steps for all of them. */
void ca_binned_values4(const int32_t *high, const uint16_t *low, size_t count, int power, const uint8_t scale[4],
                       double values[4])
{
    uint64_t unit[4]; /* bits of the bin's; of the lowest one first */
    double sum[4] = {0.0};
    for (int i = 0; i < 4; i++) {
        const int lowest = ca_binned_highest(power, scale[i]) - (CA_BINNED_BINS - 1);
        unit[i] = CA_BINNED_EXPONENT(CA_BINNED_STEP * lowest - 152 * power - 23);
    }
    for (int bin = CA_BINNED_BINS - 1; bin >= 0; bin--) {
        const int32_t *h = high + (size_t)bin * count;
        const uint16_t *l = low + (size_t)bin * count;
        double units[4];
        memcpy(units, unit, sizeof units);
        for (int i = 0; i < 4; i++) sum[i] += ((double)h[i] * 0x1p16 + l[i]) * units[i];
        for (int i = 0; i < 4; i++) unit[i] += (uint64_t)CA_BINNED_STEP << 52;
    }
    memcpy(values, sum, sizeof sum);
}

void ca_binned_add(int32_t *high, uint16_t *low, const int32_t *more_high, const uint16_t *more_low, size_t bins)
{
    for (size_t i = 0; i < bins; i++) {
        const int32_t sum = low[i] + more_low[i];
        high[i] += more_high[i] + (sum >> 16);
        low[i] = (uint16_t)sum;
    }
}
