#define _POSIX_C_SOURCE 200809L
#include "base/parallel.h"

#include "base/clock.h"
#include "base/loading.h"
#include "base/processors.h"
#include "base/stop.h"

#include <assert.h>
#include <pthread.h>
#include <stdatomic.h>
#include <string.h>

/* A loop at work, on the stack of the thread that called. */
typedef struct task_loop {
    const ca_parallel *parallel;
    ca_parallel_task task;
    void *user;
    uint32_t count;
    atomic_uint next; /* task that nobody has taken yet */
    /* Guarded by the pool's lock: */
    struct task_loop *older; /* another one at work */
    uint32_t running;        /* threads of the pool that have not finished */
    double task_seconds;
    pthread_cond_t finished;
} task_loop;

/* A thread of the pool, on its own stack. */
typedef struct pool_thread {
    struct pool_thread *next; /* that sleeps */
    task_loop *loop;          /* to work on; NULL: none */
    uint32_t worker;
    pthread_cond_t woken;
} pool_thread;

/* Of the process, as threads are. Those that sleep form a list, the last one that fell asleep first. */
static struct {
    pthread_mutex_t lock;
    pthread_cond_t arrived; /* a new thread, in the list */
    pool_thread *sleeping;
    uint32_t sleeping_count, made;
    task_loop *loops; /* at work, the youngest one first */
    uint32_t at_work; /* threads in them, each of which counts once */
    bool forks_safely;
} pool = {.lock = PTHREAD_MUTEX_INITIALIZER, .arrived = PTHREAD_COND_INITIALIZER};

/* This thread counts as one at work: it is in a loop, or one of the pool's. */
static _Thread_local bool counts;

/* ---- Tasks ----------------------------------------------------------------------------------------------------- */

/* The next task may be beyond the last one; at most once a thread, so that the number does not go round. */
static void run_tasks(task_loop *loop, uint32_t worker)
{
    const ca_parallel *parallel = loop->parallel;
    for (;;) {
        if (worker == 0 && parallel->between) parallel->between(parallel->between_user);
        if (ca_stop_asked(parallel->stop)) return;
        const uint32_t i = atomic_fetch_add_explicit(&loop->next, 1, memory_order_relaxed);
        if (i >= loop->count) return;
        loop->task(loop->user, i, worker);
    }
}

/* The thread's clock is read before it waits for others. */
static double run_timed(task_loop *loop, uint32_t worker)
{
    if (!loop->parallel->seconds) {
        run_tasks(loop, worker);
        return 0.0;
    }
    const double start = ca_clock_thread_seconds();
    run_tasks(loop, worker);
    return ca_clock_thread_seconds() - start;
}

/* ---- Threads --------------------------------------------------------------------------------------------------- */

static void fall_asleep(pool_thread *self)
{
    self->loop = NULL;
    self->next = pool.sleeping;
    pool.sleeping = self;
    pool.sleeping_count++;
}

/* What a thread of the pool does, for ever. */
static void *serve(void *nothing)
{
    (void)nothing;
    pool_thread self = {.loop = NULL};
    counts = true;
    pthread_cond_init(&self.woken, NULL);
    pthread_mutex_lock(&pool.lock);
    pool.made++;
    fall_asleep(&self);
    pthread_cond_signal(&pool.arrived);
    for (;;) {
        while (!self.loop) pthread_cond_wait(&self.woken, &pool.lock);
        task_loop *work = self.loop;
        pthread_mutex_unlock(&pool.lock);
        const double seconds = run_timed(work, self.worker);
        pthread_mutex_lock(&pool.lock);
        work->task_seconds += seconds;
        pool.at_work--;
        if (--work->running == 0) pthread_cond_signal(&work->finished);
        fall_asleep(&self);
    }
    return NULL;
}

/* A child has only the thread that forked, and nobody who would open the lock. */
static void forget_threads(void)
{
    pthread_mutex_init(&pool.lock, NULL);
    pthread_cond_init(&pool.arrived, NULL);
    pool.sleeping = NULL;
    pool.sleeping_count = 0;
    pool.loops = NULL;
    pool.at_work = 0;
}

/* Makes a thread, and waits until it sleeps. The lock is held; others may take the thread first. */
static int make_thread(void)
{
    pthread_attr_t detached;
    pthread_t thread;
    int failure = pthread_attr_init(&detached);
    if (failure) return failure;
    pthread_attr_setdetachstate(&detached, PTHREAD_CREATE_DETACHED);
    const uint32_t made = pool.made;
    failure = pthread_create(&thread, &detached, serve, NULL);
    pthread_attr_destroy(&detached);
    while (!failure && pool.made == made) pthread_cond_wait(&pool.arrived, &pool.lock);
    return failure;
}

/* Loops at work at the same time share as many threads as the one among them may have that may have most. */
static uint32_t most_threads(void)
{
    uint32_t most = 0;
    for (const task_loop *loop = pool.loops; loop; loop = loop->older)
        if (loop->parallel->workers > most) most = loop->parallel->workers;
    return most;
}

/* Sets up to so many threads to work, which others leave; or none, where they cannot be made: an error number. */
static int start_threads(task_loop *loop, uint32_t count)
{
    int failure = 0;
    const uint32_t most = most_threads(), left = most > pool.at_work ? most - pool.at_work : 0;
    if (count > left) count = left;
    if (!pool.forks_safely) pool.forks_safely = pthread_atfork(NULL, NULL, forget_threads) == 0;
    while (!failure && pool.sleeping_count < count) failure = make_thread();
    for (uint32_t i = 0; !failure && i < count; i++) {
        pool_thread *thread = pool.sleeping;
        pool.sleeping = thread->next;
        pool.sleeping_count--;
        pool.at_work++;
        thread->worker = i + 1;
        thread->loop = loop;
        loop->running++;
        pthread_cond_signal(&thread->woken);
    }
    return failure;
}

/* The calling thread goes to work, and up to so many others. */
static int enter(task_loop *loop, uint32_t others)
{
    pthread_mutex_lock(&pool.lock);
    loop->older = pool.loops;
    pool.loops = loop;
    pool.at_work += !counts;
    const int failure = others > 0 ? start_threads(loop, others) : 0;
    pthread_mutex_unlock(&pool.lock);
    return failure;
}

/* Waits for the threads of the pool. */
static void leave(task_loop *loop)
{
    pthread_mutex_lock(&pool.lock);
    while (loop->running > 0) pthread_cond_wait(&loop->finished, &pool.lock);
    task_loop **place = &pool.loops;
    while (*place && *place != loop) place = &(*place)->older;
    if (*place) { /* else it was forgotten in a child */
        *place = loop->older;
        pool.at_work -= !counts;
    }
    pthread_mutex_unlock(&pool.lock);
}

/* ---- Loops ----------------------------------------------------------------------------------------------------- */

static double run_as_first(task_loop *loop)
{
    const bool counted = counts;
    counts = true;
    const double seconds = run_timed(loop, 0);
    counts = counted;
    return seconds;
}

static ca_status run_loop(task_loop *loop, uint32_t others, ca_error *error)
{
    const int failure = enter(loop, others);
    const double seconds = failure ? 0.0 : run_as_first(loop);
    leave(loop);
    if (failure)
        return ca_fail(error, CA_ERROR_THREADS, NULL, "the system gives no more threads, %u are wanted: %s",
                       others + 1, strerror(failure));
    loop->task_seconds += seconds;
    return ca_stop_check(loop->parallel->stop, error);
}

ca_status ca_parallel_for(const ca_parallel *parallel, uint32_t count, ca_parallel_task task, void *user,
                          ca_error *error)
{
    task_loop loop = {.parallel = parallel, .task = task, .user = user, .count = count};
    const uint32_t workers = parallel->workers < count ? parallel->workers : count;
    const double start = parallel->seconds ? ca_clock_thread_seconds() : 0.0;
    pthread_cond_init(&loop.finished, NULL);
    const ca_status status = run_loop(&loop, workers > 1 ? workers - 1 : 0, error);
    pthread_cond_destroy(&loop.finished);
    if (!parallel->seconds) return status;
    parallel->seconds->tasks += loop.task_seconds;
    parallel->seconds->calling_thread += ca_clock_thread_seconds() - start;
    return status;
}

void ca_parallel_surely(uint32_t workers, uint32_t count, ca_parallel_task task, void *user)
{
    ca_parallel parallel = {.workers = workers, .stop = ca_loading_wanted_until()};
    if (ca_parallel_for(&parallel, count, task, user, NULL) != CA_ERROR_THREADS) return;
    parallel.workers = 1;
    const ca_status status = ca_parallel_for(&parallel, count, task, user, NULL);
    assert(status != CA_ERROR_THREADS);
    (void)status;
}

/* ---- Ranges ---------------------------------------------------------------------------------------------------- */

typedef struct range_loop {
    ca_range_task task;
    void *user;
    size_t count, size;
} range_loop;

static void run_range(void *user, uint32_t number, uint32_t worker)
{
    (void)worker;
    const range_loop *loop = user;
    const size_t begin = number * loop->size, left = loop->count - begin;
    loop->task(loop->user, (ca_range){begin, left < loop->size ? loop->count : begin + loop->size, number});
}

static size_t range_size(size_t count)
{
    const size_t size = (count + CA_RANGES - 1) / CA_RANGES;
    return size < CA_RANGE_LEAST ? CA_RANGE_LEAST : (size + 63) / 64 * 64;
}

uint32_t ca_parallel_ranges(size_t count, ca_range_task task, void *user)
{
    range_loop loop = {task, user, count, range_size(count)};
    const uint32_t ranges = (uint32_t)((count + loop.size - 1) / loop.size);
    if (ranges == 1)
        run_range(&loop, 0, 0);
    else if (ranges > 1)
        ca_parallel_surely(ca_processors(), ranges, run_range, &loop);
    return ranges;
}
