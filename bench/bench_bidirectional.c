/* What one iteration of the bidirectional integrators costs, in units of the raw Embree time of exactly its rays.
 *
 * A Cornell box with a mirror ball, a glass ball and an area light, 512 x 512: 262,144 camera paths and as many light
 * paths an iteration, up to 10 segments long, two threads. The second iteration of a render is timed (the first one
 * allocates); its rays, as they are where Embree has the whole scene, are recorded and replayed with two threads.
 * Figures are medians of interleaved runs. Writes its part of bench/results.json (or of the file given as
 * argument). */
#include "bench_support.h"
#include "geometry/accel.h"
#include "ray_recorder.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char scene_path[] = CA_SOURCE_DIR "/scenes/speed/cornell-spheres.xml";

enum { RUNS = 9, SIDE = 512, MAX_DEPTH = 10, THREADS = 2 };

typedef struct figures {
    double seconds, embree_seconds, ratio;
    ca_render_statistics work; /* its counters only */
} figures;

/* Followed through a render: when its passes end, and recording the second one. */
typedef struct pass_watch {
    double ended, seconds;
    bool record;
} pass_watch;

static bool watch_pass(const ca_render_progress *progress, void *user)
{
    pass_watch *watch = user;
    watch->seconds = progress->seconds - watch->ended;
    watch->ended = progress->seconds;
    if (watch->record && progress->passes_done == 1) ray_recorder_start();
    return true;
}

static ca_render_settings settings_of(const char *integrator, uint32_t passes)
{
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.integrator = integrator;
    settings.sampler = "independent";
    settings.samples_per_pixel = passes;
    settings.threads = THREADS;
    settings.width = settings.height = SIDE;
    settings.has_max_depth = true;
    settings.max_depth = MAX_DEPTH;
    return settings;
}

/* The last of `passes` iterations; `statistics` are of all. */
static double render(const ca_scene *scene, const char *integrator, uint32_t passes, bool record,
                     ca_render_statistics *statistics)
{
    ca_render_settings settings = settings_of(integrator, passes);
    pass_watch watch = {.record = record};
    settings.progress = watch_pass;
    settings.progress_user = &watch;
    ca_image_layers *image;
    ca_error error;
    if (ca_render(scene, &settings, &image, statistics, &error) != CA_OK) bench_die(integrator, &error);
    ca_image_release(image);
    return watch.seconds;
}

/* What the second iteration did: two less one. */
static ca_render_statistics work_of_second(const ca_render_statistics *one, const ca_render_statistics *two)
{
    return (ca_render_statistics){.rays = two->rays - one->rays,
                                  .shadow_rays = two->shadow_rays - one->shadow_rays,
                                  .photons = two->photons - one->photons,
                                  .photons_tested = two->photons_tested - one->photons_tested,
                                  .merges = two->merges - one->merges,
                                  .light_paths = two->light_paths - one->light_paths,
                                  .camera_paths = two->camera_paths - one->camera_paths};
}

/* `in_embree`: the same scene with all that it has in Embree's hands, which gets the rays that are recorded. */
static figures measure(const ca_scene *scene, const ca_scene *in_embree, const char *integrator)
{
    ca_render_statistics one = {.size = sizeof one}, two = {.size = sizeof two};
    ray_counts recorded, replayed;
    render(in_embree, integrator, 1, false, &one);
    render(in_embree, integrator, 2, true, &two);
    const bool complete = ray_recorder_stop(&recorded);
    figures f = {.work = work_of_second(&one, &two)};
    double seconds[RUNS], embree[RUNS], ratio[RUNS];
    for (int run = 0; run < RUNS; run++) {
        seconds[run] = render(scene, integrator, 2, false, &two);
        embree[run] = ray_recorder_replay(THREADS, &replayed);
        ratio[run] = seconds[run] / embree[run];
    }
    if (!complete || recorded.rays != f.work.rays || recorded.shadow_rays != f.work.shadow_rays ||
        memcmp(&recorded, &replayed, sizeof recorded) != 0) {
        fprintf(stderr, "%s: the replay is not what was rendered\n", integrator);
        exit(1);
    }
    ray_recorder_free();
    f.seconds = bench_median(seconds, RUNS);
    f.embree_seconds = bench_median(embree, RUNS);
    f.ratio = bench_median(ratio, RUNS);
    const double million = 1e-6;
    printf("%-9s %6.0f ms  Embree %5.0f ms  x %5.2f   rays %5.2f M  shadow %5.2f M  photons %5.2f M  tested %6.2f M  "
           "merges %6.2f M\n",
           integrator, 1e3 * f.seconds, 1e3 * f.embree_seconds, f.ratio, million * (double)f.work.rays,
           million * (double)f.work.shadow_rays, million * (double)f.work.photons,
           million * (double)f.work.photons_tested, million * (double)f.work.merges);
    fflush(stdout);
    return f;
}

static json_t *figures_json(const figures *f)
{
    return json_pack("{s:f, s:f, s:f, s:I, s:I, s:I, s:I, s:I}", "seconds", f->seconds, "embree_seconds",
                     f->embree_seconds, "over_embree", f->ratio, "rays", (json_int_t)f->work.rays, "shadow_rays",
                     (json_int_t)f->work.shadow_rays, "photons", (json_int_t)f->work.photons, "photons_tested",
                     (json_int_t)f->work.photons_tested, "merges", (json_int_t)f->work.merges);
}

/* Seconds of an `a` iteration over those of a `b` iteration, in turns. */
static double time_ratio(const ca_scene *scene, const char *a, const char *b)
{
    ca_render_statistics statistics = {.size = sizeof statistics};
    double ratio[2 * RUNS];
    for (int run = 0; run < 2 * RUNS; run++) {
        const double first = render(scene, run % 2 ? a : b, 2, false, &statistics);
        const double second = render(scene, run % 2 ? b : a, 2, false, &statistics);
        ratio[run] = run % 2 ? first / second : second / first;
    }
    return bench_median(ratio, 2 * RUNS);
}

static void verdict(const char *what, double value, double goal)
{
    printf("%-34s %6.3f   (goal: at most %.2f)  %s\n", what, value, goal, value <= goal ? "reached" : "missed");
}

/* The merge radius is a pixel's: as large on every machine, and for all. */
#define ONE_PIXEL(name) name ":radius_pixels=1"

int main(int argc, char **argv)
{
    const char *results = bench_results_file(argc, argv);
    static const char *const names[] = {"light", "ppm", "bdpt", "vcm", "vcm-plus", "vcm-star", "ovcm", "cavcm"};
    static const char *const integrators[] = {
        "light", ONE_PIXEL("ppm"), "bdpt", ONE_PIXEL("vcm"), ONE_PIXEL("vcm-plus"), ONE_PIXEL("vcm-star"),
        ONE_PIXEL("ovcm"), ONE_PIXEL("cavcm")};
    enum { COUNT = sizeof integrators / sizeof integrators[0], BDPT = 2, VCM = 3, OVCM = 6 };
    const ca_render_settings vcm = settings_of(ONE_PIXEL("vcm"), 3), ovcm = settings_of(ONE_PIXEL("ovcm"), 3);
    const double memory_ratio = bench_peak_memory(scene_path, &ovcm) / bench_peak_memory(scene_path, &vcm);
    ca_error error;
    ca_scene *scene, *in_embree;
    ca_accel_keep_apart(false);
    if (ca_scene_load(scene_path, NULL, 0, &in_embree, &error) != CA_OK) bench_die(scene_path, &error);
    ca_accel_keep_apart(true);
    if (ca_scene_load(scene_path, NULL, 0, &scene, &error) != CA_OK) bench_die(scene_path, &error);
    json_t *json = json_object();
    figures all[COUNT];
    for (int i = 0; i < COUNT; i++) {
        all[i] = measure(scene, in_embree, integrators[i]);
        json_object_set_new(json, names[i], figures_json(&all[i]));
    }
    const double ovcm_over_vcm = time_ratio(scene, ONE_PIXEL("ovcm"), ONE_PIXEL("vcm"));
    verdict("bdpt over Embree", all[BDPT].ratio, 1.6);
    verdict("vcm over Embree", all[VCM].ratio, 2.5);
    verdict("ovcm over Embree", all[OVCM].ratio, 2.6);
    verdict("ovcm over vcm, time", ovcm_over_vcm, 1.03);
    verdict("ovcm against vcm, memory (off by)", fabs(memory_ratio - 1.0), 0.01);
    json_object_set_new(json, "ovcm_over_vcm_seconds", json_real(ovcm_over_vcm));
    json_object_set_new(json, "ovcm_over_vcm_memory", json_real(memory_ratio));
    bench_write_results(results, "bidirectional", json);
    ca_scene_release(scene);
    ca_scene_release(in_embree);
    return 0;
}
