/* Texture coordinates and tangents of shapes: what their definitions say, and tangents as differences of points. */
#include "geometry/quadric.h"
#include "geometry/triangle.h"
#include "scene/scene.h"
#include "support/scene_text.h"
#include "support/test_random.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

enum { POINTS = 2000 };

static void assert_near(ca_vec3 got, ca_vec3 expected, float tolerance)
{
    if (!(ca_length(ca_sub(got, expected)) <= tolerance))
        fail_msg("(%g, %g, %g) instead of (%g, %g, %g)", (double)got.x, (double)got.y, (double)got.z,
                 (double)expected.x, (double)expected.y, (double)expected.z);
}

/* ---- Quadrics -------------------------------------------------------------------------------------------------- */

/* In the shape's own space, with all angles in turns. */
static ca_vec3 point_at(ca_shape_kind kind, double u, double v)
{
    const double full = 2.0 * CA_PI_D;
    switch (kind) {
    case CA_SHAPE_SPHERE:
        return (ca_vec3){(float)(cos(full * u) * sin(CA_PI_D * v)), (float)(sin(full * u) * sin(CA_PI_D * v)),
                         (float)cos(CA_PI_D * v)};
    case CA_SHAPE_DISK: return (ca_vec3){(float)(u * cos(full * v)), (float)(u * sin(full * v)), 0.0f};
    default: return (ca_vec3){(float)cos(full * u), (float)sin(full * u), (float)v};
    }
}

static ca_affine *map_of(ca_shape *shape)
{
    if (shape->kind == CA_SHAPE_SPHERE) return &shape->as.sphere.map;
    return shape->kind == CA_SHAPE_DISK ? &shape->as.disk.map : &shape->as.cylinder.map;
}

static ca_shape quadric_of(ca_shape_kind kind)
{
    const double length = kind == CA_SHAPE_CYLINDER ? 3.0 : 2.0;
    const ca_matrix move = ca_matrix_translate(1.0, -2.0, 0.5), turn = ca_matrix_rotate(1.0, 2.0, -1.0, 50.0);
    const ca_matrix scale = ca_matrix_scale(2.0, 2.0, length);
    ca_matrix map = ca_matrix_multiply(&turn, &scale);
    map = ca_matrix_multiply(&move, &map);
    ca_shape shape = {.kind = kind, .light = CA_NONE, .needs_tangents = true};
    assert_true(ca_affine_from_matrix(&map, map_of(&shape)));
    if (kind == CA_SHAPE_SPHERE) {
        shape.as.sphere.center = (ca_vec3){1.0f, -2.0f, 0.5f};
        shape.as.sphere.radius = 2.0f;
    } else if (kind == CA_SHAPE_CYLINDER) {
        shape.as.cylinder.radius = 2.0f;
        shape.as.cylinder.length = (float)length;
    }
    return shape;
}

static void check_quadric(ca_shape_kind kind)
{
    const double step = 1e-3;
    ca_shape shape = quadric_of(kind);
    const ca_affine *map = map_of(&shape);
    ca_test_random random = ca_test_random_seed((uint32_t)kind);
    for (int i = 0; i < POINTS; i++) {
        const double u = 0.01 + 0.98 * (double)ca_test_random_float(&random);
        const double v = 0.01 + 0.98 * (double)ca_test_random_float(&random);
        const ca_vec3 position = ca_map_point(map->to, point_at(kind, u, v));
        ca_surface s = {0};
        ca_quadric_surface(&shape, position, &s);
        assert_near(s.position, position, 1e-5f);
        assert_near((ca_vec3){s.uv.x, s.uv.y, 0.0f}, (ca_vec3){(float)u, (float)v, 0.0f}, 1e-4f);
        const ca_vec3 along_u = ca_sub(point_at(kind, u + step, v), point_at(kind, u - step, v));
        const ca_vec3 along_v = ca_sub(point_at(kind, u, v + step), point_at(kind, u, v - step));
        assert_near(s.dpdu, ca_mul(ca_map_vector(map->to, along_u), (float)(0.5 / step)), 2e-3f);
        assert_near(s.dpdv, ca_mul(ca_map_vector(map->to, along_v), (float)(0.5 / step)), 2e-3f);
        assert_true(ca_abs_dot(s.ng, ca_normalize(s.dpdu)) < 1e-4f && ca_abs_dot(s.ng, ca_normalize(s.dpdv)) < 1e-4f);
    }
}

static void test_quadrics(void **state)
{
    (void)state;
    check_quadric(CA_SHAPE_SPHERE);
    check_quadric(CA_SHAPE_DISK);
    check_quadric(CA_SHAPE_CYLINDER);
}

/* Without uv all else is the same to the bit. */
static void test_quadrics_without_uv(void **state)
{
    (void)state;
    ca_test_random random = ca_test_random_seed(9);
    for (int i = 0; i < POINTS; i++) {
        const ca_shape_kind kind = i % 3 == 0 ? CA_SHAPE_SPHERE : i % 3 == 1 ? CA_SHAPE_DISK : CA_SHAPE_CYLINDER;
        ca_shape shape = quadric_of(kind);
        shape.needs_tangents = false;
        shape.flip_normals = i % 2;
        const double u = 0.01 + 0.98 * (double)ca_test_random_float(&random);
        const ca_affine *map = map_of(&shape);
        const ca_vec3 position = ca_map_point(map->to, point_at(kind, u, 0.3));
        ca_surface with = {0}, without = {.uv = {7.0f, 7.0f}};
        ca_quadric_surface(&shape, position, &with);
        shape.skips_uv = true;
        ca_quadric_surface(&shape, position, &without);
        assert_true(with.uv.x > 0.0f && without.uv.x == 0.0f && without.uv.y == 0.0f);
        assert_memory_equal(&with, &without, offsetof(ca_surface, uv)); /* position, normals, tangents */
    }
}

/* It is left out where nothing asks for it, and nowhere else. */
static void test_scenes_without_uv(void **state)
{
    (void)state;
#define BALL(bsdf, light)                                                                                            \
    "<scene version='3.0.0'><sensor type='perspective'/><shape type='sphere'>" bsdf "</shape>"                       \
    "<shape type='rectangle'><emitter type='area'>" light "</emitter></shape></scene>"
#define PLAIN_LIGHT "<rgb name='radiance' value='1'/>"
    static const struct {
        const char *text;
        bool skips;
    } cases[] = {
        {BALL("<bsdf type='diffuse'/>", PLAIN_LIGHT), true},
        {BALL("<bsdf type='diffuse'><texture name='reflectance' type='checkerboard'/></bsdf>", PLAIN_LIGHT), false},
        {BALL("<bsdf type='diffuse'/>", "<texture name='radiance' type='checkerboard'/>"), false},
        {BALL("<bsdf type='roughconductor'><float name='alpha_u' value='0.1'/><float name='alpha_v' value='0.3'/>"
              "</bsdf>", PLAIN_LIGHT), false},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        ca_scene *scene = scene_from_text(cases[i].text);
        for (uint32_t k = 0; k < scene->shape_count; k++)
            assert_int_equal(scene->shapes[k].skips_uv, cases[i].skips && scene->shapes[k].kind == CA_SHAPE_SPHERE);
        ca_scene_release(scene);
    }
}

/* ---- Triangles ------------------------------------------------------------------------------------------------- */

/* One triangle with random corners, texture coordinates and normals on the side of its own one or the other. */
typedef struct triangle_mesh {
    float positions[10], normals[9], uvs[6];
    uint32_t indices[3];
    ca_mesh mesh;
} triangle_mesh;

static void make_triangle(triangle_mesh *t, ca_test_random *random)
{
    for (int i = 0; i < 9; i++) t->positions[i] = 2.0f * ca_test_random_float(random) - 1.0f;
    for (int i = 0; i < 6; i++) t->uvs[i] = ca_test_random_float(random);
    for (int i = 0; i < 9; i++) t->normals[i] = ca_test_random_float(random) - 0.5f;
    for (uint32_t i = 0; i < 3; i++) t->indices[i] = (i + 1) % 3;
    t->mesh = (ca_mesh){.positions = t->positions,
                        .normals = t->normals,
                        .uvs = t->uvs,
                        .indices = t->indices,
                        .vertex_count = 3,
                        .triangle_count = 1};
}

static ca_vec3 interpolated(const float *values, const uint32_t *index, ca_vec2 b)
{
    const ca_vec3 v0 = ca_load3(values, index[0]), v1 = ca_load3(values, index[1]), v2 = ca_load3(values, index[2]);
    return ca_add(ca_mul(v0, 1.0f - b.x - b.y), ca_add(ca_mul(v1, b.x), ca_mul(v2, b.y)));
}

static ca_surface surface_at(const triangle_mesh *t, ca_vec2 b)
{
    const ca_triangle triangle = ca_triangle_load(&t->mesh, 0);
    ca_surface s = {0};
    ca_triangle_position(&triangle, b, &s);
    s.ng = s.ns = ca_normalize(
        ca_cross(ca_sub(triangle.p[1], triangle.p[0]), ca_sub(triangle.p[2], triangle.p[0])));
    ca_triangle_attributes(&t->mesh, 0, b, &s);
    ca_triangle_tangents(&t->mesh, &triangle, &s);
    return s;
}

/* Going on by (du, dv) moves the point by dpdu du + dpdv dv; normals of the vertices decide which side is outside. */
static void test_triangles(void **state)
{
    (void)state;
    ca_test_random random = ca_test_random_seed(7);
    int turned = 0;
    for (int i = 0; i < POINTS; i++) {
        triangle_mesh t;
        make_triangle(&t, &random);
        const ca_vec2 b = {0.4f * ca_test_random_float(&random), 0.5f * ca_test_random_float(&random)};
        const ca_vec2 far = {b.x + 0.1f, b.y - 0.05f};
        const ca_surface s = surface_at(&t, b), next = surface_at(&t, far);
        assert_near(s.position, interpolated(t.positions, t.indices, b), 1e-6f);
        assert_near(s.ns, ca_normalize(interpolated(t.normals, t.indices, b)), 1e-4f);
        assert_true(ca_dot(s.ns, s.ng) >= 0.0f);
        const ca_vec3 e1 = ca_sub(ca_load3(t.positions, 2), ca_load3(t.positions, 1));
        turned += ca_dot(ca_cross(e1, ca_sub(ca_load3(t.positions, 0), ca_load3(t.positions, 1))), s.ng) < 0.0f;
        const ca_vec3 moved = ca_add(ca_mul(s.dpdu, next.uv.x - s.uv.x), ca_mul(s.dpdv, next.uv.y - s.uv.y));
        const float size = ca_length(s.dpdu) + ca_length(s.dpdv);
        assert_near(moved, ca_sub(next.position, s.position), 1e-6f * (1.0f + size));
    }
    assert_true(turned > POINTS / 4 && turned < 3 * POINTS / 4);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_quadrics),
        cmocka_unit_test(test_quadrics_without_uv),
        cmocka_unit_test(test_scenes_without_uv),
        cmocka_unit_test(test_triangles),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
