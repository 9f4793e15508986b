/* Weights that the engine gives to the same paths, found by different techniques, add up to 1: the densities that a
 * technique says of a path are those with which the others would have made it.
 *
 * A density that one technique gets wrong changes most images by less than comparing them detects. Here each
 * technique's mean weight, the ratio of what it found with and without its weight, is known from few paths, since all
 * paths with so many vertices have nearly the same weights. Inside of a ball, a diffuse surface scatters to all of it
 * evenly: densities per area are one number everywhere, while those of directions and the cosines in them are not.
 * Two tenths of a percent are found there. Between a few small surfaces that stand far apart and askew, the two
 * cosines of a segment differ, too; and where two lights differ in power, so do the chances of asking them. */
#define _DEFAULT_SOURCE
#include "image/layers.h"
#include "support/scene_text.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { LEAST = 3, MOST = 6 }; /* vertices of a path with camera and light */

#define DISK(origin, target, radius, inside)                                                                         \
    "<shape type='disk'><transform name='to_world'><scale value='" radius "'/><lookat origin='" origin               \
    "' target='" target "' up='0.1,1,0.2'/></transform>" inside "</shape>"
#define DIFFUSE "<bsdf type='diffuse'><rgb name='reflectance' value='0.9'/></bsdf>"
#define EMITTER(radiance) "<emitter type='area'><rgb name='radiance' value='" radiance "'/></emitter>"
#define FILM                                                                                                         \
    "<film type='hdrfilm'><integer name='width' value='8'/><integer name='height' value='8'/>"                       \
    "<rfilter type='box'/></film></sensor>"
#define LOOK "<transform name='to_world'><lookat origin='0,0,4' target='0,0,0' up='0,1,0'/></transform>"
#define PINHOLE "<sensor type='perspective'><float name='fov' value='4'/>" LOOK FILM
#define WIDE "<sensor type='perspective'><float name='fov' value='60'/>" LOOK FILM
#define LENS                                                                                                         \
    "<sensor type='thinlens'><float name='fov' value='3'/><float name='aperture_radius' value='0.05'/>"              \
    "<float name='focus_distance' value='4'/>" LOOK FILM
#define PARALLEL                                                                                                     \
    "<sensor type='orthographic'><transform name='to_world'><scale x='0.1' y='0.1'/><lookat origin='0,0,4' "         \
    "target='0,0,0' up='0,1,0'/></transform>" FILM
#define BALL                                                                                                         \
    "<shape type='sphere'><point name='center' x='0' y='1' z='1'/><float name='radius' value='5'/>"                  \
    "<boolean name='flip_normals' value='true'/>" DIFFUSE EMITTER("1") "</shape>"
#define SURFACES                                                                                                     \
    DISK("0,0,0", "2,0,0.9", "0.5", DIFFUSE)                                                                         \
    DISK("1.5,0,1", "0.64,0.36,0.64", "0.5", DIFFUSE) DISK("1,1.5,2", "0.365,0.738,2.127", "0.5", DIFFUSE)
#define LAMP DISK("-0.5,1.5,3", "1,0.9,2", "0.4", EMITTER("10"))
#define POINT                                                                                                        \
    "<emitter type='point'><point name='position' x='-1' y='1' z='2'/><rgb name='intensity' value='1'/></emitter>"
#define LAMP_BALL                                                                                                    \
    "<shape type='sphere'><point name='center' x='-0.5' y='1.5' z='3'/><float name='radius' value='0.4'/>"           \
    EMITTER("10") "</shape>"
#define SCENE(content) "<scene version='3.0.0'>" content "</scene>"

static const struct {
    const char *name, *text;
    uint32_t most, samples; /* vertices; camera paths per pixel */
    double direct, tolerance; /* with three vertices, and with more */
} scenes[] = {
    {"in a ball, pinhole", SCENE(PINHOLE BALL), MOST, 12, 0.002, 0.002},
    {"in a ball, wide", SCENE(WIDE BALL), MOST, 40, 0.01, 0.01}, /* light paths find the film as often */
    {"in a ball, lens", SCENE(LENS BALL), MOST, 12, 0.002, 0.002},
    {"in a ball, parallel", SCENE(PARALLEL BALL), MOST, 12, 0.002, 0.002},
    {"in a ball, small lamp", SCENE(PINHOLE BALL LAMP_BALL), 4, 80, 0.02, 0.02},
    {"disk lamp, pinhole", SCENE(PINHOLE SURFACES LAMP), 4, 80, 0.003, 0.06},
    {"disk and point, lens", SCENE(LENS SURFACES LAMP POINT), 4, 80, 0.003, 0.06},
    {"ball lamp, parallel", SCENE(PARALLEL SURFACES LAMP_BALL), 4, 80, 0.003, 0.06},
};

/* What techniques found of paths with so many vertices. */
typedef struct weight_sums {
    double sum[MOST + 1]; /* of mean weights */
    int techniques[MOST + 1];
} weight_sums;

static double green_sum(const char *folder, const char *technique, uint32_t s, uint32_t t, const char *kind)
{
    char path[512];
    ca_image_layers *image = NULL;
    snprintf(path, sizeof path, "%s/%s_s%u_t%u_%s.exr", folder, technique, s, t, kind);
    if (ca_layers_read(path, &image, NULL) != CA_OK) return 0.0;
    double sum = 0.0;
    for (size_t i = 0; i < (size_t)image->width * image->height; i++) sum += (double)ca_image_channel(image, "G")[i];
    ca_image_release(image);
    return sum;
}

static void add_technique(const char *folder, const char *technique, uint32_t s, uint32_t t, weight_sums *sums)
{
    const uint32_t n = strcmp(technique, "merge") == 0 ? s + t - 1 : s + t;
    if (n < LEAST || n > MOST) return;
    const double unweighted = green_sum(folder, technique, s, t, "unweighted");
    if (!(unweighted > 0.0)) return;
    sums->sum[n] += green_sum(folder, technique, s, t, "weighted") / unweighted;
    sums->techniques[n]++;
}

static weight_sums render_weights(size_t k, const ca_scene *scene, const char *integrator)
{
    static const char *const techniques[] = {"hit", "next_event", "connect", "splat", "merge"};
    char folder[] = "/tmp/caustica-weights-XXXXXX", command[64];
    weight_sums sums = {{0.0}, {0}};
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    assert_non_null(mkdtemp(folder));
    settings.integrator = integrator;
    settings.samples_per_pixel = scenes[k].samples;
    settings.has_max_depth = true;
    settings.max_depth = (int)(scenes[k].most - 1);
    settings.strategies_directory = folder;
    ca_image_release(render_scene(scene, &settings));
    for (int i = 0; i < 5; i++)
        for (uint32_t s = 1; s <= scenes[k].most; s++)
            for (uint32_t t = 0; t <= scenes[k].most; t++) add_technique(folder, techniques[i], s, t, &sums);
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    assert_int_equal(system(command), 0);
    return sums;
}

static void test_weights_add_up_to_one(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        bool everywhere; /* else in the ball only, where little time is enough */
    } integrators[] = {
        {"path", true},
        {"path:heuristic=balance", false},
        {"bdpt:light_paths=500", true},
        {"bdpt:light_paths=200,camera_paths=2,heuristic=power", false},
        {"vcm:light_paths=500,radius=0.05,alpha=0", false},
        {"vcm-star:radius=0.05,alpha=0", false},
        {"ovcm:light_paths=500,radius=0.05,alpha=0", true},
        {"vavcm:light_paths=500,radius=0.05,alpha=0", true},
    };
    int wrong = 0;
    for (size_t k = 0; k < sizeof scenes / sizeof scenes[0]; k++) {
        ca_scene *scene = scene_from_text(scenes[k].text);
        for (size_t i = 0; i < sizeof integrators / sizeof integrators[0]; i++) {
            if (scenes[k].most < MOST && !integrators[i].everywhere) continue;
            const weight_sums sums = render_weights(k, scene, integrators[i].text);
            print_message("    %-20s %-48s", scenes[k].name, integrators[i].text);
            for (uint32_t n = LEAST; n <= scenes[k].most; n++) {
                print_message(" %u: %.4f of %d", n, sums.sum[n], sums.techniques[n]);
                wrong += !(fabs(sums.sum[n] - 1.0) < (n == LEAST ? scenes[k].direct : scenes[k].tolerance));
            }
            print_message("\n");
        }
        ca_scene_release(scene);
    }
    assert_int_equal(wrong, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_weights_add_up_to_one)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
