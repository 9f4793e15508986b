/* Kind zsobol: sobol with its samples spread over neighbouring pixels, so that their errors differ: what is left of
 * them after some blur (of the eye, or a filter) is less than that of independent errors, and they look like blue
 * noise.
 *
 * Ahmed and Wonka 2020, "Screen-Space Blue-Noise Diffusion of Monte Carlo Sampling Error via Hierarchical Ordering of
 * Pixels" (ACM TOG 39(6)): pixels are ordered along a Z curve, the four quadrants of each of its squares in a random
 * order, and get consecutive stretches of one Sobol' sequence, so that squares of pixels have nets together. A
 * stretch has its length, but here samples may be added at any time; so the place on the curve does not select a
 * stretch. Each pixel has the points of the first two Sobol' dimensions from the start, digitally shifted (exclusive
 * or) by a vector that depends linearly on its place. All is then Owen-scrambled, the same in all pixels, which keeps
 * nets. A pixel alone therefore has a scrambled (0, 2)-sequence, which converges as sobol does.
 *
 * The shifts are such that any 2^e samples (from a multiple of 2^e on) of the pixels of any square of the curve are a
 * (0, m, 2)-net together. Over the field of two elements, let bits k_c of the index and d_b of the place (lowest
 * first) be
 *
 *     g(z) = sum k_c z^c + sum (d_2j + d_(2j+1) z) / q(z)^(j+1),   q(z) = z^2 + z + 1,
 *
 * and the digits of x and y be the coefficients of its power series around z = 0 and z = 1. For a pixel alone these
 * are the first two Sobol' dimensions. The samples of a square of 4^j pixels are all g = h / q^j with h of degree
 * below e + 2 j. If the first a digits of x and b of y are 0, then h is a multiple of z^a (z + 1)^b, as q is 1 at 0
 * and 1; where a + b = e + 2 j, h is 0. So each elementary interval of that size has one point.
 *
 * Pairs of dimensions are independent of each other: each orders samples and pixels in its own way. So are tiles of
 * 256 x 256 pixels. Light paths have no neighbours: their sequence is that of kind sobol. */
#include "sampling/zsobol.h"

#include "sampling/owen.h"
#include "sampling/sampler_kinds.h"

enum { TILE_BITS = 8, PLACE_BITS = 2 * TILE_BITS };

/* What bit 15 - i of the place adds: [coordinate][i], reversed fractions. Bit n is the coefficient of z^n in 1 /
 * q^(j+1) or z / q^(j+1) for the bits 2 j and 2 j + 1; of w^n, w = z + 1, for the second coordinate. */
static const uint32_t directions[2][16] = {
    {0x02000202, 0x01000101, 0x0e000e0e, 0x07000707, 0x2a002a2a, 0x15001515, 0xd600d6d6, 0x6b006b6b,
     0x22022022, 0x11011011, 0xee0ee0ee, 0x77077077, 0x8a28a28a, 0x45145145, 0xb6db6db6, 0xdb6db6db},
    {0x03000303, 0x01000101, 0x09000909, 0x07000707, 0x3f003f3f, 0x15001515, 0xbd00bdbd, 0x6b006b6b,
     0x33033033, 0x11011011, 0x99099099, 0x77077077, 0xcf3cf3cf, 0x45145145, 0x6db6db6d, 0xdb6db6db},
};

/* Pascal's triangle modulo 2 times the bits of the index: the second dimension, reversed. */
static inline uint32_t pascal(uint32_t x)
{
    x ^= (x >> 1) & 0x55555555u;
    x ^= (x >> 2) & 0x33333333u;
    x ^= (x >> 4) & 0x0f0f0f0fu;
    x ^= (x >> 8) & 0x00ff00ffu;
    return x ^ (x >> 16);
}

/* Bits 0 to 7 go to the even places. */
static inline uint32_t spread(uint32_t x)
{
    x = (x | x << 4) & 0x0f0fu;
    x = (x | x << 2) & 0x3333u;
    return (x | x << 1) & 0x5555u;
}

ca_stream ca_zsobol_start(const ca_sampler *sampler, uint64_t sequence, uint64_t index)
{
    if (sequence == CA_SEQUENCE_LIGHT) {
        ca_stream stream = ca_sobol_start(sampler, sequence, index);
        stream.kind = CA_SAMPLER_SOBOL;
        return stream;
    }
    const uint64_t x = sequence % sampler->width, y = sequence / sampler->width;
    uint64_t key = ca_pcg_permute(ca_pcg_permute(sampler->seed));
    key = ca_pcg_permute(ca_pcg_permute(key ^ (y >> TILE_BITS << 32 | x >> TILE_BITS)));
    /* After 2^32 paths, the next 2^32 of an independent scrambling. */
    if (index >> 32 != 0) key = ca_pcg_permute(ca_pcg_permute(key + (index >> 32)));

    /* The place on the Z curve, reversed: bit 0 is y's highest. */
    const uint32_t place = spread(x & 0xffu) | spread(y & 0xffu) << 1;
    const uint64_t reversed_place = ca_reverse_bits(place) >> (32 - PLACE_BITS);
    return (ca_stream){.key = key,
                       .index = (index & 0xffffffffu) | reversed_place << 32,
                       .sampler = sampler,
                       .kind = CA_SAMPLER_ZSOBOL};
}

/* A random order of the quadrants: by rows, columns or diagonals, the same in all squares of one size, and then a
 * nested scramble, whose flips are each square's own. (Of the 24 orders of four, each has one of three pairings,
 * times 8 flips.) */
static inline uint32_t reorder_place(uint32_t reversed_place, uint32_t random)
{
    const uint32_t even = 0x5555u;
    const uint32_t diagonal = random & (random >> 1 | random >> 15) & even, swap = (random >> 16) & even;
    const uint32_t y = reversed_place & even, x = (reversed_place >> 1) & even;
    const uint32_t differ = (x ^ y) & swap;
    const uint32_t low = x ^ differ, high = y ^ differ ^ (low & diagonal);
    return ca_scramble_reversed(high | low << 1, ca_reverse_bits(random) ^ random);
}

/* What a pair's two coordinates share. */
typedef struct pair_state {
    uint64_t hash;
    uint32_t index; /* shuffled */
    uint32_t reversed_place;
} pair_state;

static inline pair_state start_pair(const ca_stream *stream, uint32_t pair)
{
    const uint64_t hash = ca_pcg_permute(stream->key + pair * 0x9e3779b97f4a7c15u);
    const uint64_t random = ca_pcg_permute(hash);
    const uint32_t reversed_index = ca_reverse_bits((uint32_t)stream->index);
    return (pair_state){.hash = random,
                        .index = ca_reverse_bits(ca_scramble_reversed(reversed_index, (uint32_t)(hash >> 32))),
                        .reversed_place = reorder_place((uint32_t)(stream->index >> 32), (uint32_t)(random >> 32))};
}

static inline float coordinate(pair_state pair, uint32_t which)
{
    uint32_t x = which == 0 ? pair.index : pascal(pair.index);
    for (uint32_t bit = 0; bit < PLACE_BITS; bit++)
        x ^= directions[which][bit] & (0u - ((pair.reversed_place >> bit) & 1u));
    const uint32_t seed = (uint32_t)(ca_pcg_permute(pair.hash + 1 + which) >> 32);
    return ca_unit_float(ca_reverse_bits(ca_scramble_reversed(x, seed)), 8);
}

float ca_zsobol_1d(const ca_stream *stream, uint32_t dimension)
{
    return coordinate(start_pair(stream, dimension >> 1), dimension & 1);
}

ca_vec2 ca_zsobol_2d(const ca_stream *stream, uint32_t dimension)
{
    const pair_state pair = start_pair(stream, dimension >> 1);
    return (ca_vec2){coordinate(pair, 0), coordinate(pair, 1)};
}
