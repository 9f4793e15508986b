/* Grids of signed distances: hits against a march along the ray and against planes, rays that leave, what Mitsuba 3
 * says of a few rays, normals against finite differences, maps, sharing, reading. */
#include "geometry/accel.h"
#include "geometry/sdf_grid.h"
#include "geometry/surface_point.h"
#include "import/import.h"
#include "math/numeric.h"
#include "support/import_text.h"
#include "support/test_random.h"

#include <stdio.h>
#include <string.h>

static ca_test_random source;

static float between(float low, float high) { return low + (high - low) * ca_test_random_float(&source); }
static ca_vec3 random_point(float low, float high)
{
    return ca_vec3_make(between(low, high), between(low, high), between(low, high));
}
static ca_vec3 random_direction(void)
{
    for (;;) {
        const ca_vec3 p = random_point(-1.0f, 1.0f);
        if (ca_length2(p) > 0.01f && ca_length2(p) < 1.0f) return ca_normalize(p);
    }
}

/* A distance over the unit cube, by the numbers of a sample and how many there are. */
typedef float sampled(uint32_t x, uint32_t y, uint32_t z, const uint32_t count[3]);

static ca_sdf_grid *make_grid(uint32_t nx, uint32_t ny, uint32_t nz, sampled *distance, const ca_matrix *map)
{
    const uint32_t count[3] = {nx, ny, nz};
    ca_sdf_grid *grid;
    assert_int_equal(ca_sdf_grid_create(count, &grid, NULL), CA_OK);
    for (uint32_t z = 0; z < nz; z++)
        for (uint32_t y = 0; y < ny; y++)
            for (uint32_t x = 0; x < nx; x++) grid->values[(z * ny + y) * nx + x] = distance(x, y, z, count);
    assert_int_equal(ca_sdf_grid_finish(grid, NULL), CA_OK);
    assert_true(ca_sdf_grid_place(grid, map));
    return grid;
}

static ca_shape shape_of(const ca_sdf_grid *grid)
{
    return (ca_shape){.kind = CA_SHAPE_SDF_GRID, .light = CA_NONE, .needs_tangents = true, .as.sdf.grid = grid};
}

static ca_accel *build(const ca_shape *shape)
{
    ca_accel *accel = NULL;
    assert_int_equal(ca_accel_create(shape, 1, 1, NULL, 0, 1, NULL, &accel, NULL), CA_OK);
    return accel;
}

static void assert_near(ca_vec3 a, ca_vec3 b, float tolerance, const char *what)
{
    if (!(ca_length(ca_sub(a, b)) <= tolerance))
        fail_msg("%s: (%g, %g, %g), expected (%g, %g, %g)", what, (double)a.x, (double)a.y, (double)a.z, (double)b.x,
                 (double)b.y, (double)b.z);
}

/* ---- Hits ------------------------------------------------------------------------------------------------------ */

static float random_distance(uint32_t x, uint32_t y, uint32_t z, const uint32_t count[3])
{
    (void)x, (void)y, (void)z, (void)count;
    return between(-1.0f, 1.0f);
}

/* The interpolant in grid coordinates, by its definition. */
static double distance_at(const ca_sdf_grid *grid, const double p[3])
{
    double cell[3], share[3], sum = 0.0;
    for (int i = 0; i < 3; i++) {
        cell[i] = fmin(fmax(floor(p[i]), 0.0), (double)(grid->count[i] - 2));
        share[i] = p[i] - cell[i];
    }
    for (int i = 0; i < 8; i++) {
        const uint32_t x = (uint32_t)cell[0] + (i & 1), y = (uint32_t)cell[1] + (i >> 1 & 1),
                       z = (uint32_t)cell[2] + (uint32_t)(i >> 2);
        const double weight = (i & 1 ? share[0] : 1.0 - share[0]) * (i & 2 ? share[1] : 1.0 - share[1]) *
                              (i & 4 ? share[2] : 1.0 - share[2]);
        sum += weight * (double)grid->values[(z * grid->count[1] + y) * grid->count[0] + x];
    }
    return sum;
}

/* Of a ray in the unit cube: the distance at t, false outside. */
static bool along(const ca_sdf_grid *grid, ca_vec3 o, ca_vec3 d, double t, double *distance)
{
    const double from[3] = {(double)o.x, (double)o.y, (double)o.z}, to[3] = {(double)d.x, (double)d.y, (double)d.z};
    double p[3];
    for (int i = 0; i < 3; i++) {
        const double unit = from[i] + t * to[i];
        if (unit < 0.0 || unit > 1.0) return false;
        p[i] = unit * (double)(grid->count[i] - 1);
    }
    *distance = distance_at(grid, p);
    return true;
}

/* The first change of sign in steps; -1: none. `doubtful`: where the ray enters or leaves the cube, or comes nearest
 * to the surface without a change, the distance is so small that there may be roots between two steps. */
static double march(const ca_sdf_grid *grid, ca_vec3 o, ca_vec3 d, bool *doubtful)
{
    const double step = 1e-3, small = 0.02;
    double before[2] = {0.0, 0.0}, now = 0.0;
    int inside = 0; /* so many steps */
    *doubtful = false;
    for (double t = 0.0; t < 6.0; t += step, inside++, before[0] = before[1], before[1] = now) {
        const bool was_inside = inside > 0;
        if (!along(grid, o, d, t, &now)) {
            if (was_inside) *doubtful = *doubtful || fabs(before[1]) < small;
            inside = -1;
            continue;
        }
        if (!was_inside && fabs(now) < small) *doubtful = true;
        if (was_inside && (before[1] < 0.0) != (now < 0.0)) return t - step * now / (now - before[1]);
        const bool nearest = inside > 1 && fabs(before[1]) < fabs(before[0]) && fabs(before[1]) <= fabs(now);
        if (nearest && fabs(before[1]) < small) *doubtful = true;
    }
    return -1.0;
}

static void test_first_hits(void **state)
{
    (void)state;
    const ca_matrix identity = ca_matrix_identity();
    source = ca_test_random_seed(1);
    uint32_t hits = 0, misses = 0, doubts = 0;
    for (int trial = 0; trial < 60; trial++) {
        const uint32_t nx = 2 + (uint32_t)trial % 4, ny = 2 + (uint32_t)trial % 3;
        ca_sdf_grid *grid = make_grid(nx, ny, 3, random_distance, &identity);
        const ca_shape shape = shape_of(grid);
        ca_accel *accel = build(&shape);
        for (int i = 0; i < 40; i++) {
            const ca_vec3 o = random_point(-0.5f, 1.5f);
            ca_vec3 d = ca_normalize(ca_sub(random_point(0.0f, 1.0f), o));
            if (i % 8 == 0) d = (ca_vec3){0.0f, i % 16 ? 1.0f : -1.0f, 0.0f}; /* along an axis */
            bool doubtful;
            const double expected = march(grid, o, d, &doubtful);
            ca_hit hit;
            const bool met = ca_accel_intersect(accel, o, d, 0.0f, INFINITY, &hit);
            if (met) { /* what is called a hit is one, at any rate */
                double distance;
                if (along(grid, o, d, (double)hit.t, &distance)) assert_true(fabs(distance) < 1e-4);
            }
            doubts += doubtful;
            if (doubtful) continue;
            if (met != (expected >= 0.0)) fail_msg("trial %d, ray %d: hit %d, march %g", trial, i, met, expected);
            if (met && fabs((double)hit.t - expected) > 2e-3)
                fail_msg("hit at %g, march %g", (double)hit.t, expected);
            hits += met;
            misses += !met;
        }
        ca_accel_destroy(accel);
        ca_sdf_grid_destroy(grid);
    }
    print_message("    %u hits, %u misses, %u rays too near to a surface to say\n", hits, misses, doubts);
    assert_true(hits > 900 && misses > 300);
}

static float formula(uint32_t x, uint32_t y, uint32_t z, const uint32_t count[3])
{
    (void)count;
    return (float)(2.0 * z - 3.0) / 4.0f + ((float)((x * x * 3 + y * 5 + x * y * 7 + z * 11) % 8) - 3.5f) / 16.0f;
}

typedef struct known_hit {
    float x, y, z; /* where a ray from z = 5 downwards ends */
    ca_vec3 ng, ns;
    uint32_t primitive;
} known_hit;

/* Mitsuba 3.9.1's hits of the formula's grid of 4 x 4 x 4, stretched by 2, 1 and 3. */
static const known_hit known[] = {
    {0.3f, 0.2f, 1.54603f, {0.0924398f, -0.420423f, 0.902607f}, {0.0955092f, -0.385085f, 0.917926f}, 0},
    {1.0f, 0.5f, 1.53571f, {-0.101021f, -0.317496f, 0.942863f}, {-0.101021f, -0.317496f, 0.942863f}, 4},
    {1.7f, 0.9f, 1.4995f, {0.417768f, 0.174772f, 0.891586f}, {0.401822f, 0.14184f, 0.904666f}, 8},
    {0.62f, 0.31f, 1.51196f, {0.247193f, -0.0335556f, 0.968385f}, {0.149789f, -0.0230583f, 0.988449f}, 0},
    {1.44f, 0.77f, 1.65734f, {0.538753f, 0.20689f, 0.816665f}, {0.285834f, 0.0606861f, 0.956356f}, 8},
};

static void test_hits_are_mitsubas(void **state)
{
    (void)state;
    const ca_matrix stretch = ca_matrix_scale(2.0, 1.0, 3.0);
    ca_sdf_grid *grid = make_grid(4, 4, 4, formula, &stretch);
    const ca_shape shape = shape_of(grid);
    ca_accel *accel = build(&shape);
    for (size_t i = 0; i < 2 * sizeof known / sizeof *known; i++) {
        const known_hit *k = &known[i / 2];
        const ca_vec3 origin = {k->x, k->y, 5.0f}, down = {0.0f, 0.0f, -1.0f};
        ca_hit hit;
        ca_surface s;
        grid->smooth = i % 2 == 0;
        assert_true(ca_accel_intersect(accel, origin, down, 0.0f, INFINITY, &hit));
        ca_accel_surface(accel, origin, down, &hit, &s);
        assert_near(s.position, (ca_vec3){k->x, k->y, k->z}, 2e-5f, "the hit");
        assert_near(s.ng, k->ng, 1e-4f, "the normal");
        assert_near(s.ns, grid->smooth ? k->ns : k->ng, 1e-4f, "the shading normal");
        const ca_surface_point point = ca_surface_point_of(&s);
        ca_surface again;
        ca_accel_surface_at(accel, &point, &again);
        assert_near(again.ns, s.ns, 1e-5f, "the shading normal, looked up again");
        assert_int_equal(s.primitive, k->primitive);
        assert_true(s.uv.x == 0.0f && s.uv.y == 0.0f && fabsf(ca_dot(s.dpdu, s.ns)) < 1e-5f);
    }
    ca_accel_destroy(accel);
    ca_sdf_grid_destroy(grid);
}

/* ---- Surfaces -------------------------------------------------------------------------------------------------- */

static float slanted_plane(uint32_t x, uint32_t y, uint32_t z, const uint32_t count[3])
{
    return 0.3f * (float)x / (float)(count[0] - 1) - 0.5f * (float)y / (float)(count[1] - 1) +
           (float)z / (float)(count[2] - 1) - 0.4f;
}

static ca_matrix random_map(float size)
{
    const float x = between(0.3f, 3.0f), y = between(0.3f, 3.0f), z = -between(0.3f, 3.0f); /* it mirrors, too */
    const ca_matrix scale = ca_matrix_scale((double)(size * x), (double)(size * y), (double)(size * z));
    const ca_matrix turn = ca_matrix_rotate((double)between(-1.0f, 1.0f), 1.0, (double)between(-1.0f, 1.0f), 77.0);
    const ca_matrix move = ca_matrix_translate((double)(size * between(-9.0f, 9.0f)), 0.0, (double)size);
    const ca_matrix turned = ca_matrix_multiply(&turn, &scale);
    return ca_matrix_multiply(&move, &turned);
}

/* A plane is a plane under any map: one normal, which the gradient gives, and nothing more is met on either side of a
 * point of it. */
static void test_planes(void **state)
{
    (void)state;
    source = ca_test_random_seed(2);
    uint32_t hits = 0;
    for (int trial = 0; trial < 40; trial++) {
        const float size = powf(10.0f, between(-4.0f, 5.0f));
        const ca_matrix map = random_map(size);
        ca_affine affine;
        const ca_affine *placed = &affine;
        assert_true(ca_affine_from_matrix(&map, &affine));
        ca_sdf_grid *grid = make_grid(3, 6, 4, slanted_plane, &map);
        const ca_shape shape = shape_of(grid);
        ca_accel *accel = build(&shape);
        const ca_vec3 expected = ca_normalize(ca_map_normal(placed->from, (ca_vec3){0.3f, -0.5f, 1.0f}));
        for (int i = 0; i < 100; i++) {
            const ca_vec3 target = ca_map_point(placed->to, random_point(0.3f, 0.7f)), out = random_direction();
            const ca_vec3 origin = ca_madd(target, 20.0f * size, out), d = ca_neg(out);
            ca_hit hit, next;
            ca_surface s;
            if (!ca_accel_intersect(accel, origin, d, 0.0f, INFINITY, &hit)) continue;
            hits++;
            ca_accel_surface(accel, origin, d, &hit, &s);
            assert_near(s.ng, expected, 1e-4f, "the normal of a plane");
            const ca_vec3 local = ca_map_point(placed->from, s.position); /* not half a cell from the last faces */
            if (local.x < 0.74f && local.y < 0.89f && local.z < 0.82f)
                assert_near(s.ns, expected, 1e-4f, "the shading normal of a plane");
            const ca_vec3 away = random_direction();
            const ca_vec3 start = ca_offset_origin(s.position, s.position_error, s.ng, away);
            if (ca_accel_intersect(accel, start, away, 0.0f, INFINITY, &next))
                fail_msg("size %g: a ray leaves and meets the plane again at %g", (double)size, (double)next.t);
        }
        ca_accel_destroy(accel);
        ca_sdf_grid_destroy(grid);
    }
    print_message("    %u hits\n", hits);
    assert_true(hits > 2500);
}

static float ball(uint32_t x, uint32_t y, uint32_t z, const uint32_t count[3])
{
    const float p[3] = {(float)x / (float)(count[0] - 1) - 0.5f, (float)y / (float)(count[1] - 1) - 0.5f,
                        (float)z / (float)(count[2] - 1) - 0.5f};
    return sqrtf(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]) - 0.4f;
}

/* A ray through the middle meets a ball twice, and no ray from its inside gets out unseen: voxels have no gaps. */
static void test_a_ball_is_closed(void **state)
{
    (void)state;
    const ca_matrix map = ca_matrix_scale(10.0, 10.0, 10.0);
    ca_sdf_grid *grid = make_grid(33, 33, 33, ball, &map);
    const ca_shape shape = shape_of(grid);
    ca_accel *accel = build(&shape);
    source = ca_test_random_seed(3);
    for (int i = 0; i < 20000; i++) {
        ca_vec3 d = random_direction();
        if (i % 4 == 0) d.x = 0.0f; /* in the planes between voxels, too */
        if (i % 8 == 0) d.y = 0.0f;
        const ca_vec3 inside = i % 2 ? random_point(3.5f, 6.5f) : (ca_vec3){5.0f, 5.0f, 5.0f};
        ca_hit hit, next;
        ca_surface s;
        if (!ca_accel_intersect(accel, inside, d, 0.0f, INFINITY, &hit)) fail_msg("ray %d slips through", i);
        ca_accel_surface(accel, inside, d, &hit, &s);
        const ca_vec3 out = ca_mul(ca_sub(s.position, (ca_vec3){5.0f, 5.0f, 5.0f}), 0.25f);
        assert_near(s.ns, out, 0.02f, "the normal of a ball"); /* also: of unit length, so the radius is 4 */
        assert_true(ca_dot(s.ng, s.ns) > 0.99f && ca_accel_occluded(accel, inside, d, 0.0f, INFINITY));
        const ca_vec3 start = ca_offset_origin(s.position, s.position_error, s.ng, d);
        assert_false(ca_accel_intersect(accel, start, d, 0.0f, INFINITY, &next));
    }
    ca_accel_destroy(accel);
    ca_sdf_grid_destroy(grid);
}

/* A scene's next version shares the structure of equal grids, and outlives the first one. */
static void test_equal_grids_are_built_once(void **state)
{
    (void)state;
    const ca_matrix identity = ca_matrix_identity();
    ca_sdf_grid *first = make_grid(9, 9, 9, ball, &identity), *second = make_grid(9, 9, 9, ball, &identity);
    const ca_shape before = shape_of(first), after = shape_of(second);
    ca_accel *accel = build(&before), *next = NULL, *other = NULL;
    assert_int_equal(ca_accel_create_after(accel, &after, 1, 1, NULL, 0, 1, NULL, &next, NULL), CA_OK);
    assert_int_equal(ca_accel_builds(next), 0);
    ca_accel_destroy(accel);
    ca_sdf_grid_destroy(first);
    ca_hit hit;
    assert_true(ca_accel_intersect(next, (ca_vec3){0.5f, 0.4f, 5.0f}, (ca_vec3){0, 0, -1}, 0.0f, INFINITY, &hit));
    second->values[100] += 0.01f;
    assert_int_equal(ca_accel_create_after(next, &after, 1, 1, NULL, 0, 1, NULL, &other, NULL), CA_OK);
    assert_int_equal(ca_accel_builds(other), 1);
    ca_accel_destroy(next);
    ca_accel_destroy(other);
    ca_sdf_grid_destroy(second);
}

/* ---- Reading --------------------------------------------------------------------------------------------------- */

/* A header of the format's and 2 x 2 x 2 distances, the first of which is negative. */
typedef struct volume_file {
    char mark[3];
    unsigned char version;
    uint32_t kind, count[3], channels;
    float box[6], values[8];
} volume_file;

static volume_file good_file(void)
{
    return (volume_file){.mark = {'V', 'O', 'L'},
                         .version = 3,
                         .kind = 1,
                         .count = {2, 2, 2},
                         .channels = 1,
                         .values = {-1, 1, 1, 1, 1, 1, 1, 1}};
}

#define GRID(body) "<shape type=\"sdfgrid\"><string name=\"filename\" value=\"grid.vol\"/>" body "</shape>"

static void test_grids_are_read(void **state)
{
    (void)state;
    ca_scene_desc desc;
    const volume_file file = good_file();
    import_write("grid.vol", &file, sizeof file);
    import_text(&desc, SCENE(GRID("") GRID("<string name=\"normals\" value=\"analytic\"/>")), NULL, 0);
    assert_int_equal(desc.grids.count, 2);
    assert_true(desc.shapes.items[1].kind == CA_SHAPE_SDF_GRID && desc.shapes.items[1].as.sdf.index == 1);
    const ca_sdf_grid *grid = desc.grids.items[0];
    assert_true(grid->smooth && !desc.grids.items[1]->smooth && grid->voxel_count == 1);
    assert_memory_equal(grid->values, file.values, sizeof file.values);
    ca_scene_desc_destroy(&desc);
}

/* The message behind the file's name. */
static void refuses(const volume_file *file, size_t size, const char *expected)
{
    char message[256];
    import_write("grid.vol", file, size);
    snprintf(message, sizeof message, "2:1: %s/grid.vol: %s", import_folder(), expected);
    import_expect_error(SCENE(GRID("")), message);
}

static void test_bad_files(void **state)
{
    (void)state;
    volume_file file = good_file();
    refuses(&file, 40, "this is no volume, which begins with VOL and has a header of 48 bytes");
    refuses(&file, sizeof file - 1, "this volume ends too early: 2 x 2 x 2 floats do not fit");
    file.version = 2;
    refuses(&file, sizeof file, "this volume is of version 2; expected 3");
    file = good_file();
    file.kind = 2;
    refuses(&file, sizeof file, "this volume has numbers of kind 2; expected 1, floats");
    file = good_file();
    file.channels = 3;
    refuses(&file, sizeof file, "this volume has 3 values a sample; expected one, a distance");
    file = good_file();
    file.count[1] = 1;
    refuses(&file, sizeof file,
            "a grid of distances needs 2 samples along each axis, and this volume has 2 x 1 x 2");
    file = good_file();
    file.count[0] = file.count[1] = file.count[2] = UINT32_MAX;
    refuses(&file, sizeof file,
            "this volume ends too early: 4294967295 x 4294967295 x 4294967295 floats do not fit");
    file = good_file();
    file.values[5] = NAN;
    refuses(&file, sizeof file, "distance 5 of this volume is not a finite number");
    file = good_file();
    file.values[0] = 1.0f;
    import_write("grid.vol", &file, sizeof file);
    import_expect_error(SCENE(GRID("")), "2:1: no distance changes its sign, so there is no surface");
    file = good_file();
    import_write("grid.vol", &file, sizeof file);
    import_expect_error(SCENE(GRID("<emitter type=\"area\"/>")), "2:1: a grid of distances cannot emit light");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_first_hits),
        cmocka_unit_test(test_hits_are_mitsubas),
        cmocka_unit_test(test_planes),
        cmocka_unit_test(test_a_ball_is_closed),
        cmocka_unit_test(test_equal_grids_are_built_once),
        cmocka_unit_test(test_grids_are_read),
        cmocka_unit_test(test_bad_files),
    };
    return cmocka_run_group_tests(tests, NULL, import_remove_folder);
}
