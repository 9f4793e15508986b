/* How qmcppm converges with each sampler: bias and standard deviation apart, over five randomisations of the same
 * sequences; and against random ppm in equal time. */
#include "paper_004.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SEEDS = 5, MAX_STEPS = 8 };

static const char *const samplers[] = {"independent", "halton",        "sobol",       "lattice",
                                       "sobol-image", "lattice-image", "sobol-tiles", "lattice-tiles"};
enum { SAMPLERS = sizeof samplers / sizeof samplers[0] };

typedef struct convergence_scene {
    const char *file, *name;
    uint32_t width, height;
    uint32_t light_paths, camera_paths; /* of a block; per pixel */
    int steps;                          /* 1, 2, 4, ... blocks of either side */
    const char *what;
    double radius;              /* of the first block */
    const char *integrator;     /* its parameters beside the radius */
    const char *reference;      /* integrator */
    uint32_t reference_samples; /* of each of its two halves */
    const char *reference_bias; /* what is known of it */
} convergence_scene;

static const convergence_scene scenes[] = {
    {.file = "paper-004/mirror-room.xml",
     .name = "mirror-room",
     .width = 32,
     .height = 24,
     .light_paths = 24576,
     .camera_paths = 4,
     .steps = 5,
     .what = "",
     .radius = 0.15,
     .integrator = "",
     .reference = "ppm:light_paths=24576,radius=0.05,alpha=0.25",
     .reference_samples = 2048,
     .reference_bias = "random ppm with radii from 0.050 to 0.019, against 0.150 to 0.075 of the blocks here"},
    {.file = "cornell-box/cornell-box.xml",
     .name = "cornell-box",
     .width = 32,
     .height = 32,
     .light_paths = 4096,
     .camera_paths = 1,
     .steps = 6,
     .what = "; its lamp is not shown, since how its edge falls into a pixel would be most of the noise",
     .radius = 30.0,
     .integrator = ",hide_emitters=true",
     .reference = "path:hide_emitters=true",
     .reference_samples = 8192,
     .reference_bias = "path tracing, without bias"},
    {.file = "paper-004/diffuse-room.xml",
     .name = "diffuse-room",
     .width = 32,
     .height = 24,
     .light_paths = 4096,
     .camera_paths = 1,
     .steps = 6,
     .what = "; without glass or mirrors, seen from outside",
     .radius = 0.35,
     .integrator = "",
     .reference = "path",
     .reference_samples = 8192,
     .reference_bias = "path tracing, without bias"},
};

static const double ALPHA = 0.5;

/* qmcppm or ppm as the scene wants it, with so many times its first radius. */
static void integrator_for(const convergence_scene *what, const char *name, double alpha, double radii,
                           char text[128])
{
    snprintf(text, 128, "%s:alpha=%g,radius=%g,light_paths=%u,camera_paths=%u%s", name, alpha, radii * what->radius,
             what->light_paths, what->camera_paths, what->integrator);
}

static paper_reference render_reference(const convergence_scene *what, const ca_scene *scene, bool quick)
{
    const paper_job job = {.scene = scene,
                           .integrator = what->reference,
                           .sampler = strncmp(what->reference, "path", 4) == 0 ? "sobol" : "independent",
                           .samples = quick ? what->reference_samples / 16 : what->reference_samples,
                           .width = what->width,
                           .height = what->height};
    return paper_render_reference(&job);
}

/* ---- Runs ------------------------------------------------------------------------------------------------------ */

typedef struct convergence {
    int steps;
    double n[MAX_STEPS];
    paper_errors errors[SAMPLERS][MAX_STEPS];
    double seconds[SAMPLERS][MAX_STEPS]; /* of a render */
} convergence;

/* Five renders that differ in their random numbers only. */
static paper_errors repeat(const paper_job *first, const paper_reference *truth, double *seconds, double *passes)
{
    paper_job job = *first;
    paper_repeats repeats = paper_repeats_start(truth->pixels);
    *seconds = *passes = 0.0;
    for (int seed = 0; seed < SEEDS; seed++) {
        job.seed = (uint64_t)seed + 1;
        paper_picture picture = paper_render(&job);
        paper_repeats_add(&repeats, picture.luminance);
        *seconds += picture.statistics.seconds / SEEDS;
        *passes += (double)picture.statistics.iterations / SEEDS;
        paper_release(&picture);
    }
    const paper_errors errors = paper_repeats_errors(&repeats, truth->luminance, truth->noise);
    paper_repeats_release(&repeats);
    return errors;
}

static convergence measure(const convergence_scene *what, const ca_scene *scene, const paper_reference *truth,
                           double alpha, bool quick)
{
    convergence c = {.steps = quick ? 3 : what->steps};
    char integrator[128];
    integrator_for(what, "qmcppm", alpha, 1.0, integrator);
    for (int i = 0; i < c.steps; i++) {
        c.n[i] = what->light_paths * (double)(1u << i);
        for (int s = 0; s < SAMPLERS; s++) {
            const paper_job job = {.scene = scene,
                                   .integrator = integrator,
                                   .sampler = samplers[s],
                                   .samples = what->camera_paths << i,
                                   .width = what->width,
                                   .height = what->height};
            double blocks;
            c.errors[s][i] = repeat(&job, truth, &c.seconds[s][i], &blocks);
        }
    }
    return c;
}

/* ---- The report ------------------------------------------------------------------------------------------------ */

static void print_bias(FILE *out, const paper_errors *e)
{
    if (e->bias > e->bias_floor)
        fprintf(out, "%.4f", e->bias);
    else
        fprintf(out, "< %.4f", e->bias_floor);
}

typedef struct fits {
    paper_fit rmse, bias, deviation;
} fits;

static fits fit_sampler(const convergence *c, int s)
{
    double rmse[MAX_STEPS], bias[MAX_STEPS], deviation[MAX_STEPS];
    for (int i = 0; i < c->steps; i++) {
        rmse[i] = c->errors[s][i].rmse;
        bias[i] = c->errors[s][i].bias > c->errors[s][i].bias_floor ? c->errors[s][i].bias : 0.0;
        deviation[i] = c->errors[s][i].deviation;
    }
    return (fits){.rmse = paper_fit_power(c->n, rmse, c->steps),
                  .bias = paper_fit_power(c->n, bias, c->steps),
                  .deviation = paper_fit_power(c->n, deviation, c->steps)};
}

static void print_fit(FILE *out, const paper_fit *fit)
{
    if (isfinite(fit->exponent) && isfinite(fit->error))
        fprintf(out, " | %.2f ± %.2f", fit->exponent, fit->error);
    else
        fputs(" | –", out);
}

static void print_convergence(FILE *out, const convergence *c)
{
    fputs("| sampler | n | RMSE | bias | standard deviation | over random's | s |\n|---|---|---|---|---|---|---|\n",
          out);
    for (int s = 0; s < SAMPLERS; s++) {
        for (int i = 0; i < c->steps; i++) {
            const paper_errors *e = &c->errors[s][i];
            fprintf(out, "| %s | %.0f | %.4f | ", samplers[s], c->n[i], e->rmse);
            print_bias(out, e);
            fprintf(out, " | %.4f | %.2f | %.2f |\n", e->deviation, e->deviation / c->errors[0][i].deviation,
                    c->seconds[s][i]);
        }
        const fits f = fit_sampler(c, s);
        fputs("| | **exponent**", out);
        print_fit(out, &f.rmse);
        print_fit(out, &f.bias);
        print_fit(out, &f.deviation);
        fputs(" | | |\n", out);
    }
    fputc('\n', out);
}

/* A radius that shrinks brings noise back; what a sequence is worth by itself shows where it stays. */
static void print_fixed_radius(FILE *out, const convergence *c)
{
    const int last = c->steps - 1;
    fputs("With a radius that stays (alpha = 0), the standard deviation, as above:\n\n"
          "| sampler | at the least n | at the largest | over random's | exponent |\n|---|---|---|---|---|\n",
          out);
    for (int s = 0; s < SAMPLERS; s++) {
        const fits f = fit_sampler(c, s);
        const double at_last = c->errors[s][last].deviation;
        fprintf(out, "| %s | %.4f | %.4f | %.2f", samplers[s], c->errors[s][0].deviation, at_last,
                at_last / c->errors[0][last].deviation);
        print_fit(out, &f.deviation);
        fputs(" |\n", out);
    }
    fputc('\n', out);
}

static void plot_convergence(const paper_report *report, const convergence_scene *what, const convergence *c)
{
    static paper_panel panels[2];
    char name[64], titles[2][64];
    snprintf(name, sizeof name, "convergence-%s.svg", what->name);
    snprintf(titles[0], sizeof titles[0], "%s: RMSE", what->name);
    snprintf(titles[1], sizeof titles[1], "%s: standard deviation and bias", what->name);
    for (int k = 0; k < 2; k++)
        panels[k] = (paper_panel){.title = titles[k], .x_label = "n, light paths", .y_label = "over the mean"};
    for (int s = 0; s < SAMPLERS; s++) {
        paper_series *rmse = paper_panel_add(&panels[0], samplers[s], s, false);
        paper_series *deviation = paper_panel_add(&panels[1], samplers[s], s, false);
        for (int i = 0; i < c->steps; i++) {
            paper_series_add(rmse, c->n[i], c->errors[s][i].rmse);
            paper_series_add(deviation, c->n[i], c->errors[s][i].deviation);
        }
    }
    paper_series *bias = paper_panel_add(&panels[1], "bias (halton)", 1, true);
    for (int i = 0; i < c->steps; i++)
        if (c->errors[1][i].bias > c->errors[1][i].bias_floor) paper_series_add(bias, c->n[i], c->errors[1][i].bias);
    paper_plot(report, name, panels, 2);
}

/* ---- Equal time ------------------------------------------------------------------------------------------------ */

/* First radii over the scene's: what serves all pairs best need not serve passes best. */
static const double radii[] = {0.25, 0.354, 0.5, 0.707, 1.0, 1.414, 2.0};
enum { RADII = sizeof radii / sizeof radii[0], OWN_RADIUS = 4 };

typedef struct contest {
    paper_errors errors[RADII];
    double passes[RADII]; /* of a render */
    int best;             /* least RMSE */
} contest;

/* A method at all first radii; the job says how long. */
static contest compete(const convergence_scene *what, const char *method, const paper_job *first,
                       const paper_reference *truth)
{
    contest result = {0};
    for (int k = 0; k < RADII; k++) {
        char integrator[128];
        paper_job job = *first;
        double seconds;
        integrator_for(what, method, ALPHA, radii[k], integrator);
        job.integrator = integrator;
        result.errors[k] = repeat(&job, truth, &seconds, &result.passes[k]);
        if (result.errors[k].rmse < result.errors[result.best].rmse) result.best = k;
    }
    return result;
}

static void print_contest(FILE *out, const char *method, const contest *c)
{
    for (int k = 0; k < RADII; k++) {
        const char *mark = k == c->best ? "**" : "";
        fprintf(out, "| %s | %.0f | %g | %s%.4f%s | ", method, c->passes[k], radii[k], mark, c->errors[k].rmse, mark);
        print_bias(out, &c->errors[k]);
        fprintf(out, " | %.4f |\n", c->errors[k].deviation);
    }
}

/* All pairs by halton, and random ppm, whose passes pair each camera path with one pass of light paths only, for as
 * long: with one first radius, and each with the one that serves it best. */
static void compare_in_equal_time(paper_report *report, const convergence_scene *what, const ca_scene *scene,
                                  const paper_reference *truth, const convergence *c)
{
    const int last = c->steps - 1;
    const double seconds = c->seconds[1][last];
    paper_job job = {.scene = scene,
                     .sampler = "halton",
                     .samples = what->camera_paths << last,
                     .width = what->width,
                     .height = what->height};
    const contest halton = compete(what, "qmcppm", &job, truth);
    job.sampler = "independent", job.samples = 1u << 20, job.seconds = seconds;
    const contest ppm = compete(what, "ppm", &job, truth);

    fprintf(report->out,
            "In equal time, %.2f s a render; *radius*: the first one, over that of the table above; bold: the least "
            "error. A pass of `qmcppm` is a pair of blocks.\n\n"
            "| | passes | radius | RMSE | bias | standard deviation |\n|---|---|---|---|---|---|\n",
            seconds);
    print_contest(report->out, "`qmcppm`, halton", &halton);
    print_contest(report->out, "`ppm`, independent", &ppm);
    fputc('\n', report->out);

    const double same = halton.errors[OWN_RADIUS].rmse / ppm.errors[OWN_RADIUS].rmse;
    const double best = halton.errors[halton.best].rmse / ppm.errors[ppm.best].rmse;
    paper_expect(report, same <= 1.0, same, "<= 1",
                 "%s: RMSE of qmcppm with halton over that of random ppm in equal time, one first radius",
                 what->name);
    paper_expect(report, best <= 1.0, best, "<= 1", "%s: the same, each with its best first radius", what->name);
}

/* ---- The section ----------------------------------------------------------------------------------------------- */

static void check_convergence(paper_report *report, const convergence_scene *what, const convergence *c)
{
    const int last = c->steps - 1;
    for (int s = 1; s < SAMPLERS; s++) {
        const double ratio = c->errors[s][last].deviation / c->errors[0][last].deviation;
        paper_expect(report, ratio <= 0.6, ratio, "<= 0.6",
                     "%s: standard deviation of %s over random's at the largest n", what->name, samplers[s]);
    }
}

/* At a radius that stays: the claim of section 4.3. */
static void check_exponents(paper_report *report, const convergence_scene *what, const convergence *fixed)
{
    const paper_fit random = fit_sampler(fixed, 0).deviation;
    for (int s = 1; s < SAMPLERS; s++) {
        const paper_fit fit = fit_sampler(fixed, s).deviation;
        const double less = fit.exponent - random.exponent, error = hypot(fit.error, random.error);
        paper_expect(report, less < -2.0 * error, less, "< 0, by two standard errors",
                     "%s, radius fixed: exponent of the standard deviation of %s less random's (%.2f)", what->name,
                     samplers[s], random.exponent);
    }
}

/* Plain sequences have no seeds: one render's error, beside that of a scrambled one. */
static void print_plain(paper_report *report, const convergence_scene *what, const ca_scene *scene,
                        const paper_reference *truth, const convergence *c)
{
    static const char *const plain[][2] = {{"halton-plain", "halton"},
                                           {"sobol-plain", "sobol-image"},
                                           {"lattice-plain", "lattice-image"},
                                           {"sobol-tiles-plain", "sobol-tiles"},
                                           {"lattice-tiles-plain", "lattice-tiles"}};
    char integrator[128];
    const int last = c->steps - 1;
    integrator_for(what, "qmcppm", ALPHA, 1.0, integrator);
    fputs("Plain sequences, which light and camera paths share: RMSE at the largest n, of one render.\n\n"
          "| sequence | RMSE | scrambled or shifted | RMSE |\n|---|---|---|---|\n",
          report->out);
    for (size_t k = 0; k < sizeof plain / sizeof plain[0]; k++) {
        const paper_job job = {.scene = scene,
                               .integrator = integrator,
                               .sampler = plain[k][0],
                               .samples = what->camera_paths << last,
                               .width = what->width,
                               .height = what->height};
        paper_picture picture = paper_render(&job);
        const double plain_error = paper_reference_error(truth, picture.luminance);
        paper_release(&picture);
        for (int s = 0; s < SAMPLERS; s++)
            if (strcmp(samplers[s], plain[k][1]) == 0)
                fprintf(report->out, "| %s | %.4f | %s | %.4f |\n", plain[k][0], plain_error, samplers[s],
                        c->errors[s][last].rmse);
    }
    fputc('\n', report->out);
}

void paper_convergence(paper_report *report)
{
    fputs("### Convergence\n\n", report->out);
    for (size_t k = 0; k < sizeof scenes / sizeof scenes[0]; k++) {
        const convergence_scene *what = &scenes[k];
        if (paper_time_is_up(report, what->name)) return;
        ca_scene *scene = paper_scene(what->file, NULL, 0);
        const paper_reference truth = render_reference(what, scene, report->quick);
        const double unit = paper_mean(truth.luminance, truth.pixels);
        fprintf(
            report->out,
            "**%s**, %u × %u pixels, blocks of %u light paths and %u camera paths a pixel, first radius %g%s. n "
            "counts light paths; "
            "the last n has %u × %u blocks. Reference: %s; its own noise is %.4f. All figures are relative to the "
            "picture's mean luminance.\n\n",
            what->name, what->width, what->height, what->light_paths, what->camera_paths, what->radius, what->what,
            1u << (what->steps - 1), 1u << (what->steps - 1), what->reference_bias, truth.noise / unit);
        const convergence c = measure(what, scene, &truth, ALPHA, report->quick);
        const convergence fixed = measure(what, scene, &truth, 0.0, report->quick);
        print_convergence(report->out, &c);
        print_fixed_radius(report->out, &fixed);
        plot_convergence(report, what, &c);
        print_plain(report, what, scene, &truth, &c);
        compare_in_equal_time(report, what, scene, &truth, &c);
        check_convergence(report, what, &c);
        check_exponents(report, what, &fixed);
        fflush(report->out);
        free(truth.luminance);
        ca_scene_release(scene);
    }
}
