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
 * independent of the others'.
 *
 * Kinds lattice-image and lattice-plain have one lattice over the whole image, lattice-tiles and lattice-tiles-plain
 * one over each tile of 2^CA_TILE_BITS pixels a side; plain ones are not shifted. With s = 2^bits pixels a side of
 * the image or tile, each run of s^2 paths is to have one in each pixel. The two generators of the film are therefore
 * 1 and s w + 1, w odd: of the points k / s^2 of a run, k = s x + l is in column x and in row x + l w modulo s, which
 * is each row once while l goes from 0 to s - 1. w is s over the golden ratio, so that successive l part the rows
 * evenly. The place within the pixel would hardly move from run to run: it is a lattice of the pixel's own instead,
 * which the runs count, shifted by two components that the run's point has beside its pixel (plain), or by the seed.
 * All other dimensions are those of the one lattice. */
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

/* ---- Over the image or a tile ---------------------------------------------------------------------------------- */

/* Rows that a step within a column goes down: s over the golden ratio, made odd. */
static inline uint64_t rows_down(uint32_t bits) { return (UINT64_C(0x9e3779b97f4a7c15) >> 1 >> (63 - bits)) | 1; }

void ca_lattice_prepare(ca_sampler *sampler)
{
    ca_lattice_pixels *pixels = &sampler->pixels.lattice;
    pixels->bits = ca_square_bits(sampler);
    /* Newton's iteration modulo 2^64; an odd number is its own inverse to 3 bits, and each step doubles them. */
    const uint64_t step = rows_down(pixels->bits);
    uint64_t inverse = step;
    for (int i = 0; i < 5; i++) inverse *= 2 - step * inverse;
    pixels->inverse = inverse & ((UINT64_C(1) << pixels->bits) - 1);
}

/* phi of the index-th path of the place: its high bits are k of the place's point in a run, the next ones phi of the
 * run. */
static uint64_t phi_at(const ca_lattice_pixels *pixels, const ca_square_place *place, uint64_t index)
{
    const uint32_t bits = pixels->bits;
    if (bits == 0) return ca_reverse_bits64(index);
    const uint64_t l = (place->y - place->x) * pixels->inverse & ((UINT64_C(1) << bits) - 1);
    return (place->x << bits | l) << (64 - 2 * bits) | ca_reverse_bits64(index) >> 2 * bits;
}

ca_stream ca_lattice_image_start(const ca_sampler *sampler, uint64_t sequence, uint64_t index)
{
    const ca_lattice_pixels *pixels = &sampler->pixels.lattice;
    ca_stream stream = {.index = ca_reverse_bits64(index), .sampler = sampler, .kind = sampler->kind};
    uint64_t square = CA_SEQUENCE_LIGHT;
    if (sequence < CA_SEQUENCE_LIGHT) {
        const ca_square_place place = ca_square_place_of(sampler, sequence, pixels->bits);
        stream.index = phi_at(pixels, &place, index);
        stream.in_pixel = true;
        square = place.tile;
    }
    if (!ca_sampler_is_plain(sampler->kind)) stream.key = ca_square_key(sampler, square);
    return stream;
}

/* The pixel's own lattice: its shift is no coordinate that the path uses for something else. */
static float place_in_pixel(const ca_stream *stream, uint32_t dimension)
{
    enum { UNUSED = 4 };
    const uint32_t bits = stream->sampler->pixels.lattice.bits;
    const uint64_t run = bits == 0 ? stream->index : stream->index << 2 * bits;
    const uint64_t in_run = bits == 0 ? 0 : stream->index >> (64 - 2 * bits) << (64 - 2 * bits);
    uint64_t shift = in_run * generator(UNUSED + dimension);
    if (!ca_sampler_is_plain(stream->kind)) {
        const uint64_t shifts = ca_independent_pair(ca_pcg_permute(stream->key ^ ca_pcg_permute(in_run)), 0);
        shift = dimension & 1 ? shifts << 32 : shifts;
    }
    return ca_unit_float(run * generator(dimension) + shift, 40);
}

/* ---- Coordinates ----------------------------------------------------------------------------------------------- */

float ca_lattice_1d(const ca_stream *stream, uint32_t dimension)
{
    uint64_t phi = stream->index;
    uint32_t d = dimension;
    if (stream->in_pixel && dimension < CA_DIM_FILM + 2) return place_in_pixel(stream, dimension);
    if (dimension >= CA_LATTICE_DIMENSIONS) {
        d = dimension % CA_LATTICE_DIMENSIONS;
        phi = reorder(phi, ca_pcg_permute(ca_pcg_permute(~stream->key + dimension / CA_LATTICE_DIMENSIONS)));
    }
    uint64_t shift = 0;
    if (!ca_sampler_is_plain(stream->kind)) {
        const uint64_t shifts = ca_independent_pair(stream->key, dimension >> 1);
        shift = dimension & 1 ? shifts << 32 : shifts;
    }
    return ca_unit_float(phi * generator(d) + shift, 40);
}
