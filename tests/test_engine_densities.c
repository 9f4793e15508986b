/* What the engine hands to the weight function is the truth: for paths that it traced, each record is held against
 * densities that are recomputed in double precision from the path's points alone (support/traced_path.h), and the
 * weight against the one that all techniques' densities give (support/mis_oracle.h), so that over the techniques of
 * a path weights sum to one. */
#include "integrator/bidirectional.h"
#include "render/render.h"
#include "render/workers.h"
#include "support/agreement_scenes.h"
#include "support/mis_oracle.h"
#include "support/scene_text.h"
#include "support/traced_path.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define TOLERANCE 1e-4
/* Of all paths at most so many may be farther off than that, by what rounding may have done to their points. */
#define ILL_CONDITIONED 0.001

enum { LIGHT_PATHS = 250, CAMERA_PATHS = 3, WIDTH = 10, HEIGHT = 8, FREELY = 60 };

/* ---- What is compared ------------------------------------------------------------------------------------------ */

typedef struct tally {
    uint64_t seen, checked, ill;
    uint64_t dirac; /* with a Dirac event, and more than one technique to tell apart */
    double largest;
} tally;

static tally tallies[CA_TECHNIQUE_COUNT];
static uint64_t of_light[CA_LIGHT_ENVMAP + 1], of_camera[CA_CAMERA_ORTHOGRAPHIC + 1]; /* checked, of each kind */

typedef struct check {
    const char *scene_name, *integrator;
    const ca_scene *scene;
    const ca_render_plan *plan;
    const ca_bidirectional *engine; /* NULL: `path` */
    double radius;
    bool by_differences;
    uint64_t seen[CA_TECHNIQUE_COUNT];
    uint32_t failures;
} check;

/* The numbers of a path that are compared: the count * density of every technique as a share of all together, and the
 * weight of the one that found it. */
typedef struct technique_values {
    double splits[CA_FULL_PATH_MAX + 1], merges[CA_FULL_PATH_MAX], weight;
} technique_values;

static void make_shares(uint32_t n, technique_values *v)
{
    double sum = 0.0;
    for (uint32_t k = 0; k <= n; k++) sum += v->splits[k];
    for (uint32_t m = 0; m < n; m++) sum += v->merges[m];
    if (sum == 0.0) return;
    for (uint32_t k = 0; k <= n; k++) v->splits[k] /= sum;
    for (uint32_t m = 0; m < n; m++) v->merges[m] /= sum;
}

static technique_values values_of_engine(const ca_observed_path *observed)
{
    technique_values v;
    ca_mis_densities(observed->rules, observed->path, observed->technique, v.splits, v.merges);
    make_shares(observed->path->camera.count + observed->path->light.count, &v);
    return v;
}

static technique_values values_of_points(const ca_mis_rules *rules, const traced_path *path, ca_technique technique)
{
    technique_values v;
    ca_full_path full;
    traced_path_recompute(path, &full);
    ca_oracle_techniques(rules, &full, v.splits, v.merges);
    const double own = technique == CA_TECHNIQUE_MERGE ? v.merges[path->split - 1] : v.splits[path->split];
    v.weight = own > 0.0 ? ca_oracle_weight(rules, path->n, v.splits, v.merges, own) : 0.0;
    make_shares(path->n, &v);
    return v;
}

static double deviation(double got, double expected)
{
    const double least = 1e-30;
    if (got < least && expected < least) return 0.0;
    if (!(got >= least && expected >= least && got < 1e300 && expected < 1e300)) return INFINITY;
    return fabs(log(got / expected));
}

/* Deviations of all numbers; the largest is the result. */
static double deviations(uint32_t n, const technique_values *got, const technique_values *expected,
                         technique_values *each)
{
    double largest = 0.0;
    for (uint32_t k = 0; k <= n; k++)
        largest = fmax(largest, each->splits[k] = deviation(got->splits[k], expected->splits[k]));
    for (uint32_t m = 0; m < n; m++)
        largest = fmax(largest, each->merges[m] = deviation(got->merges[m], expected->merges[m]));
    each->weight = fabs(got->weight - expected->weight);
    return fmax(largest, each->weight);
}

/* ---- Conditioning ---------------------------------------------------------------------------------------------- */

static void displace(traced_path *path, uint32_t i, int axis, double by)
{
    path->facing_camera[i] = dv_madd(path->facing_camera[i], by, dv_axis(axis));
    path->facing_light[i] = dv_madd(path->facing_light[i], by, dv_axis(axis));
}

static void add_values(uint32_t n, const technique_values *more, technique_values *sum)
{
    for (uint32_t k = 0; k <= n; k++) sum->splits[k] += more->splits[k];
    for (uint32_t m = 0; m < n; m++) sum->merges[m] += more->merges[m];
    sum->weight += more->weight;
}

/* How far each number moves, to first order, when every point is displaced along every axis by what the engine's
 * rounding may have displaced it. */
static technique_values conditioning(const ca_mis_rules *rules, const traced_path *path, ca_technique technique)
{
    const technique_values centre = values_of_points(rules, path, technique);
    technique_values sum = {{0.0}, {0.0}, 0.0};
    for (uint32_t i = 0; i < path->n; i++)
        for (int axis = 0; axis < 3; axis++) {
            traced_path moved = *path;
            technique_values each;
            displace(&moved, i, axis, traced_path_uncertainty(path, i));
            const technique_values there = values_of_points(rules, &moved, technique);
            deviations(path->n, &there, &centre, &each);
            add_values(path->n, &each, &sum);
        }
    return sum;
}

/* Twice: the normals that directions are measured against are rounded as well. */
static bool within(uint32_t n, const technique_values *each, const technique_values *bound)
{
    for (uint32_t k = 0; k <= n; k++)
        if (!(each->splits[k] <= TOLERANCE + 2.0 * bound->splits[k])) return false;
    for (uint32_t m = 0; m < n; m++)
        if (!(each->merges[m] <= TOLERANCE + 2.0 * bound->merges[m])) return false;
    return each->weight <= TOLERANCE + 2.0 * bound->weight;
}

/* ---- One path -------------------------------------------------------------------------------------------------- */

static void complain(check *c, const ca_observed_path *observed, const traced_path *path, const char *what)
{
    if (c->failures++ > 3) return;
    print_error("%s, %s, %s with s = %u, n = %u: %s\n", c->scene_name, c->integrator,
                ca_technique_name(observed->technique), path->split, path->n, what);
}

static void show_values(uint32_t n, const technique_values *got, const technique_values *expected,
                        const technique_values *bound)
{
    for (uint32_t k = 0; k <= n; k++)
        if (deviation(got->splits[k], expected->splits[k]) > TOLERANCE)
            print_error("    split %u: %.9g, from the points %.9g +- %.2g\n", k, got->splits[k], expected->splits[k],
                        expected->splits[k] * bound->splits[k]);
    for (uint32_t m = 0; m < n; m++)
        if (deviation(got->merges[m], expected->merges[m]) > TOLERANCE)
            print_error("    merge %u: %.9g, from the points %.9g +- %.2g\n", m, got->merges[m], expected->merges[m],
                        expected->merges[m] * bound->merges[m]);
    print_error("    weight %.9g, from the points %.9g +- %.2g\n", got->weight, expected->weight, bound->weight);
}

/* Kinds of events as the record has them; `path` weighs none but smooth ones. */
static bool kinds_agree(const ca_observed_path *observed, const traced_path *path)
{
    const ca_mis_path *record = observed->path;
    const uint32_t s = record->camera.count, t = record->light.count, n = s + t;
    if (!record->camera.vertices) return !path->dirac[1];
    const uint32_t known = observed->technique == CA_TECHNIQUE_MERGE ? t : t > 0 ? t - 1 : 0;
    for (uint32_t i = 1; i + 1 < s; i++)
        if (record->camera.vertices[i].connectable == path->dirac[i]) return false;
    for (uint32_t i = 1; i < known; i++)
        if (record->light.vertices[i].connectable == path->dirac[n - 1 - i]) return false;
    return true;
}

static bool tells_of_dirac(const traced_path *path, const technique_values *v)
{
    bool dirac = false;
    uint32_t techniques = 0;
    for (uint32_t i = 1; i + 1 < path->n; i++) dirac = dirac || path->dirac[i];
    for (uint32_t k = 0; k <= path->n; k++) techniques += v->splits[k] > 0.0;
    for (uint32_t m = 0; m < path->n; m++) techniques += v->merges[m] > 0.0;
    return dirac && techniques > 1;
}

static void compare(check *c, const ca_observed_path *observed, const traced_path *path)
{
    tally *t = &tallies[observed->technique];
    const technique_values expected = values_of_points(observed->rules, path, observed->technique);
    technique_values got = expected, each;
    if (c->engine) got = values_of_engine(observed);
    got.weight = (double)observed->weight;
    const double largest = deviations(path->n, &got, &expected, &each);
    t->checked++;
    t->dirac += tells_of_dirac(path, &expected);
    of_light[path->light->kind]++;
    of_camera[path->camera->kind]++;
    if (largest <= TOLERANCE) return;
    t->ill++;
    t->largest = fmax(t->largest, largest);
    const technique_values bound = conditioning(observed->rules, path, observed->technique);
    if (within(path->n, &each, &bound)) return;
    complain(c, observed, path, "the record disagrees with the points");
    if (c->failures <= 4) show_values(path->n, &got, &expected, &bound);
}

static float photon_density(const void *engine, ca_vec3 position)
{
    return ca_bidirectional_density(engine, position);
}

/* After the first paths of a technique ever fewer are looked at. */
static bool is_wanted(check *c, ca_technique technique)
{
    const uint64_t number = c->seen[technique]++;
    tallies[technique].seen++;
    return number % (1 + number / FREELY) == 0;
}

static void see(void *user, const ca_observed_path *observed)
{
    check *c = user;
    if (!is_wanted(c, observed->technique)) return;
    traced_path path;
    const char *complaint = NULL;
    assert_true(traced_path_read(observed, c->scene, c->plan->input.camera, c->engine ? photon_density : NULL, c->engine,
                                 &path));
    path.by_differences = c->by_differences;
    if (!traced_path_find_events(&path, observed->technique, &complaint))
        complain(c, observed, &path, complaint);
    else if (!kinds_agree(observed, &path))
        complain(c, observed, &path, "an event is of another kind");
    else
        compare(c, observed, &path);
}

/* ---- Renders --------------------------------------------------------------------------------------------------- */

static const char *const integrators[] = {
    "path",
    "path:heuristic=balance,rr_depth=2",
    "light",
    "bdpt",
    "bdpt:heuristic=power,rr_depth=2",
    "bdpt:strategies=no-splat",
    "ppm",
    "bdpm",
    "bdpm:camera_diffuse_depth=3,heuristic=power",
    "bdpm:camera_diffuse_depth=2,merges=last",
    "vcm",
    "vcm:heuristic=power,rr_depth=2",
    "vcm-plus",
    "vcm-star",
    "ovcm",
    "ovcm:footprint=projected,heuristic=power,c=1,epsilon=0.1",
    "cavcm",
};
enum { INTEGRATORS = sizeof integrators / sizeof integrators[0] };

/* The counts, which the points do not tell. */
static void check_counts(const check *c)
{
    const ca_mis_rules *rules = &c->engine->rules;
    const double area = rules->merge == CA_MERGE_NONE ? (double)rules->merge_area : CA_PI_D * c->radius * c->radius;
    assert_true(deviation((double)rules->splat_count, (double)LIGHT_PATHS / CAMERA_PATHS) < 1e-6);
    assert_true(deviation((double)rules->reuse.light_paths, LIGHT_PATHS) < 1e-6);
    assert_true(deviation((double)rules->merge_area, area) < 1e-5);
    assert_true(deviation((double)rules->reuse.merge_area, area) < 1e-5);
}

static void prepare_pass(check *c, const ca_render_plan *plan, void *state, ca_workers *workers)
{
    ca_error error;
    if (!plan->type->begin_round) return;
    c->engine = state;
    assert_int_equal(plan->type->begin_round(state, 0, 0, &workers->parallel, workers->list, &error), CA_OK);
    check_counts(c);
}

static void trace_pass(check *c, const ca_render_plan *plan)
{
    void *state = NULL;
    ca_workers workers;
    ca_error error;
    assert_int_equal(plan->type->create(&plan->input, &state, &error), CA_OK);
    assert_int_equal(ca_workers_create(&workers, 1, &error), CA_OK);
    prepare_pass(c, plan, state, &workers);
    for (uint32_t y = 0; y < HEIGHT; y++)
        for (uint32_t x = 0; x < WIDTH; x++)
            for (uint32_t i = 0; i < CAMERA_PATHS; i++) {
                ca_film_sample sample = {0};
                plan->type->camera_path(state, x, y, i, 0, &sample, &workers.list[0]);
            }
    plan->type->destroy(state);
    ca_workers_destroy(&workers);
}

static uint32_t check_integrator(const ca_scene *scene, const char *name, const char *integrator, bool by_differences)
{
    check c = {.scene_name = name,
               .integrator = integrator,
               .scene = scene,
               .radius = 0.02 * (double)scene->radius,
               .by_differences = by_differences};
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.integrator = integrator;
    if (strncmp(integrator, "path", 4) != 0) settings.light_paths = LIGHT_PATHS, settings.camera_paths = CAMERA_PATHS;
    settings.samples_per_pixel = CAMERA_PATHS;
    settings.width = WIDTH;
    settings.height = HEIGHT;
    settings.max_depth = 8;
    settings.has_max_depth = true;
    settings.sampler = "independent";
    settings.threads = 1;
    ca_render_plan plan;
    ca_error error;
    if (ca_render_plan_make(&plan, scene, &settings, &error) != CA_OK) fail_msg("%s: %s", name, error.message);
    if (ca_integrator_value(plan.type, &plan.input, "radius", -1.0) >= 0.0) {
        const ca_parameter radius = {.name = "radius", .kind = CA_PARAMETER_NUMBER, .number = c.radius};
        assert_int_equal(ca_integrator_set(plan.type, &radius, &plan.input, &error), CA_OK);
    }
    const ca_path_observer observer = {see, &c};
    plan.input.observer = &observer;
    c.plan = &plan;
    trace_pass(&c, &plan);
    return c.failures;
}

static uint32_t check_scene(const ca_scene *scene, const char *name)
{
    uint32_t failures = 0;
    for (int i = 0; i < INTEGRATORS; i++) failures += check_integrator(scene, name, integrators[i], false);
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
    "small-light-far/small-light-far", "perceptual-study/visible-mixed", "perceptual-study/occluded-diffuse",
    "paper-003/two-small-lights",      "paper-003/large-light",          "cornell-box/cornell-box",
    "paper-000/few-merges",            "paper-000/blurred-tiles",        "paper-000/water-caustic",
    "paper-000/behind-glass",          "paper-000/cornell-point",        "furnace/furnace",
    "textured/textured",               "long-diffuse/long-diffuse",      "caustics/caustics",
    "mis/mis",                         "rough-glass/rough-glass",        "depth-of-field/depth-of-field",
    "glass-slab/glass-slab",           "paper-004/mirror-room",          "paper-004/interleaved",
    "paper-004/pointwise",             "paper-004/camera-is-light",      "speed/cornell-spheres",
};

static void test_bundled_scenes(void **state)
{
    (void)state;
    uint32_t failures = 0;
    for (size_t i = 0; i < sizeof bundled / sizeof bundled[0]; i++) {
        char path[512];
        ca_scene *scene;
        ca_error error;
        snprintf(path, sizeof path, "%s/scenes/%s.xml", CA_SOURCE_DIR, bundled[i]);
        if (ca_scene_load(path, NULL, 0, &scene, &error) != CA_OK) fail_msg("%s", error.message);
        failures += check_scene(scene, bundled[i]);
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
    "<shape type='instance'><ref id='balls'/><transform name='to_world'><translate x='0.6' z='-0.7'/></transform></shape>"
    FLAT("<scale value='2'/>" LEVEL, MATT) FLAT("<scale value='2'/><translate y='1' z='-1.9'/>", MATT)
        FLAT("<scale value='0.5'/><rotate y='1' angle='60'/><translate x='-0.2' y='1.6'/>", MATT GLOW)
            FLAT("<scale value='0.5'/><rotate y='1' angle='240'/><translate x='-0.2' y='1.6'/>", MATT GLOW)
    "</scene>";

static void test_lamps(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(lamps_scene);
    assert_int_equal(check_scene(scene, "lamps"), 0);
    ca_scene_release(scene);
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

static void test_nearly_all_are_well_conditioned(void **state)
{
    (void)state;
    uint64_t checked = 0, ill = 0;
    for (int t = 0; t < CA_TECHNIQUE_COUNT; t++) {
        print_message("%-10s %7llu of %8llu paths checked, %6llu with Dirac events, %4llu (%.3f %%) off by up to %.2g\n",
                      ca_technique_name((ca_technique)t), (unsigned long long)tallies[t].checked,
                      (unsigned long long)tallies[t].seen, (unsigned long long)tallies[t].dirac,
                      (unsigned long long)tallies[t].ill,
                      100.0 * (double)tallies[t].ill / (double)tallies[t].checked, tallies[t].largest);
        assert_true(tallies[t].checked > 10000 && tallies[t].dirac > 500);
        checked += tallies[t].checked;
        ill += tallies[t].ill;
    }
    assert_true((double)ill <= ILL_CONDITIONED * (double)checked);
    for (int k = 0; k <= CA_LIGHT_ENVMAP; k++) assert_true(of_light[k] > 500);
    for (int k = 0; k <= CA_CAMERA_ORTHOGRAPHIC; k++) assert_true(of_camera[k] > 5000);
}

int main(int argc, char **argv)
{
    if (argc > 1) cmocka_set_test_filter(argv[1]);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_agreement_scenes),
        cmocka_unit_test(test_bundled_scenes),
        cmocka_unit_test(test_lamps),
        cmocka_unit_test(test_rows_of_dirac_events),
        cmocka_unit_test(test_nearly_all_are_well_conditioned),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
