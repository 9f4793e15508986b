/* The live view among strangers: a crowd of connections that say nothing, or very slowly, keeps nobody out; a viewer
 * that does not answer holds nobody up; calls without what they need are answered. */
#define _GNU_SOURCE
#include "base/clock.h"
#include "live/clients.h"
#include "support/live_fixture.h"
#include "support/scene_text.h"

#include <arpa/inet.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cmocka.h>

enum { CROWD = 300 };
static int crowd[CROWD];

/* All that came until now, and no more will. */
static bool is_hung_up_on(int peer)
{
    char bytes[4096];
    ssize_t count;
    while ((count = recv(peer, bytes, sizeof bytes, MSG_DONTWAIT)) > 0) continue;
    return count == 0;
}

/* Half of them begin a request. Somebody watches already. */
static void come_in_a_crowd(char *seen, size_t size)
{
    (void)size;
    const int watcher = ca_live_open(&fake.place, "GET", "events");
    char event[256];
    ca_live_read(watcher, "data: ", event, sizeof event);
    for (int i = 0; i < CROWD; i++) {
        crowd[i] = ca_live_connect(fake.place.port);
        if (crowd[i] >= 0 && i % 2) ca_live_send(crowd[i], "GET / HTTP/1.1\r\nX-Nothing: ");
    }
    char text[1 << 14];
    const double start = ca_clock_seconds();
    seen[0] = (char)(ca_live_fake_fetch("GET", "", text, sizeof text) == 200);
    seen[1] = (char)(ca_clock_seconds() - start < 2.0 && !is_hung_up_on(watcher));
    close(watcher);
}

static void test_a_person_gets_in(void **state)
{
    (void)state;
    char seen[2] = {0};
    ca_live_fake_open(true, NULL);
    assert_true(ca_live_fake_beside(come_in_a_crowd, seen, sizeof seen));
    for (int i = 0; i < CROWD; i++)
        if (crowd[i] >= 0) close(crowd[i]);
    ca_live_fake_close();
    assert_true(seen[0] && seen[1]);
}

/* ---- Strangers ------------------------------------------------------------------------------------------------- */

static void test_strangers(void **state)
{
    (void)state;
    enum { COUNT = CA_LIVE_MOST_STRANGERS + 3 };
    ca_live_clients clients = {0};
    ca_live_visitor *visitors[COUNT];
    int pairs[COUNT][2];
    for (int i = 0; i < COUNT; i++) {
        assert_int_equal(socketpair(AF_UNIX, SOCK_STREAM, 0, pairs[i]), 0);
        visitors[i] = ca_live_clients_add(&clients, pairs[i][0], i < 10 ? 0.0 : 5.0);
        assert_non_null(visitors[i]);
        if (i == 1) ca_live_clients_know(&clients, visitors[1]);
    }
    /* 0, 2 had to go for the last two; 1 is known. */
    for (int i = 0; i < COUNT; i++) assert_true(is_hung_up_on(pairs[i][1]) == (i == 0 || i == 2));
    assert_int_equal(clients.strangers, CA_LIVE_MOST_STRANGERS);
    ca_live_clients_know(&clients, visitors[4]);
    ca_live_clients_expire(&clients, 10.0);
    assert_false(is_hung_up_on(pairs[3][1]));
    ca_live_clients_expire(&clients, 10.5);
    for (int i = 0; i < COUNT; i++) assert_true(is_hung_up_on(pairs[i][1]) == (i < 10 && i != 1 && i != 4));
    for (int i = 0; i < COUNT; i++) {
        ca_live_clients_remove(&clients, visitors[i]);
        close(pairs[i][0]);
        close(pairs[i][1]);
    }
    assert_true(clients.strangers == 0 && !clients.oldest && !clients.newest);
}

/* Somebody who sends a byte of a header a second is hung up on all the same. */
static void drip(char *seen, size_t size)
{
    (void)size;
    const int slow = ca_live_connect(fake.place.port);
    const double start = ca_clock_seconds();
    ca_live_send(slow, "GET / HTTP/1.1\r\nX-Nothing: ");
    while (!is_hung_up_on(slow) && ca_clock_seconds() - start < 15.0) {
        ca_live_send(slow, "x");
        usleep(500000);
    }
    const double seconds = ca_clock_seconds() - start;
    seen[0] = (char)(seconds > CA_LIVE_STRANGER_SECONDS - 1.0 && seconds < CA_LIVE_STRANGER_SECONDS + 3.0);
    close(slow);
}

static void test_slow_headers(void **state)
{
    (void)state;
    char seen[1] = {0};
    ca_live_fake_open(true, NULL);
    assert_true(ca_live_fake_beside(drip, seen, sizeof seen));
    ca_live_fake_close();
    assert_true(seen[0]);
}

/* ---- tev ------------------------------------------------------------------------------------------------------- */

/* A port at which connections are neither taken nor refused: the queue of a listener that takes none is full. */
static void test_tev_that_does_not_answer(void **state)
{
    (void)state;
    enum { FILL = 4 };
    struct sockaddr_in place = {.sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    socklen_t size = sizeof place;
    int fill[FILL];
    const int listener = socket(AF_INET, SOCK_STREAM, 0);
    assert_int_equal(bind(listener, (struct sockaddr *)&place, sizeof place), 0);
    assert_int_equal(listen(listener, 0), 0);
    assert_int_equal(getsockname(listener, (struct sockaddr *)&place, &size), 0);
    for (int i = 0; i < FILL; i++) {
        fill[i] = socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK, 0);
        (void)connect(fill[i], (struct sockaddr *)&place, sizeof place);
    }
    char tev[32];
    ca_live *live;
    ca_error error = {""};
    snprintf(tev, sizeof tev, "127.0.0.1:%d", ntohs(place.sin_port));
    const ca_live_settings settings = {
        .title = "", .save = ca_live_fake_save, .is_interrupted = ca_live_fake_interrupted, .tev = tev};
    const double start = ca_clock_seconds();
    assert_int_equal(ca_live_create(&live, &settings, &error), CA_ERROR_FILE);
    const double seconds = ca_clock_seconds() - start;
    assert_says(error.message, "timed out");
    if (!(seconds > 1.5 && seconds < 2.5)) fail_msg("it took %g s", seconds);
    for (int i = 0; i < FILL; i++) close(fill[i]);
    close(listener);
}

/* ---- What is missing ------------------------------------------------------------------------------------------- */

static int snapshots;

static bool ask_wrongly(const ca_render_progress *progress, void *user)
{
    (void)user;
    ca_image_layers *image = NULL;
    ca_error error = {""};
    if (!progress->snapshot) return true;
    assert_int_equal(progress->snapshot(NULL, &image, NULL, &error), CA_ERROR_ARGUMENT);
    assert_int_equal(progress->snapshot(progress, NULL, NULL, &error), CA_ERROR_ARGUMENT);
    assert_true(error.message[0] != '\0');
    assert_int_equal(progress->snapshot(progress, NULL, NULL, NULL), CA_ERROR_ARGUMENT);
    assert_int_equal(progress->snapshot(progress, &image, NULL, NULL), CA_OK);
    assert_non_null(image);
    ca_image_release(image);
    return ++snapshots % 2 == 1; /* twice for each render */
}

static void test_calls_without_what_they_need(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(
        "<scene version='3.0.0'><sensor type='perspective'><film type='hdrfilm'><integer name='width' value='8'/>"
        "<integer name='height' value='8'/></film></sensor><emitter type='constant'/></scene>");
    ca_image_layers *image = NULL;
    ca_error error = {""};
    assert_int_equal(ca_render(NULL, NULL, &image, NULL, &error), CA_ERROR_ARGUMENT);
    assert_int_equal(ca_render(scene, NULL, NULL, NULL, &error), CA_ERROR_ARGUMENT);
    assert_int_equal(ca_render(NULL, NULL, NULL, NULL, NULL), CA_ERROR_ARGUMENT);
    static const char *const integrators[] = {"path", "qmcppm", "bdpm"};
    for (int i = 0; i < 3; i++) {
        ca_render_settings settings;
        ca_render_settings_init(&settings);
        settings.integrator = integrators[i];
        settings.samples_per_pixel = i == 2 ? 0 : 10;
        settings.rays = i == 2 ? "auto" : NULL;
        settings.seconds = i == 2 ? 10.0 : 0.0;
        settings.progress = ask_wrongly;
        assert_int_equal(ca_render(scene, &settings, &image, NULL, NULL), CA_OK);
        ca_image_release(image);
    }
    assert_int_equal(snapshots, 6);
    ca_scene_release(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_person_gets_in),
        cmocka_unit_test(test_strangers),
        cmocka_unit_test(test_slow_headers),
        cmocka_unit_test(test_tev_that_does_not_answer),
        cmocka_unit_test(test_calls_without_what_they_need),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
