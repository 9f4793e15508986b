/* Figure 4 of paper 000's list: the recommended numbers of rays against a grid of measured ones.
 *
 * What is compared is variance x time of an iteration: the mean over pixels of the sample variance of an iteration's
 * luminance, times the processor seconds of an iteration. Every setting is measured in repeats with random numbers of
 * their own, which are made in turns, so that what the machine does in the meantime meets all of them; intervals are
 * bootstrapped over repeats. */
#define _POSIX_C_SOURCE 200809L
#include "paper_000.h"

#include "bench_support.h"
#include "sampling/sampler.h"

#include <math.h>
#include <stdlib.h>
#include <time.h>

enum { FILM_SIDE = 64, MAX_REPEATS = 6, BOOTSTRAPS = 2000, SCAN_PASSES = 3, MAX_FINALISTS = 4 };

/* Numbers of the grid. All of rows FIRST_ROW to END_ROW and of columns up to END_COLUMN are measured, of the others
 * what lies next to the best, so that it does not end up at the grid's edge. */
enum { GRID_ROWS = 10, GRID_COLUMNS = 7, CELLS = GRID_ROWS * GRID_COLUMNS };
enum { FIRST_ROW = 3, END_ROW = 9, END_COLUMN = 6 };
static const uint32_t grid_light[GRID_ROWS] = {319,   1000,   3190,   10000,   31300,
                                                 97900, 306000, 959000, 3000000, 9400000};
static const uint32_t grid_camera[GRID_COLUMNS] = {1, 3, 10, 31, 96, 300, 939};

/* All of a small film: pixels of all kinds. With the paper's radius, which holds hundreds of photons, it is a smaller
 * one. */
static ca_render_settings whole_film(const paper_000_scene *scene, uint32_t light_paths, uint32_t camera_paths,
                                     uint64_t seed)
{
    ca_render_settings s = paper_000_settings(scene, light_paths, camera_paths, seed);
    s.has_crop = false;
    s.width = s.height = scene == &paper_000_scenes[0] ? FILM_SIDE / 2 : FILM_SIDE;
    return s;
}

/* Of a repeat: passes of the dearest settings of the grid take a minute, and two of them must do. */
static const double ENOUGH_SECONDS = 4.0;

/* A setting and what its repeats gave. */
typedef struct ray_setting {
    uint32_t light_paths, camera_paths;
    const char *rays; /* file with a map of numbers; NULL: the two above, uniform */
    int repeats;
    double variance[MAX_REPEATS], seconds[MAX_REPEATS]; /* of an iteration */
} ray_setting;

/* ---- One repeat ------------------------------------------------------------------------------------------------ */

typedef struct pass_clock {
    double first, last; /* processor time after the first and the last pass */
    uint32_t passes, least_passes;
    double least_seconds;
} pass_clock;

static double processor_seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static bool count_pass(const ca_render_progress *progress, void *user)
{
    pass_clock *clock = user;
    clock->last = processor_seconds();
    clock->passes = progress->passes_done;
    if (clock->passes == 1) clock->first = clock->last;
    const double seconds = clock->last - clock->first;
    if (clock->passes >= 2 && seconds > ENOUGH_SECONDS) return false;
    return clock->passes < clock->least_passes || seconds < clock->least_seconds;
}

static double mean_variance(const ca_image_layers *image)
{
    const float *deviation = ca_image_channel(image, "StandardDeviation.Y");
    uint32_t width, height;
    double sum = 0.0;
    ca_image_size(image, &width, &height);
    const size_t count = (size_t)width * height;
    for (size_t i = 0; i < count; i++) sum += (double)deviation[i] * (double)deviation[i];
    return sum / (double)count;
}

/* At least so many passes and so many seconds after the first of them. */
static void repeat(const paper_000_scene *desc, const ca_scene *scene, ray_setting *setting, uint32_t passes,
                   double seconds, uint64_t seed)
{
    pass_clock clock = {.least_passes = passes, .least_seconds = seconds};
    ca_render_settings s = whole_film(desc, setting->light_paths, setting->camera_paths, seed);
    ca_image_layers *image;
    ca_error error;
    s.seconds = 1e9;
    s.rays = setting->rays;
    if (setting->rays) s.light_paths = s.camera_paths = 0;
    s.progress = count_pass;
    s.progress_user = &clock;
    if (ca_render(scene, &s, &image, NULL, &error) != CA_OK) bench_die(desc->name, &error);
    setting->variance[setting->repeats] = mean_variance(image);
    setting->seconds[setting->repeats] = (clock.last - clock.first) / (clock.passes - 1);
    setting->repeats++;
    ca_image_release(image);
}

/* ---- Statistics ------------------------------------------------------------------------------------------------ */

static double cost_of(const ray_setting *setting)
{
    return paper_mean(setting->variance, (size_t)setting->repeats) *
           paper_mean(setting->seconds, (size_t)setting->repeats);
}

static double resampled_cost(const ray_setting *setting, uint64_t *state)
{
    double variance = 0.0, seconds = 0.0;
    for (int i = 0; i < setting->repeats; i++) {
        const uint32_t pick = (uint32_t)(ca_pcg_permute(++*state) >> 33) % (uint32_t)setting->repeats;
        variance += setting->variance[pick];
        seconds += setting->seconds[pick];
    }
    return variance * seconds / ((double)setting->repeats * setting->repeats);
}

static int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Efficiency of a setting over that of another, with its 95 % interval. */
typedef struct efficiency {
    double ratio, low, high;
} efficiency;

static efficiency efficiency_over(const ray_setting *setting, const ray_setting *other)
{
    static double ratios[BOOTSTRAPS];
    uint64_t state = 1;
    for (int i = 0; i < BOOTSTRAPS; i++) {
        const double b = resampled_cost(other, &state);
        ratios[i] = b / resampled_cost(setting, &state);
    }
    qsort(ratios, BOOTSTRAPS, sizeof ratios[0], ascending);
    return (efficiency){cost_of(other) / cost_of(setting), ratios[BOOTSTRAPS / 40],
                        ratios[BOOTSTRAPS - 1 - BOOTSTRAPS / 40]};
}

/* ---- The grid -------------------------------------------------------------------------------------------------- */

/* What is measured of a scene. */
typedef struct contest {
    const paper_000_scene *desc;
    ca_scene *scene;
    ray_setting grid[CELLS]; /* without repeats: not measured */
    ray_setting recommended, map, papers;
    ray_setting *best; /* of the grid */
    uint64_t seed;     /* of the next repeat */
} contest;

/* A setting once, roughly. */
static void scan_cell(contest *c, int row, int column)
{
    repeat(c->desc, c->scene, &c->grid[row * GRID_COLUMNS + column], SCAN_PASSES, 0.5, c->seed++);
}

static int best_cell(const contest *c)
{
    int best = -1;
    for (int i = 0; i < CELLS; i++)
        if (c->grid[i].repeats > 0 && (best < 0 || cost_of(&c->grid[i]) < cost_of(&c->grid[best]))) best = i;
    return best;
}

/* What lies around a cell and was not measured; false: nothing. */
static bool scan_around(contest *c, int cell)
{
    const int row = cell / GRID_COLUMNS, column = cell % GRID_COLUMNS;
    bool any = false;
    for (int i = row - 1; i <= row + 1; i++)
        for (int j = column - 1; j <= column + 1; j++) {
            if (i < 0 || i >= GRID_ROWS || j < 0 || j >= GRID_COLUMNS) continue;
            if (c->grid[i * GRID_COLUMNS + j].repeats > 0) continue;
            scan_cell(c, i, j);
            any = true;
        }
    return any;
}

static void scan(contest *c)
{
    for (int i = 0; i < CELLS; i++)
        c->grid[i] =
            (ray_setting){.light_paths = grid_light[i / GRID_COLUMNS], .camera_paths = grid_camera[i % GRID_COLUMNS]};
    for (int row = FIRST_ROW; row < END_ROW; row++)
        for (int column = 0; column < END_COLUMN; column++) scan_cell(c, row, column);
    while (scan_around(c, best_cell(c)))
        ;
}

static int by_cost(const void *a, const void *b)
{
    const double x = cost_of(*(ray_setting *const *)a), y = cost_of(*(ray_setting *const *)b);
    return (x > y) - (x < y);
}

/* The best of the scan, the recommendations and the paper's numbers, in turns. What the scan found of the finalists
 * is dropped: the lucky ones are among them. */
static void run_finals(contest *c, bool quick)
{
    ray_setting *order[CELLS];
    size_t measured = 0;
    for (int i = 0; i < CELLS; i++)
        if (c->grid[i].repeats > 0) order[measured++] = &c->grid[i];
    qsort(order, measured, sizeof order[0], by_cost);
    ray_setting *finalists[MAX_FINALISTS + 3] = {&c->recommended, &c->map, &c->papers};
    for (int i = 0; i < MAX_FINALISTS; i++) {
        order[i]->repeats = 0;
        finalists[3 + i] = order[i];
    }
    const int repeats = quick ? 3 : MAX_REPEATS;
    for (int r = 0; r < repeats; r++)
        for (int i = 0; i < MAX_FINALISTS + 3; i++)
            repeat(c->desc, c->scene, finalists[i], 4, quick ? 0.5 : 1.5, c->seed++);
    qsort(order, MAX_FINALISTS, sizeof order[0], by_cost);
    c->best = order[0];
}

/* ---- The recommendation ---------------------------------------------------------------------------------------- */

enum { PILOT_ITERATIONS = 24 };

/* What `caustica noise` recommends after a measurement at fewer paths; the map goes to `path`. */
static ca_noise_recommendation recommend(contest *c, const char *path)
{
    ca_render_settings s = whole_film(c->desc, PAPER_000_PILOT_LIGHT, PAPER_000_PILOT_CAMERA, c->seed++);
    ca_noise_recommendation r;
    ca_image_layers *image;
    ca_noise *noise;
    ca_error error;
    if (ca_noise_measure(c->scene, &s, PILOT_ITERATIONS, &noise, &image, NULL, &error) != CA_OK ||
        ca_noise_recommend(noise, c->scene, &s, NULL, image, &r, &error) != CA_OK ||
        ca_image_save(image, path, 0.0f, &error) != CA_OK)
        bench_die(c->desc->name, &error);
    ca_image_release(image);
    ca_noise_release(noise);
    c->recommended =
        (ray_setting){.light_paths = r.uniform.light_paths, .camera_paths = (uint32_t)lround(r.uniform.camera_paths)};
    c->map = (ray_setting){.light_paths = r.best.light_paths, .rays = path};
    c->papers = (ray_setting){.light_paths = PAPER_000_LIGHT, .camera_paths = PAPER_000_CAMERA};
    return r;
}

/* ---- From beginning to end ------------------------------------------------------------------------------------- */

static ca_image_layers *auto_render(contest *c, double seconds, double *processor, ca_render_statistics *statistics)
{
    ca_render_settings s = whole_film(c->desc, 0, 0, c->seed++);
    ca_image_layers *image;
    ca_error error;
    s.seconds = seconds;
    s.rays = "auto";
    const double begin = processor_seconds();
    if (ca_render(c->scene, &s, &image, statistics, &error) != CA_OK) bench_die(c->desc->name, &error);
    *processor = processor_seconds() - begin;
    return image;
}

static double luminance_at(const ca_image_layers *image, size_t pixel)
{
    static const char *const names[3] = {"R", "G", "B"};
    static const double weights[3] = {0.2126, 0.7152, 0.0722};
    double sum = 0.0;
    for (int i = 0; i < 3; i++) sum += weights[i] * (double)ca_image_channel(image, names[i])[pixel];
    return sum;
}

/* Renders of `seconds` with --rays auto: variance of the image x processor seconds, from the differences of two at a
 * time, which share nothing: what the renders say of themselves is not used. */
static void run_auto(contest *c, ray_setting *setting, double seconds, int pairs, ca_render_statistics *statistics)
{
    *setting = (ray_setting){.repeats = 0};
    for (int i = 0; i < pairs; i++) {
        double processor[2], sum = 0.0;
        ca_image_layers *a = auto_render(c, seconds, &processor[0], statistics);
        ca_image_layers *b = auto_render(c, seconds, &processor[1], statistics);
        uint32_t width, height;
        ca_image_size(a, &width, &height);
        const size_t count = (size_t)width * height;
        for (size_t p = 0; p < count; p++) {
            const double difference = luminance_at(a, p) - luminance_at(b, p);
            sum += 0.5 * difference * difference;
        }
        setting->variance[i] = sum / (double)count;
        setting->seconds[i] = 0.5 * (processor[0] + processor[1]);
        setting->repeats++;
        ca_image_release(a);
        ca_image_release(b);
    }
}

/* ---- The report ------------------------------------------------------------------------------------------------ */

static void print_cell(FILE *out, const contest *c, const ray_setting *s)
{
    if (s->repeats == 0)
        fputs(" – |", out);
    else
        fprintf(out, s->repeats > 1 ? " **%.3f** |" : " (%.3f) |", cost_of(c->best) / cost_of(s));
}

static void print_grid(const paper_report *report, const contest *c)
{
    fprintf(report->out,
            "\n**%s**, efficiency over the best of the grid; in brackets one scan of each, else %d repeats; –: not "
            "measured, far from the best:\n\n| N_F \\ N_B |",
            c->desc->name, c->best->repeats);
    for (int j = 0; j < GRID_COLUMNS; j++) fprintf(report->out, " %u |", grid_camera[j]);
    fprintf(report->out, "\n|---|");
    for (int j = 0; j < GRID_COLUMNS; j++) fprintf(report->out, "---|");
    for (int i = 0; i < GRID_ROWS; i++) {
        fprintf(report->out, "\n| %u |", grid_light[i]);
        for (int j = 0; j < GRID_COLUMNS; j++) print_cell(report->out, c, &c->grid[i * GRID_COLUMNS + j]);
    }
    fprintf(report->out, "\n\n");
}

static void print_row(const paper_report *report, const contest *c, const char *what, const ray_setting *s,
                      const char *numbers)
{
    const efficiency e = efficiency_over(s, c->best);
    fprintf(report->out, "| %s | %s | %s | %.3f (%.3f to %.3f) |\n", c->desc->name, what, numbers, e.ratio, e.low,
            e.high);
}

/* There is no N_B below 1. */
static bool is_inside(const contest *c, const ray_setting *s)
{
    const int cell = (int)(s - c->grid), row = cell / GRID_COLUMNS, column = cell % GRID_COLUMNS;
    return row > 0 && row < GRID_ROWS - 1 && column < GRID_COLUMNS - 1;
}

typedef struct verdicts {
    int maps_better, much_better_than_paper;
} verdicts;

static void report_contest(paper_report *report, contest *c, const ca_noise_recommendation *r,
                           const ray_setting *whole, const ca_render_statistics *statistics, verdicts *v)
{
    char text[160];
    print_grid(report, c);
    fprintf(report->out,
            "| scene | numbers | N_F, N_B | efficiency over the grid's best (95 %%) |\n|---|---|---|---|\n");
    snprintf(text, sizeof text, "%u, %u", c->best->light_paths, c->best->camera_paths);
    print_row(report, c, "grid's best", c->best, text);
    snprintf(text, sizeof text, "%u, %u", c->recommended.light_paths, c->recommended.camera_paths);
    print_row(report, c, "recommended, uniform", &c->recommended, text);
    snprintf(text, sizeof text, "%u, %.3g (%u to %u)", r->best.light_paths, r->best.camera_paths,
             r->fewest_camera_paths, r->most_camera_paths);
    print_row(report, c, "recommended, map", &c->map, text);
    snprintf(text, sizeof text, "%u, %u", c->papers.light_paths, c->papers.camera_paths);
    print_row(report, c, "the paper's", &c->papers, text);
    snprintf(text, sizeof text, "%u, %.3g; pilot %.1f s", statistics->numbers_of_rays.light_paths,
             statistics->numbers_of_rays.camera_paths, statistics->numbers_of_rays.pilot_seconds);
    print_row(report, c, "`--rays auto`, whole render", whole, text);

    const double map = efficiency_over(&c->map, c->best).ratio;
    const double automatic = efficiency_over(whole, c->best).ratio, papers = efficiency_over(whole, &c->papers).ratio;
    fprintf(report->out, "\n`--rays auto` over the paper's numbers: %.2f.\n", papers);
    paper_expect(report, is_inside(c, c->best), c->best->camera_paths, "no number at the edge",
                 "figure 4, %s: the best of the grid lies inside of it; N_B", c->desc->name);
    paper_expect(report, map >= 0.9, map, ">= 0.90",
                 "figure 4, %s: efficiency of the recommendation over the grid's best", c->desc->name);
    paper_expect(report, automatic >= 0.85, automatic, ">= 0.85",
                 "figure 4, %s: --rays auto, pilot included, over the grid's best", c->desc->name);
    v->maps_better += map > 1.0;
    v->much_better_than_paper += papers >= 2.0;
}

void paper_000_grid(paper_report *report)
{
    const bool quick = report->quick;
    const char *path = "paper-000-rays.exr";
    verdicts v = {0};
    fprintf(
        report->out,
        "### Figure 4: recommended numbers against a measured grid\n\n"
        "Processor seconds of an iteration x mean variance of a pixel's luminance; %s render with `--rays auto`.\n",
        quick ? "a short" : "a 60 s");
    for (int i = 0; i < PAPER_000_SCENES; i++) {
        static contest c;
        ray_setting whole;
        ca_render_statistics statistics = {.size = sizeof statistics};
        c = (contest){.desc = &paper_000_scenes[i], .seed = 1000};
        if (paper_time_is_up(report, c.desc->name)) return;
        c.scene = paper_000_load(c.desc);
        const ca_noise_recommendation r = recommend(&c, path);
        scan(&c);
        run_finals(&c, quick);
        run_auto(&c, &whole, quick ? 3.0 : 60.0, 1, &statistics);
        report_contest(report, &c, &r, &whole, &statistics, &v);
        ca_scene_release(c.scene);
        remove(path);
    }
    paper_expect(report, v.maps_better >= 3, v.maps_better, ">= 3",
                 "figure 4: scenes on which the map is better than the grid's best");
    paper_expect(report, v.much_better_than_paper >= 2, v.much_better_than_paper, ">= 2",
                 "figure 4: scenes on which --rays auto is at least twice as efficient as 300,000, 100");
}
