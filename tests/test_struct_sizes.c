/* Structures that carry their size: programs of other versions than the library's. */
#include "support/scene_text.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

static const char text[] =
    "<scene version='3.0.0'><sensor type='perspective'><film type='hdrfilm'><integer name='width' value='8'/>"
    "<integer name='height' value='8'/></film></sensor><integrator type='path'/><emitter type='constant'/></scene>";

/* A later version's. */
typedef struct later_settings {
    ca_render_settings known;
    double more[4];
} later_settings;

typedef struct later_statistics {
    ca_render_statistics known;
    double more[4];
} later_statistics;

static ca_status render(const ca_render_settings *settings, ca_render_statistics *statistics, ca_error *error)
{
    ca_scene *scene = scene_from_text(text);
    ca_image_layers *image;
    const ca_status status = ca_render(scene, settings, &image, statistics, error);
    ca_image_release(image);
    ca_scene_release(scene);
    return status;
}

static void test_settings(void **state)
{
    (void)state;
    ca_error error;
    ca_render_settings settings;
    memset(&settings, 0xff, sizeof settings);
    ca_render_settings_init(&settings);
    assert_int_equal(settings.size, sizeof settings);
    settings.samples_per_pixel = 2;
    assert_int_equal(render(&settings, NULL, &error), CA_OK);
    settings.size = 0; /* as in 0.1 */
    assert_int_equal(render(&settings, NULL, &error), CA_OK);
    settings.size = offsetof(ca_render_settings, stop);
    assert_int_equal(render(&settings, NULL, &error), CA_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, "which no version had: ca_render_settings_init sets it"));
}

static void test_later_settings(void **state)
{
    (void)state;
    ca_error error;
    later_settings later = {.known = {.size = sizeof later, .samples_per_pixel = 2}};
    assert_int_equal(render(&later.known, NULL, &error), CA_OK);
    later.more[3] = 1.0;
    assert_int_equal(render(&later.known, NULL, &error), CA_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, "a field set that version 0.1.0 of the library does not know"));
    later.known.size = sizeof later.known; /* what lies behind is not looked at */
    assert_int_equal(render(&later.known, NULL, &error), CA_OK);
}

static void test_statistics(void **state)
{
    (void)state;
    ca_error error;
    later_statistics later;
    const ca_render_settings settings = {.samples_per_pixel = 3, .threads = 1};
    memset(&later, 0xff, sizeof later);
    const later_statistics untouched = later;
    ca_render_statistics_init(&later.known);
    assert_int_equal(later.known.size, sizeof later.known);
    assert_int_equal(render(&settings, &later.known, &error), CA_OK);
    assert_int_equal(later.known.size, sizeof later.known);
    assert_int_equal(later.known.iterations, 3);
    later.known.size = sizeof later;
    assert_int_equal(render(&settings, &later.known, &error), CA_OK);
    assert_int_equal(later.known.size, sizeof later);
    assert_memory_equal(later.more, untouched.more, sizeof later.more);
    later.known.size = 8;
    assert_int_equal(render(&settings, &later.known, &error), CA_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, "the size of the statistics is 8 bytes"));
}

static bool take(const ca_render_progress *progress, void *user)
{
    ca_image_layers *image;
    later_statistics *later = user;
    assert_int_equal(progress->snapshot(progress, &image, &later->known, NULL), CA_OK);
    ca_image_release(image);
    return true;
}

static void test_snapshots(void **state)
{
    (void)state;
    ca_error error;
    later_statistics later = {.known = {.size = sizeof later}, .more = {5.0}};
    const ca_render_settings settings = {
        .samples_per_pixel = 3, .threads = 1, .progress = take, .progress_user = &later};
    assert_int_equal(render(&settings, NULL, &error), CA_OK);
    assert_int_equal(later.known.size, sizeof later);
    assert_true(later.known.iterations == 3 && later.more[0] == 5.0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_settings),
        cmocka_unit_test(test_later_settings),
        cmocka_unit_test(test_statistics),
        cmocka_unit_test(test_snapshots),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
