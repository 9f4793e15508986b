/* What `auto` chooses from: the variance that the pilot tells of rare light, and that of a trial, are those of a
 * render. Decisions: test_method_choice.c; renders: test_auto_method.c. */
#include "image/layers.h"
#include "render/auto_method.h"
#include "render/method_light.h"
#include "render/method_trial.h"
#include "support/auto_scenes.h"
#include "support/light_pilots.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

/* With it all samples are dots. */
#define MUCH 1e6

static double much(const void *user, uint32_t x, uint32_t y)
{
    (void)user, (void)x, (void)y;
    return MUCH;
}

/* What a pilot of this effort says of a render of 256 passes of 24 x 24 pixels. */
static double dots_told(const ca_scene *scene, const ca_render_settings *settings, uint32_t effort)
{
    ca_light_pilot pilot = pilot_with_effort(scene, settings, 256, effort);
    assert_true(pilot.counters.camera_paths == (uint64_t)effort * CA_PILOT_CAMERA_PATHS);
    assert_true(pilot.counters.light_paths == (uint64_t)effort * CA_PILOT_LIGHT_PATHS);
    ca_lost_light(pilot.samples[0], pilot.count);
    const ca_dot_light light = {.light_paths = 1.0,
                                .camera_paths = effort * CA_PILOT_CAMERA_PATHS,
                                .expected_scale = 256.0 * 24 * 24 / (effort * CA_PILOT_CAMERA_PATHS),
                                .paths_of_pixel = 1.0,
                                .weight = much};
    const double told = ca_method_dots(pilot.samples[0], pilot.count, &light) / MUCH;
    ca_light_pilot_destroy(&pilot);
    return told;
}

/* A camera path of `path` brings one contribution there, by next event. Where all of them pass for dots, what the
 * pilot says is the mean square of a sample, whatever its effort. */
static void test_dots_are_the_second_moment(void **state)
{
    (void)state;
    ca_scene *scene = wall_scene();
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.integrator = "path:max_depth=2";
    settings.samples_per_pixel = 256;
    const double told = dots_told(scene, &settings, 1), more = dots_told(scene, &settings, 4);
    ca_image_layers *image = render_scene(scene, &settings);
    const float *g = ca_image_channel(image, "G"), *variance = ca_image_channel(image, "Variance.G");
    double measured = 0.0;
    for (int p = 0; p < 24 * 24; p++) measured += (double)variance[p] + (double)g[p] * (double)g[p];
    measured /= 24 * 24;
    print_message("second moment %.5g, by the pilot %.5g, by a longer one %.5g\n", measured, told, more);
    assert_true(fabs(told / measured - 1.0) < 0.05 && fabs(more / measured - 1.0) < 0.05);
    ca_image_release(image);
    ca_scene_release(scene);
}

/* ---- Settings -------------------------------------------------------------------------------------------------- */

/* What the user set goes to the method; what is not set stays the method's own. */
static void test_configure(void **state)
{
    (void)state;
    ca_scene *scene = wall_scene();
    ca_render_settings settings = auto_settings("auto:max_depth=7,alpha=0.25", 4);
    settings.radius = 0.125;
    ca_render_plan plan;
    ca_integrator_input input;
    const ca_method four = {.type = &ca_integrator_vavcm, .light_paths_log4 = 1};
    const ca_method path = {.type = &ca_integrator_path};
    const ca_method no_splats = {.type = &ca_integrator_bdpt, .no_splats = true};
    const ca_method_radii radii = {
        .of = {{.radius = 0.75}, {.radius = 0.5}, {.radius = 0.25}}}; /* of ca_merging */
    char text[512];
    assert_int_equal(ca_render_plan_make(&plan, scene, &settings, NULL), CA_OK);
    assert_int_equal(ca_method_configure(&four, &plan, &radii, &input, NULL), CA_OK);
    ca_integrator_describe(four.type, &input, text, sizeof text);
    assert_string_equal(text, "vavcm:max_depth=7,rr_depth=3,hide_emitters=false,heuristic=balance,light_paths=2304,"
                              "camera_paths=1,radius=0.125,alpha=0.25,radius_pixels=0,guide=true");
    assert_int_equal(ca_method_configure(&path, &plan, &radii, &input, NULL), CA_OK);
    ca_integrator_describe(path.type, &input, text, sizeof text);
    assert_string_equal(text, "path:max_depth=7,rr_depth=3,hide_emitters=false,heuristic=power,next_event=true");
    assert_int_equal(ca_method_configure(&no_splats, &plan, &radii, &input, NULL), CA_OK);
    ca_integrator_describe(no_splats.type, &input, text, sizeof text);
    assert_string_equal(text, "bdpt:max_depth=7,rr_depth=3,hide_emitters=false,heuristic=balance,light_paths=0,"
                              "camera_paths=1,strategies=no-splat,paper=false,guide=true");

    settings.radius = 0.0; /* the usual one, whatever the number of light paths */
    assert_int_equal(ca_render_plan_make(&plan, scene, &settings, NULL), CA_OK);
    assert_int_equal(ca_method_configure(&four, &plan, &radii, &input, NULL), CA_OK);
    assert_true(ca_integrator_value(four.type, &input, "radius", 0.0) == 0.25);
    const ca_method bdpm = {.type = &ca_integrator_bdpm};
    assert_int_equal(ca_method_configure(&bdpm, &plan, &radii, &input, NULL), CA_OK);
    assert_true(ca_integrator_value(bdpm.type, &input, "radius", 0.0) == 0.5);

    /* Where numbers of rays are chosen, too, the radius does not shrink: it is looked for as it will be. */
    ca_method_radius found, fixed;
    settings.integrator = "auto:max_depth=7,alpha=0";
    assert_int_equal(ca_render_plan_make(&plan, scene, &settings, NULL), CA_OK);
    assert_int_equal(ca_method_find_radius(&plan, CA_MERGING_BDPM, &fixed, NULL), CA_OK);
    settings.integrator = "auto:max_depth=7";
    settings.rays = "auto";
    assert_int_equal(ca_render_plan_make(&plan, scene, &settings, NULL), CA_OK);
    assert_int_equal(ca_method_configure(&bdpm, &plan, &radii, &input, NULL), CA_OK);
    assert_true(ca_integrator_value(bdpm.type, &input, "alpha", 1.0) == 0.0);
    assert_int_equal(ca_method_find_radius(&plan, CA_MERGING_BDPM, &found, NULL), CA_OK);
    assert_true(found.radius == fixed.radius);
    ca_scene_release(scene);
}

/* Light paths are guided unless the method says that they are not. */
static void test_guide(void **state)
{
    (void)state;
    ca_scene *water = water_scene();
    const ca_render_settings settings = auto_settings("auto:max_depth=4", 4);
    const ca_method method = {.type = &ca_integrator_ovcm}, unguided = {.type = method.type, .unguided = true};
    ca_render_plan plan;
    ca_integrator_input input;
    assert_int_equal(ca_render_plan_make(&plan, water, &settings, NULL), CA_OK);
    assert_int_equal(ca_method_configure(&method, &plan, NULL, &input, NULL), CA_OK);
    assert_true(ca_integrator_value(method.type, &input, "guide", 0.0) == 1.0);
    assert_int_equal(ca_method_configure(&unguided, &plan, NULL, &input, NULL), CA_OK);
    assert_true(ca_integrator_value(method.type, &input, "guide", 1.0) == 0.0);
    ca_scene_release(water);
}

/* Of a small picture. */
static ca_render_settings small_settings(const char *integrator)
{
    ca_render_settings settings = auto_settings(integrator, 4);
    settings.width = settings.height = 64;
    return settings;
}

/* The usual radii are those that the methods have by themselves; merges blur less where they have weights. In a long
 * render the pilots have more photons. */
static void test_radii(void **state)
{
    (void)state;
    ca_scene *scene = bundled_scene("cornell-box/cornell-box");
    ca_render_settings settings = small_settings("auto:max_depth=8,guide=false");
    static const char *const methods[CA_MERGINGS] = {
        [CA_MERGING_PPM] = "ppm:max_depth=8",
        [CA_MERGING_BDPM] = "bdpm:max_depth=8",
        [CA_MERGING_AND_CONNECTING] = "vavcm:max_depth=8",
    };
    ca_render_plan plan, own;
    ca_method_radius found[CA_MERGINGS], longer;
    assert_int_equal(ca_render_plan_make(&plan, scene, &settings, NULL), CA_OK);
    for (int m = 0; m < CA_MERGINGS; m++) {
        const ca_render_settings named = small_settings(methods[m]);
        assert_int_equal(ca_method_find_radius(&plan, (ca_merging)m, &found[m], NULL), CA_OK);
        assert_int_equal(ca_render_plan_make(&own, scene, &named, NULL), CA_OK);
        assert_true(ca_integrator_value(own.type, &own.input, "radius", 0.0) == found[m].radius);
    }
    assert_true(found[CA_MERGING_PPM].blur.factor != found[CA_MERGING_BDPM].blur.factor);
    const double radius = found[CA_MERGING_BDPM].radius;
    const double alone = ca_radius_blur_at(&found[CA_MERGING_BDPM].blur, radius);
    const double shared = ca_radius_blur_at(&found[CA_MERGING_AND_CONNECTING].blur, radius);
    print_message("photons alone blur %g, with connections %g\n", alone, shared);
    assert_true(shared < 0.7 * alone);
    settings.samples_per_pixel = 0;
    settings.seconds = 20.0;
    assert_int_equal(ca_render_plan_make(&plan, scene, &settings, NULL), CA_OK);
    assert_int_equal(ca_method_find_radius(&plan, CA_MERGING_PPM, &longer, NULL), CA_OK);
    assert_true(longer.blur.factor != found[CA_MERGING_PPM].blur.factor);
    ca_scene_release(scene);
}

/* ---- Trials ---------------------------------------------------------------------------------------------------- */

enum { TRIAL_ITERATIONS = 24, RENDER_SIDE = 144 };

/* The mean over pixels of an iteration's variance in the render's own size. */
static double render_variance(const ca_scene *scene, const char *integrator)
{
    ca_render_settings settings = auto_settings(integrator, TRIAL_ITERATIONS);
    settings.width = settings.height = RENDER_SIDE;
    ca_image_layers *image = render_scene(scene, &settings);
    const float *deviation = ca_image_channel(image, "StandardDeviation.Y");
    uint32_t width, height;
    double sum = 0.0;
    ca_image_size(image, &width, &height);
    for (size_t p = 0; p < (size_t)width * height; p++) sum += (double)deviation[p] * (double)deviation[p];
    ca_image_release(image);
    return sum / ((double)width * height);
}

static double trial_variance(const ca_scene *scene, const ca_method *method, uint64_t *seed)
{
    static double weights[CA_TRIAL_CELLS + 1];
    ca_render_settings settings =
        auto_settings("auto:alpha=0,radius=20,max_depth=5,hide_emitters=true,guide=false", 1);
    settings.width = settings.height = RENDER_SIDE;
    ca_render_plan plan;
    ca_method_trial trial;
    const ca_method_radii radii = {0}; /* not used: one is set */
    ca_error error;
    for (int p = 0; p <= CA_TRIAL_CELLS; p++) weights[p] = 1.0;
    assert_int_equal(ca_render_plan_make(&plan, scene, &settings, &error), CA_OK);
    assert_int_equal(ca_method_trial_create(&trial, &plan, method, &radii, NULL, &error), CA_OK);
    assert_true(ca_trial_cell_count(&trial.cells) <= CA_TRIAL_CELLS && trial.cells.width > 20);
    for (int i = 0; i < 3 * TRIAL_ITERATIONS; i++) assert_int_equal(ca_method_trial_run(&trial, &error), CA_OK);
    const double variance = ca_method_trial_variance(&trial, weights, (double)INFINITY);
    assert_true(ca_method_trial_seconds(&trial) > 0.0);
    const double cells = (double)ca_trial_cell_count(&trial.cells), pixels = RENDER_SIDE * RENDER_SIDE;
    trial.light_seconds = 2.0; /* scaled from the trial's film and cells to the render's */
    trial.camera_seconds = 3.0;
    const double area = pixels / ((double)trial.settings.width * trial.settings.height);
    assert_true(fabs(ca_method_trial_seconds(&trial) / (2.0 * area + 3.0 * pixels / cells) - 1.0) < 1e-9);
    *seed = trial.plan.seed;
    assert_true(*seed != plan.seed);
    ca_method_trial_destroy(&trial);
    return variance;
}

static void assert_as_noisy(const ca_scene *scene, const char *name, const ca_method *method)
{
    uint64_t seed;
    const double of_render = render_variance(scene, name), of_trial = trial_variance(scene, method, &seed);
    print_message("%s: %.4g, in the trial %.4g\n", name, of_render, of_trial);
    assert_true(fabs(of_trial / of_render - 1.0) < 0.12);
}

/* With fewer pixels, fewer light paths and a larger radius an iteration is as noisy as one of the render. */
static void test_trial_is_as_noisy(void **state)
{
    (void)state;
    static const struct {
        ca_method method;
        const char *name;
    } cases[] = {
        {{.type = &ca_integrator_path}, "path:max_depth=5,hide_emitters=true"},
        {{.type = &ca_integrator_bdpm}, "bdpm:max_depth=5,alpha=0,hide_emitters=true,radius=20"},
        {{.type = &ca_integrator_bdpm, .light_paths_log4 = -1},
         "bdpm:max_depth=5,alpha=0,hide_emitters=true,radius=20,light_paths=5184"},
        {{.type = &ca_integrator_ovcm}, "ovcm:max_depth=5,alpha=0,hide_emitters=true,radius=20"},
    };
    ca_scene *scene = bundled_scene("cornell-box/cornell-box");
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++)
        assert_as_noisy(scene, cases[i].name, &cases[i].method);
    ca_scene_release(scene);
    ca_scene *wall = wall_scene(); /* all its noise is what changes within a pixel */
    assert_as_noisy(wall, "path", &cases[0].method);
    ca_scene_release(wall);
}

/* A lamp over the dark: all that there is to see is shown, and is no method's noise. */
static void test_trials_leave_out_what_is_shown(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text("<scene version='3.0.0'>" FROM_ABOVE("24") "<shape type='rectangle'><transform "
                                      "name='to_world'><rotate x='1' angle='-90'/></transform><emitter type='area'/>"
                                      "</shape></scene>");
    const ca_method methods[] = {{.type = &ca_integrator_path}, {.type = &ca_integrator_ovcm}};
    const ca_render_settings settings = auto_settings("auto:radius=0.1", 1);
    const ca_method_radii radii = {0};
    for (int m = 0; m < 2; m++) {
        ca_render_plan plan;
        ca_method_trial trial;
        assert_int_equal(ca_render_plan_make(&plan, scene, &settings, NULL), CA_OK);
        assert_int_equal(ca_method_trial_create(&trial, &plan, &methods[m], &radii, NULL, NULL), CA_OK);
        for (int i = 0; i < 4; i++) assert_int_equal(ca_method_trial_run(&trial, NULL), CA_OK);
        double sum = 0.0, shown = 0.0;
        for (size_t c = 0; c < ca_trial_cell_count(&trial.cells); c++) {
            sum += ca_method_trial_sum(&trial, c);
            shown += ca_method_trial_shown(&trial, c);
        }
        assert_true(shown > 100.0 && fabs(sum) < 1e-5 * shown);
        ca_method_trial_destroy(&trial);
    }
    ca_scene_release(scene);
}

/* A merge in a trial finds as many photons as one in the render: fewer over larger pixels, in a larger radius. */
static void test_trial_merges_alike(void **state)
{
    (void)state;
    ca_scene *scene = bundled_scene("cornell-box/cornell-box");
    ca_render_settings settings = auto_settings("auto:alpha=0,radius=1", 1);
    settings.width = settings.height = RENDER_SIDE;
    ca_render_plan plan;
    ca_method_trial trial;
    const ca_method methods[] = {{.type = &ca_integrator_bdpm}, {.type = &ca_integrator_vcm, .light_paths_log4 = -1}};
    const ca_method_radii radii = {0}; /* not used: one is set */
    ca_error error;
    assert_int_equal(ca_render_plan_make(&plan, scene, &settings, &error), CA_OK);
    for (size_t i = 0; i < 2; i++) {
        const ca_integrator_type *type = methods[i].type;
        assert_int_equal(ca_method_trial_create(&trial, &plan, &methods[i], &radii, NULL, &error), CA_OK);
        assert_true(trial.area > 4.0);
        const double light_paths = ca_integrator_value(type, &trial.plan.input, "light_paths", 0.0);
        assert_true(fabs(light_paths - ca_method_light_paths(&methods[i], &plan) / trial.area) <= 0.5);
        const double radius = ca_integrator_value(type, &trial.plan.input, "radius", 0.0);
        assert_true(fabs(radius * radius / trial.area - 1.0) < 1e-6);
        assert_true(ca_integrator_value(type, &trial.plan.input, "alpha", 1.0) == 0.0);
        ca_method_trial_destroy(&trial);
    }
    ca_scene_release(scene);
}

/* Cells of one pixel have paths of their own. */
static void test_trial_of_a_small_part(void **state)
{
    (void)state;
    ca_scene *scene = bundled_scene("cornell-box/cornell-box");
    ca_render_settings settings = auto_settings("auto:radius=1", 1);
    settings.width = settings.height = 1024;
    settings.has_crop = true;
    const uint32_t crop[4] = {300, 600, 364, 664};
    memcpy(settings.crop, crop, sizeof crop);
    ca_render_plan plan;
    ca_method_trial trial;
    ca_error error;
    const ca_method method = {.type = &ca_integrator_bdpm, .light_paths_log4 = 1};
    assert_int_equal(ca_render_plan_make(&plan, scene, &settings, &error), CA_OK);
    assert_int_equal(ca_method_trial_create(&trial, &plan, &method, NULL, NULL, &error), CA_OK);
    const size_t cells = ca_trial_cell_count(&trial.cells);
    assert_true(ca_render_plan_pixels(&trial.plan) < 0.5 * (double)cells);
    for (int i = 0; i < 2; i++) assert_int_equal(ca_method_trial_run(&trial, &error), CA_OK);
    size_t alike = 0, compared = 0;
    for (size_t i = 1; i < 2 * cells; i++) {
        if (trial.samples[i] == 0.0f) continue;
        compared++;
        for (size_t k = 0; k < i; k++)
            if (trial.samples[k] == trial.samples[i]) {
                alike++;
                break;
            }
    }
    print_message("%zu of %zu samples are equal to another one\n", alike, compared);
    assert_true(compared > cells && alike < compared / 20);
    ca_method_trial_destroy(&trial);
    ca_scene_release(scene);
}

/* Where a pixel has very many camera paths there are fewer cells, which have all of them. */
static void test_many_camera_paths(void **state)
{
    (void)state;
    enum { OF_PIXEL = 1000 };
    ca_scene *scene = bundled_scene("cornell-box/cornell-box");
    ca_render_settings settings = auto_settings("auto:radius=1", OF_PIXEL);
    settings.camera_paths = OF_PIXEL;
    ca_render_plan plan;
    ca_method_trial trial;
    const ca_method method = {.type = &ca_integrator_bdpm};
    assert_int_equal(ca_render_plan_make(&plan, scene, &settings, NULL), CA_OK);
    assert_int_equal(ca_method_trial_create(&trial, &plan, &method, NULL, NULL, NULL), CA_OK);
    const size_t cells = ca_trial_cell_count(&trial.cells);
    assert_true(cells > 400 && cells < 600);
    assert_int_equal(ca_method_trial_run(&trial, NULL), CA_OK);
    assert_true(trial.workers.list[0].counters.camera_paths == cells * OF_PIXEL);
    ca_method_trial_destroy(&trial);
    ca_scene_release(scene);
}

/* A guide that found nothing to aim at is not looked for again. */
static void test_no_guide(void **state)
{
    (void)state;
    ca_scene *scene = wall_scene();
    const ca_render_settings settings = auto_settings("auto:radius=0.1,guide=true", 4);
    ca_render_plan plan;
    ca_method_trial trial;
    const ca_method method = {.type = &ca_integrator_bdpm};
    assert_int_equal(ca_render_plan_make(&plan, scene, &settings, NULL), CA_OK);
    assert_int_equal(ca_method_trial_create(&trial, &plan, &method, NULL, NULL, NULL), CA_OK);
    assert_true(ca_integrator_value(method.type, &trial.plan.input, "guide", 1.0) == 0.0);
    ca_method_trial_destroy(&trial);
    ca_scene_release(scene);
}

/* Processors of all ranks make passes. */
static void test_passes_of_ranks(void **state)
{
    (void)state;
    ca_scene *scene = wall_scene();
    ca_render_settings settings = auto_settings("auto", 0);
    const ca_ranks ranks = {.count = 4};
    ca_render_plan plan;
    settings.seconds = 30.0;
    assert_int_equal(ca_render_plan_make(&plan, scene, &settings, NULL), CA_OK);
    assert_true(ca_method_passes(&plan, 0.5) == 120.0);
    settings.ranks = &ranks;
    assert_true(ca_method_passes(&plan, 0.5) == 480.0);
    ca_scene_release(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_dots_are_the_second_moment),
        cmocka_unit_test(test_configure),
        cmocka_unit_test(test_guide),
        cmocka_unit_test(test_radii),
        cmocka_unit_test(test_trial_is_as_noisy),
        cmocka_unit_test(test_trials_leave_out_what_is_shown),
        cmocka_unit_test(test_trial_merges_alike),
        cmocka_unit_test(test_trial_of_a_small_part),
        cmocka_unit_test(test_many_camera_paths),
        cmocka_unit_test(test_no_guide),
        cmocka_unit_test(test_passes_of_ranks),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
