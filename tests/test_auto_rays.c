/* Renders that choose their numbers of rays: how parts are joined, what is refused, maps in files, ends of all kinds;
 * and a short form of tests/long_auto_rays.c. */
#include "base/memory.h"
#include "noise/ray_map.h"
#include "render/auto_rays.h"
#include "support/auto_bias.h"
#include "support/scene_text.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

enum { SIDE = AUTO_BIAS_SIDE, PIXELS = SIDE * SIDE };

static ca_render_settings settings_auto(uint32_t samples)
{
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.rays = "auto";
    settings.samples_per_pixel = samples;
    settings.threads = 1;
    return settings;
}

static void assert_near(double value, double expected, double tolerance)
{
    if (!(fabs(value - expected) <= tolerance)) fail_msg("%.10g instead of %.10g", value, expected);
}

/* ---- The joined film ------------------------------------------------------------------------------------------- */

static ca_film film_of(const float *greens, uint32_t count)
{
    static const uint32_t crop[4] = {0, 0, 1, 1};
    ca_film film;
    assert_int_equal(ca_film_create(&film, 1, 1, crop, NULL), CA_OK);
    for (uint32_t i = 0; i < count; i++) {
        const ca_film_sample sample = {
            .radiance = {0.0f, greens[i], 0.0f}, .filter_weight = 1.0f, .albedo = {0.5f, 0.0f, 0.0f}};
        assert_true(ca_film_add(&film, 0, 0, &sample));
    }
    return film;
}

static void test_joined_film(void **state)
{
    (void)state;
    ca_film a = film_of((const float[]){1.0f, 3.0f}, 2), b = film_of((const float[]){6.0f}, 1),
            c = film_of((const float[]){2.0f}, 1);
    ca_film out = film_of(NULL, 0);
    ca_joined_film joined;
    assert_int_equal(ca_joined_film_create(&joined, &a, NULL), CA_OK);
    ca_joined_film_add(&joined, &a, 2.0);                   /* mean 2, s^2 = 2, n = 2 */
    ca_joined_film_scale(&joined, 0.25);                    /* weight 0.5 */
    ca_joined_film_add_two(&joined, &b, 0.375, &c, 0.125);  /* 6 and 2: s^2 = 8, n = 1 each */
    const ca_joined_pixel *pixel = &joined.pixels[0];
    assert_near(pixel->mean[1], 0.5 * 2.0 + 0.375 * 6.0 + 0.125 * 2.0, 1e-12);
    const double variance = 0.25 * 2.0 / 2.0 + (0.375 * 0.375 + 0.125 * 0.125) * 8.0;
    assert_near(pixel->variance[1], variance, 1e-12);
    assert_near(pixel->luminance_variance, 0.7152 * 0.7152 * variance, 1e-12);
    assert_near((double)pixel->albedo[0], 0.5, 1e-6);
    ca_image_layers *image;
    assert_int_equal(ca_joined_film_develop(&joined, 7, &out, 2, &image, NULL), CA_OK);
    assert_near((double)ca_image_channel(image, "G")[0], 3.5, 1e-6);
    assert_near((double)ca_image_channel(image, "Variance.G")[0] / (double)ca_image_channel(image, "Samples.Y")[0],
                variance, 1e-6);
    assert_near((double)ca_image_channel(image, "StandardDeviation.Y")[0], 0.7152 * sqrt(7.0 * variance), 1e-6);
    assert_near((double)ca_image_channel(image, "Albedo.R")[0], 0.5, 1e-6);
    ca_image_release(image);
    ca_film_destroy(&a);
    ca_film_destroy(&b);
    ca_film_destroy(&c);
    ca_film_destroy(&out);
    ca_joined_film_destroy(&joined);
}

/* Two groups of two halves, joined once their weights are known: as if the four films had been added with them. */
static void test_halved_film(void **state)
{
    (void)state;
    static const float greens[4][6] = {{1, 3, 4}, {6, 2, 5}, {2, 9}, {7, 1}};
    static const double share[2] = {0.3, 0.7}, weights[3][2] = {{0.5, 0.5}, {0.4, 0.15}, {0.0, 0.25}};
    ca_film films[4], out = film_of(NULL, 0);
    for (int k = 0; k < 4; k++) films[k] = film_of(greens[k], k < 2 ? 3 : 2);
    ca_halved_film halved;
    assert_int_equal(ca_halved_film_create(&halved, &out, NULL), CA_OK);
    ca_halved_film_add(&halved, &films[0], &films[1], 1.0);
    ca_halved_film_scale(&halved, share[0]);
    ca_halved_film_add(&halved, &films[2], &films[3], share[1]);
    assert_near(ca_halved_film_mean(&halved, 0, 0, 1), 0.3 * 8.0 / 3.0 + 0.7 * 5.5, 1e-6);
    assert_near(ca_halved_film_mean(&halved, 0, 1, 1), 0.3 * 13.0 / 3.0 + 0.7 * 4.0, 1e-6);
    for (int k = 0; k < 3; k++) {
        const double a = weights[k][0], b = weights[k][1];
        ca_joined_film joined, expected;
        assert_int_equal(ca_joined_film_create(&joined, &out, NULL), CA_OK);
        assert_int_equal(ca_joined_film_create(&expected, &out, NULL), CA_OK);
        ca_halved_film_join(&halved, a, b, &joined);
        ca_joined_film_add_two(&expected, &films[0], a * share[0], &films[1], b * share[0]);
        ca_joined_film_add_two(&expected, &films[2], a * share[1], &films[3], b * share[1]);
        const ca_joined_pixel *p = &joined.pixels[0], *q = &expected.pixels[0];
        assert_near(p->mean[1], q->mean[1], 1e-6); /* a float's part in it */
        assert_near(p->variance[1], q->variance[1], 1e-12);
        assert_near(p->luminance_variance, q->luminance_variance, 1e-12);
        for (int c = 0; c < 4; c++) assert_near(p->third[c], q->third[c], 1e-12);
        assert_near(p->scatter[1], q->scatter[1], 1e-12);
        assert_near((double)p->albedo[0], (double)q->albedo[0], 1e-6);
        assert_int_equal(p->samples, q->samples);
        const ca_joined_sums sums = ca_halved_film_sums(&halved, a, b), whole = ca_joined_sums_of(&expected);
        assert_near(sums.luminance, whole.luminance, 1e-6);
        assert_near(sums.variance, whole.variance, 1e-12);
        ca_joined_film_destroy(&joined);
        ca_joined_film_destroy(&expected);
    }
    ca_halved_film_destroy(&halved);
    for (int k = 0; k < 4; k++) ca_film_destroy(&films[k]);
    ca_film_destroy(&out);
}

/* The noise of an image is known from sums over its parts. */
static void test_sums_of_parts(void **state)
{
    (void)state;
    ca_film a = film_of((const float[]){1.0f, 3.0f, 8.0f}, 3), b = film_of((const float[]){6.0f, 2.0f, 7.0f}, 3);
    ca_joined_film joined;
    assert_int_equal(ca_joined_film_create(&joined, &a, NULL), CA_OK);
    ca_joined_film_add(&joined, &a, 0.25);
    ca_joined_film_add_two(&joined, &a, 0.5 * 0.75, &b, 0.5 * 0.75);
    const ca_joined_sums whole = ca_joined_sums_of(&joined);
    ca_joined_sums sums = ca_joined_sums_add((ca_joined_sums){0}, ca_joined_sums_of_film(&a), 0.25);
    sums = ca_joined_sums_add(sums, ca_joined_sums_of_two(&a, &b), 0.75);
    assert_near(sums.luminance, whole.luminance, 1e-12);
    assert_near(sums.variance, whole.variance, 1e-12);
    const ca_film_summary summary = ca_joined_film_summarise(&joined, 6, &a);
    assert_near(sqrt(sums.variance) / sums.luminance, summary.noise, 1e-12);
    ca_film_clear(&a);
    assert_true(a.pixels[0].samples == 0 && a.pixels[0].sum[1] == 0.0);
    ca_joined_film_destroy(&joined);
    ca_film_destroy(&a);
    ca_film_destroy(&b);
}

/* ---- Maps in files --------------------------------------------------------------------------------------------- */

static const ca_ray_map_place place = {.full_width = 5, .full_height = 4, .crop = {1, 1, 4, 3}};

static ca_image_layers *map_image(uint32_t light_paths)
{
    static const uint32_t numbers[6] = {1, 2, 3, 400, 5, 65536};
    ca_image_layers *image;
    assert_int_equal(ca_layers_create(&image, 3, 2, NULL), CA_OK);
    image->full_width = 5;
    image->full_height = 4;
    image->x0 = image->y0 = 1;
    assert_int_equal(ca_ray_map_add(image, light_paths, numbers, NULL), CA_OK);
    return image;
}

static void assert_map_refused(ca_image_layers *image, const ca_ray_map_place *where, ca_status status,
                               const char *says)
{
    uint32_t light_paths, *numbers;
    ca_error error = {""};
    assert_int_equal(ca_ray_map_of(image, "x.exr", where, &light_paths, &numbers, &error), status);
    assert_null(numbers);
    if (!strstr(error.message, says)) fail_msg("says: %s", error.message);
}

static void test_ray_map(void **state)
{
    (void)state;
    ca_image_layers *image = map_image(1073741824u);
    uint32_t light_paths, *numbers;
    assert_int_equal(ca_ray_map_of(image, "x.exr", &place, &light_paths, &numbers, NULL), CA_OK);
    assert_int_equal(light_paths, 1073741824u);
    assert_true(numbers[0] == 1 && numbers[3] == 400 && numbers[5] == 65536);
    ca_free(numbers);
    ca_ray_map_place other = place;
    other.full_width = 6;
    assert_map_refused(image, &other, CA_ERROR_ARGUMENT,
                       "part 1,1,4,3 of a film of 5 x 4 pixels, not for 1,1,4,3 of 6 x 4");
    other = place;
    other.crop[0] = 0;
    assert_map_refused(image, &other, CA_ERROR_ARGUMENT, "not for 0,1,4,3");
    static const char *const wrong[] = {"", "0", "-3", "1073741825", "12x", "1e3"};
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        assert_int_equal(ca_layers_set_text(image, CA_RAY_MAP_LIGHT_PATHS, wrong[i], NULL), CA_OK);
        assert_map_refused(image, &place, CA_ERROR_FORMAT, "no number of 1 to 1073741824 light paths");
    }
    assert_int_equal(ca_layers_set_text(image, CA_RAY_MAP_LIGHT_PATHS, "7", NULL), CA_OK);
    static const float bad[] = {0.0f, 1.5f, -1.0f, 65537.0f, NAN, INFINITY};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        image->channels[0].data[4] = bad[i];
        assert_map_refused(image, &place, CA_ERROR_FORMAT, "at pixel 1,1");
    }
    ca_image_release(image);
    assert_int_equal(ca_layers_create(&image, 3, 2, NULL), CA_OK);
    assert_map_refused(image, &place, CA_ERROR_FORMAT, "no layer \"Rays.Numbers\"");
    ca_image_release(image);
}

/* A render's file is rendered with again: bit for bit with any number of threads, with as many camera paths as it
 * says. */
static void test_rays_of_a_file(void **state)
{
    (void)state;
    ca_scene *scene = auto_bias_scene();
    char path[64];
    snprintf(path, sizeof path, "/tmp/caustica-rays-%ld.exr", (long)getpid());
    ca_render_settings settings = settings_auto(32);
    ca_image_layers *image = render_scene(scene, &settings);
    assert_int_equal(ca_image_save(image, path, 0.0f, NULL), CA_OK);
    uint64_t hashes[2];
    settings.rays = path;
    for (int i = 0; i < 2; i++) {
        ca_render_statistics statistics = {.size = sizeof statistics};
        ca_image_layers *again;
        settings.threads = i == 0 ? 1 : 3;
        assert_int_equal(ca_render(scene, &settings, &again, &statistics, NULL), CA_OK);
        hashes[i] = image_hash(again);
        double camera_paths = 0.0;
        for (int p = 0; p < PIXELS; p++) {
            assert_true(ca_image_channel(again, "Rays.Numbers")[p] == ca_image_channel(image, "Rays.Numbers")[p]);
            camera_paths += (double)ca_image_channel(again, "Rays.Camera")[p];
        }
        assert_true(camera_paths == (double)statistics.camera_paths && statistics.samples_per_pixel >= 32.0);
        assert_true(statistics.light_paths == statistics.iterations * statistics.numbers_of_rays.light_paths);
        ca_image_release(again);
    }
    assert_true(hashes[0] == hashes[1]);
    ca_image_release(image);
    ca_error error;
    settings.width = 24;
    settings.height = 24;
    assert_int_equal(ca_render(scene, &settings, &image, NULL, &error), CA_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, "not for 0,0,24,24"));
    unlink(path);
    assert_int_equal(ca_render(scene, &settings, &image, NULL, &error), CA_ERROR_FILE);
    ca_scene_release(scene);
}

/* The components in an image of rays "auto" are those of an iteration with its numbers: their sum is the variance
 * that such iterations have. */
static void test_components(void **state)
{
    (void)state;
    ca_scene *scene = auto_bias_scene();
    char path[64];
    snprintf(path, sizeof path, "/tmp/caustica-rays-%ld.exr", (long)getpid());
    ca_render_settings settings = settings_auto(2000);
    ca_image_layers *image = render_scene(scene, &settings);
    assert_int_equal(ca_image_save(image, path, 0.0f, NULL), CA_OK);
    settings.rays = path;
    settings.has_alpha = true; /* 0: as in the render that chose */
    settings.samples_per_pixel = 20000;
    ca_image_layers *again = render_scene(scene, &settings);
    double expected = 0.0, measured = 0.0;
    for (int p = 0; p < PIXELS; p++) {
        const double deviation = (double)ca_image_channel(again, "StandardDeviation.Y")[p];
        measured += deviation * deviation;
        expected += (double)(ca_image_channel(image, "Noise.Camera")[p] + ca_image_channel(image, "Noise.Light")[p] +
                             ca_image_channel(image, "Noise.Pair")[p]);
    }
    print_message("    components over the variance measured afterwards: %.3f\n", expected / measured);
    assert_true(fabs(expected / measured - 1.0) < 0.25);
    ca_image_release(image);
    ca_image_release(again);
    unlink(path);
    ca_scene_release(scene);
}

/* ---- What is refused ------------------------------------------------------------------------------------------- */

static void assert_refused(const ca_scene *scene, const ca_render_settings *settings, const char *says)
{
    ca_image_layers *image = NULL;
    ca_error error = {""};
    const ca_status status = ca_render(scene, settings, &image, NULL, &error);
    if (status != CA_ERROR_ARGUMENT || !strstr(error.message, says))
        fail_msg("status %d, says: %s", (int)status, error.message);
    assert_null(image);
}

static void test_refusals(void **state)
{
    (void)state;
    ca_scene *scene = auto_bias_scene();
    ca_render_settings settings = settings_auto(27);
    assert_refused(scene, &settings, "its pilot has 14, so at least 28 are needed");
    settings = settings_auto(32);
    settings.integrator = "cavcm";
    assert_refused(scene, &settings, "vavcm and auto, not for cavcm");
    settings.integrator = "vcm:light_paths=3,camera_paths=4";
    assert_refused(scene, &settings, "needs as many light paths, not 3");
    settings.integrator = "vcm";
    settings.rays_objective = "worst-decile";
    assert_refused(scene, &settings, "not for the worst decile");
    settings.rays_objective = NULL;
    settings.integrator = "ppm:camera_paths=2";
    assert_refused(scene, &settings, "ppm has one camera path");
    settings.integrator = "bdpm:alpha=0.5";
    assert_refused(scene, &settings, "alpha must be 0");
    settings.integrator = "bdpm:camera_paths=1";
    assert_refused(scene, &settings, "at least 2 camera paths");
    settings.integrator = NULL;
    settings.light_paths = 1;
    assert_refused(scene, &settings, "it needs at least 2, not 1");
    settings.light_paths = 0;
    settings.sampler = "sobol";
    assert_refused(scene, &settings, "not \"sobol\"");
    settings.sampler = NULL;
    settings.rays_objective = "best";
    assert_refused(scene, &settings, "there are mean, relative, worst-decile");
    settings.rays = NULL;
    settings.rays_objective = "mean";
    assert_refused(scene, &settings, "with rays \"auto\" only");
    settings.rays = "x.exr";
    settings.rays_objective = NULL;
    settings.camera_paths = 3;
    assert_refused(scene, &settings, "they cannot be set as well");
    settings = settings_auto(32);
    settings.memory_mib = 0.07; /* the film needs 0.018, all together 0.077 */
    assert_refused(scene, &settings, "the films and estimates of rays \"auto\" need");
    ca_scene_release(scene);
}

/* ---- Joining --------------------------------------------------------------------------------------------------- */

typedef struct checked_image {
    double green[PIXELS];
    uint32_t seen;
} checked_image;

/* The formula of auto_rays.h once more: what A weighs is B and the other way round. */
static void join_again(const ca_auto_parts *parts, void *user)
{
    checked_image *checked = user;
    const double *w = parts->weights;
    assert_true((parts->render != NULL) == (parts->render_iterations > 0));
    if (!parts->render) assert_true(w[0] == 0.0 && w[1] == 0.0);
    for (int p = 0; p < PIXELS; p++) {
        double value = parts->render ? 0.5 * (w[0] + w[1]) * parts->render->pixels[p].mean[1] : 0.0;
        for (int h = 0; h < CA_PILOT_HALVES; h++)
            value += 0.5 * (1.0 - w[1 - h]) * ca_halved_film_mean(parts->pilot, (size_t)p, h, 1);
        checked->green[p] = value;
    }
    checked->seen++;
}

static void render_and_check(const ca_scene *scene, const ca_render_settings *settings,
                             ca_render_statistics *statistics)
{
    checked_image checked = {.seen = 0};
    const ca_auto_observer observer = {join_again, &checked};
    ca_render_plan plan;
    ca_image_layers *image;
    ca_error error = {""};
    if (ca_render_plan_make(&plan, scene, settings, &error) != CA_OK) fail_msg("%s", error.message);
    if (ca_auto_rays_render(&plan, &observer, &image, statistics, &error) != CA_OK) fail_msg("%s", error.message);
    double camera_paths = 0.0;
    assert_int_equal(checked.seen, 1);
    for (int p = 0; p < PIXELS; p++) {
        assert_near((double)ca_image_channel(image, "G")[p], checked.green[p], 1e-6 * (1.0 + checked.green[p]));
        assert_true(ca_image_channel(image, "Variance.G")[p] >= 0.0f);
        camera_paths += (double)ca_image_channel(image, "Rays.Camera")[p];
    }
    assert_true((ca_image_channel(image, "Noise.Camera") != NULL) == (statistics->numbers_of_rays.phases > 0));
    assert_true(camera_paths == (double)statistics->camera_paths);
    assert_near(statistics->samples_per_pixel, camera_paths / PIXELS, 1e-6);
    assert_int_equal(statistics->non_finite, 0);
    ca_image_release(image);
}

static void test_joining(void **state)
{
    (void)state;
    static const char *const integrators[] = {NULL, "ppm"}, *const objectives[] = {NULL, "relative", "worst-decile"};
    ca_scene *scene = auto_bias_scene();
    for (int i = 0; i < 6; i++) {
        ca_render_settings settings = settings_auto(i % 2 == 0 ? 60 : 32);
        ca_render_statistics statistics = {.size = sizeof statistics};
        settings.integrator = integrators[i % 2];
        settings.rays_objective = objectives[i / 2];
        render_and_check(scene, &settings, &statistics);
        assert_true(statistics.samples_per_pixel >= settings.samples_per_pixel);
        assert_true(statistics.samples_per_pixel < 1.35 * settings.samples_per_pixel);
        assert_true(statistics.numbers_of_rays.phases >= 1 && statistics.numbers_of_rays.light_path_seconds >= 0.0);
        if (i % 2 == 1) assert_true(statistics.numbers_of_rays.camera_paths == 1.0);
        assert_true(!statistics.interrupted && statistics.noise_percent > 0.0);
    }
    ca_scene_release(scene);
}

typedef struct countdown {
    uint32_t left, calls;
} countdown;

static bool count_down(const ca_render_progress *progress, void *user)
{
    countdown *c = user;
    c->calls++;
    assert_int_equal(progress->passes_done, c->calls);
    return c->calls < c->left;
}

/* Ended anywhere, in the pilot or in a phase: an image of what there is, after two iterations of what is at work at
 * most. */
static void test_interrupts(void **state)
{
    (void)state;
    ca_scene *scene = auto_bias_scene();
    for (uint32_t k = 1; k <= 19; k++) {
        countdown c = {.left = k};
        ca_render_settings settings = settings_auto(200);
        ca_render_statistics statistics = {.size = sizeof statistics};
        settings.light_paths = 50;
        settings.progress = count_down;
        settings.progress_user = &c;
        render_and_check(scene, &settings, &statistics);
        assert_true(statistics.interrupted && statistics.iterations >= k && statistics.iterations <= k + 1);
        assert_true((statistics.numbers_of_rays.phases == 0) == (k <= 14)); /* an eighth of the samples */
    }
    ca_scene_release(scene);
}

static void test_time(void **state)
{
    (void)state;
    ca_scene *scene = auto_bias_scene();
    ca_render_settings settings = settings_auto(0);
    ca_render_statistics statistics = {.size = sizeof statistics};
    settings.seconds = 0.4;
    render_and_check(scene, &settings, &statistics);
    assert_true(statistics.seconds >= 0.4 && statistics.first_predicted_seconds == 0.0);
    ca_scene_release(scene);
}

/* A target that the pilot reaches ends the render; else its time is predicted. */
static void test_noise(void **state)
{
    (void)state;
    ca_scene *scene = auto_bias_scene();
    ca_render_settings settings = settings_auto(0);
    ca_render_statistics statistics = {.size = sizeof statistics};
    settings.noise_percent = 25.0;
    render_and_check(scene, &settings, &statistics);
    assert_true(statistics.noise_percent < 25.0 && statistics.noise_percent > 10.0);
    assert_true(statistics.first_predicted_seconds == 0.0 && statistics.numbers_of_rays.phases == 0);
    /* On a fast machine the first targets are reached before a time is predicted. */
    for (settings.noise_percent = 2.0; statistics.first_predicted_seconds == 0.0 && settings.noise_percent > 0.2;
         settings.noise_percent *= 0.7)
        render_and_check(scene, &settings, &statistics);
    settings.noise_percent /= 0.7;
    print_message("    noise %.3g %% after %.3g s; %.3g s were predicted after %.3g s\n", statistics.noise_percent,
                  statistics.seconds, statistics.first_predicted_seconds, statistics.first_predicted_at);
    assert_true(statistics.noise_percent < settings.noise_percent &&
                statistics.noise_percent > 0.8 * settings.noise_percent);
    assert_true(statistics.first_predicted_seconds > statistics.first_predicted_at &&
                statistics.first_predicted_at > 0.0);
    ca_scene_release(scene);
}

/* The variance that layers promise is the one there is. */
static void test_variance_is_what_it_says(void **state)
{
    (void)state;
    enum { RENDERS = 60 };
    static double sum[PIXELS], squares[PIXELS];
    ca_scene *scene = auto_bias_scene();
    double promised = 0.0, measured = 0.0;
    for (uint32_t k = 0; k < RENDERS; k++) {
        ca_render_settings settings = settings_auto(32);
        settings.light_paths = 400;
        settings.has_seed = true;
        settings.seed = 77 + k;
        ca_image_layers *image = render_scene(scene, &settings);
        for (int p = 0; p < PIXELS; p++) {
            const double g = (double)ca_image_channel(image, "G")[p];
            promised += (double)(ca_image_channel(image, "Variance.G")[p] / ca_image_channel(image, "Samples.Y")[p]) /
                        RENDERS;
            sum[p] += g;
            squares[p] += g * g;
        }
        ca_image_release(image);
    }
    for (int p = 0; p < PIXELS; p++) measured += (squares[p] - sum[p] * sum[p] / RENDERS) / (RENDERS - 1);
    print_message("    variance promised over measured: %.3f\n", promised / measured);
    assert_true(fabs(promised / measured - 1.0) < 0.2);
    ca_scene_release(scene);
}

/* Of intervals that are not marked about 95 % hold the expectation, which is the mean of the other renders. */
static void test_error_bars(void **state)
{
    (void)state;
    enum { RENDERS = 50 };
    static double value[RENDERS][PIXELS], low[RENDERS][PIXELS], high[RENDERS][PIXELS], sum[PIXELS];
    static bool widened[RENDERS][PIXELS];
    ca_scene *scene = auto_bias_scene();
    double told = 0.0, held = 0.0;
    for (uint32_t k = 0; k < RENDERS; k++) {
        ca_render_settings settings = settings_auto(600);
        settings.has_seed = true;
        settings.seed = 1234 + k;
        ca_image_layers *image = render_scene(scene, &settings);
        for (int p = 0; p < PIXELS; p++) {
            value[k][p] = (double)ca_image_channel(image, "G")[p];
            low[k][p] = (double)ca_image_channel(image, "ConfidenceLow.G")[p];
            high[k][p] = (double)ca_image_channel(image, "ConfidenceHigh.G")[p];
            widened[k][p] = ca_image_channel(image, "ConfidenceWidened.G")[p] == 1.0f;
            sum[p] += value[k][p];
        }
        ca_image_release(image);
    }
    for (int k = 0; k < RENDERS; k++)
        for (int p = 0; p < PIXELS; p++) {
            const double others = (sum[p] - value[k][p]) / (RENDERS - 1);
            if (isinf(low[k][p]) || widened[k][p]) continue;
            told++;
            held += low[k][p] <= others && others <= high[k][p];
        }
    print_message("    %.1f %% of the ordinary intervals hold the expectation, %.0f %% are others\n",
                  100.0 * held / told, 100.0 - 100.0 * told / (RENDERS * PIXELS));
    assert_true(told > 0.2 * RENDERS * PIXELS);
    assert_true(held > 0.92 * told && held < 0.98 * told);
    ca_scene_release(scene);
}

static void test_no_bias(void **state)
{
    (void)state;
    ca_scene *scene = auto_bias_scene();
    auto_bias_means joined, naive, reference;
    auto_bias_reference(scene, 2500, &reference);
    auto_bias_render(scene, 50, 32, 5000, &joined, &naive);
    assert_true(auto_bias_test("joined", &joined, &reference) < 1.6); /* 4.5 standard errors */
    assert_true(auto_bias_test("joined naively", &naive, &reference) > 1.6);
    ca_scene_release(scene);
}

/* ---- Memory ---------------------------------------------------------------------------------------------------- */

/* Light paths that do not fit are not chosen. */
static void test_memory_limit(void **state)
{
    (void)state;
    ca_scene *scene = auto_bias_scene();
    ca_render_settings settings = settings_auto(32);
    ca_render_statistics statistics = {.size = sizeof statistics};
    settings.memory_mib = 1.5;
    settings.light_paths = 50;
    render_and_check(scene, &settings, &statistics);
    print_message("    %u light paths in 1.5 MiB\n", statistics.numbers_of_rays.light_paths);
    ca_scene_release(scene);
}

/* What is said to fit does so where pairs are measured, too. */
static void test_fits_with_pairs(void **state)
{
    (void)state;
    ca_scene *scene = auto_bias_scene();
    ca_render_settings settings = settings_auto(32);
    settings.memory_mib = 4.0;
    uint32_t fitting = 0, others = 0, paths = 1024;
    for (; paths < 1u << 20; paths += paths / 64) {
        ca_render_plan plan;
        ca_error error;
        bool fits;
        void *integrator;
        assert_int_equal(ca_render_plan_make(&plan, scene, &settings, &error), CA_OK);
        assert_int_equal(ca_render_plan_fits(&plan, paths, &fits, &error), CA_OK);
        others += !fits;
        if (!fits) continue;
        ca_pair_film pairs = {.x0 = plan.crop[0], .y0 = plan.crop[1], .light_paths = paths};
        pairs.width = plan.crop[2] - plan.crop[0];
        pairs.height = plan.crop[3] - plan.crop[1];
        plan.input.pairs = &pairs;
        const ca_status status = plan.type->create(&plan.input, &integrator, &error);
        if (status != CA_OK) fail_msg("%u light paths: %s", paths, error.message);
        plan.type->destroy(integrator);
        fitting++;
    }
    print_message("    %u numbers of light paths fit, %u do not\n", fitting, others);
    assert_true(fitting > 10 && others > 10);
    ca_scene_release(scene);
}

static void test_memory_failures(void **state)
{
    (void)state;
    ca_scene *scene = auto_bias_scene();
    ca_render_settings settings = settings_auto(28);
    settings.light_paths = 20;
    ca_status status = CA_ERROR_MEMORY;
    long count = 0, with_image = 0; /* of the iterations before the one that failed */
    for (; status != CA_OK; count += count < 60 ? 1 : 3) {
        ca_image_layers *image = NULL;
        ca_memory_fail_after(count);
        status = ca_render(scene, &settings, &image, NULL, NULL);
        ca_memory_fail_after(-1);
        assert_true(status == CA_OK || status == CA_ERROR_MEMORY);
        with_image += status == CA_ERROR_MEMORY && image;
        ca_image_release(image);
        assert_true(count < 4000);
    }
    assert_true(count > 60 && with_image > 0);
    ca_scene_release(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_joined_film),
        cmocka_unit_test(test_halved_film),
        cmocka_unit_test(test_sums_of_parts),
        cmocka_unit_test(test_ray_map),
        cmocka_unit_test(test_rays_of_a_file),
        cmocka_unit_test(test_components),
        cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_joining),
        cmocka_unit_test(test_interrupts),
        cmocka_unit_test(test_time),
        cmocka_unit_test(test_noise),
        cmocka_unit_test(test_variance_is_what_it_says),
        cmocka_unit_test(test_error_bars),
        cmocka_unit_test(test_no_bias),
        cmocka_unit_test(test_memory_limit),
        cmocka_unit_test(test_fits_with_pairs),
        cmocka_unit_test(test_memory_failures),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
