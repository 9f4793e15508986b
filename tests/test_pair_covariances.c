/* What a block of pairs tells: against sums over all pairs written out, and, by going through all outcomes of paths
 * with three values each, without bias. */
#include "base/memory.h"
#include "film/pair_covariances.h"
#include "support/test_random.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

enum { MOST = 12, VALUES = 3 };

typedef struct pair_block {
    uint32_t light_paths, camera_paths;
    double merged[MOST][MOST]; /* [light path][camera path] */
    double alone[MOST];
} pair_block;

static double pair_at(const pair_block *b, uint32_t i, uint32_t j) { return b->merged[i][j] + b->alone[j]; }

static ca_pair_covariance estimated(ca_pair_covariances *c, const pair_block *b)
{
    ca_pair_covariance result;
    ca_pair_covariances_begin(c, b->light_paths);
    for (uint32_t j = 0; j < b->camera_paths; j++) {
        ca_pair_covariances_next_path(c);
        ca_pair_covariances_add_alone(c, b->alone[j]);
        for (uint32_t i = b->light_paths; i-- > 0;) {
            if (b->merged[i][j] == 0.0) continue;
            ca_pair_covariances_add(c, i, 0.25 * b->merged[i][j]); /* two merges of one pair */
            ca_pair_covariances_add(c, i, 0.75 * b->merged[i][j]);
        }
    }
    assert_true(ca_pair_covariances_finish(c, &result));
    return result;
}

/* Mean of C over the light paths i = light (mod light_step) and the camera paths j = camera (mod camera_step). */
static double mean_over(const pair_block *b, uint32_t light, uint32_t light_step, uint32_t camera,
                        uint32_t camera_step)
{
    double sum = 0.0, count = 0.0;
    for (uint32_t i = light; i < b->light_paths; i += light_step)
        for (uint32_t j = camera; j < b->camera_paths; j += camera_step, count++) sum += pair_at(b, i, j);
    return sum / count;
}

static ca_pair_covariance written_out(const pair_block *b)
{
    const double n = b->light_paths, m = b->camera_paths;
    ca_pair_covariance c = {0};
    double squares = 0.0, light_products = 0.0;
    for (uint32_t j = 0; j < b->camera_paths; j++) {
        double x[2];
        for (uint32_t h = 0; h < 2; h++)
            x[h] = mean_over(b, h, 2, j, MOST) - mean_over(b, h, 2, 0, 1);
        c.camera += x[0] * x[1] / (m - 1.0);
    }
    for (uint32_t i = 0; i < b->light_paths; i++) {
        double x[2], mean[2];
        for (uint32_t h = 0; h < 2; h++) {
            mean[h] = mean_over(b, 0, 1, h, 2);
            x[h] = mean_over(b, i, MOST, h, 2);
        }
        c.light += (x[0] - mean[0]) * (x[1] - mean[1]) / (n - 1.0);
        light_products += x[0] * x[1] / n;
        for (uint32_t j = 0; j < b->camera_paths; j++) {
            squares += pair_at(b, i, j) * pair_at(b, i, j) / (n * m);
            c.merged += b->merged[i][j] / (n * m);
        }
    }
    c.pair = squares - light_products - c.camera;
    return c;
}

static void expect_near(double value, double expected, double scale, const char *what)
{
    if (!(fabs(value - expected) <= 1e-12 * scale)) fail_msg("%s: %.15g instead of %.15g", what, value, expected);
}

static void test_written_out(void **state)
{
    (void)state;
    ca_test_random random = ca_test_random_seed(1);
    ca_pair_covariances c;
    assert_int_equal(ca_pair_covariances_create(&c, NULL), CA_OK);
    for (int round = 0; round < 300; round++) {
        pair_block b = {.light_paths = 2 + ca_test_random_u32(&random) % (MOST - 1),
                        .camera_paths = 2 + ca_test_random_u32(&random) % (MOST - 1)};
        for (uint32_t j = 0; j < b.camera_paths; j++) {
            b.alone[j] = round % 3 ? (double)ca_test_random_float(&random) : 0.0;
            for (uint32_t i = 0; i < b.light_paths; i++)
                if (ca_test_random_u32(&random) % 3 == 0)
                    b.merged[i][j] = 10.0 * (double)ca_test_random_float(&random);
        }
        const ca_pair_covariance got = estimated(&c, &b), expected = written_out(&b);
        expect_near(got.camera, expected.camera, 100.0, "camera");
        expect_near(got.light, expected.light, 100.0, "light");
        expect_near(got.pair, expected.pair, 300.0, "pair");
        expect_near(got.merged, expected.merged, 10.0, "merged");
    }
    ca_pair_covariances_destroy(&c);
    ca_pair_covariances_destroy(&c); /* twice does no harm */
}

/* The variances of g, f and h of a table of C, all values equally likely. */
static ca_pair_covariance parts_of(double table[VALUES][VALUES])
{
    double light[VALUES] = {0}, camera[VALUES] = {0}, mean = 0.0;
    for (int x = 0; x < VALUES; x++)
        for (int y = 0; y < VALUES; y++) {
            light[x] += table[x][y] / VALUES;
            camera[y] += table[x][y] / VALUES;
            mean += table[x][y] / (VALUES * VALUES);
        }
    ca_pair_covariance v = {0};
    for (int x = 0; x < VALUES; x++) {
        v.light += (light[x] - mean) * (light[x] - mean) / VALUES;
        v.camera += (camera[x] - mean) * (camera[x] - mean) / VALUES;
        for (int y = 0; y < VALUES; y++) {
            const double rest = table[x][y] - light[x] - camera[y] + mean;
            v.pair += rest * rest / (VALUES * VALUES);
        }
    }
    return v;
}

static void test_without_bias(void **state)
{
    (void)state;
    static const double merged[VALUES][VALUES] = {{0, 2, 5}, {1, 0, 0.5}, {3, 0, 7}}, alone[VALUES] = {0, 4, 1};
    static const uint32_t sizes[][2] = {{2, 2}, {3, 2}, {2, 3}, {3, 3}, {4, 3}, {3, 4}};
    double table[VALUES][VALUES];
    for (int x = 0; x < VALUES; x++)
        for (int y = 0; y < VALUES; y++) table[x][y] = merged[x][y] + alone[y];
    const ca_pair_covariance expected = parts_of(table);
    ca_pair_covariances c;
    assert_int_equal(ca_pair_covariances_create(&c, NULL), CA_OK);
    for (size_t s = 0; s < sizeof sizes / sizeof sizes[0]; s++) {
        pair_block b = {.light_paths = sizes[s][0], .camera_paths = sizes[s][1]};
        const uint32_t paths = b.light_paths + b.camera_paths;
        ca_pair_covariance mean = {0};
        double outcomes = 1.0;
        for (uint32_t p = 0; p < paths; p++) outcomes *= VALUES;
        for (uint32_t outcome = 0; outcome < (uint32_t)outcomes; outcome++) {
            uint32_t values[2 * MOST], rest = outcome;
            for (uint32_t p = 0; p < paths; p++, rest /= VALUES) values[p] = rest % VALUES;
            for (uint32_t j = 0; j < b.camera_paths; j++) {
                b.alone[j] = alone[values[b.light_paths + j]];
                for (uint32_t i = 0; i < b.light_paths; i++)
                    b.merged[i][j] = merged[values[i]][values[b.light_paths + j]];
            }
            const ca_pair_covariance got = estimated(&c, &b);
            mean.camera += got.camera / outcomes;
            mean.light += got.light / outcomes;
            mean.pair += got.pair / outcomes;
        }
        expect_near(mean.camera, expected.camera, 10.0, "camera");
        expect_near(mean.light, expected.light, 10.0, "light");
        expect_near(mean.pair, expected.pair, 10.0, "pair");
    }
    ca_pair_covariances_destroy(&c);
}

static void test_out_of_memory(void **state)
{
    (void)state;
    ca_pair_covariances c;
    ca_memory_fail_after(0);
    assert_int_equal(ca_pair_covariances_create(&c, NULL), CA_ERROR_MEMORY);
    ca_memory_fail_after(-1);
    ca_pair_covariances_destroy(&c);
    assert_int_equal(ca_pair_covariances_create(&c, NULL), CA_OK);
    ca_pair_covariances_begin(&c, 1u << 20);
    ca_memory_fail_after(0);
    for (int j = 0; j < 2; j++) {
        ca_pair_covariances_next_path(&c);
        for (uint32_t i = 0; i < 10000; i++) ca_pair_covariances_add(&c, i, 1.0);
    }
    ca_memory_fail_after(-1);
    ca_pair_covariance result;
    assert_false(ca_pair_covariances_finish(&c, &result));
    ca_pair_covariances_destroy(&c);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_written_out),
        cmocka_unit_test(test_without_bias),
        cmocka_unit_test(test_out_of_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
