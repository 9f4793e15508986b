#include "render/rank_work.h"

#include "base/clock.h"
#include "base/memory.h"
#include "base/stop.h"

#include <assert.h>
#include <string.h>

/* What another rank says when it asks for a range. */
typedef struct ca_work_report {
    uint64_t made; /* of the range before */
    bool spoilt;   /* its sums are */
    bool end;      /* it was asked to end */
    ca_status status;
    ca_error error;
} report;

/* What rank 0 answers. */
typedef enum order_kind { ORDER_WORK, ORDER_SEND, ORDER_END, ORDER_ADD, ORDER_DROP } order_kind;

typedef struct order {
    order_kind kind;
    bool hold; /* ORDER_WORK: until ORDER_ADD or ORDER_DROP */
    ca_work_range range;
} order;

/* In front of sums. */
typedef struct sums_head {
    uint64_t counts[CA_PART_COUNTS];
} sums_head;

static uint64_t length(ca_work_range range) { return range.end - range.begin; }

static uint32_t rows_in_batch(const ca_rank_sums *sums)
{
    const size_t rows = CA_RANK_BATCH / sums->row_bytes;
    return rows == 0 ? 1 : rows < sums->rows ? (uint32_t)rows : sums->rows;
}

ca_status ca_rank_work_create(ca_rank_work *work, const ca_ranks *ranks, const ca_rank_sums *sums, uint64_t first,
                              uint64_t made, ca_error *error)
{
    *work = (ca_rank_work){.ranks = ranks,
                           .sums = *sums,
                           .thread = pthread_self(),
                           .limit = UINT64_MAX,
                           .look = UINT64_MAX,
                           .run = 1,
                           .first = first,
                           .next = first + made,
                           .made = made,
                           .in_sums = made};
    work->batch = ca_alloc(rows_in_batch(sums), sums->row_bytes);
    work->helpers = ca_alloc_zeroed(ranks->count, sizeof *work->helpers);
    work->returned = ca_alloc(ranks->count, sizeof *work->returned);
    work->report = ca_alloc_zeroed(1, sizeof *work->report);
    if (work->batch && work->helpers && work->returned && work->report) return CA_OK;
    ca_rank_work_destroy(work);
    return ca_fail_memory(error, "the ranks");
}

void ca_rank_work_destroy(ca_rank_work *work)
{
    ca_free(work->batch);
    ca_free(work->helpers);
    ca_free(work->returned);
    ca_free(work->report);
    work->report = NULL;
    work->batch = NULL;
    work->helpers = NULL;
    work->returned = NULL;
}

static void give_order(ca_rank_work *work, uint32_t rank, order_kind kind)
{
    const order given = {.kind = kind};
    work->ranks->send(work->ranks->user, rank, &given, sizeof given);
}

/* ---- Handing out ----------------------------------------------------------------------------------------------- */

/* The first range is handed out in any case: a render has one pass at least. */
static bool is_closed(const ca_rank_work *work)
{
    if (work->closed || work->next >= work->limit) return true;
    if (work->next == work->first) return false;
    return ca_stop_asked(work->end_wanted) || (work->deadline > 0.0 && ca_clock_seconds() >= work->deadline);
}

/* The replicates of `run` passes stay whole. */
static bool hand_out(ca_rank_work *work, ca_work_range *range)
{
    if (is_closed(work)) return false;
    const uint64_t rest = work->limit - work->next, run = work->run - (work->next - work->first) % work->run;
    *range = (ca_work_range){work->next, work->next + (run < rest ? run : rest)};
    work->next = range->end;
    return true;
}

static bool has_reached_look(const ca_rank_work *work) { return work->next >= work->look; }

/* One that failed on another rank. */
static bool take_returned(ca_rank_work *work, uint64_t before, ca_work_range *range)
{
    for (uint32_t i = 0; i < work->returned_count; i++) {
        if (work->returned[i].begin >= before) continue;
        *range = work->returned[i];
        work->returned[i] = work->returned[--work->returned_count];
        return true;
    }
    return false;
}

bool ca_rank_work_take(ca_rank_work *work, ca_work_range *range)
{
    return take_returned(work, UINT64_MAX, range) || (!has_reached_look(work) && hand_out(work, range));
}

ca_status ca_rank_work_make(ca_rank_work *work, ca_work_range range, ca_error *error)
{
    uint64_t made;
    const ca_status status = work->make(work->make_user, range, &made, error);
    work->made += made;
    work->in_sums += made;
    if (made == length(range)) return status;
    work->closed = true;
    if (range.end == work->next) work->next = range.begin + made; /* nobody has made a later one */
    return status;
}

/* ---- Sums on their way ----------------------------------------------------------------------------------------- */

static void send_sums(ca_rank_work *work)
{
    const ca_rank_sums *sums = &work->sums;
    const ca_ranks *ranks = work->ranks;
    const uint32_t most = rows_in_batch(sums);
    sums_head head;
    sums->count(sums->user, head.counts);
    ranks->send(ranks->user, 0, &head, sizeof head);
    for (uint32_t row = 0, count; row < sums->rows; row += count) {
        count = sums->rows - row < most ? sums->rows - row : most;
        for (uint32_t i = 0; i < count; i++) sums->write_row(sums->user, row + i, work->batch + i * sums->row_bytes);
        ranks->send(ranks->user, 0, work->batch, count * sums->row_bytes);
    }
    sums->clear(sums->user);
}

static void receive_sums(ca_rank_work *work, uint32_t rank)
{
    const ca_rank_sums *sums = &work->sums;
    ca_helper *helper = &work->helpers[rank];
    const uint32_t most = rows_in_batch(sums);
    sums_head head;
    bool good = true;
    ca_ranks_expect(work->ranks, rank, &head, sizeof head);
    memcpy(helper->counts, head.counts, sizeof helper->counts);
    for (uint32_t row = 0, count; row < sums->rows; row += count) {
        count = sums->rows - row < most ? sums->rows - row : most;
        ca_ranks_expect(work->ranks, rank, work->batch, count * sums->row_bytes);
        for (uint32_t i = 0; i < count; i++)
            good = sums->add_row(sums->user, row + i, work->batch + i * sums->row_bytes, helper->unsent) && good;
    }
    assert(good); /* it is the same program */
    (void)good;
    work->in_sums += helper->unsent;
    helper->unsent = 0;
}

/* Before it goes on to passes beyond the border; those that it has made are all before. */
static void fetch_sums(ca_rank_work *work, uint32_t rank)
{
    ca_helper *helper = &work->helpers[rank];
    if (!work->gathering || helper->sent) return;
    helper->sent = true;
    if (helper->unsent == 0) return;
    give_order(work, rank, ORDER_SEND);
    receive_sums(work, rank);
}

/* ---- Answers --------------------------------------------------------------------------------------------------- */

static void begin_gathering(ca_rank_work *work)
{
    work->gathering = true;
    work->border = work->next < work->look ? work->next : work->look;
    for (uint32_t i = 1; i < work->ranks->count; i++) work->helpers[i].sent = false;
}

static void hand_to(ca_rank_work *work, uint32_t rank)
{
    ca_helper *helper = &work->helpers[rank];
    order given = {.kind = ORDER_WORK, .hold = has_reached_look(work)};
    if (helper->failed || work->waits) return;
    if (given.hold && !work->gathering) {
        begin_gathering(work);
        fetch_sums(work, rank);
    }
    /* Passes between an earlier border and the look, not sent: one that holds would never send them. It waits. */
    if (given.hold && helper->unsent > 0) return;
    if (!hand_out(work, &given.range)) return;
    helper->asks = false;
    helper->holds = given.hold;
    helper->range = given.range;
    work->ranks->send(work->ranks->user, rank, &given, sizeof given);
}

/* One for which there is nothing (yet) waits. */
static void answer(ca_rank_work *work, uint32_t rank)
{
    ca_helper *helper = &work->helpers[rank];
    if (!helper->asks) return;
    fetch_sums(work, rank);
    if (!work->ended) {
        hand_to(work, rank);
        return;
    }
    give_order(work, rank, ORDER_END);
    helper->asks = false;
    helper->gone = true;
}

static void answer_all(ca_rank_work *work)
{
    for (uint32_t i = 1; i < work->ranks->count; i++) answer(work, i);
}

void ca_rank_work_wait(ca_rank_work *work, bool waits)
{
    work->waits = waits;
    if (!waits) answer_all(work);
}

/* What failed goes to rank 0. */
static void note_failure(ca_rank_work *work, ca_helper *helper, const report *said)
{
    if (!helper->failed && said->made < length(helper->range))
        work->returned[work->returned_count++] =
            (ca_work_range){helper->range.begin + said->made, helper->range.end};
    if (!helper->failed && said->spoilt) {
        work->lost = true;
        work->closed = true;
        work->made -= helper->unsent;
        helper->unsent = 0;
    }
    helper->failed = true;
    if (work->status != CA_OK) return;
    work->status = said->status;
    work->failure = said->error;
}

/* What was held and dropped is neither made nor failed. */
static void hear(ca_rank_work *work, uint32_t rank)
{
    ca_helper *helper = &work->helpers[rank];
    report said;
    ca_ranks_expect(work->ranks, rank, &said, sizeof said);
    helper->unsent += said.made;
    work->made += said.made;
    if (said.status != CA_OK) note_failure(work, helper, &said);
    if (said.end) work->closed = work->end_asked = true;
    helper->range = (ca_work_range){0, 0};
    helper->asks = true;
    answer(work, rank);
}

static void answer_who_asks(ca_rank_work *work)
{
    ca_rank_message message;
    while (work->ranks->arrived(work->ranks->user, CA_ANY_RANK, &message)) hear(work, message.from);
}

/* ---- Gathering ------------------------------------------------------------------------------------------------- */

static bool is_gathered(const ca_rank_work *work)
{
    for (uint32_t i = 1; i < work->ranks->count; i++) {
        const ca_helper *helper = &work->helpers[i];
        if (length(helper->range) > 0 && helper->range.begin < work->border) return false;
        if (helper->unsent > 0 && !helper->sent) return false;
    }
    return true;
}

bool ca_rank_work_is_whole(const ca_rank_work *work)
{
    if (!work->ranks) return true;
    const uint64_t end = work->gathering ? work->border : work->next;
    return !work->lost && work->in_sums == end - work->first;
}

ca_status ca_rank_work_check_whole(const ca_rank_work *work, const char *path, const char *what, ca_error *error)
{
    if (ca_rank_work_is_whole(work)) return CA_OK;
    return ca_fail(error, CA_ERROR_FILE, NULL, "%s: not all %s from the first on could be made", path, what);
}

/* false: all before the border is in the sums, but a range that failed on another rank: rank 0 must make it first.
 * What failed beyond the border waits. */
static bool is_all_gathered(ca_rank_work *work, ca_work_range *range)
{
    if (!work->gathering) begin_gathering(work);
    answer_all(work);
    for (;;) {
        ca_rank_message message;
        if (take_returned(work, work->border, range)) return false;
        if (is_gathered(work)) return true;
        ca_ranks_wait(work->ranks, CA_ANY_RANK, &message);
        hear(work, message.from);
    }
}

ca_status ca_rank_work_gather(ca_rank_work *work, ca_error *error)
{
    ca_status status = CA_OK;
    ca_work_range range;
    while (!is_all_gathered(work, &range)) {
        const ca_status made = ca_rank_work_make(work, range, status == CA_OK ? error : NULL);
        if (status == CA_OK) status = made;
    }
    return status;
}

static void decide(ca_rank_work *work, order_kind kind, uint64_t before)
{
    for (uint32_t i = 1; i < work->ranks->count; i++) {
        ca_helper *helper = &work->helpers[i];
        if (!helper->holds || helper->range.begin >= before) continue;
        helper->holds = false;
        give_order(work, i, kind);
    }
}

void ca_rank_work_go_on(ca_rank_work *work, uint64_t look)
{
    work->gathering = false;
    work->look = look;
    decide(work, ORDER_ADD, look);
    answer_all(work);
}

static bool are_gone(const ca_rank_work *work)
{
    for (uint32_t i = 1; i < work->ranks->count; i++)
        if (!work->helpers[i].gone) return false;
    return true;
}

ca_status ca_rank_work_finish(ca_rank_work *work, ca_status status, ca_error *error)
{
    work->closed = true;
    const ca_status gathered = ca_rank_work_gather(work, status == CA_OK ? error : NULL);
    if (status == CA_OK) status = gathered;
    if (status != CA_OK || work->status == CA_OK) return status;
    if (error) *error = work->failure;
    return work->status;
}

/* What was handed out beyond the border was never made. */
void ca_rank_work_end(ca_rank_work *work)
{
    if (work->gathering) work->next = work->border;
    work->ended = work->closed = true;
    work->gathering = false;
    decide(work, ORDER_DROP, UINT64_MAX);
    answer_all(work);
    while (!are_gone(work)) {
        ca_rank_message message;
        ca_ranks_wait(work->ranks, CA_ANY_RANK, &message);
        hear(work, message.from);
    }
}

void ca_rank_work_count(const ca_rank_work *work, uint64_t counts[CA_PART_COUNTS])
{
    for (uint32_t i = 1; i < work->ranks->count; i++)
        for (int c = 0; c < CA_PART_COUNTS; c++) counts[c] += work->helpers[i].counts[c];
}

/* ---- The others ------------------------------------------------------------------------------------------------ */

static void ask(ca_rank_work *work)
{
    report *said = work->report;
    said->end = ca_stop_asked(work->end_wanted);
    work->ranks->send(work->ranks->user, 0, said, sizeof *said);
    said->made = 0;
}

/* Waits for the next range; false: all is over. */
static bool next_range(ca_rank_work *work, ca_work_range *range)
{
    order given;
    ask(work);
    for (;;) {
        ca_ranks_expect(work->ranks, 0, &given, sizeof given);
        if (given.kind == ORDER_END) return false;
        if (given.kind == ORDER_WORK) break;
        assert(given.kind == ORDER_SEND);
        send_sums(work);
    }
    *range = given.range;
    work->held = given.hold;
    work->decided = work->dropped = false;
    __atomic_store_n(&work->stop, 0, __ATOMIC_RELAXED);
    return true;
}

static void hear_decision(ca_rank_work *work)
{
    order given;
    ca_ranks_expect(work->ranks, 0, &given, sizeof given);
    assert(given.kind == ORDER_ADD || given.kind == ORDER_DROP);
    work->decided = true;
    work->dropped = given.kind == ORDER_DROP;
    if (work->dropped) __atomic_store_n(&work->stop, 1, __ATOMIC_RELAXED);
}

bool ca_rank_work_may_add(ca_rank_work *work)
{
    if (work->held && !work->decided) hear_decision(work);
    return !work->dropped;
}

/* What is said with the next request. The decision is heard before anything else is said. */
static void note_made(ca_rank_work *work, uint64_t made, bool spoilt, ca_status status, const ca_error *error)
{
    report *said = work->report;
    const bool wanted = ca_rank_work_may_add(work);
    said->made = made;
    if (status == CA_OK || !wanted) return;
    said->spoilt = spoilt;
    said->status = status;
    said->error = *error;
}

void ca_rank_work_help(ca_rank_work *work, uint64_t each)
{
    ca_work_range range;
    uint64_t made;
    while (next_range(work, &range)) {
        ca_error failure = {""};
        const ca_status status = work->make(work->make_user, range, &made, &failure);
        note_made(work, made, made % each != 0, status, &failure);
    }
}

/* ---- Between tasks --------------------------------------------------------------------------------------------- */

void ca_rank_work_between(void *user)
{
    ca_rank_work *work = user;
    ca_rank_message message;
    if (!pthread_equal(pthread_self(), work->thread)) return; /* a loop within another thread's task */
    if (work->ranks->rank == 0)
        answer_who_asks(work);
    else if (work->held && !work->decided && work->ranks->arrived(work->ranks->user, 0, &message))
        hear_decision(work);
}
