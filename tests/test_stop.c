/* Work that is stopped at any moment ends soon. Renders: the image is that of whole passes, to the bit, whatever the
 * method. Pictures that are compared, loaded and saved, and scenes that are loaded: nothing half done is left. */
#define _POSIX_C_SOURCE 200809L
#include "base/clock.h"
#include "base/loading.h"
#include "base/memory.h"
#include "geometry/accel.h"
#include "integrator/integrator.h"
#include "support/scene_text.h"
#include "support/test_random.h"

#include <math.h>
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

/* A box with a lamp and a glass ball, where every technique finds something. */
static const char *const box =
    "<scene version='3.0.0'><sensor type='perspective'><transform name='to_world'>"
    "<lookat origin='0,0,0.97' target='0,0,0' up='0,1,0'/></transform><float name='fov' value='80'/>"
    "<film type='hdrfilm'><integer name='width' value='72'/><integer name='height' value='54'/></film></sensor>"
    "<shape type='cube'><bsdf type='twosided'><bsdf type='diffuse'/></bsdf></shape>"
    "<shape type='sphere'><point name='center' x='0.3' y='-0.5' z='0'/><float name='radius' value='0.4'/>"
    "<bsdf type='dielectric'/></shape>"
    "<shape type='rectangle'><transform name='to_world'><scale value='0.3'/><rotate x='1' angle='90'/>"
    "<translate y='0.95'/></transform><emitter type='area'/></shape></scene>";

/* Light of 1 from everywhere, and nothing else: whatever is complete is 1. */
static const char *const even =
    "<scene version='3.0.0'><sensor type='perspective'><film type='hdrfilm'><integer name='width' value='200'/>"
    "<integer name='height' value='150'/><rfilter type='box'/></film></sensor><emitter type='constant'/></scene>";

enum { THREADS = 2 };

/* ---- Stopping in the middle ------------------------------------------------------------------------------------ */

/* Sets the number some time after so many passes, from another thread; without a delay at once, from this one. */
typedef struct stopper {
    int stop;
    uint32_t passes; /* after these; 0: from the beginning */
    double delay;
    bool started;
    pthread_t thread;
    double asked_at; /* by the clock */
    double work_at;  /* processor seconds then */
} stopper;

static double processor_seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static void *wait_and_stop(void *user)
{
    stopper *s = user;
    const struct timespec delay = {.tv_sec = (time_t)s->delay, .tv_nsec = (long)(1e9 * fmod(s->delay, 1.0))};
    nanosleep(&delay, NULL);
    s->asked_at = ca_clock_seconds();
    s->work_at = processor_seconds();
    __atomic_store_n(&s->stop, 1, __ATOMIC_RELAXED);
    return NULL;
}

static void start(stopper *s)
{
    s->started = true;
    if (s->delay == 0.0)
        wait_and_stop(s);
    else
        assert_int_equal(pthread_create(&s->thread, NULL, wait_and_stop, s), 0);
}

static bool after_passes(const ca_render_progress *progress, void *user)
{
    stopper *s = user;
    if (progress->passes_done == s->passes && !s->started) start(s);
    return true;
}

static ca_render_settings settings_of(const char *integrator, stopper *s)
{
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.integrator = integrator;
    settings.threads = THREADS;
    settings.max_depth = 8;
    settings.has_max_depth = true;
    settings.samples_per_pixel = 1000000;
    if (s) {
        settings.progress = after_passes;
        settings.progress_user = s;
        settings.stop = &s->stop;
    }
    return settings;
}

/* Ends within this time: on a loaded machine and with sanitizers, too. */
#define SOON 2.0
/* What is promised, of which the time of other processes is no part: seconds of all threads' processors. */
#define PROMISED (0.5 * THREADS)

/* What it took of processors, however many others want them. */
static ca_status finish_work(stopper *s, ca_status status)
{
    const double work = processor_seconds();
    if (!s->started) fail_msg("never asked to stop: %s", ca_status_name(status));
    if (s->delay > 0.0) pthread_join(s->thread, NULL);
    printf("ended after %.0f ms of work\n", 1e3 * (work - s->work_at));
#ifdef NDEBUG
    if (work - s->work_at > PROMISED) fail_msg("worked for %g s after it was asked to end", work - s->work_at);
#endif
    return status;
}

static ca_status finish(stopper *s, ca_status status)
{
    const double now = ca_clock_seconds();
    finish_work(s, status);
    if (now - s->asked_at > SOON) fail_msg("ended %g s after it was asked to", now - s->asked_at);
    return status;
}

/* ---- Whole passes ---------------------------------------------------------------------------------------------- */

static void expect_same_counts(const ca_render_statistics *a, const ca_render_statistics *b)
{
    assert_true(a->iterations == b->iterations && a->samples_per_pixel == b->samples_per_pixel);
    assert_true(a->light_paths == b->light_paths && a->camera_paths == b->camera_paths);
    assert_true(a->rays == b->rays && a->shadow_rays == b->shadow_rays && a->photons == b->photons);
    assert_true(a->photons_tested == b->photons_tested && a->merges == b->merges);
    assert_memory_equal(a->non_finite_from, b->non_finite_from, sizeof a->non_finite_from);
}

/* As many passes as the stopped render has, made without stopping. */
static void expect_whole_passes(const ca_scene *scene, const ca_render_settings *stopped,
                                const ca_image_layers *image, const ca_render_statistics *statistics)
{
    ca_render_settings settings = *stopped;
    ca_render_statistics s = {.size = sizeof s};
    ca_image_layers *whole;
    settings.samples_per_pixel = (uint32_t)statistics->samples_per_pixel;
    if (statistics->blocks[1] > 0) {
        settings.samples_per_pixel = 0;
        settings.has_blocks = true;
        settings.blocks[1] = statistics->blocks[1];
    }
    settings.progress = NULL;
    settings.stop = NULL;
    assert_int_equal(ca_render(scene, &settings, &whole, &s, NULL), CA_OK);
    if (image_hash(image) != image_hash(whole)) fail_msg("%s: a part of a pass is in the image", settings.integrator);
    expect_same_counts(&s, statistics);
    ca_image_release(whole);
}

static void stop_in_pass(const ca_scene *scene, const char *integrator, double delay)
{
    stopper s = {.passes = 1, .delay = delay};
    const ca_render_settings settings = settings_of(integrator, &s);
    ca_image_layers *image;
    ca_render_statistics statistics = {.size = sizeof statistics};
    ca_error error = {""};
    const ca_status status = ca_render(scene, &settings, &image, &statistics, &error);
    if (status != CA_OK) fail_msg("%s: %s", integrator, error.message);
    finish(&s, status);
    assert_true(statistics.interrupted && statistics.iterations >= 1 && statistics.mean_luminance > 0.0);
    expect_whole_passes(scene, &settings, image, &statistics);
    ca_image_release(image);
}

/* Its pilot would take longer than the passes. */
static const char *with_radius(const ca_integrator_type *type)
{
    static char text[64];
    ca_integrator_input input = {0};
    const bool merges = ca_integrator_value(type, &input, "radius", -1.0) >= 0.0;
    snprintf(text, sizeof text, "%s%s", type->name, merges ? ":radius=0.05" : "");
    return text;
}

static void test_every_integrator(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(box);
    const ca_integrator_type *type;
    for (size_t i = 0; (type = ca_integrator_at(i)) != NULL; i++)
        if (!ca_integrator_has(type, CA_ABILITY_CHOOSES)) stop_in_pass(scene, with_radius(type), 0.003);
    static const char *const others[] = {"qmcppm:join=connect,light_paths=200", "ppm:radius=0.05,camera_paths=3",
                                         "path:next_event=false"};
    for (size_t i = 0; i < sizeof others / sizeof others[0]; i++) stop_in_pass(scene, others[i], 0.004);
    ca_scene_release(scene);
}

/* Light paths in rounds, and samples that are kept between them. */
static void test_rounds(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(box);
    stopper s = {.passes = 1, .delay = 0.02};
    ca_render_settings settings = settings_of("vcm:light_paths=200000", &s);
    ca_image_layers *image;
    ca_render_statistics statistics = {.size = sizeof statistics};
    settings.memory_mib = 70.0;
    assert_int_equal(finish(&s, ca_render(scene, &settings, &image, &statistics, NULL)), CA_OK);
    expect_whole_passes(scene, &settings, image, &statistics);
    ca_image_release(image);
    ca_scene_release(scene);
}

/* Late in the next pass, when pictures have got most of it: it takes as long as the last one. */
static bool within_a_pass(const ca_render_progress *progress, void *user)
{
    stopper *s = user;
    const double now = ca_clock_seconds();
    if (progress->passes_done + 1 == s->passes) s->asked_at = now;
    if (progress->passes_done == s->passes) s->delay = 0.75 * (now - s->asked_at);
    return after_passes(progress, user);
}

static void test_pictures_of_techniques(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(box);
    stopper s = {.passes = 2};
    ca_render_settings settings = settings_of("vcm", &s);
    ca_image_layers *image;
    ca_render_statistics statistics = {.size = sizeof statistics};
    settings.max_depth = 3;
    settings.width = 240;
    settings.height = 180;
    settings.progress = within_a_pass;
    settings.strategies_directory = CA_BUILD_DIR "/tests/stop-techniques";
    assert_int_equal(system("rm -rf " CA_BUILD_DIR "/tests/stop-*"), 0);
    assert_int_equal(finish(&s, ca_render(scene, &settings, &image, &statistics, NULL)), CA_OK);
    settings.strategies_directory = CA_BUILD_DIR "/tests/stop-whole";
    expect_whole_passes(scene, &settings, image, &statistics);
    assert_int_equal(system("cd " CA_BUILD_DIR "/tests && for f in stop-whole/*.exr; do "
                            "cmp $f stop-techniques/${f#*/} || exit 1; done && rm -r stop-whole stop-techniques"),
                     0);
    ca_image_release(image);
    ca_scene_release(scene);
}

static void test_noise(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(box);
    stopper s = {.passes = 2, .delay = 0.01};
    ca_render_settings settings = settings_of("bdpm", &s);
    ca_image_layers *image, *whole;
    ca_noise *noise;
    ca_render_statistics statistics = {.size = sizeof statistics};
    settings.samples_per_pixel = 0;
    settings.width = 144;
    settings.height = 108;
    settings.light_paths = 2000;
    settings.camera_paths = 4;
    assert_int_equal(finish(&s, ca_noise_measure(scene, &settings, 100000, &noise, &image, &statistics, NULL)),
                     CA_OK);
    ca_noise_release(noise);
    settings.stop = NULL;
    settings.progress = NULL;
    assert_int_equal(
        ca_noise_measure(scene, &settings, (uint32_t)statistics.iterations, &noise, &whole, &statistics, NULL),
        CA_OK);
    assert_true(image_hash(image) == image_hash(whole));
    ca_noise_release(noise);
    ca_image_release(image);
    ca_image_release(whole);
    ca_scene_release(scene);
}

/* ---- Pictures -------------------------------------------------------------------------------------------------- */

static ca_image_layers *noisy_picture(uint32_t width, uint32_t height)
{
    ca_image_layers *image;
    float *values = malloc((size_t)width * height * sizeof *values);
    ca_test_random random = ca_test_random_seed(width);
    assert_true(values && ca_image_make(width, height, &image, NULL) == CA_OK);
    for (size_t i = 0; i < (size_t)width * height; i++) values[i] = ca_test_random_float(&random);
    for (int c = 0; c < 3; c++)
        assert_int_equal(ca_image_add(image, (const char *[]){"R", "G", "B"}[c], values, NULL), CA_OK);
    free(values);
    return image;
}

static void test_pictures_are_compared(void **state)
{
    (void)state;
    ca_image_layers *a = noisy_picture(3000, 2000), *b = noisy_picture(3000, 2000);
    ca_image_difference difference;
    for (double delay = 0.02; delay < 2.0; delay *= 50.0) {
        stopper s = {.delay = delay};
        start(&s);
        assert_int_equal(
            finish_work(&s, ca_image_compare_within(a, b, NULL, &s.stop, &difference, NULL)), CA_ERROR_INTERRUPTED);
    }
    ca_image_release(a);
    ca_image_release(b);
}

/* A file that was there stays as it is, and nothing is left beside it. */
static void test_pictures_are_written(void **state)
{
    (void)state;
    static const char *const names[] = {"stop-save/a.exr", "stop-save/a.png", "stop-save/a.pfm"};
    ca_image_layers *image = noisy_picture(3000, 2000), *small = noisy_picture(4, 4), *read;
    char path[4096];
    assert_int_equal(system("rm -rf " CA_BUILD_DIR "/tests/stop-save; mkdir " CA_BUILD_DIR "/tests/stop-save"), 0);
    for (int i = 0; i < 3; i++) {
        snprintf(path, sizeof path, "%s/tests/%s", CA_BUILD_DIR, names[i]);
        assert_int_equal(ca_image_save(small, path, 0.0f, NULL), CA_OK);
        stopper s = {.delay = 0.02};
        start(&s);
        assert_int_equal(finish_work(&s, ca_image_save_until(image, path, 0.0f, &s.stop, NULL)),
                         CA_ERROR_INTERRUPTED);
        assert_int_equal(ca_image_load_until(path, &s.stop, &read, NULL), CA_ERROR_INTERRUPTED);
        assert_null(read);
        uint32_t width, height;
        assert_int_equal(ca_image_load(path, &read, NULL), CA_OK);
        ca_image_size(read, &width, &height);
        assert_true(width == 4 && height == 4);
        ca_image_release(read);
    }
    assert_int_equal(
        system("cd " CA_BUILD_DIR "/tests && test $(ls -A stop-save | wc -l) = 3 && rm -r stop-save"), 0);
    ca_image_release(image);
    ca_image_release(small);
}

/* ---- Numbers of rays that are chosen --------------------------------------------------------------------------- */

/* The image is joined of passes with weights, all of which depend on times; each pixel of each is 1. Returns the
 * iterations that are in it. */
static uint64_t expect_even(const ca_scene *scene, uint32_t passes, double delay)
{
    stopper s = {.passes = passes, .delay = delay};
    ca_render_settings settings = settings_of("bdpm", &s);
    ca_image_layers *image;
    ca_render_statistics statistics = {.size = sizeof statistics};
    ca_error error = {""};
    settings.samples_per_pixel = 0;
    settings.seconds = 1000.0;
    settings.rays = "auto";
    if (passes == 3) settings.light_paths = 500; /* the pilot has no more to find out: its second group begins */
    if (finish(&s, ca_render(scene, &settings, &image, &statistics, &error)) != CA_OK) fail_msg("%s", error.message);
    assert_true(statistics.interrupted);
    uint32_t width, height;
    ca_image_size(image, &width, &height);
    const float *red = ca_image_channel(image, "R"), *samples = ca_image_channel(image, "Rays.Camera");
    for (size_t i = 0; i < (size_t)width * height; i++) {
        if (!(fabsf(red[i] - 1.0f) < 1e-5f)) fail_msg("pixel %zu is %g after %u passes", i, (double)red[i], passes);
        assert_true((double)samples[i] == statistics.samples_per_pixel);
    }
    ca_image_release(image);
    return statistics.iterations;
}

static void test_rays_auto(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(even);
    for (uint32_t passes = 2; passes < 8; passes += passes == 3 ? 4 : 1) expect_even(scene, passes, 0.001);
    assert_int_equal(expect_even(scene, 3, 0.0), 2); /* one half of the pilot's second group has no iteration */
    ca_scene_release(scene);
}

/* ---- Before there is an image ---------------------------------------------------------------------------------- */

static void expect_nothing(const ca_scene *scene, const char *integrator, double delay)
{
    stopper s = {.delay = delay};
    ca_render_settings settings = settings_of(integrator, &s);
    ca_image_layers *image;
    ca_error error = {""};
    settings.width = 2000;
    settings.height = 1500;
    start(&s);
    assert_int_equal(finish(&s, ca_render(scene, &settings, &image, NULL, &error)), CA_ERROR_INTERRUPTED);
    assert_null(image);
    assert_true(strncmp(error.message, "ended before", 12) == 0);
}

/* In the pilots of the radius, of techniques and of the method, in light paths, in camera paths. */
static void test_without_a_whole_pass(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(box);
    for (double delay = 0.0; delay < 0.3; delay = 2.0 * delay + 0.02) {
        expect_nothing(scene, "auto", delay);
        expect_nothing(scene, "vavcm", delay);
    }
    expect_nothing(scene, "path", 0.05);
    expect_nothing(scene, "qmcppm", 0.2);
    stopper s = {.stop = 1};
    const ca_render_settings settings = settings_of("bdpm", &s);
    ca_preflight preflight;
    assert_int_equal(ca_preflight_make(scene, &settings, &preflight, NULL), CA_ERROR_INTERRUPTED);
    ca_scene_release(scene);
}

/* A single task that takes for ever: very many photons around every point. */
static void test_within_a_task(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(box);
    stopper s = {.delay = 2.0};
    ca_render_settings settings = settings_of("vcm:radius=2,light_paths=500000", &s);
    ca_image_layers *image;
    settings.width = 32;
    settings.height = 32;
    start(&s);
    assert_int_equal(finish(&s, ca_render(scene, &settings, &image, NULL, NULL)), CA_ERROR_INTERRUPTED);
    ca_scene_release(scene);
}

/* An image of a megapixel with error bars, which is made before the render ends; and memory for one of 16, of which
 * nothing was made yet. */
static void test_large_images(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(even);
    stopper s = {.passes = 9, .delay = 0.01};
    ca_render_settings settings = settings_of("path", &s);
    ca_image_layers *image;
    ca_render_statistics statistics = {.size = sizeof statistics};
    settings.width = 1280;
    settings.height = 800;
    assert_int_equal(finish_work(&s, ca_render(scene, &settings, &image, &statistics, NULL)), CA_OK);
    assert_true(statistics.iterations >= 9 && statistics.has_confidence);
    ca_image_release(image);
    s = (stopper){.delay = 0.05};
    settings.width = 5000;
    settings.height = 3200;
    start(&s);
    assert_int_equal(finish_work(&s, ca_render(scene, &settings, &image, NULL, NULL)), CA_ERROR_INTERRUPTED);
    ca_scene_release(scene);
}

/* ---- A pass that fails ----------------------------------------------------------------------------------------- */

static bool fail_memory(const ca_render_progress *progress, void *user)
{
    if (progress->passes_done == 2) ca_memory_fail_after(*(const long *)user);
    return true;
}

/* What was made before stays, and the caller is told. */
static void test_out_of_memory_in_a_pass(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(box);
    ca_render_settings settings = settings_of("vcm", NULL);
    ca_image_layers *image;
    ca_render_statistics statistics = {.size = sizeof statistics};
    ca_error error = {""};
    long first = 0;
    settings.progress = fail_memory;
    settings.progress_user = &first;
    settings.seed = 3; /* somewhere a list grows in a later pass */
    settings.has_seed = true;
    settings.samples_per_pixel = 60;
    settings.width = 40;
    settings.height = 30;
    const ca_status status = ca_render(scene, &settings, &image, &statistics, &error);
    ca_memory_fail_after(-1);
    assert_int_equal(status, CA_ERROR_MEMORY);
    assert_non_null(image);
    assert_true(!statistics.interrupted && statistics.iterations >= 2 && statistics.iterations < 60);
    expect_whole_passes(scene, &settings, image, &statistics);
    ca_image_release(image);
    ca_scene_release(scene);
}

/* ---- Without an image ------------------------------------------------------------------------------------------ */

/* The picture of the passes that were made is not wanted, not even where all of them are there. */
static bool discard_after_passes(const ca_render_progress *progress, void *user)
{
    stopper *s = user;
    if (progress->passes_done < s->passes) return true;
    s->asked_at = ca_clock_seconds();
    s->work_at = processor_seconds();
    s->stop = 1;
    return true;
}

static double discard(const ca_scene *scene, const char *integrator, uint32_t passes, uint32_t samples,
                      uint32_t width)
{
    stopper s = {.passes = passes};
    ca_render_settings settings = settings_of(integrator, NULL);
    ca_image_layers *image;
    ca_error error = {""};
    settings.progress = discard_after_passes;
    settings.progress_user = &s;
    settings.discard = &s.stop;
    settings.samples_per_pixel = samples;
    settings.width = width;
    settings.height = width / 2;
    const ca_status status = ca_render(scene, &settings, &image, NULL, &error);
    const double work = processor_seconds() - s.work_at;
    if (status != CA_ERROR_INTERRUPTED) fail_msg("%s: %s, %s", integrator, ca_status_name(status), error.message);
    assert_null(image);
    assert_string_equal(error.message, "ended before it was done");
    return work;
}

static void test_discard(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(even);
    discard(scene, "path", 3, 3, 64);
    discard(scene, "qmcppm:light_paths=100", 1, 1, 32);
    discard(scene, "bdpm:radius=0.1,light_paths=100", 2, 2, 32);
    const double work = discard(scene, "path", 1, 1, 4000);
    printf("8 megapixels discarded after %.0f ms of work\n", 1e3 * work);
#ifdef NDEBUG
    assert_true(work < PROMISED);
#endif
    ca_scene_release(scene);
}

static bool count_passes(const ca_render_progress *progress, void *user)
{
    (void)progress;
    ++*(uint32_t *)user;
    return true;
}

/* Nobody wants anything, but `stop` is not set: a pass is made, and the render ends when it is to be added. */
static void test_discard_before_adding(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(even);
    const int asked = 1;
    uint32_t passes = 0;
    ca_render_settings settings = settings_of("path", NULL);
    ca_image_layers *image;
    settings.progress = count_passes;
    settings.progress_user = &passes;
    settings.discard = &asked;
    settings.samples_per_pixel = 4;
    settings.width = settings.height = 32;
    assert_int_equal(ca_render(scene, &settings, &image, NULL, NULL), CA_ERROR_INTERRUPTED);
    assert_null(image);
    assert_int_equal(passes, 0);
    ca_scene_release(scene);
}

/* ---- Reading --------------------------------------------------------------------------------------------------- */

/* Asks for the end when so much was told; in the thread that reads, so that nothing depends on when others run. */
typedef struct reading_look {
    stopper s;
    uint32_t told, end_at;
} reading_look;

static void count_and_stop(const char *what, double fraction, void *user)
{
    reading_look *look = user;
    (void)what, (void)fraction;
    if (look->told++ != look->end_at) return;
    look->s.work_at = processor_seconds();
    __atomic_store_n(&look->s.stop, 1, __ATOMIC_RELAXED);
}

static ca_status read_until(const char *text, size_t size, const char *path, reading_look *look, ca_error *error)
{
    const ca_scene_source source = {.text = text, .size = size, .path = path, .stop = &look->s.stop};
    ca_scene *scene;
    ca_loading_begin(count_and_stop, look);
    const ca_status status = ca_scene_parse(&source, &scene, error);
    ca_loading_end();
    ca_scene_release(scene);
    return status;
}

enum { GRID = 400, GRID_VERTICES = GRID * GRID, GRID_TRIANGLES = 2 * (GRID - 1) * (GRID - 1) };

/* The rows of a height field: vertices, then triangles, whose indices begin with `first`. */
static void write_rows(FILE *file, const char *vertex, const char *face, unsigned first)
{
    for (unsigned i = 0; i < GRID_VERTICES; i++) fprintf(file, "%s%u %u %u\n", vertex, i % GRID, i / GRID, i * 7 % 5);
    for (unsigned i = 0; i < GRID_VERTICES; i++) {
        const unsigned a = i + first;
        if (i % GRID == GRID - 1 || i / GRID == GRID - 1) continue;
        fprintf(file, "%s%u %u %u\n%s%u %u %u\n", face, a, a + 1, a + GRID, face, a + 1, a + GRID + 1, a + GRID);
    }
}

static void write_mesh(const char *path, bool is_ply)
{
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    if (is_ply)
        fprintf(file, "ply\nformat ascii 1.0\nelement vertex %u\nproperty float x\nproperty float y\n"
                      "property float z\nelement face %u\nproperty list uchar int vertex_indices\nend_header\n",
                (unsigned)GRID_VERTICES, (unsigned)GRID_TRIANGLES);
    write_rows(file, is_ply ? "" : "v ", is_ply ? "3 " : "f ", is_ply ? 0 : 1);
    assert_int_equal(fclose(file), 0);
}

/* Wherever it is asked to end, it does, and soon: it goes no further. There are many such places, of which ever fewer
 * are tried. */
static void expect_ends_everywhere(const char *type)
{
    char text[1024], path[512];
    uint32_t places = 0;
    snprintf(path, sizeof path, CA_BUILD_DIR "/tests/stop-mesh.%s", type);
    write_mesh(path, type[0] == 'p');
    snprintf(text, sizeof text, "<scene version='3.0.0'><sensor type='perspective'/><emitter type='constant'/>"
                                "<shape type='%s'><string name='filename' value='%s'/></shape></scene>", type, path);
    for (;; places += 1 + places / 16) {
        reading_look look = {.end_at = places};
        ca_error error = {""};
        const ca_status status = read_until(text, strlen(text), "stop", &look, &error);
        if (status == CA_OK) break;
        if (status != CA_ERROR_INTERRUPTED) fail_msg("%s: %s", ca_status_name(status), error.message);
        assert_string_equal(error.message, "ended before it was done");
        const double work = processor_seconds() - look.s.work_at;
        if (work > PROMISED) fail_msg("worked for %g s after it was asked to end at place %u", work, places);
        if (look.told > places + 2) fail_msg("asked to end at place %u, it came to place %u", places, look.told - 1);
    }
    printf("%s: ended at %u places\n", type, places);
    assert_true(places > 12);
    assert_int_equal(remove(path), 0);
}

static void test_reading(void **state)
{
    (void)state;
    expect_ends_everywhere("ply");
    expect_ends_everywhere("obj");
}

/* What is wrong at the end of a long text is not found. */
static void expect_end_not_read(const char *path, const char *begin, const char *line, const char *end)
{
    enum { LINES = 9000 };
    const size_t length = strlen(line), size = strlen(begin) + LINES * length + strlen(end);
    char *text = malloc(size + 1), *at = text;
    assert_non_null(text);
    at += sprintf(at, "%s", begin);
    for (int i = 0; i < LINES; i++, at += length) memcpy(at, line, length);
    memcpy(at, end, strlen(end) + 1);
    for (int stop = 0; stop < 2; stop++) {
        reading_look look = {.s = {.stop = stop}, .end_at = UINT32_MAX};
        ca_error error = {""};
        const ca_status status = read_until(text, size, path, &look, &error);
        if (stop ? status != CA_ERROR_INTERRUPTED : status == CA_OK || status == CA_ERROR_INTERRUPTED)
            fail_msg("%s: %s, %s", path, ca_status_name(status), error.message);
    }
    free(text);
}

static void test_texts(void **state)
{
    (void)state;
    expect_end_not_read("stop.xml", "<scene version='3.0.0'>", "<emitter type='point'/>", "</oops>");
    expect_end_not_read("stop.pbrt", "WorldBegin\n", "AttributeBegin\nAttributeEnd\n", "Oops");
}

/* ---- Building -------------------------------------------------------------------------------------------------- */

enum { TRIANGLES = 600000 };

static double build(const ca_shape *shape, const int *stop, ca_status expected)
{
    ca_accel *accel;
    const double start_time = ca_clock_seconds();
    assert_int_equal(ca_accel_create(shape, 1, 1, NULL, 0, THREADS, stop, &accel, NULL), expected);
    ca_accel_destroy(accel);
    return ca_clock_seconds() - start_time;
}

static void test_building(void **state)
{
    (void)state;
    ca_mesh mesh;
    assert_int_equal(ca_mesh_create(&mesh, 3 * (size_t)TRIANGLES, TRIANGLES, false, false, NULL), CA_OK);
    ca_test_random random = ca_test_random_seed(7);
    for (uint32_t v = 0; v < mesh.vertex_count; v++) {
        mesh.indices[v] = v;
        for (int c = 0; c < 3; c++) {
            const bool is_first = v % 3 == 0;
            const float first = is_first ? 0.0f : mesh.positions[3 * (size_t)(v - v % 3) + (size_t)c];
            mesh.positions[3 * (size_t)v + (size_t)c] =
                first + ca_test_random_float(&random) * (is_first ? 1.0f : 0.01f);
        }
    }
    const ca_shape shape = {.kind = CA_SHAPE_MESH, .as.mesh.mesh = &mesh};
    const double whole = build(&shape, NULL, CA_OK);
    stopper s = {.delay = 0.02};
    start(&s);
    const double stopped = build(&shape, &s.stop, CA_ERROR_INTERRUPTED);
    pthread_join(s.thread, NULL);
    if (!(stopped < 0.7 * whole)) fail_msg("stopped after %g s of %g", stopped, whole);
    ca_mesh_destroy(&mesh);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_integrator),     cmocka_unit_test(test_rounds),
        cmocka_unit_test(test_pictures_of_techniques), cmocka_unit_test(test_noise),
        cmocka_unit_test(test_pictures_are_compared),
        cmocka_unit_test(test_pictures_are_written),
        cmocka_unit_test(test_rays_auto),            cmocka_unit_test(test_without_a_whole_pass),
        cmocka_unit_test(test_within_a_task),        cmocka_unit_test(test_large_images),
        cmocka_unit_test(test_out_of_memory_in_a_pass),
        cmocka_unit_test(test_discard),              cmocka_unit_test(test_discard_before_adding),
        cmocka_unit_test(test_reading),              cmocka_unit_test(test_texts),
        cmocka_unit_test(test_building),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
