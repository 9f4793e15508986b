/* Renders by blocks around an integrator made for the purpose: what pixels get, which blocks are rendered, when it
 * stops, what is counted and what is refused. */
#include "base/memory.h"
#include "support/block_fixture.h"
#include "support/scene_text.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

/* ---- One render ------------------------------------------------------------------------------------------------ */

static void expect_close(double value, double expected, const char *what, uint32_t x, uint32_t y)
{
    if (!(fabs(value - expected) <= 1e-6 * fabs(expected)))
        fail_msg("%s of pixel (%u, %u): %.9g instead of %.9g", what, x, y, value, expected);
}

static void expect_values(const ca_image_layers *image, uint64_t begin, uint64_t end)
{
    for (uint32_t y = CA_BLOCK_CROP_Y; y < CA_BLOCK_CROP_Y + CA_BLOCK_HEIGHT; y++)
        for (uint32_t x = CA_BLOCK_CROP_X; x < CA_BLOCK_CROP_X + CA_BLOCK_WIDTH; x++) {
            double sum = 0.0, gradient = 0.0, pairs = 0.0, paths = 0.0;
            for (uint64_t block = begin; block < end; block++) {
                sum += (double)ca_block_radiance(x, y, block);
                gradient += (double)ca_block_radiance(x + 1, y, block);
                pairs += (double)ca_block_pairs(x, block);
                paths += 1.0 + (double)(block % 2);
            }
            const size_t i = (size_t)(y - CA_BLOCK_CROP_Y) * CA_BLOCK_WIDTH + (x - CA_BLOCK_CROP_X);
            expect_close((double)ca_image_channel(image, "R")[i], sum / pairs, "R", x, y);
            expect_close((double)ca_image_channel(image, "B")[i], 0.5 * (double)(end - begin) / pairs, "B", x, y);
            expect_close((double)ca_image_channel(image, "IrradianceGradient.X")[i], gradient / pairs, "gradient", x,
                         y);
            expect_close((double)ca_image_channel(image, "Pairs.Y")[i], pairs, "pairs", x, y);
            expect_close((double)ca_image_channel(image, "Samples.Y")[i], paths, "samples", x, y);
            expect_close((double)ca_image_channel(image, "Albedo.G")[i], 0.25, "albedo", x, y);
            expect_close((double)ca_image_channel(image, "P.X")[i],
                         (double)(float)x / 10.0 * (double)(end - begin) / paths, "position", x, y);
        }
}

static void test_blocks_add_up_on_any_number_of_threads(void **state)
{
    (void)state;
    uint64_t hash = 0;
    static const uint32_t threads[] = {1, 2, 3, 8};
    for (int i = 0; i < 4; i++) {
        ca_block_play = (ca_block_script){.first = 0};
        ca_render_statistics s = {.size = sizeof s};
        ca_image_layers *image =
            ca_block_rendered(&(ca_block_job){.samples = 3, .threads = threads[i], .gradients = true}, &s);
        assert_int_equal(ca_block_play.begun, 9);
        expect_values(image, 0, 9);
        if (i == 0) hash = image_hash(image);
        assert_true(image_hash(image) == hash);
        assert_true(s.iterations == 9 && s.samples_per_pixel == 3.0 && s.blocks[0] == 0 && s.blocks[1] == 9);
        assert_int_equal(s.light_paths, 45);
        assert_int_equal(s.camera_paths, CA_BLOCK_PIXELS * 13);
        assert_true(s.photons == 18 && s.photons_tested == 27 && s.merges == 45 && s.rays == 63 &&
                    s.shadow_rays == 99);
        assert_true(s.non_finite == 9 * 13 && s.non_finite_from[CA_TECHNIQUE_MERGE] == 9 * 13);
        /* What cannot be known is not claimed. */
        assert_true(isnan(s.mean_standard_deviation) && s.noise_percent < 0.0);
        assert_false(s.interrupted);
        assert_string_equal(ca_block_attribute(image, "caustica.blocks")->text, "0:9");
        assert_string_equal(ca_block_attribute(image, "caustica.integrator")->text, "fake");
        assert_true(ca_block_attribute(image, "caustica.samplesPerPixel")->number == 3.0);
        ca_image_release(image);
    }
}

static void test_range_of_blocks(void **state)
{
    (void)state;
    ca_block_play = (ca_block_script){.first = 0};
    ca_render_statistics s = {.size = sizeof s};
    ca_image_layers *image =
        ca_block_rendered(&(ca_block_job){.blocks = {5, 8}, .threads = 2, .gradients = true}, &s);
    assert_int_equal(ca_block_play.begun, 3);
    expect_values(image, 5, 8);
    /* Blocks up to the eighth are enough for two by two. */
    assert_true(s.iterations == 3 && s.samples_per_pixel == 2.0 && s.blocks[0] == 5 && s.blocks[1] == 8);
    assert_string_equal(ca_block_attribute(image, "caustica.blocks")->text, "5:8");
    ca_image_release(image);
}

static void test_bad_samples_are_counted(void **state)
{
    (void)state;
    ca_block_play = (ca_block_script){.bad_samples = true};
    ca_render_statistics s = {.size = sizeof s};
    ca_image_layers *image = ca_block_rendered(&(ca_block_job){.samples = 2, .threads = 2}, &s);
    assert_true(s.non_finite_from[CA_TECHNIQUE_COUNT] == 2 && s.non_finite == 2 + 4 * 13);
    const size_t i = (4 - CA_BLOCK_CROP_Y) * CA_BLOCK_WIDTH + 5 - CA_BLOCK_CROP_X;
    const double expected =
        ((double)ca_block_radiance(5, 4, 0) + (double)ca_block_radiance(5, 4, 2)) /
        (double)(ca_block_pairs(5, 0) + ca_block_pairs(5, 1) + ca_block_pairs(5, 2) + ca_block_pairs(5, 3));
    expect_close((double)ca_image_channel(image, "R")[i], expected, "R", 5, 4);
    ca_image_release(image);
}

/* ---- Stopping -------------------------------------------------------------------------------------------------- */

static void test_stopping(void **state)
{
    (void)state;
    ca_render_statistics s = {.size = sizeof s};
    ca_block_watcher w = {0};
    ca_block_job j = {.samples = 4, .threads = 1, .progress = ca_block_watch, .progress_user = &w};
    ca_block_play = (ca_block_script){.first = 0};
    ca_image_release(ca_block_rendered(&j, &s));
    assert_true(s.iterations == 16 && w.calls == 16 && w.last_total == 16);

    /* How many are needed turns out on the way, or they come to an end before. */
    ca_block_play = (ca_block_script){.known_from = 7};
    w = (ca_block_watcher){0};
    ca_image_release(ca_block_rendered(&j, &s));
    assert_true(s.iterations == 16 && w.last_total == 16 && s.samples_per_pixel == 4.0);
    ca_block_play = (ca_block_script){.known_from = 20};
    w = (ca_block_watcher){0};
    ca_image_release(ca_block_rendered(&j, &s));
    assert_true(s.iterations == 20 && s.samples_per_pixel == 4.0);
    ca_block_play = (ca_block_script){.all = 10};
    w = (ca_block_watcher){0};
    ca_image_release(ca_block_rendered(&j, &s));
    assert_true(s.iterations == 10 && w.last_total == 10 && s.samples_per_pixel == 4.0);

    /* The caller ends it: the block is finished. */
    ca_block_play = (ca_block_script){.first = 0};
    w = (ca_block_watcher){.stop_after = 5};
    ca_image_release(ca_block_rendered(&j, &s));
    assert_true(s.iterations == 5 && s.interrupted && s.samples_per_pixel == 2.0);

    /* Time is over after the first block; or there is plenty, and the blocks end. */
    ca_block_play = (ca_block_script){.first = 0};
    w = (ca_block_watcher){0};
    j.seconds = 1e-9;
    j.samples = 0;
    ca_image_release(ca_block_rendered(&j, &s));
    assert_true(s.iterations == 1 && !s.interrupted && w.last_total == 0);
    ca_block_play = (ca_block_script){.all = 6};
    w = (ca_block_watcher){0};
    j.seconds = 3600.0;
    ca_image_release(ca_block_rendered(&j, &s));
    assert_true(s.iterations == 6 && s.samples_per_pixel == 3.0);
}

/* The blocks before are the image, and the part: with the one that failed and the rest it is the whole. */
static void test_a_failing_block_ends_the_render(void **state)
{
    (void)state;
    ca_block_play = (ca_block_script){.fail_at = 4};
    ca_image_layers *image, *merged;
    ca_render_statistics s = {.size = sizeof s};
    ca_error error = {""};
    const char *path = ca_block_file("begun.part");
    assert_int_equal(ca_block_run(&(ca_block_job){.samples = 3, .threads = 2, .part = path}, &image, &s, &error),
                     CA_ERROR_MEMORY);
    assert_string_equal(error.message, "no room for the block");
    assert_non_null(image);
    assert_true(s.blocks[0] == 0 && s.blocks[1] == s.iterations && s.iterations >= 1 && !s.interrupted);
    assert_int_equal(ca_merge_parts(&path, 1, NULL, &merged, NULL, NULL), CA_OK);
    assert_true(image_hash(image) == image_hash(merged));
    ca_image_release(image);
    ca_image_release(merged);
}

/* ---- What is refused before rendering -------------------------------------------------------------------------- */

typedef struct refusal {
    ca_render_settings settings;
    const char *says;
} refusal;

static const char *const any_scene =
    "<scene version='3.0.0'><sensor type='perspective'><film type='hdrfilm'><integer name='width' value='48'/>"
    "<integer name='height' value='32'/></film></sensor><emitter type='constant'/></scene>";

static void test_settings_that_are_refused(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(any_scene);
    const refusal refusals[] = {
        {{.integrator = "path", .has_blocks = true, .blocks = {0, 1}}, "\"path\" does not render by blocks"},
        {{.integrator = "qmcppm", .has_passes = true, .passes = {0, 4}}, "a range of blocks, not of passes"},
        {{.integrator = "qmcppm", .noise_percent = 1.0}, "does not know its noise"},
        {{.integrator = "qmcppm", .strategies_directory = "x", .has_max_depth = true, .max_depth = 5},
         "no images of the strategies"},
        {{.integrator = "qmcppm", .has_blocks = true, .blocks = {0, 4}, .samples_per_pixel = 4}, "not both"},
        {{.integrator = "qmcppm", .has_blocks = true, .blocks = {4, 4}}, "4:4 is no range"},
        {{.integrator = "qmcppm", .has_blocks = true, .blocks = {0, UINT64_MAX}}, "is no range"},
        {{.integrator = "qmcppm", .memory_mib = 0.1}, "the film alone needs 0.5 MiB"},
    };
    for (size_t i = 0; i < sizeof refusals / sizeof refusals[0]; i++) {
        ca_image_layers *image;
        ca_error error = {""};
        assert_int_equal(ca_render(scene, &refusals[i].settings, &image, NULL, &error), CA_ERROR_ARGUMENT);
        if (!strstr(error.message, refusals[i].says))
            fail_msg("\"%s\" says nothing of \"%s\"", error.message, refusals[i].says);
    }
    ca_scene_release(scene);
}

/* ---- Memory ---------------------------------------------------------------------------------------------------- */

/* Wherever memory ends, the render ends with that error and nothing else. */
static void test_out_of_memory(void **state)
{
    (void)state;
    char path[CA_BLOCK_PATH_SIZE];
    snprintf(path, sizeof path, "%s", ca_block_file("memory.part"));
    long failures = 0;
    for (ca_status status = CA_ERROR_MEMORY; status != CA_OK; failures++) {
        ca_image_layers *image;
        ca_block_play = (ca_block_script){.first = 0};
        status = ca_block_run(
            &(ca_block_job){
                .samples = 1, .threads = 2, .gradients = true, .part = path, .fail_allocation = failures + 1},
            &image, NULL, NULL);
        assert_true(status == CA_OK || (status == CA_ERROR_MEMORY && !image));
        ca_image_release(image);
    }
    assert_true(failures >= 12);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_blocks_add_up_on_any_number_of_threads),
        cmocka_unit_test(test_range_of_blocks),
        cmocka_unit_test(test_bad_samples_are_counted),
        cmocka_unit_test(test_stopping),
        cmocka_unit_test(test_a_failing_block_ends_the_render),
        cmocka_unit_test(test_settings_that_are_refused),
        cmocka_unit_test(test_out_of_memory),
    };
    return cmocka_run_group_tests(tests, ca_block_make_folder, ca_block_remove_folder);
}
