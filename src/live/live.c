#define _DEFAULT_SOURCE
#include "live/live.h"

#include "base/clock.h"
#include "live/server.h"
#include "live/tev.h"

#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/eventfd.h>
#include <time.h>
#include <unistd.h>

static const double event_seconds = 0.1, farewell_seconds = 5.0, tev_farewell_seconds = 2.0;
enum { URL_SIZE = 160, NAP_MILLISECONDS = 20 };

struct ca_live {
    ca_live_settings settings;
    ca_live_state state;
    ca_live_server *server; /* NULL: no page */
    ca_tev *tev;            /* NULL: no tev */
    uint32_t tev_version;   /* of the picture that tev got last */
    pthread_t thread;
    bool has_state, has_thread;
    double last_event;          /* when; likewise: */
    double last_report, step; /* of the render; between the last two, s */
    uint32_t versions;
    char url[URL_SIZE];
};

/* ---- The serving thread ---------------------------------------------------------------------------------------- */

/* Waits up to `milliseconds`, or until a viewer asks for something. With the lock held. */
static void nap(ca_live_state *state, long milliseconds)
{
    struct timespec end;
    clock_gettime(CLOCK_MONOTONIC, &end);
    end.tv_nsec += milliseconds * 1000000;
    end.tv_sec += end.tv_nsec / 1000000000;
    end.tv_nsec %= 1000000000;
    pthread_cond_timedwait(&state->asked, &state->lock, &end);
}

static void wait_for_work(ca_live *live)
{
    struct pollfd places[3] = {{.fd = live->state.wake_descriptor, .events = POLLIN}, {.fd = -1}, {.fd = -1}};
    int timeout = 1000;
    if (live->server) {
        places[1] = (struct pollfd){.fd = ca_live_server_descriptor(live->server), .events = POLLIN};
        timeout = ca_live_server_timeout(live->server);
    }
    if (live->tev && ca_tev_has_more(live->tev))
        places[2] = (struct pollfd){.fd = ca_tev_descriptor(live->tev), .events = POLLOUT};
    poll(places, 3, timeout);
    eventfd_t count;
    if (eventfd_read(live->state.wake_descriptor, &count) != 0) return; /* it was not woken */
}

/* Once it has received a picture it is to get the next one. */
static void serve_tev(ca_live *live)
{
    ca_live_state *state = &live->state;
    ca_live_snapshot *picture = ca_live_state_picture(state);
    if (picture && picture->version != live->tev_version && ca_tev_is_ready(live->tev)) {
        live->tev_version = picture->version;
        ca_tev_show(live->tev, picture);
    }
    ca_live_snapshot_release(picture);
    ca_tev_run(live->tev);
    pthread_mutex_lock(&state->lock);
    const bool ready = ca_tev_is_ready(live->tev),
               newest = !state->snapshot || state->snapshot->version == live->tev_version;
    if (ready && newest) state->wants_picture = true;
    state->tev_is_behind = ca_tev_descriptor(live->tev) >= 0 && !(ready && newest);
    pthread_cond_broadcast(&state->asked);
    pthread_mutex_unlock(&state->lock);
}

/* Charges what was done to the budget, and waits until that allows more. false: the thread is to end. */
static bool settle(ca_live *live, double cost)
{
    ca_live_state *state = &live->state;
    pthread_mutex_lock(&state->lock);
    if (state->phase != CA_LIVE_PAUSED) state->budget.spent += cost;
    while (!ca_live_state_may_serve(state)) {
        struct timespec time = {.tv_nsec = NAP_MILLISECONDS * 1000000L};
        pthread_mutex_unlock(&state->lock);
        nanosleep(&time, NULL);
        pthread_mutex_lock(&state->lock);
    }
    const bool goes_on = !state->quits;
    pthread_mutex_unlock(&state->lock);
    return goes_on;
}

static void *serve(void *user)
{
    ca_live *live = user;
    double before = ca_clock_thread_seconds(), cost;
    do {
        wait_for_work(live);
        if (live->server) ca_live_server_run(live->server);
        if (live->tev) serve_tev(live);
        cost = ca_clock_thread_seconds() - before;
        before += cost;
    } while (settle(live, cost));
    return NULL;
}

/* ---- Life ------------------------------------------------------------------------------------------------------ */

/* Signals are the business of the program's first thread. */
static ca_status start_thread(ca_live *live, ca_error *error)
{
    sigset_t all, before;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    const int problem = pthread_create(&live->thread, NULL, serve, live);
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    if (problem != 0) return ca_fail(error, CA_ERROR_FILE, NULL, "the live view cannot begin: %s", strerror(problem));
    live->has_thread = true;
    return CA_OK;
}

static ca_status open_server(ca_live *live, ca_error *error)
{
    const char *address = live->settings.address ? live->settings.address : "127.0.0.1";
    CA_TRY(ca_live_server_create(&live->server, address, (uint16_t)live->settings.port, live->settings.title,
                                 &live->state, error));
    const ca_live_access *access = ca_live_server_access(live->server);
    const bool bracketed = strchr(access->address, ':') != NULL;
    snprintf(live->url, sizeof live->url, bracketed ? "http://[%s]:%u/%s/" : "http://%s:%u/%s/", access->address,
             access->port, access->token);
    return CA_OK;
}

ca_status ca_live_create(ca_live **live, const ca_live_settings *settings, ca_error *error)
{
    ca_live *made = *live = ca_alloc_zeroed(1, sizeof *made);
    if (!made) return ca_fail_memory(error, "the live view");
    made->settings = *settings;
    made->last_event = -1.0;
    ca_status status = ca_live_state_init(&made->state, settings->threads, error);
    made->has_state = status == CA_OK;
    if (status == CA_OK && settings->serves) status = open_server(made, error);
    if (status == CA_OK && settings->tev) status = ca_tev_create(&made->tev, settings->tev, settings->title, error);
    if (status == CA_OK) {
        made->state.wants_picture = made->tev != NULL;
        status = start_thread(made, error);
    }
    if (status == CA_OK) return CA_OK;
    ca_live_destroy(made);
    *live = NULL;
    return status;
}

void ca_live_destroy(ca_live *live)
{
    if (!live) return;
    if (live->has_thread) {
        pthread_mutex_lock(&live->state.lock);
        live->state.quits = true;
        ca_live_state_tell(&live->state);
        pthread_mutex_unlock(&live->state.lock);
        pthread_join(live->thread, NULL);
    }
    ca_live_server_destroy(live->server);
    ca_tev_destroy(live->tev);
    if (live->has_state) ca_live_state_clear(&live->state);
    ca_free(live);
}

const char *ca_live_url(const ca_live *live) { return live->url; }

/* ---- The render's side ----------------------------------------------------------------------------------------- */

/* With the lock held. */
static void set_phase(ca_live_state *state, ca_live_phase phase)
{
    if (state->phase == phase) return;
    state->phase = phase;
    ca_live_state_tell(state);
}

static void say(ca_live_state *state, const char *message)
{
    pthread_mutex_lock(&state->lock);
    snprintf(state->message, sizeof state->message, "%s", message);
    ca_live_state_tell(state);
    pthread_mutex_unlock(&state->lock);
}

/* Makes it the newest picture; takes it over. */
static void show(ca_live *live, ca_live_snapshot *picture)
{
    ca_live_state *state = &live->state;
    picture->version = ++live->versions;
    pthread_mutex_lock(&state->lock);
    ca_live_snapshot *old = state->snapshot;
    state->snapshot = picture;
    state->wants_picture = false;
    state->tev_is_behind = live->tev != NULL; /* until the thread sets it */
    ca_live_state_tell(state);
    pthread_mutex_unlock(&state->lock);
    ca_live_snapshot_release(old);
}

/* `begin`: by the clock. */
static void charge_picture(ca_live *live, double begin, double cost, double pixels, bool counts)
{
    ca_live_budget *budget = &live->state.budget;
    pthread_mutex_lock(&live->state.lock);
    ca_live_budget_note_picture(budget, begin, ca_clock_seconds());
    if (counts) ca_live_budget_charge_picture(budget, ca_live_process_seconds(), cost, pixels);
    pthread_mutex_unlock(&live->state.lock);
}

/* The other threads of the render wait meanwhile. `counts`: against the budget, as it is for viewers. */
static ca_status take_picture(ca_live *live, const ca_render_progress *progress, bool counts, ca_error *error)
{
    ca_image_layers *image = NULL;
    ca_render_statistics statistics = {.size = sizeof statistics};
    ca_live_snapshot *picture;
    const double begin = ca_clock_seconds(), before = ca_clock_thread_seconds();
    CA_TRY(progress->snapshot(progress, &image, &statistics, error));
    CA_TRY(ca_live_snapshot_create(&picture, image, &statistics, error));
    picture->passes = progress->passes_done;
    picture->seconds = progress->seconds;
    const double pixels = (double)image->width * image->height;
    show(live, picture);
    charge_picture(live, begin, ca_clock_thread_seconds() - before, pixels, counts);
    return CA_OK;
}

static bool picture_is_due(ca_live *live, const ca_render_progress *progress)
{
    ca_live_state *state = &live->state;
    if (!progress->snapshot) return false;
    pthread_mutex_lock(&state->lock);
    const bool due = state->wants_picture &&
                     ca_live_budget_allows_picture(&state->budget, ca_live_process_seconds(), ca_clock_seconds(),
                                                   live->step);
    pthread_mutex_unlock(&state->lock);
    return due;
}

/* Without a picture the render goes on; the next one may succeed. */
static void take_picture_for_watchers(ca_live *live, const ca_render_progress *progress, bool counts)
{
    ca_error error = {""};
    if (take_picture(live, progress, counts, &error) != CA_OK) say(&live->state, error.message);
}

static bool picture_is_old(const ca_live *live, const ca_render_progress *progress)
{
    return progress->snapshot && !(live->state.snapshot && live->state.snapshot->passes == progress->passes_done);
}

/* The picture that is saved is that of the passes done: a new one, if need be. Only this thread changes
 * state.snapshot. */
static void save(ca_live *live, const ca_render_progress *progress)
{
    const ca_live_settings *settings = &live->settings;
    ca_error error = {""};
    char message[1200] = "";
    ca_status status = CA_OK;
    if (!progress->snapshot)
        status = ca_fail(&error, CA_ERROR_UNSUPPORTED, NULL, "there is no picture yet that could be saved");
    else if (picture_is_old(live, progress))
        status = take_picture(live, progress, false, &error);
    if (status == CA_OK)
        status = settings->save(live->state.snapshot->image, &live->state.snapshot->statistics, settings->user,
                                message, sizeof message, &error);
    say(&live->state, status == CA_OK ? message : error.message);
}

static void keep_progress(ca_live *live, const ca_render_progress *progress)
{
    ca_live_state *state = &live->state;
    const double now = ca_clock_seconds();
    pthread_mutex_lock(&state->lock);
    state->progress = *progress;
    if (state->phase == CA_LIVE_WAITING) state->phase = CA_LIVE_RENDERING;
    if (live->last_event < 0.0 || now - live->last_event >= event_seconds) {
        live->last_event = now;
        ca_live_state_tell(state);
    }
    pthread_mutex_unlock(&state->lock);
}

/* Handles what viewers have asked for; true: the render is to wait, and to call again. */
static bool serve_wishes(ca_live *live, const ca_render_progress *progress, bool *stops)
{
    ca_live_state *state = &live->state;
    pthread_mutex_lock(&state->lock);
    const bool saves = state->wants_save;
    state->wants_save = false;
    *stops = state->wants_stop;
    const bool pauses = state->wants_pause && !*stops && !live->settings.is_interrupted();
    set_phase(state, *stops ? CA_LIVE_STOPPING : pauses ? CA_LIVE_PAUSED : CA_LIVE_RENDERING);
    const bool shows = pauses && state->wants_picture && picture_is_old(live, progress);
    if (pauses && !saves && !shows) nap(state, NAP_MILLISECONDS);
    pthread_mutex_unlock(&state->lock);
    if (saves) save(live, progress);
    if (shows) take_picture_for_watchers(live, progress, false);
    return pauses;
}

bool ca_live_report(ca_live *live, const ca_render_progress *progress)
{
    bool stops = false;
    const double now = ca_clock_seconds();
    live->step = live->last_report > 0.0 ? now - live->last_report : 0.0;
    keep_progress(live, progress);
    if (picture_is_due(live, progress)) take_picture_for_watchers(live, progress, true);
    while (serve_wishes(live, progress, &stops)) continue;
    live->last_report = ca_clock_seconds();
    return !stops;
}

/* With the lock held: a viewer has not got the last picture yet, and the budget is not used up. */
static bool farewell_goes_on(const ca_live_state *state, double seconds)
{
    const double most = state->watchers > 0    ? farewell_seconds
                        : state->tev_is_behind ? tev_farewell_seconds
                                               : 0.0;
    return seconds < most && ca_live_budget_allows(&state->budget, ca_live_process_seconds(), 0.0);
}

void ca_live_finish(ca_live *live, ca_image_layers *image, const ca_render_statistics *statistics)
{
    ca_live_state *state = &live->state;
    ca_live_snapshot *picture;
    const double start = ca_clock_seconds(),
                 bytes = (double)image->width * image->height * (double)image->channel_count * sizeof(float);
    if (ca_live_snapshot_create(&picture, image, statistics, NULL) == CA_OK) {
        picture->passes = (uint32_t)statistics->iterations;
        picture->seconds = statistics->seconds;
        show(live, picture);
    }
    pthread_mutex_lock(&state->lock);
    ca_live_budget_end(&state->budget, ca_live_process_seconds(), bytes);
    set_phase(state, CA_LIVE_DONE);
    while (farewell_goes_on(state, ca_clock_seconds() - start) && !live->settings.is_interrupted())
        nap(state, NAP_MILLISECONDS);
    pthread_mutex_unlock(&state->lock);
}
