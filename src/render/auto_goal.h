/* What ends a render with rays "auto", and how far it is: what its two planners (auto_pilot_plan.h, auto_plan.h) know
 * of both. Plain values and pure functions. */
#ifndef CA_RENDER_AUTO_GOAL_H
#define CA_RENDER_AUTO_GOAL_H

#include "render/noise_looks.h"

#include <math.h>

/* With neither of the two the render ends at its noise target, ca_auto_progress.looks.target. */
typedef struct ca_auto_goal {
    double samples; /* camera paths of a pixel, mean over pixels; 0: their number does not end the render */
    double seconds; /* 0: no limit */
    double choosing; /* of the render's seconds were gone before the pilot: the method was chosen */
    double longest_pilot; /* s, where its samples are dropped; 0: they count, so that its share alone limits it */
} ca_auto_goal;

typedef struct ca_auto_progress {
    double seconds, camera_paths; /* so far; camera paths of a pixel, mean over pixels */
    ca_noise_looks looks;         /* the noise when it was looked at last, its target, the predicted time */
    bool stopped;                 /* the caller wants no more, or there are no numbers left for camera paths */
} ca_auto_progress;

/* Work is counted in camera paths of a pixel where samples end the render, else in seconds. */
static inline double ca_auto_work(const ca_auto_goal *goal, const ca_auto_progress *progress)
{
    return goal->samples > 0.0 ? progress->camera_paths : progress->seconds;
}

/* INFINITY: the noise target alone ends the render. */
static inline double ca_auto_work_end(const ca_auto_goal *goal)
{
    if (goal->samples > 0.0) return goal->samples;
    return goal->seconds > 0.0 ? goal->seconds : (double)INFINITY;
}

/* Must the render end, even if its work is not done: stopped, out of time, at its noise target, or given up? */
static inline bool ca_auto_is_over(const ca_auto_goal *goal, const ca_auto_progress *progress)
{
    return progress->stopped || (goal->seconds > 0.0 && progress->seconds >= goal->seconds) ||
           ca_noise_looks_over(&progress->looks);
}

/* A limit of a render that goes on: what is done stays done, and counts as it would have with the limit before. 0:
 * there is none. */
static inline double ca_auto_limit_to(double wanted, double before, double done)
{
    if (wanted == 0.0) return 0.0;
    return fmax(wanted, before > 0.0 ? fmin(before, done) : done);
}

#endif
