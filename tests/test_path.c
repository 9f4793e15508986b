/* `path` on scenes whose radiance is known in closed form, for every sampler and sensor, and what its parameters do. */
#include "support/scene_text.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define PI 3.14159265358979323846

static const char *const perspective =
    "<sensor type='perspective'><float name='fov' value='70'/>"
    "<transform name='to_world'><lookat origin='0.3,0.1,-0.4' target='0,0.2,1' up='0,1,0'/></transform>"
    "<film type='hdrfilm'><integer name='width' value='24'/><integer name='height' value='16'/>"
    "<rfilter type='tent'/></film></sensor>";
static const char *const orthographic =
    "<sensor type='orthographic'><transform name='to_world'><scale value='0.3'/>"
    "<lookat origin='0,0.1,-0.5' target='0,0.1,1' up='0,1,0'/></transform>"
    "<film type='hdrfilm'><integer name='width' value='24'/><integer name='height' value='16'/>"
    "<rfilter type='gaussian'/></film></sensor>";
static const char *const thin_lens =
    "<sensor type='thinlens'><float name='fov' value='50'/><float name='aperture_radius' value='0.1'/>"
    "<float name='focus_distance' value='0.8'/>"
    "<transform name='to_world'><lookat origin='0.3,0.1,-0.4' target='0,0.2,1' up='0,1,0'/></transform>"
    "<film type='hdrfilm'><integer name='width' value='24'/><integer name='height' value='16'/>"
    "<rfilter type='box'/></film></sensor>";

static ca_scene *room(const char *sensor, const char *integrator, const char *content)
{
    char text[8192];
    snprintf(text, sizeof text, "<scene version='3.0.0'>%s%s%s</scene>", integrator, sensor, content);
    return scene_from_text(text);
}

/* The image's mean must lie within 1 % of `expected` at 95 % confidence, and no further from it than its own standard
 * error explains (4 sigma; 0 for scenes without noise). */
static void expect_radiance(const ca_scene *scene, const char *sampler, uint32_t samples, double expected, const char *what)
{
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.sampler = sampler;
    settings.samples_per_pixel = samples;
    ca_image_layers *image = render_scene(scene, &settings);
    double mean, error;
    channel_mean(image, "G", &mean, &error);
    ca_image_release(image);
    print_message("    %-38s %-11s expected %.5f, got %.5f +- %.5f\n", what, sampler, expected, mean, error);
    if (!(fabs(mean - expected) + 1.96 * error <= 0.01 * expected)) fail_msg("%s: not within 1 %%", what);
    if (!(fabs(mean - expected) <= 4.0 * error + 2e-5 * expected)) fail_msg("%s: outside of its error bars", what);
}

typedef struct closed_form {
    const char *name, *integrator, *content;
    double expected;
} closed_form;

#define DIFFUSE(rho) "<bsdf type='diffuse'><rgb name='reflectance' value='" rho "'/></bsdf>"
#define ENCLOSING_SPHERE(inside) "<shape type='sphere'><boolean name='flip_normals' value='true'/>" inside "</shape>"
#define UNLIMITED "<integrator type='path'><integer name='rr_depth' value='5'/></integrator>"
#define DEPTH(n) "<integrator type='path'><integer name='max_depth' value='" n "'/></integrator>"
#define CENTRE_LIGHT "<emitter type='point'><rgb name='intensity' value='2'/></emitter>"
#define GLOW "<emitter type='area'><rgb name='radiance' value='0.5'/></emitter>"

static const closed_form closed_forms[] = {
    /* E = I / r^2 everywhere; one bounce */
    {"point light in a sphere, direct", DEPTH("2"), CENTRE_LIGHT ENCLOSING_SPHERE(DIFFUSE("0.6")), 0.6 / PI * 2.0},
    /* a cavity of reflectance rho multiplies by 1 / (1 - rho) */
    {"point light in a sphere, all bounces", UNLIMITED, CENTRE_LIGHT ENCLOSING_SPHERE(DIFFUSE("0.6")),
     0.6 / PI * 2.0 / 0.4},
    {"emissive enclosing sphere", UNLIMITED, ENCLOSING_SPHERE(DIFFUSE("0.5") GLOW), 1.0},
    {"emissive enclosing sphere, 3 edges", DEPTH("3"), ENCLOSING_SPHERE(DIFFUSE("0.5") GLOW), 0.5 * 1.75},
    /* a mirror in a cavity in equilibrium is invisible */
    {"the same with a mirror ball in it", UNLIMITED,
     ENCLOSING_SPHERE(DIFFUSE("0.5") GLOW) "<shape type='sphere'><point name='center' value='0.1,0.2,0.4'/>"
     "<float name='radius' value='0.3'/><bsdf type='conductor'><string name='material' value='none'/></bsdf></shape>",
     1.0},
    {"the same with a glass ball in it", UNLIMITED,
     ENCLOSING_SPHERE(DIFFUSE("0.5") GLOW) "<shape type='sphere'><point name='center' value='0.1,0.2,0.4'/>"
     "<float name='radius' value='0.3'/><bsdf type='dielectric'/></shape>",
     1.0},
    /* a mirror before the wall returns what the rest sends: the radiance stays Le / (1 - rho) */
    {"the same with a mirror on the wall", UNLIMITED,
     ENCLOSING_SPHERE(DIFFUSE("0.5") GLOW) "<shape type='disk'><transform name='to_world'><scale value='0.5'/>"
     "<rotate y='1' angle='180'/><translate z='0.8'/></transform>"
     "<bsdf type='twosided'><bsdf type='conductor'><string name='material' value='none'/></bsdf></bsdf></shape>",
     1.0},
    /* a mask lets the cavity's light pass */
    {"the same with a half transparent disk", UNLIMITED,
     ENCLOSING_SPHERE(DIFFUSE("0.5") GLOW) "<shape type='disk'><transform name='to_world'><scale value='0.5'/>"
     "<rotate y='1' angle='180'/><translate z='0.6'/></transform><bsdf type='mask'><float name='opacity' value='0.5'/>"
     "<bsdf type='twosided'><bsdf type='conductor'><string name='material' value='none'/></bsdf></bsdf></bsdf></shape>",
     1.0},
    /* constant environment seen by a white ball: the furnace */
    {"white ball in a constant environment", UNLIMITED,
     "<emitter type='constant'><rgb name='radiance' value='1'/></emitter><shape type='sphere'>"
     "<point name='center' value='0,0.2,0.6'/><float name='radius' value='0.4'/>" DIFFUSE("1") "</shape>",
     1.0},
};

static void test_closed_forms(void **state)
{
    (void)state;
    static const struct {
        const char *name, *text;
    } sensors[] = {{"perspective", perspective}, {"orthographic", orthographic}, {"thinlens", thin_lens}};
    for (size_t s = 0; s < 3; s++)
        for (size_t i = 0; i < sizeof closed_forms / sizeof closed_forms[0]; i++) {
            print_message("  %s\n", sensors[s].name);
            ca_scene *scene = room(sensors[s].text, closed_forms[i].integrator, closed_forms[i].content);
            expect_radiance(scene, "independent", 160, closed_forms[i].expected, closed_forms[i].name);
            expect_radiance(scene, "sobol", 128, closed_forms[i].expected, closed_forms[i].name);
            ca_scene_release(scene);
        }
}

/* A square of radiance 1 and half side 1 at height 1, seen from below by a small diffuse patch under its centre. The
 * form factor of a differential element to a square straight above it is 4 times that of a quarter with a = b = 1:
 * F = 4 / (2 pi) 2 (1/sqrt 2) atan(1/sqrt 2). */
static void test_form_factor_of_a_square(void **state)
{
    (void)state;
    static const char *const sensor =
        "<sensor type='orthographic'><transform name='to_world'><scale value='0.001'/>"
        "<lookat origin='0,0.5,0' target='0,0,0' up='0,0,1'/></transform><film type='hdrfilm'>"
        "<integer name='width' value='24'/><integer name='height' value='24'/><rfilter type='box'/></film></sensor>";
    static const char *const content =
        "<shape type='rectangle'><transform name='to_world'><rotate x='1' angle='-90'/></transform>" DIFFUSE("1") "</shape>"
        "<shape type='rectangle'><transform name='to_world'><rotate x='1' angle='90'/><translate y='1'/></transform>"
        DIFFUSE("0") "<emitter type='area'><rgb name='radiance' value='1'/></emitter></shape>";
    const double form_factor = 4.0 / (2.0 * PI) * 2.0 * sqrt(0.5) * atan(sqrt(0.5));
    ca_scene *scene = room(sensor, DEPTH("2"), content);
    expect_radiance(scene, "independent", 500, form_factor, "form factor of a square");
    expect_radiance(scene, "sobol", 256, form_factor, "form factor of a square");
    ca_scene_release(scene);
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
    ca_scene *scene = room(perspective, UNLIMITED, ENCLOSING_SPHERE(DIFFUSE("0.5") GLOW));
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
    ca_scene *scene = room(perspective, UNLIMITED, CENTRE_LIGHT);
    expect_refusal(scene, "pth", "did you mean \"path\"");
    expect_refusal(scene, "path:max_depht=3", "did you mean \"max_depth\"");
    expect_refusal(scene, "path:max_depth=1.5", "whole number");
    expect_refusal(scene, "path:max_depth=-2", "at least -1");
    expect_refusal(scene, "path:hide_emitters=3", "true or false");
    expect_refusal(scene, "path:heuristic=best", "balance|power");
    ca_scene_release(scene);
    scene = room(perspective, "<integrator type='path'><integer name='max_deph' value='3'/></integrator>", CENTRE_LIGHT);
    expect_refusal(scene, NULL, "did you mean \"max_depth\"");
    ca_scene_release(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_closed_forms),
        cmocka_unit_test(test_form_factor_of_a_square),
        cmocka_unit_test(test_parameters_mean_what_mitsuba_means),
        cmocka_unit_test(test_wrong_parameters_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
