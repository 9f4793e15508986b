/* What passes add to a pixel, as sums whose bits do not depend on the order or the grouping of the passes: parts of
 * a render add up to the whole (docs/decisions/021).
 *
 * Values, their squares and cubes are binned sums (binned_sum.h). Albedos and normals are summed in multiples of
 * 2^-22, positions in those of 2^-22 times the power of two that bounds the scene's coordinates. What is not under
 * twice these bounds, or is no number, adds nothing there.
 *
 * State: 260 bytes a pixel, 104 more where replicates are groups of passes; 40 bytes for what a pass adds.
 * CA_BINNED_SUM_MOST_VALUES passes at most. */
#ifndef CA_FILM_PASS_SUMS_H
#define CA_FILM_PASS_SUMS_H

#include "film/binned_sum.h"

/* In the order of the binned sums. */
enum { CA_PASS_SQUARES = 0, CA_PASS_VALUES = 4, CA_PASS_CUBES = 7, CA_PASS_SUMS = 11, CA_PASS_FEATURES = 9 };

typedef struct ca_pass_sums {
    int32_t high[CA_BINNED_BINS * CA_PASS_SUMS];
    int32_t feature_high[CA_PASS_FEATURES]; /* albedo, normal, position of first hits: 2^16 high + low */
    uint32_t samples;
    uint16_t low[CA_BINNED_BINS * CA_PASS_SUMS];
    uint16_t feature_low[CA_PASS_FEATURES];
    uint8_t scale[4]; /* of R, G, B, Y; of the cubes only where each sample is a replicate */
} ca_pass_sums;

/* Where replicates are groups of passes that follow each other. */
typedef struct ca_group_sums {
    double open[3];                  /* of R, G, B, over the samples of the group that is not complete yet */
    int32_t high[CA_BINNED_BINS * 4]; /* binned sums of squares of R, G, B, Y of one group's mean */
    uint16_t low[CA_BINNED_BINS * 4];
    uint8_t scale[4]; /* of these means, also for the cubes */
} ca_group_sums;

/* What one pass adds to a pixel. All zero: a sample of nothing. */
typedef struct ca_pass_addend {
    float value[3]; /* R, G, B */
    uint16_t feature_low[CA_PASS_FEATURES];
    int8_t feature_high[CA_PASS_FEATURES];
} ca_pass_addend;

/* Features times these scales, albedo, normal, position, to whole units. */
void ca_pass_addend_set_features(ca_pass_addend *addend, const float value[CA_PASS_FEATURES], const float scale[3]);

/* The luminance of a value or of a sum, in double precision: rounding one of them would be seen as variance. */
static inline double ca_pass_luminance(double r, double g, double b) { return 0.2126 * r + 0.7152 * g + 0.0722 * b; }

/* Adds R, G, B, Y; the cubes only where each sample is a replicate. */
void ca_pass_sums_add(ca_pass_sums *sums, const double value[4], bool cubes);
/* Adds a sample to each of so many pixels. */
void ca_pass_sums_add_row(ca_pass_sums *sums, const ca_pass_addend *addends, size_t count, bool cubes);
/* Adds a group's mean, which is complete. */
void ca_pass_sums_close_group(ca_pass_sums *sums, ca_group_sums *group, uint32_t samples);

/* Adds the sums of other passes. Groups are NULL where there are none; neither has an open one. */
void ca_pass_sums_add_sums(ca_pass_sums *sums, ca_group_sums *group, const ca_pass_sums *other,
                           const ca_group_sums *other_group);

/* All binned sums; `group` is NULL where there is none. Those of a group are of squares of means. */
void ca_pass_sums_values(const ca_pass_sums *sums, const ca_group_sums *group, double values[CA_PASS_SUMS]);
void ca_group_sums_values(const ca_group_sums *sums, double values[4]);
/* Of the i-th feature, in units. */
double ca_pass_sums_feature(const ca_pass_sums *sums, int i);

/* As bytes in files, the same on every machine. Reading trusts nothing: false where no sums look like that. */
enum { CA_PASS_SUMS_BYTES = 260, CA_GROUP_SUMS_BYTES = 100 };
void ca_pass_sums_write(const ca_pass_sums *sums, unsigned char bytes[CA_PASS_SUMS_BYTES]);
bool ca_pass_sums_read(ca_pass_sums *sums, const unsigned char bytes[CA_PASS_SUMS_BYTES]);
void ca_group_sums_write(const ca_group_sums *sums, unsigned char bytes[CA_GROUP_SUMS_BYTES]);
bool ca_group_sums_read(ca_group_sums *sums, uint32_t samples, const unsigned char bytes[CA_GROUP_SUMS_BYTES]);

#endif
