/* Sums of floats without any rounding: the order in which values and sums are added does not matter, to the bit.
 *
 * A fixed-point number as wide as all floats together: bit 0 is worth 2^-149, the smallest float; the largest one
 * ends at bit 276. Two's complement, so the 43 bits above hold the sign and room for 2^42 values of the largest size.
 * Integer additions only.
 *
 * State: 40 bytes. Cost: some 2 ns a value. */
#ifndef CA_FILM_EXACT_SUM_H
#define CA_FILM_EXACT_SUM_H

#include <stdint.h>

enum { CA_EXACT_SUM_WORDS = 5, CA_EXACT_SUM_BYTES = 8 * CA_EXACT_SUM_WORDS };

/* All zero is the sum of nothing. */
typedef struct ca_exact_sum {
    uint64_t words[CA_EXACT_SUM_WORDS]; /* the lowest first */
} ca_exact_sum;

/* Adds a finite value. */
void ca_exact_sum_add(ca_exact_sum *sum, float value);

void ca_exact_sum_add_sum(ca_exact_sum *sum, const ca_exact_sum *other);

/* The double nearest to the sum, of two equally near the even one. */
double ca_exact_sum_value(const ca_exact_sum *sum);

/* As bytes in files, the same on every machine. */
void ca_exact_sum_write(const ca_exact_sum *sum, unsigned char bytes[CA_EXACT_SUM_BYTES]);
ca_exact_sum ca_exact_sum_read(const unsigned char bytes[CA_EXACT_SUM_BYTES]);

#endif
