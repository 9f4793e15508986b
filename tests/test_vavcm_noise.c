/* Weights that know variance give the picture to the technique without noise (decision 018). On a bare wall under a
 * small lamp that is next event, and weights that count samples give most of the picture to merges, or to splats: the
 * deviation of an iteration of `ovcm` is six times that of `path` there, that of `vavcm` is alike. */
#include "image/layers.h"
#include "support/scene_text.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>

#include <cmocka.h>

enum { SIDE = 48, ITERATIONS = 64 };

/* Mean over pixels of the standard deviation of an iteration. */
static double deviation_of(const ca_scene *scene, const char *integrator)
{
    ca_render_settings settings;
    ca_image_layers *image;
    ca_error error = {""};
    ca_render_settings_init(&settings);
    settings.integrator = integrator;
    settings.samples_per_pixel = ITERATIONS;
    settings.width = settings.height = SIDE;
    settings.seed = 3;
    settings.has_seed = true;
    if (ca_render(scene, &settings, &image, NULL, &error) != CA_OK) fail_msg("%s: %s", integrator, error.message);
    const float *deviation = ca_layers_find(image, "StandardDeviation.Y");
    double sum = 0.0;
    assert_non_null(deviation);
    for (int i = 0; i < SIDE * SIDE; i++) sum += (double)deviation[i];
    ca_image_release(image);
    return sum / (SIDE * SIDE);
}

static void test_bare_wall(void **state)
{
    (void)state;
    ca_scene *scene = bundled_scene("weights/bare-wall");
    const double path = deviation_of(scene, "path:max_depth=2");
    const double no_splats = deviation_of(scene, "bdpt:max_depth=2,strategies=no-splat");
    const double splats = deviation_of(scene, "bdpt:max_depth=2");
    const double ovcm = deviation_of(scene, "ovcm:max_depth=2,radius=0.05,alpha=0");
    const double vavcm = deviation_of(scene, "vavcm:max_depth=2,radius=0.05,alpha=0");
    print_message("over that of path: bdpt without splats %.3f, bdpt %.2f, ovcm %.2f, vavcm %.3f\n", no_splats / path,
                  splats / path, ovcm / path, vavcm / path);
    assert_true(splats > 2.0 * path && ovcm > 2.0 * path); /* else this scene shows nothing */
    assert_true(vavcm < 1.05 * path && vavcm < 1.05 * no_splats);
    ca_scene_release(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_bare_wall)};
    return cmocka_run_group_tests_name("noise of vavcm", tests, NULL, NULL);
}
