/* The phases of the render proper: each with numbers chosen from all that was seen before it. */
#include "render/auto_rays_state.h"

#include <math.h>
#include <string.h>

enum { MOST_PHASES = 3, PAIRS_EVERY = 4, MOST_PAIRS = 8, LEAST_ITERATIONS = 2, ITERATIONS_OF_A_PHASE = 4 };
/* Averaging over neighbours: the wider the less has been seen. */
enum { PILOT_SMOOTHING = 2, LATER_SMOOTHING = 1 };

typedef struct phase_plan {
    uint32_t count;
    double begin, ends[MOST_PHASES]; /* in units of work; the last may be INFINITY */
} phase_plan;

/* ---- Estimates -------------------------------------------------------------------------------------------------------- */

static void add_pixel(ca_pair_pixel *sum, const ca_pair_pixel *more)
{
    for (int q = 0; q < CA_PAIR_QUANTITIES; q++) sum->sums[q] += more->sums[q];
    for (size_t q = 0; q < sizeof sum->products / sizeof sum->products[0]; q++) sum->products[q] += more->products[q];
    sum->cubes += more->cubes;
    sum->fourths += more->fourths;
    sum->iterations += more->iterations;
}

/* Once the halves have told their weights they are one. */
static void pool_halves(ca_auto_rays *a)
{
    const size_t count = (size_t)a->phase.width * a->phase.height;
    for (size_t p = 0; p < count; p++) add_pixel(&a->halves[0].pairs.pixels[p], &a->halves[1].pairs.pixels[p]);
}

/* The second half's film is used for what phases gather. A pixel of one camera path did not tell F: it is left as it was, unless none
 * of them asks for F. */
static void pool_phase(ca_auto_rays *a)
{
    const size_t count = (size_t)a->phase.width * a->phase.height;
    const bool all = a->groups[CA_AUTO_ORDINARY].camera_paths == 1;
    for (size_t p = 0; p < count; p++)
        if (all || a->numbers[p] > 1) add_pixel(&a->halves[0].pairs.pixels[p], &a->halves[1].pairs.pixels[p]);
}

/* A's weight from A, B's from B: before they are pooled. */
static ca_status choose_first(ca_auto_rays *a, ca_auto_choice *choice, ca_error *error)
{
    for (unsigned h = 0; h < CA_AUTO_HALVES; h++) {
        ca_auto_choice own;
        CA_TRY(ca_auto_choose(a, &a->halves[h].pairs, 1u << h, PILOT_SMOOTHING, &own, error));
        a->halves[h].gain = own.numbers.gain_over_given;
        a->halves[h].seconds_per_sample = own.numbers.best.time * a->speed / own.numbers.best.camera_paths;
        ca_ray_numbers_destroy(&own.numbers);
    }
    pool_halves(a);
    return ca_auto_choose(a, &a->halves[0].pairs, 3u, PILOT_SMOOTHING, choice, error);
}

/* ---- When it will end ---------------------------------------------------------------------------------------------------- */

/* How many iterations of the render the pilot's precision is worth: those of its law's variance that have its noise. */
static double worth_of_pilot(const ca_auto_rays *a, double relative_variance)
{
    const double noise = 0.01 * a->looks.noise;
    if (noise > 0.0 && relative_variance > 0.0) return relative_variance / (noise * noise);
    return ca_auto_pilot_iterations(a);
}

static double noise_now(ca_auto_rays *a)
{
    ca_auto_join(a);
    return 100.0 * ca_film_summarise(&a->image).noise;
}

/* Shares 1 : 2 : 4. To a noise target the whole is what the pilot predicts, which may be far too long: then the first phases end
 * after a few times the pilot. */
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

/* ---- One phase ------------------------------------------------------------------------------------------------------------ */

typedef struct phase_run {
    double begin, end; /* of work */
    bool revise;       /* pairs are gathered for the numbers of the next one */
    double time;       /* of an iteration, of the processors by the costs */
    uint32_t iterations, paired;
    double plain_seconds;
} phase_run;

static void look(ca_auto_rays *a)
{
    const double passes = a->pilot_worth + a->render_iterations;
    if (ca_noise_looks_due(&a->looks, passes))
        ca_noise_looks_take(&a->looks, passes, noise_now(a), a->seconds, a->render_seconds / a->render_iterations);
}

static ca_status run_iteration(ca_auto_rays *a, ca_auto_batch *batch, phase_run *phase, ca_error *error)
{
    double seconds;
    const bool pairs = phase->revise && phase->iterations % PAIRS_EVERY == 1 && phase->paired < MOST_PAIRS;
    CA_TRY(ca_auto_batch_run(a, batch, &a->phase, pairs ? &a->halves[1].pairs : NULL, NULL, &seconds, error));
    phase->iterations++;
    a->render_iterations++;
    a->render_seconds += seconds;
    if (pairs)
        phase->paired++;
    else
        phase->plain_seconds += seconds;
    /* One that is ended early has the share of what it did. The clock may not have moved. */
    a->phase_share = fmax(fmin(phase->end, ca_auto_work(a)) - phase->begin, 1e-9);
    return CA_OK;
}

/* Before its second iteration a phase does not know its noise. */
static bool phase_is_over(ca_auto_rays *a, const phase_run *phase)
{
    if (phase->iterations < LEAST_ITERATIONS) return false;
    look(a);
    return ca_auto_work(a) >= phase->end || ca_auto_is_over(a);
}

static ca_status run_phase(ca_auto_rays *a, phase_run *phase, ca_error *error)
{
    ca_auto_batch batch;
    bool over = false;
    const size_t pixels = (size_t)a->phase.width * a->phase.height;
    memset(a->phase.pixels, 0, pixels * sizeof *a->phase.pixels);
    memset(a->halves[1].pairs.pixels, 0, pixels * sizeof *a->halves[1].pairs.pixels);
    ca_status status = ca_auto_batch_begin(a, &batch, error);
    while (status == CA_OK && !over) {
        status = run_iteration(a, &batch, phase, error);
        if (status == CA_OK) {
            ca_auto_report(a);
            over = phase_is_over(a, phase);
        }
    }
    ca_auto_batch_end(a, &batch);
    if (phase->iterations > phase->paired)
        a->speed = phase->plain_seconds / ((phase->iterations - phase->paired) * phase->time);
    a->phases++;
    return status;
}

/* ---- All ------------------------------------------------------------------------------------------------------------------ */

/* A phase that is done becomes a part of R, with its share. */
static void keep_phase(ca_auto_rays *a)
{
    ca_joined_film_add(&a->render, &a->phase, a->phase_share);
    a->shares += a->phase_share;
    a->phase_share = 0.0;
}

static ca_status run_planned(ca_auto_rays *a, const phase_plan *plan, ca_auto_choice *choice, ca_error *error)
{
    for (uint32_t k = 0; k < plan->count; k++) {
        if (k > 0) {
            keep_phase(a);
            pool_phase(a);
            CA_TRY(ca_auto_choose(a, &a->halves[0].pairs, 3u, LATER_SMOOTHING, choice, error));
        }
        phase_run phase = {.begin = k > 0 ? plan->ends[k - 1] : plan->begin,
                           .end = plan->ends[k],
                           .revise = k + 1 < plan->count,
                           .time = choice->numbers.best.time};
        ca_auto_use(a, choice);
        CA_TRY(run_phase(a, &phase, error));
        if (ca_auto_is_over(a)) break;
    }
    return CA_OK;
}

ca_status ca_auto_phases_run(ca_auto_rays *a, ca_error *error)
{
    ca_auto_choice choice;
    a->looks.noise = noise_now(a);
    if (!(a->looks.noise >= 0.0)) a->looks.noise = -1.0;
    if (ca_auto_work(a) >= ca_auto_work_end(a) || ca_auto_is_over(a)) return CA_OK;
    CA_TRY(choose_first(a, &choice, error));
    a->pilot_worth = worth_of_pilot(a, choice.relative_variance);
    const double iteration_seconds = choice.numbers.best.time * a->speed;
    ca_noise_looks_take(&a->looks, a->pilot_worth, a->looks.noise >= 0.0 ? a->looks.noise : (double)NAN, a->seconds, iteration_seconds);
    const phase_plan plan =
        plan_phases(a, ca_auto_by_samples(a) ? choice.numbers.best.camera_paths : iteration_seconds);
    return run_planned(a, &plan, &choice, error);
}
