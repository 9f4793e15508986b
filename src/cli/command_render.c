/* caustica render: from a scene file to image files. */
#include "base/memory.h"
#include "cli/commands.h"
#include "cli/outputs.h"
#include "cli/progress.h"
#include "cli/signals.h"
#include "cli/stats_json.h"
#include "image/layers.h"
#include "integrator/integrator.h"
#include "sampling/sampler.h"

#include <stdio.h>
#include <string.h>

typedef struct render_options {
    ca_text_list outputs, define_words;
    const char *integrator, *sampler, *stats, *strategies;
    uint32_t spp, threads, light_paths, camera_paths;
    double seconds, noise_percent, memory_mib, exposure, radius, alpha;
    bool has_spp, has_seconds, has_noise, has_blocks;
    uint64_t blocks[2];
    const char *part_path; /* among the outputs, or NULL */
    bool has_alpha, has_seed, has_crop, has_max_depth;
    bool quiet, help;
    uint64_t seed;
    uint32_t resolution[2], crop[4];
    int max_depth;
} render_options;

#define AT(field) .offset = offsetof(render_options, field)
#define GIVEN(field) .given = offsetof(render_options, field)

static const ca_option options[] = {
    {.name = "output", .letter = 'o', .argument = "FILE", .kind = CA_OPTION_TEXT_LIST, AT(outputs),
     .help = "image to write: .exr, .png or .pfm; or .part; several times (default: SCENE.exr and SCENE.png here)"},
    {.name = "integrator", .letter = 'i', .argument = "NAME[:param=value,...]", .kind = CA_OPTION_TEXT, AT(integrator),
     .help = "method, see below (default: the scene's, else path); depths set in the scene stay"},
    {.name = "spp", .argument = "N", .kind = CA_OPTION_COUNT, .minimum = 1, AT(spp), GIVEN(has_spp),
     .help = "camera paths per pixel, of `light` light paths (default: the scene's, else 4)"},
    {.name = "time", .argument = "SECONDS", .kind = CA_OPTION_POSITIVE, AT(seconds), GIVEN(has_seconds),
     .help = "instead: stop after the pass in which so much rendering time has passed"},
    {.name = "noise", .argument = "PERCENT", .kind = CA_OPTION_POSITIVE, AT(noise_percent), GIVEN(has_noise),
     .help = "instead: stop when the image's relative standard error is below this"},
    {.name = "blocks", .argument = "A:B", .kind = CA_OPTION_RANGE, AT(blocks), GIVEN(has_blocks),
     .help = "instead, of qmcppm: these blocks of pairs only, A to B - 1, counted from 0"},
    {.name = "define", .letter = 'D', .argument = "NAME=VALUE", .kind = CA_OPTION_TEXT_LIST, AT(define_words),
     .help = "value for a <default> of the scene; several times"},
    {.name = "sampler", .argument = "NAME", .kind = CA_OPTION_TEXT, AT(sampler),
     .help = "numbers of the paths, see below (default: the scene's, else independent; -i qmcppm: halton)"},
    {.name = "seed", .argument = "N", .kind = CA_OPTION_SEED, AT(seed), GIVEN(has_seed),
     .help = "other random numbers (default: the scene's, else 0)"},
    {.name = "max-depth", .argument = "N", .kind = CA_OPTION_INTEGER, .minimum = -1, AT(max_depth),
     GIVEN(has_max_depth), .help = "longest path in segments, 1: lights only, -1: no limit (default: the scene's)"},
    {.name = "radius", .argument = "R", .kind = CA_OPTION_POSITIVE, AT(radius),
     .help = "merge radius of the first pass (default: the scene's, else from a pixel's footprint)"},
    {.name = "alpha", .argument = "A", .kind = CA_OPTION_REAL, AT(alpha), GIVEN(has_alpha),
     .help = "its shrinking, 0 to 1: R^2 / passes^A (default: the scene's, else 0.5)"},
    {.name = "light-paths", .argument = "N", .kind = CA_OPTION_COUNT, .minimum = 1, AT(light_paths),
     .help = "light paths of a pass (default: the scene's, else one per pixel)"},
    {.name = "camera-paths", .argument = "N", .kind = CA_OPTION_COUNT, .minimum = 1, AT(camera_paths),
     .help = "camera paths per pixel of a pass (default: the scene's, else 1)"},
    {.name = "resolution", .argument = "WxH", .kind = CA_OPTION_SIZE, AT(resolution),
     .help = "size of the film; the scene's crop is scaled along (default: the scene's)"},
    {.name = "crop", .argument = "x0,y0,x1,y1", .kind = CA_OPTION_RECT, AT(crop), GIVEN(has_crop),
     .help = "render this part only: pixels of the full film, half open (default: the scene's)"},
    {.name = "exposure", .argument = "STOPS", .kind = CA_OPTION_REAL, AT(exposure),
     .help = "brightness of .png by powers of two (default: 0)"},
    {.name = "threads", .argument = "N", .kind = CA_OPTION_COUNT, .minimum = 1, AT(threads),
     .help = "threads; the image does not depend on it (default: one per processor)"},
    {.name = "memory", .argument = "MiB", .kind = CA_OPTION_POSITIVE, AT(memory_mib),
     .help = "limit for film and paths; the image does not depend on it, but for blocks=filled (default: none)"},
    {.name = "dump-strategies", .argument = "DIR", .kind = CA_OPTION_TEXT, AT(strategies),
     .help = "write an image of what each technique found; needs --max-depth 13 or less"},
    {.name = "stats", .argument = "FILE.json", .kind = CA_OPTION_TEXT, AT(stats),
     .help = "write times, counts and noise as JSON"},
    {.name = "quiet", .kind = CA_OPTION_FLAG, AT(quiet), .help = "print errors and warnings only"},
    {.name = "help", .letter = 'h', .kind = CA_OPTION_FLAG, AT(help), .help = "this text"},
};
static const ca_option_table table = {"render", options, sizeof options / sizeof options[0]};

/* Every integrator with its parameters and their defaults. */
static void print_integrators(void)
{
    static const char *const names[] = {"path", "light",    "bdpt",     "ppm",  "bdpm",
                                        "vcm",  "vcm-plus", "vcm-star", "ovcm", "cavcm", "qmcppm"};
    printf("\nIntegrators with their parameters and defaults (light_paths 0: one per pixel; radius 0: from a pixel's\n"
           "footprint):\n");
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        const ca_integrator_desc nothing_set = {.name = NULL};
        const ca_integrator_type *type;
        ca_integrator_input input = {0};
        char text[1024];
        if (ca_integrator_find(names[i], NULL, &type, NULL) != CA_OK ||
            ca_integrator_configure(type, &nothing_set, false, NULL, &input, NULL) != CA_OK)
            continue;
        ca_integrator_describe(type, &input, text, sizeof text);
        printf("  %s\n", text);
    }
}

static int print_help(void)
{
    printf("caustica render SCENE [options]: make an image of a Mitsuba 3 XML scene\n\n");
    ca_options_print(&table, stdout);
    print_integrators();
    printf("\nSamplers: %s\n", ca_sampler_names());
    printf("\n"
           "--radius, --alpha, --light-paths, --camera-paths and --max-depth set parameters of the integrator; they win\n"
           "over the scene and must not contradict -i NAME:param=value.\n"
           "-o FILE.part (qmcppm) keeps the exact sums of the blocks; `caustica merge` adds up several of them.\n"
           "SIGINT (Ctrl-C) and SIGTERM finish the pass or block and write the image, exit status 0; a second one ends at\n"
           "once.\n"
           "Example: caustica render scene.xml -i ovcm:max_depth=8 --noise 2 -o image.exr -o image.png\n");
    return CA_EXIT_DONE;
}

/* ---- Before the work -------------------------------------------------------------------------------------------- */

static ca_status check_ends(const render_options *o, ca_error *error)
{
    if (o->has_blocks && (o->has_spp || o->has_noise))
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "--blocks cannot be combined with --spp or --noise");
    if (o->has_spp + o->has_seconds + o->has_noise <= 1) return CA_OK;
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "only one of --spp, --time and --noise can be given");
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

static ca_status check_outputs(render_options *o, ca_error *error)
{
    CA_TRY(ca_outputs_check(o->outputs.items, o->outputs.count, &o->part_path, error));
    if (o->has_blocks && o->blocks[0] > 0 && o->outputs.count > (o->part_path ? 1 : 0))
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "--blocks: an image needs all blocks from 0; without them only a part file (-o FILE.part) can be written");
    if (o->stats) CA_TRY(ca_output_check_place(o->stats, error));
    return o->strategies ? ca_output_check_folder(o->strategies, error) : CA_OK;
}

/* Default outputs are added to the list; their texts are owned by `made`. */
static ca_status complete_outputs(render_options *o, const char *scene_path, char *made[2], ca_error *error)
{
    static const char *const extensions[2] = {".exr", ".png"};
    if (o->outputs.count > 0) return CA_OK;
    ca_text_list *list = &o->outputs;
    if (!ca_array_reserve((void **)&list->items, &list->capacity, 2, sizeof *list->items))
        return ca_fail_memory(error, "the command line");
    for (int i = 0; i < 2; i++) {
        made[i] = ca_output_default(scene_path, extensions[i]);
        if (!made[i]) return ca_fail_memory(error, "the command line");
        list->items[list->count++] = made[i];
    }
    return CA_OK;
}

static ca_status check(render_options *o, const ca_text_list *operands, char *made[2], ca_error *error)
{
    if (operands->count != 1)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       operands->count == 0 ? "a scene file is missing" : "there is more than one scene file");
    CA_TRY(check_ends(o, error));
    CA_TRY(check_integrator(o->integrator, error));
    CA_TRY(check_sampler(o->sampler, error));
    CA_TRY(complete_outputs(o, operands->items[0], made, error));
    return check_outputs(o, error);
}

/* ---- The work --------------------------------------------------------------------------------------------------- */

static bool on_progress(const ca_render_progress *progress, void *user)
{
    ca_progress_draw(user, progress);
    return !ca_signals_arrived();
}

static ca_render_settings settings_from(const render_options *o, ca_progress_line *line)
{
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.integrator = o->integrator;
    settings.samples_per_pixel = o->spp;
    settings.seconds = o->seconds;
    settings.noise_percent = o->noise_percent;
    settings.has_blocks = o->has_blocks;
    memcpy(settings.blocks, o->blocks, sizeof settings.blocks);
    settings.part_path = o->part_path;
    settings.sampler = o->sampler;
    settings.seed = o->seed;
    settings.has_seed = o->has_seed;
    settings.threads = o->threads;
    settings.width = o->resolution[0];
    settings.height = o->resolution[1];
    settings.has_crop = o->has_crop;
    memcpy(settings.crop, o->crop, sizeof settings.crop);
    settings.max_depth = o->max_depth;
    settings.has_max_depth = o->has_max_depth;
    settings.radius = o->radius;
    settings.alpha = o->alpha;
    settings.has_alpha = o->has_alpha;
    settings.light_paths = o->light_paths;
    settings.camera_paths = o->camera_paths;
    settings.memory_mib = o->memory_mib;
    settings.strategies_directory = o->strategies;
    settings.progress = on_progress;
    settings.progress_user = line;
    return settings;
}

static ca_status write_outputs(const render_options *o, const ca_image_layers *image,
                               const ca_render_statistics *statistics, ca_error *error)
{
    CA_TRY(ca_outputs_write(o->outputs.items, o->outputs.count, image, o->exposure, error));
    return o->stats ? ca_stats_write_render(o->stats, statistics, error) : CA_OK;
}

static void print_summary(const render_options *o, const ca_image_layers *image, const ca_render_statistics *s)
{
    char time[32];
    uint32_t width, height;
    ca_image_size(image, &width, &height);
    ca_format_seconds(s->seconds, time, sizeof time);
    printf("%u x %u pixels, %.4g samples per pixel, %s", width, height, s->samples_per_pixel, time);
    if (s->blocks[1] > 0)
        printf(", blocks %llu:%llu", (unsigned long long)s->blocks[0], (unsigned long long)s->blocks[1]);
    if (s->noise_percent >= 0.0) printf(", noise %.3g %%", s->noise_percent);
    printf("%s\n", s->interrupted ? " (ended early by a signal)" : "");
    for (size_t i = 0; i < o->outputs.count; i++) printf("wrote %s\n", o->outputs.items[i]);
    if (o->strategies) printf("wrote %s/\n", o->strategies);
    if (o->stats) printf("wrote %s\n", o->stats);
}

static ca_status render_scene(const render_options *o, const ca_scene *scene, ca_error *error)
{
    ca_progress_line line = ca_progress_start(!o->quiet);
    const ca_render_settings settings = settings_from(o, &line);
    ca_render_statistics statistics = {0};
    ca_image_layers *image = NULL;
    ca_signals_catch(o->quiet);
    ca_status status = ca_render(scene, &settings, &image, &statistics, error);
    ca_progress_clear(&line);
    if (status == CA_OK) status = write_outputs(o, image, &statistics, error);
    ca_signals_release();
    if (status == CA_OK) {
        ca_outputs_warn(&statistics);
        if (!o->quiet) print_summary(o, image, &statistics);
    }
    ca_image_release(image);
    return status;
}

static ca_status load_and_render(const render_options *o, const char *scene_path, ca_error *error)
{
    ca_define *defines = NULL;
    char *storage = NULL;
    ca_scene *scene = NULL;
    ca_status status = ca_options_defines(&o->define_words, &defines, &storage, error);
    if (status == CA_OK) status = ca_scene_load(scene_path, defines, o->define_words.count, &scene, error);
    if (status == CA_OK) status = render_scene(o, scene, error);
    ca_scene_release(scene);
    ca_free(defines);
    ca_free(storage);
    return status;
}

int ca_command_render(int word_count, char *const words[])
{
    if (ca_help_wanted(word_count, words)) return print_help();
    render_options o = {0};
    ca_text_list operands = {0};
    char *made[2] = {NULL, NULL};
    ca_error error = {""};
    ca_status status = ca_options_parse(&table, word_count, words, &o, &operands, &error);
    if (status == CA_OK) status = check(&o, &operands, made, &error);
    if (status == CA_OK) status = load_and_render(&o, operands.items[0], &error);
    ca_text_list_destroy(&o.outputs);
    ca_text_list_destroy(&o.define_words);
    ca_text_list_destroy(&operands);
    ca_free(made[0]);
    ca_free(made[1]);
    return status == CA_OK ? CA_EXIT_DONE : ca_report("render", status, &error);
}
