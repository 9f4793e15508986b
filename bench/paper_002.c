/* The comparison of paper 002 (Jendersie 2019, figures 2 and 6): bidirectional path tracing and vertex connection and
 * merging with several rules of reuse, at a fixed radius and equal iteration counts, on eight scenes; beside them
 * path tracing and photon mapping.
 *
 *     paper_002 [--quick | --iterations N | --full | --minutes N | --times] [--only SCENE] [--table FILE]
 *               [--pictures FOLDER]
 *
 * All estimators get the same random numbers, batch by batch: they trace the same paths and differ in their weights.
 * A scene is rendered until the intervals are as narrow as they should be or its share of the time is used up;
 * --minutes: of all scenes together. --full: after that, estimators whose intervals are still wider go on alone until
 * they are not, or have eight times the iterations of all. In the end times are measured; --times: nothing else.
 * The report is Markdown; exit status 1 when something that the comparison should show is not so. */
#include "paper_002.h"
#include "base/clock.h"
#include "bench_support.h"
#include "scene/scene.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { SIDE = 128, THREADS = 2, BATCH_SEED = 20020 };

/* Radii: the default at this size (one side of a pixel where the camera sees something), rounded. */
static const comparison_scene scenes[] = {
    {.name = "veach-bidir",
     .file = "veach-bidir/scene.xml",
     .what = "Veach's room; the pixels of the egg and of the lamp are left out",
     .shared = true,
     .without_specular = true,
     .minutes = 30.0,
     .radius = 0.08,
     .closeup = {0.05, 0.1, 0.5}},
    {.name = "water-caustic",
     .file = "water-caustic/scene.xml",
     .what = "a caustic under water, seen through water; bdpt counts above the water only",
     .shared = true,
     .minutes = 13.0,
     .radius = 0.02,
     .closeup = {0.2, 0.15, 0.5}},
    {.name = "small-light-far",
     .file = "small-light-far/small-light-far.xml",
     .what = "a small light, far away",
     .minutes = 5.0,
     .radius = 0.035,
     .closeup = {0.25, 0.25, 0.5}},
    {.name = "rough-glass",
     .file = "rough-glass/rough-glass.xml",
     .what = "light through rough glass",
     .minutes = 16.0,
     .radius = 0.035,
     .closeup = {0.25, 0.25, 0.5}},
    {.name = "long-diffuse",
     .file = "long-diffuse/long-diffuse.xml",
     .what = "light that arrives after many diffuse bounces",
     .minutes = 13.0,
     .radius = 0.025,
     .closeup = {0.25, 0.25, 0.5}},
    {.name = "bare-wall",
     .file = "weights/bare-wall.xml",
     .what = "a bare wall: next event is almost without noise",
     .minutes = 5.0,
     .radius = 0.012,
     .closeup = {0.25, 0.25, 0.5}},
    {.name = "glass-balls",
     .file = "paper-002/glass-balls.xml",
     .what = "glass balls in a box with a small lamp, after the scene of Hachisuka that the paper names",
     .minutes = 13.0,
     .radius = 0.02,
     .closeup = {0.25, 0.45, 0.5}},
    {.name = "living-room",
     .file = "paper-002/living-room.xml",
     .what = "a furnished room, of the kind of the paper's PBRT scenes: light from a window and a bulb in glass",
     .minutes = 13.0,
     .radius = 0.04,
     .closeup = {0.25, 0.25, 0.5}},
};
enum { SCENES = sizeof scenes / sizeof scenes[0] };

typedef struct options {
    uint32_t iterations; /* 0: as many as it takes */
    double minutes;      /* of all scenes; 0: their own */
    bool full, only_times;
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

/* Returns the seconds that it took. */
static double render(const ca_scene *scene, const scene_run *run, int which, uint32_t iterations, uint64_t seed,
                     ca_image_layers **image)
{
    const ca_render_settings settings = settings_of(run, which, iterations, seed);
    ca_render_statistics statistics = {.size = sizeof statistics};
    ca_error error;
    if (ca_render(scene, &settings, image, &statistics, &error) != CA_OK) bench_die(settings.integrator, &error);
    if (statistics.non_finite > 0) {
        fprintf(stderr, "%s, %s: samples that are not finite\n", run->scene->name, settings.integrator);
        exit(1);
    }
    return statistics.seconds;
}

static double luminance_at(const float *const channels[3], size_t pixel)
{
    return 0.2126 * (double)channels[0][pixel] + 0.7152 * (double)channels[1][pixel] +
           0.0722 * (double)channels[2][pixel];
}

/* All that merge, vcm once. */
enum { OF_THE_MEAN = ESTIMATORS - VCM - 1 };
static bool is_of_the_mean(int which) { return which >= VCM && which != VCM_SUMS; }

/* To the picture's sum over iterations. */
static void keep_picture(scene_run *run, uint32_t iterations, const float *const channels[3])
{
    const size_t pixels = (size_t)run->width * run->height;
    for (size_t c = 0; c < 3; c++)
        for (size_t p = 0; p < pixels; p++)
            run->picture[c * pixels + p] += channels[c][p] * (float)iterations / (float)OF_THE_MEAN;
}

/* Adds to a batch's statistics. */
static void keep_batch(scene_run *run, int which, uint32_t batch, uint32_t iterations, const float *const channels[3],
                       const float *deviation)
{
    const size_t pixels = (size_t)run->width * run->height;
    batches *b = &run->runs[which].samples;
    const double n = iterations, share = n / (b->iterations + n);
    for (size_t p = 0; p < pixels; p++) {
        const double mean = luminance_at(channels, p);
        const double variance = (double)deviation[p] * (double)deviation[p] * (n - 1.0) / n;
        double *const kept[2] = {&b->mean[p * BATCHES + batch], &b->mean_square[p * BATCHES + batch]};
        *kept[0] += share * (mean - *kept[0]);
        *kept[1] += share * (variance + mean * mean - *kept[1]);
    }
}

/* `together`: all estimators make this pass. Only such passes are in the picture; estimators that merge find all
 * light and are what it is made of. */
static void render_batch(const ca_scene *scene, scene_run *run, int which, uint32_t batch, uint32_t iterations,
                         bool together)
{
    static const char *const names[3] = {"R", "G", "B"};
    const uint64_t seed = BATCH_SEED + batch + (uint64_t)BATCHES * run->runs[which].passes;
    ca_image_layers *image;
    (void)render(scene, run, which, iterations, seed, &image);
    const float *channels[3];
    for (int c = 0; c < 3; c++) channels[c] = ca_image_channel(image, names[c]);
    keep_batch(run, which, batch, iterations, channels, ca_image_channel(image, "StandardDeviation.Y"));
    if (together && is_of_the_mean(which)) keep_picture(run, iterations, channels);
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
        ca_image_layers *image;
        (void)render(scene, run, which[i], 50, BATCH_SEED, &image);
        run->fifty[i] = need(3 * pixels, sizeof *run->fifty[i]);
        for (size_t c = 0; c < 3; c++)
            memcpy(run->fifty[i] + c * pixels, ca_image_channel(image, names[c]), pixels * sizeof *run->fifty[i]);
        ca_image_release(image);
    }
}

/* So many iterations more of every estimator. */
static void render_pass(const ca_scene *scene, scene_run *run, uint32_t iterations)
{
    for (uint32_t batch = 0; batch < BATCHES; batch++)
        for (int which = 0; which < ESTIMATORS; which++)
            render_batch(scene, run, which, batch, iterations / BATCHES, true);
    run->iterations += iterations;
    for (int which = 0; which < ESTIMATORS; which++) {
        run->runs[which].samples.iterations += iterations / BATCHES;
        run->runs[which].passes++;
    }
}

/* A quarter more iterations of one estimator, alone. */
static void render_more(const ca_scene *scene, scene_run *run, int which)
{
    batches *b = &run->runs[which].samples;
    const uint32_t iterations = b->iterations / 4 + 2;
    for (uint32_t batch = 0; batch < BATCHES; batch++) render_batch(scene, run, which, batch, iterations, false);
    b->iterations += iterations;
    run->runs[which].passes++;
}

static void create_scene(const ca_scene *scene, scene_run *run)
{
    const size_t pixels = (size_t)run->width * run->height;
    run->picture = need(3 * pixels, sizeof *run->picture);
    run->left_out = need(pixels, sizeof *run->left_out);
    run->common = need(pixels, sizeof *run->common);
    run->merging = need(pixels, sizeof *run->merging);
    leave_emitters_out(scene, run);
    if (run->scene->without_specular) leave_specular_out(scene, run);
    for (int which = 0; which < ESTIMATORS; which++) {
        estimator_run *r = &run->runs[which];
        r->counts = need(pixels, sizeof *r->counts);
        r->deviation = need(pixels, sizeof *r->deviation);
        if (!batches_create(&r->samples, run->width, run->height, 0)) die_of_memory();
    }
}

/* ---- Statistics ------------------------------------------------------------------------------------------------ */

/* Mean of the estimators that find all light, batch by batch: the longest run there is. */
static double *reference_of(const scene_run *run)
{
    const size_t values = (size_t)run->width * run->height * BATCHES;
    double *reference = need(values, sizeof *reference);
    for (int which = VCM; which < ESTIMATORS; which++)
        for (size_t i = 0; is_of_the_mean(which) && i < values; i++)
            reference[i] += run->runs[which].samples.mean[i] / OF_THE_MEAN;
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

/* Which pixels each estimator counts on, and which all do. */
static void choose_pixels(scene_run *run)
{
    const size_t pixels = (size_t)run->width * run->height;
    double *reference = reference_of(run);
    for (size_t p = 0; p < pixels; p++) run->common[p] = run->merging[p] = true;
    for (int which = 0; which < ESTIMATORS; which++) {
        estimator_run *r = &run->runs[which];
        /* What bdpt never finds but for a lucky path or two must not pass for noise. */
        const double known = which <= BDPT ? 0.05 : (double)INFINITY;
        r->sharpness = find_consistent_pixels(&r->samples, reference, run->left_out, 0.01, known, r->counts);
        for (size_t p = 0; p < pixels; p++) {
            if (which >= BDPT) run->common[p] &= r->counts[p];
            if (which >= VCM) run->merging[p] &= r->counts[p];
        }
    }
    free(reference);
}

static void analyse_pixels(scene_run *run)
{
    bootstrap_table table;
    bootstrap_draw(&table, 2);
    for (int which = 0; which < ESTIMATORS; which++) {
        batches_deviation(&run->runs[which].samples, run->runs[which].deviation);
        mean_deviation(&run->runs[which].samples, run->common, &table, run->runs[which].common);
        mean_deviation(&run->runs[which].samples, run->merging, &table, run->runs[which].merging);
    }
    compare_others(run, &table);
}

static void analyse_scene(scene_run *run)
{
    choose_pixels(run);
    analyse_pixels(run);
}

/* ---- Until it is precise --------------------------------------------------------------------------------------- */

static const double PRECISE = 0.01; /* half an interval over its middle */

/* Passes until the intervals are as narrow as they should be, or until the next one would not fit into `seconds`. */
static void render_until_precise(const ca_scene *scene, scene_run *run, double seconds)
{
    enum { PASS = 5 * BATCHES };
    const double start = ca_clock_seconds();
    double end = start, longest = 0.0;
    do {
        const double begin = end;
        render_pass(scene, run, PASS);
        analyse_scene(run);
        end = ca_clock_seconds();
        longest = fmax(longest, end - begin);
    } while (report_widest_interval(run) > PRECISE && end + longest < start + seconds);
}

/* An estimator whose rare samples decide its deviation never gets there. */
enum { MOST_TIMES_ALONE = 8 };

static bool goes_on(const scene_run *run, int which)
{
    const uint32_t iterations = run->runs[which].samples.iterations * BATCHES;
    return report_interval(run, which) > PRECISE && iterations < MOST_TIMES_ALONE * run->iterations;
}

/* On the pixels that were chosen: with more of them an interval would be that of another figure. */
static void go_on_alone(const ca_scene *scene, scene_run *run)
{
    for (int going = ESTIMATORS; going > 0;) {
        going = 0;
        for (int which = 0; which < ESTIMATORS; which++)
            if (goes_on(run, which)) render_more(scene, run, which), going++;
        if (going > 0) analyse_pixels(run);
        fprintf(stderr, "  %s: %d went on alone, widest interval %.2f %%\n", run->scene->name, going,
                100.0 * report_widest_interval(run));
    }
}

/* Sums become means. */
static void finish_scene(scene_run *run)
{
    const size_t values = 3 * (size_t)run->width * run->height;
    for (size_t i = 0; i < values; i++) run->picture[i] /= (float)run->iterations;
    run->rendered = true;
}

/* `seconds`: of the scene's share, unless the options tell the number of iterations. */
static void measure_scene(scene_run *run, const options *chosen, double seconds)
{
    ca_error error;
    ca_scene *scene;
    if (ca_scene_load(run->path, NULL, 0, &scene, &error) != CA_OK) bench_die(run->path, &error);
    create_scene(scene, run);
    run->first_precise = chosen->full ? PATH : BDPT;
    if (chosen->iterations > 0) {
        render_pass(scene, run, chosen->iterations);
        analyse_scene(run);
    } else {
        render_until_precise(scene, run, seconds);
    }
    if (chosen->full) go_on_alone(scene, run);
    if (run->scene->without_specular) render_fifty(scene, run);
    ca_scene_release(scene);
    finish_scene(run);
}

/* ---- Time and memory ------------------------------------------------------------------------------------------- */

/* Before anything else: see bench_peak_memory. */
static void measure_memory(scene_run *run)
{
    for (int which = 0; which < ESTIMATORS; which++) {
        const ca_render_settings settings = settings_of(run, which, 3, BATCH_SEED);
        run->runs[which].memory = bench_peak_memory(run->path, &settings);
    }
}

/* What twenty iterations more take: pilots, and whatever else a render begins with, are left out. In turns, so that
 * a slow minute slows all. */
static void measure_times(scene_run *run)
{
    enum { FEW = 2, MORE = 20 };
    ca_error error;
    ca_scene *scene;
    if (ca_scene_load(run->path, NULL, 0, &scene, &error) != CA_OK) bench_die(run->path, &error);
    for (uint32_t round = 0; round < TIME_ROUNDS; round++)
        for (uint32_t turn = 0; turn < ESTIMATORS; turn++) {
            const int which = (int)((turn + round) % ESTIMATORS);
            double seconds[2];
            for (int more = 0; more < 2; more++) {
                ca_image_layers *image;
                seconds[more] = render(scene, run, which, more ? FEW + MORE : FEW, BATCH_SEED + round, &image);
                ca_image_release(image);
            }
            run->runs[which].seconds[round] = (seconds[1] - seconds[0]) / MORE;
        }
    ca_scene_release(scene);
    run->timed = true;
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

static void start_scene(scene_run *run, const comparison_scene *scene)
{
    *run = (scene_run){.scene = scene, .width = SIDE, .height = SIDE};
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

static bool parse_options(int argc, char **argv, options *chosen)
{
    *chosen = (options){0};
    for (int i = 1; i < argc; i++) {
        const bool more = i + 1 < argc;
        if (strcmp(argv[i], "--quick") == 0)
            chosen->iterations = 2 * BATCHES;
        else if (strcmp(argv[i], "--full") == 0)
            chosen->full = true;
        else if (strcmp(argv[i], "--times") == 0)
            chosen->only_times = true;
        else if (more && strcmp(argv[i], "--minutes") == 0 && (chosen->minutes = strtod(argv[i + 1], NULL)) > 0.0)
            i++;
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

static void write_pictures(const scene_run *run, const char *folder)
{
    ca_error error;
    if (write_closeups(run, folder, &error) != CA_OK) bench_die(folder, &error);
    if (run->fifty[0] && write_figure_2(run, folder, &error) != CA_OK) bench_die(folder, &error);
}

static int print_usage(const char *program)
{
    fprintf(stderr,
            "usage: %s [--quick | --iterations N | --full | --minutes N | --times] [--only SCENE] [--table FILE] "
            "[--pictures FOLDER]\n",
            program);
    return 2;
}

static void compare_scenes(scene_run *runs, const options *chosen, FILE *table)
{
    double all_minutes = 0.0;
    for (int i = 0; i < SCENES; i++) all_minutes += scenes[i].minutes;
    const double scale = chosen->minutes > 0.0 ? chosen->minutes / all_minutes : 1.0;
    for (int i = 0; i < SCENES; i++) {
        if (!runs[i].path[0]) continue;
        measure_scene(&runs[i], chosen, 60.0 * scale * scenes[i].minutes);
        fprintf(stderr, "%s: %u iterations of %d estimators\n", runs[i].scene->name, runs[i].iterations, ESTIMATORS);
        report_scene(table, &runs[i]);
        fflush(table);
        if (chosen->pictures) write_pictures(&runs[i], chosen->pictures);
    }
}

int main(int argc, char **argv)
{
    static scene_run runs[SCENES];
    options chosen;
    if (!parse_options(argc, argv, &chosen)) return print_usage(argv[0]);
    FILE *table = chosen.table ? fopen(chosen.table, "w") : stdout;
    if (!table) return perror(chosen.table), 1;
    for (int i = 0; i < SCENES; i++) {
        start_scene(&runs[i], &scenes[i]);
        if (!chosen.only || strcmp(chosen.only, scenes[i].name) == 0) find_scene(&runs[i]);
        if (runs[i].path[0]) measure_memory(&runs[i]);
    }
    if (!chosen.only_times) compare_scenes(runs, &chosen, table);
    for (int i = 0; i < SCENES; i++)
        if (runs[i].path[0]) measure_times(&runs[i]);
    report_times(table, runs, SCENES);
    const int failed = report_checks(table, runs, SCENES);
    for (int i = 0; i < SCENES; i++) release_scene(&runs[i]);
    return (chosen.table && fclose(table) != 0) || failed > 0;
}
