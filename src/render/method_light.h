/* What the light pilot tells of a method: does it lose light, and how noisy is what a trial is too short to see? Pure
 * functions of the pilot's samples.
 *
 * A sample of the pilot stands for light y of a camera path's pixel (y: its weighted luminance) and for a number of
 * samples of the render (light_pilot.h); each of these brings y times T / Q, where T and Q are the samples of the
 * path that the pilot and the method make per camera path. The second moment of a pixel in an iteration is then the
 * mean of y^2 T / Q over the pilot's camera paths: also for light that a short trial is not expected to meet, whose
 * trial looks quiet and is not. Of what is no dot, the square is its mean's and not variance: such samples do not
 * count. */
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

/* The variance, of an iteration of the render, that light brings which is too rare for a trial: in the mean over
 * the picture's pixels, each times weight(user, x, y), about one over its squared luminance. `samples` in the order
 * of ca_lost_light; `camera_paths`: of the pilot; `expected_scale`: samples that the whole render makes for each
 * that an iteration makes of a pilot's camera path (passes x N_B x pixels / camera paths); `trial`: the trial's
 * camera paths over the render's; N_B: camera paths of a pixel in a pass. */
typedef struct ca_unseen_light {
    double camera_paths, expected_scale, trial, paths_of_pixel;
    double (*weight)(const void *user, uint32_t x, uint32_t y);
    const void *user;
} ca_unseen_light;
double ca_method_unseen(const ca_light_sample *samples, size_t count, const ca_unseen_light *unseen);

#endif
