#include "metrics/picture_pair.h"

#include <math.h>

static ca_status open_colors(const ca_image_layers *layers, const char *what, const float *color[3], ca_error *error)
{
    static const char *const names[3] = {"R", "G", "B"};
    for (int c = 0; c < 3; c++) {
        color[c] = ca_layers_find(layers, names[c]);
        if (!color[c]) return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "the %s has no channel %s", what, names[c]);
    }
    return CA_OK;
}

/* A file that keeps no crop (PNG, PFM) has a picture as large as its data, and tells no place. */
static bool tells_place(const ca_image_layers *layers)
{
    return layers->x0 != 0 || layers->y0 != 0 || layers->full_width != layers->width ||
           layers->full_height != layers->height;
}

/* A picture that ends where its data does may be all that is known of a larger one (images of strategies). */
static bool tells_film(const ca_image_layers *layers)
{
    return (int64_t)layers->x0 + layers->width != layers->full_width ||
           (int64_t)layers->y0 + layers->height != layers->full_height;
}

static bool are_same_part(const ca_image_layers *a, const ca_image_layers *b)
{
    const bool same_place = a->x0 == b->x0 && a->y0 == b->y0;
    if (a->full_width == b->full_width && a->full_height == b->full_height) return same_place;
    if (!tells_place(a) || !tells_place(b)) return true;
    return same_place && !(tells_film(a) && tells_film(b));
}

static ca_status check_sizes(const ca_image_layers *image, const ca_image_layers *reference, ca_error *error)
{
    if (image->width != reference->width || image->height != reference->height)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "the image has %u x %u pixels, the reference %u x %u",
                       image->width, image->height, reference->width, reference->height);
    if (are_same_part(image, reference)) return CA_OK;
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                   "the image and the reference are different parts of the picture: %u x %u pixels from (%d, %d) of "
                   "a film of %u x %u, and from (%d, %d) of one of %u x %u",
                   image->width, image->height, image->x0, image->y0, image->full_width, image->full_height,
                   reference->x0, reference->y0, reference->full_width, reference->full_height);
}

static ca_status resolve_roi(const ca_image_layers *image, const ca_compare_settings *settings, ca_pixel_rect *roi,
                             ca_error *error)
{
    *roi = settings->has_roi ? settings->roi : (ca_pixel_rect){0, 0, image->width, image->height};
    if (roi->x0 < roi->x1 && roi->y0 < roi->y1 && roi->x1 <= image->width && roi->y1 <= image->height) return CA_OK;
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                   "the region %u,%u,%u,%u is empty or reaches out of the %u x %u pixels of the image", roi->x0,
                   roi->y0, roi->x1, roi->y1, image->width, image->height);
}

ca_status ca_picture_pair_open(const ca_image_layers *image, const ca_image_layers *reference,
                               const ca_compare_settings *settings, ca_picture_pair *pair, ca_error *error)
{
    *pair = (ca_picture_pair){.width = image->width,
                              .height = image->height,
                              .masks = settings->masks,
                              .mask_count = settings->mask_count};
    CA_TRY(check_sizes(image, reference, error));
    CA_TRY(open_colors(image, "image", pair->image, error));
    CA_TRY(open_colors(reference, "reference", pair->reference, error));
    return resolve_roi(image, settings, &pair->roi, error);
}

bool ca_picture_pair_is_masked(const ca_picture_pair *pair, uint32_t x, uint32_t y)
{
    for (size_t i = 0; i < pair->mask_count; i++) {
        const ca_pixel_rect *m = &pair->masks[i];
        if (x >= m->x0 && x < m->x1 && y >= m->y0 && y < m->y1) return true;
    }
    return false;
}

bool ca_picture_pair_is_finite(const ca_picture_pair *pair, size_t at)
{
    for (int c = 0; c < 3; c++)
        if (!isfinite(pair->image[c][at]) || !isfinite(pair->reference[c][at])) return false;
    return true;
}
