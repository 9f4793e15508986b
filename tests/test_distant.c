/* Sensors that look from afar: where their rays go, and means that are known in closed form. */
#include "camera/camera.h"
#include "scene/scene.h"
#include "support/scene_text.h"
#include "support/test_random.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#define PI 3.14159265358979323846
#define SENSOR(inside)                                                                                               \
    "<sensor type='distant'>" inside "<film type='hdrfilm'><integer name='width' value='1'/>"                        \
    "<integer name='height' value='1'/></film></sensor>"
#define ASLANT "<vector name='direction' value='0.6,-1,0.3'/>"
#define TARGET(type, steps)                                                                                          \
    "<shape type='" type "' name='target'><transform name='to_world'>" steps "</transform></shape>"
#define DEPTH_2 "<integrator type='path'><integer name='max_depth' value='2'/></integrator>"
#define FLOOR                                                                                                        \
    "<shape type='rectangle'><transform name='to_world'><scale value='3'/><rotate x='1' angle='-90'/></transform>"   \
    "<bsdf type='diffuse'><rgb name='reflectance' value='0.8'/></bsdf></shape>"
/* Its irradiance on the floor is 2 cos(60 degrees). */
#define SUN                                                                                                          \
    "<emitter type='directional'><vector name='direction' value='0.86602540378,-0.5,0'/>"                            \
    "<rgb name='irradiance' value='2'/></emitter>"
#define GLOWING_BALL "<shape type='sphere'><emitter type='area'/></shape>"

static ca_scene *scene_of(const char *sensor, const char *content)
{
    char text[4096];
    assert_true(snprintf(text, sizeof text, "<scene version='3.0.0'>" DEPTH_2 "%s%s</scene>", sensor, content) <
                (int)sizeof text);
    return scene_from_text(text);
}

/* ---- Rays ------------------------------------------------------------------------------------------------------ */

static ca_vec2 random2(ca_test_random *random)
{
    const float x = ca_test_random_float(random);
    return (ca_vec2){x, ca_test_random_float(random)};
}

/* Where the line meets the plane y = 0. */
static ca_vec3 on_floor(const ca_camera_ray *ray)
{
    return ca_madd(ray->origin, -ray->origin.y / ray->direction.y, ray->direction);
}

/* All points of the target are met alike, by rays that begin outside of the scene; and each point of it, and no
 * other, sees the sensor, with the ray's density. `half`: those of the sides, x and z. */
static void check_target(const char *sensor, float half_x, float half_z, bool is_disk)
{
    ca_scene *scene = scene_of(sensor, FLOOR);
    const ca_camera camera = ca_scene_camera(scene, 1, 1);
    ca_test_random random = ca_test_random_seed(7);
    double squares[2] = {0.0, 0.0};
    enum { RAYS = 20000 };
    for (int i = 0; i < RAYS; i++) {
        const ca_camera_ray ray = ca_camera_sample_ray(&camera, random2(&random), random2(&random));
        const ca_vec3 met = on_floor(&ray);
        const float x = met.x / half_x, z = met.z / half_z;
        assert_true((is_disk ? x * x + z * z : fmaxf(x * x, z * z)) < 1.0001f);
        assert_true(ca_length(ca_sub(ray.origin, scene->center)) > scene->radius);
        squares[0] += (double)(x * x) / RAYS;
        squares[1] += (double)(z * z) / RAYS;
        ca_camera_direct direct;
        if ((is_disk ? x * x + z * z : fmaxf(x * x, z * z)) > 0.9999f) continue;
        assert_true(ca_camera_sample_direct(&camera, met, random2(&random), 0.0f, &direct));
        assert_true(ca_length(ca_sub(direct.position, ray.origin)) < 1e-4f);
        assert_true(fabsf(direct.pdf_position.v / ray.pdf_position.v - 1.0f) < 1e-6f);
        assert_true(fabsf(direct.importance / ray.pdf_position.v - 1.0f) < 1e-6f);
        const ca_vec3 beside = {2.001f * half_x - met.x, 0.0f, 2.001f * half_z - met.z};
        assert_false(ca_camera_sample_direct(&camera, beside, random2(&random), 0.0f, &direct));
    }
    const double mean = is_disk ? 0.25 : 1.0 / 3.0;
    for (int i = 0; i < 2; i++) assert_true(fabs(squares[i] - mean) < 0.01);
    /* The target's area, as it is seen. */
    const ca_camera_ray ray = ca_camera_sample_ray(&camera, (ca_vec2){0.5f, 0.5f}, (ca_vec2){0.5f, 0.5f});
    const double area = (is_disk ? PI : 4.0) * (double)half_x * (double)half_z * -(double)ray.direction.y;
    assert_true(fabs(area * (double)ray.pdf_position.v - 1.0) < 1e-5);
    ca_scene_release(scene);
}

static void targets_are_met_evenly(void **state)
{
    (void)state;
    check_target(SENSOR(ASLANT TARGET("disk", "<scale x='0.7' y='0.4'/><rotate x='1' angle='-90'/>")), 0.7f, 0.4f,
                 true);
    check_target(SENSOR(ASLANT TARGET("rectangle", "<scale x='0.5' y='1.1'/><rotate x='1' angle='90'/>")), 0.5f,
                 1.1f, false);
    check_target(SENSOR("<vector name='direction' value='1,-0.3,0'/>"
                        TARGET("rectangle", "<scale value='2.9'/><rotate x='1' angle='-90'/>")),
                 2.9f, 2.9f, false);
    check_target(SENSOR("<transform name='to_world'><lookat origin='0,9,0' target='0,0,0' up='1,0,0'/></transform>"
                        TARGET("disk", "<rotate x='1' angle='90'/>")),
                 1.0f, 1.0f, true);
}

static void points_are_looked_at(void **state)
{
    (void)state;
    ca_scene *scene = scene_of(SENSOR(ASLANT "<point name='target' value='0.4,0,-0.9'/>"), FLOOR);
    const ca_camera camera = ca_scene_camera(scene, 1, 1);
    const ca_camera_ray ray = ca_camera_sample_ray(&camera, (ca_vec2){0.5f, 0.5f}, (ca_vec2){0.5f, 0.5f});
    const ca_vec3 met = on_floor(&ray), along = ca_normalize((ca_vec3){0.6f, -1.0f, 0.3f});
    assert_true(ca_length(ca_sub(met, (ca_vec3){0.4f, 0.0f, -0.9f})) < 1e-4f);
    assert_true(ca_length(ca_sub(ray.direction, along)) < 1e-5f);
    assert_true(ca_length(ca_sub(ray.origin, scene->center)) > scene->radius);
    ca_scene_release(scene);
}

/* ---- Means ----------------------------------------------------------------------------------------------------- */

static void expect_mean(const char *sensor, const char *content, const char *integrator, double expected,
                        double tolerance)
{
    ca_scene *scene = scene_of(sensor, content);
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.integrator = integrator;
    settings.samples_per_pixel = strcmp(integrator, "light") == 0 ? 200000 : 4000; /* of one light path */
    if (strcmp(integrator, "path") != 0 && strcmp(integrator, "light") != 0) settings.light_paths = 50;
    ca_image_layers *image = render_scene(scene, &settings);
    const double found = (double)ca_image_channel(image, "G")[0];
    if (!(fabs(found / expected - 1.0) < tolerance)) fail_msg("%s: %g, not %g", integrator, found, expected);
    ca_image_release(image);
    ca_scene_release(scene);
}

/* A ball fills a third of the disk across its box' bounding sphere. */
static void means_are_known(void **state)
{
    (void)state;
    static const char *const integrators[] = {"path", "light", "bdpt", "vcm:radius=0.05,alpha=0"};
    for (size_t i = 0; i < sizeof integrators / sizeof *integrators; i++) {
        expect_mean(SENSOR(ASLANT TARGET("disk", "<scale x='2' y='1.2'/><rotate x='1' angle='-90'/>")), FLOOR SUN,
                    integrators[i], 0.8 / PI, i == 0 ? 1e-5 : 0.03);
        expect_mean(SENSOR(ASLANT), GLOWING_BALL, integrators[i], 1.0 / 3.0, 0.05);
    }
    expect_mean(SENSOR(ASLANT "<point name='target' value='1,0,2'/>"), FLOOR SUN, "path", 0.8 / PI, 1e-5);
    expect_mean(SENSOR("<vector name='direction' value='0,0,-1'/>" TARGET("rectangle", "<scale x='2' y='1'/>")),
                GLOWING_BALL, "path", PI / 8.0, 0.05);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(targets_are_met_evenly),
        cmocka_unit_test(points_are_looked_at),
        cmocka_unit_test(means_are_known),
    };
    return cmocka_run_group_tests_name("distant", tests, NULL, NULL);
}
