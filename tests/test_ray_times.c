/* Times of paths: costs that are known are found again within their standard errors, with outliers, with one kind of
 * work only, and where all tiles are alike; what is measured in a pass, and that no image shows it; every failed
 * allocation is reported. */
#include "render/ray_times.h"

#include "base/clock.h"
#include "base/memory.h"
#include "render/cost_fit.h"
#include "render/pass.h"
#include "support/scene_text.h"
#include "support/test_random.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static const ca_cost_guess guess = {.ratio = 0.025, .deviation = 0.05};

static void assert_within(const char *what, double value, double expected, double tolerance)
{
    if (!(fabs(value - expected) <= tolerance))
        fail_msg("%s is %.6g, not %.6g +- %.2g", what, value, expected, tolerance);
}

/* ---- The fit --------------------------------------------------------------------------------------------------- */

enum { SAMPLES = 600 };
static const double segment_cost = 400e-9, candidate_cost = 15e-9;

/* Mean 0, variance 1: near to normal. */
static double scatter(ca_test_random *random)
{
    double sum = -6.0;
    for (int i = 0; i < 12; i++) sum += (double)ca_test_random_float(random);
    return sum;
}

/* Tiles with 600 to 1200 segments, and 0 to `most` candidates for each. */
static void make_samples(ca_cost_sample *samples, ca_test_random *random, double most, double relative_scatter)
{
    for (int i = 0; i < SAMPLES; i++) {
        const double segments = 600.0 + 600.0 * (double)ca_test_random_float(random);
        const double candidates = segments * most * (double)ca_test_random_float(random);
        const double seconds = segments * segment_cost + candidates * candidate_cost;
        samples[i] = (ca_cost_sample){{segments, candidates}, seconds * (1.0 + relative_scatter * scatter(random))};
    }
}

/* Many sets of samples: the mean of the estimates, and whether they scatter as their errors say. */
static void test_known_costs(void **state)
{
    (void)state;
    enum { SETS = 200 };
    ca_test_random random = ca_test_random_seed(1);
    ca_cost_sample samples[SAMPLES];
    double scratch[SAMPLES], deviations[2] = {0}, squares[2] = {0};
    for (int set = 0; set < SETS; set++) {
        make_samples(samples, &random, 100.0, 0.1);
        const ca_cost_fit fit = ca_fit_costs(samples, SAMPLES, guess, scratch);
        for (int k = 0; k < 2; k++) {
            const double z = (fit.cost[k] - (k ? candidate_cost : segment_cost)) / fit.error[k];
            deviations[k] += z / SETS;
            squares[k] += z * z / SETS;
            assert_true(fit.error[k] > 0.0 && fit.error[k] < 0.05 * fit.cost[k]);
        }
    }
    for (int k = 0; k < 2; k++) {
        assert_within("the mean deviation in standard errors", deviations[k], 0.0, 0.3);
        assert_within("the mean square deviation", squares[k], 1.0, 0.35);
    }
}

/* One of ten tiles takes 3 to 30 times as long. */
static void test_outliers(void **state)
{
    (void)state;
    ca_test_random random = ca_test_random_seed(2);
    ca_cost_sample samples[SAMPLES];
    double scratch[SAMPLES];
    make_samples(samples, &random, 100.0, 0.05);
    for (int i = 0; i < SAMPLES; i += 10) samples[i].seconds *= 3.0 + 27.0 * (double)ca_test_random_float(&random);
    const ca_cost_fit fit = ca_fit_costs(samples, SAMPLES, guess, scratch);
    assert_within("a segment", fit.cost[0], segment_cost, 0.03 * segment_cost);
    assert_within("a candidate", fit.cost[1], candidate_cost, 0.03 * candidate_cost);
    assert_within("a segment", fit.cost[0], segment_cost, 4.0 * fit.error[0]);
    assert_within("a candidate", fit.cost[1], candidate_cost, 4.0 * fit.error[1]);
}

static void test_one_kind_of_work(void **state)
{
    (void)state;
    ca_test_random random = ca_test_random_seed(3);
    ca_cost_sample samples[SAMPLES];
    double scratch[SAMPLES];
    make_samples(samples, &random, 0.0, 0.1);
    ca_cost_fit fit = ca_fit_costs(samples, SAMPLES, guess, scratch);
    assert_true(isnan(fit.cost[1]) && isnan(fit.error[1]));
    assert_within("a segment", fit.cost[0], segment_cost, 4.0 * fit.error[0]);
    assert_true(fit.error[0] < 0.01 * segment_cost);
    fit = ca_fit_costs(samples, 0, guess, scratch);
    assert_true(isnan(fit.cost[0]) && isnan(fit.error[0]) && isnan(fit.cost[1]));
    /* Work that costs nothing: the other has all the time, and where chance says less than nothing, it is 0. */
    int zeros = 0;
    for (int set = 0; set < 20; set++) {
        make_samples(samples, &random, 0.0, 0.1);
        for (int i = 0; i < SAMPLES; i++) samples[i].units[1] = 1000.0 * (double)ca_test_random_float(&random);
        fit = ca_fit_costs(samples, SAMPLES, guess, scratch);
        assert_within("a segment", fit.cost[0], segment_cost, 4.0 * fit.error[0] + 0.01 * segment_cost);
        assert_true(fit.cost[1] >= 0.0 && fit.cost[1] < 0.01 * candidate_cost + 4.0 * fit.error[1]);
        zeros += fit.cost[1] == 0.0;
    }
    assert_in_range(zeros, 3, 17);
    /* And the other way round. */
    zeros = 0;
    for (int set = 0; set < 20; set++) {
        make_samples(samples, &random, 100.0, 0.0);
        for (int i = 0; i < SAMPLES; i++)
            samples[i].seconds = samples[i].units[1] * candidate_cost * (1.0 + 0.1 * scatter(&random));
        fit = ca_fit_costs(samples, SAMPLES, guess, scratch);
        assert_within("a candidate", fit.cost[1], candidate_cost, 4.0 * fit.error[1] + 0.01 * candidate_cost);
        assert_true(fit.cost[0] >= 0.0 && fit.cost[0] < 0.01 * segment_cost + 4.0 * fit.error[0]);
        zeros += fit.cost[0] == 0.0;
    }
    assert_in_range(zeros, 3, 17);
    for (int i = 0; i < SAMPLES; i++) samples[i].seconds = samples[i].units[1] * candidate_cost;
    fit = ca_fit_costs(samples, SAMPLES, guess, scratch);
    assert_within("a candidate", fit.cost[1], candidate_cost, 1e-3 * candidate_cost);
    assert_true(fit.cost[0] >= 0.0 && fit.cost[0] < 1e-3 * segment_cost);
}

/* The sum is known, the parts only as well as the guess. */
static void test_tiles_alike(void **state)
{
    (void)state;
    ca_cost_sample samples[SAMPLES];
    double scratch[SAMPLES];
    for (int i = 0; i < SAMPLES; i++)
        samples[i] = (ca_cost_sample){{1000.0, 30000.0}, 1000.0 * segment_cost + 30000.0 * candidate_cost};
    const ca_cost_fit fit = ca_fit_costs(samples, SAMPLES, guess, scratch);
    assert_within("a tile", 1000.0 * fit.cost[0] + 30000.0 * fit.cost[1], samples[0].seconds,
                  1e-3 * samples[0].seconds);
    assert_true(fit.cost[0] > 0.0 && fit.cost[1] > 0.0);
    assert_within("a segment", fit.cost[0], segment_cost, fit.error[0]);
    assert_within("a candidate", fit.cost[1], candidate_cost, fit.error[1]);
    assert_true(fit.error[0] > 0.5 * fit.cost[0] && fit.error[1] > 0.5 * fit.cost[1]);
    /* A single one: the same, and its scatter is not taken for none. */
    const ca_cost_fit one = ca_fit_costs(samples, 1, guess, scratch);
    assert_within("a tile", 1000.0 * one.cost[0] + 30000.0 * one.cost[1], samples[0].seconds,
                  1e-3 * samples[0].seconds);
    assert_true(isfinite(one.error[0]) && one.error[0] > 0.1 * one.cost[0]);
}

/* ---- What is kept ---------------------------------------------------------------------------------------------- */

static ca_ray_times *new_times(uint32_t width, uint32_t height, uint32_t workers)
{
    ca_ray_times *times = NULL;
    ca_error error = {""};
    if (ca_ray_times_create(&times, width, height, workers, &error) != CA_OK) fail_msg("%s", error.message);
    return times;
}

static void test_nothing_measured(void **state)
{
    (void)state;
    ca_ray_times *times = new_times(2, 2, 1);
    const ca_ray_costs costs = ca_ray_times_costs(times);
    assert_true(isnan(costs.light_path) && isnan(costs.iteration) && isnan(costs.segment) && isnan(costs.candidate) &&
                isnan(costs.camera_path) && !costs.with_pairs);
    ca_ray_times_light(times, 0, 1.0); /* no light paths: says nothing of what they cost */
    assert_true(isnan(ca_ray_times_costs(times).light_path));
    ca_ray_times_destroy(times);
    ca_ray_times_destroy(NULL);
}

static void test_light_paths(void **state)
{
    (void)state;
    ca_ray_times *times = new_times(1, 1, 1);
    ca_test_random random = ca_test_random_seed(4);
    for (int i = 0; i < 8; i++) ca_ray_times_light(times, 10000, 0.02 * (1.0 + 0.02 * scatter(&random)));
    ca_ray_costs costs = ca_ray_times_costs(times);
    assert_true(costs.iteration < 1e-9);
    assert_within("a light path", costs.light_path, 2e-6, 4.0 * costs.light_path_error);
    assert_true(costs.light_path_error < 0.1 * costs.light_path);
    /* Two numbers of them tell what an iteration takes without any; one of a hundred passes is interrupted. */
    ca_ray_times_thin(times, 0);
    for (int i = 0; i < 300; i++) {
        const uint32_t paths = i % 2 ? 10000 : 2500;
        ca_ray_times_light(times, paths,
                           (i % 100 ? 1.0 : 10.0) * (1e-3 + paths * 2e-6) * (1.0 + 0.02 * scatter(&random)));
    }
    costs = ca_ray_times_costs(times);
    assert_within("a light path", costs.light_path, 2e-6, 4.0 * costs.light_path_error);
    assert_within("an iteration", costs.iteration, 1e-3, 4.0 * costs.iteration_error);
    assert_true(costs.iteration_error < 0.2e-3);
    ca_ray_times_destroy(times);
}

/* Far more tiles than are kept, by three workers; those with pairs cost double, and count where there are no
 * others. */
static void test_tiles(void **state)
{
    (void)state;
    ca_ray_times *times = new_times(3, 2, 3);
    ca_test_random random = ca_test_random_seed(5);
    for (int kind = 1; kind >= 0; kind--) {
        for (uint32_t i = 0; i < 20000; i++) {
            const uint64_t segments = 500 + i % 701, candidates = segments * (i % 97);
            const double seconds = (double)segments * segment_cost + (double)candidates * candidate_cost * (1 + kind);
            ca_ray_times_tile(times, i % 3, kind == 1, segments, candidates,
                              seconds * (1.0 + 0.05 * scatter(&random)));
        }
        const ca_ray_costs costs = ca_ray_times_costs(times);
        assert_within("a segment", costs.segment, segment_cost, 4.0 * costs.segment_error);
        assert_within("a candidate", costs.candidate, candidate_cost * (1 + kind), 4.0 * costs.candidate_error);
        assert_true(costs.segment_error < 0.02 * segment_cost && costs.candidate_error < 0.02 * candidate_cost);
        assert_int_equal(costs.with_pairs, kind == 1);
    }
    ca_ray_times_destroy(times);
}

static void test_pixels(void **state)
{
    (void)state;
    ca_ray_times *times = new_times(2, 2, 1);
    const ca_ray_costs costs = {
        .segment = 1e-6, .candidate = 1e-8, .segments_per_camera_path = 2.0, .candidates_per_pair = 0.5};
    ca_ray_times_pixel(times, 0, 0, 100, 4, 8, 40);    /* 10 candidates a camera path: 0.1 for each light path */
    ca_ray_times_pixel(times, 0, 0, 1000, 12, 40, 1200); /* 100: likewise */
    ca_ray_times_pixel(times, 1, 0, 100, 4, 4, 0);
    ca_ray_times_pixel(times, 1, 1, 0, 1, 1, 0); /* no light paths at all */
    double camera, merge;
    ca_ray_times_of_pixel(times, &costs, 0, 0, &camera, &merge);
    assert_within("t_B", camera, 48.0 / 16.0 * 1e-6, 1e-15);
    assert_within("t_M", merge, 0.1 * 1e-8, 1e-18);
    ca_ray_times_of_pixel(times, &costs, 1, 0, &camera, &merge);
    assert_within("t_B", camera, 1e-6, 1e-15);
    assert_true(merge == 0.0);
    ca_ray_times_of_pixel(times, &costs, 0, 1, &camera, &merge); /* never seen: the means */
    assert_within("t_B", camera, 2e-6, 1e-15);
    assert_within("t_M", merge, 0.5e-8, 1e-18);
    ca_ray_times_tile(times, 0, false, 53, 1240, 53 * 1e-6 + 1240 * 1e-8);
    ca_ray_times_thin(times, 0);
    const ca_ray_costs after = ca_ray_times_costs(times);
    assert_true(isnan(after.segment));
    assert_within("segments of a camera path", after.segments_per_camera_path, 53.0 / 21.0, 1e-12);
    assert_within("candidates of a pair", after.candidates_per_pair, (0.4 + 1.2) / 21.0, 1e-12);
    ca_ray_times_destroy(times);
}

/* Of a thousand tiles with few candidates eight are kept, which with eight of many candidates tell both costs; and of
 * a thousand passes as many as there are others. */
static void test_thinned(void **state)
{
    (void)state;
    ca_ray_times *times = new_times(1, 1, 1);
    ca_test_random random = ca_test_random_seed(9);
    for (int level = 0; level < 2; level++) {
        const int count = level == 0 ? 1000 : 8;
        for (int i = 0; i < count; i++) {
            const uint64_t segments = 1000, candidates = (uint64_t)((level == 0 ? 20000.0f : 200000.0f) *
                                                                    ca_test_random_float(&random));
            ca_ray_times_tile(times, 0, false, segments, candidates,
                              ((double)segments * segment_cost + (double)candidates * candidate_cost) *
                                  (1.0 + 0.01 * scatter(&random)));
        }
        for (int i = 0; i < count; i++) ca_ray_times_light(times, 1000, level == 0 ? 1e-3 : 3e-3);
        if (level == 0) ca_ray_times_thin(times, 8);
    }
    const ca_ray_costs costs = ca_ray_times_costs(times);
    assert_within("a segment", costs.segment, segment_cost, 0.2 * segment_cost);
    assert_within("a candidate", costs.candidate, candidate_cost, 0.1 * candidate_cost);
    assert_within("a light path", costs.light_path, 2e-6,
                  0.2e-6); /* as many of either kind; of a thousand the first would win */
    ca_ray_times_destroy(times);
}

/* Two that are pooled know what one would that had measured both: of tiles, as many of either where both together do
 * not fit; what pixels did is added. */
static void test_pooled(void **state)
{
    (void)state;
    ca_ray_times *times = new_times(2, 1, 1), *other = new_times(2, 1, 1);
    for (int i = 0; i < 1024; i++) { /* as many as are kept */
        ca_ray_times_tile(times, 0, false, 1000, 0, 1000 * segment_cost);
        ca_ray_times_tile(other, 0, false, 1000, 100000, 1000 * segment_cost + 100000 * candidate_cost);
    }
    for (int i = 0; i < 256; i++) { /* likewise */
        ca_ray_times_light(times, 1000, 1e-3);
        ca_ray_times_light(other, 1000, 3e-3);
    }
    ca_ray_times_pixel(times, 0, 0, 100, 4, 8, 40);
    ca_ray_times_pixel(other, 0, 0, 1000, 12, 40, 1200);
    ca_ray_times_pixel(other, 1, 0, 100, 1, 1, 0);
    ca_ray_times_pool(times, other);
    ca_ray_times_destroy(other);
    const ca_ray_costs costs = ca_ray_times_costs(times);
    assert_within("a segment", costs.segment, segment_cost, 0.01 * segment_cost);
    assert_within("a candidate", costs.candidate, candidate_cost, 0.01 * candidate_cost);
    assert_within("a light path", costs.light_path, 2e-6, 0.2e-6); /* of fewer of one kind the other would win */
    double camera, merge;
    ca_ray_times_of_pixel(times, &costs, 0, 0, &camera, &merge);
    assert_within("t_B", camera, 48.0 / 16.0 * costs.segment, 1e-15);
    assert_within("t_M", merge, 0.1 * costs.candidate, 1e-15);
    ca_ray_times_of_pixel(times, &costs, 1, 0, &camera, &merge);
    assert_within("t_B", camera, costs.segment, 1e-15);
    ca_ray_times_destroy(times);
}

static void test_memory(void **state)
{
    (void)state;
    ca_status status = CA_ERROR_MEMORY;
    long failures = 0;
    for (; status == CA_ERROR_MEMORY; failures++) {
        ca_ray_times *times = NULL;
        ca_memory_fail_after(failures);
        status = ca_ray_times_create(&times, 4, 4, 2, NULL);
        ca_memory_fail_after(-1);
        assert_true((status == CA_OK) == (times != NULL));
        ca_ray_times_destroy(times);
    }
    assert_int_equal(status, CA_OK);
    assert_int_equal(failures, 6);
}

/* ---- Passes ---------------------------------------------------------------------------------------------------- */

/* Tiles by the floor see photons, tiles above it nothing. */
static const char *const floor_text =
    "<scene version=\"3.0.0\">\n"
    "  <integrator type=\"bdpm\"><integer name=\"max_depth\" value=\"4\"/><float name=\"radius\" value=\"0.3\"/>\n"
    "    <integer name=\"light_paths\" value=\"8000\"/><integer name=\"camera_paths\" value=\"2\"/></integrator>\n"
    "  <sensor type=\"perspective\"><float name=\"fov\" value=\"60\"/>\n"
    "    <transform name=\"to_world\"><lookat origin=\"0,1,4\" target=\"0,1,0\" up=\"0,1,0\"/></transform>\n"
    "    <film type=\"hdrfilm\"><integer name=\"width\" value=\"64\"/><integer name=\"height\" value=\"64\"/>"
    "<rfilter type=\"box\"/></film>\n"
    "  </sensor>\n"
    "  <shape type=\"rectangle\"><transform name=\"to_world\"><rotate x=\"1\" angle=\"-90\"/><scale "
    "value=\"2\"/></transform>"
    "</shape>\n"
    "  <emitter type=\"point\"><point name=\"position\" value=\"0,2,0\"/><rgb name=\"intensity\" "
    "value=\"9\"/></emitter>\n"
    "</scene>\n";
enum { SIDE = 64, PASSES = 3, LIGHT_PATHS = 8000 };

typedef struct timed_render {
    ca_scene *scene;
    ca_render_settings settings;
    ca_render_plan plan;
    ca_film film;
    void *integrator;
    ca_pass_runner runner;
} timed_render;

static void set_up_render(timed_render *r, uint32_t threads)
{
    ca_error error = {""};
    r->scene = scene_from_text(floor_text);
    ca_render_settings_init(&r->settings);
    r->settings.threads = threads;
    r->settings.samples_per_pixel = 2 * PASSES;
    assert_int_equal(ca_render_plan_make(&r->plan, r->scene, &r->settings, &error), CA_OK);
    assert_int_equal(ca_film_create(&r->film, SIDE, SIDE, r->plan.crop, &error), CA_OK);
    assert_int_equal(r->plan.type->create(&r->plan.input, &r->integrator, &error), CA_OK);
    assert_int_equal(ca_pass_runner_create(&r->runner, &r->plan, r->integrator, &r->film, NULL, &error), CA_OK);
}

static void tear_down_render(timed_render *r)
{
    ca_pass_runner_destroy(&r->runner);
    r->plan.type->destroy(r->integrator);
    ca_film_destroy(&r->film);
    ca_scene_release(r->scene);
}

static ca_image_layers *render_passes(timed_render *r)
{
    ca_error error = {""};
    ca_image_layers *image = NULL;
    for (uint32_t pass = 0; pass < PASSES; pass++) assert_int_equal(ca_pass_run(&r->runner, pass, &error), CA_OK);
    assert_int_equal(ca_film_develop(&r->film, 2, &image, &error), CA_OK);
    return image;
}

/* One thread. The sums of what was measured are what the workers counted, and the fit explains the time that it
 * took. */
static void assert_costs(const timed_render *r, const ca_ray_times *times, double processor_seconds)
{
    ca_render_statistics counted = {0};
    ca_workers_count(&r->runner.workers, &counted);
    const ca_ray_costs costs = ca_ray_times_costs(times);
    const double camera_paths = (double)SIDE * SIDE * 2 * PASSES;
    assert_within("candidates", costs.candidates_per_pair * camera_paths * LIGHT_PATHS, (double)counted.merges,
                  1e-6 * (double)counted.merges);
    assert_true(costs.segments_per_camera_path > 1.0 && costs.segments_per_camera_path < 3.0);
    assert_true(costs.light_path > 0.0 && costs.camera_path > 0.0 && costs.candidate > 0.0);
    const double camera_path = costs.camera_path + LIGHT_PATHS * costs.merge;
    const double explained = (double)PASSES * LIGHT_PATHS * costs.light_path + camera_paths * camera_path;
    if (!(explained > 0.6 * processor_seconds && explained < 1.1 * processor_seconds))
        fail_msg("%.4g s of %.4g s are explained", explained, processor_seconds);
    double top_camera, top_merge, camera, merge;
    ca_ray_times_of_pixel(times, &costs, 32, 2, &top_camera, &top_merge);
    ca_ray_times_of_pixel(times, &costs, 32, 48, &camera, &merge);
    assert_true(top_merge == 0.0 && merge > 0.0 && camera > top_camera && top_camera > 0.0);
}

static void test_passes(void **state)
{
    (void)state;
    ca_image_layers *images[2];
    for (uint32_t i = 0; i < 2; i++) {
        timed_render r;
        set_up_render(&r, i == 1 ? 1 : 3);
        ca_ray_times *times = new_times(SIDE, SIDE, r.plan.threads);
        if (i == 1) r.runner.times = times;
        const double start = ca_clock_thread_seconds();
        images[i] = render_passes(&r);
        if (i == 1) assert_costs(&r, times, ca_clock_thread_seconds() - start);
        ca_ray_times_destroy(times);
        tear_down_render(&r);
    }
    assert_int_equal(images[0]->channel_count, images[1]->channel_count);
    for (size_t c = 0; c < images[0]->channel_count; c++)
        assert_memory_equal(images[0]->channels[c].data, images[1]->channels[c].data, SIDE * SIDE * sizeof(float));
    ca_image_release(images[0]);
    ca_image_release(images[1]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_known_costs),
        cmocka_unit_test(test_outliers),
        cmocka_unit_test(test_one_kind_of_work),
        cmocka_unit_test(test_tiles_alike),
        cmocka_unit_test(test_nothing_measured),
        cmocka_unit_test(test_light_paths),
        cmocka_unit_test(test_tiles),
        cmocka_unit_test(test_pixels),
        cmocka_unit_test(test_thinned),
        cmocka_unit_test(test_pooled),
        cmocka_unit_test(test_memory),
        cmocka_unit_test(test_passes),
    };
    return cmocka_run_group_tests_name("times of paths", tests, NULL, NULL);
}
