/* Splats: contributions that light paths make at film positions of their own choosing.
 *
 * They are recorded in lists, one for each block of light paths, and then added to a buffer of one colour a pixel,
 * spread by the reconstruction filter. Records are sorted into bands of rows, which are summed in parallel, each in
 * the order of lists and records, so the buffer does not depend on the number of threads. Sums are of double
 * precision: millions of splats may fall onto one pixel of a small film, and many are alike.
 *
 * State: 28 bytes a record and 8 for each band that it touches, 24 a pixel. */
#ifndef CA_FILM_SPLATS_H
#define CA_FILM_SPLATS_H

#include "base/parallel.h"
#include "base/status.h"
#include "film/technique_images.h"
#include "math/rgb.h"
#include "math/vec.h"
#include "sampling/filter.h"

typedef struct ca_splat {
    ca_vec2 film; /* position in pixels of the full film */
    ca_rgb value; /* weighted contribution to a pixel that sees only this point, not yet over the number of light
                     paths */
    float weight; /* the MIS weight that is in value, > 0 */
    uint32_t light_vertices : 14; /* t of its technique, for technique images */
    uint32_t light_path : 18;     /* number of its light path among those of the lists, for pairs (pair_splats.h) */
} ca_splat;

typedef struct ca_splat_list {
    ca_splat *items; /* owned; grows by ca_splat_list_add */
    size_t count, capacity;
} ca_splat_list;

/* false: out of memory. The position must be finite; what lies off the film adds nothing, or what the filter spreads
 * onto it. */
bool ca_splat_list_add(ca_splat_list *list, const ca_splat *splat);
void ca_splat_list_destroy(ca_splat_list *list);

typedef struct ca_splat_buffer {
    uint32_t x0, y0, width, height; /* the rendered part of the film */
    double *sums;                   /* owned; red, green, blue of each pixel */
    const ca_splat **sorted;        /* owned; records by band, for the time of an addition */
    size_t sorted_capacity;
    uint32_t *starts;               /* owned; where each band of each list begins among them */
    size_t starts_capacity;
} ca_splat_buffer;

ca_status ca_splat_buffer_create(ca_splat_buffer *buffer, const uint32_t crop[4], ca_error *error);
void ca_splat_buffer_destroy(ca_splat_buffer *buffer);
void ca_splat_buffer_clear(ca_splat_buffer *buffer);

/* Adds scale times every splat of the lists, in order. `images`, if not NULL, gets each splat's technique as well.
 * Pixels from whose centre the splat's distance lies in [-radius, radius) on both axes get its value times the filter
 * there: of a box one pixel wide it is the pixel that holds the splat, a border being the right or lower pixel's. The
 * filter's integral is 1; its sum over the pixels around one splat need not be. So a single splat may be thinned or
 * thickened (by up to 3 % with the gaussian, 0.6 % with lanczos), and the average over positions is right. Error:
 * CA_ERROR_MEMORY; nothing is added. */
ca_status ca_splat_buffer_add(ca_splat_buffer *buffer, const ca_splat_list *lists, uint32_t list_count,
                              const ca_filter *filter, float scale, ca_technique_images *images,
                              const ca_parallel *parallel, ca_error *error);

/* Of pixel (x, y) of the full film, which must be inside of the rendered part. */
static inline ca_rgb ca_splat_buffer_at(const ca_splat_buffer *buffer, uint32_t x, uint32_t y)
{
    const double *sum = &buffer->sums[3 * ((size_t)(y - buffer->y0) * buffer->width + (x - buffer->x0))];
    return (ca_rgb){(float)sum[0], (float)sum[1], (float)sum[2]};
}

#endif
