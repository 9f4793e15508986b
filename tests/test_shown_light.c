/* The pilot of lights that the camera sees as they are: pixels' means and squares against closed forms, for lamps
 * seen at once and by a mirror; and what camera paths of all methods call shown. */
#include "render/shown_light.h"
#include "render/workers.h"
#include "support/scene_text.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

/* A film of SIDE x SIDE pixels, two units wide, from above. */
enum { SIDE = 70, PIXELS_OF_UNIT = SIDE / 2 };
#define RADIANCE 8.0

#define FROM_ABOVE(filter)                                                                                           \
    "<sensor type='orthographic'><transform name='to_world'><lookat origin='0,0,1' target='0,0,0' up='0,1,0'/>"      \
    "</transform><film type='hdrfilm'><integer name='width' value='70'/><integer name='height' value='70'/>"         \
    "<rfilter type='" filter "'/></film></sensor>"
#define PLACE "<transform name='to_world'><scale x='0.11' y='0.07'/>%s<translate x='%g' y='%g' z='%g'/></transform>"
#define LAMP                                                                                                         \
    "<shape type='rectangle'>" PLACE                                                                                 \
    "<emitter type='area'><rgb name='radiance' value='8'/></emitter></shape>"
#define FLOOR(bsdf)                                                                                                  \
    "<shape type='rectangle'><transform name='to_world'><scale value='8'/></transform>" bsdf "</shape>"
#define MIRROR "<bsdf type='conductor'><string name='material' value='none'/></bsdf>"

/* The lamp's centre: its image lies across the corner of squares of 32 pixels. */
#define LAMP_X 0.07
#define LAMP_Y (-0.06)

static ca_scene *scene_of(const char *sensor, const char *floor, const char *turn, double height)
{
    char lamp[512], text[4096];
    snprintf(lamp, sizeof lamp, LAMP, turn, LAMP_X, LAMP_Y, height);
    snprintf(text, sizeof text, "<scene version='3.0.0'>%s%s%s</scene>", sensor, floor, lamp);
    return scene_from_text(text);
}

static const char turned[] = "<rotate y='1' angle='180'/>";

static void make_plan(ca_render_plan *plan, const ca_scene *scene, const ca_render_settings *settings)
{
    ca_error error;
    if (ca_render_plan_make(plan, scene, settings, &error) != CA_OK) fail_msg("%s", error.message);
}

/* The part of the filter around `center` that lies in [low, high]. */
static double part_of(const ca_filter *filter, double center, double low, double high)
{
    enum { STEPS = 4000 };
    double sum = 0.0;
    for (int i = 0; i < STEPS; i++)
        sum += (double)ca_filter_eval(filter, (float)(low + (high - low) * (i + 0.5) / STEPS - center));
    return sum * (high - low) / STEPS;
}

/* How much of the samples of pixel (x, y) meet the lamp. */
static double chance_of(const ca_filter *filter, uint32_t x, uint32_t y)
{
    const double column = PIXELS_OF_UNIT * (1.0 + LAMP_X), row = PIXELS_OF_UNIT * (1.0 - LAMP_Y);
    const double half_width = 0.11 * PIXELS_OF_UNIT, half_height = 0.07 * PIXELS_OF_UNIT;
    return part_of(filter, x + 0.5, column - half_width, column + half_width) *
           part_of(filter, y + 0.5, row - half_height, row + half_height);
}

static double other_light(const void *user, uint32_t x, uint32_t y)
{
    (void)user, (void)y;
    return x < SIDE / 2 ? 0.25 : 0.75;
}

static double expected_variance(const ca_filter *filter, const uint32_t crop[4])
{
    double sum = 0.0;
    for (uint32_t y = crop[1]; y < crop[3]; y++)
        for (uint32_t x = crop[0]; x < crop[2]; x++) {
            const double p = chance_of(filter, x, y), light = p * RADIANCE + other_light(NULL, x, y);
            sum += p * (1.0 - p) * RADIANCE * RADIANCE / (light * light + 0.01);
        }
    return sum / ((double)(crop[2] - crop[0]) * (crop[3] - crop[1])) / 2.0;
}

static const ca_shown_scale two_paths = {.paths_of_pixel = 2.0, .least_square = 0.01, .luminance = other_light};

static void check_pixels(const ca_shown_light *shown, const ca_filter *filter)
{
    for (size_t i = 0; i < shown->count; i++) {
        const ca_shown_pixel *p = &shown->pixels[i];
        const double chance = chance_of(filter, p->x, p->y);
        assert_true(fabs(p->mean / RADIANCE - chance) < 0.25); /* four standard deviations of the box */
        assert_true(fabs(p->square - RADIANCE * p->mean) < 1e-6 * p->square);
    }
}

/* Also of a part of the film: then of its pixels alone, with the light that their filters reach beyond it. */
static void check(const ca_scene *scene, const uint32_t *crop)
{
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    for (int i = 0; i < 4 && crop; i++) settings.crop[i] = crop[i];
    settings.has_crop = crop != NULL;
    ca_render_plan plan;
    make_plan(&plan, scene, &settings);
    ca_shown_light shown;
    ca_error error;
    if (ca_shown_light_find(&shown, &plan, 1e6, &error) != CA_OK) fail_msg("%s", error.message);
    const double expected = expected_variance(&plan.filter, plan.crop);
    const double found = ca_shown_light_variance(&shown, &two_paths);
    print_message("variance %.4g, by the pilot %.4g\n", expected, found);
    assert_true(shown.looked_at == ca_render_plan_pixels(&plan));
    assert_true(fabs(found / expected - 1.0) < 0.15); /* 1 / p of 64 samples is a little too large */
    check_pixels(&shown, &plan.filter);
    ca_shown_light_destroy(&shown);
}

static void test_closed_form(void **state)
{
    (void)state;
    const uint32_t crop[4] = {30, 36, 40, 44};
    const char *const sensors[] = {FROM_ABOVE("box"), FROM_ABOVE("tent"), FROM_ABOVE("gaussian")};
    for (int i = 0; i < 3; i++) {
        ca_scene *scene = scene_of(sensors[i], FLOOR("<bsdf type='diffuse'/>"), "", 0.5);
        check(scene, NULL);
        check(scene, crop);
        ca_scene_release(scene);
    }
}

/* All light that a part of the film gets lies beyond it, within the filter's reach. */
static void test_beyond_the_part(void **state)
{
    (void)state;
    const uint32_t crop[4] = {30, 34, 33, 40};
    ca_scene *scene = scene_of(FROM_ABOVE("gaussian"), FLOOR("<bsdf type='diffuse'/>"), "", 0.5);
    check(scene, crop);
    ca_scene_release(scene);
}

static void test_in_a_mirror(void **state)
{
    (void)state;
    ca_scene *scene = scene_of(FROM_ABOVE("gaussian"), FLOOR(MIRROR), turned, 2.0);
    check(scene, NULL);
    ca_scene_release(scene);
}

/* What the lamp lights is not the lamp. */
static void test_floor(void **state)
{
    (void)state;
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    ca_scene *scene = scene_of(FROM_ABOVE("box"), FLOOR("<bsdf type='diffuse'/>"), turned, 2.0);
    ca_render_plan plan;
    make_plan(&plan, scene, &settings);
    ca_shown_light shown;
    assert_int_equal(ca_shown_light_find(&shown, &plan, 1e5, NULL), CA_OK);
    assert_int_equal(shown.count, 0);
    assert_true(ca_shown_light_variance(&shown, &two_paths) == 0.0);
    ca_shown_light_destroy(&shown);
    ca_scene_release(scene);
}

/* With few paths some squares are looked at, each completely. */
static void test_few_paths(void **state)
{
    (void)state;
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    ca_scene *scene = scene_of(FROM_ABOVE("box"), FLOOR("<bsdf type='diffuse'/>"), "", 0.5);
    ca_render_plan plan;
    make_plan(&plan, scene, &settings);
    ca_shown_light shown;
    assert_int_equal(ca_shown_light_find(&shown, &plan, 4.0 * SIDE * SIDE / 2.0, NULL), CA_OK);
    assert_true(shown.looked_at > 0.0 && shown.looked_at <= 4.0 * 32 * 32);
    ca_shown_light_destroy(&shown);
    ca_scene_release(scene);
}

/* ---- Camera paths of all methods ------------------------------------------------------------------------------- */

/* Sums over a path of each pixel: the picture's light, and what of it is shown. */
static void trace(const ca_render_plan *plan, double *light, double *shown)
{
    void *integrator;
    ca_workers workers;
    ca_error error;
    ca_integrator_input input = plan->input;
    input.tells_shown = true;
    if (plan->type->create(&input, &integrator, &error) != CA_OK) fail_msg("%s", error.message);
    assert_int_equal(ca_workers_create(&workers, 1, &error), CA_OK);
    if (plan->type->begin_round)
        assert_int_equal(plan->type->begin_round(integrator, 0, 0, &workers.parallel, workers.list, &error), CA_OK);
    *light = *shown = 0.0;
    for (uint32_t y = 0; y < SIDE; y++)
        for (uint32_t x = 0; x < SIDE; x++) {
            ca_film_sample sample = {0};
            ca_camera_path path = {.x = x, .y = y, .sample = &sample};
            plan->type->camera_paths(integrator, &path, 1, 0, workers.list);
            *light += (double)ca_luminance(sample.radiance);
            *shown += (double)path.shown;
        }
    ca_workers_destroy(&workers);
    plan->type->destroy(integrator);
}

/* A lamp in a mirror is all shown. A floor that it lights, also by a mirror on the side, is not. */
static void test_methods(void **state)
{
    (void)state;
    static const char *const methods[] = {"path", "path:next_event=false", "bdpt", "ppm", "bdpm", "vcm", "vavcm"};
    static const char floor[] =
        FLOOR("<bsdf type='diffuse'/>") "<shape type='rectangle'><transform name='to_world'><scale value='8'/>"
                                        "<rotate y='1' angle='90'/><translate x='-1.5'/></transform>" MIRROR
                                        "</shape>";
    ca_scene *mirror = scene_of(FROM_ABOVE("box"), FLOOR(MIRROR), turned, 2.0);
    ca_scene *lit = scene_of(FROM_ABOVE("box"), floor, turned, 2.0);
    for (size_t i = 0; i < sizeof methods / sizeof *methods; i++) {
        ca_render_settings settings;
        ca_render_settings_init(&settings);
        settings.integrator = methods[i];
        settings.threads = 1;
        const bool merges = i >= 3;
        if (merges) settings.radius = 0.05;
        ca_render_plan plan;
        double light, shown;
        make_plan(&plan, mirror, &settings);
        trace(&plan, &light, &shown);
        assert_true(light > 30.0 * RADIANCE && fabs(shown / light - 1.0) < 1e-6);
        make_plan(&plan, lit, &settings);
        trace(&plan, &light, &shown);
        assert_true(light > 0.0 && shown == 0.0);
    }
    ca_scene_release(mirror);
    ca_scene_release(lit);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_closed_form), cmocka_unit_test(test_beyond_the_part),
        cmocka_unit_test(test_in_a_mirror), cmocka_unit_test(test_floor),
        cmocka_unit_test(test_few_paths),   cmocka_unit_test(test_methods),
    };
    return cmocka_run_group_tests_name("lights as they are seen", tests, NULL, NULL);
}
