/* Numbers of paths where they connect (noise/connected_numbers.h): against the law, and against all numbers there
 * are. */
#include "noise/connected_numbers.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

enum { NODES = 5, MOST_CAMERA_PATHS = 20 };

static const ca_noise_coefficients law = {.pair = 900.0,
                                          .camera = 1.5,
                                          .light = 30.0,
                                          .connected = 0.4,
                                          .connected_pair = -2.0,
                                          .connected_camera = -0.3,
                                          .connected_light = 0.2};

/* Nodes of 1000 / 16 to 16000 light paths; the variance by node k's coefficients is `factor`^k times the law's. */
static ca_connected_image image_of(ca_connected_node nodes[NODES], double factor)
{
    for (int k = 0; k < NODES; k++) {
        const double f = pow(factor, k);
        nodes[k].light_paths = 62.0 * pow(4.0, k);
        nodes[k].sums = (ca_noise_coefficients){f * law.pair,
                                                f * law.camera,
                                                f * law.light,
                                                f * law.connected,
                                                f * law.connected_pair,
                                                f * law.connected_camera,
                                                f * law.connected_light};
    }
    return (ca_connected_image){.nodes = nodes,
                                .node_count = NODES,
                                .fixed_time = 0.001,
                                .light_time = 2e-6,
                                .camera_time = 3e-3,
                                .merge_time = 1e-6};
}

static void assert_near(double a, double b) { assert_true(fabs(a - b) <= 1e-9 * fabs(b)); }

/* The same coefficients everywhere: the law itself. */
static void test_law(void **state)
{
    (void)state;
    ca_connected_node nodes[NODES];
    const ca_connected_image image = image_of(nodes, 1.0);
    for (double light_paths = 20.0; light_paths < 40000.0; light_paths *= 1.3) {
        const double n = light_paths, m = 3.0;
        const double variance = (law.pair + 2.0 * law.connected_pair) / (n * m) +
                                (1.0 - 1.0 / n) * (law.camera + 2.0 * law.connected_camera) / m +
                                (1.0 - 1.0 / m) * (law.light + 2.0 * law.connected_light) / n + law.connected / m;
        const ca_ray_choice expected = ca_connected_expect(&image, n, m);
        assert_near(expected.variance, variance);
        assert_near(expected.time, 0.001 + 2e-6 * n + m * (3e-3 + 1e-6 * n));
    }
}

/* At a node its own coefficients count, half a way between two the root of both, beyond them the nearest. */
static void test_between_nodes(void **state)
{
    (void)state;
    ca_connected_node nodes[NODES], same[NODES];
    const ca_connected_image image = image_of(nodes, 1.7), plain = image_of(same, 1.0);
    static const struct {
        double light_paths, factor;
    } cases[] = {{62.0, 1.0},    {124.0, 1.3038404810405297}, {248.0, 1.7},       {15872.0, 8.3521},
                 {7936.0, 1.7 * 1.7 * 1.7 * 1.3038404810405297}, {20.0, 1.0}, {30000.0, 8.3521}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++)
        assert_near(ca_connected_expect(&image, cases[i].light_paths, 4.0).variance,
                    cases[i].factor * ca_connected_expect(&plain, cases[i].light_paths, 4.0).variance);
}

/* No numbers in the range are better by more than the steps of light paths can lose. */
static void test_least(void **state)
{
    (void)state;
    ca_connected_node nodes[NODES];
    const double factors[] = {0.6, 0.9, 1.0, 1.1};
    for (int i = 0; i < 4; i++) {
        const ca_connected_image image = image_of(nodes, factors[i]);
        const ca_ray_choice best = ca_connected_choose(&image, 1000000, MOST_CAMERA_PATHS);
        double least = (double)INFINITY;
        for (double n = 62.0; n <= 15872.0; n *= 1.01)
            for (int m = 1; m <= MOST_CAMERA_PATHS; m++) {
                const ca_ray_choice c = ca_connected_expect(&image, n, m);
                least = fmin(least, c.variance * c.time);
            }
        assert_true(best.variance * best.time <= 1.02 * least);
        assert_true(best.light_paths >= 62.0 && best.light_paths <= 15872.0 && best.camera_paths >= 1.0);
    }
}

static void test_limits(void **state)
{
    (void)state;
    ca_connected_node nodes[NODES];
    ca_connected_image image = image_of(nodes, 0.2);
    assert_true(ca_connected_choose(&image, 1000000, MOST_CAMERA_PATHS).light_paths == 15872.0);
    assert_true(ca_connected_choose(&image, 700, MOST_CAMERA_PATHS).light_paths == 700.0);
    assert_true(ca_connected_choose(&image, 1000000, 1).camera_paths == 1.0);
    nodes[0].light_paths = 2.0;
    image.node_count = 1;
    const ca_ray_choice few = ca_connected_choose(&image, 1000000, MOST_CAMERA_PATHS);
    assert_true(few.light_paths == 2.0 && few.camera_paths <= 2.0);
}

/* Estimates with noise may be negative: they are not taken for noiseless. */
static void test_negative_estimates(void **state)
{
    (void)state;
    ca_connected_node nodes[NODES];
    const ca_connected_image image = image_of(nodes, 1.0);
    for (int k = 2; k < NODES; k += 2) nodes[k].sums = (ca_noise_coefficients){.camera = -5.0, .connected = -5.0};
    const ca_ray_choice best = ca_connected_choose(&image, 1000000, MOST_CAMERA_PATHS);
    assert_true(best.variance > 0.0);
    assert_true(ca_connected_expect(&image, 992.0, 2.0).variance == 0.0);
    for (int k = 0; k < NODES; k++) nodes[k].sums = (ca_noise_coefficients){0};
    assert_true(ca_connected_choose(&image, 1000000, MOST_CAMERA_PATHS).variance == 0.0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_law),    cmocka_unit_test(test_between_nodes),     cmocka_unit_test(test_least),
        cmocka_unit_test(test_limits), cmocka_unit_test(test_negative_estimates),
    };
    return cmocka_run_group_tests_name("numbers of connected paths", tests, NULL, NULL);
}
