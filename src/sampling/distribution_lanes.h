/* Eight lanes of ca_distribution_2d_sample and ca_distribution_2d_density, the same operations in the same order.
 * Numbers in [0, 1) in all lanes; of points that are no numbers the density is that of some bin. */
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

static inline void ca_distribution_2d_sample8(const ca_distribution_2d *distribution, ca_f8 *x, ca_f8 *y)
{
    const int32_t width = (int32_t)distribution->width;
    const ca_f8 end = ca_f8_all(CA_ONE_MINUS_EPSILON);
    ca_f8 inside_x, inside_y;
    const ca_m8 row = ca_distribution_bins8(distribution->rows.cumulative, ca_m8_all(0), distribution->rows.guide,
                                            ca_m8_all(0), distribution->height, *y, &inside_y);
    const ca_m8 column = ca_distribution_bins8(distribution->cumulative, row * (width + 1), distribution->guide,
                                               row * width, distribution->width, *x, &inside_x);
    const ca_f8 column_f = __builtin_convertvector(column, ca_f8), row_f = __builtin_convertvector(row, ca_f8);
    *x = ca_min8((column_f + inside_x) / (float)distribution->width, end);
    *y = ca_min8((row_f + inside_y) / (float)distribution->height, end);
}

static inline ca_m8 ca_distribution_bin_of8(ca_f8 position, uint32_t count)
{
    const ca_f8 scaled = ca_max8(position * (float)count, ca_f8_all(0.0f));
    return __builtin_convertvector(ca_min8(scaled, ca_f8_all((float)(count - 1))), ca_m8);
}

static inline ca_f8 ca_distribution_2d_density8(const ca_distribution_2d *distribution, ca_f8 x, ca_f8 y)
{
    const ca_m8 row = ca_distribution_bin_of8(y, distribution->height);
    const ca_m8 column = row * (int32_t)(distribution->width + 1) + ca_distribution_bin_of8(x, distribution->width);
    const float *rows = distribution->rows.cumulative, *columns = distribution->cumulative;
    const ca_f8 of_row = ca_gather8(rows, row + 1) - ca_gather8(rows, row);
    const ca_f8 of_column = ca_gather8(columns, column + 1) - ca_gather8(columns, column);
    return of_row * (float)distribution->height * (of_column * (float)distribution->width);
}

#endif
