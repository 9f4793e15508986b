#define _DEFAULT_SOURCE /* mkstemps */
/* What is said of a render before it is made, against renders: the share of light that is lost against the mean of a
 * picture that lacks it, the expected numbers of samples and of photons against those that are counted. */
#include "base/memory.h"
#include "support/light_pilots.h"
#include "support/sample_mean.h"
#include "support/scene_text.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

enum { SIDE = 24, SEEDS = 8 };

/* ---- Scenes ---------------------------------------------------------------------------------------------------- */

enum { CELLS = 40 };

/* Waves of water around y = 0, 4 m x 4 m, and their slopes. */
static double wave(double x, double z, double *dx, double *dz)
{
    *dx = 0.11 * cos(5.5 * x + 1.3 * z) + 0.04 * cos(9.0 * x - 4.0 * z);
    *dz = 0.026 * cos(5.5 * x + 1.3 * z) - 0.0178 * cos(9.0 * x - 4.0 * z);
    return 0.02 * sin(5.5 * x + 1.3 * z) + 0.0044 * sin(9.0 * x - 4.0 * z);
}

static void write_water(const char *path)
{
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    for (int i = 0; i < (CELLS + 1) * (CELLS + 1); i++) {
        const double x = 4.0 * (i % (CELLS + 1)) / CELLS - 2.0, z = 4.0 * (i / (CELLS + 1)) / CELLS - 2.0;
        double dx, dz;
        const double y = wave(x, z, &dx, &dz);
        fprintf(file, "v %.6f %.6f %.6f\nvn %.6f 1 %.6f\n", x, y, z, -dx, -dz);
    }
    for (int i = 0; i < CELLS * CELLS; i++) {
        const int a = i / CELLS * (CELLS + 1) + i % CELLS + 1, b = a + 1, c = a + CELLS + 1, d = c + 1;
        fprintf(file, "f %d//%d %d//%d %d//%d\nf %d//%d %d//%d %d//%d\n", a, a, c, c, b, b, b, b, c, c, d, d);
    }
    assert_int_equal(fclose(file), 0);
}

#define CAMERA                                                                                                       \
    "<sensor type='perspective'><float name='fov' value='28'/><transform name='to_world'><lookat "                   \
    "origin='0.2,3,0.4' target='0,-1,0' up='0,0,1'/></transform><film type='hdrfilm'><integer name='width' "         \
    "value='24'/><integer name='height' value='24'/><rfilter type='box'/></film></sensor>"
#define FLOOR                                                                                                        \
    "<shape type='rectangle'><transform name='to_world'><scale value='2'/><rotate x='1' angle='-90'/><translate "    \
    "y='-1'/></transform><bsdf type='diffuse'><rgb name='reflectance' value='0.5'/></bsdf></shape>"
#define SUN                                                                                                          \
    "<emitter type='directional'><vector name='direction' value='0.3,-1,0.2'/><rgb name='irradiance' "               \
    "value='1'/></emitter>"
#define SKY "<emitter type='constant'><rgb name='radiance' value='0.15'/></emitter>"
/* A lamp above the water, facing down. */
#define LAMP(radius, radiance)                                                                                       \
    "<shape type='disk'><transform name='to_world'><scale value='" radius "'/><rotate x='1' angle='90'/><translate " \
    "x='0.6' y='2.5'/></transform><bsdf type='diffuse'/>"                                                            \
    "<emitter type='area'><rgb name='radiance' value='" radiance                                                     \
    "'/></emitter></shape>"

/* A floor, under water or not, in some light; paths of at most `max_depth` segments. */
static ca_scene *pool(bool water, const char *lights, int max_depth)
{
    char path[] = "/tmp/caustica-water-XXXXXX.obj", shape[512] = "", text[4096];
    const int descriptor = mkstemps(path, (int)strlen(".obj"));
    assert_true(descriptor >= 0);
    close(descriptor);
    write_water(path);
    if (water)
        snprintf(shape, sizeof shape,
                 "<shape type='obj'><string name='filename' value='%s'/><bsdf type='dielectric'>"
                 "<float name='int_ior' value='1.33'/><float name='ext_ior' value='1'/></bsdf></shape>",
                 path);
    snprintf(text, sizeof text,
             "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' value='%d'/></integrator>"
             CAMERA "%s" FLOOR "%s</scene>",
             max_depth, shape, lights);
    ca_scene *scene = scene_from_text(text);
    unlink(path);
    return scene;
}

static ca_render_settings settings_of(const char *integrator, uint32_t samples)
{
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.integrator = integrator;
    settings.samples_per_pixel = samples;
    settings.threads = 1;
    return settings;
}

static ca_preflight preflight_of(const ca_scene *scene, const ca_render_settings *settings)
{
    ca_preflight preflight;
    ca_error error;
    if (ca_preflight_make(scene, settings, &preflight, &error) != CA_OK) fail_msg("%s", error.message);
    return preflight;
}

static ca_light_pilot pilot_of(const ca_scene *scene, const ca_render_settings *settings, uint32_t passes)
{
    return pilot_with_effort(scene, settings, passes, 1);
}

static void assert_warns(const ca_preflight *preflight, const char *words)
{
    if (preflight->warning_count != 1 || !strstr(preflight->warnings[0], words))
        fail_msg("%u warnings, not one with \"%s\": %s", preflight->warning_count, words, preflight->warnings[0]);
}

static void assert_no_warning(const ca_preflight *preflight, const char *of)
{
    if (preflight->warning_count > 0) fail_msg("%s: %s", of, preflight->warnings[0]);
}

/* ---- Light that is lost ---------------------------------------------------------------------------------------- */

/* The mean over the picture and over seeds, with its error. */
static double mean_of(const ca_scene *scene, const char *integrator, uint32_t samples, double *error)
{
    sample_mean means = {0};
    for (uint64_t seed = 0; seed < SEEDS; seed++) {
        ca_render_settings settings = settings_of(integrator, samples);
        settings.has_seed = true;
        settings.seed = 100 + seed;
        ca_image_layers *image = render_scene(scene, &settings);
        double mean, unused;
        channel_mean(image, "G", &mean, &unused);
        add_sample(&means, mean);
        ca_image_release(image);
    }
    *error = error_of(&means, SEEDS);
    return means.sum / SEEDS;
}

/* Of grey light the luminance's share is that of any channel. */
static void test_lost_share(void **state)
{
    (void)state;
    ca_scene *scene = pool(true, SUN SKY, 12);
    const ca_render_settings settings = settings_of("path", 16);
    const ca_preflight preflight = preflight_of(scene, &settings);
    double found_error, all_error;
    const double found = mean_of(scene, "path", 32, &found_error), all = mean_of(scene, "ovcm", 32, &all_error);
    const double lost = 1.0 - found / all, error = (1.0 - lost) * hypot(found_error / found, all_error / all);
    print_message("lost: %.4f within %.4f to %.4f; by renders %.4f +- %.4f\n", preflight.lost_light,
                  preflight.lost_light_low, preflight.lost_light_high, lost, error);
    assert_true(error < 0.005 && preflight.lost_light_high - preflight.lost_light_low < 0.05);
    assert_true(preflight.lost_light_low - 2.0 * error < lost && lost < preflight.lost_light_high + 2.0 * error);
    char words[64];
    snprintf(words, sizeof words, "about %.0f %% of the light", 100.0 * preflight.lost_light);
    assert_warns(&preflight, words);
    assert_warns(&preflight, "-i auto finds it");
    ca_scene_release(scene);
}

/* Of a few pixels and samples nearly all paths are without a sample: that is noise, and no method would mend it. */
static void test_a_tiny_render(void **state)
{
    (void)state;
    for (int water = 0; water < 2; water++) {
        ca_scene *scene = pool(water, SUN, 12);
        ca_render_settings settings = settings_of("path", 1);
        settings.width = settings.height = 1;
        const ca_preflight one = preflight_of(scene, &settings);
        settings.samples_per_pixel = 1 << 20;
        const ca_preflight many = preflight_of(scene, &settings);
        assert_true(one.lost_light == many.lost_light);
        if (water) assert_warns(&one, "such as light through glass");
        if (!water) assert_no_warning(&one, "one pixel");
        settings.samples_per_pixel = 10000000;
        assert_true(preflight_of(scene, &settings).lost_light <= many.lost_light);
        ca_scene_release(scene);
    }
}

/* Nothing finds the sun in water that is seen through it but photons; all find the sky. */
static void test_integrators(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        bool water, loses;
    } cases[] = {
        {"path", true, true},  {"path", false, false}, {"light", true, true}, {"light", false, false},
        {"bdpt", true, true},  {"bdpt", false, false}, {"ppm", true, false},  {"bdpm", true, false},
        {"vcm", true, false},  {"ovcm", true, false},  {"cavcm", true, false}, {"vcm-plus", true, false},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        ca_scene *scene = pool(cases[i].water, SUN, 12);
        const ca_render_settings settings = settings_of(cases[i].name, 16);
        const ca_preflight preflight = preflight_of(scene, &settings);
        if (cases[i].loses) assert_warns(&preflight, "such as light through glass");
        if (!cases[i].loses) assert_no_warning(&preflight, cases[i].name);
        const double lost = preflight.lost_light;
        if (cases[i].loses ? !(lost > 0.9) : !(lost < 0.01)) fail_msg("%s loses %.4f", cases[i].name, lost);
        ca_scene_release(scene);
    }
}

/* Who renders by passes says what it finds; `auto` has not chosen yet. */
static void test_all_integrators_tell(void **state)
{
    (void)state;
    const ca_integrator_type *type;
    ca_scene *scene = pool(false, SKY, 12);
    for (size_t i = 0; (type = ca_integrator_at(i)) != NULL; i++) {
        const ca_render_settings settings = settings_of(type->name, 4);
        const ca_preflight preflight = preflight_of(scene, &settings);
        const bool tells = !type->begin_block && !ca_integrator_has(type, CA_ABILITY_CHOOSES);
        if (!tells) assert_true(isnan(preflight.lost_light) && preflight.warning_count == 0);
        if (tells && !(preflight.lost_light < 0.1)) fail_msg("%s tells nothing", type->name);
    }
    ca_scene_release(scene);
}

/* What `path` loses there is little, or found by hitting the lamp. */
static void test_no_false_alarm(void **state)
{
    (void)state;
    static const char *const names[] = {"cornell-box/cornell-box", "speed/cornell-spheres", "mis/mis",
                                        "paper-000/cornell-point", "rough-glass/rough-glass"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        ca_scene *scene = bundled_scene(names[i]);
        const ca_render_settings settings = settings_of("path", 16);
        const ca_preflight preflight = preflight_of(scene, &settings);
        assert_no_warning(&preflight, names[i]);
        assert_true(preflight.lost_light_low < 0.005);
        ca_scene_release(scene);
    }
}

/* A lamp that paths rarely hit: lost in a small render, found in a long one. */
static void test_length_of_render(void **state)
{
    (void)state;
    ca_scene *scene = pool(true, SKY LAMP("0.002", "200000"), 12);
    ca_render_settings settings = settings_of("path", 1);
    const ca_preflight little = preflight_of(scene, &settings);
    settings.samples_per_pixel = 1000000;
    const ca_preflight much = preflight_of(scene, &settings);
    settings.samples_per_pixel = 0;
    settings.seconds = 60.0;
    const ca_preflight minute = preflight_of(scene, &settings);
    settings.threads = 60; /* as many paths in a second as one thread has in a minute */
    settings.seconds = 1.0;
    assert_true(preflight_of(scene, &settings).lost_light == minute.lost_light);
    settings.threads = 1;
    settings.seconds = 60.0;
    settings.samples_per_pixel = 2000000; /* more than a minute is taken to have */
    assert_true(preflight_of(scene, &settings).lost_light == minute.lost_light);
    settings.samples_per_pixel = 0;
    settings.seconds = 0.0;
    settings.noise_percent = 1.0;
    const ca_preflight hour = preflight_of(scene, &settings);
    print_message("lost with 1, 1000000 samples, in a minute, an hour: %g %g %g %g\n", little.lost_light,
                  much.lost_light, minute.lost_light, hour.lost_light);
    assert_true(little.lost_light_low > 0.1 && little.lost_light > minute.lost_light);
    assert_true(minute.lost_light > hour.lost_light && much.lost_light < 0.01);
    assert_warns(&little, "\"path\" will find none or too little");
    assert_no_warning(&much, "a million samples");
    assert_no_warning(&hour, "an hour");
    ca_scene_release(scene);
}

/* Paths that are found in one way each, without the roulette, which densities leave out: of camera paths that brought
 * light there are as many as expected. */
static void check_expected_samples(bool water, const char *integrator)
{
    enum { SAMPLES = 400 };
    ca_scene *scene = pool(water, LAMP("0.5", "1"), 4);
    ca_render_settings settings = settings_of(integrator, SAMPLES);
    ca_light_pilot pilot = pilot_of(scene, &settings, SAMPLES);
    double expected = 0.0;
    for (size_t i = 0; i < pilot.count; i++) expected += pilot.samples[0][i].expected;
    ca_light_pilot_destroy(&pilot);

    uint64_t lit = 0;
    settings.samples_per_pixel = 1;
    settings.width = settings.height = SIDE * 20; /* 400 camera paths where a pixel was */
    ca_image_layers *image = render_scene(scene, &settings);
    const float *green = ca_image_channel(image, "G");
    for (size_t i = 0; i < (size_t)SIDE * 20 * SIDE * 20; i++) lit += green[i] > 0.0f;
    ca_image_release(image);
    print_message("expected %.1f camera paths with light, found %llu\n", expected, (unsigned long long)lit);
    assert_true(lit > 1000);
    assert_true(fabs(expected - (double)lit) < 0.06 * (double)lit);
    ca_scene_release(scene);
}

static void test_expected_samples(void **state)
{
    (void)state;
    check_expected_samples(true, "path:rr_depth=10");
    check_expected_samples(false, "path:rr_depth=10,next_event=false");
}

/* ---- Photons --------------------------------------------------------------------------------------------------- */

/* An open floor in the sun: each camera path merges once. */
static void test_merged_photons(void **state)
{
    (void)state;
    enum { SAMPLES = 9 };
    ca_scene *scene = pool(false, SUN, 12);
    ca_render_settings settings = settings_of("ppm", SAMPLES);
    settings.radius = 0.1;
    const ca_preflight preflight = preflight_of(scene, &settings);
    ca_image_layers *image;
    ca_render_statistics statistics = {.size = sizeof statistics};
    ca_error error;
    assert_int_equal(ca_render(scene, &settings, &image, &statistics, &error), CA_OK);
    ca_image_release(image);
    const double merged = (double)statistics.merges / (SIDE * SIDE);
    print_message("photons a pixel: %.3f within %.3f to %.3f; found %.3f\n", preflight.merged_photons,
                  preflight.merged_photons_low, preflight.merged_photons_high, merged);
    assert_true(preflight.merged_light_low > 0.97);
    assert_true(fabs(preflight.merged_photons - merged) < 0.1 * merged);
    assert_no_warning(&preflight, "photons");
    ca_scene_release(scene);
}

/* In a sphere that glows all places have the same photons: their number is that of one merge, however many a camera
 * path makes. */
static void test_photons_of_one_merge(void **state)
{
    (void)state;
    static const char *const depths[2] = {"bdpm:camera_diffuse_depth=0", "bdpm:camera_diffuse_depth=3"};
    double photons[2];
    ca_scene *scene = scene_from_text(
        "<scene version='3.0.0'><sensor type='perspective'><film type='hdrfilm'><integer name='width' value='24'/>"
        "<integer name='height' value='24'/><rfilter type='box'/></film></sensor>"
        "<shape type='sphere'><boolean name='flip_normals' value='true'/><bsdf type='diffuse'><rgb "
        "name='reflectance' value='0.7'/></bsdf><emitter type='area'><rgb name='radiance' value='1'/></emitter>"
        "</shape></scene>");
    for (int i = 0; i < 2; i++) {
        ca_render_settings settings = settings_of(depths[i], 16);
        settings.radius = 0.1;
        photons[i] = preflight_of(scene, &settings).merged_photons;
    }
    print_message("photons of a pixel with merges at one vertex and at four: %.3f, %.3f\n", photons[0], photons[1]);
    assert_true(photons[0] > 1.0 && fabs(photons[1] - photons[0]) < 0.05 * photons[0]);
    ca_scene_release(scene);
}

/* What a merge counts for in the weights says nothing of how many photons it finds. */
static void test_reuse_rules(void **state)
{
    (void)state;
    static const char *const names[] = {"vcm", "vcm-plus", "vcm-star", "ovcm", "cavcm", "vavcm"};
    ca_scene *scene = pool(true, SUN SKY, 12);
    ca_render_settings settings = settings_of(names[0], 16);
    const ca_preflight first = preflight_of(scene, &settings);
    for (size_t i = 1; i < sizeof names / sizeof names[0]; i++) {
        settings.integrator = names[i];
        const ca_preflight other = preflight_of(scene, &settings);
        assert_true(other.merged_light == first.merged_light && other.merged_photons == first.merged_photons);
    }
    ca_scene_release(scene);
}

static void test_rare_merges(void **state)
{
    (void)state;
    ca_scene *scene = pool(true, SUN, 12);
    ca_render_settings settings = settings_of("ovcm", 4);
    settings.radius = 1e-3;
    const ca_preflight rare = preflight_of(scene, &settings);
    assert_warns(&rare, "--radius");
    assert_warns(&rare, "--light-paths");
    assert_true(rare.merged_photons < 0.1 && rare.merged_photons_high < 1.0 && rare.merged_light > 0.9);
    settings.light_paths = 4000000;
    const ca_preflight enough = preflight_of(scene, &settings);
    assert_no_warning(&enough, "four million light paths");
    ca_scene_release(scene);
}

/* Who renders a part knows that the whole has the passes up to the part's last one. */
static void test_parts(void **state)
{
    (void)state;
    ca_scene *scene = pool(true, SUN, 12);
    ca_render_settings whole = settings_of("ovcm", 40), part = settings_of("ovcm", 0);
    whole.radius = part.radius = 1e-3;
    part.has_passes = true;
    part.passes[0] = 36;
    part.passes[1] = 40;
    const ca_preflight of_whole = preflight_of(scene, &whole), of_part = preflight_of(scene, &part);
    assert_true(of_part.merged_photons == of_whole.merged_photons);
    assert_warns(&of_whole, "photons a pixel in the whole render;");
    assert_warns(&of_part, "photons a pixel in passes 0 to 39;");
    ca_scene_release(scene);
}

/* ---- Crowds ---------------------------------------------------------------------------------------------------- */

/* Inside of a mirror sphere all that the camera sees is a small lit disk, beside the centre as it is itself: all
 * camera paths meet where all light paths do. */
#define CROWD(bsdf)                                                                                                  \
    "<scene version='3.0.0'><sensor type='perspective'><float name='fov' value='40'/>"                               \
    "<transform name='to_world'><lookat origin='0.05,0,0' target='0.05,0,1' up='0,1,0'/></transform>"                \
    "<film type='hdrfilm'><integer name='width' value='24'/><integer name='height' value='24'/>"                     \
    "<rfilter type='box'/></film></sensor><shape type='sphere'>"                                                     \
    "<boolean name='flip_normals' value='true'/><bsdf type='twosided'><bsdf type='conductor'>"                       \
    "<string name='material' value='none'/></bsdf></bsdf></shape>"                                                   \
    "<shape type='disk'><transform name='to_world'><scale value='0.04'/><translate x='-0.05'/></transform>"          \
    bsdf "</shape>"                                                                                                  \
    "<emitter type='spot'><rgb name='intensity' value='1'/><float name='cutoff_angle' value='1'/><float "            \
    "name='beam_width' value='0.9'/><transform name='to_world'><lookat origin='-0.05,0,0.3' target='-0.05,0,0' "     \
    "up='0,1,0'/></transform></emitter></scene>"

/* Less than half of the picture sees a wall nearby, with a disk of light, and the rest one so far away that the
 * smallest radius, a part of the median pixel there, is larger than the wall. What was traced until that was clear
 * stands for all: whatever share of the paths it is, the same samples are expected. */
static void test_crowd_at_any_radius(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(
        "<scene version='3.0.0'><sensor type='perspective'><float name='fov' value='40'/>"
        "<float name='far_clip' value='1e12'/>"
        "<transform name='to_world'><lookat origin='0,0,0' target='0,0,1' up='0,1,0'/></transform>"
        "<film type='hdrfilm'><integer name='width' value='24'/><integer name='height' value='24'/>"
        "<rfilter type='box'/></film></sensor>"
        "<shape type='rectangle'><transform name='to_world'><scale x='1' y='2'/><rotate y='1' angle='180'/>"
        "<translate x='1.1' z='2'/></transform></shape>"
        "<shape type='rectangle'><transform name='to_world'><scale value='1e9'/><rotate y='1' angle='180'/>"
        "<translate z='1e9'/></transform></shape>"
        "<emitter type='spot'><rgb name='intensity' value='1'/><float name='cutoff_angle' value='16.7'/><float "
        "name='beam_width' value='16'/><transform name='to_world'><lookat origin='0.42,0,1' target='0.42,0,2' "
        "up='0,1,0'/></transform></emitter></scene>");
    const ca_render_settings settings = settings_of("path:max_depth=2", 16);
    double expected[2] = {0.0};
    for (int i = 0; i < 2; i++) {
        const uint32_t effort = i == 0 ? 1 : 16;
        ca_light_pilot pilot = pilot_with_effort(scene, &settings, 16, effort);
        for (size_t k = 0; k < pilot.count; k++) expected[i] += pilot.samples[0][k].expected;
        print_message("%.0f camera paths, %.4g samples expected\n", pilot.camera_paths, expected[i]);
        assert_true(pilot.camera_paths < effort * CA_PILOT_CAMERA_PATHS / 64.0);
        assert_true(pilot.camera_paths == (double)pilot.counters.camera_paths);
        assert_true(fabs(pilot.scale * pilot.camera_paths - 24.0 * 24.0 * 16.0) < 1e-6);
        ca_light_pilot_destroy(&pilot);
    }
    assert_true(fabs(expected[1] / expected[0] - 1.0) < 0.3);
    ca_scene_release(scene);
}

static void test_crowd(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(CROWD("<bsdf type='diffuse'/>"));
    const ca_render_settings settings = settings_of("ovcm:max_depth=4", 16);
    ca_light_pilot pilot = pilot_of(scene, &settings, 16);
    print_message("%llu merges, %zu samples, radius %g\n", (unsigned long long)pilot.counters.merges, pilot.count,
                  sqrt(pilot.merge_area / 3.141592653589793));
    assert_true(pilot.counters.camera_paths == CA_PILOT_CAMERA_PATHS);
    assert_true(pilot.counters.merges > 1000 && pilot.counters.merges < 1 << 20);
    ca_light_pilot_destroy(&pilot);
    const ca_preflight preflight = preflight_of(scene, &settings);
    assert_no_warning(&preflight, "a crowd");
    ca_scene_release(scene);
}

/* The disk is white on both sides: a camera path meets it again and again, and each time all photons. That this is
 * too much is seen before much of it is done. */
static void test_crowd_is_seen_early(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(CROWD("<bsdf type='twosided'><bsdf type='diffuse'><rgb name='reflectance' "
                                            "value='0.95'/></bsdf></bsdf>"));
    const ca_render_settings settings = settings_of("path", 1);
    ca_light_pilot pilot = pilot_of(scene, &settings, 1);
    print_message("%llu merges, and %llu with larger radii\n", (unsigned long long)pilot.counters.merges,
                  (unsigned long long)pilot.merges_in_vain);
    assert_true(pilot.merges_in_vain > 0 && pilot.merges_in_vain < 1 << 20);
    ca_light_pilot_destroy(&pilot);
    ca_scene_release(scene);
}

/* ---- The rest -------------------------------------------------------------------------------------------------- */

static void test_no_light(void **state)
{
    (void)state;
    ca_scene *scene = pool(true, "", 12);
    const ca_preflight preflight = preflight_of(scene, NULL);
    assert_true(preflight.no_light && isnan(preflight.lost_light));
    assert_warns(&preflight, "the scene has no light");
    ca_scene_release(scene);
}

/* There is a light, but none of it is found: shares of it are not known. */
static void test_dark_light(void **state)
{
    (void)state;
    static const char *const lights[] = {"<emitter type='constant'><rgb name='radiance' value='0'/></emitter>",
                                         LAMP("0.3", "0")};
    for (size_t i = 0; i < sizeof lights / sizeof lights[0]; i++) {
        ca_scene *scene = pool(true, lights[i], 12);
        const ca_render_settings settings = settings_of("ppm", 16);
        const ca_preflight p = preflight_of(scene, &settings);
        assert_true(isnan(p.lost_light) && isnan(p.lost_light_low) && isnan(p.lost_light_high));
        assert_true(isnan(p.merged_light) && isnan(p.merged_light_low) && isnan(p.merged_light_high));
        assert_true(isnan(p.merged_photons) && isnan(p.merged_photons_low) && isnan(p.merged_photons_high));
        assert_int_equal(p.warning_count, 0);
        ca_scene_release(scene);
    }
}

/* Of numbers of rays that are chosen or read nothing is known, so that nothing is said of dots; but what a method
 * does not find is lost with any numbers. */
static void test_rays(void **state)
{
    (void)state;
    static const char *const rays[] = {"auto", "rays.exr"};
    for (size_t i = 0; i < 2; i++) {
        ca_scene *scene = pool(true, SUN SKY, 12);
        ca_render_settings settings = settings_of("bdpm", 64);
        settings.rays = rays[i];
        ca_preflight preflight = preflight_of(scene, &settings);
        assert_true(preflight.lost_light < 0.01 && isnan(preflight.merged_light) && preflight.rays > 0);
        assert_no_warning(&preflight, rays[i]);
        settings.integrator = "bdpt";
        preflight = preflight_of(scene, &settings);
        assert_true(preflight.lost_light > 0.2 && preflight.warning_count == 1);
        assert_non_null(strstr(preflight.warnings[0], "\"bdpt\" will find none or too little of about"));
        ca_scene_release(scene);
    }
}

/* Numbers of paths that depend on nothing. */
static void test_cost(void **state)
{
    (void)state;
    static const struct {
        uint32_t samples, side;
    } sizes[] = {{1, 8}, {1000, 1000}};
    for (size_t i = 0; i < 2; i++) {
        ca_scene *scene = pool(true, SUN SKY, -1);
        ca_render_settings settings = settings_of("path", sizes[i].samples);
        settings.width = settings.height = sizes[i].side;
        const ca_preflight preflight = preflight_of(scene, &settings);
        assert_int_equal(preflight.camera_paths, CA_PILOT_CAMERA_PATHS);
        assert_int_equal(preflight.light_paths, CA_PILOT_LIGHT_PATHS);
        const uint64_t paths = CA_PILOT_CAMERA_PATHS + CA_PILOT_LIGHT_PATHS;
        assert_true(preflight.rays + preflight.shadow_rays < 6 * paths);
        ca_scene_release(scene);
    }
}

static void assert_same_picture(const ca_scene *scene, ca_render_settings settings, double radius)
{
    ca_image_layers *images[2];
    for (int given = 0; given < 2; given++) {
        settings.radius = given ? radius : 0.0;
        assert_int_equal(ca_render(scene, &settings, &images[given], NULL, NULL), CA_OK);
    }
    assert_string_equal(ca_layers_attribute(images[0], "caustica.integrator")->text,
                        ca_layers_attribute(images[1], "caustica.integrator")->text);
    uint32_t width, height;
    ca_image_size(images[0], &width, &height);
    assert_memory_equal(ca_image_channel(images[0], "G"), ca_image_channel(images[1], "G"),
                        (size_t)width * height * sizeof(float));
    for (int given = 0; given < 2; given++) ca_image_release(images[given]);
}

/* A render that is given it makes the picture of one that finds it. */
static void test_radius(void **state)
{
    (void)state;
    ca_scene *scene = pool(true, SUN, 4);
    const ca_render_settings by_default = settings_of("ovcm", 2), given = settings_of("ovcm:radius=0.1", 2),
                             unmerged = settings_of("path", 2);
    const double radius = preflight_of(scene, &by_default).radius;
    assert_true(radius > 0.0);
    assert_same_picture(scene, by_default, radius);
    assert_true(preflight_of(scene, &given).radius == 0.1);
    const ca_render_settings huge = settings_of("ovcm:radius=1e6", 2);
    const ca_preflight blurred = preflight_of(scene, &huge);
    assert_non_null(strstr(blurred.warnings[0], "a merge radius of 1e+06 reaches beyond the whole scene"));
    assert_same_picture(scene, given, 0.1);
    assert_true(preflight_of(scene, &unmerged).radius == 0.0);
    ca_scene_release(scene);
}

/* Each of the first allocations fails once, then some of those of a pilot's rounds, which are alike: that is what is
 * reported. */
static void test_out_of_memory(void **state)
{
    (void)state;
    ca_scene *scene = pool(true, SUN, 4);
    const ca_render_settings settings = settings_of("ppm", 1);
    long failures = 0;
    for (ca_status status = CA_ERROR_MEMORY; status != CA_OK; failures += 1 + failures / 6) {
        ca_preflight preflight;
        ca_error error = {""};
        ca_memory_fail_after(failures);
        status = ca_preflight_make(scene, &settings, &preflight, &error);
        ca_memory_fail_after(-1);
        if (status != CA_OK && status != CA_ERROR_MEMORY) fail_msg("allocation %ld: %s", failures, error.message);
    }
    assert_true(failures > 30);
    ca_scene_release(scene);
}

static void test_threads(void **state)
{
    (void)state;
    ca_scene *scene = pool(true, SUN SKY, 12);
    ca_render_settings settings = settings_of("path", 16);
    const ca_preflight one = preflight_of(scene, &settings);
    for (uint32_t threads = 2; threads <= 3; threads++) {
        settings.threads = threads;
        const ca_preflight more = preflight_of(scene, &settings);
        assert_string_equal(one.warnings[0], more.warnings[0]);
        assert_true(one.lost_light == more.lost_light && one.lost_light_low == more.lost_light_low);
        assert_int_equal(one.rays, more.rays);
    }
    settings.has_seed = true;
    settings.seed = 1;
    const ca_preflight other = preflight_of(scene, &settings);
    assert_true(other.lost_light != one.lost_light);
    ca_scene_release(scene);
}

/* ---- The share of samples -------------------------------------------------------------------------------------- */

/* The worst ones, as long as together they expect less than one; in whatever order they come. */
static void test_worst_samples(void **state)
{
    (void)state;
    enum { EACH = 4, COUNT = EACH * CA_LIGHT_BATCHES };
    static const ca_light_sample kinds[EACH] = {
        {.light = 3.0, .expected = 0.0}, {.light = 1.0, .expected = 0.5 / CA_LIGHT_BATCHES},
        {.light = 2.0, .expected = 1.2 / CA_LIGHT_BATCHES}, {.light = 14.0, .expected = 700.0}};
    ca_light_sample samples[COUNT];
    for (uint32_t turn = 0; turn < 2; turn++) {
        for (uint32_t i = 0; i < COUNT; i++) {
            const uint32_t place = turn ? COUNT - 1 - i : i;
            samples[place] = kinds[i % EACH];
            samples[place].batch = i / EACH;
        }
        /* All of the first and second kind, and of the third, which expect 1.2 together, less than a half. */
        const ca_batch_ratio share = ca_lost_light(samples, COUNT);
        const double sixth = 2.0 * 6.0 / (20.0 * CA_LIGHT_BATCHES);
        assert_true(fabs(share.value - (4.0 / 20.0 + sixth)) < 1e-12);
        assert_true(share.low < share.value && share.value < share.high && share.low > 0.15 && share.high < 0.35);
    }
    assert_true(isnan(ca_lost_light(samples, 0).value));
}

/* Two sums over four batches: by hand. */
static void test_batch_ratio(void **state)
{
    (void)state;
    const double parts[4] = {1.0, 2.0, 3.0, 2.0}, wholes[4] = {4.0, 4.0, 4.0, 4.0};
    const ca_batch_ratio ratio = ca_batch_ratio_of(parts, wholes, 4);
    const double reach = 3.182446 * sqrt(2.0 * 4.0 / 3.0) / 16.0; /* Student's t of 3 degrees of freedom */
    assert_true(fabs(ratio.value - 0.5) < 1e-12);
    assert_true(fabs(ratio.low - (0.5 - reach)) < 1e-6 && fabs(ratio.high - (0.5 + reach)) < 1e-6);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_worst_samples),    cmocka_unit_test(test_batch_ratio),
        cmocka_unit_test(test_lost_share),       cmocka_unit_test(test_integrators),
        cmocka_unit_test(test_a_tiny_render),
        cmocka_unit_test(test_no_false_alarm),   cmocka_unit_test(test_length_of_render),
        cmocka_unit_test(test_expected_samples), cmocka_unit_test(test_merged_photons),
        cmocka_unit_test(test_rare_merges),      cmocka_unit_test(test_parts),
        cmocka_unit_test(test_no_light),
        cmocka_unit_test(test_dark_light),
        cmocka_unit_test(test_rays),
        cmocka_unit_test(test_cost),
        cmocka_unit_test(test_radius),             cmocka_unit_test(test_threads),
        cmocka_unit_test(test_all_integrators_tell),
        cmocka_unit_test(test_reuse_rules),      cmocka_unit_test(test_photons_of_one_merge),
        cmocka_unit_test(test_crowd),
        cmocka_unit_test(test_crowd_at_any_radius),
        cmocka_unit_test(test_crowd_is_seen_early), cmocka_unit_test(test_out_of_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
