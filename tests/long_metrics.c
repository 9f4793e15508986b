/* SSIM and FLIP against independent implementations, on ten pairs of renders: scripts/check-metrics.sh. Skipped,
 * loudly, where their packages cannot be had. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <sys/wait.h>

#include <cmocka.h>

enum { SKIPPED = 77 };

static void test_independent_implementations(void **state)
{
    (void)state;
    const int status = system("'" CA_SOURCE_DIR "/scripts/check-metrics.sh' '" CA_BUILD_DIR "' >&2");
    assert_true(WIFEXITED(status));
    if (WEXITSTATUS(status) == SKIPPED) skip();
    assert_int_equal(WEXITSTATUS(status), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_independent_implementations)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
