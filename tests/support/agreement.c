#include "support/agreement.h"

#include "metrics/compare.h"
#include "metrics/significance.h"
#include "support/batches.h"
#include "support/closed_forms.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { BATCHES = 24, PILOT_SAMPLES = 3 };
static const double family_alpha = 0.01, suspicious_alpha = 0.05;

static unsigned cannot(const char *integrator)
{
    if (strncmp(integrator, "light", 5) == 0) return NEEDS_SPECULAR_VIEW | NEEDS_NARROW_VIEW | NEEDS_SDS;
    if (strncmp(integrator, "path", 4) == 0 || strstr(integrator, "no-splat")) return NEEDS_CAUSTICS | NEEDS_SDS;
    if (strncmp(integrator, "bdpt", 4) == 0) return NEEDS_SDS;
    return 0;
}

static uint64_t count_comparisons(const agreement_settings *settings)
{
    uint64_t count = 0;
    for (size_t s = 0; s < agreement_scene_count(); s++)
        for (size_t i = 0; settings->integrators[i]; i++)
            count += settings->wanted(agreement_scene_at(s)) &&
                     !(agreement_scene_at(s)->needs & cannot(settings->integrators[i]));
    return count;
}

/* The samples of a batch that show a bias of the target's size. */
static uint32_t samples_of_batch(const ca_scene *scene, const char *integrator, const agreement_settings *settings)
{
    const batch_settings batch = {.integrator = integrator,
                                  .samples = PILOT_SAMPLES,
                                  .batches = BATCHES,
                                  .seed = seed_of(integrator) + 2 * BATCHES,
                                  .block_side = AGREEMENT_BLOCK};
    ca_image_layers *pilot = render_batches(scene, &batch);
    const double detectable = detectable_block_bias(pilot, pilot, suspicious_alpha);
    ca_image_release(pilot);
    assert_true(isfinite(detectable));
    /* 20 % more, for the pilot knows its noise roughly */
    const double samples = 1.2 * PILOT_SAMPLES * pow(detectable / settings->target, 2.0);
    return (uint32_t)ceil(fmin(samples, (double)settings->max_samples / BATCHES));
}

/* An integrator's picture of the scene, in blocks. `look` 0 or 1. */
static ca_image_layers *picture(const ca_scene *scene, const char *integrator, uint32_t samples, uint32_t look)
{
    const batch_settings batch = {.integrator = integrator,
                                  .samples = look ? 4 * samples : samples,
                                  .batches = BATCHES,
                                  .seed = seed_of(integrator) + look * BATCHES,
                                  .block_side = AGREEMENT_BLOCK};
    return render_batches(scene, &batch);
}

typedef struct contender {
    const char *name;
    uint32_t samples; /* of a batch */
    ca_image_layers *image;
} contender;

static contender contender_for(const ca_scene *scene, const char *integrator, const agreement_settings *settings)
{
    const uint32_t samples = samples_of_batch(scene, integrator, settings);
    return (contender){integrator, samples, picture(scene, integrator, samples, 0)};
}

static ca_comparison compare_blocks(const ca_image_layers *image, const ca_image_layers *reference)
{
    ca_comparison comparison;
    ca_error error;
    if (ca_compare(image, reference, &(ca_compare_settings){.block_side = 1}, &comparison, &error) != CA_OK)
        fail_msg("%s", error.message);
    return comparison;
}

static bool differs_at_second_look(const ca_scene *scene, const contender *one, const contender *reference,
                                   const agreement_settings *settings)
{
    ca_image_layers *image = picture(scene, one->name, one->samples, 1);
    ca_image_layers *other = picture(scene, reference->name, reference->samples, 1);
    const ca_comparison comparison = compare_blocks(image, other);
    const double alpha = ca_sidak_alpha(family_alpha, count_comparisons(settings));
    const bool differs = comparison.test.p_value < alpha;
    print_message("      again: mean %+6.2f %%, p %.2g, detectable bias %.2f %%%s\n",
                  100.0 * (comparison.mean_luminance / comparison.reference_mean_luminance - 1.0),
                  comparison.test.p_value, 100.0 * detectable_block_bias(image, other, alpha),
                  differs ? "  DIFFERS" : "");
    ca_image_release(image);
    ca_image_release(other);
    return differs;
}

static void compare(const ca_scene *scene, const char *scene_name, const contender *one, const contender *reference,
                    const agreement_settings *settings, agreement_result *result)
{
    const ca_comparison comparison = compare_blocks(one->image, reference->image);
    const double p = comparison.test.p_value;
    const double detectable = detectable_block_bias(one->image, reference->image, suspicious_alpha);
    result->comparisons++;
    result->largest_detectable = fmax(result->largest_detectable, detectable);
    print_message("    %-46s %-34s %5u spp, mean %+6.2f %%, p %.3f, detectable bias %.2f %%\n", scene_name, one->name,
                  one->samples * BATCHES,
                  100.0 * (comparison.mean_luminance / comparison.reference_mean_luminance - 1.0), p,
                  100.0 * detectable);
    if (p >= suspicious_alpha) return;
    result->suspicious++;
    result->failed += differs_at_second_look(scene, one, reference, settings);
}

void compare_integrators(const agreement_scene *scene, const agreement_settings *settings, agreement_result *result)
{
    ca_scene *loaded = agreement_scene_load(scene);
    const contender reference = contender_for(loaded, scene->needs & cannot("path") ? "bdpt" : "path", settings);
    for (size_t i = 0; settings->integrators[i]; i++) {
        if (scene->needs & cannot(settings->integrators[i])) {
            result->skipped++;
            continue;
        }
        char integrator[128];
        integrator_text(settings->integrators[i], (double)scene->radius, integrator, sizeof integrator);
        const contender one = contender_for(loaded, integrator, settings);
        compare(loaded, scene->name, &one, &reference, settings, result);
        ca_image_release(one.image);
    }
    ca_image_release(reference.image);
    ca_scene_release(loaded);
}

double suspicious_p_value(const agreement_result *result)
{
    const double n = result->comparisons;
    double sum = 0.0;
    for (uint32_t k = result->suspicious; k <= result->comparisons; k++)
        sum += exp(lgamma(n + 1.0) - lgamma(k + 1.0) - lgamma(n - k + 1.0) + k * log(suspicious_alpha) +
                   (n - k) * log1p(-suspicious_alpha));
    return sum;
}
