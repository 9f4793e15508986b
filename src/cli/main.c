/* The program `caustica`: finds the command and hands the rest of the words to it. */
#define _POSIX_C_SOURCE 200809L
#include "cli/candidates.h"
#include "cli/commands.h"
#include "cli/mpi_ranks.h"

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
    {"convert", "write a scene of any format as Mitsuba 3 XML", ca_command_convert},
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
           "  caustica COMMAND --help    options of a command; also: caustica help COMMAND\n"
           "  caustica --version         also: caustica version\n\n"
           "Example: caustica render scenes/cornell-box/cornell-box.xml -i auto -o box.exr -o box.png\n"
           "Exit status: 0 done, 1 failed, 2 wrong usage.\n");
}

static const command *find_command(const char *word)
{
    for (int i = 0; i < COMMAND_COUNT; i++)
        if (strcmp(word, commands[i].name) == 0) return &commands[i];
    return NULL;
}

static int unknown_command(const char *word)
{
    const char *names[COMMAND_COUNT + 2] = {"help", "version"};
    for (int i = 0; i < COMMAND_COUNT; i++) names[i + 2] = commands[i].name;
    const char *nearest = ca_options_nearest(word, names, COMMAND_COUNT + 2);
    ca_error error;
    if (nearest)
        ca_fail(&error, CA_ERROR_ARGUMENT, NULL, "command \"%s\" is not known; did you mean \"%s\"?", word, nearest);
    else
        ca_fail(&error, CA_ERROR_ARGUMENT, NULL, "command \"%s\" is not known", word);
    return ca_report_usage(NULL, &error);
}

/* Words behind "help" that have no help of their own. */
static bool is_general_help(const char *word)
{
    static const char *const names[] = {"help", "--help", "-h", "version"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++)
        if (strcmp(word, names[i]) == 0) return true;
    return false;
}

/* "caustica help", "caustica help COMMAND". With --integrators the words that can be completed behind -i, with
 * --values those behind other options: the help has defaults and sentences there, so that a script needs another
 * text. They are not in the help. */
static int help(int word_count, char *const words[])
{
    char *const wanted[] = {(char[]){"--help"}};
    if (word_count > 1) {
        ca_error error;
        ca_fail(&error, CA_ERROR_ARGUMENT, NULL, "help is of one command, not of %d", word_count);
        return ca_report_usage(NULL, &error);
    }
    if (word_count == 1 && strcmp(words[0], "--integrators") == 0) {
        ca_candidates_print(stdout);
        return CA_EXIT_DONE;
    }
    if (word_count == 1 && strcmp(words[0], "--values") == 0) {
        ca_candidates_print_values(stdout);
        return CA_EXIT_DONE;
    }
    if (word_count == 1 && !is_general_help(words[0])) {
        const command *found = find_command(words[0]);
        return found ? found->run(1, wanted) : unknown_command(words[0]);
    }
    print_help();
    return CA_EXIT_DONE;
}

/* "caustica version" and "caustica --version" take no words. */
static int version(int word_count, char *const words[])
{
    ca_error error;
    if (word_count > 0) {
        ca_fail(&error, CA_ERROR_ARGUMENT, NULL, "version takes nothing more, but \"%s\" is given", words[0]);
        return ca_report_usage(NULL, &error);
    }
    printf("caustica %s\n", ca_version());
    return CA_EXIT_DONE;
}

/* Of several ranks all render, and one does everything else. */
static bool is_idle(int argument_count, char *const arguments[])
{
    return ca_ranks_helps(ca_mpi_ranks()) && (argument_count < 2 || strcmp(arguments[1], "render") != 0);
}

static int run(int argument_count, char *arguments[])
{
    if (is_idle(argument_count, arguments)) return CA_EXIT_DONE;
    if (argument_count < 2) {
        ca_error error;
        ca_fail(&error, CA_ERROR_ARGUMENT, NULL, "a command is missing");
        return ca_report_usage(NULL, &error);
    }
    const char *word = arguments[1];
    if (strcmp(word, "help") == 0) return help(argument_count - 2, arguments + 2);
    if (strcmp(word, "--help") == 0 || strcmp(word, "-h") == 0) return help(0, NULL);
    if (strcmp(word, "--version") == 0 || strcmp(word, "version") == 0)
        return version(argument_count - 2, arguments + 2);
    const command *found = find_command(word);
    return found ? found->run(argument_count - 2, arguments + 2) : unknown_command(word);
}

int main(int argument_count, char *arguments[])
{
    /* A file over the size limit is then a write error: it gets a message, and what was half written is removed. */
    signal(SIGXFSZ, SIG_IGN);
    /* Nor does a reader that has gone (`| tee log`, ended by the same Ctrl-C) end a render without its picture. */
    signal(SIGPIPE, SIG_IGN);
    ca_error error = {""};
    const ca_status started = ca_mpi_start(&error);
    const int status = started == CA_OK ? run(argument_count, arguments) : ca_report(NULL, started, &error);
    ca_mpi_end();
    /* What was printed counts only when it has arrived (a full disk, a closed pipe). */
    if ((fflush(stdout) != 0 || ferror(stdout)) && status == CA_EXIT_DONE) {
        fprintf(stderr, "caustica: standard output cannot be written\n");
        return CA_EXIT_FAILED;
    }
    return status;
}
