/* What it costs a real render to be looked at: processor time of `caustica render --serve` beside that of the same
 * render without.
 *
 * Both are at work by turns, a quarter of a second each (SIGSTOP, SIGCONT), so that whatever else goes on in the
 * machine meets both. Those who look have a process of their own, this one: each listens to the events and fetches
 * channels and a pixel of every picture that it hears of, at once and all it can. */
#define _GNU_SOURCE
#include "support/live_client.h"
#include "support/program_test.h"

#include <math.h>
#include <pthread.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>

enum { WATCHERS = 8, ROUNDS = 2, ANSWER_BYTES = 1 << 21 };

static void sleep_for(double seconds)
{
    const struct timespec time = {.tv_sec = (time_t)seconds, .tv_nsec = (long)(1e9 * (seconds - floor(seconds)))};
    nanosleep(&time, NULL);
}

/* ---- Who looks ------------------------------------------------------------------------------------------------- */

static const char *const wanted[] = {"planes?names=R,G,B",       "planes?names=StandardDeviation.Y,Samples.Y,R,G,B",
                                     "planes?names=N.X,N.Y,N.Z", "planes?names=Albedo.R,Albedo.G,Albedo.B",
                                     "pixel?x=100&y=100",        "planes?names=ConfidenceLow.Y,ConfidenceHigh.Y"};

typedef struct watcher {
    ca_live_place place;
    pthread_t thread;
    int pictures, answers; /* that it heard of, and got of them */
    double bytes;
} watcher;

static void fetch_all(watcher *w, char *answer)
{
    char path[256];
    for (size_t i = 0; i < sizeof wanted / sizeof wanted[0]; i++) {
        snprintf(path, sizeof path, "%s%s", w->place.path, wanted[i]);
        const int client = ca_live_ask(w->place.port, "GET", path, w->place.host);
        const size_t length = ca_live_read(client, NULL, answer, ANSWER_BYTES);
        if (client >= 0) close(client);
        w->answers += strncmp(answer, "HTTP/1.1 200", 12) == 0;
        w->bytes += (double)length;
    }
}

/* The newest picture that events tell of; 0: none. */
static long newest_version(const char *events)
{
    static const char key[] = "\"version\":";
    long version = 0;
    for (const char *at = events; (at = strstr(at, key)) != NULL; at += sizeof key - 1)
        version = strtol(at + sizeof key - 1, NULL, 10);
    return version;
}

/* Until the server hangs up. */
static void *watch(void *user)
{
    watcher *w = user;
    char *answer = malloc(ANSWER_BYTES), event[1 << 15];
    const int events = ca_live_open(&w->place, "GET", "events");
    long last = 0;
    while (answer && ca_live_read(events, "\n\n", event, sizeof event) > 0) {
        const long version = newest_version(event);
        if (version <= last) continue;
        fetch_all(w, answer);
        w->pictures++;
        last = version;
    }
    if (events >= 0) close(events);
    free(answer);
    return NULL;
}

/* ---- The renders ----------------------------------------------------------------------------------------------- */

typedef struct render {
    ca_program program;
    pid_t process;
    bool over;
    double seconds; /* of the processors */
} render;

static void start(render *r, bool serves)
{
    const char *const words[] = {"render",  CA_SOURCE_DIR "/scenes/cornell-box/cornell-box.xml",
                                 "--quiet", "--threads",
                                 "1",       "--resolution",
                                 "256x256", "--spp",
                                 "400",     "-o",
                                 "a.exr",   serves ? "--serve" : NULL,
                                 NULL};
    assert_true(ca_program_open(&r->program, CA_PROGRAM));
    r->process = ca_program_start(&r->program, words, -1);
    r->over = false;
}

static bool is_over(render *r)
{
    int status;
    struct rusage used;
    if (r->over) return true;
    const pid_t ended = wait4(r->process, &status, WNOHANG, &used);
    if (ended == 0) return false;
    assert_int_equal(ended, r->process);
    assert_true(WIFEXITED(status) && WEXITSTATUS(status) == 0);
    r->seconds = (double)used.ru_utime.tv_sec + (double)used.ru_stime.tv_sec +
                 1e-6 * ((double)used.ru_utime.tv_usec + (double)used.ru_stime.tv_usec);
    return r->over = true;
}

/* One of two at a time; the other one alone when it is over. */
static void run_by_turns(render *a, render *b)
{
    kill(a->process, SIGSTOP);
    for (render *now = b, *next = a; !is_over(a) || !is_over(b);) {
        if (!now->over) kill(now->process, SIGCONT);
        sleep_for(0.25);
        if (!is_over(now)) kill(now->process, SIGSTOP);
        render *other = now;
        now = next;
        next = other;
    }
}

static void assert_same_picture(const render *a, const render *b)
{
    ca_image_layers *images[2];
    const render *const renders[2] = {a, b};
    for (int i = 0; i < 2; i++) {
        char path[128];
        snprintf(path, sizeof path, "%s/a.exr", renders[i]->program.folder);
        assert_int_equal(ca_layers_read(path, &images[i], NULL), CA_OK);
    }
    assert_int_equal(images[0]->channel_count, images[1]->channel_count);
    for (size_t c = 0; c < images[0]->channel_count; c++)
        assert_memory_equal(images[0]->channels[c].data, images[1]->channels[c].data,
                            sizeof(float) * images[0]->width * images[0]->height);
    for (int i = 0; i < 2; i++) ca_layers_destroy(images[i]);
}

/* ---- The test -------------------------------------------------------------------------------------------------- */

/* Gives back how much more the watched one takes. */
static double one_round(void)
{
    render plain, served;
    watcher watchers[WATCHERS] = {0};
    int pictures = 0, answers = 0;
    double bytes = 0.0;
    start(&plain, false);
    start(&served, true);
    ca_live_place place;
    char output[128];
    snprintf(output, sizeof output, "%s/.stdout", served.program.folder);
    assert_true(ca_live_wait_for_place(&place, output));
    for (int i = 0; i < WATCHERS; i++) {
        watchers[i].place = place;
        assert_int_equal(pthread_create(&watchers[i].thread, NULL, watch, &watchers[i]), 0);
    }
    run_by_turns(&plain, &served);
    for (int i = 0; i < WATCHERS; i++) {
        pthread_join(watchers[i].thread, NULL);
        pictures += watchers[i].pictures;
        answers += watchers[i].answers;
        bytes += watchers[i].bytes;
    }
    print_message("%.2f s of the processor without, %.2f s with %d who look at %.1f pictures each (%d answers, %.0f "
                  "MB): %+.2f %%\n",
                  plain.seconds, served.seconds, WATCHERS, (double)pictures / WATCHERS, answers, 1e-6 * bytes,
                  100.0 * (served.seconds / plain.seconds - 1.0));
    assert_same_picture(&plain, &served);
    assert_true(pictures >= 3 * WATCHERS);
    ca_program_close(&plain.program);
    ca_program_close(&served.program);
    return served.seconds / plain.seconds - 1.0;
}

/* 3 %, and 0.5 % for how well two renders' times can be compared. */
static void test_cost(void **state)
{
    (void)state;
    double sum = 0.0;
    for (int i = 0; i < ROUNDS; i++) sum += one_round();
    print_message("in the mean %+.2f %%\n", 100.0 * sum / ROUNDS);
    assert_true(sum / ROUNDS <= 0.035);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_cost)};
    return run_program_tests("live view: what it costs", tests, 1);
}
