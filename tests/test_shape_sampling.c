/* Points of shapes: on the shape, uniform by area, with the densities they claim as seen from anywhere, for spheres
 * however tiny, far or near; and bounds. */
#include "math/numeric.h"
#include "support/chi_square.h"
#include "support/light_fixture.h"
#include "support/test_random.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

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

/* Views of the rectangle that are tested by themselves: below. */
enum { RECTANGLE_VIEWS = 6 };

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
                                   .test_count = LIGHT_SHAPES + 2 + RECTANGLE_VIEWS};
        ca_chi_square_assert(&test);
        if (i != LIGHT_SPHERE && i != LIGHT_RECTANGLE) continue; /* the others are sampled by area in either case */
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
                assert_true(i == LIGHT_DISK || i == LIGHT_CYLINDER || i == LIGHT_QUADRANGLE ||
                            i == LIGHT_RECTANGLE);
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

/* ---- Rectangles ------------------------------------------------------------------------------------------------ */

/* In the rectangle's frame: along its sides from its centre, and in front of it (its sides are 2 and 1.5 long). */
static ca_vec3 before_rectangle(float x, float y, float z)
{
    const ca_rectangle *r = &fixture.shapes[LIGHT_RECTANGLE].as.mesh.rectangle;
    const ca_vec3 center = {-1.0f, 3.0f, 0.5f};
    return ca_madd(ca_madd(ca_madd(center, x, r->x), y, r->y), z, r->n);
}

/* Near and far, before its middle, beside it, behind it, and nearly in its plane. */
static void test_rectangle_views(void **state)
{
    (void)state;
    static const float places[RECTANGLE_VIEWS][3] = {{0, 0, 1},        {0.3f, -0.2f, 0.05f}, {1.6f, 1, 0.8f},
                                                     {0.9f, 0.7f, -1.6f}, {-0.9f, 0.1f, 0.1f}, {0.1f, 0.2f, 3.2f}};
    const ca_shape *shape = &fixture.shapes[LIGHT_RECTANGLE];
    for (int i = 0; i < RECTANGLE_VIEWS; i++) {
        const view v = {LIGHT_RECTANGLE, before_rectangle(places[i][0], places[i][1], places[i][2])};
        assert_true(ca_shape_pdf_seen(shape, v.reference).v > 0.0f);
        ca_chi_square_assert(
            &(ca_chi_square_test){.name = "rectangle",
                                  .sample = draw_direct,
                                  .pdf = direct_density,
                                  .context = &v,
                                  .axis = direction_between(v.reference, before_rectangle(0, 0, 0)),
                                  .sample_count = 30000,
                                  .ring_count = 12,
                                  .cut_count = 12,
                                  .test_count = LIGHT_SHAPES + 2 + RECTANGLE_VIEWS});
    }
}

/* The face of a cube is a sixth of the sphere from its centre, 4 pi / 24 for a quarter of it; and a sample's part of
 * the solid angle is its first number. */
static void test_rectangle_solid_angle(void **state)
{
    (void)state;
    const ca_rectangle face = {.exists = true,
                               .corner = {-1, -1, -1},
                               .x = {1, 0, 0},
                               .y = {0, 1, 0},
                               .n = {0, 0, 1},
                               .width = 2,
                               .height = 2,
                               .large_distance2 = INFINITY};
    ca_spherical_rectangle seen, part;
    assert_true(ca_spherical_rectangle_from(&face, (ca_vec3){0}, &seen));
    assert_true(fabs(seen.solid_angle - 4.0 * CA_PI_D / 6.0) < 1e-12);
    for (int i = 1; i < 10; i++) {
        ca_rectangle left = face;
        const float u = 0.1f * (float)i;
        left.width *= ca_spherical_rectangle_sample(&seen, (ca_vec2){u, 0.3f}).x;
        assert_true(ca_spherical_rectangle_from(&left, (ca_vec3){0}, &part));
        assert_true(fabs(part.solid_angle / seen.solid_angle - (double)u) < 1e-6);
    }
}

/* However the file orders corners and triangles, (s, t) is the same point of the mesh as of the rectangle. */
static void test_rectangles_are_found(void **state)
{
    (void)state;
    ca_mesh mesh;
    assert_int_equal(ca_mesh_create(&mesh, 4, 2, false, false, NULL), CA_OK);
    static const float square[12] = {1, 1, 0, 4, 1, 0, 4, 3, 0, 1, 3, 0};
    memcpy(mesh.positions, square, sizeof square);
    for (uint32_t turn = 0; turn < 18; turn++) {
        const uint32_t a = turn % 3, b = turn / 3 % 3, other = turn / 9; /* the diagonal 0-2, or 1-3 */
        static const uint32_t corners[2][2][3] = {{{0, 1, 2}, {0, 2, 3}}, {{1, 2, 3}, {1, 3, 0}}};
        for (uint32_t k = 0; k < 3; k++) {
            mesh.indices[k] = corners[other][0][(k + a) % 3];
            mesh.indices[3 + k] = corners[other][1][(k + b) % 3];
        }
        const ca_rectangle r = ca_rectangle_from_mesh(&mesh);
        assert_true(r.exists && fabsf(r.width * r.height - 6.0f) < 1e-6f && r.n.z == 1.0f);
        ca_test_random random = ca_test_random_seed(turn);
        for (int i = 0; i < 100; i++) {
            const ca_vec2 st = random2(&random);
            ca_vec2 bary;
            const uint32_t *index = mesh.indices + 3 * ca_rectangle_triangle(&r, st, &bary);
            const ca_vec3 wanted = ca_madd(ca_madd(r.corner, st.x * r.width, r.x), st.y * r.height, r.y);
            const float w[3] = {1.0f - bary.x - bary.y, bary.x, bary.y};
            ca_vec3 p = {0};
            for (int k = 0; k < 3; k++) {
                assert_true(w[k] > -1e-6f);
                p = ca_madd(p, w[k], (ca_vec3){square[3 * index[k]], square[3 * index[k] + 1], 0.0f});
            }
            assert_true(ca_length(ca_sub(p, wanted)) < 1e-5f);
        }
    }
    mesh.positions[6] = 4.01f; /* a corner out of place */
    assert_false(ca_rectangle_from_mesh(&mesh).exists);
    mesh.positions[6] = 4.0f;
    mesh.positions[8] = 0.01f; /* out of the plane */
    assert_false(ca_rectangle_from_mesh(&mesh).exists);
    mesh.positions[8] = 0.0f;
    mesh.positions[3] = mesh.positions[6] = 1.0f; /* no width */
    assert_false(ca_rectangle_from_mesh(&mesh).exists);
    ca_mesh_destroy(&mesh);
}

/* In the plane, on the rectangle, at its corners and edges, next to all of them, and far away: numbers, and the same
 * by sampling as by asking. */
static void test_rectangle_limits(void **state)
{
    (void)state;
    const ca_shape *shape = &fixture.shapes[LIGHT_RECTANGLE];
    static const float along[] = {0, 0.4f, 1, 1.0001f, 3, 1e4f};
    ca_test_random random = ca_test_random_seed(5);
    for (int i = 0; i < 6 * 6; i++)
        for (int power = -30; power <= 14; power += 2) {
            const float z = power == -30 ? 0.0f : ldexpf(power % 4 ? 1.0f : -1.0f, power);
            const ca_vec3 reference = before_rectangle(along[i % 6], 0.75f * along[i / 6], z);
            for (int k = 0; k < 20; k++) {
                ca_surface surface;
                const ca_pdf_solid_angle pdf =
                    ca_shape_sample_direct(shape, reference, random2(&random), &surface);
                assert_true(isfinite(pdf.v) && pdf.v >= 0.0f && ca_is_finite3(surface.position));
                assert_true(pdf.v == ca_shape_pdf_direct(shape, reference, surface.position, surface.ng).v);
                const ca_vec3 from_center = ca_sub(surface.position, before_rectangle(0, 0, 0));
                assert_true(ca_length(from_center) < 1.2501f);
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
        const float least = i >= LIGHT_QUADRANGLE ? -1e-6f : 0.0f;
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
        cmocka_unit_test(test_rectangle_views),
        cmocka_unit_test(test_rectangle_solid_angle),
        cmocka_unit_test(test_rectangles_are_found),
        cmocka_unit_test(test_rectangle_limits),
        cmocka_unit_test(test_bounds),
    };
    return cmocka_run_group_tests_name("shape sampling", tests, set_up, tear_down);
}
