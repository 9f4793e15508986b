/* Ten million rays of test_extreme_rays.c. */
#include "support/extreme_rays.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

static void test_any_rays(void **state)
{
    (void)state;
    const extreme_rays counts = trace_extreme_rays(2, 12000, 1500);
    print_message("    %llu rays, %llu hits in %llu worlds, %llu refused\n", (unsigned long long)counts.rays,
                  (unsigned long long)counts.hits, (unsigned long long)counts.worlds,
                  (unsigned long long)counts.refused);
    assert_true(counts.rays > 10000000 && counts.hits > counts.rays / 100);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_any_rays)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
