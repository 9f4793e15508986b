/* Watching a render while it goes on: a page in a browser (server.h), or the program tev (tev.h).
 *
 * One thread serves all viewers. The render takes part in its progress callback: it takes a picture when a viewer
 * waits for one, at most every 250 ms, and waits while it is paused. Both together may cost 3 % of the process's
 * processor time (budget.h): beyond, answers come later, however many viewers there are. A picture in 5 seconds is
 * taken whatever it costs. No viewer can make the render wait.
 *
 * Memory: pictures of all layers, about 120 bytes a pixel each: usually two of them, and one more for each of at most
 * 8 clients that are slow to fetch theirs. */
#ifndef CA_LIVE_LIVE_H
#define CA_LIVE_LIVE_H

#include "base/status.h"

typedef struct ca_live ca_live;

typedef struct ca_live_settings {
    bool serves;          /* a page? */
    const char *address;  /* of the page, in numbers; NULL: 127.0.0.1 */
    uint32_t port;        /* 0: any that is free */
    const char *tev;      /* "HOST:PORT"; NULL: no tev */
    const char *title;    /* of the page and of tev's image; borrowed */
    uint32_t threads;     /* of the render */
    /* Writes the picture so far, when a viewer has asked for it. Says in `message` what was written. */
    ca_status (*save)(const ca_image_layers *image, const ca_render_statistics *statistics, void *user, char *message,
                      size_t size, ca_error *error);
    bool (*is_interrupted)(void); /* ends a pause, and the wait at the end */
    void *user;
} ca_live_settings;

/* Begins to listen. Errors: an address, port or tev that is not to be had. */
ca_status ca_live_create(ca_live **live, const ca_live_settings *settings, ca_error *error);
void ca_live_destroy(ca_live *live); /* NULL is allowed */

/* Where the page is: "http://127.0.0.1:8080/0123.../"; "" without a page. */
const char *ca_live_url(const ca_live *live);

/* To be called from the render's progress callback; false: a viewer has asked to end the render. */
bool ca_live_report(ca_live *live, const ca_render_progress *progress);

/* The render is over: shows its picture, which it takes over, and waits until all viewers have it, for 5 seconds at
 * most and within the budget. */
void ca_live_finish(ca_live *live, ca_image_layers *image, const ca_render_statistics *statistics);

#endif
