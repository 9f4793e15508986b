/* Bits of nets in base 2: reversal, and Owen's scramble by hashing (Burley 2020, "Practical Hash-based Owen
 * Scrambling", JCGT 9(4)). Internal to this folder.
 *
 * A nested uniform scramble flips each bit of a fraction or not, at random, depending on all bits above it. On
 * reversed words that is a function where each bit depends on the lower ones, which sums and products are. */
#ifndef CA_SAMPLING_OWEN_H
#define CA_SAMPLING_OWEN_H

#include <stdint.h>

static inline uint32_t ca_reverse_bits(uint32_t x)
{
    x = __builtin_bswap32(x);
    x = ((x & 0x0f0f0f0fu) << 4) | ((x >> 4) & 0x0f0f0f0fu);
    x = ((x & 0x33333333u) << 2) | ((x >> 2) & 0x33333333u);
    return ((x & 0x55555555u) << 1) | ((x >> 1) & 0x55555555u);
}

static inline uint64_t ca_reverse_bits64(uint64_t x)
{
    return (uint64_t)ca_reverse_bits((uint32_t)x) << 32 | ca_reverse_bits((uint32_t)(x >> 32));
}

/* The scramble of a reversed word. The constants are those of Vegdahl 2021, "Building a Better LK Hash"
 * (psychopath.io), found by search. */
static inline uint32_t ca_scramble_reversed(uint32_t x, uint32_t seed)
{
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16) | 1u;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return x;
}

#endif
