/* Renders with rays "auto" that are kept in files: they go on from any iteration, in whatever stage, and end with the
 * image that their record tells, to the bit; what is refused, and files that are damaged or foreign. */
#define _POSIX_C_SOURCE 200809L
#include "base/clock.h"
#include "base/file.h"
#include "base/little_endian.h"
#include "base/memory.h"
#include "film/part_stream.h"
#include "render/auto_rays_state.h"
#include "render/part_settings.h"
#include "support/auto_bias.h"
#include "support/scene_text.h"
#include "support/test_random.h"

#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>

static char folder[] = "/tmp/caustica-auto-checkpoints-XXXXXX";
static ca_scene *scene;

static const char *file(const char *name)
{
    static char paths[8][128];
    static int next;
    char *path = paths[next++ % 8];
    snprintf(path, sizeof paths[0], "%s/%s", folder, name);
    return path;
}

/* Ends after so many iterations of this process; `stop`: or in the next one. */
typedef struct ending {
    uint32_t after, begun;
    bool has_begun;
    int stop;
} ending;

static bool end_after(const ca_render_progress *progress, void *user)
{
    ending *e = user;
    if (!e->has_begun) e->begun = (uint32_t)progress->passes_done - 1;
    e->has_begun = true;
    return progress->passes_done - e->begun < e->after;
}

static bool stop_after(const ca_render_progress *progress, void *user)
{
    ending *e = user;
    if (!end_after(progress, user)) __atomic_store_n(&e->stop, 1, __ATOMIC_SEQ_CST);
    return true;
}

static ca_render_settings settings_of(const char *integrator, uint32_t samples, uint32_t threads)
{
    ca_render_settings s;
    ca_render_settings_init(&s);
    s.integrator = integrator;
    s.rays = "auto";
    s.samples_per_pixel = samples;
    s.light_paths = 200;
    s.threads = threads;
    return s;
}

static ca_render_settings kept(const char *integrator, uint32_t samples, uint32_t threads)
{
    ca_render_settings s = settings_of(integrator, samples, threads);
    s.checkpoint_path = file("c.part");
    s.resume = true;
    return s;
}

static uint64_t render(const ca_render_settings *settings, ca_render_statistics *statistics)
{
    ca_image_layers *image = NULL;
    ca_error error = {""};
    if (ca_render(scene, settings, &image, statistics, &error) != CA_OK) fail_msg("%s", error.message);
    const uint64_t hash = image_hash(image);
    ca_image_release(image);
    return hash;
}

/* The render that a file tells. */
static uint64_t repeated(const ca_render_settings *settings, const char *path, uint32_t threads)
{
    ca_render_settings s = *settings;
    s.rays = path;
    s.rays_objective = NULL;
    s.samples_per_pixel = 0;
    s.seconds = s.noise_percent = 0.0;
    s.threads = threads;
    s.checkpoint_path = NULL;
    s.checkpoint_seconds = 0.0;
    s.resume = false;
    s.progress = NULL;
    s.stop = NULL;
    ca_render_statistics statistics = {.size = sizeof statistics};
    return render(&s, &statistics);
}

static void refuse(const ca_render_settings *settings, ca_status expected, const char *words)
{
    ca_image_layers *image;
    ca_error error = {""};
    const ca_status status = ca_render(scene, settings, &image, NULL, &error);
    if (status != expected) fail_msg("%s: status %d: %s", words, (int)status, error.message);
    assert_null(image);
    if (!strstr(error.message, words)) fail_msg("\"%s\" is not said in \"%s\"", words, error.message);
    assert_int_equal(access(file("c.part.lock"), F_OK), -1);
}

/* ---- Going on -------------------------------------------------------------------------------------------------- */

/* Every process makes so many iterations and is ended; the image of each is the one of its record. */
static uint32_t expect_goes_on(ca_render_settings s, uint32_t after)
{
    ca_render_statistics statistics = {.size = sizeof statistics};
    uint32_t processes = 0;
    unlink(s.checkpoint_path);
    do {
        const uint64_t before = processes > 0 ? statistics.iterations : 0;
        ending e = {.after = after};
        s.progress = end_after;
        s.progress_user = &e;
        s.threads = 1 + processes % 3;
        const uint64_t hash = render(&s, &statistics);
        if (statistics.passes_resumed != before) fail_msg("%u: resumed at another place", after);
        if (repeated(&s, s.checkpoint_path, 1 + (processes + 1) % 2) != hash)
            fail_msg("%u iterations a time, process %u: another image than that of its record", after, processes);
        assert_true(++processes < 200);
    } while (statistics.interrupted);
    assert_true(statistics.samples_per_pixel >= s.samples_per_pixel);
    print_message("# %s: %u processes of %u iterations\n", s.integrator, processes, after);
    return processes;
}

static void test_goes_on_from_anywhere(void **state)
{
    (void)state;
    static const uint32_t after[] = {2, 3, 5, 13};
    for (int i = 0; i < 4; i++) assert_true(expect_goes_on(kept("bdpm", 160, 1), after[i]) > 13 / after[i]);
    assert_true(expect_goes_on(kept("ppm", 96, 1), 4) > 13 / 4);
    ca_render_settings cropped = kept("bdpm", 160, 1);
    cropped.has_crop = true;
    memcpy(cropped.crop, (const uint32_t[]){1, 2, 8, 7}, sizeof cropped.crop);
    cropped.rays_objective = "relative";
    expect_goes_on(cropped, 7);
}

/* Where paths connect, estimates are of several weightings, and vavcm's weights come from a pilot of their own. */
/* Within an iteration: image and record are the same, with what is known of the noise. A run that is stopped in its
 * second iteration leaves out its first, and the render goes on with it. */
static void test_stopped_within(void **state)
{
    (void)state;
    ca_render_statistics statistics = {.size = sizeof statistics};
    ca_render_settings s = kept("bdpm", 160, 1);
    uint32_t left_out = 0;
    for (uint32_t after = 3; after < 30; after++) {
        ending e = {.after = after};
        s.progress = stop_after;
        s.progress_user = &e;
        s.stop = &e.stop;
        unlink(s.checkpoint_path);
        const uint64_t hash = render(&s, &statistics);
        if (repeated(&s, s.checkpoint_path, 1) != hash) fail_msg("%u: another image than that of its record", after);
        left_out += statistics.iterations + 1 == after;
        s.progress = NULL;
        s.stop = NULL;
        const uint64_t whole = render(&s, &statistics);
        assert_true(statistics.passes_resumed + 1 >= after && repeated(&s, s.checkpoint_path, 2) == whole);
    }
    assert_true(left_out >= 2);
}

static void test_connected_goes_on_from_anywhere(void **state)
{
    (void)state;
    static const struct {
        const char *method;
        uint32_t after;
    } cases[] = {{"bdpt", 2}, {"ovcm", 3}, {"vavcm", 5}, {"vcm", 7}, {"vavcm", 13}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++)
        assert_true(expect_goes_on(kept(cases[i].method, 160, 1), cases[i].after) > 13 / cases[i].after);
}

static bool end_at_third(const ca_render_progress *progress, void *user)
{
    (void)user;
    return progress->passes_done < 3;
}

/* The method is chosen once, whatever follows, and a record of it can be repeated, too; so it is of a render with too
 * few samples for a pilot, which has passes. Time that was taken counts once. */
static void expect_chosen_once(uint32_t samples, bool joins)
{
    ca_render_settings s = kept("auto", samples, 1);
    ca_render_statistics first = {.size = sizeof first}, last = {.size = sizeof last};
    s.light_paths = 0;
    s.progress = end_at_third;
    unlink(s.checkpoint_path);
    render(&s, &first);
    print_message("# %u: %s\n", samples, first.method.reason);
    assert_true(first.interrupted && first.iterations >= 3 && (first.numbers_of_rays.pilot_seconds > 0.0) == joins);
    s.progress = NULL;
    s.threads = 2;
    const double start = ca_clock_seconds();
    const uint64_t hash = render(&s, &last);
    assert_true(last.seconds - first.seconds <= ca_clock_seconds() - start && last.seconds > first.seconds);
    assert_true(last.passes_resumed == first.iterations && last.iterations > first.iterations);
    assert_string_equal(last.method.reason, first.method.reason);
    assert_true(last.method.seconds == first.method.seconds && last.samples_per_pixel >= samples);
    if (joins) assert_true(repeated(&s, s.checkpoint_path, 1) == hash);
    assert_true(render(&s, &first) == hash);
    s.seed = 3;
    s.has_seed = true;
    refuse(&s, CA_ERROR_ARGUMENT, "\"seed 0\", but this render has \"seed 3\"");
}

static void test_chosen_method_goes_on(void **state)
{
    (void)state;
    expect_chosen_once(320, true);
    expect_chosen_once(12, false);
}

/* ---- Stopped within an iteration ------------------------------------------------------------------------------- */

typedef struct stopper {
    int stop;
    double seconds;
} stopper;

static void *stop_later(void *user)
{
    stopper *s = user;
    const struct timespec time = {.tv_nsec = (long)(1e9 * s->seconds)};
    nanosleep(&time, NULL);
    __atomic_store_n(&s->stop, 1, __ATOMIC_SEQ_CST);
    return NULL;
}

/* Of the iteration that was stopped nothing stays, in no film and in no estimate; these are layers of the image. */
static void test_stopped_anywhere(void **state)
{
    (void)state;
    ca_test_random random = ca_test_random_seed(5);
    ca_render_statistics statistics = {.size = sizeof statistics};
    ca_render_settings s = kept("bdpm", 160, 1);
    uint32_t processes = 0;
    s.width = s.height = 40;
    unlink(file("c.part"));
    do {
        const double longest = 0.01 * (1 + processes / 4); /* iterations may become long */
        stopper stop = {.seconds = longest * (double)ca_test_random_float(&random)};
        pthread_t thread;
        ca_image_layers *image;
        ca_error error = {""};
        s.stop = &stop.stop;
        s.threads = 1 + processes % 2;
        statistics.interrupted = true;
        assert_int_equal(pthread_create(&thread, NULL, stop_later, &stop), 0);
        const ca_status status = ca_render(scene, &s, &image, &statistics, &error);
        pthread_join(thread, NULL);
        if (status != CA_OK && status != CA_ERROR_INTERRUPTED) fail_msg("%s", error.message);
        if (status == CA_OK) ca_image_release(image);
        assert_true(++processes < 200);
    } while (statistics.interrupted);
    assert_true(processes > 4);
    s.stop = NULL;
    const uint64_t hash = render(&s, &statistics);
    if (repeated(&s, file("c.part"), 1) != hash) fail_msg("stopped %u times: another image", processes);
}

/* ---- Other ends ------------------------------------------------------------------------------------------------ */

/* More samples with the file of a render that has ended; fewer than there are: the image as it is. */
static void test_more_samples(void **state)
{
    (void)state;
    ca_render_statistics first = {.size = sizeof first}, second = {.size = sizeof second};
    unlink(file("c.part"));
    ca_render_settings s = kept("bdpm", 160, 1);
    const uint64_t hash = render(&s, &first);
    assert_true(render(&s, &second) == hash && second.iterations == first.iterations);
    s.samples_per_pixel = 64;
    assert_true(render(&s, &second) == hash && second.passes_resumed == first.iterations);
    s.samples_per_pixel = 400;
    const uint64_t more = render(&s, &second);
    assert_true(second.passes_resumed == first.iterations && second.samples_per_pixel >= 400.0 && more != hash);
    assert_true(second.camera_paths > 2 * first.camera_paths && second.noise_percent < first.noise_percent);
    assert_true(repeated(&s, file("c.part"), 2) == more);
}

/* A render that has ended and is gone on from writes all that it has read: sums, estimates, times, counts. */
static void test_all_is_kept(void **state)
{
    (void)state;
    static const char *const methods[] = {"bdpm", "bdpt", "vavcm"};
    for (int i = 0; i < 3; i++) {
        ca_render_statistics statistics = {.size = sizeof statistics};
        ca_render_settings s = kept(methods[i], 160, 2);
        ca_bytes first, second;
        unlink(file("c.part"));
        const uint64_t hash = render(&s, &statistics);
        assert_int_equal(ca_file_read(file("c.part"), "checkpoint", 1 << 24, &first, NULL), CA_OK);
        unlink(file("d.part"));
        assert_int_equal(link(file("c.part"), file("d.part")), 0); /* what is written is another file */
        assert_true(render(&s, &statistics) == hash && statistics.passes_resumed == statistics.iterations);
        assert_int_equal(ca_file_read(file("c.part"), "checkpoint", 1 << 24, &second, NULL), CA_OK);
        struct stat was, is;
        assert_true(stat(file("d.part"), &was) == 0 && stat(file("c.part"), &is) == 0 && was.st_ino != is.st_ino);
        if (first.size != second.size || memcmp(first.data, second.data, first.size) != 0)
            fail_msg("%s: something is lost", methods[i]);
        ca_bytes_destroy(&first);
        ca_bytes_destroy(&second);
    }
}

/* ---- What is known where paths connect ------------------------------------------------------------------------- */

/* A render behind its pilot, in its first phase, with two iterations of it. */
typedef struct behind_pilot {
    ca_render_plan plan;
    ca_auto_rays a;
    ca_auto_work_film work;
} behind_pilot;

static void begin_behind_pilot(behind_pilot *r, const ca_render_settings *settings)
{
    assert_int_equal(ca_render_plan_make(&r->plan, scene, settings, NULL), CA_OK);
    ca_auto_rays *a = &r->a;
    const ca_render_plan *plan = &r->plan;
    a->plan = &r->plan;
    a->frame = (ca_film){.width = plan->crop[2], .height = plan->crop[3], .full_width = plan->camera.width,
                         .full_height = plan->camera.height};
    assert_int_equal(ca_auto_read_settings(a, NULL), CA_OK);
    a->numbers.camera_paths = ca_alloc_zeroed(ca_auto_pixels(a), sizeof(uint32_t));
    a->next.camera_path = ca_alloc_zeroed(ca_auto_pixels(a), sizeof(uint32_t));
    a->kept.choices = ca_alloc_zeroed(1, 1);
    a->kept.method = ca_alloc_zeroed(1, 1);
    assert_true(a->numbers.camera_paths && a->next.camera_path && a->kept.choices && a->kept.method);
    assert_int_equal(ca_pass_settings_make(plan, 0, &a->kept.settings, NULL), CA_OK);
}

static void end_behind_pilot(behind_pilot *r)
{
    ca_auto_rays *a = &r->a;
    ca_auto_work_destroy(&r->work);
    ca_free(a->numbers.camera_paths);
    ca_free(a->next.camera_path);
    ca_auto_nodes_destroy(&a->nodes);
    ca_ray_times_destroy(a->times);
    ca_halved_film_destroy(&a->pilot);
    ca_joined_film_destroy(&a->render);
    ca_auto_keep_end(a);
}

static void fill_doubles(void *doubles, size_t count, ca_test_random *random)
{
    for (size_t i = 0; i < count; i++) ((double *)doubles)[i] = 0.1 + (double)ca_test_random_float(random);
}

static void fill_pairs(ca_pair_film *pairs, ca_test_random *random)
{
    const size_t pixels = (size_t)pairs->width * pairs->height;
    fill_doubles(pairs->means, pixels * sizeof *pairs->means / sizeof(double), random);
    fill_doubles(pairs->connected_means, pixels * sizeof *pairs->connected_means / sizeof(double), random);
    for (uint32_t i = 0; i < pairs->other_count; i++) fill_pairs(&pairs->others[i], random);
}

static void fill_record(ca_auto_rays *a)
{
    for (ca_auto_group_kind kind = CA_AUTO_GROUP_RAMP; kind <= CA_AUTO_GROUP_RUN; kind++) {
        const ca_auto_group group = {.kind = kind, .measures = kind == CA_AUTO_GROUP_RUN, .light_paths = 200,
                                     .camera_paths = 2, .iterations = 2};
        assert_int_equal(ca_auto_record_add(&a->record, &group, NULL, ca_auto_pixels(a), NULL), CA_OK);
    }
    ca_auto_use_group(a, &a->record.groups[0]);
    a->ordinary.numbers = (ca_pilot_numbers){200, 2};
}

static void fill_behind_pilot(behind_pilot *r, ca_test_random *random)
{
    ca_auto_rays *a = &r->a;
    fill_record(a);
    a->decision = (ca_auto_decision){.step = CA_AUTO_PHASE, .run.measures = true};
    a->decision.schedule = (ca_auto_schedule){.count = 2, .done = 1};
    r->work = (ca_auto_work_film){.run = &a->decision.run, .iterations = 2};
    assert_int_equal(ca_halved_film_create(&a->pilot, &a->frame, NULL), CA_OK);
    assert_int_equal(ca_auto_known_create(a, NULL), CA_OK);
    assert_int_equal(ca_ray_times_create(&a->times, a->frame.width, a->frame.height, 1, NULL), CA_OK);
    assert_int_equal(ca_joined_film_create(&a->render, &a->frame, NULL), CA_OK);
    assert_int_equal(ca_auto_work_create(a, &r->work, NULL), CA_OK);
    for (size_t p = 0; p < ca_auto_pixels(a); p++) r->work.film.pixels[p].samples = 2;
    fill_pairs(&r->work.pairs, random);
    fill_doubles(a->nodes.weights, a->nodes.pixels, random);
    fill_doubles(a->nodes.items, 2 * sizeof a->nodes.items[0] / sizeof(double), random);
    a->nodes.items[1].light_paths += a->nodes.items[0].light_paths;
    fill_doubles(&a->nodes.luminance, 2, random);
    a->nodes.weighted = true;
    a->nodes.count = 2;
}

static void expect_same_pairs(const ca_pair_film *a, const ca_pair_film *b)
{
    const size_t pixels = (size_t)a->width * a->height;
    assert_memory_equal(a->means, b->means, pixels * sizeof *a->means);
    assert_memory_equal(a->connected_means, b->connected_means, pixels * sizeof *a->connected_means);
    assert_true(a->other_count == b->other_count);
    for (uint32_t i = 0; i < a->other_count; i++) expect_same_pairs(&a->others[i], &b->others[i]);
}

static void test_connected_estimates_are_kept(void **state)
{
    (void)state;
    ca_test_random random = ca_test_random_seed(7);
    const ca_render_settings s = settings_of("ovcm", 160, 1);
    behind_pilot written = {.work.iterations = 0}, read = {.work.iterations = 0};
    begin_behind_pilot(&written, &s);
    fill_behind_pilot(&written, &random);
    begin_behind_pilot(&read, &s);
    ca_auto_place from = {CA_AUTO_AT_RUN, NULL, &written.work, NULL}, to = {CA_AUTO_AT_RAMP, NULL, &read.work, NULL};
    ca_error error = {""};
    if (ca_auto_file_write(&written.a, &from, file("c.part"), &error) != CA_OK) fail_msg("%s", error.message);
    if (ca_auto_file_read(&read.a, &to, file("c.part"), &error) != CA_OK) fail_msg("%s", error.message);
    const ca_auto_nodes *nodes = &written.a.nodes, *same = &read.a.nodes;
    assert_true(to.stage == CA_AUTO_AT_RUN && written.work.pairs.other_count == 4);
    expect_same_pairs(&written.work.pairs, &read.work.pairs);
    assert_true(same->weighted && same->count == 2 && same->first == nodes->first && nodes->first > 0.0);
    assert_memory_equal(nodes->items, same->items, sizeof nodes->items);
    assert_memory_equal(nodes->weights, same->weights, nodes->pixels * sizeof *nodes->weights);
    assert_true(same->luminance == nodes->luminance && same->pairs == nodes->pairs);
    end_behind_pilot(&written);
    end_behind_pilot(&read);
}

/* The time of other processes, which is told from the first iteration on. */
static bool expect_time(const ca_render_progress *progress, void *user)
{
    assert_true(progress->seconds >= *(const double *)user);
    return true;
}

/* Time that was taken counts; to a noise target, then to a lower one, in the pilot and behind it. */
static void test_time_and_noise(void **state)
{
    (void)state;
    ca_render_statistics one = {.size = sizeof one}, two = {.size = sizeof two};
    unlink(file("c.part"));
    ca_render_settings s = kept("bdpm", 0, 1);
    s.light_paths = 0;
    s.seconds = 0.2;
    const uint64_t hash = render(&s, &one);
    assert_true(render(&s, &two) == hash && two.iterations == one.iterations && two.seconds >= one.seconds);
    double before = one.seconds;
    s.seconds = 0.4;
    s.progress = expect_time;
    s.progress_user = &before;
    const uint64_t more = render(&s, &two);
    assert_true(two.passes_resumed == one.iterations && two.iterations > one.iterations && two.seconds >= 0.4);
    assert_true(repeated(&s, file("c.part"), 3) == more);
    s.seconds = 0.0;
    before = two.seconds;
    s.noise_percent = 0.9 * two.noise_percent;
    const uint64_t last = render(&s, &one);
    assert_true(one.noise_percent < s.noise_percent && one.passes_resumed == two.iterations);
    assert_true(repeated(&s, file("c.part"), 1) == last);
}

static bool expect_kept(const ca_render_progress *progress, void *user)
{
    if (progress->checkpoint_failure) fail_msg("%s", progress->checkpoint_failure);
    return progress->passes_done < *(const uint32_t *)user;
}

/* A checkpoint after every iteration is no other render: nothing of the counts is lost or counted twice. */
static void test_counts(void **state)
{
    (void)state;
    ca_render_statistics whole = {.size = sizeof whole}, again = {.size = sizeof again};
    unlink(file("c.part"));
    ca_render_settings s = kept("bdpm", 160, 2);
    s.checkpoint_seconds = 1e-9;
    uint32_t end = 12;
    s.progress = expect_kept;
    s.progress_user = &end;
    render(&s, &again);
    end = UINT32_MAX;
    render(&s, &whole);
    ca_render_settings record = settings_of("bdpm", 0, 1);
    record.rays = file("c.part");
    render(&record, &again);
    assert_true(whole.passes_resumed == 12 && whole.iterations == again.iterations);
    assert_true(whole.camera_paths == again.camera_paths && whole.light_paths == again.light_paths);
    assert_true(whole.samples_per_pixel == again.samples_per_pixel && whole.rays == again.rays);
    assert_true(whole.noise_percent == again.noise_percent && whole.merges == again.merges);
}

/* ---- A choice that was not finished ---------------------------------------------------------------------------- */

static bool end_at_once(const ca_render_progress *progress, void *user)
{
    (void)progress, (void)user;
    return false;
}

/* Ended while the method is chosen: there is a picture, and it says of what, but nothing to go on from, so that the
 * next render chooses. */
static void test_unfinished_choice_is_not_kept(void **state)
{
    (void)state;
    static const char *const rays[] = {NULL, "auto"};
    for (size_t i = 0; i < 2; i++) {
        ca_render_statistics first = {.size = sizeof first}, next = {.size = sizeof next};
        unlink(file("c.part"));
        ca_render_settings s = kept("auto", 64, 1);
        s.light_paths = 0;
        s.rays = rays[i];
        s.checkpoint_seconds = 1e-9;
        s.progress = end_at_once;
        render(&s, &first);
        assert_true(first.interrupted && first.iterations == 1 && !first.keeps_checkpoint);
        assert_true(access(file("c.part"), F_OK) != 0);
        assert_non_null(strstr(first.method.reason, "auto: vavcm with "));
        assert_non_null(strstr(first.method.reason, ", untried: the choice was interrupted"));
        s.progress = NULL;
        render(&s, &next);
        assert_true(next.passes_resumed == 0 && next.method.trial_count > 0 && next.keeps_checkpoint);
    }
}

/* ---- What is refused ------------------------------------------------------------------------------------------- */

#define REFUSED(words, ...)                                                                                          \
    do {                                                                                                             \
        ca_render_settings other = kept("bdpm", 64, 1);                                                              \
        __VA_ARGS__;                                                                                                 \
        refuse(&other, CA_ERROR_ARGUMENT, words);                                                                    \
    } while (0)

static void repeat(ca_render_settings *s)
{
    s->rays = file("c.part");
    s->samples_per_pixel = 0;
    s->checkpoint_path = NULL;
    s->resume = false;
}

static void test_other_settings_are_refused(void **state)
{
    (void)state;
    unlink(file("c.part"));
    ca_render_settings s = kept("bdpm", 64, 1);
    const uint64_t hash = render(&s, NULL);
    REFUSED("\"integrator bdpm\", but this render has \"integrator ppm\"", other.integrator = "ppm");
    REFUSED("\"seed 0\", but this render has \"seed 3\"", other.seed = 3, other.has_seed = true);
    REFUSED("\"light_paths 200\", but this render has \"light_paths 100\"", other.light_paths = 100);
    REFUSED("\"objective mean\", but this render has \"objective relative\"", other.rays_objective = "relative");
    REFUSED("\"end by samples\", but this render has \"end by time or noise\"", other.samples_per_pixel = 0,
            other.seconds = 1.0);
    REFUSED("\"end by time or noise\": rays that were chosen for a number of samples go on by samples, and those for "
            "time or noise by these",
            other.samples_per_pixel = 0, other.seconds = 1.0);
    REFUSED("\"crop 0,0,12,12\"", other.has_crop = true, other.crop[2] = 8, other.crop[3] = 5);
    REFUSED("there is a checkpoint already", other.resume = false);
    REFUSED("no part of such a render", other.part_path = file("p.part"));
    REFUSED("\"seed 0\", but this render has \"seed 3\"", repeat(&other), other.seed = 3, other.has_seed = true);
    REFUSED("\"light_paths 200\"", repeat(&other), other.light_paths = 0);
    REFUSED("the samples are those of the record", repeat(&other), other.samples_per_pixel = 64);
    REFUSED("keeps no checkpoint", repeat(&other), other.checkpoint_path = file("d.part"));
    REFUSED("\"integrator bdpm\", but this render has \"integrator auto\"", repeat(&other), other.integrator = "auto",
            other.light_paths = 0);
    REFUSED("an objective is for numbers", repeat(&other), other.rays_objective = "mean");
    s.checkpoint_path = file("c.part");
    assert_true(render(&s, NULL) == hash); /* it is still there */
}

/* A file of the one kind where the other is wanted. */
static void test_other_files_are_refused(void **state)
{
    (void)state;
    ca_image_layers *image;
    ca_error error = {""};
    unlink(file("c.part"));
    unlink(file("d.part"));
    ca_render_settings s = kept("bdpm", 64, 1), passes = kept("bdpm", 4, 1);
    render(&s, NULL);
    passes.rays = NULL;
    refuse(&passes, CA_ERROR_FORMAT, "the checkpoint of a render with rays \"auto\"");
    const char *path = file("c.part");
    assert_int_equal(ca_merge_parts(&path, 1, NULL, &image, NULL, &error), CA_ERROR_FORMAT);
    assert_non_null(strstr(error.message, "which has no passes that add up"));
    passes.checkpoint_path = s.checkpoint_path = file("d.part");
    render(&passes, NULL);
    refuse(&s, CA_ERROR_FORMAT, "d.part: a part file of passes, not a record of rays \"auto\"");
    repeat(&s);
    s.rays = file("d.part");
    refuse(&s, CA_ERROR_FORMAT, "d.part: a part file of passes");
    s.rays = file("none.part");
    refuse(&s, CA_ERROR_FILE, "none.part");
}

static void write_bytes(const char *path, const unsigned char *bytes, size_t size)
{
    FILE *stream = fopen(path, "wb");
    assert_non_null(stream);
    assert_true(fwrite(bytes, 1, size, stream) == size && fclose(stream) == 0);
}

/* Cut off, and with bits that are others, everywhere. */
static void test_damaged_files(void **state)
{
    (void)state;
    ca_bytes bytes;
    unlink(file("c.part"));
    ca_render_settings s = kept("bdpm", 64, 1);
    const uint64_t hash = render(&s, NULL);
    assert_int_equal(ca_file_read(file("c.part"), "checkpoint", 1 << 24, &bytes, NULL), CA_OK);
    for (size_t size = 0; size < bytes.size; size += size < 64 ? 8 : bytes.size / 7) {
        write_bytes(file("c.part"), bytes.data, size);
        refuse(&s, CA_ERROR_FORMAT, size == 0 ? "not a part file" : "is cut off after");
    }
    for (size_t at = 16; at < bytes.size; at += at < 400 ? 9 : bytes.size / 11) {
        bytes.data[at] ^= 4;
        write_bytes(file("c.part"), bytes.data, bytes.size);
        refuse(&s, CA_ERROR_FORMAT, at < 24 ? "this part file is" : "is damaged");
        bytes.data[at] ^= 4;
    }
    write_bytes(file("c.part"), bytes.data, bytes.size);
    assert_true(render(&s, NULL) == hash);
    ca_bytes_destroy(&bytes);
}

/* ---- All of it ------------------------------------------------------------------------------------------------- */

static int set_up(void **state)
{
    (void)state;
    if (!mkdtemp(folder)) return -1;
    scene = auto_bias_scene();
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    unlink(file("c.part"));
    unlink(file("d.part"));
    ca_scene_release(scene);
    return rmdir(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_goes_on_from_anywhere),      cmocka_unit_test(test_connected_goes_on_from_anywhere),
        cmocka_unit_test(test_chosen_method_goes_on),      cmocka_unit_test(test_stopped_anywhere),
        cmocka_unit_test(test_stopped_within),             cmocka_unit_test(test_unfinished_choice_is_not_kept),
        cmocka_unit_test(test_more_samples),               cmocka_unit_test(test_all_is_kept),
        cmocka_unit_test(test_connected_estimates_are_kept),
        cmocka_unit_test(test_time_and_noise),             cmocka_unit_test(test_counts),
        cmocka_unit_test(test_other_settings_are_refused), cmocka_unit_test(test_other_files_are_refused),
        cmocka_unit_test(test_damaged_files),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
