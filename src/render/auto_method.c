#include "render/auto_method.h"

#include "base/clock.h"
#include "base/memory.h"
#include "base/text.h"
#include "render/light_pilot.h"
#include "render/method_light.h"
#include "render/method_of_file.h"
#include "render/method_weights.h"
#include "render/preflight.h"
#include "render/render_passes.h"
#include "render/shown_light.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Methods that do not merge, which the pilot is asked for, in its order. */
enum { PATH, NO_SPLATS, BDPT, WITHOUT_MERGES };
_Static_assert((int)WITHOUT_MERGES <= (int)CA_PILOT_METHODS, "the pilot tells of all at once");

enum { FIRST_ITERATIONS = 4, MOST_ITERATIONS = 64 };

/* Of the time for the choice, s. */
#define LEAST_SECONDS 0.1
#define MOST_SECONDS 5.0

/* The pilot of light has so many times the usual paths if that takes less than a share of the render's time. */
enum { MORE_LIGHT = 4 };
#define SHARE_OF_LIGHT 0.005

/* The pilot of lights that are seen takes about this share of the render's time, of which a second has so many of its
 * camera paths. */
#define SHARE_OF_SHOWN 0.005
#define SHOWN_PATHS_OF_SECOND 1.5e6
#define LEAST_SHOWN_PATHS 0x1p14
#define MOST_SHOWN_PATHS 0x1p22

/* Neighbours are tried of methods whose cost is within this factor of the least. */
#define NEAR_THE_BEST 1.5

/* More light paths come in rounds, and take more time than a trial of few tells. */
#define MOST_LIGHT_PATHS 0x1p22

/* Methods of which one guide of emission serves all: those that find the same light by light paths. */
enum { GUIDE_ALONE, GUIDE_CONNECTIONS, GUIDE_ALL, GUIDES };

typedef struct chooser {
    ca_render_plan *plan;
    double start, trials_start; /* by the clock, s */
    double seconds_allowed;     /* for all trials, once it is known what the render takes */
    ca_method_radii radii;
    ca_emission_guide *guides[GUIDES]; /* owned; NULL where there is nothing to guide */
    double passes; /* that the pilot is asked about */
    ca_light_pilot pilot;
    bool loses[WITHOUT_MERGES];
    double lost; /* by bdpt, of all light */
    ca_method methods[CA_MOST_METHODS];
    ca_method_trial *trials; /* owned; likewise: */
    ca_method_score scores[CA_MOST_METHODS];
    bool goes_on[CA_MOST_METHODS];
    uint32_t count, scored; /* methods in trial; the first so many have scores */
    ca_shown_light shown;
    ca_method_weights weights;
    bool ended; /* by the caller */
} chooser;

static double seconds_so_far(const chooser *c) { return ca_clock_seconds() - c->start; }
static double seconds_of_trials(const chooser *c) { return ca_clock_seconds() - c->trials_start; }

/* ---- What the pilot tells -------------------------------------------------------------------------------------- */

static uint32_t pilot_method(const ca_method *method)
{
    if (ca_method_merges(method)) return WITHOUT_MERGES;
    if (method->type == &ca_integrator_path) return PATH;
    return method->no_splats ? NO_SPLATS : BDPT;
}

/* The methods have the same samples, still in the same order. */
static void note_splats(ca_light_pilot *pilot)
{
    for (size_t i = 0; i < pilot->count; i++)
        pilot->samples[BDPT][i].splats = pilot->samples[BDPT][i].expected - pilot->samples[NO_SPLATS][i].expected;
}

/* Dots are seldom met, and methods that make them seem quiet where none was: where more paths cost little, and memory
 * has no limit, more are traced. */
static ca_status ask_of_light(chooser *c, const ca_mis_rules *counts, ca_error *error)
{
    const ca_render_plan *plan = c->plan;
    ca_light_question question = {.counts = counts, .methods = WITHOUT_MERGES, .iterations = c->passes};
    const double start = ca_clock_thread_seconds();
    CA_TRY(ca_light_pilot_run(&c->pilot, plan, &question, error));
    question.effort = MORE_LIGHT;
    const double seconds = ca_clock_thread_seconds() - start;
    const bool is_much = seconds * MORE_LIGHT > SHARE_OF_LIGHT * ca_method_expected_seconds(plan);
    if (is_much || plan->input.memory_bytes > 0.0) return CA_OK;
    ca_light_pilot_destroy(&c->pilot);
    return ca_light_pilot_run(&c->pilot, plan, &question, error);
}

static ca_status run_light_pilot(chooser *c, ca_error *error)
{
    const ca_method methods[WITHOUT_MERGES] = {
        [PATH] = {.type = &ca_integrator_path},
        [NO_SPLATS] = {.type = &ca_integrator_bdpt, .no_splats = true},
        [BDPT] = {.type = &ca_integrator_bdpt},
    };
    const ca_render_plan *plan = c->plan;
    const ca_light_region region = {plan->crop[0], plan->crop[1], plan->crop[2], plan->crop[3]};
    ca_mis_rules counts[WITHOUT_MERGES];
    for (int m = 0; m < WITHOUT_MERGES; m++) {
        ca_integrator_input input;
        CA_TRY(ca_method_configure(&methods[m], plan, NULL, &input, error));
        ca_integrator_counts(methods[m].type, &input, &counts[m]);
    }
    c->passes = ca_light_pilot_passes(plan, ca_render_plan_expected_passes(plan));
    CA_TRY(ask_of_light(c, counts, error));
    note_splats(&c->pilot);
    for (int m = 0; m < WITHOUT_MERGES; m++) {
        const ca_batch_ratio lost = ca_lost_light(c->pilot.samples[m], c->pilot.count);
        if (m == BDPT) c->lost = lost.value;
        c->loses[m] = ca_method_loses_light(c->pilot.samples[m], c->pilot.count, &region);
    }
    return CA_OK;
}

static ca_status run_shown_pilot(chooser *c, ca_error *error)
{
    const double paths = SHARE_OF_SHOWN * ca_method_expected_seconds(c->plan) * SHOWN_PATHS_OF_SECOND;
    return ca_shown_light_find(&c->shown, c->plan, fmin(fmax(paths, LEAST_SHOWN_PATHS), MOST_SHOWN_PATHS), error);
}

static ca_status run_guide_pilot(chooser *c, uint32_t which, ca_error *error)
{
    const ca_method methods[GUIDES] = {
        [GUIDE_ALONE] = {.type = &ca_integrator_bdpm},
        [GUIDE_CONNECTIONS] = {.type = &ca_integrator_bdpt},
        [GUIDE_ALL] = {.type = &ca_integrator_ovcm},
    };
    ca_integrator_input input;
    CA_TRY(ca_method_configure(&methods[which], c->plan, NULL, &input, error));
    return ca_integrator_make_guide(methods[which].type, &input, &c->guides[which], error);
}

static const ca_emission_guide *guide_of(const chooser *c, const ca_method *method)
{
    if (!ca_method_merges(method)) return c->guides[GUIDE_CONNECTIONS];
    return c->guides[method->type->rules->connect ? GUIDE_ALL : GUIDE_ALONE];
}

/* They know nothing of each other. Guides are the last ones. */
enum { LIGHT = (int)CA_MERGINGS, SHOWN, FIRST_GUIDE, PILOTS = FIRST_GUIDE + (int)GUIDES };

typedef struct pilots_task {
    chooser *c;
    ca_status status[PILOTS];
    ca_error errors[PILOTS];
} pilots_task;

static void run_pilot(void *user, uint32_t index, uint32_t worker)
{
    (void)worker;
    pilots_task *task = user;
    chooser *c = task->c;
    ca_error *error = &task->errors[index];
    if (index >= FIRST_GUIDE)
        task->status[index] = run_guide_pilot(c, index - FIRST_GUIDE, error);
    else if (index == LIGHT)
        task->status[index] = run_light_pilot(c, error);
    else if (index == SHOWN)
        task->status[index] = run_shown_pilot(c, error);
    else
        task->status[index] = ca_method_find_radius(c->plan, (ca_merging)index, &c->radii.of[index], error);
}

static ca_status first_failure(const ca_status *status, const ca_error *errors, uint32_t count, ca_error *error)
{
    for (uint32_t i = 0; i < count; i++) {
        if (status[i] == CA_OK) continue;
        if (error) *error = errors[i];
        return status[i];
    }
    return CA_OK;
}

static ca_status run_pilots(chooser *c, ca_error *error)
{
    const ca_parallel parallel = {.workers = ca_min_u32(c->plan->threads, PILOTS), .stop = c->plan->input.stop};
    pilots_task task = {.c = c};
    CA_TRY(ca_parallel_for(&parallel, PILOTS, run_pilot, &task, error));
    return first_failure(task.status, task.errors, PILOTS, error);
}

static double dots_of(const chooser *c, uint32_t i, double square)
{
    const ca_render_plan *plan = c->plan;
    const uint32_t m = pilot_method(&c->methods[i]);
    if (m == WITHOUT_MERGES) return 0.0;
    const ca_dot_light light = {
        .square = square,
        .light_paths = pow(4.0, c->methods[i].light_paths_log4),
        .camera_paths = c->pilot.camera_paths,
        .expected_scale = c->pilot.scale,
        .paths_of_pixel = plan->camera_paths,
        .weight = ca_method_weight_at,
        .user = &c->weights,
    };
    return ca_method_dots(c->pilot.samples[m], c->pilot.count, &light);
}

/* ---- Trials ---------------------------------------------------------------------------------------------------- */

/* A method that loses light, or cannot do what the settings ask for, is not tried. */
static ca_status add_method(chooser *c, const ca_method *method, ca_error *error)
{
    const uint32_t m = pilot_method(method);
    if (m != WITHOUT_MERGES && c->loses[m]) return CA_OK;
    if (ca_render_plan_chooses_rays(c->plan) && c->plan->camera_paths > 1 &&
        ca_integrator_has(method->type, CA_ABILITY_ONE_CAMERA_PATH))
        return CA_OK;
    const ca_status status = ca_method_trial_create(&c->trials[c->count], c->plan, method, &c->radii,
                                                    guide_of(c, method), error);
    if (status != CA_OK) return status == CA_ERROR_UNSUPPORTED ? CA_OK : status;
    c->methods[c->count] = *method;
    c->goes_on[c->count++] = true;
    return CA_OK;
}

static ca_status add_first(chooser *c, ca_error *error)
{
    ca_method methods[CA_MOST_METHODS];
    const uint32_t count = ca_methods_first(methods);
    for (uint32_t i = 0; i < count; i++) CA_TRY(add_method(c, &methods[i], error));
    if (c->count == 0) return CA_ERROR_UNSUPPORTED; /* as the last one said */
    return ca_method_weights_create(&c->weights, c->plan, error);
}

static int most_log4(const ca_render_plan *plan)
{
    const double pixels = (double)plan->camera.width * plan->camera.height;
    return pixels >= MOST_LIGHT_PATHS ? 0 : (int)floor(log2(MOST_LIGHT_PATHS / pixels) / 2.0);
}

/* More and fewer light paths. */
static ca_status add_numbers(chooser *c, const ca_method *method, ca_error *error)
{
    if (ca_integrator_value(c->plan->type, &c->plan->input, "light_paths", 0.0) > 0.0) return CA_OK;
    for (int step = -1; step <= 1; step += 2) {
        ca_method neighbour;
        if (c->count < CA_MOST_METHODS &&
            ca_method_neighbour(method, step, most_log4(c->plan), c->methods, c->count, &neighbour))
            CA_TRY(add_method(c, &neighbour, error));
    }
    return CA_OK;
}

/* For those near the best other numbers of light paths, and for the best one the other emission; *added: how many
 * methods that makes. */
static ca_status add_neighbours(chooser *c, uint32_t *added, ca_error *error)
{
    const uint32_t before = c->count, best = ca_method_best(c->scores, before);
    const double near = NEAR_THE_BEST * ca_method_cost(&c->scores[best]);
    ca_method other;
    if (ca_method_may_be_guided(c->plan) && c->count < CA_MOST_METHODS &&
        ca_method_other_emission(&c->methods[best], c->methods, c->count, &other))
        CA_TRY(add_method(c, &other, error));
    for (uint32_t i = 0; i < before; i++)
        if (ca_method_cost(&c->scores[i]) <= near) CA_TRY(add_numbers(c, &c->methods[i], error));
    *added = c->count - before;
    return CA_OK;
}

static void tell(chooser *c)
{
    const double start = c->start;
    if (!ca_render_tell_choosing(c->plan, seconds_so_far(c), &c->start)) c->ended = true;
    c->trials_start += c->start - start; /* the caller's time is nobody's */
}

typedef struct trials_task {
    chooser *c;
    uint32_t iterations;
    ca_status status[CA_MOST_METHODS];
    ca_error errors[CA_MOST_METHODS];
} trials_task;

static void run_trial(void *user, uint32_t index, uint32_t worker)
{
    (void)worker;
    trials_task *task = user;
    const chooser *c = task->c;
    ca_method_trial *trial = &c->trials[index];
    while (c->goes_on[index] && trial->iterations < task->iterations && task->status[index] == CA_OK) {
        if (trial->iterations >= FIRST_ITERATIONS && seconds_of_trials(c) > c->seconds_allowed) return;
        task->status[index] = ca_method_trial_run(trial, &task->errors[index]);
    }
}

/* Each on one thread. */
static ca_status run_trials(chooser *c, uint32_t iterations, ca_error *error)
{
    const ca_parallel parallel = {.workers = ca_min_u32(c->plan->threads, c->count), .stop = c->plan->input.stop};
    trials_task task = {.c = c, .iterations = iterations};
    CA_TRY(ca_parallel_for(&parallel, c->count, run_trial, &task, error));
    tell(c);
    return first_failure(task.status, task.errors, c->count, error);
}

/* ---- Scores ---------------------------------------------------------------------------------------------------- */

/* Of what is shown; the same for all methods. */
static double shown_variance(const chooser *c)
{
    const ca_shown_scale scale = {.paths_of_pixel = c->plan->camera_paths,
                                  .least_square = CA_METHOD_LEAST_SQUARE,
                                  .luminance = ca_method_luminance_at,
                                  .user = &c->weights};
    return ca_shown_light_variance(&c->shown, &scale);
}

/* Of a pixel's light over what its error counts by, the mean square. */
static double relative_square(const ca_method_weights *weights)
{
    const size_t cells = ca_trial_cell_count(&weights->cells);
    double sum = 0.0;
    for (size_t i = 0; i < cells; i++) sum += weights->weights[i] * weights->luminance[i] * weights->luminance[i];
    return sum / (double)cells;
}

/* Light that merges alone find comes photon by photon: with so many a camera path it is so noisy at least. A trial
 * that met none, or one, knows no more than that there are hardly more. */
static double least_noise_of_photons(const chooser *c, uint32_t i)
{
    const double share = c->methods[i].type->rules->connect ? c->lost : 1.0;
    return share * relative_square(&c->weights) / ca_method_trial_most_photons(&c->trials[i]);
}

/* Of methods that merge the pilot tells no dots: theirs are in the trial, if it met any. */
static double dots_of_trial(const chooser *c, uint32_t i, double variance, double square)
{
    if (!ca_method_merges(&c->methods[i])) return dots_of(c, i, square);
    return fmax(0.0, least_noise_of_photons(c, i) - variance);
}

static ca_method_score score_of(const chooser *c, uint32_t i, double shown)
{
    const ca_method_trial *trial = &c->trials[i];
    const bool merges = ca_method_merges(&c->methods[i]);
    const double *weights = c->weights.weights;
    const double square = merges ? (double)INFINITY : ca_method_trial_dot_square(trial, weights);
    const double seconds = ca_method_trial_seconds(trial), passes = ca_method_passes(c->plan, seconds);
    const double variance = ca_method_trial_variance(trial, weights, square);
    return (ca_method_score){.variance = variance,
                             .dots = dots_of_trial(c, i, variance, square),
                             .shown = shown,
                             .common = ca_method_trial_variance(trial, weights, CA_COMMON_SQUARE),
                             .passes = passes,
                             .blur = ca_method_trial_blur(trial, &c->radii, passes),
                             .seconds = seconds};
}

/* The same method with the usual number of light paths, which is among the first ones. */
static uint32_t usual_of(const chooser *c, uint32_t i)
{
    for (uint32_t k = 0; k < c->count; k++)
        if (c->methods[k].type == c->methods[i].type && c->methods[k].light_paths_log4 == 0) return k;
    return i;
}

/* Of a radius that was not chosen only the pilot knows. */
static void set_blurs(chooser *c)
{
    const ca_render_plan *plan = c->plan;
    if (ca_render_plan_is_set(plan, "radius")) return;
    for (uint32_t i = 0; i < c->count; i++) {
        ca_method_score *score = &c->scores[i];
        const ca_blur_signs signs = {.by_pilot = score->blur,
                                     .variance = c->scores[usual_of(c, i)].common,
                                     .alpha = c->trials[i].alpha,
                                     .passes = score->passes,
                                     .merged_alone = c->lost};
        score->blur = ca_method_blur(&c->methods[i], &signs);
    }
}

static ca_status score(chooser *c, ca_error *error)
{
    CA_TRY(ca_method_weights_set(&c->weights, c->trials, c->count, error));
    const double shown = shown_variance(c);
    for (uint32_t i = 0; i < c->count; i++) c->scores[i] = score_of(c, i, shown);
    set_blurs(c);
    ca_methods_compare_noise(c->methods, c->scores, c->count);
    c->scored = c->count;
    const ca_method_score best = c->scores[ca_method_best(c->scores, c->count)];
    for (uint32_t i = 0; i < c->count; i++)
        c->goes_on[i] = c->goes_on[i] && ca_method_goes_on(&c->scores[i], &best, c->trials[i].iterations);
    return CA_OK;
}

/* ---- Rounds ---------------------------------------------------------------------------------------------------- */

/* A share of what the render will take by the best method so far. */
static double seconds_for_choice(const chooser *c)
{
    double whole = ca_method_whole_seconds(c->plan);
    if (!c->plan->open_ended) {
        const ca_method_score *best = &c->scores[ca_method_best(c->scores, c->scored)];
        const double seconds = best->seconds / ca_render_plan_threads(c->plan);
        whole = fmin(whole, c->plan->pass_limit * seconds);
    }
    return fmin(MOST_SECONDS, fmax(LEAST_SECONDS, CA_METHOD_SHARE * whole));
}

static uint32_t still_going(const chooser *c)
{
    uint32_t count = 0;
    for (uint32_t i = 0; i < c->count; i++) count += c->goes_on[i];
    return count;
}

static ca_status run_rounds(chooser *c, ca_error *error)
{
    for (uint32_t iterations = FIRST_ITERATIONS; iterations <= MOST_ITERATIONS && !c->ended;) {
        uint32_t added = 0;
        CA_TRY(run_trials(c, iterations, error));
        if (c->ended) break;
        CA_TRY(score(c, error));
        c->seconds_allowed = seconds_for_choice(c);
        if (seconds_of_trials(c) > c->seconds_allowed) break;
        CA_TRY(add_neighbours(c, &added, error));
        if (added > 0) continue;
        if (still_going(c) == 1) break;
        iterations *= 2;
    }
    return CA_OK;
}

/* ---- What was chosen, in words --------------------------------------------------------------------------------- */

/* The method that `plan` now has, and what a user would set to have it again. */
static void write_method(const ca_render_plan *plan, const ca_tried_method *method, char *text, size_t size)
{
    const double radius = ca_integrator_value(plan->type, &plan->input, "radius", 0.0);
    char light_paths[64] = "", camera_paths[48] = "", merge_radius[40] = "";
    if (method->light_paths > 0.0)
        snprintf(light_paths, sizeof light_paths, " with %.0f %s%s", method->light_paths,
                 method->guided ? "guided " : "", ca_noun(method->light_paths, "light path", "light paths"));
    if (plan->camera_paths > 1)
        snprintf(camera_paths, sizeof camera_paths, " and %u camera paths per pixel", plan->camera_paths);
    if (radius > 0.0) snprintf(merge_radius, sizeof merge_radius, ", merge radius %.4g", radius);
    snprintf(text, size, "%s%s%s%s%s%s", method->name, method->no_splats ? " without splats" : "", light_paths,
             camera_paths, method->light_paths > 0.0 ? " a pass" : "", merge_radius);
}

static void note_trials(chooser *c)
{
    ca_method_statistics *m = &c->plan->method;
    m->trial_count = c->scored;
    for (uint32_t i = 0; i < c->scored; i++) {
        const ca_method *method = &c->methods[i];
        const bool has_light_paths = ca_method_has_light_paths(method);
        m->trials[i] = (ca_tried_method){
            .name = method->type->name,
            .no_splats = method->no_splats,
            .guided = c->trials[i].plan.input.guide != NULL,
            .light_paths = has_light_paths ? ca_method_light_paths(method, c->plan) : 0.0,
            .iterations = c->trials[i].iterations,
            .variance = c->scores[i].variance + c->scores[i].shown,
            .dot_variance = c->scores[i].dots,
            .seconds = c->scores[i].seconds,
        };
    }
}

/* The best of another type; `scored`: there is none. */
static uint32_t runner_up(const chooser *c, uint32_t best)
{
    uint32_t other = c->scored;
    for (uint32_t i = 0; i < c->scored; i++) {
        if (c->methods[i].type == c->methods[best].type) continue;
        if (other == c->scored || ca_method_cost(&c->scores[i]) < ca_method_cost(&c->scores[other])) other = i;
    }
    return other;
}

/* Of the method that is in use. */
static void write_reason(chooser *c, uint32_t best)
{
    ca_method_statistics *m = &c->plan->method;
    char method[192], why[80] = "";
    const uint32_t other = runner_up(c, best);
    const double gain =
        other < c->scored ? ca_method_cost(&c->scores[other]) / ca_method_cost(&c->scores[best]) : 0.0;
    write_method(c->plan, &m->trials[best], method, sizeof method);
    const double percent = 100.0 * c->lost;
    if (c->loses[BDPT])
        snprintf(why, sizeof why, ", since only merges find about %.*g %% of the light", percent < 99.5 ? 2 : 3,
                 percent); /* that of a small part of the picture may be 0.01 % */
    else if (isfinite(gain) && gain > 0.0)
        snprintf(why, sizeof why, ", %.2f times as efficient as %s", gain, c->methods[other].type->name);
    snprintf(m->reason, sizeof m->reason, "auto: %s%s (%u tried in %.1f s)", method, why, c->count, m->seconds);
}

/* ---- The choice ------------------------------------------------------------------------------------------------ */

static ca_status use(ca_render_plan *plan, const ca_method *method, const ca_method_radii *radii, ca_error *error)
{
    ca_integrator_input chosen;
    CA_TRY(ca_method_configure(method, plan, radii, &chosen, error));
    CA_TRY(ca_integrator_resolve(method->type, &chosen, error));
    memcpy(plan->input.values, chosen.values, sizeof chosen.values);
    plan->type = method->type;
    return ca_render_plan_recount(plan, error);
}

/* A render with more photons a pixel, in the mean, has no dots: where its light is there are even more. */
#define MANY_PHOTONS 4.0

/* The pilot that tells is asked only where a trial has met few photons. */
static ca_status warn_of_dots(const chooser *c, uint32_t best, ca_error *error)
{
    const ca_method_trial *trial = &c->trials[best];
    const double passes = c->scores[best].passes;
    const double photons = passes * ca_method_trial_photons(trial);
    if (!ca_method_merges(&c->methods[best]) || c->plan->rays != CA_RAYS_OF_SETTINGS) return CA_OK;
    if (c->ended || photons > MANY_PHOTONS) return CA_OK;
    return ca_preflight_chosen(c->plan, passes, photons, c->plan->method_warning, error);
}

static const ca_method finder = {.type = &ca_integrator_vavcm}, black = {.type = &ca_integrator_path};

/* There are settings that only `path` takes. */
static ca_status use_without_trials(ca_render_plan *plan, const ca_method_radii *radii, const ca_method **used,
                                    ca_error *error)
{
    *used = &finder;
    CA_TRY(use(plan, &finder, radii, error));
    ca_render_plan tried = *plan; /* which takes its memory */
    if (ca_render_passes_check(&tried, error) != CA_ERROR_UNSUPPORTED) return CA_OK;
    *used = &black;
    return use(plan, &black, NULL, error);
}

ca_status ca_auto_method_use_any(ca_render_plan *plan, ca_error *error)
{
    const ca_method *used;
    return use_without_trials(plan, NULL, &used, error);
}

/* Of a choice that ended before any trial told something. */
static ca_status use_untried(chooser *c, ca_error *error)
{
    ca_render_plan *plan = c->plan;
    const ca_method *used;
    char method[192];
    CA_TRY(use_without_trials(plan, &c->radii, &used, error));
    const bool has_light_paths = ca_method_has_light_paths(used);
    const ca_tried_method untried = {.name = used->type->name,
                                     .light_paths = has_light_paths ? ca_method_light_paths(used, plan) : 0.0,
                                     .guided = ca_integrator_value(plan->type, &plan->input, "guide", 0.0) != 0.0};
    write_method(plan, &untried, method, sizeof method);
    snprintf(plan->method.reason, sizeof plan->method.reason, "auto: %s, untried: the choice was interrupted",
             method);
    return CA_OK;
}

static ca_status choose(chooser *c, ca_error *error)
{
    CA_TRY(run_pilots(c, error));
    c->trials_start = ca_clock_seconds();
    CA_TRY(add_first(c, error));
    CA_TRY(run_rounds(c, error));
    c->plan->ended = c->ended;
    c->plan->method.seconds = seconds_so_far(c);
    if (c->scored == 0) return use_untried(c, error);
    const uint32_t best = ca_method_best(c->scores, c->scored);
    note_trials(c);
    CA_TRY(use(c->plan, &c->methods[best], &c->radii, error));
    CA_TRY(warn_of_dots(c, best, error));
    c->plan->method.seconds = seconds_so_far(c);
    write_reason(c, best);
    return CA_OK;
}

static ca_status choose_by_trials(ca_render_plan *plan, ca_error *error)
{
    chooser c = {.plan = plan, .start = ca_clock_seconds(), .seconds_allowed = (double)INFINITY};
    c.trials = ca_alloc_zeroed(CA_MOST_METHODS, sizeof *c.trials);
    if (!c.trials) return ca_fail_memory(error, "the trials");
    const ca_status status = choose(&c, error);
    for (uint32_t i = 0; i < CA_MOST_METHODS; i++) ca_method_trial_destroy(&c.trials[i]);
    ca_light_pilot_destroy(&c.pilot);
    for (uint32_t i = 0; i < GUIDES; i++) ca_emission_guide_destroy(c.guides[i]);
    ca_shown_light_destroy(&c.shown);
    ca_method_weights_destroy(&c.weights);
    ca_free(c.trials);
    return status;
}

ca_status ca_auto_method_choose(ca_render_plan *plan, ca_error *error)
{
    if (plan->rays == CA_RAYS_OF_FILE) return ca_method_of_file_use(plan, error);
    if (plan->scene->light_count > 0) return choose_by_trials(plan, error);
    return use(plan, &black, NULL, error);
}
