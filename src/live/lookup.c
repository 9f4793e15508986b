#define _DEFAULT_SOURCE
#include "live/lookup.h"

#include "base/memory.h"

#include <errno.h>
#include <netdb.h>
#include <pthread.h>
#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <sys/socket.h>
#include <time.h>

/* Of the thread that asks and of the one that waits; the last to leave frees it. */
typedef struct lookup {
    char host[256], port[8];
    struct addrinfo *places; /* owned */
    int problem;             /* of getaddrinfo */
    bool is_done, is_left;   /* by who asks; by who waits */
    pthread_mutex_t lock;
    pthread_cond_t done;
} lookup;

static lookup *create(const char *host, const char *port)
{
    lookup *l = ca_alloc_zeroed(1, sizeof *l);
    pthread_condattr_t attributes;
    if (!l) return NULL;
    snprintf(l->host, sizeof l->host, "%s", host);
    snprintf(l->port, sizeof l->port, "%s", port);
    pthread_condattr_init(&attributes);
    pthread_condattr_setclock(&attributes, CLOCK_MONOTONIC); /* that of base/clock.h */
    pthread_cond_init(&l->done, &attributes);
    pthread_condattr_destroy(&attributes);
    pthread_mutex_init(&l->lock, NULL);
    return l;
}

static void destroy(lookup *l)
{
    if (l->places) freeaddrinfo(l->places);
    pthread_mutex_destroy(&l->lock);
    pthread_cond_destroy(&l->done);
    ca_free(l);
}

static void *ask(void *user)
{
    lookup *l = user;
    const struct addrinfo hints = {.ai_socktype = SOCK_STREAM};
    struct addrinfo *places = NULL;
    const int problem = getaddrinfo(l->host, l->port, &hints, &places);
    pthread_mutex_lock(&l->lock);
    l->places = problem == 0 ? places : NULL;
    l->problem = problem;
    l->is_done = true;
    const bool is_last = l->is_left;
    pthread_cond_signal(&l->done);
    pthread_mutex_unlock(&l->lock);
    if (is_last) destroy(l);
    return NULL;
}

/* Without signals, which are for the other threads. */
static bool start(lookup *l)
{
    pthread_t thread;
    sigset_t all, before;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    const bool started = pthread_create(&thread, NULL, ask, l) == 0;
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    if (started) pthread_detach(thread);
    return started;
}

/* Is there an answer? Without one `l` is the asking thread's from now on. */
static bool wait_for_answer(lookup *l, double end)
{
    const struct timespec until = {.tv_sec = (time_t)end, .tv_nsec = (long)(1e9 * (end - (double)(time_t)end))};
    pthread_mutex_lock(&l->lock);
    while (!l->is_done && pthread_cond_timedwait(&l->done, &l->lock, &until) == 0) {
    }
    const bool answered = l->is_done;
    l->is_left = true;
    pthread_mutex_unlock(&l->lock);
    return answered;
}

ca_status ca_lookup(const char *host, const char *port, double end, struct addrinfo **places, ca_error *error)
{
    *places = NULL;
    lookup *l = create(host, port);
    if (!l) return ca_fail_memory(error, "the name of a host");
    if (!start(l)) {
        destroy(l);
        return ca_fail(error, CA_ERROR_THREADS, NULL, "the system gives no more threads");
    }
    if (!wait_for_answer(l, end))
        return ca_fail(error, CA_ERROR_FILE, NULL, "nobody says where %.200s is", host);
    const int problem = l->problem;
    *places = l->places;
    l->places = NULL;
    destroy(l);
    return problem == 0 ? CA_OK : ca_fail(error, CA_ERROR_FILE, NULL, "%s", gai_strerror(problem));
}
