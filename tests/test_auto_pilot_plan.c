/* What the pilot of a render with rays "auto" decides, by tables: its numbers of paths, its end, the weight of its
 * halves. Nothing is rendered. */
#include "render/auto_pilot_plan.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

static void assert_near(const char *what, double value, double expected)
{
    if (!(fabs(value - expected) <= 1e-12 * fabs(expected)))
        fail_msg("%s: %.12g instead of %.12g", what, value, expected);
}

static ca_auto_progress progress_of(double seconds, double camera_paths, double noise, double target)
{
    ca_auto_progress p = {.seconds = seconds, .camera_paths = camera_paths};
    p.looks = ca_noise_looks_start(target, 0.0);
    p.looks.noise = noise;
    return p;
}

/* ---- Numbers --------------------------------------------------------------------------------------------------- */

/* Settings say 4,000 light paths and 2 camera paths; a render of 100 s has 6 s of pilot, a noise target 2 s. */
typedef struct numbers_case {
    const char *what;
    ca_auto_goal goal;
    bool given, one_camera_path;
    uint32_t most, ramp[2], iterations; /* light paths that fit the memory; the ramp so far */
    double elapsed, seconds;            /* of the render; of the last iteration */
    ca_pilot_step step;
    uint32_t expected[2], least;
} numbers_case;

static void test_numbers(void **state)
{
    (void)state;
    enum { RAMP = CA_PILOT_RAMP, ORDINARY = CA_PILOT_ORDINARY };
    static const numbers_case cases[] = {
        {"begins with a quarter", {.seconds = 100}, false, false, UINT32_MAX, {0}, 0, 0, 0, RAMP, {1000, 1}, 1000},
        {"so do given numbers", {.seconds = 100}, true, false, UINT32_MAX, {0}, 0, 0, 0, RAMP, {1000, 1}, 1000},
        {"a step", {.seconds = 100}, false, false, UINT32_MAX, {1000, 1}, 2, .1, .02, RAMP, {4000, 2}, 1000},
        {"a step of ppm", {.seconds = 100}, false, true, UINT32_MAX, {1000, 1}, 2, .1, .02, RAMP, {4000, 1}, 1000},
        {"at most 16", {.seconds = 100}, false, false, UINT32_MAX, {1000, 12}, 2, .1, .02, RAMP, {4000, 16}, 1000},
        {"what fits the memory", {.seconds = 100}, false, false, 1500, {1000, 1}, 2, .1, .02, RAMP, {1500, 2}, 1000},
        {"nothing more fits", {.seconds = 100}, false, false, 1000, {1000, 4}, 4, .1, .02, ORDINARY, {1000, 8}, 1000},
        {"no time for 16 like the next",
         {.seconds = 100},
         false,
         false,
         UINT32_MAX,
         {1000, 4},
         4,
         .624,
         .03,
         ORDINARY,
         {4000, 8},
         4000}, /* 5.376 s / (16 x 1.4 x 0.03 s) = 8 times the length: a step of 2 */
        {"given: no steps",
         {.seconds = 100},
         true,
         false,
         UINT32_MAX,
         {1000, 1},
         2,
         .1,
         .02,
         ORDINARY,
         {4000, 2},
         4000},
        {"samples: no steps",
         {.samples = 99},
         false,
         false,
         UINT32_MAX,
         {1000, 1},
         2,
         .1,
         1e-6,
         ORDINARY,
         {4000, 2},
         4000},
        {"slow, after one step",
         {.seconds = 100},
         false,
         false,
         UINT32_MAX,
         {1000, 1},
         2,
         .624,
         .08,
         ORDINARY,
         {4000, 2},
         4000}, /* a step of the ramp, for which there is time: 8 times the length of six iterations */
        {"too slow for that",
         {.seconds = 100},
         false,
         false,
         UINT32_MAX,
         {1000, 4},
         2,
         .624,
         .64,
         ORDINARY,
         {1000, 4},
         1000}, /* 5.376 s / (6 x 1.4 x 0.64 s) = 1 */
        {"far too slow", {.seconds = 100}, false, false, UINT32_MAX, {1000, 4}, 2, 6, 1, ORDINARY, {250, 2}, 250},
        {"two seconds to a target",
         {0},
         false,
         false,
         UINT32_MAX,
         {1000, 4},
         4,
         .208,
         .01,
         ORDINARY,
         {4000, 8},
         4000},
        {"at least as the settings say",
         {.seconds = 100},
         false,
         false,
         UINT32_MAX,
         {4000, 4},
         4,
         .624,
         .03,
         ORDINARY,
         {16000, 8},
         4000},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const numbers_case *c = &cases[i];
        const ca_pilot_situation s = {.goal = c->goal,
                                      .progress = progress_of(c->elapsed, 0.0, -1.0, 0.0),
                                      .settings = {4000, c->one_camera_path ? 1 : 2},
                                      .given = c->given,
                                      .one_camera_path = c->one_camera_path,
                                      .most_light_paths = c->most,
                                      .ramp = {.numbers = {c->ramp[0], c->ramp[1]}, .iterations = c->iterations},
                                      .iteration_seconds = c->seconds};
        const ca_pilot_decision d = ca_pilot_decide(&s);
        if (d.step != c->step || fabs((double)d.numbers.light_paths - c->expected[0]) > 1.0 ||
            d.numbers.camera_paths != c->expected[1] || fabs((double)d.least_light_paths - c->least) > 1.0)
            fail_msg("%s: step %d, %u light paths (at least %u), %u camera paths", c->what, (int)d.step,
                     d.numbers.light_paths, d.least_light_paths, d.numbers.camera_paths);
    }
}

static void test_stopped(void **state)
{
    (void)state;
    ca_pilot_situation s = {.settings = {4000, 2}, .most_light_paths = UINT32_MAX, .goal = {.seconds = 100.0}};
    assert_true(ca_pilot_decide(&s).step == CA_PILOT_RAMP);
    s.progress.stopped = true;
    assert_true(ca_pilot_decide(&s).step == CA_PILOT_END);
    s.settings = (ca_pilot_numbers){3, 2};
    s.progress.stopped = false;
    assert_int_equal(ca_pilot_decide(&s).numbers.light_paths, 2);
}

/* ---- Groups ---------------------------------------------------------------------------------------------------- */

static void test_groups(void **state)
{
    (void)state;
    ca_pilot_group ramp = {.numbers = {100, 1}}, ordinary = {.numbers = {400, 4}};
    ordinary.iterations = 10;
    assert_near("no ramp", ca_pilot_worth(&ramp, &ordinary), 10.0);
    assert_near("no ramp", ca_pilot_ramp_share(&ramp, &ordinary), 0.0);
    ramp = ca_pilot_count(ca_pilot_count(ramp)); /* variances of 1/10 each: their mean's 1/20; ordinary ones 1/40 */
    assert_near("a ramp", ca_pilot_worth(&ramp, &ordinary), 10.5);
    assert_near("a ramp", ca_pilot_ramp_share(&ramp, &ordinary), 0.5 / 10.5);
    ramp.numbers = (ca_pilot_numbers){400, 4};
    ramp = ca_pilot_count(ca_pilot_count(ramp)); /* the mean of four: (1/10 + 1/10 + 1/40 + 1/40) / 16 = 1/64 */
    assert_int_equal(ramp.iterations, 4);
    assert_near("two sizes", ca_pilot_worth(&ramp, &ordinary), 10.0 + 64.0 / 40.0);
}

static void test_roles(void **state)
{
    (void)state;
    for (uint32_t k = 0; k < 64; k++) {
        const ca_pilot_role ramp = ca_pilot_role_of(CA_PILOT_RAMP, k),
                            ordinary = ca_pilot_role_of(CA_PILOT_ORDINARY, k);
        assert_true(ramp.half == (int)(k % 2) && ordinary.half == (int)(k % 2));
        assert_true(!ramp.gathers_pairs && ordinary.gathers_pairs == (k % 8 > 1));
    }
}

/* ---- Its end --------------------------------------------------------------------------------------------------- */

static void test_end(void **state)
{
    (void)state;
    static const struct {
        const char *what;
        ca_auto_goal goal;
        double seconds, camera_paths, noise, target;
        bool stopped;
        uint32_t iterations;
        bool expected;
    } cases[] = {
        {"too few iterations", {.seconds = 10}, 9, 9, -1, 0, false, 5, false},
        {"a share of the time", {.seconds = 10}, 0.6, 9, -1, 0, false, 6, true},
        {"not yet", {.seconds = 10}, 0.59, 9, -1, 0, false, 60, false},
        {"an eighth of the samples", {.samples = 80}, 0.1, 10, -1, 0, false, 6, true},
        {"not yet an eighth", {.samples = 80}, 100, 9.9, -1, 0, false, 6, false},
        {"two seconds", {0, 0}, 2, 9, 5, 1, false, 6, true},
        {"not yet two", {0, 0}, 1.9, 9, 5, 1, false, 6, false},
        {"the target", {0, 0}, 0.1, 9, 0.9, 1, false, 6, true},
        {"the target, too few iterations", {0, 0}, 0.1, 9, 0.9, 1, false, 4, false},
        {"stopped", {.seconds = 10}, 0.1, 9, -1, 0, true, 2, true},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        ca_auto_progress p = progress_of(cases[i].seconds, cases[i].camera_paths, cases[i].noise, cases[i].target);
        p.stopped = cases[i].stopped;
        if (ca_pilot_is_long_enough(&cases[i].goal, &p, cases[i].iterations) != cases[i].expected)
            fail_msg("%s", cases[i].what);
    }
    assert_near("least samples", ca_pilot_least_samples(3), 20.0);
    for (uint32_t k = 0; k < 100; k++) {
        const ca_auto_progress target = progress_of(1, 1, -1, 1), none = progress_of(1, 1, -1, 0);
        assert_true(ca_pilot_look_is_due(&target, k) == (k == 6 || k == 12 || k == 24 || k == 48 || k == 96));
        assert_false(ca_pilot_look_is_due(&none, k));
    }
}

static void test_weight(void **state)
{
    (void)state;
    const ca_pilot_verdict verdict = {.gain = 3.0, .seconds_per_sample = 0.5, .iteration_seconds = 0.2};
    const ca_auto_goal seconds = {.seconds = 60.0}, samples = {.samples = 90.0};
    /* A pilot of 10 iterations of 0.2 s; 12 s of render, three times as efficient: 18 to 1. */
    assert_near("seconds", ca_pilot_render_weight(&verdict, &seconds, 12.0, 10.0), 18.0 / 19.0);
    assert_near("samples", ca_pilot_render_weight(&verdict, &samples, 12.0, 10.0), 9.0 / 10.0);
    assert_true(ca_pilot_render_weight(&verdict, &seconds, 0.0, 10.0) < 1e-8);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_numbers), cmocka_unit_test(test_stopped),
                                       cmocka_unit_test(test_groups),  cmocka_unit_test(test_roles),
                                       cmocka_unit_test(test_end),     cmocka_unit_test(test_weight)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
