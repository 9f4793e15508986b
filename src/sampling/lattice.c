/* Kind lattice: each pixel has one and the same extensible rank-1 lattice, shifted by a vector of its own, and so
 * have the light paths:
 *
 *     x_i[d] = frac(phi(i) z[d] + shift[d]),   phi: the radical inverse in base 2,
 *
 * so that the first 2^m paths, and every later aligned block of as many, are a shifted lattice of 2^m points.
 *
 * All is done on 64-bit words in units of 2^-64, where frac is what remains of a product. With z odd, every
 * coordinate alone runs through all multiples of 2^-64 before one comes again: no index is too large. The generators
 * were chosen for up to 2^48 points (lattice_table.c); beyond 2^52 two-dimensional projections gather along lines.
 *
 * The generating vector serves the first 248 dimensions, those of the start and of 30 vertices; the next 248 repeat
 * it, and so on, with another shift and in an order of their own (a nested uniform scramble of the index, which
 * permutes each aligned block of 2^k indices among such blocks): each run of dimensions stays a lattice of its own,
 * independent of the others'. */
#include "sampling/lattice_table.h"
#include "sampling/owen.h"
#include "sampling/sampler_kinds.h"

static inline uint64_t generator(uint32_t d) { return ca_lattice_published[d] | (uint64_t)ca_lattice_upper[d] << 20; }

ca_stream ca_lattice_start(const ca_sampler *sampler, uint64_t sequence, uint64_t index)
{
    /* Two permutations after each word of the address: one leaves traces of small numbers in its lower bits. */
    uint64_t key = ca_pcg_permute(ca_pcg_permute(sampler->seed));
    key = ca_pcg_permute(ca_pcg_permute(key ^ sequence));
    /* phi(i) takes the place of the index. */
    return (ca_stream){.key = key, .index = ca_reverse_bits64(index), .sampler = sampler, .kind = CA_SAMPLER_LATTICE};
}

/* A nested uniform scramble of phi(i): each bit is flipped or not depending on the lower ones, which are the index'
 * higher ones. Each step keeps that, for a product carries upwards only; factors are odd, or even where the word
 * itself stays in. */
static uint64_t reorder(uint64_t phi, uint64_t hash)
{
    phi ^= phi * 0xda942042e4dd58b4u;
    phi += hash;
    phi *= hash >> 32 | 1;
    phi ^= phi * 0x5851f42d4c957f2cu;
    return phi ^ phi * 0xaef17502108ef2d8u;
}

float ca_lattice_1d(const ca_stream *stream, uint32_t dimension)
{
    uint64_t phi = stream->index;
    uint32_t d = dimension;
    if (dimension >= CA_LATTICE_DIMENSIONS) {
        d = dimension % CA_LATTICE_DIMENSIONS;
        phi = reorder(phi, ca_pcg_permute(ca_pcg_permute(~stream->key + dimension / CA_LATTICE_DIMENSIONS)));
    }
    const uint64_t shifts = ca_independent_pair(stream->key, dimension >> 1);
    const uint64_t shift = dimension & 1 ? shifts << 32 : shifts;
    return ca_unit_float(phi * generator(d) + shift, 40);
}
