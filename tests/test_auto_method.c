/* Integrator `auto`: a render has the bits of one with the chosen method named. Decisions: test_method_choice.c;
 * trials: test_method_trial.c. */
#define _DEFAULT_SOURCE /* mkstemps */
#include "image/layers.h"
#include "render/auto_method.h"
#include "support/auto_scenes.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

typedef struct auto_render {
    uint64_t hash;
    char method[512], reason[CA_METHOD_REASON_SIZE];
    ca_render_statistics statistics;
} auto_render;

static auto_render render_auto(const ca_scene *scene, const ca_render_settings *settings)
{
    auto_render r = {.hash = 0};
    ca_image_layers *image;
    ca_error error;
    if (ca_render(scene, settings, &image, &r.statistics, &error) != CA_OK) fail_msg("%s", error.message);
    r.hash = image_hash(image);
    snprintf(r.method, sizeof r.method, "%s", attribute_text(image, "caustica.integrator"));
    memcpy(r.reason, r.statistics.method.reason, sizeof r.reason);
    ca_image_release(image);
    return r;
}

/* Trials leave no trace in the picture. */
static void test_bits_are_those_of_the_method(void **state)
{
    (void)state;
    ca_scene *(*const scenes[])(void) = {wall_scene, water_scene};
    for (size_t i = 0; i < 2; i++) {
        ca_scene *scene = scenes[i]();
        ca_render_settings settings = auto_settings("auto", 5);
        settings.has_seed = true;
        settings.seed = 77;
        const auto_render r = render_auto(scene, &settings);
        print_message("%s\n", r.reason);
        assert_true(strncmp(r.reason, "auto: ", 6) == 0 && r.statistics.method.seconds > 0.0);
        assert_true(r.statistics.method.trial_count > 0 && r.statistics.iterations == 5);
        settings.integrator = r.method;
        settings.threads = 3;
        assert_true(rendered_hash(scene, &settings) == r.hash);
        settings.seed = 78;
        assert_true(rendered_hash(scene, &settings) != r.hash);
        ca_scene_release(scene);
    }
}

static uint32_t guided_trials(const auto_render *render)
{
    uint32_t guided = 0;
    for (uint32_t i = 0; i < render->statistics.method.trial_count; i++)
        guided += render->statistics.method.trials[i].guided;
    return guided;
}

/* All light under water comes from merges; a lamp on a floor is found by next event with one sample's noise. Light
 * paths are guided. */
static void test_choices(void **state)
{
    (void)state;
    ca_scene *water = water_scene();
    ca_scene *wall = scene_from_text("<scene version='3.0.0'>" FROM_ABOVE("64") FLOOR LAMP "</scene>");
    ca_scene *dark = scene_from_text("<scene version='3.0.0'>" FROM_ABOVE("8") FLOOR "</scene>");
    const ca_render_settings settings = auto_settings("auto:max_depth=6", 16);
    const auto_render of_water = render_auto(water, &settings), of_wall = render_auto(wall, &settings);
    const auto_render of_dark = render_auto(dark, &settings);
    assert_true(ca_integrator_of(of_water.method)->rules->merge != CA_MERGE_NONE);
    assert_non_null(strstr(of_water.reason, "only merges find about 100 % of the light"));
    for (uint32_t i = 0; i < of_water.statistics.method.trial_count; i++) /* what loses light is not even tried */
        assert_true(ca_integrator_of(of_water.statistics.method.trials[i].name)->rules->merge != CA_MERGE_NONE);
    assert_true(ca_integrator_of(of_wall.method)->rules->merge == CA_MERGE_NONE);
    assert_true(guided_trials(&of_water) >= 4 && guided_trials(&of_wall) >= 4);
    assert_true(ca_integrator_of(of_dark.method) == &ca_integrator_path && of_dark.reason[0] == '\0');
    ca_scene_release(water);
    ca_scene_release(wall);
    ca_scene_release(dark);
}

/* The user may say that light paths are not guided. */
static void test_guide(void **state)
{
    (void)state;
    ca_scene *water = water_scene();
    const ca_render_settings without = auto_settings("auto:max_depth=4,guide=false", 1);
    const auto_render r = render_auto(water, &without);
    assert_int_equal(guided_trials(&r), 0);
    ca_scene_release(water);
}

/* Without a name it is `auto`. */
static void test_default(void **state)
{
    (void)state;
    ca_scene *scene = wall_scene();
    const ca_render_settings settings = auto_settings(NULL, 2);
    assert_true(render_auto(scene, &settings).reason[0] != '\0');
    ca_scene_release(scene);
}

/* Of the picture whose method is used again, for all tests. */
static char picture_path[] = "/tmp/caustica-auto-XXXXXX.exr";

static int make_path(void **state)
{
    (void)state;
    const int descriptor = mkstemps(picture_path, (int)strlen(".exr"));
    return descriptor >= 0 ? close(descriptor) : -1;
}

static int remove_path(void **state)
{
    (void)state;
    (void)unlink(picture_path); /* a test may have done so */
    return 0;
}

static void save_picture(const ca_scene *scene, const ca_render_settings *settings)
{
    ca_error error;
    ca_image_layers *image = render_scene(scene, settings);
    if (ca_image_save(image, picture_path, 0.0f, &error) != CA_OK) fail_msg("%s", error.message);
    ca_image_release(image);
}

/* A picture says which method it was made with, and that is used again. */
static void test_choice_of_a_file(void **state)
{
    (void)state;
    ca_scene *scene = wall_scene();
    const ca_render_settings made = auto_settings("vcm:light_paths=99,radius=0.25,max_depth=5,camera_paths=2", 4);
    const uint64_t hash = rendered_hash(scene, &made);
    save_picture(scene, &made);
    ca_render_settings settings = auto_settings("auto", 4);
    settings.rays = picture_path;
    const auto_render r = render_auto(scene, &settings);
    assert_true(r.hash == hash && r.statistics.method.seconds == 0.0);
    assert_non_null(strstr(r.reason, "auto: vcm, as /tmp/caustica-auto-"));

    ca_image_layers *image;
    ca_error error;
    const ca_render_settings blocks = auto_settings("qmcppm", 1);
    save_picture(scene, &blocks); /* of another kind than `auto` chooses from */
    assert_int_equal(ca_render(scene, &settings, &image, NULL, &error), CA_ERROR_FORMAT);
    assert_non_null(strstr(error.message, "does not say which method"));
    unlink(picture_path);
    assert_int_equal(ca_render(scene, &settings, &image, NULL, &error), CA_ERROR_FILE);
    ca_scene_release(scene);
}

/* What a file says cannot be set as well; the same value can, and so can what the method has not. */
static void test_contradicted_file(void **state)
{
    (void)state;
    ca_scene *scene = wall_scene();
    const ca_render_settings made = auto_settings("path:max_depth=5", 2);
    const uint64_t hash = rendered_hash(scene, &made);
    save_picture(scene, &made);
    ca_render_settings settings = auto_settings("auto:max_depth=5,light_paths=7", 2);
    settings.rays = picture_path;
    settings.radius = 0.5;
    assert_true(render_auto(scene, &settings).hash == hash);
    ca_image_layers *image;
    ca_error error;
    settings = auto_settings("auto", 2);
    settings.rays = picture_path;
    settings.has_max_depth = true;
    settings.max_depth = 4;
    assert_int_equal(ca_render(scene, &settings, &image, NULL, &error), CA_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, ".exr: its method has max_depth=5, and 4 is asked for"));
    settings = auto_settings("auto:hide_emitters=true", 2);
    settings.rays = picture_path;
    assert_int_equal(ca_render(scene, &settings, &image, NULL, &error), CA_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, "its method has hide_emitters=false, and true is asked for"));
    settings = auto_settings("auto:heuristic=balance", 2); /* that of path is another one by default */
    settings.rays = picture_path;
    assert_int_equal(ca_render(scene, &settings, &image, NULL, &error), CA_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, "its method has heuristic=power, and balance is asked for"));
    ca_scene_release(scene);
}

/* The scene's parameters are those of whatever it is rendered with, and ask for nothing; numbers of rays that are
 * chosen are not those that their pilot was asked to have. */
static void test_file_of_chosen_rays(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(
        "<scene version='3.0.0'><integrator type='auto'><float name='alpha' value='0.3'/>"
        "<integer name='max_depth' value='4'/></integrator>" FROM_ABOVE("8") FLOOR LAMP "</scene>");
    ca_render_settings settings = auto_settings("auto:max_depth=5", 40);
    settings.rays = "auto";
    settings.light_paths = 200;
    save_picture(scene, &settings);
    settings.integrator = NULL;
    settings.rays = picture_path;
    assert_non_null(strstr(render_auto(scene, &settings).method, "max_depth=5"));
    ca_scene_release(scene);
}

/* There is an image for each length of paths, and the file's method has paths of any length. */
static void test_strategies_of_a_file(void **state)
{
    (void)state;
    char folder[] = "/tmp/caustica-auto-XXXXXX";
    assert_non_null(mkdtemp(folder));
    ca_scene *scene = scene_from_text(
        "<scene version='3.0.0'><integrator type='auto'><integer name='max_depth' value='5'/></integrator>"
        FROM_ABOVE("8") FLOOR LAMP "</scene>");
    const ca_render_settings made = auto_settings("path:max_depth=-1", 1);
    save_picture(scene, &made);
    ca_render_settings settings = auto_settings(NULL, 1); /* the scene's, whose paths are short */
    settings.rays = picture_path;
    settings.strategies_directory = folder;
    ca_image_layers *image;
    ca_error error;
    assert_int_equal(ca_render(scene, &settings, &image, NULL, &error), CA_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, "need a max_depth of at most"));
    rmdir(folder);
    ca_scene_release(scene);
}

/* Numbers of rays are chosen with the method, and by a pilot of their own where there are samples enough. */
static void test_rays(void **state)
{
    (void)state;
    ca_scene *scene = wall_scene();
    ca_render_settings settings = auto_settings("auto", 2);
    settings.rays = "auto";
    assert_true(render_auto(scene, &settings).reason[0] != '\0');
    settings.rays_objective = "mean";
    settings.samples_per_pixel = 40;
    assert_true(render_auto(scene, &settings).reason[0] != '\0');
    settings.rays_objective = "worst-decile";
    ca_image_layers *image;
    ca_error error;
    assert_int_equal(ca_render(scene, &settings, &image, NULL, &error), CA_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, "worst decile"));
    ca_scene_release(scene);
}

/* A method without such a number has one camera path of a pixel in a pass, whatever was asked of `auto`. */
static void test_camera_paths(void **state)
{
    (void)state;
    ca_scene *scene = wall_scene(); /* that of `path` */
    ca_render_settings settings = auto_settings("auto", 24);
    settings.camera_paths = 4;
    ca_image_layers *image = NULL;
    ca_render_statistics statistics = {.size = sizeof statistics};
    assert_int_equal(ca_render(scene, &settings, &image, &statistics, NULL), CA_OK);
    const bool by_path = strncmp(statistics.method.reason, "auto: path", 10) == 0;
    print_message("%s\n", statistics.method.reason);
    assert_true(statistics.samples_per_pixel == 24.0 && statistics.iterations == (by_path ? 24 : 6));
    const uint64_t hash = image_hash(image);
    settings = auto_settings(attribute_text(image, "caustica.integrator"), 24);
    ca_image_layers *named = render_scene(scene, &settings);
    assert_true(image_hash(named) == hash);
    ca_image_release(named);
    ca_image_release(image);
    settings = auto_settings("auto", 24);
    settings.camera_paths = 4; /* which ppm cannot have: it is not tried */
    settings.rays = "auto";
    assert_int_equal(ca_render(scene, &settings, &image, &statistics, NULL), CA_OK);
    for (uint32_t i = 0; i < statistics.method.trial_count; i++)
        assert_string_not_equal(statistics.method.trials[i].name, "ppm");
    ca_image_release(image);
    ca_scene_release(scene);
}

typedef struct listener {
    uint32_t calls, end_at, told_before_choice;
    bool told;
    char warning[CA_PREFLIGHT_WARNING_SIZE];
} listener;

static bool listen(const ca_render_progress *progress, void *user)
{
    listener *l = user;
    if (progress->method) l->told = true;
    if (progress->method_warning) snprintf(l->warning, sizeof l->warning, "%s", progress->method_warning);
    if (!progress->method && !progress->snapshot && progress->passes_done == 0) l->told_before_choice++;
    return ++l->calls != l->end_at;
}

/* A method that loses light is warned of, wherever its name comes from; and the bits of a picture need its seed. */
static void test_warnings_of_a_file(void **state)
{
    (void)state;
    ca_scene *scene = water_scene();
    ca_render_settings made = auto_settings("path:max_depth=6", 2);
    made.has_seed = true;
    made.seed = 5;
    save_picture(scene, &made);
    listener heard = {.end_at = UINT32_MAX};
    ca_render_settings settings = auto_settings("auto", 2);
    settings.rays = picture_path;
    settings.progress = listen;
    settings.progress_user = &heard;
    const auto_render r = render_auto(scene, &settings);
    assert_non_null(strstr(heard.warning, "\"path\" will find none or too little of about 100 % of the light"));
    assert_non_null(strstr(r.reason, ".exr says (--seed 5 makes its picture again)"));
    ca_scene_release(scene);
}

/* The caller hears of the choice, and can end the render while it is made: there is a picture in any case. */
static void test_progress(void **state)
{
    (void)state;
    ca_scene *scene = wall_scene();
    listener l = {.calls = 0};
    ca_render_settings settings = auto_settings("auto", 3);
    settings.progress = listen;
    settings.progress_user = &l;
    render_auto(scene, &settings);
    assert_true(l.told && l.told_before_choice > 0);
    l = (listener){.end_at = 1};
    const auto_render r = render_auto(scene, &settings);
    assert_true(r.statistics.interrupted && r.statistics.iterations == 1);
    assert_true(ca_integrator_of(r.method) == &ca_integrator_vavcm);
    ca_scene_release(scene);
}

static void assert_warns_of_dots(const ca_scene *scene, const char *integrator, uint32_t samples, bool warns)
{
    listener l = {.calls = 0};
    ca_render_settings settings = auto_settings(integrator, samples);
    settings.progress = listen;
    settings.progress_user = &l;
    const auto_render r = render_auto(scene, &settings);
    print_message("%s\n%s\n", r.reason, l.warning);
    assert_true(l.told);
    if ((strstr(l.warning, "of the light will be dots") != NULL) != warns)
        fail_msg("%s with %u samples: \"%s\"", integrator, samples, l.warning);
}

/* Under water all light comes from merges: with a tiny radius it is dots, unless there are many light paths. These
 * are guided: others would meet the picture's floor 50 times less often. */
static void test_warns_of_dots(void **state)
{
    (void)state;
    ca_scene *water = water_scene();
    assert_warns_of_dots(water, "auto:radius=0.001", 4, true);
    assert_warns_of_dots(water, "auto:radius=0.004,light_paths=100000", 4, false);
    ca_scene_release(water);
}

/* A radius at which merges meet no photon leaves `ppm` and `bdpm` black, and their trials without noise: others find
 * the light. */
static void test_no_photons(void **state)
{
    (void)state;
    ca_scene *wall = scene_from_text("<scene version='3.0.0'>" FROM_ABOVE("64") FLOOR LAMP "</scene>");
    static const char *const radii[] = {"auto:max_depth=4,radius=1e-6", "auto:max_depth=4,radius=0.001"};
    for (int i = 0; i < 2; i++) {
        const ca_render_settings settings = auto_settings(radii[i], 16);
        const auto_render r = render_auto(wall, &settings);
        const ca_integrator_type *type = ca_integrator_of(r.method);
        print_message("%s\n", r.reason);
        assert_true(type->rules->merge == CA_MERGE_NONE || type->rules->connect);
    }
    ca_scene_release(wall);
}

/* Settings that no engine takes leave `path`, which takes them. */
static void test_unsupported_methods(void **state)
{
    (void)state;
    ca_scene *scene = wall_scene();
    const ca_render_settings settings = auto_settings("auto:rr_depth=4000", 2);
    assert_true(ca_integrator_of(render_auto(scene, &settings).method) == &ca_integrator_path);
    ca_scene_release(scene);
}

static void test_check(void **state)
{
    (void)state;
    ca_scene *scene = wall_scene();
    ca_error error;
    ca_render_settings settings = auto_settings("auto", 2);
    assert_int_equal(ca_render_check(scene, &settings, &error), CA_OK);
    settings.integrator = "auto:rr_depth=4000"; /* which `path` takes */
    assert_int_equal(ca_render_check(scene, &settings, &error), CA_OK);
    settings.integrator = "auto:max_dept=3";
    assert_int_equal(ca_render_check(scene, &settings, &error), CA_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, "did you mean \"max_depth\"?"));
    ca_scene_release(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_bits_are_those_of_the_method),
        cmocka_unit_test(test_choices),
        cmocka_unit_test(test_guide),
        cmocka_unit_test(test_default),
        cmocka_unit_test(test_choice_of_a_file),
        cmocka_unit_test(test_contradicted_file),
        cmocka_unit_test(test_file_of_chosen_rays),
        cmocka_unit_test(test_strategies_of_a_file),
        cmocka_unit_test(test_warnings_of_a_file),
        cmocka_unit_test(test_rays),
        cmocka_unit_test(test_camera_paths),
        cmocka_unit_test(test_progress),
        cmocka_unit_test(test_warns_of_dots),
        cmocka_unit_test(test_no_photons),
        cmocka_unit_test(test_unsupported_methods),
        cmocka_unit_test(test_check),
    };
    return cmocka_run_group_tests(tests, make_path, remove_path);
}
