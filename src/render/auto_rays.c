#include "render/auto_rays.h"

#include "base/clock.h"
#include "base/memory.h"
#include "render/auto_rays_state.h"

/* Of choosing alone, s: what it takes is lost. */
#define LONGEST_PILOT 120.0
#define LONGEST_TRIAL (0.5 * LONGEST_PILOT)

/* ---- What the caller is told ----------------------------------------------------------------------------------- */

void ca_auto_report(ca_auto_rays *a)
{
    const ca_render_settings *settings = a->plan->settings;
    if (a->interrupted) return;
    ca_render_progress progress = {
        .passes_done = a->iterations,
        .seconds = a->progress.seconds,
        .seconds_total = settings->seconds,
        .seconds_predicted = a->progress.looks.seconds_predicted,
        .seconds_choosing = a->goal.choosing,
        .noise_percent = a->progress.looks.noise,
        .noise_target = settings->noise_percent,
        .noise_passes = a->look_iterations,
        .noise_seconds = a->look_seconds,
        .checkpoint_failure = ca_checkpoint_failure(&a->kept.checkpoint),
        .method = a->plan->method.reason[0] ? a->plan->method.reason : NULL,
        .method_warning = a->plan->method_warning[0] ? a->plan->method_warning : NULL,
        .render = a,
    };
    /* In the pilot and in a run's first iteration variances are not known, and the image cannot be joined. */
    if (a->work && a->work->iterations >= 2) progress.snapshot = ca_auto_snapshot;
    if (a->goal.samples > 0.0) {
        const double left = (a->goal.samples - a->progress.camera_paths) / a->numbers.mean;
        progress.passes_total = a->iterations + (left > 0.0 ? (uint32_t)ceil(left) : 0);
    }
    if (ca_auto_repeats(a)) progress.passes_total = ca_auto_record_iterations(&a->script);
    a->interrupted = !ca_render_tell(a->plan, &progress, &a->start);
    a->progress.stopped = a->interrupted || a->next.largest + a->numbers.most > (double)UINT32_MAX;
}

void ca_auto_end_early(ca_auto_rays *a, ca_status status)
{
    a->progress.stopped = a->ended_early = true;
    if (status == CA_ERROR_INTERRUPTED)
        a->interrupted = true;
    else
        a->failure = status;
}

ca_status ca_auto_survive(ca_auto_rays *a, ca_status status)
{
    if (status == CA_OK || a->iterations < CA_PILOT_HALVES) return status;
    ca_auto_end_early(a, status);
    return CA_OK;
}

/* ---- Steps ----------------------------------------------------------------------------------------------------- */

/* Choices that no run has used yet, and what PREDICT has told the next phase. */
typedef struct step_memory {
    ca_auto_choice best, tried;
    double passes_before;
} step_memory;

static ca_status choose(ca_auto_rays *a, const ca_auto_limits *limits, ca_auto_choice *choice,
                        ca_auto_outcome *outcome, ca_error *error)
{
    const ca_auto_basis basis = {a->times, a->plain_seconds, a->progress};
    ca_auto_choice_destroy(choice);
    CA_TRY(ca_auto_choose(a, &basis, limits, choice, error));
    a->costs = choice->costs;
    outcome->candidate = choice->candidate;
    return CA_OK;
}

static void predict(ca_auto_rays *a, const ca_auto_prediction *prediction, step_memory *memory)
{
    const double noise = ca_auto_look(a), iterations = ca_pilot_worth(&a->ramp, &a->ordinary) + a->render_iterations;
    ca_noise_looks *looks = &a->progress.looks;
    if (ca_noise_looks_over(looks)) return; /* no time is left to predict */
    memory->passes_before = ca_auto_passes_so_far(prediction->relative_variance, looks->noise, iterations);
    ca_noise_looks_take(looks, memory->passes_before, noise, a->progress.seconds, prediction->seconds);
}

static ca_status run(ca_auto_rays *a, const ca_auto_run *run, step_memory *memory, ca_auto_outcome *outcome,
                     ca_error *error)
{
    if (run->numbers != CA_AUTO_UNCHANGED && !a->kept.resumed)
        ca_auto_use(a, run->numbers == CA_AUTO_BEST ? &memory->best : &memory->tried);
    ca_auto_choice_destroy(&memory->best);
    ca_auto_choice_destroy(&memory->tried);
    return ca_auto_run_do(a, run, memory->passes_before, outcome, error);
}

static ca_status perform(ca_auto_rays *a, const ca_auto_decision *decision, step_memory *memory,
                         ca_auto_outcome *outcome, ca_error *error)
{
    switch (decision->step) {
    case CA_AUTO_CHOOSE: return choose(a, &decision->limits, &memory->best, outcome, error);
    case CA_AUTO_CHOOSE_TRIAL: return choose(a, &decision->limits, &memory->tried, outcome, error);
    case CA_AUTO_PREDICT: predict(a, &decision->prediction, memory); return CA_OK;
    case CA_AUTO_TRIAL:
    case CA_AUTO_VALIDATE:
    case CA_AUTO_PHASE: return run(a, &decision->run, memory, outcome, error);
    case CA_AUTO_PILOT:
    case CA_AUTO_END: break;
    }
    return CA_OK;
}

static bool is_too_long(const ca_auto_rays *a)
{
    return a->decision.step == CA_AUTO_TRIAL && a->decision.run.most * a->situation.tried.seconds > LONGEST_TRIAL;
}

/* Where the numbers are all that is wanted: all samples are still to be made. */
static void decide_once(ca_auto_rays *a, step_memory *memory)
{
    if (a->goal.samples > 0.0) a->goal.samples = a->samples_wanted + a->progress.camera_paths;
    a->situation.goal = a->goal;
    a->decision = ca_auto_decide(&a->situation);
    if (!is_too_long(a)) return;
    a->decision.step = CA_AUTO_END;
    ca_auto_choice_destroy(&memory->best); /* further away than times are known */
}

/* The step at work goes on as it was decided; what follows knows the goal as it is now. */
static void decide(ca_auto_rays *a, step_memory *memory)
{
    if (a->chooses_only) {
        decide_once(a, memory);
    } else if (a->kept.resumed) {
        a->situation.goal = a->goal;
        a->decision = ca_auto_decision_to(&a->decision, &a->goal);
    } else {
        a->decision = ca_auto_decide(&a->situation);
    }
}

static bool has_time(const ca_auto_rays *a)
{
    return a->goal.seconds == 0.0 || a->progress.seconds < a->goal.seconds;
}

/* What is decided is used. Where that was given up, or used in a trial, what is known decides; where no time is left
 * to render, nothing is better than the pilot's numbers. */
static ca_status use_best(ca_auto_rays *a, step_memory *memory, ca_error *error)
{
    ca_auto_outcome outcome;
    const ca_auto_limits limits = ca_auto_last_limits(&a->situation);
    if (a->progress.stopped) return CA_OK;
    if (!has_time(a)) {
        ca_auto_use_uniform(a, a->ordinary.numbers);
        a->predicted_gain = 1.0;
        return CA_OK;
    }
    if (!memory->best.numbers.camera_paths) CA_TRY(choose(a, &limits, &memory->best, &outcome, error));
    ca_auto_use(a, &memory->best);
    return CA_OK;
}

/* Where the numbers are all that is wanted: nothing is left to be decided before the render's own iterations. */
static bool is_chosen(const ca_auto_rays *a)
{
    return a->chooses_only && (a->progress.stopped || ca_auto_has_settled(&a->decision));
}

static ca_status perform_all(ca_auto_rays *a, step_memory *memory, ca_error *error)
{
    if (!a->kept.resumed)
        a->situation = ca_auto_plan_start(&a->goal, &a->progress, a->ordinary.numbers.light_paths);
    for (;;) {
        ca_auto_outcome outcome = {0};
        decide(a, memory);
        if (is_chosen(a)) return use_best(a, memory, error);
        if (a->decision.step == CA_AUTO_END) return CA_OK;
        CA_TRY(perform(a, &a->decision, memory, &outcome, error));
        outcome.progress = a->progress;
        a->situation = ca_auto_note(&a->situation, &a->decision, &outcome);
    }
}

/* The runs of a record. One of fewer than two iterations is left out, but for its numbers of rays. */
static ca_status repeat_all(ca_auto_rays *a, ca_error *error)
{
    const ca_auto_group *group;
    for (; (group = ca_auto_script_group(a)) != NULL && !a->progress.stopped; a->script_next++) {
        ca_auto_outcome outcome;
        const ca_auto_run run = {.measures = group->measures};
        if (group->kind != CA_AUTO_GROUP_RUN) continue;
        ca_auto_use_group(a, group);
        if (group->iterations >= 2) CA_TRY(ca_auto_run_do(a, &run, 0.0, &outcome, error));
    }
    return CA_OK;
}

/* Those behind the pilot. */
static ca_status run_rest(ca_auto_rays *a, ca_error *error)
{
    step_memory memory = {0};
    if (!a->render.pixels) CA_TRY(ca_joined_film_create(&a->render, &a->frame, error));
    const ca_status status = ca_auto_repeats(a) ? repeat_all(a, error) : perform_all(a, &memory, error);
    ca_auto_choice_destroy(&memory.best);
    ca_auto_choice_destroy(&memory.tried);
    return status;
}

static ca_status run_all(ca_auto_rays *a, ca_error *error)
{
    const bool has_pilot = a->kept.resumed && a->kept.resumed->stage == CA_AUTO_AT_RUN;
    if (!has_pilot) CA_TRY(ca_auto_pilot_run(a, error));
    if (!a->times || a->progress.stopped) return CA_OK; /* the render ended in its pilot */
    return ca_auto_survive(a, run_rest(a, error));
}

/* ---- Memory ---------------------------------------------------------------------------------------------------- */

/* Bytes of a pixel. The table of auto_rays.h, by when they are allocated. */
enum {
    TWO_MAPS = 2 * sizeof(uint32_t), /* the numbers in use, the next camera path */
    LEARNING = CA_HALVED_FILM_PIXEL_BYTES + sizeof(ca_auto_known) + CA_RAY_TIMES_PIXEL_BYTES,
    CHOOSING = sizeof(ca_ray_pixel) + CA_RAY_CHOICE_PIXEL_BYTES + 2 * sizeof(uint32_t), /* and two chosen maps */

    IN_PILOT = TWO_MAPS + CA_PASS_PIXEL_BYTES + CA_HALVED_FILM_PIXEL_BYTES +
               CA_PILOT_HALVES * (sizeof(ca_film_pixel) + sizeof(ca_pair_means) + CA_RAY_TIMES_PIXEL_BYTES),
    AT_ITS_END = TWO_MAPS + LEARNING + CA_RAY_TIMES_PIXEL_BYTES + CA_PILOT_HALVES * sizeof(ca_pair_means) + CHOOSING,
    BETWEEN_RUNS = TWO_MAPS + LEARNING + sizeof(ca_joined_pixel) + CHOOSING,
    /* Where paths connect: sums of connections, and films of other numbers; weights instead of what is known of each
     * pixel. */
    OTHER_FILMS = (int)sizeof(ca_pair_connected_means) + (int)CA_AUTO_MOST_OTHERS * (int)CA_PAIR_OTHER_MEANS_BYTES,

    IN_A_RUN = TWO_MAPS + CA_PASS_PIXEL_BYTES + LEARNING + sizeof(ca_joined_pixel) + sizeof(ca_film_pixel) +
               sizeof(ca_pair_means),
};
_Static_assert(IN_PILOT == 628 && AT_ITS_END == 496 && BETWEEN_RUNS == 552 && IN_A_RUN == 620,
               "auto_rays.h tells the bytes of a pixel");
_Static_assert((int)CA_AUTO_PIXEL_BYTES == (int)IN_PILOT, "auto_rays.h tells the most bytes of a pixel");
_Static_assert(CA_AUTO_KEPT_PIXEL_BYTES == sizeof(ca_pair_moments) + CA_AUTO_MOST_RUNS * sizeof(uint32_t),
               "auto_rays.h tells what checkpoints take");
_Static_assert((int)CA_AUTO_CONNECTED_KEPT_PIXEL_BYTES ==
                   (1 + (int)CA_AUTO_MOST_OTHERS) * (int)sizeof(ca_pair_moments),
               "auto_rays.h tells what checkpoints take where paths connect");
_Static_assert((int)CA_AUTO_CONNECTED_PIXEL_BYTES == (int)IN_PILOT + (int)CA_PILOT_HALVES * (int)OTHER_FILMS,
               "auto_rays.h tells the most bytes of a pixel where paths connect");

/* The plan has counted one film, and what a pass takes. */
static ca_status plan_memory(ca_render_plan *plan, ca_error *error)
{
    const bool connects = ca_integrator_has(plan->type, CA_ABILITY_CONNECTION_NOISE);
    const double pixels = ca_render_plan_pixels(plan);
    const double while_kept = connects ? CA_AUTO_CONNECTED_KEPT_PIXEL_BYTES : CA_AUTO_KEPT_PIXEL_BYTES;
    const double kept = plan->settings->checkpoint_path ? while_kept : 0.0;
    const double most = connects ? CA_AUTO_CONNECTED_PIXEL_BYTES : CA_AUTO_PIXEL_BYTES;
    const double bytes = (most + kept - (double)sizeof(ca_film_pixel) - CA_PASS_PIXEL_BYTES) * pixels;
    if (plan->input.memory_bytes <= 0.0) return CA_OK;
    if (bytes >= plan->input.memory_bytes)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "the films and estimates of rays \"auto\" need %.1f MiB, more than the %.1f MiB allowed",
                       plan->settings->memory_mib + (bytes - plan->input.memory_bytes) / 0x1p20,
                       plan->settings->memory_mib);
    plan->input.memory_bytes -= bytes;
    return CA_OK;
}

/* ---- Life ------------------------------------------------------------------------------------------------------ */

static ca_film frame_of(const ca_render_plan *plan)
{
    const uint32_t *crop = plan->crop;
    return (ca_film){.x0 = crop[0],
                     .y0 = crop[1],
                     .width = crop[2] - crop[0],
                     .height = crop[3] - crop[1],
                     .full_width = plan->camera.width,
                     .full_height = plan->camera.height};
}

static ca_status create(ca_auto_rays *a, ca_error *error)
{
    a->numbers.camera_paths = ca_alloc_zeroed(ca_auto_pixels(a), sizeof *a->numbers.camera_paths);
    a->next.camera_path = ca_alloc_zeroed(ca_auto_pixels(a), sizeof *a->next.camera_path);
    if (!a->numbers.camera_paths || !a->next.camera_path) return ca_fail_memory(error, "the numbers of rays");
    CA_TRY(ca_integrator_make_guide(a->plan->type, &a->plan->input, &a->guide, error));
    a->plan->input.guide = a->guide;
    return CA_OK;
}

static void destroy(ca_auto_rays *a)
{
    ca_free(a->numbers.camera_paths);
    ca_free(a->next.camera_path);
    ca_free(a->known);
    ca_auto_nodes_destroy(&a->nodes);
    a->plan->input.guide = NULL;
    ca_emission_guide_destroy(a->guide);
    ca_ray_times_destroy(a->times);
    ca_halved_film_destroy(&a->pilot);
    ca_joined_film_destroy(&a->render);
    ca_auto_keep_end(a);
}

/* The image is there whether its checkpoint could be written or not. */
static ca_status tell_of_checkpoint(const ca_auto_rays *a, ca_status status, ca_error *error)
{
    if (status != CA_OK) return status;
    return ca_checkpoint_result(&a->kept.checkpoint, a->plan->settings, a->interrupted, error);
}

static ca_noise_looks start_looks(const ca_render_plan *plan)
{
    const double pixels = ca_render_plan_pixels(plan);
    return ca_noise_looks_start(plan->settings->noise_percent, 0.0,
                                ca_noise_looks_patience(pixels, plan->scene->light_count > 0));
}

static ca_auto_rays rays_of(ca_render_plan *plan)
{
    const double unknown = (double)NAN;
    return (ca_auto_rays){
        .plan = plan,
        .frame = frame_of(plan),
        .progress.looks = start_looks(plan),
        .start = ca_clock_seconds() - plan->method.seconds, /* the method's choice is a part of the render */
        .predicted_gain = unknown,
        .costs = {.iteration = unknown, .light_path = unknown, .camera_path = unknown, .candidate = unknown},
    };
}

ca_status ca_auto_rays_render(ca_render_plan *plan, const ca_auto_observer *observer, ca_image_layers **image,
                              ca_render_statistics *statistics, ca_error *error)
{
    ca_auto_rays a = rays_of(plan);
    a.observer = observer;
    CA_TRY(plan_memory(plan, error));
    CA_TRY(ca_auto_read_settings(&a, error));
    ca_status status = create(&a, error);
    if (status == CA_OK) status = ca_auto_keep_start(&a, error);
    if (status == CA_OK) status = run_all(&a, error);
    ca_reserve_open(plan->reserve);
    if (status == CA_OK) status = ca_auto_finish(&a, image, statistics, a.failure == CA_OK ? error : NULL);
    if (a.failure == CA_OK) status = tell_of_checkpoint(&a, status, error);
    destroy(&a);
    return a.failure == CA_OK ? status : a.failure;
}

static void take_choice(ca_auto_rays *a, ca_auto_chosen *chosen)
{
    *chosen = (ca_auto_chosen){.light_paths = a->numbers.light_paths, .camera_paths = a->numbers.camera_paths};
    a->numbers.camera_paths = NULL;
    ca_auto_tell_numbers(a, &chosen->told);
    chosen->told.phases = 1;
}

ca_status ca_auto_rays_choose(ca_render_plan *plan, ca_auto_chosen *chosen, ca_error *error)
{
    ca_auto_rays a = rays_of(plan);
    a.chooses_only = true;
    *chosen = (ca_auto_chosen){0};
    CA_TRY(plan_memory(plan, error));
    CA_TRY(ca_auto_read_settings(&a, error));
    a.goal.longest_pilot = LONGEST_PILOT;
    a.samples_wanted = a.goal.samples;
    ca_status status = create(&a, error);
    if (status == CA_OK) status = run_all(&a, error);
    if (status == CA_OK) status = a.failure;
    if (status == CA_OK && !a.progress.stopped) take_choice(&a, chosen);
    destroy(&a);
    return status;
}
