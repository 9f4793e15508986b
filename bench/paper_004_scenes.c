/* Figure 2 of paper 004, its three pictures; and its counter-examples to pairing pass by pass. */
#include "paper_004.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- Figure 2 -------------------------------------------------------------------------------------------------- */

void paper_transport(paper_report *report)
{
    static const char *const kinds[3] = {"all", "smooth", "dirac"};
    static const char *const channels[3] = {"R", "G", "B"};
    paper_picture pictures[3];
    ca_scene *scene = paper_scene("paper-004/mirror-room.xml", NULL, 0);
    for (int k = 0; k < 3; k++) {
        char integrator[64], name[64];
        snprintf(integrator, sizeof integrator, "qmcppm:radius_pixels=1,transport=%s", kinds[k]);
        const paper_job job = {.scene = scene,
                               .integrator = integrator,
                               .sampler = "halton",
                               .samples = report->quick ? 2 : 12,
                               .width = report->quick ? 64 : 256,
                               .height = report->quick ? 48 : 192};
        pictures[k] = paper_render(&job);
        snprintf(name, sizeof name, "mirror-room-%s.png", kinds[k]);
        paper_save(report, &pictures[k], name);
    }
    double largest = 0.0, share = 0.0;
    const size_t pixels = (size_t)pictures[0].width * pictures[0].height;
    for (size_t p = 0; p < pixels; p++)
        for (int c = 0; c < 3; c++) {
            double value[3];
            for (int k = 0; k < 3; k++) value[k] = (double)ca_image_channel(pictures[k].layers, channels[c])[p];
            if (value[0] > 0.0) largest = fmax(largest, fabs(value[1] + value[2] - value[0]) / value[0]);
        }
    share = paper_mean(pictures[2].luminance, pixels) / paper_mean(pictures[0].luminance, pixels);
    fprintf(report->out,
            "### Figure 2: the mirror room\n\n"
            "`scenes/paper-004/mirror-room.xml`, %u × %u pixels, %u × %u blocks: all transport; by square-integrable "
            "materials "
            "alone; the rest, with a Dirac event somewhere on the path, which carries %.1f %% of the light. In no "
            "pixel and channel "
            "does the sum of the last two differ from the first by more than %.2g of it.\n\n",
            pictures[0].width, pictures[0].height, report->quick ? 2 : 12, report->quick ? 2 : 12, 100.0 * share,
            largest);
    if (report->pictures)
        for (int k = 0; k < 3; k++)
            fprintf(report->out, "![%s](../pictures/paper-004/mirror-room-%s.png)\n", kinds[k], kinds[k]);
    fputc('\n', report->out);
    paper_expect(report, largest < 1e-5, largest, "< 1e-5",
                 "figure 2: largest relative difference of all and smooth + dirac");
    for (int k = 0; k < 3; k++) paper_release(&pictures[k]);
    ca_scene_release(scene);
}

/* ---- Counter-examples ------------------------------------------------------------------------------------------ */

/* One way to pair the paths, for growing n. */
typedef struct pairing {
    const char *name, *sampler;
    bool all_pairs;
    int colour;
} pairing;

static const pairing pairings[] = {
    {"ppm, halton-plain", "halton-plain", false, 2},
    {"ppm, independent", "independent", false, 0},
    {"qmcppm, halton-plain", "halton-plain", true, 1},
    {"qmcppm, sobol-plain", "sobol-plain", true, 3},
    {"qmcppm, halton", "halton", true, 4},
};
enum { PAIRINGS = sizeof pairings / sizeof pairings[0] };

/* The error of one run. */
typedef double (*pairing_error)(const ca_scene *scene, const pairing *way, uint32_t n, uint64_t seed);

static bool is_plain(const pairing *way) { return strstr(way->sampler, "-plain") != NULL; }

/* Over seeds; plain sequences have none, and one run is enough. */
static double error_over_seeds(const ca_scene *scene, const pairing *way, uint32_t n, uint32_t some,
                               pairing_error measure)
{
    const uint64_t seeds = is_plain(way) ? 1 : some;
    double sum = 0.0;
    for (uint64_t seed = 0; seed < seeds; seed++) {
        const double error = measure(scene, way, n, seed);
        sum += error * error;
    }
    return sqrt(sum / (double)seeds);
}

/* The single pixel of interleaved.xml: n camera paths and n light paths, relative to 0.6. */
static double interleaved_error(const ca_scene *scene, const pairing *way, uint32_t n, uint64_t seed)
{
    enum { BLOCK = 2048 }; /* the radius is always the same: so large blocks are only quicker */
    const unsigned block = n < BLOCK ? n : BLOCK;
    char integrator[96];
    snprintf(integrator, sizeof integrator,
             way->all_pairs ? "qmcppm:light_paths=%u,camera_paths=%u" : "ppm:light_paths=1", block, block);
    const paper_job job = {
        .scene = scene, .integrator = integrator, .sampler = way->sampler, .samples = n, .seed = seed, .threads = 1};
    paper_picture picture = paper_render(&job);
    const double error = fabs(picture.luminance[0] / 0.6 - 1.0);
    paper_release(&picture);
    return error;
}

/* A part of camera-is-light.xml away from the border. n counts passes, or blocks of light paths for the same four
 * camera paths a pixel; relative to 0.8. */
static double camera_is_light_error(const ca_scene *scene, const pairing *way, uint32_t n, uint64_t seed)
{
    static const uint32_t crop[4] = {48, 24, 80, 56};
    const paper_job job = {.scene = scene,
                           .integrator = way->all_pairs ? "qmcppm:total_camera_paths=2,radius_pixels=1"
                                                        : "ppm:radius_pixels=1,alpha=0.5",
                           .sampler = way->sampler,
                           .samples = n,
                           .seed = seed,
                           .crop = crop};
    paper_picture picture = paper_render(&job);
    const size_t pixels = (size_t)picture.width * picture.height;
    double sum = 0.0;
    for (size_t p = 0; p < pixels; p++)
        sum += (picture.luminance[p] / 0.8 - 1.0) * (picture.luminance[p] / 0.8 - 1.0);
    paper_release(&picture);
    return sqrt(sum / (double)pixels);
}

typedef struct counter_example {
    const char *file, *name, *counts;
    pairing_error measure;
    uint32_t first, factor, steps, quick_steps;
    uint32_t seeds;       /* of what is random */
    uint32_t light_paths; /* of one of n */
    double last_decades;  /* exponent expected of all pairs, at most */
    const char *goal;
} counter_example;

static const counter_example examples[] = {
    {.file = "paper-004/interleaved.xml",
     .name = "interleaved",
     .counts = "Interleaved passes (figure 3): error of the single pixel",
     .measure = interleaved_error,
     .first = 16,
     .factor = 4,
     .steps = 7,
     .quick_steps = 5,
     .seeds = 4,
     .light_paths = 1,
     .last_decades = -0.5,
     .goal = "<= -0.5"},
    {.file = "paper-004/camera-is-light.xml",
     .name = "camera-is-light",
     .counts = "Camera is light (section 5): r.m.s. error of a pixel",
     .measure = camera_is_light_error,
     .first = 1,
     .factor = 4,
     .steps = 6,
     .quick_steps = 3,
     .seeds = 2,
     .light_paths = 128 * 81,
     .last_decades = -0.25,
     .goal = "<= -0.25"},
};

static void measure_pairing(const counter_example *example, const ca_scene *scene, const pairing *way, uint32_t steps,
                            paper_series *series)
{
    uint32_t n = example->first;
    for (uint32_t i = 0; i < steps; i++, n *= example->factor)
        paper_series_add(series, (double)n * example->light_paths,
                         error_over_seeds(scene, way, n, example->seeds, example->measure));
}

static void print_example(paper_report *report, const counter_example *example, const paper_panel *panel)
{
    fprintf(report->out, "**%s**, relative, for n light paths:\n\n| n |", example->counts);
    for (int s = 0; s < panel->count; s++) fprintf(report->out, " %s |", panel->series[s].name);
    fputs("\n|---|", report->out);
    for (int s = 0; s < panel->count; s++) fputs("---|", report->out);
    for (int i = 0; i < panel->series[0].count; i++) {
        fprintf(report->out, "\n| %.0f |", panel->series[0].x[i]);
        for (int s = 0; s < panel->count; s++) fprintf(report->out, " %.3g |", panel->series[s].y[i]);
    }
    fputs("\n| exponent |", report->out);
    for (int s = 0; s < panel->count; s++) {
        const paper_series *series = &panel->series[s];
        const paper_fit fit = paper_fit_power(series->x, series->y, series->count);
        fprintf(report->out, " %.2f ± %.2f |", fit.exponent, fit.error);
        if (!pairings[s].all_pairs && is_plain(&pairings[s]))
            paper_expect(report, fit.exponent > -0.02, fit.exponent, ">= 0",
                         "%s: exponent of the error of %s, which stops falling", example->name, series->name);
        if (pairings[s].all_pairs)
            paper_expect(report, fit.exponent <= example->last_decades, fit.exponent, example->goal,
                         "%s: exponent of the error of %s", example->name, series->name);
    }
    fputs("\n\n", report->out);
}

void paper_counter_examples(paper_report *report)
{
    static paper_panel panels[2];
    fputs("### Counter-examples to pairing pass by pass\n\n", report->out);
    for (int e = 0; e < 2; e++) {
        const counter_example *example = &examples[e];
        paper_panel *panel = &panels[e];
        *panel = (paper_panel){.title = example->name, .x_label = "light paths", .y_label = "relative error"};
        ca_scene *scene = paper_scene(example->file, NULL, 0);
        for (int i = 0; i < PAIRINGS; i++) {
            paper_series *series =
                paper_panel_add(panel, pairings[i].name, pairings[i].colour, !pairings[i].all_pairs);
            measure_pairing(example, scene, &pairings[i], report->quick ? example->quick_steps : example->steps,
                            series);
        }
        ca_scene_release(scene);
        print_example(report, example, panel);
    }
    paper_plot(report, "counter-examples.svg", panels, 2);
}
