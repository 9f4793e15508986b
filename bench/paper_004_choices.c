/* What paper 004 leaves to choose: alpha and the first radius (sections 3.1 and 3.2), and the ratio m_b : n_b of
 * camera paths and light paths of a block (section 4.1). Five scenes. */
#include "paper_004.h"

#include <math.h>
#include <stdlib.h>

typedef struct choice_scene {
    const char *file, *name;
    const char *more;      /* parameters of either integrator */
    const char *reference; /* integrator */
    uint32_t reference_samples;
} choice_scene;

static const choice_scene scenes[] = {
    {"cornell-box/cornell-box.xml", "cornell-box", ",hide_emitters=true", "path:hide_emitters=true", 8192},
    {"paper-004/diffuse-room.xml", "diffuse-room", "", "path", 8192},
    {"textured/textured.xml", "textured", "", "path", 8192},
    {"caustics/caustics.xml", "caustics", "", "path", 16384},
    {"paper-004/mirror-room.xml", "mirror-room", "", "ppm:light_paths=24576,radius=0.03,alpha=0.25", 2048},
};
enum { SCENES = sizeof scenes / sizeof scenes[0], SEEDS = 3, WIDTH = 32, HEIGHT = 24 };

static paper_reference reference_of(const choice_scene *what, const ca_scene *scene, bool quick)
{
    const paper_job job = {.scene = scene,
                           .integrator = what->reference,
                           .sampler = what->reference[1] == 'a' ? "sobol" : "independent",
                           .samples = quick ? what->reference_samples / 16 : what->reference_samples,
                           .width = WIDTH,
                           .height = HEIGHT};
    return paper_render_reference(&job);
}

/* ---- Alpha and the first radius -------------------------------------------------------------------------------- */

static const double alphas[] = {1.0 / 6.0, 1.0 / 3.0, 0.5, 2.0 / 3.0, 5.0 / 6.0};
static const double radii[] = {0.5, 1.0, 2.0, 4.0, 8.0};
enum { ALPHAS = 5, HALF = 2, RADII = 5, BLOCKS = 12 };

typedef struct error_grid {
    double rmse[RADII][ALPHAS];
} error_grid;

/* Root mean square over seeds. */
static double rmse_of(const paper_job *first, const paper_reference *truth)
{
    paper_job job = *first;
    double sum = 0.0;
    for (job.seed = 1; job.seed <= SEEDS; job.seed++) {
        paper_picture picture = paper_render(&job);
        const double error = paper_reference_error(truth, picture.luminance);
        sum += error * error / SEEDS;
        paper_release(&picture);
    }
    return sqrt(sum);
}

static error_grid measure_grid(const choice_scene *what, const ca_scene *scene, const paper_reference *truth,
                               bool quick)
{
    error_grid grid;
    for (int r = 0; r < RADII; r++)
        for (int a = 0; a < ALPHAS; a++) {
            char integrator[160];
            snprintf(integrator, sizeof integrator, "qmcppm:radius_pixels=%g,alpha=%.17g,light_paths=4096%s",
                     radii[r], alphas[a], what->more);
            const paper_job job = {.scene = scene,
                                   .integrator = integrator,
                                   .sampler = "halton",
                                   .samples = quick ? 3 : BLOCKS,
                                   .width = WIDTH,
                                   .height = HEIGHT};
            grid.rmse[r][a] = rmse_of(&job, truth);
        }
    return grid;
}

static int best_alpha(const double rmse[ALPHAS])
{
    int best = 0;
    for (int a = 1; a < ALPHAS; a++)
        if (rmse[a] < rmse[best]) best = a;
    return best;
}

/* Over the best alpha's error at the same radius, geometric mean over radii. */
static double loss_of(const error_grid *grid, int alpha)
{
    double sum = 0.0;
    for (int r = 0; r < RADII; r++) sum += log(grid->rmse[r][alpha] / grid->rmse[r][best_alpha(grid->rmse[r])]);
    return exp(sum / RADII);
}

static void print_grid(FILE *out, const choice_scene *what, const error_grid *grid)
{
    fprintf(out, "**%s**\n\n| first radius, pixels |", what->name);
    for (int a = 0; a < ALPHAS; a++) fprintf(out, " alpha %.2f |", alphas[a]);
    fputs("\n|---|---|---|---|---|---|\n", out);
    for (int r = 0; r < RADII; r++) {
        fprintf(out, "| %g |", radii[r]);
        for (int a = 0; a < ALPHAS; a++)
            fprintf(out, a == best_alpha(grid->rmse[r]) ? " **%.4f** |" : " %.4f |", grid->rmse[r][a]);
        fputc('\n', out);
    }
    fputs("| over the best, mean |", out);
    for (int a = 0; a < ALPHAS; a++) fprintf(out, " %.3f |", loss_of(grid, a));
    fputs("\n\n", out);
}

static double spread(const double *values, int count)
{
    double low = values[0], high = values[0];
    for (int i = 1; i < count; i++) low = fmin(low, values[i]), high = fmax(high, values[i]);
    return high / low;
}

/* What the choice of one of the two changes of the error, a factor: geometric mean over the other. */
static double change_by_radius(const error_grid *grid)
{
    double sum = 0.0;
    for (int a = 0; a < ALPHAS; a++) {
        double column[RADII];
        for (int r = 0; r < RADII; r++) column[r] = grid->rmse[r][a];
        sum += log(spread(column, RADII));
    }
    return exp(sum / ALPHAS);
}

static double change_by_alpha(const error_grid *grid)
{
    double sum = 0.0;
    for (int r = 0; r < RADII; r++) sum += log(spread(grid->rmse[r], ALPHAS));
    return exp(sum / RADII);
}

static void check_grid(paper_report *report, const choice_scene *what, const error_grid *grid)
{
    double losses[ALPHAS];
    for (int a = 0; a < ALPHAS; a++) losses[a] = loss_of(grid, a);
    const double other = fmin(fmin(losses[0], losses[1]), fmin(losses[3], losses[4]));
    paper_expect(report, losses[HALF] <= other, losses[HALF] / other, "<= 1",
                 "%s: error with alpha = 1/2 over that with the best other alpha, mean over first radii", what->name);
    const double radius = change_by_radius(grid), alpha = change_by_alpha(grid);
    paper_expect(report, radius > alpha, log(radius) / log(alpha), "> 1",
                 "%s: what the first radius changes of the error (factor %.2f, mean over alphas) over what alpha "
                 "does (%.2f, mean over first radii), logarithms",
                 what->name, radius, alpha);
}

void paper_balance(paper_report *report)
{
    const int blocks = report->quick ? 3 : BLOCKS;
    fprintf(
        report->out,
        "### Alpha and the first radius\n\n\"α = 1/2 best balances the two interests\" (section 3.1), and \"r₀ "
        "becomes most influential\" (3.2). `qmcppm`, `halton`, %u × %u pixels, %d × %d blocks of 4096 light paths "
        "and one camera path a pixel; RMSE over the mean, of %d seeds, bold where the radius' least is. The last "
        "row is the error over the least of each row, geometric mean.\n\n",
        WIDTH, HEIGHT, blocks, blocks, SEEDS);
    for (int k = 0; k < SCENES && !paper_time_is_up(report, scenes[k].name); k++) {
        ca_scene *scene = paper_scene(scenes[k].file, NULL, 0);
        const paper_reference truth = reference_of(&scenes[k], scene, report->quick);
        const error_grid grid = measure_grid(&scenes[k], scene, &truth, report->quick);
        print_grid(report->out, &scenes[k], &grid);
        check_grid(report, &scenes[k], &grid);
        fflush(report->out);
        free(truth.luminance);
        ca_scene_release(scene);
    }
}

/* ---- m_b : n_b ------------------------------------------------------------------------------------------------- */

static const uint32_t camera_paths[] = {1, 2, 4, 8, 16};
enum { RATIOS = 5, RATIO_BLOCKS = 4, PAIRS = 65536 };

/* Pixels that differ from a neighbour by more than a quarter of the mean. */
static bool *find_edges(const paper_reference *truth)
{
    bool *edges = paper_need(calloc(truth->pixels, sizeof *edges));
    const double least = 0.25 * paper_mean(truth->luminance, truth->pixels);
    const uint32_t width = truth->width;
    for (size_t p = 0; p < truth->pixels; p++) {
        const size_t right = p % width + 1 < width ? p + 1 : p, below = p + width < truth->pixels ? p + width : p;
        const bool across = fabs(truth->luminance[p] - truth->luminance[right]) > least,
                   down = fabs(truth->luminance[p] - truth->luminance[below]) > least;
        edges[p] |= across || down;
        edges[right] |= across;
        edges[below] |= down;
    }
    return edges;
}

/* Standard deviation over seeds of the pixels at edges, [1], and of the others, [0], r.m.s., over the mean. */
typedef struct ratio_error {
    double deviation[2], rmse;
} ratio_error;

static ratio_error measure_ratio(const paper_job *first, const paper_reference *truth, const bool *edges)
{
    enum { RATIO_SEEDS = 6 };
    paper_job job = *first;
    ratio_error e = {0};
    paper_repeats repeats = paper_repeats_start(truth->pixels);
    for (job.seed = 1; job.seed <= RATIO_SEEDS; job.seed++) {
        paper_picture picture = paper_render(&job);
        const double error = paper_reference_error(truth, picture.luminance);
        e.rmse += error * error / RATIO_SEEDS;
        paper_repeats_add(&repeats, picture.luminance);
        paper_release(&picture);
    }
    double count[2] = {0}, variance[2] = {0};
    for (size_t p = 0; p < truth->pixels; p++) {
        const double mean = repeats.sum[p] / RATIO_SEEDS;
        count[edges[p]] += 1.0;
        variance[edges[p]] += (repeats.sum_of_squares[p] - RATIO_SEEDS * mean * mean) / (RATIO_SEEDS - 1.0);
    }
    const double unit = paper_mean(truth->luminance, truth->pixels);
    for (int i = 0; i < 2; i++) e.deviation[i] = sqrt(fmax(0.0, variance[i] / fmax(1.0, count[i]))) / unit;
    e.rmse = sqrt(e.rmse);
    paper_repeats_release(&repeats);
    return e;
}

static void ratio_of_scene(paper_report *report, const choice_scene *what)
{
    ca_scene *scene = paper_scene(what->file, NULL, 0);
    const paper_reference truth = reference_of(what, scene, report->quick);
    bool *edges = find_edges(&truth);
    ratio_error errors[RATIOS];
    size_t edge_count = 0;
    for (size_t p = 0; p < truth.pixels; p++) edge_count += edges[p];
    for (int i = 0; i < RATIOS; i++) {
        char integrator[160];
        snprintf(integrator, sizeof integrator, "qmcppm:radius_pixels=1,camera_paths=%u,light_paths=%u%s",
                 camera_paths[i], PAIRS / camera_paths[i], what->more);
        const paper_job job = {.scene = scene,
                               .integrator = integrator,
                               .sampler = "halton",
                               .samples = camera_paths[i] * (report->quick ? 2 : RATIO_BLOCKS),
                               .width = WIDTH,
                               .height = HEIGHT};
        errors[i] = measure_ratio(&job, &truth, edges);
    }
    for (int i = 0; i < RATIOS; i++)
        fprintf(report->out, "| %s | %u | %u | %.4f | %.4f | %.4f |\n", i == 0 ? what->name : "", camera_paths[i],
                PAIRS / camera_paths[i], errors[i].rmse, errors[i].deviation[1], errors[i].deviation[0]);
    const double gain = errors[RATIOS - 1].deviation[1] / errors[0].deviation[1],
                 loss = errors[RATIOS - 1].deviation[0] / errors[0].deviation[0];
    paper_expect(report, gain < loss, gain / loss, "< 1",
                 "%s: noise at edges (%zu pixels) over that elsewhere, what 16 times m_b : n_b makes of it",
                 what->name, edge_count);
    free(edges);
    free(truth.luminance);
    ca_scene_release(scene);
}

void paper_ratio(paper_report *report)
{
    const int blocks = report->quick ? 2 : RATIO_BLOCKS;
    fprintf(report->out,
            "### The ratio of camera paths to light paths\n\n\"The ratio m_b : n_b allows for balancing pixel "
            "anti-aliasing and photon density\" (section 4.1): %d × %d blocks of as many pairs, %u × %u pixels, the "
            "same radii. *Edges*: pixels that differ from a neighbour by more than a quarter of the mean. Noise is "
            "the standard deviation over six seeds, r.m.s. over these pixels, over the mean.\n\n"
            "| scene | camera paths a pixel | light paths | RMSE | noise at edges | elsewhere |\n"
            "|---|---|---|---|---|---|\n",
            blocks, blocks, WIDTH, HEIGHT);
    for (int k = 0; k < SCENES && !paper_time_is_up(report, scenes[k].name); k++) ratio_of_scene(report, &scenes[k]);
    fputc('\n', report->out);
}
