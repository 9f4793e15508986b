/* What passes add to a pixel, as sums whose bits do not depend on the order or the grouping of the passes: parts of
 * a render add up to the whole (docs/decisions/021).
 *
 * Values, their squares and cubes are binned sums (binned_sum.h): squares in three bins, since the variance is a
 * small difference of large sums; the others in two. Albedos and normals are summed in multiples of 2^-28,
 * positions in those of 2^-28 times the power of two that bounds the scene's coordinates: a sixteenth of what a
 * float of that size resolves. Values over 16 times these bounds, or that are no numbers, add nothing there.
 *
 * State: 296 bytes a pixel, 128 more where replicates are groups of passes. CA_BINNED_SUM_MOST_VALUES passes at
 * most. */
#ifndef CA_FILM_PASS_SUMS_H
#define CA_FILM_PASS_SUMS_H

#include "film/binned_sum.h"

#include <stdbool.h>

/* In the order of the binned sums: the squares have three bins. */
enum { CA_PASS_SQUARES = 0, CA_PASS_VALUES = 4, CA_PASS_CUBES = 7, CA_PASS_SUMS = 11, CA_PASS_FEATURES = 9 };

typedef struct ca_pass_sums {
    int64_t high[CA_PASS_SUMS], middle[CA_PASS_SUMS], low[CA_PASS_VALUES];
    int64_t features[CA_PASS_FEATURES]; /* albedo, normal, position of first hits */
    uint32_t samples;
    uint8_t bin[CA_PASS_SUMS + 1]; /* the last one is not used */
} ca_pass_sums;

/* Where replicates are groups of passes that follow each other. */
typedef struct ca_group_sums {
    double open[3];                     /* of R, G, B, over the samples of the group that is not complete yet */
    int64_t high[4], middle[4], low[4]; /* binned sums of squares of R, G, B, Y of one group's mean */
    uint8_t bin[8];                     /* the last four are not used */
} ca_group_sums;

enum { CA_PASS_SUMS_BYTES = sizeof(ca_pass_sums), CA_GROUP_SUMS_BYTES = sizeof(ca_group_sums) };

/* Adds one sample: R, G, B, Y; the cubes only where each sample is a replicate. */
void ca_pass_sums_add(ca_pass_sums *sums, const double value[4], bool cubes);
/* Of features times these scales, albedo, normal, position. */
void ca_pass_sums_add_features(ca_pass_sums *sums, const float value[CA_PASS_FEATURES], const double scale[3]);
/* Adds a group's mean, which is complete. */
void ca_pass_sums_close_group(ca_pass_sums *sums, ca_group_sums *group, uint32_t samples);

/* Adds the sums of other passes. Of groups: neither has an open one. */
void ca_pass_sums_add_sums(ca_pass_sums *sums, const ca_pass_sums *other);
void ca_group_sums_add_sums(ca_group_sums *sums, const ca_group_sums *other);

/* The i-th of the binned sums. */
double ca_pass_sums_value(const ca_pass_sums *sums, int i);
double ca_group_sums_value(const ca_group_sums *sums, int i);

/* As bytes in files, the same on every machine. Reading trusts nothing: false where no sums look like that. */
void ca_pass_sums_write(const ca_pass_sums *sums, unsigned char bytes[CA_PASS_SUMS_BYTES]);
bool ca_pass_sums_read(ca_pass_sums *sums, const unsigned char bytes[CA_PASS_SUMS_BYTES]);
void ca_group_sums_write(const ca_group_sums *sums, unsigned char bytes[CA_GROUP_SUMS_BYTES]);
bool ca_group_sums_read(ca_group_sums *sums, uint32_t samples, const unsigned char bytes[CA_GROUP_SUMS_BYTES]);

#endif
