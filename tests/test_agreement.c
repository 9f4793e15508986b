/* Integrators against each other on a few scenes (the others: long_agreement.c), the same bits for any number of
 * threads, and the merging integrators' bias and noise against theory. */
#include "metrics/significance.h"
#include "sampling/sampler.h"
#include "support/agreement.h"
#include "support/batches.h"
#include "support/scene_text.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

#define PI 3.14159265358979323846

/* ---- Agreement ------------------------------------------------------------------------------------------------- */

/* Builds with asserts are slow, with sanitizers more so: less power there. */
#ifdef NDEBUG
static const double target_bias = 0.02;
#else
static const double target_bias = 0.06;
#endif

static bool is_fast(const agreement_scene *scene) { return scene->fast; }

static void test_integrators_agree(void **state)
{
    (void)state;
    static const char *const integrators[] = {"light", "bdpt", "vcm:radius=%g,alpha=0", "vcm-star:radius=%g,alpha=0",
                                              "ovcm:radius=%g,alpha=0", "vavcm:radius=%g,alpha=0", NULL};
    const agreement_settings settings = {
        .integrators = integrators, .wanted = is_fast, .target = target_bias, .max_samples = 2000};
    agreement_result result = {0};
    for (size_t i = 0; i < agreement_scene_count(); i++)
        if (is_fast(agreement_scene_at(i))) compare_integrators(agreement_scene_at(i), &settings, &result);
    print_message(
        "    %u comparisons (%u do not apply), %u below p = 0.05, smallest detectable bias at worst %.2f %%\n",
        result.comparisons, result.skipped, result.suspicious, 100.0 * result.largest_detectable);
    assert_int_equal(result.failed, 0);
    assert_true(suspicious_p_value(&result) > 0.01);
    assert_true(result.largest_detectable < 2.0 * target_bias);
}

/* ---- Threads --------------------------------------------------------------------------------------------------- */

static uint64_t hash_of(const ca_scene *scene, const char *integrator, const char *sampler, uint32_t threads)
{
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.integrator = integrator;
    settings.sampler = sampler;
    settings.samples_per_pixel = 3;
    settings.threads = threads;
    return rendered_hash(scene, &settings);
}

/* Integrators take turns: each renders every other scene. */
static void test_threads_do_not_change_a_bit(void **state)
{
    (void)state;
    static const char *const integrators[] = {"light",
                                              "bdpt",
                                              "ppm:radius=0.2",
                                              "bdpm:radius=0.2",
                                              "vcm:radius=0.2",
                                              "vcm-plus:radius=0.2",
                                              "vcm-star:radius=0.2",
                                              "ovcm:radius=0.2",
                                              "cavcm:radius=0.2",
                                              "vavcm:radius=0.2",
                                              "vcm:light_paths=333,camera_paths=2",
                                              "vcm",
                                              "qmcppm:light_paths=333"};
    static const uint32_t threads[] = {2, 3, 8};
    size_t turn = 0;
    for (size_t s = 0; s < agreement_scene_count(); s++) {
        if (!agreement_scene_at(s)->fast) continue;
        ca_scene *scene = agreement_scene_load(agreement_scene_at(s));
        for (size_t i = turn++ % 2; i < sizeof integrators / sizeof integrators[0]; i += 2) {
            const char *sampler = ca_sampler_name((ca_sampler_kind)((s + i) % CA_SAMPLER_KIND_COUNT));
            const uint64_t one = hash_of(scene, integrators[i], sampler, 1);
            for (size_t t = 0; t < 3; t++)
                if (hash_of(scene, integrators[i], sampler, threads[t]) != one)
                    fail_msg("%s: %s, %s: %u threads make another picture than one", agreement_scene_at(s)->name,
                             integrators[i], sampler, threads[t]);
        }
        ca_scene_release(scene);
    }
}

/* ---- Bias and noise of merging --------------------------------------------------------------------------------- */

/* A floor of reflectance 1/2 lit by a spot light of intensity 1 at height 1, seen at the point straight below. The
 * photons that are merged there come from the disk of radius r, which the light sees under the solid angle 2 pi (1 -
 * 1 / sqrt(1 + r^2)). */
static ca_scene *floor_under_a_spot(void)
{
    return scene_from_text(
        "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' value='2'/></integrator>"
        "<sensor type='orthographic'><transform name='to_world'><scale value='0.0005'/>"
        "<lookat origin='0,0.5,0' target='0,0,0' up='0,0,1'/></transform><film type='hdrfilm'>"
        "<integer name='width' value='4'/><integer name='height' value='4'/><rfilter type='box'/></film></sensor>"
        "<shape type='rectangle'><transform name='to_world'><rotate x='1' angle='-90'/><scale value='3'/></transform>"
        "<bsdf type='diffuse'/></shape><emitter type='spot'><float name='cutoff_angle' value='40'/>"
        "<float name='beam_width' value='38'/>"
        "<transform name='to_world'><lookat origin='0,1,0' target='0,0,0' "
        "up='0,0,1'/></transform></emitter></scene>");
}

/* What merging finds there: 1 - 3/4 r^2 + ... of the truth, 1 / (2 pi). */
static double merged_radiance(double radius2)
{
    return 0.5 / PI * 2.0 * (1.0 - 1.0 / sqrt(1.0 + radius2)) / radius2;
}

/* The same over `passes` passes with a shrinking radius: r^2 = r0^2 / (n / N_ref)^alpha. */
static double merged_radiance_over_passes(double r0, double alpha, uint32_t passes)
{
    double sum = 0.0;
    for (uint32_t i = 0; i < passes; i++) sum += merged_radiance(r0 * r0 * pow(i + 1.0, -alpha));
    return sum / passes;
}

/* One integrator and radius: the mean is the truth and the bias that theory gives, here tens of times the noise. */
static double check_bias(const ca_scene *scene, const char *name, double radius, uint32_t tests)
{
    char integrator[128];
    snprintf(integrator, sizeof integrator, "%s:radius=%g,alpha=0,light_paths=20000", name, radius);
    const batch_settings settings = {
        .integrator = integrator, .samples = 7, .batches = 16, .seed = seed_of(integrator)};
    const measured value = measure_mean(scene, &settings);
    const double expected = merged_radiance(radius * radius), truth = 0.5 / PI;
    print_message("    %-5s r = %-6g bias %7.3f %% +- %.3f, theory %7.3f %%\n", name, radius,
                  100.0 * (value.mean / truth - 1.0), 100.0 * value.error / truth, 100.0 * (expected / truth - 1.0));
    assert_true(value.error < 0.005 * truth);
    /* next event has a weight of about 0.001 in `vcm` */
    assert_true(p_value_of(value, expected, 0.002 * (truth - expected)) > ca_sidak_alpha(0.01, tests));
    return 1.0 - value.mean / truth;
}

static void test_bias_of_merging_falls_with_the_area(void **state)
{
    (void)state;
    static const char *const names[] = {"ppm", "bdpm", "vcm"};
    ca_scene *scene = floor_under_a_spot();
    for (size_t i = 0; i < 3; i++) {
        const double large = check_bias(scene, names[i], 0.4, 6), small = check_bias(scene, names[i], 0.2, 6);
        print_message("    %-5s half the radius: bias %.2f times smaller\n", names[i], large / small);
    }
    ca_scene_release(scene);
}

/* One photon a light path, no weights: a pass counts successes. */
static double variance_of_pass(double radius2, double light_paths, double hit_all)
{
    const double value = merged_radiance(radius2);
    const double hits = hit_all * (1.0 - 1.0 / sqrt(1.0 + radius2));
    return value * value * (1.0 - hits) / (light_paths * hits);
}

/* With a shrinking radius the bias falls as n^-alpha and the variance as n^(alpha - 1). */
static void check_rate(const ca_scene *scene, const char *name, double alpha, uint32_t passes, double hit_all)
{
    enum { LIGHT_PATHS = 500, REPEATS = 200 };
    const double r0 = 0.5;
    char integrator[128];
    snprintf(integrator, sizeof integrator, "%s:radius=%g,alpha=%g,light_paths=%d", name, r0, alpha, LIGHT_PATHS);
    const batch_settings settings = {
        .integrator = integrator, .samples = passes, .batches = REPEATS, .seed = seed_of(integrator) + passes};
    const measured value = measure_mean(scene, &settings);
    double variance = 0.0;
    for (uint32_t i = 0; i < passes; i++)
        variance += variance_of_pass(r0 * r0 * pow(i + 1.0, -alpha), LIGHT_PATHS, hit_all) / passes / passes;
    const double expected = merged_radiance_over_passes(r0, alpha, passes), truth = 0.5 / PI;
    const double ratio = value.error * value.error * REPEATS / variance;
    print_message(
        "    %-5s alpha = %.1f, %3u passes: bias %6.2f %% (theory %6.2f %%), noise %5.2f %% (theory %5.2f %%)\n",
        name, alpha, passes, 100.0 * (value.mean / truth - 1.0), 100.0 * (expected / truth - 1.0),
        100.0 * value.error * sqrt(REPEATS) / truth, 100.0 * sqrt(variance) / truth);
    assert_true(p_value_of(value, expected, 0.0) > 0.001);
    /* chi square of 199 degrees of freedom: standard deviation 10 % */
    assert_true(fabs(ratio - 1.0) < 0.4);
}

static void test_error_falls_at_its_rate(void **state)
{
    (void)state;
    ca_scene *scene = floor_under_a_spot();
    /* directions are spread evenly over the spot's cone of 40 degrees */
    const double hit_all = 1.0 / (1.0 - cos(40.0 * PI / 180.0));
    static const uint32_t passes[] = {1, 4, 16};
    for (size_t i = 0; i < 3; i++) {
        check_rate(scene, "ppm", 0.5, passes[i], hit_all);
        check_rate(scene, "ppm", 0.8, passes[i], hit_all);
        check_rate(scene, "bdpm", 0.5, passes[i], hit_all);
    }
    ca_scene_release(scene);
}

int main(int argc, char **argv)
{
    if (argc > 1) cmocka_set_test_filter(argv[1]);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_threads_do_not_change_a_bit),
        cmocka_unit_test(test_bias_of_merging_falls_with_the_area),
        cmocka_unit_test(test_error_falls_at_its_rate),
        cmocka_unit_test(test_integrators_agree),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
