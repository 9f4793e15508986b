/* Maps that must be rigid, or such times a scale, are so exactly: a matrix that is written with few digits is the
 * nearest one. */
#include "scene/scene.h"
#include "support/import_text.h"
#include "support/scene_text.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

/* A rotation with four digits, of which one is wrong: angles between columns are off by 4e-4, lengths by 1e-4. */
#define TURN                                                                                                         \
    "<transform name='to_world'><matrix value='0.6124 -0.3536 0.7075 1  0.5 0.8660 -0.0002 2  "                      \
    "-0.6122 0.3537 0.7069 3  0 0 0 1'/></transform>"
static const double turn[3][3] = {{0.6124, -0.3536, 0.7075}, {0.5, 0.8660, -0.0002}, {-0.6122, 0.3537, 0.7069}};

/* Columns of length 1 at right angles, and near those that were written. */
static void check_columns(double m[3][3], double tolerance)
{
    for (int a = 0; a < 3; a++)
        for (int b = 0; b < 3; b++) {
            double dot = 0.0;
            for (int row = 0; row < 3; row++) dot += m[row][a] * m[row][b];
            if (!(fabs(dot - (a == b ? 1.0 : 0.0)) <= tolerance))
                fail_msg("columns %d and %d: %.9g", a, b, dot);
            assert_true(fabs(m[a][b] - turn[a][b]) < 1e-3);
        }
}

static void check_map(const ca_affine *map)
{
    double m[3][3];
    for (int i = 0; i < 9; i++) m[i / 3][i % 3] = (double)map->to[i / 3][i % 3];
    check_columns(m, 4e-7);
    assert_true(map->to[0][3] == 1.0f && map->to[1][3] == 2.0f && map->to[2][3] == 3.0f);
}

static void check_matrix(const ca_matrix *matrix)
{
    double m[3][3];
    for (int i = 0; i < 9; i++) m[i / 3][i % 3] = matrix->m[i / 3][i % 3];
    check_columns(m, 1e-12);
}

static void test_rigid_maps(void **state)
{
    (void)state;
    ca_scene_desc desc;
    import_text(&desc,
                "<scene version='3.0.0'><sensor type='perspective'>" TURN "</sensor>"
                "<emitter type='spot'>" TURN "</emitter>"
                "<emitter type='projector'><texture name='irradiance' type='checkerboard'/>" TURN "</emitter>"
                "</scene>",
                NULL, 0);
    check_map(&desc.camera.camera.map);
    check_matrix(&desc.lights.items[0].as.spot.to_world);
    check_matrix(&desc.lights.items[1].as.projector.to_world);
    ca_scene_desc_destroy(&desc);
}

/* The scale is the mean one. */
static void test_spheres(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text("<scene version='3.0.0'><sensor type='perspective'/><shape type='sphere'>"
                                      "<transform name='to_world'><matrix value='2.0004 0 0 0  0 1.9996 0 0  "
                                      "0 0 2 0  0 0 0 1'/></transform></shape></scene>");
    assert_int_equal(scene->shapes[0].kind, CA_SHAPE_SPHERE);
    assert_true(fabsf(scene->shapes[0].as.sphere.radius - 2.0f) < 1e-6f);
    for (int i = 0; i < 9; i++)
        assert_true(fabsf(scene->shapes[0].as.sphere.map.to[i / 3][i % 3] - (i % 4 == 0 ? 2.0f : 0.0f)) < 1e-6f);
    ca_scene_release(scene);
}

/* Mirrors stay mirrors; what is exact stays as it is. */
static void test_nearest_rigid(void **state)
{
    (void)state;
    ca_matrix mirror = ca_matrix_scale(1.0004, -0.9997, 1.0), exact = ca_matrix_translate(3.0, 4.0, 5.0);
    const ca_matrix none = ca_matrix_scale(0.0, 1.0, 1.0);
    ca_matrix flat = none;
    assert_true(ca_matrix_make_rigid(&mirror) && ca_matrix_make_rigid(&exact));
    assert_false(ca_matrix_make_rigid(&flat));
    for (int row = 0; row < 4; row++)
        for (int column = 0; column < 4; column++) {
            const double one = row == column ? 1.0 : 0.0;
            assert_true(fabs(mirror.m[row][column] - (row == 1 ? -one : one)) < 1e-15);
            assert_true(exact.m[row][column] == (column == 3 && row < 3 ? 3.0 + row : one));
            assert_true(flat.m[row][column] == none.m[row][column]);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rigid_maps),
        cmocka_unit_test(test_spheres),
        cmocka_unit_test(test_nearest_rigid),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
