/* Kernels: each integrates to one over its disk and has the roughness it claims; the smooth ones vanish at the rim
 * and have the gradient it claims, whose integral is zero. */
#include "math/numeric.h"
#include "photon/kernel.h"
#include "support/test_random.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

static const char *const names[CA_KERNEL_COUNT] = {"disk", "epanechnikov", "sph"};

/* The midpoint rule over the unit disk: dA = pi dt. */
static double disk_integral(ca_kernel kernel, int power)
{
    const int steps = 200000;
    double sum = 0.0;
    for (int i = 0; i < steps; i++) sum += pow((double)ca_kernel_value(kernel, (float)((i + 0.5) / steps)), power);
    return CA_PI_D * sum / steps;
}

static void test_integral_is_one(void **state)
{
    (void)state;
    for (ca_kernel kernel = 0; kernel < CA_KERNEL_COUNT; kernel++) {
        const double integral = disk_integral(kernel, 1);
        if (!(fabs(integral - 1.0) < 1e-6)) fail_msg("%s integrates to %.9f", names[kernel], integral);
    }
}

static void test_roughness(void **state)
{
    (void)state;
    for (ca_kernel kernel = 0; kernel < CA_KERNEL_COUNT; kernel++) {
        const double expected = disk_integral(kernel, 2), roughness = (double)ca_kernel_roughness(kernel);
        if (!(fabs(roughness / expected - 1.0) < 1e-6))
            fail_msg("%s has roughness %.9f, not %.9f", names[kernel], expected, roughness);
    }
}

/* Values by hand: at the middle, halfway, and where the spline's pieces meet (t = 1/4). */
static void test_values(void **state)
{
    (void)state;
    const double sph = 40.0 / (7.0 * CA_PI_D);
    static const float at[] = {0.0f, 0.0625f, 0.25f, 0.5625f};
    const double expected[CA_KERNEL_COUNT][4] = {
        {1.0 / CA_PI_D, 1.0 / CA_PI_D, 1.0 / CA_PI_D, 1.0 / CA_PI_D},
        {2.0 / CA_PI_D, 1.875 / CA_PI_D, 1.5 / CA_PI_D, 0.875 / CA_PI_D},
        {sph, sph * (1.0 - 0.375 + 0.09375), sph * 0.25, sph * 0.03125},
    };
    for (ca_kernel kernel = 0; kernel < CA_KERNEL_COUNT; kernel++)
        for (int i = 0; i < 4; i++)
            assert_true(fabs((double)ca_kernel_value(kernel, at[i]) / expected[kernel][i] - 1.0) < 1e-6);
}

static void test_rim(void **state)
{
    (void)state;
    for (ca_kernel kernel = 0; kernel < CA_KERNEL_COUNT; kernel++) {
        assert_true(ca_kernel_value(kernel, ca_next_up(1.0f)) == 0.0f);
        assert_true(ca_kernel_value(kernel, INFINITY) == 0.0f);
        assert_true(ca_kernel_value(kernel, NAN) == 0.0f);
        if (!ca_kernel_is_smooth(kernel)) continue;
        assert_true(ca_kernel_value(kernel, 1.0f) == 0.0f);
        assert_true(ca_kernel_value(kernel, 0.9999f) < 1e-4f);
        assert_true(ca_kernel_value(kernel, 0.9999f) > 0.0f);
        /* and the spline's pieces meet */
        const float below = ca_kernel_value(kernel, ca_next_down(0.25f)), above = ca_kernel_value(kernel, 0.25f);
        assert_true(fabsf(below - above) < 1e-6f);
    }
    assert_true(ca_kernel_value(CA_KERNEL_DISK, 1.0f) == CA_INV_PI);
    assert_true(!ca_kernel_is_smooth(CA_KERNEL_DISK));
}

/* The estimate of a query point, in double precision but for k(t) itself. */
static double estimate(ca_kernel kernel, const double offset[3], double radius)
{
    const double t = (offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2]) / (radius * radius);
    return (double)ca_kernel_value(kernel, (float)t) / (radius * radius);
}

static void check_gradient(ca_kernel kernel, ca_vec3 offset, float radius)
{
    const double step = 2e-3 * (double)radius;
    const ca_vec3 gradient = ca_kernel_gradient(kernel, offset, radius);
    const float claimed[3] = {gradient.x, gradient.y, gradient.z};
    for (int axis = 0; axis < 3; axis++) {
        double after[3] = {(double)offset.x, (double)offset.y, (double)offset.z};
        double before[3] = {after[0], after[1], after[2]};
        after[axis] -= step; /* the query moves on, so the offset to the photon shrinks */
        before[axis] += step;
        const double difference = estimate(kernel, after, (double)radius) - estimate(kernel, before, (double)radius);
        const double slope = difference / (2.0 * step);
        const double scale = pow((double)radius, -3.0);
        if (!(fabs((double)claimed[axis] - slope) < 1e-3 * scale))
            fail_msg("%s: the gradient along axis %d is %g, not %g", names[kernel], axis, slope,
                     (double)claimed[axis]);
    }
}

static void test_gradient(void **state)
{
    (void)state;
    ca_test_random random = ca_test_random_seed(5);
    for (ca_kernel kernel = CA_KERNEL_EPANECHNIKOV; kernel < CA_KERNEL_COUNT; kernel++)
        for (int i = 0; i < 3000; i++) {
            const float radius = i % 3 == 0 ? 1.0f : i % 3 == 1 ? 0.02f : 35.0f;
            const float x = ca_test_random_float(&random), y = ca_test_random_float(&random);
            const ca_vec3 offset = {2.0f * x - 1.0f, 2.0f * y - 1.0f, 2.0f * ca_test_random_float(&random) - 1.0f};
            if (ca_length2(offset) < 0.98f) check_gradient(kernel, ca_mul(offset, radius), radius);
        }
    for (ca_kernel kernel = 0; kernel < CA_KERNEL_COUNT; kernel++) {
        const ca_vec3 center = ca_kernel_gradient(kernel, (ca_vec3){0, 0, 0}, 0.1f);
        const ca_vec3 beyond = ca_kernel_gradient(kernel, (ca_vec3){0.1f, 0, 0.001f}, 0.1f);
        assert_true(ca_length2(center) == 0.0f && ca_length2(beyond) == 0.0f);
    }
    const ca_vec3 of_disk = ca_kernel_gradient(CA_KERNEL_DISK, (ca_vec3){0.05f, 0.02f, 0}, 0.1f);
    assert_true(ca_length2(of_disk) == 0.0f);
}

/* Photons of constant density have no gradient: its integral over the disk vanishes; of a density that grows along x
 * it is the density's slope. */
static void test_gradient_integrals(void **state)
{
    (void)state;
    const float radius = 0.3f;
    const int steps = 1000;
    for (ca_kernel kernel = CA_KERNEL_EPANECHNIKOV; kernel < CA_KERNEL_COUNT; kernel++) {
        double constant[2] = {0.0, 0.0}, growing = 0.0;
        const double area = 4.0 * (double)radius * (double)radius / steps / steps;
        for (int y = 0; y < steps; y++)
            for (int x = 0; x < steps; x++) {
                const ca_vec3 offset = {((2.0f * (float)x + 1.0f) / (float)steps - 1.0f) * radius,
                                        ((2.0f * (float)y + 1.0f) / (float)steps - 1.0f) * radius, 0.0f};
                const ca_vec3 gradient = ca_kernel_gradient(kernel, offset, radius);
                constant[0] += area * (double)gradient.x;
                constant[1] += area * (double)gradient.y;
                growing += area * (double)gradient.x * (double)(5.0f * offset.x);
            }
        assert_true(fabs(constant[0]) < 1e-5 && fabs(constant[1]) < 1e-5);
        if (!(fabs(growing - 5.0) < 2e-3)) fail_msg("%s: slope %g instead of 5", names[kernel], growing);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_integral_is_one),
        cmocka_unit_test(test_roughness),
        cmocka_unit_test(test_values),
        cmocka_unit_test(test_rim),
        cmocka_unit_test(test_gradient),
        cmocka_unit_test(test_gradient_integrals),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
