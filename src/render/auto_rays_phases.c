/* The render after its pilot: trials, a proof and phases, each with numbers chosen from all that was seen before
 * it. */
#include "render/auto_rays_state.h"

#include <math.h>

enum { MOST_PHASES = 3, ITERATIONS_OF_A_PHASE = 4 };
/* An iteration may take an eighth of what is left of the render: shorter ones are little worse, and a few long ones
 * would neither tell their noise nor end when they should. Trials are to be short. */
enum { ITERATIONS_TO_COME = 8, ITERATIONS_BEYOND_A_TRIAL = 64, MOST_TRIALS = 3, TRIAL_ITERATIONS = 3 };
/* What many light paths cost is not known from few, as photons outgrow the caches and candidates come by the dozen;
 * nor is their noise. So N_F is at most so many times the one that was measured, in a trial and in what is not. */
enum { REACH_OF_A_TRIAL = 16, REACH = 4 };
/* A noise target is foretold from so much of the render itself. */
enum { PROOF_ITERATIONS = 6 };
static const double proof_seconds = 4.0;
/* Estimates are averaged over 5 x 5 pixels: of fewer, the choice follows what is noise in them. */
enum { SMOOTHING = 2 };

typedef struct phase_plan {
    uint32_t count;
    double begin, ends[MOST_PHASES]; /* in units of work; the last may be INFINITY */
} phase_plan;

/* ---- Estimates ------------------------------------------------------------------------------------------------- */

/* Once the halves have told their weights they are one. */
static void pool_halves(ca_auto_rays *a)
{
    ca_pair_film_pool(&a->halves[0].pairs, &a->halves[1].pairs, 1);
    ca_auto_know(a, &a->halves[0].pairs);
}

/* A's weight from A, B's from B: before they are pooled. */
static ca_status weigh_halves(ca_auto_rays *a, ca_error *error)
{
    for (unsigned h = 0; h < CA_AUTO_HALVES; h++) {
        ca_auto_choice own;
        ca_auto_know(a, &a->halves[h].pairs);
        CA_TRY(ca_auto_choose(a, &(ca_auto_question){1u << h, SMOOTHING, ITERATIONS_TO_COME, REACH_OF_A_TRIAL}, &own,
                              error));
        a->halves[h].gain = own.numbers.gain_over_given;
        a->halves[h].seconds_per_sample = own.numbers.best.time * a->speed / own.numbers.best.camera_paths;
        ca_ray_numbers_destroy(&own.numbers);
    }
    return CA_OK;
}

/* From all so far. Phases measure times anew, which are kept in the first half's, as their pairs are. */
static ca_status choose(ca_auto_rays *a, uint32_t iterations, uint32_t reach, ca_auto_choice *choice, ca_error *error)
{
    const ca_auto_question question = {.halves = a->phases == 0 ? 3u : 1u,
                                       .smoothing = SMOOTHING,
                                       .iterations = iterations,
                                       .reach = reach};
    return ca_auto_choose(a, &question, choice, error);
}

/* ---- When it will end ------------------------------------------------------------------------------------------ */

/* How many iterations with numbers of this variance all precision so far is worth: those of its law's variance that
 * have its noise. */
static double worth_so_far(const ca_auto_rays *a, double relative_variance)
{
    const double noise = 0.01 * a->looks.noise;
    if (noise > 0.0 && relative_variance > 0.0) return relative_variance / (noise * noise);
    return ca_auto_pilot_iterations(a) + a->render_iterations;
}

/* Shares 1 : 2 : 4. To a noise target the whole is what the pilot predicts, which may be far too long: then the first
 * phases end after a few times the pilot. */
static phase_plan plan_phases(const ca_auto_rays *a, double iteration_work)
{
    enum { LONGEST_IN_PILOTS = 28 }; /* 4, 8, and on */
    phase_plan plan = {.count = 1, .begin = ca_auto_work(a)};
    double whole = ca_auto_work_end(a) - plan.begin;
    if (!isfinite(whole))
        whole = fmin(fmax(0.0, a->looks.seconds_predicted - a->seconds), LONGEST_IN_PILOTS * a->seconds);
    const double iterations = whole / iteration_work;
    if (iterations >= (1 + 3) * ITERATIONS_OF_A_PHASE) plan.count = 2;
    if (iterations >= (1 + 2 + 4) * ITERATIONS_OF_A_PHASE) plan.count = 3;
    for (uint32_t k = 0; k < plan.count; k++) {
        const double done = (double)((1u << (k + 1)) - 1), all = (double)((1u << plan.count) - 1);
        plan.ends[k] = k + 1 == plan.count ? ca_auto_work_end(a) : plan.begin + whole * done / all;
    }
    return plan;
}

/* ---- Trials ---------------------------------------------------------------------------------------------------- */

/* By how many doublings N_F differs from where times were measured. */
static double distance(const ca_auto_rays *a, double light_paths)
{
    return fabs(log2(light_paths / a->timed_light_paths));
}

/* A trial has worth x its work over all that was left before it, which is settled before its samples are seen; the
 * rest of the render shares out what remains, however many trials are still to come. */
static void give_to_the_rest(ca_auto_rays *a, const ca_auto_phase *trial)
{
    const double left = ca_auto_work_end(a) - trial->begin, work = ca_auto_work(a) - trial->begin;
    if (isfinite(left) && work < left) a->share_of_work *= (left - trial->worth * work) / (left - work);
}

/* Where the numbers that seem best are far from those that the pilot had, three iterations with numbers on the way
 * tell what paths cost there, and more of the noise. They have a share like any phase, but a smaller one for the same
 * work where the pilot already knows that they are worse than what follows. */
static ca_status run_trials(ca_auto_rays *a, ca_auto_choice *choice, ca_error *error)
{
    for (int k = 0; k < MOST_TRIALS && distance(a, choice->numbers.best.light_paths) > 1.0; k++) {
        ca_auto_choice trial;
        CA_TRY(choose(a, ITERATIONS_BEYOND_A_TRIAL, REACH_OF_A_TRIAL, &trial, error));
        const ca_ray_choice *wanted = &choice->numbers.best, *tried = &trial.numbers.best;
        const double worth = fmin(wanted->variance * wanted->time / (tried->variance * tried->time), 1.0);
        if (fabs(log2(wanted->light_paths / tried->light_paths)) > distance(a, wanted->light_paths) - 1.0) {
            ca_ray_numbers_destroy(&trial.numbers);
            break; /* there is no time to go there */
        }
        ca_ray_numbers_destroy(&choice->numbers);
        ca_auto_phase phase = {.begin = ca_auto_work(a),
                           .end = (double)INFINITY,
                           .worth = worth,
                           .expected = trial.relative_variance,
                           .least = TRIAL_ITERATIONS,
                           .most = TRIAL_ITERATIONS,
                           .revise = true};
        ca_auto_use(a, &trial);
        CA_TRY(ca_auto_phase_run(a, &phase, error));
        if (ca_auto_is_over(a)) return CA_OK;
        ca_auto_phase_keep(a);
        give_to_the_rest(a, &phase);
        CA_TRY(choose(a, ITERATIONS_TO_COME, REACH_OF_A_TRIAL, choice, error));
    }
    if (choice->numbers.best.light_paths <= (double)REACH * a->timed_light_paths) return CA_OK;
    ca_ray_numbers_destroy(&choice->numbers);
    return choose(a, ITERATIONS_TO_COME, REACH, choice, error);
}

/* ---- All ------------------------------------------------------------------------------------------------------- */

/* Foretells the time to a noise target from all so far and iterations to come, of which each has the relative
 * variance. */
static void predict(ca_auto_rays *a, double relative_variance, double seconds)
{
    const double noise = ca_auto_noise(a);
    if (ca_noise_looks_reached(&a->looks)) return; /* there is nothing left to foretell */
    a->worth_before = worth_so_far(a, relative_variance);
    ca_noise_looks_take(&a->looks, a->worth_before, noise, a->seconds, seconds);
}

/* The law's word for numbers that were chosen by it is too good: where estimates err, the choice goes where they err
 * to the good side. The phase before has shown by how much. Where they say nothing at all, new numbers are taken to
 * be as good as those before. */
static void predict_by_law(ca_auto_rays *a, const ca_auto_choice *choice)
{
    const double seconds = choice->numbers.best.time * a->speed, by_law = a->surprise * choice->relative_variance;
    predict(a, by_law > 0.0 ? by_law : a->measured / seconds, seconds);
}

/* Some seconds of the render itself, with its numbers, before its end is foretold where that is a noise target:
 * neither the law's estimates nor costs of other numbers are in what they say. */
static ca_status run_proof(ca_auto_rays *a, ca_auto_choice *choice, ca_error *error)
{
    ca_auto_phase phase = {.begin = ca_auto_work(a),
                       .end = ca_auto_work(a) + proof_seconds,
                       .worth = 1.0,
                       .expected = choice->relative_variance,
                       .least = PROOF_ITERATIONS,
                       .revise = true};
    ca_auto_use(a, choice);
    CA_TRY(ca_auto_phase_run(a, &phase, error));
    if (ca_auto_is_over(a)) return CA_OK;
    const double measured = ca_auto_phase_variance(a);
    ca_auto_phase_keep(a);
    predict(a, measured, a->plain_seconds);
    return CA_OK;
}

static ca_status run_planned(ca_auto_rays *a, const phase_plan *plan, ca_auto_choice *choice, ca_error *error)
{
    for (uint32_t k = 0; k < plan->count && !ca_auto_is_over(a); k++) {
        if (k > 0) {
            ca_auto_phase_keep(a);
            CA_TRY(choose(a, ITERATIONS_TO_COME, REACH, choice, error));
            predict_by_law(a, choice);
            if (ca_auto_is_over(a)) break;
        }
        ca_auto_phase phase = {.begin = k > 0 ? plan->ends[k - 1] : plan->begin,
                           .end = plan->ends[k],
                           .worth = 1.0,
                           .expected = choice->relative_variance,
                           .revise = k + 1 < plan->count,
                           .looks = true};
        if (choice->numbers.camera_paths) ca_auto_use(a, choice); /* else those of the proof */
        CA_TRY(ca_auto_phase_run(a, &phase, error));
    }
    return CA_OK;
}

/* What an iteration adds to ca_auto_work. */
static double iteration_work(const ca_auto_rays *a, const ca_auto_choice *choice)
{
    return ca_auto_by_samples(a) ? choice->numbers.best.camera_paths : choice->numbers.best.time * a->speed;
}

static ca_status run_with(ca_auto_rays *a, ca_auto_choice *choice, ca_error *error)
{
    const bool to_a_target = !ca_auto_by_samples(a) && !isfinite(ca_auto_work_end(a));
    CA_TRY(run_trials(a, choice, error));
    if (ca_auto_is_over(a)) return CA_OK;
    const double work = iteration_work(a, choice);
    if (to_a_target)
        CA_TRY(run_proof(a, choice, error));
    else
        predict_by_law(a, choice);
    if (ca_auto_is_over(a)) return CA_OK;
    const phase_plan plan = plan_phases(a, to_a_target ? a->plain_seconds : work);
    return run_planned(a, &plan, choice, error);
}

ca_status ca_auto_phases_run(ca_auto_rays *a, ca_error *error)
{
    ca_auto_choice choice;
    (void)ca_auto_noise(a);
    if (ca_auto_work(a) >= ca_auto_work_end(a) || ca_auto_is_over(a)) return CA_OK;
    CA_TRY(weigh_halves(a, error));
    pool_halves(a);
    CA_TRY(choose(a, ITERATIONS_TO_COME, REACH_OF_A_TRIAL, &choice, error));
    const ca_status status = run_with(a, &choice, error);
    ca_ray_numbers_destroy(&choice.numbers);
    return status;
}
