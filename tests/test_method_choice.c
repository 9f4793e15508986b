/* What integrator `auto` decides with: pure decisions by tables; what samples of the pilot tell of light that is lost
 * or too rare, against closed forms; the variance of a trial without its dots; and what a pixel's error counts. */
#include "render/lost_light.h"
#include "render/method_choice.h"
#include "render/method_light.h"
#include "render/method_trial.h"
#include "render/method_weights.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

/* ---- Decisions ------------------------------------------------------------------------------------------------- */

static void test_cost(void **state)
{
    (void)state;
    const ca_method_score seen = {.variance = 2.0, .common = 2.0, .seconds = 3.0, .passes = 10.0};
    const ca_method_score rare = {.variance = 1.0, .dots = 4.0, .common = 5.0, .seconds = 3.0, .passes = 10.0};
    const ca_method_score lost = {.variance = 0.0, .seconds = 1.0, .loses_light = true};
    assert_true(fabs(ca_method_cost(&seen) - 6.0) < 1e-9);
    assert_true(fabs(ca_method_cost(&rare) - 15.0) < 1e-9);
    assert_true(isinf(ca_method_cost(&lost)));
    const ca_method_score scores[] = {lost, rare, seen, seen};
    assert_int_equal(ca_method_best(scores, 4), 2);
    assert_int_equal(ca_method_best(scores, 2), 1);
    const ca_method_score quiet[] = {{.seconds = 3.0}, {.seconds = 1.0}, {.seconds = 2.0}};
    assert_int_equal(ca_method_best(quiet, 3), 1);
    /* What all methods have makes them alike, and the faster one better. */
    const ca_method_score shown = {.variance = 2.0, .common = 2.0, .shown = 7.0, .seconds = 3.0, .passes = 10.0};
    assert_true(fabs(ca_method_cost(&shown) - 27.0) < 1e-9);
    /* After 10 passes a tenth of the variance is left, and all of the blur. */
    const ca_method_score blurred = {.variance = 2.0, .common = 2.0, .blur = 0.3, .seconds = 3.0, .passes = 10.0};
    assert_true(fabs(ca_method_cost(&blurred) - (2.0 + 10.0 * 0.3) * 3.0) < 1e-9);
}

/* Half of what rare values bring is thought to be unseen; and fewer light paths leave no less noise. */
static void test_noise(void **state)
{
    (void)state;
    const ca_method bdpt = {.type = &ca_integrator_bdpt}, more = {.type = &ca_integrator_bdpt, .light_paths_log4 = 1};
    const ca_method no_splats = {.type = &ca_integrator_bdpt, .no_splats = true, .light_paths_log4 = 2};
    const ca_method fewer = {.type = &ca_integrator_bdpt, .light_paths_log4 = -1};
    const ca_method methods[] = {bdpt, more, no_splats, fewer};
    ca_method_score scores[] = {{.variance = 2.0, .dots = 3.0, .common = 1.0, .seconds = 1.0},
                                {.variance = 4.0, .common = 4.0, .seconds = 1.0},
                                {.variance = 90.0, .common = 90.0, .seconds = 1.0},
                                {.variance = 1.0, .common = 1.0, .seconds = 1.0}};
    assert_true(fabs(ca_method_noise(&scores[0]) - (5.0 + 0.5 * 4.0)) < 1e-12);
    assert_true(ca_method_noise(&scores[1]) == 4.0);
    ca_methods_compare_noise(methods, scores, 4);
    assert_true(fabs(ca_method_cost(&scores[0]) - 7.0) < 1e-9);
    assert_true(fabs(ca_method_cost(&scores[1]) - 4.0) < 1e-9);
    assert_true(fabs(ca_method_cost(&scores[2]) - 90.0) < 1e-9);
    assert_true(fabs(ca_method_cost(&scores[3]) - 7.0) < 1e-9);
}

static double blur_of(const ca_integrator_type *type, double by_pilot, double passes, double merged_alone)
{
    const ca_method method = {.type = type};
    const ca_blur_signs signs = {
        .by_pilot = by_pilot, .variance = 6.4, .alpha = 0.5, .passes = passes, .merged_alone = merged_alone};
    return ca_method_blur(&method, &signs);
}

/* Between half the variance after 64 passes, where the radius has its least error, which shrinks from there, and what
 * the pilot tells; far less where connections find light, too, but for what they do not find. */
static void test_blur(void **state)
{
    (void)state;
    assert_true(blur_of(&ca_integrator_path, 0.5, 64.0, 0.0) == 0.0);
    assert_true(fabs(blur_of(&ca_integrator_ppm, 0.7, 64.0, 0.0) - sqrt(0.5 * 0.1 * 0.7)) < 1e-12);
    assert_true(fabs(blur_of(&ca_integrator_ppm, 0.7, 1024.0, 0.0) - sqrt(0.5 * 0.025 * 0.7)) < 1e-12);
    assert_true(fabs(blur_of(&ca_integrator_ppm, 0.7, 4.0, 1.0) - sqrt(0.5 * 0.4 * 0.7)) < 1e-12);
    assert_true(fabs(blur_of(&ca_integrator_vcm, 0.7, 64.0, 0.0) - sqrt(0.06 * 0.1 * 0.7)) < 1e-12);
    assert_true(fabs(blur_of(&ca_integrator_vcm, 0.7, 64.0, 1.0) - sqrt(0.5 * 0.1 * 0.7)) < 1e-12);
}

/* Merges that have weights blur no more than those that have none. */
static void test_blur_of_a_trial(void **state)
{
    (void)state;
    const double end = (double)INFINITY;
    ca_method_radii much = {0}, little;
    much.of[CA_MERGING_PPM].blur = (ca_radius_blur){2.0, 2.0, end};
    much.of[CA_MERGING_BDPM].blur = (ca_radius_blur){1.0, 2.0, end};
    little = much;
    much.of[CA_MERGING_AND_CONNECTING].blur = (ca_radius_blur){0.25, 2.0, end};
    little.of[CA_MERGING_AND_CONNECTING].blur = (ca_radius_blur){4.0, 2.0, end};
    const ca_method_trial path = {.method = {.type = &ca_integrator_path}, .radius = 3.0};
    const ca_method_trial ppm = {.method = {.type = &ca_integrator_ppm}, .radius = 3.0};
    const ca_method_trial bdpm = {.method = {.type = &ca_integrator_bdpm}, .radius = 3.0};
    const ca_method_trial vcm = {.method = {.type = &ca_integrator_vcm}, .radius = 3.0};
    assert_true(ca_method_trial_blur(&path, &much, 10.0) == 0.0);
    assert_true(fabs(ca_method_trial_blur(&ppm, &much, 10.0) - 18.0) < 1e-9);
    assert_true(fabs(ca_method_trial_blur(&bdpm, &much, 10.0) - 9.0) < 1e-9);
    assert_true(fabs(ca_method_trial_blur(&vcm, &much, 10.0) - 2.25) < 1e-9);
    assert_true(fabs(ca_method_trial_blur(&vcm, &little, 10.0) - 9.0) < 1e-9);
}

/* Twice the cost may be chance after a few iterations, not after many. */
static void test_goes_on(void **state)
{
    (void)state;
    const ca_method_score best = {.variance = 1.0, .common = 1.0, .seconds = 1.0};
    const ca_method_score twice = {.variance = 2.0, .common = 2.0, .seconds = 1.0};
    const ca_method_score lost = {.variance = 0.1, .common = 0.1, .seconds = 1.0, .loses_light = true};
    assert_true(ca_method_goes_on(&twice, &best, 4));
    assert_false(ca_method_goes_on(&twice, &best, 16));
    assert_true(ca_method_goes_on(&best, &best, 1000000));
    assert_false(ca_method_goes_on(&lost, &best, 1));
}

static void test_first_methods(void **state)
{
    (void)state;
    ca_method methods[CA_MOST_METHODS];
    const uint32_t count = ca_methods_first(methods);
    uint32_t merging = 0, alone = 0;
    for (uint32_t i = 0; i < count; i++) {
        assert_int_equal(methods[i].light_paths_log4, 0);
        merging += ca_method_merges(&methods[i]);
        alone += !ca_method_has_light_paths(&methods[i]);
        for (uint32_t j = 0; j < i; j++)
            assert_true(methods[i].type != methods[j].type || methods[i].no_splats != methods[j].no_splats);
    }
    assert_int_equal(merging, 4);
    assert_int_equal(alone, 1);
}

static void test_neighbours(void **state)
{
    (void)state;
    const ca_method path = {.type = &ca_integrator_path}, bdpm = {.type = &ca_integrator_bdpm};
    const ca_method more = {.type = &ca_integrator_bdpm, .light_paths_log4 = 1};
    ca_method next;
    assert_false(ca_method_neighbour(&path, 1, 8, &path, 1, &next)); /* it has no light paths */
    assert_true(ca_method_neighbour(&bdpm, 1, 8, &bdpm, 1, &next));
    assert_true(next.type == bdpm.type && next.light_paths_log4 == 1);
    assert_false(ca_method_neighbour(&bdpm, 1, 0, &bdpm, 1, &next));
    const ca_method tried[] = {bdpm, more};
    assert_false(ca_method_neighbour(&bdpm, 1, 8, tried, 2, &next));
    assert_true(ca_method_neighbour(&bdpm, -1, 8, tried, 2, &next) && next.light_paths_log4 == -1);
    assert_true(ca_method_neighbour(&more, 1, 8, tried, 2, &next) && next.light_paths_log4 == 2);
    const ca_method few = {.type = &ca_integrator_bdpm, .light_paths_log4 = -2};
    assert_false(ca_method_neighbour(&few, -1, 8, &few, 1, &next));
}

/* Guided light paths or usual ones: each is tried once. */
static void test_other_emission(void **state)
{
    (void)state;
    const ca_method path = {.type = &ca_integrator_path};
    const ca_method guided = {.type = &ca_integrator_ovcm, .light_paths_log4 = 1};
    ca_method other, back;
    assert_false(ca_method_other_emission(&path, &path, 1, &other));
    assert_true(ca_method_other_emission(&guided, &guided, 1, &other));
    assert_true(other.unguided && other.type == guided.type && other.light_paths_log4 == 1);
    const ca_method tried[] = {guided, other};
    assert_false(ca_method_other_emission(&guided, tried, 2, &back));
    assert_false(ca_method_other_emission(&other, tried, 2, &back));
    assert_true(ca_method_neighbour(&other, 1, 8, tried, 2, &back) && back.unguided);
}

/* ---- Light that is lost, or rare ------------------------------------------------------------------------------- */

enum { SIDE = 16, PER_PIXEL = 4 };

/* An evenly lit picture of SIDE x SIDE pixels at (100, 50), of which the method expects 10 samples of each piece;
 * `lost` of the first pixels are not found in so many batches. */
static size_t even_light(ca_light_sample *samples, uint32_t lost, uint32_t batches)
{
    size_t count = 0;
    for (uint32_t p = 0; p < SIDE * SIDE; p++)
        for (uint32_t b = 0; b < PER_PIXEL; b++) {
            const uint32_t batch = (p + b) % (p < lost ? batches : CA_LIGHT_BATCHES);
            samples[count++] = (ca_light_sample){.light = 1.0,
                                                 .expected = p < lost ? 0.0 : 10.0,
                                                 .batch = batch,
                                                 .x = 100 + p % SIDE,
                                                 .y = 50 + p / SIDE};
        }
    ca_lost_light(samples, count); /* sorts */
    return count;
}

static bool loses(uint32_t lost, uint32_t batches)
{
    static ca_light_sample samples[SIDE * SIDE * PER_PIXEL];
    const size_t count = even_light(samples, lost, batches);
    const ca_light_region region = {100, 50, 100 + SIDE, 50 + SIDE};
    return ca_method_loses_light(samples, count, &region);
}

static void test_loses_light(void **state)
{
    (void)state;
    assert_false(loses(0, 1));
    assert_true(loses(1, CA_LIGHT_BATCHES));    /* a quarter of one of 8 x 8 parts, 0.4 % of the picture */
    assert_false(loses(1, 3));                  /* which chance may do */
    assert_true(loses(SIDE, CA_LIGHT_BATCHES)); /* a row */
    assert_true(loses(SIDE * SIDE, CA_LIGHT_BATCHES));
}

static double one(const void *user, uint32_t x, uint32_t y)
{
    (void)user, (void)x, (void)y;
    return 1.0;
}

static double only_left(const void *user, uint32_t x, uint32_t y)
{
    (void)user, (void)y;
    return x < 100 + SIDE / 2 ? 1.0 : 0.0;
}

/* Two pieces of light y = 3 of which an iteration makes Q / T = 0.01 samples each bring 9 / 0.01 to the sum, less
 * what values of the pixel, here 3 / 0.01 / 2, bring up to the square that is no dot. */
static void test_dots(void **state)
{
    (void)state;
    const double scale = 50.0, per_path = 0.01, square = 4.0, left = 1.0 - square / (150.0 * 150.0);
    const ca_light_sample samples[] = {
        {.light = 7.0, .expected = 0.0, .x = 101, .y = 51}, /* lost: no variance comes of it */
        {.light = 3.0, .expected = scale * per_path, .x = 101, .y = 51},
        {.light = 3.0, .expected = scale * per_path, .x = 115, .y = 51},
        {.light = 3.0, .expected = scale * 10.0, .x = 101, .y = 51}, /* no dot */
        {.light = 3.0, .expected = scale * per_path, .shown = true, .x = 101, .y = 51}, /* of any method */
    };
    ca_dot_light light = {.square = square,
                          .camera_paths = 1000.0,
                          .expected_scale = scale,
                          .paths_of_pixel = 2.0,
                          .light_paths = 1.0,
                          .weight = one};
    const double each = left * 9.0 / per_path / 2000.0;
    assert_true(fabs(ca_method_dots(samples, 5, &light) - 2.0 * each) < 1e-9);
    light.weight = only_left;
    assert_true(fabs(ca_method_dots(samples, 5, &light) - each) < 1e-9);
}

/* With a quarter of the light paths there is a quarter of the splats, half of the samples here: 5/8 of all. */
static void test_dots_of_fewer_light_paths(void **state)
{
    (void)state;
    const ca_light_sample sample = {.light = 3.0, .expected = 0.8, .splats = 0.4, .x = 101, .y = 51};
    ca_dot_light light = {
        .camera_paths = 1.0, .expected_scale = 1.0, .paths_of_pixel = 1.0, .light_paths = 0.25, .weight = one};
    assert_true(fabs(ca_method_dots(&sample, 1, &light) - 9.0 / 0.5) < 1e-9);
    light.light_paths = 4.0;
    assert_true(fabs(ca_method_dots(&sample, 1, &light) - 9.0 / 2.0) < 1e-9);
}

/* Values 1, 3 and 50 in one cell, 2, 2, 2 in the other. */
static void test_variance_without_dots(void **state)
{
    (void)state;
    float values[] = {1.0f, 2.0f, 3.0f, 2.0f, 50.0f, 2.0f};
    const ca_method_trial trial = {.cells = {2, 1}, .samples = values, .iterations = 3};
    const double weights[] = {0.25, 7.0};
    assert_true(fabs(ca_method_trial_sum(&trial, 0) - 54.0) < 1e-12);
    const double all = 0.25 * (1.0 + 9.0 + 2500.0 - 54.0 * 54.0 / 3.0) / 2.0 / 2.0;
    assert_true(fabs(ca_method_trial_variance(&trial, weights, (double)INFINITY) - all) < 1e-9);
    /* 50 counts as 12, whose square times the weight is 36. */
    const double clamped = 0.25 * (1.0 + 9.0 + 144.0 - 16.0 * 16.0 / 3.0) / 2.0 / 2.0;
    assert_true(fabs(ca_method_trial_variance(&trial, weights, 36.0) - clamped) < 1e-9);
}

/* The eighth largest of the squares times weights: here those of 3 to 10, and of 1 twice. */
static void test_dot_square(void **state)
{
    (void)state;
    float values[] = {1.0f, 5.0f, 4.0f, 3.0f, 9.0f, 10.0f, 7.0f, 6.0f, 8.0f, 1.0f};
    const ca_method_trial trial = {.cells = {1, 1}, .samples = values, .iterations = 10};
    const double weight = 0.5;
    assert_true(fabs(ca_method_trial_dot_square(&trial, &weight) - 0.5 * 9.0) < 1e-9);
    const ca_method_trial longer = {.cells = {2, 1}, .samples = values, .iterations = 5};
    const double weights[] = {0.0, 1.0}; /* 5, 3, 10, 6, 1 */
    assert_true(ca_method_trial_dot_square(&longer, weights) == 0.0);
}

/* A trial of four iterations on 16 x 16 cells of light 1, but for a cell that chance has given one bright value, one
 * that always has such values, and one with a lamp in sight; all three far from each other. */
static void test_weights(void **state)
{
    (void)state;
    enum { WIDTH = 16, CELLS = WIDTH * WIDTH, LUCKY = 2 * WIDTH + 2, BRIGHT = 2 * WIDTH + 12, LAMP = 12 * WIDTH + 2 };
    static float values[4 * CELLS];
    static double shown[CELLS], weights[CELLS], luminance[CELLS];
    for (int i = 0; i < 4 * CELLS; i++) values[i] = 1.0f;
    for (int i = 0; i < 4; i++) values[i * CELLS + LUCKY] = i == 2 ? 80.0f : 0.0f;
    for (int i = 0; i < 4; i++) values[i * CELLS + BRIGHT] = 20.0f;
    shown[LAMP] = 4.0 * 7.0;
    const ca_method_trial trial = {.method = {.type = &ca_integrator_ppm},
                                   .cells = {WIDTH, WIDTH},
                                   .samples = values,
                                   .shown = shown,
                                   .iterations = 4};
    ca_method_weights w = {.cells = trial.cells, .weights = weights, .luminance = luminance};
    assert_int_equal(ca_method_weights_set(&w, &trial, 1, NULL), CA_OK);
    assert_true(fabs(luminance[CELLS - 1] - 1.0) < 1e-12 && fabs(weights[CELLS - 1] - 1.0 / 1.01) < 1e-12);
    const double nearby = (24.0 + 20.0) / 25.0; /* of 25 cells around the lucky one, and around the bright one */
    assert_true(fabs(luminance[LUCKY] - nearby) < 1e-12 && fabs(luminance[LUCKY + 1] - nearby) < 1e-12);
    assert_true(fabs(luminance[BRIGHT] - 20.0) < 1e-12 && fabs(luminance[BRIGHT + 1] - nearby) < 1e-12);
    assert_true(fabs(luminance[LAMP] - 1.0) < 1e-12 && fabs(weights[LAMP] - 1.0 / 64.01) < 1e-12);
    /* Where nothing is known of the error, all counts that is around. */
    const ca_method_trial once = {
        .method = trial.method, .cells = trial.cells, .samples = values, .shown = shown, .iterations = 1};
    assert_int_equal(ca_method_weights_set(&w, &once, 1, NULL), CA_OK);
    assert_true(fabs(luminance[BRIGHT] - nearby) < 1e-12);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_cost),
        cmocka_unit_test(test_noise),
        cmocka_unit_test(test_blur),
        cmocka_unit_test(test_blur_of_a_trial),
        cmocka_unit_test(test_goes_on),
        cmocka_unit_test(test_first_methods),
        cmocka_unit_test(test_neighbours),
        cmocka_unit_test(test_other_emission),
        cmocka_unit_test(test_loses_light),
        cmocka_unit_test(test_dots),
        cmocka_unit_test(test_dots_of_fewer_light_paths),
        cmocka_unit_test(test_variance_without_dots),
        cmocka_unit_test(test_dot_square),
        cmocka_unit_test(test_weights),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
