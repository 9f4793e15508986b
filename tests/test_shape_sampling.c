/* Points of shapes: on the shape, uniform by area, with the densities they claim as seen from anywhere, for spheres
 * however tiny, far or near; and bounds. */
#include "math/numeric.h"
#include "support/chi_square.h"
#include "support/light_fixture.h"
#include "support/test_random.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

static ca_light_fixture fixture;

static int set_up(void **state)
{
    (void)state;
    ca_light_fixture_create(&fixture);
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    ca_light_fixture_destroy(&fixture);
    return 0;
}

static ca_vec2 random2(ca_test_random *random)
{
    const float x = ca_test_random_float(random);
    return (ca_vec2){x, ca_test_random_float(random)};
}

static ca_vec3 direction_between(ca_vec3 from, ca_vec3 to) { return ca_normalize(ca_sub(to, from)); }

/* ---- Densities ------------------------------------------------------------------------------------------------- */

typedef struct view {
    int shape;
    ca_vec3 reference;
} view;

static bool draw_area(const void *context, const float u[3], ca_vec3 *direction)
{
    const view *v = context;
    ca_surface surface;
    ca_shape_sample_area(&fixture.shapes[v->shape], (ca_vec2){u[0], u[1]}, &surface);
    *direction = direction_between(v->reference, surface.position);
    return true;
}

/* All points of the shape in a direction count: near and far side. */
static float area_density(const void *context, ca_vec3 direction)
{
    const view *v = context;
    const ca_pdf_area density = {1.0f / fixture.shapes[v->shape].area};
    float sum = 0.0f, t = 0.0f;
    ca_surface surface;
    while (ca_light_fixture_trace(&fixture, v->shape, v->reference, direction, t * 1.00001f, &t, &surface))
        sum += ca_pdf_to_solid_angle(density, ca_abs_dot(surface.ng, direction), t * t).v;
    return sum;
}

static bool draw_direct(const void *context, const float u[3], ca_vec3 *direction)
{
    const view *v = context;
    ca_surface surface;
    const ca_pdf_solid_angle pdf =
        ca_shape_sample_direct(&fixture.shapes[v->shape], v->reference, (ca_vec2){u[0], u[1]}, &surface);
    *direction = direction_between(v->reference, surface.position);
    return pdf.v > 0.0f;
}

static float direct_density(const void *context, ca_vec3 direction)
{
    const view *v = context;
    const ca_shape *shape = &fixture.shapes[v->shape];
    const bool cone = v->shape == LIGHT_SPHERE;
    float sum = 0.0f, t = 0.0f;
    ca_surface surface;
    while (ca_light_fixture_trace(&fixture, v->shape, v->reference, direction, t * 1.00001f, &t, &surface)) {
        sum += ca_shape_pdf_direct(shape, v->reference, surface.position, surface.ng).v;
        if (cone) break; /* only the near side is sampled */
    }
    return sum;
}

static void test_chi_square(void **state)
{
    (void)state;
    for (int i = 0; i < LIGHT_SHAPES; i++) {
        const view v = {i, ca_light_fixture_reference(i)};
        ca_vec3 low, high;
        ca_shape_bounds(&fixture.shapes[i], &low, &high);
        const ca_vec3 center = ca_mul(ca_add(low, high), 0.5f);
        const ca_vec3 axis = direction_between(v.reference, center);
        ca_chi_square_test test = {.name = ca_test_light_names[i],
                                   .sample = draw_direct,
                                   .pdf = direct_density,
                                   .context = &v,
                                   .axis = axis,
                                   .sample_count = 30000,
                                   .ring_count = 12, /* the density has edges, where its integral is dear */
                                   .cut_count = 12,
                                   .test_count = LIGHT_SHAPES + 1};
        ca_chi_square_assert(&test);
        if (i != LIGHT_SPHERE) continue; /* all others are sampled by area in either case */
        test.sample = draw_area;
        test.pdf = area_density;
        ca_chi_square_assert(&test);
    }
}

/* ---- Points ---------------------------------------------------------------------------------------------------- */

static void check_point(const ca_shape *shape, const ca_surface *surface)
{
    assert_true(fabsf(ca_length(surface->ng) - 1.0f) < 1e-6f);
    assert_true(ca_dot(surface->ng, surface->ns) > 0.0f);
    assert_true(surface->uv.x >= 0.0f && surface->uv.x <= 1.0f && surface->uv.y >= 0.0f && surface->uv.y <= 1.0f);
    assert_true(ca_max3(surface->position_error) > 0.0f && ca_max3(surface->position_error) < 1e-4f);
    assert_true((surface->mesh == NULL) == (shape->kind != CA_SHAPE_MESH));
    assert_int_equal(surface->instance, CA_NONE);
}

/* A ray through a sampled point meets the shape there and finds the same surface. */
static void test_points_are_hit(void **state)
{
    (void)state;
    for (int i = 0; i < LIGHT_SHAPES; i++) {
        const ca_shape *shape = &fixture.shapes[i];
        ca_test_random random = ca_test_random_seed((uint64_t)i);
        for (int k = 0; k < 5000; k++) {
            ca_surface surface, hit;
            const ca_pdf_area pdf = ca_shape_sample_area(shape, random2(&random), &surface);
            assert_true(fabsf(pdf.v * shape->area - 1.0f) < 1e-6f);
            check_point(shape, &surface);
            const ca_vec3 start = ca_madd(surface.position, 0.3f, surface.ng);
            float t;
            if (!ca_light_fixture_trace(&fixture, i, start, ca_neg(surface.ng), 0.0f, &t, &hit)) {
                /* A point on the rim may be missed by rounding. */
                assert_true(i == LIGHT_DISK || i == LIGHT_CYLINDER || i == LIGHT_RECTANGLE);
                continue;
            }
            assert_true(ca_length(ca_sub(hit.position, surface.position)) < 3e-6f);
            assert_true(ca_dot(hit.ng, surface.ng) > 0.99999f);
            assert_true(fabsf(hit.uv.y - surface.uv.y) < 2e-3f || fabsf(hit.uv.y - surface.uv.y) > 0.998f);
        }
    }
}

static void test_direct_agrees_with_pdf(void **state)
{
    (void)state;
    for (int i = 0; i < LIGHT_SHAPES; i++) {
        ca_test_random random = ca_test_random_seed((uint64_t)i);
        for (int k = 0; k < 20000; k++) {
            const ca_vec2 a = random2(&random), b = random2(&random);
            const ca_vec3 reference = {8.0f * a.x - 4.0f, 8.0f * a.y - 4.0f, 8.0f * b.x - 4.0f};
            ca_surface surface;
            const ca_pdf_solid_angle pdf =
                ca_shape_sample_direct(&fixture.shapes[i], reference, random2(&random), &surface);
            check_point(&fixture.shapes[i], &surface);
            const ca_pdf_solid_angle again =
                ca_shape_pdf_direct(&fixture.shapes[i], reference, surface.position, surface.ng);
            assert_true(pdf.v == again.v);
        }
    }
}

/* ---- Spheres at the limits of precision ------------------------------------------------------------------------ */

static ca_shape plain_sphere(ca_vec3 center, float radius)
{
    return (ca_shape){.kind = CA_SHAPE_SPHERE,
                      .area = 4.0f * CA_PI * radius * radius,
                      .as.sphere.map = {.to = {{radius, 0, 0, center.x},
                                               {0, radius, 0, center.y},
                                               {0, 0, radius, center.z}},
                              .from = {{1 / radius, 0, 0, -center.x / radius},
                                       {0, 1 / radius, 0, -center.y / radius},
                                       {0, 0, 1 / radius, -center.z / radius}}},
                      .as.sphere.center = center,
                      .as.sphere.radius = radius};
}

/* Seen under a tiny angle, sin^2 of the incidence is uniform in [0, 1], and the density is that of its disk. */
static void test_tiny_and_far_spheres(void **state)
{
    (void)state;
    enum { COUNT = 20000, BINS = 20 };
    static const struct {
        float distance, radius;
    } cases[] = {{100.0f, 1e-3f}, {1.0f, 1e-5f}, {1e6f, 1.0f}, {3.0f, 1e-8f}};
    for (size_t c = 0; c < sizeof cases / sizeof cases[0]; c++) {
        const ca_vec3 center = {0.0f, 0.0f, 0.0f};
        const ca_vec3 reference = ca_mul(ca_normalize((ca_vec3){0.3f, -0.5f, 0.8f}), -cases[c].distance);
        const ca_shape shape = plain_sphere(center, cases[c].radius);
        const double sine = (double)cases[c].radius / (double)ca_length(reference);
        double observed[BINS] = {0}, expected[BINS];
        ca_test_random random = ca_test_random_seed(c);
        for (int i = 0; i < COUNT; i++) {
            ca_surface surface;
            const ca_pdf_solid_angle pdf = ca_shape_sample_direct(&shape, reference, random2(&random), &surface);
            assert_true(fabs((double)pdf.v * CA_PI_D * sine * sine - 1.0) < 1e-5 + sine);
            const ca_vec3 axis = ca_normalize(reference);
            const double cosine = (double)ca_dot(surface.ng, axis);
            assert_true(cosine > -1e-6);
            assert_true(fabsf(ca_length(ca_sub(surface.position, center)) / cases[c].radius - 1.0f) < 1e-5f);
            observed[(int)fmin((1.0 - cosine * cosine) * BINS, BINS - 1.0)] += 1.0;
        }
        for (int i = 0; i < BINS; i++) expected[i] = (double)COUNT / BINS;
        assert_true(ca_chi_square_counts(observed, expected, BINS, NULL, NULL) > ca_sidak_level(0.01, 4));
    }
}

/* Just above a sphere, the cone is nearly the half space; on it and inside, areas are sampled. Never a NaN. */
static void test_near_spheres(void **state)
{
    (void)state;
    const ca_shape shape = plain_sphere((ca_vec3){1.0f, 2.0f, 3.0f}, 2.0f);
    for (int i = -20; i <= 20; i++) {
        const float gap = ldexpf(i < 0 ? -1.0f : 1.0f, i < 0 ? i : -i);
        const ca_vec3 reference = {1.0f, 4.0f + gap, 3.0f};
        ca_test_random random = ca_test_random_seed((uint64_t)(i + 20));
        for (int k = 0; k < 200; k++) {
            ca_surface surface;
            const ca_pdf_solid_angle pdf = ca_shape_sample_direct(&shape, reference, random2(&random), &surface);
            assert_true(isfinite(pdf.v) && pdf.v >= 0.0f);
            assert_true(ca_is_finite3(surface.position) && ca_is_finite3(surface.ng));
            assert_true(pdf.v == ca_shape_pdf_direct(&shape, reference, surface.position, surface.ng).v);
            if (!(reference.y > 4.00001f)) continue; /* nearer, the reference counts as lying on the sphere */
            const double distance = 2.0 + ((double)reference.y - 4.0),
                         cos_max = sqrt(1.0 - 4.0 / (distance * distance));
            if (!(fabs((double)pdf.v * 2.0 * CA_PI_D * (1.0 - cos_max) - 1.0) < 1e-4))
                fail_msg("gap %g: density %g, cos %g", (double)gap, (double)pdf.v, cos_max);
            assert_true(ca_dot(surface.ng, ca_sub(reference, surface.position)) > -1e-5f);
        }
    }
}

/* ---- Bounds ---------------------------------------------------------------------------------------------------- */

static void test_bounds(void **state)
{
    (void)state;
    for (int i = 0; i < LIGHT_SHAPES; i++) {
        ca_vec3 low, high, sampled_low = {9, 9, 9}, sampled_high = {-9, -9, -9};
        ca_shape_bounds(&fixture.shapes[i], &low, &high);
        ca_test_random random = ca_test_random_seed((uint64_t)i);
        for (int k = 0; k < 200000; k++) {
            ca_surface surface;
            ca_shape_sample_area(&fixture.shapes[i], random2(&random), &surface);
            sampled_low = ca_min_vec3(sampled_low, surface.position);
            sampled_high = ca_max_vec3(sampled_high, surface.position);
        }
        const ca_vec3 slack_low = ca_sub(sampled_low, low), slack_high = ca_sub(high, sampled_high);
        /* A mesh's bounds are those of its corners; a point may be rounded out of them. */
        const float least = i == LIGHT_RECTANGLE ? -1e-6f : 0.0f;
        assert_true(fminf(slack_low.x, fminf(slack_low.y, slack_low.z)) >= least);
        assert_true(fminf(slack_high.x, fminf(slack_high.y, slack_high.z)) >= least);
        assert_true(ca_max3(slack_low) < 0.02f && ca_max3(slack_high) < 0.02f);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_chi_square),
        cmocka_unit_test(test_points_are_hit),
        cmocka_unit_test(test_direct_agrees_with_pdf),
        cmocka_unit_test(test_tiny_and_far_spheres),
        cmocka_unit_test(test_near_spheres),
        cmocka_unit_test(test_bounds),
    };
    return cmocka_run_group_tests_name("shape sampling", tests, set_up, tear_down);
}
