/* Loops over threads: each task once, within each other, at the same time, after a fork, stopped; and how many
 * processors there are. */
#define _GNU_SOURCE
#include "base/parallel.h"
#include "base/processors.h"

#include <pthread.h>
#include <sched.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

enum { TASKS = 5000, WORKERS = 7 };

typedef struct tally {
    atomic_uint runs[TASKS], by_worker[WORKERS];
    atomic_bool busy[WORKERS], clash;
    const ca_parallel *inner;
    int *stop;
} tally;

static void count(void *user, uint32_t task, uint32_t worker)
{
    tally *t = user;
    if (worker >= WORKERS || atomic_exchange(&t->busy[worker], true)) t->clash = true;
    t->runs[task]++;
    t->by_worker[worker]++;
    if (t->stop && task == TASKS / 2) __atomic_store_n(t->stop, 1, __ATOMIC_RELAXED);
    atomic_store(&t->busy[worker], false);
}

static void expect_all(const tally *t)
{
    assert_false(t->clash);
    for (int i = 0; i < TASKS; i++) assert_int_equal(t->runs[i], 1);
}

static void test_each_task_once(void **state)
{
    (void)state;
    for (uint32_t workers = 1; workers <= WORKERS; workers++) {
        tally t = {.clash = false};
        ca_parallel_seconds seconds = {0};
        const ca_parallel parallel = {.workers = workers, .seconds = workers % 2 ? &seconds : NULL};
        assert_int_equal(ca_parallel_for(&parallel, TASKS, count, &t, NULL), CA_OK);
        expect_all(&t);
        uint32_t sum = 0;
        for (int i = 0; i < WORKERS; i++) sum += t.by_worker[i];
        assert_int_equal(sum, TASKS);
        if (workers % 2) assert_true(seconds.tasks > 0.0 && seconds.calling_thread > 0.0);
        assert_int_equal(ca_parallel_for(&parallel, 0, count, &t, NULL), CA_OK);
    }
}

static void loop_within(void *user, uint32_t task, uint32_t worker)
{
    (void)worker;
    tally *t = user;
    const ca_parallel inner = {.workers = 3};
    if (ca_parallel_for(&inner, TASKS, count, &t[task], NULL) != CA_OK) t[task].clash = true;
}

static void *loop_beside(void *user)
{
    const ca_parallel outer = {.workers = 4};
    return ca_parallel_for(&outer, 4, loop_within, user, NULL) == CA_OK ? user : NULL;
}

static void test_loops_at_the_same_time(void **state)
{
    (void)state;
    enum { CALLERS = 3 };
    static tally tallies[CALLERS][4];
    pthread_t threads[CALLERS];
    for (int i = 0; i < CALLERS; i++) assert_int_equal(pthread_create(&threads[i], NULL, loop_beside, tallies[i]), 0);
    for (int i = 0; i < CALLERS; i++) {
        void *result;
        pthread_join(threads[i], &result);
        assert_ptr_equal(result, tallies[i]);
        for (int k = 0; k < 4; k++) expect_all(&tallies[i][k]);
    }
}

typedef struct occupation {
    atomic_uint waiting;
    atomic_bool end;
} occupation;

static void wait_for_end(void *user, uint32_t task, uint32_t worker)
{
    (void)task;
    (void)worker;
    occupation *o = user;
    o->waiting++;
    while (!o->end) sched_yield();
}

static void *occupy(void *user)
{
    const ca_parallel parallel = {.workers = 3};
    return ca_parallel_for(&parallel, 3, wait_for_end, user, NULL) == CA_OK ? user : NULL;
}

/* Tasks wait for each other in groups: a loop ends where so many workers came at least. */
typedef struct meeting {
    uint32_t size;
    atomic_uint arrived, workers; /* bits of those seen */
} meeting;

static void meet(void *user, uint32_t task, uint32_t worker)
{
    (void)task;
    meeting *m = user;
    const uint32_t own = atomic_fetch_add(&m->arrived, 1) / m->size;
    m->workers |= 1u << worker;
    while (m->arrived / m->size <= own) sched_yield();
}

static void expect_workers(uint32_t asked, uint32_t expected)
{
    meeting m = {.size = expected};
    const ca_parallel parallel = {.workers = asked};
    assert_int_equal(ca_parallel_for(&parallel, 40 * expected, meet, &m, NULL), CA_OK);
    assert_int_equal(m.workers, (1u << expected) - 1);
}

/* Three threads are at work: who may have three gets none beside his own, who may have five one; then all. */
static void test_loops_share_threads(void **state)
{
    (void)state;
    occupation o = {.end = false};
    pthread_t thread;
    void *result;
    expect_workers(3, 3);
    assert_int_equal(pthread_create(&thread, NULL, occupy, &o), 0);
    while (o.waiting < 3) sched_yield();
    expect_workers(3, 1);
    expect_workers(5, 2);
    expect_workers(2, 1);
    o.end = true;
    pthread_join(thread, &result);
    assert_ptr_equal(result, &o);
    expect_workers(3, 3);
}

static void test_stop(void **state)
{
    (void)state;
    int stop = 0;
    tally t = {.stop = &stop};
    const ca_parallel parallel = {.workers = 2, .stop = &stop};
    ca_error error = {""};
    assert_int_equal(ca_parallel_for(&parallel, TASKS, count, &t, &error), CA_ERROR_INTERRUPTED);
    uint32_t runs = 0;
    for (int i = 0; i < TASKS; i++) runs += t.runs[i];
    assert_true(runs > TASKS / 2 && runs < TASKS);
    /* It was the last task that asked: it may have left something undone. */
    stop = 0;
    const ca_parallel alone = {.workers = 1, .stop = &stop};
    assert_int_equal(ca_parallel_for(&alone, TASKS / 2 + 1, count, &t, &error), CA_ERROR_INTERRUPTED);
}

typedef struct range_tally {
    size_t count;
    atomic_uint elements, numbers[CA_RANGES];
    atomic_bool wrong;
} range_tally;

static void count_range(void *user, ca_range range)
{
    range_tally *t = user;
    const bool inside = range.number < CA_RANGES && range.begin < range.end && range.end <= t->count;
    if (!inside || range.begin % 64 != 0 || (range.number == 0) != (range.begin == 0)) t->wrong = true;
    if (!inside) return;
    t->elements += (unsigned)(range.end - range.begin);
    t->numbers[range.number]++;
}

/* Ranges cover all elements once, whatever their number; they are not too many. */
static void test_ranges(void **state)
{
    (void)state;
    static const size_t counts[] = {0, 1, 64, CA_RANGE_LEAST, CA_RANGE_LEAST + 1, 3 * CA_RANGE_LEAST - 1, 3000000,
                                    CA_RANGE_LEAST * CA_RANGES, CA_RANGE_LEAST * CA_RANGES + 1, 100000007};
    for (size_t i = 0; i < sizeof counts / sizeof counts[0]; i++) {
        range_tally t = {.count = counts[i]};
        const uint32_t ranges = ca_parallel_ranges(counts[i], count_range, &t);
        assert_true(ranges <= CA_RANGES && (ranges > 0) == (counts[i] > 0) && !t.wrong);
        assert_int_equal(t.elements, counts[i]);
        for (uint32_t k = 0; k < CA_RANGES; k++) assert_int_equal(t.numbers[k], k < ranges);
    }
}

/* The child has none of its parent's threads. */
static void test_after_a_fork(void **state)
{
    (void)state;
    const pid_t child = fork();
    if (child == 0) {
        static tally t;
        const ca_parallel parallel = {.workers = 3};
        alarm(20);
        _exit(ca_parallel_for(&parallel, TASKS, count, &t, NULL) == CA_OK && t.runs[TASKS - 1] == 1 ? 0 : 1);
    }
    int status = 1;
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_int_equal(status, 0);
}

/* ---- Processors ------------------------------------------------------------------------------------------------ */

#define GROUPS CA_BUILD_DIR "/tests/groups"

static void put(const char *name, const char *text)
{
    char path[512], command[600];
    snprintf(path, sizeof path, GROUPS "/%s", name);
    snprintf(command, sizeof command, "mkdir -p $(dirname %s)", path);
    assert_int_equal(system(command), 0);
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fputs(text, file);
    fclose(file);
}

static uint32_t quota(const char *groups)
{
    put("self", groups);
    return ca_processors_of_quota(GROUPS "/self", GROUPS);
}

static void test_quotas(void **state)
{
    (void)state;
    assert_int_equal(system("rm -rf " GROUPS), 0);
    assert_int_equal(ca_processors_of_quota(GROUPS "/self", GROUPS), UINT32_MAX);
    assert_int_equal(quota("0::/\n"), UINT32_MAX);
    put("a/cpu.max", "max 100000\n");
    put("a/b/cpu.max", "250000 100000\n");
    assert_int_equal(quota("0::/a\n"), UINT32_MAX);
    assert_int_equal(quota("0::/a/b\n"), 3);
    assert_int_equal(quota("0::/a/b/c/d\n"), 3); /* what a group above says */
    put("a/b/c/cpu.max", "50000 100000\n");
    assert_int_equal(quota("0::/a/b/c/d\n"), 1);
    put("cpu.max", "200000 100000\n"); /* the machine's path of a container is not there */
    assert_int_equal(quota("0::/system/docker-1\n"), 2);
    assert_int_equal(system("rm -r " GROUPS), 0);
    put("cpu,cpuacct/x/cpu.cfs_quota_us", "400000\n");
    put("cpu,cpuacct/x/cpu.cfs_period_us", "100000\n");
    put("cpu,cpuacct/cpu.cfs_quota_us", "-1\n");
    put("cpu,cpuacct/cpu.cfs_period_us", "100000\n");
    assert_int_equal(quota("7:memory:/x\n4:cpu,cpuacct:/x\n"), 4);
    assert_int_equal(quota("4:cpu,cpuacct:/y\n"), UINT32_MAX);
    put("cpu/x/cpu.cfs_quota_us", "90000\n");
    put("cpu/x/cpu.cfs_period_us", "100000\n");
    assert_int_equal(quota("3:cpuset:/x\n4:cpu:/x\n"), 1);
    assert_int_equal(quota("nothing of this kind\n::\n4:cpu\n"), UINT32_MAX);
    assert_int_equal(system("rm -r " GROUPS), 0);
}

static void test_affinity(void **state)
{
    (void)state;
    cpu_set_t all, one;
    assert_int_equal(sched_getaffinity(0, sizeof all, &all), 0);
    const uint32_t count_all = ca_processors();
    assert_true(count_all >= 1 && count_all <= (uint32_t)CPU_COUNT(&all));
    CPU_ZERO(&one);
    for (size_t i = 0; i < CPU_SETSIZE && CPU_COUNT(&one) == 0; i++)
        if (CPU_ISSET(i, &all)) CPU_SET(i, &one);
    assert_int_equal(sched_setaffinity(0, sizeof one, &one), 0);
    assert_int_equal(ca_processors(), 1);
    assert_int_equal(sched_setaffinity(0, sizeof all, &all), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_each_task_once),
        cmocka_unit_test(test_loops_at_the_same_time),
        cmocka_unit_test(test_loops_share_threads),
        cmocka_unit_test(test_stop),
        cmocka_unit_test(test_ranges),
        cmocka_unit_test(test_after_a_fork),
        cmocka_unit_test(test_quotas),
        cmocka_unit_test(test_affinity),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
