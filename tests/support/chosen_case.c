#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

/* Each test program runs only the tests whose names match CA_TEST_CASE, where that is set and not empty. */
__attribute__((constructor)) static void choose_case(void)
{
    const char *pattern = getenv("CA_TEST_CASE");
    if (pattern && *pattern)
        cmocka_set_test_filter(pattern);
}
