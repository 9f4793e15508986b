/* The radius of merges: paper 000's noise components as functions of it, the bias that it brings beside them, and the
 * radius of least error that a render takes by default. */
#include "bench_support.h"
#include "paper_000.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Times the scene's own radius, or where pairs are too few at that, times four of it. */
static const double factors[] = {0.25, 0.5, 1.0, 2.0, 4.0};
enum { RADII = sizeof factors / sizeof factors[0], ITERATIONS = 60 };

/* ---- Bias ------------------------------------------------------------------------------------------------------ */

static double value_of(const paper_000_run *run, int group, size_t p)
{
    const ca_pair_pixel *pixel = &run->groups[group].pixels[p];
    return pixel->sums[CA_PAIR_VALUE] / (double)pixel->iterations;
}

/* The r.m.s. difference of two runs' pictures over the region, less what their noise adds to it. Groups of one number
 * have the same random numbers and so the same paths: the noise is that of their differences. *floor: two standard
 * errors of the square, as a length, where some ten neighbours share their photons. */
static double bias_between(const paper_000_run *run, const paper_000_run *least, double *floor)
{
    const size_t pixels = (size_t)run->all.width * run->all.height;
    const double groups = PAPER_000_GROUPS;
    double square = 0.0, noise = 0.0;
    for (size_t p = 0; p < pixels; p++) {
        double sum = 0.0, squares = 0.0;
        for (int g = 0; g < PAPER_000_GROUPS; g++) {
            const double difference = value_of(run, g, p) - value_of(least, g, p);
            sum += difference;
            squares += difference * difference;
        }
        const double mean = sum / groups;
        square += mean * mean / (double)pixels;
        noise += (squares / groups - mean * mean) / (groups - 1.0) / (double)pixels;
    }
    *floor = sqrt(2.0 * noise * sqrt(2.0 * 10.0 / (double)pixels));
    return sqrt(fmax(0.0, square - noise));
}

static double mean_luminance(const paper_000_run *run)
{
    const size_t pixels = (size_t)run->all.width * run->all.height;
    double sum = 0.0;
    for (size_t p = 0; p < pixels; p++)
        sum += run->all.pixels[p].sums[CA_PAIR_VALUE] / (double)run->all.pixels[p].iterations / (double)pixels;
    return sum;
}

/* ---- The radius of least error --------------------------------------------------------------------------------- */

/* What a render of the scene takes where nobody chooses. */
static double default_radius(const paper_000_scene *scene)
{
    ca_scene *loaded = paper_000_load(scene);
    ca_render_settings settings = paper_000_settings(scene, PAPER_000_PILOT_LIGHT, 1, 1);
    char integrator[128];
    snprintf(integrator, sizeof integrator, "%s%cradius=0", scene->integrator,
             strchr(scene->integrator, ':') ? ',' : ':');
    settings.integrator = integrator;
    settings.radius = 0.0;
    settings.has_alpha = false;
    settings.sampler = "independent";
    settings.samples_per_pixel = 1;
    const double radius = bench_default_radius(loaded, &settings);
    ca_scene_release(loaded);
    return radius;
}

/* ---- The table ------------------------------------------------------------------------------------------------- */

static double percent_of(double value, double mean) { return 100.0 * value / mean; }

static void radius_row(paper_report *report, const paper_000_run *run, const paper_000_run *least)
{
    const paper_000_numbers n = paper_000_summary(run, PAPER_000_LIGHT, PAPER_000_CAMERA);
    const double mean = mean_luminance(run);
    double floor = 0.0;
    fprintf(report->out, "| %.5f | %.2f | %.2f | %.2f | %.2f | ", run->scene.radius,
            percent_of(n.of[ROOT_CAMERA].value, mean), percent_of(n.of[ROOT_LIGHT].value, mean),
            percent_of(n.of[ROOT_PAIR].value, mean), percent_of(n.of[ROOT_PREDICTED].value, mean));
    if (run == least) {
        fputs("– |\n", report->out);
        return;
    }
    const double bias = bias_between(run, least, &floor);
    fprintf(report->out, bias > floor ? "%.2f |\n" : "< %.2f |\n", percent_of(fmax(bias, floor), mean));
}

/* Photons that share a light path are what the pair term counts: with a larger radius more of them merge at once, but
 * each counts for less. */
static void check_scene(paper_report *report, paper_000_run *const runs[RADII])
{
    double pair[RADII], camera[RADII];
    for (int i = 0; i < RADII; i++) {
        const paper_000_numbers n = paper_000_summary(runs[i], PAPER_000_LIGHT, PAPER_000_CAMERA);
        pair[i] = n.of[ROOT_PAIR].value;
        camera[i] = n.of[ROOT_CAMERA].value;
    }
    paper_expect(report, pair[RADII - 1] < pair[0], pair[RADII - 1] / pair[0], "< 1",
                 "radius, %s: pair term with 16 times the radius over that with the smallest", runs[0]->scene.name);
    if (camera[0] <= 0.0) return; /* too small to be seen: nothing to compare */
    paper_expect(report, camera[0] / camera[RADII - 1] < pair[0] / pair[RADII - 1],
                 camera[0] / camera[RADII - 1] / (pair[0] / pair[RADII - 1]), "< 1",
                 "radius, %s: the camera term depends on it less than the pair term", runs[0]->scene.name);
}

static void radius_of_scene(paper_report *report, const paper_000_scene *what)
{
    paper_000_run *runs[RADII];
    const bool few_pairs = what->dominant && strcmp(what->dominant, "pair") == 0;
    for (int i = 0; i < RADII; i++) {
        paper_000_scene scene = *what;
        scene.radius *= few_pairs ? 4.0 * factors[i] : factors[i];
        runs[i] = paper_000_measure(report, &scene, PAPER_000_PILOT_LIGHT, PAPER_000_PILOT_CAMERA, ITERATIONS, 700);
    }
    fprintf(
        report->out,
        "**%s**, its own radius %g m; a render's default (of least error, for %d light paths a pass and one camera "
        "path): %.5f m.\n\n| radius, m | camera | light | pair | all three | bias |\n|---|---|---|---|---|---|\n",
        what->name, what->radius, PAPER_000_PILOT_LIGHT, default_radius(what));
    for (int i = 0; i < RADII; i++) radius_row(report, runs[i], runs[0]);
    fputc('\n', report->out);
    check_scene(report, runs);
    for (int i = 0; i < RADII; i++) paper_000_release(runs[i]);
    fflush(report->out);
}

void paper_000_radius(paper_report *report)
{
    fprintf(
        report->out,
        "### The radius\n\nRoots of the average terms for N_F = %d and N_B = %d, predicted from iterations of %d and "
        "%d, in %% of the region's mean luminance; *bias*: the r.m.s. difference of the mean picture from that "
        "with the smallest radius, less what noise adds (<: below two standard errors). The terms are of one "
        "iteration and fall with more of them, the bias does not.\n\n",
        PAPER_000_LIGHT, PAPER_000_CAMERA, PAPER_000_PILOT_LIGHT, PAPER_000_PILOT_CAMERA);
    paper_plan(report, PAPER_000_SCENES * RADII);
    for (int s = 0; s < PAPER_000_SCENES; s++) radius_of_scene(report, &paper_000_scenes[s]);
}
