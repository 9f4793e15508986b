/* Eight lanes of ca_distribution_2d_sample_bin and ca_distribution_2d_bin_probability, the same operations in the
 * same order. Numbers in [0, 1) in all lanes. */
#ifndef CA_SAMPLING_DISTRIBUTION_LANES_H
#define CA_SAMPLING_DISTRIBUTION_LANES_H

#include "math/lanes.h"
#include "math/numeric.h"
#include "sampling/distribution.h"

/* The bins of `count` that hold u, and where in them it lies. In each lane the table begins at a place of its own. */
static inline ca_m8 ca_distribution_bins8(const float *cumulative, ca_m8 first, const uint32_t *guide,
                                          ca_m8 first_guide, uint32_t count, ca_f8 u, ca_f8 *inside)
{
    const ca_f8 last_slot = ca_f8_all((float)(count - 1));
    const ca_m8 slot = __builtin_convertvector(ca_min8(u * (float)count, last_slot), ca_m8);
    ca_m8 bin = ca_gather8_u32(guide, first_guide + slot);
    ca_f8 low = ca_gather8(cumulative, first + bin);
    for (ca_m8 over = low > u; ca_mask_bits(over); over = low > u) {
        bin += over;
        low = ca_gather8(cumulative, first + bin);
    }
    ca_f8 high = ca_gather8(cumulative, first + bin + 1);
    for (ca_m8 under = high <= u; ca_mask_bits(under); under = high <= u) {
        bin -= under;
        low = ca_select8(under, high, low);
        high = ca_gather8(cumulative, first + bin + 1);
    }
    *inside = ca_min8((u - low) / (high - low), ca_f8_all(CA_ONE_MINUS_EPSILON));
    return bin;
}

typedef struct ca_bins_2d8 {
    ca_m8 column, row;
    ca_f8 inside_x, inside_y;
} ca_bins_2d8;

static inline ca_bins_2d8 ca_distribution_2d_sample_bins8(const ca_distribution_2d *distribution, ca_f8 x, ca_f8 y)
{
    const int32_t width = (int32_t)distribution->width;
    ca_bins_2d8 bins;
    bins.row = ca_distribution_bins8(distribution->rows.cumulative, ca_m8_all(0), distribution->rows.guide,
                                     ca_m8_all(0), distribution->height, y, &bins.inside_y);
    bins.column = ca_distribution_bins8(distribution->cumulative, bins.row * (width + 1), distribution->guide,
                                        bins.row * width, distribution->width, x, &bins.inside_x);
    return bins;
}

static inline ca_f8 ca_distribution_2d_bin_probability8(const ca_distribution_2d *distribution, ca_m8 column,
                                                        ca_m8 row)
{
    const ca_m8 place = row * (int32_t)(distribution->width + 1) + column;
    const float *rows = distribution->rows.cumulative, *columns = distribution->cumulative;
    return (ca_gather8(rows, row + 1) - ca_gather8(rows, row)) *
           (ca_gather8(columns, place + 1) - ca_gather8(columns, place));
}

#endif
