#include "base/key_table.h"

#include "base/hash.h"
#include "base/memory.h"

void ca_key_table_destroy(ca_key_table *table)
{
    ca_free(table->slots);
    *table = (ca_key_table){0};
}

/* Where the key is, or would be; there is always a free slot. */
static ca_key_slot *find_slot(ca_key_slot *slots, size_t capacity, uint64_t key)
{
    size_t i = (size_t)ca_hash_add(CA_HASH_START, key) & (capacity - 1);
    while (slots[i].key != 0 && slots[i].key != key) i = (i + 1) & (capacity - 1);
    return &slots[i];
}

bool ca_key_table_find(const ca_key_table *table, uint64_t key, uint32_t *number)
{
    if (key == 0 || table->count == 0) return false;
    const ca_key_slot *slot = find_slot(table->slots, table->capacity, key);
    if (slot->key == 0) return false;
    *number = slot->number;
    return true;
}

static bool grow(ca_key_table *table)
{
    const size_t capacity = table->capacity ? 2 * table->capacity : 64;
    ca_key_slot *slots = ca_alloc_zeroed(capacity, sizeof *slots);
    if (!slots) return false;
    for (size_t i = 0; i < table->capacity; i++)
        if (table->slots[i].key != 0) *find_slot(slots, capacity, table->slots[i].key) = table->slots[i];
    ca_free(table->slots);
    table->slots = slots;
    table->capacity = capacity;
    return true;
}

bool ca_key_table_add(ca_key_table *table, uint64_t key, uint32_t number)
{
    if (2 * (table->count + 1) > table->capacity && !grow(table)) return false;
    *find_slot(table->slots, table->capacity, key) = (ca_key_slot){.key = key, .number = number};
    table->count++;
    return true;
}
