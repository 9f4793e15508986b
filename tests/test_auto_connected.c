/* Numbers of rays where paths connect and weights contain them: what is predicted for other numbers of light paths,
 * what is kept, and what a file of rays makes again. */
#include "base/memory.h"
#include "render/auto_nodes.h"
#include "render/auto_plan.h"
#include "render/auto_rays.h"
#include "support/auto_bias.h"
#include "support/pair_render.h"
#include "support/sample_mean.h"
#include "support/scene_text.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

/* ---- Predictions ----------------------------------------------------------------------------------------------- */

/* A matt ball in a closed room with a lamp in view. */
static const char *const room =
    "<scene version='3.0.0'><sensor type='perspective'><float name='fov' value='60'/><transform name='to_world'>"
    "<lookat origin='0,0,0.95' target='0,-0.1,0' up='0,1,0'/></transform><film type='hdrfilm'>"
    "<integer name='width' value='" PAIR_FILM_WIDTH "'/><integer name='height' value='" PAIR_FILM_HEIGHT "'/>"
    "<rfilter type='box'/></film></sensor>"
    "<shape type='cube'><bsdf type='twosided'><bsdf type='diffuse'/></bsdf></shape>"
    "<shape type='sphere'><float name='radius' value='0.3'/><point name='center' x='0.4' y='-0.6' z='-0.3'/>"
    "<bsdf type='diffuse'/></shape>"
    "<shape type='rectangle'><transform name='to_world'><scale value='0.3'/><rotate x='1' angle='100'/>"
    "<translate x='-0.3' y='0.5' z='-0.4'/></transform><bsdf type='diffuse'/>"
    "<emitter type='area'><rgb name='radiance' value='3,3,2'/></emitter></shape></scene>";

static const char *const integrator = "vcm:max_depth=4,rr_depth=6,radius=0.1,alpha=0";
enum { RENDERS = 16, ITERATIONS = 60, LIGHT_PATHS = 60, CAMERA_PATHS = 4, FIVE_TIMES = 300 };

/* Of a film with all products, the means. */
static void keep_means(const ca_pair_film *film, ca_pair_film *means)
{
    static const uint32_t crop[4] = {1, 1, 1 + CROP_WIDTH, 1 + CROP_HEIGHT};
    assert_int_equal(ca_pair_film_create_means(means, crop, NULL), CA_OK);
    assert_int_equal(ca_pair_film_connect(means, NULL), CA_OK);
    means->light_paths = film->light_paths;
    for (size_t p = 0; p < CROP_PIXELS; p++) {
        const ca_pair_connections *c = &film->connections[p];
        ca_pair_connected_means *to = &means->connected_means[p];
        memcpy(means->means[p].sums, film->pixels[p].sums, sizeof means->means[p].sums);
        means->means[p].squares = film->pixels[p].products[0];
        memcpy(to->sums, c->sums, sizeof to->sums);
        to->cross = c->products[ca_pair_connected_product(CA_PAIR_VALUE, CA_PAIR_CONNECTED)];
        to->squares = c->products[ca_pair_connected_product(CA_PAIR_CONNECTED, CA_PAIR_CONNECTED)];
    }
}

static double predict(const ca_auto_nodes *nodes, double light_paths)
{
    ca_connected_node list[CA_AUTO_MOST_NODES];
    const ca_connected_image image = {.nodes = list, .node_count = ca_auto_nodes_list(nodes, true, list)};
    return ca_connected_expect(&image, light_paths, CAMERA_PATHS).variance;
}

/* Of the relative objective: each pixel's is of the mean of its neighbours. */
static void assert_smoothed(const ca_auto_nodes *nodes, const ca_pair_film *means)
{
    double luminance2[CROP_PIXELS], weights[CROP_PIXELS];
    for (size_t p = 0; p < CROP_PIXELS; p++)
        luminance2[p] = ca_noise_excess_of(&means->means[p], ITERATIONS).luminance2;
    ca_ray_weights(CROP_WIDTH, CROP_HEIGHT, 2, CA_RAYS_RELATIVE, luminance2, weights);
    assert_memory_equal(nodes->weights, weights, sizeof weights);
}

/* What a pilot with these numbers gathers. */
static void add_pilot(const ca_scene *scene, uint64_t seed, ca_auto_nodes *nodes)
{
    const bool first = !nodes->weighted;
    static const uint32_t camera_paths[1] = {CAMERA_PATHS};
    ca_pair_numbers others[CA_AUTO_MOST_OTHERS];
    const uint32_t count = ca_auto_nodes_others(nodes->first, LIGHT_PATHS, CAMERA_PATHS, others);
    const pair_render r = {integrator, LIGHT_PATHS, CAMERA_PATHS, ITERATIONS, 1, seed, NULL, 0, others, count};
    ca_pair_film film, means;
    ca_image_release(render_pairs(scene, &r, &film));
    keep_means(&film, &means);
    means.others = film.others;
    means.other_count = film.other_count;
    ca_auto_nodes_add(nodes,
                      &(ca_auto_gathered){.pairs = &means,
                                          .iterations = ITERATIONS,
                                          .light_paths = LIGHT_PATHS,
                                          .camera_paths = camera_paths},
                      CA_RAYS_RELATIVE);
    if (first) assert_smoothed(nodes, &means);
    means.others = NULL;
    means.other_count = 0;
    ca_pair_film_destroy(&means);
    ca_pair_film_destroy(&film);
}

static double measure(const ca_scene *scene, uint64_t seed, uint32_t light_paths, const double *weights)
{
    const pair_render r = {integrator, light_paths, CAMERA_PATHS, ITERATIONS, 1, seed, NULL, 0, NULL, 0};
    ca_pair_film film;
    double sum = 0.0;
    ca_image_release(render_pairs(scene, &r, &film));
    for (size_t p = 0; p < CROP_PIXELS; p++)
        sum += weights[p] * ca_noise_terms_at(&film, p, light_paths, CAMERA_PATHS).measured.value;
    ca_pair_film_destroy(&film);
    return sum;
}

/* What is pooled over pilots predicts the variance with five times the light paths, between two nodes, within 3 % and
 * two standard errors; the pilots' own numbers, within two. */
static void test_predictions(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(room);
    ca_auto_nodes all;
    sample_mean predicted = {0}, measured = {0};
    double light = 0.0;
    assert_int_equal(ca_auto_nodes_create(&all, CROP_PIXELS, LIGHT_PATHS, NULL), CA_OK);
    add_pilot(scene, 100, &all); /* fixes the weights, which have no say in the rest */
    for (uint64_t seed = 0; seed < RENDERS; seed++) {
        ca_auto_nodes one = {.first = LIGHT_PATHS, .pixels = CROP_PIXELS, .weights = all.weights, .weighted = true};
        add_pilot(scene, seed, &one);
        add_sample(&predicted, predict(&one, FIVE_TIMES));
        add_sample(&measured, measure(scene, 1000 + seed, FIVE_TIMES, all.weights));
        if (seed >= 3) continue;
        if (seed == 0) ca_auto_nodes_clear(&all), all.weighted = true;
        add_pilot(scene, seed, &all);
        light += one.items[3].objective.light / 3.0;
    }
    const double mean = measured.sum / RENDERS, off = predicted.sum / RENDERS / mean - 1.0;
    const double error = hypot(error_of(&predicted, RENDERS), error_of(&measured, RENDERS)) / mean;
    print_message("N_F %d from %d: predicted by %+.2f %% +- %.2f %%\n", FIVE_TIMES, LIGHT_PATHS, 100.0 * off,
                  100.0 * error);
    assert_true(error < 0.025 && fabs(off) < 0.03 && fabs(off) < 2.0 * error);
    assert_int_equal(all.count, 5);
    assert_true(all.items[2].pairs == 3.0 * ITERATIONS * LIGHT_PATHS * CAMERA_PATHS);
    assert_true(fabs(all.items[3].objective.light - light) < 1e-9 * fabs(light));
    ca_auto_nodes_destroy(&all);
    ca_scene_release(scene);
}

/* ---- Nodes ----------------------------------------------------------------------------------------------------- */

static void assert_others(double first, uint32_t light_paths, uint32_t camera_paths, const uint32_t expected[4])
{
    ca_pair_numbers others[CA_AUTO_MOST_OTHERS];
    const uint32_t count = ca_auto_nodes_others(first, light_paths, camera_paths, others);
    uint32_t wanted = 0;
    while (wanted < 4 && expected[wanted] > 0) wanted++;
    assert_int_equal(count, wanted);
    for (uint32_t i = 0; i < count; i++) {
        assert_int_equal(others[i].light_paths, expected[i]);
        assert_int_equal(others[i].camera_paths, camera_paths);
    }
}

/* Powers of 4 of the pilot's number, within a factor of 16 of the run's own. */
static void test_others(void **state)
{
    (void)state;
    assert_others(1600.0, 1600, 2, (const uint32_t[]){100, 400, 6400, 25600});
    assert_others(1600.0, 3200, 2, (const uint32_t[]){400, 1600, 6400, 25600});
    assert_others(1600.0, 100, 2, (const uint32_t[]){6, 25, 400, 1600});
    assert_others(1600.0, 100, 20, (const uint32_t[]){25, 400, 1600, 0});
    assert_others(60.0, 60, 4, (const uint32_t[]){4, 15, 240, 960});
    assert_others(4194304.0, 4194304, 1, (const uint32_t[]){262144, 1048576, 0, 0});
    assert_others(2.0, 2, 2, (const uint32_t[]){8, 32, 0, 0});
}

static void add_sample_of(ca_pair_film *film, double value)
{
    const ca_pair_moments moments = {.value = value, .pair = 2.0 * value, .connected = 3.0, .connected_light = value};
    ca_pair_film_add(film, 0, 0, &moments);
    for (uint32_t i = 0; i < film->other_count; i++) add_sample_of(&film->others[i], value + 10.0);
}

/* Films of means with connections and others, pooled, are the film of all iterations. */
static void test_pooling(void **state)
{
    (void)state;
    static const uint32_t crop[4] = {0, 0, 1, 1};
    static const ca_pair_numbers numbers[2] = {{3, 2}, {48, 2}};
    ca_pair_film films[3];
    for (int i = 0; i < 3; i++) {
        assert_int_equal(ca_pair_film_create_means(&films[i], crop, NULL), CA_OK);
        assert_int_equal(ca_pair_film_add_others(&films[i], numbers, 2, NULL), CA_OK);
        assert_int_equal(ca_pair_film_connect(&films[i], NULL), CA_OK);
    }
    add_sample_of(&films[0], 1.0);
    add_sample_of(&films[1], 4.0);
    add_sample_of(&films[2], 1.0);
    add_sample_of(&films[2], 4.0);
    ca_pair_film_pool(&films[0], &films[1], 1);
    assert_memory_equal(films[0].connected_means, films[2].connected_means, sizeof *films[0].connected_means);
    for (uint32_t i = 0; i < 2; i++) {
        const ca_pair_film *a = &films[0].others[i], *b = &films[2].others[i];
        assert_memory_equal(a->means, b->means, sizeof *a->means);
        assert_memory_equal(a->connected_means, b->connected_means, sizeof *a->connected_means);
        assert_true(a->light_paths == numbers[i].light_paths && !a->made);
    }
    for (int i = 0; i < 3; i++) ca_pair_film_destroy(&films[i]);
}

/* ---- Renders --------------------------------------------------------------------------------------------------- */

static ca_render_settings settings_auto(const char *with, uint32_t samples)
{
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.integrator = with;
    settings.rays = "auto";
    settings.samples_per_pixel = samples;
    settings.threads = 1;
    return settings;
}

static ca_render_statistics render_auto(const ca_scene *scene, const ca_render_settings *settings,
                                        ca_image_layers **image)
{
    ca_render_statistics statistics = {.size = sizeof statistics};
    ca_error error = {""};
    if (ca_render(scene, settings, image, &statistics, &error) != CA_OK) fail_msg("%s", error.message);
    assert_int_equal(statistics.non_finite, 0);
    return statistics;
}

static void test_all_that_connect(void **state)
{
    (void)state;
    static const char *const names[] = {"vcm:guide=true", "ovcm", "vavcm", "bdpt"};
    ca_scene *scene = auto_bias_scene();
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        ca_render_settings settings = settings_auto(names[i], 40);
        ca_image_layers *image;
        settings.rays_objective = i % 2 == 0 ? NULL : "relative";
        const ca_render_statistics s = render_auto(scene, &settings, &image);
        const float *map = ca_image_channel(image, "Rays.Numbers");
        for (int p = 1; p < AUTO_BIAS_SIDE * AUTO_BIAS_SIDE; p++) assert_true(map[p] == map[0]);
        assert_true((double)map[0] == s.numbers_of_rays.camera_paths && s.numbers_of_rays.phases >= 1);
        assert_true(s.samples_per_pixel >= 40.0 && s.samples_per_pixel < 54.0 && s.noise_percent > 0.0);
        ca_image_release(image);
    }
    ca_scene_release(scene);
}

/* No numbers are kept that are worse than the pilot's, and from bad ones far better ones are found. */
static void test_pilots_numbers(void **state)
{
    (void)state;
    static const char *const names[] = {"ovcm", "bdpm"};
    static const ca_auto_limits kept = {.reach = 4}, trial = {.reach = 16, .for_a_trial = true};
    assert_true(ca_auto_keeps_pilots_numbers(&kept, 0.99, 2.0) && !ca_auto_keeps_pilots_numbers(&kept, 1.0, 8.0));
    assert_true(!ca_auto_keeps_pilots_numbers(&kept, 0.5, 1.9) && !ca_auto_keeps_pilots_numbers(&trial, 0.5, 8.0));
    assert_false(ca_auto_keeps_pilots_numbers(&kept, (double)NAN, 8.0));
    ca_scene *scene = auto_bias_scene();
    for (size_t i = 0; i < 2; i++) {
        ca_render_settings settings = settings_auto(names[i], 200);
        ca_image_layers *image;
        settings.camera_paths = settings.light_paths = 16;
        const ca_render_statistics s = render_auto(scene, &settings, &image);
        print_message("%s: %u light paths, %.3g camera paths, gain %.3g\n", names[i], s.numbers_of_rays.light_paths,
                      s.numbers_of_rays.camera_paths, s.numbers_of_rays.predicted_gain);
        assert_true(s.numbers_of_rays.predicted_gain >= 2.0);
        ca_image_release(image);
    }
    ca_scene_release(scene);
}

static void test_mean(void **state)
{
    (void)state;
    enum { COUNT = 24, PIXELS = AUTO_BIAS_SIDE * AUTO_BIAS_SIDE };
    ca_scene *scene = auto_bias_scene();
    sample_mean chosen = {0}, plain = {0};
    for (uint32_t k = 0; k < 2 * COUNT; k++) {
        ca_render_settings settings = settings_auto("ovcm:alpha=0", 36);
        settings.has_seed = true;
        settings.seed = k;
        if (k >= COUNT) settings.rays = NULL;
        ca_image_layers *image = render_scene(scene, &settings);
        double sum = 0.0;
        for (int p = 0; p < PIXELS; p++) sum += (double)ca_image_channel(image, "G")[p] / PIXELS;
        add_sample(k < COUNT ? &chosen : &plain, sum);
        ca_image_release(image);
    }
    const double error = hypot(error_of(&chosen, COUNT), error_of(&plain, COUNT));
    const double mean = plain.sum / COUNT, off = (chosen.sum - plain.sum) / COUNT;
    print_message("mean of chosen numbers: %+.2f %% +- %.2f %%\n", 100.0 * off / mean, 100.0 * error / mean);
    assert_true(error < 0.04 * mean && fabs(off) < 4.5 * error);
    ca_scene_release(scene);
}

/* ---- Files ----------------------------------------------------------------------------------------------------- */

/* A file of rays makes the same bits with any number of threads. */
static void check_file(const ca_scene *scene, const char *with, const char *path)
{
    ca_render_settings settings = settings_auto(with, 40);
    ca_image_layers *image;
    const ca_render_statistics s = render_auto(scene, &settings, &image);
    assert_int_equal(ca_image_save(image, path, 0.0f, NULL), CA_OK);
    ca_image_release(image);
    uint64_t hashes[2];
    settings.rays = path;
    for (uint32_t t = 0; t < 2; t++) {
        settings.threads = 1 + 2 * t;
        const ca_render_statistics again = render_auto(scene, &settings, &image);
        hashes[t] = image_hash(image);
        assert_int_equal(again.numbers_of_rays.light_paths, s.numbers_of_rays.light_paths);
        if (strcmp(with, "ovcm") == 0) /* `auto` may choose one whose pilot has light paths, too */
            assert_int_equal(again.light_paths, again.iterations * again.numbers_of_rays.light_paths);
        ca_image_release(image);
    }
    assert_true(hashes[0] == hashes[1]);
    unlink(path);
}

static void test_files(void **state)
{
    (void)state;
    char path[64];
    snprintf(path, sizeof path, "/tmp/caustica-connected-%ld.exr", (long)getpid());
    ca_scene *scene = auto_bias_scene();
    check_file(scene, "ovcm", path);
    check_file(scene, "auto", path);
    unlink(path);
    ca_scene_release(scene);
}

/* Every allocation fails once. */
static void test_memory_failures(void **state)
{
    (void)state;
    ca_scene *scene = auto_bias_scene();
    ca_render_settings settings = settings_auto("vcm", 28);
    ca_status status = CA_ERROR_MEMORY;
    long count = 0;
    settings.light_paths = 20;
    for (; status != CA_OK; count += 7) {
        ca_image_layers *image = NULL;
        ca_memory_fail_after(count);
        status = ca_render(scene, &settings, &image, NULL, NULL);
        ca_memory_fail_after(-1);
        assert_true(status == CA_OK || status == CA_ERROR_MEMORY);
        ca_image_release(image);
        assert_true(count < 9000);
    }
    assert_true(count > 60);
    ca_scene_release(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_predictions),
        cmocka_unit_test(test_others),
        cmocka_unit_test(test_pooling),
        cmocka_unit_test(test_all_that_connect),
        cmocka_unit_test(test_pilots_numbers),
        cmocka_unit_test(test_mean),
        cmocka_unit_test(test_files),
        cmocka_unit_test(test_memory_failures),
    };
    return cmocka_run_group_tests_name("numbers of rays where paths connect", tests, NULL, NULL);
}
