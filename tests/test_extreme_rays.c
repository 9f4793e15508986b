/* No ray and no instance makes Embree end the process; scenes that would are refused, in words. */
#include "geometry/ray_reach.h"
#include "support/extreme_rays.h"
#include "support/scene_text.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static void test_any_rays(void **state)
{
    (void)state;
    const extreme_rays counts = trace_extreme_rays(1, 300, 3000);
    print_message("    %llu rays, %llu hits in %llu worlds, %llu refused\n", (unsigned long long)counts.rays,
                  (unsigned long long)counts.hits, (unsigned long long)counts.worlds,
                  (unsigned long long)counts.refused);
    assert_true(counts.refused > counts.worlds / 20 && counts.refused < counts.worlds / 2);
    assert_true(counts.hits > counts.rays / 100);
}

/* ---- Scenes ---------------------------------------------------------------------------------------------------- */

static ca_status load(double scale, double camera, ca_scene **scene, ca_error *error)
{
    static const char *const text =
        "<scene version='3.0.0'><sensor type='perspective'><transform name='to_world'><lookat origin='%g,0,1' "
        "target='0,0,0' up='0,1,0'/></transform><film type='hdrfilm'><integer name='width' value='16'/>"
        "<integer name='height' value='16'/></film></sensor><emitter type='point'><point name='position' x='0' y='9' "
        "z='%g'/></emitter><shape type='shapegroup' id='g'><shape type='cube'/></shape><shape type='instance'>"
        "<ref id='g'/><transform name='to_world'><scale value='%g'/></transform></shape><shape type='rectangle'/>"
        "</scene>";
    const char *path = CA_BUILD_DIR "/tests/extreme.xml";
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fprintf(file, text, camera, camera, scale);
    fclose(file);
    const ca_status status = ca_scene_load(path, NULL, 0, scene, error);
    remove(path);
    return status;
}

static void expect_refused(double scale, double camera, const char *words)
{
    ca_scene *scene;
    ca_error error = {""};
    assert_int_equal(load(scale, camera, &scene, &error), CA_ERROR_SCENE);
    if (!strstr(error.message, words) || !strstr(error.message, "extreme.xml:"))
        fail_msg("\"%s\" is not said in \"%s\"", words, error.message);
}

/* The same scene at another size shows the same. */
static void test_scenes(void **state)
{
    (void)state;
    expect_refused(1e-18, 4.0, "too small or too large");
    expect_refused(1e14, 4.0, "too small or too large");
    expect_refused(1e-10, 1e9, "scaled down too far");
    expect_refused(1.0, 1e18, "this light is 1e+18 from the origin");
    for (double scale = 1e-9; scale < 2e10; scale *= 10.0) {
        ca_scene *scene;
        ca_error error = {""};
        ca_render_settings settings;
        ca_render_settings_init(&settings);
        settings.integrator = "bdpt";
        settings.threads = 1;
        if (load(scale, 3.0 * scale, &scene, &error) != CA_OK) fail_msg("scale %g: %s", scale, error.message);
        ca_image_release(render_scene(scene, &settings));
        ca_scene_release(scene);
    }
}

/* ---- The bound ------------------------------------------------------------------------------------------------- */

static ca_affine scaling(float x, float y, float z, float move)
{
    return (ca_affine){.to = {{x, 0.0f, 0.0f, move}, {0.0f, y, 0.0f, 0.0f}, {0.0f, 0.0f, z, 0.0f}}};
}

static void test_reach(void **state)
{
    (void)state;
    ca_ray_reach reach = CA_RAY_REACH;
    ca_affine map = scaling(1.0f, 1.0f, 1.0f, 0.0f);
    assert_true(ca_ray_reach_limit(&reach, &map) && reach.direction > 4e17f && reach.direction < 1e18f);
    map = scaling(1e-9f, 1.0f, 1e3f, 1e8f); /* the move is 1e17 in the instance */
    reach = CA_RAY_REACH;
    assert_true(ca_ray_reach_limit(&reach, &map) && reach.direction > 4e8f && reach.direction < 1e9f);
    assert_true(reach.origin < reach.direction);
    map = scaling(1e-9f, 1e-2f, 1.0f, 1e12f); /* and here 1e21 */
    assert_false(ca_ray_reach_limit(&reach, &map));
    map.to[0][3] = 0.0f;
    map.to[0][1] = map.to[1][1], map.to[1][0] = map.to[0][0] * (1.0f + 0x1p-22f); /* rows all but alike */
    map.to[0][0] = 1e-9f;
    assert_false(ca_ray_reach_limit(&reach, &map));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_any_rays),
        cmocka_unit_test(test_scenes),
        cmocka_unit_test(test_reach),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
