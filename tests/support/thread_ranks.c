#define _POSIX_C_SOURCE 200809L
#include "support/thread_ranks.h"

#include "support/test_random.h"

#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

typedef struct mail {
    struct mail *next;
    uint32_t from;
    size_t size;
    unsigned char bytes[];
} mail;

typedef struct group group;

typedef struct member {
    group *all;
    ca_ranks ranks;
    mail *first; /* in the order of their coming, behind the group's lock */
    ca_test_random random;
    pthread_t thread;
} member;

struct group {
    uint32_t lateness;
    void (*task)(void *user, const ca_ranks *ranks);
    void *user;
    pthread_mutex_t lock;
    member members[CA_TEST_MOST_RANKS];
};

static void send_bytes(void *user, uint32_t to, const void *bytes, size_t size)
{
    member *self = user, *other = &self->all->members[to];
    mail *sent = malloc(sizeof *sent + size);
    assert_non_null(sent);
    *sent = (mail){.from = self->ranks.rank, .size = size};
    memcpy(sent->bytes, bytes, size);
    pthread_mutex_lock(&self->all->lock);
    mail **end = &other->first;
    while (*end) end = &(*end)->next;
    *end = sent;
    pthread_mutex_unlock(&self->all->lock);
}

/* The first one of that rank, or NULL. The lock is held. */
static mail **find(member *self, uint32_t from)
{
    mail **place = &self->first;
    while (*place && from != CA_ANY_RANK && (*place)->from != from) place = &(*place)->next;
    return *place ? place : NULL;
}

static bool has_arrived(void *user, uint32_t from, ca_rank_message *message)
{
    member *self = user;
    const uint32_t lateness = self->all->lateness;
    if (lateness > 0 && ca_test_random_u32(&self->random) % lateness != 0) return false;
    pthread_mutex_lock(&self->all->lock);
    mail **place = find(self, from);
    if (place) *message = (ca_rank_message){.from = (*place)->from, .size = (*place)->size};
    pthread_mutex_unlock(&self->all->lock);
    return place != NULL;
}

static void receive_bytes(void *user, const ca_rank_message *message, void *bytes)
{
    member *self = user;
    pthread_mutex_lock(&self->all->lock);
    mail **place = find(self, message->from), *taken = place ? *place : NULL;
    if (taken) *place = taken->next;
    pthread_mutex_unlock(&self->all->lock);
    assert_true(taken && taken->size == message->size);
    if (!taken) return;
    memcpy(bytes, taken->bytes, taken->size);
    free(taken);
}

static void *run(void *user)
{
    const member *self = user;
    self->all->task(self->all->user, &self->ranks);
    return NULL;
}

void ca_run_ranks(uint32_t count, uint32_t lateness, void (*task)(void *user, const ca_ranks *ranks), void *user)
{
    group g = {.lateness = lateness, .task = task, .user = user, .lock = PTHREAD_MUTEX_INITIALIZER};
    assert_true(count <= CA_TEST_MOST_RANKS);
    for (uint32_t i = 0; i < count; i++) {
        member *m = &g.members[i];
        *m = (member){.all = &g, .random = ca_test_random_seed(i + 1)};
        m->ranks = (ca_ranks){i, count, m, send_bytes, has_arrived, receive_bytes};
    }
    for (uint32_t i = 1; i < count; i++)
        assert_int_equal(pthread_create(&g.members[i].thread, NULL, run, &g.members[i]), 0);
    run(&g.members[0]);
    for (uint32_t i = 1; i < count; i++) pthread_join(g.members[i].thread, NULL);
    for (uint32_t i = 0; i < count; i++) assert_null(g.members[i].first);
}
