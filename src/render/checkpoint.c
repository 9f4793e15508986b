#define _POSIX_C_SOURCE 200809L
#include "render/checkpoint.h"

#include "base/clock.h"
#include "render/part_settings.h"

#include <errno.h>
#include <math.h>
#include <string.h>
#include <unistd.h>

/* By default so many seconds lie between two writes, and writing takes no more than a hundredth of the time. */
#define USUAL_SECONDS 300.0
#define TIMES_THE_COST 100.0

/* Renders that take longer are kept without being asked. */
#define LONG_SECONDS 600.0

/* What cannot be looked at may be there. */
static ca_status look_for(const char *path, bool *exists, ca_error *error)
{
    *exists = access(path, F_OK) == 0;
    if (*exists || errno == ENOENT || errno == ENOTDIR) return CA_OK;
    return ca_fail(error, CA_ERROR_FILE, NULL, "%s: %s", path, strerror(errno));
}

/* Locks the file, unless that was done already, and says whether it is there; or another render has it. */
static ca_status lock(ca_checkpoint *checkpoint, bool *is_others, bool *exists, ca_error *error)
{
    const char *path = checkpoint->path;
    bool taken = checkpoint->lock.path != NULL;
    *is_others = false;
    if (!taken) CA_TRY(ca_file_lock_take(&checkpoint->lock, path, &taken, error));
    if (taken) return look_for(path, exists, error);
    *is_others = true;
    return ca_fail(error, CA_ERROR_FILE, NULL, "%s: another render is at work with this checkpoint", path);
}

/* The same; a file that is there is an error, too, and another render's, unless it is to be gone on from. */
static ca_status take(ca_checkpoint *checkpoint, bool resume, bool *is_others, bool *exists, ca_error *error)
{
    ca_status status = lock(checkpoint, is_others, exists, error);
    if (status == CA_OK && *exists && !resume) {
        *is_others = true;
        status = ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                         "%s: there is a checkpoint already: resume from it, remove it or take another name",
                         checkpoint->path);
    }
    if (status != CA_OK) ca_file_lock_release(&checkpoint->lock);
    return status;
}

static bool has_next_path(ca_checkpoint *checkpoint)
{
    const char *path = checkpoint->next_path ? checkpoint->next_path(checkpoint->next_path_user) : NULL;
    if (path) checkpoint->path = path;
    return path != NULL;
}

/* The same under one path after the other, as the caller gives them, until one is no other render's. */
static ca_status take_any(ca_checkpoint *checkpoint, bool resume, bool *exists, ca_error *error)
{
    bool is_others;
    ca_status status = take(checkpoint, resume, &is_others, exists, error);
    while (status != CA_OK && is_others && has_next_path(checkpoint))
        status = take(checkpoint, resume, &is_others, exists, error);
    return status;
}

/* A file that will perhaps never be made is locked when it is. */
ca_status ca_checkpoint_start(ca_checkpoint *checkpoint, const ca_render_settings *settings, ca_error *error)
{
    *checkpoint = (ca_checkpoint){.path = settings->checkpoint_path,
                                  .last = ca_clock_seconds(),
                                  .next_path = settings->checkpoint_taken,
                                  .next_path_user = settings->progress_user};
    if (!checkpoint->path) return CA_OK;
    bool exists, is_others;
    CA_TRY(look_for(checkpoint->path, &exists, error));
    if (settings->checkpoint_if_long && !exists) return CA_OK;
    const ca_status status = exists && settings->resume ? take(checkpoint, true, &is_others, &exists, error)
                                                        : take_any(checkpoint, settings->resume, &exists, error);
    if (status != CA_OK) {
        ca_checkpoint_end(checkpoint);
        return status;
    }
    checkpoint->resumes = checkpoint->is_kept = exists;
    return CA_OK;
}

void ca_checkpoint_end(ca_checkpoint *checkpoint)
{
    ca_file_lock_release(&checkpoint->lock);
    checkpoint->path = NULL;
}

bool ca_checkpoint_is_due(const ca_checkpoint *checkpoint, const ca_render_settings *settings, double whole_seconds)
{
    if (!checkpoint->path) return false;
    const double usual = fmax(USUAL_SECONDS, TIMES_THE_COST * checkpoint->cost);
    const double between = settings->checkpoint_seconds > 0.0 ? settings->checkpoint_seconds : usual;
    const bool is_long = !settings->checkpoint_if_long || checkpoint->is_kept || whole_seconds > LONG_SECONDS;
    return is_long && ca_clock_seconds() - checkpoint->last >= between;
}

bool ca_checkpoint_is_wanted(const ca_checkpoint *checkpoint, const ca_render_settings *settings, bool interrupted)
{
    if (!checkpoint->path) return false;
    return !settings->checkpoint_if_long || (checkpoint->is_kept && interrupted);
}

/* The first time there must be none that others have made. */
static ca_status write_locked(ca_checkpoint *checkpoint, ca_checkpoint_writer write, void *render)
{
    ca_error *error = &checkpoint->failure;
    bool exists;
    if (!checkpoint->is_kept) CA_TRY(take_any(checkpoint, false, &exists, error));
    const ca_status status = write(render, checkpoint->path, error);
    /* The file of a write that failed may be in its place all the same: its folder could not be synced. */
    if (access(checkpoint->path, F_OK) == 0) checkpoint->is_kept = true;
    return status;
}

void ca_checkpoint_write(ca_checkpoint *checkpoint, ca_checkpoint_writer write, void *render)
{
    const double start = ca_clock_seconds();
    const bool good = write_locked(checkpoint, write, render) == CA_OK;
    checkpoint->status = good ? CA_OK : CA_ERROR_FILE;
    checkpoint->last = ca_clock_seconds();
    checkpoint->cost = checkpoint->last - start;
    if (good) checkpoint->is_kept = true;
}

void ca_checkpoint_keep(ca_checkpoint *checkpoint, const ca_render_settings *settings, double whole_seconds,
                        ca_checkpoint_writer write, void *render)
{
    if (ca_checkpoint_is_due(checkpoint, settings, whole_seconds)) ca_checkpoint_write(checkpoint, write, render);
}

void ca_checkpoint_keep_last(ca_checkpoint *checkpoint, const ca_render_settings *settings, bool interrupted,
                             ca_checkpoint_writer write, void *render)
{
    if (ca_checkpoint_is_wanted(checkpoint, settings, interrupted)) ca_checkpoint_write(checkpoint, write, render);
}

ca_status ca_checkpoint_result(const ca_checkpoint *checkpoint, const ca_render_settings *settings, bool interrupted,
                               ca_error *error)
{
    if (checkpoint->status == CA_OK || (settings->checkpoint_if_long && !interrupted)) return CA_OK;
    if (error) *error = checkpoint->failure;
    return checkpoint->status;
}

ca_status ca_checkpoint_write_part(const ca_checkpoint *checkpoint, const ca_render_settings *settings,
                                   bool interrupted, ca_checkpoint_writer write, void *render, ca_error *error)
{
    const ca_status kept = ca_checkpoint_result(checkpoint, settings, interrupted, error);
    const ca_status part = settings->part_path ? write(render, settings->part_path, error) : CA_OK;
    return part == CA_OK ? kept : part;
}

/* Beside a setting that differs. */
static const char *what_may_differ(const char *line)
{
    if (strncmp(line, "passes_per_replicate ", 21) == 0) return "the samples of a render with replicates stay";
    if (strncmp(line, "memory ", 7) == 0) return "the memory stays where blocks are as large as it allows";
    if (strncmp(line, "end ", 4) == 0)
        return "rays that were chosen for a number of samples go on by samples, and those for time or noise by these";
    return "only samples, time, noise, threads, memory and outputs may be others";
}

ca_status ca_checkpoint_compare(const char *path, const char *theirs, const char *ours, ca_error *error)
{
    if (ca_part_settings_equal(&theirs, &ours)) return CA_OK;
    if (strncmp(theirs, "scene ", 6) == 0)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "%.400s was made with another scene: its files or definitions have changed", path);
    const int a = (int)strcspn(theirs, "\n"), b = (int)strcspn(ours, "\n");
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                   "%.400s was made with \"%.*s\", but this render has \"%.*s\": %s", path, a < 200 ? a : 200, theirs,
                   b < 200 ? b : 200, ours, what_may_differ(theirs));
}
