/* Every integrator on scenes whose radiance is known in closed form, to 3 % in a release build; sensors and samplers take
 * turns. With all of them, to 1 %: long_closed_forms.c. */
#include "support/closed_forms.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

/* Builds with asserts are slow, with sanitizers more so: less precision there. */
#ifdef NDEBUG
static const double tolerance = 0.03;
#else
static const double tolerance = 0.06;
#endif

static void test_variant(void **state)
{
    const closed_form_effort effort = {.all_cases = false, .tolerance = tolerance, .max_samples = 1000};
    const closed_form_tally tally = check_closed_forms((size_t)((uintptr_t)*state - 1), &effort);
    assert_true(tally.cases > 0);
    assert_int_equal(tally.failed, 0);
}

/* An argument is a pattern: only the variants of matching names are tested. */
int main(int argc, char **argv)
{
    if (argc > 1) cmocka_set_test_filter(argv[1]);
    struct CMUnitTest tests[32] = {{0}};
    const size_t count = integrator_variant_count();
    assert_true(count <= sizeof tests / sizeof tests[0]);
    for (size_t i = 0; i < count; i++)
        tests[i] = (struct CMUnitTest){.name = integrator_variant_at(i)->text,
                                       .test_func = test_variant,
                                       .initial_state = (void *)(uintptr_t)(i + 1)};
    return _cmocka_run_group_tests("closed forms", tests, count, NULL, NULL);
}
