/* caustica render: from a scene file to image files. */
#include "base/memory.h"
#include "base/text.h"
#include "cli/commands.h"
#include "cli/keep.h"
#include "cli/live_view.h"
#include "cli/mpi_ranks.h"
#include "cli/outputs.h"
#include "cli/progress.h"
#include "cli/say.h"
#include "cli/signals.h"
#include "film/part_file.h"
#include "image/layers.h"
#include "integrator/integrator.h"
#include "sampling/sampler.h"
#include "scene/scene.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

typedef struct render_options {
    ca_text_list outputs, define_words;
    const char *scene, *camera, *stats;
    ca_render_settings settings; /* options are read right into it */
    uint32_t resolution[2], sensor;
    ca_output_look look;
    const char *tone;
    ca_layer_choice layers;
    const char *serve_address, *tev;
    uint32_t port;
    bool serves;
    bool has_spp, has_seconds, has_noise;
    bool quiet, help;
    ca_places places;
    ca_keep keep;
} render_options;

#define AT(field) .offset = offsetof(render_options, field)
#define GIVEN(field) .given = offsetof(render_options, field)

static const ca_option options[] = {
    {.name = "output",
     .letter = 'o',
     .argument = "FILE",
     .kind = CA_OPTION_TEXT_LIST,
     AT(outputs),
     .help = "image to write: .exr, .png or .pfm; or .part; several times (default: SCENE.exr and SCENE.png here)"},
    {.name = "integrator",
     .letter = 'i',
     .argument = "NAME[:param=value,...]",
     .kind = CA_OPTION_TEXT,
     AT(settings.integrator),
     .help = "method, see below (default: the scene's, else auto); depths set in the scene stay"},
    {.name = "spp",
     .argument = "N",
     .kind = CA_OPTION_COUNT,
     .minimum = 1,
     AT(settings.samples_per_pixel),
     GIVEN(has_spp),
     .help = "camera paths a pixel; of `light`, light paths (default: scene's or 4)"},
    {.name = "time",
     .argument = "SECONDS",
     .kind = CA_OPTION_POSITIVE,
     AT(settings.seconds),
     GIVEN(has_seconds),
     .help = "instead: stop after the pass that ends past so much rendering time"},
    {.name = "noise",
     .argument = "PERCENT",
     .kind = CA_OPTION_POSITIVE,
     AT(settings.noise_percent),
     GIVEN(has_noise),
     .help = "instead: stop when the image's relative standard error is below this"},
    {.name = "blocks",
     .argument = "A:B",
     .kind = CA_OPTION_RANGE,
     AT(settings.blocks),
     GIVEN(settings.has_blocks),
     .help = "instead, of qmcppm: these blocks only, A to B - 1, counted from 0"},
    {.name = "passes",
     .argument = "A:B",
     .kind = CA_OPTION_RANGE,
     AT(settings.passes),
     GIVEN(settings.has_passes),
     .help = "instead, of all others: these passes only, A to B - 1, counted from 0"},
    {.name = "checkpoint",
     .argument = "FILE.part",
     .kind = CA_OPTION_TEXT,
     AT(keep.wanted),
     .help = "keep the render in this file, from which it can go on"},
    {.name = "checkpoint-every",
     .argument = "SECONDS",
     .kind = CA_OPTION_POSITIVE,
     AT(keep.seconds),
     .help = "so often (default: 300, or 100 times what writing it takes)"},
    {.name = "resume",
     .kind = CA_OPTION_FLAG,
     AT(keep.resume),
     .help = "go on from the checkpoint, if there is one, else begin anew"},
    {.name = "define",
     .letter = 'D',
     .argument = "NAME=VALUE",
     .kind = CA_OPTION_TEXT_LIST,
     AT(define_words),
     .help = "value for a <default> of the scene; several times"},
    {.name = "sensor",
     .argument = "N",
     .kind = CA_OPTION_COUNT,
     AT(sensor),
     .help = "which of the scene's sensors, counted from 0 (default: 0)"},
    {.name = "camera",
     .argument = "NAME",
     .kind = CA_OPTION_TEXT,
     AT(camera),
     .help = "the sensor of that id instead (glTF: the name of its node)"},
    {.name = "sampler",
     .argument = "NAME",
     .kind = CA_OPTION_TEXT,
     AT(settings.sampler),
     .help = "numbers of the paths, see below (default: the scene's, else independent; -i qmcppm: halton)"},
    {.name = "seed",
     .argument = "N",
     .kind = CA_OPTION_SEED,
     AT(settings.seed),
     GIVEN(settings.has_seed),
     .help = "other random numbers (default: the scene's, else 0)"},
    {.name = "replicates",
     .argument = "R",
     .kind = CA_OPTION_COUNT,
     .minimum = 2,
     AT(settings.replicates),
     .help =
         "make the samples in R independent parts, for error bars; --spp must come to R equal ones (default: none)"},
    {.name = "max-depth",
     .argument = "N",
     .kind = CA_OPTION_INTEGER,
     .minimum = -1,
     AT(settings.max_depth),
     GIVEN(settings.has_max_depth),
     .help = "longest path in segments, 1: lights only, -1: no limit"},
    {.name = "radius",
     .argument = "R",
     .kind = CA_OPTION_POSITIVE,
     AT(settings.radius),
     .help = "merge radius of the first pass (default: scene's or of least error)"},
    {.name = "alpha",
     .argument = "A",
     .kind = CA_OPTION_REAL,
     AT(settings.alpha),
     GIVEN(settings.has_alpha),
     .help = "its shrinking, 0 to 1: R^2 / passes^A (default: the scene's, else 1/3; -i qmcppm: 1/2)"},
    {.name = "light-paths",
     .argument = "N",
     .kind = CA_OPTION_COUNT,
     .minimum = 1,
     AT(settings.light_paths),
     .help = "light paths of a pass (default: the scene's, else one per pixel)"},
    {.name = "camera-paths",
     .argument = "N",
     .kind = CA_OPTION_COUNT,
     .minimum = 1,
     AT(settings.camera_paths),
     .help = "camera paths per pixel of a pass (default: the scene's, else 1)"},
    {.name = "rays",
     .argument = "auto|FILE",
     .kind = CA_OPTION_TEXT,
     AT(settings.rays),
     .help = "numbers of light paths and of camera paths of each pixel: chosen from a pilot, or those of an image or "
             "a checkpoint"},
    {.name = "objective",
     .argument = "NAME",
     .kind = CA_OPTION_TEXT,
     AT(settings.rays_objective),
     .help = "of --rays auto, variance of the mean pixel (mean), relative, or worst-decile (default: mean)"},
    {.name = "resolution",
     .argument = "WxH",
     .kind = CA_OPTION_SIZE,
     AT(resolution),
     .help = "size of the film (default: the scene's); its crop is scaled along"},
    {.name = "crop",
     .argument = "x0,y0,x1,y1",
     .kind = CA_OPTION_RECT,
     AT(settings.crop),
     GIVEN(settings.has_crop),
     .help = "render this part only: pixels of the full film, half open"},
    CA_OUTPUT_OPTIONS(render_options),
    {.name = "threads",
     .argument = "N",
     .kind = CA_OPTION_COUNT,
     .minimum = 1,
     AT(settings.threads),
     .help = "threads; the image does not depend on it (default: one per processor)"},
    {.name = "memory",
     .argument = "MiB",
     .kind = CA_OPTION_POSITIVE,
     AT(settings.memory_mib),
     .help = "limit for film and paths; the image does not depend on it, but for blocks=filled; not counted: up "
             "to 55 MB of vavcm's pilot (default: 2048 for the light paths of a pass, none for the rest)"},
    {.name = "dump-strategies",
     .argument = "DIR",
     .kind = CA_OPTION_TEXT,
     AT(settings.strategies_directory),
     .help = "write images of what each technique found, and a page that shows them; needs --max-depth 13 or less"},
    {.name = "serve",
     .argument = "[PORT]",
     .kind = CA_OPTION_PORT,
     AT(port),
     GIVEN(serves),
     .help = "show the picture as it converges in a browser, at the address that is printed (default: a free port)"},
    {.name = "serve-address",
     .argument = "ADDRESS",
     .kind = CA_OPTION_TEXT,
     AT(serve_address),
     .help = "let others than this machine look too: listen on this address, 0.0.0.0 for all (default: 127.0.0.1)"},
    {.name = "tev",
     .argument = "HOST:PORT",
     .kind = CA_OPTION_TEXT,
     AT(tev),
     .help = "show the picture in the viewer tev, which listens on port 14158"},
    {.name = "stats",
     .argument = "FILE.json",
     .kind = CA_OPTION_TEXT,
     AT(stats),
     .help = "write times, counts and noise as JSON"},
    {.name = "quiet", .kind = CA_OPTION_FLAG, AT(quiet), .help = "print errors and warnings only"},
    {.name = "help", .letter = 'h', .kind = CA_OPTION_FLAG, AT(help), .help = "this text"},
};
static const ca_option_table table = {"render", options, sizeof options / sizeof options[0]};

/* "name:a=1,b=2,..." in lines of 100 columns; those after the first are deeper than a name. */
static void print_integrator(const char *text)
{
    for (int used = printf("  "), first = 1; *text; first = 0) {
        const int length = (int)strcspn(text, ",") + (strchr(text, ',') != NULL);
        if (!first && used + length > 100) used = printf("\n      ") - 1;
        used += printf("%.*s", length, text);
        text += length;
    }
    printf("\n");
}

/* Every integrator with its parameters and their defaults. */
static void print_integrators(void)
{
    const ca_integrator_desc nothing_set = {.name = NULL};
    const ca_integrator_type *type;
    printf("\nIntegrators with their parameters and defaults (light_paths 0: one a pixel; radius 0: by a pilot):\n");
    for (size_t i = 0; (type = ca_integrator_at(i)) != NULL; i++) {
        ca_integrator_input input = {0};
        char text[1024];
        if (ca_integrator_configure(type, &nothing_set, false, NULL, &input, NULL) != CA_OK) continue;
        ca_integrator_describe(type, &input, text, sizeof text);
        print_integrator(text);
    }
    char names[CA_INTEGRATOR_NAMES_SIZE];
    ca_integrator_names(CA_RAYS_ABILITIES | CA_ABILITY_CHOOSES, ", ", names);
    printf("\nIntegrators with --rays: %s\n", names);
}

static int print_help(void)
{
    printf("caustica render SCENE [options]: make an image of a scene\n\n");
    ca_options_print(&table, stdout);
    print_integrators();
    ca_options_print_names("Samplers", ca_sampler_names(), stdout);
    ca_options_print_prose(
        "--radius, --alpha, --light-paths, --camera-paths and --max-depth set parameters of the integrator; "
        "they win over the scene and must not contradict -i NAME:param=value.\n"
        "-i auto tries methods on a small picture and takes the most efficient one that loses no light. The choice "
        "depends on measured times; --rays FILE.exr makes that of a picture again.\n"
        "--rays auto: --light-paths and --camera-paths are those of the pilot, --spp is the mean over pixels. The "
        "law of noise needs independent random numbers and one radius: the scene's sampler and alpha are not used; "
        "where paths connect, all pixels have as many camera paths. "
        "The numbers depend on measured times, those of --rays FILE.exr (an image of --rays auto or of "
        "`caustica noise`) do not; --rays FILE.part makes the image of that checkpoint again.\n"
        "-o FILE.part keeps the sums of the passes (of qmcppm: the blocks); `caustica merge` adds up several of "
        "them (--passes, --blocks), to the bits of one render.\n"
        "--checkpoint with --resume: the same line again goes on where the last run ended, to the same bits; "
        "samples, time, threads, outputs may differ. Renders over ten minutes keep OUTPUT.checkpoint.part to their "
        "end. Not with --dump-strategies.\n"
        "SIGINT (Ctrl-C), SIGTERM, SIGHUP, SIGXCPU and SIGUSR2 end the render after the pass, or after a second, and "
        "write the image of whole passes, exit status 0 (1 if there is none); a second SIGINT or SIGTERM ends at "
        "once. SIGUSR1 writes the image so far (and --stats) after the pass and goes on.\n"
        "mpirun -n N caustica render ... makes the same image with N processes, on one machine or several (a build "
        "with MPI); see docs/cluster.md.\n"
        "--serve: who knows the address can pause, stop and save the render. Looking costs 3 % of the time.\n"
        "Examples: caustica render scene.xml -i ovcm:max_depth=8 --noise 2 -o image.exr -o image.png\n"
        "          caustica render scene.xml --time 600 --serve 8080\n",
        stdout);
    return CA_EXIT_DONE;
}

/* ---- Before the work ------------------------------------------------------------------------------------------- */

static ca_status check_ends(const render_options *o, ca_error *error)
{
    if (o->settings.has_passes && (o->settings.has_blocks || o->has_noise))
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "--passes cannot be combined with --blocks or --noise");
    if (o->settings.has_passes && o->has_spp && o->settings.replicates == 0)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "--passes cannot be combined with --spp, but with --replicates, which share these samples");
    if (o->settings.has_blocks && (o->has_spp || o->has_noise))
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "--blocks cannot be combined with --spp or --noise");
    if (o->has_spp + o->has_seconds + o->has_noise <= 1) return CA_OK;
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "only one of --spp, --time and --noise can be given");
}

/* Where a range begins that has no image of its own; 0: there is one. */
static unsigned long long range_begin(const render_options *o)
{
    if (o->settings.has_blocks) return o->settings.blocks[0];
    return o->settings.has_passes ? o->settings.passes[0] : 0;
}

static ca_status check_live(const render_options *o, ca_error *error)
{
    const bool blocks = o->settings.has_blocks;
    const uint64_t *range = blocks ? o->settings.blocks : o->settings.passes;
    if (o->serve_address && !o->serves)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "--serve-address needs --serve");
    if ((o->serves || o->tev) && range_begin(o) > 0)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "%s: an image needs all %s from 0; with --%s %llu:%llu there is none to show",
                       o->serves ? "--serve" : "--tev", blocks ? "blocks" : "passes", blocks ? "blocks" : "passes",
                       (unsigned long long)range[0], (unsigned long long)range[1]);
    return CA_OK;
}

static ca_status check_integrator(const char *text, ca_error *error)
{
    char name[64];
    const ca_integrator_type *type;
    ca_error reason = {""};
    if (!text) return CA_OK;
    snprintf(name, sizeof name, "%.*s", (int)strcspn(text, ":"), text);
    if (ca_integrator_find(name, NULL, &type, &reason) == CA_OK) return CA_OK;
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "--integrator: %.900s", reason.message);
}

static ca_status check_sampler(const char *name, ca_error *error)
{
    ca_sampler_kind kind;
    if (!name || ca_sampler_find(name, &kind)) return CA_OK;
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "--sampler: \"%.100s\" is not known; there are %s", name,
                   ca_sampler_names());
}

/* By itself one is kept of renders that can be kept. */
static ca_status choose_checkpoint(render_options *o, ca_error *error)
{
    const ca_render_settings *settings = &o->settings;
    const bool repeats = settings->rays && ca_part_is_path(settings->rays);
    const bool asked = o->keep.wanted || o->keep.resume || o->keep.seconds > 0.0;
    if (!asked && (repeats || settings->strategies_directory)) return CA_OK;
    return ca_keep_choose(&o->keep, o->outputs.items[0], &o->places, error);
}

static ca_status check_outputs(render_options *o, ca_error *error)
{
    const ca_render_settings *settings = &o->settings;
    const char *folder = settings->strategies_directory;
    CA_TRY(ca_places_read(&o->places, o->scene, "which is the scene", error));
    if (settings->rays && strcmp(settings->rays, "auto") != 0)
        CA_TRY(ca_places_read(&o->places, settings->rays, "from which --rays reads", error));
    CA_TRY(ca_outputs_check(&o->outputs, o->stats, &o->settings.part_path, &o->places, error));
    if (range_begin(o) > 0 && o->outputs.count > (o->settings.part_path ? 1 : 0))
        return ca_fail(
            error, CA_ERROR_ARGUMENT, NULL,
            "--%s: an image needs all %s from 0; without them only a part file (-o FILE.part) can be written",
            o->settings.has_blocks ? "blocks" : "passes", o->settings.has_blocks ? "blocks" : "passes");
    CA_TRY(choose_checkpoint(o, error));
    CA_TRY(ca_outputs_check_layers(o->outputs.items, o->outputs.count, &o->layers, error));
    if (!folder) return CA_OK;
    CA_TRY(ca_places_write_in(&o->places, folder, "index.html", "--dump-strategies", error));
    return ca_output_check_folder(folder, error);
}

/* Default outputs are added to the list; their texts are owned by `made`. */
static ca_status complete_outputs(render_options *o, char *made[2], ca_error *error)
{
    static const char *const extensions[2] = {".exr", ".png"};
    if (o->outputs.count > 0) return CA_OK;
    ca_text_list *list = &o->outputs;
    const char **items = ca_array_grow(list->items, &list->capacity, 2, sizeof *items);
    if (!items) return ca_fail_memory(error, "the command line");
    list->items = items;
    for (int i = 0; i < 2; i++) {
        made[i] = ca_output_default(o->scene, extensions[i]);
        if (!made[i]) return ca_fail_memory(error, "the command line");
        list->items[list->count++] = made[i];
    }
    return CA_OK;
}

static ca_status check(render_options *o, const ca_text_list *operands, char *made[2], ca_error *error)
{
    CA_TRY(ca_options_scene_operand(operands, &o->scene, error));
    CA_TRY(check_ends(o, error));
    CA_TRY(check_live(o, error));
    CA_TRY(check_integrator(o->settings.integrator, error));
    CA_TRY(check_sampler(o->settings.sampler, error));
    CA_TRY(ca_outputs_find_tone(o->tone, &o->look, error));
    CA_TRY(complete_outputs(o, made, error));
    return ca_ranks_helps(ca_mpi_ranks()) ? CA_OK : check_outputs(o, error);
}

/* ---- The work -------------------------------------------------------------------------------------------------- */

static ca_output_files output_files(const render_options *o)
{
    return (ca_output_files){o->outputs.items, o->outputs.count, o->look, o->layers, o->stats};
}

/* What was rendered is written also where the render could not write a file of its own. */
static ca_status write_outputs(const render_options *o, const ca_image_layers *image,
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
        printf(rays->phases > 0 ? " in the end; pilot %s" : "; ended in its pilot, %s", time);
    }
    if (rays->predicted_gain > 0.0) printf(", predicted gain over its numbers %.3g", rays->predicted_gain);
    printf("\n");
    if (isnan(rays->light_path_seconds)) return;
    printf("a light path takes %.3g us of a processor, a camera path %.3g us", 1e6 * rays->light_path_seconds,
           1e6 * rays->camera_path_seconds);
    if (!isnan(rays->candidate_seconds)) printf(", a merge candidate %.3g ns", 1e9 * rays->candidate_seconds);
    printf("\n");
}

static void print_summary(const render_options *o, const ca_image_layers *image, const ca_render_statistics *s)
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
               s->blocks[1] > 0 ? "blocks" : "passes");
    if (s->noise_percent >= 0.0) printf(", noise %.3g %%", s->noise_percent);
    if (s->has_confidence)
        printf(", no error bars for %.3g %% of the pixels, widened ones for %.3g %%", 100.0 * s->confidence_marked,
               100.0 * s->confidence_widened);
    printf("%s\n", s->interrupted
                       ? ca_signals_arrived() ? " (ended early by a signal)" : " (ended early by the live view)"
                       : "");
    print_rays(&s->numbers_of_rays);
    for (size_t i = 0; i < o->outputs.count; i++) ca_say(stdout, "wrote %s\n", o->outputs.items[i]);
    if (o->settings.strategies_directory) ca_say(stdout, "wrote %s/\n", o->settings.strategies_directory);
    if (o->stats) ca_say(stdout, "wrote %s\n", o->stats);
}

static ca_status start_live_view(const render_options *o, ca_live_view *view, ca_error *error)
{
    const ca_live_view_settings settings = {
        .serves = o->serves,
        .address = o->serve_address,
        .port = o->port,
        .tev = o->tev,
        .scene = o->scene,
        .threads = o->settings.threads,
        .files = output_files(o),
    };
    return ca_live_view_start(view, &settings, !o->quiet, error);
}

/* Says what the picture will lack. The merge radius that this takes is the render's. */
static ca_status look_ahead(const ca_scene *scene, ca_render_settings *settings, ca_error *error)
{
    ca_preflight preflight;
    CA_TRY(ca_preflight_make(scene, settings, &preflight, error));
    for (uint32_t i = 0; i < preflight.warning_count; i++)
        ca_say(stderr, "caustica: warning: %s\n", preflight.warnings[i]);
    settings->radius = preflight.radius;
    return CA_OK;
}

/* Before the first pass; the image has at most the size of the film. */
static ca_status reserve_outputs(const render_options *o, const ca_scene *scene, ca_reserve **reserve,
                                 ca_error *error)
{
    const ca_output_files files = output_files(o);
    const bool resized = o->resolution[0] > 0;
    const ca_film_desc *film = &scene->desc.film;
    return ca_outputs_reserve(&files, resized ? o->resolution[0] : film->width,
                              resized ? o->resolution[1] : film->height, reserve, error);
}

/* Of all ranks. */
static ca_render_settings common_settings(const render_options *o)
{
    ca_render_settings settings = o->settings;
    settings.width = o->resolution[0];
    settings.height = o->resolution[1];
    settings.stop = ca_signals_stop();
    settings.ranks = ca_mpi_ranks();
    return settings;
}

static ca_status render_image(const render_options *o, const ca_scene *scene, ca_live_view *view,
                              ca_image_layers **image, ca_render_statistics *statistics, ca_error *error)
{
    ca_render_settings settings = common_settings(o);
    settings.progress = ca_live_view_report;
    settings.progress_user = view;
    ca_keep_fill(&o->keep, &settings);
    ca_reserve *reserve = NULL;
    ca_status status = reserve_outputs(o, scene, &reserve, error);
    if (status == CA_OK) status = look_ahead(scene, &settings, error);
    status = ca_ranks_agree(settings.ranks, status, error);
    if (status == CA_OK) status = ca_render(scene, &settings, image, statistics, error);
    ca_progress_clear(&view->line);
    ca_reserve_open(reserve);
    status = write_outputs(o, *image, statistics, status, error);
    ca_reserve_release(reserve);
    return status;
}

static ca_status render_scene(const render_options *o, const ca_scene *scene, ca_error *error)
{
    ca_live_view view;
    ca_render_statistics statistics;
    ca_image_layers *image = NULL;
    ca_render_statistics_init(&statistics);
    ca_keep_tell(&o->keep);
    CA_TRY(ca_ranks_agree(ca_mpi_ranks(), start_live_view(o, &view, error), error));
    ca_signals_catch(o->quiet);
    const ca_status status = render_image(o, scene, &view, &image, &statistics, error);
    ca_outputs_warn(&statistics);
    if (status == CA_OK) {
        if (image) ca_layer_choice_warn(&o->layers, image);
        if (!o->quiet) print_summary(o, image, &statistics);
    }
    if (status == CA_OK) ca_keep_end(&o->keep, statistics.interrupted);
    ca_live_view_end(&view, image, &statistics);
    ca_signals_release();
    return status;
}

/* The same steps on a rank that writes nothing, each of which all ranks take or none. */
static ca_status help_render(const render_options *o, const ca_scene *scene, ca_error *error)
{
    const ca_ranks *ranks = ca_mpi_ranks();
    ca_render_settings settings = common_settings(o);
    ca_image_layers *image = NULL;
    CA_TRY(ca_ranks_agree(ranks, CA_OK, error)); /* the live view */
    ca_signals_catch(true);
    ca_status status = ca_ranks_agree(ranks, look_ahead(scene, &settings, error), error);
    if (status == CA_OK) status = ca_render(scene, &settings, &image, NULL, error);
    ca_signals_release();
    return status;
}

static ca_status load_and_render(render_options *o, ca_error *error)
{
    ca_scene *scene = NULL;
    const ca_ranks *ranks = ca_mpi_ranks();
    const bool draws = !o->quiet && !ca_ranks_helps(ranks);
    ca_status status =
        ca_options_load_sensor(o->scene, &o->define_words, o->sensor, o->camera, draws, &scene, error);
    if (status == CA_OK && !ca_ranks_helps(ranks)) status = ca_places_read_scene(&o->places, scene, error);
    status = ca_ranks_agree(ranks, status, error);
    if (status == CA_OK)
        status = ca_ranks_helps(ranks) ? help_render(o, scene, error) : render_scene(o, scene, error);
    ca_scene_release(scene);
    return status;
}

int ca_command_render(int word_count, char *const words[])
{
    if (ca_help_wanted(word_count, words)) return print_help();
    render_options o = {0};
    ca_text_list operands = {0};
    char *made[2] = {NULL, NULL};
    ca_error error = {""};
    ca_render_settings_init(&o.settings);
    ca_status status = ca_options_parse(&table, word_count, words, &o, &operands, &error);
    if (status == CA_OK) status = check(&o, &operands, made, &error);
    status = ca_ranks_agree(ca_mpi_ranks(), status, &error);
    ca_signals_catch_save(); /* one that comes while the scene is loaded waits for the first picture */
    if (status == CA_OK) status = load_and_render(&o, &error);
    ca_signals_release_save();
    ca_places_destroy(&o.places);
    ca_keep_destroy(&o.keep);
    ca_text_list_destroy(&o.outputs);
    ca_text_list_destroy(&o.define_words);
    ca_text_list_destroy(&operands);
    ca_free(made[0]);
    ca_free(made[1]);
    return status == CA_OK ? CA_EXIT_DONE : ca_report("render", status, &error);
}
