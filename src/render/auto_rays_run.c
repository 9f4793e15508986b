/* A trial, the validation run or a phase: iterations with the numbers in use, until the run's own end. */
#include "render/auto_rays_state.h"

enum { TIMES_KEPT = 8 }; /* of each kind, measured with other numbers before (ray_times.h) */

static ca_status create(ca_auto_rays *a, ca_auto_work_film *work, ca_error *error)
{
    const ca_film *frame = &a->frame;
    CA_TRY(ca_film_create(&work->film, frame->full_width, frame->full_height, a->plan->crop, error));
    if (!work->run->measures) return CA_OK;
    ca_ray_times_thin(a->times, TIMES_KEPT);
    return ca_auto_pairs_create(a, a->numbers.light_paths, a->numbers.most, &work->pairs, error);
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
    ca_auto_report(a);
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

static ca_status iterate(ca_auto_rays *a, ca_auto_work_film *work, ca_error *error)
{
    ca_auto_batch batch;
    ca_status status =
        ca_auto_batch_begin(a, &batch, &work->film, work->run->measures ? &work->pairs : NULL, error);
    a->work = work;
    const bool began = status == CA_OK;
    while (status == CA_OK && !ca_auto_run_is_over(work->run, &a->goal, &a->progress, work->iterations)) {
        status = run_iteration(a, &batch, work, error);
        if (status == CA_OK) look(a, work);
    }
    if (began && status != CA_OK) {
        end_early(a, &batch, work, status);
        status = CA_OK;
    }
    a->work = NULL;
    ca_auto_batch_end(a, &batch);
    return status;
}

static void keep(ca_auto_rays *a, const ca_auto_work_film *work)
{
    const double share = ca_auto_run_share(work->run, ca_auto_work(&a->goal, &a->progress));
    ca_joined_film_add(&a->render, &work->film, share);
    a->shares += share;
    a->runs++;
    if (!work->run->measures || a->ended_early) return;
    a->plain_seconds = work->plain_seconds / work->plain; /* the second iteration is plain */
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

ca_status ca_auto_run_do(ca_auto_rays *a, const ca_auto_run *run, double passes_before, ca_auto_outcome *outcome,
                         ca_error *error)
{
    ca_auto_work_film work = {.run = run, .passes_before = passes_before};
    ca_status status = create(a, &work, error);
    if (status == CA_OK) status = iterate(a, &work, error);
    if (status == CA_OK && work.iterations > 0) {
        keep(a, &work);
        describe(a, &work, outcome);
    }
    ca_film_destroy(&work.film);
    ca_pair_film_destroy(&work.pairs);
    return status;
}
