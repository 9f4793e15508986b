/* Error bars of renders by blocks of random pairs: they change nothing of the image, come out the same to the bit
 * from any threads and parts, are refused or marked where they cannot be told; over many small renders the variance
 * is that of the renders, and 95 % intervals hold the mean. */
#define _POSIX_C_SOURCE 200809L
#include "base/memory.h"
#include "image/layers.h"
#include "integrator/qmcppm.h"
#include "render/render.h"
#include "support/named_layer.h"
#include "support/scene_text.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

enum { WIDTH = 8, HEIGHT = 6, PIXELS = WIDTH * HEIGHT };

/* Diffuse walls and balls, a point light, and an area light above the picture: nothing that few paths bring. */
static const char *const room_text =
    "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' value='5'/></integrator>"
    "<sensor type='perspective'><float name='fov' value='60'/>"
    "<transform name='to_world'><lookat origin='0,1.2,-2.5' target='0,0.9,0' up='0,1,0'/></transform>"
    "<film type='hdrfilm'><integer name='width' value='8'/><integer name='height' value='6'/><rfilter "
    "type='tent'/></film></sensor>"
    "<shape type='rectangle'><transform name='to_world'><rotate x='1' angle='-90'/><scale value='3'/></transform>"
    "<bsdf type='diffuse'><rgb name='reflectance' value='0.6'/></bsdf></shape>"
    "<shape type='rectangle'><transform name='to_world'><rotate x='1' angle='180'/><scale value='3'/><translate "
    "z='1.5'/></transform>"
    "<bsdf type='twosided'><bsdf type='diffuse'><rgb name='reflectance' value='0.7,0.5,0.3'/></bsdf></bsdf></shape>"
    "<shape type='sphere'><point name='center' value='-0.6,0.5,0'/><float name='radius' value='0.5'/><bsdf "
    "type='diffuse'/></shape>"
    "<shape type='sphere'><point name='center' value='0.7,0.4,0.2'/><float name='radius' value='0.4'/>"
    "<bsdf type='diffuse'><rgb name='reflectance' value='0.4'/></bsdf></shape>"
    "<emitter type='point'><point name='position' value='0.5,2.5,-0.5'/><rgb name='intensity' value='4'/></emitter>"
    "<shape type='disk'><transform name='to_world'><scale value='0.4'/><rotate x='1' angle='90'/><translate x='-0.8' "
    "y='2.6'/>"
    "</transform><bsdf type='diffuse'/>"
    "<emitter type='area'><rgb name='radiance' value='8'/></emitter></shape></scene>";

typedef struct bar_job {
    const char *integrator, *sampler, *part;
    uint64_t blocks[2], seed;
    uint32_t threads;
} bar_job;

static ca_status run(const ca_scene *scene, const bar_job *job, ca_image_layers **image, ca_error *error)
{
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.integrator = job->integrator;
    settings.sampler = job->sampler ? job->sampler : "independent";
    settings.threads = job->threads ? job->threads : 1;
    settings.has_blocks = true;
    memcpy(settings.blocks, job->blocks, sizeof settings.blocks);
    settings.has_seed = true;
    settings.seed = job->seed;
    settings.part_path = job->part;
    return ca_render(scene, &settings, image, NULL, error);
}

static ca_image_layers *rendered(const ca_scene *scene, const bar_job *job)
{
    ca_image_layers *image;
    ca_error error = {""};
    if (run(scene, job, &image, &error) != CA_OK) fail_msg("%s: %s", job->integrator, error.message);
    return image;
}

/* ---- The order of blocks --------------------------------------------------------------------------------------- */

static void test_visits(void **state)
{
    (void)state;
    static const uint64_t limits[][2] = {{UINT64_MAX, UINT64_MAX}, {3, UINT64_MAX}, {4, UINT64_MAX}, {UINT64_MAX, 3},
                                         {UINT64_MAX, 4}, {1, UINT64_MAX}, {5, 7}, {7, 5}, {6, 6}};
    for (size_t l = 0; l < sizeof limits / sizeof limits[0]; l++)
        for (int diagonal = 0; diagonal < 2; diagonal++) {
            const ca_block_order order = {
                .diagonal = diagonal, .camera_limit = limits[l][0], .light_limit = limits[l][1]};
            const uint64_t all = ca_block_count(&order), blocks = all < 200 ? all : 200;
            uint64_t rows[200] = {0}, columns[200] = {0};
            for (uint64_t b = 0; b < blocks; b++) {
                const ca_block_pair pair = ca_block_pair_at(&order, b), visits = ca_block_visits(&order, b);
                assert_int_equal(visits.camera, rows[pair.camera]++);
                assert_int_equal(visits.light, columns[pair.light]++);
            }
        }
}

/* ---- The same bits --------------------------------------------------------------------------------------------- */

static const char *const with_bars =
    "qmcppm:error_bars=true,radius=0.3,light_paths=400,camera_paths=3,camera_diffuse_depth=1";

static void test_the_image_stays(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(room_text);
    ca_image_layers *with = rendered(scene, &(bar_job){.integrator = with_bars, .blocks = {0, 7}});
    ca_image_layers *without = rendered(
        scene, &(bar_job){.integrator = "qmcppm:radius=0.3,light_paths=400,camera_paths=3,camera_diffuse_depth=1",
                          .blocks = {0, 7}});
    assert_int_equal(with->channel_count, without->channel_count + 4);
    assert_null(ca_layers_find(without, "ConfidenceLow.Y"));
    for (size_t c = 0; c < without->channel_count; c++)
        assert_memory_equal(named_layer(with, without->channels[c].name), without->channels[c].data,
                            PIXELS * sizeof(float));
    ca_image_release(with);
    ca_image_release(without);
    ca_scene_release(scene);
}

static void expect_same(const ca_image_layers *a, const ca_image_layers *b)
{
    assert_int_equal(a->channel_count, b->channel_count);
    for (size_t c = 0; c < a->channel_count; c++)
        assert_memory_equal(a->channels[c].data, named_layer(b, a->channels[c].name), PIXELS * sizeof(float));
}

static void test_threads_and_parts(void **state)
{
    (void)state;
    enum { BLOCKS = 13, PARTS = 5 };
    static const uint64_t cuts[PARTS + 1] = {0, 1, 4, 6, 12, BLOCKS};
    char folder[] = "/tmp/caustica-bars-XXXXXX", paths[PARTS][64];
    ca_scene *scene = scene_from_text(room_text);
    assert_non_null(mkdtemp(folder));
    ca_image_layers *whole = rendered(scene, &(bar_job){.integrator = with_bars, .blocks = {0, BLOCKS}});
    static const uint32_t threads[] = {2, 3, 8};
    for (int t = 0; t < 3; t++) {
        ca_image_layers *other =
            rendered(scene, &(bar_job){.integrator = with_bars, .blocks = {0, BLOCKS}, .threads = threads[t]});
        expect_same(whole, other);
        ca_image_release(other);
    }
    for (int p = 0; p < PARTS; p++) {
        snprintf(paths[p], sizeof paths[p], "%s/%d.part", folder, p);
        ca_image_release(rendered(scene, &(bar_job){.integrator = with_bars,
                                                    .blocks = {cuts[p], cuts[p + 1]},
                                                    .part = paths[p],
                                                    .threads = 1 + (uint32_t)p % 3}));
    }
    static const int orders[][PARTS] = {{0, 1, 2, 3, 4}, {4, 3, 2, 1, 0}, {2, 0, 4, 1, 3}};
    for (int o = 0; o < 3; o++) {
        const char *order[PARTS];
        ca_image_layers *merged;
        for (int p = 0; p < PARTS; p++) order[p] = paths[orders[o][p]];
        assert_int_equal(ca_merge_parts(order, PARTS, NULL, &merged, NULL, NULL), CA_OK);
        expect_same(whole, merged);
        ca_image_release(merged);
    }
    size_t finite = 0; /* that there was something to compare */
    for (int i = 0; i < PIXELS; i++) finite += isfinite(named_layer(whole, "ConfidenceLow.Y")[i]) != 0;
    assert_true(finite > PIXELS / 2);
    for (int p = 0; p < PARTS; p++) unlink(paths[p]);
    assert_int_equal(rmdir(folder), 0);
    ca_image_release(whole);
    ca_scene_release(scene);
}

/* Without the first blocks there is no telling how often paths have met: every pixel is marked. */
static void test_a_range_from_the_middle_is_marked(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(room_text);
    ca_image_layers *image = rendered(scene, &(bar_job){.integrator = with_bars, .blocks = {1, 9}});
    for (int i = 0; i < PIXELS; i++) {
        assert_true(named_layer(image, "ConfidenceLow.Y")[i] == -INFINITY &&
                    named_layer(image, "ConfidenceHigh.Y")[i] == INFINITY);
        assert_true(isnan(named_layer(image, "ValueVariance.Y")[i]));
    }
    ca_image_release(image);
    ca_scene_release(scene);
}

/* ---- What is refused ------------------------------------------------------------------------------------------- */

static void test_refusals(void **state)
{
    (void)state;
    static const struct {
        const char *integrator, *sampler, *reason;
    } cases[] = {
        {"qmcppm:error_bars=true,camera_paths=2", "halton", "independent"},
        {"qmcppm:error_bars=true,camera_paths=2", "sobol", "independent"},
        {"qmcppm:error_bars=true", "independent", "camera_paths of 2"},
        {"qmcppm:error_bars=true,camera_paths=2,light_paths=1", "independent", "light_paths from 2"},
        {"qmcppm:error_bars=true,camera_paths=2,join=connect", "independent", "join=merge"},
        {"qmcppm:error_bars=true,camera_paths=2,light_paths=100,total_light_paths=250", "independent",
         "whole blocks"},
        {"ppm:error_bars=true", "independent", "error_bars"},
    };
    ca_scene *scene = scene_from_text(room_text);
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        ca_render_settings settings;
        ca_image_layers *image;
        ca_error error = {""};
        ca_render_settings_init(&settings);
        settings.integrator = cases[i].integrator;
        settings.sampler = cases[i].sampler;
        assert_int_not_equal(ca_render(scene, &settings, &image, NULL, &error), CA_OK);
        if (!strstr(error.message, cases[i].reason)) fail_msg("%s: %s", cases[i].integrator, error.message);
    }
    ca_scene_release(scene);
}

/* Wherever memory ends, the render ends with that error; the image is that of the blocks before, if there are any. */
static void test_memory_failures(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(room_text);
    ca_status status = CA_ERROR_MEMORY;
    for (long n = 0; status == CA_ERROR_MEMORY && n < 2000; n++) {
        ca_image_layers *image;
        ca_memory_fail_after(n);
        status = run(scene, &(bar_job){.integrator = with_bars, .blocks = {0, 4}}, &image, NULL);
        ca_memory_fail_after(-1);
        assert_true(status == CA_OK || status == CA_ERROR_MEMORY);
        assert_true(status != CA_OK || image);
        ca_image_release(image);
    }
    assert_int_equal(status, CA_OK);
    ca_scene_release(scene);
}

/* ---- Calibration ----------------------------------------------------------------------------------------------- */

enum { MOST_RENDERS = 300 };

typedef struct replicate {
    double value[PIXELS], variance[PIXELS], low[PIXELS], high[PIXELS];
    bool ordinary[PIXELS];
} replicate;

static void render_replicates(const char *integrator, uint64_t blocks, int count, replicate *replicates)
{
    ca_scene *scene = scene_from_text(room_text);
    for (int r = 0; r < count; r++) {
        ca_image_layers *image =
            rendered(scene, &(bar_job){.integrator = integrator, .blocks = {0, blocks}, .seed = 100 + (uint64_t)r});
        const float *red = named_layer(image, "R"), *green = named_layer(image, "G"), *blue = named_layer(image, "B");
        for (int i = 0; i < PIXELS; i++) {
            replicates[r].value[i] = 0.2126 * (double)red[i] + 0.7152 * (double)green[i] + 0.0722 * (double)blue[i];
            replicates[r].variance[i] = (double)named_layer(image, "ValueVariance.Y")[i];
            replicates[r].low[i] = (double)named_layer(image, "ConfidenceLow.Y")[i];
            replicates[r].high[i] = (double)named_layer(image, "ConfidenceHigh.Y")[i];
            replicates[r].ordinary[i] =
                isfinite(replicates[r].low[i]) && named_layer(image, "ConfidenceWidened.Y")[i] == 0.0f;
        }
        ca_image_release(image);
    }
    ca_scene_release(scene);
}

/* Of all renders: the pixel's mean and sample variance. */
static void pixel_moments(const replicate *replicates, int count, int pixel, double *mean, double *variance)
{
    *mean = *variance = 0.0;
    for (int r = 0; r < count; r++) *mean += replicates[r].value[pixel] / count;
    for (int r = 0; r < count; r++) *variance += pow(replicates[r].value[pixel] - *mean, 2.0) / (count - 1);
}

typedef struct calibration {
    double ratio, standard_error; /* mean over pixels of estimated over measured variance */
    double held, others;          /* fractions: of ordinary intervals that hold the mean, of pixels without one */
} calibration;

/* Pixels of one render are correlated, renders are not: the error of the ratio is from their scatter. */
static calibration calibrate(const replicate *replicates, int count)
{
    static double excess[MOST_RENDERS]; /* of one render: estimated variance over measured, less what its own
                                           deviation makes of it */
    double intervals = 0.0, held = 0.0, all = 0.0, sum = 0.0, squares = 0.0;
    memset(excess, 0, sizeof excess);
    for (int i = 0; i < PIXELS; i++) {
        double mean, variance;
        pixel_moments(replicates, count, i, &mean, &variance);
        for (int r = 0; r < count; r++) {
            const replicate *x = &replicates[r];
            const double others = (mean * count - x->value[i]) / (count - 1);
            const double square = pow(x->value[i] - mean, 2.0) * count / (count - 1.0);
            excess[r] += (x->variance[i] - square) / (variance * PIXELS);
            all++;
            if (!x->ordinary[i]) continue;
            intervals++;
            held += x->low[i] <= others && others <= x->high[i];
        }
    }
    for (int r = 0; r < count; r++) sum += excess[r];
    for (int r = 0; r < count; r++) squares += pow(excess[r] - sum / count, 2.0) / (count - 1);
    return (calibration){.ratio = 1.0 + sum / count,
                         .standard_error = sqrt(squares / count),
                         .held = held / intervals,
                         .others = 1.0 - intervals / all};
}

static void test_calibration(void **state)
{
    (void)state;
    static const struct {
        const char *integrator;
        uint64_t blocks; /* 16 are 4 x 4; 11 end within a shell */
        int renders;
    } cases[] = {
        {"qmcppm:error_bars=true,alpha=0,radius=0.4,light_paths=1000,camera_paths=4", 16, 300},
        {"qmcppm:error_bars=true,alpha=0,radius=0.4,light_paths=1000,camera_paths=4", 11, 200},
        {"qmcppm:error_bars=true,alpha=0,radius=0.4,light_paths=1000,camera_paths=4,camera_diffuse_depth=1,merges="
         "last",
         16, 300},
        {"qmcppm:error_bars=true,alpha=0,radius=0.4,light_paths=1000,camera_paths=6,kernel=epanechnikov,order="
         "diagonal",
         8, 200},
        {"qmcppm:error_bars=true,alpha=0.5,radius=0.4,light_paths=1000,camera_paths=4", 16, 200},
        {"qmcppm:error_bars=true,alpha=0,radius=0.4,light_paths=1000,camera_paths=16,direct=next-event", 9, 200},
        {"qmcppm:error_bars=true,total_light_paths=3000,total_camera_paths=15,radius=0.4,light_paths=1000,camera_"
         "paths=5",
         9, 200},
    };
    static replicate replicates[MOST_RENDERS];
    for (size_t c = 0; c < sizeof cases / sizeof cases[0]; c++) {
        render_replicates(cases[c].integrator, cases[c].blocks, cases[c].renders, replicates);
        const calibration x = calibrate(replicates, cases[c].renders);
        print_message(
            "    %s, %d blocks: V %.3f +- %.3f of the measured one; %.1f %% hold the mean, %.1f %% are widened\n",
            cases[c].integrator, (int)cases[c].blocks, x.ratio, x.standard_error, 100.0 * x.held, 100.0 * x.others);
        assert_true(x.standard_error < 0.05);
        assert_true(fabs(x.ratio - 1.0) < 4.0 * x.standard_error);
        assert_true(x.held > 0.93 && x.held < 0.97);
        assert_true(x.others < 0.1);
    }
}

/* ---- A rough metal wall and a glass ball ----------------------------------------------------------------------- */

enum { ROUGH_WIDTH = 24, ROUGH_HEIGHT = 18, ROUGH_PIXELS = ROUGH_WIDTH * ROUGH_HEIGHT, ROUGH_RENDERS = 40 };

/* Light paths that end where a camera path would mirror them are rare, and bring much: what most pixels tell of their
 * variance is too little. */
static const char *const rough_text =
    "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' value='5'/></integrator>"
    "<sensor type='perspective'><float name='fov' value='60'/>"
    "<transform name='to_world'><lookat origin='0,1.2,-2.5' target='0,0.9,0' up='0,1,0'/></transform>"
    "<film type='hdrfilm'><integer name='width' value='24'/><integer name='height' value='18'/><rfilter "
    "type='tent'/></film></sensor>"
    "<shape type='rectangle'><transform name='to_world'><rotate x='1' angle='-90'/><scale value='3'/></transform>"
    "<bsdf type='diffuse'><rgb name='reflectance' value='0.6'/></bsdf></shape>"
    "<shape type='rectangle'><transform name='to_world'><rotate x='1' angle='180'/><scale value='3'/><translate "
    "z='1.5'/></transform><bsdf type='roughconductor'><string name='material' value='Al'/>"
    "<float name='alpha' value='0.2'/></bsdf></shape>"
    "<shape type='sphere'><point name='center' value='-0.6,0.5,0'/><float name='radius' value='0.5'/><bsdf "
    "type='diffuse'/></shape>"
    "<shape type='sphere'><point name='center' value='0.7,0.4,0.2'/><float name='radius' value='0.4'/>"
    "<bsdf type='dielectric'/></shape>"
    "<emitter type='point'><point name='position' value='0.5,2.5,-0.5'/><rgb name='intensity' value='4'/></emitter>"
    "<shape type='disk'><transform name='to_world'><scale value='0.4'/><rotate x='1' angle='90'/><translate x='-0.8' "
    "y='2.6'/></transform><bsdf type='diffuse'/>"
    "<emitter type='area'><rgb name='radiance' value='8'/></emitter></shape></scene>";

static double luminance(const ca_image_layers *image, int pixel)
{
    return 0.2126 * (double)named_layer(image, "R")[pixel] + 0.7152 * (double)named_layer(image, "G")[pixel] +
           0.0722 * (double)named_layer(image, "B")[pixel];
}

/* Ordinary intervals [0] and widened ones [1], and how many hold the mean of the other renders. */
typedef struct rough_tally {
    double all[2], held[2], marked;
} rough_tally;

static void judge_rough(rough_tally *tally, const ca_image_layers *image, int pixel, double others)
{
    const double mean = luminance(image, pixel), wider = sqrt(1.0 + 1.0 / (ROUGH_RENDERS - 1.0)),
                 low = (double)named_layer(image, "ConfidenceLow.Y")[pixel],
                 high = (double)named_layer(image, "ConfidenceHigh.Y")[pixel];
    const int kind = named_layer(image, "ConfidenceWidened.Y")[pixel] == 1.0f;
    if (isinf(low)) {
        tally->marked++;
        return;
    }
    tally->all[kind]++;
    tally->held[kind] += others >= mean - wider * (mean - low) && others <= mean + wider * (high - mean);
}

static void test_rough_wall(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(rough_text);
    ca_image_layers *images[ROUGH_RENDERS];
    rough_tally tally = {.marked = 0.0};
    const char *const integrator = "qmcppm:error_bars=true,alpha=0,radius=0.2,light_paths=1000,camera_paths=8";
    for (int r = 0; r < ROUGH_RENDERS; r++)
        images[r] = rendered(
            scene, &(bar_job){.integrator = integrator, .blocks = {0, 16}, .seed = 100 + (uint64_t)r});
    for (int i = 0; i < ROUGH_PIXELS; i++) {
        double sum = 0.0;
        for (int r = 0; r < ROUGH_RENDERS; r++) sum += luminance(images[r], i);
        for (int r = 0; r < ROUGH_RENDERS; r++)
            judge_rough(&tally, images[r], i, (sum - luminance(images[r], i)) / (ROUGH_RENDERS - 1.0));
    }
    const double pixels = (double)ROUGH_PIXELS * ROUGH_RENDERS, ordinary = tally.held[0] / tally.all[0],
                 widened = tally.held[1] / tally.all[1];
    print_message("    rough wall: %.1f %% ordinary, %.2f %% hold the mean; %.1f %% widened, %.2f %% hold it\n",
                  100.0 * tally.all[0] / pixels, 100.0 * ordinary, 100.0 * tally.all[1] / pixels, 100.0 * widened);
    assert_true(ordinary > 0.93 && ordinary < 0.97 && widened > 0.93);
    assert_true(tally.all[0] > 0.1 * pixels && tally.marked < 0.1 * pixels);
    for (int r = 0; r < ROUGH_RENDERS; r++) ca_image_release(images[r]);
    ca_scene_release(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_visits),
        cmocka_unit_test(test_the_image_stays),
        cmocka_unit_test(test_threads_and_parts),
        cmocka_unit_test(test_a_range_from_the_middle_is_marked),
        cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_memory_failures),
        cmocka_unit_test(test_calibration),
        cmocka_unit_test(test_rough_wall),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
