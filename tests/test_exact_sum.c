/* Exact sums against an oracle that keeps one counter for every bit of the floats: the sums themselves, their
 * rounding to double, any order, any split, bytes. */
#include "film/exact_sum.h"
#include "math/numeric.h"
#include "support/test_random.h"

#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

/* ---- The oracle ------------------------------------------------------------------------------------------------ */

enum { BITS = 330, LOWEST = -149 };

/* counters[i] counts 2^(i - 149), with sign. */
typedef struct oracle {
    int64_t counters[BITS];
} oracle;

static void oracle_add(oracle *o, float value)
{
    int exponent;
    const float fraction = frexpf(value, &exponent); /* [0.5, 1) */
    int64_t mantissa = (int64_t)ldexpf(fabsf(fraction), 24);
    for (int bit = exponent - 24 - LOWEST; mantissa; bit++, mantissa >>= 1) {
        if (!(mantissa & 1)) continue;
        assert_true(bit >= 0);
        o->counters[bit] += value < 0.0f ? -1 : 1;
    }
}

/* Carries until every counter is a bit; the sign is apart. */
static bool oracle_normalise(oracle *o)
{
    bool negative = false;
    for (int pass = 0; pass < 2; pass++) {
        int64_t carry = 0;
        for (int i = 0; i < BITS; i++) {
            const int64_t value = o->counters[i] + carry;
            o->counters[i] = value & 1;
            carry = (value - o->counters[i]) / 2;
        }
        if (carry >= 0) break;
        assert_int_equal(carry, -1); /* all in two's complement: turn the sign around once */
        negative = true;
        for (int i = 0; i < BITS; i++) o->counters[i] = 1 - o->counters[i];
        o->counters[0] += 1;
    }
    return negative;
}

/* The nearest double by school rounding. */
static double oracle_value(oracle o)
{
    const bool negative = oracle_normalise(&o);
    int top = BITS - 1;
    while (top >= 0 && o.counters[top] == 0) top--;
    if (top < 0) return 0.0;
    const int last = top >= 52 ? top - 52 : 0;
    uint64_t mantissa = 0;
    for (int i = top; i >= last; i--) mantissa = 2 * mantissa + (uint64_t)o.counters[i];
    const bool half = last > 0 && o.counters[last - 1];
    bool rest = false;
    for (int i = 0; i < last - 1; i++) rest = rest || o.counters[i];
    if (half && (rest || (mantissa & 1))) mantissa++;
    const double value = ldexp((double)mantissa, last + LOWEST);
    return negative ? -value : value;
}

static void expect_equal(const ca_exact_sum *sum, const oracle *o, const char *what)
{
    const double value = ca_exact_sum_value(sum), expected = oracle_value(*o);
    if (value != expected) fail_msg("%s: %a instead of %a", what, value, expected);
}

static double sum_of(const float *values, size_t count)
{
    ca_exact_sum sum = {{0}};
    for (size_t i = 0; i < count; i++) ca_exact_sum_add(&sum, values[i]);
    return ca_exact_sum_value(&sum);
}

#define SUM(...) sum_of((const float[]){__VA_ARGS__}, sizeof((const float[]){__VA_ARGS__}) / sizeof(float))

/* ---- Random values --------------------------------------------------------------------------------------------- */

/* Of exponents within `spread` of `middle` (or of all there are), both signs. */
static float random_float(ca_test_random *random, int spread)
{
    for (;;) {
        uint32_t bits = ca_test_random_u32(random);
        if (spread)
            bits = (bits & 0x807fffffu) | (uint32_t)(127 + (int)(bits >> 23 & 0xff) % spread - spread / 2) << 23;
        const float value = ca_bits_float(bits);
        if (isfinite(value)) return value;
    }
}

static void test_single_values(void **state)
{
    (void)state;
    static const float values[] = {
        0.0f,    -0.0f,    1.0f, -1.0f,   0x1p-149f,       -0x1p-149f,    FLT_MIN, FLT_MIN - 0x1p-149f,
        FLT_MAX, -FLT_MAX, 0.1f, -3e-40f, 0x1.fffffep-86f, 0x1.000002p41f};
    for (size_t i = 0; i < sizeof values / sizeof values[0]; i++) assert_true(SUM(values[i]) == (double)values[i]);
    for (int exponent = -149; exponent < 128; exponent++) {
        const float value = ldexpf(1.0f, exponent), dense = exponent > -126 ? ldexpf(0x1.aaaaabp0f, exponent) : value;
        assert_true(SUM(value) == (double)value && SUM(-value) == -(double)value);
        assert_true(SUM(dense) == (double)dense && SUM(-dense) == -(double)dense);
        assert_true(SUM(FLT_MAX, dense, -FLT_MAX) == (double)dense);
        assert_true(SUM(-FLT_MAX, -dense, FLT_MAX) == -(double)dense);
        assert_true(SUM(dense, value, -dense, -value) == 0.0);
    }
}

static void test_random_sums(void **state)
{
    (void)state;
    ca_test_random random = ca_test_random_seed(1);
    static const int spreads[] = {0, 1, 4, 40, 100, 250};
    for (int round = 0; round < 1200; round++) {
        ca_exact_sum sum = {{0}};
        oracle o = {{0}};
        const int spread = spreads[round % 6], count = 1 + (int)(ca_test_random_u32(&random) % 60);
        for (int i = 0; i < count; i++) {
            const float value = random_float(&random, spread);
            ca_exact_sum_add(&sum, value);
            oracle_add(&o, value);
        }
        expect_equal(&sum, &o, "a random sum");
    }
}

static void test_rounding(void **state)
{
    (void)state;
    const float big = 0x1p53f;
    /* Between two doubles, exactly: the even one. */
    assert_true(SUM(big, 1.0f) == 0x1p53);
    assert_true(SUM(big, 3.0f) == 0x1p53 + 4.0);
    assert_true(SUM(-big, -1.0f) == -0x1p53);
    assert_true(SUM(-big, -3.0f) == -0x1p53 - 4.0);
    /* And the smallest bit there is away from it, in whatever word that lies. */
    for (int exponent = -149; exponent < 0; exponent++) {
        const float little = ldexpf(1.0f, exponent);
        assert_true(SUM(big, 1.0f, little) == 0x1p53 + 2.0);
        assert_true(SUM(big, 1.0f, -little) == 0x1p53);
        assert_true(SUM(big, 3.0f, -little) == 0x1p53 + 2.0);
        assert_true(SUM(-big, -1.0f, -little) == -0x1p53 - 2.0);
    }
    /* At every place of the top bit, so at every place within a word. */
    for (int exponent = -149 + 53; exponent < 128; exponent++) {
        const float top = ldexpf(1.0f, exponent), half = ldexpf(1.0f, exponent - 53);
        const double next = ldexp(1.0 + 0x1p-52, exponent);
        assert_true(SUM(top, half) == (double)top);
        assert_true(SUM(top, half, half, half) == ldexp(1.0 + 0x1p-51, exponent));
        if (exponent > -149 + 53)
            assert_true(SUM(top, half, 0x1p-149f) == next && SUM(-top, -half, -0x1p-149f) == -next);
    }
}

static void test_order_and_parts_do_not_matter(void **state)
{
    (void)state;
    enum { COUNT = 400 };
    ca_test_random random = ca_test_random_seed(2);
    float values[COUNT];
    for (int i = 0; i < COUNT; i++) values[i] = random_float(&random, i % 2 ? 0 : 60);
    ca_exact_sum first = {{0}};
    for (int i = 0; i < COUNT; i++) ca_exact_sum_add(&first, values[i]);
    for (int round = 0; round < 200; round++) {
        ca_exact_sum parts[5] = {{{0}}}, sum = {{0}};
        for (int i = COUNT; i-- > 1;) {
            const uint32_t j = ca_test_random_u32(&random) % (uint32_t)(i + 1);
            const float swapped = values[i];
            values[i] = values[j];
            values[j] = swapped;
        }
        for (int i = 0; i < COUNT; i++) ca_exact_sum_add(&parts[ca_test_random_u32(&random) % 5], values[i]);
        for (int p = 0; p < 5; p++) {
            unsigned char bytes[CA_EXACT_SUM_BYTES];
            ca_exact_sum_write(&parts[(p + round) % 5], bytes);
            const ca_exact_sum read = ca_exact_sum_read(bytes);
            ca_exact_sum_add_sum(&sum, &read);
        }
        assert_memory_equal(&sum, &first, sizeof sum);
    }
}

/* From the lowest to the highest word. */
static void test_carries_between_sums(void **state)
{
    (void)state;
    for (int exponent = -149; exponent < 128; exponent++) {
        ca_exact_sum a = {{0}}, b = {{0}}, c = {{0}};
        ca_exact_sum_add(&a, ldexpf(1.0f, exponent));
        ca_exact_sum_add(&b, -ldexpf(1.0f, exponent));
        ca_exact_sum_add(&c, -0x1p-149f);
        ca_exact_sum_add_sum(&c, &b);
        ca_exact_sum_add_sum(&b, &a);
        ca_exact_sum_add_sum(&a, &c);
        assert_true(ca_exact_sum_value(&b) == 0.0 && ca_exact_sum_value(&a) == -0x1p-149);
    }
}

/* The room above the largest float: 2^42 of them, of either sign. */
static void test_headroom(void **state)
{
    (void)state;
    ca_exact_sum up = {{0}}, down = {{0}};
    ca_exact_sum_add(&up, FLT_MAX);
    ca_exact_sum_add(&down, -FLT_MAX);
    for (int i = 0; i < 42; i++) {
        const ca_exact_sum once = up, other = down;
        ca_exact_sum_add_sum(&up, &once);
        ca_exact_sum_add_sum(&down, &other);
    }
    assert_true(ca_exact_sum_value(&up) == ldexp((double)FLT_MAX, 42));
    assert_true(ca_exact_sum_value(&down) == -ldexp((double)FLT_MAX, 42));
    ca_exact_sum_add(&up, 0x1p-149f);
    ca_exact_sum_add_sum(&up, &down);
    assert_true(ca_exact_sum_value(&up) == 0x1p-149);
}

static void test_bytes(void **state)
{
    (void)state;
    ca_exact_sum sum = {{0}};
    unsigned char bytes[CA_EXACT_SUM_BYTES];
    ca_exact_sum_add(&sum, 1.0f); /* bit 149: byte 18, bit 5 */
    ca_exact_sum_add(&sum, 0x1p-149f);
    ca_exact_sum_write(&sum, bytes);
    for (int i = 0; i < CA_EXACT_SUM_BYTES; i++) assert_int_equal(bytes[i], i == 0 ? 1 : i == 18 ? 0x20 : 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_single_values),
        cmocka_unit_test(test_random_sums),
        cmocka_unit_test(test_rounding),
        cmocka_unit_test(test_order_and_parts_do_not_matter),
        cmocka_unit_test(test_carries_between_sums),
        cmocka_unit_test(test_headroom),
        cmocka_unit_test(test_bytes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
