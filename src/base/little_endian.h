/* Numbers as bytes, the lowest first, whatever the machine. */
#ifndef CA_BASE_LITTLE_ENDIAN_H
#define CA_BASE_LITTLE_ENDIAN_H

#include <stdint.h>
#include <string.h>

static inline void ca_put_u32(unsigned char bytes[4], uint32_t value)
{
    for (int i = 0; i < 4; i++) bytes[i] = (unsigned char)(value >> (8 * i));
}

static inline uint32_t ca_get_u32(const unsigned char bytes[4])
{
    uint32_t value = 0;
    for (int i = 0; i < 4; i++) value |= (uint32_t)bytes[i] << (8 * i);
    return value;
}

static inline void ca_put_u64(unsigned char bytes[8], uint64_t value)
{
    for (int i = 0; i < 8; i++) bytes[i] = (unsigned char)(value >> (8 * i));
}

static inline uint64_t ca_get_u64(const unsigned char bytes[8])
{
    uint64_t value = 0;
    for (int i = 0; i < 8; i++) value |= (uint64_t)bytes[i] << (8 * i);
    return value;
}

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
