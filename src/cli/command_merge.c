/* caustica merge: from part files of one render to its image. */
#include "base/text.h"
#include "cli/commands.h"
#include "cli/outputs.h"
#include "cli/progress.h"
#include "cli/say.h"

#include <stdio.h>

typedef struct merge_options {
    ca_text_list outputs;
    const char *stats, *tone, *part_path;
    ca_output_look look;
    ca_layer_choice layers;
    bool quiet, help;
} merge_options;

#define AT(field) .offset = offsetof(merge_options, field)

static const ca_option options[] = {
    {.name = "output",
     .letter = 'o',
     .argument = "FILE",
     .kind = CA_OPTION_TEXT_LIST,
     AT(outputs),
     .help = "file to write (needed): .exr, .png, .pfm or .part; several times"},
    CA_OUTPUT_OPTIONS(merge_options),
    {.name = "stats",
     .argument = "FILE.json",
     .kind = CA_OPTION_TEXT,
     AT(stats),
     .help = "write the parts' times and counts, added up, as JSON"},
    {.name = "quiet", .kind = CA_OPTION_FLAG, AT(quiet), .help = "print errors and warnings only"},
    {.name = "help", .letter = 'h', .kind = CA_OPTION_FLAG, AT(help), .help = "this text"},
};
static const ca_option_table table = {"merge", options, sizeof options / sizeof options[0]};

static int print_help(void)
{
    printf("caustica merge PART... -o FILE [options]: add up parts of a render\n\n");
    ca_options_print(&table, stdout);
    printf("\n");
    ca_options_print_prose(
        "The parts come from `caustica render SCENE --passes A:B -o FILE.part` (of qmcppm: --blocks A:B), on any "
        "machines, and are given in any order; a checkpoint is one, too.\n"
        "They must be of the same scene and settings, and may not overlap; an image needs all passes from 0. It is "
        "the "
        "same, to the bit, as that of one render of all of them. Passes may have gaps in a part file that is "
        "written, "
        "blocks may not.\n"
        "Example: caustica merge a.part b.part -o image.exr -o image.png\n",
        stdout);
    return CA_EXIT_DONE;
}

static ca_status check_places(merge_options *o, const ca_text_list *parts, ca_error *error)
{
    ca_places places = {0};
    ca_status status = CA_OK;
    for (size_t i = 0; i < parts->count && status == CA_OK; i++)
        status = ca_places_read(&places, parts->items[i], "which is to be merged", error);
    if (status == CA_OK) status = ca_outputs_check(&o->outputs, o->stats, &o->part_path, &places, error);
    ca_places_destroy(&places);
    return status;
}

static ca_status check(merge_options *o, const ca_text_list *parts, ca_error *error)
{
    if (parts->count == 0) return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "a part file to merge is missing");
    if (o->outputs.count == 0) return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "option --output is missing");
    CA_TRY(ca_outputs_find_tone(o->tone, &o->look, error));
    CA_TRY(check_places(o, parts, error));
    CA_TRY(ca_layer_choice_check(&o->layers, NULL, error));
    CA_TRY(ca_outputs_check_layers(o->outputs.items, o->outputs.count, &o->layers, error));
    return ca_outputs_check_look(o->outputs.items, o->outputs.count, &o->look, o->tone, error);
}

static void print_summary(const merge_options *o, const ca_render_statistics *s, size_t part_count)
{
    char time[32];
    ca_format_seconds(s->seconds, time, sizeof time);
    const bool blocks = s->blocks[1] > 0;
    const uint64_t *range = blocks ? s->blocks : s->passes;
    printf("%zu %s, %s %llu:%llu, %.4g %s per pixel, rendered in %s\n", part_count,
           ca_noun((double)part_count, "part", "parts"), blocks ? "blocks" : "passes", (unsigned long long)range[0],
           (unsigned long long)range[1], s->samples_per_pixel, ca_noun(s->samples_per_pixel, "sample", "samples"),
           time);
    for (size_t i = 0; i < o->outputs.count; i++) ca_say(stdout, "wrote %s\n", o->outputs.items[i]);
    if (o->stats) ca_say(stdout, "wrote %s\n", o->stats);
}

/* Parts that do not fit together are a failure, not wrong usage: the words were right. */
static ca_status merge(const merge_options *o, const ca_text_list *parts, ca_error *error)
{
    ca_image_layers *image = NULL;
    ca_render_statistics statistics = {0};
    ca_error reason = {""};
    const ca_output_files files = {o->outputs.items, o->outputs.count, o->look, o->layers, o->stats};
    const bool wants_image = o->outputs.count > (o->part_path ? 1 : 0);
    ca_status status =
        ca_merge_parts(parts->items, parts->count, o->part_path, wants_image ? &image : NULL, &statistics, error);
    if (status == CA_ERROR_ARGUMENT) status = CA_ERROR_UNSUPPORTED;
    if (statistics.iterations > 0) /* also where only the sum could not be written */
        ca_output_note(&status, error, ca_outputs_write(&files, image, &statistics, &reason), &reason);
    if (status == CA_OK && image) ca_layer_choice_warn(&o->layers, image);
    ca_image_release(image);
    if (status != CA_OK) return status;
    ca_outputs_warn(&statistics);
    if (!o->quiet) print_summary(o, &statistics, parts->count);
    return CA_OK;
}

int ca_command_merge(int word_count, char *const words[])
{
    if (ca_help_wanted(word_count, words)) return print_help();
    merge_options o = {0};
    ca_text_list parts = {0};
    ca_error error = {""};
    ca_status status = ca_options_parse(&table, word_count, words, &o, &parts, &error);
    if (status == CA_OK) status = check(&o, &parts, &error);
    if (status == CA_OK) status = merge(&o, &parts, &error);
    ca_text_list_destroy(&o.outputs);
    ca_text_list_destroy(&parts);
    return status == CA_OK ? CA_EXIT_DONE : ca_report("merge", status, &error);
}
