/* What iterations with rays "auto" have told of each pixel's noise: the coefficients of the law (noise/components.h),
 * means over iterations. Each iteration counts for its N_F N_B pairs of paths, since the more pairs the more it
 * tells.
 *
 * State: 24 bytes a pixel. The coefficients are kept as differences, C - L^2 and so on, in which nothing is left to
 * cancel: a float's 6e-8 is far below their standard errors, which are 1e-3 and more. */
#ifndef CA_RENDER_AUTO_KNOWN_H
#define CA_RENDER_AUTO_KNOWN_H

#include "film/pair_film.h"
#include "image/layers.h"
#include "noise/ray_numbers.h"

typedef struct ca_auto_known {
    float luminance, luminance2;
    float pair, camera, light; /* C - L^2, B - L^2, F - L^2 */
    float weight;              /* pairs of paths; 0: nothing is known */
} ca_auto_known;

/* Objective and choice average over 5 x 5 pixels: with fewer, the choice follows the noise of the estimates. */
enum { CA_AUTO_SMOOTHING = 2 };

/* What some iterations with the same numbers of paths have gathered. */
typedef struct ca_auto_gathered {
    const ca_pair_film *pairs; /* means */
    uint32_t iterations;
    uint32_t light_paths;
    const uint32_t *camera_paths; /* N_B(p) */
    bool one_camera_path;         /* ppm: F is not estimated and not needed, its term has the factor 0 */
} ca_auto_gathered;

/* Adds it. A single iteration tells nothing, nor does one camera path of a pixel of others than ppm: F cannot be
 * estimated from it. */
void ca_auto_known_add(ca_auto_known *known, const ca_auto_gathered *gathered);

/* The estimates as noise/ray_numbers.h wants them; times are not set. */
ca_ray_pixel ca_auto_known_estimates(const ca_auto_known *known);

/* The law's variance of an iteration with these numbers, mean over pixels, over the squared mean luminance. Signs are
 * kept and nothing is smoothed, so the mean has no bias and may be negative. NAN: the image is black. */
double ca_auto_known_relative_variance(const ca_auto_known *known, size_t count, double light_paths,
                                       const uint32_t *camera_paths);

/* Layers Noise.Camera, Noise.Light, Noise.Pair (noise/layers.h): the law's terms for an iteration with these numbers;
 * none where nothing is known. */
ca_status ca_auto_known_add_layers(const ca_auto_known *known, double light_paths, const uint32_t *camera_paths,
                                   ca_image_layers *image, ca_error *error);

#endif
