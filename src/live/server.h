/* The live view's web server (libmicrohttpd): the page, its sources, events, channels, values of a pixel, and what
 * the page may ask of the render. access.h says who gets what.
 *
 *     GET  /TOKEN/                      the page; style.css viewer.js live.js beside it
 *     GET  /TOKEN/events                server-sent events: ca_live_state_describe at every news, a comment every few
 * seconds GET  /TOKEN/layers                {"version": 7, "names": ["R", ...]} GET  /TOKEN/planes?names=R,G,B
 * channels of the newest picture as floats; header Caustica-Version. 503: none yet, or too many are on their way GET
 * /TOKEN/pixel?x=1&y=2         {"version": 7, "values": {"R": 0.1, ...}} POST /TOKEN/pause resume stop save
 *
 * It runs in one thread, which calls ca_live_server_run whenever its descriptor has something, its timeout is over or
 * there are news; no call waits for a client. Who sends nothing for 20 seconds is let go; at most 256 connections are
 * open at once. */
#ifndef CA_LIVE_SERVER_H
#define CA_LIVE_SERVER_H

#include "live/access.h"
#include "live/state.h"

typedef struct ca_live_server ca_live_server;

/* Listens on `address`, a number, and `port` (0: any that is free). `title` and `state` are borrowed. Errors:
 * CA_ERROR_ARGUMENT, CA_ERROR_FILE, CA_ERROR_MEMORY. */
ca_status ca_live_server_create(ca_live_server **server, const char *address, uint16_t port, const char *title,
                                ca_live_state *state, ca_error *error);
void ca_live_server_destroy(ca_live_server *server);

const ca_live_access *ca_live_server_access(const ca_live_server *server);

int ca_live_server_descriptor(const ca_live_server *server); /* for poll(): readable when there is something to do */
int ca_live_server_timeout(ca_live_server *server); /* milliseconds until there is, whatever the descriptor says */
void ca_live_server_run(ca_live_server *server);

#endif
