#include "bench_support.h"

#include "base/file.h"

#include <stdio.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

void bench_die(const char *what, const ca_error *error)
{
    fprintf(stderr, "%s: %s\n", what, error->message);
    exit(1);
}

static int compare_doubles(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

double bench_median(double *values, int count)
{
    qsort(values, (size_t)count, sizeof *values, compare_doubles);
    return count % 2 ? values[count / 2] : 0.5 * (values[count / 2 - 1] + values[count / 2]);
}

const char *bench_results_file(int argc, char **argv)
{
    if (argc == 1) return CA_SOURCE_DIR "/bench/results.json";
    if (argc == 2 && argv[1][0] != '-') return argv[1];
    fprintf(stderr, "usage: %s [RESULTS.json]\n", argv[0]);
    exit(2);
}

void bench_write_results(const char *path, const char *key, json_t *value)
{
    json_t *root = json_load_file(path, 0, NULL);
    if (!json_is_object(root)) {
        json_decref(root);
        root = json_object();
    }
    json_object_set_new(root, key, value);
    ca_file_writer writer;
    ca_error error;
    if (ca_file_create(&writer, path, &error) != CA_OK) bench_die("results", &error);
    json_dumpf(root, writer.stream, JSON_INDENT(2) | JSON_REAL_PRECISION(5));
    fputc('\n', writer.stream);
    json_decref(root);
    if (ca_file_commit(&writer, &error) != CA_OK) bench_die("results", &error);
}

static _Noreturn void render_and_report(const char *scene_path, const ca_render_settings *settings, int out)
{
    ca_scene *scene;
    ca_image_layers *image;
    ca_render_statistics statistics = {.size = sizeof statistics};
    ca_error error;
    if (ca_scene_load(scene_path, NULL, 0, &scene, &error) != CA_OK) bench_die(scene_path, &error);
    if (ca_render(scene, settings, &image, &statistics, &error) != CA_OK) bench_die(scene_path, &error);
    const double bytes = (double)statistics.peak_memory_bytes;
    _exit(write(out, &bytes, sizeof bytes) == (ssize_t)sizeof bytes ? 0 : 1);
}

double bench_peak_memory(const char *scene_path, const ca_render_settings *settings)
{
    int ends[2];
    if (pipe(ends) != 0) perror("pipe"), exit(1);
    fflush(NULL);
    const pid_t child = fork();
    if (child < 0) perror("fork"), exit(1);
    if (child == 0) render_and_report(scene_path, settings, ends[1]);
    close(ends[1]);
    double bytes = 0.0;
    const bool answered = read(ends[0], &bytes, sizeof bytes) == (ssize_t)sizeof bytes;
    close(ends[0]);
    int status;
    if (waitpid(child, &status, 0) != child || status != 0 || !answered) exit(1); /* the child has said why */
    return bytes;
}

double bench_default_radius(const ca_scene *scene, const ca_render_settings *settings)
{
    ca_preflight found = {0};
    ca_error error;
    if (ca_preflight_make(scene, settings, &found, &error) != CA_OK) bench_die(settings->integrator, &error);
    return found.radius;
}
