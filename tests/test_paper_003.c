/* The report's own program, `bdpt:paper=true`: it finds all light, its first light vertex is that of the pixel's own
 * light path, its rays go through the pixels' centres, and what it does not do is refused. */
#include "integrator/bidirectional.h"
#include "render/render.h"
#include "render/workers.h"
#include "support/batches.h"
#include "support/scene_text.h"
#include "support/small_pass.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#define SENSOR(more)                                                                                                 \
    "<sensor type='perspective'><float name='fov' value='70'/>" more                                                 \
    "<film type='hdrfilm'><integer name='width' value='16'/><integer name='height' value='16'/></film></sensor>"
#define SCENE(inside) "<scene version='3.0.0'>" inside "</scene>"
#define DEPTH(n) "<integrator type='bdpt'><integer name='max_depth' value='" n "'/></integrator>"
#define GLOW(radiance) "<emitter type='area'><rgb name='radiance' value='" radiance "'/></emitter>"
#define BALL(centre, radius, inside)                                                                                 \
    "<shape type='sphere'><point name='center' value='" centre "'/><float name='radius' value='" radius "'/>" inside \
    "</shape>"

/* Of reflectance 1/2, six wide. */
#define FLOOR                                                                                                        \
    "<shape type='rectangle'><transform name='to_world'><rotate x='1' angle='-90'/><scale value='3'/></transform>"   \
    "<bsdf type='diffuse'/></shape>"

/* ---- All light ------------------------------------------------------------------------------------------------- */

/* Inside of a sphere of reflectance 1/2 that shines with 1/2 every pixel is 1/2 + 1/4 + ..., by all techniques
 * together. */
static void test_furnace(void **state)
{
    (void)state;
    ca_scene *scene =
        scene_from_text(SCENE(DEPTH("6") SENSOR("") "<shape type='sphere'><boolean name='flip_normals' "
                                                    "value='true'/><bsdf type='diffuse'/>" GLOW("0.5") "</shape>"));
    const batch_settings settings = {.integrator = "bdpt:paper=true", .samples = 8, .batches = 8, .seed = 3};
    const measured value = measure_mean(scene, &settings);
    const double expected = 1.0 - 1.0 / 64.0;
    print_message("    furnace %.4f +- %.4f, expected %.4f\n", value.mean, value.error, expected);
    assert_true(value.error < 0.004 && fabs(value.mean - expected) < 4.0 * value.error);
    ca_scene_release(scene);
}

/* A lamp of radius 0.4 two above a floor of reflectance 1/2, seen straight below it: rho L r^2 / d^2. */
static void test_lamp_above_a_floor(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(
        SCENE(DEPTH("2") "<sensor type='perspective'><float name='fov' value='0.01'/><transform name='to_world'>"
                         "<lookat origin='1,0.5,0' target='0,0,0' up='0,1,0'/></transform><film type='hdrfilm'>"
                         "<integer name='width' value='16'/><integer name='height' value='16'/></film></sensor>"
                         FLOOR BALL(
                             "0,2,0", "0.4", "<bsdf type='diffuse'/>" GLOW("5"))));
    const batch_settings settings = {.integrator = "bdpt:paper=true", .samples = 40, .batches = 8, .seed = 5};
    const measured value = measure_mean(scene, &settings);
    const double expected = 0.5 * 5.0 * 0.16 / 4.0;
    print_message("    floor %.5f +- %.5f, expected %.5f\n", value.mean, value.error, expected);
    assert_true(value.error < 0.03 * expected && fabs(value.mean - expected) < 4.0 * value.error);
    ca_scene_release(scene);
}

/* Below a lamp that shines upwards, and that nothing hides, a floor is black. */
static void test_floor_behind_a_lamp(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(
        SCENE(DEPTH("2") SENSOR("<transform name='to_world'><lookat origin='4,1,0' target='0,0,0' up='0,1,0'/>"
                                "</transform>") FLOOR
                         "<shape type='rectangle'><transform name='to_world'><rotate x='1' angle='-90'/>"
                         "<translate y='2'/></transform>" GLOW("5") "</shape>"));
    const batch_settings settings = {.integrator = "bdpt:paper=true", .samples = 4, .batches = 2, .seed = 5};
    assert_true(measure_mean(scene, &settings).mean == 0.0);
    ca_scene_release(scene);
}

/* ---- Rays ------------------------------------------------------------------------------------------------------ */

/* What is seen of a lamp by fixed rays has no intermediate values at its edge. */
static void test_one_ray_a_pixel(void **state)
{
    (void)state;
    static const char *const names[] = {"bdpt", "bdpt:paper=true"};
    ca_scene *scene =
        scene_from_text(SCENE(DEPTH("1") SENSOR("") BALL("0,0,3", "1", "<bsdf type='diffuse'/>" GLOW("2"))));
    for (int i = 0; i < 2; i++) {
        ca_render_settings settings;
        ca_render_settings_init(&settings);
        settings.integrator = names[i];
        settings.samples_per_pixel = 16;
        ca_image_layers *image = render_scene(scene, &settings);
        uint32_t between = 0, lit = 0;
        for (uint32_t p = 0; p < 256; p++) {
            const float value = ca_image_channel(image, "R")[p];
            between += value > 0.0f && value < 1.99f;
            lit += value > 1.99f;
        }
        assert_true(lit > 20);
        assert_int_equal(between == 0, i == 1);
        ca_image_release(image);
    }
    ca_scene_release(scene);
}

/* ---- The first light vertex ------------------------------------------------------------------------------------ */

/* Of one pixel's path: where next event asked and where the connected light path began. */
typedef struct first_vertices {
    ca_vec3 asked[64], began[64];
    uint32_t asked_count, began_count, splats;
} first_vertices;

static void see(void *user, const ca_observed_path *observed)
{
    first_vertices *f = user;
    f->splats += observed->technique == CA_TECHNIQUE_SPLAT;
    const ca_vec3 position = observed->light ? observed->light[0].point.position : (ca_vec3){0};
    if (observed->technique == CA_TECHNIQUE_NEXT_EVENT && f->asked_count < 64) f->asked[f->asked_count++] = position;
    if (observed->technique == CA_TECHNIQUE_CONNECT && f->began_count < 64) f->began[f->began_count++] = position;
}

/* The places of the lamp that pixel `x` of row 8 sees. */
static first_vertices trace_pixel(const ca_scene *scene, const char *integrator, uint32_t x)
{
    const small_pass pass = {.integrator = integrator,
                             .sampler = "independent",
                             .width = 16,
                             .height = 16,
                             .light_paths = 256,
                             .camera_paths = 1,
                             .max_depth = 6,
                             .seed = 1};
    ca_render_settings settings = small_pass_settings(&pass);
    first_vertices f = {.asked_count = 0};
    const ca_path_observer observer = {.see = see, .user = &f};
    ca_render_plan plan;
    ca_workers workers;
    ca_error error;
    void *state = NULL;
    small_pass_plan(scene, &settings, 0.1, &plan);
    plan.input.observer = &observer;
    assert_int_equal(plan.type->create(&plan.input, &state, &error), CA_OK);
    assert_int_equal(ca_workers_create(&workers, 1, &error), CA_OK);
    assert_int_equal(plan.type->begin_round(state, 0, 0, &workers.parallel, workers.list, &error), CA_OK);
    ca_film_sample sample = {0};
    ca_camera_path path = {.x = x, .y = 8, .sample = &sample};
    plan.type->camera_paths(state, &path, 1, 0, &workers.list[0]);
    plan.type->destroy(state);
    ca_workers_destroy(&workers);
    return f;
}

static bool is_same(ca_vec3 a, ca_vec3 b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

static void test_first_vertex(void **state)
{
    (void)state;
    ca_error error;
    ca_scene *scene = NULL;
    if (ca_scene_load(CA_SOURCE_DIR "/scenes/paper-003/large-light.xml", NULL, 0, &scene, &error) != CA_OK)
        fail_msg("%s", error.message);
    uint32_t asked = 0, same = 0;
    for (uint32_t x = 0; x < 16; x++) {
        const first_vertices paper = trace_pixel(scene, "bdpt:paper=true", x);
        for (uint32_t i = 0; i < paper.asked_count; i++) assert_true(is_same(paper.asked[i], paper.asked[0]));
        for (uint32_t i = 0; i < paper.began_count; i++) assert_true(is_same(paper.began[i], paper.began[0]));
        asked += paper.asked_count;
        assert_int_equal(paper.splats, 0);
        same += paper.asked_count > 0 && paper.began_count > 0 && is_same(paper.asked[0], paper.began[0]);
        const first_vertices ours = trace_pixel(scene, "bdpt:strategies=no-splat", x);
        for (uint32_t i = 1; i < ours.asked_count; i++) assert_false(is_same(ours.asked[i], ours.asked[0]));
    }
    print_message("    %u times asked; %u pixels ask where their light path began\n", asked, same);
    assert_true(asked > 16 && same > 4);
    ca_scene_release(scene);
}

/* ---- What is refused ------------------------------------------------------------------------------------------- */

static void expect_refusal(const char *text, const char *expected)
{
    ca_scene *scene = scene_from_text(text);
    ca_render_settings settings;
    ca_image_layers *image = NULL;
    ca_error error;
    ca_render_settings_init(&settings);
    settings.integrator = "bdpt:paper=true";
    settings.samples_per_pixel = 1;
    assert_int_equal(ca_render(scene, &settings, &image, NULL, &error), CA_ERROR_UNSUPPORTED);
    if (!strstr(error.message, expected)) fail_msg("\"%s\" does not say \"%s\"", error.message, expected);
    ca_scene_release(scene);
}

static void test_refusals(void **state)
{
    (void)state;
    expect_refusal(SCENE(SENSOR("") BALL("0,0,3", "1", GLOW("1")) BALL("1,0,3", "1", "<bsdf type='dielectric'/>")),
                   "with \"paper\" all BSDFs must be diffuse");
    expect_refusal(SCENE(SENSOR("") BALL("0,0,3", "1", "<bsdf type='diffuse'/>") "<emitter type='point'/>"),
                   "with \"paper\" all lights must have an area");
    expect_refusal(SCENE("<sensor type='orthographic'/>" BALL("0,0,3", "1", GLOW("1"))),
                   "with \"paper\" the sensor must be perspective");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_furnace),
        cmocka_unit_test(test_lamp_above_a_floor),
        cmocka_unit_test(test_floor_behind_a_lamp),
        cmocka_unit_test(test_one_ray_a_pixel),
        cmocka_unit_test(test_first_vertex),
        cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests_name("paper 003's program", tests, NULL, NULL);
}
