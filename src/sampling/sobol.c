/* Kind sobol: each pixel has a sequence of its own, and so have the light paths.
 *
 * Groups of four dimensions are one 4-D Sobol' sequence, whose order is shuffled by a nested uniform (Owen) scramble
 * of the index and whose coordinates are Owen-scrambled, with seeds hashed from the stream's key and the group, so
 * that groups are independent of each other: Burley 2020, "Practical Hash-based Owen Scrambling", JCGT 9(4). A
 * scramble permutes each aligned block of 2^k indices among such blocks, so every block of 2^k paths is a net.
 *
 * All is done on bit-reversed words, in which a nested scramble is a function where each bit depends on the lower
 * ones. The directions are therefore stored reversed, and so is their order: directions[d][i] belongs to bit 31 - i
 * of the index, its bit 0 is worth 1/2. */
#include "sampling/owen.h"
#include "sampling/sampler_kinds.h"
#include "sampling/zsobol.h"

/* Dimensions 2 to 4 of Joe and Kuo's table new-joe-kuo-6 (2008, "Constructing Sobol sequences with better
 * two-dimensional projections"): polynomials x + 1, x^2 + x + 1, x^3 + x + 1 (a = 0, 1, 1), m = 1; 1 3; 1 3 1. The
 * first dimension is the reversed index itself. */
static const uint32_t directions[3][32] = {
    {0xffffffff, 0x55555555, 0x33333333, 0x11111111, 0x0f0f0f0f, 0x05050505, 0x03030303, 0x01010101,
     0x00ff00ff, 0x00550055, 0x00330033, 0x00110011, 0x000f000f, 0x00050005, 0x00030003, 0x00010001,
     0x0000ffff, 0x00005555, 0x00003333, 0x00001111, 0x00000f0f, 0x00000505, 0x00000303, 0x00000101,
     0x000000ff, 0x00000055, 0x00000033, 0x00000011, 0x0000000f, 0x00000005, 0x00000003, 0x00000001},
    {0xaaaa00a3, 0x77770071, 0x3939003a, 0x16160017, 0x09a30009, 0x06710006, 0x033a0003, 0x01170001,
     0x00a3aaaa, 0x00717777, 0x003a3939, 0x00171616, 0x000909a3, 0x00060671, 0x0003033a, 0x00010117,
     0x0000aa09, 0x00007706, 0x00003903, 0x00001601, 0x000009aa, 0x00000677, 0x00000339, 0x00000116,
     0x000000a3, 0x00000071, 0x0000003a, 0x00000017, 0x00000009, 0x00000006, 0x00000003, 0x00000001},
    {0xc900a00a, 0x45004004, 0x2e003003, 0x1f001001, 0x0a000b6d, 0x0400079e, 0x030002a7, 0x0100011a,
     0x00b6dba4, 0x0079e7db, 0x002a7289, 0x0011a105, 0x000c9bae, 0x000457df, 0x0002e28a, 0x0001f104,
     0x0000a0c3, 0x00004041, 0x0000302d, 0x0000101e, 0x00000b67, 0x0000079a, 0x000002a4, 0x0000011b,
     0x000000c9, 0x00000045, 0x0000002e, 0x0000001f, 0x0000000a, 0x00000004, 0x00000003, 0x00000001},
};

static inline uint32_t sobol_reversed(uint32_t reversed_index, uint32_t dimension)
{
    if (dimension == 0) return ca_reverse_bits(reversed_index);
    const uint32_t *direction = directions[dimension - 1];
    uint32_t x = 0;
    for (uint32_t bit = 0; bit < 32; bit++) x ^= direction[bit] & (0u - ((reversed_index >> bit) & 1u));
    return x;
}

/* The index of the stream's path in the order of `group`, reversed, and the group's hash. */
static inline uint32_t shuffle(const ca_stream *stream, uint32_t group, uint64_t *hash)
{
    *hash = ca_pcg_permute(stream->key + group * 0x9e3779b97f4a7c15u);
    return ca_scramble_reversed(ca_reverse_bits((uint32_t)stream->index), (uint32_t)(*hash >> 32));
}

static inline float coordinate(uint32_t reversed_index, uint64_t hash, uint32_t dimension)
{
    const uint32_t seed = (uint32_t)(ca_pcg_permute(hash + dimension) >> 32);
    const uint32_t x = ca_reverse_bits(ca_scramble_reversed(sobol_reversed(reversed_index, dimension), seed));
    return ca_unit_float(x, 8);
}

ca_stream ca_sobol_start(const ca_sampler *sampler, uint64_t sequence, uint64_t index)
{
    /* Two permutations after each word of the address: one leaves traces of small numbers in its lower bits. */
    uint64_t key = ca_pcg_permute(ca_pcg_permute(sampler->seed));
    key = ca_pcg_permute(ca_pcg_permute(key ^ sequence));
    /* After 2^32 paths, the next 2^32 of an independent scrambling. */
    if (index >> 32 != 0) key = ca_pcg_permute(ca_pcg_permute(key + (index >> 32)));
    return (ca_stream){.key = key, .index = index, .sampler = sampler, .kind = CA_SAMPLER_SOBOL};
}

float ca_sobol_1d(const ca_stream *stream, uint32_t dimension)
{
    if (stream->kind == CA_SAMPLER_ZSOBOL) return ca_zsobol_1d(stream, dimension);
    uint64_t hash;
    const uint32_t reversed_index = shuffle(stream, dimension >> 2, &hash);
    return coordinate(reversed_index, hash, dimension & 3);
}

ca_vec2 ca_sobol_2d(const ca_stream *stream, uint32_t dimension)
{
    if (stream->kind == CA_SAMPLER_ZSOBOL) return ca_zsobol_2d(stream, dimension);
    uint64_t hash;
    const uint32_t reversed_index = shuffle(stream, dimension >> 2, &hash);
    return (ca_vec2){coordinate(reversed_index, hash, dimension & 3),
                     coordinate(reversed_index, hash, (dimension & 3) + 1)};
}
