/* Matrices, frames and measures against what they are by definition. */
#include "math/arc_tangent.h"
#include "math/frame.h"
#include "math/measure.h"
#include "math/transform.h"
#include "support/test_random.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

static void assert_near(double got, double expected, double tolerance)
{
    if (!(fabs(got - expected) <= tolerance)) fail_msg("%.12g instead of %.12g", got, expected);
}

static void assert_point(const ca_matrix *m, const double p[3], double x, double y, double z)
{
    double mapped[3];
    ca_matrix_point(m, p, mapped);
    assert_near(mapped[0], x, 1e-12);
    assert_near(mapped[1], y, 1e-12);
    assert_near(mapped[2], z, 1e-12);
}

/* ---- Matrices -------------------------------------------------------------------------------------------------- */

/* A quarter turn to the left around each axis, and a third of a turn around the diagonal. */
static void test_rotations(void **state)
{
    (void)state;
    const double p[3] = {1.0, 2.0, 3.0};
    ca_matrix m = ca_matrix_rotate(2.0, 0.0, 0.0, 90.0);
    assert_point(&m, p, 1.0, -3.0, 2.0);
    m = ca_matrix_rotate(0.0, 0.5, 0.0, 90.0);
    assert_point(&m, p, 3.0, 2.0, -1.0);
    m = ca_matrix_rotate(0.0, 0.0, 1.0, 90.0);
    assert_point(&m, p, -2.0, 1.0, 3.0);
    m = ca_matrix_rotate(1.0, 1.0, 1.0, 120.0);
    assert_point(&m, p, 3.0, 1.0, 2.0);
    m = ca_matrix_rotate(1.0, -2.0, 3.0, 37.0);
    assert_near(ca_matrix_determinant3(&m), 1.0, 1e-12);
    assert_point(&m, (const double[3]){2.0, -4.0, 6.0}, 2.0, -4.0, 6.0); /* the axis */
}

/* The one on the right first. */
static void test_products(void **state)
{
    (void)state;
    const ca_matrix move = ca_matrix_translate(10.0, 20.0, 30.0), scale = ca_matrix_scale(2.0, 3.0, 4.0);
    const double p[3] = {1.0, 1.0, 1.0};
    ca_matrix m = ca_matrix_multiply(&move, &scale);
    assert_point(&m, p, 12.0, 23.0, 34.0);
    assert_near(ca_matrix_determinant3(&m), 24.0, 1e-12);
    m = ca_matrix_multiply(&scale, &move);
    assert_point(&m, p, 22.0, 63.0, 124.0);
}

/* +x of the camera is to the left of the picture. */
static void test_look_at(void **state)
{
    (void)state;
    const double origin[3] = {1.0, 2.0, 3.0}, target[3] = {1.0, 2.0, -7.0}, up[3] = {0.0, 5.0, 1.0};
    ca_matrix m;
    assert_true(ca_matrix_look_at(origin, target, up, &m));
    assert_point(&m, (const double[3]){0.0, 0.0, 0.0}, 1.0, 2.0, 3.0);
    assert_point(&m, (const double[3]){0.0, 0.0, 2.0}, 1.0, 2.0, 1.0);
    assert_point(&m, (const double[3]){0.0, 1.0, 0.0}, 1.0, 3.0, 3.0);
    assert_point(&m, (const double[3]){1.0, 0.0, 0.0}, 0.0, 2.0, 3.0);
    assert_false(ca_matrix_look_at(origin, origin, up, &m));
    assert_false(ca_matrix_look_at(origin, target, (const double[3]){0.0, 0.0, 3.0}, &m));
}

static void assert_inverse(const ca_matrix *m, const ca_matrix *inverse, double tolerance)
{
    const ca_matrix product = ca_matrix_multiply(m, inverse);
    for (int row = 0; row < 4; row++)
        for (int column = 0; column < 4; column++)
            assert_near(product.m[row][column], row == column ? 1.0 : 0.0, tolerance);
}

/* Rows have to change places, for numbers of either sign, or digits are lost. */
static void test_inverses(void **state)
{
    (void)state;
    ca_test_random random = ca_test_random_seed(1);
    ca_matrix m, inverse;
    for (int i = 0; i < 1000; i++) {
        for (int row = 0; row < 4; row++)
            for (int column = 0; column < 4; column++)
                m.m[row][column] = 2.0 * (double)ca_test_random_float(&random) - 1.0;
        m.m[0][0] = 1e-14;
        m.m[1][0] = -1.0;
        m.m[2][0] = 1e-3;
        assert_true(ca_matrix_invert(&m, &inverse));
        double largest = 1.0;
        for (int k = 0; k < 16; k++) largest = fmax(largest, fabs(inverse.m[k / 4][k % 4]));
        assert_inverse(&m, &inverse, 1e-14 * largest * largest);
    }
    m = ca_matrix_scale(1.0, 0.0, 1.0);
    assert_false(ca_matrix_invert(&m, &inverse));
}

/* Points and directions there and back, normals by the inverse. */
static void test_affine_maps(void **state)
{
    (void)state;
    const ca_matrix scale = ca_matrix_scale(1.0, 2.0, 4.0), move = ca_matrix_translate(3.0, 0.0, 0.0);
    const ca_matrix m = ca_matrix_multiply(&move, &scale);
    ca_affine map;
    assert_true(ca_affine_from_matrix(&m, &map));
    const ca_affine *a = &map;
    const ca_vec3 p = ca_map_point(a->to, (ca_vec3){1.0f, 1.0f, 1.0f}), back = ca_map_point(a->from, p);
    assert_true(p.x == 4.0f && p.y == 2.0f && p.z == 4.0f && back.x == 1.0f && back.y == 1.0f && back.z == 1.0f);
    const ca_vec3 v = ca_map_vector(a->to, (ca_vec3){1.0f, 1.0f, 1.0f});
    assert_true(v.x == 1.0f && v.y == 2.0f && v.z == 4.0f);
    const ca_vec3 n = ca_map_normal(a->from, (ca_vec3){1.0f, 1.0f, 1.0f});
    assert_true(n.x == 1.0f && n.y == 0.5f && n.z == 0.25f);
    ca_matrix projective = m;
    projective.m[3][2] = 1.0;
    assert_false(ca_affine_from_matrix(&projective, &map));
}

/* ---- Frames ---------------------------------------------------------------------------------------------------- */

static ca_vec3 random_direction(ca_test_random *random)
{
    for (;;) {
        const ca_vec3 v = {2.0f * ca_test_random_float(random) - 1.0f, 2.0f * ca_test_random_float(random) - 1.0f,
                           2.0f * ca_test_random_float(random) - 1.0f};
        if (ca_length2(v) > 0.01f && ca_length2(v) <= 1.0f) return ca_normalize(v);
    }
}

static void assert_frame(const ca_frame *f, ca_vec3 n)
{
    assert_true(f->n.x == n.x && f->n.y == n.y && f->n.z == n.z);
    assert_near((double)ca_length(f->s), 1.0, 1e-6);
    assert_near((double)ca_length(f->t), 1.0, 1e-6);
    assert_near((double)ca_dot(f->s, f->t), 0.0, 1e-6);
    assert_near((double)ca_dot(f->s, n), 0.0, 1e-6);
    assert_near((double)ca_dot(f->t, n), 0.0, 1e-6);
    assert_near((double)ca_dot(ca_cross(f->s, f->t), n), 1.0, 1e-6); /* right-handed */
}

static void test_frames(void **state)
{
    (void)state;
    ca_test_random random = ca_test_random_seed(2);
    for (int i = 0; i < 10000; i++) {
        ca_vec3 n = random_direction(&random);
        const ca_vec3 w = random_direction(&random), tangent = ca_mul(random_direction(&random), 3.0f);
        if (i == 0) n = (ca_vec3){0.0f, 0.0f, -1.0f};
        const ca_frame frame = ca_frame_from_normal(n);
        assert_frame(&frame, n);
        const ca_vec3 back = ca_to_world(&frame, ca_to_local(&frame, w));
        assert_near((double)ca_length(ca_sub(back, w)), 0.0, 1e-6);
        if (fabsf(ca_dot(n, tangent)) > 2.9f) continue;
        const ca_frame along = ca_frame_from_tangent(n, tangent);
        assert_frame(&along, n);
        assert_near((double)ca_dot(along.t, tangent), 0.0, 1e-5); /* s, n and the tangent lie in one plane */
        assert_true(ca_dot(along.s, tangent) > 0.0f);
    }
    const ca_vec3 up = {0.0f, 0.0f, 1.0f};
    const ca_frame none = ca_frame_from_tangent(up, (ca_vec3){0}), parallel = ca_frame_from_tangent(up, up);
    assert_frame(&none, up);
    assert_frame(&parallel, up);
}

/* ---- Numbers --------------------------------------------------------------------------------------------------- */

/* 3 m away at 60 degrees: p_A = p_W / 18. */
static void test_measures(void **state)
{
    (void)state;
    assert_near((double)ca_pdf_to_area((ca_pdf_solid_angle){36.0f}, 0.5f, 9.0f).v, 2.0, 1e-6);
    assert_near((double)ca_pdf_to_solid_angle((ca_pdf_area){2.0f}, 0.5f, 9.0f).v, 36.0, 1e-5);
    assert_true(ca_pdf_to_solid_angle((ca_pdf_area){2.0f}, 0.0f, 9.0f).v == 0.0f);
}

static void test_neighbours(void **state)
{
    (void)state;
    static const float values[] = {0.0f, 1.0f, -1.0f, 0x1p-149f, -0x1p-149f, 1e30f, -2.5f};
    for (size_t i = 0; i < sizeof values / sizeof values[0]; i++) {
        assert_true(ca_next_up(values[i]) == nextafterf(values[i], INFINITY));
        assert_true(ca_next_down(values[i]) == nextafterf(values[i], -INFINITY));
    }
}

/* Angles all around, of points near and far, and on the axes. */
static void test_arc_tangent(void **state)
{
    (void)state;
    ca_test_random random = ca_test_random_seed(9);
    double worst = 0.0;
    for (int i = 0; i < 1000000; i++) {
        const float x = 2.0f * ca_test_random_float(&random) - 1.0f, y = 2.0f * ca_test_random_float(&random) - 1.0f;
        const float far = ldexpf(1.0f, (int)(ca_test_random_u32(&random) % 100) - 50);
        const float thin = ldexpf(1.0f, -(int)(ca_test_random_u32(&random) % 20));
        const double exact = atan2((double)(y * thin * far), (double)(x * far));
        worst = fmax(worst, fabs((double)ca_atan2(y * thin * far, x * far) / exact - 1.0));
    }
    print_message("largest relative error %.3g\n", worst);
    assert_true(worst < 3e-7);
    static const float axis[][2] = {{0.0f, 0.0f}, {-0.0f, 0.0f},  {0.0f, -0.0f}, {-0.0f, -0.0f}, {0.0f, 3.0f},
                                    {3.0f, 0.0f}, {-3.0f, -0.0f}, {0.0f, -3.0f}, {-0.0f, -3.0f}};
    for (size_t i = 0; i < sizeof axis / sizeof axis[0]; i++) {
        const float got = ca_atan2(axis[i][0], axis[i][1]), expected = atan2f(axis[i][0], axis[i][1]);
        assert_true(got == expected && signbit(got) == signbit(expected));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rotations), cmocka_unit_test(test_products),    cmocka_unit_test(test_look_at),
        cmocka_unit_test(test_inverses),  cmocka_unit_test(test_affine_maps), cmocka_unit_test(test_frames),
        cmocka_unit_test(test_measures),  cmocka_unit_test(test_neighbours),
        cmocka_unit_test(test_arc_tangent),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
