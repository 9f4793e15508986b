/* A batch of rays gets for each of them the very bits that the ray gets alone: in any company, in any order, for
 * ties between neighbours and coincident surfaces, and for rays that are not valid. */
#include "geometry/ray_batch.h"
#include "support/random_geometry.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

enum { GRID = 12, POOL = 4096, WORLD = 5, GROUP = 2, SHAPES = 12, INSTANCES = 3, ROUNDS = 12 };

/* ---- The scene ------------------------------------------------------------------------------------------------- */

/* Squares of two triangles over [-1, 1]^2; flat for x < 0, wavy beyond. */
static void make_grid(ca_mesh *mesh)
{
    const uint32_t row = GRID + 1;
    assert_int_equal(ca_mesh_create(mesh, (size_t)row * row, (size_t)2 * GRID * GRID, false, false, NULL), CA_OK);
    for (uint32_t i = 0; i < row * row; i++) {
        const float x = -1.0f + 2.0f * (float)(i % row) / GRID, y = -1.0f + 2.0f * (float)(i / row) / GRID;
        mesh->positions[3 * i + 0] = x;
        mesh->positions[3 * i + 1] = y;
        mesh->positions[3 * i + 2] = x < 0.0f ? 0.0f : 0.3f * sinf(5.0f * x) * cosf(4.0f * y);
    }
    uint32_t *index = mesh->indices;
    for (uint32_t y = 0; y < GRID; y++)
        for (uint32_t x = 0; x < GRID; x++, index += 6) {
            const uint32_t a = y * row + x, b = a + 1, c = a + row, d = c + 1;
            memcpy(index, (uint32_t[6]){a, b, c, c, b, d}, 6 * sizeof *index);
        }
}

static ca_affine affine(ca_matrix scale, ca_matrix turn, ca_matrix move)
{
    ca_affine map;
    ca_matrix matrix = ca_matrix_multiply(&turn, &scale);
    matrix = ca_matrix_multiply(&move, &matrix);
    assert_true(ca_affine_from_matrix(&matrix, &map));
    return map;
}

static ca_shape sphere_shape(ca_vec3 center, float radius)
{
    const double r = (double)radius;
    return (ca_shape){.kind = CA_SHAPE_SPHERE,
                      .light = CA_NONE,
                      .as.sphere = {.map = affine(ca_matrix_scale(r, r, r), ca_matrix_scale(1, 1, 1),
                                                  ca_matrix_translate((double)center.x, (double)center.y,
                                                                      (double)center.z)),
                                    .center = center,
                                    .radius = radius}};
}

typedef struct world {
    ca_mesh grid;
    ca_shape shapes[SHAPES];
    ca_accel_instance instances[INSTANCES];
} world;

/* Two grids in the same place, quadrics that cut them, and a group with a grid and a ball; its instances cut each
 * other and the rest. */
static void make_world(world *w)
{
    make_grid(&w->grid);
    const ca_shape mesh = {.kind = CA_SHAPE_MESH, .light = CA_NONE, .as.mesh = {.mesh = &w->grid, .extent = 1.0f}};
    const ca_matrix turn = ca_matrix_rotate(1, 1, 0, 30.0), here = ca_matrix_translate(0.3, -0.4, 0.2);
    w->shapes[0] = w->shapes[1] = w->shapes[5] = mesh;
    w->shapes[2] = sphere_shape(ca_vec3_make(-0.5f, 0.5f, 0.1f), 0.4f);
    w->shapes[3] = (ca_shape){.kind = CA_SHAPE_DISK,
                              .light = CA_NONE,
                              .as.disk.map = affine(ca_matrix_scale(0.7, 0.7, 1.0), turn, here)};
    w->shapes[4] = (ca_shape){
        .kind = CA_SHAPE_CYLINDER,
        .light = CA_NONE,
        .as.cylinder = {.map = affine(ca_matrix_scale(0.2, 0.2, 1.5), turn, here), .radius = 0.2f, .length = 1.5f}};
    w->shapes[6] = sphere_shape(ca_vec3_make(0.2f, 0.2f, 0.3f), 0.3f);
    for (int i = 0; i < INSTANCES; i++)
        w->instances[i] = (ca_accel_instance){
            .first_shape = WORLD,
            .shape_count = GROUP,
            .map = affine(ca_matrix_scale(1.0, 0.6, 1.4), ca_matrix_rotate(1, 1, 0, 30.0 + 50.0 * (i > 1)),
                          ca_matrix_translate(0.1, 0.2 * (i > 1), -0.6))}; /* two are in one place */
}

/* ---- Rays ------------------------------------------------------------------------------------------------------ */

typedef struct ray {
    ca_vec3 origin, direction;
    float t_min, t_max;
} ray;

static ca_vec3 vertex_of(const ca_mesh *mesh, uint32_t triangle, uint32_t corner)
{
    const float *p = mesh->positions + 3 * (size_t)mesh->indices[3 * triangle + corner % 3];
    return ca_vec3_make(p[0], p[1], p[2]);
}

/* A corner, or a place on an edge. */
static ca_vec3 edge_point(const ca_mesh *mesh)
{
    const uint32_t triangle = below(mesh->triangle_count), k = below(3);
    const ca_vec3 a = vertex_of(mesh, triangle, k), b = vertex_of(mesh, triangle, k + 1);
    return below(2) ? a : ca_madd(a, uniform(), ca_sub(b, a));
}

static ray invalid_ray(ray r)
{
    r.t_min = between(0.0f, 2.0f);
    r.t_max = below(2) ? r.t_min : r.t_min - uniform();
#ifdef NDEBUG
    switch (below(6)) {
    case 0: r = (ray){r.origin, {NAN, 0.0f, 1.0f}, 0.0f, INFINITY}; break;
    case 1: r = (ray){r.origin, {0.0f, INFINITY, 1.0f}, 0.0f, INFINITY}; break;
    case 2: r = (ray){{0.0f, 2e30f, 0.0f}, r.direction, 0.0f, INFINITY}; break;
    case 3: r = (ray){{0.0f, 0.0f, NAN}, r.direction, 0.0f, INFINITY}; break;
    case 4: r.t_max = NAN; break;
    default: break;
    }
#endif
    return r;
}

/* On a grid of the world, or of an instance where there are any. */
static ca_vec3 target(const world *w, uint32_t instance_count)
{
    const ca_vec3 point = edge_point(&w->grid);
    const uint32_t choice = below(instance_count + 1);
    return choice ? ca_map_point(w->instances[choice - 1].map.to, point) : point;
}

static ray make_ray(const world *w, uint32_t instance_count, uint32_t kind)
{
    const ca_vec3 aim = target(w, instance_count);
    ray r = {random_point(2.0f), ca_mul(random_direction(), powf(10.0f, between(-2.0f, 2.0f))), 0.0f, INFINITY};
    switch (kind) {
    case 1: /* at an edge or corner */ r.direction = ca_sub(aim, r.origin); break;
    case 2: /* straight down on one */
        r.origin = ca_add(aim, ca_vec3_make(0.0f, 0.0f, between(0.5f, 4.0f)));
        r.direction = ca_vec3_make(0.0f, -0.0f, -1.0f);
        break;
    case 3: /* within the flat part's plane */
        r.origin.z = 0.0f;
        r.direction.z = below(2) ? 0.0f : -0.0f;
        break;
    case 4: /* from far away, and away from it */
        r.origin = ca_mul(random_direction(), powf(10.0f, between(1.0f, 6.0f)));
        r.direction = below(4) ? ca_sub(aim, r.origin) : r.direction;
        break;
    case 5: /* segments that end at an edge, or before or after it */
        r.direction = ca_sub(aim, r.origin);
        r.t_min = below(2) ? 0.0f : uniform();
        r.t_max = below(3) ? 1.0f + 1e-6f * between(-1.0f, 1.0f) : between(1.0f, 2.0f);
        break;
    case 6: r = invalid_ray(r); break;
    default: break;
    }
    return r;
}

/* ---- Alone and in company -------------------------------------------------------------------------------------- */

static ray rays[POOL];
static ca_hit alone[POOL];
static bool occluded_alone[POOL];

static void trace_alone(const ca_accel *accel, const world *w, uint32_t instance_count)
{
    uint32_t hits = 0, occluded = 0;
    for (uint32_t i = 0; i < POOL; i++) {
        const ray r = rays[i] = make_ray(w, instance_count, i % 7);
        const bool hit = ca_accel_intersect(accel, r.origin, r.direction, r.t_min, r.t_max, &alone[i]);
        assert_int_equal(hit, alone[i].shape != CA_NONE);
        occluded_alone[i] = ca_accel_occluded(accel, r.origin, r.direction, r.t_min, r.t_max);
        if (i % 7 == 6) assert_false(hit || occluded_alone[i]);
        hits += hit;
        occluded += occluded_alone[i];
    }
    assert_true(hits > POOL / 4 && hits < POOL && occluded > POOL / 4 && occluded < POOL);
}

/* A hit has a normal only where it is a triangle's. */
static void check_hit(const world *w, const ca_hit_batch *hits, uint32_t place, uint32_t number, uint32_t count,
                      const char *name)
{
    const ca_hit *expected = &alone[number];
    ca_hit got = ca_hit_batch_at(hits, place);
    if (got.shape == CA_NONE && expected->shape == CA_NONE) return;
    if (expected->shape != CA_NONE && w->shapes[expected->shape].kind != CA_SHAPE_MESH) got.ng = expected->ng;
    if (memcmp(&got, expected, sizeof got) != 0)
        fail_msg("%s: ray of kind %u in place %u of %u: t %.9g, shape %u, triangle %u, instance %u; alone %.9g, %u, "
                 "%u, %u",
                 name, number % 7, place, count, (double)got.t, got.shape, got.primitive, got.instance,
                 (double)expected->t, expected->shape, expected->primitive, expected->instance);
}

/* `chosen`: numbers of rays. */
static void check_batch(const world *w, const ca_accel *accel, const uint32_t *chosen, uint32_t count,
                        const char *name)
{
    static ca_ray_batch batch;
    static ca_hit_batch hits;
    uint8_t occluded[CA_RAY_BATCH];
    for (uint32_t i = 0; i < count; i++) {
        const ray *r = &rays[chosen[i]];
        ca_column3_set(&batch.origin, i, r->origin);
        ca_column3_set(&batch.direction, i, r->direction);
        batch.t_min[i] = r->t_min, batch.t_max[i] = r->t_max;
    }
    memset(&hits, 0x5a, sizeof hits);
    memset(occluded, 0x5a, sizeof occluded);
    ca_accel_intersect_batch(accel, &batch, count, &hits);
    ca_accel_occluded_batch(accel, &batch, count, occluded);
    for (uint32_t i = 0; i < count; i++) {
        check_hit(w, &hits, i, chosen[i], count, name);
        if (occluded[i] != occluded_alone[chosen[i]])
            fail_msg("%s: ray of kind %u in place %u of %u: occluded %u, alone %u", name, chosen[i] % 7, i, count,
                     occluded[i], occluded_alone[chosen[i]]);
    }
}

static void shuffle(uint32_t *order, uint32_t count)
{
    for (uint32_t i = count; i > 1; i--) {
        const uint32_t k = below(i), kept = order[i - 1];
        order[i - 1] = order[k];
        order[k] = kept;
    }
}

/* Every ray is in some batch of every size above 9, each time with others. */
static void check_scene(const world *w, uint32_t world_count, uint32_t instance_count, const char *name)
{
    static const uint32_t counts[] = {1, 7, 8, 9, 15, 16, 64, 511, 512};
    static uint32_t order[POOL];
    ca_accel *accel;
    ca_error error;
    /* where the world is empty or smaller, the group's shapes are still the last ones */
    if (ca_accel_create(w->shapes, SHAPES, world_count, w->instances, instance_count, 1, NULL, &accel, &error) !=
        CA_OK)
        fail_msg("%s", error.message);
    trace_alone(accel, w, instance_count);
    for (uint32_t i = 0; i < POOL; i++) order[i] = i;
    for (size_t c = 0; c < sizeof counts / sizeof counts[0]; c++)
        for (uint32_t round = 0; round < ROUNDS; round++) {
            shuffle(order, POOL);
            for (uint32_t first = 0; first + counts[c] <= POOL && first < 8 * CA_RAY_BATCH; first += counts[c])
                check_batch(w, accel, order + first, counts[c], name);
        }
    ca_accel_destroy(accel);
}

static void test_a_batch_gives_what_each_ray_gets_alone(void **state)
{
    (void)state;
    world w;
    make_world(&w);
    check_scene(&w, 1, 0, "grid");
    check_scene(&w, 2, 0, "two grids in one place");
    check_scene(&w, WORLD, 0, "with quadrics");
    check_scene(&w, 0, INSTANCES, "instances");
    check_scene(&w, WORLD, INSTANCES, "all");
    w.shapes[3] = w.shapes[2];
    check_scene(&w, WORLD, 0, "two spheres in one place");
    ca_mesh_destroy(&w.grid);
}

/* More of them than lie apart: Embree meets them. */
static void test_many_quadrics(void **state)
{
    (void)state;
    world w;
    make_world(&w);
    for (uint32_t i = WORLD; i < SHAPES; i++)
        w.shapes[i] = sphere_shape(random_point(0.8f), between(0.05f, 0.4f));
    check_scene(&w, WORLD + 4, 0, "seven quadrics and two grids");
    check_scene(&w, SHAPES, 0, "ten quadrics and two grids");
    w.shapes[SHAPES - 1] = w.shapes[WORLD];
    check_scene(&w, SHAPES, 0, "ten quadrics, two in one place");
    ca_mesh_destroy(&w.grid);
}

static void test_an_empty_batch(void **state)
{
    (void)state;
    world w;
    make_world(&w);
    ca_accel *accel;
    assert_int_equal(ca_accel_create(w.shapes, SHAPES, 1, NULL, 0, 1, NULL, &accel, NULL), CA_OK);
    check_batch(&w, accel, NULL, 0, "none");
    ca_accel_destroy(accel);
    ca_mesh_destroy(&w.grid);
}

int main(void)
{
    numbers = ca_test_random_seed(1);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_batch_gives_what_each_ray_gets_alone),
        cmocka_unit_test(test_many_quadrics),
        cmocka_unit_test(test_an_empty_batch),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
