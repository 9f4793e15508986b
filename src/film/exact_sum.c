#include "film/exact_sum.h"

#include "base/little_endian.h"
#include "math/numeric.h"

#include <assert.h>
#include <math.h>
#include <stdbool.h>

enum { TOP = CA_EXACT_SUM_WORDS - 1, LOWEST_EXPONENT = -149 };

/* Adds `low` to words[word] and `high` to the next one, and carries on for as long as there is a carry. */
static void add_at(ca_exact_sum *sum, int word, uint64_t low, uint64_t high)
{
    sum->words[word] += low;
    uint64_t carry = high + (sum->words[word] < low); /* high < 2^24: does not overflow */
    for (int i = word + 1; carry && i <= TOP; i++) {
        sum->words[i] += carry;
        carry = sum->words[i] < carry;
    }
}

static void subtract_at(ca_exact_sum *sum, int word, uint64_t low, uint64_t high)
{
    const bool borrowed = sum->words[word] < low;
    sum->words[word] -= low;
    uint64_t borrow = high + borrowed;
    for (int i = word + 1; borrow && i <= TOP; i++) {
        const bool next = sum->words[i] < borrow;
        sum->words[i] -= borrow;
        borrow = next;
    }
}

void ca_exact_sum_add(ca_exact_sum *sum, float value)
{
    assert(isfinite(value));
    const uint32_t bits = ca_float_bits(value), exponent = bits >> 23 & 0xff;
    /* Subnormal numbers have the exponent of the smallest normal ones, without their leading bit. */
    const uint64_t mantissa = (bits & 0x7fffff) | (exponent ? 0x800000 : 0);
    const uint32_t shift = exponent ? exponent - 1 : 0;
    const int word = (int)(shift / 64);
    const uint32_t offset = shift % 64;
    const uint64_t low = mantissa << offset, high = offset > 40 ? mantissa >> (64 - offset) : 0;
    if (bits >> 31)
        subtract_at(sum, word, low, high);
    else
        add_at(sum, word, low, high);
}

void ca_exact_sum_add_sum(ca_exact_sum *sum, const ca_exact_sum *other)
{
    uint64_t carry = 0;
    for (int i = 0; i <= TOP; i++) {
        const uint64_t with_carry = other->words[i] + carry;
        carry = with_carry < carry;
        sum->words[i] += with_carry;
        carry += sum->words[i] < with_carry;
    }
}

static ca_exact_sum negative(const ca_exact_sum *sum)
{
    ca_exact_sum result;
    uint64_t carry = 1;
    for (int i = 0; i <= TOP; i++) {
        result.words[i] = ~sum->words[i] + carry;
        carry = carry && result.words[i] == 0;
    }
    return result;
}

/* Of a sum that is not negative. The 64 bits below its highest one, with the lowest set if any bit further down is,
 * are enough to round to the 53 of a double: the conversion of integers does that. */
static double value_of(const ca_exact_sum *sum)
{
    int top = TOP;
    while (top > 0 && sum->words[top] == 0) top--;
    uint64_t bits = sum->words[top];
    if (top == 0) return ldexp((double)bits, LOWEST_EXPONENT);
    const int zeros = __builtin_clzll(bits);
    bool rest = zeros ? (sum->words[top - 1] << zeros) != 0 : sum->words[top - 1] != 0;
    for (int i = top - 2; i >= 0; i--) rest = rest || sum->words[i] != 0;
    if (zeros) bits = bits << zeros | sum->words[top - 1] >> (64 - zeros);
    return ldexp((double)(bits | rest), LOWEST_EXPONENT + 64 * top - zeros);
}

double ca_exact_sum_value(const ca_exact_sum *sum)
{
    if (sum->words[TOP] >> 63 == 0) return value_of(sum);
    const ca_exact_sum positive = negative(sum);
    return -value_of(&positive);
}

void ca_exact_sum_write(const ca_exact_sum *sum, unsigned char bytes[CA_EXACT_SUM_BYTES])
{
    for (size_t i = 0; i <= TOP; i++) ca_put_u64(bytes + 8 * i, sum->words[i]);
}

ca_exact_sum ca_exact_sum_read(const unsigned char bytes[CA_EXACT_SUM_BYTES])
{
    ca_exact_sum sum;
    for (size_t i = 0; i <= TOP; i++) sum.words[i] = ca_get_u64(bytes + 8 * i);
    return sum;
}
