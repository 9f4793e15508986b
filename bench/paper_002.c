/* The comparison of paper 002 (Jendersie 2019, figures 2 and 6): bidirectional path tracing and vertex connection and
 * merging with several rules of reuse, at a fixed radius and equal iteration counts, on eight scenes; beside them
 * path tracing and photon mapping.
 *
 *     paper_002 [--quick | --iterations N] [--only SCENE] [--table FILE] [--pictures FOLDER]
 *
 * All estimators get the same random numbers, batch by batch: they trace the same paths and differ in their weights.
 * The report is Markdown; exit status 1 when something that the comparison should show is not so. */
#include "paper_002.h"
#include "bench_support.h"
#include "scene/scene.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { SIDE = 128, THREADS = 2, BATCH_SEED = 20020 };

/* Radii: the default at this size (one side of a pixel where the camera sees something), rounded.
 * Iterations: what intervals of 1 % take, rounded up; vcm in Veach's room takes most. */
static const comparison_scene scenes[] = {
    {.name = "veach-bidir",
     .file = "veach-bidir/scene.xml",
     .what = "Veach's room; the pixels of the egg and of the lamp are left out",
     .shared = true,
     .without_specular = true,
     .iterations = 960,
     .radius = 0.08,
     .closeup = {0.05, 0.1, 0.5}},
    {.name = "water-caustic",
     .file = "water-caustic/scene.xml",
     .what = "a caustic under water, seen through water; bdpt counts above the water only",
     .shared = true,
     .iterations = 360,
     .radius = 0.02,
     .closeup = {0.2, 0.15, 0.5}},
    {.name = "small-light-far",
     .file = "small-light-far/small-light-far.xml",
     .what = "a small light, far away",
     .iterations = 100,
     .radius = 0.035,
     .closeup = {0.25, 0.25, 0.5}},
    {.name = "rough-glass",
     .file = "rough-glass/rough-glass.xml",
     .what = "light through rough glass",
     .iterations = 400,
     .radius = 0.035,
     .closeup = {0.25, 0.25, 0.5}},
    {.name = "long-diffuse",
     .file = "long-diffuse/long-diffuse.xml",
     .what = "light that arrives after many diffuse bounces",
     .iterations = 560,
     .radius = 0.025,
     .closeup = {0.25, 0.25, 0.5}},
    {.name = "bare-wall",
     .file = "weights/bare-wall.xml",
     .what = "a bare wall: next event is almost without noise",
     .iterations = 100,
     .radius = 0.012,
     .closeup = {0.25, 0.25, 0.5}},
    {.name = "glass-balls",
     .file = "paper-002/glass-balls.xml",
     .what = "glass balls in a box with a small lamp, after the scene of Hachisuka that the paper names",
     .iterations = 200,
     .radius = 0.02,
     .closeup = {0.25, 0.45, 0.5}},
    {.name = "living-room",
     .file = "paper-002/living-room.xml",
     .what = "a furnished room, of the kind of the paper's PBRT scenes: light from a window and a bulb in glass",
     .iterations = 200,
     .radius = 0.04,
     .closeup = {0.25, 0.25, 0.5}},
};
enum { SCENES = sizeof scenes / sizeof scenes[0] };

typedef struct options {
    uint32_t iterations; /* 0: as the scene says */
    const char *only, *table, *pictures;
} options;

static _Noreturn void die_of_memory(void)
{
    fputs("paper_002: out of memory\n", stderr);
    exit(1);
}

static void *need(size_t count, size_t size)
{
    void *memory = calloc(count, size);
    if (!memory) die_of_memory();
    return memory;
}

/* ---- Rendering ------------------------------------------------------------------------------------------------- */

static ca_render_settings settings_of(const scene_run *run, int which, uint32_t iterations, uint64_t seed)
{
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.integrator = run->runs[which].integrator;
    settings.sampler = "independent";
    settings.samples_per_pixel = iterations;
    settings.seed = seed;
    settings.has_seed = true;
    settings.threads = THREADS;
    settings.width = run->width;
    settings.height = run->height;
    return settings;
}

static double luminance_at(const float *const channels[3], size_t pixel)
{
    return 0.2126 * (double)channels[0][pixel] + 0.7152 * (double)channels[1][pixel] +
           0.0722 * (double)channels[2][pixel];
}

/* Keeps a batch's statistics; estimators that merge find all light and are what the picture is made of. */
static void keep_batch(scene_run *run, int which, uint32_t batch, const ca_image_layers *image)
{
    static const char *const names[3] = {"R", "G", "B"};
    const float *channels[3], *deviation = ca_image_channel(image, "StandardDeviation.Y");
    for (int c = 0; c < 3; c++) channels[c] = ca_image_channel(image, names[c]);
    const size_t pixels = (size_t)run->width * run->height;
    batches *b = &run->runs[which].samples;
    const double n = b->iterations;
    for (size_t p = 0; p < pixels; p++) {
        const double mean = luminance_at(channels, p);
        const double variance = (double)deviation[p] * (double)deviation[p] * (n - 1.0) / n;
        b->mean[p * BATCHES + batch] = mean;
        b->mean_square[p * BATCHES + batch] = variance + mean * mean;
        if (which < VCM) continue;
        for (size_t c = 0; c < 3; c++)
            run->picture[c * pixels + p] += channels[c][p] / (float)(BATCHES * (ESTIMATORS - VCM));
    }
}

static void render_batch(const ca_scene *scene, scene_run *run, int which, uint32_t batch)
{
    const uint32_t iterations = run->iterations / BATCHES;
    const ca_render_settings settings = settings_of(run, which, iterations, BATCH_SEED + batch);
    ca_image_layers *image;
    ca_render_statistics statistics = {.size = sizeof statistics};
    ca_error error;
    if (ca_render(scene, &settings, &image, &statistics, &error) != CA_OK) bench_die(settings.integrator, &error);
    if (statistics.non_finite > 0) {
        fprintf(stderr, "%s, %s: samples that are not finite\n", run->scene->name, settings.integrator);
        exit(1);
    }
    run->runs[which].seconds[batch] = statistics.seconds / iterations;
    keep_batch(run, which, batch, image);
    ca_image_release(image);
}

/* Is the surface glass or metal? */
static bool is_specular(const ca_scene *scene, uint32_t id)
{
    const ca_material *material = &scene->materials[id];
    if (material->kind == CA_MATERIAL_TWOSIDED) material = &scene->materials[material->as.twosided.front];
    return material->kind == CA_MATERIAL_DIELECTRIC || material->kind == CA_MATERIAL_ROUGH_DIELECTRIC ||
           material->kind == CA_MATERIAL_CONDUCTOR || material->kind == CA_MATERIAL_ROUGH_CONDUCTOR;
}

/* Marks the pixels that one of 9 x 9 rays over the filter's support shows to be glass or metal. */
static void leave_specular_out(const ca_scene *scene, scene_run *run)
{
    enum { RAYS = 9 };
    const ca_camera camera = ca_scene_camera(scene, run->width, run->height);
    const float step = scene->desc.film.filter.radius / (RAYS / 2);
    for (uint32_t p = 0; p < run->width * run->height; p++)
        for (int i = 0; i < RAYS * RAYS && !run->left_out[p]; i++) {
            const ca_vec2 film = {(float)(p % run->width) + 0.5f + (float)(i % RAYS - RAYS / 2) * step,
                                  (float)(p / run->width) + 0.5f + (float)(i / RAYS - RAYS / 2) * step};
            const ca_camera_ray ray = ca_camera_sample_ray(&camera, film, (ca_vec2){0.5f, 0.5f});
            ca_hit hit;
            if (ca_accel_intersect(scene->accel, ray.origin, ray.direction, ray.t_min, ray.t_max, &hit))
                run->left_out[p] = is_specular(scene, scene->shapes[hit.shape].material);
        }
}

/* Marks the pixels that may see an emitter's own surface: what they show of it is the same noise in every estimator,
 * and that of one bright lamp, a part of a pixel large, drowns the whole picture's. Points of the emitter that the
 * camera sees, with the filter's support around them. */
static void leave_emitters_out(const ca_scene *scene, scene_run *run)
{
    enum { POINTS = 4096 };
    const ca_camera camera = ca_scene_camera(scene, run->width, run->height);
    const ca_sampler sampler = {.kind = CA_SAMPLER_INDEPENDENT};
    const float reach = scene->desc.film.filter.radius;
    for (uint32_t l = 0; l < scene->light_count; l++)
        for (uint32_t i = 0; scene->lights[l].kind == CA_LIGHT_AREA && i < POINTS; i++) {
            const ca_stream stream = ca_stream_start(&sampler, l, i);
            ca_surface surface;
            ca_camera_direct direct;
            ca_shape_sample_area(scene->lights[l].as.area.shape, ca_sample_2d(&stream, CA_DIM_LIGHT_POSITION),
                                 &surface);
            if (!ca_camera_sample_direct(&camera, surface.position, (ca_vec2){0.5f, 0.5f}, reach, &direct)) continue;
            if (!ca_accel_visible(scene->accel, surface.position, surface.position_error, surface.ng, direct.position,
                                  (ca_vec3){0}, (ca_vec3){0}))
                continue;
            for (uint32_t p = 0; p < run->width * run->height; p++)
                run->left_out[p] |= fabsf(direct.film_position.x - 0.5f - (float)(p % run->width)) <= reach &&
                                    fabsf(direct.film_position.y - 0.5f - (float)(p / run->width)) <= reach;
        }
}

/* Figure 2: the same 50 iterations of three estimators. */
static void render_fifty(const ca_scene *scene, scene_run *run)
{
    static const int which[3] = {BDPT, VCM, OVCM};
    static const char *const names[3] = {"R", "G", "B"};
    const size_t pixels = (size_t)run->width * run->height;
    for (int i = 0; i < 3; i++) {
        const ca_render_settings settings = settings_of(run, which[i], 50, BATCH_SEED);
        ca_image_layers *image;
        ca_error error;
        if (ca_render(scene, &settings, &image, NULL, &error) != CA_OK) bench_die(settings.integrator, &error);
        run->fifty[i] = need(3 * pixels, sizeof *run->fifty[i]);
        for (size_t c = 0; c < 3; c++)
            memcpy(run->fifty[i] + c * pixels, ca_image_channel(image, names[c]), pixels * sizeof *run->fifty[i]);
        ca_image_release(image);
    }
}

static void render_scene(scene_run *run)
{
    ca_error error;
    ca_scene *scene;
    if (ca_scene_load(run->path, NULL, 0, &scene, &error) != CA_OK) bench_die(run->path, &error);
    const size_t pixels = (size_t)run->width * run->height;
    run->picture = need(3 * pixels, sizeof *run->picture);
    run->left_out = need(pixels, sizeof *run->left_out);
    leave_emitters_out(scene, run);
    if (run->scene->without_specular) leave_specular_out(scene, run);
    for (int which = 0; which < ESTIMATORS; which++)
        if (!batches_create(&run->runs[which].samples, run->width, run->height, run->iterations / BATCHES))
            die_of_memory();
    for (uint32_t batch = 0; batch < BATCHES; batch++) /* in turns, so that a slow minute slows all */
        for (uint32_t turn = 0; turn < ESTIMATORS; turn++)
            render_batch(scene, run, (int)((turn + batch) % ESTIMATORS), batch);
    if (run->scene->without_specular) render_fifty(scene, run);
    ca_scene_release(scene);
    run->rendered = true;
}

/* ---- Statistics ------------------------------------------------------------------------------------------------ */

/* Mean of the estimators that find all light, batch by batch: the longest run there is. */
static double *reference_of(const scene_run *run)
{
    const size_t values = (size_t)run->width * run->height * BATCHES;
    double *reference = need(values, sizeof *reference);
    for (int which = VCM; which < ESTIMATORS; which++)
        for (size_t i = 0; i < values; i++) reference[i] += run->runs[which].samples.mean[i] / (ESTIMATORS - VCM);
    return reference;
}

/* path and photon mapping against ovcm, where both are right. */
static void compare_others(scene_run *run, const bootstrap_table *table)
{
    const size_t pixels = (size_t)run->width * run->height;
    bool *both = need(pixels, sizeof *both);
    for (int which = PATH; which < BDPT; which++) {
        estimator_run *r = &run->runs[which];
        size_t count = 0;
        for (size_t p = 0; p < pixels; p++) count += both[p] = r->counts[p] && run->runs[OVCM].counts[p];
        r->own_share = (double)count / (double)pixels;
        if (count == 0) continue;
        mean_deviation(&r->samples, both, table, r->own);
        mean_deviation(&run->runs[OVCM].samples, both, table, r->ovcm);
    }
    free(both);
}

static void analyse_scene(scene_run *run)
{
    const size_t pixels = (size_t)run->width * run->height;
    double *reference = reference_of(run);
    run->common = need(pixels, sizeof *run->common);
    run->merging = need(pixels, sizeof *run->merging);
    for (size_t p = 0; p < pixels; p++) run->common[p] = run->merging[p] = true;
    for (int which = 0; which < ESTIMATORS; which++) {
        estimator_run *r = &run->runs[which];
        r->counts = need(pixels, sizeof *r->counts);
        r->deviation = need(pixels, sizeof *r->deviation);
        /* What bdpt never finds but for a lucky path or two must not pass for noise. */
        const double known = which <= BDPT ? 0.05 : (double)INFINITY;
        r->sharpness = find_consistent_pixels(&r->samples, reference, run->left_out, 0.01, known, r->counts);
        batches_deviation(&r->samples, r->deviation);
        for (size_t p = 0; p < pixels; p++) {
            if (which >= BDPT) run->common[p] &= r->counts[p];
            if (which >= VCM) run->merging[p] &= r->counts[p];
        }
    }
    free(reference);
    bootstrap_table table;
    bootstrap_draw(&table, 2);
    for (int which = 0; which < ESTIMATORS; which++) {
        mean_deviation(&run->runs[which].samples, run->common, &table, run->runs[which].common);
        mean_deviation(&run->runs[which].samples, run->merging, &table, run->runs[which].merging);
    }
    compare_others(run, &table);
}

static void release_scene(scene_run *run)
{
    for (int which = 0; which < ESTIMATORS; which++) {
        batches_destroy(&run->runs[which].samples);
        free(run->runs[which].deviation);
        free(run->runs[which].counts);
    }
    for (int i = 0; i < 3; i++) free(run->fifty[i]);
    free(run->picture);
    free(run->left_out);
    free(run->common);
    free(run->merging);
}

/* ---- The program ----------------------------------------------------------------------------------------------- */

static void start_scene(scene_run *run, const comparison_scene *scene, uint32_t iterations)
{
    *run = (scene_run){.scene = scene, .width = SIDE, .height = SIDE, .iterations = iterations};
    for (int which = 0; which < ESTIMATORS; which++) {
        char *integrator = run->runs[which].integrator;
        snprintf(integrator, sizeof run->runs[which].integrator, estimators[which].integrator, scene->radius);
    }
}

static void find_scene(scene_run *run)
{
    const char *shared = getenv("CAUSTICA_SCENES");
    if (!shared) shared = CA_SOURCE_DIR "/../shared/scenes";
    snprintf(run->path, sizeof run->path, "%s/%s", run->scene->shared ? shared : CA_SOURCE_DIR "/scenes",
             run->scene->file);
    if (access(run->path, R_OK) == 0) return;
    fprintf(stderr, "SKIPPED: %s is not there%s\n", run->path,
            run->scene->shared ? " (CAUSTICA_SCENES names the folder of shared scenes)" : "");
    run->path[0] = '\0';
}

/* Before anything else: see bench_peak_memory. */
static void measure_memory(scene_run *run)
{
    for (int which = 0; which < ESTIMATORS; which++) {
        const ca_render_settings settings = settings_of(run, which, 3, BATCH_SEED);
        run->runs[which].memory = bench_peak_memory(run->path, &settings);
    }
}

static bool parse_options(int argc, char **argv, options *chosen)
{
    *chosen = (options){0};
    for (int i = 1; i < argc; i++) {
        const bool more = i + 1 < argc;
        if (strcmp(argv[i], "--quick") == 0)
            chosen->iterations = 2 * BATCHES;
        else if (more && strcmp(argv[i], "--iterations") == 0)
            chosen->iterations = (uint32_t)strtoul(argv[++i], NULL, 10) / BATCHES * BATCHES;
        else if (more && strcmp(argv[i], "--only") == 0)
            chosen->only = argv[++i];
        else if (more && strcmp(argv[i], "--table") == 0)
            chosen->table = argv[++i];
        else if (more && strcmp(argv[i], "--pictures") == 0)
            chosen->pictures = argv[++i];
        else
            return false;
    }
    return chosen->iterations == 0 || chosen->iterations >= 2 * BATCHES; /* batches of two: they have a variance */
}

int main(int argc, char **argv)
{
    static scene_run runs[SCENES];
    options chosen;
    if (!parse_options(argc, argv, &chosen)) {
        fprintf(stderr, "usage: %s [--quick | --iterations N] [--only SCENE] [--table FILE] [--pictures FOLDER]\n",
                argv[0]);
        return 2;
    }
    FILE *table = chosen.table ? fopen(chosen.table, "w") : stdout;
    if (!table) return perror(chosen.table), 1;
    for (int i = 0; i < SCENES; i++) {
        start_scene(&runs[i], &scenes[i], chosen.iterations ? chosen.iterations : scenes[i].iterations);
        if (!chosen.only || strcmp(chosen.only, scenes[i].name) == 0) find_scene(&runs[i]);
        if (runs[i].path[0]) measure_memory(&runs[i]);
    }
    for (int i = 0; i < SCENES; i++) {
        ca_error error;
        if (!runs[i].path[0]) continue;
        fprintf(stderr, "%s: %u iterations of %d estimators\n", runs[i].scene->name, runs[i].iterations, ESTIMATORS);
        render_scene(&runs[i]);
        analyse_scene(&runs[i]);
        report_scene(table, &runs[i]);
        fflush(table);
        if (chosen.pictures && write_closeups(&runs[i], chosen.pictures, &error) != CA_OK)
            bench_die(chosen.pictures, &error);
        if (chosen.pictures && runs[i].fifty[0] && write_figure_2(&runs[i], chosen.pictures, &error) != CA_OK)
            bench_die(chosen.pictures, &error);
    }
    const int failed = report_checks(table, runs, SCENES);
    for (int i = 0; i < SCENES; i++) release_scene(&runs[i]);
    return (chosen.table && fclose(table) != 0) || failed > 0;
}
