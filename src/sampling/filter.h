/* Reconstruction filters, for filter importance sampling: a camera sample belongs to one pixel, its position is drawn
 * from the filter around the pixel's centre and carries the weight f / pdf (negative where a filter has negative
 * lobes), so that every pixel's samples are its own and its value is their plain mean.
 * Filters are separable; distances are in pixels. */
#ifndef CA_SAMPLING_FILTER_H
#define CA_SAMPLING_FILTER_H

#include "math/vec.h"

#include <stdint.h>

typedef enum ca_filter_kind {
    CA_RFILTER_BOX,
    CA_RFILTER_TENT,
    CA_RFILTER_GAUSSIAN,
    CA_RFILTER_MITCHELL,
    CA_RFILTER_CATMULL_ROM,
    CA_RFILTER_LANCZOS,
} ca_filter_kind;

enum { CA_FILTER_TABLE = 64, CA_FILTER_GUIDE = 1024 };

typedef struct ca_filter {
    ca_filter_kind kind;
    float radius; /* half width */
    float stddev; /* gaussian */
    float b, c;   /* mitchell */
    float lobes;  /* lanczos */
    /* Sampled offsets are this part of what the filter says: 1, and less where a pixel stands for many smaller ones,
     * of which its samples see one. Set to 1 by ca_filter_prepare. */
    float sampled_part;

    /* Made by ca_filter_prepare: |f| tabulated for sampling. */
    float border;                          /* of a gaussian: what it is lowered by, so that it ends at 0 */
    float integral;                        /* of f over one axis: the normalisation */
    float nodes[CA_FILTER_TABLE + 1];      /* sampling density of an offset, 1/pixel, linear in between: near |f| */
    float cumulative[CA_FILTER_TABLE + 1]; /* its integral from -radius */
    unsigned char guide[CA_FILTER_GUIDE];  /* an interval at or before the one that holds i / CA_FILTER_GUIDE */
} ca_filter;

/* Mitsuba's defaults for each kind. */
ca_filter ca_filter_default(ca_filter_kind kind);
void ca_filter_prepare(ca_filter *filter);

/* Value at a distance along one axis, normalised to an integral of 1. */
float ca_filter_eval(const ca_filter *filter, float x);
/* The same at x, x - 1, ... for the pixels of a row: `count` values, in an array with room for whole groups of eight
 * (math/lanes.h). */
void ca_filter_eval_run(const ca_filter *filter, float x, uint32_t count, float *values);

/* Offset from the pixel's centre and the weight f / pdf, whose mean is 1. */
ca_vec2 ca_filter_sample(const ca_filter *filter, ca_vec2 u, float *weight);

/* The same along one axis for `count` numbers, which become the offsets. The weight of a position is the product of
 * those of its axes. */
void ca_filter_sample_axis(const ca_filter *filter, uint32_t count, float *u, float *weight);

const char *ca_filter_name(ca_filter_kind kind);

#endif
