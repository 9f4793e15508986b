/* Renders with rays "auto" trace every path once: an integrator that writes down which light paths and camera paths it was asked for,
 * in the pilot and in all phases. */
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
} notes;

static ca_status create(const ca_integrator_input *input, void **state, ca_error *error)
{
    notes.first = input->first_light_path;
    notes.light_paths = (uint64_t)ca_integrator_value(notes.type, input, "light_paths", 0.0);
    notes.states++;
    return notes.type->create(input, state, error);
}

static ca_status begin_round(void *state, uint32_t pass, uint32_t round, const ca_parallel *parallel, ca_worker *workers,
                             ca_error *error)
{
    assert_true(round == 0 && notes.light_paths > 0);
    assert_int_equal(notes.first + pass * notes.light_paths, notes.next_light_path);
    notes.next_light_path += notes.light_paths;
    return notes.type->begin_round(state, pass, round, parallel, workers, error);
}

static void camera_path(const void *state, uint32_t x, uint32_t y, uint32_t index, uint32_t round, ca_film_sample *sample,
                        ca_worker *worker)
{
    assert_int_equal(index, notes.next_camera_path[y * SIDE + x]++);
    notes.type->camera_path(state, x, y, index, round, sample, worker);
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
        ca_render_plan plan;
        ca_image_layers *image;
        ca_render_statistics statistics;
        ca_error error = {""};
        if (ca_render_plan_make(&plan, scene, &settings, &error) != CA_OK) fail_msg("%s", error.message);
        memset(&notes, 0, sizeof notes);
        notes.type = plan.type;
        ca_integrator_type spy = *plan.type;
        spy.create = create;
        spy.begin_round = begin_round;
        spy.camera_path = camera_path;
        plan.type = &spy;
        if (ca_auto_rays_render(&plan, NULL, &image, &statistics, &error) != CA_OK) fail_msg("%s", error.message);
        /* Two groups of the pilot, then the phases: ppm, whose iterations are of one camera path, has room for all three. */
        assert_true(statistics.numbers_of_rays.phases >= 1 && notes.states == 2 + statistics.numbers_of_rays.phases);
        if (i == 1) assert_int_equal(statistics.numbers_of_rays.phases, 3);
        assert_int_equal(notes.next_light_path, statistics.light_paths);
        const float *camera = ca_image_channel(image, "Rays.Camera");
        for (int p = 0; p < PIXELS; p++) assert_true(camera[p] == (float)notes.next_camera_path[p]);
        ca_image_release(image);
    }
    ca_scene_release(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_every_path_once)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
