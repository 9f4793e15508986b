/* Who may ask the live view for what: judged from a request's words alone.
 *
 * A path is "/TOKEN/resource". The token is a secret of 128 random bits in the address that the program prints;
 * without it every answer is the same refusal. The Host header must be the address that is served, so that a foreign
 * page whose name resolves to this machine gets nothing (DNS rebinding); for the same reason an Origin header, where
 * there is one, must be http:// and that host. No file is ever opened: a resource is a word of a fixed list, anything
 * else does not exist. */
#ifndef CA_LIVE_ACCESS_H
#define CA_LIVE_ACCESS_H

#include <stdbool.h>
#include <stdint.h>

enum { CA_LIVE_TOKEN_LENGTH = 32, CA_LIVE_ADDRESS_SIZE = 64 };

typedef struct ca_live_access {
    char token[CA_LIVE_TOKEN_LENGTH + 1];
    char address[CA_LIVE_ADDRESS_SIZE]; /* that is listened on, a number: "127.0.0.1", "::1" */
    uint16_t port;
    bool any_address; /* it stands for all addresses of the machine */
} ca_live_access;

#define CA_LIVE_RESOURCE_LIST(X)       \
    X(CA_LIVE_PAGE, "")                \
    X(CA_LIVE_STYLE, "style.css")      \
    X(CA_LIVE_VIEWER, "viewer.js")     \
    X(CA_LIVE_SCRIPT, "live.js")       \
    X(CA_LIVE_EVENTS, "events")        \
    X(CA_LIVE_LAYERS, "layers")        \
    X(CA_LIVE_PLANES, "planes")        \
    X(CA_LIVE_PIXEL, "pixel")          \
    /* from here on only by POST */    \
    X(CA_LIVE_PAUSE, "pause")          \
    X(CA_LIVE_RESUME, "resume")        \
    X(CA_LIVE_STOP, "stop")            \
    X(CA_LIVE_SAVE, "save")

typedef enum ca_live_resource {
#define CA_LIVE_ENUM(name, text) name,
    CA_LIVE_RESOURCE_LIST(CA_LIVE_ENUM)
#undef CA_LIVE_ENUM
        CA_LIVE_RESOURCES
} ca_live_resource;

typedef struct ca_live_request {
    const char *method, *path;  /* the path with its %-sequences resolved, without what follows a '?' */
    const char *host, *origin;  /* NULL: there is no such header */
} ca_live_request;

/* The HTTP status: 200 and the resource, or a refusal: 400 (no Host, or a path that tries to climb), 403, 404,
 * 405. */
int ca_live_judge(const ca_live_access *access, const ca_live_request *request, ca_live_resource *resource);

/* A random token. false where the system gives no random numbers. */
bool ca_live_make_token(char token[CA_LIVE_TOKEN_LENGTH + 1]);

#endif
