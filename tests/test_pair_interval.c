/* From what blocks tell to the variance of a pixel and its interval: Student's quantile, the design of whole and
 * unfinished rectangles, and what is marked. (That the film's estimate has no bias is shown by test_block_film.c,
 * that intervals hold expectations by test_qmcppm_error_bars.c.) */
#include "film/pair_interval.h"
#include "metrics/significance.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

static void test_student_quantile(void **state)
{
    (void)state;
    for (double degrees = CA_PAIR_MIN_DEGREES; degrees < 1e7; degrees *= 1.1) {
        const double t = ca_pair_student_quantile(degrees);
        assert_true(ca_student_two_sided_p(t * 1.002, degrees) < 0.05);
        assert_true(ca_student_two_sided_p(t * 0.998, degrees) > 0.05);
    }
    assert_true(fabs(ca_pair_student_quantile((double)INFINITY) - 1.959963985) < 1e-9);
}

/* K_B x K_F blocks. */
static ca_pair_design rectangle(double camera_paths, double rows, double light_paths, double columns)
{
    return (ca_pair_design){.camera_paths = camera_paths,
                            .light_paths = light_paths,
                            .blocks = rows * columns,
                            .camera_squares = rows * columns * columns,
                            .light_squares = columns * rows * rows};
}

/* On a rectangle it is the paper's law for all of its paths, in its form with C, B, F and L. */
static void test_rectangles_follow_the_law(void **state)
{
    (void)state;
    const ca_pair_variances v = {.camera = 3.0, .light = 5.0, .pair = 11.0};
    const double square = 7.0, b = v.camera + square, f = v.light + square, c = v.pair + b + f - square;
    for (double rows = 1.0; rows < 5.0; rows++)
        for (double columns = 1.0; columns < 4.0; columns++) {
            const ca_pair_design d = rectangle(2.0, rows, 10.0, columns);
            const double camera_paths = 2.0 * rows, light_paths = 10.0 * columns;
            const double law = (c - square) / (light_paths * camera_paths) +
                               (1.0 - 1.0 / light_paths) * (b - square) / camera_paths +
                               (1.0 - 1.0 / camera_paths) * (f - square) / light_paths;
            assert_true(fabs(ca_pair_value_variance(&d, &v) / law - 1.0) < 1e-14);
        }
}

/* The degrees of freedom in the limits in which one term is all. */
static void test_degrees_of_freedom(void **state)
{
    (void)state;
    const ca_pair_design d = rectangle(4.0, 10.0, 100.0, 5.0);
    ca_moments moments;
    double degrees;
    ca_pair_variances v = {.camera = 0.1, .merged = 1.0};
    assert_true(ca_pair_error(&d, &v, 1.0, &moments, &degrees));
    assert_true(fabs(degrees - 30.0) < 1e-9); /* 10 blocks of 4 camera paths, one lost in each */
    const double n = moments.replicates;
    assert_true(fabs(moments.variance / n - 0.1 / 40.0) < 1e-15 &&
                fabs(moments.third / (n * n) - pow(0.1 / 40.0, 2.0)) < 1e-15);
    /* A tenth of 500 light paths contributes: 50 of them, whose sum of squares is taken to scatter by 2 / 50 of its
     * square. */
    v = (ca_pair_variances){.light = 9.0, .merged = 1.0};
    assert_true(ca_pair_error(&d, &v, 1.0, &moments, &degrees));
    assert_true(fabs(degrees - 50.0) < 1e-9);
    /* The skewness of the mean of 500 numbers, 10 or 0, which is near the one of 50 rare ones. */
    const double skewness = moments.third / pow(moments.variance, 1.5) / sqrt(n);
    assert_true(fabs(skewness * sqrt(50.0) - sqrt(0.9)) < 1e-9);
    /* Only what is brought by light paths tells how many of them. */
    v.merged = 0.1;
    assert_true(ca_pair_error(&d, &v, 1.0, &moments, &degrees) == false);
}

static void test_marks(void **state)
{
    (void)state;
    const ca_pair_design d = rectangle(4.0, 10.0, 100.0, 5.0), few = rectangle(2.0, 2.0, 100.0, 2.0);
    const ca_pair_variances good = {.camera = 0.5, .light = 0.5, .pair = 0.5, .merged = 1.0};
    const ca_pair_variances negative = {.camera = -0.5, .light = 0.5, .pair = 0.5, .merged = 1.0};
    const ca_pair_variances rounding = {.camera = 1e-13, .merged = 1.0},
                            rare_camera = {.camera = 20.0, .merged = 1.0};
    const ca_pair_variances not_a_number = {.camera = (double)NAN, .merged = 1.0};
    ca_moments moments;
    double degrees;
    assert_true(ca_pair_error(&d, &good, 1.0, &moments, &degrees));
    assert_false(ca_pair_error(&d, &negative, 1.0, &moments, &degrees));
    assert_false(ca_pair_error(&d, &rounding, 1.0, &moments, &degrees));
    assert_false(ca_pair_error(&d, &rare_camera, 1.0, &moments, &degrees));
    assert_false(ca_pair_error(&d, &not_a_number, 1.0, &moments, &degrees));
    assert_false(ca_pair_error(&few, &good, 1.0, &moments, &degrees)); /* two degrees for the camera's part */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_student_quantile),
        cmocka_unit_test(test_rectangles_follow_the_law),
        cmocka_unit_test(test_degrees_of_freedom),
        cmocka_unit_test(test_marks),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
