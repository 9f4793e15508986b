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
    p.looks = ca_noise_looks_start(target, 0.0, 64.0);
    p.looks.noise = noise;
    return p;
}

/* ---- Numbers --------------------------------------------------------------------------------------------------- */

/* Settings say 4,000 light paths and 2 camera paths; a render of 100 s has 6 s of pilot, a noise target 2 s. */
typedef struct numbers_case {
    const char *what;
    double wanted_seconds, wanted_samples; /* of the render */
    char kind;                             /* g: the user gave the numbers, p: ppm, -: neither */
    uint32_t most, ramp[2], iterations;    /* light paths that fit the memory; the ramp so far */
    double elapsed, seconds;               /* of the render; of the last iteration */
    char step;                             /* r: ramp, o: ordinary */
    uint32_t expected[2], least;
} numbers_case;

#define ANY UINT32_MAX

/* With 5.376 s left and 0.03 s an iteration, 16 iterations with pairs may be 5.376 / (16 x 1.4 x 0.03) = 8 times as
 * long, and a step makes them 8 times as long; six may be 8 times as long with 0.08 s, and no longer with 0.64 s. */
static const numbers_case numbers_cases[] = {
    {"begins with a quarter", 100, 0, '-', ANY, {0, 0}, 0, 0.0, 0.0, 'r', {1000, 1}, 1000},
    {"so do given numbers", 100, 0, 'g', ANY, {0, 0}, 0, 0.0, 0.0, 'r', {1000, 1}, 1000},
    {"a step", 100, 0, '-', ANY, {1000, 1}, 2, 0.1, 0.02, 'r', {4000, 2}, 1000},
    {"a step of ppm", 100, 0, 'p', ANY, {1000, 1}, 2, 0.1, 0.02, 'r', {4000, 1}, 1000},
    {"at most 16 camera paths", 100, 0, '-', ANY, {1000, 12}, 2, 0.1, 0.02, 'r', {4000, 16}, 1000},
    {"what fits the memory", 100, 0, '-', 1500, {1000, 1}, 2, 0.1, 0.02, 'r', {1500, 2}, 1000},
    {"nothing more fits", 100, 0, '-', 1000, {1000, 4}, 4, 0.1, 0.02, 'o', {1000, 9}, 1000},
    {"no time for the next step", 100, 0, '-', ANY, {1000, 4}, 4, 0.624, 0.03001, 'o', {3998, 8}, 3998},
    {"time for the next step", 100, 0, '-', ANY, {1000, 4}, 4, 0.624, 0.02999, 'r', {4000, 8}, 1000},
    {"given: no steps", 100, 0, 'g', ANY, {1000, 1}, 2, 0.1, 0.02, 'o', {4000, 2}, 4000},
    {"samples: no steps", 0, 99, '-', ANY, {1000, 1}, 2, 0.1, 1e-6, 'o', {4000, 2}, 4000},
    {"slow: still a step after the first", 100, 0, '-', ANY, {1000, 1}, 2, 0.624, 0.0799, 'o', {4000, 2}, 4000},
    {"slow: not after others", 100, 0, '-', ANY, {1000, 4}, 4, 0.624, 0.24, 'o', {1000, 4}, 1000},
    {"too slow for six", 100, 0, '-', ANY, {1000, 8}, 4, 0.624, 1.28, 'o', {630, 6}, 630},
    {"far too slow", 100, 0, '-', ANY, {1000, 4}, 2, 6.0, 1.0, 'o', {250, 2}, 250},
    {"two seconds to a target", 0, 0, '-', ANY, {1000, 4}, 4, 0.208, 0.0101, 'o', {3973, 8}, 3973},
    {"no fewer than the settings say", 100, 0, '-', ANY, {4000, 4}, 4, 0.624, 0.03001, 'o', {15996, 8}, 4000},
};

static ca_pilot_situation situation_of(const numbers_case *c)
{
    return (ca_pilot_situation){.goal = {.samples = c->wanted_samples, .seconds = c->wanted_seconds},
                                .progress = progress_of(c->elapsed, 0.0, -1.0, 0.0),
                                .settings = {4000, c->kind == 'p' ? 1 : 2},
                                .given = c->kind == 'g',
                                .one_camera_path = c->kind == 'p',
                                .most_light_paths = c->most,
                                .ramp = {.numbers = {c->ramp[0], c->ramp[1]}, .iterations = c->iterations},
                                .iteration_seconds = c->seconds};
}

static void test_numbers(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof numbers_cases / sizeof numbers_cases[0]; i++) {
        const numbers_case *c = &numbers_cases[i];
        const ca_pilot_situation s = situation_of(c);
        const ca_pilot_decision d = ca_pilot_decide(&s);
        if (d.step != (c->step == 'r' ? CA_PILOT_RAMP : CA_PILOT_ORDINARY) ||
            fabs((double)d.numbers.light_paths - c->expected[0]) > 1.0 || d.numbers.camera_paths != c->expected[1] ||
            fabs((double)d.least_light_paths - c->least) > 1.0)
            fail_msg("%s: step %d, %u light paths (at least %u), %u camera paths", c->what, (int)d.step,
                     d.numbers.light_paths, d.least_light_paths, d.numbers.camera_paths);
    }
}

/* The seconds in which a method was chosen are none of the pilot's. */
static void test_choosing(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof numbers_cases / sizeof numbers_cases[0]; i++) {
        ca_pilot_situation s = situation_of(&numbers_cases[i]);
        const ca_pilot_decision d = ca_pilot_decide(&s);
        s.goal.choosing = 7.0;
        s.progress.seconds += 7.0;
        const ca_pilot_decision later = ca_pilot_decide(&s);
        assert_true(d.step == later.step && d.numbers.light_paths == later.numbers.light_paths &&
                    d.numbers.camera_paths == later.numbers.camera_paths);
    }
    const ca_auto_goal goal = {.seconds = 100.0, .choosing = 3.0};
    const ca_auto_progress before = progress_of(8.9, 0.0, -1.0, 0.0), behind = progress_of(9.1, 0.0, -1.0, 0.0);
    assert_false(ca_pilot_is_long_enough(&goal, &before, 64));
    assert_true(ca_pilot_is_long_enough(&goal, &behind, 64));
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
        {"the longest that may be lost", {.samples = 80, .longest_pilot = 120}, 120, 1, -1, 0, false, 6, true},
        {"a share of the time is less",
         {.samples = 80, .seconds = 10, .longest_pilot = 120},
         0.6,
         1,
         -1,
         0,
         false,
         6,
         true},
        {"neither yet", {.seconds = 9999, .longest_pilot = 120}, 119, 9, -1, 0, false, 6, false},
        {"and less than a share", {.seconds = 9999, .longest_pilot = 120}, 120, 9, -1, 0, false, 6, true},
        {"two seconds", {0, 0, 0, 0}, 2, 9, 5, 1, false, 6, true},
        {"not yet two", {0, 0, 0, 0}, 1.9, 9, 5, 1, false, 6, false},
        {"the target", {0, 0, 0, 0}, 0.1, 9, 0.9, 1, false, 6, true},
        {"the target, too few iterations", {0, 0, 0, 0}, 0.1, 9, 0.9, 1, false, 4, false},
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
                                       cmocka_unit_test(test_end),     cmocka_unit_test(test_weight),
                                       cmocka_unit_test(test_choosing)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
