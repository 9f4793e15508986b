#define _DEFAULT_SOURCE
#include "render/ranks.h"

#include "base/memory.h"

#include <sched.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

/* A message that is on its way comes within some microseconds; one that is not may take minutes. */
enum { QUICK_LOOKS = 200, SHORTEST_NAP = 20000, LONGEST_NAP = 1000000 /* ns */ };

void ca_ranks_wait(const ca_ranks *ranks, uint32_t from, ca_rank_message *message)
{
    struct timespec nap = {.tv_nsec = SHORTEST_NAP};
    for (int looks = 0; !ranks->arrived(ranks->user, from, message); looks++) {
        if (looks < QUICK_LOOKS) {
            sched_yield();
            continue;
        }
        nanosleep(&nap, NULL);
        if (nap.tv_nsec < LONGEST_NAP) nap.tv_nsec += nap.tv_nsec / 2;
    }
}

/* Of another size it is another program's, or another version's: as if it had said nothing. */
static void ignore(const ca_ranks *ranks, const ca_rank_message *message, void *bytes, size_t size)
{
    void *taken = ca_alloc(message->size, 1);
    if (taken) ranks->receive(ranks->user, message, taken);
    ca_free(taken);
    memset(bytes, 0, size);
}

void ca_ranks_expect(const ca_ranks *ranks, uint32_t from, void *bytes, size_t size)
{
    ca_rank_message message;
    ca_ranks_wait(ranks, from, &message);
    if (message.size == size)
        ranks->receive(ranks->user, &message, bytes);
    else
        ignore(ranks, &message, bytes, size);
}

/* ---- Agreement ------------------------------------------------------------------------------------------------- */

typedef struct verdict {
    ca_status status;
    ca_error error;
} verdict;

static void name_rank(const ca_ranks *ranks, ca_error *error)
{
    char host[128] = "?", text[sizeof error->message];
    gethostname(host, sizeof host - 1);
    memcpy(text, error->message, sizeof text);
    snprintf(error->message, sizeof error->message, "rank %u (%s): %.850s", ranks->rank, host, text);
}

static ca_status follow(const ca_ranks *ranks, verdict *own, ca_error *error)
{
    verdict all;
    if (own->status != CA_OK) name_rank(ranks, &own->error);
    ranks->send(ranks->user, 0, own, sizeof *own);
    ca_ranks_expect(ranks, 0, &all, sizeof all);
    if (all.status != CA_OK && error) *error = all.error;
    return all.status;
}

ca_status ca_ranks_agree(const ca_ranks *ranks, ca_status status, ca_error *error)
{
    if (!ranks) return status;
    verdict all = {.status = status}, other;
    if (status != CA_OK && error) all.error = *error;
    if (ranks->rank > 0) return follow(ranks, &all, error);
    for (uint32_t i = 1; i < ranks->count; i++) {
        ca_ranks_expect(ranks, i, &other, sizeof other);
        if (all.status == CA_OK) all = other;
    }
    for (uint32_t i = 1; i < ranks->count; i++) ranks->send(ranks->user, i, &all, sizeof all);
    if (all.status != CA_OK && error) *error = all.error;
    return all.status;
}

void ca_ranks_share(const ca_ranks *ranks, void *bytes, size_t size)
{
    if (ranks->rank > 0)
        ca_ranks_expect(ranks, 0, bytes, size);
    else
        for (uint32_t i = 1; i < ranks->count; i++) ranks->send(ranks->user, i, bytes, size);
}
