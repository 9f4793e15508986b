/* Rays per second inside `path` against Embree alone on the very same rays, and how two threads scale.
 *
 * Every figure is a median of interleaved runs; the ratio is what counts, for the machine's own speed drifts. Writes
 * bench/results.json (or the file given as argument). */
#include "bench_scenes.h"
#include "bench_support.h"
#include "geometry/accel.h"
#include "ray_recorder.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { RUNS = 7 };

typedef struct path_figures {
    uint64_t rays;
    double path_seconds, raw_seconds, two_thread_seconds;
    double ratio, scaling;
} path_figures;

static double render_seconds(const ca_scene *scene, uint32_t samples, uint32_t threads,
                             ca_render_statistics *statistics)
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
    if (ca_render(scene, &settings, &image, statistics, &error) != CA_OK) bench_die("render", &error);
    ca_image_release(image);
    return statistics->seconds;
}

/* `in_embree`: the same scene with all that it has in Embree's hands, which gets the rays that are recorded. */
static path_figures measure(const char *name, const ca_scene *scene, const ca_scene *in_embree, uint32_t samples)
{
    ca_render_statistics statistics = {.size = sizeof statistics};
    ray_counts recorded, replayed;
    ray_recorder_start();
    render_seconds(in_embree, samples, 1, &statistics);
    const bool complete = ray_recorder_stop(&recorded) && recorded.rays == statistics.rays &&
                          recorded.shadow_rays == statistics.shadow_rays;
    path_figures figures = {.rays = recorded.rays + recorded.shadow_rays};
    double path[RUNS], raw[RUNS], two[RUNS], ratio[RUNS], scaling[RUNS];
    for (int run = 0; run < RUNS; run++) {
        path[run] = render_seconds(scene, samples, 1, &statistics);
        raw[run] = ray_recorder_replay(1, &replayed);
        two[run] = render_seconds(scene, samples, 2, &statistics);
        ratio[run] = raw[run] / path[run];
        scaling[run] = path[run] / two[run];
    }
    if (!complete || memcmp(&recorded, &replayed, sizeof recorded) != 0) {
        fprintf(stderr, "%s: the replay is not what was recorded\n", name);
        exit(1);
    }
    ray_recorder_free();
    figures.path_seconds = bench_median(path, RUNS);
    figures.raw_seconds = bench_median(raw, RUNS);
    figures.two_thread_seconds = bench_median(two, RUNS);
    figures.ratio = bench_median(ratio, RUNS);
    figures.scaling = bench_median(scaling, RUNS);
    const double million = 1e-6 * (double)figures.rays;
    printf("%-12s %6.2f M rays  path %5.2f M/s  Embree alone %5.2f M/s  path/Embree %4.1f %%  two threads x %.2f\n",
           name, million, million / figures.path_seconds, million / figures.raw_seconds, 100.0 * figures.ratio,
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

static ca_status load_cornell_box(ca_scene **scene, ca_error *error)
{
    return ca_scene_load(CA_SOURCE_DIR "/scenes/cornell-box/cornell-box.xml", NULL, 0, scene, error);
}

int main(int argc, char **argv)
{
    const char *results = bench_results_file(argc, argv);
    static const struct {
        const char *name;
        ca_status (*load)(ca_scene **scene, ca_error *error);
        uint32_t samples;
    } scenes[] = {
        {"cornell-box", load_cornell_box, 24},
        {"terrain", bench_scene_terrain, 16},
        {"balls", bench_scene_balls, 16},
    };
    json_t *figures = json_object();
    for (size_t i = 0; i < sizeof scenes / sizeof scenes[0]; i++) {
        ca_error error;
        ca_scene *scene, *in_embree;
        ca_accel_keep_apart(false);
        if (scenes[i].load(&in_embree, &error) != CA_OK) bench_die(scenes[i].name, &error);
        ca_accel_keep_apart(true);
        if (scenes[i].load(&scene, &error) != CA_OK) bench_die(scenes[i].name, &error);
        const path_figures measured = measure(scenes[i].name, scene, in_embree, scenes[i].samples);
        json_object_set_new(figures, scenes[i].name, figures_json(&measured));
        ca_scene_release(scene);
        ca_scene_release(in_embree);
    }
    bench_write_results(results, "path", figures);
    return 0;
}
