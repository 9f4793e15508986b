#define _DEFAULT_SOURCE
#include "live/access.h"

#include <arpa/inet.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>
#include <sys/random.h>

static const char *const resource_names[CA_LIVE_RESOURCES] = {
#define CA_LIVE_NAME(name, text) text,
    CA_LIVE_RESOURCE_LIST(CA_LIVE_NAME)
#undef CA_LIVE_NAME
};

bool ca_live_make_token(char token[CA_LIVE_TOKEN_LENGTH + 1])
{
    unsigned char bytes[CA_LIVE_TOKEN_LENGTH / 2];
    if (getrandom(bytes, sizeof bytes, 0) != (ssize_t)sizeof bytes) return false;
    for (size_t i = 0; i < sizeof bytes; i++) snprintf(token + 2 * i, 3, "%02x", bytes[i]);
    return true;
}

/* Takes the same time wherever the first difference is. */
static bool token_is(const ca_live_access *access, const char *text, size_t length)
{
    unsigned difference = 0;
    if (length != CA_LIVE_TOKEN_LENGTH) return false;
    for (size_t i = 0; i < length; i++) difference |= (unsigned char)access->token[i] ^ (unsigned char)text[i];
    return difference == 0;
}

/* "127.0.0.1", "::1": a number, and so not a name that is resolved outside of this machine. */
static bool is_number(const char *name)
{
    unsigned char address[16];
    return inet_pton(AF_INET, name, address) == 1 || inet_pton(AF_INET6, name, address) == 1;
}

/* "name:port", "[::1]:port"; without a port it is 80. */
static bool host_is_ours(const ca_live_access *access, const char *host)
{
    char name[CA_LIVE_ADDRESS_SIZE], port[8];
    const bool bracketed = host[0] == '[';
    const size_t length = strcspn(host + bracketed, bracketed ? "]" : ":");
    const char *rest = host + bracketed + length + (bracketed && host[1 + length] == ']');
    if (length == 0 || length >= sizeof name) return false;
    memcpy(name, host + bracketed, length);
    name[length] = '\0';
    snprintf(port, sizeof port, ":%u", access->port);
    if (strcmp(rest, port) != 0 && !(access->port == 80 && rest[0] == '\0')) return false;
    if (strcasecmp(name, "localhost") == 0 || strcmp(name, access->address) == 0) return true;
    return access->any_address && is_number(name);
}

static bool origin_is_ours(const ca_live_access *access, const char *origin)
{
    static const char scheme[] = "http://";
    return strncmp(origin, scheme, sizeof scheme - 1) == 0 && host_is_ours(access, origin + sizeof scheme - 1);
}

/* No resource has any of these in its name: a request that has them tries to read files. */
static bool climbs(const char *path) { return strstr(path, "..") || strpbrk(path, "\\%") || strstr(path, "//"); }

int ca_live_judge(const ca_live_access *access, const ca_live_request *request, ca_live_resource *resource)
{
    if (!request->host) return 400;
    if (!host_is_ours(access, request->host)) return 403;
    if (request->origin && !origin_is_ours(access, request->origin)) return 403;
    if (request->path[0] != '/' || climbs(request->path)) return 400;
    const size_t length = strcspn(request->path + 1, "/");
    if (!token_is(access, request->path + 1, length) || request->path[1 + length] != '/') return 403;
    const char *name = request->path + length + 2;
    for (int i = 0; i < CA_LIVE_RESOURCES; i++) {
        if (strcmp(name, resource_names[i]) != 0) continue;
        *resource = (ca_live_resource)i;
        return strcmp(request->method, i >= CA_LIVE_PAUSE ? "POST" : "GET") == 0 ? 200 : 405;
    }
    return 404;
}
