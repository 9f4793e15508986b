/* Light that only merging finds (specular, diffuse, specular): through the glass egg of veach-bidir and under the
 * water of water-caustic. With lights so large that `path` converges, it is the reference. With the scenes' small
 * lights, what merging algorithms find must be the same, and `path` and `bdpt` find next to nothing of it in the same
 * number of samples. */
#include "metrics/compare.h"
#include "support/batches.h"
#include "support/scene_text.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* ---- Scenes ---------------------------------------------------------------------------------------------------- */

/* A piece of the scene file, and what stands there instead. */
typedef struct replacement {
    const char *from, *to;
} replacement;

static char *read_text(const char *folder, const char *name)
{
    char path[1024];
    snprintf(path, sizeof path, "%s/%s/scene.xml", folder, name);
    FILE *file = fopen(path, "rb");
    if (!file) fail_msg("cannot read %s", path);
    enum { LIMIT = 1 << 16 };
    char *text = calloc(1, LIMIT);
    assert_non_null(text);
    assert_true(fread(text, 1, LIMIT - 1, file) < LIMIT - 1);
    fclose(file);
    return text;
}

/* A new text with the only occurrence of `from` replaced; frees the old one. */
static char *replace(char *text, replacement change)
{
    char *at = strstr(text, change.from);
    if (!at || strstr(at + 1, change.from)) fail_msg("\"%s\" is not in the scene exactly once", change.from);
    const size_t size = strlen(text) + strlen(change.to) + 1;
    char *result = malloc(size);
    assert_non_null(result);
    snprintf(result, size, "%.*s%s%s", (int)(at - text), text, change.to, at + strlen(change.from));
    free(text);
    return result;
}

/* The scene with changes; NULL (and the test is to be skipped) where the shared scenes are missing. */
static ca_scene *changed_scene(const char *name, const replacement *changes, size_t count)
{
    const char *folder = reference_scenes();
    if (!folder) return NULL;
    char root[1200];
    snprintf(root, sizeof root, "<scene version=\"3.0.0\"><path value=\"%s/%s\"/>", folder, name);
    char *text = replace(read_text(folder, name), (replacement){"<scene version=\"3.0.0\">", root});
    for (size_t i = 0; i < count; i++) text = replace(text, changes[i]);
    ca_scene *scene = scene_from_text(text);
    free(text);
    return scene;
}

/* The spot lamp becomes a square of side 2 m before its housing, the standard lamp one of 2.2 m over its dish. */
static const replacement large_lights_of_veach_bidir[] = {
    {"-0.0101082 0.067068 0.00138972 -2.69082 -0.0610016 -0.0070995 -0.00842772 5.10417 -0.0282857 -0.00865658 "
     "0.0176788 "
     "-3.77057",
     "-0.15 0.98 0.07 -2.6 -0.894 -0.104 -0.429 4.55 -0.414 -0.127 0.9 -2.6"},
    {"12048.2, 8605.84, 6196.21", "56, 40, 29"},
    {"-1.20536e-008 0.275755 1.20536e-008 -2.48161 0 -6.64767e-009 0.152081 6 0.275754 1.20536e-008 5.2688e-016 "
     "2.5894",
     "0 1.1 0 -2.48161 0 0 1 6.5 1.1 0 0 2.5894"},
    {"523.258, 523.258, 523.258", "33, 33, 33"},
};

/* 5 mm by 4 mm become 1.4 m by 1.4 m. */
static const replacement large_light_of_water_caustic[] = {
    {"-0.0025 1.91069e-015 -4.37114e-008 -0.005 2.18557e-010 2.18557e-008 -0.5 1.98 0 -0.002 -8.74228e-011 -0.03",
     "-0.7 0 0 0 0 0 -1 1.98 0 -0.7 0 0"},
    {"541127, 381972, 127324", "6, 5, 4"},
};

/* ---- Large lights ---------------------------------------------------------------------------------------------- */

static ca_image_layers *blocks_of(const ca_scene *scene, const char *integrator, uint32_t samples)
{
    const batch_settings settings = {.integrator = integrator,
                                     .samples = samples,
                                     .batches = 4,
                                     .seed = seed_of(integrator),
                                     .block_side = 16,
                                     .width = 128,
                                     .height = 128};
    return render_batches(scene, &settings);
}

static void expect_path(const ca_scene *scene, const ca_image_layers *reference, const char *integrator,
                        uint32_t samples)
{
    ca_image_layers *image = blocks_of(scene, integrator, samples);
    ca_comparison comparison;
    ca_error error;
    if (ca_compare(image, reference, &(ca_compare_settings){.block_side = 1}, &comparison, &error) != CA_OK)
        fail_msg("%s", error.message);
    ca_image_release(image);
    print_message("    %-32s median difference of %u blocks %.2f %%, mean %+.2f %%\n", integrator, comparison.blocks,
                  100.0 * comparison.median_block_difference,
                  100.0 * (comparison.mean_luminance / comparison.reference_mean_luminance - 1.0));
    assert_int_equal(comparison.blocks, 64);
    assert_true(comparison.median_block_difference < 0.02);
    assert_true(fabs(comparison.mean_luminance / comparison.reference_mean_luminance - 1.0) < 0.02);
}

static void test_large_lights_of_veach_bidir(void **state)
{
    (void)state;
    ca_scene *scene = changed_scene("veach-bidir", large_lights_of_veach_bidir, 4);
    if (!scene) skip();
    ca_image_layers *reference = blocks_of(scene, "path:hide_emitters=true", 160);
    expect_path(scene, reference, "vcm:hide_emitters=true,radius=0.04", 24);
    expect_path(scene, reference, "ovcm:hide_emitters=true,radius=0.04", 24);
    expect_path(scene, reference, "ppm:hide_emitters=true,radius=0.04", 80);
    ca_image_release(reference);
    ca_scene_release(scene);
}

static void test_large_light_of_water_caustic(void **state)
{
    (void)state;
    ca_scene *scene = changed_scene("water-caustic", large_light_of_water_caustic, 2);
    if (!scene) skip();
    ca_image_layers *reference = blocks_of(scene, "path:hide_emitters=true", 128);
    expect_path(scene, reference, "vcm:hide_emitters=true,radius=0.01", 24);
    expect_path(scene, reference, "ovcm:hide_emitters=true,radius=0.01", 24);
    expect_path(scene, reference, "ppm:hide_emitters=true,radius=0.01", 64);
    ca_image_release(reference);
    ca_scene_release(scene);
}

/* ---- The scenes as they are ------------------------------------------------------------------------------------ */

enum { REGION_BATCHES = 6 };

typedef struct region {
    const char *scene;
    uint32_t side, crop[4]; /* of the square film, and the part of it to look at */
    double radius;          /* of the first pass, m */
    uint32_t samples;       /* of a batch */
    double missing;         /* share of the light that bdpt must miss */
} region;

/* All integrators have the same seeds, and so the same light paths. */
static void measure_region(const ca_scene *scene, const region *where, const char *text, double means[REGION_BATCHES])
{
    char integrator[128];
    integrator_text(text, where->radius, integrator, sizeof integrator);
    batch_settings settings = {.integrator = integrator,
                               .samples = where->samples,
                               .batches = REGION_BATCHES,
                               .seed = 1,
                               .width = where->side,
                               .height = where->side};
    memcpy(settings.crop, where->crop, sizeof settings.crop);
    batch_means(scene, &settings, means);
    const measured value = measured_of(means, REGION_BATCHES);
    print_message("    %-14s %-36s %.5f +- %.5f\n", where->scene, integrator, value.mean, value.error);
}

/* Means within 3 %, with a noise of the difference well below that. */
static void expect_the_same(const double a[REGION_BATCHES], const double b[REGION_BATCHES])
{
    double differences[REGION_BATCHES];
    for (int i = 0; i < REGION_BATCHES; i++) differences[i] = a[i] - b[i];
    const measured difference = measured_of(differences, REGION_BATCHES), mean = measured_of(a, REGION_BATCHES);
    print_message("      difference %+.2f %% +- %.2f\n", 100.0 * difference.mean / mean.mean,
                  100.0 * difference.error / mean.mean);
    assert_true(fabs(difference.mean) < 0.03 * mean.mean);
    assert_true(difference.error < 0.015 * mean.mean);
}

static void check_region(const region *where)
{
    ca_scene *scene = changed_scene(where->scene, NULL, 0);
    if (!scene) skip();
    static const char *const names[] = {"vcm:radius=%g,light_paths=60000", "ovcm:radius=%g,light_paths=60000",
                                        "ppm:radius=%g,light_paths=60000", "bdpt:light_paths=60000", "path"};
    double means[5][REGION_BATCHES];
    for (int i = 0; i < 5; i++) measure_region(scene, where, names[i], means[i]);
    ca_scene_release(scene);
    expect_the_same(means[0], means[1]);
    expect_the_same(means[0], means[2]);
    expect_the_same(means[1], means[2]);
    const measured merged = measured_of(means[0], REGION_BATCHES), bdpt = measured_of(means[3], REGION_BATCHES),
                   path = measured_of(means[4], REGION_BATCHES);
    assert_true(bdpt.mean < (1.0 - where->missing) * merged.mean);
    /* a path that happens to hit the small light makes a firefly */
    assert_true(path.mean < (1.0 - where->missing) * merged.mean || path.error > 0.1 * path.mean);
}

/* The table's far side, seen through the foot of the egg, with the light that came through it. */
static void test_inside_the_egg(void **state)
{
    (void)state;
    check_region(&(region){.scene = "veach-bidir", .side = 1536, .crop = {843, 1032, 873, 1038}, .radius = 0.015,
                           .samples = 32, .missing = 0.3});
}

static void test_under_the_water(void **state)
{
    (void)state;
    check_region(&(region){.scene = "water-caustic",
                           .side = 256,
                           .crop = {96, 112, 128, 160},
                           .radius = 0.006,
                           .samples = 12,
                           .missing = 0.5});
}

int main(int argc, char **argv)
{
    if (argc > 1) cmocka_set_test_filter(argv[1]);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_large_lights_of_veach_bidir),
        cmocka_unit_test(test_large_light_of_water_caustic),
        cmocka_unit_test(test_inside_the_egg),
        cmocka_unit_test(test_under_the_water),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
