#include "support/closed_forms.h"

#include "metrics/significance.h"
#include "support/batches.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

enum { BATCHES = 20 };
static const double t_95 = 2.093; /* Student's two-sided quantile for 19 degrees of freedom */
/* Of the tolerance: how well a mean is measured (95 % confidence), and what is aimed at, for pilots know their noise
 * roughly. */
static const double precision_needed = 0.65, precision_aimed = 0.55;
static const double family_alpha = 0.01;
/* All that a seed makes independent of another: the plain ones are the same whatever the seed. */
static const char *const samplers[] = {"independent", "sobol", "halton", "zsobol", "lattice"};
enum { SAMPLERS = sizeof samplers / sizeof samplers[0] };

static size_t sensors_of(const closed_form *form) { return form->sensor ? 1 : GENERAL_SENSORS; }

/* All cases of all variants: how often a false alarm could happen. */
static uint64_t case_count(void)
{
    uint64_t count = 0;
    for (size_t v = 0; v < integrator_variant_count(); v++)
        for (size_t i = 0; i < closed_form_count(); i++)
            if (!(closed_form_at(i)->needs & integrator_variant_at(v)->cannot))
                count += SAMPLERS * sensors_of(closed_form_at(i));
    return count;
}

typedef struct closed_form_case {
    const char *integrator, *sampler;
    const ca_scene *scene;
    double expected, tolerance;
    uint32_t step, max_samples;
} closed_form_case;

/* Measures to `precision` times the tolerance: as many samples as the noise of the attempt before asks for, and other
 * seeds; the first attempt is a pilot. (Judging the pilot itself would prefer pilots that look less noisy than they
 * are.) */
static measured measure(const closed_form_case *c, double precision, uint64_t seed)
{
    batch_settings settings = {.integrator = c->integrator,
                               .sampler = c->sampler,
                               .samples = c->step,
                               .batches = BATCHES,
                               .seed = seed};
    const double aim = precision * precision_aimed * c->tolerance,
                 limit = precision * precision_needed * c->tolerance;
    measured value = measure_mean(c->scene, &settings);
    for (int attempt = 0; attempt < 3; attempt++) {
        const double error = t_95 * value.error / c->expected;
        const double samples = c->step * ceil(settings.samples * pow(error / aim, 2.0) / c->step);
        settings.samples = (uint32_t)fmin(fmax(samples, settings.samples), c->max_samples);
        settings.seed += BATCHES;
        value = measure_mean(c->scene, &settings);
        if (t_95 * value.error <= limit * c->expected) break;
    }
    return value;
}

static bool is_close(const closed_form_case *c, measured value)
{
    const double deviation = fabs(value.mean / c->expected - 1.0), error = value.error / c->expected;
    /* 2e-5: rounding of single precision, for scenes without noise */
    const double p = p_value_of(value, c->expected, 2e-5 * c->expected);
    return deviation <= c->tolerance && t_95 * error <= precision_needed * c->tolerance &&
           p >= ca_sidak_alpha(family_alpha, case_count());
}

static void check(const closed_form *form, size_t sensor, const char *integrator, uint32_t step, const char *sampler,
                  const closed_form_effort *effort, closed_form_tally *tally)
{
    ca_scene *scene = closed_form_scene(form, sensor);
    const closed_form_case c = {.integrator = integrator,
                                .sampler = sampler,
                                .scene = scene,
                                .expected = closed_form_expected(form),
                                .tolerance = effort->tolerance,
                                .step = step,
                                .max_samples = effort->max_samples};
    measured value = measure(&c, 1.0, seed_of(integrator));
    bool close = is_close(&c, value);
    if (!close) { /* by chance? Again, twice as precisely */
        value = measure(&c, 0.5, seed_of(integrator) + 1000);
        close = is_close(&c, value);
    }
    ca_scene_release(scene);
    tally->cases++;
    tally->largest_deviation = fmax(tally->largest_deviation, fabs(value.mean / c.expected - 1.0));
    tally->largest_error = fmax(tally->largest_error, value.error / c.expected);
    if (close) return;
    tally->failed++;
    print_message("    %s: %s, %s, %s: expected %.5f, got %.5f +- %.5f\n", integrator, form->name,
                  form->sensor ? "own sensor" : general_sensor_name(sensor), sampler, c.expected, value.mean,
                  value.error);
}

closed_form_tally check_closed_forms(size_t variant, const closed_form_effort *effort)
{
    const integrator_variant *v = integrator_variant_at(variant);
    closed_form_tally tally = {0};
    for (size_t i = 0; i < closed_form_count(); i++) {
        const closed_form *form = closed_form_at(i);
        if (form->needs & v->cannot) continue;
        char integrator[128];
        integrator_text(v->text, (double)form->radius, integrator, sizeof integrator);
        const size_t sensors = sensors_of(form);
        for (size_t k = 0; k < SAMPLERS * sensors; k++)
            if ((effort->all_cases && !v->in_turns) || k == (7 * variant + i) % (SAMPLERS * sensors))
                check(form, k / SAMPLERS, integrator, v->step, samplers[k % SAMPLERS], effort, &tally);
    }
    print_message("    %s: %u cases, largest deviation %.2f %%, largest standard error %.2f %%\n", v->text,
                  tally.cases, 100.0 * tally.largest_deviation, 100.0 * tally.largest_error);
    return tally;
}

/* A variant's test. */
typedef struct variant_test {
    size_t variant;
    const closed_form_effort *effort;
} variant_test;

static void test_variant(void **state)
{
    const variant_test *test = *state;
    const closed_form_tally tally = check_closed_forms(test->variant, test->effort);
    assert_true(tally.cases > 0);
    assert_int_equal(tally.failed, 0);
}

int run_closed_forms(int argc, char **argv, const closed_form_effort *effort)
{
    enum { MOST = 32 };
    struct CMUnitTest tests[MOST] = {{0}};
    variant_test variants[MOST];
    if (argc > 1) cmocka_set_test_filter(argv[1]);
    const size_t count = integrator_variant_count();
    assert_true(count <= MOST);
    for (size_t i = 0; i < count; i++) {
        variants[i] = (variant_test){i, effort};
        tests[i] = (struct CMUnitTest){
            .name = integrator_variant_at(i)->text, .test_func = test_variant, .initial_state = &variants[i]};
    }
    return _cmocka_run_group_tests("closed forms", tests, count, NULL, NULL);
}
