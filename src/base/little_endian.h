/* Numbers as bytes, the lowest first, whatever the machine. */
#ifndef CA_BASE_LITTLE_ENDIAN_H
#define CA_BASE_LITTLE_ENDIAN_H

#include <stdint.h>
#include <string.h>

/* The lowest `count` bytes of a number. */
static inline void ca_put_bytes(unsigned char *bytes, uint64_t value, int count)
{
    for (int i = 0; i < count; i++) bytes[i] = (unsigned char)(value >> (8 * i));
}

static inline uint64_t ca_get_bytes(const unsigned char *bytes, int count)
{
    uint64_t value = 0;
    for (int i = 0; i < count; i++) value |= (uint64_t)bytes[i] << (8 * i);
    return value;
}

static inline void ca_put_u32(unsigned char bytes[4], uint32_t value) { ca_put_bytes(bytes, value, 4); }

static inline uint32_t ca_get_u32(const unsigned char bytes[4]) { return (uint32_t)ca_get_bytes(bytes, 4); }

static inline void ca_put_u64(unsigned char bytes[8], uint64_t value) { ca_put_bytes(bytes, value, 8); }

static inline uint64_t ca_get_u64(const unsigned char bytes[8]) { return ca_get_bytes(bytes, 8); }

/* The bits of a double, which all machines of today agree on (IEEE 754 binary64). */
static inline uint64_t ca_double_bits(double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

static inline double ca_bits_double(uint64_t bits)
{
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

#endif
