/* Kinds halton and halton-plain: one Halton sequence over the whole image, and one of light paths.
 *
 * The place on the film is (radical inverse in base 2, in base 3) of the path's number, stretched to 2^a by 3^b
 * pixels, the smallest that cover the film. The first a digits in base 2 are then the pixel's column and the first b
 * in base 3 its row, so the paths of a pixel are those whose numbers leave two given remainders, one in each 2^a 3^b,
 * and the Chinese remainder theorem finds it (an idea of Gruenschloss, Raab, Keller; told in Pharr, Jakob, Humphreys
 * 2018, "Physically Based Rendering", third edition, section 7.4). The digits behind the pixel's are the place within
 * it.
 *
 * Scrambling is nested, as Owen's: the permutation of a digit depends on all digits before it, so every elementary
 * interval keeps its share of points. Here a digit x in the prime base p goes to m x + c modulo p with m from 1 to p
 * - 1 and c from 0 to p - 1. Two different digits go to each pair of different digits under exactly one (m, c), so
 * pairs of points are distributed as under a scrambling by all p! permutations. The variance of a mean depends on
 * pairs alone: it is the same too. In base 2 these are all permutations there are.
 *
 * Five numbers of a path's start and seven of each vertex have a prime to themselves, in this order. The table ends
 * within vertex 35. From there on, and for dimensions without a use, numbers are radical inverses in base 2 again, of
 * the paths in an order shuffled for each dimension: else two dimensions of one base would be functions of each
 * other. Shuffling and scrambling are both nested there (in halton-plain too, by the dimension alone), so that any
 * 2^k paths from a multiple of 2^k on are spread evenly: paths of the pixel where halton has pixels, else of the
 * sequence. */
#include "sampling/owen.h"
#include "sampling/primes.h"
#include "sampling/sampler_kinds.h"

#include <assert.h>
#include <math.h>

#define GOLDEN UINT64_C(0x9e3779b97f4a7c15) /* 2^64 over the golden ratio: sends small numbers far apart */

static inline uint64_t multiply_high(uint64_t a, uint64_t b)
{
    __extension__ typedef unsigned __int128 wide;
    return (uint64_t)(((wide)a * b) >> 64);
}

/* ---- Bases ----------------------------------------------------------------------------------------------------- */

/* All that a radical inverse needs to do without divisions. Numbers are multiples of 2^-24, so digits count up to the
 * first power of the base that is no less than 2^24; all these powers are below 2^32. */
typedef struct radix {
    uint64_t reciprocal;       /* ceil(2^64 / base): multiply_high divides numbers below 2^32 exactly */
    uint64_t power_reciprocal; /* floor(2^64 / power): multiply_high is the quotient of any number, or one less */
    double scale;              /* 2^24 / power */
    uint32_t base, digits, power;
} radix;

#define POWER_3(b) ((b) * (b) * (b))
#define POWER_4(b) (POWER_3(b) * (b))
#define POWER_5(b) (POWER_4(b) * (b))
#define POWER_6(b) (POWER_3(b) * POWER_3(b))
#define POWER_7(b) (POWER_6(b) * (b))
/* By the digits of DIGITS. */
#define CHOOSE(b, d2, d3, d5, d7, d11, d16, d28, d64, d256)                                                          \
    ((b) == 2    ? (d2)                                                                                              \
     : (b) == 3  ? (d3)                                                                                              \
     : (b) == 5  ? (d5)                                                                                              \
     : (b) == 7  ? (d7)                                                                                              \
     : (b) < 16  ? (d11)                                                                                             \
     : (b) < 28  ? (d16)                                                                                             \
     : (b) < 64  ? (d28)                                                                                             \
     : (b) < 256 ? (d64)                                                                                             \
                 : (d256))
#define DIGITS(b) CHOOSE(b, 24, 16, 11, 9, 7, 6, 5, 4, 3)
#define POWER(b)                                                                                                     \
    CHOOSE(b, UINT64_C(1) << 24, UINT64_C(43046721), UINT64_C(48828125), UINT64_C(40353607), POWER_7(UINT64_C(b)),   \
           POWER_6(UINT64_C(b)), POWER_5(UINT64_C(b)), POWER_4(UINT64_C(b)), POWER_3(UINT64_C(b)))
#define ROW(b)                                                                                                       \
    {.reciprocal = UINT64_MAX / (b) + 1,                                                                             \
     .power_reciprocal = UINT64_MAX / POWER(b),                                                                      \
     .scale = 0x1p24 / (double)POWER(b),                                                                             \
     .base = (b),                                                                                                    \
     .digits = DIGITS(b),                                                                                            \
     .power = (uint32_t)POWER(b)},

static const radix radices[CA_PRIME_COUNT] = {CA_PRIMES(ROW)};

/* The row of a dimension's base; CA_PRIME_COUNT: it has none. */
static inline uint32_t row_of(uint32_t dimension)
{
    enum { START_USED = 5, VERTEX_USED = 7 };
    if (dimension < CA_DIM_START_COUNT) return dimension < START_USED ? dimension : CA_PRIME_COUNT;
    const uint32_t vertex = (dimension - CA_DIM_START_COUNT) / CA_DIM_VERTEX_COUNT;
    const uint32_t decision = (dimension - CA_DIM_START_COUNT) % CA_DIM_VERTEX_COUNT;
    const uint32_t row = START_USED + VERTEX_USED * vertex + decision;
    return decision < VERTEX_USED && row < CA_PRIME_COUNT ? row : CA_PRIME_COUNT;
}

/* ---- Radical inverses ------------------------------------------------------------------------------------------ */

static inline uint32_t last_digits(const radix *r, uint64_t number)
{
    const uint64_t rest = number - multiply_high(number, r->power_reciprocal) * r->power;
    return (uint32_t)(rest >= r->power ? rest - r->power : rest);
}

/* inverse / power as a multiple of 2^-24, rounded up: a point on the lower edge of an elementary interval stays
 * in. */
static inline float unit_float_up(const radix *r, uint64_t inverse)
{
    const uint32_t up = (uint32_t)ceil((double)(int64_t)inverse * r->scale);
    return (float)(up < 0xffffffu ? up : 0xffffffu) * 0x1p-24f;
}

static float plain(const radix *r, uint64_t number)
{
    if (r->base == 2) return ca_unit_float(ca_reverse_bits((uint32_t)number), 8);
    uint32_t rest = last_digits(r, number);
    uint64_t inverse = 0;
    for (uint32_t i = 0; i < r->digits; i++) {
        const uint32_t quotient = (uint32_t)multiply_high(rest, r->reciprocal);
        inverse = inverse * r->base + (rest - quotient * r->base);
        rest = quotient;
    }
    return unit_float_up(r, inverse);
}

static float scrambled_base_2(uint64_t number, uint64_t key)
{
    const uint32_t x = ca_scramble_reversed((uint32_t)number, (uint32_t)(key >> 32));
    return ca_unit_float(ca_reverse_bits(x), 8);
}

/* The permutation of `digit` that `bits` choose. As fractions of 2^64: bits (p - 1) is m - 1 and a rest, which is as
 * uniform; the rest is c / p and a little. Adding m digit / p to it, modulo 1, is all: the bits cleared leave more
 * room below the next multiple of 1 / p than the error of m digit / p, so that this stays exactly a permutation. */
static inline uint32_t permuted(const radix *r, uint32_t digit, uint64_t bits)
{
    const uint64_t m = 1 + multiply_high(bits, r->base - 1);
    const uint64_t rest = (bits * (r->base - 1)) & ~UINT64_C(0x1ffffffff);
    return (uint32_t)multiply_high(rest + m * digit * r->reciprocal, r->base);
}

/* `key` depends on the digits before and their count; leading zeros are digits as any other. */
static float scrambled(const radix *r, uint64_t number, uint64_t key)
{
    if (r->base == 2) return scrambled_base_2(number, key);
    uint32_t rest = last_digits(r, number);
    uint64_t inverse = 0;
    for (uint32_t i = 0; i < r->digits; i++) {
        const uint32_t quotient = (uint32_t)multiply_high(rest, r->reciprocal);
        const uint32_t digit = rest - quotient * r->base;
        const uint64_t mixed = (key ^ key >> 32) * UINT64_C(0x9fb21c651e98df25);
        inverse = inverse * r->base + permuted(r, digit, mixed ^ mixed >> 29);
        key = (key + digit + 1) * UINT64_C(0xd1342543de82ef95);
        rest = quotient;
    }
    return unit_float_up(r, inverse);
}

/* ---- Pixels ---------------------------------------------------------------------------------------------------- */

void ca_halton_prepare(ca_sampler *sampler)
{
    ca_halton_pixels *p = &sampler->pixels.halton;
    *p = (ca_halton_pixels){.scales = {1, 1}};
    for (; p->scales[0] < sampler->width; p->scales[0] *= 2) p->exponents[0]++;
    for (; p->scales[1] < sampler->height; p->scales[1] *= 3) p->exponents[1]++;
    p->stride = p->scales[0] * p->scales[1];
    p->reciprocal = UINT64_MAX / p->scales[1];
    /* Newton's iteration modulo 2^64; an odd number is its own inverse to 3 bits, and each step doubles them. */
    uint64_t inverse = p->scales[1];
    for (int step = 0; step < 5; step++) inverse *= 2 - p->scales[1] * inverse;
    p->inverse = inverse & (p->scales[0] - 1);
}

static inline uint64_t rows_above(const ca_halton_pixels *p, uint64_t number)
{
    const uint64_t quotient = multiply_high(number, p->reciprocal);
    return quotient + (number - quotient * p->scales[1] >= p->scales[1]);
}

/* The number of the index-th path of pixel (x, y). With u and v the remainders for x and y it is v + 3^b t, where
 * t = (u - v) / 3^b modulo 2^a, plus the index times the stride. Counts modulo 2^64. */
static uint64_t number_in_pixel(const ca_halton_pixels *p, uint32_t x, uint32_t y, uint64_t index)
{
    uint64_t v = 0;
    for (uint32_t i = 0; i < p->exponents[1]; i++, y /= 3) v = v * 3 + y % 3;
    const uint64_t u = p->exponents[0] == 0 ? 0 : ca_reverse_bits(x) >> (32 - p->exponents[0]);
    const uint64_t t = ((u - v) * p->inverse) & (p->scales[0] - 1);
    return v + p->scales[1] * t + p->stride * index;
}

/* The pixel of a number, by its remainders. */
static inline uint64_t pixel_of(const ca_halton_pixels *p, uint64_t number)
{
    const uint64_t row = number - rows_above(p, number) * p->scales[1];
    return (number & (p->scales[0] - 1)) | row << 32;
}

static inline uint64_t hash(uint64_t key, uint64_t word) { return ca_pcg_permute(ca_pcg_permute(key ^ word)); }

ca_stream ca_halton_start(const ca_sampler *sampler, uint64_t sequence, uint64_t index)
{
    const bool in_pixel = sequence < CA_SEQUENCE_LIGHT;
    ca_stream stream = {.index = index, .sampler = sampler, .kind = sampler->kind, .in_pixel = in_pixel};
    if (in_pixel) {
        assert(sampler->width > 0 && sequence / sampler->width < sampler->height); /* prepared, and a pixel */
        stream.index = number_in_pixel(&sampler->pixels.halton, (uint32_t)(sequence % sampler->width),
                                       (uint32_t)(sequence / sampler->width), index);
    }
    if (sampler->kind == CA_SAMPLER_HALTON)
        stream.key = hash(hash(0, sampler->seed), in_pixel ? 0 : CA_SEQUENCE_LIGHT);
    return stream;
}

/* Only the digits behind the pixel's, scrambled apart for each pixel. */
static float place_in_pixel(const ca_stream *stream, uint32_t dimension)
{
    const ca_halton_pixels *p = &stream->sampler->pixels.halton;
    const uint64_t number =
        dimension == CA_DIM_FILM ? stream->index >> p->exponents[0] : rows_above(p, stream->index);
    if (stream->kind == CA_SAMPLER_HALTON_PLAIN) return plain(&radices[dimension], number);
    return scrambled(&radices[dimension], number, hash(stream->key + dimension, pixel_of(p, stream->index)));
}

/* A dimension without a base of its own. */
static float repeated_base_2(const ca_stream *stream, uint32_t dimension)
{
    uint64_t number = stream->index, key = stream->key;
    if (stream->in_pixel && stream->kind == CA_SAMPLER_HALTON) {
        const ca_halton_pixels *p = &stream->sampler->pixels.halton;
        key = hash(key, pixel_of(p, number));
        number /= p->stride;
    }
    key = hash(key + dimension * GOLDEN, number >> 32);
    const uint32_t order = ca_scramble_reversed(ca_reverse_bits((uint32_t)number), (uint32_t)key);
    return scrambled_base_2(ca_reverse_bits(order), key);
}

float ca_halton_1d(const ca_stream *stream, uint32_t dimension)
{
    const uint32_t row = row_of(dimension);
    if (row == CA_PRIME_COUNT) return repeated_base_2(stream, dimension);
    if (stream->in_pixel && dimension < CA_DIM_FILM + 2) return place_in_pixel(stream, dimension);
    if (stream->kind == CA_SAMPLER_HALTON_PLAIN) return plain(&radices[row], stream->index);
    return scrambled(&radices[row], stream->index, ca_pcg_permute(stream->key + dimension * GOLDEN));
}
