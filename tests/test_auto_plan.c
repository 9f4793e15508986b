/* What a render with rays "auto" decides, by tables: what is known, and the step that is to follow. And whole renders
 * without a picture: a made-up choice of numbers and a made-up clock. Nothing is rendered. */
#include "render/auto_plan.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#define UNKNOWN (-1.0)
#define FOREVER ((double)INFINITY)

static void assert_near(const char *what, double value, double expected)
{
    if (!(fabs(value - expected) <= 1e-12 * fabs(expected)) && value != expected)
        fail_msg("%s: %.12g instead of %.12g", what, value, expected);
}

static ca_auto_progress progress_of(double seconds, double camera_paths, double noise, double target)
{
    ca_auto_progress p = {.seconds = seconds, .camera_paths = camera_paths};
    p.looks = ca_noise_looks_start(target, 0.0, 64.0);
    p.looks.noise = noise;
    return p;
}

static const ca_auto_goal by_samples = {.samples = 1000.0}, by_seconds = {.seconds = 100.0}, by_noise = {0};

/* After ten seconds of a hundred, 100 camera paths of 1000; 6 % of noise where 2 % are wanted. */
static ca_auto_situation situation_of(const ca_auto_goal *goal, ca_auto_step done)
{
    const ca_auto_progress progress = progress_of(10.0, 100.0, 6.0, goal == &by_noise ? 2.0 : 0.0);
    ca_auto_situation s = ca_auto_plan_start(goal, &progress, 1000.0);
    s.done = done;
    s.best = (ca_auto_candidate){
        .light_paths = 1500.0, .camera_paths = 4.0, .cost = 1.0, .relative_variance = 0.5, .seconds = 0.25};
    s.tried = (ca_auto_candidate){
        .light_paths = 8000.0, .camera_paths = 2.0, .cost = 4.0, .relative_variance = 0.8, .seconds = 0.1};
    return s;
}

/* ---- Which step follows ---------------------------------------------------------------------------------------- */

/* -: pilot, c: choose, t: choose a trial, T: trial, v: validation run, p: predict, P: phase, e: end. */
static const char letters[] = "-ctTvpPe";
static ca_auto_step step_of(char letter) { return (ca_auto_step)(strchr(letters, letter) - letters); }

typedef struct step_case {
    const char *what;
    const ca_auto_goal *goal;
    char done;
    double best, tried; /* N_F; times were measured with 1000 */
    uint32_t reach, trials;
    bool validated;
    uint32_t phases, phases_done; /* of the schedule */
    char expected;
    uint32_t expected_iterations, expected_reach; /* of a choice */
} step_case;

static void test_next_step(void **state)
{
    (void)state;
    static const step_case cases[] = {
        {"after the pilot", &by_samples, '-', 0, 0, 0, 0, false, 0, 0, 'c', 8, 16},
        {"near: no trial", &by_samples, 'c', 2000, 0, 16, 0, false, 0, 0, 'p', 0, 0},
        {"near below: no trial", &by_samples, 'c', 500, 0, 16, 0, false, 0, 0, 'p', 0, 0},
        {"far: a trial is chosen", &by_samples, 'c', 2001, 0, 16, 0, false, 0, 0, 't', 64, 16},
        {"far below: a trial is chosen", &by_seconds, 'c', 499, 0, 16, 2, false, 0, 0, 't', 64, 16},
        {"far, but three trials were made", &by_seconds, 'c', 3999, 0, 16, 3, false, 0, 0, 'p', 0, 0},
        {"too far after three trials", &by_seconds, 'c', 4001, 0, 16, 3, false, 0, 0, 'c', 8, 4},
        {"chosen with care: no trial", &by_seconds, 'c', 4000, 0, 4, 0, false, 0, 0, 'p', 0, 0},
        {"the trial leads there", &by_seconds, 't', 16000, 8000, 16, 0, false, 0, 0, 'T', 0, 0},
        {"the trial leads one doubling there", &by_seconds, 't', 16000, 2000, 16, 0, false, 0, 0, 'T', 0, 0},
        {"the trial does not lead there", &by_seconds, 't', 16000, 1999, 16, 0, false, 0, 0, 'c', 8, 4},
        {"nor there, and it is near enough", &by_seconds, 't', 3000, 1400, 16, 0, false, 0, 0, 'p', 0, 0},
        {"the trial overshoots", &by_seconds, 't', 3000, 12000, 16, 0, false, 0, 0, 'p', 0, 0},
        {"after a trial", &by_seconds, 'T', 0, 0, 16, 1, false, 0, 0, 'c', 8, 16},
        {"a noise target is validated", &by_noise, 'c', 1500, 0, 16, 0, false, 0, 0, 'v', 0, 0},
        {"too far to be validated", &by_noise, 'c', 4001, 0, 16, 3, false, 0, 0, 'c', 8, 4},
        {"after the validation", &by_noise, 'v', 1500, 0, 16, 0, true, 0, 0, 'p', 0, 0},
        {"validated once", &by_noise, 'c', 1500, 0, 4, 0, true, 3, 1, 'p', 0, 0},
        {"after the prediction", &by_noise, 'p', 1500, 0, 16, 0, true, 0, 0, 'P', 0, 0},
        {"after the first phase", &by_seconds, 'P', 1500, 0, 16, 0, false, 3, 1, 'c', 8, 4},
        {"after the last phase", &by_seconds, 'P', 1500, 0, 4, 0, false, 3, 3, 'e', 0, 0},
        {"far in a phase: no trial", &by_seconds, 'c', 3999, 0, 4, 0, false, 3, 1, 'p', 0, 0},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const step_case *c = &cases[i];
        ca_auto_situation s = situation_of(c->goal, step_of(c->done));
        s.best.light_paths = c->best;
        s.tried.light_paths = c->tried;
        s.reach = c->reach;
        s.trials = c->trials;
        s.validated = c->validated;
        s.schedule = (ca_auto_schedule){.count = c->phases, .done = c->phases_done, .ends = {20.0, 50.0, 100.0}};
        const ca_auto_decision d = ca_auto_decide(&s);
        if (d.step != step_of(c->expected)) fail_msg("%s: %c instead of %c", c->what, letters[d.step], c->expected);
        if (d.limits.iterations != c->expected_iterations || d.limits.reach != c->expected_reach)
            fail_msg("%s: limits %u, %u", c->what, d.limits.iterations, d.limits.reach);
        if (c->expected_reach) assert_near(c->what, d.limits.timed_light_paths, 1000.0);
    }
}

static void test_the_end(void **state)
{
    (void)state;
    static const struct {
        const char *what;
        ca_auto_goal goal;
        double seconds, camera_paths, noise, target;
        bool stopped, expected;
    } cases[] = {
        {"samples are missing", {.samples = 1000}, 50, 999, UNKNOWN, 0, false, false},
        {"samples are done", {.samples = 1000}, 50, 1000, UNKNOWN, 0, false, true},
        {"out of time before the samples", {.samples = 1000, .seconds = 50}, 50, 10, UNKNOWN, 0, false, true},
        {"time is left", {.seconds = 50}, 49.9, 10, UNKNOWN, 0, false, false},
        {"out of time", {.seconds = 50}, 50, 10, UNKNOWN, 0, false, true},
        {"noisy", {0, 0, 0, 0}, 50, 10, 2, 2, false, false},
        {"at the target", {0, 0, 0, 0}, 50, 10, 1.99, 2, false, true},
        {"the noise is not known", {0, 0, 0, 0}, 50, 10, UNKNOWN, 2, false, false},
        {"at the target before the time", {.seconds = 100}, 50, 10, 1, 2, false, true},
        {"stopped", {.seconds = 100}, 1, 10, UNKNOWN, 0, true, true},
    };
    static const ca_auto_step after[] = {CA_AUTO_PILOT, CA_AUTO_TRIAL, CA_AUTO_VALIDATE, CA_AUTO_PREDICT,
                                         CA_AUTO_PHASE};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++)
        for (size_t k = 0; k < sizeof after / sizeof after[0]; k++) {
            ca_auto_situation s = situation_of(&cases[i].goal, after[k]);
            s.progress = progress_of(cases[i].seconds, cases[i].camera_paths, cases[i].noise, cases[i].target);
            s.progress.stopped = cases[i].stopped;
            s.schedule = (ca_auto_schedule){.count = 3, .done = 1, .ends = {20.0, 50.0, 1000.0}};
            if ((ca_auto_decide(&s).step == CA_AUTO_END) != cases[i].expected)
                fail_msg("%s, after step %d", cases[i].what, (int)after[k]);
        }
}

/* ---- Runs ------------------------------------------------------------------------------------------------------ */

static void test_trial(void **state)
{
    (void)state;
    ca_auto_situation s = situation_of(&by_samples, CA_AUTO_CHOOSE_TRIAL);
    s.best.light_paths = 16000.0;
    s.share = 0.5;
    const ca_auto_run run = ca_auto_decide(&s).run;
    assert_true(run.numbers == CA_AUTO_TRIED && run.measures && !run.predicts);
    assert_true(run.least == 3 && run.most == 3 && run.begin == 100.0 && isinf(run.end));
    assert_near("a quarter as efficient", run.share, 0.125);
    assert_near("by the law", run.expected_variance, 0.8);
    s.tried.cost = 0.5; /* by estimates: no trial is worth more than what follows */
    assert_near("more efficient", ca_auto_decide(&s).run.share, 0.5);
}

static void test_validation(void **state)
{
    (void)state;
    ca_auto_situation s = situation_of(&by_noise, CA_AUTO_CHOOSE);
    const ca_auto_run run = ca_auto_decide(&s).run;
    assert_true(run.numbers == CA_AUTO_BEST && run.measures && !run.predicts && run.least == 6);
    assert_near("begin", run.begin, 10.0);
    assert_near("four seconds", run.end, 14.0);
    assert_near("share", run.share, 1.0);
    assert_near("by the law", run.expected_variance, 0.5);
}

static void test_predictions(void **state)
{
    (void)state;
    static const struct {
        const char *what;
        bool validated;
        double law, law_error, measured, expected_variance, expected_seconds;
    } cases[] = {
        {"by the law", false, 0.5, 1.0, 0.0, 0.5, 0.25},
        {"as wrong as before", false, 0.5, 1.5, 0.9, 0.75, 0.25},
        {"the law says nothing: as efficient as before", false, -0.1, 1.5, 0.9, 0.9 * 0.4 / 0.25, 0.25},
        {"nothing is known", false, 0.0, 1.0, 0.0, 0.0, 0.25},
        {"by the validation", true, 0.5, 1.5, 0.9, 0.9, 0.3},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        ca_auto_situation s = situation_of(cases[i].validated ? &by_noise : &by_seconds,
                                           cases[i].validated ? CA_AUTO_VALIDATE : CA_AUTO_CHOOSE);
        s.best.relative_variance = cases[i].law;
        s.law_error = cases[i].law_error;
        s.measured_variance = cases[i].measured;
        s.iteration_seconds = 0.4;
        s.plain_seconds = 0.3;
        const ca_auto_decision d = ca_auto_decide(&s);
        assert_true(d.step == CA_AUTO_PREDICT);
        assert_near(cases[i].what, d.prediction.relative_variance, cases[i].expected_variance);
        assert_near(cases[i].what, d.prediction.seconds, cases[i].expected_seconds);
    }
}

static void test_schedule(void **state)
{
    (void)state;
    static const struct {
        const char *what;
        const ca_auto_goal *goal;
        bool validated;
        double paths, seconds, predicted; /* of an iteration: camera paths, seconds; the target's time */
        uint32_t count;
        double ends[CA_AUTO_MOST_PHASES];
    } cases[] = {
        {"28 iterations of samples",
         &by_samples,
         false,
         900.0 / 28.1,
         50,
         0,
         3,
         {100 + 900. / 7, 100 + 2700. / 7, 1000}},
        {"27 iterations", &by_samples, false, 900.0 / 27.9, 0.01, 0, 2, {400, 1000, 0}},
        {"16 iterations", &by_samples, false, 900.0 / 16.1, 0.01, 0, 2, {400, 1000, 0}},
        {"15 iterations", &by_samples, false, 900.0 / 15.9, 0.01, 0, 1, {1000, 0, 0}},
        {"28 iterations of seconds", &by_seconds, false, 1, 90.0 / 28.1, 0, 3, {10 + 90. / 7, 10 + 270. / 7, 100}},
        {"15 iterations of seconds", &by_seconds, false, 1, 6, 0, 1, {100, 0, 0}},
        {"a predicted time", &by_noise, true, 1, 1e6, 80, 3, {20, 40, FOREVER}},
        {"a short predicted time", &by_noise, true, 1, 1e6, 13.4, 2, {10 + 3.4 / 3, FOREVER, 0}},
        {"a long predicted time", &by_noise, true, 1, 1e6, 1e6, 3, {50, 130, FOREVER}},
        {"a predicted time that is over", &by_noise, true, 1, 1e6, 9, 1, {FOREVER, 0, 0}},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        ca_auto_situation s = situation_of(cases[i].goal, CA_AUTO_PREDICT);
        s.best.camera_paths = cases[i].paths;
        s.best.seconds = cases[i].seconds;
        s.plain_seconds = 0.2; /* of a validation */
        s.validated = cases[i].validated;
        s.progress.looks.seconds_predicted = cases[i].predicted;
        const ca_auto_decision d = ca_auto_decide(&s);
        assert_true(d.step == CA_AUTO_PHASE);
        if (d.schedule.count != cases[i].count) fail_msg("%s: %u phases", cases[i].what, d.schedule.count);
        for (uint32_t k = 0; k < d.schedule.count; k++)
            assert_near(cases[i].what, d.schedule.ends[k], cases[i].ends[k]);
        assert_near(cases[i].what, d.run.begin, cases[i].goal == &by_samples ? 100.0 : 10.0);
        assert_near(cases[i].what, d.run.end, cases[i].ends[0]);
        assert_true(d.schedule.done == 1 && d.run.measures == (cases[i].count > 1));
        assert_true(d.run.numbers == (cases[i].validated ? CA_AUTO_UNCHANGED : CA_AUTO_BEST));
    }
}

/* Phases lie where they were planned, whenever the one before has ended. */
static void test_later_phases(void **state)
{
    (void)state;
    ca_auto_situation s = situation_of(&by_seconds, CA_AUTO_PREDICT);
    s.schedule = (ca_auto_schedule){.count = 3, .done = 1, .begin = 5.0, .ends = {9.0, 40.0, 100.0}};
    s.share = 0.25;
    s.validated = true;
    ca_auto_decision d = ca_auto_decide(&s);
    assert_true(d.run.begin == 9.0 && d.run.end == 40.0 && d.run.share == 0.25 && d.schedule.done == 2);
    assert_true(d.run.measures && d.run.predicts && d.run.least == 2 && d.run.numbers == CA_AUTO_BEST);
    s.schedule.done = 2;
    d = ca_auto_decide(&s);
    assert_true(d.run.begin == 40.0 && d.run.end == 100.0 && !d.run.measures && d.schedule.done == 3);
}

/* ---- What is noted --------------------------------------------------------------------------------------------- */

static void test_notes_of_runs(void **state)
{
    (void)state;
    static const struct {
        const char *what;
        double measured, expected, law_error, measured_after;
        bool measures;
        double timed_after;
    } cases[] = {
        {"twice the law's", 1.0, 0.5, 2.0, 1.0, true, 7000.0},
        {"it did not measure times", 1.0, 0.5, 2.0, 1.0, false, 1000.0},
        {"the law expected nothing", 1.0, -0.5, 3.0, 1.0, true, 7000.0},
        {"the noise is not known", (double)NAN, 0.5, 3.0, 0.7, true, 7000.0},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        ca_auto_situation s = situation_of(&by_seconds, CA_AUTO_PREDICT);
        s.law_error = 3.0;
        s.measured_variance = 0.7;
        ca_auto_decision d = ca_auto_decide(&s);
        d.run.measures = cases[i].measures;
        d.run.expected_variance = cases[i].expected;
        const ca_auto_outcome outcome = {.progress = progress_of(20.0, 200.0, 3.0, 0.0),
                                         .light_paths = 7000.0,
                                         .relative_variance = cases[i].measured,
                                         .iteration_seconds = 0.5,
                                         .plain_seconds = 0.4};
        const ca_auto_situation after = ca_auto_note(&s, &d, &outcome);
        assert_near(cases[i].what, after.law_error, cases[i].law_error);
        assert_near(cases[i].what, after.measured_variance, cases[i].measured_after);
        assert_near(cases[i].what, after.timed_light_paths, cases[i].timed_after);
        assert_near(cases[i].what, after.plain_seconds, cases[i].measures ? 0.4 : 0.0);
        assert_true(after.done == CA_AUTO_PHASE && after.schedule.done == 1 && after.progress.seconds == 20.0);
    }
}

/* Trials take their part of what is left before each; all shares together are those of the whole work. */
static void test_shares_of_trials(void **state)
{
    (void)state;
    static const struct {
        const char *what;
        const ca_auto_goal *goal;
        double worth, work, share_after;
    } cases[] = {
        {"worth as much", &by_samples, 1.0, 90.0, 0.5},
        {"worth half", &by_samples, 0.5, 90.0, 0.5 * (900 - 45) / 810.},
        {"worth nothing", &by_seconds, 0.0, 9.0, 0.5 * 90 / 81.},
        {"to a noise target", &by_noise, 0.5, 9.0, 0.5},
        {"to the very end", &by_seconds, 0.5, 90.0, 0.5},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        ca_auto_situation s = situation_of(cases[i].goal, CA_AUTO_CHOOSE_TRIAL);
        s.best = (ca_auto_candidate){.light_paths = 16000.0, .cost = cases[i].worth};
        s.tried = (ca_auto_candidate){.light_paths = 8000.0, .cost = 1.0};
        s.share = 0.5;
        const ca_auto_decision d = ca_auto_decide(&s);
        ca_auto_outcome outcome = {.progress = s.progress, .light_paths = 8000.0};
        outcome.progress.seconds += cases[i].work;
        outcome.progress.camera_paths += cases[i].work;
        const ca_auto_situation after = ca_auto_note(&s, &d, &outcome);
        assert_true(after.trials == 1);
        assert_near(cases[i].what, after.share, cases[i].share_after);
        const double left = ca_auto_work_end(cases[i].goal) - ca_auto_work(cases[i].goal, &s.progress);
        if (!isfinite(left) || left <= cases[i].work) continue;
        const double of_trial = ca_auto_run_share(&d.run, ca_auto_work(cases[i].goal, &after.progress));
        assert_near("all shares", of_trial + after.share * (left - cases[i].work), 0.5 * left);
    }
}

static void test_notes_of_choices(void **state)
{
    (void)state;
    const ca_auto_situation s = situation_of(&by_seconds, CA_AUTO_PILOT);
    const ca_auto_outcome outcome = {.progress = s.progress, .candidate = {.light_paths = 77.0}};
    ca_auto_decision d = {.step = CA_AUTO_CHOOSE, .limits = {.reach = 4}};
    ca_auto_situation after = ca_auto_note(&s, &d, &outcome);
    assert_true(after.best.light_paths == 77.0 && after.tried.light_paths == 8000.0 && after.reach == 4);
    d.step = CA_AUTO_CHOOSE_TRIAL;
    after = ca_auto_note(&s, &d, &outcome);
    assert_true(after.best.light_paths == 1500.0 && after.tried.light_paths == 77.0 && after.trials == 0);
    d.step = CA_AUTO_VALIDATE;
    assert_true(ca_auto_note(&s, &d, &outcome).validated && !s.validated);
}

/* ---- Limits ---------------------------------------------------------------------------------------------------- */

static void test_iterations_left(void **state)
{
    (void)state;
    static const struct {
        const char *what;
        ca_auto_goal goal;
        double noise, target, seconds, paths, variance, expected;
    } cases[] = {
        /* 10 s and 100 camera paths are done */
        {"time", {.seconds = 100}, 6, 0, 3, 4, 0.5, 30},
        {"time and noise: time", {.seconds = 100}, 6, 2, 3, 4, 0.5, 30},
        {"samples", {.samples = 1000}, 6, 0, 3, 4, 0.5, 225},
        {"longer than all before it", {.samples = 1000}, 6, 0, 10.1, 4, 0.5, 0},
        {"a target", {0, 0, 0, 0}, 6, 2, 3, 4, 0.5, 0.5 * (2500 - 10000 / 36.)},
        {"a target, longer than all before it", {0, 0, 0, 0}, 6, 2, 10.1, 4, 0.5, 0},
        {"a target that is reached", {0, 0, 0, 0}, 1, 2, 3, 4, 0.5, FOREVER},
        {"a target, noise not known", {0, 0, 0, 0}, UNKNOWN, 2, 3, 4, 0.5, FOREVER},
        {"a target, variance not known", {0, 0, 0, 0}, 6, 2, 3, 4, -0.5, FOREVER},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const ca_auto_progress progress = progress_of(10.0, 100.0, cases[i].noise, cases[i].target);
        const ca_auto_candidate candidate = {
            .camera_paths = cases[i].paths, .seconds = cases[i].seconds, .relative_variance = cases[i].variance};
        const double left = ca_auto_iterations_left(&cases[i].goal, &progress, &candidate);
        if (!(isinf(left) && isinf(cases[i].expected))) assert_near(cases[i].what, left, cases[i].expected);
    }
}

static void test_limits(void **state)
{
    (void)state;
    const ca_auto_limits near = {.timed_light_paths = 1000.0, .reach = 16};
    const ca_auto_limits far = {.timed_light_paths = 1e6, .reach = 16}, end = {.timed_light_paths = 1e9, .reach = 4};
    assert_int_equal(ca_auto_most_light_paths(&near, false), 16000);
    assert_int_equal(ca_auto_most_light_paths(&far, false), 1 << 22);
    assert_int_equal(ca_auto_most_light_paths(&far, true), 16000000);
    assert_int_equal(ca_auto_most_light_paths(&end, true), 1 << 30);
    const ca_auto_limits half = ca_auto_half_limits(321.0);
    assert_true(half.iterations == 8 && half.reach == 16 && half.timed_light_paths == 321.0);
    assert_near("passes by noise", ca_auto_passes_so_far(0.5, 5.0, 7.0), 200.0);
    assert_near("the variance is not known", ca_auto_passes_so_far(-0.5, 5.0, 7.0), 7.0);
    assert_near("the noise is not known", ca_auto_passes_so_far(0.5, UNKNOWN, 7.0), 7.0);
}

/* ---- Within a run ---------------------------------------------------------------------------------------------- */

static void test_roles(void **state)
{
    (void)state;
    const ca_auto_run measures = {.measures = true}, last = {.measures = false};
    for (uint32_t k = 0; k < 40; k++) {
        const ca_auto_role expected = k % 2 == 1 ? CA_AUTO_MEASURES_TIMES
                                      : k < 16   ? CA_AUTO_GATHERS_PAIRS
                                                 : CA_AUTO_PLAIN;
        assert_true(ca_auto_role_of(&measures, k) == expected && ca_auto_role_of(&last, k) == CA_AUTO_PLAIN);
    }
}

static void test_end_of_a_run(void **state)
{
    (void)state;
    static const struct {
        const char *what;
        uint32_t iterations, least, most;
        double seconds, end;
        bool stopped, expected;
    } cases[] = {
        {"one iteration, stopped", 1, 2, 9, 20, 15, true, false},
        {"two iterations, stopped", 2, 6, 9, 12, 15, true, true},
        {"past its end", 2, 2, 9, 15, 15, false, true},
        {"before its end", 2, 2, 9, 14.9, 15, false, false},
        {"past its end, too few iterations", 5, 6, 9, 15, 15, false, false},
        {"enough of them", 6, 6, 9, 15, 15, false, true},
        {"a trial", 3, 3, 3, 12, FOREVER, false, true},
        {"a trial at work", 2, 3, 3, 12, FOREVER, false, false},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const ca_auto_run run = {.least = cases[i].least, .most = cases[i].most, .end = cases[i].end};
        ca_auto_progress progress = progress_of(cases[i].seconds, 0.0, UNKNOWN, 0.0);
        progress.stopped = cases[i].stopped;
        if (ca_auto_run_is_over(&run, &by_seconds, &progress, cases[i].iterations) != cases[i].expected)
            fail_msg("%s", cases[i].what);
    }
    for (uint32_t k = 0; k < 40; k++) {
        const ca_auto_progress target = progress_of(1.0, 1.0, UNKNOWN, 2.0),
                               none = progress_of(1.0, 1.0, UNKNOWN, 0.0);
        assert_true(ca_auto_check_is_due(&target, k) == (k == 2 || k == 4 || k == 8 || k == 16 || k == 32));
        assert_false(ca_auto_check_is_due(&none, k));
    }
}

static void test_share_of_a_run(void **state)
{
    (void)state;
    const ca_auto_run run = {.begin = 10.0, .end = 20.0, .share = 0.5};
    assert_near("at work", ca_auto_run_share(&run, 14.0), 2.0);
    assert_near("past its end", ca_auto_run_share(&run, 23.0), 5.0);
    assert_near("the clock has not moved", ca_auto_run_share(&run, 10.0), 0.5e-9);
}

/* ---- Whole renders --------------------------------------------------------------------------------------------- */

/* A world in which 50,000 light paths are the best, if they may be chosen; iterations of the best numbers take 10 ms
 * and two camera paths. */
static ca_auto_candidate best_within(const ca_auto_limits *limits)
{
    const double most = (double)ca_auto_most_light_paths(limits, false);
    const double light_paths = fmin(50000.0, limits->iterations > 8 ? fmin(most, 9000.0) : most);
    return (ca_auto_candidate){.light_paths = light_paths,
                               .camera_paths = 2.0,
                               .cost = 50000.0 / light_paths,
                               .relative_variance = 1.0,
                               .seconds = 0.01};
}

static void run_made_up(const ca_auto_run *run, const ca_auto_situation *s, ca_auto_outcome *outcome)
{
    uint32_t iterations = 0;
    while (!ca_auto_run_is_over(run, &s->goal, &outcome->progress, iterations)) {
        iterations++;
        outcome->progress.seconds += 0.01;
        outcome->progress.camera_paths += 2.0;
        outcome->progress.looks.noise = 100.0 * sqrt(0.01 / outcome->progress.seconds);
    }
    outcome->light_paths = run->numbers == CA_AUTO_TRIED ? s->tried.light_paths : s->best.light_paths;
    outcome->relative_variance = 1.0;
    outcome->iteration_seconds = outcome->plain_seconds = 0.01;
}

/* Writes down the letters of its steps. */
static void simulate(const ca_auto_goal *goal, double target, char *steps, size_t room, ca_auto_situation *end)
{
    const ca_auto_progress progress = progress_of(2.0, 400.0, 7.0, target);
    size_t count = 0;
    *end = ca_auto_plan_start(goal, &progress, 1000.0);
    for (;;) {
        const ca_auto_decision d = ca_auto_decide(end);
        ca_auto_outcome outcome = {.progress = end->progress};
        assert_true(count + 1 < room);
        steps[count++] = letters[d.step];
        if (d.step == CA_AUTO_END) break;
        if (d.step == CA_AUTO_CHOOSE || d.step == CA_AUTO_CHOOSE_TRIAL) outcome.candidate = best_within(&d.limits);
        if (d.step == CA_AUTO_PREDICT) outcome.progress.looks.seconds_predicted = 25.0;
        if (d.run.most > 0) run_made_up(&d.run, end, &outcome);
        *end = ca_auto_note(end, &d, &outcome);
    }
    steps[count] = '\0';
}

static void test_whole_renders(void **state)
{
    (void)state;
    static const struct {
        ca_auto_goal goal;
        double target;
        const char *steps;
    } cases[] = {
        /* Best within reach 16,000, trial 9,000; then 50,000 within reach, its trial of 9,000 leads nowhere. */
        {{.seconds = 20}, 0, "ctTctcpPcpPcpPe"}, {{.samples = 2000}, 0, "ctTctcpPcpPcpPe"},
        {{0, 0, 0, 0}, 2.0, "ctTctcvpPcpPcpPe"}, {{0, 0, 0, 0}, 5.0, "ctTctcve"},
        {{.seconds = 2.02}, 0, "ctTe"},          {{.seconds = 20}, 5.0, "ctTctcpPe"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char steps[64];
        ca_auto_situation end;
        simulate(&cases[i].goal, cases[i].target, steps, sizeof steps, &end);
        if (strcmp(steps, cases[i].steps) != 0) fail_msg("%zu: %s instead of %s", i, steps, cases[i].steps);
        assert_true(end.trials == 1);
        if (cases[i].goal.samples > 0.0) assert_true(end.progress.camera_paths >= cases[i].goal.samples);
        if (cases[i].target > 0.0) assert_true(end.progress.looks.noise < cases[i].target);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_next_step),
        cmocka_unit_test(test_the_end),
        cmocka_unit_test(test_trial),
        cmocka_unit_test(test_validation),
        cmocka_unit_test(test_predictions),
        cmocka_unit_test(test_schedule),
        cmocka_unit_test(test_later_phases),
        cmocka_unit_test(test_notes_of_runs),
        cmocka_unit_test(test_shares_of_trials),
        cmocka_unit_test(test_notes_of_choices),
        cmocka_unit_test(test_iterations_left),
        cmocka_unit_test(test_limits),
        cmocka_unit_test(test_roles),
        cmocka_unit_test(test_end_of_a_run),
        cmocka_unit_test(test_share_of_a_run),
        cmocka_unit_test(test_whole_renders),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
