/* The renderer around the integrator: the same bits for any number of threads, stopping by samples, time, noise and
 * request, crops, layers, attributes. */
#include "image/layers.h"
#include "render/noise_looks.h"
#include "render/render.h"
#include "sampling/sampler.h"
#include "support/scene_text.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const char *const scene_text =
    "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' value='6'/></integrator>"
    "<sensor type='thinlens'><float name='fov' value='60'/><float name='aperture_radius' value='0.05'/>"
    "<float name='focus_distance' value='3'/>"
    "<transform name='to_world'><lookat origin='0,1,-3' target='0,0.5,0' up='0,1,0'/></transform>"
    "<sampler type='independent'><integer name='sample_count' value='5'/></sampler>"
    "<film type='hdrfilm'><integer name='width' value='67'/><integer name='height' value='45'/>"
    "<rfilter type='mitchell'/></film></sensor>"
    "<shape type='rectangle'><transform name='to_world'><rotate x='1' angle='-90'/><scale value='4'/></transform>"
    "<bsdf type='diffuse'><texture type='checkerboard' name='reflectance'/></bsdf></shape>"
    "<shape type='sphere'><point name='center' value='0,0.5,0'/><float name='radius' value='0.5'/>"
    "<bsdf type='dielectric'/></shape>"
    "<shape type='cube'><transform name='to_world'><scale value='0.3'/><translate x='1' y='0.3'/></transform>"
    "<bsdf type='roughconductor'><float name='alpha' value='0.2'/></bsdf></shape>"
    "<emitter type='constant'><rgb name='radiance' value='0.4'/></emitter>"
    "<shape type='disk'><transform name='to_world'><scale value='0.3'/><rotate x='1' angle='90'/><translate y='3'/>"
    "</transform><bsdf type='diffuse'/>"
    "<emitter type='area'><rgb name='radiance' value='20'/></emitter></shape></scene>";

static ca_render_settings settings_with(uint32_t samples)
{
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.samples_per_pixel = samples;
    return settings;
}

static void test_threads_do_not_change_a_bit(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(scene_text);
    for (int s = 0; s < CA_SAMPLER_KIND_COUNT; s++) {
        uint64_t hashes[4];
        static const uint32_t threads[4] = {1, 2, 3, 8};
        for (int i = 0; i < 4; i++) {
            ca_render_settings settings = settings_with(5);
            settings.sampler = ca_sampler_name((ca_sampler_kind)s);
            settings.threads = threads[i];
            hashes[i] = rendered_hash(scene, &settings);
        }
        for (int i = 1; i < 4; i++) assert_true(hashes[i] == hashes[0]);
    }
    ca_scene_release(scene);
}

static void test_seed_and_sampler_change_the_image(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(scene_text);
    uint64_t hashes[CA_SAMPLER_KIND_COUNT + 1];
    ca_render_settings settings = settings_with(2);
    for (int s = 0; s < CA_SAMPLER_KIND_COUNT; s++) {
        settings.sampler = ca_sampler_name((ca_sampler_kind)s);
        hashes[s] = rendered_hash(scene, &settings);
    }
    settings.sampler = NULL; /* the scene's: independent */
    settings.has_seed = true;
    settings.seed = 12345;
    hashes[CA_SAMPLER_KIND_COUNT] = rendered_hash(scene, &settings);
    for (int i = 0; i <= CA_SAMPLER_KIND_COUNT; i++)
        for (int j = 0; j < i; j++)
            if (hashes[i] == hashes[j]) fail_msg("images %d and %d are the same", i, j);
    ca_scene_release(scene);
}

/* A crop shows the same pixels as the whole picture, to the bit. */
static void test_a_crop_is_a_part_of_the_picture(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(scene_text);
    ca_render_settings settings = settings_with(3);
    ca_image_layers *whole = render_scene(scene, &settings);
    settings.has_crop = true;
    const uint32_t crop[4] = {13, 7, 50, 31};
    memcpy(settings.crop, crop, sizeof crop);
    ca_image_layers *part = render_scene(scene, &settings);
    assert_int_equal(part->width, 37);
    assert_int_equal(part->height, 24);
    assert_int_equal(part->x0, 13);
    assert_int_equal(part->y0, 7);
    assert_int_equal(part->full_width, 67);
    for (size_t c = 0; c < whole->channel_count; c++)
        for (uint32_t y = 0; y < part->height; y++)
            assert_memory_equal(part->channels[c].data + (size_t)y * part->width,
                                whole->channels[c].data + (size_t)(y + 7) * whole->width + 13,
                                part->width * sizeof(float));
    ca_image_release(whole);
    ca_image_release(part);
    ca_scene_release(scene);
}

#define RECTANGLE "<shape type='rectangle'/><emitter type='constant'/></scene>"

/* The scene's crop in a film of another size has a pixel at least; meters keep the size that their film has. */
static void test_films_of_another_size(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        uint32_t width, height;
        const char *says; /* NULL: it is rendered */
    } cases[] = {
        {"<scene version='3.0.0'><sensor type='perspective'><film type='hdrfilm'><integer name='width' value='16'/>"
         "<integer name='height' value='16'/><integer name='crop_offset_x' value='5'/><integer name='crop_offset_y' "
         "value='15'/><integer name='crop_width' value='1'/><integer name='crop_height' value='1'/></film></sensor>"
         RECTANGLE,
         8, 3, NULL},
        {"<scene version='3.0.0'><sensor type='radiancemeter'><film type='hdrfilm'><integer name='width' value='1'/>"
         "<integer name='height' value='1'/></film></sensor>" RECTANGLE,
         4, 4, "the scene's sensor measures 1 x 1 pixels, and a film of 4 x 4 is asked for"},
        {"<scene version='3.0.0'><sensor type='batch'><sensor type='perspective'/><sensor type='perspective'/>"
         "<film type='hdrfilm'><integer name='width' value='16'/><integer name='height' value='8'/></film></sensor>"
         RECTANGLE,
         15, 8, "a film of 15 pixels a row cannot be divided among the batch's 2 sensors"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        ca_scene *scene = scene_from_text(cases[i].text);
        ca_render_settings settings = settings_with(1);
        ca_image_layers *image;
        ca_error error;
        settings.width = cases[i].width, settings.height = cases[i].height;
        const ca_status status = ca_render(scene, &settings, &image, NULL, &error);
        assert_int_equal(status, cases[i].says ? CA_ERROR_ARGUMENT : CA_OK);
        if (cases[i].says) {
            assert_string_equal(error.message, cases[i].says);
        } else {
            assert_int_equal(image->width, 1);
            assert_int_equal(image->height, 1);
            ca_image_release(image);
        }
        ca_scene_release(scene);
    }
}

static bool stop_after_three(const ca_render_progress *progress, void *user)
{
    *(uint32_t *)user = progress->passes_done;
    return progress->passes_done < 3;
}

static void test_a_stopped_render_is_a_shorter_one(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(scene_text);
    uint32_t passes = 0;
    ca_render_settings settings = settings_with(100);
    settings.progress = stop_after_three;
    settings.progress_user = &passes;
    ca_image_layers *stopped = NULL;
    ca_render_statistics statistics = {.size = sizeof statistics};
    assert_int_equal(ca_render(scene, &settings, &stopped, &statistics, NULL), CA_OK);
    assert_int_equal(passes, 3);
    assert_true(statistics.interrupted);
    assert_int_equal(statistics.iterations, 3);
    assert_int_equal(statistics.camera_paths, 3 * 67 * 45);
    settings = settings_with(3);
    ca_image_layers *three = render_scene(scene, &settings);
    assert_true(image_hash(three) == image_hash(stopped));
    ca_image_release(three);
    ca_image_release(stopped);
    ca_scene_release(scene);
}

/* Looks at a noise that falls as it should, and at one that scatters: few, and the last one just beyond the
 * target. */
static void test_noise_looks(void **state)
{
    (void)state;
    for (int scatter = 0; scatter < 2; scatter++)
        for (double target = 0.3; target < 30.0; target *= 1.07) {
            ca_noise_looks looks = ca_noise_looks_start(target, 8.0, 64.0);
            uint32_t passes = 0, count = 0;
            double noise = 0.0;
            do {
                passes++;
                if (!ca_noise_looks_due(&looks, passes)) continue;
                noise = 100.0 / sqrt(passes) * (1.0 + scatter * 0.1 / sqrt(passes) * (passes % 3 - 1.0));
                ca_noise_looks_take(&looks, passes, noise, 2.0 * passes, 2.0);
                count++;
                if (count == 1 && noise >= target)
                    assert_true(fabs(looks.first_predicted_seconds / (2.0 * 8.0 * noise * noise / target / target) -
                                     1.0) < 1e-9);
            } while (!ca_noise_looks_reached(&looks));
            const double needed = fmax(8.0, 100.0 / target * 100.0 / target);
            assert_true(passes <= needed * 1.05 + 2.0 && passes >= needed * (scatter ? 0.95 : 1.0) - 1.0);
            assert_true(count <= 2.0 + log2(needed / 8.0) + 2.0 * scatter);
        }
    ca_noise_looks looks = ca_noise_looks_start(0.0, 8.0, 64.0);
    ca_noise_looks_take(&looks, 8.0, 5.0, 1.0, 0.125);
    assert_true(looks.next == 16.0 && looks.noise == 5.0 && looks.first_predicted_seconds == 0.0 &&
                !ca_noise_looks_reached(&looks));
    ca_noise_looks_take(&looks, 16.0, (double)NAN, 2.0, 0.125);
    assert_true(looks.next == 32.0 && looks.noise < 0.0);
}

/* A picture that stays black is given up at a look, and would be at the same one after a break. */
static void test_looks_at_a_black_picture(void **state)
{
    (void)state;
    assert_true(ca_noise_looks_patience(64.0 * 64.0, true) == 4096.0 && ca_noise_looks_patience(1.0, true) == 4096.0);
    assert_true(ca_noise_looks_patience(0x1p16, true) == 256.0 && ca_noise_looks_patience(0x1p23, true) == 64.0);
    assert_true(ca_noise_looks_patience(64.0 * 64.0, false) == 0.0);
    ca_noise_looks looks = ca_noise_looks_start(1.0, 8.0, 20.0);
    ca_noise_looks_recall(&looks, looks.noise, looks.next);
    for (double passes = 8.0; passes <= 32.0; passes *= 2.0) {
        assert_false(ca_noise_looks_over(&looks));
        ca_noise_looks_take(&looks, passes, (double)NAN, passes, 1.0);
        ca_noise_looks recalled = ca_noise_looks_start(1.0, 8.0, 20.0);
        ca_noise_looks_recall(&recalled, looks.noise, looks.next);
        assert_true(recalled.given_up == looks.given_up);
    }
    assert_true(looks.given_up && ca_noise_looks_over(&looks) && !ca_noise_looks_reached(&looks));
    looks = ca_noise_looks_start(1.0, 8.0, 20.0); /* light that is found late */
    ca_noise_looks_take(&looks, 8.0, (double)NAN, 1.0, 1.0);
    ca_noise_looks_take(&looks, 32.0, 50.0, 1.0, 1.0);
    assert_false(ca_noise_looks_over(&looks));
    looks = ca_noise_looks_start(0.0, 8.0, 20.0);
    ca_noise_looks_take(&looks, 64.0, (double)NAN, 1.0, 1.0);
    assert_false(ca_noise_looks_over(&looks));
}

/* A ball; a lamp in it, if any, lights nothing that the camera sees. */
static ca_scene *black_scene(const char *lamp)
{
    char text[2048];
    snprintf(text, sizeof text,
             "<scene version='3.0.0'><sensor type='perspective'><sampler type='independent'/><film type='hdrfilm'>"
             "<integer name='width' value='8'/><integer name='height' value='8'/><rfilter type='box'/></film>"
             "</sensor><shape type='sphere'><point name='center' value='0,0,4'/><bsdf type='diffuse'/></shape>%s"
             "</scene>",
             lamp);
    return scene_from_text(text);
}

/* Ends what would never end. */
static bool stop_after_many(const ca_render_progress *progress, void *user)
{
    (void)user;
    return progress->passes_done < 30000;
}

static void test_a_noise_target_without_light(void **state)
{
    (void)state;
    static const char *const lamp =
        "<shape type='sphere'><point name='center' value='0,0,4'/><float name='radius' value='0.1'/>"
        "<emitter type='area'/></shape>";
    static const struct {
        const char *integrator, *rays, *lamp;
        uint64_t least, most; /* samples of a pixel */
    } cases[] = {
        {"path", NULL, "", 8, 8},
        {"path", NULL, lamp, 4096, 4096},
        {"bdpt", NULL, "", 8, 8},
        {"bdpm:radius=0.1,light_paths=64,camera_paths=3", NULL, lamp, 4096, 3 * 2048},
        {"bdpm:radius=0.1,light_paths=64,camera_paths=3", "auto", "", 2, 4096},
        {"bdpm:radius=0.1,light_paths=64,camera_paths=3", "auto", lamp, 4096, 3 * 8192},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        ca_scene *scene = black_scene(cases[i].lamp);
        ca_render_settings settings = settings_with(0);
        settings.noise_percent = 1.0;
        settings.progress = stop_after_many;
        settings.integrator = cases[i].integrator;
        settings.rays = cases[i].rays;
        ca_image_layers *image = NULL;
        ca_render_statistics statistics = {.size = sizeof statistics};
        ca_error error;
        if (ca_render(scene, &settings, &image, &statistics, &error) != CA_OK) fail_msg("%s", error.message);
        assert_true(statistics.noise_percent < 0.0 && !statistics.interrupted && statistics.mean_luminance == 0.0);
        const double samples = statistics.samples_per_pixel;
        if (samples < (double)cases[i].least || samples > (double)cases[i].most)
            fail_msg("case %zu: %g samples", i, samples);
        ca_image_release(image);
        ca_scene_release(scene);
    }
}

static void test_time_and_noise_stop_the_render(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(scene_text);
    ca_render_settings settings = settings_with(0);
    settings.seconds = 0.2;
    ca_image_layers *image = NULL;
    ca_render_statistics statistics = {.size = sizeof statistics};
    assert_int_equal(ca_render(scene, &settings, &image, &statistics, NULL), CA_OK);
    assert_true(statistics.seconds >= 0.2 && statistics.seconds < 5.0);
    assert_int_equal(statistics.camera_paths, statistics.iterations * 67 * 45);
    ca_image_release(image);
    settings = settings_with(0);
    settings.noise_percent = 20.0;
    assert_int_equal(ca_render(scene, &settings, &image, &statistics, NULL), CA_OK);
    assert_true(statistics.noise_percent < 20.0);
    /* not much further than needed: a pass in 32 */
    const double ratio = statistics.noise_percent / 20.0, needed = (double)statistics.iterations * ratio * ratio;
    print_message("    noise %.3f %% after %u passes, %.1f were needed; %.3g s, of which %.3g s were predicted\n",
                  statistics.noise_percent, (unsigned)statistics.iterations, needed, statistics.seconds,
                  statistics.first_predicted_seconds);
    assert_true(statistics.iterations >= 8 && (double)statistics.iterations <= needed * 1.1 + 2.0);
    assert_true(statistics.first_predicted_seconds >= statistics.first_predicted_at &&
                statistics.first_predicted_at > 0.0);
    /* the same figure, from the layers */
    double mean = 0.0;
    const float *samples = ca_image_channel(image, "Samples.Y");
    for (size_t i = 0; i < 67 * 45; i++) {
        assert_true((uint64_t)samples[i] == statistics.iterations);
        mean += 0.2126 * (double)ca_image_channel(image, "R")[i] + 0.7152 * (double)ca_image_channel(image, "G")[i] +
                0.0722 * (double)ca_image_channel(image, "B")[i];
    }
    assert_true(fabs(mean / (67 * 45) - statistics.mean_luminance) < 1e-5);
    ca_image_release(image);
    ca_scene_release(scene);
}

/* The noise promised is the noise there is: many renders, each with its own seed, scatter by what they say. */
static void test_noise_is_what_it_says(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(scene_text);
    enum { RENDERS = 60, PIXELS = 67 * 45 };
    static double sum[PIXELS], squares[PIXELS];
    memset(sum, 0, sizeof sum);
    memset(squares, 0, sizeof squares);
    double promised = 0.0, total = 0.0;
    for (uint32_t k = 0; k < RENDERS; k++) {
        ca_render_settings settings = settings_with(16);
        settings.has_seed = true;
        settings.seed = 1000 + k;
        ca_image_layers *image = NULL;
        ca_render_statistics statistics = {.size = sizeof statistics};
        assert_int_equal(ca_render(scene, &settings, &image, &statistics, NULL), CA_OK);
        promised += statistics.noise_percent * statistics.noise_percent / RENDERS;
        total += statistics.mean_luminance / RENDERS;
        for (size_t i = 0; i < PIXELS; i++) {
            const double y = 0.2126 * (double)ca_image_channel(image, "R")[i] +
                             0.7152 * (double)ca_image_channel(image, "G")[i] +
                             0.0722 * (double)ca_image_channel(image, "B")[i];
            sum[i] += y;
            squares[i] += y * y;
        }
        ca_image_release(image);
    }
    double variance = 0.0;
    for (size_t i = 0; i < PIXELS; i++)
        variance += (squares[i] - sum[i] * sum[i] / RENDERS) / (RENDERS - 1) / PIXELS;
    const double measured = 100.0 * sqrt(variance) / total;
    print_message("    noise promised %.3f %%, measured over %d renders %.3f %%\n", sqrt(promised), RENDERS,
                  measured);
    assert_true(fabs(measured / sqrt(promised) - 1.0) < 0.05);
    ca_scene_release(scene);
}

static void test_layers_and_attributes(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(scene_text);
    ca_render_settings settings = settings_with(4);
    ca_image_layers *image = render_scene(scene, &settings);
    static const char *const names[] = {"R",
                                        "G",
                                        "B",
                                        "Albedo.R",
                                        "Albedo.G",
                                        "Albedo.B",
                                        "N.X",
                                        "N.Y",
                                        "N.Z",
                                        "P.X",
                                        "P.Y",
                                        "P.Z",
                                        "Variance.R",
                                        "Variance.G",
                                        "Variance.B",
                                        "RelativeVariance.R",
                                        "RelativeVariance.G",
                                        "RelativeVariance.B",
                                        "Samples.Y"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) assert_non_null(ca_image_channel(image, names[i]));
    /* the lowest row looks at the floor: y = 0, normal up, checkerboard albedo */
    const size_t floor_pixel = (size_t)44 * 67 + 33;
    assert_true(fabsf(ca_image_channel(image, "P.Y")[floor_pixel]) < 1e-4f);
    assert_true(fabsf(ca_image_channel(image, "N.Y")[floor_pixel] - 1.0f) < 1e-5f);
    const float albedo = ca_image_channel(image, "Albedo.G")[floor_pixel];
    assert_true(albedo > 0.1f && albedo < 0.5f);
    assert_string_equal(attribute_text(image, "caustica.version"), ca_version());
    assert_non_null(strstr(attribute_text(image, "caustica.integrator"), "max_depth=6"));
    ca_image_release(image);
    ca_scene_release(scene);
}

/* Hits alone find the same light, with more noise. */
static void test_path_without_next_event(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(scene_text);
    ca_render_settings settings = settings_with(64);
    double mean[2], error[2];
    static const char *const integrators[] = {"path", "path:next_event=false"};
    for (int i = 0; i < 2; i++) {
        settings.integrator = integrators[i];
        ca_image_layers *image = NULL;
        ca_render_statistics statistics = {.size = sizeof statistics};
        assert_int_equal(ca_render(scene, &settings, &image, &statistics, NULL), CA_OK);
        assert_true((statistics.shadow_rays == 0) == (i == 1));
        channel_mean(image, "G", &mean[i], &error[i]);
        ca_image_release(image);
    }
    print_message("    with next event %.5f +- %.5f, without %.5f +- %.5f\n", mean[0], error[0], mean[1], error[1]);
    assert_true(error[1] < 0.03 * mean[1] && error[0] < error[1]);
    assert_true(fabs(mean[0] - mean[1]) < 4.0 * hypot(error[0], error[1]));
    ca_scene_release(scene);
}

static void test_path_without_next_event_needs_lights_with_extent(void **state)
{
    (void)state;
    static const char *const lights[] = {"<emitter type='point'><rgb name='intensity' value='1'/></emitter>",
                                         "<emitter type='directional'><vector name='direction' value='0,0,1'/><rgb "
                                         "name='irradiance' value='1'/></emitter>"};
    for (int i = 0; i < 2; i++) {
        char text[1024];
        snprintf(text, sizeof text,
                 "<scene version='3.0.0'><sensor type='perspective'/><shape type='sphere'><point name='center' "
                 "value='0,0,5'/></shape>"
                 "<emitter type='constant'/>\n  %s</scene>",
                 lights[i]);
        ca_scene *scene = scene_from_text(text);
        ca_render_settings settings = settings_with(1);
        settings.integrator = "path:next_event=false";
        ca_image_layers *image = NULL;
        ca_error error = {""};
        assert_int_equal(ca_render(scene, &settings, &image, NULL, &error), CA_ERROR_UNSUPPORTED);
        assert_non_null(strstr(error.message, ":2:3: without next_event"));
        ca_scene_release(scene);
    }
}

/* A light so near that next event overflows: dropped there, counted there, and the image stays finite. */
static void test_overflow_is_counted_where_it_happens(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(
        "<scene version='3.0.0'><sensor type='perspective'><film type='hdrfilm'><integer name='width' value='8'/>"
        "<integer name='height' value='8'/><rfilter type='box'/></film></sensor>"
        "<shape type='rectangle'><transform name='to_world'><rotate y='1' angle='180'/><translate "
        "z='2'/></transform></shape>"
        "<emitter type='point'><point name='position' value='0,0,1.98'/><rgb name='intensity' "
        "value='1e37'/></emitter>"
        "</scene>");
    ca_render_settings settings = settings_with(16);
    settings.integrator = "path:max_depth=2";
    ca_image_layers *image = NULL;
    ca_render_statistics statistics = {.size = sizeof statistics};
    assert_int_equal(ca_render(scene, &settings, &image, &statistics, NULL), CA_OK);
    print_message("    %u of next event, %u in all\n", (unsigned)statistics.non_finite_from[CA_TECHNIQUE_NEXT_EVENT],
                  (unsigned)statistics.non_finite);
    assert_true(statistics.non_finite_from[CA_TECHNIQUE_NEXT_EVENT] > 0);
    assert_int_equal(statistics.non_finite, statistics.non_finite_from[CA_TECHNIQUE_NEXT_EVENT]);
    for (size_t i = 0; i < 64; i++) assert_true(isfinite(ca_image_channel(image, "G")[i]));
    ca_image_release(image);
    ca_scene_release(scene);
}

static void test_settings_of_integrators(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(scene_text);
    ca_image_layers *image = NULL;
    ca_error error = {""};
    ca_render_settings settings = settings_with(1);
    settings.radius = 0.1;
    assert_int_equal(ca_render(scene, &settings, &image, NULL, &error), CA_ERROR_ARGUMENT);
    assert_string_equal(error.message, "integrator \"path\" has no merge radius");
    static const double wrong[] = {-1.0, (double)NAN, (double)INFINITY};
    settings.integrator = "vcm";
    for (int i = 0; i < 3; i++) {
        settings.radius = wrong[i];
        assert_int_equal(ca_render(scene, &settings, &image, NULL, &error), CA_ERROR_ARGUMENT);
        assert_string_equal(error.message,
                            "\"radius\" must be a number of at least 0 and at most 1e+15, if not 0 at least 1e-15");
    }
    settings.radius = 0.25;
    settings.integrator = "vcm:radius=0.5";
    assert_int_equal(ca_render(scene, &settings, &image, NULL, &error), CA_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, "0.5 among the integrator's own parameters but 0.25"));
    settings.integrator = "vcm:alpha=0.25";
    settings.light_paths = 200;
    settings.camera_paths = 3;
    settings.has_max_depth = true;
    settings.max_depth = 4;
    ca_render_plan plan;
    assert_int_equal(ca_render_plan_make(&plan, scene, &settings, &error), CA_OK);
    char text[256];
    ca_integrator_describe(plan.type, &plan.input, text, sizeof text);
    assert_non_null(strstr(text, "max_depth=4,"));
    assert_non_null(strstr(text, "light_paths=200,camera_paths=3,radius=0.25,alpha=0.25"));
    ca_scene_release(scene);
}

/* The scene's own words, in the spelling of Mitsuba 0.6 too; with -i they carry over where they fit. */
static void test_integrators_of_the_scene(void **state)
{
    (void)state;
    static const char *const text =
        "<scene version='%s'>\n<integrator type='%s'>%s</integrator><sensor type='perspective'/>"
        "<emitter type='constant'/></scene>";
    static const struct {
        const char *version, *type, *parameters, *chosen, *says; /* says: of the description, or of the error */
    } cases[] = {
        {"3.0.0", "vcm-star", "<float name='radius' value='0.25'/><integer name='camera_paths' value='2'/>", NULL,
         "vcm-star:max_depth=-1,rr_depth=3,hide_emitters=false,heuristic=balance,light_paths=0,camera_paths=2,radius="
         "0.25,"
         "alpha=0.333333333,radius_pixels=0"},
        {"0.6.0", "bdpm",
         "<integer name='maxDepth' value='4'/><integer name='cameraDiffuseDepth' value='3'/><string name='merges' "
         "value='last'/>",
         NULL, "camera_diffuse_depth=3,merges=last"},
        {"3.0.0", "vcm", "<integer name='max_depth' value='4'/><float name='radius' value='1'/>", "path:rr_depth=2",
         "path:max_depth=4,rr_depth=2,"},
        {"3.0.0", "vcm", "<integer name='radius' value='2'/>", "ovcm",
         "radius=2,alpha=0.333333333,radius_pixels=0,epsilon="},
        {"3.0.0", "vcm", "\n<float name='c' value='1'/>", NULL, ":3:1: integrator \"vcm\" has no parameter \"c\""},
        {"3.0.0", "vcm", "\n<float name='alpha' value='2'/>", NULL,
         ":3:1: \"alpha\" must be a number of at least 0 and"},
        {"3.0.0", "vcm", "\n<float name='light_paths' value='2.5'/>", "ovcm",
         ":3:1: \"light_paths\" must be a whole"},
        {"3.0.0", "vcm", "\n<string name='heuristic' value='best'/>", NULL, ":3:1: \"heuristic\" must be one of"},
        {"3.0.0", "vcmm", "", NULL, ":2:1: unknown integrator \"vcmm\"; did you mean \"vcm\"?"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char xml[1024], said[1024];
        snprintf(xml, sizeof xml, text, cases[i].version, cases[i].type, cases[i].parameters);
        ca_scene *scene = scene_from_text(xml);
        ca_render_settings settings = settings_with(1);
        settings.integrator = cases[i].chosen;
        ca_render_plan plan;
        ca_error error = {""};
        const ca_status status = ca_render_plan_make(&plan, scene, &settings, &error);
        if (status == CA_OK) ca_integrator_describe(plan.type, &plan.input, said, sizeof said);
        assert_int_equal(status, cases[i].says[0] == ':' ? CA_ERROR_SCENE : CA_OK);
        if (!strstr(status == CA_OK ? said : error.message, cases[i].says))
            fail_msg("case %zu says: %s", i, status == CA_OK ? said : error.message);
        ca_scene_release(scene);
    }
}

/* How many passes a number of samples takes. */
static void test_samples_to_passes(void **state)
{
    (void)state;
    static const struct {
        const char *integrator;
        uint32_t samples, camera_paths, light_paths, passes;
    } cases[] = {
        {"path", 5, 0, 0, 5},
        {"path", 0, 0, 0, 5}, /* as the scene says */
        {"bdpt", 6, 0, 100, 6},
        {"bdpt", 6, 3, 100, 2},
        {"bdpt", 7, 3, 100, 3},
        {"bdpt", 16777215, 1, 0, 16777215},
        {"bdpt", 16777216, 1, 0, 0}, /* more than the sums hold */
        {"bdpt", 33554430, 2, 0, 16777215},
        {"bdpt", 4294967295u, 4, 0, 0}, /* camera paths would be too many to be numbered */
        {"light", 6, 0, 0, 6},
        {"light", 6, 0, 67 * 45, 6},
        {"light", 6, 2, 67 * 45 * 2, 3},
        {"light", 1, 0, 1000, 4}, /* 3015 pixels */
        {"light", 4294967295u, 0, 1000, 0},
    };
    ca_scene *scene = scene_from_text(scene_text);
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        ca_render_settings settings = settings_with(cases[i].samples);
        settings.integrator = cases[i].integrator;
        settings.camera_paths = cases[i].camera_paths;
        settings.light_paths = cases[i].light_paths;
        settings.has_crop = true; /* which changes nothing */
        settings.crop[2] = 10;
        settings.crop[3] = 10;
        ca_render_plan plan;
        const ca_status status = ca_render_plan_make(&plan, scene, &settings, NULL);
        assert_int_equal(status, cases[i].passes ? CA_OK : CA_ERROR_ARGUMENT);
        if (status == CA_OK && plan.pass_limit != cases[i].passes)
            fail_msg("case %zu: %u passes instead of %u", i, plan.pass_limit, cases[i].passes);
    }
    ca_scene_release(scene);
}

static void test_wrong_settings_are_refused(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(scene_text);
    ca_image_layers *image = NULL;
    ca_error error;
    ca_render_settings settings = settings_with(1);
    settings.sampler = "magic";
    assert_int_equal(ca_render(scene, &settings, &image, NULL, &error), CA_ERROR_ARGUMENT);
    settings = settings_with(1);
    settings.has_crop = true;
    settings.crop[2] = 68;
    settings.crop[3] = 10;
    assert_int_equal(ca_render(scene, &settings, &image, NULL, &error), CA_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, "67 x 45"));
    settings = settings_with(1);
    settings.memory_mib = 0.1;
    assert_int_equal(ca_render(scene, &settings, &image, NULL, &error), CA_ERROR_ARGUMENT);
    settings = settings_with(1);
    settings.strategies_directory = "nowhere";
    settings.has_max_depth = true;
    settings.max_depth = 14;
    assert_int_equal(ca_render(scene, &settings, &image, NULL, &error), CA_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, "max_depth of at most 13"));
    assert_non_null(strstr(error.message, "(it is 14)"));
    assert_null(image);
    ca_scene_release(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_threads_do_not_change_a_bit),
        cmocka_unit_test(test_seed_and_sampler_change_the_image),
        cmocka_unit_test(test_a_crop_is_a_part_of_the_picture),
        cmocka_unit_test(test_films_of_another_size),
        cmocka_unit_test(test_a_stopped_render_is_a_shorter_one),
        cmocka_unit_test(test_noise_looks),
        cmocka_unit_test(test_looks_at_a_black_picture),
        cmocka_unit_test(test_a_noise_target_without_light),
        cmocka_unit_test(test_time_and_noise_stop_the_render),
        cmocka_unit_test(test_noise_is_what_it_says),
        cmocka_unit_test(test_layers_and_attributes),
        cmocka_unit_test(test_path_without_next_event),
        cmocka_unit_test(test_path_without_next_event_needs_lights_with_extent),
        cmocka_unit_test(test_overflow_is_counted_where_it_happens),
        cmocka_unit_test(test_settings_of_integrators),
        cmocka_unit_test(test_integrators_of_the_scene),
        cmocka_unit_test(test_samples_to_passes),
        cmocka_unit_test(test_wrong_settings_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
