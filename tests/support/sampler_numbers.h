/* Samplers that are ready, and single numbers of them by their address. */
#ifndef CA_TEST_SAMPLER_NUMBERS_H
#define CA_TEST_SAMPLER_NUMBERS_H

#include "sampling/sampler.h"

static inline ca_sampler sampler_of(ca_sampler_kind kind, uint64_t seed, uint32_t width, uint32_t height)
{
    ca_sampler sampler = {.kind = kind, .seed = seed};
    ca_sampler_prepare(&sampler, width, height);
    return sampler;
}

static inline float number_of(const ca_sampler *sampler, uint64_t sequence, uint64_t index, uint32_t dimension)
{
    const ca_stream stream = ca_stream_start(sampler, sequence, index);
    return ca_sample_1d(&stream, dimension);
}

#endif
