#include "live/clients.h"

#include "base/memory.h"

#include <stdbool.h>
#include <sys/socket.h>

struct ca_live_visitor {
    ca_live_visitor *older, *newer; /* strangers */
    int descriptor;
    double since;
    bool is_stranger;
};

static void unlink_stranger(ca_live_clients *clients, ca_live_visitor *client)
{
    if (!client->is_stranger) return;
    *(client->older ? &client->older->newer : &clients->oldest) = client->newer;
    *(client->newer ? &client->newer->older : &clients->newest) = client->older;
    client->is_stranger = false;
    clients->strangers--;
}

static void hang_up(ca_live_clients *clients, ca_live_visitor *client)
{
    shutdown(client->descriptor, SHUT_RDWR);
    unlink_stranger(clients, client);
}

ca_live_visitor *ca_live_clients_add(ca_live_clients *clients, int descriptor, double now)
{
    ca_live_visitor *client = ca_alloc(1, sizeof *client);
    if (!client) {
        shutdown(descriptor, SHUT_RDWR);
        return NULL;
    }
    if (clients->strangers == CA_LIVE_MOST_STRANGERS) hang_up(clients, clients->oldest);
    *client =
        (ca_live_visitor){.older = clients->newest, .descriptor = descriptor, .since = now, .is_stranger = true};
    *(clients->newest ? &clients->newest->newer : &clients->oldest) = client;
    clients->newest = client;
    clients->strangers++;
    return client;
}

void ca_live_clients_know(ca_live_clients *clients, ca_live_visitor *client)
{
    if (client) unlink_stranger(clients, client);
}

void ca_live_clients_remove(ca_live_clients *clients, ca_live_visitor *client)
{
    if (!client) return;
    unlink_stranger(clients, client);
    ca_free(client);
}

void ca_live_clients_expire(ca_live_clients *clients, double now)
{
    while (clients->oldest && now - clients->oldest->since > CA_LIVE_STRANGER_SECONDS)
        hang_up(clients, clients->oldest);
}
