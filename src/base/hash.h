/* A 64-bit hash of bytes: tells contents apart (a scene that was edited, a damaged file), not attackers.
 *
 * Eight bytes a step; each step is one-to-one in the hash and in the bytes, so a change within a single step always
 * changes the result. Pieces whose sizes are multiples of 8 may be added one after the other as if they were one. */
#ifndef CA_BASE_HASH_H
#define CA_BASE_HASH_H

#include "base/little_endian.h"

#include <stddef.h>

#define CA_HASH_START UINT64_C(0x243f6a8885a308d3) /* the first digits of pi's fraction */

/* The multiplier is 2^64 over the golden ratio, made odd. */
static inline uint64_t ca_hash_add(uint64_t hash, uint64_t value)
{
    hash = (hash ^ value) * UINT64_C(0x9e3779b97f4a7c15);
    return hash ^ (hash >> 29);
}

/* Adds bytes[0, size); a last piece of fewer than 8 goes in with its length. */
static inline uint64_t ca_hash_bytes(uint64_t hash, const void *bytes, size_t size)
{
    const unsigned char *data = bytes;
    for (; size >= 8; data += 8, size -= 8) hash = ca_hash_add(hash, ca_get_u64(data));
    if (size == 0) return hash;
    unsigned char last[8] = {0};
    memcpy(last, data, size);
    last[7] = (unsigned char)size;
    return ca_hash_add(hash, ca_get_u64(last));
}

/* Adds the bytes of a large array four chains at a time, as fast as memory gives them; another result than that of
 * ca_hash_bytes. */
static inline uint64_t ca_hash_array(uint64_t hash, const void *bytes, size_t size)
{
    const unsigned char *data = bytes;
    uint64_t chains[4] = {hash, hash + 1, hash + 2, hash + 3};
    for (; size >= sizeof chains; data += sizeof chains, size -= sizeof chains)
        for (size_t i = 0; i < 4; i++) chains[i] = ca_hash_add(chains[i], ca_get_u64(data + 8 * i));
    for (size_t i = 0; i < 4; i++) hash = ca_hash_add(hash, chains[i]);
    return ca_hash_bytes(hash, data, size);
}

#endif
