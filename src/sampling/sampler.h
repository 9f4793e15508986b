/* Numbers in [0, 1) that steer the random decisions of a path, addressed, never drawn in sequence:
 *
 *     value = f(seed, sequence, index, dimension)
 *
 * `sequence` is the pixel (its number y * width + x in the *full* film, so that a crop sees the same numbers) or the
 * stream of light paths (CA_SEQUENCE_LIGHT); `index` counts the paths of that sequence; `dimension` names the
 * decision. A path can therefore be made again from its address alone, on any thread. Asking for more paths never
 * changes earlier ones, no kind runs out of dimensions or of indices, and none asks for a special size of the image.
 * All numbers are multiples of 2^-24.
 *
 * Kinds that sample the whole image, or a tile of it, by one sequence find for a pixel and an index the number of
 * that path in the sequence: dimensions CA_DIM_FILM are then the place within the pixel. Their numbers of paths are
 * counted modulo 2^64. Past its table of bases Halton goes on with base 2, each dimension shuffled and scrambled by
 * itself, in halton-plain too. */
#ifndef CA_SAMPLING_SAMPLER_H
#define CA_SAMPLING_SAMPLER_H

#include "math/vec.h"

#include <stdbool.h>
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

static inline uint32_t ca_vertex_dimension(uint32_t vertex)
{
    return CA_DIM_START_COUNT + CA_DIM_VERTEX_COUNT * vertex;
}

/* The sequence of light paths; all smaller numbers are pixels. */
#define CA_SEQUENCE_LIGHT (UINT64_C(1) << 63)

typedef enum ca_sampler_kind {
    CA_SAMPLER_INDEPENDENT,  /* a PCG permutation of the address */
    CA_SAMPLER_HALTON,       /* over the whole image; digits scrambled (nested), by the seed */
    CA_SAMPLER_HALTON_PLAIN, /* the same without scrambling: light and camera paths see one and the same sequence */
    CA_SAMPLER_SOBOL, /* a sequence of its own for each pixel; Owen-scrambled, padded in groups of four dimensions */
    CA_SAMPLER_SOBOL_PLAIN, /* over the whole image, not scrambled: light and camera paths see the same sequence */
    CA_SAMPLER_SOBOL_IMAGE, /* the same, Owen-scrambled by the seed, light paths apart */
    CA_SAMPLER_SOBOL_TILES, /* one over each tile of 16 x 16 pixels, Owen-scrambled apart */
    CA_SAMPLER_SOBOL_TILES_PLAIN, /* the same sequence over each tile, not scrambled */
    CA_SAMPLER_ZSOBOL,      /* sobol with its samples spread over neighbouring pixels so that their errors differ */
    CA_SAMPLER_LATTICE,     /* an extensible rank-1 lattice, shifted apart for each pixel */
    CA_SAMPLER_LATTICE_PLAIN, /* one over the whole image, not shifted: light and camera paths see the same */
    CA_SAMPLER_LATTICE_IMAGE,       /* the same, shifted by the seed, light paths apart */
    CA_SAMPLER_LATTICE_TILES,       /* one over each tile of 16 x 16 pixels, shifted apart */
    CA_SAMPLER_LATTICE_TILES_PLAIN, /* the same lattice over each tile, not shifted */
    CA_SAMPLER_KIND_COUNT
} ca_sampler_kind;

/* What finds a path of the whole image's sequence by its pixel. Filled by ca_sampler_prepare. */
typedef struct ca_halton_pixels {
    uint32_t exponents[2];   /* 2^exponents[0] >= width, 3^exponents[1] >= height */
    uint64_t scales[2];      /* these powers, */
    uint64_t stride;         /* their product: the same pixel comes again after so many paths */
    uint64_t inverse;        /* of the second power modulo the first, for the Chinese remainder theorem */
    uint64_t reciprocal;     /* floor((2^64 - 1) / scales[1]) */
} ca_halton_pixels;

typedef struct ca_sobol_pixels {
    uint32_t bits; /* 2^bits >= width and height: each run of 4^bits paths has one in every pixel of that square */
    uint64_t rows[64];       /* the matrix that turns a pixel's coordinates into the low bits of the path's number */
} ca_sobol_pixels;

typedef struct ca_lattice_pixels {
    uint32_t bits;    /* as above */
    uint64_t inverse; /* modulo 2^bits, of the rows that a step within a column goes down */
} ca_lattice_pixels;

typedef struct ca_sampler {
    ca_sampler_kind kind;
    uint64_t seed;
    uint32_t width, height; /* of the full film */
    union {
        ca_halton_pixels halton;
        ca_sobol_pixels sobol;
        ca_lattice_pixels lattice;
    } pixels;
} ca_sampler;

/* Without randomisation: the seed changes nothing. */
static inline bool ca_sampler_is_plain(ca_sampler_kind kind)
{
    return kind == CA_SAMPLER_HALTON_PLAIN || kind == CA_SAMPLER_SOBOL_PLAIN ||
           kind == CA_SAMPLER_SOBOL_TILES_PLAIN || kind == CA_SAMPLER_LATTICE_PLAIN ||
           kind == CA_SAMPLER_LATTICE_TILES_PLAIN;
}

/* One sequence for each tile of the image? */
static inline bool ca_sampler_has_tiles(ca_sampler_kind kind)
{
    return kind == CA_SAMPLER_SOBOL_TILES || kind == CA_SAMPLER_SOBOL_TILES_PLAIN ||
           kind == CA_SAMPLER_LATTICE_TILES || kind == CA_SAMPLER_LATTICE_TILES_PLAIN;
}

/* Tells the sampler the size of the full film, before any stream of a pixel starts. */
void ca_sampler_prepare(ca_sampler *sampler, uint32_t width, uint32_t height);

/* The numbers of one path: cheap to make, by value; the sampler must outlive it. */
typedef struct ca_stream {
    uint64_t key;   /* of (seed, sequence), or what else the kind makes of them; independent: of the index too */
    uint64_t index; /* number of the path in its sequence, or in the whole image's */
    const ca_sampler *sampler;
    ca_sampler_kind kind;
    bool in_pixel;  /* its film dimensions are a place within a pixel of the whole image's sequence */
} ca_stream;

ca_stream ca_stream_start(const ca_sampler *sampler, uint64_t sequence, uint64_t index);

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

/* The bits of dimensions 2 p and 2 p + 1 of an independent path: the first in bits 40 to 63, the second in 8 to 31.
 * The factor (2^64 over the golden ratio) sends the few small pair numbers far apart. */
static inline uint64_t ca_independent_pair(uint64_t key, uint32_t pair)
{
    return ca_pcg_permute(key + pair * 0x9e3779b97f4a7c15u);
}

/* All other kinds' part of the functions below. */
float ca_structured_1d(const ca_stream *stream, uint32_t dimension);
ca_vec2 ca_structured_2d(const ca_stream *stream, uint32_t dimension);

static inline float ca_sample_1d(const ca_stream *stream, uint32_t dimension)
{
    if (stream->kind != CA_SAMPLER_INDEPENDENT) return ca_structured_1d(stream, dimension);
    return ca_unit_float(ca_independent_pair(stream->key, dimension >> 1), (dimension & 1) ? 8 : 40);
}

/* Dimensions `dimension` (even) and `dimension + 1`: the same numbers that ca_sample_1d gives for them. */
static inline ca_vec2 ca_sample_2d(const ca_stream *stream, uint32_t dimension)
{
    if (stream->kind != CA_SAMPLER_INDEPENDENT) return ca_structured_2d(stream, dimension);
    const uint64_t bits = ca_independent_pair(stream->key, dimension >> 1);
    return (ca_vec2){ca_unit_float(bits, 40), ca_unit_float(bits, 8)};
}

/* Name as in scene files and on the command line ("independent", "halton-plain", ...); NULL for a kind out of
 * range. */
const char *ca_sampler_name(ca_sampler_kind kind);

/* The kind of that name; false: there is none. */
bool ca_sampler_find(const char *name, ca_sampler_kind *kind);

/* "independent, halton, ..." for messages and help. */
const char *ca_sampler_names(void);

#endif
