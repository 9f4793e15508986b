/* One picture for each technique: what it finds, what it counts for, and how much it was weighted; to see why an
 * image is noisy.
 *
 * Indexed by (technique, s, t), both up to CA_TECHNIQUE_MAX_VERTICES. Pictures are made when the first value arrives.
 * Threads: add to different pixels at once. State: 48 bytes a pixel and technique. */
#ifndef CA_FILM_TECHNIQUE_IMAGES_H
#define CA_FILM_TECHNIQUE_IMAGES_H

#include "base/status.h"
#include "math/rgb.h"
#include "path/technique.h"

typedef struct ca_technique_images ca_technique_images;

/* Paths of more vertices are refused when a render with technique images is planned. */
enum { CA_TECHNIQUE_MAX_VERTICES = 14, CA_TECHNIQUE_FILE_SIZE = 64 };

ca_status ca_technique_images_create(ca_technique_images **images, const uint32_t crop[4], ca_error *error);
void ca_technique_images_destroy(ca_technique_images *images); /* NULL is allowed */

/* A contribution to pixel (x, y) of the full film; `unweighted` times weight is what the image got. Lack of memory is
 * remembered, and reported by ca_technique_images_write. */
void ca_technique_images_add(ca_technique_images *images, ca_technique technique, uint32_t s, uint32_t t, uint32_t x,
                             uint32_t y, ca_rgb unweighted, float weight);

/* What was added so far stays. The other takes out again what was added since. Both: no thread adds meanwhile. */
void ca_technique_images_keep(ca_technique_images *images);
void ca_technique_images_restore(ca_technique_images *images);

void ca_technique_images_size(const ca_technique_images *images, uint32_t *width, uint32_t *height);

/* The sums over all passes of a pixel, counted row by row; false: this technique found nothing anywhere. */
bool ca_technique_images_get(const ca_technique_images *images, ca_technique technique, uint32_t s, uint32_t t,
                             size_t pixel, ca_rgb *unweighted, ca_rgb *weighted);

/* The names of all files that may be written, by their number from 0; false: there are no more. */
bool ca_technique_images_file(uint32_t index, char name[CA_TECHNIQUE_FILE_SIZE]);

/* Writes DIRECTORY/<technique>_s<s>_t<t>_{unweighted,weighted,weight}.exr for every technique that found anything,
 * each divided by `passes`; the weight picture is weighted over unweighted luminance, 0 where nothing was found. The
 * folder is made if it does not exist. The EXR's data window is the crop; its display window ends where the crop
 * does. */
ca_status ca_technique_images_write(const ca_technique_images *images, uint32_t passes, const char *directory,
                                    ca_error *error);

#endif
