/* `path` on scenes whose radiance is known in closed form, for every sampler and sensor, and what its parameters
 * do. */
#include "support/closed_forms.h"
#include "support/scene_text.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* `path` is quick enough for all cases in every run. */
static void test_closed_forms(void **state)
{
    (void)state;
    assert_string_equal(integrator_variant_at(0)->text, "path");
    const closed_form_effort effort = {.all_cases = true, .tolerance = 0.01, .max_samples = 400};
    assert_int_equal(check_closed_forms(0, &effort).failed, 0);
}

static double rendered_mean(const ca_scene *scene, const char *integrator, uint64_t samples)
{
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.integrator = integrator;
    settings.samples_per_pixel = (uint32_t)samples;
    ca_image_layers *image = render_scene(scene, &settings);
    double mean, error;
    channel_mean(image, "G", &mean, &error);
    ca_image_release(image);
    return mean;
}

static void test_parameters_mean_what_mitsuba_means(void **state)
{
    (void)state;
    ca_scene *scene = closed_form_scene(closed_form_named("emissive enclosing sphere"), 0);
    assert_true(rendered_mean(scene, "path:max_depth=0", 4) == 0.0);
    assert_true(fabs(rendered_mean(scene, "path:max_depth=1", 4) - 0.5) < 1e-5);
    assert_true(fabs(rendered_mean(scene, "path:max_depth=2", 200) - 0.75) < 0.005);
    assert_true(fabs(rendered_mean(scene, "path:max_depth=2,hide_emitters=true", 200) - 0.25) < 0.005);
    /* the roulette changes noise, not the mean */
    assert_true(fabs(rendered_mean(scene, "path:rr_depth=1", 400) - 1.0) < 0.01);
    assert_true(fabs(rendered_mean(scene, "path:rr_depth=20", 100) - 1.0) < 0.01);
    /* both heuristics are unbiased */
    assert_true(fabs(rendered_mean(scene, "path:heuristic=balance", 200) - 1.0) < 0.01);
    ca_scene_release(scene);
}

/* A flat matte surface under a white sky has the radiance of its reflectance, which is that of the seen side; the
 * same where a texture keeps it from being one of the matte shapes. */
static void test_backs_of_matte_surfaces(void **state)
{
    (void)state;
    static const char *const back[] = {
        "<rgb name='reflectance' value='0.8'/>",
        "<texture type='checkerboard' name='reflectance'><rgb name='color0' value='0.8'/>"
        "<rgb name='color1' value='0.8'/></texture>"};
    for (int i = 0; i < 2; i++) {
        char text[1500];
        snprintf(text, sizeof text,
                 "<scene version='3.0.0'><sensor type='perspective'><float name='fov' value='60'/>"
                 "<transform name='to_world'><lookat origin='0,0,-1' target='0,0,0' up='0,1,0'/></transform>"
                 "<film type='hdrfilm'><integer name='width' value='8'/><integer name='height' value='8'/></film>"
                 "</sensor><emitter type='constant'><rgb name='radiance' value='1'/></emitter>"
                 "<shape type='rectangle'><bsdf type='twosided'>"
                 "<bsdf type='diffuse'><rgb name='reflectance' value='0.2'/></bsdf>"
                 "<bsdf type='diffuse'>%s</bsdf></bsdf></shape></scene>",
                 back[i]);
        ca_scene *scene = scene_from_text(text);
        assert_true(fabs(rendered_mean(scene, "path", 400) - 0.8) < 0.002);
        assert_true(fabs(rendered_mean(scene, "path:next_event=false", 400) - 0.8) < 0.002);
        ca_scene_release(scene);
    }
}

static void expect_refusal(const ca_scene *scene, const char *integrator, const char *message)
{
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.integrator = integrator;
    ca_image_layers *image = NULL;
    ca_error error;
    assert_int_not_equal(ca_render(scene, &settings, &image, NULL, &error), CA_OK);
    assert_null(image);
    if (!strstr(error.message, message)) fail_msg("\"%s\" does not say \"%s\"", error.message, message);
}

static void test_wrong_parameters_are_refused(void **state)
{
    (void)state;
    ca_scene *scene = closed_form_scene(closed_form_at(0), 0);
    expect_refusal(scene, "pth", "did you mean \"path\"");
    expect_refusal(scene, "path:max_depht=3", "did you mean \"max_depth\"");
    expect_refusal(scene, "path:max_depth=1.5", "whole number");
    expect_refusal(scene, "path:max_depth=-2", "at least -1");
    expect_refusal(scene, "path:hide_emitters=3", "true or false");
    expect_refusal(scene, "path:heuristic=best", "balance|power");
    ca_scene_release(scene);
    scene = scene_from_text(
        "<scene version='3.0.0'><integrator type='path'><integer name='max_deph' value='3'/></integrator>"
        "<sensor type='perspective'/><emitter type='point'/></scene>");
    expect_refusal(scene, NULL, "did you mean \"max_depth\"");
    ca_scene_release(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_closed_forms),
        cmocka_unit_test(test_parameters_mean_what_mitsuba_means),
        cmocka_unit_test(test_backs_of_matte_surfaces),
        cmocka_unit_test(test_wrong_parameters_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
