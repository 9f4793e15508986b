/* Renders that are kept in files, or repeat what a file tells. */
#include "base/memory.h"
#include "render/auto_rays_state.h"
#include "render/kept_method.h"
#include "render/part_settings.h"

#include <stdio.h>

/* ---- Beginning and end ----------------------------------------------------------------------------------------- */

/* What decides beside what the image depends on. Shares of runs are in units of work. */
static ca_status make_choices(const ca_auto_rays *a, char **choices, ca_error *error)
{
    enum { SIZE = 128 };
    const char *objective = a->plan->settings->rays_objective;
    *choices = ca_alloc(SIZE, 1);
    if (!*choices) return ca_fail_memory(error, "the checkpoint");
    snprintf(*choices, SIZE, "objective %s\nend %s\n", objective ? objective : "mean",
             a->goal.samples > 0.0 ? "by samples" : "by time or noise");
    return CA_OK;
}

static ca_status resume(ca_auto_rays *a, ca_error *error)
{
    ca_auto_kept *kept = &a->kept;
    const double plan_seconds = a->plan->method.seconds; /* are among those of the file */
    ca_auto_resumed *resumed = kept->resumed = ca_alloc_zeroed(1, sizeof *resumed);
    if (!resumed) return ca_fail_memory(error, "the checkpoint");
    ca_auto_place place = {.pilot = &resumed->pilot, .work = &resumed->work};
    CA_TRY(ca_auto_file_read(a, &place, kept->checkpoint.path, error));
    resumed->stage = place.stage;
    kept->iterations = a->iterations;
    a->start -= a->progress.seconds - plan_seconds;
    return CA_OK;
}

ca_status ca_auto_keep_start(ca_auto_rays *a, ca_error *error)
{
    const ca_render_plan *plan = a->plan;
    ca_auto_kept *kept = &a->kept;
    CA_TRY(ca_pass_settings_make(plan, 0, &kept->settings, error));
    if (plan->rays == CA_RAYS_OF_RECORD)
        return ca_auto_script_read(a, plan->settings->rays, error);
    CA_TRY(make_choices(a, &kept->choices, error));
    kept->method = ca_kept_method_make(plan);
    if (!kept->method) return ca_fail_memory(error, "the checkpoint");
    CA_TRY(ca_checkpoint_start(&kept->checkpoint, plan->settings, error));
    return kept->checkpoint.resumes ? resume(a, error) : CA_OK;
}

void ca_auto_keep_end(ca_auto_rays *a)
{
    ca_auto_kept *kept = &a->kept;
    ca_checkpoint_end(&kept->checkpoint);
    ca_free(kept->settings);
    ca_free(kept->choices);
    ca_free(kept->method);
    if (kept->resumed) {
        ca_auto_pilot_destroy(&kept->resumed->pilot);
        ca_auto_work_destroy(&kept->resumed->work);
    }
    ca_free(kept->resumed);
    ca_auto_record_destroy(&a->record);
    ca_auto_record_destroy(&a->script);
}

/* ---- While it goes on ------------------------------------------------------------------------------------------ */

/* There is one group of ordinary iterations, which a checkpoint may have brought. */
ca_status ca_auto_keep_group(ca_auto_rays *a, ca_auto_group_kind kind, bool measures, ca_error *error)
{
    const ca_auto_group *last = ca_auto_record_last(&a->record);
    const bool is_there = last && kind == CA_AUTO_GROUP_ORDINARY && last->kind == kind;
    const bool map = kind == CA_AUTO_GROUP_RUN && !ca_auto_connects(a);
    if (!ca_auto_is_kept(a) || is_there) return CA_OK;
    const ca_auto_group group = {.kind = kind,
                                 .measures = measures,
                                 .light_paths = a->numbers.light_paths,
                                 .camera_paths = map ? 0 : a->numbers.most};
    return ca_auto_record_add(&a->record, &group, map ? a->numbers.camera_paths : NULL, ca_auto_pixels(a), error);
}

/* ca_checkpoint_writer */
typedef struct writer {
    ca_auto_rays *a;
    const ca_auto_place *place;
} writer;

static ca_status write_file(void *user, const char *path, ca_error *error)
{
    const writer *w = user;
    return ca_auto_file_write(w->a, w->place, path, error);
}

static void write_checkpoint(ca_auto_rays *a, const ca_auto_place *place)
{
    writer w = {a, place};
    ca_checkpoint_write(&a->kept.checkpoint, write_file, &w);
}

/* Notes how far the group is. Is there something to go on from? Not within two iterations of the ramp, nor where
 * an iteration has failed after its samples were added. */
static bool note(ca_auto_rays *a, const ca_auto_place *place, uint32_t iterations)
{
    ca_auto_group *group = ca_auto_record_last(&a->record);
    group->iterations = iterations;
    if (place->stage == CA_AUTO_AT_RUN) {
        group->share = ca_auto_share_at_work(a, place->work->run);
        return place->work->film.pixels[0].samples == iterations;
    }
    const ca_auto_half *halves = place->pilot->halves;
    const uint32_t samples = halves[0].film.pixels[0].samples + halves[1].film.pixels[0].samples;
    if (place->stage == CA_AUTO_AT_ORDINARY) return samples == iterations;
    return samples == a->ramp.iterations && iterations == CA_PILOT_HALVES;
}

/* What the render is expected to take, s; INFINITY: nobody knows. */
static double whole_seconds(const ca_auto_rays *a)
{
    const ca_auto_progress *now = &a->progress;
    const double limit = a->goal.seconds > 0.0 ? a->goal.seconds : (double)INFINITY;
    if (now->looks.seconds_predicted > 0.0) return fmin(limit, now->looks.seconds_predicted);
    if (a->goal.samples == 0.0) return limit;
    return fmin(limit, now->seconds * a->goal.samples / now->camera_paths);
}

void ca_auto_keep(ca_auto_rays *a, const ca_auto_place *place, uint32_t iterations)
{
    if (!ca_auto_is_kept(a) || !note(a, place, iterations)) return;
    if (ca_checkpoint_is_due(&a->kept.checkpoint, a->plan->settings, whole_seconds(a))) write_checkpoint(a, place);
}

void ca_auto_keep_last(ca_auto_rays *a, const ca_auto_place *place, uint32_t iterations, bool early)
{
    if (!ca_auto_is_kept(a) || !note(a, place, iterations)) return;
    if (ca_checkpoint_is_wanted(&a->kept.checkpoint, a->plan->settings, early)) write_checkpoint(a, place);
}
