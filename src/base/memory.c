#define _DEFAULT_SOURCE /* madvise */
#include "base/memory.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

#define HUGE_PAGE ((size_t)2 << 20)
#define PAGE ((size_t)4096)
#define CACHE_LINE ((size_t)64)

static atomic_long fail_countdown = -1;

static bool allocation_fails(void)
{
    if (atomic_load_explicit(&fail_countdown, memory_order_relaxed) < 0) return false;
    return atomic_fetch_sub(&fail_countdown, 1) == 0;
}

void ca_memory_fail_after(long count) { atomic_store(&fail_countdown, count); }

static bool byte_count(size_t count, size_t size, size_t *bytes)
{
    if (__builtin_mul_overflow(count, size, bytes)) return false;
    if (*bytes == 0) *bytes = 1;
    return !allocation_fails();
}

void *ca_alloc(size_t count, size_t size)
{
    size_t bytes;
    return byte_count(count, size, &bytes) ? malloc(bytes) : NULL;
}

void *ca_alloc_zeroed(size_t count, size_t size)
{
    size_t bytes;
    return byte_count(count, size, &bytes) ? calloc(1, bytes) : NULL;
}

void *ca_alloc_large(size_t count, size_t size)
{
    size_t bytes;
    if (!byte_count(count, size, &bytes)) return NULL;
    if (bytes > SIZE_MAX - HUGE_PAGE) return NULL;
    if (bytes < HUGE_PAGE / 2) return aligned_alloc(CACHE_LINE, (bytes + CACHE_LINE - 1) / CACHE_LINE * CACHE_LINE);
    bytes = (bytes + HUGE_PAGE - 1) / HUGE_PAGE * HUGE_PAGE;
    void *memory = aligned_alloc(HUGE_PAGE, bytes);
    if (memory) madvise(memory, bytes, MADV_HUGEPAGE); /* a wish; refusing it is no failure */
    return memory;
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

void ca_free(void *memory) { free(memory); }

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

void *ca_array_grow(void *array, size_t *capacity, size_t needed, size_t size)
{
    if (needed <= *capacity && array) return array;
    size_t grown = *capacity > SIZE_MAX / 2 ? needed : 2 * *capacity;
    if (grown < needed) grown = needed;
    if (grown < 8) grown = 8;
    size_t bytes;
    if (!byte_count(grown, size, &bytes)) return NULL;
    void *moved = realloc(array, bytes);
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
