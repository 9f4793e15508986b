/* What the callbacks of `caustica render` do: the progress line, signals, the live view (--serve, --tev), and the
 * next name of a checkpoint. */
#ifndef CA_CLI_LIVE_VIEW_H
#define CA_CLI_LIVE_VIEW_H

#include "cli/keep.h"
#include "cli/outputs.h"
#include "cli/progress.h"
#include "live/live.h"

typedef struct ca_live_view_settings {
    bool serves;
    const char *address; /* NULL: this machine only */
    uint32_t port;
    const char *tev;     /* NULL: none */
    const char *scene;
    uint32_t threads;    /* 0: one per processor */
    ca_output_files files; /* what "save" and SIGUSR1 write */
    ca_keep *keep;         /* the checkpoint */
    const char *no_image;  /* why there never is an image to save; NULL: there is one after the first pass */
} ca_live_view_settings;

typedef struct ca_live_view {
    ca_live_view_settings settings;
    ca_progress_line line;
    ca_live *live; /* NULL: no live view */
    bool tells;        /* does it say on standard error what it does? */
    bool tells_method; /* is what integrator `auto` has chosen still to be told? */
    bool told_failure; /* of the checkpoint, since it was last written */
    char title[256];
} ca_live_view;

/* Prints where the page is. `draws`: a progress line, and a line that says what integrator `auto` has chosen? */
ca_status ca_live_view_start(ca_live_view *view, const ca_live_view_settings *settings, bool draws, ca_error *error);

/* For ca_render_settings.progress, with the view as its user; false once a signal has arrived that asks to end
 * (signals.h) or a viewer has asked to end the render. SIGUSR1 and viewers have what is there written. */
bool ca_live_view_report(const ca_render_progress *progress, void *view);

/* For ca_render_settings.checkpoint_taken: the next number (ca_keep_take_next), told on a line of its own. */
const char *ca_live_view_next_checkpoint(void *view);

/* Shows the last picture (NULL: there is none), which it takes over, and says good-bye. */
void ca_live_view_end(ca_live_view *view, ca_image_layers *image, const ca_render_statistics *statistics);

#endif
