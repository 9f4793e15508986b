/* Ranks that are threads of this process (render/ranks.h), so that what several of them do can be tested without MPI.
 * Functions fail the cmocka test on errors of their own. */
#ifndef CA_TEST_THREAD_RANKS_H
#define CA_TEST_THREAD_RANKS_H

#include "render/ranks.h"

enum { CA_TEST_MOST_RANKS = 4 };

/* Runs task(user, ranks) on so many ranks, rank 0 in this thread; returns when all have returned, and all messages
 * must have been received. `lateness`: messages are seen late, at random: one look of so many sees them; 0: all
 * do. */
void ca_run_ranks(uint32_t count, uint32_t lateness, void (*task)(void *user, const ca_ranks *ranks), void *user);

#endif
