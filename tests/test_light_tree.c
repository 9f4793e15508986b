/* The tree over lights: probabilities sum up to 1 and are those with which lights are drawn, whoever asks; nearby
 * numbers draw nearby lights; a light that is never drawn does not shine there; bounds hold what they bound; failed
 * allocations leak nothing. */
#include "light/light_choice.h"

#include "base/memory.h"
#include "light/light_bounds.h"
#include "math/numeric.h"
#include "support/chi_square.h"
#include "support/shared_light_fixture.h"
#include "support/test_random.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>

#include <cmocka.h>

enum { MANY = 300 };
static ca_light many[MANY];
static ca_shape shapes[MANY];

static float between(ca_test_random *random, float low, float high)
{
    return low + (high - low) * ca_test_random_float(random);
}

static ca_vec3 somewhere(ca_test_random *random, float reach)
{
    const float x = between(random, -reach, reach), y = between(random, -reach, reach);
    return (ca_vec3){x, y, between(random, -reach, reach)};
}

static ca_light disk_light(ca_shape *shape, ca_test_random *random)
{
    const ca_vec3 p = somewhere(random, 5.0f);
    const ca_frame f = ca_frame_from_normal(ca_normalize(somewhere(random, 1.0f)));
    const float r = between(random, 0.01f, 0.5f);
    const ca_matrix map = {{{(double)(r * f.s.x), (double)(r * f.t.x), (double)f.n.x, (double)p.x},
                            {(double)(r * f.s.y), (double)(r * f.t.y), (double)f.n.y, (double)p.y},
                            {(double)(r * f.s.z), (double)(r * f.t.z), (double)f.n.z, (double)p.z},
                            {0, 0, 0, 1}}};
    *shape = (ca_shape){.kind = CA_SHAPE_DISK, .area = CA_PI * r * r};
    assert_true(ca_affine_from_matrix(&map, &shape->as.disk.map));
    return (ca_light){.kind = CA_LIGHT_AREA, .as.area = {.shape = shape, .radiance = CA_NONE}};
}

static ca_light spot_light(ca_test_random *random)
{
    ca_light light = fixture.lights[LIGHT_SPOT];
    light.as.spot.position = somewhere(random, 5.0f);
    light.as.spot.cutoff = between(random, 0.1f, CA_PI);
    light.as.spot.beam = 0.7f * light.as.spot.cutoff;
    return light;
}

/* Disks, spots and points, and a few in one place. */
static void make_many(void)
{
    ca_test_random random = ca_test_random_seed(1);
    for (int i = 0; i < MANY; i++) {
        if (i % 3 == 0) many[i] = disk_light(&shapes[i], &random);
        if (i % 3 == 1) many[i] = spot_light(&random);
        if (i % 3 == 2) {
            const float power = between(&random, 0.1f, 3.0f);
            many[i] = (ca_light){.kind = CA_LIGHT_POINT,
                                 .as.point = {i < 20 ? (ca_vec3){1, 1, 1} : somewhere(&random, 5.0f),
                                              {power, power, power}}};
        }
        assert_int_equal(ca_light_prepare(&many[i], (ca_vec3){0}, 10.0f, NULL), CA_OK);
    }
}

static ca_light_receiver random_receiver(ca_test_random *random)
{
    ca_light_receiver receiver = {.position = somewhere(random, 6.0f)};
    if (ca_test_random_float(random) < 0.7f) receiver.normal = ca_normalize(somewhere(random, 1.0f));
    return receiver;
}

/* ---- Probabilities --------------------------------------------------------------------------------------------- */

static void test_sums_are_one(void **state)
{
    (void)state;
    for (uint32_t count = 1; count <= MANY; count += count < 12 ? 1 : 72) {
        ca_light_tree tree;
        assert_int_equal(ca_light_tree_create(&tree, many, count, NULL), CA_OK);
        ca_test_random random = ca_test_random_seed(count);
        double mean = 0.0;
        for (int k = 0; k < 200; k++) {
            const ca_light_receiver receiver = random_receiver(&random);
            double sum = 0.0;
            for (uint32_t i = 0; i < count; i++) {
                const float p = ca_light_tree_probability(&tree, &receiver, i);
                assert_true(p >= 0.0f && p <= 1.0f);
                sum += (double)p;
            }
            /* Less than 1 where a child turns out to hold nothing that shines there. */
            assert_true(sum < 1.0 + 1e-4);
            mean += sum / 200;
        }
        if (count == MANY) assert_true(mean > 0.75);
        ca_light_tree_destroy(&tree);
    }
}

static void test_frequencies(void **state)
{
    (void)state;
    enum { RECEIVERS = 12, DRAWS = 200000 };
    ca_light_tree tree;
    assert_int_equal(ca_light_tree_create(&tree, many, MANY, NULL), CA_OK);
    ca_test_random random = ca_test_random_seed(7);
    for (int r = 0; r < RECEIVERS; r++) {
        const ca_light_receiver receiver = random_receiver(&random);
        double observed[MANY + 1] = {0}, expected[MANY + 1], left = DRAWS;
        for (int k = 0; k < DRAWS; k++) {
            float p;
            float u = ca_test_random_float(&random);
            const uint32_t light = ca_light_tree_sample(&tree, &receiver, &u, &p);
            observed[light == CA_NONE ? MANY : light] += 1.0;
            if (light == CA_NONE) {
                assert_true(p == 0.0f);
                continue;
            }
            const float again = ca_light_tree_probability(&tree, &receiver, light);
            assert_true(p > 0.0f && fabsf(p - again) <= 1e-5f * p);
        }
        for (uint32_t i = 0; i < MANY; i++) {
            expected[i] = DRAWS * (double)ca_light_tree_probability(&tree, &receiver, i);
            left -= expected[i];
        }
        expected[MANY] = fmax(left, 0.0); /* nothing that can shine there */
        assert_true(ca_chi_square_counts(observed, expected, MANY + 1, NULL, NULL) >
                    ca_sidak_level(0.01, RECEIVERS));
    }
    ca_light_tree_destroy(&tree);
}

/* Inversion: as the number grows each light comes once. */
static void test_each_light_has_one_interval(void **state)
{
    (void)state;
    enum { STEPS = 1 << 16 };
    ca_light_tree tree;
    assert_int_equal(ca_light_tree_create(&tree, many, MANY, NULL), CA_OK);
    ca_test_random random = ca_test_random_seed(8);
    for (int r = 0; r < 10; r++) {
        const ca_light_receiver receiver = random_receiver(&random);
        bool seen[MANY] = {false};
        uint32_t last = CA_NONE;
        for (int k = 0; k < STEPS; k++) {
            float p;
            float u = (float)k / STEPS;
            const uint32_t light = ca_light_tree_sample(&tree, &receiver, &u, &p);
            if (light == last || light == CA_NONE) continue;
            assert_false(seen[light]);
            seen[light] = true;
            last = light;
        }
    }
    ca_light_tree_destroy(&tree);
}

/* ---- What is left out ------------------------------------------------------------------------------------------ */

/* A light of probability 0 sends nothing to the receiver's front. */
static void test_nothing_that_shines_is_left_out(void **state)
{
    (void)state;
    ca_light_tree tree;
    assert_int_equal(ca_light_tree_create(&tree, many, MANY, NULL), CA_OK);
    ca_test_random random = ca_test_random_seed(9);
    uint32_t left_out = 0;
    for (int r = 0; r < 400; r++) {
        const ca_light_receiver receiver = random_receiver(&random);
        const bool all_around = ca_length(receiver.normal) == 0.0f;
        for (uint32_t i = 0; i < MANY; i++) {
            if (ca_light_tree_probability(&tree, &receiver, i) > 0.0f) continue;
            left_out++;
            for (int k = 0; k < 8; k++) {
                const float x = ca_test_random_float(&random);
                ca_light_direct direct;
                if (!ca_light_sample_direct(&many[i], receiver.position,
                                            (ca_vec2){x, ca_test_random_float(&random)}, &direct))
                    continue;
                if (!all_around && ca_dot(direct.to_light, receiver.normal) < 1e-3f) continue;
                if (direct.cos_light < 1e-3f) continue;
                fail_msg("light %u of kind %d is left out", i, (int)many[i].kind);
            }
        }
    }
    assert_true(left_out > 1000);
    ca_light_tree_destroy(&tree);
}

/* Points and directions of emission are within the bounds, of one light and of all. */
static void test_bounds_hold(void **state)
{
    (void)state;
    ca_test_random random = ca_test_random_seed(10);
    for (int i = 0; i < LIGHT_COUNT; i++) {
        ca_light_bounds one, both, other;
        assert_int_equal(ca_light_bounds_of(&fixture.lights[i], &one), ca_light_falls_off(&fixture.lights[i]));
        if (!ca_light_falls_off(&fixture.lights[i])) continue;
        assert_true(ca_light_bounds_of(&fixture.lights[(i * 5 + 3) % LIGHT_DIRECTIONAL], &other));
        both = ca_light_bounds_union(&other, &one);
        assert_true(one.intensity > 0.0f && both.intensity >= one.intensity);
        for (int k = 0; k < 2000; k++) {
            ca_light_emission e;
            const ca_vec2 u = {ca_test_random_float(&random), 0.5f};
            const ca_vec2 v = {ca_test_random_float(&random), ca_test_random_float(&random)};
            if (!ca_light_sample_emission(&fixture.lights[i], (ca_vec2){u.x, v.y}, v, &e)) continue;
            const ca_light_bounds *bounds[] = {&one, &both};
            for (int b = 0; b < 2; b++) {
                const ca_vec3 slack =
                    ca_max_vec3(ca_sub(bounds[b]->low, e.origin), ca_sub(e.origin, bounds[b]->high));
                assert_true(ca_max3(slack) < 1e-5f);
                const float angle = acosf(ca_clamp(ca_dot(bounds[b]->axis, e.direction), -1.0f, 1.0f));
                assert_true(angle < bounds[b]->normal_angle + bounds[b]->emission_angle + 1e-3f);
            }
        }
    }
}

/* ---- Among all kinds ------------------------------------------------------------------------------------------- */

/* With lights at infinity: probabilities of the choice sum up to 1, and its samples have them. */
static void test_choice_with_the_sky(void **state)
{
    (void)state;
    ca_light_choice choice;
    assert_int_equal(ca_light_choice_create(&choice, fixture.lights, LIGHT_COUNT, NULL), CA_OK);
    assert_true(choice.tree.node_count > 0);
    ca_test_random random = ca_test_random_seed(11);
    for (int r = 0; r < 50; r++) {
        const ca_light_receiver receiver = random_receiver(&random);
        double observed[LIGHT_COUNT + 1] = {0}, expected[LIGHT_COUNT + 1], left = 20000.0;
        for (int k = 0; k < 20000; k++) {
            float p;
            const uint32_t light =
                ca_light_choice_sample_direct(&choice, &receiver, ca_test_random_float(&random), &p);
            observed[light == CA_NONE ? LIGHT_COUNT : light] += 1.0;
            if (light == CA_NONE) continue;
            const float again = ca_light_choice_direct_probability(&choice, &receiver, light);
            assert_true(fabsf(p - again) <= 1e-5f * p);
            const float ratio = p / ca_light_choice_probability(&choice, light);
            assert_true(fabsf(ca_light_choice_ratio(&choice, &receiver, light) - ratio) <= 1e-4f * ratio);
        }
        for (uint32_t i = 0; i < LIGHT_COUNT; i++) {
            expected[i] = 20000.0 * (double)ca_light_choice_direct_probability(&choice, &receiver, i);
            left -= expected[i];
            assert_true(expected[i] > 0.0 || ca_light_falls_off(&fixture.lights[i]));
        }
        expected[LIGHT_COUNT] = fmax(left, 0.0);
        assert_true(ca_chi_square_counts(observed, expected, LIGHT_COUNT + 1, NULL, NULL) > ca_sidak_level(0.01, 50));
    }
    ca_light_choice_destroy(&choice);
}

/* However many ask at once, each gets the light and the probability that it gets alone, to the bit. */
static void check_queries(const ca_light *lights, uint32_t light_count)
{
    enum { QUERIES = 333 };
    static ca_light_query queries[QUERIES];
    ca_light_choice choice;
    assert_int_equal(ca_light_choice_create(&choice, lights, light_count, NULL), CA_OK);
    ca_test_random random = ca_test_random_seed(12);
    for (uint32_t count = 0; count <= QUERIES; count += 37) {
        float u[QUERIES];
        for (uint32_t i = 0; i < count; i++) {
            u[i] = ca_test_random_float(&random);
            queries[i] = (ca_light_query){.receiver = random_receiver(&random), .u = u[i]};
        }
        ca_light_choice_sample_direct_many(&choice, queries, count);
        for (uint32_t i = 0; i < count; i++) {
            float p;
            assert_int_equal(queries[i].light,
                             ca_light_choice_sample_direct(&choice, &queries[i].receiver, u[i], &p));
            assert_int_equal(ca_float_bits(queries[i].probability), ca_float_bits(p));
        }
    }
    ca_light_choice_destroy(&choice);
}

static void test_many_at_once(void **state)
{
    (void)state;
    check_queries(fixture.lights, LIGHT_COUNT);
    check_queries(many, MANY);
    check_queries(many, 1);
    check_queries(many, 0);
}

static void test_allocation_failures(void **state)
{
    (void)state;
    ca_status status = CA_ERROR_MEMORY;
    for (long n = 0; status != CA_OK; n++) {
        ca_light_choice choice;
        ca_memory_fail_after(n);
        status = ca_light_choice_create(&choice, many, 40, NULL);
        ca_memory_fail_after(-1);
        assert_true(status == CA_OK || status == CA_ERROR_MEMORY);
        if (status != CA_OK) assert_null(choice.tree.nodes);
        ca_light_choice_destroy(&choice);
    }
}

static int set_up_all(void **state)
{
    const int failed = set_up(state);
    make_many();
    return failed;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sums_are_one),
        cmocka_unit_test(test_frequencies),
        cmocka_unit_test(test_each_light_has_one_interval),
        cmocka_unit_test(test_nothing_that_shines_is_left_out),
        cmocka_unit_test(test_bounds_hold),
        cmocka_unit_test(test_choice_with_the_sky),
        cmocka_unit_test(test_many_at_once),
        cmocka_unit_test(test_allocation_failures),
    };
    return cmocka_run_group_tests_name("tree of lights", tests, set_up_all, tear_down);
}
