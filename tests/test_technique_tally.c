/* Factors of variance-aware weights: what a tally makes of numbers whose moments are known, that every path that the
 * engine weights reads the factors of its own place on the film, and what the engine knows of crowded places. */
#include "integrator/bidirectional.h"
#include "render/render.h"
#include "render/workers.h"
#include "support/scene_text.h"
#include "support/test_random.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

/* ---- Known moments --------------------------------------------------------------------------------------------- */

enum { WIDTH = 200, HEIGHT = 120, ITERATIONS = 8 };

static ca_test_random numbers;

static uint32_t poisson(double mean)
{
    uint32_t count = 0;
    for (double product = (double)ca_test_random_float(&numbers); product > exp(-mean); count++)
        product *= (double)ca_test_random_float(&numbers);
    return count;
}

static void add_weighted(ca_technique_tally *tally, uint32_t cell, ca_technique technique, uint32_t s, uint32_t t,
                         uint32_t light, float crowd, float value, float weight)
{
    uint32_t x, y;
    ca_technique_tally_pixel(tally, cell, &x, &y);
    ca_technique_tally_add(tally, x, y, technique, s, t, light, crowd, (ca_rgb){value, value, value}, weight);
}

static void add_of(ca_technique_tally *tally, uint32_t cell, ca_technique technique, uint32_t s, uint32_t t,
                   uint32_t light, float crowd, float value)
{
    add_weighted(tally, cell, technique, s, t, light, crowd, value, 1.0f);
}

static void add(ca_technique_tally *tally, uint32_t cell, ca_technique technique, uint32_t s, uint32_t t, float value)
{
    add_of(tally, cell, technique, s, t, 3, 1.0f, value);
}

/* Many that come together: by their weights no class is much noisier than another, whose covariances it would
 * hide. */
static void add_photons(ca_technique_tally *tally, uint32_t cell, uint32_t count, uint32_t s, uint32_t t, float crowd,
                        float weight)
{
    for (uint32_t i = count; i > 0; i--)
        add_weighted(tally, cell, CA_TECHNIQUE_MERGE, s, t, 3, crowd, 1.0f, weight);
}

/* One sample, always the same, and one of 1 or 3; independent photons, photons that come three at a time, and those
 * of a crowded place that half of the camera paths find. */
static void add_known(ca_technique_tally *tally, uint32_t cell)
{
    add(tally, cell, CA_TECHNIQUE_NEXT_EVENT, 2, 1, 0.7f);
    add(tally, cell, CA_TECHNIQUE_HIT, 3, 0, 1.5f);
    add(tally, cell, CA_TECHNIQUE_CONNECT, 3, 2, ca_test_random_float(&numbers) < 0.5f ? 1.0f : 3.0f);
    for (uint32_t i = poisson(4.0); i > 0; i--) add(tally, cell, CA_TECHNIQUE_MERGE, 2, 2, 0.3f);
    add_photons(tally, cell, 3 * poisson(2.0), 9, 7, 1.0f, 0.2f);
    const bool found = ca_test_random_float(&numbers) < 0.5f;
    add_photons(tally, cell, found ? poisson(20.0) : 0, 3, 4, 20.0f, 0.1f);
}

static bool heads(void) { return ca_test_random_float(&numbers) < 0.5f; }

/* A lamp that brings 1 and a sky that brings 0.5, of which next event asks one. At the second vertex the lamp is
 * never hit and the sky without noise; at the third hits of both are found half of the time. */
static void add_two_lights(ca_technique_tally *tally, uint32_t cell)
{
    enum { LAMP = 1, SKY = 2 };
    for (uint32_t s = 2; s <= 3; s++) {
        if (heads()) add_of(tally, cell, CA_TECHNIQUE_NEXT_EVENT, s + 1, 1, LAMP, 1.0f, 2.0f);
        else add_of(tally, cell, CA_TECHNIQUE_NEXT_EVENT, s + 1, 1, SKY, 1.0f, 1.0f);
    }
    add_of(tally, cell, CA_TECHNIQUE_HIT, 4, 0, SKY, 1.0f, 0.5f);
    if (heads()) add_of(tally, cell, CA_TECHNIQUE_HIT, 5, 0, LAMP, 1.0f, 2.0f);
    if (heads()) add_of(tally, cell, CA_TECHNIQUE_HIT, 5, 0, SKY, 1.0f, 1.0f);
}

static ca_factor_map *map_of(void (*add_iteration)(ca_technique_tally *tally, uint32_t cell))
{
    ca_technique_tally *tally;
    ca_factor_map *map;
    ca_error error;
    assert_int_equal(ca_technique_tally_create(&tally, WIDTH, HEIGHT, &error), CA_OK);
    for (uint32_t i = 0; i < ITERATIONS; i++)
        for (uint32_t cell = 0; cell < ca_technique_tally_cells(tally); cell++) {
            add_iteration(tally, cell);
            ca_technique_tally_end(tally, cell);
        }
    assert_int_equal(ca_factor_map_create(&map, tally, ITERATIONS, &error), CA_OK);
    ca_technique_tally_destroy(tally);
    return map;
}

static void assert_between(double x, double low, double high)
{
    if (!(x > low && x < high)) fail_msg("%g is not between %g and %g", x, low, high);
}

/* Covariances with the others seem to be up to a seventh of the variance, and factors as much smaller. */
static void test_known_moments(void **state)
{
    (void)state;
    ca_factor_map *map = map_of(add_known);
    for (int i = 0; i < 200; i++) {
        const ca_vec2 place = {ca_test_random_float(&numbers) * WIDTH, ca_test_random_float(&numbers) * HEIGHT};
        const ca_technique_factors *factors = ca_factor_map_at(map, place);
        /* without noise: as many as there were differences, of 4 to 9 regions of 16 cells with smaller weights */
        assert_between((double)ca_split_factor(factors, 2, 1, 3), 100.0, 500.0);
        assert_between((double)ca_split_factor(factors, 3, 0, 3), 100.0, 500.0);
        assert_between((double)ca_split_factor(factors, 3, 2, 0), 3.6, 5.8);            /* 5 / 1 */
        assert_between((double)ca_merge_factor(factors, 2, 1), 0.75, 1.001);         /* 1 */
        assert_between((double)ca_merge_factor(factors, 3, 3), 0.75, 1.001);         /* 200 / 110: at most 1 */
        assert_between((double)ca_merge_factor(factors, 9, 6), 0.22, 0.43);          /* 1 / 3 */
        assert_between((double)ca_merge_factor(factors, 5, 5), 0.22, 0.43);          /* the same class */
        /* not seen: in a group whose own noise is all there is, and without a group */
        assert_between((double)ca_split_factor(factors, 2, 0, 3), 0.999, 1.0001);
        assert_between((double)ca_split_factor(factors, 3, 0, 2), 0.999, 1.0001);
        assert_true(ca_split_factor(factors, 1, 3, 3) == 1.0f && ca_merge_factor(factors, 4, 1) == 1.0f);
    }
    ca_factor_map_destroy(map);
}

/* Variances V of 1 and 0.25, shares C of the sum's of 0.5 and -0.25, mean squares of 2 and 0.5. */
static void test_lights_that_next_event_chooses_from(void **state)
{
    (void)state;
    ca_factor_map *map = map_of(add_two_lights);
    for (int i = 0; i < 200; i++) {
        const ca_vec2 place = {ca_test_random_float(&numbers) * WIDTH, ca_test_random_float(&numbers) * HEIGHT};
        const ca_technique_factors *factors = ca_factor_map_at(map, place);
        assert_between((double)ca_split_factor(factors, 3, 1, 1), 3.2, 4.8);  /* no hits: 2 / 0.5 */
        assert_between((double)ca_split_factor(factors, 4, 1, 1), 4.8, 7.2);  /* H = 1: 2 / (1 * 0.5 / 1.5) */
        assert_between((double)ca_split_factor(factors, 4, 1, 2), 15.0, 25.0); /* a tenth of H = 0.25: 0.5 / 0.025 */
        /* a tenth of what is in doubt of hits: 0.5 / (0.1 * 0.25 / n), for n as above */
        assert_between((double)ca_split_factor(factors, 3, 1, 2), 2000.0, 10000.0);
        assert_between((double)ca_split_factor(factors, 5, 0, 1), 1.4, 2.5);  /* hits come alone: 2 / 1 */
    }
    ca_factor_map_destroy(map);
}

/* Next event and a connection are found or missed at once, a hit by chance of its own. */
static void add_together(ca_technique_tally *tally, uint32_t cell)
{
    if (heads()) {
        add_weighted(tally, cell, CA_TECHNIQUE_NEXT_EVENT, 3, 1, 0, 1.0f, 2.0f, 0.75f);
        add_weighted(tally, cell, CA_TECHNIQUE_CONNECT, 3, 2, 0, 1.0f, 2.0f, 0.25f);
    }
    if (heads()) add_weighted(tally, cell, CA_TECHNIQUE_HIT, 4, 0, 0, 1.0f, 2.0f, 0.5f);
    add_weighted(tally, cell, CA_TECHNIQUE_HIT, 2, 0, 1, 1.0f, 100.0f, 1.0f);
}

/* Alone each is worth 2 / 1. Weighted sums have variances of 9/16, 1/16 and 1/4, and covariances of 12/16, 4/16 and
 * 1/4 with all. */
static void test_classes_that_come_together(void **state)
{
    (void)state;
    ca_factor_map *map = map_of(add_together);
    for (int i = 0; i < 200; i++) {
        const ca_vec2 place = {ca_test_random_float(&numbers) * WIDTH, ca_test_random_float(&numbers) * HEIGHT};
        const ca_technique_factors *factors = ca_factor_map_at(map, place);
        assert_between((double)ca_split_factor(factors, 3, 1, 0), 1.2, 1.8); /* 2 / (12 / 9) */
        assert_between((double)ca_split_factor(factors, 3, 2, 0), 0.4, 0.62); /* 2 / 4 */
        assert_between((double)ca_split_factor(factors, 4, 0, 0), 1.5, 2.5);
    }
    ca_factor_map_destroy(map);
}

/* Every second cell is a hundred times as bright, and without noise. */
static void add_bright_and_dark(ca_technique_tally *tally, uint32_t cell)
{
    if (cell % 2 == 0) add(tally, cell, CA_TECHNIQUE_CONNECT, 3, 2, 100.0f);
    else if (heads()) add(tally, cell, CA_TECHNIQUE_CONNECT, 3, 2, 2.0f);
}

/* Relative to the light M is 1 and 2, V is 0 and 1, but for the light's own noise; not 10,002 and 1. */
static void test_bright_cells_do_not_decide(void **state)
{
    (void)state;
    ca_factor_map *map = map_of(add_bright_and_dark);
    for (int i = 0; i < 200; i++) {
        const ca_vec2 place = {ca_test_random_float(&numbers) * WIDTH, ca_test_random_float(&numbers) * HEIGHT};
        assert_between((double)ca_split_factor(ca_factor_map_at(map, place), 3, 2, 0), 1.5, 4.0);
    }
    ca_factor_map_destroy(map);
}

/* No number of a scene makes a factor that is not a positive number: a weight could not be made of it. */
static void test_extreme_contributions(void **state)
{
    (void)state;
    static const float values[] = {1e-38f, 1e-20f, 1e18f, 5e18f, 1e25f, 3e38f};
    for (size_t i = 0; i < sizeof values / sizeof values[0]; i++) {
        ca_technique_tally *tally;
        ca_factor_map *map;
        assert_int_equal(ca_technique_tally_create(&tally, 8, 8, NULL), CA_OK);
        for (uint32_t n = 0; n < ITERATIONS; n++) {
            for (uint32_t k = 0; k < 16 && n == 0; k++) add(tally, 0, CA_TECHNIQUE_CONNECT, 2, 2, values[i]);
            for (uint32_t k = 0; k < 16; k++) add(tally, 0, CA_TECHNIQUE_MERGE, 2, 2, values[i]);
            add_of(tally, 0, CA_TECHNIQUE_NEXT_EVENT, 2, 1, n % 2, 1.0f, values[i]);
            if (i % 2 == 0) add_of(tally, 0, CA_TECHNIQUE_HIT, 3, 0, 1, 1.0f, 1e-12f * values[i]);
            for (uint32_t cell = 0; cell < ca_technique_tally_cells(tally); cell++)
                ca_technique_tally_end(tally, cell);
        }
        assert_int_equal(ca_factor_map_create(&map, tally, ITERATIONS, NULL), CA_OK);
        const ca_technique_factors *factors = ca_factor_map_at(map, (ca_vec2){1.0f, 1.0f});
        const float found[] = {ca_split_factor(factors, 2, 2, 0), ca_merge_factor(factors, 2, 1),
                               ca_split_factor(factors, 2, 1, 0), ca_split_factor(factors, 2, 1, 1)};
        for (size_t f = 0; f < sizeof found / sizeof found[0]; f++)
            if (!(found[f] > 0.0f && isfinite(found[f]))) fail_msg("%g: %g", (double)values[i], (double)found[f]);
        ca_factor_map_destroy(map);
        ca_technique_tally_destroy(tally);
    }
}

/* A path's contributions are no different for what other cells get. */
static void test_cells_cover_the_film(void **state)
{
    (void)state;
    static const uint32_t sizes[][2] = {{1, 1}, {3, 1}, {96, 96}, {1000, 3}, {3840, 2160}};
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        ca_technique_tally *tally;
        assert_int_equal(ca_technique_tally_create(&tally, sizes[i][0], sizes[i][1], NULL), CA_OK);
        const uint32_t cells = ca_technique_tally_cells(tally);
        const double pixels = (double)sizes[i][0] * (double)sizes[i][1];
        assert_true(cells >= 1 && cells <= 9000 && (double)cells <= pixels / 4.0 + 1.0);
        for (uint32_t cell = 0; cell < cells; cell++) {
            uint32_t x, y;
            ca_technique_tally_pixel(tally, cell, &x, &y);
            assert_true(x < sizes[i][0] && y < sizes[i][1]);
        }
        ca_technique_tally_destroy(tally);
    }
}

/* ---- Places on the film ---------------------------------------------------------------------------------------- */

static const char *const box =
    "<scene version='3.0.0'><integrator type='vavcm'><integer name='max_depth' value='5'/>"
    "<float name='radius' value='0.1'/></integrator>"
    "<sensor type='perspective'><float name='fov' value='60'/><transform name='to_world'>"
    "<lookat origin='0,0,0.9' target='0,0,-1' up='0,1,0'/></transform><film type='hdrfilm'>"
    "<integer name='width' value='80'/><integer name='height' value='48'/><rfilter type='tent'/></film></sensor>"
    "<shape type='cube'><boolean name='flip_normals' value='true'/><bsdf type='diffuse'/></shape>"
    "<shape type='sphere'><float name='radius' value='0.3'/><bsdf type='dielectric'/></shape>"
    "<shape type='rectangle'><transform name='to_world'><scale value='0.3'/><rotate x='1' angle='90'/>"
    "<translate y='0.98'/></transform><bsdf type='diffuse'/>"
    "<emitter type='area'><rgb name='radiance' value='5,5,5'/></emitter></shape>"
    "<emitter type='point'><point name='position' value='0.6,0.5,0.7'/><rgb name='intensity' value='0.5,0.5,0.5'/>"
    "</emitter></scene>";

typedef struct watch {
    const ca_camera *camera;
    const ca_bidirectional *engine;
    uint32_t seen[CA_TECHNIQUE_COUNT];
    uint32_t judged[CA_FACTOR_LIGHTS]; /* next events by lights whose class has a factor */
} watch;

/* Near a region's edge rounding may decide. */
static bool is_at_an_edge(const ca_factor_map *map, ca_vec2 film)
{
    const float off = 0.01f;
    const ca_technique_factors *here = ca_factor_map_at(map, film);
    return ca_factor_map_at(map, (ca_vec2){film.x - off, film.y - off}) != here ||
           ca_factor_map_at(map, (ca_vec2){film.x + off, film.y + off}) != here ||
           ca_factor_map_at(map, (ca_vec2){film.x + off, film.y - off}) != here ||
           ca_factor_map_at(map, (ca_vec2){film.x - off, film.y + off}) != here;
}

/* The camera is a pinhole: the place follows from the first point that it sees. */
static void see(void *user, const ca_observed_path *observed)
{
    watch *w = user;
    const ca_vec3 first = observed->path->camera.count > 1
                              ? observed->camera[1].position
                              : observed->light[observed->path->light.count - 1].point.position;
    ca_camera_direct direct;
    if (!ca_camera_sample_direct(w->camera, first, (ca_vec2){0.5f, 0.5f}, 4.0f, &direct)) return;
    if (is_at_an_edge(w->engine->factors, direct.film_position)) return;
    assert_ptr_equal(observed->path->factors, ca_factor_map_at(w->engine->factors, direct.film_position));
    w->seen[observed->technique]++;
    const uint32_t light = observed->path->light_class;
    if (observed->technique == CA_TECHNIQUE_NEXT_EVENT)
        w->judged[light] +=
            ca_split_factor(observed->path->factors, observed->path->camera.count, 1, light) != 1.0f;
}

static void trace_pass(const ca_render_plan *plan, void *state)
{
    static ca_film_sample samples[80 * 48];
    static ca_camera_path paths[80 * 48];
    ca_workers workers;
    assert_int_equal(ca_workers_create(&workers, 1, NULL), CA_OK);
    memset(samples, 0, sizeof samples);
    for (uint32_t i = 0; i < 80 * 48; i++)
        paths[i] = (ca_camera_path){.x = i % 80, .y = i / 80, .sample = &samples[i]};
    assert_int_equal(plan->type->begin_round(state, 0, 0, &workers.parallel, workers.list, NULL), CA_OK);
    plan->type->camera_paths(state, paths, 80 * 48, 0, &workers.list[0]);
    ca_workers_destroy(&workers);
}

/* The box by an integrator, with an observer that knows the engine and the camera. NULL: the scene's integrator. */
static void watch_pass(const char *integrator, ca_path_observer *observer, watch *w)
{
    ca_scene *scene = scene_from_text(box);
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.threads = 1;
    settings.integrator = integrator;
    ca_render_plan plan;
    ca_error error;
    if (ca_render_plan_make(&plan, scene, &settings, &error) != CA_OK) fail_msg("%s", error.message);
    plan.input.observer = observer;
    void *engine;
    assert_int_equal(plan.type->create(&plan.input, &engine, &error), CA_OK);
    w->camera = &plan.camera;
    w->engine = engine;
    trace_pass(&plan, engine);
    plan.type->destroy(engine);
    ca_scene_release(scene);
}

static void test_paths_read_the_factors_of_their_place(void **state)
{
    (void)state;
    watch w = {.camera = NULL};
    watch_pass(NULL, &(ca_path_observer){.see = see, .user = &w}, &w);
    for (int t = 0; t < CA_TECHNIQUE_COUNT; t++) {
        print_message("    %s: %u paths\n", ca_technique_name((ca_technique)t), w.seen[t]);
        assert_true(w.seen[t] > 100);
    }
    for (int light = 0; light < 2; light++) assert_true(w.judged[light] > 1000);
}

/* ---- Crowded places -------------------------------------------------------------------------------------------- */

typedef struct crowd_watch {
    watch watch;
    double count, sum, squares; /* of densities at vertices that ask a light */
} crowd_watch;

static void see_crowd(void *user, const ca_observed_path *observed)
{
    crowd_watch *w = user;
    if (observed->technique != CA_TECHNIQUE_NEXT_EVENT) return;
    const ca_mis_side *camera = &observed->path->camera;
    const double density = (double)camera->vertices[camera->count - 1].photon_density;
    w->count++;
    w->sum += density;
    w->squares += density * density;
}

/* Few light paths tell the density as well as all do, if less finely. */
static void test_crowds_of_few_light_paths(void **state)
{
    (void)state;
    crowd_watch few = {.count = 0.0}, all = {.count = 0.0};
    watch_pass("vavcm:light_paths=40000,radius=0.01", &(ca_path_observer){.see = see_crowd, .user = &few},
               &few.watch);
    watch_pass("vcm-plus:light_paths=40000,radius=0.01", &(ca_path_observer){.see = see_crowd, .user = &all},
               &all.watch);
    const double mean_of_few = few.sum / few.count, mean_of_all = all.sum / all.count;
    const double spread_of_few = few.squares / few.count / (mean_of_few * mean_of_few),
                 spread_of_all = all.squares / all.count / (mean_of_all * mean_of_all);
    print_message("    densities %.4g and %.4g, mean squares %.3g and %.3g of theirs\n", mean_of_few, mean_of_all,
                  spread_of_few, spread_of_all);
    assert_true(few.count > 1000.0 && all.count > 1000.0);
    assert_between(mean_of_few / mean_of_all, 0.85, 1.1);
    assert_between(spread_of_few / spread_of_all, 0.75, 1.2);
}

int main(void)
{
    numbers = ca_test_random_seed(7);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_known_moments),
        cmocka_unit_test(test_lights_that_next_event_chooses_from),
        cmocka_unit_test(test_classes_that_come_together),
        cmocka_unit_test(test_bright_cells_do_not_decide),
        cmocka_unit_test(test_extreme_contributions),
        cmocka_unit_test(test_cells_cover_the_film),
        cmocka_unit_test(test_paths_read_the_factors_of_their_place),
        cmocka_unit_test(test_crowds_of_few_light_paths),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
