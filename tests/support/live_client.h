/* A client of the live view as plain as can be, over a socket of its own: for tests that look at a page without a
 * browser. No function asserts, so that threads of clients may call them. */
#ifndef CA_TEST_LIVE_CLIENT_H
#define CA_TEST_LIVE_CLIENT_H

#include <stdbool.h>
#include <stddef.h>

/* Where a page is: from "http://127.0.0.1:8080/0123.../". */
typedef struct ca_live_place {
    char host[32], path[64]; /* "127.0.0.1:8080", "/0123.../" */
    int port;
} ca_live_place;

bool ca_live_find_place(ca_live_place *place, const char *url);
/* That which a program prints in its first line, in a file that it writes; waits for it a minute at most. */
bool ca_live_wait_for_place(ca_live_place *place, const char *output);

/* A socket that waits at most 20 s for an answer; -1: nobody listens. */
int ca_live_connect(int port);
void ca_live_send(int client, const char *text);

/* Connects and asks for one thing, after whose answer the server hangs up. */
int ca_live_ask(int port, const char *method, const char *path, const char *host);
/* Of a place. */
int ca_live_open(const ca_live_place *place, const char *method, const char *resource);

/* Reads until `words` have come, the end (NULL: only that) or until `text` is full; gives back how much. */
size_t ca_live_read(int client, const char *words, char *text, size_t size);

/* The status of a whole request; the answer is kept in `text`. 0: there was none. */
int ca_live_fetch(int port, const char *method, const char *path, const char *host, char *text, size_t size);

#endif
