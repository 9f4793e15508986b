/* Memory: checked allocation, growing arrays and arenas.
 *
 * All heap memory of the project comes from here, so that tests can make the n-th allocation fail
 * (ca_memory_fail_after) and see that nothing leaks or crashes. What has to work when there is no more may be kept
 * back (base/reserve.h). Sizes are element counts times element sizes,
 * checked for overflow. Owners have create/destroy; ca_free(NULL) is allowed.
 *
 * Threads: allocation is thread-safe; an arena belongs to one thread. */
#ifndef CA_BASE_MEMORY_H
#define CA_BASE_MEMORY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* `count` elements of `size` bytes, uninitialised / zeroed, aligned to 16; NULL if it does not fit or overflows.
 * A count of 0 gives a valid pointer. */
void *ca_alloc(size_t count, size_t size);
void *ca_alloc_zeroed(size_t count, size_t size);
/* Uninitialised, aligned to a cache line, for tables that are read here and there: from 1 MiB on in whole huge pages
 * of 2 MiB, where the system has them, which saves most reads a walk through the page tables. Freed by ca_free like
 * all. */
void *ca_alloc_large(size_t count, size_t size);
/* Zeros, for tables that are filled as a whole: in huge pages likewise, which take the system less time at their
 * first touch. */
void *ca_alloc_large_zeroed(size_t count, size_t size);
void ca_free(void *memory);

/* The same for libraries that take functions to call, with a pointer of their user, which is not used: zlib's zalloc
 * and zfree. */
void *ca_alloc_for_library(void *user, unsigned count, unsigned size);
void ca_free_for_library(void *user, void *memory);

/* The array with room for `needed` elements: where it was, or moved with at least twice the capacity. NULL when out
 * of memory; the old array and `*capacity` then stay as they were. An array starts as NULL with capacity 0. Used as
 *
 *     type *items = ca_array_grow(list->items, &list->capacity, list->count + 1, sizeof *items);
 *     if (!items) return ...;
 *     list->items = items; */
void *ca_array_grow(void *array, size_t *capacity, size_t needed, size_t size);

/* What a thread may have allocated at a time for one purpose, such as reading a file that a stranger wrote: what is
 * beyond it fails like memory that is not there, and ca_fail_memory then says why. Memory that is freed meanwhile is
 * room again. */
typedef struct ca_memory_budget {
    size_t limit, used; /* bytes */
    size_t per_byte;    /* so much more is allowed for each byte of a file that is read (ca_memory_budget_read) */
    bool exceeded;
    const char *way; /* how to allow more, for the message */
    uint64_t *files; /* of ca_memory_budget_read: a set, 0 for empty places; likewise: */
    size_t file_count, file_places;
} ca_memory_budget;

/* Of this thread from now on, until the end; there is one at a time. */
void ca_memory_budget_begin(ca_memory_budget *budget);
void ca_memory_budget_end(void);
/* A file counts once; `file` tells it from others, 0: it was not read before. */
void ca_memory_budget_read(uint64_t file, size_t bytes);
/* The budget of this thread if it was exceeded, else NULL. */
const ca_memory_budget *ca_memory_budget_exceeded(void);

/* For tests: the allocation after `count` further ones fails, once; a negative count turns it off. */
void ca_memory_fail_after(long count);
/* The same, and all after it. */
void ca_memory_fail_from(long count);

/* Bytes handed out one after another and freed together. */
typedef struct ca_arena {
    struct ca_arena_block *first;
    size_t bytes; /* handed out so far */
} ca_arena;

/* Zeroed memory that lives until ca_arena_clear, aligned to 16; NULL when out of memory. */
void *ca_arena_alloc(ca_arena *arena, size_t count, size_t size);
char *ca_arena_strdup(ca_arena *arena, const char *text);
void ca_arena_clear(ca_arena *arena);

#endif
