/* Generating matrices of the Sobol' sequence, by columns. Internal to this folder. */
#ifndef CA_SAMPLING_SOBOL_TABLE_H
#define CA_SAMPLING_SOBOL_TABLE_H

#include <stdint.h>

/* The table's dimensions (counted from 0), and how many bits of an index it serves. */
enum { CA_SOBOL_DIMENSION_COUNT = 256, CA_SOBOL_INDEX_BITS = 53, CA_SOBOL_COLUMN_COUNT = 64 };

/* columns[zeros + i] is what bit i of the index adds (exclusive or) to the coordinate; bit 30 is worth 1/2. The first
 * `zeros` columns are 0. */
typedef struct ca_sobol_row {
    uint32_t columns[CA_SOBOL_COLUMN_COUNT];
    uint32_t zeros;
} ca_sobol_row;

/* [dimension]. Dimension 0, the radical inverse of the index, is left empty. */
extern const ca_sobol_row ca_sobol_rows[CA_SOBOL_DIMENSION_COUNT];

#endif
