#define _DEFAULT_SOURCE
#include "live/server.h"

#include "base/clock.h"
#include "base/text.h"
#include "live/clients.h"
#include "report/page_files.h"
#include "report/page_text.h"

#include <errno.h>
#include <netdb.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>

#include <microhttpd.h>

enum {
    MOST_CONNECTIONS = 256,
    IDLE_SECONDS = 20,
    HEARTBEAT_SECONDS = 5, /* a client that is gone is noticed at the next word to it */
    MOST_PICTURES = 8,     /* on their way at once: each may hold a picture of its own */
    PLANES_BLOCK = 1 << 18,
    ANSWER_SIZE = 1 << 16
};

/* One client that listens for news. Suspended while there are none. */
typedef struct event_stream {
    struct ca_live_server *server;
    struct MHD_Connection *connection;
    struct event_stream *next;
    uint64_t news;        /* number of the last news it was sent */
    double last_told;     /* when */
    size_t length, sent;  /* of text */
    bool suspended;
    char text[CA_LIVE_EVENT_SIZE + 16];
} event_stream;

struct ca_live_server {
    struct MHD_Daemon *daemon;
    ca_live_access access;
    ca_live_state *state;
    const char *title;
    ca_live_clients clients;
    event_stream *streams;
    uint32_t pictures; /* on their way */
    bool closes;
};

/* ---- Answers --------------------------------------------------------------------------------------------------- */

static enum MHD_Result answer(struct MHD_Connection *connection, unsigned status, struct MHD_Response *response,
                              const char *type)
{
    if (!response) return MHD_NO;
    MHD_add_response_header(response, "Content-Type", type);
    MHD_add_response_header(response, "Cache-Control", "no-store");
    MHD_add_response_header(response, "X-Content-Type-Options", "nosniff");
    MHD_add_response_header(response, "Referrer-Policy", "no-referrer");
    MHD_add_response_header(response, "Cross-Origin-Resource-Policy", "same-origin");
    MHD_add_response_header(response, "Content-Security-Policy",
                            "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src "
                            "data:; base-uri 'none'; "
                            "form-action 'none'; frame-ancestors 'none'");
    const enum MHD_Result result = MHD_queue_response(connection, status, response);
    MHD_destroy_response(response);
    return result;
}

/* libmicrohttpd's buffers are not const, but of those that it does not free it only reads. */
static struct MHD_Response *new_response(const void *bytes, size_t size, enum MHD_ResponseMemoryMode mode)
{
    return MHD_create_response_from_buffer(size, (void *)(uintptr_t)bytes, mode);
}

static enum MHD_Result answer_text(struct MHD_Connection *connection, unsigned status, const char *text)
{
    return answer(connection, status, new_response(text, strlen(text), MHD_RESPMEM_MUST_COPY),
                  "text/plain; charset=utf-8");
}

static enum MHD_Result refuse(struct MHD_Connection *connection, int status)
{
    const char *const text = status == 400   ? "not a request that this server knows\n"
                             : status == 403 ? "the address is not the one that caustica printed\n"
                             : status == 405 ? "not by this method\n"
                                             : "there is no such thing here\n";
    return answer_text(connection, (unsigned)status, text);
}

static enum MHD_Result answer_file(struct MHD_Connection *connection, const char *name, const char *type)
{
    const ca_page_file *file = ca_page_file_named(name);
    return answer(connection, MHD_HTTP_OK, new_response(file->data, file->size, MHD_RESPMEM_PERSISTENT), type);
}

/* What `write` puts into a buffer. */
static enum MHD_Result answer_written(ca_live_server *server, struct MHD_Connection *connection, const char *type,
                                      void (*write)(FILE *stream, ca_live_server *server,
                                                    const ca_live_snapshot *picture, size_t pixel),
                                      const ca_live_snapshot *picture, size_t pixel)
{
    enum MHD_Result result = MHD_NO;
    char *text = ca_alloc(ANSWER_SIZE, 1);
    FILE *stream = text ? fmemopen(text, ANSWER_SIZE, "w") : NULL;
    if (stream) {
        write(stream, server, picture, pixel);
        const bool whole = fflush(stream) == 0 && !ferror(stream);
        const long length = ftell(stream);
        fclose(stream);
        result = whole && length >= 0
                     ? answer(connection, MHD_HTTP_OK,
                              MHD_create_response_from_buffer((size_t)length, text, MHD_RESPMEM_MUST_COPY), type)
                     : answer_text(connection, MHD_HTTP_INTERNAL_SERVER_ERROR, "the answer is too long\n");
    }
    ca_free(text);
    return result;
}

static void write_page(FILE *stream, ca_live_server *server, const ca_live_snapshot *picture, size_t pixel)
{
    (void)picture;
    (void)pixel;
    const ca_page_file *body = ca_page_file_named("live.html");
    fputs("<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>", stream);
    ca_page_put_html(stream, server->title);
    fputs("</title>\n<link rel=\"stylesheet\" href=\"style.css\">\n<link rel=\"icon\" "
          "href=\"data:,\">\n</head>\n<body>\n",
          stream);
    fwrite(body->data, 1, body->size, stream);
    fputs("<script src=\"viewer.js\"></script>\n<script src=\"live.js\"></script>\n</body>\n</html>\n", stream);
}

static void write_layers(FILE *stream, ca_live_server *server, const ca_live_snapshot *picture, size_t pixel)
{
    (void)server;
    (void)pixel;
    fprintf(stream, "{\"version\":%u,\"names\":[", picture->version);
    for (size_t i = 0; i < picture->image->channel_count; i++) {
        if (i) fputc(',', stream);
        ca_page_put_json(stream, picture->image->channels[i].name);
    }
    fputs("]}", stream);
}

static void write_pixel(FILE *stream, ca_live_server *server, const ca_live_snapshot *picture, size_t pixel)
{
    (void)server;
    fprintf(stream, "{\"version\":%u,\"values\":{", picture->version);
    for (size_t i = 0; i < picture->image->channel_count; i++) {
        const ca_channel *channel = &picture->image->channels[i];
        if (i) fputc(',', stream);
        ca_page_put_json(stream, channel->name);
        fputc(':', stream);
        ca_page_put_number(stream, (double)channel->data[pixel]);
    }
    fputs("}}", stream);
}

/* ---- Pictures -------------------------------------------------------------------------------------------------- */

/* A watcher more or less: the end of a render waits for them. */
static void count_watcher(ca_live_server *server, int change)
{
    ca_live_state *state = server->state;
    pthread_mutex_lock(&state->lock);
    state->watchers = (uint32_t)((int64_t)state->watchers + change);
    pthread_cond_broadcast(&state->asked);
    pthread_mutex_unlock(&state->lock);
}

static void want_picture(ca_live_server *server)
{
    ca_live_state *state = server->state;
    pthread_mutex_lock(&state->lock);
    state->wants_picture = true;
    pthread_cond_broadcast(&state->asked);
    pthread_mutex_unlock(&state->lock);
}

typedef struct picture_answer {
    ca_live_server *server;
    ca_live_planes planes;
} picture_answer;

static ssize_t read_planes(void *user, uint64_t position, char *buffer, size_t size)
{
    const picture_answer *a = user;
    const size_t count = ca_live_planes_read(&a->planes, (size_t)position, buffer, size);
    return count > 0 ? (ssize_t)count : MHD_CONTENT_READER_END_OF_STREAM;
}

static void close_planes(void *user)
{
    picture_answer *a = user;
    ca_live_planes_close(&a->planes);
    a->server->pictures--;
    count_watcher(a->server, -1);
    ca_free(a);
}

static enum MHD_Result answer_planes(ca_live_server *server, struct MHD_Connection *connection,
                                     ca_live_snapshot *picture)
{
    char version[16];
    const char *names = MHD_lookup_connection_value(connection, MHD_GET_ARGUMENT_KIND, "names");
    if (server->pictures >= MOST_PICTURES)
        return answer_text(connection, MHD_HTTP_SERVICE_UNAVAILABLE, "too many at once\n");
    picture_answer *a = ca_alloc_zeroed(1, sizeof *a);
    if (!a || !names || !ca_live_planes_open(&a->planes, picture, names)) {
        ca_free(a);
        return answer_text(connection, MHD_HTTP_NOT_FOUND, "the picture has no such channels\n");
    }
    a->server = server;
    server->pictures++;
    count_watcher(server, 1);
    /* A client that takes a picture waits for the next one. */
    want_picture(server);
    struct MHD_Response *response = MHD_create_response_from_callback(ca_live_planes_bytes(&a->planes), PLANES_BLOCK,
                                                                      read_planes, a, close_planes);
    if (!response) {
        close_planes(a);
        return MHD_NO;
    }
    snprintf(version, sizeof version, "%u", picture->version);
    MHD_add_response_header(response, "Caustica-Version", version);
    return answer(connection, MHD_HTTP_OK, response, "application/octet-stream");
}

/* The place of pixel (x, y) of the whole film in the picture; false where it does not lie in it. */
static bool find_pixel(struct MHD_Connection *connection, const ca_image_layers *image, size_t *pixel)
{
    uint64_t place[2];
    static const char *const names[2] = {"x", "y"};
    const uint32_t ends[2] = {image->width, image->height};
    for (int i = 0; i < 2; i++) {
        const char *text = MHD_lookup_connection_value(connection, MHD_GET_ARGUMENT_KIND, names[i]);
        if (!text || !ca_parse_digits(text, strlen(text), ends[i] - 1, &place[i])) return false;
    }
    *pixel = (size_t)place[1] * image->width + (size_t)place[0];
    return true;
}

static enum MHD_Result answer_picture(ca_live_server *server, struct MHD_Connection *connection,
                                      ca_live_resource resource)
{
    ca_live_snapshot *picture = ca_live_state_picture(server->state);
    size_t pixel = 0;
    enum MHD_Result result;
    if (!picture) {
        want_picture(server);
        result = answer_text(connection, MHD_HTTP_SERVICE_UNAVAILABLE, "there is no picture yet\n");
    } else if (resource == CA_LIVE_PLANES) {
        result = answer_planes(server, connection, picture);
    } else if (resource == CA_LIVE_LAYERS) {
        result = answer_written(server, connection, "application/json", write_layers, picture, 0);
    } else if (find_pixel(connection, picture->image, &pixel)) {
        result = answer_written(server, connection, "application/json", write_pixel, picture, pixel);
    } else {
        result = answer_text(connection, MHD_HTTP_NOT_FOUND, "the picture has no such pixel\n");
    }
    ca_live_snapshot_release(picture);
    return result;
}

/* ---- Events ---------------------------------------------------------------------------------------------------- */

static uint64_t newest(ca_live_state *state)
{
    pthread_mutex_lock(&state->lock);
    const uint64_t news = state->news;
    pthread_mutex_unlock(&state->lock);
    return news;
}

static bool has_something_to_tell(const event_stream *stream, uint64_t news, double now)
{
    return news != stream->news || now - stream->last_told >= HEARTBEAT_SECONDS;
}

static void compose_event(event_stream *stream, uint64_t news, double now)
{
    static const char field[] = "data: ", end[] = "\n\n", comment[] = ":\n\n";
    stream->last_told = now;
    stream->sent = 0;
    if (news == stream->news) {
        memcpy(stream->text, comment, sizeof comment);
        stream->length = sizeof comment - 1;
        return;
    }
    const size_t used = sizeof field - 1;
    memcpy(stream->text, field, used);
    const size_t length = ca_live_state_describe(stream->server->state, stream->text + used, &stream->news);
    memcpy(stream->text + used + length, end, sizeof end);
    stream->length = used + length + sizeof end - 1;
}

static ssize_t read_events(void *user, uint64_t position, char *buffer, size_t size)
{
    event_stream *stream = user;
    (void)position;
    if (stream->server->closes) return MHD_CONTENT_READER_END_OF_STREAM;
    if (stream->sent == stream->length) {
        const uint64_t news = newest(stream->server->state);
        const double now = ca_clock_seconds();
        if (!has_something_to_tell(stream, news, now)) {
            stream->suspended = true;
            MHD_suspend_connection(stream->connection);
            return 0;
        }
        compose_event(stream, news, now);
    }
    const size_t rest = stream->length - stream->sent, count = rest < size ? rest : size;
    memcpy(buffer, stream->text + stream->sent, count);
    stream->sent += count;
    return (ssize_t)count;
}

static void close_events(void *user)
{
    event_stream *stream = user;
    event_stream **link = &stream->server->streams;
    while (*link != stream) link = &(*link)->next;
    *link = stream->next;
    count_watcher(stream->server, -1);
    ca_free(stream);
}

static void resume(event_stream *stream)
{
    stream->suspended = false;
    MHD_resume_connection(stream->connection);
}

static enum MHD_Result answer_events(ca_live_server *server, struct MHD_Connection *connection)
{
    event_stream *stream = ca_alloc_zeroed(1, sizeof *stream);
    if (!stream) return MHD_NO;
    stream->server = server;
    stream->connection = connection;
    stream->next = server->streams;
    server->streams = stream;
    count_watcher(server, 1);
    want_picture(server);
    struct MHD_Response *response =
        MHD_create_response_from_callback(MHD_SIZE_UNKNOWN, CA_LIVE_EVENT_SIZE, read_events, stream, close_events);
    if (!response) {
        close_events(stream);
        return MHD_NO;
    }
    return answer(connection, MHD_HTTP_OK, response, "text/event-stream");
}

/* ---- Requests -------------------------------------------------------------------------------------------------- */

static enum MHD_Result ask(ca_live_server *server, struct MHD_Connection *connection, ca_live_resource resource)
{
    ca_live_state *state = server->state;
    pthread_mutex_lock(&state->lock);
    const bool over = state->phase == CA_LIVE_DONE;
    if (resource == CA_LIVE_PAUSE) state->wants_pause = true;
    if (resource == CA_LIVE_RESUME) state->wants_pause = false;
    if (resource == CA_LIVE_STOP) state->wants_stop = true;
    if (resource == CA_LIVE_SAVE) state->wants_save = true;
    pthread_cond_broadcast(&state->asked);
    pthread_mutex_unlock(&state->lock);
    return over ? answer_text(connection, MHD_HTTP_CONFLICT, "the render is over\n")
                : answer_text(connection, MHD_HTTP_ACCEPTED, "\n");
}

static enum MHD_Result answer_resource(ca_live_server *server, struct MHD_Connection *connection,
                                       ca_live_resource resource)
{
    switch (resource) {
    case CA_LIVE_PAGE: return answer_written(server, connection, "text/html; charset=utf-8", write_page, NULL, 0);
    case CA_LIVE_STYLE: return answer_file(connection, "style.css", "text/css; charset=utf-8");
    case CA_LIVE_VIEWER: return answer_file(connection, "viewer.js", "text/javascript; charset=utf-8");
    case CA_LIVE_SCRIPT: return answer_file(connection, "live.js", "text/javascript; charset=utf-8");
    case CA_LIVE_EVENTS: return answer_events(server, connection);
    case CA_LIVE_LAYERS:
    case CA_LIVE_PLANES:
    case CA_LIVE_PIXEL: return answer_picture(server, connection, resource);
    case CA_LIVE_PAUSE:
    case CA_LIVE_RESUME:
    case CA_LIVE_STOP:
    case CA_LIVE_SAVE: return ask(server, connection, resource);
    case CA_LIVE_RESOURCES: break;
    }
    return MHD_NO;
}

/* Called when a connection begins and when it is over. */
static void on_connection(void *user, struct MHD_Connection *connection, void **client,
                          enum MHD_ConnectionNotificationCode what)
{
    ca_live_server *server = user;
    if (what == MHD_CONNECTION_NOTIFY_STARTED) {
        const union MHD_ConnectionInfo *info = MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CONNECTION_FD);
        *client = ca_live_clients_add(&server->clients, info->connect_fd, ca_clock_seconds());
    } else {
        ca_live_clients_remove(&server->clients, *client);
        *client = NULL;
    }
}

static ca_live_visitor *client_of(struct MHD_Connection *connection)
{
    return MHD_get_connection_info(connection, MHD_CONNECTION_INFO_SOCKET_CONTEXT)->socket_context;
}

/* Called with the headers, with each piece of a body, and at its end. Requests are refused before their body is read;
 * bodies are not used. */
static enum MHD_Result on_request(void *user, struct MHD_Connection *connection, const char *path, const char *method,
                                  const char *version, const char *body, size_t *body_size, void **seen)
{
    ca_live_server *server = user;
    (void)version;
    (void)body;
    const ca_live_request request = {
        .method = method,
        .path = path,
        .host = MHD_lookup_connection_value(connection, MHD_HEADER_KIND, "Host"),
        .origin = MHD_lookup_connection_value(connection, MHD_HEADER_KIND, "Origin"),
    };
    ca_live_resource resource = CA_LIVE_RESOURCES;
    const int status = ca_live_judge(&server->access, &request, &resource);
    if (status != 200) return refuse(connection, status);
    ca_live_clients_know(&server->clients, client_of(connection));
    if (!*seen) {
        *seen = server;
        return MHD_YES;
    }
    if (*body_size > 0) {
        *body_size = 0;
        return MHD_YES;
    }
    return answer_resource(server, connection, resource);
}

/* ---- Life ------------------------------------------------------------------------------------------------------ */

static ca_status listen_on(ca_live_server *server, const struct addrinfo *place, uint16_t port, ca_error *error)
{
    const unsigned family = place->ai_family == AF_INET6 ? MHD_USE_IPv6 : 0;
    errno = 0;
    server->daemon = MHD_start_daemon(MHD_USE_EPOLL | MHD_ALLOW_SUSPEND_RESUME | family, port, NULL, NULL, on_request,
                                      server, MHD_OPTION_SOCK_ADDR, place->ai_addr, MHD_OPTION_CONNECTION_LIMIT,
                                      (unsigned)MOST_CONNECTIONS, MHD_OPTION_CONNECTION_TIMEOUT,
                                      (unsigned)IDLE_SECONDS, MHD_OPTION_NOTIFY_CONNECTION, on_connection, server,
                                      MHD_OPTION_END);
    if (!server->daemon)
        return ca_fail(error, CA_ERROR_FILE, NULL, "the live view cannot listen on %s, port %u: %s",
                       server->access.address, port, errno ? strerror(errno) : "the system refuses");
    const union MHD_DaemonInfo *info = MHD_get_daemon_info(server->daemon, MHD_DAEMON_INFO_BIND_PORT);
    server->access.port = info ? info->port : port;
    return CA_OK;
}

/* As browsers write it, whose Host header is compared with it: 127.1 is 127.0.0.1. */
static ca_status name_address(ca_live_access *access, const struct addrinfo *place, ca_error *error)
{
    char *address = access->address;
    if (getnameinfo(place->ai_addr, place->ai_addrlen, address, sizeof access->address, NULL, 0, NI_NUMERICHOST) != 0)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "the live view's address has no name in numbers");
    access->any_address = strcmp(address, "0.0.0.0") == 0 || strcmp(address, "::") == 0;
    return CA_OK;
}

static ca_status open_server(ca_live_server *server, const char *address, uint16_t port, ca_error *error)
{
    char port_text[8];
    struct addrinfo *place = NULL;
    const struct addrinfo hints = {.ai_flags = AI_NUMERICHOST | AI_NUMERICSERV | AI_PASSIVE,
                                   .ai_socktype = SOCK_STREAM};
    snprintf(port_text, sizeof port_text, "%u", port);
    if (getaddrinfo(address, port_text, &hints, &place) != 0)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "\"%.100s\" is not an address in numbers, such as 127.0.0.1",
                       address);
    ca_status status = name_address(&server->access, place, error);
    if (status == CA_OK && !ca_live_make_token(server->access.token))
        status =
            ca_fail(error, CA_ERROR_FILE, NULL, "the system gives no random numbers for the live view's address");
    if (status == CA_OK) status = listen_on(server, place, port, error);
    freeaddrinfo(place);
    return status;
}

ca_status ca_live_server_create(ca_live_server **server, const char *address, uint16_t port, const char *title,
                                ca_live_state *state, ca_error *error)
{
    *server = ca_alloc_zeroed(1, sizeof **server);
    if (!*server) return ca_fail_memory(error, "the live view");
    (*server)->state = state;
    (*server)->title = title;
    const ca_status status = open_server(*server, address, port, error);
    if (status == CA_OK) return CA_OK;
    ca_free(*server);
    *server = NULL;
    return status;
}

void ca_live_server_destroy(ca_live_server *server)
{
    if (!server) return;
    server->closes = true;
    /* No connection may be suspended when the daemon stops. */
    for (event_stream *stream = server->streams; stream; stream = stream->next)
        if (stream->suspended) resume(stream);
    MHD_stop_daemon(server->daemon);
    ca_free(server);
}

const ca_live_access *ca_live_server_access(const ca_live_server *server) { return &server->access; }

int ca_live_server_descriptor(const ca_live_server *server)
{
    return MHD_get_daemon_info(server->daemon, MHD_DAEMON_INFO_EPOLL_FD)->epoll_fd;
}

int ca_live_server_timeout(ca_live_server *server)
{
    enum { LONGEST = 1000 };
    MHD_UNSIGNED_LONG_LONG timeout;
    if (MHD_get_timeout(server->daemon, &timeout) != MHD_YES || timeout > LONGEST) return LONGEST;
    return (int)timeout;
}

void ca_live_server_run(ca_live_server *server)
{
    const uint64_t news = newest(server->state);
    const double now = ca_clock_seconds();
    for (event_stream *stream = server->streams; stream; stream = stream->next)
        if (stream->suspended && has_something_to_tell(stream, news, now)) resume(stream);
    ca_live_clients_expire(&server->clients, now);
    MHD_run(server->daemon);
}
