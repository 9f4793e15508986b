/* Error bars of renders: what their replicates are, how often intervals hold, and what is said where there are
 * none. */
#include "base/hash.h"
#include "film/film.h"
#include "image/layers.h"
#include "render/render.h"
#include "support/interval_tally.h"
#include "support/scene_text.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static const char *const scene_text =
    "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' value='4'/></integrator>"
    "<sensor type='perspective'><float name='fov' value='50'/>"
    "<transform name='to_world'><lookat origin='0,1.5,-4' target='0,0.6,0' up='0,1,0'/></transform>"
    "<sampler type='independent'><integer name='sample_count' value='64'/></sampler>"
    "<film type='hdrfilm'><integer name='width' value='32'/><integer name='height' value='24'/>"
    "<rfilter type='box'/></film></sensor>"
    "<shape type='rectangle'><transform name='to_world'><rotate x='1' angle='-90'/><scale value='4'/></transform>"
    "<bsdf type='diffuse'><rgb name='reflectance' value='0.3,0.5,0.7'/></bsdf></shape>"
    "<shape type='sphere'><point name='center' value='0,0.5,0'/><float name='radius' value='0.5'/>"
    "<bsdf type='diffuse'/></shape>"
    "<shape type='disk'><transform name='to_world'><rotate x='1' angle='90'/><translate y='3'/></transform>"
    "<bsdf type='diffuse'/><emitter type='area'><rgb name='radiance' value='5'/></emitter></shape></scene>";

typedef struct render_case {
    const char *integrator, *sampler;
    uint32_t samples, replicates;
} render_case;

static ca_render_settings settings_of(const render_case *c, uint64_t seed)
{
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.integrator = c->integrator;
    settings.sampler = c->sampler;
    settings.samples_per_pixel = c->samples;
    settings.replicates = c->replicates;
    settings.has_seed = true;
    settings.seed = seed;
    return settings;
}

static void test_calibration_of_renders(void **state)
{
    (void)state;
    static const render_case cases[] = {{"path", "independent", 64, 0},    {"path", "independent", 128, 32},
                                        {"path", "sobol", 256, 64},        {"path", "halton", 128, 32},
                                        {"bdpm:alpha=0", "lattice", 64, 32}, {"ovcm:alpha=0", "independent", 64, 0}};
    ca_scene *scene = scene_from_text(scene_text);
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const ca_render_settings settings = settings_of(&cases[i], 100);
        const interval_tally tally = tally_intervals(scene, &settings, 9, "G");
        const double held = tally_fraction(&tally), widened = (double)tally.widened / (double)tally.pixels;
        printf("    %-14s %-12s %3u samples, %2u replicates: %.2f %% held; %.1f %% widened, %.2f %% of these held\n",
               cases[i].integrator, cases[i].sampler, cases[i].samples, cases[i].replicates, 100.0 * held,
               100.0 * widened, 100.0 * tally_widened_fraction(&tally));
        if (!(held > 0.93 && held < 0.97 && widened < 0.3 && tally.marked == 0))
            fail_msg("%s, %s: %.4f held", cases[i].integrator, cases[i].sampler, held);
        if (!(tally_widened_fraction(&tally) > 0.93))
            fail_msg("%s, %s: %.4f of the widened held", cases[i].integrator, cases[i].sampler,
                     tally_widened_fraction(&tally));
    }
    ca_scene_release(scene);
}

static uint64_t hash_of(const ca_scene *scene, const render_case *c, uint32_t threads)
{
    ca_render_settings settings = settings_of(c, 3);
    settings.threads = threads;
    return rendered_hash(scene, &settings);
}

static void test_threads_do_not_change_a_bit(void **state)
{
    (void)state;
    static const render_case cases[] = {{"path", "zsobol", 32, 8},
                                        {"bdpm", "halton", 24, 8},
                                        {"ovcm", "sobol", 24, 8},
                                        {"bdpt", "independent", 24, 8}};
    ca_scene *scene = scene_from_text(scene_text);
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++)
        assert_true(hash_of(scene, &cases[i], 1) == hash_of(scene, &cases[i], 3));
    ca_scene_release(scene);
}

/* With a sequence the image is the mean of whole renders, each with one replicate's samples and seed, and the same
 * first radius (the default depends on the seed). */
static void test_replicates_are_renders(void **state)
{
    (void)state;
    enum { REPLICATES = 8 };
    static const render_case all = {"bdpm:radius=0.05", "sobol", 32, REPLICATES};
    static const render_case one = {"bdpm:radius=0.05", "sobol", 4, 0};
    ca_scene *scene = scene_from_text(scene_text);
    ca_render_settings settings = settings_of(&all, 5);
    ca_image_layers *image = render_scene(scene, &settings);
    static double sum[32 * 24];
    for (uint64_t r = 0; r < REPLICATES; r++) {
        settings = settings_of(&one, ca_hash_add(ca_hash_add(CA_HASH_START, 5), r));
        ca_image_layers *part = render_scene(scene, &settings);
        for (int i = 0; i < 32 * 24; i++) sum[i] += (double)ca_layers_find(part, "B")[i] / REPLICATES;
        ca_image_release(part);
    }
    for (int i = 0; i < 32 * 24; i++) {
        const double value = (double)ca_layers_find(image, "B")[i];
        if (!(fabs(value - sum[i]) <= 1e-5 * fabs(sum[i]))) fail_msg("%.12g is not %.12g", value, sum[i]);
    }
    ca_image_release(image);
    ca_scene_release(scene);
}

/* With independent numbers the replicates only group passes: the image is the same. With a sequence they are not
 * alike. */
static void test_what_replicates_are(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(scene_text);
    const render_case alone = {"bdpm", "independent", 24, 0}, groups = {"bdpm", "independent", 24, 8};
    ca_render_settings settings = settings_of(&alone, 1);
    ca_image_layers *a = render_scene(scene, &settings);
    settings = settings_of(&groups, 1);
    ca_image_layers *b = render_scene(scene, &settings);
    assert_memory_equal(ca_layers_find(a, "R"), ca_layers_find(b, "R"), 32 * 24 * sizeof(float));
    assert_memory_equal(ca_layers_find(a, "Variance.R"), ca_layers_find(b, "Variance.R"), 32 * 24 * sizeof(float));
    ca_image_release(a);
    ca_image_release(b);

    const render_case sequence = {"path", "sobol", 64, 0}, scrambled = {"path", "sobol", 64, 8};
    settings = settings_of(&sequence, 1);
    a = render_scene(scene, &settings);
    assert_null(ca_layers_find(a, "ConfidenceLow.R"));
    settings = settings_of(&scrambled, 1);
    b = render_scene(scene, &settings);
    assert_non_null(ca_layers_find(b, "ConfidenceLow.R"));
    uint32_t wide = 0;
    for (uint32_t i = 0; i < 32 * 24; i++)
        wide += ca_layers_find(b, "ConfidenceHigh.G")[i] > 1.0001f * ca_layers_find(b, "G")[i];
    assert_true(wide > 32 * 24 / 2);
    ca_image_release(a);
    ca_image_release(b);
    ca_scene_release(scene);
}

static void test_record(void **state)
{
    (void)state;
    static const struct {
        render_case render;
        const char *says;
    } cases[] = {
        {{"path", "independent", 9, 0}, "95 % for the expectation, from 9 replicates: independent passes"},
        {{"bdpm", "independent", 16, 8},
         "95 % for the expectation at the merge radii of its passes, from 8 replicates: groups of 2 independent "
         "passes"},
        {{"path", "lattice", 32, 8},
         "95 % for the expectation, from 8 replicates: independent scramblings of 4 passes each"},
        {{"path", "sobol-plain", 4, 0},
         "none: the samples of one sequence (sobol-plain) are not independent of each other; replicates are"},
    };
    ca_scene *scene = scene_from_text(scene_text);
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        ca_render_settings settings = settings_of(&cases[i].render, 1);
        ca_image_layers *image = render_scene(scene, &settings);
        assert_string_equal(attribute_text(image, "caustica.confidence"), cases[i].says);
        ca_image_release(image);
    }
    ca_scene_release(scene);
}

static void expect_refusal(const ca_scene *scene, const render_case *c, double seconds, const char *part)
{
    ca_render_settings settings = settings_of(c, 1);
    ca_image_layers *image = NULL;
    ca_error error = {""};
    settings.seconds = seconds;
    assert_int_equal(ca_render(scene, &settings, &image, NULL, &error), CA_ERROR_ARGUMENT);
    assert_null(image);
    if (!strstr(error.message, part)) fail_msg("\"%s\" lacks \"%s\"", error.message, part);
}

static void test_refusals(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(scene_text);
    expect_refusal(scene, &(render_case){"path", "sobol", 64, 1}, 0.0, "at least 2");
    expect_refusal(scene, &(render_case){"path", "sobol", 63, 8}, 0.0, "63 passes, which is not a multiple of 8");
    expect_refusal(scene, &(render_case){"path", "halton-plain", 64, 8}, 0.0, "halton-plain");
    expect_refusal(scene, &(render_case){"path", "sobol-plain", 64, 8}, 0.0, "all be the same");
    expect_refusal(scene, &(render_case){"path", "sobol", 0, 8}, 1.0, "instead of a time");
    expect_refusal(scene, &(render_case){"qmcppm", NULL, 64, 8}, 0.0, "qmcppm");
    ca_scene_release(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_calibration_of_renders),
        cmocka_unit_test(test_threads_do_not_change_a_bit),
        cmocka_unit_test(test_replicates_are_renders),
        cmocka_unit_test(test_what_replicates_are),
        cmocka_unit_test(test_record),
        cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
