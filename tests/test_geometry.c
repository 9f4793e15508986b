/* Intersection and surface points: no self-intersection at any scale, no leaks at edges, exact quadrics, instances
 * that equal transformed copies. */
#include "geometry/accel.h"
#include "geometry/quadric.h"
#include "math/numeric.h"
#include "sampling/warp.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* A small generator of its own, so that these tests do not depend on the samplers. */
static uint64_t random_state = 1;
static float uniform(void)
{
    random_state = random_state * 6364136223846793005ull + 1442695040888963407ull;
    return (float)(random_state >> 40) * 0x1p-24f;
}
static float between(float low, float high) { return low + (high - low) * uniform(); }
static ca_vec3 random_direction(void) { return ca_warp_sphere((ca_vec2){uniform(), uniform()}); }
static ca_vec3 random_point(float half)
{
    return ca_vec3_make(between(-half, half), between(-half, half), between(-half, half));
}

static ca_accel *build(const ca_shape *shapes, uint32_t count, const ca_accel_instance *instances,
                       uint32_t instance_count, uint32_t world_count)
{
    ca_accel *accel = NULL;
    ca_error error;
    const ca_status status =
        ca_accel_create(shapes, count, world_count, instances, instance_count, 1, NULL, &accel, &error);
    if (status != CA_OK) fail_msg("%s", error.message);
    return accel;
}

static ca_shape mesh_shape(const ca_mesh *mesh)
{
    ca_shape shape = {.kind = CA_SHAPE_MESH, .as.mesh.mesh = mesh, .light = CA_NONE};
    for (uint32_t i = 0; i < 3 * mesh->vertex_count; i++)
        shape.as.mesh.extent = fmaxf(shape.as.mesh.extent, fabsf(mesh->positions[i]));
    return shape;
}

static void set_vertex(ca_mesh *mesh, uint32_t index, ca_vec3 p)
{
    mesh->positions[3 * index + 0] = p.x;
    mesh->positions[3 * index + 1] = p.y;
    mesh->positions[3 * index + 2] = p.z;
}

/* `count` loose triangles with edges of about `scale` around points up to `spread` from `center`. */
static void random_triangles(ca_mesh *mesh, uint32_t count, float scale, float spread, ca_vec3 center)
{
    assert_int_equal(ca_mesh_create(mesh, 3 * (size_t)count, count, false, false, NULL), CA_OK);
    for (uint32_t i = 0; i < count; i++) {
        const ca_vec3 middle = ca_add(center, random_point(spread));
        for (uint32_t k = 0; k < 3; k++) {
            set_vertex(mesh, 3 * i + k, ca_add(middle, random_point(scale)));
            mesh->indices[3 * i + k] = 3 * i + k;
        }
    }
}

/* Rays aimed at a random point of random triangles; from what they hit, rays go on in all directions, and none of
 * them may hit the triangle they start on. */
static uint32_t count_self_hits(const ca_accel *accel, const ca_mesh *mesh, uint32_t trials)
{
    uint32_t self_hits = 0;
    for (uint32_t i = 0; i < trials; i++) {
        const uint32_t target = (uint32_t)(uniform() * (float)mesh->triangle_count);
        const ca_vec2 b = ca_warp_triangle((ca_vec2){uniform(), uniform()});
        const float *p = mesh->positions + 9 * (size_t)target;
        const float w[3] = {1.0f - b.x - b.y, b.x, b.y};
        ca_vec3 point = {0};
        for (int k = 0; k < 3; k++) point = ca_madd(point, w[k], ca_vec3_make(p[3 * k], p[3 * k + 1], p[3 * k + 2]));
        const ca_vec3 edge = ca_vec3_make(p[3] - p[0], p[4] - p[1], p[5] - p[2]);
        const ca_vec3 direction = random_direction();
        const ca_vec3 origin = ca_madd(point, -10.0f * ca_length(edge), direction);
        ca_hit hit;
        if (!ca_accel_intersect(accel, origin, direction, 0.0f, INFINITY, &hit)) continue;
        ca_surface surface;
        ca_accel_surface(accel, origin, direction, &hit, &surface);
        for (int k = 0; k < 4; k++) {
            /* every fourth ray grazes the surface */
            ca_vec3 out = random_direction();
            if (k == 3)
                out = ca_normalize(ca_madd(out, -ca_dot(out, surface.ng) * between(0.999f, 1.0f), surface.ng));
            const ca_vec3 start = ca_offset_origin(surface.position, surface.position_error, surface.ng, out);
            ca_hit next;
            if (ca_accel_intersect(accel, start, out, 0.0f, INFINITY, &next) && next.primitive == hit.primitive &&
                next.shape == hit.shape && next.instance == hit.instance)
                self_hits++;
        }
    }
    return self_hits;
}

static void test_no_self_intersection_at_any_scale(void **state)
{
    (void)state;
    for (int exponent = -5; exponent <= 5; exponent++)
        for (int far = 0; far < 2; far++) {
            const float scale = powf(10.0f, (float)exponent);
            const ca_vec3 center = far ? ca_mul(random_direction(), 1000.0f * scale) : ca_vec3_make(0, 0, 0);
            ca_mesh mesh;
            random_triangles(&mesh, 500, scale, 20.0f * scale, center);
            const ca_shape shape = mesh_shape(&mesh);
            ca_accel *accel = build(&shape, 1, NULL, 0, 1);
            const uint32_t self_hits = count_self_hits(accel, &mesh, 5000);
            ca_accel_destroy(accel);
            ca_mesh_destroy(&mesh);
            if (self_hits)
                fail_msg("%u self-intersections of 20000 at scale 1e%d%s", self_hits, exponent,
                         far ? ", far away" : "");
        }
}

static void test_no_self_intersection_in_instances(void **state)
{
    (void)state;
    for (int trial = 0; trial < 8; trial++) {
        ca_mesh mesh;
        random_triangles(&mesh, 500, 1.0f, 10.0f, random_point(30.0f));
        const ca_shape shape = mesh_shape(&mesh);
        ca_matrix rotate = ca_matrix_rotate(1, 2, 3, 77.0 * trial), scale = ca_matrix_scale(0.1, 3.0, 1.7);
        const ca_matrix move = ca_matrix_translate(100, -30, 5);
        rotate = ca_matrix_multiply(&rotate, &scale);
        const ca_matrix map = ca_matrix_multiply(&move, &rotate);
        ca_accel_instance instance = {.first_shape = 0, .shape_count = 1};
        assert_true(ca_affine_from_matrix(&map, &instance.map));
        ca_accel *accel = build(&shape, 1, &instance, 1, 0);
        /* the same triangles in world space, to aim at */
        ca_mesh world;
        random_triangles(&world, 500, 1.0f, 1.0f, ca_vec3_make(0, 0, 0));
        memcpy(world.positions, mesh.positions, 4500 * sizeof(float));
        ca_mesh_transform(&world, &instance.map);
        assert_int_equal(count_self_hits(accel, &world, 10000), 0);
        ca_accel_destroy(accel);
        ca_mesh_destroy(&mesh);
        ca_mesh_destroy(&world);
    }
}

/* Distance from a point on a face of the cube to the nearest other face. */
static float edge_distance(ca_vec3 p, ca_vec3 center, float half)
{
    const ca_vec3 d = ca_abs3(ca_sub(p, center));
    const float largest = ca_max3(d);
    const float middle = d.x + d.y + d.z - largest - fminf(d.x, fminf(d.y, d.z));
    return half - middle;
}

/* Inside a cube every point of a face sees every point of the others, whatever the size and place of the cube. */
static void test_faces_of_a_cube_see_each_other(void **state)
{
    (void)state;
    for (int exponent = -4; exponent <= 4; exponent++) {
        const float scale = powf(10.0f, (float)exponent);
        ca_mesh mesh;
        assert_int_equal(ca_mesh_create_cube(&mesh, NULL), CA_OK);
        const ca_vec3 center = ca_mul(random_direction(), 100.0f * scale);
        for (uint32_t i = 0; i < mesh.vertex_count; i++)
            set_vertex(
                &mesh, i,
                ca_madd(center, scale,
                        ca_vec3_make(mesh.positions[3 * i], mesh.positions[3 * i + 1], mesh.positions[3 * i + 2])));
        const ca_shape shape = mesh_shape(&mesh);
        ca_accel *accel = build(&shape, 1, NULL, 0, 1);
        uint32_t blocked = 0, pairs = 0;
        for (int i = 0; i < 20000; i++) {
            ca_surface s[2];
            ca_hit hit[2];
            for (int k = 0; k < 2; k++) {
                const ca_vec3 d = random_direction();
                assert_true(ca_accel_intersect(accel, center, d, 0.0f, INFINITY, &hit[k]));
                ca_accel_surface(accel, center, d, &hit[k], &s[k]);
            }
            if (ca_dot(s[0].ng, s[1].ng) > 0.5f) continue; /* the same face */
            /* a point that rounding may have put beyond the neighbouring face sees nothing, rightly */
            if (edge_distance(s[0].position, center, scale) < 4.0f * ca_max3(s[0].position_error) ||
                edge_distance(s[1].position, center, scale) < 4.0f * ca_max3(s[1].position_error))
                continue;
            pairs++;
            blocked += !ca_accel_visible(accel, s[0].position, s[0].position_error, s[0].ng, s[1].position,
                                         s[1].position_error, s[1].ng);
        }
        ca_accel_destroy(accel);
        ca_mesh_destroy(&mesh);
        assert_true(pairs > 10000);
        if (blocked) fail_msg("%u of %u free segments are blocked at scale 1e%d", blocked, pairs, exponent);
    }
}

/* A closed ball of triangles: rings x segments quads, poles welded. */
static void ball(ca_mesh *mesh, uint32_t rings, uint32_t segments, ca_vec3 center, float radius)
{
    const uint32_t vertices = (rings - 1) * segments + 2;
    assert_int_equal(ca_mesh_create(mesh, vertices, 2 * (size_t)segments * (rings - 1), false, false, NULL), CA_OK);
    for (uint32_t r = 1; r < rings; r++)
        for (uint32_t s = 0; s < segments; s++) {
            const float theta = CA_PI * (float)r / (float)rings, phi = CA_TWO_PI * (float)s / (float)segments;
            set_vertex(
                mesh, (r - 1) * segments + s,
                ca_madd(center, radius, ca_vec3_make(sinf(theta) * cosf(phi), sinf(theta) * sinf(phi), cosf(theta))));
        }
    const uint32_t top = vertices - 2, bottom = vertices - 1;
    set_vertex(mesh, top, ca_madd(center, radius, ca_vec3_make(0, 0, 1)));
    set_vertex(mesh, bottom, ca_madd(center, radius, ca_vec3_make(0, 0, -1)));
    uint32_t t = 0;
    for (uint32_t s = 0; s < segments; s++) {
        const uint32_t next = (s + 1) % segments;
        const uint32_t cap[2][3] = {{top, s, next},
                                    {bottom, (rings - 2) * segments + next, (rings - 2) * segments + s}};
        memcpy(mesh->indices + 3 * t++, cap[0], sizeof cap[0]);
        memcpy(mesh->indices + 3 * t++, cap[1], sizeof cap[1]);
        for (uint32_t r = 0; r + 2 < rings; r++) {
            const uint32_t a = r * segments + s, b = r * segments + next, c = a + segments, d = b + segments;
            const uint32_t quad[2][3] = {{a, c, b}, {b, c, d}};
            memcpy(mesh->indices + 3 * t++, quad[0], sizeof quad[0]);
            memcpy(mesh->indices + 3 * t++, quad[1], sizeof quad[1]);
        }
    }
    assert_int_equal(t, mesh->triangle_count);
}

/* A point on edge k of a triangle, `w` of the way along it. */
static ca_vec3 edge_point(const ca_mesh *mesh, uint32_t triangle, uint32_t k, float w)
{
    const float *a = mesh->positions + 3 * mesh->indices[3 * triangle + k];
    const float *b = mesh->positions + 3 * mesh->indices[3 * triangle + (k + 1) % 3];
    return ca_vec3_make(ca_lerp(a[0], b[0], w), ca_lerp(a[1], b[1], w), ca_lerp(a[2], b[2], w));
}

/* No ray leaves the ball through an edge. Embree's edge tests agree between neighbours, but they are not exact: of
 * rays aimed exactly at a corner a few in a thousand slip through where all edges of the fan round to the same side;
 * a random ray comes that near a corner about once in 10^12. */
static void test_edges_do_not_leak(void **state)
{
    (void)state;
    const ca_vec3 center = {3.1f, -7.7f, 12.3f};
    ca_mesh mesh;
    ball(&mesh, 40, 80, center, 2.5f);
    const ca_shape shape = mesh_shape(&mesh);
    ca_accel *accel = build(&shape, 1, NULL, 0, 1);
    uint32_t edge_leaks = 0, corner_leaks = 0, random_leaks = 0;
    enum { TRIALS = 200000 };
    for (int i = 0; i < TRIALS; i++) {
        const uint32_t triangle = (uint32_t)(uniform() * (float)mesh.triangle_count),
                       k = (uint32_t)(uniform() * 3.0f);
        const ca_vec3 origin = ca_add(center, random_point(1.0f));
        const ca_vec3 to_edge = ca_sub(edge_point(&mesh, triangle, k, between(0.001f, 0.999f)), origin);
        const ca_vec3 to_corner = ca_sub(edge_point(&mesh, triangle, k, 0.0f), origin);
        ca_hit hit;
        edge_leaks += !ca_accel_intersect(accel, origin, to_edge, 0.0f, INFINITY, &hit);
        corner_leaks += !ca_accel_intersect(accel, origin, to_corner, 0.0f, INFINITY, &hit);
        random_leaks += !ca_accel_intersect(accel, origin, random_direction(), 0.0f, INFINITY, &hit);
    }
    ca_accel_destroy(accel);
    ca_mesh_destroy(&mesh);
    print_message("    leaks of %d rays: %u at edges, %u exactly at corners, %u elsewhere\n", TRIALS, edge_leaks,
                  corner_leaks, random_leaks);
    assert_int_equal(edge_leaks, 0);
    assert_int_equal(random_leaks, 0);
    assert_true(corner_leaks < TRIALS / 200);
}

static ca_shape sphere_shape(ca_vec3 center, float radius)
{
    ca_shape shape = {.kind = CA_SHAPE_SPHERE, .light = CA_NONE, .as.sphere = {.center = center, .radius = radius}};
    const ca_matrix move = ca_matrix_translate((double)center.x, (double)center.y, (double)center.z);
    const ca_matrix scale = ca_matrix_scale((double)radius, (double)radius, (double)radius);
    const ca_matrix map = ca_matrix_multiply(&move, &scale);
    assert_true(ca_affine_from_matrix(&map, &shape.as.sphere.map));
    return shape;
}

/* Nearest positive root in extended precision: the oracle. */
static long double sphere_distance(ca_vec3 center, float radius, ca_vec3 o, ca_vec3 d)
{
    const long double c[3] = {(long double)center.x - (long double)o.x, (long double)center.y - (long double)o.y,
                              (long double)center.z - (long double)o.z};
    const long double v[3] = {(long double)d.x, (long double)d.y, (long double)d.z};
    const long double a = v[0] * v[0] + v[1] * v[1] + v[2] * v[2], b = c[0] * v[0] + c[1] * v[1] + c[2] * v[2];
    const long double n[3] = {c[0] - b / a * v[0], c[1] - b / a * v[1], c[2] - b / a * v[2]};
    const long double r = (long double)radius;
    const long double q = a * (r * r - (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]));
    if (q < 0.0L) return -1.0L;
    const long double t0 = (b - sqrtl(q)) / a, t1 = (b + sqrtl(q)) / a;
    return t0 > 0.0L ? t0 : t1;
}

static void test_spheres_are_exact(void **state)
{
    (void)state;
    for (int exponent = -4; exponent <= 4; exponent++)
        for (int trial = 0; trial < 3000; trial++) {
            const float radius = powf(10.0f, (float)exponent) * between(0.5f, 2.0f);
            const ca_vec3 center = random_point(100.0f * radius);
            const ca_shape shape = sphere_shape(center, radius);
            const ca_vec3 origin = ca_add(center, random_point(between(0.1f, 1000.0f) * radius));
            const ca_vec3 aim = ca_madd(center, radius * sqrtf(uniform()), random_direction());
            const ca_vec3 direction = ca_normalize(ca_sub(aim, origin));
            const long double expected = sphere_distance(center, radius, origin, direction);
            float t;
            if (!ca_quadric_intersect(&shape, origin, direction, 0.0f, INFINITY, &t)) {
                assert_true(expected <= 0.0L);
                continue;
            }
            assert_true(fabsl((long double)t - expected) <= 1e-6L * expected);
            ca_surface surface = {0};
            ca_quadric_surface(&shape, ca_madd(origin, t, direction), &surface);
            /* on the sphere within its own error bound, normal radial */
            const double x = (double)surface.position.x - (double)center.x,
                         y = (double)surface.position.y - (double)center.y,
                         z = (double)surface.position.z - (double)center.z;
            const double off = fabs(sqrt(x * x + y * y + z * z) - (double)radius);
            assert_true(off <= (double)ca_length(surface.position_error));
            assert_true(fabsf(ca_length(surface.ng) - 1.0f) < 1e-6f);
            for (int k = 0; k < 4; k++) {
                const ca_vec3 out = random_direction();
                const ca_vec3 start = ca_offset_origin(surface.position, surface.position_error, surface.ng, out);
                float again;
                const bool outside = ca_dot(out, surface.ng) > 0.0f;
                const bool hit = ca_quadric_intersect(&shape, start, out, 0.0f, INFINITY, &again);
                if (outside) assert_false(hit);
                /* to the inside: one chord, of the right length */
                const float chord = -2.0f * radius * ca_dot(out, surface.ng);
                if (!outside && chord > 0.1f * radius) {
                    assert_true(hit);
                    assert_true(fabsf(again - chord) < 1e-3f * radius);
                }
            }
        }
}

/* Rays at, from and within a sphere, and segments that end near it. */
static void random_ray(ca_vec3 center, float radius, int kind, ca_vec3 *o, ca_vec3 *d, float *t_min, float *t_max)
{
    const ca_vec3 on_it = ca_madd(center, radius, random_direction());
    *o = ca_add(center, random_point(between(0.1f, 30.0f) * radius));
    *d = ca_mul(ca_sub(ca_madd(center, radius * between(0.0f, 1.2f), random_direction()), *o), between(0.1f, 3.0f));
    *t_min = 0.0f, *t_max = INFINITY;
    if (kind == 1) *o = on_it;
    if (kind == 2) *o = ca_madd(center, radius * uniform(), random_direction());
    if (kind == 3) *d = ca_sub(on_it, *o), *t_max = between(0.9999f, 1.0001f);
    if (kind == 4) *t_min = uniform(), *t_max = 1.0f + uniform();
    if (kind == 5) d->x = 0.0f, d->z = -0.0f;
    if (kind == 6) *d = (ca_vec3){0.0f, 0.0f, 0.0f};
}

typedef struct eight_rays {
    ca_vec3 origin[CA_LANES], direction[CA_LANES];
    float t_min[CA_LANES], t_max[CA_LANES];
} eight_rays;

/* The eight together meet the shape where each alone does, to the bit; returns how many meet it. */
static uint32_t check_eight_rays(const ca_shape *shape, const eight_rays *rays)
{
    uint32_t met = 0;
    ca_v8 o8, d8;
    ca_f8 t_min8, t_max8;
    float expected[CA_LANES];
    for (int i = 0; i < CA_LANES; i++) {
        const ca_vec3 o = rays->origin[i], d = rays->direction[i];
        const float t_min = rays->t_min[i], t_max = rays->t_max[i];
        if (!ca_quadric_intersect(shape, o, d, t_min, t_max, &expected[i])) expected[i] = t_max;
        met += expected[i] < t_max;
        o8.x[i] = o.x, o8.y[i] = o.y, o8.z[i] = o.z, d8.x[i] = d.x, d8.y[i] = d.y, d8.z[i] = d.z;
        t_min8[i] = t_min, t_max8[i] = t_max;
    }
    const ca_f8 t = ca_quadric_intersect8(shape, o8, d8, t_min8, t_max8);
    assert_memory_equal(&t, expected, sizeof t);
    return met;
}

static void test_eight_rays_meet_a_quadric_as_one_does(void **state)
{
    (void)state;
    uint32_t met = 0;
    for (int trial = 0; trial < 20000; trial++) {
        const float radius = powf(10.0f, between(-3.0f, 3.0f));
        const ca_vec3 center = random_point(10.0f * radius);
        const ca_shape shape = sphere_shape(center, radius);
        eight_rays rays;
        for (int i = 0; i < CA_LANES; i++)
            random_ray(center, radius, (trial + i) % 7, &rays.origin[i], &rays.direction[i], &rays.t_min[i],
                       &rays.t_max[i]);
        met += check_eight_rays(&shape, &rays);
    }
    assert_in_range(met, 20000 * CA_LANES / 4, 20000 * CA_LANES * 9 / 10);
}

/* Single precision finds eight rays that all miss the sphere, and they are not looked at again. A ray that just meets
 * the sphere must not be among them: seven rays miss it clearly, and the eighth grazes it, or begins at it and leads
 * out, 1e-7 to 1e-3 of the radius inside or outside. */
static void test_of_eight_rays_one_may_graze_a_sphere(void **state)
{
    (void)state;
    uint32_t met = 0;
    for (int trial = 0; trial < 40000; trial++) {
        const float radius = powf(10.0f, between(-3.0f, 3.0f));
        const ca_vec3 center = random_point(10.0f * radius);
        const ca_shape shape = sphere_shape(center, radius);
        const ca_vec3 axis = random_direction();
        const ca_vec3 side = ca_normalize(ca_cross(axis, random_direction()));
        const float doubt = powf(10.0f, between(-7.0f, -3.0f)) * (uniform() < 0.5f ? -1.0f : 1.0f);
        const int grazing = trial % CA_LANES;
        eight_rays rays;
        for (int i = 0; i < CA_LANES; i++) {
            const float passes = i != grazing ? between(1.1f, 30.0f) : 1.0f + doubt;
            const float away = i != grazing || trial % 3 ? between(1.1f, 300.0f) : 0.0f;
            ca_vec3 d = ca_mul(axis, powf(10.0f, between(-3.5f, 3.5f)));
            if (away == 0.0f) d = ca_madd(ca_mul(side, between(0.0f, 1.0f)), 1.0f, axis);
            if (i != grazing && trial % 2) d = ca_neg(d);
            rays.origin[i] = ca_madd(ca_madd(center, -away * radius, axis), passes * radius, side);
            rays.direction[i] = d;
            rays.t_min[i] = 0.0f, rays.t_max[i] = INFINITY;
        }
        met += check_eight_rays(&shape, &rays);
    }
    assert_in_range(met, 40000 / 4, 40000 * 3 / 4);
}

/* The first of the two places where a ray in the cylinder's own space meets it, INFINITY if there is none. `doubt`: a
 * place is too near the end to tell. */
static float cylinder_oracle(ca_vec3 o, ca_vec3 d, bool *doubt)
{
    const double a = (double)d.x * (double)d.x + (double)d.y * (double)d.y;
    const double b = (double)o.x * (double)d.x + (double)o.y * (double)d.y;
    const double c = (double)o.x * (double)o.x + (double)o.y * (double)o.y - 1.0, inside = b * b - a * c;
    *doubt = fabs(inside) < 1e-4 || a < 1e-4;
    if (*doubt || inside < 0.0) return INFINITY;
    for (int sign = -1; sign <= 1; sign += 2) {
        const double t = (-b + sign * sqrt(inside)) / a, z = (double)o.z + t * (double)d.z;
        *doubt = *doubt || fabs(t) < 1e-3 || fabs(z) < 1e-3 || fabs(z - 1.0) < 1e-3;
        if (t > 0.0 && z >= 0.0 && z <= 1.0) return (float)t;
    }
    return INFINITY;
}

/* From outside and inside of it, through its ends too. */
static void test_cylinders_against_their_equation(void **state)
{
    (void)state;
    const ca_matrix turn = ca_matrix_rotate(1, -1, 2, 70.0), move = ca_matrix_translate(-1.0, 0.5, 2.0);
    ca_matrix map = ca_matrix_scale(0.5, 0.5, 2.0);
    map = ca_matrix_multiply(&turn, &map);
    map = ca_matrix_multiply(&move, &map);
    ca_shape cylinder = {
        .kind = CA_SHAPE_CYLINDER, .light = CA_NONE, .as.cylinder = {.radius = 0.5f, .length = 2.0f}};
    assert_true(ca_affine_from_matrix(&map, &cylinder.as.cylinder.map));
    const ca_affine *to = &cylinder.as.cylinder.map;
    uint32_t inside = 0, missed = 0, hits = 0;
    for (int i = 0; i < 50000; i++) {
        const ca_vec3 lo = {between(-1.6f, 1.6f), between(-1.6f, 1.6f), between(-0.3f, 1.3f)};
        const ca_vec3 o = ca_map_point(to->to, lo), d = random_direction();
        bool doubt;
        const float expected = cylinder_oracle(ca_map_point(to->from, o), ca_map_vector(to->from, d), &doubt);
        if (doubt) continue;
        float t = INFINITY;
        const bool hit = ca_quadric_intersect(&cylinder, o, d, 0.0f, INFINITY, &t);
        assert_int_equal(hit, isfinite(expected));
        if (hit) assert_true(fabsf(t - expected) < 1e-3f * (1.0f + expected));
        hits += hit;
        missed += !hit;
        inside += hit && lo.x * lo.x + lo.y * lo.y < 1.0f;
    }
    assert_true(inside > 5000 && missed > 5000 && hits > 15000);
}

static void test_disks_and_cylinders(void **state)
{
    (void)state;
    ca_shape disk = {.kind = CA_SHAPE_DISK, .light = CA_NONE, .needs_tangents = true};
    ca_matrix map = ca_matrix_scale(2.0, 3.0, 1.0);
    const ca_matrix move = ca_matrix_translate(1.0, 2.0, 3.0), turn = ca_matrix_rotate(1, 1, 0, 30.0);
    map = ca_matrix_multiply(&turn, &map);
    map = ca_matrix_multiply(&move, &map);
    assert_true(ca_affine_from_matrix(&map, &disk.as.disk.map));
    ca_shape cylinder = {
        .kind = CA_SHAPE_CYLINDER, .light = CA_NONE, .as.cylinder = {.radius = 0.5f, .length = 4.0f}};
    ca_matrix axis = ca_matrix_scale(0.5, 0.5, 4.0);
    axis = ca_matrix_multiply(&turn, &axis);
    axis = ca_matrix_multiply(&move, &axis);
    assert_true(ca_affine_from_matrix(&axis, &cylinder.as.cylinder.map));
    uint32_t hits = 0;
    for (int i = 0; i < 50000; i++) {
        const ca_vec3 o = ca_add(ca_vec3_make(1, 2, 3), random_point(4.0f)), d = random_direction();
        float t;
        const ca_affine *to = &disk.as.disk.map;
        /* oracle: the ray in the disk's own space */
        const ca_vec3 lo = ca_map_point(to->from, o), ld = ca_map_vector(to->from, d);
        const float lt = -lo.z / ld.z;
        const ca_vec3 p = ca_madd(lo, lt, ld);
        const float r2 = p.x * p.x + p.y * p.y;
        const bool hit = ca_quadric_intersect(&disk, o, d, 0.0f, INFINITY, &t);
        if (fabsf(r2 - 1.0f) > 1e-3f) assert_int_equal(hit, lt > 0.0f && r2 < 1.0f);
        if (hit) {
            hits++;
            assert_true(fabsf(t - lt) < 1e-3f * (1.0f + fabsf(lt)));
            ca_surface s = {0};
            ca_quadric_surface(&disk, ca_madd(o, t, d), &s);
            assert_true(fabsf(s.uv.x - sqrtf(r2)) < 1e-3f);
            assert_true(ca_abs_dot(s.ng, ca_normalize(s.dpdu)) < 1e-4f);
            const ca_vec3 start = ca_offset_origin(s.position, s.position_error, s.ng, d);
            assert_false(ca_quadric_intersect(&disk, start, d, 0.0f, INFINITY, &t));
        }
        if (ca_quadric_intersect(&cylinder, o, d, 0.0f, INFINITY, &t)) {
            hits++;
            const ca_affine *frame = &cylinder.as.cylinder.map;
            const ca_vec3 q = ca_map_point(frame->from, ca_madd(o, t, d));
            assert_true(fabsf(q.x * q.x + q.y * q.y - 1.0f) < 2e-4f);
            assert_true(q.z > -1e-5f && q.z < 1.00001f);
            ca_surface s = {0};
            ca_quadric_surface(&cylinder, ca_madd(o, t, d), &s);
            assert_true(fabsf(s.uv.y - q.z) < 1e-4f);
            const ca_vec3 start = ca_offset_origin(s.position, s.position_error, s.ng, s.ng);
            assert_false(ca_quadric_intersect(&cylinder, start, s.ng, 0.0f, INFINITY, &t));
        }
    }
    assert_true(hits > 2000);
}

static void test_an_instance_equals_a_transformed_copy(void **state)
{
    (void)state;
    ca_mesh mesh, copy;
    ball(&mesh, 12, 24, ca_vec3_make(0, 0, 0), 1.0f);
    ball(&copy, 12, 24, ca_vec3_make(0, 0, 0), 1.0f);
    ca_matrix map = ca_matrix_scale(1.0, 2.0, 0.5);
    const ca_matrix turn = ca_matrix_rotate(0, 1, 1, 50.0), move = ca_matrix_translate(5, 6, 7);
    map = ca_matrix_multiply(&turn, &map);
    map = ca_matrix_multiply(&move, &map);
    ca_accel_instance instance = {.first_shape = 0, .shape_count = 1};
    assert_true(ca_affine_from_matrix(&map, &instance.map));
    ca_mesh_transform(&copy, &instance.map);
    const ca_shape instanced = mesh_shape(&mesh), plain = mesh_shape(&copy);
    ca_accel *a = build(&instanced, 1, &instance, 1, 0), *b = build(&plain, 1, NULL, 0, 1);
    uint32_t hits = 0;
    for (int i = 0; i < 20000; i++) {
        const ca_vec3 o = ca_add(ca_vec3_make(5, 6, 7), random_point(2.0f));
        const ca_vec3 d = random_direction();
        ca_hit ha, hb;
        const bool in_a = ca_accel_intersect(a, o, d, 0.0f, INFINITY, &ha),
                   in_b = ca_accel_intersect(b, o, d, 0.0f, INFINITY, &hb);
        if (in_a != in_b || !in_a || ha.primitive != hb.primitive) continue;
        hits++;
        ca_surface sa, sb;
        ca_accel_surface(a, o, d, &ha, &sa);
        ca_accel_surface(b, o, d, &hb, &sb);
        assert_int_equal(sa.instance, 0);
        assert_int_equal(sb.instance, CA_NONE);
        assert_true(ca_length(ca_sub(sa.position, sb.position)) < 2e-4f);
        assert_true(ca_dot(sa.ng, sb.ng) > 0.9999f);
    }
    assert_true(hits > 2000);
    ca_accel_destroy(a);
    ca_accel_destroy(b);
    ca_mesh_destroy(&mesh);
    ca_mesh_destroy(&copy);
}

/* Cross products of sides have any length; floats hold the squares of some. */
static void test_normals_of_large_and_small_triangles(void **state)
{
    (void)state;
    const ca_vec3 unit = ca_normalize(ca_vec3_make(1, -2, 3)), none = ca_normalize_any((ca_vec3){0});
    assert_true(none.x == 0.0f && none.y == 0.0f && none.z == 0.0f);
    ca_mesh mesh;
    ball(&mesh, 12, 24, ca_vec3_make(0, 0, 0), 1.0f);
    const ca_matrix map = ca_matrix_scale(1e-3, 1e-3, 1e-3);
    ca_accel_instance instance = {.first_shape = 0, .shape_count = 1};
    assert_true(ca_affine_from_matrix(&map, &instance.map));
    const ca_shape shape = mesh_shape(&mesh);
    ca_accel *plain = build(&shape, 1, NULL, 0, 1), *instanced = build(&shape, 1, &instance, 1, 0);
    for (int exponent = -40; exponent <= 37; exponent++) {
        const ca_vec3 long_one = ca_mul(unit, powf(10.0f, (float)exponent));
        assert_true(ca_length(ca_sub(ca_normalize_any(long_one), unit)) < (exponent < -35 ? 1e-2f : 1e-6f));
        const ca_vec3 from = {0}, to = {0, 0, 1};
        ca_hit hit;
        ca_surface surface;
        assert_true(ca_accel_intersect(plain, from, to, 0.0f, INFINITY, &hit));
        hit.ng = long_one;
        ca_accel_surface(plain, from, to, &hit, &surface);
        assert_true(ca_dot(surface.ng, unit) > 0.9999f && ca_dot(surface.ns, unit) > 0.9999f);
        assert_true(ca_accel_intersect(instanced, from, to, 0.0f, INFINITY, &hit));
        hit.ng = long_one;
        ca_accel_surface(instanced, from, to, &hit, &surface);
        assert_true(ca_dot(surface.ng, unit) > 0.9999f && ca_dot(surface.ns, unit) > 0.9999f);
    }
    ca_accel_destroy(plain);
    ca_accel_destroy(instanced);
    ca_mesh_destroy(&mesh);
}

static void test_instances_share_memory(void **state)
{
    (void)state;
    ca_mesh mesh;
    ball(&mesh, 100, 200, ca_vec3_make(0, 0, 0), 1.0f);
    const ca_shape shape = mesh_shape(&mesh);
    enum { COUNT = 100 };
    ca_accel_instance instances[COUNT];
    for (int i = 0; i < COUNT; i++) {
        instances[i] = (ca_accel_instance){.first_shape = 0, .shape_count = 1};
        const ca_matrix move = ca_matrix_translate(3.0 * i, 0, 0);
        assert_true(ca_affine_from_matrix(&move, &instances[i].map));
    }
    ca_accel *one = build(&shape, 1, instances, 1, 0), *many = build(&shape, 1, instances, COUNT, 0);
    const size_t one_bytes = ca_accel_bytes(one), many_bytes = ca_accel_bytes(many);
    print_message("    %u triangles: %zu bytes a triangle in Embree, %zu in the mesh; 100 instances take %.2f times "
                  "the memory\n",
                  mesh.triangle_count, one_bytes / mesh.triangle_count, ca_mesh_bytes(&mesh) / mesh.triangle_count,
                  (double)many_bytes / (double)one_bytes);
    assert_true(one_bytes / mesh.triangle_count < 120);
    assert_true(many_bytes < 2 * one_bytes);
    ca_accel_destroy(one);
    ca_accel_destroy(many);
    ca_mesh_destroy(&mesh);
}

#ifdef NDEBUG
static void test_rays_that_are_not_finite_meet_nothing(void **state)
{
    (void)state;
    const ca_shape shape = sphere_shape(ca_vec3_make(0, 0, 0), 1.0f);
    ca_accel *accel = build(&shape, 1, NULL, 0, 1);
    const float bad[] = {NAN, INFINITY, -INFINITY, 1e30f};
    ca_hit hit;
    for (int i = 0; i < 4; i++) {
        assert_false(
            ca_accel_intersect(accel, ca_vec3_make(bad[i], 0, 5), ca_vec3_make(0, 0, -1), 0.0f, INFINITY, &hit));
        if (i < 3)
            assert_false(ca_accel_occluded(accel, ca_vec3_make(0, 0, 5), ca_vec3_make(0, bad[i], -1), 0.0f, 10.0f));
    }
    assert_false(ca_accel_intersect(accel, ca_vec3_make(0, 0, 5), ca_vec3_make(0, 0, -1), 0.0f, NAN, &hit));
    assert_true(ca_accel_intersect(accel, ca_vec3_make(0, 0, 5), ca_vec3_make(0, 0, -1), 0.0f, INFINITY, &hit));
    ca_accel_destroy(accel);
}
#endif

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_no_self_intersection_at_any_scale),
        cmocka_unit_test(test_no_self_intersection_in_instances),
        cmocka_unit_test(test_faces_of_a_cube_see_each_other),
        cmocka_unit_test(test_edges_do_not_leak),
        cmocka_unit_test(test_spheres_are_exact),
        cmocka_unit_test(test_disks_and_cylinders),
        cmocka_unit_test(test_cylinders_against_their_equation),
        cmocka_unit_test(test_an_instance_equals_a_transformed_copy),
        cmocka_unit_test(test_normals_of_large_and_small_triangles),
                                       cmocka_unit_test(test_instances_share_memory),
        cmocka_unit_test(test_eight_rays_meet_a_quadric_as_one_does),
        cmocka_unit_test(test_of_eight_rays_one_may_graze_a_sphere),
#ifdef NDEBUG
        cmocka_unit_test(test_rays_that_are_not_finite_meet_nothing),
#endif
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
