/* Points of surfaces kept in few bytes: the surface that is made again is the one that was hit, on meshes with and
 * without normals and texture coordinates, on exact shapes, and on instances of both. */
#include "geometry/surface_point.h"
#include "math/numeric.h"
#include "sampling/warp.h"
#include "support/test_random.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

static ca_test_random random_source;

static float uniform(void) { return ca_test_random_float(&random_source); }
static float between(float low, float high) { return low + (high - low) * uniform(); }

static ca_vec3 random_direction(void)
{
    const float u = uniform(), v = uniform();
    return ca_warp_sphere((ca_vec2){u, v});
}

static ca_vec3 random_point(float half)
{
    const float x = between(-half, half), y = between(-half, half), z = between(-half, half);
    return (ca_vec3){x, y, z};
}

/* A patch of bumpy ground over [-1, 1]^2; its normals lean, some are zero, some even point down. */
enum { CELLS = 12 };

static void make_patch(ca_mesh *mesh, bool normals, bool uvs)
{
    const uint32_t side = CELLS + 1;
    assert_int_equal(ca_mesh_create(mesh, side * side, 2 * CELLS * CELLS, normals, uvs, NULL), CA_OK);
    for (uint32_t i = 0; i < side * side; i++) {
        const float x = 2.0f * (float)(i % side) / CELLS - 1.0f, y = 2.0f * (float)(i / side) / CELLS - 1.0f;
        float *p = mesh->positions + 3 * i;
        p[0] = x, p[1] = y, p[2] = between(-0.1f, 0.1f);
        if (uvs) mesh->uvs[2 * i] = 3.0f * x + y, mesh->uvs[2 * i + 1] = y - 0.5f * x * x;
        if (!normals || i % 17 == 0) continue;
        ca_vec3 n = ca_normalize((ca_vec3){between(-0.5f, 0.5f), between(-0.5f, 0.5f), 1.0f});
        if (i / side < 3) n = ca_neg(n);
        mesh->normals[3 * i] = n.x, mesh->normals[3 * i + 1] = n.y, mesh->normals[3 * i + 2] = n.z;
    }
    /* one triangle that has no shading normal at all */
    if (normals)
        for (uint32_t i = 0; i < 3; i++)
            mesh->normals[3 * (side * side - 1) + i] = mesh->normals[3 * (side * side - 2) + i] =
                mesh->normals[3 * (side * side - 1 - side) + i] = 0.0f;
    for (uint32_t c = 0; c < CELLS * CELLS; c++) {
        const uint32_t v = c / CELLS * side + c % CELLS;
        const uint32_t corners[6] = {v, v + 1, v + side, v + side + 1, v + side, v + 1};
        for (int k = 0; k < 6; k++) mesh->indices[6 * c + (uint32_t)k] = corners[k];
    }
}

enum { MESHES = 4, SHAPES = 14, INSTANCES = 2 };

/* Four patches (with or without normals and texture coordinates), three exact shapes, and the same seven again in a
 * group that is instanced twice. Materials and lights have telling numbers. */
typedef struct fixture {
    ca_mesh meshes[MESHES];
    ca_shape shapes[SHAPES];
    ca_accel_instance instances[INSTANCES];
    ca_accel *accel;
} fixture;

static ca_affine affine(ca_matrix a, ca_matrix b)
{
    const ca_matrix product = ca_matrix_multiply(&a, &b);
    ca_affine map;
    assert_true(ca_affine_from_matrix(&product, &map));
    return map;
}

static void make_shapes(fixture *f, bool tangents)
{
    static const ca_shape_kind kinds[] = {CA_SHAPE_SPHERE, CA_SHAPE_DISK, CA_SHAPE_CYLINDER};
    for (uint32_t i = 0; i < SHAPES; i++) {
        ca_shape *shape = &f->shapes[i];
        const uint32_t k = i % 7;
        *shape = (ca_shape){.needs_tangents = tangents, .material = 100 + i, .light = k % 2 ? 200 + i : CA_NONE};
        if (k < MESHES) {
            shape->kind = CA_SHAPE_MESH;
            shape->as.mesh.mesh = &f->meshes[k];
            shape->as.mesh.extent = 1.0f;
            continue;
        }
        shape->kind = kinds[k - MESHES];
        shape->flip_normals = k == 5 || i == 13;
        const double z_scale = shape->kind == CA_SHAPE_CYLINDER ? 1.5 : 0.5;
        const ca_matrix move = ca_matrix_translate(0.3, -0.2, 0.4), turn = ca_matrix_rotate(1, 2, 3, 40.0 * k);
        const ca_matrix scale = ca_matrix_scale(0.5, 0.5, z_scale);
        const ca_affine map = affine(move, ca_matrix_multiply(&turn, &scale));
        switch (shape->kind) {
        case CA_SHAPE_SPHERE:
            shape->as.sphere.map = map;
            shape->as.sphere.center = (ca_vec3){0.3f, -0.2f, 0.4f};
            shape->as.sphere.radius = 0.5f;
            break;
        case CA_SHAPE_DISK: shape->as.disk.map = map; break;
        case CA_SHAPE_CYLINDER:
            shape->as.cylinder.map = map;
            shape->as.cylinder.radius = 0.5f;
            shape->as.cylinder.length = 1.5f;
            break;
        case CA_SHAPE_MESH:
        case CA_SHAPE_CURVE:
        case CA_SHAPE_SDF_GRID:
        case CA_SHAPE_KIND_COUNT: break;
        }
    }
}

static void set_up(fixture *f, bool tangents)
{
    for (uint32_t k = 0; k < MESHES; k++) make_patch(&f->meshes[k], k & 1, k & 2);
    make_shapes(f, tangents);
    const ca_matrix scale = ca_matrix_scale(0.3, 2.0, -1.1), turn = ca_matrix_rotate(3, 1, 1, 70.0);
    f->instances[0] =
        (ca_accel_instance){7, 7, affine(ca_matrix_translate(5, 1, 2), ca_matrix_multiply(&turn, &scale))};
    f->instances[1] = (ca_accel_instance){7, 7, affine(ca_matrix_translate(-40, 6, 0), turn)};
    assert_int_equal(ca_accel_create(f->shapes, SHAPES, 7, f->instances, INSTANCES, 1, NULL, &f->accel, NULL), CA_OK);
}

static void tear_down(fixture *f)
{
    ca_accel_destroy(f->accel);
    for (uint32_t k = 0; k < MESHES; k++) ca_mesh_destroy(&f->meshes[k]);
}

static bool same(ca_vec3 a, ca_vec3 b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

static void assert_near(ca_vec3 a, ca_vec3 b, float tolerance, const char *what)
{
    if (!(ca_length(ca_sub(a, b)) <= tolerance * ca_max(1.0f, ca_length(a))))
        fail_msg("%s is (%g, %g, %g), should be (%g, %g, %g)", what, (double)b.x, (double)b.y, (double)b.z,
                 (double)a.x, (double)a.y, (double)a.z);
}

/* Angles around an axis may jump by one turn. */
static void assert_near_uv(ca_vec2 a, ca_vec2 b, bool exact_shape)
{
    float du = fabsf(a.x - b.x);
    if (exact_shape) du = ca_min(du, 1.0f - du);
    if (!(du <= 1e-4f && fabsf(a.y - b.y) <= 1e-4f))
        fail_msg("uv is (%g, %g), should be (%g, %g)", (double)b.x, (double)b.y, (double)a.x, (double)a.y);
}

static void check_surface(const ca_surface *s, const ca_surface *again)
{
    assert_true(same(s->position, again->position) && same(s->ng, again->ng));
    assert_true(again->position_error.x >= s->position_error.x && again->position_error.y >= s->position_error.y &&
                again->position_error.z >= s->position_error.z);
    assert_true(ca_max3(again->position_error) == ca_max3(s->position_error));
    assert_true(s->barycentric.x == again->barycentric.x && s->barycentric.y == again->barycentric.y);
    assert_ptr_equal(s->mesh, again->mesh);
    assert_int_equal(s->shape, again->shape);
    assert_int_equal(s->primitive, again->primitive);
    assert_int_equal(s->instance, again->instance);
    assert_int_equal(s->material, again->material);
    assert_int_equal(s->light, again->light);
    if (s->mesh && s->instance == CA_NONE) { /* the very same arithmetic */
        assert_true(same(s->ns, again->ns) && same(s->dpdu, again->dpdu) && same(s->dpdv, again->dpdv));
        assert_true(s->uv.x == again->uv.x && s->uv.y == again->uv.y);
        return;
    }
    assert_near(s->ns, again->ns, 1e-5f, "the shading normal");
    /* A point of the group's space is known to about 2^-24 of the way to the instance's origin. */
    assert_near_uv(s->uv, again->uv, !s->mesh);
    assert_near(s->dpdu, again->dpdu, 1e-3f, "dpdu");
    assert_near(s->dpdv, again->dpdv, 1e-3f, "dpdv");
}

/* A ray from anywhere to somewhere on one of the three copies. */
static bool random_hit(const fixture *f, ca_surface *surface)
{
    const uint32_t copy = ca_test_random_u32(&random_source) % 3;
    ca_vec3 target = random_point(0.9f);
    if (copy) target = ca_map_point(f->instances[copy - 1].map.to, target);
    const ca_vec3 direction = random_direction();
    const ca_vec3 origin = ca_madd(target, -between(0.0f, 3.0f), direction);
    ca_hit hit;
    if (!ca_accel_intersect(f->accel, origin, direction, 0.0f, INFINITY, &hit)) return false;
    ca_accel_surface(f->accel, origin, direction, &hit, surface);
    return true;
}

static void check_all(bool tangents)
{
    fixture f;
    random_source = ca_test_random_seed(tangents);
    set_up(&f, tangents);
    uint32_t hits[SHAPES][INSTANCES + 1] = {{0}}, flipped = 0;
    for (uint32_t i = 0; i < 200000; i++) {
        ca_surface surface, again;
        if (!random_hit(&f, &surface)) continue;
        const ca_surface_point point = ca_surface_point_of(&surface);
        /* nothing may be left as it was in memory */
        memset(&again, 0x7f, sizeof again);
        ca_accel_surface_at(f.accel, &point, &again);
        check_surface(&surface, &again);
        assert_true(tangents == (ca_length2(again.dpdu) > 0.0f));
        hits[surface.shape][surface.instance == CA_NONE ? 0 : 1 + surface.instance]++;
        flipped += surface.shape < MESHES && surface.ng.z < 0.0f;
    }
    assert_true(flipped > 100); /* where shading normals turn the geometric one over */
    for (uint32_t i = 0; i < SHAPES; i++)
        for (uint32_t k = 0; k <= INSTANCES; k++)
            if ((i < 7) == (k == 0)) assert_true(hits[i][k] > 100);
    tear_down(&f);
}

static void test_surfaces_with_tangents(void **state)
{
    (void)state;
    check_all(true);
}

static void test_surfaces_without_tangents(void **state)
{
    (void)state;
    check_all(false);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_surfaces_with_tangents),
        cmocka_unit_test(test_surfaces_without_tangents),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
