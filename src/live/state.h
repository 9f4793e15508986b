/* What the render and the serving thread share. Everything is guarded by `lock`; neither side holds it while it
 * makes, sends or writes a picture. */
#ifndef CA_LIVE_STATE_H
#define CA_LIVE_STATE_H

#include "live/budget.h"
#include "live/snapshot.h"

#include <pthread.h>

typedef enum ca_live_phase {
    CA_LIVE_WAITING,
    CA_LIVE_RENDERING,
    CA_LIVE_PAUSED,
    CA_LIVE_STOPPING,
    CA_LIVE_DONE
} ca_live_phase;

typedef struct ca_live_state {
    pthread_mutex_t lock;
    pthread_cond_t asked; /* a viewer has asked for something */
    int wake_descriptor;  /* an eventfd: there is news for viewers */

    /* From the render. */
    ca_live_phase phase;
    ca_render_progress progress; /* its pointers are of no use here */
    ca_live_snapshot *snapshot;  /* the newest; held; NULL: none yet */
    uint64_t news;               /* number of the latest news */
    char message[1400];          /* the last request that was carried out, or failed; "": none */

    /* To the render. */
    bool wants_picture, wants_pause, wants_stop, wants_save;

    uint32_t watchers;  /* event streams and pictures on their way */
    bool tev_is_behind; /* it is there, and has not got the newest picture yet */
    bool quits;        /* the serving thread should end */
    ca_live_budget budget;
} ca_live_state;

/* `threads`: of the render. */
ca_status ca_live_state_init(ca_live_state *state, uint32_t threads, ca_error *error);
void ca_live_state_clear(ca_live_state *state);

/* With the lock held: there is something new to tell. */
void ca_live_state_tell(ca_live_state *state);

/* The newest picture, held for the caller; NULL: none yet. Takes the lock. */
ca_live_snapshot *ca_live_state_picture(ca_live_state *state);

/* Does the budget let the serving thread go on? While the render is paused it always does. With the lock held. */
bool ca_live_state_may_serve(const ca_live_state *state);

enum { CA_LIVE_EVENT_SIZE = 16384 };
/* The news as JSON for the page, and its number; gives back its length. Takes the lock, but not while it writes. */
size_t ca_live_state_describe(ca_live_state *state, char text[CA_LIVE_EVENT_SIZE], uint64_t *number);

#endif
