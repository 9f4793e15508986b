/* Kind zsobol: sobol with its samples spread over neighbouring pixels, so that their errors differ: what is left of them
 * after some blur (of the eye, or a filter) is less than that of independent errors, and they look like blue noise.
 *
 * Ahmed and Wonka 2020, "Screen-Space Blue-Noise Diffusion of Monte Carlo Sampling Error via Hierarchical Ordering of
 * Pixels" (ACM TOG 39(6)): pixels are ordered along a Z curve, the four quadrants of each of its squares in a random order,
 * and get consecutive stretches of one Sobol' sequence, so that squares of pixels have nets together. A stretch has its
 * length, but here samples may be added at any time; so the place on the curve does not select a stretch. Each pixel has
 * the points of the first two Sobol' dimensions from the start, digitally shifted (exclusive or) by a vector that depends
 * linearly on its place: bit b of the place adds directions[.][15 - b]. All is then Owen-scrambled, the same in all pixels,
 * which keeps nets.
 *
 * So a pixel alone has a scrambled (0, 2)-sequence, which converges as sobol does, and a square of pixels with 2^e samples
 * each has a digital net too. No directions give a perfect one to all squares for all e. These were searched by annealing,
 * for low variance under scrambling in squares of 2 x 2 to 16 x 16 pixels with 1 to 64 samples, and for small t in larger
 * ones. With one sample t is 0 up to 16 x 16 pixels and at most 1 above; with up to 64 samples it is at most 3.
 *
 * Pairs of dimensions are independent of each other: each orders samples and pixels in its own way. So are tiles of 256 x
 * 256 pixels. Light paths have no neighbours: their sequence is that of kind sobol. */
#include "sampling/zsobol.h"

#include "sampling/owen.h"
#include "sampling/sampler_kinds.h"

enum { TILE_BITS = 8, PLACE_BITS = 2 * TILE_BITS };

/* [coordinate][i] for bit 15 - i of the place, as a reversed fraction: bit 0 is worth 1/2. */
static const uint32_t directions[2][16] = {
    {0xf75f7d14, 0xd70ff309, 0x5a23d296, 0x0c2747fd, 0x24ab126f, 0x22536f6d, 0x275be1c3, 0xc99dc1c1,
     0x3b5900c0, 0x9045099e, 0xad3c47f8, 0x18e02b9b, 0xaa56293b, 0xfaaf9be2, 0x9f332a8d, 0x214441f3},
    {0x151ab51a, 0x685f99ff, 0x41e4da88, 0xd5504725, 0x212af6c2, 0x0bedd60a, 0x95c442b4, 0xec89e900,
     0xcff55246, 0x7bb28115, 0x153d736b, 0x767bcf47, 0x53ad2228, 0x3447bfd4, 0xc59aa19e, 0xa13d1779},
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

/* A random order of the quadrants: by rows, columns or diagonals, the same in all squares of one size, and then a nested
 * scramble, whose flips are each square's own. (Of the 24 orders of four, each has one of three pairings, times 8 flips.) */
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
