#define _GNU_SOURCE
#include "support/live_client.h"

#include <arpa/inet.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

bool ca_live_find_place(ca_live_place *place, const char *url)
{
    const char *start = strstr(url, "http://");
    if (!start || sscanf(start, "http://%31[^/]%63[^ \n]", place->host, place->path) != 2 ||
        !strchr(place->host, ':'))
        return false;
    place->port = atoi(strchr(place->host, ':') + 1);
    return true;
}

bool ca_live_wait_for_place(ca_live_place *place, const char *output)
{
    for (int i = 0; i < 6000; i++, usleep(10000)) {
        char line[256];
        FILE *file = fopen(output, "r");
        const bool found = file && fgets(line, sizeof line, file) && ca_live_find_place(place, line);
        if (file) fclose(file);
        if (found) return true;
    }
    return false;
}

int ca_live_connect(int port)
{
    const struct sockaddr_in place = {
        .sin_family = AF_INET, .sin_port = htons((uint16_t)port), .sin_addr = {htonl(INADDR_LOOPBACK)}};
    const struct timeval patience = {.tv_sec = 20};
    const int client = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    setsockopt(client, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    if (connect(client, (const struct sockaddr *)&place, sizeof place) == 0) return client;
    close(client);
    return -1;
}

void ca_live_send(int client, const char *text)
{
    if (send(client, text, strlen(text), MSG_NOSIGNAL) < 0) return; /* the answer will be missed */
}

int ca_live_ask(int port, const char *method, const char *path, const char *host)
{
    char request[512];
    const int client = ca_live_connect(port);
    if (client < 0) return -1;
    snprintf(request, sizeof request, "%s %s HTTP/1.1\r\nHost: %s\r\nConnection: close\r\nContent-Length: 0\r\n\r\n",
             method, path, host);
    ca_live_send(client, request);
    return client;
}

int ca_live_open(const ca_live_place *place, const char *method, const char *resource)
{
    char path[256];
    snprintf(path, sizeof path, "%s%s", place->path, resource);
    return ca_live_ask(place->port, method, path, place->host);
}

size_t ca_live_read(int client, const char *words, char *text, size_t size)
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

int ca_live_fetch(int port, const char *method, const char *path, const char *host, char *text, size_t size)
{
    int status = 0;
    const int client = ca_live_ask(port, method, path, host);
    ca_live_read(client, NULL, text, size);
    if (client >= 0) close(client);
    sscanf(text, "HTTP/1.1 %d", &status);
    return status;
}
