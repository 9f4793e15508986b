/* Variance-aware weights against all the others: the standard deviation of an iteration at one radius, a side of a
 * pixel, and equal iteration counts, on scenes of every kind, with all their pixels.
 *
 *     compare_weights [--iterations N] [--only SCENE] [--table FILE]
 *
 * A method is compared where it is right: in blocks whose mean agrees with that of the methods that merge. All get
 * the same random numbers, batch by batch, so that a ratio has the error of a difference. A batch of `vavcm` has a
 * pilot of its own. Prints Markdown; exit status 1 where `vavcm` is noisier than the best of the others by more than
 * the limit, with the interval. */
#include "bench_support.h"
#include "deviation.h"
#include "weights_scenes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIDE = 128, THREADS = 2, BATCH_SEED = 31000, ITERATIONS = 80 };

/* Of the best. */
#define LIMIT 1.02

typedef struct options {
    uint32_t iterations;
    const char *only, *table;
} options;

static void *need(size_t count, size_t size)
{
    void *memory = calloc(count, size);
    if (!memory) fputs("compare_weights: out of memory\n", stderr), exit(1);
    return memory;
}

/* ---- Rendering ------------------------------------------------------------------------------------------------- */

static double luminance_at(const float *const channels[3], size_t pixel)
{
    return 0.2126 * (double)channels[0][pixel] + 0.7152 * (double)channels[1][pixel] +
           0.0722 * (double)channels[2][pixel];
}

static void keep_batch(batches *b, uint32_t batch, const ca_image_layers *image)
{
    static const char *const names[3] = {"R", "G", "B"};
    const float *channels[3], *deviation = ca_image_channel(image, "StandardDeviation.Y");
    for (int c = 0; c < 3; c++) channels[c] = ca_image_channel(image, names[c]);
    const double n = b->iterations;
    for (size_t p = 0; p < (size_t)b->width * b->height; p++) {
        const double mean = luminance_at(channels, p);
        const double variance = (double)deviation[p] * (double)deviation[p] * (n - 1.0) / n;
        b->mean[p * BATCHES + batch] = mean;
        b->mean_square[p * BATCHES + batch] = variance + mean * mean;
    }
}

static void render_batch(const ca_scene *scene, int method, uint32_t batch, batches *b)
{
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    char integrator[64];
    snprintf(integrator, sizeof integrator, "%s%s", weights_methods[method].integrator,
             method < WEIGHTS_FIRST_MERGING ? "" : ":alpha=0,radius_pixels=1");
    settings.integrator = integrator;
    settings.sampler = "independent";
    settings.samples_per_pixel = b->iterations;
    settings.seed = BATCH_SEED + batch;
    settings.has_seed = true;
    settings.threads = THREADS;
    settings.width = settings.height = SIDE;
    ca_image_layers *image;
    ca_error error;
    if (ca_render(scene, &settings, &image, NULL, &error) != CA_OK) bench_die(settings.integrator, &error);
    keep_batch(b, batch, image);
    ca_image_release(image);
}

static void render_all(const char *path, uint32_t iterations, batches *runs)
{
    ca_error error;
    ca_scene *scene;
    if (ca_scene_load(path, NULL, 0, &scene, &error) != CA_OK) bench_die(path, &error);
    for (int method = 0; method < WEIGHTS_METHODS; method++)
        if (!batches_create(&runs[method], SIDE, SIDE, iterations / BATCHES))
            fputs("compare_weights: out of memory\n", stderr), exit(1);
    for (uint32_t batch = 0; batch < BATCHES; batch++)
        for (int method = 0; method < WEIGHTS_METHODS; method++) render_batch(scene, method, batch, &runs[method]);
    ca_scene_release(scene);
}

/* ---- Comparing ------------------------------------------------------------------------------------------------- */

/* What one method's deviation is to that of `vavcm`, where the method is right. */
typedef struct comparison {
    figure ratio;  /* of vavcm over the method */
    double counts; /* share of the pixels where the method is right */
} comparison;

/* The mean of all that merge, batch by batch. */
static double *reference_of(const batches *runs)
{
    const size_t values = (size_t)SIDE * SIDE * BATCHES;
    double *reference = need(values, sizeof *reference);
    for (int method = WEIGHTS_FIRST_MERGING; method < WEIGHTS_METHODS; method++)
        for (size_t i = 0; i < values; i++)
            reference[i] += runs[method].mean[i] / (WEIGHTS_METHODS - WEIGHTS_FIRST_MERGING);
    return reference;
}

static comparison compare(const batches *runs, int method, const double *reference, const bootstrap_table *table)
{
    static bool counts[SIDE * SIDE], left_out[SIDE * SIDE];
    double own[1 + BOOTSTRAP], aware[1 + BOOTSTRAP];
    for (size_t p = 0; p < SIDE * SIDE; p++) counts[p] = true;
    /* What a method never finds but for a lucky path or two must not pass for noise. */
    const double known = method < WEIGHTS_FIRST_MERGING ? 0.05 : (double)INFINITY;
    find_consistent_pixels(&runs[method], reference, left_out, 0.01, known, counts);
    comparison result = {.counts = 0.0};
    for (size_t p = 0; p < SIDE * SIDE; p++) result.counts += counts[p] / (double)(SIDE * SIDE);
    if (!(result.counts > 0.0)) return result;
    mean_deviation(&runs[method], counts, table, own);
    mean_deviation(&runs[WEIGHTS_VAVCM], counts, table, aware);
    if (own[0] > 0.0) result.ratio = figure_of_ratio(aware, own);
    return result;
}

/* The largest ratio, over the methods that are right on a tenth of the picture or more; false: above the limit. */
static bool report_scene(FILE *out, const char *name, const batches *runs)
{
    double *reference = reference_of(runs);
    bootstrap_table table;
    bootstrap_draw(&table, 2);
    figure worst = {0};
    fprintf(out, "| %s |", name);
    for (int method = 0; method < WEIGHTS_VAVCM; method++) {
        const comparison c = compare(runs, method, reference, &table);
        if (c.counts < 0.1 || !(c.ratio.value > 0.0)) {
            fputs(" |", out);
            continue;
        }
        fprintf(out, " %.3f", c.ratio.value);
        fputs(c.counts < 0.9 ? "* |" : " |", out);
        if (c.ratio.value > worst.value) worst = c.ratio;
    }
    fprintf(out, " **%.3f** ± %.3f |\n", worst.value, worst.half_width);
    fflush(out);
    free(reference);
    return worst.value + worst.half_width <= LIMIT;
}

/* ---- The program ----------------------------------------------------------------------------------------------- */

static bool run_scene(FILE *out, const weights_scene *scene, uint32_t iterations)
{
    static batches runs[WEIGHTS_METHODS];
    char path[1024];
    if (!weights_scene_find(scene, path)) return true;
    fprintf(stderr, "%s: %u iterations of %d methods\n", scene->name, iterations, WEIGHTS_METHODS);
    render_all(path, iterations, runs);
    const bool good = report_scene(out, scene->name, runs);
    for (int method = 0; method < WEIGHTS_METHODS; method++) batches_destroy(&runs[method]);
    return good;
}

static bool parse_options(int argc, char **argv, options *chosen)
{
    *chosen = (options){.iterations = ITERATIONS};
    for (int i = 1; i + 1 < argc; i += 2) {
        if (strcmp(argv[i], "--iterations") == 0)
            chosen->iterations = (uint32_t)strtoul(argv[i + 1], NULL, 10) / BATCHES * BATCHES;
        else if (strcmp(argv[i], "--only") == 0)
            chosen->only = argv[i + 1];
        else if (strcmp(argv[i], "--table") == 0)
            chosen->table = argv[i + 1];
        else
            return false;
    }
    return argc % 2 == 1 && chosen->iterations >= 2 * BATCHES; /* batches of two: they have a variance */
}

static void print_heading(FILE *out)
{
    fputs("| scene |", out);
    for (int method = 0; method < WEIGHTS_VAVCM; method++) fprintf(out, " %s |", weights_methods[method].name);
    fputs(" largest |\n|---", out);
    for (int column = 0; column <= WEIGHTS_VAVCM; column++) fputs("|---", out);
    fputs("|\n", out);
}

int main(int argc, char **argv)
{
    options chosen;
    if (!parse_options(argc, argv, &chosen)) {
        fprintf(stderr, "usage: %s [--iterations N] [--only SCENE] [--table FILE]; N at least %d\n", argv[0],
                2 * BATCHES);
        return 2;
    }
    FILE *out = chosen.table ? fopen(chosen.table, "w") : stdout;
    if (!out) return perror(chosen.table), 1;
    print_heading(out);
    int failed = 0, chosen_scenes = 0;
    for (int i = 0; i < WEIGHTS_SCENES; i++)
        if (!chosen.only || strcmp(chosen.only, weights_scenes[i].name) == 0) {
            failed += !run_scene(out, &weights_scenes[i], chosen.iterations);
            chosen_scenes++;
        }
    if (chosen_scenes == 0) return fprintf(stderr, "compare_weights: no scene is named %s\n", chosen.only), 2;
    if (failed > 0) fprintf(stderr, "%d scenes: above %g times the best, with the interval\n", failed, LIMIT);
    return (chosen.table && fclose(out) != 0) || failed > 0;
}
