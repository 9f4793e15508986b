/* The live view: what those see who are let in, and what they can do: seen from plain sockets, with a render that is
 * none. */
#define _GNU_SOURCE
#include "live/server.h"
#include "base/memory.h"
#include "support/live_client.h"
#include "support/live_fixture.h"

#include <math.h>
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>

/* ---- What is served -------------------------------------------------------------------------------------------- */

static const char everything[] = "200 200 200 200 200 200 200 404 404 404 | 403 403 400 400 405";

static int fetch(const char *path, const char *host, char *text, size_t size)
{
    return ca_live_fetch(fake.place.port, "GET", path, host, text, size);
}

static void look_at_everything(char *seen, size_t size)
{
    char text[1 << 16], path[128];
    size_t used = 0;
    const int events = ca_live_open(&fake.place, "GET", "events");
    ca_live_read(events, "\"picture\"", text, sizeof text);
    static const char *const resources[] = {"",
                                            "style.css",
                                            "viewer.js",
                                            "live.js",
                                            "layers",
                                            "pixel?x=3&y=2",
                                            "planes?names=R,B",
                                            "planes?names=R,nothing",
                                            "pixel?x=8&y=0",
                                            "nothing"};
    for (size_t i = 0; i < sizeof resources / sizeof resources[0]; i++)
        used += (size_t)snprintf(seen + used, size - used, "%d ",
                                 ca_live_fake_fetch("GET", resources[i], text, sizeof text));
    used += (size_t)snprintf(seen + used, size - used, "| %d ",
                             fetch(fake.place.path, "evil.example", text, sizeof text));
    used += (size_t)snprintf(seen + used, size - used, "%d ", fetch("/", fake.place.host, text, sizeof text));
    snprintf(path, sizeof path, "%s%%2e%%2e/%%2e%%2e/etc/passwd", fake.place.path);
    used += (size_t)snprintf(seen + used, size - used, "%d ", fetch(path, fake.place.host, text, sizeof text));
    snprintf(path, sizeof path, "%s../../etc/passwd", fake.place.path);
    used += (size_t)snprintf(seen + used, size - used, "%d ", fetch(path, fake.place.host, text, sizeof text));
    used += (size_t)snprintf(seen + used, size - used, "%d", ca_live_fake_fetch("GET", "stop", text, sizeof text));
    close(events);
}

static void test_statuses(void **state)
{
    (void)state;
    char seen[256];
    ca_live_fake_open(true, NULL);
    assert_true(ca_live_fake_beside(look_at_everything, seen, sizeof seen));
    assert_string_equal(seen, everything);
    ca_live_fake_close();
}

/* A channel in the answer of /pixel. */
static double value_of(const char *answer, const char *channel)
{
    char key[16];
    snprintf(key, sizeof key, "\"%s\":", channel);
    const char *found = strstr(answer, key);
    return found ? atof(found + strlen(key)) : -1.0;
}

/* R of the picture of that version, as /planes and /pixel give it, and the passes that the events tell of it. */
static void follow_passes(char *seen, size_t size)
{
    char text[1 << 16], answer[4096];
    size_t used = 0;
    const int events = ca_live_open(&fake.place, "GET", "events");
    for (int version = 1; version <= 3; version++) {
        char words[64];
        unsigned passes = 0, planes_version = 0, pixel_version = 0;
        float first = 0.0f, last = 0.0f;
        snprintf(words, sizeof words, "\"version\":%d,\"passes\":", version);
        const size_t length = ca_live_read(events, words, text, sizeof text);
        ca_live_read(events, "}", text + length, sizeof text - length);
        const char *found = strstr(text, words), *body;
        if (found) passes = (unsigned)atoi(found + strlen(words));
        ca_live_fake_fetch("GET", "pixel?x=3&y=2", answer, sizeof answer);
        if ((body = strstr(answer, "{\"version\":")) != NULL) pixel_version = (unsigned)atoi(body + 11);
        const double pixel = value_of(answer, "R");
        const bool here = value_of(answer, "G") == 3.0 && value_of(answer, "B") == 2.0;
        ca_live_fake_fetch("GET", "planes?names=R,B", answer, sizeof answer);
        if ((body = strstr(answer, "Caustica-Version: ")) != NULL) planes_version = (unsigned)atoi(body + 18);
        if ((body = strstr(answer, "\r\n\r\n")) != NULL) {
            memcpy(&first, body + 4, sizeof first);
            memcpy(&last, body + 4 + (2 * CA_LIVE_PIXELS - 1) * sizeof last, sizeof last);
        }
        const bool good = passes > 0 && here && planes_version == (unsigned)version &&
                          pixel_version == (unsigned)version && first == (float)passes && pixel == passes &&
                          last == (float)(CA_LIVE_HEIGHT - 1);
        used += (size_t)snprintf(seen + used, size - used, good ? "good " : "(%u: %u %u %u: %g %g %g) ",
                                 (unsigned)version, passes, planes_version, pixel_version, (double)first, pixel,
                                 (double)last);
    }
    close(events);
}

/* A picture is taken when somebody took the last one: versions 1, 2, 3 are each seen, whatever the pace. */
static void test_three_pictures(void **state)
{
    (void)state;
    char seen[512];
    ca_live_fake_open(true, NULL);
    assert_true(ca_live_fake_beside(follow_passes, seen, sizeof seen));
    assert_string_equal(seen, "good good good ");
    ca_live_fake_close();
}

static double told(ca_live_state *state, const char *name)
{
    char text[CA_LIVE_EVENT_SIZE], key[64];
    uint64_t number;
    assert_true(ca_live_state_describe(state, text, &number) > 0);
    snprintf(key, sizeof key, "\"%s\":", name);
    const char *at = strstr(text, key);
    if (!at) fail_msg("no %s in %s", name, text);
    return strtod(at + strlen(key), NULL);
}

/* What is expected at the end is told with the estimate that it is made from, and does not change while the render
 * goes on without a new one. */
static void test_prediction_belongs_to_its_estimate(void **unused)
{
    (void)unused;
    ca_live_state state;
    const ca_render_statistics statistics = {.noise_percent = 40.0};
    fake = (ca_live_fake){.width = CA_LIVE_WIDTH, .height = CA_LIVE_HEIGHT};
    assert_int_equal(ca_live_state_init(&state, 1, NULL), CA_OK);
    assert_int_equal(ca_live_snapshot_create(&state.snapshot, ca_live_fake_picture(4), &statistics, NULL), CA_OK);
    state.snapshot->passes = 4;
    state.snapshot->seconds = 2.0;
    for (uint32_t passes = 4; passes <= 64; passes *= 4) { /* the picture's noise, at whatever pass it is looked at */
        state.progress = (ca_render_progress){
            .passes_done = passes, .passes_total = 64, .seconds = 0.5 * passes, .noise_percent = -1.0};
        assert_true(told(&state, "noise") == 40.0 && told(&state, "passes") == passes);
        assert_true(told(&state, "noise_passes") == 4.0 && told(&state, "noise_seconds") == 2.0);
        assert_true(fabs(told(&state, "predicted") - 10.0) < 1e-6);
    }
    state.progress.noise_percent = 24.0; /* the render's own estimate is newer than the picture */
    state.progress.noise_passes = 16;
    state.progress.noise_seconds = 8.0;
    assert_true(told(&state, "noise") == 24.0 && told(&state, "noise_passes") == 16.0);
    assert_true(fabs(told(&state, "predicted") - 12.0) < 1e-6);
    state.snapshot->passes = 36; /* and now older */
    state.snapshot->seconds = 18.0;
    assert_true(told(&state, "noise") == 40.0 && told(&state, "noise_passes") == 36.0);
    assert_true(fabs(told(&state, "predicted") - 30.0) < 1e-6);
    ca_live_state_clear(&state);
}

static void control(char *seen, size_t size)
{
    char text[1 << 16], answer[4096];
    size_t used = 0;
    const int events = ca_live_open(&fake.place, "GET", "events");
    size_t length = ca_live_read(events, "rendering", text, sizeof text);
    used +=
        (size_t)snprintf(seen + used, size - used, "%d ", ca_live_fake_fetch("POST", "pause", answer, sizeof answer));
    length = ca_live_read(events, "\"paused\"", text, sizeof text);
    const uint32_t passes = __atomic_load_n(&fake.passes, __ATOMIC_RELAXED);
    used += (size_t)snprintf(seen + used, size - used, "%s ",
                             length && strstr(text, "\"paused\"") ? "paused" : "not paused");
    used +=
        (size_t)snprintf(seen + used, size - used, "%d ", ca_live_fake_fetch("POST", "save", answer, sizeof answer));
    ca_live_read(events, "saved", text, sizeof text);
    used += (size_t)snprintf(seen + used, size - used, "%s ",
                             strstr(text, "saved \\u0022a.exr\\u0022") ? "saved" : "not saved");
    nanosleep(&(const struct timespec){.tv_nsec = 100000000}, NULL);
    used += (size_t)snprintf(seen + used, size - used, "%s ",
                             passes == __atomic_load_n(&fake.passes, __ATOMIC_RELAXED) ? "waited" : "went on");
    used += (size_t)snprintf(seen + used, size - used, "%d ",
                             ca_live_fake_fetch("POST", "resume", answer, sizeof answer));
    ca_live_read(events, "\"rendering\"", text, sizeof text);
    used +=
        (size_t)snprintf(seen + used, size - used, "%d", ca_live_fake_fetch("POST", "stop", answer, sizeof answer));
    close(events);
    /* Ends when it is stopped. */
    nanosleep(&(const struct timespec){.tv_sec = 1}, NULL);
}

static void test_pause_save_stop(void **state)
{
    (void)state;
    char seen[256];
    ca_live_fake_open(true, NULL);
    assert_false(ca_live_fake_beside(control, seen, sizeof seen));
    assert_string_equal(seen, "202 paused 202 saved waited 202 202");
    assert_int_equal(fake.saves, 1);
    assert_true(fake.saved > 0.0f);
    ca_live_fake_close();
}

static void pause_and_interrupt(char *seen, size_t size)
{
    char text[1 << 14];
    const int events = ca_live_open(&fake.place, "GET", "events");
    ca_live_fake_fetch("POST", "pause", text, sizeof text);
    ca_live_read(events, "\"paused\"", text, sizeof text);
    snprintf(seen, size, "%s", strstr(text, "\"paused\"") ? "paused" : "not paused");
    __atomic_store_n(&fake.interrupted, true, __ATOMIC_RELAXED);
    close(events);
}

/* A signal ends a pause: the callback returns, and its caller sees the signal. */
static void test_signal_ends_a_pause(void **state)
{
    (void)state;
    char seen[64];
    ca_live_fake_open(true, NULL);
    ca_live_fake_beside(pause_and_interrupt, seen, sizeof seen);
    assert_string_equal(seen, "paused");
    ca_live_fake_close();
}

static void see_the_end(char *seen, size_t size)
{
    char text[1 << 16], answer[4096];
    const int events = ca_live_open(&fake.place, "GET", "events");
    ca_live_read(events, "\"done\"", text, sizeof text);
    ca_live_fake_fetch("GET", "planes?names=R", answer, sizeof answer);
    const char *body = strstr(answer, "\r\n\r\n");
    float value = 0.0f;
    if (body) memcpy(&value, body + 4, sizeof value);
    snprintf(seen, size, "%g", (double)value);
    close(events);
}

static void test_last_picture(void **state)
{
    (void)state;
    char seen[64] = "";
    ca_live_fake_open(true, NULL);
    ca_live_client client = {.act = see_the_end, .seen = seen, .size = sizeof seen};
    pthread_t thread;
    assert_int_equal(pthread_create(&thread, NULL, ca_live_client_run, &client), 0);
    for (int i = 0; i < 100; i++) assert_true(ca_live_fake_pass());
    const ca_render_statistics statistics = {.iterations = 100};
    ca_live_finish(fake.live, ca_live_fake_picture(1234), &statistics);
    pthread_join(thread, NULL);
    assert_string_equal(seen, "1234");
    ca_live_fake_close();
}

/* ---- Beginning ------------------------------------------------------------------------------------------------- */

static void assert_refused(const ca_live_settings *settings, ca_status expected, const char *words)
{
    ca_error error = {""};
    ca_live *live;
    assert_int_equal(ca_live_create(&live, settings, &error), expected);
    assert_null(live);
    assert_says(error.message, words);
}

static void test_refusals(void **state)
{
    (void)state;
    ca_live_fake_open(true, NULL);
    ca_live_settings settings = {
        .title = "", .save = ca_live_fake_save, .is_interrupted = ca_live_fake_interrupted, .serves = true};
    settings.port = (uint32_t)fake.place.port;
    assert_refused(&settings, CA_ERROR_FILE, "cannot listen on 127.0.0.1");
    settings.port = 0;
    settings.address = "localhost";
    assert_refused(&settings, CA_ERROR_ARGUMENT, "\"localhost\" is not an address in numbers");
    ca_live_fake_close();
}

/* Each allocation fails once: a message, and nothing is left. */
static void test_no_memory(void **state)
{
    (void)state;
    const ca_live_settings settings = {
        .title = "", .save = ca_live_fake_save, .is_interrupted = ca_live_fake_interrupted, .serves = true};
    for (long allowed = 0;; allowed++) {
        ca_live *live;
        ca_error error = {""};
        assert_true(allowed < 20);
        ca_memory_fail_after(allowed);
        const ca_status status = ca_live_create(&live, &settings, &error);
        ca_memory_fail_after(-1);
        if (status == CA_OK) {
            ca_live_destroy(live);
            break;
        }
        assert_int_equal(status, CA_ERROR_MEMORY);
        assert_says(error.message, "out of memory");
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_statuses),
        cmocka_unit_test(test_three_pictures),
        cmocka_unit_test(test_prediction_belongs_to_its_estimate),
        cmocka_unit_test(test_pause_save_stop),
        cmocka_unit_test(test_signal_ends_a_pause),
        cmocka_unit_test(test_last_picture),
        cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_no_memory),
    };
    return cmocka_run_group_tests_name("live view", tests, NULL, NULL);
}
