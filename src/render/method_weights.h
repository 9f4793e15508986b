/* What the error of a pixel counts where methods are compared: over its squared luminance plus
 * CA_METHOD_LEAST_SQUARE, as in relMSE (metrics/compare.h). The luminance is the one that trials have found so far,
 * by cells. */
#ifndef CA_RENDER_METHOD_WEIGHTS_H
#define CA_RENDER_METHOD_WEIGHTS_H

#include "render/method_trial.h"

#define CA_METHOD_LEAST_SQUARE 0.01

typedef struct ca_method_weights {
    const ca_render_plan *plan;
    ca_trial_cells cells;
    double *weights, *luminance; /* owned; of the cells; luminance without what is shown (shown_light.h) */
} ca_method_weights;

/* All weights are 0. After an error nothing is left to destroy. */
ca_status ca_method_weights_create(ca_method_weights *weights, const ca_render_plan *plan, ca_error *error);
void ca_method_weights_destroy(ca_method_weights *weights);

/* From `count` trials with an iteration each, at least: those whose methods find all light, or all where none does.
 * Errors: CA_ERROR_MEMORY. */
ca_status ca_method_weights_set(ca_method_weights *weights, const ca_method_trial *trials, uint32_t count,
                                ca_error *error);

/* Of pixel (x, y) of the plan's full film; `weights` is a ca_method_weights. */
double ca_method_weight_at(const void *weights, uint32_t x, uint32_t y);
double ca_method_luminance_at(const void *weights, uint32_t x, uint32_t y);

#endif
