/* The plan of a render for measuring noise: one radius, independent paths, iterations that can be counted. Internal
 * to this folder. */
#ifndef CA_RENDER_NOISE_PLAN_H
#define CA_RENDER_NOISE_PLAN_H

#include "film/pair_film.h"
#include "render/render.h"

/* Numbers of paths whose weights are measured with, at most. */
enum { CA_NOISE_MOST_OTHERS = 64 };
/* Estimates are averaged over 3 x 3 pixels. */
enum { CA_NOISE_SMOOTHING = 1 };

/* Not copied, for the plan points into it. */
typedef struct ca_noise_plan {
    ca_render_plan plan;
    ca_render_settings settings; /* the caller's, completed */
    const ca_render_settings *given;
    uint32_t light_paths;  /* N_F; N_B is plan.camera_paths */
    bool connects;         /* its camera paths connect to light paths */
    bool instead_of_scene; /* the default integrator, though the scene names another */
    bool ended;            /* by the caller's callback */
    ca_pair_numbers others[CA_NOISE_MOST_OTHERS]; /* whose weights are measured with, too */
    uint32_t other_count;
} ca_noise_plan;

/* All that can be wrong with the settings, before any work: errors as of ca_noise_measure. */
ca_status ca_noise_plan_make(ca_noise_plan *p, const ca_scene *scene, const ca_render_settings *given,
                             uint32_t iterations, ca_error *error);
/* Where paths connect: with the weights of these numbers, too. Those that are the plan's own, or come again, are left
 * out. */
ca_status ca_noise_plan_add_others(ca_noise_plan *p, const ca_noise_counts *counts, size_t count, ca_error *error);

#endif
