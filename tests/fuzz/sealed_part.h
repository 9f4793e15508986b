/* The bytes of a part file, whose size in its head and hash at its end, which keep all but one of 2^64 mutations out,
 * are put right. */
#ifndef CA_FUZZ_SEALED_PART_H
#define CA_FUZZ_SEALED_PART_H

#include "base/hash.h"
#include "base/little_endian.h"

#include <stdlib.h>
#include <string.h>

/* The caller frees it; NULL when out of memory. */
static inline uint8_t *sealed_part(const uint8_t *data, size_t size)
{
    enum { SIZE_AT = 16, HASH = 8 }; /* behind the magic and the format */
    uint8_t *copy = malloc(size + 1);
    if (!copy) return NULL;
    memcpy(copy, data, size);
    if (size < SIZE_AT + 8 + HASH) return copy;
    ca_put_u64(copy + SIZE_AT, size);
    ca_put_u64(copy + size - HASH, ca_hash_bytes(CA_HASH_START, copy, size - HASH));
    return copy;
}

#endif
