/* Integrators with light paths, from outside: the same bits for any number of threads, for any amount of memory, and
 * for a part of the picture; what they count; the images of their strategies. */
#define _POSIX_C_SOURCE 200809L
#include "base/memory.h"
#include "image/layers.h"
#include "render/render.h"
#include "support/scene_text.h"

#include <dirent.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

/* Lights of every sort of end, surfaces of every sort of vertex. */
static const char *const scene_text =
    "<scene version='3.0.0'>"
    "<sensor type='thinlens'><float name='fov' value='60'/><float name='aperture_radius' value='0.05'/>"
    "<float name='focus_distance' value='3'/>"
    "<transform name='to_world'><lookat origin='0,1,-3' target='0,0.5,0' up='0,1,0'/></transform>"
    "<sampler type='independent'><integer name='sample_count' value='2'/></sampler>"
    "<film type='hdrfilm'><integer name='width' value='51'/><integer name='height' value='35'/>"
    "<rfilter type='mitchell'/></film></sensor>"
    "<shape type='rectangle'><transform name='to_world'><rotate x='1' angle='-90'/><scale value='4'/></transform>"
    "<bsdf type='diffuse'><texture type='checkerboard' name='reflectance'/></bsdf></shape>"
    "<shape type='sphere'><point name='center' value='0,0.5,0'/><float name='radius' value='0.5'/>"
    "<bsdf type='dielectric'/></shape>"
    "<shape type='cube'><transform name='to_world'><scale value='0.3'/><translate x='1' y='0.3'/></transform>"
    "<bsdf type='roughconductor'><float name='alpha' value='0.2'/></bsdf></shape>"
    "<emitter type='constant'><rgb name='radiance' value='0.4'/></emitter>"
    "<emitter type='spot'><transform name='to_world'><lookat origin='-2,2,0' target='0,0,0' up='0,0,1'/></transform>"
    "<rgb name='intensity' value='9'/></emitter>"
    "<shape type='disk'><transform name='to_world'><scale value='0.3'/><rotate x='1' angle='90'/><translate y='3'/>"
    "</transform><bsdf type='diffuse'/>"
    "<emitter type='area'><rgb name='radiance' value='20'/></emitter></shape></scene>";

/* All of the engine's, and one with parameters. */
static const char *integrator_at(size_t i)
{
    return i < ca_algorithm_count    ? ca_algorithms[i]->name
           : i == ca_algorithm_count ? "bdpm:camera_diffuse_depth=2"
                                     : NULL;
}

static ca_render_settings settings_of(const char *integrator)
{
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.integrator = integrator;
    settings.has_max_depth = true;
    settings.max_depth = 6;
    return settings;
}

static void test_threads_do_not_change_a_bit(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(scene_text);
    const char *integrator;
    for (size_t i = 0; (integrator = integrator_at(i)) != NULL; i++) {
        ca_render_settings settings = settings_of(integrator);
        settings.camera_paths = 1 + (uint32_t)i % 2;
        settings.samples_per_pixel = 4;
        settings.threads = 1;
        const uint64_t expected = rendered_hash(scene, &settings);
        static const uint32_t threads[] = {2, 3, 8};
        for (int t = 0; t < 3; t++) {
            settings.threads = threads[t];
            if (rendered_hash(scene, &settings) != expected) fail_msg("%s: %u threads", integrator, threads[t]);
        }
        settings.has_seed = true;
        settings.seed = 99;
        assert_true(rendered_hash(scene, &settings) != expected);
    }
    ca_scene_release(scene);
}

/* Light paths are those of the full film, so a crop shows the same pixels. */
static void test_a_crop_is_a_part_of_the_picture(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(scene_text);
    const char *integrator;
    for (size_t i = 0; (integrator = integrator_at(i)) != NULL; i++) {
        ca_render_settings settings = settings_of(integrator);
        ca_image_layers *whole = render_scene(scene, &settings);
        settings.has_crop = true;
        const uint32_t crop[4] = {13, 7, 40, 31};
        memcpy(settings.crop, crop, sizeof crop);
        ca_image_layers *part = render_scene(scene, &settings);
        for (size_t c = 0; c < whole->channel_count; c++)
            for (uint32_t y = 0; y < part->height; y++)
                for (uint32_t x = 0; x < part->width; x++) {
                    const float a = part->channels[c].data[(size_t)y * part->width + x];
                    const float b = whole->channels[c].data[(size_t)(y + 7) * whole->width + 13 + x];
                    if (memcmp(&a, &b, sizeof a) != 0)
                        fail_msg("%s, %s of pixel (%u, %u): %.9g in the part, %.9g in the whole", integrator,
                                 whole->channels[c].name, x + 13, y + 7, (double)a, (double)b);
                }
        ca_image_release(whole);
        ca_image_release(part);
    }
    ca_scene_release(scene);
}

/* ---- Memory ---------------------------------------------------------------------------------------------------- */

/* Rounds that a pass would take; 0 where that much memory is refused. */
static uint32_t rounds_of(const ca_scene *scene, const ca_render_settings *settings)
{
    ca_render_plan plan;
    void *integrator = NULL;
    if (ca_render_plan_make(&plan, scene, settings, NULL) != CA_OK) return 0;
    if (plan.type->create(&plan.input, &integrator, NULL) != CA_OK) return 0;
    const uint32_t rounds = plan.type->rounds(integrator);
    plan.type->destroy(integrator);
    return rounds;
}

/* Half a million light paths in one, two and three rounds. */
static void test_memory_does_not_change_a_bit(void **state)
{
    (void)state;
    static const char *const some[] = {"light", "bdpt", "bdpm", "ovcm", "vavcm"};
    ca_scene *scene = scene_from_text(scene_text);
    for (int i = 0; i < 5; i++) {
        ca_render_settings settings = settings_of(some[i]);
        settings.max_depth = 3;
        settings.light_paths = 2 * 262144 + 1000;
        settings.width = 12;
        settings.height = 8;
        settings.samples_per_pixel = 1;
        if (i > 1) settings.radius = 0.05;
        assert_int_equal(rounds_of(scene, &settings), 1);
        const uint64_t expected = rendered_hash(scene, &settings);
        uint32_t seen = 1;
        for (settings.memory_mib = 1024.0; settings.memory_mib > 4.0; settings.memory_mib *= 0.85) {
            const uint32_t rounds = rounds_of(scene, &settings);
            if (rounds <= seen) continue;
            if (rendered_hash(scene, &settings) != expected) fail_msg("%s in %u rounds", some[i], rounds);
            seen = rounds;
        }
        assert_int_equal(seen, 3);
        settings.memory_mib = i == 0 ? 2.0 : 4.0; /* `light` keeps nothing of its paths */
        ca_error error = {""};
        ca_image_layers *image = NULL;
        assert_int_equal(ca_render(scene, &settings, &image, NULL, &error), CA_ERROR_ARGUMENT);
        assert_non_null(strstr(error.message, "light paths need about"));
    }
    ca_scene_release(scene);
}

/* Where no memory is given, light paths take as many rounds as with 2 GiB for them; where more is given, it
 * counts. */
static void test_memory_by_default(void **state)
{
    (void)state;
    static const char *const some[] = {"light", "bdpt", "bdpm", "vcm", "ovcm"};
    static const char inside_a_ball[] =
        "<scene version='3.0.0'><sensor type='perspective'/><shape type='sphere'><bsdf type='twosided'>"
        "<bsdf type='diffuse'>"
        "<rgb name='reflectance' value='0.9'/></bsdf></bsdf></shape><emitter type='point'/></scene>";
    ca_scene *scene = scene_from_text(inside_a_ball);
    for (int i = 0; i < 5; i++) {
        ca_render_settings settings = settings_of(some[i]);
        settings.width = 12;
        settings.height = 8;
        settings.light_paths = 12000000;
        if (i > 1) settings.radius = 0.05;
        const uint32_t rounds = rounds_of(scene, &settings);
        settings.memory_mib = 2048.0;
        assert_int_equal(rounds, rounds_of(scene, &settings));
        settings.memory_mib = 16384.0;
        assert_int_equal(rounds_of(scene, &settings), 1);
        assert_true(i == 0 ? rounds == 1 : rounds > 1);
    }
    ca_scene_release(scene);
}

static ca_render_settings small_settings_of(const char *integrator)
{
    ca_render_settings settings = settings_of(integrator);
    settings.samples_per_pixel = 2;
    settings.width = 12;
    settings.height = 8;
    settings.threads = 2;
    settings.memory_mib = 100.0;
    return settings;
}

/* Wherever memory ends, the render ends with that error, and with the first of its two passes at most: a second one
 * with more splats asks for more memory. */
static void test_out_of_memory(void **state)
{
    (void)state;
    static const char *const some[] = {"bdpt", "vcm-star:radius=0.1"};
    ca_scene *scene = scene_from_text(scene_text);
    for (int i = 0; i < 2; i++) {
        const ca_render_settings settings = small_settings_of(some[i]);
        ca_image_layers *image = NULL;
        long failures = 0;
        for (;; failures++) {
            ca_memory_fail_after(failures);
            ca_render_statistics statistics;
            ca_render_statistics_init(&statistics);
            const ca_status status = ca_render(scene, &settings, &image, &statistics, NULL);
            ca_memory_fail_after(-1);
            if (status == CA_OK) break;
            assert_int_equal(status, CA_ERROR_MEMORY);
            assert_true(!image || (statistics.passes[0] == 0 && statistics.passes[1] == 1));
            ca_image_release(image);
            image = NULL;
        }
        ca_image_release(image);
        print_message("    %s: %ld allocations\n", some[i], failures);
        assert_true(failures > 20);
    }
    const ca_render_settings seeks_its_radius = small_settings_of("vavcm");
    assert_true(render_without_memory(scene, &seeks_its_radius) > 200);
    ca_scene_release(scene);
}

/* ---- Counts ---------------------------------------------------------------------------------------------------- */

static bool has_radius(const ca_integrator_type *type)
{
    for (int i = 0; type->parameters[i].name; i++)
        if (strcmp(type->parameters[i].name, "radius") == 0) return true;
    return false;
}

static void test_counts(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(scene_text);
    const char *integrator;
    for (size_t i = 0; (integrator = integrator_at(i)) != NULL; i++) {
        ca_render_settings settings = settings_of(integrator);
        settings.samples_per_pixel = 5;
        settings.camera_paths = 2;
        settings.light_paths = 700;
        ca_image_layers *image = NULL;
        ca_render_statistics s = {.size = sizeof s};
        ca_error error = {""};
        if (ca_render(scene, &settings, &image, &s, &error) != CA_OK) fail_msg("%s", error.message);
        const ca_integrator_type *type = ca_integrator_of(integrator);
        const bool is_light = ca_integrator_has(type, CA_ABILITY_LIGHT_SAMPLES), merges = has_radius(type);
        const uint32_t passes = is_light ? (5 * 51 * 35 + 699) / 700 : 3;
        assert_int_equal(s.iterations, passes);
        assert_int_equal(s.camera_paths, passes * 2 * 51 * 35);
        assert_true(fabs(s.samples_per_pixel - (is_light ? passes * 700 / (51.0 * 35.0) : 2.0 * passes)) < 1e-9);
        if (s.light_paths < passes * 700) fail_msg("%s: %u light paths", integrator, (unsigned)s.light_paths);
        assert_true(s.rays >= s.camera_paths);
        assert_true((s.photons > 0) == merges && (s.photons_tested > 0) == merges && (s.merges > 0) == merges);
        assert_true(s.merges <= s.photons_tested);
        assert_int_equal(s.non_finite, 0);
        ca_image_release(image);
    }
    ca_scene_release(scene);
}

/* ---- Images of strategies -------------------------------------------------------------------------------------- */

/* Adds the pictures of a folder whose name ends so to `sum`, and removes all. */
static void collect(const char *folder, const char *ending, double *sum, size_t count, int *files)
{
    DIR *directory = opendir(folder);
    assert_non_null(directory);
    for (struct dirent *entry; (entry = readdir(directory));) {
        if (!strstr(entry->d_name, ending)) continue;
        char path[512];
        snprintf(path, sizeof path, "%s/%s", folder, entry->d_name);
        ca_image_layers *image = NULL;
        assert_int_equal(ca_layers_read(path, &image, NULL), CA_OK);
        assert_int_equal((size_t)image->width * image->height, count);
        for (size_t i = 0; i < count; i++) sum[i] += (double)ca_image_channel(image, "G")[i];
        ca_image_release(image);
        ++*files;
    }
    closedir(directory);
}

static void remove_folder(const char *folder)
{
    char command[600];
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    assert_int_equal(system(command), 0);
}

/* What the techniques found, each times its weight, is the image. */
static void test_strategies_add_up_to_the_image(void **state)
{
    (void)state;
    static const char *const some[] = {"path", "light", "bdpt", "bdpm:camera_diffuse_depth=1", "ovcm",
                                       "vavcm"};
    ca_scene *scene = scene_from_text(scene_text);
    enum { COUNT = 51 * 35 };
    for (int i = 0; i < 6; i++) {
        char folder[] = "/tmp/caustica-strategies-XXXXXX";
        assert_non_null(mkdtemp(folder));
        ca_render_settings settings = settings_of(some[i]);
        settings.samples_per_pixel = 4;
        settings.max_depth = 4;
        if (i > 0) settings.camera_paths = 2;
        const uint64_t without = rendered_hash(scene, &settings);
        settings.strategies_directory = folder;
        ca_image_layers *image = render_scene(scene, &settings);
        assert_true(image_hash(image) == without);
        static double weighted[COUNT], all[COUNT];
        memset(weighted, 0, sizeof weighted);
        memset(all, 0, sizeof all);
        int files = 0, all_files = 0;
        collect(folder, "_weighted.exr", weighted, COUNT, &files);
        collect(folder, ".exr", all, COUNT, &all_files);
        remove_folder(folder);
        assert_true(files >= 2 && all_files == 3 * files);
        print_message("    %-30s %d techniques\n", some[i], files);
        for (size_t p = 0; p < COUNT; p++) {
            const double value = (double)ca_image_channel(image, "G")[p];
            if (!(fabs(weighted[p] - value) <= 1e-4 * fabs(value) + 1e-5))
                fail_msg("%s, pixel %zu: %.9g in the strategies, %.9g in the image", some[i], p, weighted[p], value);
        }
        ca_image_release(image);
    }
    ca_scene_release(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_threads_do_not_change_a_bit),
        cmocka_unit_test(test_a_crop_is_a_part_of_the_picture),
        cmocka_unit_test(test_memory_does_not_change_a_bit),
        cmocka_unit_test(test_memory_by_default),
        cmocka_unit_test(test_out_of_memory),
        cmocka_unit_test(test_counts),
        cmocka_unit_test(test_strategies_add_up_to_the_image),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
