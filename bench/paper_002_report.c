#include "bench_support.h"
#include "image/layers.h"
#include "paper_002.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

const estimator estimators[ESTIMATORS] = {
    [PATH] = {"path", "path"},
    [PPM] = {"ppm", "ppm:alpha=0,radius=%g"},
    [BDPT] = {"bdpt", "bdpt"},
    [VCM] = {"vcm", "vcm:alpha=0,radius=%g"},
    [VCM_SUMS] = {"vcm, three sums", "vcm:alpha=0,radius=%g,merge_sums=true"},
    [VCM_PLUS] = {"vcm-plus", "vcm-plus:alpha=0,radius=%g"},
    [VCM_PLUS_AUTHOR] = {"vcm-plus, author", "vcm-plus:alpha=0,radius=%g,densities=author"},
    [VCM_STAR_AUTHOR] = {"vcm-star, author", "vcm-star:alpha=0,radius=%g,densities=author"},
    [VAVCM] = {"vavcm", "vavcm:alpha=0,radius=%g"},
    [VCM_STAR] = {"vcm-star", "vcm-star:alpha=0,radius=%g"},
    [OVCM] = {"ovcm", "ovcm:alpha=0,radius=%g"},
    [CAVCM] = {"cavcm", "cavcm:alpha=0,radius=%g"},
    [OVCM_C0] = {"ovcm, c = 0", "ovcm:alpha=0,radius=%g,c=0"},
    [OVCM_PROJECTED] = {"ovcm, projected", "ovcm:alpha=0,radius=%g,footprint=projected"},
};

/* ---- Tables ---------------------------------------------------------------------------------------------------- */

static double percent_of_pixels(const scene_run *run, const bool *mask)
{
    const size_t pixels = (size_t)run->width * run->height;
    size_t count = 0;
    for (size_t p = 0; p < pixels; p++) count += mask[p];
    return 100.0 * (double)count / (double)pixels;
}

/* `path` and photon mapping, on the pixels where they and ovcm are right. */
static void report_other(FILE *out, const scene_run *run, int which)
{
    const estimator_run *r = &run->runs[which];
    const figure own = figure_of(r->own), against = figure_of_ratio(r->own, r->ovcm);
    if (r->own_share > 0.0)
        fprintf(out, "| %s | %.4g ± %.1f %% (on %.0f %%) | %.3f ± %.3f | – | – | ", estimators[which].name, own.value,
                100.0 * own.half_width / own.value, 100.0 * r->own_share, against.value, against.half_width);
    else
        fprintf(out, "| %s | right nowhere | – | – | – | ", estimators[which].name);
    fprintf(out, "%.0f %% (%.1f %%) |\n", percent_of_pixels(run, r->counts), 100.0 * r->sharpness);
}

static void report_row(FILE *out, const scene_run *run, int which)
{
    const estimator_run *r = &run->runs[which];
    if (which < BDPT) {
        report_other(out, run, which);
        return;
    }
    const figure common = figure_of(r->common), merging = figure_of(r->merging);
    const figure against = figure_of_ratio(r->common, run->runs[OVCM].common);
    const figure without = figure_of_ratio(r->merging, run->runs[OVCM].merging);
    fprintf(out, "| %s | %.4g ± %.1f %% | %.3f ± %.3f | ", estimators[which].name, common.value,
            100.0 * common.half_width / common.value, against.value, against.half_width);
    if (which == BDPT)
        fputs("– | – | ", out);
    else
        fprintf(out, "%.4g ± %.1f %% | %.3f ± %.3f | ", merging.value, 100.0 * merging.half_width / merging.value,
                without.value, without.half_width);
    fprintf(out, "%.0f %% (%.1f %%) |\n", percent_of_pixels(run, r->counts), 100.0 * r->sharpness);
}

static double relative_half_width(const double values[1 + BOOTSTRAP])
{
    const figure f = figure_of(values);
    return f.half_width / f.value;
}

double report_interval(const scene_run *run, int which)
{
    const estimator_run *r = &run->runs[which];
    if (which < BDPT) return r->own_share > 0.0 ? relative_half_width(r->own) : 0.0;
    const double common = relative_half_width(r->common);
    return which == BDPT ? common : fmax(common, relative_half_width(r->merging));
}

double report_widest_interval(const scene_run *run)
{
    double widest = 0.0;
    for (int which = run->first_precise; which < ESTIMATORS; which++)
        widest = fmax(widest, report_interval(run, which));
    return widest;
}

/* Who made more iterations than all did. */
static void report_alone(FILE *out, const scene_run *run)
{
    const char *between = "\nWith more iterations than all: ";
    for (int which = 0; which < ESTIMATORS; which++) {
        const uint32_t iterations = run->runs[which].samples.iterations * BATCHES;
        if (iterations == run->iterations) continue;
        fprintf(out, "%s%s %u", between, estimators[which].name, iterations);
        between = ", ";
    }
    if (*between == ',') fputs(".\n", out);
}

void report_scene(FILE *out, const scene_run *run)
{
    fprintf(out,
            "### %s\n\n%s. %u × %u pixels, %u iterations, radius %g m. %.1f %% of the pixels are left out, %.0f %% "
            "are compared;\n"
            "without `bdpt` %.0f %% could be.\n\n",
            run->scene->name, run->scene->what, run->width, run->height, run->iterations, run->scene->radius,
            percent_of_pixels(run, run->left_out), percent_of_pixels(run, run->common),
            percent_of_pixels(run, run->merging));
    fputs("| | σ̄ | over ovcm's | σ̄ without bdpt | over ovcm's | counts on (sharpness) |\n"
          "|---|---|---|---|---|---|\n",
          out);
    for (int which = 0; which < ESTIMATORS; which++) report_row(out, run, which);
    report_alone(out, run);
    fprintf(out, "\n![%s](../pictures/paper-002/%s.png)\n\n", run->scene->name, run->scene->name);
    if (run->fifty[0])
        fprintf(out,
                "Figure 2: 50 iterations of `bdpt`, `vcm` and `ovcm`, side by side.\n\n"
                "![50 iterations](../pictures/paper-002/%s-50.png)\n\n",
                run->scene->name);
}

/* ---- Time and memory ------------------------------------------------------------------------------------------- */

static double median_time(const scene_run *run, int which)
{
    double seconds[TIME_ROUNDS];
    memcpy(seconds, run->runs[which].seconds, sizeof seconds);
    return bench_median(seconds, TIME_ROUNDS);
}

/* Median over rounds of the time of one iteration over another's in the same round. */
static double time_over(const scene_run *run, int which, int other)
{
    double ratio[TIME_ROUNDS];
    for (int i = 0; i < TIME_ROUNDS; i++) ratio[i] = run->runs[which].seconds[i] / run->runs[other].seconds[i];
    return bench_median(ratio, TIME_ROUNDS);
}

static void report_times_row(FILE *out, const scene_run *runs, int count, int which)
{
    fprintf(out, "| %s |", estimators[which].name);
    for (int i = 0; i < count; i++)
        if (runs[i].timed)
            fprintf(out, " %.1f, %.3f, %.1f |", 1e3 * median_time(&runs[i], which), time_over(&runs[i], which, VCM),
                    runs[i].runs[which].memory / (1024.0 * 1024.0));
    fputc('\n', out);
}

void report_times(FILE *out, const scene_run *runs, int count)
{
    fputs("### Time and memory\n\nMilliseconds of an iteration, those over `vcm`'s, and MiB at the peak. Pilots are "
          "not in the times, which are\nmedians over five rounds of what twenty iterations more take.\n\n| |",
          out);
    for (int i = 0; i < count; i++)
        if (runs[i].timed) fprintf(out, " %s |", runs[i].scene->name);
    fputs("\n|---|", out);
    for (int i = 0; i < count; i++)
        if (runs[i].timed) fputs("---|", out);
    fputc('\n', out);
    for (int which = 0; which < ESTIMATORS; which++) report_times_row(out, runs, count, which);
    fputc('\n', out);
}

/* ---- Checks ---------------------------------------------------------------------------------------------------- */

typedef struct check_list {
    FILE *out;
    int failed;
} check_list;

/* BELOW: a claim of the paper, judged by the whole interval. */
typedef enum check_kind { BELOW, AT_MOST } check_kind;

static void check(check_list *list, const char *scene, const char *what, figure value, check_kind kind, double limit)
{
    const bool fails = kind == BELOW ? value.value - value.half_width > limit : value.value > limit;
    const bool holds = kind == BELOW ? value.value + value.half_width < limit : !fails;
    fprintf(list->out, "| %s | %s | %.3f", scene, what, value.value);
    if (value.half_width > 0.0) fprintf(list->out, " ± %.3f", value.half_width);
    fprintf(list->out, " | %s %.2f | %s |\n", kind == BELOW ? "<" : "≤", limit,
            holds   ? "holds"
            : fails ? "**does not hold**"
                    : "undecided: the interval contains it");
    list->failed += fails;
}

/* Two estimators are compared where both count, and bdpt's blind spots are no reason to look at fewer of ovcm and
 * vcm. */
static figure ratio_where_both_count(const scene_run *run, int a, int b)
{
    const estimator_run *x = &run->runs[a], *y = &run->runs[b];
    return a == BDPT || b == BDPT ? figure_of_ratio(x->common, y->common) : figure_of_ratio(x->merging, y->merging);
}

static void check_ratio(check_list *list, const scene_run *run, int which, check_kind kind, double limit)
{
    char what[64];
    snprintf(what, sizeof what, "σ̄(ovcm) / σ̄(%s)", estimators[which].name);
    check(list, run->scene->name, what, ratio_where_both_count(run, OVCM, which), kind, limit);
}

static void check_deviations(check_list *list, const scene_run *run)
{
    check_ratio(list, run, BDPT, BELOW, 1.0);
    check_ratio(list, run, VCM, BELOW, 1.0);
    if (run->scene->without_specular) /* the scene of the paper's figure 2 */
        check_ratio(list, run, VCM_STAR, AT_MOST, 1.05);
    const char *what =
        run->first_precise == PATH ? "widest interval of a σ̄, %" : "widest interval of a σ̄ but path's and ppm's, %";
    check(list, run->scene->name, what, (figure){100.0 * report_widest_interval(run), 0.0}, AT_MOST, 1.0);
}

static void check_times(check_list *list, const scene_run *run)
{
    check(list, run->scene->name, "time of an iteration, ovcm / vcm", (figure){time_over(run, OVCM, VCM), 0.0},
          AT_MOST, 1.03);
    check(list, run->scene->name, "time of an iteration, ovcm / vcm with three sums",
          (figure){time_over(run, OVCM, VCM_SUMS), 0.0}, AT_MOST, 1.03);
    check(list, run->scene->name, "time of an iteration, ovcm / vcm-star",
          (figure){time_over(run, OVCM, VCM_STAR), 0.0}, AT_MOST, 1.0);
    check(list, run->scene->name, "memory, ovcm / vcm", (figure){run->runs[OVCM].memory / run->runs[VCM].memory, 0.0},
          AT_MOST, 1.01);
}

int report_checks(FILE *out, const scene_run *runs, int count)
{
    check_list list = {.out = out};
    fputs("### What it should show\n\n| scene | | value | goal | |\n|---|---|---|---|---|\n", out);
    for (int i = 0; i < count; i++) {
        if (runs[i].rendered) check_deviations(&list, &runs[i]);
        if (runs[i].timed) check_times(&list, &runs[i]);
    }
    fprintf(out, "\n%d of these do not hold.\n", list.failed);
    return list.failed;
}

/* ---- Close-ups ------------------------------------------------------------------------------------------------- */

enum { TILE = 256, GAP = 4 };

typedef struct strip {
    ca_image_layers *layers;
    float *rgb[3];
    uint32_t x; /* where the next tile goes */
} strip;

/* A square of the picture as a tile; `values` are three planes of `plane` floats, or one for a grey tile (plane
 * 0). */
static void add_tile(strip *s, const scene_run *run, const float *values, size_t plane, double left, double top,
                     double side, double scale)
{
    for (uint32_t y = 0; y < TILE; y++)
        for (uint32_t x = 0; x < TILE; x++) {
            const uint32_t px = (uint32_t)(left + side * (x + 0.5) / TILE),
                           py = (uint32_t)(top + side * (y + 0.5) / TILE);
            const size_t from = (size_t)py * run->width + px, to = (size_t)y * s->layers->width + s->x + x;
            for (size_t c = 0; c < 3; c++) s->rgb[c][to] = (float)(scale * (double)values[c * plane + from]);
        }
    s->x += TILE + GAP;
}

/* The close-up's frame in the picture's tile. */
static void add_frame(strip *s, const double closeup[3])
{
    const uint32_t left = (uint32_t)(closeup[0] * TILE), top = (uint32_t)(closeup[1] * TILE);
    const uint32_t side = (uint32_t)(closeup[2] * TILE) - 1;
    for (uint32_t i = 0; i <= side; i++) {
        const uint32_t points[4][2] = {
            {left + i, top}, {left + i, top + side}, {left, top + i}, {left + side, top + i}};
        for (int k = 0; k < 4; k++)
            for (int c = 0; c < 3; c++)
                s->rgb[c][(size_t)points[k][1] * s->layers->width + points[k][0]] = c == 0 ? 1.0f : 0.0f;
    }
}

/* The value that a share of the close-up's pixels stay under, over several images of `count` values. */
static double percentile(double *values, int count, double share)
{
    (void)bench_median(values, count); /* sorts them */
    return values[(int)(share * (count - 1))];
}

static ca_status strip_create(strip *s, uint32_t tiles, ca_error *error)
{
    static const char *const names[3] = {"R", "G", "B"};
    const uint32_t width = tiles * (TILE + GAP) - GAP;
    s->x = 0;
    ca_status status = ca_layers_create(&s->layers, width, TILE, error);
    for (int c = 0; c < 3 && status == CA_OK; c++) {
        status = ca_layers_add(s->layers, names[c], &s->rgb[c], error);
        for (size_t i = 0; status == CA_OK && i < (size_t)width * TILE; i++) s->rgb[c][i] = 1.0f;
    }
    if (status != CA_OK) ca_layers_destroy(s->layers);
    return status;
}

/* One scale for these close-ups: 99 % of their pixels stay below white. */
static double closeup_scale(const scene_run *run, const int *which, int count, const double corner[3],
                            double *scratch)
{
    int values = 0;
    for (int i = 0; i < count; i++)
        for (uint32_t y = (uint32_t)corner[1]; y < (uint32_t)(corner[1] + corner[2]); y++)
            for (uint32_t x = (uint32_t)corner[0]; x < (uint32_t)(corner[0] + corner[2]); x++)
                scratch[values++] = run->runs[which[i]].deviation[(size_t)y * run->width + x];
    return 1.0 / fmax(1e-30, percentile(scratch, values, 0.99));
}

/* What is compared; where path tracing and photon mapping have more noise, they are white. */
enum { SCALED = 4 };

static void fill_strip(strip *s, const scene_run *run, const int *which, int count, double *scratch, float *grey)
{
    const size_t pixels = (size_t)run->width * run->height;
    double corner[3];
    for (int i = 0; i < 3; i++) corner[i] = floor(run->scene->closeup[i] * run->width);
    for (size_t p = 0; p < pixels; p++) scratch[p] = (double)run->picture[pixels + p];
    add_tile(s, run, run->picture, pixels, 0.0, 0.0, run->width,
             0.8 / fmax(1e-30, percentile(scratch, (int)pixels, 0.95)));
    add_frame(s, run->scene->closeup);
    const double scale = closeup_scale(run, which + count - SCALED, SCALED, corner, scratch);
    for (int i = 0; i < count; i++) {
        for (size_t p = 0; p < pixels; p++) grey[p] = (float)run->runs[which[i]].deviation[p];
        add_tile(s, run, grey, 0, corner[0], corner[1], corner[2], scale);
    }
}

ca_status write_closeups(const scene_run *run, const char *folder, ca_error *error)
{
    static const int which[] = {PATH, PPM, BDPT, VCM, VCM_STAR, OVCM};
    enum { COUNT = sizeof which / sizeof which[0] };
    const size_t pixels = (size_t)run->width * run->height;
    char path[1024];
    snprintf(path, sizeof path, "%s/%s.png", folder, run->scene->name);
    strip s;
    double *scratch = malloc(COUNT * pixels * sizeof *scratch);
    float *grey = malloc(pixels * sizeof *grey);
    ca_status status = scratch && grey ? strip_create(&s, 1 + COUNT, error) : ca_fail_memory(error, "the close-ups");
    if (status == CA_OK) {
        fill_strip(&s, run, which, COUNT, scratch, grey);
        status = ca_layers_write(s.layers, path, 0.0f, error);
        ca_layers_destroy(s.layers);
    }
    free(scratch);
    free(grey);
    return status;
}

ca_status write_figure_2(const scene_run *run, const char *folder, ca_error *error)
{
    const size_t pixels = (size_t)run->width * run->height;
    char path[1024];
    snprintf(path, sizeof path, "%s/%s-50.png", folder, run->scene->name);
    strip s;
    double *scratch = malloc(pixels * sizeof *scratch);
    ca_status status = scratch ? strip_create(&s, 3, error) : ca_fail_memory(error, "figure 2");
    if (status == CA_OK) {
        for (size_t p = 0; p < pixels; p++) scratch[p] = (double)run->picture[pixels + p];
        const double scale = 0.8 / fmax(1e-30, percentile(scratch, (int)pixels, 0.95));
        for (int i = 0; i < 3; i++) add_tile(&s, run, run->fifty[i], pixels, 0.0, 0.0, run->width, scale);
        status = ca_layers_write(s.layers, path, 0.0f, error);
        ca_layers_destroy(s.layers);
    }
    free(scratch);
    return status;
}
