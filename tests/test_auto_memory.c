/* Integrator `auto` where memory is short. */
#include "support/auto_scenes.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

/* A render that is too short for numbers of rays to be chosen has another film than was planned. */
static void test_memory_without_rays(void **state)
{
    (void)state;
    ca_scene *scene = wall_scene();
    ca_render_settings settings = auto_settings("auto", 2);
    settings.rays = "auto";
    settings.width = settings.height = 512;
    settings.memory_mib = 70.0; /* 192 bytes a pixel are 48, 300 bytes 75 */
    ca_image_layers *image = NULL;
    ca_error error = {""};
    assert_int_equal(ca_render(scene, &settings, &image, NULL, &error), CA_ERROR_ARGUMENT);
    if (!strstr(error.message, "the film alone needs 75.0 MiB")) fail_msg("%s", error.message);
    assert_null(image);
    ca_scene_release(scene);
}

/* Whichever allocation fails: an error, and nothing is left over. */
static void test_out_of_memory(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text("<scene version='3.0.0'>" FROM_ABOVE("4") FLOOR LAMP "</scene>");
    ca_render_settings settings = auto_settings("auto:max_depth=3,light_paths=9,guide=false", 1);
    settings.threads = 1;
    assert_true(render_without_memory(scene, &settings) > 100);
    ca_scene_release(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_memory_without_rays),
        cmocka_unit_test(test_out_of_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
