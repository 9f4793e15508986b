#include "render/auto_pilot_plan.h"

#include "noise/ray_map.h"

enum {
    LEAST_ITERATIONS = 6,  /* ordinary ones: of each half one without and two with pairs */
    USUAL_ITERATIONS = 16, /* a pilot has time for so many of the length that is wanted */
    PLAIN_EVERY = 4,       /* of a half's ordinary iterations the first, fifth, ... gather no pairs */
    MOST_CAMERA_PATHS = 16,
    LIGHT_STEP = 4, /* of the ramp */
    CAMERA_STEP = 2 /* its root */
};
static const double share_of_seconds = 0.06, share_of_samples = 0.125; /* of the render */
static const double seconds_to_a_target = 2.0;                         /* where only the noise was given */
/* A step has eight times the merges of the one before it. Gathering pairs takes longer by the second factor. */
static const double cost_of_step = LIGHT_STEP * CAMERA_STEP, cost_of_pairs = 1.4, cost_of_connected_pairs = 2.3;
/* Ordinary iterations are at least half as large, in camera paths, as the ramp's last ones. */
static const double smallest_resize = 0.5;
static const double shortest_seconds = 1e-9; /* the clock may not have moved */

/* ---- Groups ---------------------------------------------------------------------------------------------------- */

/* The geometric mean of how much the variance could differ, by light paths and by camera paths: neither samples nor
 * clocks decide. */
static double variance_of(ca_pilot_numbers numbers)
{
    return 1.0 / sqrt((double)numbers.light_paths * numbers.camera_paths);
}

ca_pilot_group ca_pilot_count(ca_pilot_group group)
{
    group.iterations++;
    group.variances += variance_of(group.numbers);
    return group;
}

/* The plain mean of n iterations has the n^2-th part of the sum of their variances. */
static double ramp_worth(const ca_pilot_group *ramp, const ca_pilot_group *ordinary)
{
    if (ramp->iterations == 0) return 0.0;
    return variance_of(ordinary->numbers) * ramp->iterations * ramp->iterations / ramp->variances;
}

double ca_pilot_worth(const ca_pilot_group *ramp, const ca_pilot_group *ordinary)
{
    return ramp_worth(ramp, ordinary) + ordinary->iterations;
}

double ca_pilot_ramp_share(const ca_pilot_group *ramp, const ca_pilot_group *ordinary)
{
    return ramp_worth(ramp, ordinary) / ca_pilot_worth(ramp, ordinary);
}

/* ---- Numbers --------------------------------------------------------------------------------------------------- */

/* INFINITY: not limited by time. */
static double longest_pilot(const ca_auto_goal *goal)
{
    const double share = goal->seconds > 0.0 ? share_of_seconds * goal->seconds : (double)INFINITY;
    return goal->longest_pilot > 0.0 ? fmin(goal->longest_pilot, share) : (double)INFINITY;
}

static double pilot_seconds(const ca_auto_goal *goal)
{
    const double wanted = goal->seconds > 0.0 ? share_of_seconds * goal->seconds : seconds_to_a_target;
    return fmin(wanted, longest_pilot(goal));
}

/* How many times longer than the ramp's last iteration may an iteration take, so that the rest of the pilot has
 * `iterations` of them? */
static double room_for(const ca_pilot_situation *s, uint32_t iterations)
{
    return (pilot_seconds(&s->goal) + s->goal.choosing - s->progress.seconds) /
           (iterations * (s->connects ? cost_of_connected_pairs : cost_of_pairs) *
            fmax(s->iteration_seconds, shortest_seconds));
}

/* `step` times the camera paths and its square times the light paths, within what the image's own map can hold and
 * what fits the memory. */
static ca_pilot_numbers resize(const ca_pilot_situation *s, double step, double least_camera_paths)
{
    const ca_pilot_numbers from = s->ramp.numbers;
    const double wanted = fmin(from.light_paths * step * step, CA_RAY_MAP_MOST_LIGHT_PATHS);
    const double light_paths = fmax(fmin(wanted, s->most_light_paths), CA_PILOT_LEAST_LIGHT_PATHS);
    const double camera_paths = fmin(fmax(from.camera_paths * step + 0.5, least_camera_paths), MOST_CAMERA_PATHS);
    return (ca_pilot_numbers){(uint32_t)light_paths, s->one_camera_path ? 1 : (uint32_t)camera_paths};
}

static ca_pilot_decision begin_ramp(const ca_pilot_situation *s)
{
    const uint32_t fewer = s->settings.light_paths / LIGHT_STEP;
    const ca_pilot_numbers numbers = {fewer > CA_PILOT_LEAST_LIGHT_PATHS ? fewer : CA_PILOT_LEAST_LIGHT_PATHS, 1};
    return (ca_pilot_decision){CA_PILOT_RAMP, numbers, numbers.light_paths};
}

/* A step further than the ramp, more where there is time for the usual number of iterations, fewer where there would
 * not be for the least. Large iterations tell more in the same time: more pairs, and what paths cost among many. */
static ca_pilot_decision size_ordinary(const ca_pilot_situation *s)
{
    const double usual = cbrt(room_for(s, USUAL_ITERATIONS)), most = cbrt(room_for(s, LEAST_ITERATIONS));
    const double step = s->ramp.iterations == CA_PILOT_HALVES ? CAMERA_STEP : 1.0;
    const ca_pilot_numbers numbers =
        resize(s, fmax(fmin(fmax(usual, step), most), smallest_resize), CA_PILOT_LEAST_CAMERA_PATHS);
    const uint32_t least =
        numbers.light_paths < s->settings.light_paths ? numbers.light_paths : s->settings.light_paths;
    return (ca_pilot_decision){CA_PILOT_ORDINARY, numbers, least};
}

ca_pilot_decision ca_pilot_decide(const ca_pilot_situation *s)
{
    if (s->progress.stopped) return (ca_pilot_decision){.step = CA_PILOT_END};
    if (s->ramp.iterations == 0) return begin_ramp(s);
    if (s->given || s->goal.samples > 0.0)
        return (ca_pilot_decision){CA_PILOT_ORDINARY, s->settings, s->settings.light_paths};
    const ca_pilot_numbers next = resize(s, CAMERA_STEP, 1.0);
    if (room_for(s, USUAL_ITERATIONS) > cost_of_step && next.light_paths > s->ramp.numbers.light_paths)
        return (ca_pilot_decision){CA_PILOT_RAMP, next, s->ramp.numbers.light_paths};
    return size_ordinary(s);
}

double ca_pilot_least_samples(uint32_t camera_paths)
{
    return (double)CA_PILOT_HALVES + (double)LEAST_ITERATIONS * camera_paths; /* the ramp has one camera path */
}

/* ---- Ordinary iterations --------------------------------------------------------------------------------------- */

ca_pilot_role ca_pilot_role_of(ca_pilot_step group, uint32_t iteration)
{
    const uint32_t of_half = iteration / CA_PILOT_HALVES;
    return (ca_pilot_role){.half = (int)(iteration % CA_PILOT_HALVES),
                           .gathers_pairs = group == CA_PILOT_ORDINARY && of_half % PLAIN_EVERY != 0};
}

bool ca_pilot_look_is_due(const ca_auto_progress *progress, uint32_t iterations)
{
    const uint32_t doublings = iterations / LEAST_ITERATIONS;
    return progress->looks.target > 0.0 && iterations > 0 && iterations % LEAST_ITERATIONS == 0 &&
           (doublings & (doublings - 1)) == 0;
}

bool ca_pilot_is_long_enough(const ca_auto_goal *goal, const ca_auto_progress *progress, uint32_t iterations)
{
    if (progress->stopped) return true;
    if (iterations < LEAST_ITERATIONS) return false;
    if (ca_noise_looks_over(&progress->looks)) return true;
    if (progress->seconds - goal->choosing >= longest_pilot(goal)) return true;
    if (goal->samples > 0.0) return progress->camera_paths >= share_of_samples * goal->samples;
    return progress->seconds - goal->choosing >= pilot_seconds(goal);
}

/* ---- The weight of the render ---------------------------------------------------------------------------------- */

double ca_pilot_render_weight(const ca_pilot_verdict *verdict, const ca_auto_goal *goal, double work,
                              double pilot_worth)
{
    const double seconds = work * (goal->samples > 0.0 ? verdict->seconds_per_sample : 1.0);
    const double pilot = pilot_worth * verdict->iteration_seconds;
    const double ratio = verdict->gain * fmax(seconds, shortest_seconds) / fmax(pilot, shortest_seconds);
    return ratio / (1.0 + ratio);
}
