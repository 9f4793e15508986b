/* The law of noise where camera paths connect to light paths of their own, and light paths splat (docs/papers/000.md, sections B
 * and C): all outcomes of a few paths are enumerated, each with its estimators, so that expectations are exact; then what the
 * bidirectional engine measures, against the variance there is. */
#include "base/memory.h"
#include "noise/components.h"
#include "render/render.h"
#include "support/scene_text.h"
#include "support/test_random.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

/* ---- All outcomes --------------------------------------------------------------------------------------------------- */

/* A path is one of so many, equally likely. */
enum { KINDS = 3, MOST_PATHS = 4 };

/* What paths bring, by their kinds: merged, in up to two parts; alone; by connections. */
typedef struct model {
    double merge[KINDS][KINDS][2], alone[KINDS], light_alone[KINDS], connect[KINDS][KINDS]; /* [light][camera] */
} model;

static model draw_model(ca_test_random *random)
{
    model m;
    for (int x = 0; x < KINDS; x++) {
        m.alone[x] = 2.0 * (double)ca_test_random_float(random);
        m.light_alone[x] = 3.0 * (double)ca_test_random_float(random);
        for (int y = 0; y < KINDS; y++) {
            for (int part = 0; part < 2; part++)
                m.merge[x][y][part] = ca_test_random_u32(random) % 3 ? 4.0 * (double)ca_test_random_float(random) : 0.0;
            m.connect[x][y] = ca_test_random_u32(random) % 4 ? 5.0 * (double)ca_test_random_float(random) : 0.0;
        }
    }
    return m;
}

/* One outcome: the kinds of all paths. Camera path j connects to light path (j + shift) mod N_F. */
static ca_pair_moments outcome(ca_pair_sums *sums, const model *m, const int *light, uint32_t light_paths, const int *camera,
                               uint32_t camera_paths, uint32_t shift)
{
    ca_pair_sums_begin(sums, light_paths);
    for (uint32_t j = 0; j < camera_paths; j++) {
        const uint32_t partner = (j + shift) % light_paths;
        ca_pair_sums_next_path(sums);
        ca_pair_sums_add_alone(sums, m->alone[camera[j]]);
        for (int part = 0; part < 2; part++)
            for (uint32_t i = 0; i < light_paths; i++)
                if (m->merge[light[i]][camera[j]][part] > 0.0)
                    ca_pair_sums_add(sums, i, m->merge[light[i]][camera[j]][part]);
        if (m->connect[light[partner]][camera[j]] > 0.0)
            ca_pair_sums_connect(sums, partner, m->connect[light[partner]][camera[j]]);
    }
    for (uint32_t i = 0; i < light_paths; i++) ca_pair_sums_add_light_alone(sums, i, m->light_alone[light[i]]);
    return ca_pair_sums_finish(sums);
}

/* Expectations over one X and one Y. */
typedef struct expectations {
    double c, d, pair, camera, light, square, with_pair, with_camera, with_light;
} expectations;

static expectations expectations_of(const model *m)
{
    expectations e = {0};
    double c_of_camera[KINDS] = {0}, c_of_light[KINDS] = {0}, d_of_camera[KINDS] = {0}, d_of_light[KINDS] = {0};
    for (int x = 0; x < KINDS; x++)
        for (int y = 0; y < KINDS; y++) {
            const double c = m->merge[x][y][0] + m->merge[x][y][1] + m->alone[y] + m->light_alone[x], d = m->connect[x][y];
            c_of_camera[y] += c / KINDS;
            c_of_light[x] += c / KINDS;
            d_of_camera[y] += d / KINDS;
            d_of_light[x] += d / KINDS;
            e.c += c / (KINDS * KINDS);
            e.d += d / (KINDS * KINDS);
            e.pair += c * c / (KINDS * KINDS);
            e.square += d * d / (KINDS * KINDS);
            e.with_pair += c * d / (KINDS * KINDS);
        }
    for (int k = 0; k < KINDS; k++) {
        e.camera += c_of_camera[k] * c_of_camera[k] / KINDS;
        e.light += c_of_light[k] * c_of_light[k] / KINDS;
        e.with_camera += c_of_camera[k] * d_of_camera[k] / KINDS;
        e.with_light += c_of_light[k] * d_of_light[k] / KINDS;
    }
    return e;
}

/* (6) and (C1). */
static double law(const expectations *e, double nf, double nb)
{
    const double own = (e->pair - e->c * e->c) / (nf * nb) + (1.0 - 1.0 / nf) * (e->camera - e->c * e->c) / nb +
                       (1.0 - 1.0 / nb) * (e->light - e->c * e->c) / nf;
    const double cross = (e->with_pair - e->c * e->d) / (nf * nb) + (1.0 - 1.0 / nf) * (e->with_camera - e->c * e->d) / nb +
                         (1.0 - 1.0 / nb) * (e->with_light - e->c * e->d) / nf;
    return own + (e->square - e->d * e->d) / nb + 2.0 * cross;
}

/* The kinds of `count` paths in the outcome of that number. */
static void decode(uint32_t number, uint32_t count, int *kinds)
{
    for (uint32_t i = 0; i < count; i++, number /= KINDS) kinds[i] = (int)(number % KINDS);
}

static uint32_t power_of_kinds(uint32_t count) { return count == 0 ? 1 : KINDS * power_of_kinds(count - 1); }

enum { MEANS = 10 };

static void add_moments(const ca_pair_moments *m, double weight, double means[MEANS])
{
    const double all[MEANS] = {m->value,  m->value * m->value,  m->pair,           m->camera,           m->light,
                               m->connected, m->connected_square, m->connected_pair, m->connected_camera, m->connected_light};
    for (int q = 0; q < MEANS; q++) means[q] += weight * all[q];
}

static void check_enumeration(ca_pair_sums *sums, const model *m, uint32_t light_paths, uint32_t camera_paths, uint32_t shift)
{
    const uint32_t lights = power_of_kinds(light_paths), cameras = power_of_kinds(camera_paths);
    double means[MEANS] = {0};
    for (uint32_t x = 0; x < lights; x++)
        for (uint32_t y = 0; y < cameras; y++) {
            int light[MOST_PATHS], camera[MOST_PATHS];
            decode(x, light_paths, light);
            decode(y, camera_paths, camera);
            const ca_pair_moments moments = outcome(sums, m, light, light_paths, camera, camera_paths, shift);
            add_moments(&moments, 1.0 / ((double)lights * cameras), means);
        }
    const expectations e = expectations_of(m);
    const double l = e.c + e.d;
    const double expected[MEANS] = {l,     l * l + law(&e, light_paths, camera_paths), e.pair, e.camera, e.light, e.d, e.square,
                                    e.with_pair, e.with_camera, e.with_light};
    static const char *const names[MEANS] = {"value", "squared value", "C", "B", "F", "D", "P_DD", "P_CD", "B_CD", "F_CD"};
    for (int q = 0; q < MEANS; q++)
        if (!(fabs(means[q] - expected[q]) <= 1e-12 * fabs(expected[q])) && !(camera_paths == 1 && isnan(means[q])))
            fail_msg("%u light, %u camera paths: the mean of %s is %.17g, not %.17g", light_paths, camera_paths, names[q],
                     means[q], expected[q]);
}

static void test_enumeration(void **state)
{
    (void)state;
    static const uint32_t counts[][2] = {{2, 1}, {2, 2}, {3, 1}, {3, 2}, {3, 3}, {4, 2}, {4, 3}, {4, 4}};
    ca_test_random random = ca_test_random_seed(11);
    ca_pair_sums *sums;
    assert_int_equal(ca_pair_sums_create(&sums, NULL), CA_OK);
    for (uint32_t k = 0; k < 4; k++)
        for (size_t i = 0; i < sizeof counts / sizeof counts[0]; i++) {
            const model m = draw_model(&random);
            check_enumeration(sums, &m, counts[i][0], counts[i][1], k);
        }
    ca_pair_sums_destroy(sums);
}

/* ---- From iterations ------------------------------------------------------------------------------------------------ */

typedef struct sample_mean {
    double sum, squares;
} sample_mean;

static void add_sample(sample_mean *m, double value)
{
    m->sum += value;
    m->squares += value * value;
}

static double deviation_of(const sample_mean *m, double count)
{
    return sqrt(fmax(0.0, m->squares / count - m->sum / count * (m->sum / count)) * count / (count - 1.0));
}

static double error_of(const sample_mean *m, double count) { return deviation_of(m, count) / sqrt(count); }

/* A film of one pixel whose paths are drawn from the model. */
static void draw_film(ca_pair_sums *sums, const model *m, ca_test_random *random, uint32_t iterations, ca_pair_film *film)
{
    assert_int_equal(ca_pair_film_create(film, (const uint32_t[4]){0, 0, 1, 1}, 4, 3, NULL), CA_OK);
    assert_int_equal(ca_pair_film_connect(film, NULL), CA_OK);
    for (uint32_t k = 0; k < iterations; k++) {
        int light[MOST_PATHS], camera[MOST_PATHS];
        for (int i = 0; i < MOST_PATHS; i++) light[i] = (int)(ca_test_random_u32(random) % KINDS);
        for (int i = 0; i < MOST_PATHS; i++) camera[i] = (int)(ca_test_random_u32(random) % KINDS);
        const ca_pair_moments moments = outcome(sums, m, light, 4, camera, 3, k % 4);
        ca_pair_film_add(film, 0, 0, &moments);
    }
}

/* Predictions for the numbers measured with and for others, whose law is known here since nothing depends on the numbers: without
 * bias, from few iterations too; and their standard errors are what they scatter by. */
static void check_predictions(ca_pair_sums *sums, const model *m, ca_test_random *random, const double counts[2])
{
    enum { REPEATS = 3000, ITERATIONS = 50 };
    sample_mean predicted = {0}, connect = {0};
    double predicted_errors = 0.0, connect_errors = 0.0;
    for (int r = 0; r < REPEATS; r++) {
        ca_pair_film film;
        draw_film(sums, m, random, ITERATIONS, &film);
        const ca_noise_terms t = ca_noise_terms_at(&film, 0, counts[0], counts[1]);
        add_sample(&predicted, t.predicted.value);
        add_sample(&connect, t.connect.value);
        predicted_errors += t.predicted.error * t.predicted.error / REPEATS;
        connect_errors += t.connect.error * t.connect.error / REPEATS;
        assert_true(fabs(t.pair.value + t.camera.value + t.light.value + t.connect.value - t.predicted.value) < 1e-9);
        ca_pair_film_destroy(&film);
    }
    expectations e = expectations_of(m), without = e;
    without.d = without.square = without.with_pair = without.with_camera = without.with_light = 0.0;
    const double all = law(&e, counts[0], counts[1]), own = law(&without, counts[0], counts[1]);
    assert_true(fabs(predicted.sum / REPEATS - all) < 3.5 * error_of(&predicted, REPEATS));
    assert_true(fabs(connect.sum / REPEATS - (all - own)) < 3.5 * error_of(&connect, REPEATS));
    assert_true(error_of(&predicted, REPEATS) < 0.03 * all && error_of(&connect, REPEATS) < 0.03 * all);
    assert_true(fabs(sqrt(predicted_errors) / deviation_of(&predicted, REPEATS) - 1.0) < 0.1);
    assert_true(fabs(sqrt(connect_errors) / deviation_of(&connect, REPEATS) - 1.0) < 0.1);
}

static void test_predictions(void **state)
{
    (void)state;
    static const double counts[][2] = {{4, 3}, {4, 1}, {50, 7}, {3000, 40}};
    ca_test_random random = ca_test_random_seed(12);
    ca_pair_sums *sums;
    ca_pair_film film;
    assert_int_equal(ca_pair_sums_create(&sums, NULL), CA_OK);
    for (int k = 0; k < 2; k++)
        for (size_t i = 0; i < sizeof counts / sizeof counts[0]; i++) {
            const model m = draw_model(&random);
            check_predictions(sums, &m, &random, counts[i]);
        }
    /* Light paths that are connected twice have a term that is not measured. */
    const model m = draw_model(&random);
    draw_film(sums, &m, &random, 5, &film);
    const ca_noise_terms t = ca_noise_terms_at(&film, 0, 7, 8);
    assert_true(isnan(t.predicted.value) && isnan(t.connect.value) && isfinite(t.camera.value));
    ca_pair_film_destroy(&film);
    ca_pair_sums_destroy(sums);
}

/* ---- The engine ----------------------------------------------------------------------------------------------------- */

/* A room with walls, a ball and a lamp in view; the filter has negative lobes. Behind glass light is rare and bright, so that sums
 * of few iterations are skewed: for comparing variances the ball is matt. `more`: a second lamp, as strong, in a black shell, which
 * half of the light paths come from: they bring nothing, so that all that one brings hangs together. */
#define ROOM(ball, more)                                                                                                             \
    "<scene version='3.0.0'><sensor type='perspective'><float name='fov' value='60'/><transform name='to_world'>"              \
    "<lookat origin='0,0,0.95' target='0,-0.1,0' up='0,1,0'/></transform><film type='hdrfilm'>"                                \
    "<integer name='width' value='9'/><integer name='height' value='8'/><rfilter type='mitchell'/></film></sensor>"            \
    "<shape type='cube'><bsdf type='twosided'><bsdf type='diffuse'><rgb name='reflectance' value='0.8,0.7,0.5'/></bsdf></bsdf>" \
    "</shape>"                                                                                                                 \
    "<shape type='sphere'><float name='radius' value='0.3'/><point name='center' x='0.4' y='-0.6' z='-0.3'/>"                  \
    "<bsdf type='" ball "'/></shape>"                                                                                          \
    "<shape type='rectangle'><transform name='to_world'><scale value='0.3'/><rotate x='1' angle='100'/>"                       \
    "<translate x='-0.3' y='0.5' z='-0.4'/></transform><emitter type='area'><rgb name='radiance' value='3,3,2'/></emitter>"    \
    "</shape>" more "</scene>"

#define HIDDEN_LAMP                                                                                                            \
    "<shape type='sphere'><float name='radius' value='0.17'/><point name='center' x='9' y='0' z='0'/>"                         \
    "<emitter type='area'><rgb name='radiance' value='3,3,2'/></emitter></shape>"                                              \
    "<shape type='sphere'><float name='radius' value='0.5'/><point name='center' x='9' y='0' z='0'/>"                          \
    "<bsdf type='twosided'><bsdf type='diffuse'><rgb name='reflectance' value='0'/></bsdf></bsdf></shape>"

enum { CROP_X = 1, CROP_Y = 2, WIDTH = 7, HEIGHT = 6, PIXELS = WIDTH * HEIGHT };
static ca_scene *scene, *matt, *hidden; /* scene: what is rendered */

static int load_scenes(void **state)
{
    (void)state;
    scene = scene_from_text(ROOM("dielectric", ""));
    matt = scene_from_text(ROOM("diffuse", ""));
    hidden = scene_from_text(ROOM("diffuse", HIDDEN_LAMP));
    return 0;
}

static int release_scenes(void **state)
{
    (void)state;
    ca_scene_release(scene);
    ca_scene_release(matt);
    ca_scene_release(hidden);
    return 0;
}

static void swap_scenes(ca_scene **a, ca_scene **b)
{
    ca_scene *other = *a;
    *a = *b;
    *b = other;
}

typedef struct pair_render {
    const char *integrator; /* without numbers of paths */
    uint32_t light_paths, camera_paths, passes, threads;
    uint64_t seed;
} pair_render;

static ca_status try_render(const pair_render *r, ca_pair_film *film, ca_image_layers **image, ca_error *error)
{
    char integrator[128];
    snprintf(integrator, sizeof integrator, "%s,light_paths=%u,camera_paths=%u", r->integrator, r->light_paths, r->camera_paths);
    const ca_render_settings settings = {.integrator = integrator,
                                         .samples_per_pixel = r->passes * r->camera_paths,
                                         .threads = r->threads,
                                         .has_seed = true,
                                         .seed = r->seed,
                                         .has_crop = true,
                                         .crop = {CROP_X, CROP_Y, CROP_X + WIDTH, CROP_Y + HEIGHT}};
    ca_render_plan plan;
    ca_render_statistics statistics;
    *image = NULL;
    CA_TRY(ca_render_plan_make(&plan, scene, &settings, error));
    if (film) CA_TRY(ca_pair_film_create(film, plan.crop, r->light_paths, r->camera_paths, error));
    plan.input.pairs = film;
    const ca_status status = ca_render_plan_run(&plan, image, &statistics, error);
    if (status != CA_OK && film) ca_pair_film_destroy(film);
    if (status == CA_OK) assert_int_equal(statistics.non_finite, 0);
    return status;
}

static void render(const pair_render *r, ca_pair_film *film, ca_image_layers **image)
{
    ca_image_layers *made;
    ca_error error;
    if (try_render(r, film, &made, &error) != CA_OK) fail_msg("%s", error.message);
    if (film) assert_false(film->incomplete);
    if (image)
        *image = made;
    else
        ca_image_release(made);
}

#define ROOM_DEPTHS "max_depth=5,rr_depth=6"
static const char *const integrators[] = {
    "vcm:" ROOM_DEPTHS ",radius=0.1,alpha=0",
    "ovcm:" ROOM_DEPTHS ",radius=0.1,alpha=0",
    "bdpt:" ROOM_DEPTHS,
    "bdpt:" ROOM_DEPTHS ",strategies=no-splat",
};
enum { INTEGRATORS = sizeof integrators / sizeof integrators[0] };

/* The image has the same bits with and without; what is said of pairs has the same for any threads. */
static void test_same_bits(void **state)
{
    (void)state;
    for (int i = 0; i < INTEGRATORS; i++) {
        ca_pair_film first = {0};
        for (uint32_t threads = 1; threads <= 3; threads += 2) {
            const pair_render r = {integrators[i], 600, 3, 3, threads, 1};
            ca_pair_film film;
            ca_image_layers *with, *without;
            render(&r, &film, &with);
            render(&r, NULL, &without);
            assert_true(image_hash(with) == image_hash(without));
            if (threads == 1) {
                first = film;
            } else {
                assert_memory_equal(film.pixels, first.pixels, PIXELS * sizeof *film.pixels);
                assert_memory_equal(film.connections, first.connections, PIXELS * sizeof *film.connections);
                ca_pair_film_destroy(&film);
            }
            ca_image_release(with);
            ca_image_release(without);
        }
        ca_pair_film_destroy(&first);
    }
}

/* The pixels' values are the image's luminance: nothing is forgotten or counted twice. */
static void test_values(void **state)
{
    (void)state;
    for (int i = 0; i < INTEGRATORS; i++) {
        const pair_render r = {integrators[i], 300, 4, 4, 2, 5};
        ca_pair_film film;
        ca_image_layers *image;
        render(&r, &film, &image);
        const float *red = ca_image_channel(image, "R"), *green = ca_image_channel(image, "G"),
                    *blue = ca_image_channel(image, "B");
        for (int p = 0; p < PIXELS; p++) {
            const double luminance = (double)ca_luminance((ca_rgb){red[p], green[p], blue[p]});
            const double value = film.pixels[p].sums[CA_PAIR_VALUE] / (double)film.pixels[p].iterations;
            if (!(fabs(value - luminance) <= 1e-5 * fabs(luminance) + 1e-6))
                fail_msg("%s, pixel %d: the pairs' value is %.9g, the image has %.9g", integrators[i], p, value, luminance);
        }
        ca_pair_film_destroy(&film);
        ca_image_release(image);
    }
}

/* ---- The law -------------------------------------------------------------------------------------------------------- */

enum { RENDERS = 25 };

/* Sums over pixels of what one render tells, each over the pixel's squared luminance, so that all count. */
typedef struct told {
    double predicted, measured, connect;
} told;

static told told_by(const ca_pair_film *film, const double luminance[PIXELS])
{
    told t = {0};
    for (size_t p = 0; p < PIXELS; p++) {
        const ca_noise_terms terms = ca_noise_terms_at(film, p, film->light_paths, film->camera_paths);
        const double weight = 1.0 / (luminance[p] * luminance[p]);
        t.predicted += weight * terms.predicted.value;
        t.measured += weight * terms.measured.value;
        t.connect += weight * terms.connect.value;
    }
    return t;
}

/* Of a long render with other numbers. */
static void find_luminances(const pair_render *r, double luminance[PIXELS])
{
    const pair_render longer = {r->integrator, 4 * r->light_paths, r->camera_paths, 50, 2, 999};
    ca_pair_film film;
    render(&longer, &film, NULL);
    for (int p = 0; p < PIXELS; p++) luminance[p] = film.pixels[p].sums[CA_PAIR_VALUE] / (double)film.pixels[p].iterations;
    ca_pair_film_destroy(&film);
}

/* The prediction against the variance of the same iterations: errors that the two share cancel. */
static void check_law(const pair_render *r, double most_error)
{
    double luminance[PIXELS], measured = 0.0, connect = 0.0;
    sample_mean difference = {0};
    told all[RENDERS];
    find_luminances(r, luminance);
    for (int k = 0; k < RENDERS; k++) {
        pair_render one = *r;
        ca_pair_film film;
        one.seed = (uint64_t)k;
        render(&one, &film, NULL);
        all[k] = told_by(&film, luminance);
        measured += all[k].measured / RENDERS;
        connect += all[k].connect / RENDERS;
        ca_pair_film_destroy(&film);
    }
    for (int k = 0; k < RENDERS; k++) add_sample(&difference, (all[k].predicted - all[k].measured) / measured);
    const double off = difference.sum / RENDERS, error = error_of(&difference, RENDERS);
    print_message("%.24s N_F %u, N_B %u: the variance is predicted by %+.2f %% +- %.2f %%; the connections' term is %.1f %% of it\n",
                  r->integrator, r->light_paths, r->camera_paths, 100.0 * off, 100.0 * error, 100.0 * connect / measured);
    assert_true(error <= most_error);
    assert_true(fabs(off) <= 3.5 * error);
    assert_true(connect > 5.0 * error * measured); /* without it the law would be seen to fail */
}

static void test_law(void **state)
{
    (void)state;
    swap_scenes(&scene, &matt);
    check_law(&(pair_render){integrators[0], 60, 4, 100, 2, 0}, 0.006);
    check_law(&(pair_render){integrators[1], 60, 4, 100, 2, 0}, 0.006);
    check_law(&(pair_render){integrators[2], 12, 12, 100, 2, 0}, 0.006);
    check_law(&(pair_render){integrators[3], 60, 4, 100, 2, 0}, 0.006);
    swap_scenes(&scene, &matt);
    /* Where it matters which light path a camera path is connected to. */
    swap_scenes(&scene, &hidden);
    check_law(&(pair_render){integrators[0], 12, 12, 100, 2, 0}, 0.02);
    swap_scenes(&scene, &hidden);
}

/* ---- Refusals and failures ------------------------------------------------------------------------------------------ */

static void test_refusals(void **state)
{
    (void)state;
    ca_pair_film film;
    ca_image_layers *image;
    ca_error error = {0};
    const pair_render r = {integrators[0], 3, 4, 2, 1, 0};
    assert_int_equal(try_render(&r, &film, &image, &error), CA_ERROR_UNSUPPORTED);
    assert_non_null(strstr(error.message, "a light path of its own"));
}

/* Every allocation fails once: the render does, or the film says that it is incomplete. */
static void test_allocation_failures(void **state)
{
    (void)state;
    const pair_render r = {integrators[0], 300, 4, 1, 1, 1};
    uint32_t failed = 0, incomplete = 0;
    for (long n = 0;; n++) {
        ca_pair_film film = {0};
        ca_image_layers *image;
        ca_error error;
        ca_memory_fail_after(n);
        const ca_status status = try_render(&r, &film, &image, &error);
        ca_memory_fail_after(-1);
        if (status == CA_ERROR_MEMORY) {
            failed++;
            continue;
        }
        assert_int_equal(status, CA_OK);
        const bool tells = film.incomplete;
        incomplete += tells;
        ca_pair_film_destroy(&film);
        ca_image_release(image);
        if (!tells) break;
    }
    assert_true(failed > 10 && incomplete >= 2);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_enumeration), cmocka_unit_test(test_predictions),
        cmocka_unit_test(test_same_bits),   cmocka_unit_test(test_values),
        cmocka_unit_test(test_law),         cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_allocation_failures),
    };
    return cmocka_run_group_tests_name("noise of connections", tests, load_scenes, release_scenes);
}
