/* Triangle meshes: the built-in shapes, maps, smooth normals, attributes and the checks that everything else relies
 * on. */
#include "base/clock.h"
#include "base/memory.h"
#include "geometry/rectangle.h"
#include "support/test_random.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static void assert_near(double a, double b, double tolerance)
{
    if (!(fabs(a - b) <= tolerance)) fail_msg("%.9g is not %.9g within %g", a, b, tolerance);
}

static ca_vec3 position_of(const ca_mesh *mesh, size_t corner)
{
    const float *p = mesh->positions + (size_t)3 * mesh->indices[corner];
    return (ca_vec3){p[0], p[1], p[2]};
}

static ca_vec3 geometric_normal(const ca_mesh *mesh, size_t triangle)
{
    const ca_vec3 p0 = position_of(mesh, 3 * triangle);
    const ca_vec3 a = ca_sub(position_of(mesh, 3 * triangle + 1), p0);
    const ca_vec3 b = ca_sub(position_of(mesh, 3 * triangle + 2), p0);
    return ca_normalize(ca_cross(a, b));
}

static ca_vec3 vertex_normal(const ca_mesh *mesh, size_t corner)
{
    const float *n = mesh->normals + (size_t)3 * mesh->indices[corner];
    return (ca_vec3){n[0], n[1], n[2]};
}

/* The winding, the vertex normals and the direction away from `inside` agree on all triangles. */
static void assert_faces_outward(const ca_mesh *mesh, ca_vec3 inside)
{
    for (size_t t = 0; t < mesh->triangle_count; ++t) {
        const ca_vec3 ng = geometric_normal(mesh, t);
        assert_true(ca_dot(ng, ca_sub(position_of(mesh, 3 * t), inside)) > 0.0f);
        for (size_t k = 0; mesh->normals && k < 3; ++k)
            assert_near((double)ca_dot(ng, vertex_normal(mesh, 3 * t + k)), 1.0, 1e-5);
    }
}

static double total_area(const ca_mesh *mesh)
{
    double area = 0.0;
    for (uint32_t t = 0; t < mesh->triangle_count; ++t) area += ca_mesh_triangle_area(mesh, t);
    return area;
}

static void rectangle_is_mitsubas(void **unused)
{
    (void)unused;
    ca_mesh mesh;
    assert_int_equal(ca_mesh_create_rectangle(&mesh, NULL), CA_OK);
    assert_int_equal(ca_mesh_validate(&mesh, "rectangle", NULL), CA_OK);
    assert_near(total_area(&mesh), 4.0, 1e-6);
    assert_faces_outward(&mesh, (ca_vec3){0.0f, 0.0f, -1.0f});
    for (uint32_t v = 0; v < mesh.vertex_count; ++v) {
        assert_near((double)mesh.uvs[2 * v], 0.5 * ((double)mesh.positions[3 * v] + 1.0), 0.0);
        assert_near((double)mesh.uvs[2 * v + 1], 0.5 * ((double)mesh.positions[3 * v + 1] + 1.0), 0.0);
    }
    ca_mesh_destroy(&mesh);
}

static void cube_is_mitsubas(void **unused)
{
    (void)unused;
    /* Corners and uv of Mitsuba 3's table, one of each face. */
    static const float known[6][5] = {{1, -1, -1, 0, 1}, {1, 1, -1, 0, 1},  {1, -1, -1, 0, 1},
                                      {1, -1, 1, 0, 1},  {-1, -1, 1, 0, 1}, {1, 1, -1, 0, 1}};
    ca_mesh mesh;
    assert_int_equal(ca_mesh_create_cube(&mesh, NULL), CA_OK);
    assert_int_equal(ca_mesh_validate(&mesh, "cube", NULL), CA_OK);
    assert_int_equal(mesh.vertex_count, 24);
    assert_int_equal(mesh.triangle_count, 12);
    assert_near(total_area(&mesh), 24.0, 1e-5);
    assert_faces_outward(&mesh, (ca_vec3){0});
    for (size_t face = 0; face < 6; ++face) {
        bool found = false;
        for (size_t v = 4 * face; v < 4 * face + 4; ++v)
            found |= memcmp(mesh.positions + 3 * v, known[face], 3 * sizeof(float)) == 0 &&
                     memcmp(mesh.uvs + 2 * v, known[face] + 3, 2 * sizeof(float)) == 0;
        assert_true(found);
    }
    ca_mesh_destroy(&mesh);
}

static void make_map(ca_affine *map, double sx, double sy, double sz)
{
    const ca_matrix scale = ca_matrix_scale(sx, sy, sz), rotate = ca_matrix_rotate(1.0, 2.0, 3.0, 40.0);
    const ca_matrix move = ca_matrix_translate(5.0, -6.0, 7.0), turned = ca_matrix_multiply(&rotate, &scale);
    const ca_matrix all = ca_matrix_multiply(&move, &turned);
    assert_true(ca_affine_from_matrix(&all, map));
}

static void outside_stays_outside_under_any_map(void **unused)
{
    (void)unused;
    static const double scales[4][3] = {{1, 2, 3}, {-1, 2, 3}, {-1, -2, 3}, {-1e-8, -1e-8, -2e-8}};
    for (int i = 0; i < 4; ++i) {
        ca_mesh mesh;
        ca_affine map;
        make_map(&map, scales[i][0], scales[i][1], scales[i][2]);
        if (i == 3) for (int k = 0; k < 3; ++k) map.to[k][3] = 0.0f; /* tiny: not far from the origin */
        assert_int_equal(ca_mesh_create_cube(&mesh, NULL), CA_OK);
        ca_mesh_transform(&mesh, &map);
        assert_faces_outward(&mesh, (ca_vec3){map.to[0][3], map.to[1][3], map.to[2][3]});
        const double x = fabs(scales[i][0]), y = fabs(scales[i][1]), z = fabs(scales[i][2]);
        const double expected = 8.0 * (x * y + y * z + z * x);
        assert_near(total_area(&mesh) / expected, 1.0, 1e-5);
        ca_mesh_flip_normals(&mesh);
        for (size_t t = 0; t < mesh.triangle_count; ++t) {
            assert_true(ca_dot(geometric_normal(&mesh, t), ca_sub(position_of(&mesh, 3 * t),
                        (ca_vec3){map.to[0][3], map.to[1][3], map.to[2][3]})) < 0.0f);
            assert_true(ca_dot(geometric_normal(&mesh, t), vertex_normal(&mesh, 3 * t)) > 0.99f);
        }
        ca_mesh_destroy(&mesh);
    }
}

/* A cube of 8 shared corners: weighted by angle, the normals are the diagonals however its squares are cut; weighted
 * by area or count they would not be. */
static void smooth_normals_do_not_see_the_triangulation(void **unused)
{
    (void)unused;
    ca_mesh squares, mesh;
    assert_int_equal(ca_mesh_create_cube(&squares, NULL), CA_OK);
    assert_int_equal(ca_mesh_create(&mesh, 9, 13, false, false, NULL), CA_OK);
    for (size_t v = 0; v < 8; ++v)
        for (size_t i = 0; i < 3; ++i) mesh.positions[3 * v + i] = v >> i & 1 ? 1.0f : -1.0f;
    for (size_t i = 0; i < 36; ++i) {
        const ca_vec3 p = position_of(&squares, i);
        mesh.indices[i] = (p.x > 0.0f) + 2u * (p.y > 0.0f) + 4u * (p.z > 0.0f);
    }
    mesh.indices[36] = 8; /* a triangle without area, whose corner 8 no other has */
    assert_int_equal(ca_mesh_compute_normals(&mesh, 0, NULL), CA_OK);
    for (size_t i = 0; i < 24; ++i)
        assert_near((double)mesh.normals[i], (double)mesh.positions[i] / sqrt(3.0), 1e-6);
    for (size_t i = 24; i < 27; ++i) assert_true(mesh.normals[i] == 0.0f);
    ca_mesh_drop_normals(&mesh);
    assert_null(mesh.normals);
    ca_mesh_destroy(&mesh);
    ca_mesh_destroy(&squares);
}

enum { MANY_VERTICES = 3001, MANY_TRIANGLES = 70001 };

/* More than a part of the triangles, in no order, some of them without area; vertices with many and with none. */
static void make_many(ca_mesh *mesh)
{
    ca_test_random random = ca_test_random_seed(11);
    assert_int_equal(ca_mesh_create(mesh, MANY_VERTICES, MANY_TRIANGLES, false, false, NULL), CA_OK);
    for (size_t i = 0; i < (size_t)3 * MANY_VERTICES; ++i) mesh->positions[i] = ca_test_random_float(&random) - 0.5f;
    for (size_t i = 0; i < (size_t)3 * MANY_TRIANGLES; ++i)
        mesh->indices[i] = (uint32_t)(ca_test_random_float(&random) * ca_test_random_float(&random) * MANY_VERTICES);
    for (size_t t = 0; t < 3 * MANY_TRIANGLES; t += 300) mesh->indices[t] = mesh->indices[t + 1];
}

static void normals_by_threads(ca_mesh *mesh, uint32_t threads, float *normals)
{
    assert_int_equal(ca_mesh_compute_normals(mesh, threads, NULL), CA_OK);
    memcpy(normals, mesh->normals, sizeof(float) * 3 * MANY_VERTICES);
    ca_mesh_drop_normals(mesh);
}

static void smooth_normals_do_not_see_the_threads(void **unused)
{
    (void)unused;
    static const uint32_t threads[] = {0, 2, 3, 7, 64, 150, 300};
    static float one[3 * MANY_VERTICES], other[3 * MANY_VERTICES];
    ca_mesh mesh;
    make_many(&mesh);
    normals_by_threads(&mesh, 1, one);
    for (int i = 0; i < 7; ++i) {
        normals_by_threads(&mesh, threads[i], other);
        if (memcmp(one, other, sizeof one) != 0) fail_msg("other normals by %u threads than by one", threads[i]);
    }
    ca_mesh_destroy(&mesh);
}

/* One corner: the triangle's unit normal times its angle there, by the law of cosines. */
static void add_corner(const ca_mesh *mesh, size_t corner, double *sums)
{
    const size_t first = corner / 3 * 3;
    const ca_vec3 p = position_of(mesh, corner), q = position_of(mesh, first + (corner + 1) % 3);
    const ca_vec3 r = position_of(mesh, first + (corner + 2) % 3);
    const double a[3] = {(double)q.x - (double)p.x, (double)q.y - (double)p.y, (double)q.z - (double)p.z};
    const double b[3] = {(double)r.x - (double)p.x, (double)r.y - (double)p.y, (double)r.z - (double)p.z};
    double n[3], length2 = 0.0, squares[2] = {0.0, 0.0}, dot = 0.0;
    for (int i = 0; i < 3; ++i) {
        n[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
        length2 += n[i] * n[i], squares[0] += a[i] * a[i], squares[1] += b[i] * b[i], dot += a[i] * b[i];
    }
    if (!(length2 > 0.0)) return;
    const double angle = acos(fmax(-1.0, fmin(1.0, dot / sqrt(squares[0] * squares[1]))));
    for (int i = 0; i < 3; ++i) sums[3 * (size_t)mesh->indices[corner] + (size_t)i] += n[i] / sqrt(length2) * angle;
}

static void smooth_normals_are_sums_over_corners(void **unused)
{
    (void)unused;
    static double sums[3 * MANY_VERTICES];
    ca_mesh mesh;
    make_many(&mesh);
    assert_int_equal(ca_mesh_compute_normals(&mesh, 2, NULL), CA_OK);
    for (size_t corner = 0; corner < (size_t)3 * MANY_TRIANGLES; ++corner) add_corner(&mesh, corner, sums);
    for (size_t v = 0; v < MANY_VERTICES; ++v) {
        const double *sum = sums + 3 * v;
        const double length = sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
        for (size_t i = 0; i < 3; ++i)
            assert_near((double)mesh.normals[3 * v + i], length > 0.0 ? sum[i] / length : 0.0, 3e-6);
    }
    ca_mesh_destroy(&mesh);
}

/* A mesh of a million triangles is to load in 50 ms more than its structure takes to build. In processor time, and
 * against something that takes 56 ns a triangle where normals take 14: other processes do not count. */
static void smooth_normals_cost_little(void **unused)
{
    (void)unused;
    ca_mesh mesh;
    double normals = HUGE_VAL, angles = HUGE_VAL, sum = 0.0;
    make_many(&mesh);
    for (int run = 0; run < 7; ++run) {
        double start = ca_clock_thread_seconds();
        assert_int_equal(ca_mesh_compute_normals(&mesh, 1, NULL), CA_OK);
        normals = fmin(normals, ca_clock_thread_seconds() - start);
        start = ca_clock_thread_seconds();
        for (size_t i = 0; i < (size_t)3 * MANY_TRIANGLES; ++i) {
            const float *p = mesh.positions + (size_t)3 * mesh.indices[i];
            sum += atan2((double)p[0], (double)p[1]);
        }
        angles = fmin(angles, ca_clock_thread_seconds() - start);
        ca_mesh_drop_normals(&mesh);
    }
    printf("normals of %d triangles: %.2f ms; their angles by the C library: %.2f ms (%g)\n", MANY_TRIANGLES,
           1e3 * normals, 1e3 * angles, sum);
#ifdef NDEBUG
    assert_true(normals < angles);
#endif
    ca_mesh_destroy(&mesh);
}

/* Area and bounds of a mesh of several ranges are those of its triangles and vertices. */
static void large_meshes_are_measured_as_a_whole(void **unused)
{
    (void)unused;
    ca_mesh mesh;
    make_many(&mesh);
    float *last = mesh.positions + (size_t)3 * (MANY_VERTICES - 1);
    last[0] = 7.0f, last[1] = -8.0f;
    ca_mesh_measure(&mesh);
    assert_near(mesh.area / total_area(&mesh), 1.0, 1e-12);
    assert_true(mesh.high.x == 7.0f && mesh.low.y == -8.0f && mesh.low.x >= -0.5f && mesh.low.x < -0.49f);
    ca_mesh_destroy(&mesh);
}

/* What is wrong far behind in a large mesh is found and named, and copies have all numbers. */
static void large_meshes_are_checked_to_the_end(void **unused)
{
    (void)unused;
    enum { LAST = 3 * MANY_TRIANGLES - 1 };
    ca_mesh mesh;
    ca_error error;
    make_many(&mesh);
    assert_int_equal(ca_mesh_validate(&mesh, "a.ply", &error), CA_OK);
    uint32_t *copy = ca_mesh_take_array(mesh.indices, LAST + 1, false);
    assert_memory_equal(copy, mesh.indices, sizeof *copy * (LAST + 1));
    assert_int_equal(copy[LAST + 1], 0);
    ca_free(copy);
    mesh.indices[LAST] = MANY_VERTICES;
    assert_int_equal(ca_mesh_validate(&mesh, "a.ply", &error), CA_ERROR_FORMAT);
    assert_string_equal(error.message, "a.ply: triangle 70000 uses vertex 3001, but there are only 3001");
    ca_mesh_destroy(&mesh);
}

static ca_mesh turned_rectangle(double half, double angle)
{
    ca_mesh mesh;
    ca_affine map;
    const ca_matrix scale = ca_matrix_scale(half, half, half), rotate = ca_matrix_rotate(1.0, 2.0, 3.0, angle);
    const ca_matrix move = ca_matrix_translate(5.0, -6.0, 7.0), turned = ca_matrix_multiply(&rotate, &scale);
    const ca_matrix all = ca_matrix_multiply(&move, &turned);
    assert_true(ca_affine_from_matrix(&all, &map));
    assert_int_equal(ca_mesh_create_rectangle(&mesh, NULL), CA_OK);
    ca_mesh_transform(&mesh, &map);
    ca_mesh_normalize_normals(&mesh);
    return mesh;
}

/* Rounding of the corners makes a small plane no curved one and a small square no other shape; the normals of what is
 * as small as its rounding are kept. */
static void small_rectangles_stay_rectangles(void **unused)
{
    (void)unused;
    for (int i = 0; i < 360; ++i) {
        ca_mesh mesh = turned_rectangle(0.02, (double)i);
        assert_true(ca_mesh_normals_are_flat(&mesh));
        float *n = mesh.normals + 3 * (i % 4);
        n[fabsf(n[0]) < 0.6f ? 0 : 1] += 1e-3f; /* across */
        ca_mesh_normalize_normals(&mesh);
        assert_false(ca_mesh_normals_are_flat(&mesh));
        ca_mesh_drop_normals(&mesh);
        assert_true(ca_rectangle_from_mesh(&mesh).is_plain);
        mesh.positions[3] += 4e-6f, mesh.positions[4] -= 4e-6f;
        assert_false(ca_rectangle_from_mesh(&mesh).exists);
        ca_mesh_destroy(&mesh);
    }
    ca_mesh mesh = turned_rectangle(1e-4, 40.0);
    assert_false(ca_mesh_normals_are_flat(&mesh));
    ca_mesh_drop_normals(&mesh);
    assert_false(ca_rectangle_from_mesh(&mesh).exists);
    ca_mesh_destroy(&mesh);
}

static void attributes_are_found_by_name(void **unused)
{
    (void)unused;
    ca_mesh mesh;
    float *color, *weight;
    assert_int_equal(ca_mesh_create_rectangle(&mesh, NULL), CA_OK);
    const size_t bytes = ca_mesh_bytes(&mesh);
    assert_int_equal(bytes, sizeof(float) * (13 + 12 + 8) + sizeof(uint32_t) * 6);
    assert_int_equal(ca_mesh_add_attribute(&mesh, "vertex_color", 3, false, &color, NULL), CA_OK);
    assert_int_equal(ca_mesh_add_attribute(&mesh, "face_weight", 1, true, &weight, NULL), CA_OK);
    assert_int_equal(ca_mesh_bytes(&mesh), bytes + sizeof(float) * (12 + 2));
    assert_ptr_equal(ca_mesh_find_attribute(&mesh, "vertex_color")->values, color);
    assert_ptr_equal(ca_mesh_find_attribute(&mesh, "face_weight")->values, weight);
    assert_null(ca_mesh_find_attribute(&mesh, "face_color"));
    weight[1] = NAN;
    ca_error error;
    assert_int_equal(ca_mesh_validate(&mesh, "a.ply", &error), CA_ERROR_FORMAT);
    assert_string_equal(error.message, "a.ply: the attribute \"face_weight\" of triangle 1 is not a finite number");
    ca_mesh_destroy(&mesh);
}

static void validation_names_what_is_wrong(void **unused)
{
    (void)unused;
    ca_mesh mesh;
    ca_error error;
    assert_int_equal(ca_mesh_create_cube(&mesh, NULL), CA_OK);
    mesh.indices[3 * 7 + 1] = 24;
    assert_int_equal(ca_mesh_validate(&mesh, "a.obj", &error), CA_ERROR_FORMAT);
    assert_string_equal(error.message, "a.obj: triangle 7 uses vertex 24, but there are only 24");
    mesh.indices[3 * 7 + 1] = 0;
    mesh.positions[3 * 23 + 2] = INFINITY;
    assert_int_equal(ca_mesh_validate(&mesh, "a.obj", &error), CA_ERROR_FORMAT);
    assert_string_equal(error.message, "a.obj: the position of vertex 23 is not a finite number");
    mesh.positions[3 * 23 + 2] = 0.0f;
    mesh.uvs[1] = NAN;
    assert_int_equal(ca_mesh_validate(&mesh, "a.obj", &error), CA_ERROR_FORMAT);
    ca_mesh_destroy(&mesh);
    assert_int_equal(ca_mesh_create(&mesh, 3, 0, false, false, NULL), CA_OK);
    assert_int_equal(ca_mesh_validate(&mesh, "a.obj", &error), CA_ERROR_FORMAT);
    ca_mesh_destroy(&mesh);
}

static void sizes_over_the_limits_are_refused(void **unused)
{
    (void)unused;
    ca_mesh mesh;
    assert_int_equal(ca_mesh_create(&mesh, (size_t)1 << 31, 1, false, false, NULL), CA_ERROR_UNSUPPORTED);
    assert_int_equal(ca_mesh_create(&mesh, 3, ((size_t)1 << 30) + 1, false, false, NULL), CA_ERROR_UNSUPPORTED);
    assert_int_equal(ca_mesh_create(&mesh, SIZE_MAX, SIZE_MAX, true, true, NULL), CA_ERROR_UNSUPPORTED);
    assert_null(mesh.positions);
}

static ca_status build_everything(ca_mesh *mesh)
{
    float *values;
    ca_status status = ca_mesh_create_cube(mesh, NULL);
    if (status == CA_OK) status = ca_mesh_add_attribute(mesh, "vertex_color", 3, false, &values, NULL);
    if (status == CA_OK) status = ca_mesh_add_attribute(mesh, "face_weight", 1, true, &values, NULL);
    if (status == CA_OK) ca_mesh_drop_normals(mesh);
    if (status == CA_OK) status = ca_mesh_compute_normals(mesh, 0, NULL);
    return status;
}

static void every_allocation_may_fail(void **unused)
{
    (void)unused;
    for (long n = 0;; ++n) {
        ca_mesh mesh = {0};
        ca_memory_fail_after(n);
        const ca_status status = build_everything(&mesh);
        ca_memory_fail_after(-1);
        ca_mesh_destroy(&mesh);
        if (status == CA_OK) {
            assert_true(n >= 12);
            return;
        }
        assert_int_equal(status, CA_ERROR_MEMORY);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rectangle_is_mitsubas),
        cmocka_unit_test(cube_is_mitsubas),
        cmocka_unit_test(outside_stays_outside_under_any_map),
        cmocka_unit_test(smooth_normals_do_not_see_the_triangulation),
        cmocka_unit_test(smooth_normals_do_not_see_the_threads),
        cmocka_unit_test(smooth_normals_are_sums_over_corners),
        cmocka_unit_test(smooth_normals_cost_little),
        cmocka_unit_test(large_meshes_are_measured_as_a_whole),
        cmocka_unit_test(large_meshes_are_checked_to_the_end),
        cmocka_unit_test(small_rectangles_stay_rectangles),
        cmocka_unit_test(attributes_are_found_by_name),
        cmocka_unit_test(validation_names_what_is_wrong),
        cmocka_unit_test(sizes_over_the_limits_are_refused),
        cmocka_unit_test(every_allocation_may_fail),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
