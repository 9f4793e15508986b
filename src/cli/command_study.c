/* caustica study: renders the images of a perceptual study and the page that runs it, and analyses the answers. */
#include "cli/commands.h"
#include "cli/outputs.h"
#include "cli/shared_options.h"
#include "cli/signals.h"
#include "cli/study_analyse.h"
#include "cli/study_page.h"

#include <stdio.h>

typedef struct study_options {
    const char *folder, *stats;
    uint32_t threads;
    bool analyse, quiet, help;
} study_options;

#define AT(field) .offset = offsetof(study_options, field)

static const ca_option options[] = {
    {.name = "output",
     .letter = 'o',
     .argument = "FOLDER",
     .kind = CA_OPTION_TEXT,
     AT(folder),
     .help = "where images and the page index.html go (needed, but for --analyse)"},
    {.name = "analyse",
     .kind = CA_OPTION_FLAG,
     AT(analyse),
     .help = "the files are answers that the page exported: say what they say"},
    CA_STATS_OPTION("the numbers of --analyse", AT(stats)),
    CA_THREADS_OPTION("; the images do not depend on it", AT(threads)),
    CA_QUIET_OPTION(AT(quiet)),
    CA_HELP_OPTION(AT(help)),
};
static const ca_option_table table = {"study", options, sizeof options / sizeof options[0]};

static int print_help(void)
{
    printf("caustica study CONFIG.json -o FOLDER [options]: make a perceptual study, or analyse its answers\n\n");
    ca_options_print(&table, stdout);
    printf("\n");
    ca_options_print_prose(
        "Renders an image and a reference of each scenario in CONFIG.json (docs/study.md), and writes "
        "FOLDER/index.html: a page that shows both for some seconds, asks whether there was a difference, "
        "keeps the answers and exports them. Images that are there and were rendered with the same settings "
        "are not rendered again.\n"
        "With --analyse the files are such answers, of one study: printed are the ratio of subjects who saw a"
        " difference in each scenario, with its 95 % interval, and whether occluded lights make it be seen "
        "more often.\n"
        "Examples: caustica study scenes/perceptual-study/study.json -o study\n"
        "          caustica study --analyse answers-1.json answers-2.json\n",
        stdout);
    return CA_EXIT_DONE;
}

static ca_status check_analysis(const study_options *o, const ca_text_list *files, ca_error *error)
{
    ca_places places = {0};
    ca_status status = CA_OK;
    for (size_t i = 0; i < files->count && status == CA_OK; i++)
        status = ca_places_read(&places, files->items[i], "which holds answers", error);
    if (status == CA_OK && o->stats) status = ca_places_write(&places, o->stats, "--stats", error);
    ca_places_destroy(&places);
    return status == CA_OK && o->stats ? ca_output_check_place(o->stats, error) : status;
}

static ca_status check(const study_options *o, const ca_text_list *files, ca_error *error)
{
    if (o->analyse) {
        if (files->count == 0) return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "a file of answers is missing");
        if (o->folder)
            return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "--analyse renders nothing: -o has no meaning with it");
        return check_analysis(o, files, error);
    }
    if (files->count != 1)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       files->count == 0 ? "the study's file is missing"
                                         : "there is more than one study (answers need --analyse)");
    if (!o->folder) return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "option --output is missing");
    if (o->stats) return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "--stats needs --analyse");
    return ca_output_check_folder(o->folder, error);
}

static ca_status make_study(const study_options *o, const char *path, ca_error *error)
{
    ca_study_config config;
    ca_places places = {0};
    uint64_t id;
    ca_status status = ca_study_config_read(path, &config, error);
    ca_study_work work = {
        .config = &config, .folder = o->folder, .threads = o->threads, .quiet = o->quiet, .places = &places};
    if (status == CA_OK) status = ca_options_scene_memory(&work.memory_mib, error);
    if (status == CA_OK) status = ca_places_read(&places, path, "which is the study", error);
    if (status == CA_OK) status = ca_places_write_in(&places, o->folder, "index.html", "--output", error);
    ca_signals_catch_save(); /* pictures are written when they are done: the work goes on */
    if (status == CA_OK) status = ca_study_render_images(&work, &id, error);
    ca_signals_release_save();
    if (status == CA_OK) status = ca_study_write_page(&work, id, error);
    ca_study_config_destroy(&config);
    ca_places_destroy(&places);
    return status;
}

static ca_status analyse(const study_options *o, const ca_text_list *files, ca_error *error)
{
    ca_study_answers answers;
    ca_study_analysis analysis = {0};
    ca_status status = ca_study_answers_read(files->items, files->count, &answers, error);
    if (status == CA_OK) status = ca_study_analyse(&answers, &analysis, error);
    if (status == CA_OK && !o->quiet) ca_study_print(&analysis);
    if (status == CA_OK && o->stats) status = ca_study_write_json(o->stats, &analysis, error);
    ca_study_analysis_destroy(&analysis);
    ca_study_answers_destroy(&answers);
    return status;
}

int ca_command_study(int word_count, char *const words[])
{
    if (ca_help_wanted(word_count, words)) return print_help();
    study_options o = {0};
    ca_text_list files = {0};
    ca_error error = {""};
    ca_status status = ca_options_parse(&table, word_count, words, &o, &files, &error);
    if (status == CA_OK) status = check(&o, &files, &error);
    if (status == CA_OK) status = o.analyse ? analyse(&o, &files, &error) : make_study(&o, files.items[0], &error);
    ca_text_list_destroy(&files);
    return status == CA_OK ? CA_EXIT_DONE : ca_report("study", status, &error);
}
