/* Layers of confidence intervals (confidence.h), of one channel C: ConfidenceLow.C, ConfidenceHigh.C, from minus to
 * plus infinity where the pixel is marked; ConfidenceWidened.C, 1 where the interval is widened, else 0. */
#ifndef CA_FILM_INTERVAL_LAYERS_H
#define CA_FILM_INTERVAL_LAYERS_H

#include "film/confidence.h"
#include "image/layers.h"

typedef struct ca_interval_layers {
    float *low, *high, *widened; /* borrowed from the layers */
} ca_interval_layers;

ca_status ca_interval_layers_add(ca_interval_layers *intervals, ca_image_layers *layers, char channel,
                                 ca_error *error);
/* Pixel i's; `quantile` is Student's for its degrees of freedom. */
void ca_interval_layers_set(const ca_interval_layers *intervals, size_t i, const ca_moments *moments,
                            const ca_verdict *verdict, double quantile);

/* Fractions of the pixels whose luminance is marked, and whose interval of luminance is widened; false where a
 * picture has no such layers. */
bool ca_interval_layers_shares(const ca_image_layers *layers, double *marked, double *widened);

#endif
