/* Sampling from tables: piecewise-constant densities over [0, 1) and over the unit square, and choice among n things.
 * All use one number in [0, 1) per dimension by inverting the cumulative sum (a guide table makes that O(1) on
 * average), so stratified numbers stay stratified. Sums are taken in double precision. */
#ifndef CA_SAMPLING_DISTRIBUTION_H
#define CA_SAMPLING_DISTRIBUTION_H

#include "base/status.h"
#include "math/vec.h"

#include <stddef.h>
#include <stdint.h>

typedef struct ca_distribution_1d {
    uint32_t count;
    float *cumulative; /* count + 1, from 0 to 1 */
    uint32_t *guide;   /* count: first bin whose end lies above i/count */
    double sum;        /* of the weights given */
} ca_distribution_1d;

/* From `count` finite weights >= 0 with a positive sum (a zero sum makes all equal). */
ca_status ca_distribution_1d_create(ca_distribution_1d *distribution, const float *weights, uint32_t count,
                                    ca_error *error);
/* Every bin is as likely as its weight says, to the nearest step of the numbers that choose: those of less than half
 * a step may never be drawn. For where the density is known otherwise, as that over a surface is. */
ca_status ca_distribution_1d_create_nearest(ca_distribution_1d *distribution, const float *weights, uint32_t count,
                                            ca_error *error);
void ca_distribution_1d_destroy(ca_distribution_1d *distribution);

/* The bin that holds u. *probability is its probability; *remapped (may be NULL) is where in the bin u lies, itself
 * uniform in [0, 1). */
uint32_t ca_distribution_1d_sample(const ca_distribution_1d *distribution, float u, float *probability,
                                   float *remapped);
float ca_distribution_1d_probability(const ca_distribution_1d *distribution, uint32_t bin);

typedef struct ca_distribution_2d {
    uint32_t width, height;
    ca_distribution_1d rows;     /* which row */
    ca_distribution_1d *columns; /* [height]: where in it; their tables lie side by side: */
    float *cumulative;           /* [height][width + 1] */
    uint32_t *guide;             /* [height][width] */
} ca_distribution_2d;

/* From width * height weights, row by row. */
ca_status ca_distribution_2d_create(ca_distribution_2d *distribution, const float *weights, uint32_t width,
                                    uint32_t height, ca_error *error);
void ca_distribution_2d_destroy(ca_distribution_2d *distribution);
/* The bin that holds u, and where in it u lies, itself uniform in the unit square. */
typedef struct ca_bin_2d {
    uint32_t column, row;
    float probability;
    ca_vec2 inside;
} ca_bin_2d;

ca_bin_2d ca_distribution_2d_sample_bin(const ca_distribution_2d *distribution, ca_vec2 u);
float ca_distribution_2d_bin_probability(const ca_distribution_2d *distribution, uint32_t column, uint32_t row);
/* A point of the unit square (x along rows) and its density. */
ca_vec2 ca_distribution_2d_sample(const ca_distribution_2d *distribution, ca_vec2 u, float *density);
float ca_distribution_2d_density(const ca_distribution_2d *distribution, ca_vec2 point);

#endif
