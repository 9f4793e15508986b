/* The pilot: iterations of two halves in turns, and what they tell. What it needs is freed when it ends. */
#include "render/auto_rays_state.h"

/* ---- Memory ---------------------------------------------------------------------------------------------------- */

ca_status ca_auto_pilot_create(const ca_auto_rays *a, ca_auto_pilot *p, ca_error *error)
{
    const ca_film *frame = &a->frame;
    for (int h = 0; h < CA_PILOT_HALVES; h++) {
        ca_auto_half *half = &p->halves[h];
        CA_TRY(ca_film_create(&half->film, frame->full_width, frame->full_height, a->plan->crop, error));
        CA_TRY(ca_ray_times_create(&half->times, frame->width, frame->height, a->plan->threads, error));
    }
    return CA_OK;
}

static void destroy_films(ca_auto_pilot *p)
{
    for (int h = 0; h < CA_PILOT_HALVES; h++) ca_film_destroy(&p->halves[h].film);
}

void ca_auto_pilot_destroy(ca_auto_pilot *p)
{
    destroy_films(p);
    for (int h = 0; h < CA_PILOT_HALVES; h++) {
        ca_pair_film_destroy(&p->halves[h].pairs);
        ca_ray_times_destroy(p->halves[h].times);
        p->halves[h].times = NULL;
    }
}

/* ---- Iterations ------------------------------------------------------------------------------------------------ */

static ca_status run_iteration(ca_auto_rays *a, ca_auto_pilot *p, ca_auto_batch *batch, ca_pilot_step step,
                               ca_pilot_group *group, ca_error *error)
{
    const ca_pilot_role role = ca_pilot_role_of(step, group->iterations);
    ca_auto_half *half = &p->halves[role.half];
    CA_TRY(ca_auto_batch_run(a, batch, &half->film, role.gathers_pairs ? &half->pairs : NULL,
                             role.gathers_pairs ? NULL : half->times, &p->seconds, error));
    *group = ca_pilot_count(*group);
    half->gathering += role.gathers_pairs;
    if (step == CA_PILOT_ORDINARY && !role.gathers_pairs) {
        half->plain_seconds += p->seconds;
        half->plain++;
    }
    return CA_OK;
}

/* The render may end in its pilot: at its noise target. With the pilot's numbers the predicted time is too long. */
static void look(ca_auto_rays *a, const ca_auto_pilot *p)
{
    if (!ca_pilot_look_is_due(&a->progress, a->ordinary.iterations)) return;
    const ca_film films[CA_PILOT_HALVES] = {p->halves[0].film, p->halves[1].film};
    ca_noise_looks *looks = &a->progress.looks;
    const double ratio = ca_auto_look_in_pilot(a, films) / looks->target;
    const double choosing = a->goal.choosing;
    if (ratio >= 0.0) looks->seconds_predicted = choosing + (a->progress.seconds - choosing) * ratio * ratio;
}

/* Both halves must have samples: what one of them has alone is left out. */
static ca_status end_early(ca_auto_rays *a, ca_auto_batch *batch, ca_pilot_group *group, ca_status status)
{
    if (a->iterations < CA_PILOT_HALVES) return status;
    ca_auto_end_early(a, status);
    if (group->iterations >= CA_PILOT_HALVES) return CA_OK;
    group->iterations = 0;
    ca_auto_batch_drop(a, batch);
    return CA_OK;
}

/* As many iterations of each half. */
static bool group_is_over(const ca_auto_rays *a, ca_pilot_step step, uint32_t iterations, uint32_t passes)
{
    const bool even = iterations % CA_PILOT_HALVES == 0;
    if (ca_auto_repeats(a)) return passes >= ca_auto_script_group(a)->iterations || (even && a->progress.stopped);
    if (!even) return false;
    return step == CA_PILOT_RAMP || ca_pilot_is_long_enough(&a->goal, &a->progress, iterations);
}

/* The iterations of a step, which a checkpoint may have some of, and what the caller is told in between. */
static ca_status run_iterations_of(ca_auto_rays *a, ca_auto_pilot *p, ca_auto_batch *batch, ca_pilot_step step,
                                   ca_pilot_group *group, ca_error *error)
{
    const bool ordinary = step == CA_PILOT_ORDINARY;
    const ca_auto_place place = {ordinary ? CA_AUTO_AT_ORDINARY : CA_AUTO_AT_RAMP, p, NULL, &batch->runner.workers};
    bool over = batch->passes > 0 && group_is_over(a, step, group->iterations, batch->passes);
    ca_status status = CA_OK;
    while (status == CA_OK && !over) {
        status = run_iteration(a, p, batch, step, group, error);
        if (status != CA_OK) break;
        ca_auto_report(a);
        if (ordinary && group->iterations % CA_PILOT_HALVES == 0) look(a, p);
        ca_auto_keep(a, &place, batch->passes);
        over = group_is_over(a, step, group->iterations, batch->passes);
    }
    const bool ends = ca_auto_is_over(&a->goal, &a->progress) ||
                      ca_auto_work(&a->goal, &a->progress) >= ca_auto_work_end(&a->goal);
    if (status != CA_OK || ends) ca_auto_keep_last(a, &place, batch->passes, status != CA_OK || a->interrupted);
    return status;
}

/* Two iterations of the ramp, the first of which warms up memory and caches, or ordinary ones to the pilot's end.
 * `done` of them were in a checkpoint. */
static ca_status run_group(ca_auto_rays *a, ca_auto_pilot *p, ca_pilot_step step, ca_pilot_group *group,
                           uint32_t done, ca_error *error)
{
    ca_auto_batch batch = {.integrator = NULL};
    ca_auto_use_uniform(a, group->numbers);
    CA_TRY(ca_auto_keep_group(a, step == CA_PILOT_RAMP ? CA_AUTO_GROUP_RAMP : CA_AUTO_GROUP_ORDINARY, false, error));
    const ca_pair_film *pairs = step == CA_PILOT_ORDINARY ? &p->halves[0].pairs : NULL;
    ca_status status = ca_auto_batch_begin(a, &batch, &p->halves[0].film, pairs, done, error);
    const bool began = status == CA_OK;
    if (began) status = run_iterations_of(a, p, &batch, step, group, error);
    if (began && status != CA_OK) status = end_early(a, &batch, group, status);
    ca_auto_batch_end(a, &batch);
    if (ca_auto_repeats(a)) a->script_next++;
    return status;
}

/* ---- Its numbers ----------------------------------------------------------------------------------------------- */

/* Halves N_F until so many light paths fit the memory at once, or there is no fewer to try. */
static ca_status fit_memory(ca_auto_rays *a, const ca_pilot_decision *decision, uint32_t *light_paths,
                            ca_error *error)
{
    const uint32_t least = decision->least_light_paths;
    bool fits = true;
    *light_paths = decision->numbers.light_paths;
    while (*light_paths > least) {
        CA_TRY(ca_render_plan_fits(a->plan, *light_paths, &fits, error));
        if (fits) break;
        *light_paths = *light_paths / 2 > least ? *light_paths / 2 : least;
    }
    return CA_OK;
}

static ca_pilot_decision decide_by_script(ca_auto_rays *a)
{
    const ca_auto_group *group = ca_auto_script_group(a);
    ca_pilot_decision decision = {.step = CA_PILOT_END};
    if (a->progress.stopped || !group || group->kind == CA_AUTO_GROUP_RUN) return decision;
    if (group->iterations < CA_PILOT_HALVES) {
        ca_auto_use_group(a, group); /* what it told */
        return decision;
    }
    decision.step = group->kind == CA_AUTO_GROUP_RAMP ? CA_PILOT_RAMP : CA_PILOT_ORDINARY;
    decision.numbers = (ca_pilot_numbers){group->light_paths, group->camera_paths};
    return decision;
}

/* Where paths connect, each camera path of a pixel has a light path of its own. */
static ca_pilot_decision decide_numbers(const ca_auto_rays *a, const ca_pilot_situation *situation)
{
    ca_pilot_decision decision = ca_pilot_decide(situation);
    if (ca_auto_connects(a) && decision.numbers.camera_paths > decision.numbers.light_paths)
        decision.numbers.camera_paths = decision.numbers.light_paths;
    return decision;
}

/* Without a limit of memory: a pass holds all its light paths. */
static uint32_t most_light_paths(const ca_auto_rays *a)
{
    if (a->plan->input.memory_bytes > 0.0) return UINT32_MAX;
    return ca_max_u32(a->pilot_settings.light_paths, CA_RAY_MOST_LIGHT_PATHS_HELD);
}

/* Decides again where the memory does not hold what was decided. */
static ca_status decide(ca_auto_rays *a, double seconds, ca_pilot_decision *decision, ca_error *error)
{
    uint32_t light_paths;
    ca_pilot_situation situation = {.goal = a->goal,
                                    .progress = a->progress,
                                    .settings = a->pilot_settings,
                                    .given = a->given,
                                    .one_camera_path = ca_auto_one_camera_path(a),
                                    .connects = ca_auto_connects(a),
                                    .most_light_paths = most_light_paths(a),
                                    .ramp = a->ramp,
                                    .iteration_seconds = seconds};
    *decision = ca_auto_repeats(a) ? decide_by_script(a) : decide_numbers(a, &situation);
    if (decision->step == CA_PILOT_END || ca_auto_repeats(a)) return CA_OK;
    CA_TRY(fit_memory(a, decision, &light_paths, error));
    if (light_paths == decision->numbers.light_paths) return CA_OK;
    situation.most_light_paths = light_paths;
    *decision = decide_numbers(a, &situation);
    return CA_OK;
}

static ca_status run_ramp(ca_auto_rays *a, ca_auto_pilot *p, ca_pilot_decision *next, ca_error *error)
{
    CA_TRY(decide(a, p->seconds, next, error));
    while (next->step == CA_PILOT_RAMP) {
        a->ramp.numbers = next->numbers;
        CA_TRY(run_group(a, p, CA_PILOT_RAMP, &a->ramp, 0, error));
        CA_TRY(decide(a, p->seconds, next, error));
    }
    a->ordinary.numbers = next->step == CA_PILOT_ORDINARY ? next->numbers : a->pilot_settings;
    return CA_OK;
}

ca_status ca_auto_pilot_create_pairs(const ca_auto_rays *a, ca_auto_pilot *p, ca_error *error)
{
    const ca_pilot_numbers numbers = a->ordinary.numbers;
    for (int h = 0; h < CA_PILOT_HALVES; h++)
        CA_TRY(ca_auto_pairs_create(a, numbers.light_paths, numbers.camera_paths, &p->halves[h].pairs, error));
    return CA_OK;
}

/* The ramp's films make room for the ordinary iterations. */
static ca_status begin_ordinary(ca_auto_rays *a, ca_auto_pilot *p, ca_error *error)
{
    for (int h = 0; h < CA_PILOT_HALVES; h++) ca_film_clear(&p->halves[h].film);
    return ca_auto_survive(a, ca_auto_pilot_create_pairs(a, p, error));
}

/* `done` of the ordinary iterations were in a checkpoint, with all of the ramp. */
static ca_status run_ordinary(ca_auto_rays *a, ca_auto_pilot *p, uint32_t done, ca_error *error)
{
    CA_TRY(ca_auto_survive(a, run_group(a, p, CA_PILOT_ORDINARY, &a->ordinary, done, error)));
    if (a->ordinary.iterations < CA_PILOT_HALVES) return CA_OK;
    const double ramp = ca_pilot_ramp_share(&a->ramp, &a->ordinary);
    ca_halved_film_scale(&a->pilot, ramp);
    ca_halved_film_add(&a->pilot, &p->halves[0].film, &p->halves[1].film, 1.0 - ramp);
    return CA_OK;
}

static ca_status run_iterations(ca_auto_rays *a, ca_auto_pilot *p, ca_error *error)
{
    ca_pilot_decision next = {.step = CA_PILOT_END};
    CA_TRY(ca_auto_survive(a, run_ramp(a, p, &next, error)));
    ca_halved_film_add(&a->pilot, &p->halves[0].film, &p->halves[1].film, 1.0);
    if (a->progress.stopped || next.step == CA_PILOT_END) return CA_OK;
    CA_TRY(begin_ordinary(a, p, error));
    return a->progress.stopped ? CA_OK : run_ordinary(a, p, 0, error);
}

/* ---- What they tell -------------------------------------------------------------------------------------------- */

/* From this half alone: its choice does not know the noise, which is that of both. */
static ca_status judge_half(ca_auto_rays *a, const ca_auto_half *half, ca_pilot_verdict *verdict, ca_error *error)
{
    ca_auto_choice own;
    const ca_auto_limits limits = ca_auto_half_limits(a->ordinary.numbers.light_paths);
    ca_auto_basis basis = {half->times, half->plain_seconds / half->plain, a->progress};
    basis.progress.looks.noise = -1.0;
    ca_auto_forget(a);
    ca_auto_learn(a, &half->pairs, half->gathering);
    CA_TRY(ca_auto_choose(a, &basis, &limits, &own, error));
    *verdict = (ca_pilot_verdict){.gain = own.numbers.gain_over_given,
                                  .seconds_per_sample = own.candidate.seconds / own.candidate.camera_paths,
                                  .iteration_seconds = basis.plain_seconds};
    ca_auto_choice_destroy(&own);
    return CA_OK;
}

/* After both halves have fixed their weights, they are merged. */
static void merge_halves(ca_auto_rays *a, ca_auto_pilot *p)
{
    ca_auto_half *first = &p->halves[0], *second = &p->halves[1];
    ca_pair_film_pool(&first->pairs, &second->pairs, 1);
    ca_ray_times_pool(first->times, second->times);
    ca_auto_forget(a);
    ca_auto_learn(a, &first->pairs, first->gathering + second->gathering);
    a->plain_seconds = (first->plain_seconds + second->plain_seconds) / (first->plain + second->plain);
    a->times = first->times;
    first->times = NULL;
}

/* Where a record is repeated the halves decide nothing. */
static ca_status learn(ca_auto_rays *a, ca_auto_pilot *p, ca_error *error)
{
    CA_TRY(ca_auto_known_create(a, error));
    for (int h = 0; h < CA_PILOT_HALVES && !ca_auto_repeats(a); h++)
        CA_TRY(judge_half(a, &p->halves[h], &a->verdicts[h], error));
    merge_halves(a, p);
    return CA_OK;
}

/* ---- All ------------------------------------------------------------------------------------------------------- */

static bool render_ends(const ca_auto_rays *a)
{
    if (a->progress.stopped || a->chooses_only) return a->progress.stopped;
    if (ca_auto_repeats(a)) return ca_auto_script_group(a) == NULL;
    return a->pilot_work >= ca_auto_work_end(&a->goal) || ca_auto_is_over(&a->goal, &a->progress);
}

static ca_status run_resumed(ca_auto_rays *a, ca_auto_pilot *p, ca_error *error)
{
    const ca_auto_stage stage = a->kept.resumed->stage;
    *p = a->kept.resumed->pilot;
    a->kept.resumed->pilot = (ca_auto_pilot){.seconds = 0.0};
    ca_free(a->kept.resumed);
    a->kept.resumed = NULL;
    return stage == CA_AUTO_AT_RAMP ? run_iterations(a, p, error)
                                    : run_ordinary(a, p, a->ordinary.iterations, error);
}

ca_status ca_auto_pilot_run(ca_auto_rays *a, ca_error *error)
{
    ca_auto_pilot p = {.seconds = 0.0};
    ca_status status = CA_OK;
    if (a->kept.resumed) {
        status = run_resumed(a, &p, error);
    } else {
        status = ca_halved_film_create(&a->pilot, &a->frame, error);
        if (status == CA_OK) status = ca_auto_pilot_create(a, &p, error);
        if (status == CA_OK) status = run_iterations(a, &p, error);
    }
    destroy_films(&p);
    a->pilot_seconds = a->progress.seconds - a->goal.choosing;
    a->pilot_work = ca_auto_work(&a->goal, &a->progress);
    if (status == CA_OK) (void)ca_auto_look(a);
    if (status == CA_OK && !render_ends(a)) status = ca_auto_survive(a, learn(a, &p, error));
    ca_auto_pilot_destroy(&p);
    return status;
}
