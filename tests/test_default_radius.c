/* The default merge radius: the choice against closed forms, and the pilot's radius against what it may depend on. */
#include "photon/radius_choice.h"
#include "render/render.h"
#include "support/scene_text.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* ---- The choice ------------------------------------------------------------------------------------------------ */

#define VARIANCE 30.0

/* Shares of change of photon/radius_choice.c at the ends of its powers. */
#define SMOOTH_SHARE 0.5625
#define EDGE_SHARE 0.2311

/* Variance 30 / r^2 by one light path, and blur a r^p, measured without noise at radii from 0.01 on. */
static ca_radius_curve curve_of(double factor, double power)
{
    ca_radius_curve curve = {.count = CA_RADIUS_LEVELS};
    for (uint32_t k = 0; k < curve.count; k++) {
        const double r = curve.radius[k] = 0.01 * exp2(k);
        curve.variance[k] = VARIANCE / (r * r);
        curve.change[k] = (power == 4.0 ? SMOOTH_SHARE : EDGE_SHARE) * factor * pow(r, power);
        curve.change_error[k] = 1e-9 * curve.change[k];
    }
    return curve;
}

/* The mean square error after 64 passes whose radii shrink, by the formula. */
static double error_of(double factor, double power, double alpha, double light_paths, double r0)
{
    double blur = 0.0, variance = 0.0;
    for (int n = 1; n <= 64; n++) {
        const double r = r0 * pow(n, -alpha / 2.0);
        blur += sqrt(factor * pow(r, power)) / 64.0;
        variance += VARIANCE / (r * r) / light_paths / (64.0 * 64.0);
    }
    return blur * blur + variance;
}

/* Of a render of any length, within the tenth that the mean area is known to. */
static void test_mean_blur(void **state)
{
    (void)state;
    static const double powers[] = {1.0, 2.0, 4.0}, alphas[] = {0.0, 1.0 / 3.0, 0.5};
    static const uint32_t lengths[] = {1, 20, 5000};
    for (int i = 0; i < 27; i++) {
        const double power = powers[i % 3], alpha = alphas[i / 3 % 3];
        const uint32_t passes = lengths[i / 9];
        const ca_radius_blur blur = {.factor = 3.0, .power = power, .end = (double)INFINITY};
        double root = 0.0;
        for (uint32_t n = 1; n <= passes; n++) root += sqrt(ca_radius_blur_at(&blur, 0.5 * pow(n, -alpha / 2.0)));
        root /= passes;
        assert_true(fabs(ca_radius_mean_blur(&blur, 0.5, alpha, passes) / (root * root) - 1.0) < 0.2);
    }
}

static double choose(double factor, double power, double alpha, double light_paths)
{
    const ca_radius_curve curve = curve_of(factor, power);
    return ca_radius_choose(&curve, alpha, light_paths, 1e-4, 10.0);
}

static void test_blur(void **state)
{
    (void)state;
    static const double powers[] = {1.0, 4.0};
    for (int i = 0; i < 2; i++) {
        const ca_radius_curve curve = curve_of(3.0, powers[i]);
        const ca_radius_blur blur = ca_radius_blur_of(&curve);
        assert_true(fabs(blur.power - powers[i]) < 1e-9);
        assert_true(fabs(blur.factor / 3.0 - 1.0) < 1e-6);
    }
}

/* Lines of light that are thinner than the largest radii: what these change tells where blur ends, and is not taken
 * for how fast it grows. */
static void test_end_of_blur(void **state)
{
    (void)state;
    ca_radius_curve curve = curve_of(1.0, 1.0);
    const ca_radius_blur lines = {.factor = 3.0, .power = 1.0, .end = curve.radius[3]};
    for (uint32_t k = 0; k < curve.count; k++) {
        const double r = curve.radius[k];
        curve.change[k] = 2.0 * EDGE_SHARE * (ca_radius_blur_at(&lines, r) - ca_radius_blur_at(&lines, 0.5 * r));
        curve.change_error[k] = 0.05 * curve.change[k];
    }
    const ca_radius_blur blur = ca_radius_blur_of(&curve);
    assert_true(blur.power == 1.0 && blur.end == lines.end);
    assert_true(fabs(blur.factor / lines.factor - 1.0) < 1e-3);
    assert_true(fabs(ca_radius_blur_at(&blur, 1e6) / (3.0 * lines.end) - 1.0) < 1e-2);
}

/* A large radius whose change is told too small by chance does not draw down what all others say. */
static void test_one_small_change(void **state)
{
    (void)state;
    ca_radius_curve curve = curve_of(3.0, 1.0);
    for (uint32_t k = 0; k < curve.count; k++) curve.change_error[k] = 0.1 * curve.change[k];
    curve.change[6] *= 0.1;
    curve.change_error[6] *= 0.1;
    const ca_radius_blur blur = ca_radius_blur_of(&curve);
    const double ratio = ca_radius_blur_at(&blur, 0.02) / (3.0 * 0.02);
    print_message("one change a tenth: blur of small radii %.3g times\n", ratio);
    assert_true(ratio > 0.8 && ratio < 1.2);
}

/* Blur that cannot be told from none is not none: the smaller the error with which it is told, the larger a radius
 * may be. */
static void test_unseen_blur(void **state)
{
    (void)state;
    double last = 0.0;
    for (int i = 0; i < 3; i++) {
        ca_radius_curve curve = curve_of(1.0, 2.0);
        for (uint32_t k = 0; k < curve.count; k++) {
            curve.change_error[k] = pow(0.01, i) * curve.change[k];
            curve.change[k] = 0.0;
        }
        const double radius = ca_radius_choose(&curve, 0.0, 1e4, 1e-4, 10.0);
        assert_true(radius > 1.5 * last && radius < 5.0);
        last = radius;
    }
}

/* Blur that is told at large radii alone may fall in any way towards small ones: the radius is good for all of these,
 * not the best for the likeliest. */
static void test_unknown_power(void **state)
{
    (void)state;
    ca_radius_curve curve = curve_of(1.0, 2.0);
    for (uint32_t k = 0; k < curve.count; k++) curve.change_error[k] = (k < 6 ? 1e3 : 0.1) * curve.change[k];
    curve.merging_alone = true;
    const ca_radius_blur likeliest = ca_radius_blur_of(&curve);
    const double radius = ca_radius_choose(&curve, 0.0, 1e6, 1e-4, 10.0);
    double best = 0.0, least = (double)INFINITY;
    for (double r = 1e-4; r < 10.0; r *= 1.01) {
        const double error = error_of(likeliest.factor, likeliest.power, 0.0, 1e6, r);
        if (error < least) best = r;
        least = fmin(least, error);
    }
    print_message("power %g: best %g, chosen %g\n", likeliest.power, best, radius);
    assert_true(radius < 0.85 * best && radius > 0.5 * best);
}

/* A few bright paths that one radius happens to find do not decide. */
static void test_bright_paths(void **state)
{
    (void)state;
    for (int i = 0; i < 2; i++) {
        ca_radius_curve curve = curve_of(3.0, 1.0);
        curve.merging_alone = i == 1;
        const double radius = ca_radius_choose(&curve, 0.0, 1e4, 1e-4, 10.0);
        curve.variance[2] *= 1000.0;
        assert_true(ca_radius_choose(&curve, 0.0, 1e4, 1e-4, 10.0) == radius);
        for (uint32_t k = 0; k < curve.count; k++) curve.variance[k] = curve.variance[0];
        const double noisy = ca_radius_choose(&curve, 0.0, 1e4, 1e-4, 10.0);
        assert_true(curve.merging_alone ? noisy > 0.1 * radius : noisy == 1e-4);
    }
}

/* Noise around no change at all is no blur. */
static void test_no_blur(void **state)
{
    (void)state;
    ca_radius_curve curve = curve_of(1.0, 4.0);
    for (uint32_t k = 0; k < curve.count; k++) curve.change[k] = k % 2 ? -1e-3 : -1e-5;
    assert_true(ca_radius_blur_of(&curve).factor == 0.0);
    assert_true(ca_radius_choose(&curve, 0.0, 1e4, 1e-4, 10.0) > 9.0);
}

/* Within the tolerance of the least error, and what is two steps smaller is not (a factor of two has eight). */
static void check_least_error(double power, double alpha, bool alone)
{
    const double tolerance = alone ? 0.01 : 0.05;
    ca_radius_curve curve = curve_of(3.0, power);
    curve.merging_alone = alone;
    const double chosen = ca_radius_choose(&curve, alpha, 1e4, 1e-4, 10.0);
    double least = (double)INFINITY;
    for (double r = 1e-4; r < 10.0; r *= 1.01) least = fmin(least, error_of(3.0, power, alpha, 1e4, r));
    assert_true(error_of(3.0, power, alpha, 1e4, chosen) < (1.01 + tolerance) * least);
    assert_true(error_of(3.0, power, alpha, 1e4, chosen / exp2(0.25)) > (1.0 + tolerance) * least);
}

static void test_least_error(void **state)
{
    (void)state;
    static const double alphas[] = {0.0, 1.0 / 3.0, 0.75};
    for (int i = 0; i < 12; i++) check_least_error(i < 6 ? 1.0 : 4.0, alphas[i % 3], i / 3 % 2 == 0);
}

/* Where other techniques find the light, too, the error hardly depends on the radius: a few per cent do not make a
 * large one of a small one. */
static void test_flat_errors(void **state)
{
    (void)state;
    ca_radius_curve curve = curve_of(3.0, 4.0);
    for (uint32_t k = 0; k < curve.count; k++) {
        curve.variance[k] = 1.0 - 0.005 * k;
        curve.change[k] = curve.change_error[k] = 0.0;
    }
    assert_true(ca_radius_choose(&curve, 0.0, 1e4, 0.01, 0.64) == 0.01);
}

/* Four times the light paths: the radius falls by 4^(1 / (p + 2)). A radius is one of eight in a factor of two. */
static void test_more_light_paths(void **state)
{
    (void)state;
    for (int i = 0; i < 2; i++) {
        const double power = i ? 4.0 : 1.0;
        const double ratio = choose(3.0, power, 0.5, 64.0 * 1e3) / choose(3.0, power, 0.5, 1e3);
        assert_true(fabs(log2(ratio) + 6.0 / (power + 2.0)) < 0.13);
    }
}

static void test_bounds(void **state)
{
    (void)state;
    const ca_radius_curve curve = curve_of(3.0, 4.0);
    const double free_choice = choose(3.0, 4.0, 0.0, 1e4);
    assert_true(ca_radius_choose(&curve, 0.0, 1e4, 2.0 * free_choice, 10.0) == 2.0 * free_choice);
    assert_true(ca_radius_choose(&curve, 0.0, 1e4, 1e-4, 0.5 * free_choice) == 0.5 * free_choice);
}

/* ---- The pilot ------------------------------------------------------------------------------------------------- */

/* A floor in the sun, 20 m wide, of which the middle is seen; `edge`: half of what is seen lies in the shade of a
 * plate. All lengths times `scale`. */
static ca_scene *floor_scene(double scale, bool edge)
{
    char xml[4096], plate[512] = "";
    if (edge)
        snprintf(plate, sizeof plate,
                 "<shape type='rectangle'><transform name='to_world'><scale value='%g'/><rotate x='1' angle='-90'/>"
                 "<translate x='%g' y='%g'/></transform><bsdf type='diffuse'><rgb name='reflectance' "
                 "value='0'/></bsdf></shape>",
                 4.0 * scale, 4.0 * scale, 3.0 * scale);
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><integrator type='ppm'><integer name='max_depth' value='2'/></integrator>"
             "<sensor type='perspective'><float name='fov' value='40'/><float name='near_clip' value='%g'/>"
             "<transform name='to_world'><lookat origin='0,%g,0' target='0,0,0' up='0,0,1'/></transform>"
             "<film type='hdrfilm'>"
             "<integer name='width' value='48'/><integer name='height' value='48'/><rfilter type='box'/></film>"
             "</sensor><emitter type='directional'><vector name='direction' value='0,-1,0'/>"
             "<rgb name='irradiance' value='1'/></emitter><shape type='rectangle'>"
             "<transform name='to_world'><scale value='%g'/><rotate x='1' "
             "angle='-90'/></transform><bsdf type='diffuse'><rgb name='reflectance' value='0.5'/></bsdf></shape>%s"
             "</scene>",
             0.01 * scale, 2.5 * scale, 10.0 * scale, plate);
    return scene_from_text(xml);
}

/* The floor, of which half is in the shade, in a sun of this strength from above, or from the side by a mirror that
 * stands over one half: nothing else is lit. */
static ca_scene *bright_scene(double irradiance, bool mirror)
{
    static const char *const plate =
        "<shape type='rectangle'><transform name='to_world'><scale value='4'/><rotate x='1' angle='-90'/>"
        "<translate x='4' y='3'/></transform><bsdf type='diffuse'><rgb name='reflectance' value='0'/></bsdf></shape>";
    static const char *const slanting =
        "<shape type='rectangle'><transform name='to_world'><scale value='4'/><lookat origin='-2.83,6,0' "
        "target='-3.83,5,0' up='0,0,1'/></transform><bsdf type='conductor'><string name='material' value='Ag'/>"
        "</bsdf></shape>";
    char xml[4096];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><integrator type='ppm'><integer name='max_depth' value='3'/></integrator>"
             "<sensor type='perspective'><float name='fov' value='40'/>"
             "<transform name='to_world'><lookat origin='0,2.5,0' target='0,0,0' up='0,0,1'/></transform>"
             "<film type='hdrfilm'><integer name='width' value='48'/><integer name='height' value='48'/>"
             "<rfilter type='box'/></film></sensor><emitter type='directional'><vector name='direction' value='%s'/>"
             "<rgb name='irradiance' value='%g'/></emitter><shape type='rectangle'><transform name='to_world'>"
             "<scale value='10'/><rotate x='1' angle='-90'/></transform><bsdf type='diffuse'>"
             "<rgb name='reflectance' value='0.5'/></bsdf></shape>%s</scene>",
             mirror ? "1,0,0" : "0,-1,0", irradiance, mirror ? slanting : plate);
    return scene_from_text(xml);
}

/* The same floor, all that the camera sees of it lit evenly by a mirror above. */
static ca_scene *mirrored_scene(void)
{
    return scene_from_text(
        "<scene version='3.0.0'><integrator type='ppm'><integer name='max_depth' value='3'/></integrator>"
        "<sensor type='perspective'><float name='fov' value='40'/>"
        "<transform name='to_world'><lookat origin='0,2.5,0' target='0,0,0' up='0,0,1'/></transform>"
        "<film type='hdrfilm'><integer name='width' value='48'/><integer name='height' value='48'/>"
        "<rfilter type='box'/></film></sensor><emitter type='directional'><vector name='direction' value='1,0,0'/>"
        "<rgb name='irradiance' value='1'/></emitter><shape type='rectangle'><transform name='to_world'>"
        "<scale value='10'/><rotate x='1' angle='-90'/></transform><bsdf type='diffuse'>"
        "<rgb name='reflectance' value='0.5'/></bsdf></shape><shape type='rectangle'><transform name='to_world'>"
        "<scale value='10'/><lookat origin='0,12,0' target='-1,11,0' up='0,0,1'/></transform>"
        "<bsdf type='conductor'><string name='material' value='Ag'/></bsdf></shape></scene>");
}

/* That a render with these settings begins with. */
static double radius_of(const ca_scene *scene, const ca_render_settings *settings)
{
    ca_render_plan plan;
    ca_error error;
    assert_int_equal(ca_render_plan_make(&plan, scene, settings, &error), CA_OK);
    return ca_integrator_value(plan.type, &plan.input, "radius", -1.0);
}

static ca_render_settings settings_of(const char *integrator)
{
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.integrator = integrator;
    settings.samples_per_pixel = 4;
    return settings;
}

/* Even light allows a large radius, the largest of all; an edge does not. A pixel is 3.8 cm wide. */
static void test_light_decides(void **state)
{
    (void)state;
    const ca_render_settings settings = settings_of("ppm");
    ca_scene *even = floor_scene(1.0, false), *edge = floor_scene(1.0, true);
    const double wide = radius_of(even, &settings), narrow = radius_of(edge, &settings);
    print_message("even light: %g m, with an edge: %g m\n", wide, narrow);
    assert_true(wide > 2.5 * narrow);
    assert_true(narrow > 0.01);
    ca_scene_release(even);
    ca_scene_release(edge);
}

/* Light that a merge brings into the dark beside something bright is the larger an error the brighter that is, and
 * the noise of what is bright is not: errors are told in parts of a pixel's own light, whether next event tells that
 * light or photons by way of a mirror do. */
static void test_dark_pixels(void **state)
{
    (void)state;
    const ca_render_settings settings = settings_of("ppm");
    for (int i = 0; i < 2; i++) {
        ca_scene *dim = bright_scene(1.0, i == 1), *bright = bright_scene(100.0, i == 1);
        const double wide = radius_of(dim, &settings), narrow = radius_of(bright, &settings);
        print_message("%s: %g m, a hundred times as bright: %g m\n", i ? "by a mirror" : "in the sun", wide, narrow);
        assert_true(narrow < 0.5 * wide);
        ca_scene_release(dim);
        ca_scene_release(bright);
    }
}

/* So does even light by a mirror as large as the floor: the noise of photons does not pass for blur where they tell a
 * pixel's light, too. */
static void test_even_light_by_a_mirror(void **state)
{
    (void)state;
    const ca_render_settings settings = settings_of("ppm");
    ca_scene *even = floor_scene(1.0, false), *mirrored = mirrored_scene();
    const double straight = radius_of(even, &settings), radius = radius_of(mirrored, &settings);
    print_message("even light: %g m, by a mirror: %g m\n", straight, radius);
    assert_true(radius > 0.9 * straight);
    ca_scene_release(even);
    ca_scene_release(mirrored);
}

/* A wall under a small square lamp, in direct light alone. */
static ca_scene *wall_scene(void)
{
    return scene_from_text(
        "<scene version='3.0.0'><integrator type='ovcm'><integer name='max_depth' value='2'/></integrator>"
        "<sensor type='perspective'><float name='fov' value='20'/>"
        "<transform name='to_world'><lookat origin='0,0,4' target='0,0,0' up='0,1,0'/></transform>"
        "<film type='hdrfilm'><integer name='width' value='64'/><integer name='height' value='64'/>"
        "<rfilter type='box'/></film></sensor><shape type='rectangle'><transform name='to_world'>"
        "<scale value='0.1'/><lookat origin='1.2,0,1.5' target='1.2,0,0' up='0,1,0'/></transform>"
        "<emitter type='area'><rgb name='radiance' value='50'/></emitter></shape>"
        "<shape type='rectangle'><transform name='to_world'><scale value='3'/></transform>"
        "<bsdf type='diffuse'><rgb name='reflectance' value='0.5'/></bsdf></shape></scene>");
}

/* Next event is nearly without noise there: merges can bring nothing but noise, blur and time. */
static void test_quiet_next_event(void **state)
{
    (void)state;
    const ca_render_settings shared = settings_of("ovcm"), alone = settings_of("ppm");
    ca_scene *wall = wall_scene();
    const double quiet = radius_of(wall, &shared), merged = radius_of(wall, &alone);
    print_message("a wall: %.3g m with next event, %.3g m with photons alone\n", quiet, merged);
    assert_true(quiet < 0.1 * merged);
    ca_scene_release(wall);
}

/* Of light through a slab of glass some 80 photons arrive, which many camera paths find: their noise is no blur. */
static void test_few_photons(void **state)
{
    (void)state;
    ca_error error;
    ca_scene *scene;
    const char *const path = CA_SOURCE_DIR "/scenes/glass-slab/glass-slab.xml";
    assert_int_equal(ca_scene_load(path, NULL, 0, &scene, &error), CA_OK);
    for (uint64_t seed = 0; seed < 4; seed++) {
        ca_render_settings settings = settings_of("ppm");
        settings.width = settings.height = 64;
        settings.seed = seed;
        settings.has_seed = true;
        const double radius = radius_of(scene, &settings);
        print_message("glass slab: %.4g m\n", radius);
        assert_true(radius > 0.15);
    }
    ca_scene_release(scene);
}

static void test_scale(void **state)
{
    (void)state;
    static const char *const integrators[] = {"ppm", "ovcm"};
    ca_scene *small = floor_scene(1.0, true), *large = floor_scene(10.0, true);
    for (int i = 0; i < 2; i++) {
        const ca_render_settings settings = settings_of(integrators[i]);
        const double ratio = radius_of(large, &settings) / radius_of(small, &settings);
        assert_true(ratio > 10.0 / 1.1 && ratio < 10.0 * 1.1);
    }
    ca_scene_release(small);
    ca_scene_release(large);
}

static void test_light_paths(void **state)
{
    (void)state;
    ca_scene *scene = floor_scene(1.0, true);
    const ca_render_settings few = settings_of("ppm:light_paths=2000"), many = settings_of("ppm:light_paths=128000");
    const double ratio = radius_of(scene, &many) / radius_of(scene, &few);
    assert_true(ratio < 1.1 / 2.0 && ratio > 0.9 / 4.0); /* 64^(-1/6) and 64^(-1/3) */
    ca_scene_release(scene);
}

/* With millions of them the radius is the one that merges a number of photons, whatever blur there is. */
static void test_most_photons(void **state)
{
    (void)state;
    ca_scene *scene = floor_scene(1.0, false);
    const ca_render_settings many = settings_of("ppm:light_paths=4000000");
    const ca_render_settings more = settings_of("ppm:light_paths=64000000");
    const double ratio = radius_of(scene, &more) / radius_of(scene, &many);
    print_message("sixteen times as many light paths: %.4g of the radius\n", ratio);
    assert_true(fabs(ratio - 0.25) < 0.01);
    ca_scene_release(scene);
}

/* A function of scene, settings and seed: not of the crop, of threads, or of memory, which brings rounds. */
static void test_same_radius(void **state)
{
    (void)state;
    static const char *const integrators[] = {"ppm", "bdpm", "vcm", "ovcm", "vavcm", "qmcppm"};
    ca_scene *scene = floor_scene(1.0, true);
    for (size_t i = 0; i < sizeof integrators / sizeof integrators[0]; i++) {
        ca_render_settings settings = settings_of(integrators[i]);
        settings.threads = 1;
        const double radius = radius_of(scene, &settings);
        assert_true(radius > 0.0);
        settings.threads = 3;
        settings.memory_mib = 64.0;
        settings.has_crop = true;
        settings.crop[0] = 5, settings.crop[1] = 7, settings.crop[2] = 11, settings.crop[3] = 30;
        assert_true(radius_of(scene, &settings) == radius);
    }
    ca_scene_release(scene);
}

/* One radius for `vcm` and its kin, another one for photons alone; what is given is used. */
static void test_families(void **state)
{
    (void)state;
    ca_scene *scene = floor_scene(1.0, true);
    const ca_render_settings ppm = settings_of("ppm:alpha=0.5"), none = settings_of("qmcppm:alpha=0.5"),
                             ovcm = settings_of("ovcm"), vcm = settings_of("vcm"),
                             given = settings_of("vcm:radius=0.25"), open = settings_of("vcm:radius=0"),
                             pixels = settings_of("vcm:radius_pixels=2");
    assert_true(radius_of(scene, &ovcm) == radius_of(scene, &vcm));
    assert_true(radius_of(scene, &ppm) == radius_of(scene, &none));
    assert_true(radius_of(scene, &given) == 0.25);
    assert_true(radius_of(scene, &open) == radius_of(scene, &vcm));
    ca_render_settings found = open;
    found.radius = 0.25; /* by whoever has looked for it */
    assert_true(radius_of(scene, &found) == 0.25);
    assert_true(fabs(radius_of(scene, &pixels) / (2.0 * 2.0 * 2.5 * tan((double)CA_PI / 9.0) / 48.0) - 1.0) < 0.2);
    ca_scene_release(scene);
}

/* The picture's record tells the radius, and with it the same picture comes again: the pilot took none of the
 * render's random numbers. */
static void test_record(void **state)
{
    (void)state;
    static const char *const integrators[] = {"ppm", "vavcm", "qmcppm"};
    ca_scene *scene = floor_scene(1.0, true);
    for (int i = 0; i < 3; i++) {
        ca_render_settings settings = settings_of(integrators[i]);
        const double radius = radius_of(scene, &settings);
        ca_image_layers *image = render_scene(scene, &settings);
        const char *found = strstr(attribute_text(image, "caustica.integrator"), "radius=");
        assert_non_null(found);
        settings.radius = strtod(found + strlen("radius="), NULL);
        assert_true((float)settings.radius == (float)radius);
        assert_true(rendered_hash(scene, &settings) == image_hash(image));
        ca_image_release(image);
    }
    ca_scene_release(scene);
}

/* The noise of the picture, in percent. */
static double noise_of(const ca_scene *scene, const char *integrator)
{
    ca_render_settings settings = settings_of(integrator);
    ca_render_statistics statistics = {.size = sizeof statistics};
    ca_image_layers *image;
    ca_error error;
    settings.samples_per_pixel = 32;
    settings.width = settings.height = 32;
    assert_int_equal(ca_render(scene, &settings, &image, &statistics, &error), CA_OK);
    ca_image_release(image);
    return statistics.noise_percent;
}

/* Light through a slab of glass, which few photons bring: dots, with a radius of a pixel. */
static void test_no_dots(void **state)
{
    (void)state;
    ca_scene *scene = bundled_scene("glass-slab/glass-slab");
    const double dots = noise_of(scene, "ovcm:radius_pixels=1"), smooth = noise_of(scene, "ovcm");
    print_message("noise with a radius of a pixel: %.0f %%, by default: %.1f %%\n", dots, smooth);
    assert_true(smooth < 0.2 * dots);
    ca_scene_release(scene);
}

/* A scene without light, and one whose camera sees nothing: the radius is then of no matter, but there is one. */
static void test_no_light(void **state)
{
    (void)state;
    static const char *const texts[] = {
        "<scene version='3.0.0'><sensor type='perspective'/><shape type='sphere'><transform name='to_world'>"
        "<translate z='5'/></transform></shape></scene>",
        "<scene version='3.0.0'><sensor type='perspective'/><emitter type='point'><rgb name='intensity' "
        "value='1'/></emitter></scene>"};
    for (int i = 0; i < 2; i++) {
        ca_scene *scene = scene_from_text(texts[i]);
        ca_render_settings settings = settings_of("ovcm");
        settings.width = settings.height = 8;
        assert_true(radius_of(scene, &settings) > 0.0);
        ca_scene_release(scene);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_blur),          cmocka_unit_test(test_no_blur),     cmocka_unit_test(test_least_error),
        cmocka_unit_test(test_flat_errors),
        cmocka_unit_test(test_bounds),        cmocka_unit_test(test_more_light_paths),
        cmocka_unit_test(test_light_decides),
        cmocka_unit_test(test_scale),         cmocka_unit_test(test_light_paths), cmocka_unit_test(test_same_radius),
        cmocka_unit_test(test_families),      cmocka_unit_test(test_record),      cmocka_unit_test(test_no_dots),
        cmocka_unit_test(test_no_light),      cmocka_unit_test(test_most_photons),
        cmocka_unit_test(test_end_of_blur),   cmocka_unit_test(test_one_small_change),
        cmocka_unit_test(test_even_light_by_a_mirror),
        cmocka_unit_test(test_dark_pixels),   cmocka_unit_test(test_few_photons),
        cmocka_unit_test(test_unknown_power),
        cmocka_unit_test(test_unseen_blur),   cmocka_unit_test(test_bright_paths),
        cmocka_unit_test(test_quiet_next_event),
        cmocka_unit_test(test_mean_blur),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
