/* Materials and lights with huge and tiny numbers: computed without a sample that is not finite, or refused in
 * words. "A defect, please report it" must be one. */
#include "support/scene_text.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#define POINT "<emitter type='point'><point name='position' x='0' y='3' z='3'/></emitter>"
#define LIT "<emitter type='constant'/>" POINT
#define BALL(bsdf) LIT "<shape type='sphere'><bsdf type=" bsdf "</bsdf></shape>"
#define NUMBER(name, value) "<float name='" name "' value='" value "'/>"
#define COLOR(name, value) "<rgb name='" name "' value='" value "'/>"
#define LOOK "<transform name='to_world'><lookat origin='0,0,4' target='0,0,0' up='0,1,0'/></transform>"

static ca_status load(const char *body, ca_scene **scene, ca_error *error)
{
    const char *path = CA_BUILD_DIR "/tests/extreme-values.xml";
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fprintf(file,
            "<scene version='3.0.0'><sensor type='perspective'>" LOOK "<film type='hdrfilm'>"
            "<integer name='width' value='16'/><integer name='height' value='16'/></film></sensor>%s</scene>",
            body);
    fclose(file);
    const ca_status status = ca_scene_load(path, NULL, 0, scene, error);
    remove(path);
    return status;
}

static void render(const ca_scene *scene, const char *integrator, const char *body)
{
    ca_render_settings settings;
    ca_render_statistics statistics = {.size = sizeof statistics};
    ca_image_layers *image;
    ca_error error = {""};
    ca_render_settings_init(&settings);
    settings.integrator = integrator;
    settings.threads = 1;
    settings.samples_per_pixel = 8;
    if (ca_render(scene, &settings, &image, &statistics, &error) != CA_OK) fail_msg("%s: %s", body, error.message);
    if (statistics.non_finite > 0)
        fail_msg("%s of %s: %llu samples are not finite", integrator, body,
                 (unsigned long long)statistics.non_finite);
    ca_image_release(image);
}

static void test_computed(void **state)
{
    (void)state;
    static const char *const bodies[] = {
        BALL("'plastic'>" NUMBER("int_ior", "1000")),
        BALL("'plastic'>" NUMBER("int_ior", "1000") "<boolean name='nonlinear' value='true'/>"),
        BALL("'plastic'>" NUMBER("int_ior", "1000") NUMBER("ext_ior", "0.001")),
        BALL("'plastic'>" NUMBER("int_ior", "0.001") NUMBER("ext_ior", "1000")),
        BALL("'plastic'>" COLOR("diffuse_reflectance", "1e-45") COLOR("specular_reflectance", "1e-45")),
        BALL("'roughplastic'>" NUMBER("int_ior", "1000")),
        BALL("'roughplastic'>" NUMBER("int_ior", "1000") NUMBER("ext_ior", "0.001")),
        BALL("'roughplastic'>" NUMBER("int_ior", "0.001")),
        BALL("'dielectric'>" NUMBER("int_ior", "1000")),
        BALL("'roughdielectric'>" NUMBER("int_ior", "1000")),
        BALL("'roughdielectric'>" NUMBER("int_ior", "0.001")),
        BALL("'roughdielectric'>" NUMBER("alpha", "1e-20")),
        BALL("'roughconductor'>" NUMBER("alpha", "1e-30")),
        BALL("'conductor'>" COLOR("eta", "1e30") COLOR("k", "1e30")),
        BALL("'diffuse'>" COLOR("reflectance", "1e-45")),
        "<emitter type='constant'>" COLOR("radiance", "1e-45") "</emitter><shape type='sphere'/>",
        "<emitter type='constant'>" COLOR("radiance", "1e30") "</emitter><shape type='sphere'/>",
        "<shape type='sphere'><emitter type='area'>" COLOR("radiance", "1e-45") "</emitter></shape>",
        "<shape type='rectangle'><emitter type='area'>" COLOR("radiance", "1e-40") "</emitter></shape>",
        "<emitter type='spot'>" LOOK COLOR("intensity", "1e-44") "</emitter><shape type='sphere'/>",
        "<emitter type='point'>" COLOR("intensity", "1e-40") "</emitter><shape type='sphere'>" NUMBER("radius", "3")
        "<bsdf type='twosided'><bsdf type='diffuse'/></bsdf></shape>",
        "<emitter type='directional'>" COLOR("irradiance", "1e-44") "</emitter><shape type='sphere'/>",
        "<shape type='sphere'>" NUMBER("radius", "1e-10") "<point name='center' x='0' y='0' z='0.1'/>"
        "<emitter type='area'/></shape><shape type='rectangle'/>",
        "<shape type='sphere'>" NUMBER("radius", "1e-15") "<point name='center' x='0' y='0' z='0.1'/>"
        "<emitter type='area'/></shape><shape type='rectangle'/>",
    };
    for (size_t i = 0; i < sizeof bodies / sizeof bodies[0]; i++) {
        ca_scene *scene;
        ca_error error = {""};
        if (load(bodies[i], &scene, &error) != CA_OK) fail_msg("%s: %s", bodies[i], error.message);
        render(scene, "path", bodies[i]);
        render(scene, "path:heuristic=balance", bodies[i]);
        render(scene, "bdpt", bodies[i]);
        render(scene, "bdpt:heuristic=power", bodies[i]);
        render(scene, "vcm:radius=0.01", bodies[i]);
        ca_scene_release(scene);
    }
}

static void test_refused(void **state)
{
    (void)state;
    static const char *const refused[][2] = {
        {BALL("'plastic'>" NUMBER("int_ior", "1e9")), "\"int_ior\" of plastic is 1e+09, and must lie in"},
        {BALL("'dielectric'>" NUMBER("ext_ior", "1e-9")), "\"ext_ior\" of dielectric is 1e-09, and must lie in"},
        {"<shape type='sphere'><emitter type='area'>" COLOR("radiance", "1e38") "</emitter></shape>",
         "the power of this light is not a finite number"},
        {"<emitter type='point'>" COLOR("intensity", "1e38") "</emitter>",
         ": the power of this light is not a finite number"},
        {"<emitter type='point'><point name='position' x='1e20' y='0' z='0'/></emitter>",
         ": this light is 1e+20 from the origin; rays can be traced up to 2.5e17"},
        {"<emitter type='spot'><transform name='to_world'><translate x='1e20'/></transform></emitter>",
         ": this light is 1e+20 from the origin"},
    };
    for (size_t i = 0; i < sizeof refused / sizeof refused[0]; i++) {
        ca_scene *scene;
        ca_error error = {""};
        assert_int_equal(load(refused[i][0], &scene, &error), CA_ERROR_SCENE);
        if (!strstr(error.message, refused[i][1])) fail_msg("\"%s\": %s", refused[i][1], error.message);
    }
}

/* A coat of any index gives back what it gets: nothing of it is lost inside. */
static void test_white_coat_in_white_light(void **state)
{
    (void)state;
    static const char *const kinds[] = {"plastic", "roughplastic"};
    static const char *const indices[] = {"1.5", "2", "2.5", "30", "1000"};
    for (size_t k = 0; k < 2; k++)
        for (size_t i = 0; i < sizeof indices / sizeof indices[0]; i++) {
            char body[512];
            ca_scene *scene;
            ca_error error = {""};
            double mean, deviation;
            snprintf(body, sizeof body,
                     "<emitter type='constant'/><shape type='rectangle'><transform name='to_world'><scale value='9'/>"
                     "</transform><bsdf type='%s'><float name='int_ior' value='%s'/>"
                     "<rgb name='diffuse_reflectance' value='1'/></bsdf></shape>",
                     kinds[k], indices[i]);
            if (load(body, &scene, &error) != CA_OK) fail_msg("%s", error.message);
            ca_render_settings settings;
            ca_render_settings_init(&settings);
            settings.integrator = "path";
            settings.samples_per_pixel = 64;
            ca_image_layers *image = render_scene(scene, &settings);
            channel_mean(image, "G", &mean, &deviation);
            if (!(fabs(mean - 1.0) < 0.015 + 4.0 * deviation))
                fail_msg("%s of index %s gives back %g of white light", kinds[k], indices[i], mean);
            ca_image_release(image);
            ca_scene_release(scene);
        }
}

/* A floor under an even sky has the sky's light times its reflectance, whatever the unit of length: cross products of
 * a triangle's sides, whose squares no float holds, are normals of path tracing and of the other methods alike. */
static void test_units_of_length(void **state)
{
    (void)state;
    static const double units[] = {1e-13, 1e-11, 1.0, 1e9, 1e11};
    static const char *const integrators[] = {"path", "bdpt", "vcm:radius_pixels=1"};
    for (size_t u = 0; u < sizeof units / sizeof units[0]; u++)
        for (size_t i = 0; i < sizeof integrators / sizeof integrators[0]; i++) {
            char text[1024];
            double mean, deviation;
            const double unit = units[u];
            snprintf(text, sizeof text,
                     "<scene version='3.0.0'><sensor type='perspective'><float name='fov' value='30'/>"
                     "<float name='near_clip' value='%g'/><float name='far_clip' value='1e15'/>"
                     "<transform name='to_world'><lookat origin='0,0,%g' target='0,0,0' up='0,1,0'/></transform>"
                     "<film type='hdrfilm'><integer name='width' value='16'/>"
                     "<integer name='height' value='16'/></film></sensor><emitter type='constant'/>"
                     "<shape type='rectangle'><transform name='to_world'><scale value='%g'/></transform></shape>"
                     "</scene>",
                     unit, 4.0 * unit, 5.0 * unit);
            ca_scene *scene = scene_from_text(text);
            ca_render_settings settings;
            ca_render_settings_init(&settings);
            settings.integrator = integrators[i];
            settings.samples_per_pixel = 16;
            ca_image_layers *image = render_scene(scene, &settings);
            channel_mean(image, "G", &mean, &deviation);
            if (!(fabs(mean - 0.5) < 0.01 + 4.0 * deviation))
                fail_msg("%s with units of %g: %g of the sky's light", integrators[i], unit, mean);
            ca_image_release(image);
            ca_scene_release(scene);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_computed),
        cmocka_unit_test(test_refused),
        cmocka_unit_test(test_white_coat_in_white_light),
        cmocka_unit_test(test_units_of_length),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
