/* Choosing among lights by power, and the ways in which preparing a light can fail. */
#include "light/light_choice.h"

#include "base/memory.h"
#include "math/numeric.h"
#include "support/shared_light_fixture.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

static void test_bad_pictures(void **state)
{
    (void)state;
    ca_error error;
    float *pixel = &fixture.environment.data[30], saved = *pixel;
    *pixel = NAN;
    ca_light light = fixture.lights[LIGHT_ENVMAP];
    assert_int_equal(ca_light_prepare(&light, (ca_vec3){0}, 1.0f, &error), CA_ERROR_SCENE);
    *pixel = saved;
    pixel = &fixture.picture.data[30];
    saved = *pixel;
    *pixel = INFINITY;
    light = fixture.lights[LIGHT_PROJECTOR];
    assert_int_equal(ca_light_prepare(&light, (ca_vec3){0}, 1.0f, &error), CA_ERROR_SCENE);
    *pixel = saved;
}

static void test_allocation_failures(void **state)
{
    (void)state;
    static const int kinds[] = {LIGHT_ENVMAP, LIGHT_PROJECTOR};
    for (int k = 0; k < 2; k++) {
        ca_status status = CA_ERROR_MEMORY;
        for (long n = 0; status != CA_OK; n++) {
            ca_light light = fixture.lights[kinds[k]];
            *(kinds[k] == LIGHT_ENVMAP ? &light.as.envmap.cells : &light.as.projector.pixels) =
                (ca_distribution_2d){0};
            ca_memory_fail_after(n);
            status = ca_light_prepare(&light, (ca_vec3){0}, 1.0f, NULL);
            ca_memory_fail_after(-1);
            assert_true(status == CA_OK || status == CA_ERROR_MEMORY);
            ca_light_release(&light);
        }
    }
}

static void test_choice(void **state)
{
    (void)state;
    ca_light_choice choice;
    assert_int_equal(ca_light_choice_create(&choice, fixture.lights, LIGHT_COUNT, NULL), CA_OK);
    double power[2] = {0.0, 0.0}, share[2] = {0.0, 0.0};
    for (uint32_t i = 0; i < LIGHT_COUNT; i++) {
        const bool falls_off = ca_light_falls_off(&fixture.lights[i]);
        power[falls_off] += (double)fixture.lights[i].power;
        share[falls_off] += (double)ca_light_choice_probability(&choice, i);
    }
    assert_true(fabs(share[0] + share[1] - 1.0) < 1e-6);
    for (int k = 0; k < 2; k++)
        assert_true(fabs(share[k] - fmin(fmax(power[k] / (power[0] + power[1]), 0.125), 0.875)) < 1e-6);
    for (uint32_t i = 0; i < LIGHT_COUNT; i++) { /* by power in each group */
        const bool falls_off = ca_light_falls_off(&fixture.lights[i]);
        const double expected = share[falls_off] * (double)fixture.lights[i].power / power[falls_off];
        assert_true(fabs((double)ca_light_choice_probability(&choice, i) - expected) < 1e-6);
    }
    float probability;
    const uint32_t chosen = ca_light_choice_sample(&choice, 0.7f, &probability);
    assert_true(chosen < LIGHT_COUNT && probability == ca_light_choice_probability(&choice, chosen));
    ca_light_choice_destroy(&choice);

    assert_int_equal(ca_light_choice_create(&choice, NULL, 0, NULL), CA_OK);
    assert_int_equal(ca_light_choice_sample(&choice, 0.3f, &probability), CA_NONE);
    assert_true(probability == 0.0f && ca_light_choice_probability(&choice, 0) == 0.0f);
    ca_light_choice_destroy(&choice);

    ca_light endless = fixture.lights[LIGHT_POINT];
    endless.power = INFINITY;
    ca_error error;
    assert_int_equal(ca_light_choice_create(&choice, &endless, 1, &error), CA_ERROR_SCENE);
}

/* The power of a sky grows with the scene; how likely a near lamp is asked, or starts a light path, does not fall
 * with it. Near the lamp the irradiances of both decide, and far away the lamp keeps an eighth. */
static void test_lamp_under_a_wide_sky(void **state)
{
    (void)state;
    for (float radius = 10.0f; radius < 2e5f; radius *= 10.0f) {
        ca_light lights[2] = {{.kind = CA_LIGHT_CONSTANT, .as.constant.radiance = {1.0f, 1.0f, 1.0f}},
                              {.kind = CA_LIGHT_POINT, .as.point.intensity = {10.0f, 10.0f, 10.0f}}};
        for (int i = 0; i < 2; i++)
            assert_int_equal(ca_light_prepare(&lights[i], (ca_vec3){0}, radius, NULL), CA_OK);
        ca_light_choice choice;
        assert_int_equal(ca_light_choice_create(&choice, lights, 2, NULL), CA_OK);
        const ca_light_receiver near = {{0.0f, 0.0f, -1.0f}, {0.0f, 0.0f, 1.0f}},
                                far = {{0.0f, 0.0f, -1e3f}, {0.0f, 0.0f, 1.0f}},
                                behind = {{0.0f, 0.0f, -1.0f}, {0.0f, 0.0f, -1.0f}};
        const double share = 10.0 / (10.0 + (double)CA_PI);
        assert_true(fabs((double)ca_light_choice_direct_probability(&choice, &near, 1) - share) < 0.01);
        assert_true(ca_light_choice_direct_probability(&choice, &far, 1) == 0.125f);
        assert_true(ca_light_choice_direct_probability(&choice, &behind, 1) == 0.0f);
        assert_true(ca_light_choice_direct_probability(&choice, &behind, 0) == 1.0f);
        assert_true(ca_light_choice_probability(&choice, 1) >= 0.125f - 1e-6f);
        ca_light_choice_destroy(&choice);
        for (int i = 0; i < 2; i++) ca_light_release(&lights[i]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_choice),
        cmocka_unit_test(test_lamp_under_a_wide_sky),
        cmocka_unit_test(test_bad_pictures),
        cmocka_unit_test(test_allocation_failures),
    };
    return cmocka_run_group_tests_name("light choice", tests, set_up, tear_down);
}
