/* Connections of clients that have not shown the secret yet. Only so many may wait at a time, and none for long, also
 * if it says something now and then: so a crowd of them keeps nobody out. Who must go is hung up on; the web server
 * notices, and forgets it as any that is gone. Threads: one. */
#ifndef CA_LIVE_CLIENTS_H
#define CA_LIVE_CLIENTS_H

#include <stdint.h>

enum {
    CA_LIVE_MOST_STRANGERS = 64, /* at a time; one more, and the oldest must go */
    CA_LIVE_STRANGER_SECONDS = 10, /* for all of its first request */
};

typedef struct ca_live_visitor ca_live_visitor;

typedef struct ca_live_clients {
    ca_live_visitor *oldest, *newest; /* of those that are strangers */
    uint32_t strangers;
} ca_live_clients;

/* A new connection, to be removed when it is closed. NULL: out of memory, and it was hung up on. */
ca_live_visitor *ca_live_clients_add(ca_live_clients *clients, int descriptor, double now);
/* It has shown the secret; may be said again. NULL is allowed. */
void ca_live_clients_know(ca_live_clients *clients, ca_live_visitor *client);
void ca_live_clients_remove(ca_live_clients *clients, ca_live_visitor *client); /* NULL is allowed */
/* Hangs up on strangers whose time is over; to be called about once a second. */
void ca_live_clients_expire(ca_live_clients *clients, double now);

#endif
