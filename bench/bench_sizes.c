/* What the size of a picture costs: the time of one pass per pixel, and the photons that are looked at for each
 * merge, of a small picture and of one of 3840 x 2160; and of a pass of 30 million light paths.
 *
 * The Cornell box, up to 8 segments. Time is that of the processors, all threads together, and of the second pass of
 * a render: the first one allocates. Pictures that are wide see the dark beside the box at either side and have fewer
 * merges, so small ones are measured in both shapes. Figures are medians, of the large ones of single runs. Writes
 * its part of bench/results.json (or of the file given as argument). */
#include "bench_support.h"

#include <stdbool.h>
#include <stdio.h>
#include <sys/resource.h>

static const char scene_path[] = CA_SOURCE_DIR "/scenes/cornell-box/cornell-box.xml";

enum { MAX_DEPTH = 8, RUNS = 5, MANY_LIGHT_PATHS = 30000000 };

typedef struct size {
    const char *name;
    uint32_t width, height, light_paths, runs;
} size;

enum { SQUARE, WIDE, LARGE, MANY, SIZES };
static const size sizes[SIZES] = {{"512x512", 512, 512, 0, RUNS},
                                  {"480x270", 480, 270, 0, RUNS},
                                  {"3840x2160", 3840, 2160, 0, 1},
                                  {"30M light", 512, 512, MANY_LIGHT_PATHS, 1}};

typedef struct figures {
    double microseconds;  /* a pixel */
    double merges, tested; /* a camera path, a merge */
} figures;

typedef struct pass_watch {
    double ended, seconds;
} pass_watch;

static double processor_seconds(void)
{
    struct rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    return (double)usage.ru_utime.tv_sec + 1e-6 * (double)usage.ru_utime.tv_usec;
}

static bool watch_pass(const ca_render_progress *progress, void *user)
{
    (void)progress;
    pass_watch *watch = user;
    const double now = processor_seconds();
    watch->seconds = now - watch->ended;
    watch->ended = now;
    return true;
}

static ca_render_settings settings_of(const char *integrator, const size *s)
{
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.integrator = integrator;
    settings.samples_per_pixel = 2;
    settings.width = s->width;
    settings.height = s->height;
    settings.light_paths = s->light_paths;
    settings.has_max_depth = true;
    settings.max_depth = MAX_DEPTH;
    return settings;
}

static double render(const ca_scene *scene, const char *integrator, const size *s, ca_render_statistics *statistics)
{
    pass_watch watch = {0};
    ca_render_settings settings = settings_of(integrator, s);
    settings.progress = watch_pass;
    settings.progress_user = &watch;
    ca_image_layers *image;
    ca_error error;
    if (ca_render(scene, &settings, &image, statistics, &error) != CA_OK) bench_die(integrator, &error);
    ca_image_release(image);
    return watch.seconds;
}

static figures measure(const ca_scene *scene, const char *integrator, const size *s)
{
    ca_render_statistics statistics = {.size = sizeof statistics};
    double seconds[RUNS];
    for (uint32_t i = 0; i < s->runs; i++) seconds[i] = render(scene, integrator, s, &statistics);
    const figures f = {.microseconds = 1e6 * bench_median(seconds, (int)s->runs) / ((double)s->width * s->height),
                       .merges = (double)statistics.merges / (double)statistics.camera_paths,
                       .tested = (double)statistics.photons_tested / (double)statistics.merges};
    printf("%-5s %-12s %7.2f us a pixel  %7.2f merges a camera path  %5.2f photons tested a merge\n", integrator,
           s->name, f.microseconds, f.merges, f.tested);
    fflush(stdout);
    return f;
}

static json_t *figures_json(const figures *f)
{
    return json_pack("{s:f, s:f, s:f}", "microseconds_per_pixel", f->microseconds, "merges_per_camera_path",
                     f->merges, "tested_per_merge", f->tested);
}

static void verdict(const char *integrator, const char *what, double value, double goal)
{
    printf("%-5s %-46s %6.3f   (goal: at most %.2f)  %s\n", integrator, what, value, goal,
           value <= goal ? "reached" : "missed");
}

/* Also of the pass with many light paths, where `many`. */
static json_t *measure_sizes(const ca_scene *scene, const char *integrator, bool many)
{
    figures all[SIZES];
    json_t *json = json_object();
    for (int k = 0; k < (many ? SIZES : MANY); k++) {
        all[k] = measure(scene, integrator, &sizes[k]);
        json_object_set_new(json, sizes[k].name, figures_json(&all[k]));
    }
    const figures *large = &all[LARGE], *small = &all[SQUARE];
    verdict(integrator, "3840x2160 over 512x512, time a pixel", large->microseconds / small->microseconds, 1.3);
    verdict(integrator, "3840x2160 over 480x270, tested a merge", large->tested / all[WIDE].tested, 1.1);
    if (many)
        verdict(integrator, "30M light paths over 512x512, tested a merge", all[MANY].tested / small->tested, 1.1);
    return json;
}

int main(int argc, char **argv)
{
    const char *results = bench_results_file(argc, argv);
    static const char *const names[] = {"vcm", "ovcm", "ppm", "bdpm"};
    static const char *const integrators[] = {"vcm:radius_pixels=1", "ovcm:radius_pixels=1", "ppm:radius_pixels=1",
                                              "bdpm:radius_pixels=1"};
    ca_render_settings large = settings_of(integrators[0], &sizes[LARGE]);
    large.samples_per_pixel = 1;
    const double bytes = bench_peak_memory(scene_path, &large);
    printf("%-5s %-12s %7.2f GiB\n", names[0], sizes[LARGE].name, bytes / 0x1p30);
    ca_error error;
    ca_scene *scene;
    if (ca_scene_load(scene_path, NULL, 0, &scene, &error) != CA_OK) bench_die(scene_path, &error);
    json_t *json = json_object();
    json_object_set_new(json, "peak_bytes", json_real(bytes));
    for (size_t i = 0; i < sizeof integrators / sizeof integrators[0]; i++)
        json_object_set_new(json, names[i], measure_sizes(scene, integrators[i], i == 0));
    bench_write_results(results, "sizes", json);
    ca_scene_release(scene);
    return 0;
}
