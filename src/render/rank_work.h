/* The passes, or blocks, of one render, made by several ranks (ranks.h).
 *
 * Rank 0 hands them out in order, in ranges, to whoever asks; it makes some itself and answers the others between its
 * tasks (ca_parallel.between). Each rank adds what it makes to sums of its own. Rank 0 gathers them at the end and
 * when somebody wants to see all passes before some number, its *border*: whoever asks next sends its sums first, and
 * goes on. Sums do not depend on order or grouping (docs/decisions/021), so the bits are those of one process.
 *
 * What is decided by looking at the sums of the first N passes is decided before any later one is added: ranks that
 * come to a pass beyond `look` make it, but hold it until the decision is known; then it is added or dropped.
 *
 * What fails on another rank (memory, threads) is made again by rank 0, and that rank gets no more. What fails on
 * rank 0 ends the render, as it does in one process.
 *
 * State: a row of sums or CA_RANK_BATCH bytes; 200 bytes a rank. Threads: all calls are the thread's that renders. */
#ifndef CA_RENDER_RANK_WORK_H
#define CA_RENDER_RANK_WORK_H

#include "film/part_file.h"
#include "render/ranks.h"

#include <pthread.h>

enum { CA_RANK_BATCH = 1 << 20 /* about so many bytes of sums travel together */ };

/* Half open. */
typedef struct ca_work_range {
    uint64_t begin, end;
} ca_work_range;

/* What a rank sums up, and how it travels. */
typedef struct ca_rank_sums {
    void *user;
    uint32_t rows;
    size_t row_bytes;
    void (*write_row)(void *user, uint32_t row, unsigned char *bytes);
    /* Of so many passes. false: no row looks like that. */
    bool (*add_row)(void *user, uint32_t row, const unsigned char *bytes, uint64_t made);
    void (*clear)(void *user);
    /* What this rank has counted since it began. */
    void (*count)(void *user, uint64_t counts[CA_PART_COUNTS]);
} ca_rank_sums;

/* What rank 0 knows of another one. */
typedef struct ca_helper {
    ca_work_range range;             /* at work on; begin == end: on none */
    uint64_t unsent;                 /* passes that it has made and not sent; likewise: */
    uint64_t counts[CA_PART_COUNTS]; /* of what it has sent */
    bool asks;                       /* and has got no answer yet */
    bool sent;                       /* since gathering began */
    bool holds;                      /* its range until a decision */
    bool failed, gone;
} ca_helper;

typedef struct ca_rank_work {
    const ca_ranks *ranks; /* borrowed */
    ca_rank_sums sums;
    unsigned char *batch; /* owned */
    pthread_t thread;     /* that renders */
    int stop;             /* of what is being made (base/stop.h): set where a held range is dropped */
    const int *end_wanted; /* base/stop.h: no more is handed out; NULL: nobody can ask */
    /* Set before any of it is to be made: makes passes on this rank, in order, and adds them to its sums. *made of
     * them: where these are not all, the next one failed. */
    ca_status (*make)(void *user, ca_work_range range, uint64_t *made, ca_error *error);
    void *make_user;

    /* Of rank 0. The first ones may be changed at any time. */
    uint64_t limit;  /* nothing from here on is handed out */
    uint64_t look;   /* what is not added before it is decided begins here; UINT64_MAX: nothing */
    uint32_t run;    /* passes are handed out in aligned runs of so many */
    double deadline; /* by the clock: nothing is handed out from then on, but the first range; 0: none */
    bool waits;      /* the others get nothing yet; changed by ca_rank_work_wait */
    bool closed;     /* nothing is handed out any more */
    bool end_asked;  /* another rank was asked to end */
    uint64_t first, next; /* handed out: [first, next) */
    uint64_t border;      /* while gathering: all passes before it are wanted */
    uint64_t made;        /* by all ranks */
    uint64_t in_sums;     /* of these, in rank 0's sums */
    bool gathering, ended;
    bool lost; /* passes failed on another rank, and cannot be made again */
    ca_helper *helpers;      /* owned; [ranks->count], [0] is not used */
    ca_work_range *returned; /* owned, likewise: ranges that failed elsewhere */
    uint32_t returned_count;
    ca_status status; /* the first failure of another rank */
    ca_error failure;

    /* Of the others. */
    bool held, decided, dropped;
    struct ca_work_report *report; /* owned; what is said next */
} ca_rank_work;

/* Begins: passes from `first` are to be handed out, of which `made` are in rank 0's sums already. */
ca_status ca_rank_work_create(ca_rank_work *work, const ca_ranks *ranks, const ca_rank_sums *sums, uint64_t first,
                              uint64_t made, ca_error *error);
void ca_rank_work_destroy(ca_rank_work *work);

/* ca_parallel.between of all ranks' loops, while nothing is added to the sums. `work` is a ca_rank_work. */
void ca_rank_work_between(void *work);

/* ---- Rank 0 ---------------------------------------------------------------------------------------------------- */

/* The next range for rank 0; false: there is none, or none before the look. */
bool ca_rank_work_take(ca_rank_work *work, ca_work_range *range);
/* The others get nothing until they need not wait any more: those that have asked do then. */
void ca_rank_work_wait(ca_rank_work *work, bool waits);
/* Makes it. Where one of its passes failed nothing is handed out any more. */
ca_status ca_rank_work_make(ca_rank_work *work, ca_work_range range, ca_error *error);

/* Waits until all passes before the border are in rank 0's sums: that is the look, where it has been reached, else
 * all that is handed out now. What others could not make is made here; the first failure of that is told. */
ca_status ca_rank_work_gather(ca_rank_work *work, ca_error *error);
/* After that: the others add what they hold, up to the next look. */
void ca_rank_work_go_on(ca_rank_work *work, uint64_t look);

/* Or nothing more is handed out, and all is gathered. `status` is how rank 0 fared so far, of which *error tells: the
 * first failure of it, of gathering, and of another rank, is returned. */
ca_status ca_rank_work_finish(ca_rank_work *work, ca_status status, ca_error *error);
/* And all is over: what is held is dropped. Waits until all ranks know. */
void ca_rank_work_end(ca_rank_work *work);

/* Is there a rank whose sums may have to be gathered? Not of work that was not created, or is over. */
static inline bool ca_rank_work_is_open(const ca_rank_work *work) { return work->ranks && !work->ended; }

/* Are the sums, once gathered, those of passes without a gap? Not where one failed and later ones were made. Of work
 * that was not created: yes. */
bool ca_rank_work_is_whole(const ca_rank_work *work);
/* CA_ERROR_FILE where they are not: they cannot be written to `path`. `what`: "passes" or "blocks". */
ca_status ca_rank_work_check_whole(const ca_rank_work *work, const char *path, const char *what, ca_error *error);

/* Adds what the others have counted of what is in the sums. */
void ca_rank_work_count(const ca_rank_work *work, uint64_t counts[CA_PART_COUNTS]);

/* ---- The others ------------------------------------------------------------------------------------------------ */

/* Makes what rank 0 hands out, until all is over; rank 0 tells what failed. `each` passes must stay together in the
 * sums: where some of them cannot be made, this rank's sums since it sent them last are no use. */
void ca_rank_work_help(ca_rank_work *work, uint64_t each);
/* May what was made be added? Waits for the decision. Of rank 0 too, where it may. */
bool ca_rank_work_may_add(ca_rank_work *work);

#endif
