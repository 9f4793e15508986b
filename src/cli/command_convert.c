/* caustica convert: any scene that can be read, as Mitsuba 3 XML. */
#include "base/memory.h"
#include "cli/commands.h"
#include "cli/say.h"
#include "cli/shared_options.h"
#include "import/import.h"

#include <stdio.h>

typedef struct convert_options {
    ca_text_list define_words;
    const char *output;
    bool quiet, help;
} convert_options;

#define AT(field) .offset = offsetof(convert_options, field)

static const ca_option options[] = {
    {.name = "output",
     .letter = 'o',
     .argument = "FILE",
     .kind = CA_OPTION_TEXT,
     AT(output),
     .help = "file to write (needed): NAME.xml; what it is made from goes to the folder NAME-files beside it"},
    CA_DEFINE_OPTION(AT(define_words)),
    {.name = "quiet", .kind = CA_OPTION_FLAG, AT(quiet), .help = "print errors only, no notes"},
    CA_HELP_OPTION(AT(help)),
};
static const ca_option_table table = {"convert", options, sizeof options / sizeof options[0]};

static int print_help(void)
{
    printf("caustica convert SCENE -o NAME.xml [options]: write a scene as Mitsuba 3 XML\n\n");
    ca_options_print(&table, stdout);
    printf("\n");
    ca_options_print_prose(
        "The scene may be of any format that is read. The written one renders to the same bits; it has its includes "
        "and defaults resolved, and all its meshes as binary PLY, pictures and tables in a folder of its own, so "
        "that both can be moved together.\n"
        "What Mitsuba 3 does not know is written as Caustica has it, and told.\n"
        "Example: caustica convert scenes/textured/textured.xml -o copy.xml\n",
        stdout);
    return CA_EXIT_DONE;
}

static ca_status convert(const convert_options *o, const ca_text_list *operands, ca_error *error)
{
    ca_scene_source source;
    ca_define_words words;
    const char *path;
    CA_TRY(ca_options_scene_operand(operands, &path, error));
    if (!o->output) return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "no output is named: -o NAME.xml");
    ca_status status = ca_options_open_source(path, &o->define_words, &words, &source, error);
    ca_scene_desc desc = {0};
    if (status == CA_OK) status = ca_import_convert(&source, o->output, &desc, error);
    for (size_t i = 0; i < desc.notes.count && status == CA_OK && !o->quiet; i++)
        ca_say(stderr, "caustica: note: %s\n", desc.notes.items[i]);
    if (status == CA_OK) ca_scene_desc_destroy(&desc);
    ca_define_words_destroy(&words);
    return status;
}

int ca_command_convert(int word_count, char *const words[])
{
    if (ca_help_wanted(word_count, words)) return print_help();
    convert_options o = {0};
    ca_text_list operands = {0};
    ca_error error = {""};
    ca_status status = ca_options_parse(&table, word_count, words, &o, &operands, &error);
    if (status == CA_OK) status = convert(&o, &operands, &error);
    ca_text_list_destroy(&o.define_words);
    ca_text_list_destroy(&operands);
    return status == CA_OK ? CA_EXIT_DONE : ca_report("convert", status, &error);
}
