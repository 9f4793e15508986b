/* Light that only merging finds (specular, diffuse, specular): through the glass egg of veach-bidir and under the water of
 * water-caustic. With lights so large that `path` converges, it is the reference. With the scenes' small lights, what merging
 * algorithms find must be the same, and `path` and `bdpt` find next to nothing of it in the same number of samples. */
#include "film/compare.h"
#include "support/batches.h"
#include "support/scene_text.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* ---- Scenes ------------------------------------------------------------------------------------------------------- */

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
    {"-0.0101082 0.067068 0.00138972 -2.69082 -0.0610016 -0.0070995 -0.00842772 5.10417 -0.0282857 -0.00865658 0.0176788 "
     "-3.77057",
     "-0.15 0.98 0.07 -2.6 -0.894 -0.104 -0.429 4.55 -0.414 -0.127 0.9 -2.6"},
    {"12048.2, 8605.84, 6196.21", "56, 40, 29"},
    {"-1.20536e-008 0.275755 1.20536e-008 -2.48161 0 -6.64767e-009 0.152081 6 0.275754 1.20536e-008 5.2688e-016 2.5894",
     "0 1.1 0 -2.48161 0 0 1 6.5 1.1 0 0 2.5894"},
    {"523.258, 523.258, 523.258", "33, 33, 33"},
};

/* 5 mm by 4 mm become 1.4 m by 1.4 m. */
static const replacement large_light_of_water_caustic[] = {
    {"-0.0025 1.91069e-015 -4.37114e-008 -0.005 2.18557e-010 2.18557e-008 -0.5 1.98 0 -0.002 -8.74228e-011 -0.03",
     "-0.7 0 0 0 0 0 -1 1.98 0 -0.7 0 0"},
    {"541127, 381972, 127324", "6, 5, 4"},
};

/* ---- Large lights ------------------------------------------------------------------------------------------------- */

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

static void expect_path(const ca_scene *scene, const ca_image_layers *reference, const char *integrator, uint32_t samples)
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

/* ---- The scenes as they are ---------------------------------------------------------------------------------------- */

typedef struct region {
    const char *scene;
    uint32_t width, height, crop[4];
    double radius;        /* of the first pass, m */
    uint32_t light_paths; /* of a pass */
    uint32_t samples;     /* of a batch */
} region;

static measured measure_region(const ca_scene *scene, const region *where, const char *name)
{
    char integrator[128];
    if (strcmp(name, "path") == 0)
        snprintf(integrator, sizeof integrator, "path");
    else if (strcmp(name, "bdpt") == 0)
        snprintf(integrator, sizeof integrator, "bdpt:light_paths=%u", where->light_paths);
    else
        snprintf(integrator, sizeof integrator, "%s:radius=%g,light_paths=%u", name, where->radius, where->light_paths);
    batch_settings settings = {.integrator = integrator,
                               .samples = where->samples,
                               .batches = 8,
                               .seed = seed_of(integrator),
                               .width = where->width,
                               .height = where->height};
    memcpy(settings.crop, where->crop, sizeof settings.crop);
    const measured value = measure_mean(scene, &settings);
    print_message("    %-14s %-5s %.5f +- %.5f\n", where->scene, name, value.mean, value.error);
    return value;
}

static void check_region(const region *where)
{
    ca_scene *scene = changed_scene(where->scene, NULL, 0);
    if (!scene) skip();
    static const char *const names[] = {"vcm", "ovcm", "ppm", "bdpt", "path"};
    measured values[5];
    for (int i = 0; i < 5; i++) values[i] = measure_region(scene, where, names[i]);
    ca_scene_release(scene);
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < i; k++) {
            const double mean = 0.5 * (values[i].mean + values[k].mean);
            assert_true(hypot(values[i].error, values[k].error) < 0.015 * mean);
            assert_true(fabs(values[i].mean - values[k].mean) < 0.03 * mean);
        }
    /* the other two find some of the light: what came by diffuse walls, and a lucky hit */
    assert_true(values[3].mean < 0.8 * values[0].mean);
    assert_true(values[4].mean < 0.8 * values[0].mean);
}

static void test_inside_the_egg(void **state)
{
    (void)state;
    check_region(&(region){.scene = "veach-bidir", .width = 512, .height = 512, .crop = {276, 341, 296, 348}, .radius = 0.01,
                           .light_paths = 60000, .samples = 16});
}

static void test_under_the_water(void **state)
{
    (void)state;
    check_region(&(region){.scene = "water-caustic", .width = 256, .height = 256, .crop = {96, 112, 128, 160}, .radius = 0.006,
                           .light_paths = 60000, .samples = 16});
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
