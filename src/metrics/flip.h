/* FLIP: how different two pictures look to a person who flips between them.
 *
 * LDR: Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild 2020, "FLIP: A Difference Evaluator for
 * Alternating Images". HDR: Andersson, Nilsson, Shirley and Akenine-Möller 2021, "Visualizing Errors in Rendered High
 * Dynamic Range Images". Steps, constants and filters (separable since its version 1.2) are those of the authors'
 * program, release 1.7 (github.com/NVlabs/flip, cpp/FLIP.h):
 *
 *   colour   linear [0, 1] RGB to Y Cx Cz; each filtered by the contrast sensitivity of the eye at
 * `pixels_per_degree`; clipped to the RGB cube; to L*a*b*; a* and b* times L* / 100 (Hunt); the distance |dL| + |d(a,
 * b)|, to the power 0.7, stretched over [0, 1] so that 0.4 of the largest comes to 0.95 feature  edges and points of
 * Y by the first and second derivative of a Gaussian 0.082 degrees wide; the larger of the two differences / sqrt(2),
 * to the power 0.5 FLIP     colour^(1 - feature), in [0, 1]; 0 where nothing differs
 *
 * HDR: the largest LDR map over exposures evenly spaced in stops, from the one where the reference's brightest pixel
 * reaches 0.85 under the tone curve to the one where its median luminance does; max(2, ceil(stop - start)) of them.
 *
 * Filters see the border's pixels repeated beyond it. Maps do not depend on the number of threads. */
#ifndef CA_METRICS_FLIP_H
#define CA_METRICS_FLIP_H

#include "base/parallel.h"
#include "metrics/tone.h"

/* A display of 0.7 m and 3840 pixels seen from 0.7 m: (0.7 x 3840 / 0.7) pi / 180. */
#define CA_FLIP_PIXELS_PER_DEGREE 67.02064327658225
/* Below, the filters are narrower than a pixel; above, wider than any picture. */
#define CA_FLIP_MIN_PIXELS_PER_DEGREE 1.0
#define CA_FLIP_MAX_PIXELS_PER_DEGREE 10000.0

/* Linear R G B, finite; width * height values each, borrowed. */
typedef struct ca_flip_pictures {
    const float *image[3], *reference[3];
} ca_flip_pictures;

typedef struct ca_flip_exposures {
    double start, stop; /* stops: the picture is multiplied by 2^exposure */
    uint32_t count;
} ca_flip_exposures;

/* Filters and memory for pictures of one size. */
typedef struct ca_flip ca_flip;

/* `parallel` is borrowed for the life of `flip`. Errors: CA_ERROR_ARGUMENT (pixels per degree out of the range
 * above), CA_ERROR_MEMORY. Memory: 28 bytes a pixel. */
ca_status ca_flip_create(uint32_t width, uint32_t height, double pixels_per_degree, const ca_parallel *parallel,
                         ca_flip **flip, ca_error *error);
void ca_flip_destroy(ca_flip *flip);

/* The LDR map of both pictures under a tone curve and an exposure. Errors, also of the next: as ca_parallel_for. */
ca_status ca_flip_ldr(ca_flip *flip, const ca_flip_pictures *pictures, ca_tone_curve tone, double exposure,
                      float *map, ca_error *error);

/* Fills in what is NAN (start, stop) or 0 (count) from the reference. false where that cannot be done: the
 * reference's largest or median luminance is not above 0. Errors: CA_ERROR_ARGUMENT (start after stop),
 * CA_ERROR_MEMORY. */
ca_status ca_flip_choose_exposures(const float *const reference[3], size_t pixels, ca_tone_curve tone,
                                   ca_flip_exposures *exposures, bool *known, ca_error *error);

/* The HDR map, and in `exposure_map` the exposure at which each pixel differs most, the first of equals. */
ca_status ca_flip_hdr(ca_flip *flip, const ca_flip_pictures *pictures, ca_tone_curve tone,
                      const ca_flip_exposures *exposures, float *map, float *exposure_map, ca_error *error);

#endif
