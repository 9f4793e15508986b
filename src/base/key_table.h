/* A table from 64-bit keys, mostly hashes of what they stand for, to numbers. Keys are never taken out.
 *
 * Finding takes the same time however many there are. A table of zeros is empty. Threads: one at a time. */
#ifndef CA_BASE_KEY_TABLE_H
#define CA_BASE_KEY_TABLE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct ca_key_slot {
    uint64_t key; /* 0: free */
    uint32_t number;
} ca_key_slot;

typedef struct ca_key_table {
    ca_key_slot *slots; /* owned; `capacity` of them, a power of two or 0 */
    size_t count, capacity;
} ca_key_table;

void ca_key_table_destroy(ca_key_table *table);

/* False where the key is not known; *number then stays. The key 0 stands for nothing and is never known. */
bool ca_key_table_find(const ca_key_table *table, uint64_t key, uint32_t *number);
/* Adds a key that is neither known nor 0; false when out of memory. */
bool ca_key_table_add(ca_key_table *table, uint64_t key, uint32_t number);

#endif
