/* Noise with other numbers of paths than those measured with, where weights contain these numbers: the same paths,
 * weighted anew, tell it (ca_pair_film_add_others). */
#include "noise/components.h"
#include "support/pair_render.h"
#include "support/sample_mean.h"
#include "support/scene_text.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

/* A room with a matt ball and a lamp in view. */
static const char *const room =
    "<scene version='3.0.0'><sensor type='perspective'><float name='fov' value='60'/><transform name='to_world'>"
    "<lookat origin='0,0,0.95' target='0,-0.1,0' up='0,1,0'/></transform><film type='hdrfilm'>"
    "<integer name='width' value='" PAIR_FILM_WIDTH "'/><integer name='height' value='" PAIR_FILM_HEIGHT "'/>"
    "<rfilter type='mitchell'/></film></sensor>"
    "<shape type='cube'><bsdf type='twosided'><bsdf type='diffuse'><rgb name='reflectance' "
    "value='0.8,0.7,0.5'/></bsdf></bsdf></shape>"
    "<shape type='sphere'><float name='radius' value='0.3'/><point name='center' x='0.4' y='-0.6' z='-0.3'/>"
    "<bsdf type='diffuse'/></shape>"
    "<shape type='rectangle'><transform name='to_world'><scale value='0.3'/><rotate x='1' angle='100'/>"
    "<translate x='-0.3' y='0.5' z='-0.4'/></transform><bsdf type='diffuse'/>"
    "<emitter type='area'><rgb name='radiance' value='3,3,2'/></emitter></shape></scene>";

#define ROOM_DEPTHS "max_depth=5,rr_depth=6"
static const char *const integrators[] = {
    "vcm:" ROOM_DEPTHS ",radius=0.1,alpha=0",
    "vavcm:" ROOM_DEPTHS ",radius=0.1,alpha=0",
    "bdpt:" ROOM_DEPTHS,
    "ovcm:" ROOM_DEPTHS ",radius=0.1,alpha=0",
};
enum { VAVCM = 1, INTEGRATORS = sizeof integrators / sizeof integrators[0], PREDICTED = 3 };

enum { RENDERS = 6, ITERATIONS = 50, LIGHT_PATHS = 60, CAMERA_PATHS = 4 };
enum { MORE_LIGHT, FEWER_LIGHT, OTHERS };
static const ca_pair_numbers others[OTHERS] = {{300, 4}, {12, 4}};

static ca_scene *scene;

static int load_scene(void **state)
{
    (void)state;
    scene = scene_from_text(room);
    return 0;
}

static int release_scene(void **state)
{
    (void)state;
    ca_scene_release(scene);
    return 0;
}

static pair_render measuring(const char *integrator, uint64_t seed)
{
    return (pair_render){integrator, LIGHT_PATHS, CAMERA_PATHS, ITERATIONS, 2, seed, NULL, 0, others, OTHERS};
}

/* The pixel's squared luminance makes all of them count. */
static double weight_of(const ca_pair_film *film, size_t p)
{
    const double luminance = film->pixels[p].sums[CA_PAIR_VALUE] / (double)film->pixels[p].iterations;
    return 1.0 / (luminance * luminance);
}

/* ---- Predictions ----------------------------------------------------------------------------------------------- */

/* Of several renders: what is predicted for other numbers, by their weights and by those measured with; and what is
 * measured with these numbers. */
typedef struct variances {
    sample_mean predicted[OTHERS], unchanged[OTHERS], measured[OTHERS];
} variances;

static void predict(const char *integrator, uint64_t seed, double weights[CROP_PIXELS], variances *v)
{
    const pair_render r = measuring(integrator, seed);
    ca_pair_film film;
    ca_image_release(render_pairs(scene, &r, &film));
    for (size_t p = 0; p < CROP_PIXELS && seed == 0; p++) weights[p] = weight_of(&film, p);
    for (uint32_t i = 0; i < OTHERS; i++) {
        double predicted = 0.0, unchanged = 0.0;
        for (size_t p = 0; p < CROP_PIXELS; p++) {
            predicted += weights[p] * ca_noise_terms_of_other(&film, i, p).predicted.value;
            unchanged += weights[p] *
                         ca_noise_terms_at(&film, p, others[i].light_paths, others[i].camera_paths).predicted.value;
        }
        add_sample(&v->predicted[i], predicted);
        add_sample(&v->unchanged[i], unchanged);
    }
    ca_pair_film_destroy(&film);
}

static void measure(const char *integrator, uint64_t seed, const double weights[CROP_PIXELS], variances *v)
{
    for (uint32_t i = 0; i < OTHERS; i++) {
        pair_render r = measuring(integrator, seed);
        ca_pair_film film;
        double measured = 0.0;
        r.light_paths = others[i].light_paths;
        r.camera_paths = others[i].camera_paths;
        r.other_count = 0;
        ca_image_release(render_pairs(scene, &r, &film));
        for (size_t p = 0; p < CROP_PIXELS; p++)
            measured += weights[p] * ca_noise_terms_at(&film, p, 60.0, 4.0).measured.value;
        add_sample(&v->measured[i], measured);
        ca_pair_film_destroy(&film);
    }
}

/* Within three and a half standard errors, where without other weights it is off by many. */
static void check_prediction(const char *integrator, const variances *v, uint32_t i)
{
    const double measured = v->measured[i].sum / RENDERS, n = RENDERS;
    const double off = v->predicted[i].sum / RENDERS / measured - 1.0;
    const double error = hypot(error_of(&v->predicted[i], n), error_of(&v->measured[i], n)) / measured;
    const double without = v->unchanged[i].sum / RENDERS / measured - 1.0;
    print_message("%.5s N_F %u, N_B %u from %u, %u: the variance is predicted by %+.2f %% +- %.2f %%; with the "
                  "weights of these by %+.2f %%\n",
                  integrator, others[i].light_paths, others[i].camera_paths, LIGHT_PATHS, CAMERA_PATHS, 100.0 * off,
                  100.0 * error, 100.0 * without);
    assert_true(error <= 0.035 && fabs(off) <= 3.5 * error);
    assert_true(i != MORE_LIGHT || fabs(without) > 4.0 * error);
}

static void test_predictions(void **state)
{
    (void)state;
    for (int k = 0; k < PREDICTED; k++) {
        variances v = {0};
        double weights[CROP_PIXELS];
        for (uint64_t seed = 0; seed < RENDERS; seed++) {
            predict(integrators[k], seed, weights, &v);
            measure(integrators[k], seed, weights, &v);
        }
        for (uint32_t i = 0; i < OTHERS; i++) check_prediction(integrators[k], &v, i);
    }
}

/* ---- What does not change -------------------------------------------------------------------------------------- */

static void check_coefficients(const ca_pair_film *film, const ca_pair_film *other, size_t pixel, double variance)
{
    const ca_noise_coefficients c = ca_noise_coefficients_at(film, other, pixel);
    const double sum = ca_noise_variance(&c, LIGHT_PATHS, CAMERA_PATHS);
    assert_true(fabs(sum - variance) <= 1e-9 * (fabs(c.pair) + fabs(c.camera) + fabs(c.light) + fabs(c.connected)));
}

/* The film's own sums are those of a measurement without others; and others that have its own numbers, its sums. */
static void test_own_numbers(void **state)
{
    (void)state;
    static const ca_pair_numbers own = {LIGHT_PATHS, CAMERA_PATHS};
    for (int k = 0; k < INTEGRATORS; k++) {
        pair_render r = measuring(integrators[k], 5);
        ca_pair_film with, without;
        r.passes = 4;
        r.others = &own;
        r.other_count = 1;
        ca_image_release(render_pairs(scene, &r, &with));
        r.other_count = 0;
        ca_image_release(render_pairs(scene, &r, &without));
        assert_memory_equal(with.pixels, without.pixels, CROP_PIXELS * sizeof *with.pixels);
        assert_memory_equal(with.connections, without.connections, CROP_PIXELS * sizeof *with.connections);
        for (size_t p = 0; p < CROP_PIXELS; p++) {
            const double same = ca_noise_terms_at(&with, p, LIGHT_PATHS, CAMERA_PATHS).predicted.value;
            const double other = ca_noise_terms_of_other(&with, 0, p).predicted.value;
            const double luminance = with.pixels[p].sums[CA_PAIR_VALUE] / 4.0;
            assert_true(fabs(same - other) <= 1e-4 * (fabs(same) + luminance * luminance));
            check_coefficients(&with, NULL, p, same);
            check_coefficients(&with, &with.others[0], p, other);
        }
        ca_pair_film_destroy(&with);
        ca_pair_film_destroy(&without);
    }
}

/* To the bit, for any number of threads. */
static void test_threads(void **state)
{
    (void)state;
    ca_pair_film films[2];
    for (uint32_t t = 0; t < 2; t++) {
        pair_render r = measuring(integrators[VAVCM], 7);
        r.passes = 3;
        r.threads = 1 + 2 * t;
        ca_image_release(render_pairs(scene, &r, &films[t]));
    }
    for (uint32_t i = 0; i < OTHERS; i++) {
        const ca_pair_film *a = &films[0].others[i], *b = &films[1].others[i];
        assert_memory_equal(a->means, b->means, CROP_PIXELS * sizeof *a->means);
        assert_memory_equal(a->connected_means, b->connected_means, CROP_PIXELS * sizeof *a->connected_means);
    }
    for (uint32_t t = 0; t < 2; t++) ca_pair_film_destroy(&films[t]);
}

static void test_allocation_failures(void **state)
{
    (void)state;
    pair_render r = {integrators[VAVCM], 300, 4, 1, 1, 1, NULL, 0, others, 2};
    check_pair_allocations(scene, &r, 2);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_predictions),
        cmocka_unit_test(test_own_numbers),
        cmocka_unit_test(test_threads),
        cmocka_unit_test(test_allocation_failures),
    };
    return cmocka_run_group_tests_name("noise with other numbers of paths", tests, load_scene, release_scene);
}
