/* What becomes of a choice of numbers of rays that is predicted to be worse than the pilot's: tried, never kept. */
#include "render/auto_rays_state.h"
#include "support/auto_scenes.h"

#include <setjmp.h>
#include <stdarg.h>

#include <cmocka.h>

enum { PILOT_LIGHT_PATHS = 4000, FEW = 20 };

/* Asks for a choice among at most so many light paths, as soon as the pilot has told what there is to know. */
typedef struct question {
    ca_status status;
    bool asked, for_a_trial;
    double most;
    double gain, light_paths, pilot_light_paths, pilot_camera_paths;
    uint32_t of_first_pixel;
} question;

static bool ask(const ca_render_progress *progress, void *user)
{
    question *q = user;
    ca_auto_rays *a = progress->render;
    const bool knows = a && (a->decision.step == CA_AUTO_VALIDATE || a->decision.step == CA_AUTO_PHASE);
    if (q->asked || !knows) return true;
    q->asked = true;
    ca_auto_choice choice;
    ca_auto_basis basis = {a->times, a->plain_seconds, a->progress};
    basis.progress.camera_paths = 0.0; /* so that there is room for any iteration */
    basis.progress.seconds = 1e6;
    const ca_auto_limits limits = {
        .iterations = 1, .timed_light_paths = q->most, .reach = 1, .for_a_trial = q->for_a_trial};
    q->status = ca_auto_choose(a, &basis, &limits, &choice, NULL);
    if (q->status != CA_OK) return false;
    q->gain = choice.numbers.gain_over_given;
    q->light_paths = choice.numbers.best.light_paths;
    q->of_first_pixel = choice.numbers.camera_paths[0];
    q->pilot_light_paths = a->ordinary.numbers.light_paths;
    q->pilot_camera_paths = a->ordinary.numbers.camera_paths;
    ca_auto_choice_destroy(&choice);
    return true;
}

static question answer_of(const ca_scene *scene, const char *integrator, double most, bool for_a_trial)
{
    question q = {.for_a_trial = for_a_trial, .most = most};
    ca_render_settings settings = auto_settings(integrator, 400);
    settings.rays = "auto";
    settings.light_paths = PILOT_LIGHT_PATHS;
    settings.radius = 0.05;
    settings.progress = ask;
    settings.progress_user = &q;
    ca_image_release(render_scene(scene, &settings));
    assert_true(q.asked && q.status == CA_OK);
    print_message("%s: %g of %g light paths, gain %g\n", integrator, q.light_paths, q.pilot_light_paths, q.gain);
    return q;
}

/* Under water each light path lights its own spot: few of them leave much more noise than they save time. */
static question answer(const char *integrator, bool for_a_trial)
{
    ca_scene *water = water_scene();
    const question q = answer_of(water, integrator, FEW, for_a_trial);
    ca_scene_release(water);
    return q;
}

static void assert_tried_but_not_kept(const char *integrator)
{
    const question tried = answer(integrator, true), kept = answer(integrator, false);
    assert_true(tried.gain < 0.9 && tried.light_paths <= FEW);
    assert_true(kept.gain == 1.0 && kept.light_paths == kept.pilot_light_paths && kept.light_paths > FEW);
    assert_true(kept.of_first_pixel == kept.pilot_camera_paths);
}

static void test_worse_numbers_are_not_kept(void **state)
{
    (void)state;
    assert_tried_but_not_kept("bdpm:max_depth=4");
}

static void test_worse_numbers_are_not_kept_where_paths_connect(void **state)
{
    (void)state;
    assert_tried_but_not_kept("vcm:max_depth=4");
}

/* What the pilot has not met may still come: numbers stay as they were, as far as they may. */
static void test_black_picture(void **state)
{
    (void)state;
    static const char *const integrators[] = {"bdpm:max_depth=4", "vcm:max_depth=4"};
    ca_scene *dark = scene_from_text("<scene version='3.0.0'>" FROM_ABOVE("8") FLOOR "<emitter type='spot'>"
                                     "<transform "
                                     "name='to_world'><lookat origin='0,9,0' target='0,20,0' up='1,0,0'/></transform>"
                                     "</emitter></scene>");
    for (int i = 0; i < 2; i++) {
        const question all = answer_of(dark, integrators[i], 1e6, true);
        const question some = answer_of(dark, integrators[i], PILOT_LIGHT_PATHS / 2, true);
        assert_true(all.light_paths == PILOT_LIGHT_PATHS && all.of_first_pixel == all.pilot_camera_paths);
        assert_true(some.light_paths == PILOT_LIGHT_PATHS / 2);
    }
    ca_scene_release(dark);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_worse_numbers_are_not_kept),
        cmocka_unit_test(test_worse_numbers_are_not_kept_where_paths_connect),
        cmocka_unit_test(test_black_picture),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
