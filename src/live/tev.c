#define _DEFAULT_SOURCE
#include "live/tev.h"

#include "base/clock.h"
#include "base/text.h"
#include "live/lookup.h"

#include <errno.h>
#include <netdb.h>
#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

enum { CREATE_IMAGE = 4, UPDATE_IMAGE = 6, CHANNELS = 3, HEADER_BYTES = 6, BAND_BYTES = 1 << 20 };
static const char *const channel_names[CHANNELS] = {"R", "G", "B"};

/* For an answer, in seconds. */
static const double patience = 2.0;

struct ca_tev {
    int socket; /* -1: gone */
    const char *name;
    bool created; /* does the viewer know the image? */
    uint32_t width, height;
    unsigned char *bytes; /* owned; packets to send */
    size_t size, sent, capacity;
};

/* ---- Connecting ------------------------------------------------------------------------------------------------ */

static ca_status split_place(const char *place, char host[256], const char **port, ca_error *error)
{
    const char *colon = strrchr(place, ':');
    const size_t length = colon ? (size_t)(colon - place) : 0;
    uint64_t number;
    if (length == 0 || length >= 256 || !ca_parse_digits(colon + 1, strlen(colon + 1), 65535, &number) || number == 0)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "\"%.300s\" is not HOST:PORT, such as localhost:14158", place);
    const bool bracketed = place[0] == '[' && length > 2 && place[length - 1] == ']';
    const size_t host_length = bracketed ? length - 2 : length;
    memcpy(host, place + bracketed, host_length);
    host[host_length] = '\0';
    *port = colon + 1;
    return CA_OK;
}

/* Waits for the answer; 0, or an error number. */
static int wait_for_answer(int descriptor, double end)
{
    for (;;) {
        struct pollfd place = {.fd = descriptor, .events = POLLOUT};
        const double left = end - ca_clock_seconds();
        const int ready = left > 0.0 ? poll(&place, 1, (int)(1000.0 * left) + 1) : 0;
        if (ready == 0) return ETIMEDOUT;
        if (ready < 0 && errno == EINTR) continue;
        if (ready < 0) return errno;
        int problem = 0;
        socklen_t size = sizeof problem;
        return getsockopt(descriptor, SOL_SOCKET, SO_ERROR, &problem, &size) == 0 ? problem : errno;
    }
}

/* To the first that answers, until the clock says `end`; errno tells why none did. */
static int connect_to(const struct addrinfo *places, double end)
{
    errno = ETIMEDOUT;
    for (const struct addrinfo *p = places; p; p = p->ai_next) {
        const int descriptor = socket(p->ai_family, p->ai_socktype | SOCK_CLOEXEC | SOCK_NONBLOCK, p->ai_protocol);
        if (descriptor < 0) continue;
        int problem = connect(descriptor, p->ai_addr, p->ai_addrlen) == 0 ? 0 : errno;
        if (problem == EINPROGRESS || problem == EINTR) problem = wait_for_answer(descriptor, end);
        if (problem == 0) return descriptor;
        close(descriptor);
        errno = problem;
    }
    return -1;
}

ca_status ca_tev_create(ca_tev **tev, const char *place, const char *name, ca_error *error)
{
    char host[256];
    const char *port = NULL;
    struct addrinfo *places = NULL;
    const double end = ca_clock_seconds() + patience;
    *tev = NULL;
    CA_TRY(split_place(place, host, &port, error));
    ca_error reason;
    const ca_status found = ca_lookup(host, port, end, &places, &reason);
    if (found != CA_OK) return ca_fail(error, found, NULL, "tev at %.300s: %.600s", place, reason.message);
    const int descriptor = connect_to(places, end);
    const int why = errno;
    freeaddrinfo(places);
    if (descriptor < 0) return ca_fail(error, CA_ERROR_FILE, NULL, "tev at %.300s: %s", place, strerror(why));
    *tev = ca_alloc_zeroed(1, sizeof **tev);
    if (!*tev) {
        close(descriptor);
        return ca_fail_memory(error, "the pictures for tev");
    }
    (*tev)->socket = descriptor;
    (*tev)->name = name;
    return CA_OK;
}

static void hang_up(ca_tev *tev)
{
    if (tev->socket >= 0) close(tev->socket);
    tev->socket = -1;
    tev->size = tev->sent = 0;
}

void ca_tev_destroy(ca_tev *tev)
{
    if (!tev) return;
    hang_up(tev);
    ca_free(tev->bytes);
    ca_free(tev);
}

/* ---- Packets --------------------------------------------------------------------------------------------------- */

static void put_bytes(ca_tev *tev, const void *bytes, size_t count)
{
    memcpy(tev->bytes + tev->size, bytes, count);
    tev->size += count;
}

static void put_integer(ca_tev *tev, uint64_t value, size_t bytes)
{
    for (size_t i = 0; i < bytes; i++) tev->bytes[tev->size++] = (unsigned char)(value >> (8 * i));
}

/* Its length is written at its end. */
static size_t begin_packet(ca_tev *tev, unsigned kind)
{
    const size_t start = tev->size;
    put_integer(tev, 0, 4);
    put_integer(tev, kind, 1);
    put_integer(tev, kind == CREATE_IMAGE, 1);
    put_bytes(tev, tev->name, strlen(tev->name) + 1);
    return start;
}

static void end_packet(ca_tev *tev, size_t start)
{
    const size_t end = tev->size;
    tev->size = start;
    put_integer(tev, end - start, 4);
    tev->size = end;
}

static void put_channel_names(ca_tev *tev)
{
    for (int c = 0; c < CHANNELS; c++) put_bytes(tev, channel_names[c], strlen(channel_names[c]) + 1);
}

static void put_create(ca_tev *tev)
{
    const size_t start = begin_packet(tev, CREATE_IMAGE);
    put_integer(tev, tev->width, 4);
    put_integer(tev, tev->height, 4);
    put_integer(tev, CHANNELS, 4);
    put_channel_names(tev);
    end_packet(tev, start);
}

/* Rows [y0, y1), channel after channel. */
static void put_update(ca_tev *tev, const float *const planes[CHANNELS], uint32_t y0, uint32_t y1)
{
    const size_t start = begin_packet(tev, UPDATE_IMAGE), count = (size_t)tev->width * (y1 - y0);
    put_integer(tev, CHANNELS, 4);
    put_channel_names(tev);
    put_integer(tev, 0, 4);
    put_integer(tev, y0, 4);
    put_integer(tev, tev->width, 4);
    put_integer(tev, y1 - y0, 4);
    for (size_t c = 0; c < CHANNELS; c++) put_integer(tev, c * count, 8);
    for (size_t c = 0; c < CHANNELS; c++) put_integer(tev, 1, 8);
    /* Floats lie in memory as they are sent: the project's processors are little endian. */
    for (int c = 0; c < CHANNELS; c++) put_bytes(tev, planes[c] + (size_t)tev->width * y0, count * sizeof(float));
    end_packet(tev, start);
}

/* In packets of about a MiB. */
static uint32_t rows_of_a_band(const ca_tev *tev)
{
    const size_t rows = BAND_BYTES / (CHANNELS * sizeof(float) * tev->width);
    return rows < 1 ? 1 : rows < tev->height ? (uint32_t)rows : tev->height;
}

static bool make_room(ca_tev *tev)
{
    const size_t bands = (tev->height + rows_of_a_band(tev) - 1) / rows_of_a_band(tev);
    const size_t around = HEADER_BYTES + strlen(tev->name) + 1 + 100; /* the numbers and names before the values */
    unsigned char *bytes = ca_array_grow(
        tev->bytes, &tev->capacity, CHANNELS * sizeof(float) * tev->width * tev->height + (bands + 1) * around, 1);
    if (bytes) tev->bytes = bytes;
    return bytes != NULL;
}

void ca_tev_show(ca_tev *tev, const ca_live_snapshot *picture)
{
    const ca_image_layers *image = picture->image;
    const float *planes[CHANNELS];
    for (int c = 0; c < CHANNELS; c++) planes[c] = ca_layers_find(image, channel_names[c]);
    tev->width = image->width;
    tev->height = image->height;
    tev->size = tev->sent = 0;
    if (!make_room(tev)) return; /* the next picture may find some */
    if (!tev->created) put_create(tev);
    tev->created = true;
    const uint32_t rows = rows_of_a_band(tev);
    for (uint32_t y = 0; y < tev->height; y += rows)
        put_update(tev, planes, y, tev->height - y < rows ? tev->height : y + rows);
}

/* ---- Sending --------------------------------------------------------------------------------------------------- */

bool ca_tev_has_more(const ca_tev *tev) { return tev->sent < tev->size; }
bool ca_tev_is_ready(const ca_tev *tev) { return tev->socket >= 0 && !ca_tev_has_more(tev); }
int ca_tev_descriptor(const ca_tev *tev) { return tev->socket; }

void ca_tev_run(ca_tev *tev)
{
    while (tev->socket >= 0 && ca_tev_has_more(tev)) {
        const ssize_t count = send(tev->socket, tev->bytes + tev->sent, tev->size - tev->sent, MSG_NOSIGNAL);
        if (count >= 0) {
            tev->sent += (size_t)count;
        } else if (errno != EINTR) {
            if (errno != EAGAIN && errno != EWOULDBLOCK) hang_up(tev);
            return;
        }
    }
}
