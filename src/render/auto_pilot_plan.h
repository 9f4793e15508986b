/* The pilot of a render with rays "auto", decided: pure functions from settings, the clock and the memory to numbers
 * of paths and the pilot's end. But for a noise target no sample has a say in these decisions, so the halves' means
 * stay independent of what is decided (docs/papers/000.md, "Joining the pilot with the render").
 *
 * Iterations go in turns to two halves A and B. The ramp comes first: two iterations with few paths, then steps of
 * four times the light paths and twice the camera paths, two iterations each, as long as the next step leaves time
 * for 16 iterations like it. The ordinary iterations follow, all with the same numbers. Where the user gave numbers,
 * or a number of samples ends the render, the ramp has one step and the ordinary iterations have the given
 * numbers. */
#ifndef CA_RENDER_AUTO_PILOT_PLAN_H
#define CA_RENDER_AUTO_PILOT_PLAN_H

#include "render/auto_goal.h"

#include <stdint.h>

enum { CA_PILOT_HALVES = 2 };
enum {
    CA_PILOT_LEAST_LIGHT_PATHS = 2,  /* two halves of them are needed for pairs */
    CA_PILOT_LEAST_CAMERA_PATHS = 2, /* of ordinary iterations; but for ppm, which has one and does not need F */
};

typedef struct ca_pilot_numbers {
    uint32_t light_paths, camera_paths;
} ca_pilot_numbers;

/* The ramp, or the ordinary iterations. */
typedef struct ca_pilot_group {
    ca_pilot_numbers numbers; /* of the last iterations; the ramp's change */
    uint32_t iterations;      /* half of them of each half */
    double variances;         /* sum over iterations of 1 / sqrt(N_F N_B), what their variances are taken for */
} ca_pilot_group;

/* The group with one more iteration of its numbers. */
ca_pilot_group ca_pilot_count(ca_pilot_group group);

/* What both groups together are worth in ordinary iterations. A group is the plain mean of its iterations. */
double ca_pilot_worth(const ca_pilot_group *ramp, const ca_pilot_group *ordinary);
/* Share of the ramp in its half's mean; the ordinary iterations have the rest. */
double ca_pilot_ramp_share(const ca_pilot_group *ramp, const ca_pilot_group *ordinary);

/* ---- Numbers --------------------------------------------------------------------------------------------------- */

typedef enum ca_pilot_step { CA_PILOT_RAMP, CA_PILOT_ORDINARY, CA_PILOT_END } ca_pilot_step;

typedef struct ca_pilot_situation {
    ca_auto_goal goal;
    ca_auto_progress progress;
    ca_pilot_numbers settings; /* what the settings say of the ordinary iterations */
    bool given;                /* did the user give these numbers? */
    bool one_camera_path;      /* ppm: all iterations have one camera path */
    bool connects;             /* pairs are gathered of connections, with the weights of other numbers, too */
    uint32_t most_light_paths; /* that fit the memory */
    ca_pilot_group ramp;       /* so far */
    double iteration_seconds;  /* of the ramp's last iteration */
} ca_pilot_situation;

/* RAMP: two iterations, one of each half. ORDINARY: iterations until ca_pilot_is_long_enough. */
typedef struct ca_pilot_decision {
    ca_pilot_step step;
    ca_pilot_numbers numbers;
    uint32_t least_light_paths; /* where the memory does not hold so many, there is no fewer to try */
} ca_pilot_decision;

/* What follows the ramp so far. */
ca_pilot_decision ca_pilot_decide(const ca_pilot_situation *situation);

/* Camera paths of a pixel that the shortest pilot has where `samples` end the render. */
double ca_pilot_least_samples(uint32_t camera_paths);

/* ---- Ordinary iterations --------------------------------------------------------------------------------------- */

typedef struct ca_pilot_role {
    int half;
    bool gathers_pairs; /* else times are measured: those iterations are like the ones that will be rendered */
} ca_pilot_role;

/* Of the iteration-th of a group, from 0. */
ca_pilot_role ca_pilot_role_of(ca_pilot_step group, uint32_t iteration);

/* After so many ordinary iterations: is it time to look whether the noise target is reached? At 6, 12, 24, ... */
bool ca_pilot_look_is_due(const ca_auto_progress *progress, uint32_t iterations);
bool ca_pilot_is_long_enough(const ca_auto_goal *goal, const ca_auto_progress *progress, uint32_t iterations);

/* ---- The weight of the render ---------------------------------------------------------------------------------- */

/* What one half's estimates and times say: how much more efficient than the pilot's the numbers are that it would
 * choose; and what of the render's work is done. */
typedef struct ca_pilot_verdict {
    double gain;               /* efficiency over the pilot's numbers */
    double seconds_per_sample; /* of the clock, for a camera path of every pixel with these numbers */
    double iteration_seconds;  /* of the clock, of an ordinary iteration without pairs */
} ca_pilot_verdict;

/* Of R beside the other half's pilot (auto_rays.h), after `work` of the render. It is the inverse variance's if the
 * verdict is right. Where samples end the render its seconds are those that this half expects: the seconds that it
 * took depend on numbers that both halves have chosen. */
double ca_pilot_render_weight(const ca_pilot_verdict *verdict, const ca_auto_goal *goal, double work,
                              double pilot_worth);

#endif
