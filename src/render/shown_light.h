/* A pilot of the noise that every method has: that of lights which camera paths see as they are, at once or by Dirac
 * events alone (mirrors, clear glass). No other technique finds this light, so that its variance is the same for all
 * methods, and the more of it there is, the more the time of a pass decides which is best.
 *
 * Most of it lies where few of a pixel's camera paths meet a light: at the rim of a lamp, and where the filter's end
 * reaches a highlight. Trials of some thousand pixels do not meet these. Here every camera path counts for all pixels
 * whose filters reach its film position, with the density with which they would have sampled it.
 *
 * A function of scene, settings, seed and `camera_paths`; one thread traces, with random numbers of its own. */
#ifndef CA_RENDER_SHOWN_LIGHT_H
#define CA_RENDER_SHOWN_LIGHT_H

#include "render/render.h"

/* A pixel of the full film that sees a light: mean and mean square of what a camera path brings (luminance). */
typedef struct ca_shown_pixel {
    uint32_t x, y;
    double mean, square;
} ca_shown_pixel;

typedef struct ca_shown_light {
    ca_shown_pixel *pixels; /* owned */
    size_t count, capacity;
    double looked_at; /* pixels, those that see none included */
} ca_shown_light;

/* With about so many camera paths, in squares of the rendered part: in all of them where there are enough paths. An
 * empty `shown`. Errors: CA_ERROR_MEMORY; after one nothing is left to destroy. */
ca_status ca_shown_light_find(ca_shown_light *shown, const ca_render_plan *plan, double camera_paths,
                              ca_error *error);
void ca_shown_light_destroy(ca_shown_light *shown);

/* The variance of an iteration with so many camera paths per pixel, in the mean over pixels, each over its squared
 * luminance plus `least_square`; luminance(user, x, y): of the pixel's other light. */
typedef struct ca_shown_scale {
    double paths_of_pixel, least_square;
    double (*luminance)(const void *user, uint32_t x, uint32_t y);
    const void *user;
} ca_shown_scale;
double ca_shown_light_variance(const ca_shown_light *shown, const ca_shown_scale *scale);

#endif
