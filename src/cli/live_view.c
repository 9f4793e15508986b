#include "cli/live_view.h"

#include "base/processors.h"
#include "base/text.h"
#include "cli/commands.h"
#include "cli/say.h"
#include "cli/signals.h"
#include "film/part_file.h"

#include <string.h>

/* Appends ", words" as far as there is room. */
static void append(char *message, size_t size, const char *separator, const char *words)
{
    const size_t used = strlen(message);
    snprintf(message + used, size - used, "%s%s", separator, words);
}

/* Part files hold what no picture does: they are written at the end only. */
static ca_status save(const ca_image_layers *image, const ca_render_statistics *statistics, void *user, char *message,
                      size_t size, ca_error *error)
{
    const ca_output_files *files = &((const ca_live_view *)user)->settings.files;
    const char *separator = " ";
    char samples[64];
    CA_TRY(ca_outputs_write(files, image, statistics, error));
    snprintf(message, size, "saved");
    for (size_t i = 0; i < files->count; i++) {
        if (ca_part_is_path(files->paths[i])) continue;
        append(message, size, separator, files->paths[i]);
        separator = ", ";
    }
    if (separator[0] == ' ')
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "there is no image to save: part files are written at the end");
    if (files->stats) append(message, size, separator, files->stats);
    snprintf(samples, sizeof samples, " with %.4g %s per pixel", statistics->samples_per_pixel,
             ca_noun(statistics->samples_per_pixel, "sample", "samples"));
    append(message, size, "", samples);
    return CA_OK;
}

static ca_status start_live(ca_live_view *view, ca_error *error)
{
    const ca_live_view_settings *s = &view->settings;
    const ca_live_settings settings = {
        .serves = s->serves,
        .address = s->address,
        .port = s->port,
        .tev = s->tev,
        .title = view->title,
        .threads = s->threads ? s->threads : ca_processors(),
        .save = save,
        .is_interrupted = ca_signals_arrived,
        .user = view,
    };
    CA_TRY(ca_live_create(&view->live, &settings, error));
    if (!s->serves) return CA_OK;
    printf("live view: %s\n", ca_live_url(view->live));
    fflush(stdout);
    return CA_OK;
}

ca_status ca_live_view_start(ca_live_view *view, const ca_live_view_settings *settings, bool draws, ca_error *error)
{
    const char *slash = strrchr(settings->scene, '/');
    *view = (ca_live_view){
        .settings = *settings, .line = ca_progress_start(draws), .tells = draws, .tells_method = draws};
    snprintf(view->title, sizeof view->title, "caustica: %s", slash ? slash + 1 : settings->scene);
    return settings->serves || settings->tev ? start_live(view, error) : CA_OK;
}

/* Once, on a line of its own. */
static void tell_method(ca_live_view *view, const char *method)
{
    if (!view->tells_method || !method) return;
    ca_progress_clear(&view->line);
    ca_say(stderr, "caustica: %s\n", method);
    view->tells_method = false;
}

/* Once for each time that checkpoints begin to fail. */
static void tell_failure(ca_live_view *view, const char *failure)
{
    if (failure && !view->told_failure) {
        ca_progress_clear(&view->line);
        ca_say(stderr, "caustica: warning: the checkpoint was not written: %s\n", failure);
    }
    view->told_failure = failure != NULL;
}

/* Of a render that makes no picture. */
static void refuse_to_save(ca_live_view *view)
{
    if (!ca_signals_take_save()) return;
    ca_progress_clear(&view->line);
    ca_say(stderr, "caustica: warning: SIGUSR1 has nothing to write: %s\n", view->settings.no_image);
}

/* What "save" of the page does, for SIGUSR1. Waits for a picture where there is none yet. */
static void save_for_signal(ca_live_view *view, const ca_render_progress *progress)
{
    ca_image_layers *image = NULL;
    ca_render_statistics statistics = {.size = sizeof statistics};
    ca_error error = {""};
    char message[1200];
    if (view->settings.no_image) refuse_to_save(view);
    if (!progress->snapshot || !ca_signals_take_save()) return;
    ca_progress_clear(&view->line);
    if (progress->gather) progress->gather(progress);
    ca_status status = progress->snapshot(progress, &image, &statistics, &error);
    if (status == CA_OK) status = save(image, &statistics, view, message, sizeof message, &error);
    ca_image_release(image);
    if (status != CA_OK)
        ca_report_failure(&error);
    else if (view->tells)
        ca_say(stderr, "caustica: %s\n", message);
}

bool ca_live_view_report(const ca_render_progress *progress, void *user)
{
    ca_live_view *view = user;
    tell_method(view, progress->method);
    ca_progress_warn(&view->line, progress);
    tell_failure(view, progress->checkpoint_failure);
    save_for_signal(view, progress);
    ca_progress_draw(&view->line, progress);
    const bool goes_on = !view->live || ca_live_report(view->live, progress);
    return goes_on && !ca_signals_arrived();
}

const char *ca_live_view_next_checkpoint(void *user)
{
    ca_live_view *view = user;
    ca_progress_clear(&view->line);
    return ca_keep_take_next(view->settings.keep);
}

void ca_live_view_end(ca_live_view *view, ca_image_layers *image, const ca_render_statistics *statistics)
{
    if (view->live && image) {
        fflush(stdout); /* so that the summary does not wait for viewers */
        ca_live_finish(view->live, image, statistics);
    } else {
        ca_image_release(image);
    }
    ca_live_destroy(view->live);
    view->live = NULL;
}
