/* The mean of a thousand small renders with rays "auto" is the reference's, within two standard errors; that of the
 * same samples joined the naive way is not. So is the mean of longer ones, with trials and phases. */
#include "support/auto_bias.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

enum { REFERENCE_PASSES = 12500 };

/* Two standard errors are exceeded once in 22 times: then other renders must not do so again. */
static double worst_of_two(const ca_scene *scene, uint32_t renders, uint32_t samples,
                           const auto_bias_means *reference, auto_bias_means *naive, double *phases)
{
    auto_bias_means joined;
    *phases = auto_bias_render(scene, renders, samples, 1, &joined, naive);
    const double worst = auto_bias_test("joined", &joined, reference);
    if (worst <= 1.0) return worst;
    auto_bias_render(scene, renders, samples, 1 + renders, &joined, naive);
    return auto_bias_test("joined, once more", &joined, reference);
}

/* With hardly more than a pilot, whose samples count for much. */
static void test_no_bias(void **state)
{
    (void)state;
    ca_scene *scene = auto_bias_scene();
    auto_bias_means naive, reference;
    double phases;
    auto_bias_reference(scene, REFERENCE_PASSES, &reference);
    const double worst = worst_of_two(scene, 1000, 32, &reference, &naive, &phases);
    assert_true(auto_bias_test("joined naively", &naive, &reference) > 1.0);
    assert_true(worst <= 1.0);
    ca_scene_release(scene);
}

/* With trials and phases, whose shares are settled one by one. */
static void test_no_bias_of_trials(void **state)
{
    (void)state;
    ca_scene *scene = auto_bias_scene();
    auto_bias_means naive, reference;
    double phases;
    auto_bias_reference(scene, 4 * REFERENCE_PASSES, &reference);
    const double worst = worst_of_two(scene, 400, 400, &reference, &naive, &phases);
    print_message("    %.2f trials and phases\n", phases);
    assert_true(phases > 2.0 && worst <= 1.0);
    ca_scene_release(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_no_bias), cmocka_unit_test(test_no_bias_of_trials)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
