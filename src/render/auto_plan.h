/* A render with rays "auto" after its pilot, decided: pure functions from estimates, costs and what was done so far
 * to the next step. Nothing is rendered, allocated or timed here; auto_rays.h does what is decided.
 *
 *     CHOOSE        find the numbers of paths with the least variance x time, by all estimates so far
 *     CHOOSE_TRIAL  the same, of numbers with short iterations
 *     TRIAL         three iterations with those: pairs and times near the numbers that seem best
 *     VALIDATE      some seconds with the chosen numbers, before the time to a noise target is predicted
 *     PREDICT       look at the noise and predict the time to its target
 *     PHASE         iterations with the chosen numbers
 *
 * in the order
 *
 *     PILOT, CHOOSE, (CHOOSE_TRIAL, TRIAL, CHOOSE) up to three times, CHOOSE where trials did not get there,
 *     VALIDATE where only a noise target ends the render, PREDICT, PHASE, (CHOOSE, PREDICT, PHASE) up to twice, END.
 *
 * The law holds for any numbers of paths, its estimates and the costs do not: where the best numbers have more than
 * twice or less than half the light paths that times were measured with, trials go there. N_F goes no further than
 * sixteen times that number in a trial, four times in a phase.
 *
 * A run (trial, validation or phase) has a share in R, the mean of all runs, in proportion to its work. The share of
 * a unit of work is fixed before the run's first sample: a trial that the law says to be worth less has less, and
 * what it leaves goes to all that follow. Reasons: docs/decisions/012-trials-and-a-validation-run.md. */
#ifndef CA_RENDER_AUTO_PLAN_H
#define CA_RENDER_AUTO_PLAN_H

#include "render/auto_goal.h"

#include <stdint.h>

typedef enum ca_auto_step {
    CA_AUTO_PILOT,
    CA_AUTO_CHOOSE,
    CA_AUTO_CHOOSE_TRIAL,
    CA_AUTO_TRIAL,
    CA_AUTO_VALIDATE,
    CA_AUTO_PREDICT,
    CA_AUTO_PHASE,
    CA_AUTO_END
} ca_auto_step;

enum { CA_AUTO_MOST_PHASES = 3 };

/* Numbers of paths, and what an iteration with them comes to by the law and the costs. */
typedef struct ca_auto_candidate {
    double light_paths, camera_paths; /* N_F; N_B, mean over pixels */
    double cost;                      /* variance x time, of the objective */
    double relative_variance; /* of a pixel, mean over pixels, over the image's squared mean; may be negative */
    double seconds;           /* of the clock */
} ca_auto_candidate;

/* Within what numbers are chosen. */
typedef struct ca_auto_limits {
    uint32_t iterations;      /* the rest of the render has time for at least so many with the chosen numbers */
    double timed_light_paths; /* N_F that times were measured with */
    uint32_t reach;           /* N_F is at most so many times that */
    bool for_a_trial;         /* else no numbers are kept that are predicted to be worse than the pilot's */
} ca_auto_limits;

/* Which numbers a run has. */
typedef enum ca_auto_source { CA_AUTO_BEST, CA_AUTO_TRIED, CA_AUTO_UNCHANGED } ca_auto_source;

/* TRIAL, VALIDATE or PHASE. */
typedef struct ca_auto_run {
    ca_auto_source numbers;
    double begin, end;    /* of work; what lies between counts in R */
    double share;         /* in R, of a unit of that work; the sum of all shares is not 1 */
    uint32_t least, most; /* iterations */
    bool measures;        /* gathers pairs and measures times, for the next choice */
    bool predicts;        /* looks at the noise and predicts the time; else the noise is compared with its target */
    double expected_variance; /* relative, of an iteration, by the law; 0 or less: not known */
} ca_auto_run;

/* What PREDICT takes the iterations to come for. */
typedef struct ca_auto_prediction {
    double relative_variance; /* of an iteration; 0 or less: not known */
    double seconds;           /* of the clock, for an iteration */
} ca_auto_prediction;

/* Phases have shares of 1 : 2 : 4 of the work. */
typedef struct ca_auto_schedule {
    uint32_t count, done;                    /* count 0: not made yet */
    double begin, ends[CA_AUTO_MOST_PHASES]; /* of work; the last end may be INFINITY */
} ca_auto_schedule;

typedef struct ca_auto_situation {
    ca_auto_goal goal;
    ca_auto_progress progress;
    ca_auto_step done;             /* the last step */
    uint32_t reach;                /* of the last choice */
    ca_auto_candidate best, tried; /* of the last CHOOSE, CHOOSE_TRIAL */
    double timed_light_paths;      /* N_F that times were measured with last */
    uint32_t trials;               /* that were made */
    bool validated;
    ca_auto_schedule schedule;
    double share; /* in R, of a unit of the work to come */
    /* The run before: */
    double measured_variance; /* relative, of an iteration, by its samples; 0: not known */
    double law_error;         /* that over what the law expected; 1: not known */
    double iteration_seconds; /* of the clock */
    double plain_seconds;     /* likewise, without gathering pairs, if it measured */
} ca_auto_situation;

typedef struct ca_auto_decision {
    ca_auto_step step;
    ca_auto_limits limits;         /* of CHOOSE, CHOOSE_TRIAL */
    ca_auto_run run;               /* of TRIAL, VALIDATE, PHASE */
    ca_auto_schedule schedule;     /* of PHASE: as it is when the phase has ended */
    ca_auto_prediction prediction; /* of PREDICT */
} ca_auto_decision;

/* What came of a step; what a step does not tell is not read. */
typedef struct ca_auto_outcome {
    ca_auto_progress progress;
    ca_auto_candidate candidate;             /* of CHOOSE, CHOOSE_TRIAL */
    double light_paths;                      /* N_F of a run */
    double relative_variance;                /* of an iteration, by its samples; NAN: not known */
    double iteration_seconds, plain_seconds; /* as in the situation */
} ca_auto_outcome;

/* The situation at the pilot's end. */
ca_auto_situation ca_auto_plan_start(const ca_auto_goal *goal, const ca_auto_progress *progress, double light_paths);
ca_auto_decision ca_auto_decide(const ca_auto_situation *situation);
/* A decision whose run goes on to another goal: a phase ends no later than the render, the last one with it. */
ca_auto_decision ca_auto_decision_to(const ca_auto_decision *decision, const ca_auto_goal *goal);
/* The situation after a step. */
ca_auto_situation ca_auto_note(const ca_auto_situation *situation, const ca_auto_decision *decision,
                               const ca_auto_outcome *outcome);

/* Are all choices made that come before the render's own iterations? */
bool ca_auto_has_settled(const ca_auto_decision *decision);
/* The limits of a last choice, for a render whose pilot or trials used up its work, or were too long, before it. */
ca_auto_limits ca_auto_last_limits(const ca_auto_situation *situation);

/* The limits for a half of the pilot that chooses alone, to tell its weight. */
ca_auto_limits ca_auto_half_limits(double timed_light_paths);
/* The most light paths that may be chosen. */
uint32_t ca_auto_most_light_paths(const ca_auto_limits *limits, bool memory_is_limited);
/* Are the pilot's numbers kept instead of the chosen ones, of which so many times their efficiency is expected? Only
 * where so many iterations with them are left, which must be two. */
bool ca_auto_keeps_pilots_numbers(const ca_auto_limits *limits, double gain, double iterations_left);
/* How many iterations with these numbers there would be until the end. A half's own choice must not know the noise,
 * which is that of both: progress->looks.noise is negative there. */
double ca_auto_iterations_left(const ca_auto_goal *goal, const ca_auto_progress *progress,
                               const ca_auto_candidate *candidate);
/* All precision so far in iterations of this relative variance; `iterations`: what it is where that or the noise is
 * not known. */
double ca_auto_passes_so_far(double relative_variance, double noise_percent, double iterations);

/* ---- Within a run ---------------------------------------------------------------------------------------------- */

typedef enum ca_auto_role { CA_AUTO_PLAIN, CA_AUTO_GATHERS_PAIRS, CA_AUTO_MEASURES_TIMES } ca_auto_role;

/* What the iteration-th does beside its samples, from 0. The first one warms up memory and caches, so its time does
 * not count. */
ca_auto_role ca_auto_role_of(const ca_auto_run *run, uint32_t iteration);
/* After so many iterations. A run has two at least: with one its noise is not known. */
bool ca_auto_run_is_over(const ca_auto_run *run, const ca_auto_goal *goal, const ca_auto_progress *progress,
                         uint32_t iterations);
/* In a run that does not predict: is the noise compared with its target after so many iterations? At 2, 4, 8, ... */
bool ca_auto_check_is_due(const ca_auto_progress *progress, uint32_t iterations);
/* The run's share in R once the render has done `work`. */
double ca_auto_run_share(const ca_auto_run *run, double work);

#endif
