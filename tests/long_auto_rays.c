/* The mean of a thousand small renders with rays "auto" is the reference's, within two standard errors; that of the same samples joined
 * the naive way is not. */
#include "support/auto_bias.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

static void test_no_bias(void **state)
{
    (void)state;
    enum { RENDERS = 1000, PASSES = 12500 };
    ca_scene *scene = auto_bias_scene();
    auto_bias_means joined, naive, reference;
    auto_bias_reference(scene, PASSES, &reference);
    auto_bias_render(scene, RENDERS, 1, &joined, &naive);
    double worst = auto_bias_test("joined", &joined, &reference);
    assert_true(auto_bias_test("joined naively", &naive, &reference) > 1.0);
    /* Two standard errors are exceeded once in 22 times: then other renders must not do so again. */
    if (worst > 1.0) {
        auto_bias_render(scene, RENDERS, 1 + RENDERS, &joined, &naive);
        worst = auto_bias_test("joined, once more", &joined, &reference);
    }
    assert_true(worst <= 1.0);
    ca_scene_release(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_no_bias)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
