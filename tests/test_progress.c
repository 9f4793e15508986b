/* How much of a render is done, and how long the rest will take: by passes, by time, to a noise target. */
#include "render/progress.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

/* A fraction of -1: not known. */
static const struct progress_case {
    const char *what;
    ca_render_progress progress;
    double fraction, seconds_left;
} cases[] = {
    {"nothing is known", {.passes_done = 5, .seconds = 3.0, .noise_percent = 7.0}, -1.0, -1.0},
    {"passes", {.passes_done = 3, .passes_total = 12, .seconds = 10.0, .noise_percent = -1.0}, 0.25, 30.0},
    {"before the first pass", {.passes_total = 12, .noise_percent = -1.0}, 0.0, -1.0},
    {"time", {.passes_done = 9, .seconds = 5.0, .seconds_total = 20.0, .noise_percent = -1.0}, 0.25, 15.0},
    {"passes, of which time leaves fewer",
     {.passes_done = 1, .passes_total = 100, .seconds = 4.0, .seconds_total = 5.0, .noise_percent = -1.0},
     0.8,
     1.0},
    {"time, of which passes need less",
     {.passes_done = 90, .passes_total = 100, .seconds = 1.8, .seconds_total = 5.0, .noise_percent = -1.0},
     0.9,
     0.2},
    {"a quarter of the noise wants 16 times the passes",
     {.passes_done = 9, .seconds = 2.0, .noise_percent = 8.0, .noise_target = 2.0},
     1.0 / 16.0,
     30.0},
    {"a prediction, which is better than that",
     {.passes_done = 9, .seconds = 6.0, .seconds_predicted = 10.0, .noise_percent = 8.0, .noise_target = 2.0},
     0.6,
     4.0},
    {"longer than predicted",
     {.passes_done = 9, .seconds = 12.0, .seconds_predicted = 10.0, .noise_percent = 3.0, .noise_target = 2.0},
     1.0,
     0.0},
    {"noise that is not known yet",
     {.passes_done = 1, .seconds = 2.0, .noise_percent = -1.0, .noise_target = 2.0},
     -1.0,
     -1.0},
    {"passes, of which none was made while something was chosen",
     {.passes_done = 1, .passes_total = 256, .seconds = 1.9, .seconds_choosing = 1.6, .noise_percent = -1.0},
     1.0 / 256.0,
     76.5},
    {"time, of which a choice has had some",
     {.passes_done = 1, .seconds = 6.0, .seconds_total = 60.0, .seconds_choosing = 3.6, .noise_percent = -1.0},
     0.1,
     54.0},
    {"a noise target, after a choice",
     {.passes_done = 9, .seconds = 5.0, .seconds_choosing = 3.0, .noise_percent = 8.0, .noise_target = 2.0},
     1.0 / 16.0,
     30.0},
    {"the time is over before the first pass",
     {.passes_done = 1, .seconds = 4.0, .seconds_total = 2.0, .seconds_choosing = 3.0, .noise_percent = -1.0},
     1.0,
     0.0},
    {"the target is reached",
     {.passes_done = 9, .seconds = 2.0, .noise_percent = 1.0, .noise_target = 2.0},
     1.0,
     0.0},
};

static void test_fraction_and_time(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const struct progress_case *c = &cases[i];
        const double fraction = ca_progress_fraction(&c->progress), left = ca_progress_seconds_left(&c->progress);
        if (!(fabs(fraction - c->fraction) < 1e-12))
            fail_msg("%s: the fraction is %g, not %g", c->what, fraction, c->fraction);
        if (!(fabs(left - c->seconds_left) < 1e-9))
            fail_msg("%s: %g s are left, not %g", c->what, left, c->seconds_left);
    }
}

/* The noise falls with the square root of the work since it was estimated, however far the render is by now. */
static void test_noise_at_the_end(void **state)
{
    (void)state;
    ca_render_progress now = {.passes_done = 90, .passes_total = 100, .seconds = 9.0, .noise_percent = 8.0,
                              .noise_passes = 25, .noise_seconds = 2.5};
    ca_render_progress then = ca_progress_at_noise(&now);
    assert_true(fabs(ca_progress_noise_at_end(&then) - 4.0) < 1e-12);
    now.passes_total = 0;
    now.seconds_total = 40.0;
    then = ca_progress_at_noise(&now);
    assert_true(fabs(ca_progress_noise_at_end(&then) - 2.0) < 1e-12);
    now.seconds_choosing = 1.0; /* 1.5 of 24 s made passes */
    now.seconds_total = 25.0;
    then = ca_progress_at_noise(&now);
    assert_true(fabs(ca_progress_noise_at_end(&then) - 2.0) < 1e-12);
    now.seconds_choosing = now.seconds_total = 0.0;
    now.noise_target = 3.0;
    then = ca_progress_at_noise(&now);
    assert_true(fabs(ca_progress_noise_at_end(&then) - 3.0) < 1e-12);
    now.noise_target = 0.0;
    then = ca_progress_at_noise(&now);
    assert_true(ca_progress_noise_at_end(&then) < 0.0);
    now.seconds_total = 40.0;
    now.noise_percent = -1.0;
    then = ca_progress_at_noise(&now);
    assert_true(ca_progress_noise_at_end(&then) < 0.0);
}

/* A render by time or noise that ends with neither has had all passes that there are. */
static void test_ran_out_of_passes(void **state)
{
    (void)state;
    const ca_render_settings noise = {.noise_percent = 1.0}, time = {.seconds = 60.0};
    const ca_render_settings both = {.seconds = 60.0, .noise_percent = 1.0};
    const ca_render_settings samples = {.samples_per_pixel = 4, .seconds = 60.0};
    const ca_render_settings passes = {.has_passes = true, .passes = {0, 4}, .seconds = 60.0};
    const ca_render_statistics early = {.seconds = 40.0, .noise_percent = 3.0}, none = {.noise_percent = -1.0};
    const ca_render_statistics late = {.seconds = 60.0, .noise_percent = 3.0};
    const ca_render_statistics quiet = {.seconds = 40.0, .noise_percent = 0.9};
    ca_render_statistics other = early;
    assert_true(ca_progress_ran_out_of_passes(&noise, &early) && ca_progress_ran_out_of_passes(&noise, &late));
    assert_true(ca_progress_ran_out_of_passes(&time, &early) && ca_progress_ran_out_of_passes(&time, &quiet));
    assert_true(ca_progress_ran_out_of_passes(&both, &early));
    assert_false(ca_progress_ran_out_of_passes(&noise, &quiet) || ca_progress_ran_out_of_passes(&noise, &none));
    assert_false(ca_progress_ran_out_of_passes(&time, &late));
    assert_false(ca_progress_ran_out_of_passes(&both, &late) || ca_progress_ran_out_of_passes(&both, &quiet));
    assert_false(ca_progress_ran_out_of_passes(&samples, &early) || ca_progress_ran_out_of_passes(&passes, &early));
    other.interrupted = true;
    assert_false(ca_progress_ran_out_of_passes(&noise, &other));
    other.interrupted = false;
    other.blocks[1] = 4;
    assert_false(ca_progress_ran_out_of_passes(&time, &other));
    other.blocks[1] = 0;
    other.numbers_of_rays.pilot_seconds = 0.1;
    assert_false(ca_progress_ran_out_of_passes(&noise, &other));
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_fraction_and_time),
                                       cmocka_unit_test(test_noise_at_the_end),
                                       cmocka_unit_test(test_ran_out_of_passes)};
    return cmocka_run_group_tests_name("progress", tests, NULL, NULL);
}
