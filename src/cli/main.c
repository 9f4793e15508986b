/* The program `caustica`: finds the command and hands the rest of the words to it. */
#define _POSIX_C_SOURCE 200809L
#include "base/text.h"
#include "cli/commands.h"

#include <signal.h>
#include <stdio.h>
#include <string.h>

typedef struct command {
    const char *name, *summary;
    int (*run)(int word_count, char *const words[]);
} command;

static const command commands[] = {
    {"render", "make an image of a scene", ca_command_render},
    {"noise", "say where noise comes from, and what other numbers of paths would give", ca_command_noise},
    {"compare", "measure how images differ from a reference", ca_command_compare},
    {"converge", "see how fast the error of integrators falls", ca_command_converge},
    {"merge", "add up parts of a render", ca_command_merge},
    {"study", "make a perceptual study of how images are seen, or analyse its answers", ca_command_study},
    {"info", "say what was understood of a scene", ca_command_info},
};
enum { COMMAND_COUNT = sizeof commands / sizeof commands[0] };

static void print_help(void)
{
    printf("caustica %s: a physically based renderer for light through glass and mirrors\n\n"
           "  caustica COMMAND ...\n\n",
           ca_version());
    for (int i = 0; i < COMMAND_COUNT; i++) printf("  %-10s%s\n", commands[i].name, commands[i].summary);
    printf("\n"
           "  caustica COMMAND --help    options of a command\n"
           "  caustica --version\n\n"
           "Example: caustica render scenes/cornell-box/cornell-box.xml -o box.exr -o box.png\n"
           "Exit status: 0 done, 1 failed, 2 wrong usage.\n");
}

static int unknown_command(const char *word)
{
    const char *names[COMMAND_COUNT];
    for (int i = 0; i < COMMAND_COUNT; i++) names[i] = commands[i].name;
    const char *nearest = ca_nearest_name(word, names, COMMAND_COUNT);
    ca_error error;
    if (nearest)
        ca_fail(&error, CA_ERROR_ARGUMENT, NULL, "command \"%s\" is not known; did you mean \"%s\"?", word, nearest);
    else
        ca_fail(&error, CA_ERROR_ARGUMENT, NULL, "command \"%s\" is not known", word);
    return ca_report_usage(NULL, &error);
}

static int run(int argument_count, char *arguments[])
{
    if (argument_count < 2) {
        ca_error error;
        ca_fail(&error, CA_ERROR_ARGUMENT, NULL, "a command is missing");
        return ca_report_usage(NULL, &error);
    }
    const char *word = arguments[1];
    if (strcmp(word, "--help") == 0 || strcmp(word, "-h") == 0) {
        print_help();
        return CA_EXIT_DONE;
    }
    if (strcmp(word, "--version") == 0) {
        printf("caustica %s\n", ca_version());
        return CA_EXIT_DONE;
    }
    for (int i = 0; i < COMMAND_COUNT; i++)
        if (strcmp(word, commands[i].name) == 0) return commands[i].run(argument_count - 2, arguments + 2);
    return unknown_command(word);
}

int main(int argument_count, char *arguments[])
{
    /* A file over the size limit is then a write error: it gets a message, and what was half written is removed. */
    signal(SIGXFSZ, SIG_IGN);
    const int status = run(argument_count, arguments);
    /* What was printed counts only when it has arrived (a full disk, a closed pipe). */
    if ((fflush(stdout) != 0 || ferror(stdout)) && status == CA_EXIT_DONE) {
        fprintf(stderr, "caustica: standard output cannot be written\n");
        return CA_EXIT_FAILED;
    }
    return status;
}
