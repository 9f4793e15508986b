/* A scene seen through a lens of glass: all integrators make the same picture of it, with the same bits for any
 * number of threads. */
#include "support/agreement.h"
#include "support/scene_text.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static const agreement_scene *through_a_lens(void)
{
    for (size_t i = 0; i < agreement_scene_count(); i++)
        if (strstr(agreement_scene_at(i)->sensor, "'realistic'")) return agreement_scene_at(i);
    fail_msg("no scene has a realistic sensor");
    return NULL;
}

/* Builds with asserts are slow, with sanitizers more so: less power there. */
#ifdef NDEBUG
static const double target_bias = 0.06;
#else
static const double target_bias = 0.2;
#endif

static bool is_through_a_lens(const agreement_scene *scene) { return scene == through_a_lens(); }

static void test_integrators_agree(void **state)
{
    (void)state;
    /* Of photons alone a wider kernel has less noise, and no bias to speak of here. */
    static const char *const integrators[] = {"light",
                                              "bdpt",
                                              "vcm:radius=%g,alpha=0",
                                              "vcm-plus:radius=%g,alpha=0",
                                              "vcm-star:radius=%g,alpha=0",
                                              "cavcm:radius=%g,alpha=0",
                                              "ovcm:radius=%g,alpha=0",
                                              "vavcm:radius=%g,alpha=0",
                                              "ppm:radius=0.08,alpha=0",
                                              "bdpm:radius=0.08,alpha=0",
                                              "qmcppm:radius=0.08,alpha=0",
                                              NULL};
    const agreement_settings settings = {
        .integrators = integrators, .wanted = is_through_a_lens, .target = target_bias, .max_samples = 100};
    agreement_result result = {0};
    compare_integrators(through_a_lens(), &settings, &result);
    print_message(
        "    %u comparisons (%u do not apply), %u below p = 0.05, smallest detectable bias at worst %.2f %%\n",
        result.comparisons, result.skipped, result.suspicious, 100.0 * result.largest_detectable);
    assert_int_equal(result.failed, 0);
    assert_int_equal(result.skipped, 0);
    assert_true(suspicious_p_value(&result) > 0.01);
    assert_true(result.largest_detectable < 2.0 * target_bias);
}

static void test_threads_do_not_change_a_bit(void **state)
{
    (void)state;
    static const char *const integrators[] = {"path",
                                              "light",
                                              "bdpm:radius=0.2",
                                              "vcm:radius=0.2",
                                              "vavcm:radius=0.2",
                                              "qmcppm:light_paths=333"};
    ca_scene *scene = agreement_scene_load(through_a_lens());
    for (size_t i = 0; i < sizeof integrators / sizeof integrators[0]; i++) {
        ca_render_settings settings;
        ca_render_settings_init(&settings);
        settings.integrator = integrators[i];
        settings.samples_per_pixel = 3;
        settings.threads = 1;
        const uint64_t one = rendered_hash(scene, &settings);
        settings.threads = 3;
        if (rendered_hash(scene, &settings) != one) fail_msg("%s: three threads differ from one", integrators[i]);
    }
    ca_scene_release(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_threads_do_not_change_a_bit),
        cmocka_unit_test(test_integrators_agree),
    };
    return cmocka_run_group_tests_name("realistic camera's integrators", tests, NULL, NULL);
}
