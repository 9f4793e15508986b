/* Passes around an integrator made for the purpose, whose every answer is known: rounds, several camera paths per
 * pixel, splats, what is counted, what happens when it fails. */
#include "base/memory.h"
#include "render/pass.h"
#include "support/scene_text.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { WIDTH = 37, HEIGHT = 21, CROP_X = 3, CROP_Y = 2, FULL_WIDTH = 48, FULL_HEIGHT = 32, PASSES = 3 };

static const char *const scene_text =
    "<scene version='3.0.0'><sensor type='perspective'><film type='hdrfilm'><integer name='width' value='48'/>"
    "<integer name='height' value='32'/><rfilter type='box'/></film></sensor>"
    "<emitter type='constant'><rgb name='radiance' value='1'/></emitter></scene>";

/* What the integrator is to do, and what was asked of it. */
typedef struct script {
    uint32_t rounds, camera_paths;
    uint32_t fail_in_pass;   /* > 0: begin_round fails there, in the second round */
    long fail_allocation;    /* which one fails, from 1; 0: none */
    bool bad_samples;        /* every camera path 1 of pixel (5, 4) is not a number, its camera path 0 negative */
    /* seen: */
    uint32_t created;
    double memory_bytes[2];
    uint32_t begun;
    uint32_t pass, round;
    atomic_uint wrong_calls;
} script;
static script play;

static ca_status fake_create(const ca_integrator_input *input, void **state, ca_error *error)
{
    (void)error;
    assert_true(play.created < 2);
    play.memory_bytes[play.created++] = input->memory_bytes;
    assert_int_equal(input->crop[0], CROP_X);
    assert_true(input->workers >= 1);
    *state = &play;
    return CA_OK;
}

static void fake_destroy(void *state) { assert_ptr_equal(state, &play); }

static uint32_t fake_rounds(const void *state) { return ((const script *)state)->rounds; }

static ca_status fake_begin_round(void *state, uint32_t pass, uint32_t round, const ca_parallel *parallel,
                                  ca_worker *workers, ca_error *error)
{
    script *s = state;
    assert_int_equal(pass, s->begun / s->rounds);
    assert_int_equal(round, s->begun % s->rounds);
    s->begun++;
    s->pass = pass;
    s->round = round;
    for (uint32_t i = 0; i < parallel->workers; i++) {
        assert_int_equal(workers[i].index, i);
        assert_int_equal((uintptr_t)&workers[i] % 128, 0);
        workers[i].counters.light_paths += i == 0;
        workers[i].counters.photons += i == 0 ? 2 : 0;
        workers[i].counters.merges += i == 0 ? 5 : 0;
        workers[i].counters.photons_tested += i == 0 ? 7 : 0;
        workers[i].counters.non_finite[CA_TECHNIQUE_SPLAT] += i == 0 ? 3 : 0;
    }
    if (s->fail_in_pass && pass == s->fail_in_pass && round == 1)
        return ca_fail(error, CA_ERROR_MEMORY, NULL, "no room for the light paths");
    return CA_OK;
}

static float radiance_of(uint32_t x, uint32_t y, uint32_t index, uint32_t round)
{
    return (float)(x + 2 * y) + 0.5f * (float)(index * index) + 3.0f * (float)(round + 1);
}

static float filter_weight_of(uint32_t index) { return index % 3 == 2 ? -8.0f : 1.25f; }
static float splat_of(uint32_t x, uint32_t y) { return 0.125f * (float)x - 0.25f * (float)y; }

static void fake_camera_path(const script *s, const ca_camera_path *path, uint32_t round, ca_worker *worker)
{
    const uint32_t x = path->x, y = path->y, index = path->index;
    ca_film_sample *sample = path->sample;
    const bool inside = x >= CROP_X && y >= CROP_Y && x < CROP_X + WIDTH && y < CROP_Y + HEIGHT;
    /* A sample comes back in the next round as it was left, and starts from zero. */
    const float left = round ? 100.0f * (float)index + (float)round : 0.0f;
    if (!inside || index / s->camera_paths != s->pass || round != s->round || sample->normal.x != left)
        atomic_fetch_add(&play.wrong_calls, 1);
    sample->normal.x = 100.0f * (float)index + (float)(round + 1);
    sample->filter_weight = filter_weight_of(index);
    sample->radiance = ca_rgb_add(sample->radiance, ca_rgb_grey(radiance_of(x, y, index, round)));
    sample->albedo = ca_rgb_grey(0.125f * (float)index);
    if (round == 0) worker->counters.camera_paths++;
    if (!s->bad_samples || x != 5 || y != 4) return;
    if (index % s->camera_paths == 0) sample->radiance.g = -1.0f;
    if (index % s->camera_paths == 1) sample->radiance.b = NAN;
}

static void fake_camera_paths(const void *state, ca_camera_path *paths, uint32_t count, uint32_t round,
                              ca_worker *worker)
{
    for (uint32_t i = 0; i < count; i++) fake_camera_path(state, &paths[i], round, worker);
}

static ca_rgb fake_splat(const void *state, uint32_t x, uint32_t y)
{
    (void)state;
    return ca_rgb_grey(splat_of(x, y));
}

static const ca_parameter_spec no_parameters[] = {{.name = NULL}};
static const ca_integrator_type fake = {.name = "fake",
                                        .parameters = no_parameters,
                                        .create = fake_create,
                                        .destroy = fake_destroy,
                                        .rounds = fake_rounds,
                                        .begin_round = fake_begin_round,
                                        .camera_paths = fake_camera_paths,
                                        .splat = fake_splat};

/* Plans for `path`, then swaps the integrator. */
static ca_status run(ca_render_settings *settings, ca_image_layers **image, ca_render_statistics *statistics,
                     ca_error *error)
{
    ca_scene *scene = scene_from_text(scene_text);
    ca_render_plan plan;
    settings->samples_per_pixel = PASSES;
    settings->has_crop = true;
    const uint32_t crop[4] = {CROP_X, CROP_Y, CROP_X + WIDTH, CROP_Y + HEIGHT};
    memcpy(settings->crop, crop, sizeof crop);
    assert_int_equal(ca_render_plan_make(&plan, scene, settings, error), CA_OK);
    plan.type = &fake;
    plan.camera_paths = play.camera_paths;
    plan.samples_per_pass = play.camera_paths;
    *image = NULL;
    ca_memory_fail_after(play.fail_allocation - 1);
    const ca_status status = ca_render_plan_run(&plan, image, statistics, error);
    ca_memory_fail_after(-1);
    assert_int_equal(atomic_load(&play.wrong_calls), 0);
    ca_scene_release(scene);
    return status;
}

static void expect_close(double value, double expected, const char *what, uint32_t x, uint32_t y)
{
    if (!(fabs(value - expected) <= 1e-5 * fabs(expected) + 1e-4))
        fail_msg("%s of pixel (%u, %u): %.9g instead of %.9g", what, x, y, value, expected);
}

/* The image, term by term. */
static void expect_image(const ca_image_layers *image)
{
    for (uint32_t y = CROP_Y; y < CROP_Y + HEIGHT; y++)
        for (uint32_t x = CROP_X; x < CROP_X + WIDTH; x++) {
            double sum = 0.0, squares = 0.0, indices = 0.0;
            for (uint32_t pass = 0; pass < PASSES; pass++) {
                double value = (double)splat_of(x, y);
                for (uint32_t b = 0; b < play.camera_paths; b++) {
                    const uint32_t index = pass * play.camera_paths + b;
                    for (uint32_t round = 0; round < play.rounds; round++)
                        value +=
                            (double)(filter_weight_of(index) * radiance_of(x, y, index, round)) / play.camera_paths;
                    indices += 0.125 * index / play.camera_paths;
                }
                sum += value;
                squares += value * value;
            }
            const size_t i = (size_t)(y - CROP_Y) * WIDTH + (x - CROP_X);
            expect_close((double)ca_image_channel(image, "G")[i], sum / PASSES, "radiance", x, y);
            expect_close((double)ca_image_channel(image, "Albedo.R")[i], indices / PASSES, "albedo", x, y);
            expect_close((double)ca_image_channel(image, "Samples.Y")[i], PASSES, "samples", x, y);
            expect_close((double)ca_image_channel(image, "Variance.G")[i],
                         (squares - sum * sum / PASSES) / (PASSES - 1), "variance", x, y);
        }
}

static void test_passes_add_up(void **state)
{
    (void)state;
    static const uint32_t numbers[][3] = {{1, 1, 1}, {1, 1, 3}, {1, 3, 2}, {3, 1, 2}, {3, 4, 1}, {3, 4, 3}};
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; i++) {
        play = (script){.rounds = numbers[i][0], .camera_paths = numbers[i][1]};
        ca_render_settings settings;
        ca_render_settings_init(&settings);
        settings.threads = numbers[i][2];
        ca_image_layers *image;
        ca_render_statistics statistics = {.size = sizeof statistics};
        assert_int_equal(run(&settings, &image, &statistics, NULL), CA_OK);
        expect_image(image);
        ca_image_release(image);
        assert_int_equal(play.created, 1);
        assert_int_equal(play.begun, PASSES * play.rounds);
        assert_int_equal(statistics.iterations, PASSES);
        assert_true(statistics.samples_per_pixel == PASSES * play.camera_paths);
        assert_int_equal(statistics.camera_paths, PASSES * play.camera_paths * WIDTH * HEIGHT);
        assert_int_equal(statistics.light_paths, play.begun);
        assert_int_equal(statistics.photons, 2 * play.begun);
        assert_int_equal(statistics.merges, 5 * play.begun);
        assert_int_equal(statistics.photons_tested, 7 * play.begun);
        assert_int_equal(statistics.non_finite, 3 * play.begun);
        assert_int_equal(statistics.non_finite_from[CA_TECHNIQUE_SPLAT], 3 * play.begun);
    }
}

/* What the integrator lets through is dropped by itself, camera path by camera path, and counted. */
static void test_bad_samples_are_counted(void **state)
{
    (void)state;
    play = (script){.rounds = 1, .camera_paths = 3, .bad_samples = true};
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    ca_image_layers *image;
    ca_render_statistics statistics = {.size = sizeof statistics};
    assert_int_equal(run(&settings, &image, &statistics, NULL), CA_OK);
    assert_int_equal(statistics.non_finite_from[CA_TECHNIQUE_COUNT], 2 * PASSES);
    assert_int_equal(statistics.non_finite, 2 * PASSES + 3 * PASSES);
    double expected = (double)splat_of(5, 4);
    for (uint32_t pass = 0; pass < PASSES; pass++) {
        const uint32_t index = 3 * pass + 2;
        expected += (double)(filter_weight_of(index) * radiance_of(5, 4, index, 0)) / 3.0 / PASSES;
    }
    expect_close((double)ca_image_channel(image, "R")[(4 - CROP_Y) * WIDTH + 5 - CROP_X], expected, "radiance", 5, 4);
    ca_image_release(image);
}

/* The image is that of the passes before, and nothing of the rounds of this one. */
static void test_a_failing_round_ends_the_render(void **state)
{
    (void)state;
    play = (script){.rounds = 2, .camera_paths = 1, .fail_in_pass = 1};
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    ca_image_layers *image;
    ca_render_statistics statistics = {.size = sizeof statistics};
    ca_error error = {""};
    assert_int_equal(run(&settings, &image, &statistics, &error), CA_ERROR_MEMORY);
    assert_string_equal(error.message, "no room for the light paths");
    assert_non_null(image);
    assert_int_equal(play.begun, 4);
    assert_true(statistics.iterations == 1 && !statistics.interrupted);
    for (size_t i = 0; i < WIDTH * HEIGHT; i++) assert_true(ca_image_channel(image, "Samples.Y")[i] == 1.0f);
    ca_image_release(image);
}

static bool stop_at_once(const ca_render_progress *progress, void *user)
{
    (void)user;
    return progress->passes_done < 1;
}

/* A request to stop is heard between passes, not between rounds: the image is whole. */
static void test_a_stopped_pass_is_finished(void **state)
{
    (void)state;
    play = (script){.rounds = 3, .camera_paths = 2};
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.progress = stop_at_once;
    ca_image_layers *image;
    ca_render_statistics statistics = {.size = sizeof statistics};
    assert_int_equal(run(&settings, &image, &statistics, NULL), CA_OK);
    assert_true(statistics.interrupted);
    assert_int_equal(play.begun, 3);
    for (size_t i = 0; i < WIDTH * HEIGHT; i++) assert_true(ca_image_channel(image, "Samples.Y")[i] == 1.0f);
    ca_image_release(image);
}

/* Of the memory allowed the film has its part, and with several rounds the samples of a pass have theirs. */
static void test_memory_for_light_paths(void **state)
{
    (void)state;
    const double film = WIDTH * HEIGHT * (ca_film_pixel_bytes(1) + CA_PASS_PART_BYTES);
    const double buffer = WIDTH * HEIGHT * 2.0 * (double)sizeof(ca_film_sample);
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.memory_mib = 1.0;
    ca_image_layers *image;
    play = (script){.rounds = 1, .camera_paths = 2};
    assert_int_equal(run(&settings, &image, NULL, NULL), CA_OK);
    ca_image_release(image);
    assert_int_equal(play.created, 1);
    assert_true(play.memory_bytes[0] == 0x1p20 - film);
    play = (script){.rounds = 2, .camera_paths = 2};
    assert_int_equal(run(&settings, &image, NULL, NULL), CA_OK);
    ca_image_release(image);
    assert_int_equal(play.created, 2);
    assert_true(play.memory_bytes[1] == 0x1p20 - film - buffer);
    settings.memory_mib = (film + buffer) / 0x1p20 - 0.001;
    play = (script){.rounds = 2, .camera_paths = 2};
    ca_error error = {""};
    assert_int_equal(run(&settings, &image, NULL, &error), CA_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, "the film and the samples of a pass need 0.3 MiB, more than the 0.3 MiB"));
    settings.memory_mib = 0.0;
    play = (script){.rounds = 2, .camera_paths = 2};
    assert_int_equal(run(&settings, &image, NULL, NULL), CA_OK);
    ca_image_release(image);
    assert_true(play.created == 1 && play.memory_bytes[0] == 0.0);
}

/* Wherever memory ends, the render ends with that error and nothing else. */
static void test_out_of_memory(void **state)
{
    (void)state;
    long failures = 0;
    for (;;) {
        play = (script){.rounds = 2, .camera_paths = 2, .fail_allocation = failures + 1};
        ca_render_settings settings;
        ca_render_settings_init(&settings);
        settings.memory_mib = 1.0;
        ca_image_layers *image;
        ca_error error = {""};
        const ca_status status = run(&settings, &image, NULL, &error);
        if (status == CA_OK) {
            ca_image_release(image);
            break;
        }
        assert_int_equal(status, CA_ERROR_MEMORY);
        assert_null(image);
        failures++;
    }
    assert_true(failures >= 4); /* film, samples, workers, layers */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_passes_add_up),
        cmocka_unit_test(test_bad_samples_are_counted),
        cmocka_unit_test(test_a_failing_round_ends_the_render),
        cmocka_unit_test(test_a_stopped_pass_is_finished),
        cmocka_unit_test(test_memory_for_light_paths),
        cmocka_unit_test(test_out_of_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
