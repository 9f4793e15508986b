/* Numbers of rays that are chosen once, for several ranks (render/rays_once.h), which are threads here: the picture
 * is the one that its own file makes, whoever makes its passes and however often it is gone on with; how much of the
 * render they are chosen by; what is refused. */
#define _POSIX_C_SOURCE 200809L
#include "image/layers.h"
#include "support/rank_job.h"
#include "support/scene_text.h"
#include "support/small_render.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static rank_job job_of(const char *integrator, uint32_t samples)
{
    rank_job j = {.settings = settings_of(integrator, samples, 1), .many_threads = true};
    j.settings.rays = "auto";
    return j;
}

/* Renders by ranks; the image is kept as r.exr. */
static uint64_t choose(rank_job *j, uint32_t ranks)
{
    rank_job_succeed(j, ranks, 0);
    assert_int_equal(ca_image_save(j->image, file("r.exr"), 0.0f, NULL), CA_OK);
    const uint64_t hash = image_hash(j->image);
    ca_image_release(j->image);
    return hash;
}

/* By one process, with the numbers of r.exr. */
static uint64_t repeat(const char *integrator, uint32_t samples, ca_render_statistics *statistics)
{
    ca_render_settings s = settings_of(integrator, samples, 2);
    s.rays = file("r.exr");
    s.has_alpha = strcmp(integrator, "auto") != 0 && strcmp(integrator, "bdpt") != 0; /* radii stay */
    return render(&s, statistics);
}

static void test_the_picture_is_that_of_its_file(void **state)
{
    (void)state;
    static const char *const integrators[] = {"ppm", "bdpm", "bdpt", "vavcm", "auto"};
    for (int i = 0; i < 5; i++) {
        ca_render_statistics again = {.size = sizeof again};
        rank_job j = job_of(integrators[i], 200);
        const uint64_t hash = choose(&j, 2 + (uint32_t)i % 3);
        const ca_rays_statistics *rays = &j.statistics.numbers_of_rays;
        if (repeat(integrators[i], 200, &again) != hash) fail_msg("%s: another picture", integrators[i]);
        assert_true(again.iterations == j.statistics.iterations);
        if (strcmp(integrators[i], "auto") == 0 && rays->light_paths == 0)
            continue; /* a method without such numbers */
        assert_true(rays->phases == 1 && rays->pilot_seconds > 0.0 && rays->pilot_seconds < j.statistics.seconds);
        assert_true(rays->light_paths == again.numbers_of_rays.light_paths);
        assert_true(rays->camera_paths == again.numbers_of_rays.camera_paths);
    }
}

/* The numbers are those of the file, by other ranks and by one process. */
static void test_going_on(void **state)
{
    (void)state;
    static const char *const integrators[] = {"bdpm", "auto"};
    for (int i = 0; i < 2; i++) {
        ca_render_statistics s = {.size = sizeof s};
        rank_job j = job_of(integrators[i], 100);
        j.settings.checkpoint_path = file("c.part");
        j.settings.checkpoint_seconds = 1e-9;
        j.settings.resume = true;
        (void)choose(&j, 3);
        const uint64_t first = j.statistics.iterations;
        j.settings.samples_per_pixel = 160;
        (void)rank_job_hash(&j, 2, 3);
        assert_true(j.statistics.passes_resumed == first && j.statistics.numbers_of_rays.pilot_seconds == 0.0);
        ca_render_settings one = j.settings;
        one.samples_per_pixel = 200;
        const uint64_t hash = render(&one, &s);
        assert_true(s.passes_resumed == j.statistics.iterations && s.iterations > s.passes_resumed);
        assert_true(repeat(integrators[i], 200, NULL) == hash);
        unlink(file("c.part"));
    }
}

/* The pilot of one process: 6 % of the time; two seconds to a noise target, or until that is reached. */
static void test_how_much_they_are_chosen_by(void **state)
{
    (void)state;
    rank_job j = job_of("bdpm", 0);
    const ca_rays_statistics *rays = &j.statistics.numbers_of_rays;
    j.settings.seconds = 2.0;
    (void)choose(&j, 2);
    assert_true(rays->pilot_seconds >= 0.12 && rays->pilot_seconds < 0.5 * j.statistics.seconds);
    assert_true(j.statistics.seconds >= 2.0);
    j.settings.seconds = 0.0;
    j.settings.noise_percent = 12.0;
    (void)choose(&j, 2);
    assert_true(j.statistics.noise_percent < 12.0 && rays->light_paths > 0);
    assert_true(j.statistics.seconds > rays->pilot_seconds);
}

/* Without time for more than the shortest pilot its numbers are used. */
static void test_no_time_to_choose(void **state)
{
    (void)state;
    rank_job j = job_of("bdpm", 0);
    const ca_rays_statistics *rays = &j.statistics.numbers_of_rays;
    j.settings.seconds = 1e-3;
    j.settings.light_paths = 40;
    (void)choose(&j, 2);
    assert_true(rays->light_paths == 40 && rays->camera_paths == 2.0 && j.statistics.iterations > 0);
}

/* They are not the numbers that the pilot had, which are far from the best. */
static void test_they_are_chosen(void **state)
{
    (void)state;
    static const struct {
        const char *integrator;
        uint32_t light_paths;
    } pilots[] = {{"bdpm", 400}, {"vavcm", 16}};
    for (int i = 0; i < 2; i++) {
        rank_job j = job_of(pilots[i].integrator, 1000);
        const ca_rays_statistics *rays = &j.statistics.numbers_of_rays;
        j.settings.light_paths = pilots[i].light_paths;
        (void)choose(&j, 2);
        assert_true(rays->light_paths != pilots[i].light_paths || rays->camera_paths != 2.0);
        assert_true(rays->predicted_gain >= 1.0);
    }
}

/* Once; nobody asks again. */
static bool end_at_first(const ca_render_progress *progress, void *user)
{
    int *calls = user;
    assert_true(*calls > 0 || !progress->snapshot); /* no pass has been made */
    return ++*calls > 1;
}

/* One pass is made, with the numbers of the settings. */
static void test_ended_while_choosing(void **state)
{
    (void)state;
    int calls = 0;
    rank_job j = job_of("bdpm", 2000);
    j.settings.progress = end_at_first;
    j.settings.progress_user = &calls;
    (void)choose(&j, 2);
    assert_true(j.statistics.interrupted && j.statistics.iterations == 1);
    assert_int_equal(j.statistics.numbers_of_rays.light_paths, 0);
}

/* By a signal: the pilot has no iteration, and the pass is finished. */
static void test_stopped_while_choosing(void **state)
{
    (void)state;
    const int stop = 1;
    rank_job j = job_of("bdpm", 2000);
    j.settings.stop = &stop;
    j.settings.checkpoint_path = file("stopped.part");
    (void)choose(&j, 2);
    assert_true(j.statistics.interrupted && j.statistics.iterations == 1);
    assert_true(access(j.settings.checkpoint_path, F_OK) != 0);
}

/* A part of that one pass has no numbers to go on with. */
static void test_part_without_numbers(void **state)
{
    (void)state;
    const int stop = 1;
    rank_job j = job_of("bdpm", 2000);
    j.settings.stop = &stop;
    j.settings.part_path = file("one.part");
    (void)choose(&j, 2);
    j = job_of("bdpm", 2000);
    j.settings.checkpoint_path = file("one.part");
    j.settings.resume = true;
    rank_job_refused(&j, 2, CA_ERROR_ARGUMENT, "has no numbers of rays, since its render was ended");
}

static void test_refusals(void **state)
{
    (void)state;
    rank_job j = job_of("bdpm", 50);
    rank_job_refused(&j, 2, CA_ERROR_ARGUMENT, "50 samples per pixel are too few for rays \"auto\" by 2 ranks");
    j = job_of("bdpm", 0);
    j.settings.has_passes = true;
    j.settings.passes[1] = 10;
    rank_job_refused(&j, 2, CA_ERROR_ARGUMENT, "each part would have numbers of rays of its own");
    j = job_of("bdpm", 100);
    j.last_without_rays = true;
    rank_job_refused(&j, 2, CA_ERROR_ARGUMENT, "this rank has \"rays none\", but rank 0 has \"rays chosen\"");
    j = job_of("path", 10);
    rank_job_refused(&j, 2, CA_ERROR_ARGUMENT, "numbers of rays are chosen by a law of noise");
}

/* Checkpoints of other kinds of render, and this kind's without "auto". */
static void test_other_checkpoints(void **state)
{
    (void)state;
    ca_render_settings joined = settings_of("bdpm", 60, 1), plain = settings_of("bdpm", 4, 1);
    joined.rays = "auto";
    joined.checkpoint_path = file("joined.part");
    plain.has_alpha = true;
    plain.checkpoint_path = file("plain.part");
    (void)render(&joined, NULL);
    (void)render(&plain, NULL);
    rank_job j = job_of("bdpm", 100);
    j.settings.resume = true;
    j.settings.checkpoint_path = joined.checkpoint_path;
    rank_job_refused(&j, 2, CA_ERROR_FORMAT, "only such a render by one process goes on from it");
    j.settings.checkpoint_path = plain.checkpoint_path;
    rank_job_refused(&j, 2, CA_ERROR_ARGUMENT, "was made with \"rays none\", but this render has \"rays chosen\"");
    j.settings.checkpoint_path = file("once.part");
    (void)choose(&j, 2);
    plain = j.settings;
    plain.rays = NULL;
    plain.has_alpha = true;
    ca_error error = {""};
    ca_image_layers *image = NULL;
    assert_int_equal(ca_render(scene, &plain, &image, NULL, &error), CA_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, "but this render has \"rays none\""));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_the_picture_is_that_of_its_file),
        cmocka_unit_test(test_going_on),
        cmocka_unit_test(test_how_much_they_are_chosen_by),
        cmocka_unit_test(test_no_time_to_choose),
        cmocka_unit_test(test_they_are_chosen),
        cmocka_unit_test(test_ended_while_choosing),
        cmocka_unit_test(test_stopped_while_choosing),
        cmocka_unit_test(test_part_without_numbers),
        cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_other_checkpoints),
    };
    return cmocka_run_group_tests(tests, begin_small_renders, end_small_renders);
}
