/* Sums of noise estimators over iterations; and what the bidirectional engine fills them with: the law of noise from
 * the estimators against the variance there is, the image that it leaves as it was, the same bits for any number of
 * threads, what it refuses. */
#include "base/memory.h"
#include "support/pair_render.h"
#include "support/sample_mean.h"
#include "support/scene_text.h"
#include "support/test_random.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* ---- The film -------------------------------------------------------------------------------------------------- */

static void test_product_indices(void **state)
{
    (void)state;
    int next = 0;
    for (int a = 0; a < CA_PAIR_QUANTITIES; a++)
        for (int b = a; b < CA_PAIR_QUANTITIES; b++, next++) {
            assert_int_equal(ca_pair_product(a, b), next);
            assert_int_equal(ca_pair_product(b, a), next);
        }
    assert_int_equal(next, 10);
}

static void test_sums(void **state)
{
    (void)state;
    enum { ITERATIONS = 50 };
    const uint32_t crop[4] = {5, 7, 8, 9};
    ca_test_random random = ca_test_random_seed(3);
    ca_pair_film film;
    assert_int_equal(ca_pair_film_create(&film, crop, 30, 4, NULL), CA_OK);
    assert_true(film.width == 3 && film.height == 2 && film.light_paths == 30 && film.camera_paths == 4 &&
                !film.incomplete);
    double q[ITERATIONS][CA_PAIR_QUANTITIES];
    for (int k = 0; k < ITERATIONS; k++) {
        for (int a = 0; a < CA_PAIR_QUANTITIES; a++) q[k][a] = (double)ca_test_random_float(&random) - 0.25;
        ca_pair_film_add(&film, 6, 8,
                         &(ca_pair_moments){.value = q[k][0], .pair = q[k][1], .camera = q[k][2], .light = q[k][3]});
    }
    const ca_pair_pixel *pixel = &film.pixels[1 * 3 + 1];
    double cubes = 0.0, fourths = 0.0;
    for (int k = 0; k < ITERATIONS; k++) {
        cubes += pow(q[k][0], 3.0);
        fourths += pow(q[k][0], 4.0);
    }
    assert_int_equal(pixel->iterations, ITERATIONS);
    assert_true(fabs(pixel->cubes - cubes) < 1e-12 && fabs(pixel->fourths - fourths) < 1e-12);
    for (int a = 0; a < CA_PAIR_QUANTITIES; a++) {
        double sum = 0.0;
        for (int k = 0; k < ITERATIONS; k++) sum += q[k][a];
        assert_true(fabs(pixel->sums[a] - sum) < 1e-12);
        for (int b = 0; b < CA_PAIR_QUANTITIES; b++) {
            double product = 0.0;
            for (int k = 0; k < ITERATIONS; k++) product += q[k][a] * q[k][b];
            assert_true(fabs(pixel->products[ca_pair_product(a, b)] - product) < 1e-12);
        }
    }
    for (int p = 0; p < 6; p++) assert_int_equal(film.pixels[p].iterations, p == 4 ? ITERATIONS : 0);
    ca_pair_film_destroy(&film);
}

/* Means alone are the same sums, in a smaller film; pooled like the others. */
static void test_means(void **state)
{
    (void)state;
    enum { ITERATIONS = 7 };
    const uint32_t crop[4] = {5, 7, 8, 9};
    ca_test_random random = ca_test_random_seed(5);
    ca_pair_film film, means, other;
    assert_int_equal(ca_pair_film_create(&film, crop, 30, 4, NULL), CA_OK);
    assert_int_equal(ca_pair_film_create_means(&means, crop, NULL), CA_OK);
    assert_int_equal(ca_pair_film_create_means(&other, crop, NULL), CA_OK);
    assert_true(!means.pixels && means.width == 3 && means.height == 2);
    for (int k = 0; k < ITERATIONS; k++) {
        double v[CA_PAIR_QUANTITIES];
        for (int a = 0; a < CA_PAIR_QUANTITIES; a++) v[a] = (double)ca_test_random_float(&random) - 0.25;
        const ca_pair_moments m = {.value = v[0], .pair = v[1], .camera = v[2], .light = v[3]};
        ca_pair_film_add(&film, 6, 8, &m);
        ca_pair_film_add(k < 3 ? &means : &other, 6, 8, &m);
    }
    ca_pair_film_pool(&means, &other, 1);
    for (int a = 0; a < CA_PAIR_QUANTITIES; a++)
        assert_true(fabs(means.means[4].sums[a] - film.pixels[4].sums[a]) < 1e-12);
    assert_true(fabs(means.means[4].squares - film.pixels[4].products[0]) < 1e-12);
    ca_pair_film_pool(&means, &other, -1);
    assert_true(fabs(means.means[4].squares + other.means[4].squares - film.pixels[4].products[0]) < 1e-12);
    assert_true(means.means[3].squares == 0.0 && means.means[5].sums[0] == 0.0);
    ca_pair_film_destroy(&film);
    ca_pair_film_destroy(&means);
    ca_pair_film_destroy(&other);
}

/* Connections' sums beside, and all products of quantities with theirs. */
static void test_sums_of_connections(void **state)
{
    (void)state;
    enum { ITERATIONS = 20 };
    const uint32_t crop[4] = {5, 7, 8, 9};
    ca_test_random random = ca_test_random_seed(4);
    ca_pair_film film;
    assert_int_equal(ca_pair_film_create(&film, crop, 30, 4, NULL), CA_OK);
    assert_null(film.connections);
    assert_int_equal(ca_pair_film_connect(&film, NULL), CA_OK);
    double q[ITERATIONS][CA_PAIR_ALL_QUANTITIES];
    for (int k = 0; k < ITERATIONS; k++) {
        double *v = q[k];
        for (int a = 0; a < CA_PAIR_ALL_QUANTITIES; a++) v[a] = (double)ca_test_random_float(&random) - 0.25;
        const ca_pair_moments m = {v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7], v[8]};
        ca_pair_film_add(&film, 7, 7, &m);
    }
    const ca_pair_connections *c = &film.connections[2];
    int next = 0;
    for (int b = CA_PAIR_QUANTITIES; b < CA_PAIR_ALL_QUANTITIES; b++) {
        double sum = 0.0;
        for (int k = 0; k < ITERATIONS; k++) sum += q[k][b];
        assert_true(fabs(c->sums[b - CA_PAIR_QUANTITIES] - sum) < 1e-12);
        for (int a = 0; a <= b; a++, next++) {
            double product = 0.0;
            for (int k = 0; k < ITERATIONS; k++) product += q[k][a] * q[k][b];
            assert_true(ca_pair_connected_product(a, b) == next && ca_pair_connected_product(b, a) == next);
            assert_true(fabs(c->products[next] - product) < 1e-12);
        }
    }
    assert_int_equal(next, sizeof c->products / sizeof c->products[0]);
    assert_int_equal(film.pixels[2].iterations, ITERATIONS);
    assert_true(film.connections[1].sums[0] == 0.0 && film.connections[3].sums[0] == 0.0);
    ca_pair_film_destroy(&film);
}

/* Two films of iterations are, pooled, the film of all of them, and with one taken out again the other. */
static void test_pool(void **state)
{
    (void)state;
    const uint32_t crop[4] = {5, 7, 8, 9};
    ca_test_random random = ca_test_random_seed(5);
    ca_pair_film films[2], all;
    for (int f = 0; f < 2; f++) assert_int_equal(ca_pair_film_create(&films[f], crop, 30, 4, NULL), CA_OK);
    assert_int_equal(ca_pair_film_create(&all, crop, 30, 4, NULL), CA_OK);
    for (int k = 0; k < 200; k++) {
        double q[CA_PAIR_QUANTITIES]; /* eighths: sums are exact */
        for (int a = 0; a < CA_PAIR_QUANTITIES; a++) q[a] = (double)(ca_test_random_u32(&random) % 16) / 8.0;
        const ca_pair_moments m = {.value = q[0], .pair = q[1], .camera = q[2], .light = q[3]};
        const uint32_t x = 5 + (uint32_t)k % 3, y = 7 + (uint32_t)k % 2;
        ca_pair_film_add(&films[k % 5 == 0], x, y, &m);
        ca_pair_film_add(&all, x, y, &m);
    }
    ca_pair_pixel first[6];
    memcpy(first, films[0].pixels, sizeof first);
    ca_pair_film_pool(&films[0], &films[1], 1);
    assert_memory_equal(films[0].pixels, all.pixels, sizeof first);
    ca_pair_film_pool(&films[0], &films[1], -1);
    assert_memory_equal(films[0].pixels, first, sizeof first);
    for (int f = 0; f < 2; f++) ca_pair_film_destroy(&films[f]);
    ca_pair_film_destroy(&all);
}

static void test_film_out_of_memory(void **state)
{
    (void)state;
    ca_pair_film film;
    ca_error error = {0};
    ca_memory_fail_after(0);
    assert_int_equal(ca_pair_film_create(&film, (uint32_t[4]){0, 0, 9, 9}, 30, 4, &error), CA_ERROR_MEMORY);
    ca_memory_fail_after(-1);
    assert_non_null(strstr(error.message, "noise"));
    ca_pair_film_destroy(&film);
    assert_int_equal(ca_pair_film_create(&film, (uint32_t[4]){0, 0, 9, 9}, 30, 4, NULL), CA_OK);
    ca_memory_fail_after(0);
    assert_int_equal(ca_pair_film_connect(&film, &error), CA_ERROR_MEMORY);
    ca_memory_fail_after(-1);
    ca_pair_film_destroy(&film);
}

/* ---- The engine ------------------------------------------------------------------------------------------------ */

/* A corner with a glass ball under a lamp that is in view, so that camera paths find light with and without photons;
 * the filter has negative lobes. */
static const char *const corner_xml =
    "<scene version='3.0.0'><sensor type='perspective'><float name='fov' value='50'/><transform name='to_world'>"
    "<lookat origin='0,0,4' target='0,0,0' up='0,1,0'/></transform><film type='hdrfilm'>"
    "<integer name='width' value='" PAIR_FILM_WIDTH "'/><integer name='height' value='" PAIR_FILM_HEIGHT
    "'/><rfilter type='mitchell'/></film></sensor>"
    "<bsdf type='diffuse' id='grey'><rgb name='reflectance' value='0.7,0.6,0.5'/></bsdf>"
    "<shape type='rectangle'><transform name='to_world'><scale value='2'/><translate z='-1.5'/></transform>"
    "<ref id='grey'/></shape>"
    "<shape type='rectangle'><transform name='to_world'><scale value='2'/><rotate x='1' angle='-90'/><translate "
    "y='-1.2'/>"
    "</transform><ref id='grey'/></shape>"
    "<shape type='sphere'><float name='radius' value='0.5'/><point name='center' x='0.3' y='-0.6' z='0.2'/>"
    "<bsdf type='dielectric'/></shape>"
    "<shape type='rectangle'><transform name='to_world'><scale value='0.4'/><rotate x='1' angle='70'/>"
    "<translate x='-0.4' y='1.1'/></transform><ref id='grey'/><emitter type='area'><rgb name='radiance' "
    "value='3,2,1'/></emitter>"
    "</shape></scene>";

/* A white closed box: light paths meet a camera path again and again. */
static const char *const box_xml =
    "<scene version='3.0.0'><sensor type='perspective'><float name='fov' value='80'/><transform name='to_world'>"
    "<lookat origin='0,0,0.9' target='0,0,0' up='0,1,0'/></transform><film type='hdrfilm'>"
    "<integer name='width' value='" PAIR_FILM_WIDTH "'/><integer name='height' value='" PAIR_FILM_HEIGHT
    "'/><rfilter type='box'/></film></sensor>"
    "<shape type='cube'><bsdf type='twosided'><bsdf type='diffuse'><rgb name='reflectance' "
    "value='0.9'/></bsdf></bsdf></shape>"
    "<emitter type='point'><point name='position' x='0.2' y='0.7' z='0'/><rgb name='intensity' value='1'/></emitter>"
    "</scene>";

static ca_scene *corner, *box;

static int load_scenes(void **state)
{
    (void)state;
    corner = scene_from_text(corner_xml);
    box = scene_from_text(box_xml);
    return 0;
}

static int release_scenes(void **state)
{
    (void)state;
    ca_scene_release(corner);
    ca_scene_release(box);
    return 0;
}

#define BDPM "bdpm:max_depth=5,camera_diffuse_depth=1,radius=0.35,alpha=0"

static void test_same_bits(void **state)
{
    (void)state;
    check_pair_bits(corner, BDPM, 5000, 4);
    check_pair_bits(corner, BDPM, 5000, 1);
    check_pair_bits(corner, "ppm:radius=0.2", 5000, 3);
}

static void test_values(void **state)
{
    (void)state;
    check_pair_values(corner, &(pair_render){BDPM, 1000, 1, 5, 2, 7, NULL, 0, NULL, 0});
    check_pair_values(corner, &(pair_render){BDPM, 1000, 4, 5, 2, 7, NULL, 0, NULL, 0});
}

/* ---- The law of noise ------------------------------------------------------------------------------------------ */

/* Equation (6) and the sample variance, both without bias. */
static double predicted_variance(const ca_pair_pixel *p, double light_paths, double camera_paths)
{
    const double n = (double)p->iterations, sum = p->sums[CA_PAIR_VALUE];
    const double l2 = (sum * sum - p->products[0]) / (n * (n - 1.0)), nf = 1.0 / light_paths, nb = 1.0 / camera_paths;
    return (p->sums[CA_PAIR_PAIR] / n - l2) * nf * nb + (1.0 - nf) * (p->sums[CA_PAIR_CAMERA] / n - l2) * nb +
           (1.0 - nb) * (p->sums[CA_PAIR_LIGHT] / n - l2) * nf;
}

static double measured_variance(const ca_pair_pixel *p)
{
    const double n = (double)p->iterations, sum = p->sums[CA_PAIR_VALUE];
    return (p->products[0] - sum * sum / n) / (n - 1.0);
}

enum { RENDERS = 50 };

/* The prediction made with one pair of numbers for another, against the variance there, by independent renders of
 * each: in all pixels, and summed over the image, relative to luminances, which tells a smaller error. (Not to the
 * measured variances: what is large by chance in them would count for less, which is a bias.) */
static void check_law(const ca_scene *scene, const pair_render *estimated, const pair_render *measured,
                      double most_error)
{
    sample_mean differences[CROP_PIXELS] = {{0}}, average = {0};
    double values[RENDERS][CROP_PIXELS], variances[CROP_PIXELS] = {0}, luminances[CROP_PIXELS] = {0}, variance = 0.0;
    const bool same =
        estimated->light_paths == measured->light_paths && estimated->camera_paths == measured->camera_paths;
    for (int k = 0; k < RENDERS; k++) {
        pair_render a = *estimated, b = *measured;
        ca_pair_film film_a, film_b;
        a.seed = (uint64_t)k;
        b.seed = (uint64_t)k + 1000;
        ca_image_release(render_pairs(scene, &a, &film_a));
        if (same)
            film_b = film_a; /* errors that the two share cancel */
        else
            ca_image_release(render_pairs(scene, &b, &film_b));
        for (int p = 0; p < CROP_PIXELS; p++) {
            const double here = measured_variance(&film_b.pixels[p]);
            values[k][p] = predicted_variance(&film_a.pixels[p], b.light_paths, b.camera_paths) - here;
            add_sample(&differences[p], values[k][p]);
            variances[p] += here / RENDERS;
            luminances[p] += film_a.pixels[p].sums[CA_PAIR_VALUE] / (double)film_a.pixels[p].iterations / RENDERS;
        }
        ca_pair_film_destroy(&film_a);
        if (!same) ca_pair_film_destroy(&film_b);
    }
    for (int p = 0; p < CROP_PIXELS; p++) variance += variances[p] / (luminances[p] * luminances[p]);
    for (int k = 0; k < RENDERS; k++) {
        double sum = 0.0;
        for (int p = 0; p < CROP_PIXELS; p++) sum += values[k][p] / (luminances[p] * luminances[p]);
        add_sample(&average, sum / variance);
    }
    const double off = average.sum / RENDERS, error = error_of(&average, RENDERS);
    print_message("N_F %u, N_B %u for %u, %u: the variance is predicted by %+.2f %% +- %.2f %%\n",
                  estimated->light_paths, estimated->camera_paths, measured->light_paths, measured->camera_paths,
                  100.0 * off, 100.0 * error);
    assert_true(error <= most_error);
    assert_true(fabs(off) <= 3.5 * error);
    for (int p = 0; p < CROP_PIXELS; p++)
        if (!(fabs(differences[p].sum / RENDERS) <= 4.8 * error_of(&differences[p], RENDERS)))
            fail_msg("pixel %d: the predicted variance is off by %g +- %g", p, differences[p].sum / RENDERS,
                     error_of(&differences[p], RENDERS));
}

static void test_law(void **state)
{
    (void)state;
    const pair_render r = {BDPM, 200, 4, 60, 2, 0, NULL, 0, NULL, 0};
    check_law(corner, &r, &r, 0.02);
}

/* In the box, and each term of the law by numbers that make it the largest. */
static void test_law_elsewhere(void **state)
{
    (void)state;
    const char *const integrator = "bdpm:max_depth=7,rr_depth=8,camera_diffuse_depth=1,radius=0.5,alpha=0";
    const pair_render few = {integrator, 20, 2, 40, 2, 0, NULL, 0, NULL, 0},
                      camera = {integrator, 200, 2, 40, 2, 0, NULL, 0, NULL, 0},
                      light = {integrator, 20, 16, 40, 2, 0, NULL, 0, NULL, 0};
    check_law(box, &few, &few, 0.03);
    check_law(box, &few, &light, 0.03);
    check_law(box, &few, &camera, 0.04);
}

/* ---- Refusals and failures ------------------------------------------------------------------------------------- */

static void test_refusals(void **state)
{
    (void)state;
    static const struct {
        pair_render render;
        const char *says;
    } cases[] = {
        {{"bdpt:max_depth=3", 2, 3, 1, 1, 1, NULL, 0, NULL, 0}, "a light path of its own"},
        {{"vcm:max_depth=3", 100, 2, 1, 1, 1, "sobol", 0, NULL, 0}, "integrator \"vcm\""},
        {{BDPM, 100, 2, 1, 1, 1, "halton", 0, NULL, 0}, "sampler \"independent\""},
        {{BDPM, 100, 2, 1, 1, 1, "sobol", 0, NULL, 0}, "sampler \"independent\""},
        {{BDPM, 1, 2, 1, 1, 1, NULL, 0, NULL, 0}, "at least 2 light paths"},
        {{"bdpm:max_depth=2,radius=0.1", 600000, 1, 1, 1, 1, NULL, 30, NULL, 0}, "must fit the memory at once"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        ca_pair_film film;
        ca_image_layers *image;
        ca_error error = {0};
        const ca_status status = try_pair_render(corner, &cases[i].render, &film, &image, &error);
        if (status != CA_ERROR_UNSUPPORTED || !strstr(error.message, cases[i].says))
            fail_msg("case %zu: status %d, %s", i, (int)status, error.message);
    }
}

static void test_qmcppm_is_refused(void **state)
{
    (void)state;
    const ca_render_settings settings = {.integrator = "qmcppm", .samples_per_pixel = 1, .threads = 1};
    const uint32_t crop[4] = {0, 0, 10, 9};
    ca_render_plan plan;
    ca_pair_film film;
    ca_image_layers *image;
    ca_error error;
    assert_int_equal(ca_render_plan_make(&plan, corner, &settings, NULL), CA_OK);
    assert_int_equal(ca_pair_film_create(&film, crop, 90, 1, NULL), CA_OK);
    plan.input.pairs = &film;
    assert_int_equal(ca_render_plan_run(&plan, &image, NULL, &error), CA_ERROR_UNSUPPORTED);
    assert_non_null(strstr(error.message, "blocks"));
    ca_pair_film_destroy(&film);
}

static void test_allocation_failures(void **state)
{
    (void)state;
    check_pair_allocations(corner, &(pair_render){BDPM, 2000, 2, 1, 1, 1, NULL, 0, NULL, 0}, 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_product_indices),
        cmocka_unit_test(test_sums),
        cmocka_unit_test(test_means),
        cmocka_unit_test(test_sums_of_connections),
        cmocka_unit_test(test_pool),
        cmocka_unit_test(test_film_out_of_memory),
        cmocka_unit_test(test_same_bits),
        cmocka_unit_test(test_values),
        cmocka_unit_test(test_law),
        cmocka_unit_test(test_law_elsewhere),
        cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_qmcppm_is_refused),
        cmocka_unit_test(test_allocation_failures),
    };
    return cmocka_run_group_tests(tests, load_scenes, release_scenes);
}
