/* The error bar of one pixel: Student's quantile against tables, intervals by hand. Moments, neighbourhoods and
 * calibration: test_confidence.c. */
#include "film/confidence.h"
#include "support/expect_near.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>

#include <cmocka.h>

/* ---- Student's quantile ---------------------------------------------------------------------------------------- */

/* Upper critical values, as in the tables of bookdown.org/pingapang9/linear_models_bookdown, appendix B. */
static void test_quantiles_of_tables(void **state)
{
    (void)state;
    static const struct {
        double degrees, alpha, t;
    } table[] = {
        {1, 0.2, 3.078},   {1, 0.001, 636.619}, {3, 0.05, 3.182},  {4, 0.01, 4.604},  {5, 0.05, 2.571},
        {7, 0.05, 2.365},  {10, 0.1, 1.812},    {12, 0.02, 2.681}, {17, 0.05, 2.110}, {25, 0.001, 3.725},
        {28, 0.05, 2.048}, {1e9, 0.05, 1.960},  {1e9, 0.01, 2.576},
    };
    for (size_t i = 0; i < sizeof table / sizeof table[0]; i++) {
        const double t = ca_student_two_sided_quantile(table[i].alpha, table[i].degrees);
        if (!(fabs(t - table[i].t) <= 0.00051)) fail_msg("%g degrees, %g: %.5f", table[i].degrees, table[i].alpha, t);
    }
}

/* With 1, 2 and 4 degrees the distribution has a simple inverse. */
static void test_quantiles_in_closed_form(void **state)
{
    (void)state;
    static const double alphas[] = {0.5, 0.1, 0.05, 0.01, 1e-4};
    for (int i = 0; i < 5; i++) {
        const double inside = 1.0 - alphas[i], q = alphas[i] * (2.0 - alphas[i]); /* 4 p (1 - p) */
        expect_near(ca_student_two_sided_quantile(alphas[i], 1), tan(0.5 * 3.141592653589793 * inside), 1e-10);
        expect_near(ca_student_two_sided_quantile(alphas[i], 2), inside * sqrt(2.0 / (1.0 - inside * inside)), 1e-10);
        const double root = cos(acos(sqrt(q)) / 3.0) / sqrt(q);
        expect_near(ca_student_two_sided_quantile(alphas[i], 4), 2.0 * sqrt(root - 1.0), 1e-9);
    }
}

/* ---- Intervals ------------------------------------------------------------------------------------------------- */

static void test_symmetric_interval_is_students(void **state)
{
    (void)state;
    const ca_moments m = {.mean = 5.0, .variance = 9.0, .third = 0.0, .replicates = 36};
    const ca_interval interval = ca_confidence_interval(&m, 2.03);
    expect_near(interval.low, 5.0 - 2.03 * 0.5, 1e-12);
    expect_near(interval.high, 5.0 + 2.03 * 0.5, 1e-12);
}

/* At the limit of the short tail's side the transformed statistic is the quantile, and the interval leans to where
 * the missing ones are. */
static void test_interval_inverts_the_transformation(void **state)
{
    (void)state;
    static const double thirds[] = {1e-9, 1e-5, 0.3, 4.0, 60.0, -0.3, -20.0};
    for (int i = 0; i < 7; i++) {
        const ca_moments m = {.mean = 3.0, .variance = 4.0, .third = thirds[i], .replicates = 25};
        const ca_interval interval = ca_confidence_interval(&m, 2.0);
        const bool right = thirds[i] > 0.0;
        const double a = thirds[i] / 8.0 / 5.0, t = (m.mean - (right ? interval.low : interval.high)) / (2.0 / 5.0);
        expect_near(t + a * t * t / 3.0 + a * a * t * t * t / 27.0 + a / 6.0, right ? 2.0 : -2.0, 1e-6);
        assert_true((interval.high - m.mean > m.mean - interval.low) == right);
    }
}

/* The probability of at most k where `expectation` are expected. */
static double poisson_cumulative(int k, double expectation)
{
    double term = exp(-expectation), sum = term;
    for (int i = 1; i <= k; i++) sum += term *= expectation / i;
    return sum;
}

/* k contributions of one size: beyond the limit as few as k would come with a probability of less than 2.5 %. */
static void test_long_tail_is_poissons(void **state)
{
    (void)state;
    const double size = 3.0, quantile = 1.9599639845400545;
    const uint32_t n = 1000000;
    for (int k = 1; k <= 400; k = k < 20 ? k + 1 : 2 * k) {
        const double p = (double)k / n;
        ca_moments m = {
            .mean = size * p, .variance = size * size * p, .third = size * size * size * p, .replicates = n};
        const double high = ca_confidence_interval(&m, quantile).high * n / size;
        const double beyond = poisson_cumulative(k, high);
        if (!(beyond > 0.0245 && beyond < 0.0255))
            fail_msg("%d contributions, at most %g expected: %.5f", k, high, beyond);
        m.third = -m.third; /* as many dark ones: the same downwards */
        expect_near(2.0 * m.mean - ca_confidence_interval(&m, quantile).low, high * size / n, 1e-12);
    }
}

static void test_interval_without_scatter(void **state)
{
    (void)state;
    const ca_moments m = {.mean = -0.8, .replicates = 64};
    const ca_interval interval = ca_confidence_interval(&m, 2.0);
    assert_true(interval.low < -0.8 && interval.low > -0.800001);
    assert_true(interval.high > -0.8 && interval.high < -0.799999);
    const ca_moments black = {.replicates = 64};
    const ca_interval nothing = ca_confidence_interval(&black, 2.0);
    assert_true(nothing.low == 0.0 && nothing.high == 0.0);
}

/* Limits between two floats go outwards, to the nearest one; those that are floats stay. */
static void test_limits_are_rounded_outwards(void **state)
{
    (void)state;
    static const double values[] = {1.0 + 0x1p-30, 1.0 - 0x1p-30, 0.1, 0.3, 1e-44, 1e-50, 3.0e38, 0.0, 7.5};
    for (int i = 0; i < 9; i++)
        for (int sign = -1; sign <= 1; sign += 2) {
            const double value = sign * values[i];
            float low, high;
            ca_interval_round((ca_interval){value, value}, &low, &high);
            assert_true((double)low <= value && (double)high >= value);
            if ((double)(float)value == value)
                assert_true((double)low == value && (double)high == value);
            else
                assert_true(nextafterf(low, INFINITY) == high);
        }
}

/* An ordinary interval is widened by the root of the sum of squares, and by what lone ones may bring; each side has
 * its own. */
static void test_widened_interval(void **state)
{
    (void)state;
    const ca_moments m = {.mean = 5.0, .variance = 9.0, .third = 0.0, .replicates = 36};
    ca_verdict verdict = {.kind = CA_INTERVAL_WIDENED, .variance = {16.0, 1.0}, .lone = {0.0, 0.75}};
    ca_interval interval = ca_confidence_judged_interval(&m, &verdict, 2.0);
    expect_near(interval.low, 5.0 - 2.0 * 5.0 / 6.0, 1e-12);
    expect_near(interval.high, 5.0 + 2.0 * sqrt(10.0) / 6.0 + 0.75, 1e-12);
    verdict.kind = CA_INTERVAL_ORDINARY;
    interval = ca_confidence_judged_interval(&m, &verdict, 2.0);
    expect_near(interval.low, 4.0, 1e-12);
    expect_near(interval.high, 6.0, 1e-12);
    verdict.kind = CA_INTERVAL_MARKED;
    interval = ca_confidence_judged_interval(&m, &verdict, 2.0);
    assert_true(interval.low == -HUGE_VAL && interval.high == HUGE_VAL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_quantiles_of_tables),
        cmocka_unit_test(test_quantiles_in_closed_form),
        cmocka_unit_test(test_symmetric_interval_is_students),
        cmocka_unit_test(test_interval_inverts_the_transformation),
        cmocka_unit_test(test_long_tail_is_poissons),
        cmocka_unit_test(test_interval_without_scatter),
        cmocka_unit_test(test_limits_are_rounded_outwards),
        cmocka_unit_test(test_widened_interval),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
