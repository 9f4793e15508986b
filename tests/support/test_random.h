/* A small seeded generator for tests: PCG XSH-RR, 64 bits of state, 32 bits out (O'Neill 2014, "PCG: A Family of
 * Simple Fast Space-Efficient Statistically Good Algorithms for Random Number Generation"). Independent of the
 * samplers under test. One per thread. */
#ifndef CA_TEST_RANDOM_H
#define CA_TEST_RANDOM_H

#include <stdint.h>

typedef struct ca_test_random {
    uint64_t state;
} ca_test_random;

static inline uint32_t ca_test_random_u32(ca_test_random *random)
{
    const uint64_t old = random->state;
    random->state = old * 6364136223846793005u + 1442695040888963407u;
    const uint32_t shifted = (uint32_t)(((old >> 18) ^ old) >> 27);
    const uint32_t turn = (uint32_t)(old >> 59);
    return (shifted >> turn) | (shifted << ((32u - turn) & 31u));
}

static inline ca_test_random ca_test_random_seed(uint64_t seed)
{
    ca_test_random random = {seed * 0x9e3779b97f4a7c15u + 0x853c49e6748fea9bu};
    ca_test_random_u32(&random);
    return random;
}

/* Uniform in [0, 1). */
static inline float ca_test_random_float(ca_test_random *random)
{
    return (float)(ca_test_random_u32(random) >> 8) * 0x1p-24f;
}

/* Uniform in (0, 1). */
static inline double ca_test_random_open(ca_test_random *random)
{
    return ((double)ca_test_random_u32(random) + 0.5) * 0x1p-32;
}

#endif
