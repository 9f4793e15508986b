/* Error bars of bundled scenes: of the pixels that are not without noise, 93 % to 97 % of the ordinary 95 % intervals
 * hold the expectation, and 93 % at least of those that are widened (the table of docs/papers/000.md, with fewer
 * renders). */
#include "support/interval_tally.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

enum { SIDE = 32, RENDERS = 9, FEW = 3 * SIDE * SIDE / 10 };

static const char *scenes[] = {"caustics/caustics.xml", "cornell-box/cornell-box.xml", "furnace/furnace.xml",
                                     "glass-slab/glass-slab.xml", "mis/mis.xml", "textured/textured.xml"};
enum { SCENES = sizeof scenes / sizeof scenes[0] };

static const struct method {
    const char *integrator, *sampler;
    uint32_t samples, replicates;
} methods[] = {
    {"path", "independent", 512, 0},         {"path", "sobol", 1024, 64},
    {"bdpt", "independent", 256, 0},         {"bdpm:alpha=0", "independent", 256, 0},
    {"ovcm:alpha=0", "independent", 256, 0}, {"vcm:alpha=0", "independent", 256, 64},
};
enum { METHODS = sizeof methods / sizeof methods[0] };

static void check(const ca_scene *scene, const char *name, const struct method *m)
{
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.integrator = m->integrator;
    settings.sampler = m->sampler;
    settings.samples_per_pixel = m->samples;
    settings.replicates = m->replicates;
    settings.width = settings.height = SIDE;
    settings.seed = 500;
    const interval_tally tally = tally_intervals(scene, &settings, RENDERS, "G");
    const uint64_t judged = tally.held + tally.below + tally.above;
    const double held = tally_fraction(&tally);
    const double widened = tally_widened_fraction(&tally);
    printf("    %-28s %-13s %-12s %.2f %% held of %u, %.2f %% of %u widened, %.1f %% marked\n", name, m->integrator,
           m->sampler, 100.0 * held, (unsigned)judged, 100.0 * widened, (unsigned)tally.widened,
           100.0 * (double)tally.marked / (double)tally.pixels);
    if (judged >= FEW && !(held > 0.93 && held < 0.97))
        fail_msg("%s, %s, %s: %.4f", name, m->integrator, m->sampler, held);
    if (tally.widened >= FEW && !(widened > 0.93))
        fail_msg("%s, %s, %s: %.4f of the widened", name, m->integrator, m->sampler, widened);
}

static void test_scene(void **state)
{
    const char *const *name = *state;
    char path[512];
    ca_scene *scene;
    ca_error error;
    snprintf(path, sizeof path, "%s/scenes/%s", CA_SOURCE_DIR, *name);
    if (ca_scene_load(path, NULL, 0, &scene, &error) != CA_OK) fail_msg("%s", error.message);
    for (int k = 0; k < METHODS; k++) check(scene, *name, &methods[k]);
    ca_scene_release(scene);
}

int main(void)
{
    struct CMUnitTest tests[SCENES];
    for (int i = 0; i < SCENES; i++)
        tests[i] = (struct CMUnitTest){.name = scenes[i], .test_func = test_scene, .initial_state = &scenes[i]};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
