/* The two pictures of a comparison, and which of their pixels count: those of the region that no mask covers and that
 * are finite in both.
 *
 * All data is borrowed from the layers and settings that the pair was opened with. All functions are pure. */
#ifndef CA_METRICS_PICTURE_PAIR_H
#define CA_METRICS_PICTURE_PAIR_H

#include "metrics/compare.h"

typedef struct ca_picture_pair {
    const float *image[3], *reference[3]; /* R G B, row 0 on top */
    uint32_t width, height;
    ca_pixel_rect roi; /* the whole picture where none is asked for */
    const ca_pixel_rect *masks;
    size_t mask_count;
} ca_picture_pair;

/* Errors: CA_ERROR_ARGUMENT (different sizes or places, no R G B, an empty region). */
ca_status ca_picture_pair_open(const ca_image_layers *image, const ca_image_layers *reference,
                               const ca_compare_settings *settings, ca_picture_pair *pair, ca_error *error);

bool ca_picture_pair_is_masked(const ca_picture_pair *pair, uint32_t x, uint32_t y);
/* Pixel number `at` = y * width + x, in both pictures. */
bool ca_picture_pair_is_finite(const ca_picture_pair *pair, size_t at);

#endif
