#include "cli/noise_print.h"

#include "base/text.h"
#include "cli/progress.h"
#include "noise/ray_numbers.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- Averages -------------------------------------------------------------------------------------------------- */

static void print_row(const char *name, const ca_noise_report *report, double image, uint64_t image_negative,
                      double roi, uint64_t roi_negative)
{
    printf("  %-18s%12.6g%10llu", name, image, (unsigned long long)image_negative);
    if (report->has_roi) printf("%14.6g%10llu", roi, (unsigned long long)roi_negative);
    printf("\n");
}

#define ROW(name, field)                                                                                             \
    print_row(name, report, i->field##_rms, i->negative_##field, r->field##_rms, r->negative_##field)

static void print_table(const ca_noise_report *report)
{
    const ca_noise_summary *i = &report->measured.image, *r = &report->measured.roi;
    printf("  %-18s%12s%10s", "", "image", "negative");
    if (report->has_roi) printf("%14s%10s", "roi", "negative");
    printf("\n  %-18s%12.6g", "mean luminance", i->luminance);
    if (report->has_roi) printf("%10s%14.6g", "", r->luminance);
    printf("\n");
    ROW("r.m.s. measured", measured);
    ROW("r.m.s. predicted", predicted);
    ROW("  camera term", camera);
    ROW("  light term", light);
    ROW("  pair term", pair);
    if (report->connects) ROW("  connection term", connect);
}

static void print_prediction(const char *where, const ca_noise_report *report, const ca_noise_summary *s)
{
    printf("%s r.m.s. %.6g (camera %.4g, light %.4g, pair %.4g", where, s->predicted_rms, s->camera_rms, s->light_rms,
           s->pair_rms);
    if (report->connects) printf(", connections %.4g", s->connect_rms);
    printf("; negative %llu)", (unsigned long long)s->negative_predicted);
}

static void print_averages(const ca_noise_report *report)
{
    const ca_render_statistics *s = &report->statistics;
    char time[32];
    ca_format_seconds(s->seconds, time, sizeof time);
    const uint32_t light_paths = report->measured.light_paths, camera_paths = report->measured.camera_paths;
    const uint64_t pixels = report->measured.image.pixels;
    printf("%llu iterations of %u %s and %u %s per pixel, %llu %s, %s%s\n", (unsigned long long)s->iterations,
           light_paths, ca_noun(light_paths, "light path", "light paths"), camera_paths,
           ca_noun(camera_paths, "camera path", "camera paths"), (unsigned long long)pixels,
           ca_noun((double)pixels, "pixel", "pixels"), time, s->interrupted ? " (ended early by a signal)" : "");
    print_table(report);
    for (size_t i = 0; i < report->prediction_count; i++) {
        const ca_noise_prediction *p = &report->predictions[i];
        printf("  with %u,%u:", p->light_paths, p->camera_paths);
        print_prediction(" image", report, &p->image);
        if (report->has_roi) print_prediction("; roi", report, &p->roi);
        printf("\n");
    }
}

/* ---- Times ----------------------------------------------------------------------------------------------------- */

static void print_time(const char *name, double seconds, double error, double number, const char *of_what)
{
    if (isnan(seconds))
        printf("  %-18s%12s\n", name, "none");
    else if (!ca_noise_is_measured(seconds, error))
        printf("  %-18s%-24s%12.4g %s\n", name, "  not measurable", number, of_what);
    else
        printf("  %-18s%12.4g +- %-8.2g%12.4g %s\n", name, 1e6 * seconds, 1e6 * error, number, of_what);
}

static void print_times(const ca_noise_times *t)
{
    printf("microseconds of a processor, timed around %u %s:\n", t->light_paths,
           ca_noun(t->light_paths, "light path", "light paths"));
    print_time("iteration", t->iteration, t->iteration_error, 1.0, "without any path");
    print_time("light path", t->light_path, t->light_path_error, t->light_paths, "an iteration");
    print_time("camera path", t->camera_path, t->camera_path_error, t->segments_per_camera_path, "segments");
    print_time("merge candidate", t->candidate, t->candidate_error, t->candidates_per_pair * t->light_paths,
               "a camera path");
}

/* ---- Numbers --------------------------------------------------------------------------------------------------- */

static const char *objective_words(const char *objective)
{
    if (objective && strcmp(objective, "relative") == 0) return "mean relative variance";
    if (objective && strcmp(objective, "worst-decile") == 0) return "variance in the noisiest tenth of the pixels";
    return "mean variance";
}

static void print_numbers(const char *name, const ca_noise_numbers *n, const ca_noise_numbers *given)
{
    printf("  %-18s%12u%14.4g%14.4g%12.4g%12.4g\n", name, n->light_paths, n->camera_paths, n->variance, n->seconds,
           given->variance * given->seconds / (n->variance * n->seconds));
}

static void print_recommendation(const ca_noise_report *report)
{
    const ca_noise_recommendation *r = &report->recommendation;
    printf("least %s after a given time, by these estimates:\n", objective_words(report->objective));
    printf("  %-18s%12s%14s%14s%12s%12s\n", "", "light paths", "camera paths", "variance", "seconds", "gain");
    print_numbers("measured", &r->given, &r->given);
    print_numbers("best uniform", &r->uniform, &r->given);
    if (ca_noise_has_map(report)) {
        print_numbers("recommended", &r->best, &r->given);
        printf("  recommended is a map of %u to %u camera paths, %.4g in the mean\n", r->fewest_camera_paths,
               r->most_camera_paths, r->best.camera_paths);
    }
    if (r->best.light_paths == r->most_light_paths)
        printf("  %u light paths are the most that are recommended: 128 times those measured, %d at most, and what "
               "fits the memory\n",
               r->most_light_paths, CA_RAY_MOST_LIGHT_PATHS_HELD);
}

const char *ca_noise_why_no_numbers(const ca_noise_report *report)
{
    if (!report->connects) return NULL;
    if (report->measured.camera_paths == 1)
        return "of connected paths that takes a measurement with two camera paths per pixel or more";
    if (report->objective && strcmp(report->objective, "worst-decile") == 0)
        return "of connected paths they are for the mean or the relative variance";
    return NULL;
}

static const char *why_none(const ca_noise_report *report)
{
    const char *why = ca_noise_why_no_numbers(report);
    if (why) return why;
    if (report->recommendation.interrupted) return "a signal interrupted the timing of paths";
    return report->statistics.mean_luminance > 0.0 ? "no noise was found, all are as good" : "no light was found";
}

void ca_noise_print(const ca_noise_report *report)
{
    print_averages(report);
    if (!ca_noise_recommends(report)) {
        printf("no numbers are recommended: %s\n", why_none(report));
        return;
    }
    print_times(&report->recommendation.times);
    print_recommendation(report);
}
