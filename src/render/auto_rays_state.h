/* What the pieces of a render with rays "auto" share: auto_rays.c (life, image), auto_rays_pilot.c,
 * auto_rays_phases.c, auto_rays_phase.c (one of these), auto_rays_choice.c (from estimates to numbers),
 * auto_rays_batch.c (iterations). */
#ifndef CA_RENDER_AUTO_RAYS_STATE_H
#define CA_RENDER_AUTO_RAYS_STATE_H

#include "render/auto_rays.h"
#include "render/noise_looks.h"
#include "render/pass.h"

enum { CA_AUTO_RAMP, CA_AUTO_ORDINARY }; /* groups */

/* One of the pilot's two halves: everything that is made of its samples. */
typedef struct ca_auto_half {
    ca_film films[CA_AUTO_GROUPS];
    ca_pair_film pairs;
    ca_ray_times *times;
    double plain_seconds; /* of the clock, of ordinary iterations that gathered no pairs ... */
    uint32_t plain_count; /* ... and how many these are */
    double gain; /* efficiency of the numbers that its estimates ask for over the pilot's, by its estimates */
    double seconds_per_sample; /* of a render with these numbers, by its estimates: per camera path of every pixel */
} ca_auto_half;

/* What is known of a pixel's noise (noise/components.h): means over iterations, each of which counts for its pairs of
 * paths, since the more pairs the more one tells. */
typedef struct ca_auto_known {
    double value, pair, camera, light, luminance2;
    double weight;
} ca_auto_known;

/* Iterations of the pilot, half of them of each half: of the ordinary ones all have the same numbers, of the ramp
 * only two. */
typedef struct ca_auto_group {
    uint32_t light_paths, camera_paths; /* of those at work, or of the last ones */
    uint32_t iterations;
    double variances; /* sum over iterations of 1 / sqrt(N_F N_B): what their variances are taken for */
} ca_auto_group;

typedef struct ca_auto_rays {
    ca_render_plan *plan;
    const ca_auto_observer *observer;
    ca_auto_half halves[CA_AUTO_HALVES];
    ca_auto_group groups[CA_AUTO_GROUPS];
    bool given; /* are the pilot's numbers somebody's wish? */
    ca_film phase, image;          /* samples of the phase at work; what the image is developed from */
    ca_joined_film render, joined; /* the phases before, times their shares; all */
    double shares, phase_share;    /* sum of the shares in `render`; of the phase at work, 0: none */
    double share_of_work;          /* of a unit of work in a phase that is worth its work */
    ca_pair_film gathered; /* what an integrator fills: borrows its pixels from the half whose turn it is; in phases
                              the first */
    ca_auto_known *known;          /* owned; of each pixel */

    /* Of the iterations at work: */
    uint32_t light_paths, *numbers, *first; /* N_F; N_B(p) and the number of the next camera path, owned */
    uint32_t most;                          /* largest N_B(p) */
    double mean_numbers;                    /* mean N_B(p) */
    uint64_t first_light_path;

    uint32_t iterations, render_iterations, phases;
    double camera_paths; /* of a pixel on average, so far */
    double numbered;     /* the largest number that a camera path can have, so far */
    double start, seconds, pilot_seconds, pilot_work;
    uint32_t timed_light_paths; /* N_F at which times were measured last */
    double plain_seconds;  /* of the clock, of an iteration without pairs with the numbers in use; 0: not known */
    double speed;          /* seconds of the clock for one of the processors' by the costs */
    double predicted_gain; /* over the pilot's numbers */
    double surprise;       /* relative variance that the last phase had, over what the law had said of it */
    double measured; /* relative variance x seconds of an iteration of the last phase, by its samples; 0: not known */
    double worth_before;   /* precision of all before the phase at work, in its iterations */
    ca_ray_costs costs;
    ca_noise_looks looks;
    ca_render_statistics counts; /* of workers that are gone */
    bool interrupted;
} ca_auto_rays;

/* What ends the render, in seconds or in camera paths of a pixel: how much of it is done, and where it ends
 * (INFINITY: at a noise target). */
double ca_auto_work(const ca_auto_rays *a);
double ca_auto_work_end(const ca_auto_rays *a);
/* Is there a reason to end the render before that: the caller's wish, a limit of time, noise that is low enough, no
 * numbers left for camera paths? */
bool ca_auto_is_over(const ca_auto_rays *a);
static inline bool ca_auto_by_samples(const ca_auto_rays *a) { return !a->plan->open_ended; }

/* ---- Iterations ------------------------------------------------------------------------------------------------ */

/* Iterations with the same numbers: those of `a` when it began. */
typedef struct ca_auto_batch {
    void *integrator;
    ca_pass_runner runner;
    ca_pass_counts counts;
    uint32_t passes;
} ca_auto_batch;

ca_status ca_auto_batch_begin(ca_auto_rays *a, ca_auto_batch *batch, ca_error *error);
/* One more iteration; `pairs` and `times` may be NULL. *seconds: of the clock. */
ca_status ca_auto_batch_run(ca_auto_rays *a, ca_auto_batch *batch, ca_film *film, ca_pair_film *pairs,
                            ca_ray_times *times, double *seconds, ca_error *error);
/* Also after an error in a call of the others. */
void ca_auto_batch_end(ca_auto_rays *a, ca_auto_batch *batch);
void ca_auto_set_uniform(ca_auto_rays *a, uint32_t light_paths, uint32_t camera_paths);

/* ---- Numbers --------------------------------------------------------------------------------------------------- */

typedef struct ca_auto_choice {
    ca_ray_numbers numbers;
    double relative_variance; /* of an iteration's pixel, mean over pixels, over the image's squared mean: by the
                                 estimates, maybe negative */
} ca_auto_choice;

/* Sets a->known from pairs of the pilot's ordinary iterations. */
void ca_auto_know(ca_auto_rays *a, const ca_pair_film *pairs);
/* Adds what iterations with the numbers in use tell: of pixels with more than one camera path, since one tells
 * nothing of F, unless none asks for it; a film of a single iteration tells nothing. */
void ca_auto_know_more(ca_auto_rays *a, const ca_pair_film *pairs);

/* What to choose from, and how far to go. */
typedef struct ca_auto_question {
    unsigned halves;     /* a bit for each half whose times count */
    uint32_t smoothing;  /* as of ca_ray_settings */
    uint32_t iterations; /* of numbers of which the rest of the render would have fewer iterations than this, none are
                            chosen */
    uint32_t reach;      /* N_F is at most so many times the one at which times were measured last */
} ca_auto_question;

/* From what is known. */
ca_status ca_auto_choose(ca_auto_rays *a, const ca_auto_question *question, ca_auto_choice *choice, ca_error *error);
/* Layers Noise.Camera, Noise.Light, Noise.Pair: what is known, as variances of an iteration with the numbers in use
 * (noise/layers.h); none where nothing is known. */
ca_status ca_auto_add_terms(const ca_auto_rays *a, ca_image_layers *image, ca_error *error);
/* Renders with them from now on; takes the map over. */
void ca_auto_use(ca_auto_rays *a, ca_auto_choice *choice);

/* ---- A phase --------------------------------------------------------------------------------------------------- */

/* Iterations of R with the same numbers; what is 0 is not wanted. */
typedef struct ca_auto_phase {
    double begin, end;   /* of work */
    double worth;        /* of its work in the image, over that of other phases */
    double expected;     /* of an iteration's relative variance, by the law; 0: nothing */
    uint32_t least,
        most;            /* iterations to end after at the earliest, 2 where 0, and at the latest, 0: not by number */
    uint32_t iterations; /* so far */
    bool revise;         /* are pairs and times wanted for the numbers of the next one? */
    bool looks;          /* is it looked at the noise? Else, to a target, only where it may be reached already: */
    uint32_t next_glance;
    uint32_t paired, plain;
    double seconds, plain_seconds;
} ca_auto_phase;

/* Runs it with the numbers in use; it has two iterations at least, since before its second one it does not know its
 * noise. */
ca_status ca_auto_phase_run(ca_auto_rays *a, ca_auto_phase *phase, ca_error *error);
/* Relative variance of an iteration of the phase that ran last, by its samples; NAN: not known. */
double ca_auto_phase_variance(const ca_auto_rays *a);
/* A phase that is done becomes a part of R, with its share; what its pairs tell joins what is known. */
void ca_auto_phase_keep(ca_auto_rays *a);

/* ---- The stages ------------------------------------------------------------------------------------------------ */

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
/* Looks at the image so far, for a->looks as well: its relative standard error, percent; NAN: not known. */
double ca_auto_noise(ca_auto_rays *a);

#endif
