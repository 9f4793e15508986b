/* Kinds sobol-image, sobol-plain, sobol-tiles, sobol-tiles-plain: one Sobol' sequence over the whole image, or over
 * each tile of 2^CA_TILE_BITS pixels a side. Path `number` has the coordinates (generating matrix of the dimension) *
 * (bits of the number). Plain ones are the same for every seed, for every tile, and for camera and light paths.
 *
 * The first two dimensions are a (0, 2)-sequence: each run of 4^bits paths has exactly one in each pixel of a square
 * of 2^bits pixels a side, so the index-th path of a pixel is one of the run that starts at index * 4^bits. They are
 * computed in 64 bits, and what remains below the pixel is exact.
 *
 * The scrambled ones are scrambled as Owen's, each dimension by itself, apart for light paths and for each tile: the
 * sequence keeps its nets. Of the film's dimensions only the digits behind the pixel's are, apart for each pixel.
 *
 * Past its ends the sequence goes on so: dimensions from 256 on repeat the first 256, Owen-scrambled and in an order
 * shuffled by a key of the repeat; numbers from 2^53 on (2^64 in the first two dimensions) repeat the first ones with
 * a digital shift, or a scrambling, of their own. */
#include "sampling/owen.h"
#include "sampling/sampler_kinds.h"
#include "sampling/sobol_table.h"

#include <assert.h>
#include <string.h>

/* ---- The first two dimensions ---------------------------------------------------------------------------------- */

/* The product with Pascal's triangle modulo 2 (binomial(column, row), bit 0 first) in six steps: the triangle of side
 * 2^(k+1) is that of side 2^k three times over. */
static inline uint64_t pascal(uint64_t x)
{
    x ^= (x >> 1) & 0x5555555555555555u;
    x ^= (x >> 2) & 0x3333333333333333u;
    x ^= (x >> 4) & 0x0f0f0f0f0f0f0f0fu;
    x ^= (x >> 8) & 0x00ff00ff00ff00ffu;
    x ^= (x >> 16) & 0x0000ffff0000ffffu;
    return x ^ (x >> 32);
}

/* As 64-bit fractions. */
static inline uint64_t film_x(uint64_t number) { return ca_reverse_bits64(number); }
static inline uint64_t film_y(uint64_t number) { return ca_reverse_bits64(pascal(number)); }

/* x << count and x >> (64 - count) for counts from 0 to 64. */
static inline uint64_t drop_high(uint64_t x, uint32_t count) { return count < 64 ? x << count : 0; }
static inline uint64_t take_high(uint64_t x, uint32_t count) { return count > 0 ? x >> (64 - count) : 0; }

/* ---- Pixels ---------------------------------------------------------------------------------------------------- */

/* The pixel of a path, as one word: x in the low `bits`, y above. */
static inline uint64_t pixel_of(uint64_t number, uint32_t bits)
{
    return take_high(film_x(number), bits) | take_high(film_y(number), bits) << bits;
}

void ca_sobol_prepare(ca_sampler *sampler)
{
    ca_sobol_pixels *pixels = &sampler->pixels.sobol;
    pixels->bits = ca_square_bits(sampler);

    /* Gauss and Jordan's elimination over the field of two elements. Rows are pairs of a pixel and the number in the
     * run from 0 that falls into it; sums of rows are such pairs again, and in the end the pixels are the powers of
     * two. */
    uint64_t pixel[64], *const number = pixels->rows;
    const uint32_t count = 2 * pixels->bits;
    for (uint32_t i = 0; i < count; i++) {
        number[i] = UINT64_C(1) << i;
        pixel[i] = pixel_of(number[i], pixels->bits);
    }
    for (uint32_t bit = 0; bit < count; bit++) {
        uint32_t pivot = bit;
        for (; !(pixel[pivot] >> bit & 1); pivot++) assert(pivot + 1 < count); /* exists: every pixel is reached */
        const uint64_t pivot_pixel = pixel[pivot], pivot_number = number[pivot];
        pixel[pivot] = pixel[bit], number[pivot] = number[bit];
        pixel[bit] = pivot_pixel, number[bit] = pivot_number;
        for (uint32_t row = 0; row < count; row++)
            if (row != bit && (pixel[row] >> bit & 1)) pixel[row] ^= pivot_pixel, number[row] ^= pivot_number;
    }
}

/* The number of the index-th path of the place. */
static uint64_t number_at(const ca_sobol_pixels *pixels, const ca_square_place *place, uint64_t index)
{
    const uint32_t bits = pixels->bits;
    const uint64_t run = drop_high(index, 2 * bits);
    const uint64_t pixel = place->x | place->y << bits;
    /* Number run + low is the sum of run and low, and so are their pixels. */
    const uint64_t pixel_of_low = pixel ^ pixel_of(run, bits);
    uint64_t low = 0;
    for (uint32_t bit = 0; bit < 2 * bits; bit++) low ^= pixels->rows[bit] & (0 - (pixel_of_low >> bit & 1));
    return run + low;
}

ca_stream ca_sobol_image_start(const ca_sampler *sampler, uint64_t sequence, uint64_t index)
{
    const bool plain = ca_sampler_is_plain(sampler->kind);
    ca_stream stream = {.index = index, .sampler = sampler, .kind = sampler->kind};
    if (sequence == CA_SEQUENCE_LIGHT) {
        if (!plain) stream.key = ca_square_key(sampler, CA_SEQUENCE_LIGHT);
        return stream;
    }
    const ca_sobol_pixels *pixels = &sampler->pixels.sobol;
    const ca_square_place place = ca_square_place_of(sampler, sequence, pixels->bits);
    const uint64_t beyond = take_high(index, 2 * pixels->bits);
    stream.index = number_at(pixels, &place, index);
    stream.key = plain ? beyond : ca_square_key(sampler, place.tile) + beyond;
    stream.in_pixel = true;
    return stream;
}

/* ---- Coordinates ----------------------------------------------------------------------------------------------- */

/* Eight columns side by side: the compilers' vectors, as they do not find this by themselves. */
typedef uint32_t lanes __attribute__((vector_size(32)));

/* Coordinate of one of the table's dimensions, as a 32-bit fraction. */
static inline uint32_t coordinate(uint64_t number, uint32_t dimension)
{
    if (dimension == 0) return (uint32_t)(film_x(number) >> 32);
    if (dimension == 1) return (uint32_t)(film_y(number) >> 32);
    const ca_sobol_row *row = &ca_sobol_rows[dimension];
    const lanes bit_of_lane = {1, 2, 4, 8, 16, 32, 64, 128};
    lanes sums = {0};
    uint64_t bits = number << row->zeros;
    for (const uint32_t *columns = row->columns; bits != 0; bits >>= 8, columns += 8) {
        lanes eight;
        memcpy(&eight, columns, sizeof eight);
        sums ^= eight & (lanes)(((uint32_t)bits & bit_of_lane) != 0);
    }
    return (sums[0] ^ sums[1] ^ sums[2] ^ sums[3] ^ sums[4] ^ sums[5] ^ sums[6] ^ sums[7]) << 1;
}

static inline uint32_t hash(uint64_t a, uint64_t b)
{
    return (uint32_t)(ca_pcg_permute(ca_pcg_permute(ca_pcg_permute(a) + b)) >> 32);
}

/* The shuffle is a scramble of the number's low 32 bits, by a seed of the high ones: blocks of 2^k numbers stay
 * together. */
static uint32_t repeated_coordinate(uint64_t number, uint32_t dimension)
{
    const uint32_t repeat = dimension / CA_SOBOL_DIMENSION_COUNT;
    const uint32_t reversed = ca_reverse_bits((uint32_t)number);
    const uint32_t low = ca_reverse_bits(ca_scramble_reversed(reversed, hash(number >> 32, ~(uint64_t)repeat)));
    const uint32_t u = coordinate(number >> 32 << 32 | low, dimension % CA_SOBOL_DIMENSION_COUNT);
    return ca_reverse_bits(ca_scramble_reversed(ca_reverse_bits(u), hash(0, dimension)));
}

/* What a dimension's scrambling depends on beside the stream's key: the pixel, or where the sequence starts over. */
static uint64_t scrambled_apart(const ca_stream *stream, uint32_t dimension)
{
    if (dimension >= 2) return stream->index >> CA_SOBOL_INDEX_BITS;
    return stream->in_pixel ? pixel_of(stream->index, stream->sampler->pixels.sobol.bits) : 0;
}

float ca_sobol_image_1d(const ca_stream *stream, uint32_t dimension)
{
    uint32_t u;
    uint64_t beyond = stream->key; /* the end of the sequence, where it is plain */
    if (dimension < 2) {
        const uint64_t wide = dimension == 0 ? film_x(stream->index) : film_y(stream->index);
        u = (uint32_t)(drop_high(wide, stream->in_pixel ? stream->sampler->pixels.sobol.bits : 0) >> 32);
    } else {
        const uint32_t dropped = 64 - CA_SOBOL_INDEX_BITS;
        beyond = stream->key << dropped | stream->index >> CA_SOBOL_INDEX_BITS;
        u = dimension < CA_SOBOL_DIMENSION_COUNT ? coordinate(stream->index, dimension)
                                                 : repeated_coordinate(stream->index, dimension);
    }
    if (!ca_sampler_is_plain(stream->kind)) {
        const uint32_t seed = hash(stream->key ^ scrambled_apart(stream, dimension), dimension);
        u = ca_reverse_bits(ca_scramble_reversed(ca_reverse_bits(u), seed));
    } else if (beyond != 0) {
        u ^= hash(beyond, dimension);
    }
    return ca_unit_float(u, 8);
}
