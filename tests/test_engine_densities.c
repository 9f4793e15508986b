/* What the engine hands to the weight function is the truth: for paths that it traced, each record is held against
 * densities that are recomputed in double precision from the path's points alone (support/traced_path.h), and the
 * weight against the one that all techniques' densities give, so that over the techniques of a path weights sum to
 * one. */
#include "integrator/bidirectional.h"
#include "render/render.h"
#include "render/workers.h"
#include "support/agreement_scenes.h"
#include "support/record_check.h"
#include "support/scene_text.h"
#include "support/small_pass.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

/* Of all paths at most so many may agree only within their conditioning. */
#define LOOSE 0.001

enum { LIGHT_PATHS = 250, CAMERA_PATHS = 3, WIDTH = 10, HEIGHT = 8, FREELY = 60 };

static record_tally tally;
static uint64_t paths_seen[CA_TECHNIQUE_COUNT];

/* ---- A pass that is watched ------------------------------------------------------------------------------------ */

typedef struct watch {
    record_check check;
    uint64_t seen[CA_TECHNIQUE_COUNT];
} watch;

/* After the first paths of a technique ever fewer are looked at. */
static void see(void *user, const ca_observed_path *observed)
{
    watch *w = user;
    const uint64_t number = w->seen[observed->technique]++;
    paths_seen[observed->technique]++;
    if (number % (1 + number / FREELY) == 0) check_record(&w->check, observed);
}

static float photon_density(const void *engine, ca_vec3 position)
{
    const ca_bidirectional *b = engine;
    float density = 0.0f;
    if (b->pilot) ca_photon_density_at(b->pilot, &position, 1, &density);
    return b->pilot_scale * density;
}

static void assert_near(double got, double expected) { assert_true(fabs(got - expected) <= 1e-5 * expected); }

/* What the points do not tell. */
static void check_rules(const ca_mis_rules *rules, const ca_render_plan *plan, double radius)
{
    const ca_integrator_input *input = &plan->input;
    assert_int_equal(rules->power, ca_integrator_value(plan->type, input, "heuristic", 0.0) != 0.0);
    assert_near((double)rules->splat_count, (double)LIGHT_PATHS / CAMERA_PATHS / ca_camera_count(input->camera));
    if (rules->merge == CA_MERGE_NONE) return;
    assert_near((double)rules->merge_area, CA_PI_D * radius * radius);
    assert_near((double)rules->reuse.merge_area, CA_PI_D * radius * radius);
    assert_near((double)rules->reuse.light_paths, LIGHT_PATHS);
    assert_near((double)rules->reuse.epsilon, ca_integrator_value(plan->type, input, "epsilon", 0.01));
    assert_near((double)rules->reuse.c, ca_integrator_value(plan->type, input, "c", 0.5));
    assert_int_equal(rules->reuse.projected, ca_integrator_value(plan->type, input, "footprint", 0.0) != 0.0);
}

static void trace_light_paths(watch *w, const ca_render_plan *plan, double radius, void *state, ca_workers *workers)
{
    ca_error error;
    w->check.weight_alone = !plan->type->begin_round;
    if (w->check.weight_alone) return;
    w->check.guide = ((const ca_bidirectional *)state)->guide;
    w->check.density = photon_density;
    w->check.density_user = state;
    assert_int_equal(plan->type->begin_round(state, 0, 0, &workers->parallel, workers->list, &error), CA_OK);
    check_rules(&((const ca_bidirectional *)state)->rules, plan, radius);
}

static void trace_camera_paths(const ca_render_plan *plan, const void *state, ca_worker *worker)
{
    static ca_film_sample samples[WIDTH * HEIGHT * CAMERA_PATHS];
    static ca_camera_path paths[WIDTH * HEIGHT * CAMERA_PATHS];
    uint32_t count = 0;
    memset(samples, 0, sizeof samples);
    for (uint32_t y = 0; y < HEIGHT; y++)
        for (uint32_t x = 0; x < WIDTH; x++)
            for (uint32_t i = 0; i < CAMERA_PATHS; i++, count++)
                paths[count] = (ca_camera_path){.x = x, .y = y, .index = i, .sample = &samples[count]};
    plan->type->camera_paths(state, paths, count, 0, worker);
}

static void trace_pass(watch *w, const ca_render_plan *plan, double radius)
{
    void *state = NULL;
    ca_workers workers;
    ca_error error;
    assert_int_equal(plan->type->create(&plan->input, &state, &error), CA_OK);
    assert_int_equal(ca_workers_create(&workers, 1, &error), CA_OK);
    trace_light_paths(w, plan, radius, state, &workers);
    trace_camera_paths(plan, state, &workers.list[0]);
    plan->type->destroy(state);
    ca_workers_destroy(&workers);
}

/* Every pass has paths of its own. */
static ca_render_settings settings_of_pass(const char *integrator)
{
    static uint64_t seed;
    const small_pass pass = {.integrator = integrator,
                             .sampler = "independent",
                             .width = WIDTH,
                             .height = HEIGHT,
                             .light_paths = LIGHT_PATHS,
                             .camera_paths = CAMERA_PATHS,
                             .max_depth = 8,
                             .seed = seed++};
    return small_pass_settings(&pass);
}

/* The number of failures. */
static uint32_t check_integrator(const ca_scene *scene, const char *name, const char *integrator, bool by_differences)
{
    ca_render_settings settings = settings_of_pass(integrator);
    const double radius = 0.02 * (double)scene->radius;
    ca_render_plan plan;
    small_pass_plan(scene, &settings, radius, &plan);
    watch w = {.check = {.scene_name = name,
                         .integrator = integrator,
                         .scene = scene,
                         .camera = &plan.camera,
                         .by_differences = by_differences,
                         .uniform = ca_integrator_value(plan.type, &plan.input, "paper", 0.0) != 0.0,
                         .tally = &tally}};
    const ca_path_observer observer = {.see = see, .user = &w};
    plan.input.observer = &observer;
    trace_pass(&w, &plan, radius);
    return w.check.failures;
}

/* ---- Scenes ---------------------------------------------------------------------------------------------------- */

/* Beside every integrator of the engine with its defaults. */
static const char *const more_integrators[] = {
    "path",
    "path:heuristic=balance,rr_depth=2",
    "bdpt:heuristic=power,rr_depth=2",
    "bdpt:strategies=no-splat",
    "bdpm:camera_diffuse_depth=3,heuristic=power",
    "bdpm:camera_diffuse_depth=2,merges=last",
    "vcm:heuristic=power,rr_depth=2",
    "ovcm:footprint=projected,heuristic=power,c=1,epsilon=0.1",
    "ovcm:guide=true,rr_depth=2",
};
enum { MORE_INTEGRATORS = sizeof more_integrators / sizeof more_integrators[0] };

static uint32_t check_scene(const ca_scene *scene, const char *name)
{
    uint32_t failures = 0;
    for (size_t i = 0; i < ca_algorithm_count; i++)
        failures += check_integrator(scene, name, ca_algorithms[i]->name, false);
    for (int i = 0; i < MORE_INTEGRATORS; i++) failures += check_integrator(scene, name, more_integrators[i], false);
    return failures;
}

static void test_agreement_scenes(void **state)
{
    (void)state;
    uint32_t failures = 0;
    for (size_t i = 0; i < agreement_scene_count(); i++) {
        ca_scene *scene = agreement_scene_load(agreement_scene_at(i));
        failures += check_scene(scene, agreement_scene_at(i)->name);
        ca_scene_release(scene);
    }
    assert_int_equal(failures, 0);
}

static const char *const bundled[] = {
    "small-light-far/small-light-far",
    "perceptual-study/visible-mixed",
    "perceptual-study/occluded-diffuse",
    "paper-003/two-small-lights",
    "paper-003/large-light",
    "cornell-box/cornell-box",
    "paper-000/few-merges",
    "paper-000/blurred-tiles",
    "paper-000/water-caustic",
    "paper-000/behind-glass",
    "paper-000/cornell-point",
    "furnace/furnace",
    "textured/textured",
    "long-diffuse/long-diffuse",
    "caustics/caustics",
    "mis/mis",
    "rough-glass/rough-glass",
    "depth-of-field/depth-of-field",
    "glass-slab/glass-slab",
    "paper-004/mirror-room",
    "paper-004/interleaved",
    "paper-004/pointwise",
    "paper-004/camera-is-light",
    "speed/cornell-spheres",
    "lens/lens",
};

static void test_bundled_scenes(void **state)
{
    (void)state;
    uint32_t failures = 0;
    for (size_t i = 0; i < sizeof bundled / sizeof bundled[0]; i++) {
        ca_scene *scene = bundled_scene(bundled[i]);
        failures += check_scene(scene, bundled[i]);
        if (strncmp(bundled[i], "paper-003/", 10) == 0)
            failures += check_integrator(scene, bundled[i], "bdpt:paper=true", false);
        ca_scene_release(scene);
    }
    assert_int_equal(failures, 0);
}

/* ---- Rows of Dirac events -------------------------------------------------------------------------------------- */

#define LOOK(origin, target)                                                                                         \
    "<transform name='to_world'><lookat origin='" origin "' target='" target "' up='0,1,0'/></transform>"
#define VIEW                                                                                                         \
    "<scene version='3.0.0'><sensor type='perspective'><float name='fov' value='55'/>" LOOK("0.3,2.2,4", "0,0.5,0")  \
    "</sensor>"
#define FLAT(steps, inside)                                                                                          \
    "<shape type='rectangle'><transform name='to_world'>" steps "</transform>" inside "</shape>"
#define CUBE(steps, inside) "<shape type='cube'><transform name='to_world'>" steps "</transform>" inside "</shape>"
#define BALL(centre, radius, inside)                                                                                 \
    "<shape type='sphere'><point name='center' value='" centre "'/><float name='radius' value='" radius "'/>" inside \
    "</shape>"
#define LEVEL "<rotate x='1' angle='-90'/>"
#define MATT "<bsdf type='twosided'><bsdf type='diffuse'/></bsdf>"
#define MIRROR "<bsdf type='twosided'><bsdf type='conductor'/></bsdf>"
#define GLASS "<bsdf type='dielectric'/>"
#define WATER "<bsdf type='dielectric'><string name='int_ior' value='water'/></bsdf>"
#define GLOW "<emitter type='area'><rgb name='radiance' value='4,5,6'/></emitter>"

/* A floor under water with a ball in it, under a lamp, a ball of light and a mirror: of one refraction both sides
 * differ. */
static const char water_scene[] =
    VIEW FLAT("<scale value='2'/>" LEVEL, MATT) FLAT("<scale value='2'/>" LEVEL "<translate y='0.8'/>", WATER)
        BALL("-0.3,0.3,0.2", "0.3", MATT) BALL("0.6,1.4,-0.4", "0.3", MATT)
            FLAT("<scale value='1.5'/><translate x='-0.4' y='1.4' z='-1.4'/>", MIRROR)
                FLAT("<rotate x='1' angle='90'/><translate y='2.8'/>", MATT GLOW) BALL("-1.2,2,0.5", "0.2", MATT GLOW)
    "</scene>";

/* Glass of all forms in front of mirrors; a cube is a prism where light leaves by another pair of sides. */
static const char glass_scene[] =
    VIEW FLAT("<scale value='2'/>" LEVEL, MATT) FLAT("<scale value='2'/><translate y='1' z='-1.6'/>", MATT)
        BALL("-0.6,0.6,0.6", "0.45", GLASS) BALL("0.9,0.5,-0.7", "0.4", MIRROR)
            CUBE("<scale x='0.4' y='0.3' z='0.4'/><rotate y='1' angle='33'/><translate x='0.4' y='0.6' z='0.8'/>",
                 GLASS) CUBE("<scale x='1.2' y='0.06' z='0.8'/><rotate z='1' angle='8'/><translate y='1.6'/>", GLASS)
                FLAT("<scale value='0.8'/><rotate y='1' angle='70'/><translate x='-1.6' y='0.9'/>", MIRROR)
                    FLAT("<scale value='0.9'/><rotate x='1' angle='90'/><translate y='3'/>", MATT GLOW)
    "<emitter type='point'><point name='position' value='0.8,2.4,1.2'/></emitter></scene>";

/* A lamp that shines to both sides, and balls in instances, seen through a lens. */
static const char lamps_scene[] =
    "<scene version='3.0.0'><sensor type='thinlens'><float name='fov' value='55'/>"
    "<float name='aperture_radius' value='0.1'/><float name='focus_distance' value='4'/>" LOOK("0.3,2.2,4", "0,0.5,0")
    "</sensor><shape type='shapegroup' id='balls'>" BALL("0,0.4,0", "0.4", GLASS) BALL("0.8,0.3,0", "0.3", MIRROR)
    "</shape><shape type='instance'><ref id='balls'/><transform name='to_world'><scale value='1.2'/>"
    "<rotate y='1' angle='40'/><translate x='-0.8' z='0.6'/></transform></shape>"
    "<shape type='instance'><ref id='balls'/><transform name='to_world'><translate x='0.6' z='-0.7'/></transform>"
    "</shape>"
    FLAT("<scale value='2'/>" LEVEL, MATT) FLAT("<scale value='2'/><translate y='1' z='-1.9'/>", MATT)
        FLAT("<scale value='0.5'/><rotate y='1' angle='60'/><translate x='-0.2' y='1.6'/>", MATT GLOW)
            FLAT("<scale value='0.5'/><rotate y='1' angle='240'/><translate x='-0.2' y='1.6'/>", MATT GLOW)
    "</scene>";

/* A pinhole, and a lens or parallel rays, side by side and far apart. */
#define SIDE(type, origin, inside)                                                                                   \
    "<sensor type='" type "'>" inside LOOK(origin, "0,0.5,0") "</sensor>"
#define SIDE_BY_SIDE(other)                                                                                          \
    "<scene version='3.0.0'><sensor type='batch'>"                                                                   \
        SIDE("perspective", "2.5,2.2,3", "<float name='fov' value='50'/>") other \
        "<film type='hdrfilm'><integer name='width' value='10'/><integer name='height' value='8'/></film>" \
    "</sensor>" BALL("-0.6,0.5,0.4", "0.5", GLASS) BALL("0.7,0.4,-0.5", "0.4", MIRROR)                               \
        FLAT("<scale value='2'/>" LEVEL, MATT) FLAT("<scale value='2'/><translate y='1' z='-1.9'/>", MATT) \
            FLAT("<scale value='0.6'/><rotate x='1' angle='90'/><translate y='2.8'/>", MATT GLOW) "</scene>"
static const char lens_beside_scene[] = SIDE_BY_SIDE(
    SIDE("thinlens", "-2.5,2,2.5", "<float name='fov' value='50'/><float name='aperture_radius' value='0.1'/>"
                                   "<float name='focus_distance' value='3.5'/>"));
static const char parallel_beside_scene[] = SIDE_BY_SIDE(SIDE("orthographic", "-2.5,2,2.5", ""));

/* A flat beam that a mirror turns down and glass gathers, a curved one, and a lamp. */
#define COLLIMATED "<emitter type='directionalarea'><rgb name='radiance' value='30,20,25'/></emitter>"
static const char beams_scene[] =
    VIEW FLAT("<scale value='2'/>" LEVEL, MATT) FLAT("<scale value='2'/><translate y='1' z='-1.6'/>", MATT)
        FLAT("<scale x='0.4' y='0.3'/><rotate y='1' angle='90'/><translate x='-1.8' y='1.2' z='0.4'/>", COLLIMATED)
            FLAT("<scale value='0.7'/><rotate y='1' angle='-90'/><rotate z='1' angle='40'/>"
                 "<translate x='0.3' y='1.2' z='0.4'/>", MIRROR) BALL("-0.2,0.6,0.3", "0.3", GLASS)
                BALL("1.1,0.8,-0.6", "0.15", COLLIMATED) BALL("0.9,0.3,0.7", "0.3", MATT)
                    FLAT("<scale value='0.5'/><rotate x='1' angle='90'/><translate y='3'/>", MATT GLOW)
    "</scene>";

static void test_lights(void **state)
{
    (void)state;
    static const char *const texts[] = {lamps_scene, beams_scene, lens_beside_scene, parallel_beside_scene};
    static const char *const names[] = {"lamps", "beams", "lens beside", "parallel beside"};
    for (int s = 0; s < 4; s++) {
        ca_scene *scene = scene_from_text(texts[s]);
        assert_int_equal(check_scene(scene, names[s]), 0);
        ca_scene_release(scene);
    }
}

static void test_rows_of_dirac_events(void **state)
{
    (void)state;
    static const char *const of_chains[] = {"bdpt", "vcm", "bdpm:camera_diffuse_depth=3"};
    static const char *const texts[] = {water_scene, glass_scene}, *const names[] = {"under water", "glass"};
    uint32_t failures = 0;
    for (int s = 0; s < 2; s++) {
        ca_scene *scene = scene_from_text(texts[s]);
        failures += check_scene(scene, names[s]);
        for (int i = 0; i < 3; i++) failures += check_integrator(scene, names[s], of_chains[i], true);
        ca_scene_release(scene);
    }
    assert_int_equal(failures, 0);
}

static void test_what_was_checked(void **state)
{
    (void)state;
    uint64_t checked = 0, loose = 0;
    for (int t = 0; t < CA_TECHNIQUE_COUNT; t++) {
        print_message("%-10s %6llu of %7llu paths checked, %5llu with Dirac events; %3llu off by up to %.2g\n",
                      ca_technique_name((ca_technique)t), (unsigned long long)tally.checked[t],
                      (unsigned long long)paths_seen[t], (unsigned long long)tally.dirac[t],
                      (unsigned long long)tally.loose[t], tally.loosest[t]);
        assert_true(tally.checked[t] > 10000 && tally.dirac[t] > 500);
        checked += tally.checked[t];
        loose += tally.loose[t];
    }
    print_message("%.3f %% of them agree to %g\n", 100.0 - 100.0 * (double)loose / (double)checked, CHECK_TOLERANCE);
    assert_true((double)loose <= LOOSE * (double)checked);
    for (int k = 0; k < CA_LIGHT_KIND_COUNT; k++) assert_true(tally.of_light[k] > 500);
    for (int k = 0; k < CA_CAMERA_KIND_COUNT; k++) assert_true(tally.of_camera[k] > 5000);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_agreement_scenes),
        cmocka_unit_test(test_bundled_scenes),
        cmocka_unit_test(test_lights),
        cmocka_unit_test(test_rows_of_dirac_events),
        cmocka_unit_test(test_what_was_checked),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
