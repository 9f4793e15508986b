/* Scenes and measurements of paper 000's figures. */
#include "base/clock.h"
#include "bench_support.h"
#include "paper_000.h"
#include "render/noise.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- Scenes ---------------------------------------------------------------------------------------------------- */

const paper_000_scene paper_000_scenes[PAPER_000_SCENES] = {
    {.name = "cornell-point",
     .file = "paper-000/cornell-point.xml",
     .integrator = "bdpm:camera_diffuse_depth=1,merges=last",
     .defines = {{"light_y", "0.15"}},
     .define_count = 1,
     .radius = 0.03464, /* 1/120 of the box's diagonal */
     .width = 512,
     .height = 512,
     .region = {106, 456, 138, 488},
     .dominant = "camera"},
    {.name = "water-caustic",
     .file = "paper-000/water-caustic.xml",
     .integrator = "bdpm",
     .radius = 0.01,
     .width = 64,
     .height = 64,
     .region = {16, 16, 48, 48},
     .dominant = "light"},
    {.name = "blurred-tiles",
     .file = "paper-000/blurred-tiles.xml",
     .integrator = "bdpm",
     .radius = 0.05,
     .width = 64,
     .height = 64,
     .region = {16, 16, 48, 48},
     .dominant = "camera"},
    {.name = "few-merges",
     .file = "paper-000/few-merges.xml",
     .integrator = "bdpm",
     .radius = 0.0005,
     .width = 64,
     .height = 64,
     .region = {16, 16, 48, 48},
     .dominant = "pair"},
    {.name = "behind-glass",
     .file = "paper-000/behind-glass.xml",
     .integrator = "bdpm",
     .radius = 0.01,
     .width = 64,
     .height = 64,
     .region = {16, 16, 48, 48},
     .dominant = NULL},
};

ca_scene *paper_000_load(const paper_000_scene *scene)
{
    return paper_scene(scene->file, scene->defines, scene->define_count);
}

ca_render_settings paper_000_settings(const paper_000_scene *scene, uint32_t light_paths, uint32_t camera_paths,
                                      uint64_t seed)
{
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.integrator = scene->integrator;
    settings.radius = scene->radius;
    settings.alpha = 0.0;
    settings.has_alpha = true;
    settings.width = scene->width;
    settings.height = scene->height;
    settings.has_crop = true;
    memcpy(settings.crop, scene->region, sizeof settings.crop);
    settings.light_paths = light_paths;
    settings.camera_paths = camera_paths;
    settings.seed = seed;
    settings.has_seed = true;
    settings.threads = 1;
    return settings;
}

/* ---- Measurements ---------------------------------------------------------------------------------------------- */

static ca_pair_film empty_film(const paper_000_run *run)
{
    ca_pair_film film;
    ca_error error;
    if (ca_pair_film_create(&film, run->scene.region, run->light_paths, run->camera_paths, &error) != CA_OK)
        bench_die(run->scene.name, &error);
    return film;
}

/* Seconds of one iteration; its paths are nobody else's. */
static double time_iteration(const ca_scene *scene, const paper_000_run *run, uint64_t seed)
{
    enum { TRIED = 2 };
    ca_render_settings settings = paper_000_settings(&run->scene, run->light_paths, run->camera_paths, seed);
    ca_noise *noise;
    ca_error error;
    settings.threads = 0;
    const double start = ca_clock_seconds();
    if (ca_noise_measure(scene, &settings, TRIED, &noise, NULL, NULL, &error) != CA_OK)
        bench_die(run->scene.name, &error);
    const double seconds = ca_clock_seconds() - start;
    ca_noise_release(noise);
    return seconds / TRIED;
}

/* What fits into the measurement's share of the time, at least the two that a variance takes. */
static void fit_iterations(paper_report *report, const ca_scene *scene, paper_000_run *run, uint64_t seed)
{
    enum { LEAST = 2 };
    const double end = ca_clock_seconds() + paper_next_seconds(report);
    if (isinf(end) || run->iterations <= LEAST) return;
    const double each = PAPER_000_GROUPS * time_iteration(scene, run, seed);
    const double fit = fmax(LEAST, (end - ca_clock_seconds()) / each);
    if (fit >= run->iterations) return;
    run->iterations = (uint32_t)fit;
    paper_cut(report);
}

static void measure_group(const ca_scene *scene, paper_000_run *run, int group, uint64_t seed)
{
    ca_render_settings settings = paper_000_settings(&run->scene, run->light_paths, run->camera_paths, seed);
    settings.threads = 0; /* the bits are the same */
    ca_render_statistics statistics = {.size = sizeof statistics};
    ca_noise *noise;
    ca_error error;
    if (ca_noise_measure(scene, &settings, run->iterations, &noise, NULL, &statistics, &error) != CA_OK)
        bench_die(run->scene.name, &error);
    if (statistics.non_finite > 0) fprintf(stderr, "%s: samples that are not finite\n", run->scene.name), exit(1);
    run->groups[group] = noise->film;
    noise->film = (ca_pair_film){0}; /* taken over */
    ca_noise_release(noise);
    ca_pair_film_pool(&run->all, &run->groups[group], 1);
    run->seconds += statistics.seconds;
}

static void keep_the_middle(uint32_t region[4], uint32_t side)
{
    for (int axis = 0; axis < 2; axis++) {
        region[axis] = (region[axis] + region[axis + 2] - side) / 2;
        region[axis + 2] = region[axis] + side;
    }
}

paper_000_run *paper_000_measure(paper_report *report, const paper_000_scene *scene, uint32_t light_paths,
                                 uint32_t camera_paths, uint32_t iterations, uint64_t seed)
{
    paper_000_run *run = paper_need(calloc(1, sizeof *run));
    run->scene = *scene;
    run->light_paths = report->quick ? light_paths / 10 : light_paths;
    run->camera_paths = report->quick ? (camera_paths + 10) / 10 : camera_paths;
    run->iterations = (iterations + PAPER_000_GROUPS - 1) / PAPER_000_GROUPS;
    if (report->quick) keep_the_middle(run->scene.region, 8);
    if (report->quick || run->iterations < 2) run->iterations = 2;
    ca_scene *loaded = paper_000_load(scene);
    fit_iterations(report, loaded, run, seed * 1000 + PAPER_000_GROUPS);
    run->all = empty_film(run);
    for (int g = 0; g < PAPER_000_GROUPS; g++) measure_group(loaded, run, g, seed * 1000 + (uint64_t)g);
    ca_scene_release(loaded);
    fprintf(stderr, "  %s, %u light and %u camera paths: %u iterations, %.0f s\n", scene->name, run->light_paths,
            run->camera_paths, run->iterations * PAPER_000_GROUPS, run->seconds);
    return run;
}

void paper_000_release(paper_000_run *run)
{
    if (!run) return;
    for (int g = 0; g < PAPER_000_GROUPS; g++) ca_pair_film_destroy(&run->groups[g]);
    ca_pair_film_destroy(&run->all);
    free(run);
}

int paper_000_runs_to_come(const paper_report *report, int scenes)
{
    int missing = 0;
    for (int s = 0; s < scenes; s++) missing += !((const paper_000_runs *)report->shared)->at_paper_numbers[s];
    return missing;
}

const paper_000_run *paper_000_paper_run(paper_report *report, int scene)
{
    static const uint32_t iterations[PAPER_000_SCENES] = {240, 200, 200, 300, 200};
    paper_000_run **run = &((paper_000_runs *)report->shared)->at_paper_numbers[scene];
    if (!*run)
        *run = paper_000_measure(report, &paper_000_scenes[scene], PAPER_000_LIGHT, PAPER_000_CAMERA,
                                 iterations[scene], 1);
    return *run;
}

/* ---- Numbers and their errors ---------------------------------------------------------------------------------- */

paper_000_numbers paper_000_estimate(const paper_000_run *run, paper_000_statistic *statistic, const void *what,
                                     int count)
{
    double left_out[PAPER_000_GROUPS][PAPER_000_NUMBERS] = {{0}}, all[PAPER_000_NUMBERS] = {0};
    const double groups = PAPER_000_GROUPS;
    paper_000_numbers numbers = {0};
    ca_pair_film rest = empty_film(run);
    statistic(&run->all, what, all);
    ca_pair_film_pool(&rest, &run->all, 1);
    for (int g = 0; g < PAPER_000_GROUPS; g++) {
        ca_pair_film_pool(&rest, &run->groups[g], -1);
        statistic(&rest, what, left_out[g]);
        ca_pair_film_pool(&rest, &run->groups[g], 1);
    }
    ca_pair_film_destroy(&rest);
    for (int i = 0; i < count; i++) {
        double mean = 0.0, square = 0.0;
        for (int g = 0; g < PAPER_000_GROUPS; g++) mean += left_out[g][i] / groups;
        for (int g = 0; g < PAPER_000_GROUPS; g++) square += (left_out[g][i] - mean) * (left_out[g][i] - mean);
        numbers.of[i] = (ca_noise_value){all[i], sqrt(square * (groups - 1.0) / groups)};
        numbers.corrected[i] = groups * all[i] - (groups - 1.0) * mean;
    }
    return numbers;
}

static void summarise(const ca_pair_film *film, const void *what, double numbers[PAPER_000_NUMBERS])
{
    const paper_000_counts *counts = what;
    const uint32_t rect[4] = {film->x0, film->y0, film->x0 + film->width, film->y0 + film->height};
    const ca_noise_summary s = ca_noise_summarise(film, rect, counts->light_paths, counts->camera_paths);
    numbers[RMS_MEASURED] = s.measured_rms, numbers[ROOT_MEASURED] = sqrt(s.measured);
    numbers[RMS_PREDICTED] = s.predicted_rms, numbers[ROOT_PREDICTED] = sqrt(fmax(0.0, s.predicted));
    numbers[RMS_CAMERA] = s.camera_rms, numbers[ROOT_CAMERA] = sqrt(fmax(0.0, s.camera));
    numbers[RMS_LIGHT] = s.light_rms, numbers[ROOT_LIGHT] = sqrt(fmax(0.0, s.light));
    numbers[RMS_PAIR] = s.pair_rms, numbers[ROOT_PAIR] = sqrt(fmax(0.0, s.pair));
    numbers[RMS_RATIO] = s.measured_rms / s.predicted_rms;
    numbers[ROOT_RATIO] = sqrt(s.measured / s.predicted);
}

paper_000_numbers paper_000_summary(const paper_000_run *run, double light_paths, double camera_paths)
{
    const paper_000_counts counts = {light_paths, camera_paths};
    return paper_000_estimate(run, summarise, &counts, SUMMARY_NUMBERS);
}

ca_noise_value paper_000_ratio(ca_noise_value a, ca_noise_value b)
{
    const double ratio = a.value / b.value;
    return (ca_noise_value){ratio, fabs(ratio) * hypot(a.error / a.value, b.error / b.value)};
}
