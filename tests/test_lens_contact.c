/* Lenses whose surfaces touch, in a point or everywhere: rays pass as if the two surfaces were one, or a little
 * apart, from both sides; and light still ends where surfaces cross. */
#include "camera/camera.h"
#include "support/double_vec.h"
#include "support/test_random.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#define LENS(...)                                                                                                    \
    {                                                                                                                \
        .surfaces = {__VA_ARGS__}, .count = sizeof((ca_lens_surface[]){__VA_ARGS__}) / sizeof(ca_lens_surface)       \
    }

typedef struct pair {
    const char *name;
    ca_lens touching, other;
    double height, slope; /* rays that are tried: so far from the axis on both sides, and so steep */
} pair;

#define SURFACE(radius, thickness, index, aperture)                                                                  \
    {                                                                                                                \
        radius, thickness, index, aperture                                                                           \
    }
#define STOP(thickness, aperture) SURFACE(0.0, thickness, 1.0, aperture)
#define CROWN SURFACE(61.0, 6.0, 1.517, 12.5)
#define FLINT_BACK SURFACE(-131.0, 1.5, 1.0, 12.5)
#define BALL(thickness, index) SURFACE(50.0, thickness, index, 9.0)
#define BALLS_BACK(thickness) SURFACE(-50.0, thickness, 1.0, 9.0)
#define PLANE(thickness, index) SURFACE(0.0, thickness, index, 9.0)

/* What touches, and the same surfaces as one or 1e-9 mm apart. */
static const pair pairs[] = {
    {"cement", LENS(CROWN, {-45.0, 0.0, 1.56, 12.5}, {-45.0, 2.5, 1.62, 12.5}, FLINT_BACK),
     LENS(CROWN, {-45.0, 2.5, 1.62, 12.5}, FLINT_BACK), 12.5, 0.8},
    {"a film of air", LENS(CROWN, {-45.0, 0.0, 1.0, 12.5}, {-45.0, 2.5, 1.62, 12.5}, FLINT_BACK),
     LENS(CROWN, {-45.0, 2.5, 1.62, 12.5}, FLINT_BACK), 6.0, 0.2},
    {"a stop in front of a plane", LENS(STOP(0.0, 8.0), {0.0, 5.0, 1.5, 12.0}, {-50.0, 0.0, 1.0, 12.0}),
     LENS({0.0, 5.0, 1.5, 8.0}, {-50.0, 0.0, 1.0, 12.0}), 12.0, 0.8},
    {"a stop behind a plane", LENS({50.0, 5.0, 1.5, 12.0}, {0.0, 0.0, 1.0, 12.0}, STOP(0.0, 8.0)),
     LENS({50.0, 5.0, 1.5, 12.0}, {0.0, 0.0, 1.0, 8.0}), 12.0, 0.8},
    {"two stops", LENS(STOP(0.0, 8.0), STOP(0.0, 7.0)), LENS(STOP(0.0, 7.0)), 12.0, 0.8},
    {"two balls' vertices", LENS(BALL(4.0, 1.5), BALLS_BACK(0.0), BALL(4.0, 1.6), BALLS_BACK(0.0)),
     LENS(BALL(4.0, 1.5), BALLS_BACK(1e-9), BALL(4.0, 1.6), BALLS_BACK(0.0)), 9.0, 0.3},
    {"a ball's vertex on a plane", LENS(PLANE(4.0, 1.5), BALLS_BACK(0.0), PLANE(4.0, 1.6), PLANE(0.0, 1.0)),
     LENS(PLANE(4.0, 1.5), BALLS_BACK(1e-9), PLANE(4.0, 1.6), PLANE(0.0, 1.0)), 9.0, 0.3},
};

static double uniform(ca_test_random *random, double low, double high)
{
    return low + (high - low) * ca_test_random_open(random);
}

static ca_lens_ray ray_from(double x, double y, double w, double_vec slopes)
{
    const double_vec d = dv_unit(slopes);
    return (ca_lens_ray){x, y, w, d.x, d.y, d.z};
}

/* Both let the ray pass, at the same place in the same direction, or neither. */
static bool expect_same(const char *name, const ca_lens *touching, const ca_lens *other, ca_lens_ray start)
{
    ca_lens_ray a = start, b = start;
    const bool passes = ca_lens_trace(touching, &a);
    if (ca_lens_trace(other, &b) != passes)
        fail_msg("%s: the ray from (%.17g, %.17g, %.17g) along (%.17g, %.17g, %.17g) %s", name, start.x, start.y,
                 start.w, start.dx, start.dy, start.dw, passes ? "passes" : "is absorbed");
    if (passes && !(hypot(hypot(a.x - b.x, a.y - b.y), a.w - b.w) < 5e-9 && hypot(a.dx - b.dx, a.dy - b.dy) < 1e-9))
        fail_msg("%s: rays part by %g mm", name, hypot(hypot(a.x - b.x, a.y - b.y), a.w - b.w));
    return passes;
}

/* On the axis, next to it, and anywhere. */
static void test_pairs(void **state)
{
    (void)state;
    ca_test_random random = ca_test_random_seed(1);
    for (size_t k = 0; k < sizeof pairs / sizeof *pairs; k++) {
        const pair *p = &pairs[k];
        uint32_t passed = 0, rays = 20000;
        for (uint32_t i = 0; i < rays; i++) {
            const double side = i % 2 == 0 ? 1.0 : -1.0;
            const double close = pow(10.0, -(double)(i / 2 % 12)), h = close * p->height, s = close * p->slope;
            const double x = uniform(&random, -h, h), y = uniform(&random, -h, h);
            const double_vec slopes = {uniform(&random, -s, s), uniform(&random, -s, s), side};
            const double back = side > 0.0 ? 0.0 : ca_lens_length(&p->touching), away = back - 10.0 * side;
            const ca_lens_ray ray = ray_from(x - 10.0 * slopes.x, y - 10.0 * slopes.y, away, slopes);
            passed += expect_same(p->name, &p->touching, &p->other, ray);
            const ca_lens_ray axis = {.w = away, .dw = side};
            assert_true(expect_same(p->name, &p->touching, &p->other, axis));
        }
        print_message("           %s: %u of %u rays pass\n", p->name, passed, rays);
        assert_true(passed > rays / 4);
    }
}

/* A surface that is there twice, of any size, anywhere, met from any direction. */
static void test_twice_the_same(void **state)
{
    (void)state;
    ca_test_random random = ca_test_random_seed(2);
    uint32_t passed = 0, rays = 200000;
    for (uint32_t i = 0; i < rays; i++) {
        const double radius = (i & 2 ? 1.0 : -1.0) * pow(10.0, uniform(&random, -1.0, 6.0));
        const double aperture = uniform(&random, 0.01, 1.0) * fmin(fabs(radius), 100.0);
        const double offset = pow(10.0, uniform(&random, -2.0, 4.0)), index = uniform(&random, 1.0, 2.0);
        const ca_lens_surface window = {0.0, offset, 1.0, 1e9}, back = {0.0, 0.0, 1.0, 1e9};
        const ca_lens_surface once = {radius, 1e3, index, aperture}, twice = {radius, 0.0, index, aperture};
        const ca_lens touching = {.surfaces = {window, twice, once, back}, .count = 4};
        const ca_lens other = {.surfaces = {window, once, back}, .count = 3};
        const double side = i & 1 ? 1.0 : -1.0, s = pow(10.0, uniform(&random, -3.0, 1.0));
        const double start = side > 0.0 ? -1.0 : ca_lens_length(&other) + 1.0, to = offset - start;
        const double_vec slopes = {uniform(&random, -s, s), uniform(&random, -s, s), side};
        const double x = uniform(&random, -aperture, aperture), y = uniform(&random, -aperture, aperture);
        const ca_lens_ray ray = ray_from(x - side * to * slopes.x, y - side * to * slopes.y, start, slopes);
        passed += expect_same("the same twice", &touching, &other, ray);
    }
    print_message("           %u of %u rays pass\n", passed, rays);
    assert_true(passed > rays / 10);
}

/* Where the surfaces cross by more than rounding does, light ends: at the rim of glass as thin as an edge. */
static void test_crossing(void **state)
{
    (void)state;
    const ca_lens lens = {.surfaces = {{30.0, 2.0, 1.5, 14.0}, {-30.0, 0.0, 1.0, 14.0}}, .count = 2};
    const double edge = sqrt(900.0 - 29.0 * 29.0);
    for (double step = 1e-11; step < 1.0; step *= 10.0)
        for (int side = -1; side <= 1; side += 2) {
            ca_lens_ray inside = {.x = edge - step, .w = 1.0 - side * 9.0, .dw = side};
            ca_lens_ray outside = {.x = edge + step, .w = 1.0 - side * 9.0, .dw = side};
            assert_true(ca_lens_trace(&lens, &inside));
            assert_false(ca_lens_trace(&lens, &outside));
        }
    /* A stop at the vertex of a surface that bends away from it, and of one that stands out through it. */
    const ca_lens apart = LENS(PLANE(4.0, 1.5), SURFACE(-30.0, 0.0, 1.0, 9.0), STOP(0.0, 9.0));
    const ca_lens through = LENS(PLANE(4.0, 1.5), SURFACE(30.0, 0.0, 1.0, 9.0), STOP(0.0, 9.0));
    for (double height = 0.0; height < 8.0; height += 0.5)
        for (int side = -1; side <= 1; side += 2) {
            ca_lens_ray ray = {.x = height, .w = 4.0 - side * 9.0, .dw = side}, other = ray;
            assert_true(ca_lens_trace(&apart, &ray));
            assert_int_equal(ca_lens_trace(&through, &other), height == 0.0);
        }
}

static ca_camera make_camera(const ca_lens *lens)
{
    ca_camera camera = {.kind = CA_CAMERA_REALISTIC,
                        .width = 12,
                        .height = 8,
                        .near_clip = 0.01f,
                        .far_clip = 1000.0f,
                        .as.realistic = {.lens = *lens,
                                         .film_distance = ca_lens_image_of(lens, 3000.0).distance,
                                         .film_diagonal = 30.0,
                                         .scale = 1e-3}};
    const ca_matrix identity = ca_matrix_identity();
    assert_true(ca_affine_from_matrix(&identity, &camera.map));
    ca_camera_prepare(&camera);
    return camera;
}

/* What the camera makes of it: rays of the same weight that go the same way. */
static void test_cameras(void **state)
{
    (void)state;
    ca_test_random random = ca_test_random_seed(3);
    for (size_t k = 0; k < sizeof pairs / sizeof *pairs; k++) {
        if (!isfinite(ca_lens_focal_length(&pairs[k].other))) continue;
        const ca_camera touching = make_camera(&pairs[k].touching), other = make_camera(&pairs[k].other);
        uint32_t bright = 0, rays = 2000;
        for (uint32_t i = 0; i < rays; i++) {
            const ca_vec2 film = {12.0f * ca_test_random_float(&random), 8.0f * ca_test_random_float(&random)};
            const ca_vec2 u = {ca_test_random_float(&random), ca_test_random_float(&random)};
            const ca_camera_ray a = ca_camera_sample_ray(&touching, film, u);
            const ca_camera_ray b = ca_camera_sample_ray(&other, film, u);
            if (!(a.weight.r > 0.0f) || !(b.weight.r > 0.0f)) {
                /* Rims, and the air between two kinds of glass, which reflects steep rays. */
                bright += (a.weight.r > 0.0f) != (b.weight.r > 0.0f) ? rays : 0;
                continue;
            }
            bright++;
            assert_true(fabsf(a.weight.r / b.weight.r - 1.0f) < 1e-5f);
            /* The planes that rays begin on may be others. */
            const float ta = (1.0f - a.origin.z) / a.direction.z, tb = (1.0f - b.origin.z) / b.direction.z;
            const ca_vec3 at = ca_madd(a.origin, ta, a.direction), there = ca_madd(b.origin, tb, b.direction);
            assert_true(ca_length(ca_sub(at, there)) < 1e-6f);
            assert_true(ca_length(ca_sub(a.direction, b.direction)) < 1e-6f);
        }
        print_message("           %s: %u of %u rays are bright\n", pairs[k].name, bright, rays);
        assert_true(bright > rays / 4 && bright <= rays);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_pairs),
        cmocka_unit_test(test_twice_the_same),
        cmocka_unit_test(test_crossing),
        cmocka_unit_test(test_cameras),
    };
    return cmocka_run_group_tests_name("lenses in contact", tests, NULL, NULL);
}
