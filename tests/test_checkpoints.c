/* Renders that go on from checkpoints, of every integrator: the bits of one render; every setting that may not change
 * refused by name. */
#define _POSIX_C_SOURCE 200809L
#include "base/clock.h"
#include "integrator/integrator.h"
#include "render/checkpoint.h"
#include "support/kept_render.h"
#include "support/scene_text.h"

#include <math.h>
#include <string.h>
#include <unistd.h>

/* ---- Going on -------------------------------------------------------------------------------------------------- */

/* Three runs of one line, each to more samples, with other threads: the bits of one run. */
static void test_every_integrator_goes_on(void **state)
{
    (void)state;
    for (size_t i = 0; integrator_at(i); i++) {
        if (chooses(i)) continue;
        ca_render_statistics one = {.size = sizeof one}, statistics = {.size = sizeof statistics};
        const ca_render_settings all = settings_of(integrator_at(i), 4, 1);
        const uint64_t hash = render(&all, &one);
        unlink(file("c.part"));
        static const uint32_t samples[] = {1, 4, 4}, threads[] = {2, 1, 3};
        uint64_t last = 0;
        for (int run = 0; run < 3; run++) {
            const ca_render_settings s = kept(integrator_at(i), samples[run], threads[run]);
            const uint64_t before = run > 0 ? statistics.iterations : 0;
            last = render(&s, &statistics);
            assert_true(statistics.passes_resumed == before);
            assert_false(is_there("c.part.lock"));
        }
        if (last != hash) fail_msg("%s: another image", integrator_at(i));
        if (!ca_integrator_at(i)->begin_block) expect_same_totals(&one, &statistics);
    }
}

/* Blocks as large as the memory say only by their paths how many they are. A finished render has nothing to do, and
 * one of fewer samples is refused. */
static void test_filled_blocks_go_on(void **state)
{
    (void)state;
    ca_render_settings all = settings_of("qmcppm:blocks=filled,radius=0.1", 400, 2), fewer = all;
    ca_render_statistics first = {.size = sizeof first}, second = {.size = sizeof second};
    all.memory_mib = 1.0;
    const uint64_t hash = render(&all, &first);
    unlink(file("c.part"));
    all.checkpoint_path = file("c.part");
    all.resume = true;
    all.samples_per_pixel = 100;
    render(&all, &second);
    assert_true(second.blocks[1] > 0 && second.blocks[1] < first.blocks[1]);
    all.samples_per_pixel = 400;
    for (int run = 0; run < 2; run++) {
        assert_true(render(&all, &second) == hash);
        assert_true(second.blocks[1] == first.blocks[1] && second.light_paths >= first.light_paths);
    }
    fewer = all;
    fewer.samples_per_pixel = 1;
    ca_image_layers *image;
    ca_error error = {""};
    assert_int_equal(ca_render(scene, &fewer, &image, NULL, &error), CA_ERROR_ARGUMENT);
    if (!strstr(error.message, "more than this render makes")) fail_msg("%s", error.message);
    fewer = all;
    fewer.memory_mib = 2.0;
    assert_int_equal(ca_render(scene, &fewer, &image, NULL, &error), CA_ERROR_ARGUMENT);
    if (!strstr(error.message, "the memory stays where blocks are")) fail_msg("%s", error.message);
}

/* The method is that of a picture, which has no numbers of rays: there is nothing else to read from it. */
static void test_auto_as_a_picture_goes_on(void **state)
{
    (void)state;
    ca_image_layers *image;
    ca_render_settings path = settings_of("path", 2, 1), s = kept("auto", 2, 1);
    assert_int_equal(ca_render(scene, &path, &image, NULL, NULL), CA_OK);
    assert_int_equal(ca_image_save(image, file("p.exr"), 0.0f, NULL), CA_OK);
    ca_image_release(image);
    unlink(file("c.part"));
    s.rays = file("p.exr");
    render(&s, NULL);
    ca_render_statistics statistics = {.size = sizeof statistics};
    path.samples_per_pixel = s.samples_per_pixel = 5;
    assert_true(render(&s, &statistics) == render(&path, NULL) && statistics.passes_resumed == 2);
}

/* In the middle of replicates of three passes. */
static void test_replicates_go_on(void **state)
{
    (void)state;
    static const char *const samplers[] = {"independent", "sobol"};
    for (int s = 0; s < 2; s++) {
        ca_render_settings all = settings_of("vavcm", 12, 1);
        all.sampler = samplers[s];
        all.replicates = 4;
        const uint64_t hash = render(&all, NULL);
        unlink(file("c.part"));
        ca_render_settings first = all;
        first.checkpoint_path = file("c.part");
        first.has_passes = true;
        first.passes[1] = 9;
        render(&first, NULL);
        ca_render_settings rest = all;
        rest.checkpoint_path = first.checkpoint_path;
        rest.resume = true;
        ca_render_statistics statistics = {.size = sizeof statistics};
        assert_true(render(&rest, &statistics) == hash && statistics.passes_resumed == 9);
    }
}

/* Interrupted at any pass, inside of replicates, too; then on to the end. */
static void test_interrupted_anywhere(void **state)
{
    (void)state;
    ca_render_settings all = settings_of("vcm", 12, 1);
    all.replicates = 3;
    const uint64_t hash = render(&all, NULL);
    for (uint32_t at = 1; at < 12; at += 2) {
        ending e = {at};
        unlink(file("c.part"));
        ca_render_settings s = all;
        s.checkpoint_path = file("c.part");
        s.resume = true;
        s.progress = end_at;
        s.progress_user = &e;
        ca_render_statistics statistics = {.size = sizeof statistics};
        render(&s, &statistics);
        assert_true(statistics.interrupted && statistics.iterations == at);
        s.progress = NULL;
        assert_true(render(&s, &statistics) == hash && statistics.passes_resumed == at);
    }
}

/* A noise target: where it ends is told, and its bits are those of so many passes; less noise goes on. */
static void test_noise_targets(void **state)
{
    (void)state;
    unlink(file("c.part"));
    ca_render_settings s = kept("path", 0, 2);
    s.noise_percent = 30.0;
    ca_render_statistics statistics = {.size = sizeof statistics};
    const uint64_t first = render(&s, &statistics);
    const uint32_t passes = (uint32_t)statistics.passes[1];
    ca_render_settings all = settings_of("path", passes, 1);
    assert_true(statistics.noise_percent < 30.0 && render(&all, NULL) == first);
    ending e = {3};
    unlink(file("c.part"));
    s.progress = end_at;
    s.progress_user = &e;
    render(&s, &statistics);
    s.progress = NULL;
    assert_true(render(&s, &statistics) == first && statistics.passes_resumed == 3);
    s.noise_percent = 15.0;
    const uint64_t second = render(&s, &statistics);
    assert_true(statistics.noise_percent < 15.0 && statistics.passes_resumed == passes);
    all.samples_per_pixel = (uint32_t)statistics.passes[1];
    assert_true(all.samples_per_pixel > passes && render(&all, NULL) == second);
    const uint64_t before = statistics.iterations;
    assert_true(render(&s, &statistics) == second && statistics.iterations == before); /* there is nothing to do */
}

/* Time that was taken counts. */
static void test_time(void **state)
{
    (void)state;
    unlink(file("c.part"));
    ca_render_settings s = kept("path", 0, 1);
    s.seconds = 0.02;
    ca_render_statistics first = {.size = sizeof first}, second = {.size = sizeof second};
    render(&s, &first);
    const uint64_t hash = render(&s, &second);
    assert_true(second.iterations == first.iterations && second.seconds >= first.seconds);
    ca_render_settings all = settings_of("path", (uint32_t)first.iterations, 2);
    assert_true(render(&all, NULL) == hash);
}

/* The method that `auto` chose is in the file, and is not chosen again. */
static void test_auto_goes_on(void **state)
{
    (void)state;
    unlink(file("c.part"));
    ca_render_settings s = kept("auto", 2, 2);
    ca_render_statistics first = {.size = sizeof first}, second = {.size = sizeof second};
    render(&s, &first);
    assert_true(first.method.reason[0] && first.method.trial_count > 0);
    s.samples_per_pixel = 5;
    const uint64_t hash = render(&s, &second);
    assert_string_equal(second.method.reason, first.method.reason);
    assert_true(second.method.trial_count == 0 && second.passes_resumed == 2);
    /* The same from the start, by what the file tells. */
    ca_image_layers *image;
    const char *path = file("c.part");
    assert_int_equal(ca_merge_parts(&path, 1, NULL, &image, NULL, NULL), CA_OK);
    const ca_render_settings all = {.integrator = attribute_text(image, "caustica.integrator"),
                                    .samples_per_pixel = 5};
    assert_true(image_hash(image) == hash && render(&all, NULL) == hash);
    ca_image_release(image);
}

/* ---- What is refused ------------------------------------------------------------------------------------------- */

#define REFUSED(words, ...)                                                                                          \
    do {                                                                                                             \
        ca_render_settings other = kept("vcm", 4, 1);                                                                \
        __VA_ARGS__;                                                                                                 \
        refuse_on(scene, &other, CA_ERROR_ARGUMENT, words);                                                          \
    } while (0)

static void test_other_settings_are_refused(void **state)
{
    (void)state;
    unlink(file("c.part"));
    const ca_render_settings s = kept("vcm", 2, 1);
    const uint64_t hash = render(&s, NULL);
    REFUSED("\"integrator vcm\", but this render has \"integrator ovcm\"", other.integrator = "ovcm");
    REFUSED("\"integrator auto\"", other.integrator = "auto");
    REFUSED("\"max_depth 4\", but this render has \"max_depth 6\"", other.max_depth = 6);
    REFUSED("\"radius ", other.radius = 0.125);
    REFUSED("\"alpha 0.75\"", other.alpha = 0.75, other.has_alpha = true);
    REFUSED("\"light_paths 77\"", other.light_paths = 77);
    REFUSED("\"camera_paths 2\"", other.camera_paths = 2);
    REFUSED("\"sampler halton\"", other.sampler = "halton");
    REFUSED("\"seed 0\", but this render has \"seed 3\"", other.seed = 3, other.has_seed = true);
    REFUSED("\"resolution 8x6\", but this render has \"resolution 16x12\"", other.width = 16, other.height = 12);
    REFUSED("\"crop 0,0,8,6\", but this render has \"crop 0,0,8,5\"", other.has_crop = true, other.crop[2] = 8,
            other.crop[3] = 5);
    REFUSED("\"passes_per_replicate 1\", but this render has \"passes_per_replicate 2\"", other.replicates = 2);
    REFUSED("the samples of a render with replicates stay", other.replicates = 2);
    REFUSED("has 2 passes already, more than the 1 of this render", other.samples_per_pixel = 1);
    REFUSED("has the passes 0:2, but this render begins at pass 1", other.samples_per_pixel = 0,
            other.has_passes = true, other.passes[0] = 1, other.passes[1] = 4);
    REFUSED("there is a checkpoint already", other.resume = false);
    REFUSED("rays \"auto\"", other.integrator = "bdpm", other.rays = "auto");
    REFUSED("images of the strategies", other.strategies_directory = "x");
    const ca_define define = {"grey", "0.25"};
    ca_scene *other_scene;
    assert_int_equal(ca_scene_load(file("scene.xml"), &define, 1, &other_scene, NULL), CA_OK);
    refuse_on(other_scene, &s, CA_ERROR_ARGUMENT, "another scene");
    ca_scene_release(other_scene);
    assert_true(render(&s, NULL) == hash); /* it is still there */
}

static void test_other_blocks_are_refused(void **state)
{
    (void)state;
    unlink(file("c.part"));
    const ca_render_settings s = kept("qmcppm", 2, 1);
    render(&s, NULL);
    REFUSED("gradients=true", other.integrator = "qmcppm:gradients=true");
    REFUSED("\"seed 3\"", other.integrator = "qmcppm", other.seed = 3, other.has_seed = true);
    REFUSED("only samples, time, noise, threads, memory and outputs may be others", other.integrator = "qmcppm",
            other.seed = 3, other.has_seed = true);
    REFUSED("has 4 blocks already", other.integrator = "qmcppm", other.samples_per_pixel = 1);
    REFUSED("begins at block 1", other.integrator = "qmcppm", other.samples_per_pixel = 0, other.has_blocks = true,
            other.blocks[0] = 1, other.blocks[1] = 9);
}

static const char *const two_sensors =
    "<scene version='3.0.0'><default name='at' value='8'/>"
    "<sensor type='perspective'><float name='fov' value='20'/><transform name='to_world'>"
    "<translate z='-4'/></transform><film type='hdrfilm'><integer name='width' value='8'/>"
    "<integer name='height' value='6'/></film></sensor>"
    "<sensor type='perspective' id='wide'><float name='fov' value='60'/><transform name='to_world'>"
    "<translate z='-4'/></transform><film type='hdrfilm'><integer name='width' value='8'/>"
    "<integer name='height' value='6'/></film></sensor>"
    "<shape type='sphere'/><emitter type='point'><point name='position' x='3' y='3' z='-$at'/></emitter></scene>";

static ca_scene *seen_by(uint32_t sensor, const char *camera)
{
    ca_scene *seen;
    ca_error error;
    const ca_scene_source source = {.text = two_sensors,
                                    .size = strlen(two_sensors),
                                    .path = "two",
                                    .sensor = sensor,
                                    .camera = camera};
    if (ca_scene_parse(&source, &seen, &error) != CA_OK) fail_msg("%s", error.message);
    return seen;
}

/* Sensors of a scene are in one file, with films of one size: which one it is must be told. */
static void test_other_sensors_are_refused(void **state)
{
    (void)state;
    static const char *const integrators[] = {"path", "qmcppm"};
    ca_scene *first = seen_by(0, NULL), *second = seen_by(1, NULL), *wide = seen_by(0, "wide");
    for (int i = 0; i < 2; i++) {
        const char *parts[2] = {file("a.part"), file("b.part")};
        ca_scene *scenes[2] = {first, wide};
        ca_image_layers *image;
        ca_error error = {""};
        unlink(file("c.part"));
        const ca_render_settings s = kept(integrators[i], 2, 1);
        assert_int_equal(ca_render(first, &s, &image, NULL, &error), CA_OK);
        ca_image_release(image);
        refuse_on(second, &s, CA_ERROR_ARGUMENT, "made with \"sensor 0\", but this render has \"sensor 1\"");
        refuse_on(wide, &s, CA_ERROR_ARGUMENT, "made with \"sensor 0\", but this render has \"sensor 1\"");
        for (int part = 0; part < 2; part++) {
            ca_render_settings p = settings_of(integrators[i], 2, 1);
            p.part_path = parts[part];
            assert_int_equal(ca_render(scenes[part], &p, &image, NULL, &error), CA_OK);
            ca_image_release(image);
        }
        assert_int_equal(ca_merge_parts(parts, 2, NULL, &image, NULL, &error), CA_ERROR_ARGUMENT);
        if (!strstr(error.message, "differ in their sensor")) fail_msg("%s", error.message);
    }
    ca_scene_release(first);
    ca_scene_release(second);
    ca_scene_release(wide);
}

/* A second job at the same time. */
static bool start_another(const ca_render_progress *progress, void *user)
{
    (void)progress;
    const ca_render_settings other = kept("path", 2, 1);
    ca_image_layers *image;
    ca_error error = {""};
    assert_int_equal(ca_render(scene, &other, &image, NULL, &error), CA_ERROR_FILE);
    if (!strstr(error.message, "another render is at work")) fail_msg("%s", error.message);
    ++*(int *)user;
    return true;
}

static void test_one_job_at_a_time(void **state)
{
    (void)state;
    int calls = 0;
    unlink(file("c.part"));
    ca_render_settings s = kept("path", 2, 1);
    s.progress = start_another;
    s.progress_user = &calls;
    render(&s, NULL);
    assert_int_equal(calls, 2);
    s.progress = NULL;
    render(&s, NULL);
}

/* Every 300 s, or 100 times what the last one took; by itself only of renders of more than ten minutes, but on and on
 * once there is one; as often as was asked for. */
static void test_when_it_is_due(void **state)
{
    (void)state;
    const double now = ca_clock_seconds();
    ca_render_settings s = kept("path", 1, 1);
    ca_checkpoint c = {.path = "c.part", .last = now - 301.0};
    assert_true(ca_checkpoint_is_due(&c, &s, 1.0));
    c.cost = 3.02;
    assert_false(ca_checkpoint_is_due(&c, &s, 1.0));
    c.last = now - 299.0;
    c.cost = 0.0;
    assert_false(ca_checkpoint_is_due(&c, &s, 1e9));
    s.checkpoint_seconds = 298.0;
    assert_true(ca_checkpoint_is_due(&c, &s, 1.0));
    s.checkpoint_seconds = 0.0;
    s.checkpoint_if_long = true;
    c.last = now - 301.0;
    assert_false(ca_checkpoint_is_due(&c, &s, 599.0) || ca_checkpoint_is_wanted(&c, &s, true));
    assert_true(ca_checkpoint_is_due(&c, &s, 601.0) && ca_checkpoint_is_due(&c, &s, (double)INFINITY));
    c.is_kept = true;
    assert_true(ca_checkpoint_is_due(&c, &s, 599.0) && ca_checkpoint_is_wanted(&c, &s, true));
    assert_false(ca_checkpoint_is_wanted(&c, &s, false));
    c.path = NULL;
    assert_false(ca_checkpoint_is_due(&c, &s, 601.0) || ca_checkpoint_is_wanted(&c, &s, true));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_integrator_goes_on),
        cmocka_unit_test(test_filled_blocks_go_on),
        cmocka_unit_test(test_auto_as_a_picture_goes_on),
        cmocka_unit_test(test_replicates_go_on),
        cmocka_unit_test(test_interrupted_anywhere),
        cmocka_unit_test(test_noise_targets),
        cmocka_unit_test(test_time),
        cmocka_unit_test(test_auto_goes_on),
        cmocka_unit_test(test_other_settings_are_refused),
        cmocka_unit_test(test_other_blocks_are_refused),
        cmocka_unit_test(test_other_sensors_are_refused),
        cmocka_unit_test(test_one_job_at_a_time),
        cmocka_unit_test(test_when_it_is_due),
    };
    return cmocka_run_group_tests(tests, begin_small_renders, end_small_renders);
}
