/* A render that is none, to be looked at by tests of the live view: its passes take a few milliseconds and its
 * pictures tell which they are. Functions fail the cmocka test on errors of their own. */
#ifndef CA_TEST_LIVE_FIXTURE_H
#define CA_TEST_LIVE_FIXTURE_H

#include "live/live.h"
#include "support/live_client.h"

#include <stdbool.h>
#include <stdint.h>

enum { CA_LIVE_WIDTH = 8, CA_LIVE_HEIGHT = 4, CA_LIVE_PIXELS = CA_LIVE_WIDTH * CA_LIVE_HEIGHT };
#define CA_LIVE_TITLE "a <test>"

typedef struct ca_live_fake {
    ca_live *live;
    ca_live_place place; /* of its page */
    uint32_t width, height;
    uint32_t passes;
    double pass_seconds, picture_seconds; /* of the processor, that each takes */
    int pictures, saves;
    float saved;      /* R of the picture that was saved */
    bool interrupted; /* by a signal */
} ca_live_fake;

extern ca_live_fake fake; /* cmocka's tests run one after the other; the callback has no user */

/* Passes of 5 ms of pictures of CA_LIVE_WIDTH x CA_LIVE_HEIGHT, which may be changed before the first pass. */
void ca_live_fake_open(bool serves, const char *tev);
void ca_live_fake_close(void);
bool ca_live_fake_pass(void); /* false: somebody wants it to end */

/* What its page has; see ca_live_fetch. Does not assert. */
int ca_live_fake_fetch(const char *method, const char *resource, char *text, size_t size);

/* A client for a thread of its own: `act` must not assert. */
typedef struct ca_live_client {
    void (*act)(char *seen, size_t size);
    char *seen;
    size_t size;
    bool ready; /* atomic */
} ca_live_client;

void *ca_live_client_run(void *client);
/* Renders until the client is ready, or somebody stops it; false then. */
bool ca_live_fake_beside(void (*act)(char *seen, size_t size), char *seen, size_t size);

/* R is the number of passes, G and B are the place, A is nothing that anybody asked for. */
ca_image_layers *ca_live_fake_picture(uint32_t passes);

bool ca_live_fake_interrupted(void);
ca_status ca_live_fake_save(const ca_image_layers *image, const ca_render_statistics *statistics, void *user,
                            char *message, size_t size, ca_error *error);

void assert_says(const char *text, const char *words);

#endif
