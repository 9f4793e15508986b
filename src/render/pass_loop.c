/* Making passes until there are enough: progress, looks at the noise, other ranks, checkpoints. */
#include "render/render_passes_state.h"

#include "base/clock.h"
#include "math/numeric.h"
#include "render/replicates.h"

#include <math.h>

/* The noise is first estimated after this many passes, then as noise_looks.h says. */
enum { FIRST_NOISE_PASS = 8 };

static void gather_for_progress(const ca_render_progress *progress);

/* Of this process, or of the one whose passes it goes on from. */
static double seconds_of_choices(const ca_pass_render *r) { return r->plan->method.seconds + r->once.seconds; }

static uint32_t passes_planned(const ca_render_plan *plan) { return plan->pass_limit - plan->first_pass; }

/* Tells the caller how far it is; false where the render should end. */
static bool report_progress(ca_pass_render *r)
{
    const ca_render_settings *settings = r->plan->settings;
    const ca_render_progress progress = {
        .passes_done = r->passes,
        .passes_total = r->plan->open_ended ? 0 : passes_planned(r->plan),
        .seconds = r->seconds,
        .seconds_total = settings->seconds,
        .seconds_predicted = r->looks.seconds_predicted,
        .seconds_choosing = seconds_of_choices(r),
        .noise_percent = r->looks.noise,
        .noise_target = settings->noise_percent,
        .noise_passes = r->look_passes,
        .noise_seconds = r->look_seconds,
        .method = r->plan->method.reason[0] ? r->plan->method.reason : NULL,
        .method_warning = r->plan->method_warning[0] ? r->plan->method_warning : NULL,
        /* an image needs all passes from 0 */
        .snapshot = r->plan->first_pass == 0 ? ca_render_passes_snapshot : NULL,
        .checkpoint_failure = ca_checkpoint_failure(&r->kept.checkpoint),
        .gather = r->ranks ? gather_for_progress : NULL,
        .render = r,
    };
    r->gathered = false;
    const bool goes_on = ca_render_tell(r->plan, &progress, &r->start);
    if (r->gathered) ca_rank_work_go_on(&r->work, r->work.look); /* no sum changes while its picture is made */
    return goes_on;
}

static bool should_stop(const ca_pass_render *r)
{
    const ca_render_settings *settings = r->plan->settings;
    if (r->passes >= passes_planned(r->plan)) return true;
    if (settings->seconds > 0.0 && r->seconds >= settings->seconds) return true;
    return ca_noise_looks_over(&r->looks);
}

/* Of those that this process has made, if there are any: what a checkpoint tells contains its choices. */
static double seconds_of_pass(const ca_pass_render *r)
{
    const uint32_t made = r->passes - r->kept.resumed;
    return made > 0 ? (r->seconds - r->kept.seconds - r->before) / made : r->seconds / r->passes;
}

static void look(ca_pass_render *r)
{
    ca_noise_looks_take(&r->looks, r->passes, 100.0 * ca_film_summarise(&r->film).noise, r->seconds,
                        seconds_of_pass(r));
    r->look_passes = r->passes;
    r->look_seconds = r->seconds;
}

/* Without a target it is only shown: what there is on this rank tells of the rest. */
static void look_at_own(ca_pass_render *r)
{
    const double known = (double)r->work.in_sums / r->passes;
    const double noise = 100.0 * ca_film_summarise(&r->film).noise * sqrt(known);
    ca_noise_looks_take(&r->looks, r->passes, noise, r->seconds, seconds_of_pass(r));
    r->look_passes = r->passes;
    r->look_seconds = r->seconds;
}

/* ---- With other ranks ------------------------------------------------------------------------------------------ */

ca_status ca_pass_loop_make_range(void *user, ca_work_range range, uint64_t *made, ca_error *error)
{
    ca_pass_render *r = user;
    ca_status status = CA_OK;
    for (*made = 0; *made < range.end - range.begin; ++*made) {
        const uint32_t pass = (uint32_t)(range.begin + *made);
        status = ca_pass_run(&r->runner, ca_replicates_begin_pass(r->plan, pass), error);
        if (status != CA_OK) break;
    }
    r->seconds = ca_clock_seconds() - r->start;
    return status;
}

/* The film then has all passes before the border of r->work: r->passes. */
static ca_status gather(ca_pass_render *r, ca_error *error)
{
    const ca_status status = ca_rank_work_gather(&r->work, error);
    r->passes = (uint32_t)r->work.in_sums;
    return status;
}

/* ca_render_progress.gather */
static void gather_for_progress(const ca_render_progress *progress)
{
    ca_pass_render *r = progress->render;
    (void)gather(r, NULL); /* what fails on this rank fails again with the next pass */
    r->gathered = true;
}

/* ---- Checkpoints ----------------------------------------------------------------------------------------------- */

static ca_status write_film(const ca_pass_render *r, const char *path, ca_error *error)
{
    uint64_t others[CA_PART_COUNTS] = {0};
    if (r->ranks) ca_rank_work_count(&r->work, others);
    const ca_kept_state state = {r->plan, &r->film, r->passes,  &r->runner.workers,
                                 &r->rays, others,   r->seconds, r->looks};
    CA_TRY(ca_rank_work_check_whole(&r->work, path, "passes", error));
    return ca_kept_write(&r->kept, &state, path, error);
}

ca_status ca_pass_loop_write(void *user, const char *path, ca_error *error)
{
    ca_pass_render *r = user;
    const bool gathers = ca_rank_work_is_open(&r->work);
    if (gathers) CA_TRY(gather(r, error));
    const ca_status status = write_film(r, path, error);
    if (gathers) ca_rank_work_go_on(&r->work, r->work.look);
    return status;
}

/* What the render is expected to take, s; INFINITY: nobody knows. */
static double whole_seconds(const ca_pass_render *r)
{
    const ca_render_plan *plan = r->plan;
    const double limit = plan->settings->seconds > 0.0 ? plan->settings->seconds : (double)INFINITY;
    if (r->looks.seconds_predicted > 0.0) return fmin(limit, r->looks.seconds_predicted);
    return plan->open_ended ? limit : fmin(limit, r->before + seconds_of_pass(r) * passes_planned(plan));
}

/* The one pass of a render that was ended while something was chosen is not worth going on from: the choice would
 * stay as it is. */
static bool may_keep(const ca_pass_render *r) { return r->passes > 0 && !r->plan->ended; }

static void keep(ca_pass_render *r)
{
    if (!may_keep(r)) return;
    ca_checkpoint_keep(&r->kept.checkpoint, r->plan->settings, whole_seconds(r), ca_pass_loop_write, r);
}

/* The time that was taken before counts. With the target that it had, the noise is looked at where it would have
 * been; with another one now, and where ranks had made the passes but had not looked yet. */
static void resume(ca_pass_render *r)
{
    const ca_pass_looks *before = &r->kept.looks;
    r->passes = r->kept.resumed;
    r->start -= r->kept.seconds;
    r->seconds = r->kept.seconds;
    ca_noise_looks_recall(&r->looks, before->noise, before->next);
    if (r->looks.target <= 0.0) return;
    if (before->target != r->looks.target || ca_noise_looks_due(&r->looks, r->passes)) look(r);
}

/* ---- The loop -------------------------------------------------------------------------------------------------- */

static ca_status run_pass(ca_pass_render *r, ca_error *error)
{
    CA_TRY(ca_pass_run(&r->runner, ca_replicates_begin_pass(r->plan, r->plan->first_pass + r->passes), error));
    r->passes++;
    r->seconds = ca_clock_seconds() - r->start;
    if (ca_noise_looks_due(&r->looks, r->passes)) look(r);
    return CA_OK;
}

static ca_status make_passes(ca_pass_render *r, ca_error *error)
{
    while (r->passes == 0 || !(r->interrupted || should_stop(r))) {
        CA_TRY(run_pass(r, error));
        keep(r);
        r->interrupted = !report_progress(r) || r->plan->ended;
    }
    return CA_OK;
}

/* The pass at which the noise is looked at next, where that may end the render. */
static uint64_t next_look(const ca_pass_render *r)
{
    if (r->looks.target <= 0.0) return UINT64_MAX;
    const double next = fmin(fmax(ceil(r->looks.next), r->passes + 1.0), passes_planned(r->plan) + 1.0);
    return r->plan->first_pass + (uint64_t)next;
}

static ca_status look_at_all(ca_pass_render *r, ca_error *error)
{
    CA_TRY(gather(r, error));
    look(r);
    if (!ca_noise_looks_over(&r->looks)) ca_rank_work_go_on(&r->work, next_look(r));
    return CA_OK;
}

/* A range, or a look; *over: there is nothing more to do. */
static ca_status make_some(ca_pass_render *r, bool *over, ca_error *error)
{
    ca_rank_work *work = &r->work;
    ca_work_range range;
    const double limit = r->plan->settings->seconds;
    work->deadline = limit > 0.0 ? r->start + limit : 0.0;
    if (ca_rank_work_take(work, &range)) {
        const ca_status status = ca_rank_work_make(work, range, error);
        r->passes = (uint32_t)work->made;
        if (status != CA_OK) return status;
        ca_rank_work_wait(work, false);
        if (r->looks.target <= 0.0 && ca_noise_looks_due(&r->looks, r->passes)) look_at_own(r);
        return CA_OK;
    }
    *over = work->next < work->look;
    if (*over) return CA_OK;
    CA_TRY(look_at_all(r, error));
    *over = ca_noise_looks_over(&r->looks);
    return CA_OK;
}

uint32_t ca_pass_loop_together(const ca_pass_render *r) { return ca_max_u32(1, ca_replicates_passes(r->plan)); }

/* As make_passes, where other ranks make passes, too. What was begun of a replicate is finished here first. */
static ca_status lead_passes(ca_pass_render *r, ca_error *error)
{
    ca_rank_work *work = &r->work;
    bool over = ca_noise_looks_over(&r->looks);
    ca_status status = CA_OK;
    work->look = next_look(r);
    work->run = ca_pass_loop_together(r);
    ca_rank_work_wait(work, r->kept.resumed % work->run != 0);
    while (status == CA_OK && !over && !r->interrupted) {
        status = make_some(r, &over, error);
        if (status != CA_OK) break;
        keep(r);
        r->interrupted = !report_progress(r) || r->plan->ended || work->end_asked;
    }
    status = ca_rank_work_finish(work, status, error);
    r->passes = (uint32_t)work->in_sums;
    r->seconds = ca_clock_seconds() - r->start;
    ca_rank_work_end(work);
    return status;
}

static ca_noise_looks start_looks(const ca_render_plan *plan)
{
    const double pixels = ca_render_plan_pixels(plan);
    const double samples = ca_noise_looks_patience(pixels, plan->scene->light_count > 0);
    return ca_noise_looks_start(plan->settings->noise_percent, FIRST_NOISE_PASS,
                                fmax(FIRST_NOISE_PASS, samples / plan->samples_per_pass));
}

ca_status ca_pass_loop_run(ca_pass_render *r, ca_error *error)
{
    r->start = ca_clock_seconds();
    r->looks = start_looks(r->plan);
    if (r->kept.resumed > 0)
        resume(r);
    else
        r->start -= r->before = seconds_of_choices(r);
    const ca_status status = r->ranks ? lead_passes(r, error) : make_passes(r, error);
    ca_reserve_open(r->plan->reserve);
    r->interrupted = r->interrupted || status == CA_ERROR_INTERRUPTED;
    const bool early = r->interrupted || status != CA_OK;
    if (may_keep(r))
        ca_checkpoint_keep_last(&r->kept.checkpoint, r->plan->settings, early, ca_pass_loop_write, r);
    return status == CA_ERROR_INTERRUPTED && r->passes > 0 ? CA_OK : status;
}
