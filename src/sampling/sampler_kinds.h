/* What each kind of sampler does for the functions of sampler.h. Internal to this folder. */
#ifndef CA_SAMPLING_SAMPLER_KINDS_H
#define CA_SAMPLING_SAMPLER_KINDS_H

#include "sampling/sampler.h"

/* ---- Squares of pixels that share a sequence: the image, or a tile --------------------------------------------- */

/* Tiles have 2^CA_TILE_BITS pixels a side. */
enum { CA_TILE_BITS = 4 };

/* 2^bits pixels are the side of the smallest such square that covers the film, or a tile. */
static inline uint32_t ca_square_bits(const ca_sampler *sampler)
{
    const uint32_t side = sampler->width > sampler->height ? sampler->width : sampler->height;
    const uint32_t bits = side <= 1 ? 0 : 32 - (uint32_t)__builtin_clz(side - 1);
    return ca_sampler_has_tiles(sampler->kind) && bits > CA_TILE_BITS ? CA_TILE_BITS : bits;
}

/* A pixel within its square, and the square's name: 0 where it is the image. */
typedef struct ca_square_place {
    uint64_t x, y, tile;
} ca_square_place;

static inline ca_square_place ca_square_place_of(const ca_sampler *sampler, uint64_t sequence, uint32_t bits)
{
    const uint64_t x = sequence % sampler->width, y = sequence / sampler->width, mask = (UINT64_C(1) << bits) - 1;
    return (ca_square_place){.x = x & mask, .y = y & mask, .tile = (y >> bits) << 32 | x >> bits};
}

/* The seed's key of a square, or of the light paths (CA_SEQUENCE_LIGHT). */
static inline uint64_t ca_square_key(const ca_sampler *sampler, uint64_t square)
{
    return ca_pcg_permute(ca_pcg_permute(ca_pcg_permute(ca_pcg_permute(sampler->seed)) ^ square));
}

/* ---- halton.c: radical inverses in prime bases ----------------------------------------------------------------- */
void ca_halton_prepare(ca_sampler *sampler);
ca_stream ca_halton_start(const ca_sampler *sampler, uint64_t sequence, uint64_t index);
float ca_halton_1d(const ca_stream *stream, uint32_t dimension);

/* ---- sobol.c: nets in base 2 ----------------------------------------------------------------------------------- */
void ca_sobol_prepare(ca_sampler *sampler); /* kinds over the image or over tiles */
ca_stream ca_sobol_start(const ca_sampler *sampler, uint64_t sequence, uint64_t index); /* sobol */
ca_stream ca_sobol_image_start(const ca_sampler *sampler, uint64_t sequence, uint64_t index);
ca_stream ca_zsobol_start(const ca_sampler *sampler, uint64_t sequence, uint64_t index);
float ca_sobol_1d(const ca_stream *stream, uint32_t dimension); /* sobol and zsobol */
ca_vec2 ca_sobol_2d(const ca_stream *stream, uint32_t dimension);
float ca_sobol_image_1d(const ca_stream *stream, uint32_t dimension);

/* ---- lattice.c ------------------------------------------------------------------------------------------------- */
ca_stream ca_lattice_start(const ca_sampler *sampler, uint64_t sequence, uint64_t index);
void ca_lattice_prepare(ca_sampler *sampler); /* kinds over the image or over tiles */
ca_stream ca_lattice_image_start(const ca_sampler *sampler, uint64_t sequence, uint64_t index);
float ca_lattice_1d(const ca_stream *stream, uint32_t dimension); /* all of them */

#endif
