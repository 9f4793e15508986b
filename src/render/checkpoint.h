/* The file that keeps a render while it goes on (ca_render_settings.checkpoint_path): when it is due, that no other
 * job has it, and what failed. What is in it is the business of who renders: passes (film/pass_part.h) or blocks
 * (film/part_file.h). */
#ifndef CA_RENDER_CHECKPOINT_H
#define CA_RENDER_CHECKPOINT_H

#include "base/file.h"
#include "render/render.h"

typedef struct ca_checkpoint {
    const char *path; /* borrowed; NULL: none is kept */
    bool resumes;     /* there is one to go on from */
    bool is_kept;     /* it has been written or is gone on from */
    const char *(*next_path)(void *user); /* of the settings, where another render has the file; NULL: none */
    void *next_path_user;
    ca_file_lock lock;
    double last, cost; /* by the clock: when it was written last, and how long that took, s */
    ca_status status;  /* of the last write */
    ca_error failure;
} ca_checkpoint;

/* Locks the file, now or when it is first written, and says whether there is one to go on from. Where another job has
 * it, or has left one, the caller may give another path (ca_render_settings.checkpoint_taken). Errors:
 * CA_ERROR_ARGUMENT where there is one that is not to be gone on from, CA_ERROR_FILE where another job has it or it
 * cannot be locked. */
ca_status ca_checkpoint_start(ca_checkpoint *checkpoint, const ca_render_settings *settings, ca_error *error);
/* Also of one that was not started, or is all zero. */
void ca_checkpoint_end(ca_checkpoint *checkpoint);

/* Is it to be written now? `whole_seconds`: what the render is expected to take; INFINITY: not known. */
bool ca_checkpoint_is_due(const ca_checkpoint *checkpoint, const ca_render_settings *settings, double whole_seconds);
/* And at the end of a render that took so many seconds; `interrupted`: before its time? */
bool ca_checkpoint_is_wanted(const ca_checkpoint *checkpoint, const ca_render_settings *settings, bool interrupted);

/* Writes it by a call, and notes how that went. */
typedef ca_status (*ca_checkpoint_writer)(void *render, const char *path, ca_error *error);
void ca_checkpoint_write(ca_checkpoint *checkpoint, ca_checkpoint_writer write, void *render);

/* Where it is due, or wanted at the end. */
void ca_checkpoint_keep(ca_checkpoint *checkpoint, const ca_render_settings *settings, double whole_seconds,
                        ca_checkpoint_writer write, void *render);
void ca_checkpoint_keep_last(ca_checkpoint *checkpoint, const ca_render_settings *settings, bool interrupted,
                             ca_checkpoint_writer write, void *render);

/* What the last write is to the caller: its failure, but where the render is whole only of a file that was asked for.
 * `interrupted` as above. */
ca_status ca_checkpoint_result(const ca_checkpoint *checkpoint, const ca_render_settings *settings, bool interrupted,
                               ca_error *error);

/* After that: writes the part file, if the settings name one. Told is its failure, or else the checkpoint's last
 * one. */
ca_status ca_checkpoint_write_part(const ca_checkpoint *checkpoint, const ca_render_settings *settings,
                                   bool interrupted, ca_checkpoint_writer write, void *render, ca_error *error);

/* Why the last write failed; NULL: it did not. */
static inline const char *ca_checkpoint_failure(const ca_checkpoint *checkpoint)
{
    return checkpoint->status == CA_OK ? NULL : checkpoint->failure.message;
}

/* Refuses to go on with other settings: names the first one that differs. `theirs` is the text of the file, `ours`
 * that of this render; both lines "name value". */
ca_status ca_checkpoint_compare(const char *path, const char *theirs, const char *ours, ca_error *error);

#endif
