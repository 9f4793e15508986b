/* Section 3.1 of paper 004: what alpha does to the estimate at a point. On pointwise.xml, whose query points do not
 * depend on random numbers and whose radiance is known, so that bias and noise of the density estimate are all that
 * there is. */
#include "paper_004.h"

#include <math.h>
#include <stdlib.h>

enum { STEPS = 7, JITTERED_STEPS = 5, SEEDS = 12, QUICK_SEEDS = 5 };

/* As the scene has it. */
enum { LIGHT_PATHS = 4096 };
static const double radius0 = 0.2, height = 0.5, lamp_x = 0.1, lamp_z = -0.05, reflectance = 0.8;
static const double pi = 3.14159265358979323846;

static const double alphas[] = {0.0, 0.25, 0.5, 0.75, 1.0};
enum { ALPHAS = sizeof alphas / sizeof alphas[0] };

/* ---- What is known --------------------------------------------------------------------------------------------- */

typedef struct known {
    size_t points;
    double *radiance; /* owned */
    double *bias;     /* owned: r0^2 / 8 times the radiance's Laplacian */
    double unit;      /* mean radiance */
} known;

/* At the positions that a picture has for its pixels. L = c (d^2)^(-3/2), s = d^2 - h^2 on the floor, has the
 * Laplacian c (15 s / d^7 - 6 / d^5). */
static known know(const paper_picture *picture)
{
    const float *x = ca_image_channel(picture->layers, "P.X"), *z = ca_image_channel(picture->layers, "P.Z");
    known k = {.points = (size_t)picture->width * picture->height};
    k.radiance = calloc(k.points, sizeof *k.radiance);
    k.bias = calloc(k.points, sizeof *k.bias);
    if (!k.radiance || !k.bias) fputs("paper_004: out of memory\n", stderr), exit(1);
    for (size_t p = 0; p < k.points; p++) {
        const double dx = (double)x[p] - lamp_x, dz = (double)z[p] - lamp_z, s = dx * dx + dz * dz;
        const double d = sqrt(s + height * height), c = reflectance / pi * height;
        k.radiance[p] = c * pow(d, -3.0);
        k.bias[p] = radius0 * radius0 / 8.0 * c * (15.0 * s * pow(d, -7.0) - 6.0 * pow(d, -5.0));
    }
    k.unit = paper_mean(k.radiance, k.points);
    return k;
}

static void forget(known *k)
{
    free(k->radiance);
    free(k->bias);
}

/* How large a bias of the known shape is in a picture: r.m.s., over the mean. One number from all pixels: it has far
 * less noise than the sum of their squares. */
static double bias_in(const known *k, const double *luminance)
{
    double product = 0.0, square = 0.0;
    for (size_t p = 0; p < k->points; p++) {
        product += (luminance[p] - k->radiance[p]) * k->bias[p];
        square += k->bias[p] * k->bias[p];
    }
    return product / square * sqrt(square / (double)k->points) / k->unit;
}

/* ---- Runs ------------------------------------------------------------------------------------------------------ */

typedef struct alpha_row {
    double n[STEPS], noise[STEPS], bias[STEPS], bias_error[STEPS];
    int steps;
    paper_fit noise_fit, bias_fit;
} alpha_row;

/* `blocks` blocks of light paths for the same query points, or, where they are jittered, for as many of them:
 * standard deviation, and the bias with its standard error. */
typedef struct repeated {
    double deviation, bias, bias_error;
} repeated;

static repeated repeat(const ca_scene *scene, const char *more, const char *sampler, uint32_t blocks, int seeds)
{
    char integrator[160];
    double biases[SEEDS], square = 0.0;
    paper_repeats repeats = {0};
    known k = {0};
    snprintf(integrator, sizeof integrator, more, blocks * (unsigned)LIGHT_PATHS);
    for (int seed = 0; seed < seeds; seed++) {
        const paper_job job = {.scene = scene,
                               .integrator = integrator,
                               .sampler = sampler,
                               .samples = blocks,
                               .seed = (uint64_t)seed + 1};
        paper_picture picture = paper_render(&job);
        if (seed == 0) {
            k = know(&picture);
            repeats = paper_repeats_start(k.points);
        }
        paper_repeats_add(&repeats, picture.luminance);
        biases[seed] = bias_in(&k, picture.luminance);
        paper_release(&picture);
    }
    repeated r = {.deviation = paper_repeats_errors(&repeats, k.radiance, 0.0).deviation,
                  .bias = paper_mean(biases, (size_t)seeds)};
    for (int i = 0; i < seeds; i++) square += (biases[i] - r.bias) * (biases[i] - r.bias);
    r.bias_error = sqrt(square / (seeds - 1.0) / seeds);
    paper_repeats_release(&repeats);
    forget(&k);
    return r;
}

/* A bias is looked at as long as it is three times its standard error. */
static bool is_seen(const alpha_row *row, int step) { return row->bias[step] > 3.0 * row->bias_error[step]; }

static alpha_row measure(const ca_scene *scene, const char *integrator, bool with_bias, int steps, bool quick)
{
    alpha_row row = {.steps = quick ? 4 : steps};
    double seen[STEPS] = {0};
    for (int i = 0; i < row.steps; i++) {
        const int seeds = quick ? QUICK_SEEDS : SEEDS;
        row.n[i] = (double)LIGHT_PATHS * (double)(1u << i);
        row.noise[i] = repeat(scene, integrator, "independent", 1u << i, seeds).deviation;
        if (!with_bias) continue;
        /* The bias is the same with any sampler, and better seen with one that has little noise. */
        const repeated r = repeat(scene, integrator, "halton", 1u << i, (seeds + 1) / 2);
        row.bias[i] = r.bias;
        row.bias_error[i] = r.bias_error;
        seen[i] = is_seen(&row, i) ? r.bias : 0.0;
    }
    row.noise_fit = paper_fit_power(row.n, row.noise, row.steps);
    if (with_bias) row.bias_fit = paper_fit_power(row.n, seen, row.steps);
    return row;
}

/* ---- Tables ---------------------------------------------------------------------------------------------------- */

static void print_head(FILE *out, const alpha_row *row, const char *what)
{
    fprintf(out, "| alpha | %s, n = %.0f |", what, row->n[0]);
    for (int i = 1; i < row->steps; i++) fprintf(out, " %.0f |", row->n[i]);
    fputs(" exponent | expected |\n|---|", out);
    for (int i = 0; i < row->steps + 2; i++) fputs("---|", out);
    fputc('\n', out);
}

static void print_noise(FILE *out, double alpha, const alpha_row *row)
{
    fprintf(out, "| %g |", alpha);
    for (int i = 0; i < row->steps; i++) fprintf(out, " %.3g |", row->noise[i]);
    fprintf(out, " %.3f ± %.3f | %.3f |\n", row->noise_fit.exponent, row->noise_fit.error, -0.5 * (1.0 - alpha));
}

static void print_bias(FILE *out, double alpha, const alpha_row *row)
{
    fprintf(out, "| %g |", alpha);
    for (int i = 0; i < row->steps; i++)
        if (is_seen(row, i))
            fprintf(out, " %.2g ± %.1g |", row->bias[i], row->bias_error[i]);
        else
            fputs(" – |", out);
    fprintf(out, " %.2f ± %.2f | %.2f |\n", row->bias_fit.exponent, row->bias_fit.error, -alpha);
}

static void check_row(paper_report *report, double alpha, const alpha_row *row)
{
    const double noise = -0.5 * (1.0 - alpha), bias = -alpha;
    paper_expect(report, fabs(row->noise_fit.exponent - noise) <= 0.05, row->noise_fit.exponent - noise,
                 "within 0.05", "alpha = %g, n fixed in advance: exponent of the noise less the expected %g", alpha,
                 noise);
    paper_expect(report, fabs(row->bias_fit.exponent - bias) <= 0.1, row->bias_fit.exponent - bias, "within 0.1",
                 "alpha = %g, n fixed in advance: exponent of the bias less the expected %g", alpha, bias);
}

static void print_table(paper_report *report, const ca_scene *scene, bool in_advance)
{
    alpha_row rows[ALPHAS];
    for (int a = 0; a < ALPHAS; a++) {
        char integrator[96];
        snprintf(integrator, sizeof integrator, "qmcppm:alpha=%g,total_camera_paths=1%s", alphas[a],
                 in_advance ? ",total_light_paths=%u" : "");
        rows[a] = measure(scene, integrator, true, STEPS, report->quick);
        if (in_advance) check_row(report, alphas[a], &rows[a]);
    }
    print_head(report->out, &rows[0], "noise");
    for (int a = 0; a < ALPHAS; a++) print_noise(report->out, alphas[a], &rows[a]);
    fputc('\n', report->out);
    print_head(report->out, &rows[0], "bias");
    for (int a = 0; a < ALPHAS; a++) print_bias(report->out, alphas[a], &rows[a]);
    fputc('\n', report->out);
}

/* Query points spread over pixels that are larger than the disks: what one point cannot average the pixel does. */
static void print_jittered(paper_report *report)
{
    static const ca_define defines[2] = {{"filter", "0.5"}, {"resolution", "16"}};
    ca_scene *scene = paper_scene("paper-004/pointwise.xml", defines, 2);
    const alpha_row fixed =
        measure(scene, "qmcppm:alpha=1,radius=0.04,total_camera_paths=1", false, JITTERED_STEPS, report->quick);
    const alpha_row jittered = measure(scene, "qmcppm:alpha=1,radius=0.04", false, JITTERED_STEPS, report->quick);
    fputs("A pixel is an integral over points, whose noise averages out: with as many query points as blocks of "
          "light paths, "
          "spread over the pixels (16 × 16 of them, the first radius two thirds of their side), alpha = 1 converges "
          "as well. Noise, "
          "progressive:\n\n",
          report->out);
    print_head(report->out, &fixed, "one query point a pixel");
    print_noise(report->out, 1.0, &fixed);
    fputc('\n', report->out);
    print_head(report->out, &jittered, "as many as blocks");
    fprintf(report->out, "| 1 |");
    for (int i = 0; i < jittered.steps; i++) fprintf(report->out, " %.3g |", jittered.noise[i]);
    fprintf(report->out, " %.3f ± %.3f | < 0 |\n\n", jittered.noise_fit.exponent, jittered.noise_fit.error);
    paper_expect(report, jittered.noise_fit.exponent < -0.3, jittered.noise_fit.exponent, "< -0.3",
                 "alpha = 1, jittered query points: exponent of the noise");
    ca_scene_release(scene);
}

void paper_alpha(paper_report *report)
{
    ca_scene *scene = paper_scene("paper-004/pointwise.xml", NULL, 0);
    fprintf(report->out,
            "### The choice of alpha\n\n`scenes/paper-004/pointwise.xml`, 1024 query points, the same for all; %d "
            "seeds. Noise (of "
            "`independent`) and bias (seen more sharply with `halton`) are r.m.s. over the query points, over their "
            "mean. The bias is that part of the error which has the shape "
            "of the radiance's Laplacian, with its standard error; where it is less than three of these it is left "
            "out (–).\n\n"
            "n fixed in advance, all photons with the radius r(n):\n\n",
            report->quick ? QUICK_SEEDS : SEEDS);
    print_table(report, scene, true);
    fputs("Progressive, each block with the radius of its own n. What counts is the mean of r² (for the bias) and of "
          "1 / r² (for the "
          "square of the noise) over the blocks, which follow the same powers of n only in the end; for alpha = 1 "
          "the bias "
          "goes as ln(n) / n:\n\n",
          report->out);
    print_table(report, scene, false);
    ca_scene_release(scene);
    print_jittered(report);
}
