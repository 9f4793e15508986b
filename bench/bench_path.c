/* Rays per second inside `path` against Embree alone on the very same rays, and how two threads scale.
 *
 * Every figure is a median of interleaved runs; the ratio is what counts, for the machine's own speed drifts. Writes
 * bench/results.json (or the file given as argument). */
#include "base/clock.h"
#include "base/file.h"
#include "bench_scenes.h"
#include "ray_recorder.h"

#include <jansson.h>
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>

enum { RUNS = 7, MAX_RAYS = 8 * 1000 * 1000 };

typedef struct path_figures {
    uint64_t rays;
    double path_seconds, raw_seconds, two_thread_seconds;
    double ratio, scaling;
} path_figures;

static int compare_doubles(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(double *values, int count)
{
    qsort(values, (size_t)count, sizeof *values, compare_doubles);
    return values[count / 2];
}

static void die(const char *what, const ca_error *error)
{
    fprintf(stderr, "%s: %s\n", what, error->message);
    exit(1);
}

static double render_seconds(const ca_scene *scene, uint32_t samples, uint32_t threads, ca_render_statistics *statistics)
{
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.integrator = "path:max_depth=8";
    settings.sampler = "independent";
    settings.samples_per_pixel = samples;
    settings.threads = threads;
    settings.width = settings.height = 256;
    ca_image_layers *image;
    ca_error error;
    if (ca_render(scene, &settings, &image, statistics, &error) != CA_OK) die("render", &error);
    ca_image_release(image);
    return statistics->seconds;
}

static path_figures measure(const char *name, const ca_scene *scene, uint32_t samples)
{
    ca_render_statistics statistics;
    path_figures figures = {0};
    if (!ray_recorder_start(MAX_RAYS)) exit(1);
    render_seconds(scene, samples, 1, &statistics);
    figures.rays = ray_recorder_stop();
    double path[RUNS], raw[RUNS], two[RUNS], ratio[RUNS], scaling[RUNS];
    for (int run = 0; run < RUNS; run++) {
        path[run] = render_seconds(scene, samples, 1, &statistics);
        raw[run] = ray_recorder_replay();
        two[run] = render_seconds(scene, samples, 2, &statistics);
        ratio[run] = raw[run] / path[run];
        scaling[run] = path[run] / two[run];
    }
    if (figures.rays > MAX_RAYS || figures.rays != statistics.rays + statistics.shadow_rays ||
        ray_recorder_hits() != ray_recorder_recorded_hits()) {
        fprintf(stderr, "%s: the replay is not what was recorded\n", name);
        exit(1);
    }
    ray_recorder_free();
    figures.path_seconds = median(path, RUNS);
    figures.raw_seconds = median(raw, RUNS);
    figures.two_thread_seconds = median(two, RUNS);
    figures.ratio = median(ratio, RUNS);
    figures.scaling = median(scaling, RUNS);
    const double million = 1e-6 * (double)figures.rays;
    printf("%-12s %6.2f M rays  path %5.2f M/s  Embree alone %5.2f M/s  path/Embree %4.1f %%  two threads x %.2f\n", name,
           million, million / figures.path_seconds, million / figures.raw_seconds, 100.0 * figures.ratio,
           figures.scaling);
    return figures;
}

static json_t *figures_json(const path_figures *figures)
{
    return json_pack("{s:I, s:f, s:f, s:f, s:f, s:f}", "rays", (json_int_t)figures->rays, "path_seconds",
                     figures->path_seconds, "embree_seconds", figures->raw_seconds, "two_thread_seconds",
                     figures->two_thread_seconds, "path_over_embree", figures->ratio, "two_threads_speedup",
                     figures->scaling);
}

static void write_results(const char *path, json_t *scenes)
{
    ca_file_writer writer;
    ca_error error;
    if (ca_file_create(&writer, path, &error) != CA_OK) die("results", &error);
    json_t *root = json_pack("{s:o}", "path", scenes);
    json_dumpf(root, writer.stream, JSON_INDENT(2) | JSON_REAL_PRECISION(5));
    fputc('\n', writer.stream);
    json_decref(root);
    if (ca_file_commit(&writer, &error) != CA_OK) die("results", &error);
}

static ca_status load_cornell_box(ca_scene **scene, ca_error *error)
{
    return ca_scene_load(CA_SOURCE_DIR "/scenes/cornell-box/cornell-box.xml", NULL, 0, scene, error);
}

int main(int argc, char **argv)
{
    static const struct {
        const char *name;
        ca_status (*load)(ca_scene **scene, ca_error *error);
        uint32_t samples;
    } scenes[] = {{"cornell-box", load_cornell_box, 6}, {"terrain", bench_scene_terrain, 4}, {"balls", bench_scene_balls, 4}};
    json_t *figures = json_object();
    for (size_t i = 0; i < sizeof scenes / sizeof scenes[0]; i++) {
        ca_error error;
        ca_scene *scene;
        if (scenes[i].load(&scene, &error) != CA_OK) die(scenes[i].name, &error);
        const path_figures measured = measure(scenes[i].name, scene, scenes[i].samples);
        json_object_set_new(figures, scenes[i].name, figures_json(&measured));
        ca_scene_release(scene);
    }
    write_results(argc > 1 ? argv[1] : CA_SOURCE_DIR "/bench/results.json", figures);
    return 0;
}
