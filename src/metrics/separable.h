/* Separable filters, one row of the result at a time: first down the columns of the picture, then along the row. No
 * picture of intermediate values is needed, rows are independent of each other, and a row costs no more than in two
 * passes over the picture. Sums are in double precision and in the order of the kernel's weights.
 *
 * Beyond its border a picture goes on by the rule ca_border. */
#ifndef CA_METRICS_SEPARABLE_H
#define CA_METRICS_SEPARABLE_H

#include <stddef.h>
#include <stdint.h>

typedef enum ca_border {
    CA_BORDER_REPEAT, /* the last pixel again and again: a b c | c c c */
    CA_BORDER_MIRROR, /* the pixels backwards: a b c | c b a */
} ca_border;

typedef struct ca_kernel {
    uint32_t radius;
    const double *weights; /* 2 radius + 1 of them, borrowed; applied as a correlation */
} ca_kernel;

/* A plane of a picture, or the product of two; borrowed. */
typedef struct ca_filter_source {
    const float *plane, *times; /* times NULL: 1 */
    uint32_t width, height;
    ca_border border;
} ca_filter_source;

/* The pixel that stands for number `i`, maybe beyond the border, of `count`. */
uint32_t ca_border_index(ca_border border, int64_t i, uint32_t count);

/* Row `y` of the source filtered down its columns, with `margin` values more on both sides: `filtered` has room for
 * width + 2 margin. */
void ca_filter_columns(const ca_filter_source *source, uint32_t y, const ca_kernel *kernel, uint32_t margin,
                       double *filtered);

/* Filters such a row, made with margin = kernel->radius, along itself: width values. */
void ca_filter_row(const double *filtered, uint32_t width, const ca_kernel *kernel, double *result);

#endif
