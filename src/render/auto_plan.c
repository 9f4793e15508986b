#include "render/auto_plan.h"

#include "noise/ray_numbers.h"

/* An iteration may take an eighth of what is left of the render: shorter ones are little worse, and a few long ones
 * would neither tell their noise nor end when they should. Trials are short. */
enum { ITERATIONS_TO_COME = 8, ITERATIONS_BEYOND_A_TRIAL = 64 };
/* What many light paths cost is not known from few: photons outgrow the caches and candidates come by the dozen. Nor
 * is their noise. */
enum { REACH_OF_A_TRIAL = 16, REACH = 4 };
enum { MOST_TRIALS = 3, TRIAL_ITERATIONS = 3, VALIDATION_ITERATIONS = 6, LEAST_ITERATIONS = 2 };
enum { ITERATIONS_OF_TWO_PHASES = 16, ITERATIONS_OF_THREE_PHASES = 28 }; /* at least so many are to come */
enum { MEASURED_EVERY = 2, MOST_PAIRS = 8 };
static const double validation_seconds = 4.0;
/* A phase of a render to a noise target is not planned longer than from so many times what was done: the predicted
 * time may be far too long. */
static const double longest_plan = 28.0;
static const double far_away = 1.0;       /* doublings of N_F */
static const double shortest_work = 1e-9; /* the clock may not have moved */

static double work_of(const ca_auto_situation *s) { return ca_auto_work(&s->goal, &s->progress); }
static double end_of(const ca_auto_situation *s) { return ca_auto_work_end(&s->goal); }
static bool to_a_target(const ca_auto_situation *s) { return !isfinite(end_of(s)); }

/* ---- Choices --------------------------------------------------------------------------------------------------- */

static ca_auto_decision choose(const ca_auto_situation *s, ca_auto_step step, uint32_t iterations, uint32_t reach)
{
    return (ca_auto_decision){
        .step = step,
        .limits = {.iterations = iterations,
                   .timed_light_paths = s->timed_light_paths,
                   .reach = reach,
                   .for_a_trial = step == CA_AUTO_CHOOSE_TRIAL}};
}

bool ca_auto_has_settled(const ca_auto_decision *decision)
{
    return decision->step != CA_AUTO_CHOOSE && decision->step != CA_AUTO_CHOOSE_TRIAL &&
           decision->step != CA_AUTO_TRIAL;
}

ca_auto_limits ca_auto_last_limits(const ca_auto_situation *s)
{
    return choose(s, CA_AUTO_CHOOSE, ITERATIONS_TO_COME, REACH).limits;
}

ca_auto_limits ca_auto_half_limits(double timed_light_paths)
{
    return (ca_auto_limits){
        .iterations = ITERATIONS_TO_COME, .timed_light_paths = timed_light_paths, .reach = REACH_OF_A_TRIAL};
}

uint32_t ca_auto_most_light_paths(const ca_auto_limits *limits, bool memory_is_limited)
{
    const double most = memory_is_limited ? CA_RAY_MOST_LIGHT_PATHS : CA_RAY_MOST_LIGHT_PATHS_HELD;
    return (uint32_t)fmin(limits->timed_light_paths * limits->reach, most);
}

bool ca_auto_keeps_pilots_numbers(const ca_auto_limits *limits, double gain, double iterations_left)
{
    return !limits->for_a_trial && gain < 1.0 && iterations_left >= LEAST_ITERATIONS;
}

double ca_auto_iterations_left(const ca_auto_goal *goal, const ca_auto_progress *progress,
                               const ca_auto_candidate *candidate)
{
    const double work_left = ca_auto_work_end(goal) - ca_auto_work(goal, progress);
    if (goal->samples == 0.0 && isfinite(work_left)) return work_left / candidate->seconds;
    /* Without a limit of time an iteration may be no longer than all before it: estimates that see no noise of camera
     * paths, right or wrong, would ask for light paths without end. */
    const double left = candidate->seconds > progress->seconds ? 0.0 : (double)INFINITY;
    if (goal->samples > 0.0) return fmin(left, work_left / candidate->camera_paths);
    const double target = 0.01 * progress->looks.target, noise = 0.01 * progress->looks.noise;
    if (!(target > 0.0 && noise > target && candidate->relative_variance > 0.0)) return left;
    return fmin(left, (1.0 / (target * target) - 1.0 / (noise * noise)) * candidate->relative_variance);
}

/* ---- Predictions ----------------------------------------------------------------------------------------------- */

double ca_auto_passes_so_far(double relative_variance, double noise_percent, double iterations)
{
    const double noise = 0.01 * noise_percent;
    return noise > 0.0 && relative_variance > 0.0 ? relative_variance / (noise * noise) : iterations;
}

/* The law's estimate is too good for numbers that were chosen by it: where estimates err, the choice goes where they
 * err to the good side. The run before has shown by how much. Where the law says nothing, the chosen numbers are
 * taken to be as efficient as those before. */
static ca_auto_decision predict_by_law(const ca_auto_situation *s)
{
    const double seconds = s->best.seconds, by_law = s->law_error * s->best.relative_variance;
    const double as_before = s->measured_variance * s->iteration_seconds / seconds;
    return (ca_auto_decision){
        .step = CA_AUTO_PREDICT,
        .prediction = {.relative_variance = by_law > 0.0 ? by_law : as_before, .seconds = seconds}};
}

/* Neither the law's estimates nor costs of other numbers are in this. */
static ca_auto_decision predict_by_run(const ca_auto_situation *s)
{
    return (ca_auto_decision){.step = CA_AUTO_PREDICT,
                              .prediction = {.relative_variance = s->measured_variance, .seconds = s->plain_seconds}};
}

/* ---- Trials and validation ------------------------------------------------------------------------------------- */

static double doublings(double from, double to) { return fabs(log2(to / from)); }

static bool is_far(const ca_auto_situation *s)
{
    return doublings(s->timed_light_paths, s->best.light_paths) > far_away;
}

/* Does the trial lead at least a doubling towards the best numbers? Else there is no time to go there. */
static bool trial_is_worthwhile(const ca_auto_situation *s)
{
    return doublings(s->tried.light_paths, s->best.light_paths) <=
           doublings(s->timed_light_paths, s->best.light_paths) - far_away;
}

static ca_auto_decision run_trial(const ca_auto_situation *s)
{
    return (ca_auto_decision){.step = CA_AUTO_TRIAL,
                              .run = {.numbers = CA_AUTO_TRIED,
                                      .begin = work_of(s),
                                      .end = (double)INFINITY,
                                      .share = s->share * fmin(s->best.cost / s->tried.cost, 1.0),
                                      .least = TRIAL_ITERATIONS,
                                      .most = TRIAL_ITERATIONS,
                                      .measures = true,
                                      .expected_variance = s->tried.relative_variance}};
}

static ca_auto_decision run_validation(const ca_auto_situation *s)
{
    return (ca_auto_decision){.step = CA_AUTO_VALIDATE,
                              .run = {.numbers = CA_AUTO_BEST,
                                      .begin = work_of(s),
                                      .end = work_of(s) + validation_seconds,
                                      .share = s->share,
                                      .least = VALIDATION_ITERATIONS,
                                      .most = UINT32_MAX,
                                      .measures = true,
                                      .expected_variance = s->best.relative_variance}};
}

/* A trial of `work` takes its part of what was left before it. What remains is shared out over the rest. */
static double share_after_trial(const ca_auto_situation *before, const ca_auto_run *trial, double work_now)
{
    const double left = end_of(before) - trial->begin, work = work_now - trial->begin;
    if (!isfinite(left) || work >= left) return before->share;
    return (before->share * left - trial->share * work) / (left - work);
}

/* ---- Phases ---------------------------------------------------------------------------------------------------- */

/* What an iteration adds to the work. */
static double iteration_work(const ca_auto_situation *s)
{
    if (s->goal.samples > 0.0) return s->best.camera_paths;
    return s->validated ? s->plain_seconds : s->best.seconds;
}

static double work_to_come(const ca_auto_situation *s)
{
    if (!to_a_target(s)) return end_of(s) - work_of(s);
    return fmin(fmax(0.0, s->progress.looks.seconds_predicted - s->progress.seconds),
                longest_plan * s->progress.seconds);
}

static uint32_t count_phases(double iterations)
{
    if (iterations >= ITERATIONS_OF_THREE_PHASES) return 3;
    return iterations >= ITERATIONS_OF_TWO_PHASES ? 2 : 1;
}

static ca_auto_schedule make_schedule(const ca_auto_situation *s)
{
    const double whole = work_to_come(s);
    ca_auto_schedule schedule = {.count = count_phases(whole / iteration_work(s)), .begin = work_of(s)};
    const double all = (double)((1u << schedule.count) - 1);
    for (uint32_t k = 0; k + 1 < schedule.count; k++)
        schedule.ends[k] = schedule.begin + whole * (double)((2u << k) - 1) / all;
    schedule.ends[schedule.count - 1] = end_of(s);
    return schedule;
}

static ca_auto_decision run_phase(const ca_auto_situation *s)
{
    const bool first = s->schedule.count == 0;
    ca_auto_schedule schedule = first ? make_schedule(s) : s->schedule;
    const uint32_t k = schedule.done++;
    return (ca_auto_decision){.step = CA_AUTO_PHASE,
                              .run = {.numbers = first && s->validated ? CA_AUTO_UNCHANGED : CA_AUTO_BEST,
                                      .begin = k > 0 ? schedule.ends[k - 1] : schedule.begin,
                                      .end = schedule.ends[k],
                                      .share = s->share,
                                      .least = LEAST_ITERATIONS,
                                      .most = UINT32_MAX,
                                      .measures = k + 1 < schedule.count,
                                      .predicts = true,
                                      .expected_variance = s->best.relative_variance},
                              .schedule = schedule};
}

/* ---- The next step --------------------------------------------------------------------------------------------- */

/* Trials are over. */
static ca_auto_decision settle(const ca_auto_situation *s)
{
    if (s->reach > REACH && s->best.light_paths > REACH * s->timed_light_paths)
        return choose(s, CA_AUTO_CHOOSE, ITERATIONS_TO_COME, REACH);
    if (to_a_target(s) && !s->validated) return run_validation(s);
    return predict_by_law(s);
}

static ca_auto_decision after_choice(const ca_auto_situation *s)
{
    if (s->reach == REACH_OF_A_TRIAL && s->trials < MOST_TRIALS && is_far(s))
        return choose(s, CA_AUTO_CHOOSE_TRIAL, ITERATIONS_BEYOND_A_TRIAL, REACH_OF_A_TRIAL);
    return settle(s);
}

static bool is_done(const ca_auto_situation *s)
{
    return work_of(s) >= end_of(s) || ca_auto_is_over(&s->goal, &s->progress);
}

ca_auto_decision ca_auto_decide(const ca_auto_situation *s)
{
    const bool choosing = s->done == CA_AUTO_CHOOSE || s->done == CA_AUTO_CHOOSE_TRIAL;
    if (!choosing && is_done(s)) return (ca_auto_decision){.step = CA_AUTO_END};
    switch (s->done) {
    case CA_AUTO_PILOT:
    case CA_AUTO_TRIAL: return choose(s, CA_AUTO_CHOOSE, ITERATIONS_TO_COME, REACH_OF_A_TRIAL);
    case CA_AUTO_CHOOSE: return after_choice(s);
    case CA_AUTO_CHOOSE_TRIAL: return trial_is_worthwhile(s) ? run_trial(s) : settle(s);
    case CA_AUTO_VALIDATE: return predict_by_run(s);
    case CA_AUTO_PREDICT: return run_phase(s);
    case CA_AUTO_PHASE:
        if (s->schedule.done < s->schedule.count) return choose(s, CA_AUTO_CHOOSE, ITERATIONS_TO_COME, REACH);
        break;
    case CA_AUTO_END: break;
    }
    return (ca_auto_decision){.step = CA_AUTO_END};
}

ca_auto_decision ca_auto_decision_to(const ca_auto_decision *decision, const ca_auto_goal *goal)
{
    ca_auto_decision to = *decision;
    const double end = ca_auto_work_end(goal);
    if (to.step != CA_AUTO_PHASE) return to;
    for (uint32_t k = 0; k < to.schedule.count; k++)
        to.schedule.ends[k] = k + 1 < to.schedule.count ? fmin(to.schedule.ends[k], end) : end;
    to.run.end = to.schedule.ends[to.schedule.done - 1];
    return to;
}

/* ---- What was done --------------------------------------------------------------------------------------------- */

ca_auto_situation ca_auto_plan_start(const ca_auto_goal *goal, const ca_auto_progress *progress, double light_paths)
{
    return (ca_auto_situation){.goal = *goal,
                               .progress = *progress,
                               .done = CA_AUTO_PILOT,
                               .timed_light_paths = light_paths,
                               .share = 1.0,
                               .law_error = 1.0};
}

static void note_run(ca_auto_situation *s, const ca_auto_run *run, const ca_auto_outcome *outcome)
{
    if (outcome->relative_variance > 0.0) {
        s->measured_variance = outcome->relative_variance;
        s->iteration_seconds = outcome->iteration_seconds;
        if (run->expected_variance > 0.0) s->law_error = outcome->relative_variance / run->expected_variance;
    }
    if (!run->measures) return;
    s->timed_light_paths = outcome->light_paths;
    s->plain_seconds = outcome->plain_seconds;
}

ca_auto_situation ca_auto_note(const ca_auto_situation *before, const ca_auto_decision *decision,
                               const ca_auto_outcome *outcome)
{
    ca_auto_situation s = *before;
    s.progress = outcome->progress;
    s.done = decision->step;
    if (s.done == CA_AUTO_CHOOSE || s.done == CA_AUTO_CHOOSE_TRIAL) {
        s.reach = decision->limits.reach;
        *(s.done == CA_AUTO_CHOOSE ? &s.best : &s.tried) = outcome->candidate;
    }
    if (s.done == CA_AUTO_TRIAL || s.done == CA_AUTO_VALIDATE || s.done == CA_AUTO_PHASE)
        note_run(&s, &decision->run, outcome);
    if (s.done == CA_AUTO_TRIAL) {
        s.trials++;
        s.share = share_after_trial(before, &decision->run, work_of(&s));
    }
    if (s.done == CA_AUTO_VALIDATE) s.validated = true;
    if (s.done == CA_AUTO_PHASE) s.schedule = decision->schedule;
    return s;
}

/* ---- Within a run ---------------------------------------------------------------------------------------------- */

ca_auto_role ca_auto_role_of(const ca_auto_run *run, uint32_t iteration)
{
    if (!run->measures) return CA_AUTO_PLAIN;
    if (iteration % MEASURED_EVERY != 0) return CA_AUTO_MEASURES_TIMES;
    return iteration / MEASURED_EVERY < MOST_PAIRS ? CA_AUTO_GATHERS_PAIRS : CA_AUTO_PLAIN;
}

bool ca_auto_run_is_over(const ca_auto_run *run, const ca_auto_goal *goal, const ca_auto_progress *progress,
                         uint32_t iterations)
{
    if (iterations < LEAST_ITERATIONS) return false;
    if (ca_auto_is_over(goal, progress)) return true;
    return iterations >= run->least && (iterations >= run->most || ca_auto_work(goal, progress) >= run->end);
}

bool ca_auto_check_is_due(const ca_auto_progress *progress, uint32_t iterations)
{
    return progress->looks.target > 0.0 && iterations >= LEAST_ITERATIONS && (iterations & (iterations - 1)) == 0;
}

double ca_auto_run_share(const ca_auto_run *run, double work)
{
    return run->share * fmax(fmin(run->end, work) - run->begin, shortest_work);
}
