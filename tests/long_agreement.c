/* Unbiased integrators, and those with merges so small that their bias does not count, on all scenes of
 * support/agreement_scenes.c, block by block, with samples enough to show a bias of 1 %. Takes some minutes. An
 * argument is a pattern for the names of the scenes to look at. */
#include "support/agreement.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

static const char *const integrators[] = {"light",
                                          "bdpt:heuristic=balance",
                                          "bdpt:heuristic=power",
                                          "vcm:radius=%g,alpha=0",
                                          "vcm:light_paths=300,camera_paths=2,radius=%g,alpha=0",
                                          "vcm-star:radius=%g,alpha=0",
                                          "ovcm:radius=%g,alpha=0",
                                          NULL};

static bool is_any(const agreement_scene *scene) { return scene != NULL; }

static const agreement_settings settings = {
    .integrators = integrators, .wanted = is_any, .target = 0.0078, .max_samples = 40000};
static agreement_result total;

static void test_scene(void **state)
{
    agreement_result result = {0};
    compare_integrators(*state, &settings, &result);
    total.comparisons += result.comparisons;
    total.suspicious += result.suspicious;
    if (total.largest_detectable < result.largest_detectable) total.largest_detectable = result.largest_detectable;
    assert_int_equal(result.failed, 0);
    assert_true(result.comparisons > 0);
    assert_true(result.largest_detectable <= 0.01);
}

static void test_suspicions_are_as_few_as_chance_has_it(void **state)
{
    (void)state;
    print_message(
        "    %u comparisons, %u of them below p = 0.05 at the first look; detectable bias at worst %.2f %%\n",
        total.comparisons, total.suspicious, 100.0 * total.largest_detectable);
    assert_true(suspicious_p_value(&total) > 0.01);
}

int main(int argc, char **argv)
{
    if (argc > 1) cmocka_set_test_filter(argv[1]);
    struct CMUnitTest tests[32] = {{0}};
    const size_t scenes = agreement_scene_count();
    assert_true(scenes < sizeof tests / sizeof tests[0]);
    for (size_t i = 0; i < scenes; i++)
        tests[i] = (struct CMUnitTest){.name = agreement_scene_at(i)->name,
                                       .test_func = test_scene,
                                       .initial_state = (void *)(uintptr_t)agreement_scene_at(i)}; /* only read */
    tests[scenes] = (struct CMUnitTest)cmocka_unit_test(test_suspicions_are_as_few_as_chance_has_it);
    return _cmocka_run_group_tests("agreement", tests, scenes + 1, NULL, NULL);
}
