/* What an image remembers of how it was made: the attributes "caustica.*" (docs/images.md). */
#ifndef CA_RENDER_RECORD_H
#define CA_RENDER_RECORD_H

#include "image/layers.h"

typedef struct ca_render_record {
    const char *version, *scene, *integrator, *sampler, *filter;
    const char *confidence; /* what the error bars are of, or why there are none; NULL: nothing is said */
    double seed, samples_per_pixel, seconds, threads;
    bool by_blocks;
    uint64_t blocks[2]; /* half open; where by_blocks is set */
} ca_render_record;

ca_status ca_render_record_attach(const ca_render_record *record, ca_image_layers *layers, ca_error *error);

#endif
