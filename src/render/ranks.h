/* Ranks: processes, on one machine or many, that render one picture together. Rank 0 is the one that decides and
 * writes. Here is what they need of whatever connects them (cli/mpi_ranks.c), and what all of them do together.
 *
 * Messages between two ranks arrive in the order in which they were sent. Ranks are of one program on machines of one
 * kind: messages are the bytes of records, but for sums, which are as in files. A connection that fails ends all
 * ranks: no call here tells of it. Threads: all calls are one thread's. */
#ifndef CA_RENDER_RANKS_H
#define CA_RENDER_RANKS_H

#include "base/status.h"

#include <stdbool.h>

typedef struct ca_rank_message {
    uint32_t from;
    size_t size;
} ca_rank_message;

enum { CA_ANY_RANK = 0x7fffffff };

typedef struct ca_ranks {
    uint32_t rank, count;
    void *user;
    /* May wait until the other one receives; the bytes are the caller's again. */
    void (*send)(void *user, uint32_t to, const void *bytes, size_t size);
    /* Is there a message from this rank, or from any? Never waits. */
    bool (*arrived)(void *user, uint32_t from, ca_rank_message *message);
    /* Takes the message of which `arrived` has told: message->size bytes. */
    void (*receive)(void *user, const ca_rank_message *message, void *bytes);
} ca_ranks;

/* Is this one of several, but not the one that decides and writes? `ranks` may be NULL: there is one. */
static inline bool ca_ranks_helps(const ca_ranks *ranks) { return ranks && ranks->rank > 0; }

/* Waits for a message, mostly asleep. */
void ca_ranks_wait(const ca_ranks *ranks, uint32_t from, ca_rank_message *message);
/* And takes it; it has this size. */
void ca_ranks_expect(const ca_ranks *ranks, uint32_t from, void *bytes, size_t size);

/* Called by all ranks with how they fared: CA_OK where all are CA_OK, else, on all of them, the first failure by
 * rank; a message that is not rank 0's own begins with the rank and its machine. `ranks` may be NULL. */
ca_status ca_ranks_agree(const ca_ranks *ranks, ca_status status, ca_error *error);

/* Called by all ranks: rank 0's bytes go to the others. */
void ca_ranks_share(const ca_ranks *ranks, void *bytes, size_t size);

#endif
