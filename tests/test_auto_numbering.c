/* Renders with rays "auto" trace every path once: an integrator that writes down which light paths and camera paths
 * it was asked for, in the pilot and in all phases. */
#include "render/auto_rays.h"
#include "support/auto_bias.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { SIDE = AUTO_BIAS_SIDE, PIXELS = SIDE * SIDE };

/* Functions of integrators are told nothing of the test that they run in. */
static struct notes {
    const ca_integrator_type *type; /* the real one */
    uint64_t first, light_paths;    /* of the state at work */
    uint64_t next_light_path;       /* of the render */
    uint32_t next_camera_path[PIXELS], states;
    uint64_t sizes[4]; /* light paths of an iteration of the first states */
} notes;

static ca_status create(const ca_integrator_input *input, void **state, ca_error *error)
{
    notes.first = input->first_light_path;
    notes.light_paths = (uint64_t)ca_integrator_value(notes.type, input, "light_paths", 0.0);
    if (notes.states < sizeof notes.sizes / sizeof notes.sizes[0]) notes.sizes[notes.states] = notes.light_paths;
    notes.states++;
    return notes.type->create(input, state, error);
}

static ca_status begin_round(void *state, uint32_t pass, uint32_t round, const ca_parallel *parallel,
                             ca_worker *workers, ca_error *error)
{
    assert_true(round == 0 && notes.light_paths > 0);
    assert_int_equal(notes.first + pass * notes.light_paths, notes.next_light_path);
    notes.next_light_path += notes.light_paths;
    return notes.type->begin_round(state, pass, round, parallel, workers, error);
}

static void camera_paths(const void *state, ca_camera_path *paths, uint32_t count, uint32_t round, ca_worker *worker)
{
    for (uint32_t i = 0; i < count; i++)
        assert_int_equal(paths[i].index, notes.next_camera_path[paths[i].y * SIDE + paths[i].x]++);
    notes.type->camera_paths(state, paths, count, round, worker);
}

static void render_noted(const ca_scene *scene, const ca_render_settings *settings, ca_image_layers **image,
                         ca_render_statistics *statistics)
{
    ca_render_plan plan;
    ca_error error = {""};
    if (ca_render_plan_make(&plan, scene, settings, &error) != CA_OK) fail_msg("%s", error.message);
    memset(&notes, 0, sizeof notes);
    notes.type = plan.type;
    ca_integrator_type spy = *plan.type;
    spy.create = create;
    spy.begin_round = begin_round;
    spy.camera_paths = camera_paths;
    plan.type = &spy;
    if (ca_auto_rays_render(&plan, NULL, image, statistics, &error) != CA_OK) fail_msg("%s", error.message);
}

static void test_every_path_once(void **state)
{
    (void)state;
    static const char *const integrators[] = {"bdpm", "ppm"};
    ca_scene *scene = auto_bias_scene();
    for (int i = 0; i < 2; i++) {
        ca_render_settings settings;
        ca_render_settings_init(&settings);
        settings.integrator = integrators[i];
        settings.rays = "auto";
        settings.samples_per_pixel = 120;
        settings.light_paths = 40;
        settings.threads = 1;
        ca_image_layers *image;
        ca_render_statistics statistics = {.size = sizeof statistics};
        render_noted(scene, &settings, &image, &statistics);
        /* Two groups of the pilot, then trials and phases: ppm, whose iterations are of one camera path, has room for
         * all three. */
        assert_true(statistics.numbers_of_rays.phases >= 1 && notes.states == 2 + statistics.numbers_of_rays.phases);
        if (i == 1) assert_true(statistics.numbers_of_rays.phases >= 3);
        assert_int_equal(notes.next_light_path, statistics.light_paths);
        const float *camera = ca_image_channel(image, "Rays.Camera");
        uint64_t camera_paths = 0;
        for (int p = 0; p < PIXELS; p++) {
            assert_true(camera[p] == (float)notes.next_camera_path[p]);
            camera_paths += notes.next_camera_path[p];
        }
        assert_int_equal(camera_paths, statistics.camera_paths);
        assert_true(camera_paths >= 120 * PIXELS); /* all samples count, and no fewer are made than were asked for */
        ca_image_release(image);
    }
    ca_scene_release(scene);
}

static bool until_the_fourth_state(const ca_render_progress *progress, void *user)
{
    (void)progress;
    (void)user;
    return notes.states < 4;
}

/* A pilot with ten minutes ahead grows, from a quarter of a light path a pixel by fours, unless somebody gave
 * its numbers. */
static void test_pilot_grows_with_its_time(void **state)
{
    (void)state;
    ca_scene *scene = auto_bias_scene();
    for (int given = 0; given < 2; given++) {
        ca_render_settings settings;
        ca_render_settings_init(&settings);
        settings.integrator = "bdpm";
        settings.rays = "auto";
        settings.seconds = given ? 1.0 : 600.0;
        settings.light_paths = given ? 40 : 0;
        settings.threads = 1;
        settings.progress = until_the_fourth_state;
        ca_image_layers *image;
        ca_render_statistics statistics = {.size = sizeof statistics};
        render_noted(scene, &settings, &image, &statistics);
        ca_image_release(image);
        if (given) {
            assert_true(notes.sizes[0] == 10 && notes.sizes[1] == 40);
        } else {
            assert_true(notes.sizes[0] == PIXELS / 4 && notes.sizes[1] == PIXELS);
            assert_true(notes.sizes[2] == 4 * PIXELS && notes.sizes[3] == 16 * PIXELS);
        }
    }
    ca_scene_release(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_every_path_once),
                                       cmocka_unit_test(test_pilot_grows_with_its_time)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
