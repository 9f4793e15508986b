/* qmcppm: its image is the mean over all pairs of camera and light paths, however they are cut into blocks; its
 * options do what they say; what it cannot do it refuses. (That it finds the right light is shown by
 * test_closed_forms.c and test_agreement.c, its convergence by test_paper_004.c.) */
#include "base/memory.h"
#include "image/layers.h"
#include "integrator/qmcppm.h"
#include "render/render.h"
#include "support/closed_forms.h"
#include "support/scene_text.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define SENSOR(width, height)                                                                                        \
    "<sensor type='perspective'><float name='fov' value='50'/>"                                                      \
    "<transform name='to_world'><lookat origin='0,1.2,-3.5' target='0,0.6,0' up='0,1,0'/></transform>"               \
    "<film type='hdrfilm'><integer name='width' value='" width "'/><integer name='height' value='" height "'/>"      \
    "<rfilter type='box'/></film></sensor>"

/* Diffuse walls, a glass ball, a rough and a plastic thing, an area light and a point light. */
static const char *const room_text =
    "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' value='6'/></integrator>" SENSOR(
        "24",
        "18") "<shape type='rectangle'><transform name='to_world'><rotate x='1' angle='-90'/><scale "
              "value='3'/></transform>"
              "<bsdf type='plastic'><rgb name='diffuse_reflectance' value='0.6'/></bsdf></shape>"
              "<shape type='rectangle'><transform name='to_world'><rotate x='1' angle='180'/><scale "
              "value='3'/><translate z='2'/></transform>"
              "<bsdf type='twosided'><bsdf type='diffuse'><rgb name='reflectance' "
              "value='0.7,0.5,0.3'/></bsdf></bsdf></shape>"
              "<shape type='sphere'><point name='center' value='-0.6,0.5,0'/><float name='radius' value='0.5'/><bsdf "
              "type='dielectric'/></shape>"
              "<shape type='sphere'><point name='center' value='0.7,0.4,0.2'/><float name='radius' value='0.4'/>"
              "<bsdf type='roughconductor'><float name='alpha' value='0.3'/></bsdf></shape>"
              "<emitter type='point'><point name='position' value='0.5,2.5,-0.5'/><rgb name='intensity' "
              "value='4'/></emitter>"
              "<shape type='disk'><transform name='to_world'><scale value='0.4'/><rotate x='1' "
              "angle='90'/><translate x='-0.8' y='2.6'/>"
              "</transform><bsdf type='diffuse'/>"
              "<emitter type='area'><rgb name='radiance' value='8'/></emitter></shape></scene>";

/* A floor of reflectance one under a point light of intensity pi at height 1. */
static const char *const floor_text =
    "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' value='2'/></integrator>"
    "<sensor type='orthographic'><transform name='to_world'><scale value='0.5'/>"
    "<lookat origin='0.6,0.5,0.4' target='0.6,0,0.4' up='0,0,1'/></transform>"
    "<film type='hdrfilm'><integer name='width' value='16'/><integer name='height' value='16'/>"
    "<rfilter type='box'/></film></sensor>"
    "<shape type='rectangle'><transform name='to_world'><scale value='4'/><rotate x='1' angle='-90'/></transform>"
    "<bsdf type='diffuse'><rgb name='reflectance' value='1'/></bsdf></shape>"
    "<emitter type='point'><point name='position' value='0,1,0'/><rgb name='intensity' "
    "value='3.14159265'/></emitter></scene>";

static ca_image_layers *render_blocks(const ca_scene *scene, const char *integrator, const char *sampler,
                                      uint64_t blocks, uint32_t threads)
{
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.integrator = integrator;
    settings.sampler = sampler;
    settings.threads = threads;
    settings.has_blocks = true;
    settings.blocks[1] = blocks;
    if (strstr(integrator, "blocks=filled")) settings.memory_mib = 3.0;
    return render_scene(scene, &settings);
}

static double mean_of(const ca_image_layers *image, const char *channel)
{
    const float *values = ca_layers_find(image, channel);
    assert_non_null(values);
    double sum = 0.0;
    const size_t count = (size_t)image->width * image->height;
    for (size_t i = 0; i < count; i++) sum += (double)values[i];
    return sum / (double)count;
}

/* Largest difference of two images' radiance, relative to the mean. */
static double largest_difference(const ca_image_layers *a, const ca_image_layers *b)
{
    static const char *const names[] = {"R", "G", "B"};
    double largest = 0.0;
    for (int c = 0; c < 3; c++) {
        const float *x = ca_layers_find(a, names[c]), *y = ca_layers_find(b, names[c]);
        for (size_t i = 0; i < (size_t)a->width * a->height; i++)
            largest = fmax(largest, fabs((double)x[i] - (double)y[i]) / mean_of(b, names[c]));
    }
    return largest;
}

/* ---- Blocks ---------------------------------------------------------------------------------------------------- */

/* With a radius that stays, pairs are all that matters: 6 x 6 blocks of 1 camera path per pixel and 300 light paths
 * are 2 x 3 blocks of 3 and 600, in either order. */
static void test_the_cut_into_blocks_does_not_matter(void **state)
{
    (void)state;
    static const char *const kinds[] = {"camera_diffuse_depth=0", "camera_diffuse_depth=2",
                                        "direct=next-event,kernel=sph", "join=connect"};
    ca_scene *scene = scene_from_text(room_text);
    for (int k = 0; k < 4; k++) {
        const bool connect = k == 3;
        char text[3][256];
        const char *const common = connect ? "" : "alpha=0,radius=0.2,";
        snprintf(text[0], sizeof text[0], "qmcppm:%s%s,light_paths=%d", common, kinds[k], connect ? 2 : 300);
        snprintf(text[1], sizeof text[1],
                 "qmcppm:%s%s,light_paths=%d,camera_paths=3,total_camera_paths=6,total_light_paths=%d", common,
                 kinds[k], connect ? 4 : 600, connect ? 12 : 1800);
        memcpy(text[2], text[1], sizeof text[2]);
        strncat(text[2], ",order=diagonal", sizeof text[2] - strlen(text[2]) - 1);
        ca_image_layers *fine = render_blocks(scene, text[0], "halton", 36, 2);
        for (int i = 1; i < 3; i++) {
            ca_image_layers *coarse = render_blocks(scene, text[i], "halton", 6, 2);
            const double difference = largest_difference(fine, coarse);
            if (!(difference < 1e-4)) fail_msg("%s: differs by %g from the fine blocks", text[i], difference);
            ca_image_release(coarse);
        }
        assert_true(mean_of(fine, "G") > 0.05);
        ca_image_release(fine);
    }
    ca_scene_release(scene);
}

/* A block of 300 light paths and one of 200 are one of 500; what camera paths find alone, once for each of them. */
static void test_a_smaller_last_block(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(room_text);
    const char *const cut = "qmcppm:alpha=0,radius=0.2,direct=next-event,light_paths=300,total_light_paths=500,"
                            "total_camera_paths=1";
    const char *const whole = "qmcppm:alpha=0,radius=0.2,direct=next-event,light_paths=500,total_camera_paths=1";
    ca_image_layers *two = render_blocks(scene, cut, "halton", 2, 2);
    ca_image_layers *one = render_blocks(scene, whole, "halton", 1, 2);
    const double difference = largest_difference(one, two);
    if (!(difference < 1e-4)) fail_msg("differs by %g", difference);
    ca_image_release(one);
    ca_image_release(two);
    ca_scene_release(scene);
}

/* A first block has the first radius; where four times as many light paths are fixed, with alpha 1, half of it. */
static void test_the_radius_follows_the_light_paths(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(room_text);
    ca_image_layers *first = render_blocks(scene, "qmcppm:alpha=1,radius=0.2,light_paths=500", "halton", 1, 2);
    ca_image_layers *fixed = render_blocks(scene, "qmcppm:alpha=0,radius=0.2,light_paths=500", "halton", 1, 2);
    assert_true(largest_difference(first, fixed) < 1e-6);
    ca_image_release(first);
    ca_image_release(fixed);
    first = render_blocks(scene, "qmcppm:alpha=1,radius=0.2,light_paths=500,total_light_paths=2000", "halton", 1, 2);
    fixed = render_blocks(scene, "qmcppm:alpha=0,radius=0.1,light_paths=500", "halton", 1, 2);
    assert_true(largest_difference(first, fixed) < 1e-6);
    ca_image_release(first);
    ca_image_release(fixed);
    ca_scene_release(scene);
}

static void test_threads_do_not_change_a_bit(void **state)
{
    (void)state;
    static const char *const kinds[] = {"qmcppm", "qmcppm:camera_diffuse_depth=1,kernel=epanechnikov,gradients=true",
                                        "qmcppm:join=connect", "qmcppm:radius_photons=8,direct=next-event",
                                        "qmcppm:blocks=filled"};
    static const char *const samplers[] = {"halton", "sobol-image", "lattice-tiles", "independent", "sobol-plain"};
    ca_scene *scene = scene_from_text(room_text);
    for (int k = 0; k < 5; k++) {
        ca_image_layers *one = render_blocks(scene, kinds[k], samplers[k], 9, 1);
        static const uint32_t threads[] = {2, 3, 8};
        for (int t = 0; t < 3; t++) {
            ca_image_layers *several = render_blocks(scene, kinds[k], samplers[k], 9, threads[t]);
            assert_true(image_hash(one) == image_hash(several));
            ca_image_release(several);
        }
        ca_image_release(one);
    }
    ca_scene_release(scene);
}

/* Filled blocks have light paths and camera paths without gaps: with a fixed radius they make the same estimate. */
static void test_filled_blocks_estimate_the_same(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(room_text);
    ca_image_layers *equal =
        render_blocks(scene, "qmcppm:alpha=0,radius=0.2,light_paths=8000,camera_paths=20", "halton", 16, 2);
    ca_image_layers *filled = render_blocks(scene, "qmcppm:alpha=0,radius=0.2,blocks=filled", "halton", 16, 2);
    print_message("    mean %.5f in equal blocks, %.5f in filled ones of %.0f pairs a pixel\n", mean_of(equal, "G"),
                  mean_of(filled, "G"), mean_of(filled, "Pairs.Y") / 16.0);
    assert_true(fabs(mean_of(equal, "G") / mean_of(filled, "G") - 1.0) < 0.01);
    /* 3 MiB hold some thousand paths of each sort. */
    const double pairs = mean_of(filled, "Pairs.Y") / 16.0;
    assert_true(pairs > 1e4 && pairs < 1e7);
    /* Blocks begin anywhere among the pixels: each pixel has got its own camera paths. */
    const float *a = ca_layers_find(equal, "G"), *b = ca_layers_find(filled, "G");
    double squares = 0.0;
    for (size_t i = 0; i < 24 * 18; i++) squares += pow((double)a[i] - (double)b[i], 2.0) / (24 * 18);
    print_message("    r.m.s. difference of pixels %.4f\n", sqrt(squares));
    assert_true(sqrt(squares) < 0.1 * mean_of(equal, "G"));
    ca_image_release(equal);
    ca_image_release(filled);
    ca_scene_release(scene);
}

/* Blocks follow each other without gaps, and a block is the same whether those before it were rendered or not. */
static void test_filled_blocks_follow_each_other(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(room_text);
    ca_render_settings settings;
    ca_render_plan plan;
    ca_worker *worker = aligned_alloc(128, sizeof *worker);
    void *one_by_one, *jump;
    const ca_parallel parallel = {.workers = 1};
    ca_render_settings_init(&settings);
    settings.integrator = "qmcppm:blocks=filled";
    settings.memory_mib = 3.0;
    settings.threads = 1;
    assert_non_null(worker);
    memset(worker, 0, sizeof *worker);
    assert_int_equal(ca_render_plan_make(&plan, scene, &settings, NULL), CA_OK);
    assert_int_equal(plan.type->create(&plan.input, &one_by_one, NULL), CA_OK);
    assert_int_equal(plan.type->create(&plan.input, &jump, NULL), CA_OK);
    const ca_qmcppm *q = one_by_one, *other = jump;
    for (uint64_t block = 0; block < 9; block++) {
        assert_int_equal(plan.type->begin_block(one_by_one, block, &parallel, worker, NULL), CA_OK);
        assert_true(q->light_starts.starts[q->now.light + 1] - q->light_starts.starts[q->now.light] ==
                    q->light_count);
        assert_true(q->camera_starts.starts[q->now.camera] == q->camera.first);
        assert_true(q->camera_starts.starts[q->now.camera + 1] == q->camera.first + q->camera.count);
        assert_true(q->light_count % CA_BLOCK_PATHS == 0 && q->light_count > 0 && q->camera.count > 0);
    }
    assert_int_equal(plan.type->begin_block(jump, 8, &parallel, worker, NULL), CA_OK);
    assert_true(other->light_count == q->light_count && other->camera.first == q->camera.first);
    assert_true(other->shrink == q->shrink && other->now.light == q->now.light);
    plan.type->destroy(one_by_one);
    plan.type->destroy(jump);
    free(worker);
    ca_scene_release(scene);
}

/* ---- Parts of the light ---------------------------------------------------------------------------------------- */

static void test_smooth_and_dirac_transport_add_up(void **state)
{
    (void)state;
    static const char *const kinds[] = {
        "qmcppm:transport=", "qmcppm:camera_diffuse_depth=1,transport=", "qmcppm:direct=next-event,transport="};
    ca_scene *scene = scene_from_text(room_text);
    for (int k = 0; k < 3; k++) {
        static const char *const parts[] = {"all", "smooth", "dirac"};
        ca_image_layers *images[3];
        for (int p = 0; p < 3; p++) {
            char text[128];
            snprintf(text, sizeof text, "%s%s", kinds[k], parts[p]);
            images[p] = render_blocks(scene, text, "halton", 9, 2);
        }
        const float *all = ca_layers_find(images[0], "G"), *smooth = ca_layers_find(images[1], "G"),
                    *dirac = ca_layers_find(images[2], "G");
        for (size_t i = 0; i < 24 * 18; i++)
            assert_true(fabs((double)all[i] - (double)smooth[i] - (double)dirac[i]) <=
                        2e-5 * ((double)all[i] + 1e-3));
        assert_true(mean_of(images[1], "G") > 0.05 &&
                    mean_of(images[2], "G") > 0.02); /* the ball shows and its caustic */
        for (int p = 0; p < 3; p++) ca_image_release(images[p]);
    }
    ca_scene_release(scene);
}

/* Paths with up to four vertices that look for photons find the light that those with one do. */
static void test_several_merges_share_the_light(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(room_text);
    double means[2];
    for (int k = 0; k < 2; k++) {
        static const char *const kinds[2] = {
            "qmcppm:radius=0.1,alpha=0,light_paths=5000,camera_paths=4,camera_diffuse_depth=0",
            "qmcppm:radius=0.1,alpha=0,light_paths=5000,camera_paths=4,camera_diffuse_depth=3"};
        ca_image_layers *image = render_blocks(scene, kinds[k], "halton", 25, 2);
        means[k] = mean_of(image, "G");
        print_message("    %s: %.5f\n", kinds[k], means[k]);
        ca_image_release(image);
    }
    assert_true(fabs(means[1] / means[0] - 1.0) < 0.01);
    ca_scene_release(scene);
}

/* Direct light by next event, by shadow rays, or from photons is the same light. */
static void test_other_joins_find_the_same_light(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(floor_text);
    const char *const kinds[] = {"qmcppm:radius=0.1,alpha=0,light_paths=40000",
                                 "qmcppm:direct=next-event",
                                 "qmcppm:join=connect",
                                 "qmcppm:radius_photons=20,radius=0.1,light_paths=40000",
                                 "qmcppm:radius=0.1,kernel=epanechnikov,light_paths=40000",
                                 "qmcppm:radius=0.1,kernel=sph,light_paths=40000",
                                 "qmcppm:radius=0.1,camera_diffuse_depth=1,light_paths=40000"};
    /* Mean of 1 / d^3 (E = pi cos / d^2, L = E / pi) over the picture, by the midpoint rule. */
    double expected = 0.0;
    enum { STEPS = 200 };
    for (int i = 0; i < STEPS * STEPS; i++) {
        const double x = 0.1 + (i % STEPS + 0.5) / STEPS, z = -0.1 + (i / STEPS + 0.5) / STEPS;
        expected += pow(1.0 + x * x + z * z, -1.5) / (STEPS * STEPS);
    }
    for (size_t k = 0; k < sizeof kinds / sizeof kinds[0]; k++) {
        ca_image_layers *image = render_blocks(scene, kinds[k], "halton", 4, 2);
        const double mean = mean_of(image, "G");
        print_message("    %s: %.5f, expected %.5f\n", kinds[k], mean, expected);
        assert_true(fabs(mean / expected - 1.0) < 0.01);
        ca_image_release(image);
    }
    ca_scene_release(scene);
}

/* The gradient of E = pi / d^3 is -3 pi (x, z) / d^5. */
static void test_gradients_are_those_of_the_irradiance(void **state)
{
    (void)state;
    static const char *const kinds[] = {
        "qmcppm:radius=0.15,alpha=0,light_paths=100000,kernel=epanechnikov,gradients=true",
        "qmcppm:radius=0.2,alpha=0,light_paths=100000,kernel=sph,gradients=true"};
    ca_scene *scene = scene_from_text(floor_text);
    double expected = 0.0;
    enum { STEPS = 200 };
    for (int i = 0; i < STEPS * STEPS; i++) {
        const double x = 0.1 + (i % STEPS + 0.5) / STEPS, z = -0.1 + (i / STEPS + 0.5) / STEPS;
        expected -= 3.0 * 3.14159265 * x * pow(1.0 + x * x + z * z, -2.5) / (STEPS * STEPS);
    }
    for (int k = 0; k < 2; k++) {
        ca_image_layers *image = render_blocks(scene, kinds[k], "halton", 4, 2);
        const double x = mean_of(image, "IrradianceGradient.X"), y = mean_of(image, "IrradianceGradient.Y");
        print_message("    %.4f, expected %.4f\n", x, expected);
        assert_true(fabs(x / expected - 1.0) < 0.03);
        assert_true(fabs(y) < 1e-3);
        ca_image_release(image);
    }
    ca_scene_release(scene);
}

/* ---- What is counted, what is refused -------------------------------------------------------------------------- */

static ca_render_statistics count(const ca_scene *scene, const char *integrator, uint32_t samples)
{
    ca_render_settings settings;
    ca_render_statistics statistics = {.size = sizeof statistics};
    ca_image_layers *image = NULL;
    ca_error error = {""};
    ca_render_settings_init(&settings);
    settings.integrator = integrator;
    settings.samples_per_pixel = samples;
    if (ca_render(scene, &settings, &image, &statistics, &error) != CA_OK)
        fail_msg("%s: %s", integrator, error.message);
    ca_image_release(image);
    return statistics;
}

/* One side is kept from block to block: K x K blocks take K^2 + 1 sides in rectangular order, nearly twice that in
 * diagonal. */
static void test_one_side_is_kept(void **state)
{
    (void)state;
    enum { K = 6, CAMERA = 24 * 18, LIGHT = 100 };
    ca_scene *scene = scene_from_text(room_text);
    ca_render_statistics s = count(scene, "qmcppm:light_paths=100,keep_blocks=false", K);
    assert_int_equal(s.iterations, K * K);
    assert_int_equal(s.light_paths / LIGHT + s.camera_paths / CAMERA, K * K + 1);
    s = count(scene,
              "qmcppm:light_paths=100,order=diagonal,total_camera_paths=6,total_light_paths=600,keep_blocks=false",
              K);
    assert_int_equal(s.iterations, K * K);
    assert_true(s.light_paths / LIGHT + s.camera_paths / CAMERA > 2 * K * K - 2 * K);
    ca_scene_release(scene);
}

/* Blocks that stay in memory are not traced again: each side once. */
static void test_blocks_stay(void **state)
{
    (void)state;
    enum { K = 6, CAMERA = 24 * 18, LIGHT = 100 };
    static const char *const orders[] = {
        "qmcppm:light_paths=100", "qmcppm:light_paths=100,order=diagonal,total_camera_paths=6,total_light_paths=600"};
    ca_scene *scene = scene_from_text(room_text);
    for (int i = 0; i < 2; i++) {
        const ca_render_statistics s = count(scene, orders[i], K);
        assert_int_equal(s.iterations, K * K);
        assert_int_equal(s.light_paths, K * LIGHT);
        assert_int_equal(s.camera_paths, K * CAMERA);
    }
    ca_scene_release(scene);
}

static ca_image_layers *render_in_memory(const ca_scene *scene, const char *integrator, double mib, uint64_t *traced)
{
    ca_render_settings settings;
    ca_render_statistics statistics;
    ca_image_layers *image;
    ca_error error = {""};
    ca_render_settings_init(&settings);
    settings.integrator = integrator;
    settings.threads = 2;
    settings.memory_mib = mib;
    settings.has_blocks = true;
    settings.blocks[0] = 3; /* a part that begins anywhere */
    settings.blocks[1] = 41;
    if (ca_render(scene, &settings, &image, &statistics, &error) != CA_OK) fail_msg("%s", error.message);
    *traced = statistics.light_paths;
    return image;
}

/* Whatever stays, all of it, some or nothing, the image is the same to the bit: columns have radii of their own, and
 * rows their vertices. */
static void test_kept_blocks_do_not_change_a_bit(void **state)
{
    (void)state;
    static const char *const kinds[] = {"radius_pixels=2", "camera_diffuse_depth=1,alpha=1,order=diagonal",
                                        "join=connect", "radius_photons=8,direct=next-event,camera_paths=2"};
    ca_scene *scene = scene_from_text(room_text);
    for (int k = 0; k < 4; k++) {
        char kept[128], anew[160];
        uint64_t none, some, all;
        snprintf(kept, sizeof kept, "qmcppm:light_paths=400,%s", kinds[k]);
        snprintf(anew, sizeof anew, "%s,keep_blocks=false", kept);
        ca_image_layers *images[3] = {render_in_memory(scene, anew, 0.0, &none),
                                      render_in_memory(scene, kept, 8.0, &some),
                                      render_in_memory(scene, kept, 0.0, &all)};
        print_message("    %s: %llu light paths traced, %llu in 8 MiB, %llu in much\n", kinds[k],
                      (unsigned long long)none, (unsigned long long)some, (unsigned long long)all);
        assert_true(all < some && some < none);
        for (int i = 1; i < 3; i++) assert_true(image_hash(images[0]) == image_hash(images[i]));
        for (int i = 0; i < 3; i++) ca_image_release(images[i]);
    }
    ca_scene_release(scene);
}

/* Local radii are such that about k photons are found, in maps smaller and larger than the pilot. */
static void test_local_radii_find_so_many_photons(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(floor_text);
    static const char *const maps[] = {"qmcppm:radius=0.08,radius_photons=20,light_paths=20000,alpha=0,max_depth=2",
                                       "qmcppm:radius=0.02,radius_photons=20,light_paths=600000,alpha=0,max_depth=2"};
    for (int i = 0; i < 2; i++) {
        const ca_render_statistics s = count(scene, maps[i], 1);
        const double found = (double)s.merges / (double)s.camera_paths;
        print_message("    %.2f photons a query\n", found);
        assert_true(found > 17.0 && found < 22.0);
    }
    ca_scene_release(scene);
}

/* The sampler is halton, unless somebody chose another for it. */
static void test_the_sampler_is_halton(void **state)
{
    (void)state;
    static const struct {
        const char *sampler_of_scene, *integrator, *sampler, *expected;
    } cases[] = {
        {"", "qmcppm", NULL, "halton"},
        {"<sampler type='sobol'/>", "qmcppm", NULL, "halton"},
        {"<sampler type='sobol'/>", NULL, NULL, "sobol"},
        {"", NULL, NULL, "halton"},
        {"", "qmcppm", "lattice", "lattice"},
        {"", "path", NULL, "independent"},
        {"<sampler type='sobol'/>", "path", NULL, "sobol"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char text[512];
        snprintf(
            text, sizeof text,
            "<scene version='3.0.0'><integrator type='qmcppm'/><sensor type='perspective'>%s"
            "<film type='hdrfilm'><integer name='width' value='2'/><integer name='height' value='2'/></film></sensor>"
            "<shape type='sphere'><bsdf type='diffuse'/><emitter type='area'/></shape></scene>",
            cases[i].sampler_of_scene);
        ca_scene *scene = scene_from_text(text);
        ca_render_settings settings;
        ca_render_plan plan;
        ca_render_settings_init(&settings);
        settings.integrator = cases[i].integrator;
        settings.sampler = cases[i].sampler;
        assert_int_equal(ca_render_plan_make(&plan, scene, &settings, NULL), CA_OK);
        assert_string_equal(ca_sampler_name(plan.sampler.kind), cases[i].expected);
        ca_scene_release(scene);
    }
}

static void test_refusals(void **state)
{
    (void)state;
    static const struct {
        const char *integrator, *reason;
    } cases[] = {
        {"qmcppm:gradients=true", "smooth kernel"},
        {"qmcppm:radius_photons=5,camera_diffuse_depth=1", "one radius"},
        {"qmcppm:radius_photons=65", "64"},
        {"qmcppm:direct=next-event,camera_diffuse_depth=1", "camera_diffuse_depth=0"},
        {"qmcppm:join=connect,kernel=sph", "no meaning"},
        {"qmcppm:join=connect,transport=dirac", "join=merge"},
        {"qmcppm:blocks=filled", "--memory"},
        {"qmcppm:kernel=gauss", "disk|epanechnikov|sph"},
        {"qmcppm:direct=next-event", "the normals of a curved surface"},
    };
    ca_scene *const scene = closed_form_scene(closed_form_named("collimated ball in a sphere, all bounces"), 0);
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        ca_render_settings settings;
        ca_image_layers *image = NULL;
        ca_error error = {""};
        ca_render_settings_init(&settings);
        settings.integrator = cases[i].integrator;
        assert_int_not_equal(ca_render(scene, &settings, &image, NULL, &error), CA_OK);
        assert_null(image);
        if (!strstr(error.message, cases[i].reason)) fail_msg("%s: %s", cases[i].integrator, error.message);
    }
    ca_scene_release(scene);
}

/* Every allocation may fail. */
static void test_memory_failures(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(floor_text);
    bool failed = true;
    for (long n = 0; failed && n < 2000; n++) {
        ca_render_settings settings;
        ca_image_layers *image = NULL;
        ca_error error = {""};
        ca_render_settings_init(&settings);
        settings.integrator = "qmcppm:radius=0.2,radius_photons=4,kernel=sph,gradients=true,light_paths=500";
        settings.samples_per_pixel = 2;
        settings.threads = 1;
        ca_memory_fail_after(n);
        const ca_status status = ca_render(scene, &settings, &image, NULL, &error);
        ca_memory_fail_after(-1);
        failed = status == CA_ERROR_MEMORY;
        if (!failed) assert_int_equal(status, CA_OK);
        ca_image_release(image);
    }
    assert_false(failed);
    ca_scene_release(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_the_cut_into_blocks_does_not_matter),
        cmocka_unit_test(test_a_smaller_last_block),
        cmocka_unit_test(test_the_radius_follows_the_light_paths),
        cmocka_unit_test(test_threads_do_not_change_a_bit),
        cmocka_unit_test(test_filled_blocks_estimate_the_same),
        cmocka_unit_test(test_filled_blocks_follow_each_other),
        cmocka_unit_test(test_smooth_and_dirac_transport_add_up),
        cmocka_unit_test(test_several_merges_share_the_light),
        cmocka_unit_test(test_other_joins_find_the_same_light),
        cmocka_unit_test(test_gradients_are_those_of_the_irradiance),
        cmocka_unit_test(test_one_side_is_kept),
        cmocka_unit_test(test_blocks_stay),
        cmocka_unit_test(test_kept_blocks_do_not_change_a_bit),
        cmocka_unit_test(test_local_radii_find_so_many_photons),
        cmocka_unit_test(test_the_sampler_is_halton),
        cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_memory_failures),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
