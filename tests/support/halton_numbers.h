/* Addresses of numbers for the tests of the Halton samplers. */
#ifndef CA_TEST_HALTON_NUMBERS_H
#define CA_TEST_HALTON_NUMBERS_H

#include "sampling/primes.h"
#include "support/sampler_numbers.h"

#define PRIME(p) p,
static const uint32_t halton_primes[] = {CA_PRIMES(PRIME)};

/* The order of decisions in the table of bases, written down again. */
static inline uint32_t halton_dimension(uint32_t row)
{
    return row < 5 ? row : ca_vertex_dimension((row - 5) / 7) + (row - 5) % 7;
}

static inline float light_number(const ca_sampler *sampler, uint64_t index, uint32_t dimension)
{
    return number_of(sampler, CA_SEQUENCE_LIGHT, index, dimension);
}

/* light_number, or of one pixel */
typedef float (*number_function)(const ca_sampler *sampler, uint64_t index, uint32_t dimension);

static inline float pixel_17(const ca_sampler *sampler, uint64_t index, uint32_t dimension)
{
    return number_of(sampler, 17, index, dimension);
}

#endif
