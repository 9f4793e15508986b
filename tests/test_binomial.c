/* Exact statistics of yes-or-no answers against published values, closed forms and enumeration. */
#include "metrics/binomial.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

static void assert_near(double found, double expected, double tolerance)
{
    if (!(fabs(found - expected) <= tolerance)) fail_msg("%.12g instead of %.12g", found, expected);
}

/* All outcomes of `total` tries, one after the other. */
static double enumerated_tail(unsigned count, unsigned total, double p)
{
    double sum = 0.0;
    for (unsigned outcome = 0; outcome < 1u << total; outcome++) {
        unsigned successes = 0;
        double probability = 1.0;
        for (unsigned i = 0; i < total; i++) {
            const unsigned success = outcome >> i & 1;
            successes += success;
            probability *= success ? p : 1.0 - p;
        }
        if (successes >= count) sum += probability;
    }
    return sum;
}

static void test_tail(void **state)
{
    (void)state;
    static const double chances[] = {0.0, 1e-3, 0.2, 0.5, 0.83, 1.0};
    for (unsigned total = 0; total <= 10; total++)
        for (unsigned count = 0; count <= total + 1; count++)
            for (size_t i = 0; i < sizeof chances / sizeof chances[0]; i++)
                assert_near(ca_binomial_tail(count, total, chances[i]), enumerated_tail(count, total, chances[i]),
                            1e-13);
}

/* What R's binom.test(count, total) says, to the digits that it prints. */
static void test_interval(void **state)
{
    (void)state;
    static const struct {
        uint32_t count, total;
        double low, high;
    } known[] = {{5, 10, 0.1870860, 0.8129140}, {8, 10, 0.4439045, 0.9747893}, {1, 2, 0.01257912, 0.98742088}};
    double low, high;
    for (size_t i = 0; i < sizeof known / sizeof known[0]; i++) {
        ca_clopper_pearson(known[i].count, known[i].total, 0.05, &low, &high);
        assert_near(low, known[i].low, 1e-7);
        assert_near(high, known[i].high, 1e-7);
    }
    ca_clopper_pearson(0, 0, 0.05, &low, &high);
    assert_true(low == 0.0 && high == 1.0);
    for (uint32_t total = 1; total <= 200; total += 19) { /* closed at the ends */
        const double end = pow(0.025, 1.0 / total);
        ca_clopper_pearson(0, total, 0.05, &low, &high);
        assert_near(low, 0.0, 0.0);
        assert_near(high, 1.0 - end, 1e-12);
        ca_clopper_pearson(total, total, 0.05, &low, &high);
        assert_near(low, end, 1e-12);
        assert_near(high, 1.0, 0.0);
    }
}

/* The interval covers the true chance as often as it says, or more often, whatever that is. */
static void test_coverage(void **state)
{
    (void)state;
    enum { TOTAL = 12 };
    double low[TOTAL + 1], high[TOTAL + 1];
    for (uint32_t k = 0; k <= TOTAL; k++) ca_clopper_pearson(k, TOTAL, 0.05, &low[k], &high[k]);
    for (double p = 0.01; p < 1.0; p += 0.01) {
        double covered = 0.0;
        for (uint32_t k = 0; k <= TOTAL; k++)
            if (p >= low[k] && p <= high[k])
                covered += ca_binomial_tail(k, TOTAL, p) - ca_binomial_tail(k + 1, TOTAL, p);
        if (covered < 0.95) fail_msg("chance %g is covered with %g", p, covered);
    }
}

static void test_sign_test(void **state)
{
    (void)state;
    assert_near(ca_sign_test_two_sided(10, 2), 158.0 / 4096.0, 1e-14); /* 2 (66 + 12 + 1) / 2^12 */
    assert_near(ca_sign_test_two_sided(2, 10), 158.0 / 4096.0, 1e-14);
    assert_near(ca_sign_test_more(10, 2), 79.0 / 4096.0, 1e-14);
    assert_near(ca_sign_test_more(2, 10), 1.0 - 13.0 / 4096.0, 1e-14);
    assert_near(ca_sign_test_two_sided(3, 3), 1.0, 0.0);
    assert_near(ca_sign_test_two_sided(0, 0), 1.0, 0.0);
    assert_near(ca_sign_test_more(0, 0), 1.0, 0.0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_tail),
        cmocka_unit_test(test_interval),
        cmocka_unit_test(test_coverage),
        cmocka_unit_test(test_sign_test),
    };
    return cmocka_run_group_tests_name("binomial", tests, NULL, NULL);
}
