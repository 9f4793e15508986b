/* Recommended numbers of paths: better, by the same estimates, than a grid of others; the closed form where there is
 * one camera path; the same for any number of threads while times are given; times that are measured; what is
 * refused; failures of memory. */
#include "base/memory.h"
#include "noise/ray_map.h"
#include "render/noise.h"
#include "support/scene_text.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

/* A floor and a wall under a small lamp: pixels of either kind differ in all components. */
static const char *const room_text =
    "<scene version=\"3.0.0\">\n"
    "  <integrator type=\"bdpm\"><integer name=\"max_depth\" value=\"4\"/><float name=\"radius\" "
    "value=\"0.4\"/></integrator>\n"
    "  <sensor type=\"perspective\"><float name=\"fov\" value=\"40\"/>\n"
    "    <transform name=\"to_world\"><lookat origin=\"0,3,6\" target=\"0,0.5,0\" up=\"0,1,0\"/></transform>\n"
    "    <film type=\"hdrfilm\"><integer name=\"width\" value=\"10\"/><integer name=\"height\" value=\"8\"/>"
    "<rfilter type=\"box\"/></film>\n"
    "  </sensor>\n"
    "  <shape type=\"rectangle\"><transform name=\"to_world\"><rotate x=\"1\" angle=\"-90\"/><scale "
    "value=\"3\"/></transform>"
    "</shape>\n"
    "  <shape type=\"rectangle\"><transform name=\"to_world\"><scale value=\"3\"/><translate "
    "z=\"-2\"/></transform></shape>\n"
    "  <emitter type=\"point\"><point name=\"position\" value=\"0.5,2.5,0.5\"/><rgb name=\"intensity\" value=\"40\"/>"
    "</emitter>\n"
    "</scene>\n";
enum { WIDTH = 10, HEIGHT = 8, PIXELS = WIDTH * HEIGHT, LIGHT_PATHS = 300, CAMERA_PATHS = 4, ITERATIONS = 200 };

static ca_render_settings settings_with(const char *integrator, uint32_t camera_paths, uint32_t threads)
{
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.integrator = integrator;
    settings.light_paths = LIGHT_PATHS;
    settings.camera_paths = camera_paths;
    settings.threads = threads;
    return settings;
}

static ca_noise *measure(const ca_scene *scene, const ca_render_settings *settings, uint32_t iterations,
                         ca_image_layers **image)
{
    ca_noise *noise = NULL;
    ca_error error = {""};
    if (ca_noise_measure(scene, settings, iterations, &noise, image, NULL, &error) != CA_OK)
        fail_msg("%s", error.message);
    return noise;
}

/* ---- Times that are given -------------------------------------------------------------------------------------- */

static const ca_ray_costs known_costs = {.iteration = 2e-5, .light_path = 1e-6, .segment = 4e-7, .candidate = 1e-7};

static double segments_of(uint32_t x, uint32_t y) { return 2.0 + (x + y) % 3; }
static double candidates_of(uint32_t x, uint32_t y) { return 1.0 + (x * y) % 7; }

/* Pixels with work of their own. */
static ca_ray_times *known_times(void)
{
    ca_ray_times *times = NULL;
    assert_int_equal(ca_ray_times_create(&times, WIDTH, HEIGHT, 1, NULL), CA_OK);
    for (uint32_t y = 0; y < HEIGHT; y++)
        for (uint32_t x = 0; x < WIDTH; x++)
            ca_ray_times_pixel(times, x, y, 1000, 1, (uint64_t)segments_of(x, y), (uint64_t)candidates_of(x, y));
    return times;
}

static double known_time(double light_paths, const uint32_t *map, double camera_paths)
{
    double time = known_costs.iteration + light_paths * known_costs.light_path;
    for (uint32_t i = 0; i < PIXELS; i++)
        time += (map ? map[i] : camera_paths) *
                (segments_of(i % WIDTH, i / WIDTH) * known_costs.segment +
                 candidates_of(i % WIDTH, i / WIDTH) * known_costs.candidate / 1000.0 * light_paths);
    return time;
}

static ca_ray_numbers choose(const ca_noise *noise, ca_ray_objective objective)
{
    ca_ray_times *times = known_times();
    ca_ray_numbers numbers;
    ca_error error = {""};
    if (ca_noise_choose(noise, times, &known_costs, objective, &numbers, &error) != CA_OK)
        fail_msg("%s", error.message);
    ca_ray_times_destroy(times);
    return numbers;
}

static void assert_close(const char *what, double value, double expected, double relative)
{
    if (!(fabs(value - expected) <= relative * fabs(expected)))
        fail_msg("%s is %.9g, not %.9g", what, value, expected);
}

static double predicted(const ca_noise *noise, uint32_t light_paths, uint32_t camera_paths)
{
    ca_noise_summary summary;
    assert_int_equal(ca_noise_average(noise, NULL, light_paths, camera_paths, &summary, NULL), CA_OK);
    return summary.predicted;
}

/* Every tenth of a decade of N_F, each uniform N_B: the estimates are those that ca_noise_average tells. */
static void assert_better_than_grid(const ca_noise *noise, const ca_ray_numbers *n, uint32_t most_camera_paths)
{
    const double best = n->best.variance * n->best.time, uniform = n->uniform.variance * n->uniform.time;
    double least = (double)INFINITY;
    for (int i = 10; i <= 50; i++)
        for (uint32_t camera_paths = 1; camera_paths <= most_camera_paths; camera_paths++) {
            const double light_paths = round(pow(10.0, i / 10.0));
            const double cost =
                predicted(noise, (uint32_t)light_paths, camera_paths) * known_time(light_paths, NULL, camera_paths);
            least = fmin(least, cost);
        }
    assert_true(best <= uniform * (1.0 + 1e-9));
    if (!(uniform <= least * (1.0 + 1e-4) && uniform > 0.9 * least))
        fail_msg("uniform numbers cost %.6g, the best of the grid %.6g", uniform, least);
    assert_close("the variance given", n->given.variance,
                 predicted(noise, LIGHT_PATHS, (uint32_t)lround(n->given.camera_paths)), 1e-6);
    assert_close("the variance of uniform numbers", n->uniform.variance,
                 predicted(noise, (uint32_t)n->uniform.light_paths, (uint32_t)lround(n->uniform.camera_paths)), 1e-6);
    assert_close("the time of the map", n->best.time, known_time(n->best.light_paths, n->camera_paths, 0.0), 1e-9);
    assert_close("the gain", n->gain_over_given, n->given.variance * n->given.time / best, 1e-9);
    assert_close("the gain", n->gain_over_uniform, uniform / best, 1e-9);
}

static void test_against_a_grid(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(room_text);
    const ca_render_settings settings = settings_with(NULL, CAMERA_PATHS, 2);
    ca_noise *noise = measure(scene, &settings, ITERATIONS, NULL);
    ca_ray_numbers numbers = choose(noise, CA_RAYS_MEAN);
    assert_better_than_grid(noise, &numbers, 40);
    assert_true(numbers.gain_over_uniform > 1.001);
    double mean = 0.0;
    for (int i = 0; i < PIXELS; i++) mean += (double)numbers.camera_paths[i] / PIXELS;
    assert_close("camera paths", numbers.best.camera_paths, mean, 1e-9);
    /* Each objective is the best at what it is for. */
    for (int objective = 0; objective < 3; objective++) {
        ca_ray_numbers other = choose(noise, (ca_ray_objective)objective);
        assert_true(other.gain_over_uniform >= 1.0 && other.gain_over_given >= 1.0);
        assert_true((memcmp(other.camera_paths, numbers.camera_paths, sizeof(uint32_t) * PIXELS) != 0) ==
                    (objective > 0));
        ca_ray_numbers_destroy(&other);
    }
    ca_ray_numbers_destroy(&numbers);
    ca_noise_release(noise);
    ca_scene_release(scene);
}

/* One camera path: of ppm, where more were measured too, and of bdpm where no more were. */
static void test_light_paths_only(void **state)
{
    (void)state;
    static const struct {
        const char *integrator;
        uint32_t camera_paths;
    } cases[] = {{"ppm", 1}, {"ppm", 3}, {"bdpm", 1}};
    ca_scene *scene = scene_from_text(room_text);
    for (int i = 0; i < 3; i++) {
        const ca_render_settings settings = settings_with(cases[i].integrator, cases[i].camera_paths, 2);
        ca_noise *noise = measure(scene, &settings, ITERATIONS, NULL);
        ca_ray_numbers numbers = choose(noise, CA_RAYS_MEAN);
        assert_better_than_grid(noise, &numbers, 1);
        for (int p = 0; p < PIXELS; p++) assert_int_equal(numbers.camera_paths[p], 1);
        assert_true(numbers.best.light_paths == numbers.uniform.light_paths);
        /* V = alpha / N_F + beta, T = gamma + N_F delta. */
        const double v1 = predicted(noise, 1, 1), v2 = predicted(noise, 1u << 30, 1), beta = v2 - v1 / 0x1p30,
                     alpha = v1 - beta;
        const double gamma = known_time(0.0, NULL, 1.0), delta = known_time(1.0, NULL, 1.0) - gamma;
        assert_close("N_F", numbers.best.light_paths, sqrt(alpha * gamma / (beta * delta)), 1e-3);
        ca_ray_numbers_destroy(&numbers);
        ca_noise_release(noise);
    }
    ca_scene_release(scene);
}

/* The law, with the weights of the relative objective. */
static double predicted_relative(const ca_noise *noise)
{
    double luminance2[PIXELS], weights[PIXELS], sum = 0.0;
    for (int p = 0; p < PIXELS; p++)
        luminance2[p] = ca_noise_components_of(&noise->film.pixels[p]).luminance2.value;
    ca_ray_weights(WIDTH, HEIGHT, 1, CA_RAYS_RELATIVE, luminance2, weights);
    for (int p = 0; p < PIXELS; p++) {
        const ca_noise_coefficients c = ca_noise_coefficients_at(&noise->film, NULL, (size_t)p);
        sum += weights[p] * ca_noise_variance(&c, LIGHT_PATHS, CAMERA_PATHS);
    }
    return sum;
}

/* Where paths connect: one number of camera paths, of the numbers that were measured for, with what is predicted. */
static void check_connected(const ca_noise *noise, ca_ray_objective objective)
{
    ca_ray_numbers numbers = choose(noise, objective);
    for (int p = 0; p < PIXELS; p++) assert_true(numbers.camera_paths[p] == numbers.best.camera_paths);
    assert_true(numbers.best.light_paths >= LIGHT_PATHS / 16.0 - 1.0);
    assert_true(numbers.best.light_paths <= LIGHT_PATHS * 16.0);
    assert_true(numbers.gain_over_given >= 1.0 && numbers.gain_over_uniform == 1.0);
    assert_close("variance", numbers.given.variance,
                 objective == CA_RAYS_MEAN ? predicted(noise, LIGHT_PATHS, CAMERA_PATHS) : predicted_relative(noise),
                 1e-9);
    assert_close("time", numbers.best.time,
                 known_time(numbers.best.light_paths, numbers.camera_paths, numbers.best.camera_paths), 1e-9);
    ca_ray_numbers_destroy(&numbers);
}

static void test_connected(void **state)
{
    (void)state;
    static const char *const integrators[] = {"vcm:radius=0.3", "ovcm:radius=0.3", "vavcm:radius=0.3", "bdpt"};
    ca_scene *scene = scene_from_text(room_text);
    for (int i = 0; i < 4; i++) {
        const ca_render_settings settings = settings_with(integrators[i], CAMERA_PATHS, 2);
        ca_noise_counts counts[CA_NOISE_GRID];
        ca_noise_recommendation r;
        ca_noise *noise;
        ca_error error = {""};
        assert_int_equal(ca_noise_grid(LIGHT_PATHS, CAMERA_PATHS, counts), CA_NOISE_GRID);
        assert_int_equal(
            ca_noise_measure_for(scene, &settings, 20, counts, CA_NOISE_GRID, &noise, NULL, NULL, &error), CA_OK);
        check_connected(noise, CA_RAYS_MEAN);
        check_connected(noise, CA_RAYS_RELATIVE);
        assert_int_equal(ca_noise_recommend(noise, scene, &settings, NULL, NULL, &r, &error), CA_OK);
        assert_true(r.best.light_paths == r.uniform.light_paths && r.gain_over_given >= 1.0);
        assert_int_equal(ca_noise_recommend(noise, scene, &settings, "worst-decile", NULL, &r, &error),
                         CA_ERROR_UNSUPPORTED);
        ca_noise_release(noise);
        noise = measure(scene, &settings, 2, NULL);
        assert_int_equal(ca_noise_recommend(noise, scene, &settings, NULL, NULL, &r, &error), CA_ERROR_UNSUPPORTED);
        assert_non_null(strstr(error.message, "not measured for"));
        ca_noise_release(noise);
    }
    ca_scene_release(scene);
}

/* Numbers that no measurement can be for. */
static void test_counts(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(room_text);
    const ca_render_settings settings = settings_with("vcm:radius=0.3", CAMERA_PATHS, 1);
    const ca_noise_counts wrong[] = {{0, 1}, {10, 0}, {3, 4}};
    ca_noise_counts own = {LIGHT_PATHS, CAMERA_PATHS};
    ca_noise *noise;
    ca_error error = {""};
    for (int i = 0; i < 3; i++)
        assert_int_equal(ca_noise_measure_for(scene, &settings, 2, &wrong[i], 1, &noise, NULL, NULL, &error),
                         CA_ERROR_ARGUMENT);
    assert_int_equal(ca_noise_measure_for(scene, &settings, 2, &own, 1, &noise, NULL, NULL, &error), CA_OK);
    assert_int_equal(noise->film.other_count, 0); /* its own numbers */
    ca_noise_release(noise);
    ca_scene_release(scene);
}

static void test_threads(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(room_text);
    ca_ray_numbers numbers[2];
    for (uint32_t i = 0; i < 2; i++) {
        const ca_render_settings settings = settings_with(NULL, CAMERA_PATHS, 1 + 2 * i);
        ca_noise *noise = measure(scene, &settings, 20, NULL);
        numbers[i] = choose(noise, CA_RAYS_RELATIVE);
        ca_noise_release(noise);
    }
    assert_memory_equal(numbers[0].camera_paths, numbers[1].camera_paths, sizeof(uint32_t) * PIXELS);
    assert_true(numbers[0].best.light_paths == numbers[1].best.light_paths &&
                numbers[0].best.variance == numbers[1].best.variance);
    ca_ray_numbers_destroy(&numbers[0]);
    ca_ray_numbers_destroy(&numbers[1]);
    ca_scene_release(scene);
}

/* ---- Times that are measured ----------------------------------------------------------------------------------- */

static void assert_plausible(const ca_noise_recommendation *r)
{
    const ca_noise_times *t = &r->times;
    assert_true(t->light_paths >= 1 && t->iteration >= 0.0 && t->iteration_error > 0.0);
    /* From ten nanoseconds to a millisecond: wherever this runs. */
    assert_true(t->light_path > 1e-8 && t->light_path < 1e-3 && t->camera_path < 1e-3);
    /* Of so few one kind may seem to cost nothing. */
    assert_true(t->camera_path >= 0.0 && t->candidate >= 0.0 && t->candidate < 1e-3 && t->candidate_error > 0.0 &&
                t->camera_path_error > 0.0);
    assert_true(t->segments_per_camera_path > 1.0 && t->segments_per_camera_path < 4.0);
    assert_true(t->candidates_per_pair > 0.0 && t->candidates_per_pair < 2.0);
    assert_true(r->given.light_paths == LIGHT_PATHS && r->given.camera_paths == CAMERA_PATHS);
    assert_true(r->best.light_paths >= 1 && r->best.light_paths <= r->most_light_paths);
    assert_true(r->fewest_camera_paths >= 1 && r->fewest_camera_paths <= r->best.camera_paths &&
                r->best.camera_paths <= r->most_camera_paths && !r->light_paths_only);
    assert_true(r->gain_over_given >= 1.0 && r->gain_over_uniform >= 1.0);
    assert_close("the gain", r->gain_over_given,
                 r->given.variance * r->given.seconds / (r->best.variance * r->best.seconds), 1e-6);
    assert_close("the gain", r->gain_over_uniform,
                 r->uniform.variance * r->uniform.seconds / (r->best.variance * r->best.seconds), 1e-6);
}

static void assert_map(const ca_image_layers *image, const ca_noise_recommendation *r)
{
    uint32_t light_paths, *map, most = 0;
    ca_error error = {""};
    const ca_ray_map_place place = {.full_width = WIDTH, .full_height = HEIGHT, .crop = {0, 0, WIDTH, HEIGHT}};
    if (ca_ray_map_of(image, "image", &place, &light_paths, &map, &error) != CA_OK) fail_msg("%s", error.message);
    assert_int_equal(light_paths, r->best.light_paths);
    double mean = 0.0;
    for (int i = 0; i < PIXELS; i++) {
        mean += (double)map[i] / PIXELS;
        if (map[i] > most) most = map[i];
    }
    assert_close("camera paths", r->best.camera_paths, mean, 1e-9);
    assert_int_equal(most, r->most_camera_paths);
    ca_free(map);
}

static void test_recommendation(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(room_text);
    const ca_render_settings settings = settings_with(NULL, CAMERA_PATHS, 2);
    ca_image_layers *image = NULL;
    ca_noise *noise = measure(scene, &settings, 50, &image);
    ca_noise_recommendation r;
    ca_error error = {""};
    if (ca_noise_recommend(noise, scene, &settings, NULL, image, &r, &error) != CA_OK) fail_msg("%s", error.message);
    assert_plausible(&r);
    assert_map(image, &r);
    assert_int_equal(ca_noise_recommend(noise, scene, &settings, "worst-decile", NULL, &r, &error), CA_OK);
    assert_plausible(&r);
    ca_noise_release(noise);
    ca_image_release(image);
    ca_scene_release(scene);
}

/* ---- Interrupted, and with little memory ----------------------------------------------------------------------- */

typedef struct caller {
    uint32_t asked, patience; /* so often it says "go on" */
    uint32_t most_passes;
    double most_seconds;
} caller;

static bool ask_caller(const ca_render_progress *progress, void *user)
{
    caller *c = user;
    if (progress->passes_done > c->most_passes) c->most_passes = progress->passes_done;
    c->most_seconds = fmax(c->most_seconds, progress->seconds);
    return c->asked++ < c->patience;
}

/* Ended before anything is timed, and in the middle: no numbers, no map, and nobody is asked again. */
static void test_interrupted(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(room_text);
    ca_render_settings settings = settings_with(NULL, CAMERA_PATHS, 1);
    ca_image_layers *image = NULL;
    settings.width = 80;
    settings.height = 64;
    ca_noise *noise = measure(scene, &settings, 2, &image);
    const size_t layers = image->channel_count;
    settings.progress = ask_caller;
    for (uint32_t patience = 0; patience < 3; patience++) {
        caller c = {.patience = patience};
        ca_noise_recommendation r = {.best.light_paths = 7};
        ca_error error = {""};
        settings.progress_user = &c;
        if (ca_noise_recommend(noise, scene, &settings, NULL, image, &r, &error) != CA_OK)
            fail_msg("%s", error.message);
        assert_true(r.interrupted && r.best.light_paths == 0 && r.times.light_paths == 0);
        assert_int_equal(c.asked, patience + 1);
        assert_int_equal(image->channel_count, layers);
    }
    caller c = {.patience = UINT32_MAX};
    ca_noise_recommendation r;
    settings.progress_user = &c;
    assert_int_equal(ca_noise_recommend(noise, scene, &settings, NULL, image, &r, NULL), CA_OK);
    assert_true(!r.interrupted && r.best.light_paths > 0 && image->channel_count == layers + 1);
    assert_true(c.asked > 3 && c.most_passes >= 3 && c.most_seconds > 0.0);
    ca_noise_release(noise);
    ca_image_release(image);
    ca_scene_release(scene);
}

/* A memory that holds so many light paths at once, and their half, but not 128 times them. */
static void test_limited_memory(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(room_text);
    ca_noise_recommendation free_choice, r;
    ca_error error = {""};
    ca_render_settings settings = settings_with(NULL, CAMERA_PATHS, 1);
    settings.light_paths = 3000;
    ca_noise *noise = measure(scene, &settings, 4, NULL);
    assert_int_equal(ca_noise_recommend(noise, scene, &settings, NULL, NULL, &free_choice, &error), CA_OK);
    assert_int_equal(free_choice.most_light_paths, 128 * 3000);
    double last = 0.0;
    for (settings.memory_mib = 0.25; settings.memory_mib < 20.0; settings.memory_mib *= 4.0) {
        ca_noise_setup setup;
        if (ca_noise_check(scene, &settings, 4, &setup, &error) != CA_OK) fail_msg("%s", error.message);
        ca_noise *limited = NULL;
        const ca_status status = ca_noise_measure(scene, &settings, 4, &limited, NULL, NULL, &error);
        if (status != CA_OK) continue; /* not even those measured fit */
        if (ca_noise_recommend(limited, scene, &settings, NULL, NULL, &r, &error) != CA_OK)
            fail_msg("%s", error.message);
        assert_true(r.most_light_paths >= 3000 && r.most_light_paths <= 128 * 3000 && r.most_light_paths >= last);
        /* A light path takes more than 40 bytes: 8, and 80 and more with a photon, which every other one leaves. */
        assert_true(r.most_light_paths == 3000 || r.most_light_paths < settings.memory_mib * 0x1p20 / 40.0);
        assert_true(r.best.light_paths <= r.most_light_paths && r.uniform.light_paths <= r.most_light_paths);
        assert_true(r.times.light_paths <= r.most_light_paths);
        last = r.most_light_paths;
        ca_noise_release(limited);
    }
    assert_true(last > 3000.0);
    ca_noise_release(noise);
    ca_scene_release(scene);
}

/* ---- What is refused, defaults, memory ------------------------------------------------------------------------- */

static void test_refusals(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(room_text);
    const ca_render_settings settings = settings_with(NULL, CAMERA_PATHS, 1);
    ca_noise *noise = measure(scene, &settings, 2, NULL);
    ca_noise_recommendation r;
    ca_error error = {""};
    assert_int_equal(ca_noise_recommend(noise, scene, &settings, "median", NULL, &r, &error), CA_ERROR_ARGUMENT);
    assert_string_equal(error.message,
                        "the objective \"median\" is not known; there are mean, relative, worst-decile");
    ca_render_settings others[4] = {settings, settings, settings, settings};
    others[0].light_paths++;
    others[1].camera_paths++;
    others[2].width = others[2].height = 9;
    others[3].has_crop = true;
    memcpy(others[3].crop, (uint32_t[]){0, 1, WIDTH, HEIGHT}, sizeof others[3].crop);
    for (int i = 0; i < 4; i++) {
        assert_int_equal(ca_noise_recommend(noise, scene, &others[i], NULL, NULL, &r, &error), CA_ERROR_ARGUMENT);
        assert_non_null(strstr(error.message, "the settings that the noise was measured with"));
    }
    ca_render_settings rays = settings;
    ca_noise_setup setup;
    rays.rays = "auto";
    assert_int_equal(ca_noise_check(scene, &rays, 2, &setup, &error), CA_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, "the same numbers of paths for all pixels"));
    ca_noise_release(noise);
    ca_scene_release(scene);
}

/* Numbers that neither settings nor scene nor the integrator's own parameters name. */
static void test_default_numbers(void **state)
{
    (void)state;
    static const struct {
        const char *integrator;
        uint32_t light_paths, camera_paths;
    } cases[] = {{NULL, 30000, 4},
                 {"ppm", 30000, 1},
                 {"bdpm:light_paths=70", 70, 4},
                 {"bdpm:camera_paths=9,light_paths=0", PIXELS, 9}};
    ca_scene *scene = scene_from_text(room_text);
    for (int i = 0; i < 4; i++) {
        ca_render_settings settings = settings_with(cases[i].integrator, 0, 1);
        settings.light_paths = 0;
        ca_noise_setup setup;
        assert_int_equal(ca_noise_check(scene, &settings, 2, &setup, NULL), CA_OK);
        assert_int_equal(setup.light_paths, cases[i].light_paths);
        assert_int_equal(setup.camera_paths, cases[i].camera_paths);
    }
    ca_scene_release(scene);
}

static void test_memory(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(room_text);
    const ca_render_settings settings = settings_with(NULL, 2, 1);
    ca_image_layers *image = NULL;
    ca_noise *noise = measure(scene, &settings, 2, &image);
    long failures = 0;
    for (ca_status status = CA_ERROR_MEMORY; status != CA_OK; failures++) {
        ca_noise_recommendation r;
        ca_error error = {""};
        ca_memory_fail_after(failures);
        status = ca_noise_recommend(noise, scene, &settings, NULL, NULL, &r, &error);
        ca_memory_fail_after(-1);
        assert_true(status == CA_OK || (status == CA_ERROR_MEMORY && error.message[0] != '\0'));
    }
    assert_true(failures > 20);
    ca_noise_release(noise);
    ca_image_release(image);
    ca_scene_release(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_against_a_grid), cmocka_unit_test(test_light_paths_only),
        cmocka_unit_test(test_threads),        cmocka_unit_test(test_recommendation),
        cmocka_unit_test(test_refusals),       cmocka_unit_test(test_default_numbers),
        cmocka_unit_test(test_memory),         cmocka_unit_test(test_interrupted),
        cmocka_unit_test(test_limited_memory), cmocka_unit_test(test_connected),
        cmocka_unit_test(test_counts),
    };
    return cmocka_run_group_tests_name("recommended numbers of paths", tests, NULL, NULL);
}
