/* `path` on scenes whose radiance is known in closed form, for every sampler and sensor, and what its parameters
 * do. */
#define _DEFAULT_SOURCE
#include "support/closed_forms.h"
#include "support/scene_text.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

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

/* A square without normals of its own: flat shapes are what batches take eight at a time. */
static void write_square(char *path)
{
    const int number = mkstemps(path, 4);
    FILE *file = number < 0 ? NULL : fdopen(number, "w");
    assert_non_null(file);
    fputs("v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n", file);
    assert_int_equal(fclose(file), 0);
}

/* A floor seen from its back, under sixteen small lights. */
static ca_scene *lit_floor(const char *square, const char *back)
{
    char text[12000];
    int used = snprintf(text, sizeof text,
                        "<scene version='3.0.0'><sensor type='perspective'><float name='fov' value='50'/>"
                        "<transform name='to_world'><lookat origin='0,0,-0.8' target='0,0,0' up='0,1,0'/></transform>"
                        "<film type='hdrfilm'><integer name='width' value='8'/><integer name='height' value='8'/>"
                        "</film></sensor><shape type='obj'><string name='filename' value='%s'/>"
                        "<boolean name='face_normals' value='true'/><bsdf type='twosided'><bsdf type='diffuse'/>"
                        "<bsdf type='diffuse'>%s</bsdf></bsdf></shape>",
                        square, back);
    for (int i = 0; i < 16; i++)
        used += snprintf(text + used, sizeof text - (size_t)used,
                         "<shape type='obj'><string name='filename' value='%s'/>"
                         "<boolean name='face_normals' value='true'/><transform name='to_world'>"
                         "<scale value='0.15'/><translate x='%g' y='%g' z='-1'/></transform>"
                         "<bsdf type='diffuse'/>"
                         "<emitter type='area'><rgb name='radiance' value='1'/></emitter></shape>",
                         square, 0.4 * (i % 4) - 0.6, 0.4 * (double)(i / 4) - 0.6);
    snprintf(text + used, sizeof text - (size_t)used, "</scene>");
    return scene_from_text(text);
}

/* Matte shapes give the picture of shapes with a pattern, which go one by one, with and without next event. */
static void test_matte_shapes_as_all_others(void **state)
{
    (void)state;
    char square[] = "/tmp/caustica-square-XXXXXX.obj";
    write_square(square);
    ca_scene *matte = lit_floor(square, "<rgb name='reflectance' value='0.8'/>");
    ca_scene *pattern =
        lit_floor(square, "<texture type='checkerboard' name='reflectance'><rgb name='color0' value='0.8'/>"
                          "<rgb name='color1' value='0.8'/></texture>");
    unlink(square);
    const double expected = rendered_mean(pattern, "path", 256);
    assert_true(expected > 0.05);
    assert_true(fabs(rendered_mean(matte, "path", 256) / expected - 1.0) < 0.02);
    assert_true(fabs(rendered_mean(matte, "path:heuristic=balance", 256) / expected - 1.0) < 0.02);
    assert_true(fabs(rendered_mean(matte, "path:next_event=false", 1024) / expected - 1.0) < 0.02);
    ca_scene_release(matte);
    ca_scene_release(pattern);
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
        cmocka_unit_test(test_matte_shapes_as_all_others),
        cmocka_unit_test(test_wrong_parameters_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
