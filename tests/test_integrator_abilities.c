/* What each integrator can do, as its user sees it: which take rays, have their noise measured, have one camera path,
 * count light paths as samples, render by blocks. All rows of the table are asked; a row that `expected` does not
 * name can do none of it. */
#include "integrator/integrator.h"
#include "render/noise.h"
#include "render/render.h"
#include "support/scene_text.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

typedef struct abilities {
    const char *name;
    bool pair_law, connections, one_camera_path, light_samples, blocks, chooses;
} abilities;

static const abilities expected[] = {
    {"light", .light_samples = true},
    {"bdpt", .connections = true},
    {"ppm", .pair_law = true, .one_camera_path = true},
    {"bdpm", .pair_law = true},
    {"vcm", .connections = true},
    {"ovcm", .connections = true},
    {"vavcm", .connections = true},
    {"auto", .chooses = true},
    {"qmcppm", .blocks = true},
};
enum { EXPECTED_COUNT = sizeof expected / sizeof expected[0] };

static abilities expected_of(const char *name)
{
    for (int i = 0; i < EXPECTED_COUNT; i++)
        if (strcmp(expected[i].name, name) == 0) return expected[i];
    return (abilities){name, .pair_law = false};
}

/* 20 pixels, and an integrator without parameters of its own. */
static ca_scene *scene_with(const char *integrator)
{
    char text[1024];
    snprintf(text, sizeof text,
             "<scene version=\"3.0.0\"><integrator type=\"%s\"/>"
             "<sensor type=\"perspective\"><float name=\"fov\" value=\"30\"/><film type=\"hdrfilm\">"
             "<integer name=\"width\" value=\"5\"/><integer name=\"height\" value=\"4\"/></film></sensor>"
             "<shape type=\"rectangle\"/><emitter type=\"point\"><point name=\"position\" value=\"0,0,2\"/></emitter>"
             "</scene>",
             integrator);
    return scene_from_text(text);
}

/* That the call succeeds, or is refused in these words. */
static void assert_outcome(const char *name, ca_status status, const ca_error *error, bool can, const char *words)
{
    if (can && status != CA_OK) fail_msg("%s: refused: %s", name, error->message);
    if (!can && (status != CA_ERROR_ARGUMENT || !strstr(error->message, words)))
        fail_msg("%s: status %d and not \"%s\": %s", name, (int)status, words, error->message);
}

static void check_rays(const ca_scene *scene, const abilities *can)
{
    ca_render_settings settings;
    ca_render_plan plan;
    ca_error error = {""};
    char words[128];
    ca_render_settings_init(&settings);
    settings.rays = "auto";
    settings.seconds = 1.0;
    snprintf(words, sizeof words, "are for integrators bdpt, ppm, bdpm, vcm, ovcm, vavcm and auto, not for %s",
             can->name);
    const ca_status status = ca_render_plan_make(&plan, scene, &settings, &error);
    assert_outcome(can->name, status, &error, can->pair_law || can->connections || can->chooses, words);
}

static void check_noise(const ca_scene *scene, const abilities *can)
{
    ca_render_settings settings;
    ca_noise_setup setup;
    ca_error error = {""};
    char words[128];
    ca_render_settings_init(&settings);
    settings.integrator = can->name;
    snprintf(words, sizeof words, "the integrator must be bdpt, ppm, bdpm, vcm, ovcm or vavcm, not %s", can->name);
    const ca_status status = ca_noise_check(scene, &settings, 2, &setup, &error);
    assert_outcome(can->name, status, &error, can->pair_law || can->connections, words);
    if (status != CA_OK) return;
    assert_string_equal(setup.integrator, can->name);
    assert_int_equal(setup.connects, can->connections);
    assert_int_equal(setup.camera_paths, can->one_camera_path ? 1 : 4);
    assert_false(setup.instead_of_scene);
}

/* The scene's integrator is measured where numbers can be chosen for it; else bdpm is. */
static void check_default_of_noise(const ca_scene *scene, const abilities *can)
{
    ca_render_settings settings;
    ca_noise_setup setup;
    ca_error error = {""};
    ca_render_settings_init(&settings);
    assert_outcome(can->name, ca_noise_check(scene, &settings, 2, &setup, &error), &error, true, "");
    assert_string_equal(setup.integrator, can->pair_law ? can->name : "bdpm");
    assert_int_equal(setup.instead_of_scene, !can->pair_law);
}

static void check_blocks(const ca_scene *scene, const abilities *can)
{
    ca_render_settings settings;
    ca_render_plan plan;
    ca_error error = {""};
    ca_render_settings_init(&settings);
    settings.has_blocks = true;
    settings.blocks[1] = 3;
    const ca_status status = ca_render_plan_make(&plan, scene, &settings, &error);
    assert_outcome(can->name, status, &error, can->blocks, "does not render by blocks of pairs");
}

/* Three samples per pixel are 3 passes of a camera path per pixel, or 60 light paths in passes of 5. */
static void check_samples(const ca_scene *scene, const abilities *can, const ca_integrator_type *type)
{
    ca_render_settings settings;
    ca_render_plan plan;
    ca_integrator_input input;
    ca_error error = {""};
    if (can->blocks) return;
    assert_int_equal(ca_integrator_configure(type, &(ca_integrator_desc){.name = NULL}, false, NULL, &input, NULL),
                     CA_OK);
    ca_render_settings_init(&settings);
    settings.samples_per_pixel = 3;
    settings.light_paths = ca_integrator_value(type, &input, "light_paths", -1.0) >= 0.0 ? 5 : 0;
    assert_outcome(can->name, ca_render_plan_make(&plan, scene, &settings, &error), &error, true, "");
    assert_int_equal(plan.pass_limit, can->light_samples ? 12 : 3);
}

static void test_users_see_abilities(void **state)
{
    (void)state;
    const ca_integrator_type *type;
    int named = 0;
    for (size_t i = 0; (type = ca_integrator_at(i)) != NULL; i++) {
        ca_scene *scene = scene_with(type->name);
        const abilities can = expected_of(type->name);
        for (int j = 0; j < EXPECTED_COUNT; j++) named += strcmp(expected[j].name, type->name) == 0;
        check_rays(scene, &can);
        check_noise(scene, &can);
        check_default_of_noise(scene, &can);
        check_blocks(scene, &can);
        check_samples(scene, &can, type);
        ca_scene_release(scene);
    }
    assert_int_equal(named, EXPECTED_COUNT);
}

/* With rays, light paths are chosen for one camera path per pixel: more of them are refused. */
static void test_one_camera_path(void **state)
{
    (void)state;
    for (int i = 0; i < EXPECTED_COUNT; i++) {
        if (!expected[i].pair_law) continue;
        ca_scene *scene = scene_with(expected[i].name);
        ca_render_settings settings;
        ca_image_layers *image = NULL;
        ca_error error = {""};
        char words[128];
        ca_render_settings_init(&settings);
        settings.rays = "auto";
        settings.samples_per_pixel = 1000;
        settings.camera_paths = 70000; /* which others refuse, too, for another reason */
        snprintf(words, sizeof words, "%s has one camera path per pixel, not 70000", expected[i].name);
        assert_int_equal(ca_render(scene, &settings, &image, NULL, &error), CA_ERROR_ARGUMENT);
        if (!strstr(error.message, expected[i].one_camera_path ? words : "at most 65536 camera paths"))
            fail_msg("%s: %s", expected[i].name, error.message);
        ca_scene_release(scene);
    }
}

/* What the abilities promise of a row's functions and parameters. */
static void test_rows_are_consistent(void **state)
{
    (void)state;
    const ca_integrator_type *type;
    for (size_t i = 0; (type = ca_integrator_at(i)) != NULL; i++) {
        ca_integrator_input input;
        const ca_integrator_desc nothing_set = {.name = NULL};
        assert_int_equal(ca_integrator_configure(type, &nothing_set, false, NULL, &input, NULL), CA_OK);
        const bool has_light_paths = ca_integrator_value(type, &input, "light_paths", -1.0) >= 0.0;
        const bool pairs = ca_integrator_has(type, CA_ABILITY_PAIR_LAW);
        const bool connections = ca_integrator_has(type, CA_ABILITY_CONNECTION_NOISE);
        assert_false(pairs && connections);
        if (pairs || connections) {
            assert_true(type->begin_pixel && type->end_pixel && has_light_paths);
            assert_true(ca_integrator_value(type, &input, "camera_paths", 0.0) == 1.0);
        }
        if (ca_integrator_has(type, CA_ABILITY_LIGHT_SAMPLES)) assert_true(has_light_paths);
        assert_true(!type->begin_block == !type->blocks_needed);
        if (ca_integrator_has(type, CA_ABILITY_CHOOSES))
            assert_true(!type->begin_block && !type->camera_paths && !type->begin_round && !type->rules);
        else
            assert_true(!type->begin_block == !!type->camera_paths);
    }
}

static void test_names(void **state)
{
    (void)state;
    char text[CA_INTEGRATOR_NAMES_SIZE];
    ca_integrator_names(CA_ABILITY_LIGHT_SAMPLES, " or ", text);
    assert_string_equal(text, "light");
    ca_integrator_names(CA_ABILITY_PAIR_LAW, " or ", text);
    assert_string_equal(text, "ppm or bdpm");
    ca_integrator_names(CA_ABILITY_PAIR_LAW | CA_ABILITY_CONNECTION_NOISE, " and ", text);
    assert_string_equal(text, "bdpt, ppm, bdpm, vcm, ovcm and vavcm");
    ca_integrator_names(0, " and ", text);
    assert_string_equal(text, "");
    assert_ptr_equal(ca_integrator_of("vcm"), &ca_integrator_vcm);
    assert_ptr_equal(ca_integrator_of("vcm:radius=1"), &ca_integrator_vcm);
    assert_null(ca_integrator_of("vc"));
    assert_null(ca_integrator_of("vcmx"));
    assert_null(ca_integrator_of(NULL));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_users_see_abilities),
        cmocka_unit_test(test_one_camera_path),
        cmocka_unit_test(test_rows_are_consistent),
        cmocka_unit_test(test_names),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
