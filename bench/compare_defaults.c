/* Variance-aware weights against all the others as they come: the relative mean square error after a number of
 * iterations, with the default radius and alpha, on scenes of every kind, with all their pixels.
 *
 *     compare_defaults [--iterations N] [--side N] [--only SCENE] [--references FOLDER]
 *                      [--reference-iterations N] [--table FILE]
 *
 * The error is that of squared_error.h, once as it is and once without the worst thousandth of a picture's pixels;
 * means over as many seeds as there are batches. References are of `ovcm` from half of the default radius on,
 * which shrinks fast: their blur is a few per cent of that of the compared pictures. With --references they are
 * kept in that folder. A method that does not merge is compared where it is right: in blocks whose mean agrees
 * with the reference (deviation.h) within 2 %. All have the same random numbers, seed by seed, and those that
 * merge one radius, so that a ratio has the error of a difference; intervals are of 95 %. Prints Markdown; exit
 * status 1 where the error of `vavcm` is above the limit times that of the best of the others, with the interval. */
#include "bench_support.h"
#include "deviation.h"
#include "squared_error.h"
#include "weights_scenes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIDE = 32, ITERATIONS = 64, REFERENCE_ITERATIONS = 512, SEED = 5200 };

/* Of the best. */
#define LIMIT 1.02

/* Of a picture's pixels. */
#define WORST 0.001

typedef struct options {
    uint32_t side, iterations, reference_iterations;
    const char *only, *references, *table;
} options;

/* What a method renders, by seeds. */
typedef struct pictures {
    float *values[BATCHES]; /* owned, [pixel][channel] */
} pictures;

/* ---- Rendering ------------------------------------------------------------------------------------------------- */

static void render_method(const ca_scene *scene, int method, const options *chosen, pictures *run)
{
    char integrator[64];
    snprintf(integrator, sizeof integrator, "%s%s", weights_methods[method].integrator,
             method < WEIGHTS_FIRST_MERGING ? "" : ":radius=0");
    for (uint32_t i = 0; i < BATCHES; i++) {
        run->values[i] = bench_need(3 * (size_t)chosen->side * chosen->side, sizeof *run->values[i]);
        bench_render(scene, integrator, chosen->side, chosen->iterations, SEED + i, run->values[i], NULL);
    }
}

static void free_pictures(pictures *run)
{
    for (int i = 0; i < BATCHES; i++) free(run->values[i]);
}

static bench_halves reference_of(const ca_scene *scene, const char *name, const options *chosen)
{
    float *values = bench_need(3 * (size_t)chosen->side * chosen->side, sizeof *values);
    char integrator[64];
    double radius;
    bench_render(scene, "ovcm:radius=0", chosen->side, 1, SEED, values, &radius);
    free(values);
    snprintf(integrator, sizeof integrator, "ovcm:alpha=0.5,radius=%.9g", 0.5 * radius);
    return bench_halves_make(scene, "compare_defaults", name, integrator, chosen->side, chosen->reference_iterations,
                             chosen->references);
}

/* ---- Comparing ------------------------------------------------------------------------------------------------- */

static double luminance_at(const float *values, size_t pixel)
{
    const float *rgb = values + 3 * pixel;
    return 0.2126 * (double)rgb[0] + 0.7152 * (double)rgb[1] + 0.0722 * (double)rgb[2];
}

/* Where the method is right; the share of the pixels. */
static double find_right(const pictures *run, const bench_halves *halves, bool *counts)
{
    const size_t pixels = (size_t)halves->side * halves->side;
    bool *left_out = bench_need(pixels, sizeof *left_out);
    double *reference = bench_need(pixels * BATCHES, sizeof *reference);
    batches means;
    if (!batches_create(&means, halves->side, halves->side, 1)) fputs("out of memory\n", stderr), exit(1);
    for (size_t p = 0; p < pixels; p++)
        for (size_t i = 0; i < BATCHES; i++) {
            means.mean[p * BATCHES + i] = luminance_at(run->values[i], p);
            reference[p * BATCHES + i] = 0.5 * (luminance_at(halves->half[0], p) + luminance_at(halves->half[1], p));
        }
    find_consistent_pixels(&means, reference, left_out, 0.02, 0.05, counts);
    batches_destroy(&means);
    free(left_out);
    free(reference);
    size_t right = 0;
    for (size_t p = 0; p < pixels; p++) right += counts[p];
    return (double)right / (double)pixels;
}

/* Mean errors over the seeds, [0], and over bootstrap samples of them. */
static void mean_errors(const pictures *run, const bench_halves *halves, const bool *counts, double worst,
                        const bootstrap_table *table, double values[1 + BOOTSTRAP])
{
    double errors[BATCHES];
    for (int i = 0; i < BATCHES; i++) errors[i] = bench_squared_error(halves, run->values[i], counts, worst);
    for (int sample = 0; sample <= BOOTSTRAP; sample++) {
        values[sample] = 0.0;
        for (int i = 0; i < BATCHES; i++) values[sample] += table->count[sample][i] * errors[i] / BATCHES;
    }
}

static figure ratio_of(const pictures *runs, int method, const bench_halves *halves, const bool *counts,
                       double worst, const bootstrap_table *table)
{
    double own[1 + BOOTSTRAP], aware[1 + BOOTSTRAP];
    mean_errors(&runs[method], halves, counts, worst, table, own);
    mean_errors(&runs[WEIGHTS_VAVCM], halves, counts, worst, table, aware);
    return figure_of_ratio(aware, own);
}

static void print_largest(FILE *out, const figure *largest)
{
    fprintf(out, " **%.3f** ± %.3f |", largest->value, largest->half_width);
}

/* The largest ratios, over the methods that are right on a tenth of the picture or more; false: above the limit. */
static bool report_scene(FILE *out, const char *name, const pictures *runs, const bench_halves *halves)
{
    bool *counts = bench_need((size_t)halves->side * halves->side, sizeof *counts);
    bootstrap_table table;
    bootstrap_draw(&table, 3);
    figure largest[2] = {{0}};
    fprintf(out, "| %s |", name);
    for (int method = 0; method < WEIGHTS_VAVCM; method++) {
        const bool merges = method >= WEIGHTS_FIRST_MERGING;
        const double right = merges ? 1.0 : find_right(&runs[method], halves, counts);
        if (right < 0.1) {
            fputs(" |", out);
            continue;
        }
        for (int i = 0; i < 2; i++) {
            const figure ratio = ratio_of(runs, method, halves, merges ? NULL : counts, i ? WORST : 0.0, &table);
            fprintf(out, i ? "%.3f%s |" : " %.3f, ", ratio.value, right < 0.9 ? "*" : "");
            if (ratio.value > largest[i].value) largest[i] = ratio;
        }
    }
    for (int i = 0; i < 2; i++) print_largest(out, &largest[i]);
    fputs("\n", out);
    fflush(out);
    free(counts);
    return largest[0].value + largest[0].half_width <= LIMIT && largest[1].value + largest[1].half_width <= LIMIT;
}

/* ---- The program ----------------------------------------------------------------------------------------------- */

static bool run_scene(FILE *out, const weights_scene *s, const options *chosen)
{
    pictures runs[WEIGHTS_METHODS];
    char path[1024];
    ca_error error;
    ca_scene *scene;
    if (!weights_scene_find(s, path)) return true;
    fprintf(stderr, "%s: %d seeds of %d methods\n", s->name, BATCHES, WEIGHTS_METHODS);
    if (ca_scene_load(path, NULL, 0, &scene, &error) != CA_OK) bench_die(path, &error);
    bench_halves halves = reference_of(scene, s->name, chosen);
    for (int method = 0; method < WEIGHTS_METHODS; method++) render_method(scene, method, chosen, &runs[method]);
    const bool good = report_scene(out, s->name, runs, &halves);
    for (int method = 0; method < WEIGHTS_METHODS; method++) free_pictures(&runs[method]);
    bench_halves_free(&halves);
    ca_scene_release(scene);
    return good;
}

static bool parse_options(int argc, char **argv, options *chosen)
{
    *chosen = (options){.side = SIDE, .iterations = ITERATIONS, .reference_iterations = REFERENCE_ITERATIONS};
    for (int i = 1; i + 1 < argc; i += 2) {
        const char *value = argv[i + 1];
        if (strcmp(argv[i], "--iterations") == 0)
            chosen->iterations = (uint32_t)strtoul(value, NULL, 10);
        else if (strcmp(argv[i], "--side") == 0)
            chosen->side = (uint32_t)strtoul(value, NULL, 10);
        else if (strcmp(argv[i], "--reference-iterations") == 0)
            chosen->reference_iterations = (uint32_t)strtoul(value, NULL, 10);
        else if (strcmp(argv[i], "--only") == 0)
            chosen->only = value;
        else if (strcmp(argv[i], "--references") == 0)
            chosen->references = value;
        else if (strcmp(argv[i], "--table") == 0)
            chosen->table = value;
        else
            return false;
    }
    return argc % 2 == 1 && chosen->iterations > 0 && chosen->side > 0 && chosen->reference_iterations > 0;
}

static void print_heading(FILE *out)
{
    fputs("| scene |", out);
    for (int method = 0; method < WEIGHTS_VAVCM; method++) fprintf(out, " %s |", weights_methods[method].name);
    fputs(" largest | largest, trimmed |\n|---", out);
    for (int column = 0; column <= WEIGHTS_VAVCM + 1; column++) fputs("|---", out);
    fputs("|\n", out);
}

int main(int argc, char **argv)
{
    options chosen;
    if (!parse_options(argc, argv, &chosen)) {
        fprintf(stderr,
                "usage: %s [--iterations N] [--side N] [--only SCENE] [--references FOLDER] "
                "[--reference-iterations N] [--table FILE]\n",
                argv[0]);
        return 2;
    }
    FILE *out = chosen.table ? fopen(chosen.table, "w") : stdout;
    if (!out) return perror(chosen.table), 1;
    print_heading(out);
    int failed = 0, count = 0;
    for (int i = 0; i < WEIGHTS_SCENES; i++)
        if (!chosen.only || strcmp(chosen.only, weights_scenes[i].name) == 0) {
            failed += !run_scene(out, &weights_scenes[i], &chosen);
            count++;
        }
    if (count == 0) return fprintf(stderr, "compare_defaults: no scene is named %s\n", chosen.only), 2;
    if (failed > 0) fprintf(stderr, "%d scenes: above %g times the best, with the interval\n", failed, LIMIT);
    return (chosen.table && fclose(out) != 0) || failed > 0;
}
