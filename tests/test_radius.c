/* The merge radius of each pass: r^2 = r0^2 / n^alpha with n passes to the end of this one. */
#include "photon/radius.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

static void assert_near(float got, double expected)
{
    if (!(fabs((double)got - expected) <= 1e-7 * expected)) fail_msg("%.9g instead of %.9g", (double)got, expected);
}

static void test_first_pass(void **state)
{
    (void)state;
    for (int i = 0; i <= 4; i++) assert_true(ca_progressive_radius(0.3f, 0.25f * (float)i, 0) == 0.3f);
}

/* 16 passes: a quarter of the radius with alpha = 1, half with 1/2, all of it with 0. */
static void test_later_passes(void **state)
{
    (void)state;
    assert_near(ca_progressive_radius(2.0f, 0.0f, 15), 2.0);
    assert_near(ca_progressive_radius(2.0f, 0.5f, 15), 1.0);
    assert_near(ca_progressive_radius(2.0f, 1.0f, 15), 0.5);
    assert_near(ca_progressive_radius(2.0f, 0.25f, 15), sqrt(2.0));
    assert_near(ca_progressive_radius(2.0f, 0.5f, 1), 2.0 / sqrt(sqrt(2.0)));
    assert_near(ca_progressive_radius(2.0f, 1.0f, UINT32_MAX), 2.0 / 65536.0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_first_pass), cmocka_unit_test(test_later_passes)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
