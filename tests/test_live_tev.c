/* What the viewer tev gets: packets as its own reader takes them apart (Tom94/tev, src/Ipc.cpp:
 * interpretAsCreateImage, interpretAsUpdateImage), which make the picture pixel by pixel; and a viewer that hangs or
 * dies. */
#define _GNU_SOURCE
#include "base/clock.h"
#include "base/memory.h"
#include "support/live_fixture.h"

#include <arpa/inet.h>
#include <dlfcn.h>
#include <netdb.h>
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

/* ---- A viewer -------------------------------------------------------------------------------------------------- */

enum { CHANNELS = 3, LONGEST_PACKET = 1 << 21 };

/* A small receiver of tev's packets, and the image that it was told to show. It asserts nothing: it has a thread of
 * its own. */
typedef struct receiver {
    int listener, port;
    int64_t width, height; /* that it is to be */
    int creates, updates;  /* packets */
    int64_t pixels;        /* that all updates together set */
    const char *wrong;     /* what was not as the protocol has it; NULL: nothing */
    bool leaves;           /* of one that reads nothing: it is to go now */
    float *image[CHANNELS];
} receiver;

static receiver open_receiver(int64_t width, int64_t height)
{
    struct sockaddr_in place = {.sin_family = AF_INET, .sin_addr = {htonl(INADDR_LOOPBACK)}};
    socklen_t size = sizeof place;
    receiver r = {.listener = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0), .width = width, .height = height};
    assert_int_equal(bind(r.listener, (const struct sockaddr *)&place, size), 0);
    assert_int_equal(listen(r.listener, 4), 0);
    assert_int_equal(getsockname(r.listener, (struct sockaddr *)&place, &size), 0);
    r.port = ntohs(place.sin_port);
    for (int c = 0; c < CHANNELS; c++) assert_non_null(r.image[c] = calloc((size_t)(width * height), sizeof(float)));
    return r;
}

static void close_receiver(receiver *r)
{
    close(r->listener);
    for (int c = 0; c < CHANNELS; c++) free(r->image[c]);
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

/* What is left of a packet. Beyond its end everything is zero, and said to be wrong. */
typedef struct packet {
    receiver *r;
    const unsigned char *at, *end;
} packet;

static bool has(packet *p, ptrdiff_t bytes)
{
    if (p->end - p->at >= bytes) return true;
    p->r->wrong = "a packet is too short";
    p->at = p->end;
    return false;
}

static int64_t take_integer(packet *p, int bytes)
{
    uint64_t value = 0;
    if (!has(p, bytes)) return 0;
    for (int i = 0; i < bytes; i++) value |= (uint64_t)p->at[i] << (8 * i);
    p->at += bytes;
    return bytes == 4 ? (int64_t)(int32_t)value : (int64_t)value;
}

static void take_text(packet *p, const char *expected)
{
    if (!has(p, (ptrdiff_t)strlen(expected) + 1)) return;
    if (memcmp(p->at, expected, strlen(expected) + 1) != 0) p->r->wrong = "a name";
    p->at += strlen(expected) + 1;
}

static void take_channels(packet *p)
{
    if (take_integer(p, 4) != CHANNELS) p->r->wrong = "the number of channels";
    take_text(p, "R");
    take_text(p, "G");
    take_text(p, "B");
}

static void take_create(packet *p)
{
    receiver *r = p->r;
    if (take_integer(p, 4) != r->width || take_integer(p, 4) != r->height) r->wrong = "the size of the image";
    take_channels(p);
    if (p->at != p->end) r->wrong = "a packet that creates is too long";
    if (r->updates > 0) r->wrong = "an image is created after it was updated";
    r->creates++;
}

/* The value of pixel i of channel c is number offset[c] + i stride[c]. */
static void take_update(packet *p)
{
    receiver *r = p->r;
    int64_t offsets[CHANNELS], strides[CHANNELS], values = 0;
    take_channels(p);
    const int64_t x0 = take_integer(p, 4), y0 = take_integer(p, 4), width = take_integer(p, 4),
                  height = take_integer(p, 4);
    for (int c = 0; c < CHANNELS; c++) offsets[c] = take_integer(p, 8);
    for (int c = 0; c < CHANNELS; c++) strides[c] = take_integer(p, 8);
    if (x0 < 0 || y0 < 0 || width < 1 || height < 1 || x0 + width > r->width || y0 + height > r->height) {
        r->wrong = "an update lies outside the image";
        return;
    }
    for (int c = 0; c < CHANNELS; c++) {
        const int64_t last = offsets[c] + (width * height - 1) * strides[c];
        if (offsets[c] < 0 || strides[c] < 1) r->wrong = "an offset or a stride";
        if (last + 1 > values) values = last + 1;
    }
    if (p->end - p->at != (ptrdiff_t)(4 * values))
        r->wrong = "the number of values is not that of offsets and strides";
    if (r->wrong) return;
    for (int c = 0; c < CHANNELS; c++)
        for (int64_t i = 0; i < width * height; i++)
            memcpy(&r->image[c][(y0 + i / width) * r->width + x0 + i % width],
                   p->at + 4 * (offsets[c] + strides[c] * i), 4);
    r->pixels += width * height;
    r->updates++;
}

static void take_packet(receiver *r, const unsigned char *bytes, size_t size)
{
    packet p = {.r = r, .at = bytes + 6, .end = bytes + size};
    const unsigned kind = bytes[4], to_the_front = bytes[5];
    take_text(&p, CA_LIVE_TITLE);
    if (to_the_front != (kind == 4)) r->wrong = "the image comes to the front when it is made, and only then";
    if (kind == 4)
        take_create(&p);
    else if (kind == 6)
        take_update(&p);
    else
        r->wrong = "a kind of packet";
}

/* Until the sender hangs up. */
static void *receive(void *user)
{
    receiver *r = user;
    unsigned char *bytes = malloc(LONGEST_PACKET);
    const int from = accept(r->listener, NULL, NULL);
    while (bytes && !r->wrong && read_bytes(from, bytes, 4)) {
        packet p = {.r = r, .at = bytes, .end = bytes + 4};
        const int64_t size = take_integer(&p, 4);
        if (size < 8 || size > LONGEST_PACKET || !read_bytes(from, bytes + 4, (size_t)size - 4))
            r->wrong = "the length of a packet";
        else
            take_packet(r, bytes, (size_t)size);
    }
    close(from);
    free(bytes);
    return NULL;
}

/* ---- Pictures -------------------------------------------------------------------------------------------------- */

/* Renders for a while; the last picture tells 77. */
static void render_for_tev(receiver *r, const char *host, double seconds)
{
    char place[64];
    pthread_t thread;
    snprintf(place, sizeof place, "%s:%d", host, r->port);
    assert_int_equal(pthread_create(&thread, NULL, receive, r), 0);
    ca_live_fake_open(false, place);
    fake.width = (uint32_t)r->width;
    fake.height = (uint32_t)r->height;
    const double start = ca_clock_seconds();
    while (ca_clock_seconds() - start < seconds) assert_true(ca_live_fake_pass());
    const ca_render_statistics statistics = {.iterations = 77};
    ca_live_finish(fake.live, ca_live_fake_picture(77), &statistics);
    assert_true(ca_clock_seconds() - start < seconds + 3.0);
    ca_live_fake_close();
    pthread_join(thread, NULL);
    print_message("tev got %.2f pictures of %ux%u in %d packets in %g s\n",
                  (double)r->pixels / (double)(r->width * r->height), fake.width, fake.height, r->updates, seconds);
    if (r->wrong) fail_msg("not as tev has it: %s", r->wrong);
}

static void assert_last_picture(const receiver *r)
{
    for (int64_t i = 0; i < r->width * r->height; i++) {
        assert_true(r->image[0][i] == 77.0f);
        assert_true(r->image[1][i] == (float)(i % r->width));
        assert_true(r->image[2][i] == (float)(i / r->width));
    }
}

/* Small pictures are one packet each. */
/* A bare root folder may know no names at all. */
static const char *this_machine(void)
{
    struct addrinfo *found;
    if (getaddrinfo("localhost", NULL, NULL, &found) != 0) {
        print_message("    this machine does not know the name localhost: by its number\n");
        return "127.0.0.1";
    }
    freeaddrinfo(found);
    return "localhost";
}

static void test_small(void **state)
{
    (void)state;
    receiver r = open_receiver(CA_LIVE_WIDTH, CA_LIVE_HEIGHT);
    render_for_tev(&r, this_machine(), 1.2);
    assert_int_equal(r.creates, 1);
    assert_in_range(r.updates, 3, 7);
    assert_int_equal(r.pixels, r.updates * CA_LIVE_PIXELS);
    assert_last_picture(&r);
    close_receiver(&r);
}

/* 12 MiB, more than a socket takes at once, in bands, the last of which is lower than the others. */
static void test_large(void **state)
{
    (void)state;
    static const int64_t sizes[][2] = {{1024, 1024}, {1021, 700}, {3, 100000}, {100000, 2}};
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        receiver r = open_receiver(sizes[i][0], sizes[i][1]);
        render_for_tev(&r, "127.0.0.1", 0.1);
        assert_int_equal(r.creates, 1);
        assert_true(r.updates > 1);
        assert_int_equal(r.pixels % (r.width * r.height), 0);
        assert_last_picture(&r);
        close_receiver(&r);
    }
}

/* ---- Trouble --------------------------------------------------------------------------------------------------- */

enum { NAME_SECONDS = 6 };

/* In the C library's place: of one name nobody knows anything, which takes its time. */
int getaddrinfo(const char *host, const char *port, const struct addrinfo *hints, struct addrinfo **places)
{
    typedef int function(const char *, const char *, const struct addrinfo *, struct addrinfo **);
    function *real;
    const struct timespec pause = {.tv_sec = NAME_SECONDS};
    void *symbol = dlsym(RTLD_NEXT, "getaddrinfo");
    memcpy(&real, &symbol, sizeof real);
    if (!host || strcmp(host, "slow.example") != 0) return real(host, port, hints, places);
    nanosleep(&pause, NULL);
    return EAI_AGAIN;
}

/* One that accepts, and then is gone: the render goes on, and its end does not wait. */
static void test_dies(void **state)
{
    (void)state;
    receiver r = open_receiver(CA_LIVE_WIDTH, CA_LIVE_HEIGHT);
    char place[64];
    snprintf(place, sizeof place, "127.0.0.1:%d", r.port);
    ca_live_fake_open(false, place);
    const int from = accept(r.listener, NULL, NULL);
    for (int i = 0; i < 20; i++) assert_true(ca_live_fake_pass());
    close(from);
    const double start = ca_clock_seconds();
    while (ca_clock_seconds() - start < 0.6) assert_true(ca_live_fake_pass());
    const ca_render_statistics statistics = {.iterations = 77};
    ca_live_finish(fake.live, ca_live_fake_picture(77), &statistics);
    assert_true(ca_clock_seconds() - start < 3.0);
    ca_live_fake_close();
    close_receiver(&r);
}

enum { PATIENCE = 20 };

/* Accepts, reads nothing, and is gone after PATIENCE seconds, so that who waits for it fails and does not hang. */
static void *hang(void *user)
{
    const receiver *r = user;
    const int from = accept(r->listener, NULL, NULL);
    for (int i = 0; i < 10 * PATIENCE && !__atomic_load_n(&r->leaves, __ATOMIC_RELAXED); i++)
        nanosleep(&(const struct timespec){.tv_nsec = 100000000}, NULL);
    close(from);
    return NULL;
}

/* One that never reads a picture that is more than the buffers between take: the end waits for the farewell only. */
static void test_hangs(void **state)
{
    (void)state;
    receiver r = open_receiver(1024, 1024);
    char place[64];
    pthread_t thread;
    snprintf(place, sizeof place, "127.0.0.1:%d", r.port);
    assert_int_equal(pthread_create(&thread, NULL, hang, &r), 0);
    ca_live_fake_open(false, place);
    fake.width = fake.height = 1024;
    const double start = ca_clock_seconds();
    while (ca_clock_seconds() - start < 0.2) assert_true(ca_live_fake_pass());
    const ca_render_statistics statistics = {.iterations = 77};
    ca_live_finish(fake.live, ca_live_fake_picture(77), &statistics);
    ca_live_fake_close();
    const double took = ca_clock_seconds() - start;
    __atomic_store_n(&r.leaves, true, __ATOMIC_RELAXED);
    pthread_join(thread, NULL);
    assert_true(took < 0.7 * PATIENCE);
    close_receiver(&r);
}

static void assert_refused(const char *tev, ca_status expected, const char *words)
{
    const ca_live_settings settings = {
        .title = "", .save = ca_live_fake_save, .is_interrupted = ca_live_fake_interrupted, .tev = tev};
    ca_error error = {""};
    ca_live *live;
    assert_int_equal(ca_live_create(&live, &settings, &error), expected);
    assert_null(live);
    assert_says(error.message, words);
}

static void test_name_that_nobody_tells(void **state)
{
    (void)state;
    const double start = ca_clock_seconds();
    assert_refused("slow.example:1", CA_ERROR_FILE, "tev at slow.example:1: nobody says where slow.example is");
    const double took = ca_clock_seconds() - start;
    if (took > 0.6 * NAME_SECONDS) fail_msg("it took %g s", took);
}

static void test_refusals(void **state)
{
    (void)state;
    char place[64];
    receiver r = open_receiver(1, 1);
    snprintf(place, sizeof place, "127.0.0.1:%d", r.port);
    close_receiver(&r);
    assert_refused(place, CA_ERROR_FILE, "tev at 127.0.0.1");
    static const char *const places[] = {
        "localhost", ":14158", "localhost:", "localhost:0", "localhost:65536", "localhost:1x"};
    for (size_t i = 0; i < sizeof places / sizeof places[0]; i++)
        assert_refused(places[i], CA_ERROR_ARGUMENT, "is not HOST:PORT");
}

/* Each allocation fails once: a message, and nothing is left. */
static void test_no_memory(void **state)
{
    (void)state;
    receiver r = open_receiver(1, 1);
    char place[64];
    snprintf(place, sizeof place, "127.0.0.1:%d", r.port);
    const ca_live_settings settings = {
        .title = "", .save = ca_live_fake_save, .is_interrupted = ca_live_fake_interrupted, .tev = place};
    for (long allowed = 0;; allowed++) {
        ca_live *live;
        ca_error error = {""};
        assert_true(allowed < 4); /* who listens waits for no more */
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
    close_receiver(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_small), cmocka_unit_test(test_large),    cmocka_unit_test(test_dies),
        cmocka_unit_test(test_hangs), cmocka_unit_test(test_refusals), cmocka_unit_test(test_no_memory),
        cmocka_unit_test(test_name_that_nobody_tells),
    };
    return cmocka_run_group_tests_name("live view: tev", tests, NULL, NULL);
}
