/* A trial, the validation run or a phase: iterations with the numbers in use, until the run's own end. */
#include "render/auto_rays_state.h"

enum { TIMES_KEPT = 8 }; /* of each kind, measured with other numbers before (ray_times.h) */

ca_status ca_auto_work_create(const ca_auto_rays *a, ca_auto_work_film *work, ca_error *error)
{
    const ca_film *frame = &a->frame;
    CA_TRY(ca_film_create(&work->film, frame->full_width, frame->full_height, a->plan->crop, error));
    if (!work->run->measures) return CA_OK;
    return ca_auto_pairs_create(a, a->numbers.light_paths, a->numbers.most, &work->pairs, error);
}

void ca_auto_work_destroy(ca_auto_work_film *work)
{
    ca_film_destroy(&work->film);
    ca_pair_film_destroy(&work->pairs);
}

static ca_status run_iteration(ca_auto_rays *a, ca_auto_batch *batch, ca_auto_work_film *work, ca_error *error)
{
    double seconds;
    const ca_auto_role role = ca_auto_role_of(work->run, work->iterations);
    const bool gathers = role == CA_AUTO_GATHERS_PAIRS, warm = work->iterations > 0;
    CA_TRY(ca_auto_batch_run(a, batch, &work->film, gathers ? &work->pairs : NULL,
                             role == CA_AUTO_MEASURES_TIMES ? a->times : NULL, &seconds, error));
    work->iterations++;
    work->seconds += seconds;
    work->gathering += gathers;
    if (!gathers && warm) {
        work->plain++;
        work->plain_seconds += seconds;
    }
    a->render_iterations++;
    return CA_OK;
}

static void look(ca_auto_rays *a, const ca_auto_work_film *work)
{
    ca_noise_looks *looks = &a->progress.looks;
    const double passes = work->passes_before + work->iterations;
    if (!work->run->predicts) {
        if (ca_auto_check_is_due(&a->progress, work->iterations)) (void)ca_auto_look(a);
    } else if (work->iterations > 1 && ca_noise_looks_due(looks, passes)) {
        ca_noise_looks_take(looks, passes, ca_auto_look(a), a->progress.seconds, work->seconds / work->iterations);
    }
}

/* Of a single iteration the noise is not known: it is left out. */
static void end_early(ca_auto_rays *a, ca_auto_batch *batch, ca_auto_work_film *work, ca_status status)
{
    ca_auto_end_early(a, status);
    if (work->iterations >= 2) return;
    a->render_iterations -= work->iterations;
    work->iterations = 0;
    ca_auto_batch_drop(a, batch);
}

static bool is_over(const ca_auto_rays *a, const ca_auto_work_film *work)
{
    if (!ca_auto_repeats(a)) return ca_auto_run_is_over(work->run, &a->goal, &a->progress, work->iterations);
    const bool stopped = a->progress.stopped && work->iterations >= 2;
    return stopped || work->iterations >= ca_auto_script_group(a)->iterations;
}

/* Nothing follows this run. */
static bool render_is_over(const ca_auto_rays *a)
{
    return ca_auto_work(&a->goal, &a->progress) >= ca_auto_work_end(&a->goal) ||
           ca_auto_is_over(&a->goal, &a->progress);
}

static ca_status run_iterations(ca_auto_rays *a, ca_auto_batch *batch, ca_auto_work_film *work, ca_error *error)
{
    const ca_auto_place place = {CA_AUTO_AT_RUN, NULL, work, &batch->runner.workers};
    ca_status status = CA_OK;
    while (status == CA_OK && !is_over(a, work)) {
        status = run_iteration(a, batch, work, error);
        if (status != CA_OK) break;
        ca_auto_report(a);
        look(a, work);
        ca_auto_keep(a, &place, work->iterations);
    }
    if (status != CA_OK || render_is_over(a))
        ca_auto_keep_last(a, &place, work->iterations, status != CA_OK || a->interrupted);
    return status;
}

static ca_status iterate(ca_auto_rays *a, ca_auto_work_film *work, ca_error *error)
{
    ca_auto_batch batch = {.integrator = NULL};
    const ca_pair_film *pairs = work->run->measures ? &work->pairs : NULL;
    ca_status status = ca_auto_batch_begin(a, &batch, &work->film, pairs, work->iterations, error);
    const bool began = status == CA_OK;
    a->work = work;
    if (began) status = run_iterations(a, &batch, work, error);
    if (status != CA_OK && (began || work->iterations > 0)) {
        end_early(a, &batch, work, status);
        status = CA_OK;
    }
    a->work = NULL;
    ca_auto_batch_end(a, &batch);
    return status;
}

/* The run becomes a part of R. */
static void join(ca_auto_rays *a, const ca_auto_work_film *work)
{
    const double share = ca_auto_share_at_work(a, work->run);
    if (ca_auto_is_kept(a)) ca_auto_record_last(&a->record)->share = share;
    ca_joined_film_add(&a->render, &work->film, share);
    a->shares += share;
    a->runs++;
    if (!work->run->measures || a->failure != CA_OK) return;
    if (work->plain > 0) a->plain_seconds = work->plain_seconds / work->plain;
    ca_auto_learn(a, &work->pairs, work->gathering);
}

static void describe(const ca_auto_rays *a, const ca_auto_work_film *work, ca_auto_outcome *outcome)
{
    const double noise = ca_film_summarise(&work->film).noise;
    outcome->light_paths = a->numbers.light_paths;
    outcome->relative_variance = noise * noise * work->iterations;
    outcome->iteration_seconds = work->seconds / work->iterations;
    outcome->plain_seconds = a->plain_seconds;
}

/* One that is gone on with, or a new one. */
static ca_status begin(ca_auto_rays *a, const ca_auto_run *run, ca_auto_work_film *work, ca_error *error)
{
    if (a->kept.resumed) {
        *work = a->kept.resumed->work;
        work->run = run;
        ca_free(a->kept.resumed);
        a->kept.resumed = NULL;
        return CA_OK;
    }
    if (run->measures) ca_ray_times_thin(a->times, TIMES_KEPT);
    CA_TRY(ca_auto_work_create(a, work, error));
    return ca_auto_keep_group(a, CA_AUTO_GROUP_RUN, run->measures, error);
}

ca_status ca_auto_run_do(ca_auto_rays *a, const ca_auto_run *run, double passes_before, ca_auto_outcome *outcome,
                         ca_error *error)
{
    ca_auto_work_film work = {.run = run, .passes_before = passes_before};
    ca_status status = begin(a, run, &work, error);
    if (status == CA_OK) status = iterate(a, &work, error);
    if (status == CA_OK && work.iterations > 0) {
        join(a, &work);
        describe(a, &work, outcome);
    }
    ca_auto_work_destroy(&work);
    return status;
}
