/* What the bidirectional engine measures where camera paths connect to light paths of their own, and light paths
 * splat: it changes nothing of the image, tells its value, and the law of noise (docs/papers/000.md, sections B and
 * C) holds against the variance there is. Of the estimators alone: test_pair_connections.c. */
#include "noise/components.h"
#include "support/pair_render.h"
#include "support/sample_mean.h"
#include "support/scene_text.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

/* A room with walls, a ball and a lamp in view; the filter has negative lobes. Behind glass light is rare and bright,
 * so that sums of few iterations are skewed: for comparing variances the ball is matt. `more`: a second lamp, as
 * strong, in a black shell, which half of the light paths come from: they bring nothing, so that all that one brings
 * hangs together. */
#define ROOM(ball, more)                                                                                             \
    "<scene version='3.0.0'><sensor type='perspective'><float name='fov' value='60'/><transform name='to_world'>"    \
    "<lookat origin='0,0,0.95' target='0,-0.1,0' up='0,1,0'/></transform><film type='hdrfilm'>"                      \
    "<integer name='width' value='" PAIR_FILM_WIDTH "'/><integer name='height' value='" PAIR_FILM_HEIGHT "'/>"       \
    "<rfilter type='mitchell'/></film></sensor>"                                                                     \
    "<shape type='cube'><bsdf type='twosided'><bsdf type='diffuse'><rgb name='reflectance' "                         \
    "value='0.8,0.7,0.5'/></bsdf></bsdf>"                                                                            \
    "</shape>"                                                                                                       \
    "<shape type='sphere'><float name='radius' value='0.3'/><point name='center' x='0.4' y='-0.6' z='-0.3'/>"        \
    "<bsdf type='" ball "'/></shape>"                                                                                \
    "<shape type='rectangle'><transform name='to_world'><scale value='0.3'/><rotate x='1' angle='100'/>"             \
    "<translate x='-0.3' y='0.5' z='-0.4'/></transform><bsdf type='diffuse'/>"                                       \
    "<emitter type='area'><rgb name='radiance' "                                                                     \
    "value='3,3,2'/></emitter>"                                                                                      \
    "</shape>" more "</scene>"

#define HIDDEN_LAMP                                                                                                  \
    "<shape type='sphere'><float name='radius' value='0.17'/><point name='center' x='9' y='0' z='0'/>"               \
    "<bsdf type='diffuse'/>"                                                                                         \
    "<emitter type='area'><rgb name='radiance' value='3,3,2'/></emitter></shape>"                                    \
    "<shape type='sphere'><float name='radius' value='0.5'/><point name='center' x='9' y='0' z='0'/>"                \
    "<bsdf type='twosided'><bsdf type='diffuse'><rgb name='reflectance' value='0'/></bsdf></bsdf></shape>"

static ca_scene *glass, *matt, *hidden;

static int load_scenes(void **state)
{
    (void)state;
    glass = scene_from_text(ROOM("dielectric", ""));
    matt = scene_from_text(ROOM("diffuse", ""));
    hidden = scene_from_text(ROOM("diffuse", HIDDEN_LAMP));
    return 0;
}

static int release_scenes(void **state)
{
    (void)state;
    ca_scene_release(glass);
    ca_scene_release(matt);
    ca_scene_release(hidden);
    return 0;
}

#define ROOM_DEPTHS "max_depth=5,rr_depth=6"
static const char *const integrators[] = {
    "vcm:" ROOM_DEPTHS ",radius=0.1,alpha=0",
    "ovcm:" ROOM_DEPTHS ",radius=0.1,alpha=0",
    "bdpt:" ROOM_DEPTHS,
    "bdpt:" ROOM_DEPTHS ",strategies=no-splat",
};
enum { INTEGRATORS = sizeof integrators / sizeof integrators[0] };

static void test_same_bits(void **state)
{
    (void)state;
    for (int i = 0; i < INTEGRATORS; i++) check_pair_bits(glass, integrators[i], 600, 3);
}

static void test_values(void **state)
{
    (void)state;
    for (int i = 0; i < INTEGRATORS; i++)
        check_pair_values(glass, &(pair_render){integrators[i], 300, 4, 4, 2, 5, NULL, 0, NULL, 0});
}

/* ---- The law --------------------------------------------------------------------------------------------------- */

enum { RENDERS = 20 };

/* Sums over pixels of what one render tells, each over the pixel's squared luminance, so that all count. */
typedef struct told {
    double predicted, measured, connect;
} told;

static told told_by(const ca_pair_film *film, const double luminance[CROP_PIXELS])
{
    told t = {0};
    for (size_t p = 0; p < CROP_PIXELS; p++) {
        const ca_noise_terms terms = ca_noise_terms_at(film, p, film->light_paths, film->camera_paths);
        const double weight = 1.0 / (luminance[p] * luminance[p]);
        t.predicted += weight * terms.predicted.value;
        t.measured += weight * terms.measured.value;
        t.connect += weight * terms.connect.value;
    }
    return t;
}

/* Of a long render with other numbers. */
static void find_luminances(const ca_scene *scene, const pair_render *r, double luminance[CROP_PIXELS])
{
    const pair_render longer = {r->integrator, 4 * r->light_paths, r->camera_paths, 50, 2, 999, NULL, 0, NULL, 0};
    ca_pair_film film;
    ca_image_release(render_pairs(scene, &longer, &film));
    for (int p = 0; p < CROP_PIXELS; p++)
        luminance[p] = film.pixels[p].sums[CA_PAIR_VALUE] / (double)film.pixels[p].iterations;
    ca_pair_film_destroy(&film);
}

/* The prediction against the variance of the same iterations: errors that the two share cancel. */
static void check_law(const ca_scene *scene, const pair_render *r, double most_error)
{
    double luminance[CROP_PIXELS], measured = 0.0, connect = 0.0;
    sample_mean difference = {0};
    told all[RENDERS];
    find_luminances(scene, r, luminance);
    for (int k = 0; k < RENDERS; k++) {
        pair_render one = *r;
        ca_pair_film film;
        one.seed = (uint64_t)k;
        ca_image_release(render_pairs(scene, &one, &film));
        all[k] = told_by(&film, luminance);
        measured += all[k].measured / RENDERS;
        connect += all[k].connect / RENDERS;
        ca_pair_film_destroy(&film);
    }
    for (int k = 0; k < RENDERS; k++) add_sample(&difference, (all[k].predicted - all[k].measured) / measured);
    const double off = difference.sum / RENDERS, error = error_of(&difference, RENDERS);
    print_message("%.24s N_F %u, N_B %u: the variance is predicted by %+.2f %% +- %.2f %%; the connections' term is "
                  "%.1f %% of it\n",
                  r->integrator, r->light_paths, r->camera_paths, 100.0 * off, 100.0 * error,
                  100.0 * connect / measured);
    assert_true(error <= most_error);
    assert_true(fabs(off) <= 3.5 * error);
    assert_true(connect > 5.0 * error * measured); /* without it the law would be seen to fail */
}

static void test_law(void **state)
{
    (void)state;
    check_law(matt, &(pair_render){integrators[0], 60, 4, 25, 2, 0, NULL, 0, NULL, 0}, 0.012);
    check_law(matt, &(pair_render){integrators[1], 60, 4, 25, 2, 0, NULL, 0, NULL, 0}, 0.012);
    check_law(matt, &(pair_render){integrators[2], 12, 12, 60, 2, 0, NULL, 0, NULL, 0}, 0.008);
    check_law(matt, &(pair_render){integrators[3], 60, 4, 25, 2, 0, NULL, 0, NULL, 0}, 0.012);
    /* Where it matters which light path a camera path is connected to. */
    check_law(hidden, &(pair_render){integrators[0], 12, 12, 25, 2, 0, NULL, 0, NULL, 0}, 0.03);
}

/* ---- Refusals and failures ------------------------------------------------------------------------------------- */

static void test_refusals(void **state)
{
    (void)state;
    ca_pair_film film;
    ca_image_layers *image;
    ca_error error = {0};
    const pair_render r = {integrators[0], 3, 4, 2, 1, 0, NULL, 0, NULL, 0};
    assert_int_equal(try_pair_render(glass, &r, &film, &image, &error), CA_ERROR_UNSUPPORTED);
    assert_non_null(strstr(error.message, "a light path of its own"));
}

static void test_allocation_failures(void **state)
{
    (void)state;
    check_pair_allocations(glass, &(pair_render){integrators[0], 300, 4, 1, 1, 1, NULL, 0, NULL, 0}, 2);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_same_bits), cmocka_unit_test(test_values),
        cmocka_unit_test(test_law),       cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_allocation_failures),
    };
    return cmocka_run_group_tests_name("noise of connections, rendered", tests, load_scenes, release_scenes);
}
