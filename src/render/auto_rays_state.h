/* What the pieces of a render with rays "auto" share: auto_rays.c (life, image), auto_rays_pilot.c, auto_rays_phases.c,
 * auto_rays_choice.c (from estimates to numbers), auto_rays_batch.c (iterations). */
#ifndef CA_RENDER_AUTO_RAYS_STATE_H
#define CA_RENDER_AUTO_RAYS_STATE_H

#include "render/auto_rays.h"
#include "render/noise_looks.h"
#include "render/pass.h"

enum { CA_AUTO_CHEAP, CA_AUTO_ORDINARY }; /* groups */

/* One of the pilot's two halves: everything that is made of its samples. */
typedef struct ca_auto_half {
    ca_film films[CA_AUTO_GROUPS];
    ca_pair_film pairs;
    ca_ray_times *times;
    double plain_seconds; /* of the clock, of ordinary iterations that gathered no pairs ... */
    uint32_t plain_count; /* ... and how many these are */
    double gain;          /* efficiency of the numbers that its estimates ask for over the pilot's, by its estimates */
    double seconds_per_sample; /* of a render with these numbers, by its estimates: per camera path of every pixel */
} ca_auto_half;

/* Iterations of the pilot with the same numbers, half of them of each half. */
typedef struct ca_auto_group {
    uint32_t light_paths, camera_paths, iterations;
} ca_auto_group;

typedef struct ca_auto_rays {
    ca_render_plan *plan;
    const ca_auto_observer *observer;
    ca_auto_half halves[CA_AUTO_HALVES];
    ca_auto_group groups[CA_AUTO_GROUPS];
    ca_film phase, image;          /* samples of the phase at work; what the image is developed from */
    ca_joined_film render, joined; /* the phases before, times their shares; all */
    double shares, phase_share;    /* sum of the shares in `render`; of the phase at work, 0: none */
    ca_pair_film gathered;         /* what an integrator fills: borrows its pixels from the half or phase whose turn it is */

    /* Of the iterations at work: */
    uint32_t light_paths, *numbers, *first; /* N_F; N_B(p) and the number of the next camera path, owned */
    uint32_t most;                          /* largest N_B(p) */
    double mean_numbers;                    /* mean N_B(p) */
    uint64_t first_light_path;

    uint32_t iterations, render_iterations, phases;
    double camera_paths; /* of a pixel on average, so far */
    double numbered;     /* the largest number that a camera path can have, so far */
    double start, seconds, pilot_seconds, pilot_work, render_seconds;
    double speed;          /* seconds of the clock for one of the processors' by the costs */
    double predicted_gain; /* over the pilot's numbers */
    double pilot_worth;    /* the pilot's precision, in iterations of the render */
    ca_ray_costs costs;
    ca_noise_looks looks;
    ca_render_statistics counts; /* of workers that are gone */
    bool interrupted;
} ca_auto_rays;

/* What ends the render, in seconds or in camera paths of a pixel: how much of it is done, and where it ends (INFINITY: at a noise
 * target). */
double ca_auto_work(const ca_auto_rays *a);
double ca_auto_work_end(const ca_auto_rays *a);
/* Is there a reason to end the render before that: the caller's wish, a limit of time, noise that is low enough, no numbers left for
 * camera paths? */
bool ca_auto_is_over(const ca_auto_rays *a);
static inline bool ca_auto_by_samples(const ca_auto_rays *a) { return !a->plan->open_ended; }

/* ---- Iterations ----------------------------------------------------------------------------------------------------- */

/* Iterations with the same numbers: those of `a` when it began. */
typedef struct ca_auto_batch {
    void *integrator;
    ca_pass_runner runner;
    ca_pass_counts counts;
    uint32_t passes;
} ca_auto_batch;

ca_status ca_auto_batch_begin(ca_auto_rays *a, ca_auto_batch *batch, ca_error *error);
/* One more iteration; `pairs` and `times` may be NULL. *seconds: of the clock. */
ca_status ca_auto_batch_run(ca_auto_rays *a, ca_auto_batch *batch, ca_film *film, ca_pair_film *pairs, ca_ray_times *times,
                            double *seconds, ca_error *error);
/* Also after an error in a call of the others. */
void ca_auto_batch_end(ca_auto_rays *a, ca_auto_batch *batch);
void ca_auto_set_uniform(ca_auto_rays *a, uint32_t light_paths, uint32_t camera_paths);
/* Would the light paths of an iteration fit the memory? */
ca_status ca_auto_fits(ca_auto_rays *a, uint32_t light_paths, bool *fits, ca_error *error);

/* ---- Numbers --------------------------------------------------------------------------------------------------------- */

typedef struct ca_auto_choice {
    ca_ray_numbers numbers;
    double relative_variance; /* of an iteration's pixel, mean over pixels, over the image's squared mean: by the estimates, maybe negative */
} ca_auto_choice;

/* From `pairs`, and the times of the halves of which bits are set. `smoothing` as of ca_ray_settings. Numbers of which
 * the rest of the render would have few iterations are not chosen. */
ca_status ca_auto_choose(ca_auto_rays *a, const ca_pair_film *pairs, unsigned halves, uint32_t smoothing, ca_auto_choice *choice,
                         ca_error *error);
/* Renders with them from now on; takes the map over. */
void ca_auto_use(ca_auto_rays *a, ca_auto_choice *choice);

/* ---- The stages ------------------------------------------------------------------------------------------------------ */

ca_status ca_auto_pilot_plan(ca_auto_rays *a, ca_error *error); /* numbers of its groups; refuses before any work */
ca_status ca_auto_pilot_run(ca_auto_rays *a, ca_error *error);
ca_status ca_auto_phases_run(ca_auto_rays *a, ca_error *error);

/* After every iteration: tells the caller; sets `interrupted`. */
void ca_auto_report(ca_auto_rays *a);
/* Joins all parts so far into a->joined and fills a->image. */
void ca_auto_join(ca_auto_rays *a);
/* Share of a group in its half's mean. */
double ca_auto_group_share(const ca_auto_rays *a, int group);
/* The pilot's precision in ordinary iterations. */
double ca_auto_pilot_iterations(const ca_auto_rays *a);

#endif
