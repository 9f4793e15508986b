/* What becomes of a choice of numbers of rays that is predicted to be worse than the pilot's: tried, never kept. */
#include "render/auto_rays_state.h"
#include "support/auto_scenes.h"

#include <setjmp.h>
#include <stdarg.h>

#include <cmocka.h>

enum { PILOT_LIGHT_PATHS = 4000, FEW = 20 };

/* Asks for a choice among at most FEW light paths, as soon as the pilot has told what there is to know. */
typedef struct question {
    ca_status status;
    bool asked, for_a_trial;
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
    const ca_auto_basis basis = {a->times, a->plain_seconds, a->progress};
    const ca_auto_limits limits = {
        .iterations = 1, .timed_light_paths = FEW, .reach = 1, .for_a_trial = q->for_a_trial};
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

/* Under water each light path lights its own spot: few of them leave much more noise than they save time. */
static question answer(const char *integrator, bool for_a_trial)
{
    question q = {.for_a_trial = for_a_trial};
    ca_scene *water = water_scene();
    ca_render_settings settings = auto_settings(integrator, 200);
    settings.rays = "auto";
    settings.light_paths = PILOT_LIGHT_PATHS;
    settings.radius = 0.05;
    settings.progress = ask;
    settings.progress_user = &q;
    ca_image_release(render_scene(water, &settings));
    ca_scene_release(water);
    assert_true(q.asked && q.status == CA_OK);
    print_message("%s: %g of %g light paths, gain %g\n", integrator, q.light_paths, q.pilot_light_paths, q.gain);
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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_worse_numbers_are_not_kept),
        cmocka_unit_test(test_worse_numbers_are_not_kept_where_paths_connect),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
