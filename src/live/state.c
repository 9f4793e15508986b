#define _POSIX_C_SOURCE 200809L
#include "live/state.h"

#include "render/progress.h"
#include "report/page_text.h"

#include <errno.h>
#include <math.h>
#include <string.h>
#include <sys/eventfd.h>
#include <unistd.h>

ca_status ca_live_state_init(ca_live_state *state, uint32_t threads, ca_error *error)
{
    *state = (ca_live_state){.budget = ca_live_budget_open(threads), .news = 1, .progress.noise_percent = -1.0};
    state->wake_descriptor = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
    if (state->wake_descriptor < 0)
        return ca_fail(error, CA_ERROR_FILE, NULL, "the live view cannot begin: %s", strerror(errno));
    pthread_condattr_t attributes;
    pthread_condattr_init(&attributes);
    pthread_condattr_setclock(&attributes, CLOCK_MONOTONIC);
    pthread_cond_init(&state->asked, &attributes);
    pthread_condattr_destroy(&attributes);
    pthread_mutex_init(&state->lock, NULL);
    return CA_OK;
}

void ca_live_state_clear(ca_live_state *state)
{
    ca_live_snapshot_release(state->snapshot);
    pthread_cond_destroy(&state->asked);
    pthread_mutex_destroy(&state->lock);
    close(state->wake_descriptor);
}

void ca_live_state_tell(ca_live_state *state)
{
    state->news++;
    /* A full counter is a wake-up that is already there. */
    if (eventfd_write(state->wake_descriptor, 1) != 0) return;
}

ca_live_snapshot *ca_live_state_picture(ca_live_state *state)
{
    pthread_mutex_lock(&state->lock);
    ca_live_snapshot *snapshot = ca_live_snapshot_hold(state->snapshot);
    pthread_mutex_unlock(&state->lock);
    return snapshot;
}

bool ca_live_state_may_serve(const ca_live_state *state)
{
    if (state->quits || state->phase == CA_LIVE_PAUSED) return true;
    return ca_live_budget_allows(&state->budget, ca_live_process_seconds(), 0.0);
}

/* ---- As JSON --------------------------------------------------------------------------------------------------- */

/* What a viewer is told: copied, since the render would wait while a text is written under the lock. */
typedef struct news {
    ca_live_phase phase;
    ca_render_progress progress;
    ca_live_snapshot *snapshot; /* held */
    uint64_t number;
    char message[sizeof((ca_live_state *)NULL)->message];
} news;

static void copy_news(news *copy, ca_live_state *state)
{
    pthread_mutex_lock(&state->lock);
    copy->phase = state->phase;
    copy->progress = state->progress;
    copy->snapshot = ca_live_snapshot_hold(state->snapshot);
    copy->number = state->news;
    memcpy(copy->message, state->message, sizeof copy->message);
    pthread_mutex_unlock(&state->lock);
}

static void put(FILE *stream, const char *name, double value)
{
    fprintf(stream, ",\"%s\":", name);
    ca_page_put_number(stream, value);
}

/* The limits of the render, and how far it was when the noise was estimated last: by the latest picture, or by the
 * render itself, which does so rarely. */
static ca_render_progress noise_estimate(const news *told)
{
    const ca_live_snapshot *picture = told->snapshot;
    ca_render_progress estimate = ca_progress_at_noise(&told->progress);
    if (!picture || picture->statistics.noise_percent < 0.0) return estimate;
    if (estimate.noise_percent >= 0.0 && picture->seconds < estimate.seconds) return estimate;
    estimate.noise_percent = picture->statistics.noise_percent;
    estimate.passes_done = picture->passes;
    estimate.seconds = picture->seconds;
    return estimate;
}

static void put_picture(FILE *stream, const ca_live_snapshot *picture)
{
    const ca_image_layers *image = picture->image;
    fprintf(
        stream,
        ",\"picture\":{\"version\":%u,\"passes\":%u,\"width\":%u,\"height\":%u,\"x0\":%d,\"y0\":%d,\"channels\":%zu",
        picture->version, picture->passes, image->width, image->height, image->x0, image->y0, image->channel_count);
    put(stream, "samples", picture->statistics.samples_per_pixel);
    put(stream, "light_paths", picture->statistics.numbers_of_rays.light_paths);
    put(stream, "camera_paths", picture->statistics.numbers_of_rays.camera_paths);
    fputc('}', stream);
}

static void put_noise(FILE *stream, const news *told)
{
    const ca_render_progress estimate = noise_estimate(told);
    const double predicted = ca_progress_noise_at_end(&estimate), unknown = (double)NAN;
    const bool known = estimate.noise_percent >= 0.0;
    put(stream, "noise", known ? estimate.noise_percent : unknown);
    put(stream, "noise_passes", known ? estimate.passes_done : unknown);
    put(stream, "noise_seconds", known ? estimate.seconds : unknown);
    put(stream, "target", estimate.noise_target > 0.0 ? estimate.noise_target : unknown);
    put(stream, "predicted", predicted >= 0.0 ? predicted : unknown);
}

static void put_progress(FILE *stream, const news *told)
{
    const ca_render_progress *p = &told->progress;
    const double fraction = ca_progress_fraction(p), unknown = (double)NAN;
    fprintf(stream, ",\"blocks\":%s", p->blocks ? "true" : "false");
    put(stream, "passes", p->passes_done);
    put(stream, "total", p->passes_total > 0 ? p->passes_total : unknown);
    put(stream, "seconds", p->seconds);
    put(stream, "left", fraction > 0.0 ? ca_progress_seconds_left(p) : unknown);
    put(stream, "fraction", fraction >= 0.0 ? fraction : unknown);
}

size_t ca_live_state_describe(ca_live_state *state, char text[CA_LIVE_EVENT_SIZE], uint64_t *number)
{
    static const char *const phases[] = {"waiting", "rendering", "paused", "stopping", "done"};
    news told;
    text[0] = '\0';
    FILE *stream = fmemopen(text, CA_LIVE_EVENT_SIZE, "w");
    if (!stream) return 0;
    copy_news(&told, state);
    *number = told.number;
    fprintf(stream, "{\"phase\":\"%s\"", phases[told.phase]);
    put_progress(stream, &told);
    put_noise(stream, &told);
    if (told.snapshot) put_picture(stream, told.snapshot);
    fputs(",\"message\":", stream);
    ca_page_put_json(stream, told.message);
    fputc('}', stream);
    ca_live_snapshot_release(told.snapshot);
    const bool whole = fflush(stream) == 0;
    const long length = ftell(stream);
    fclose(stream);
    return whole && length > 0 && length < CA_LIVE_EVENT_SIZE ? (size_t)length : 0;
}
