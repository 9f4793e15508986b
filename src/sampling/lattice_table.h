/* The generating vector of the rank-1 lattice, for lattice.c. */
#ifndef CA_SAMPLING_LATTICE_TABLE_H
#define CA_SAMPLING_LATTICE_TABLE_H

#include <stdint.h>

/* Dimensions of the start and of 30 vertices. */
enum { CA_LATTICE_DIMENSIONS = 248 };

/* Bits 0 to 19 of each component; odd. They are all that the first 2^20 points see. */
extern const uint32_t ca_lattice_published[CA_LATTICE_DIMENSIONS];

/* Bits 20 to 51. */
extern const uint32_t ca_lattice_upper[CA_LATTICE_DIMENSIONS];

#endif
