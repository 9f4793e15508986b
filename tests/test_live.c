/* The live view: who is let in, what those see, what they can do, and that nobody who looks can hold up a render: seen from plain
 * sockets, with a render that is none. */
#define _GNU_SOURCE
#include "live/live.h"
#include "live/access.h"
#include "live/budget.h"
#include "live/snapshot.h"
#include "base/clock.h"
#include "base/memory.h"

#include <arpa/inet.h>
#include <dirent.h>
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

enum { WIDTH = 8, HEIGHT = 4, PIXELS = WIDTH * HEIGHT };

static void assert_says(const char *text, const char *words)
{
    if (!strstr(text, words)) fail_msg("\"%s\" is not said in: %s", words, text);
}

/* ---- Requests judged -------------------------------------------------------------------------------------------------- */

static int judge(const char *address, const char *method, const char *path, const char *host, const char *origin)
{
    ca_live_access access = {.token = "0123456789abcdef0123456789abcdef", .port = 8080};
    strcpy(access.address, address);
    access.any_address = strcmp(address, "0.0.0.0") == 0;
    const ca_live_request request = {.method = method, .path = path, .host = host, .origin = origin};
    ca_live_resource resource;
    return ca_live_judge(&access, &request, &resource);
}

#define TOKEN "/0123456789abcdef0123456789abcdef"

static void test_access(void **state)
{
    (void)state;
    const char *const here = "127.0.0.1", *const host = "127.0.0.1:8080";
    assert_int_equal(judge(here, "GET", TOKEN "/", host, NULL), 200);
    assert_int_equal(judge(here, "GET", TOKEN "/events", "localhost:8080", "http://localhost:8080"), 200);
    assert_int_equal(judge("::1", "GET", TOKEN "/", "[::1]:8080", NULL), 200);
    /* The token: none, a part of it, one letter wrong, something behind it. */
    assert_int_equal(judge(here, "GET", "/", host, NULL), 403);
    assert_int_equal(judge(here, "GET", "/events", host, NULL), 403);
    assert_int_equal(judge(here, "GET", TOKEN, host, NULL), 403);
    assert_int_equal(judge(here, "GET", "/0123456789abcdef0123456789abcde/", host, NULL), 403);
    assert_int_equal(judge(here, "GET", "/0123456789abcdef0123456789abcdee/", host, NULL), 403);
    assert_int_equal(judge(here, "GET", TOKEN "0/", host, NULL), 403);
    /* The host: a name that resolves to this machine, another port, no port, none at all. */
    static const char *const wrong_hosts[] = {"evil.example:8080", "127.0.0.1:8081", "127.0.0.1",       "127.0.0.2:8080",
                                              "localhost.evil.example:8080", "[127.0.0.1:8080", "", ":8080", "127.0.0.1:8080x"};
    for (size_t i = 0; i < sizeof wrong_hosts / sizeof wrong_hosts[0]; i++)
        assert_int_equal(judge(here, "GET", TOKEN "/", wrong_hosts[i], NULL), 403);
    assert_int_equal(judge(here, "GET", TOKEN "/", NULL, NULL), 400);
    assert_int_equal(judge("0.0.0.0", "GET", TOKEN "/", "192.168.1.5:8080", NULL), 200);
    assert_int_equal(judge("0.0.0.0", "GET", TOKEN "/", "evil.example:8080", NULL), 403);
    /* Another page's request. */
    assert_int_equal(judge(here, "POST", TOKEN "/stop", host, "http://evil.example:8080"), 403);
    assert_int_equal(judge(here, "POST", TOKEN "/stop", host, "null"), 403);
    assert_int_equal(judge(here, "POST", TOKEN "/stop", host, "http://127.0.0.1:8080"), 200);
    /* Paths that climb, and things that are not there. */
    static const char *const climbing[] = {TOKEN "/../etc/passwd", TOKEN "/..", "/../" TOKEN "/", TOKEN "//etc/passwd",
                                           TOKEN "/..\\live.js", TOKEN "/%2e%2e/live.js", "etc/passwd", "*"};
    for (size_t i = 0; i < sizeof climbing / sizeof climbing[0]; i++)
        assert_int_equal(judge(here, "GET", climbing[i], host, NULL), 400);
    assert_int_equal(judge(here, "GET", TOKEN "/compare.js", host, NULL), 404);
    assert_int_equal(judge(here, "GET", TOKEN "/events/", host, NULL), 404);
    assert_int_equal(judge(here, "GET", TOKEN "/stop", host, NULL), 405);
    assert_int_equal(judge(here, "POST", TOKEN "/", host, NULL), 405);
    assert_int_equal(judge(here, "DELETE", TOKEN "/events", host, NULL), 405);
}

static void test_tokens_differ(void **state)
{
    (void)state;
    char a[CA_LIVE_TOKEN_LENGTH + 1], b[CA_LIVE_TOKEN_LENGTH + 1];
    assert_true(ca_live_make_token(a) && ca_live_make_token(b));
    assert_int_equal(strlen(a), CA_LIVE_TOKEN_LENGTH);
    assert_int_equal(strspn(a, "0123456789abcdef"), CA_LIVE_TOKEN_LENGTH);
    assert_string_not_equal(a, b);
}

static void test_budget(void **state)
{
    (void)state;
    const ca_live_budget budget = {.start = 100.0, .spent = 0.65};
    assert_true(ca_live_budget_allows(&budget, 120.01, 0.0));   /* 0.05 and 3 % of 20 s */
    assert_false(ca_live_budget_allows(&budget, 119.9, 0.0));
    assert_false(ca_live_budget_allows(&budget, 120.01, 0.01));
}

/* ---- A render that is none -------------------------------------------------------------------------------------------- */

typedef struct fake_render {
    ca_live *live;
    char host[32], path[64]; /* of the page: "127.0.0.1:8080", "/0123.../" */
    int port;
    uint32_t passes;
    int saves;
    float saved;      /* R of the picture that was saved */
    bool interrupted; /* by a signal */
} fake_render;

static fake_render fake; /* cmocka's tests run one after the other; the callback has no user */

static bool is_interrupted(void) { return __atomic_load_n(&fake.interrupted, __ATOMIC_RELAXED); }

/* R is the number of passes, G and B are the place. */
static ca_image_layers *picture_of(uint32_t passes)
{
    ca_image_layers *image;
    float *planes[3];
    static const char *const names[3] = {"R", "G", "B"};
    assert_int_equal(ca_layers_create(&image, WIDTH, HEIGHT, NULL), CA_OK);
    for (int c = 0; c < 3; c++) assert_int_equal(ca_layers_add(image, names[c], &planes[c], NULL), CA_OK);
    for (int i = 0; i < PIXELS; i++) {
        planes[0][i] = (float)passes;
        planes[1][i] = (float)(i % WIDTH);
        planes[2][i] = (float)(i / WIDTH);
    }
    return image;
}

static ca_status snapshot(const ca_render_progress *progress, ca_image_layers **image, ca_render_statistics *statistics,
                          ca_error *error)
{
    (void)error;
    *image = picture_of(progress->passes_done);
    *statistics = (ca_render_statistics){.samples_per_pixel = progress->passes_done, .noise_percent = 5.0};
    return CA_OK;
}

static ca_status save(const ca_image_layers *image, const ca_render_statistics *statistics, void *user, char *message, size_t size,
                      ca_error *error)
{
    (void)error;
    fake_render *f = user;
    f->saves++;
    f->saved = ca_layers_find(image, "R")[0];
    snprintf(message, size, "saved \"a.exr\" with %g samples", statistics->samples_per_pixel);
    return CA_OK;
}

static void open_fake(bool serves, const char *tev)
{
    ca_error error = {""};
    fake = (fake_render){0};
    const ca_live_settings settings = {.serves = serves, .tev = tev, .title = "a <test>", .threads = 1, .save = save,
                                       .is_interrupted = is_interrupted, .user = &fake};
    if (ca_live_create(&fake.live, &settings, &error) != CA_OK) fail_msg("%s", error.message);
    if (!serves) return;
    assert_int_equal(sscanf(ca_live_url(fake.live), "http://%31[^/]%63s", fake.host, fake.path), 2);
    fake.port = atoi(strchr(fake.host, ':') + 1);
}

static void close_fake(void)
{
    ca_live_destroy(fake.live);
    fake.live = NULL;
}

static bool one_pass(void)
{
    const ca_render_progress progress = {.passes_done = ++fake.passes, .passes_total = 100000, .seconds = 0.01 * fake.passes,
                                         .noise_percent = -1.0, .snapshot = snapshot};
    /* Work, so that there is processor time to spend 3 % of. */
    for (const double end = ca_clock_thread_seconds() + 0.005; ca_clock_thread_seconds() < end;) continue;
    return ca_live_report(fake.live, &progress);
}

/* ---- Clients ------------------------------------------------------------------------------------------------------------ */

static int connect_client(int port)
{
    const struct sockaddr_in place = {.sin_family = AF_INET, .sin_port = htons((uint16_t)port), .sin_addr = {htonl(INADDR_LOOPBACK)}};
    const struct timeval patience = {.tv_sec = 20};
    const int client = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    setsockopt(client, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    if (connect(client, (const struct sockaddr *)&place, sizeof place) == 0) return client;
    close(client);
    return -1;
}

static void send_text(int client, const char *text)
{
    if (send(client, text, strlen(text), MSG_NOSIGNAL) < 0) return; /* the answer will be missed */
}

static int ask(int port, const char *method, const char *path, const char *host)
{
    char request[512];
    const int client = connect_client(port);
    if (client < 0) return -1;
    snprintf(request, sizeof request, "%s %s HTTP/1.1\r\nHost: %s\r\nConnection: close\r\nContent-Length: 0\r\n\r\n", method, path, host);
    send_text(client, request);
    return client;
}

/* Reads until `words` have come or the end; gives back how much. */
static size_t read_answer(int client, const char *words, char *text, size_t size)
{
    size_t length = 0;
    text[0] = '\0';
    while (client >= 0 && length + 1 < size && !(words && memmem(text, length, words, strlen(words)))) {
        const ssize_t got = recv(client, text + length, size - 1 - length, 0);
        if (got <= 0) break;
        length += (size_t)got;
        text[length] = '\0';
    }
    return length;
}

/* The status of a whole request; the answer is kept in `text`. */
static int fetch(const char *method, const char *path, const char *host, char *text, size_t size)
{
    int status = 0;
    const int client = ask(fake.port, method, path, host);
    read_answer(client, NULL, text, size);
    if (client >= 0) close(client);
    sscanf(text, "HTTP/1.1 %d", &status);
    return status;
}

static int fetch_ours(const char *method, const char *resource, char *text, size_t size)
{
    char path[256];
    snprintf(path, sizeof path, "%s%s", fake.path, resource);
    return fetch(method, path, fake.host, text, size);
}

static int open_events(void)
{
    char path[128];
    snprintf(path, sizeof path, "%sevents", fake.path);
    return ask(fake.port, "GET", path, fake.host);
}

/* A client in a thread of its own; it must not assert. The render goes on until it is ready. */
typedef struct client_thread {
    void (*act)(char *seen, size_t size);
    char *seen;
    size_t size;
    bool ready;
} client_thread;

static void *run_client(void *user)
{
    client_thread *c = user;
    c->act(c->seen, c->size);
    __atomic_store_n(&c->ready, true, __ATOMIC_RELEASE);
    return NULL;
}

/* Renders until the client is ready, or somebody stops it; false then. */
static bool render_beside(void (*act)(char *seen, size_t size), char *seen, size_t size)
{
    client_thread client = {.act = act, .seen = seen, .size = size};
    pthread_t thread;
    bool goes_on = true;
    seen[0] = '\0';
    assert_int_equal(pthread_create(&thread, NULL, run_client, &client), 0);
    while (goes_on && !__atomic_load_n(&client.ready, __ATOMIC_ACQUIRE)) goes_on = one_pass();
    pthread_join(thread, NULL);
    return goes_on;
}

/* ---- What is served ------------------------------------------------------------------------------------------------------ */

static const char everything[] = "200 200 200 200 200 200 200 404 404 404 | 403 403 400 400 405";

static void look_at_everything(char *seen, size_t size)
{
    char text[1 << 16], path[128];
    size_t used = 0;
    const int events = open_events();
    read_answer(events, "\"picture\"", text, sizeof text);
    static const char *const resources[] = {"", "style.css", "viewer.js", "live.js", "layers", "pixel?x=3&y=2", "planes?names=R,B",
                                            "planes?names=R,nothing", "pixel?x=8&y=0", "nothing"};
    for (size_t i = 0; i < sizeof resources / sizeof resources[0]; i++)
        used += (size_t)snprintf(seen + used, size - used, "%d ", fetch_ours("GET", resources[i], text, sizeof text));
    used += (size_t)snprintf(seen + used, size - used, "| %d ", fetch("GET", fake.path, "evil.example", text, sizeof text));
    used += (size_t)snprintf(seen + used, size - used, "%d ", fetch("GET", "/", fake.host, text, sizeof text));
    snprintf(path, sizeof path, "%s%%2e%%2e/%%2e%%2e/etc/passwd", fake.path);
    used += (size_t)snprintf(seen + used, size - used, "%d ", fetch("GET", path, fake.host, text, sizeof text));
    snprintf(path, sizeof path, "%s../../etc/passwd", fake.path);
    used += (size_t)snprintf(seen + used, size - used, "%d ", fetch("GET", path, fake.host, text, sizeof text));
    used += (size_t)snprintf(seen + used, size - used, "%d", fetch_ours("GET", "stop", text, sizeof text));
    close(events);
}

static void test_statuses(void **state)
{
    (void)state;
    char seen[256];
    open_fake(true, NULL);
    assert_true(render_beside(look_at_everything, seen, sizeof seen));
    assert_string_equal(seen, everything);
    close_fake();
}

/* R of the picture of that version, as /planes and /pixel give it, and the passes that the events tell of it. */
static void follow_passes(char *seen, size_t size)
{
    char text[1 << 16], answer[4096];
    size_t used = 0;
    const int events = open_events();
    for (int version = 1; version <= 3; version++) {
        char words[64];
        unsigned passes = 0, planes_version = 0, pixel_version = 0;
        float first = 0.0f, last = 0.0f;
        double pixel = 0.0;
        snprintf(words, sizeof words, "\"version\":%d,\"passes\":", version);
        const size_t length = read_answer(events, words, text, sizeof text);
        read_answer(events, "}", text + length, sizeof text - length);
        const char *found = strstr(text, words), *body;
        if (found) passes = (unsigned)atoi(found + strlen(words));
        fetch_ours("GET", "pixel?x=3&y=2", answer, sizeof answer);
        if ((body = strstr(answer, "\r\n\r\n")) != NULL) sscanf(body + 4, "{\"version\":%u,\"values\":{\"R\":%lf", &pixel_version, &pixel);
        fetch_ours("GET", "planes?names=R,B", answer, sizeof answer);
        if ((body = strstr(answer, "Caustica-Version: ")) != NULL) planes_version = (unsigned)atoi(body + 18);
        if ((body = strstr(answer, "\r\n\r\n")) != NULL) {
            memcpy(&first, body + 4, sizeof first);
            memcpy(&last, body + 4 + (2 * PIXELS - 1) * sizeof last, sizeof last);
        }
        const bool good = passes > 0 && planes_version == (unsigned)version && pixel_version == (unsigned)version &&
                          first == (float)passes && pixel == passes && last == (float)(HEIGHT - 1);
        used += (size_t)snprintf(seen + used, size - used, good ? "good " : "(%u: %u %u %u: %g %g %g) ", (unsigned)version, passes,
                                 planes_version, pixel_version, (double)first, pixel, (double)last);
    }
    close(events);
}

/* A picture is taken when somebody took the last one: versions 1, 2, 3 are each seen, whatever the pace. */
static void test_three_pictures(void **state)
{
    (void)state;
    char seen[512];
    open_fake(true, NULL);
    assert_true(render_beside(follow_passes, seen, sizeof seen));
    assert_string_equal(seen, "good good good ");
    close_fake();
}

static void control(char *seen, size_t size)
{
    char text[1 << 16], answer[4096];
    size_t used = 0;
    const int events = open_events();
    size_t length = read_answer(events, "rendering", text, sizeof text);
    used += (size_t)snprintf(seen + used, size - used, "%d ", fetch_ours("POST", "pause", answer, sizeof answer));
    length = read_answer(events, "\"paused\"", text, sizeof text);
    const uint32_t passes = __atomic_load_n(&fake.passes, __ATOMIC_RELAXED);
    used += (size_t)snprintf(seen + used, size - used, "%s ", length && strstr(text, "\"paused\"") ? "paused" : "not paused");
    used += (size_t)snprintf(seen + used, size - used, "%d ", fetch_ours("POST", "save", answer, sizeof answer));
    read_answer(events, "saved", text, sizeof text);
    used += (size_t)snprintf(seen + used, size - used, "%s ", strstr(text, "saved \\u0022a.exr\\u0022") ? "saved" : "not saved");
    nanosleep(&(const struct timespec){.tv_nsec = 100000000}, NULL);
    used += (size_t)snprintf(seen + used, size - used, "%s ",
                             passes == __atomic_load_n(&fake.passes, __ATOMIC_RELAXED) ? "waited" : "went on");
    used += (size_t)snprintf(seen + used, size - used, "%d ", fetch_ours("POST", "resume", answer, sizeof answer));
    read_answer(events, "\"rendering\"", text, sizeof text);
    used += (size_t)snprintf(seen + used, size - used, "%d", fetch_ours("POST", "stop", answer, sizeof answer));
    close(events);
    /* Ends when it is stopped. */
    nanosleep(&(const struct timespec){.tv_sec = 1}, NULL);
}

static void test_pause_save_stop(void **state)
{
    (void)state;
    char seen[256];
    open_fake(true, NULL);
    assert_false(render_beside(control, seen, sizeof seen));
    assert_string_equal(seen, "202 paused 202 saved waited 202 202");
    assert_int_equal(fake.saves, 1);
    assert_true(fake.saved > 0.0f);
    close_fake();
}

static void pause_and_interrupt(char *seen, size_t size)
{
    char text[1 << 14];
    const int events = open_events();
    fetch_ours("POST", "pause", text, sizeof text);
    read_answer(events, "\"paused\"", text, sizeof text);
    snprintf(seen, size, "%s", strstr(text, "\"paused\"") ? "paused" : "not paused");
    __atomic_store_n(&fake.interrupted, true, __ATOMIC_RELAXED);
    close(events);
}

/* A signal ends a pause: the callback returns, and its caller sees the signal. */
static void test_signal_ends_a_pause(void **state)
{
    (void)state;
    char seen[64];
    open_fake(true, NULL);
    render_beside(pause_and_interrupt, seen, sizeof seen);
    assert_string_equal(seen, "paused");
    close_fake();
}

static void see_the_end(char *seen, size_t size)
{
    char text[1 << 16], answer[4096];
    const int events = open_events();
    read_answer(events, "\"done\"", text, sizeof text);
    fetch_ours("GET", "planes?names=R", answer, sizeof answer);
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
    open_fake(true, NULL);
    client_thread client = {.act = see_the_end, .seen = seen, .size = sizeof seen};
    pthread_t thread;
    assert_int_equal(pthread_create(&thread, NULL, run_client, &client), 0);
    for (int i = 0; i < 100; i++) assert_true(one_pass());
    const ca_render_statistics statistics = {.iterations = 100};
    ca_live_finish(fake.live, picture_of(1234), &statistics);
    pthread_join(thread, NULL);
    assert_string_equal(seen, "1234");
    close_fake();
}

/* ---- Who hangs, and who dies ---------------------------------------------------------------------------------------------- */

enum { HANGING = 200 };

/* Every fourth says nothing, a half request, or asks for events or pictures that it never reads. */
static void open_hanging(int clients[HANGING])
{
    char request[256], half[64];
    snprintf(half, sizeof half, "GET %.40s", fake.path);
    for (int i = 0; i < HANGING; i++) {
        clients[i] = connect_client(fake.port);
        assert_true(clients[i] >= 0);
        snprintf(request, sizeof request, "GET %s%s HTTP/1.1\r\nHost: %s\r\n\r\n", fake.path, i % 4 == 2 ? "events" : "planes?names=R,G,B",
                 fake.host);
        if (i % 4 > 0) send_text(clients[i], i % 4 == 1 ? half : request);
    }
}

static void test_hanging_clients(void **state)
{
    (void)state;
    int clients[HANGING];
    char seen[512];
    open_fake(true, NULL);
    open_hanging(clients);
    const double start = ca_clock_thread_seconds();
    double longest = 0.0;
    for (int i = 0; i < 200; i++) {
        const double before = ca_clock_thread_seconds();
        assert_true(one_pass());
        const double took = ca_clock_thread_seconds() - before;
        if (took > longest) longest = took;
    }
    print_message("200 passes of 5 ms beside %d hanging clients: %.3f s of the rendering thread, the longest %.1f ms\n", HANGING,
                  ca_clock_thread_seconds() - start, 1e3 * longest);
    assert_true(ca_clock_thread_seconds() - start < 1.3);
    /* And somebody who does not hang sees all. */
    assert_true(render_beside(look_at_everything, seen, sizeof seen));
    assert_string_equal(seen, everything);
    /* They do not hold up the end for longer than the farewell. */
    const ca_render_statistics statistics = {.iterations = 200};
    const double end = ca_clock_seconds();
    ca_live_finish(fake.live, picture_of(200), &statistics);
    assert_true(ca_clock_seconds() - end < 8.0);
    close_fake();
    for (int i = 0; i < HANGING; i++) close(clients[i]);
}

static void test_dying_clients(void **state)
{
    (void)state;
    char seen[512];
    const struct linger reset = {.l_onoff = 1, .l_linger = 0};
    open_fake(true, NULL);
    for (int i = 0; i < 100; i++) {
        char request[256];
        const int client = connect_client(fake.port);
        snprintf(request, sizeof request, "GET %s%s HTTP/1.1\r\nHost: %s\r\n\r\n", fake.path, i % 2 ? "events" : "planes?names=R,G,B",
                 fake.host);
        send_text(client, request);
        assert_true(one_pass());
        setsockopt(client, SOL_SOCKET, SO_LINGER, &reset, sizeof reset);
        close(client);
    }
    assert_true(render_beside(look_at_everything, seen, sizeof seen));
    assert_string_equal(seen, everything);
    close_fake();
}

/* ---- What looking costs -------------------------------------------------------------------------------------------------- */

/* The newest thread of this process. */
static int newest_thread(void)
{
    int newest = 0;
    DIR *folder = opendir("/proc/self/task");
    for (const struct dirent *entry; folder && (entry = readdir(folder)) != NULL;)
        if (atoi(entry->d_name) > newest) newest = atoi(entry->d_name);
    if (folder) closedir(folder);
    return newest;
}

/* Processor seconds of a thread. */
static double thread_seconds(int thread)
{
    char path[64];
    double nanoseconds = 0.0;
    snprintf(path, sizeof path, "/proc/self/task/%d/schedstat", thread);
    FILE *file = fopen(path, "r");
    if (!file) return -1.0;
    if (fscanf(file, "%lf", &nanoseconds) != 1) nanoseconds = -1e9;
    fclose(file);
    return 1e-9 * nanoseconds;
}

static bool hammers;

static void hammer(char *seen, size_t size)
{
    char text[1 << 16];
    int count = 0;
    for (; __atomic_load_n(&hammers, __ATOMIC_RELAXED); count++)
        fetch_ours("GET", count % 2 ? "planes?names=R,G,B" : "viewer.js", text, sizeof text);
    snprintf(seen, size, "%d", count);
}

static void test_cost(void **state)
{
    (void)state;
    enum { GREEDY = 6 };
    char seen[GREEDY][16];
    client_thread clients[GREEDY];
    pthread_t threads[GREEDY];
    open_fake(true, NULL);
    const int thread = newest_thread();
    if (thread_seconds(thread) < 0.0) {
        print_message("SKIPPED: this system does not tell the processor time of threads\n");
        close_fake();
        skip();
    }
    hammers = true;
    const double before = ca_live_process_seconds();
    for (int i = 0; i < GREEDY; i++) {
        clients[i] = (client_thread){.act = hammer, .seen = seen[i], .size = sizeof seen[i]};
        assert_int_equal(pthread_create(&threads[i], NULL, run_client, &clients[i]), 0);
    }
    while (ca_live_process_seconds() < before + 2.0) assert_true(one_pass());
    const double served = thread_seconds(thread), all = ca_live_process_seconds() - before;
    __atomic_store_n(&hammers, false, __ATOMIC_RELAXED);
    for (int i = 0; i < GREEDY; i++) {
        while (!__atomic_load_n(&clients[i].ready, __ATOMIC_ACQUIRE)) assert_true(one_pass());
        pthread_join(threads[i], NULL);
    }
    print_message("beside %d greedy clients (%s requests of the first) serving took %.3f s of %.3f s of the processors: %.2f %%\n",
                  GREEDY, seen[0], served, all, 100.0 * served / all);
    assert_true(atoi(seen[0]) > 0);
    assert_true(served <= CA_LIVE_ADVANCE_SECONDS + CA_LIVE_SHARE * all + 0.01);
    close_fake();
}

/* ---- tev ------------------------------------------------------------------------------------------------------------------ */

/* A small receiver of tev's packets, and the image that it was told to show. */
typedef struct receiver {
    int listener, port;
    char name[64];
    int creates, updates; /* packets */
    bool wrong;           /* a packet that is not as the protocol has it */
    float image[3][PIXELS];
} receiver;

static receiver open_receiver(void)
{
    struct sockaddr_in place = {.sin_family = AF_INET, .sin_addr = {htonl(INADDR_LOOPBACK)}};
    socklen_t size = sizeof place;
    receiver r = {.listener = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)};
    assert_int_equal(bind(r.listener, (const struct sockaddr *)&place, size), 0);
    assert_int_equal(listen(r.listener, 4), 0);
    assert_int_equal(getsockname(r.listener, (struct sockaddr *)&place, &size), 0);
    r.port = ntohs(place.sin_port);
    return r;
}

static bool read_bytes(int from, void *bytes, size_t count)
{
    for (size_t got = 0; got < count;) {
        const ssize_t more = recv(from, (char *)bytes + got, count - got, 0);
        if (more <= 0) return false;
        got += (size_t)more;
    }
    return true;
}

static int64_t take_integer(const unsigned char **at, int bytes)
{
    uint64_t value = 0;
    for (int i = 0; i < bytes; i++) value |= (uint64_t)(*at)[i] << (8 * i);
    *at += bytes;
    return bytes == 4 ? (int64_t)(int32_t)value : (int64_t)value;
}

static bool take_text(const unsigned char **at, const char *expected)
{
    const bool same = strcmp((const char *)*at, expected) == 0;
    *at += strlen((const char *)*at) + 1;
    return same;
}

static bool take_channels(const unsigned char **at)
{
    return take_integer(at, 4) == 3 && take_text(at, "R") && take_text(at, "G") && take_text(at, "B");
}

static void take_update(receiver *r, const unsigned char *at, const unsigned char *end)
{
    int64_t offsets[3], strides[3];
    if (!take_channels(&at)) r->wrong = true;
    const int64_t x0 = take_integer(&at, 4), y0 = take_integer(&at, 4), width = take_integer(&at, 4), height = take_integer(&at, 4);
    for (int c = 0; c < 3; c++) offsets[c] = take_integer(&at, 8);
    for (int c = 0; c < 3; c++) strides[c] = take_integer(&at, 8);
    if (x0 < 0 || y0 < 0 || x0 + width > WIDTH || y0 + height > HEIGHT || end - at != (ptrdiff_t)(3 * width * height * 4)) {
        r->wrong = true;
        return;
    }
    for (int c = 0; c < 3; c++)
        for (int64_t i = 0; i < width * height; i++)
            memcpy(&r->image[c][(y0 + i / width) * WIDTH + x0 + i % width], at + 4 * (offsets[c] + strides[c] * i), 4);
    r->updates++;
}

static void take_packet(receiver *r, const unsigned char *at, size_t size)
{
    const unsigned char *end = at + size;
    const unsigned kind = at[4];
    at += 6;
    if (!take_text(&at, "a <test>")) r->wrong = true;
    if (kind == 6) {
        take_update(r, at, end);
    } else if (kind == 4) {
        if (take_integer(&at, 4) != WIDTH || take_integer(&at, 4) != HEIGHT || !take_channels(&at) || at != end || r->updates > 0)
            r->wrong = true;
        r->creates++;
    } else {
        r->wrong = true;
    }
}

/* Until the sender hangs up. */
static void *receive(void *user)
{
    receiver *r = user;
    static unsigned char packet[1 << 16];
    const int from = accept(r->listener, NULL, NULL);
    while (read_bytes(from, packet, 4)) {
        const unsigned char *at = packet;
        const int64_t size = take_integer(&at, 4);
        if (size < 8 || size > (int64_t)sizeof packet || !read_bytes(from, packet + 4, (size_t)size - 4)) {
            r->wrong = true;
            break;
        }
        take_packet(r, packet, (size_t)size);
    }
    close(from);
    return NULL;
}

static void test_tev(void **state)
{
    (void)state;
    receiver r = open_receiver();
    char place[64];
    pthread_t thread;
    snprintf(place, sizeof place, "localhost:%d", r.port);
    assert_int_equal(pthread_create(&thread, NULL, receive, &r), 0);
    open_fake(false, place);
    const double start = ca_clock_seconds();
    while (ca_clock_seconds() - start < 1.2) assert_true(one_pass());
    const ca_render_statistics statistics = {.iterations = 77};
    ca_live_finish(fake.live, picture_of(77), &statistics);
    assert_true(ca_clock_seconds() - start < 4.0);
    close_fake();
    pthread_join(thread, NULL);
    close(r.listener);
    print_message("tev got %d pictures in 1.2 s\n", r.updates);
    assert_false(r.wrong);
    assert_int_equal(r.creates, 1);
    assert_in_range(r.updates, 3, 7);
    for (int i = 0; i < PIXELS; i++) {
        assert_true(r.image[0][i] == 77.0f);
        assert_true(r.image[1][i] == (float)(i % WIDTH));
        assert_true(r.image[2][i] == (float)(i / WIDTH));
    }
}

/* One that accepts, and then is gone or never reads: the render goes on, and its end does not wait for long. */
static void test_tev_that_dies(void **state)
{
    (void)state;
    receiver r = open_receiver();
    char place[64];
    snprintf(place, sizeof place, "127.0.0.1:%d", r.port);
    open_fake(false, place);
    const int from = accept(r.listener, NULL, NULL);
    for (int i = 0; i < 20; i++) assert_true(one_pass());
    close(from);
    close(r.listener);
    const double start = ca_clock_seconds();
    while (ca_clock_seconds() - start < 0.6) assert_true(one_pass());
    const ca_render_statistics statistics = {.iterations = 77};
    ca_live_finish(fake.live, picture_of(77), &statistics);
    assert_true(ca_clock_seconds() - start < 3.0);
    close_fake();
}

/* ---- Beginning ------------------------------------------------------------------------------------------------------------- */

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
    char place[64];
    receiver r = open_receiver();
    ca_live_settings settings = {.title = "", .save = save, .is_interrupted = is_interrupted, .serves = true};
    settings.port = (uint32_t)r.port;
    assert_refused(&settings, CA_ERROR_FILE, "cannot listen on 127.0.0.1");
    settings.port = 0;
    settings.address = "localhost";
    assert_refused(&settings, CA_ERROR_ARGUMENT, "\"localhost\" is not an address in numbers");
    close(r.listener);
    settings.serves = false;
    snprintf(place, sizeof place, "127.0.0.1:%d", r.port);
    settings.tev = place;
    assert_refused(&settings, CA_ERROR_FILE, "tev at 127.0.0.1");
    static const char *const places[] = {"localhost", ":14158", "localhost:", "localhost:0", "localhost:65536", "localhost:1x"};
    for (size_t i = 0; i < sizeof places / sizeof places[0]; i++) {
        settings.tev = places[i];
        assert_refused(&settings, CA_ERROR_ARGUMENT, "is not HOST:PORT");
    }
}

/* Each allocation fails once: a message, and nothing is left. */
static void test_no_memory(void **state)
{
    (void)state;
    const ca_live_settings settings = {.title = "", .save = save, .is_interrupted = is_interrupted, .serves = true};
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
        cmocka_unit_test(test_access),          cmocka_unit_test(test_tokens_differ),
        cmocka_unit_test(test_budget),          cmocka_unit_test(test_statuses),
        cmocka_unit_test(test_three_pictures),  cmocka_unit_test(test_pause_save_stop),
        cmocka_unit_test(test_signal_ends_a_pause), cmocka_unit_test(test_last_picture),
        cmocka_unit_test(test_hanging_clients), cmocka_unit_test(test_dying_clients),
        cmocka_unit_test(test_cost),            cmocka_unit_test(test_tev),
        cmocka_unit_test(test_tev_that_dies),   cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_no_memory),
    };
    return cmocka_run_group_tests_name("live view", tests, NULL, NULL);
}
