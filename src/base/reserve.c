#define _GNU_SOURCE /* MAP_ANONYMOUS */
#include "base/reserve.h"

#include "base/memory.h"
#include "base/stop.h"

#include <assert.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdint.h>
#include <sys/mman.h>

enum { ALIGNMENT = 64, PAGE = 4096 };

/* Before each block. */
typedef struct block_head {
    size_t bytes;  /* of the block, with the head */
    size_t before; /* offset of the head before; SIZE_MAX: this is the first */
    bool freed;
    _Alignas(ALIGNMENT) unsigned char block[];
} block_head;

/* At the start of its own memory. */
struct ca_reserve {
    struct ca_reserve *next;
    size_t bytes; /* of all of it, whole pages */
    size_t top;   /* offset behind the last block */
    size_t last;  /* offset of its head; SIZE_MAX: there is none */
    size_t most, missed;
    void *heap; /* owned; until it is opened */
    bool released;
};

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static ca_reserve *all;     /* guarded by the lock, as what is in them */
static atomic_size_t count; /* of them: most processes have none, and need not ask */
static _Thread_local ca_reserve *opened;

static size_t round_up(size_t size, size_t to) { return (size + to - 1) / to * to; }

static size_t first_offset(void) { return round_up(sizeof(ca_reserve), ALIGNMENT); }

static block_head *head_at(ca_reserve *reserve, size_t offset) { return (block_head *)((char *)reserve + offset); }

/* Has the system give all pages, which takes long enough to ask now and then. */
static ca_status take_pages(char *memory, size_t bytes, const int *stop, ca_error *error)
{
    enum { BETWEEN_QUESTIONS = 1 << 24 };
    for (size_t at = 0; at < bytes; at += PAGE) {
        if (at % BETWEEN_QUESTIONS == 0) CA_TRY(ca_stop_check(stop, error));
        *(volatile char *)(memory + at) = 0;
    }
    return CA_OK;
}

ca_status ca_reserve_create(ca_reserve **reserve, size_t bytes, const char *what, const int *stop, ca_error *error)
{
    *reserve = NULL;
    if (bytes > SIZE_MAX / 2) return ca_fail_memory(error, what);
    const size_t size = round_up(bytes + first_offset(), PAGE);
    void *memory = mmap(NULL, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) return ca_fail_memory(error, what);
    const ca_status status = take_pages(memory, size, stop, error);
    if (status != CA_OK) {
        munmap(memory, size);
        return status;
    }
    ca_reserve *made = memory;
    *made = (ca_reserve){.bytes = size, .top = first_offset(), .last = SIZE_MAX};
    made->heap = ca_alloc(CA_RESERVE_HEAP_BYTES, 1);
    if (!made->heap) {
        munmap(memory, size);
        return ca_fail_memory(error, what);
    }
    pthread_mutex_lock(&lock);
    made->next = all;
    all = made;
    atomic_fetch_add(&count, 1);
    pthread_mutex_unlock(&lock);
    *reserve = made;
    return CA_OK;
}

/* The lock is held. */
static void unmap(ca_reserve *reserve)
{
    ca_reserve **place = &all;
    while (*place != reserve) place = &(*place)->next;
    *place = reserve->next;
    atomic_fetch_sub(&count, 1);
    munmap(reserve, reserve->bytes);
}

/* What lies behind the last block goes back. The lock is held. */
static void trim(ca_reserve *reserve)
{
    const size_t kept = round_up(reserve->top, PAGE);
    if (kept < reserve->bytes) munmap((char *)reserve + kept, reserve->bytes - kept);
    reserve->bytes = kept;
}

void ca_reserve_release(ca_reserve *reserve)
{
    if (!reserve) return;
    ca_reserve_close(reserve);
    ca_free(reserve->heap);
    reserve->heap = NULL;
    pthread_mutex_lock(&lock);
    reserve->released = true;
    if (reserve->last == SIZE_MAX)
        unmap(reserve);
    else
        trim(reserve);
    pthread_mutex_unlock(&lock);
}

void ca_reserve_open(ca_reserve *reserve)
{
    assert(!opened || opened == reserve || !reserve);
    if (!reserve) return;
    ca_free(reserve->heap);
    reserve->heap = NULL;
    opened = reserve;
}

void ca_reserve_close(ca_reserve *reserve)
{
    if (opened == reserve) opened = NULL;
}

size_t ca_reserve_missed(const ca_reserve *reserve) { return reserve->missed; }
size_t ca_reserve_most_used(const ca_reserve *reserve) { return reserve->most; }

/* ---- Blocks ---------------------------------------------------------------------------------------------------- */

void *ca_reserve_take(size_t bytes)
{
    ca_reserve *reserve = opened;
    if (!reserve) return NULL;
    void *block = NULL;
    pthread_mutex_lock(&lock);
    if (bytes < reserve->bytes && round_up(bytes, ALIGNMENT) + sizeof(block_head) <= reserve->bytes - reserve->top) {
        block_head *head = head_at(reserve, reserve->top);
        *head = (block_head){.bytes = round_up(bytes, ALIGNMENT) + sizeof *head, .before = reserve->last};
        reserve->last = reserve->top;
        reserve->top += head->bytes;
        if (reserve->top > reserve->most) reserve->most = reserve->top;
        block = head->block;
    } else {
        reserve->missed += bytes;
    }
    pthread_mutex_unlock(&lock);
    return block;
}

/* The lock is held; NULL: none of them. */
static ca_reserve *reserve_of(const void *memory)
{
    const uintptr_t place = (uintptr_t)memory;
    ca_reserve *reserve = all;
    while (reserve && (place < (uintptr_t)reserve || place >= (uintptr_t)reserve + reserve->bytes))
        reserve = reserve->next;
    return reserve;
}

static size_t offset_of_head(const ca_reserve *reserve, const void *memory)
{
    return (uintptr_t)memory - (uintptr_t)reserve - offsetof(block_head, block);
}

size_t ca_reserve_block_bytes(const void *memory)
{
    if (!memory || atomic_load_explicit(&count, memory_order_relaxed) == 0) return 0;
    pthread_mutex_lock(&lock);
    ca_reserve *reserve = reserve_of(memory);
    const size_t bytes =
        reserve ? head_at(reserve, offset_of_head(reserve, memory))->bytes - offsetof(block_head, block) : 0;
    pthread_mutex_unlock(&lock);
    return bytes;
}

bool ca_reserve_give_back(void *memory)
{
    if (!memory || atomic_load_explicit(&count, memory_order_relaxed) == 0) return false;
    pthread_mutex_lock(&lock);
    ca_reserve *reserve = reserve_of(memory);
    if (reserve) head_at(reserve, offset_of_head(reserve, memory))->freed = true;
    while (reserve && reserve->last != SIZE_MAX && head_at(reserve, reserve->last)->freed) {
        reserve->top = reserve->last;
        reserve->last = head_at(reserve, reserve->last)->before;
    }
    if (reserve && reserve->released) {
        if (reserve->last == SIZE_MAX)
            unmap(reserve);
        else
            trim(reserve);
    }
    pthread_mutex_unlock(&lock);
    return reserve != NULL;
}
