/* What an order of blocks recomputes, and how many samples Sobol' sequences save. */
#include "paper_004.h"

#include "bench_support.h"

#include <math.h>
#include <stdlib.h>

/* ---- Recomputation --------------------------------------------------------------------------------------------- */

typedef struct recomputation {
    double light_paths, camera_paths, seconds;
} recomputation;

static recomputation measure_order(const ca_scene *scene, const char *order, uint32_t side, uint32_t blocks)
{
    enum { REPEATS = 5 };
    char integrator[128];
    const unsigned pixels = side * side;
    snprintf(integrator, sizeof integrator,
             "qmcppm:radius_pixels=1,%s,light_paths=%u,total_light_paths=%u,total_camera_paths=%u", order, pixels,
             pixels * blocks, blocks);
    double seconds[REPEATS];
    recomputation r = {0};
    for (int i = 0; i < REPEATS; i++) {
        const paper_job job = {.scene = scene,
                               .integrator = integrator,
                               .sampler = "halton",
                               .samples = blocks,
                               .width = side,
                               .height = side};
        paper_picture picture = paper_render(&job);
        r.light_paths = (double)picture.statistics.light_paths;
        r.camera_paths = (double)picture.statistics.camera_paths;
        seconds[i] = picture.statistics.seconds;
        paper_release(&picture);
    }
    r.seconds = bench_median(seconds, REPEATS);
    return r;
}

void paper_recomputation(paper_report *report)
{
    static const char *const orders[3] = {"order=diagonal,keep_blocks=false", "keep_blocks=false",
                                          "keep_blocks=true"};
    static const char *const names[3] = {"diagonal, none kept", "rectangular, none kept", "rectangular, kept"};
    const uint32_t side = report->quick ? 32 : 64, blocks = 16;
    const double side_paths = (double)side * side * blocks;
    recomputation r[3];
    ca_scene *scene = paper_scene("paper-004/mirror-room.xml", NULL, 0);
    for (int o = 0; o < 3; o++) r[o] = measure_order(scene, orders[o], side, blocks);
    ca_scene_release(scene);
    fprintf(report->out,
            "### Recomputation\n\nThe mirror room, %u × %u pixels, all pairs of %u blocks of camera paths and %u of "
            "light paths, %.0f "
            "paths a block; without recomputation there would be %.0f paths of either kind.\n\n"
            "| order, blocks in memory | light paths traced | camera paths traced | both, times the least | s "
            "|\n|---|---|---|---|---|\n",
            side, side, blocks, blocks, (double)side * side, side_paths);
    for (int o = 0; o < 3; o++)
        fprintf(report->out, "| %s | %.0f | %.0f | %.2f | %.2f |\n", names[o], r[o].light_paths, r[o].camera_paths,
                (r[o].light_paths + r[o].camera_paths) / (2.0 * side_paths), r[o].seconds);
    const double saved = 1.0 - r[1].seconds / r[0].seconds;
    const double traced = (r[1].light_paths + r[1].camera_paths) / (r[0].light_paths + r[0].camera_paths);
    fprintf(report->out,
            "\nThe rectangular order traces %.2f of the diagonal's paths and saves %.0f %% of the time; blocks that "
            "stay in memory (`keep_blocks`, the default, up to 1 GiB) save %.0f %% of the rest.\n\n",
            traced, 100.0 * saved, 100.0 * (1.0 - r[2].seconds / r[1].seconds));
    paper_expect(report, traced <= 0.6, traced, "<= 0.6",
                 "16 × 16 blocks: paths traced in rectangular over diagonal order");
    paper_expect(report, saved > 0.0, saved, "> 0", "16 × 16 blocks: time saved by the rectangular order");
    paper_expect(report, r[2].seconds <= 0.5 * r[1].seconds, r[2].seconds / r[1].seconds, "<= 0.5",
                 "16 × 16 blocks: time with blocks kept over that without");
}

/* ---- Samples saved --------------------------------------------------------------------------------------------- */

enum { SAVED_SEEDS = 4, SAVED_STEPS = 5, FIRST_SAMPLES = 4 };

static const char *const saved_scenes[][2] = {{"cornell-box", "cornell-box/cornell-box.xml"},
                                              {"mis", "mis/mis.xml"},
                                              {"caustics", "caustics/caustics.xml"},
                                              {"textured", "textured/textured.xml"}};
static const char *const saved_integrators[3] = {"path", "bdpt", "vcm"};
enum { SAVED_SCENES = sizeof saved_scenes / sizeof saved_scenes[0] };

/* A method with the radius that its merges have by default, one for all seeds and samplers: else the standard
 * deviation would be that of radii, too. */
static void with_one_radius(const ca_scene *scene, const char *method, char integrator[64])
{
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.integrator = method;
    settings.sampler = "independent";
    settings.samples_per_pixel = FIRST_SAMPLES << (SAVED_STEPS - 1);
    settings.has_seed = true;
    settings.width = 64, settings.height = 48;
    const double radius = bench_default_radius(scene, &settings);
    if (radius > 0.0)
        snprintf(integrator, 64, "%s:radius=%.6g", method, radius);
    else
        snprintf(integrator, 64, "%s", method);
}

/* The standard deviation over seeds, which is all of the error of methods without bias, for growing numbers of
 * samples. */
static paper_fit deviation_of(const ca_scene *scene, const char *integrator, const char *sampler, bool quick,
                              double *last)
{
    const int steps = quick ? 3 : SAVED_STEPS;
    double samples[SAVED_STEPS], deviation[SAVED_STEPS];
    for (int i = 0; i < steps; i++) {
        paper_repeats repeats = {0};
        for (uint64_t seed = 1; seed <= SAVED_SEEDS; seed++) {
            const paper_job job = {.scene = scene,
                                   .integrator = integrator,
                                   .sampler = sampler,
                                   .samples = (uint32_t)FIRST_SAMPLES << i,
                                   .seed = seed,
                                   .width = 64,
                                   .height = 48};
            paper_picture picture = paper_render(&job);
            if (!repeats.pixels) repeats = paper_repeats_start((size_t)picture.width * picture.height);
            paper_repeats_add(&repeats, picture.luminance);
            paper_release(&picture);
        }
        samples[i] = FIRST_SAMPLES << i;
        deviation[i] = paper_repeats_errors(&repeats, NULL, 0.0).deviation;
        paper_repeats_release(&repeats);
    }
    *last = deviation[steps - 1];
    return paper_fit_power(samples, deviation, steps);
}

/* Samples that the line `fit` needs for what `random` has at `samples`, over these. */
static double samples_ratio(paper_fit fit, paper_fit random, double samples)
{
    const double target = random.offset + random.exponent * log(samples);
    return exp((target - fit.offset) / fit.exponent) / samples;
}

void paper_samples_saved(paper_report *report)
{
    int good[3] = {0};
    fputs("### Samples saved by `sobol`\n\n64 × 48 pixels. The error is the standard deviation over four seeds, "
          "r.m.s. over the pixels, over "
          "the mean (`path` and `bdpt` have no bias, and `vcm`, with one radius for all seeds, has the same with "
          "either sampler); exponents are "
          "those of lines fitted to "
          "4, 8, 16, 32 and 64 samples, and the ratio is how many samples the line of `sobol` needs for the error "
          "that that of "
          "`independent` has at 16 and at 64.\n\n"
          "| scene | integrator | independent: at the end | exponent | sobol: at the end | exponent | samples, of 16 "
          "| of 64 |\n"
          "|---|---|---|---|---|---|---|---|\n",
          report->out);
    for (int s = 0; s < SAVED_SCENES; s++) {
        if (paper_time_is_up(report, saved_scenes[s][0])) return;
        ca_scene *scene = paper_scene(saved_scenes[s][1], NULL, 0);
        for (int i = 0; i < 3; i++) {
            char integrator[64];
            double random_last, sobol_last;
            with_one_radius(scene, saved_integrators[i], integrator);
            const paper_fit random = deviation_of(scene, integrator, "independent", report->quick, &random_last);
            const paper_fit sobol = deviation_of(scene, integrator, "sobol", report->quick, &sobol_last);
            const double ratio = samples_ratio(sobol, random, 16.0), at_64 = samples_ratio(sobol, random, 64.0);
            fprintf(report->out, "| %s | `%s` | %.4f | %.2f | %.4f | %.2f | %.2f | %.2f |\n", saved_scenes[s][0],
                    saved_integrators[i], random_last, random.exponent, sobol_last, sobol.exponent, ratio, at_64);
            good[i] += ratio <= 0.8;
        }
        fflush(report->out);
        ca_scene_release(scene);
    }
    fputc('\n', report->out);
    for (int i = 0; i < 3; i++)
        paper_expect(report, good[i] >= 2, good[i], ">= 2",
                     "%s with sobol: scenes that need at most 0.8 of random's samples", saved_integrators[i]);
}
