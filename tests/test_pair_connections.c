/* The law of noise where camera paths connect to light paths of their own, and light paths splat (docs/papers/000.md,
 * sections B and C): all outcomes of a few paths are enumerated, each with its estimators, so that expectations are
 * exact; then films are drawn from the same model. */
#include "film/pair_film.h"
#include "noise/components.h"
#include "support/sample_mean.h"
#include "support/test_random.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

/* ---- All outcomes ---------------------------------------------------------------------------------------------- */

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
                m.merge[x][y][part] =
                    ca_test_random_u32(random) % 3 ? 4.0 * (double)ca_test_random_float(random) : 0.0;
            m.connect[x][y] = ca_test_random_u32(random) % 4 ? 5.0 * (double)ca_test_random_float(random) : 0.0;
        }
    }
    return m;
}

/* One outcome: the kinds of all paths. Camera path j connects to light path (j + shift) mod N_F. */
static ca_pair_moments outcome(ca_pair_sums *sums, const model *m, const int *light, uint32_t light_paths,
                               const int *camera, uint32_t camera_paths, uint32_t shift)
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
            const double c = m->merge[x][y][0] + m->merge[x][y][1] + m->alone[y] + m->light_alone[x],
                         d = m->connect[x][y];
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
    const double cross = (e->with_pair - e->c * e->d) / (nf * nb) +
                         (1.0 - 1.0 / nf) * (e->with_camera - e->c * e->d) / nb +
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
    const double all[MEANS] = {
        m->value,     m->value * m->value, m->pair,           m->camera,           m->light,
        m->connected, m->connected_square, m->connected_pair, m->connected_camera, m->connected_light};
    for (int q = 0; q < MEANS; q++) means[q] += weight * all[q];
}

static void check_enumeration(ca_pair_sums *sums, const model *m, uint32_t light_paths, uint32_t camera_paths,
                              uint32_t shift)
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
    const double expected[MEANS] = {l,
                                    l * l + law(&e, light_paths, camera_paths),
                                    e.pair,
                                    e.camera,
                                    e.light,
                                    e.d,
                                    e.square,
                                    e.with_pair,
                                    e.with_camera,
                                    e.with_light};
    static const char *const names[MEANS] = {"value", "squared value", "C",    "B",    "F",
                                             "D",     "P_DD",          "P_CD", "B_CD", "F_CD"};
    for (int q = 0; q < MEANS; q++)
        if (!(fabs(means[q] - expected[q]) <= 1e-12 * fabs(expected[q])) && !(camera_paths == 1 && isnan(means[q])))
            fail_msg("%u light, %u camera paths: the mean of %s is %.17g, not %.17g", light_paths, camera_paths,
                     names[q], means[q], expected[q]);
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

/* ---- From iterations ------------------------------------------------------------------------------------------- */

/* A film of one pixel whose paths are drawn from the model. */
static void draw_film(ca_pair_sums *sums, const model *m, ca_test_random *random, uint32_t iterations,
                      ca_pair_film *film)
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

/* Predictions for the numbers measured with and for others, whose law is known here since nothing depends on the
 * numbers: without bias, from few iterations too; and their standard errors are what they scatter by. */
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

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_enumeration), cmocka_unit_test(test_predictions)};
    return cmocka_run_group_tests_name("noise of connections", tests, NULL, NULL);
}
