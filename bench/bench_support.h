/* What the bench programs share: medians, peak memory of a render, its default radius, and their common file of
 * results. */
#ifndef CA_BENCH_BENCH_SUPPORT_H
#define CA_BENCH_BENCH_SUPPORT_H

#include "caustica.h"

#include <jansson.h>

/* Prints the error and ends the program. */
_Noreturn void bench_die(const char *what, const ca_error *error);

/* Sorts the values. */
double bench_median(double *values, int count);

/* The file of results that the command line names, or bench/results.json; ends the program where it says anything
 * else. */
const char *bench_results_file(int argc, char **argv);

/* Sets one key of a JSON file and keeps the others, so that each bench program owns its part of one file. Takes
 * `value` over. */
void bench_write_results(const char *path, const char *key, json_t *value);

/* Peak resident memory, in bytes, of a process that does nothing but load the scene and render it. To be called
 * before this process has started any thread (Embree and loops do when they are first used): it forks. */
double bench_peak_memory(const char *scene_path, const ca_render_settings *settings);

/* The radius that merges take by default in the first pass, 0 where the method does not merge: that of a pilot, which
 * each seed and number of samples has for itself. What is compared over seeds needs one for all. */
double bench_default_radius(const ca_scene *scene, const ca_render_settings *settings);

#endif
