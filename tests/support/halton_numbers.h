/* Addresses of numbers for the tests of the Halton samplers. */
#ifndef CA_TEST_HALTON_NUMBERS_H
#define CA_TEST_HALTON_NUMBERS_H

#include "sampling/primes.h"
#include "sampling/sampler.h"

#define PRIME(p) p,
static const uint32_t halton_primes[] = {CA_PRIMES(PRIME)};

/* The order of decisions in the table of bases, written down again. */
static inline uint32_t halton_dimension(uint32_t row)
{
    return row < 5 ? row : ca_vertex_dimension((row - 5) / 7) + (row - 5) % 7;
}

static inline ca_sampler halton_sampler(ca_sampler_kind kind, uint64_t seed, uint32_t width, uint32_t height)
{
    ca_sampler sampler = {.kind = kind, .seed = seed};
    ca_sampler_prepare(&sampler, width, height);
    return sampler;
}

static inline float light_number(const ca_sampler *sampler, uint64_t index, uint32_t dimension)
{
    const ca_stream stream = ca_stream_start(sampler, CA_SEQUENCE_LIGHT, index);
    return ca_sample_1d(&stream, dimension);
}

static inline float pixel_number(const ca_sampler *sampler, uint64_t pixel, uint64_t index, uint32_t dimension)
{
    const ca_stream stream = ca_stream_start(sampler, pixel, index);
    return ca_sample_1d(&stream, dimension);
}

/* light_number, or of one pixel */
typedef float (*number_function)(const ca_sampler *sampler, uint64_t index, uint32_t dimension);

static inline float pixel_17(const ca_sampler *sampler, uint64_t index, uint32_t dimension)
{
    return pixel_number(sampler, 17, index, dimension);
}

#endif
