/* Who makes which pass (render/rank_work.h), with passes that are numbers: what is summed at every border, passes
 * that are held, ranges that stay together, and ranks that fail. */
#define _POSIX_C_SOURCE 200809L
#include "base/clock.h"
#include "base/little_endian.h"
#include "render/rank_work.h"
#include "support/test_random.h"
#include "support/thread_ranks.h"

#include <sched.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

/* A rank's sums: how many passes, and the sum of their numbers' squares, in a row each. */
typedef struct tally {
    uint64_t values[2];
} tally;

static void write_row(void *user, uint32_t row, unsigned char *bytes)
{
    ca_put_u64(bytes, ((const tally *)user)->values[row]);
}

static bool add_row(void *user, uint32_t row, const unsigned char *bytes, uint64_t made)
{
    const uint64_t value = ca_get_u64(bytes);
    ((tally *)user)->values[row] += value;
    return row == 1 || value == made;
}

static void clear(void *user) { memset(user, 0, sizeof(tally)); }

static void count(void *user, uint64_t counts[CA_PART_COUNTS])
{
    (void)user;
    memset(counts, 0, CA_PART_COUNTS * sizeof *counts);
    counts[0] = 1;
}

/* What is tried, the same on all ranks. */
typedef struct plan {
    uint64_t first, before, limit, look; /* passes [first, first + before) are there */
    uint32_t run, ranks, lateness;
    uint32_t failing; /* this rank fails in its second range, after so many passes of it: */
    uint64_t failing_after;
    bool spoils;
    uint32_t slow; /* this rank ends its first range after the others have made all before the look; 0: none */
    uint64_t made_by_others; /* atomic: the passes that ranks other than 0 and the slow one have made */
    uint64_t gather_at; /* rank 0 gathers once it has made so many passes; 0: only at the end */
    bool ends_at_look;
    bool waits; /* the others, until all have asked */
    uint32_t fails_beyond;      /* this rank fails in a range beyond the border, before rank 1 ends one before it */
    uint64_t gathering, failed; /* atomic: the border that rank 0 gathers for; it has failed */
    /* What became of it. */
    uint64_t border, made;
    bool whole;
    ca_status status;
    tally sums;
} plan;

static void add(tally *t, uint64_t pass)
{
    t->values[0]++;
    t->values[1] += pass * pass;
}

/* Squares of [begin, end). */
static uint64_t squares(uint64_t begin, uint64_t end)
{
    uint64_t sum = 0;
    for (uint64_t i = begin; i < end; i++) sum += i * i;
    return sum;
}

static void take_time(ca_test_random *random)
{
    const double until = ca_clock_seconds() + 1e-4 * (double)ca_test_random_float(random);
    while (ca_clock_seconds() < until) continue;
}

/* A rank at work. */
typedef struct rank {
    plan *p;
    ca_rank_work work;
    tally sums;
    uint32_t number, ranges; /* so many are made */
    ca_test_random random;
} rank;

/* Until the others have made theirs, and had time to ask for more. */
static void be_slow(const plan *p, uint64_t wanted)
{
    const struct timespec pause = {.tv_nsec = 10000000};
    while (__atomic_load_n(&p->made_by_others, __ATOMIC_ACQUIRE) < wanted) sched_yield();
    nanosleep(&pause, NULL);
}

static bool has_failed(const plan *p) { return __atomic_load_n(&p->failed, __ATOMIC_ACQUIRE) != 0; }

/* The first range of rank 1 ends when the other one has failed, and rank 0 has heard of it. */
static void wait_for_failure(const plan *p)
{
    const struct timespec pause = {.tv_nsec = 10000000};
    while (!has_failed(p)) sched_yield();
    nanosleep(&pause, NULL);
}

static bool fails_beyond_border(plan *p, uint64_t begin)
{
    const uint64_t border = __atomic_load_n(&p->gathering, __ATOMIC_ACQUIRE);
    if (border == 0 || begin < border || has_failed(p)) return false;
    __atomic_store_n(&p->failed, 1, __ATOMIC_RELEASE);
    return true;
}

/* ca_rank_work.make */
static ca_status make(void *user, ca_work_range range, uint64_t *made, ca_error *error)
{
    rank *r = user;
    plan *p = r->p;
    const uint64_t run = range.end - range.begin;
    const bool may_fail = r->number > 0 && r->number == p->failing, fails = may_fail && r->ranges == 1;
    assert_true(run <= p->run && range.end <= p->limit);
    assert_true((range.end - p->first) % p->run == 0 || range.end == p->limit);
    assert_true(!may_fail || r->ranges < 2); /* it gets no more */
    r->ranges++;
    if (p->slow > 0 && r->number == p->slow && r->ranges == 1) be_slow(p, p->look - 2);
    if (p->fails_beyond > 0 && r->number == 1 && r->ranges == 1) wait_for_failure(p);
    *made = 0;
    if (p->fails_beyond > 0 && r->number == p->fails_beyond && fails_beyond_border(p, range.begin))
        return ca_fail(error, CA_ERROR_MEMORY, NULL, "it failed");
    for (; *made < run; ++*made) {
        take_time(&r->random);
        ca_rank_work_between(&r->work);
        if (fails && *made == p->failing_after) return ca_fail(error, CA_ERROR_MEMORY, NULL, "it failed");
        if (!ca_rank_work_may_add(&r->work)) return CA_ERROR_INTERRUPTED;
        add(&r->sums, range.begin + *made);
        if (r->number > 0 && r->number != p->slow) __atomic_add_fetch(&p->made_by_others, 1, __ATOMIC_RELEASE);
    }
    return CA_OK;
}

static void expect_gathered(const plan *p, const ca_rank_work *work, const tally *t, uint64_t border)
{
    assert_true(ca_rank_work_is_whole(work));
    assert_true(t->values[0] == border - p->first && t->values[1] == squares(p->first, border));
    assert_true(work->in_sums == border - p->first);
}

static void lead(plan *p, rank *r)
{
    ca_rank_work *work = &r->work;
    ca_work_range range;
    ca_error error = {""};
    if (p->waits) {
        ca_rank_work_wait(work, true);
        for (uint32_t i = 1; i < p->ranks; i++)
            while (!work->helpers[i].asks) ca_rank_work_between(work);
        ca_rank_work_wait(work, false);
        for (uint32_t i = 1; i < p->ranks; i++) assert_false(work->helpers[i].asks); /* all have got a range */
    }
    /* The others make all until then. */
    while (p->failing > 0 && work->status == CA_OK && work->next <= work->look) ca_rank_work_between(work);
    for (uint64_t own = 0;; own++) {
        if (ca_rank_work_take(work, &range)) {
            assert_int_equal(ca_rank_work_make(work, range, NULL), CA_OK);
            if (own + 1 != p->gather_at) continue;
            while (p->slow > 0 && work->next + 1 < work->look) ca_rank_work_between(work); /* others work */
            while (p->fails_beyond > 0 && work->helpers[1].range.end == 0) ca_rank_work_between(work);
            __atomic_store_n(&p->gathering, work->next, __ATOMIC_RELEASE);
            assert_int_equal(ca_rank_work_gather(work, NULL), CA_OK);
            if (!work->lost) expect_gathered(p, work, &r->sums, work->border);
            ca_rank_work_go_on(work, work->look);
        } else if (work->next >= work->look && work->look < p->limit) {
            while (p->ends_at_look && work->next == work->look) ca_rank_work_between(work); /* one holds more */
            assert_int_equal(ca_rank_work_gather(work, NULL), CA_OK);
            expect_gathered(p, work, &r->sums, work->look);
            if (p->ends_at_look) break;
            ca_rank_work_go_on(work, work->look + 1 + ca_test_random_u32(&r->random) % 2);
        } else {
            break;
        }
    }
    p->status = ca_rank_work_finish(work, CA_OK, &error);
    assert_string_equal(error.message, p->status == CA_OK ? "" : "it failed");
    p->border = work->border;
    p->whole = ca_rank_work_is_whole(work);
    ca_rank_work_end(work);
    assert_true(ca_rank_work_is_whole(work) == p->whole && !ca_rank_work_is_open(work));
    assert_int_equal(ca_rank_work_check_whole(work, "x", "passes", NULL), p->whole ? CA_OK : CA_ERROR_FILE);
    p->made = work->made;
    p->sums = r->sums;
}

static void run_rank(void *user, const ca_ranks *ranks)
{
    plan *p = user;
    rank r = {.p = p, .number = ranks->rank, .random = ca_test_random_seed(100 + ranks->rank)};
    const ca_rank_sums sums = {&r.sums, 2, 8, write_row, add_row, clear, count};
    assert_int_equal(ca_rank_work_create(&r.work, ranks, &sums, p->first, p->before, NULL), CA_OK);
    r.work.limit = p->limit;
    r.work.look = p->look ? p->look : UINT64_MAX;
    r.work.run = p->run;
    r.work.make = make;
    r.work.make_user = &r;
    for (uint64_t i = 0; ranks->rank == 0 && i < p->before; i++) add(&r.sums, p->first + i);
    if (ranks->rank == 0)
        lead(p, &r);
    else
        ca_rank_work_help(&r.work, p->spoils ? p->run : 1);
    ca_rank_work_destroy(&r.work);
}

static void run(plan *p) { ca_run_ranks(p->ranks, p->lateness, run_rank, p); }

static void expect_all(const plan *p, uint64_t end)
{
    assert_true(p->whole && p->border == end);
    assert_true(p->sums.values[0] == end - p->first && p->sums.values[1] == squares(p->first, end));
}

/* ---- Tests ----------------------------------------------------------------------------------------------------- */

static void test_all_passes_once(void **state)
{
    (void)state;
    for (uint32_t ranks = 1; ranks <= 4; ranks++)
        for (uint32_t r = 1; r <= 3; r++) {
            plan p = {.first = 6 * r, .before = 3 * (r - 1), .limit = 100, .run = r, .ranks = ranks, .gather_at = 7};
            p.lateness = ranks == 3 ? 5 : 0;
            run(&p);
            expect_all(&p, 100);
            assert_true(p.status == CA_OK && p.made == p.border - p.first);
        }
}

/* What lies beyond a look is not in the sums before it is decided, nor after a decision to end. */
static void test_looks(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < 8; i++) {
        plan p = {.limit = 120, .look = 8, .run = 1, .ranks = 2 + i % 3};
        p.lateness = i / 3 * 4;
        p.gather_at = i % 2 * 5;
        run(&p);
        expect_all(&p, 120);
        p.ends_at_look = true;
        run(&p);
        expect_all(&p, 8);
        assert_true(p.made == 8);
    }
}

/* A rank that has made passes between the border and the look, when a slower one ends those before the border, comes
 * to the look first. */
static void test_border_before_look(void **state)
{
    (void)state;
    plan p = {.limit = 12, .look = 4, .run = 1, .ranks = 3, .slow = 1, .gather_at = 1};
    run(&p);
    expect_all(&p, 12);
}

/* What another rank fails to make, or the rest of it, rank 0 makes. */
static void test_failures(void **state)
{
    (void)state;
    for (uint64_t after = 0; after < 3; after++) {
        plan p = {.limit = 90, .run = 3, .ranks = 2, .failing = 1, .failing_after = after, .gather_at = after * 4};
        run(&p);
        expect_all(&p, 90);
        assert_int_equal(p.status, CA_ERROR_MEMORY);
    }
    plan held = {.limit = 40, .look = 1, .run = 1, .ranks = 2, .failing = 1};
    run(&held);
    expect_all(&held, 40);
    assert_int_equal(held.status, CA_ERROR_MEMORY);
}

/* Who asked while all had to wait gets a range as soon as nobody has to. */
static void test_waiting(void **state)
{
    (void)state;
    plan p = {.limit = 30, .run = 2, .ranks = 3, .waits = true};
    run(&p);
    expect_all(&p, 30);
}

/* What fails beyond the border, while a rank is still at work before it, is made after the sums were looked at. */
static void test_failure_beyond_border(void **state)
{
    (void)state;
    plan p = {.limit = 60, .run = 1, .ranks = 3, .gather_at = 1, .fails_beyond = 2};
    run(&p);
    expect_all(&p, 60);
    assert_true(p.failed && p.status == CA_ERROR_MEMORY);
}

/* Sums that are no use are not asked for, and nobody is told that all is there. */
static void test_spoilt_sums(void **state)
{
    (void)state;
    plan p = {.limit = 90, .run = 3, .ranks = 2, .failing = 1, .failing_after = 2, .spoils = true};
    run(&p);
    assert_true(!p.whole && p.status == CA_ERROR_MEMORY && p.sums.values[0] < p.border);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_all_passes_once),
        cmocka_unit_test(test_looks),
        cmocka_unit_test(test_border_before_look),
        cmocka_unit_test(test_failures),
        cmocka_unit_test(test_waiting),
        cmocka_unit_test(test_failure_beyond_border),
        cmocka_unit_test(test_spoilt_sums),
    };
    return cmocka_run_group_tests_name("who makes which pass", tests, NULL, NULL);
}
