/* The film of renders by blocks of (camera path, light path) pairs: exact sums, so that blocks may be added in any
 * order, on any machine, and the image is the same to the bit.
 *
 * A pixel's value is the sum over all its pairs over their number (Keller, Grünschloß, Droske, "Quasi-Monte Carlo
 * Progressive Photon Mapping", section 4.2). Blocks share their paths, so they are no independent samples, and their
 * scatter does not show the error. Error bars, where asked for, come from variances estimated within each block
 * (pair_covariances.h, pair_interval.h); the camera paths and light paths must then be independent random ones.
 *
 * Layers: R G B; Albedo.*, N.*, P.* of the primary hits, averaged; IrradianceGradient.X .Y .Z, W m^-3, of the
 * luminance of what arrives (where wanted); Samples.Y the number of camera paths (each block's counted); Pairs.Y that
 * of pairs. With error bars: ConfidenceLow.Y, ConfidenceHigh.Y and ConfidenceWidened.Y, the 95 % interval of the
 * luminance (interval_layers.h); ValueVariance.Y, the estimated variance of the pixel's luminance, which may
 * be negative. Both need all blocks from the first on: else all pixels are marked, with a variance that is not a
 * number, as are pixels that had a sample out of bounds.
 *
 * Radiance and gradients are summed exactly (exact_sum.h). Of the other layers each block's sum is rounded, once, to
 * a fixed point: to multiples of 2^-28 for albedo and normals, for positions of 2^-28 times the power of two that
 * bounds the scene's coordinates; a sixteenth of what a float of that size resolves. They hold 2^31 camera paths a
 * pixel.
 *
 * State: 208 bytes per pixel, 120 more with gradients, 200 more with error bars; who makes blocks keeps a sample of
 * each pixel beside it. Threads: different pixels at once. */
#ifndef CA_FILM_BLOCK_FILM_H
#define CA_FILM_BLOCK_FILM_H

#include "base/status.h"
#include "film/pair_covariances.h"
#include "image/layers.h"
#include "math/rgb.h"
#include "math/vec.h"

#include <stdbool.h>
#include <stdint.h>

/* What a block adds to a pixel: sums, not means. */
typedef struct ca_block_sample {
    ca_rgb radiance; /* over the pixel's pairs in the block, times the filter's weight */
    uint64_t pairs;
    ca_vec3 irradiance_gradient; /* over pairs, of luminance */
    ca_rgb albedo;               /* over the pixel's camera paths in the block, likewise: */
    ca_vec3 normal, position;
    uint32_t paths;
    bool out_of_memory; /* while it was made: the render is to be given up. The film does not check */
    /* For error bars. How many blocks from the first on, before this one, had the same camera paths, and the same
     * light paths: (0, 0) in the first block only. All of the pixel's blocks have as many paths and pairs as each
     * other. */
    ca_pair_covariance covariance; /* of luminance */
    uint64_t visits_camera, visits_light;
} ca_block_sample;

typedef struct ca_block_film ca_block_film;

typedef struct ca_block_film_desc {
    uint32_t full_width, full_height, crop[4];
    bool gradients, error_bars;
    float extent; /* > 0: no coordinate of the scene is larger; kept rounded up to a power of two */
} ca_block_film_desc;

ca_status ca_block_film_create(ca_block_film **film, const ca_block_film_desc *desc, ca_error *error);
void ca_block_film_destroy(ca_block_film *film); /* NULL is allowed */

const ca_block_film_desc *ca_block_film_described(const ca_block_film *film);
bool ca_block_film_desc_equal(const ca_block_film_desc *a, const ca_block_film_desc *b);
double ca_block_film_bytes(const ca_block_film_desc *desc);

/* Adds to pixel (x, y) of the full film. The gate: values that are not finite, and albedos, normals and positions
 * over 16 times their bound (1, 1, extent) a path, add nothing but their pairs and paths; false is returned so that
 * the caller counts it. Covariances that are no finite floats only mark the pixel. */
bool ca_block_film_add(ca_block_film *film, uint32_t x, uint32_t y, const ca_block_sample *sample);

/* Adds another film of the same description. */
void ca_block_film_add_film(ca_block_film *film, const ca_block_film *other);
/* As if it had got no samples yet. */
void ca_block_film_clear(ca_block_film *film);

/* Mean luminance so far. */
double ca_block_film_mean_luminance(const ca_block_film *film);

/* `threads`: as ca_film_develop. */
ca_status ca_block_film_develop(const ca_block_film *film, uint32_t threads, ca_image_layers **layers,
                                ca_error *error);

/* Sums as bytes, row by row of the crop, the same on every machine: a multiple of 8. Reading replaces the row. */
size_t ca_block_film_row_bytes(const ca_block_film_desc *desc);
void ca_block_film_write_row(const ca_block_film *film, uint32_t row, unsigned char *bytes);
void ca_block_film_read_row(ca_block_film *film, uint32_t row, const unsigned char *bytes);
void ca_block_film_add_row(ca_block_film *film, uint32_t row, const unsigned char *bytes);

#endif
