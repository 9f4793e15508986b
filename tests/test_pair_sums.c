/* Sums over pairs of light and camera paths against the whole matrix of what they contribute, element by element; the
 * estimators' means against the known components of models; failures of memory. */
#include "base/memory.h"
#include "film/pair_sums.h"
#include "support/sample_mean.h"
#include "support/test_random.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static ca_test_random random_source;
static ca_pair_sums *sums;

static double uniform(void) { return (double)ca_test_random_float(&random_source); }
static uint32_t below(uint32_t count) { return ca_test_random_u32(&random_source) % count; }

static int set_up(void **state)
{
    (void)state;
    return ca_pair_sums_create(&sums, NULL) == CA_OK ? 0 : -1;
}

static int tear_down(void **state)
{
    (void)state;
    ca_pair_sums_destroy(sums);
    return 0;
}

/* ---- Against the matrix ---------------------------------------------------------------------------------------- */

/* Each moment with the magnitude of what it is the sum of, which rounding is measured by. */
typedef struct oracle_moments {
    double value, pair, camera, light;
    double value_size, pair_size, camera_size, light_size;
    double connected, square, with_pair, with_camera, with_light;
    double with_pair_size, with_camera_size, with_light_size;
} oracle_moments;

/* D of each camera path, and the light path that it connects to. */
enum { MOST_CAMERA_PATHS = 16 };
static double connected[MOST_CAMERA_PATHS];
static uint32_t partners[MOST_CAMERA_PATHS];

/* Product of the two halves' means along a row or column of the matrix. */
static double halves_product(const double *elements, uint32_t count, uint32_t stride)
{
    double halves[2] = {0.0, 0.0};
    uint32_t counts[2] = {0, 0};
    for (uint32_t i = 0; i < count; i++) {
        halves[i % 2] += elements[(size_t)i * stride];
        counts[i % 2]++;
    }
    return halves[0] / counts[0] * (halves[1] / counts[1]);
}

/* Equations (2), (3), (5) as they are written; the matrix has a row for each camera path. */
static oracle_moments oracle(const double *matrix, uint32_t light_paths, uint32_t camera_paths)
{
    oracle_moments o = {0};
    const double pairs = (double)light_paths * camera_paths;
    for (size_t i = 0; i < (size_t)light_paths * camera_paths; i++) {
        o.value += matrix[i] / pairs;
        o.pair += matrix[i] * matrix[i] / pairs;
        o.value_size += fabs(matrix[i]) / pairs;
    }
    o.pair_size = o.pair;
    for (uint32_t j = 0; j < camera_paths; j++) {
        const double product = halves_product(matrix + (size_t)j * light_paths, light_paths, 1) / camera_paths;
        o.camera += product;
        o.camera_size += fabs(product);
    }
    for (uint32_t i = 0; i < light_paths && camera_paths > 1; i++) {
        const double product = halves_product(matrix + i, camera_paths, light_paths) / light_paths;
        o.light += product;
        o.light_size += fabs(product);
    }
    return o;
}

/* Section C of docs/papers/000.md as it is written. */
static void add_connections(const double *matrix, uint32_t light_paths, uint32_t camera_paths, oracle_moments *o)
{
    for (uint32_t j = 0; j < camera_paths; j++) {
        const double *row = matrix + (size_t)j * light_paths, d = connected[j] / camera_paths;
        double others_of_camera = 0.0, others_of_light = 0.0, size_of_camera = 0.0, size_of_light = 0.0;
        for (uint32_t i = 0; i < light_paths; i++) {
            others_of_camera += i == partners[j] ? 0.0 : row[i] / (light_paths - 1.0);
            size_of_camera += fabs(row[i]) / (light_paths - 1.0);
        }
        for (uint32_t k = 0; k < camera_paths; k++) {
            const double c = matrix[(size_t)k * light_paths + partners[j]];
            others_of_light += k == j ? 0.0 : c / (camera_paths - 1.0);
            size_of_light += camera_paths == 1 ? 0.0 : fabs(c) / (camera_paths - 1.0);
        }
        o->connected += d;
        o->square += d * connected[j];
        o->with_pair += d * row[partners[j]];
        o->with_camera += d * others_of_camera;
        o->with_light += d * others_of_light;
        o->with_pair_size += fabs(d) * (fabs(row[partners[j]]) + 1000.0);
        o->with_camera_size += fabs(d) * size_of_camera;
        o->with_light_size += fabs(d) * size_of_light;
        o->value_size += fabs(d);
    }
    o->value += o->connected;
}

/* What a pixel is made of. */
typedef struct pixel_case {
    uint32_t light_paths, camera_paths;
    double density; /* mean number of merges of a pair */
    double alone;   /* probability that a camera path finds something alone, up to twice in its course */
    bool negative;  /* some camera paths have a negative filter weight */
    double own;     /* probability that a light path brings something alone, up to twice */
    double connects; /* probability that a camera path brings something by connections, up to twice */
} pixel_case;

/* What light paths bring alone. */
static void add_own_light(const pixel_case *c, double *matrix)
{
    for (uint32_t n = 0; n < 2 * c->light_paths; n++) {
        if (uniform() >= c->own) continue;
        const uint32_t path = n % 3 ? below(c->light_paths) : 0;
        const double luminance = (c->negative && n % 5 == 1 ? -50.0 : 50.0) * uniform();
        for (uint32_t j = 0; j < c->camera_paths; j++) matrix[(size_t)j * c->light_paths + path] += luminance;
        ca_pair_sums_add_light_alone(sums, path, luminance);
    }
}

static void connect_path(const pixel_case *c, uint32_t j, double sign)
{
    connected[j] = 0.0;
    partners[j] =
        (j * 7 + 3) % c->light_paths; /* not all different where 7 divides them; that matters to expectations only */
    for (int n = 0; n < 2; n++) {
        if (uniform() >= c->connects) continue;
        const double luminance = sign * (1.0 + 200.0 * uniform());
        connected[j] += luminance;
        ca_pair_sums_connect(sums, partners[j], luminance);
    }
}

/* Adds one pixel's pairs to the sums and to the matrix. */
static void add_pixel(const pixel_case *c, double *matrix)
{
    memset(matrix, 0, (size_t)c->light_paths * c->camera_paths * sizeof *matrix);
    ca_pair_sums_begin(sums, c->light_paths);
    for (uint32_t j = 0; j < c->camera_paths; j++) {
        double *row = matrix + (size_t)j * c->light_paths;
        const double sign = c->negative && j % 3 == 1 ? -1.0 : 1.0;
        const uint32_t merges = (uint32_t)(2.0 * uniform() * c->density * c->light_paths);
        ca_pair_sums_next_path(sums);
        for (uint32_t m = 0; m < merges; m++) {
            const uint32_t path =
                uniform() < 0.3 ? below(c->light_paths < 5 ? c->light_paths : 5) : below(c->light_paths);
            const double luminance = sign * uniform() * pow(10.0, 3.0 * uniform());
            row[path] += luminance;
            ca_pair_sums_add(sums, path, luminance);
            if (m != merges / 2 || uniform() >= c->alone) continue;
            const double alone = sign * uniform() * 100.0;
            for (uint32_t i = 0; i < c->light_paths; i++) row[i] += alone;
            ca_pair_sums_add_alone(sums, alone);
        }
        connect_path(c, j, sign);
        if (uniform() >= c->alone) continue;
        for (uint32_t i = 0; i < c->light_paths; i++) row[i] += sign * 7.0;
        ca_pair_sums_add_alone(sums, sign * 7.0);
    }
    add_own_light(c, matrix);
}

static void expect(const pixel_case *c, const char *what, double got, double expected, double size)
{
    if (!(fabs(got - expected) <= 1e-12 * size))
        fail_msg("%u light and %u camera paths, density %g, alone %g: the %s is %.17g, not %.17g", c->light_paths,
                 c->camera_paths, c->density, c->alone, what, got, expected);
}

static void check_pixel(const pixel_case *c)
{
    double *matrix = malloc((size_t)c->light_paths * c->camera_paths * sizeof *matrix);
    assert_non_null(matrix);
    add_pixel(c, matrix);
    oracle_moments o = oracle(matrix, c->light_paths, c->camera_paths);
    add_connections(matrix, c->light_paths, c->camera_paths, &o);
    const ca_pair_moments m = ca_pair_sums_finish(sums);
    expect(c, "value", m.value, o.value, o.value_size);
    expect(c, "pair estimator", m.pair, o.pair, o.pair_size);
    expect(c, "camera estimator", m.camera, o.camera, o.camera_size);
    if (c->camera_paths > 1)
        expect(c, "light estimator", m.light, o.light, o.light_size);
    else
        assert_true(isnan(m.light));
    expect(c, "connections' mean", m.connected, o.connected, fabs(o.connected));
    expect(c, "connections' square", m.connected_square, o.square, o.square);
    expect(c, "connections with pairs", m.connected_pair, o.with_pair, o.with_pair_size);
    expect(c, "connections with camera paths", m.connected_camera, o.with_camera, o.with_camera_size);
    if (c->camera_paths > 1)
        expect(c, "connections with light paths", m.connected_light, o.with_light,
               o.with_light_size + o.with_pair_size);
    else
        assert_true(o.connected == 0.0 ? m.connected_light == 0.0 : isnan(m.connected_light));
    free(matrix);
}

/* Pixels one after the other in the same sums, of all sizes in turn, so that what one left behind would show in the
 * next. */
static void test_matrix(void **state)
{
    (void)state;
    static const uint32_t light_paths[] = {2, 3, 64, 101, 1000, 2047}, camera_paths[] = {1, 2, 3, 4, 7, 10};
    static const double densities[] = {0.0, 0.002, 0.05, 1.5}, alone[] = {0.0, 0.3, 1.0};
    for (int round = 0; round < 3; round++)
        for (int d = 0; d < 4; d++)
            for (int f = 0; f < 6; f++)
                for (int b = 0; b < 6; b++)
                    for (int a = 0; a < 3; a++)
                        check_pixel(&(pixel_case){light_paths[f], camera_paths[b], densities[d], alone[a], round == 2,
                                                  .own = 0.0, .connects = 0.0});
    assert_true(ca_pair_sums_complete(sums));
}

/* The same with light paths' own light, connections, or both. */
static void test_matrix_of_connections(void **state)
{
    (void)state;
    static const uint32_t light_paths[] = {2, 3, 64, 101, 1000}, camera_paths[] = {1, 2, 3, 7, 10};
    static const double densities[] = {0.0, 0.05, 1.5}, part[] = {0.0, 0.4, 1.0};
    for (int round = 0; round < 2; round++)
        for (int d = 0; d < 3; d++)
            for (int f = 0; f < 5; f++)
                for (int b = 0; b < 5; b++)
                    for (int a = 0; a < 9; a++)
                        check_pixel(&(pixel_case){light_paths[f], camera_paths[b], densities[d], d == 1 ? 0.3 : 0.0,
                                                  round == 1, .own = part[a / 3], .connects = part[a % 3]});
}

/* More camera paths than numbers that the table tells them apart by, over many pixels: it starts again in time. */
static void test_many_pixels(void **state)
{
    (void)state;
    for (uint32_t pixel = 0; pixel < 3000; pixel++) {
        ca_pair_sums_begin(sums, 500);
        for (uint32_t j = 0; j < 3000; j++) {
            ca_pair_sums_next_path(sums);
            if (j % 1001 == pixel % 900) ca_pair_sums_add(sums, pixel % 500, 3.0);
        }
        const ca_pair_moments m = ca_pair_sums_finish(sums);
        assert_true(fabs(m.value - 9.0 / 1500000.0) < 1e-15 && fabs(m.pair - 27.0 / 1500000.0) < 1e-15);
        assert_true(fabs(m.light - 18.0 / (500.0 * 1500.0 * 1500.0)) < 1e-15);
    }
}

static void test_empty_pixel(void **state)
{
    (void)state;
    for (uint32_t camera_paths = 1; camera_paths < 4; camera_paths++) {
        ca_pair_sums_begin(sums, 4000000000u);
        for (uint32_t j = 0; j < camera_paths; j++) ca_pair_sums_next_path(sums);
        const ca_pair_moments m = ca_pair_sums_finish(sums);
        assert_true(m.value == 0.0 && m.pair == 0.0 && m.camera == 0.0);
        assert_true(camera_paths == 1 ? isnan(m.light) : m.light == 0.0);
    }
}

/* So many light paths that no loop goes over them; the largest numbers among them. */
static void test_many_light_paths(void **state)
{
    (void)state;
    const uint32_t n = UINT32_MAX;
    ca_pair_sums_begin(sums, n);
    for (int j = 0; j < 2; j++) {
        ca_pair_sums_next_path(sums);
        ca_pair_sums_add_alone(sums, 3.0);
        ca_pair_sums_add(sums, n - 1, 5.0);
        ca_pair_sums_add(sums, n - 2, 2.0);
    }
    const ca_pair_moments m = ca_pair_sums_finish(sums);
    const double count = n, light = ((count - 2.0) * 9.0 + 64.0 + 25.0) / count;
    assert_true(fabs(m.value - (3.0 + 7.0 / count)) < 1e-12);
    assert_true(fabs(m.pair - light) < 1e-11 && fabs(m.light - light) < 1e-11);
    assert_true(fabs(m.camera - (3.0 + 5.0 / 2147483648.0) * (3.0 + 2.0 / 2147483647.0)) < 1e-11);
}

/* ---- The estimators' means ------------------------------------------------------------------------------------- */

/* C_ij = a_i b_j + c_ij + u_j, all independent and each often 0. */
typedef struct factor_model {
    uint32_t light_paths, camera_paths;
    bool own, alone; /* are there c, u? */
} factor_model;

/* Uniform in [0, 1) with a probability, else 0: of such numbers the means of themselves and of their squares. */
typedef struct sparse {
    double probability;
} sparse;
static double draw(sparse s) { return uniform() < s.probability ? uniform() : 0.0; }
static double mean(sparse s) { return s.probability / 2.0; }
static double mean_square(sparse s) { return s.probability / 3.0; }

static const sparse light_factor = {0.2}, camera_factor = {0.6}, own_term = {0.05}, alone_term = {0.3};

static ca_pair_moments draw_moments(const factor_model *model)
{
    double light[64];
    for (uint32_t i = 0; i < model->light_paths; i++) light[i] = draw(light_factor);
    ca_pair_sums_begin(sums, model->light_paths);
    for (uint32_t j = 0; j < model->camera_paths; j++) {
        const double camera = draw(camera_factor);
        ca_pair_sums_next_path(sums);
        for (uint32_t i = 0; i < model->light_paths; i++) {
            if (light[i] * camera > 0.0) ca_pair_sums_add(sums, i, light[i] * camera);
            const double own = model->own ? draw(own_term) : 0.0;
            if (own > 0.0) ca_pair_sums_add(sums, i, own);
        }
        if (model->alone) ca_pair_sums_add_alone(sums, draw(alone_term));
    }
    return ca_pair_sums_finish(sums);
}

static void expect_mean(const sample_mean *m, uint32_t count, double expected, const char *what)
{
    const double got = m->sum / count, error = error_of(m, count);
    if (!(fabs(got - expected) <= 3.5 * error))
        fail_msg("mean of the %s: %.9g +- %.2g, not %.9g", what, got, error, expected);
}

static void check_model(const factor_model *model)
{
    const uint32_t iterations = 40000;
    sample_mean value = {0}, pair = {0}, camera = {0}, light = {0}, squares = {0};
    for (uint32_t k = 0; k < iterations; k++) {
        const ca_pair_moments m = draw_moments(model);
        add_sample(&value, m.value);
        add_sample(&squares, m.value * m.value);
        add_sample(&pair, m.pair);
        add_sample(&camera, m.camera);
        add_sample(&light, m.light);
    }
    const double a = mean(light_factor), a2 = mean_square(light_factor), b = mean(camera_factor),
                 b2 = mean_square(camera_factor);
    const double c = model->own ? mean(own_term) : 0.0, c2 = model->own ? mean_square(own_term) : 0.0;
    const double u = model->alone ? mean(alone_term) : 0.0, u2 = model->alone ? mean_square(alone_term) : 0.0;
    const double l = a * b + c + u, nf = model->light_paths, nb = model->camera_paths;
    const double cc = a2 * b2 + c2 + u2 + 2.0 * (a * b * c + a * b * u + c * u);
    const double bb = a * a * b2 + c * c + u2 + 2.0 * (a * b * c + a * b * u + c * u);
    const double ff = a2 * b * b + c * c + u * u + 2.0 * (a * b * c + a * b * u + c * u);
    expect_mean(&value, iterations, l, "value");
    expect_mean(&pair, iterations, cc, "pair estimator");
    expect_mean(&camera, iterations, bb, "camera estimator");
    expect_mean(&light, iterations, ff, "light estimator");
    const double l2 = l * l,
                 law = (cc - l2) / (nf * nb) + (1.0 - 1.0 / nf) * (bb - l2) / nb + (1.0 - 1.0 / nb) * (ff - l2) / nf;
    expect_mean(&squares, iterations, l2 + law, "squared value");
}

static void test_means(void **state)
{
    (void)state;
    check_model(&(factor_model){20, 4, false, false});
    check_model(&(factor_model){20, 4, true, false});
    check_model(&(factor_model){21, 5, true, true});
    check_model(&(factor_model){2, 2, true, true});
    check_model(&(factor_model){7, 3, false, true});
}

/* ---- Failures -------------------------------------------------------------------------------------------------- */

/* Pixels that need larger tables, until memory runs out; nothing breaks then. */
static void fill_until_failure(ca_pair_sums *filled, long allocations)
{
    ca_pair_sums_begin(filled, 100000);
    ca_pair_sums_next_path(filled);
    ca_memory_fail_after(allocations);
    for (uint32_t i = 0; i < 5000; i++) ca_pair_sums_add(filled, i, 1.0);
    ca_memory_fail_after(-1);
    assert_false(ca_pair_sums_complete(filled));
    ca_pair_sums_finish(filled);
    ca_pair_sums_begin(filled, 100000); /* remembered */
    assert_false(ca_pair_sums_complete(filled));
}

static void test_allocation_failures(void **state)
{
    (void)state;
    ca_pair_sums *made;
    ca_error error = {0};
    for (long n = 0; n < 2; n++) {
        ca_memory_fail_after(n);
        assert_int_equal(ca_pair_sums_create(&made, &error), CA_ERROR_MEMORY);
        ca_memory_fail_after(-1);
        assert_null(made);
        assert_non_null(strstr(error.message, "pairs"));
    }
    for (long n = 0; n < 6; n++) {
        assert_int_equal(ca_pair_sums_create(&made, NULL), CA_OK);
        assert_true(ca_pair_sums_complete(made));
        fill_until_failure(made, n);
        ca_pair_sums_destroy(made);
    }
    ca_pair_sums_destroy(NULL);
}

int main(void)
{
    random_source = ca_test_random_seed(5);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_matrix),
        cmocka_unit_test(test_matrix_of_connections),
        cmocka_unit_test(test_many_pixels),
        cmocka_unit_test(test_empty_pixel),
        cmocka_unit_test(test_many_light_paths),
        cmocka_unit_test(test_means),
        cmocka_unit_test(test_allocation_failures),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
