/* The pilot: iterations of two halves in turns, and what they tell. What it needs is freed when it ends. */
#include "render/auto_rays_state.h"

/* What is made of one half's samples alone. */
typedef struct pilot_half {
    ca_film film;       /* of the group at work: the ramp, then ordinary iterations */
    ca_pair_film pairs; /* of ordinary iterations */
    ca_ray_times *times;
    double plain_seconds; /* of the clock, of ordinary iterations that gathered no pairs ... */
    uint32_t plain;       /* ... and how many these are */
    uint32_t gathering;   /* the others */
} pilot_half;

typedef struct pilot {
    pilot_half halves[CA_PILOT_HALVES];
} pilot;

/* ---- Memory ---------------------------------------------------------------------------------------------------- */

static ca_status create(const ca_auto_rays *a, pilot *p, ca_error *error)
{
    const ca_film *frame = &a->frame;
    for (int h = 0; h < CA_PILOT_HALVES; h++) {
        pilot_half *half = &p->halves[h];
        CA_TRY(ca_film_create(&half->film, frame->full_width, frame->full_height, a->plan->crop, error));
        CA_TRY(ca_ray_times_create(&half->times, frame->width, frame->height, a->plan->threads, error));
    }
    return CA_OK;
}

static void destroy_films(pilot *p)
{
    for (int h = 0; h < CA_PILOT_HALVES; h++) ca_film_destroy(&p->halves[h].film);
}

static void destroy(pilot *p)
{
    destroy_films(p);
    for (int h = 0; h < CA_PILOT_HALVES; h++) {
        ca_pair_film_destroy(&p->halves[h].pairs);
        ca_ray_times_destroy(p->halves[h].times);
    }
}

/* ---- Iterations ------------------------------------------------------------------------------------------------ */

static ca_status run_iteration(ca_auto_rays *a, pilot *p, ca_auto_batch *batch, ca_pilot_step step,
                               ca_pilot_group *group, double *seconds, ca_error *error)
{
    const ca_pilot_role role = ca_pilot_role_of(step, group->iterations);
    pilot_half *half = &p->halves[role.half];
    CA_TRY(ca_auto_batch_run(a, batch, &half->film, role.gathers_pairs ? &half->pairs : NULL,
                             role.gathers_pairs ? NULL : half->times, seconds, error));
    *group = ca_pilot_count(*group);
    half->gathering += role.gathers_pairs;
    if (step == CA_PILOT_ORDINARY && !role.gathers_pairs) {
        half->plain_seconds += *seconds;
        half->plain++;
    }
    ca_auto_report(a);
    return CA_OK;
}

/* The render may end in its pilot: at its noise target. With the pilot's numbers the predicted time is too long. */
static void look(ca_auto_rays *a, const pilot *p)
{
    if (!ca_pilot_look_is_due(&a->progress, a->ordinary.iterations)) return;
    const ca_film films[CA_PILOT_HALVES] = {p->halves[0].film, p->halves[1].film};
    ca_noise_looks *looks = &a->progress.looks;
    const double ratio = ca_auto_look_in_pilot(a, films) / looks->target;
    if (ratio >= 0.0) looks->seconds_predicted = a->progress.seconds * ratio * ratio;
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

/* Two iterations of the ramp, or ordinary ones to the pilot's end; as many of each half. *seconds: of the last one.
 * Those before it have warmed up memory and caches. */
static ca_status run_group(ca_auto_rays *a, pilot *p, ca_pilot_step step, ca_pilot_group *group, double *seconds,
                           ca_error *error)
{
    ca_auto_batch batch;
    bool over = false;
    ca_auto_use_uniform(a, group->numbers);
    const ca_pair_film *pairs = step == CA_PILOT_ORDINARY ? &p->halves[0].pairs : NULL;
    ca_status status = ca_auto_batch_begin(a, &batch, &p->halves[0].film, pairs, error);
    const bool began = status == CA_OK;
    while (status == CA_OK && !over) {
        status = run_iteration(a, p, &batch, step, group, seconds, error);
        if (status != CA_OK || group->iterations % CA_PILOT_HALVES != 0) continue;
        if (step == CA_PILOT_ORDINARY) look(a, p);
        over = step == CA_PILOT_RAMP || ca_pilot_is_long_enough(&a->goal, &a->progress, group->iterations);
    }
    if (began && status != CA_OK) status = end_early(a, &batch, group, status);
    ca_auto_batch_end(a, &batch);
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

/* Where paths connect, each camera path of a pixel has a light path of its own. */
static ca_pilot_decision decide_numbers(const ca_auto_rays *a, const ca_pilot_situation *situation)
{
    ca_pilot_decision decision = ca_pilot_decide(situation);
    if (ca_auto_connects(a) && decision.numbers.camera_paths > decision.numbers.light_paths)
        decision.numbers.camera_paths = decision.numbers.light_paths;
    return decision;
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
                                    .most_light_paths = UINT32_MAX,
                                    .ramp = a->ramp,
                                    .iteration_seconds = seconds};
    *decision = decide_numbers(a, &situation);
    if (decision->step == CA_PILOT_END) return CA_OK;
    CA_TRY(fit_memory(a, decision, &light_paths, error));
    if (light_paths == decision->numbers.light_paths) return CA_OK;
    situation.most_light_paths = light_paths;
    *decision = decide_numbers(a, &situation);
    return CA_OK;
}

static ca_status run_ramp(ca_auto_rays *a, pilot *p, ca_pilot_decision *next, ca_error *error)
{
    double seconds = 0.0;
    CA_TRY(decide(a, seconds, next, error));
    while (next->step == CA_PILOT_RAMP) {
        a->ramp.numbers = next->numbers;
        CA_TRY(run_group(a, p, CA_PILOT_RAMP, &a->ramp, &seconds, error));
        CA_TRY(decide(a, seconds, next, error));
    }
    return CA_OK;
}

static ca_status begin_ordinary(const ca_auto_rays *a, pilot *p, ca_error *error)
{
    const ca_pilot_numbers numbers = a->ordinary.numbers;
    for (int h = 0; h < CA_PILOT_HALVES; h++) {
        ca_film_clear(&p->halves[h].film);
        CA_TRY(ca_auto_pairs_create(a, numbers.light_paths, numbers.camera_paths, &p->halves[h].pairs, error));
    }
    return CA_OK;
}

/* The ramp's films make room for the ordinary iterations. */
static ca_status run_iterations(ca_auto_rays *a, pilot *p, ca_error *error)
{
    double seconds;
    ca_pilot_decision next;
    CA_TRY(run_ramp(a, p, &next, error));
    CA_TRY(ca_halved_film_create(&a->pilot, &a->frame, error));
    ca_halved_film_add(&a->pilot, &p->halves[0].film, &p->halves[1].film, 1.0);
    a->ordinary.numbers = next.step == CA_PILOT_ORDINARY ? next.numbers : a->pilot_settings;
    if (next.step == CA_PILOT_END) return CA_OK;
    CA_TRY(begin_ordinary(a, p, error));
    CA_TRY(run_group(a, p, CA_PILOT_ORDINARY, &a->ordinary, &seconds, error));
    if (a->ordinary.iterations == 0) return CA_OK;
    const double ramp = ca_pilot_ramp_share(&a->ramp, &a->ordinary);
    ca_halved_film_scale(&a->pilot, ramp);
    ca_halved_film_add(&a->pilot, &p->halves[0].film, &p->halves[1].film, 1.0 - ramp);
    return CA_OK;
}

/* ---- What they tell -------------------------------------------------------------------------------------------- */

/* From this half alone: its choice does not know the noise, which is that of both. */
static ca_status judge_half(ca_auto_rays *a, const pilot_half *half, ca_pilot_verdict *verdict, ca_error *error)
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
static void merge_halves(ca_auto_rays *a, pilot *p)
{
    pilot_half *first = &p->halves[0], *second = &p->halves[1];
    ca_pair_film_pool(&first->pairs, &second->pairs, 1);
    ca_ray_times_pool(first->times, second->times);
    ca_auto_forget(a);
    ca_auto_learn(a, &first->pairs, first->gathering + second->gathering);
    a->plain_seconds = (first->plain_seconds + second->plain_seconds) / (first->plain + second->plain);
    a->times = first->times;
    first->times = NULL;
}

static ca_status learn(ca_auto_rays *a, pilot *p, ca_error *error)
{
    CA_TRY(ca_auto_known_create(a, error));
    for (int h = 0; h < CA_PILOT_HALVES; h++) CA_TRY(judge_half(a, &p->halves[h], &a->verdicts[h], error));
    merge_halves(a, p);
    return CA_OK;
}

/* ---- All ------------------------------------------------------------------------------------------------------- */

ca_status ca_auto_pilot_run(ca_auto_rays *a, ca_error *error)
{
    pilot p = {0};
    ca_status status = create(a, &p, error);
    if (status == CA_OK) status = run_iterations(a, &p, error);
    destroy_films(&p);
    a->pilot_seconds = a->progress.seconds;
    a->pilot_work = ca_auto_work(&a->goal, &a->progress);
    if (status == CA_OK) (void)ca_auto_look(a);
    const bool ends = a->pilot_work >= ca_auto_work_end(&a->goal) || ca_auto_is_over(&a->goal, &a->progress);
    if (status == CA_OK && !ends) status = learn(a, &p, error);
    destroy(&p);
    return status;
}
