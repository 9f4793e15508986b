/* Splats as what light paths bring alone (pair_sums.h): of an iteration, sorted by the pixel that they lie in, so
 * that a pixel finds those that the filter spreads onto it.
 *
 * State: 32 bytes a splat and 4 a pixel. Cost: about 20 ns a splat to sort and 5 for each pixel that it is spread
 * onto. Threads: clear, add and sort on one; gathering on many. */
#ifndef CA_FILM_PAIR_SPLATS_H
#define CA_FILM_PAIR_SPLATS_H

#include "film/pair_sums.h"
#include "film/splats.h"

typedef struct ca_pair_splat {
    ca_vec2 film; /* position in pixels of the full film */
    float luminance;
    uint32_t light_path; /* numbered from 0 within the iteration */
} ca_pair_splat;

typedef struct ca_pair_splats {
    const ca_filter *filter;
    int64_t x0, y0; /* of the pixels here: the rendered ones, and those around from which the filter reaches them */
    uint32_t width, height;
    ca_pair_splat *items;      /* owned; as they came */
    size_t count, capacity;
    ca_pair_splat *sorted;     /* owned; by pixel, in the order of the items */
    size_t sorted_capacity;
    uint32_t *starts;          /* owned; pixel p has sorted[starts[p]] to sorted[starts[p + 1]] */
} ca_pair_splats;

ca_status ca_pair_splats_create(ca_pair_splats *splats, const uint32_t crop[4], const ca_filter *filter,
                                ca_error *error);
void ca_pair_splats_destroy(ca_pair_splats *splats);

/* An iteration: splats of lists of light paths, whose numbers count from `first_light_path`; then sorted. */
void ca_pair_splats_clear(ca_pair_splats *splats);
ca_status ca_pair_splats_add(ca_pair_splats *splats, const ca_splat_list *lists, uint32_t list_count,
                             uint32_t first_light_path, ca_error *error);
/* Of one list: splat i is multiplied by scales[i * stride]. */
ca_status ca_pair_splats_add_scaled(ca_pair_splats *splats, const ca_splat_list *list, const float *scales,
                                    uint32_t stride, uint32_t first_light_path, ca_error *error);
ca_status ca_pair_splats_sort(ca_pair_splats *splats, ca_error *error);

/* To the sums of pixel (x, y) of the full film, behind its camera paths: what each splat brings it, spread as
 * ca_splat_buffer_add does. */
void ca_pair_splats_gather(const ca_pair_splats *splats, uint32_t x, uint32_t y, ca_pair_sums *sums);

#endif
