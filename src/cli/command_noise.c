/* caustica noise: where the noise of bidirectional photon mapping comes from, and what other numbers of paths would
 * give. */
#include "base/file.h"
#include "base/memory.h"
#include "base/text.h"
#include "cli/commands.h"
#include "cli/look_ahead.h"
#include "cli/noise_print.h"
#include "cli/outputs.h"
#include "cli/progress.h"
#include "cli/say.h"
#include "cli/shared_options.h"
#include "cli/signals.h"
#include "cli/stats_json.h"
#include "integrator/integrator.h"
#include "noise/layers.h"
#include "render/noise.h"

#include <stdio.h>
#include <string.h>
#include <strings.h>

typedef struct noise_options {
    ca_text_list outputs, define_words, predict_words;
    const char *scene, *camera, *stats, *objective;
    ca_render_settings settings; /* options are read right into it */
    uint32_t iterations, sensor, resolution[2], roi[4];
    bool has_roi, has_sensor, quiet, help;
    ca_places places;
} noise_options;

#define AT(field) .offset = offsetof(noise_options, field)
#define GIVEN(field) .given = offsetof(noise_options, field)

static const ca_option options[] = {
    {.name = "light-paths",
     .argument = "NF",
     .kind = CA_OPTION_COUNT,
     .minimum = 2,
     AT(settings.light_paths),
     .help = "light paths of an iteration, at least 2 (default: the scene's, else 30000)"},
    {.name = "camera-paths",
     .argument = "NB",
     .kind = CA_OPTION_COUNT,
     .minimum = 1,
     AT(settings.camera_paths),
     .help = "camera paths per pixel of an iteration; 2 or more to predict for others than 1 (default: the scene's, "
             "else 4, or the 1 that the method has, as ppm)"},
    {.name = "iterations",
     .argument = "K",
     .kind = CA_OPTION_COUNT,
     .minimum = 2,
     AT(iterations),
     .help = "independent iterations to estimate from, at least 2 (default: 32)"},
    {.name = "objective",
     .argument = "NAME",
     .kind = CA_OPTION_TEXT,
     AT(objective),
     .help = "variance that recommended numbers make small: mean, relative or worst-decile (default: mean)"},
    {.name = "predict",
     .argument = "NF,NB",
     .kind = CA_OPTION_TEXT_LIST,
     AT(predict_words),
     .help = "also say the noise with these numbers of paths, without rendering; several times"},
    {.name = "roi",
     .argument = "x0,y0,x1,y1",
     .kind = CA_OPTION_RECT,
     AT(roi),
     GIVEN(has_roi),
     .help = "average over this part too: pixels of the full film, half open"},
    {.name = "output",
     .letter = 'o',
     .argument = "FILE",
     .kind = CA_OPTION_TEXT_LIST,
     AT(outputs),
     .help = ".exr: all layers; .png: the terms in colours; several times (default: none)"},
    CA_STATS_OPTION("the averages, times and counts", AT(stats)),
    {.name = "integrator",
     .letter = 'i',
     .argument = "NAME[:param=value,...]",
     .kind = CA_OPTION_TEXT,
     AT(settings.integrator),
     .help = "one of those named below (default: the scene's if its noise has three terms, else bdpm); depths set in "
             "the scene stay"},
    CA_DEFINE_OPTION(AT(define_words)),
    CA_SENSOR_OPTION(AT(sensor), GIVEN(has_sensor)),
    CA_CAMERA_OPTION(AT(camera)),
    CA_SEED_OPTION(AT(settings.seed), GIVEN(settings.has_seed)),
    CA_MAX_DEPTH_OPTION(AT(settings.max_depth), GIVEN(settings.has_max_depth)),
    {.name = "radius",
     .argument = "R",
     .kind = CA_OPTION_POSITIVE,
     AT(settings.radius),
     .help = "merge radius (default: the scene's, else the one of least error)"},
    {.name = "alpha",
     .argument = "A",
     .kind = CA_OPTION_REAL,
     AT(settings.alpha),
     GIVEN(settings.has_alpha),
     .help = "its shrinking, 0 to 1 (default: 0, whatever the scene says: see below)"},
    CA_RESOLUTION_OPTION(AT(resolution)),
    CA_CROP_OPTION("measure", AT(settings.crop), GIVEN(settings.has_crop)),
    CA_THREADS_OPTION("; the numbers do not depend on it", AT(settings.threads)),
    CA_MEMORY_OPTION("film, sums and light paths (default: none)", AT(settings.memory_mib)),
    CA_QUIET_OPTION(AT(quiet)),
    CA_HELP_OPTION(AT(help)),
};
static const ca_option_table table = {"noise", options, sizeof options / sizeof options[0]};

/* The law that the numbers belong to. */
static void print_law(void)
{
    char three_terms[CA_INTEGRATOR_NAMES_SIZE], four_terms[CA_INTEGRATOR_NAMES_SIZE];
    ca_integrator_names(CA_ABILITY_PAIR_LAW, " or ", three_terms);
    ca_integrator_names(CA_ABILITY_CONNECTION_NOISE, " or ", four_terms);
    printf("\nThe variance of a pixel in an iteration of %s has three terms (Ershov et al. 2020):\n"
           "    camera   of the camera paths, goes down as 1 / NB\n"
           "    light    of the light paths, goes down as 1 / NF\n"
           "    pair     of each pair of a light and a camera path, goes down as 1 / (NF NB)\n"
           "That of %s has a fourth, of connections (see below).\n",
           three_terms, four_terms);
}

static int print_help(void)
{
    printf("caustica noise SCENE [options]: where the noise comes from, and which numbers of paths give less\n\n");
    ca_options_print(&table, stdout);
    print_law();
    ca_options_print_prose(
        "Printed are averages over pixels of their roots (an estimate below zero counts as 0; how many there were "
        "stands beside), of "
        "their sum (predicted) and of the sample variance over the iterations (measured), in units of luminance. In "
        "a .png red is "
        "the pair, green the camera, blue the light term. The law is one of independent paths, so random numbers are "
        "independent, "
        "whatever the scene's sampler; and one radius is kept for all iterations (alpha 0), so that they are "
        "distributed alike. With "
        "an alpha above 0 the numbers are averages over the radii.\n"
        "Then a few iterations are timed, and the numbers recommended that have the least variance times processor "
        "time, that is the "
        "least noise after a given time: NF with a map of camera paths per pixel (layer Rays.Numbers of an .exr, for "
        "render --rays), "
        "and the best uniform pair of numbers, which needs no map. Where the method has one camera path "
        "(ppm): NF.\n"
        "Where paths connect, the three terms are those of all light but what connections bring, and the fourth one "
        "is theirs, with "
        "what they have in common with the rest; it may be negative. Their weights depend on NF and NB: what is "
        "found is also weighted as "
        "with the predictions' numbers, and with 1/16 to 16 times NF, among which numbers are recommended: one of "
        "camera paths for all "
        "pixels, for the mean or the relative variance.\n"
        "SIGINT (Ctrl-C), SIGTERM, SIGHUP, SIGXCPU and SIGUSR2 finish the iteration (the second one at least) and "
        "write what was measured; "
        "paths are then not "
        "timed (any longer), and no numbers recommended. A second SIGINT or SIGTERM ends at once.\n"
        "Example: caustica noise scene.xml --light-paths 30000 --camera-paths 10 --predict 300000,100\n",
        stdout);
    return CA_EXIT_DONE;
}

/* ---- Before the work ------------------------------------------------------------------------------------------- */

static ca_status parse_prediction(const char *text, ca_noise_prediction *p, ca_error *error)
{
    const char *comma = strchr(text, ',');
    uint64_t light_paths = 0, camera_paths = 0;
    if (!comma || !ca_parse_digits(text, (size_t)(comma - text), UINT32_MAX, &light_paths) ||
        !ca_parse_digits(comma + 1, strlen(comma + 1), UINT32_MAX, &camera_paths) || light_paths < 1 ||
        camera_paths < 1)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "--predict: \"%.100s\" is not NF,NB, two whole numbers of at least 1", text);
    *p = (ca_noise_prediction){.light_paths = (uint32_t)light_paths, .camera_paths = (uint32_t)camera_paths};
    return CA_OK;
}

static ca_status parse_predictions(const noise_options *o, ca_noise_report *report, ca_error *error)
{
    report->prediction_count = o->predict_words.count;
    report->predictions = ca_alloc_zeroed(report->prediction_count, sizeof *report->predictions);
    if (!report->predictions) return ca_fail_memory(error, "the command line");
    for (size_t i = 0; i < report->prediction_count; i++)
        CA_TRY(parse_prediction(o->predict_words.items[i], &report->predictions[i], error));
    return CA_OK;
}

static ca_status check_predictions(const ca_noise_report *report, ca_error *error)
{
    for (size_t i = 0; i < report->prediction_count; i++)
        if (report->measured.camera_paths == 1 && report->predictions[i].camera_paths > 1)
            return ca_fail(
                error, CA_ERROR_ARGUMENT, NULL,
                "--predict: from one camera path the noise of %u cannot be predicted: measure with --camera-paths 2 "
                "or more",
                report->predictions[i].camera_paths);
        else if (report->connects && report->predictions[i].camera_paths > report->predictions[i].light_paths)
            return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                           "--predict: of connected paths noise is predicted for no more camera paths per pixel than "
                           "light paths, not for "
                           "%u,%u",
                           report->predictions[i].light_paths, report->predictions[i].camera_paths);
    return CA_OK;
}

static bool is_png(const char *path) { return strcasecmp(ca_path_extension(path), ".png") == 0; }
static bool is_exr(const char *path) { return strcasecmp(ca_path_extension(path), ".exr") == 0; }

static ca_status check_outputs(noise_options *o, ca_error *error)
{
    for (size_t i = 0; i < o->outputs.count; i++)
        if (!is_png(o->outputs.items[i]) && !is_exr(o->outputs.items[i]))
            return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                           "%.300s: noise is written as .exr (all layers) or .png (the terms)", o->outputs.items[i]);
    CA_TRY(ca_places_read(&o->places, o->scene, "which is the scene", error));
    return ca_outputs_check_places(&o->outputs, o->stats, &o->places, error);
}

static ca_status check(noise_options *o, const ca_text_list *operands, ca_noise_report *report, ca_error *error)
{
    CA_TRY(ca_options_scene_operand(operands, &o->scene, error));
    ca_ray_objective objective;
    ca_error reason = {""};
    if (ca_ray_objective_find(o->objective, &objective, &reason) != CA_OK)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "--objective: %.900s", reason.message);
    report->objective = o->objective;
    report->has_roi = o->has_roi;
    memcpy(report->roi, o->roi, sizeof report->roi);
    CA_TRY(parse_predictions(o, report, error));
    return check_outputs(o, error);
}

/* ---- Printing -------------------------------------------------------------------------------------------------- */

/* A word of a command line that a shell takes for one. */
static void print_word(const char *option, const char *word)
{
    static const char *const plain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=:,./@%";
    printf(" %s%s", option, option[0] ? " " : "");
    if (word[0] && word[strspn(word, plain)] == '\0') {
        ca_say(stdout, "%s", word);
        return;
    }
    printf("'");
    for (const char *c = word; *c; c += strcspn(c, "'")) {
        if (*c == '\'') {
            printf("'\\''");
            c++;
        }
        ca_say(stdout, "%.*s", (int)strcspn(c, "'"), c);
    }
    printf("'");
}

/* Does a parameter, "name=value", choose a number of paths? */
static bool is_number_of_paths(const char *parameter)
{
    return strncmp(parameter, "light_paths=", 12) == 0 || strncmp(parameter, "camera_paths=", 13) == 0;
}

/* "name:parameter=value,..." without numbers of paths, which are recommended instead. What an integrator has
 * understood needs no quotes. */
static void print_integrator(const char *text)
{
    const size_t name = strcspn(text, ":");
    char before = ':';
    printf(" -i %.*s", (int)name, text);
    for (const char *c = text[name] ? text + name + 1 : NULL; c; c = strchr(c, ',') ? strchr(c, ',') + 1 : NULL) {
        if (is_number_of_paths(c)) continue;
        printf("%c%.*s", before, (int)strcspn(c, ","), c);
        before = ',';
    }
}

/* The words that noise and render share, as they were given. */
static void print_shared_words(const noise_options *o, const ca_noise_setup *setup)
{
    const ca_render_settings *s = &o->settings;
    print_word("", o->scene);
    const char *integrator = s->integrator ? s->integrator : setup->integrator;
    print_integrator(integrator);
    for (size_t i = 0; i < o->define_words.count; i++) print_word("-D", o->define_words.items[i]);
    if (o->has_sensor) printf(" --sensor %u", o->sensor);
    if (o->camera) print_word("--camera", o->camera);
    if (s->has_max_depth) printf(" --max-depth %d", s->max_depth);
    if (setup->radius > 0.0 && !ca_render_overrides_mention(integrator, "radius"))
        printf(" --radius %.9g", setup->radius); /* with other numbers of paths the default is another one */
    if (!ca_render_overrides_mention(integrator, "alpha"))
        printf(" --alpha %.9g", s->alpha); /* 0 unless given, whatever the scene says */
    if (o->resolution[0]) printf(" --resolution %ux%u", o->resolution[0], o->resolution[1]);
    if (s->has_crop) printf(" --crop %u,%u,%u,%u", s->crop[0], s->crop[1], s->crop[2], s->crop[3]);
    if (s->memory_mib > 0.0) printf(" --memory %.9g", s->memory_mib);
}

/* What to type next. */
static void print_next(const noise_options *o, const ca_noise_setup *setup, const ca_noise_report *report)
{
    const ca_noise_recommendation *r = &report->recommendation;
    const bool has_map = ca_noise_has_map(report);
    const char *map = NULL;
    for (size_t i = 0; i < o->outputs.count; i++)
        if (is_exr(o->outputs.items[i])) map = o->outputs.items[i];
    if (map && has_map) {
        printf("next: caustica render");
        print_shared_words(o, setup);
        print_word("--rays", map);
        printf("\n");
    }
    printf(map && has_map ? "  or: caustica render" : "next: caustica render");
    print_shared_words(o, setup);
    printf(" --light-paths %u --camera-paths %.0f\n", r->uniform.light_paths, r->uniform.camera_paths);
    if (!map && has_map)
        printf("  (with -o FILE.exr the recommended map is written, for render's --rays)\n");
}

static void print_report(const noise_options *o, const ca_noise_setup *setup, const ca_noise_report *report,
                         double scale)
{
    ca_noise_print(report);
    for (size_t i = 0; i < o->outputs.count; i++) {
        ca_say(stdout, "wrote %s", o->outputs.items[i]);
        if (is_png(o->outputs.items[i]))
            printf(" (full red, green or blue: a pair, camera or light term of r.m.s. %.4g)", scale);
        printf("\n");
    }
    if (o->stats) ca_say(stdout, "wrote %s\n", o->stats);
    if (ca_noise_recommends(report)) print_next(o, setup, report);
}

/* What is used instead of what the scene says. */
static void print_replaced(const ca_noise_setup *setup, const ca_scene *scene)
{
    const ca_scene_desc *desc = &scene->desc;
    if (desc->names_sampler && desc->sampler.kind != CA_SAMPLER_INDEPENDENT)
        printf("sampler: independent instead of the scene's %s, as the law of noise wants\n",
               ca_sampler_name(desc->sampler.kind));
    if (setup->instead_of_scene)
        ca_say(stdout, "integrator: %s instead of the scene's %s\n", setup->integrator, desc->integrator.name);
}

/* ---- The work -------------------------------------------------------------------------------------------------- */

static ca_status check_settings(const noise_options *o, const ca_scene *scene, const ca_render_settings *settings,
                                ca_noise_setup *setup, ca_noise_report *report, ca_error *error)
{
    CA_TRY(ca_noise_check(scene, settings, o->iterations, setup, error));
    report->measured.light_paths = setup->light_paths;
    report->measured.camera_paths = setup->camera_paths;
    report->connects = setup->connects;
    CA_TRY(check_predictions(report, error));
    if (!o->has_roi) return CA_OK;
    ca_error reason = {""};
    if (ca_noise_check_region(o->roi, setup->picture, &reason) == CA_OK) return CA_OK;
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "--roi: %.900s", reason.message);
}

static ca_status average(const ca_noise *noise, const ca_noise_report *report, ca_noise_prediction *p,
                         ca_error *error)
{
    CA_TRY(ca_noise_average(noise, NULL, p->light_paths, p->camera_paths, &p->image, error));
    if (!report->has_roi) return CA_OK;
    return ca_noise_average(noise, report->roi, p->light_paths, p->camera_paths, &p->roi, error);
}

static ca_status average_all(const ca_noise *noise, ca_noise_report *report, ca_error *error)
{
    CA_TRY(average(noise, report, &report->measured, error));
    for (size_t i = 0; i < report->prediction_count; i++)
        CA_TRY(average(noise, report, &report->predictions[i], error));
    return CA_OK;
}

static ca_status write_picture(const ca_image_layers *image, const char *path, double *scale, ca_error *error)
{
    ca_image_layers *picture = NULL;
    CA_TRY(ca_noise_picture(image, &picture, scale, error));
    const ca_status status = ca_image_save(picture, path, 0.0f, error);
    ca_image_release(picture);
    return status;
}

static ca_status write_outputs(const noise_options *o, const ca_image_layers *image, const ca_noise_report *report,
                               double *scale, ca_error *error)
{
    ca_status all = CA_OK;
    ca_error reason = {""};
    for (size_t i = 0; i < o->outputs.count; i++) {
        const char *path = o->outputs.items[i];
        const ca_status status =
            is_png(path) ? write_picture(image, path, scale, &reason) : ca_image_save(image, path, 0.0f, &reason);
        ca_output_note(&all, error, status, &reason);
    }
    if (o->stats) ca_output_note(&all, error, ca_stats_write_noise(o->stats, image, report, &reason), &reason);
    return all;
}

/* Before the first iteration. */
static ca_status reserve_outputs(const noise_options *o, const ca_noise_setup *setup, ca_reserve **reserve,
                                 ca_error *error)
{
    const ca_output_files files = {.paths = (const char *const *)o->outputs.items, .count = o->outputs.count};
    const uint32_t width = setup->picture[2] - setup->picture[0], height = setup->picture[3] - setup->picture[1];
    bool has_picture = false;
    for (size_t i = 0; i < o->outputs.count; i++) has_picture = has_picture || is_png(o->outputs.items[i]);
    const size_t picture = has_picture ? (size_t)width * height * CA_NOISE_PICTURE_BYTES : 0;
    return ca_outputs_reserve(&files, width, height, picture, reserve, error);
}

/* Also with the weights of the predictions' numbers and of those that may be recommended. */
static ca_status measure_for(const noise_options *o, const ca_scene *scene, const ca_render_settings *settings,
                             ca_noise_report *report, ca_noise **noise, ca_image_layers **image, ca_error *error)
{
    ca_noise_counts *counts = ca_alloc(report->prediction_count + CA_NOISE_GRID, sizeof *counts);
    size_t count = 0;
    if (!counts) return ca_fail_memory(error, "the predictions");
    for (; count < report->prediction_count; count++)
        counts[count] =
            (ca_noise_counts){report->predictions[count].light_paths, report->predictions[count].camera_paths};
    if (!ca_noise_why_no_numbers(report))
        count += ca_noise_grid(report->measured.light_paths, report->measured.camera_paths, counts + count);
    const ca_status status = ca_noise_measure_for(scene, settings, o->iterations, counts, count, noise, image,
                                                  &report->statistics, error);
    ca_free(counts);
    return status;
}

/* Renders, averages and chooses. The seconds that `line` shows begin anew with the timing of paths. With an image
 * there is a report, even if a later step failed. */
static ca_status work(const noise_options *o, const ca_scene *scene, const ca_render_settings *settings,
                      ca_progress_line *line, ca_noise_report *report, ca_image_layers **image, ca_error *error)
{
    ca_noise *noise = NULL;
    ca_error reason = {""};
    ca_status status = measure_for(o, scene, settings, report, &noise, image, error);
    if (*image) status = ca_fail_also(error, status, average_all(noise, report, &reason), &reason);
    line->last_drawn = -1.0;
    if (status == CA_OK && !ca_noise_why_no_numbers(report))
        status = ca_noise_recommend(noise, scene, settings, o->objective, *image, &report->recommendation, error);
    ca_noise_release(noise);
    return status;
}

/* Says what the picture will lack: that of a render of as many samples, with what is used instead of the scene's. */
static ca_status look_ahead(const noise_options *o, const ca_scene *scene, const ca_render_settings *settings,
                            const ca_noise_setup *setup, ca_error *error)
{
    ca_render_settings render = *settings;
    if (scene->light_count == 0) return CA_OK; /* the report says so */
    render.samples_per_pixel = o->iterations * setup->camera_paths;
    render.camera_paths = setup->camera_paths;
    if (!render.integrator) render.integrator = setup->integrator;
    return ca_look_ahead(scene, &render, NULL, NULL, error);
}

static ca_status measure(const noise_options *o, const ca_scene *scene, ca_noise_report *report, ca_error *error)
{
    ca_progress_line line = ca_progress_start(!o->quiet);
    ca_render_settings settings = o->settings;
    settings.width = o->resolution[0];
    settings.height = o->resolution[1];
    settings.progress = ca_progress_report;
    settings.progress_user = &line;
    settings.stop = ca_signals_stop();
    ca_noise_setup setup;
    ca_image_layers *image = NULL;
    double scale = 1.0;
    CA_TRY(check_settings(o, scene, &settings, &setup, report, error));
    if (!o->quiet) print_replaced(&setup, scene);
    CA_TRY(look_ahead(o, scene, &settings, &setup, error));
    ca_reserve *reserve;
    CA_TRY(reserve_outputs(o, &setup, &reserve, error));
    ca_signals_catch(o->quiet);
    ca_status status = work(o, scene, &settings, &line, report, &image, error);
    ca_progress_clear(&line);
    ca_error reason = {""};
    ca_reserve_open(reserve);
    const ca_status written = image ? write_outputs(o, image, report, &scale, &reason) : CA_OK;
    ca_reserve_release(reserve);
    ca_output_note(&status, error, written, &reason);
    ca_signals_release();
    if (status == CA_OK) {
        ca_outputs_warn(&report->statistics);
        if (!o->quiet) print_report(o, &setup, report, scale);
    }
    ca_image_release(image);
    return status;
}

static ca_status load_and_measure(noise_options *o, ca_noise_report *report, ca_error *error)
{
    ca_scene *scene;
    CA_TRY(ca_options_load_sensor(o->scene, &o->define_words, o->sensor, o->camera, !o->quiet, &scene, error));
    if (scene->light_count == 0) ca_say(stderr, "caustica: warning: the scene has no light: there is no noise\n");
    ca_status status = ca_places_read_scene(&o->places, scene, error);
    if (status == CA_OK) status = measure(o, scene, report, error);
    ca_scene_release(scene);
    return status;
}

int ca_command_noise(int word_count, char *const words[])
{
    if (ca_help_wanted(word_count, words)) return print_help();
    noise_options o = {.iterations = 32};
    ca_noise_report report = {0};
    ca_text_list operands = {0};
    ca_error error = {""};
    ca_render_settings_init(&o.settings);
    ca_status status = ca_options_parse(&table, word_count, words, &o, &operands, &error);
    if (status == CA_OK) status = check(&o, &operands, &report, &error);
    ca_signals_catch_save(); /* there is no picture yet, but the work goes on */
    if (status == CA_OK) status = load_and_measure(&o, &report, &error);
    ca_signals_release_save();
    ca_free(report.predictions);
    ca_places_destroy(&o.places);
    ca_text_list_destroy(&o.outputs);
    ca_text_list_destroy(&o.define_words);
    ca_text_list_destroy(&o.predict_words);
    ca_text_list_destroy(&operands);
    return status == CA_OK ? CA_EXIT_DONE : ca_report("noise", status, &error);
}
