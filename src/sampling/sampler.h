/* Numbers in [0, 1) that steer the random decisions of a path, addressed, never drawn in sequence:
 *
 *     value = f(seed, sequence, index, dimension)
 *
 * `sequence` is the pixel (its number in the *full* film, so that a crop sees the same numbers) or the stream of light
 * paths; `index` counts the paths of that sequence; `dimension` names the decision. A path can therefore be made
 * again from its address alone, on any thread. Asking for more paths never changes earlier ones and no kind runs
 * out of dimensions. All numbers are multiples of 2^-24. */
#ifndef CA_SAMPLING_SAMPLER_H
#define CA_SAMPLING_SAMPLER_H

#include "math/vec.h"

#include <stdint.h>

/* Which dimension each decision consumes. A path starts with CA_DIM_START_COUNT of them and each of its vertices has
 * CA_DIM_VERTEX_COUNT more, from ca_vertex_dimension(vertex). Pairs that are sampled together start on even numbers;
 * groups of four are one 4-D point of the Sobol' sampler. */
enum {
    /* camera path */
    CA_DIM_FILM = 0, /* 2: position in the pixel's filter */
    CA_DIM_LENS = 2, /* 2: position on the lens */
    /* light path */
    CA_DIM_LIGHT_POSITION = 0,  /* 2 */
    CA_DIM_LIGHT_DIRECTION = 2, /* 2 */
    CA_DIM_LIGHT_CHOICE = 4,    /* 1: which light emits */
    CA_DIM_START_COUNT = 8,

    /* per vertex, relative */
    CA_DIM_BSDF_DIRECTION = 0, /* 2 */
    CA_DIM_BSDF_LOBE = 2,      /* 1 */
    CA_DIM_ROULETTE = 3,       /* 1; one pair with the lobe */
    CA_DIM_NEXT_EVENT = 4,     /* 2: point on the chosen light (or on the lens, for a splat) */
    CA_DIM_NEXT_LIGHT = 6,     /* 1: which light */
    CA_DIM_VERTEX_COUNT = 8,
};

static inline uint32_t ca_vertex_dimension(uint32_t vertex) { return CA_DIM_START_COUNT + CA_DIM_VERTEX_COUNT * vertex; }

typedef enum ca_sampler_kind {
    CA_SAMPLER_INDEPENDENT, /* a PCG permutation of the address */
    CA_SAMPLER_SOBOL,       /* Owen-scrambled Sobol' points, padded in groups of four dimensions */
} ca_sampler_kind;

typedef struct ca_sampler {
    ca_sampler_kind kind;
    uint64_t seed;
} ca_sampler;

/* The numbers of one path: cheap to make, 16 bytes, by value. */
typedef struct ca_stream {
    uint64_t key;   /* of (seed, sequence) for Sobol', of (seed, sequence, index) for independent numbers */
    uint32_t index; /* number of the path in its sequence */
    ca_sampler_kind kind;
} ca_stream;

ca_stream ca_stream_start(const ca_sampler *sampler, uint64_t sequence, uint32_t index);

/* A permutation of the 64-bit numbers: one step of PCG's congruential generator and its output function RXS-M-XS
 * (O'Neill 2014, "PCG: A Family of Simple Fast Space-Efficient Statistically Good Algorithms for Random Number
 * Generation", section 6.3.4). */
static inline uint64_t ca_pcg_permute(uint64_t x)
{
    x = x * 6364136223846793005u + 1442695040888963407u;
    x = ((x >> ((x >> 59) + 5)) ^ x) * 12605985483714917081u;
    return (x >> 43) ^ x;
}

/* The 24 bits from `shift` upwards as a number in [0, 1). */
static inline float ca_unit_float(uint64_t bits, uint32_t shift)
{
    return (float)((uint32_t)(bits >> shift) & 0xffffffu) * 0x1p-24f;
}

/* The bits of dimensions 2 p and 2 p + 1 of an independent path: the first in bits 40 to 63, the second in 8 to 31. The
 * factor (2^64 over the golden ratio) sends the few small pair numbers far apart. */
static inline uint64_t ca_independent_pair(uint64_t key, uint32_t pair)
{
    return ca_pcg_permute(key + pair * 0x9e3779b97f4a7c15u);
}

/* The Sobol' sampler's part of the functions below. */
float ca_sobol_1d(const ca_stream *stream, uint32_t dimension);
ca_vec2 ca_sobol_2d(const ca_stream *stream, uint32_t dimension);

static inline float ca_sample_1d(const ca_stream *stream, uint32_t dimension)
{
    if (stream->kind == CA_SAMPLER_SOBOL) return ca_sobol_1d(stream, dimension);
    return ca_unit_float(ca_independent_pair(stream->key, dimension >> 1), (dimension & 1) ? 8 : 40);
}

/* Dimensions `dimension` (even) and `dimension + 1`: the same numbers that ca_sample_1d gives for them. */
static inline ca_vec2 ca_sample_2d(const ca_stream *stream, uint32_t dimension)
{
    if (stream->kind == CA_SAMPLER_SOBOL) return ca_sobol_2d(stream, dimension);
    const uint64_t bits = ca_independent_pair(stream->key, dimension >> 1);
    return (ca_vec2){ca_unit_float(bits, 40), ca_unit_float(bits, 8)};
}

/* Name as in scene files and on the command line ("independent", "sobol"); NULL for a kind out of range. */
const char *ca_sampler_name(ca_sampler_kind kind);

#endif
