#include "support/extreme_rays.h"

#include "geometry/accel.h"
#include "geometry/ray_batch.h"
#include "support/test_random.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

enum { SHAPES = 4, INSTANCES = 3 };

/* 10 to an even power in the range, of either sign. */
static float power(ca_test_random *random, double low, double high)
{
    const double value = pow(10.0, low + (high - low) * ca_test_random_open(random));
    return (float)(ca_test_random_u32(random) & 1 ? -value : value);
}

/* All that a float can be. */
static float any_number(ca_test_random *random)
{
    static const float special[] = {0.0f, -0.0f, NAN, INFINITY, -INFINITY, 1.0f, 1e18f, 1.844e18f, 1.845e18f, 3e38f};
    const uint32_t kind = ca_test_random_u32(random) % 16;
    if (kind < sizeof special / sizeof special[0]) return special[kind];
    return kind < 13 ? power(random, -45.0, 38.4) : power(random, -3.0, 3.0);
}

static ca_vec3 any_vector(ca_test_random *random)
{
    if (ca_test_random_u32(random) % 4) /* mostly sensible, or all would meet nothing */
        return (ca_vec3){power(random, -2.0, 2.0), power(random, -2.0, 2.0), power(random, -2.0, 2.0)};
    return (ca_vec3){any_number(random), any_number(random), any_number(random)};
}

/* Some are singular, or nearly. */
static ca_affine any_map(ca_test_random *random)
{
    const double range = 20.0 * ca_test_random_open(random);
    for (;;) {
        ca_matrix matrix;
        ca_affine map;
        for (int r = 0; r < 4; r++)
            for (int c = 0; c < 4; c++) matrix.m[r][c] = r == 3 ? c == 3 : (double)power(random, -range, range);
        if (ca_test_random_u32(random) % 2) /* a scaling, as it is usual */
            for (int r = 0; r < 3; r++)
                for (int c = 0; c < 3; c++) matrix.m[r][c] = r == c ? matrix.m[0][0] : 0.0;
        if (ca_affine_from_matrix(&matrix, &map)) return map;
    }
}

static void check_hit(const ca_hit *hit, float t_min, float t_max, extreme_rays *counts)
{
    assert_true(hit->t >= t_min && hit->t <= t_max);
    assert_true(hit->shape < SHAPES && (hit->instance == CA_NONE || hit->instance < INSTANCES));
    counts->hits++;
}

static void trace_batch(const ca_accel *accel, ca_test_random *random, extreme_rays *counts)
{
    static ca_ray_batch rays;
    static ca_hit_batch hits;
    static uint8_t occluded[CA_RAY_BATCH];
    const uint32_t count = 1 + ca_test_random_u32(random) % CA_RAY_BATCH;
    for (uint32_t i = 0; i < count; i++) {
        ca_column3_set(&rays.origin, i, any_vector(random));
        ca_column3_set(&rays.direction, i, any_vector(random));
        rays.t_min[i] = ca_test_random_u32(random) % 4 ? 0.0f : any_number(random);
        rays.t_max[i] = ca_test_random_u32(random) % 2 ? INFINITY : any_number(random);
    }
    ca_accel_occluded_batch(accel, &rays, count, occluded);
    ca_accel_intersect_batch(accel, &rays, count, &hits);
    for (uint32_t i = 0; i < count; i++) {
        const ca_hit hit = {.t = hits.t[i], .shape = hits.shape[i], .instance = hits.instance[i]};
        if (hits.shape[i] != CA_NONE) check_hit(&hit, rays.t_min[i], rays.t_max[i], counts);
    }
    counts->rays += 2 * (uint64_t)count;
}

/* One by one; in a build with asserts such rays are a caller's mistake. */
static void trace_single(const ca_accel *accel, ca_test_random *random, extreme_rays *counts)
{
#ifdef NDEBUG
    for (int i = 0; i < 64; i++) {
        ca_hit hit;
        const ca_vec3 origin = any_vector(random), direction = any_vector(random);
        const float t_min = ca_test_random_u32(random) % 4 ? 0.0f : any_number(random);
        const float t_max = ca_test_random_u32(random) % 2 ? INFINITY : any_number(random);
        (void)ca_accel_occluded(accel, origin, direction, t_min, t_max);
        if (ca_accel_intersect(accel, origin, direction, t_min, t_max, &hit)) check_hit(&hit, t_min, t_max, counts);
    }
    counts->rays += 128;
#else
    (void)accel;
    (void)random;
    (void)counts;
#endif
}

/* A triangle and a sphere in the world, the same in the group. */
static void make_shapes(const ca_mesh *mesh, ca_shape shapes[SHAPES])
{
    for (int i = 0; i < SHAPES; i++) {
        shapes[i] = (ca_shape){.kind = i % 2 ? CA_SHAPE_SPHERE : CA_SHAPE_MESH};
        if (i % 2) {
            shapes[i].as.sphere.center = (ca_vec3){1.0f, 0.0f, 0.0f};
            shapes[i].as.sphere.radius = 1.0f;
        } else {
            shapes[i].as.mesh.mesh = mesh;
        }
    }
}

static void trace_world(const ca_mesh *mesh, ca_test_random *random, uint32_t rays, extreme_rays *counts)
{
    ca_shape shapes[SHAPES];
    ca_accel_instance instances[INSTANCES];
    ca_accel *accel;
    make_shapes(mesh, shapes);
    for (int i = 0; i < INSTANCES; i++)
        instances[i] = (ca_accel_instance){.first_shape = 2, .shape_count = 2, .map = any_map(random)};
    counts->worlds++;
    const uint32_t count = 1 + ca_test_random_u32(random) % INSTANCES;
    const ca_status status = ca_accel_create(shapes, SHAPES, 2, instances, count, 1, NULL, &accel, NULL);
    if (status != CA_OK) {
        assert_int_equal(status, CA_ERROR_SCENE);
        counts->refused++;
        return;
    }
    for (const uint64_t end = counts->rays + rays; counts->rays < end;) {
        trace_batch(accel, random, counts);
        trace_single(accel, random, counts);
    }
    ca_accel_destroy(accel);
}

extreme_rays trace_extreme_rays(uint64_t seed, uint32_t worlds, uint32_t rays_of_world)
{
    ca_test_random random = ca_test_random_seed(seed);
    extreme_rays counts = {0};
    ca_mesh mesh;
    assert_int_equal(ca_mesh_create(&mesh, 3, 1, false, false, NULL), CA_OK);
    for (uint32_t v = 0; v < 3; v++) {
        mesh.indices[v] = v;
        mesh.positions[3 * v + v] = 2.0f;
    }
    for (uint32_t i = 0; i < worlds; i++) trace_world(&mesh, &random, rays_of_world, &counts);
    ca_mesh_destroy(&mesh);
    return counts;
}
