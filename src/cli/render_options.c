#include "cli/render_options.h"

#include "base/memory.h"
#include "base/text.h"
#include "cli/mpi_ranks.h"
#include "cli/shared_options.h"
#include "film/part_file.h"
#include "film/technique_images.h"
#include "integrator/integrator.h"
#include "sampling/sampler.h"

#include <stdio.h>
#include <string.h>

#define AT(field) .offset = offsetof(ca_render_options, field)
#define GIVEN(field) .given = offsetof(ca_render_options, field)

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
    CA_DEFINE_OPTION(AT(define_words)),
    CA_SENSOR_OPTION(AT(sensor)),
    CA_CAMERA_OPTION(AT(camera)),
    {.name = "sampler",
     .argument = "NAME",
     .kind = CA_OPTION_TEXT,
     AT(settings.sampler),
     .help = "numbers of the paths, see below (default: the scene's, else independent; -i qmcppm: halton)"},
    CA_SEED_OPTION(AT(settings.seed), GIVEN(settings.has_seed)),
    {.name = "replicates",
     .argument = "R",
     .kind = CA_OPTION_COUNT,
     .minimum = 2,
     AT(settings.replicates),
     .help =
         "make the samples in R independent parts, for error bars; --spp must come to R equal ones (default: none)"},
    CA_MAX_DEPTH_OPTION(AT(settings.max_depth), GIVEN(settings.has_max_depth)),
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
    CA_RESOLUTION_OPTION(AT(resolution)),
    CA_CROP_OPTION("render", AT(settings.crop), GIVEN(settings.has_crop)),
    CA_OUTPUT_OPTIONS(ca_render_options),
    CA_THREADS_OPTION("; the image does not depend on it", AT(settings.threads)),
    CA_MEMORY_OPTION("film and paths; the image does not depend on it, but for blocks=filled; not counted: pilots of "
                     "vavcm (55 MB) and auto (130 MB) (default: 2048 for a pass's light paths, none for the rest)",
                     AT(settings.memory_mib)),
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
    CA_STATS_OPTION("times, counts and noise", AT(stats)),
    CA_QUIET_OPTION(AT(quiet)),
    CA_HELP_OPTION(AT(help)),
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

int ca_render_options_help(void)
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
        "where paths connect, all pixels have as many camera paths. Several ranks choose once. "
        "The numbers depend on measured times, those of --rays FILE.exr (an image of --rays auto or of "
        "`caustica noise`) do not; --rays FILE.part makes the image of that checkpoint again.\n"
        "-o FILE.part keeps the sums of the passes (of qmcppm: the blocks); `caustica merge` adds up several of "
        "them (--passes, --blocks), to the bits of one render.\n"
        "--checkpoint with --resume: the same line again goes on where the last run ended, to the same bits; "
        "samples, time, threads, outputs may differ. Renders over ten minutes keep OUTPUT.checkpoint.part to their "
        "end, or -2 and so on beside it; --resume alone takes the newest. Not with --dump-strategies.\n"
        "SIGINT (Ctrl-C), SIGTERM, SIGHUP, SIGXCPU and SIGUSR2 end the render after the pass, or after a second, and "
        "write the image of whole passes, exit status 0 (1 if there is none); a second SIGINT or SIGTERM ends at "
        "once. SIGUSR1 writes the image so far (and --stats) after the pass and goes on.\n"
        "mpirun -n N caustica render ... makes the same image with N processes, on one machine or several (a build "
        "with MPI); see docs/cluster.md.\n"
        "--serve: who knows the address can pause, stop and save the render. Looking costs 3 % of the time.\n"
        "Examples: caustica render scene.xml -i auto:max_depth=8 --noise 2 -o image.exr -o image.png\n"
        "          caustica render scene.xml --time 600 --serve 8080\n",
        stdout);
    return CA_EXIT_DONE;
}

/* ---- Before the work ------------------------------------------------------------------------------------------- */

static ca_status check_ends(const ca_render_options *o, ca_error *error)
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
static unsigned long long range_begin(const ca_render_options *o)
{
    if (o->settings.has_blocks) return o->settings.blocks[0];
    return o->settings.has_passes ? o->settings.passes[0] : 0;
}

static ca_status check_live(const ca_render_options *o, ca_error *error)
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
static ca_status choose_checkpoint(ca_render_options *o, ca_error *error)
{
    const ca_render_settings *settings = &o->settings;
    const bool repeats = settings->rays && ca_part_is_path(settings->rays);
    const bool asked = o->keep.wanted || o->keep.resume || o->keep.seconds > 0.0;
    if (!asked && (repeats || settings->strategies_directory)) return CA_OK;
    return ca_keep_choose(&o->keep, o->outputs.items[0], &o->places, error);
}

/* All pictures that may be among what techniques found. */
static ca_status check_strategies(ca_render_options *o, const char *folder, ca_error *error)
{
    static const char *const option = "--dump-strategies";
    char name[CA_TECHNIQUE_FILE_SIZE];
    CA_TRY(ca_places_write_in(&o->places, folder, "index.html", option, error));
    for (uint32_t i = 0; ca_technique_images_file(i, name); i++)
        CA_TRY(ca_places_write_in(&o->places, folder, name, option, error));
    return ca_output_check_folder(folder, error);
}

static ca_status check_outputs(ca_render_options *o, ca_error *error)
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
    CA_TRY(ca_outputs_check_look(o->outputs.items, o->outputs.count, &o->look, o->tone, error));
    return folder ? check_strategies(o, folder, error) : CA_OK;
}

/* Default outputs are added to the list. */
static ca_status complete_outputs(ca_render_options *o, ca_error *error)
{
    static const char *const extensions[2] = {".exr", ".png"};
    if (o->outputs.count > 0) return CA_OK;
    ca_text_list *list = &o->outputs;
    const char **items = ca_array_grow(list->items, &list->capacity, 2, sizeof *items);
    if (!items) return ca_fail_memory(error, "the command line");
    list->items = items;
    for (int i = 0; i < 2; i++) {
        o->made[i] = ca_output_default(o->scene, extensions[i]);
        if (!o->made[i]) return ca_fail_memory(error, "the command line");
        list->items[list->count++] = o->made[i];
    }
    return CA_OK;
}

static ca_status check(ca_render_options *o, const ca_text_list *operands, ca_error *error)
{
    CA_TRY(ca_options_scene_operand(operands, &o->scene, error));
    CA_TRY(check_ends(o, error));
    CA_TRY(check_live(o, error));
    CA_TRY(check_integrator(o->settings.integrator, error));
    CA_TRY(check_sampler(o->settings.sampler, error));
    CA_TRY(ca_outputs_find_tone(o->tone, &o->look, error));
    CA_TRY(complete_outputs(o, error));
    return ca_ranks_helps(ca_mpi_ranks()) ? CA_OK : check_outputs(o, error);
}

/* ---- Life ------------------------------------------------------------------------------------------------------ */

ca_status ca_render_options_read(ca_render_options *o, int word_count, char *const words[], ca_error *error)
{
    ca_text_list operands = {0};
    *o = (ca_render_options){0};
    ca_render_settings_init(&o->settings);
    ca_status status = ca_options_parse(&table, word_count, words, o, &operands, error);
    if (status == CA_OK) status = check(o, &operands, error);
    ca_text_list_destroy(&operands);
    return status;
}

void ca_render_options_destroy(ca_render_options *o)
{
    ca_places_destroy(&o->places);
    ca_keep_destroy(&o->keep);
    ca_text_list_destroy(&o->outputs);
    ca_text_list_destroy(&o->define_words);
    ca_free(o->made[0]);
    ca_free(o->made[1]);
}
