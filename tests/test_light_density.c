/* Chi-square tests of every light: directions of next event, directions and origins of emission. */
#include "light/light.h"
#include "math/numeric.h"
#include "support/chi_square.h"
#include "support/shared_light_fixture.h"
#include "support/test_random.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

enum { TESTS = 2 * LIGHT_COUNT };
static const ca_vec2 fixed_position = {0.31f, 0.62f};

static ca_chi_square_test coarse(int light)
{
    return (ca_chi_square_test){.name = ca_test_light_names[light],
                                .sample_count = 40000,
                                .ring_count = 12,
                                .cut_count = 12,
                                .test_count = TESTS};
}

/* ---- Next event ------------------------------------------------------------------------------------------------ */

static bool draw_direct(const void *context, const float u[3], ca_vec3 *direction)
{
    const int i = *(const int *)context;
    ca_light_direct direct;
    if (!ca_light_sample_direct(&fixture.lights[i], ca_light_fixture_reference(i), (ca_vec2){u[0], u[1]}, &direct))
        return false;
    *direction = direct.to_light;
    return true;
}

/* From what a path that leaves in this direction would be told where it meets the light. */
static float direct_density(const void *context, ca_vec3 direction)
{
    const int i = *(const int *)context;
    const ca_light *light = &fixture.lights[i];
    const ca_vec3 reference = ca_light_fixture_reference(i), back = ca_neg(direction);
    if (i >= LIGHT_SHAPES) return ca_light_eval_hit(light, reference, NULL, back).pdf_direct.v;
    float t = 0.0f;
    ca_surface surface;
    if (!ca_light_fixture_trace(&fixture, i, reference, direction, 0.0f, &t, &surface)) return 0.0f;
    return ca_light_eval_hit(light, reference, &surface, back).pdf_direct.v;
}

static void test_direct(void **state)
{
    (void)state;
    static const int lights[] = {LIGHT_SPHERE,     LIGHT_SPHERE_IN, LIGHT_DISK,    LIGHT_CYLINDER,
                                 LIGHT_QUADRANGLE, LIGHT_RECTANGLE, LIGHT_CONSTANT};
    for (size_t k = 0; k < sizeof lights / sizeof lights[0]; k++) {
        ca_chi_square_test test = coarse(lights[k]);
        test.sample = draw_direct;
        test.pdf = direct_density;
        test.context = &lights[k];
        if (lights[k] < LIGHT_SHAPES) {
            ca_vec3 low, high;
            ca_shape_bounds(&fixture.shapes[lights[k]], &low, &high);
            test.axis = ca_normalize(ca_sub(ca_mul(ca_add(low, high), 0.5f), ca_light_fixture_reference(lights[k])));
        }
        ca_chi_square_assert(&test);
    }
}

/* ---- Emission -------------------------------------------------------------------------------------------------- */

static bool draw_emission(const void *context, const float u[3], ca_vec3 *direction)
{
    ca_light_emission emission;
    const ca_light *light = &fixture.lights[*(const int *)context];
    const ca_vec2 u_direction = {u[0], u[1]};
    const ca_vec2 u_position =
        light->kind == CA_LIGHT_PROJECTOR ? u_direction : fixed_position; /* its place in the picture */
    if (!ca_light_sample_emission(light, u_position, u_direction, &emission)) return false;
    *direction = emission.direction;
    return true;
}

/* From next event (point-like lights) or a chance hit (the others) along the same ray. */
static float emission_density(const void *context, ca_vec3 direction)
{
    const int i = *(const int *)context;
    const ca_light *light = &fixture.lights[i];
    if (ca_light_has_dirac_position(light)) {
        ca_light_direct direct;
        const ca_vec3 position = light->kind == CA_LIGHT_POINT  ? light->as.point.position
                                 : light->kind == CA_LIGHT_SPOT ? light->as.spot.position
                                                                : light->as.projector.position;
        const ca_vec3 reference = ca_madd(position, 2.0f, direction);
        return ca_light_sample_direct(light, reference, fixed_position, &direct) ? direct.pdf_direction.v : 0.0f;
    }
    if (i >= LIGHT_SHAPES) return ca_light_eval_hit(light, (ca_vec3){0}, NULL, direction).pdf_direction.v;
    ca_surface surface;
    ca_shape_sample_area(light->as.area.shape, fixed_position, &surface);
    return ca_light_eval_hit(light, ca_madd(surface.position, 1.0f, direction), &surface, direction).pdf_direction.v;
}

static void test_emission_directions(void **state)
{
    (void)state;
    for (int i = 0; i < LIGHT_COUNT; i++) {
        if (ca_light_has_dirac_direction(&fixture.lights[i]) || i == LIGHT_ENVMAP) continue;
        ca_chi_square_test test = coarse(i);
        test.sample = draw_emission;
        test.pdf = emission_density;
        test.context = &i;
        if (i > LIGHT_POINT) test.axis = (ca_vec3){0.0f, -1.0f, 0.0f};
        ca_chi_square_assert(&test);
    }
}

/* An environment map's density jumps from cell to cell of its table: counted there, and expected from the density's
 * values inside of the cells. Directions are those to the light. */
enum { COLUMNS = 16, ROWS = 8, CELLS = COLUMNS * ROWS };

static double cell_density(const ca_light *light, int cell)
{
    enum { STEPS = 8 };
    double sum = 0.0;
    for (int y = 0; y < STEPS; y++)
        for (int x = 0; x < STEPS; x++) {
            const double theta = CA_PI_D * (cell / COLUMNS + (y + 0.5) / STEPS) / ROWS;
            const double phi = 2.0 * CA_PI_D * (cell % COLUMNS + (x + 0.5) / STEPS) / COLUMNS;
            const ca_vec3 local = {(float)(sin(phi) * sin(theta)), (float)cos(theta),
                                   (float)(-cos(phi) * sin(theta))};
            const ca_vec3 back = ca_neg(ca_map_vector(light->as.envmap.map.to, local));
            sum += (double)ca_light_eval_hit(light, (ca_vec3){0}, NULL, back).pdf_direct.v * sin(theta);
        }
    return sum * 2.0 * CA_PI_D * CA_PI_D / (CELLS * STEPS * STEPS);
}

static int cell_of(const ca_light *light, ca_vec3 to_light)
{
    const ca_vec3 local = ca_map_vector(light->as.envmap.map.from, to_light);
    const double phi = atan2((double)local.x, -(double)local.z) / (2.0 * CA_PI_D);
    const int band = (int)(acos((double)ca_clamp(local.y, -1.0f, 1.0f)) / CA_PI_D * ROWS);
    const int row = band < ROWS ? band : ROWS - 1; /* the pole itself ends the last band */
    return row * COLUMNS + (int)((phi < 0.0 ? phi + 1.0 : phi) * COLUMNS) % COLUMNS;
}

static void test_envmap_cells(void **state)
{
    (void)state;
    enum { COUNT = 300000 };
    const ca_light *light = &fixture.lights[LIGHT_ENVMAP];
    double by_direct[CELLS] = {0}, by_emission[CELLS] = {0}, expected[CELLS], total = 0.0;
    ca_test_random random = ca_test_random_seed(3);
    for (int i = 0; i < COUNT; i++) {
        const float x = ca_test_random_float(&random);
        const ca_vec2 u = {x, ca_test_random_float(&random)};
        ca_light_direct direct;
        ca_light_emission emission;
        assert_true(ca_light_sample_direct(light, (ca_vec3){0}, u, &direct));
        by_direct[cell_of(light, direct.to_light)]++;
        assert_true(ca_light_sample_emission(light, fixed_position, u, &emission));
        by_emission[cell_of(light, ca_neg(emission.direction))]++;
    }
    for (int i = 0; i < CELLS; i++) total += expected[i] = COUNT * cell_density(light, i);
    assert_true(fabs(total / COUNT - 1.0) < 1e-3);
    assert_true(ca_chi_square_counts(by_direct, expected, CELLS, NULL, NULL) > ca_sidak_level(0.01, TESTS));
    assert_true(ca_chi_square_counts(by_emission, expected, CELLS, NULL, NULL) > ca_sidak_level(0.01, TESTS));
}

/* Origins of lights at infinity, in polar coordinates of their disk, all of it in front of the scene. */
static void test_emission_disk(void **state)
{
    (void)state;
    enum { SIDE = 12, COUNT = 60000 };
    static const int lights[] = {LIGHT_DIRECTIONAL, LIGHT_CONSTANT, LIGHT_ENVMAP};
    for (int k = 0; k < 3; k++) {
        const ca_light *light = &fixture.lights[lights[k]];
        double observed[SIDE * SIDE] = {0}, expected[SIDE * SIDE];
        ca_test_random random = ca_test_random_seed((uint64_t)k);
        for (int i = 0; i < COUNT; i++) {
            const ca_vec2 u_position = {ca_test_random_float(&random), ca_test_random_float(&random)};
            ca_light_emission emission;
            assert_true(ca_light_sample_emission(light, u_position, (ca_vec2){0.4f, 0.7f}, &emission));
            assert_true(fabsf(emission.pdf_position.v * CA_PI * 100.0f - 1.0f) < 1e-6f);
            const ca_vec3 from_center = ca_sub(emission.origin, light->scene_center);
            assert_true(ca_dot(from_center, emission.direction) < -9.999f);
            const ca_frame frame = ca_frame_from_normal(emission.direction);
            const ca_vec3 p = ca_mul(ca_to_local(&frame, from_center), 0.1f);
            const float r2 = p.x * p.x + p.y * p.y, turn = atan2f(p.y, p.x) * CA_INV_TWO_PI + 0.5f;
            assert_true(r2 < 1.00001f);
            observed[ca_min_u32((uint32_t)(r2 * SIDE), SIDE - 1) * SIDE +
                     ca_min_u32((uint32_t)(turn * SIDE), SIDE - 1)]++;
        }
        for (int i = 0; i < SIDE * SIDE; i++) expected[i] = (double)COUNT / (SIDE * SIDE);
        assert_true(ca_chi_square_counts(observed, expected, SIDE * SIDE, NULL, NULL) > ca_sidak_level(0.01, TESTS));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_direct),
        cmocka_unit_test(test_emission_directions),
        cmocka_unit_test(test_envmap_cells),
        cmocka_unit_test(test_emission_disk),
    };
    return cmocka_run_group_tests_name("light densities", tests, set_up, tear_down);
}
