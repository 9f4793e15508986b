/* Batches of rays: each answer is the one that the ray gets alone, to the bit, whatever else is in the batch and
 * however many there are. */
#include "geometry/ray_batch.h"

#include "math/numeric.h"
#include "sampling/warp.h"
#include "support/test_random.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { TRIANGLES = 300, WORLD_SHAPES = 2, SHAPES = 3 };

static ca_test_random source;
static ca_mesh mesh;
static ca_shape shapes[SHAPES];
static ca_accel_instance instance;
static ca_accel *accel;

static float between(float low, float high) { return low + (high - low) * ca_test_random_float(&source); }

static ca_vec3 random_point(float half)
{
    const float x = between(-half, half), y = between(-half, half);
    return (ca_vec3){x, y, between(-half, half)};
}

/* Loose triangles around the origin. */
static void fill_mesh(void)
{
    assert_int_equal(ca_mesh_create(&mesh, 3 * TRIANGLES, TRIANGLES, false, false, NULL), CA_OK);
    for (uint32_t i = 0; i < TRIANGLES; i++) {
        const ca_vec3 middle = random_point(2.0f);
        for (uint32_t k = 3 * i; k < 3 * i + 3; k++) {
            const ca_vec3 p = ca_add(middle, random_point(0.4f));
            mesh.positions[3 * k + 0] = p.x, mesh.positions[3 * k + 1] = p.y, mesh.positions[3 * k + 2] = p.z;
            mesh.indices[k] = k;
        }
    }
}

/* The triangles, a sphere, and the triangles once more beside them, as an instance. */
static int create(void **state)
{
    (void)state;
    source = ca_test_random_seed(1);
    fill_mesh();
    shapes[0] = (ca_shape){.kind = CA_SHAPE_MESH, .as.mesh = {.mesh = &mesh, .extent = 3.0f}, .light = CA_NONE};
    shapes[1] = (ca_shape){.kind = CA_SHAPE_SPHERE, .as.sphere = {.radius = 0.7f}, .light = CA_NONE};
    shapes[2] = shapes[0];
    instance = (ca_accel_instance){.first_shape = WORLD_SHAPES, .shape_count = 1};
    const ca_matrix move = ca_matrix_translate(4, 1, 0);
    assert_true(ca_affine_from_matrix(&move, &instance.map));
    return ca_accel_create(shapes, SHAPES, WORLD_SHAPES, &instance, 1, 1, &accel, NULL) != CA_OK;
}

static int destroy(void **state)
{
    (void)state;
    ca_accel_destroy(accel);
    ca_mesh_destroy(&mesh);
    return 0;
}

/* One in eight has no length at all, or less. */
static void fill_batch(ca_ray_batch *rays, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) {
        const float x = ca_test_random_float(&source);
        ca_column3_set(&rays->origin, i, random_point(5.0f));
        ca_column3_set(&rays->direction, i, ca_warp_sphere((ca_vec2){x, ca_test_random_float(&source)}));
        rays->t_min[i] = between(0.0f, 0.5f);
        rays->t_max[i] = i % 3 ? INFINITY : between(1.0f, 4.0f);
        if (ca_test_random_float(&source) < 0.125f) rays->t_max[i] = between(-1.0f, rays->t_min[i]);
    }
}

/* A quadric's hit has the distance only. */
static bool same_bits(const ca_hit *a, const ca_hit *b)
{
    const bool same = a->t == b->t && a->shape == b->shape && a->instance == b->instance;
    if (!same || shapes[a->shape].kind != CA_SHAPE_MESH) return same;
    return a->u == b->u && a->v == b->v && a->ng.x == b->ng.x && a->ng.y == b->ng.y && a->ng.z == b->ng.z &&
           a->primitive == b->primitive;
}

/* How many met something. */
static uint32_t check_batch(const ca_ray_batch *rays, uint32_t count)
{
    static ca_hit_batch hits;
    uint8_t occluded[CA_RAY_BATCH];
    uint32_t met = 0;
    ca_accel_intersect_batch(accel, rays, count, &hits);
    ca_accel_occluded_batch(accel, rays, count, occluded);
    for (uint32_t i = 0; i < count; i++) {
        const ca_vec3 origin = ca_column3_at(&rays->origin, i), direction = ca_column3_at(&rays->direction, i);
        const ca_hit together = ca_hit_batch_at(&hits, i);
        ca_hit alone;
        const bool hit = ca_accel_intersect(accel, origin, direction, rays->t_min[i], rays->t_max[i], &alone);
        assert_int_equal(together.shape != CA_NONE, hit);
        if (hit) assert_true(same_bits(&together, &alone));
        assert_int_equal(occluded[i],
                         ca_accel_occluded(accel, origin, direction, rays->t_min[i], rays->t_max[i]));
        met += hit;
    }
    return met;
}

/* Fewer than a packet, whole packets, and some that are left; sorted and not. */
static void test_answers_are_those_of_single_rays(void **state)
{
    (void)state;
    static const uint32_t counts[] = {1, 2, 7, 8, 9, 15, 16, 17, 33, 100, 257, 511, CA_RAY_BATCH};
    static ca_ray_batch rays;
    uint32_t met = 0;
    for (int repeat = 0; repeat < 20; repeat++)
        for (size_t k = 0; k < sizeof counts / sizeof counts[0]; k++) {
            fill_batch(&rays, counts[k]);
            met += check_batch(&rays, counts[k]);
        }
    assert_true(met > 2000);
}

/* A ray that is not finite meets nothing and does not disturb its neighbours. */
static void test_rays_that_are_not_finite(void **state)
{
    (void)state;
    static const float bad[] = {NAN, INFINITY, -INFINITY, 1e30f};
    static ca_ray_batch rays;
    static ca_hit_batch clean, hits;
    uint8_t occluded[CA_RAY_BATCH];
    fill_batch(&rays, CA_RAY_BATCH);
    ca_accel_intersect_batch(accel, &rays, CA_RAY_BATCH, &clean);
    for (uint32_t i = 0; i < CA_RAY_BATCH; i += 5) rays.origin.y[i] = bad[i % 4];
    for (uint32_t i = 2; i < CA_RAY_BATCH; i += 5) rays.direction.x[i] = bad[i % 3];
    ca_accel_intersect_batch(accel, &rays, CA_RAY_BATCH, &hits);
    ca_accel_occluded_batch(accel, &rays, CA_RAY_BATCH, occluded);
    for (uint32_t i = 0; i < CA_RAY_BATCH; i++) {
        const ca_hit got = ca_hit_batch_at(&hits, i), expected = ca_hit_batch_at(&clean, i);
        if (i % 5 == 0 || i % 5 == 2) {
            assert_true(got.shape == CA_NONE && occluded[i] == 0);
            continue;
        }
        assert_int_equal(got.shape, expected.shape);
        if (got.shape != CA_NONE) assert_true(same_bits(&got, &expected));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_answers_are_those_of_single_rays),
        cmocka_unit_test(test_rays_that_are_not_finite),
    };
    return cmocka_run_group_tests(tests, create, destroy);
}
