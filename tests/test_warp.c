/* Warps: each has the density it claims, keeps to its domain at the corners of the unit square, and sin and cos are
 * right. */
#include "sampling/warp.h"
#include "support/chi_square.h"
#include "support/test_random.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>

#include <cmocka.h>

static void test_sincos(void **state)
{
    (void)state;
    double worst = 0.0, worst_relative = 0.0;
    for (int i = -2000000; i <= 2000000; i++) {
        const float angle = (float)i * 1e-5f;
        float s, c;
        ca_sincos(angle, &s, &c);
        worst = fmax(worst, fmax(fabs((double)s - sin((double)angle)), fabs((double)c - cos((double)angle))));
        if (i != 0 && abs(i) < 78000)
            worst_relative = fmax(worst_relative, fabs((double)s / sin((double)angle) - 1.0));
    }
    print_message("           largest error %.3g, relative near 0 %.3g\n", worst, worst_relative);
    assert_true(worst < 8e-8);
    assert_true(worst_relative < 1.3e-7);

    float s, c;
    ca_sincos(0.0f, &s, &c);
    assert_true(s == 0.0f && c == 1.0f);
}

/* ---- Densities ------------------------------------------------------------------------------------------------- */

static bool draw_cosine(const void *context, const float u[3], ca_vec3 *direction)
{
    (void)context;
    *direction = ca_warp_cosine_hemisphere((ca_vec2){u[0], u[1]});
    return true;
}
static float cosine_density(const void *context, ca_vec3 direction)
{
    (void)context;
    return ca_warp_cosine_hemisphere_pdf(direction.z).v;
}

static bool draw_sphere(const void *context, const float u[3], ca_vec3 *direction)
{
    (void)context;
    *direction = ca_warp_sphere((ca_vec2){u[0], u[1]});
    return true;
}
static float sphere_density(const void *context, ca_vec3 direction)
{
    (void)context;
    (void)direction;
    return CA_INV_FOUR_PI;
}

static bool draw_cone(const void *context, const float u[3], ca_vec3 *direction)
{
    *direction = ca_warp_cone((ca_vec2){u[0], u[1]}, *(const float *)context);
    return true;
}
static float cone_density(const void *context, ca_vec3 direction)
{
    const float one_minus_cos_max = *(const float *)context;
    return 1.0f - direction.z <= one_minus_cos_max ? ca_warp_cone_pdf(one_minus_cos_max).v : 0.0f;
}

static void test_directions(void **state)
{
    (void)state;
    static const float wide = 1.7f, narrow = 0.01f;
    enum { TESTS = 4 };
    ca_chi_square_assert(&(ca_chi_square_test){
        .name = "cosine hemisphere", .sample = draw_cosine, .pdf = cosine_density, .test_count = TESTS});
    ca_chi_square_assert(
        &(ca_chi_square_test){.name = "sphere", .sample = draw_sphere, .pdf = sphere_density, .test_count = TESTS});
    ca_chi_square_assert(&(ca_chi_square_test){
        .name = "wide cone", .sample = draw_cone, .pdf = cone_density, .context = &wide, .test_count = TESTS});
    ca_chi_square_assert(&(ca_chi_square_test){
        .name = "narrow cone", .sample = draw_cone, .pdf = cone_density, .context = &narrow, .test_count = TESTS});
}

/* A cone so narrow that 1 - cos has no digits in single precision: the angles are spread evenly all the same. */
static void test_tiny_cone(void **state)
{
    (void)state;
    const float angle = 1e-6f, one_minus_cos_max = 0.5f * angle * angle;
    double sum = 0.0;
    ca_test_random random = ca_test_random_seed(3);
    for (int i = 0; i < 10000; i++) {
        const ca_vec2 u = {ca_test_random_float(&random), ca_test_random_float(&random)};
        const ca_vec3 d = ca_warp_cone(u, one_minus_cos_max);
        const double theta2 = (double)d.x * (double)d.x + (double)d.y * (double)d.y;
        assert_true(theta2 <= 1.00001 * (double)angle * (double)angle);
        sum += theta2 / ((double)angle * (double)angle);
    }
    assert_true(fabs(sum / 10000 - 0.5) < 0.02);
}

/* Counts of points of a plane figure over a grid of cells that have equal area in polar or barycentric
 * coordinates. */
static void check_counts(const double *observed, uint32_t cells, double total, const char *what)
{
    double *expected = malloc(cells * sizeof *expected);
    for (uint32_t i = 0; i < cells; i++) expected[i] = total / cells;
    const double p = ca_chi_square_counts(observed, expected, cells, NULL, NULL);
    free(expected);
    if (p < ca_sidak_level(0.01, 2)) fail_msg("%s: p = %g", what, p);
}

enum { POINTS = 200000, SIDE = 16 };

static void test_disk(void **state)
{
    (void)state;
    double observed[SIDE * SIDE] = {0};
    ca_test_random random = ca_test_random_seed(1);
    for (int i = 0; i < POINTS; i++) {
        const ca_vec2 d = ca_warp_disk((ca_vec2){ca_test_random_float(&random), ca_test_random_float(&random)});
        const float r2 = d.x * d.x + d.y * d.y, turn = atan2f(d.y, d.x) * CA_INV_TWO_PI + 0.5f;
        assert_true(r2 <= 1.0f + 2e-7f);
        observed[ca_min_u32((uint32_t)(r2 * SIDE), SIDE - 1) * SIDE +
                 ca_min_u32((uint32_t)(turn * SIDE), SIDE - 1)]++;
    }
    check_counts(observed, SIDE * SIDE, POINTS, "disk");
}

/* (b0, b1) of the unit triangle: the strip between two values of sqrt(1 - b2) with an equal share of area. */
static void test_triangle(void **state)
{
    (void)state;
    double observed[SIDE * SIDE] = {0};
    ca_test_random random = ca_test_random_seed(2);
    for (int i = 0; i < POINTS; i++) {
        const ca_vec2 b = ca_warp_triangle((ca_vec2){ca_test_random_float(&random), ca_test_random_float(&random)});
        assert_true(b.x >= 0.0f && b.y >= 0.0f && b.x + b.y <= 1.0f);
        const float rest = 1.0f - b.y; /* b0 + b1 */
        const float area = rest * rest, along = rest > 0.0f ? b.x / rest : 0.0f;
        observed[ca_min_u32((uint32_t)(area * SIDE), SIDE - 1) * SIDE +
                 ca_min_u32((uint32_t)(along * SIDE), SIDE - 1)]++;
    }
    check_counts(observed, SIDE * SIDE, POINTS, "triangle");
}

/* The ends of the unit square give unit directions above the horizon and points of the disk. */
static void test_corners(void **state)
{
    (void)state;
    static const float ends[] = {0.0f, 0x1p-24f, 0.25f, 0.5f, 0.75f, CA_ONE_MINUS_EPSILON};
    for (int i = 0; i < 6; i++)
        for (int j = 0; j < 6; j++) {
            const ca_vec2 u = {ends[i], ends[j]};
            const ca_vec3 directions[] = {ca_warp_cosine_hemisphere(u), ca_warp_sphere(u), ca_warp_cone(u, 0.3f),
                                          ca_warp_cone(u, 2.0f)};
            for (int k = 0; k < 4; k++) assert_true(fabsf(ca_length(directions[k]) - 1.0f) < 3e-7f);
            assert_true(directions[0].z > 0.0f);
            const ca_vec2 disk = ca_warp_disk(u);
            assert_true(disk.x * disk.x + disk.y * disk.y <= 1.0f + 2e-7f);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sincos), cmocka_unit_test(test_directions), cmocka_unit_test(test_tiny_cone),
        cmocka_unit_test(test_disk),   cmocka_unit_test(test_triangle),   cmocka_unit_test(test_corners),
    };
    return cmocka_run_group_tests_name("warp", tests, NULL, NULL);
}
