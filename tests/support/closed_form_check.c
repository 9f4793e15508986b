#include "support/closed_forms.h"

#include "film/significance.h"
#include "support/batches.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

enum { BATCHES = 10, PILOT_SAMPLES = 2 };
static const double t_95 = 2.262; /* Student's two-sided quantile for nine degrees of freedom */
static const double family_alpha = 0.01;
static const char *const samplers[] = {"independent", "sobol"};

static size_t sensors_of(const closed_form *form) { return form->sensor ? 1 : GENERAL_SENSORS; }

/* All cases of all variants: how often a false alarm could happen. */
static uint64_t case_count(void)
{
    uint64_t count = 0;
    for (size_t v = 0; v < integrator_variant_count(); v++)
        for (size_t i = 0; i < closed_form_count(); i++)
            if (!(closed_form_at(i)->needs & integrator_variant_at(v)->cannot))
                count += 2 * sensors_of(closed_form_at(i));
    return count;
}

/* As many samples as the noise of a pilot with other seeds asks for. (Judging the pilot itself would prefer pilots that
 * look less noisy than they are.) */
static measured measure(const ca_scene *scene, const char *integrator, const char *sampler, double expected,
                        const closed_form_effort *effort)
{
    batch_settings settings = {.integrator = integrator,
                               .sampler = sampler,
                               .samples = PILOT_SAMPLES,
                               .batches = BATCHES,
                               .seed = seed_of(integrator) + BATCHES};
    const measured pilot = measure_mean(scene, &settings);
    const double error = t_95 * pilot.error / expected, aim = 0.55 * effort->tolerance;
    const double samples = fmax(PILOT_SAMPLES, ceil(PILOT_SAMPLES * pow(error / aim, 2.0)));
    settings.samples = (uint32_t)fmin(samples, effort->max_samples);
    settings.seed = seed_of(integrator);
    return measure_mean(scene, &settings);
}

static void check(const closed_form *form, size_t sensor, const char *integrator, const char *sampler,
                  const closed_form_effort *effort, closed_form_tally *tally)
{
    ca_scene *scene = closed_form_scene(form, sensor);
    const double expected = closed_form_expected(form);
    const measured value = measure(scene, integrator, sampler, expected, effort);
    ca_scene_release(scene);
    const double deviation = fabs(value.mean / expected - 1.0), error = value.error / expected;
    /* 2e-5: rounding of single precision, for scenes without noise */
    const double p = p_value_of(value, expected, 2e-5 * expected);
    tally->cases++;
    tally->largest_deviation = fmax(tally->largest_deviation, deviation);
    tally->largest_error = fmax(tally->largest_error, error);
    const bool precise = deviation <= effort->tolerance && t_95 * error <= effort->tolerance;
    if (precise && p >= ca_sidak_alpha(family_alpha, case_count())) return;
    tally->failed++;
    print_message("    %s: %s, %s, %s: expected %.5f, got %.5f +- %.5f (p = %.2g)\n", integrator, form->name,
                  form->sensor ? "own sensor" : general_sensor_name(sensor), sampler, expected, value.mean, value.error, p);
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
        for (size_t k = 0; k < 2 * sensors; k++)
            if (effort->all_cases || k == (7 * variant + i) % (2 * sensors))
                check(form, k / 2, integrator, samplers[k % 2], effort, &tally);
    }
    print_message("    %s: %u cases, largest deviation %.2f %%, largest standard error %.2f %%\n", v->text, tally.cases,
                  100.0 * tally.largest_deviation, 100.0 * tally.largest_error);
    return tally;
}
