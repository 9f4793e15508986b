/* The commands of the program. Each gets the words after its name and gives back the exit status. */
#ifndef CA_CLI_COMMANDS_H
#define CA_CLI_COMMANDS_H

#include "cli/options.h"

/* Exit statuses. */
enum { CA_EXIT_DONE = 0, CA_EXIT_FAILED = 1, CA_EXIT_USAGE = 2 };

int ca_command_render(int word_count, char *const words[]);
int ca_command_compare(int word_count, char *const words[]);
int ca_command_noise(int word_count, char *const words[]);
int ca_command_converge(int word_count, char *const words[]);
int ca_command_merge(int word_count, char *const words[]);
int ca_command_study(int word_count, char *const words[]);
int ca_command_convert(int word_count, char *const words[]);
int ca_command_info(int word_count, char *const words[]);

/* What compare's --flip can be; NULL behind the last one. */
const char *ca_compare_flip_kind(size_t i);

/* Prints "caustica: message" to standard error, and for wrong usage where help is; gives back the exit status.
 * `command` is the command's name or NULL. */
int ca_report_usage(const char *command, const ca_error *error);
int ca_report_failure(const ca_error *error);
/* Wrong usage for CA_ERROR_ARGUMENT, a failure for everything else. */
int ca_report(const char *command, ca_status status, const ca_error *error);

/* Is one of the words before "--" exactly --help or -h? */
bool ca_help_wanted(int word_count, char *const words[]);

#endif
