/* Flat pieces of small meshes are met without Embree: the same triangles at the same points as Embree meets them, the
 * same bits for eight rays as for each, no cracks, no ray that meets the piece it starts on. */
#include "geometry/facets.h"
#include "geometry/ray_batch.h"
#include "geometry/triangle.h"
#include "support/random_geometry.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* ---- Meshes ---------------------------------------------------------------------------------------------------- */

static ca_shape mesh_shape(const ca_mesh *mesh)
{
    ca_shape shape = {.kind = CA_SHAPE_MESH, .as.mesh.mesh = mesh, .light = CA_NONE};
    for (uint32_t i = 0; i < 3 * mesh->vertex_count; i++)
        shape.as.mesh.extent = fmaxf(shape.as.mesh.extent, fabsf(mesh->positions[i]));
    return shape;
}

/* Corners of triangles begin at any of the three: all pairings of a parallelogram's halves occur. */
static void turn_triangles(ca_mesh *mesh)
{
    for (uint32_t i = 0; i < mesh->triangle_count; i++) {
        uint32_t *index = mesh->indices + 3 * i, turned[3];
        const uint32_t by = below(3);
        for (uint32_t k = 0; k < 3; k++) turned[k] = index[(k + by) % 3];
        memcpy(index, turned, sizeof turned);
    }
}

/* A cube, stretched, turned and moved: twelve triangles of six parallelograms. */
static void make_box(ca_mesh *mesh, float scale, float distance)
{
    assert_int_equal(ca_mesh_create_cube(mesh, NULL), CA_OK);
    const double s = (double)scale;
    const ca_matrix stretch = ca_matrix_scale(s * (double)between(0.5f, 2.0f), s * (double)between(0.5f, 2.0f), s);
    const ca_vec3 axis = random_direction(), place = ca_mul(random_direction(), distance * scale);
    const double angle = 360.0 * (double)uniform();
    const ca_matrix turn = ca_matrix_rotate((double)axis.x, (double)axis.y, (double)axis.z, angle);
    const ca_matrix move = ca_matrix_translate((double)place.x, (double)place.y, (double)place.z);
    ca_matrix matrix = ca_matrix_multiply(&turn, &stretch);
    matrix = ca_matrix_multiply(&move, &matrix);
    ca_affine map;
    assert_true(ca_affine_from_matrix(&matrix, &map));
    ca_mesh_transform(mesh, &map);
    turn_triangles(mesh);
}

static void set_vertex(ca_mesh *mesh, uint32_t index, ca_vec3 p)
{
    memcpy(mesh->positions + 3 * (size_t)index, (float[3]){p.x, p.y, p.z}, 3 * sizeof(float));
}

/* A closed solid of eight triangles that are no halves of parallelograms. */
static void make_octahedron(ca_mesh *mesh)
{
    static const uint32_t faces[8][3] = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                                         {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    assert_int_equal(ca_mesh_create(mesh, 6, 8, false, false, NULL), CA_OK);
    for (uint32_t i = 0; i < 6; i++) {
        ca_vec3 p = {0};
        (i / 2 == 0 ? &p.x : i / 2 == 1 ? &p.y : &p.z)[0] = between(0.5f, 2.0f) * (i % 2 ? -1.0f : 1.0f);
        set_vertex(mesh, i, ca_add(p, random_point(0.3f)));
    }
    memcpy(mesh->indices, faces, sizeof faces);
    turn_triangles(mesh);
}

static void make_soup(ca_mesh *mesh, uint32_t count)
{
    assert_int_equal(ca_mesh_create(mesh, 3 * (size_t)count, count, false, false, NULL), CA_OK);
    for (uint32_t i = 0; i < 3 * count; i++) {
        set_vertex(mesh, i, random_point(2.0f));
        mesh->indices[i] = i;
    }
}

static ca_accel *build(const ca_shape *shapes, uint32_t count, bool apart)
{
    ca_accel *accel = NULL;
    ca_accel_keep_apart(apart);
    assert_int_equal(ca_accel_create(shapes, count, count, NULL, 0, 1, NULL, &accel, NULL), CA_OK);
    ca_accel_keep_apart(true);
    assert_int_equal(ca_accel_builds(accel), apart ? 0 : 1);
    return accel;
}

/* How many there are; a shape has some or none. */
static uint32_t count_pieces(const ca_shape *shapes, uint32_t count)
{
    static ca_facets facets;
    memset(&facets, 0, sizeof facets);
    assert_true(ca_facets_fill(&facets, shapes, count));
    for (uint32_t i = 0; i < count; i++) {
        uint32_t pieces = 0;
        for (uint32_t k = 0; k < facets.count; k++) pieces += facets.shape[k] == i;
        assert_int_equal(ca_facets_have(&facets, i), pieces > 0);
    }
    return facets.count;
}

/* ---- What is met ----------------------------------------------------------------------------------------------- */

static ca_vec3 point_of(const ca_shape *shapes, const ca_hit *hit)
{
    const ca_triangle t = ca_triangle_load(shapes[hit->shape].as.mesh.mesh, hit->primitive);
    ca_surface surface;
    ca_triangle_position(&t, (ca_vec2){hit->u, hit->v}, &surface);
    return surface.position;
}

/* How near a hit is to a side of its triangle. */
static float side_distance(const ca_hit *hit) { return fminf(fminf(hit->u, hit->v), 1.0f - hit->u - hit->v); }

static void check_as_embree(const ca_shape *shapes, uint32_t count, uint32_t trials)
{
    ca_accel *ours = build(shapes, count, true), *embrees = build(shapes, count, false);
    uint32_t hits = 0, others = 0;
    for (uint32_t i = 0; i < trials; i++) {
        const ca_vec3 origin = random_point(3.0f);
        const ca_vec3 direction = ca_mul(random_direction(), powf(10.0f, between(-2.0f, 2.0f)));
        ca_hit a, b;
        const bool met = ca_accel_intersect(ours, origin, direction, 0.0f, INFINITY, &a);
        const bool expected = ca_accel_intersect(embrees, origin, direction, 0.0f, INFINITY, &b);
        assert_int_equal(ca_accel_occluded(ours, origin, direction, 0.0f, INFINITY), met);
        if (met != expected || (met && (a.shape != b.shape || a.primitive != b.primitive))) {
            assert_true((met && side_distance(&a) < 1e-3f) || (expected && side_distance(&b) < 1e-3f));
            others++;
            continue;
        }
        if (!met) continue;
        hits++;
        const float grazing = ca_abs_dot(ca_normalize(b.ng), ca_normalize(direction)), margin = 1e-5f / grazing;
        assert_true(ca_length(ca_sub(point_of(shapes, &a), point_of(shapes, &b))) < margin);
        assert_true(ca_length(ca_sub(point_of(shapes, &a), ca_madd(origin, a.t, direction))) < margin);
        assert_true(fminf(fminf(a.u, a.v), 1.0f - a.u - a.v) >= -0x1p-23f);
        assert_true(ca_dot(ca_normalize(a.ng), ca_normalize(b.ng)) > 0.99999f);
        assert_int_equal(a.instance, CA_NONE);
    }
    ca_accel_destroy(ours);
    ca_accel_destroy(embrees);
    assert_true(hits > trials / 20);
    assert_true(others < trials / 1000);
}

static void test_meets_what_embree_meets(void **state)
{
    (void)state;
    for (int round = 0; round < 20; round++) {
        ca_mesh meshes[3];
        make_box(&meshes[0], 1.0f, 1.0f);
        make_octahedron(&meshes[1]);
        make_soup(&meshes[2], 20);
        const ca_shape shapes[3] = {mesh_shape(&meshes[0]), mesh_shape(&meshes[1]), mesh_shape(&meshes[2])};
        check_as_embree(shapes, 3, 5000);
        for (int i = 0; i < 3; i++) ca_mesh_destroy(&meshes[i]);
    }
}

/* Halves of parallelograms are one piece, whatever corner they begin with; what folds or bends is not. */
static void test_parallelograms_are_one_piece(void **state)
{
    (void)state;
    for (int round = 0; round < 50; round++) {
        ca_mesh box, octahedron;
        make_box(&box, powf(10.0f, between(-3.0f, 3.0f)), 10.0f);
        make_octahedron(&octahedron);
        const ca_shape shapes[2] = {mesh_shape(&box), mesh_shape(&octahedron)};
        assert_int_equal(count_pieces(shapes, 1), 6);
        assert_int_equal(count_pieces(shapes, 2), 6 + 8);
        ca_mesh_destroy(&box);
        ca_mesh_destroy(&octahedron);
    }
}

/* ---- Eight rays ------------------------------------------------------------------------------------------------ */

static void test_eight_rays_are_as_each(void **state)
{
    (void)state;
    static ca_ray_batch batch;
    static ca_hit_batch hits;
    static uint8_t occluded[CA_RAY_BATCH];
    ca_mesh meshes[2];
    make_box(&meshes[0], 1.0f, 1.0f);
    make_soup(&meshes[1], 25);
    const ca_shape shapes[3] = {mesh_shape(&meshes[0]), mesh_shape(&meshes[1]), mesh_shape(&meshes[0])};
    ca_accel *accel = build(shapes, 3, true);
    for (int round = 0; round < 100; round++) {
        const uint32_t count = 1 + below(CA_RAY_BATCH);
        for (uint32_t i = 0; i < count; i++) {
            ca_column3_set(&batch.origin, i, random_point(3.0f));
            ca_column3_set(&batch.direction, i, below(9) ? random_direction() : (ca_vec3){0.0f, 0.0f, 1.0f});
            batch.t_min[i] = below(3) ? 0.0f : uniform();
            batch.t_max[i] = below(3) ? INFINITY : 3.0f * uniform();
        }
        ca_accel_intersect_batch(accel, &batch, count, &hits);
        ca_accel_occluded_batch(accel, &batch, count, occluded);
        for (uint32_t i = 0; i < count; i++) {
            const ca_vec3 origin = ca_column3_at(&batch.origin, i), direction = ca_column3_at(&batch.direction, i);
            if (batch.t_max[i] <= batch.t_min[i]) continue;
            ca_hit alone, got = ca_hit_batch_at(&hits, i);
            const bool met =
                ca_accel_intersect(accel, origin, direction, batch.t_min[i], batch.t_max[i], &alone);
            assert_int_equal(got.shape != CA_NONE, met);
            if (met) assert_memory_equal(&got, &alone, sizeof got);
            assert_int_equal(occluded[i], met);
        }
    }
    ca_accel_destroy(accel);
    for (int i = 0; i < 2; i++) ca_mesh_destroy(&meshes[i]);
}

/* ---- Rounding -------------------------------------------------------------------------------------------------- */

static ca_vec3 corner(const ca_mesh *mesh, uint32_t triangle, uint32_t k)
{
    return ca_load3(mesh->positions, mesh->indices[3 * (size_t)triangle + k % 3]);
}

static ca_vec3 middle_of(const ca_mesh *mesh)
{
    ca_vec3 sum = {0};
    for (uint32_t i = 0; i < mesh->vertex_count; i++) sum = ca_add(sum, ca_load3(mesh->positions, i));
    return ca_mul(sum, 1.0f / (float)mesh->vertex_count);
}

/* Rays from within a closed solid to places on its edges, and to its corners. */
static uint32_t count_leaks(const ca_mesh *mesh, uint32_t trials)
{
    const ca_shape shape = mesh_shape(mesh);
    ca_accel *accel = build(&shape, 1, true);
    const ca_vec3 middle = middle_of(mesh);
    uint32_t leaks = 0;
    for (uint32_t i = 0; i < trials; i++) {
        const uint32_t triangle = below(mesh->triangle_count), k = below(3);
        const ca_vec3 a = corner(mesh, triangle, k), b = corner(mesh, triangle, k + 1);
        const ca_vec3 aim = below(4) ? ca_madd(a, uniform(), ca_sub(b, a)) : a;
        /* near the middle, or just off a face and so all but along it */
        const ca_vec3 start = corner(mesh, below(mesh->triangle_count), 0);
        const ca_vec3 origin = ca_madd(start, below(2) ? between(0.5f, 1.0f) : 1e-4f, ca_sub(middle, start));
        ca_hit hit;
        leaks += !ca_accel_intersect(accel, origin, ca_sub(aim, origin), 0.0f, INFINITY, &hit);
    }
    ca_accel_destroy(accel);
    return leaks;
}

static void test_closed_solids_have_no_cracks(void **state)
{
    (void)state;
    uint32_t leaks = 0;
    for (int round = 0; round < 40; round++) {
        ca_mesh mesh;
        make_box(&mesh, powf(10.0f, between(-2.0f, 3.0f)), below(2) ? 0.0f : 30.0f);
        leaks += count_leaks(&mesh, 20000);
        ca_mesh_destroy(&mesh);
        make_octahedron(&mesh);
        leaks += count_leaks(&mesh, 10000);
        ca_mesh_destroy(&mesh);
    }
    assert_int_equal(leaks, 0);
}

/* A parallelogram p + s u + t v with s and t in [0, 1], as two triangles. */
static void make_parallelogram(ca_mesh *mesh, ca_vec3 p, ca_vec3 u, ca_vec3 v)
{
    static const uint32_t faces[2][3] = {{0, 1, 2}, {3, 2, 1}};
    assert_int_equal(ca_mesh_create(mesh, 4, 2, false, false, NULL), CA_OK);
    for (uint32_t i = 0; i < 4; i++)
        set_vertex(mesh, i, ca_madd(ca_madd(p, i % 2 ? 1.0f : 0.0f, u), i / 2 ? 1.0f : 0.0f, v));
    memcpy(mesh->indices, faces, sizeof faces);
}

/* Rays from nearby, none of them grazing, to points 1/250 of the longest side beyond a side, or within it. Rounding
 * takes less: 2^-11 of the size, which is at most 1.5 sides, four times where the piece is at the origin and the ray
 * begins three sides off, over the least cosine. */
static uint32_t count_misjudged(const ca_accel *accel, ca_vec3 p, ca_vec3 u, ca_vec3 v)
{
    const ca_vec3 n = ca_normalize(ca_cross(u, v));
    const float longest = fmaxf(ca_length(u), ca_length(v));
    uint32_t wrong = 0;
    for (int i = 0; i < 500; i++) {
        const bool along_u = below(2), outside = below(2);
        const float margin = 4e-3f * longest / ca_length(along_u ? u : v) * (outside ? 1.0f : -1.0f);
        const float across = below(2) ? 1.0f + margin : -margin, along = between(0.1f, 0.9f);
        const ca_vec3 aim = ca_madd(ca_madd(p, along_u ? across : along, u), along_u ? along : across, v);
        ca_vec3 way = random_direction();
        if (ca_abs_dot(way, n) < 0.7f) continue;
        ca_hit hit;
        way = ca_mul(way, between(0.5f, 3.0f) * longest);
        const bool met = ca_accel_intersect(accel, ca_sub(aim, way), way, 0.0f, INFINITY, &hit) && hit.shape == 0;
        wrong += met == outside;
    }
    return wrong;
}

/* Also where the piece is narrow or far from the origin, or where the scene has a large ground. */
static void test_pieces_end_at_their_sides(void **state)
{
    (void)state;
    uint32_t wrong = 0;
    for (int round = 0; round < 400; round++) {
        const float size = powf(10.0f, between(-2.0f, 3.0f)), place = powf(10.0f, between(-1.0f, 3.5f));
        const ca_vec3 p = random_point(place * size), u = ca_mul(random_direction(), size);
        const float narrow = powf(10.0f, between(-2.0f, 0.0f));
        const ca_vec3 v = ca_mul(ca_normalize(ca_cross(u, random_direction())), narrow * size);
        ca_mesh meshes[2];
        make_parallelogram(&meshes[0], p, u, v);
        make_parallelogram(&meshes[1], (ca_vec3){-1e5f, -1e5f, -1e5f}, (ca_vec3){2e5f, 0, 0}, (ca_vec3){0, 2e5f, 0});
        const ca_shape shapes[2] = {mesh_shape(&meshes[0]), mesh_shape(&meshes[1])};
        ca_accel *accel = NULL;
        assert_int_equal(ca_accel_create(shapes, 2, 2, NULL, 0, 1, NULL, &accel, NULL), CA_OK);
        wrong += count_misjudged(accel, p, u, v);
        ca_accel_destroy(accel);
        for (int i = 0; i < 2; i++) ca_mesh_destroy(&meshes[i]);
    }
    assert_int_equal(wrong, 0);
}

/* A sliver's plane and sides are all rounding: rays past its ends, through the line that it lies on, meet no more of
 * it than Embree's, which is a ray in a hundred. */
static void test_slivers_end_where_they_end(void **state)
{
    (void)state;
    uint32_t ghosts = 0;
    for (int round = 0; round < 200; round++) {
        const ca_vec3 p = random_point(1.0f), u = random_direction(), off = ca_cross(u, random_direction());
        ca_mesh mesh;
        make_parallelogram(&mesh, p, u, ca_madd(u, powf(10.0f, between(-7.0f, -2.5f)), off));
        const ca_shape shape = mesh_shape(&mesh);
        ca_accel *accels[2];
        for (int i = 0; i < 2; i++) {
            ca_accel_keep_apart(i == 0);
            assert_int_equal(ca_accel_create(&shape, 1, 1, NULL, 0, 1, NULL, &accels[i], NULL), CA_OK);
        }
        for (int i = 0; i < 500; i++) {
            const ca_vec3 origin = random_point(3.0f), aim = ca_madd(p, between(2.1f, 5.0f), u);
            ca_hit hit;
            ghosts += ca_accel_intersect(accels[0], origin, ca_sub(aim, origin), 0.0f, INFINITY, &hit) &&
                      !ca_accel_intersect(accels[1], origin, ca_sub(aim, origin), 0.0f, INFINITY, &hit);
        }
        for (int i = 0; i < 2; i++) ca_accel_destroy(accels[i]);
        ca_mesh_destroy(&mesh);
    }
    ca_accel_keep_apart(true);
    assert_int_equal(ghosts, 0);
}

/* From a point of a solid's face inwards, also all but along the face: the face itself is not in the way.
 * Outwards, of rays within a rounding of the face's plane a few may meet that plane beyond the face: they carry no
 * light. */
static void test_no_ray_meets_the_piece_it_starts_on(void **state)
{
    (void)state;
    uint32_t self_hits[2] = {0};
    for (int round = 0; round < 200; round++) {
        ca_mesh mesh;
        const float size = powf(10.0f, between(-2.0f, 3.0f));
        make_box(&mesh, size, below(2) ? 0.0f : 30.0f);
        const ca_shape shape = mesh_shape(&mesh);
        ca_accel *accel = build(&shape, 1, true);
        for (int i = 0; i < 1000; i++) {
            const ca_vec3 origin = middle_of(&mesh), direction = random_direction();
            ca_hit hit, next;
            ca_surface surface;
            assert_true(ca_accel_intersect(accel, origin, direction, 0.0f, INFINITY, &hit));
            ca_accel_surface(accel, origin, direction, &hit, &surface);
            ca_vec3 out = random_direction();
            if (i % 2) out = ca_madd(out, -ca_dot(out, surface.ng) * between(0.99f, 1.0f), surface.ng);
            const ca_vec3 start = ca_offset_origin(surface.position, surface.position_error, surface.ng, out);
            const bool outwards = ca_dot(out, surface.ng) * ca_dot(direction, surface.ng) >= 0.0f;
            if (ca_accel_intersect(accel, start, out, 0.0f, INFINITY, &next))
                self_hits[outwards] += ca_abs_dot(ca_normalize(next.ng), surface.ng) > 0.999f &&
                                       next.t * ca_abs_dot(out, surface.ng) < 1e-3f * size;
        }
        ca_accel_destroy(accel);
        ca_mesh_destroy(&mesh);
    }
    assert_int_equal(self_hits[0], 0);
    assert_in_range(self_hits[1], 0, 5); /* of 100 000, half of them grazing */
}

/* ---- Which meshes ---------------------------------------------------------------------------------------------- */

static void test_too_many_large_or_small(void **state)
{
    (void)state;
    const float sizes[] = {1e-8f, 1e7f};
    for (uint32_t more = 0; more < 2; more++) {
        ca_mesh mesh;
        make_soup(&mesh, CA_FACETS + more);
        const ca_shape shape = mesh_shape(&mesh);
        assert_int_equal(count_pieces(&shape, 1), more ? 0 : CA_FACETS);
        ca_mesh_destroy(&mesh);
    }
    for (int i = 0; i < 2; i++) {
        ca_mesh mesh, good;
        make_box(&mesh, sizes[i], 0.0f);
        make_box(&good, 1.0f, 1.0f);
        const ca_shape shapes[2] = {mesh_shape(&mesh), mesh_shape(&good)};
        assert_int_equal(count_pieces(shapes, 2), 6);
        ca_mesh_destroy(&mesh);
        ca_mesh_destroy(&good);
    }
}

/* Where there are too many boxes, the large ones among them lie apart, in whatever place they are. */
static void test_the_large_ones_of_many(void **state)
{
    (void)state;
    enum { BOXES = 40, LARGE = 3 };
    static ca_facets facets;
    ca_mesh meshes[BOXES];
    ca_shape shapes[BOXES];
    const uint32_t first = below(BOXES - LARGE);
    for (uint32_t i = 0; i < BOXES; i++) {
        make_box(&meshes[i], i - first < LARGE ? 5.0f : 0.05f, 1.0f);
        shapes[i] = mesh_shape(&meshes[i]);
    }
    memset(&facets, 0, sizeof facets);
    assert_true(ca_facets_fill(&facets, shapes, BOXES));
    assert_int_equal(facets.count, 6 * LARGE);
    for (uint32_t i = 0; i < BOXES; i++) assert_int_equal(ca_facets_have(&facets, i), i - first < LARGE);
    assert_int_equal(count_pieces(shapes, 16), 6 * 16);
    for (uint32_t i = 0; i < BOXES; i++) ca_mesh_destroy(&meshes[i]);
}

int main(void)
{
    numbers = ca_test_random_seed(1);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_meets_what_embree_meets),
        cmocka_unit_test(test_parallelograms_are_one_piece),
        cmocka_unit_test(test_eight_rays_are_as_each),
        cmocka_unit_test(test_closed_solids_have_no_cracks),
        cmocka_unit_test(test_pieces_end_at_their_sides),
        cmocka_unit_test(test_slivers_end_where_they_end),
        cmocka_unit_test(test_no_ray_meets_the_piece_it_starts_on),
        cmocka_unit_test(test_too_many_large_or_small),
        cmocka_unit_test(test_the_large_ones_of_many),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
