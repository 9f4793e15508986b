#include "support/auto_bias.h"

#include "render/auto_rays.h"
#include "support/scene_text.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

enum { PIXELS = AUTO_BIAS_SIDE * AUTO_BIAS_SIDE };

ca_scene *auto_bias_scene(void)
{
    return scene_from_text(
        "<scene version='3.0.0'><integrator type='bdpm'><integer name='max_depth' value='5'/>"
        "<float name='radius' value='0.08'/></integrator><sensor type='perspective'><float name='fov' value='50'/>"
        "<transform name='to_world'><lookat origin='0,2.2,-2.6' target='0,0.2,0' up='0,1,0'/></transform>"
        "<film type='hdrfilm'><integer name='width' value='12'/><integer name='height' value='12'/><rfilter "
        "type='box'/></film>"
        "</sensor><shape type='rectangle'><transform name='to_world'><rotate x='1' angle='-90'/><scale "
        "value='2'/></transform>"
        "<bsdf type='diffuse'/></shape>"
        "<shape type='rectangle'><transform name='to_world'><scale value='0.5'/><translate x='-0.4' y='0.5' "
        "z='0.6'/></transform>"
        "<bsdf type='twosided'><bsdf type='diffuse'/></bsdf></shape>"
        "<shape type='sphere'><point name='center' value='0.5,0.5,0'/><float name='radius' value='0.4'/>"
        "<bsdf type='dielectric'/></shape>"
        "<emitter type='point'><point name='position' value='0.3,2.5,0.5'/><rgb name='intensity' "
        "value='6,5,4'/></emitter>"
        "</scene>");
}

/* ---- Sums over renders ----------------------------------------------------------------------------------------- */

typedef struct region_sums {
    double sum[AUTO_BIAS_REGIONS], squares[AUTO_BIAS_REGIONS];
} region_sums;

static double luminance(const double rgb[3]) { return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]; }

static void region_means(const double pixels[PIXELS], double means[AUTO_BIAS_REGIONS])
{
    const int blocks = AUTO_BIAS_SIDE / AUTO_BIAS_BLOCK;
    memset(means, 0, AUTO_BIAS_REGIONS * sizeof *means);
    for (int y = 0; y < AUTO_BIAS_SIDE; y++)
        for (int x = 0; x < AUTO_BIAS_SIDE; x++) {
            const double value = pixels[y * AUTO_BIAS_SIDE + x];
            means[0] += value / PIXELS;
            means[1 + y / AUTO_BIAS_BLOCK * blocks + x / AUTO_BIAS_BLOCK] +=
                value / (AUTO_BIAS_BLOCK * AUTO_BIAS_BLOCK);
        }
}

static void add_image(region_sums *sums, const double pixels[PIXELS])
{
    double means[AUTO_BIAS_REGIONS];
    region_means(pixels, means);
    for (int r = 0; r < AUTO_BIAS_REGIONS; r++) {
        sums->sum[r] += means[r];
        sums->squares[r] += means[r] * means[r];
    }
}

static auto_bias_means means_of(const region_sums *sums, double n)
{
    auto_bias_means means;
    for (int r = 0; r < AUTO_BIAS_REGIONS; r++) {
        means.mean[r] = sums->sum[r] / n;
        means.error[r] = sqrt((sums->squares[r] - sums->sum[r] * means.mean[r]) / (n - 1.0) / n);
    }
    return means;
}

/* ---- The naive way --------------------------------------------------------------------------------------------- */

/* Of the mean of both halves: mean and variance of the luminance. */
static void pilot_of(const ca_auto_parts *parts, int p, double *mean, double *variance)
{
    const ca_joined_pixel *pixel = &parts->pilot->mean.pixels[p];
    *mean = luminance(pixel->mean);
    *variance = pixel->luminance_variance;
}

/* Weights that make the variance small, by the variances that the very samples seem to have. */
static void join_naively(const ca_auto_parts *parts, void *user)
{
    double *pixels = user;
    assert_non_null(parts->render);
    assert_true(parts->weights[0] > 0.0 && parts->weights[0] < 1.0 && parts->weights[1] > 0.0 &&
                parts->weights[1] < 1.0);
    for (int p = 0; p < PIXELS; p++) {
        double mean, variance;
        pilot_of(parts, p, &mean, &variance);
        const double other = parts->render->pixels[p].luminance_variance, sum = variance + other;
        const double weight = sum > 0.0 ? variance / sum : 0.5;
        pixels[p] = (1.0 - weight) * mean + weight * luminance(parts->render->pixels[p].mean);
    }
}

/* ---- Renders --------------------------------------------------------------------------------------------------- */

static void luminances(const ca_image_layers *image, double pixels[PIXELS])
{
    static const char *const names[3] = {"R", "G", "B"};
    for (int p = 0; p < PIXELS; p++) {
        double rgb[3];
        for (int c = 0; c < 3; c++) rgb[c] = (double)ca_image_channel(image, names[c])[p];
        pixels[p] = luminance(rgb);
    }
}

double auto_bias_render(const ca_scene *scene, uint32_t renders, uint32_t samples, uint64_t seed,
                        auto_bias_means *joined, auto_bias_means *naive)
{
    region_sums sums[2] = {0};
    double phases = 0.0;
    for (uint32_t k = 0; k < renders; k++) {
        double pixels[PIXELS], naive_pixels[PIXELS];
        const ca_auto_observer observer = {join_naively, naive_pixels};
        ca_render_settings settings;
        ca_render_plan plan;
        ca_image_layers *image = NULL;
        ca_render_statistics statistics = {.size = sizeof statistics};
        ca_error error = {""};
        ca_render_settings_init(&settings);
        settings.rays = "auto";
        settings.samples_per_pixel = samples;
        settings.threads = 1;
        settings.has_seed = true;
        settings.seed = seed + k;
        if (ca_render_plan_make(&plan, scene, &settings, &error) != CA_OK) fail_msg("%s", error.message);
        if (ca_auto_rays_render(&plan, &observer, &image, &statistics, &error) != CA_OK)
            fail_msg("%s", error.message);
        luminances(image, pixels);
        add_image(&sums[0], pixels);
        add_image(&sums[1], naive_pixels);
        phases += statistics.numbers_of_rays.phases;
        ca_image_release(image);
    }
    *joined = means_of(&sums[0], renders);
    *naive = means_of(&sums[1], renders);
    return phases / renders;
}

void auto_bias_reference(const ca_scene *scene, uint32_t passes, auto_bias_means *reference)
{
    enum { PARTS = 25, CAMERA_PATHS = 8 };
    region_sums sums = {0};
    for (uint32_t k = 0; k < PARTS; k++) {
        double pixels[PIXELS];
        ca_render_settings settings;
        ca_render_settings_init(&settings);
        settings.samples_per_pixel = passes / PARTS * CAMERA_PATHS;
        settings.camera_paths = CAMERA_PATHS;
        settings.light_paths = 1000;
        settings.threads = 1;
        settings.has_alpha = true;
        settings.has_seed = true;
        settings.seed = 1000003 + k;
        ca_image_layers *image = render_scene(scene, &settings);
        luminances(image, pixels);
        add_image(&sums, pixels);
        ca_image_release(image);
    }
    *reference = means_of(&sums, PARTS);
}

/* ---- The test -------------------------------------------------------------------------------------------------- */

/* Two-sided probability beyond z standard deviations. */
static double beyond(double z) { return erfc(z / sqrt(2.0)); }

double auto_bias_test(const char *what, const auto_bias_means *means, const auto_bias_means *reference)
{
    const double each = 1.0 - pow(1.0 - beyond(2.0), 1.0 / AUTO_BIAS_REGIONS);
    double low = 2.0, high = 10.0, worst = 0.0, least_bias = 0.0, whole = 0.0;
    for (int i = 0; i < 60; i++) {
        const double middle = 0.5 * (low + high);
        if (beyond(middle) > each) low = middle; else high = middle;
    }
    for (int r = 0; r < AUTO_BIAS_REGIONS; r++) {
        const double error = hypot(means->error[r], reference->error[r]),
                     z = fabs(means->mean[r] - reference->mean[r]) / error;
        if (r == 0) whole = (means->mean[r] - reference->mean[r]) / error;
        worst = fmax(worst, z);
        least_bias = fmax(least_bias, high * error / reference->mean[r]);
    }
    print_message("    %s: image %+.2f standard errors (one is %.3f %%), largest of %d regions %.2f of %.2f; a bias "
                  "of %.2f %% of "
                  "the image or %.2f %% of any block would be seen\n",
                  what, whole, 100.0 * hypot(means->error[0], reference->error[0]) / reference->mean[0],
                  AUTO_BIAS_REGIONS, worst, high,
                  100.0 * high * hypot(means->error[0], reference->error[0]) / reference->mean[0],
                  100.0 * least_bias);
    return worst / high;
}
