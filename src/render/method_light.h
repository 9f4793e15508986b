/* What the light pilot tells of a method: does it lose light, and how noisy are the dots that it makes? Pure
 * functions of the pilot's samples.
 *
 * A sample of the pilot stands for light y of a camera path's pixel (y: its weighted luminance) and for a number of
 * samples of the render (light_pilot.h); each of these brings y times T / Q, where T and Q are the samples of the
 * path that the pilot and the method make per camera path. The second moment of a pixel in an iteration is then the
 * mean of y^2 T / Q over the pilot's camera paths. Of samples that are dots, much brighter than their pixel, that
 * is variance, and the pilot knows it also of those that are too rare for a trial to meet: a trial without dots
 * looks quiet and is not, one with a dot looks worse than it is. */
#ifndef CA_RENDER_METHOD_LIGHT_H
#define CA_RENDER_METHOD_LIGHT_H

#include "render/lost_light.h"

#include <stdbool.h>

/* Of the picture's rendered part, in pixels of the full film, half open. */
typedef struct ca_light_region {
    uint32_t x0, y0, x1, y1;
} ca_light_region;

/* Will the method lose light that matters: in the whole picture, or in one of its parts (eight by eight)? Counted is
 * what ca_lost_light counts, where several batches agree. `samples` in its order (ca_lost_light sorts them). */
bool ca_method_loses_light(const ca_light_sample *samples, size_t count, const ca_light_region *region);

/* The variance that dots bring to an iteration of the render: in the mean over the picture's pixels, each times
 * weight(user, x, y). A value of a pixel is a dot if its square, times the pixel's weight (about one over its
 * squared luminance), is larger than `square`, and its square counts as far as it is. `camera_paths`: of the pilot;
 * `expected_scale`: samples that the whole render makes for each that an iteration makes of a pilot's camera path
 * (passes x N_B x pixels / camera paths); `paths_of_pixel`: N_B; `light_paths`: N_F over that which the pilot was
 * asked about. What the method does not find at all is lost, and
 * no dot; neither is what is shown, which is as noisy with any method (shown_light.h). */
typedef struct ca_dot_light {
    double square, camera_paths, expected_scale, paths_of_pixel, light_paths;
    double (*weight)(const void *user, uint32_t x, uint32_t y);
    const void *user;
} ca_dot_light;
double ca_method_dots(const ca_light_sample *samples, size_t count, const ca_dot_light *light);

#endif
