/* The plan of a render for measuring noise: one radius, independent paths, iterations that can be counted. Internal
 * to this folder. */
#ifndef CA_RENDER_NOISE_PLAN_H
#define CA_RENDER_NOISE_PLAN_H

#include "render/render.h"

/* Not copied, for the plan points into it. */
typedef struct ca_noise_plan {
    ca_render_plan plan;
    ca_render_settings settings; /* the caller's, completed */
    const ca_render_settings *given;
    uint32_t light_paths;  /* N_F; N_B is plan.camera_paths */
    bool connects;         /* its camera paths connect to light paths */
    bool instead_of_scene; /* the default integrator, though the scene names another */
    bool ended;            /* by the caller's callback */
} ca_noise_plan;

/* All that can be wrong with the settings, before any work: errors as of ca_noise_measure. */
ca_status ca_noise_plan_make(ca_noise_plan *p, const ca_scene *scene, const ca_render_settings *given,
                             uint32_t iterations, ca_error *error);

#endif
