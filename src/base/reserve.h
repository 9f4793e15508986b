/* Memory that is kept back at the start for what must not fail at the end: making an image of what was rendered, and
 * writing it.
 *
 * A reserve is taken from the system as a whole, with its pages, so that it is there whatever others take meanwhile.
 * Where it is open, what its thread allocates by base/memory.h comes from it, as long as it has room, and else from
 * the heap as always. Its blocks are freed by ca_free like all, by any thread, and may live on after the reserve is
 * released; its memory goes back with the last of them, what lies behind the last block at once.
 *
 * Libraries that allocate by themselves (zlib within OpenEXR) find CA_RESERVE_HEAP_BYTES, freed when it opens.
 *
 * Blocks lie one behind the other; room comes back when all blocks behind it are freed. Threads: a reserve belongs to
 * one thread; any number of them may exist. */
#ifndef CA_BASE_RESERVE_H
#define CA_BASE_RESERVE_H

#include "base/status.h"

#include <stdbool.h>
#include <stddef.h>

typedef struct ca_reserve ca_reserve;

enum { CA_RESERVE_HEAP_BYTES = 1 << 20 };

/* `what` it is for, in errors. CA_ERROR_INTERRUPTED: stopped (base/stop.h; NULL: it cannot be). Cost: a quarter of a
 * second for each GiB. */
ca_status ca_reserve_create(ca_reserve **reserve, size_t bytes, const char *what, const int *stop, ca_error *error);
/* Closes it, too. NULL is allowed; likewise: */
void ca_reserve_release(ca_reserve *reserve);

/* One is open in a thread at a time. */
void ca_reserve_open(ca_reserve *reserve);
void ca_reserve_close(ca_reserve *reserve);

/* For tests: bytes that were asked for while it was open and did not fit, and the most that were in use at a time. */
size_t ca_reserve_missed(const ca_reserve *reserve);
size_t ca_reserve_most_used(const ca_reserve *reserve);

/* Of base/memory.c. A block of the open reserve, aligned to a cache line; NULL where none is open or it has no
 * room. */
void *ca_reserve_take(size_t bytes);
/* Bytes of a reserve's block from there on; 0: this is no block of a reserve. */
size_t ca_reserve_block_bytes(const void *memory);
/* false: this is no block of a reserve. */
bool ca_reserve_give_back(void *memory);

#endif
