/* Light through glass onto a diffuse floor, scenes/glass-slab, against a calculation: the fan of rays that leaves the
 * light, refracted and reflected at both faces of the slab, in double precision. The radiance of each block of pixels
 * is right for every method that finds this light, and 0 for `path`, which cannot. */
#include "metrics/significance.h"
#include "image/layers.h"
#include "support/batches.h"
#include "support/scene_text.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

#define PI 3.14159265358979323846

enum { SIDE = 24, BLOCK = 8, BLOCKS = SIDE / BLOCK, BATCHES = 12, STEPS = 3, ORDERS = 3 };

/* As the scene has it: lengths in its units, angles in radians. */
static const double eta = 1.5, intensity = 18.0;
static const double light_x = -1.2, light_y = 1.5;                     /* z = 0 */
static const double slab_bottom = 1.0, slab_top = 1.2, slab_end_x = 0.0;
static const double floor_x[2] = {0.02, 1.42}, floor_half_z = 1.0;
static const double eye[2] = {1.3, 2.4}, look_at_x = 0.5, fov = 15.5 * PI / 180.0;
static const double spot_target_x = 0.56, spot_beam = 15.0 * PI / 180.0;
static const double reflectances[3] = {0.8, 0.6, 0.4};
static const char *const channels[3] = {"R", "G", "B"};

/* ---- The fan --------------------------------------------------------------------------------------------------- */

/* Horizontal way of a ray that leaves the light at `theta` from straight down and is reflected 2 `order` times inside
 * the slab; its derivative by theta. */
static double distance_of(double theta, int order, double *derivative)
{
    const double inside = asin(sin(theta) / eta), c = cos(theta), c_inside = cos(inside);
    const double air = light_y - (slab_top - slab_bottom), glass = (2 * order + 1) * (slab_top - slab_bottom);
    *derivative = air / (c * c) + glass / (c_inside * c_inside) * c / (eta * c_inside);
    return air * tan(theta) + glass * tan(inside);
}

/* Reflectance of a face for unpolarised light; the same from either side of it. */
static double face_reflectance(double theta)
{
    const double c = cos(theta), c_inside = cos(asin(sin(theta) / eta));
    const double s = (c - eta * c_inside) / (c + eta * c_inside), p = (eta * c - c_inside) / (eta * c + c_inside);
    return 0.5 * (s * s + p * p);
}

static double angle_of(double distance, int order)
{
    double low = 0.0, high = 0.5 * PI - 1e-9, derivative;
    for (int i = 0; i < 70; i++) {
        const double middle = 0.5 * (low + high);
        if (distance_of(middle, order, &derivative) < distance)
            low = middle;
        else
            high = middle;
    }
    return low;
}

/* Irradiance of the floor from one order: the flux I T^2 R^(2 order) 2 pi sin(theta) dtheta of a cone falls on the
 * ring 2 pi d dd. */
static double irradiance_of(double x, double z, int order)
{
    double derivative;
    const double distance = hypot(x - light_x, z), theta = angle_of(distance, order);
    const double reflected = face_reflectance(theta);
    distance_of(theta, order, &derivative);
    /* the ray leaves through the bottom, not beyond the slab's end */
    assert_true(x - slab_bottom * tan(theta) * (x - light_x) / distance < slab_end_x);
    return intensity * (1.0 - reflected) * (1.0 - reflected) * pow(reflected, 2.0 * order) * sin(theta) /
           (distance * derivative);
}

/* Angle from the spot's axis at which the fan's ray to a place of the floor starts. */
static double angle_from_axis(double x, double z, int order)
{
    const double distance = hypot(x - light_x, z), theta = angle_of(distance, order);
    const double axis[2] = {spot_target_x - light_x, -light_y}, length = hypot(axis[0], axis[1]);
    return acos((axis[0] * sin(theta) * (x - light_x) / distance - axis[1] * cos(theta)) / length);
}

/* ---- The camera ------------------------------------------------------------------------------------------------ */

/* Where the floor's plane is seen at (u, v) of the picture, each in [0, 1], v downwards. */
static void look(double u, double v, double *x, double *z)
{
    const double length = hypot(look_at_x - eye[0], eye[1]);
    const double forward[2] = {(look_at_x - eye[0]) / length, -eye[1] / length}; /* x, y; z is across */
    const double up[2] = {forward[1], -forward[0]};                             /* a right angle from it, upwards */
    const double half = tan(0.5 * fov), right = (2.0 * u - 1.0) * half, above = (1.0 - 2.0 * v) * half;
    const double direction[2] = {forward[0] + above * up[0], forward[1] + above * up[1]};
    const double t = direction[1] < 0.0 ? -eye[1] / direction[1] : (double)INFINITY;
    *x = eye[0] + t * direction[0];
    *z = -t * right; /* looking along -x, -z is on the right; the scene is its own mirror image across z = 0 */
}

/* Mean of the floor's irradiance over a block; negative where the block sees more than floor, or more than the spot's
 * beam lights fully. */
static double block_irradiance(int block_x, int block_y)
{
    const double margin = 0.025,
                 beam = spot_beam - 0.012; /* more than a merge's radius, and what that is to the spot */
    double sum = 0.0;
    for (int i = 0; i < BLOCK * STEPS * BLOCK * STEPS; i++) {
        double x, z;
        look((block_x * BLOCK * STEPS + i % (BLOCK * STEPS) + 0.5) / (SIDE * STEPS),
             (block_y * BLOCK * STEPS + i / (BLOCK * STEPS) + 0.5) / (SIDE * STEPS), &x, &z);
        if (!(x > floor_x[0] + margin && x < floor_x[1] - margin && fabs(z) < floor_half_z - margin)) return -1.0;
        for (int order = 0; order < ORDERS; order++) {
            /* of order 2 there is no more than 1e-5, lit or not */
            if (order < 2 && angle_from_axis(x, z, order) > beam) return -1.0;
            sum += irradiance_of(x, z, order);
        }
    }
    return sum / (BLOCK * STEPS * BLOCK * STEPS);
}

/* ---- Renders --------------------------------------------------------------------------------------------------- */

static ca_scene *load(const char *light)
{
    const ca_define define = {.name = "light", .value = light};
    return bundled_scene_with("glass-slab/glass-slab", &define);
}

typedef struct finding {
    int blocks;
    double worst, worst_error; /* relative difference of a block, and relative standard error of one */
    double p_smallest;
    double mean, mean_expected; /* over the blocks, green */
} finding;

/* Known bias, relative: a merge's radius times the curvature of the light on the floor, and rounding. */
static const double allowed_bias = 1e-3;

static void compare_block(const ca_image_layers *image, size_t block, double irradiance, finding *found)
{
    for (int c = 0; c < 3; c++) {
        char name[16];
        snprintf(name, sizeof name, "Variance.%s", channels[c]);
        const double expected = irradiance * reflectances[c] / PI;
        const measured value = {.mean = (double)ca_image_channel(image, channels[c])[block],
                                .error = sqrt((double)ca_image_channel(image, name)[block] / BATCHES),
                                .degrees = BATCHES - 1};
        found->worst = fmax(found->worst, fabs(value.mean / expected - 1.0));
        found->worst_error = fmax(found->worst_error, value.error / expected);
        found->p_smallest = fmin(found->p_smallest, p_value_of(value, expected, allowed_bias * expected));
        if (c == 1) found->mean += value.mean, found->mean_expected += expected;
    }
}

static finding compare(const ca_scene *scene, const char *integrator, uint32_t samples)
{
    const batch_settings settings = {.integrator = integrator,
                                     .samples = samples,
                                     .batches = BATCHES,
                                     .seed = seed_of(integrator),
                                     .block_side = BLOCK,
                                     .width = SIDE,
                                     .height = SIDE};
    ca_image_layers *image = render_batches(scene, &settings);
    finding found = {.p_smallest = 1.0};
    for (int y = 0; y < BLOCKS; y++)
        for (int x = 0; x < BLOCKS; x++) {
            const double irradiance = block_irradiance(x, y);
            if (irradiance < 0.0) continue;
            found.blocks++;
            compare_block(image, (size_t)(y * BLOCKS + x), irradiance, &found);
        }
    ca_image_release(image);
    return found;
}

/* `light` counts light paths per pixel, the others passes. */
typedef struct method {
    const char *integrator;
    uint32_t samples;
} method;

#define LIGHT_PATHS "light_paths=9216" /* 16 for each pixel */
static const method methods[] = {
    {"light:" LIGHT_PATHS, 16 * 32},
    {"ppm:" LIGHT_PATHS ",radius=0.02,alpha=0", 32},
    {"vcm:" LIGHT_PATHS ",radius=0.02,alpha=0", 32},
    {"ovcm:" LIGHT_PATHS ",radius=0.02,alpha=0", 32},
};

static void test_every_block_is_as_calculated(void **state)
{
    (void)state;
    ca_scene *scene = load("spot");
    for (size_t i = 0; i < sizeof methods / sizeof methods[0]; i++) {
        const finding found = compare(scene, methods[i].integrator, methods[i].samples);
        print_message("    %-45s %d blocks: worst %.2f %%, standard error at most %.2f %%, p %.2g; mean %+.2f %%\n",
                      methods[i].integrator, found.blocks, 100.0 * found.worst, 100.0 * found.worst_error,
                      ca_sidak_p(found.p_smallest, 3 * (uint64_t)found.blocks),
                      100.0 * (found.mean / found.mean_expected - 1.0));
        assert_int_equal(found.blocks, BLOCKS * BLOCKS);
        assert_true(found.worst < 0.02);
        assert_true(found.worst_error < 0.008);
        assert_true(ca_sidak_p(found.p_smallest, 3 * (uint64_t)found.blocks) > 1e-3);
    }
    ca_scene_release(scene);
}

/* The point light is the spot without its cone: the same radiance, found by fewer of the light paths. */
static void test_the_point_light_is_the_same_on_the_whole(void **state)
{
    (void)state;
    ca_scene *scene = load("point");
    static const method wide[] = {{"light:" LIGHT_PATHS, 16 * 16}, {"vcm:" LIGHT_PATHS ",radius=0.02,alpha=0", 16}};
    for (size_t i = 0; i < 2; i++) {
        const finding found = compare(scene, wide[i].integrator, wide[i].samples);
        print_message("    %-45s %d blocks: mean %+.2f %%\n", wide[i].integrator, found.blocks,
                      100.0 * (found.mean / found.mean_expected - 1.0));
        assert_true(fabs(found.mean / found.mean_expected - 1.0) < 0.02);
        assert_true(ca_sidak_p(found.p_smallest, 3 * (uint64_t)found.blocks) > 1e-3);
    }
    ca_scene_release(scene);
}

static void test_a_path_tracer_sees_nothing(void **state)
{
    (void)state;
    ca_scene *scene = load("point");
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.integrator = "path";
    settings.samples_per_pixel = 64;
    settings.width = settings.height = SIDE;
    ca_image_layers *image = render_scene(scene, &settings);
    for (int c = 0; c < 3; c++)
        for (size_t i = 0; i < SIDE * SIDE; i++) assert_true(ca_image_channel(image, channels[c])[i] == 0.0f);
    ca_image_release(image);
    ca_scene_release(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_block_is_as_calculated),
        cmocka_unit_test(test_the_point_light_is_the_same_on_the_whole),
        cmocka_unit_test(test_a_path_tracer_sees_nothing),
    };
    return cmocka_run_group_tests_name("glass_slab", tests, NULL, NULL);
}
