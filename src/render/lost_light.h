/* What a render is likely to miss, from a pilot's samples of all light there is. Pure functions.
 *
 * A sample of the pilot stands for some light of the image, and for a number of samples that the render's method is
 * expected to make of the paths around it (light_pilot.h). Their ratio is the light that one sample of the render
 * brings there. The samples are sorted by it, the most light first. Lost is the light of the first ones, as long as
 * the whole render is expected to make less than one sample of them all together. So paths that the method cannot
 * make are lost, whatever their light. A caustic is lost where no sample of it is expected; where many are, it is
 * noise that the picture shows, and only a small share is lost. The number does not depend on how the paths are
 * divided into kinds. */
#ifndef CA_RENDER_LOST_LIGHT_H
#define CA_RENDER_LOST_LIGHT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct ca_light_sample {
    double light;    /* of the image, in any unit; > 0 */
    double expected; /* samples of the method in the whole render */
    double splats;   /* those of them that are in proportion to the number of light paths; 0: not asked for */
    bool shown;      /* the light of the picture that all methods find alike: seen at once or by Dirac events alone */
    uint32_t batch;
    uint32_t x, y; /* pixel of the full film that gets it */
} ca_light_sample;

/* A ratio of two sums over batches that are independent and alike, with its 95 % interval (Student's t on the
 * residuals of the batches). All NAN where the divisors' sum is 0. */
typedef struct ca_batch_ratio {
    double value, low, high;
} ca_batch_ratio;

/* `batches` >= 2. */
ca_batch_ratio ca_batch_ratio_of(const double *parts, const double *wholes, uint32_t batches);

enum { CA_LIGHT_BATCHES = 16 };

/* The share of the light that is lost, limits within [0, 1]. Brings the samples into an order that depends on their
 * values alone, so that the result does not depend on theirs. */
ca_batch_ratio ca_lost_light(ca_light_sample *samples, size_t count);

#endif
