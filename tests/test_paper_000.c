/* The scenes of paper 000 (Ershov, Birukov, Voloboy, Galaktionov, "Calculation of Noise Components for Bidirectional
 * Path Tracing with Photon Maps") with few paths: the law of three terms holds on each, each has the terms that it is
 * there for, and one measurement tells the noise of other numbers of paths. */
#include "support/scene_text.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

typedef struct scene_case {
    const char *name, *integrator;
    const char *light_y; /* NULL: it has none */
    double radius;
    uint32_t resolution, x0, y0; /* of a square of SIDE pixels */
} scene_case;

enum { SIDE = 16 };
enum { PAPER, WATER, TILES, FEW, GLASS, SCENES };

static const scene_case cases[SCENES] = {
    {"cornell-point", "bdpm:camera_diffuse_depth=1,merges=last", "0.15", 0.03464, 96, 15, 78},
    {"water-caustic", "bdpm", NULL, 0.01, 64, 24, 24},
    {"blurred-tiles", "bdpm", NULL, 0.05, 64, 24, 24},
    {"few-merges", "bdpm", NULL, 0.0005, 64, 24, 24},
    {"behind-glass", "bdpm", NULL, 0.01, 64, 24, 24},
};

static ca_noise *measure(const scene_case *c, uint32_t light_paths, uint32_t camera_paths, uint32_t iterations,
                         uint64_t seed)
{
    char path[512];
    const ca_define define = {"light_y", c->light_y};
    ca_render_settings settings;
    ca_scene *scene = NULL;
    ca_noise *noise = NULL;
    ca_error error = {""};
    snprintf(path, sizeof path, CA_SOURCE_DIR "/scenes/paper-000/%s.xml", c->name);
    if (ca_scene_load(path, &define, c->light_y ? 1 : 0, &scene, &error) != CA_OK) fail_msg("%s", error.message);
    ca_render_settings_init(&settings);
    settings.integrator = c->integrator;
    settings.radius = c->radius;
    settings.width = settings.height = c->resolution;
    settings.has_crop = true;
    memcpy(settings.crop, (const uint32_t[4]){c->x0, c->y0, c->x0 + SIDE, c->y0 + SIDE}, sizeof settings.crop);
    settings.light_paths = light_paths;
    settings.camera_paths = camera_paths;
    settings.seed = seed;
    settings.has_seed = true;
    settings.threads = 1;
    if (ca_noise_measure(scene, &settings, iterations, &noise, NULL, NULL, &error) != CA_OK)
        fail_msg("%s", error.message);
    ca_scene_release(scene);
    return noise;
}

static ca_noise_summary predict(const ca_noise *noise, uint32_t light_paths, uint32_t camera_paths)
{
    ca_noise_summary summary;
    ca_error error = {""};
    if (ca_noise_average(noise, NULL, light_paths, camera_paths, &summary, &error) != CA_OK)
        fail_msg("%s", error.message);
    return summary;
}

/* Predicted against measured, averages over the square, in the iterations themselves and in others with more
 * paths. */
static void test_law(void **state)
{
    static const uint32_t iterations[SCENES] = {300, 300, 240, 900, 300};
    (void)state;
    for (int s = 0; s < SCENES; s++) {
        ca_noise *few = measure(&cases[s], 2000, 6, iterations[s], 1),
                 *more = measure(&cases[s], 6000, 12, iterations[s] / 3, 2);
        const ca_noise_summary own = predict(few, 2000, 6), other = predict(few, 6000, 12),
                               there = predict(more, 6000, 12);
        const double same = sqrt(own.measured / own.predicted), ahead = sqrt(there.measured / other.predicted);
        print_message("    %-14s measured / predicted %.4f, three times the light and twice the camera paths %.4f\n",
                      cases[s].name, same, ahead);
        assert_true(fabs(same - 1.0) < 0.02);
        assert_true(fabs(ahead - 1.0) < 0.06);
        ca_noise_release(few);
        ca_noise_release(more);
    }
}

/* At 300,000 light and 100 camera paths. */
static void test_dominant_terms(void **state)
{
    (void)state;
    for (int s = 0; s < SCENES; s++) {
        ca_noise *noise = measure(&cases[s], 12000, 10, 16, 3);
        const ca_noise_summary n = predict(noise, 300000, 100);
        const double camera = n.camera / n.predicted, light = n.light / n.predicted, pair = n.pair / n.predicted;
        print_message("    %-14s camera %.3f, light %.3f, pair %.3f of the variance\n", cases[s].name, camera, light,
                      pair);
        if (s == PAPER || s == TILES) assert_true(camera > 0.75);
        if (s == WATER) assert_true(light > 0.75);
        if (s == FEW) assert_true(pair > 0.75);
        if (s == GLASS) assert_true(fmax(camera, fmax(light, pair)) < 0.85);
        ca_noise_release(noise);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_law),
        cmocka_unit_test(test_dominant_terms),
    };
    return cmocka_run_group_tests_name("paper_000", tests, NULL, NULL);
}
