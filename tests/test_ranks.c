/* Renders by several ranks, which are threads here: of every integrator the bits of one process, for any numbers of
 * ranks and threads and any lateness of messages; looks at the noise, time, signals, checkpoints, replicates and
 * pictures on the way; ranks that do not fit together. */
#define _POSIX_C_SOURCE 200809L
#include "film/pass_part.h"
#include "integrator/integrator.h"
#include "support/rank_job.h"
#include "support/scene_text.h"
#include "support/small_render.h"
#include "support/thread_ranks.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>

/* ---- The bits -------------------------------------------------------------------------------------------------- */

static void test_every_integrator(void **state)
{
    (void)state;
    for (size_t i = 0; integrator_at(i); i++) {
        if (chooses(i)) continue;
        ca_render_statistics one = {.size = sizeof one};
        rank_job j = {.settings = settings_of(integrator_at(i), 9, 1), .many_threads = true};
        const uint64_t hash = render(&j.settings, &one);
        for (uint32_t ranks = 2; ranks <= 4; ranks++) {
            if (rank_job_hash(&j, ranks, i % 2 ? 3 : 0) != hash)
                fail_msg("%s, %u ranks: another image", integrator_at(i), ranks);
            const ca_render_statistics *s = &j.statistics;
            assert_true(s->iterations == one.iterations && s->samples_per_pixel == one.samples_per_pixel);
            assert_true(s->passes[1] == one.passes[1] && s->blocks[1] == one.blocks[1] && s->ranks == ranks);
            assert_true(s->camera_paths >= one.camera_paths && s->light_paths >= one.light_paths);
            if (!ca_integrator_at(i)->begin_block) assert_true(s->camera_paths == one.camera_paths);
        }
    }
}

/* Rank 0 waits after each of its ranges, so that the others get some, too, and counts them. */
static bool wait_for_others(const ca_render_progress *progress, void *user)
{
    const struct timespec pause = {.tv_nsec = 2000000};
    (void)progress;
    ++*(uint32_t *)user;
    nanosleep(&pause, NULL);
    return true;
}

/* Replicates of several passes stay together, and each has its own seed, whichever rank makes it. */
static void test_replicates(void **state)
{
    (void)state;
    static const char *const samplers[] = {"independent", "sobol"};
    for (int i = 0; i < 2; i++) {
        uint32_t own = 0;
        rank_job j = {.settings = settings_of("vcm", 24, 1)};
        j.settings.sampler = samplers[i];
        j.settings.replicates = 8;
        const uint64_t hash = render(&j.settings, NULL);
        j.settings.progress = wait_for_others;
        j.settings.progress_user = &own;
        assert_true(rank_job_hash(&j, 3, 0) == hash && own < 8);
    }
}

/* Rank 0 chooses for all: the picture is that of the method it names. */
static void test_auto(void **state)
{
    (void)state;
    char method[1024];
    rank_job j = {.settings = settings_of("auto", 6, 1)};
    rank_job_run(&j, 3, 0);
    assert_int_equal(j.status, CA_OK);
    assert_true(j.statistics.method.reason[0]);
    snprintf(method, sizeof method, "%s", attribute_text(j.image, "caustica.integrator"));
    ca_render_settings s = settings_of(method, 6, 1);
    s.radius = 0.0;
    assert_true(render(&s, NULL) == image_hash(j.image));
    ca_image_release(j.image);
}

/* ---- When it ends ---------------------------------------------------------------------------------------------- */

/* The noise is looked at after the same passes, and none beyond is in the picture. */
static void test_noise(void **state)
{
    (void)state;
    static const double targets[] = {30.0, 12.0, 9.0};
    for (int i = 0; i < 3; i++) {
        ca_render_statistics one = {.size = sizeof one};
        rank_job j = {.settings = settings_of("path", 0, 1), .many_threads = true};
        j.settings.noise_percent = targets[i];
        const uint64_t hash = render(&j.settings, &one);
        for (uint32_t ranks = 2; ranks <= 4; ranks += 2) {
            const uint64_t by_ranks = rank_job_hash(&j, ranks, i == 1 ? 4 : 0);
            assert_int_equal(j.statistics.iterations, one.iterations);
            assert_true(by_ranks == hash && j.statistics.noise_percent == one.noise_percent);
            assert_int_equal(j.statistics.passes[1], one.passes[1]); /* those beyond were not made */
        }
        ca_render_settings passes = settings_of("path", 0, 1);
        passes.has_passes = true;
        passes.passes[1] = one.passes[1];
        assert_true(render(&passes, NULL) == hash);
    }
}

/* All passes that were begun are in the picture, and it is one of the passes that are told. */
static void test_time(void **state)
{
    (void)state;
    static const char *const integrators[] = {"ovcm", "qmcppm"};
    for (int i = 0; i < 2; i++) {
        rank_job j = {.settings = settings_of(integrators[i], 0, 1)};
        j.settings.seconds = 0.05;
        const uint64_t hash = rank_job_hash(&j, 3, 0);
        const ca_render_statistics *s = &j.statistics;
        ca_render_settings same = settings_of(integrators[i], 0, 1);
        assert_true(s->iterations > 0 && s->seconds >= 0.05);
        same.has_blocks = i == 1;
        same.has_passes = i == 0;
        same.blocks[1] = s->blocks[1];
        same.passes[1] = s->passes[1];
        assert_int_equal(i == 1 ? s->blocks[1] : s->passes[1], s->iterations);
        assert_true(render(&same, NULL) == hash);
    }
}

typedef struct watcher {
    uint32_t stop_after, calls;
    uint64_t hash; /* of the picture gathered in call `gather_at` */
    uint32_t gather_at, passes;
    uint32_t last;
} watcher;

static bool watch(const ca_render_progress *progress, void *user)
{
    watcher *w = user;
    w->calls++;
    assert_true(progress->passes_done >= w->last);
    w->last = progress->passes_done;
    if (w->gather_at == w->calls) {
        ca_image_layers *image;
        ca_render_statistics s = {.size = sizeof s};
        assert_non_null(progress->gather);
        progress->gather(progress);
        assert_int_equal(progress->snapshot(progress, &image, &s, NULL), CA_OK);
        w->hash = image_hash(image);
        w->passes = (uint32_t)s.iterations;
        assert_true((progress->blocks ? s.blocks[1] : s.passes[1]) == s.iterations);
        ca_image_release(image);
    }
    return w->stop_after == 0 || progress->passes_done < w->stop_after;
}

/* A picture on the way has all passes that were handed out then; the render goes on to its own bits. */
static void test_picture_on_the_way(void **state)
{
    (void)state;
    static const char *const integrators[] = {"vavcm", "qmcppm"};
    for (int i = 0; i < 2; i++) {
        watcher w = {.gather_at = 2};
        rank_job j = {.settings = settings_of(integrators[i], 16, 1)};
        j.settings.progress = watch;
        j.settings.progress_user = &w;
        const uint64_t hash = rank_job_hash(&j, 3, 0);
        ca_render_settings s = settings_of(integrators[i], 16, 1);
        assert_true(render(&s, NULL) == hash && w.passes > 0);
        s.samples_per_pixel = 0;
        s.has_blocks = i == 1;
        s.has_passes = i == 0;
        s.blocks[1] = s.passes[1] = w.passes;
        assert_true(render(&s, NULL) == w.hash);
    }
}

/* By the callback on rank 0, or by a signal that only the last rank has got. */
static void test_early_end(void **state)
{
    (void)state;
    const int stop = 1;
    for (int i = 0; i < 2; i++) {
        watcher w = {.stop_after = i == 0 ? 5 : 0};
        rank_job j = {.settings = settings_of("path", 100000, 1), .last_stop = i == 1 ? &stop : NULL};
        j.settings.progress = watch;
        j.settings.progress_user = &w;
        const uint64_t hash = rank_job_hash(&j, 4, 0);
        assert_true(j.statistics.interrupted && j.statistics.iterations < 100000);
        ca_render_settings s = settings_of("path", (uint32_t)j.statistics.iterations, 1);
        assert_true(render(&s, NULL) == hash);
    }
}

/* ---- Files ----------------------------------------------------------------------------------------------------- */

/* A checkpoint after every pass; gone on from by another number of ranks, and by one process. */
static void test_checkpoints(void **state)
{
    (void)state;
    static const char *const integrators[] = {"cavcm", "qmcppm"};
    for (int i = 0; i < 2; i++) {
        rank_job j = {.settings = settings_of(integrators[i], 9, 1)};
        ca_render_settings all = settings_of(integrators[i], 25, 1);
        const uint64_t hash = render(&all, NULL);
        j.settings.checkpoint_path = file("c.part");
        j.settings.checkpoint_seconds = 1e-9;
        j.settings.resume = true;
        rank_job_hash(&j, 3, 0);
        const uint64_t first = j.statistics.iterations;
        j.settings.samples_per_pixel = 16;
        rank_job_hash(&j, 2, 3);
        assert_true(j.statistics.passes_resumed == first && j.statistics.iterations > first);
        all.checkpoint_path = j.settings.checkpoint_path;
        all.resume = true;
        ca_render_statistics s = {.size = sizeof s};
        assert_true(render(&all, &s) == hash && s.passes_resumed == j.statistics.iterations);
        unlink(all.checkpoint_path);
    }
}

/* Gone on from in the middle of a replicate: rank 0 finishes it, and the others, who have waited, then get some. */
static void test_open_replicate(void **state)
{
    (void)state;
    uint32_t own = 0;
    watcher w = {.stop_after = 4};
    ca_render_settings first = settings_of("path", 24, 1), all = first;
    all.replicates = first.replicates = 8;
    const uint64_t hash = render(&all, NULL);
    first.checkpoint_path = file("open.part");
    first.progress = watch;
    first.progress_user = &w;
    render(&first, NULL);
    rank_job j = {.settings = all};
    j.settings.checkpoint_path = first.checkpoint_path;
    j.settings.resume = true;
    j.settings.progress = wait_for_others;
    j.settings.progress_user = &own;
    assert_true(rank_job_hash(&j, 3, 0) == hash && j.statistics.passes_resumed == 4);
    assert_true(own < 7); /* the rest of one replicate and six more */
}

/* Blocks as large as the memory: how many they are is known when the last camera paths have been traced, for which
 * the others wait. */
static void test_filled_blocks(void **state)
{
    (void)state;
    rank_job j = {.settings = settings_of("qmcppm:blocks=filled,radius=0.1", 400, 1)};
    j.settings.memory_mib = 1.0;
    ca_render_statistics one = {.size = sizeof one};
    const uint64_t hash = render(&j.settings, &one);
    assert_true(one.blocks[1] > 4 && rank_job_hash(&j, 3, 0) == hash && j.statistics.blocks[1] == one.blocks[1]);
}

/* A part by ranks is one by a process: merged with another part it is the whole. */
static void test_parts(void **state)
{
    (void)state;
    rank_job j = {.settings = settings_of("bdpt", 0, 1)};
    ca_render_settings all = settings_of("bdpt", 12, 1);
    const char *paths[2] = {file("a.part"), file("b.part")};
    ca_image_layers *image = NULL;
    ca_render_statistics s = {.size = sizeof s}, one = {.size = sizeof one};
    const uint64_t hash = render(&all, &one);
    j.settings.has_passes = true;
    for (int i = 0; i < 2; i++) {
        j.settings.passes[0] = i == 0 ? 0 : 7;
        j.settings.passes[1] = i == 0 ? 7 : 12;
        j.settings.part_path = paths[i];
        rank_job_run(&j, 3, 0);
        assert_int_equal(j.status, CA_OK);
        ca_image_release(j.image);
    }
    assert_int_equal(ca_merge_parts(paths, 2, NULL, &image, &s, NULL), CA_OK);
    assert_true(image_hash(image) == hash && s.camera_paths == one.camera_paths && s.rays == one.rays);
    ca_image_release(image);
}

/* A part of the passes [begin, end) with the numbers of rays of r.exr, by ranks or alone. */
static void make_ray_part(const char *integrator, uint64_t begin, uint64_t end, uint32_t ranks, const char *path)
{
    rank_job j = {.settings = settings_of(integrator, 0, 2)};
    j.settings.rays = file("r.exr");
    j.settings.has_passes = true;
    j.settings.passes[0] = begin;
    j.settings.passes[1] = end;
    j.settings.part_path = path;
    if (ranks > 1) {
        rank_job_run(&j, ranks, 0);
        assert_int_equal(j.status, CA_OK);
        ca_image_release(j.image);
    } else {
        (void)render(&j.settings, NULL);
    }
}

/* The numbers of rays of a file decide all: parts and ranks make the picture of one process, layers of rays too, and
 * the merged statistics know the numbers. Parts with the numbers of other files do not add up. */
static void expect_ray_parts(const char *chosen_for, const char *integrator)
{
    ca_image_layers *image = NULL;
    ca_render_statistics one = {.size = sizeof one}, s = {.size = sizeof s};
    ca_render_settings chooser = settings_of(chosen_for, 64, 1);
    chooser.rays = "auto";
    assert_int_equal(ca_render(scene, &chooser, &image, NULL, NULL), CA_OK);
    assert_int_equal(ca_image_save(image, file("r.exr"), 0.0f, NULL), CA_OK);
    ca_image_release(image);
    rank_job j = {.settings = settings_of(integrator, 200, 1)};
    j.settings.rays = file("r.exr");
    const uint64_t hash = render(&j.settings, &one), n = one.iterations;
    assert_true(n >= 3 && rank_job_hash(&j, 3, 0) == hash);
    const char *paths[3] = {file("a.part"), file("b.part"), file("c.part")};
    make_ray_part(integrator, 2, n, 3, paths[0]);
    make_ray_part(integrator, 0, 1, 1, paths[1]);
    make_ray_part(integrator, 1, 2, 1, paths[2]);
    assert_int_equal(ca_merge_parts(paths, 3, file("all.part"), &image, &s, NULL), CA_OK);
    if (image_hash(image) != hash) fail_msg("%s: the parts are another picture", integrator);
    ca_image_release(image);
    assert_true(s.camera_paths == one.camera_paths && s.light_paths >= one.light_paths); /* and each part's pilots */
    assert_true(s.numbers_of_rays.light_paths == one.numbers_of_rays.light_paths && s.iterations == n);
    assert_true(s.numbers_of_rays.camera_paths == one.numbers_of_rays.camera_paths);
    const char *all = file("all.part");
    assert_int_equal(ca_merge_parts(&all, 1, NULL, &image, &s, NULL), CA_OK);
    assert_true(image_hash(image) == hash);
    ca_image_release(image);
}

static void test_parts_with_rays_of_a_file(void **state)
{
    (void)state;
    static const char *const integrators[] = {"ppm", "bdpm", "bdpt", "vavcm"};
    for (int i = 0; i < 4; i++) expect_ray_parts(integrators[i], integrators[i]);
    expect_ray_parts("ovcm", "auto"); /* which method that is tells the file */
    ca_error error = {""};
    const char *paths[2] = {file("a.part"), file("d.part")};
    rank_job j = {.settings = settings_of("ovcm", 0, 1)};
    j.settings.has_passes = true;
    j.settings.passes[1] = 2;
    j.settings.part_path = paths[1];
    (void)render(&j.settings, NULL);
    assert_int_equal(ca_merge_parts(paths, 2, NULL, NULL, NULL, &error), CA_ERROR_ARGUMENT);
    if (!strstr(error.message, "differ in their rays")) fail_msg("%s", error.message);
}

/* A picture without numbers of rays names the method, and that is all: for every rank. */
static void test_auto_as_a_picture(void **state)
{
    (void)state;
    ca_image_layers *image = NULL;
    const ca_render_settings path = settings_of("path", 6, 1);
    assert_int_equal(ca_render(scene, &path, &image, NULL, NULL), CA_OK);
    assert_int_equal(ca_image_save(image, file("p.exr"), 0.0f, NULL), CA_OK);
    ca_image_release(image);
    rank_job j = {.settings = settings_of("auto", 6, 1)};
    j.settings.rays = file("p.exr");
    assert_true(rank_job_hash(&j, 3, 0) == render(&path, NULL));
}

/* ---- What does not fit ----------------------------------------------------------------------------------------- */

static void test_refusals(void **state)
{
    (void)state;
    static const char *const integrators[] = {"path", "qmcppm"};
    char grey[4096];
    const char *place = strstr(scene_xml, "value='0.5'");
    snprintf(grey, sizeof grey, "%.*svalue='0.6'%s", (int)(place - scene_xml), scene_xml, place + 11);
    ca_scene *other = scene_from_text(grey);
    for (int i = 0; i < 2; i++) {
        rank_job j = {.settings = settings_of(integrators[i], 2, 1), .last_scene = other};
        rank_job_refused(&j, 3, CA_ERROR_ARGUMENT, "): this is another scene than that of rank 0");
        assert_true(strncmp(j.error.message, "rank 2 (", 8) == 0);
        j = (rank_job){.settings = settings_of(integrators[i], 2, 1)};
        j.settings.checkpoint_path = "/nowhere/c.part";
        rank_job_refused(&j, 3, CA_ERROR_FILE, "/nowhere/c.part");
    }
    ca_scene_release(other);
    rank_job j = {.settings = settings_of("bdpm", 0, 1)};
    j.settings.rays = file("r.part");
    rank_job_refused(&j, 3, CA_ERROR_ARGUMENT, "one rank makes them");
    j = (rank_job){.settings = settings_of("bdpt", 2, 1)};
    j.settings.strategies_directory = file("s");
    rank_job_refused(&j, 3, CA_ERROR_ARGUMENT, "images of the strategies are made by one rank");
}

/* What ranks tell each other depends on the integrator. */
static void test_other_integrator(void **state)
{
    (void)state;
    static const char *const names[] = {"path", "auto", "qmcppm"};
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) {
            char words[128];
            if (i == k) continue;
            rank_job j = {.settings = settings_of(names[i], 2, 1), .last_integrator = names[k]};
            j.settings.radius = 0.0; /* which path has not */
            snprintf(words, sizeof words, "this rank has \"integrator %s\", but rank 0 has \"integrator %s\"",
                     names[k], names[i]);
            rank_job_refused(&j, 3, CA_ERROR_ARGUMENT, words);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_integrator),
        cmocka_unit_test(test_replicates),
        cmocka_unit_test(test_auto),
        cmocka_unit_test(test_noise),
        cmocka_unit_test(test_time),
        cmocka_unit_test(test_picture_on_the_way),
        cmocka_unit_test(test_early_end),
        cmocka_unit_test(test_checkpoints),
        cmocka_unit_test(test_open_replicate),
        cmocka_unit_test(test_filled_blocks),
        cmocka_unit_test(test_parts),
        cmocka_unit_test(test_parts_with_rays_of_a_file),
        cmocka_unit_test(test_auto_as_a_picture),
        cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_other_integrator),
    };
    return cmocka_run_group_tests_name("renders by ranks", tests, begin_small_renders, end_small_renders);
}
