/* What a camera path finds depends on its own address alone: not on the paths that are asked for with it, and not on
 * whether its points are treated one by one or, where they are regular (scene/matte.h), eight at a time. */
#include "base/memory.h"
#include "render/render.h"
#include "render/workers.h"
#include "support/scene_text.h"
#include "support/small_pass.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

enum { WIDTH = 24, HEIGHT = 20, CAMERA_PATHS = 3, PATHS = WIDTH * HEIGHT * CAMERA_PATHS, LIGHT_PATHS = 400 };

/* ---- Scenes ---------------------------------------------------------------------------------------------------- */

#define VIEW                                                                                                         \
    "<scene version='3.0.0'><sensor type='perspective'><float name='fov' value='60'/><transform name='to_world'>"    \
    "<lookat origin='0.2,1.6,3.6' target='0,0.8,0' up='0,1,0'/></transform></sensor>"
#define FLAT(steps, inside)                                                                                          \
    "<shape type='rectangle'><transform name='to_world'>" steps "</transform>" inside "</shape>"
#define CUBE(steps, inside) "<shape type='cube'><transform name='to_world'>" steps "</transform>" inside "</shape>"
#define BALL(centre, radius, inside)                                                                                 \
    "<shape type='sphere'><point name='center' value='" centre "'/><float name='radius' value='" radius "'/>" inside \
    "</shape>"
#define DIFFUSE(color) "<bsdf type='diffuse'><rgb name='reflectance' value='" color "'/></bsdf>"
#define TWOSIDED(inside) "<bsdf type='twosided'>" inside "</bsdf>"
#define CHECKS TWOSIDED("<bsdf type='diffuse'><texture type='checkerboard' name='reflectance'/></bsdf>")
#define GLOSSY "<bsdf type='twosided'><bsdf type='roughconductor'><float name='alpha' value='0.2'/></bsdf></bsdf>"
#define GLOW(radiance) "<emitter type='area'><rgb name='radiance' value='" radiance "'/></emitter>"
#define LEVEL "<rotate x='1' angle='-90'/>"

/* All sides of matte materials: one-sided ones seen from the front and from behind, the same and another on the back;
 * a plate so small that rays to it are long; a textured neighbour; lights that look large and small, one
 * that is no rectangle. */
#define SIDES                                                                                                        \
    FLAT("<scale value='2'/>" LEVEL, DIFFUSE("0.7,0.6,0.5"))                                                         \
    FLAT("<scale value='2'/><translate y='2' z='-2'/>", TWOSIDED(DIFFUSE("0.3,0.6,0.8")))                            \
    FLAT("<scale value='2'/><rotate y='1' angle='90'/><translate x='-2' y='2'/>", CHECKS)                            \
    FLAT("<scale value='2'/><rotate y='1' angle='90'/><translate x='2' y='2'/>", DIFFUSE("0.8,0.4,0.3"))             \
    FLAT("<scale value='0.6'/><rotate y='1' angle='35'/><translate x='-0.8' y='0.9' z='0.3'/>",                      \
         TWOSIDED(DIFFUSE("0.9,0.2,0.1") DIFFUSE("0.1,0.8,0.2")))                                                    \
    FLAT("<scale value='0.5'/><rotate y='1' angle='200'/><translate x='0.7' y='0.8' z='0.4'/>",                      \
         TWOSIDED(DIFFUSE("0.9,0.9,0.1") DIFFUSE("0.1,0.2,0.9")))                                                    \
    FLAT("<scale value='0.3'/><rotate y='1' angle='20'/><translate y='0.1' z='0.1'/>", TWOSIDED(DIFFUSE("0.5")))     \
    CUBE("<scale value='0.25'/><rotate y='1' angle='30'/><translate x='0.4' y='0.25' z='0.9'/>",                     \
         DIFFUSE("0.2,0.7,0.7"))                                                                                     \
    FLAT("<scale value='0.7'/><rotate x='1' angle='90'/><translate y='2.9'/>", DIFFUSE("0.4") GLOW("3,4,5"))         \
    FLAT("<scale value='0.05'/><rotate x='1' angle='70'/><translate x='1.1' y='2.2'/>",                              \
         TWOSIDED(DIFFUSE("0.4")) GLOW("90,60,50"))                                                                  \
    FLAT("<matrix value='0.3 0.2 0 -1.2  0 0 -0.3 2.4  0 0.3 0 0.5  0 0 0 1'/>", GLOW("9,2,7"))

static const char matte_scene[] = VIEW SIDES "</scene>";
static const char mixed_scene[] =
    VIEW SIDES BALL("-0.3,0.4,1", "0.35", "<bsdf type='dielectric'/>") BALL("1.2,0.4,-0.6", "0.4", GLOSSY)
        BALL("-1.2,0.4,-0.8", "0.4", DIFFUSE("0.6")) BALL("-1.4,2.4,0", "0.15", GLOW("8,8,4"))
            FLAT("<scale value='0.8'/><translate x='1' y='1' z='-1.9'/>", GLOSSY)
    "<emitter type='point'><point name='position' value='0.8,2.4,1.2'/></emitter><emitter type='constant'>"
    "<rgb name='radiance' value='0.1,0.2,0.3'/></emitter></scene>";
static const char *const scenes[] = {matte_scene, mixed_scene}, *const scene_names[] = {"matte", "mixed"};

/* Mitsuba's squares and cubes have vertex normals, and such a mesh is not regular: here they have none. */
static ca_scene *load(const char *text)
{
    ca_scene *scene = scene_from_text(text);
    const ca_texture *textures = scene->desc.textures.items;
    for (size_t i = 0; i < scene->desc.meshes.count; i++) ca_mesh_drop_normals(&scene->desc.meshes.items[i]);
    ca_free(scene->mattes), ca_free(scene->even_lights);
    scene->mattes = ca_matte_shapes_create(scene->shapes, scene->shape_count, scene->shape_count, scene->materials,
                                           textures);
    scene->even_lights = ca_even_lights_create(scene->lights, scene->light_count, textures);
    assert_true(scene->mattes && scene->even_lights);
    return scene;
}

/* ---- Traced paths ---------------------------------------------------------------------------------------------- */

typedef struct traced {
    ca_film_sample samples[PATHS];
    ca_camera_path paths[PATHS];
    uint64_t rays, shadow_rays;
} traced;

/* The camera paths of a pass, handed in by so many; the last group is what is left. */
static void trace_groups(const ca_render_plan *plan, const void *state, ca_worker *worker, uint32_t group, traced *to)
{
    const ca_counters before = worker->counters;
    memset(to, 0, sizeof *to);
    for (uint32_t i = 0; i < PATHS; i++) {
        const uint32_t pixel = i / CAMERA_PATHS;
        to->paths[i] = (ca_camera_path){
            .x = pixel % WIDTH, .y = pixel / WIDTH, .index = i % CAMERA_PATHS, .sample = &to->samples[i]};
    }
    for (uint32_t first = 0; first < PATHS; first += group)
        plan->type->camera_paths(state, to->paths + first, ca_min_u32(group, PATHS - first), 0, worker);
    to->rays = worker->counters.rays - before.rays;
    to->shadow_rays = worker->counters.shadow_rays - before.shadow_rays;
}

static void assert_same(const traced *got, const traced *expected, const char *what, const char *scene,
                        const char *integrator)
{
    for (uint32_t i = 0; i < PATHS; i++) {
        const ca_camera_path *a = &got->paths[i], *b = &expected->paths[i];
        /* NOLINTNEXTLINE(bugprone-suspicious-memory-comparison): all bits count */
        if (memcmp(a->sample, b->sample, sizeof *a->sample) != 0)
            fail_msg("%s, %s, %s: path %u has %.9g %.9g %.9g, should have %.9g %.9g %.9g", scene, integrator, what, i,
                     (double)a->sample->radiance.r, (double)a->sample->radiance.g, (double)a->sample->radiance.b,
                     (double)b->sample->radiance.r, (double)b->sample->radiance.g, (double)b->sample->radiance.b);
        if (a->segments != b->segments || a->merges != b->merges)
            fail_msg("%s, %s, %s: path %u has %u segments and %u merges, should have %u and %u", scene, integrator,
                     what, i, a->segments, a->merges, b->segments, b->merges);
    }
    assert_int_equal(got->rays, expected->rays);
    assert_int_equal(got->shadow_rays, expected->shadow_rays);
}

/* There is something to compare: most paths met a surface, many carry light or are lit by merges. */
static void assert_worth_while(const traced *t, const char *integrator)
{
    uint32_t met = 0, lit = 0;
    uint64_t segments = 0, merges = 0;
    for (uint32_t i = 0; i < PATHS; i++) {
        met += ca_length2(t->samples[i].normal) > 0.0f;
        lit += t->samples[i].radiance.g > 0.0f;
        segments += t->paths[i].segments;
        merges += t->paths[i].merges;
    }
    assert_true(met > PATHS / 2);
    assert_true(segments >= PATHS);
    const bool merging = strcmp(integrator, "vcm") == 0 || strcmp(integrator, "ppm") == 0;
    assert_int_equal(merging, merges > 0);
    if (strcmp(integrator, "light") != 0) assert_true(lit > PATHS / 16);
}

typedef struct pass {
    ca_render_settings settings;
    ca_render_plan plan;
    ca_workers workers;
    void *state;
} pass;

static void pass_begin(pass *p, const ca_scene *scene, const char *integrator, const char *sampler)
{
    const small_pass small = {.integrator = integrator,
                              .sampler = sampler,
                              .width = WIDTH,
                              .height = HEIGHT,
                              .light_paths = LIGHT_PATHS,
                              .camera_paths = CAMERA_PATHS,
                              .max_depth = 7,
                              .seed = 11};
    ca_error error;
    p->settings = small_pass_settings(&small);
    small_pass_plan(scene, &p->settings, 0.1, &p->plan);
    const ca_integrator_type *type = p->plan.type;
    if (type->create(&p->plan.input, &p->state, &error) != CA_OK) fail_msg("%s", error.message);
    assert_int_equal(ca_workers_create(&p->workers, 1, &error), CA_OK);
    if (type->begin_round)
        assert_int_equal(type->begin_round(p->state, 0, 0, &p->workers.parallel, p->workers.list, &error), CA_OK);
}

static void pass_end(pass *p)
{
    p->plan.type->destroy(p->state);
    ca_workers_destroy(&p->workers);
}

static void trace_once(const ca_scene *scene, const char *integrator, const char *sampler, traced *to)
{
    pass p;
    pass_begin(&p, scene, integrator, sampler);
    trace_groups(&p.plan, p.state, &p.workers.list[0], PATHS, to);
    pass_end(&p);
}

/* ---- Tests ----------------------------------------------------------------------------------------------------- */

static traced first, second;

static void check_groups(const ca_scene *scene, const char *name, const char *integrator, const char *sampler)
{
    static const uint32_t groups[] = {7, 64, 512, PATHS};
    pass p;
    pass_begin(&p, scene, integrator, sampler);
    trace_groups(&p.plan, p.state, &p.workers.list[0], 1, &first);
    assert_worth_while(&first, integrator);
    for (size_t i = 0; i < sizeof groups / sizeof groups[0]; i++) {
        char what[32];
        snprintf(what, sizeof what, "groups of %u", groups[i]);
        trace_groups(&p.plan, p.state, &p.workers.list[0], groups[i], &second);
        assert_same(&second, &first, what, name, integrator);
    }
    pass_end(&p);
}

static void test_groups_change_nothing(void **state)
{
    (void)state;
    static const char *const integrators[] = {"path", "path:rr_depth=2", "bdpt", "vcm", "ppm", "light"};
    for (size_t s = 0; s < sizeof scenes / sizeof scenes[0]; s++) {
        ca_scene *scene = load(scenes[s]);
        for (size_t i = 0; i < sizeof integrators / sizeof integrators[0]; i++)
            check_groups(scene, scene_names[s], integrators[i], "independent");
        check_groups(scene, scene_names[s], "path", "sobol");
        check_groups(scene, scene_names[s], "path", "zsobol");
        ca_scene_release(scene);
    }
}

/* The same scene with all points and lights treated one by one. */
static void make_scalar(ca_scene *scene)
{
    for (uint32_t i = 0; i < scene->shape_count; i++)
        scene->mattes[i].is_matte = scene->mattes[i].is_patterned = false;
    for (uint32_t i = 0; i < scene->light_count; i++) scene->even_lights[i].is_even = false;
}

static void count_regular(const ca_scene *scene, uint32_t *mattes, uint32_t *patterned, uint32_t *evens)
{
    *mattes = *patterned = *evens = 0;
    for (uint32_t i = 0; i < scene->shape_count; i++) {
        *mattes += scene->mattes[i].is_matte;
        *patterned += scene->mattes[i].is_patterned;
    }
    for (uint32_t i = 0; i < scene->light_count; i++) *evens += scene->even_lights[i].is_even;
}

static void test_matte_points_are_as_any_other(void **state)
{
    (void)state;
    static const char *const integrators[] = {"path", "path:rr_depth=2", "path:heuristic=balance", "bdpt",
                                              "vcm",  "ovcm",            "ppm",                    "light"};
    for (size_t s = 0; s < sizeof scenes / sizeof scenes[0]; s++)
        for (size_t i = 0; i < sizeof integrators / sizeof integrators[0]; i++) {
            ca_scene *scene = load(scenes[s]);
            uint32_t mattes, patterned, evens;
            count_regular(scene, &mattes, &patterned, &evens);
            assert_int_equal(mattes, 10);
            assert_int_equal(patterned, 1);
            assert_int_equal(evens, 3);
            trace_once(scene, integrators[i], "independent", &first);
            make_scalar(scene);
            trace_once(scene, integrators[i], "independent", &second);
            assert_same(&first, &second, "eight at a time", scene_names[s], integrators[i]);
            ca_scene_release(scene);
        }
}

/* Even lights at points that are not matte, and matte points under lights that are not even. */
static void test_points_and_lights_apart(void **state)
{
    (void)state;
    static const char *const integrators[] = {"path", "bdpt", "vcm"};
    for (size_t k = 0; k < sizeof integrators / sizeof integrators[0]; k++) {
        ca_scene *scene = load(mixed_scene);
        trace_once(scene, integrators[k], "independent", &first);
        for (uint32_t i = 0; i < scene->light_count; i += 2) scene->even_lights[i].is_even = false;
        for (uint32_t i = 0; i < scene->shape_count; i += 2) scene->mattes[i].is_matte = false;
        trace_once(scene, integrators[k], "independent", &second);
        assert_same(&second, &first, "every other one by one", "mixed", integrators[k]);
        ca_scene_release(scene);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_groups_change_nothing),
        cmocka_unit_test(test_matte_points_are_as_any_other),
        cmocka_unit_test(test_points_and_lights_apart),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
