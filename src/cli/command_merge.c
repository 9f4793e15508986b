/* caustica merge: from part files of one render to its image. */
#include "base/memory.h"
#include "base/text.h"
#include "cli/commands.h"
#include "cli/outputs.h"
#include "cli/progress.h"
#include "cli/say.h"
#include "cli/shared_options.h"
#include "render/merge_passes.h"

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
    CA_STATS_OPTION("the parts' times and counts, added up,", AT(stats)),
    CA_QUIET_OPTION(AT(quiet)),
    CA_HELP_OPTION(AT(help)),
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

/* The passes that the parts have, where some are missing between them; else none. */
typedef struct part_ranges {
    ca_pass_range *ranges; /* owned */
    size_t count;
} part_ranges;

/* Only a sum that is written as a part has gaps: the statistics tell its first and its last pass. */
static ca_status find_gaps(const ca_text_list *parts, const ca_render_statistics *s, part_ranges *found,
                           ca_error *error)
{
    *found = (part_ranges){NULL, 0};
    if (s->iterations >= s->passes[1] - s->passes[0]) return CA_OK;
    return ca_merge_ranges(parts->items, parts->count, &found->ranges, &found->count, error);
}

/* "0:2, 4:6 and 8:9", or what lies between them; of many the first ones. */
static void print_ranges(const part_ranges *found, bool gaps)
{
    enum { MOST = 8 };
    const size_t count = gaps ? found->count - 1 : found->count;
    const size_t told = count <= MOST ? count : MOST;
    for (size_t i = 0; i < told; i++) {
        const ca_pass_range *r = &found->ranges[i];
        printf("%s%llu:%llu", ca_list_separator(i, count, " and "), (unsigned long long)(gaps ? r->end : r->begin),
               (unsigned long long)(gaps ? r[1].begin : r->end));
    }
    if (told < count) printf(" and %zu more", count - told);
}

static void print_passes(const ca_render_statistics *s, const part_ranges *found)
{
    if (found->count == 0) {
        printf("passes %llu:%llu", (unsigned long long)s->passes[0], (unsigned long long)s->passes[1]);
        return;
    }
    printf("passes ");
    print_ranges(found, false);
    printf(" (missing between them: ");
    print_ranges(found, true);
    printf(")");
}

static void print_summary(const merge_options *o, const ca_render_statistics *s, size_t part_count,
                          const part_ranges *found)
{
    char time[32];
    ca_format_seconds(s->seconds, time, sizeof time);
    printf("%zu %s, ", part_count, ca_noun((double)part_count, "part", "parts"));
    if (s->blocks[1] > 0)
        printf("blocks %llu:%llu", (unsigned long long)s->blocks[0], (unsigned long long)s->blocks[1]);
    else
        print_passes(s, found);
    printf(", %.4g %s per pixel, rendered in %s\n", s->samples_per_pixel,
           ca_noun(s->samples_per_pixel, "sample", "samples"), time);
    for (size_t i = 0; i < o->outputs.count; i++) ca_say(stdout, "wrote %s\n", o->outputs.items[i]);
    if (o->stats) ca_say(stdout, "wrote %s\n", o->stats);
}

static ca_status write_outputs(const merge_options *o, const ca_image_layers *image, const ca_render_statistics *s,
                               const part_ranges *found, ca_error *error)
{
    const ca_output_files files = {.paths = o->outputs.items,
                                   .count = o->outputs.count,
                                   .look = o->look,
                                   .layers = o->layers,
                                   .stats = o->stats,
                                   .ranges = found->ranges,
                                   .range_count = found->count};
    return ca_outputs_write(&files, image, s, error);
}

/* Parts that do not fit together are a failure, not wrong usage: the words were right. */
static ca_status merge(const merge_options *o, const ca_text_list *parts, ca_error *error)
{
    ca_image_layers *image = NULL;
    ca_render_statistics statistics = {0};
    part_ranges found = {NULL, 0};
    ca_error reason = {""};
    const bool wants_image = o->outputs.count > (o->part_path ? 1 : 0);
    ca_status status =
        ca_merge_parts(parts->items, parts->count, o->part_path, wants_image ? &image : NULL, &statistics, error);
    if (status == CA_ERROR_ARGUMENT) status = CA_ERROR_UNSUPPORTED;
    if (statistics.iterations > 0) { /* also where only the sum could not be written */
        ca_output_note(&status, error, find_gaps(parts, &statistics, &found, &reason), &reason);
        ca_output_note(&status, error, write_outputs(o, image, &statistics, &found, &reason), &reason);
    }
    if (status == CA_OK && image) ca_layer_choice_warn(&o->layers, image);
    ca_image_release(image);
    if (status == CA_OK) ca_outputs_warn(&statistics);
    if (status == CA_OK && !o->quiet) print_summary(o, &statistics, parts->count, &found);
    ca_free(found.ranges);
    return status;
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
