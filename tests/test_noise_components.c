/* The three-term law from sums: against computations over all iterations' values, against a model whose variance is
 * known for any number of paths, its standard errors against the scatter of many repeats; what is negative or
 * unknown. */
#include "noise/components.h"
#include "support/test_random.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

enum { MOST_ITERATIONS = 4096 };
static ca_test_random random_source;
static double quantities[MOST_ITERATIONS][CA_PAIR_QUANTITIES]; /* of each iteration */

static double uniform(void) { return (double)ca_test_random_float(&random_source); }

/* Standard normal, by Box and Muller. */
static double normal(void)
{
    const double radius = sqrt(-2.0 * log(1.0 - uniform()));
    return radius * cos(6.283185307179586 * uniform());
}

static void assert_close(const char *what, double value, double expected, double tolerance)
{
    if (!(fabs(value - expected) <= tolerance))
        fail_msg("%s is %.12g, not %.12g +- %.3g", what, value, expected, tolerance);
}

static void add(ca_pair_pixel *pixel, const double q[CA_PAIR_QUANTITIES])
{
    const double value = q[CA_PAIR_VALUE];
    pixel->iterations++;
    for (int a = 0; a < CA_PAIR_QUANTITIES; a++) pixel->sums[a] += q[a];
    for (int a = 0; a < CA_PAIR_QUANTITIES; a++)
        for (int b = a; b < CA_PAIR_QUANTITIES; b++) pixel->products[ca_pair_product(a, b)] += q[a] * q[b];
    pixel->cubes += value * value * value;
    pixel->fourths += value * value * value * value;
}

static ca_pair_pixel pixel_of(int iterations)
{
    ca_pair_pixel pixel = {{0}, {0}, 0, 0, 0};
    for (int k = 0; k < iterations; k++) add(&pixel, quantities[k]);
    return pixel;
}

/* Quantities that hang together as those of a pixel do; `scatter` relative to the mean, which is `mean`. */
static void draw(int iterations, double mean, double scatter)
{
    for (int k = 0; k < iterations; k++) {
        const double value = mean * (1.0 + scatter * (normal() + 0.3 * (uniform() - 0.5)));
        const double square = value * value;
        quantities[k][CA_PAIR_VALUE] = value;
        quantities[k][CA_PAIR_PAIR] = 90.0 * square * (1.0 + 0.5 * uniform());
        quantities[k][CA_PAIR_CAMERA] = 3.0 * square + 0.2 * mean * mean * normal();
        quantities[k][CA_PAIR_LIGHT] = 1.2 * square + 0.1 * mean * mean * normal();
    }
}

/* ---- From sums as from all values ------------------------------------------------------------------------------ */

static double mean_of(const double *values, int count)
{
    double sum = 0.0;
    for (int k = 0; k < count; k++) sum += values[k];
    return sum / count;
}

/* Mean of (value - mean)^power. */
static double central_moment(const double *values, int count, int power)
{
    const double mean = mean_of(values, count);
    double sum = 0.0;
    for (int k = 0; k < count; k++) sum += pow(values[k] - mean, power);
    return sum / count;
}

/* The mean of factors[q] * quantity q, plus that for L^2, times L^2, in two passes. */
static ca_noise_value expected_value(int iterations, const double factors[CA_PAIR_QUANTITIES], double luminance2)
{
    static double influence[MOST_ITERATIONS], linear[MOST_ITERATIONS];
    double products = 0.0, mean = 0.0;
    for (int k = 0; k < iterations; k++) mean += quantities[k][CA_PAIR_VALUE] / iterations;
    for (int j = 0; j < iterations; j++)
        for (int k = 0; k < iterations; k++)
            if (j != k) products += quantities[j][CA_PAIR_VALUE] * quantities[k][CA_PAIR_VALUE];
    products /= (double)iterations * (iterations - 1);
    for (int k = 0; k < iterations; k++) {
        linear[k] = 0.0;
        for (int q = 0; q < CA_PAIR_QUANTITIES; q++)
            if (factors[q] != 0.0) linear[k] += factors[q] * quantities[k][q];
        influence[k] = linear[k] + luminance2 * 2.0 * mean * quantities[k][CA_PAIR_VALUE];
    }
    const double variance = central_moment(influence, iterations, 2) * iterations / (iterations - 1.0);
    return (ca_noise_value){mean_of(linear, iterations) + luminance2 * products, sqrt(variance / iterations)};
}

static void assert_value(const char *what, ca_noise_value value, ca_noise_value expected)
{
    assert_close(what, value.value, expected.value, 1e-10 * (fabs(expected.value) + expected.error));
    assert_close(what, value.error, expected.error, 1e-7 * expected.error);
}

static void test_components_as_from_all_values(void **state)
{
    (void)state;
    for (int iterations = 2; iterations <= 200; iterations += 33) {
        draw(iterations, 3.0, 0.4);
        const ca_pair_pixel pixel = pixel_of(iterations);
        const ca_noise_components c = ca_noise_components_of(&pixel);
        assert_value("L", c.luminance, expected_value(iterations, (const double[]){1, 0, 0, 0}, 0));
        assert_value("L^2", c.luminance2, expected_value(iterations, (const double[]){0, 0, 0, 0}, 1));
        assert_value("C", c.pair, expected_value(iterations, (const double[]){0, 1, 0, 0}, 0));
        assert_value("B", c.camera, expected_value(iterations, (const double[]){0, 0, 1, 0}, 0));
        assert_value("F", c.light, expected_value(iterations, (const double[]){0, 0, 0, 1}, 0));
    }
}

/* The coefficients alone, from means. */
static void test_excess(void **state)
{
    (void)state;
    for (int iterations = 2; iterations <= 200; iterations += 33) {
        ca_pair_means means = {{0}, 0.0};
        draw(iterations, 3.0, 0.4);
        for (int k = 0; k < iterations; k++) {
            for (int q = 0; q < CA_PAIR_QUANTITIES; q++) means.sums[q] += quantities[k][q];
            means.squares += quantities[k][CA_PAIR_VALUE] * quantities[k][CA_PAIR_VALUE];
        }
        const ca_pair_pixel pixel = pixel_of(iterations);
        const ca_noise_components c = ca_noise_components_of(&pixel);
        const ca_noise_excess e = ca_noise_excess_of(&means, (uint32_t)iterations);
        assert_close("L", e.luminance, c.luminance.value, 1e-10);
        assert_close("L^2", e.luminance2, c.luminance2.value, 1e-9);
        assert_close("C - L^2", e.pair, c.pair.value - c.luminance2.value, 1e-8);
        assert_close("B - L^2", e.camera, c.camera.value - c.luminance2.value, 1e-9);
        assert_close("F - L^2", e.light, c.light.value - c.luminance2.value, 1e-9);
    }
}

static void test_terms_as_from_all_values(void **state)
{
    (void)state;
    static double values[MOST_ITERATIONS];
    for (int iterations = 2; iterations <= 200; iterations += 33) {
        draw(iterations, 0.01, 0.1);
        const ca_pair_pixel pixel = pixel_of(iterations);
        const double f = 50, b = 7, n = iterations;
        const ca_noise_terms t = ca_noise_terms_of(&pixel, f, b);
        const double p = 1 / (f * b), c = (1 - 1 / f) / b, l = (1 - 1 / b) / f;
        assert_value("pair", t.pair, expected_value(iterations, (const double[]){0, p, 0, 0}, -p));
        assert_value("camera", t.camera, expected_value(iterations, (const double[]){0, 0, c, 0}, -c));
        assert_value("light", t.light, expected_value(iterations, (const double[]){0, 0, 0, l}, -l));
        assert_value("predicted", t.predicted, expected_value(iterations, (const double[]){0, p, c, l}, -p - c - l));
        for (int k = 0; k < iterations; k++) values[k] = quantities[k][CA_PAIR_VALUE];
        const double s2 = central_moment(values, iterations, 2) * n / (n - 1),
                     m4 = central_moment(values, iterations, 4);
        assert_close("measured", t.measured.value, s2, 1e-10 * s2);
        const double error = sqrt((m4 - s2 * s2 * (n - 3) / (n - 1)) / n);
        assert_close("error of measured", t.measured.error, error, 1e-6 * error);
    }
}

/* ---- A model whose variance is known --------------------------------------------------------------------------- */

enum { MODEL_LIGHT = 4, MODEL_CAMERA = 6, MODEL_ITERATIONS = 4000 };
static const double light_variance = 0.5, camera_variance = 1.5, pair_variance = 8.0;

/* C_ij = (1 + x_i) (1 + y_j) + z_ij, all independent with mean 0; the estimators as they are defined. */
static void draw_model(double q[CA_PAIR_QUANTITIES])
{
    double x[MODEL_LIGHT], c, camera_sums[MODEL_CAMERA][2] = {{0}}, light_sums[MODEL_LIGHT][2] = {{0}};
    memset(q, 0, CA_PAIR_QUANTITIES * sizeof *q);
    for (int i = 0; i < MODEL_LIGHT; i++) x[i] = sqrt(light_variance) * normal();
    for (int j = 0; j < MODEL_CAMERA; j++) {
        const double y = sqrt(camera_variance) * normal();
        for (int i = 0; i < MODEL_LIGHT; i++) {
            c = (1.0 + x[i]) * (1.0 + y) + sqrt(pair_variance) * normal();
            q[CA_PAIR_VALUE] += c / (MODEL_LIGHT * MODEL_CAMERA);
            q[CA_PAIR_PAIR] += c * c / (MODEL_LIGHT * MODEL_CAMERA);
            camera_sums[j][i % 2] += c / (MODEL_LIGHT / 2.0);
            light_sums[i][j % 2] += c / (MODEL_CAMERA / 2.0);
        }
    }
    for (int j = 0; j < MODEL_CAMERA; j++) q[CA_PAIR_CAMERA] += camera_sums[j][0] * camera_sums[j][1] / MODEL_CAMERA;
    for (int i = 0; i < MODEL_LIGHT; i++) q[CA_PAIR_LIGHT] += light_sums[i][0] * light_sums[i][1] / MODEL_LIGHT;
}

/* Of (1 + mean of x) (1 + mean of y) + mean of z. */
static double model_variance(double light_paths, double camera_paths)
{
    return (1 + light_variance / light_paths) * (1 + camera_variance / camera_paths) - 1 +
           pair_variance / (light_paths * camera_paths);
}

static void assert_within(const char *what, ca_noise_value value, double expected)
{
    assert_true(value.error < 0.1 * fabs(expected));
    assert_close(what, value.value, expected, 4.0 * value.error);
}

static void test_law_of_a_model(void **state)
{
    (void)state;
    random_source = ca_test_random_seed(1);
    for (int k = 0; k < MODEL_ITERATIONS; k++) draw_model(quantities[k]);
    const ca_pair_pixel pixel = pixel_of(MODEL_ITERATIONS);
    const ca_noise_components c = ca_noise_components_of(&pixel);
    assert_within("L", c.luminance, 1.0);
    assert_within("C", c.pair, (1 + light_variance) * (1 + camera_variance) + pair_variance);
    assert_within("B", c.camera, 1 + camera_variance);
    assert_within("F", c.light, 1 + light_variance);
    const double counts[][2] = {{MODEL_LIGHT, MODEL_CAMERA}, {1, 1}, {1, 100}, {50, 1}, {1000, 3}, {1e6, 300}};
    for (int i = 0; i < 6; i++)
        assert_within("predicted", ca_noise_terms_of(&pixel, counts[i][0], counts[i][1]).predicted,
                      model_variance(counts[i][0], counts[i][1]));
    assert_within("measured", ca_noise_terms_of(&pixel, 9, 9).measured, model_variance(MODEL_LIGHT, MODEL_CAMERA));
}

/* ---- Bias and errors ------------------------------------------------------------------------------------------- */

/* With three iterations the square of the mean would be off by a third of the variance. */
static void test_luminance2_is_unbiased(void **state)
{
    (void)state;
    enum { REPEATS = 200000, ITERATIONS = 3 };
    const double mean = 0.4, deviation = 1.0;
    double sum = 0.0, squares = 0.0;
    random_source = ca_test_random_seed(2);
    for (int r = 0; r < REPEATS; r++) {
        ca_pair_pixel pixel = {{0}, {0}, 0, 0, 0};
        for (int k = 0; k < ITERATIONS; k++) add(&pixel, (const double[]){mean + deviation * normal(), 0, 0, 0});
        const double value = ca_noise_components_of(&pixel).luminance2.value;
        sum += value;
        squares += value * value;
    }
    const double error = sqrt((squares / REPEATS - sum * sum / REPEATS / REPEATS) / REPEATS);
    assert_true(error < 0.02 * deviation * deviation / ITERATIONS);
    assert_close("mean of L^2", sum / REPEATS, mean * mean, 4.0 * error);
}

typedef struct scatter {
    double sum, squares, error_squares;
    int repeats;
} scatter;

static void scatter_add(scatter *s, ca_noise_value value)
{
    s->sum += value.value;
    s->squares += value.value * value.value;
    s->error_squares += value.error * value.error;
    s->repeats++;
}

static void assert_error_is_scatter(const char *what, const scatter *s)
{
    const double n = s->repeats, deviation = sqrt((s->squares - s->sum * s->sum / n) / (n - 1.0));
    const double error = sqrt(s->error_squares / n);
    if (!(fabs(error / deviation - 1.0) < 0.1)) fail_msg("%s: error %.4g, scatter %.4g", what, error, deviation);
}

static void test_errors_against_scatter(void **state)
{
    (void)state;
    enum { REPEATS = 3000, ITERATIONS = 120, QUANTITIES = 10 };
    static const char *const names[QUANTITIES] = {"L",    "L^2",    "C",     "B",         "F",
                                                  "pair", "camera", "light", "predicted", "measured"};
    random_source = ca_test_random_seed(3);
    for (int wide = 0; wide < 2; wide++) {
        scatter scatters[QUANTITIES] = {{0, 0, 0, 0}};
        for (int r = 0; r < REPEATS; r++) {
            draw(ITERATIONS, 2.0, wide ? 1.5 : 0.05);
            const ca_pair_pixel pixel = pixel_of(ITERATIONS);
            const ca_noise_components c = ca_noise_components_of(&pixel);
            const ca_noise_terms t = ca_noise_terms_of(&pixel, 20, 5);
            const ca_noise_value all[QUANTITIES] = {c.luminance, c.luminance2, c.pair,  c.camera,    c.light,
                                                    t.pair,      t.camera,     t.light, t.predicted, t.measured};
            for (int q = 0; q < QUANTITIES; q++) scatter_add(&scatters[q], all[q]);
        }
        for (int q = 0; q < QUANTITIES; q++) assert_error_is_scatter(names[q], &scatters[q]);
    }
}

/* ---- What is unknown, negative, black -------------------------------------------------------------------------- */

static void test_one_camera_path(void **state)
{
    (void)state;
    draw(20, 1.0, 0.2);
    for (int k = 0; k < 20; k++) quantities[k][CA_PAIR_LIGHT] = (double)NAN;
    const ca_pair_pixel pixel = pixel_of(20);
    assert_true(isnan(ca_noise_components_of(&pixel).light.value));
    assert_true(isnan(ca_noise_components_of(&pixel).light.error));
    const ca_noise_terms one = ca_noise_terms_of(&pixel, 10, 1), two = ca_noise_terms_of(&pixel, 10, 2);
    assert_true(one.light.value == 0.0 && one.light.error == 0.0);
    assert_value("predicted", one.predicted, expected_value(20, (const double[]){0, 0.1, 0.9, 0}, -1.0));
    assert_true(isnan(two.light.value) && isnan(two.light.error) && isnan(two.predicted.value) &&
                isnan(two.predicted.error));
    assert_true(two.camera.value > 0.0 && two.measured.value > 0.0);
}

static void test_black(void **state)
{
    (void)state;
    memset(quantities, 0, sizeof quantities);
    const ca_pair_pixel pixel = pixel_of(5);
    const ca_noise_terms t = ca_noise_terms_of(&pixel, 10, 3);
    assert_true(t.predicted.value == 0.0 && t.predicted.error == 0.0 && t.measured.value == 0.0 &&
                t.measured.error == 0.0);
}

/* Pixels of 2 iterations with the values 1 and 3 (L^2 = 3, variance 2) and constant C, B, F. */
static ca_pair_pixel simple_pixel(double pair, double camera, double light)
{
    ca_pair_pixel pixel = {{0}, {0}, 0, 0, 0};
    add(&pixel, (const double[]){1, pair, camera, light});
    add(&pixel, (const double[]){3, pair, camera, light});
    return pixel;
}

static void test_summary(void **state)
{
    (void)state;
    enum { WIDTH = 4, HEIGHT = 3 };
    ca_pair_pixel pixels[WIDTH * HEIGHT];
    for (int i = 0; i < WIDTH * HEIGHT; i++) pixels[i] = simple_pixel(1e9, 1e9, 1e9);
    const ca_pair_film film = {
        .x0 = 10, .y0 = 20, .width = WIDTH, .height = HEIGHT, .light_paths = 2, .camera_paths = 4, .pixels = pixels};
    /* The region below; factors for 2 and 4 paths are 1/8, 1/8 and 3/8. */
    pixels[1 * WIDTH + 2] = simple_pixel(3 + 8 * 4.0, 3 + 8 * 9.0, 3 - 8);  /* terms 4, 9, -3: predicted 10 */
    pixels[1 * WIDTH + 3] = simple_pixel(3 - 8 * 1.0, 3 - 8 * 2.0, 3 + 8.0 / 3); /* -1, -2, 1: predicted -2 */
    pixels[2 * WIDTH + 2] = simple_pixel(3, 3, 3 + 24);                     /* 0, 0, 9 */
    pixels[2 * WIDTH + 3] = simple_pixel(3 - 8 * 5.0, 3, 3 + 24 * 1.0);      /* -5, 0, 9: predicted 4 */
    const ca_noise_summary s = ca_noise_summarise(&film, (const uint32_t[]){12, 21, 14, 23}, 2, 4);
    assert_int_equal(s.pixels, 4);
    assert_close("luminance", s.luminance, 2, 1e-12);
    assert_close("pair", s.pair, (4.0 - 1 + 0 - 5) / 4, 1e-12);
    assert_close("camera", s.camera, (9.0 - 2) / 4, 1e-12);
    assert_close("light", s.light, (-3.0 + 1 + 9 + 9) / 4, 1e-12);
    assert_close("predicted", s.predicted, (10.0 - 2 + 9 + 4) / 4, 1e-12);
    assert_close("measured", s.measured, 2, 1e-12);
    assert_close("pair_rms", s.pair_rms, 2.0 / 4, 1e-12);
    assert_close("camera_rms", s.camera_rms, 3.0 / 4, 1e-12);
    assert_close("light_rms", s.light_rms, (1.0 + 3 + 3) / 4, 1e-12);
    assert_close("predicted_rms", s.predicted_rms, (sqrt(10.0) + 3 + 2) / 4, 1e-12);
    assert_close("measured_rms", s.measured_rms, sqrt(2.0), 1e-12);
    assert_int_equal(s.negative_pair, 2);
    assert_int_equal(s.negative_camera, 1);
    assert_int_equal(s.negative_light, 1);
    assert_int_equal(s.negative_predicted, 1);
    assert_int_equal(s.negative_measured, 0);
    /* The term itself stays negative. */
    assert_close("light term", ca_noise_terms_of(&pixels[1 * WIDTH + 2], 2, 4).light.value, -3, 1e-12);
}

int main(void)
{
    random_source = ca_test_random_seed(0);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_excess),
        cmocka_unit_test(test_components_as_from_all_values), cmocka_unit_test(test_terms_as_from_all_values),
        cmocka_unit_test(test_law_of_a_model),                cmocka_unit_test(test_luminance2_is_unbiased),
        cmocka_unit_test(test_errors_against_scatter),        cmocka_unit_test(test_one_camera_path),
        cmocka_unit_test(test_black),                         cmocka_unit_test(test_summary),
    };
    return cmocka_run_group_tests_name("noise components", tests, NULL, NULL);
}
