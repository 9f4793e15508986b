/* caustica render: from a scene file to image files. */
#include "base/text.h"
#include "cli/live_view.h"
#include "cli/look_ahead.h"
#include "cli/mpi_ranks.h"
#include "cli/progress.h"
#include "cli/render_options.h"
#include "cli/say.h"
#include "cli/signals.h"
#include "image/layers.h"
#include "render/progress.h"
#include "scene/scene.h"

#include <math.h>
#include <stdio.h>

static ca_output_files output_files(const ca_render_options *o)
{
    return (ca_output_files){.paths = o->outputs.items,
                             .count = o->outputs.count,
                             .look = o->look,
                             .layers = o->layers,
                             .stats = o->stats};
}

/* What was rendered is written also where the render could not write a file of its own. */
static ca_status write_outputs(const ca_render_options *o, const ca_image_layers *image,
                               const ca_render_statistics *statistics, ca_status rendered, ca_error *error)
{
    ca_error reason = {""};
    const ca_output_files files = output_files(o);
    if (statistics->iterations == 0) return rendered;
    ca_output_note(&rendered, error, ca_outputs_write(&files, image, statistics, &reason), &reason);
    return rendered;
}

static void print_rays(const ca_rays_statistics *rays)
{
    char time[32];
    if (rays->light_paths == 0) return;
    printf("%u %s and %.4g %s per pixel in an iteration", rays->light_paths,
           ca_noun(rays->light_paths, "light path", "light paths"), rays->camera_paths,
           ca_noun(rays->camera_paths, "camera path", "camera paths"));
    if (rays->pilot_seconds > 0.0) {
        ca_format_seconds(rays->pilot_seconds, time, sizeof time);
        static const char *const formats[] = {"; ended in its pilot, %s", "; pilot %s", " in the end; pilot %s"};
        printf(formats[rays->phases < 2 ? rays->phases : 2], time);
    }
    if (rays->predicted_gain > 0.0) printf(", predicted gain over its numbers %.3g", rays->predicted_gain);
    printf("\n");
    if (isnan(rays->light_path_seconds)) return;
    printf("a light path takes %.3g us of a processor, a camera path %.3g us", 1e6 * rays->light_path_seconds,
           1e6 * rays->camera_path_seconds);
    if (!isnan(rays->candidate_seconds)) printf(", a merge candidate %.3g ns", 1e9 * rays->candidate_seconds);
    printf("\n");
}

static void print_summary(const ca_render_options *o, const ca_image_layers *image, const ca_render_statistics *s)
{
    char time[32];
    uint32_t width, height;
    ca_image_size(image, &width, &height);
    ca_format_seconds(s->seconds, time, sizeof time);
    printf("%u x %u pixels, %.4g %s per pixel, %s", width, height, s->samples_per_pixel,
           ca_noun(s->samples_per_pixel, "sample", "samples"), time);
    if (s->blocks[1] > 0)
        printf(", blocks %llu:%llu", (unsigned long long)s->blocks[0], (unsigned long long)s->blocks[1]);
    if (o->settings.has_passes)
        printf(", passes %llu:%llu", (unsigned long long)s->passes[0], (unsigned long long)s->passes[1]);
    if (s->passes_resumed > 0)
        printf(", resumed after %llu %s", (unsigned long long)s->passes_resumed,
               s->blocks[1] > 0 ? ca_noun((double)s->passes_resumed, "block", "blocks")
                                : ca_noun((double)s->passes_resumed, "pass", "passes"));
    if (s->noise_percent >= 0.0) printf(", noise %.3g %%", s->noise_percent);
    if (s->has_confidence)
        printf(", no error bars for %.3g %% of the pixels, widened ones for %.3g %%", 100.0 * s->confidence_marked,
               100.0 * s->confidence_widened);
    const bool by_view = o->serves && !ca_signals_arrived(); /* the signal may have been another rank's */
    printf("%s\n", !s->interrupted ? "" : by_view ? " (ended early by the live view)" : " (ended early by a signal)");
    print_rays(&s->numbers_of_rays);
    for (size_t i = 0; i < o->outputs.count; i++) ca_say(stdout, "wrote %s\n", o->outputs.items[i]);
    if (o->settings.strategies_directory) ca_say(stdout, "wrote %s/\n", o->settings.strategies_directory);
    if (o->stats) ca_say(stdout, "wrote %s\n", o->stats);
}

/* Why a range of passes or blocks has no image; NULL: it has one. */
static const char *why_no_image(const ca_render_settings *settings)
{
    if (settings->has_blocks && settings->blocks[0] > 0)
        return "an image needs all blocks from 0, and the part file is written at the end of the render";
    if (settings->has_passes && settings->passes[0] > 0)
        return "an image needs all passes from 0, and the part file is written at the end of the render";
    return NULL;
}

static ca_status start_live_view(ca_render_options *o, ca_live_view *view, ca_error *error)
{
    const ca_live_view_settings settings = {
        .serves = o->serves,
        .address = o->serve_address,
        .port = o->port,
        .tev = o->tev,
        .scene = o->scene,
        .threads = o->settings.threads,
        .files = output_files(o),
        .keep = &o->keep,
        .no_image = why_no_image(&o->settings),
    };
    return ca_live_view_start(view, &settings, !o->quiet, error);
}

/* Why a render to a noise target ended although its noise is not known. Of a scene without light all is said. */
static void warn_given_up(const ca_render_options *o, const ca_scene *scene, const ca_render_statistics *s)
{
    if (!o->has_noise || s->interrupted || s->noise_percent >= 0.0 || scene->light_count == 0) return;
    ca_say(stderr,
           "caustica: warning: no light was found in %.4g %s per pixel: a black picture has no noise that could "
           "reach %.4g %%; --spp or --time render longer\n",
           s->samples_per_pixel, ca_noun(s->samples_per_pixel, "sample", "samples"), o->settings.noise_percent);
}

static void warn_ran_out_of_passes(const ca_render_options *o, const ca_render_statistics *s)
{
    char reached[64], asked[64];
    if (!ca_progress_ran_out_of_passes(&o->settings, s)) return;
    if (o->has_noise) {
        snprintf(reached, sizeof reached, "a noise of %.3g %%", s->noise_percent);
        snprintf(asked, sizeof asked, "--noise %.4g", o->settings.noise_percent);
    } else {
        snprintf(reached, sizeof reached, "%.3g s", s->seconds);
        snprintf(asked, sizeof asked, "--time %.4g", o->settings.seconds);
    }
    ca_say(stderr,
           "caustica: warning: the render ended at %s, before %s: %llu passes are the most that it can have; where "
           "the method has --camera-paths, more of them make a pass less noisy\n",
           reached, asked, (unsigned long long)s->iterations);
}

/* Does a part end where the others cannot go on? */
static void warn_of_torn_replicate(const ca_render_options *o, const ca_scene *scene, const ca_render_statistics *s)
{
    const ca_render_settings *settings = &o->settings;
    if (!settings->part_path || settings->replicates == 0 || s->iterations == 0) return;
    const double asked = settings->samples_per_pixel ? settings->samples_per_pixel : scene->desc.samples_per_pixel;
    const double passes = ceil(asked / s->samples_per_pixel * (double)s->iterations);
    const uint64_t each = (uint64_t)passes / settings->replicates;
    if (each == 0 || (s->passes[0] % each == 0 && s->passes[1] % each == 0)) return;
    ca_say(stderr,
           "caustica: warning: %s with the passes %llu:%llu ends in the middle of a replicate of %llu passes: it "
           "adds up with no other part\n",
           settings->part_path, (unsigned long long)s->passes[0], (unsigned long long)s->passes[1],
           (unsigned long long)each);
}

/* Before the first pass; the image has at most the size of the film. */
static ca_status reserve_outputs(const ca_render_options *o, const ca_scene *scene, ca_reserve **reserve,
                                 ca_error *error)
{
    const ca_output_files files = output_files(o);
    const bool resized = o->resolution[0] > 0;
    const ca_film_desc *film = &scene->desc.film;
    return ca_outputs_reserve(&files, resized ? o->resolution[0] : film->width,
                              resized ? o->resolution[1] : film->height, 0, reserve, error);
}

/* Of all ranks. */
static ca_render_settings common_settings(const ca_render_options *o)
{
    ca_render_settings settings = o->settings;
    settings.width = o->resolution[0];
    settings.height = o->resolution[1];
    settings.stop = ca_signals_stop();
    settings.ranks = ca_mpi_ranks();
    return settings;
}

static ca_status render_image(const ca_render_options *o, const ca_scene *scene, ca_live_view *view,
                              ca_image_layers **image, ca_render_statistics *statistics, ca_error *error)
{
    ca_render_settings settings = common_settings(o);
    settings.progress = ca_live_view_report;
    settings.progress_user = view;
    if (!o->keep.wanted) settings.checkpoint_taken = ca_live_view_next_checkpoint;
    ca_keep_fill(&o->keep, &settings);
    ca_reserve *reserve = NULL;
    ca_status status = reserve_outputs(o, scene, &reserve, error);
    if (status == CA_OK) status = ca_look_ahead(scene, &settings, NULL, &settings.radius, error);
    status = ca_ranks_agree(settings.ranks, status, error);
    if (status == CA_OK) status = ca_render(scene, &settings, image, statistics, error);
    ca_progress_clear(&view->line);
    ca_reserve_open(reserve);
    status = write_outputs(o, *image, statistics, status, error);
    ca_reserve_release(reserve);
    return status;
}

static ca_status render_scene(ca_render_options *o, const ca_scene *scene, ca_error *error)
{
    ca_live_view view;
    ca_render_statistics statistics;
    ca_image_layers *image = NULL;
    ca_render_statistics_init(&statistics);
    ca_keep_tell(&o->keep, o->quiet);
    CA_TRY(ca_ranks_agree(ca_mpi_ranks(), start_live_view(o, &view, error), error));
    ca_signals_catch(o->quiet);
    const ca_status status = render_image(o, scene, &view, &image, &statistics, error);
    ca_outputs_warn(&statistics);
    if (status == CA_OK) {
        warn_given_up(o, scene, &statistics);
        warn_ran_out_of_passes(o, &statistics);
        warn_of_torn_replicate(o, scene, &statistics);
        if (image) ca_layer_choice_warn(&o->layers, image);
        if (!o->quiet) print_summary(o, image, &statistics);
    }
    if (status == CA_OK) ca_keep_end(&o->keep, &statistics);
    ca_live_view_end(&view, image, &statistics);
    ca_signals_release();
    return status;
}

/* The same steps on a rank that writes nothing, each of which all ranks take or none. */
static ca_status help_render(const ca_render_options *o, const ca_scene *scene, ca_error *error)
{
    const ca_ranks *ranks = ca_mpi_ranks();
    ca_render_settings settings = common_settings(o);
    ca_image_layers *image = NULL;
    CA_TRY(ca_ranks_agree(ranks, CA_OK, error)); /* the live view */
    ca_signals_catch(true);
    ca_status status = ca_ranks_agree(
        ranks, ca_look_ahead(scene, &settings, NULL, &settings.radius, error), error);
    if (status == CA_OK) status = ca_render(scene, &settings, &image, NULL, error);
    ca_signals_release();
    return status;
}

static ca_status load_and_render(ca_render_options *o, ca_error *error)
{
    ca_scene *scene = NULL;
    const ca_ranks *ranks = ca_mpi_ranks();
    const bool draws = !o->quiet && !ca_ranks_helps(ranks);
    ca_status status =
        ca_options_load_sensor(o->scene, &o->define_words, o->sensor, o->camera, draws, &scene, error);
    if (status == CA_OK) status = ca_layer_choice_check(&o->layers, &scene->desc.integrator, error);
    if (status == CA_OK && !ca_ranks_helps(ranks)) status = ca_places_read_scene(&o->places, scene, error);
    status = ca_ranks_agree(ranks, status, error);
    if (status == CA_OK)
        status = ca_ranks_helps(ranks) ? help_render(o, scene, error) : render_scene(o, scene, error);
    ca_scene_release(scene);
    return status;
}

int ca_command_render(int word_count, char *const words[])
{
    if (ca_help_wanted(word_count, words)) return ca_render_options_help();
    ca_render_options o;
    ca_error error = {""};
    ca_status status = ca_render_options_read(&o, word_count, words, &error);
    status = ca_ranks_agree(ca_mpi_ranks(), status, &error);
    ca_signals_catch_save(); /* one that comes while the scene is loaded waits for the first picture */
    if (status == CA_OK) status = load_and_render(&o, &error);
    ca_signals_release_save();
    ca_render_options_destroy(&o);
    return status == CA_OK ? CA_EXIT_DONE : ca_report("render", status, &error);
}
