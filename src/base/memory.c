#define _DEFAULT_SOURCE /* madvise */
#include "base/memory.h"

#include "base/reserve.h"

#include <malloc.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

#define HUGE_PAGE ((size_t)2 << 20)
#define PAGE ((size_t)4096)
#define CACHE_LINE ((size_t)64)

static atomic_long fail_countdown = -1;
static atomic_bool fail_stays;

static bool allocation_fails(void)
{
    const long left = atomic_load_explicit(&fail_countdown, memory_order_relaxed);
    if (left < 0) return false;
    if (left == 0 && atomic_load(&fail_stays)) return true;
    return atomic_fetch_sub(&fail_countdown, 1) == 0;
}

void ca_memory_fail_after(long count)
{
    atomic_store(&fail_stays, false);
    atomic_store(&fail_countdown, count);
}

void ca_memory_fail_from(long count)
{
    atomic_store(&fail_stays, true);
    atomic_store(&fail_countdown, count);
}

/* ---- Budgets --------------------------------------------------------------------------------------------------- */

static _Thread_local ca_memory_budget *budget;

void ca_memory_budget_begin(ca_memory_budget *begun) { budget = begun; }

void ca_memory_budget_end(void)
{
    free(budget->files);
    budget->files = NULL;
    budget = NULL;
}

static bool add_place(uint64_t *files, size_t places, uint64_t file)
{
    size_t at = (size_t)file & (places - 1);
    while (files[at] != 0 && files[at] != file) at = (at + 1) & (places - 1);
    const bool is_new = files[at] == 0;
    files[at] = file;
    return is_new;
}

/* Twice the places, where half of them are taken. */
static bool grow_files(void)
{
    const size_t before = budget->file_places, places = before ? 2 * before : 256;
    if (2 * budget->file_count < before) return true;
    uint64_t *files = calloc(places, sizeof *files);
    if (!files) return false;
    for (size_t i = 0; i < before; i++)
        if (budget->files[i] != 0) add_place(files, places, budget->files[i]);
    free(budget->files);
    budget->files = files;
    budget->file_places = places;
    return true;
}

static bool is_new_file(uint64_t file)
{
    if (file == 0) return true;
    if (!grow_files() || !add_place(budget->files, budget->file_places, file)) return false;
    budget->file_count++;
    return true;
}

void ca_memory_budget_read(uint64_t file, size_t bytes)
{
    size_t more;
    if (!budget || !is_new_file(file)) return;
    if (__builtin_mul_overflow(bytes, budget->per_byte, &more) || more > SIZE_MAX - budget->limit)
        budget->limit = SIZE_MAX;
    else
        budget->limit += more;
}

const ca_memory_budget *ca_memory_budget_exceeded(void) { return budget && budget->exceeded ? budget : NULL; }

/* Of so many bytes more than `had`. */
static bool is_over_budget(size_t bytes, size_t had)
{
    if (!budget || bytes <= had || bytes - had <= budget->limit - budget->used) return false;
    budget->exceeded = true;
    return true;
}

/* Notes what the block really takes. */
static void *spend(void *memory)
{
    if (budget && memory) budget->used += malloc_usable_size(memory);
    if (budget && budget->used > budget->limit) budget->used = budget->limit; /* a little more than was asked for */
    return memory;
}

static void unspend(size_t bytes)
{
    if (budget) budget->used -= bytes < budget->used ? bytes : budget->used;
}

/* ---- Allocation ------------------------------------------------------------------------------------------------ */

static bool byte_count(size_t count, size_t size, size_t *bytes)
{
    if (__builtin_mul_overflow(count, size, bytes)) return false;
    if (*bytes == 0) *bytes = 1;
    return true;
}

void *ca_alloc(size_t count, size_t size)
{
    size_t bytes;
    if (!byte_count(count, size, &bytes)) return NULL;
    void *reserved = ca_reserve_take(bytes);
    if (reserved) return reserved;
    return allocation_fails() || is_over_budget(bytes, 0) ? NULL : spend(malloc(bytes));
}

void *ca_alloc_zeroed(size_t count, size_t size)
{
    size_t bytes;
    if (!byte_count(count, size, &bytes)) return NULL;
    void *reserved = ca_reserve_take(bytes);
    if (reserved) return memset(reserved, 0, bytes);
    return allocation_fails() || is_over_budget(bytes, 0) ? NULL : spend(calloc(1, bytes));
}

void *ca_alloc_large(size_t count, size_t size)
{
    size_t bytes;
    if (!byte_count(count, size, &bytes) || bytes > SIZE_MAX - HUGE_PAGE) return NULL;
    void *reserved = ca_reserve_take(bytes);
    if (reserved) return reserved;
    if (allocation_fails() || is_over_budget(bytes, 0)) return NULL;
    const size_t unit = bytes < HUGE_PAGE / 2 ? CACHE_LINE : HUGE_PAGE;
    bytes = (bytes + unit - 1) / unit * unit;
    void *memory = aligned_alloc(unit, bytes);
    if (memory && unit == HUGE_PAGE) madvise(memory, bytes, MADV_HUGEPAGE); /* a wish; refusing it is no failure */
    return spend(memory);
}

/* calloc's memory comes from the system as zeros, which a memset would touch twice. */
void *ca_alloc_large_zeroed(size_t count, size_t size)
{
    char *memory = ca_alloc_zeroed(count, size);
    const size_t bytes = count * size;
    if (!memory || bytes < HUGE_PAGE) return memory;
    const size_t before = (PAGE - (uintptr_t)memory % PAGE) % PAGE;
    madvise(memory + before, (bytes - before) / PAGE * PAGE, MADV_HUGEPAGE); /* likewise */
    return memory;
}

void ca_free(void *memory)
{
    if (ca_reserve_give_back(memory)) return;
    if (budget && memory) unspend(malloc_usable_size(memory));
    free(memory);
}

void *ca_alloc_for_library(void *user, unsigned count, unsigned size)
{
    (void)user;
    return ca_alloc(count, size);
}

void ca_free_for_library(void *user, void *memory)
{
    (void)user;
    ca_free(memory);
}

/* To a reserve, or from one to the heap, it is copied. */
static void *move_array(void *array, size_t used, size_t bytes)
{
    void *moved = ca_reserve_take(bytes);
    const bool was_reserved = ca_reserve_block_bytes(array) > 0;
    const size_t had = budget && array && !was_reserved ? malloc_usable_size(array) : 0;
    if (!moved && (allocation_fails() || is_over_budget(bytes, had))) return NULL;
    if (!moved && !was_reserved) {
        moved = realloc(array, bytes);
        if (moved) unspend(had);
        return spend(moved);
    }
    if (!moved) moved = spend(malloc(bytes));
    if (moved && array) {
        memcpy(moved, array, used);
        ca_free(array);
    }
    return moved;
}

void *ca_array_grow(void *array, size_t *capacity, size_t needed, size_t size)
{
    if (needed <= *capacity && array) return array;
    size_t grown = *capacity > SIZE_MAX / 2 ? needed : 2 * *capacity;
    if (grown < needed) grown = needed;
    if (grown < 8) grown = 8;
    size_t bytes;
    if (!byte_count(grown, size, &bytes)) return NULL;
    void *moved = move_array(array, *capacity * size, bytes);
    if (moved) *capacity = grown;
    return moved;
}

/* An arena is a list of blocks, newest first; each is filled from its start. */
struct ca_arena_block {
    struct ca_arena_block *next;
    size_t used, size;
    _Alignas(16) unsigned char bytes[];
};

enum { ARENA_BLOCK_BYTES = 64 * 1024 };

void *ca_arena_alloc(ca_arena *arena, size_t count, size_t size)
{
    size_t bytes;
    if (__builtin_mul_overflow(count, size, &bytes) || bytes > SIZE_MAX / 2) return NULL;
    bytes = (bytes + 15) & ~(size_t)15;
    struct ca_arena_block *block = arena->first;
    if (!block || block->size - block->used < bytes) {
        const size_t block_size = bytes > ARENA_BLOCK_BYTES ? bytes : ARENA_BLOCK_BYTES;
        block = ca_alloc(1, sizeof *block + block_size);
        if (!block) return NULL;
        block->next = arena->first;
        block->used = 0;
        block->size = block_size;
        arena->first = block;
    }
    void *result = block->bytes + block->used;
    block->used += bytes;
    arena->bytes += bytes;
    return memset(result, 0, bytes);
}

char *ca_arena_strdup(ca_arena *arena, const char *text)
{
    const size_t length = strlen(text) + 1;
    char *copy = ca_arena_alloc(arena, length, 1);
    return copy ? memcpy(copy, text, length) : NULL;
}

void ca_arena_clear(ca_arena *arena)
{
    for (struct ca_arena_block *block = arena->first; block;) {
        struct ca_arena_block *next = block->next;
        ca_free(block);
        block = next;
    }
    *arena = (ca_arena){0};
}
